"""`--write`, attribute by attribute: what is written compiles to every number of the left."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.lab.why.rewriting import RewriteRequest, RewrittenFile, rewrite

from .support.attributes import (
    CASES,
    TETRAHEDRON,
    Make,
    actuator,
    compiled,
    differing_arrays,
    geom,
    inertial,
    scene,
    tied,
)
from .support.files import written

REFUSED: dict[str, tuple[Make, str, str]] = {
    "a motor is no servo": (
        actuator, 'position name="a" joint="j" kp="3"', 'motor name="a" joint="j"',
    ),
    "a velocity servo is no position servo": (
        actuator, 'position name="a" joint="j" kp="3"', 'velocity name="a" joint="j" kv="3"',
    ),
    "a position servo has no constant force": (
        actuator, 'general name="a" joint="j" gainprm="3" biastype="affine" biasprm="1 -3 0"',
        'position name="a" joint="j" kp="3"',
    ),
    "the range of a free joint": (
        scene, '<body><joint name="j" type="free" damping="2"/><geom size=".1"/></body>',
        '<body><freejoint name="j"/><geom size=".1"/></body>',
    ),
    "what a weld keeps": (
        tied, '<equality><weld body1="c" body2="d" torquescale="2"/></equality>',
        '<equality><weld body1="c" body2="d"/></equality>',
    ),
    "a mass of a file that scales all": (
        lambda text: inertial(text, '<compiler settotalmass="5"/>'),
        'pos="0 0 0" mass="2" diaginertia="1 2 2.5"', 'pos="0 0 0" mass="2" diaginertia="1 2 2.8"',
    ),
}  # fmt: skip


@pytest.fixture
def rewritten(tmp_path: Path) -> Callable[[str, str], tuple[RewrittenFile, Path]]:
    """Return a right text, written so that it becomes like a left one."""

    def run(left: str, right: str) -> tuple[RewrittenFile, Path]:
        models = [
            sm.load(written(tmp_path / f"{name}.xml", text))
            for name, text in (("left", left), ("right", right))
        ]
        target = tmp_path / "fixed.xml"
        result, _ = rewrite(RewriteRequest(models[0], models[1], target, sm.load, {}))
        return result, target

    return run


# A number that does not count: a range that is not limited, of a friction the rest.
IDLE = {"jnt_range", "signature"}


@pytest.mark.parametrize("name", CASES)
def test_an_attribute_is_written(
    name: str, rewritten: Callable[[str, str], tuple[RewrittenFile, Path]], tmp_path: Path
) -> None:
    make, left, right, expected = CASES[name]
    result, target = rewritten(make(left), make(right))
    assert result.not_written == ()
    attributes: dict[str, Any] = {row.attribute: row.new for row in result.written}
    assert {key: attributes.get(key, "not written") for key in expected} == expected
    assert set(attributes) == set(expected)
    assert set(differing_arrays(*map(compiled, (tmp_path / "left.xml", target)))) <= IDLE


# What a file scales is what one of them is about.
@pytest.mark.filterwarnings(
    "ignore:.*settotalmass. is deprecated:statemachine.errors.EngineWarning"
)
@pytest.mark.parametrize("name", REFUSED)
def test_what_no_attribute_says_is_refused(
    name: str, rewritten: Callable[[str, str], tuple[RewrittenFile, Path]]
) -> None:
    make, left, right = REFUSED[name]
    result, target = rewritten(make(left), make(right))
    assert len(result.not_written) >= 1
    assert result.written == ()
    assert not target.exists()


@pytest.mark.parametrize(
    ("left", "right", "attribute"),
    [
        ('pos=".1 .2 .3"', 'pos=".1 .2 .4"', "pos"),
        ('pos=".1 .2 .3" quat="0.6 0 0.8 0"', 'pos=".1 .2 .3" quat="0.8 0 0.6 0"', "quat"),
    ],
)
def test_a_mesh_is_placed_in_its_own_frame(
    left: str,
    right: str,
    attribute: str,
    rewritten: Callable[[str, str], tuple[RewrittenFile, Path]],
    tmp_path: Path,
) -> None:
    texts = [geom(f'type="mesh" mesh="m" {turn}', TETRAHEDRON) for turn in (left, right)]
    result, target = rewritten(*texts)
    assert result.not_written == ()
    rows = {row.attribute: [float(word) for word in row.new.split()] for row in result.written}
    wanted = left.partition(f'{attribute}="')[2].partition('"')[0]
    assert rows[attribute] == pytest.approx([float(word) for word in wanted.split()], abs=1e-9)
    assert differing_arrays(*map(compiled, (tmp_path / "left.xml", target))) == []


def test_a_box_is_not_given_by_two_ends(
    rewritten: Callable[[str, str], tuple[RewrittenFile, Path]],
) -> None:
    ends = 'type="capsule" size=".1" fromto="0 0 0 .2 .3 .4"'
    result, target = rewritten(geom('type="box" size=".1 .2 .3"'), geom(ends))
    assert "shape of g" in {row.cause for row in result.not_written}
    assert 'type="capsule"' in target.read_text()
