"""Pictures of traces: opened again, and looked at."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import Mock
from xml.etree import ElementTree

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import pictures as probe
from statemachine.engines import pybullet as pybullet_room
from statemachine.engines.mujoco import rendering as mujoco_rendering
from statemachine.errors import BadInputError, MissingEngineError, TraceError
from statemachine.lab.compare import compare
from statemachine.lab.questions.film import (
    FILM_SIZE,
    Timing,
    frames,
    motion_of,
    write_film,
)
from statemachine.lab.questions.film_overlay import STRIP, Overlay
from statemachine.lab.questions.plot import (
    FIGURE_SETTINGS,
    TracePlot,
    draw,
    drawn,
    of_comparison,
    of_trace,
    write_plot,
)
from statemachine.lab.questions.stage.quantity_chart import charts_of
from statemachine.lab.recordings import RunMetadata, Trace, read_shipped_trace, record, write
from statemachine.lab.recordings.header import INPUTS
from statemachine.show.drawing.scene import Camera, Shot, compose, framed, smaller

from .support.claims import assert_has, assert_in, refused
from .support.files import written
from .support.processes import Cli, processes_with, soon
from .support.rendering import rendering_environment, seen_by, silhouettes
from .support.requirements import ROOT, need_engine
from .support.small_models import mjcf
from .support.traces import changed as edited

pytestmark = pytest.mark.slow  # a browser or a renderer at work

SIZE = (320, 240)
FIRST, SECOND = (0, -0.6, 1.2, 0.5, 0, 0.6), (0.9, -0.3, 0.4, -0.4, 0, 0.2)


@pytest.fixture(scope="module")
def sides() -> tuple[sm.Model, Trace, Trace]:
    """Return two runs of one model that part at once, and far."""
    model = sm.load("so101/scene")
    one, two = (
        record(
            model,
            lambda _m, _d, told=told: np.array(told),
            0.5,
            metadata=RunMetadata(experiment="swing"),
        )
        for told in (FIRST, SECOND)
    )
    return model, one, two


@pytest.fixture(scope="module")
def mujoco_here() -> probe.Renderer:
    return probe.Renderer("mujoco", rendering_environment().get("MUJOCO_GL", ""))


@pytest.fixture
def renderer(request: pytest.FixtureRequest) -> probe.Renderer:
    """Return each renderer that works here."""
    if request.param == "pybullet":
        need_engine("pybullet")
        return probe.Renderer("pybullet")
    return request.getfixturevalue("mujoco_here")


both_renderers = pytest.mark.parametrize("renderer", ["mujoco", "pybullet"], indirect=True)


def test_the_renderers_are_those_that_are_tried_here() -> None:
    assert set(probe.renderers()) == {"mujoco", "pybullet"}


def _differ(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 8


# What a film is of, and when: figures only.


def test_a_film_lasts_as_long_as_the_simulated_time() -> None:
    for seconds, fps in ((2.0, 30), (2.0, 24), (0.37, 25), (1.0, 7), (0.001, 30)):
        timing = Timing(seconds, fps)
        assert sum(timing.milliseconds) == round(1000 * seconds)
        assert len(timing.milliseconds) == timing.count == len(timing.times)
        assert timing.times[-1] < seconds <= timing.times[-1] + 1 / fps + 1e-9
        np.testing.assert_allclose(timing.times * fps, np.arange(timing.count), atol=1e-9)


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    body = (
        "<body name='ball' pos='0 0 1'><freejoint/>"
        "<geom type='sphere' size='0.1' rgba='1 0.5 0 1'/></body>"
    )
    return written(tmp_path / "ball.xml", mjcf(body, option="<option gravity='0 0 0'/>"))


def test_a_trace_without_poses_has_them_from_its_qpos(
    sides: tuple[sm.Model, Trace, Trace], ball: Path
) -> None:
    model, one, _ = sides
    bare = Trace(one.header, {n: one[n] + 10 * (n == "time") for n in INPUTS})
    times = np.array([0.0, 0.2, 0.4])  # counted from the start of each
    whole, derived = motion_of(one, model, times), motion_of(bare, model, times)
    np.testing.assert_allclose(derived.xpos, whole.xpos, atol=1e-12)
    np.testing.assert_allclose(derived.xquat, whole.xquat, atol=1e-12)
    refused((TraceError, "other bodies", lambda: motion_of(one, sm.load(ball), times)))


def test_the_camera_has_everything_in_its_picture_and_is_as_near_as_can_be() -> None:
    cloud = np.random.default_rng(1).normal(size=(200, 3)) * (0.3, 0.1, 0.5) + (5, -3, 2)
    for aspect in (0.5, 4 / 3, 3):
        for azimuth, elevation in ((140, -20), (0, 0), (-75, -80), (10, 35)):
            seen = np.abs(seen_by(framed(cloud, aspect, azimuth, elevation), cloud, aspect))
            assert seen.max() == pytest.approx(0.9, abs=0.01)
    axes = [(1, 0, 0), (0, 0, 1), (0, 1, 0)]  # right, up, forward: azimuth 90 looks along +y
    np.testing.assert_allclose(framed(cloud, 1, 90, 0).axes, axes, atol=1e-12)


def test_a_ghost_is_seen_where_it_is_nearer_by_more_than_the_bias() -> None:
    far = np.full((5, 9), np.inf)
    solid = Shot(np.full((5, 9, 3), 200, np.uint8), np.where(np.arange(9) < 6, 1.0, far))
    depth = far.copy()
    depth[1:4, 1:8] = 0.999  # in the same place as the solid side, to a millimetre
    depth[2, 2] = 0.9
    ghost = Shot(np.zeros((5, 9, 3), np.uint8), depth)
    changed = (compose(solid, ghost, 0.01, 1) != solid.rgb).any(axis=2)
    # Where the solid side is not, and where the ghost is nearer.
    assert set(zip(*np.nonzero(changed), strict=True)) == {*product((1, 2, 3), (6, 7)), (2, 2)}
    assert compose(solid, None, 0.01, 1) is solid.rgb


def test_smaller_pictures_are_means() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (6, 8, 3)).astype(np.uint8)
    mean = picture.reshape(3, 2, 4, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(smaller(picture, 2), mean, atol=1)


@pytest.mark.usefixtures("matplotlib")
def test_a_film_of_too_many_pictures_is_refused(ball: Path) -> None:
    model = sm.load(ball)
    sides = [record(model, seconds=167.0, derived="nothing")], [model]
    film = partial(write_film, ball.with_name("a.webp"), *sides, probe.Renderer("mujoco"))
    refused((BadInputError, "5010 pictures; at most 5000: lower --seconds", film))


# Pictures that are drawn.


@both_renderers
def test_pictures_change_as_the_arm_moves(
    sides: tuple[sm.Model, Trace, Trace], renderer: probe.Renderer
) -> None:
    model, one, _ = sides
    first, *others = frames([one], [model], SIZE, Timing(0.5, 6), renderer)
    assert [picture.shape for picture in (first, *others)] == [(240, 320, 3)] * 3
    assert min(_differ(first, other).mean() for other in others) > 0.02


@both_renderers
def test_the_ghost_is_the_second_side_in_its_own_pose(
    sides: tuple[sm.Model, Trace, Trace], renderer: probe.Renderer, tmp_path: Path
) -> None:
    """Against silhouettes that MuJoCo's own renderer draws of the two qpos."""
    model, one, two = sides
    how = SIZE, Timing(0.5, 2.5), renderer, _camera(model, one, two)  # pictures at 0 and 0.4 s
    alone, together = (
        list(frames(traces, [model] * len(traces), *how)) for traces in ([one], [one, two])
    )
    row = int(np.argmin(np.abs(one.time - 0.4)))
    shots = [(trace.qpos[row], how[-1]) for trace in (one, two)]
    first, second = silhouettes(model.path, shots, SIZE, tmp_path)
    changed = _differ(alone[1], together[1])
    outside = _grown(first, 2)
    assert (second & ~outside).sum() > 1000  # the poses lie apart: the test can fail
    assert changed[second & ~outside].mean() > 0.95
    assert changed[~_grown(second, 2)].mean() < 0.001
    assert not _differ(alone[0], together[0]).any()  # both start in one place


