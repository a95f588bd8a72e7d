"""What a Python loop of single steps costs beside one call for all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from ...backends import load as load_model
from ...engines import raw_engine_of
from ...errors import UnsupportedError
from ...interface import Data, Model, make_data, reset, step
from ...lab.runs.drive import Progress
from ...lab.runs.interleaved_timing import Ratio, time_interleaved
from ...show.blocks import Block
from ...show.engine_tables import by_engine, differences
from ...show.labels import TableLabels

ROUNDS = 20
_BULK, _AGAIN, _LOOP, _OWN = "in bulk", "in bulk again", "step by step", "as it comes"
_TWICE = 2  # times as long; a choice of the question ends there


@dataclass(frozen=True)
class LoopCost:
    """Wall times of one run of some steps, taken in several ways, in rounds.

    Attributes:
        nstep: Steps of the run.
        simulated: Their simulated time [s].
        bulk: Wall time of `step(model, data, n)`, once a round [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
        loop: Cost of single calls over that of one call, round by round.
        null: Cost of one call over that of the same call once more: the noise.
        told_apart: Whether the two differ by more than the noise.
        bulk_rounds: Wall time of each round in bulk [s].
    """

    nstep: int
    simulated: float
    bulk: float
    one_by_one: float
    as_it_comes: float | None
    loop: Ratio
    null: Ratio
    told_apart: bool
    bulk_rounds: tuple[float, ...]


def measured(model: Model, steps: int, progress: Progress) -> LoopCost:
    """Take the same steps in each way, in rounds, the ways in turns.

    Args:
        model: The Model to step.
        steps: Number of steps of each way.
        progress: Told the fraction that is done.
    """
    rounds = rounds_of(steps)
    models = {_BULK: model, _AGAIN: model, _LOOP: model}
    if raw_engine_of(model.backend).emulated:
        with suppress(UnsupportedError):  # the engine as it comes has not all that a model may have
            as_it_comes = load_model(model.path, backend=model.backend, defaults="engine")
            models[_OWN] = as_it_comes.replace(gravity=model.gravity, timestep=model.timestep)
    ways: dict[str, Callable[[], None]] = {}
    for name, variant in models.items():
        ways[name] = _way(variant, _started(variant), rounds, bulk=name != _LOOP)
    walls = time_interleaved(ways, len(rounds), progress)
    seconds = {name: sum(times) for name, times in walls.items()}
    bulk_rounds = tuple(walls[_BULK])
    loop = Ratio.of(_LOOP, walls[_LOOP], bulk_rounds)
    null = Ratio.of(_AGAIN, walls[_AGAIN], bulk_rounds)
    return LoopCost(
        nstep=steps,
        simulated=steps * model.timestep,
        bulk=seconds[_BULK],
        one_by_one=seconds[_LOOP],
        as_it_comes=seconds.get(_OWN),
        loop=loop,
        null=null,
        told_apart=loop.differs_from(null),
        bulk_rounds=bulk_rounds,
    )


def rounds_of(steps: int) -> list[int]:
    """Divide steps into rounds of one size, and one for the rest."""
    size = max(1, steps // ROUNDS)
    full, rest = divmod(steps, size)
    rounds = [size] * full
    if rest:
        rounds.append(rest)
    return rounds


def _started(model: Model) -> Data:
    """Return a new Data, at the first keyframe where the file names one."""
    data = make_data(model)
    if model.keyframes:
        reset(model, data, keyframe=0)
    return data


def _way(model: Model, data: Data, rounds: Sequence[int], bulk: bool) -> Callable[[], None]:
    """Return what takes a Data through the rounds, one at each call: together they are one run.

    Args:
        model: The Model to step.
        data: A Data of it.
        rounds: Steps of each round.
        bulk: Whether a round is one call, and not one for each of its steps.
    """
    remaining = iter(rounds)

    def take_round() -> None:
        nstep = next(remaining)
        if bulk:
            step(model, data, nstep)
            return
        for _ in range(nstep):
            step(model, data)

    return take_round


def is_undecided(cost: LoopCost) -> bool:
    """Tell whether the rounds do not tell how much longer a loop takes."""
    return not cost.told_apart or cost.loop.low <= _TWICE <= cost.loop.high


def right_choice(cost: LoopCost) -> int:
    """Return the number of the right choice: no longer, up to twice as long, or longer."""
    if cost.loop.median <= 1:
        return 0
    return 1 if cost.loop.median <= _TWICE else 2


def loop_tables(results: Mapping[str, LoopCost], say: TableLabels) -> list[Block]:
    """Show times and factors; they are this machine's, now.

    Args:
        results: By backend.
        say: The words of the lesson.
    """
    relative: dict[str, Callable[[LoopCost], str]] = {
        say("one_by_one"): lambda cost: cost.loop.spread(),
        say("bulk_again"): lambda cost: cost.null.spread(),
    }
    against: dict[str, Callable[[LoopCost, LoopCost], str]] = {
        say("step_in_bulk"): lambda left, right: _against(left, right, say),
    }
    return [
        _times(results, say),
        by_engine(results, relative, say("relative")),
        *differences(results, against),
    ]


def _times(results: Mapping[str, LoopCost], say: TableLabels) -> Block:
    """Return the wall time of each way by engine."""
    rows: dict[str, Callable[[LoopCost], str]] = {}
    rows[say("in_bulk")] = lambda cost: _by_the_clock(cost, cost.bulk)
    rows[say("one_by_one")] = lambda cost: _by_the_clock(cost, cost.one_by_one)
    rows[say("one_step")] = lambda cost: f"{cost.bulk / cost.nstep * 1e6:.1f} µs"
    if any(cost.as_it_comes is not None for cost in results.values()):
        rows[say("own_bulk")] = lambda cost: _as_it_comes(cost, say)
    return by_engine(results, rows, say("times"))


def _as_it_comes(cost: LoopCost, say: TableLabels) -> str:
    """Write the wall time of the engine as it comes."""
    if cost.as_it_comes is None:
        return say("own_same")
    return _by_the_clock(cost, cost.as_it_comes)


def _by_the_clock(cost: LoopCost, wall: float) -> str:
    """Write a wall time [s], and how much faster that is than real time."""
    return f"{wall:.3f} s, {cost.simulated / wall:.0f} × real time"


def _against(left: LoopCost, right: LoopCost, say: TableLabels) -> str:
    """Write how much longer a step takes on another engine.

    The engines were measured one after the other, and not in turns.
    """
    if len(left.bulk_rounds) != len(right.bulk_rounds):
        return say("not_told_apart")
    ratio = Ratio.of("", right.bulk_rounds, left.bulk_rounds)
    if not (ratio.differs_from(left.null) and ratio.differs_from(right.null)):
        return say("not_told_apart")
    return ratio.spread(" ×", 1)
