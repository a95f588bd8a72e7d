"""A file that MuJoCo refuses, compiled all the same, and the list of what was changed for that.

    reading = compile_mended(path)
    reading.compiled     # mujoco.MjModel
    reading.spec         # mujoco.MjSpec as it was read, before anything was mended
    reading.repairs      # what was mended; empty for a file that MuJoCo compiles as it is

MuJoCo's compiler ends at the first fault. Here each fault that it names is mended in the least way
that it accepts, and it is asked again, until it compiles:

- principal moments A, B, C of an inertia that break A + B >= C all become their mean, which is what
  `balanceinertia` does;
- so do those of an inertia that has a negative one; where their mean is not above zero, they become
  `LEAST`;
- a body that moves without mass or inertia gets `LEAST` of it;
- a mesh, height field, texture or skin that cannot be read is deleted, and with it the geoms of its
  shape, and pairs and sensors of these; a site of its shape stays, as a sphere.

Nothing is changed in a file that compiles, but what its own `balanceinertia` asks for: that is
listed in the same way.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...errors import ModelError, one_line
from ...interface import Array
from ..repair_record import LEAST, Repair, label_of
from .spec_assets import asset_named, assets_of_file, delete_assets
from .spec_files import ENGINE_ERRORS, compile_spec, read_spec, reason_of

_SMALLEST = 1e-15
# What an eigenvalue of an inertia must be at least (mjEPS) [kg m^2].
_LEAST_EIGENVALUE = 1e-14
# How MuJoCo names a fault, and the element that has it.
_UNBALANCED, _NOT_POSITIVE = "must satisfy A + B >= C", "must have positive eigenvalues"
_NO_MASS = "must be larger than mjMINVAL"
_ELEMENT = re.compile(r"Element name '(?P<name>[^']*)', id (?P<id>\d+)(, line (?P<line>\d+))?")
_OPENED = re.compile(r"opening file '(?P<file>[^']*)'")


@dataclass(frozen=True, eq=False)
class MendedModel:
    """A file as it was read, and what MuJoCo compiles of it.

    Attributes:
        spec: The specification as it was read: mass, inertia and frames of every body as the file
            states them. It was not compiled, which would fuse static bodies in it.
        compiled: The compiled model.
        repairs: What was changed for it, in the order in which MuJoCo named the faults.
    """

    spec: mujoco.MjSpec
    compiled: mujoco.MjModel
    repairs: tuple[Repair, ...]


def compile_mended(
    path: Path,
    *,
    fuse_static: bool | None = None,
    visuals: bool = False,
    prepare: Callable[[mujoco.MjSpec], None] | None = None,
) -> MendedModel:
    """Compile a file, and mend what MuJoCo refuses in it.

    Args:
        path: An MJCF or URDF file.
        fuse_static: Whether static bodies (links behind fixed joints) become part of their parents;
            None for what the file's <compiler> says (of a URDF true, of an MJCF false, by default).
        visuals: Whether visual shapes of a URDF are read, too; by default they are left out, as
            MuJoCo does unless the file says `discardvisual="false"`.
        prepare: What is done to the specification before it is compiled, after it was mended.

    Raises:
        ModelError: It cannot be read at all, or has a fault that nothing here mends.
    """
    faults: list[str] = []
    while True:
        try:
            # Read anew each time: a compiler that gives up may leave a specification changed.
            spec = read_spec(path, visuals)
        except (ValueError, *ENGINE_ERRORS) as error:
            raise ModelError(f"MuJoCo cannot read {path}: {reason_of(error)}") from error
        if fuse_static is not None:
            spec.compiler.fusestatic = fuse_static
        repairs: list[Repair] = []
        if spec.compiler.balanceinertia:
            repairs += balance_all(spec, "balanceinertia of the <compiler>")
        for fault in faults:
            repairs += _mend(spec, fault)
        if prepare is not None:
            prepare(spec)
        try:
            compiled = compile_spec(spec)
        except (ValueError, *ENGINE_ERRORS) as error:
            fault = str(error)
            if fault in faults or not _mend(read_spec(path, visuals), fault):
                raise ModelError(f"MuJoCo cannot read {path}: {reason_of(error)}") from error
            faults.append(fault)
            continue
        return MendedModel(read_spec(path, visuals), compiled, tuple(repairs))


@dataclass(frozen=True)
class _Fault:
    """What MuJoCo says when it gives up.

    Attributes:
        reason: In one line, without the element.
        name: Of the element; "" for one without a name, and where none is named.
        number: The place of the element among those of its kind; None where none is named.
        line: Of the file; None where it is not told.
    """

    reason: str
    name: str
    number: int | None
    line: int | None

    @classmethod
    def of(cls, message: str) -> _Fault:
        """Read a message."""
        element = _ELEMENT.search(message)
        reason = one_line(message if element is None else message[: element.start()])
        reason = reason.removeprefix("Error: ").strip()
        if element is None:
            return cls(reason, "", None, None)
        line = None if element["line"] is None else int(element["line"])
        return cls(reason, element["name"], int(element["id"]), line)


def _mend(spec: mujoco.MjSpec, message: str) -> list[Repair]:
    """Mend the fault that MuJoCo names; none where it is none of those that are known here."""
    fault = _Fault.of(message)
    if (opened := _OPENED.search(fault.reason)) is not None:
        return delete_assets(spec, assets_of_file(spec, opened["file"]), fault.reason)
    if fault.number is None:
        return []
    for sign, mend in _MENDS.items():
        if sign in fault.reason:
            body = _body(spec, fault.name, fault.number)
            return [] if body is None else mend(spec, body, fault)
    assets = asset_named(spec, fault.name, fault.number)
    return delete_assets(spec, assets, fault.reason, fault.line)


def _body(spec: mujoco.MjSpec, name: str, number: int) -> Any:
    """Return a body by its name, or by its place where it has none; None if there is none."""
    if name:
        return spec.body(name)
    bodies = list(spec.bodies)
    return bodies[number] if number < len(bodies) and not bodies[number].name else None


def stated_moments(body: Any) -> Array | None:
    """Return the principal moments (3,) that a body of a specification states.

    Args:
        body: A mujoco.MjsBody that was not compiled.

    Returns:
        Moments of inertia [kg m^2], in the order of the axes that the file states them along (ixx,
        iyy, izz), each where its own axis is nearest; None where the file gives no inertia.
    """
    full = np.array(body.fullinertia)
    if not np.isnan(full[0]):
        xx, yy, zz, xy, xz, yz = full
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return _moments_by_axis(matrix)
    if not body.explicitinertial:
        return None
    return np.array(body.inertia)


def _moments_by_axis(matrix: Array) -> Array:
    """Return the principal moments (3,) of an inertia, each at the axis that its own is nearest to.

    Args:
        matrix: The inertia (3, 3) [kg m^2].
    """
    moments, own = np.linalg.eigh(matrix)
    cosines = np.abs(own)  # of an axis of the matrix, by row, with a principal one, by column
    # Rounded, so that two orders that are as near are a matter of no last digit.
    order = max(
        permutations(range(3)), key=lambda order: round(float(cosines[range(3), order].sum()), 9)
    )
    return moments[list(order)]


def balance_all(spec: mujoco.MjSpec, reason: str) -> list[Repair]:
    """Balance every inertia that breaks A + B >= C, or that has a moment which is not positive.

    Args:
        spec: The specification, which was not compiled yet.
        reason: Why.

    Returns:
        A record of each.
    """
    repairs: list[Repair] = []
    for body in spec.bodies:
        moments = stated_moments(body)
        if moments is None or not moments.any():
            continue
        smallest, middle, largest = np.sort(moments).tolist()
        if largest > middle + smallest or smallest < _LEAST_EIGENVALUE:
            repairs += _balance(spec, body, _Fault(reason, body.name, None, None))
    return repairs


def mend_inertia(spec: mujoco.MjSpec, message: str) -> list[Repair]:
    """Balance the inertia that MuJoCo refuses; none where its fault is another one.

    Args:
        spec: The specification, which was not compiled yet.
        message: What MuJoCo says.
    """
    is_of_inertia = _UNBALANCED in message or _NOT_POSITIVE in message
    return _mend(spec, message) if is_of_inertia else []


def mend_mass(spec: mujoco.MjSpec, message: str) -> list[Repair]:
    """Give the body that MuJoCo refuses the least mass; none where its fault is another one.

    Args:
        spec: The specification, which was not compiled yet.
        message: What MuJoCo says.
    """
    return _mend(spec, message) if _NO_MASS in message else []


def _balance(spec: mujoco.MjSpec, body: Any, fault: _Fault) -> list[Repair]:
    """Make all moments of an inertia their mean, as `balanceinertia` does."""
    stated = stated_moments(body)
    if stated is None:
        return []
    mean = float(stated.mean())
    used = mean if mean > _SMALLEST else LEAST
    _set_moments(body, [used] * 3)
    return [_of_inertia(spec, body, stated, [used] * 3, fault)]


def _give_mass(spec: mujoco.MjSpec, body: Any, fault: _Fault) -> list[Repair]:
    """Give a body that moves the least mass and inertia, as far as it has none."""
    repairs: list[Repair] = []
    mass = float(body.mass) if body.explicitinertial else None
    moments = stated_moments(body)
    if mass is None or mass <= _SMALLEST:
        name = label_of("body", body, spec.bodies)
        repairs.append(
            Repair("body", name, name, "mass", mass, LEAST, "kg", fault.reason, fault.line)
        )
        body.mass = LEAST
    if moments is None or moments.min() <= _SMALLEST:
        used = [LEAST] * 3 if moments is None else np.maximum(moments, LEAST).tolist()
        repairs.append(_of_inertia(spec, body, moments, used, fault))
        _set_moments(body, used)
    return repairs


_MENDS: dict[str, Callable[[mujoco.MjSpec, Any, _Fault], list[Repair]]] = {
    _UNBALANCED: _balance,
    _NOT_POSITIVE: _balance,
    _NO_MASS: _give_mass,
}


def _set_moments(body: Any, moments: list[float]) -> None:
    """Write the principal moments of a body along the axes of its inertial frame."""
    body.fullinertia = [math.nan, 0, 0, 0, 0, 0]
    body.inertia = moments
    body.explicitinertial = True


def _of_inertia(
    spec: mujoco.MjSpec, body: Any, stated: Array | None, used: list[float], fault: _Fault
) -> Repair:
    """Return the record of the moments of a body."""
    name = label_of("body", body, spec.bodies)
    return Repair(
        kind="body",
        name=name,
        body=name,
        quantity="inertia",
        stated=None if stated is None else tuple(stated.tolist()),
        used=tuple(used),
        unit="kg m^2",
        reason=fault.reason,
        line=fault.line,
    )
