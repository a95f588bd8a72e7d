"""The page of the lesson on a recording: delay or gains, and what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...lab.identification.parameter_texts import figure_text, number_text, unit_text
from ...lab.identification.results import CAUSES, Kind
from ...measures.text import degrees, milliseconds, percent
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, where
from ...show.labels import TableLabels
from ...show.pictures import Traces
from ...show.templates import PageContent
from .frame import LessonFrame
from .recording import FittedReading, RecordingLessonResult, ToldFigure

_SAY = TableLabels(__name__, "recording_labels.md.j2")
_MOST = 0.5  # of the gap: a reading that takes away more explains most of it
_CONFIDENCE = 0.95  # of an interval
_TOLD = 0.3  # standard deviation after a fit by that before it, below which a figure is told
_WATCHED = "shoulder_lift"  # the joint that is drawn and looked at
_CURVE = 4.0  # [s] of it that are drawn
# The choices of the second question, in their order.
ASKED: tuple[tuple[Kind, str | None], ...] = (
    ("delay", None),
    ("kp", _WATCHED),
    ("offset", "shoulder_pan"),
)


@dataclass(frozen=True)
class RecordingLessonPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        readings: What is left of the gap where some causes are fitted.
        figures: What the recording tells of some figures, and the truth.
        curves: Measured and simulated angles of a joint.
    """

    template = "recording.md.j2"
    lesson: LessonFrame
    result: RecordingLessonResult
    readings: Table
    figures: Table
    curves: Sequence[Block]

    @property
    def delay(self) -> FittedReading:
        """Return what is left where the delay alone is fitted."""
        return self.result.reading("delay")

    @property
    def gains(self) -> FittedReading:
        """Return what is left where the gains alone are fitted."""
        return self.result.reading("gains")

    @property
    def both(self) -> FittedReading:
        """Return what is left where delay and gains are fitted."""
        return self.result.reading("delay", "gains")

    @property
    def whole(self) -> FittedReading:
        """Return what is left where everything is fitted."""
        return self.result.reading(*CAUSES)

    @property
    def right(self) -> int | None:
        """Return the number of the right choice: which reading takes most of the gap away."""
        by_delay, by_gains = self.delay.taken > _MOST, self.gains.taken > _MOST
        if by_delay and by_gains:
            return 2
        if by_delay:
            return 0
        return 1 if by_gains else None

    @property
    def sum_alone(self) -> float:
        """Return what the two take away alone, added up, as a part of the gap."""
        return self.delay.taken + self.gains.taken

    @property
    def stand_in(self) -> bool:
        """Tell whether the two take away less together than each alone, added up."""
        return self.both.taken < self.sum_alone

    @property
    def share_of_delay(self) -> float | None:
        """Return the Shapley value of the delay, as a part of the gap."""
        return self.result.shares["delay"]

    @property
    def share_of_gains(self) -> float | None:
        """Return the Shapley value of the gains, as a part of the gap."""
        return self.result.shares["gains"]

    @property
    def watched(self) -> ToldFigure:
        """Return what the recording tells of the gain that is looked at."""
        return self.result.figure("kp", _WATCHED)

    @property
    def watched_alone(self) -> float:
        """Return that gain where the gains alone are fitted [N·m/rad]."""
        return self._gain_of(self.gains)

    @property
    def watched_with_delay(self) -> float:
        """Return that gain where delay and gains are fitted [N·m/rad]."""
        return self._gain_of(self.both)

    def _gain_of(self, reading: FittedReading) -> float:
        return float(reading.kp[self.result.joints.index(_WATCHED)])

    @property
    def late(self) -> ToldFigure:
        """Return what the recording tells of the delay."""
        return self.result.figure("delay")

    @property
    def blind(self) -> ToldFigure:
        """Return what it tells of the choice that it tells least of."""
        return self._of_choices()[self.least]

    @property
    def least(self) -> int:
        """Return the number of the choice that the recording tells least of."""
        return int(np.argmax([figure.posterior_by_prior for figure in self._of_choices()]))

    @property
    def right_undetermined(self) -> int | None:
        """Return the number of the right choice: what the recording cannot tell."""
        return self.least if self.blind.posterior_by_prior > _TOLD else None

    def _of_choices(self) -> list[ToldFigure]:
        return [self.result.figure(kind, joint) for kind, joint in ASKED]

    @property
    def blind_name(self) -> str:
        """Return its name."""
        return _name(self.blind)

    @property
    def half_width_text(self) -> str:
        """Return half its interval, with its unit."""
        return figure_text(self.blind.kind, (self.blind.high - self.blind.low) / 2.0)

    @property
    def fps(self) -> int:
        """Return the frames per second of the recording."""
        return round(self.result.fps)

    @property
    def pan_is_undetermined(self) -> bool:
        """Tell whether the recording tells nothing of the offset of the vertical axis."""
        return self.result.figure("offset", "shoulder_pan").posterior_by_prior > 0.99

    @property
    def lift_is_told(self) -> bool:
        """Tell whether it tells the offset of a joint that carries weight."""
        return self.lift.posterior_by_prior < _TOLD

    @property
    def lift(self) -> ToldFigure:
        """Return what it tells of that offset."""
        return self.result.figure("offset", _WATCHED)

    @property
    def within(self) -> int:
        """Return how many intervals have the truth in them."""
        return sum(figure.is_within for figure in self.result.figures)

    @property
    def expected(self) -> int:
        """Return how many would have the truth in them if each had it with 95 %."""
        return round(_CONFIDENCE * len(self.result.figures))

    @property
    def is_too_narrow(self) -> bool:
        """Tell whether fewer intervals have the truth in them than chance makes of 95 %."""
        figures = len(self.result.figures)
        deviation = math.sqrt(figures * _CONFIDENCE * (1.0 - _CONFIDENCE))
        return self.within < _CONFIDENCE * figures - 2.0 * deviation


