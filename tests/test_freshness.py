"""Freshness: of which moment each derived array is, how wrong, and what a watch counts."""

from __future__ import annotations

import math
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
    StaleReadError,
)
from statemachine.freshness.age import Scratch
from statemachine.freshness.gaps import gaps, significant_gaps
from statemachine.freshness.rows import table
from statemachine.interface import DERIVED, POSES, Data, Model
from statemachine.measures import Gap
from statemachine.rotations import matrix_from_quat
from statemachine.show.as_json import plain

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


def test_a_fresh_data_was_never_computed(box: Model) -> None:
    with sm.make_data(box) as data:
        state = sm.get_state(box, data)
        for again in (
            lambda: None,
            lambda: sm.reset(box, data),
            lambda: sm.set_state(box, data, state),
        ):
            again()
            found = sm.freshness(box, data)
            assert set(POSES) <= set(found.stale)
            assert {found[name].of for name in found.stale} == {"never computed"}
            assert found["site_xmat"].gaps == (Gap(None, "rad", ""),)
            assert sizes(found["contacts"].gaps) == {"appears": 4.0}
            # The fingertip of the lesson's first table, from the origin.
            tip = math.hypot(0.3914, -0.001, 0.2463)
            assert sizes(found["site_xpos"].gaps)["m"] == pytest.approx(tip, abs=1e-4)
            sm.forward(box, data)


def test_each_array_has_its_own_inputs(arm: Model) -> None:
    """Found by value: poses do not hear of qvel and ctrl, nor the bias of ctrl."""
    with opened(arm, qpos=TARGET, ctrl=TARGET, derived=True) as (model, data):
        data.ctrl[1] += 1e-3
        by_ctrl = set(sm.freshness(model, data).stale)
        # kp · 0.001 rad, unsaturated: the servo is affine in ctrl.
        assert sizes(sm.freshness(model, data)["qfrc_actuator"].gaps) == {
            "N·m": pytest.approx(float(model.actuator_kp[1]) * 1e-3)
        }
        data.ctrl[1] = TARGET[1]
        sm.forward(model, data)
        data.qvel[1] += 0.1
        by_qvel = sm.freshness(model, data)
    # Friction and, by rounding, PyBullet's contact force follow from what the servos do.
    follows = {"qfrc_friction", "qfrc_constraint", "qfrc_contact"}
    assert {"qacc", "qfrc_actuator"} <= by_ctrl <= {"qacc", "qfrc_actuator"} | follows
    assert {"qacc", "qfrc_passive", "qfrc_bias"} <= set(by_qvel.stale)
    assert set(by_qvel.stale).isdisjoint(POSES)
    # d·0.1 rad/s of viscous damping.
    assert sizes(by_qvel["qfrc_passive"].gaps) == {
        "N·m": pytest.approx(float(model.dof_damping[1]) * 0.1)
    }


@pytest.mark.parametrize("nstep", [1, 7])
@pytest.mark.parametrize("substeps", [1, 4])
def test_a_step_is_found_by_going_back(backend: str, substeps: int, nstep: int) -> None:
    with opened(
        sm.load("so101/scene_box", backend=backend).replace(substeps=substeps),
        ctrl=TARGET,
        nstep=10,
    ) as (model, data):
        sm.step(model, data, nstep)
        found = sm.freshness(model, data)
        assert_has(found["xpos"], of="1 step ago" if substeps == 1 else "1 substep ago", steps=1)
        assert f"h = {5 / substeps:g} ms" in str(found)
        # Another state than the one that the last step left: no longer to be found ...
        data.qvel[:] = 0.3
        assert sm.freshness(model, data)["xpos"].of == "an earlier state"


def test_a_step_is_found_behind_a_later_write(arm: Model) -> None:
    """What hangs on the written joint was written; what carries it is one step old."""
    with opened(arm, ctrl=0.3, nstep=20) as (model, data):
        data.qpos[model.joint_id("elbow_flex")] += 0.4
        found = sm.freshness(model, data)
    assert found["xpos"].of == "1 step ago"
    assert_in(
        " ".join(str(found).split()),
        "gives the poses of shoulder, upper_arm, to",
        "lower_arm, wrist, gripper and 2 more match neither moment",
    )


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
        assert "need be age" not in str(found)  # nothing touches
        fall, turn = sorted(found["qacc"].gaps, key=lambda gap: gap.unit)
        assert_has(fall, unit="m/s²", size=pytest.approx(9.81), where="box")
        assert turn.where != "box"


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
        assert ("fourth stage" in str(found)) == (backend == "mujoco")


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


