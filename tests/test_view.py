"""The viewer without a browser: the session, the clock, the loop, the words, the server."""

from __future__ import annotations

import math
import os
import signal
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, TraceError, UnknownNameError
from statemachine.lab.recordings import RunMetadata, RunStart, record, write
from statemachine.measures import Gap
from statemachine.view.controls import controls_of
from statemachine.view.live import Command, Live, Tempo
from statemachine.view.live_session import LiveSession
from statemachine.view.session import EnginePose, Frame
from statemachine.view.trace_session import TraceSession
from statemachine.view.viser_front import readout, warning

from .support.claims import assert_has, assert_in, refused
from .support.motions import opened
from .support.small_models import ODD_DRIVES, model_of, on_both
from .support.viewer import Viewer, free_pair, served

SCENE = "so101/scene_box"


@pytest.fixture
def odd(tmp_path: Path) -> sm.Model:
    return model_of(tmp_path, ODD_DRIVES)


@pytest.fixture
def session(backend: str) -> Iterator[LiveSession]:
    with LiveSession([sm.load(SCENE, backend=backend)], "held") as made:
        yield made


# The session


def test_a_session_is_the_plain_loop_and_looking_changes_nothing(backend: str) -> None:
    """Bit by bit, with the box in the jaws, seen after every step and never."""
    with (
        opened(sm.load(SCENE, backend=backend), "held") as (model, plain),
        LiveSession([model], "held") as session,
    ):
        frame = session.frame()
        for k in range(150):
            if k == 50:
                plain.ctrl[0] = 0.3
                session.set_ctrl(0, 0.3)
            sm.step(model, plain)
            session.advance()
            frame = session.frame()
        for name in ("qpos", "qvel", "ctrl"):
            np.testing.assert_array_equal(getattr(plain, name), getattr(session.arms[0][1], name))
        sm.forward(model, plain)
        tip = plain.site_xpos[model.site_id("gripperframe")]
        for name, wanted in {"xpos": plain.xpos, "xquat": plain.xquat, "tip": tip}.items():
            np.testing.assert_array_equal(getattr(frame.poses[0], name), wanted)
        assert (frame.time, frame.steps) == (plain.time, 150)


def test_a_frame_is_a_copy(session: LiveSession) -> None:
    frame = session.frame()
    before = frame.poses[0].xpos.copy(), frame.ctrl.copy()
    session.set_ctrl(0, 1.0)
    session.advance(20)
    session.frame()
    np.testing.assert_array_equal(frame.poses[0].xpos, before[0])
    np.testing.assert_array_equal(frame.ctrl, before[1])


def test_a_session_begins_at_rest_in_its_keyframe(session: LiveSession) -> None:
    assert_has(session.frame(), running=False, time=6)
    assert session.places == ("held", "pickup")


def test_play_lets_time_go_on_and_pause_stops_it(session: LiveSession) -> None:
    session.play()
    assert session.frame().running
    session.pause()
    assert not session.frame().running


def test_a_step_stops_a_session_that_many_steps_later(session: LiveSession) -> None:
    session.play()
    session.step(7)
    later = pytest.approx(6 + 7 * session.timestep)
    assert_has(session.frame(), running=False, steps=7, time=later)


def test_a_reset_puts_a_session_into_the_keyframe_or_to_the_start(session: LiveSession) -> None:
    resets = session.frame().resets
    session.reset(1)
    assert_has(session.frame(), time=59.522, steps=0)
    session.reset()
    frame = session.frame()
    assert (frame.time, frame.resets) == (0, resets + 2)
    np.testing.assert_array_equal(frame.ctrl, 0)


@pytest.mark.parametrize(
    ("call", "value"),
    [
        ("set_ctrl", (0, math.nan)),
        ("set_ctrl", (6, 0.0)),
        ("set_ctrl", (-1, 0.0)),
        ("step", (0,)),
        ("step", (10**9,)),
        ("reset", (2,)),
        ("reset", (-1,)),
        ("seek", (1.0,)),
        *(("set_speed", (speed,)) for speed in (0, -1, math.nan, math.inf, 1e9)),
    ],
)
def test_what_cannot_be_done_is_refused_and_changes_nothing(
    call: str, value: tuple[float, ...]
) -> None:
    with LiveSession([sm.load(SCENE)], "held") as session:
        session.play()
        before = session.frame()
        refused(((BadInputError, UnknownNameError), "", lambda: getattr(session, call)(*value)))
        after = session.frame()
        assert (after.time, after.running, after.resets) == (before.time, True, before.resets)
        np.testing.assert_array_equal(after.ctrl, before.ctrl)


