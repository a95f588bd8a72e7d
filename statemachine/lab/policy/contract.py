"""What a policy expects of the simulator around it: observations, actions, servos, clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ...interface import Array
from .contract_fields import UnreadField

TermId = Literal[
    "base_lin_vel",
    "base_ang_vel",
    "projected_gravity",
    "velocity_commands",
    "joint_pos_rel",
    "joint_vel_rel",
    "last_action",
    "gait_phase",
    "gait_phase_legs",
    "constant",
]
Frame = Literal["body", "world"]
ActuatorKind = Literal["implicit_pd", "explicit_pd"]
QuatOrder = Literal["wxyz", "xyzw"]
Layout = Literal["term_major", "time_major"]
Order = Literal["oldest_first", "newest_first"]
Init = Literal["repeat_first", "zeros"]
# Format of the files of the package gaitkeeper 0.5 (Apache-2.0).
SCHEMA: Final = "gaitkeeper/contract/v3"
LONGEST_CALL: Final = 1.0  # from one call of a walking policy to the next [s]
AXES = ("vx", "vy", "wz")  # of a command of speed


@dataclass(frozen=True)
class Clock:
    """The clock that a term of an observation tells.

    Attributes:
        period: Of a gait [s].
        offset: By which part of a period the second leg is behind, of `gait_phase_legs`.
        offset_steps: Calls of the policy by which the clock is ahead of the time since the reset.
        stand_threshold: Below this size of the command the term is zero; None for never.
    """

    period: float
    offset: float = 0.5
    offset_steps: int = 0
    stand_threshold: float | None = None


@dataclass(frozen=True)
class ObservedTerm:
    """One term of an observation.

    Attributes:
        id: Which quantity.
        name: What the contract calls it, each once.
        scale: (dim,) by which it is multiplied.
        clip: The least and the largest value; None where it is not clipped.
        joints: Whose angles or speeds are told, in this order; empty for those of the policy.
        reference: (n,) [rad] from which the angles of those joints are told; None of other terms.
        frame: In which axes a velocity is told.
        site: Whose velocity and axes are told; "" for those of the base.
        clock: Of a term that tells a phase; None for others.
        values: (dim,) of a constant term; empty for others.
    """

    id: TermId
    name: str
    scale: Array
    clip: tuple[float, float] | None = None
    joints: tuple[str, ...] = ()
    reference: Array | None = None
    frame: Frame = "body"
    site: str = ""
    clock: Clock | None = None
    values: tuple[float, ...] = ()

    @property
    def dim(self) -> int:
        """Return how many numbers it has."""
        return len(self.scale)


@dataclass(frozen=True)
class History:
    """How earlier observations are handed to the network, too.

    Attributes:
        length: Number of observations, the present one included.
        layout: Whether all moments of a term stand together, or all terms of a moment.
        order: Which moment comes first.
        init: What stands for moments before the reset: the first observation, or zeros.
    """

    length: int = 1
    layout: Layout = "term_major"
    order: Order = "oldest_first"
    init: Init = "repeat_first"


@dataclass(frozen=True)
class Action:
    """How the output of the network becomes target angles: offset + scale · action, then a clip.

    Attributes:
        scale: (n,) [rad] for each joint.
        offset: (n,) [rad].
        clip: (n, 2) [rad] of the targets; None where they are not clipped.
        delay_steps: By how many calls of the policy an action acts late.
    """

    scale: Array
    offset: Array
    clip: Array | None = None
    delay_steps: int = 0

    def targets(self, action: Array) -> Array:
        """Return the target angles (n,) [rad] of an action (n,)."""
        targets = self.offset + self.scale * action
        if self.clip is None:
            return targets
        return np.clip(targets, self.clip[:, 0], self.clip[:, 1])


@dataclass(frozen=True)
class Servos:
    """What drives the joints towards their targets.

    Attributes:
        kind: "implicit_pd": servos within the step of the engine; "explicit_pd": torques that are
            computed before each step; None where the contract does not say.
        kp: (n,) [N·m/rad]; None where the contract does not say.
        kd: (n,) [N·m·s/rad]; None where the contract does not say.
        effort_limit: (n,) [N·m], infinite of a joint without; None where the contract does not say.
        armature, damping, friction: (n,) [kg·m², N·m·s/rad, N·m]; None where it does not say.
    """

    kind: ActuatorKind | None = None
    kp: Array | None = None
    kd: Array | None = None
    effort_limit: Array | None = None
    armature: Array | None = None
    damping: Array | None = None
    friction: Array | None = None


@dataclass(frozen=True)
class CallTiming:
    """How often the policy is called.

    Attributes:
        policy_dt: From one call to the next [s].
        decimation: Steps of the engine between two calls; None where the contract does not say.
    """

    policy_dt: float
    decimation: int | None = None

    @property
    def timestep(self) -> float | None:
        """Return the length of a step of the engine [s]; None where the contract does not say."""
        return None if self.decimation is None else self.policy_dt / self.decimation


@dataclass(frozen=True)
class Contract:
    """What a policy expects of the simulator around it.

    Attributes:
        file: Name of the file that it was read from.
        schema: Format of that file.
        joints: Names of the n joints that it drives, in the order of the policy.
        default_joint_pos: (n,) [rad] where the policy starts.
        terms: Of the observation, in their order.
        history: Of the observation.
        quat_order: In which order the quaternion of the base is taken for its numbers; MuJoCo, and
            every backend here, has wxyz.
        clips_before_scale: Whether a term is clipped before it is multiplied by its scale.
        action: How its output becomes targets.
        servos: What drives the joints.
        timing: How often it is called.
        command_limits: The least and the largest speed that it may be asked for, by axis: vx, vy
            [m/s], wz [rad/s].
        unread: Fields of the file that nothing here reads.
    """

    file: str
    schema: str
    joints: tuple[str, ...]
    default_joint_pos: Array
    terms: tuple[ObservedTerm, ...]
    history: History
    quat_order: QuatOrder
    clips_before_scale: bool
    action: Action
    servos: Servos
    timing: CallTiming
    command_limits: dict[str, tuple[float, float]]
    unread: tuple[UnreadField, ...] = ()

    @property
    def observation_size(self) -> int:
        """Return how many numbers the network is given."""
        return self.history.length * sum(term.dim for term in self.terms)

    @property
    def misspelt(self) -> tuple[UnreadField, ...]:
        """Return the unread fields that are near to one that is read."""
        return tuple(field for field in self.unread if field.nearest)

    def has_term(self, term: TermId) -> bool:
        """Tell whether a quantity is among the terms."""
        return any(known.id == term for known in self.terms)
