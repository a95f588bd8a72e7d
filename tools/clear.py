"""Keep the code clear: report statements too dense to be read, and docstrings without a verb.

The rules are those of CONTRIBUTING.md. What breaks one with a good reason is named, with the
reason, in `clear_exceptions.toml` beside this file; an exception that no code needs is reported,
too. A docstring of a function begins with one of the verbs of `clear_verbs.txt`: ruff's D401 knows
few words that are no verbs, and does not look at properties. The exit code is 1 where anything is
reported.
"""

from __future__ import annotations

import argparse
import ast
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "statemachine"
EXCEPTIONS = Path(__file__).with_name("clear_exceptions.toml")
VERBS = Path(__file__).with_name("clear_verbs.txt")
MOST_NODES = 60  # of the syntax tree of a statement, without the statements in it

_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_CONDITIONS = (ast.Compare, ast.BoolOp, ast.UnaryOp)
_HEADERS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_LITERALS = (ast.Dict, ast.List, ast.Tuple, ast.Set, ast.Constant)
_UNTYPED = ("Any", "object", "SimpleNamespace")


@dataclass(frozen=True)
class Finding:
    """A place that breaks a rule.

    Attributes:
        file: Path from the root of the project.
        where: Names of the classes and functions around it; "" at the top of a file.
        line: Of the file.
        rule: A word for the rule.
        detail: What is wrong.
    """

    file: str
    where: str
    line: int
    rule: str
    detail: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.rule}: {self.detail} ({self.where or 'module'})"


@dataclass(frozen=True)
class Exemption:
    """A place that may break a rule: file, function or class, rule and why."""

    file: str
    where: str
    rule: str
    reason: str


def findings_of(path: Path) -> Iterator[Finding]:
    """Yield what breaks a rule in a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    file = path.resolve().relative_to(ROOT).as_posix()
    for node, where in _with_names(tree, ()):
        for rule, detail in faults_of(node):
            yield Finding(file, ".".join(where), getattr(node, "lineno", 0), rule, detail)


def _with_names(node: ast.AST, where: tuple[str, ...]) -> Iterator[tuple[ast.AST, tuple[str, ...]]]:
    """Yield every node with the names of the functions and classes around it."""
    for child in ast.iter_child_nodes(node):
        inside = (*where, child.name) if isinstance(child, _HEADERS) else where
        yield child, inside
        yield from _with_names(child, inside)


def faults_of(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield rule and detail for each rule that a node breaks."""
    if isinstance(node, ast.stmt) and not isinstance(node, _HEADERS):
        count = _own_nodes(node)
        if count > MOST_NODES and not _is_table(node):
            yield "dense", f"{count} nodes in a statement"
    if isinstance(node, ast.IfExp) and _holds(node, (ast.IfExp,)):
        yield "conditional", "a conditional expression in another"
    if isinstance(node, _COMPREHENSIONS) and _holds(node, _COMPREHENSIONS):
        yield "comprehension", "a comprehension in another"
    if isinstance(node, ast.Call):
        yield from _faults_of_call(node)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and _is_selected(node):
        yield "multiplied", "a text or a tuple times a condition"
    if isinstance(node, ast.ClassDef) and _is_dataclass(node):
        yield from _untyped_fields(node)
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        yield from _faults_of_docstring(node)


def _faults_of_docstring(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[tuple[str, str]]:
    words = (ast.get_docstring(node) or "").split()
    if words and words[0].rstrip(".,:;") not in verbs():
        yield "docstring", f"a docstring begins with {words[0]!r}, which {VERBS.name} does not have"


@cache
def verbs() -> frozenset[str]:
    """Return the words with which a docstring of a function begins."""
    return frozenset(VERBS.read_text(encoding="utf-8").split())


def _faults_of_call(node: ast.Call) -> Iterator[tuple[str, str]]:
    starred = [argument for argument in node.args if isinstance(argument, ast.Starred)]
    if any(isinstance(argument.value, _LITERALS) for argument in starred):
        yield "starred", "a starred literal in a call"
    function = node.func.id if isinstance(node.func, ast.Name) else ""
    has_lambda = any(isinstance(argument, ast.Lambda) for argument in node.args)
    if function in ("map", "filter", "reduce") and has_lambda:
        yield "lambda", f"{function} with a lambda"


def _own_nodes(statement: ast.stmt) -> int:
    """Return the nodes of a statement, without those of statements in it."""
    count = 0
    remaining: list[ast.AST] = [statement]
    while remaining:
        node = remaining.pop()
        count += 1
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, (ast.stmt, ast.excepthandler, ast.match_case)):
                remaining.append(child)
    return count


