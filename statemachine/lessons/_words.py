"""Words and figures that the lessons share."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..interface import Model
from ..measures.text import capital, milliseconds
from ..page import Code, Page, Printed, Question, Table, Text
from ..runs.drive import steps_in
from .records import Session

_WORDS = (
    "A few words first. A model file says what a robot is made of. A body is a rigid piece of "
    "it; a joint connects two bodies (a hinge turns, a slide shifts; a free body has a free "
    "joint, and nothing holds it). A geom is a body's shape, which can touch others. {drive} A "
    "site is a named place on a body{tip}. A keyframe is a state that the model file names."
)


def words(arm: bool) -> str:
    """What the words of the lessons mean; of the arm with its own names."""
    if arm:
        servo = "A servo, the actuator of this arm, pushes a joint towards the number in ctrl."
        return _WORDS.format(drive=servo, tip=", like the fingertip gripperframe")
    servo = "An actuator drives a joint: a servo pushes it towards the number in ctrl, and to a "
    return _WORDS.format(drive=f"{servo}motor that number is a force.", tip="")


def origin(results: Mapping[str, Any]) -> str:
    """What a page was computed with: model and engine versions."""
    first = next(iter(results.values())).provenance
    engines = ", ".join(
        f"{name} {result.provenance.versions[result.provenance.backend]}"
        for name, result in results.items()
    )
    return f"{first.model_file} on {engines}, {milliseconds(first.timestep)} a step"


def page_of(title: str, results: Mapping[str, Any], blocks: Sequence[Any]) -> Page:
    """A page with its origin."""
    return Page(title, origin(results), list(blocks))


def typed(session: Session, question: Question | None = None) -> list[Code | Question | Printed]:
    """The code of a lesson, a prediction, and what it printed."""
    code = Code(session.code.splitlines())
    return [code, *([question] if question else []), Printed(session.printed)]


def spans(model: Model, marks: Sequence[float], seconds: float) -> tuple[str, str]:
    """The head of a loop that steps from mark to mark, and what it gives `step` as nstep.

    Args:
        model: Its timestep counts.
        marks: Times at which the loop stops [s]; seconds: the last.
        seconds: See marks.
    """
    total = steps_in(model, seconds)
    ends = sorted({0, total, *(k for t in marks if 0 < (k := round(t / model.timestep)) < total)})
    counts = [b - a for a, b in itertools.pairwise(ends)]
    if len(set(counts)) == 1:
        return f"for _ in range({len(counts)}):", str(counts[0])
    return f"for n in ({', '.join(map(str, counts))}):", "n"


def emulation(results: Mapping[str, Any], *promises: str) -> list[Text]:
    """Which of the promises that a page speaks of are kept by us, and not by the engine."""
    texts = []
    for name, result in results.items():
        ours = [each for each in promises if each in result.provenance.emulated]
        if ours:
            texts.append(
                Text(f"On {name} this interface, and not the engine, provides: {', '.join(ours)}.")
            )
    return texts


def differences(
    results: Mapping[str, Any], rows: Sequence[tuple[str, Callable[[Any, Any], str]]]
) -> list[Table]:
    """The last table of a page with several engines: each against the first.

    Args:
        results: By backend.
        rows: What is compared, and the words for it from the first's result and another's.
    """
    if len(results) < 2 or not rows:
        return []
    (name, first), *others = results.items()
    return [
        Table(
            ("", *(f"{other} against {name}" for other, _ in others)),
            [(label, *(say(first, result) for _, result in others)) for label, say in rows],
            title="Where they differ, and by how much",
        )
    ]


def alike(results: Mapping[str, Any], of: Callable[[Any], Any]) -> list[tuple[str, Any]]:
    """Engines that say the same are shown once: the prefix "a, b: " and one's result."""
    groups: dict[Any, list[str]] = {}
    for name, result in results.items():
        groups.setdefault(of(result), []).append(name)
    several = len(results) > 1
    return [
        (f"{', '.join(names)}: " if several else "", results[names[0]]) for names in groups.values()
    ]


def sentence(results: Mapping[str, Any], backend: str, text: str) -> Text:
    """A paragraph about one engine; alone, it begins with a capital."""
    return Text(f"{backend}: {text}" if len(results) > 1 else capital(text))


def where(results: Mapping[str, Any], backend: str) -> str:
    """The prefix "mujoco: " where several engines are shown, else nothing."""
    return f"{backend}: " if len(results) > 1 else ""
