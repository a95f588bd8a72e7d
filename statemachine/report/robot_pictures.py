"""Small pictures of a robot for a page: one pose as WebP, or a few seconds of a run."""

from __future__ import annotations

import base64
import io

import numpy as np

from ..backends import load
from ..drawing import drawing_of
from ..drawing.scene import Camera, Motion, camera_for, framed, poses_through
from ..engines.pictures import drawn, renderer_here
from ..errors import MissingEngineError
from ..installed import require_extra
from ..interface import Array
from ..page import Picture, RobotPicture
from .figures import svg
from .film import write_webp

_SIZE = (480, 360)
_LAST = 1500  # milliseconds that the last pose of a film is shown
_CLOSE = 0.07  # metres about a body that is looked at from close by


def webp(picture: RobotPicture) -> bytes:
    """The picture as WebP, animated if it has several poses.

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
    """A picture of a page, and its kind: "svg+xml", or "webp" of a robot.

    Raises:
        MissingEngineError: What draws it is not installed.
    """
    if isinstance(picture, RobotPicture):
        return webp(picture), "webp"
    return svg(picture).encode(), "svg+xml"


def inline(picture: Picture) -> str:
    """A picture as a data address; "" without what draws it."""
    try:
        content, kind = drawn_picture(picture)
    except MissingEngineError:
        return ""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def _close(camera: Camera, sides: list[Motion], body: int) -> Camera:
    """A camera in the same direction that sees what is about a body."""
    places: Array = np.concatenate([side.xpos[:, body] for side in sides])
    corners = _CLOSE * np.stack(np.meshgrid(*[(-1, 1)] * 3), axis=-1).reshape(-1, 3)
    points = (places[:, None] + corners).reshape(-1, 3)
    return framed(points, _SIZE[0] / _SIZE[1], camera.azimuth, camera.elevation)
