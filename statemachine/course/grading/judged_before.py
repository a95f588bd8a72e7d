"""Verdicts that were found before, kept in a folder of the user's, so that a class is judged once.

A verdict is taken over where all that it depends on is the same: the student's files, every file of
this package and of its models, Python, NumPy, the engine, and the limits. No number is drawn at
random: the models that a function is called on stand in the package. What asks for somebody's
attention, and what was not judged, is judged anew each time.

Nothing is kept where a student's code is only watched: it could write there.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...atomic_files import replace_text
from ...models import models_dir
from ...processes import sandbox
from .judges import JUDGES, Judgement

T = TypeVar("T")

_VARIABLE = "STATEMACHINE_JUDGED"
_KIND = "statemachine verdicts 1"
_OLD = 120 * 24 * 3600.0  # [s] since it was written: then it is removed
PACKAGE = Path(__file__).resolve().parents[2]
_SUFFIXES = (".py", ".xml", ".json", ".so", ".pyd")


@dataclass(frozen=True)
class KnownVerdicts:
    """What was found out about a submission.

    Attributes:
        functions: Verdict on each function of the exercise; empty where they were not judged.
        tests: What the student's tests catch, in words; "" where they were not run.
    """

    functions: tuple[Judgement, ...] = ()
    tests: str = ""


class VerdictStore:
    """Verdicts by what they depend on, each in a file that is there whole or not at all."""

    def __init__(self, folder: Path | None, made_with: str) -> None:
        """Begin.

        Args:
            folder: Where the files are; None to keep nothing.
            made_with: Backend, versions and limits.
        """
        self._folder = folder
        self._made_with = f"{made_with}, {software_digest()}"
        if folder is not None:
            _remove_old(folder)

    def find(self, content: str) -> KnownVerdicts:
        """Return what is known of a content, by its digest; nothing for a file that is damaged."""
        file = self._file(content)
        if file is None:
            return KnownVerdicts()
        try:
            facts = json.loads(file.read_text("utf-8"))
            if facts["kind"] != _KIND or facts["content"] != content:
                return KnownVerdicts()
            if facts["made_with"] != self._made_with:
                return KnownVerdicts()
            functions = tuple(_judgement(each) for each in facts["functions"])
            tests = facts["tests"]
        except (OSError, ValueError, LookupError, TypeError, RecursionError):
            return KnownVerdicts()
        if not isinstance(tests, str):
            return KnownVerdicts()
        if functions and [each.function for each in functions] != list(JUDGES):
            return KnownVerdicts()
        return KnownVerdicts(functions, tests)

    def keep(self, content: str, verdicts: KnownVerdicts) -> None:
        """Keep what was found out about a content; where that cannot be written, keep nothing."""
        file = self._file(content)
        if file is None:
            return
        facts = {
            "kind": _KIND,
            "content": content,
            "made_with": self._made_with,
            "functions": [asdict(each) for each in verdicts.functions],
            "tests": verdicts.tests,
        }
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            replace_text(file, json.dumps(facts, ensure_ascii=False))

    def _file(self, content: str) -> Path | None:
        """Return the file of a content; None where nothing is kept."""
        if self._folder is None or not content:
            return None
        name = hashlib.sha256(f"{content} {self._made_with}".encode()).hexdigest()
        return self._folder / f"{name}.json"


def folder() -> Path | None:
    """Return where verdicts are kept: $STATEMACHINE_JUDGED, or a folder of the user's cache.

    None where that variable is empty, where this user has no home, and where a student's code is
    not shut in.
    """
    if not sandbox.shut_in():
        return None
    named = os.environ.get(_VARIABLE)
    if named is not None:
        return Path(named) if named else None
    cache_folder = os.environ.get("XDG_CACHE_HOME")
    try:
        base = Path(cache_folder) if cache_folder else Path.home() / ".cache"
    except RuntimeError:  # this user has no home
        return None
    return base / "statemachine" / "judged"


@cache
def software_digest() -> str:
    """Return a digest of what decides a verdict beside the engine: this package, Python, NumPy."""
    sha = hashlib.sha256()
    sha.update(f"{sys.version} {np.__version__} {platform.platform()}".encode())
    for root in (PACKAGE, models_dir()):
        for file in sorted(_software(root)):
            content = file.read_bytes()
            name = file.relative_to(root).as_posix()
            sha.update(f"{name} {len(content)} ".encode() + content)
    return sha.hexdigest()


def _software(root: Path) -> Iterable[Path]:
    """Yield the files of a folder that decide what a program does."""
    for place, folders, names in os.walk(root):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for name in names:
            if name.endswith(_SUFFIXES):
                yield Path(place, name)


def _judgement(facts: dict[str, Any]) -> Judgement:
    """Return a judgement as it was kept.

    Raises:
        LookupError, TypeError: It is none.
    """
    texts = facts["remarks"]
    if isinstance(texts, str):
        raise TypeError("no judgement")
    function = _typed(facts["function"], str)
    remarks = tuple(_typed(text, str) for text in texts)
    written, passed = _typed(facts["written"], bool), _typed(facts["passed"], bool)
    return Judgement(function, written, passed, remarks, _typed(facts["judged"], bool))


def _typed(value: Any, kind: type[T]) -> T:
    """Return a value of a type.

    Raises:
        TypeError: It is of another one.
    """
    if not isinstance(value, kind):
        raise TypeError("no judgement")
    return value


def _remove_old(kept_in: Path) -> None:
    """Remove what was written long ago."""
    with suppress(OSError):
        for file in kept_in.glob("*.json"):
            with suppress(OSError):
                if time.time() - file.stat().st_mtime > _OLD:
                    file.unlink()
