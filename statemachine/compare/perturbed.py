"""The same side run again, changed by next to nothing; and the chaos floor that this makes.

After a grazing contact two runs that differ by rounding part exponentially. So one side is run
again with its start and commands perturbed, and what that makes of each quantity is its floor: the
band of a gap in which nothing can be concluded.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import BadInputError, EngineWarning, TraceError, refuse
from ..interface import Array, Data, Ints, JointType, Model
from ..measures import amount, common_moments
from ..page import Figures
from ..rotations import times
from ..runs import Rerun, Trace, beginning_with
from ..runs.drive import Progress, part_of, silent
from ..runs.scenarios import Controller
from .agreement import Agreement, Comparison
from .series import series, touches

RUNS = 4
ROUNDING = 1e-12  # of a value, or of 1 where it is less; some thousand times that of a float64


@dataclass(frozen=True)
class Uncertainty:
    """What is not known of the start of a real robot.

    Attributes:
        length: Of the position of a slide or a free body [m].
        angle: Of a hinge, and of the rotation of a free body or a ball [rad].
    """

    length: float = 0.0
    angle: float = 0.0


EXACT = Uncertainty()


def parse_uncertainty(words: Iterable[str]) -> Uncertainty:
    """What words like "0.1mm" and "0.1deg" say.

    Raises:
        BadInputError: A word is invalid, or a length or an angle is given twice.
    """
    sizes: dict[str, float] = {}
    for word in words:
        value, unit = amount(word)
        kind = {"m": "length", "rad": "angle"}.get(unit, "")
        refuse(
            (
                not kind or np.isnan(value),
                f"an uncertainty reads like 0.1mm or 0.1deg; got {word!r}",
            ),
            (kind in sizes, f"the {kind} that is uncertain is given twice: {word!r}"),
        )
        sizes[kind] = value
    return Uncertainty(**sizes)


def perturbed_runs(
    rerun: Rerun,
    *,
    runs: int = RUNS,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = silent,
) -> Iterator[Trace]:
    """The same run, again and again, from starts and with commands that differ by rounding.

    Positions, velocities and commands change by at most 1e-12 of themselves (of 1 where they
    are less), drawn anew for each run and each command. A quaternion is turned by such an
    angle, and stays one. Where the start is uncertain by more, each coordinate of it is
    displaced by all of that, to a side that is drawn, and in the next run to the other side:
    the corners of what is possible.

    Args:
        rerun: The run.
        runs: How many, at least 1.
        seed: Of what is drawn.
        uncertain: What is not known of the start.
        derive: Whether the traces tell what the engine derives, too.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `runs` is less than 1, or the seed is negative.
    """
    if runs < 1:
        raise BadInputError(f"the chaos floor wants at least one run; got {runs}")
    for k in range(runs):
        yield perturbed_run(
            rerun,
            k,
            seed=seed,
            uncertain=uncertain,
            derive=derive,
            progress=part_of(progress, k / runs, 1 / runs),
        )


def perturbed_run(
    rerun: Rerun,
    k: int,
    *,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = silent,
) -> Trace:
    """The run with the number `k` of `perturbed_runs`, which depends on no other."""
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    draw = np.random.default_rng([seed, k])
    qpos, qvel = rerun.start()
    # At a corner of what is possible; of two runs one is opposite to the other.
    corner, side = np.random.default_rng([seed, k // 2]), -1.0 if k % 2 else 1.0
    qpos = displaced(
        rerun.model, qpos, uncertain, corner,
        lambda: side * float(corner.choice((-1.0, 1.0))), lambda: side,
    )  # fmt: skip
    controller = nudged_controller(rerun.controller(rerun.model), draw)
    qpos, qvel = nudged_start(rerun.model, qpos, qvel, draw)
    # What an engine warns of, and what is wrong with the start, is told of the run itself.
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return rerun.record(
            controller=controller,
            qpos=qpos,
            qvel=qvel,
            derive=derive,
            progress=progress,
        )


def displaced(
    model: Model,
    qpos: Array,
    size: Uncertainty,
    draw: np.random.Generator,
    along: Callable[[], float],
    far: Callable[[], float],
) -> Array:
    """A start (nq,) away from another one.

    Args:
        model: Whose joints they are.
        qpos: (nq,) the other one.
        size: How far away.
        draw: Of the directions of free bodies and rotations.
        along: Gives what share of it a hinge or a slide moves, with its sign.
        far: Gives what share of it a free body or a rotation does.
    """
    qpos = qpos.copy()
    for kind, place in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        if kind in (JointType.HINGE, JointType.SLIDE):
            qpos[place] += (size.angle if kind == JointType.HINGE else size.length) * along()
            continue
        if kind == JointType.FREE:
            qpos[place : place + 3] += size.length * far() * direction(draw)
        turn(qpos[place + JointType(kind).nq - 4 :][:4], size.angle * far() * direction(draw))
    return qpos


def nudged_start(
    model: Model, qpos: Array, qvel: Array, draw: np.random.Generator
) -> tuple[Array, Array]:
    """Positions (nq,) and velocities (nv,) changed by rounding; a quaternion stays one."""
    nudged = _nudged(qpos, draw)
    for _, place in model._quaternions:
        nudged[place : place + 4] = qpos[place : place + 4]
        turn(nudged[place : place + 4], ROUNDING * direction(draw))
    return nudged, _nudged(qvel, draw)


def turn(quat: Array, by: Array) -> None:
    """Turn a quaternion (4,), in place, by a vector (3,) along the axis, as long as the angle."""
    angle = float(np.linalg.norm(by))
    if angle:
        half = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * by / angle)])
        turned = times(half, quat)
        quat[:] = turned / np.linalg.norm(turned)


def direction(draw: np.random.Generator) -> Array:
    """A unit vector (3,), every direction as likely as any other."""
    vector = draw.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _nudged(values: Array, draw: np.random.Generator) -> Array:
    """Values (n,) changed by rounding; what is not finite stays."""
    finite = np.where(np.isfinite(values), values, 0.0)
    return values + ROUNDING * np.maximum(1.0, np.abs(finite)) * draw.uniform(-1, 1, len(values))


def nudged_controller(controller: Controller | None, draw: np.random.Generator) -> Controller:
    """A controller whose commands differ by rounding, and what is commanded without one."""

    def nudging(time: float, data: Data) -> Any:
        ctrl = None if controller is None else controller(time, data)
        return None if ctrl is None else _nudged(np.asarray(ctrl, dtype=np.float64), draw)

    # Once: a ctrl that stays as it is must not wander.
    return beginning_with(lambda data: _nudged(data.ctrl, draw), nudging)


_WINDOW = 0.025  # of the common time, to either side


def chaos_floor(
    comparison: Comparison,
    rerun: Rerun,
    *,
    runs: int = RUNS,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    progress: Progress = silent,
) -> Figures:
    """The chaos floor of each quantity of a comparison.

    The band at a moment is the largest distance of a perturbed run from the left one, within 2.5 %
    of the common time before and after it. It is not a running maximum: a robot whose servos pull
    it back forgets where it started, and a gap that remains then is a difference although an
    impact in between was chaotic. And it is not of the moment alone: all perturbed runs part along
    the one direction that grows fastest, so that they cross the left one at the same time, and an
    impact that comes a step later is a spike in each of two places.

    Args:
        comparison: Of two traces, of which `rerun` makes the left one.
        rerun: How the left side is run.
        runs: How many perturbed runs.
        seed: Of what is drawn.
        uncertain: What the start of a real robot is uncertain by.
        progress: Told the fraction that is done.

    Returns:
        What was found, by name.

        - runs: How many perturbed runs of the left side it is made of; seed: of what was drawn.
        - rounding: What starts and commands were changed by, relative.
        - uncertain: What the start is uncertain by besides.
        - ended: How many of the runs ended early; from then on the band has no bound.
        - bands: One for each quantity that is compared; see `_band`.

    Raises:
        BadInputError: As `perturbed_runs`.
    """
    left, right = comparison.left.trace, comparison.right.trace
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    gaps = {curve.name: curve.difference for curve in comparison.curves}
    gaps |= {a.name: np.array([a.max]) for a in comparison.agreements if a.kind == "contact"}
    widths = {name: np.zeros(len(gap)) for name, gap in gaps.items()}
    ended = 0
    for trace in perturbed_runs(
        rerun, runs=runs, seed=seed, uncertain=uncertain, progress=progress
    ):
        ended += bool(trace.header.ended)
        far_apart = _distances(left, trace, comparison.tip, comparison.until, common.left)
        for name, far in far_apart.items():
            if name in widths:
                widths[name] = np.maximum(widths[name], far)
    reach = round(_WINDOW * (len(common.time) - 1))
    bands = []
    for agreement in comparison.agreements:
        width, time = widths[agreement.name], common.time
        if agreement.kind == "contact":
            time = np.zeros(1)
        else:  # the largest within some rows to either side
            padded = np.pad(width, reach, mode="edge")
            width = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
        bands.append(_band(agreement, gaps[agreement.name], width, time))
    return Figures(
        runs=runs,
        seed=seed,
        rounding=ROUNDING,
        uncertain=uncertain,
        ended=ended,
        bands=tuple(bands),
    )


def _distances(
    left: Trace, perturbed: Trace, tip: str, until: float, rows: Ints
) -> dict[str, Array]:
    """How far a run is from `left` in some of its rows; infinite where it has ended.

    Of a first touch it is one number [s]: a touch that does not come has no time.
    """
    distances: dict[str, Array] = {}
    try:
        curves, count = series(left, perturbed, tip), len(perturbed)
        for touch in touches(left, perturbed):
            first, other = touch.left.first, touch.right.first
            gap = until if first is None or other is None else abs(first - other)
            distances[f"{touch.pair}, first touch"] = np.array([gap])
    except TraceError:  # it ended at once
        curves, count = series(left, left, tip), 0
    for curve in curves:
        far = np.full(len(left), np.inf)
        far[:count] = np.nan_to_num(curve.difference[:count], nan=np.inf)
        distances[curve.name] = far[rows]
    return distances


def _band(agreement: Agreement, gap: Array, width: Array, time: Array) -> Figures:
    """The chaos floor of one quantity.

    Returns:
        name, kind, unit: Of the Agreement of the two sides.
        most: The largest width of the band; end: the width at the last moment.
        inside_from: The time from which on the gap between the two sides lies inside [s];
            None if it does not at the end. Of a first touch 0 or None.
        beyond: Whether the gap is, at any moment, larger than both the band and the tolerance:
            only then it is more than chaos.
        _width: (n,) at each moment that the sides have in common; (1,) of a first touch.
    """
    outside = np.flatnonzero(~(gap <= width))
    last = int(outside[-1]) + 1 if len(outside) else 0
    return Figures(
        name=agreement.name,
        kind=agreement.kind,
        unit=agreement.unit,
        most=float(width.max()),
        end=float(width[-1]),
        inside_from=float(time[last]) if last < len(time) else None,
        beyond=bool((~(gap <= np.maximum(width, agreement.tolerance))).any()),
        _width=width,
    )
