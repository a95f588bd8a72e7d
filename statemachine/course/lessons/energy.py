"""Which integrator keeps energy: of a pendulum, a spring and a body that tumbles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

import numpy as np

from ...backends import BackendChoice
from ...errors import BadInputError
from ...interface import Array, Data, Model, make_data, reset
from ...lab.runs.drive import Progress, number_of_steps, progress_of_stage
from ...lab.runs.provenance import Provenance, provenance
from ...lab.validate.case import Integrator
from ...lab.validate.cases import CASES
from ...lab.validate.run import Run, largest_deviation
from ...lab.validate.variants import OWN, Variant, variants_of
from ...models import resolve
from .session import CodeRun, Options

TIMESTEPS = (0.005, 0.002, 0.001)  # [s]
TIMES = (1.0, 2.0, 5.0, 10.0, 20.0)  # [s] at which the tumbling body is looked at
_MODEL = "tumbling"
_INERTIA = np.array([1.0, 2.0, 3.0])  # [kg m²] about its own axes
_TUMBLE = (0.01, 5.0, 0.01)  # [rad/s]
_GRAVITY = 9.81  # [m/s²]
_LENGTH_SQUARED = 1.0 + 1e-6  # moment of inertia of the pendulum [kg m²]
_AMPLITUDE = np.radians(120.0)
_STIFFNESS = 100.0  # [N/m]
_LAST = 2.0  # [s] over which the largest change counts: energy at one moment may be a phase
_COMMON = 0.01  # [s] in which each of the timesteps comes by a whole number of times
_SHARE_OF_CODE = 0.1  # of the time that the lesson takes


@dataclass(frozen=True)
class EnergyBody:
    """A body whose energy nothing changes.

    Attributes:
        name: A label of the lesson.
        case: The case of the battery that it is from.
        share: How long it is run, as a part of the time that is asked for.
        start: Writes the start into a Data.
        energy: Returns its energy [J].
    """

    name: str
    case: str
    share: float
    start: Callable[[Data], None]
    energy: Callable[[Data], float]


def _start_swing(data: Data) -> None:
    data.qpos[0] = _AMPLITUDE


def _energy_of_swing(data: Data) -> float:
    kinetic = _LENGTH_SQUARED * data.qvel[0] ** 2 / 2.0
    return float(kinetic + _GRAVITY * (1.0 - np.cos(data.qpos[0])))


def _start_spring(data: Data) -> None:
    data.qpos[0] = 1.0


def _energy_of_spring(data: Data) -> float:
    return float((data.qvel[0] ** 2 + _STIFFNESS * data.qpos[0] ** 2) / 2.0)


def _start_tumble(data: Data) -> None:
    data.qvel[3:] = _TUMBLE


def energy_of_tumbling(data: Data) -> float:
    """Return the energy of a body that turns about its centre of mass [J]."""
    return float(_INERTIA @ data.qvel[3:6] ** 2 / 2.0)


BODIES: tuple[EnergyBody, ...] = (
    EnergyBody("pendulum", "pendulum-rise", 0.5, _start_swing, _energy_of_swing),
    EnergyBody("spring", "spring-energy", 0.5, _start_spring, _energy_of_spring),
    EnergyBody("tumbling", "tumbling-energy", 1.0, _start_tumble, energy_of_tumbling),
)


@dataclass(frozen=True)
class EnergyChange:
    """How far the energy of a body is from that of its start, with one integrator.

    Attributes:
        body: As in `BODIES`.
        integrator: By its name in MuJoCo's files.
        is_supported: Whether the backend has that integrator.
        seconds: How long the body is run [s].
        by_timestep: (k,) largest relative change in the window at the end, at each of `TIMESTEPS`;
            NaN without the integrator.
        times: (n,) moments of the run with the longest timestep [s]; empty without the integrator.
        changes: (n,) the relative change of the energy at each of them.
    """

    body: str
    integrator: Integrator
    is_supported: bool
    seconds: float
    by_timestep: Array
    times: Array
    changes: Array

    @property
    def longest(self) -> float:
        """Return the largest relative change in the window at the longest timestep."""
        return float(self.by_timestep[0])

    @property
    def order(self) -> float | None:
        """Return with which power of the timestep the change vanishes; None where it does not."""
        sizes = np.abs(self.by_timestep)
        if not (self.is_supported and (sizes > 0).all() and (np.diff(sizes) < 0).all()):
            return None
        slope, _ = np.polyfit(np.log(TIMESTEPS), np.log(sizes), 1)
        return float(slope)

    def until(self, time: float) -> float:
        """Return the largest change up to a time [s]; NaN without the integrator."""
        reached = self.changes[self.times <= time + 1e-9]
        return float(max(reached, key=abs, default=np.nan))


@dataclass(frozen=True)
class EnergyResult:
    """Which integrator keeps the energy of three bodies.

    Attributes:
        seconds: Simulated time of the code's run [s].
        change: Relative change of the energy in the code's run, at its end.
        rows: Of each body, and each integrator of MuJoCo; or "own", that of an engine which reads
            none from a file.
        timesteps: At which each was run [s].
        window: At the end of each run, over which the largest change counts [s].
        provenance: What it was computed with.
    """

    seconds: float
    change: float
    rows: tuple[EnergyChange, ...]
    timesteps: tuple[float, ...]
    window: float
    provenance: Provenance

    def of_body(self, body: str) -> list[EnergyChange]:
        """Return the rows of a body, one for each integrator."""
        return [row for row in self.rows if row.body == body]


def code(model: Model, options: Options, load: str) -> str:
    """Write how the energy of a body is watched that nothing touches."""
    if model.path != resolve(_MODEL):
        raise BadInputError(
            f"this lesson is about the body of the model {_MODEL!r}, and {model.path.name} is "
            "another model"
        )
    steps = number_of_steps(model, options["seconds"])
    parts = 4 if steps % 4 == 0 else 1
    return f"""\
