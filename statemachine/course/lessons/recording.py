"""Is it the arm or the simulator: a delay, or soft gains, and what a recording cannot tell."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...backends import load
from ...errors import BadInputError
from ...installed import DEFAULT
from ...interface import Array, Model
from ...lab.identification.fit import Fit, Objective
from ...lab.identification.fit import fit as fit_objective
from ...lab.identification.parameters import ArmParameters
from ...lab.identification.recorded_gap import gap_between
from ...lab.identification.residuals import QUANTILE, Residuals, root_mean_square
from ...lab.identification.results import CAUSES, UNITS, Cause, Kind
from ...lab.identification.simulation import ArmSimulation
from ...lab.identification.starts import Fits, first_objective, informations_beside
from ...lab.recordings.arm_recording import ArmRecording, ArmRecordings
from ...lab.recordings.arm_source import read_arm_recordings
from ...lab.recordings.synthetic_truth import SyntheticTruth, synthetic_truth
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import is_so101
from ...lab.why.shapley import shapley
from .session import CodeRun, Options

SOURCE = "lerobot:synthetic"
STEPS = 8  # of a frame, in the program
# The two readings of an arm that lags behind, alone and together; then all that is fitted.
READINGS: tuple[tuple[Cause, ...], ...] = (("delay",), ("gains",), ("delay", "gains"), CAUSES)
_DELAYS = tuple(np.arange(0.0, 0.21, 0.02).tolist())  # [s] from which fits start
_STIFFNESS = (0.0, -1.0, -2.0, -3.0, -4.0)  # logarithms of the factor of all gains, likewise
_NOT_IN_JSON = {"json": False}
_RUNS = 12  # simulations of a fit, without those for derivatives
_TOLERANCE = 1e-2  # part by which the sum of squares falls at least, or a fit ends
_SHARE_OF_CODE = 0.05  # of the time that the lesson takes
_SHARES = (0.1, 0.1, 0.2, 0.55)  # of that time, of each reading


@dataclass(frozen=True)
class FittedReading:
    """What is left of the gap where some causes are fitted.

    Attributes:
        causes: Those that were fitted; the other figures are the model's.
        here: Root mean square of what is left, in the episode that was fitted [rad].
        elsewhere: The same in the other episode [rad].
        taken: What the fit takes away, as a part of the gap in the other episode.
        delay: The delay of the fit [s].
        kp: (n,) gains of the fit [N·m/rad].
        angles: (K, n) angles of the fitted model [rad].
    """

    causes: tuple[Cause, ...]
    here: float
    elsewhere: float
    taken: float
    delay: float
    kp: Array
    angles: Array = field(metadata=_NOT_IN_JSON)


@dataclass(frozen=True)
class ToldFigure:
    """What a recording tells of a figure of the arm, where all are fitted.

    Attributes:
        kind: Which figure.
        joint: Of which joint; None where it is of the arm.
        model: The figure of the model, in `unit`; so are the other figures.
        fitted: That of the fit.
        low, high: Between what it is with 95 %.
        posterior_by_prior: Standard deviation after the fit by that before it: 1 where the
            recording tells nothing.
        truth: The figure that the recording was simulated with.
    """

    kind: Kind
    joint: str | None
    model: float
    fitted: float
    low: float
    high: float
    posterior_by_prior: float
    truth: float

    @property
    def unit(self) -> str:
        """Return the unit of the figures."""
        return UNITS[self.kind]

    @property
    def is_within(self) -> bool:
        """Tell whether the truth is in the interval."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class RecordingLessonResult:
    """What delay and gains explain of the gap to a recording, and what it does not tell.

    Attributes:
        joints: (n,) names.
        fps: Frames per second [1/s].
        time: (K,) of the frames [s].
        measured: (K, n) measured angles [rad].
        typed: (K, n) angles of the program [rad].
        commanded: Root mean square of measured angles less commands [rad].
        here, elsewhere: Of measured angles less the model's, in the two episodes [rad].
        readings: What fits leave, in the order of `READINGS`.
        shares: Shapley values of delay and gains, as parts of the gap in the other episode.
        floor: What the measurement alone leaves [rad].
        at_floor: Whether the last reading leaves no more.
        figures: What the recording tells of each figure.
        provenance: What it was computed with.
    """

    joints: tuple[str, ...]
    fps: float
    time: Array
    measured: Array = field(metadata=_NOT_IN_JSON)
    typed: Array = field(metadata=_NOT_IN_JSON)
    commanded: float
    here: float
    elsewhere: float
    readings: tuple[FittedReading, ...]
    shares: dict[str, float | None]
    floor: float
    at_floor: bool
    figures: tuple[ToldFigure, ...]
    provenance: Provenance

    def reading(self, *causes: Cause) -> FittedReading:
        """Return what is left where these causes are fitted."""
        return next(reading for reading in self.readings if reading.causes == causes)

    def figure(self, kind: Kind, joint: str | None = None) -> ToldFigure:
        """Return what the recording tells of a figure."""
        return next(each for each in self.figures if (each.kind, each.joint) == (kind, joint))


