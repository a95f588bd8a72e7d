"""A Data that shows that of another model: every row under its own name, by a second look-up."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import raw_engine_of
from statemachine.interface import forward, step

from .support.files import written
from .support.requirements import need_engine

# What lies in the floor touches it at once, and that is said when it is loaded.
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*inside each other:statemachine.errors.EngineWarning"
)

HEAD = '<mujoco><option timestep="0.002"/><worldbody>'
FLOOR = '<geom name="floor" type="plane" size="5 5 1"/>'
ARM = (
    '<body name="one" pos="0 0 1"><joint name="turn" axis="0 1 0" damping=".1" stiffness=".3"/>'
    '<geom name="rod" type="capsule" size=".02" fromto="0 0 0 .3 0 0"/>'
    '<body name="two" pos=".3 0 0"><joint name="push" type="slide" axis="1 0 0" damping=".2"/>'
    '<geom name="tip" size=".04"/><site name="end" pos=".1 0 0"/></body></body>'
)
BALL = (
    '<body name="ball" pos="1 0 .09"><freejoint name="ball"/><geom name="ball" size=".1"/>'
    '<site name="top" pos="0 0 .1"/></body>'
)
MORE = (
    '<body name="more" pos="-1 0 .05"><freejoint name="more"/>'
    '<geom name="more" type="box" size=".06 .06 .06"/></body>'
)
GOALS = ['<body name="g1" mocap="true" pos="0 0 2"/>', '<body name="g2" mocap="true" pos="0 1 2"/>']
MOTORS = ['<motor name="m" joint="turn"/>', '<position name="p" joint="push" kp="20"/>']
SENSORS = ['<jointpos name="jp" joint="turn"/>', '<jointvel name="jv" joint="push"/>']
TENDONS = [
    '<fixed name="t1"><joint joint="turn" coef="1"/></fixed>',
    '<fixed name="t2"><joint joint="push" coef="2"/></fixed>',
]


def _text(bodies: str, back: bool) -> str:
    turn = -1 if back else 1
    parts = {"tendon": TENDONS, "actuator": MOTORS, "sensor": SENSORS}
    rest = "".join(f"<{tag}>{''.join(rows[::turn])}</{tag}>" for tag, rows in parts.items())
    return f"{HEAD}{bodies}</worldbody>{rest}</mujoco>"


# What is shown has another order, a geom less on the floor, and no counterpart of `more`.
VIEW = _text(FLOOR + ARM + BALL, back=False)
SOURCE = _text(MORE + BALL + FLOOR + ARM, back=True)
COUNTS = {"body": "nbody", "joint": "njnt", "geom": "ngeom", "site": "nsite"}
COUNTS |= {"actuator": "nactuator", "tendon": "ntendon"}


def _names(raw: Any, kind: str) -> list[str]:
    return [getattr(raw, kind)(k).name for k in range(getattr(raw, COUNTS[kind]))]


def _pairs(ours: list[str], theirs: list[str]) -> list[tuple[int, int]]:
    return [(k, theirs.index(name)) for k, name in enumerate(ours) if name in theirs]


def _elements(ours: Any, theirs: Any) -> dict[str, list[tuple[int, int]]]:
    """Return the pairs of ids, and of places in arrays, of what has the same name."""
    pairs = {kind: _pairs(_names(ours, kind), _names(theirs, kind)) for kind in COUNTS}
    for kind, start, end in (("qpos", "jnt_qposadr", "nq"), ("dof", "jnt_dofadr", "nv")):
        pairs[kind] = []
        for a, b in pairs["joint"]:
            starts = [*getattr(ours, start), getattr(ours, end)]
            first, other = int(starts[a]), int(getattr(theirs, start)[b])
            pairs[kind] += [(first + k, other + k) for k in range(starts[a + 1] - starts[a])]
    sensors = [[raw.sensor(k).name for k in range(raw.nsensor)] for raw in (ours, theirs)]
    pairs["sensordata"] = _pairs(*sensors)
    goals = [
        [raw.body(k).name for k in range(raw.nbody) if raw.body_mocapid[k] >= 0]
        for raw in (ours, theirs)
    ]
    for part, size in (("mocap_pos", 3), ("mocap_quat", 4)):
        pairs[part] = [(size * a + k, size * b + k) for a, b in _pairs(*goals) for k in range(size)]
    return pairs | {"act": []}


@pytest.fixture(params=["mujoco", "pybullet"])
def engine(request: pytest.FixtureRequest) -> str:
    need_engine(request.param)
    return request.param


@pytest.fixture
def shown(engine: str, tmp_path: Path) -> Iterator[tuple[Any, Any, Any]]:
    """A Data in the order of one model, one of another in motion, and what is what."""
    goals = ("", "")
    if engine == "mujoco":
        goals = ("".join(GOALS), "".join(GOALS[::-1]))
    files = [
        written(tmp_path / f"{k}.xml", text.replace("<worldbody>", f"<worldbody>{goal}"))
        for k, (text, goal) in enumerate(zip((VIEW, SOURCE), goals, strict=True))
    ]
    # `more` is in the floor, and meets it in the first step.
    view = sm.load(files[0])
    model = sm.load(files[1], backend=engine)
    elements = _elements(view.compiled, sm.load(files[1]).compiled)
    data = raw_engine_of("mujoco").data_in_other_order(view, elements)
    with sm.make_data(model) as source:
        source.qvel[:] = np.linspace(0.1, 0.7, model.nv)
        source.ctrl[:] = (0.1, 0.5)
        step(model, source, 5)
        forward(model, source)
        data.show(source)
        yield data, source, elements


def _rows(shown: tuple[Any, Any, Any], kind: str, ours: Any, theirs: Any) -> None:
    _, _, elements = shown
    a, b = np.array(elements[kind]).T
    assert np.abs(np.asarray(theirs)[b]).max() > 0
    np.testing.assert_array_equal(np.asarray(ours)[a], np.asarray(theirs)[b])


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("qpos", "qpos"),
        ("dof", "qvel"),
        ("body", "xpos"),
        ("body", "xquat"),
        ("site", "site_xpos"),
        ("site", "site_xmat"),
        ("dof", "qacc"),
        ("dof", "qfrc_bias"),
        ("dof", "qfrc_actuator"),
        ("dof", "qfrc_passive"),
    ],
)
def test_a_row_is_that_of_the_same_name(kind: str, name: str, shown: tuple[Any, Any, Any]) -> None:
    data, source, _ = shown
    _rows(shown, kind, getattr(data, name), getattr(source, name))


def test_the_time_is_that_of_the_other(shown: tuple[Any, Any, Any]) -> None:
    data, source, _ = shown
    assert data.time == source.time == pytest.approx(0.01)
    assert data.raw.time == source.time


def test_what_is_derived_is_read_only(shown: tuple[Any, Any, Any]) -> None:
    assert not shown[0].xpos.flags.writeable


def test_a_contact_is_of_the_same_geoms_and_of_none_that_has_no_counterpart(
    shown: tuple[Any, Any, Any],
) -> None:
    data, source, elements = shown
    known = {b: a for a, b in elements["geom"]}
    expected = [[known.get(int(geom), -1) for geom in pair] for pair in source.contacts.geom]
    assert -1 in np.ravel(expected)
    np.testing.assert_array_equal(data.contacts.geom, expected)
    for name in ("dist", "pos", "frame", "force", "torque"):
        ours, theirs = getattr(data.contacts, name), getattr(source.contacts, name)
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize(
    ("kind", "name"), [("body", "xpos"), ("site", "site_xpos"), ("dof", "qacc")]
)
def test_the_memory_of_the_engine_has_what_any_engine_derives(
    kind: str, name: str, shown: tuple[Any, Any, Any]
) -> None:
    data, source, _ = shown
    theirs = getattr(source, name)
    _rows(shown, kind, getattr(data.raw, name), theirs)


# What an MjData alone has.


@pytest.mark.parametrize("engine", ["mujoco"], indirect=True)
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("body", "xipos"),
        ("body", "cvel"),
        ("joint", "xanchor"),
        ("joint", "xaxis"),
        ("geom", "geom_xpos"),
        ("dof", "qfrc_spring"),
        ("dof", "qfrc_damper"),
        ("sensordata", "sensordata"),
        ("actuator", "actuator_force"),
        ("actuator", "actuator_length"),
        ("tendon", "ten_length"),
        ("tendon", "ten_velocity"),
    ],
)
def test_the_memory_of_the_engine_has_what_the_other_s_has(
    kind: str, name: str, shown: tuple[Any, Any, Any]
) -> None:
    data, source, _ = shown
    _rows(shown, kind, getattr(data.raw, name), getattr(source.raw, name))


@pytest.mark.parametrize("engine", ["mujoco"], indirect=True)
@pytest.mark.parametrize("name", ["mocap_pos", "mocap_quat"])
def test_mocap_bodies_are_taken_over_and_given_back(name: str, shown: tuple[Any, Any, Any]) -> None:
    data, source, _ = shown
    np.testing.assert_array_equal(getattr(data, name), getattr(source, name)[::-1])
    moved = np.arange(getattr(data, name).size, dtype=float).reshape(2, -1)
    getattr(data, name)[:] = moved
    data.give_back()
    np.testing.assert_array_equal(getattr(source, name), moved[::-1])


@pytest.mark.parametrize("engine", ["mujoco"], indirect=True)
@pytest.mark.parametrize(("kind", "name"), [("dof", "qfrc_applied"), ("body", "xfrc_applied")])
def test_applied_forces_are_given_back(kind: str, name: str, shown: tuple[Any, Any, Any]) -> None:
    data, source, _ = shown
    forces = getattr(data.raw, name)
    forces[1:] = np.arange(forces[1:].size).reshape(forces[1:].shape) + 1.0
    data.give_back()
    _rows(shown, kind, forces, getattr(source.raw, name))


@pytest.mark.parametrize("engine", ["mujoco"], indirect=True)
def test_forces_that_nobody_looked_at_stay_as_they_are(shown: tuple[Any, Any, Any]) -> None:
    data, source, _ = shown
    source.raw.qfrc_applied[:] = 3.0
    data.give_back()
    assert (source.raw.qfrc_applied == 3.0).all()


def test_before_anything_is_shown_it_is_a_data_of_its_own(tmp_path: Path) -> None:
    view = sm.load(written(tmp_path / "a.xml", VIEW))
    elements = _elements(view.compiled, view.compiled)
    data = raw_engine_of("mujoco").data_in_other_order(view, elements)
    data.give_back()
    assert data.time == 0.0
    assert isinstance(data.raw, mujoco.MjData)
    forward(view, data)
    np.testing.assert_allclose(data.xpos[1], (0, 0, 1), atol=1e-12)
