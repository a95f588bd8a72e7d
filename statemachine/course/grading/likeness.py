"""How much of the code of two submissions is the same, whatever is named how.

Compared are shingles, `SHINGLE` tokens in a row (A. Broder, "On the resemblance and containment of
documents", Compression and Complexity of Sequences, 1997), as detectors of copied programs compare
them (S. Schleimer, D. Wilkerson, A. Aiken, "Winnowing: local algorithms for document
fingerprinting", SIGMOD 2003). Files of students are short, so that no shingle is left out. The
measure is the coefficient of L. Dice ("Measures of the amount of ecologic association between
species", Ecology 26, 1945): twice the shingles that both have, divided by the sum of those that
each has; `difflib.SequenceMatcher.ratio` has the same form.

Tokens are those of the syntax tree: no layout, no comments, no docstrings, no annotations, and
another name for an imported module changes nothing. Within a shingle a student's names are numbered
by their order of appearance, as for B. Baker, "Parameterized pattern matching" (STOC 1993): neither
another name nor another line elsewhere changes it.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .judges import JUDGES
from .recording import LARGEST, start_of

SHINGLE = 8  # tokens
_NAME = "\0"  # before a token that is a student's name
# Fields of the syntax tree that do nothing when the code runs, or are read by `_Tokens` itself.
_NO_CODE = {"ctx", "annotation", "returns", "type_comment", "type_ignores", "args", "type_params"}
_Definition = ast.FunctionDef | ast.ClassDef | ast.Assign | ast.AnnAssign


@dataclass(frozen=True)
class StudentCode:
    """What a student wrote: the functions that are judged, and what they use of the same files.

    Attributes:
        shingles: Digest of each shingle, by the function that is judged and uses it.
    """

    shingles: Mapping[str, frozenset[str]]

    @cached_property
    def all_shingles(self) -> frozenset[str]:
        """Return the digests of all shingles."""
        return frozenset().union(*self.shingles.values())

    @property
    def size(self) -> int:
        """Return the number of different shingles: about one for each token."""
        return len(self.all_shingles)

    def without(self, other: frozenset[str]) -> StudentCode:
        """Return the code without shingles that others have, too."""
        return StudentCode(
            {name: some - other for name, some in self.shingles.items() if some - other}
        )


NO_CODE = StudentCode({})


def likeness(left: frozenset[str], right: frozenset[str]) -> float:
    """Return the coefficient of Dice of two sets of shingles: 0 to 1; 0 where there are none."""
    total = len(left) + len(right)
    return 2 * len(left & right) / total if total else 0.0


def student_code(files: Sequence[Path]) -> StudentCode:
    """Return what the functions that are judged consist of.

    A function that is still to be written (it raises NotImplementedError) is left out.

    Args:
        files: The student's Python files; the one with the functions first.
    """
    return code_of_trees([_tree(file) for file in files])


def code_of_trees(trees: Sequence[ast.Module]) -> StudentCode:
    """Return the same as `student_code` of the syntax trees of files."""
    definitions: dict[str, tuple[_Definition, _Names]] = {}
    for tree in trees:
        names = _Names.of(tree)
        for name, definition in _definitions(tree):
            definitions.setdefault(name, (definition, names))
    shingles: dict[str, frozenset[str]] = {}
    for judged in JUDGES:
        if judged in definitions and not _is_unwritten(definitions[judged][0]):
            digests: set[str] = set()
            for name in _used_by(judged, definitions):
                digests |= _shingles(*definitions[name])
            if digests:
                shingles[judged] = frozenset(digests)
    return StudentCode(shingles)


def shingles_of_file(file: Path) -> frozenset[str]:
    """Return the digests of the shingles of every definition in a file that is written."""
    tree = _tree(file)
    names = _Names.of(tree)
    digests: set[str] = set()
    for _, definition in _definitions(tree):
        if not _is_unwritten(definition):
            digests |= _shingles(definition, names)
    return frozenset(digests)


def _tree(file: Path) -> ast.Module:
    """Return a file's syntax; empty where it has none, or is too large."""
    text = start_of(file)
    try:
        return ast.parse(text if len(text) <= LARGEST else b"")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ast.Module([], [])


