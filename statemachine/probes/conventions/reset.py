"""What is still there after a reset."""

from __future__ import annotations

from collections.abc import Collection

from ...installed import require
from . import Figure, Finding, Findings, Question
from . import _bullet_scene as bullet
from . import _mujoco_scene as mujoco_scene
from ._bullet import world
from ._lacking import lacking

QUESTION = Question(
    "You reset: what is still there?",
    "An episode that starts with something of the last one is no repetition. What a reset "
    "leaves alone has to be set by hand.",
)


def _found(kept: Collection[str], gone: Collection[str], way: str) -> Finding:
    return Finding(
        "keeps " + (", ".join(kept) or "nothing"),
        (Figure("sets back", tuple(gone)),),
        way,
    )


def mujoco() -> Findings:
    """Every quantity changed, then mj_resetData."""
    mj, model, data = mujoco_scene.scene()
    bodies = model.nbody
    mj.mj_step(model, data, 300)
    written = mujoco_scene.write(model, data, 0.125)
    mj.mj_resetData(model, data)
    same = mujoco_scene.same(written, mujoco_scene.read(model, data))
    names = [*mujoco_scene.QUANTITIES, "bodies"]
    same |= {"bodies"} if model.nbody == bodies else set()
    kept = [name for name in names if name in same]
    return (_found(kept, [name for name in names if name not in same], "mj_resetData"),)


def pybullet() -> Findings:
    """Every quantity changed, then resetSimulation, or everything put where it began."""
    return tuple(_after(way, name) for name, way in bullet.RESETS.items())


def _after(way: bullet.Reset, name: str) -> Finding:
    names = [*bullet.QUANTITIES, "bodies"]
    # Half of anything is not what it has at the start.
    kept = [quantity for quantity in bullet.QUANTITIES if bullet.survives(quantity, 0.5, way)]
    with world() as (pb, client):
        scene = bullet.build(pb, client)
        bodies = pb.getNumBodies(client)
        way.call(scene)
        kept += ["bodies"] if pb.getNumBodies(client) == bodies else []
    gone = [each for each in names if each not in kept]
    return _found(kept, [f"{each} (gone)" if each == "bodies" else each for each in gone], name)


def pinocchio() -> Findings:
    """Whether there is anything of the name; its Data has no state to go back to."""
    return (lacking(require("pinocchio"), "reset"),)
