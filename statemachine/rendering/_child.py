"""The process that draws: a job comes in, pictures go out one after the other.

python -c '… main()'  < job.npz  > pictures
"""

from __future__ import annotations

import importlib
import io
import json
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..drawing.camera import Camera
from ..drawing.shots import Drawer
from .compose import compose, halved


def main() -> None:
    """Draw what standard input asks for."""
    with suppress(ValueError, OSError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started this ends it
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as file:
        job = {name: file[name] for name in file.files}
    # What a driver prints must not get in between the pictures.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with suppress(BrokenPipeError):  # nobody wants the rest
        draw(job, out)
        out.close()
    os._exit(0)  # a driver may take its time, or fail, in taking its things down


def draw(job: dict[str, Any], out: Any) -> None:
    """Write the pictures of a job, (height, width, 3) uint8 each, into `out`."""
    facts = json.loads(job["facts"].astype(np.uint8).tobytes())
    camera = Camera(**facts["camera"])
    width, height = facts["size"]
    sharper = facts["sharper"]
    drawer: Drawer = importlib.import_module(facts["renderer"]).drawer(
        [Path(file) for file in facts["files"]], (width * sharper, height * sharper), camera
    )
    try:
        for k in range(len(job["xpos0"])):
            shots = [
                drawer.shot(side, job[f"xpos{side}"][k], job[f"xquat{side}"][k])
                for side in range(len(facts["files"]))
            ]
            ghost = shots[1] if len(shots) > 1 else None
            picture = compose(shots[0], ghost, facts["bias"], sharper)
            out.write(np.ascontiguousarray(halved(picture, sharper)).tobytes())
            out.flush()
    finally:
        drawer.close()
