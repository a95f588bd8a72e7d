"""What two engines do of themselves, whatever the file says: asked of them, not known."""

from __future__ import annotations

from ...engines import room
from ...probes import conventions

# Of the conventions, those that stand between a description and what comes of it.
_ASKED = ("actuation", "damping", "friction")


def own_ways(one: str | None, two: str | None) -> tuple[tuple[str, str, str], ...]:
    """For each question that two engines answer otherwise: its title, and both answers."""
    engines = [engine for engine in (one, two) if engine and room(engine).can("measurement")]
    if len({*engines}) < 2:
        return ()
    answered = [
        (asked.question.title, *(_in_words(asked.findings[engine]) for engine in engines))
        for asked in conventions.probe(engines, _ASKED).questions
    ]
    return tuple(
        (title, left, right) for title, left, right in answered if left and right and left != right
    )


def _in_words(answers: conventions.Answers | None) -> str:
    return "; ".join(f"{a.of}: {a.answer}" if a.of else a.answer for a in answers or ())