def _definitions(tree: ast.Module) -> Iterator[tuple[str, _Definition]]:
    """Yield the functions, classes and variables of a file, by name."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name, node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                for inner in ast.walk(target):
                    if isinstance(inner, ast.Name):
                        yield inner.id, node


def _is_unwritten(definition: _Definition) -> bool:
    """Return whether a function raises NotImplementedError."""
    for node in ast.walk(definition):
        if isinstance(node, ast.Raise) and "'NotImplementedError'" in ast.dump(node):
            return True
    return False


def _used_by(judged: str, definitions: Mapping[str, tuple[_Definition, _Names]]) -> list[str]:
    """Return the names of what a function uses, itself first, without other judged functions."""
    used = [judged]
    for name in used:  # which grows meanwhile
        for node in ast.walk(definitions[name][0]):
            other = ""
            if isinstance(node, ast.Name):
                other = node.id
            elif isinstance(node, ast.Attribute):  # of another file of the student's
                other = node.attr
            if other in definitions and other not in used and other not in JUDGES:
                used.append(other)
    return used


@dataclass(frozen=True)
class _Names:
    """What the names in a file mean.

    Attributes:
        modules: What an imported name is, with its module.
        defined: Names that the file gives to variables, arguments and functions.
    """

    modules: Mapping[str, str]
    defined: frozenset[str]

    @classmethod
    def of(cls, tree: ast.Module) -> _Names:
        """Return those of a file."""
        modules: dict[str, str] = {}
        own: set[str] = set()
        for node in ast.walk(tree):
            match node:
                case ast.Import(names):
                    for alias in names:
                        modules[alias.asname or alias.name] = alias.name
                case ast.ImportFrom(module, names):
                    for alias in names:
                        modules[alias.asname or alias.name] = f"{module}.{alias.name}"
                case ast.Name(name, ast.Store()) | ast.arg(name):
                    own.add(name)
                case ast.FunctionDef(name) | ast.ClassDef(name):
                    own.add(name)
        return cls(modules, frozenset(own - set(JUDGES)))

    def token(self, name: str) -> str:
        """Return what stands for a name."""
        if name in self.defined:
            return _NAME + name
        return self.modules.get(name, name)


def _shingles(definition: _Definition, names: _Names) -> set[str]:
    """Return the digests of the shingles of a definition."""
    tokens = list(_tokens(definition, names))
    if isinstance(definition, ast.FunctionDef):
        tokens = tokens[2:]  # "FunctionDef" and its name, which everybody has
    if not tokens:
        return set()
    last = max(0, len(tokens) - SHINGLE)
    return {_digest(tokens[k : k + SHINGLE]) for k in range(last + 1)}


def _digest(tokens: Iterable[str]) -> str:
    """Return a digest of tokens; a student's names by the order in which they appear."""
    numbers: dict[str, str] = {}
    words: list[str] = []
    for token in tokens:
        if token.startswith(_NAME):
            words.append(numbers.setdefault(token, f"{_NAME}{len(numbers)}"))
        else:
            words.append(token)
    return hashlib.blake2b("\n".join(words).encode(errors="replace"), digest_size=6).hexdigest()


def _tokens(node: ast.AST, names: _Names) -> Iterator[str]:
    """Yield the tokens of a syntax tree, from top to bottom."""
    match node:
        case ast.Expr(ast.Constant()) | ast.Import() | ast.ImportFrom() | ast.Pass():
            return  # a docstring, or what the tokens of names tell
        case ast.AnnAssign(target, _, value) if value is not None:
            yield "Assign"
            yield from _tokens(target, names)
            yield from _tokens(value, names)
            return
        case ast.Name(name):
            yield names.token(name)
            return
        case ast.Constant(value):
            yield repr(value)
            return
        case _:
            yield type(node).__name__
    for field, value in ast.iter_fields(node):
        if field in _NO_CODE and not (field == "args" and isinstance(node, ast.Call)):
            continue
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST):
                yield from _tokens(part, names)
            elif isinstance(part, str):
                is_name = field in ("name", "id")
                yield names.token(part) if is_name else part