def contents(
    results: Results[RecordingLessonResult], frame: LessonFrame
) -> dict[str, RecordingLessonPage]:
    """Return what the page shows of each engine."""
    readings, curves = _readings(results), _curves(results)
    first = next(iter(results.values()))
    figures = _figures(first)
    return {
        name: RecordingLessonPage(frame, result, readings, figures, curves)
        for name, result in results.items()
    }


def _readings(results: Results[RecordingLessonResult]) -> Table:
    """Show what is left of the gap where some causes are fitted."""
    headers = [_SAY("fitted"), _SAY("here"), _SAY("elsewhere"), _SAY("taken"), _SAY("delay")]
    headers.append(_SAY("kp", joint=_WATCHED))
    result = next(iter(results.values()))
    place = result.joints.index(_WATCHED)
    model = f"{result.figure('kp', _WATCHED).model:.0f}"
    rows = [
        [
            _SAY("nothing"),
            degrees(result.here),
            degrees(result.elsewhere),
            percent(0.0),
            "0 ms",
            model,
        ]
    ]
    for reading in result.readings:
        rows.append(
            [
                _name_of(reading),
                degrees(reading.here),
                degrees(reading.elsewhere),
                percent(reading.taken),
                milliseconds(reading.delay, 3),
                f"{reading.kp[place]:.1f}",
            ]
        )
    return Table(headers, rows)


def _name_of(reading: FittedReading) -> str:
    """Return what was fitted, in words."""
    if reading.causes == CAUSES:
        return _SAY("everything")
    return " + ".join(reading.causes)


def _figures(result: RecordingLessonResult) -> Table:
    """Show what the recording tells of some figures, and what they are in truth."""
    shown = [
        result.figure("delay"),
        result.figure("kp", _WATCHED),
        result.figure("kp", "elbow_flex"),
        result.figure("payload"),
        result.figure("offset", _WATCHED),
        result.figure("offset", "shoulder_pan"),
    ]
    headers = [_SAY("figure"), _SAY("fit"), _SAY("low"), _SAY("high"), _SAY("truth"), _SAY("unit")]
    rows: list[list[str]] = []
    for figure in shown:
        numbers = (figure.fitted, figure.low, figure.high, figure.truth)
        cells = [number_text(figure.kind, number) for number in numbers]
        rows.append([_name(figure), *cells, unit_text(figure.kind)])
    return Table(headers, rows, words=frozenset({0, 5}))


def _name(figure: ToldFigure) -> str:
    """Return the name of a figure, and of which joint."""
    return figure.kind if figure.joint is None else f"{figure.kind} {figure.joint}"


def _curves(results: Results[RecordingLessonResult]) -> list[Block]:
    """Draw a joint as it was measured, as each engine's program moves it, and as it is fitted."""
    first = next(iter(results.values()))
    place = first.joints.index(_WATCHED)
    shown = first.time <= _CURVE
    time = first.time[shown].tolist()

    def curve(angles: np.ndarray) -> tuple[list[float], list[float]]:
        return time, np.degrees(angles[shown, place]).tolist()

    as_it_is = _SAY("as_it_is")
    curves = {_SAY("measured"): curve(first.measured)}
    for name, result in results.items():
        curves[f"{where(results, name)}{as_it_is}"] = curve(result.typed)
    for reading in first.readings[:2]:
        curves[_SAY("only", cause=_name_of(reading))] = curve(reading.angles)
    return [Traces(_SAY("curves", joint=_WATCHED), "time [s]", _SAY("angle"), curves)]
