"""Faults that a backend on PyBullet is likely to have; each is caught by what it names.

`test_seeded_faults` puts them into our own. What the conformance checks cannot see, a test of
one of PyBullet's does, with a claim of `pybullet_claims`: it stands there then.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from statemachine.interface import POSES, Model
from statemachine.rotations import matrix_from_quat

from . import patches
from .patches import Patch
from .pybullet_claims import moves_as_on_mujoco, two_free_bodies_are_two
from .small_models import TREES


def _parts() -> Any:
    """Return the modules of the backend, which need the engine to be imported."""
    from statemachine.backends import hidden_data as _hidden_data
    from statemachine.backends import hidden_world as _hidden_world
    from statemachine.backends import pybullet_backend
    from statemachine.backends.bullet import driven as bullet_driven
    from statemachine.backends.bullet import joint_dynamics as bullet_joint_dynamics
    from statemachine.backends.bullet import plan as bullet_plan
    from statemachine.backends.bullet import tree_dynamics
    from statemachine.backends.bullet import world as bullet_world

    class Parts:
        data, hidden, driven = _hidden_data, _hidden_world, bullet_driven
        plan, ghost = bullet_plan, bullet_driven
        joint_dynamics, world, dynamics = bullet_joint_dynamics, bullet_world, tree_dynamics
        backend, pb = pybullet_backend, bullet_world.pb

    return Parts


def around(where: str, name: str) -> Callable[[Callable[..., Any]], Patch]:
    """Put a function around another, as in `patches`; `where` is a path from `_parts`."""
    return patches.around(lambda: functools.reduce(getattr, where.split("."), _parts()), name)


@around("ghost.Ghost", "poses")
def centre_of_mass_for_frame(right: Any, self: Any, qpos: Any, name: str) -> Any:
    found = right(self, qpos, name)
    if "xpos" not in found:
        return found
    turns = matrix_from_quat(found["xquat"])
    found["xpos"] = found["xpos"] + np.einsum("bij,bj->bi", turns, self._raw.body_ipos)
    return found


@around("world.Tree", "__init__")
def joints_counted_without_the_fixed(right: Any, self: Any, *arguments: Any) -> None:
    right(self, *arguments)
    self.joints = [index - 1 for index in self.joints]  # the first is fixed: the anchor


@around("joint_dynamics.JointDynamics", "__init__")
def armature_dropped(right: Any, self: Any, raw: Any, *others: Any) -> None:
    raw = copy.copy(raw)
    raw.dof_armature[:] = 0
    right(self, raw, *others)


@around("pb", "changeDynamics")
def damping_left_on(right: Any, *arguments: Any, **named: Any) -> None:
    named.pop("linearDamping", None)
    named.pop("angularDamping", None)
    right(*arguments, **named)


@around("pb", "setPhysicsEngineParameter")
def files_are_cached(right: Any, **named: Any) -> None:
    # The names repeat: each is the number of a descriptor that is free again.
    if named.pop("enableFileCaching", None) is None:
        right(**named)


@around("data.Machine", "_compute")
def forward_steps_the_world_itself(right: Any, self: Any, name: str) -> Any:
    moment = self.moment
    if moment is None or name in POSES or self._world_knows_moment:
        return right(self, name)
    present = self.present()
    found = _parts().hidden.LookAhead(lambda: self.world).at(moment)
    self.restart(self.time, present, self.past_commands)
    self.moment = moment
    return found


@around("world.World", "_put_free")
def put_in_world_axes(right: Any, self: Any, tree: Any, qpos: Any, qvel: Any) -> None:
    qvel, start = qvel.copy(), tree.qvel.start
    turn = matrix_from_quat(qpos[tree.qpos][3:] / np.linalg.norm(qpos[tree.qpos][3:]))
    qvel[start + 3 : start + 6] = turn.T @ qvel[start + 3 : start + 6]
    right(self, tree, qpos, qvel)


@around("world.World", "read_free")
def read_in_world_axes(right: Any, self: Any, tree: Any) -> Any:
    qpos, qvel = right(self, tree)
    return qpos, [*qvel[:3], *(matrix_from_quat(np.array(qpos[3:])) @ qvel[3:])]


def spin_in_world_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    put_in_world_axes(monkeypatch)
    read_in_world_axes(monkeypatch)


def contacts_are_not_observed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        _parts().joint_dynamics.JointDynamics, "contact", property(lambda self: self._nothing)
    )


# The fault, the conformance checks that see it, and the tests of the backend that do.
PYBULLET_FAULTS: dict[str, tuple[Patch, set[str], tuple[Callable[..., None], ...]]] = {
    "xyzw for wxyz": (
        around("dynamics", "wxyz_from_xyzw")(lambda right, quat: np.array(quat)),
        {"the_witness_agrees"},
        (),
    ),
    "centre of mass for frame": (
        centre_of_mass_for_frame,
        {"the_witness_agrees", "site_and_body_agree"},
        (),
    ),
    "default motors left on": (
        around("pb", "setJointMotorControl2")(lambda *_, **__: None),
        {"options_do_what_they_say"},
        (),
    ),
    "joints counted without the fixed": (
        joints_counted_without_the_fixed,
        {"untouched_ctrl_is_a_command"},
        (),
    ),
    "armature dropped": (armature_dropped, {"a_force_accelerates_by_the_armature"}, ()),
    "damping left on": (damping_left_on, {"free_body_velocity_conventions"}, ()),
    # The suite's only model of several trees cannot be loaded then: no check gets to fail.
    "files are cached": (files_are_cached, set(), (two_free_bodies_are_two,)),
    "friction of contacts the other way": (
        around("pb", "getContactPoints")(
            lambda right, **of: [(*p[:10], -p[10], p[11], -p[12], p[13]) for p in right(**of)]
        ),
        {"contact_forces_lean_against_a_push"},
        (),
    ),
    "forward steps the world itself": (
        forward_steps_the_world_itself,
        {"forward_perturbs_nothing"},
        (),
    ),
    "reset without moving apart": (
        around("world.World", "place")(lambda right, self, *state: self.put(*state)),
        {"replay_is_bit_identical"},
        (),
    ),
    "spin in world axes": (spin_in_world_axes, {"free_body_velocity_conventions"}, ()),
    "ctrl is not clamped": (
        patches.around(Model, "_acting")(lambda right, self, name, array: array),
        {"ctrl_is_clamped_inside"},
        (),
    ),
    "contacts are not observed": (contacts_are_not_observed, {"forces_balance_at_rest"}, ()),
    # With the wrong inertia everything is consistent with itself: only another engine sees it.
    "ghost has the padding": (
        around("plan.Plan", "_describe")(
            lambda right, self, root, kind: right(
                self, root, "stepped" if kind == "ghost" else kind
            )
        ),
        set(),
        (functools.partial(moves_as_on_mujoco, text=TREES, most=2e-5),),
    ),
    "state forgets what was observed": (
        around("driven.DrivenWorld", "place")(
            lambda right, self, qpos, qvel, memory: right(
                self, qpos, qvel, [np.zeros_like(part) for part in memory]
            )
        ),
        {"a_state_restores_the_inputs"},
        (),
    ),
    "gravity is not passed on": (
        around("pb", "setGravity")(lambda *_: None),
        {"free_fall", "untouched_ctrl_is_a_command"},
        (),
    ),
}
