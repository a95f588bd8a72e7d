"""What exactly is the state, on this model and engine? Each part of a State is left out and tried.

    print(statemachine.lab.probes.audit(model))  # a table: each part, and what its absence changes

A run is saved, and goes on. Another run, with other commands, has its State put over by the saved
one, but for one part: what does that part change in the steps that follow?
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError, DivergedError, shown
from ...interface import Array, Data, Model, State, get_state, make_data, reset, set_state, step
from ...interface.checks import as_count
from ...measures import JointAddresses, largest_difference, largest_or_inf, rotation_angles
from ...measures.text import rough
from ...release_names import engine_of

_WIDTH = 80
_STEPS_BEFORE_SAVE = 50  # steps until a run is saved
_EXTRA_STEPS = 50  # steps more of the other run
_CTRL_OFFSET = 0.3  # how far the command is from that of the start [unit of the actuator], at most
# What stands in a part that is zero in both runs, as of forces that nobody applies [SI units].
_APPLIED_FORCE = 1.0


@dataclass(frozen=True)
class FutureGap:
    """How far two futures are apart.

    Attributes:
        first: After how many steps a byte of qpos or qvel differs first: 0 is before any step,
            where what was restored does not read back as it was; None where none differs.
        angle: The largest difference of a hinge, or of a body's orientation, at any step [rad].
        length: That of a slide, or of a coordinate of a free body [m].
    """

    first: int | None
    angle: float
    length: float

    @property
    def exact(self) -> bool:
        """Tell whether every byte is the same."""
        return self.first is None

    def __str__(self) -> str:
        if self.exact:
            return "same bytes"
        turns_more = self.angle >= self.length
        size = rough(self.angle, "rad") if turns_more else rough(self.length, "m")
        return f"{size}, from step {self.first} on"


@dataclass(frozen=True)
class OmittedStatePart:
    """A part of a State, and what follows where it is left out.

    Attributes:
        name: As in `State.layout`.
        size: How many numbers it has.
        gap: Between the futures with and without it; None where it is no zero, and the same in
            both runs, so that nothing was there to be left out.
    """

    name: str
    size: int
    gap: FutureGap | None

    @property
    def decides(self) -> bool:
        """Tell whether another value of it leads to another future."""
        return self.gap is not None and not self.gap.exact


@dataclass(frozen=True, repr=False)
class Audit:
    """What decides the future of a run.

    Attributes:
        backend, engine_version: Of the Model.
        model: Its name.
        time: When the run was saved [s].
        steps: How many steps each future has.
        whole: Between the future of the run itself and that of its State, restored elsewhere.
        again: Between the futures of that State in two Data of different pasts.
        parts: Of the State, in its order.
    """

    backend: str
    engine_version: str
    model: str
    time: float
    steps: int
    whole: FutureGap
    again: FutureGap
    parts: tuple[OmittedStatePart, ...]

    @property
    def decides(self) -> tuple[str, ...]:
        """Return the names of the parts that decide the future."""
        return tuple(part.name for part in self.parts if part.decides)

    @property
    def idle(self) -> tuple[str, ...]:
        """Return the names of the parts that were left out and changed nothing."""
        return tuple(part.name for part in self.parts if part.gap is not None and part.gap.exact)

    @property
    def not_tried(self) -> tuple[str, ...]:
        """Return the names of the parts that both runs had in common."""
        return tuple(part.name for part in self.parts if part.gap is None)

    def __str__(self) -> str:
        made_with = f"{engine_of(self.backend)} {self.engine_version}"
        lines = [
            f"State of {self.model} on {made_with} at {self.time:g} s, {self.steps} steps each",
            f"restored whole, against going on: {self.whole}",
            f"restored whole, twice:            {self.again}",
        ]
        width = max(len(part.name) for part in self.parts)
        for part in self.parts:
            future = "the same in both runs: not tried" if part.gap is None else str(part.gap)
            lines.append(f"all but {part.name:{width}} ({part.size:3} numbers): {future}")
        decides = ", ".join(self.decides) or "nothing"
        lines += textwrap.wrap(f"What decides the future: {decides}.", _WIDTH)
        return "\n".join(lines)

    __repr__ = __str__


def audit(model: Model, steps: int = 60, seed: int = 0) -> Audit:
    """Leave out each part of a State, restore the rest, and see whether the future is another one.

    A run starts from keyframe 0, or from the default state of a model without keyframes, under a
    command of its own. After some steps its State is put into a Data of another past, whole and
    without one part; what stands there in place of that part is what the other past left. The
    command stays, and nobody reads the time: a controller that does makes `time` decide, too.

    Args:
        model: On any backend.
        steps: Of each future.
        seed: Of the commands.

    Raises:
        TypeError: `model` is no Model.
        BadInputError: `steps` or `seed` is invalid, or nothing in the model moves.
        DivergedError: The run does not stay finite.
    """
    if not isinstance(model, Model):
        raise TypeError(f"audit wants a Model; got {shown(model)}")
    steps = as_count(steps, "steps")
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    if not model.nv:
        raise BadInputError(f"nothing moves in {model.path.name}: it has no state to audit")
    random = np.random.default_rng(seed)
    with make_data(model) as run, make_data(model) as other, make_data(model) as fresh:
        _start(model, run, random)
        step(model, run, _STEPS_BEFORE_SAVE)
        saved = get_state(model, run)
        going_on = future(model, run, steps)
        _start(model, other, random)
        step(model, other, _STEPS_BEFORE_SAVE + _EXTRA_STEPS)
        left = get_state(model, other)
        whole = _restored(model, other, saved, steps)
        again = _restored(model, fresh, saved, steps)
        parts = []
        for name, size in saved.layout:
            if not size:
                continue
            without = _without(saved, left, name)
            gap = None
            if without is not None:
                gap = _gap(model, whole, _restored(model, other, without, steps))
            parts.append(OmittedStatePart(name, size, gap))
    return Audit(
        backend=model.backend,
        engine_version=model.engine_version,
        model=model.path.stem,
        time=saved.time,
        steps=steps,
        whole=_gap(model, going_on, whole),
        again=_gap(model, whole, again),
        parts=tuple(parts),
    )


def _start(model: Model, data: Data, random: np.random.Generator) -> None:
    """Put a Data to the start, under a command that is drawn anew."""
    reset(model, data, keyframe=0 if model.keyframes else None)
    stir = random.uniform(-_CTRL_OFFSET, _CTRL_OFFSET, model.nu)
    data.ctrl[:] = np.clip(data.ctrl + stir, *model.actuator_ctrlrange.T)


def future(model: Model, data: Data, steps: int) -> Array:
    """Go on; return qpos and qvel (steps + 1, nq + nv) here and after each step."""
    rows = [np.concatenate((data.qpos, data.qvel))]
    for _ in range(steps):
        step(model, data)
        rows.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(rows)


def _restored(model: Model, data: Data, state: State, steps: int) -> Array:
    """Return the future of a State in a Data; NaN where it diverges."""
    set_state(model, data, state)
    try:
        return future(model, data, steps)
    except DivergedError:
        return np.full((steps + 1, model.nq + model.nv), np.nan)


def _without(saved: State, left: State, name: str) -> State | None:
    """Return a State that has in one part what another past left; None where that is the same."""
    other = left[name]
    if np.array_equal(saved[name], other):
        if other.any():
            return None
        other = np.full_like(other, _APPLIED_FORCE)
    return saved.with_parts(**{name: other})


def _gap(model: Model, first: Array, second: Array) -> FutureGap:
    """Return the gap between two futures, of rows as `future` gives them."""
    # As integers: what is compared are bytes, in which 0 is not -0, and NaN is NaN.
    differs = (first.view(np.int64) != second.view(np.int64)).any(axis=1)
    if not differs.any():
        return FutureGap(None, 0.0, 0.0)
    places = JointAddresses.of(model.jnt_type, model.jnt_qposadr)
    hinge_gap = largest_or_inf(
        largest_difference(first[:, places.hinges], second[:, places.hinges])
    )
    quats = places.quats[:, None] + np.arange(4)
    orientation_gap = largest_or_inf(rotation_angles(first[:, quats], second[:, quats]))
    straight = np.concatenate((places.slides, places.positions))
    return FutureGap(
        first=int(np.argmax(differs)),
        angle=max(hinge_gap, orientation_gap),
        length=largest_or_inf(largest_difference(first[:, straight], second[:, straight])),
    )
