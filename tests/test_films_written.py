"""Films as they are written: which pictures, for how long, seen from where, by whom drawn."""

from __future__ import annotations

import io
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.pictures import Renderer
from statemachine.errors import (
    BadInputError,
    MissingEngineError,
    ModelFileError,
    StateMachineError,
    TraceError,
)
from statemachine.lab.ask import pages
from statemachine.lab.compare import compare
from statemachine.lab.questions import film, run_files
from statemachine.lab.questions.film import (
    FILM_SIZE,
    Timing,
    drawn_picture,
    frames,
    inline,
    motion_of,
    timing_of,
    webp,
    write_film,
    write_webp,
)
from statemachine.lab.questions.run_files import RunFiles, ShownModels, find_renderer
from statemachine.lab.recordings import Trace
from statemachine.show.drawing.scene import Camera
from statemachine.show.pictures import Bars, RobotPicture

from .support.rendering import seen_by
from .support.traces import changed, traced

pytestmark = pytest.mark.usefixtures("pillow", "matplotlib")

PYBULLET = Renderer("pybullet")


@pytest.fixture(scope="module")
def hold() -> Trace:
    """A short run of the arm above a floor."""
    return traced("hold", seconds=0.1)


@pytest.fixture
def arm() -> sm.Model:
    return sm.load("so101/scene")


class Notes:
    """A Reporter that keeps what it is told."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.fractions: list[float] = []

    @contextmanager
    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> Iterator[Any]:
        yield self.fractions.append

    def note(self, text: str) -> None:
        self.notes.append(text)

    def so_far(self, page: Any) -> None:
        raise AssertionError(page)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Let pictures be plain, each a little brighter than the last; return what was asked for."""
    calls: list[tuple[Any, ...]] = []

    def plain(
        sides: Sequence[Any], size: tuple[int, int], camera: Camera, renderer: Renderer
    ) -> Generator[np.ndarray]:
        calls.append((sides, size, camera, renderer))
        for k in range(len(sides[0].xpos)):
            yield np.full((size[1], size[0], 3), 40 * k, np.uint8)

    monkeypatch.setattr(film, "drawn", plain)
    monkeypatch.setattr(film, "renderer_here", lambda: PYBULLET)
    return calls


def _read(pillow: Any, content: bytes) -> list[tuple[np.ndarray, int]]:
    """Return the pictures of a film, and how long each is shown [ms]."""
    reel = pillow.open(io.BytesIO(content))
    found: list[tuple[np.ndarray, int]] = []
    for k in range(reel.n_frames):
        reel.seek(k)
        reel.load()
        found.append((np.asarray(reel.convert("RGB")).astype(int), reel.info["duration"]))
    return found


def test_a_film_has_its_pictures_in_their_order_and_for_their_time(pillow: Any) -> None:
    pictures = (pillow.new("RGB", (16, 16), (60 * k, 0, 0)) for k in range(4))
    out = io.BytesIO()
    write_webp(out, pictures, [40, 50, 60, 70])
    read = _read(pillow, out.getvalue())
    assert [time for _, time in read] == [40, 50, 60, 70]
    np.testing.assert_allclose([p[..., 0].mean() for p, _ in read], [0, 60, 120, 180], atol=8)


@pytest.mark.parametrize(
    ("seconds", "count", "milliseconds"),
    [
        (0.1, 3, [33, 34, 33]),
        (0.11, 4, [33, 34, 33, 10]),
        (0.0, 1, [0]),
        (1 / 30, 1, [33]),
    ],
)
def test_pictures_are_shown_for_the_time_until_the_next(
    seconds: float, count: int, milliseconds: list[int]
) -> None:
    timing = Timing(seconds)
    assert (timing.count, timing.milliseconds) == (count, milliseconds)
    np.testing.assert_allclose(timing.times, np.arange(count) / 30)


def test_a_film_of_two_runs_lasts_as_long_as_the_shorter(hold: Trace) -> None:
    rows = len(hold.time) // 2
    columns = {n: a[:rows] for n, a in hold.columns.items() if not n.startswith("contact_")}
    short = Trace(hold.header, columns)
    for traces in ([hold, short], [short, hold]):
        assert timing_of(traces).seconds == pytest.approx(short.time[-1] - short.time[0])