@pytest.mark.usefixtures("bullet")
def test_the_ghost_gets_the_same_commands_at_the_same_steps() -> None:
    models = on_both(SCENE)
    with LiveSession(models) as session:
        session.set_ctrl(1, -0.6)
        session.set_ctrl(2, 1.2)
        session.advance(300)
        frame = session.frame()
        assert [pose.name for pose in frame.poses] == ["mujoco", "pybullet"] == list(session.names)
        one, two = (data for _, data in session.arms)
        np.testing.assert_array_equal(one.ctrl, two.ctrl)
        assert one.time == pytest.approx(two.time)
        assert one.qpos[2] > 1.0  # it went there, on both
        tips: Any = [pose.tip for pose in frame.poses]
        assert frame.tips_apart == pytest.approx(math.dist(tips[0], tips[1]))
        apart = np.abs(one.qpos - two.qpos)[:6]  # what follows is the box
        name = models[0].joint_names[int(apart.argmax())]
        assert frame.joint_apart == Gap(apart.max(), "rad", name)
        assert apart.max() < math.radians(1)


def test_a_divergence_pauses_and_a_reset_recovers(odd: sm.Model) -> None:
    with LiveSession([odd, odd]) as session:
        session.advance(3)
        good = session.frame()
        session.play()
        session.set_ctrl(2, 1e150)
        session.advance(5)
        bad = session.frame()
        assert_has(bad, running=False, steps=good.steps, time=good.time)  # the last good moment
        assert bad.error.startswith("mujoco: ")
        np.testing.assert_array_equal(bad.poses[0].xpos, good.poses[0].xpos)
        session.play()
        assert not session.running
        session.step(3)
        assert session.frame().error == bad.error
        session.reset()
        session.advance(3)
        again = session.frame()
        assert_has(again, error="", steps=3)
        np.testing.assert_array_equal(again.poses[0].xpos, good.poses[0].xpos)


@pytest.mark.usefixtures("bullet")
def test_a_divergence_on_the_ghost_alone_stops_both() -> None:
    with LiveSession(on_both("so101/scene")) as session:
        session.arms[1][1].qvel[0] = math.nan
        session.play()
        session.advance()
        assert not session.running
        assert session.frame().error.startswith("pybullet: ")
        session.reset()
        session.advance(10)
        assert session.frame().error == ""


def test_a_session_refuses_what_does_not_fit(mujoco_scene: sm.Model, odd: sm.Model) -> None:
    one, other, bare = (
        record(mujoco_scene, seconds=0.05),
        record(odd, seconds=0.05),
        record(mujoco_scene, seconds=0.05, derived="nothing"),
    )
    refused(
        (TraceError, "another model", lambda: TraceSession([one, other])),
        (TraceError, "cannot be drawn", lambda: TraceSession([bare])),
        (BadInputError, "another model", lambda: LiveSession([mujoco_scene, odd])),
        (
            BadInputError,
            "timesteps differ",
            lambda: LiveSession([mujoco_scene, mujoco_scene.replace(timestep=0.001)]),
        ),
        (UnknownNameError, "hled", lambda: LiveSession([sm.load(SCENE)], "hled")),
        (UnknownNameError, "", lambda: LiveSession([mujoco_scene], site="nose")),
    )


def test_sliders_of_an_arm_are_its_actuators_in_degrees() -> None:
    arm = controls_of(sm.load("so101"))
    assert [c.name for c in arm][:2] == ["shoulder_pan", "shoulder_lift"]
    assert {c.unit for c in arm} == {"°"}
    assert (arm[1].low, arm[1].high) == pytest.approx((-100, 100), abs=1e-3)
    assert arm[1].scale * 180 == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("number", "low", "high", "unit"),
    [(0, -90, 90, "°"), (1, -200, 300, "mm"), (3, -1, 1, "")],
)
def test_a_slider_has_the_range_and_the_unit_of_what_its_actuator_drives(
    number: int, low: float, high: float, unit: str, odd: sm.Model
) -> None:
    control = controls_of(odd)[number]
    assert_has(control, low=pytest.approx(low), high=pytest.approx(high), unit=unit)


