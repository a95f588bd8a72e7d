"""What the files of the project say: its metadata, its pinned versions, its Makefile."""

from __future__ import annotations

import tomllib
from functools import cache
from typing import Any

from .requirements import ROOT


@cache
def project_table() -> dict[str, Any]:
    """Return the table `project` of pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


@cache
def pinned_lines() -> list[str]:
    """Return the lines of constraints.txt, without its comments."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    return [line for line in lines if line[:1] != "#"]


@cache
def makefile_text() -> str:
    """Return the text of the Makefile."""
    return (ROOT / "Makefile").read_text("utf-8")
