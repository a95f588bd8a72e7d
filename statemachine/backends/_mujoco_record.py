"""What the MuJoCo backend says of itself: nearly all of it is the engine's own."""

from __future__ import annotations

import mujoco

from ..interface import BEHAVIOURS, OPTIONS, Behaviour, Capabilities
from ..interface.checks import HUGE
from ._mujoco_alarms import resets_itself

# Not RK4: after its step the derived values are neither of the state before nor after.
INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
_NATIVE = Behaviour("native", "the engine's own")
_NOTES = {
    "position servo": Behaviour(
        "native", "the engine's own; an infinite ctrl is clamped to its range, or refused"
    ),
    "latency": Behaviour(
        "native",
        "the engine's own delay of an actuator, in whole engine steps; with the option latency the "
        "command before a keyframe was that of the keyframe, where a file's own delay finds zero",
    ),
    "forces by part": Behaviour("native", "rows of the constraint solver, by their type"),
    "exact restore": Behaviour("native", "mjSTATE_INTEGRATION, warm start included"),
    "no automatic reset": Behaviour(
        "native",
        "the engine's flag mjDSBL_AUTORESET; DivergedError where qpos, qvel or qacc is beyond "
        f"{HUGE:g}, the engine's own bound",
    ),
}


def capabilities(raw: mujoco.MjModel) -> Capabilities:
    """The record of one compiled model: two of its own settings show in it."""
    behaviours = {name: _NOTES.get(name, _NATIVE) for name in BEHAVIOURS}
    if raw.opt.integrator == int(mujoco.mjtIntegrator.mjINT_RK4):
        behaviours["stale after a step"] = Behaviour(
            "unsupported", "with RK4 derived values are those of its fourth stage"
        )
    if resets_itself(raw):
        behaviours["no automatic reset"] = Behaviour(
            "unsupported", "the engine's default: it resets, and the divergence is raised after"
        )
    asleep = bool(raw.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP))
    if asleep:
        behaviours["exact restore"] = Behaviour(
            "unsupported", "the counters of sleeping bodies are in no State"
        )
    return Capabilities(
        options=tuple(name for name in OPTIONS if name != "max_qvel"),
        integrators=tuple(INTEGRATORS),
        behaviours=behaviours,
        shared_model=True,
        exact_restore=not asleep,
    )
