"""The figures with which the recording that comes with the package was simulated."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

_FILE = Path(__file__).resolve().parent / "synthetic" / "truth.json"
_BY_JOINT = ("joints", "kp", "viscous", "frictionloss", "armature", "offset")


@dataclass(frozen=True)
class SyntheticTruth:
    """Figures of the simulated arm, in SI units.

    Attributes:
        joints: (n,) names of the joints.
        kp: (n,) gain of each servo [N·m/rad].
        viscous: (n,) viscous friction of each joint, `kv` of its servo included [N·m·s/rad].
        frictionloss: (n,) dry friction [N·m].
        armature: (n,) inertia of each rotor [kg·m²].
        offset: (n,) what each angle is recorded too large by [rad].
        delay: How late angles are recorded [s].
        payload: What the gripper holds [kg].
    """

    joints: tuple[str, ...]
    kp: tuple[float, ...]
    viscous: tuple[float, ...]
    frictionloss: tuple[float, ...]
    armature: tuple[float, ...]
    offset: tuple[float, ...]
    delay: float
    payload: float


def synthetic_truth() -> SyntheticTruth:
    """Return the truth of `lerobot:synthetic`; no fit reads it."""
    written = json.loads(_FILE.read_text(encoding="utf-8"))
    joints, kp, viscous, frictionloss, armature, offset = (
        tuple(written[name]) for name in _BY_JOINT
    )
    return SyntheticTruth(
        joints=joints,
        kp=kp,
        viscous=viscous,
        frictionloss=frictionloss,
        armature=armature,
        offset=offset,
        delay=written["delay"],
        payload=written["payload"],
    )
