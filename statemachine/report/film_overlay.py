"""What is written over the pictures of a film: who is who, the time, and the strip below."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..drawing.shots import GHOST
from ..interface import Array
from ..measures.text import figure
from ..rendering import Timing
from .log_axis import LogAxis

_INK, _PALE, _PAPER, _RULE = (34, 34, 34), (176, 176, 182), (255, 255, 255), (222, 222, 226)
_VIOLET = tuple(round(255 * part) for part in GHOST)
_ORANGE = (230, 159, 0)
_SHARPER = 2  # lines are drawn so many times as large: edges are smooth then
STRIP = 0.18  # of the film's height
_DECADES = 4  # that a strip shows
_BELOW = (240, 240, 242)  # behind the level of zero


@dataclass(frozen=True, eq=False)
class Strip:
    """A curve over time, drawn on a log axis with a level for zero.

    Attributes:
        name: Of what.
        unit: Of its values.
        time: (n,) [s].
        values: (n,), never negative.
        tolerance: Where a line is drawn, or None.
    """

    name: str
    unit: str
    time: Array
    values: Array
    tolerance: float | None


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
        strip: Strip | None,
    ) -> None:
        """Prepare what is the same in all pictures.

        Args:
            size: Width and height of the film.
            timing: Of the film.
            title: What is done.
            labels: Who the solid side is, and the ghost.
            strip: What is drawn below.
        """
        from PIL import ImageFont

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
            self._left, self._right = 3.4 * self._text, size[0] - 0.8 * self._text
            self._top, self._bottom = 1.75 * self._text, low - 0.6 * self._text
            marks = [strip.tolerance] if strip.tolerance else []
            self._log = LogAxis.around(strip.values, marks, _DECADES)
            self._places = self._log.places(strip.values).tolist()
            self._done, self._to_come = self._drawn(_VIOLET), self._drawn(_PALE)

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
        x = self._x(time)
        cut = max(0, min(self._size[0], round(x)))
        image.paste(self._to_come, (0, top))
        image.paste(self._done.crop((0, 0, cut, self._low)), (0, top))
        draw.line((x, top + self._top, x, top + self._bottom), fill=_INK, width=1)
        # The last moment that was compared: what is shown is not guessed between two.
        row = max(0, int(np.searchsorted(strip.time, time + 1e-9, side="right")) - 1)
        value = float(strip.values[row])
        y = top + self._y(self._places[row])
        dot = 0.22 * self._text
        draw.ellipse((x - dot, y - dot, x + dot, y + dot), fill=_VIOLET)
        unit = strip.unit if strip.unit == "°" else f" {strip.unit}"
        text = f"{_plain(strip.name)}: {figure(value)}{unit} apart"
        y = top + 0.2 * self._text
        draw.text((0.5 * self._text, y), text, font=self._small, fill=_INK)
        if strip.tolerance:
            text = f"- - tolerance {figure(strip.tolerance)}{unit}"
            draw.text((self._right, y), text, font=self._small, fill=_INK, anchor="ra")

    def _x(self, time: float) -> float:
        span = max(self._timing.seconds, 1e-12)
        return self._left + (self._right - self._left) * min(1.0, time / span)

    def _y(self, place: float) -> float:
        low, high = self._log.bottom, self._log.high
        return self._bottom - (self._bottom - self._top) * (place - low) / (high - low)

    def _drawn(self, colour: tuple[int, ...]) -> Any:
        """The strip with its curve in a colour."""
        from PIL import Image, ImageDraw

        assert self._strip is not None
        by, width = _SHARPER, self._size[0]
        image = Image.new("RGB", (by * width, by * self._low), _PAPER)
        draw = ImageDraw.Draw(image)
        if self._log.edge is not None:
            box = (self._left, self._y(self._log.edge), self._right, self._bottom)
            draw.rectangle([by * each for each in box], fill=_BELOW)
        for place, _ in self._log.ticks(_DECADES + 1):
            y = by * self._y(place)
            draw.line((by * self._left, y, by * self._right, y), fill=_RULE, width=by)
        if self._strip.tolerance:
            y = by * self._y(math.log10(self._strip.tolerance))
            step = 5 * by
            for x in range(round(by * self._left), round(by * self._right), 2 * step):
                draw.line((x, y, x + step, y), fill=_INK, width=by)
        points = [
            (by * self._x(t), by * self._y(place))
            for t, place in zip(self._strip.time.tolist(), self._places, strict=True)
        ]
        draw.line(points, fill=colour, width=2 * by, joint="curve")
        image = image.resize((width, self._low), Image.Resampling.LANCZOS)
        draw = ImageDraw.Draw(image)
        # Not every decade has room for its figure.
        room = self._y(self._log.low) - self._top
        for place, text in self._log.ticks(max(1, int(room / (1.1 * self._fine)))):
            y = self._y(place)
            draw.text(
                (self._left - 4, y),
                text.replace("−", "-"),
                font=self._small,
                fill=_INK,
                anchor="rm",
            )
        return image


def _ratio(slow: float) -> str:
    """The speed at which simulated time is shown: "1/4", or "2 x"."""
    if slow > 1 and slow == round(slow):
        return f"1/{slow:.0f}"
    return f"{1 / slow:.3g} x"


def _plain(text: str) -> str:
    """In letters that Pillow's own font has."""
    text = text.replace("–", "-").replace("×", "x").replace("µ", "u")
    return text.encode("ascii", "replace").decode()
