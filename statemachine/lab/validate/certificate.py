"""Page of a certificate: the grade of the reading first, then how far apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ...installed import PAIR, WITNESS
from ...measures.text import degrees, grouped, millimetres, vector
from ...show.blocks import Page, Table
from ...show.engine_tables import by_engine, differences, origin
from ...show.templates import PageContent, render
from .fingertip_result import SAME_FRAME, FingertipResult, FrameOffset, TipGap

_Choice = Literal["asked for", "usual site", "only end", "ends"]
_MAX_ROWS = 12  # rows of a table of tips
_TINY = 5e-6  # [m or rad] that two decimals of a millimetre or a degree do not show


@dataclass(frozen=True)
class _OfEngines:
    """What is said of engines of which the same is to be said.

    Attributes:
        label: Their names with a colon; "" where the same is said of all.
        result: Of the first of them.
    """

    label: str
    result: FingertipResult

    @property
    def version(self) -> str:
        """Return the version of the witness."""
        return self.result.provenance.versions[WITNESS]

    @property
    def seed(self) -> str:
        """Return the seed of the random poses."""
        return str(self.result.provenance.seed)

    @property
    def choice(self) -> _Choice:
        """Return how the sites or bodies were chosen."""
        if not self.result.chosen:
            return "asked for"
        if not self.result.has_one_tip:
            return "ends"
        return "usual site" if self.result.kind == "site" else "only end"

    @property
    def renamed_tip(self) -> bool:
        """Tell whether the one site or body goes by another name for the witness."""
        return self.result.has_one_tip and self.result.has_other_names

    @property
    def balanced(self) -> tuple[str, ...]:
        """Return the bodies whose inertia was balanced."""
        repairs = [repair for repair in self.result.repairs if not repair.is_massless]
        return tuple(repair.name for repair in repairs if repair.quantity == "inertia")

    @property
    def massless(self) -> tuple[str, ...]:
        """Return the bodies that move without mass, and got the least that the engine takes."""
        names = [repair.name for repair in self.result.repairs if repair.is_massless]
        return tuple(dict.fromkeys(names))

    @property
    def left_out_meshes(self) -> tuple[str, ...]:
        """Return the meshes that were left out."""
        repairs = self.result.repairs
        return tuple(repair.name for repair in repairs if repair.kind == "mesh")

    @property
    def renamed_joints(self) -> tuple[str, ...]:
        """Return the joints of other names for the witness, each with that name."""
        pairs = self.result.renamed_joints
        return tuple(f"{pair.joint} is {pair.witness_joint}" for pair in pairs)

    @property
    def offset(self) -> str:
        """Return how far the two frames are apart."""
        return _offset(self.result.frames)


@dataclass(frozen=True)
class FingertipPage(PageContent):
    """Content of the page of a certificate.

    Attributes:
        origin: Model, engines and timestep.
        has_second_engine: Whether the second engine of the course is among the engines.
        readings: What the witness read, by engines.
        findings: What the certificate says, by engines.
        gaps: Tables of the gaps.
        differences: Tables of how far the engines themselves are apart.
    """

    template = "certificate.md.j2"
    origin: str
    has_second_engine: bool
    readings: Sequence[_OfEngines]
    findings: Sequence[_OfEngines]
    gaps: Sequence[Table]
    differences: Sequence[Table]


def page(results: Mapping[str, FingertipResult]) -> Page:
    """Return the page of a certificate: frames first, then the differences."""
    content = FingertipPage(
        origin(results),
        PAIR[1] in results,
        _by_engines(results, _reading_of),
        _by_engines(results, _finding_of),
        tables_of_gaps(results),
        tables_of_differences(results),
    )
    return render(content)


def _by_engines(
    results: Mapping[str, FingertipResult], told: Callable[[FingertipResult], Hashable]
) -> list[_OfEngines]:
    """Return the engines of which the same is told together."""
    groups = grouped((told(result), engine) for engine, result in results.items())
    found: list[_OfEngines] = []
    for engines in groups.values():
        label = f"{', '.join(engines)}: " if len(groups) > 1 else ""
        found.append(_OfEngines(label, results[engines[0]]))
    return found


def _reading_of(result: FingertipResult) -> Hashable:
    """Return all that the page says of what the witness read."""
    tips = (result.site if result.has_one_tip else len(result.tips), result.chosen)
    read = (result.grade, result.reason, result.witness_file, result.prepared)
    pairs = (result.relative_to, result.renamed_joints, result.left_out)
    pairs += (result.refusal, result.repairs)
    return tips, read, pairs, result.poses, result.provenance.seed


def _finding_of(result: FingertipResult) -> Hashable:
    """Return all that the page says of what the certificate found."""
    frames: Hashable = None
    if result.verdict in ("different frames", "no common body"):
        frames = (result.site, result.witness_frame, _offset(result.frames))
    return result.verdict, result.grade, result.tolerance, frames


def tables_of_gaps(results: Mapping[str, FingertipResult]) -> list[Table]:
    """Return the gaps: of one tip by engine, of several a table for each engine."""
    first = next(iter(results.values()))
    if first.has_one_tip:
        return [table_of_gap(results)]
    return [table_of_tips(engine, result) for engine, result in results.items()]


def table_of_gap(results: Mapping[str, FingertipResult]) -> Table:
    """Return the gap of the one tip by engine."""
    rows = {
        "grade": _grade,
        "distance of the two frames": _frames,
        "default pose [m]": _default_pose,
        "position, worst [m]": _position_worst,
        "position, median [m]": _position_median,
        "rotation matrix, worst": _rotation_worst,
        "rotation matrix, median": _rotation_median,
    }
    return by_engine(results, rows, "Engine against witness")


def _grade(result: FingertipResult) -> str:
    return result.grade


def _frames(gap: FingertipResult | TipGap) -> str:
    return _offset(gap.frames)


def _default_pose(result: FingertipResult) -> str:
    return vector(result.default_pose)


def _position_worst(gap: FingertipResult | TipGap) -> str:
    return _figure(gap.position_worst)


def _position_median(result: FingertipResult) -> str:
    return _figure(result.position_median)


def _rotation_worst(gap: FingertipResult | TipGap) -> str:
    return _figure(gap.rotation_worst)


def _rotation_median(result: FingertipResult) -> str:
    return _figure(result.rotation_median)


def table_of_tips(engine: str, result: FingertipResult) -> Table:
    """Return the worst gaps of an engine; those that are not shown are no larger."""
    columns: dict[str, Callable[[TipGap], str]] = {"tip": _site}
    if result.has_other_names:
        columns["for the witness"] = _witness_frame
    columns["position, worst [m]"] = _position_worst
    columns["rotation matrix, worst"] = _rotation_worst
    columns["distance of the two frames"] = _frames
    return Table.of(
        result.tips[:_MAX_ROWS],
        columns,
        title=f"{engine} against the witness, the worst of {len(result.tips)} ({result.grade})",
        wide=("distance of the two frames",),
    )


def _site(gap: TipGap) -> str:
    return gap.site


def _witness_frame(gap: TipGap) -> str:
    return gap.witness_frame


def tables_of_differences(results: Mapping[str, FingertipResult]) -> list[Table]:
    """Return how far the engines' own default poses are apart, if all are of one tip."""
    if len({result.site for result in results.values()}) > 1:
        return []
    return differences(results, {"default pose": _apart})


def _apart(first: FingertipResult, other: FingertipResult) -> str:
    return f"{math.dist(first.default_pose, other.default_pose):.1e} m"


def _offset(offset: FrameOffset | None) -> str:
    """Write an offset between two frames; None is of files without a common body."""
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{_length(offset.distance)}, {_angle(offset.angle)}"


def _length(metres: float) -> str:
    """Write a length in millimetres; a tiny one, which would read as none, in metres."""
    if SAME_FRAME < metres < _TINY:
        return f"{metres:.1e} m"
    return millimetres(metres)


def _angle(radians: float) -> str:
    """Write an angle in degrees; a tiny one, which would read as none, in radians."""
    if SAME_FRAME < radians < _TINY:
        return f"{radians:.1e} rad"
    return degrees(radians)


def _figure(value: float | None) -> str:
    """Write a difference; None is of two frames, which are not compared."""
    return "refused" if value is None else f"{value:.1e}"
