"""The verdict on a gap: every combination of what was found has the answer that a reader expects.

The table was written before the function: each row is a situation, in the words of its name.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import pytest

from statemachine.lab.compare.chaos import against_floor
from statemachine.lab.why.verdict import (
    Answer,
    CausePart,
    Facts,
    GapState,
    LocatedPart,
    gap_state,
    verdict_of,
)


@pytest.mark.parametrize(
    ("gap", "floor", "chance"),
    [
        (0.9, 1.0, "inside"),
        (1.0, 1.0, "cannot be told"),
        (3.0, 1.0, "cannot be told"),
        (3.1, 1.0, "beyond"),
        (1e-9, 0.0, "beyond"),
        (1e9, float("inf"), "inside"),
        (float("nan"), 1.0, "beyond"),  # it is no number, and so it never agrees
    ],
)
def test_a_gap_is_beyond_the_floor_from_three_times_it_on(
    gap: float, floor: float, chance: str
) -> None:
    assert against_floor(gap, floor) == chance


@pytest.mark.parametrize(
    ("gap", "floor", "state"),
    [
        (0.0, 0.0, "rounding"),
        (1e-10, 1.0, "rounding"),
        (0.5, 0.0, "beyond"),  # within its tolerance, and yet something makes it
        (0.5, 0.1, "beyond"),
        (0.5, 0.4, "within"),
        (0.5, 9.0, "within"),
        (2.0, 9.0, "inside"),
        (2.0, 1.0, "cannot be told"),
        (2.0, 0.5, "beyond"),
    ],
)
def test_only_a_gap_beyond_the_floor_is_divided(gap: float, floor: float, state: str) -> None:
    assert gap_state(gap, negligible=1e-9, tolerance=1.0, floor=floor) == state


@dataclass(frozen=True)
class Row:
    """A situation, and the verdict on it.

    The parts are those of the gap. `cause` and `place` are the largest cause's share and what goes
    with what was left out on both sides.
    """

    name: str
    answer: Answer
    holds: bool
    state: GapState = "beyond"
    differs: bool = True
    refused: bool = False
    one_engine: bool = False
    explained: float = 0.0
    located: float = 0.0
    unexplained: float = 0.0
    cause: tuple[float, float | None, float | None] | None = None
    place: LocatedPart | None = None

    def facts(self) -> Facts:
        return Facts(
            state=self.state,
            differs=self.differs,
            refused=self.refused,
            one_engine=self.one_engine,
            explained=self.explained,
            located=self.located,
            unexplained=self.unexplained,
            cause=None if self.cause is None else CausePart(*self.cause),
            places=() if self.place is None else (self.place,),
        )


ALL = LocatedPart(1.0)
ROWS = [
    # There is no gap.
    Row("nothing differs, no gap", "rounding", True, "rounding", differs=False),
    Row("no gap although something differs", "alike", True, "rounding"),
    Row("no gap, one engine", "alike", True, "rounding", one_engine=True),
    Row("no gap, something cannot be made the same", "alike", False, "rounding", refused=True),
    Row("within tolerance, perhaps chance", "within", True, "within"),
    Row("within tolerance, one cannot be made the same", "within", False, "within", refused=True),
    # Chaos.
    Row("inside the floor", "inside", False, "inside"),
    Row("inside the floor, one engine", "inside", False, "inside", one_engine=True),
    Row("between once and three times the floor", "cannot be told", False, "cannot be told"),
    # One cause.
    Row("one cause takes all away", "cause", True, explained=1.0, cause=(1.0, 1.0, 1.0)),
    Row(
        *("one cause takes all away, on one engine", "cause", True),
        one_engine=True, explained=1.0, cause=(1.0, 1.0, 1.0),
    ),
    Row(
        *("most is explained, what stays is small", "cause", True),
        explained=0.96, unexplained=0.04, cause=(0.9, 0.9, 0.9),
    ),
    Row(
        *("a tenth stays unexplained", "cause", False),
        explained=0.9, unexplained=0.1, cause=(0.9, 0.9, 0.9),
    ),
    Row(
        *("a cause of a third, the rest stays", "unexplained", False),
        explained=0.33, unexplained=0.67, cause=(0.33, 0.33, 0.33),
    ),
    Row(
        *("alone and last could not be run", "cause", True),
        explained=1.0, cause=(1.0, None, None),
    ),
    # What is left out on both sides.
    Row("engines that touch differently", "located", True, located=1.0, place=ALL),
    Row("one engine touches itself", "one engine", False, located=1.0, one_engine=True, place=ALL),
    Row(
        *("one engine, most of it explained", "cause", False),
        one_engine=True, explained=0.6, located=0.4, cause=(0.6, 0.6, 0.6),
        place=LocatedPart(0.4),
    ),
    Row(
        *("one engine, a trace of it located", "cause", True),
        one_engine=True, explained=0.97, located=0.03, cause=(0.97, 0.97, 0.97),
        place=LocatedPart(0.03),
    ),
    Row(
        *("one engine, one side without contact", "switched", True),
        one_engine=True, located=1.0, place=LocatedPart(1.0, is_switch=True),
    ),
    Row(
        *("two engines, cause and location together", "cause", True),
        explained=0.6, located=0.4, cause=(0.6, 0.6, 0.6), place=LocatedPart(0.4),
    ),
    Row(
        *("two engines, half of it stays", "located", False),
        located=0.5, unexplained=0.5, place=LocatedPart(0.5),
    ),
    Row(
        *("something cannot be made the same", "refused", False),
        refused=True, located=1.0, place=ALL,
    ),
    Row(
        *("the motion goes with it", "still", False),
        located=1.0, place=LocatedPart(1.0, is_still=True),
    ),
    Row(
        *("explained although the rest has no motion", "cause", True),
        explained=0.98, located=0.02, cause=(0.98, 0.98, 0.98),
        place=LocatedPart(0.02, is_still=True),
    ),
    Row(
        *("explained, and one cannot be made the same", "cause", True),
        refused=True, explained=1.0, cause=(1.0, 1.0, 1.0),
    ),
    # Several causes.
    Row(
        *("thirty small causes", "together", True),
        explained=0.96, unexplained=0.04, cause=(0.032, 0.032, 0.032),
    ),
    Row(
        *("thirty small causes, and less by leaving out", "together", True),
        one_engine=True, explained=0.96, located=0.04, cause=(0.032, 0.032, 0.032),
        place=LocatedPart(0.04),
    ),
    Row("no share could be run", "together", True, explained=1.0),
    Row("no share could be run, some stays", "together", False, explained=0.6, unexplained=0.4),
    Row(
        *("causes against one another", "masked", True),
        explained=1.0, cause=(127.0, 127.0, -126.0),
    ),
    Row("it widens the gap alone", "masked", True, explained=1.0, cause=(0.6, -0.1, 1.0)),
    Row(
        *("all causes together widen the gap", "hidden", False),
        explained=-0.25, unexplained=1.25, cause=(0.6, 0.6, 0.6),
    ),
    Row(
        *("wider, and then located", "hidden", False),
        explained=-0.25, located=1.25, cause=(0.6, 0.6, 0.6), place=LocatedPart(1.25),
    ),
    # Nothing.
    Row("nothing takes anything away", "unexplained", False, unexplained=1.0),
    Row(
        *("nothing differs, one engine, and yet they do", "unexplained", False),
        differs=False, one_engine=True, unexplained=1.0,
    ),
]  # fmt: skip


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_verdict_is_that_of_the_table(row: Row) -> None:
    verdict = verdict_of(row.facts())
    assert (verdict.answer, verdict.holds) == (row.answer, row.holds)


def test_no_combination_is_called_an_answer_that_is_none() -> None:
    parts = (-0.3, 0.0, 0.02, 0.5, 0.96, 1.0)
    states: tuple[GapState, ...] = ("rounding", "within", "inside", "cannot be told", "beyond")
    kinds = ((False, False), (True, False), (False, True))  # still, a switch
    causes = [None, CausePart(0.03, 0.03, 0.03), CausePart(0.96, None, 1.0), CausePart(3.0, 0, 0)]
    flags = list(product((False, True), repeat=3))
    met: set[str] = set()
    for state, explained, located, kind, cause, flag in product(
        states, parts, parts[1:], kinds, causes, flags
    ):
        places = (LocatedPart(located, *kind),) if located else ()
        unexplained = 1.0 - explained - located
        if unexplained < 0.0:
            continue
        differs, refused, one_engine = flag
        facts = Facts(
            state, differs, refused, one_engine, explained, located, unexplained, cause, places
        )
        verdict = verdict_of(facts)
        met.add(verdict.answer)
        assert verdict.divides == (state == "beyond")
        if not verdict.holds:
            continue
        assert verdict.answer not in (
            *("inside", "cannot be told", "hidden", "one engine", "refused", "still"),
            "unexplained",
        )
        if verdict.divides and facts.one_engine and not any(p.is_switch for p in facts.places):
            assert abs(1.0 - explained) <= 0.05
    assert met == {row.answer for row in ROWS}
