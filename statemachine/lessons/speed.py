"""The speed budget: how much simulated time does this machine buy?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..backends import load as load_model
from ..engines import room
from ..interface import Data, Model
from ..interface.checks import as_count
from ..measures.text import capital, count, duration
from ..page import Page, Question, Table, Text
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from . import _worlds
from ._words import differences, page_of, sentence, typed
from .in_turns import FEWEST, Ratio, in_turns
from .records import Session
from .session import CodeRun

_ROUNDS = 20
_MOST = 20_000  # steps of a call or a round; between two the progress moves and Ctrl-C is heard
_BULK, _AGAIN, _LOOP, _OWN = "in bulk", "in bulk again", "step by step", "as it comes"


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """The same steps by the clock, both ways, once; or some worlds of one Model."""
    if options.get("worlds"):
        return _worlds.code(load)
    steps = as_count(options["steps"], "steps")
    whole, rest = divmod(steps, _MOST)
    bulk = f"[{steps}]" if not whole else f"[{_MOST}] * {whole}" + f" + [{rest}]" * bool(rest)
    return f"""\
import time
import statemachine as sm

model = {load}

def start(model):
    data = sm.make_data(model)
    if model.keyframes:
        sm.reset(model, data, keyframe=0)
    return data

def wall(model, data, calls):
    began = time.perf_counter()
    for nstep in calls:
        sm.step(model, data, nstep)
    return time.perf_counter() - began

for name, seconds in (
    ("in bulk", wall(model, start(model), {bulk})),
    ("step by step", wall(model, start(model), [1] * {steps})),
):
    factor = {steps} * model.timestep / seconds
    print(f"{{name}}: {{seconds:.3f}} s, {{factor:.0f}} times real time")
