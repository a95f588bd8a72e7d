"""`statemachine compare --why`: causes that are known must be found, and no others."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from shutil import copytree
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.records import DifferingQuantity
from statemachine.errors import BadInputError, DivergedError, EngineWarning, UnknownNameError
from statemachine.interface import Model
from statemachine.lab.recordings import record_scenario, rerun
from statemachine.lab.runs.scenarios import Scenario, scenario
from statemachine.lab.why import Explanation, WhyRequest, explain, search
from statemachine.lab.why import page as report
from statemachine.lab.why.gap import Measure, size_of
from statemachine.lab.why.settings import NEEDS, TITLES
from statemachine.lab.why.shapley import shapley
from statemachine.measures import Deviation
from statemachine.show.as_json import dumps

from .support.backends import registered
from .support.claims import assert_has, refused
from .support.files import written
from .support.motions import opened
from .support.pages import shown
from .support.requirements import ROOT, need_engine
from .support.small_models import mjcf, on_both

HOLD = replace(scenario("hold"), seconds=0.6)  # long enough to touch the floor
FALL = replace(scenario("fall"), seconds=5.0)  # and to meet a limit
BOX = replace(scenario("box"), seconds=0.5)


@pytest.fixture
def arm() -> Model:
    return sm.load("so101/scene")


def shares(result: Explanation) -> dict[str, float]:
    """Return the part of each cause that has one."""
    return {row.name: row.share for row in result.shares if row.share}


def test_an_integrator_is_chosen_on_the_side_that_has_several(tmp_path: Path) -> None:
    text = mjcf(
        '<body><joint axis="1 0 0"/><geom type="capsule" size=".02" fromto="0 0 0 0 .3 0"/></body>',
        option='<option integrator="RK4" timestep="0.02"/>',
    )
    with pytest.warns(EngineWarning, match="RK4 acts as Euler"):
        one, two = on_both(written(tmp_path / "m.xml", text))
    result = explain(WhyRequest(one, two, FALL, seconds=1.0))
    (row,) = result.shares
    assert row.values == (DifferingQuantity("integrator", "rk4", "its own"),)
    assert row.chosen == ("left", "euler")
    assert result.verdict.holds
    assert "integrator=" in shown(report.page(result, details=True))


def test_leaving_out_the_motion_is_no_explanation(arm: Model) -> None:
    """Another engine, a heavier arm: what stills the arm closes the gap, and is not a cause."""
    with registered("hidden", "tests.support.hidden_world:load"):
        two = sm.load("so101/scene", backend="hidden")
        two.raw.body_mass[:] *= 1.3  # which no compiled model tells
        result = explain(WhyRequest(arm, two, HOLD, uncertain=None))
    assert result.unexplained > 0.9
    assert not {"gravity", "servo law"} & {part.name for part in result.found_in}


def test_runs_are_made_once(arm: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    record = Mock(side_effect=rerun.record)
    monkeypatch.setattr(rerun, "record", record)
    result = explain(WhyRequest(arm, arm.replace(gravity=[0, 0, -9]), HOLD, uncertain=None, jobs=1))
    # Both as they come, and the right with the left's gravity.
    assert record.call_count == result.runs == 3


@pytest.mark.parametrize(
    ("timestep", "facts"),
    [
        (0.0047, {"between": True, "equalized_gap": 0.0}),
        (1 / 240, {"between": False, "moments": 25}),  # every 25 ms
    ],
)
def test_timesteps_meet_where_they_can_or_are_interpolated(
    arm: Model, timestep: float, facts: dict[str, Any]
) -> None:
    assert_has(
        explain(WhyRequest(arm, arm.replace(timestep=timestep), HOLD, uncertain=None)), **facts
    )


def test_substeps_and_timestep_are_one_cause(arm: Model) -> None:
    two = arm.replace(timestep=2 * arm.timestep, substeps=4, damping=0.7)
    result = explain(WhyRequest(arm, two, HOLD, uncertain=None))
    (step,) = [row for row in result.shares if row.name == "timestep"]
    assert step.values == (
        DifferingQuantity("timestep", 0.005, 0.01, "s"),
        DifferingQuantity("substeps", 1, 4),
    )
    assert result.equalized_gap == result.unexplained == 0.0


def test_the_gap_of_another_quantity_is_explained_where_it_is_named(arm: Model) -> None:
    two = arm.replace(armature=0.04)
    result = explain(WhyRequest(arm, two, HOLD, quantity="gripperframe", uncertain=None))
    assert_has(result, quantity="gripperframe", unit="m", gap=result.first["gripperframe"].worst)
    refused(
        (
            UnknownNameError,
            "gripperframe",
            lambda: explain(WhyRequest(arm, two, HOLD, quantity="gripperfram")),
        ),
        (
            UnknownNameError,
            "known: joints",
            lambda: explain(WhyRequest(arm, two, HOLD, quantity="")),
        ),
    )


def test_what_is_held_is_what_it_is_about(mujoco_box: sm.Model) -> None:
    two = mujoco_box.replace()
    two.raw.geom_friction[:] *= 0.1
    two = two.replace()  # so that what the Model tells follows
    result = explain(WhyRequest(mujoco_box, two, BOX, uncertain=None))
    assert result.quantity == "box relative to gripperframe"
    assert sum(shares(result).values()) == pytest.approx(1.0)
    seen, time = [], np.empty(0)
    for trace in (record_scenario(BOX, model) for model in (mujoco_box, two)):
        time, (pos, rotation) = trace.time, trace.site("gripperframe")
        from_tip = trace["xpos"][:, mujoco_box.body_id("box")] - pos
        seen.append(np.einsum("nji,nj->ni", rotation, from_tip))
    apart = np.linalg.norm(seen[0] - seen[1], axis=1)
    assert result.gap == pytest.approx(apart.max(), rel=1e-9)
    assert_has(
        result.first["box relative to gripperframe"],
        rms=pytest.approx(np.sqrt((apart**2).mean())),
        at=time[apart.argmax()] - time[0],
    )


def test_a_run_that_diverges_is_said_with_what_would_let_it_stand(arm: Model) -> None:
    """Without armature and damping, under Euler, the servo does not stand at 20 ms."""
    coarse = arm.replace(timestep=0.02, integrator="euler")
    two = coarse.replace(armature=0, damping=0)
    refused(
        (BadInputError, "reach the end", lambda: explain(WhyRequest(coarse, two, HOLD))),
        (
            BadInputError,
            r"brought to the same: armature of 6 joints, damping",
            lambda: explain(WhyRequest(arm.replace(timestep=0.02), two, HOLD)),
        ),
    )


def test_one_changed_default_is_one_row_and_its_line_is_found(tmp_path: Path) -> None:
    copytree(ROOT / "models" / "so101", tmp_path / "arm")
    right = tmp_path / "arm" / "so101.xml"
    text = right.read_text(encoding="utf-8")
    written(right, text.replace('armature="0.028"', 'armature="0.042"'))
    one, two = sm.load("so101"), sm.load(right)
    row = explain(WhyRequest(one, two, HOLD, uncertain=None)).shares[0]
    assert (row.name, row.share) == ("armature of 6 joints", 1.0)
    line = next(k for k, line in enumerate(text.splitlines(), 1) if 'armature="0.028"' in line)
    assert (row.place.file, row.place.line) == ("so101.xml", line)
    # What the file does not say, because an option does, has no line there.
    row = explain(WhyRequest(one, one.replace(armature=0.042), HOLD, uncertain=None)).shares[0]
    assert row.place is None


def test_joints_that_an_experiment_does_not_move_are_told(arm: Model) -> None:
    damping = arm.dof_damping.copy()
    damping[arm.joint_id("shoulder_pan")] = damping[arm.joint_id("elbow_flex")] = 0.9
    waves = replace(scenario("waves"), seconds=1.0)
    for experiment, still in ((HOLD, ("shoulder_pan",)), (waves, ())):
        result = explain(WhyRequest(arm, arm.replace(damping=damping), experiment, uncertain=None))
        assert result.still == still


def test_finer_splits_what_changed_alike(arm: Model) -> None:
    two = arm.replace(armature=1.5 * arm.dof_armature)
    parts = shares(explain(WhyRequest(arm, two, HOLD, uncertain=None, finer=True)))
    assert (len(parts), sum(parts.values())) == (6, pytest.approx(1.0, abs=0.05))


AIRPORT = {"a": 0.1, "b": 0.3, "c": 0.6, "d": 1.0}
# A game, and the part of each: of v(S) = 1 - max over S each gets what it adds, as in the airport
# game; either of two redundant causes takes away what both do, once a third is brought over.
GAMES: list[tuple[Any, dict[str, float]]] = [
    (
        lambda brought: 1.0 - max((AIRPORT[name] for name in brought), default=0.0),
        {"a": 0.025, "b": 0.025 + 0.2 / 3, "c": 0.175 + 0.2 / 3, "d": 0.775 - 0.4 / 3},
    ),
    (
        lambda brought: 1.0 - ("a" in brought) * (0.73 + 0.27 * bool(brought & {"b", "c"})),
        {"a": 0.73 + 0.27 * 2 / 3, "b": 0.27 / 6, "c": 0.27 / 6},
    ),
]


@pytest.mark.parametrize(("value", "shares"), GAMES)
def test_shapley_values_of_games_whose_values_are_known(
    value: Any, shares: dict[str, float]
) -> None:
    found = shapley(list(shares), value, 1.0)
    assert_has(found, method="all sets", share=pytest.approx(shares))
    assert "d" in shares or found.alone["b"] == found.last["b"] == 0.0


def test_a_cause_that_needs_another_comes_after_it() -> None:
    weights = {"a": 0.1, "b": 0.5, "c": 0.4}
    asked = list[frozenset[str]]()

    def value(brought: frozenset[str]) -> float:
        asked.append(brought)
        b = "b" in brought
        return 1.0 - 0.1 * ("a" in brought) - 0.5 * b - 0.4 * (b and "c" in brought)

    for sets in (200, 3):  # all sets, and drawn orders
        result = shapley(list(weights), value, 1.0, needs={"b": "a", "c": "b"}, sets=sets)
        assert result.share == pytest.approx(weights)
    assert all("a" in brought for brought in asked if {"b", "c"} & brought)
    assert result.alone["b"] is result.last["a"] is None


# PyBullet


def quietly(name: str, **options: Any) -> Model:
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return sm.load(name, backend="pybullet", **options)


def path_of(model: Model, experiment: Scenario, used: int = 0) -> np.ndarray:
    """Return qpos (n, nq) of an experiment without its options, after steps and a reset."""
    controller, rows = experiment.controller(model, 0), []
    with opened(model, nstep=used) as (_, data):
        if used or experiment.keyframe:
            sm.reset(model, data, experiment.keyframe)
        for _ in range(round(experiment.seconds / model.timestep)):
            rows.append(data.qpos.copy())
            wanted = controller(model, data)
            if wanted is not None:
                data.ctrl = wanted
            sm.step(model, data)
        return np.array([*rows, data.qpos])


def dialled(name: str = "so101/scene", options: Any = None) -> tuple[Any, Any]:
    """Return PyBullet as it comes, and its dials."""
    from statemachine.engines import raw_engine_of

    fresh = quietly(name, defaults="engine")
    return fresh, raw_engine_of("pybullet").dials(fresh, options or {})


def motors_off(world: Any) -> None:
    """Switch PyBullet's own motors off."""
    import pybullet as pb

    for tree in world.trees:
        for joint in tree.joints:
            pb.setJointMotorControl2(
                tree.body, joint, pb.VELOCITY_CONTROL, force=0, physicsClientId=world.client
            )