def test_data_is_untouched_and_so_is_its_future(box: Model) -> None:
    ends = []
    for ask in (False, True):
        with started(box) as data:
            data.ctrl[0] += 0.3
            for k in range(40):
                sm.step(box, data)
                if ask and k % 10 == 0:
                    arrays = [id(array) for array in (data.qpos, data.qvel, data.ctrl)]
                    before = sm.get_state(box, data), bits(data)
                    sm.freshness(box, data)
                    with sm.watch_freshness(box, data) as watch:
                        _ = data.xpos, data.contacts
                        assert sm.freshness(box, data)["xpos"].of == "1 step ago"
                    assert watch.reads == 2
                    assert (sm.get_state(box, data), bits(data)) == before
                    assert [id(array) for array in (data.qpos, data.qvel, data.ctrl)] == arrays
            ends.append((sm.get_state(box, data), bits(data)))
    assert ends[0] == ends[1]


def test_every_scratch_is_closed(arm: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Data] = []
    monkeypatch.setattr(
        "statemachine.freshness.age.make_data",
        lambda model: made.append(sm.make_data(model)) or made[-1],
    )
    with opened(arm) as (model, data):
        sm.freshness(model, data)
        with sm.watch_freshness(model, data):
            sm.freshness(model, data)
        with pytest.raises(RuntimeError, match="mine"), sm.watch_freshness(model, data):
            raise RuntimeError("mine")
        monkeypatch.setattr(Scratch, "one_step_back", None)  # fails in the middle
        sm.step(model, data, 3)
        refused(
            (TypeError, "", lambda: sm.freshness(model, data)),
            (TypeError, "", lambda: sm.watch_freshness(model, data).__enter__()),
        )
        sm.step(model, data)
    assert [repr(each).endswith("closed>") for each in made] == [True] * 5


def test_what_cannot_be_asked_is_said(backend: str) -> None:
    model = sm.load("so101", backend=backend)
    data, other = sm.make_data(model), sm.load("so101", backend=backend)
    swapped: Any = data, model
    refused(
        (ForeignDataError, "", lambda: sm.freshness(other, data)),
        (ForeignDataError, "", lambda: sm.watch_freshness(other, data)),
        (TypeError, "a Model and a Data", lambda: sm.freshness(*swapped)),
        (TypeError, "a Model and a Data", lambda: sm.watch_freshness(*swapped)),
    )
    data.qpos[1] = np.nan
    refused(
        (BadInputError, "shoulder_lift", lambda: sm.freshness(model, data)),
        ((DivergedError, BadInputError), "", lambda: sm.step(model, data)),
    )
    if backend == "mujoco":
        refused((DivergedError, "", lambda: sm.freshness(model, data)))
    sm.reset(model, data)
    assert sm.freshness(model, data).stale
    data.close()
    refused((ClosedDataError, "", lambda: sm.freshness(model, data)))


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


def test_the_table_fits_and_says_what_to_do(box: Model, held: Data) -> None:
    found = sm.freshness(box, held)
    refused(
        (AttributeError, "", partial(setattr, found, "time", 3.0)),
        (sm.errors.UnknownNameError, "site_xpos", lambda: found["site_xpo"]),
    )
    assert plain(found)["stale"] == list(found.stale)
    # Of two that touch PyBullet remembers what no State has.
    assert any("need be age" in note for note in found.notes) == (box.backend == "pybullet")
    lines = repr(found).splitlines()
    assert max(map(len, lines)) <= 80
    assert f"scene_box on {box.backend} {box.engine_version} at 6.15 s" in lines[0]
    assert lines[-1] == "sm.forward(model, data) makes all of them of now."
    assert all(any(line.startswith(name) for line in lines) for name in (*DERIVED, "contacts"))
    sm.forward(box, held)
    assert str(sm.freshness(box, held)).splitlines()[-1] == "All are of now."


@pytest.mark.parametrize(
    ("gap", "text"),
    [
        (Gap(0.00995, "m", "tip"), "9.95 mm at tip"),
        (Gap(np.pi / 2, "rad", ""), "90°"),
        (Gap(1.0, "appears", "a – b"), "1 appears at a – b"),
        (Gap(2.0, "vanishes", "a – b"), "2 vanish at a – b"),
        (Gap(2.5, "N·m", "j"), "2.5 N·m at j"),
        (Gap(1e-12, "m", "tip"), "below 1e-06 mm at tip"),
        (Gap(None, "rad", ""), "all zero, which is not a rotation"),
    ],
)
def test_gaps_in_words(gap: Gap, text: str) -> None:
    assert str(gap) == text


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


