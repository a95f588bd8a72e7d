"""A class at a glance: what is right, which mistakes are common, and what was not judged."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ...show.blocks import only_on_pages
from .alike import AlikeGroup, AlikePair
from .class_table import ClassEntry, verdicts_of
from .judges import JUDGES

COMMON = 2  # students, from whom on a mistake is a common one
# What may differ between two remarks on the same mistake: a number, a line of code, a function,
# and in which run of demo_gravity it was seen.
_VARIES = re.compile(
    r"`[^`]*`|\bdemo_\w+|(?<=\bservos )(?:on|off)\b|(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
)


@dataclass(frozen=True)
class FunctionCount:
    """How many students have a function right.

    Attributes:
        function: Its name.
        right: Number of students who have it right.
        wrong: Number of those who have it wrong.
        not_written: Number of those who did not write it.
        not_judged: Number of those whose function was not judged.
    """

    function: str
    right: int
    wrong: int
    not_written: int
    not_judged: int


@dataclass(frozen=True)
class Mistake:
    """A mistake that one or several students made.

    Attributes:
        remark: What is said of it; "…" for a figure or a line of code that is not the same for
            all of them.
        functions: Functions in which it was made.
        students: Who made it, or the names of the files.
        others: Further remarks that just these students, if there are several, got on just these
            functions: most often one cause has them all.
    """

    remark: str
    functions: tuple[str, ...]
    students: tuple[str, ...]
    others: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Return the number of students who made it."""
        return len(self.students)


@dataclass(frozen=True)
class Unjudged:
    """Why some submissions, or functions of theirs, were not judged.

    Attributes:
        reason: The same for all of them.
        students: Who handed them in, or the names of the files.
    """

    reason: str
    students: tuple[str, ...]


@dataclass(frozen=True)
class ClassResult:
    """What came of the files of a class.

    Attributes:
        entries: One for each submission.
        functions: How many students have each function right.
        mistakes: The commonest first.
        alike: Groups of submissions that are alike, the largest first.
        nearly_alike: Submissions that are nearly alike, two by two.
        unjudged: What was not judged, by the reason.
        ignored: Names of files in the folders that nobody hands in.
    """

    entries: tuple[ClassEntry, ...]
    functions: tuple[FunctionCount, ...]
    mistakes: tuple[Mistake, ...]
    alike: tuple[AlikeGroup, ...]
    nearly_alike: tuple[AlikePair, ...]
    unjudged: tuple[Unjudged, ...]
    ignored: tuple[str, ...]

    @property
    @only_on_pages
    def counted(self) -> Sequence[ClassEntry]:
        """Return the submissions that count: with a roster, files of nobody on it do not."""
        return counted(self.entries)

    @property
    @only_on_pages
    def strangers(self) -> Sequence[ClassEntry]:
        """Return the submissions of nobody on the roster; none without a roster."""
        if not any(entry.student for entry in self.entries):
            return ()
        return [entry for entry in self.entries if not entry.student]

    @property
    def complete(self) -> bool:
        """Tell whether every submission could be judged."""
        return all(entry.judged for entry in self.entries)


def class_result(
    entries: Sequence[ClassEntry],
    alike: Sequence[AlikeGroup] = (),
    ignored: Sequence[str] = (),
    nearly_alike: Sequence[AlikePair] = (),
) -> ClassResult:
    """Return what came of the files of a class, with what is counted of it.

    Args:
        entries: One for each submission.
        alike: Groups of submissions that are alike.
        ignored: Names of files that nobody hands in.
        nearly_alike: Submissions that are nearly alike, two by two.
    """
    return ClassResult(
        entries=tuple(entries),
        functions=_function_counts(counted(entries)),
        mistakes=_mistakes(counted(entries)),
        alike=tuple(alike),
        nearly_alike=tuple(nearly_alike),
        unjudged=_unjudged(entries),
        ignored=tuple(ignored),
    )


def counted(entries: Sequence[ClassEntry]) -> Sequence[ClassEntry]:
    """Return the submissions that count: with a roster, files of nobody on it do not."""
    of_students = [entry for entry in entries if entry.student]
    return of_students if of_students else entries


def _function_counts(entries: Sequence[ClassEntry]) -> tuple[FunctionCount, ...]:
    """Count the verdicts on each function of the exercise."""
    counts: list[FunctionCount] = []
    for name in JUDGES:
        words = [verdicts_of(entry)[name] for entry in entries]
        counts.append(
            FunctionCount(
                name,
                right=words.count("right"),
                wrong=words.count("wrong"),
                not_written=words.count("not written"),
                not_judged=words.count("not judged"),
            )
        )
    return tuple(counts)


def _mistakes(entries: Sequence[ClassEntry]) -> tuple[Mistake, ...]:
    """Return the mistakes, the commonest first; remarks that differ in figures are of one."""
    remarks: dict[str, list[tuple[ClassEntry, str, str]]] = {}
    for entry in entries:
        for function, remark in _wrong_remarks(entry):
            pattern = _VARIES.sub("…", remark)
            remarks.setdefault(pattern, []).append((entry, function, remark))
    mistakes: list[Mistake] = []
    for same in remarks.values():
        text = _common_text([remark for _, _, remark in same])
        functions = {function for _, function, _ in same}
        in_order = tuple(name for name in JUDGES if name in functions)
        students = tuple(dict.fromkeys(entry.label for entry, _, _ in same))
        mistakes.append(Mistake(text, in_order, students))
    mistakes.sort(key=lambda mistake: -mistake.count)
    return tuple(_merged(mistakes))


def _merged(mistakes: Sequence[Mistake]) -> list[Mistake]:
    """Return mistakes, those as one that the same students made in the same functions."""
    merged: dict[tuple[tuple[str, ...], frozenset[str]], Mistake] = {}
    rare: list[Mistake] = []
    for mistake in mistakes:
        if mistake.count < COMMON:
            rare.append(mistake)
            continue
        key = (mistake.functions, frozenset(mistake.students))
        if key in merged:
            first = merged[key]
            merged[key] = replace(first, others=(*first.others, mistake.remark))
        else:
            merged[key] = mistake
    return [*merged.values(), *rare]


def _wrong_remarks(entry: ClassEntry) -> Iterator[tuple[str, str]]:
    """Yield the name of each function that is wrong, and what is said of it."""
    for judgement in entry.functions:
        if judgement.judged and judgement.written and not judgement.passed:
            for remark in judgement.remarks:
                if remark not in entry.flags:
                    yield judgement.function, remark


def _common_text(remarks: Sequence[str]) -> str:
    """Return what remarks on one mistake have in common, with "…" where they differ."""
    first = remarks[0]
    figures = [_VARIES.findall(remark) for remark in remarks]
    parts = _VARIES.split(first)
    text = parts[0]
    for part, values in zip(parts[1:], zip(*figures, strict=True), strict=True):
        text += values[0] if len(set(values)) == 1 else "…"
        text += part
    return text


def _unjudged(entries: Sequence[ClassEntry]) -> tuple[Unjudged, ...]:
    """Return why submissions were not judged, each reason once."""
    students: dict[str, list[str]] = {}
    for entry in entries:
        for reason in entry.reasons_not_judged:
            students.setdefault(reason, []).append(entry.label)
    return tuple(Unjudged(reason, tuple(names)) for reason, names in students.items())