SETTINGS = list(TITLES)


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
    from statemachine.engines import raw_engine_of

    experiment = replace(scenario(name), seconds=0.7)
    fresh, found = dialled(experiment.model, experiment.options)
    raw = fresh.replace(**experiment.options)
    emulated = quietly(experiment.model).replace(**experiment.options)
    whole = found.build(dict.fromkeys(SETTINGS, "model"), values_of(emulated))
    for model, end in ((found.build({}, {}), raw), (whole, emulated)):
        np.testing.assert_array_equal(path_of(model, experiment), path_of(end, experiment))
    assert raw_engine_of("pybullet").dials(emulated, {}) is None


@pytest.mark.usefixtures("bullet")
def test_as_it_comes_is_what_a_user_of_pybullet_gets(tmp_path: Path) -> None:
    """Bit for bit the run of a script that knows nothing of this library but the URDF."""
    import pybullet as pb

    from statemachine.lab.runs.robot import ARM_TARGET

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
                arm, joints, pb.POSITION_CONTROL, targetPositions=ARM_TARGET, physicsClientId=client
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

    _, found = dialled(options={"actuation": False})
    one = sm.load("so101/scene").replace(
        actuation=False, timestep=1e-3, armature=0, frictionloss=0, damping=0, contacts=False,
        limits=False,
    )  # fmt: skip
    every: dict[str, Any] = dict.fromkeys(("gravity", "timestep", "inertia"), "model")
    every |= dict.fromkeys(("damping", "limits", "contact"), "off")
    experiment = replace(scenario("fall"), seconds=0.55)
    wanted = path_of(one, experiment)
    assert np.abs(wanted).max() > 2.0  # beyond the limits, below the floor

    def apart(names: dict[str, Any]) -> float:
        model = found.build(names, values_of(one)).replace(timestep=one.timestep)
        try:
            rows = path_of(module.with_settings(model, [motors_off]), experiment)
            return float(np.abs(rows - wanted).max())
        except DivergedError:
            return np.inf

    assert apart(every) < 1e-9
    for name in every.keys() - {"timestep"}:
        assert apart({k: v for k, v in every.items() if k != name}) > 1e-4, name


