"""The process of another release of MuJoCo, asked here: its worlds, edits, bases and messages."""

from __future__ import annotations

import io
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine.backends.file_text import BaseOfText, text_for, urdf_text
from statemachine.backends.served import child_server, release_base, release_child, shared_fields
from statemachine.backends.served.release_options import spec_with_options
from statemachine.backends.served.release_parts import (
    PARTS,
    constraint_part,
    contact_arrays,
    owner_of_field,
)
from statemachine.interface.free_base import FreeBase
from statemachine.interface.records import ReadOptions
from statemachine.rotations import matrix_from_quat

from .support.files import written

# A box on the floor, a filter that drives a hinge beyond its limit, friction, a tie, a mocap body.
SCENE = """<mujoco><option timestep="0.004"/><worldbody>
<geom name="floor" type="plane" size="1 1 .1"/>
<body name="goal" mocap="true" pos="0 0 2"/>
<body name="box" pos=".5 0 .09"><freejoint name="box"/><geom name="box" type="box" size=".1 .1 .1"
  mass="1"/></body>
<body name="arm" pos="0 0 1"><joint name="hinge" axis="0 1 0" range="-20 20" limited="true"
  frictionloss=".2"/><geom name="rod" type="capsule" size=".02" fromto="0 0 0 .3 0 0" mass=".5"/>
  <body name="hand" pos=".3 0 0"><joint name="slide" type="slide" axis="1 0 0"/>
  <geom size=".03" mass=".2"/><site name="tip" pos=".1 0 0"/></body></body>
</worldbody>
<equality><joint joint1="slide" polycoef=".02 0 0 0 0"/></equality>
<actuator><general name="motor" joint="hinge" dyntype="filter" dynprm=".1" gainprm="9"/></actuator>
<keyframe><key name="up" qpos=".5 0 .09 1 0 0 0 .3 0"/></keyframe></mujoco>"""
FILTERED = np.array([0.4])


@pytest.fixture
def file(tmp_path: Path) -> str:
    """The scene, as a file."""
    return str(written(tmp_path / "scene.xml", SCENE))


@pytest.fixture
def world(file: str) -> Any:
    """A world of the scene, in a state beyond a limit."""
    model, _, _ = release_child.load(file, "", ())
    world = release_child.Simulation(model)
    world.place(start_of(world))
    world.command(np.array([0.7, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0]))
    return world


def start_of(world: Any) -> np.ndarray:
    """Return a state in which the hinge is beyond its limit and the box touches the floor."""
    qpos = np.array(world.model.key_qpos[0])
    qpos[7] = 0.5
    qvel = np.zeros(world.model.nv)
    qvel[6] = 0.25
    return np.concatenate([qpos, qvel, np.zeros(world.model.nv), FILTERED])


# A world.


def test_a_state_is_what_was_placed(world: Any) -> None:
    assert world.state().tolist() == start_of(world).tolist()
    assert world.memory == [("warmstart", 8), ("act", 1)]
    assert world.kept_memory == ["warmstart", "act"]
    assert world.data.qpos[7] == 0.5
    assert world.data.qvel[6] == 0.25
    assert world.data.act.tolist() == FILTERED.tolist()


def test_a_place_leaves_nothing_of_before(world: Any) -> None:
    world.advance(3, 1e9)
    world.place(start_of(world))
    assert world.data.time == 0
    assert world.state().tolist() == start_of(world).tolist()


def test_a_command_is_followed_by_where_mocap_bodies_are(world: Any) -> None:
    assert world.data.ctrl.tolist() == [0.7]
    assert world.data.mocap_pos.tolist() == [[1, 2, 3]]
    assert world.data.mocap_quat.tolist() == [[0, 1, 0, 0]]


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_steps_are_those_of_the_engine(world: Any, file: str, steps: int) -> None:
    model = mujoco.MjModel.from_xml_path(file)
    data = mujoco.MjData(model)
    start = start_of(world)
    data.qpos[:], data.qvel[:], data.act[:] = start[:9], start[9:17], FILTERED
    data.ctrl[:] = 0.7
    mujoco.mj_step(model, data, steps)
    assert world.advance(steps, 1e9) == steps
    assert world.data.qpos.tolist() == data.qpos.tolist()
    assert world.data.time == pytest.approx(steps * 0.004)