"""


@dataclass(frozen=True)
class Speed:
    """Wall-clock times of the same simulated time, its rounds taken in turns.

    Attributes:
        nstep: Steps of each run; simulated: their simulated time [s].
        bulk: Wall time of `step(model, data, n)`, once a round [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
        loop: Cost of single calls over that of one call, round by round.
        null: Cost of one call over that of the same call once more: the noise.
        bulk_rounds: Wall time of each round in bulk [s].
    """

    nstep: int
    simulated: float
    bulk: float
    one_by_one: float
    as_it_comes: float | None
    loop: Ratio
    null: Ratio
    bulk_rounds: tuple[float, ...]
    provenance: Provenance

    @property
    def bulk_factor(self) -> float:
        """Simulated over wall time, in bulk."""
        return self.simulated / self.bulk

    @property
    def one_by_one_factor(self) -> float:
        """Simulated over wall time, step by step."""
        return self.simulated / self.one_by_one

    @property
    def told_apart(self) -> bool:
        """Whether single calls and one call differ by more than the noise."""
        return self.loop.differs_from(self.null)


def run(
    play: CodeRun, options: Mapping[str, Any], progress: Progress
) -> Speed | _worlds.WorldsSpeed:
    """Measure the same steps again with the code's own functions, in rounds, the ways in turns."""
    if options.get("worlds"):
        return _worlds.run(play, progress)
    model, total = play.model, options["steps"]
    names = play()
    size = max(1, min(total // _ROUNDS, _MOST))
    rounds = [size] * (total // size) + [total % size] * bool(total % size)
    models = {_BULK: model, _AGAIN: model, _LOOP: model}
    if room(model.backend).emulated:
        as_it_comes = load_model(model.path, backend=model.backend, defaults="engine")
        models[_OWN] = as_it_comes.replace(gravity=model.gravity, timestep=model.timestep)
    ways = {
        name: _way(names["wall"], each, names["start"](each), rounds, bulk=name != _LOOP)
        for name, each in models.items()
    }
    walls = in_turns(ways, len(rounds), progress)
    return Speed(
        nstep=total,
        simulated=total * model.timestep,
        bulk=sum(walls[_BULK]),
        one_by_one=sum(walls[_LOOP]),
        as_it_comes=sum(walls[_OWN]) if _OWN in walls else None,
        loop=Ratio.of(_LOOP, walls[_LOOP], walls[_BULK]),
        null=Ratio.of(_AGAIN, walls[_AGAIN], walls[_BULK]),
        bulk_rounds=tuple(walls[_BULK]),
        provenance=provenance(model),
    )


def _way(
    wall: Callable[..., float], model: Model, data: Data, rounds: Sequence[int], bulk: bool
) -> Callable[[], None]:
    """What takes a Data through the rounds, one at each call: together they are one run."""
    remaining = iter(rounds)

    def advance() -> None:
        size = next(remaining)
        wall(model, data, [size] if bulk else [1] * size)

    return advance


def page(results: Mapping[str, Any], session: Session) -> Page:
    """Times and factors; they are this machine's, now."""
    first = next(iter(results.values()))
    if isinstance(first, _worlds.WorldsSpeed):
        return _worlds.page(results, session)
    blocks: list[Any] = [
        Text(
            f"{first.simulated:g} simulated seconds, {count(first.nstep, 'step')} of "
            f"{first.provenance.timestep:g} s, as fast as possible. In bulk: one call for many "
            "steps. Step by step: a Python loop of single calls, as a controller needs it. How "
            "much an experiment may cost follows from the ratio of simulated to real time."
        ),
        *typed(session, _question(first)),
        Text(
            "One measurement says little: something else may have run on this machine meanwhile. "
            f"So the same steps are measured again in {count(first.loop.rounds, 'round')}. Each "
            "round measures both ways, and the bulk way a second time. How much the two bulk "
            "measurements differ is the noise; smaller differences cannot be seen here."
        ),
    ]
    rows = [
        ("in bulk", *(_cell(r.bulk, r.bulk_factor) for r in results.values())),
        ("step by step", *(_cell(r.one_by_one, r.one_by_one_factor) for r in results.values())),
        (
            "one step, in bulk",
            *(f"{r.bulk / r.nstep * 1e6:.1f} µs" for r in results.values()),
        ),
    ]
    emulated = any(r.as_it_comes is not None for r in results.values())
    if emulated:
        rows.append(("in bulk, as the engine comes", *(_own(r) for r in results.values())))
    blocks += [
        Table(("", *results), rows, title="Wall time, and × real time, on this machine, now"),
        Table(
            ("", *results),
            [
                ("step by step", *(r.loop.spread() for r in results.values())),
                ("in bulk again", *(r.null.spread() for r in results.values())),
            ],
            title="Cost relative to bulk: median of the rounds, and their middle half",
        ),
        *(sentence(results, name, _told(result)) for name, result in results.items()),
    ]
    if emulated:
        blocks.append(
            Text(
                "As the engine comes: driven by its own position control, without the model's "
                "servo, armature and friction, which the other rows emulate."
            )
        )
    blocks += differences(results, [("time of a step, in bulk", _against)])
    return page_of("The speed budget", results, blocks)


def _question(first: Speed) -> Question:
    slower = first.told_apart and first.loop.median > 1
    return Question(
        "how much longer does a Python loop with one call a step take than one call for all steps?",
        ("no longer, as far as can be told here", "longer, up to twice as long", "more than twice"),
        0 if not slower else 1 if first.loop.median <= 2 else 2,
        capital(_told(first)),
    )


def _told(result: Speed) -> str:
    """Whether the two ways can be told apart, in a sentence."""
    if result.told_apart:
        text = f"step by step takes {result.loop.median:.2f} times as long as in bulk"
    else:
        text = "step by step and in bulk cannot be told apart here: "
        text += (
            "the bulk way differs from itself by as much"
            if result.loop.rounds >= FEWEST
            else f"{count(result.loop.rounds, 'round')} cannot tell"
        )
    return f"{text}. In bulk, a step takes {duration(result.bulk / result.nstep)}."


def _against(one: Speed, two: Speed) -> str:
    """How much longer a step takes on another engine; the engines were measured one by one."""
    ratio = Ratio.of("", two.bulk_rounds, one.bulk_rounds)
    if not (ratio.differs_from(one.null) and ratio.differs_from(two.null)):
        return "cannot be told apart here"
    return ratio.spread(" ×", 1)


def _own(result: Speed) -> str:
    if result.as_it_comes is None:
        return "the same"
    return _cell(result.as_it_comes, result.simulated / result.as_it_comes)


def _cell(wall: float, factor: float) -> str:
    return f"{wall:.3f} s, {factor:.0f} × real time"
