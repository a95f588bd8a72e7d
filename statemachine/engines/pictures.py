"""Pictures without a screen, drawn by an engine in a process of its own.

    with closing(LivePictures([file], (640, 480), camera, renderer_here())) as pictures:
        pictures.ask([(xpos, xquat)])
        picture = pictures.take()       # (height, width, 3) uint8

An OpenGL library that is missing takes the process down that draws with it. So this module is also
the program of that process: pickled on its standard input come first what is to be drawn and how,
then the poses of one picture after the other; the pictures go out as bytes.
"""

from __future__ import annotations

import math
import os
import pickle
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np

from ..errors import EngineError, MissingEngineError
from ..installed import DEFAULT, require
from ..interface import Array
from ..processes import PipedChild, fresh_python
from ..show.drawing.scene import Camera, Motion, Pixels, compose, smaller
from . import raw_engine_of, raw_engines_with

_BIAS = 2  # pixels that the ghost must be nearer by than the solid side before it is seen
Poses = Sequence[tuple[Array, Array]]  # of each side xpos (nbody, 3) and xquat (nbody, 4)


@dataclass(frozen=True)
class Renderer:
    """Something that draws here.

    Attributes:
        name: The engine that draws.
        opengl: The OpenGL that works, as it is told to that engine; "" for its own choice, or
            where none is needed.
    """

    name: str
    opengl: str = ""

    def __str__(self) -> str:
        return raw_engine_of(self.name).drawn_by(self.opengl)


def renderers() -> list[str]:
    """Return the names of the engines that draw, whether or not they can here; the best first."""
    return raw_engines_with("drawer")


def renderer_here() -> Renderer:
    """Return what draws here: the first of `renderers` that can.

    Raises:
        MissingEngineError: None works here.
    """
    require(DEFAULT)  # it reads the models, whoever draws them
    reasons: list[MissingEngineError] = []
    for engine in renderers():
        try:
            return Renderer(engine, raw_engine_of(engine).opengl())
        except MissingEngineError as error:
            reasons.append(error)
    because = "; ".join(map(str, reasons))
    raise MissingEngineError(
        f"nothing here can draw a film: {because}", engine=reasons[0].engine
    ) from reasons[0]


class LivePictures(PipedChild):
    """A process that draws bodies wherever they are told to be, one picture after the other."""

    def __init__(
        self, files: Sequence[Path], size: tuple[int, int], camera: Camera, renderer: Renderer
    ) -> None:
        """Start it.

        Args:
            files: The model of the solid side, and that of the ghost if there is one.
            size: Width and height in pixels, even.
            camera: Where they are seen from.
            renderer: What draws.
        """
        self._size, self._renderer = size, renderer
        command, environment = fresh_python(f"{__name__}:draw_as_asked")
        super().__init__(
            command, raw_engine_of(DEFAULT).drawing_environment(renderer.opengl, environment)
        )
        self._send((renderer.name, files, size, camera))

    def ask(self, poses: Poses) -> None:
        """Ask for a picture, which `take` gives."""
        self._send(poses)

    def take(self) -> Pixels:
        """Return the picture (height, width, 3) uint8 that was asked for first.

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

    def _send(self, content: object) -> None:
        with suppress(OSError):  # it gave up: `take` says why
            pickle.dump(content, self.to)
            self.to.flush()


def drawn(
    sides: Sequence[Motion], size: tuple[int, int], camera: Camera, renderer: Renderer
) -> Generator[Pixels]:
    """Yield pictures (height, width, 3) uint8 of one motion, or of two in one place.

    The first is solid, in the model's own colours; the second a violet ghost where it parts from
    the first. Bodies are where the motions say, so that any engine's run is drawn.

    Args:
        sides: One or two, at the same moments.
        size: Width and height in pixels, even.
        camera: Where they are seen from.
        renderer: What draws.

    Raises:
        EngineError: The process that draws gave up.
    """
    files = [side.drawing.file for side in sides]
    moments = zip(*(zip(side.xpos, side.xquat, strict=True) for side in sides), strict=True)
    with closing(LivePictures(files, size, camera, renderer)) as pictures:
        pictures.ask(next(moments))
        for following in moments:
            pictures.ask(following)  # it draws the next one while somebody looks at this one
            yield pictures.take()
        yield pictures.take()


def draw_as_asked() -> None:
    """Draw what standard input asks for, and end the process."""
    with suppress(BrokenPipeError):  # nobody wants the rest
        _draw()
    os._exit(0)  # a driver may take its time, or fail, in taking its things down


def _draw() -> None:
    name, files, (width, height), camera = pickle.load(sys.stdin.buffer)
    # What a driver prints must not get in between the pictures.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    engine = raw_engine_of(name)
    by = engine.supersampling
    # What they hold they give back with the end of the process.
    drawers = [
        engine.drawer(file, (by * width, by * height), camera, ghost=k > 0)
        for k, file in enumerate(files)
    ]
    bias = _BIAS * 2 * camera.distance * math.tan(math.radians(camera.fovy) / 2) / height
    for poses in iter(_asked().get, None):
        solid, *ghost = (drawer.shot(*pose) for drawer, pose in zip(drawers, poses, strict=True))
        picture = compose(solid, ghost[0] if ghost else None, bias, by)
        out.write(smaller(picture, by).tobytes())
        out.flush()


def _asked() -> SimpleQueue[Any]:
    """Yield the poses from standard input, then None; read in a thread, so that no writer waits."""
    asked: SimpleQueue[Any] = SimpleQueue()

    def listen() -> None:
        with suppress(EOFError, pickle.UnpicklingError):  # a writer that was killed
            while True:
                asked.put(pickle.load(sys.stdin.buffer))
        asked.put(None)

    threading.Thread(target=listen, daemon=True).start()
    return asked
