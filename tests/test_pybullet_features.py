"""What of a model PyBullet lacks is refused by name, warned of by name, or computed right."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnsupportedError

from .conftest import need_engine, refused, written
from .small_models import FEATURED

FLOOR = '<geom name="floor" type="plane" size="2 2 .1"/>'
BALL = '<body pos="1 0 .5"><joint type="ball" name="ball"/><geom size=".1"/></body>'
PID = '<pid name="p" joint="a" kp="20" kv="2"/>'


# Each with what is refused or warned of; nothing where it is computed.
def both(folder: Path, changes: dict[str, str], **options: Any) -> tuple[sm.Model, sm.Model, str]:
    """The model on both engines, and what PyBullet's load warned of."""
    need_engine("pybullet")
    given = dict.fromkeys(("more", "geom", "joint", "actuator"), "")
    given |= {"option": 'integrator="implicitfast"'} | changes
    path = written(folder / "model.xml", FEATURED.format(**given | {"more": FLOOR + given["more"]}))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        two = sm.load(path, backend="pybullet", **options)
    return sm.load(path, **options), two, " ".join(str(line.message) for line in told)


def apart(one: sm.Model, two: sm.Model) -> float:
    """The largest gap of positions [rad] over 400 steps of random commands."""
    random, worst = np.random.default_rng(0), 0.0
    with sm.make_data(one) as a, sm.make_data(two) as b:
        for k in range(400):
            if k % 40 == 0:
                a.ctrl[:] = b.ctrl[:] = random.uniform(-1, 1, one.nu)
            sm.step(one, a)
            sm.step(two, b)
            worst = max(worst, float(np.abs(a.qpos - b.qpos).max()))
    return worst


@pytest.mark.parametrize(
    ("changes", "how", "says"),
    [
        ({}, "right", ""),
        (
            {"option": 'integrator="discrete"'},
            "warned",
            "the integrator discrete acts as implicitfast",
        ),
        (
            {"joint": 'stiffness="5" springyield="9"'},
            "warned",
            "springyield has no effect (b 0.157)",
        ),
        ({"joint": 'stiffness="5 .2"'}, "refused", "nonlinear spring: joint b has it"),
        ({"joint": 'damping=".1 .2"'}, "refused", "nonlinear damping: joint b has it"),
        ({"joint": 'actuatorfrcrange="-.1 .1"'}, "right", ""),
        ({"geom": 'surfacevel=".5 0 0"'}, "warned", "surfacevel has no effect (upper 0.5)"),
        ({"geom": 'margin=".001"'}, "warned", "(the largest: 1 mm, upper)"),
        (
            {"geom": 'solref=".02 .1" priority="1"'},
            "warned",
            "(floor and upper would keep about 73 %",
        ),
        ({"geom": 'solref="-1000 -1"'}, "warned", "(floor and upper would keep about 95 %"),
        ({"geom": 'solref=".1 1" solimp=".5 .6 .01"'}, "told", "solimp of their own have upper"),
        ({"actuator": PID}, "refused", "actuator gain: actuator p has one that is not constant"),
        (
            {"actuator": PID.replace("kv", 'ki="1" kv')},
            "refused",
            "actuator p has a state of its own",
        ),
        (
            {"more": BALL, "actuator": '<orientation name="o" joint="ball" kp="20"/>'},
            "refused",
            "actuator transmission: actuator o does not drive a joint",
        ),
        (
            {"actuator": '<motor name="m" joint="a" damping="1"/>'},
            "refused",
            "actuator armature or damping: actuator m has it: give it to the joint",
        ),
        (
            {"actuator": '<motor name="m" joint="a" armature="1"/>'},
            "refused",
            "actuator armature or damping: actuator m has it: give it to the joint",
        ),
        (
            {"actuator": '<damper name="d" joint="a" kv="2" ctrlrange="0 1"/>'},
            "refused",
            "actuator gain: actuator d has one that is not constant",
        ),
    ],
)
def test_nothing_is_lost_in_silence(
    tmp_path: Path, changes: dict[str, str], how: str, says: str
) -> None:
    if how == "refused":
        refused((UnsupportedError, re.escape(says), lambda: both(tmp_path, changes)))
        return
    one, two, told = both(tmp_path, changes)
    note = two.capabilities.behaviours["contacts"].note
    if how == "warned":
        assert says in told
    else:
        assert not told
        assert apart(one, two) < 1e-6
    assert ("of their own have upper" in note) == ("solref" in changes.get("geom", ""))
    if how == "told":
        assert says in note


def test_contact_settings_are_not_spoken_of_without_contacts(tmp_path: Path) -> None:
    geom = 'solref=".02 .1" priority="1" surfacevel=".5 0 0"'
    _, two, told = both(tmp_path, {"geom": geom}, contacts=False)
    assert not told
    assert "of their own" not in two.capabilities.behaviours["contacts"].note


@pytest.mark.parametrize("actuator", [PID, '<damper name="d" joint="a" kv="2" ctrlrange="0 1"/>'])
def test_an_actuator_that_is_off_is_not_refused(tmp_path: Path, actuator: str) -> None:
    """All of them by an option, or those of a group by the file: the servo keeps its ctrl."""
    one, two, _ = both(tmp_path, {"actuator": actuator}, actuation=False)
    assert one.nu == two.nu
    assert apart(one, two) < 1e-6
    grouped = {
        "actuator": actuator.replace("name=", 'group="3" name='),
        "option": 'integrator="implicitfast" actuatorgroupdisable="3"',
    }
    one, two, _ = both(tmp_path, grouped)
    assert two.actuator_names[-1] == "servo"
    assert apart(one, two) < 1e-6