@pytest.mark.parametrize(("fastest", "taken"), [(1e9, 50), (0.0, 1)])
def test_steps_end_where_a_speed_is_beyond_its_bound(
    world: Any, fastest: float, taken: int
) -> None:
    assert world.advance(50, fastest) == taken


def test_steps_are_repeated_up_to_the_one_that_went_beyond(world: Any) -> None:
    speeds = []
    for _ in range(12):
        world.advance(1, math.inf)
        speeds.append(float(np.linalg.norm(world.data.qvel)))
    bound = (speeds[6] + max(speeds[:6])) / 2 if speeds[6] > max(speeds[:6]) else max(speeds) + 1
    first = next((k for k, speed in enumerate(speeds, 1) if speed >= bound), 12)
    world.place(start_of(world))
    world.command(np.array([0.7, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0]))
    assert world.advance(12, bound) == first
    assert float(np.linalg.norm(world.data.qvel)) == speeds[first - 1]


def test_a_place_beyond_what_the_engine_takes_ends_the_steps(world: Any) -> None:
    start = start_of(world)
    start[0] = 2e10
    world.place(start)
    assert world.advance(5, 1e12) == 1
    assert np.isnan(world.data.qpos).any() or abs(world.data.qpos[0]) > 1e10


def test_what_the_engine_found_bad_is_told_since_the_last_place(world: Any) -> None:
    assert not world.warned()
    world.data.qvel[0] = math.nan
    assert world.advance(2, math.inf) == 1
    assert world.warned()
    assert np.isnan(world.data.qpos).all()
    world.place(start_of(world))
    assert not world.warned()


def test_what_is_derived_is_that_of_the_engine(world: Any) -> None:
    world.forward()
    derived = world.derived(None)
    data = world.data
    for name in (*release_child.POSES, *release_child.FORCES):
        assert derived[name].tolist() == getattr(data, name).tolist()
    parts = sum(derived[name] for name in PARTS)
    assert parts == pytest.approx(data.qfrc_constraint, abs=1e-12)


@pytest.mark.parametrize(
    ("part", "acts_on"),
    [
        ("qfrc_limit", {6}),
        ("qfrc_friction", {6}),
        ("qfrc_equality", {7}),
        ("qfrc_contact", {0, 1, 2, 3, 4, 5}),
    ],
)
def test_each_part_of_the_constraint_force_acts_on_its_own_joints(
    world: Any, part: str, acts_on: set[int]
) -> None:
    world.forward()
    force = constraint_part(world.model, world.data, part)
    acting = set(np.flatnonzero(np.abs(force) > 1e-9).tolist())
    assert acting
    assert acting <= acts_on


def test_contacts_carry_the_box(world: Any) -> None:
    world.forward()
    arrays = contact_arrays(world.model, world.data)
    count = world.data.ncon
    assert count == 4
    assert arrays["geom"].tolist() == [[0, 1]] * 4
    assert arrays["dist"] == pytest.approx([-0.01] * 4)
    assert arrays["frame"][:, 0] == pytest.approx(np.array([[0.0, 0, 1]] * 4))
    assert arrays["pos"][:, 2] == pytest.approx([-0.005] * 4)
    lift = constraint_part(world.model, world.data, "qfrc_contact")[2]
    assert arrays["force"][:, 0].sum() == pytest.approx(lift)
    assert arrays["torque"].shape == (4, 3)


# A file.


