"""From a file to a compiled description, and from that to what `Model.__init__` wants.

MuJoCo's compiler reads MJCF, URDF and MJB. A backend of any engine may start from its result,
an `mjModel`, and give its Model the facts that every other backend gives:

    with compiler_warnings() as texts:
        raw = compile_file(path)
    model = MyModel(raw=..., backend="mine", ..., **facts(raw))

For `Model.replace`, `edits` has a copy with other options (`edited`).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...errors import BadInputError, EngineWarning, ModelError, shown
from ...interface import Array, Ints, JointType, Keyframe
from ...interface.checks import HUGE, TINY
from ...interface.records import AS_WRITTEN, ReadOptions
from ..actuators import control_names, delay_steps, servos
from ..binary import is_binary, read_binary
from ..controls import ctrl_owners
from .spec_files import ENGINE_ERRORS, compile_spec, read_spec, reason_of

# For `fastest`: in a step [rad, or the model's extent]; at least [rad/s or m/s]; about a day [s].
_FAR, _FAST, _DAY = 1000.0, 1e5, 1e5
_FREE, _SLIDE = int(JointType.FREE), int(JointType.SLIDE)

# What nothing is computed from, but a user's own code: and what only muscles are, which is
# infinite for a motor with a huge gear.
_FREE_USE = {"numeric_data", "actuator_acc0"} | {
    name for name in dir(mujoco.MjModel) if name.endswith("_user")
}
_NEVER_NEGATIVE = {"dof_armature", "dof_frictionloss"}
_SELDOM_NEGATIVE = (
    *("dof_damping", "jnt_stiffness", "tendon_damping", "tendon_stiffness"),
    *("geom_friction", "pair_friction"),
)


def new_data(raw: mujoco.MjModel) -> mujoco.MjData:
    """Make an MjData for what is computed of a compiled model.

    Raises:
        ModelError: It does not fit into memory.
    """
    try:
        return mujoco.MjData(raw)
    except ENGINE_ERRORS as error:
        raise ModelError(f"MuJoCo cannot make a Data: {reason_of(error)}") from error


@contextmanager
def compiler_warnings() -> Iterator[list[str]]:
    """Yield the list that MuJoCo's warnings go to meanwhile, not to a log file and the terminal.

    Yields:
        A list of texts that is complete when the `with` block ends.
    """
    texts: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(texts.append)  # in C: no Ctrl-C has to cross MuJoCo
    try:
        yield texts
    finally:
        mujoco.set_mju_user_warning(before)
        # What has a time is of a simulation in another thread, whose own counters tell.
        texts[:] = [text for text in texts if " Time = " not in text]


def compile_file(path: Path, options: ReadOptions = AS_WRITTEN) -> mujoco.MjModel:
    """Compile an MJCF, URDF or MJB file; the suffix ".mjb" says that it is binary.

    Static bodies that are fused with their parents, as those of a URDF are behind fixed joints,
    leave a site of their name where their frame is.

    Args:
        path: The file. Meshes are looked for beside it, as the file says.
        options: How it is read, beside that.

    Raises:
        BadInputError: Options are given for a binary file, which was compiled already; or the base
            cannot be free.
        ModelError: MuJoCo cannot compile the file, with its reason; or it compiles one
            with a number that no step can be taken with; or the file is binary, and nobody
            said that it is to be trusted (see `binary`).
    """
    if is_binary(path):
        raw, effects = _from_binary(path, read_binary(path), options), list[str]()
    else:
        raw, effects = _compile_xml(path, options)
    check_numbers(raw, str(path))
    if doubtful := [*_doubtful(raw), *effects]:
        warnings.warn(f"{path}: {'; '.join(doubtful)}", EngineWarning, stacklevel=4)
    return raw


def _from_binary(path: Path, content: bytes, options: ReadOptions) -> mujoco.MjModel:
    """Read a binary model, of which `content` is all.

    Raises:
        BadInputError: Options are given, for which it is too late.
        ModelError: MuJoCo cannot read it.
    """
    if options != AS_WRITTEN:
        raise BadInputError(
            f"{path} is binary, compiled already: base, balance_inertia and meshes are of XML files"
        )
    from .binary_models import from_binary

    try:
        return from_binary(content)
    except (ValueError, *ENGINE_ERRORS) as error:
        raise ModelError(f"MuJoCo cannot read {path}: {reason_of(error)}") from error


def _compile_xml(path: Path, options: ReadOptions) -> tuple[mujoco.MjModel, list[str]]:
    """Compile an MJCF or a URDF file.

    Returns:
        The compiled model, and what the options changed, in sentences.

    Raises:
        ModelError: MuJoCo cannot read it, with its reason and what a user can do.
    """
    try:
        spec = read_spec(path)
        if not spec.compiler.fusestatic and options == AS_WRITTEN:
            return compile_spec(spec), []
        from .reading import compile_with, effects

        raw, repairs = compile_with(path, options)
        return raw, list(effects(path, options, repairs))
    except BadInputError:  # an option that this file cannot be read with
        raise
    except (ValueError, *ENGINE_ERRORS) as error:
        from ..refusals import explained

        raise ModelError(f"MuJoCo cannot read {path}: {explained(path, options, error)}") from error


def contacts_in(raw: mujoco.MjModel, inputs: Mapping[str, Array]) -> tuple[Ints, Array]:
    """Find the contacts in a state, in which nothing has been stepped yet.

    Args:
        raw: The compiled model.
        inputs: "qpos" (nq,), "mocap_pos" (nmocap, 3) and "mocap_quat" (nmocap, 4) of the state;
            what is not given is as in the default state.

    Returns:
        Geoms (n, 2) and distances (n,) [m].
    """
    try:
        with compiler_warnings():
            data = mujoco.MjData(raw)
            for name, values in inputs.items():
                getattr(data, name)[:] = values
            for stage in ("kinematics", "comPos", "flex", "collision"):
                getattr(mujoco, f"mj_{stage}")(raw, data)
    except ENGINE_ERRORS:  # who makes a Data is told of it
        return np.empty((0, 2), np.int64), np.empty(0)
    return data.contact.geom.reshape(-1, 2).astype(np.int64), np.array(data.contact.dist)


def check_numbers(raw: mujoco.MjModel, name: str) -> None:
    """Raise ModelError if an entry of a compiled model is NaN, or has an impossible sign.

    So it does for a name that is not text.

    Args:
        raw: The compiled model.
        name: What the message calls it.
    """
    try:
        raw.names.decode()
    except UnicodeDecodeError as error:
        start = raw.names.rfind(b"\0", 0, error.start) + 1
        wrong = raw.names[start : raw.names.index(b"\0", start)]
        raise ModelError(f"{name} has a name that is not UTF-8: {shown(wrong)}") from None
    for problem in _problems(raw):
        raise ModelError(f"{name} has a number that nothing can be computed with: {problem}")


def _problems(raw: mujoco.MjModel) -> Iterator[str]:
    """Yield the problems of a compiled model: no number, or a sign that it cannot have."""
    if not raw.opt.timestep > 0:
        yield f"timestep is {raw.opt.timestep:g}, and must be above 0"
    for key, time in enumerate(raw.key_time.tolist()):
        if math.isfinite(time) and time + raw.opt.timestep == time:
            name = raw.key(key).name or f"number {key}"
            yield f"time of key {name} is {time:g}: no timestep is added to it"
    for name in dir(raw.opt):
        value = getattr(raw.opt, name)
        if not name.startswith("_") and not np.isfinite(value).all():
            yield f"{name} of the options is {value}"
    for name in sorted(dir(raw), key=lambda name: name[-1:] == "0"):  # what follows, last
        if name.startswith("_") or name in _FREE_USE:
            continue
        array = getattr(raw, name)
        if isinstance(array, np.ndarray) and array.dtype.kind == "f":
            yield from _array_problems(raw, name, array)


def _array_problems(raw: mujoco.MjModel, name: str, array: Array) -> Iterator[str]:
    """Yield what of an array of a compiled model is not a number, or cannot be what it is."""
    yield from _first(raw, name, np.isnan(array), "is NaN")
    if "range" not in name:  # only a range may be without an end
        yield from _first(raw, name, np.isinf(array), "is infinite")
    if name in _NEVER_NEGATIVE:
        yield from _first(raw, name, array < 0, "is negative")
    if name == "jnt_axis" or name.endswith("_quat"):  # of a length that overflowed
        yield from _first(raw, name, ~array.any(axis=-1), "has no direction")


def _doubtful(raw: mujoco.MjModel) -> Iterator[str]:
    """Yield the values whose sign engines take, and that is seldom meant."""
    for name in _SELDOM_NEGATIVE:
        yield from _first(raw, name, getattr(raw, name) < 0, "is negative")
    affine = raw.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)
    for column, gain in ((1, "kp"), (2, "kv")):
        pushes = affine & (raw.actuator_biasprm[:, column] > 0)
        yield from _first(raw, "actuator_biasprm", pushes, "is negative", gain)


def _first(
    raw: mujoco.MjModel, name: str, where: Any, says: str, called: str = ""
) -> Iterator[str]:
    """Yield a message on the first row of an array for which a condition holds, if there is one.

    Args:
        raw: The compiled model.
        name: Of the array.
        where: In which of its entries it holds.
        says: What is to be said.
        called: What the number is called, if not by the array's name.
    """
    if not where.any():  # of nearly all arrays, and this is asked for each
        return
    for index, *_ in np.argwhere(where)[:1].tolist():
        kind = name.partition("_")[0]
        if kind == "dof":
            kind, index = "jnt", int(raw.dof_jntid[index])  # noqa: PLW2901
        kind = {"jnt": "joint", "cam": "camera", "mat": "material"}.get(kind, kind)
        with suppress(AttributeError, IndexError, KeyError):  # it is of the whole model
            says = f"of {kind} {getattr(raw, kind)(index).name or f'number {index}'} {says}"
        yield f"{called or name} {says}"


def fastest(m: mujoco.MjModel) -> Array:
    """Return the velocities (nv,) [rad/s or m/s] beyond which a degree of freedom has diverged.

    Of each the largest of three:

    - 1000 rad in a timestep, or 1000 times the model's extent: no engine can follow that;
    - 1e5;
    - what gravity and its own actuators reach against damping in 1e5 s. That is `HUGE` where
      an actuator has no limit. A position servo is left out: it pulls back.
    """
    straight = np.zeros(m.nv, dtype=bool)  # slides, and where free bodies are
    for kind, start in zip(m.jnt_type, m.jnt_dofadr, strict=True):
        straight[start : start + 3 * (kind == _FREE) + (kind == _SLIDE)] = True
    in_a_step = _FAR * np.where(straight, m.stat.extent, 1.0) / m.opt.timestep

    known, owner = facts(m), ctrl_owners(m)
    gain, bias = m.actuator_gainprm[owner, 0], m.actuator_biasprm[owner]
    gear, joints = np.abs(known["actuator_gear"]), known["actuator_jntid"]
    command = np.abs(known["actuator_ctrlrange"]).max(axis=1)
    wanted = np.multiply(np.abs(gain), command, out=np.zeros(m.nu), where=gain != 0)
    wanted += np.abs(bias[:, 0])
    limit = np.abs(known["actuator_forcerange"]).max(axis=1)
    pulls = (joints >= 0) & (bias[:, 1] >= 0) & (gear > 0)
    dofs = m.jnt_dofadr[joints[pulls]]

    def reached(force: Array, slope: Array) -> Array:
        total = np.where(straight, m.dof_M0 * np.linalg.norm(gravity(m)), 0.0)
        damping = m.dof_damping + m.dof_M0 / _DAY
        np.add.at(total, dofs, gear[pulls] * force[pulls])
        np.add.at(damping, dofs, gear[pulls] ** 2 * slope[pulls])
        return total / np.maximum(damping, TINY)

    slope = np.maximum(-bias[:, 2], 0.0)
    within = np.minimum(reached(wanted, slope), reached(np.minimum(wanted, limit), 0 * slope))
    return np.minimum(np.maximum(np.maximum(in_a_step, _FAST), within), HUGE)


def gravity(m: mujoco.MjModel) -> Array:
    """Return gravity (3,) [m/s²], zero where the model's file turns it off."""
    off = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    return np.array(m.opt.gravity) * (not m.opt.disableflags & off)


