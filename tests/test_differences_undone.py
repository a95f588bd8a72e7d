"""Each difference of two compiled models: what it is, by how much, and that its edits undo it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.mujoco.differences import edited, entries, flags, settings_of
from statemachine.engines.mujoco.given_parts import counts, with_parts
from statemachine.engines.mujoco.respecified import in_places_of, respecified
from statemachine.engines.records import ElementReference, ModelDifference, SpecEdit
from statemachine.errors import ModelError
from statemachine.interface.records import AS_WRITTEN

from .support.attributes import CASES, actuator, compiled, differing_arrays, tied
from .support.files import written
from .support.two_files import causes_of_texts

DEGREE = math.pi / 180
# Of some cases the subject, and of each quantity both values and the unit.
FIGURES: dict[str, tuple[str, dict[str, tuple[Any, Any, str]]]] = {
    "range in degrees": (
        "range",
        {"range": ((-20 * DEGREE, 30 * DEGREE), (-25 * DEGREE, 30 * DEGREE), "rad")},
    ),
    "range of a slide": ("range", {"range": ((-0.2, 0.3), (-0.2, 0.4), "m")}),
    "range that does not count": ("range", {"range": ((-0.2, 0.3), None, "rad")}),
    "actuatorfrcrange": ("force limit", {"actfrcrange": ((-2, 3), (-2, 4), "N·m")}),
    "stiffness": ("spring", {"stiffness": (3, 4, "N·m/rad")}),
    "damping": ("damping", {"damping": (3, 4, "N·m·s")}),
    "springref": ("rest of the spring", {"springref": (20 * DEGREE, 30 * DEGREE, "rad")}),
    "springref of a slide": ("rest of the spring", {"springref": (0.2, 0, "m")}),
    "frictionloss": ("dry friction", {"frictionloss": (0.3, 0.4, "N·m")}),
    "armature": ("armature", {"armature": (0.3, 0, "kg m²")}),
    "margin": ("stop", {"margin": (0.01, 0.02, "rad")}),
    "solreflimit": ("stop", {"solref": ((0.03, 0.9), (0.02, 1), "")}),
    "solimpfriction": (
        "softness of dry friction",
        {"solimp": ((0.8, 0.9, 0.01, 0.4, 3), (0.9, 0.95, 0.001, 0.5, 2), "")},
    ),
    "place of a joint": ("anchor", {"anchor": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m")}),
    "gravcomp": ("weight taken off", {"gravcomp": (0.5, 0.6, "")}),
    "place of a body": ("place", {"place": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m")}),
    "turn of a body by an axis": ("place", {"turned by": (0, 10 * DEGREE, "rad")}),
    "turn of a body": ("place", {"turned by": (0, 2 * math.acos(0.96), "rad")}),
    "turn of a body that had none": ("place", {"turned by": (0, 2 * math.acos(0.6), "rad")}),
    "Euler angles about fixed axes": ("place", {"turned by": (0, 0.05, "rad")}),
    "mass": ("mass", {"mass": (2, 3, "kg")}),
    "centre of mass": ("centre of mass", {"com": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m")}),
    "moments": ("inertia", {"moments": ((2.5, 2, 1), (2.5, 2, 1.5), "kg m²")}),
    "axes of an inertia": ("inertia", {"turned by": (0, 2 * math.acos(0.96), "rad")}),
    "size of a ball": ("shape", {"size": ((0.1,), (0.2,), "m")}),
    "size of a capsule": ("shape", {"size": ((0.1, 0.2), (0.1, 0.3), "m")}),
    "size of a box": ("shape", {"size": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m")}),
    "place of a box": ("place", {"place": ((0.1, 0, 0), (0.2, 0, 0), "m")}),
    "turn of a box": ("place", {"turned by": (0, 10 * DEGREE, "rad")}),
    "kind of a geom": (
        "shape",
        {"type": ("ellipsoid", "box", ""), "size": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m")},
    ),
    "friction": ("friction", {"friction": ((0.5, 0.01, 0.002), (0.5, 0.01, 0.003), "")}),
    "friction of one number": ("friction", {"friction": (0.5, 0.6, "")}),
    "condim": ("friction dimensions", {"condim": (4, 6, "")}),
    "priority": ("priority", {"priority": (2, 0, "")}),
    "solmix": ("softness", {"solmix": (2, 1, "")}),
    "margin of a geom": ("margin", {"margin": (0.02, 0, "m")}),
    "gap of a geom": ("margin", {"gap": (0.01, 0, "m")}),
    "kp": ("gains", {"kp": (3, 4, "N·m/rad")}),
    "kv of a position servo": ("gains", {"kv": (0.5, 0.6, "N·m·s")}),
    "kv of a velocity servo": ("gains", {"kv": (3, 4, "N·m·s")}),
    "filter of a servo": ("dynamics", {"timeconst": (0.1, 0.2, "s")}),
    "gear": ("gear", {"gear": (2, 3, "")}),
    "ctrlrange": ("range of ctrl", {"ctrlrange": ((-2, 3), (-2, 4), "")}),
    "forcerange": ("force range", {"forcerange": ((-2, 3), None, "N·m")}),
    "gains of a general": (
        "gains",
        {"gainprm": (2, 3, ""), "biasprm": ((1, -2, -3), (1, -2, -4), "")},
    ),
    "what an actuator drives": ("transmission", {"drives": ("joint j", "joint k", "")}),
    "range of a tendon": ("range", {"range": ((-0.2, 0.3), (-0.2, 0.4), "rad")}),
    "coefficient in a tendon": ("coefficients", {"coef[1]": (3, 4, "")}),
    "springlength": ("slack length", {"lengthspring": ((0.1, 0.2), (0.1, 0.3), "m")}),
    "polycoef": (
        "parameters",
        {"polycoef": ((0.1, 0.2, 0.3, 0.4, 0.5), (0.1, 0.2, 0.3, 0.4, 0.6), "")},
    ),
    "anchor": (
        "parameters",
        {
            "anchor in body 1": ((0.1, 0.2, 0.3), (0.1, 0.2, 0.4), "m"),
            "anchor in body 2": ((-0.6, 0.2, 0.3), (-0.6, 0.2, 0.4), "m"),
        },
    ),
    "an equality that is off": ("active", {"active0": (False, True, "")}),
    "friction of a pair": ("friction", {"friction": ((0.5, 0.6), (0.5, 0.7), "")}),
    "integrator": ("integrator", {"integrator": ("rk4", "implicitfast", "")}),
    "gravity": ("gravity", {"gravity": ((1, 2, 3), (1, 2, 4), "m/s²")}),
    "flag that disables": ("gravity", {"flag gravity": ("off", "on", "")}),
    "flag that enables": ("multiccd", {"flag multiccd": ("on", "off", "")}),
    "groups of actuators": ("actuator groups", {"disableactuator": (12, 2, "")}),
}
# Of a compiled model: what no motion depends on, or what is kept otherwise after an edit.
KEPT_OTHERWISE = {
    *("bvh_aabb", "bvh_nodeid", "bvh_child", "bvh_depth", "body_bvhadr", "body_bvhnum", "nbvh"),
    *("disableflags", "geom_rbound", "geom_aabb", "nbvhstatic", "nbvhdynamic", "signature"),
    *("jnt_range", "geom_sameframe", "body_sameframe", "body_simple", "dof_simplenum"),
    *("site_sameframe", "dof_length", "actuator_ctrlrange", "flg_energypotential"),
}


def differences(
    folder: Path, name: str
) -> tuple[tuple[ModelDifference, ...], tuple[sm.Model, sm.Model]]:
    """Return the differences of a case, and both models."""
    make, left, right, _ = CASES[name]
    found = causes_of_texts(folder, make(left), make(right))
    return found, (sm.load(folder / "left.xml"), sm.load(folder / "right.xml"))


def undone(right: sm.Model, found: tuple[ModelDifference, ...]) -> Any:
    """Return the second model with what brings it to the first."""
    spec_edits = [edit for row in found for edit in row.spec_edits]
    raw = right.compiled
    if spec_edits:
        raw = respecified(right.path, raw, spec_edits)
    return edited(raw, [edit for row in found for edit in row.edits])


@pytest.mark.parametrize("name", CASES)
def test_edits_bring_the_second_to_the_first(name: str, tmp_path: Path) -> None:
    found, (left, right) = differences(tmp_path, name)
    assert found
    assert set(differing_arrays(left.compiled, undone(right, found))) <= KEPT_OTHERWISE
    assert set(differing_arrays(left.compiled, right.compiled)) - KEPT_OTHERWISE or (
        "range" in name or "flag" in name
    )


@pytest.mark.parametrize("name", FIGURES)
def test_a_difference_has_its_values_and_their_unit(name: str, tmp_path: Path) -> None:
    subject, values = FIGURES[name]
    (found,), _ = differences(tmp_path, name)
    assert found.subject == subject
    assert {value.quantity: value.unit for value in found.values} == {
        quantity: unit for quantity, (_, _, unit) in values.items()
    }
    for value in found.values:
        for got, wanted in zip((value.left, value.right), values[value.quantity][:2], strict=True):
            assert got == (
                wanted
                if wanted is None or isinstance(wanted, str | bool)
                else pytest.approx(wanted, rel=1e-7, abs=1e-12)
            )


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("range in degrees", ["range"]),
        ("place of a body", ["place"]),
        ("friction", ["friction"]),
        ("kp", ["gains"]),
        ("gravity", ["gravity"]),
    ],
)
def test_a_difference_of_one_entry_is_that_entry(
    name: str, parts: list[str], tmp_path: Path
) -> None:
    (found,), (_, right) = differences(tmp_path, name)
    assert [row.subject for row in entries(right.compiled, found)] == parts


ENTRIES: dict[str, tuple[str, str, dict[str, tuple[float, float, str]]]] = {
    "joint": (
        'range="-20 30"',
        'range="-25 40"',
        {
            "range (lower end)": (-20 * DEGREE, -25 * DEGREE, "rad"),
            "range (upper end)": (30 * DEGREE, 40 * DEGREE, "rad"),
        },
    ),
    "pair": (
        'friction=".5 .6 .01 .002 .003"',
        'friction=".5 .7 .01 .002 .004"',
        {
            "friction (friction[1])": (0.6, 0.7, ""),
            "friction (friction[4])": (0.003, 0.004, ""),
        },
    ),
    "option": (
        '<option gravity="1 2 3"/>',
        '<option gravity="1 3 4"/>',
        {"gravity (y)": (2, 3, "m/s²"), "gravity (z)": (3, 4, "m/s²")},
    ),
    "actuator": (
        'position name="a" joint="j" kp="3" kv=".5"',
        'position name="a" joint="j" kp="4" kv=".6"',
        {"gains (kp)": (3, 4, "N·m/rad"), "gains (kv)": (0.5, 0.6, "N·m·s")},
    ),
    "general": (
        'general name="a" joint="j" gainprm="2" biastype="affine" biasprm="1 -2 -3"',
        'general name="a" joint="j" gainprm="3" biastype="affine" biasprm="1 -2 -4"',
        {"gains (gainprm[0])": (2, 3, ""), "gains (biasprm[2])": (-3, -4, "")},
    ),
}
MAKERS = {
    "joint": CASES["range in degrees"][0],
    "pair": CASES["friction of a pair"][0],
    "option": CASES["gravity"][0],
    "actuator": actuator,
    "general": actuator,
}


@pytest.mark.parametrize("name", ENTRIES)
def test_a_difference_is_told_entry_by_entry(name: str, tmp_path: Path) -> None:
    left, right, wanted = ENTRIES[name]
    texts = MAKERS[name](left), MAKERS[name](right)
    (found,) = causes_of_texts(tmp_path, *texts)
    raw = compiled(tmp_path / "right.xml")
    rows = entries(raw, found)
    assert {row.subject for row in rows} == set(wanted)
    for row in rows:
        (value,) = row.values
        ours, theirs, unit = wanted[row.subject]
        assert (value.left, value.right) == pytest.approx((ours, theirs))
        assert value.unit == unit
    edits = [edit for row in rows for edit in row.edits]
    other = compiled(tmp_path / "left.xml")
    assert set(differing_arrays(other, edited(raw, edits))) <= KEPT_OTHERWISE


def test_the_settings_of_a_model_are_in_words(tmp_path: Path) -> None:
    option = 'integrator="RK4" timestep=".004"'
    text = f'<mujoco><option {option}><flag gravity="disable"/></option></mujoco>'
    settings = settings_of(compiled(written(tmp_path / "m.xml", text)))
    assert (settings["integrator"], settings["timestep"]) == ("rk4", 0.004)
    assert (settings["flag gravity"], settings["flag contact"]) == ("off", "on")
    states = flags(compiled(tmp_path / "m.xml"))
    assert (states["gravity"], states["contact"], states["sleep"]) == (False, True, False)


# Compiled anew.

FILTERED = '<general name="a" joint="j" dyntype="filter" dynprm=".1" gainprm="2"/>'
KEYS = '<keyframe><key name="k" act=".25"/><key name="l" act=".5"/></keyframe>'


def driven(folder: Path, name: str, *elements: str, keys: str = "") -> Path:
    """Write a file of two joints with actuators."""
    return written(folder / name, tied(f"<actuator>{''.join(elements)}</actuator>{keys}"))


def test_an_actuator_gets_a_state_of_its_own(tmp_path: Path) -> None:
    path = driven(tmp_path, "m.xml", FILTERED, '<motor name="b" joint="k"/>', keys=KEYS)
    raw = compiled(path)
    raw.opt.timestep = 0.005
    raw.dof_damping[:] = 3.0
    edits = [
        SpecEdit("actuator", 1, "dyntype", 1.0),
        SpecEdit("actuator", 1, "activations", (0.7, 0.8)),
    ]
    after = respecified(path, raw, edits)
    assert (raw.na, after.na) == (1, 2)
    assert after.actuator_dyntype.tolist() == [2, 1]
    assert after.key_act.tolist() == [[0.25, 0.7], [0.5, 0.8]]
    assert after.opt.timestep == 0.005
    assert after.dof_damping.tolist() == [3.0] * raw.nv


def test_an_actuator_drives_another_joint(tmp_path: Path) -> None:
    path = driven(tmp_path, "m.xml", '<motor name="a" joint="j"/>')
    after = respecified(
        path, compiled(path), [SpecEdit("actuator", 0, "target", ElementReference("joint", 1))]
    )
    assert after.actuator_trnid[0, 0] == 1


def test_a_part_of_what_a_body_weighs_is_set(tmp_path: Path) -> None:
    path = written(tmp_path / "m.xml", tied(""))
    raw = compiled(path)
    after = respecified(path, raw, [SpecEdit("body", 1, "mass", 7.0)])
    assert after.body_mass.tolist() == [0, 7, *raw.body_mass[2:].tolist()]
    assert after.body_inertia == pytest.approx(raw.body_inertia)
    assert after.body_ipos == pytest.approx(raw.body_ipos)


def test_a_model_of_another_file_is_not_compiled_anew(tmp_path: Path) -> None:
    path = driven(tmp_path, "m.xml", '<motor name="a" joint="j"/>')
    other = driven(tmp_path, "o.xml", '<motor name="a" joint="j"/>', '<motor joint="k"/>')
    with pytest.raises(ModelError, match="nu"):
        respecified(path, compiled(other), [SpecEdit("actuator", 0, "dyntype", 1.0)])


@pytest.mark.filterwarnings("ignore:.*settotalmass. is deprecated:UserWarning")
def test_what_the_compiler_makes_something_else_of_is_refused(tmp_path: Path) -> None:
    path = written(
        tmp_path / "m.xml",
        tied("").replace("<worldbody>", '<compiler settotalmass="9"/><worldbody>'),
    )
    with pytest.warns(sm.errors.EngineWarning):
        raw = sm.load(path).compiled
    with pytest.raises(ModelError, match="another mass"):
        respecified(path, raw, [SpecEdit("body", 1, "mass", 7.0)])


def test_edits_of_activations_move_with_them(tmp_path: Path) -> None:
    before = compiled(driven(tmp_path, "m.xml", FILTERED, FILTERED.replace('"a"', '"b"')))
    after = compiled(
        driven(tmp_path, "o.xml", '<motor name="a" joint="j"/>', FILTERED.replace('"a"', '"b"'))
    )
    edits = (
        ("key_act", (0, 0), 0.5),
        ("key_act", (0, 1), 0.75),
        ("key_act", (0,), 1.0),
        ("body_mass", (1,), 2.0),
    )
    assert in_places_of(before, after, edits) == (
        ("key_act", (0, 0), 0.75),
        ("key_act", (0,), 1.0),
        ("body_mass", (1,), 2.0),
    )


# Parts of another file.

FLOOR = '<geom name="ground" type="plane" size="1 1 .1" friction=".25"/>'
WALL = '<geom name="wall" type="plane" size="2 2 .1" contype="0" conaffinity="0"/>'


def test_actuators_and_planes_that_touch_are_counted(tmp_path: Path) -> None:
    text = tied("<actuator><motor joint='j'/><motor joint='k'/></actuator>")
    path = written(tmp_path / "m.xml", text.replace("<site name", f"{FLOOR}{WALL}<site name", 1))
    assert counts(compiled(path)) == {"actuators": 2, "floor": 1}


def test_a_file_gets_the_actuators_of_another(tmp_path: Path) -> None:
    key = '<keyframe><key name="k" ctrl="{}"/></keyframe>'
    taker = driven(tmp_path, "t.xml", '<motor name="old" joint="j"/>', keys=key.format(".1"))
    elements = '<position name="new" joint="k" kp="7" kv=".5" ctrlrange="-1 2"/>', FILTERED
    giver = driven(tmp_path, "g.xml", *elements, keys=key.format(".3 .4"))
    names = {"joint": {"k": "j", "j": "k"}}
    model = with_parts(taker, giver, ("actuators",), names, AS_WRITTEN)
    assert [model.actuator(k).name for k in range(model.nu)] == ["new", "a"]
    assert model.actuator_trnid[:, 0].tolist() == [0, 1]
    assert model.actuator_gainprm[0, 0] == 7
    assert model.actuator_biasprm[0, :3].tolist() == [0, -7, -0.5]
    assert model.actuator_ctrlrange[0].tolist() == [-1, 2]
    assert model.actuator_dynprm[1, 0] == 0.1
    assert model.key_ctrl.tolist() == [[0.3, 0.4]]


def test_an_actuator_of_what_has_no_counterpart_is_not_given(tmp_path: Path) -> None:
    taker = written(tmp_path / "t.xml", tied(""))
    giver = driven(tmp_path, "g.xml", '<motor name="new" joint="k"/>')
    with pytest.raises(ModelError, match="'k'"):
        with_parts(taker, giver, ("actuators",), {"joint": {"j": "j"}}, AS_WRITTEN)


def test_a_file_gets_the_floor_of_another(tmp_path: Path) -> None:
    plain = tied("")
    own = FLOOR.replace("ground", "own").replace(".25", ".75")
    taker = written(tmp_path / "t.xml", plain.replace("<site name", f"{own}<site name", 1))
    giver = written(tmp_path / "g.xml", plain.replace("<site name", f"{FLOOR}{WALL}<site name", 1))
    model = with_parts(taker, giver, ("floor",), {}, AS_WRITTEN)
    names = [model.geom(k).name for k in range(model.ngeom)]
    assert "ground" in names
    assert not {"own", "wall"} & set(names)
    assert model.geom("ground").friction[0] == 0.25
    assert np.flatnonzero(model.geom_type == 0).size == 1
