"""Films: both sides of a comparison in one picture, and how far apart they are.

A film is WebP, written by Pillow. And small pictures of a robot for a page: one pose as
WebP, or a few seconds of a run.
"""

from __future__ import annotations

import io
import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...atomic_files import replace_file
from ...backends import load
from ...engines.pictures import Renderer, drawn, renderer_here
from ...errors import BadInputError, MissingEngineError, TraceError
from ...installed import require_extra
from ...interface import Array, Model
from ...measures import nearest
from ...show import charts as figures
from ...show.drawing import drawing_of
from ...show.drawing.scene import Camera, Motion, Pixels, camera_for, framed, poses_through
from ...show.pictures import Picture, RobotPicture
from ..compare import Comparison, labels_of
from ..recordings import Trace
from ..runs.drive import Progress, no_progress
from .film_overlay import Overlay
from .stage.quantity_chart import charts_of

SUFFIX = ".webp"
FILM_SIZE = (640, 480)  # width and height [pixels]
_LONGEST = 5000  # pictures of one film
_WEBP: dict[str, Any] = {
    "format": "WEBP",
    "save_all": True,
    "loop": 0,
    "quality": 70,
    "method": 3,
    "kmin": 30,  # pictures between those that stand alone
    "kmax": 60,
}


@dataclass(frozen=True)
class Timing:
    """When the pictures are of, and how long each is shown.

    Attributes:
        seconds: Simulated time that the film shows [s].
        fps: Pictures a second.
    """

    seconds: float
    fps: float = 30.0

    @property
    def count(self) -> int:
        """Return the number of pictures, at least 1."""
        return max(1, math.ceil(self.seconds * self.fps - 1e-6))

    @property
    def times(self) -> Array:
        """Return the simulated time of each picture (count,) [s]."""
        return np.arange(self.count) / self.fps

    @property
    def milliseconds(self) -> list[int]:
        """Return how long each picture is shown [ms]: together the whole of simulated time."""
        ends = np.append(np.arange(self.count) / self.fps, self.seconds)
        return np.diff(np.round(1000 * ends)).astype(int).tolist()


@dataclass(frozen=True)
class FilmFile:
    """A film that was written.

    Attributes:
        path: Where it was written.
        pictures: How many it has.
        seconds: How long it takes to watch [s].
        size: Of the file [bytes].
        renderer: What drew it.
    """

    path: Path
    pictures: int
    seconds: float
    size: int
    renderer: str


def check_film(path: Path) -> None:
    """Check that there can be such a film, before anything is run.

    Raises:
        BadInputError: The path has another suffix.
        MissingEngineError: An extra is missing.
    """
    suffix = path.suffix.lower()
    if suffix != SUFFIX:
        hint = "; WebP is smaller and has all colours" if suffix == ".gif" else ""
        raise BadInputError(f"a film is a file {SUFFIX}; got {path.name!r}{hint}")
    require_extra("PIL.Image", "a film", "Pillow", "render")
    figures.require_matplotlib()


def write_film(
    path: Path,
    traces: Sequence[Trace],
    models: Sequence[Model],
    renderer: Renderer,
    comparison: Comparison | None = None,
    *,
    progress: Progress = no_progress,
) -> FilmFile:
    """Write a film of one trace, or of two and how far apart they are.

    Args:
        path: A file .webp; it is there whole or not at all.
        traces: The first is drawn solid, a second one as a ghost.
        models: What each looks like.
        renderer: What draws.
        comparison: Of the two; has the tolerance that is drawn.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: See `check_film`; or there would be too many pictures.
        MissingEngineError: An extra is missing.
        TraceError: A model has other bodies than its trace.
    """
    check_film(path)
    timing = timing_of(traces)
    header = traces[0].header
    # How far apart the fingertips are; without one, what is farthest beyond its tolerance.
    strip = max(
        charts_of(comparison) if comparison else (),
        key=lambda chart: (chart.curve.kind == "tip", chart.agreement.tolerances()),
        default=None,
    )
    labels = labels_of(header, traces[1].header).long if len(traces) > 1 else [header.label]
    overlay = Overlay(FILM_SIZE, timing.times, header.experiment, labels, strip)
    shots = frames(traces, models, overlay.inner, timing, renderer)

    def pictures() -> Iterator[Any]:
        for k, shot in enumerate(shots):
            progress((k + 1) / timing.count)  # before: nobody asks for more than the last
            yield overlay.paint(shot, k)

    try:
        replace_file(path, lambda out: write_webp(out, pictures(), timing.milliseconds))
    finally:
        shots.close()
    return FilmFile(
        path=path,
        pictures=timing.count,
        seconds=sum(timing.milliseconds) / 1000,
        size=path.stat().st_size,
        renderer=str(renderer),
    )


def timing_of(traces: Sequence[Trace]) -> Timing:
    """Return the timing of a film of the time that all traces have.

    Raises:
        BadInputError: There would be too many pictures.
    """
    seconds = min(float(trace.time[-1] - trace.time[0]) for trace in traces)
    timing = Timing(round(seconds, 9))
    if timing.count > _LONGEST:
        raise BadInputError(
            f"the film would have {timing.count} pictures; at most {_LONGEST}: lower --seconds"
        )
    return timing


