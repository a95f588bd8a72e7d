"""The audit of a State: what is known of the engines, and faults that it must find."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.errors import BadInputError, EngineWarning
from statemachine.lab.probes import Audit, audit
from statemachine.show.as_json import plain

from .support.backends import registered
from .support.claims import refused
from .support.patches import followed_by
from .support.requirements import need_engine
from .support.small_models import loaded, model_of

SCENE = "so101/scene_box"


@pytest.fixture(scope="module")
def of_mujoco() -> Audit:
    return audit(sm.load(SCENE))


@pytest.fixture(scope="module")
def of_pybullet() -> Audit:
    need_engine("pybullet")
    return audit(sm.load(SCENE, backend="pybullet"))


@pytest.mark.parametrize("wrong", [None, "so101"])
def test_only_a_model_is_audited(wrong: Any) -> None:
    with pytest.raises(TypeError, match="audit wants a Model"):
        audit(wrong)


def test_mujoco_needs_its_warm_start_in_contact(of_mujoco: Audit) -> None:
    """It shows in the first step, and is below a millionth."""
    parts = {part.name: part for part in of_mujoco.parts}
    warm = parts["warmstart"].gap
    assert warm.first == 1
    assert 0 < max(warm.angle, warm.length) < 1e-6
    assert audit(sm.load("so101")).idle == ("time", "warmstart")  # nothing touches


def test_every_other_part_of_a_mujoco_state_but_the_time_decides(of_mujoco: Audit) -> None:
    forces = ("qfrc_applied", "xfrc_applied")
    assert of_mujoco.decides == ("qpos", "qvel", "warmstart", "ctrl", *forces)
    assert of_mujoco.idle == ("time",)
    parts = {part.name: part for part in of_mujoco.parts}
    assert parts["qpos"].gap.first == parts["qvel"].gap.first == 0  # they read back otherwise
    assert parts["ctrl"].gap.first == 1


def test_a_whole_state_has_the_future_of_its_run(of_mujoco: Audit) -> None:
    assert of_mujoco.whole.exact
    assert of_mujoco.again.exact


def test_pybullet_forgets_its_contacts(of_pybullet: Audit) -> None:
    """No State has them: a restore has another future than the run, though always the same."""
    assert of_pybullet.whole.first == 1
    assert of_pybullet.again.exact
    assert {"qpos", "qvel", "ctrl"} <= set(of_pybullet.decides)


@pytest.mark.usefixtures("bullet")
def test_where_nothing_touches_pybullet_forgets_nothing() -> None:
    assert audit(sm.load("so101", backend="pybullet")).whole.exact


def test_a_backend_of_another_package_is_audited() -> None:
    with registered("hidden", "tests.support.hidden_world:load") as name:
        found = audit(sm.load(SCENE, backend=name), steps=20)
    assert found.whole.exact
    assert "warmstart" in found.decides


def forget_the_warm_start(data: MujocoData, *_: Any) -> None:
    data.raw.qacc_warmstart[:] = 0


def test_a_backend_whose_restore_forgets_something_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    followed_by(MujocoData, "_set_state", forget_the_warm_start)(monkeypatch)
    found = audit(sm.load(SCENE), steps=20)
    assert not found.whole.exact
    assert "warmstart" in found.idle


def test_a_restore_that_depends_on_the_past_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)

    def nudge(data: MujocoData, *_: Any) -> None:
        data.raw.qacc_warmstart[:] += random.normal()

    followed_by(MujocoData, "_set_state", nudge)(monkeypatch)
    assert not audit(sm.load(SCENE), steps=20).again.exact


def test_parts_of_other_models_are_tried(tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="m" mocap="true" pos="1 0 1"><geom size=".05"/></body>
        <body pos="0 0 1"><joint name="j" axis="0 1 0"/><geom size=".05" pos=".3 0 0"/></body>
        <body name="f" pos="0 -1 .5"><freejoint/><geom size=".05"/></body></worldbody>
        <equality><weld body1="f" body2="m"/></equality><actuator>
        <general joint="j" dyntype="filter" dynprm=".1" gainprm="5"/></actuator></mujoco>"""
    found = audit(model_of(tmp_path, text), steps=20)
    assert "act" in found.decides
    assert {"mocap_pos", "mocap_quat"} <= set(found.not_tried)  # nobody moved it


def test_a_future_without_a_part_of_the_state_may_diverge(tmp_path: Path) -> None:
    with pytest.warns(EngineWarning, match="stiffness of joint j is negative"):
        model = loaded(
            tmp_path,
            """<body><joint name="j" axis="0 1 0" stiffness="-3e4" damping="10"/>
            <geom size=".1" pos=".3 0 0"/></body>""",
            '<actuator><position joint="j" kp="9e4" ctrlrange="-1 1"/></actuator>',
        )
    found = audit(model, steps=20)
    assert found.whole.exact
    assert "qpos" in found.decides


def test_what_cannot_be_audited_is_one_line(tmp_path: Path) -> None:
    arm = sm.load("so101")
    refused(
        (BadInputError, "nothing moves", lambda: audit(loaded(tmp_path, '<geom size="1"/>'))),
        (BadInputError, "negative", lambda: audit(arm, seed=-1)),
        (BadInputError, "steps", lambda: audit(arm, steps=0)),
    )


def test_an_audit_is_a_record_and_prints_as_a_table(of_mujoco: Audit) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        of_mujoco.steps = 3  # pyright: ignore[reportAttributeAccessIssue]
    assert plain(of_mujoco)["parts"][0]["name"] == "time"
    lines = str(of_mujoco).splitlines()
    assert max(map(len, lines)) <= 80
    assert sum(line.startswith("all but ") for line in lines) == len(of_mujoco.parts)
