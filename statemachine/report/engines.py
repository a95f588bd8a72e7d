"""The page of the engines that are installed, and of other releases of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from platform import python_version

from ..installed import available, engine_version
from ..measures.text import NONE
from ..page import Page, Table
from ..releases import Release, folder
from ..show.templates import PageContent, render


@dataclass(frozen=True)
class EnginesPage(PageContent):
    """What the page of releases shows.

    Attributes:
        folder: Where releases are installed.
        releases: Table with a row for each release.
    """

    template = "engines.md.j2"
    folder: str
    releases: Table


def page(releases: Sequence[Release]) -> Page:
    """Return the releases that are installed, then the engines beside this program."""
    rows = [(release.name, release.python, f"{release.size / 1e6:.0f} MB") for release in releases]
    for name in available()[0]:
        rows.append((f"{name}=={engine_version(name)}", python_version(), NONE))
    return render(EnginesPage(str(folder()), Table(("release", "python", "size"), rows)))
