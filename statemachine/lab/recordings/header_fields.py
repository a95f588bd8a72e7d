"""What each field of the header of a trace may be: a trace may come from anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ...interface import OPTIONS
from ...interface.checks import HUGE
from ...interface.records import READ_OPTIONS

_MAX_TEXT_LENGTH = 1000  # characters of a name or a sentence


def _is_text(value: Any) -> bool:
    if not isinstance(value, str) or len(value) > _MAX_TEXT_LENGTH:
        return False
    # Half of a surrogate pair is not text: it can be written nowhere.
    return not any("\ud800" <= character <= "\udfff" for character in value)


def _is_number(value: Any) -> bool:
    return isinstance(value, float) or _is_integer(value)


def _is_finite(value: Any) -> bool:
    return _is_number(value) and math.isfinite(value) and abs(value) <= HUGE


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _is_tuple_of(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, tuple) and all(map(fits, value))


def _is_option(name: str, value: Any) -> bool:
    """Return whether an option may be one of `Model.replace` or `load`, which check it further."""
    known = (
        isinstance(value, bool)
        or _is_text(value)
        or _is_finite(value)
        or _is_tuple_of(_is_finite)(value)
    )
    return name in (*OPTIONS, *READ_OPTIONS) and known


def _is_count(value: Any) -> bool:
    return _is_integer(value) and 0 <= value < 10**6


def _is_timestep(value: Any) -> bool:
    return isinstance(value, float) and 0 < value < 1e6


def _is_defaults(value: Any) -> bool:
    return value in ("model", "engine")


def _are_options(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    return all(_is_option(name, option) for name, option in value.items())


def _is_text_or_none(value: Any) -> bool:
    return value is None or _is_text(value)


def _is_integer_or_none(value: Any) -> bool:
    return value is None or _is_integer(value)


def _is_vector(value: Any) -> bool:
    return _are_finite(value) and len(value) == 3


def _is_interval(value: Any) -> bool:
    return _is_tuple_of(_is_number)(value) and len(value) == 2


def _is_switch(value: Any) -> bool:
    return isinstance(value, bool)


def _are_versions(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    return all(_is_text(name) and _is_text(version) for name, version in value.items())


_are_texts = _is_tuple_of(_is_text)
_are_integers = _is_tuple_of(_is_integer)
_are_finite = _is_tuple_of(_is_finite)
_are_intervals = _is_tuple_of(_is_interval)
KINDS: dict[str, Callable[[Any], bool]] = {
    "nq": _is_count,
    "nv": _is_count,
    "nu": _is_count,
    "nmocap": _is_count,
    "substeps": _is_count,
    "timestep": _is_timestep,
    "experiment": _is_text,
    "description": _is_text,
    "command": _is_text,
    "energy_by": _is_text,
    "ended": _is_text,
    "defaults": _is_defaults,
    "options": _are_options,
    "keyframe": _is_text_or_none,
    "gravity": _is_vector,
    "joints": _are_texts,
    "sites": _are_texts,
    "bodies": _are_texts,
    "geoms": _are_texts,
    "actuators": _are_texts,
    "jnt_type": _are_integers,
    "jnt_qposadr": _are_integers,
    "jnt_dofadr": _are_integers,
    "jnt_bodyid": _are_integers,
    "site_bodyid": _are_integers,
    "servo_gear": _are_finite,
    "geom_bodyid": _are_integers,
    "body_parentid": _are_integers,
    "actuator_jntid": _are_integers,
    "ctrlrange": _are_intervals,
    "rewritten": _is_integer,
    "single_precision": _is_switch,
}
PROVENANCE_KINDS: dict[str, Callable[[Any], bool]] = {
    "backend": _is_text,
    "versions": _are_versions,
    "model_file": _is_text,
    "model_sha256": _is_text,
    "timestep": _is_number,
    "emulated": _are_texts,
    "seed": _is_integer_or_none,
}
