"""The state that a run starts in: what it is called, shapes inside each other, bodies asleep.

Contacts throw such a robot apart, with forces that no design meant. What is told of is the state
that is used: another one may be free of that, or alone have it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..installed import DEFAULT, require
from ..interface import MOCAP, Array, Model

_PLACES = ("qpos", *MOCAP)
_ROUNDING = 1e-9  # of what is copied from one engine to another


def usual_start(model: Model) -> str | None:
    """Return the keyframe "home" if a Model has one, as is the custom; None: the default state."""
    return "home" if any(frame.name == "home" for frame in model.keyframes) else None


def overlaps_in(model: Model, keyframe: int | str | None) -> list[str]:
    """Return the shapes inside each other in a keyframe, as `measures.overlaps` has them.

    Args:
        model: The Model; of one that does not start from a compiled one nothing is said.
        keyframe: Its number or its name; None for the default state.
    """
    return _overlaps(model, places_in(model, keyframe))


def overlap_warning(model: Model, places: Mapping[str, Array]) -> str:
    """Return a sentence of the shapes inside each other in a state, which it names; or "".

    Args:
        model: The Model.
        places: Of `places_in`, or of a Data.
    """
    pairs = _overlaps(model, places)
    if not pairs:
        return ""
    from ..measures.text import few

    state = _called(model, places)
    return f"{model.path.name}: shapes are inside each other in {state}: {few(pairs)}"


def places_in(model: Model, keyframe: int | str | None) -> dict[str, Array]:
    """Return "qpos" (nq,), "mocap_pos" (nmocap, 3) and "mocap_quat" (nmocap, 4) of a keyframe.

    Args:
        model: The Model.
        keyframe: Its number or its name; None for the default state.
    """
    if keyframe is not None:
        frame = model.keyframes[model.key_id(keyframe)]
        return {name: getattr(frame, name) for name in _PLACES}
    qpos = np.zeros(model.nq) if model.compiled is None else np.array(model.compiled.qpos0)
    return {"qpos": qpos, "mocap_pos": model.mocap_pos0, "mocap_quat": model.mocap_quat0}


def _overlaps(model: Model, places: Mapping[str, Array]) -> list[str]:
    """Return the shapes inside each other in a state, as `measures.overlaps` has them."""
    if model.compiled is None:
        return []
    from .compiled.model import contacts_in

    geoms, distances = contacts_in(model.compiled, places)
    if not (distances < 0).any():
        return []
    from ..measures import ContactNames, overlaps  # only what overlaps needs names

    return overlaps(ContactNames.of(model), geoms, distances)


def _called(model: Model, places: Mapping[str, Array]) -> str:
    """Return what a state is called in a sentence: what the file calls it, if it is of the file."""

    def same(keyframe: int | None) -> bool:
        known = places_in(model, keyframe)
        return all(
            np.allclose(known[name], places[name], rtol=0, atol=_ROUNDING) for name in _PLACES
        )

    if same(None):
        return "the default state"
    for number, frame in enumerate(model.keyframes):
        if same(number):
            return f"the keyframe {frame.name!r}" if frame.name else f"keyframe {number}"
    return "the state that the run starts in"


def asleep_from_the_start(model: Model) -> NDArray[np.bool_]:
    """Return which velocities (nv,) belong to bodies that the engine lets sleep from the start."""
    asleep = np.zeros(model.nv, dtype=bool)
    if model.backend == DEFAULT and model.compiled is not None:
        mujoco = require("mujoco")
        compiled = model.compiled
        if compiled.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
            policy = compiled.tree_sleep_policy[compiled.dof_treeid]
            asleep = policy == int(mujoco.mjtSleepPolicy.mjSLEEP_INIT)
    return asleep
