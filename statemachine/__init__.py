"""A physics simulator is a state machine that you advance.

    import statemachine as sm

    model = sm.load("so101/scene_box", backend="mujoco")
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    sm.step(model, data, 400)

Names are imported when they are first used, so that `import statemachine` and
`statemachine --help` load no engine.
"""

from __future__ import annotations

import os as _os
from importlib import import_module as _import_module

# As typing.TYPE_CHECKING is to type checkers. To import that takes so long that a Ctrl-C may fall
# into it, before the command is there to answer.
TYPE_CHECKING = False

__version__ = "0.1.0"

# The distribution python-statemachine installs an import package of this very name;
# where both were installed into one folder, its files lie among ours.
if _os.path.exists(_os.path.join(_os.path.dirname(__file__), "statemachine.py")):
    raise ImportError(
        "the package python-statemachine is installed here too and uses the same import name: "
        "pip uninstall python-statemachine, then pip install --force-reinstall statemachine-sim"
    )

if TYPE_CHECKING:
    from typing import Any

    from .backends import load as load
    from .freshness import freshness as freshness
    from .freshness import watch_freshness as watch_freshness
    from .interface import Data as Data
    from .interface import Model as Model
    from .interface import State as State
    from .interface import forward as forward
    from .interface import get_state as get_state
    from .interface import make_data as make_data
    from .interface import reset as reset
    from .interface import set_state as set_state
    from .interface import step as step
    from .kinematics import Kinematics as Kinematics

_HOMES = {
    "load": "backends",
    "make_data": "interface",
    "forward": "interface",
    "step": "interface",
    "reset": "interface",
    "get_state": "interface",
    "set_state": "interface",
    "Model": "interface",
    "Data": "interface",
    "State": "interface",
    "Kinematics": "kinematics",
    "freshness": "freshness",
    "watch_freshness": "freshness",
}
_MODULES = {
    "backends": "backends",
    "conformance": "conformance",
    "errors": "errors",
    "kinematics": "kinematics",
    "lab": "lab",
    "models": "models",
    "recordings": "lab.recordings",
    "rotations": "rotations",
}

__all__ = [
    "Data",
    "Kinematics",
    "Model",
    "State",
    "__version__",
    "forward",
    "freshness",
    "get_state",
    "load",
    "make_data",
    "reset",
    "set_state",
    "step",
    "watch_freshness",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(_import_module(f".{_HOMES[name]}", __name__), name)
    elif name in _MODULES:
        value = _import_module(f".{_MODULES[name]}", __name__)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{_instead_of(name)}")
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value


def _instead_of(name: str) -> str:
    """Return what to write for a name of MuJoCo's, "; write …"; "" for any other."""
    if not name.startswith(("mj", "Mj")):
        return ""
    names = _import_module(".interface.unknown_attributes", __name__).OF_PACKAGE
    return f"; write {names[name]}" if name in names else ""


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES})
