"""The picture of two runs as data for the script of a page: figures, without a browser."""

from __future__ import annotations

import base64
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, TraceError
from statemachine.lab.compare import Comparison, compare
from statemachine.lab.questions.film import Timing, check_film, motion_of, timing_of
from statemachine.lab.questions.film_overlay import STRIP, Overlay
from statemachine.lab.questions.stage.bones import bones_of
from statemachine.lab.questions.stage.both_runs import BothRuns
from statemachine.lab.questions.stage.poses import (
    last_finite,
    orientations_between,
    positions_between,
    rows_at,
    unit_quat,
)
from statemachine.lab.questions.stage.quantity_chart import charts_of, spans
from statemachine.lab.questions.stage.scene import Scene, moments_of, scene_of
from statemachine.lab.recordings import RunMetadata, Trace, record
from statemachine.measures.text import figure
from statemachine.rotations import matrix_from_quat
from statemachine.show.drawing import Drawing, Part, drawing_of, lathe
from statemachine.show.drawing.scene import FOVY, Motion, camera_for, framed
from statemachine.show.drawing.shapes import box
from statemachine.show.html.geometry import mesh_as_data, mesh_of, quantised

from .support.small_models import loaded
from .support.traces import changed

BALL = """
<geom type='plane' size='0 0 1'/>
<body name='ball' pos='0 0 {height}'><freejoint/>
  <geom type='sphere' size='0.1' mass='0.5'/>
  <body name='arm' pos='0.2 0 0'>
    <joint name='turn' axis='0 1 0'/><geom type='capsule' size='0.02 0.1' mass='0.1'/>
    <site name='tip' pos='0 0 0.1'/>
  </body>
</body>
"""
STEPS = 60
ROWS: Any = np.arange(STEPS + 1) * 0.005  # [s]


def falling(folder: Path, height: float, timestep: float = 0.005) -> tuple[sm.Model, Trace]:
    """Return a body that falls on a floor, and its run of 0.3 s."""
    option = f"<option timestep='{timestep}'/>"
    model = loaded(folder, BALL.format(height=height), option=option, name=f"h{height}.xml")
    run = record(model, seconds=STEPS * 0.005, metadata=RunMetadata(experiment="fall"))
    return model, run


@pytest.fixture(scope="module")
def sides(tmp_path_factory: pytest.TempPathFactory) -> tuple[sm.Model, Trace, Trace]:
    """Return the model of the left side, and two runs from two heights."""
    folder = tmp_path_factory.mktemp("stage")
    model, left = falling(folder, 0.15)
    return model, left, falling(folder, 0.3)[1]


def runs_of(left: Trace, right: Trace, comparison: Comparison | None = None) -> BothRuns:
    """Return the block of a page for two runs."""
    compared = compare(left, right) if comparison is None else comparison
    return BothRuns("", compared, 0.0, (), charts_of(compared), ())


def numbers(text: str, kind: str, *shape: int) -> np.ndarray:
    """Return the numbers that are packed for the script."""
    return np.frombuffer(base64.b64decode(text), f"<{kind}").reshape(shape).astype(float)


# Rows and what is between them


@pytest.fixture
def uneven(sides: tuple[sm.Model, Trace, Trace]) -> Trace:
    """Return a trace of three rows, at 7.0, 7.1 and 7.3 s."""
    _, left, _ = sides
    columns = {
        name: array[:3] for name, array in left.columns.items() if not name.startswith("contact_")
    }
    return Trace(left.header, {**columns, "time": np.array([7.0, 7.1, 7.3])})


def test_a_moment_lies_behind_a_row_by_a_share_of_the_way_to_the_next(uneven: Trace) -> None:
    row, share = rows_at(uneven, np.array([0.0, 0.05, 0.1, 0.15, 0.3, 0.4]))
    assert row.tolist() == [0, 0, 1, 1, 2, 2]
    assert share == pytest.approx([0.0, 0.5, 0.0, 0.25, 0.0, 0.0], abs=1e-9)


