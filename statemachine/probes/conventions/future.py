"""Whether a run that is set back has the future that it had."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...interface import Array
from . import Figure, Finding, Findings, Question
from . import _bullet_scene as bullet
from . import _mujoco_scene as mujoco_scene
from ._bullet import world
from .save import BULLET_WAYS, mujoco_ways, used_data

QUESTION = Question(
    "You set a run back in which boxes fall on each other: is its future the same?",
    "A replay that is almost the same is another run a few contacts later. 'Exact' is what "
    "these few trials showed, bit by bit: it is no promise for another scene.",
)
_MOMENTS = (0.3, 0.4, 0.5, 0.6, 0.7)  # when the boxes have met; a trial each [s]
_STEPS = 200  # of the futures

Futures = tuple[Array, Array]  # of one trial: places at every step (n, 7·boxes + 1), twice


def _found(way: str, trials: Sequence[Futures]) -> Finding:
    exact = sum(np.array_equal(first, second) for first, second in trials)
    off = max(_apart(*futures) for futures in trials)
    return Finding(
        "exact" if exact == len(trials) else "differs",
        (Figure("exact in", f"{exact} of {len(trials)}"), Figure("boxes off by", off, "m")),
        way,
    )


def _apart(first: Array, second: Array) -> float:
    """The largest difference in a coordinate of a box [m]."""
    boxes = (first - second)[:, :-1].reshape(len(first), -1, 7)
    return float(np.abs(boxes[..., :3]).max())


def mujoco() -> Findings:
    """Boxes that fall, set back to the start or to moments in the middle."""
    mj, model, data = mujoco_scene.scene()

    def run(steps: int = _STEPS) -> Array:
        return mujoco_scene.run(mj, model, data, steps)

    def middle(save: Callable[[], Callable[[], None]], moment: float) -> Futures:
        mj.mj_resetData(model, data)
        run(round(moment / model.opt.timestep))
        restore = save()
        first = run()
        restore()
        return first, run()

    first = run()
    mj.mj_resetData(model, data)
    found = [_found("mj_resetData", [(first, run())])]
    for name, save in mujoco_ways(mj, model, data).items():
        found.append(_found(name, [middle(save, moment) for moment in _MOMENTS]))
    return tuple(found)


def pybullet() -> Findings:
    """The same, each trial in a world of its own."""

    def middle(saved: bullet.Saved, moment: float) -> Futures:
        with world() as (pb, client):
            scene = bullet.build(pb, client)
            step = pb.getPhysicsEngineParameters(client)["fixedTimeStep"]
            bullet.run(scene, round(moment / step))
            with saved(scene) as restore:
                first = bullet.run(scene, _STEPS)
                restore()
                return first, bullet.run(scene, _STEPS)

    def start(way: bullet.Reset) -> Futures:
        with world() as (pb, client):
            scene = bullet.build(pb, client)
            return bullet.run(scene, _STEPS), bullet.run(way(scene), _STEPS)

    return (
        *(_found(name, [start(way)]) for name, way in bullet.RESETS.items()),
        *(
            _found(name, [middle(saved, moment) for moment in _MOMENTS])
            for name, saved in BULLET_WAYS.items()
        ),
    )


def pinocchio() -> Findings:
    """Whether a used Data computes anything else than a new one, of the same q and v."""
    off = used_data()
    figures = (Figure("acceleration off by", off, "rad/s²"),)
    return (Finding("differs" if off else "exact", figures, "a used Data, a new one"),)
