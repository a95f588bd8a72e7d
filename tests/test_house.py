"""The shape of the package, from its source alone: rooms, circles, names."""

from __future__ import annotations

import ast
import re
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from typing import Any

import pytest

from statemachine.installed import ENGINES

from .support.requirements import ROOT

PACKAGE = ROOT / "statemachine"
# Rooms and files that may name an engine: its backend, its room, the table, the witness.
MAY_NAME = ("backends/", "engines/", "installed.py", "installing.py", "kinematics.py", "witness/")
# A backend's file and a room are called after the engine, or after the first half of its name.
NAMES = frozenset(ENGINES) | {engine.module for engine in ENGINES.values()}


@cache
def _sources() -> dict[str, str]:
    """Every module of the package, by its path in it."""
    files = sorted(PACKAGE.rglob("*.py"))
    return {file.relative_to(PACKAGE).as_posix(): file.read_text("utf-8") for file in files}


# No engine is named outside its rooms.


def _docstrings(tree: ast.Module) -> set[ast.expr]:
    bodies: list[Any] = [
        node.body
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and ast.get_docstring(node) is not None
    ]
    return {body[0].value for body in bodies}


def engines_named(tree: ast.Module) -> frozenset[str]:
    """The engines that a module names in code: as a string, or in an import."""
    docstrings, found = _docstrings(tree), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            # Each word: "mujoco_backend" has "mujoco" in it.
            found.update(re.findall(r"[^\W_]+", ast.unparse(node)))
        elif isinstance(node, ast.Constant) and node not in docstrings:
            found.add(str(node.value))
    return NAMES & found


def test_engines_are_named_in_their_rooms_alone() -> None:
    naming = {
        path
        for path, source in _sources().items()
        if any(name in source for name in NAMES) and engines_named(ast.parse(source))
    }
    assert "backends/mujoco_backend.py" in naming
    assert {path for path in naming if not path.startswith(MAY_NAME)} == set()


def test_what_names_an_engine_is_seen() -> None:
    for code in (
        "import mujoco",
        "from pybullet import DIRECT",
        "from ..backends import mujoco_backend",
        "from .engines.pybullet.driven import stepper",
        "def f():\n    return load(path, backend='mujoco')",
        "class A:\n    '''It is.'''\n    name = 'pinocchio'",
    ):
        assert engines_named(ast.parse(code)), code
    for code in ("'mujoco'", "def f():\n    'pybullet'", "text = 'run by mujoco'", "import numpy"):
        assert not engines_named(ast.parse(code)), code


# Imports go down.