def test_a_moment_that_rounding_puts_before_a_row_is_of_that_row(uneven: Trace) -> None:
    row, share = rows_at(uneven, np.array([0.1 - 1e-10, 0.1 + 1e-9]))
    assert row.tolist() == [1, 1]
    assert share.tolist() == [0.0, 0.0]


def test_a_position_between_two_rows_is_on_the_straight_way() -> None:
    values = np.array([[[0.0, 0.0], [1.0, 1.0]], [[1.0, 2.0], [3.0, 5.0]]])
    between = positions_between(values, np.array([0, 0, 1]), np.array([0.0, 0.25, 0.0]))
    assert between.tolist() == [values[0].tolist(), [[0.25, 0.5], [1.5, 2.0]], values[1].tolist()]


def test_a_row_itself_is_taken_where_the_next_is_not_a_number() -> None:
    values = np.array([[1.0], [np.nan]])
    assert positions_between(values, np.array([0]), np.array([0.0])).tolist() == [[1.0]]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_orientation_between_two_rows_is_on_the_shorter_way(sign: float) -> None:
    quarter = [math.cos(0.4), math.sin(0.4), 0.0, 0.0]
    quat = np.array([[[1.0, 0.0, 0.0, 0.0]], [quarter]]) * np.array([1.0, sign])[:, None, None]
    [[half]] = orientations_between(quat, np.array([0]), np.array([0.5]))
    assert half == pytest.approx([math.cos(0.2), math.sin(0.2), 0.0, 0.0], abs=1e-12)


def test_what_is_no_rotation_is_none() -> None:
    quat = np.array([[0.0, 0.0, 3.0, 4.0], [0.0] * 4, [np.nan] * 4])
    assert unit_quat(quat).tolist() == [[0, 0, 0.6, 0.8], [1, 0, 0, 0], [1, 0, 0, 0]]


def test_a_position_that_is_no_number_is_the_last_that_was() -> None:
    bad = np.nan
    pos = np.array([[[1.0], [bad]], [[bad], [2.0]], [[3.0], [bad]], [[np.inf], [4.0]]])
    assert last_finite(pos)[..., 0].tolist() == [[1, 0], [1, 2], [3, 2], [3, 4]]


# The moments that are shown


def test_all_moments_of_a_short_run_are_shown(sides: tuple[sm.Model, Trace, Trace]) -> None:
    _, left, right = sides
    times, hidden = moments_of(left, right)
    assert times == pytest.approx(ROWS)
    assert hidden == 0


