"""Fields of a contract's file, each checked as it is read."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeGuard, cast

import numpy as np

from ...errors import BadInputError, did_you_mean, shown
from ...interface import Array
from .misspellings import nearest_name

_MOST: Final = 100_000  # calls, steps or numbers that a field counts


@dataclass(frozen=True)
class UnreadField:
    """A field of a contract's file that nothing reads.

    Attributes:
        name: Where it stands: "policy_io.imo".
        nearest: A field that is read and missing there, which this one may mean: "policy_io.imu";
            "" where none is near.
    """

    name: str
    nearest: str = ""


class ContractSection:
    """A section of a contract's file, which remembers what was read of it.

    Attributes:
        path: Where it stands: "control.actuators"; "" for the whole file.
    """

    def __init__(self, content: object, path: str, file: str) -> None:
        if not isinstance(content, Mapping):
            raise BadInputError(f"{file}: {path or 'a contract'} is a table; got {shown(content)}")
        self._content = cast("Mapping[object, object]", content)
        self._file = file
        self._read: set[str] = set()
        self._looked_for: set[str] = set()
        self._sections: list[ContractSection] = []
        self.path = path

    def name_of(self, key: str) -> str:
        """Return where a field stands: "control.actuators.kp"."""
        return f"{self.path}.{key}" if self.path else key

    def error(self, key: str, expected: str) -> BadInputError:
        """Return the error for a field that is not what was expected."""
        value = self._content.get(key)
        name = self.name_of(key)
        if value is None:
            known = [str(name) for name in self._content]
            return BadInputError(
                f"{self._file}: {name} is missing; {expected}{did_you_mean(key, known)}"
            )
        return BadInputError(f"{self._file}: {name}: {expected}; got {shown(value)}")

    def value(self, key: str) -> object:
        """Return a field as it stands; None where it is missing."""
        self._read.add(key)
        return self._content.get(key)

    def ignore(self, *keys: str) -> None:
        """Take fields for read from which nothing is computed."""
        self._read.update(keys)

    def has(self, key: str) -> bool:
        """Tell whether a field is there, and not null."""
        self._looked_for.add(key)
        return self._content.get(key) is not None

    def fields(self) -> list[str]:
        """Return the names of all fields, in their order."""
        return [str(key) for key in self._content]

    def section(self, key: str) -> ContractSection:
        """Return a section of this one; an empty one where it is missing."""
        content = self.value(key)
        section = ContractSection({} if content is None else content, self.name_of(key), self._file)
        self._sections.append(section)
        return section

    def sections(self, key: str) -> list[ContractSection]:
        """Return a list of sections.

        Raises:
            BadInputError: It is no list with at least one.
        """
        entries = self.value(key)
        if not _is_list(entries) or not len(entries):
            raise self.error(key, "a list of tables is expected")
        sections: list[ContractSection] = []
        for number, entry in enumerate(entries):
            sections.append(ContractSection(entry, f"{self.name_of(key)}[{number}]", self._file))
        self._sections += sections
        return sections

    def text(self, key: str, choices: Sequence[str], default: str = "") -> str:
        """Return a word that is one of several.

        Raises:
            BadInputError: It is none of them.
        """
        word = self.value(key)
        if word is None and default:
            return default
        if not isinstance(word, str) or (choices and word not in choices):
            hint = did_you_mean(word, choices) if isinstance(word, str) else ""
            wanted = f"one of {', '.join(choices)} is expected" if choices else "a name is expected"
            raise self.error(key, wanted + hint)
        return word

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number.

        Raises:
            BadInputError: It is none.
        """
        value = self.value(key)
        if value is None and default is not None:
            return default
        if not _is_number(value):
            raise self.error(key, "a finite number is expected")
        return float(value)

    def positive(self, key: str, most: float = math.inf) -> float:
        """Return a number above 0.

        Args:
            key: The field.
            most: The largest that is taken.

        Raises:
            BadInputError: It is none, or larger.
        """
        value = self.number(key)
        if not 0.0 < value <= most:
            up_to = "" if most == math.inf else f" and at most {most:g}"
            raise self.error(key, f"a number above 0{up_to} is expected")
        return value

    def count(self, key: str, default: int | None = None, least: int = 0) -> int:
        """Return a whole number.

        Raises:
            BadInputError: It is none, below the least, or more than any contract has.
        """
        value = self.number(key, default)
        if value != int(value) or not least <= value <= _MOST:
            raise self.error(key, f"a whole number from {least} to {_MOST} is expected")
        return int(value)

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false.

        Raises:
            BadInputError: It is neither.
        """
        value = self.value(key)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise self.error(key, "true or false is expected")
        return value

    def names(self, key: str) -> tuple[str, ...]:
        """Return names, each once.

        Raises:
            BadInputError: It is no such list.
        """
        entries = self.value(key)
        if not _is_list(entries) or not len(entries):
            raise self.error(key, "a list of names is expected")
        names: list[str] = []
        for entry in entries:
            if not isinstance(entry, str):
                raise self.error(key, "a list of names is expected")
            names.append(entry)
        if len(set(names)) != len(names):
            raise self.error(key, "each name once is expected")
        return tuple(names)

    def ids(self, key: str) -> list[int]:
        """Return whole numbers from 0 on, each once.

        Raises:
            BadInputError: It is no such list.
        """
        entries = self.value(key)
        expected = "a list of whole numbers from 0 on, each once, is expected"
        if not _is_list(entries) or not len(entries):
            raise self.error(key, expected)
        ids: list[int] = []
        for entry in entries:
            if not isinstance(entry, int) or isinstance(entry, bool) or entry < 0 or entry in ids:
                raise self.error(key, expected)
            ids.append(entry)
        return ids

    def size(self, key: str) -> int:
        """Return the length of a list.

        Raises:
            BadInputError: It is no list.
        """
        entries = self.value(key)
        if not _is_list(entries):
            raise self.error(key, "a list is expected")
        return len(entries)

    def numbers(self, key: str, size: int, default: float | None = None) -> Array:
        """Return `size` numbers, given as a list, or as one number for all.

        Raises:
            BadInputError: It is neither.
        """
        value = self.value(key)
        if value is None and default is not None:
            value = default
        if _is_number(value):
            return np.full(size, float(value))
        if (
            not _is_list(value)
            or len(value) != size
            or not all(_is_number(entry) for entry in value)
        ):
            raise self.error(key, f"{size} numbers, or one for all, are expected")
        return np.array(value, dtype=np.float64)

    def pair(self, key: str) -> tuple[float, float] | None:
        """Return a lower and an upper limit; None where it is missing.

        Raises:
            BadInputError: It is no pair of numbers in order.
        """
        if not self.has(key):
            return None
        if not _is_list(self.value(key)):
            raise self.error(key, "a lower and an upper limit are expected")
        low, high = self.numbers(key, 2)
        if low > high:
            raise self.error(key, "the lower limit comes first")
        return float(low), float(high)

    def pairs(self, key: str, size: int) -> Array:
        """Return lower and upper limits (size, 2), given as one pair, or as one for each.

        Raises:
            BadInputError: It is neither.
        """
        entries = self.value(key)
        if not _is_list(entries) or not len(entries) or not _is_list(entries[0]):
            pair = self.pair(key)
            if pair is None:
                raise self.error(key, "a lower and an upper limit are expected")
            return np.tile(pair, (size, 1))
        expected = f"a lower and an upper limit, or {size} of such pairs, are expected"
        if len(entries) != size:
            raise self.error(key, expected)
        pairs: list[Sequence[float]] = []
        for entry in entries:
            if not _is_list(entry) or len(entry) != 2:
                raise self.error(key, expected)
            low, high = entry
            if not _is_number(low) or not _is_number(high) or low > high:
                raise self.error(key, expected)
            pairs.append((low, high))
        return np.array(pairs, dtype=np.float64)

    def per_joint(self, key: str, joints: Sequence[str], null: float | None = None) -> Array | None:
        """Return a number for each joint, (n,); None where the field is missing.

        Args:
            key: The field: a table by the names of joints, a list in their order, or one number.
            joints: Their names.
            null: What stands for a joint whose number is null; None where that is an error.

        Raises:
            BadInputError: A joint has no finite number.
        """
        value = self.value(key)
        if value is None:
            return None
        if not isinstance(value, Mapping):
            return self.numbers(key, len(joints))
        table = cast("Mapping[object, object]", value)
        numbers: list[float] = []
        for joint in joints:
            number = table.get(joint)
            if joint in table and number is None and null is not None:
                numbers.append(null)
                continue
            if not _is_number(number):
                nearest = nearest_name(joint, [str(name) for name in table])
                hint = f". Did you mean {nearest}?" if nearest else ""
                raise BadInputError(
                    f"{self._file}: {self.name_of(key)} has no finite number for the joint "
                    f"{joint!r}{hint}"
                )
            numbers.append(float(number))
        return np.array(numbers)

    def non_negative(
        self, key: str, joints: Sequence[str], null: float | None = None
    ) -> Array | None:
        """Return a number from 0 on for each joint, (n,); arguments as of `per_joint`.

        Raises:
            BadInputError: A joint has no such number.
        """
        numbers = self.per_joint(key, joints, null)
        if numbers is not None and (numbers < 0.0).any():
            raise self.error(key, "numbers from 0 on are expected")
        return numbers

    def unread(self) -> Iterator[UnreadField]:
        """Yield the fields that nothing has read, and that are not null."""
        missing = sorted((self._read | self._looked_for) - set(self.fields()))
        for field, value in self._content.items():
            if field not in self._read and value is not None:
                key = str(field)
                nearest = nearest_name(key, missing)
                yield UnreadField(self.name_of(key), self.name_of(nearest) if nearest else "")
        for section in self._sections:
            yield from section.unread()


def _is_number(value: object) -> TypeGuard[float]:
    """Tell whether a value is a finite number, and no whole number beyond all of these."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # of NaN it is false


def _is_list(value: object) -> TypeGuard[Sequence[object]]:
    return isinstance(value, list | tuple)
