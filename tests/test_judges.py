"""What each judge says of a run that is written down here, number by number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.course.grading.inside.answers import Answer
from statemachine.course.grading.inside.calls import FaultError
from statemachine.course.grading.inside.watch import EngineRun, Inputs, Nudge
from statemachine.course.grading.inside.worlds import ExerciseWorld
from statemachine.course.grading.judges import (
    WorldJudgement,
    forward,
    gravity,
    judgement_of,
    listed,
    near,
    numbers,
    owner,
    parts,
    replay,
    rounding_error,
    same_bits,
    short_float,
    state,
    told_apart,
    verified,
    wrong,
)
from statemachine.course.grading.judges.remarks import (
    OfForward,
    OfGravity,
    OfReplay,
    OfResult,
    OfState,
)
from statemachine.interface import Array

from .support.small_models import loaded

# A crate before the arm, so that no joint stands in qpos where its number says.
ARM = (
    '<body name="crate" pos="-1 0 3"><freejoint name="crate"/>'
    '<geom size=".05" mass=".3" contype="0" conaffinity="0"/></body>'
    '<body name="arm" pos="0 0 1"><joint name="pan" axis="0 0 1"/><geom size=".05" mass="1"/>'
    '<site name="camera" pos="0 .2 .1"/>'
    '<body name="upper" pos="0 0 .1"><joint name="shoulder_lift" axis="0 1 0"/>'
    '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".5" contype="0" '
    'conaffinity="0"/><site name="gripperframe" pos=".3 .1 0"/></body></body>'
)
DRIVES = (
    '<actuator><position name="pan" joint="pan" kp="5"/>'
    '<position name="shoulder_lift" joint="shoulder_lift" kp="3" kv=".3"/></actuator>'
    '<keyframe><key time="2.5" qpos="-1 0 3 1 0 0 0 .1 .2" ctrl=".3 .4"/>'
    '<key time="7" qpos="-1 0 3 1 0 0 0 .5 .6" ctrl="0 0"/></keyframe>'
)
PAN, LIFT, BOX_HEIGHT = 7, 8, 2  # in qpos
REST = np.array([-1.0, 0, 3, 1, 0, 0, 0, 0, 0])
NO_SPEED, NO_COMMAND = np.zeros(8), np.zeros(2)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> sm.Model:
    """The arm behind a crate."""
    folder = tmp_path_factory.mktemp("judges")
    return loaded(folder, ARM, DRIVES, option='<option timestep="0.01"/>')


def inputs(number: int = 0, time: float = 0.0, **arrays: Array) -> Inputs:
    """Return inputs at rest, with other arrays where they are given."""
    usual = {"qpos": REST, "qvel": NO_SPEED, "ctrl": NO_COMMAND} | arrays
    return Inputs(number, usual["qpos"], usual["qvel"], usual["ctrl"], time)


def with_entry(array: Array, *entries: tuple[int, float]) -> Array:
    """Return a copy with other entries."""
    copy = array.copy()
    for place, value in entries:
        copy[place] = value
    return copy


def run_of(start: Inputs, end: Inputs, nstep: int = 100, **more: Any) -> EngineRun:
    """Return a run of the given model."""
    return EngineRun(**{"on_given_model": True, "start": start, "end": end, "nstep": nstep} | more)


# What all judges share.


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ([0.25, 1.5], 0.005),
        ([0.251, 1.5], 0.0005),
        ([0.12345678], 0.5e-8),
        ([0.123456789], 0.0),
        ([1 / 3], 0.0),
    ],
)
def test_half_of_the_last_decimal_is_the_rounding(values: list[float], error: float) -> None:
    assert rounding_error(np.array(values)) == pytest.approx(error, rel=1e-12)


def test_what_is_as_far_apart_as_the_tolerance_is_near() -> None:
    left = np.array([1.0, 2.0])
    assert near(left, left + 0.25, 0.25)
    assert not near(left, left + 0.26, 0.25)
    assert not near(left, left[:1], 9.0)
    assert not near(left, np.array([1.0, math.nan]), 9.0)


def test_bits_are_the_same_where_all_numbers_are() -> None:
    left = np.array([1.0, 2.0])
    assert same_bits(left, left.copy())
    assert not same_bits(left, np.nextafter(left, 9))
    assert not same_bits(left, left[:1])


def test_each_place_in_qpos_has_an_owner(model: sm.Model) -> None:
    assert [owner(model, place) for place in (0, 6, 7, 8)] == [
        "crate",
        "crate",
        "pan",
        "shoulder_lift",
    ]


@pytest.mark.parametrize(
    ("value", "dtype"),
    [
        (np.zeros(2, np.float32), "float32"),
        (np.zeros(2, np.float16), "float16"),
        (np.zeros(2), ""),
        (np.zeros(2, np.int32), ""),
        ([1.0, (2.0, np.float32(3))], "float32"),
        (1.0, ""),
    ],
)
def test_a_type_with_few_digits_is_found(value: Any, dtype: str) -> None:
    assert short_float(value) == dtype


def test_two_values_are_told_apart_by_as_many_digits_as_it_takes() -> None:
    text = "{:.{}g}".format
    assert told_apart(1.0, 2.0, text) == ("1", "2")
    assert told_apart(1.23456, 1.23457, text) == ("1.23456", "1.23457")
    assert told_apart(1.23449, 1.23452, text) == ("1.234", "1.235")


def test_numbers_are_listed_with_four_digits() -> None:
    assert listed(np.array([0.123456, -0.0, 2])) == "[0.1235 0 2]"


@pytest.mark.parametrize("value", [(1, 2, 3), 5, np.float64(1), "ab", None])
def test_another_number_of_parts_is_refused(value: Any) -> None:
    with pytest.raises(FaultError):
        parts(value, 2, "two")


def test_parts_of_an_array_are_its_rows() -> None:
    assert [part.tolist() for part in parts(np.eye(2), 2, "two")] == [[1, 0], [0, 1]]


@pytest.mark.parametrize("value", [[1, 2], [[1, 2], [3]], "ab", None])
def test_other_numbers_than_asked_for_are_refused(value: Any) -> None:
    with pytest.raises(FaultError):
        numbers(value, (3,), "three")


# The verdict on all worlds.


def test_a_function_passes_where_it_does_on_all_worlds(model: sm.Model) -> None:
    worlds = [ExerciseWorld(where, model, ()) for where in ("", "in another")]
    layout = state.right(worlds[0])
    answer = Answer((slots_of(layout), 2.5))
    verdict = judgement_of("demo_state", worlds, [layout, layout], [answer, answer])
    passed = OfState.PASSED.filled(joints=3, free="crate")
    said = OfResult.PASSED.filled(remark=passed, others="1 hidden call")
    assert verdict is not None
    assert (verdict.written, verdict.passed, verdict.judged) == (True, True, True)
    assert verdict.remarks == (said,)


def test_a_fault_is_said_with_its_world(model: sm.Model) -> None:
    worlds = [ExerciseWorld(where, model, ()) for where in ("", "in another")]
    layout = state.right(worlds[0])
    answers = [Answer((slots_of(layout), 2.5)), Answer((2.5, slots_of(layout)))]
    verdict = judgement_of("demo_state", worlds, [layout, layout], answers)
    assert verdict is not None
    assert (verdict.written, verdict.passed) == (True, False)
    assert verdict.remarks == (f"in another: {OfState.SWAPPED.filled()}",)


def test_fewer_answers_than_worlds_are_no_verdict(model: sm.Model) -> None:
    worlds = [ExerciseWorld(where, model, ()) for where in ("", "in another")]
    layout = state.right(worlds[0])
    answer = Answer((slots_of(layout), 2.5))
    assert judgement_of("demo_state", worlds, [layout, layout], [answer]) is None


# demo_state.


def slots_of(layout: state.Layout) -> dict[str, tuple[slice, slice]]:
    """Return the slots that are right, as slices."""
    return {name: (slice(*pair[0]), slice(*pair[1])) for name, pair in layout.slots.items()}


def judged_state(model: sm.Model, result: Any, course: float = 6.0, **more: Any) -> WorldJudgement:
    """Return what is said of a result of demo_state."""
    world = ExerciseWorld("", model, ())
    right = state.right(world)
    return state.judge(Answer(result, **more), world, right, replace(right, time=course))


def test_the_layout_is_that_of_the_model(model: sm.Model) -> None:
    layout = state.right(ExerciseWorld("", model, ()))
    assert layout.time == 2.5
    assert layout.slots == {
        "crate": ((0, 7), (0, 6)),
        "pan": ((7, 8), (6, 7)),
        "shoulder_lift": ((8, 9), (7, 8)),
    }


RIGHT_SLOTS = {
    "crate": (slice(0, 7), slice(0, 6)),
    "pan": (slice(7, 8), slice(6, 7)),
    "shoulder_lift": (slice(8, 9), slice(7, 8)),
}


@pytest.mark.parametrize(
    "slots",
    [
        RIGHT_SLOTS,
        RIGHT_SLOTS | {"crate": (slice(None, 7), slice(0, 6, 1))},
        RIGHT_SLOTS | {"shoulder_lift": (slice(8, None), slice(-1, None))},
        RIGHT_SLOTS | {"pan": [slice(-2, -1), slice(6, -1)]},
    ],
)
def test_a_slice_may_be_written_in_several_ways(model: sm.Model, slots: Any) -> None:
    said = OfState.PASSED.filled(joints=3, free="crate")
    assert judged_state(model, (slots, 2.5)) == verified(said)


def figures_of_state(joint: str, which: int, got: tuple[int, int], why: str) -> str:
    """Return what is said of a wrong slot of qpos (0) or of qvel (1)."""
    right = RIGHT_SLOTS[joint][which]
    return OfState.FIGURES.filled(
        joint=joint,
        array=("qpos", "qvel")[which],
        start=got[0],
        stop=got[1],
        begin=right.start,
        end=right.stop,
        why=why,
    )


TABLES = ("model.jnt_qposadr", "model.jnt_dofadr")


@pytest.mark.parametrize(
    ("joint", "which", "got", "why"),
    [
        ("crate", 0, (0, 1), OfState.FREE_HAS_MORE.filled()),
        ("crate", 1, (0, 1), OfState.FREE_HAS_MORE.filled()),
        ("crate", 1, (0, 7), OfState.SIX_IN_QVEL.filled()),
        ("crate", 0, (0, 6), OfState.SEVEN_IN_QPOS.filled()),
        ("crate", 1, (0, 5), OfState.END.filled()),
        ("crate", 0, (0, 8), OfState.SIZE.filled(size="8 numbers", needed=7)),
        ("crate", 0, (0, 3), OfState.SIZE.filled(size="3 numbers", needed=7)),
        ("pan", 0, (7, 7), OfState.END.filled()),
        ("pan", 0, (7, 9), OfState.SIZE.filled(size="2 numbers", needed=1)),
        ("pan", 0, (6, 7), OfState.OTHER_ARRAY.filled(array="qvel", table=TABLES[0])),
        ("pan", 1, (7, 8), OfState.OTHER_ARRAY.filled(array="qpos", table=TABLES[1])),
        ("pan", 0, (1, 2), OfState.JOINT_NUMBER.filled(number=1, table=TABLES[0])),
        ("pan", 1, (1, 2), OfState.JOINT_NUMBER.filled(number=1, table=TABLES[1])),
        ("pan", 1, (2, 3), OfState.ELSEWHERE.filled(table=TABLES[1])),
    ],
)
def test_why_a_slot_is_wrong(
    model: sm.Model, joint: str, which: int, got: tuple[int, int], why: str
) -> None:
    pair = [*RIGHT_SLOTS[joint]]
    pair[which] = slice(*got)
    said = judged_state(model, (RIGHT_SLOTS | {joint: tuple(pair)}, 2.5))
    assert said == wrong(figures_of_state(joint, which, got, why))


@pytest.mark.parametrize(
    ("slots", "remark"),
    [
        (
            {"pan": RIGHT_SLOTS["pan"]},
            OfState.MISSING.filled(missing=2, joints=3, names="crate, shoulder_lift"),
        ),
        (
            {"pan": RIGHT_SLOTS["pan"], "a": 1},
            OfState.OTHER_KEYS.filled(missing=2, joints=3, key="a"),
        ),
        (RIGHT_SLOTS | {"a": 1}, OfState.UNKNOWN.filled(name="a")),
        (
            {name: pair[::-1] for name, pair in RIGHT_SLOTS.items()},
            OfState.PAIRS_SWAPPED.filled(),
        ),
    ],
)
def test_what_is_wrong_with_all_slots(model: sm.Model, slots: Any, remark: str) -> None:
    assert judged_state(model, (slots, 2.5)) == wrong(remark)


@pytest.mark.parametrize(
    ("pair", "fault"),
    [
        (slice(0, 1), OfState.ONE_SLICE.filled(joint="crate")),
        ((slice(0, 7),), OfState.NO_PAIR.filled(joint="crate", kind="a tuple of 1")),
        (
            ((0, 7), (0, 6)),
            OfState.PAIR_OF_PAIRS.filled(joint="crate", kinds="tuples", start=0, stop=7),
        ),
        ((0, 7), OfState.PAIR_OF_NUMBERS.filled(joint="crate")),
        ((np.zeros(7), np.zeros(6)), OfState.PAIR_OF_ARRAYS.filled(joint="crate")),
        (
            (slice(0, 7, 2), slice(0, 6)),
            OfState.STEPS.filled(joint="crate", slice=slice(0, 7, 2)),
        ),
        (
            (slice(0, 7), slice(0, 6.0)),
            OfState.NOT_WHOLE.filled(joint="crate", slice=slice(0, 6.0)),
        ),
    ],
)
def test_what_is_no_pair_of_slices_is_refused(model: sm.Model, pair: Any, fault: str) -> None:
    with pytest.raises(FaultError) as caught:
        judged_state(model, (RIGHT_SLOTS | {"crate": pair}, 2.5))
    assert str(caught.value) == fault


AT_KEYFRAME = with_entry(REST, (PAN, 0.1), (LIFT, 0.2))


@pytest.mark.parametrize(
    ("time", "why", "more"),
    [
        (0.0, OfState.TIME_NEW, {"ends": (inputs(),)}),
        (0.0, OfState.TIME_NEW, {"ends": (inputs(qpos=AT_KEYFRAME, time=2.5),)}),
        (0.0, OfState.TIME_ZEROED, {"ends": (inputs(qpos=AT_KEYFRAME),)}),
        (7.0, OfState.TIME_OTHER, {}),
        (6.0, OfState.TIME_COURSE, {}),
        (2.51, OfState.TIME_STEPPED, {"runs": (run_of(inputs(), inputs()),)}),
        (2.51, None, {}),
    ],
)
def test_why_a_time_is_wrong(
    model: sm.Model, time: float, why: OfState | None, more: dict[str, Any]
) -> None:
    text = OfState.TIME.filled(expected=2.5, time=time)
    if why is not None:
        text = OfState.TIME_WHY.filled(text=text, why=why.filled(number=1))
    assert judged_state(model, (RIGHT_SLOTS, time), **more) == wrong(text)


@pytest.mark.parametrize(("time", "kind"), [(True, "a bool: True"), ("2.5", "a str: '2.5'")])
def test_a_time_is_a_number(model: sm.Model, time: Any, kind: str) -> None:
    said = judged_state(model, (RIGHT_SLOTS, time))
    assert said == wrong(OfState.TIME_KIND.filled(kind=kind))


# demo_forward.

ANGLE = 0.8  # [rad], what is to be written
TIP = np.array([0.3, 0.1, 1.1])
MOVED = np.array([0.3 * math.cos(ANGLE), 0.1, 1.1 - 0.3 * math.sin(ANGLE)])
READINGS = np.array([np.zeros(3), TIP, TIP, MOVED])
WRITTEN = inputs(qpos=with_entry(REST, (LIFT, ANGLE)))


def tip_at(pan: float, lift: float) -> Array:
    """Return where the fingertip is at two angles [rad]."""
    along, beside = 0.3 * math.cos(lift), 0.1
    turned = [
        along * math.cos(pan) - beside * math.sin(pan),
        along * math.sin(pan) + beside * math.cos(pan),
    ]
    return np.array([*turned, 1.1 - 0.3 * math.sin(lift)])


def judged_forward(
    model: sm.Model, readings: Any, where: str = "", course: Array = READINGS, **more: Any
) -> WorldJudgement:
    """Return what is said of four readings, of a run as it should be where nothing else is said."""
    facts = {
        "memory": (0, 1, 2, 3),
        "live": ("",) * 4,
        "forwards": (inputs(), WRITTEN),
        "ends": (WRITTEN,),
    } | more
    world = ExerciseWorld(where, model, ())
    return forward.judge(
        Answer(readings, **facts), world, forward.right(world), forward.Readings(course, {})
    )


def with_reading(k: int, reading: Array) -> Array:
    """Return the readings that are right, but for one."""
    readings = READINGS.copy()
    readings[k] = reading
    return readings


NAMES = ("1, fresh", "2, after forward", "3, after the write", "4, after the second forward")


def of_reading(k: int, why: str) -> WorldJudgement:
    """Return the verdict on one wrong reading."""
    return wrong(OfForward.READING.filled(reading=NAMES[k], why=why))


def test_the_readings_that_are_right_have_a_closed_form(model: sm.Model) -> None:
    right = forward.right(ExerciseWorld("", model, ()))
    assert right.tip == pytest.approx(READINGS, abs=1e-12)
    camera = [np.zeros(3), *[[0, 0.2, 1.1]] * 3]
    assert right.others["site 'camera'"] == pytest.approx(np.array(camera))


MOVED_BY = f"{2000 * 0.3 * math.sin(ANGLE / 2):.3g} mm"  # a chord


def test_right_readings_pass(model: sm.Model) -> None:
    assert judged_forward(model, READINGS) == verified(OfForward.PASSED.filled(moved=MOVED_BY))


def test_a_command_that_was_written_is_mentioned(model: sm.Model) -> None:
    said = OfForward.PASSED_WITH_COMMAND.filled(moved=MOVED_BY)
    ends = (replace(WRITTEN, ctrl=np.array([0.0, 0.1])),)
    assert judged_forward(model, READINGS, ends=ends) == verified(said)


@pytest.mark.parametrize("k", range(4))
def test_a_reading_may_be_a_nanometre_off(model: sm.Model, k: int) -> None:
    off = np.array([0, -0.9e-9, 0])
    assert judged_forward(model, with_reading(k, READINGS[k] + off)).passed
    assert not judged_forward(model, with_reading(k, READINGS[k] + 1.2 * off)).passed


@pytest.mark.parametrize("off", [0.9e-7, 2e-7])
def test_single_precision_may_be_a_ten_millionth_off(model: sm.Model, off: float) -> None:
    # 1.1 m is 2.4e-8 from the next number in single precision: what is far off is the height.
    readings = with_reading(3, MOVED + np.array([off, 0, 0])).astype(np.float32)
    verdict = judged_forward(model, readings)
    assert verdict.passed == (off < 1e-7)
    if not verdict.passed:
        assert verdict.remarks[0].endswith(OfForward.FEW_DIGITS.filled(remark="", dtype="float32"))


def test_time_that_passed_is_said(model: sm.Model) -> None:
    stepped = run_of(inputs(time=0.25), inputs(time=0.75))
    remark = OfForward.STEPPED.filled(time=0.5)
    assert judged_forward(model, READINGS, runs=(stepped,)) == wrong(remark)


@pytest.mark.parametrize(
    ("reading", "facts", "remark"),
    [
        (np.zeros(3), {"ends": (WRITTEN, inputs(1))}, OfForward.OTHER_DATA),
        (np.zeros(3), {"memory": (0, 0, 0, 0)}, OfForward.READ_ONCE),
        (
            np.zeros(3),
            {"memory": (0, 0, 0, 0), "live": ("site_xpos",) * 4},
            OfForward.OWN_MEMORY,
        ),
        (MOVED, {"memory": (0, 0, 0, 0)}, OfForward.OWN_MEMORY),
        (MOVED, {"live": ("site_xpos",) * 4}, OfForward.OWN_MEMORY),
        (MOVED, {}, OfForward.ONLY_THE_LAST),
    ],
)
def test_why_all_readings_are_equal(
    model: sm.Model, reading: Array, facts: dict[str, Any], remark: OfForward
) -> None:
    place = "[" + " ".join(f"{value:.4f}" for value in reading) + "]"
    verdict = judged_forward(model, np.tile(reading, (4, 1)), **facts)
    assert verdict == wrong(remark.filled(place=place))


def test_millimetres_are_said(model: sm.Model) -> None:
    assert judged_forward(model, 1000 * READINGS) == wrong(OfForward.MILLIMETRES.filled())


def test_the_readings_of_another_site_are_said(model: sm.Model) -> None:
    camera = np.array([np.zeros(3), *[[0, 0.2, 1.1]] * 3])
    said = OfForward.OTHER_PLACE.filled(places="site 'camera'", tip="gripperframe")
    assert judged_forward(model, camera) == wrong(said)


@pytest.mark.parametrize("k", range(4))
def test_a_reading_of_the_courses_scene_is_said(model: sm.Model, k: int) -> None:
    course = READINGS + 0.5
    verdict = judged_forward(model, with_reading(k, course[k]), where="elsewhere", course=course)
    assert verdict == of_reading(k, OfForward.COURSE.filled())


def test_a_reading_that_is_no_number_is_said(model: sm.Model) -> None:
    verdict = judged_forward(model, with_reading(1, TIP * math.nan))
    assert verdict == of_reading(1, OfForward.NO_NUMBER.filled(place="[nan nan nan]"))


def test_a_rounded_reading_is_said(model: sm.Model) -> None:
    reading = np.array([round(value, 3) for value in MOVED.tolist()])
    verdict = judged_forward(model, with_reading(3, reading))
    away = f"{1000 * float(np.linalg.norm(reading - MOVED)):.3g} mm away"
    assert verdict == of_reading(3, OfForward.ROUNDED.filled(away=away))


@pytest.mark.parametrize(
    ("facts", "why"),
    [
        ({"forwards": ()}, OfForward.NEVER_FORWARD),
        ({"ends": (WRITTEN, inputs(1))}, OfForward.SEVERAL_DATA),
        ({}, OfForward.BEFORE_FORWARD),
    ],
)
@pytest.mark.parametrize("k", [1, 2])
def test_why_a_reading_is_at_the_origin(
    model: sm.Model, k: int, facts: dict[str, Any], why: OfForward
) -> None:
    verdict = judged_forward(model, with_reading(k, np.zeros(3)), **facts)
    assert verdict == of_reading(k, why.filled(away="1140 mm away", count=2))


def test_one_reading_of_another_place_is_said(model: sm.Model) -> None:
    verdict = judged_forward(model, with_reading(2, np.array([0.0, 0.2, 1.1])))
    why = OfForward.OTHER_PLACE_AWAY.filled(
        places="site 'camera'", tip="gripperframe", away="316 mm away"
    )
    assert verdict == of_reading(2, why)


CHORD = f"{MOVED_BY} away"


@pytest.mark.parametrize(
    ("k", "forwards", "why"),
    [
        (1, (WRITTEN,), OfForward.WRITTEN_EARLY),
        (1, (inputs(), WRITTEN), OfForward.FORWARD_EARLY),
        (2, (inputs(), WRITTEN), OfForward.FORWARD_EARLY),
        (2, (inputs(qpos=with_entry(REST, (PAN, ANGLE))), WRITTEN), OfForward.FORWARD_EARLY),
    ],
)
def test_the_new_pose_came_too_early(
    model: sm.Model, k: int, forwards: Sequence[Inputs], why: OfForward
) -> None:
    verdict = judged_forward(model, with_reading(k, MOVED), forwards=tuple(forwards))
    assert verdict == of_reading(k, why.filled(away=CHORD))


def test_a_first_reading_that_is_not_fresh_is_said(model: sm.Model) -> None:
    verdict = judged_forward(model, with_reading(0, TIP))
    assert verdict == of_reading(0, OfForward.NOT_FRESH.filled(away="1140 mm away"))


OTHER = 0.3  # [rad]


@pytest.mark.parametrize(
    ("angle", "text"), [(math.radians(ANGLE), "0.8 degrees"), (OTHER, "0.3 rad")]
)
def test_another_angle_is_said(model: sm.Model, angle: float, text: str) -> None:
    met = inputs(qpos=with_entry(REST, (LIFT, angle)))
    reading = tip_at(0, angle)
    away = f"{2000 * 0.3 * math.sin((ANGLE - angle) / 2):.3g} mm away"
    verdict = judged_forward(model, with_reading(3, reading), forwards=(inputs(), met))
    why = OfForward.OTHER_ANGLE.filled(angle=text, away=away, expected=ANGLE)
    assert verdict == of_reading(3, why)


@pytest.mark.parametrize(
    ("lift", "why"), [(ANGLE, OfForward.ONE_MORE_ENTRY), (0.0, OfForward.OTHER_ENTRY)]
)
def test_another_entry_is_said(model: sm.Model, lift: float, why: OfForward) -> None:
    met = inputs(qpos=with_entry(REST, (PAN, OTHER), (LIFT, lift)))
    reading = tip_at(OTHER, lift)
    away = f"{1000 * float(np.linalg.norm(reading - MOVED)):.3g} mm away"
    verdict = judged_forward(model, with_reading(3, reading), forwards=(inputs(), met))
    slots = {"entry": PAN, "owner": "pan", "joint": "shoulder_lift", "place": LIFT}
    assert verdict == of_reading(3, why.filled(away=away, **slots))


@pytest.mark.parametrize(
    ("forwards", "ends", "why", "entry"),
    [
        ((inputs(), WRITTEN), (WRITTEN,), OfForward.SECOND_FORWARD_LATE, 0),
        ((inputs(), inputs()), (WRITTEN,), OfForward.NO_SECOND_FORWARD, 0),
        ((inputs(),), (inputs(),), OfForward.NOTHING_WRITTEN, 0),
        (
            (inputs(),),
            (inputs(ctrl=np.array([0, 0.5])),),
            OfForward.WROTE_CTRL,
            1,
        ),
        ((inputs(),), (inputs(qvel=with_entry(NO_SPEED, (7, 0.5))),), OfForward.WROTE_QVEL, 7),
        (
            (inputs(),),
            (inputs(qvel=with_entry(NO_SPEED, (7, 0.5)), ctrl=np.array([0.5, 0])),),
            OfForward.WROTE_CTRL,
            0,
        ),
        (
            (inputs(),),
            (inputs(qpos=with_entry(REST, (BOX_HEIGHT, 0.8)), ctrl=np.array([0.5, 0])),),
            OfForward.WROTE_QPOS,
            2,
        ),
    ],
)
def test_why_the_last_reading_is_the_old_pose(
    model: sm.Model,
    forwards: tuple[Inputs, ...],
    ends: tuple[Inputs, ...],
    why: OfForward,
    entry: int,
) -> None:
    verdict = judged_forward(model, with_reading(3, TIP), forwards=forwards, ends=ends)
    slots = {"entry": entry, "owner": "crate", "joint": "shoulder_lift", "place": LIFT}
    assert verdict == of_reading(3, why.filled(away=CHORD, angle=ANGLE, **slots))


def test_a_reading_that_nothing_explains_is_said_in_figures(model: sm.Model) -> None:
    off = np.array([0.003, 0.004, 1 / 3e8])
    verdict = judged_forward(model, with_reading(1, TIP + off))
    why = OfForward.FIGURES.filled(
        value="[0.3030 0.1040 1.1000]", expected="[0.3000 0.1000 1.1000]", away="5 mm away"
    )
    assert verdict == of_reading(1, why)


# demo_gravity.


@pytest.fixture(scope="module")
def fall_world(model: sm.Model) -> ExerciseWorld[tuple[int]]:
    """Three seconds of the arm that falls."""
    return ExerciseWorld("", model, (3,))


@pytest.fixture(scope="module")
def falls(fall_world: ExerciseWorld[tuple[int]]) -> gravity.Falls:
    """The falls that are right there."""
    return gravity.right(fall_world)


def runs_of(falls: gravity.Falls, steps: int = 300) -> tuple[EngineRun, EngineRun]:
    """Return the runs of both falls."""
    first, second = (
        run_of(inputs(k), inputs(k, qpos=np.radians(falls.angles[k, steps])), steps)
        for k in range(2)
    )
    return first, second


def judged_gravity(
    world: ExerciseWorld[tuple[int]], falls: gravity.Falls, traces: Any, **more: Any
) -> tuple[str, ...]:
    """Return what is said of two traces, of runs as they should be where nothing else is said."""
    runs = runs_of(falls)
    facts = {"runs": runs, "ends": tuple(run.end for run in runs)} | more
    verdict = gravity.judge(Answer(traces, **facts), world, falls, falls)
    assert verdict.passed == verdict.remarks[0].startswith("shoulder_lift after 3 s")
    return verdict.remarks


def test_the_falls_go_a_second_on(falls: gravity.Falls) -> None:
    assert falls.angles.shape == (2, 401, 9)
    assert falls.marks.tolist() == [0, 100, 200, 300]
    assert falls.time[[0, 100, 400]] == pytest.approx([0, 1, 4])
    assert falls.place == LIFT
    assert falls.degrees.tolist() == falls.angles[:, ::100, LIFT][:, :4].tolist()


def test_the_servo_holds_and_without_it_the_arm_swings(falls: gravity.Falls) -> None:
    # At rest kp q = m g l cos q.
    assert 3 * math.radians(falls.degrees[0, 3]) == pytest.approx(
        0.5 * 9.81 * 0.15 * math.cos(math.radians(falls.degrees[0, 3])), rel=1e-3
    )
    assert abs(falls.degrees[1, 1:]).max() > 45


@pytest.mark.parametrize("off", [0.0, 0.0059, -0.0059])
def test_two_decimals_of_degrees_will_do(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls, off: float
) -> None:
    on, without = falls.degrees[0, 3], falls.degrees[1, 3]
    passed = OfGravity.PASSED.filled(joint="shoulder_lift", seconds=3, on=on, off=without)
    assert judged_gravity(fall_world, falls, tuple(falls.degrees + off)) == (passed,)


@pytest.mark.parametrize("limp", [0, 1])
def test_more_than_two_decimals_off_is_wrong(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls, limp: int
) -> None:
    traces = falls.degrees.copy()
    traces[limp, 2] -= 0.0061
    (remark,) = judged_gravity(fall_world, falls, tuple(traces))
    assert f" at 2 s where {falls.degrees[limp, 2]:.4g}"[:16] in remark
    assert remark.startswith(("servos on", "servos off")[limp])


NAMES_OF_FALLS = ("servos on", "servos off")


def of_fall(falls: gravity.Falls, limp: int, trace: Array, mistake: str) -> str:
    """Return what is said of a wrong trace: its farthest number, and the mistake."""
    right = falls.degrees[limp]
    k = int(np.argmax(abs(trace - right)))
    value, expected = f"{trace[k] + 0.0:.4g}", f"{right[k]:.4g}"
    figures = OfGravity.FIGURES.filled(
        trace=NAMES_OF_FALLS[limp], value=value, second=k, expected=expected
    )
    return OfGravity.MISTAKE.filled(figures=figures, mistake=mistake)


@pytest.mark.parametrize("limp", [0, 1])
def test_why_a_trace_is_wrong(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls, limp: int
) -> None:
    right, other = falls.degrees[limp], falls.degrees[1 - limp]
    servos = (OfGravity.SERVOS_OFF, OfGravity.SERVOS_ON)[limp].filled()
    late = falls.angles[limp, falls.marks + 2, LIFT]
    early = falls.angles[limp, [0, 97, 197, 297], LIFT]
    mistakes = [
        (np.radians(right), OfGravity.RADIANS.filled()),
        (np.radians(np.radians(right)), OfGravity.RADIANS_AGAIN.filled()),
        (np.degrees(right), OfGravity.DEGREES_TWICE.filled()),
        (falls.speed[limp, falls.marks], OfGravity.SPEED.filled()),
        (np.degrees(falls.speed[limp, falls.marks]), OfGravity.SPEED.filled()),
        (other, servos),
        (np.radians(other), OfGravity.AND_RADIANS.filled(servos=servos)),
        (np.full(4, right[3]), OfGravity.LAST_NUMBER.filled()),
    ]
    if limp:  # with servos it is at rest
        mistakes += [
            (late, OfGravity.LATE.filled(shift=0.02)),
            (early, OfGravity.EARLY.filled(shift=0.03)),
        ]
    for trace, mistake in mistakes:
        traces = falls.degrees.copy()
        traces[limp] = trace
        runs = tuple(replace(run, nstep=302) for run in runs_of(falls))
        remarks = judged_gravity(fall_world, falls, tuple(traces), runs=runs)
        assert remarks == (of_fall(falls, limp, trace, mistake),)


def test_other_steps_a_second_are_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    traces = falls.degrees.copy()
    traces[1] = falls.angles[1, [0, 50, 100, 150], LIFT]
    runs = (runs_of(falls)[0], replace(runs_of(falls)[1], nstep=150))
    said = OfGravity.STEPS_A_SECOND.filled(steps="50 steps", timestep=10.0, needed=100)
    remarks = judged_gravity(fall_world, falls, tuple(traces), runs=runs)
    assert remarks == (of_fall(falls, 1, traces[1], said),)


def test_another_joint_is_said(fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls) -> None:
    traces = falls.degrees.copy()
    traces[0] = falls.angles[0, falls.marks, BOX_HEIGHT]
    said = OfGravity.OTHER_JOINT.filled(
        entry=BOX_HEIGHT, owner="crate", joint="shoulder_lift", place=LIFT
    )
    remarks = judged_gravity(fall_world, falls, tuple(traces))
    assert remarks == (of_fall(falls, 0, traces[0], said),)


def test_swapped_traces_are_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    remarks = judged_gravity(fall_world, falls, tuple(falls.degrees[::-1]))
    assert remarks == (OfGravity.SWAPPED.filled(),)


def test_the_courses_scene_is_told(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    course = replace(falls, degrees=np.column_stack([falls.degrees + 7, [0, 0]]))
    elsewhere = replace(fall_world, where="elsewhere")
    traces = tuple((falls.degrees + 7).copy())
    runs = runs_of(falls)
    for on_given, remark in ((True, OfGravity.COURSE), (False, OfGravity.COURSE_LOADED)):
        run_here = tuple(replace(run, on_given_model=on_given) for run in runs)
        verdict = gravity.judge(Answer(traces, runs=run_here), elsewhere, falls, course)
        assert verdict.remarks == tuple(
            of_fall(falls, limp, traces[limp], remark.filled()) for limp in range(2)
        )


@pytest.mark.parametrize(
    ("steps", "is_short"), [((300, 300), False), ((299, 300), True), ((600, 1), True)]
)
def test_both_runs_must_be_long_enough(
    fall_world: ExerciseWorld[tuple[int]],
    falls: gravity.Falls,
    steps: tuple[int, int],
    is_short: bool,
) -> None:
    runs = tuple(
        replace(run, nstep=count) for run, count in zip(runs_of(falls), steps, strict=True)
    )
    remarks = judged_gravity(fall_world, falls, tuple(falls.degrees), runs=runs)
    words = ", ".join("1 step" if count == 1 else f"{count} steps" for count in steps)
    said = OfGravity.SHORT_RUNS.filled(steps=words, seconds=3, needed=300, timestep=0.01)
    assert (remarks == (said,)) == is_short


def test_figures_without_any_run_are_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    remarks = judged_gravity(fall_world, falls, tuple(falls.degrees), runs=())
    assert remarks == (OfGravity.NO_STEP.filled(),)


def test_a_command_in_a_run_is_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    first, second = runs_of(falls)
    commanded = replace(first, start=inputs(ctrl=np.array([0, 0.25])))
    said = OfGravity.COMMAND.filled(entry=1, actuator="shoulder_lift", value=0.25)
    assert judged_gravity(fall_world, falls, tuple(falls.degrees), runs=(commanded, second)) == (
        said,
    )


def test_a_command_during_a_run_is_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    first, second = runs_of(falls)
    changed = replace(second, ctrl_changed=5)
    left = (first.end, replace(second.end, ctrl=np.array([-0.5, 0.0])))
    said = OfGravity.COMMAND.filled(entry=0, actuator="pan", value=-0.5)
    facts: dict[str, Any] = {"runs": (first, changed), "ends": left}
    assert judged_gravity(fall_world, falls, tuple(falls.degrees), **facts) == (said,)
    facts["ends"] = (first.end, second.end)
    said = OfGravity.COMMAND_BETWEEN.filled()
    assert judged_gravity(fall_world, falls, tuple(falls.degrees), **facts) == (said,)


@pytest.mark.parametrize(
    ("changed", "remark"),
    [
        ({"opt.disableflags": ([0.0], [32.0])}, OfGravity.FLAG_LEFT.filled(before=0, now=32)),
        ({"opt.gravity": ([0.0], [1.0])}, OfGravity.MODEL_CHANGED.filled(name="opt.gravity")),
    ],
)
def test_a_changed_model_is_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls, changed: Any, remark: str
) -> None:
    assert judged_gravity(fall_world, falls, tuple(falls.degrees), changed=changed) == (remark,)


def test_a_run_that_goes_on_is_said(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls
) -> None:
    traces = falls.degrees.copy()
    traces[1] = traces[0, 3] + np.array([0, 1, 2, 9])
    first, second = runs_of(falls)
    runs = (first, replace(second, start=first.end))
    said = OfGravity.GOES_ON.filled(start=traces[0, 3])
    remarks = judged_gravity(fall_world, falls, tuple(traces), runs=runs)
    assert remarks == (of_fall(falls, 1, traces[1], said),)


@pytest.mark.parametrize(("still", "remark"), [(True, OfGravity.STILL), (False, OfGravity.ZEROS)])
def test_why_a_trace_is_zero(
    fall_world: ExerciseWorld[tuple[int]],
    falls: gravity.Falls,
    still: bool,
    remark: OfGravity,
) -> None:
    first, second = runs_of(falls)
    if still:
        second = replace(second, end=second.start)
    traces = falls.degrees.copy()
    traces[1] = 0
    remarks = judged_gravity(fall_world, falls, tuple(traces), runs=(first, second))
    said = of_fall(falls, 1, traces[1], remark.filled(joint="shoulder_lift"))
    assert remarks == (said,)


@pytest.mark.parametrize(
    ("result", "fault"),
    [
        (
            [[0.0, 1.0]] * 4,
            OfGravity.PAIRS.filled(kind="a list of 4"),
        ),
        (
            ([[0.0] * 9] * 4, [0.0] * 4),
            OfGravity.ONE_NUMBER.filled(trace="servos on", columns=9, joint="shoulder_lift"),
        ),
        (
            ([0.0] * 4, [0.0] * 5),
            OfGravity.LENGTH.filled(trace="servos off", length=5, needed=4, seconds=3),
        ),
        (
            ([0.0] * 3, [0.0] * 4),
            OfGravity.LENGTH.filled(trace="servos on", length=3, needed=4, seconds=3),
        ),
    ],
)
def test_traces_of_another_shape_are_refused(
    fall_world: ExerciseWorld[tuple[int]], falls: gravity.Falls, result: Any, fault: str
) -> None:
    with pytest.raises(FaultError) as caught:
        judged_gravity(fall_world, falls, result)
    assert str(caught.value) == fault


# demo_replay.

CTRL, NSTEP = np.array([0.5, -0.25]), 40
KEYFRAME = inputs(qpos=AT_KEYFRAME, ctrl=np.array([0.3, 0.4]), time=2.5)
AT_START = replace(KEYFRAME, ctrl=CTRL, time=0.0)


@pytest.fixture(scope="module")
def replay_world(model: sm.Model) -> ExerciseWorld[tuple[Array, int]]:
    """Forty steps under a command."""
    return ExerciseWorld("", model, (CTRL, NSTEP))


@pytest.fixture(scope="module")
def ends(replay_world: ExerciseWorld[tuple[Array, int]]) -> replay.TwoRuns:
    """What both runs end in."""
    return replay.right(replay_world)


def replayed(start: Inputs, end: Array, nstep: int = NSTEP, **more: Any) -> EngineRun:
    """Return a run that ends in qpos (nq,)."""
    return run_of(start, replace(start, qpos=end, time=nstep * 0.01), nstep, **more)


def judged_replay(
    world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    result: Any = None,
    runs: tuple[EngineRun, ...] | None = None,
    **more: Any,
) -> tuple[str, ...]:
    """Return what is said of two runs, as they should be where nothing else is said."""
    if runs is None:
        runs = replayed(AT_START, ends.ends[0]), replayed(AT_START, ends.ends[1])
    if result is None:
        result = (True, ends.ends[0], ends.ends[1])
    facts = {"memory": (0, 1, 2), "live": ("",) * 3} | more
    verdict = replay.judge(Answer(result, runs=runs, **facts), world, ends, ends)
    assert verdict.passed == (verdict.remarks[0] == OfReplay.PASSED.filled(nstep=NSTEP))
    return verdict.remarks


def test_the_runs_begin_at_the_keyframe_and_end_equal(
    ends: replay.TwoRuns, replay_world: ExerciseWorld[tuple[Array, int]]
) -> None:
    assert ends.start.qpos.tolist() == AT_KEYFRAME.tolist()
    assert (ends.start.time, ends.start.ctrl.tolist()) == (2.5, [0.3, 0.4])
    assert same_bits(*ends.ends)
    assert judged_replay(replay_world, ends) == (OfReplay.PASSED.filled(nstep=NSTEP),)


def test_a_nudge_sets_the_ends_apart(replay_world: ExerciseWorld[tuple[Array, int]]) -> None:
    nudge = Nudge(PAN, math.inf, NSTEP, by=0.125)
    first, second = replay.right(replace(replay_world, nudge=nudge)).ends
    assert np.flatnonzero(first != second).tolist() == [PAN]
    assert second[PAN] == np.nextafter(first[PAN] + 0.125, math.inf)


STEPPED_AWAY = with_entry(AT_KEYFRAME, (PAN, 0.35))


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"nstep": 41}, OfReplay.STEPS.filled(steps="41 steps", nstep=NSTEP)),
        ({"ctrl_changed": 7}, OfReplay.CTRL_CHANGED.filled(step=7)),
        (
            {"start": replace(AT_START, qpos=STEPPED_AWAY)},
            OfReplay.ELSEWHERE.filled(array="qpos", gap=0.25),
        ),
        (
            {"start": replace(AT_START, qvel=with_entry(NO_SPEED, (3, -0.5)))},
            OfReplay.ELSEWHERE.filled(array="qvel", gap=0.5),
        ),
        ({"start": replace(AT_START, time=2.5)}, OfReplay.KEYFRAMES_TIME.filled(time=2.5)),
        ({"start": replace(AT_START, time=0.01)}, OfReplay.TIME.filled(time=0.01)),
        (
            {"start": replace(AT_START, qpos=with_entry(AT_KEYFRAME, (PAN, 0.5), (LIFT, -0.25)))},
            OfReplay.COMMAND_IN_QPOS.filled(),
        ),
        ({"start": replace(AT_START, ctrl=KEYFRAME.ctrl)}, OfReplay.CTRL_NOT_WRITTEN.filled()),
        (
            {"start": replace(AT_START, ctrl=KEYFRAME.ctrl), "ctrl_changed": 1},
            OfReplay.CTRL_LATE_KEYFRAMES.filled(ctrl="[0.3 0.4]", steps="1 step"),
        ),
        (
            {"start": replace(AT_START, ctrl=np.zeros(2)), "ctrl_changed": 2},
            OfReplay.CTRL_LATE.filled(ctrl="[0 0]", steps="2 steps"),
        ),
        (
            {"start": replace(AT_START, ctrl=KEYFRAME.ctrl + CTRL)},
            OfReplay.CTRL_ADDED.filled(),
        ),
        (
            {"start": replace(AT_START, ctrl=np.degrees(CTRL))},
            OfReplay.CTRL_DEGREES.filled(ctrl="[28.65 -14.32]"),
        ),
        (
            {"start": replace(AT_START, ctrl=np.radians(CTRL))},
            OfReplay.CTRL_RADIANS.filled(ctrl="[0.008727 -0.004363]"),
        ),
        (
            {"start": replace(AT_START, ctrl=np.array([0.5, 0.125]))},
            OfReplay.CTRL_ENTRY.filled(
                entry=1, actuator="shoulder_lift", value=0.125, expected=-0.25
            ),
        ),
        (
            {"start": replace(AT_START, ctrl=np.array([1.0, 2.0]))},
            OfReplay.CTRL_OTHER.filled(ctrl="[1 2]", expected="[0.5 -0.25]"),
        ),
    ],
)
@pytest.mark.parametrize("which", [0, 1])
def test_what_is_wrong_with_a_run(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    which: int,
    changes: dict[str, Any],
    fault: str,
) -> None:
    runs = [replayed(AT_START, end) for end in ends.ends]
    runs[which] = replace(runs[which], **changes)
    remarks = judged_replay(replay_world, ends, runs=(runs[0], runs[1]))
    assert remarks == (OfReplay.RUN.filled(which=("first", "second")[which], fault=fault),)


def test_what_both_runs_do_wrong_is_said_once(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns
) -> None:
    first, second = (replayed(AT_START, end, 41) for end in ends.ends)
    second = replace(second, start=replace(AT_START, time=1.0))
    remarks = judged_replay(replay_world, ends, runs=(first, second))
    steps = OfReplay.STEPS.filled(steps="41 steps", nstep=NSTEP)
    assert remarks == (
        OfReplay.RUN.filled(which="first", fault=steps),
        OfReplay.RUN.filled(which="second", fault=OfReplay.TIME.filled(time=1.0)),
    )


@pytest.mark.parametrize("off", [0.9e-9, 1.1e-9])
def test_a_start_may_be_a_billionth_off(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns, off: float
) -> None:
    near_start = replace(AT_START, qvel=with_entry(NO_SPEED, (2, -off)))
    runs = (replayed(near_start, ends.ends[0]), replayed(AT_START, ends.ends[1]))
    passed = OfReplay.PASSED.filled(nstep=NSTEP)
    assert (judged_replay(replay_world, ends, runs=runs) == (passed,)) == (off < 1e-9)


@pytest.mark.parametrize(
    ("steps", "fault"),
    [
        ((), OfReplay.NO_STEP.filled(nstep=NSTEP)),
        ((80,), OfReplay.NO_RESET_BETWEEN.filled(steps=80)),
        ((79,), OfReplay.ONE_RUN.filled()),
        ((40, 40, 40), OfReplay.MANY_RUNS.filled(runs=3, steps="40, 40, 40")),
        ((1, 2, 3, 4, 5, 6), OfReplay.MANY_RUNS.filled(runs=6, steps="1, 2, 3, 4, 5, 6")),
        ((1, 2, 3, 4, 5, 6, 7), OfReplay.MANY_RUNS.filled(runs=7, steps="1, 2, 3, 4, 5, 6, …")),
    ],
)
def test_another_number_of_runs_is_said(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    steps: tuple[int, ...],
    fault: str,
) -> None:
    runs = tuple(replayed(AT_START, ends.ends[0], count) for count in steps)
    assert judged_replay(replay_world, ends, runs=runs) == (fault,)


def test_forward_takes_no_step(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns
) -> None:
    said = OfReplay.FORWARD_FOR_STEP.filled(nstep=NSTEP)
    assert judged_replay(replay_world, ends, runs=(), forwards=(AT_START,)) == (said,)


def test_runs_of_another_model_are_said(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns
) -> None:
    runs = tuple(replayed(AT_START, end, on_given_model=False) for end in ends.ends)
    assert judged_replay(replay_world, ends, runs=runs) == (OfReplay.OTHER_MODEL.filled(),)


@pytest.mark.parametrize(
    ("facts", "fault"),
    [
        ({"live": ("", "qpos", "")}, OfReplay.LIVE.filled(which="first", live="qpos")),
        ({"live": ("", "", "qvel")}, OfReplay.LIVE.filled(which="second", live="qvel")),
        ({"live": ("", "qpos", "qpos"), "memory": (0, 1, 1)}, OfReplay.ONE_ARRAY_LIVE.filled()),
        ({"memory": (0, 1, 1)}, OfReplay.ONE_ARRAY.filled()),
    ],
)
def test_whose_memory_was_returned(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    facts: dict[str, Any],
    fault: str,
) -> None:
    assert judged_replay(replay_world, ends, **facts) == (fault,)


END = np.full(9, 1.5)


@pytest.mark.parametrize(
    ("result", "fault"),
    [
        ((END, True, END), OfReplay.ORDER.filled(place=2)),
        ((END, END, True), OfReplay.ORDER.filled(place=3)),
        ((1, END, END), OfReplay.SAME_KIND),
        ((np.ones(9, bool), END, END), OfReplay.SAME_ELEMENTS),
        ((True, END.astype(np.float32), END), OfReplay.FEW_DIGITS),
    ],
)
def test_a_result_of_another_kind_is_said(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    result: Any,
    fault: str,
) -> None:
    (remark, *_) = judged_replay(replay_world, ends, result)
    beginning, _, rest = str(fault).partition("{")
    assert remark.startswith(beginning)
    assert remark.endswith(rest.rpartition("}")[2])


@pytest.mark.parametrize(
    ("apart", "same", "remark"),
    [
        (0.0, False, OfReplay.DIFFERENT),
        (0.9e-3, True, OfReplay.NEARLY),
        (1.1e-3, True, OfReplay.ALWAYS_TRUE),
    ],
)
def test_a_wrong_comparison_is_said(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    apart: float,
    same: bool,
    remark: OfReplay,
) -> None:
    second = ends.ends[0].copy()
    second[PAN] -= apart
    set_apart = replace(ends, ends=(ends.ends[0], second))
    world = replace(replay_world, nudge=Nudge(PAN, math.inf, NSTEP))
    gap = float(abs(second - ends.ends[0]).max())
    remarks = judged_replay(world, set_apart, (same, ends.ends[0], second))
    assert remarks == (remark.filled(apart=gap),)


def test_what_was_left_over_is_said(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns
) -> None:
    second = ends.ends[1].copy()
    second[PAN] += 0.25
    runs = (replayed(AT_START, ends.ends[0]), replayed(AT_START, second))
    remarks = judged_replay(replay_world, ends, (False, ends.ends[0], second), runs)
    assert remarks == (OfReplay.LEFT_OVER.filled(apart=0.25),)


@pytest.mark.parametrize("off", [0.9e-6, 1.1e-6])
def test_a_run_ends_where_this_arm_ends(
    replay_world: ExerciseWorld[tuple[Array, int]], ends: replay.TwoRuns, off: float
) -> None:
    end = ends.ends[0].copy()
    end[PAN] += off
    runs = (replayed(AT_START, end), replayed(AT_START, end))
    remarks = judged_replay(replay_world, ends, (True, end, end.copy()), runs)
    fault = OfReplay.OTHER_END.filled(steps="40 steps")
    said = OfReplay.RUN.filled(which="first", fault=fault)
    assert (remarks == (said,)) == (off > 1e-6)


@pytest.mark.parametrize(
    ("which", "change", "why"),
    [
        (0, "start", OfReplay.AT_START),
        (1, "start", OfReplay.AT_START),
        (0, "rounded", OfReplay.ROUNDED),
        (1, 0.9e-3, OfReplay.ROUNDED_OR_EARLY),
        (1, 1.1e-3, OfReplay.READ_AT_END),
        (0, 0.25, OfReplay.READ_AT_END),
    ],
)
def test_why_a_returned_end_is_wrong(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    which: int,
    change: str | float,
    why: OfReplay,
) -> None:
    right = ends.ends[which]
    if change == "start":
        returned = AT_KEYFRAME.copy()
    elif change == "rounded":
        returned = np.round(right, 6)
    else:
        returned = right + np.array([0] * 8 + [float(change)])
    copies = [*ends.ends]
    copies[which] = returned
    away = float(abs(returned - right).max())
    remarks = judged_replay(replay_world, ends, (True, *copies))
    said = OfReplay.END.filled(which=("first", "second")[which], away=away, why=why.filled())
    assert remarks == (said,)


@pytest.mark.parametrize(
    ("which", "other", "why"), [(1, 0, OfReplay.FIRST_TWICE), (0, 1, OfReplay.SECOND_END)]
)
def test_the_end_of_the_other_run_is_said(
    replay_world: ExerciseWorld[tuple[Array, int]],
    ends: replay.TwoRuns,
    which: int,
    other: int,
    why: OfReplay,
) -> None:
    second = with_entry(ends.ends[0], (PAN, 2.0))
    set_apart = replace(ends, ends=(ends.ends[0], second))
    world = replace(replay_world, nudge=Nudge(PAN, math.inf, NSTEP))
    copies = [*set_apart.ends]
    copies[which] = copies[other]
    away = float(abs(second - ends.ends[0]).max())
    remarks = judged_replay(world, set_apart, (False, *copies))
    said = OfReplay.END.filled(which=("first", "second")[which], away=away, why=why.filled())
    assert remarks == (said,)
