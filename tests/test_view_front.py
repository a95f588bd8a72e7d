"""What the viewer puts on its page and what it asks for, on a page that only takes notes."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.recordings import record
from statemachine.show.drawing import drawing_of
from statemachine.view.live import Tempo
from statemachine.view.live_session import LiveSession
from statemachine.view.trace_session import TraceSession
from statemachine.view.viser_front import ViserFront

from .support.small_models import loaded

PACE = Tempo(1.0, None, False)
WORLD = """
<geom type='plane' size='0 0 1'/>
<body name='arm' pos='0 0 1'>
  <joint name='hinge' axis='0 1 0' range='-90 90'/>
  <geom type='box' size='0.1 0.2 0.3' rgba='1 0.5 0 1'/><site name='tip' pos='0 0 0.3'/>
  <body name='rod' pos='0 0 0.4'><joint name='slide' type='slide' axis='1 0 0' range='-1 1'/>
    <geom type='sphere' size='0.05' rgba='0 0 1 0.5'/></body>
</body>
"""
DRIVES = """
<actuator>
  <position name='turn' joint='hinge' kp='9' ctrlrange='-1 0.5'/>
  <motor name='push' joint='slide' ctrlrange='-2 2'/>
</actuator>
<keyframe><key name='start' qpos='0.1 0' ctrl='0.1 0'/>
  <key name='bent' qpos='0.4 0.2' ctrl='0.4 0'/>
