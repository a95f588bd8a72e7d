"""The lessons through their functions: what the pages and the JSON are made of."""

from __future__ import annotations

import hashlib
import random
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.course.lessons import _loop_cost
from statemachine.course.lessons._falling import Forces, milestones
from statemachine.errors import BadInputError, ModelError
from statemachine.lab.runs import drive, interleaved_timing
from statemachine.lab.runs.provenance import provenance
from statemachine.lab.validate import fingertip
from statemachine.lab.validate.certificate import page
from statemachine.lab.validate.fingertip import random_qpos
from statemachine.models import models_dir
from statemachine.show.blocks import Verdict

from .support.claims import assert_has, overlapping, refused
from .support.files import written
from .support.motions import opened, started
from .support.pages import blocks, lesson_result
from .support.patches import around
from .support.small_models import BALL_AND_SLIDE, loaded, model_of


def test_provenance_covers_included_files(tmp_path: Path) -> None:
    files = (models_dir() / "so101" / f"{name}.xml" for name in ("scene_box", "scene", "so101"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    found = provenance(sm.load("so101/scene_box"))
    assert_has(found, model_sha256=digest, model_file="so101/scene_box.xml")


@pytest.mark.parametrize(
    ("seconds", "rows"),
    [
        (4.0, [0, 1, 2, 3, 4]),
        (0.5, [0, 0.5]),
        (60, [0, 1, 2, 3, 4, 10, 20, 30, 50, 60]),
    ],
)
def test_a_fall_is_shown_each_second_and_later_at_round_times(
    seconds: float, rows: list[float]
) -> None:
    assert milestones(seconds) == rows


def test_forces_sum_with_the_bias_on_the_other_side() -> None:
    forces = Forces(
        bias=1.0, actuator=2.0, passive=3.0, friction=4.0, contact=5.0, limit=6.0, equality=7.0
    )
    assert forces.total == 2 + 3 + 4 + 5 + 6 + 7 - 1
    assert replace(forces, actuator=None).total is None


def test_gravity_is_read_at_the_moment_of_the_end(mujoco_scene: sm.Model) -> None:
    found = lesson_result("gravity", mujoco_scene, seconds=1.0)
    with opened(mujoco_scene, nstep=200, derived=True) as (_, data):
        assert found.servos_on.forces.actuator == data.qfrc_actuator[1]
        assert found.servos_on.qpos.tolist() == data.qpos.tolist()


def test_the_first_touch_of_the_falling_arm_is_the_first_step_with_a_contact(
    mujoco_scene: sm.Model,
) -> None:
    found = lesson_result("gravity", mujoco_scene, seconds=1.0)
    touch = found.servos_off.touches["gripper on floor (fixed_stud_1)"]
    with opened(mujoco_scene.replace(actuation=False)) as (limp, data):
        while data.time < touch - 1e-9:
            sm.forward(limp, data)
            assert len(data.contacts) == 0
            sm.step(limp, data)
        sm.forward(limp, data)
        assert len(data.contacts) > 0


def test_hold_tracks_the_worst_joint_and_the_speed() -> None:
    found = lesson_result("hold", sm.load("so101/scene"), seconds=0.2)
    assert np.array_equal(found.error, np.abs(found.qpos - found.target).max(axis=1))
    assert np.abs(found.speed).max() > 1.0
    assert np.abs(found.speed - (found.qpos[-1] - found.qpos[-2]) / 0.005).max() < 1e-9


def test_hold_that_ends_at_the_first_touch_says_so() -> None:
    whole = lesson_result("hold", sm.load("so101/scene"), seconds=0.5)
    found = lesson_result("hold", sm.load("so101/scene"), seconds=whole.first_contact)
    assert found.touching
    assert found.first_contact == pytest.approx(whole.first_contact)


def test_replay_compares_a_run_with_one_that_is_commanded_late(mujoco_box: sm.Model) -> None:
    found = lesson_result("replay", mujoco_box, steps=30, **{"break": "late-ctrl"})
    assert found.identical is False
    with started(mujoco_box) as one, started(mujoco_box) as two:
        one.time = two.time = 0.0
        one.ctrl = found.ctrl
        for k in range(30):
            sm.step(mujoco_box, one)
            sm.step(mujoco_box, two)
            two.ctrl = found.ctrl
            gap = one.qpos - two.qpos
            assert found.difference[k + 1] == np.abs(gap).max()
            assert found.apart[k + 1] == np.linalg.norm(gap[6:9], axis=-1)  # without BLAS
        assert one.time == pytest.approx(0.15)


def test_a_replay_that_is_commanded_in_time_is_close(mujoco_box: sm.Model) -> None:
    assert lesson_result("replay", mujoco_box, steps=5).close is True


def test_a_loop_runs_every_step_it_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    counted: list[int] = []
    monkeypatch.setattr(_loop_cost, "step", lambda _model, _data, n=1: counted.append(n))
    found = _loop_cost.measured(sm.load("so101"), 47, drive.no_progress)
    assert sum(counted) == 3 * 47  # in bulk twice
    assert counted.count(1) >= 47
    assert found.simulated == pytest.approx(47 * 0.005)


def _times(monkeypatch: pytest.MonkeyPatch, cost: Any) -> _loop_cost.LoopCost:
    """Return what a loop costs by a clock that `cost` moves: of a call of n steps, after some."""
    now, calls = [0.0], [0]

    def step(_model: Any, _data: Any, n: int = 1) -> None:
        now[0] += cost(n, calls[0])
        calls[0] += 1

    monkeypatch.setattr(_loop_cost, "step", step)
    monkeypatch.setattr(interleaved_timing.time, "perf_counter", lambda: now[0])
    return _loop_cost.measured(sm.load("so101"), 400, drive.no_progress)


def test_what_is_smaller_than_the_noise_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = random.Random(1)
    equal = _times(monkeypatch, lambda n, _: n * noise.uniform(0.9, 1.4))
    assert not equal.told_apart
    assert equal.null.low < 1 < equal.null.high


def test_what_takes_the_machine_once_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    disturbed = _times(monkeypatch, lambda n, k: n * (1.0 if k != 3 else 500.0))
    assert (disturbed.told_apart, disturbed.loop.median) == (False, 1)


def test_what_is_larger_than_the_noise_is_told_with_its_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    noise = random.Random(1)
    dear = _times(monkeypatch, lambda n, _: n + 0.3 + noise.uniform(-0.1, 0.1))
    assert dear.told_apart
    assert (dear.loop.median, dear.null.median) == pytest.approx((1.28, 1.0), abs=0.05)


@pytest.mark.parametrize(("rounds", "tells"), [(1, False), (4, False), (5, True)])
def test_few_rounds_tell_nothing(rounds: int, tells: bool) -> None:
    null = interleaved_timing.Ratio.of("null", [1.0] * 20, [1.0] * 20)
    ratio = interleaved_timing.Ratio.of("dear", [3.0] * rounds, [1.0] * rounds)
    assert_has(ratio, median=3.0, rounds=rounds)
    assert ratio.differs_from(null) == tells


def test_every_way_has_its_turn_in_every_round() -> None:
    order: list[str] = []
    times = interleaved_timing.time_interleaved(
        {name: partial(order.append, name) for name in "abc"}, 10
    )
    assert {name: len(each) for name, each in times.items()} == dict.fromkeys("abc", 10)
    turns = [tuple(order[k : k + 3]) for k in range(0, 30, 3)]
    assert all(sorted(turn) == ["a", "b", "c"] for turn in turns)
    assert len(set(turns)) > 1


def test_forward_compares_bits() -> None:
    assert lesson_result("forward", sm.load("so101"), value=1e-12).equal == ((1, 2),)


@overlapping
def test_state_of_every_type_of_joint(tmp_path: Path) -> None:
    found = lesson_result("state", model_of(tmp_path, BALL_AND_SLIDE))
    joints = {joint.name: joint for joint in found.joints}
    assert_has(joints["b"], qpos_start=7, qpos_stop=11, qvel_start=6, qvel_stop=9)
    assert joints["s"].type == "slide"


def _off(
    monkeypatch: pytest.MonkeyPatch, part: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> None:
    """Return a fault: what the engine says of a part of positions and rotations is a little off."""

    @around(fingertip, "engine_poses")
    def wrong(right: Any, *arguments: object) -> fingertip.Placement:
        pos, mat = right(*arguments)
        part(pos, mat)[...] += 1e-9
        return fingertip.Placement(pos, mat)

    wrong(monkeypatch)


@pytest.mark.usefixtures("pinocchio")
class TestCertificate:
    def test_poses_are_drawn_by_the_seed(self) -> None:
        model = sm.load("so101")
        one, again, other = (random_qpos(model, range(6), 50, seed) for seed in (1, 1, 2))
        assert np.array_equal(one, again)
        assert not np.array_equal(one, other)

    def test_the_first_pose_is_zero_and_the_others_fill_the_limits(self) -> None:
        model = sm.load("so101")
        poses = random_qpos(model, range(6), 50, 1)
        low, high = model.jnt_range.T
        assert not poses[0].any()
        assert ((poses >= low) & (poses <= high)).all()
        assert (np.ptp(poses[1:], axis=0) > 0.5 * (high - low)).all()

    def test_its_tolerance_is_what_the_project_promises(self) -> None:
        assert_has(fingertip.certify(sm.load("so101"), poses=20), tolerance=1e-12, agrees=True)

    @pytest.mark.parametrize("what", ["position", "rotation"])
    def test_one_bad_pose_among_many_is_enough(
        self, monkeypatch: pytest.MonkeyPatch, what: str
    ) -> None:
        _off(monkeypatch, lambda pos, mat: (pos if what == "position" else mat)[7])
        found = fingertip.certify(sm.load("so101"), poses=20)
        assert found.frames.same
        assert not found.agrees

    def test_a_witness_without_a_joint_that_moves_the_tip_is_refused(self, tmp_path: Path) -> None:
        text = (models_dir() / "so101" / "so101.xml").read_text()
        text = re.sub(r'.*(mesh|joint name="wrist_roll"|joint="wrist_roll").*\n', "", text)
        file = written(tmp_path / "other.xml", text)
        certify = partial(fingertip.certify, sm.load("so101"), poses=5, witness=file)
        refused((BadInputError, "wrist_roll", certify))

    def test_a_free_robot_has_a_certificate_too(self, tmp_path: Path) -> None:
        inertial = "<inertial mass='1' pos='0 0 0' diaginertia='1 1 1'/>"
        model = loaded(
            tmp_path,
            f"<body name='r' pos='0 0 1'>{inertial}<freejoint name='f'/>"
            f"<body name='b' pos='1 0 0'>{inertial}<joint name='w' type='ball'/>"
            "<site name='tip' pos='0.1 0.2 0.3'/></body></body>",
        )
        found = fingertip.certify(model, poses=50, site="tip")
        assert_has(found, agrees=True, grade="own reading", body="b")

    ENDS = (
        "<mujoco><worldbody>{}<body name='a'><joint name='j'/><geom size='.1'/><body name='b' "
        "pos='1 0 0'><geom size='.1'/></body><body pos='0 1 0'><joint type='slide' axis='1 0 0'/>"
        "<geom size='.1'/></body></body><body name='table' pos='0 0 9'/></worldbody></mujoco>"
    )

    def test_without_a_name_every_body_at_an_end_has_a_certificate(self, tmp_path: Path) -> None:
        found = fingertip.certify(model_of(tmp_path, self.ENDS.format("")), poses=50)
        assert found.agrees
        assert {tip.site for tip in found.tips} == {"b", "body 3"}  # not the table: it is still

    def test_the_worst_end_is_first_and_stands_for_all(self, tmp_path: Path) -> None:
        found = fingertip.certify(model_of(tmp_path, self.ENDS.format("")), poses=50)
        worst = [tip.worst for tip in found.tips]
        assert worst == sorted(worst, reverse=True)
        first = found.tips[0]
        assert_has(found, site=first.site, position_worst=first.position_worst)

    def test_joints_without_limits_are_drawn_around_once_or_within_a_metre(
        self, tmp_path: Path
    ) -> None:
        drawn = random_qpos(model_of(tmp_path, self.ENDS.format("")), range(2), 500, 0)
        assert np.abs(drawn[:, 0]).max() == pytest.approx(np.pi, rel=0.01)
        assert np.abs(drawn[:, 1]).max() == pytest.approx(1, rel=0.01)  # a slide's metres

    def test_a_body_that_is_named_has_the_only_certificate(self, tmp_path: Path) -> None:
        model = model_of(tmp_path, self.ENDS.format(""))
        assert [tip.site for tip in fingertip.certify(model, poses=50, site="a").tips] == ["a"]

    def test_a_robot_that_no_joint_moves_has_a_certificate_of_a_named_body_alone(
        self, tmp_path: Path
    ) -> None:
        still = model_of(tmp_path, "<mujoco><worldbody><body name='b'/></worldbody></mujoco>")
        certify = partial(fingertip.certify, still, poses=5)
        refused((BadInputError, "moved by a joint", certify))
        assert certify(site="b").agrees

    def test_one_tip_of_many_that_is_elsewhere_is_enough(
        self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        _off(monkeypatch, lambda pos, _: pos[7, 1:2])
        found = fingertip.certify(model_of(tmp_path, self.ENDS.format("")), poses=20)
        assert_has(found, agrees=False, site="body 3")
        assert [tip.agrees for tip in found.tips] == [False, True]

    CLOTH = (
        "<flexcomp name='f' type='grid' dim='2' count='3 3 1' spacing='.1 .1 .1' mass='1' "
        "radius='.01'/>"
    )
    # A cloth that nothing holds; its places are all that is asked.
    of_a_cloth = pytest.mark.filterwarnings(
        "ignore:MuJoCo. flex 'f' is not rigid:statemachine.errors.EngineWarning"
    )

    @of_a_cloth
    def test_what_is_not_read_from_the_file_is_told_and_is_no_verdict(self, tmp_path: Path) -> None:
        found = fingertip.certify(model_of(tmp_path, self.ENDS.format(self.CLOTH)), poses=20)
        assert_has(found, agrees=True, grade="same reading")
        assert "<flexcomp>" in found.reason
        assert not blocks(page({"mujoco": found}), Verdict)

    @of_a_cloth
    def test_what_is_not_read_from_the_file_and_is_elsewhere_fails(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        _off(monkeypatch, lambda pos, _: pos)
        found = fingertip.certify(model_of(tmp_path, self.ENDS.format(self.CLOTH)), poses=20)
        assert not page({"mujoco": found}).holds

    @of_a_cloth
    def test_a_witness_that_is_asked_for_and_cannot_be_read_is_not_replaced(
        self, tmp_path: Path
    ) -> None:
        file = written(tmp_path / "m.xml", self.ENDS.format(self.CLOTH))
        certify = partial(fingertip.certify, sm.load(file), poses=20, witness=file)
        refused((ModelError, "<flexcomp>", certify))

    @pytest.mark.parametrize("site", ["gripper", "moving_jaw_so101_v1"])
    @pytest.mark.parametrize(
        ("file", "witness"), [("so101.xml", "so101.urdf"), ("so101.urdf", "so101.xml")]
    )
    def test_mjcf_against_urdf_of_the_same_robot(self, file: str, witness: str, site: str) -> None:
        arm = models_dir() / "so101"
        found = fingertip.certify(sm.load(arm / file), poses=50, site=site, witness=arm / witness)
        assert_has(found, grade="own reading", agrees=True)
