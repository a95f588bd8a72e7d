"""What the interface takes and refuses: both sides of each bound, and each shape."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    ForeignStateError,
    ReadOnlyError,
    UnknownNameError,
    UnsupportedError,
)
from statemachine.interface import checks
from statemachine.interface.free_base import FreeBase
from statemachine.interface.model_labels import distinct_labels
from statemachine.interface.options import as_option, checked_options
from statemachine.interface.read_options import (
    check_takes_read_options,
    checked_read_options,
    non_default_options,
    without_read_options,
)
from statemachine.interface.records import ReadOptions, State
from statemachine.interface.sites import moving_sites, usual_site

from .support.claims import assert_has
from .support.small_models import loaded

# A crate before two joints of a robot: a servo, a motor, and a slide that nothing drives.
WORLD = (
    '<body name="crate" pos="0 0 5"><freejoint/><geom size=".1" mass="3"/></body>'
    '<body name="arm"><joint name="turn" axis="0 1 0" armature=".1" damping=".2" '
    'frictionloss=".3"/><geom size=".1" mass="2"/><body name="hand" pos="1 0 0">'
    '<joint name="push" type="slide" axis="1 0 0"/><geom size=".05" mass="1"/>'
    '<site name="tip"/></body></body>'
)
DRIVES = (
    '<actuator><position name="servo" joint="turn" kp="5" kv=".5"/>'
    '<motor name="motor" joint="push"/></actuator>'
)
TURN, PUSH = 6, 7  # degrees of freedom


@pytest.fixture
def model(tmp_path: Path) -> sm.Model:
    """A robot beside a crate."""
    return loaded(tmp_path, WORLD, DRIVES)


# Numbers.


@pytest.mark.parametrize("value", [1, np.int64(1), 2**31 - 1])
def test_a_count_is_a_whole_number_of_at_least_one(value: Any) -> None:
    assert checks.as_count(value, "n") == value


@pytest.mark.parametrize("value", [0, -1, 2**31, 1.0, 2.5, True, np.bool_(True), "1", None])
def test_another_count_is_refused(value: Any) -> None:
    with pytest.raises(BadInputError):
        checks.as_count(value, "n")


@pytest.mark.parametrize(("value", "proposes"), [(1.0, True), (2.5, True), (0.5, False)])
def test_a_whole_number_is_proposed_for_a_float_of_at_least_one(
    value: float, proposes: bool
) -> None:
    with pytest.raises(BadInputError) as caught:
        checks.as_count(value, "n")
    assert (f"round({value})" in str(caught.value)) is proposes


def test_a_call_takes_as_many_steps_as_a_c_int_holds() -> None:
    assert checks.engine_steps(3, 5) == 15
    assert checks.engine_steps(2**31 - 1, 1) == 2**31 - 1
    with pytest.raises(BadInputError):
        checks.engine_steps(2**30, 2)


@pytest.mark.parametrize("value", [1e10, -1e10, 0.0])
def test_a_number_up_to_what_the_engine_takes_is_taken(value: float) -> None:
    checks.check_entries(np.array([0.0, value]), "qpos")


@pytest.mark.parametrize("value", [1.0001e10, -1.0001e10, math.nan, math.inf, -math.inf])
def test_the_first_entry_that_is_no_number_or_huge_is_named(value: float) -> None:
    with pytest.raises(BadInputError) as caught:
        checks.check_entries(np.array([[1.0, 2.0], [value, math.nan]]), "qpos")
    assert_has(caught.value, quantity="qpos", index=2)


def test_what_is_huge_is_told_from_what_is_no_number() -> None:
    texts = []
    for value in (2e10, math.inf):
        with pytest.raises(BadInputError) as caught:
            checks.check_entries(np.array([value]), "x", lambda name, k: f" <{name}{k}>")
        texts.append(str(caught.value))
    assert "beyond 1e+10" in texts[0]
    assert "beyond" not in texts[1]
    assert all("x[0] <x0>" in text for text in texts)


@pytest.mark.parametrize("value", [[1, 2, 3], [[1], [2]], 1.0, "ab", [1j, 2], [[1], [2, 3]], None])
def test_a_vector_of_another_shape_or_kind_is_refused(value: Any) -> None:
    with pytest.raises(BadInputError):
        checks.as_vector(value, (2,), "x")


def test_a_vector_is_a_copy_of_floats() -> None:
    given = np.array([1, 2])
    taken = checks.as_vector(given, (2,), "x")
    given[0] = 9
    assert (taken.tolist(), taken.dtype) == ([1.0, 2.0], np.float64)
    assert checks.as_scalar(np.float32(0.5), "x") == 0.5


@pytest.mark.parametrize("value", [0, 1, "on", None])
def test_a_switch_is_true_or_false(value: Any) -> None:
    assert checks.as_switch(np.bool_(False), "s") is False
    with pytest.raises(BadInputError):
        checks.as_switch(value, "s")


def test_an_array_that_cannot_be_written_is_refused() -> None:
    array = np.zeros(2)
    checks.check_writable(array, "qpos")
    array.setflags(write=False)
    with pytest.raises(ReadOnlyError, match=r"worlds\.qpos\.setflags"):
        checks.check_writable(array, "qpos", "worlds")


def test_a_name_has_its_number_and_nothing_has_no_name() -> None:
    assert checks.index_of("joint", "b", ["a", "", "b"]) == 2
    for name in ("", "c"):
        with pytest.raises(UnknownNameError):
            checks.index_of("joint", name, ["a", "", "b"])


def test_what_a_value_is_called(model: sm.Model) -> None:
    with sm.make_data(model) as data:
        assert [checks.kind_of(each) for each in (model, data, 1, np.zeros(1))] == [
            "a Model",
            "a Data",
            "int",
            "numpy.ndarray",
        ]


# States.


def test_a_state_with_a_number_that_is_not_finite_is_refused_by_its_entry(
    model: sm.Model,
) -> None:
    with sm.make_data(model) as data:
        state = sm.get_state(model, data)
        qvel = state["qvel"].copy()
        qvel[PUSH] = math.inf
        with pytest.raises(BadInputError, match=rf"'qvel'\]\[{PUSH}\] = inf"):
            sm.set_state(model, data, state.with_parts(qvel=qvel))


@pytest.mark.parametrize(
    "change",
    [{"backend": "pybullet"}, {"fingerprint": "other"}, {"blob": b"\0" * 8}, {"layout": ()}],
)
def test_a_state_of_another_layout_is_foreign(model: sm.Model, change: dict[str, Any]) -> None:
    with sm.make_data(model) as data:
        fields = {**vars(sm.get_state(model, data)), **change}
        with pytest.raises(ForeignStateError):
            sm.set_state(model, data, State(**fields))


def test_a_part_of_a_state_is_found_behind_those_before_it() -> None:
    layout = (("time", 1), ("qpos", 2), ("qvel", 1))
    state = State("mujoco", "4", "", layout, np.array([0.5, 1.0, 2.0, 3.0]).tobytes())
    assert [state[name].tolist() for name, _ in layout] == [[0.5], [1, 2], [3]]
    assert state.time == 0.5
    assert state.with_parts(qpos=np.array([7.0, 8.0]), act=np.zeros(3)).vector.tolist() == [
        0.5,
        7,
        8,
        3,
    ]
    with pytest.raises(UnknownNameError):
        state["act"]


# Options.


def option(model: sm.Model, name: str, value: Any) -> Any:
    """Return an option as a backend takes it."""
    return checked_options(model, {name: value})[name]


@pytest.mark.parametrize(
    ("name", "own"), [("armature", 0.1), ("damping", 0.2), ("frictionloss", 0.3)]
)
def test_one_number_is_of_the_joints_of_the_robot(model: sm.Model, name: str, own: float) -> None:
    assert option(model, name, 0.7).tolist() == [0] * 6 + [0.7, 0.7]
    assert option(model, name, [own] * 8).tolist() == [own] * 8


@pytest.mark.parametrize(("name", "value", "count"), [("friction", 0.5, 3), ("latency", 0.01, 2)])
def test_one_number_is_for_each(model: sm.Model, name: str, value: float, count: int) -> None:
    assert option(model, name, value).tolist() == [value] * count


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("armature", -0.1),
        ("damping", [0.1] * 7),
        ("friction", [0.5, -0.1, 0.5]),
        ("latency", 10.1),
        ("latency", -0.1),
        ("timestep", 0.0),
        ("timestep", -0.1),
        ("gravity", [0, 0]),
        ("substeps", 0),
        ("actuation", 1),
        ("integrator", "leapfrog"),
    ],
)
def test_a_value_beyond_its_bound_is_refused(model: sm.Model, name: str, value: Any) -> None:
    with pytest.raises((BadInputError, UnknownNameError)):
        option(model, name, value)


@pytest.mark.parametrize(
    ("name", "value"), [("armature", 0.0), ("latency", 10.0), ("latency", 0.0), ("friction", 0.0)]
)
def test_a_value_on_its_bound_is_taken(model: sm.Model, name: str, value: float) -> None:
    assert option(model, name, value).max() == value


def test_what_depends_on_no_model() -> None:
    assert as_option("gravity", (0, 0, -1), ()).tolist() == [0, 0, -1]
    assert as_option("substeps", 3, ()) == 3
    assert as_option("timestep", 1e-9, ()) == 1e-9
    assert as_option("integrator", "Euler", ["RK4", "Euler"]) == "Euler"
    assert as_option("limits", False, ()) is False


def test_masses_are_of_each_body(model: sm.Model) -> None:
    assert option(model, "mass", [0, 1, 2, 3]).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("masses", "body"),
    [([1, 1, 2, 3], 0), ([0, 1, 0, 3], 2), ([0, -1, 2, 3], 1), ([-1, 1, 1, 1], 0)],
)
def test_what_has_a_mass_keeps_one_and_what_has_none_gets_none(
    model: sm.Model, masses: list[float], body: int
) -> None:
    with pytest.raises(BadInputError) as caught:
        option(model, "mass", masses)
    assert_has(caught.value, quantity="mass", index=body)


@pytest.mark.parametrize(
    ("name", "value", "gains"),
    [
        ("kp", 7.0, [7.0, math.nan]),
        ("kv", 0.0, [0.0, math.nan]),
        ("kp", [1e-9, math.nan], [1e-9, math.nan]),
    ],
)
def test_a_gain_is_of_servos(model: sm.Model, name: str, value: Any, gains: list[float]) -> None:
    assert np.array_equal(option(model, name, value), gains, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("kp", 0.0),
        ("kv", -0.1),
        ("kp", [1.0, 2.0]),
        ("kp", [math.nan, math.nan]),
        ("kp", [1.0]),
        ("kp", math.inf),
    ],
)
def test_another_gain_is_refused(model: sm.Model, name: str, value: Any) -> None:
    with pytest.raises(BadInputError):
        option(model, name, value)


def test_a_gain_without_servos_is_refused(tmp_path: Path) -> None:
    alone = loaded(tmp_path, WORLD, '<actuator><motor joint="turn"/></actuator>')
    with pytest.raises(BadInputError):
        option(alone, "kp", 1.0)


def test_an_option_that_nobody_knows_is_unsupported(model: sm.Model) -> None:
    with pytest.raises(UnsupportedError) as caught:
        option(model, "armatur", 1.0)
    assert (caught.value.feature, caught.value.reason) == ("armatur", "unknown")


# Options of `load`.


def test_a_base_is_read_with_its_start() -> None:
    base = FreeBase((1, 2, 3), (0, 1, 0, 0))
    assert checked_read_options(False, True, None) == ReadOptions()
    assert checked_read_options(True, False, "fixed") == ReadOptions(True, False, "fixed")
    assert checked_read_options(False, True, base) == ReadOptions(
        base="free", start=FreeBase((1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0))
    )


@pytest.mark.parametrize(
    "base",
    ["floating", FreeBase((1, 2, math.nan)), FreeBase((0, 0, 0), (0, 0, 0, 0))],
)
def test_another_base_is_refused(base: Any) -> None:
    with pytest.raises((BadInputError, UnknownNameError)):
        checked_read_options(False, True, base)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (ReadOptions(), {}),
        (ReadOptions(meshes=False), {"meshes": False}),
        (ReadOptions(True, True, "free"), {"base": "free", "balance_inertia": True}),
    ],
)
def test_what_differs_from_the_defaults(options: ReadOptions, named: dict[str, Any]) -> None:
    assert non_default_options(options) == named


def test_a_loader_that_reads_files_in_its_own_way_says_so() -> None:
    check_takes_read_options("x", ("path", "read_options"), ReadOptions(meshes=False))
    with pytest.raises(UnsupportedError) as caught:
        check_takes_read_options("x", ("path",), ReadOptions(meshes=False))
    assert (caught.value.backend, caught.value.feature) == ("x", "meshes")


def test_an_option_of_load_is_taken_where_it_is_as_when_the_file_was_read(
    model: sm.Model,
) -> None:
    assert without_read_options(model, {"meshes": True, "timestep": 1}) == {"timestep": 1}
    assert without_read_options(model, {"base": None}) == {}
    for name, value in (("meshes", False), ("base", "free"), ("balance_inertia", True)):
        with pytest.raises(UnsupportedError):
            without_read_options(model, {name: value})


# Labels.


@dataclass
class Labelled:
    """What labels ask of a Model."""

    path: Path
    backend: str = "mujoco"
    engine_version: str = "4"
    defaults: str = "model"
    read_options: ReadOptions = ReadOptions()  # noqa: RUF009  (frozen)
    options: Any = None

    def __post_init__(self) -> None:
        self.options = self.options or {}


ONE = Path("one/a.xml")


@pytest.mark.parametrize(
    ("left", "right", "labels"),
    [
        (Labelled(ONE), Labelled(Path("b.xml")), ("a.xml on mujoco", "b.xml on mujoco")),
        (
            Labelled(ONE),
            Labelled(Path("two/a.xml")),
            (f"{ONE} on mujoco", f"{Path('two/a.xml')} on mujoco"),
        ),
        (Labelled(ONE), Labelled(ONE, "pybullet"), ("a.xml on mujoco", "a.xml on pybullet")),
        (
            Labelled(ONE),
            Labelled(ONE, engine_version="5"),
            ("a.xml on mujoco 4", "a.xml on mujoco 5"),
        ),
        (
            Labelled(ONE),
            Labelled(ONE, defaults="engine"),
            ('a.xml on mujoco with defaults="model"', 'a.xml on mujoco with defaults="engine"'),
        ),
        (
            Labelled(ONE, options={"kp": np.array([2.0, 2.0]), "kv": 1.0}),
            Labelled(ONE, options={"kv": 1.0}),
            ("a.xml on mujoco (kp=2.0)", "a.xml on mujoco (kp of the file)"),
        ),
    ],
)
def test_labels_say_what_differs(left: Any, right: Any, labels: tuple[str, str]) -> None:
    assert distinct_labels(left, right) == labels


def test_two_models_that_are_alike_are_told_apart_by_their_id() -> None:
    left, right = Labelled(ONE), Labelled(ONE)
    pair: Any = left, right
    assert distinct_labels(*pair) == (
        f"a.xml on mujoco, id {id(left):#x}",
        f"a.xml on mujoco, id {id(right):#x}",
    )


# Sites.


@pytest.mark.parametrize(
    ("names", "moving", "site"),
    [
        (["a", "gripperframe", "b"], [True, False, True], 1),
        (["a", "b", "c"], [True, True, False], 1),
        (["a", "b", "c"], None, 2),
        (["a"], [False], None),
        ([], None, None),
    ],
)
def test_the_site_of_the_fingertip(names: list[str], moving: Any, site: int | None) -> None:
    assert usual_site(names, moving) == site


def test_a_site_moves_where_a_joint_carries_its_body() -> None:
    # 1 has a joint; 2 hangs on it; 3 hangs on the world; 4 hangs on itself.
    parents = [0, 0, 1, 0, 4]
    assert moving_sites([0, 1, 2, 3, 4], parents, {1}) == (False, True, True, False, False)
