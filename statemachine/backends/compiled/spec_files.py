"""From an MJCF or a URDF file to a specification, and why MuJoCo gave up where it did.

What compiles a specification is in `compiled`, and what changes one before that in `reading` and
`repairs`.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import mujoco

from ...errors import one_line

# What MuJoCo raises where it gives up, beside the ValueError of a file that it cannot read. A
# RuntimeError is one of C++ that the bindings do not know: of memory that cannot be had.
ENGINE_ERRORS = (MemoryError, RuntimeError, mujoco.FatalError)
_NO_MEMORY = ("could not allocate memory", "unknown exception", "bad_alloc")


def reason_of(error: BaseException) -> str:
    """Say in one line why MuJoCo gave up; where memory ended, that it did."""
    text = one_line(error)
    if isinstance(error, MemoryError) or any(sign in text.lower() for sign in _NO_MEMORY):
        return f"it takes more memory than there is ({text})" if text else "out of memory"
    return text or type(error).__name__


def read_spec(path: Path, visuals: bool = False) -> mujoco.MjSpec:
    """Read an MJCF or a URDF file, and compile nothing.

    Meshes of a URDF that MuJoCo would not find are looked up as `file_text` says.

    Args:
        path: The file.
        visuals: Whether visual shapes of a URDF are read, too, which MuJoCo leaves out unless the
            file says `discardvisual="false"`.

    Raises:
        ValueError: MuJoCo cannot read it.
    """
    text = None
    if path.suffix != ".xml":
        from ..file_text import text_for

        text = text_for(path, visuals)
    if text is None:
        return mujoco.MjSpec.from_file(str(path))
    spec = mujoco.MjSpec.from_string(text)
    spec.modelfiledir = str(path.parent.resolve())
    return spec


def compile_spec(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification.

    What MuJoCo warns of goes to its warning handler, as where it compiles a file: a specification
    makes a UserWarning of Python of it.

    Raises:
        ValueError: MuJoCo refuses it.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        raw = spec.compile()
    handler = mujoco.get_mju_user_warning()
    for warning in caught:
        if handler is None:
            warnings.warn(str(warning.message), stacklevel=2)
        else:
            handler(str(warning.message))
    return raw