def _packages_of(module: str) -> set[str]:
    """Return the packages that Python imports before a module, but for the one of all."""
    parts = module.split(".")
    return {".".join(parts[:k]) for k in range(2, len(parts))}


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Inside functions and for type checking included, and by the packages of what is imported."""
    graph = pytest.importorskip("grimp").build_graph(PACKAGE.name)
    imported = {name: set(graph.find_modules_directly_imported_by(name)) for name in graph.modules}
    for name, modules in imported.items():
        packages = set[str]().union(*map(_packages_of, modules))
        modules.update(packages - _packages_of(name) - {name})
    assert sum(map(len, imported.values())) > len(imported)  # it does read imports
    TopologicalSorter(imported).prepare()


# One name, one thing.


def test_no_public_class_has_the_name_of_another() -> None:
    names = Counter(
        node.name
        for source in _sources().values()
        for node in ast.parse(source).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in names.items() if count > 1] == []


# A test imports no other test.

TESTS = ROOT / "tests"
_OF_A_TEST = re.compile(
    r"^\s*(?:from|import) [\w.]*\btest_\w+|^\s*from [\w.]+ import .*\btest_", re.M
)


def test_what_several_tests_need_stands_in_support() -> None:
    """Code that a test hands to another process included."""
    files = [*TESTS.rglob("*.py")]
    assert len(files) > 100
    importing = {file.name for file in files if _OF_A_TEST.search(file.read_text("utf-8"))}
    assert importing == set()


@pytest.mark.parametrize(
    "line",
    [
        "from .test_arm import near",
        "from tests.test_arm import near",
        "    import tests.test_arm as arm",
        "from . import test_arm",
    ],
)
def test_an_import_of_a_test_is_seen(line: str) -> None:
    assert _OF_A_TEST.search(f"import re\n{line}\n")


def test_no_private_name_of_support_is_imported() -> None:
    for file in TESTS.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level:
                private = [alias.name for alias in node.names if alias.name.startswith("_")]
                assert private == [], f"{file.name} imports {private} of {node.module}"


# Who imports MuJoCo: what keeps the contract on it, and what drives it without us.

_OF_MUJOCO = ("backends/mujoco", "backends/compiled/", "backends/served/", "engines/mujoco/")


def imports_mujoco(tree: ast.Module) -> bool:
    """Tell whether a module imports MuJoCo; for type checking alone counts, too."""
    modules = list[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            modules.append(str(node.module))
    return any(module.split(".")[0] == "mujoco" for module in modules)


def test_mujoco_is_imported_in_its_rooms_alone() -> None:
    importing = {
        path
        for path, source in _sources().items()
        if "import" in source and "mujoco" in source and imports_mujoco(ast.parse(source))
    }
    assert "backends/mujoco_backend.py" in importing
    elsewhere = {path for path in importing if not path.startswith(_OF_MUJOCO)}
    assert elsewhere == set()


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("import mujoco", True),
        ("import numpy, mujoco.viewer as viewer", True),
        ("def f():\n    from mujoco import MjModel", True),
        ("if TYPE_CHECKING:\n    import mujoco", True),
        ("from .mujoco import alarms", False),
        ("from ..engines import mujoco", False),
        ("import mujoco_menagerie", False),
    ],
)
def test_an_import_of_mujoco_is_seen(code: str, expected: bool) -> None:
    assert imports_mujoco(ast.parse(code)) is expected


# A file is one concept.

_MOST_LINES = 400


def test_a_file_has_at_most_400_lines() -> None:
    longer = {path for path, source in _sources().items() if source.count("\n") > _MOST_LINES}
    assert longer == set()


# What is private stays in its module, and a private module in its folder.


def private_imports(tree: ast.Module, neighbours: frozenset[str]) -> set[str]:
    """Return the private names of the package that a module imports from another one.

    Args:
        tree: Of the module.
        neighbours: Names of the modules beside it: it may import a private one of them.
    """
    private = set[str]()
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom):
            continue
        parts = (node.module or "").split(".")
        if not node.level and parts[0] != PACKAGE.name:
            continue
        modules, names = set(parts), {alias.name for alias in node.names}
        if node.level == 1 and node.module is None:  # `from . import _name`, a module or not
            names -= neighbours
        elif node.level == 1 and len(parts) == 1:
            modules -= neighbours
        private |= {name for name in modules | names if re.match(r"_(?!_)", name)}
    return private


def test_no_private_name_is_imported_from_another_module() -> None:
    paths = [*_sources()]
    importing = dict[str, set[str]]()
    for path, source in _sources().items():
        folder, _, _ = path.rpartition("/")
        beside = {other.rpartition("/")[2] for other in paths if other.rpartition("/")[0] == folder}
        neighbours = frozenset(name.removesuffix(".py") for name in beside)
        importing[path] = private_imports(ast.parse(source), neighbours)
    assert {path: names for path, names in importing.items() if names} == {}


@pytest.mark.parametrize(
    ("code", "private"),
    [
        ("from .data import _Input", {"_Input"}),
        ("from ..backends.compiled import _problems, facts", {"_problems"}),
        ("from . import _constant", {"_constant"}),
        ("from ..lessons._robot import arm", {"_robot"}),
        ("from statemachine.models import _path_of", {"_path_of"}),
        ("from . import _beside", set()),
        ("from ._beside import name", set()),
        ("from os import _exit", set()),
        ("from .. import __version__", set()),
    ],
)
def test_an_import_of_a_private_name_is_seen(code: str, private: set[str]) -> None:
    assert private_imports(ast.parse(code), frozenset({"_beside", "data"})) == private


# A stranger who reads only the tree knows what each folder is for.


def test_every_folder_says_in_a_sentence_what_it_is_for() -> None:
    folders = {path.rpartition("/")[0] for path in _sources()}
    assert len(folders) > 30
    for folder in folders:
        source = _sources().get(f"{folder}/__init__.py".lstrip("/"), "")
        says = (ast.get_docstring(ast.parse(source)) or "").split("\n")[0]
        assert len(says.split()) >= 3, f"{folder} says nothing of itself"
        assert says[-1] in ".?", f"what {folder} says of itself is no sentence"


@pytest.mark.parametrize("floor", ["lab", "course"])
def test_every_room_of_a_floor_is_on_the_map(floor: str) -> None:
    """Of the floors of the package itself `test_architecture` holds that."""
    table = [
        line
        for line in (ROOT / "docs" / "architecture.md").read_text("utf-8").split("\n")
        if line.startswith("|")
    ]
    rooms = {path.split("/")[1] for path in _sources() if re.match(rf"{floor}/\w+/", path)}
    assert len(rooms) >= 2
    named = {
        room
        for room in rooms
        for line in table
        if f"`{floor}/{room}/`" in line or (f"`{floor}/`" in line and f"`{room}/`" in line)
    }
    assert rooms - named == set()


# A sentence of a page stands in its template.

# Calls whose texts are errors, or the help of an option or a command; and patterns.
_ERRORS = re.compile(r"(?:Error|complain|refuse\w*|_fault|error|exit|SystemExit)$")
_HELP = re.compile(r"(?:^_?add_\w+|\.add_\w+|_action|_Parser|ArgumentParser|^re\.\w+)$")
_NAMES_OF_HELP = ("description", "epilog", "says", "message", "_MORE", "_RUNS", "_EACH")
# Files whose longer texts are no sentences of a page, or are said where there is no page.
_NO_PAGES = {
    "cli/__init__.py": "hints that end an error",
    "cli/commands.py": "the help of each command",
    "cli/common.py": "the help of options",
    "cli/compare/recordings.py": "an error that names the option",
    "cli/compare/requests.py": "an error that names the option",
    "cli/experiments.py": "the help of what can be run",
    "cli/help_all.py": "the help of an option",
    "cli/resuming.py": "the end of a command by Ctrl-C",
    "show/html/chart.py": "styles",
    "show/html/diagram.py": "styles and names of fonts",
    "show/html/notebook.py": "the name of a file",
    "show/html/page.py": "names of files, and a policy for the browser",
    "show/markdown.py": "what replaces a pattern",
}


def sentences(tree: ast.AST) -> list[str]:
    """Return the texts of four words or more in a module, but for errors, help and docstrings."""
    found = list[str]()
    nodes: list[ast.AST] = [tree]
    while nodes:
        node = nodes.pop()
        if not _may_be_said(node):
            continue
        text = _literal(node)
        if len(re.findall(r"[A-Za-z][\w'-]*", text)) >= 4:
            found.append(text)
        elif not isinstance(node, ast.JoinedStr):
            nodes += ast.iter_child_nodes(node)
    return found


def _may_be_said(node: ast.AST) -> bool:
    """Tell whether a text of a node may be one of a page."""
    if isinstance(node, ast.Raise):
        return False
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return False
    if isinstance(node, ast.Call):
        name = ast.unparse(node.func)
        return not (_ERRORS.search(name) or _HELP.search(name))
    if isinstance(node, ast.Assign):
        names = {ast.unparse(target).rpartition(".")[2] for target in node.targets}
        return not names & set(_NAMES_OF_HELP)
    return True


def _literal(node: ast.AST) -> str:
    """Return the words of a text, without what is filled in."""
    if isinstance(node, ast.JoinedStr):
        return " ".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return ""


def test_sentences_of_pages_stand_in_templates() -> None:
    """In the rooms that draw pages and answer commands, and where a reader is asked.

    Each exception is still needed.
    """
    saying = {
        path
        for path, source in _sources().items()
        if path.startswith(("show/", "cli/", "course/quiz")) and sentences(ast.parse(source))
    }
    assert saying == set(_NO_PAGES)


@pytest.mark.parametrize(
    ("code", "count"),
    [
        ("Text('The runs agree to the bit.')", 1),
        ("Text(f'{name} is {x} away from {y}, at most')", 1),
        ("Text(f'{a} of {b} {c} {d}')", 0),
        ("raise BadInputError('expected one of these two files')", 0),
        ("parser.add_argument('--x', help='how many times it is run')", 0),
        ('def f():\n    """Return the number of all rows."""', 0),
        ("headers = ('at the end', 'largest')", 0),
    ],
)
def test_a_sentence_in_python_is_seen(code: str, count: int) -> None:
    assert len(sentences(ast.parse(code))) == count