@dataclass(frozen=True)
class DialRuns:
    """A limp arm of PyBullet as it comes, and what sets one of its dials.

    Attributes:
        fresh: The arm as it comes.
        limp: Takes its motors off and leaves little damping.
        own: Sets what is called the engine's own.
        other: Sets another kind of it.
    """

    fresh: Model
    limp: Callable[[Any], None]
    own: Callable[[Any], None]
    other: Callable[[Any], None]

    def built(self, *acts: Callable[[Any], None]) -> Model:
        """Return the limp arm with further settings."""
        from statemachine.engines.pybullet import dials as module

        return module.with_settings(self.fresh, [self.limp, *acts])

    def path(self, *acts: Callable[[Any], None]) -> np.ndarray:
        """Return qpos (n, nq) of the limp arm, which reaches its limits and the floor."""
        return path_of(self.built(*acts), replace(scenario("gravity"), seconds=1.0))


@pytest.fixture(params=["damping", "limits", "surfaces"])
def dial(request: pytest.FixtureRequest, bullet: None) -> DialRuns:
    """Return a limp arm, and the engine's own setting of a dial and another one."""
    from statemachine.engines.pybullet import dials as module

    fresh = quietly("so101/scene", defaults="engine", gravity=[0, 0, -9.81], actuation=False)
    joints = np.full(fresh.nv, 0.05)

    def limp(world: Any) -> None:
        motors_off(world)
        for tree in world.trees:
            for joint in tree.joints:
                world.change(tree.body, joint, jointDamping=0.05)

    own, other = {
        "damping": (
            lambda w: module.set_damping(w, module.BODY_DAMPING, joints),
            lambda w: module.set_damping(w, 0.05, joints),
        ),
        "limits": (
            lambda w: module.set_limits(w, module.joint_ranges(fresh)),
            lambda w: module.set_limits(w, dict.fromkeys(range(fresh.nv), (-0.1, 0.3))),
        ),
        "surfaces": (module.harden, lambda w: w.soften()),
    }[request.param]
    return DialRuns(fresh, limp, own, other)