def test_an_actuator_without_a_name_is_called_by_its_number(odd: sm.Model) -> None:
    assert controls_of(odd)[1].name == "actuator 1"


def test_a_slider_of_what_is_neither_angle_nor_length_has_no_unit(odd: sm.Model) -> None:
    wild = controls_of(odd)[2]
    assert (wild.high, wild.unit, wild.scale) == (1e150, "", 1)


def test_the_fingertip_is_the_usual_site_or_the_one_that_was_named(
    mujoco_arm: sm.Model, odd: sm.Model
) -> None:
    for model, site, tip in (
        (mujoco_arm, None, "gripperframe"),
        (mujoco_arm, "baseframe", "baseframe"),
        (odd, None, "end"),
    ):
        with LiveSession([model], site=site) as session:
            assert session.tip == tip


# The clock


class Clock:
    """A clock that only goes on when somebody sleeps or works."""

    def __init__(self) -> None:
        self.now = 50.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.now += seconds


class Hand:
    """A front: what is put in is asked for at the next turn; it keeps what is shown."""

    def __init__(self) -> None:
        self.asked: list[Command] = []
        self.shown: list[tuple[Frame, Tempo, str]] = []

    def commands(self) -> Sequence[Command]:
        taken, self.asked = self.asked, []
        return taken

    def show(self, frame: Frame, pace: Tempo, note: str) -> None:
        self.shown.append((frame, pace, note))


class Slow(LiveSession):
    """A session whose every step costs some time of a clock."""

    def __init__(self, clock: Clock, cost: float) -> None:
        super().__init__([sm.load("so101/scene")])
        self.clock, self.cost = clock, cost

    def advance(self, count: int = 1) -> None:
        super().advance(count)
        self.clock.now += self.cost * count


def turned(loop: Live, hand: Hand, *asked: Command, turns: int = 1) -> tuple[Frame, Tempo, str]:
    """Return what is shown after some turns, of which the first obeys these commands."""
    hand.asked += asked
    for _ in range(turns):
        loop.turn()
    return hand.shown[-1]


@contextmanager
def live(cost: float = 0.0, speed: float = 1.0) -> Iterator[tuple[Slow, Live, Hand, Clock]]:
    clock, hand = Clock(), Hand()
    session = Slow(clock, cost)
    with session:
        session.set_speed(speed)
        yield session, Live(session, hand, clock, clock.sleep), hand, clock


@pytest.mark.parametrize("speed", [0.1, 1.0, 3.0])
def test_time_follows_the_clock(speed: float) -> None:
    with live(cost=0.0001, speed=speed) as (session, loop, hand, clock):
        hand.asked.append(session.play)
        began = clock.now
        loop.run(seconds=2.0)
        frame, pace, _ = hand.shown[-1]
        assert frame.time == pytest.approx(speed * (clock.now - began), abs=0.06 * max(1, speed))
        assert_has(pace, reached=pytest.approx(speed, rel=0.05), late=False)
        assert 30 <= len(hand.shown) / 2 <= 60  # frames a second
        assert session.running


def test_an_engine_that_is_too_slow_is_said_and_does_not_lag_ever_more() -> None:
    with live(cost=0.010) as (session, loop, hand, _clock):
        hand.asked.append(session.play)
        loop.run(seconds=3.0)
        _, pace, _ = hand.shown[-1]
        assert pace.reached == pytest.approx(0.5, abs=0.05)  # 5 ms of it in 10 ms
        assert pace.late
        gaps = np.diff([shown[0].time for shown in hand.shown])
        assert gaps.max() < 0.06  # the page is still alive
        session.cost = 0.0
        loop.run(seconds=3.0)
        _, pace, _ = hand.shown[-1]
        assert_has(pace, reached=pytest.approx(1.0, abs=0.02), late=False)
        # What it lost is not made up for in a rush: a quarter of a second at most.
        assert np.diff([shown[0].time for shown in hand.shown])[len(gaps) :].sum() < 3.0 + 0.26


