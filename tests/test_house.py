"""The shape of the package, from its source alone: rooms, circles, names."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from statemachine.installed import ENGINES

from .conftest import ROOT

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


@cache
def _trees() -> dict[str, ast.Module]:
    return {path: ast.parse(source) for path, source in _sources().items()}


@cache
def _module(path: str) -> str:
    """The dotted name of a file, without that of the package."""
    parts = Path(path).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


# No engine is named outside its rooms.


def _docstrings(tree: ast.Module) -> set[ast.expr]:
    found: set[ast.expr] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            match node.body:
                case [ast.Expr(value=ast.Constant(value=str()) as text), *_]:
                    found.add(text)
    return found


def _imported(node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    """Each word of what is imported: "mujoco_backend" has "mujoco" in it."""
    names = [alias.name for alias in node.names]
    names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
    for name in names:
        for part in name.split("."):
            yield from part.split("_")


def engines_named(tree: ast.Module) -> set[str]:
    """The engines that a module names in code: as a string, or in an import."""
    docstrings = _docstrings(tree)
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            found |= NAMES.intersection(_imported(node))
        elif isinstance(node, ast.Constant) and node not in docstrings:
            found |= NAMES & {node.value} if isinstance(node.value, str) else set()
    return found


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
        "from .engines.pybullet.audit import driver",
        "def f():\n    return load(path, backend='mujoco')",
        "class A:\n    '''It is.'''\n    name = 'pinocchio'",
    ):
        assert engines_named(ast.parse(code)), code
    for code in ("'mujoco'", "def f():\n    'pybullet'", "text = 'run by mujoco'", "import numpy"):
        assert not engines_named(ast.parse(code)), code


# Imports go down.


def _at_import(node: ast.AST) -> Iterator[ast.AST]:
    """The statements of a module that run when it is imported, or are for its types."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                yield from _at_import(child)


def _imports(path: str, tree: ast.Module) -> Iterator[str]:
    """What a module imports of the package when it is imported, or for its types."""
    package = _module(path).split(".") if _module(path) else []
    if not path.endswith("__init__.py"):
        package = package[:-1]
    modules = {_module(other) for other in _trees()}
    for node in _at_import(tree):
        if isinstance(node, ast.ImportFrom):
            if node.level:
                base = package[: len(package) - node.level + 1]
            elif (node.module or "").partition(".")[0] == PACKAGE.name:
                base = []
            else:
                continue
            words = (node.module or "").split(".") if node.module else []
            base = base + (words if node.level else words[1:])
            for alias in node.names:
                name = ".".join([*base, alias.name])
                yield name if name in modules else ".".join(base)


def circles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """Modules that import one another, directly or by way of others."""
    reached: dict[str, set[str]] = {}
    for start in graph:
        seen: set[str] = set()
        waiting = [start]
        while waiting:
            for name in graph.get(waiting.pop(), set()) - seen:
                seen.add(name)
                waiting.append(name)
        reached[start] = seen
    return {
        frozenset(other for other in graph if other in reached[name] and name in reached[other])
        for name in graph
        if name in reached[name]
    }


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {
        _module(path): set(_imports(path, tree)) - {_module(path)}
        for path, tree in _trees().items()
    }
    assert sum(map(len, graph.values())) > len(graph)  # it does read imports
    assert circles(graph) == set()


def test_circles_are_found() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set()}) == {frozenset("abc")}
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == set()


# One name, one thing.


def test_no_public_class_has_the_name_of_another() -> None:
    places: dict[str, list[str]] = defaultdict(list)
    for path, tree in _trees().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(path)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}