def test_a_file_is_told_with_its_fields_flags_and_names(file: str) -> None:
    names = ("body_mass", "opt.timestep", "names", "no_such_field", "nq")
    model, facts, fields = release_child.load(file, "", names)
    assert fields["body_mass"].tolist() == model.body_mass.tolist()
    assert fields["opt.timestep"] == 0.004
    assert fields["nq"] == 9
    assert set(fields) == {"body_mass", "opt.timestep", "nq"}
    assert facts["version"] == mujoco.__version__
    assert facts["names"]["jnt"] == ["box", "hinge", "slide"]
    assert facts["names"]["key"] == ["up"]
    assert facts["names"]["eq"] == [""]
    assert set(facts["flags"]) == {"opt.disableflags", "opt.enableflags"}


def test_a_release_does_not_begin_anew_by_itself(file: str) -> None:
    _, facts, _ = release_child.load(file, "", ())
    assert "mjDSBL_AUTORESET" in facts["flags"]["opt.disableflags"]


def test_a_text_comes_before_a_file(file: str) -> None:
    model, _, _ = release_child.load(file, SCENE.replace('"0.004"', '"0.008"'), ())
    assert model.opt.timestep == 0.008


def test_what_a_release_reads_is_written_as_mjcf(file: str) -> None:
    for read in (None, {**AS_WRITTEN, "balance_inertia": True}):
        text = release_child.written(file, "", read)
        assert 'name="hinge"' in text
        assert mujoco.MjModel.from_xml_string(text).nq == 9


AS_WRITTEN = {
    "balance_inertia": False,
    "meshes": True,
    "base": None,
    "start": None,
    "least_mass": False,
}


def test_fields_are_edited(file: str) -> None:
    model, _, _ = release_child.load(file, "", ())
    inertia = model.dof_M0.copy()
    edits = {
        "opt.gravity": np.array([0.0, 0, -1]),
        "opt.integrator": np.array(2.0),
        "body_mass": np.full(model.nbody, 2.0),
        "body_pos": np.arange(3.0 * model.nbody),
    }
    release_child.edit(model, edits, {})
    assert model.opt.gravity.tolist() == [0, 0, -1]
    assert model.opt.integrator == 2
    assert model.body_mass.tolist() == [2] * model.nbody
    assert model.body_pos[1].tolist() == [3, 4, 5]
    release_child.edit(model, {"dof_M0": 2 * inertia}, {})
    assert model.dof_M0.tolist() == (2 * inertia).tolist()


@pytest.mark.parametrize("wanted", [[], ["mjDSBL_GRAVITY"], ["mjDSBL_LIMIT", "mjDSBL_ACTUATION"]])
def test_flags_are_set_by_their_names(file: str, wanted: list[str]) -> None:
    model, _, _ = release_child.load(file, "", ())
    release_child.edit(model, {}, {"opt.disableflags": wanted})
    members = mujoco.mjtDisableBit.__members__
    assert model.opt.disableflags == sum(int(members[name]) for name in wanted)
    assert sorted(release_child.flags_of(model, "disable")) == sorted(wanted)
    assert release_child.flags_of(model, "enable") == []


def test_a_flag_that_a_release_does_not_have_is_refused(file: str) -> None:
    model, _, _ = release_child.load(file, "", ())
    with pytest.raises(ValueError, match="mjDSBL_MAGIC"):
        release_child.edit(model, {}, {"opt.disableflags": ["mjDSBL_MAGIC"]})


def test_two_flags_that_were_one_are_that_one(monkeypatch: pytest.MonkeyPatch, file: str) -> None:
    model, _, _ = release_child.load(file, "", ())
    members = {"mjDSBL_PASSIVE": 32, "mjDSBL_GRAVITY": 64}
    kinds = SimpleNamespace(__members__=members)
    monkeypatch.setitem(release_child.KINDS, "disable", kinds)
    both = {"opt.disableflags": ["mjDSBL_SPRING", "mjDSBL_DAMPER", "mjDSBL_GRAVITY"]}
    release_child.edit(model, {}, both)
    assert model.opt.disableflags == 32 + 64
    with pytest.raises(ValueError, match="mjDSBL_SPRING"):
        release_child.edit(model, {}, {"opt.disableflags": ["mjDSBL_SPRING"]})