def test_time_that_stood_is_not_owed() -> None:
    with live() as (session, loop, hand, _clock):
        loop.run(seconds=5.0)
        assert hand.shown[-1][0].time == 0
        assert hand.shown[-1][1].reached is None
        assert turned(loop, hand, session.play, turns=2)[0].time <= 0.051
        standing = turned(loop, hand, session.step)[0].time
        loop.run(seconds=2.0)
        assert hand.shown[-1][0].time == standing
        assert turned(loop, hand, session.play, turns=2)[0].time <= standing + 0.051


def test_a_bad_command_is_a_note_until_the_next_one() -> None:
    with live() as (session, loop, hand, _clock):
        _, pace, note = turned(
            loop, hand, partial(session.set_speed, 2.0), partial(session.set_speed, -1.0)
        )
        assert "speed" in note
        assert pace.asked == 2.0
        frame, _, note = turned(loop, hand, partial(session.set_ctrl, 0, 0.1))
        assert (frame.ctrl[0], note) == (0.1, "")


def test_commands_are_obeyed_in_their_order() -> None:
    with live() as (session, loop, hand, _clock):
        first, *rest = (partial(session.set_ctrl, 0, value) for value in (0.5, 0.2, 0.3))
        assert turned(loop, hand, first, session.reset, *rest)[0].ctrl[0] == 0.3


# The words


def test_the_readout_says_what_the_frame_says() -> None:
    def pose(name: str, tip: tuple[float, float, float]) -> EnginePose:
        nothing = np.zeros((0, 3))
        return EnginePose(name, nothing, nothing, np.zeros(0), np.array(tip))

    joint = Gap(math.radians(2.5), "rad", "elbow")
    frame = Frame(
        time=1.25,
        steps=250,
        running=True,
        ctrl=np.zeros(0),
        resets=0,
        poses=(pose("mujoco", (0.1, -0.02, 0.3)), pose("pybullet", (0.1, -0.02, 0.3015))),
        tips_apart=0.0015,
        joint_apart=joint,
        error="",
    )
    assert dict(readout(frame, Tempo(1.0, 0.997, False), "tip")).items() >= {
        ("time", "1.250 s"),
        ("steps", "250"),
        ("pace", "1.00 × real time"),
        ("on mujoco", "100.0  -20.0  300.0 mm"),
        ("tips apart", "1.500 mm"),
        ("joints apart", "2.500°, elbow"),
    }
    assert "0.50 ×" in dict(readout(frame, Tempo(2.0, 0.5, True), "tip"))["pace"]
    assert warning(frame, "a note") == "a note"
    stopped = replace(frame, running=False, error="mujoco: it blew up")
    assert dict(readout(stopped, Tempo(1, None, False), ""))["pace"] == "paused"
    assert warning(stopped, "").startswith(stopped.error)


# Recordings


def test_a_recording_is_played_and_sought(mujoco_scene: sm.Model) -> None:
    held = record(mujoco_scene, seconds=1.0)
    fallen = record(mujoco_scene.replace(actuation=False), seconds=0.5)
    recording = TraceSession([held, fallen])
    assert recording.length == pytest.approx(0.5)  # of the shorter
    recording.play()
    recording.advance(30)
    frame: Any = recording.frame()
    assert frame.time == pytest.approx(30 * mujoco_scene.timestep)
    np.testing.assert_array_equal(frame.poses[0].xpos, held["xpos"][30])
    np.testing.assert_array_equal(frame.poses[1].xpos, fallen["xpos"][30])
    assert frame.joint_apart.size == np.abs(held.qpos[30] - fallen.qpos[30]).max()
    recording.advance(10_000)
    assert_has(recording.frame(), steps=100, running=False)
    for call, value, steps in (("seek", 0.2, 40), ("step", 2, 42), ("seek", -5, 0)):
        getattr(recording, call)(value)
        assert recording.frame().steps == steps
    recording.seek(1e9)
    recording.play()  # from the end, again from the start
    assert (recording.frame().steps, recording.running) == (0, True)
    refused((BadInputError, "", lambda: recording.set_ctrl(0, 1.0)))


