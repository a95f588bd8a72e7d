"""A run made again, changed by next to nothing: by rounding, or by what a start is uncertain by."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ...backends.starts import asleep_from_the_start
from ...errors import BadInputError, EngineWarning
from ...interface import Array, Data, JointType, Model
from ...measures import parse_amount
from ...rotations import times
from ..recordings import Rerun, Trace, with_first_ctrl
from ..recordings.recorder import DerivedFrom
from ..runs.drive import Progress, no_progress, progress_of_stage
from ..runs.scenarios import Controller

RUNS = 8  # of each side


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
    """Return the uncertainty that words like "0.1mm" and "0.1deg" mean.

    Raises:
        BadInputError: A word is invalid, or a length or an angle is given twice.
    """
    sizes: dict[str, float] = {}
    for word in words:
        value, unit = parse_amount(word)
        kind = {"m": "length", "rad": "angle"}.get(unit, "")
        if not kind or np.isnan(value):
            raise BadInputError(f"an uncertainty reads like 0.1mm or 0.1deg; got {word!r}")
        if kind in sizes:
            raise BadInputError(f"the {kind} that is uncertain is given twice: {word!r}")
        sizes[kind] = value
    return Uncertainty(**sizes)


def perturbed_runs(
    rerun: Rerun,
    *,
    runs: int = RUNS,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = no_progress,
) -> Iterator[Trace]:
    """Repeat the run with starts and commands that differ by rounding, and yield the traces.

    Positions, velocities and commands change by at most `Capabilities.rounding` of themselves (of
    1 where they are less), drawn anew for each run and each command. A quaternion is turned by such
    an angle, and stays one. Where the start is uncertain by more, each coordinate of it is
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
            progress=progress_of_stage(progress, k / runs, 1 / runs),
        )


def perturbed_run(
    rerun: Rerun,
    k: int,
    *,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = no_progress,
) -> Trace:
    """Return the run with the number `k` of `perturbed_runs`, which depends on no other."""
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    draw = np.random.default_rng([seed, k])
    qpos, qvel = rerun.start()
    # At a corner of what is possible; of two runs one is opposite to the other.
    corner, side = np.random.default_rng([seed, k // 2]), -1.0 if k % 2 else 1.0

    def along() -> float:
        return side * float(corner.choice((-1.0, 1.0)))

    qpos = displaced(rerun.model, qpos, uncertain, corner, along, far=lambda: side)
    controller = nudged_controller(rerun.model, rerun.controller(rerun.model), draw)
    qpos, qvel = nudged_start(rerun.model, qpos, qvel, draw)
    # What an engine warns of, and what is wrong with the start, is told of the run itself.
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return rerun.record(
            controller=controller,
            qpos=qpos,
            qvel=qvel,
            derived=_derived_from(rerun, derive),
            progress=progress,
        )


def _derived_from(rerun: Rerun, derive: bool) -> DerivedFrom:
    """Return how a trace that nobody keeps comes to what the engine derives, if it tells that.

    After a controller that writes the state, derived arrays are no more of that state.
    """
    if not derive:
        return "nothing"
    return "repetition" if rerun.writes_state else "run"


def displaced(
    model: Model,
    qpos: Array,
    size: Uncertainty,
    draw: np.random.Generator,
    along: Callable[[], float],
    far: Callable[[], float],
) -> Array:
    """Return a start (nq,) that is displaced from another one.

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
        if kind == JointType.HINGE:
            qpos[place] += size.angle * along()
            continue
        if kind == JointType.SLIDE:
            qpos[place] += size.length * along()
            continue
        if kind == JointType.FREE:
            qpos[place : place + 3] += size.length * far() * direction(draw)
        turn(qpos[place + JointType(kind).nq - 4 :][:4], size.angle * far() * direction(draw))
    return qpos


def nudged_start(
    model: Model, qpos: Array, qvel: Array, draw: np.random.Generator
) -> tuple[Array, Array]:
    """Return positions (nq,) and velocities (nv,) changed by rounding; a quaternion stays one.

    What belongs to a body that sleeps from the start stays as it is: any change wakes the body.
    """
    rounding = model.capabilities.rounding
    nudged = _nudged(qpos, draw, rounding)
    for _, place in model._quaternions:
        nudged[place : place + 4] = qpos[place : place + 4]
        turn(nudged[place : place + 4], rounding * direction(draw))
    velocities = _nudged(qvel, draw, rounding)
    asleep = asleep_from_the_start(model)
    velocities[asleep] = qvel[asleep]
    for joint in np.flatnonzero(asleep[model.jnt_dofadr]):
        place = model.jnt_qposadr[joint]
        end = place + JointType(model.jnt_type[joint]).nq
        nudged[place:end] = qpos[place:end]
    return nudged, velocities


def turn(quat: Array, by: Array) -> None:
    """Turn a quaternion (4,), in place, by a vector (3,) along the axis, as long as the angle."""
    angle = float(np.linalg.norm(by))
    if angle:
        half = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * by / angle)])
        turned = times(half, quat)
        quat[:] = turned / np.linalg.norm(turned)


def direction(draw: np.random.Generator) -> Array:
    """Draw a unit vector (3,), every direction as likely as any other."""
    vector = draw.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _nudged(values: Array, draw: np.random.Generator, rounding: float) -> Array:
    """Return values (n,) changed by rounding, relative; what is not finite stays."""
    finite = np.where(np.isfinite(values), values, 0.0)
    return values + rounding * np.maximum(1.0, np.abs(finite)) * draw.uniform(-1, 1, len(values))


def nudged_controller(
    of: Model, controller: Controller | None, draw: np.random.Generator
) -> Controller:
    """Return a controller whose commands differ by rounding from those of another one.

    Where a controller gives no command, the ctrl of the start is nudged once, and stays.

    Args:
        of: The Model that it commands.
        controller: The other one.
        draw: Of the differences.
    """
    rounding = of.capabilities.rounding

    def nudging(model: Model, data: Data) -> Array | None:
        ctrl = None if controller is None else controller(model, data)
        return None if ctrl is None else _nudged(np.asarray(ctrl, dtype=np.float64), draw, rounding)

    # Once: a ctrl that stays as it is must not wander.
    return with_first_ctrl(lambda data: _nudged(data.ctrl, draw, rounding), nudging)
