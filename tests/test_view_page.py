"""The viewer's page, in a real browser: what is seen, what can be moved, what is asked for."""

from __future__ import annotations

import io
import math
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.recordings import record
from statemachine.show.drawing import drawing_of
from statemachine.view.live import Live, Tempo
from statemachine.view.live_session import LiveSession
from statemachine.view.server import Door
from statemachine.view.trace_session import TraceSession
from statemachine.view.viser_front import ViserFront, page_of_rows, thinner

from .support.browser import Tab, browser
from .support.claims import assert_not_in
from .support.viewer import Viewer, free_pair, served

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("viser")]  # a browser at work

# The client's own library speaks of its next version; nothing here calls it.
KNOWN = ("THREE.Clock",)
PATIENCE = 90.0  # seconds, on a machine that draws without a graphics card and does more


class Stage:
    """A session on a page, with tabs before it; time passes only in `until`."""

    def __init__(
        self, session: LiveSession, model: sm.Model, server: Any, address: str, tab: Tab
    ) -> None:
        self.session, self.tab = session, tab
        front = ViserFront(server, session, drawing_of(model))
        self.live = Live(session, front, sleep=lambda seconds: None)
        tab.goto(address)
        self.until(lambda: tab.get_by_role("slider").count() == 6)

    def until(self, reached: Callable[[], bool]) -> None:
        """Turn the loop until something is so."""
        end = time.monotonic() + PATIENCE
        while not reached():
            assert time.monotonic() < end, self.tab.inner_text("body")
            self.live.turn()
            self.tab.wait_for_timeout(20)

    def says(self, text: str) -> None:
        """Wait until the page says so."""
        self.until(lambda: self.tab.get_by_text(text).count() > 0)

    def reset(self) -> None:
        """Put everything to the start, and let the time stand."""
        self.press("Reset")
        self.until(lambda: self.session.frame().time == 0)
        self.session.pause()

    def press(self, name: str) -> None:
        """Press a button, by what stands on it."""
        self.tab.get_by_role("button", name=name, exact=True).click()

    def slider(self, index: int) -> float:
        """Return what a slider shows."""
        return float(self.tab.get_by_role("slider").nth(index).get_attribute("aria-valuenow"))


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    """Provide the arm, and as its ghost the arm without its servos, which falls."""
    model, door = sm.load("so101/scene"), Door("127.0.0.1")
    with (
        browser(width=1000, height=640) as tab,
        LiveSession([model, model.replace(actuation=False)]) as session,
        served(door) as server,
    ):
        address = f"http://127.0.0.1:{server.get_port()}/?token={door.token}"
        yield Stage(session, model, server, address, tab)


def _colours(tab: Tab) -> tuple[int, int]:
    """Count pixels of the arm's yellow, and of the ghost's blue, left of the panel."""
    from PIL import Image

    picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    r, _, b = np.moveaxis(np.asarray(picture)[200:, :650].astype(int), -1, 0)
    return int(((r > 150) & (r - b > 80)).sum()), int(((b > 150) & (b - r > 80)).sum())


def _ctrl(session: LiveSession) -> np.ndarray:
    return session.frame().ctrl


def test_everything_is_on_the_page_and_nothing_is_asked_of_the_network(stage: Stage) -> None:
    stage.reset()
    for joint in sm.load("so101").actuator_names:
        assert stage.tab.get_by_text(f"{joint} [°]").count() == 1
    for text in ("gripperframe", "tips apart", "joints apart", "paused"):
        stage.says(text)
    stage.until(lambda: stage.slider(1) == pytest.approx(0))
    assert stage.tab.get_by_text("Share").count() == 0
    hosts = {url.split("/")[2] for url in stage.tab.requests if not url.startswith("blob:")}
    assert hosts == {stage.tab.url.split("/")[2]}
    stage.tab.nothing_wrong(*KNOWN)


def test_a_slider_moves_the_command_and_the_arm(stage: Stage) -> None:
    session = stage.session
    stage.reset()
    thumb = stage.tab.get_by_role("slider").nth(0)
    thumb.focus()
    for _ in range(3):
        stage.tab.keyboard.press("ArrowRight")
    stage.until(lambda: _ctrl(session)[0] > math.radians(0.25))
    assert _ctrl(session)[0] == pytest.approx(math.radians(0.3))
    stage.tab.locator("input[inputmode=decimal]").nth(2).fill("25")
    stage.until(lambda: _ctrl(session)[0] == pytest.approx(math.radians(25)))
    box = thumb.bounding_box()
    stage.tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    stage.tab.mouse.down()
    stage.tab.mouse.move(box["x"] + 400, box["y"], steps=4)  # beyond its end
    stage.tab.mouse.up()
    # Round figures are shown; what they stand for stays in the range.
    end = sm.load("so101").actuator_ctrlrange[0, 1]
    stage.until(lambda: _ctrl(session)[0] == end)
    assert stage.slider(0) == 110
    before: Any = session.frame().poses[0].tip
    stage.tab.locator("input[inputmode=decimal]").nth(0).fill("200")
    stage.press("Step")
    stage.until(lambda: session.frame().steps == 200)
    after: Any = session.frame().poses[0].tip
    assert math.dist(before, after) > 0.3  # a metre's arm would turn by 110°; this is a third
    stage.says("1.000 s")


