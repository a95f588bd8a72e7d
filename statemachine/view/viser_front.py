"""The page: viser's scene and its sliders, fed by the loop. The only module that knows viser."""

from __future__ import annotations

import html
import queue
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..measures.text import millimetres, position, short_time
from ..show.drawing import Drawing, Part
from ..show.drawing.scene import Camera
from .live import Command, Tempo
from .session import FASTEST, SLOWEST, Frame, Session

if TYPE_CHECKING:
    import viser

_GHOST = (0.20, 0.45, 0.95)  # the second engine, seen through
_OPACITY = 0.45
_THINNER = 1e-3  # of the extent: a ghost inside its twin is not seen where the two agree
_DISTANCE = 1.1  # of the camera, in extents
_ROUND = ("sphere", "capsule", "ellipsoid", "cylinder")  # shaded smoothly
_SPAN = 0.1  # seconds between two readouts
_HELD = 0.3  # seconds for which a slider is still in somebody's hand
_DEFAULT = "default state"
_DIM = "opacity:.65;padding-right:.8em;vertical-align:top"


class ViserFront:
    """A `Front` on a viser server. Tabs may come and go; all of them show the same."""

    _readout: viser.GuiHtmlHandle
    _switch: viser.GuiButtonHandle
    seek: viser.GuiSliderHandle[float] | None
    _sliders: list[viser.GuiSliderHandle[float]]

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        drawing: Drawing,
        keyframe: int | None = None,
    ) -> None:
        """Build the scene and the controls.

        Args:
            server: From `server.serve`.
            session: What will be shown.
            drawing: What its model looks like.
            keyframe: Where the session began, by number.
        """
        self._server = server
        self._session = session
        self._extent = drawing.extent
        # Callbacks come from viser's own thread: all they do is put a command in here.
        self._asked: queue.SimpleQueue[Command] = queue.SimpleQueue()
        # Of each engine: the frame of each body, by its number.
        self._frames: list[dict[int, viser.FrameHandle]] = []
        self._resets = 0  # of the session, as the sliders show them
        self._when = 0.0  # of the last readout [s of the clock]
        self._dragged = 0.0  # when somebody moved the slider of a recording [s of the clock]
        with server.atomic():
            self._build_scene(drawing)
            self._build_panel(keyframe)

    def commands(self) -> Sequence[Command]:
        """Return what was asked for since the last time."""
        return [self._asked.get_nowait() for _ in range(self._asked.qsize())]

    def show(self, frame: Frame, pace: Tempo, note: str) -> None:
        """Move the bodies, and what stands beside them."""
        with self._server.atomic():
            for bodies, pose in zip(self._frames, frame.poses, strict=True):
                for body, handle in bodies.items():
                    handle.position, handle.wxyz = pose.xpos[body], pose.xquat[body]
            if frame.resets != self._resets:
                self._resets = frame.resets
                self._follow(frame)
            # Not out of the hand of someone who drags it.
            if self.seek is not None and time.monotonic() - self._dragged > _HELD:
                self.seek.value = min(frame.steps * self._session.timestep, self.seek.max)
            self._switch.label = "Pause" if frame.running else "Run"
            self._say(frame, pace, note)

    # The scene

    def _build_scene(self, drawing: Drawing) -> None:
        scene = self._server.scene
        scene.world_axes.visible = False
        scene.configure_default_lights(enabled=True, cast_shadow=True)
        camera = self._server.initial_camera
        camera.look_at = drawing.center
        distance = _DISTANCE * drawing.extent
        view = Camera(drawing.center, distance, drawing.azimuth, drawing.elevation)
        x, y, z = view.eye.tolist()
        camera.position = (x, y, z)
        camera.up = (0.0, 0.0, 1.0)
        for part in drawing.parts:
            if part.body == 0:
                self._add_fixed(part)
        for number, name in enumerate(self._session.names):
            # A name for viser's tree, where slashes part.
            root = f"/{name.replace('/', ' ')}" + (" ghost" if number else "")
            bodies = [body for body in drawing.bodies if body]
            self._frames.append(
                {body: scene.add_frame(f"{root}/{body}", show_axes=False) for body in bodies}
            )
            for part in drawing.parts:
                if part.body:
                    self._add_part(part, f"{root}/{part.body}/{part.geom}", number > 0)

    def _add_fixed(self, part: Part) -> None:
        name = f"/world/{part.geom}"
        if not part.is_ground:
            self._add_part(part, name, False)
            return
        cell = float(10.0 ** np.floor(np.log10(self._extent) - 0.5))
        height = float(part.vertices[0, 2])
        self._server.scene.add_grid(
            name,
            infinite_grid=True,
            cell_size=cell,
            section_size=10 * cell,
            cell_thickness=0.6,
            section_thickness=1.0,
            fade_distance=20 * self._extent,
            plane_color=_bytes(part.rgba),
            plane_opacity=1.0,
            position=(0.0, 0.0, height),
        )

    def _add_part(self, part: Part, name: str, ghost: bool) -> None:
        opacity = _OPACITY if ghost else part.rgba[3]
        vertices = thinner(part, _THINNER * self._extent) if ghost else part.vertices
        self._server.scene.add_mesh_simple(
            name,
            vertices,
            part.faces,
            color=_bytes(_GHOST if ghost else part.rgba),
            opacity=None if opacity >= 1 else opacity,
            flat_shading=part.kind not in _ROUND,
            cast_shadow=not ghost,
            receive_shadow=not ghost,
        )

    # What stands beside it

    def _build_panel(self, keyframe: int | None) -> None:
        gui, session = self._server.gui, self._session
        gui.configure_theme(
            show_logo=False, show_share_button=False, control_width="medium", dark_mode=False
        )
        self._readout = gui.add_html("")
        self._switch = gui.add_button("Run", color="blue")
        self._on(
            self._switch.on_click,
            lambda: session.pause if self._switch.label == "Pause" else session.play,
        )
        count = gui.add_number("steps", 1, min=1, max=100_000, step=1)
        self._on(gui.add_button("Step").on_click, lambda: partial(session.step, int(count.value)))
        start = _DEFAULT if keyframe is None else session.places[keyframe]
        places = (*session.places, _DEFAULT) if session.length is None else ("start",)
        place = gui.add_dropdown(
            "to", places, initial_value=start if start in places else places[0]
        )
        numbers = {name: number for number, name in enumerate(session.places)}
        self._on(
            gui.add_button("Reset").on_click,
            lambda: partial(session.reset, numbers.get(place.value)),
        )
        speed = gui.add_number("speed ×", session.speed, min=SLOWEST, max=FASTEST, step=0.05)
        self._on(speed.on_update, lambda: partial(session.set_speed, float(speed.value)))
        if len(session.names) > 1:
            ghost = gui.add_checkbox(f"ghost: {session.names[1]}", True)
            self._on(ghost.on_update, lambda: partial(self._show_ghost, ghost.value))
        self._sliders = []
        self.seek = None
        if session.length:
            self.seek = gui.add_slider(
                "seek [s]", 0.0, float(session.length), float(session.timestep), 0.0
            )
            self._on(self.seek.on_update, partial(self._sought, self.seek))
        if session.controls:
            with gui.add_folder("ctrl"):
                for index in range(len(session.controls)):
                    self._add_slider(index)

    def _add_slider(self, index: int) -> None:
        control = self._session.controls[index]
        span = control.high - control.low
        step = float(10 ** np.floor(np.log10(span / 500))) if span > 0 else 1.0
        # Round figures to read; what they stand for stays in the range.
        low, high = _round(control.low, step), _round(control.high, step)
        label = f"{control.name} [{control.unit}]" if control.unit else control.name
        slider = self._server.gui.add_slider(label, low, high, step, min(max(0.0, low), high))

        def asked() -> Command:
            value = min(max(float(slider.value), control.low), control.high)
            return partial(self._session.set_ctrl, index, value * control.scale)

        self._on(slider.on_update, asked)
        self._sliders.append(slider)

    def _follow(self, frame: Frame) -> None:
        """Put the sliders to commands that did not come from them."""
        for index, slider in enumerate(self._sliders):
            scale = self._session.controls[index].scale
            shown = _round(float(frame.ctrl[index]) / scale, slider.step)
            slider.value = min(max(shown, slider.min), slider.max)

    def _say(self, frame: Frame, pace: Tempo, note: str) -> None:
        now = time.monotonic()
        if frame.running and now - self._when < _SPAN:
            return  # nobody reads faster
        self._when = now
        rows = readout(frame, pace, self._session.tip)
        self._readout.content = page_of_rows(rows, warning(frame, note))

    # What comes back

    def _sought(self, slider: viser.GuiSliderHandle[float]) -> Command:
        """Return the command to go to the time that a slider was moved to."""
        self._dragged = time.monotonic()
        return partial(self._session.seek, float(slider.value))

    def _show_ghost(self, visible: bool) -> None:
        for handle in self._frames[1].values():
            handle.visible = visible

    def _on(self, listen: Callable[[Any], Any], command: Callable[[], Command]) -> None:
        """Ask for something at each event of a control that comes from a tab."""

        # As coroutines they run one after another, in the order in which they came.
        async def put(event: Any) -> None:
            if event.client_id is not None:  # else by `show`
                self._asked.put(command())

        listen(put)