def code(model: Model, options: Options, load: str) -> str:
    """Play the recorded commands into the model, and compare its angles with the measured ones."""
    if not is_so101(model):
        raise BadInputError(
            f"the recording is of an SO-101, and {model.path.name} is another robot; of your own "
            "arm: statemachine compare lerobot:DIR MODEL"
        )
    return f"""\
import numpy as np
import statemachine as sm
from statemachine.lab.recordings.arm_source import read_arm_recordings

model = {load}
recording = read_arm_recordings("{SOURCE}", model, None, {{}}).fitted
model = model.replace(timestep=1 / {30 * STEPS}, contacts=False)  # {STEPS} steps a frame
data = sm.make_data(model)
data.qpos[:] = recording.state[0]
angles = []
for command in recording.action:
    angles.append(data.qpos.copy())  # as an arm is read: before it is told
    data.ctrl[:] = command
    sm.step(model, data, {STEPS})
apart = np.degrees(np.array(angles) - recording.state)
print(np.sqrt(np.mean(np.square(apart))))
"""


def run(play: CodeRun, options: Options, progress: Progress) -> RecordingLessonResult:
    """Run the program; then fit delay and gains, alone and together, and all there is to fit.

    Fits run on MuJoCo, on whatever engine the program does.
    """
    typed = np.array(play()["angles"])
    progress(_SHARE_OF_CODE)
    model = play.model if play.model.backend == DEFAULT else load(play.model.path, backend=DEFAULT)
    recordings = read_arm_recordings(SOURCE, model, None, {})
    recording = recordings.fitted
    parameters = ArmParameters.of(model, recording.joints)
    simulation = ArmSimulation.of(parameters, recording)
    other = ArmSimulation.of(parameters, _held_out(recordings))
    nothing = np.zeros(len(parameters))
    elsewhere = _gap(other, other.angles(nothing))
    fits = _fits(simulation, progress)
    readings = [_reading(fit, other, elsewhere) for fit in fits]
    residuals = Residuals.of(fits[-1].errors, recording)
    time = np.arange(len(recording.state)) / recording.fps
    gap = gap_between(simulation, simulation.angles(nothing))
    figures, shares = _figures(fits[-1], residuals), _shares(readings, elsewhere)
    return RecordingLessonResult(
        joints=parameters.joints,
        fps=recording.fps,
        time=time,
        measured=recording.state,
        typed=typed,
        commanded=gap.commanded,
        here=gap.model,
        elsewhere=elsewhere,
        readings=tuple(readings),
        shares=shares,
        floor=residuals.floor,
        at_floor=residuals.at_floor,
        figures=figures,
        provenance=provenance(play.model),
    )


def _fits(simulation: ArmSimulation, progress: Progress) -> list[Fit]:
    """Return a fit for each of `READINGS`; that of everything starts where the others end."""
    parameters = simulation.parameters
    fits: list[Fit] = []
    done = _SHARE_OF_CODE
    for causes, share in zip(READINGS, _SHARES, strict=True):
        objective = first_objective(
            Objective(
                simulation=simulation,
                deviation=simulation.recording.resolution,
                free=parameters.of_causes(causes),
                fixed=np.zeros(len(parameters)),
            )
        )
        start = fits[-1].vector if causes == CAUSES else _start(objective, causes)
        fits.append(fit_objective(objective, start, runs=_RUNS, tolerance=_TOLERANCE))
        if causes == CAUSES:
            fits[-1] = _gone_on(fits[-1])
        done += share
        progress(done)
    return fits


def _held_out(recordings: ArmRecordings) -> ArmRecording:
    """Return the other episode."""
    if recordings.held_out is None:
        raise BadInputError(f"{SOURCE} has one episode, and the lesson needs two")
    return recordings.held_out


