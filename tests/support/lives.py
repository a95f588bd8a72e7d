"""Many worlds beside a Data for each: they lead one life, and are the same bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import statemachine as sm
from statemachine import worlds
from statemachine.interface.worlds import WRITABLE


def equal(many: worlds.Worlds, data: Sequence[sm.Data], ids: Any = None) -> None:
    """Assert that each world is what its Data is."""
    for i in range(many.n) if ids is None else ids:
        for name in (*WRITABLE, *many.derived):
            ours, single = getattr(many, name)[i], np.asarray(getattr(data[i], name))
            assert ours.shape == single.shape
            assert np.array_equal(ours, single, equal_nan=True), (i, name)


def live(
    many: worlds.Worlds, models: Sequence[sm.Model], rounds: int, seed: int = 1, reach: float = 0.8
) -> None:
    """Drive worlds and a Data of each model through the same rounds, and compare after each.

    Every second begins with a change: one after another of `changes`, to a world of `seed`.
    """
    rng, data, world = np.random.default_rng(seed), [sm.make_data(model) for model in models], 0
    kept: list[tuple[sm.State, sm.State]] = []

    def reset(key: int | None) -> None:
        worlds.reset(many, ids=[world], keyframe=key)
        sm.reset(models[world], data[world], key)

    def keep() -> None:
        states = worlds.get_states(many)
        kept[:] = [
            (worlds.get_state(many, i), sm.get_state(model, data[i]))
            for i, model in enumerate(models)
        ]
        assert [states.pop(i) for i in range(many.n)] == [single for _, single in kept]
        assert all(ours == single for ours, single in kept)

    def take_back() -> None:  # either is the other's
        worlds.set_state(many, world, kept[world][1])
        sm.set_state(models[world], data[world], kept[world][0])

    def take_all_back() -> None:
        worlds.set_states(many, dict(enumerate(single for _, single in kept)))
        for model, each, (ours, _) in zip(models, data, kept, strict=True):
            sm.set_state(model, each, ours)

    def write() -> None:  # reaches one world, with the next step that is for it
        many.qpos[world, 0] = data[world].qpos[0] = 0.25
        many.qvel[world, -1] = data[world].qvel[-1] = -0.0

    def set_time() -> None:
        many.time[world] += rng.choice([-1.0, -0.05, -0.013, 0.02])
        data[world].time = many.time[world]

    def forward() -> None:
        worlds.forward(many, ids=[world])
        sm.forward(models[world], data[world])

    changes: list[Callable[[], None]] = [
        *(keep, forward, set_time, take_back, write, take_all_back, lambda: reset(None)),
        *([lambda: reset(0)] if models[0].keyframes else []),
    ]
    equal(many, data)
    if models[0].keyframes:
        worlds.reset(many, keyframe=0)
        for model, each in zip(models, data, strict=True):
            sm.reset(model, each, 0)
    for k in range(rounds):
        world = int(rng.integers(many.n))
        if k % 2 == 0:
            changes[k // 2 % len(changes)]()
            equal(many, data)
        if rng.random() < 0.5:
            many.ctrl = rng.uniform(-reach, reach, many.ctrl.shape)
            for each, row in zip(data, many.ctrl, strict=True):
                each.ctrl = row
        nstep, mask = int(rng.integers(1, 5)), rng.random(many.n) < 0.8
        some = (None, mask, np.flatnonzero(mask)[::-1])[k % 3]
        fresh = bool(rng.random() < 0.3)
        worlds.step(many, nstep, ids=some, forward=fresh)
        for i in np.flatnonzero(mask).tolist() if some is not None else range(many.n):
            sm.step(models[i], data[i], nstep)
            if fresh:
                sm.forward(models[i], data[i])
        equal(many, data)
    for each in data:
        each.close()
