"""Comparisons: differences of known size are found with that size; engines by known figures."""

from __future__ import annotations

import dataclasses
import sys
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.cli.experiments import EXPERIMENTS
from statemachine.errors import BadInputError, MissingEngineError, TraceError, UnknownNameError
from statemachine.lab.compare import (
    Request,
    compare,
    run_sides,
    series,
    touches,
    witness,
)
from statemachine.lab.compare.series import normal_forces, total_forces
from statemachine.lab.recordings import Trace, record, write
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.measures import ENCODER_COUNT, QUANTITIES, parse_tolerances, tolerance_of

from .support.claims import assert_has, assert_in, refused
from .support.compared import page_of
from .support.files import written
from .support.motions import opened
from .support.processes import Cli, one_line
from .support.small_models import NAMELESS_JOINTS, STILL, model_of
from .support.traces import added, changed, traced
from .support.traces import named as by_name


@pytest.fixture(scope="module")
def hold() -> Trace:
    return traced("hold", seconds=1.0)


@pytest.fixture(scope="module")
def box() -> Trace:
    return traced("box", seconds=0.5)


# Differences that were made, of known size.


def test_a_shifted_joint_is_found_with_its_size_and_time(hold: Trace) -> None:
    # Beyond a count of 0.00153, and within.
    qpos = added(added(hold.qpos, np.s_[50:100, 2], 0.01), np.s_[100:, 2], -0.001)
    found = by_name(compare(hold, changed(hold, qpos=qpos)))
    assert_has(
        found.pop("elbow_flex"),
        max=pytest.approx(0.01, rel=1e-9),
        at=pytest.approx(0.25),
        since=pytest.approx(0.25),
        rms=pytest.approx(np.sqrt((50 * 0.01**2 + 101 * 0.001**2) / 201), rel=1e-9),
        settled=pytest.approx(0.001, rel=1e-9),
        verdict="settles",
        tolerance=ENCODER_COUNT,
    )
    assert all(each.verdict == "agrees" for each in found.values())


def test_a_difference_that_stays_differs(hold: Trace) -> None:
    found = compare(hold, changed(hold, qpos=added(hold.qpos, np.s_[50:, 2], 0.01)))
    assert_has(found, worst=by_name(found)["elbow_flex"], agrees=False)
    assert found.worst.verdict == "differs"


def test_a_turned_and_moved_box_by_as_much_as_it_was(box: Trace) -> None:
    qpos = added(box.qpos, np.s_[:, 6:9], [0.003, 0.0, 0.004])  # 5 mm
    w, x, y, z = qpos[:, 9:13].T.copy()
    c, s = np.cos(0.02), np.sin(0.02)  # 0.04 rad about its own z
    qpos[:, 9:13] = np.column_stack([c * w - s * z, c * x + s * y, c * y - s * x, c * z + s * w])
    found = by_name(compare(box, changed(box, qpos=qpos)))
    assert found["box, position"].max == pytest.approx(0.005, rel=1e-9)
    assert found["box, rotation"].max == pytest.approx(0.04, rel=1e-9)
    # A quaternion and its negative are one rotation.
    qpos = box.qpos.copy()
    qpos[:, 9:13] *= -1
    assert by_name(compare(box, changed(box, qpos=qpos)))["box, rotation"].max < 1e-15


def test_a_moved_and_turned_fingertip(hold: Trace) -> None:
    tip = hold.header.sites.index("gripperframe")
    position = added(hold["site_xpos"], (100, tip), [0.0, 0.002, 0.0])
    matrix = hold["site_xmat"].copy()
    turn = np.array([[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]])
    matrix[:, tip] = (turn @ matrix[:, tip].reshape(-1, 3, 3)).reshape(-1, 9)
    found = by_name(compare(hold, changed(hold, site_xpos=position, site_xmat=matrix)))
    assert_has(
        found["gripperframe, position"], max=pytest.approx(0.002, rel=1e-9), at=pytest.approx(0.5)
    )
    assert found["gripperframe, rotation"].rms == pytest.approx(0.1, rel=1e-9)
    # One count of an encoder, over the reach: the arm's is near 0.4 m.
    assert 0.3 < found["gripperframe, position"].tolerance / ENCODER_COUNT < 0.5


