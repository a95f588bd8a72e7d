"""What MotrixSim reads in a file, told in MuJoCo's terms: a compiled model with its numbers.

MuJoCo compiles the file for names and ids. Where MotrixSim reads another number, the compiled
model takes it over, beyond what single precision rounds: so a Model shows what MotrixSim runs.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...interface import Array, JointType
from ...interface.checks import unsupported_by
from ...rotations import matrix_from_quat
from ..compiled.actuators import ActivationKind, GainKind
from ..compiled.algebra import principal_axes
from ..compiled.flags import DisableFlag
from ..compiled.stages import set_constants
from .engine_model import EngineModel
from .layout import MotrixLayout, layout_of
from .links import check_threads, mx
from .messages import ignored_fields, other_warnings
from .settings import FIXED_BASE, NO_ACTUATORS, flags_of

if TYPE_CHECKING:
    from motrixsim import msd

    from ..compiled.types import MjModel

_ROUNDED = 1e-6  # two numbers are one where they differ by less, relatively
_SMALL = 1e-8  # or absolutely: a centre of mass [m] that is summed from parts
_ROUNDED_INERTIA = 1e-4  # of the largest entry


@dataclass(frozen=True, eq=False)
class MotrixReading:
    """What MotrixSim makes of a file.

    Attributes:
        engine: Its own model.
        layout: Where it has what MuJoCo counts.
        raw: The compiled model with MotrixSim's numbers.
        ignored: What it says that it ignores in the file, as "option cone".
        warnings: What else it said while it read the file.
        otherwise: What it reads as another number, in a few words each.
    """

    engine: EngineModel
    layout: MotrixLayout
    raw: MjModel
    ignored: tuple[str, ...]
    warnings: tuple[str, ...]
    otherwise: tuple[str, ...]


def read_file(path: Path, raw: MjModel) -> MotrixReading:
    """Let MotrixSim read a file that MuJoCo has compiled.

    Args:
        path: An MJCF or URDF file.
        raw: What MuJoCo makes of it.

    Raises:
        ModelError: MotrixSim cannot read it.
        UnsupportedError: It has what cannot be read from or restored in MotrixSim, or MotrixSim
            reads other elements.
    """
    if (raw.actuator_dyntype != ActivationKind.NONE).any():
        reason = "the activation of an actuator can be neither read nor set in it"
        raise unsupported_by("motrix", "activation", reason)
    if not raw.nv:
        raise unsupported_by("motrix", "a model without joints", "it cannot step one")
    world, lines = EngineModel(path).world()
    engine = EngineModel(path, _of_urdf(world, raw) if path.suffix.lower() == ".urdf" else {})
    world, scene = engine.edited_world(), engine.scene
    layout = layout_of(world, scene, raw)
    own, otherwise = with_numbers_of(scene, layout, raw)
    if (flags := flags_of(world, raw.opt.disableflags)) != raw.opt.disableflags:
        differing = DisableFlag(flags ^ raw.opt.disableflags)
        otherwise = (*otherwise, f"flag {differing.name} as if it were not there")
        own.opt.disableflags = flags
    if FIXED_BASE in engine.settings:
        otherwise = (*otherwise, "a base that floats, which is fixed here as in MuJoCo")
    return MotrixReading(
        engine, layout, own, ignored_fields(lines), other_warnings(lines), otherwise
    )


def _of_urdf(world: msd.World, raw: MjModel) -> dict[str, Array]:
    """Return the settings that make MotrixSim's reading of a URDF the robot that MuJoCo reads."""
    settings: dict[str, Array] = {}
    floats = bool((raw.jnt_type == JointType.FREE).any())
    if not floats and any(body.free is not None for body in world.hierarchy.bodies):
        settings[FIXED_BASE] = np.ones(())
    if world.actuators and not raw.nactuator:
        settings[NO_ACTUATORS] = np.ones(())
    return settings


