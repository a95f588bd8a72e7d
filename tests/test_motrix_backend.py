"""MotrixSim behind the contract: what it reads itself, and the facts that the backend rests on."""

from __future__ import annotations

import copy
import os
import pickle
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import conformance, installed
from statemachine.engines import raw_engine_of
from statemachine.errors import (
    BadInputError,
    DivergedError,
    EngineWarning,
    MissingEngineError,
    ModelError,
    UnsupportedError,
)
from statemachine.interface import FORCES, PARTS, POSES, Array
from statemachine.processes.parallel import forks_for
from statemachine.processes.stderr_capture import stderr_capture
from statemachine.rotations import xyzw_from_wxyz

from .support.claims import assert_has, assert_in, refused, warnings_of
from .support.files import written
from .support.motions import after, opened, path
from .support.processes import in_its_own_python
from .support.requirements import ROOT, need_engine
from .support.small_models import mjcf

HOLD = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)
SINGLE = 2e-6  # what single precision leaves of a pose of the arm [m, and 1]


@pytest.fixture(scope="module", autouse=True)
def motrix() -> Any:
    """MotrixSim itself; without it no test of this file runs."""
    need_engine("motrix")
    return installed.require("motrix")


def load(name: str | Path, **options: Any) -> sm.Model:
    """Load a model on MotrixSim, without what it says of the file."""
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return sm.load(name, backend="motrix", **options)


def small(folder: Path, worldbody: str, rest: str = "", option: str = "", **options: Any) -> Any:
    """Load a small model on MotrixSim."""
    return load(written(folder / "m.xml", mjcf(worldbody, rest, option)), **options)


@pytest.fixture(scope="module")
def box() -> sm.Model:
    return load("so101/scene_box")


@pytest.fixture(scope="module")
def arm() -> sm.Model:
    return load("so101")


@pytest.fixture
def held(box: sm.Model) -> Iterator[sm.Data]:
    """A Data in which the jaws squeeze the box while the arm turns: in the middle of contact."""
    with opened(box, 0) as (_, data):
        data.ctrl[0] += 0.3
        sm.step(box, data, 25)
        yield data


def gap(left: Any, right: Any) -> float:
    """Return the largest difference of two arrays."""
    return float(np.abs(np.asarray(left, float) - np.asarray(right, float)).max())


# The contract


@pytest.mark.slow
def test_51_checks_of_the_contract_pass_and_7_are_of_forces_that_it_does_not_tell() -> None:
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        outcomes = conformance.run("motrix")
    assert [outcome for outcome in outcomes if outcome.result == "failed"] == []
    assert Counter(outcome.result for outcome in outcomes) == {"passed": 51, "skipped": 7}
    skipped = [outcome.detail for outcome in outcomes if outcome.result == "skipped"]
    assert all("'forces by part'" in detail for detail in skipped)


def test_only_this_is_unsupported(arm: sm.Model) -> None:
    record = arm.capabilities
    lacking = {
        n for n, behaviour in record.behaviours.items() if behaviour.support == "unsupported"
    }
    assert lacking == {"forces by part", "exact restore"}
    assert set(sm.interface.OPTIONS) - set(record.options) == {"integrator"}
    assert (record.precision, record.rounding) == ("float32", 1e-6)


@pytest.mark.parametrize("name", [*FORCES, *PARTS])
def test_a_force_that_it_does_not_tell_is_refused(held: sm.Data, name: str) -> None:
    error = refused((UnsupportedError, "forces by part", lambda: getattr(held, name)))
    assert_has(error, backend="motrix", feature="forces by part")


@pytest.mark.parametrize(
    "options", [{"base": "free"}, {"balance_inertia": True}, {"meshes": False}]
)
def test_options_of_its_reader_are_refused(options: dict[str, Any]) -> None:
    refused((UnsupportedError, "it reads files in its own way", lambda: load("so101", **options)))


def test_an_integrator_is_refused_for_it_has_one_of_its_own(arm: sm.Model) -> None:
    refused((UnsupportedError, "one of its own", lambda: arm.replace(integrator="euler")))


