"""The files of a student's submission: which are its own, which hold functions, which are alike."""

from __future__ import annotations

import ast
import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from .judges import JUDGES
from .recording import content

LARGEST = 1_000_000  # bytes of a student's file
_MOST = 1000  # files of a student's folder
_NAMES = "|".join(JUDGES).encode()
_DEFINES = re.compile(rb"\bdef\s+(?:%s)\s*\(" % _NAMES)
_COMPILED = re.compile(rb"\b(?:%s)\b" % _NAMES)
_RUN = 4  # kinds of syntax in a row that are compared


def has_functions(file: Path) -> bool:
    """Whether a file defines a function of the exercise, or is compiled from one that does."""
    pattern = _COMPILED if file.suffix == ".pyc" else _DEFINES
    return pattern.search(start_of(file)) is not None


def has_solutions(file: Path) -> bool:
    """Whether any of the functions in a file may be written."""
    return has_functions(file) and start_of(file).count(b"NotImplementedError(") < len(JUDGES)


def start_of(file: Path) -> bytes:
    """As much of a file as is looked at; a pipe would wait for somebody to write."""
    return content(Path(os.path.realpath(file)), LARGEST + 1)


def in_folder(folder: Path) -> dict[str, Path]:
    """All that one student handed in, by name within the folder; not what tools left there."""
    return {file.relative_to(folder).as_posix(): file for file in sorted(_plain(folder))[:_MOST]}


def _plain(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder):
        environment = "pyvenv.cfg" in names
        folders[:] = [
            name for name in folders if not (environment or name.startswith((".", "__pycache__")))
        ]
        for name in () if environment else names:
            file = Path(place, name)
            if not name.startswith(".") and file.is_file() and file.stat().st_size <= LARGEST:
                yield file


def named_by(file: Path) -> dict[str, Path]:
    """A file and what it names beside it, but for files that hold somebody's functions."""
    own, waiting = {file.name: file}, [file]
    beside = [entry for entry in file.parent.iterdir() if not entry.name.startswith(".")]
    while waiting:
        words = set(re.findall(r"\w+", start_of(waiting.pop()).decode("utf-8", "replace")))
        for entry in (entry for entry in beside if entry.stem in words):
            package = in_folder(entry) if (entry / "__init__.py").is_file() else {}
            files = {f"{entry.name}/{name}": inside for name, inside in package.items()}
            for name, other in (files or {entry.name: entry}).items():
                fits = other.is_file() and other.stat().st_size <= LARGEST
                if name not in own and fits and not has_solutions(other):
                    own[name] = other
                    waiting.append(other)
    return own


def digest(files: Mapping[str, Path]) -> str:
    """Of names and contents; "" where there is none, or one is too large to be judged."""
    sha = hashlib.sha256()
    for name, file in files.items():
        text, start = os.fsencode(name), start_of(file)
        if len(start) > LARGEST:
            return ""
        sha.update(b"%d %d " % (len(text), len(start)) + text + start)
    return sha.hexdigest() if files else ""


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
