"""What the lesson measures of many worlds, on clocks and memories that are written down here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import statemachine as sm
from statemachine.course.lessons import _many_worlds as many_worlds
from statemachine.course.lessons._many_worlds import ManyWorlds, measured
from statemachine.errors import ClosedDataError
from statemachine.lab.runs.drive import Progress

from .support.small_models import loaded

PENDULUM = '<body><joint axis="0 1 0"/><geom size=".05" pos="0 0 -.3" mass="1"/></body>'
SMALL = '<size memory="100K"/>'  # so that two hundred Data are made at once
KEYFRAME = '<keyframe><key qpos="0.3"/></keyframe>'
OF_ONE = [2.0, 1.0, 4.0, 3.0, 5.0]  # [s] of the rounds of one Data
OF_WORLDS = [1.0, 1.0, 1.0, 2.0, 2.0]  # [s] of those of the worlds


class Scripted:
    """A lesson whose clocks and whose memory say what is written down here.

    Attributes:
        single: What twenty steps of one Data are said to take [s].
        memory: What memory is said to be held, look after look [bytes]; 0 at the end.
        stepped: Of how many worlds and how often each call stepped, 0 worlds for a Data.
        places: Of the first coordinate when worlds, or a Data, are stepped in a round.
        made: The Data that were made.
        workers: With how many threads worlds were made, None for the usual number.
        told: The fractions that were told.
    """

    def __init__(self, patch: pytest.MonkeyPatch, single: float = 0.008) -> None:
        self.single = single
        self.memory: list[int] = []
        self.stepped: list[tuple[int, int]] = []
        self.places: list[float] = []
        self.made: list[sm.Data] = []
        self.workers: list[int | None] = []
        self.told: list[float] = []
        self._make_data, self._make_worlds = many_worlds.make_data, many_worlds.make_worlds
        clock: Iterator[float] = iter(k * 1.5 for k in range(1000))
        patch.setattr(many_worlds, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
        patch.setattr(many_worlds, "make_data", self._made_data)
        patch.setattr(many_worlds, "make_worlds", self._made_worlds)
        patch.setattr(many_worlds, "step", self._step)
        patch.setattr(many_worlds, "step_data", self._step_data)
        patch.setattr(many_worlds, "time_interleaved", self._time)
        patch.setattr(many_worlds, "resident_memory", self._memory)

    def _made_data(self, model: sm.Model) -> sm.Data:
        self.made.append(self._make_data(model))
        return self.made[-1]

    def _made_worlds(self, model: sm.Model, n: int, workers: int | None = None) -> Any:
        self.workers.append(workers)
        return self._make_worlds(model, n, workers=workers)

    def _step(self, worlds: Any, nstep: int = 1) -> None:
        self.stepped.append((len(worlds.qpos), nstep))
        self.places.append(float(worlds.qpos[-1, 0]))

    def _step_data(self, _model: sm.Model, data: sm.Data, nstep: int = 1) -> None:
        self.stepped.append((0, nstep))
        self.places.append(float(data.qpos[0]))

    def _time(
        self,
        ways: Mapping[str, Callable[[], object]],
        rounds: int,
        progress: Progress = lambda _: None,
    ) -> dict[str, list[float]]:
        for call in ways.values():
            call()
        progress(0.5)
        progress(1.0)
        if len(ways) == 1:
            assert rounds == 1
            return {way: [self.single] for way in ways}
        assert rounds == len(OF_ONE)
        return {"worlds": OF_WORLDS, "one": OF_ONE}

    def _memory(self) -> int:
        return self.memory.pop(0) if self.memory else 0

    def measured(self, model: sm.Model, most: int) -> ManyWorlds:
        """Return what the lesson measures."""
        return measured(model, most, self.told.append)


@pytest.fixture
def model(tmp_path: Path) -> sm.Model:
    """Return a pendulum with a keyframe."""
    return loaded(tmp_path, PENDULUM, KEYFRAME, option=SMALL)


@pytest.fixture
def scripted(monkeypatch: pytest.MonkeyPatch) -> Scripted:
    """Return a lesson whose clock says that twenty steps take 8 ms."""
    return Scripted(monkeypatch)


@pytest.mark.parametrize(
    ("most", "sizes"), [(1, [1]), (3, [1]), (4, [1, 4]), (20, [1, 4, 16]), (64, [1, 4, 16, 64])]
)
def test_each_number_of_worlds_is_four_times_the_one_before(
    most: int, sizes: Sequence[int], model: sm.Model, scripted: Scripted
) -> None:
    assert [cost.n for cost in scripted.measured(model, most).costs] == sizes


def test_one_data_takes_as_many_steps_as_fit_into_a_round(
    model: sm.Model, scripted: Scripted
) -> None:
    scripted.measured(model, 16)
    rounds = scripted.stepped[-9:]  # of 1, 4 and 16 worlds: twenty steps, and a call of each way
    # 40 ms of 0.4 ms a step, which 16 worlds share out by six steps each.
    assert rounds == [
        (0, 20),
        (1, 100),
        (0, 100),
        (0, 20),
        (4, 25),
        (0, 100),
        (0, 20),
        (16, 6),
        (0, 100),
    ]


@pytest.mark.parametrize(("single", "steps"), [(0.8, 1), (8.0, 1), (0.02, 40), (0.0, 400_000)])
def test_a_slow_model_takes_a_step_a_round_and_a_fast_one_not_too_many(
    single: float, steps: int, model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    scripted = Scripted(monkeypatch, single)
    scripted.measured(model, 1)
    assert scripted.stepped[-2:] == [(1, steps), (0, steps)]


def test_worlds_take_a_step_at_least(model: sm.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    scripted = Scripted(monkeypatch, 0.8)
    scripted.measured(model, 4)
    assert scripted.stepped[-2:] == [(4, 1), (0, 1)]


def test_the_cost_of_a_step_of_a_world_is_the_median_of_the_rounds(
    model: sm.Model, scripted: Scripted
) -> None:
    one, four = scripted.measured(model, 4).costs
    assert one.step == pytest.approx(1.0 / 100)
    assert four.step == pytest.approx(1.0 / (4 * 25))


def test_worlds_are_faster_by_the_median_ratio_to_one_data(
    model: sm.Model, scripted: Scripted
) -> None:
    one, _, sixteen = scripted.measured(model, 16).costs
    # Ratios of the rounds: 2, 1, 4, 1.5 and 2.5; for 16 worlds a round has 96 steps, not 100.
    assert one.faster.median == pytest.approx(2.0)
    assert sixteen.faster.median == pytest.approx(2.0 * 96 / 100)
    assert (one.faster.rounds, one.faster.low, one.faster.high) == (5, 1.25, 3.25)


def test_making_worlds_is_timed(model: sm.Model, scripted: Scripted) -> None:
    assert [cost.made for cost in scripted.measured(model, 4).costs] == [1.5, 1.5]


def test_worlds_have_the_usual_threads_but_where_their_memory_is_measured(
    model: sm.Model, scripted: Scripted
) -> None:
    result = scripted.measured(model, 4)
    assert scripted.workers == [1, 1, None, None]
    assert all(1 <= cost.workers <= cost.n for cost in result.costs)


def test_worlds_and_the_data_beside_them_begin_at_the_keyframe(
    model: sm.Model, scripted: Scripted
) -> None:
    scripted.measured(model, 4)
    assert set(scripted.places[-6:]) == {0.3}


def test_without_a_keyframe_they_begin_where_a_new_data_is(
    tmp_path: Path, scripted: Scripted
) -> None:
    scripted.measured(loaded(tmp_path, PENDULUM, option=SMALL), 4)
    assert set(scripted.places) == {0.0}


def test_the_fraction_that_is_done_is_told(model: sm.Model, scripted: Scripted) -> None:
    scripted.measured(model, 16)
    assert scripted.told == pytest.approx([1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1])


def test_memory_is_shared_out_among_what_was_made(model: sm.Model, scripted: Scripted) -> None:
    # Before and after one world, 16 worlds, and 200 Data.
    scripted.memory = [10, 9_000, 20_000, 20_000 + 16 * 30, 50_000, 50_000 + 200 * 7]
    result = scripted.measured(model, 16)
    assert (result.world_bytes, result.data_bytes) == (30, 7)
    assert (result.shared, result.free_bytes) == (True, None)
    assert len(scripted.made) == 200


@pytest.mark.parametrize("memory", [[5, 5] * 3, [9, 5] * 3, [0, 5] * 3, []])
def test_memory_that_does_not_grow_or_is_not_told_is_unknown(
    memory: list[int], model: sm.Model, scripted: Scripted
) -> None:
    scripted.memory = memory
    result = scripted.measured(model, 4)
    assert (result.world_bytes, result.data_bytes) == (None, None)


def test_all_worlds_and_each_data_are_stepped_before_their_memory_is_looked_at(
    model: sm.Model, scripted: Scripted
) -> None:
    scripted.measured(model, 4)
    assert scripted.stepped[:202] == [(1, 1), (4, 1), *[(0, 1)] * 200]


def test_every_data_is_closed(model: sm.Model, scripted: Scripted) -> None:
    scripted.measured(model, 1)
    for data in scripted.made:
        with pytest.raises(ClosedDataError):
            sm.step(model, data)


# Each world with an engine's own.


@pytest.fixture
def apart(model: sm.Model, tmp_path: Path) -> sm.Model:
    """Return a Model of an engine that shares nothing."""
    return loaded(tmp_path, PENDULUM, name="apart.xml", backend="pybullet")


@pytest.mark.parametrize(
    ("free", "most", "sizes", "is_told"),
    [
        (None, 2, [1], False),
        (2 * 3 * 100, 2, [1], False),
        (2 * 3 * 100 - 1, 2, [1], True),
        (4 * 3 * 100, 4, [1, 4], False),
        (4 * 3 * 100 - 1, 4, [1], True),
        (10, 4, [1], True),
    ],
)
def test_worlds_that_are_apart_are_as_many_as_fit_into_a_third_of_the_memory(
    free: int | None,
    most: int,
    sizes: list[int],
    is_told: bool,
    apart: sm.Model,
    scripted: Scripted,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scripted.memory = [1000, 1000 + 2 * 100]  # of two Data
    monkeypatch.setattr(many_worlds, "free_memory", lambda: free)
    result = scripted.measured(apart, most)
    assert (result.shared, result.data_bytes, result.world_bytes) == (False, 100, 100)
    assert [cost.n for cost in result.costs] == sizes
    assert result.free_bytes == (free if is_told else None)
