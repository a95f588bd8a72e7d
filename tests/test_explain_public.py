"""Public robots: a file does not differ from itself, and two seeded causes are found on each."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.mujoco.differences import edited
from statemachine.errors import StateMachineError
from statemachine.interface import Model
from statemachine.lab.compare.matching import match_models
from statemachine.lab.runs.scenarios import SCENARIOS, suitable_scenarios
from statemachine.lab.why import WhyRequest, explain
from statemachine.lab.why.causes import differences_of

from .support.claims import assert_has
from .support.requirements import SHARED, shared

pytestmark = pytest.mark.slow
MODELS = SHARED / "robots" / "models"
FILES = sorted(path for kind in ("xml", "urdf") for path in MODELS.rglob(f"*.{kind}"))
MOST = 100  # degrees of freedom: thousands of small bodies take minutes


def _loaded(path: Path) -> Model:
    try:
        model = sm.load(path)
    except StateMachineError as error:  # a part of a file, or one that wants what is not here
        pytest.skip(str(error).splitlines()[0])
    if not model.nv or model.nv > MOST:
        pytest.skip(f"{model.nv} degrees of freedom")
    return model


def _moving(raw) -> list[int]:
    """Return bodies with a joint and a mass."""
    has = (raw.body_dofnum > 0) & (raw.body_mass > 0) & (raw.body_weldid == np.arange(raw.nbody))
    return np.flatnonzero(has).tolist()


@pytest.fixture(
    scope="module", params=FILES or [MODELS], ids=lambda path: "/".join(path.parts[-2:])
)
def robot(request: pytest.FixtureRequest) -> Model:
    """Each public robot that can be loaded and moves."""
    shared(MODELS)
    return _loaded(request.param)


def test_a_public_robot_does_not_differ_from_itself(robot: Model) -> None:
    again = sm.load(robot.path)
    assert differences_of(robot, again, match_models(robot, again)) == ()


def test_two_seeded_causes_are_found_on_a_public_robot(robot: Model) -> None:
    raw, fits = robot.compiled, suitable_scenarios(robot)
    if not fits or not _moving(raw):
        pytest.skip("nothing moves a body with a mass")
    random = np.random.default_rng([1, zlib.crc32(robot.path.name.encode())])
    body, dof = int(random.choice(_moving(raw))), int(random.integers(raw.nv))
    edits = [
        ("body_mass", (body,), raw.body_mass[body] * 1.2),
        ("dof_damping", (dof,), raw.dof_damping[dof] + 0.05),
    ]
    right = robot.with_compiled(edited(raw, edits))
    scenario = SCENARIOS["waves" if "waves" in fits else fits[0]]
    found = explain(WhyRequest(robot, right, scenario, seconds=0.1, uncertain=None))
    kinds = sorted(each.name.partition(" of ")[0] for each in found.shares)
    assert kinds == ["damping", "mass"]
    assert_has(found, equalized_gap=0.0)
    if found.verdict.answer == "nothing moved":  # gravity alone, on what lies in a plane
        assert found.instead is not None
        return
    assert found.verdict.holds
    if found.verdict.divides:
        assert sum(each.share or 0.0 for each in found.shares) == pytest.approx(1.0, abs=0.02)
