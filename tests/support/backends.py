"""Backends that are known for a while, releases of engines, and what an engine holds."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine import backends, releases
from statemachine.backends.served.engine_process import ServedEngine, Server
from statemachine.backends.served.release_backend import served
from statemachine.errors import UnsupportedError
from statemachine.installed import engine_version, require
from statemachine.interface import DERIVED, Behaviour


@contextmanager
def registered(name: str, loader: str) -> Iterator[str]:
    """Register a backend of another package under a name for a while."""
    backends.register(name, loader)
    try:
        yield name
    finally:
        backends.BACKENDS.pop(name)


# What a claim names where it is of these two engines, and not of every backend.
BOTH = ("mujoco", "pybullet")
# A test of what these two do, with the fixtures of `conftest` that hang on `backend`.
each_of_both = pytest.mark.parametrize("backend", BOTH, indirect=True)


def slow_on(name: str, among: Sequence[str] = ()) -> list[Any]:
    """Return parameters of the fixture `backend` of which one is for the slow part.

    Args:
        name: The backend that is slow.
        among: Those of which the claim is; every backend where it is the contract's.
    """
    return [
        pytest.param(each, marks=pytest.mark.slow) if each == name else each
        for each in among or backends.backend_names()
    ]


def readable_arrays(model: sm.Model) -> list[str]:
    """Return what can be read of a Data: what is derived.

    Forces and contacts are left out that the engine does not tell, where its record says so.
    """
    behaviours = model.capabilities.behaviours
    names = [*DERIVED, "contacts"]
    doubtful: list[str] = []
    if behaviours["forces by part"].support == "unsupported":
        doubtful += [name for name in names if name.startswith("qfrc")]
    if behaviours["contacts"].support == "unsupported":
        doubtful.append("contacts")
    if not doubtful:
        return names
    with sm.make_data(model) as data:
        return [name for name in names if name not in doubtful or _is_told(data, name)]


def _is_told(data: sm.Data, name: str) -> bool:
    """Tell whether an engine tells of something that is derived."""
    try:
        getattr(data, name)
    except UnsupportedError:
        return False
    return True


def bullet_clients() -> set[int]:
    """Return the worlds of PyBullet in this process that nobody closed or lost."""
    gc.collect()
    pb: Any = require("pybullet")
    return {client for client in range(1024) if pb.isConnected(client)}


# An old one, one that is too old for the arm, and the one that is installed.
RELEASES = ("mujoco==3.3.7", "mujoco==3.0.1", f"mujoco=={engine_version('mujoco')}")


def process_of(model: Any) -> int:
    """Return the number of the process in which the engine of a Model runs."""
    return Server.of(model.reading.engine).pid


def load_made_up(path: Path, defaults: Any = "model") -> Any:
    """Load a backend of another package, whose engine is in a Python of its own."""
    engine = ServedEngine(
        "made up",
        str(releases.python_of(RELEASES[-1])),
        str(Path(__file__).with_name("made_up_child.py")),
        "the made-up engine",
    )
    native = sm.load("so101").capabilities
    behaviours = {
        **native.behaviours,
        **dict.fromkeys(("contacts", "forces by part"), Behaviour("unsupported", "it tells none")),
    }
    flags = {"actuation", "contacts", "limits"}
    said = replace(
        native, options=tuple(sorted(set(native.options) - flags)), behaviours=behaviours
    )
    return served(engine, said)(path, defaults)
