"""One attribute of a rich MJCF is changed at a time: what moves otherwise is listed, no more.

Whether a change moves anything is decided by plain MuJoCo: the same start and the same commands of
a seed, and the bits of qpos and qvel.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.records import ModelDifference
from statemachine.lab.compare.matching import match_models
from statemachine.lab.why.causes import built, causes, differences_of

RICH = """
<mujoco model="rich">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="Euler" gravity="0 0 -9.81"/>
  <default>
    <geom solref="0.02 1" friction="1 0.005 0.0001"/>
    <default class="arm"><joint damping="0.2" armature="0.01"/></default>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="upper" pos="0 0 0.5" euler="0 0 0.1">
      <joint name="shoulder" class="arm" axis="0 1 0" range="-1.5 0.9" frictionloss="0.05"
             stiffness="1" springref="0.1"/>
      <geom name="upper_shape" type="capsule" fromto="0 0 0 0.25 0 0" size="0.02" mass="0.6"/>
      <site name="anchor" pos="0.1 0 0.03"/>
      <body name="lower" pos="0.25 0 0">
        <inertial mass="0.3" pos="0.1 0.01 0" diaginertia="0.001 0.0008 0.0003"
                  quat="0.9 0.1 0.2 0.3"/>
        <joint name="elbow" class="arm" axis="0 1 0.3" range="-2 2"/>
        <geom name="lower_shape" type="box" size="0.1 0.02 0.01" pos="0.1 0 0" mass="0.3"/>
        <site name="tip" pos="0.2 0 0"/>
        <body name="left" pos="0.2 0.03 0">
          <joint name="left" type="slide" axis="0 1 0" range="-0.01 0.03" damping="2"/>
          <geom name="left_shape" type="box" size="0.02 0.005 0.01" mass="0.02"/>
        </body>
        <body name="right" pos="0.2 -0.03 0">
          <joint name="right" type="slide" axis="0 -1 0" range="-0.01 0.03" damping="2"/>
          <geom name="right_shape" type="box" size="0.02 0.005 0.01" mass="0.02"/>
        </body>
      </body>
    </body>
    <body name="cube" pos="0.6 0 0.04">
      <freejoint name="cube"/>
      <geom name="cube_shape" type="box" size="0.03 0.03 0.03" mass="0.1"/>
    </body>
    <body name="wheel" pos="-0.5 0 0.3">
      <joint name="wheel" type="ball" damping="0.01"/>
      <geom name="wheel_shape" type="ellipsoid" size="0.05 0.04 0.03" pos="0.05 0 0" mass="0.2"/>
    </body>
  </worldbody>
  <contact>
    <pair name="cube_on_floor" geom1="floor" geom2="cube_shape" condim="4"/>
    <exclude body1="left" body2="right"/>
  </contact>
  <tendon>
    <fixed name="grip" stiffness="3" damping="0.5" springlength="0.01">
      <joint joint="left" coef="1"/><joint joint="right" coef="1"/>
    </fixed>
    <spatial name="band" stiffness="20"><site site="anchor"/><site site="tip"/></spatial>
  </tendon>
  <equality>
    <joint name="alike" joint1="left" joint2="right" polycoef="0 1 0 0 0"/>
  </equality>
  <actuator>
    <position name="lift" joint="shoulder" kp="40" kv="2" forcerange="-8 8" ctrlrange="-1.5 1.2"/>
    <general name="bend" joint="elbow" gainprm="20" biastype="affine" biasprm="0 -20 -1"
             dyntype="filterexact" dynprm="0.03"/>
    <position name="close" tendon="grip" kp="60"/>
    <motor name="push" joint="left" gear="0.5"/>
    <velocity name="turn" joint="elbow" kv="0.1"/>
  </actuator>
  <sensor><framepos name="place" objtype="site" objname="tip"/></sensor>
