"""The process that draws: poses come in, pictures go out one after the other.

The first line of standard input is JSON, what is to be drawn and how. Then come the poses of
each picture: of each side (nbody, 7) float64, xpos and xquat of each body.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np

from ..drawing.camera import Camera
from ..engines import room
from ..interface import Array
from .compose import compose, halved


def main() -> None:
    """Draw what standard input asks for."""
    facts = json.loads(sys.stdin.buffer.readline())
    # What a driver prints must not get in between the pictures.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with suppress(BrokenPipeError):  # nobody wants the rest
        draw(facts, out)
        out.close()
    os._exit(0)  # a driver may take its time, or fail, in taking its things down


def draw(facts: dict[str, Any], out: Any) -> None:
    """Write a picture (height, width, 3) uint8 into `out` for each poses that come in."""
    camera = Camera(**facts["camera"])
    width, height = facts["size"]
    sharper = facts["sharper"]
    engine, size = room(facts["renderer"]), (width * sharper, height * sharper)
    # What they hold they give back with the end of the process.
    drawers = [
        engine.drawer(Path(file), size, camera, ghost=k > 0)
        for k, file in enumerate(facts["files"])
    ]
    for sides in _poses(facts["bodies"]):
        shots = [
            drawer.shot(poses[:, :3], poses[:, 3:])
            for drawer, poses in zip(drawers, sides, strict=True)
        ]
        ghost = shots[1] if len(shots) > 1 else None
        picture = compose(shots[0], ghost, facts["bias"], sharper)
        out.write(halved(picture, sharper).tobytes())
        out.flush()


def _poses(bodies: list[int]) -> Iterator[list[Array]]:
    """What standard input tells, until it ends; read in a thread, so that no writer waits."""
    told: SimpleQueue[bytes] = SimpleQueue()
    size = 7 * 8 * sum(bodies)

    def listen() -> None:
        content = b"-"
        while content:
            content = sys.stdin.buffer.read(size)
            told.put(content)

    threading.Thread(target=listen, daemon=True).start()
    while len(content := told.get()) == size:
        rows = np.frombuffer(content).reshape(-1, 7)
        yield np.split(rows, np.cumsum(bodies)[:-1])


if __name__ == "__main__":
    main()
