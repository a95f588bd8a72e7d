"""What to ask after a comparison: a command that can be typed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from ...measures import QUANTITIES
from ..compare.instead import Instead
from ..compare.sides import Request, Side
from ..compare.typed_command import typed_command
from ..runs.call_period import CallPeriods
from ..runs.scenarios import SCENARIOS
from .compared_names import name_of
from .finding import Finding

_OTHER = "waves"  # moves whatever has an actuator
_STEPS = ("timestep", "substeps")

# What the command is for: it tells which difference causes the gap; the same until before a run
# ended; it gives a side the parts or the base that the other has; it calls a function as often on
# both sides; it tells which stage of one step differs, which chance cannot hide; it tells whether a
# gap vanishes with the timestep, where nothing else differs; it runs something that moves more;
# there is none to type.
Purpose = Literal[
    "why",
    "why until then",
    "same parts",
    "same base",
    "same period",
    "one step",
    "converge",
    "move more",
    "move at all",
    "nothing",
]


@dataclass(frozen=True)
class NextCommand:
    """What to type next.

    Attributes:
        purpose: What it is for.
        text: The command, in lines; "" for none.
        short_text: The same where lines are few: the quantity is left to the command.
    """

    purpose: Purpose
    text: str = ""
    short_text: str = ""


def next_command(
    request: Request,
    finding: Finding,
    instead: Instead | None,
    periods: CallPeriods | None = None,
) -> NextCommand:
    """Return what to type after a comparison.

    Args:
        request: What was run.
        finding: What came of it.
        instead: What moves the model where nothing moved; None where that was not looked for.
        periods: How often a function is called on each side; None where none is run.
    """
    match finding.outcome:
        case "nothing moved":
            return _moving(request, instead)
        case "ended":
            return _until_then(request, finding)
        case "agrees":
            return _more(request, finding)
    same = _same_on_both(request, finding, periods)
    if same is not None:
        return same
    can_step = not request.is_traces or bool(request.sides)
    moves = QUANTITIES[finding.lead.kind].moves
    if can_step and (finding.rounding.verdict in ("as much", "no bound") or not moves):
        return _as_it_is("one step", request, "--one-step")
    if not moves:
        return NextCommand("nothing")
    if _only_timesteps_differ(request):
        return _as_it_is("converge", request, "--converge")
    command = typed_command(request)
    text = command.lines("--why", "--quantity", name_of(finding.lead.name))
    return NextCommand("why", text, command.lines("--why"))


def _same_on_both(
    request: Request, finding: Finding, periods: CallPeriods | None
) -> NextCommand | None:
    """Return the comparison with the same base, parts or period on both sides; None if they are."""
    if finding.bases.differ:
        return _same_base(request, finding)
    if finding.missing:
        parts: list[str] = []
        for missing in finding.missing:
            parts += [f"--{missing.part}", missing.other_side]
        return _as_it_is("same parts", request, *parts)
    if periods is not None and periods.differ:
        return _same_period(request, periods)
    return None


def _only_timesteps_differ(request: Request) -> bool:
    """Tell whether both sides are one file on one engine, and the timesteps are what differs."""
    if request.is_traces or len(request.sides) != 2:
        return False
    left, right = request.sides
    return left != right and _without_steps(left) == _without_steps(right)


def _without_steps(side: Side) -> Side:
    """Return a side without what it says of its timestep."""
    others = {name: value for name, value in side.options.items() if name not in _STEPS}
    return replace(side, options=others)


def _moving(request: Request, instead: Instead | None) -> NextCommand:
    """Return an experiment that moves what this one does not."""
    if instead is None or not instead.experiment or request.is_traces:
        return NextCommand("nothing")
    return _instead(request, "move at all", instead.experiment)


def _same_base(request: Request, finding: Finding) -> NextCommand:
    """Return the comparison with one base on both sides, where a file leaves its own open."""
    bases = (finding.bases.right, finding.bases.left)  # each gets that of the other
    for k, (side, base) in enumerate(zip(request.sides, bases, strict=False)):
        if base is not None and side.model.lower().endswith(".urdf"):
            sides = list(request.sides)
            sides[k] = replace(side, options={**side.options, "base": base})
            same = replace(request, sides=tuple(sides))
            return _as_it_is("same base", same)
    return NextCommand("nothing")


def _same_period(request: Request, periods: CallPeriods) -> NextCommand:
    """Return the comparison with a function that is called as often on both sides."""
    return _as_it_is("same period", replace(request, every=periods.common_word))


def _until_then(request: Request, finding: Finding) -> NextCommand:
    """Return the search for causes until before the first run ended."""
    end = min(early_end.time for early_end in finding.ended)
    seconds = math.floor(900 * end) / 1000
    if request.is_traces or seconds <= 0:
        return NextCommand("nothing")
    return _as_it_is("why until then", replace(request, seconds=seconds), "--why")


def _more(request: Request, finding: Finding) -> NextCommand:
    """Return an experiment that moves more, where this is one of ours."""
    what = request.what[0]
    if what not in SCENARIOS or what == _OTHER or finding.open_loop == "differs":
        return NextCommand("nothing")
    return _instead(request, "move more", _OTHER)


def _instead(request: Request, purpose: Purpose, experiment: str) -> NextCommand:
    """Return the command of a comparison with another experiment, for its own time."""
    return _as_it_is(purpose, replace(request, what=(experiment,), every=1, seconds=None))


def _as_it_is(purpose: Purpose, request: Request, *question: str) -> NextCommand:
    """Return the command of a comparison, with a question behind it."""
    text = typed_command(request).lines(*question)
    return NextCommand(purpose, text, text)