def test_the_owner_of_a_field(file: str) -> None:
    model = mujoco.MjModel.from_xml_path(file)
    assert owner_of_field(model, "body_mass") == (model, "body_mass")
    assert owner_of_field(model, "opt.timestep")[1] == "timestep"


# Numbers that releases have in common.


def test_a_model_takes_over_what_another_release_read(file: str) -> None:
    raw = mujoco.MjModel.from_xml_path(file)
    kinds = raw.geom_type.tolist()
    fields = {
        "body_mass": np.full(raw.nbody, 3.0),
        "opt.timestep": np.array(0.5),
        "jnt_range": np.zeros((1, 2)),
        "geom_type": np.zeros(raw.ngeom),
        "no_such_field": np.zeros(1),
    }
    assert shared_fields.take_over(raw, fields) == {"body_mass", "opt.timestep", "geom_type"}
    assert raw.body_mass.tolist() == [3] * raw.nbody
    assert raw.opt.timestep == 0.5
    assert raw.geom_type.tolist() == kinds
    assert raw.jnt_range[1].any()


def test_flags_are_taken_over_by_their_names(file: str) -> None:
    raw = mujoco.MjModel.from_xml_path(file)
    shared_fields.take_over_flags(
        raw, "opt.disableflags", ["mjDSBL_PASSIVE", "mjDSBL_GRAVITY", "mjDSBL_MAGIC"]
    )
    bits = mujoco.mjtDisableBit
    wanted = bits.mjDSBL_SPRING, bits.mjDSBL_DAMPER, bits.mjDSBL_GRAVITY
    assert raw.opt.disableflags == sum(int(bit) for bit in wanted)


def test_what_is_laid_out_in_each_release_s_own_way_is_not_sent(file: str) -> None:
    raw = mujoco.MjModel.from_xml_path(file)
    names = list(shared_fields.field_names(raw))
    assert {"body_mass", "qpos0", "opt.timestep", "stat.extent"} <= set(names)
    assert not {"mesh_vert", "names", "B_rowadr", "opt.disableflags", "sensor_type"} & set(names)
    assert "mesh_vert" in set(shared_fields.field_names(raw, ()))
    assert shared_fields.field_of(raw, "opt.timestep") == 0.004


# The base of a robot.

ROBOT = """<mujoco><worldbody><body name="post" pos="9 9 0"><geom size=".1"/></body>
<body name="torso" pos="1 2 3" quat=".6 0 .8 0">{joint}<geom size=".1" mass="3"/>
<body name="arm" pos=".3 0 0"><joint name="a" type="{kind}"/><geom size=".1" mass="1"/></body>
</body>{more}</worldbody>{rest}</mujoco>"""
FREE = '<freejoint name="root"/>'


def robot(joint: str = "", more: str = "", rest: str = "", kind: str = "hinge") -> Any:
    """Return the specification of a robot beside a post."""
    return mujoco.MjSpec.from_string(ROBOT.format(joint=joint, more=more, rest=rest, kind=kind))


def test_a_base_gets_a_free_joint_where_it_stands() -> None:
    spec = robot(rest='<keyframe><key qpos=".5" qvel=".25"/><key ctrl=""/></keyframe>')
    release_base.set_base(spec, "free")
    model = spec.compile()
    assert model.joint(0).name == "floating_base_joint"
    assert model.key_qpos[0].tolist() == pytest.approx([1, 2, 3, 0.6, 0, 0.8, 0, 0.5])
    assert model.key_qvel[0].tolist() == [0] * 6 + [0.25]


