"""The rules of clear code: each is broken once here, and the script sees it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tools import clear

BROKEN = {
    "dense": "x = f(" + ", ".join(f"a{k}.b[{k}]" for k in range(20)) + ")",
    "conditional": "x = a if b else c if d else e",
    "comprehension": "x = [[b for b in a] for a in c]",
    "starred": "f(*(1, 2))",
    "lambda": "x = map(lambda a: a, b)",
    "multiplied": "x = 'text' * (a > b)",
    "untyped": "@dataclass(frozen=True)\nclass A:\n    b: dict[str, Any]",
    "docstring": '@property\ndef size(self):\n    """The size."""',
}
CLEAR = [
    "TABLE = {" + ", ".join(f"'a{k}': (B.c, {k}, 'd')" for k in range(40)) + "}",
    "x = a if b else c",
    "x = [b for b in a]",
    "f(*a)",
    "x = '-' * 80",
    "x = '-' * len(a)",
    "@dataclass\nclass A:\n    b: dict[str, int]\n    c: NDArray[Any]",
    "class A:\n    b: Any",
    'def size():\n    """Return the size."""',
    'class Size:\n    """The size."""',
    "def size():\n    pass",
]


def rules_broken(source: str) -> set[str]:
    """Return the rules that a source breaks."""
    return {rule for node in ast.walk(ast.parse(source)) for rule, _ in clear.faults_of(node)}


@pytest.mark.parametrize("rule", BROKEN)
def test_a_broken_rule_is_reported(rule: str) -> None:
    assert rules_broken(BROKEN[rule]) == {rule}


@pytest.mark.parametrize("source", CLEAR)
def test_clear_code_breaks_none(source: str) -> None:
    assert rules_broken(source) == set()


def test_every_exception_has_a_reason() -> None:
    assert all(len(exemption.reason.split()) > 3 for exemption in clear.exemptions())


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Return the folder of a package of one dense file, which `clear` reads in place of ours."""
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "dense.py").write_text(BROKEN["dense"], "utf-8")
    (tmp_path / "exceptions.toml").write_text("exception = []", "utf-8")
    monkeypatch.setattr(clear, "ROOT", tmp_path)
    monkeypatch.setattr(clear, "PACKAGE", folder)
    monkeypatch.setattr(clear, "EXCEPTIONS", tmp_path / "exceptions.toml")
    return folder


def except_from(rule: str, file: str) -> None:
    """Make a file the only exception, from one rule."""
    lines = ["[[exception]]", f'file = "{file}"', 'where = ""', f'rule = "{rule}"', 'reason = "r"']
    clear.EXCEPTIONS.write_text("\n".join(lines), "utf-8")


@pytest.mark.parametrize("by_name", [False, True])
def test_what_breaks_a_rule_in_a_folder_is_reported(
    package: Path, by_name: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert clear.main([str(package)] if by_name else []) == 1
    assert capsys.readouterr().out.startswith("package/dense.py:1: dense: ")


def test_what_an_exception_names_is_not_reported(package: Path) -> None:
    except_from("dense", "package/dense.py")
    assert clear.main([]) == 0


@pytest.mark.parametrize("file", ["package/dense.py", "gone.py"])
def test_an_exception_that_no_code_needs_is_reported(
    package: Path, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (package / "dense.py").write_text("", "utf-8")
    except_from("dense", file)
    assert clear.main([]) == 1
    assert capsys.readouterr().out.count(f"no code needs the exception dense of {file}") == 1