def test_what_is_called_the_engines_own_changes_no_bit_of_a_run(dial: DialRuns) -> None:
    plain = dial.path()
    assert np.abs(plain).max() > 0.35
    np.testing.assert_array_equal(dial.path(dial.own), plain)
    assert (dial.path(dial.other) != plain).any()  # so it would have been seen


def test_what_is_called_the_engines_own_keeps_the_largest_speed_of_a_joint(dial: DialRuns) -> None:
    """After a start that is faster than the engine lets a joint be."""
    speeds = []
    for acts in ((), (dial.own,)):
        with opened(dial.built(*acts), qvel=[0, 0, 0, 0, 0, 150.0], nstep=1) as (_, data):
            speeds.append(data.qvel.copy())
    assert np.abs(speeds[0]).max() == pytest.approx(100.0)
    np.testing.assert_array_equal(*speeds)


@pytest.mark.usefixtures("bullet")
def test_links_of_one_robot_meet_where_the_setting_says_so(arm: Model) -> None:
    """In a pose in which the arm is in its own way, by MuJoCo."""

    def own_ways(model: Model, qpos: np.ndarray, run: Any) -> int:
        with opened(model, qpos=qpos) as (_, data):
            run(model, data)
            return int((model.geom_bodyid[data.contacts.geom] > 0).all(axis=1).sum())

    poses = np.random.default_rng(3).uniform(*arm.jnt_range.T, size=(200, arm.nq))
    pose = next(pose for pose in poses if own_ways(arm, pose, sm.forward) > 2)
    fresh, found = dialled()
    same = dict.fromkeys(SETTINGS, "model")
    own = {name: "model" for name in SETTINGS if name != "self-collision"}
    models = fresh, *(found.build(names, values_of(arm)) for names in (own, same))
    assert [own_ways(model, pose, sm.step) > 0 for model in models] == [False, False, True]


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
        theirs, ours, true = figures(one.raw), figures(two.raw), figures(model.plan.ghost)
    for body, info in theirs.items():
        assert ours[body][1] == info[1] == 0.5
        assert ours[body][5:8] == info[5:8]
        if body in true:  # the law reckons with the inertias of the shapes, in the same axes
            np.testing.assert_allclose(true[body][2], info[2], rtol=1e-12)
            for place in (3, 4):  # where the centre of mass is, and its axes
                np.testing.assert_allclose(true[body][place], info[place], atol=1e-12)
    np.testing.assert_array_equal([model.dof_armature, model.dof_frictionloss], 0)


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(("name", "experiment"), [("damping", HOLD), ("limits", FALL)])
def test_dials_that_no_figure_shows_act_on_the_emulated_side(
    name: str, experiment: Scenario
) -> None:
    """All settings the model's, one as the engine comes: the run is another one."""
    _, found = dialled(options=experiment.options)
    emulated = quietly("so101/scene").replace(**experiment.options)
    rest: Any = {each: "model" for each in SETTINGS if each != name}
    rows = path_of(found.build(rest, values_of(emulated)), experiment)
    assert np.abs(rows - path_of(emulated, experiment)).max() > 1e-5