def test_a_film_shows_the_rows_that_are_nearest_to_its_moments(
    hold: Trace, arm: sm.Model, asked: list[tuple[Any, ...]]
) -> None:
    later = changed(hold, time=hold.time + 7)
    list(frames([later, hold], [arm, arm], (64, 48), Timing(0.1), PYBULLET))
    ((sides, size, camera, renderer),) = asked
    rows = [int(np.abs(hold.time - hold.time[0] - k / 30).argmin()) for k in range(3)]
    for side in sides:
        np.testing.assert_array_equal(side.xpos, hold["xpos"][rows])
        np.testing.assert_array_equal(side.xquat, hold["xquat"][rows])
    assert (size, renderer) == ((64, 48), PYBULLET)
    points = np.concatenate([side.corners() for side in sides])
    assert np.abs(seen_by(camera, points, 64 / 48)).max() == pytest.approx(0.9, abs=0.02)


def test_a_film_is_seen_by_the_camera_that_it_is_given(
    hold: Trace, arm: sm.Model, asked: list[tuple[Any, ...]]
) -> None:
    camera = Camera((0, 0, 0), 1.0, 0.0, 0.0)
    list(frames([hold], [arm], (64, 48), Timing(0.1), PYBULLET, camera))
    assert asked[0][2] is camera


def test_poses_that_are_not_numbers_cannot_be_drawn(hold: Trace, arm: sm.Model) -> None:
    times = np.array([0.0, 0.05])
    for name in ("xpos", "xquat"):
        broken = hold[name].copy()
        broken[-1:, -1] = np.nan
        trace = changed(hold, None, **{name: broken})
        assert motion_of(trace, arm, times).xpos.shape[0] == 2
        with pytest.raises(TraceError):
            motion_of(trace, arm, np.array([0.0, 0.1]))


@pytest.mark.usefixtures("asked")
def test_a_film_file_is_told_as_it_is(
    hold: Trace, arm: sm.Model, pillow: Any, tmp_path: Path
) -> None:
    told: list[float] = []
    file = write_film(tmp_path / "a.webp", [hold], [arm], PYBULLET, progress=told.append)
    read = _read(pillow, file.path.read_bytes())
    assert (file.pictures, file.seconds) == (len(read), pytest.approx(0.1))
    assert file.size == (tmp_path / "a.webp").stat().st_size
    assert file.renderer == str(PYBULLET)
    np.testing.assert_allclose(told, [1 / 3, 2 / 3, 1])
    assert read[0][0].shape == (FILM_SIZE[1], FILM_SIZE[0], 3)