def test_a_base_gets_a_free_joint_at_its_start() -> None:
    spec = robot()
    start = {"pos": [4.0, 5.0, 6.0], "quat": [0.0, 1.0, 0.0, 0.0]}
    release_base.set_base(spec, "free", start)
    assert spec.compile().qpos0.tolist() == [4, 5, 6, 0, 1, 0, 0, 0]


@pytest.mark.parametrize(("kind", "size"), [("hinge", 1), ("slide", 1), ("ball", 4)])
def test_numbers_of_joints_before_the_base_stay(kind: str, size: int) -> None:
    first = f'<body name="first"><joint type="{kind}"/><geom size=".1"/></body>'
    row = [1.0, 0, 0, 0][:size]
    numbers = " ".join(map(str, row))
    text = ROBOT.format(
        joint="",
        more="",
        rest='<actuator><motor joint="a"/></actuator>'
        f'<keyframe><key qpos="{numbers} .5" qvel="{" ".join("7" * max(1, size - 1))} .25"/>'
        "</keyframe>",
        kind="hinge",
    ).replace("<worldbody>", f"<worldbody>{first}")
    spec = mujoco.MjSpec.from_string(text)
    release_base.set_base(spec, "free")
    model = spec.compile()
    assert model.key_qpos[0].tolist() == pytest.approx([*row, 1, 2, 3, 0.6, 0, 0.8, 0, 0.5])
    speeds = [7.0] * max(1, size - 1)
    assert model.key_qvel[0].tolist() == [*speeds, 0, 0, 0, 0, 0, 0, 0.25]


def test_a_base_loses_its_free_joint() -> None:
    spec = robot(
        FREE, rest='<keyframe><key qpos="4 5 6 1 0 0 0 .5" qvel="1 2 3 4 5 6 .25"/></keyframe>'
    )
    release_base.set_base(spec, "fixed")
    model = spec.compile()
    assert (model.nq, model.nv) == (1, 1)
    assert model.key_qpos[0].tolist() == [0.5]
    assert model.key_qvel[0].tolist() == [0.25]


def test_a_base_that_is_as_asked_for_stays() -> None:
    for joint, base in ((FREE, "free"), ("", "fixed")):
        spec = robot(joint)
        before = spec.to_xml()
        release_base.set_base(spec, base)
        assert spec.to_xml() == before


def test_a_base_that_turns_on_the_world_cannot_float() -> None:
    with pytest.raises(ValueError, match="turn"):
        release_base.set_base(robot('<joint name="turn"/>'), "free")


OTHER = '<body name="other"><joint name="b"/><geom size=".1"/></body>'


def test_of_several_trees_the_one_that_is_driven_is_the_robot() -> None:
    drive = '<actuator><motor joint="b"/></actuator>'
    assert release_base.root_of(robot(more=OTHER, rest=drive)).name == "other"
    assert release_base.root_of(robot()).name == "torso"
    with pytest.raises(ValueError, match="torso, other"):
        release_base.root_of(robot(more=OTHER))


def test_of_bodies_without_joints_one_alone_is_the_robot() -> None:
    alone = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body name="m" mocap="true"/><body name="a"><freejoint/>'
        '<geom size=".1"/></body></worldbody></mujoco>'
    )
    assert release_base.root_of(alone).name == "a"
    with pytest.raises(ValueError, match="world"):
        release_base.root_of(mujoco.MjSpec())


def test_a_free_joint_may_be_of_what_is_fixed_to_the_base() -> None:
    spec = mujoco.MjSpec.from_string(ROBOT.format(joint=FREE, more="", rest="", kind="hinge"))
    joint = release_base.free_joint_of(release_base.root_of(spec))
    assert joint is not None
    assert joint.name == "root"
    assert release_base.free_joint_of(release_base.root_of(robot())) is None


def test_the_free_joint_has_a_name_of_its_own() -> None:
    taken = release_base.FREE_JOINT
    spec = robot(more=OTHER.replace('"b"', f'"{taken}"'))
    assert release_base.free_joint_name(spec) == f"{taken}_2"


# Options of reading.


