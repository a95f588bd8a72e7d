"""Whether a file can be believed: it may have been edited, made to do harm, or be no trace."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TraceError
from ..interface import OPTIONS, JointType
from ..interface.checks import HUGE

if TYPE_CHECKING:
    from .trace import Header


# Bytes that a trace may unfold into: this many, or so many times the size of its file.
# Recorded runs are 2 to 3 times as large as their files.
_UNFOLDED, _TIMES, _MOST = 2**28, 100, 2**32
_LONGEST = 1000  # characters of a name or a sentence
WHOLE = ("contact_row", "contact_geom")  # columns of whole numbers
# No number of a run is larger, and what is computed from smaller ones stays finite.
LARGEST = 1e100


def check_size(unfolded: int, path: Path) -> None:
    """Refuse a file that unfolds into more than a recorded run would.

    Raises:
        TraceError: It does.
    """
    most = min(max(_UNFOLDED, _TIMES * path.stat().st_size), _MOST)
    if unfolded > most:
        raise TraceError(
            f"unfolds into {unfolded / 2**20:,.0f} MB; a file of this size may into "
            f"{most / 2**20:,.0f}"
        )


def as_column(name: str, array: Any) -> Any:
    """An array of a file as a column: int64, or float64."""
    return np.asarray(array, dtype=np.int64 if name in WHOLE else np.float64)


def _text(value: Any) -> bool:
    if not isinstance(value, str) or len(value) > _LONGEST:
        return False
    # Half of a surrogate pair is no text: it can be written nowhere.
    return not any("\ud800" <= character <= "\udfff" for character in value)


def _number(value: Any) -> bool:
    return isinstance(value, float) or _whole(value)


def _finite(value: Any) -> bool:
    return _number(value) and math.isfinite(value) and abs(value) <= HUGE


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _each(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, tuple) and all(map(fits, value))


def _words(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_text, (*value, *value.values())))


def _option(name: str, value: Any) -> bool:
    """Whether `Model.replace` might take this; it looks closer."""
    known = isinstance(value, bool) or _text(value) or _finite(value) or _each(_finite)(value)
    return name in OPTIONS and known


_KINDS: dict[str, Callable[[Any], bool]] = {
    "experiment": _text,
    "says": _text,
    "command": _text,
    "defaults": lambda value: value in ("model", "engine"),
    "options": lambda value: (
        isinstance(value, dict) and all(_option(name, each) for name, each in value.items())
    ),
    "keyframe": lambda value: value is None or _text(value),
    "gravity": lambda value: _each(_finite)(value) and len(value) == 3,
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
