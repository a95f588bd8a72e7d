"""What must be here for a test to run: engines, and data from beside the checkout."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NoReturn

import pytest

from statemachine.errors import MissingEngineError
from statemachine.installed import require

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
REQUIRED = set(filter(None, os.environ.get("STATEMACHINE_REQUIRE", "").split(",")))


def absent(name: str, reason: object) -> NoReturn:
    """Skip without what is not here, or fail where STATEMACHINE_REQUIRE names it."""
    if name in REQUIRED:
        pytest.fail(f"STATEMACHINE_REQUIRE names {name}: {reason}")
    pytest.skip(str(reason))


def need_engine(name: str) -> None:
    """Skip without an engine, or fail where STATEMACHINE_REQUIRE names it."""
    try:
        require(name)
    except MissingEngineError as error:
        absent(name, error)


def shared(path: Path) -> Path:
    """Return data of the public model, which are not part of the project; skip without them."""
    if not path.exists():
        absent("shared", f"no {path.relative_to(SHARED.parent)} beside the checkout")
    return path
