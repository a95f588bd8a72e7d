"""Whether the header of a trace can be believed: a file may have been edited, or be no trace."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..errors import TraceError
from ..records import JointType

if TYPE_CHECKING:
    from .trace import Header


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _each(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, tuple) and all(map(fits, value))


def _words(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_text, value.values()))


_KINDS: dict[str, Callable[[Any], bool]] = {
    "experiment": _text,
    "says": _text,
    "command": _text,
    "defaults": lambda value: value in ("model", "engine"),
    "options": lambda value: isinstance(value, dict),
    "keyframe": lambda value: value is None or _text(value),
    "gravity": lambda value: _each(_number)(value) and len(value) == 3,
    "joints": _each(_text),
    "sites": _each(_text),
    "bodies": _each(_text),
    "geoms": _each(_text),
    "actuators": _each(_text),
    "jnt_type": _each(_whole),
    "jnt_qposadr": _each(_whole),
    "jnt_dofadr": _each(_whole),
    "geom_bodyid": _each(_whole),
    "body_parentid": _each(_whole),
    "actuator_jntid": _each(_whole),
    "ctrlrange": _each(lambda row: _each(_number)(row) and len(row) == 2),
    "energy_by": _text,
    "rewritten": _whole,
    "ended": _text,
    "single": lambda value: isinstance(value, bool),
}
_OF_PROVENANCE: dict[str, Callable[[Any], bool]] = {
    "backend": _text,
    "versions": _words,
    "model_file": _text,
    "model_sha256": _text,
    "timestep": _number,
    "emulated": _each(_text),
    "seed": lambda value: value is None or _whole(value),
}


def check_header(header: Header) -> None:
    """Every field is of its kind, and no name stands twice.

    Raises:
        TraceError: One is not.
    """
    for owner, kinds in ((header, _KINDS), (header.provenance, _OF_PROVENANCE)):
        for name, fits in kinds.items():
            value = getattr(owner, name)
            if not fits(value):
                raise TraceError(f"{name} = {str(value)[:40]!r} of the trace is not what it may be")
    for what in ("joints", "sites", "bodies", "actuators"):
        names = Counter(name for name in getattr(header, what) if name)
        if names and (most := names.most_common(1)[0])[1] > 1:
            raise TraceError(f"two {what} of the trace are called {most[0][:40]!r}")


def check_places(header: Header) -> None:
    """Every number that says where something is says a place that there is.

    Raises:
        TraceError: One does not.
    """
    known = {int(kind) for kind in JointType}
    for name, kind, qpos, dof in zip(
        header.joint_labels, header.jnt_type, header.jnt_qposadr, header.jnt_dofadr, strict=True
    ):
        if kind not in known:
            raise TraceError(f"{name} of the trace is a joint of no known kind: {kind}")
        of = JointType(kind)
        if not (0 <= qpos <= header.nq - of.nq and 0 <= dof <= header.nv - of.nv):
            raise TraceError(f"{name} of the trace has no place in qpos and qvel")
    bodies, joints = len(header.bodies), len(header.joints)
    for name, most in (
        ("geom_bodyid", bodies),
        ("body_parentid", bodies),
        ("actuator_jntid", joints),
    ):
        least = -1 if name == "actuator_jntid" else 0
        if not all(least <= number < most for number in getattr(header, name)):
            raise TraceError(f"{name} of the trace names one that is not there")
