"""What two engines do of themselves, whatever the file says: asked of them, not known."""

from __future__ import annotations

from ...probes import conventions

# Of the conventions, those that stand between a description and what comes of it.
_ASKED = ("actuation", "damping", "friction")


def own_ways(one: str | None, two: str | None) -> tuple[tuple[str, str, str], ...]:
    """For each question that two engines answer otherwise: its title, and both answers."""
    if one is None or two is None or one == two:
        return ()
    asked = conventions.probe((one, two), _ASKED)
    found = []
    for each in asked.questions:
        answers = [
            "; ".join(f"{f.of}: {f.answer}" if f.of else f.answer for f in each.findings[engine])
            for engine in (one, two)
        ]
        if answers[0] != answers[1]:
            found.append((each.question.title, answers[0], answers[1]))
    return tuple(found)
