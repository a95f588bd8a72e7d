"""What to change on the right, as blocks of a page: lines of its file, and settings."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines.description.file_changes import AttributeChange
from ...installed import DEFAULT
from ...measures.text import NO_NUMBER
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from .explanation import Explanation, Share
from .table_page import has_effect
from .values_page import distinct, texts_of, title_of


@dataclass(frozen=True)
class SettingChange:
    """A quantity that the right is to have as the left has it, where no line of its file is known.

    Attributes:
        name: What it is, and of what; before it the option of the right that says it, or the file
            and the line, where they are known.
        left, right: Its values, with their units.
        is_lacking: Whether the right has nothing of it that a value could tell.
    """

    name: str
    left: str
    right: str
    is_lacking: bool = False


@dataclass(frozen=True)
class WhyChanges(PageContent):
    """What to change on the right.

    Attributes:
        result: The explanation.
    """

    template = "why_changes.md.j2"
    result: Explanation

    @property
    def engine(self) -> str:
        """Return the engine whose settings are those that it comes with; "" where there is none."""
        return engine_as_it_comes(self.result) if self._acting else ""

    @property
    def in_file(self) -> tuple[AttributeChange, ...]:
        """Return the attributes of the right's file."""
        changes: list[AttributeChange] = []
        for row in self._acting:
            changes += row.changes
        return tuple(dict.fromkeys(changes))

    @property
    def settings(self) -> tuple[SettingChange, ...]:
        """Return the settings to change besides attributes of the file."""
        changes: list[SettingChange] = []
        for row in self._acting:
            if not row.changes:
                changes += _settings_of(row)
        return tuple(changes)

    @property
    def has_changes(self) -> bool:
        """Tell whether anything is to be changed."""
        return bool(self._acting)

    @property
    def equalized_gap(self) -> float | None:
        """Return the gap with all of these changed; None where that is not known."""
        return self.result.equalized_gap if self._acting else None

    @property
    def others_may_be_missing(self) -> bool:
        """Tell whether differences are left out that act only elsewhere than in what was asked."""
        return 0 < len(self._acting) < len(self._equalizable) and len(self.result.first) > 1

    @property
    def side(self) -> str:
        """Return the only side that has integrators to choose from; "" where there is none."""
        return next((row.chosen[0] for row in self.result.shares if row.chosen), "")

    @property
    def integrator(self) -> str:
        """Return the integrator to choose on that side; "" where there is none."""
        return next((row.chosen[1] for row in self.result.shares if row.chosen), "")

    @property
    def _equalizable(self) -> list[Share]:
        return [row for row in self.result.shares if not (row.note or row.chosen)]

    @property
    def _acting(self) -> list[Share]:
        return [row for row in self._equalizable if has_effect(row)]


def steps(result: Explanation) -> list[Block]:
    """Say what to change, where, and what is left of the gap with everything changed."""
    return render_blocks(WhyChanges(result)) if result.verdict.divides else []


def _settings_of(row: Share) -> list[SettingChange]:
    """Return what to change for one cause: a row for each quantity."""
    if not row.values:
        return [SettingChange(_placed(row, row.name), NO_NUMBER, NO_NUMBER)]
    changes: list[SettingChange] = []
    for value in distinct(row.values):
        left, right = texts_of(value)
        is_lacking = (left, right) == ("there", NO_NUMBER)
        changes.append(SettingChange(_placed(row, title_of(row, value)), left, right, is_lacking))
    return changes


def _placed(row: Share, name: str) -> str:
    """Return a name behind the option, or the file and the line, that say the cause, if known."""
    if row.option:
        return f"option {row.option}: {name}"
    return f"{row.place.file}, line {row.place.line}: {name}" if row.place else name


def engine_as_it_comes(result: Explanation) -> str:
    """Return an engine with its own settings, where such settings are causes; else ""."""
    if not any(row.kind == "engine" for row in result.shares):
        return ""
    for label, provenance in zip(result.labels, result.provenance, strict=True):
        comes_with_its_own = ":engine" in label or "engine defaults" in label
        if comes_with_its_own and provenance.backend != DEFAULT:
            return provenance.backend
    return ""