def _gone_on(end: Fit) -> Fit:
    """Return where a fit goes on to, with the noise of each joint and exact derivatives."""
    residuals = Residuals.of(end.errors, end.objective.simulation.recording)
    noise = np.minimum(residuals.noise, residuals.most)
    objective = replace(end.objective, deviation=noise)
    return fit_objective(objective, end.vector, runs=_RUNS, derivatives="exact")


def _start(objective: Objective, causes: Collection[Cause]) -> Array:
    """Return the vector (P,) that fits best of some with other delays, and all gains alike."""
    simulation, parameters = objective.simulation, objective.parameters
    delays = _DELAYS if "delay" in causes else (0.0,)
    stiffness = _STIFFNESS if "gains" in causes else (0.0,)
    best, least = objective.fixed, np.inf
    for delay in delays:
        vectors = np.tile(objective.fixed, (len(stiffness), 1))
        vectors[:, parameters.of_kind("delay")] = delay
        vectors[:, parameters.of_kind("kp")] = np.array(stiffness)[:, None]
        gaps = [_gap(simulation, angles) for angles in simulation.angles_of_each(vectors, True)]
        place = int(np.argmin(gaps))
        if gaps[place] < least:
            best, least = vectors[place], gaps[place]
    return best


def _reading(end: Fit, other: ArmSimulation, before: float) -> FittedReading:
    """Return what a fit leaves.

    Args:
        end: The fit.
        other: Plays the other episode.
        before: The gap there with the model as it is [rad].
    """
    objective, parameters = end.objective, end.objective.parameters
    fitted = {parameters.each[number].cause for number in objective.free.tolist()}
    gains = [
        parameters.each[number].figure(float(end.vector[number]))
        for number in parameters.of_kind("kp").tolist()
    ]
    here = root_mean_square(end.errors)
    elsewhere = _gap(other, other.angles(end.vector))
    return FittedReading(
        causes=tuple(cause for cause in CAUSES if cause in fitted),
        here=here,
        elsewhere=elsewhere,
        taken=1.0 - elsewhere / before,
        delay=float(end.vector[parameters.of_kind("delay")[0]]),
        kp=np.array(gains),
        angles=objective.simulation.angles(end.vector),
    )


def _gap(simulation: ArmSimulation, angles: Array) -> float:
    """Return the root mean square of simulated angles (K, n) less the measured ones [rad]."""
    errors = (angles - simulation.state)[simulation.first_frame :]
    gap = root_mean_square(errors)
    return gap if np.isfinite(gap) else np.inf


def _shares(readings: Sequence[FittedReading], before: float) -> dict[str, float | None]:
    """Return the Shapley values of delay and gains, as parts of the gap in the other episode."""
    gaps = {frozenset[str](reading.causes): reading.elsewhere for reading in readings}
    gaps[frozenset()] = before
    return shapley(("delay", "gains"), gaps.__getitem__, before).share


def _figures(end: Fit, residuals: Residuals) -> tuple[ToldFigure, ...]:
    """Return what the recording tells of each figure that was fitted."""
    objective = end.objective
    deviations = Fits((end,), residuals, informations_beside(end)).deviations
    truth = synthetic_truth()
    figures: list[ToldFigure] = []
    for number, deviation in zip(objective.free.tolist(), deviations.tolist(), strict=True):
        parameter = objective.parameters.each[number]
        value, width = float(end.vector[number]), QUANTILE * deviation
        true_figure = _true_figure(truth, parameter.kind, parameter.joint)
        figure = ToldFigure(
            kind=parameter.kind,
            joint=parameter.joint,
            model=parameter.model,
            fitted=parameter.figure(value),
            low=parameter.figure(value - width),
            high=parameter.figure(value + width),
            posterior_by_prior=deviation / parameter.prior.deviation,
            truth=true_figure,
        )
        figures.append(figure)
    return tuple(figures)


def _true_figure(truth: SyntheticTruth, kind: Kind, joint: str | None) -> float:
    """Return the figure that the recording was simulated with."""
    match kind:
        case "delay":
            return truth.delay
        case "payload":
            return truth.payload
        case "kp":
            values = truth.kp
        case "viscous":
            values = truth.viscous
        case "friction":
            values = truth.frictionloss
        case "armature":
            values = truth.armature
        case "offset":
            values = truth.offset
    assert joint is not None
    return values[truth.joints.index(joint)]