def test_moments_that_are_not_the_same_are_not_compared(mujoco_scene: sm.Model) -> None:
    models = mujoco_scene, mujoco_scene.replace(timestep=1 / 240)
    one, two = (record(model, seconds=0.1) for model in models)
    recording = TraceSession([one, two])
    assert recording.frame().joint_apart is not None  # both at 0
    recording.advance(1)
    assert_has(recording.frame(), joint_apart=None, tips_apart=None)
    np.testing.assert_array_equal(recording.frame().poses[1].xpos, two["xpos"][1])


# The command


def _listening(pid: int) -> set[str]:
    """Return addresses on which a process listens, as the kernel's tables have them."""
    sockets = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):
            sockets.add(os.readlink(link))
    rows = [
        line.split()
        for table in ("tcp", "tcp6")
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]
    ]
    return {row[1] for row in rows if row[3] == "0A" and f"socket:[{row[9]}]" in sockets}


@pytest.mark.usefixtures("viser")
def test_it_listens_on_loopback_alone_and_ctrl_c_ends_it(tmp_path: Path) -> None:
    port = free_pair()
    with Viewer(tmp_path, "--port", str(port)) as viewer:
        address, _, token = viewer.line().strip().partition("/?token=")
        assert address == f"http://localhost:{port}"
        assert len(token) >= 16
        assert "mujoco" in viewer.line()
        viewer.line()
        assert f"ssh -L {port}:localhost:{port}" in viewer.line()
        # Who connects and says nothing leaves no trace in the terminal.
        with socket.create_connection(("127.0.0.1", port), timeout=60):
            pass
        if sys.platform == "linux":
            assert _listening(viewer.process.pid) == {f"0100007F:{port:04X}"}
            # Who listens everywhere listens here too.
            refused(
                (OSError, "", lambda: socket.create_connection(("127.0.0.2", port), timeout=60))
            )
        viewer.process.send_signal(signal.SIGINT)
        assert viewer.end() == ""
    with socket.socket() as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))


@pytest.mark.usefixtures("viser")
def test_a_taken_port_is_said_the_next_one_is_taken_and_nothing_else_is_said(
    tmp_path: Path,
) -> None:
    """No banner of viser's, and viser's own variable for the port does not count."""
    port = free_pair()
    words = ("--port", str(port), "--seconds", "0.2", "--paused")
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", port))
        holder.listen()
        with Viewer(tmp_path, *words, _VISER_PORT_OVERRIDE=str(port + 2)) as viewer:
            first, second, *rest = viewer.end().splitlines()
    assert_in(first, f"ort {port} is taken", str(port + 1))
    assert f"http://localhost:{port + 1}" in second
    assert (len(rest), "viser" in " ".join(rest)) == (3, False)
    assert max(map(len, rest)) <= 80


@pytest.mark.usefixtures("viser")
def test_a_trace_is_shown_and_no_engine_of_its_own_is_needed(
    mujoco_box: sm.Model, tmp_path: Path
) -> None:
    file = write(
        record(
            mujoco_box,
            seconds=0.1,
            start=RunStart(keyframe=0),
            metadata=RunMetadata(experiment="box"),
        ),
        tmp_path / "box.npz",
    )
    port = str(free_pair())
    with Viewer(tmp_path, str(file), str(file), "--port", port, "--seconds", "0.3") as viewer:
        assert_in(viewer.end(), "box of so101/scene_box", f"mujoco {mujoco_box.engine_version}")


def test_nobody_opens_a_tunnel_from_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tab may ask for a public address; viser would ask its makers' server for one."""
    viser = pytest.importorskip("viser")
    from viser import _messages, _viser

    tunnel = Mock()
    monkeypatch.setattr(_viser, "ViserTunnel", tunnel)
    with served() as server:
        assert isinstance(server, viser.ViserServer)
        handlers = server._websock_server._incoming_handlers[_messages.ShareUrlRequest]
        assert handlers
        for handler in handlers:
            handler(0, _messages.ShareUrlRequest())
        server._thread_executor.shutdown(wait=True)
    tunnel.assert_not_called()


def test_an_interrupt_that_is_swallowed_ends_it_all_the_same() -> None:
    """NumPy swallows a Ctrl-C that falls into a comparison."""
    stop: list[int] = []

    def turn() -> None:
        with suppress(KeyboardInterrupt):
            stop.append(signal.SIGINT)
            raise KeyboardInterrupt

    Live.run(Mock(turn=turn, _clock=time.monotonic), None, stop)
    assert stop == [signal.SIGINT]
