"""Freshness: of which moment each derived array is, how wrong, and what a watch counts."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    ClosedDataError,
    DivergedError,
    ForeignDataError,
)
from statemachine.freshness.age import Scratch
from statemachine.freshness.gaps import gaps, significant_gaps
from statemachine.freshness.rows import table
from statemachine.interface import POSES, Contacts, Data, Model
from statemachine.measures import Gap
from statemachine.show.as_json import plain

from .support.backends import each_of_both, readable_arrays
from .support.claims import assert_has, assert_in, overlapping, refused
from .support.motions import bits, opened, started
from .support.processes import runs_in_silence
from .support.requirements import ROOT
from .support.small_models import loaded, model_of

TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)
BODY = """<mujoco><option timestep="0.005" integrator="{integrator}"/>
<worldbody><body name="b" pos="0 0 1"><freejoint name="f"/>
<geom name="g" type="box" size=".1 .2 .05" pos="{centre}" mass="1"/>
<site name="s" pos=".2 0 0"/></body></worldbody></mujoco>"""


@pytest.fixture
def held(box: Model) -> Iterator[Data]:
    """The jaws hold the box and the arm turns: mid-contact, after a step."""
    with started(box) as data:
        data.ctrl[0] += 0.3
        sm.step(box, data, 30)
        yield data


def sizes(found: tuple[Gap, ...]) -> dict[str, float | None]:
    return {gap.unit: gap.size for gap in found}


@pytest.fixture(params=["made", "reset", "restored"])
def fresh(request: pytest.FixtureRequest, box: Model) -> Iterator[Data]:
    """A Data that nothing was computed of since it was made, reset or set to a State."""
    with sm.make_data(box) as data:
        if request.param != "made":
            state = sm.get_state(box, data)
            sm.forward(box, data)
            if request.param == "reset":
                sm.reset(box, data)
            else:
                sm.set_state(box, data, state)
        yield data


def test_what_is_stale_of_a_fresh_data_was_never_computed(box: Model, fresh: Data) -> None:
    found = sm.freshness(box, fresh)
    assert set(POSES) <= set(found.stale)
    assert {found[name].of for name in found.stale} == {"never computed"}


def test_zeros_of_a_fresh_data_are_no_rotation(box: Model, fresh: Data) -> None:
    assert sm.freshness(box, fresh)["site_xmat"].gaps == (Gap(None, "rad", ""),)


@each_of_both
def test_contacts_of_a_fresh_data_appear(box: Model, fresh: Data) -> None:
    assert sizes(sm.freshness(box, fresh)["contacts"].gaps) == {"appears": 4.0}


def test_the_fingertip_of_a_fresh_data_is_at_the_origin(box: Model, fresh: Data) -> None:
    """As in the first table of the lesson: as far off as the tip is away from there."""
    tip = math.hypot(0.3914, -0.001, 0.2463)
    found = sm.freshness(box, fresh)["site_xpos"]
    assert sizes(found.gaps)["m"] == pytest.approx(tip, abs=1e-4)


@each_of_both
def test_a_write_to_ctrl_makes_what_the_servos_do_stale_and_no_pose(arm: Model) -> None:
    with opened(arm, qpos=TARGET, ctrl=TARGET, derived=True) as (model, data):
        data.ctrl[1] += 1e-3
        found = sm.freshness(model, data)
    # Friction and, by rounding, PyBullet's contact force follow from what the servos do.
    follows = {"qfrc_friction", "qfrc_constraint", "qfrc_contact"}
    assert {"qacc", "qfrc_actuator"} <= set(found.stale) <= {"qacc", "qfrc_actuator"} | follows
    # kp · 0.001 rad, unsaturated: the servo is affine in ctrl.
    assert sizes(found["qfrc_actuator"].gaps) == {
        "N·m": pytest.approx(float(arm.actuator_kp[1]) * 1e-3)
    }


@each_of_both
def test_a_write_to_qvel_makes_damping_and_bias_stale_and_no_pose(arm: Model) -> None:
    with opened(arm, qpos=TARGET, ctrl=TARGET, derived=True) as (model, data):
        data.qvel[1] += 0.1
        found = sm.freshness(model, data)
    assert {"qacc", "qfrc_passive", "qfrc_bias"} <= set(found.stale)
    assert set(found.stale).isdisjoint(POSES)
    # d·0.1 rad/s of viscous damping.
    assert sizes(found["qfrc_passive"].gaps) == {
        "N·m": pytest.approx(float(arm.dof_damping[1]) * 0.1)
    }


@pytest.mark.parametrize("nstep", [1, 7])
@pytest.mark.parametrize(("substeps", "of"), [(1, "1 step ago"), (4, "1 substep ago")])
def test_a_step_is_found_by_going_back(backend: str, substeps: int, of: str, nstep: int) -> None:
    model = sm.load("so101/scene_box", backend=backend).replace(substeps=substeps)
    with opened(model, ctrl=TARGET, nstep=10) as (_, data):
        sm.step(model, data, nstep)
        found = sm.freshness(model, data)
    assert_has(found["xpos"], of=of, steps=1)
    assert f"h = {5 / substeps:g} ms" in " ".join(found.notes)


def test_another_state_than_the_last_step_left_is_not_found_by_going_back(box: Model) -> None:
    with opened(box, ctrl=TARGET, nstep=11) as (model, data):
        data.qvel[:] = 0.3
        assert sm.freshness(model, data)["xpos"].of == "an earlier state"


def test_a_step_is_found_behind_a_later_write(arm: Model) -> None:
    """What hangs on the written joint was written; what carries it is one step old."""
    with opened(arm, ctrl=0.3, nstep=20) as (model, data):
        data.qpos[model.joint_id("elbow_flex")] += 0.4
        found = sm.freshness(model, data)
    assert found["xpos"].of == "1 step ago"
    notes = " ".join(found.notes)
    assert_in(notes, "shoulder, upper_arm", "lower_arm, wrist, gripper")


@each_of_both
def test_a_write_is_no_step(box: Model, held: Data) -> None:
    """Written to where a step did not come from: no moment is claimed."""
    # Nor where all is so near that rounding could have it lead here.
    for speed, gap in ((1, 1e-4), (0, 1e-13)):
        held.qvel[:] *= speed
        sm.forward(box, held)
        held.qpos[0] += gap
        assert sm.freshness(box, held)["xpos"].of == "an earlier state"


def test_a_body_in_the_air(box: Model) -> None:
    """Slides and turns are told apart, each with its unit: it falls, and nothing turns it."""
    place = int(box.jnt_qposadr[box.joint_id("box")])
    with sm.make_data(box) as data:
        data.qpos[place + 2] = 1.0
        found = sm.freshness(box, data)
    fall, turn = sorted(found["qacc"].gaps, key=lambda gap: gap.unit)
    assert_has(fall, unit="m/s²", size=pytest.approx(9.81), where="box")
    assert turn.where != "box"


@each_of_both
@pytest.mark.filterwarnings("ignore:PyBullet. the integrator RK4")
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("centre", ["0 0 0", ".1 0 0"])
def test_a_body_that_turns(backend: str, integrator: str, centre: str, tmp_path: Path) -> None:
    text = BODY.format(integrator=integrator, centre=centre)
    turning = model_of(tmp_path, text, backend=backend)
    with opened(turning, qvel=range(1, 7), nstep=7) as (model, data):
        found = sm.freshness(model, data)
        spin = data.qvel[3:].copy()
    row = found["xquat"]
    assert not row.now
    # PyBullet moves the centre of mass along a straight line, not the origin; RK4 leaves
    # values of its fourth stage. Neither is claimed to be one step old.
    semi_implicit = integrator == "Euler" or backend == "pybullet"
    at_its_centre = centre == "0 0 0" or backend == "mujoco"
    if semi_implicit and at_its_centre:
        assert_has(row, of="1 step ago", steps=1)
        turned = 0.005 * np.linalg.norm(spin)  # of the velocity after the step
        assert sizes(row.gaps)["rad"] == pytest.approx(turned, rel=1e-9)
        assert set(sizes(found["qacc"].gaps)) <= {"m/s²", "rad/s²"}
    else:
        assert_has(row, of="an earlier state", steps=None)
        assert any("fourth stage" in note for note in found.notes) == (backend == "mujoco")


@pytest.mark.parametrize("name", ["qacc", "qfrc_bias"])
@overlapping
def test_a_vector_counts_by_its_length(tmp_path: Path, name: str) -> None:
    """As a position does; two joints without a name are not one vector."""
    model = loaded(
        tmp_path,
        "<body><freejoint name='f'/><geom size='.1'/></body>"
        "<body><joint name='b' type='ball'/><geom size='.1' pos='1 0 0'/></body>"
        "<body><joint/><joint axis='0 1 0'/><geom size='.1' pos='1 0 0'/></body>"
        "<body><joint name='s' type='slide'/><geom size='.1'/></body>",
    )
    units = ("m/s²", "rad/s²") if name == "qacc" else ("N", "N·m")
    for entries, unit, size, where in (
        ({0: 1.0, 1: -2.0, 2: 2.0}, 0, pytest.approx(3.0), "f"),
        ({4: 3.0, 5: 4.0}, 1, pytest.approx(5.0), "f"),
        ({6: 3.0, 8: -4.0, 10: 4.5}, 1, pytest.approx(5.0), "b"),
        ({9: 3.0, 10: 4.0}, 1, 4.0, ""),
        ({11: -1e-200}, 0, 1e-200, "s"),
    ):
        now = np.array([entries.get(k, 0.0) for k in range(model.nv)])
        (gap,) = gaps(model, name, np.zeros(model.nv), now)
        assert_has(gap, unit=units[unit], size=size, where=where)


def test_asking_leaves_the_data_as_it_is(box: Model, held: Data) -> None:
    arrays = [id(array) for array in (held.qpos, held.qvel, held.ctrl)]
    before = sm.get_state(box, held), bits(held)
    sm.freshness(box, held)
    assert (sm.get_state(box, held), bits(held)) == before
    assert [id(array) for array in (held.qpos, held.qvel, held.ctrl)] == arrays


def test_asking_and_watching_change_no_future(box: Model) -> None:
    ends = []
    for ask in (False, True):
        with started(box) as data:
            data.ctrl[0] += 0.3
            for k in range(40):
                sm.step(box, data)
                if ask and k % 10 == 0:
                    with sm.watch_freshness(box, data):
                        _ = data.xpos, data.contacts
                        sm.freshness(box, data)
            ends.append((sm.get_state(box, data), bits(data)))
    assert ends[0] == ends[1]


@pytest.fixture
def scratches(monkeypatch: pytest.MonkeyPatch) -> list[Data]:
    """The Data that a question makes for itself, in a list that grows."""
    made: list[Data] = []

    def make_data(model: Model) -> Data:
        made.append(sm.make_data(model))
        return made[-1]

    monkeypatch.setattr("statemachine.freshness.age.make_data", make_data)
    return made


def open_ones(scratches: list[Data]) -> list[Data]:
    return [data for data in scratches if not repr(data).endswith("closed>")]


def test_every_scratch_is_closed(arm: Model, scratches: list[Data]) -> None:
    with opened(arm) as (model, data):
        sm.freshness(model, data)
        with sm.watch_freshness(model, data):
            sm.freshness(model, data)
    assert len(scratches) == 2
    assert open_ones(scratches) == []


def test_the_scratch_of_a_watch_is_closed_where_its_block_raises(
    arm: Model, scratches: list[Data]
) -> None:
    with (
        opened(arm) as (model, data),
        pytest.raises(RuntimeError, match="mine"),
        sm.watch_freshness(model, data),
    ):
        raise RuntimeError("mine")
    assert len(scratches) == 1
    assert open_ones(scratches) == []


def test_a_scratch_is_closed_where_the_question_fails_in_its_middle(
    arm: Model, scratches: list[Data], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Scratch, "one_step_back", None)
    with opened(arm, nstep=3) as (model, data):
        refused(
            (TypeError, "", lambda: sm.freshness(model, data)),
            (TypeError, "", lambda: sm.watch_freshness(model, data).__enter__()),
        )
        sm.step(model, data)  # and nobody watches
    assert len(scratches) == 2
    assert open_ones(scratches) == []


@pytest.mark.parametrize("ask", [sm.freshness, sm.watch_freshness], ids=["freshness", "watch"])
def test_a_data_of_another_model_is_refused(ask: Any, backend: str) -> None:
    model, other = (sm.load("so101", backend=backend) for _ in range(2))
    with sm.make_data(model) as data:
        refused((ForeignDataError, "", lambda: ask(other, data)))


@pytest.mark.parametrize("ask", [sm.freshness, sm.watch_freshness], ids=["freshness", "watch"])
def test_swapped_arguments_are_refused(ask: Any, arm: Model) -> None:
    with sm.make_data(arm) as data:
        refused((TypeError, "a Model and a Data", lambda: ask(data, arm)))


def test_what_is_no_number_is_refused_by_its_joint(arm: Model) -> None:
    with sm.make_data(arm) as data:
        data.qpos[1] = np.nan
        refused((BadInputError, "shoulder_lift", lambda: sm.freshness(arm, data)))


def test_a_data_that_diverged_is_refused_until_it_is_reset(mujoco_arm: Model) -> None:
    with sm.make_data(mujoco_arm) as data:
        data.qpos[1] = np.nan
        refused(
            ((DivergedError, BadInputError), "", lambda: sm.step(mujoco_arm, data)),
            (DivergedError, "", lambda: sm.freshness(mujoco_arm, data)),
        )
        sm.reset(mujoco_arm, data)
        assert sm.freshness(mujoco_arm, data).stale


def test_a_closed_data_is_refused(arm: Model) -> None:
    data = sm.make_data(arm)
    data.close()
    refused((ClosedDataError, "", lambda: sm.freshness(arm, data)))


@pytest.mark.usefixtures("bullet")
def test_an_engine_that_does_not_tell_forces() -> None:
    native = sm.load("so101/scene", backend="pybullet", defaults="engine")
    with opened(native, ctrl=0.3, nstep=10) as (model, data):
        found = sm.freshness(model, data)
        told = [*POSES, "qfrc_bias", "qfrc_actuator", "contacts"]
        assert [row.name for row in found.rows] == told
        assert found["site_xpos"].of == "1 step ago"
        sm.forward(model, data)
        assert sm.freshness(model, data)


# The table.


def test_a_result_is_frozen_and_knows_the_names_of_its_rows(box: Model, held: Data) -> None:
    found = sm.freshness(box, held)
    refused(
        (AttributeError, "", partial(setattr, found, "time", 3.0)),
        (sm.errors.UnknownNameError, "site_xpos", lambda: found["site_xpo"]),
    )


def test_what_is_stale_is_in_the_json(box: Model, held: Data) -> None:
    found = sm.freshness(box, held)
    assert plain(found)["stale"] == list(found.stale)


def test_a_note_says_where_a_restore_is_not_exact(box: Model, held: Data) -> None:
    """Of two that touch such an engine remembers what no State has."""
    notes = sm.freshness(box, held).notes
    is_said = any("need be age" in note for note in notes)
    assert is_said is not box.capabilities.exact_restore


def test_no_note_is_about_contacts_where_nothing_touches(box: Model) -> None:
    with sm.make_data(box) as data:
        data.qpos[int(box.jnt_qposadr[box.joint_id("box")]) + 2] = 1.0
        assert not any("need be age" in note for note in sm.freshness(box, data).notes)


def test_the_table_has_a_row_of_each_array_and_fits(box: Model, held: Data) -> None:
    lines = str(sm.freshness(box, held)).splitlines()
    assert max(map(len, lines)) <= 80
    assert f"scene_box on {box.backend} {box.engine_version} at 6.15 s" in lines[0]
    names = readable_arrays(box)
    assert all(any(line.startswith(name) for line in lines) for name in names)


def test_the_last_line_of_the_table_says_what_to_do(box: Model, held: Data) -> None:
    assert "sm.forward(model, data)" in str(sm.freshness(box, held)).splitlines()[-1]
    sm.forward(box, held)
    assert "sm.forward" not in str(sm.freshness(box, held))


@pytest.mark.parametrize(
    ("size", "unit", "where", "text"),
    [
        (0.00995, "m", "tip", "9.95 mm at tip"),
        (math.pi / 2, "rad", "", "90°"),
        (1.0, "appears", "a – b", "1 appears at a – b"),
        (2.0, "vanishes", "a – b", "2 vanish at a – b"),
        (2.5, "N·m", "j", "2.5 N·m at j"),
        (1e-12, "m", "tip", "below 1e-06 mm at tip"),
        (None, "rad", "", "all zero, which is not a rotation"),
    ],
)
def test_a_gap_in_words(size: float | None, unit: str, where: str, text: str) -> None:
    assert str(Gap(size, unit, where)) == text


def test_rounding_is_left_out_beside_more() -> None:
    small, large = Gap(1e-15, "N", "box"), Gap(0.5, "N·m", "j")
    assert list(significant_gaps([small, large])) == [large]
    assert list(significant_gaps([small])) == [small]


def test_a_gap_has_a_line_of_its_own() -> None:
    rows = [(["x"], [Gap(0.012, "m", "tip"), Gap(13.0, "N", "box")]), (["y"], [])]
    lines = table(("a", "b"), rows, no_gap="–")
    assert [line.split() for line in lines[2:]] == [
        ["x", "12", "mm", "at", "tip"],
        ["13", "N", "at", "box"],
        ["y", "–"],
    ]


@pytest.fixture
def four_contacts(mujoco_box: Model) -> Iterator[tuple[Model, Contacts]]:
    """The model, and its contacts in the first keyframe."""
    with opened(mujoco_box, keyframe=1, derived=True) as (model, data):
        assert len(data.contacts) == 4
        yield model, data.contacts


def some_of(
    contacts: Contacts, rows: list[int], last: tuple[int, int] | None = None, shift: float = 0.0
) -> Contacts:
    """Return rows of contacts; the last of other geoms, the first moved along x [m]."""
    columns = {name: np.array(value[rows]) for name, value in vars(contacts).items()}
    columns["pos"][0] += (shift, 0, 0)
    if last:
        columns["geom"][-1] = last
    return type(contacts)(**columns)


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ({"rows": [0, 1, 2, 3]}, {"rows": [0, 1, 2, 3]}, {}),
        ({"rows": [3, 1, 0, 2]}, {"rows": [0, 1, 2, 3]}, {}),  # another order
        ({"rows": [0, 1, 2]}, {"rows": [0, 1, 2, 3]}, {"appears": (1.0, "box on floor")}),
        ({"rows": [0, 1, 2, 3]}, {"rows": [0, 1]}, {"vanishes": (2.0, "box on floor")}),
        (
            {"rows": [0, 1, 2, 3], "shift": 1e-3},
            {"rows": [0, 1, 2, 3]},
            {"m": (pytest.approx(1e-3), "box on floor")},
        ),
        (
            {"rows": [0, 1, 2, 3], "last": (1, 2)},
            {"rows": [0, 1, 2, 3]},
            {"appears": (1.0, "box on floor"), "vanishes": (1.0, "base on base")},
        ),
    ],
    ids=["the same", "another order", "one appears", "two vanish", "one moves", "other geoms"],
)
def test_contacts_are_matched_by_what_touches(
    left: dict[str, Any],
    right: dict[str, Any],
    expected: dict[str, Any],
    four_contacts: tuple[Model, Contacts],
) -> None:
    model, now = four_contacts
    found = gaps(model, "contacts", some_of(now, **left), some_of(now, **right))
    assert {gap.unit: (gap.size, gap.where) for gap in found} == expected


STEPPED = "m = sm.load('so101'); d = sm.make_data(m); sm.step(m, d); sm.forward(m, d)"


@pytest.mark.parametrize(
    ("code", "printed"),
    [
        (f"{STEPPED}; import sys; print('statemachine.freshness' in sys.modules)", "False\n"),
        ("import statemachine.freshness; print(callable(sm.freshness))", "True\n"),
        ("sm.watch_freshness; print(callable(sm.freshness))", "True\n"),
        ("print(sm.freshness.__name__)", "freshness\n"),
    ],
)
def test_the_name_can_be_called_and_its_module_is_loaded_when_it_is_asked_for(
    code: str, printed: str
) -> None:
    runs_in_silence(f"import statemachine as sm; {code}", ROOT, printed)


def test_a_rotation_differs_by_its_angle(mujoco_arm: sm.Model) -> None:
    one = np.tile([1.0, 0, 0, 0], (mujoco_arm.nbody, 1))
    two = one.copy()
    two[2] = (np.cos(0.1), np.sin(0.1), 0, 0)
    (gap,) = gaps(mujoco_arm, "xquat", one, two)
    assert_has(gap, size=pytest.approx(0.2), where=mujoco_arm.body_names[2])


def test_a_quaternion_and_its_negative_are_one_rotation_of_other_bits(
    mujoco_arm: sm.Model,
) -> None:
    one = np.tile([1.0, 0, 0, 0], (mujoco_arm.nbody, 1))
    (gap,) = gaps(mujoco_arm, "xquat", one, -one)
    assert gap.size == 0


def test_a_matrix_and_its_negative_are_two_rotations(mujoco_arm: sm.Model) -> None:
    one = np.tile(np.eye(3).ravel(), (mujoco_arm.nsite, 1))
    (gap,) = gaps(mujoco_arm, "site_xmat", one, -one + 0)
    assert gap.size != 0


def test_a_model_without_names_sites_or_motors(tmp_path: Path) -> None:
    """A ball and a slide, and nothing that could be named."""
    plain_one = loaded(
        tmp_path,
        '<body><joint type="ball" damping="1e-3"/><geom size=".1" pos=".2 0 0" mass="1"/>'
        '<body pos=".4 0 0"><joint type="slide" axis="0 1 0"/><geom size=".05" mass="1"/>'
        "</body></body>",
    )
    with opened(plain_one, qvel=(1, 2, 3, 0.5), nstep=30) as (model, data):
        found = sm.freshness(model, data)
        assert_has(found["xpos"], of="1 step ago", steps=1)
        assert any({"body 1", "body 2"} <= set(re.findall(r"body \d", n)) for n in found.notes)
        assert set(sizes(found["qacc"].gaps)) == {"m/s²", "rad/s²"}
        assert found["site_xpos"].now  # there are none
