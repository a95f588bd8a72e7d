"""One attribute of a rich MJCF is changed at a time: what moves otherwise is listed, no more.

Which attribute of which element is drawn by a seed from the schema that MuJoCo prints. Whether a
change moves anything is decided by plain MuJoCo: the same start and the same commands of a seed,
and qpos, qvel and act but for rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.compare.matching import match_models
from statemachine.lab.why.causes import built, causes, differences_of

from .support.rich_model import RICH, raw_states
from .support.schema import (
    WITHOUT_RULE,
    AttributeEdit,
    SchemaAttribute,
    coverage,
    drawn_edits,
    merged,
    restated_edits,
)
from .support.small_models import model_of
from .support.two_files import causes_of_texts, compared_texts

SEED, COUNT = 47, 78
FURTHER_SEEDS = (3,)  # 1 and 2 were run when the rules were written; any other one may be
# What is less is the order in which numbers are added, which an edit can change, too.
_ROUNDING = 1e-9  # [m, rad, m/s, rad/s]
# MuJoCo itself ends here: it says that a tendon equality cannot sleep yet.
_NOT_RUN = ("option/flag/sleep",)
# Arrays and options of a compiled model of which no motion depends, and which no function reads.
_DRAWN_ONLY = (
    *("cam_", "light_", "mat_", "tex_", "skin_", "sensor_", "flex_texcoord", "mesh_texcoord"),
    *("vis", "stat", "signature", "narena", "nbuffer", "ntex", "nmat", "nsensor"),
    *("geom_group", "site_group", "jnt_group", "tendon_group", "flex_group", "site_type"),
    *("site_size", "tendon_width", "flex_flatskin"),
)
_DRAWN_ENDS = ("_rgba", "_matid", "_castshadow")


@dataclass(frozen=True)
class EditEffect:
    """What plain MuJoCo makes of an edit.

    Attributes:
        moves: Whether the model moves otherwise by it.
        compiles_alike: Whether both compiled models are the same, what is drawn apart.
    """

    moves: bool
    compiles_alike: bool


@dataclass(frozen=True)
class EditOutcome:
    """An edit, what it does, and what the list of two files says of it.

    Attributes:
        edit: The edit.
        effect: What plain MuJoCo makes of it.
        listed: What of the list of two files matters, by cause and quantity; and that a frame is
            put elsewhere on the same solid, which a note tells.
    """

    edit: AttributeEdit
    effect: EditEffect
    listed: tuple[str, ...]


@cache
def _base_states() -> np.ndarray:
    return raw_states(RICH)


def _compiles_alike(text: str) -> bool:
    """Tell whether a text has RICH's compiled model, what is drawn apart."""
    left, right = (mujoco.MjModel.from_xml_string(each) for each in (RICH, text))
    for name in dir(left):
        if name.startswith(("_", *_DRAWN_ONLY)) or name.endswith(_DRAWN_ENDS):
            continue
        ours, theirs = getattr(left, name), getattr(right, name)
        is_number = isinstance(ours, int | float | np.ndarray)
        if is_number and not np.array_equal(ours, theirs):
            return False
    options = [name for name in dir(left.opt) if not name.startswith("_")]
    return all(np.array_equal(getattr(left.opt, n), getattr(right.opt, n)) for n in options)


@cache
def _effect(text: str) -> EditEffect:
    """Return what plain MuJoCo makes of another text of RICH."""
    states, base = raw_states(text), _base_states()
    moves = states.shape != base.shape or float(np.abs(states - base).max()) > _ROUNDING
    return EditEffect(moves, _compiles_alike(text))


def _listed_of_files(text: str, folder: Path) -> tuple[str, ...]:
    """Return what the list of RICH and another text says; both are written into a folder."""
    result = compared_texts(folder, RICH, text)
    listed = [f"{row.cause}: {row.quantity}" for row in result.differences if row.matters]
    listed += [note for note in result.notes if "put elsewhere on the same solid" in note]
    return tuple(listed)


def _legal_edits(seed: int) -> Iterator[AttributeEdit]:
    """Yield edits that MuJoCo compiles."""
    for edit in drawn_edits(RICH, seed):
        if str(edit.attribute) in _NOT_RUN:
            continue
        try:
            mujoco.MjModel.from_xml_string(edit.applied(RICH))
        except ValueError:
            continue
        yield edit


