"""What MotrixSim reads of a file without a complaint, and what then moves nothing."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import EngineWarning
from statemachine.interface import Array

from .support.claims import warnings_of
from .support.files import written
from .support.motions import after
from .support.requirements import need_engine
from .support.small_models import IMPLICIT, mjcf

BAR = '<geom type="box" size=".15 .02 .02" pos=".15 0 0" mass=".3"/>'
HINGE = f'<body><joint name="j" axis="0 1 0" {{}}/>{BAR}</body>'
BALL = f'<body><joint name="swivel" type="ball" stiffness="2"/>{BAR}</body>'
SERVO = '<actuator><position joint="j" kp="3"/></actuator>'
GAIN = '<actuator><general name="a" joint="j" gaintype="affine" gainprm="1 1"/></actuator>'
TENDON = (
    '<tendon><fixed name="t" stiffness="30" springlength="-.1 .3">'
    '<joint joint="j" coef="1"/></fixed></tendon>'
)
FLOOR = '<geom type="plane" size="5 5 1" name="floor"/>'
BOX = '<body pos="0 0 .12"><freejoint/><geom name="b" type="box" {} size=".1 .1 .1"/></body>'
PAIR = '<contact><pair name="p" geom1="floor" geom2="b" margin=".03" gap=".02"/></contact>'
# What it is called at load, and the world and the rest of a file that has it.
INERT = {
    "actuatorfrcrange of j": (HINGE.format('actuatorfrcrange="-.1 .1"'), SERVO),
    "gainprm of a": (HINGE.format(""), GAIN),
    "stiffness of swivel": (
        f'<body><joint name="swivel" type="ball" stiffness="2"/>{BAR}</body>',
        "",
    ),
    "stiffness of t": (HINGE.format(""), TENDON),
    "margin of b": (FLOOR + BOX.format('margin=".03" gap=".02"'), ""),
    "margin of p": (FLOOR + BOX.format(""), PAIR),
}


@pytest.fixture(scope="module", autouse=True)
def motrix() -> None:
    """Skip all of this without MotrixSim."""
    need_engine("motrix")


@pytest.fixture(params=INERT)
def case(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Path]:
    """What is without effect, and a file that has it."""
    world, rest = INERT[request.param]
    return request.param, written(tmp_path / "m.xml", mjcf(world, rest, IMPLICIT))


def swing(model: sm.Model) -> Array:
    """Return qpos after 0.3 s under commands of 0.7."""
    return after(model, 150, ctrl=np.full(model.nu, 0.7))


def test_what_has_no_effect_is_said_at_load(case: tuple[str, Path]) -> None:
    name, file = case
    _, told = warnings_of(lambda: sm.load(file, backend="motrix"))
    assert name in told


def test_without_it_mujoco_moves_as_motrixsim_does(case: tuple[str, Path]) -> None:
    _, file = case
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        model = sm.load(file, backend="motrix")
    mujoco = sm.load(file)
    run = swing(model)
    assert gap(run, swing(mujoco.with_compiled(model.compiled))) < 1e-3
    assert gap(run, swing(mujoco)) > 1e-2


def gap(left: Any, right: Any) -> float:
    """Return the largest difference of two arrays."""
    return float(np.abs(np.asarray(left) - np.asarray(right)).max())
