"""What to type where an engine or an extra is missing: it runs as printed."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from .engine_wheels import Engine, Wheel
from .errors import MissingEngineError
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


def wheel_here(engine: Engine) -> Wheel | None:
    """Return what can be installed on this machine without a compiler."""
    here = (sys.platform, platform.machine(), sys.version_info.minor)
    if platform.python_implementation() != "CPython":
        return None
    return next((wheel for wheel in engine.wheels if wheel.fits(*here)), None)


def _remedy(engine: Engine) -> str:
    """Return what to type on this machine, or that nothing can be installed."""
    wheel = wheel_here(engine)
    if wheel is None:
        where = f"{platform.system()} {platform.machine()} and Python 3.{sys.version_info.minor}"
        return f"no wheel for {where}, only for {engine.places}"
    command = f"{pip()} install {wheel.requirement}"
    if engine.extra:
        command = install_command(engine.extra)
    return f"{command} (wheels for {engine.places})"


def missing_error(engine: Engine) -> MissingEngineError:
    """Return the error that says how to install an engine."""
    message = f"{engine.name} is not installed here: {_remedy(engine)}"
    return MissingEngineError(message, engine=engine.name)


def broken_error(engine: Engine, error: Exception) -> MissingEngineError:
    """Return the error that says why an installed engine does not load.

    Args:
        engine: The engine.
        error: What its import raised.
    """
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    message = f"{engine.name} is installed and does not load: {reason}"
    if "libgomp" in reason:
        message += "; on Debian and Ubuntu: apt-get install libgomp1"
    elif engine.name == "mujoco" and os.environ.get("MUJOCO_GL"):
        message += f"; MUJOCO_GL={os.environ['MUJOCO_GL']} is set: unset it"
    return MissingEngineError(message, engine=engine.name)


def other_module_error(engine: Engine) -> MissingEngineError:
    """Return the error that says that a module with the name of an engine is something else."""
    return MissingEngineError(
        f"the installed package {engine.module!r} is not the engine {engine.name}: "
        f"pip uninstall {engine.module}, then {_remedy(engine)}",
        engine=engine.name,
    )


def overwritten_error(engine: Engine, distributions: Sequence[str]) -> MissingEngineError:
    """Return the error that says that two distributions of an engine are installed at once.

    Args:
        engine: The engine.
        distributions: Their names.
    """
    return MissingEngineError(
        f"{' and '.join(distributions)} are both installed, and each has overwritten files of the "
        f"other: pip uninstall -y {' '.join(distributions)}, then {_remedy(engine)}",
        engine=engine.name,
    )
