"""From the name of a model to the file that holds it.

A name is one of ours ("so101/scene_box"), a path to a file, a file of a folder laid
out like MuJoCo Menagerie, given as an argument or by $MENAGERIE, or that of a robot
in a package of robots ("menagerie:unitree_g1"; see `robot_packages`).
"""

from __future__ import annotations

import math
import os
from pathlib import Path

from .errors import ModelError, ModelFileError, shown, unknown_name
from .robot_packages import file_of, is_named

_PACKAGE = Path(__file__).resolve().parent
SUFFIXES = (".xml", ".mjcf", ".urdf", ".mjb")
# The folder of a public menagerie that holds the counterpart of one of ours.
_COUNTERPARTS = {"so101": "robotstudio_so101"}


def models_dir() -> Path:
    """The folder of our own models: inside the wheel, or at the checkout's root."""
    inside = _PACKAGE / "_models"
    return inside if inside.is_dir() else _PACKAGE.parent / "models"


def model_names() -> list[str]:
    """Names of the models that come with the library: the arm and its scenes first."""
    root = models_dir()
    names = [path.relative_to(root).with_suffix("").as_posix() for path in root.glob("*/*.xml")]
    return sorted(names, key=lambda name: (not name.startswith("so101/"), len(name), name))


def resolve(name: str | os.PathLike[str], menagerie: str | os.PathLike[str] | None = None) -> Path:
    """The file of a model.

    Args:
        name: One of `model_names()`, a path to an .xml, .mjcf, .urdf or .mjb file, or
            "menagerie:NAME" or "robot_descriptions:NAME" of the packages of these names.
        menagerie: A menagerie folder. Given, names are looked up there ("so101/scene"
            as robotstudio_so101/scene.xml) and not among ours.

    Returns:
        An absolute path of a file that exists.

    Raises:
        ModelFileError: The path or the menagerie folder is not there.
        UnknownNameError: No model has this name.
        MissingEngineError: The package of robots is not installed.
        TypeError: It is no text and no path.
    """
    text = _as_text(name)
    if is_named(text) and (menagerie is None or ":" in text):
        return file_of(text)
    try:
        path = Path(text).expanduser()
        path.is_file()
    except (OSError, RuntimeError) as error:  # too long a name, no such user, no permission
        raise ModelFileError(f"{text[:80]!r} cannot be a model file: {error}") from None
    if path.suffix.lower() in SUFFIXES:
        if path.is_file():
            return path.absolute()
        if menagerie is None and text.removesuffix(".xml") in model_names():
            return models_dir() / text  # the name as pages print it
        if menagerie is not None and (Path(menagerie).expanduser() / text).is_file():
            return (Path(menagerie).expanduser() / text).absolute()  # the same, of a menagerie
        what = "is a folder, not a file" if path.is_dir() else "does not exist"
        raise ModelFileError(f"model file {text} {what}")
    if menagerie is not None:
        return _in_menagerie(text, Path(menagerie).expanduser())
    ours = text if "/" in text else f"{text}/{text}"
    if ours in model_names():
        return models_dir() / f"{ours}.xml"
    if path.is_dir():
        raise ModelFileError(f"{text} is a folder: name a file in it ({', '.join(SUFFIXES)})")
    if path.is_file():
        raise ModelFileError(f"model file {text} does not end in {', '.join(SUFFIXES)}")
    if os.environ.get("MENAGERIE") and "/" in text:
        return _in_menagerie(text, Path(os.environ["MENAGERIE"]).expanduser())
    raise unknown_name("model", text, model_names())


def _as_text(name: str | os.PathLike[str]) -> str:
    text = os.fspath(name) if isinstance(name, os.PathLike) else name
    if not isinstance(text, str):
        raise TypeError(f"a model is given by its name or a path; got {shown(name)}")
    if "\0" in text or not text.strip():
        raise ModelFileError(f"{text!r} is neither the name of a model nor a path")
    if any("\ud800" <= character <= "\udfff" for character in os.fsdecode(text)):
        raise ModelFileError(f"{text!r} is not UTF-8, and engines open no file of such a name")
    return text


def _in_menagerie(name: str, root: Path) -> Path:
    if not root.is_dir():
        raise ModelFileError(f"menagerie folder {root} does not exist")
    folder, _, file = name.rpartition("/")
    folder = folder or name
    robot = _COUNTERPARTS.get(folder, folder)
    # `root` may be the whole menagerie or the robot's own folder.
    home = root if root.name == robot else root / robot
    path = home / f"{file}.xml"
    if not path.is_file():
        found = sorted(f"{robot}/{found.stem}" for found in home.glob("*.xml"))
        raise unknown_name(f"model in {root}", f"{robot}/{file}", found)
    return path.absolute()


def mesh_file(name: str, folder: Path) -> Path | None:
    """The file of a mesh that a URDF names, or None where there is none.

    Args:
        name: As the URDF has it. A package:// is looked for in the folders above: ROS knows
            where packages are, and a file alone does not.
        folder: That of the URDF.
    """
    plain = name.removeprefix("file://")
    choices = [folder / plain]
    if plain.startswith("package://"):
        inside = plain.removeprefix("package://")
        rest = inside.partition("/")[2]
        above = (folder, *folder.parents[:3])
        choices = [up / part for up in above for part in (inside, rest)]
    for choice in choices:
        try:
            if choice.is_file():
                return choice
        except (OSError, ValueError):
            continue
    return None


def included_file(name: str, main: Path, includer: Path) -> Path | None:
    """The file that an MJCF includes, or None where there is none.

    MuJoCo looks in the folder of the main file, then in that of the file with the <include>.

    Args:
        name: As the <include> has it.
        main: The main file.
        includer: The file with the <include>.
    """
    choices = [file.parent / name for file in (main, includer) if name]
    return next((choice for choice in choices if choice.is_file()), None)


def numbers(text: str, count: int, what: str) -> list[float]:
    """The numbers of an attribute of a model's file; `what` it is, for the message.

    Raises:
        ModelError: They are not so many, or no finite numbers.
    """
    try:
        found = [float(word) for word in text.split()]
    except ValueError:
        found = []
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ModelError(f"{what} is {shown(text)}; numbers wanted: {count}")
    return found