def test_activations_are_refused_for_they_cannot_be_restored(tmp_path: Path) -> None:
    body = '<body><joint name="j"/><geom size="1"/></body>'
    rest = '<actuator><general joint="j" dyntype="filter" dynprm="1"/></actuator>'
    error = refused((UnsupportedError, "neither read nor set", lambda: small(tmp_path, body, rest)))
    assert_has(error, feature="activation")


def test_a_binary_model_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.mjb"
    installed.require("mujoco").mj_saveModel(sm.load("so101").raw, str(file), None)
    refused((ModelError, "wants its XML", lambda: load(file, trust_binary=True)))


def test_its_absence_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "motrixsim", None)
    error = refused(
        (MissingEngineError, r"install .*\[motrix\]", lambda: installed.require("motrix"))
    )
    assert error.engine == "motrix"


# What it reads


def test_what_it_ignores_is_said_at_load() -> None:
    _, told = warnings_of(lambda: sm.load("so101", backend="motrix"))
    assert_in(told, "option cone", "option impratio", "option integrator", "option ls_iterations")
    assert "material" not in told


@pytest.mark.parametrize(("radius", "half", "times"), [(0.05, 0.25, 5.7), (0.01, 0.5, 6.86)])
def test_what_it_reads_as_another_number_is_said_and_is_the_model_s(
    tmp_path: Path, radius: float, half: float, times: float
) -> None:
    """The inertia of a capsule is not its closed form, which MuJoCo has: it is some 5.7 times."""
    text = mjcf(
        f'<body name="c"><joint name="j" axis="0 1 0"/><geom type="capsule" mass="1" '
        f'size="{radius} {half}"/></body>'
    )
    file = written(tmp_path / "m.xml", text)
    model, told = warnings_of(lambda: sm.load(file, backend="motrix"))
    assert "inertia of c" in told
    ball, tube = 4 / 3 * np.pi * radius**3, 2 * np.pi * radius**2 * half
    ball, tube = ball / (ball + tube), tube / (ball + tube)  # masses of the ends, of the middle
    across = tube * (radius**2 / 4 + half**2 / 3)
    across += ball * (0.4 * radius**2 + half**2 + 3 / 4 * radius * half)
    assert sm.load(file).compiled.body_inertia[1].max() == pytest.approx(across, rel=1e-6)
    assert model.compiled.body_inertia[1].max() / across == pytest.approx(times, abs=0.05)


def test_mujoco_with_the_numbers_that_it_reads_follows_it(tmp_path: Path) -> None:
    """So these numbers, and not MuJoCo's own of the file, are what MotrixSim runs."""
    text = mjcf(
        '<body><joint axis="0 1 0" damping="0.02"/><geom type="capsule" mass="1" '
        'fromto="0 0 0 0.5 0 0" size="0.04"/></body>',
        option='<option timestep="0.001" integrator="implicitfast"/>',
    )
    file = written(tmp_path / "m.xml", text)
    model, mujoco = load(file), sm.load(file)
    swing = after(model, 400)
    assert gap(swing, after(mujoco.with_compiled(model.compiled), 400)) < 2e-3
    assert gap(swing, after(mujoco, 400)) > 0.3


def test_its_reader_says_why_it_cannot_read_a_file(tmp_path: Path) -> None:
    text = mjcf('<body><joint/><geom size="1"/><site type="ellipsoid" size="1 1 1"/></body>')
    refused(
        (
            ModelError,
            "MotrixSim cannot read .*ellipsoid",
            lambda: load(written(tmp_path / "m.xml", text)),
        )
    )


