"""Small functions of several rooms, each by itself, with figures that are seen at a glance."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends.served.shared_fields import take_over, take_over_flags
from statemachine.engines.description.records import Inertial
from statemachine.errors import StateMachineError, UnknownNameError
from statemachine.interface import JointType
from statemachine.lab.compare.labels import (
    files_apart,
    labels_of,
    lines_on_unmatched,
    options_apart,
    typed_option,
)
from statemachine.lab.model_differences.weighed_bodies import (
    largest_moment,
    relative_gap,
    was_repaired,
)
from statemachine.lab.questions.run_files import RunFiles
from statemachine.lab.recordings import Header
from statemachine.lab.runs.floating import (
    BaseFrame,
    Bases,
    base_of,
    free_joint_of_base,
    free_joint_of_robot,
)
from statemachine.lab.why.gap import FirstTouch, first_touch
from statemachine.show.engine_tables import differences

from .support.traces import traced

# Labels of two sides


@pytest.fixture(scope="module")
def header() -> Header:
    return traced("hold", seconds=0.01).header


def of_file(header: Header, file: str, digest: str = "0" * 64) -> Header:
    provenance = dataclasses.replace(header.provenance, model_file=file, model_sha256=digest)
    return dataclasses.replace(header, provenance=provenance)


def test_two_files_are_called_by_where_their_paths_part(header: Header) -> None:
    labels = labels_of(of_file(header, "a/x/arm.xml"), of_file(header, "b/x/arm.xml"))
    assert labels.short == labels.long == ("a/x/arm.xml", "b/x/arm.xml")


def test_two_states_of_a_file_are_called_by_their_digests(header: Header) -> None:
    left, right = (of_file(header, "a/arm.xml", 64 * digit) for digit in "12")
    assert labels_of(left, right).short == ("arm.xml (11111111)", "arm.xml (22222222)")


def test_the_seed_tells_two_runs_apart_that_nothing_else_does(header: Header) -> None:
    provenance = header.provenance
    left, right = (
        dataclasses.replace(header, provenance=dataclasses.replace(provenance, seed=seed))
        for seed in (3, 4)
    )
    assert labels_of(left, right).short == ("seed 3", "seed 4")


def test_runs_of_two_starts_are_called_by_these(header: Header) -> None:
    left, right = (dataclasses.replace(header, keyframe=name) for name in ("bent", ""))
    assert labels_of(left, right).short == ("from bent", "from the default state")


def test_two_runs_of_one_kind_are_numbered(header: Header) -> None:
    left, right = labels_of(header, header).short
    assert left != right


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ("a/b.xml", "a/c.xml", ("b.xml", "c.xml")),
        ("a/b.xml", "c/b.xml", ("a/b.xml", "c/b.xml")),
        ("b.xml", "c/b.xml", ("b.xml", "c/b.xml")),
        ("b.xml", "b.xml", ("b.xml", "b.xml")),
    ],
)
def test_paths_part_at_their_shortest_ends(
    left: str, right: str, expected: tuple[str, str]
) -> None:
    assert files_apart(left.split("/"), right.split("/")) == expected


def test_only_options_that_differ_are_typed() -> None:
    left: Any = {"timestep": 0.002, "contacts": False, "gravity": [0, 0, -9.8]}
    right: Any = {"timestep": 0.002, "contacts": True}
    assert options_apart(left, right) == (
        "contacts=off, gravity=0,0,-9.8",
        "contacts=on, gravity of the file",
    )


def test_an_option_is_typed_as_one_types_it() -> None:
    assert typed_option("kp", 12.5) == "kp=12.5"
    assert typed_option("integrator", "Euler") == "integrator=Euler"
    assert typed_option("contacts", True) == "contacts=on"


def test_what_one_side_alone_has_is_a_line() -> None:
    one, two = {"joint": ["hip"], "body": []}, {"joint": ["knee", "toe"], "body": ["foot"]}
    lines = list(lines_on_unmatched([one, two], ("L", "R")))
    assert [line.split(" has ")[0] for line in lines] == ["only L", "only R"]
    assert "joint hip (--map" in lines[0]
    assert "joints knee" in lines[1]
    assert "body foot:" in lines[1]  # of which the left has none: nothing to map


# Bases


def facts(kinds: str, owners: list[int], parents: list[int], driven: list[int]) -> Any:
    """Return the facts of a model: f, b, h and s for a free joint, a ball, a hinge and a slide."""
    names = {"f": JointType.FREE, "b": JointType.BALL, "h": JointType.HINGE, "s": JointType.SLIDE}
    return SimpleNamespace(
        jnt_type=[int(names[kind]) for kind in kinds],
        jnt_bodyid=owners,
        body_parentid=parents,
        actuator_jntid=driven,
    )


@pytest.mark.parametrize(
    ("model", "base", "joint"),
    [
        (facts("hh", [1, 2], [0, 0, 1], [0, 1]), "fixed", None),
        (facts("fh", [1, 2], [0, 0, 1], [1]), "free", 0),
        # An arm whose first joint alone is driven, beside a part that flies with a hinge.
        (facts("hfh", [1, 2, 3], [0, 0, 0, 2], [0]), "fixed", None),
        (facts("hfh", [1, 2, 3], [0, 0, 0, 2], [2]), "free", 1),
        (facts("hfh", [1, 2, 3], [0, 0, 0, 2], [0, 2]), None, None),
        # What nothing drives is a robot by its joints beside free ones.
        (facts("hf", [1, 2], [0, 0, 0], []), "fixed", None),
        (facts("hf", [1, 2], [0, 0, 0], [-1]), "fixed", None),
        (facts("f", [1], [0, 0], []), "free", 0),
        (facts("ff", [1, 2], [0, 0, 0], []), None, None),
        (facts("", [], [0], []), None, None),
    ],
)
def test_the_base_is_that_of_what_is_driven(
    model: Any, base: str | None, joint: int | None
) -> None:
    assert base_of(model) == base
    assert free_joint_of_base(model) == joint


def test_a_part_that_flies_alone_is_no_robot() -> None:
    assert free_joint_of_robot(facts("f", [1], [0, 0], [])) is None
    assert free_joint_of_robot(facts("fh", [1, 2], [0, 0, 1], [1])) == 0


def test_a_frame_is_turned_by_any_angle_above_zero() -> None:
    for angle, is_turned in ((0.0, False), (0.5, True)):
        frame = BaseFrame((3.0, 0.0, 4.0), angle, "a", "b")
        assert (frame.is_turned, frame.distance) == (is_turned, 5.0)


def test_bases_differ_where_both_are_known() -> None:
    assert Bases("free", "fixed").differ
    assert not Bases("free", "free").differ
    assert not Bases("free", None).differ
    assert len(list(Bases("free", "fixed", floating_loader="right").notes())) == 2
    assert Bases("free", "free", inherited_by="left").inherited_from == "right"
    assert Bases("free", "free").inherited_from == ""


# The first touch of some runs

MOMENTS = np.array([0.0, 0.1, 0.2, 0.3])


def touching(start: float, **rows: list[bool]) -> Any:
    """Return a trace with rows each 0.1 s from a start, and what touches in which of them."""
    touches = {pair: np.array(row) for pair, row in rows.items()}
    return SimpleNamespace(time=start + MOMENTS, touches=lambda: touches)


def test_the_first_touch_is_the_earliest_of_all_runs() -> None:
    late = touching(5.0, foot=[False, False, False, True], never=[False] * 4)
    early = touching(0.0, hand=[False, False, True, True])
    touch = first_touch([late, early], MOMENTS, np.array([0.0, 3.0, 2.0, 9.0]))
    assert touch is not None
    assert touch.time == pytest.approx(0.2)
    assert (touch.what, touch.before, touch.moments) == ("hand", 3.0, 3)


def test_no_moment_is_before_a_touch_at_the_start() -> None:
    trace = touching(1.0, foot=[True] * 4)
    touch = first_touch([trace], MOMENTS, np.array([4.0, 3.0, 2.0, 9.0]))
    assert touch == FirstTouch(0.0, "foot", 0.0, 0)


def test_what_touches_nothing_has_no_first_touch() -> None:
    assert first_touch([touching(0.0, foot=[False] * 4)], np.zeros(4), np.zeros(4)) is None


# Inertias


def inertial(*moments: float) -> Inertial:
    fields = {field.name for field in dataclasses.fields(Inertial)}
    assert {"mass", "tensor"} <= fields
    values: dict[str, Any] = {"mass": 1.0, "tensor": np.diag(moments)}
    return Inertial(**{name: values.get(name, np.zeros(3)) for name in fields})


def test_two_inertias_are_apart_by_a_part_of_the_larger_moment() -> None:
    left, right = inertial(1.0, 2.0, 3.0), inertial(1.0, 3.5, 4.0)
    assert largest_moment(right) == pytest.approx(4.0)
    assert relative_gap(left, right) == pytest.approx(1.5 / 4.0)


def test_points_have_no_gap_of_inertia() -> None:
    assert relative_gap(inertial(0.0, 0.0, 0.0), inertial(0.0, 0.0, 0.0)) == 0.0


def test_an_inertia_that_is_used_as_it_is_stated_was_not_repaired() -> None:
    assert not was_repaired(inertial(1.0, 2.0, 3.0), inertial(1.0, 2.0, 3.0))
    assert was_repaired(inertial(1.0, 2.0, 3.0), inertial(1.0, 2.0, 3.0 + 1e-12))


# Checks before anything runs


@pytest.mark.usefixtures("matplotlib")
@pytest.mark.parametrize("kind", ["junit", "plot", "film"])
def test_a_file_that_cannot_be_written_is_refused_before_a_run(kind: str, tmp_path: Path) -> None:
    suffix = {"junit": ".xml", "plot": ".svg", "film": ".webp"}[kind]
    files: Any = {kind: tmp_path / "nowhere" / f"a{suffix}"}
    with pytest.raises(StateMachineError):
        RunFiles(**files).check()
    files[kind] = tmp_path / f"a{suffix}"
    RunFiles(**files).check()


def test_a_backend_that_nobody_has_is_named_with_those_there_are() -> None:
    with pytest.raises(UnknownNameError) as refused:
        sm.load("so101", backend="mujocco")
    assert "mujoco" in str(refused.value)


# The last table of a page with several engines


def test_each_engine_stands_against_the_first() -> None:
    [table] = differences({"a": 1.0, "b": 3.0, "c": 6.0}, {"gap": lambda x, y: f"{y - x:g}"})
    assert table.headers == ("", "b against a", "c against a")
    assert [tuple(row) for row in table.rows] == [("gap", "2", "5")]


def test_two_engines_are_enough_for_a_table_and_one_is_not() -> None:
    rows: Any = {"gap": lambda x, y: f"{y - x:g}"}
    assert len(differences({"a": 1.0, "b": 3.0}, rows)) == 1
    assert differences({"a": 1.0}, rows) == []
    assert differences({"a": math.nan, "b": 1.0}, {}) == []


# What another release of MuJoCo read


@pytest.fixture
def compiled() -> Any:
    body = "<body><joint name='j' damping='0.1'/><geom size='0.1'/></body>"
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")


def test_a_compiled_model_takes_over_the_numbers_that_an_engine_read(compiled: Any) -> None:
    fields = {
        "dof_damping": np.array([0.7]),
        "opt.timestep": np.array(0.004),
        "opt.gravity": np.array([0.0, 0.0, -1.6]),
        "body_mass": np.array([1.0, 2.0, 3.0]),  # of another number of bodies
        "nobody_has_it": np.array([1.0]),
    }
    mass = compiled.body_mass.copy()
    assert take_over(compiled, fields) == {"dof_damping", "opt.timestep", "opt.gravity"}
    assert compiled.dof_damping.tolist() == [0.7]
    assert compiled.opt.timestep == 0.004
    assert compiled.opt.gravity.tolist() == [0.0, 0.0, -1.6]
    assert compiled.body_mass.tolist() == mass.tolist()


def test_a_compiled_model_has_the_flags_of_an_engine_and_no_others(compiled: Any) -> None:
    bits = mujoco.mjtDisableBit
    compiled.opt.disableflags = int(bits.mjDSBL_CONTACT)
    take_over_flags(compiled, "opt.disableflags", ["mjDSBL_GRAVITY", "mjDSBL_LIMIT", "mjDSBL_NEW"])
    assert compiled.opt.disableflags == int(bits.mjDSBL_GRAVITY) + int(bits.mjDSBL_LIMIT)
    take_over_flags(compiled, "opt.disableflags", [])
    assert compiled.opt.disableflags == 0