# What a Model has as the mjModel has it; as int64; and kinds of elements that have names.
_PLAIN = (
    *("nq", "nv", "nu", "nbody", "njnt", "nsite", "ngeom", "nmocap", "jnt_range", "dof_armature"),
    *("dof_damping", "dof_frictionloss", "body_mass", "geom_friction", "site_pos", "site_quat"),
)
_WHOLE = (
    *("jnt_type", "jnt_qposadr", "jnt_dofadr", "jnt_bodyid"),
    *("body_parentid", "geom_bodyid", "site_bodyid"),
)
_NAMED = {"body": "nbody", "joint": "njnt", "site": "nsite", "geom": "ngeom"}


def facts(m: mujoco.MjModel) -> dict[str, Any]:
    """Return what `Model.__init__` wants of a compiled model; see there for shapes and units.

    A backend adds `backend`, `engine_version`, `path`, `raw`, `capabilities`, `timestep` and
    `substeps`.
    """
    known: dict[str, Any] = {name: getattr(m, name) for name in _PLAIN}
    known |= {name: getattr(m, name).astype(np.int64) for name in _WHOLE}
    known |= {f"{kind}_names": _names(m, kind, getattr(m, count)) for kind, count in _NAMED.items()}
    known |= _actuator_facts(m)
    known["_clamps"] = not m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)
    known["gravity"] = gravity(m)
    known["jnt_limited"] = m.jnt_limited.astype(bool)
    known["keyframes"] = tuple(_keyframe(m, key) for key in range(m.nkey))
    known["mocap_pos0"] = m.body_pos[m.body_mocapid >= 0]
    known["mocap_quat0"] = m.body_quat[m.body_mocapid >= 0]
    return known