def _camera(model: sm.Model, *traces: Trace) -> Camera:
    times = np.linspace(0, 0.5, 6)
    cloud = np.concatenate([motion_of(t, model, times).corners() for t in traces])
    return framed(cloud, SIZE[0] / SIZE[1], 140, -20)


def _grown(mask: np.ndarray, by: int) -> np.ndarray:
    for _ in range(by):
        padded = np.pad(mask, 1)
        mask = mask | padded[2:, 1:-1] | padded[:-2, 1:-1] | padded[1:-1, 2:] | padded[1:-1, :-2]
    return mask


def test_poses_are_those_of_the_trace_not_of_its_qpos(
    sides: tuple[sm.Model, Trace, Trace], mujoco_here: probe.Renderer
) -> None:
    """An engine that says its bodies are elsewhere is drawn as it says."""
    model, one, _ = sides
    (here,), (there,) = (
        frames([trace], [model], SIZE, Timing(0.1, 10), mujoco_here, _camera(model, one))
        for trace in (one, edited(one, xpos=one["xpos"] + np.array([0, 0, 0.1])))
    )
    assert _differ(here, there).mean() > 0.05


def test_two_models_of_one_robot_are_drawn_in_one_picture(
    ball: Path, mujoco_here: probe.Renderer
) -> None:
    """Each side with its own looks and its own file."""
    wide = written(ball.with_name("wide.xml"), ball.read_text().replace("0.1'", "0.2'"))
    models = [sm.load(file) for file in (ball, wide)]
    traces = [record(model, None, 0.02) for model in models]
    how: Any = SIZE, Timing(0.02, 50), mujoco_here, Camera((0, 0, 1), 2.0, 90, 0)
    (alone,) = frames(traces[:1], models[:1], *how)
    (together,) = frames(traces, models, *how)
    # A sphere of radius r at distance d is seen under asin(r/d): here a disc of 96 pixels.
    radius = 120 * np.tan(np.arcsin(0.2 / 2.0)) / np.tan(np.radians(15))
    assert _differ(alone, together).sum() == pytest.approx(np.pi * radius**2, rel=0.04)