def frames(
    traces: Sequence[Trace],
    models: Sequence[Model],
    size: tuple[int, int],
    timing: Timing,
    renderer: Renderer,
    camera: Camera | None = None,
) -> Generator[Pixels]:
    """Yield pictures (height, width, 3) uint8 of one trace, or of two in one place.

    Args:
        traces: The first is drawn solid, a second one as a ghost where it parts from the first.
        models: What each looks like.
        size: Width and height in pixels, even.
        timing: Which moments.
        renderer: What draws.
        camera: By default one that has the whole motion in its picture.

    Raises:
        TraceError: A model has other bodies than its trace.
        EngineError: The process that draws gave up.
    """
    sides = [
        motion_of(trace, model, timing.times) for trace, model in zip(traces, models, strict=True)
    ]
    if camera is None:
        camera = camera_for(sides, size[0] / size[1])
    return drawn(sides, size, camera, renderer)


def motion_of(trace: Trace, model: Model, times: Array) -> Motion:
    """Return the poses of a trace at times (n,) [s] from its start, each of the nearest row.

    The poses of a trace that has none are computed from its qpos.

    Raises:
        TraceError: The model has other bodies than the trace, or a pose is not a number.
    """
    if tuple(model.body_names) != trace.header.bodies:
        raise TraceError(
            f"{model.path.name} has other bodies than the trace of {trace.header.experiment}: "
            "it cannot be drawn with it"
        )
    rows = nearest(trace.time - trace.time[0], times)
    if "xpos" not in trace or "xquat" not in trace:
        return Motion(drawing_of(model), *poses_through(model, trace.qpos[rows]))
    xpos, xquat = trace["xpos"][rows], trace["xquat"][rows]
    not_finite = ~(np.isfinite(xpos).all((1, 2)) & np.isfinite(xquat).all((1, 2)))
    if not_finite.any():
        raise TraceError(
            f"from {times[int(np.argmax(not_finite))]:.3g} s on the trace has no poses of the "
            "bodies that are numbers: it cannot be drawn"
        )
    return Motion(drawing_of(model), xpos, xquat)


def write_webp(out: BinaryIO, pictures: Iterator[Any], milliseconds: list[int]) -> None:
    """Write an animated WebP; `pictures` are Pillow's images, taken one at a time."""
    reel = next(pictures).copy()
    at = 0

    def seek(number: int) -> None:
        # Pillow asks for picture after picture, and in the end for the first again.
        nonlocal at
        while at < number:
            reel.paste(next(pictures))
            at += 1

    # An image of many pictures, as Pillow knows them, that holds one of them at a time.
    reel.n_frames, reel.seek = len(milliseconds), seek
    reel.save(out, duration=milliseconds, **_WEBP)


_SIZE = (480, 360)
_LAST = 1500  # milliseconds that the last pose of a film is shown
_CLOSE = 0.07  # metres about a body that is looked at from close by


def webp(picture: RobotPicture) -> bytes:
    """Return the picture as WebP, animated if it has several poses.

    Raises:
        MissingEngineError: Nothing here can draw, or Pillow is not installed.
    """
    image_of = require_extra("PIL.Image", "the picture of a robot", "Pillow", "render")
    renderer = renderer_here()
    model = load(picture.model)
    drawing = drawing_of(model)
    sides = [
        Motion(drawing, *poses_through(model, qpos)) for qpos in picture.poses() if qpos is not None
    ]
    camera = camera_for(sides, _SIZE[0] / _SIZE[1])
    if picture.near:
        camera = _close(camera, sides, model.body_id(picture.near))
    milliseconds = [round(1000 * picture.interval)] * len(sides[0].xpos)
    milliseconds[-1] = _LAST
    out = io.BytesIO()
    shots = drawn(sides, _SIZE, camera, renderer)
    write_webp(out, (image_of.fromarray(shot) for shot in shots), milliseconds)
    return out.getvalue()


def drawn_picture(picture: Picture) -> tuple[bytes, str]:
    """Draw a picture of a page; return its bytes and kind: "svg+xml", or "webp" of a robot.

    Raises:
        MissingEngineError: What draws it is not installed.
    """
    if isinstance(picture, RobotPicture):
        return webp(picture), "webp"
    return figures.drawn([picture], "svg"), "svg+xml"


def inline(picture: Picture) -> str:
    """Return a picture as a data URL; "" without what draws it."""
    try:
        content, kind = drawn_picture(picture)
    except MissingEngineError:
        return ""
    return figures.data_url(content, kind)


def _close(camera: Camera, sides: list[Motion], body: int) -> Camera:
    """Return a camera in the same direction that sees what is about a body."""
    places: Array = np.concatenate([side.xpos[:, body] for side in sides])
    corners = _CLOSE * np.stack(np.meshgrid(*[(-1, 1)] * 3), axis=-1).reshape(-1, 3)
    points = (places[:, None] + corners).reshape(-1, 3)
    return framed(points, _SIZE[0] / _SIZE[1], camera.azimuth, camera.elevation)
