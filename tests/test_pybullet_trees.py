"""Trees that float, what ties them and what acts on them: PyBullet against MuJoCo."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
import statemachine.worlds as many
from statemachine.errors import TraceError, UnsupportedError
from statemachine.lab.recordings import files, play, rerun_of_trace
from statemachine.lab.recordings.recorder import record
from statemachine.worlds import make_worlds

from .support.claims import refused, warnings_of
from .support.floating_trees import BASES, CURVES, DRUM, MEDIA, PATH, SUM, TIES, TREE, option
from .support.motions import after, opened
from .support.pybullet_claims import gap, moves_as_on_mujoco
from .support.small_models import (
    REFS,
    TREES,
    both,
    loaded,
)

pytestmark = pytest.mark.usefixtures("bullet")


@pytest.mark.parametrize(
    "integrator", ["implicitfast", pytest.param("Euler", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("tie", TIES)
def test_a_tree_moves_as_on_mujoco(tmp_path: Path, tie: str, base: str, integrator: str) -> None:
    """1e-6 rad or m over 300 steps; 7e-7 was measured, of sites tied in a tree that is dragged."""
    world = TREE.format(base=BASES[base])
    if tie == "held":  # MuJoCo keeps the slope of what acts on a tendon
        world = world.replace('name="a"', 'name="a" actuatorfrcrange="-.03 .03"')
    assert gap(both(tmp_path, world, TIES[tie], option(integrator))) < 1e-6


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("tie", ["weld", "mocap first"])
def test_a_mocap_body_leads_as_on_mujoco(tmp_path: Path, tie: str, base: str) -> None:
    """From where a keyframe has it; what is written acts, and is in a State and in worlds."""
    key = '<keyframe><key mpos=".4 .4 1.1" mquat="1 .2 .2 .1"/></keyframe>'
    world, runs, states = TREE.format(base=BASES[base]), [], []
    for model in both(tmp_path, world, TIES[tie] + key, option("implicitfast")):
        with opened(model, 0) as (_, data), make_worlds(model, 2, workers=1) as worlds:
            rows = [np.r_[data.mocap_pos[0], data.mocap_quat[0], model.keyframes[0].mocap_pos[0]]]
            for k in range(200):
                data.mocap_pos[0, 2] = 1.1 + 0.2 * np.sin(0.05 * k)
                data.mocap_quat = [[1, 0.2, 0.1 * np.sin(0.03 * k), 0.1]]
                sm.step(model, data)
                rows.append(np.r_[data.qpos, data.xpos.ravel(), data.site_xpos.ravel()])
            start = sm.get_state(model, data)
            many.set_state(worlds, 0, start)
            sm.set_state(model, data, start)
            data.mocap_pos[0, 0] = worlds.mocap_pos[0, 0, 0] = 0.5
            sm.step(model, data, 20)
            many.step(worlds, 20)
            assert np.array_equal(data.qpos, worlds.qpos[0])
            runs.append(np.concatenate([*rows, data.qpos, data.site_xmat.ravel()]))
            states.append([*start["mocap_pos"], *start["mocap_quat"]])
            sm.reset(model, data)
            assert data.mocap_pos.tolist() == model.mocap_pos0.tolist() == [[0.4, 0.5, 1]]
    assert states[0] == states[1]
    assert np.abs(runs[0] - runs[1]).max() < 1e-6
    assert np.ptp(runs[0][200:]) > 0.1


def test_a_trace_has_where_mocap_bodies_were(tmp_path: Path) -> None:
    """It is repeated from a file, on the other engine, too, and told as numbers with names."""

    def controller(_model: sm.Model, data: sm.Data) -> None:
        data.mocap_pos[0, 2] = 1 + 0.1 * data.time

    ours, theirs = both(tmp_path, TREE.format(base=""), TIES["weld"], option("Euler"))
    trace = record(ours, controller, 0.2)
    read = files.read(files.write(trace, tmp_path / "run.npz"))
    assert np.array_equal(read["mocap_pos"][:, 0, 2], 1 + 0.1 * read.time)
    for model in (ours, theirs):
        again = rerun_of_trace(read, model).record()
        assert np.abs(again.qpos - trace.qpos).max() < 1e-9
        assert np.array_equal(again["mocap_pos"], read["mocap_pos"])
    assert files.column_labels(read.header, "mocap_quat")[0] == "mocap_quat.0.qw"
    bare = loaded(tmp_path, TREE.format(base="").replace('mocap="true"', ""))
    refused((TraceError, "the trace has 1 mocap bodies, and the model 0", lambda: play(read, bare)))


@pytest.mark.parametrize("kind", ["model", "engine"])
def test_what_a_mocap_body_carries_meets_others(tmp_path: Path, kind: str) -> None:
    """A plate goes up with a box on it, as on MuJoCo; another start leaves no trace."""
    world = (
        '<body mocap="true" pos="0 0 .5"><geom type="box" size=".2 .2 .02"/></body>'
        '<body pos="0 0 .55"><freejoint/><geom type="box" size=".05 .05 .02"/></body>'
    )
    model = loaded(tmp_path, world, backend="pybullet", defaults=kind)
    ends = []
    for key in (None, -5.0):
        with opened(model, mocap_pos=[[0, 0, key or 0.5]], nstep=3) as (_, data):
            sm.reset(model, data)
            for k in range(300):
                data.mocap_pos[0, 2] = 0.5 + 1e-4 * k
                sm.step(model, data)
            assert len(data.contacts) >= 3
            ends.append(data.qpos.copy())
    assert np.array_equal(*ends)
    assert ends[0][2] == pytest.approx(0.57, abs=0.01)


# 6e-7 of joints and 4e-6 of free bodies, whose integrators differ, were measured.
@pytest.mark.parametrize(("text", "most"), [(REFS, 1e-9), (TREES, 2e-5)], ids=["zeros", "zoo"])
def test_a_file_moves_as_on_mujoco(tmp_path: Path, text: str, most: float) -> None:
    """One with a bit of everything; and one whose joints are not at 0 in the file's pose."""
    moves_as_on_mujoco(tmp_path, text, most)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("medium", [*MEDIA, ""])
