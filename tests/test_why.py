"""`statemachine compare --why`: causes that are known must be found, and no others."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import statemachine as sm
from statemachine import backends
from statemachine.compare.why import FACTORS, Attribution, attribute
from statemachine.errors import BadInputError, DivergedError, EngineWarning, UnknownNameError
from statemachine.interface import Model
from statemachine.report import terminal
from statemachine.report import why as report
from statemachine.report.as_json import dumps
from statemachine.runs import record_scenario
from statemachine.runs.scenarios import Scenario, scenario

from .conftest import ROOT, Cli, need_engine, one_line, registered, written

HOLD = replace(scenario("hold"), seconds=0.6)  # long enough to touch the floor
FALL = replace(scenario("fall"), seconds=5.0)  # and to meet a limit
BOX = replace(scenario("box"), seconds=0.5)


@pytest.fixture
def arm() -> Model:
    return sm.load("so101/scene")


def edited(model: Model, **arrays: Any) -> Model:
    """A MuJoCo Model with other numbers in its compiled model."""
    made = model.replace()
    for name, value in arrays.items():
        getattr(made.raw, name)[:] = value
    return made.replace()  # so that what the Model tells follows


def rendered(page: Any) -> str:
    """A page as a terminal of 80 columns shows it."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        terminal.show(page)
    return said.getvalue()


def by_name(trials: Any) -> dict[str, Any]:
    return {trial.factor: trial for trial in trials}


def doubled(model: Model) -> dict[str, Any]:
    gain, bias = model.raw.actuator_gainprm.copy(), model.raw.actuator_biasprm.copy()
    gain[:, 0] *= 2
    bias[:, 1] *= 2
    return {"actuator_gainprm": gain, "actuator_biasprm": bias}


SEEDED = {
    "gravity": (HOLD, lambda m: m.replace(gravity=[0, 0, -9.0])),
    "timestep": (HOLD, lambda m: m.replace(timestep=m.timestep / 2)),
    "timestep, substeps": (HOLD, lambda m: m.replace(substeps=3)),
    "damping": (HOLD, lambda m: m.replace(damping=m.dof_damping + 0.04)),
    "servo": (HOLD, lambda m: edited(m, **doubled(m))),
    "servo, its limit": (HOLD, lambda m: edited(m, actuator_forcerange=[-2, 2])),
    "servo, off": (HOLD, lambda m: m.replace(actuation=False)),
    "armature": (HOLD, lambda m: m.replace(armature=1.5 * m.dof_armature)),
    "frictionloss": (HOLD, lambda m: m.replace(frictionloss=0)),
    "limits": (FALL, lambda m: edited(m, jnt_range=0.9 * m.jnt_range)),
    "limits, off": (FALL, lambda m: m.replace(limits=False)),
    "surfaces": (HOLD, lambda m: edited(m, geom_friction=0.1 * m.raw.geom_friction)),
    "surfaces, softness": (HOLD, lambda m: edited(m, geom_solref=[0.04, 1])),
    "integrator": (HOLD, lambda m: m.replace(integrator="euler")),
    "contact": (HOLD, lambda m: m.replace(contacts=False)),
}


@pytest.mark.parametrize("name", SEEDED)
def test_a_seeded_cause_is_found_and_no_other(arm: Model, name: str) -> None:
    experiment, change = SEEDED[name]
    cause = name.partition(",")[0]
    found = attribute(arm, change(arm), experiment)
    assert found.gap > 1e-5  # it is a cause
    alone = by_name(found.alone)
    assert alone[cause].explains == 1.0
    assert alone[cause].worst == 0.0  # the same engine: the same bits
    assert alone[cause].moved == 0.0
    assert alone[cause].put_back == found.gap
    for factor, trial in alone.items():
        if factor != cause:
            assert (trial.way, trial.explains) == ("alike", 0.0), factor
    assert [trial.factor for trial in found.ladder] == [cause]
    assert found.left == found.unexplained == 0.0
    assert report.page(found).holds
    assert FACTORS[cause].title in " ".join(report.conclusion(found))


def test_every_factor_of_the_table_was_seeded() -> None:
    seeded = {name.partition(",")[0] for name in SEEDED}
    assert seeded | {"inertia"} == set(FACTORS)  # which only an engine of its own has


