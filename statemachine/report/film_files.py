"""Films as files: WebP by Pillow, mp4 by ffmpeg. There whole, or not at all."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import EngineError
from ..runs.whole import beside, replace_file

SUFFIXES = (".webp", ".mp4")
_QUALITY = 70  # of WebP, 0 to 100
_KEY = (30, 60)  # pictures between those that stand alone


def write_webp(path: Path, pictures: Iterator[Any], milliseconds: list[int]) -> None:
    """Write an animated WebP; `pictures` are Pillow's images, taken one at a time."""
    first = next(pictures)
    reel = first.copy()
    at = 0

    def seek(number: int) -> None:
        # Pillow asks for picture after picture, and in the end for the first again.
        nonlocal at
        while at < number:
            reel.paste(next(pictures))
            at += 1

    # An image of many pictures, as Pillow knows them, that holds one of them at a time.
    reel.n_frames, reel.seek = len(milliseconds), seek

    def fill(out: BinaryIO) -> None:
        reel.save(
            out,
            format="WEBP",
            save_all=True,
            duration=milliseconds,
            loop=0,
            quality=_QUALITY,
            method=3,
            kmin=_KEY[0],
            kmax=_KEY[1],
        )

    replace_file(path, fill)


def write_mp4(path: Path, pictures: Iterator[Any], size: tuple[int, int], fps: float) -> None:
    """Write an mp4 that every player takes: H.264, 4:2:0, its index at the beginning.

    Raises:
        EngineError: ffmpeg gave up.
    """
    import imageio_ffmpeg

    command = [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}"),
        *("-i", "-", "-an", "-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p"),
        *("-movflags", "+faststart", "-fflags", "+bitexact", "-flags:v", "+bitexact"),
    ]
    with beside(path) as (name,), tempfile.TemporaryFile() as said:
        _feed([*command, "-f", "mp4", name], pictures, said)


def _feed(command: list[str], pictures: Iterator[Any], said: Any) -> None:
    child = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=said,
        start_new_session=True,  # a Ctrl-C of the terminal is ours to hear, and to end it then
    )
    assert child.stdin is not None
    try:
        try:
            for picture in pictures:
                child.stdin.write(picture.tobytes())
            child.stdin.close()
        except BrokenPipeError:
            pass
        code = child.wait()
    finally:  # also on Ctrl-C: no ffmpeg is left behind
        child.kill()
        with suppress(OSError):
            child.stdin.close()
        child.wait()
    if code:
        said.seek(0)
        lines = said.read().decode(errors="replace").strip().splitlines() or [f"code {code}"]
        raise EngineError(f"ffmpeg gave up: {lines[-1]}")
