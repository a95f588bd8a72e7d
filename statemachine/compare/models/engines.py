"""What two engines do of themselves, whatever the file says: asked of them, not known."""

from __future__ import annotations

from ...engines import room
from ...probes import conventions

# Of the conventions, those that stand between a description and what comes of it.
_ASKED = ("actuation", "damping", "friction")


def own_ways(one: str | None, two: str | None) -> tuple[tuple[str, str, str], ...]:
    """For each question that two engines answer otherwise: its title, and both answers."""
    if one is None or two is None or one == two:
        return ()
    if not all(room(engine).can("measurement") for engine in (one, two)):
        return ()
    asked = conventions.probe((one, two), _ASKED)
    found = []
    for each in asked.questions:
        left, right = (_in_words(each.findings[engine]) for engine in (one, two))
        if left and right and left != right:
            found.append((each.question.title, left, right))
    return tuple(found)


def _in_words(answers: conventions.Answers | None) -> str:
    return "; ".join(f"{a.of}: {a.answer}" if a.of else a.answer for a in answers or ())
