"""The commands of the command line, one file each; importing them loads no engine.

A command is a module with `add(commands)`, which gives the parser a subparser whose
default `run` takes the parsed options and returns the exit code.
"""

from __future__ import annotations

from . import audit, check, compare, conventions, doctor, fingertip, lesson, trace, view

# In the order in which --help shows them.
COMMANDS = (lesson, check, conventions, audit, fingertip, compare, trace, view, doctor)
