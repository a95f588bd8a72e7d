"""Why MuJoCo refuses a file, and what a user can type so that it is read."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from ..interface.records import ReadOptions
from ..models import what_is_there
from .compiled.reading import compile_with
from .compiled.spec_files import ENGINE_ERRORS, reason_of

_OPENED = re.compile(r"opening file '(.*)'")


def explained(path: Path, options: ReadOptions, error: BaseException) -> str:
    """Return why MuJoCo refuses a file, in one line with what can be done.

    Args:
        path: The file.
        options: With which it was refused.
        error: What MuJoCo raised.
    """
    texts = [reason_of(error)]
    if isinstance(error, ValueError):  # not where memory ended
        missing = _OPENED.search(texts[0])
        if missing is not None:
            texts.append(_of_missing_file(path, missing[1]))
        if with_options := _options_that_read(path, options):
            texts.append(with_options)
    return "; ".join(texts)


def _of_missing_file(path: Path, name: str) -> str:
    """Return where a file was looked for that is not there.

    Args:
        path: The model's file.
        name: The path that MuJoCo tried.
    """
    place = path.absolute().parent / Path(name).parent
    if path.suffix.lower() != ".urdf" or what_is_there(place) == "a folder":
        return f"it is looked for in {place}: copy that folder along with the model"
    # Without the folders in a mesh's name `file_text` has looked for it, too.
    return (
        f"it is looked for in {place}, and without the folders of its name in the meshdir of the "
        "<compiler>, as strippath='true' has it: copy the meshes along with the model"
    )


def _options_that_read(path: Path, options: ReadOptions) -> str:
    """Return what to type so that a file compiles that MuJoCo refused; "" if nothing is known.

    Args:
        path: The file.
        options: With which it was refused.
    """
    balanced = replace(options, balance_inertia=True)
    choices = (balanced, replace(options, meshes=False), replace(balanced, meshes=False))
    for further in choices:
        if further == options or not _compiles(path, further):
            continue
        in_python, on_a_side = list[str](), list[str]()
        if further.balance_inertia is not options.balance_inertia:
            in_python.append("balance_inertia=True")
            on_a_side.append("balance_inertia=on")
        if further.meshes is not options.meshes:
            in_python.append("meshes=False")
            on_a_side.append("meshes=off")
        return (
            f"load(…, {', '.join(in_python)}) reads it, as {' '.join(on_a_side)} does behind a "
            "file of compare"
        )
    return ""


def _compiles(path: Path, options: ReadOptions) -> bool:
    """Return whether MuJoCo compiles a file with some options."""
    try:
        compile_with(path, options)
    except (ValueError, *ENGINE_ERRORS):
        return False
    return True