def test_of_a_long_run_the_moments_that_have_to_be_there_stay(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    _, left, _ = sides
    rows = np.arange(5000)
    columns = {
        name: array[np.minimum(rows, STEPS)]
        for name, array in left.columns.items()
        if not name.startswith("contact_")
    }
    long = Trace(left.header, {**columns, "time": rows * 0.005})
    times, hidden = moments_of(long, long, must=(12.345, 3.0))
    assert len(times) <= 1203
    assert len(times) + hidden == 5000
    for moment in (0.0, 3.0, 12.345, 24.995):
        assert np.abs(times - moment).min() < 1e-9
    assert np.diff(times).max() == pytest.approx(5 * 0.005)  # every fifth of 5000


def test_too_few_common_moments_are_not_shown_alone(
    tmp_path: Path, sides: tuple[sm.Model, Trace, Trace]
) -> None:
    _, left, _ = sides
    _, other = falling(tmp_path, 0.3, timestep=1 / 240)
    times, _ = moments_of(left, other)
    assert np.diff(times).max() <= 1 / 60


# The scene


@pytest.fixture(scope="module")
def scene(sides: tuple[sm.Model, Trace, Trace]) -> Scene:
    model, left, right = sides
    look = drawing_of(model)
    times, _ = moments_of(left, right)
    return scene_of(runs_of(left, right), (look, look), times)


def test_the_script_has_the_poses_of_each_row(
    scene: Scene, sides: tuple[sm.Model, Trace, Trace]
) -> None:
    low, span = np.array(scene.data["low"]), np.array(scene.data["span"])
    for side, trace in zip(scene.data["sides"], sides[1:], strict=True):
        assert side["bodies"] == 3
        pos = low + span * numbers(side["pos"], "u2", STEPS + 1, 3, 3) / 65535
        assert np.abs(pos - trace["xpos"]).max() < 1e-5
        quat = numbers(side["quat"], "i2", STEPS + 1, 3, 4) / 32767
        assert np.abs(quat - trace["xquat"]).max() < 1e-4


def test_the_script_has_the_contacts_of_each_row(
    scene: Scene, sides: tuple[sm.Model, Trace, Trace]
) -> None:
    _, left, _ = sides
    side = scene.data["sides"][0]["contacts"]
    counts = np.bincount(left["contact_row"], minlength=STEPS + 1)
    assert counts.any()
    assert numbers(side["count"], "u1", STEPS + 1).tolist() == counts.tolist()
    told = numbers(side["at"], "f4", -1, 6)
    frames = left["contact_frame"].reshape(-1, 3, 3)
    forces = np.einsum("nij,ni->nj", frames, left["contact_force"])
    strength = np.linalg.norm(forces, axis=1)
    order = np.lexsort((-strength, left["contact_row"]))  # the strongest of a row first
    assert told[:, :3] == pytest.approx(left["contact_pos"][order], abs=1e-6)
    assert np.abs(told[:, 3:]) == pytest.approx(np.abs(forces[order]), rel=1e-5, abs=1e-5)
    assert scene.strongest >= strength.max() * (1 - 1e-6)


def test_a_body_that_moves_on_either_side_is_marked(
    scene: Scene, sides: tuple[sm.Model, Trace, Trace]
) -> None:
    assert scene.data["moving"] == [0, 1, 1]  # the world stands still
    model, left, _ = sides
    still = changed(left, xpos=np.repeat(left["xpos"][:1], STEPS + 1, axis=0))
    still = changed(still, xquat=np.repeat(left["xquat"][:1], STEPS + 1, axis=0))
    look = drawing_of(model)
    alone = scene_of(runs_of(still, still), (look, look), ROWS[:3])
    assert alone.data["moving"] == [0, 0, 0]


def test_one_look_is_one_mesh_and_two_are_two(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, right = sides
    times, runs = ROWS[:3], runs_of(left, right)
    look, other = drawing_of(model), drawing_of(model)
    same = scene_of(runs, (look, look), times)
    assert [side["mesh"] for side in same.data["sides"]] == [0, 0]
    assert len(same.data["meshes"]) == 1
    two = scene_of(runs, (look, other), times)
    assert [side["mesh"] for side in two.data["sides"]] == [0, 1]
    assert len(two.data["meshes"]) == 2


def test_the_floor_is_where_the_plane_is(scene: Scene) -> None:
    assert scene.data["floor"] == 0.0


def test_without_poses_there_is_nothing_to_draw(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, right = sides
    look = drawing_of(model)
    bare = Trace(left.header, {n: a for n, a in left.columns.items() if n != "xquat"})
    empty = scene_of(runs_of(left, right, compare(bare, right)), (look, look), np.zeros(1))
    assert empty.data is None
    assert len(empty.notes) == 1


def test_a_body_that_flies_away_is_drawn_at_the_edge_of_the_box(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    model, left, right = sides
    look = drawing_of(model)
    far = left["xpos"].copy()
    far[-1, 1] = 1e6
    times, _ = moments_of(left, right)
    data = scene_of(runs_of(changed(left, xpos=far), right), (look, look), times).data
    edge = np.array(data["low"]) + data["span"]
    assert edge == pytest.approx(np.array(look.center) + 8 * look.extent)
    pos = numbers(data["sides"][0]["pos"], "u2", len(times), 3, 3)
    assert pos[-1, 1].tolist() == [65535] * 3


# A stick figure


def test_a_bone_reaches_from_a_body_to_the_next(sides: tuple[sm.Model, Trace, Trace]) -> None:
    _, left, _ = sides
    drawing = bones_of(left)
    assert [part.body for part in drawing.parts] == [1, 2]  # a bone of the ball, and a knob
    bone, knob = drawing.parts
    assert bone.vertices[:, 0].max() == pytest.approx(0.2)
    assert bone.vertices[:, 0].min() == pytest.approx(0.0)
    assert knob.vertices[:, 2].max() == pytest.approx(0.12 * 0.2)
    x, y, z = left["xpos"][0, 1:].mean(axis=0)
    assert drawing.center == pytest.approx((x, y, z))
    assert drawing.extent == pytest.approx(np.ptp(left["xpos"][0], axis=0).max())


# A volume


def volume(shape: Any) -> float:
    """Return the volume in a closed surface, by the divergence theorem; negative inside out."""
    a, b, c = (shape.vertices[shape.faces[:, k]].astype(float) for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


# The camera


def test_what_is_framed_takes_nine_tenths_of_the_picture() -> None:
    cloud = np.random.default_rng(4).normal(size=(50, 3)) * (0.3, 0.1, 0.5) + (5, -3, 2)
    for aspect in (0.5, 2.0):
        camera = framed(cloud, aspect, 30.0, -20.0)
        right, up, forward = camera.axes
        offset = cloud - camera.eye
        across, high = offset @ right / (offset @ forward), offset @ up / (offset @ forward)
        half = math.tan(math.radians(FOVY) / 2)
        taken = max(np.abs(across).max() / (half * aspect), np.abs(high).max() / half)
        assert taken == pytest.approx(0.9, abs=0.01)


def test_a_camera_sees_where_the_bodies_go(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, right = sides
    look = drawing_of(model)
    motions = [Motion(look, trace["xpos"], trace["xquat"]) for trace in (left, right)]
    corners = np.concatenate([motion.corners() for motion in motions])
    # Of boxes about the parts of the two bodies, in their frames, at up to 60 rows.
    assert corners[:, 2].max() == pytest.approx(0.3 + 0.12, abs=0.01)
    camera = camera_for(motions, 1.5)
    right_axis, up, forward = camera.axes
    offset = corners - camera.eye
    half = math.tan(math.radians(FOVY) / 2)
    assert (np.abs(offset @ up) < half * (offset @ forward)).all()
    assert (np.abs(offset @ right_axis) < 1.5 * half * (offset @ forward)).all()


def test_the_corners_of_a_turned_part_are_turned() -> None:
    shape = box((1.0, 2.0, 3.0))
    part = Part("box", 0, 1, shape.vertices, shape.faces, (1, 1, 1, 1))
    drawing = Drawing((part,), (0, 0, 0), 1.0, 0.0, 0.0)
    turn = np.array([math.sqrt(0.5), 0, 0, math.sqrt(0.5)])  # a quarter about z
    motion = Motion(drawing, np.full((1, 2, 3), 10.0), np.array([[turn, turn]]))
    expected = 10 + np.array([1.0, 2.0, 3.0])[[1, 0, 2]]
    assert motion.corners().max(axis=0) == pytest.approx(expected)
    assert matrix_from_quat(turn) @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-12)


# Meshes for the page


def wheel(around: int) -> Drawing:
    """Return a drawing of a ball of many triangles, a small one, and a plane without an end."""
    ball = lathe(np.sin(np.linspace(0, np.pi, 60)), -np.cos(np.linspace(0, np.pi, 60)), around)
    small = box((0.1, 0.1, 0.1))
    parts = (
        Part("sphere", 0, 1, ball.vertices, ball.faces, (1.0, 0.5, 0.25, 1.0)),
        Part("box", 1, 2, small.vertices, small.faces, (0.1, 0.2, 0.3, 1.0)),
        Part("plane", 2, 0, small.vertices, small.faces, (0, 0, 0, 1), endless=True),
    )
    return Drawing(parts, (0, 0, 0), 2.0, 0.0, 0.0)


def test_the_parts_of_a_mesh_follow_each_other() -> None:
    drawing = wheel(40)
    ball, cube, _ = drawing.parts
    mesh = mesh_of(drawing)
    assert [(part.body, part.first, part.count) for part in mesh.parts] == [
        (1, 0, ball.faces.size),
        (2, ball.faces.size, cube.faces.size),
    ]
    assert [part.rgb for part in mesh.parts] == [(1.0, 0.5, 0.25), (0.1, 0.2, 0.3)]
    second = mesh.vertices[mesh.faces[len(ball.faces) :]]
    assert second.tolist() == cube.vertices[cube.faces].tolist()
    assert mesh.simplified == 0


def test_too_many_triangles_become_fewer_and_the_shape_stays() -> None:
    drawing = wheel(150)
    before = sum(len(part.faces) for part in drawing.parts[:2])
    mesh = mesh_of(drawing, 2000)
    assert mesh.simplified == before
    assert 500 < len(mesh.faces) <= 2000
    first = mesh.faces[: mesh.parts[0].count // 3]
    ball = type("Ball", (), {"vertices": mesh.vertices, "faces": first})
    assert volume(ball) == pytest.approx(4 / 3 * math.pi, rel=0.05)


def test_as_many_triangles_as_may_be_stay_as_they_are() -> None:
    drawing = wheel(40)
    count = sum(len(part.faces) for part in drawing.parts[:2])
    assert mesh_of(drawing, count).simplified == 0
    assert mesh_of(drawing, count - 1).simplified == count


def test_a_mesh_is_packed_within_its_box() -> None:
    mesh = mesh_of(wheel(40))
    data = mesh_as_data(mesh)
    assert data["wide"] is False
    points = numbers(data["position"], "u2", -1, 3)
    low, span = np.array(data["low"]), np.array(data["span"])
    assert low + span * points / 65535 == pytest.approx(mesh.vertices, abs=1e-4)
    assert numbers(data["index"], "u2", -1).tolist() == mesh.faces.reshape(-1).tolist()
    assert data["parts"][1][:3] == (2, mesh.parts[1].first, mesh.parts[1].count)


def test_values_are_whole_numbers_of_their_box() -> None:
    assert quantised([-5.0, 1.0, 2.0, 3.0, 9.0], 1.0, 2.0).tolist() == [0, 0, 32768, 65535, 65535]


# Charts and films


def test_marked_rows_count_until_the_next() -> None:
    time = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    mask = np.array([True, False, True, True, False, True])
    assert np.array(spans(mask, time, 0.1, 0.5)) == pytest.approx(
        np.array([[0.0, 0.1], [0.2, 0.4], [0.5, 0.5]])
    )


def test_a_film_shows_the_time_that_both_traces_have(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    _, left, right = sides
    later = changed(right, time=right.time * 2 + 5.0)
    assert timing_of([left, later]).seconds == pytest.approx(STEPS * 0.005)
    assert timing_of([later]).seconds == pytest.approx(2 * STEPS * 0.005)


@pytest.mark.parametrize(("seconds", "is_refused"), [(5000 / 30, False), (5001 / 30, True)])
def test_a_film_has_at_most_5000_pictures(
    sides: tuple[sm.Model, Trace, Trace], seconds: float, is_refused: bool
) -> None:
    _, left, _ = sides
    long = changed(left, time=np.linspace(0.0, seconds, STEPS + 1))
    if is_refused:
        with pytest.raises(BadInputError):
            timing_of([long])
    else:
        assert timing_of([long]).count == 5000


def test_the_pictures_of_a_film_take_the_simulated_time_together() -> None:
    for seconds, fps, count in ((2.0, 30, 60), (0.37, 25, 10), (1.0, 7, 7), (0.001, 30, 1)):
        timing = Timing(seconds, fps)
        assert timing.count == len(timing.milliseconds) == count
        assert sum(timing.milliseconds) == round(1000 * seconds)
        assert timing.times == pytest.approx(np.arange(count) / fps)


def test_only_webp_is_a_film(tmp_path: Path) -> None:
    for name in ("a.gif", "a.mp4", "a"):
        with pytest.raises(BadInputError):
            check_film(tmp_path / name)


def test_the_poses_of_a_film_are_those_of_the_nearest_rows(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    model, left, _ = sides
    later = changed(left, time=left.time + 9.0)
    motion = motion_of(later, model, np.array([0.0, 0.012, 0.013, 1.0]))
    assert motion.xpos.tolist() == left["xpos"][[0, 2, 3, STEPS]].tolist()


def test_poses_that_are_no_numbers_are_not_drawn(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, _ = sides
    for name in ("xpos", "xquat"):
        bad = left[name].copy()
        bad[4, 1, 0] = np.nan
        broken = Trace(left.header, {**left.columns, name: bad})
        assert len(motion_of(broken, model, np.array([0.0])).xpos) == 1
        with pytest.raises(TraceError):
            motion_of(broken, model, np.array([0.0, 0.02]))


# The way of a site


def test_the_points_of_a_way_are_as_far_apart_on_it_as_each_other(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    model, left, right = sides
    look = drawing_of(model)
    times = ROWS[::3]
    runs = runs_of(left, right)
    assert runs.comparison.tip == "tip"
    for side, trace in zip(
        scene_of(runs, (look, look), times).data["sides"], (left, right), strict=True
    ):
        site = trace["site_xpos"][:, 0]
        way = numbers(side["way"], "f4", -1, 3)
        assert way[[0, -1]] == pytest.approx(site[[0, -1]], abs=1e-6)
        along = np.linalg.norm(np.diff(way, axis=0), axis=1)
        assert along.max() <= 0.0016
        assert along.mean() == pytest.approx(0.0015, abs=1e-4)
        behind = numbers(side["behind"], "u2", -1).astype(int)
        assert behind[0] == 0
        assert behind[-1] == len(way) - 1
        # At a moment that is shown, the last point behind is within a dash of the site.
        gaps = np.linalg.norm(way[behind] - site[::3], axis=1)
        assert gaps.max() <= 0.0016
        tip = numbers(side["tip"], "f4", -1, 3)
        assert tip == pytest.approx(site[::3], abs=1e-6)


def test_a_way_ends_with_what_is_shown(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, right = sides
    look = drawing_of(model)
    scene = scene_of(runs_of(left, right), (look, look), np.array([0.0, 0.05, 0.1]))
    for side, trace in zip(scene.data["sides"], (left, right), strict=True):
        way = numbers(side["way"], "f4", -1, 3)
        assert way[-1] == pytest.approx(trace["site_xpos"][20, 0], abs=1e-6)


def test_without_the_site_there_is_no_way(sides: tuple[sm.Model, Trace, Trace]) -> None:
    model, left, right = sides
    look = drawing_of(model)
    bare = Trace(left.header, {n: a for n, a in left.columns.items() if n != "site_xpos"})
    runs = runs_of(bare, right, compare(bare, right))
    one, two = scene_of(runs, (look, look), np.array([0.0, 0.1])).data["sides"]
    assert one["way"] == one["behind"] == one["tip"] == two["tip"] == ""


# What stands under a chart


def test_a_chart_shows_a_position_as_the_way_from_its_start(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    _, left, right = sides
    [chart] = [chart for chart in charts_of(compare(left, right)) if chart.curve.kind == "tip"]
    values = chart.values()
    scale = {"mm": 1000.0, "m": 1.0, "cm": 100.0}[chart.unit]
    for trace, (time, curve) in zip((left, right), values.curves.values(), strict=True):
        site = trace["site_xpos"][:, 0]
        start = left["site_xpos"][0, 0]
        assert time == pytest.approx(trace.time)
        assert curve == pytest.approx(scale * np.linalg.norm(site - start, axis=1), abs=1e-9)
    assert values.least == pytest.approx(20 * scale * chart.agreement.tolerance)
    [(_, gap)] = chart.gap().curves.values()
    apart = np.linalg.norm(left["site_xpos"][:, 0] - right["site_xpos"][:, 0], axis=1)
    assert gap == pytest.approx(scale * apart, abs=1e-9)


def test_only_charts_of_energies_and_of_forces_have_a_foot(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    charts = charts_of(compare(*sides[1:]))
    kinds = {chart.curve.kind for chart in charts if chart.foot}
    assert kinds <= {"energy", "force"}
    assert "force" in kinds
    for chart in charts:
        assert bool(chart.foot) is (chart.curve.kind in {"energy", "force"})


def test_the_foot_of_a_force_has_the_largest_of_each_side(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    _, left, right = sides
    charts = [chart for chart in charts_of(compare(left, right)) if chart.curve.kind == "force"]
    assert len(charts) == 2
    for chart in charts:
        geom = 1 if "ball" in chart.curve.name else 2
        for trace in (left, right):
            touching = trace["contact_geom"].max(axis=1) == geom
            force = np.where(touching, trace["contact_force"][:, 0], 0.0)
            normal = np.bincount(trace["contact_row"], weights=force)
            assert figure(float(normal.max())) in chart.foot


# The strip under a film

STRIP_SIZE = (400, 300)


@pytest.fixture
def strips(sides: tuple[sm.Model, Trace, Trace]) -> list[np.ndarray]:
    """Return the pictures of a film of grey at its start, in its middle and at its end."""
    pytest.importorskip("PIL")
    pytest.importorskip("matplotlib")
    _, left, right = sides
    chart = charts_of(compare(left, right))[0]
    until = float(chart.curve.time[-1])
    overlay = Overlay(STRIP_SIZE, np.array([0.0, until / 2, until]), "x", ["a", "b"], chart)
    width, height = overlay.inner
    grey = np.full((height, width, 3), 77, np.uint8)
    return [np.asarray(overlay.paint(grey, k)).astype(int) for k in range(3)]


def test_the_pictures_of_a_film_stand_between_its_title_and_its_strip(
    strips: list[np.ndarray],
) -> None:
    rows = np.flatnonzero((strips[0] == 77).all(axis=(1, 2)))
    assert strips[0].shape == (300, 400, 3)
    assert rows.tolist() == list(range(32, 300 - round(STRIP * 300)))  # 3.2 times a text of 10


def test_the_cursor_goes_from_the_start_of_the_strip_to_its_end(strips: list[np.ndarray]) -> None:
    top, low = 300 - round(STRIP * 300), round(STRIP * 300)
    # Of the strip's height the axes have a half, above a quarter.
    rows = slice(round(top + 0.25 * low) + 1, round(top + 0.75 * low) - 1)
    columns = [
        int(np.argmax((strip[rows].max(axis=2) < 90).sum(axis=0)[50:])) + 50 for strip in strips
    ]
    assert columns[1:] == pytest.approx([0.11 * 400 + 0.43 * 400, 0.97 * 400], abs=2)


def test_what_is_to_come_is_paler_than_what_was(strips: list[np.ndarray]) -> None:
    beyond = slice(300, 380)  # behind the cursor of the middle
    low = slice(300 - round(0.2 * STRIP * 300), 300)  # of the strip: the names of its axis
    middle, end = (strip[low, beyond] for strip in strips[1:])
    assert (middle >= end).all()
    dark = end < 200
    assert dark.any()
    assert 255 - middle[dark] == pytest.approx(0.4 * (255 - end[dark]), abs=2)


def test_the_site_is_looked_at_from_25_times_its_gap_where_the_page_opens(
    sides: tuple[sm.Model, Trace, Trace],
) -> None:
    model, left, _ = sides
    look = drawing_of(model)

    def distances(gap: float) -> tuple[float, float]:
        apart = np.zeros_like(left["site_xpos"])
        apart[2:, 0, 2] = gap
        right = changed(left, site_xpos=left["site_xpos"] + apart)
        data = scene_of(runs_of(left, right), [look, look], left.time[:4], start=2).data
        assert data is not None
        return data["near"], data["extent"]

    _, extent = distances(0.0)
    assert distances(0.02 * extent) == pytest.approx((0.5 * extent, extent))
