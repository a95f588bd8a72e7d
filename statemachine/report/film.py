"""A film of a comparison: both sides in one picture, and how far apart they are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..compare import Comparison, compare, labels_of, series
from ..errors import BadInputError
from ..installed import require_extra
from ..interface import Model
from ..rendering import Renderer, Timing, frames, renderer_here, timing_of
from ..rendering.pictures import check_size
from ..runs import Trace
from ..runs.drive import Progress, silent
from .figures import require_matplotlib
from .film_files import SUFFIXES, write_mp4, write_webp
from .film_overlay import Overlay
from .over_time import QuantityChart, charts_of

SMALLEST = (240, 180)  # in which the strip and the text have room


@dataclass(frozen=True)
class Film:
    """A film that was written.

    Attributes:
        path: Where.
        pictures: How many.
        seconds: How long it takes to watch [s].
        size: Bytes.
        renderer: What drew it.
    """

    path: Path
    pictures: int
    seconds: float
    size: int
    renderer: str


def check_suffix(path: Path) -> None:
    """Raise BadInputError for a file that is no film, MissingEngineError without an extra."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        hint = "; WebP is smaller and has all colours" if suffix == ".gif" else ""
        raise BadInputError(f"a film is a file {' or '.join(SUFFIXES)}; got {path.name!r}{hint}")
    require_extra("PIL.Image", "a film", "Pillow", "render")
    require_matplotlib()
    if suffix == ".mp4":
        require_extra("imageio_ffmpeg", "mp4", "ffmpeg", "mp4", "WebP needs nothing more")


def write_film(
    path: Path,
    one: Trace,
    two: Trace | None = None,
    comparison: Comparison | None = None,
    *,
    size: tuple[int, int] = (640, 480),
    fps: float = 30.0,
    slow: float = 1.0,
    models: tuple[Model, ...] | None = None,
    renderer: Renderer | None = None,
    progress: Progress = silent,
) -> Film:
    """Write a film of one trace, or of two and how far apart they are.

    Args:
        path: A file .webp or .mp4; it is there whole or not at all.
        one: Drawn solid.
        two: Drawn as a ghost.
        comparison: Of the two; has the tolerance that is drawn.
        size: Width and height [pixels], even.
        fps: Pictures a second.
        slow: How many times as long as simulated time it takes.
        models: What they look like; by default what the traces name.
        renderer: What draws; by default what works here.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: The path, size, fps or slow cannot be.
        MissingEngineError: An extra is missing, or nothing here can draw.
    """
    check_suffix(path)
    check_size(size, SMALLEST)
    timing = timing_of(one, two, fps, slow)
    renderer = renderer_here() if renderer is None else renderer
    strip = _strip(one, two, comparison)
    labels = [one.header.label] if two is None else labels_of(one.header, two.header).long
    overlay = Overlay(size, timing, one.header.experiment, labels, strip)
    drawn = frames(
        one,
        two,
        size=overlay.inner,
        timing=timing,
        models=models,
        renderer=renderer,
    )

    def pictures() -> Iterator[Any]:
        for k, frame in enumerate(drawn):
            progress((k + 1) / timing.count)  # before: nobody asks for more than the last
            yield overlay.paint(frame, k)

    try:
        if path.suffix.lower() == ".mp4":
            write_mp4(path, pictures(), size, fps)
        else:
            write_webp(path, pictures(), timing.milliseconds)
    finally:
        drawn.close()
    return Film(path, timing.count, _length(path, timing), path.stat().st_size, str(renderer))


def _length(path: Path, timing: Timing) -> float:
    if path.suffix.lower() == ".mp4":  # all of its pictures are shown equally long
        return timing.count / timing.fps
    return sum(timing.milliseconds) / 1000


def _strip(one: Trace, two: Trace | None, comparison: Comparison | None) -> QuantityChart | None:
    """How far apart the fingertips are; without one, what is farthest beyond its tolerance."""
    if two is None:
        return None
    if comparison is None:
        comparison = compare(one, two)
    charts = charts_of(comparison, one, two, series(one, two), None)
    return max(
        charts,
        key=lambda each: (each.curve.kind == "tip", each.found.tolerances()),
        default=None,
    )