</keyframe>
"""


class Control(SimpleNamespace):
    """A control of the page: what was asked for when it was added, and its listener."""

    def on_update(self, listener: Callable[[Any], Any]) -> None:
        self.listener = listener

    on_click = on_update

    def touched(self, client: int | None = 1, **now: Any) -> None:
        """Let a tab change it; without a client, the viewer itself has."""
        vars(self).update(now)
        asyncio.run(self.listener(SimpleNamespace(client_id=client)))


class Page(SimpleNamespace):
    """A page that notes each thing that is added to it, by its name."""

    def __init__(self) -> None:
        super().__init__()
        self.things: dict[str, Control] = {}
        self.gui = self.scene = self
        self.world_axes = self.initial_camera = SimpleNamespace()
        self.atomic = nullcontext
        self.configure_theme = self.configure_default_lights = lambda **_: None

    def _added(self, kind: str, name: str, *told: Any, **named: Any) -> Control:
        self.things[name] = Control(kind=kind, told=told, **named)
        return self.things[name]

    def add_number(self, name: str, value: float, **named: Any) -> Control:
        return self._added("number", name, value=value, **named)

    def add_checkbox(self, name: str, value: bool) -> Control:
        return self._added("checkbox", name, value=value)

    def add_dropdown(self, name: str, options: Any, initial_value: str) -> Control:
        return self._added("dropdown", name, options=options, value=initial_value)

    def add_slider(self, name: str, low: float, high: float, step: float, value: float) -> Control:
        return self._added("slider", name, min=low, max=high, step=step, value=value)

    def add_button(self, name: str, **_: Any) -> Control:
        return self._added("button", name, label=name)

    def add_html(self, content: str) -> Control:
        return self._added("html", "readout", content=content)

    def add_folder(self, _: str) -> Any:
        return nullcontext()

    def add_frame(self, name: str, **named: Any) -> Control:
        return self._added("frame", name, visible=True, **named)

    def add_grid(self, name: str, **named: Any) -> Control:
        return self._added("grid", name, **named)

    def add_mesh_simple(self, name: str, vertices: Any, faces: Any, **named: Any) -> Control:
        return self._added("mesh", name, vertices=vertices, faces=faces, **named)


@pytest.fixture
def model(tmp_path: Path) -> sm.Model:
    return loaded(tmp_path, WORLD, DRIVES)


@pytest.fixture
def page() -> Page:
    return Page()


@pytest.fixture
def session(model: sm.Model) -> Iterator[LiveSession]:
    with LiveSession([model], "start") as session:
        yield session


@pytest.fixture
def front(page: Page, session: LiveSession, model: sm.Model) -> ViserFront:
    server: Any = page
    return ViserFront(server, session, drawing_of(model), 0)


def obeyed(front: ViserFront) -> int:
    """Carry out what was asked for, and return how much that was."""
    commands = front.commands()
    for command in commands:
        command()
    return len(commands)


# What is on the page


def test_a_body_stands_where_the_frame_has_it(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    session.advance(50)
    front.show(session.frame(), PACE, "")
    _, data = session.arms[0]
    for body in (1, 2):
        handle = page.things[f"/mujoco/{body}"]
        assert handle.position.tolist() == data.xpos[body].tolist()
        assert handle.wxyz.tolist() == data.xquat[body].tolist()


def test_a_part_has_its_colour_and_is_seen_through_as_its_geom_is(
    page: Page, front: ViserFront
) -> None:
    box, ball = page.things["/mujoco/1/1"], page.things["/mujoco/2/2"]
    assert (box.color, box.opacity, box.flat_shading) == ((255, 128, 0), None, True)
    assert (ball.color, ball.opacity, ball.flat_shading) == ((0, 0, 255), 0.5, False)
    assert np.abs(box.vertices).max(axis=0) == pytest.approx((0.1, 0.2, 0.3))


def test_a_plane_without_an_end_is_a_grid_on_its_height(page: Page, front: ViserFront) -> None:
    grid = page.things["/world/0"]
    assert (grid.kind, grid.position) == ("grid", (0.0, 0.0, 0.0))
    # The extent is about a metre: cells of a power of ten below a third of it.
    assert grid.cell_size == pytest.approx(0.1)
    assert grid.section_size == pytest.approx(1.0)


def test_the_camera_looks_at_the_middle_from_a_tenth_more_than_the_extent(
    page: Page, front: ViserFront, model: sm.Model
) -> None:
    drawing = drawing_of(model)
    camera = page.initial_camera
    assert camera.look_at == drawing.center
    away = np.subtract(camera.position, drawing.center)
    assert np.linalg.norm(away) == pytest.approx(1.1 * drawing.extent)
    assert away[2] > 0  # MuJoCo's camera looks down by 45 degrees at first


def test_the_readout_has_the_time_and_what_is_wrong(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    session.advance(250)
    front.show(session.frame(), PACE, "mind the gap")
    content = page.things["readout"].content
    assert f"{250 * session.timestep:.3f} s" in content
    assert "mind the gap" in content


# What is asked for


def test_the_switch_runs_and_pauses(page: Page, front: ViserFront, session: LiveSession) -> None:
    switch = page.things["Run"]
    for label, running in (("Pause", True), ("Run", False)):
        switch.touched()
        assert obeyed(front) == 1
        front.show(session.frame(), PACE, "")
        assert (session.frame().running, switch.label) == (running, label)


def test_a_step_takes_as_many_as_are_asked_for(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    count = page.things["steps"]
    assert (count.value, count.min, count.step) == (1, 1, 1)
    count.value = 7
    page.things["Step"].touched()
    assert obeyed(front) == 1
    assert session.frame().steps == 7


def test_a_reset_goes_to_the_keyframe_that_is_chosen(
    page: Page, front: ViserFront, session: LiveSession, model: sm.Model
) -> None:
    place = page.things["to"]
    assert place.options == ("start", "bent", "default state")
    assert place.value == "start"
    for name, qpos in (("bent", [0.4, 0.2]), ("default state", [0, 0]), ("start", [0.1, 0])):
        place.value = name
        page.things["Reset"].touched()
        assert obeyed(front) == 1
        assert session.arms[0][1].qpos == pytest.approx(qpos)


def test_a_slider_commands_in_the_unit_of_its_actuator(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    page.things["turn [°]"].touched(value=20.0)
    page.things["push"].touched(value=-1.5)
    assert obeyed(front) == 2
    assert session.frame().ctrl == pytest.approx([math.radians(20), -1.5])


def test_a_slider_has_the_range_of_its_actuator_in_steps_of_a_five_hundredth(
    page: Page, front: ViserFront
) -> None:
    turn, push = page.things["turn [°]"], page.things["push"]
    assert (turn.min, turn.max) == pytest.approx((-math.degrees(1), math.degrees(0.5)), abs=0.05)
    assert turn.step == pytest.approx(0.1)  # 86 degrees through 500, a power of ten
    assert (push.min, push.max, push.step) == pytest.approx((-2, 2, 0.001))


def test_a_slider_at_its_end_commands_the_end_of_the_range(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    turn = page.things["turn [°]"]
    turn.touched(value=turn.max + 1)
    obeyed(front)
    assert session.frame().ctrl[0] == pytest.approx(0.5, abs=1e-12)


def test_the_sliders_follow_a_reset(page: Page, front: ViserFront, session: LiveSession) -> None:
    session.reset(1)
    front.show(session.frame(), PACE, "")
    assert page.things["turn [°]"].value == pytest.approx(math.degrees(0.4), abs=0.05)


def test_what_the_viewer_itself_moves_is_no_command(page: Page, front: ViserFront) -> None:
    page.things["turn [°]"].touched(client=None, value=3.0)
    assert front.commands() == []


def test_the_speed_is_that_of_its_field(
    page: Page, front: ViserFront, session: LiveSession
) -> None:
    speed = page.things["speed ×"]
    assert speed.value == 1.0
    speed.touched(value=0.25)
    obeyed(front)
    assert session.speed == 0.25


def test_commands_come_once_and_in_their_order(page: Page, front: ViserFront) -> None:
    for _ in range(3):
        page.things["Step"].touched()
    assert len(front.commands()) == 3
    assert front.commands() == []


# A second engine, and a recording


def test_the_ghost_is_blue_thinner_and_can_be_put_away(page: Page, model: sm.Model) -> None:
    server: Any = page
    with LiveSession([model, model], "start") as session:
        front = ViserFront(server, session, drawing_of(model), 0)
        roots = [name.removesuffix("/1/1") for name in page.things if name.endswith("/1/1")]
        solid, ghost = roots
        assert ghost.endswith(" ghost")
        box = page.things[f"{ghost}/1/1"]
        assert (box.color, box.opacity, box.cast_shadow) == ((51, 115, 242), 0.45, False)
        assert (np.abs(box.vertices) < np.abs(page.things[f"{solid}/1/1"].vertices)).all()
        [box] = [thing for thing in page.things.values() if thing.kind == "checkbox"]
        box.touched(value=False)
        obeyed(front)
        assert not page.things[f"{ghost}/1"].visible
        assert page.things[f"{solid}/1"].visible


def test_a_recording_has_a_slider_of_its_time(page: Page, model: sm.Model) -> None:
    server: Any = page
    recording = TraceSession([record(model, seconds=0.5)])
    front = ViserFront(server, recording, drawing_of(model))
    seek = page.things["seek [s]"]
    assert (seek.min, seek.step, seek.value) == (0.0, model.timestep, 0.0)
    assert seek.max == pytest.approx(0.5)
    assert page.things["to"].options == ("start",)
    recording.advance(40)
    recording.play()
    front.show(recording.frame(), PACE, "")
    seek.touched(value=0.3)
    assert obeyed(front) == 1
    assert recording.frame().time == pytest.approx(0.3)


def test_the_slider_of_a_recording_stays_in_the_hand_that_drags_it(
    page: Page, model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr("statemachine.view.viser_front.time.monotonic", lambda: now[0])
    server: Any = page
    recording = TraceSession([record(model, seconds=0.5)])
    front = ViserFront(server, recording, drawing_of(model))
    seek = page.things["seek [s]"]
    recording.advance(40)
    seek.touched(value=0.4)
    front.commands()
    for later, value in ((100.2, 0.4), (100.4, 40 * model.timestep)):
        now[0] = later
        front.show(recording.frame(), PACE, "")
        assert seek.value == pytest.approx(value)
