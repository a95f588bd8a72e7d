"""Types of what MuJoCo's compiler makes, for modules that do not import MuJoCo.

MuJoCo ships no types: to a type checker both are anything. Read them for what they are.
"""

from __future__ import annotations

from typing import Any, TypeAlias

MjModel: TypeAlias = Any  # a compiled model: arrays by name, as MuJoCo's manual lists them
MjData: TypeAlias = Any  # the working memory of what is computed of a compiled model