def test_two_causes_are_both_found(arm: Model) -> None:
    two = arm.replace(armature=1.5 * arm.dof_armature, gravity=[0, 0, -5.0])
    found = attribute(arm, two, HOLD)
    ladder = by_name(found.ladder)
    assert list(ladder) == ["gravity", "armature"]
    assert all(trial.explains > 0.02 for trial in ladder.values())
    assert sum(trial.explains for trial in ladder.values()) == pytest.approx(1.0, abs=1e-12)
    assert found.left == 0.0
    alone = by_name(found.alone)
    for one, other in (("gravity", "armature"), ("armature", "gravity")):
        assert 0 < alone[one].explains < 1
        # One brought to the same is the other put back.
        assert alone[one].worst == alone[other].put_back
    assert ladder["gravity"].worst == alone["gravity"].worst


def test_what_is_not_in_the_table_stays_unexplained(arm: Model) -> None:
    heavier = edited(arm, body_mass=1.3 * arm.raw.body_mass)
    found = attribute(arm, heavier, HOLD)
    assert found.gap > 1e-4
    assert found.ladder == ()
    assert found.left == found.gap
    assert found.unexplained == 1.0
    assert not report.page(found).holds
    assert "none of" in " ".join(report.conclusion(found))


@pytest.mark.slow
def test_leaving_out_the_motion_is_no_explanation() -> None:
    """Of another engine with a heavier arm: what stills the arm closes the gap, and is no cause."""
    with registered("hidden", "tests.hidden_world:load"):
        one = sm.load("so101/scene")
        for experiment in (HOLD, replace(scenario("gravity"), seconds=0.5)):
            two = sm.load("so101/scene", backend="hidden")
            two.raw.body_mass[:] *= 1.3
            found = attribute(one, two, experiment)
            alone = by_name(found.alone)
            assert alone["gravity"].way == "off"
            assert alone["gravity"].moved > found.gap
            assert alone["timestep"].moved > 0
            assert found.unexplained == 1.0
            assert not any(trial.explains for trial in found.ladder)


def test_a_cause_is_found_on_another_engine_too() -> None:
    with registered("hidden", "tests.hidden_world:load"):
        one = sm.load("so101/scene")
        two = sm.load("so101/scene", backend="hidden").replace(armature=1.5 * one.dof_armature)
        found = attribute(one, two, HOLD)
    assert [trial.factor for trial in found.ladder] == ["armature"]
    assert found.left == 0.0
    assert by_name(found.alone)["contact"].way == "off"  # set alike, and another engine's


def test_what_cannot_be_set_on_two_is_set_on_one(arm: Model) -> None:
    """Its armature is that of the other, where the other has no such option."""
    with registered("stubborn", "tests.test_why:load_stubborn"):
        two = sm.load("so101/scene", backend="stubborn")
        found = attribute(arm, two, HOLD)
    assert found.gap > 1e-4
    armature = by_name(found.alone)["armature"]
    assert armature.way == "parity"
    assert armature.did == "as hidden"
    assert armature.worst == 0.0
    assert armature.moved == pytest.approx(found.gap)
    assert found.left == 0.0


def load_stubborn(path: str, defaults: str = "model") -> Model:
    """An engine that takes its armature from the file, which has another one."""
    from statemachine.interface import Capabilities

    from .hidden_world import ExampleModel, load

    model = load(path).replace(armature=0.04)
    known = model.capabilities
    options = tuple(name for name in known.options if name != "armature")
    fewer = Capabilities(options, known.integrators, known.behaviours, False, True)
    object.__setattr__(model, "capabilities", fewer)
    object.__setattr__(cast("ExampleModel", model).inner, "capabilities", fewer)
    return model


def test_no_gap_is_nothing_to_explain(arm: Model) -> None:
    found = attribute(arm, arm.replace(), HOLD)
    assert found.gap == 0.0
    assert found.alone == found.ladder == ()
    page = report.page(found)
    assert page.holds
    assert "nothing to explain" in rendered(page)


