"""Records of models as a table in a file, CSV or JSON, that is read again."""

from __future__ import annotations

import csv
import dataclasses
import json
import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ...atomic_files import replace_csv, replace_text
from ...errors import BadInputError
from ...models import check_is_file
from .records import ExaminedModel

SUFFIXES = (".csv", ".json")
_FIRST = ("file", "sha256", "made_with")


def write_table(target: Path, rows: Iterable[ExaminedModel]) -> None:
    """Write the table anew, whole or not at all."""
    plain = [dataclasses.asdict(row) for row in rows]
    if target.suffix.lower() == ".json":
        replace_text(target, json.dumps(plain, indent=1) + "\n")
        return
    flat = [_flat(row) for row in plain]
    head = list(dict.fromkeys(name for row in flat for name in row))
    lines = [head]
    for row in flat:
        lines.append([row.get(name, "") for name in head])
    replace_csv(target, lines)


def read_table(target: Path) -> dict[tuple[str, str, str], ExaminedModel]:
    """Return what a table says, by file, digest and what it was made with.

    Raises:
        BadInputError: It is no such table, so that nothing of it is overwritten.
    """
    check_is_file(target)
    try:
        if target.suffix.lower() == ".json":
            plain = json.loads(target.read_text(encoding="utf-8"))
        else:
            with target.open(newline="", encoding="utf-8-sig") as text:
                plain = [_nested(row) for row in csv.DictReader(text)]
        rows = [_built(ExaminedModel, row) for row in plain]
    except (OSError, ValueError, TypeError, KeyError, AttributeError, csv.Error) as error:
        raise BadInputError(
            f"{target.name} is there and is not a table of models ({type(error).__name__}): name "
            "another file, or remove it"
        ) from None
    return {(row.file, row.sha256, row.made_with): row for row in rows}


def _flat(row: Mapping[str, Any], before: str = "") -> dict[str, str]:
    """Return cells by dotted name."""
    cells: dict[str, str] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            cells |= _flat(value, f"{before}{name}.")
        elif isinstance(value, (tuple, list)):
            cells[before + name] = "\n".join(value)
        elif isinstance(value, bool):
            cells[before + name] = "yes" if value else "no"
        else:
            cells[before + name] = "" if value is None else str(value)
    return cells


def _nested(cells: Mapping[str, str]) -> dict[str, Any]:
    if any(name not in cells for name in _FIRST):
        raise ValueError(f"it has no column {' or '.join(_FIRST)}")
    row: dict[str, Any] = {}
    for dotted, cell in cells.items():
        *path, name = dotted.split(".")
        if not cell:
            continue  # as the record has it where nothing is said
        at = row
        for part in path:
            at = at.setdefault(part, {})
        at[name] = cell.removeprefix("'")
    return row


def _built(kind: Any, value: Any) -> Any:
    """Return a value of a type, from what JSON or the cells of a row say."""
    if isinstance(kind, types.UnionType):  # X | None
        if value is None:
            return None
        kind = kind.__args__[0]
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        return kind(**{name: _built(hints[name], value[name]) for name in hints if name in value})
    if typing.get_origin(kind) is dict:
        return {name: _built(kind.__args__[1], part) for name, part in value.items()}
    if typing.get_origin(kind) is tuple:
        return tuple(value.split("\n") if isinstance(value, str) else map(str, value))
    if kind is bool:
        return value in ("yes", True)
    return kind(value)
