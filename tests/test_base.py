"""Whether the base of a robot floats is an option of `load`: base="free", base="fixed"."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pybullet
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, UnknownNameError, UnsupportedError
from statemachine.interface import JointType
from statemachine.lab.compare.typed_sides import parse_sides
from statemachine.releases import is_here

from .support.backends import BOTH, RELEASES
from .support.legged import FLOATING, STANDING, mjcf, urdf, written
from .support.requirements import need_engine

WAYS = (("mujoco", "model"), ("pybullet", "model"), ("pybullet", "engine"))
ARM = (
    '<mujoco><worldbody><body name="l"><joint name="{joint}" axis="0 1 0"/><geom size="0.1"/>'
    "</body></worldbody></mujoco>"
)


def _model(folder: Path, text: str, backend: str = "mujoco", **options: Any) -> sm.Model:
    suffix = "urdf" if text.startswith("<robot") else "xml"
    return sm.load(written(folder, f"robot.{suffix}", text), backend, **options)


@pytest.mark.parametrize(("backend", "defaults"), WAYS)
@pytest.mark.parametrize("base", ["free", "fixed", None])
def test_a_urdf_that_does_not_say_it_floats_where_that_is_asked(tmp_path, backend, defaults, base):
    need_engine(backend)
    model = _model(tmp_path, urdf(), backend, defaults=defaults, base=base)
    kinds = model.jnt_type.tolist()
    assert (kinds.count(JointType.FREE), kinds.count(JointType.HINGE)) == (base == "free", 4)
    assert model.read_options.base == base


@pytest.mark.parametrize("backend", BOTH)
def test_a_floating_joint_of_a_urdf_is_left_out_where_the_base_is_fixed(tmp_path, backend):
    need_engine(backend)
    free, fixed = (
        _model(tmp_path, urdf(FLOATING), backend, base=base) for base in ("free", "fixed")
    )
    assert (free.nq, free.joint_names[0]) == (11, "root")
    assert (fixed.nq, fixed.nv) == (4, 4)


def test_the_base_of_a_urdf_starts_at_the_origin_or_where_its_floating_joint_is(tmp_path):
    open_base, floating = (
        _model(tmp_path, text, base="free").compiled.qpos0[:7] for text in (urdf(), urdf(FLOATING))
    )
    assert open_base.tolist() == [0, 0, 0, 1, 0, 0, 0]
    assert floating.tolist() == pytest.approx([0, 0, 0.4, 1, 0, 0, 0])


def test_a_base_that_floats_falls_as_in_a_model_that_mujoco_is_given(tmp_path):
    path = written(tmp_path, "robot.urdf", urdf())
    spec = mujoco.MjSpec.from_file(str(path))
    spec.worldbody.first_body().add_freejoint()
    raw = spec.compile()
    raw.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = mujoco.MjData(raw)
    model = sm.load(path, base="free")
    with sm.make_data(model) as mine:
        for qpos in (data.qpos, mine.qpos):
            qpos[7:] = [0.3, -0.2, 0.1, 0.4]
        mujoco.mj_step(raw, data, 100)
        sm.step(model, mine, 100)
        assert mine.qpos.tolist() == data.qpos.tolist()
    assert data.qpos[2] < -0.15


def test_pybullet_as_it_comes_floats_as_its_own_loader_does(tmp_path):
    need_engine("pybullet")
    path = written(tmp_path, "robot.urdf", urdf())
    model = sm.load(path, "pybullet", defaults="engine", base="free")
    model = model.replace(gravity=[0, 0, -9.81])
    with sm.make_data(model) as data:
        sm.step(model, data, 60)
        mine = data.qpos[:3].copy()
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        body = pybullet.loadURDF(str(path), physicsClientId=client)
        for _ in range(60):
            pybullet.stepSimulation(physicsClientId=client)
        theirs, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    assert theirs[2] < -0.2
    assert mine == pytest.approx(theirs, abs=1e-9)


@pytest.mark.parametrize("backend", BOTH)
def test_the_free_joint_of_an_mjcf_goes_and_its_keyframes_keep_the_rest(tmp_path, backend):
    need_engine(backend)
    model = _model(tmp_path, mjcf(), backend, base="fixed")
    (crouch,) = model.keyframes
    assert crouch.qpos.tolist() == [0.3, 0.3, -0.3, -0.3]
    assert crouch.ctrl.tolist() == [0.3, 0.3, -0.3, -0.3]
    with sm.make_data(model) as data:
        sm.forward(model, data)
        assert data.xpos[model.body_id("trunk")].tolist() == pytest.approx([0, 0, STANDING])


def test_a_base_that_gets_a_free_joint_stands_in_keyframes_where_it_stands_in_the_file(tmp_path):
    model = _model(tmp_path, mjcf(""), base="free")
    (crouch,) = model.keyframes
    assert crouch.qpos.tolist() == [0, 0, STANDING, 1, 0, 0, 0, 0.3, 0.3, -0.3, -0.3]


def test_other_free_bodies_of_a_scene_stay_free(tmp_path):
    box = '<body name="box" pos="2 0 1"><freejoint/><geom size="0.1"/></body>'
    text = mjcf("").replace("<keyframe>", "<keyframe><!--").replace("</keyframe>", "--></keyframe>")
    scene = text.replace('<body name="trunk"', f'{box}<body name="trunk"')
    fixed, free = (_model(tmp_path, scene, base=base) for base in ("fixed", "free"))
    assert (fixed.nq, free.nq) == (11, 18)
    assert fixed.body_names[fixed.jnt_bodyid[0]] == "box"


def test_replace_takes_no_other_base_than_the_file_was_read_with(tmp_path):
    model = _model(tmp_path, urdf(), base="free")
    assert model.replace(base="free", timestep=0.001).read_options.base == "free"
    with pytest.raises(UnsupportedError):
        model.replace(base="fixed")


def test_a_base_that_is_no_base_is_refused(tmp_path):
    with pytest.raises(UnknownNameError):
        _model(tmp_path, urdf(), base="floating")


def test_a_robot_whose_first_joint_is_on_the_world_has_no_base_that_could_float(tmp_path):
    with pytest.raises(BadInputError):
        _model(tmp_path, ARM.format(joint="shoulder"), base="free")
    assert _model(tmp_path, ARM.format(joint="shoulder"), base="fixed").nq == 1


def test_of_two_robots_the_base_is_of_neither(tmp_path):
    body = '<body name="{0}"><geom size="0.1"/><body><joint/><geom size="0.1"/></body></body>'
    text = f"<mujoco><worldbody>{body.format('a')}{body.format('b')}</worldbody></mujoco>"
    with pytest.raises(BadInputError):
        _model(tmp_path, text, base="free")


def test_a_model_with_a_free_base_goes_through_a_pickle_of_its_state(tmp_path):
    model = _model(tmp_path, urdf(), base="free")
    with sm.make_data(model) as data, sm.make_data(model) as other:
        sm.step(model, data, 10)
        sm.set_state(model, other, pickle.loads(pickle.dumps(sm.get_state(model, data))))
        assert np.array_equal(data.qpos, other.qpos)


def test_base_is_an_option_of_a_side(tmp_path):
    path = written(tmp_path, "robot.urdf", urdf())
    sides = parse_sides([f"{path} base=free", f"{path}@mujoco", "base=fixed"])
    assert [side.options for side in sides] == [{"base": "free"}, {"base": "fixed"}]
    assert sides[0].load(timestep=0.001).nq == 11
    with pytest.raises(UnknownNameError):
        parse_sides([str(path), "base=floating"])


@pytest.mark.slow
@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("text", [urdf(), urdf(FLOATING), mjcf(), mjcf("")])
@pytest.mark.parametrize("base", ["free", "fixed"])
def test_a_release_has_the_same_base(tmp_path, release, text, base):
    if not is_here(release):
        pytest.skip(f"{release} is not installed here: statemachine engines add {release}")
    if release < "mujoco==3.2" and text.startswith("<mujoco"):
        pytest.skip("it reads an MJCF as it is written")
    here, there = (_model(tmp_path, text, backend, base=base) for backend in ("mujoco", release))
    assert there.joint_names == here.joint_names
    assert there.compiled.qpos0 == pytest.approx(here.compiled.qpos0)
