"""A binary model is tried in a process of its own before it is read into this one.

MuJoCo takes an MJB file nearly as it is. Where a file is damaged, MuJoCo may read or write
memory that is not its own, which ends a process. So another process goes first, and does
with the model what the verbs do.
"""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from contextlib import suppress
from pathlib import Path

import mujoco

from ..errors import ModelError, StateMachineError
from ..interface import DERIVED

_SECONDS = 60.0
_STEPS = 5
_CODE = "import sys; from statemachine.backends._mjb import use; use(sys.argv[1])"
_tried: set[tuple[str, int, int]] = set()


def check_binary(path: str) -> None:
    """Let another process load and use a binary model.

    Raises:
        ModelError: That process crashed, or did not end.
    """
    try:
        stat = os.stat(path)
    except OSError:  # MuJoCo says it better
        return
    tried = (os.path.abspath(path), stat.st_size, stat.st_mtime_ns)
    if tried in _tried:
        return
    command = [sys.executable, "-c", _CODE, path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(
            command,
            env=environment,
            timeout=_SECONDS,
            check=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        raise ModelError(
            f"MuJoCo cannot use {path}: it did not take {_STEPS} steps within {_SECONDS:g} s; "
            "compile it anew from its XML"
        ) from None
    if done.returncode < 0 or done.returncode > 255:  # a signal; on Windows, an exception
        raise ModelError(
            f"MuJoCo cannot use {path}: it is damaged, and crashed a process that tried it "
            f"(exit code {done.returncode}); compile it anew from its XML"
        )
    _tried.add(tried)


def use(path: str) -> None:
    """Do with a binary model what the verbs may do; what is not of this file may fail."""
    from ..interface import verbs
    from .mujoco_backend import MujocoModel

    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    model = MujocoModel(mujoco.MjModel.from_binary_path(path), Path(path), 1)
    data = verbs.make_data(model)
    for key in (None, *range(len(model.keyframes))):
        with suppress(StateMachineError):  # it may diverge, and refuse from then on
            verbs.reset(model, data, key)
            verbs.forward(model, data)
            verbs.step(model, data, _STEPS)
            _ = data.contacts, [getattr(data, name) for name in DERIVED]
            verbs.set_state(model, data, verbs.get_state(model, data))
            verbs.step(model, data)
    with suppress(StateMachineError):
        copied = model.replace(armature=0.1)
        verbs.step(copied, verbs.make_data(copied))