def _names(m: mujoco.MjModel, kind: str, count: int) -> tuple[str, ...]:
    """Return the names of all elements of a kind, "" for one without a name."""
    return tuple(getattr(m, kind)(k).name for k in range(count))


def _actuator_facts(m: mujoco.MjModel) -> dict[str, Any]:
    """Return the facts of a Model about its actuators."""
    owner, servo = servos(m)
    on_joint = (m.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT))[owner]
    gain, bias = m.actuator_gainprm[owner, 0], m.actuator_biasprm[owner]
    fixed = (m.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED))[owner]
    unbiased = (m.actuator_biastype == int(mujoco.mjtBias.mjBIAS_NONE))[owner]
    direct = (m.actuator_dyntype == int(mujoco.mjtDyn.mjDYN_NONE))[owner]
    joints = np.where(on_joint, m.actuator_trnid[owner, 0], -1)
    force_limited = m.actuator_forcelimited[owner]
    known: dict[str, Any] = {"actuator_names": tuple(control_names(m))}
    known["actuator_jntid"] = joints.astype(np.int64)
    known["actuator_ctrlrange"] = _ranges(m.actuator_ctrlrange, m.actuator_ctrllimited)
    known["actuator_forcerange"] = _ranges(m.actuator_forcerange[owner], force_limited)
    known["actuator_kp"] = np.where(servo, gain, np.nan)
    known["actuator_kv"] = np.where(servo, -bias[:, 2], np.nan)
    known["actuator_gain"] = np.where(fixed & unbiased & direct, gain, np.nan)
    known["actuator_delay"] = delay_steps(m) * m.opt.timestep
    known["actuator_gear"] = m.actuator_gear[m.actuator_outadr[owner], 0]
    return known


def _keyframe(m: mujoco.MjModel, key: int) -> Keyframe:
    name, time = m.key(key).name, float(m.key_time[key])
    places, turns = m.key_mpos[key].reshape(-1, 3), m.key_mquat[key].reshape(-1, 4)
    return Keyframe(name, time, m.key_qpos[key], m.key_qvel[key], m.key_ctrl[key], places, turns)


def _ranges(ranges: Array, limited: Any) -> Array:
    return np.where(limited[:, None].astype(bool), ranges, [-np.inf, np.inf])