def test_what_acts_on_each_body(tmp_path: Path, medium: str, base: str) -> None:
    """Drag of a medium that is still or moves, and compensation of gravity."""
    world = TREE.format(base=BASES[base]) + (
        '<body name="stone" pos="1 1 1"><freejoint/>'
        '<inertial mass="1" pos=".1 0 0" diaginertia=".01 .012 .013"/></body>'
    )
    if not medium:
        for name, part in (("lower", 0.7), ("base", 0.3), ("stone", 1)):
            world = world.replace(f'name="{name}"', f'name="{name}" gravcomp="{part}"')
    models = both(tmp_path, world, "", option("implicitfast", medium))
    assert gap(models) < 1e-6
    raw = models[0].compiled
    assert raw.ngravcomp or raw.opt.density or raw.opt.viscosity


@pytest.mark.parametrize("base", ["fixed", "floating"])
# MuJoCo would have the masses written out; to say how much all weigh is what the test is about.
@pytest.mark.filterwarnings(
    "ignore:.*settotalmass. is deprecated:statemachine.errors.EngineWarning"
)
def test_the_mass_of_a_base_does_not_count_in_a_tree_of_milligrams(
    tmp_path: Path, base: str
) -> None:
    """What the engine's base weighs does not count, whatever the tree weighs."""
    laws = r'(armature|damping|stiffness|frictionloss)="[^"]*"'
    world = re.sub(laws, "", TREE.format(base=BASES[base]))
    rest = '<compiler settotalmass="1e-6"/><actuator><motor joint="a" gear="1e-8"/></actuator>'
    assert gap(both(tmp_path, world, rest, option("Euler"))) < 1e-6


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_a_tree_of_as_many_joints_as_there_is_room_for(tmp_path: Path, base: str) -> None:
    """119 and the link of the base: bodies with two joints have two links."""
    body = '<body pos=".02 0 .01"><joint axis="0 1 {}" damping=".1"/>{}<geom size=".02"/>'
    slide = '<joint type="slide" stiffness="90" damping="3"/>'
    rows = [body.format(k % 2, slide if k % 2 else "") for k in range(79)]
    world = f'<body>{BASES[base]}<geom size=".1"/><site/>{"".join(rows)}{"</body>" * 80}'
    models = both(tmp_path, world, "", option("Euler", 'gravity="0 2 -3"'), contacts=False)
    assert (models[0].nv - 6 * (base == "floating")) == 118
    assert gap(models) < 1e-6


@pytest.mark.parametrize("integrator", ["implicitfast", "Euler"])
def test_what_cannot_bend_feels_its_spin(tmp_path: Path, integrator: str) -> None:
    """MuJoCo's implicitfast takes the gyroscopic force of one rigid tree at the end of a step."""
    inertia = '<inertial pos=".1 .05 .02" quat="1 .2 .3 .4" mass="1" diaginertia=".01 .006 .009"/>'
    world = f'<body><freejoint/>{inertia}<body pos=".1 .2 0">{inertia}</body></body>'
    models = both(tmp_path, world, option=option(integrator, 'density="100"'))
    ends = [after(model, 200, qvel=[0.3, 0.2, -0.5, 9, -12, 7]) for model in models]
    assert np.ptp(ends, axis=0).max() < 1e-7