def test_a_body_that_moves_gets_the_least_mass(tmp_path: Path) -> None:
    text = "<mujoco><worldbody><body><joint/><site/></body></worldbody></mujoco>"
    file = str(written(tmp_path / "light.xml", text))
    model = spec_with_options(file, **{**AS_WRITTEN, "least_mass": True}).compile()
    assert model.body_mass[1] == 1e-12
    assert model.body_inertia[1].tolist() == [1e-12] * 3
    with pytest.raises(ValueError, match="mass"):
        spec_with_options(file, **AS_WRITTEN).compile()


def test_an_inertia_is_balanced_where_that_is_asked_for(tmp_path: Path) -> None:
    text = (
        "<mujoco><worldbody><body><joint/>"
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 4"/></body></worldbody></mujoco>'
    )
    file = str(written(tmp_path / "odd.xml", text))
    model = spec_with_options(file, **{**AS_WRITTEN, "balance_inertia": True}).compile()
    assert model.body_inertia[1].tolist() == [2, 2, 2]


def test_shapes_that_are_meshes_are_left_out(tmp_path: Path) -> None:
    text = (
        '<mujoco><asset><mesh name="m" file="absent.stl"/></asset><worldbody><geom size="1"/>'
        '<geom type="mesh" mesh="m"/></worldbody></mujoco>'
    )
    file = str(written(tmp_path / "mesh.xml", text))
    model = spec_with_options(file, **{**AS_WRITTEN, "meshes": False}).compile()
    assert (model.ngeom, model.nmesh) == (1, 0)


def test_the_base_is_an_option_too(tmp_path: Path) -> None:
    file = str(written(tmp_path / "r.xml", ROBOT.format(joint="", more="", rest="", kind="hinge")))
    assert spec_with_options(file, **{**AS_WRITTEN, "base": "free"}).compile().nq == 8


# Messages.


def test_a_message_is_read_as_it_was_sent() -> None:
    pipe = io.BytesIO()
    arrays = {"a": np.array([[1.5, 2.5]]), "b": np.arange(3)}
    child_server.send(pipe, {"verb": "run"}, arrays)
    pipe.seek(0)
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(child_server.select, "select", lambda *_: ([pipe], [], []))
        facts, read, _ = child_server.receive(pipe, 0.0)
    assert facts == {"verb": "run"}
    assert read["a"].tolist() == [[1.5, 2.5]]
    assert (read["b"].tolist(), read["b"].dtype) == ([0, 1, 2], arrays["b"].dtype)
    assert read["a"].flags.writeable


GRAVITY = mujoco.mjtDisableBit.mjDSBL_GRAVITY


@pytest.fixture
def server() -> Any:
    """What answers, of this release."""
    return child_server.Answerer(release_child)


def loaded(server: Any, file: str, edits: Any = None, **job: Any) -> tuple[dict[str, Any], Any]:
    """Return what is answered where a file is loaded."""
    return server.load({"file": file, "text": "", **job}, edits or {})


def test_a_world_is_made_and_run(server: Any, file: str) -> None:
    facts, fields = loaded(server, file, fields=("opt.timestep",))
    assert fields == {"opt.timestep": 0.004}
    made, _ = server.make({"model": facts["model"]}, {})
    assert made["memory"] == [("warmstart", 8), ("act", 1)]
    assert (made["kept_memory"], made["unavailable"]) == (["warmstart", "act"], ())
    start = start_of(server.things[made["world"]])
    command = np.array([0.7, 0, 0, 2.0, 1, 0, 0, 0])
    job = {"world": made["world"], "steps": 3, "fastest": 1e9, "ahead": True}
    answer, states = server.run(job, {"state": start, "ctrl": command})
    other = release_child.Simulation(mujoco.MjModel.from_xml_path(file))
    other.place(start)
    other.command(command)
    rows = []
    for _ in range(4):
        other.advance(1, 1e9)
        rows.append(other.state().tolist())
    assert answer == {"taken": 3}
    assert states["before"].tolist() == rows[2]
    assert states["after"].tolist() == rows[3]
    again, states = server.run({**job, "ahead": False}, {"ctrl": command})
    assert again == {"taken": 3}
    assert set(states) == {"before"}


