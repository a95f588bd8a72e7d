"""From the name of a model to the file that holds it.

A name is one of ours ("so101/scene_box"), a path to a file, a file of a folder laid
out like MuJoCo Menagerie, given as an argument or by $MENAGERIE, or that of a robot
in a package of robots ("menagerie:unitree_g1").
"""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from xml.parsers import expat

from .errors import BadInputError, ModelError, ModelFileError, shown, unknown_name
from .typed_numbers import typed_float

AnyPath = str | os.PathLike[str]

# What names that a package of robots is asked for begin with.
NAMED = ("menagerie:", "robot_descriptions:")


def is_named(text: str) -> bool:
    """Return whether a text is a name that a package of robots is to be asked for."""
    return text.startswith(NAMED) or (text.endswith("_description") and "/" not in text)


_PACKAGE = Path(__file__).resolve().parent
SUFFIXES = (".xml", ".mjcf", ".urdf", ".mjb")
# The folder of a public menagerie that holds the counterpart of one of ours.
_COUNTERPARTS = {"so101": "robotstudio_so101"}


def models_dir() -> Path:
    """Return the folder of our own models: inside the wheel, or at the checkout's root."""
    inside = _PACKAGE / "_models"
    return inside if inside.is_dir() else _PACKAGE.parent / "models"


def model_names() -> list[str]:
    """Return the names of the models that come with the library: the arm and its scenes first."""
    root = models_dir()
    names = [path.relative_to(root).with_suffix("").as_posix() for path in root.glob("*/*.xml")]
    return sorted(names, key=lambda name: (not name.startswith("so101/"), len(name), name))


def expanded(path: AnyPath) -> Path:
    """Return a path with "~" replaced by a home; as it is where there is no such user."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def kind_of_path(path: Path) -> str:
    """Say what a path leads to, in two words: "a file", "a folder", "a named pipe", "nothing".

    To open what is neither a file nor a folder may wait for ever, or do something.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return "nothing"
    kinds = {
        stat.S_IFREG: "a file",
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a named pipe",
        stat.S_IFSOCK: "a socket",
    }
    return kinds.get(stat.S_IFMT(mode), "a device")


def check_is_file(path: Path, error: Callable[[str], Exception] = BadInputError) -> None:
    """Raise an error for a path that is there and is not a file: it may not be opened.

    Nothing is raised of a path that leads nowhere.

    Args:
        path: That is to be read.
        error: Makes the error of a text.
    """
    kind = kind_of_path(path)
    if kind not in ("a file", "nothing"):
        raise error(f"{path} is {kind}, not a file")


def resolve(model: AnyPath, menagerie: AnyPath | None = None) -> Path:
    """Find the file of a model: everything that reads one asks here.

    Args:
        model: One of `model_names()`, a path to an .xml, .mjcf, .urdf or .mjb file, or
            "menagerie:NAME" or "robot_descriptions:NAME" of the packages of these names.
        menagerie: A menagerie folder. Given, names are looked up there ("so101/scene"
            as robotstudio_so101/scene.xml) and not among ours.

    Returns:
        An absolute path of a file that exists.

    Raises:
        ModelFileError: The path or the menagerie folder is not there.
        ModelError: The file is a xacro; see `refuse_xacro`.
        UnknownNameError: No model has this name.
        MissingEngineError: The package of robots is not installed.
        TypeError: It is not text and no path.
    """
    path = _path_of(model, menagerie)
    refuse_xacro(path)
    return path