def with_numbers_of(
    scene: Any, layout: MotrixLayout, raw: MjModel
) -> tuple[MjModel, tuple[str, ...]]:
    """Return a copy of a compiled model that has MotrixSim's numbers, and what differed.

    Args:
        scene: What MotrixSim makes of the file.
        layout: Where it has what the compiled model counts.
        raw: The compiled model; stays as it is.

    Returns:
        The copy; of each field that differed, how in its first place.
    """
    own, otherwise = copy.copy(raw), list[str]()
    options = scene.options
    read = _Numbers(own, otherwise)
    own.opt.timestep = read.number("timestep", options.timestep, raw.opt.timestep)
    read.array("gravity", own.opt.gravity, np.ravel(options.gravity))
    _take_over_joints(scene, layout, read)
    _take_over_actuators(scene, read)
    _take_over_bodies(scene, layout, read)
    _leave_out_inert(read)
    if otherwise:
        set_constants(own)
    return own, tuple(otherwise)


class _Numbers:
    """Numbers of MotrixSim beside those of a compiled model, which takes over those that differ."""

    def __init__(self, raw: MjModel, otherwise: list[str]) -> None:
        self.raw, self._otherwise = raw, otherwise

    def number(self, name: str, theirs: float, ours: float) -> float:
        """Return the number that is run: ours, where theirs is that one rounded."""
        if abs(theirs - ours) <= _ROUNDED * abs(ours) + _SMALL or theirs == ours:
            return ours
        self.differs(name, theirs, ours)
        return float(theirs)

    def differs(self, name: str, theirs: float, ours: float) -> None:
        """Note that a number is another one."""
        self._otherwise.append(f"{name} {theirs:.6g}, not {ours:.6g}")

    def inert(self, name: str) -> None:
        """Note that something has no effect."""
        self._otherwise.append(f"{name} without effect")

    def array(self, name: str, ours: Array, theirs: Any) -> None:
        """Let an array of the compiled model, of any length, take over other numbers."""
        told = np.broadcast_to(np.asarray(theirs, dtype=np.float64), ours.shape)
        differs = ~np.isclose(told, ours, rtol=_ROUNDED, atol=_SMALL)
        if differs.any():
            first = int(np.flatnonzero(differs)[0])
            self.differs(name, told[first], ours[first])
            ours[differs] = told[differs]


def _take_over_bodies(scene: Any, layout: MotrixLayout, read: _Numbers) -> None:
    """Take over masses and inertias, and friction of the geoms."""
    raw, data = read.raw, mx.SceneData(scene)
    check_threads()  # inertias are told by them
    for body, number in enumerate(layout.links.tolist()):
        if number < 0 or not layout.same_links:
            continue
        link, name = scene.links[number], raw.body(body).name or f"body {body}"
        if link.mass <= 0:  # of a link that stands it is told as 0
            continue
        read.array(f"mass of {name}", raw.body_mass[body : body + 1], link.mass)
        read.array(f"centre of mass of {name}", raw.body_ipos[body], link.center_of_mass)
        xx, yy, zz, xy, xz, yz = link.get_inertia_override(data).astype(np.float64).ravel()
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        _take_over_inertia(read, body, name, tensor)
    for number, geom in enumerate(layout.geoms.tolist()):
        if geom < 0:
            continue
        name = raw.geom(geom).name or f"geom {geom}"
        read.array(f"friction of {name}", raw.geom_friction[geom], scene.geoms[number].friction)


def _take_over_inertia(read: _Numbers, body: int, name: str, theirs: Array) -> None:
    """Take over an inertia (3, 3) about the centre of mass, along the axes of the body."""
    raw = read.raw
    axes = matrix_from_quat(raw.body_iquat[body])
    ours = axes @ np.diag(raw.body_inertia[body]) @ axes.T
    if np.abs(theirs - ours).max() <= _ROUNDED_INERTIA * np.abs(ours).max():
        return
    read.differs(f"inertia of {name}", float(np.trace(theirs)), float(np.trace(ours)))
    raw.body_inertia[body], raw.body_iquat[body] = principal_axes(theirs)


