"""Small models that differ in one attribute each, for what compares and what writes files."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

RADIANS = '<compiler angle="radian" autolimits="false"/>'
TETRAHEDRON = '<asset><mesh name="m" vertex="0 0 0 .3 0 0 0 .2 0 0 0 .1" inertia="legacy"/></asset>'


def scene(world: str, rest: str = "", before: str = "") -> str:
    """Return an MJCF text of what stands in its world, behind that, and before."""
    return f"<mujoco>{before}<worldbody>{world}</worldbody>{rest}</mujoco>"


def joint(attributes: str, before: str = "", kind: str = "hinge") -> str:
    """Return a body on a joint."""
    return scene(
        f'<body name="b"><joint name="j" type="{kind}" axis="0 1 0" {attributes}/>'
        '<geom size=".1" mass="2" pos=".1 0 0"/></body>',
        before=before,
    )


def geom(attributes: str, before: str = "", more: str = "") -> str:
    """Return a body of a geom, which weighs nothing of its own."""
    return scene(
        '<body name="b"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5"/>'
        f'<geom name="g" {attributes}/></body>{more}',
        before=before,
    )


def body(attributes: str, before: str = "") -> str:
    """Return a body on a body."""
    return scene(
        '<body name="a"><joint name="i" axis="1 0 0"/><geom size=".1"/>'
        f'<body name="b" {attributes}><joint name="j" axis="0 1 0"/>'
        '<geom size=".1" mass="2" pos=".1 0 0"/></body></body>',
        before=before,
    )


def inertial(attributes: str, before: str = "") -> str:
    """Return a body with an inertial."""
    return scene(
        f'<body name="b"><joint name="j" axis="0 1 0"/><inertial {attributes}/>'
        '<geom size=".1" pos=".1 0 0"/></body>',
        before=before,
    )


def actuator(element: str, kind: str = "hinge") -> str:
    """Return two joints and an actuator of the first."""
    return scene(
        f'<body name="b"><joint name="j" axis="0 1 0" type="{kind}"/>'
        '<geom size=".1" mass="2" pos=".1 0 0"/><body name="c" pos=".3 0 0">'
        '<joint name="k" axis="0 1 0"/><geom size=".1" mass="2" pos=".1 0 0"/></body></body>',
        f"<actuator><{element}/></actuator>",
    )


def tied(rest: str) -> str:
    """Return two joints, with what stands behind them."""
    return scene(
        '<site name="w" pos="0 0 1"/><body name="b"><joint name="j" axis="0 1 0"/>'
        '<geom name="g" size=".1" mass="2" pos=".1 0 0"/><body name="c" pos=".3 0 0">'
        '<joint name="k" axis="0 1 0"/><geom name="h" size=".1" mass="2" pos=".1 0 0"/>'
        '<site name="s"/></body></body><body name="d" pos="1 0 0"><freejoint/>'
        '<geom name="i" size=".1"/></body>',
        rest,
    )


def pair(attributes: str) -> str:
    """Return a contact pair."""
    return tied(f'<contact><pair name="p" geom1="h" geom2="i" {attributes}/></contact>')


def option(text: str) -> str:
    """Return a body with some options."""
    return joint("", before=text)


# What makes a text of a fragment, the fragment of the left, that of the right, and what is
# written of which attribute.
Make = Callable[[str], str]
CASES: dict[str, tuple[Make, str, str, dict[str, str]]] = {
    "range in degrees": (
        joint, 'range="-20 30"', 'range="-25 30"', {"range": "-20 30"},
    ),
    "range in radians": (
        lambda text: joint(text, RADIANS), 'limited="true" range="-.2 .3"',
        'limited="true" range="-.2 .4"', {"range": "-0.2 0.3"},
    ),
    "range of a slide": (
        lambda text: joint(text, kind="slide"), 'range="-.2 .3"', 'range="-.2 .4"',
        {"range": "-0.2 0.3"},
    ),
    "range that does not count": (
        lambda text: joint(text, RADIANS), 'limited="true" range="-.2 .3"', "",
        {"range": "-0.2 0.3", "limited": "true"},
    ),
    "range that is too much": (joint, "", 'range="-20 30"', {"limited": "false"}),
    "actuatorfrcrange": (
        joint, 'actuatorfrcrange="-2 3"', 'actuatorfrcrange="-2 4"', {"actuatorfrcrange": "-2 3"},
    ),
    "stiffness": (joint, 'stiffness="3"', 'stiffness="4"', {"stiffness": "3"}),
    "damping": (joint, 'damping="3"', 'damping="4"', {"damping": "3"}),
    "springref": (
        joint, 'stiffness="3" springref="20"', 'stiffness="3" springref="30"',
        {"springref": "20"},
    ),
    "springref in radians": (
        lambda text: joint(text, RADIANS), 'stiffness="3" springref=".2"', 'stiffness="3"',
        {"springref": "0.2"},
    ),
    "springref of a slide": (
        lambda text: joint(text, kind="slide"), 'stiffness="3" springref=".2"', 'stiffness="3"',
        {"springref": "0.2"},
    ),
    "frictionloss": (joint, 'frictionloss=".3"', 'frictionloss=".4"', {"frictionloss": "0.3"}),
    "armature": (joint, 'armature=".3"', "", {"armature": "0.3"}),
    "margin": (
        joint, 'range="-20 30" margin=".01"', 'range="-20 30" margin=".02"', {"margin": "0.01"},
    ),
    "solreflimit": (
        joint, 'range="-20 30" solreflimit=".03 .9"', 'range="-20 30"', {"solreflimit": "0.03 0.9"},
    ),
    "solimplimit": (
        joint, 'range="-20 30" solimplimit=".8 .9 .01 .4 3"', 'range="-20 30"',
        {"solimplimit": "0.8 0.9 0.01 0.4 3"},
    ),
    "solreffriction": (
        joint, 'frictionloss=".3" solreffriction=".03 .9"', 'frictionloss=".3"',
        {"solreffriction": "0.03 0.9"},
    ),
    "solimpfriction": (
        joint, 'frictionloss=".3" solimpfriction=".8 .9 .01 .4 3"', 'frictionloss=".3"',
        {"solimpfriction": "0.8 0.9 0.01 0.4 3"},
    ),
    "place of a joint": (joint, 'pos=".1 .2 .3"', 'pos=".1 .2 .4"', {"pos": "0.1 0.2 0.3"}),
    "gravcomp": (body, 'gravcomp=".5"', 'gravcomp=".6"', {"gravcomp": "0.5"}),
    "place of a body": (body, 'pos=".1 .2 .3"', 'pos=".1 .2 .4"', {"pos": "0.1 0.2 0.3"}),
    "turn of a body": (
        body, 'quat="0.6 0 0.8 0"', 'quat="0.8 0 0.6 0"', {"quat": "0.6 0 0.8 0"},
    ),
    "turn of a body by an axis": (
        body, 'axisangle="0 0 1 90"', 'axisangle="0 0 1 80"',
        {"axisangle": "", "quat": "0.7071067811865476 0 0 0.7071067811865475"},
    ),
    "turn of a body that had none": (
        body, 'pos=".1 0 0" quat="0.6 0 0.8 0"', 'pos=".1 0 0"', {"quat": "0.6 0 0.8 0"},
    ),
    "Euler angles in degrees": (
        body, 'euler="10 20 30"', 'euler="10 25 30"', {"euler": "10 20 30"},
    ),
    "Euler angles about fixed axes": (
        lambda text: body(text, '<compiler angle="radian" eulerseq="XYZ"/>'),
        'euler=".1 .2 .3"', 'euler=".1 .25 .3"', {"euler": "0.1 0.2 0.3"},
    ),
    "Euler angles in another order": (
        lambda text: body(text, '<compiler angle="radian" eulerseq="zyx"/>'),
        'euler=".1 .2 .3"', 'euler=".1 .25 .3"', {"euler": "0.1 0.2 0.3"},
    ),
    "mass": (
        inertial, 'pos="0 0 0" mass="2" diaginertia="1 2 2.5"',
        'pos="0 0 0" mass="3" diaginertia="1 2 2.5"', {"mass": "2"},
    ),
    "centre of mass": (
        inertial, 'pos=".1 .2 .3" mass="2" diaginertia="1 2 2.5"',
        'pos=".1 .2 .4" mass="2" diaginertia="1 2 2.5"', {"pos": "0.1 0.2 0.3"},
    ),
    "moments": (
        inertial, 'pos="0 0 0" mass="2" diaginertia="2.5 2 1"',
        'pos="0 0 0" mass="2" diaginertia="2.5 2 1.5"', {"diaginertia": "2.5 2 1"},
    ),
    "full inertia": (
        inertial, 'pos="0 0 0" mass="2" fullinertia="2.5 2 1 .1 .2 .3"',
        'pos="0 0 0" mass="2" fullinertia="2.5 2 1.5 .1 .2 .3"',
        {"fullinertia": "2.5 2 1 0.1 0.2 0.3"},
    ),
    "axes of an inertia": (
        inertial, 'pos="0 0 0" mass="2" diaginertia="2.5 2 1" quat="0.6 0 0.8 0"',
        'pos="0 0 0" mass="2" diaginertia="2.5 2 1" quat="0.8 0 0.6 0"',
        {"quat": "0.6 0 0.8 0"},
    ),
    "size of a ball": (geom, 'size=".1"', 'size=".2"', {"size": "0.1"}),
    "size of a capsule": (
        geom, 'type="capsule" size=".1 .2"', 'type="capsule" size=".1 .3"', {"size": "0.1 0.2"},
    ),
    "size of a cylinder": (
        geom, 'type="cylinder" size=".1 .2"', 'type="cylinder" size=".1 .3"', {"size": "0.1 0.2"},
    ),
    "size of an ellipsoid": (
        geom, 'type="ellipsoid" size=".1 .2 .3"', 'type="ellipsoid" size=".1 .2 .4"',
        {"size": "0.1 0.2 0.3"},
    ),
    "size of a box": (
        geom, 'type="box" size=".1 .2 .3"', 'type="box" size=".1 .2 .4"', {"size": "0.1 0.2 0.3"},
    ),
    "place of a box": (
        geom, 'type="box" size=".1 .2 .3" pos=".1 0 0"', 'type="box" size=".1 .2 .3" pos=".2 0 0"',
        {"pos": "0.1 0 0"},
    ),
    "turn of a box": (
        geom, 'type="box" size=".1 .2 .3" pos=".1 0 0" euler="0 0 20"',
        'type="box" size=".1 .2 .3" pos=".1 0 0" euler="0 0 30"', {"euler": "0 0 20"},
    ),
    "ends of a cylinder": (
        geom, 'type="cylinder" size=".1" fromto="0 0 0 .2 .3 .4"',
        'type="cylinder" size=".15" fromto="0 0 0 .2 .3 .5"',
        {"size": "0.1", "fromto": "0 0 0 0.2 0.3 0.4"},
    ),
    "kind of a geom": (
        geom, 'type="ellipsoid" size=".1 .2 .3"', 'type="box" size=".1 .2 .4"',
        {"type": "ellipsoid", "size": "0.1 0.2 0.3"},
    ),
    "friction": (
        geom, 'size=".1" friction=".5 .01 .002"', 'size=".1" friction=".5 .01 .003"',
        {"friction": "0.5 0.01 0.002"},
    ),
    "friction of one number": (
        geom, 'size=".1" friction=".5"', 'size=".1" friction=".6"', {"friction": "0.5"},
    ),
    "condim": (geom, 'size=".1" condim="4"', 'size=".1" condim="6"', {"condim": "4"}),
    "contype": (geom, 'size=".1" contype="3"', 'size=".1" contype="5"', {"contype": "3"}),
    "conaffinity": (
        geom, 'size=".1" conaffinity="3"', 'size=".1" conaffinity="5"', {"conaffinity": "3"},
    ),
    "priority": (geom, 'size=".1" priority="2"', 'size=".1"', {"priority": "2"}),
    "solmix": (geom, 'size=".1" solmix="2"', 'size=".1"', {"solmix": "2"}),
    "margin of a geom": (geom, 'size=".1" margin=".02"', 'size=".1"', {"margin": "0.02"}),
    "gap of a geom": (
        geom, 'size=".1" margin=".02" gap=".01"', 'size=".1" margin=".02"', {"gap": "0.01"},
    ),
    "solref of a geom": (geom, 'size=".1" solref=".03 .9"', 'size=".1"', {"solref": "0.03 0.9"}),
    "kp": (
        actuator, 'position name="a" joint="j" kp="3" kv=".5"',
        'position name="a" joint="j" kp="4" kv=".5"', {"kp": "3"},
    ),
    "kv of a position servo": (
        actuator, 'position name="a" joint="j" kp="3" kv=".5"',
        'position name="a" joint="j" kp="3" kv=".6"', {"kv": "0.5"},
    ),
    "damping ratio": (
        actuator, 'position name="a" joint="j" kp="3" kv=".5"',
        'position name="a" joint="j" kp="3" dampratio="1"', {"kv": "0.5", "dampratio": ""},
    ),
    "kv of a velocity servo": (
        actuator, 'velocity name="a" joint="j" kv="3"', 'velocity name="a" joint="j" kv="4"',
        {"kv": "3"},
    ),
    "filter of a servo": (
        actuator, 'position name="a" joint="j" kp="3" timeconst=".1"',
        'position name="a" joint="j" kp="3" timeconst=".2"', {"timeconst": "0.1"},
    ),
    "filter of a cylinder": (
        actuator, 'cylinder name="a" joint="j" timeconst=".1"',
        'cylinder name="a" joint="j" timeconst=".2"', {"timeconst": "0.1"},
    ),
    "gear": (
        actuator, 'motor name="a" joint="j" gear="2"', 'motor name="a" joint="j" gear="3"',
        {"gear": "2"},
    ),
    "ctrlrange": (
        actuator, 'motor name="a" joint="j" ctrlrange="-2 3"',
        'motor name="a" joint="j" ctrlrange="-2 4"', {"ctrlrange": "-2 3"},
    ),
    "forcerange": (
        actuator, 'motor name="a" joint="j" forcerange="-2 3"', 'motor name="a" joint="j"',
        {"forcerange": "-2 3", "forcelimited": "true"},
    ),
    "actrange": (
        actuator, 'intvelocity name="a" joint="j" kp="2" actrange="-2 3"',
        'intvelocity name="a" joint="j" kp="2" actrange="-2 4"', {"actrange": "-2 3"},
    ),
    "gains of a general": (
        actuator, 'general name="a" joint="j" gainprm="2" biastype="affine" biasprm="1 -2 -3"',
        'general name="a" joint="j" gainprm="3" biastype="affine" biasprm="1 -2 -4"',
        {"gainprm": "2", "biasprm": "1 -2 -3"},
    ),
    "kinds of gains of a general": (
        actuator, 'general name="a" joint="j" gaintype="affine" gainprm="2 1 0" biasprm="1 -2 -3" '
        'biastype="affine"', 'general name="a" joint="j" gainprm="2 1 0" biasprm="1 -2 -3"',
        {"gaintype": "affine", "biastype": "affine"},
    ),
    "dynamics of a general": (
        actuator, 'general name="a" joint="j" dyntype="filter" dynprm=".1"',
        'general name="a" joint="j" dyntype="filter" dynprm=".2"', {"dynprm": "0.1"},
    ),
    "what an actuator drives": (
        actuator, 'motor name="a" joint="j"', 'motor name="a" joint="k"', {"joint": "j"},
    ),
    "range of a tendon": (
        tied, '<tendon><fixed name="t" range="-.2 .3"><joint joint="j" coef="2"/></fixed></tendon>',
        '<tendon><fixed name="t" range="-.2 .4"><joint joint="j" coef="2"/></fixed></tendon>',
        {"range": "-0.2 0.3"},
    ),
    "coefficient in a tendon": (
        tied, '<tendon><fixed name="t" stiffness="2"><joint joint="j" coef="2"/><joint joint="k" '
        'coef="3"/></fixed></tendon>',
        '<tendon><fixed name="t" stiffness="2"><joint joint="j" coef="2"/><joint joint="k" '
        'coef="4"/></fixed></tendon>', {"coef": "3"},
    ),
    "springlength": (
        tied, '<tendon><spatial name="t" stiffness="2" springlength=".1 .2"><site site="w"/>'
        '<site site="s"/></spatial></tendon>',
        '<tendon><spatial name="t" stiffness="2" springlength=".1 .3"><site site="w"/>'
        '<site site="s"/></spatial></tendon>', {"springlength": "0.1 0.2"},
    ),
    "frictionloss of a tendon": (
        tied, '<tendon><fixed name="t" frictionloss="2"><joint joint="j" coef="2"/></fixed>'
        "</tendon>",
        '<tendon><fixed name="t" frictionloss="3"><joint joint="j" coef="2"/></fixed></tendon>',
        {"frictionloss": "2"},
    ),
    "polycoef": (
        tied, '<equality><joint joint1="j" joint2="k" polycoef=".1 .2 .3 .4 .5"/></equality>',
        '<equality><joint joint1="j" joint2="k" polycoef=".1 .2 .3 .4 .6"/></equality>',
        {"polycoef": "0.1 0.2 0.3 0.4 0.5"},
    ),
    "anchor": (
        tied, '<equality><connect body1="c" body2="d" anchor=".1 .2 .3"/></equality>',
        '<equality><connect body1="c" body2="d" anchor=".1 .2 .4"/></equality>',
        {"anchor": "0.1 0.2 0.3"},
    ),
    "solref of an equality": (
        tied, '<equality><connect body1="c" body2="d" anchor=".1 .2 .3" solref=".03 .9"/>'
        "</equality>",
        '<equality><connect body1="c" body2="d" anchor=".1 .2 .3"/></equality>',
        {"solref": "0.03 0.9"},
    ),
    "an equality that is off": (
        tied, '<equality><joint joint1="j" joint2="k" active="false"/></equality>',
        '<equality><joint joint1="j" joint2="k"/></equality>', {"active": "false"},
    ),
    "friction of a pair": (
        pair, 'friction=".5 .6 .01 .002 .003"', 'friction=".5 .7 .01 .002 .003"',
        {"friction": "0.5 0.6 0.01 0.002 0.003"},
    ),
    "condim of a pair": (pair, 'condim="4"', 'condim="6"', {"condim": "4"}),
    "integrator": (
        option, '<option integrator="RK4"/>', '<option integrator="implicitfast"/>',
        {"integrator": "RK4"},
    ),
    "integrator that is not said": (option, "", '<option integrator="RK4"/>',
                                    {"integrator": "Euler"}),
    "timestep": (option, '<option timestep=".003"/>', "", {"timestep": "0.003"}),
    "gravity": (
        option, '<option gravity="1 2 3"/>', '<option gravity="1 2 4"/>', {"gravity": "1 2 3"},
    ),
    "the last option of a file wins": (
        lambda text: joint("", text + '<option density="2"/>'), '<option timestep=".003"/>',
        '<option timestep=".004"/>', {"timestep": "0.003"},
    ),
    "flag that disables": (
        option, '<option><flag gravity="disable"/></option>', "", {"gravity": "disable"},
    ),
    "flag that is not to disable": (
        option, "", '<option><flag gravity="disable"/></option>', {"gravity": "enable"},
    ),
    "flag that enables": (
        option, '<option><flag multiccd="enable"/></option>',
        '<option><flag multiccd="disable"/></option>', {"multiccd": "enable"},
    ),
    "groups of actuators": (
        lambda text: actuator('motor name="a" joint="j" group="2"').replace("<worldbody>",
                                                                         f"{text}<worldbody>"),
        '<option actuatorgroupdisable="2 3"/>', '<option actuatorgroupdisable="1"/>',
        {"actuatorgroupdisable": "2 3"},
    ),
}  # fmt: skip


def compiled(path: Path) -> Any:
    """Return what MuJoCo compiles of a file."""
    return mujoco.MjModel.from_xml_path(str(path))


def differing_arrays(left: Any, right: Any) -> list[str]:
    """Return the arrays and options in which two compiled models have other numbers."""
    names: list[str] = []
    for holders in ((left, right), (left.opt, right.opt)):
        for name in dir(holders[0]):
            ours, theirs = (getattr(holder, name, math.nan) for holder in holders)
            is_number = isinstance(ours, int | float) or (
                isinstance(ours, np.ndarray) and ours.dtype.kind in "fiub"
            )
            if name.startswith("_") or not is_number or "rgba" in name or name == "paths":
                continue
            if not np.allclose(ours, theirs, rtol=1e-9, atol=1e-12):
                names.append(name)
    return names