def _path_of(model: AnyPath, menagerie: AnyPath | None) -> Path:
    """Find the file of a model, whatever is in it; see `resolve`."""
    text = _as_text(model)
    if is_named(text) and (menagerie is None or ":" in text):
        from .robot_packages import path_of_robot

        return path_of_robot(text)
    try:
        path = Path(text).expanduser()
        path.is_file()
    except (OSError, RuntimeError) as error:  # too long a name, no such user, no permission
        raise ModelFileError(f"{text[:80]!r} cannot be a model file: {error}") from None
    if path.suffix.lower() in SUFFIXES:
        return path.absolute() if path.is_file() else _path_of_name(text, menagerie)
    if menagerie is not None:
        return _in_menagerie(text, expanded(menagerie))
    name = text if "/" in text else f"{text}/{text}"
    if name in model_names():
        return models_dir() / f"{name}.xml"
    if path.suffix.lower() == _XACRO_SUFFIX and path.is_file():
        raise ModelError(_is_xacro(path))
    if path.is_dir():
        raise ModelFileError(f"{text} is a folder: name a file in it ({', '.join(SUFFIXES)})")
    if path.is_file():
        raise ModelFileError(f"model file {text} does not end in {', '.join(SUFFIXES)}")
    if os.environ.get("MENAGERIE") and "/" in text:
        return _in_menagerie(text, expanded(os.environ["MENAGERIE"]))
    raise unknown_name("model", text, model_names())


def _path_of_name(name: str, menagerie: AnyPath | None) -> Path:
    """Return the file of a model whose name has the suffix of a file, as pages print it.

    Raises:
        ModelFileError: There is no such model, of ours or in the menagerie.
    """
    if menagerie is None and name.removesuffix(".xml") in model_names():
        return models_dir() / name
    if menagerie is not None and (expanded(menagerie) / name).is_file():
        return (expanded(menagerie) / name).absolute()
    kind = kind_of_path(expanded(name))
    what = "does not exist" if kind == "nothing" else f"is {kind}, not a file"
    raise ModelFileError(f"model file {name} {what}")


def _as_text(model: AnyPath) -> str:
    text = os.fspath(model) if isinstance(model, os.PathLike) else model
    if not isinstance(text, str):
        raise TypeError(f"a model is given by its name or a path; got {shown(model)}")
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


# A xacro is a text from which a URDF is made: its macros stand for links and joints, which a reader
# of URDF does not see, and its expressions for numbers and names.

_XACRO_SUFFIX, _BINARY_SUFFIX = ".xacro", ".mjb"
# An expression, as ${pi / 2}, or what is put in from elsewhere, as $(find a_package).
_XACRO_VALUE = re.compile(r"\$\{[^}]*\}|\$\([^)]*\)")
# The same, and macros, in a text that is not quite XML, which some readers take.
_XACRO_TEXT = re.compile(rb"<\s*xacro:|[\"'][^\"'<>]*(?:\$\{|\$\()")
# Without any of these a file is no xacro, and names no other file.
_XACRO_SIGNS = (b"xacro", b"${", b"$(", b"<include", b"<model")


def refuse_xacro(path: Path) -> None:
    """Refuse a URDF or an MJCF that is a xacro, or that includes or attaches one.

    A file that only declares the namespace of xacro is none: what xacro writes often does.

    Args:
        path: The file; a binary model, or a file that cannot be read, is left to its reader.

    Raises:
        ModelError: It is a xacro, with the line that shows it.
    """
    waiting, seen = [path], set[Path]()
    while waiting:
        file = waiting.pop()
        if file.suffix.lower() == _BINARY_SUFFIX or kind_of_path(file) != "a file":
            continue  # what is no text is no xacro, and to open a pipe would wait for ever
        try:
            place, content = file.resolve(), file.read_bytes()
        except OSError:
            continue
        if place in seen or not any(sign in content for sign in _XACRO_SIGNS):
            continue
        seen.add(place)
        scan = _XacroScan()
        scan.read(content)
        if scan.found:
            where = f"{path.name} includes " if file != path else ""
            raise ModelError(f"{where}{_is_xacro(file, scan.format)} ({scan.found})")
        for name in scan.files:
            included = included_file(name, path, file)
            if included:
                waiting.append(included)


def _is_xacro(file: Path, form: str = "URDF") -> str:
    """Say that a file is a xacro, and what to type."""
    article, suffix = ("an", "xml") if form == "MJCF" else ("a", "urdf")
    return (
        f"{file.name}: it is a xacro: turn it into {article} {form} first: "
        f"`xacro {file.name} > OUT.{suffix}`"
    )