</mujoco>
"""


@dataclass(frozen=True)
class AttributeEdit:
    """A change of one attribute.

    Attributes:
        tag: Of the element.
        name: Of the element; "" of the first of its tag.
        attribute: What is set.
        value: To what, as an MJCF has it.
    """

    tag: str
    name: str
    attribute: str
    value: str

    def __str__(self) -> str:
        return f"{self.tag}-{self.name}-{self.attribute}-{self.value}"

    def applied(self, text: str) -> str:
        """Return a text with the change."""
        from xml.etree import ElementTree

        root = ElementTree.fromstring(text)
        elements = [
            each for each in root.iter(self.tag) if not self.name or each.get("name") == self.name
        ]
        if self.tag == "flag":
            option = root.find("option")
            assert option is not None
            elements = [ElementTree.SubElement(option, "flag")]
        elements[0].set(self.attribute, self.value)
        return ElementTree.tostring(root, encoding="unicode")


# Of each element the attributes of MuJoCo's schema, with a value that RICH does not have.
ATTRIBUTES: dict[tuple[str, str], dict[str, str]] = {
    ("joint", "shoulder"): {
        **{"pos": "0.01 0 0", "axis": "0.1 1 0", "range": "-0.5 0.3", "damping": "0.5"},
        **{"armature": "0.03", "frictionloss": "0.2", "stiffness": "3", "springref": "0.4"},
        **{"ref": "0.2", "margin": "0.2", "solreflimit": "0.1 1", "limited": "false"},
        **{"solimplimit": "0.5 0.6 0.01", "solreffriction": "0.1 1", "group": "2"},
        **{"user": "1", "solimpfriction": "0.5 0.6 0.01"},
        **{"actuatorfrcrange": "-3 3", "actuatorgravcomp": "true"},
    },
    ("geom", "cube_shape"): {
        **{"type": "ellipsoid", "size": "0.03 0.04 0.03", "pos": "0.01 0 0", "euler": "0.2 0 0"},
        **{"mass": "0.2", "contype": "2", "conaffinity": "2", "condim": "6", "priority": "1"},
        **{"solmix": "3", "solref": "0.05 1", "solimp": "0.5 0.7 0.01", "margin": "0.01"},
        **{"gap": "0.01", "friction": "0.2 0.005 0.0001", "rgba": "1 0 0 1", "group": "3"},
        **{"fluidshape": "ellipsoid", "shellinertia": "true"},
    },
    ("geom", "lower_shape"): {
        **{"friction": "0.2 0.005 0.0001", "solref": "0.05 1", "margin": "0.02", "condim": "1"},
        **{"size": "0.11 0.02 0.01", "type": "ellipsoid", "priority": "2", "mass": "0.4"},
    },
    ("body", "lower"): {
        **{"pos": "0.26 0 0", "euler": "0 0.2 0", "gravcomp": "1", "user": "3"},
    },
    ("inertial", ""): {
        **{"mass": "0.4", "pos": "0.1 0.02 0", "diaginertia": "0.002 0.0018 0.0003"},
        **{"quat": "0.9 0.3 0.2 0.3"},
    },
    ("site", "tip"): {"pos": "0.2 0 0.02", "size": "0.02", "rgba": "1 0 0 1", "type": "box"},
    ("site", "anchor"): {"pos": "0.1 0 0.06", "group": "1"},
    ("fixed", "grip"): {
        **{"stiffness": "9", "damping": "2", "springlength": "0.03", "frictionloss": "0.3"},
        **{"range": "-0.005 0.005", "armature": "0.1", "actuatorfrcrange": "-0.1 0.1"},
        **{"group": "2"},
    },
    ("spatial", "band"): {"stiffness": "60", "springlength": "0.05", "damping": "2"},
    ("joint", "alike"): {
        **{"polycoef": "0.002 1 0 0 0", "solref": "0.1 1", "solimp": "0.5 0.6 0.01"},
        **{"active": "false"},
    },
    ("pair", ""): {
        **{"condim": "1", "friction": "0.2 0.2 0.005 0.0001 0.0001", "solref": "0.1 1"},
        **{"solimp": "0.5 0.6 0.01", "margin": "0.01", "gap": "0.01", "solreffriction": "0.3 1"},
    },
    ("position", "lift"): {
        **{"kp": "60", "kv": "4", "gear": "1.5", "forcerange": "-2 2", "ctrlrange": "-0.2 0.2"},
        **{"timeconst": "0.05", "armature": "0.05", "damping": "0.5", "group": "2"},
        **{"joint": "elbow", "ctrllimited": "false", "user": "1"},
    },
    ("general", "bend"): {
        **{"dyntype": "filter", "dynprm": "0.1", "gainprm": "30", "biasprm": "0 -10 -1"},
        **{"biastype": "none", "actearly": "true", "actrange": "-0.1 0.1", "gaintype": "affine"},
    },
    ("motor", "push"): {"gear": "1", "joint": "right"},
    ("velocity", "turn"): {"kv": "0.5"},
    ("option", ""): {
        **{"timestep": "0.001", "integrator": "implicitfast", "gravity": "0 0 -9"},
        **{"cone": "elliptic"},
        **{"impratio": "10", "density": "200", "viscosity": "0.5", "wind": "1 0 0"},
        **{"iterations": "1", "tolerance": "0.1", "solver": "PGS", "noslip_iterations": "5"},
        **{"jacobian": "sparse", "ccd_iterations": "3", "magnetic": "1 0 0"},
        **{"actuatorgroupdisable": "0"},
    },
    ("flag", ""): {
        **{"contact": "disable", "gravity": "disable", "limit": "disable", "actuation": "disable"},
        **{"equality": "disable", "frictionloss": "disable", "damper": "disable"},
        **{"spring": "disable", "clampctrl": "disable", "warmstart": "disable"},
        **{"filterparent": "disable", "refsafe": "disable", "eulerdamp": "disable"},
        **{"energy": "enable", "sensor": "disable", "multiccd": "enable", "nativeccd": "disable"},
    },
}  # fmt: skip
EVERY = [
    AttributeEdit(tag, name, attribute, value)
    for (tag, name), values in ATTRIBUTES.items()
    for attribute, value in values.items()
]
_ORDER = np.random.default_rng(47).permutation(len(EVERY))
DRAWN = [EVERY[int(k)] for k in _ORDER[:78]]

# A piece of RICH, and another way to say the same.
SAID_OTHERWISE = {
    "an angle as a quaternion": (
        'euler="0 0 0.1"',
        'quat="0.9987502603949663 0 0 0.04997916927067834"',
    ),
    "a capsule by its ends": (
        'fromto="0 0 0 0.25 0 0" size="0.02"',
        'pos="0.125 0 0" quat="0.7071067811865476 0 0.7071067811865476 0" size="0.02 0.125"',
    ),
    "an attribute instead of a class": (
        'name="elbow" class="arm"', 'name="elbow" damping="0.2" armature="0.01"'
    ),
    "attributes in another order": ('name="push" joint="left"', 'joint="left" name="push"'),
    "a coupling the other way round": (
        'joint1="left" joint2="right"', 'joint1="right" joint2="left"'
    ),
    "an axis of another length": ('axis="0 1 0.3"', 'axis="0 2 0.6"'),
    "a quaternion and its negative": ('quat="0.9 0.1 0.2 0.3"', 'quat="-0.9 -0.1 -0.2 -0.3"'),
    "a servo in general terms": (
        '<position name="close" tendon="grip" kp="60"/>',
        '<general name="close" tendon="grip" biastype="affine" gainprm="60" biasprm="0 -60 0"/>',
    ),
    "a default that is said": ('name="cube_shape"', 'name="cube_shape" condim="3" priority="0"'),
    "a solref by its default": ('<pair name="cube_on_floor"', '<pair name="cube_on_floor" gap="0"'),
}  # fmt: skip


def _polycoef(first: str, second: str, coefficients: str) -> str:
    """Return the attributes of a coupling of two joints."""
    return f'joint1="{first}" joint2="{second}" polycoef="{coefficients} 0 0 0"'


def _in_degrees(text: str) -> str:
    """Return RICH with angles in degrees."""
    for old, new in (
        ('<compiler angle="radian"/>', ""),
        ('euler="0 0 0.1"', f'euler="0 0 {np.degrees(0.1)!r}"'),
        ('range="-1.5 0.9"', f'range="{np.degrees(-1.5)!r} {np.degrees(0.9)!r}"'),
        ('springref="0.1"', f'springref="{np.degrees(0.1)!r}"'),
        ('range="-2 2"', f'range="{np.degrees(-2.0)!r} {np.degrees(2.0)!r}"'),
    ):
        assert text.count(old) == 1, old
        text = text.replace(old, new.replace("np.float64(", "").replace(")", ""))
    return text


def _raw_runs(text: str) -> list[np.ndarray]:
    """Run a text by plain MuJoCo, with commands of a seed; qpos and qvel of each step.

    One run begins with the cube on the floor; in another it is thrown on the arm, and the arm
    begins beyond a stop: what acts only there shows.
    """
    raw = mujoco.MjModel.from_xml_string(text)
    runs = []
    for seed, height in ((0, 0.0), (1, 0.55)):
        data, random = mujoco.MjData(raw), np.random.default_rng(seed)
        cube = int(raw.jnt_qposadr[raw.joint("cube").id])
        if height:
            data.qpos[cube : cube + 3] = 0.3, 0.01, height + 0.1
            data.qpos[raw.jnt_qposadr[raw.joint("shoulder").id]] = 0.95
        data.qvel[raw.jnt_dofadr[raw.joint("wheel").id] :][:3] = 1.0, 2.0, 3.0
        data.qvel[raw.jnt_dofadr[raw.joint("cube").id] :][:2] = 0.5, 0.2
        rows = []
        for step in range(500):
            if step % 25 == 0:
                data.ctrl[:] = random.uniform(-2, 2, raw.nu)
            mujoco.mj_step(raw, data)
            rows.append(np.concatenate((data.qpos, data.qvel)))
        runs.append(np.array(rows))
    return runs


def _moves_otherwise(left: str, right: str) -> bool:
    return any(
        not np.array_equal(one, other)
        for one, other in zip(_raw_runs(left), _raw_runs(right), strict=True)
    )


def _models(folder: Path, right: str) -> tuple[sm.Model, sm.Model]:
    for name, text in (("left", RICH), ("right", right)):
        (folder / f"{name}.xml").write_text(text, encoding="utf-8")
    return sm.load(folder / "left.xml"), sm.load(folder / "right.xml")


def _listed(left: sm.Model, right: sm.Model) -> list[ModelDifference]:
    return list(differences_of(left, right, match_models(left, right)))


def _check_that_it_is_listed(edit: AttributeEdit, folder: Path) -> None:
    right = edit.applied(RICH)
    if _moves_otherwise(RICH, right):
        rows = _listed(*_models(folder, right))
        assert rows, f"{edit} moves the robot otherwise, and is not listed"


@pytest.mark.parametrize("edit", DRAWN[:12], ids=str)
def test_what_moves_otherwise_is_listed(edit: AttributeEdit, tmp_path: Path) -> None:
    _check_that_it_is_listed(edit, tmp_path)


@pytest.mark.slow
def test_most_of_the_drawn_edits_move_the_robot() -> None:
    """Else that they are listed would say little."""
    moving = [edit for edit in DRAWN if _moves_otherwise(RICH, edit.applied(RICH))]
    assert len(moving) >= 55


@pytest.mark.slow
@pytest.mark.parametrize("edit", EVERY, ids=str)
def test_each_attribute_that_moves_the_robot_is_listed(edit: AttributeEdit, tmp_path: Path) -> None:
    _check_that_it_is_listed(edit, tmp_path)


@pytest.mark.parametrize("way", SAID_OTHERWISE)
def test_what_says_the_same_is_not_listed(way: str, tmp_path: Path) -> None:
    old, new = SAID_OTHERWISE[way]
    assert RICH.count(old) == 1
    assert _listed(*_models(tmp_path, RICH.replace(old, new))) == []


def test_degrees_say_the_same_as_radians(tmp_path: Path) -> None:
    assert _listed(*_models(tmp_path, _in_degrees(RICH))) == []


# What no edit of a compiled model can undo: the text of the right without it has the left's bits.
COMPILED_ANEW = {
    "a filter of a servo": AttributeEdit("position", "lift", "timeconst", "0.05"),
    "a law without a state": AttributeEdit("general", "bend", "dyntype", "none"),
    "another target": AttributeEdit("position", "lift", "joint", "elbow"),
}


@pytest.mark.parametrize("name", COMPILED_ANEW)
def test_what_is_compiled_anew_moves_as_the_left_to_the_last_bit(name: str, tmp_path: Path) -> None:
    left, right = _models(tmp_path, COMPILED_ANEW[name].applied(RICH))
    found = causes(_listed(left, right))
    assert not any(cause.refused for cause in found)
    edits = tuple(edit for cause in found for edit in cause.edits(1))
    spec_edits = tuple(edit for cause in found for edit in cause.spec_edits(1))
    assert spec_edits
    alike = built(right, edits, spec_edits).compiled
    assert alike.na == left.compiled.na
    runs = []
    for raw in (left.compiled, alike):
        data, random = mujoco.MjData(raw), np.random.default_rng(0)
        rows = []
        for step in range(300):
            if step % 25 == 0:
                data.ctrl[:] = random.uniform(-2, 2, raw.nu)
            mujoco.mj_step(raw, data)
            rows.append(np.concatenate((data.qpos, data.qvel)))
        runs.append(np.array(rows))
    assert np.array_equal(*runs)
    assert _moves_otherwise(RICH, (tmp_path / "right.xml").read_text(encoding="utf-8"))


PAIR = """<mujoco><compiler angle="radian"/><option gravity="3 0 -9.81"/><worldbody>
<body pos="0.02 0 0"><joint name="a" axis="0 1 0"/><geom size="0.02" pos="0 0 0.03"/></body>
<body pos="-0.03 0 0"><joint name="b" axis="0 1 0"/><geom size="0.025" pos="0 0 0.03"/></body>
</worldbody><equality><joint {}/></equality></mujoco>"""


@pytest.mark.parametrize(
    ("left", "right", "listed"),
    [
        (_polycoef("a", "b", "0.2 -1"), _polycoef("b", "a", "0.2 -1"), []),
        (_polycoef("a", "b", "0.1 2"), _polycoef("b", "a", "-0.05 0.5"), ["softness by"]),
        (_polycoef("a", "b", "0.2 -1"), _polycoef("b", "a", "0.3 -1"), ["parameters"]),
    ],
    ids=["the same", "softened by another joint", "another offset"],
)  # fmt: skip
def test_a_coupling_said_the_other_way_round(left, right, listed, tmp_path):
    """With a factor other than 1 MuJoCo softens it by the other joint, and it moves otherwise."""
    models = []
    for name, words in (("left", left), ("right", right)):
        (tmp_path / f"{name}.xml").write_text(PAIR.format(words), encoding="utf-8")
        models.append(sm.load(tmp_path / f"{name}.xml"))
    assert [row.subject for row in _listed(*models)] == listed
    ends = []
    for model in models:
        data = mujoco.MjData(model.compiled)
        mujoco.mj_step(model.compiled, data, 500)
        ends.append(np.array(data.qpos))
    assert np.allclose(*ends, rtol=0, atol=1e-9) is not bool(listed)
