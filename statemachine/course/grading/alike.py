"""Which submissions of a class are alike."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .course_code import course_code
from .likeness import NO_CODE, StudentCode, likeness, student_code
from .submissions import Submission

ALIKE = 0.95  # from this likeness on two submissions belong to one group
NEARLY_ALIKE = 0.85  # from this one on two are told, too: a copy that was changed
# Shingles: fewer are one function, which two who work alone may write alike. The four functions of
# the course's solution have 59 to 75 each.
SHORT = 100


@dataclass(frozen=True)
class AlikeGroup:
    """Submissions each of which is like another one of them.

    Attributes:
        students: Who handed them in, or the names of the files.
        least: Likeness of the two that are least alike, 0 to 1.
        most: Likeness of the two that are most alike, 0 to 1.
        size: Number of shingles of the shortest, without what is handed out.
        is_short: Whether the shortest is so short that two who work alone may write the same.
        is_solution: Whether one of them is as like the course's own solution.
    """

    students: tuple[str, ...]
    least: float
    most: float
    size: int
    is_short: bool
    is_solution: bool


@dataclass(frozen=True)
class AlikePair:
    """Two submissions that are nearly alike.

    Attributes:
        students: Who handed them in, or the names of the files.
        likeness: How much they are alike, 0 to 1.
    """

    students: tuple[str, str]
    likeness: float


@dataclass(frozen=True)
class Nearest:
    """The submission that another one is most like.

    Attributes:
        student: Who handed it in, or the name of the file.
        likeness: How much they are alike, 0 to 1.
    """

    student: str
    likeness: float


@dataclass(frozen=True)
class ClassLikeness:
    """How the submissions of a class are alike.

    Attributes:
        nearest: By the name of a submission, the one that it is most like; none where it has no
            code of its own, or nothing in common with any.
        groups: Of submissions that are alike, the largest first.
        nearly: Submissions that are nearly alike and in no group together, the most alike first;
            with those of a group, only the nearest of it.
    """

    nearest: Mapping[str, Nearest]
    groups: tuple[AlikeGroup, ...]
    nearly: tuple[AlikePair, ...]


def compare_submissions(submitted: Sequence[Submission]) -> ClassLikeness:
    """Compare the code of each submission with that of every other one.

    What is handed out does not count.
    """
    codes = {each.name: _code_of(each) for each in submitted}
    labels = {each.name: each.label for each in submitted}
    pairs: dict[tuple[str, str], float] = {}
    nearest: dict[str, Nearest] = {}
    for left, right in itertools.combinations(codes, 2):
        share = likeness(codes[left].all_shingles, codes[right].all_shingles)
        pairs[left, right] = share
        for one, other in ((left, right), (right, left)):
            if share > 0 and (one not in nearest or share > nearest[one].likeness):
                nearest[one] = Nearest(labels[other], share)
    groups: list[AlikeGroup] = []
    names_of_groups = _groups_of(codes, pairs)
    for names in names_of_groups:
        shares = [pairs[pair] for pair in itertools.combinations(names, 2)]
        students = tuple(labels[name] for name in names)
        groups.append(_group(students, [codes[name] for name in names], shares))
    groups.sort(key=lambda group: -len(group.students))
    near = _near_pairs(pairs, names_of_groups)
    nearly = [AlikePair((labels[left], labels[right]), pairs[left, right]) for left, right in near]
    return ClassLikeness(nearest, tuple(groups), tuple(nearly))


def _group(
    students: tuple[str, ...], codes: Sequence[StudentCode], shares: Sequence[float]
) -> AlikeGroup:
    """Return a group of submissions.

    Args:
        students: Who handed them in.
        codes: Of each.
        shares: Likeness of each two.
    """
    size = min(code.size for code in codes)
    solution = course_code().solution
    closest = max(likeness(code.all_shingles, solution) for code in codes)
    return AlikeGroup(
        students=students,
        least=min(shares),
        most=max(shares),
        size=size,
        is_short=size < SHORT,
        is_solution=closest >= ALIKE,
    )


def _code_of(submission: Submission) -> StudentCode:
    """Return the code of a submission, without what is handed out."""
    if submission.path is None:
        return NO_CODE
    files = [submission.path]
    for name, file in submission.files.items():
        if name.endswith(".py") and file != submission.path:
            files.append(file)
    return student_code(files).without(course_code().handed_out)


def _groups_of(
    names: Mapping[str, StudentCode], pairs: Mapping[tuple[str, str], float]
) -> list[list[str]]:
    """Return groups in which each submission is alike to at least one other of its group."""
    group_of = {name: [name] for name in names}
    for (left, right), share in pairs.items():
        if share >= ALIKE and group_of[left] is not group_of[right]:
            both = group_of[left] + group_of[right]
            for name in both:
                group_of[name] = both
    order = list(names)
    groups: list[list[str]] = []
    for name in names:
        group = sorted(group_of[name], key=order.index)
        if len(group) > 1 and group not in groups:
            groups.append(group)
    return groups


def _near_pairs(
    pairs: Mapping[tuple[str, str], float], groups: Sequence[Sequence[str]]
) -> list[tuple[str, str]]:
    """Return the pairs that are nearly alike, the most alike first.

    With the members of a group, only the most alike pair counts.
    """
    first_of = {name: group[0] for group in groups for name in group}
    listed: set[frozenset[str]] = set()
    near: list[tuple[str, str]] = []
    for left, right in sorted(pairs, key=lambda pair: -pairs[pair]):
        between = frozenset((first_of.get(left, left), first_of.get(right, right)))
        if pairs[left, right] < NEARLY_ALIKE:
            break
        if len(between) == 2 and between not in listed:
            listed.add(between)
            near.append((left, right))
    return near
