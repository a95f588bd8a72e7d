"""The command that asks another question of the same two sides, as one types it."""

from __future__ import annotations

from ...installed import DEFAULT, PAIR
from ...measures.text import command
from ..compare.labels import typed_option
from ..compare.sides import Request, Side


def command_of(run: Request, *words: str) -> str:
    """Return the command that runs the same on the same sides, with words of a question behind.

    Args:
        run: What is run on two sides.
        words: Such as "--why"; none for the comparison itself.
    """
    typed = ["statemachine", "compare", *run.what, *_typed_sides(run)]
    for left, right in run.names.items():
        typed += ["--map", f"{left}={right}"]
    for side, name in zip(run.sides, ("left", "right"), strict=False):
        typed += _typed_parts(side, name)
    timestep = run.options.get("timestep")
    whole = command(
        typed,
        ("--menagerie", run.menagerie, None),
        ("--seconds", run.seconds, None),
        ("--timestep", timestep, None),
        ("--seed", run.seed, 0),
        ("--every", run.every, 1),
        ("--keyframe", run.keyframe, None),
    )
    return f"{whole} {command(words)}".strip()


def _typed_sides(run: Request) -> list[str]:
    """Return both sides, or the one model and the two backends."""
    words: list[str] = []
    for side in run.sides:
        words.append(typed_side(side))
        words += [typed_option(name, value) for name, value in side.options.items()]
    if run.model is not None:
        words.append(run.model)
    for name, value in run.options.items():
        if name != "timestep":
            words.append(typed_option(name, value))
    if not run.sides and tuple(run.backends) != PAIR:
        for backend in run.backends:
            words += ["--backend", backend]
    return words


def typed_side(side: Side) -> str:
    """Return a side as one types it, without its options: FILE, or FILE@ENGINE."""
    backend = str(side.chosen_backend())
    return side.model if backend == DEFAULT else f"{side.model}@{backend}"


def _typed_parts(side: Side, name: str) -> list[str]:
    """Return the options that give a side parts of the other's file."""
    if side.taken is None:
        return []
    other = "right" if name == "left" else "left"
    words: list[str] = []
    for part in side.taken.parts:
        words += [f"--{part}", other]
    return words