import numpy as np
import statemachine as sm

model = {load}
inertia = np.array({_INERTIA.tolist()})  # of the body, about its own axes
data = sm.make_data(model)
sm.reset(model, data, keyframe="tumble")
start = inertia @ data.qvel[3:6] ** 2 / 2
for _ in range({parts}):
    sm.step(model, data, {steps // parts})
    energy = inertia @ data.qvel[3:6] ** 2 / 2
    print(round(data.time, 3), f"{{energy / start - 1:+.2%}}")
"""


def run(play: CodeRun, options: Options, progress: Progress) -> EnergyResult:
    """Run the code; then each body with each integrator, at three timesteps."""
    play()
    model = play.model
    _, data = play.worlds[0]
    progress(_SHARE_OF_CODE)
    later = progress_of_stage(progress, _SHARE_OF_CODE, 1.0 - _SHARE_OF_CODE)
    seconds = options["seconds"]
    return EnergyResult(
        seconds=data.time,
        change=energy_of_tumbling(data) / _energy_of_start(model) - 1.0,
        rows=tuple(_rows(model, seconds, later)),
        timesteps=TIMESTEPS,
        window=_window(seconds),
        provenance=provenance(model),
    )


def _energy_of_start(model: Model) -> float:
    """Return the energy of the tumbling body in its keyframe [J]."""
    with make_data(model) as data:
        reset(model, data, keyframe="tumble")
        return energy_of_tumbling(data)


def times_until(seconds: float) -> list[float]:
    """Return the moments at which the tumbling body is looked at, the last of them its end [s]."""
    return [*(time for time in TIMES if time < seconds), seconds]


def _window(seconds: float) -> float:
    """Return how much of the end of a run is looked at [s]: at most the shortest run.

    Args:
        seconds: The time that is asked for [s].
    """
    return min(_LAST, *(_whole(body.share * seconds) for body in BODIES))


def _whole(seconds: float) -> float:
    """Return a time [s] that each of the timesteps comes by; the least is one of these."""
    return max(1, round(seconds / _COMMON)) * _COMMON


def _rows(model: Model, seconds: float, progress: Progress) -> list[EnergyChange]:
    """Return the change of the energy of each body with each integrator.

    Args:
        model: On whose backend.
        seconds: The time that is asked for [s].
        progress: Told the fraction that is done.
    """
    backend = BackendChoice(model.backend)
    available = {variant.integrator for variant in variants_of(backend)}
    names = [name for name in get_args(Integrator) if name != OWN or OWN in available]
    rows: list[EnergyChange] = []
    for body in BODIES:
        for name in names:
            variant = Variant(backend, name) if name in available else None
            rows.append(_change(body, name, variant, seconds))
            progress(len(rows) / (len(BODIES) * len(names)))
    return rows


def _change(
    body: EnergyBody, integrator: Integrator, variant: Variant | None, seconds: float
) -> EnergyChange:
    """Return the change of the energy of a body with an integrator.

    Args:
        body: What is run.
        integrator: Its name.
        variant: The backend with it; None where it has no such integrator.
        seconds: The time that is asked for [s].
    """
    total, window = _whole(body.share * seconds), _window(seconds)
    if variant is None:
        none, unknown = np.array([]), np.full(len(TIMESTEPS), np.nan)
        return EnergyChange(body.name, integrator, False, total, unknown, none, none)
    times, energies = _energies(body, variant, TIMESTEPS[0], (0.0, total))
    last = energies[times >= total - window - TIMESTEPS[0] / 2.0]
    sizes = [largest_deviation(last, float(energies[0]))]
    for timestep in TIMESTEPS[1:]:
        _, of_shorter = _energies(body, variant, timestep, (total - window, total))
        sizes.append(largest_deviation(of_shorter, float(energies[0])))
    changes = energies / energies[0] - 1.0
    return EnergyChange(body.name, integrator, True, total, np.array(sizes), times, changes)


def _energies(
    body: EnergyBody, variant: Variant, timestep: float, span: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the times (n,) [s] in a span of a run, and the energy (n,) [J] at each of them.

    Args:
        body: What is run.
        variant: On what, and with which integrator.
        timestep: [s].
        span: From when to when, the end of the run, it is looked at [s].
    """
    start, end = span
    case = CASES[body.case]
    text = case.model_text(timestep, variant.integrator)
    with variant.loaded(text, timestep, case.gravity) as model, make_data(model) as data:
        body.start(data)
        run = Run(model, data)
        if start > timestep / 2.0:
            run.advance(start)
        samples = run.sample(end - start, body.energy)
    return samples.times, samples.values