@cache
def _edits(seed: int) -> tuple[AttributeEdit, ...]:
    return tuple(islice(_legal_edits(seed), COUNT))


# Of a seed, and which of its edits.
SEVERAL = [
    *((SEED, number) for number in range(6)),
    *(
        pytest.param((seed, number), marks=pytest.mark.slow)
        for seed in (SEED, *FURTHER_SEEDS)
        for number in range(6 if seed == SEED else 0, COUNT, 1 if seed == SEED else 2)
    ),
]


@pytest.fixture(scope="module", params=SEVERAL, ids=lambda drawn: "{}-{}".format(*drawn))
def outcome(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> EditOutcome:
    """Return what becomes of one drawn edit: both claims about it are of one run."""
    seed, number = request.param
    edit = _edits(seed)[number]
    text = edit.applied(RICH)
    return EditOutcome(edit, _effect(text), _listed_of_files(text, tmp_path_factory.mktemp("edit")))


def test_what_moves_otherwise_is_listed(outcome: EditOutcome) -> None:
    assert outcome.listed or not outcome.effect.moves, str(outcome.edit)


def test_what_compiles_to_the_same_is_not_listed(outcome: EditOutcome) -> None:
    assert not (outcome.effect.compiles_alike and outcome.listed), str(outcome.edit)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [SEED, *FURTHER_SEEDS])
def test_many_of_the_drawn_edits_move_the_robot(seed: int) -> None:
    """Else that they are listed would say little."""
    effects = [_effect(edit.applied(RICH)) for edit in _edits(seed)]
    assert sum(effect.moves for effect in effects) >= 25
    assert sum(effect.compiles_alike for effect in effects) >= 10


def test_every_attribute_of_the_schema_has_a_rule_or_a_reason() -> None:
    """A later MuJoCo may have more of them: then this fails, and the rules are to grow."""
    reasons = {name for names in WITHOUT_RULE.values() for name in names}
    attributes = coverage(RICH)
    assert {attribute.name for attribute in attributes.without_rule} - reasons == set()
    count = len(attributes.with_rule) + len(attributes.without_element)
    assert count + len(attributes.without_rule) == len(attributes.attributes)
    assert len(attributes.with_rule) >= 900


def test_what_is_without_an_element_is_of_a_sensor_a_default_or_a_plugin() -> None:
    parents = {attribute.parent for attribute in coverage(RICH).without_element}
    lengthrange_plugin_attach = {"sensor", "default", "compiler", "actuator", "(world)body"}
    deformable = {"flex", "deformable", "asset", "skin", "material", "equality"}
    assert parents <= lengthrange_plugin_attach | deformable


@pytest.fixture(scope="module", params=(SEED, *FURTHER_SEEDS))
def restated(request: pytest.FixtureRequest) -> list[str]:
    """Return texts that say of many attributes what RICH says of them already."""
    edits = list(restated_edits(RICH, request.param))
    assert len(edits) >= 40
    return merged(RICH, edits)


def test_what_says_what_a_file_says_already_moves_nothing(restated: list[str]) -> None:
    assert [_effect(text).moves for text in restated] == [False] * len(restated)


def test_what_says_what_a_file_says_already_is_not_listed(
    restated: list[str], tmp_path: Path
) -> None:
    assert [_listed_of_files(text, tmp_path) for text in restated] == [()] * len(restated)


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
    "attributes in another order": (
        'name="push" class="motors" joint="left"', 'joint="left" class="motors" name="push"'
    ),
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
    "a gap by its default": ('<pair name="cube_on_floor"', '<pair name="cube_on_floor" gap="0"'),
}  # fmt: skip


def _models(folder: Path, right: str) -> tuple[sm.Model, sm.Model]:
    return model_of(folder, RICH, "left.xml"), model_of(folder, right, "right.xml")


@pytest.mark.parametrize("way", SAID_OTHERWISE)
def test_what_says_the_same_is_not_listed(way: str, tmp_path: Path) -> None:
    old, new = SAID_OTHERWISE[way]
    assert RICH.count(old) == 1
    assert causes_of_texts(tmp_path, RICH, RICH.replace(old, new)) == ()


