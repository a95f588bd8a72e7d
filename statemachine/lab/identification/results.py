"""What is asked of a recording of a real arm, and what comes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from ...errors import BadInputError
from ...interface import Model
from ...models import AnyPath
from ..recordings.arm_recording import ArmRecordings
from ..recordings.joint_units import JointUnit
from ..runs.provenance import Provenance
from ..shown_result import Column, ShownResult, columns_of
from ..why.rewriting import RewrittenFile

Kind = Literal["kp", "viscous", "friction", "armature", "offset", "delay", "payload"]
Cause = Literal["delay", "gains", "friction", "offsets", "inertia"]
CAUSES: tuple[Cause, ...] = ("delay", "gains", "friction", "offsets", "inertia")
CAUSE_OF: dict[Kind, Cause] = {
    "kp": "gains",
    "viscous": "friction",
    "friction": "friction",
    "armature": "inertia",
    "offset": "offsets",
    "delay": "delay",
    "payload": "inertia",
}
UNITS: dict[Kind, str] = {
    "kp": "N·m/rad",
    "viscous": "N·m·s/rad",
    "friction": "N·m",
    "armature": "kg·m²",
    "offset": "rad",
    "delay": "s",
    "payload": "kg",
}
Reason = Literal[
    "too little information",  # the posterior is not narrower than 0.3 of the prior
    "residual above the floor",
    "starts disagree",
    "does not hold elsewhere",  # on what was not fitted
    "play fits as well",  # of a joint, and with it the figure would be another one
    "friction of the load fits as well",  # in the gears of servos
    "a tilted base fits as well",
]
EpisodePart = Literal["all", "last third"]  # the last third of the only episode is not fitted
HypothesisVerdict = Literal["fits better", "fits worse", "cannot tell"]
FEWEST_STARTS = 8
_MOST_STARTS = 64


@dataclass(frozen=True)
class RecordingRequest:
    """Question how a recording of a real arm differs from its model.

    Attributes:
        recording: "lerobot:DIR#EPISODE", or "lerobot:DIR" for the first episode.
        model: A name or a file of the arm.
        calibration: LeRobot's calibration file; None to take unit and scale from the numbers.
        names: Joints of the recording that have other names in the model.
        seconds: How much of the episode is taken at most [s]; None for 20 s.
        starts: How many starts the fit has, at least 8.
        seed: Of the starts, at least 0.
        menagerie: A menagerie folder to look the model's name up in.
        write: Where the model's file is written with the fitted figures; None for nowhere.
    """

    recording: str
    model: AnyPath
    calibration: AnyPath | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None
    starts: int = FEWEST_STARTS
    seed: int = 0
    menagerie: AnyPath | None = None
    write: AnyPath | None = None

    def __post_init__(self) -> None:
        if self.seconds is not None and not 1.0 <= self.seconds <= 600.0:
            raise BadInputError(f"seconds are between 1 and 600; got {self.seconds:g}")
        if not FEWEST_STARTS <= self.starts <= _MOST_STARTS:
            raise BadInputError(
                f"starts are between {FEWEST_STARTS} and {_MOST_STARTS}; got {self.starts}"
            )
        if self.seed < 0:
            raise BadInputError(f"seed must be at least 0; got {self.seed}")


@dataclass(frozen=True)
class JointGap:
    """How far a joint is from where it was measured, as root mean square.

    Attributes:
        joint: Its name.
        commanded: Of the commanded angle [rad]: as if the arm were where it was told.
        model: Of the model as it is [rad].
        fitted: Of the fitted model [rad]; None where nothing was fitted.
    """

    joint: str
    commanded: float
    model: float
    fitted: float | None = None


@dataclass(frozen=True)
class RecordingGap:
    """How far the model is from a recording.

    Attributes:
        episode: Number of the episode.
        part: Which part of it.
        seconds: Its length [s].
        joints: One for each joint.
        commanded: Over all joints [rad].
        model: Over all joints [rad].
        fitted: Over all joints [rad]; None where nothing was fitted.
    """

    episode: int
    part: EpisodePart
    seconds: float
    joints: tuple[JointGap, ...]
    commanded: float
    model: float
    fitted: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class ResultOfRecording(ShownResult):
    """What every question about a recording of a real arm is answered with.

    Attributes:
        request: What was asked.
        provenance: What it was computed with.
        gap: Before and after a fit on what was not fitted; without a fit of the episode that was
            named.
        recordings: Both episodes; not in JSON.
        arm: The Model as it is; not in JSON.
    """

    request: RecordingRequest
    provenance: Provenance
    gap: RecordingGap
    recordings: ArmRecordings = field(metadata={"json": False})
    arm: Model = field(metadata={"json": False})

    @property
    def units(self) -> tuple[JointUnit, ...]:
        """Return what the numbers of the recording were taken to mean."""
        return self.recordings.fitted.units

    @property
    def fps(self) -> float:
        """Return the frames per second [1/s]."""
        return self.recordings.fitted.fps


@dataclass(frozen=True, eq=False, repr=False)
class RecordingResult(ResultOfRecording):
    """How far a model is from a recording of a real arm."""

    page_function: ClassVar[str] = "identification.recording_page:page"

    def to_dict(self) -> dict[str, Column]:
        """Return the gap of each joint as columns [rad]."""
        joints = self.gap.joints
        return {
            "joint": [joint.joint for joint in joints],
            "commanded": [joint.commanded for joint in joints],
            "model": [joint.model for joint in joints],
        }


@dataclass(frozen=True)
class FittedParameter:
    """What the recording tells of a parameter.

    Attributes:
        kind: Which parameter.
        joint: Of which joint; None for delay and payload, which are of the arm.
        model: Its figure in the model, in the unit of `UNITS`; so are the other figures.
        fitted: Its figure in the best fit.
        low, high: Interval in which it is with 95 %, with what the starts are apart and what play
            that fits as well makes of it.
        posterior_by_prior: Standard deviation after the fit by that before it: 1 where the
            recording tells nothing.
        reasons: Why the recording does not determine it; empty where it does.
        motion: The motion that would determine it; "" for none of those that were tried, and
            where it is determined.
    """

    kind: Kind
    joint: str | None
    model: float
    fitted: float
    low: float
    high: float
    posterior_by_prior: float
    reasons: tuple[Reason, ...] = ()
    motion: str = ""

    @property
    def cause(self) -> Cause:
        """Return the cause that it belongs to."""
        return CAUSE_OF[self.kind]

    @property
    def unit(self) -> str:
        """Return the unit of its figures."""
        return UNITS[self.kind]

    @property
    def verdict(self) -> Literal["determined", "cannot tell"]:
        """Return whether the recording determines it."""
        return "cannot tell" if self.reasons else "determined"


@dataclass(frozen=True)
class CauseShare:
    """What a cause explains of the gap on what was not fitted.

    Attributes:
        cause: Which.
        share: Its Shapley value, as part of the gap of the model as it is.
        alone: What the fit of it alone takes away, as part of that gap.
        last: What it takes away where all others are fitted, as part of that gap.
    """

    cause: Cause
    share: float
    alone: float
    last: float


@dataclass(frozen=True)
class Hypothesis:
    """Another reading of the recording or of the model, and how well it fits.

    Attributes:
        name: What is otherwise, such as "the sign of elbow_flex", "viscous friction outside of
            the force limit" or "play of elbow_flex".
        residual: Of its best fit [rad].
        evidence: How much half the sum of squares falls by it; above 5 it fits better.
        verdict: Whether the recording tells.
        size: How wide the play is, of a count at least, or how far the base is tilted [rad]; or
            which part of a servo's force is lost in its gears. None of what has no size.
        unit: Of the size.
    """

    name: str
    residual: float
    evidence: float
    verdict: HypothesisVerdict
    size: float | None = None
    unit: Literal["rad", "of the force"] = "rad"


@dataclass(frozen=True)
class StartOutcome:
    """Where a start of the fit ended.

    Attributes:
        cost: Half the sum of squares of its residuals, with the prior.
        as_good: Whether it fits as well as the best.
        evaluations: Number of simulations of all worlds.
    """

    cost: float
    as_good: bool
    evaluations: int


@dataclass(frozen=True, eq=False, repr=False)
class IdentificationResult(ResultOfRecording):
    """What a recording of a real arm tells of the parameters of its model.

    Attributes:
        fitted_gap: Of what was fitted.
        residual: Root mean square of the residual of what was fitted [rad].
        floor: What resolution and unmeasured time leave at least [rad].
        holds: Whether the fitted model predicts what was not fitted down to the floor.
        at_floor: Whether the residual is at the floor.
        parameters: What the recording tells of each.
        shares: What each cause explains; empty where the model has no gap, and where Ctrl-C came
            before.
        hypotheses: Other readings that were tried.
        starts: Where each start ended.
        saturated: Part of the frames of the best fit in which the servo is at its force limit that
            is so most.
        fitted_arm: The Model with the fitted figures (offset and delay are not in it); not in JSON.
        rewritten: The model's file with the fitted figures; None where that was not asked.
        ended_by: "interrupt" where Ctrl-C came once all was known but the shares; else "".
    """

    page_function: ClassVar[str] = "identification.identification_page:page"
    fitted_gap: RecordingGap
    residual: float
    floor: float
    holds: bool
    at_floor: bool
    parameters: tuple[FittedParameter, ...]
    shares: tuple[CauseShare, ...]
    hypotheses: tuple[Hypothesis, ...]
    starts: tuple[StartOutcome, ...]
    saturated: float
    fitted_arm: Model = field(metadata={"json": False})
    rewritten: RewrittenFile | None = None
    ended_by: Literal["", "interrupt"] = ""

    def to_dict(self) -> dict[str, Column]:
        """Return what the recording tells of each parameter as columns."""
        names = ("kind", "joint", "unit", "model", "fitted", "low", "high", "verdict")
        return columns_of(self.parameters, names)


class InterruptedIdentification(KeyboardInterrupt):
    """A Ctrl-C while the gap was divided among its causes: `result` is all else.

    Attributes:
        result: The fit, without shares.
    """

    def __init__(self, result: IdentificationResult) -> None:
        """Keep what is known."""
        super().__init__("the gap was not divided among its causes: result has the fit")
        self.result = result