def test_runs_are_made_once(arm: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("statemachine.compare.why.runs")
    made, record = [], module.record
    monkeypatch.setattr(module, "record", lambda *a, **k: made.append(1) or record(*a, **k))
    found = attribute(arm, arm.replace(armature=0.04), HOLD)
    # Both as they come, and two with the other's armature.
    assert len(made) == found.runs == 3


def test_timesteps_without_common_moments_are_interpolated(arm: Model) -> None:
    two = arm.replace(timestep=0.0047)
    found = attribute(arm, two, HOLD)
    assert found.between
    assert found.left == 0.0
    assert "interpolated" in rendered(report.page(found))


def test_timesteps_meet_where_they_can(arm: Model) -> None:
    found = attribute(arm, arm.replace(timestep=1 / 240), replace(HOLD, seconds=1.0))
    assert not found.between
    assert found.moments == 41  # every 25 ms


def test_another_quantity(arm: Model) -> None:
    two = arm.replace(armature=0.04)
    found = attribute(arm, two, HOLD, quantity="gripperframe")
    assert (found.quantity, found.unit) == ("gripperframe", "m")
    assert found.gap == found.first["gripperframe"].worst
    with pytest.raises(UnknownNameError, match="gripperframe"):
        attribute(arm, two, HOLD, quantity="gripperfram")


def test_what_is_held_is_what_it_is_about() -> None:
    one = sm.load("so101/scene_box")
    two = edited(one, geom_friction=0.1 * one.raw.geom_friction)
    found = attribute(one, two, BOX)
    assert found.quantity == "box in the hand"
    assert by_name(found.alone)["surfaces"].explains == 1.0
    traces = [record_scenario(BOX, model) for model in (one, two)]
    seen = []
    for trace in traces:
        apart = trace["xpos"][:, one.body_id("box")] - trace.site("gripperframe")[0]
        seen.append(np.einsum("nji,nj->ni", trace.site("gripperframe")[1], apart))
    apart = np.linalg.norm(seen[0] - seen[1], axis=1)
    assert found.gap == pytest.approx(apart.max(), rel=1e-9)
    assert found.first["box in the hand"].rms == pytest.approx(np.sqrt((apart**2).mean()))
    assert found.first["box in the hand"].at == traces[0].time[apart.argmax()] - traces[0].time[0]
    # The same box from the default pose lies on the floor, out of reach.
    assert attribute(one, two, replace(BOX, keyframe=None)).quantity == "joints"


def test_other_joints_are_refused(arm: Model) -> None:
    with pytest.raises(BadInputError, match="other joints"):
        attribute(arm, sm.load("so101/scene_box"), HOLD)


def test_the_result_is_data(arm: Model) -> None:
    found = attribute(arm, arm.replace(armature=0.04), HOLD)
    told = json.loads(dumps(found))
    assert told["unexplained"] == 0.0
    assert told["ladder"][0]["gaps"]["joints"]["worst"] == 0.0
    assert told["provenance"][0]["versions"]["mujoco"]


def test_a_run_that_diverges_is_said(arm: Model) -> None:
    """Without armature and damping, under Euler, the servo does not stand at 20 ms."""
    coarse = arm.replace(timestep=0.02, integrator="euler")
    two = coarse.replace(armature=0, damping=0)
    with pytest.raises(BadInputError, match="does not reach the end"):
        attribute(coarse, two, HOLD)


# PyBullet


def quietly(name: str, **options: Any) -> Model:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", EngineWarning)
        return sm.load(name, backend="pybullet", **options)


def path_of(model: Model, experiment: Scenario) -> np.ndarray:
    """(n, nq) of an experiment, its options left to the caller."""
    controller, rows = experiment.controller(model, 0), []
    with sm.make_data(model) as data:
        sm.reset(model, data, keyframe=experiment.keyframe)
        for _ in range(round(experiment.seconds / model.timestep)):
            rows.append(data.qpos.copy())
            wanted = controller(data.time, data)
            if wanted is not None:
                data.ctrl = wanted
            sm.step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def dialled(name: str = "so101/scene", options: Any = None) -> tuple[Any, Any]:
    """PyBullet as it comes, and its dials."""
    from statemachine.engines import room

    fresh = quietly(name, defaults="engine")
    found = room("pybullet").dials(fresh, options or {})
    assert found
    return fresh, found


def motors_off(world: Any) -> None:
    """PyBullet's own motors do nothing any more."""
    import pybullet as pb

    for tree in world.trees:
        for joint in tree.joints:
            pb.setJointMotorControl2(
                tree.body, joint, pb.VELOCITY_CONTROL, force=0, physicsClientId=world.client
            )


SETTINGS = [name for name in FACTORS if name not in ("integrator", "contact")]


def values_of(model: Model) -> dict[str, Any]:
    return {
        "gravity": model.gravity,
        "timestep": (model.timestep, model.substeps),
        "armature": model.dof_armature,
        "damping": model.dof_damping,
        "frictionloss": model.dof_frictionloss,
    }


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("name", ["hold", "gravity", "box"])
def test_the_ends_of_the_dials_are_the_two_models(name: str) -> None:
    from statemachine.engines import room

    experiment = replace(scenario(name), seconds=0.7)
    fresh, found = dialled(experiment.model, experiment.options)
    raw = fresh.replace(**experiment.options)
    np.testing.assert_array_equal(
        path_of(found.build({}, {}), experiment), path_of(raw, experiment)
    )
    emulated = quietly(experiment.model).replace(**experiment.options)
    whole = found.build(dict.fromkeys(SETTINGS, "model"), values_of(emulated))
    np.testing.assert_array_equal(path_of(whole, experiment), path_of(emulated, experiment))
    assert room("pybullet").dials(emulated, {}) is None


@pytest.mark.usefixtures("bullet")
def test_as_it_comes_is_what_a_user_of_pybullet_gets(tmp_path: Path) -> None:
    """Bit for bit the run of a script that knows nothing of this library but the URDF."""
    import pybullet as pb

    from statemachine.runs.commands import TARGET

    fresh, found = dialled()
    ours = path_of(found.build({}, {}), HOLD)
    file = written(tmp_path / "arm.urdf", fresh.raw["base"])
    client = pb.connect(pb.DIRECT)
    try:
        arm = pb.loadURDF(str(file), useFixedBase=True, physicsClientId=client)
        plane = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
        pb.createMultiBody(0, plane, physicsClientId=client)
        infos = [pb.getJointInfo(arm, j, client) for j in range(pb.getNumJoints(arm, client))]
        index = {info[1].decode(): info[0] for info in infos}
        joints = [index[name] for name in fresh.joint_names]
        rows = []
        for _ in ours:
            rows.append([s[0] for s in pb.getJointStates(arm, joints, client)])
            pb.setJointMotorControlArray(
                arm, joints, pb.POSITION_CONTROL, targetPositions=TARGET, physicsClientId=client
            )
            pb.stepSimulation(client)
    finally:
        pb.disconnect(client)
    np.testing.assert_array_equal(ours, rows)


@pytest.mark.usefixtures("bullet")
def test_with_everything_dialled_off_the_engines_agree() -> None:
    """No motors, no damping, no limits, no contact, file's inertias: rigid bodies alone.

    Each of the dials is needed for it, so each acts.
    """
    from statemachine.engines.pybullet import dials as module

    limp = {"actuation": False}
    _, found = dialled(options=limp)
    bare = {**limp, "timestep": 1e-3, "armature": 0, "frictionloss": 0, "damping": 0}
    one = sm.load("so101/scene").replace(**bare, contacts=False, limits=False)
    values = {**values_of(one), "damping": np.zeros(one.nv)}
    every: dict[str, Any] = {
        "gravity": "model",
        "timestep": "model",
        "inertia": "model",
        "damping": "off",
        "limits": "off",
        "contact": "off",
    }
    experiment = replace(scenario("fall"), seconds=0.55)
    wanted = path_of(one, experiment)
    assert np.abs(wanted).max() > 2.0  # beyond the limits, below the floor

    def apart(names: dict[str, Any]) -> float:
        model = found.build(names, values).replace(timestep=one.timestep)
        acts = getattr(found.build(names, values), "_acts", ())
        model = module._dialled(model, [*acts, motors_off])
        try:
            return float(np.abs(path_of(model, experiment) - wanted).max())
        except DivergedError:
            return np.inf

    assert apart(every) < 1e-9
    for name in ("gravity", "inertia", "damping", "limits", "contact"):
        assert apart({k: v for k, v in every.items() if k != name}) > 1e-4, name


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("dial", ["damping", "limits", "surfaces"])
def test_what_is_called_the_engines_own_changes_no_bit_of_it(dial: str) -> None:
    """A limp arm without joint damping, which reaches its limits and the floor."""
    from statemachine.engines.pybullet import dials as module

    fresh = quietly("so101/scene", defaults="engine")
    fresh = fresh.replace(gravity=[0, 0, -9.81], actuation=False)
    raw = fresh._shared.raw  # pyright: ignore[reportAttributeAccessIssue]

    def limp(world: Any) -> None:
        motors_off(world)
        for tree in world.trees:
            for joint in tree.joints:
                module._change(world, tree.body, joint, jointDamping=0.05)

    own = {
        "damping": lambda w: module._set_damping(w, module.BODY_DAMPING, np.full(raw.nv, 0.05)),
        "limits": lambda w: module._set_limits(w, module._ranges(fresh)),
        "surfaces": module._harden,
    }
    # Of another kind: so it would have been seen.
    other = {
        "damping": lambda w: module._set_damping(w, 0.05, np.full(raw.nv, 0.05)),
        "limits": lambda w: module._set_limits(w, dict.fromkeys(range(raw.nv), (-0.1, 0.3))),
        "surfaces": lambda w: w.soften(),
    }
    experiment = replace(scenario("gravity"), seconds=1.0)
    plain = path_of(module._dialled(fresh, [limp]), experiment)
    assert np.abs(plain).max() > 0.35
    np.testing.assert_array_equal(
        path_of(module._dialled(fresh, [limp, own[dial]]), experiment), plain
    )
    assert (path_of(module._dialled(fresh, [limp, other[dial]]), experiment) != plain).any()

    def spun(*acts: Any) -> np.ndarray:
        """Speeds after a start that is faster than the engine lets a joint be."""
        model = module._dialled(fresh, [limp, *acts])
        with sm.make_data(model) as data:
            data.qvel[5] = 150.0
            sm.step(model, data)
            return data.qvel.copy()

    assert np.abs(spun()).max() == pytest.approx(100.0)
    np.testing.assert_array_equal(spun(own[dial]), spun())


@pytest.mark.usefixtures("bullet")
def test_links_of_one_robot_meet_where_the_setting_says_so(arm: Model) -> None:
    """In a pose in which the arm is in its own way, by MuJoCo."""

    def own_ways(model: Model, qpos: np.ndarray, run: Any) -> int:
        with sm.make_data(model) as data:
            data.qpos = qpos
            run(model, data)
            bodies = model.geom_bodyid[data.contacts.geom]
            return int((bodies > 0).all(axis=1).sum())

    random = np.random.default_rng(3)
    poses = (random.uniform(*arm.jnt_range.T) for _ in range(200))
    pose = next(pose for pose in poses if own_ways(arm, pose, sm.forward) > 2)
    fresh, found = dialled()
    rest = {name: "model" for name in SETTINGS if name != "surfaces"}
    values = values_of(arm)
    own: Any = found.build(rest, values)  # pyright: ignore[reportArgumentType]
    same: Any = found.build({**rest, "surfaces": "model"}, values)  # pyright: ignore[reportArgumentType]
    assert own_ways(fresh, pose, sm.step) == own_ways(own, pose, sm.step) == 0
    assert own_ways(same, pose, sm.step) > 0


@pytest.mark.usefixtures("bullet")
def test_as_it_comes_has_the_engines_figures_in_the_emulated_world() -> None:
    """Read back from the engine: friction, masses, inertias, timestep and gravity."""
    import pybullet as pb

    fresh, found = dialled()
    model: Any = found.build({"servo": "model"}, {})

    def figures(world: Any) -> dict[int, tuple[Any, ...]]:
        return {
            b: pb.getDynamicsInfo(tree.body, link, world.client)
            for tree in world.trees
            for b, link in tree.links.items()
        }

    with sm.make_data(fresh) as one, sm.make_data(model) as two:
        told = [pb.getPhysicsEngineParameters(data.raw.client) for data in (one, two)]
        assert told[0] == told[1]
        theirs, ours, true = figures(one.raw), figures(two.raw), figures(model._shared.ghost)
        for body, info in theirs.items():
            assert ours[body][1] == info[1] == 0.5
            assert ours[body][5:8] == info[5:8]
            if body in true:  # the law reckons with the inertias of the shapes, in the same axes
                np.testing.assert_allclose(true[body][2], info[2], rtol=1e-12)
                for place in (3, 4):  # where the centre of mass is, and its axes
                    np.testing.assert_allclose(true[body][place], info[place], atol=1e-12)
    np.testing.assert_array_equal(model.dof_armature, 0)
    np.testing.assert_array_equal(model.dof_frictionloss, 0)


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("name", SETTINGS)
def test_each_dial_acts_on_the_emulated_side(name: str) -> None:
    """All settings the model's, one as the engine comes: the run is another one."""
    experiment = {"limits": FALL, "surfaces": replace(scenario("gravity"), seconds=0.8)}.get(
        name, HOLD
    )
    fresh, found = dialled(options=experiment.options)
    emulated = quietly("so101/scene").replace(**experiment.options)
    rest = {each: "model" for each in SETTINGS if each != name}
    if name == "servo":
        rest = {k: v for k, v in rest.items() if k not in (*found.with_servo, "limits")}
    other: Any = found.build(rest, values_of(emulated))  # pyright: ignore[reportArgumentType]
    rows = path_of(other, experiment)
    if name == "timestep":
        assert other.timestep == fresh.timestep
    else:
        assert np.abs(rows - path_of(emulated, experiment)).max() > 1e-5


@pytest.mark.usefixtures("bullet")
def test_dials_outlive_a_reset() -> None:
    fresh, found = dialled()
    model = found.build({"inertia": "model"}, {})
    first = path_of(model, HOLD)
    assert (first != path_of(fresh, HOLD)).any()
    controller, rows = HOLD.controller(model, 0), []
    with sm.make_data(model) as data:
        sm.step(model, data, 30)
        sm.reset(model, data)
        for _ in first:
            rows.append(data.qpos.copy())
            data.ctrl = controller(data.time, data)
            sm.step(model, data)
    np.testing.assert_array_equal(first, rows)


@pytest.mark.usefixtures("bullet")
def test_a_dial_that_does_not_act_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    from statemachine.engines.pybullet import dials as module
    from statemachine.errors import EngineError

    _, found = dialled()
    monkeypatch.setattr(module, "_change", lambda *_a, **_k: None)
    for name in ("inertia", "surfaces"):
        with pytest.raises(EngineError, match="did not take"):
            sm.make_data(found.build({name: "model"}, {}))
    with pytest.raises(ValueError, match="servo law"):
        found.build({"armature": "model"}, {})


@pytest.fixture(scope="module")
def attributions() -> dict[tuple[str, str], Attribution]:
    """Of the three experiments, in both regimes."""
    need_engine("pybullet")
    found = {}
    for name in ("hold", "gravity", "box"):
        experiment = scenario(name)
        for defaults in ("model", "engine"):
            two = quietly(experiment.model, defaults=defaults)
            found[name, defaults] = attribute(sm.load(experiment.model), two, experiment)
    return found


@pytest.mark.slow
def test_contact_explains_what_the_emulation_leaves(attributions: Any) -> None:
    for name in ("hold", "gravity", "box"):
        found = attributions[name, "model"]
        assert [trial.factor for trial in found.ladder] == ["contact"], name
        assert found.ladder[0].explains > 0.9
        assert abs(found.unexplained) < 1e-5
        if name != "box":
            # In the motion as it comes: until the first touch there is no gap.
            assert found.touch.before < 1e-12
            assert found.touch.moments > 50


@pytest.mark.slow
def test_the_engine_as_it_comes_is_far_away_and_explained(attributions: Any) -> None:
    for name in ("hold", "gravity", "box"):
        found = attributions[name, "engine"]
        rungs = [trial for trial in found.ladder if trial.way == "parity"]
        assert {trial.factor for trial in rungs} == set(SETTINGS)
        assert all(trial.moved == 0.0 for trial in rungs)  # one's motion stays the same
        assert found.ladder[-1].factor == "contact"
        total = sum(trial.explains for trial in found.ladder)
        assert total + found.unexplained == pytest.approx(1.0, abs=1e-9)
        assert abs(found.unexplained) < 1e-5
        # Where all settings are the same, what is left is the gap of the emulated engine.
        emulated = attributions[name, "model"]
        assert found.settings_same <= emulated.gap + 1e-12  # at fewer moments
        assert found.settings_same > 0.9 * emulated.gap
    hold = attributions["hold", "engine"]
    assert np.degrees(hold.gap) > 30
    shares = {trial.factor: trial.explains for trial in hold.ladder}
    assert max(shares, key=lambda name: shares[name]) == "servo"


@pytest.mark.slow
def test_the_parts_are_said_to_be_of_one_order(attributions: Any) -> None:
    found = attributions["hold", "engine"]
    alone, ladder = by_name(found.alone), by_name(found.ladder)
    # The engine has the rotor and the friction of the model only in the model's servo law.
    assert alone["servo"].along == ("armature", "frictionloss", "limits")
    assert all(trial.along == () for trial in found.alone if trial.factor != "servo")
    # The timestep put back, by hand: it acts on the engine's motors, not on the model's law.
    one = sm.load("so101/scene")
    two = sm.load("so101/scene", backend="pybullet").replace(timestep=1 / 240)
    runs = [path_of(m, scenario("hold"))[::every] for m, every in ((one, 5), (two, 6))]
    by_hand = np.abs(runs[0] - runs[1]).max()
    assert alone["timestep"].put_back == pytest.approx(by_hand, rel=1e-6)
    assert ladder["timestep"].explains > 0.05
    assert found.last(alone["timestep"]) == pytest.approx(
        (by_hand - found.settings_same) / found.gap, abs=1e-9
    )
    said = " ".join(report.conclusion(found))
    assert "In another order the parts are others: servo law" in said
    assert "and armature, dry friction and joint limits with it" in said
    assert "; timestep 8.4 % if it comes first, -3e-2 % if last" in said
    # Where one thing explains it all, there is no order.
    emulated = report.conclusion(attributions["hold", "model"])
    assert "order" not in " ".join(emulated)
    # Friction of surfaces does nothing before something is met.
    (from_the_start,) = [line for line in emulated if "act from the start" in line]
    assert "surfaces" not in from_the_start
    assert "dry friction" in from_the_start


@pytest.mark.slow
def test_pages_fit_and_say_what_was_found(attributions: Any) -> None:
    for found in attributions.values():
        text = rendered(report.page(found))
        assert max(map(len, text.splitlines())) <= 80
        assert "contact" in text
        json.loads(dumps(found))


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_two_ways_to_have_pybullet_end_in_the_same_bits() -> None:
    one, two = quietly("so101/scene"), quietly("so101/scene", defaults="engine")
    found = attribute(one, two, HOLD)
    assert found.gap > 0.1
    assert found.left == 0.0
    swapped = attribute(two, one, HOLD)
    assert (swapped.one, swapped.gap, swapped.left) == (found.one, found.gap, 0.0)


@pytest.mark.usefixtures("bullet")
def test_two_engines_as_they_come_differ_by_what_was_set() -> None:
    fresh = quietly("so101/scene", defaults="engine")
    found = attribute(fresh, fresh.replace(gravity=[0, 0, -9.81]), HOLD)
    assert [trial.factor for trial in found.ladder] == ["gravity"]
    assert found.left == 0.0


# The command


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
def test_the_command(cli: Cli) -> None:
    done = cli("compare", "hold", "--why", "--seconds", "0.5", code=0)
    assert not done.stderr
    assert "contact" in done.stdout
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    told = json.loads(cli("compare", "hold", "--why", "--seconds", "0.5", "--json").stdout)
    assert [trial["factor"] for trial in told["ladder"]] == ["contact"]
    assert told["quantity"] == "joints"


def test_the_command_says_no_where_the_cause_is_not_found(
    arm: Model, monkeypatch: pytest.MonkeyPatch, here: Cli
) -> None:
    models = [arm, edited(arm, body_mass=1.3 * arm.raw.body_mass)]
    monkeypatch.setattr(backends, "load", lambda *_a, **_k: models.pop(0))
    done = here("compare", "hold", "--why", "--seconds", "0.5")
    assert done.returncode == 1
    assert "100.0 % is unexplained" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--quantity", "box"), "known: joints"),
        (("--tolerance", "joint=1deg"), "--tolerance"),
        (("--backends", "mujoco", "pybulet"), "Did you mean 'pybullet'"),
        (("--seconds", "0"), "above 0"),
        (("gravity",), "one experiment"),
        (("--model", "so101/scen"), "scen"),
        (("--seconds", "0.1", "--timestep", "-1"), "timestep"),
    ],
)
def test_a_mistake_is_one_line(arguments: tuple[str, ...], said: str, here: Cli) -> None:
    engines = () if "--backends" in arguments else ("--backends", "mujoco", "mujoco")
    one_line(here("compare", "hold", *arguments, "--why", *engines), said)


def test_quantity_without_why_is_a_mistake(here: Cli) -> None:
    one_line(here("compare", "hold", "--quantity", "joints"), "--why")


def test_without_pybullet_one_line_says_so(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\n"
        "class Hide:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'pybullet':\n"
        "            raise ModuleNotFoundError(f'No module named {name!r}', name=name)\n"
        "sys.meta_path.insert(0, Hide())\n"
    )
    done = cli("compare", "hold", "--why", PYTHONPATH=f"{tmp_path}{os.pathsep}{ROOT}")
    one_line(done, "pip install pybullet", code=3)
