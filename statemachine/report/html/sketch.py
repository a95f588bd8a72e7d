"""The scene at one moment as SVG: what is seen without a script or without WebGL, and in print."""

from __future__ import annotations

import numpy as np

from ...drawing.camera import Camera
from ...interface import Array
from ...measures.text import short_time
from ...runs import Trace
from .markup import Html, tag
from .scene import ASPECT, Scene
from .timeline import Frames

_HIGH = 400.0
_WIDE = ASPECT * _HIGH


def sketch(
    scene: Scene, one: Trace, two: Trace, frames: Frames, row: int, labels: tuple[str, str]
) -> Html:
    """Sticks between the bodies of both sides, seen as the scene is at first."""
    if scene.poses is None or scene.camera is None:
        return tag("p", *scene.notes)
    parts: list[Html] = []
    for k, (trace, look) in enumerate(((one, "one"), (two, "two"))):
        points = _seen(np.nan_to_num(scene.poses[k][row]), scene.camera)
        parents = trace.header.body_parentid
        for body, parent in enumerate(parents):
            if body and parent:
                parts.append(_stick(points[parent], points[body], look))
            elif body and body not in parents:
                x, y = points[body]
                parts.append(
                    tag("rect", x=f"{x - 7:.1f}", y=f"{y - 7:.1f}", width=14, height=14,
                        class_=f"stick {look}")
                )  # fmt: skip
        if scene.tips is not None:
            way = _seen(scene.tips[k], scene.camera)
            ends = [body for body in range(1, len(parents)) if body not in parents]
            near = min(ends, key=lambda b: float(np.linalg.norm(points[b] - way[row])), default=0)
            holder = parents[near] if near and parents[near] else near
            parts.append(_stick(points[holder], way[row], look))
            path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in way[:: max(1, len(way) // 150)])
            parts.append(tag("path", d=path, class_=f"trail {look}"))
    said = (
        f"Both arms as sticks at {short_time(float(frames.time[row]))}: "
        f"{labels[0]} with full lines, {labels[1]} with broken ones."
    )
    return tag(
        "figure",
        tag("svg", *parts, viewBox=f"0 0 {_WIDE:g} {_HIGH:g}", role="img", aria_label=said),
        tag("figcaption", said),
    )


def _stick(start: Array, end: Array, look: str) -> Html:
    (a, b), (c, d) = start, end
    return tag(
        "line", x1=f"{a:.1f}", y1=f"{b:.1f}", x2=f"{c:.1f}", y2=f"{d:.1f}", class_=f"stick {look}"
    )


def _seen(points: Array, camera: Camera) -> Array:
    """Points (n, 3) on the picture (n, 2), by the camera that the script begins with."""
    x, y = camera.seen(points, _WIDE / _HIGH).T
    return np.clip(np.column_stack([_WIDE * (1 + x), _HIGH * (1 - y)]) / 2, -1e4, 1e4)
