"""What is written over the pictures of a film: who is who, the time, and the strip below."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..drawing.shots import GHOST
from ..measures.text import quantity
from ..rendering import Timing
from .figures import chart
from .over_time import QuantityChart

_INK, _PAPER = (34, 34, 34), (255, 255, 255)
_VIOLET = tuple(round(255 * part) for part in GHOST)
_ORANGE = (230, 159, 0)
STRIP = 0.18  # of the film's height
_BOX = (0.11, 0.25, 0.86, 0.5)  # of the axes of a strip: left, bottom, width, height
_TO_COME = 0.6  # how pale the curve is after the moment that is shown


class Overlay:
    """Writes above and below the pictures of one film.

    Attributes:
        inner: Width and height that is left for the pictures.
    """

    def __init__(
        self,
        size: tuple[int, int],
        timing: Timing,
        title: str,
        labels: Sequence[str],
        strip: QuantityChart | None,
    ) -> None:
        """Prepare what is the same in all pictures.

        Args:
            size: Width and height of the film.
            timing: Of the film.
            title: What is done.
            labels: Who the solid side is, and the ghost.
            strip: How far apart the sides are, drawn below.
        """
        from PIL import Image, ImageFont

        self._size, self._timing, self._strip = size, timing, strip
        self._labels, self._title = [_plain(label) for label in labels], _plain(title)
        self._text = max(10, round(min(size[1] / 30, size[0] / 40)))
        self._font = ImageFont.load_default(self._text)
        self._fine = max(9, round(0.8 * self._text))
        self._small = ImageFont.load_default(self._fine)
        # Even heights: mp4 keeps colours by squares of two pixels.
        self._low = low = 2 * round(STRIP * size[1] / 2) if strip is not None else 0
        self._high = 2 * round(1.6 * self._text)
        self.inner = (size[0], size[1] - self._high - low)
        slow = timing.slow
        self._speed = "real time" if slow == 1 else f"{_ratio(slow)} of real time"
        if strip is not None:
            inches = size[0] / 100, low / 100
            content = io.BytesIO(chart(strip.gap(), "png", inches, _BOX))
            self._done = Image.open(content).convert("RGB").resize((size[0], low))
            paper = Image.new("RGB", self._done.size, _PAPER)
            self._to_come = Image.blend(self._done, paper, _TO_COME)

    def paint(self, frame: Any, k: int) -> Any:
        """The picture of moment `k`, whole, as an image of Pillow's."""
        from PIL import Image, ImageDraw

        time = float(self._timing.times[k])
        image = Image.new("RGB", self._size, _PAPER)
        image.paste(Image.fromarray(frame), (0, self._high))
        draw = ImageDraw.Draw(image, "RGBA")
        self._head(draw, time)
        if self._strip is not None:
            self._foot(image, draw, time)
        return image

    def _head(self, draw: Any, time: float) -> None:
        """Above the picture: what and when on the left, who on the right."""
        pad, line = round(0.3 * self._text), round(1.35 * self._text)
        width = self._size[0]
        digits = 3 if self._timing.seconds < 100 else 1
        draw.text((pad, pad), self._title, font=self._font, fill=_INK)
        draw.text(
            (pad, pad + line),
            f"t = {time:.{digits}f} s, {self._speed}",
            font=self._small,
            fill=_INK,
        )
        fonts = self._font
        widest = max(fonts.getlength(label) for label in self._labels)
        if widest > 0.6 * width:
            fonts = self._small
            widest = max(fonts.getlength(label) for label in self._labels)
        left = width - pad - widest
        side = round(0.8 * self._text)
        for row, label in enumerate(self._labels):
            y = pad + row * line
            draw.text((left, y), label, font=fonts, fill=_INK)
            box = (left - 1.6 * side, y + 0.2 * side, left - 0.6 * side, y + 1.2 * side)
            if row:
                draw.rectangle(box, fill=(*_VIOLET, 130), outline=_VIOLET, width=2)
            else:
                draw.rectangle(box, fill=_ORANGE)

    def _foot(self, image: Any, draw: Any, time: float) -> None:
        strip, top = self._strip, self._size[1] - self._low
        assert strip is not None
        share = min(1.0, time / max(self._timing.seconds, 1e-12))
        x = round((_BOX[0] + share * _BOX[2]) * self._size[0])
        image.paste(self._to_come, (0, top))
        image.paste(self._done.crop((0, 0, x, self._low)), (0, top))
        ends = top + (1 - _BOX[1] - _BOX[3]) * self._low, top + (1 - _BOX[1]) * self._low
        draw.line((x, ends[0], x, ends[1]), fill=_INK, width=1)
        # The last moment that was compared: what is shown is not guessed between two.
        curve = strip.curve
        row = max(0, int(np.searchsorted(curve.time, time + 1e-9, side="right")) - 1)
        gap = quantity(float(curve.difference[row]), curve.unit)
        tolerance = quantity(strip.found.tolerance, curve.unit)
        text = f"{strip.title}: {gap} apart; dotted: the tolerance, {tolerance}"
        draw.text((0.5 * self._text, top), _plain(text), font=self._small, fill=_INK)


def _ratio(slow: float) -> str:
    """The speed at which simulated time is shown: "1/4", or "2 x"."""
    if slow > 1 and slow == round(slow):
        return f"1/{slow:.0f}"
    return f"{1 / slow:.3g} x"


def _plain(text: str) -> str:
    """In letters that Pillow's own font has."""
    text = text.replace("–", "-").replace("×", "x").replace("µ", "u")
    return text.encode("ascii", "replace").decode()
