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


def test_every_exception_has_a_reason_and_is_needed(capsys: pytest.CaptureFixture[str]) -> None:
    assert all(len(exemption.reason.split()) > 3 for exemption in clear.exemptions())
    assert clear.main([]) == 0, capsys.readouterr().out


def test_an_exception_that_no_code_needs_is_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    listed = clear.EXCEPTIONS.read_text("utf-8")
    entry = '\n[[exception]]\nfile = "gone.py"\nwhere = "f"\nrule = "dense"\nreason = "none"\n'
    (tmp_path / "exceptions.toml").write_text(listed + entry, "utf-8")
    monkeypatch.setattr(clear, "EXCEPTIONS", tmp_path / "exceptions.toml")
    assert clear.main([]) == 1
    assert "no code needs the exception dense of gone.py" in capsys.readouterr().out
