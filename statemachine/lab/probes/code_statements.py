"""The statements of some code, to be run one after another."""

from __future__ import annotations

import ast
import functools
import linecache
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple


class CodeStatement(NamedTuple):
    """Statement of some code.

    Attributes:
        source: As it is typed.
        line: Its first line, from 1.
        run: Runs it in a namespace.
    """

    source: str
    line: int
    run: Callable[[dict[str, Any]], None]


def statements(code: str) -> Iterator[CodeStatement]:
    """Yield the statements of some code."""
    name = "<lesson>"
    lines = code.splitlines()
    linecache.cache[name] = (len(code), None, [f"{line}\n" for line in lines], name)
    body = ast.parse(code, name).body
    firsts = [_first_line(node) for node in body]
    ends = [node.end_lineno or node.lineno for node in body]
    for k, (node, first, end) in enumerate(zip(body, firsts, ends, strict=True)):
        source = "\n".join(lines[first - 1 : end])
        begins_where_another_ends = k > 0 and ends[k - 1] == first
        if begins_where_another_ends or firsts[k + 1 : k + 2] == [end]:
            source = ast.get_source_segment(code, node) or source
        compiled = compile(ast.Module([node], []), name, "exec", dont_inherit=True)

        yield CodeStatement(source, first, functools.partial(exec, compiled))


def _first_line(node: ast.stmt) -> int:
    """Return the first line of a statement, that of its first decorator where it has one."""
    decorators: Sequence[ast.expr] = getattr(node, "decorator_list", ())
    return min([node.lineno, *(decorator.lineno for decorator in decorators)])