PAIRED = """<geom name="floor" type="plane" size="3 3 .1" contype="0" conaffinity="0"/>
<body name="two" pos="0 0 .3"><freejoint/><geom name="low" size=".1" pos="0 0 -.1" mass="1" {low}/>
<geom name="wide" type="box" size=".3 .3 .1" pos="0 0 .1" mass="1" {wide}/></body>"""
HIDDEN, MASKED = 'contype="0" conaffinity="0"', 'contype="2" conaffinity="2"'


@pytest.mark.parametrize(
    ("low", "wide", "floor", "rest", "height"),
    [
        (HIDDEN, HIDDEN, "", '<contact><pair geom1="low" geom2="floor"/></contact>', 0.2),
        (HIDDEN, HIDDEN, "", '<contact><pair geom1="floor" geom2="wide"/></contact>', 0.0),
        ("", MASKED, 'contype="2" conaffinity="2"', "", 0.0),
        ("", MASKED, 'contype="1" conaffinity="1"', "", 0.2),
    ],
)
def test_geoms_of_one_body_meet_different_things(
    tmp_path: Path, low: str, wide: str, floor: str, rest: str, height: float
) -> None:
    """A body rests on the geom that a pair names, or that the masks let meet the floor."""
    world = PAIRED.format(low=low, wide=wide)
    if floor:
        world = world.replace('contype="0" conaffinity="0"/>', f"{floor}/>", 1)
    for model in both(tmp_path, world, rest, option("implicitfast")):
        with opened(model, nstep=1000) as (_, data):
            assert data.qpos[2] == pytest.approx(height, abs=2e-3)
            names = {model.compiled.geom(int(g)).name for g in np.ravel(data.contacts.geom)}
            assert names == {"floor", "low" if height else "wide"}


def test_a_state_carries_activations(tmp_path: Path) -> None:
    """They act on, in a State, over a write to qpos, and in worlds."""
    model = both(tmp_path, TREE.format(base=""), TIES["filters"], option("Euler"))[1]
    with sm.make_data(model) as data, sm.make_data(model) as other:
        data.ctrl[:] = other.ctrl[:] = 1.0
        sm.step(model, data, 50)
        state = sm.get_state(model, data)
        assert np.abs(state["act"]).min() > 0.1
        sm.set_state(model, other, state)
        for run in (data, other):
            run.qpos[0] += 0.01
            sm.step(model, run, 20)
        assert np.array_equal(data.qpos, other.qpos)
        assert (sm.get_state(model, data)["act"] != state["act"]).any()
        sm.reset(model, data)
        assert not sm.get_state(model, data)["act"].any()


def test_a_keyframe_has_activations(tmp_path: Path) -> None:
    key = '<keyframe><key qpos="0 0 0 0" act=".1 .2 .3 .4"/></keyframe>'
    models = both(tmp_path, TREE.format(base=""), TIES["filters"] + key, option("Euler"))
    assert np.ptp([after(model, 20, keyframe=0) for model in models], axis=0).max() < 1e-9


