"""Which students' functions are alike, by their syntax trees."""

from __future__ import annotations

import ast
import hashlib
import re
from collections import Counter
from pathlib import Path

from .judges import JUDGES
from .own_files import LARGEST, start_of

_RUN = 4  # kinds of syntax in a row that are compared


def code_of(path: Path | None) -> str:
    """A digest of what a file does, without its comments, docstrings and layout; or ""."""
    tree = _tree(path)
    return hashlib.sha256(ast.dump(tree).encode(errors="replace")).hexdigest() if tree.body else ""


def shape_of(path: Path | None) -> Counter[tuple[str, ...]]:
    """The kinds of syntax in a file's functions, in short runs, whatever is named how.

    Of those that are judged and are written, and of what they call in the file.
    """
    defined = {
        node.name: node
        for node in _tree(path).body
        if isinstance(node, (ast.FunctionDef, ast.ClassDef))
        and "'NotImplementedError'" not in ast.dump(node)
    }
    names = [name for name in JUDGES if name in defined]
    for name in names:  # which grows meanwhile
        called = (inner.id for inner in ast.walk(defined[name]) if isinstance(inner, ast.Name))
        names += [
            inner for inner in dict.fromkeys(called) if inner in defined and inner not in names
        ]
    text = "".join(ast.dump(defined[name]) for name in names)
    kinds = re.findall(r"\b[A-Z]\w+(?=\()", text)
    return Counter(zip(*(kinds[k:] for k in range(_RUN)), strict=False))


def likeness(left: Counter[tuple[str, ...]], right: Counter[tuple[str, ...]]) -> float:
    """The part of both that both have: 1 for the same, 0 where there is nothing to compare."""
    return (left & right).total() / ((left | right).total() or 1)


def _tree(path: Path | None) -> ast.Module:
    """A file's syntax without docstrings; empty where there is none, or it is too large."""
    text = start_of(path) if path is not None else b""
    try:
        tree = ast.parse(text if len(text) <= LARGEST else b"")
        for node in ast.walk(tree):
            if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)):
                documented = ast.get_docstring(node, clean=False) is not None
                node.body = (node.body[1:] or [ast.Pass()]) if documented else node.body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ast.Module([], [])
    return tree