def _is_table(statement: ast.stmt) -> bool:
    """Tell whether a statement names a table of constants, names, or records of them."""
    if not isinstance(statement, (ast.Assign, ast.AnnAssign)):
        return False
    is_container = isinstance(statement.value, (ast.Dict, ast.List, ast.Tuple, ast.Set))
    return is_container and _is_constant(statement.value)


def _is_constant(node: ast.expr | None) -> bool:
    match node:
        case ast.Dict():
            return all(_is_constant(part) for part in (*node.keys, *node.values) if part)
        case ast.List() | ast.Tuple() | ast.Set():
            return all(_is_constant(part) for part in node.elts)
        case ast.UnaryOp():
            return _is_constant(node.operand)
        case ast.Call():  # a record of constants
            values = [*node.args, *(keyword.value for keyword in node.keywords)]
            return all(_is_constant(value) for value in values)
    return isinstance(node, (ast.Constant, ast.Name, ast.Attribute, ast.JoinedStr))


def _holds(node: ast.AST, kinds: tuple[type[ast.AST], ...]) -> bool:
    """Tell whether a node of some kinds is inside another."""
    return any(isinstance(child, kinds) for child in ast.walk(node) if child is not node)


def _is_selected(node: ast.BinOp) -> bool:
    """Tell whether a product takes a text or a sequence once or not at all."""
    for value, times in ((node.left, node.right), (node.right, node.left)):
        is_cast = isinstance(times, ast.Call) and ast.unparse(times.func) == "bool"
        is_sequence = _is_text(value) or isinstance(value, (ast.Tuple, ast.List))
        if is_sequence and (is_cast or isinstance(times, _CONDITIONS)):
            return not isinstance(times, ast.UnaryOp) or isinstance(times.op, ast.Not)
    return False


def _is_text(node: ast.expr) -> bool:
    is_constant = isinstance(node, ast.Constant) and isinstance(node.value, str)
    return is_constant or isinstance(node, ast.JoinedStr)


def _is_dataclass(node: ast.ClassDef) -> bool:
    return any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)


def _untyped_fields(node: ast.ClassDef) -> Iterator[tuple[str, str]]:
    """Yield the fields of a dataclass whose type says nothing."""
    for statement in node.body:
        if not isinstance(statement, ast.AnnAssign) or not isinstance(statement.target, ast.Name):
            continue
        # An array of any kind of number is an array.
        annotation = ast.unparse(statement.annotation).replace("NDArray[Any]", "NDArray")
        words = ast.walk(ast.parse(annotation))
        names = [part.id for part in words if isinstance(part, ast.Name)]
        untyped = [name for name in names if name in _UNTYPED]
        if untyped:
            yield "untyped", f"field {statement.target.id} is of type {untyped[0]}"


def exemptions() -> list[Exemption]:
    """Return the exceptions, each with its reason."""
    document = tomllib.loads(EXCEPTIONS.read_text(encoding="utf-8"))
    return [Exemption(**entry) for entry in document["exception"]]


def main(arguments: Sequence[str]) -> int:
    """Print what breaks a rule; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("paths", nargs="*", type=Path, help="file or folder (default: the package)")
    chosen: list[Path] = parser.parse_args(arguments).paths
    paths: list[Path] = []
    for path in chosen if chosen else [PACKAGE]:
        paths += sorted(path.rglob("*.py")) if path.is_dir() else [path]
    allowed = {(e.file, e.where, e.rule): e for e in exemptions()}
    used: set[tuple[str, str, str]] = set()
    reports: list[str] = []
    for path in paths:
        for finding in findings_of(path):
            key = (finding.file, finding.where, finding.rule)
            if key in allowed:
                used.add(key)
            else:
                reports.append(str(finding))
    if not chosen:
        unused = [exemption for key, exemption in allowed.items() if key not in used]
        for entry in unused:
            place = f"{entry.file}, {entry.where or 'module'}"
            reports.append(
                f"{EXCEPTIONS.name}: no code needs the exception {entry.rule} of {place}"
            )
    print("\n".join(reports), end="\n" if reports else "")
    return 1 if reports else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