class ReadoutRow(NamedTuple):
    """Row that stands beside the picture.

    Attributes:
        name: What it is.
        value: With its unit.
    """

    name: str
    value: str


def readout(frame: Frame, pace: Tempo, tip: str) -> list[ReadoutRow]:
    """Return what stands beside the picture of one moment.

    Args:
        frame: The moment.
        pace: How fast it goes.
        tip: Name of the site that stands for the fingertip, or "".
    """
    rows = [
        ReadoutRow("time", short_time(frame.time)),
        ReadoutRow("steps", f"{frame.steps:,}"),
        ReadoutRow("pace", _pace(frame, pace)),
    ]
    if tip:
        rows.append(ReadoutRow("tip", tip))
    for pose in frame.poses:
        if pose.tip is not None:
            place = "  ".join(f"{1000 * value:.1f}" for value in pose.tip)
            rows.append(ReadoutRow(f"on {pose.name}", f"{place} mm"))
    if frame.tips_apart is not None:
        rows.append(ReadoutRow("tips apart", millimetres(frame.tips_apart, 3)))
    joint = frame.joint_apart
    if joint is not None:
        size = position(joint.size or 0.0, joint.unit == "m", 3)
        rows.append(ReadoutRow("joints apart", f"{size}, {joint.where}"))
    return rows