def test_of_steps_that_ended_early_none_is_taken_ahead(server: Any, file: str) -> None:
    facts, _ = loaded(server, file)
    made, _ = server.make({"model": facts["model"]}, {})
    start = start_of(server.things[made["world"]])
    job = {"world": made["world"], "steps": 3, "fastest": 0.0, "ahead": True}
    command = np.array([0.7, 0, 0, 2.0, 1, 0, 0, 0])
    answer, states = server.run(job, {"state": start, "ctrl": command})
    assert answer == {"taken": 1}
    assert set(states) == {"before"}


def test_a_look_derives_of_the_state_that_is_given(server: Any, file: str) -> None:
    facts, _ = loaded(server, file)
    made, _ = server.make({"model": facts["model"]}, {})
    start = start_of(server.things[made["world"]])
    command = np.array([0.7, 5.0, 0, 2.0, 1, 0, 0, 0])
    _, derived = server.look({"world": made["world"]}, {"state": start, "ctrl": command})
    x, z = 0.4 * math.cos(0.5), 1 - 0.4 * math.sin(0.5)
    assert derived["site_xpos"][0] == pytest.approx([x, 0, z])
    assert derived["xpos"][1].tolist() == [5, 0, 2]
    # The force is of the activation, not of the command.
    assert derived["qfrc_actuator"][6] == pytest.approx(9 * 0.4)


def test_a_file_that_has_changed_is_refused(server: Any, file: str) -> None:
    facts, _ = loaded(server, file, fields=("body_mass",))
    again, _ = loaded(server, file, fields=("body_mass",), digest=facts["digest"])
    assert again["digest"] == facts["digest"]
    Path(file).write_text(SCENE.replace('mass="1"', 'mass="2"'))
    with pytest.raises(ValueError, match="another file"):
        loaded(server, file, fields=("body_mass",), digest=facts["digest"])


def test_a_file_is_loaded_with_edits_and_options(server: Any, file: str) -> None:
    facts, _ = loaded(server, file, {"opt.timestep": np.array(0.01)}, flags={})
    assert server.things[facts["model"]].opt.timestep == 0.01
    flags = {"opt.disableflags": ["mjDSBL_GRAVITY"]}
    facts, _ = loaded(server, file, flags=flags)
    assert server.things[facts["model"]].opt.disableflags == int(GRAVITY)
    facts, _ = loaded(server, file, read={**AS_WRITTEN, "base": "fixed"})
    assert server.things[facts["model"]].nq == 9
    answer, arrays = server.written({"file": file, "text": ""}, {})
    assert 'name="hinge"' in answer["text"]
    assert arrays == {}


def test_who_waits_long_looks_for_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """A message that is there at once leaves the patience; one that came late takes it away."""
    pipe = io.BytesIO()
    for _ in range(3):
        child_server.send(pipe, {}, {})
    pipe.seek(0)
    now = [0.0]
    steps = [0.0]

    def clock() -> float:
        now[0] += steps[0]
        return now[0]

    monkeypatch.setattr(child_server.time, "perf_counter", clock)
    monkeypatch.setattr(child_server.select, "select", lambda *_: ([pipe], [], []))
    assert child_server.receive(pipe, 0.0005)[2] == 0.0005
    steps[0] = 0.0008
    assert child_server.receive(pipe, 0.0005)[2] == pytest.approx(0.0005 + 10e-6)
    steps[0] = 0.0011
    assert child_server.receive(pipe, 0.0005)[2] == pytest.approx(-0.0005)


# A URDF with another base.