class _XacroScan:
    """One file while it is looked through, prefixes of names as they are written.

    Attributes:
        found: What shows that the file is a xacro, and its line; "" if nothing does.
        files: Names of the files that it includes or attaches.
        format: "URDF" or "MJCF", by its root element.
    """

    def __init__(self) -> None:
        self.found, self.files, self.format = "", list[str](), "URDF"
        self._prefixes, self._depth = {"xacro"}, 0
        # One that knows no namespaces: of engines, none asks whether a prefix was declared.
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start

    def read(self, content: bytes) -> None:
        """Look a file through; of one that is not XML the rest as text."""
        try:
            self._parser.Parse(content, True)
        except (expat.ExpatError, ValueError, LookupError):
            rest = content[max(0, self._parser.ErrorByteIndex) :]
            match = _XACRO_TEXT.search(rest)
            if match and not self.found:
                self._says(match[0].decode(errors="replace"), rest[: match.start()].count(b"\n"))

    def _start(self, name: str, attributes: Mapping[str, str]) -> None:
        if not self._depth and name != "robot":  # which a URDF begins with
            self.format = "MJCF"
        self._depth += 1
        for key, value in attributes.items():
            if key.startswith("xmlns:") and value.rstrip("/").endswith("xacro"):
                self._prefixes.add(key.removeprefix("xmlns:"))
        if self.found:
            return
        prefix, colon, _ = name.partition(":")
        if colon and prefix in self._prefixes:
            self._says(f"<{name}>")
        elif name != "text":  # what an MJCF keeps for the user's own code
            for expression in _expressions(attributes):
                self._says(expression)
                return
        if name in ("include", "model") and attributes.get("file"):
            self.files.append(attributes["file"])

    def _says(self, what: str, lines: int = 0) -> None:
        self.found = f"line {self._parser.CurrentLineNumber + lines} has {shown(what)}"


def _expressions(attributes: Mapping[str, str]) -> Iterator[str]:
    """Give what xacro would have replaced in the attributes of an element."""
    for value in attributes.values():
        if match := _XACRO_VALUE.search(value):
            yield match[0]


def mesh_file(name: str, folder: Path) -> Path | None:
    """Return the file of a mesh that a URDF names, or None where there is none.

    Args:
        name: As the URDF has it.
        folder: That of the URDF.
    """
    for place in mesh_places(name, folder):
        if kind_of_path(place) == "a file":
            return place
    return None


def mesh_places(name: str, folder: Path) -> Iterator[Path]:
    """Yield the places where a mesh that a URDF names may be.

    Args:
        name: As the URDF has it. A package:// is looked for in the folders above: ROS knows
            where packages are, and a file alone does not.
        folder: That of the URDF.
    """
    plain = name.removeprefix("file://")
    yield folder / plain
    if plain.startswith("package://"):
        inside = plain.removeprefix("package://")
        rest = inside.partition("/")[2]
        above = (folder, *folder.parents[:3])
        for up in above:
            yield up / inside
            yield up / rest


def included_file(name: str, path: Path, includer: Path) -> Path | None:
    """Return the file that an MJCF includes, or None where there is none.

    MuJoCo looks in the folder of the model's file, then in that of the file with the <include>.

    Args:
        name: As the <include> has it.
        path: The model's file.
        includer: The file with the <include>.
    """
    choices = [file.parent / name for file in (path, includer) if name]
    return next((choice for choice in choices if choice.is_file()), None)


def numbers(text: str, count: int, what: str) -> list[float]:
    """Return the numbers of an attribute of a model's file; `what` it is, for the message.

    Raises:
        ModelError: They are not so many, or no finite numbers.
    """
    try:
        found = [typed_float(word) for word in text.split()]
    except ValueError:
        found = []
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ModelError(f"{what} is {shown(text)}; it must have {count} finite numbers")
    return found
