"""Names of releases of an engine, such as "mujoco==3.3.7"."""

from __future__ import annotations

import re

from .errors import BadInputError, check_name
from .installed import DEFAULT

_NAME = re.compile(r"(?P<engine>[a-z]+)==(?P<version>\d+\.\d+\.\d+(\.?\w+)*)", re.ASCII)
_EXAMPLE = f"{DEFAULT}==3.3.7"


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


def engine_of(name: str) -> str:
    """Return the engine that a backend's name has, be it a release or not."""
    return name.partition("==")[0]
