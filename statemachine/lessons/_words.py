"""Words and figures that the lessons share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..page import Code, Page, Printed, Question, Table, Text
from .records import Session

WORDS = (
    "A few words first. A model file says what a robot is made of. A body is a rigid piece of "
    "it; a joint connects two bodies (a hinge turns, a slide shifts; a free body has a free "
    "joint, and nothing holds it). A geom is a body's shape, which can touch others. A servo, the "
    "actuator of this arm, pushes a joint towards the number in ctrl. A site is a named place on a "
    "body, like the fingertip gripperframe. A keyframe is a state that the model file names."
)


def origin(results: Mapping[str, Any]) -> str:
    """What a page was computed with: model and engine versions."""
    first = next(iter(results.values())).provenance
    engines = ", ".join(
        f"{name} {result.provenance.versions[name]}" for name, result in results.items()
    )
    return f"{first.model_file} on {engines}, {first.timestep * 1e3:g} ms a step"


def page_of(title: str, results: Mapping[str, Any], blocks: Sequence[Any]) -> Page:
    """A page with its origin."""
    return Page(title, origin(results), list(blocks))


def typed(session: Session, question: Question | None = None) -> list[Code | Question | Printed]:
    """The code of a lesson, a prediction, and what it printed."""
    code = Code(session.code.splitlines())
    return [code, *([question] if question else []), Printed(session.printed)]


def emulation(results: Mapping[str, Any], *promises: str) -> list[Text]:
    """Which of the promises that a page speaks of are kept by us, and not by the engine."""
    texts = []
    for name, result in results.items():
        ours = [each for each in promises if each in result.provenance.emulated]
        if ours:
            texts.append(
                Text(f"On {name} this interface, not the engine, sees to this: {', '.join(ours)}.")
            )
    return texts


def itself(name: str, asked: Sequence[Any]) -> list[Table]:
    """What the engine does without us."""
    if not asked:
        return []
    questions = " ".join(dict.fromkeys(each.question for each in asked))
    return [
        Table(
            ("after", "what", "is"),
            [(f"a {each.question}", each.part, each.answer) for each in asked],
            title=f"{name} itself, without us (statemachine conventions {questions})",
            words=frozenset({0, 1, 2}),
        )
    ]


def duration(seconds: float) -> str:
    """A wall time in the unit that reads best."""
    for factor, unit in ((1e6, "µs"), (1e3, "ms")):
        if seconds * factor < 1000:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds:.3g} s"


def differences(
    results: Mapping[str, Any], rows: Sequence[tuple[str, Callable[[Any, Any], str]]]
) -> list[Table]:
    """The last table of a page with several engines: each against the first.

    Args:
        results: By backend.
        rows: What is compared, and the words for it from the first's result and another's.
    """
    if len(results) < 2:
        return []
    (name, first), *others = results.items()
    return [
        Table(
            ("", *(f"{other} against {name}" for other, _ in others)),
            [(label, *(say(first, result) for _, result in others)) for label, say in rows],
            title="Where they differ, and by how much",
        )
    ]


def angle_or_length(value: float, slide: bool) -> str:
    """A difference of a joint's positions; what is below a millionth is only called so."""
    shown, unit = (value * 1e3, " mm") if slide else (math.degrees(value), "°")
    return f"{shown:.2g}{unit}" if shown >= 1e-6 else f"below 1e-6{unit}"


def degrees(radians: float, digits: int = 2) -> str:
    """An angle in degrees; what rounds to zero has no sign."""
    return f"{_rounded(math.degrees(radians), digits)}°"


def position(value: float, slide: bool, digits: int = 2) -> str:
    """A joint's position: a hinge's in degrees, a slide's in millimetres."""
    return millimetres(value, digits) if slide else degrees(value, digits)


def _rounded(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def signed(value: float | None, digits: int = 4) -> str:
    """A number with its sign; what rounds to zero has none; a dash if there is none."""
    if value is None:
        return "–"
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0 else text


def millimetres(metres: float, digits: int = 2) -> str:
    """A length in millimetres."""
    return f"{_rounded(metres * 1e3, digits)} mm"


def vector(values: Iterable[float], digits: int = 4) -> str:
    """Components in brackets; what rounds to zero has no sign."""
    return "[" + " ".join(f"{round(float(v), digits) + 0.0:.{digits}f}" for v in values) + "]"


def count(number: int, thing: str) -> str:
    """A number of things: 1 step, 2 steps."""
    return f"{number:,} {thing}" + ("" if number == 1 else "s")


def sentence(results: Mapping[str, Any], backend: str, text: str) -> Text:
    """A paragraph about one engine; alone, it begins with a capital."""
    return Text(f"{backend}: {text}" if len(results) > 1 else text[0].upper() + text[1:])


def where(results: Mapping[str, Any], backend: str) -> str:
    """The prefix "mujoco: " where several engines are shown, else nothing."""
    return f"{backend}: " if len(results) > 1 else ""