def test_nothing_that_it_writes_reaches_the_terminal() -> None:
    done = in_its_own_python(
        "import warnings, statemachine as sm\n"
        "warnings.simplefilter('ignore')\n"
        "model = sm.load('so101/scene_box', backend='motrix')\n"
        "data = sm.make_data(model)\n"
        "sm.step(model, data, 5)\n"
        "data.qvel[:] = 1e7\n"
        "try: sm.step(model.replace(max_qvel=1e9), data)\n"
        "except Exception as error: pass\n",
        ROOT,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_what_is_written_to_descriptor_2_is_caught(capfd: pytest.CaptureFixture[str]) -> None:
    with stderr_capture() as lines:
        os.write(2, b"one\ntwo\n")
    os.write(2, b"seen\n")
    assert lines == ["one", "two"]
    assert capfd.readouterr().err == "seen\n"


def test_its_commands_without_edits_are_its_own_to_the_bit(box: sm.Model, motrix: Any) -> None:
    scene = motrix.SceneData
    with opened(box, ctrl=HOLD) as (_, data):
        own = scene(box.raw)
        own.set_dof_pos(own.dof_pos, box.raw)
        own.actuator_ctrls = np.array(HOLD, np.float32)
        for _ in range(100):
            box.raw.step(own)
        sm.step(box, data, 100)
        assert np.array_equal(data.raw.dof_pos, own.dof_pos)


def test_elements_without_names_are_found_by_their_order(tmp_path: Path) -> None:
    """Joints of three kinds, a free body, and sites, none of them named."""
    worldbody = (
        '<site pos="0 0 3"/><body pos="0 0 1"><joint axis="0 1 0"/><joint type="slide"/>'
        '<geom size=".1"/><site pos=".2 0 0"/><body pos="0 0 .4"><joint type="ball"/>'
        '<geom size=".1"/></body></body>'
        '<body pos="2 0 1"><freejoint/><geom size=".1"/><site pos="0 .3 0"/></body>'
    )
    model = small(tmp_path, worldbody)
    mujoco = sm.load(model.path)
    qpos = np.array([0.3, 0.1, *_unit(1, 2, 3, 4), 2, 0.5, 1, *_unit(1, -1, 0.5, 0.2)])
    one, other = (_poses(each, qpos) for each in (model, mujoco))
    for name, poses in one.items():
        assert gap(poses, other[name]) < SINGLE, name


def _poses(model: sm.Model, qpos: Array) -> dict[str, Array]:
    """Return the poses that follow from qpos, by name."""
    with opened(model, qpos=qpos, derived=True) as (_, data):
        return {name: np.array(getattr(data, name)) for name in POSES}


def _unit(*numbers: float) -> Array:
    return np.array(numbers) / np.linalg.norm(numbers)


def test_a_body_that_is_led_is_where_it_is_put(tmp_path: Path) -> None:
    worldbody = (
        '<body name="led" mocap="true" pos="1 0 0"><geom size=".1"/></body>'
        '<body pos="5 0 0"><joint/><geom size=".1"/></body>'
    )
    model = small(tmp_path, worldbody)
    with opened(model) as (_, data):
        data.mocap_pos[0], data.mocap_quat[0] = (0.2, 0.3, 0.4), _unit(1, 2, 3, 4)
        sm.forward(model, data)
        assert gap(data.xpos[1], (0.2, 0.3, 0.4)) < SINGLE
        assert gap(data.xquat[1], _unit(1, 2, 3, 4)) < SINGLE


def test_a_urdf_s_fixed_links_are_sites() -> None:
    model, mujoco = load("models/so101/so101.urdf"), sm.load("models/so101/so101.urdf")
    assert model.site_names == mujoco.site_names != ()
    qpos = np.linspace(-0.5, 0.5, model.nq)
    one, other = (_poses(each, qpos) for each in (model, mujoco))
    for name, poses in one.items():
        assert gap(poses, other[name]) < SINGLE, name


# Its conventions


def test_a_quaternion_of_ours_is_x_y_z_w_there(box: sm.Model) -> None:
    quat = _unit(0.5, -0.1, 0.7, 0.5)
    with opened(box) as (_, data):
        data.qpos[9:13] = quat
        sm.step(box, data)
        assert gap(data.raw.dof_pos[9:13], xyzw_from_wxyz(quat)) < 0.01
        assert gap(data.qpos[9:13], quat) < 0.01


def test_poses_are_of_before_a_write_and_a_step(motrix: Any, arm: sm.Model) -> None:
    """Of the engine alone: `forward_kinematic` makes them of now."""
    scene, data = arm.raw, motrix.SceneData(arm.raw)

    def pose() -> Array:
        return np.array(scene.sites[1].get_pose(data))

    scene.forward_kinematic(data)
    start = pose()
    data.set_dof_pos(np.array(HOLD, np.float32), scene)
    assert np.array_equal(pose(), start)
    scene.forward_kinematic(data)
    written_pose = pose()
    assert gap(written_pose, start) > 0.1
    scene.step(data)
    assert np.array_equal(pose(), written_pose)
    scene.forward_kinematic(data)
    assert gap(pose(), written_pose) > 1e-6


def test_its_switch_for_actuators_is_without_effect(motrix: Any) -> None:
    """So `actuation=False` takes them out."""

    def lift(edit: Callable[[Any], object]) -> float:
        with stderr_capture():
            world = motrix.msd.from_file(str(ROOT / "models/so101/scene.xml"))
            edit(world)
            scene = world.build()
        data = motrix.SceneData(scene)
        scene.step_n(data, 60)
        return float(data.dof_pos[1])

    assert lift(lambda world: setattr(world.simulate_option, "disable_actuators", True)) < 0.001
    assert lift(lambda world: setattr(world, "actuators", [])) > 0.05


def test_a_file_that_switches_actuation_off_is_told_that_it_is_on(tmp_path: Path) -> None:
    text = mjcf(
        '<body><joint name="j"/><geom size=".1"/></body>',
        '<actuator><motor joint="j"/></actuator>',
        '<option><flag actuation="disable"/></option>',
    )
    file = written(tmp_path / "m.xml", text)
    model, told = warnings_of(lambda: sm.load(file, backend="motrix"))
    assert "flag ACTUATION" in told
    assert after(model, 10, ctrl=[1.0])[0] > 0
    assert after(model.replace(actuation=False), 10, ctrl=[1.0])[0] == 0


# Replay and restore


def test_two_runs_have_the_same_bits(box: sm.Model) -> None:
    first, second = (path(box, 300, 0, ctrl=HOLD) for _ in range(2))
    assert np.array_equal(first, second)


def _future(scene: Any, data: Any, steps: int = 100) -> Array:
    rows = []
    for _ in range(steps):
        scene.step(data)
        rows.append(np.array(data.dof_pos))
    return np.array(rows)


@pytest.mark.parametrize(("fresh", "within"), [(False, 5e-9), (True, 2e-6)])
def test_restored_where_a_box_lies_it_is_nearer_in_the_same_data(
    motrix: Any, box: sm.Model, fresh: bool, within: float
) -> None:
    """Of the engine alone: a fresh SceneData does not know what the solver started from."""
    with opened(box, nstep=300) as (_, data):
        assert _restored(motrix, data, fresh) <= within


def test_restored_in_a_grasp_it_is_another_future(motrix: Any, held: sm.Data) -> None:
    """Of the engine alone: so exact restore is unsupported."""
    assert _restored(motrix, held, fresh=True) > 1e-4


def _restored(motrix: Any, held: sm.Data, fresh: bool) -> float:
    """Return how far positions and velocities lead that were written back [rad]."""
    scene, data = held.model.raw, held.raw
    state = data.dof_pos.copy(), data.dof_vel.copy(), data.actuator_ctrls.copy()
    first = _future(scene, data)
    target = motrix.SceneData(scene) if fresh else data
    target.low.set_dof_positions_unchecked(state[0])
    target.set_dof_vel(state[1])
    target.actuator_ctrls = state[2]
    return gap(_future(scene, target)[:, :6], first[:, :6])


@pytest.mark.parametrize("nstep", [15, 25, 45, 95])
def test_a_state_restored_without_contacts_leads_where_its_run_leads(
    arm: sm.Model, nstep: int
) -> None:
    with opened(arm, ctrl=HOLD, nstep=nstep) as (_, data):
        state = sm.get_state(arm, data)
        going_on = _steps(arm, data)
        sm.set_state(arm, data, state)
        assert gap(_steps(arm, data), going_on) <= 2e-6


def test_a_restored_state_has_one_future_in_any_data(box: sm.Model, held: sm.Data) -> None:
    state = sm.get_state(box, held)
    sm.step(box, held, 20)
    sm.set_state(box, held, state)
    again = _steps(box, held)
    with opened(box) as (_, other):
        sm.set_state(box, other, state)
        assert np.array_equal(_steps(box, other), again)


def _steps(model: sm.Model, data: sm.Data, steps: int = 100) -> Array:
    rows = []
    for _ in range(steps):
        sm.step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def test_a_pickled_model_runs_alike(box: sm.Model) -> None:
    heavy = box.replace(kp=500.0, mass=2 * box.body_mass)
    again = pickle.loads(pickle.dumps(heavy))
    assert again.options.keys() == heavy.options.keys()
    assert np.array_equal(again.actuator_kp, heavy.actuator_kp)
    assert np.array_equal(after(again, 50, 0), after(heavy, 50, 0))


# Bad input, and divergence


@pytest.mark.parametrize("name", ["qpos", "qvel", "ctrl"])
def test_a_nan_is_refused_before_it_reaches_the_engine(box: sm.Model, name: str) -> None:
    with opened(box) as (_, data):
        getattr(data, name)[1] = np.nan
        refused((BadInputError, r"\[1\]", lambda: sm.step(box, data)))


def test_a_nan_is_a_panic_there_which_no_except_clause_for_errors_catches(
    motrix: Any, arm: sm.Model
) -> None:
    data = motrix.SceneData(arm.raw)
    data.actuator_ctrls = np.array([0, np.nan, 0, 0, 0, 0], np.float32)
    with stderr_capture() as lines, pytest.raises(BaseException, match="beta") as caught:
        arm.raw.step(data)
    assert not isinstance(caught.value, Exception)
    assert any("panicked" in line for line in lines)


def test_a_panic_is_a_divergence_that_names_a_coordinate(
    box: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which comes only where a step is taken from what has diverged: nobody looks between them."""
    place = "statemachine.backends.motrix.world.MotrixWorld.diverging"
    monkeypatch.setattr(place, lambda *_: False)
    model = box.replace(max_qvel=1e10)
    with opened(model) as (_, data):
        data.qvel[4] = 9e9
        with stderr_capture() as lines:
            error = refused((DivergedError, "", lambda: sm.step(model, data, 5)))
        assert lines == []
        assert error.index is not None
        refused((DivergedError, "not usable", lambda: sm.step(model, data)))
        sm.reset(model, data)
        sm.step(model, data, 10)
        assert np.isfinite(data.qpos).all()


def test_what_is_too_fast_is_a_divergence(arm: sm.Model) -> None:
    with opened(arm) as (_, data):
        data.qvel[2] = 1e7
        refused((DivergedError, r"qvel\[", lambda: sm.step(arm, data, 20)))


FORKED = """
import os, warnings
import statemachine as sm
from statemachine.errors import EngineError

warnings.simplefilter("ignore")
model = sm.load("so101", backend="motrix")
data = sm.make_data(model)
child = os.fork()
if not child:
    try:
        sm.step(model, data)
    except EngineError as error:
        os._exit("threads" not in str(error))
    os._exit(2)
assert os.waitpid(child, 0)[1] == 0
"""


def test_its_runs_are_not_shared_among_forks() -> None:
    assert not raw_engine_of("motrix").survives_fork
    assert forks_for(10, 1.0, 2, can_fork=False) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_a_fork_of_a_process_that_has_loaded_a_model_is_an_error_and_nothing_hangs() -> None:
    done = in_its_own_python(FORKED, ROOT)
    assert (done.returncode, done.stderr) == (0, "")


# Against MuJoCo


def _hold(name: str, backend: str, **options: Any) -> Array:
    model = load(name, **options) if backend == "motrix" else sm.load(name, **options)
    return np.degrees(path(model, 400, ctrl=HOLD)[:, :6])


@pytest.mark.parametrize(
    ("name", "least", "most"), [("so101", 0.01, 0.2), ("so101/scene", 2.5, 3.7)]
)
def test_hold_is_near_mujoco_in_the_air_and_3_degrees_from_it_on_the_floor(
    name: str, least: float, most: float
) -> None:
    assert least < gap(_hold(name, "motrix"), _hold(name, "mujoco")) < most


def test_contacts_have_places_and_forces_of_its_own_sensors(box: sm.Model) -> None:
    with opened(box, nstep=300, derived=True) as (_, data):
        contacts = data.contacts
        assert len(contacts) == 4
        pairs = {tuple(sorted(pair)) for pair in contacts.geom.tolist()}
        assert pairs == {(box.geom_id("floor"), box.geom_id("box"))}
        total = np.einsum("nij,ni->j", contacts.frame, contacts.force)
        assert gap(total, (0, 0, 0.096 * 9.81)) < 0.01
        assert gap(contacts.pos[:, 2], 0) < 0.001
        assert gap(np.abs(contacts.pos[:, :2] - (0.5, 0)), (0.02, 0.02)) < 0.001


def test_contacts_are_told_though_geoms_appear_that_never_touched(box: sm.Model) -> None:
    fallen = box.replace(actuation=False)
    with opened(fallen, nstep=5, derived=True) as (_, data):
        before = len(data.contacts)
        sm.step(fallen, data, 400)
        sm.forward(fallen, data)
        assert len(data.contacts) > before


# Options


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("armature", 0.2),
        ("damping", 5.0),
        ("frictionloss", 2.0),
        ("gravity", [0.0, 9.81, 0.0]),
        ("kp", 100.0),
        ("kv", 20.0),
    ],
)
def test_an_option_acts_as_in_mujoco(option: str, value: Any) -> None:
    """In the air, where both agree to a part of a degree: and each option moves it by more."""
    plain, varied = (
        [_swing(backend, **options) for backend in ("motrix", "mujoco")]
        for options in ({}, {option: value})
    )
    assert gap(*varied) < 0.3
    assert gap(plain[0], varied[0]) > 0.5


def _swing(backend: str, **options: Any) -> Array:
    model = (load("so101") if backend == "motrix" else sm.load("so101")).replace(**options)
    with opened(model, ctrl=HOLD) as (_, data):
        rows = [data.qpos.copy()]
        while data.time < 0.4 - 1e-9:
            sm.step(model, data)
            rows.append(data.qpos.copy())
    return np.degrees(np.array(rows[-1]))


def test_a_timestep_is_taken(arm: sm.Model) -> None:
    with opened(arm.replace(timestep=0.002), nstep=10) as (_, data):
        assert data.time == pytest.approx(0.02)
    assert arm.replace(timestep=0.002).raw.options.timestep == pytest.approx(0.002)


def test_contacts_can_be_switched_off(box: sm.Model) -> None:
    start = int(box.jnt_qposadr[box.joint_id("box")])
    assert after(box, 100)[start + 2] > 0.029
    assert after(box.replace(contacts=False), 100)[start + 2] < -1


def test_a_model_without_a_joint_is_refused_for_it_cannot_step_one(tmp_path: Path) -> None:
    refused((UnsupportedError, "without joints", lambda: small(tmp_path, '<geom size="1"/>')))


def test_limits_can_be_switched_off(tmp_path: Path) -> None:
    body = (
        '<body><joint axis="0 1 0" range="-0.1 0.1" limited="true"/>'
        '<geom size=".05" pos=".3 0 0" mass="1"/></body>'
    )
    model = small(tmp_path, body, option='<compiler angle="radian"/>')
    assert after(model, 200)[0] < 0.15
    assert after(model.replace(limits=False), 200)[0] > 0.5


def test_a_field_that_it_does_not_take_is_refused_by_name(arm: sm.Model) -> None:
    compiled = copy.copy(arm.compiled)
    compiled.geom_size[5] *= 2
    error = refused((UnsupportedError, "geom_size", lambda: arm.with_compiled(compiled)))
    assert_has(error, backend="motrix", feature="geom_size")


def test_replace_leaves_the_model_as_it_was(arm: sm.Model) -> None:
    before = after(arm, 50, ctrl=HOLD)
    arm.replace(kp=10.0, damping=3.0, actuation=False)
    assert np.array_equal(after(arm, 50, ctrl=HOLD), before)
