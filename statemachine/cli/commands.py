"""The commands of the command line, a file or a folder each; importing them loads no engine.

A command is a module of this package, imported when it is typed, with two functions: `add(parser)`
gives the parser its options, and `run(options)` takes the parsed ones and returns the exit code.
What was typed becomes a Request in one place, `request_of(options)`; the room that the Request is
of answers it, and the command shows the answer.
"""

from __future__ import annotations

# What --help says of each, in its order.
COMMANDS = {
    "lesson": "the guided path, or one lesson alone",
    "check": "judge an exercise by what it does",
    "compare": "where two engines differ, by how much, and why",
    "doctor": "what this machine has, and what to do",
    "view": "a running simulation in the browser, with sliders",
    "trace": "record a run, play it on another engine, look into it, draw it",
    "sweep": "an experiment at many settings, on every engine, as a dataset",
    "robots": "any folder of models: what each does on every engine",
    "fingertip": "the engine's fingertip against an independent witness",
    "validate": "every engine against closed forms: who is right, by how much",
    "policy": "a walking policy on each engine, as its contract says",
    "conventions": "what each engine takes for granted, asked of the engines",
    "engines": "other releases of an engine, to run and to compare",
}
FIRST = ("lesson", "check", "compare", "doctor")  # the others are under "more"
