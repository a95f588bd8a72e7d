"""What docstrings of the package name exists."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from .support.requirements import ROOT

pytestmark = pytest.mark.slow
PACKAGE = ROOT / "statemachine"
# Names of engines, of other packages and of C that no code of the package has.
FOREIGN = {
    "SequenceMatcher",
    "SyncVectorEnv",
    "difflib",
    "mjModel",
    "mj_integratePos",
    "mj_jacSite",
    "preexec_fn",
    "printf",
}
Documented = ast.Module | ast.ClassDef | ast.FunctionDef


@cache
def _trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text("utf-8")) for path in sorted(PACKAGE.rglob("*.py"))}


def _docstrings() -> Iterator[tuple[Path, Documented, str]]:
    for path, tree in _trees().items():
        for node in ast.walk(tree):
            if isinstance(node, Documented) and (text := ast.get_docstring(node)):
                yield path, node, text


def _words_of_code(path: Path, tree: ast.Module) -> set[str]:
    """Return the words of a file, without those of its docstrings and comments."""
    lines = path.read_text("utf-8").splitlines()
    for node in ast.walk(tree):
        if isinstance(node, Documented) and ast.get_docstring(node, clean=False):
            text = node.body[0]
            for number in range(text.lineno - 1, text.end_lineno or text.lineno):
                lines[number] = ""
    return {word for line in lines for word in re.findall(r"\w+", line.partition("  # ")[0])}


def test_every_name_in_backticks_is_one_of_the_code() -> None:
    known = FOREIGN | {path.stem for path in _trees()} | {path.parent.name for path in _trees()}
    for path, tree in _trees().items():
        known |= _words_of_code(path, tree)
    missing = [
        f"{path.relative_to(ROOT)}, {getattr(node, 'name', 'module')}: {name}"
        for path, node, text in _docstrings()
        for name in re.findall(r"`([A-Za-z_][\w.]*)(?:\(\))?`", text)
        if not known.issuperset(filter(None, name.split(".")))
    ]
    assert not missing, "\n".join(missing)


def test_every_module_that_a_package_lists_is_in_it() -> None:
    listed = [
        (path.parent, name)
        for path, node, text in _docstrings()
        if path.name == "__init__.py" and isinstance(node, ast.Module)
        for name in re.findall(r"^- `(\w+)`:", text, re.MULTILINE)
    ]
    assert len(listed) >= 10
    missing = [
        (folder.name, name)
        for folder, name in listed
        if not (folder / f"{name}.py").exists() and not (folder / name).is_dir()
    ]
    assert missing == []
