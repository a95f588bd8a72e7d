"""Mutants: one small fault each in the source of the package, drawn with a seed."""

from __future__ import annotations

import ast
import random
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
_OTHER: dict[type, Any] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}


@dataclass(frozen=True)
class Mutant:
    """A fault, named by its code, so that it is found again where that code has moved.

    Attributes:
        file: The module, relative to the root of the project.
        scope: The function or class that it is in, by qualified name.
        kind: "number", "comparison", "sign", "dropped call" or "swapped arguments".
        statement: Its statement as the syntax tree prints it, without a body.
        index: Which fault of this kind in the statement.
        becomes: The code that the faulty part becomes.
    """

    file: str
    scope: str
    kind: str
    statement: str
    index: int
    becomes: str

    @property
    def code(self) -> tuple[str, str, int, str]:
        """What identifies it wherever it stands."""
        return self.kind, self.statement, self.index, self.becomes

    @property
    def function(self) -> str:
        """The name of the function or class that it is in; "" at the top of a module."""
        return self.scope.rpartition(".")[2]


@dataclass(frozen=True)
class Site:
    """Where a Mutant stands.

    Attributes:
        mutant: The fault.
        start: First byte of the part of the source that it replaces.
        stop: The byte after the last.
        lines: Lines of its statement, without the body.
        called: Whether it is in a function; the other statements run at import.
    """

    mutant: Mutant
    start: int
    stop: int
    lines: range
    called: bool

    def source(self, root: Path) -> bytes:
        """Return the source of the module with the fault in it."""
        text = (root / self.mutant.file).read_bytes()
        return text[: self.start] + self.mutant.becomes.encode() + text[self.stop :]


def _faults(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield kind and code of each fault that a node itself allows."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            yield "number", repr(value + 1 if isinstance(value, int) else value * 1.1 or 1.0)
        case ast.Compare(left=left, ops=operators, comparators=right):
            for place, operator in enumerate(operators):
                others = [*operators[:place], _OTHER[type(operator)](), *operators[place + 1 :]]
                yield "comparison", f"({ast.unparse(ast.Compare(left, others, right))})"
        case ast.BinOp(left=left, op=operator, right=right):
            lists = ast.JoinedStr, ast.List, ast.Tuple
            text = any(
                isinstance(side, lists) or isinstance(getattr(side, "value", None), str)
                for side in (left, right)
            )
            if type(operator) in _OTHER and not text:
                other = ast.BinOp(left, _OTHER[type(operator)](), right)
                yield "sign", f"({ast.unparse(other)})"
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield "sign", f"({ast.unparse(operand)})"
        case ast.Expr(value=ast.Call()):
            yield "dropped call", "pass"
        case ast.Call(func=function, args=[first, second, *rest], keywords=keywords):
            starred = isinstance(first, ast.Starred) or isinstance(second, ast.Starred)
            same = ast.unparse(function) in {"max", "min"} or ast.dump(first) == ast.dump(second)
            if not starred and not same:
                call = ast.Call(function, [second, first, *rest], keywords)
                yield "swapped arguments", ast.unparse(call)


def _own(statement: ast.stmt) -> Iterator[Any]:
    """Yield the nodes of a statement, but not of nested statements, annotations, f-strings."""
    waiting: deque[ast.AST] = deque([statement])
    while waiting:
        node = waiting.popleft()
        yield node
        if isinstance(node, ast.JoinedStr):  # Python 3.11 gives no places inside
            continue
        for name, value in ast.iter_fields(node):
            if name not in {"annotation", "returns", "decorator_list"}:
                children = value if isinstance(value, list) else [value]
                waiting.extend(
                    child
                    for child in children
                    if isinstance(child, ast.AST)
                    and not isinstance(child, ast.stmt | ast.excepthandler | ast.match_case)
                )


def _statements(
    node: ast.AST, scope: tuple[str, ...] = (), called: bool = False
) -> Iterator[tuple[ast.stmt, str, bool]]:
    """Yield every statement below a node, its scope, and whether a function is around it."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt) and not isinstance(child, ast.Import | ast.ImportFrom):
            yield child, ".".join(scope), called
        is_function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
        inner = (*scope, child.name) if is_function or isinstance(child, ast.ClassDef) else scope
        yield from _statements(child, inner, called or is_function)


def sites(file: Path, root: Path) -> Iterator[Site]:
    """Yield every fault that a module allows."""
    text = file.read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for statement, scope, called in _statements(ast.parse(text)):
        body = getattr(statement, "body", None) or getattr(statement, "cases", None)
        printed = ast.unparse(statement).partition("\n" if body else "\0")[0]
        end = statement.end_lineno or statement.lineno
        after = getattr(body[0], "lineno", end + 1) if body else end + 1
        lines = range(statement.lineno, max(after, statement.lineno + 1))
        counts: Counter[str] = Counter()
        for node in _own(statement):
            for kind, becomes in _faults(node):
                mutant = Mutant(
                    file.relative_to(root).as_posix(), scope, kind, printed, counts[kind], becomes
                )
                counts[kind] += 1
                start = starts[node.lineno - 1] + node.col_offset
                stop = starts[node.end_lineno - 1] + node.end_col_offset
                yield Site(mutant, start, stop, lines, called)


def all_sites(root: Path) -> list[Site]:
    """Return every fault that the package allows, in the order of its files."""
    files = sorted((root / "statemachine").rglob("*.py"))
    return [site for file in files for site in sites(file, root)]


def by_code(sites: Iterable[Site]) -> dict[tuple[str, str, int, str], list[Site]]:
    """Return the sites of each fault, by what identifies it wherever it stands."""
    standing: dict[tuple[str, str, int, str], list[Site]] = defaultdict(list)
    for site in sites:
        standing[site.mutant.code].append(site)
    return standing


def draw(count: int, seed: int) -> list[Mutant]:
    """Draw mutants of the package, each fault equally likely."""
    mutants = sorted({site.mutant for site in all_sites(ROOT)}, key=str)
    return sorted(random.Random(seed).sample(mutants, count), key=str)


def find(mutant: Mutant, standing: dict[tuple[str, str, int, str], list[Site]]) -> Site | None:
    """Return where a mutant's code is today: in its place, its function, or the only one."""
    same = standing.get(mutant.code, [])
    for fits in (
        [site for site in same if site.mutant == mutant],
        [site for site in same if site.mutant.function == mutant.function != ""],
        same if len(mutant.statement) > 20 else [],
    ):
        if fits and (len(fits) == 1 or fits[0].mutant == mutant):
            return fits[0]
    return None
