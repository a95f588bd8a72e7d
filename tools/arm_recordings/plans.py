"""The thirty recordings, and the one that comes with the package."""

from __future__ import annotations

import math
from pathlib import Path

from .arm_truth import Fault
from .recordings import Plan

SHIPPED_FOLDER = (
    Path(__file__).resolve().parents[2] / "statemachine" / "lab" / "recordings" / "synthetic"
)
SHIPPED = Plan("synthetic", seed=55)


def thirty() -> tuple[Plan, ...]:
    """Return the plans of the thirty recordings; every third seed is in -100 to 100."""
    plans: list[Plan] = []
    for seed in range(8):
        unit = "-100 to 100" if seed % 3 == 2 else "degrees"
        plans.append(Plan(f"soft-chirps-{seed}", seed=seed, unit=unit))
    for seed in range(100, 105):
        unit = "-100 to 100" if seed % 3 == 2 else "degrees"
        plans.append(Plan(f"soft-hand-{seed}", motion="hand", seed=seed, unit=unit))
    for seed in range(200, 204):
        plans.append(Plan(f"stiff-chirps-{seed}", servos="stiff", seed=seed))
    for seed in range(300, 303):
        plans.append(Plan(f"stiff-hand-{seed}", servos="stiff", motion="hand", seed=seed))
    plans += _faults()
    for seed in range(500, 503):
        plans.append(Plan(f"pybullet-soft-chirps-{seed}", seed=seed, backend="pybullet"))
    plans.append(Plan("pybullet-soft-hand-503", motion="hand", seed=503, backend="pybullet"))
    return tuple(plans)


def _faults() -> list[Plan]:
    elbow_zero = Fault(zero=(("elbow_flex", math.radians(12.0)),))
    lift_zero = Fault(zero=(("shoulder_lift", math.radians(-9.0)),))
    return [
        Plan("zero-elbow-400", seed=400, fault=elbow_zero),
        Plan("zero-lift-hand-401", motion="hand", seed=401, fault=lift_zero),
        Plan("sign-elbow-402", seed=402, fault=Fault(reversed_joint="elbow_flex")),
        Plan("sign-roll-403", seed=403, fault=Fault(reversed_joint="wrist_roll")),
        Plan("gripper-scale-404", seed=404, fault=Fault(gripper_scale=0.8)),
        Plan("gripper-scale-hand-405", motion="hand", seed=405, fault=Fault(gripper_scale=1.2)),
    ]