def test_a_tip_without_a_lever_arm_has_the_tolerance_of_a_slide() -> None:
    """A site in the origin of a cart is 0 from its foot: rounding must not count."""
    zero, slide = np.zeros(2), QUANTITIES["slide"].tolerance
    for lever, given, value in (
        (0.0, {}, slide),
        (0.4, {}, 0.4 * ENCODER_COUNT),
        (0.0, {"tip": 1.0}, 1.0),
    ):
        tolerance = tolerance_of("tip", zero, zero, lever, 0.01, given)
        assert tolerance.value == pytest.approx(value)


def test_one_blow_does_not_widen_what_a_force_may_differ(box: Trace) -> None:
    force = box["contact_force"].copy()
    force[box["contact_row"] == 40] *= 20.0
    name = "gripper on box, normal force"
    calm, struck = (
        by_name(compare(one, one))[name] for one in (box, changed(box, contact_force=force))
    )
    assert calm.tolerance == pytest.approx(0.05 * mean_force(box, name), rel=1e-9)
    assert struck.tolerance < 1.3 * calm.tolerance
    # Of a force, what is settled is how far apart the means are: ringing is none of it.
    ringing = box["contact_force"].copy()
    ringing[box["contact_row"] % 2 == 0] *= 1.2
    ringing[box["contact_row"] % 2 == 1] *= 0.8
    found = by_name(compare(box, changed(box, contact_force=ringing)))[name]
    assert found.max > 0.19 * mean_force(box, name)
    assert found.settled < 0.1 * found.rms
    assert found.verdict == "settles"


def mean_force(trace: Trace, name: str) -> float:
    """Mean over the rows of the sum of normal forces between two bodies that always touch."""
    header, total = trace.header, 0.0
    for pair, force in zip(trace["contact_geom"], trace["contact_force"], strict=True):
        bodies = {header.bodies[header.geom_bodyid[geom]] for geom in pair}
        if bodies == set(name.removesuffix(", normal force").split(" on ")):
            total += force[0]
    return float(total / len(trace))


def test_energy_against_what_the_run_turns_over(hold: Trace) -> None:
    size = 0.02 * np.ptp(hold["energy"].sum(axis=1))
    two = changed(hold, energy=added(hold["energy"], np.s_[60:, 1], size))
    found = by_name(compare(hold, two))["energy"]
    assert_has(found, max=pytest.approx(size, rel=1e-9), verdict="differs")


def test_a_touch_that_is_late_and_one_that_never_comes(hold: Trace) -> None:
    def later(rows: int) -> Trace:
        row = hold["contact_row"]
        keep = row >= int(row.min()) + rows
        names = ("row", "geom", "dist", "pos", "frame", "force")
        return changed(hold, None, **{f"contact_{n}": hold[f"contact_{n}"][keep] for n in names})

    name = "gripper on floor, first touch"
    assert by_name(compare(hold, later(1)))[name].verdict == "agrees"
    late, never = (by_name(compare(hold, later(rows)))[name] for rows in (3, 10_000))
    assert_has(late, max=pytest.approx(0.015), verdict="differs")
    assert_has(never, verdict="differs", note="never on mujoco (second)")
    assert by_name(compare(later(10_000), hold))[name].max == never.max
    assert name not in by_name(compare(later(10_000), later(10_000)))


