"""The page of the lesson on the state: sizes, and whose slots are which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import grouped, listed
from ...show.blocks import Table
from ...show.engine_tables import Results, differences
from ...show.labels import TableLabels
from ...show.templates import PageContent
from .frame import LessonFrame
from .state import JointSlots, StateResult

_SAY = TableLabels(__name__, "state_labels.md.j2")
NO_NAME = "(no name)"
_SIZES = ("nq", "nv", "nu", "nbody")


@dataclass(frozen=True)
class StatePage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        sizes: Sizes of the Model, by engine.
        owners: Slots of each joint; engines that say the same share a table.
        terms: What each engine itself calls all this.
        differences: How far the engines are from each other.
    """

    template = "state.md.j2"
    lesson: LessonFrame
    result: StateResult
    sizes: Table
    owners: Sequence[Table]
    terms: Sequence[Table]
    differences: Sequence[Table]

    @property
    def shifted(self) -> str:
        """Return the joints with other slots in qvel than in qpos; "" for none."""
        return ", ".join(_name(joint) for joint in self.result.joints if is_shifted(joint))

    @property
    def right(self) -> int:
        """Return the number of the right choice."""
        return 0 if self.result.nv == self.result.nq else 2


def contents(results: Results[StateResult], frame: LessonFrame) -> dict[str, StatePage]:
    """Return what the page shows of each engine."""
    sizes, owners = _sizes(results), _owners(results)
    terms = [_terms_table(name, result) for name, result in results.items() if result.terms]
    compared = differences(results, {_SAY("layout"): _compared})
    return {
        name: StatePage(frame, result, sizes, owners, terms, compared)
        for name, result in results.items()
    }


def _name(joint: JointSlots) -> str:
    """Return the name of a joint as tables show it."""
    return joint.name if joint.name else NO_NAME


def is_shifted(joint: JointSlots) -> bool:
    """Tell whether a joint has other slots in qvel than in qpos."""
    return (joint.qpos_start, joint.qpos_stop) != (joint.qvel_start, joint.qvel_stop)


def _sizes(results: Results[StateResult]) -> Table:
    """Return the sizes of the Model by engine."""
    rows = [
        (name, str(result.nq), str(result.nv), str(result.nu), str(result.nbody))
        for name, result in results.items()
    ]
    return Table(("", *_SIZES), rows)


def _owners(results: Results[StateResult]) -> list[Table]:
    """Return the slots of each joint; engines that say the same share a table."""
    names_by_joints = grouped((result.joints, name) for name, result in results.items())
    return [_slots_table(joints, names) for joints, names in names_by_joints.items()]


def _slots_table(joints: Sequence[JointSlots], engines: Sequence[str]) -> Table:
    """Return the slots of each joint on some engines."""
    title = _SAY("slots", engines=listed(engines))
    return Table.of(
        joints,
        {
            "joint": _name,
            "type": lambda joint: joint.type,
            "qpos": lambda joint: _interval(joint.qpos_start, joint.qpos_stop),
            "qvel": lambda joint: _interval(joint.qvel_start, joint.qvel_stop),
        },
        title=title,
        words=("type",),
    )


def _terms_table(engine: str, result: StateResult) -> Table:
    """Return what an engine itself calls what we have a name for."""
    theirs = _SAY("theirs", engine=engine)
    return Table.of(
        result.terms,
        {
            "": lambda term: term.thing,
            "here": lambda term: term.ours,
            theirs: lambda term: term.engine,
        },
        title=_SAY("terms", engine=engine),
        words=("here", theirs),
    )


def _compared(left: StateResult, right: StateResult) -> str:
    """Say whether two engines have the same layout."""
    same_sizes = all(getattr(left, size) == getattr(right, size) for size in _SIZES)
    if same_sizes and left.joints == right.joints:
        return "none"
    return _SAY("differ")


def _interval(start: int, stop: int) -> str:
    """Write some slots as an index, or as a slice where there are several."""
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