def test_the_pictures_of_a_film_get_brighter_as_they_are_drawn(
    hold: Trace, arm: sm.Model, asked: list[tuple[Any, ...]], pillow: Any, tmp_path: Path
) -> None:
    write_film(tmp_path / "a.webp", [hold], [arm], PYBULLET)
    read = _read(pillow, (tmp_path / "a.webp").read_bytes())
    width, height = asked[0][1]
    assert width == FILM_SIZE[0]
    inside = [p[FILM_SIZE[1] - height // 2, width // 2].mean() for p, _ in read]
    np.testing.assert_allclose(inside, [0, 40, 80], atol=8)


def test_a_film_of_two_runs_has_a_strip_below(
    hold: Trace, arm: sm.Model, asked: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    sides = [hold, hold], [arm, arm], PYBULLET
    write_film(tmp_path / "a.webp", *sides)
    write_film(tmp_path / "b.webp", *sides, compare(hold, hold))
    (_, (_, plain), *_), (_, (_, above), *_) = asked
    assert plain - above == round(0.18 * FILM_SIZE[1])
    assert len(asked[0][0]) == 2


# Small pictures of a robot.


def _robot(model: sm.Model, poses: int, ghost: bool = False, near: str = "") -> RobotPicture:
    qpos = np.linspace(0.0, 0.3, poses)[:, None] * np.ones(model.nq)
    both = qpos, qpos + 0.1 if ghost else None
    return RobotPicture("a", "b", "c", "so101", lambda: both, interval=0.12, near=near)


def test_the_last_pose_of_a_robot_is_shown_longest(
    asked: list[tuple[Any, ...]], pillow: Any
) -> None:
    read = _read(pillow, webp(_robot(sm.load("so101"), 3)))
    assert [time for _, time in read] == [120, 120, 1500]
    assert asked[0][1] == (480, 360)


@pytest.mark.parametrize(("ghost", "sides"), [(False, 1), (True, 2)])
def test_a_ghost_is_drawn_where_there_is_one(
    ghost: bool, sides: int, asked: list[tuple[Any, ...]]
) -> None:
    webp(_robot(sm.load("so101"), 2, ghost))
    assert len(asked[0][0]) == sides
    if ghost:
        assert not np.array_equal(asked[0][0][0].xpos, asked[0][0][1].xpos)


def test_what_is_seen_from_close_by_fills_the_picture(asked: list[tuple[Any, ...]]) -> None:
    model = sm.load("so101")
    name = model.body_names[-1]
    for near in ("", name):
        webp(_robot(model, 3, ghost=True, near=near))
    (_, _, far, _), (sides, _, close, _) = asked
    assert (close.azimuth, close.elevation) == (far.azimuth, far.elevation)
    places = np.concatenate([side.xpos[:, model.body_id(name)] for side in sides])
    cube = 0.07 * np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    seen = seen_by(close, (places[:, None] + cube).reshape(-1, 3), 480 / 360)
    assert np.abs(seen).max() == pytest.approx(0.9, abs=0.01)


def test_a_robot_is_drawn_as_webp_and_bars_as_svg(asked: list[tuple[Any, ...]]) -> None:
    content, kind = drawn_picture(_robot(sm.load("so101"), 1))
    assert (kind, content[:4], content[8:12]) == ("webp", b"RIFF", b"WEBP")
    content, kind = drawn_picture(Bars("a", "b", ["x"], {"y": [1.0]}))
    assert kind == "svg+xml"
    assert b"<svg" in content
    assert len(asked) == 1


@pytest.mark.usefixtures("asked")
def test_a_picture_in_a_page_is_a_data_url_of_its_kind() -> None:
    assert inline(_robot(sm.load("so101"), 1)).startswith("data:image/webp;base64,")


def test_a_picture_in_a_page_is_left_out_without_what_draws_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing() -> Renderer:
        raise MissingEngineError("no", engine="mujoco")

    monkeypatch.setattr(film, "renderer_here", missing)
    assert inline(_robot(sm.load("so101"), 1)) == ""


# The film of a run, or of a comparison.


@pytest.mark.parametrize(("name", "notes"), [("mujoco", 0), ("pybullet", 1)])
def test_who_draws_is_noted_where_it_is_not_the_first_choice(
    name: str, notes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_files, "renderer_here", lambda: Renderer(name))
    reporter = Notes()
    assert find_renderer(reporter).name == name
    assert len(reporter.notes) == notes


@pytest.mark.parametrize(("digest", "notes"), [("", 1), ("0" * 64, 2)])
@pytest.mark.usefixtures("asked")
def test_a_film_by_another_state_of_a_file_is_noted(
    digest: str, notes: int, hold: Trace, tmp_path: Path
) -> None:
    known = hold.header.provenance
    if digest:
        known = replace(known, model_sha256=digest)
    trace, reporter = changed(hold, {"provenance": known}), Notes()
    shown = ShownModels(["so101/scene"])
    run_files.write_film(tmp_path / "a.webp", [trace], shown, PYBULLET, reporter=reporter)
    assert len(reporter.notes) == notes
    assert (tmp_path / "a.webp").stat().st_size > 0
    np.testing.assert_allclose(reporter.fractions, [1 / 3, 2 / 3, 1])


def test_a_film_needs_its_model(hold: Trace, tmp_path: Path) -> None:
    shown = ShownModels([tmp_path / "nothing.xml"])
    with pytest.raises(ModelFileError):
        run_files.write_film(tmp_path / "a.webp", [hold], shown, PYBULLET)
    assert not (tmp_path / "a.webp").exists()


def test_a_figure_of_a_run_is_written_and_noted(hold: Trace, tmp_path: Path) -> None:
    reporter = Notes()
    run_files.write_figure(tmp_path / "a.svg", [hold], reporter=reporter)
    assert b"<svg" in (tmp_path / "a.svg").read_bytes()
    assert len(reporter.notes) == 1


@pytest.mark.parametrize("name", ["plot", "film", "junit"])
def test_files_are_checked_for_their_folder_before_anything_runs(name: str, tmp_path: Path) -> None:
    suffix = {"plot": "svg", "film": "webp", "junit": "xml"}[name]
    RunFiles(**{name: tmp_path / f"a.{suffix}"}).check()
    with pytest.raises(StateMachineError):
        RunFiles(**{name: tmp_path / "none" / f"a.{suffix}"}).check()


@pytest.mark.parametrize(("name", "file"), [("plot", "a.gif"), ("film", "a.gif"), ("html", "a.x")])
def test_files_of_another_suffix_are_refused_before_anything_runs(
    name: str, file: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInputError):
        RunFiles(**{name: tmp_path / file}).check()


def test_a_comparison_has_no_file_of_another_suffix(tmp_path: Path) -> None:
    result: Any = None
    with pytest.raises(BadInputError):
        pages.write(result, tmp_path / "a.txt")