def _take_over_joints(scene: Any, layout: MotrixLayout, read: _Numbers) -> None:
    """Take over armature, damping, dry friction and limits of the joints."""
    raw, low = read.raw, scene.low
    dampings = np.asarray(low.dof_force_dampings)
    losses = np.zeros(raw.nv)
    for loss in low.friction_losses:
        losses[loss.dof_vel_index] = loss.friction_loss
    ranges = {limit.dof_vel_index: (limit.lower, limit.upper) for limit in low.dof_limits}
    joints = iter(scene.joints)
    for joint in range(raw.njnt):
        kind, start = JointType(int(raw.jnt_type[joint])), int(raw.jnt_dofadr[joint])
        dofs, name = slice(start, start + kind.nv), raw.joint(joint).name or f"joint {joint}"
        places = layout.qvel[dofs]
        read.array(f"damping of {name}", raw.dof_damping[dofs], dampings[places])
        read.array(f"frictionloss of {name}", raw.dof_frictionloss[dofs], losses[places])
        if kind == JointType.FREE:
            continue
        read.array(f"armature of {name}", raw.dof_armature[dofs], next(joints).armature)
        if kind == JointType.BALL:
            continue
        limits = ranges.get(int(places[0]))
        raw.jnt_limited[joint] = limits is not None
        if limits is not None:
            read.array(f"range of {name}", raw.jnt_range[joint], limits)


def _take_over_actuators(scene: Any, read: _Numbers) -> None:
    """Take over gains and force ranges of the position servos."""
    raw = read.raw
    for number, actuator in enumerate(scene.actuators):
        name = raw.actuator(number).name or f"actuator {number}"
        if hasattr(actuator, "kp"):
            kp, kd = float(actuator.kp), float(actuator.kd)
            read.array(f"kp of {name}", raw.actuator_gainprm[number, :1], kp)
            read.array(f"kp of {name}", raw.actuator_biasprm[number, 1:2], -kp)
            read.array(f"kv of {name}", raw.actuator_biasprm[number, 2:3], -kd)
        limits = actuator.force_range
        if limits is not None and raw.actuator_forcelimited[number]:
            read.array(f"forcerange of {name}", raw.actuator_forcerange[number], limits)
        elif limits is None and raw.actuator_forcelimited[number]:
            raw.actuator_forcelimited[number] = False
            read.array(f"forcerange of {name}", raw.actuator_forcerange[number], 0.0)


def _leave_out_inert(read: _Numbers) -> None:
    """Take out what MotrixSim reads without a complaint, and what then acts on no motion.

    It subtracts a gap from its margin, as MuJoCo did before 4.0.
    """
    raw = read.raw
    for joint in range(raw.njnt):
        name = raw.joint(joint).name or f"joint {joint}"
        if raw.jnt_actfrclimited[joint] and raw.nactuator:
            read.inert(f"actuatorfrcrange of {name}")
            raw.jnt_actfrclimited[joint] = False
        if raw.jnt_type[joint] == JointType.BALL:
            read.array(f"stiffness of {name}", raw.jnt_stiffness[joint : joint + 1], 0.0)
    for actuator in range(raw.nactuator):
        name = raw.actuator(actuator).name or f"actuator {actuator}"
        if raw.actuator_gaintype[actuator] == GainKind.AFFINE:
            read.array(f"gainprm of {name}", raw.actuator_gainprm[actuator, 1:], 0.0)
    for tendon in range(raw.ntendon):
        name = raw.tendon(tendon).name or f"tendon {tendon}"
        low, high = raw.tendon_lengthspring[tendon]
        if low != high:
            read.array(f"stiffness of {name}", raw.tendon_stiffness[tendon : tendon + 1], 0.0)
    _subtract_gaps(read, "geom", raw.geom_margin, raw.geom_gap)
    _subtract_gaps(read, "pair", raw.pair_margin, raw.pair_gap)


def _subtract_gaps(read: _Numbers, kind: str, margins: Array, gaps: Array) -> None:
    """Take over margins (n,) [m] of which MotrixSim subtracts gaps (n,) [m]."""
    for number in np.flatnonzero(gaps).tolist():
        name = getattr(read.raw, kind)(number).name or f"{kind} {number}"
        without = margins[number] - gaps[number]
        read.array(f"margin of {name}", margins[number : number + 1], without)