def test_contacts_are_matched_by_what_touches() -> None:
    """One moves, one of its pair comes, another pair goes."""
    with opened(sm.load("so101/scene_box"), keyframe=1, derived=True) as (model, data):
        now = data.contacts
    assert len(now) == 4

    def part(keep: list[int], geom: tuple[int, int] | None = None, shift: float = 0.0):
        found = {name: np.array(value[keep]) for name, value in vars(now).items()}
        found["pos"][0] += (shift, 0, 0)
        if geom:
            found["geom"][-1] = geom
        return type(now)(**found)

    for left, right, expected in (
        (now, now, {}),
        (part([3, 1, 0, 2]), now, {}),  # another order
        (part([0, 1, 2]), now, {"appears": (1.0, "box on floor")}),
        (now, part([0, 1]), {"vanishes": (2.0, "box on floor")}),
        (part([0, 1, 2, 3], shift=1e-3), now, {"m": (pytest.approx(1e-3), "box on floor")}),
        (
            part([0, 1, 2, 3], geom=(1, 2)),
            now,
            {"appears": (1.0, "box on floor"), "vanishes": (1.0, "base on base")},
        ),
    ):
        found = gaps(model, "contacts", left, right)
        assert {gap.unit: (gap.size, gap.where) for gap in found} == expected


# What a program gets wrong shows by value.


def test_what_is_written_past_the_interface_is_seen() -> None:
    """A force that only the engine's own object takes."""
    with opened(sm.load("so101"), derived=True) as (model, data):
        data.raw.qfrc_applied[1] = 0.1
        assert "qacc" in sm.freshness(model, data).stale
        with sm.watch_freshness(model, data, raise_on_stale=True):
            refused((StaleReadError, "qacc is of an earlier state", lambda: data.qacc))


# Watching.


def test_a_watch_counts_writes_and_steps(box: Model) -> None:
    with sm.make_data(box) as data, sm.watch_freshness(box, data):

        def row(name: str) -> tuple[str, int | None, int | None]:
            found = sm.freshness(box, data)[name]
            return found.of, found.steps, found.writes

        assert row("xpos") == ("never computed", None, None)
        sm.forward(box, data)
        assert row("xpos") == ("now", 0, 0)
        data.qpos[1] = 0.8
        data.ctrl[:] = 0.2
        data.ctrl[2] = 0.3
        data.ctrl[2] = 0.3  # the same again is not a change
        data.ctrl = np.full(box.nu, 0.1)
        assert row("xpos") == ("1 write ago", 0, 1)
        assert row("qfrc_actuator") == ("4 writes ago", 0, 4)
        assert sm.freshness(box, data).written[:2] == (
            "qpos[1] (shoulder_lift)",
            "ctrl[0] (shoulder_pan)",
        )
        data.qpos[1] = 0.0  # back where it was: the poses are of now
        assert row("xpos") == ("now", 0, 0)
        assert row("qfrc_actuator") == ("5 writes ago", 0, 5)
        sm.step(box, data, 12)
        assert row("xpos") == ("1 step ago", 1, 0)
        data.qpos[1] += 0.1
        assert row("xpos") == ("1 step and 1 write ago", 1, 1)
        assert sm.freshness(box, data).written == ("qpos[1] (shoulder_lift)",)
        data.qvel[1] = 3.0
        data.ctrl[1] = 0.7
        assert row("qfrc_bias") == ("1 step and 2 writes ago", 1, 2)  # ctrl is not its
        assert row("qfrc_actuator") == ("1 step and 3 writes ago", 1, 3)
        sm.reset(box, data)
        assert row("xpos") == ("never computed", None, None)
        state = sm.get_state(box, data)
        sm.forward(box, data)
        sm.set_state(box, data, state)
        assert row("xpos") == ("never computed", None, None)


def test_a_watch_begins_with_what_can_be_found(arm: Model) -> None:
    with opened(arm, ctrl=0.3, nstep=10) as (model, data):
        with sm.watch_freshness(model, data):
            data.qpos[0] += 0.1
            assert sm.freshness(model, data)["xpos"].of == "1 step and 1 write ago"
        sm.forward(model, data)
        data.qpos[0] += 0.1
        with sm.watch_freshness(model, data):
            data.qpos[0] += 0.1
            assert sm.freshness(model, data)["xpos"].of == "an earlier state"


