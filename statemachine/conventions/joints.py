"""In which order the joints come, and whether a fixed one takes a number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ..engines.measured import Measurement
from ..engines.samples.joint_tree import FIXED, TREE
from .answers import UNDECIDED, Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "In which order do the joints come, and does a fixed one take a number?",
    "A command in the order of another engine moves the wrong joints. Look joints up by name.",
)
GIVEN = ()


def depth_first(parent: str, by_name: bool) -> Iterator[str]:
    """Names of the joints below a link."""
    children = [name for name, above, _ in TREE if above == parent]
    for name in sorted(children) if by_name else children:
        yield name
        yield from depth_first(name, by_name)


def breadth_first(by_name: bool) -> Iterator[str]:
    """Names of all joints, level by level."""
    level = ["base"]
    while level:
        below: list[str] = []
        for parent in level:
            children = [name for name, above, _ in TREE if above == parent]
            below += sorted(children) if by_name else children
        yield from below
        level = below


_listed = [name for name, _, _ in TREE]
ORDERS = {
    "as listed": _listed,
    "by alphabet": sorted(_listed),
    "depth first, children as listed": list(depth_first("base", False)),
    "depth first, children by alphabet": list(depth_first("base", True)),
    "breadth first, children as listed": list(breadth_first(False)),
    "breadth first, children by alphabet": list(breadth_first(True)),
}


def answer(names: Mapping[str, Sequence[str]]) -> Answers:
    """Which rule gives the engine's names; and whether the fixed joint is among them."""
    return tuple(each for form, order in names.items() for each in _answers(form, order))


def _answers(form: str, names: Sequence[str]) -> Answers:
    moving = [name for name in names if name != FIXED]
    words = next(
        (rule for rule, order in ORDERS.items() if [n for n in order if n != FIXED] == moving),
        UNDECIDED,
    )
    counted = Measurement("joints with a number", len(names))
    return (
        EngineAnswer(words, (Measurement("", tuple(moving)),), form),
        EngineAnswer(
            "takes a number" if FIXED in names else "none", (counted,), f"fixed joint, {form}"
        ),
    )
