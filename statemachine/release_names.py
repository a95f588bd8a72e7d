"""Names of releases of an engine, such as "mujoco==3.3.7"."""

from __future__ import annotations

import re

from .errors import BadInputError, check_name
from .installed import DEFAULT

_NAME = re.compile(r"(?P<engine>[a-z]+)==(?P<version>\d+\.\d+\.\d+(\.?\w+)*)", re.ASCII)
_EXAMPLE = f"{DEFAULT}==3.3.7"
_OLDEST = (3, 0, 0)  # whose contacts are arrays, as those of every release since


def is_release(name: str) -> bool:
    """Return whether the name of a backend means a release of MuJoCo."""
    return "==" in name


def version_of(name: str) -> str:
    """Return the version that a release's name has.

    Raises:
        BadInputError: It is no such name.
        UnknownNameError: It is not one of MuJoCo.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        whole = f"{name}.0" if _NAME.fullmatch(f"{name}.0") else _EXAMPLE
        raise BadInputError(
            f"{name!r} is not a release of {DEFAULT}, which has three numbers: type {whole}"
        )
    check_name("engine with releases", match["engine"], [DEFAULT])
    return match["version"]


def check_age(name: str) -> None:
    """Raise BadInputError for a release that is too old to be driven.

    Raises:
        BadInputError: As `version_of`, or it is older than 3.0.0.
    """
    numbers = re.findall(r"[0-9]+", version_of(name))
    if tuple(map(int, numbers[:3])) < _OLDEST:
        oldest = ".".join(map(str, _OLDEST))
        raise BadInputError(
            f"{name} is too old to be driven: its contacts are no arrays; the oldest release that "
            f"can be is {DEFAULT}=={oldest}"
        )


def engine_of(name: str) -> str:
    """Return the engine that a backend's name has, be it a release or not."""
    return name.partition("==")[0]