def test_run_pause_step_and_reset(stage: Stage) -> None:
    session = stage.session
    session.set_ctrl(0, 0.5)
    stage.reset()
    stage.until(lambda: stage.slider(0) == 0)  # the slider follows
    stage.press("Run")
    stage.until(lambda: session.running and session.frame().time > 0.3)
    stage.until(lambda: stage.tab.get_by_role("button", name="Pause", exact=True).count() == 1)
    stage.says("real time")
    stage.press("Pause")
    stage.until(lambda: not session.running)
    stage.says("paused")
    steps = session.frame().steps
    stage.tab.locator("input[inputmode=decimal]").nth(0).fill("3")
    stage.press("Step")
    stage.until(lambda: session.frame().steps == steps + 3)
    assert not session.running
    speed = stage.tab.locator("input[inputmode=decimal]").nth(1)
    for factor in ("0.5", "1"):
        speed.fill(factor)
        stage.until(lambda wanted=float(factor): stage.session.speed == wanted)
    stage.press("Run")
    stage.until(lambda: session.running)
    session.arms[0][1].qvel[:] = 1e200
    line = stage.tab.get_by_text("Reset to go on.")
    stage.until(lambda: line.count() == 1)
    assert line.inner_text().startswith("mujoco: ")
    stage.press("Reset")
    stage.until(lambda: session.frame().steps == line.count() == 0)
    stage.tab.nothing_wrong(*KNOWN)


def test_both_arms_are_seen_and_the_ghost_can_be_put_away(stage: Stage) -> None:
    """Where both agree the ghost is inside the arm; once it has fallen it is seen."""
    session = stage.session
    stage.reset()
    for _ in range(40):  # a few frames for the browser to draw
        stage.live.turn()
        stage.tab.wait_for_timeout(30)
    stage.until(lambda: _colours(stage.tab)[0] > 3000)
    yellow, blue = _colours(stage.tab)
    assert blue < yellow / 20
    session.advance(200)
    gap: Any = session.frame()
    stage.says(f"{1000 * gap.tips_apart:.3f} mm")
    stage.until(lambda: _colours(stage.tab)[1] > 2000)
    assert _colours(stage.tab)[0] > 3000
    stage.tab.get_by_label("ghost: mujoco").click()
    stage.until(lambda: _colours(stage.tab)[1] < 100)


@pytest.mark.usefixtures("bullet")
def test_the_command_shows_both_engines_to_a_browser(tmp_path: Path) -> None:
    """End to end: the process, the page, time that passes by itself, and Ctrl-C while watched."""
    both = ("--backend", "mujoco", "--backend", "pybullet")
    with (
        Viewer(tmp_path, *both, "--port", str(free_pair())) as viewer,
        browser() as tab,
    ):
        address = viewer.line().strip()
        assert address.startswith("http://localhost:")
        assert "mujoco" in viewer.line()
        tab.goto(address)
        for text in ("on mujoco", "on pybullet", "tips apart", "real time"):
            tab.get_by_text(text).first.wait_for(timeout=1000 * PATIENCE)
        tab.nothing_wrong(*KNOWN)
        viewer.process.send_signal(signal.SIGINT)
        viewer.end()


@pytest.mark.usefixtures("bullet")
def test_the_page_is_told_where_every_body_is_on_each_engine() -> None:
    models = [sm.load("so101/scene_box", backend=name) for name in ("mujoco", "pybullet")]
    drawing = drawing_of(models[0])
    with LiveSession(models, "held") as session, served() as server:
        session.set_ctrl(0, 0.7)
        session.advance(100)
        front = ViserFront(server, session, drawing, 0)
        front.show(session.frame(), Tempo(1.0, None, False), "")
        handle_of = server.scene.get_handle_by_name
        for root, (_, data) in zip(("/mujoco", "/pybullet ghost"), session.arms, strict=True):
            handles = [handle_of(f"{root}/{body}") for body in range(1, models[0].nbody)]
            assert len(handles) == 9
            # viser sends nothing for what moved by micrometres.
            for name, wanted in (("position", data.xpos), ("wxyz", data.xquat)):
                found = [getattr(handle, name) for handle in handles]
                np.testing.assert_allclose(found, wanted[1:], atol=1e-5)
        # A keyframe's commands are shown rounded; what is shown is not a command.
        time.sleep(0.2)
        assert front.commands() == []
        for part in drawing.parts:
            if part.body:
                mesh = handle_of(f"/mujoco/{part.body}/{part.geom}")
                np.testing.assert_array_equal(mesh.vertices, part.vertices)
                np.testing.assert_array_equal(mesh.faces, part.faces)


def test_the_slider_of_a_recording_follows_it(mujoco_scene: sm.Model) -> None:
    recording = TraceSession([record(mujoco_scene, seconds=0.5)])
    with served() as server:
        front = ViserFront(server, recording, drawing_of(mujoco_scene))
        assert (front.seek.min, front.seek.max) == (0, pytest.approx(0.5))
        recording.play()
        for count, at in ((40, 40 * mujoco_scene.timestep), (0, 0)):
            recording.reset()
            recording.advance(count)
            front.show(recording.frame(), Tempo(1.0, None, False), "")
            assert front.seek.value == pytest.approx(at)
        time.sleep(0.2)
        assert front.commands() == []


def test_what_a_model_is_called_is_no_code_on_the_page() -> None:
    text = page_of_rows([("<b>tip</b>", "<script>x</script>")], "<i>")
    assert_not_in(text, "<script>", "<b>")
    assert "&lt;i&gt;" in text


def test_a_ghost_is_thinner_by_what_was_said() -> None:
    drawing = drawing_of(sm.load("so101/scene_box"))
    box = next(part for part in drawing.parts if part.kind == "box")
    corners = thinner(box, 0.003)
    # Along the diagonal of the three faces that meet there, each wound as two triangles.
    assert np.linalg.norm(corners - box.vertices, axis=1) == pytest.approx(0.003, rel=1e-4)
    assert (np.abs(corners) < np.abs(box.vertices)).all()
