"""What is asked by Python: worlds, states, student files, and the checks of the contract."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import statemachine as sm
from examples import held_box, reach
from examples.arm import play
from statemachine import conformance
from statemachine.gym import make_vec
from statemachine.interface import DERIVED
from statemachine.worlds import get_state, make_worlds, record, reset, set_state, step

from .figures import Figures, curve


def contract(backend: str) -> Figures:
    """Return the outcome of each check of the contract."""
    return {outcome.check: str(outcome.result) for outcome in conformance.run(backend)}


def one_data(backend: str) -> Figures:
    """Step, save, restore and read a Data with a box in its jaws."""
    model = sm.load("so101/scene_box", backend=backend)
    with sm.make_data(model) as data:
        sm.reset(model, data, keyframe=0)
        data.ctrl[:2] += (0.4, -0.2)
        sm.step(model, data, 100)
        saved = sm.get_state(model, data)
        figures: Figures = {"qpos after 100 steps": data.qpos.tolist()}
        futures = []
        for _ in range(2):
            sm.set_state(model, data, saved)
            sm.step(model, data, 50)
            futures.append(np.concatenate([data.qpos, data.qvel]))
        figures["two restores have the same future"] = bool(np.array_equal(*futures))
        sm.forward(model, data)
        figures |= {name: curve(getattr(data, name)) for name in DERIVED}
        figures["contacts"] = len(data.contacts)
        figures["time [s]"] = data.time
    return figures


def many_worlds(backend: str) -> Figures:
    """Step eight worlds of one Model, each under another command."""
    model = sm.load("so101/scene_box", backend=backend)
    with make_worlds(model, 8, workers=2) as worlds:
        reset(worlds, keyframe=0)
        worlds.ctrl[:, 0] = np.linspace(-0.5, 0.5, 8)
        step(worlds, 60)
        figures = {"qpos after 60 steps": curve(worlds.qpos), "tips": curve(worlds.site_xpos)}
        set_state(worlds, 5, get_state(worlds, 3))
        rows = record(worlds, 20, ("qpos", "time"), every=5)
        figures |= {f"recorded {name}": curve(array) for name, array in rows.items()}
        reset(worlds, ids=[0, 2])
        step(worlds, 5, ids=[0, 1])
        figures["time [s]"] = worlds.time.tolist()
    return figures


def tasks(backend: str) -> Figures:
    """Run four episodes of each task at once, by chance and by the scripted policy."""
    figures: Figures = {}
    for task, example in (("Reach", reach), ("HeldBox", held_box)):
        envs = make_vec(num_envs=4, **example.task(backend))
        for policy, actions in example.policies(envs.model).items():
            run = play(envs, actions, seed=0)
            for name in ("distance", "steps", "returned"):
                figures[f"{task} | {policy} | {name}"] = curve(getattr(run, name))
        envs.close()
    return figures


def student_files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield a wrong and a right attempt at each function in a file, as a student hands it in.

    The others of tests/support/exercises are judged in `tests/test_check.py`.
    """
    exercises = importlib.import_module("tests.support.exercises")
    firsts: dict[tuple[str, bool], Any] = {}
    for attempt in (*exercises.WRONG, *exercises.RIGHT):
        firsts.setdefault((attempt.solves, attempt in exercises.RIGHT), attempt)
    for attempt in firsts.values():
        file = folder / f"{attempt.solves} {attempt.name.partition('-')[2]}.py"
        file.write_text(attempt.text, "utf-8")
        yield file.stem, file
