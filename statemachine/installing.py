"""How the user calls pip: what is printed to install an extra runs as printed."""

from __future__ import annotations

import shlex
from pathlib import Path

from .program import python

_DISTRIBUTION = "statemachine-sim"


def pip() -> str:
    """Return what starts the pip that installs into the Python that runs this."""
    return f"{python()} -m pip"


def install_command(extra: str) -> str:
    """Return the command that installs an extra of this library, into the Python that runs it.

    Args:
        extra: Its name.
    """
    folder = _clone()
    if folder is None:
        what = [f"{_DISTRIBUTION}[{extra}]"]
    elif folder == Path.cwd():
        what = ["-e", f".[{extra}]"]
    else:
        what = ["-e", f"{folder}[{extra}]"]
    return f"{pip()} install {shlex.join(what)}"


def _clone() -> Path | None:
    """Return the folder of the sources that this runs from; None where it is installed."""
    folder = Path(__file__).absolute().parent.parent
    return folder if (folder / "pyproject.toml").is_file() else None