@pytest.mark.usefixtures("bullet")
def test_dials_outlive_a_reset() -> None:
    fresh, found = dialled()
    model = found.build({"inertia": "model"}, {})
    first = path_of(model, HOLD)
    assert (first != path_of(fresh, HOLD)).any()
    np.testing.assert_array_equal(first, path_of(model, HOLD, used=30))


Explanations = dict[tuple[str, str], Explanation]


@pytest.fixture(scope="module")
def few_orders() -> Iterator[None]:
    """Draw few orders of causes: what is tested holds of few as of many."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(search, "SETS", 40)
        yield


@pytest.fixture(scope="module")
def explanations(few_orders: None) -> Explanations:
    """Return the explanations of three experiments, in both regimes."""
    need_engine("pybullet")
    results = {}
    for name, defaults in product(("hold", "gravity", "box"), ("model", "engine")):
        experiment = scenario(name)
        one, two = sm.load(experiment.model), quietly(experiment.model, defaults=defaults)
        results[name, defaults] = explain(WhyRequest(one, two, experiment, uncertain=None))
    return results


NAMES = ("hold", "gravity", "box")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_contact_is_what_the_emulation_leaves(name: str, explanations: Explanations) -> None:
    result = explanations[name, "model"]
    assert [part.name for part in result.found_in] == ["contact"]
    assert result.located > 0.9
    assert abs(result.unexplained) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hold", "gravity"])
def test_the_emulation_has_no_gap_before_the_first_touch(
    name: str, explanations: Explanations
) -> None:
    touch = explanations[name, "model"].touch
    assert touch is not None
    assert touch.before < 1e-12
    assert touch.moments > 50


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_causes_of_an_engine_as_it_comes_are_its_settings_and_then_contact(
    name: str, explanations: Explanations
) -> None:
    result = explanations[name, "engine"]
    assert {row.name for row in result.shares} <= set(TITLES.values())
    assert {row.kind for row in result.shares} == {"engine"}
    assert result.found_in[-1].name == "contact"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_gap_of_an_engine_as_it_comes_is_explained_whole(
    name: str, explanations: Explanations
) -> None:
    result = explanations[name, "engine"]
    assert sum(shares(result).values()) == pytest.approx(result.explained, abs=1e-9)
    total = result.explained + result.located + result.unexplained
    assert total == pytest.approx(1.0, abs=1e-9)
    assert abs(result.unexplained) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_with_all_settings_equalized_the_gap_is_that_of_the_emulated_engine(
    name: str, explanations: Explanations
) -> None:
    result = explanations[name, "engine"]
    emulated = explanations[name, "model"].first[result.quantity].worst
    assert result.equalized_gap is not None
    assert 0.9 * emulated < result.equalized_gap <= emulated + 1e-12  # at fewer moments


@pytest.mark.slow
def test_the_servo_law_parts_an_engine_as_it_comes_by_more_than_30_degrees(
    explanations: Explanations,
) -> None:
    hold = explanations["hold", "engine"]
    assert np.degrees(hold.gap) > 30
    assert (hold.method, hold.shares[0].name) == ("drawn orders", "servo law")


@pytest.mark.slow
def test_the_share_of_an_engine_s_timestep_is_that_of_runs_by_hand(
    arm: sm.Model, explanations: Explanations
) -> None:
    """Put back, it acts on the engine's motors, not on the model's law."""
    result = explanations["hold", "engine"]
    rows = {row.name: row for row in result.shares}
    two = sm.load("so101/scene", backend="pybullet").replace(timestep=1 / 240)
    runs = [path_of(m, scenario("hold"))[::every] for m, every in ((arm, 5), (two, 6))]
    expected = (np.abs(runs[0] - runs[1]).max() - result.equalized_gap) / result.gap
    assert rows["timestep"].last == pytest.approx(expected, abs=1e-9)
    assert rows["timestep"].alone > 0.05


@pytest.mark.slow
def test_only_settings_that_need_the_servo_law_cannot_be_equalized_alone(
    explanations: Explanations,
) -> None:
    """The engine has rotor and friction of the model only in its servo law; no joint follows."""
    rows = {row.name: row for row in explanations["hold", "engine"].shares}
    assert {name for name, row in rows.items() if row.alone is None} == NEEDS.keys() - {
        TITLES["equality"]
    }


@pytest.mark.slow
@pytest.mark.parametrize("details", [False, True])
def test_the_pages_of_engines_fit_into_80_columns(
    details: bool, explanations: Explanations
) -> None:
    for result in explanations.values():
        lines = shown(report.page(result, details)).splitlines()
        assert max(map(len, lines)) <= 80


@pytest.mark.slow
def test_explanations_of_engines_are_json(explanations: Explanations) -> None:
    for result in explanations.values():
        assert json.loads(dumps(result))["quantity"] == result.quantity


@pytest.mark.slow
@pytest.mark.usefixtures("bullet", "few_orders")
def test_the_two_ways_to_have_pybullet_end_in_the_same_bits() -> None:
    one, two = quietly("so101/scene"), quietly("so101/scene", defaults="engine")
    for sides in ((one, two), (two, one)):
        result = explain(WhyRequest(*sides, HOLD, uncertain=None))
        assert result.gap > 0.1
        assert result.equalized_gap == 0.0


@pytest.mark.usefixtures("bullet")
def test_an_integrator_is_found_behind_contact_too() -> None:
    """Contact hides it: it is tried again once contact is left out."""
    raw = sm.load("so101/scene").replace()
    raw.raw.opt.integrator = 1  # RK4, which PyBullet does not have
    left, right = raw.replace(), quietly("so101/scene")
    result = explain(WhyRequest(left, right, HOLD, uncertain=None))
    assert [part.name for part in result.found_in] == ["contact", "integrator"]
    chosen = result.found_in[1]
    assert chosen.share > 0.1
    assert result.unexplained == pytest.approx(0.0, abs=1e-9)
    # By itself, where the arm touches, it takes away another part: by hand.
    gaps = [
        np.abs(path_of(model, HOLD) - path_of(right, HOLD)).max()
        for model in (left, left.replace(integrator=chosen.without))
    ]
    assert chosen.alone == pytest.approx((gaps[0] - gaps[1]) / result.gap, abs=1e-6)
    assert chosen.alone < 0.9 * chosen.share


@pytest.mark.usefixtures("bullet")
def test_two_engines_as_they_come_differ_by_what_was_set() -> None:
    fresh = quietly("so101/scene", defaults="engine")
    result = explain(WhyRequest(fresh, fresh.replace(gravity=[0, 0, -9.81]), HOLD, uncertain=None))
    assert (list(shares(result)), result.equalized_gap) == (["gravity"], 0.0)


@pytest.mark.usefixtures("bullet", "few_orders")
@pytest.mark.slow
def test_files_and_settings_of_an_engine_are_explained_together(
    arm: sm.Model, tmp_path: Path
) -> None:
    heavy: Any = arm.replace(mass=1.3 * arm.body_mass)
    heavy.save_binary(tmp_path / "heavy.mjb")
    right = quietly(str(tmp_path / "heavy.mjb"), defaults="engine", trust_binary=True)
    result = explain(WhyRequest(arm, right, HOLD, uncertain=None))
    assert {"body", "engine"} <= {row.kind for row in result.shares}
    assert result.explained + result.located == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("measure", ["worst", "end"])
def test_the_joint_that_is_farthest_apart_is_named(arm: Model, measure: Measure) -> None:
    """Each joint alone is less far apart than the one that is named, whose figures are told."""
    other = arm.replace(damping=[0.6, 0.6, 1.4, 0.6, 0.6, 0.6])
    result = explain(WhyRequest(arm, other, HOLD, measure=measure, uncertain=None))
    alone: dict[str, Deviation] = {}
    for name in arm.joint_names:
        asked = WhyRequest(arm, other, HOLD, quantity=name, uncertain=None)
        alone[name] = explain(asked).first[name]
    assert result.joint == max(alone, key=lambda name: size_of(alone[name], measure))
    assert result.joint_gap == alone[result.joint]
    assert size_of(alone[result.joint], measure) == result.gap


def test_of_another_quantity_no_joint_is_named(arm: Model) -> None:
    request = WhyRequest(arm, arm.replace(damping=2.0), HOLD, quantity="gripperframe")
    assert explain(replace(request, uncertain=None)).joint == ""
