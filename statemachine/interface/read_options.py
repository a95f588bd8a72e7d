"""Options that act only while a file is read, where they stand beside others."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, Protocol

from ..errors import BadInputError, check_name
from .checks import HasCapabilities, as_switch, as_vector, unsupported, unsupported_by
from .free_base import FreeBase
from .records import AS_WRITTEN, READ_OPTIONS, Base, ReadOptions

BASES: tuple[Base, ...] = ("free", "fixed")


class WasRead(HasCapabilities, Protocol):
    """A Model, as far as options of `load` are concerned."""

    @property
    def read_options(self) -> ReadOptions: ...


def checked_read_options(
    balance_inertia: bool, meshes: bool, base: Base | FreeBase | None, least_mass: bool = False
) -> ReadOptions:
    """Return the options of `load` that act while a file is read; `least_mass` is none of a user's.

    Raises:
        UnknownNameError: The base is neither "free" nor "fixed" nor a FreeBase.
        BadInputError: A switch is neither True nor False; a number of where the base starts is not
            finite, or its quaternion is zero.
    """
    options = ReadOptions(
        balance_inertia=as_switch(balance_inertia, "balance_inertia"),
        meshes=as_switch(meshes, "meshes"),
        least_mass=least_mass,
    )
    if base is None:
        return options
    if not isinstance(base, FreeBase):
        check_name("base", base, BASES)
        return replace(options, base=base)
    pos = as_vector(base.pos, (3,), "pos of the base").tolist()
    quat = as_vector(base.quat, (4,), "quat of the base")
    if not quat.any():
        raise BadInputError("quat of the base is zero: it is no rotation")
    return replace(options, base="free", start=FreeBase(tuple(pos), tuple(quat.tolist())))


def non_default_options(options: ReadOptions) -> dict[str, bool | str]:
    """Return the options that differ from the defaults of `load`, by name."""
    named: dict[str, bool | str] = {}
    for name in READ_OPTIONS:
        value = getattr(options, name)
        if value is not getattr(AS_WRITTEN, name):
            named[name] = value
    return named


def check_takes_read_options(
    backend: str, parameters: Collection[str], options: ReadOptions
) -> None:
    """Check that the loader of a backend can be told how a file is read.

    Args:
        backend: Its name.
        parameters: Names of what its loader takes.
        options: One at least is not as by default.

    Raises:
        UnsupportedError: It reads files in its own way.
    """
    if "read_options" not in parameters:
        raise unsupported_by(
            backend, next(iter(non_default_options(options))), "it reads files in its own way"
        )


def without_read_options(of: WasRead, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options without those that act only while a file is read.

    Args:
        of: The Model that others are to be given to.
        options: Values by name, as the caller gave them.

    Raises:
        UnsupportedError: One of those has another value than when the file of the Model was read.
        BadInputError: One of those is not on or off, or is no base.
    """
    others: dict[str, Any] = {}
    for name, value in options.items():
        if name not in READ_OPTIONS:
            others[name] = value
        elif checked_read_option(name, value) != getattr(of.read_options, name):
            reason = f"it acts only while a file is read: load(…, {name}={value!r})"
            raise unsupported(of, name, reason)
    return others


def checked_read_option(name: str, value: Any) -> bool | str | None:
    """Return the value of an option that acts while a file is read.

    Raises:
        UnknownNameError: It is `base`, and neither "free" nor "fixed" nor None.
        BadInputError: It is another one, and neither True nor False.
    """
    if name != "base":
        return as_switch(value, name)
    if value is not None:
        check_name("base", value, BASES)
    return value