# What no edit of a compiled model can undo: the text of the right without it has the left's bits.
COMPILED_ANEW = {
    "a filter of a servo": AttributeEdit(
        SchemaAttribute("actuator", "position", "timeconst"), 0, "0.05"
    ),
    "a law without a state": AttributeEdit(
        SchemaAttribute("actuator", "general", "dyntype"), 0, "none"
    ),
    "another target": AttributeEdit(SchemaAttribute("actuator", "position", "joint"), 0, "elbow"),
    "a sphere that is turned about itself": AttributeEdit(
        SchemaAttribute("(world)body", "geom", "euler"), 14, "0.3 0.3 0"
    ),
    "a mass matrix that is stored in full": AttributeEdit(
        SchemaAttribute("mujoco", "(world)body", "simple"), 11, "false"
    ),
}


def _driven(raw: mujoco.MjModel) -> np.ndarray:
    """Return qpos and qvel (300, nq + nv) of a compiled model under commands of a seed."""
    data, random = mujoco.MjData(raw), np.random.default_rng(0)
    rows = []
    for step in range(300):
        if step % 25 == 0:
            data.ctrl[:] = random.uniform(-2, 2, raw.nu)
        mujoco.mj_step(raw, data)
        rows.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(rows)


@pytest.mark.parametrize("name", COMPILED_ANEW)
def test_what_is_compiled_anew_moves_as_the_left_to_the_last_bit(name: str, tmp_path: Path) -> None:
    left, right = _models(tmp_path, COMPILED_ANEW[name].applied(RICH))
    found = causes(differences_of(left, right, match_models(left, right)))
    assert not any(cause.refused for cause in found)
    edits = tuple(edit for cause in found for edit in cause.edits(1))
    spec_edits = tuple(edit for cause in found for edit in cause.spec_edits(1))
    assert spec_edits
    alike = built(right, edits, spec_edits).compiled
    assert alike.na == left.compiled.na
    assert np.array_equal(_driven(left.compiled), _driven(alike))


@pytest.mark.parametrize("name", COMPILED_ANEW)
def test_what_is_compiled_anew_moved_otherwise_before(name: str) -> None:
    states, base = raw_states(COMPILED_ANEW[name].applied(RICH)), _base_states()
    assert not np.array_equal(states, base)


def _polycoef(first: str, second: str, coefficients: str) -> str:
    """Return the attributes of a coupling of two joints."""
    return f'joint1="{first}" joint2="{second}" polycoef="{coefficients} 0 0 0"'


PAIR = """<mujoco><compiler angle="radian"/><option gravity="3 0 -9.81"/><worldbody>
<body pos="0.02 0 0"><joint name="a" axis="0 1 0"/><geom size="0.02" pos="0 0 0.03"/></body>
<body pos="-0.03 0 0"><joint name="b" axis="0 1 0"/><geom size="0.025" pos="0 0 0.03"/></body>
</worldbody><equality><joint {}/></equality></mujoco>"""


def _couplings(left: str, right: str) -> tuple[str, str]:
    """Return PAIR with b coupled to a by these coefficients, and with a coupled to b."""
    return (
        PAIR.format(_polycoef("a", "b", left)),
        PAIR.format(_polycoef("b", "a", right)),
    )


# Coefficients of b by a, of a by b, and what is listed. With a factor other than 1 MuJoCo softens
# a coupling by the other joint, and it moves otherwise.
COUPLINGS = {
    "the same": ("0.2 -1", "0.2 -1", []),
    "softened by another joint": ("0.1 2", "-0.05 0.5", ["softness by"]),
    "another offset": ("0.2 -1", "0.3 -1", ["parameters"]),
}


@pytest.mark.parametrize("case", COUPLINGS)
def test_what_is_listed_of_a_coupling_said_the_other_way_round(case: str, tmp_path: Path) -> None:
    left, right, listed = COUPLINGS[case]
    rows = causes_of_texts(tmp_path, *_couplings(left, right))
    assert [row.subject for row in rows] == listed


@pytest.mark.parametrize("case", COUPLINGS)
def test_a_coupling_that_is_listed_moves_otherwise(case: str) -> None:
    left, right, listed = COUPLINGS[case]
    ends = []
    for text in _couplings(left, right):
        raw = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(raw)
        mujoco.mj_step(raw, data, 500)
        ends.append(np.array(data.qpos))
    assert np.allclose(*ends, rtol=0, atol=1e-9) is not bool(listed)