def test_a_stale_read_raises_and_says_what_to_do(box: Model) -> None:
    with sm.make_data(box) as data, sm.watch_freshness(box, data, raise_on_stale=True):
        refused((StaleReadError, r"^xpos was never computed .*box", lambda: data.xpos))
        sm.forward(box, data)
        for name in (*DERIVED, "contacts"):
            getattr(data, name)
        data.qvel[0] = 0.5
        _ = data.site_xpos, data.xquat  # do not depend on it
        refused((StaleReadError, "", lambda: data.qfrc_passive))
        data.qpos[1] = 0.8
        error = refused((StaleReadError, "", lambda: data.site_xpos))
        assert str(error) == (
            f"site_xpos is of 1 write ago ({1e3 * error.gaps[0].size:.3g} mm at gripperframe; "
            "written since: qpos[1] (shoulder_lift)): call sm.forward(model, data) before "
            "reading it"
        )
        assert (error.name, error.steps, error.writes) == ("site_xpos", 0, 1)
        assert 1e3 * error.gaps[0].size == pytest.approx(270, abs=1)
        refused((StaleReadError, r"^contacts is of 2 writes ago .*appear", lambda: data.contacts))
        data.qpos[1] = data.qvel[0] = 0.0
        _ = data.contacts  # everything is back
        sm.step(box, data, 3)
        refused((StaleReadError, r"is of 1 step ago \(.* mm at", lambda: data.xpos))
        data.qpos[1] = np.nan
        says = r"is of 1 step and 1 write ago \(written since: "
        refused((StaleReadError, says, lambda: data.xpos))


def test_a_watch_names_the_lines_that_read_and_tells_the_worst(box: Model) -> None:
    """9.95 mm of fingertip in 0.3 s of the lesson's hold, which is one step behind."""
    lags = []
    with sm.make_data(box) as data:

        def controller() -> None:
            _ = data.site_xpos

        line = controller.__code__.co_firstlineno + 1
        data.ctrl[:6] = TARGET
        with sm.watch_freshness(box, data) as watch:
            for _ in range(60):
                sm.step(box, data)
                controller()
                lags.append(sm.freshness(box, data)["site_xpos"].gaps[0].size)
            sm.forward(box, data)
            controller()
        controller()  # nobody watches any more
    assert watch.reads == 61
    (read,) = watch.stale_reads
    assert_has(read, name="site_xpos", count=60, of="1 step ago", place=f"test_freshness.py:{line}")
    assert read.gaps[0].size == max(lags) == pytest.approx(9.95e-3, abs=1e-5)
    assert lags[-1] < max(lags)
    text = str(watch)
    assert text.startswith("60 of 61 reads were stale")
    assert max(map(len, text.splitlines())) <= 80


def test_a_watch_leaves_nothing_behind(box: Model) -> None:
    with sm.make_data(box) as data:
        kind, advance = type(data), data._advance
        with sm.watch_freshness(box, data):
            assert isinstance(data, kind)
            assert type(data).__name__ == kind.__name__
            refused(
                (
                    BadInputError,
                    "watched already",
                    lambda: sm.watch_freshness(box, data).__enter__(),
                )
            )
        assert type(data) is kind
        assert data._advance is advance
        sm.step(box, data)
    with sm.make_data(box) as data:
        with sm.watch_freshness(box, data):
            data.close()
            assert data.qpos.shape == (box.nq,)
        refused((ClosedDataError, "", lambda: data.xpos))


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


def test_rotations_are_compared_as_rotations(mujoco_arm: sm.Model) -> None:
    """A quaternion and its negative are one rotation, of other bits."""
    one = np.tile([1.0, 0, 0, 0], (mujoco_arm.nbody, 1))
    two = one.copy()
    two[2] = (np.cos(0.1), np.sin(0.1), 0, 0)
    (gap,) = gaps(mujoco_arm, "xquat", one, two)
    assert_has(gap, size=pytest.approx(0.2), where=mujoco_arm.body_names[2])
    (gap,) = gaps(mujoco_arm, "xquat", one, -one)
    assert gap.size == 0
    mats = matrix_from_quat(one)[: mujoco_arm.nsite].reshape(-1, 9)
    (gap,) = gaps(mujoco_arm, "site_xmat", mats, -mats + 0)
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
        assert found["xpos"].of == "1 step ago"
        assert "the poses of body 1, body 2" in " ".join(str(found).split())
        assert set(sizes(found["qacc"].gaps)) == {"m/s²", "rad/s²"}
        assert found["site_xpos"].now  # there are none
        sm.forward(model, data)
        assert sm.freshness(model, data)
