"""What of a model PyBullet lacks is refused by name, warned of by name, or computed right."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.errors import UnsupportedError

from .conftest import refused, written
from .small_models import FEATURED, largest_gap, on_both

pytestmark = pytest.mark.usefixtures("bullet")
FLOOR = '<geom name="floor" type="plane" size="2 2 .1"/>'
BALL = '<body pos="1 0 .5"><joint type="ball" name="ball"/><geom size=".1"/></body>'
PID = '<pid name="p" joint="a" kp="20" kv="2"/>'


def warned(folder: Path, changes: dict[str, str], **options: Any) -> tuple[list[sm.Model], str]:
    """The model on both engines, and what their loads warned of."""
    parts = dict.fromkeys(("more", "geom", "joint", "actuator"), "")
    parts |= {"option": 'integrator="implicitfast"'} | changes
    file = written(folder / "model.xml", FEATURED.format(**parts | {"more": FLOOR + parts["more"]}))
    with warnings.catch_warnings(record=True, action="always") as records:
        models = on_both(file, **options)
    return models, " ".join(str(record.message) for record in records)


def apart(models: list[sm.Model]) -> float:
    """The largest gap of positions [rad] over 400 steps of random commands."""
    with sm.make_data(models[0]) as left, sm.make_data(models[1]) as right:
        return largest_gap(models, (left, right), steps=400, every=40)


# Each with what is refused or warned of; nothing where it is computed.
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
        refused((UnsupportedError, re.escape(says), lambda: warned(tmp_path, changes)))
        return
    models, text = warned(tmp_path, changes)
    note = models[1].capabilities.behaviours["contacts"].note
    if how == "warned":
        assert says in text
    else:
        assert not text
        assert apart(models) < 1e-6
    assert ("of their own have upper" in note) == ("solref" in changes.get("geom", ""))
    if how == "told":
        assert says in note


def test_contact_settings_are_not_spoken_of_without_contacts(tmp_path: Path) -> None:
    geom = 'solref=".02 .1" priority="1" surfacevel=".5 0 0"'
    models, text = warned(tmp_path, {"geom": geom}, contacts=False)
    assert not text
    assert "of their own" not in models[1].capabilities.behaviours["contacts"].note


@pytest.mark.parametrize("actuator", [PID, '<damper name="d" joint="a" kv="2" ctrlrange="0 1"/>'])
def test_an_actuator_that_is_off_is_not_refused(tmp_path: Path, actuator: str) -> None:
    """All of them by an option, or those of a group by the file: the servo keeps its ctrl."""
    models, _ = warned(tmp_path, {"actuator": actuator}, actuation=False)
    assert models[0].nu == models[1].nu
    assert apart(models) < 1e-6
    grouped = {
        "actuator": actuator.replace("name=", 'group="3" name='),
        "option": 'integrator="implicitfast" actuatorgroupdisable="3"',
    }
    models, _ = warned(tmp_path, grouped)
    assert models[1].actuator_names[-1] == "servo"
    assert apart(models) < 1e-6