def test_what_becomes_of_a_contact(box: Trace, hold: Trace) -> None:
    found = {touch.pair: touch for touch in touches(box, box)}
    grip = found["gripper on box"].left
    assert_has(grip, first=0.0, share=1.0, ends=True, last=pytest.approx(0.5))
    # Two jaws press the box against each other: the same force, and that of the servo.
    assert grip.force == pytest.approx(found["moving_jaw_so101_v1 on box"].left.force, rel=0.05)
    assert touches(hold, box)[0].right.first is None


def test_the_whole_force_of_a_contact_is_the_engines(box: Trace, mujoco_box: sm.Model) -> None:
    """Friction and all, added as vectors; on the box the two jaws and its weight balance."""
    row = len(box) - 1
    inputs = {name: getattr(box, name)[row] for name in ("qpos", "qvel", "ctrl")}
    with opened(mujoco_box, derived=True, **inputs) as (_, data):
        found: dict[tuple[int, ...], Any] = defaultdict(float)
        for geoms, frame, force in zip(
            data.contacts.geom, data.contacts.frame, data.contacts.force, strict=True
        ):
            bodies = [int(mujoco_box.geom_bodyid[geom]) for geom in geoms]
            sign = 1 if bodies[0] < bodies[1] else -1
            found[tuple(sorted(bodies))] += frame.reshape(3, 3).T @ force * sign
    given, normal = total_forces(box), normal_forces(box)
    assert len(found) == len(given) == 2
    for bodies, push in found.items():
        pair = " on ".join(box.header.bodies[body] for body in bodies)
        assert given[pair][row] == pytest.approx(np.linalg.norm(push), rel=0.02)
    one, two = given.values()
    # Both press alike, and together they carry the box: 96 g of friction.
    assert one.mean() == pytest.approx(two.mean(), rel=0.05)
    assert all(abs(given[pair] - normal[pair]).max() > 1e-3 for pair in given)
    assert touches(box, box)[0].left.total == pytest.approx(one[-len(box) // 10 :].mean(), rel=0.01)


@pytest.mark.usefixtures("bullet")
def test_how_the_engines_part_in_the_hold() -> None:
    one, two = run_sides("hold").traces
    found = by_name(compare(one, two))
    assert "gripper on floor, normal force" in found
    # The greatest that the course's page shows, and that of the vectors.
    assert normal_forces(one)["gripper on floor"].max() == pytest.approx(351, abs=1)
    assert total_forces(one)["gripper on floor"].max() == pytest.approx(383, abs=1)
    # It ends pressed on one engine, and free on the other.
    touch: Any = touches(one, two)[0]
    assert (touch.left.ends, touch.right.ends) == (True, False)
    assert touch.left.force > 10
    assert touch.right.last < 0.5
    # They part when the finger meets the floor.
    first = found["gripper on floor, first touch"]
    assert first.verdict == "agrees"
    joints = [each for each in found.values() if each.kind == "joint"]
    assert min(each.since for each in joints if each.since is not None) >= first.at
    # FINDINGS: 2.6 degrees in the transient, in contact.
    assert np.degrees(max(each.max for each in joints)) == pytest.approx(2.6, abs=0.1)
    curves = (curve for curve in series(one, two) if curve.kind == "joint")
    assert max(c.difference[c.time < first.at].max() for c in curves) < np.radians(1e-6)


def test_moments_that_both_have_are_compared_and_no_others() -> None:
    one = traced("waves", seconds=1.0)
    two = traced("waves", seconds=1.0, options={"timestep": 1 / 240})
    found = compare(one, two)
    assert found.moments == 41  # 1/200 and 1/240 meet each 25 ms
    assert any("timesteps differ" in note for note in found.notes)
    (time,) = {tuple(curve.time) for curve in series(one, two)}
    assert np.allclose(time, 0.025 * np.arange(41), atol=1e-9)
    refused(
        (
            TraceError,
            "moments in common",
            lambda: compare(
                one, traced("waves", seconds=1.0, options={"timestep": 0.005 * np.pi / 3})
            ),
        )
    )


def test_what_makes_it_less_than_a_comparison_of_engines_is_said(hold: Trace, box: Trace) -> None:
    assert_in(
        " ".join(compare(hold, box).notes),
        "different model files",
        "missing on one side: box",
        "experiments are two",
    )


def test_joints_without_names_are_each_compared(tmp_path: Path) -> None:
    trace = record(model_of(tmp_path, NAMELESS_JOINTS), None, 0.2)
    qpos = added(trace.qpos, np.s_[:, 1:4:2], [0.02, 0.003])
    found = by_name(compare(trace, changed(trace, qpos=qpos)))
    assert (found["joint 0"].max, found["joint 1"].max) == (0, pytest.approx(0.02))
    assert found["joint 2, position"].max == pytest.approx(0.003)


# Tolerances.


def test_tolerances_are_read_in_their_units(hold: Trace) -> None:
    words = ("joint=0.5deg", "tip=2mm", "energy=3mJ", "contact=10ms", "force=1N")
    given = parse_tolerances([*words, "tip-rotation=1rad"])
    assert given.pop("joint") == pytest.approx(np.radians(0.5))
    assert given == {"tip": 2e-3, "energy": 3e-3, "contact": 1e-2, "force": 1, "tip rotation": 1}
    given["joint"] = np.radians(0.5)
    qpos = added(hold.qpos, np.s_[50:, 2], np.radians(0.4))
    found = by_name(compare(hold, changed(hold, qpos=qpos), tolerances=given))["elbow_flex"]
    assert_has(found, verdict="agrees", reason="as given")


def test_what_cannot_be_compared_is_refused(hold: Trace, no_pybullet: None) -> None:
    names = tuple(f"other_{name}" for name in hold.header.joints)
    other = Trace(dataclasses.replace(hold.header, joints=names), hold.columns)
    request = Request(("hold",), seconds=1.0)  # which was not recorded
    numbers = ("", "=", "=x", "=-1", "=nandeg", "=1mm", "=5", "=-1deg")
    words = [*(f"joint{number}" for number in numbers), "tip=1deg"]
    refused(
        *((BadInputError, "", partial(parse_tolerances, [word])) for word in words),
        (TraceError, "no joint in common", lambda: compare(hold, other)),
        (UnknownNameError, "kind of quantity", lambda: parse_tolerances(["elbow=1"])),
        (MissingEngineError, "pybullet is not installed", lambda: run_sides(request)),
    )


# The engines, by what is known of them.


@pytest.mark.usefixtures("bullet")
def test_free_of_contact_the_engines_agree() -> None:
    for name in ("droop", "fall", "waves"):
        run = run_sides(name)
        found = compare(*run.traces)
        assert found.agrees, name
        assert all("links of one robot can touch" in line for line in run.said)
        joints = [each.max for each in found.agreements if each.kind == "joint"]
        assert len(joints) == 6
        assert max(joints) < np.radians(1e-6)


@pytest.mark.usefixtures("bullet")
def test_the_engine_as_its_users_meet_it_is_far_off() -> None:
    found = compare(*run_sides(Request(("hold",), ("mujoco:engine", "pybullet:engine"))).traces)
    # FINDINGS: POSITION_CONTROL is 13 to 41 degrees off in the transient, at 5 ms.
    assert np.degrees(by_name(found)["elbow_flex"].max) > 13
    assert_in(" ".join(found.notes), "gravity differs: 0 0 -9.81 and 0 0 0", "timesteps differ")


@pytest.mark.usefixtures("bullet")
def test_one_trace_is_played_on_the_other_engine(tmp_path: Any) -> None:
    path = write(traced("waves", seed=2), tmp_path / "waves.npz")
    run = run_sides(Request((str(path),)))
    one, two = run.traces
    assert (one.header.backend, two.header.backend) == ("mujoco", "pybullet")
    assert compare(one, two).agrees
    assert "was played on pybullet" in run.said[0]


@pytest.mark.usefixtures("pinocchio")
def test_a_third_party_is_asked_about_both(hold: Trace, box: Trace, tmp_path: Path) -> None:
    for trace in (hold, box):  # its scene includes the arm, which is what Pinocchio can read
        tip = trace.header.sites.index("gripperframe")
        position = added(trace["site_xpos"], (30, tip, 0), 0.001)
        found = witness(trace, changed(trace, site_xpos=position))
        assert found.left < 1e-12
        assert_has(found, right=pytest.approx(0.001, rel=1e-9), rows=2 * len(trace))
    binary = tmp_path / "hold.mjb"  # which Pinocchio does not read, and nobody as XML
    binary.write_bytes(b"\x00binary")
    assert witness(hold, hold, binary) is None
    nowhere = dataclasses.replace(hold.header.provenance, model_file="no/such.xml")
    unknown = dataclasses.replace(hold.header, provenance=nowhere)
    assert witness(Trace(unknown, hold.columns), hold) is None


# Where an engine is missing.


@pytest.fixture
def no_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)


@pytest.mark.parametrize("defaults", ["model", "engine"])
@pytest.mark.parametrize("name", list(SCENARIOS))
def test_without_pybullet_its_recorded_run_takes_its_place(
    no_pybullet: None, name: str, defaults: Any
) -> None:
    way = ":engine" if defaults == "engine" else ""
    run = run_sides(Request((name,), (f"mujoco{way}", f"pybullet{way}")))
    assert [bool(trace.header.recorded) for trace in run.traces] == [False, True]
    assert "recorded run that comes with the package" in run.said[0]
    found = compare(*run.traces)
    assert any("single precision" in note for note in found.notes)
    assert ", recorded" in found.right.label
    if defaults == "model":
        assert found.agrees == (name in ("droop", "fall", "waves"))
    assert page_of(found, run=run).blocks


# The command.


def test_the_help_knows_the_experiments() -> None:
    assert tuple(SCENARIOS) == tuple(EXPERIMENTS)


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_command(here: Cli) -> None:
    assert max(map(len, here("compare", "hold", code=1).stdout.splitlines())) <= 80
    assert '"agrees": true' in here("compare", "droop", "--json", code=0).stdout


# What does not move at all, and names that a plot could take for formulas.


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("form", [pytest.param("html", marks=pytest.mark.slow), "plot"])
def test_a_robot_that_stands_still_was_not_compared(form: str, here: Cli, tmp_path: Path) -> None:
    file = written(tmp_path / "still.xml", STILL)
    out = tmp_path / ("a.html" if form == "html" else "a.svg")
    done = here("compare", "fall", file, f"--{form}", out, code=1)
    assert "Traceback" not in done.stderr
    # As it is spelt in the file, or as a page escapes it.
    assert "a$b$c" in out.read_text()


def test_poses_that_are_no_numbers_cost_the_picture_and_no_more(
    hold: Trace, here: Cli, tmp_path: Path
) -> None:
    xpos = added(hold["xpos"], np.s_[len(hold) // 2 :], np.nan)
    write(hold, tmp_path / "whole.npz")
    write(changed(hold, xpos=xpos), tmp_path / "nan.npz")
    for pair in (("nan.npz", "whole.npz"), ("whole.npz", "nan.npz")):
        assert "Traceback" not in here("compare", *pair, "--html", "a.html").stderr
        assert (tmp_path / "a.html").stat().st_size > 100_000
    done = here("trace", "film", "nan.npz", "-o", "a.webp")
    one_line(done, "no poses of the bodies that are numbers", done.returncode)


# Mistakes that were met.


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc")
def test_a_place_that_refuses_is_named_and_no_other(cli: Cli) -> None:
    done = cli("trace", "record", "droop", "--seconds", "0.1", "-o", "/proc/droop.npz")
    assert done.returncode != 0
    assert ".part-" not in done.stderr
    assert "/proc/droop.npz" in done.stderr
