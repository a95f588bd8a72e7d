"""Releases of engines: which are here, to install some, to remove one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from platform import python_version

from ...errors import BadInputError
from ...installed import available, engine_version
from ...measures.text import NO_NUMBER
from ...release_names import check_age
from ...releases import Release, add, folder, releases, remove
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render


@dataclass(frozen=True)
class ReleasesRequest:
    """Question which releases are here; it is asked in one way only."""


@dataclass(frozen=True)
class AddReleasesRequest:
    """Releases of an engine that are to be installed.

    Attributes:
        names: Of the releases, such as "mujoco==3.3.7", at least one.
        python: The executable of the Python that they are to run on.
    """

    names: tuple[str, ...]
    python: str = sys.executable

    def __post_init__(self) -> None:
        if not self.names:
            raise BadInputError("no release is named: name one, such as mujoco==3.3.7")
        for name in self.names:  # before the first of them is downloaded
            check_age(name)


@dataclass(frozen=True)
class RemoveReleaseRequest:
    """Release of an engine that is to be removed.

    Attributes:
        name: Of the release, such as "mujoco==3.3.7".
    """

    name: str


@dataclass(frozen=True)
class InstalledEngine:
    """An engine beside this program.

    Attributes:
        name: With its version, as "mujoco==4.0.0".
        python: Version of this Python.
    """

    name: str
    python: str


@dataclass(frozen=True)
class ReleasesResult:
    """Engines that are installed here.

    Attributes:
        folder: Where releases are installed.
        releases: Those in environments of their own, by name.
        engines: Those beside this program.
    """

    folder: str
    releases: tuple[Release, ...]
    engines: tuple[InstalledEngine, ...]


@dataclass(frozen=True)
class ReleasesPage(PageContent):
    """Content of the page of releases.

    Attributes:
        result: What is installed.
        releases: Table with a row for each release.
    """

    template = "releases.md.j2"
    result: ReleasesResult
    releases: Table


def answer(_request: ReleasesRequest) -> ReleasesResult:
    """Return the releases that are here, and the engines beside this program."""
    names = [f"{name}=={engine_version(name)}" for name in available()[0]]
    engines = tuple(InstalledEngine(name, python_version()) for name in names)
    return ReleasesResult(str(folder()), tuple(releases()), engines)


def answer_add(request: AddReleasesRequest, say: Callable[[str], object]) -> list[Release]:
    """Install releases, and return what is known of each.

    Args:
        request: What is to be installed.
        say: Told in lines what is being done.

    Raises:
        BadInputError: A name is not one of a release, or there is no such Python.
        EngineError: A release cannot be installed, or does not run.
    """
    for name in request.names:
        add(name, request.python, say)
    return [release for release in releases() if release.name in request.names]


def answer_remove(request: RemoveReleaseRequest) -> None:
    """Remove a release.

    Raises:
        BadInputError: The name is not one of a release.
        MissingEngineError: It is not here.
    """
    remove(request.name)


def size_of(release: Release) -> str:
    """Return the size of a release in words."""
    return f"{release.size / 1e6:.0f} MB"


def page(result: ReleasesResult) -> Page:
    """Return the page of the releases that are here, and of the engines beside this program."""
    rows = [(release.name, release.python, size_of(release)) for release in result.releases]
    rows += [(engine.name, engine.python, NO_NUMBER) for engine in result.engines]
    return render(ReleasesPage(result, Table(("release", "python", "size"), rows)))
