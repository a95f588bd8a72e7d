"""The pictures of a film, one after the other."""

from __future__ import annotations

import json
import math
from collections.abc import Generator, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..drawing.camera import Camera, framed
from ..drawing.shots import Pixels
from ..engines import room
from ..errors import BadInputError, EngineError
from ..installed import DEFAULT
from ..interface import Array, Model
from ..processes import fresh_python
from ..processes.pipes import PipedChild
from ..runs import Trace
from .motion import Motion, corners, models_of, motion_of
from .probe import Renderer, renderer_here

LONGEST = 5000  # pictures of one film
_SMALLEST, _LARGEST = (64, 48), (1920, 1440)
# From the front, to the right or to the left of the arm, which reaches along x; and below them.
_AZIMUTHS, _ELEVATION = (140.0, 220.0, 110.0, 250.0), -20.0
_BIAS = 2  # pixels that the ghost must be nearer by than the solid side before it is seen


@dataclass(frozen=True)
class Timing:
    """When the pictures are of, and how long each is shown.

    Attributes:
        seconds: Simulated time that the film shows [s].
        fps: Pictures a second.
        slow: How many times as long it takes to watch.
    """

    seconds: float
    fps: float = 30.0
    slow: float = 1.0

    @property
    def count(self) -> int:
        """How many pictures."""
        return max(1, math.ceil(self.seconds * self.slow * self.fps - 1e-6))

    @property
    def times(self) -> Array:
        """(count,) simulated time of each [s]."""
        return np.arange(self.count) / (self.fps * self.slow)

    @property
    def milliseconds(self) -> list[int]:
        """How long each is shown: together the whole of simulated time, times `slow`."""
        ends = np.append(np.arange(self.count) / self.fps, self.seconds * self.slow)
        return np.diff(np.round(1000 * ends)).astype(int).tolist()


def timing_of(one: Trace, two: Trace | None = None, fps: float = 30.0, slow: float = 1.0) -> Timing:
    """The timing of a film of what both traces have.

    Raises:
        BadInputError: fps is not from 1 to 60, slow not from 0.05 to 100, or there would be
            more than `LONGEST` pictures.
    """
    check_speed(fps, slow)
    lengths = [float(trace.time[-1] - trace.time[0]) for trace in (one, two) if trace is not None]
    timing = Timing(round(min(lengths), 9), fps, slow)
    if timing.count > LONGEST:
        raise BadInputError(
            f"the film would have {timing.count} pictures; at most {LONGEST}: lower --fps, "
            "--slow or --seconds"
        )
    return timing


def check_speed(fps: float, slow: float) -> None:
    """Raise BadInputError for what no film is shown with."""
    if not 1 <= fps <= 60:
        raise BadInputError(f"--fps is from 1 to 60 pictures a second; got {fps:g}")
    if not 0.05 <= slow <= 100:
        raise BadInputError(f"--slow is from 0.05 to 100 times as long; got {slow:g}")


def check_size(size: tuple[int, int], smallest: tuple[int, int] = _SMALLEST) -> None:
    """Raise BadInputError for a width and height that no film has."""
    for k, word in enumerate(("width", "height")):
        if not smallest[k] <= size[k] <= _LARGEST[k] or size[k] % 2:
            raise BadInputError(
                f"the {word} of a film is even, from {smallest[k]} to {_LARGEST[k]} pixels; "
                f"got {size[k]}"
            )


def frames(
    one: Trace,
    two: Trace | None = None,
    *,
    size: tuple[int, int] = (640, 480),
    timing: Timing | None = None,
    models: tuple[Model, ...] | None = None,
    renderer: Renderer | None = None,
    camera: Camera | None = None,
) -> Generator[Pixels]:
    """Pictures (height, width, 3) uint8 of one trace, or of two in one place.

    Args:
        one: Drawn solid, in the model's own colours.
        two: Drawn as a violet ghost where it parts from the first.
        size: Width and height in pixels, even.
        timing: Which moments; by default 30 a second of what both traces have.
        models: What they look like, one for each trace; by default what the traces name.
        renderer: What draws; by default what works here.
        camera: By default one that has the whole motion in its picture.

    Raises:
        MissingEngineError: Nothing here can draw.
        ModelFileError: The model's file is not here.
        TraceError: The model has other bodies than a trace.
        EngineError: The process that draws gave up.
    """
    traces = (one,) if two is None else (one, two)
    check_size(size)
    timing = timing_of(one, two) if timing is None else timing
    models = models_of(*traces) if models is None else models
    motions = [
        motion_of(trace, model, timing.times) for trace, model in zip(traces, models, strict=True)
    ]
    if camera is None:
        camera = camera_for(motions, models, size)
    yield from drawn(motions, size, camera, renderer_here() if renderer is None else renderer)