LED = '<body name="x"><joint name="x"/><geom size=".1"/></body>'
REFUSED = {
    "armature of a spatial tendon: tendon number 0 has it": (
        "", f'<tendon><spatial armature=".1">{PATH.replace(DRUM, "")}',
    ),
    "actuator gain: actuator number 0 has one": (
        "", f'<actuator><general joint="a" gaintype="muscle" {CURVES} '
        'lengthrange="-1 1"/></actuator>',
    ),
    "a joint on a mocap body: body x has it": (
        f'<body mocap="true"><geom size=".1"/>{LED}</body>', "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("says", REFUSED)
def test_what_no_single_tree_can_do_is_refused(tmp_path: Path, says: str) -> None:
    world, rest = REFUSED[says]
    world = world if world else TREE.format(base="")
    loaded(tmp_path, world, rest)
    refused((UnsupportedError, says, lambda: loaded(tmp_path, world, rest, backend="pybullet")))


@pytest.mark.parametrize("tie", ["joints", "spring", "motor", "filters"])
def test_as_it_comes_the_engine_has_no_law(tmp_path: Path, tie: str) -> None:
    world = TREE.format(base="<freejoint/>")
    load = partial(loaded, tmp_path, world, TIES[tie], backend="pybullet", defaults="engine")
    refused((UnsupportedError, "the engine as it comes has none", load))


def test_a_tree_floats_on_the_engine_as_it_comes(tmp_path: Path) -> None:
    """It falls, by the law of its own, as MuJoCo's does in a vacuum; and tells where it is."""
    world = TREE.format(base="<freejoint/>").replace("damping", "user")
    settings = {"backend": "pybullet", "defaults": "engine", "gravity": (0, 0, -9.81)}
    with opened(loaded(tmp_path, world, timestep=0.002, **settings), nstep=100) as (model, data):
        assert data.qpos[2] - 1 == pytest.approx(-0.5 * 9.81 * 0.2**2, rel=0.05)
        sm.forward(model, data)
        assert data.xpos[1] == pytest.approx(data.qpos[:3])
        assert np.isfinite(data.qfrc_bias).all()


def test_mujoco_has_room_for_pairs_that_carry_each_other_only(tmp_path: Path) -> None:
    """Of two branches, a tendon's armature adds to each, and nothing between them."""
    masses = []
    for tie in ("armature", "spring"):
        raw = loaded(tmp_path, TREE.format(base=""), TIES[tie]).compiled
        data, mass = mujoco.MjData(raw), np.zeros((raw.nv, raw.nv))
        mujoco.mj_forward(raw, data)
        mujoco.mj_fullM(raw, data, mass)
        masses.append(mass[np.ix_((0, 3), (0, 3))])
    (first, between), (_, second) = masses[0] - masses[1]
    assert (first, second) == pytest.approx((0.02, 0.02 * 0.7**2))
    assert between == 0


OFF_GROUP = '<actuator><general joint="a" dyntype="filter" dynprm=".1" group="3"/></actuator>'
TOUCHING = (
    '<geom name="p" size=".1" {geom}/><body><freejoint/><geom name="q" size=".1" mass="1"/></body>'
)
PAIR = '<contact><pair geom1="p" geom2="q" {}/></contact>'
# What a file asks for, behind a tree or as geoms, and what is said of it; nothing of the last one.
TOLD = {
    "springyield of a tendon": ("", f'<tendon><fixed stiffness="3" springyield="9">{SUM}</tendon>'),
    "diagexact": ("", '<option><flag diagexact="enable"/></option>'),
    "adhesion": ('adhesion="1"', ""),
    "an actuator of adhesion": (
        "",
        '<actuator><adhesion body="lower" ctrlrange="0 1"/></actuator>',
    ),
    "the margin of a pair": (" ", PAIR.format('margin=".05"')),
    "the second friction of a pair": (" ", PAIR.format('friction="1 .5 .005 .0001 .0001"')),
    "solref, solimp or solreffriction of a pair": (" ", PAIR.format('solref=".1 1"')),
    "nothing": (" ", PAIR.format("")),
}


@pytest.mark.parametrize("setting", TOLD)
def test_what_has_no_effect_is_told(tmp_path: Path, setting: str) -> None:
    geom, rest = TOLD[setting]
    world = TOUCHING.format(geom=geom) if geom else TREE.format(base="")
    _, told = warnings_of(lambda: loaded(tmp_path, world, rest, backend="pybullet"))
    assert (f"{setting} has no effect" in told) == (setting != "nothing")
    assert ("has no effect" in told) == (setting != "nothing")


def test_an_activation_that_is_off_stays_as_it_was(tmp_path: Path) -> None:
    rest = f'{OFF_GROUP}<keyframe><key qpos="0 0 0 0" act=".4"/></keyframe>'
    off = {"option": '<option actuatorgroupdisable="3"/>', "backend": "pybullet"}
    with opened(loaded(tmp_path, TREE.format(base=""), rest, **off), 0, nstep=3) as (model, data):
        assert sm.get_state(model, data)["act"].tolist() == [0.4]


def test_gravity_is_turned_back_when_a_step_is_interrupted(tmp_path: Path) -> None:
    """The copy whose dynamics are asked is that of all Data of a Model."""
    from statemachine.backends.bullet import world

    model: Any = loaded(tmp_path, TREE.format(base="<freejoint/>"), backend="pybullet")
    with (
        sm.make_data(model) as data,
        sm.make_data(model) as other,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(world.pb, "calculateInverseDynamics", lambda *_: 1 / 0)
        refused((ZeroDivisionError, "", lambda: sm.step(model, data)))
        patch.undo()
        sm.step(model, other)
        sm.step(model, data)
        assert np.array_equal(data.qvel, other.qvel)
        gravity = model.shared_worlds["still copy"].client
        assert world.pb.getPhysicsEngineParameters(gravity)["gravityAccelerationZ"] == -9.81