URDF = """<robot name="r">{world}<link name="torso"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
JOINT = (
    '<link name="ground"/><joint name="{}" type="{}"><parent link="ground"/><child link="torso"/>'
    '<origin xyz="1 2 3"/></joint>'
)


def compiled(text: str | None) -> mujoco.MjModel:
    """Return the model of a text."""
    assert text is not None
    return mujoco.MjModel.from_xml_string(text)


def test_the_first_link_of_a_urdf_floats(tmp_path: Path) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=""))
    model = compiled(urdf_text(file, base=BaseOfText("torso", "root", is_free=True)))
    assert model.joint(0).name == "root"
    assert model.qpos0.tolist() == [0, 0, 0, 1, 0, 0, 0]


def test_a_link_on_a_fixed_joint_floats_where_it_stands(tmp_path: Path) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=JOINT.format("old", "fixed")))
    model = compiled(urdf_text(file, base=BaseOfText("torso", "root", is_free=True)))
    assert model.qpos0.tolist() == [1, 2, 3, 1, 0, 0, 0]


@pytest.mark.parametrize(
    "quat", [(0.5, 0.1, -0.7, 0.5), (1.0, 0.0, 0.0, 0.0), (2.0, 0.3, 0.2, -0.5)]
)
@pytest.mark.parametrize("world", ["", JOINT.format("old", "fixed")])
def test_a_base_of_a_urdf_starts_where_it_is_put(
    tmp_path: Path, quat: tuple[float, float, float, float], world: str
) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=world))
    base = BaseOfText("torso", "root", True, FreeBase((4.0, 5.0, 6.0), quat))
    model = compiled(urdf_text(file, base=base))
    assert model.qpos0[:3].tolist() == [4, 5, 6]
    unit = np.array(quat) / np.linalg.norm(quat)
    assert matrix_from_quat(model.qpos0[3:]) == pytest.approx(matrix_from_quat(unit))


def test_a_floating_joint_of_a_urdf_is_made_fixed(tmp_path: Path) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=JOINT.format("old", "floating")))
    assert compiled(file.read_text()).nq == 7
    model = compiled(urdf_text(file, base=BaseOfText("torso", "old", is_free=False)))
    assert model.nq == 0


def test_moments_of_a_link_are_written_about_each_axis(tmp_path: Path) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=JOINT.format("old", "floating")))
    options = ReadOptions(balance_inertia=True)
    model = compiled(urdf_text(file, options=options, moments={"torso": 0.25}))
    assert model.body("torso").inertia.tolist() == [0.25] * 3


def test_the_least_mass_of_a_urdf_is_no_less_than_that_of_its_file(tmp_path: Path) -> None:
    for bound, least in (("", 1e-12), ('boundmass="0.5"', 0.5)):
        world = f"<mujoco><compiler {bound}/></mujoco>" + JOINT.format("old", "floating")
        text = URDF.format(world=world).replace('"1"', '"1e-20"')
        file = written(tmp_path / "r.urdf", text)
        model = compiled(urdf_text(file, options=ReadOptions(least_mass=True)))
        assert model.body("torso").mass[0] == least


def test_a_urdf_that_needs_nothing_is_read_as_it_is(tmp_path: Path) -> None:
    file = written(tmp_path / "r.urdf", URDF.format(world=""))
    assert urdf_text(file) is None
    assert urdf_text(written(tmp_path / "r.xml", file.read_text())) is None


def test_a_file_of_another_suffix_is_given_as_text(tmp_path: Path) -> None:
    inner = '<mujoco model="named"><worldbody><geom size="1"/></worldbody></mujoco>'
    model = compiled(text_for(written(tmp_path / "model.txt", inner)))
    assert (model.ngeom, model.names[:5]) == (1, b"named")
    robot_text = text_for(written(tmp_path / "robot.txt", URDF.format(world="")))
    assert compiled(robot_text).nbody >= 1
    with pytest.raises(ValueError, match=r"broken\.txt"):
        text_for(written(tmp_path / "broken.txt", "<mujoco>"))
