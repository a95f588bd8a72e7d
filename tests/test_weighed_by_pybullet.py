"""What links weigh that PyBullet reads itself, and what is written for a base: closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.interface.free_base import FreeBase
from statemachine.interface.records import ReadOptions

from .support.files import written
from .support.requirements import need_engine

BOX = '<collision><geometry><box size="{}"/></geometry></collision>'
INERTIAL = (
    '<inertial><origin xyz="{at}"/><mass value="{mass}"/>'
    '<inertia ixx="9" iyy="9" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def _link(name: str, mass: float, size: str) -> str:
    return f'<link name="{name}">{INERTIAL.format(at="0 0 0", mass=mass)}{BOX.format(size)}</link>'


def _joint(name: str, kind: str, parent: str, child: str, at: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="0 0 1"/></joint>'
    )


ROBOT = (
    '<robot name="r">'
    + _link("base", 3, "0.2 0.4 0.6")
    + _link("arm", 1, "0.3 0.1 0.1")
    + _link("hand", 2, "0.1 0.1 0.2")
    + _joint("turn", "continuous", "base", "arm", "0 0 1")
    + _joint("weld", "fixed", "arm", "hand", "0.5 0 0")
    + "</robot>"
)


def _moments(mass: float, x: float, y: float, z: float) -> np.ndarray:
    """Return the inertia (3, 3) of a box with such edges."""
    return mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


def _weights(folder: Path, **options: Any) -> dict[int, Any]:
    need_engine("pybullet")
    from statemachine.backends.bullet.weights import weights

    file = written(folder / "r.urdf", ROBOT)
    model: Any = sm.load(file, backend="pybullet", defaults="engine", **options)
    return weights(model.plan)


def test_links_that_are_held_together_weigh_what_both_do(tmp_path: Path) -> None:
    (weight,) = _weights(tmp_path).values()
    assert weight.mass == pytest.approx(3.0)
    np.testing.assert_allclose(weight.com, (2 * 0.5 / 3, 0, 0), atol=1e-6)


def test_an_inertia_is_that_of_the_shapes_about_their_common_centre(tmp_path: Path) -> None:
    (weight,) = _weights(tmp_path).values()
    own = _moments(1, 0.3, 0.1, 0.1) + _moments(2, 0.1, 0.1, 0.2)
    apart = np.diag([0, 1, 1]) * (1 * (1 / 3) ** 2 + 2 * (0.5 - 1 / 3) ** 2)
    np.testing.assert_allclose(weight.inertia, own + apart, rtol=1e-4, atol=1e-6)


def test_a_free_base_is_weighed_too(tmp_path: Path) -> None:
    found = _weights(tmp_path, base="free")
    assert [weight.mass for _, weight in sorted(found.items())] == pytest.approx([3.0, 3.0])
    base = found[min(found)]
    np.testing.assert_allclose(base.com, (0, 0, 0), atol=1e-6)
    np.testing.assert_allclose(base.inertia, _moments(3, 0.2, 0.4, 0.6), rtol=1e-4, atol=1e-6)


# What is written into a URDF for its base.

FREE = (
    '<robot name="f"><link name="world"/>'
    + _link("base", 3, "0.2 0.4 0.6")
    + '<joint name="float" type="floating"><parent link="world"/><child link="base"/></joint>'
    + "</robot>"
)
START = FreeBase((0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("text", "options", "expected"),
    [
        (ROBOT, {}, None),
        (ROBOT, {"base": "fixed"}, None),
        (ROBOT, {"base": "free"}, ("base", True, None)),
        (ROBOT, {"base": "free", "start": START}, ("base", True, START)),
        (FREE, {"base": "free"}, None),
        (FREE, {"base": "fixed"}, ("base", False, None)),
        (FREE, {"base": "free", "start": START}, ("base", True, START)),
    ],
)
def test_a_base_is_written_where_it_is_another_than_in_the_file(
    text: str, options: dict[str, Any], expected: tuple[Any, ...] | None, tmp_path: Path
) -> None:
    from statemachine.backends.compiled.reading import base_of_text

    base = base_of_text(written(tmp_path / "r.urdf", text), ReadOptions(**options))
    if expected is None:
        assert base is None
    else:
        assert base is not None
        assert (base.link, base.is_free, base.start) == expected


def test_the_joint_of_a_base_that_floats_keeps_its_name(tmp_path: Path) -> None:
    from statemachine.backends.compiled.reading import base_of_text

    base = base_of_text(written(tmp_path / "f.urdf", FREE), ReadOptions(base="fixed"))
    assert base is not None
    assert base.joint == "float"


def test_only_an_inertia_that_breaks_the_rule_is_balanced(tmp_path: Path) -> None:
    from statemachine.backends.compiled.reading import balanced_moments

    bodies = "".join(
        f'<body name="{name}" pos="{k} 0 0"><freejoint/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{moments}"/></body>'
        for k, (name, moments) in enumerate({"odd": "1 2 6", "right": "1 2 2.5"}.items())
    )
    file = written(tmp_path / "a.xml", f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    assert balanced_moments(file) == {"odd": pytest.approx(3.0)}