def _pace(frame: Frame, pace: Tempo) -> str:
    """Return how fast time goes, in words."""
    if not frame.running:
        return "paused"
    if pace.reached is None:
        return "…"
    late = f"; {pace.asked:g} × is more than this machine gives" if pace.late else ""
    return f"{pace.reached:.2f} × real time{late}"


def warning(frame: Frame, note: str) -> str:
    """Return what is wrong, or ""."""
    return f"{frame.error}. Reset to go on." if frame.error else note


def page_of_rows(rows: Sequence[tuple[str, str]], warning: str) -> str:
    cells = "".join(
        f"<tr><td style='{_DIM}'>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>"
        for name, value in rows
    )
    alert = ""
    if warning:
        style = "color:#b3261e;margin:.4em 0 0"
        alert = f"<p role='alert' style='{style}'>{html.escape(warning)}</p>"
    return (
        "<div style='padding:.5em .7em;font-size:.8em;line-height:1.5'>"
        f"<table style='font-variant-numeric:tabular-nums;border-spacing:0'>{cells}</table>"
        f"{alert}</div>"
    )


def _bytes(rgb: Sequence[float]) -> tuple[int, int, int]:
    r, g, b = (round(255 * min(max(value, 0.0), 1.0)) for value in rgb[:3])
    return r, g, b


def _round(value: float, step: float) -> float:
    """Return the nearest multiple of a step that is a power of ten."""
    return round(round(value / step) * step, 12)


def thinner(part: Part, by: float) -> NDArray[np.float32]:
    """Return the vertices (v, 3) of a part, moved inward along the normals of its faces [m]."""
    corners = part.vertices[part.faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros((len(part.vertices), 3))
    for corner in range(3):
        np.add.at(sums, part.faces[:, corner], normals)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    sums /= np.where(lengths > 0, lengths, 1)
    return (part.vertices - by * sums).astype(np.float32)