def camera_for(motions: list[Motion], models: tuple[Model, ...], size: tuple[int, int]) -> Camera:
    """A camera that has all bodies in its picture at every moment, on both sides.

    It stands where the bodies lie widest beside one another, on the mean of all moments.
    """
    points = [corners(motion, model) for motion, model in zip(motions, models, strict=True)]

    def width(azimuth: float) -> float:
        right = Camera((0, 0, 0), 1, azimuth, 0).axes[0]
        return sum(float((motion.xpos[:, 1:] @ right).std(axis=1).sum()) for motion in motions)

    widths = [width(azimuth) for azimuth in _AZIMUTHS]
    # The first that is nearly as good as the best: a hair must not turn the camera.
    azimuth = _AZIMUTHS[next(k for k, found in enumerate(widths) if found >= 0.9 * max(widths))]
    return framed(np.concatenate(points), size[0] / size[1], azimuth, _ELEVATION)


def drawn(
    motions: list[Motion], size: tuple[int, int], camera: Camera, renderer: Renderer
) -> Generator[Pixels]:
    """Pictures of one motion, or of two in one place, as `frames` has them."""
    files = [motion.file for motion in motions]
    bodies = [motion.xpos.shape[1] for motion in motions]
    with closing(LivePictures(files, bodies, size, camera, renderer)) as pictures:
        last = len(motions[0].xpos) - 1
        for k in range(-1, last):
            pictures.ask([(motion.xpos[k + 1], motion.xquat[k + 1]) for motion in motions])
            if k >= 0:  # it draws the next one while somebody looks at this one
                yield pictures.take()
        yield pictures.take()


class LivePictures(PipedChild):
    """A process that draws bodies wherever they are told to be, one picture after the other."""

    def __init__(
        self,
        files: Sequence[Path],
        bodies: Sequence[int],
        size: tuple[int, int],
        camera: Camera,
        renderer: Renderer,
    ) -> None:
        """Start it.

        Args:
            files: The model of the solid side, and that of the ghost if there is one.
            bodies: How many bodies each has.
            size: Width and height in pixels, even.
            camera: Where they are seen from.
            renderer: What draws.
        """
        self._size = size
        self._renderer = renderer
        facts = {
            "renderer": renderer.name,
            "sharper": room(renderer.name).sharper,
            "files": [str(file) for file in files],
            "bodies": list(bodies),
            "size": size,
            "camera": asdict(camera),
            "bias": _BIAS * 2 * camera.distance * math.tan(math.radians(camera.fovy) / 2) / size[1],
        }
        command, environment = fresh_python(f"{__package__}._child")
        super().__init__(command, room(DEFAULT).drawing_environment(renderer.opengl, environment))
        self._send(json.dumps(facts).encode() + b"\n")

    def ask(self, poses: Sequence[tuple[Array, Array]]) -> None:
        """Ask for a picture, which `take` gives: of each side xpos (nbody, 3), xquat (nbody, 4)."""
        rows = np.vstack([np.hstack([xpos, xquat]) for xpos, xquat in poses])
        self._send(rows.astype(np.float64).tobytes())

    def take(self) -> Pixels:
        """The picture (height, width, 3) uint8 that was asked for first.

        Raises:
            EngineError: The process gave up.
        """
        width, height = self._size
        picture = self.out.read(3 * width * height)
        if len(picture) < 3 * width * height:
            raise EngineError(f"{self._renderer} gave up drawing: {self.how_it_ended()}")
        return np.frombuffer(picture, dtype=np.uint8).reshape(height, width, 3)

    def close(self) -> None:
        """End the process, at once. Idempotent."""
        self.kill()
        super().close()

    def _send(self, content: bytes) -> None:
        with suppress(OSError):  # it gave up: `take` says why
            self.to.write(content)
            self.to.flush()