# Files.


@pytest.fixture
def film(sides: tuple[sm.Model, Trace, Trace], mujoco_here: probe.Renderer, tmp_path: Path) -> Any:
    model, *traces = sides

    return lambda name, **how: write_film(
        *(tmp_path / name, traces, [model] * 2, mujoco_here, compare(*traces)),
        **how,
    )


def test_a_film_is_a_webp_with_its_pictures_and_their_lengths(film: Any, pillow: Any) -> None:
    from PIL import ImageSequence

    told: list[float] = []
    made = film("a.webp", progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    with pillow.open(made.path) as image:
        assert_has(image, n_frames=made.pictures, size=FILM_SIZE)
        shown = [
            (np.asarray(each.convert("RGB")), each.info["duration"])
            for each in ImageSequence.Iterator(image)
        ]
    pictures, lengths = zip(*shown, strict=True)
    assert len(pictures) == 15
    assert sum(lengths) == 500 == 1000 * made.seconds
    assert all(_differ(*pair).any() for pair in itertools.pairwise(pictures))
    assert made.size < 500_000
    assert os.listdir(made.path.parent) == ["a.webp"]


@pytest.mark.usefixtures("pillow")
def test_the_strip_has_cursor_curve_and_figures(sides: tuple[sm.Model, Trace, Trace]) -> None:
    _, one, two = sides
    charts = charts_of(compare(one, two))
    overlay = Overlay((400, 300), Timing(0.5, 20).times, "x", ["a", "b"], charts[0])
    width, height = overlay.inner
    assert width == 400
    frame = np.full((height, width, 3), 77, np.uint8)
    early, late = (np.asarray(overlay.paint(frame, k)).astype(int) for k in (2, 9))
    assert early.shape == (300, 400, 3)
    dark = [(p.max(axis=2) < 90)[300 - round(STRIP * 300) + 16 :] for p in (early, late)]
    assert dark[0].sum() < dark[1].sum()  # what is to come is pale
    cursors = [int(np.argmax(each.sum(axis=0)[60:])) + 60 for each in dark]
    assert cursors == pytest.approx([44 + 0.2 * 344, 44 + 0.9 * 344], abs=2)


# Which renderer.


def _without_opengl(tmp_path: Path) -> dict[str, str]:
    """Return an environment in which the dynamic linker finds no OpenGL worth the name."""
    folder = tmp_path / "libraries"
    folder.mkdir(exist_ok=True)
    for name in ("EGL.so.1", "EGL.so", "OSMesa.so.8", "OSMesa.so", "GL.so.1", "GL.so"):
        (folder / f"lib{name}").write_bytes(b"")
    return {"LD_LIBRARY_PATH": str(folder), "__EGL_VENDOR_LIBRARY_DIRS": str(folder), "DISPLAY": ""}


@pytest.mark.usefixtures("bullet")
def test_without_opengl_pybullet_draws_and_it_is_said(
    cli: Cli, tmp_path: Path, pillow: Any
) -> None:
    done = cli(
        *("compare", "hold", "--seconds", "0.2", "--film", "a.webp"),
        **_without_opengl(tmp_path),
    )
    first, second = done.stderr.splitlines()
    assert_in(first, "no OpenGL here", "PyBullet's software")
    assert second.endswith("software renderer")
    with pillow.open(tmp_path / "a.webp") as image:
        assert image.n_frames == 6


def test_what_draws_is_chosen_by_what_works(monkeypatch: pytest.MonkeyPatch) -> None:
    opengl, require = Mock(return_value="egl"), Mock()
    monkeypatch.setattr(mujoco_rendering, "offscreen_opengl", opengl)
    monkeypatch.setattr(pybullet_room, "require", require)
    assert probe.renderer_here() == probe.Renderer("mujoco", "egl")
    opengl.return_value = None
    assert probe.renderer_here() == probe.Renderer("pybullet")
    require.side_effect = MissingEngineError("pybullet is not installed here")
    refused(
        (MissingEngineError, "nothing here can draw", probe.renderer_here),
    )


# The command.


@pytest.fixture
def files(tmp_path: Path, sides: tuple[sm.Model, Trace, Trace]) -> tuple[str, ...]:
    """Return the two runs, in files."""
    pairs = zip(sides[1:], ("one.npz", "two.npz"), strict=True)
    return tuple(write(trace, tmp_path / name).name for trace, name in pairs)


@pytest.mark.usefixtures("matplotlib")
def test_compare_writes_what_it_is_asked_for(
    cli: Cli, tmp_path: Path, files: tuple[str, ...], mujoco_here: probe.Renderer
) -> None:
    done = cli(
        *("compare", *files, "--json", "--plot", "a.svg", "--film", "a.webp"),
        code=1,
    )
    json.loads(done.stdout)
    plotted, filmed = done.stderr.splitlines()
    assert "a.svg: a figure" in plotted
    assert_in(filmed, "a.webp", "0.5 s", "15 pictures", "drawn by MuJoCo")
    assert sorted(path.name for path in tmp_path.glob("a.*")) == ["a.svg", "a.webp"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
def test_ctrl_c_leaves_no_half_film_and_no_process(
    tmp_path: Path, files: tuple[str, ...], mujoco_here: probe.Renderer
) -> None:
    words = ("--film", "a.webp")
    child = subprocess.Popen(
        [sys.executable, "-m", "statemachine", "compare", *files, *words],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a group of its own, as a terminal's foreground job
    )
    try:
        soon(lambda: _drawing(tmp_path) or child.poll() is not None, 60)
        time.sleep(1)
        os.killpg(child.pid, signal.SIGINT)
        _, said = child.communicate(timeout=60)
    finally:
        child.kill()
    assert child.returncode == 130, said
    assert "Traceback" not in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.npz", "two.npz"]
    assert not _drawing(tmp_path)


def _drawing(place: Path) -> list[int]:
    """Return the processes that draw or encode in a folder."""
    pids = [*processes_with("engines.pictures"), *processes_with("ffmpeg")]
    return [pid for pid in pids if Path(f"/proc/{pid}/cwd").resolve() == place]


# Figures.


@pytest.fixture(scope="module")
def compared() -> tuple[Trace, Trace, Any]:
    """Return hold on MuJoCo, and as PyBullet was recorded."""
    two = read_shipped_trace("hold", "pybullet")
    one = record(
        sm.load("so101/scene"),
        lambda _m, _d: np.array(FIRST),
        2.0,
        metadata=RunMetadata(experiment="hold"),
    )
    return one, two, compare(one, two)


def _texts(svg: bytes) -> str:
    root = ElementTree.fromstring(svg)
    space = "{http://www.w3.org/2000/svg}"
    assert root.tag == f"{space}svg"
    # Millimetres would be lost in pixels: 80 mm wide, whatever is in it.
    assert float(root.get("width", "").removesuffix("pt")) == pytest.approx(
        80 / 25.4 * 72, rel=1e-3
    )
    return " | ".join("".join(text.itertext()) for text in root.iter(f"{space}text"))


@pytest.mark.usefixtures("matplotlib")
def test_an_svg_says_in_text_what_it_shows(compared: tuple[Trace, Trace, Any]) -> None:
    one, two, found = compared
    text = _texts(drawn(of_comparison(found), "svg"))
    since = min(row.since for row in found.agreements if row.since)
    assert_in(
        text,
        *(one.header.label, two.header.label, "hold", *one.header.joints, "gripperframe"),
        *("energy", "tolerance", "gripper on floor", "time [s]", "statemachine 0."),
        f"they part at {since:.3f} s",
    )


@pytest.fixture(scope="module")
def small_figure(compared: tuple[Trace, Trace, Any]) -> TracePlot:
    """Return the first row of charts of a comparison."""
    figure = of_comparison(compared[-1])
    return replace(figure, rows=figure.rows[:1])


@pytest.mark.usefixtures("matplotlib")
@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_the_file_of_a_figure_has_the_bytes_of_the_figure(
    form: str, small_figure: TracePlot, tmp_path: Path
) -> None:
    target = tmp_path / f"a.{form}"
    assert write_plot(small_figure, target) == target.stat().st_size
    assert target.read_bytes() == drawn(small_figure, form)


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_the_bytes_of_a_figure_depend_on_no_day_and_no_taste_of_the_reader(
    form: str, small_figure: TracePlot, matplotlib: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    once = drawn(small_figure, form)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    with matplotlib.rc_context({"font.size": 20, "axes.grid": True}):
        assert drawn(small_figure, form) == once
        assert matplotlib.rcParams["font.size"] == 20


@pytest.mark.usefixtures("matplotlib")
def test_a_png_is_a_picture_with_both_sides_in_it(
    compared: tuple[Trace, Trace, Any], pillow: Any
) -> None:
    import io

    image = pillow.open(io.BytesIO(drawn(of_comparison(compared[-1]), "png"))).convert("RGB")
    pixels = np.asarray(image).astype(int)
    assert pixels.shape[1] == pytest.approx(80 / 25.4 * 300, abs=1)
    for colour in ((240, 168, 48), (75, 31, 120)):
        assert (np.abs(pixels - colour).max(axis=2) < 12).sum() > 500


def test_a_figure_has_the_spans_in_which_each_side_touches(
    compared: tuple[Trace, Trace, Any],
) -> None:
    *traces, found = compared
    sides = of_comparison(found).touches["gripper on floor"]
    for spans, trace in zip(sides, traces, strict=True):
        rows, step = np.unique(trace["contact_row"]), trace.header.timestep
        assert spans[0][0] == pytest.approx(trace.time[rows[0]] - trace.time[0])
        touching = sum(end - start for start, end in spans)
        assert touching == pytest.approx(len(rows) * step, abs=1.01 * step)


@pytest.mark.parametrize("what", ["compared", "recorded", "alone"])
def test_nothing_is_cut_off_at_the_edges(
    compared: tuple[Trace, Trace, Any], matplotlib: Any, what: str
) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Text

    one, two, found = compared
    if what == "recorded":
        found = compare(edited(one, {"recorded": True, "defaults": "engine"}), two)
    with matplotlib.rc_context(FIGURE_SETTINGS):
        canvas = draw(of_trace(two) if what == "alone" else of_comparison(found))
        pen = FigureCanvasAgg(canvas)
        pen.draw()
        width, height = canvas.bbox.width, canvas.bbox.height
        for text in canvas.findobj(Text):
            if text.get_visible() and text.get_text().strip():
                box = text.get_window_extent(pen.get_renderer())
                assert -1 <= box.x0 <= box.x1 <= width + 1, text.get_text()
                assert -1 <= box.y0 <= box.y1 <= height + 1, text.get_text()


@pytest.mark.usefixtures("matplotlib")
def test_the_figure_of_one_trace_names_its_joints_and_its_command(
    compared: tuple[Trace, Trace, Any],
) -> None:
    text = _texts(drawn(of_trace(compared[1]), "svg"))
    assert_in(text, compared[1].header.label, *compared[1].header.joints, "the command", "energy")
