"""Names of releases of an engine, such as "mujoco==3.3.7"."""

from __future__ import annotations

import re

from .errors import BadInputError, check_name
from .installed import DEFAULT

_NAME = re.compile(r"(?P<engine>[a-z]+)==(?P<version>\d+\.\d+\.\d+(\.?\w+)*)", re.ASCII)
_EXAMPLE = f"{DEFAULT}==3.3.7"
_OLDEST = (3, 0, 0)  # the first whose contacts are arrays


def is_release(name: str) -> bool:
    """Tell whether the name of a backend is that of a release, as "mujoco==3.3.7"."""
    return "==" in name


def version_of(name: str) -> str:
    """Return the version in the name of a release: "3.3.7" of "mujoco==3.3.7".

    Raises:
        BadInputError: It is not the name of a release.
        UnknownNameError: It is a release of another engine than MuJoCo.
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
    """Raise an error for a release that is too old to be driven.

    Raises:
        BadInputError: It is not the name of a release, or is older than 3.0.0.
        UnknownNameError: It is a release of another engine than MuJoCo.
    """
    numbers = re.findall(r"[0-9]+", version_of(name))
    if tuple(map(int, numbers[:3])) < _OLDEST:
        oldest = ".".join(map(str, _OLDEST))
        raise BadInputError(
            f"{name} is too old to be driven: its contacts are no arrays; the oldest release that "
            f"can be is {DEFAULT}=={oldest}"
        )


def engine_of(name: str) -> str:
    """Return the engine in the name of a backend, whether that is a release or not."""
    return name.partition("==")[0]
