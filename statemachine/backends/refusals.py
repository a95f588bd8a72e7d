"""Why MuJoCo refuses a file, and what a user can type so that it is read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.parsers import expat

from ..interface.records import ReadOptions
from ..measures.text import few
from ..models import kind_of_path
from .compiled.reading import compile_with
from .compiled.spec_files import ENGINE_ERRORS, reason_of

_NO_MASS = "must be larger than mjMINVAL"
_BOUNDS = 'boundmass="0.001" boundinertia="1e-6"'
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
        if _NO_MASS in texts[0] and (without_mass := _of_massless(path, options)):
            return without_mass
        missing = _OPENED.search(texts[0])
        if missing is not None:
            texts.append(_of_missing_file(path, missing[1]))
        if with_options := _options_that_read(path, options):
            texts.append(with_options)
    return "; ".join(texts)


def _of_massless(path: Path, options: ReadOptions) -> str:
    """Return which bodies move without mass, where the first is, and what to write into the file.

    Args:
        path: The file, in which there is one.
        options: With which it was refused.

    Returns:
        "" where more than that is wrong with the file.
    """
    least = replace(options, least_mass=True)
    balanced = replace(least, balance_inertia=True)
    for further in (least, balanced, replace(least, meshes=False), replace(balanced, meshes=False)):
        try:
            _, repairs = compile_with(path, further)
        except (ValueError, *ENGINE_ERRORS):
            continue
        massless = [repair for repair in repairs if repair.is_massless]
        names = list(dict.fromkeys(repair.name for repair in massless))
        is_urdf = path.suffix.lower() == ".urdf"
        line = _line_of_link(path, names[0]) if is_urdf else massless[0].line
        return _without_mass(names, is_urdf, line)
    return ""


def _without_mass(names: Sequence[str], is_urdf: bool, line: int | None) -> str:
    """Return what is wrong with bodies that move without mass, and what to write into the file.

    Args:
        names: Of the bodies.
        is_urdf: Whether the file is a URDF, and not an MJCF.
        line: Where the first of them begins; None where that is not known.
    """
    compiler = f"<compiler {_BOUNDS}/>"
    kind, remedy, place = "body", "an <inertial> or a geom with mass", "into <mujoco>"
    if is_urdf:
        kind, remedy, place = "link", "an <inertial> with mass", "into <robot>"
        compiler = f"<mujoco>{compiler}</mujoco>"
    where = "" if line is None else f"line {line}: "
    if len(names) > 1:
        kind = {"link": "links", "body": "bodies"}[kind]
        moves, has, each = "move", "have", "each"
    else:
        moves, has, each = "moves", "has", "it"
    quoted = few([repr(name) for name in names], 5)
    return (
        f"{where}the {kind} {quoted} {moves} and {has} no mass or inertia; give {each} {remedy}, "
        f"or write {compiler} {place}, which gives every body at least so much [kg, kg m²]"
    )


def _line_of_link(path: Path, name: str) -> int | None:
    """Return the line in which a link of a URDF begins; None where the file does not tell."""
    lines: list[int] = []
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag == "link" and attributes.get("name") == name:
            lines.append(parser.CurrentLineNumber)

    parser.StartElementHandler = start
    try:
        parser.Parse(path.read_bytes(), True)
    except (OSError, expat.ExpatError):
        return None
    return lines[0] if lines else None


def _of_missing_file(path: Path, name: str) -> str:
    """Return where a file was looked for that is not there.

    Args:
        path: The model's file.
        name: The path that MuJoCo tried.
    """
    place = path.absolute().parent / Path(name).parent
    if path.suffix.lower() != ".urdf" or kind_of_path(place) == "a folder":
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
