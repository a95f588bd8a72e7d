"""What is written over the pictures of a film: who is who, the time, and the strip below."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...interface import Array
from ...measures.text import quantity
from ...show.charts import INK, SETTINGS, draw_picture, saved
from ...show.drawing.scene import GHOST
from .stage.quantity_chart import QuantityChart

_ORANGE = "#e69f00"  # of the solid side's mark
STRIP = 0.18  # of the film's height
_BOX = (0.11, 0.25, 0.86, 0.5)  # of the axes within a strip: left, bottom, width, height
_TO_COME = 0.6  # how pale the curve is after the moment that is shown
_DOTS = 100  # to an inch


class Overlay:
    """Writes above and below the pictures of one film.

    Attributes:
        inner: Width and height that is left for the pictures.
    """

    def __init__(
        self,
        size: tuple[int, int],
        times: Array,
        title: str,
        labels: Sequence[str],
        strip: QuantityChart | None,
    ) -> None:
        """Draw what is the same in all pictures.

        Args:
            size: Width and height of the film.
            times: (n,) simulated time of each picture [s].
            title: What is done.
            labels: Who the solid side is, and the ghost.
            strip: How far apart the sides are, drawn below.
        """
        from matplotlib.font_manager import findfont
        from PIL import Image, ImageFont

        self._size, self._times, self._strip = size, times, strip
        self._text = max(10, round(min(size[1] / 30, size[0] / 40)))
        self._font = ImageFont.truetype(findfont("DejaVu Sans"), max(9, round(0.8 * self._text)))
        self._low = round(STRIP * size[1]) if strip is not None else 0
        self._high = round(3.2 * self._text)
        self.inner = (size[0], size[1] - self._high - self._low)
        points = 72 / _DOTS * self._text
        content = saved(
            lambda: self._paper(title, labels, points),
            "png",
            {**SETTINGS, "font.size": 8, "axes.linewidth": 0.6},
            _DOTS,
        )
        self._done = Image.open(io.BytesIO(content)).convert("RGB")
        white = Image.new("RGB", size, "white")
        self._to_come = Image.blend(self._done, white, _TO_COME)

    def _paper(self, title: str, labels: Sequence[str], points: float) -> Any:
        """Return title, labels and the strip, as a figure of matplotlib's."""
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch

        width, height = self._size
        figure = Figure((width / _DOTS, height / _DOTS), facecolor="white")
        figure.text(0.01, 1 - 0.3 * self._text / height, title, va="top", size=points)
        marks = [Patch(color=_ORANGE), Patch(facecolor=(*GHOST, 0.5), edgecolor=GHOST, linewidth=2)]
        long = max(map(len, labels)) * 0.6 * self._text > 0.6 * width
        figure.legend(
            marks[: len(labels)],
            labels,
            loc="upper right",
            frameon=False,
            fontsize=(0.8 if long else 1) * points,
            handlelength=1,
            borderaxespad=0.1,
            labelspacing=0.3,
        )
        if self._strip is not None:
            left, bottom, wide, high = _BOX
            share = self._low / height
            axes = figure.add_axes((left, bottom * share, wide, high * share))
            draw_picture(axes, self._strip.gap())
        return figure

    def paint(self, shot: Any, k: int) -> Any:
        """Return picture `k`, whole, as an image of Pillow's."""
        from PIL import Image, ImageDraw

        (width, height), time = self._size, float(self._times[k])
        image = self._done.copy()
        image.paste(Image.fromarray(shot), (0, self._high))
        draw, pad = ImageDraw.Draw(image), round(0.3 * self._text)
        digits = 3 if self._times[-1] < 100 else 1
        draw.text(
            (pad, pad + round(1.35 * self._text)),
            f"t = {time:.{digits}f} s",
            font=self._font,
            fill=INK,
        )
        if self._strip is not None:
            top = height - self._low
            share = time / max(float(self._strip.curve.time[-1]), 1e-12)
            x = round((_BOX[0] + min(1.0, share) * _BOX[2]) * width)
            rest = (x, top, width, height)
            image.paste(self._to_come.crop(rest), rest)
            ends = top + (1 - _BOX[1] - _BOX[3]) * self._low, top + (1 - _BOX[1]) * self._low
            draw.line((x, ends[0], x, ends[1]), fill=INK, width=1)
            draw.text((pad, top), _gap_at(self._strip, time), font=self._font, fill=INK)
        return image


def _gap_at(strip: QuantityChart, time: float) -> str:
    """Return a line with the gap at the last moment that was compared; nothing is interpolated."""
    curve = strip.curve
    row = max(0, int(np.searchsorted(curve.time, time + 1e-9, side="right")) - 1)
    gap = quantity(float(curve.difference[row]), curve.unit)
    tolerance = quantity(strip.agreement.tolerance, curve.unit)
    return f"{strip.title}: {gap} apart; dotted: the tolerance, {tolerance}"
