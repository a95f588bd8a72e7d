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
MAY_NAME = ("backends/", "engines/", "installed.py", "kinematics.py", "witness/")
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


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Inside functions and for type checking included."""
    graph = pytest.importorskip("grimp").build_graph(PACKAGE.name)
    imported = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
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
