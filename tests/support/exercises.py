"""What students typically write: the solution with something changed, wrongly or in another way.

Of each wrong one it is written what must be said of it, which is said of no other.
"""

from __future__ import annotations

import linecache
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .requirements import ROOT

TEMPLATE = ROOT / "exercises" / "step_loop.py"
SOLUTION = ROOT / "teaching" / "solutions" / "step_loop.py"
_IMPORTS, *_FUNCTIONS, _ = re.split(r"^(?=def demo_|if )", SOLUTION.read_text("utf-8"), flags=re.M)
_NAMES: list[str] = ["gravity", "state", "forward", "replay"]
_SOURCES = dict(zip(_NAMES, _FUNCTIONS, strict=True))

Changes = dict[str, str]  # what stands in the solution, and what was written instead

# Of gravity.
BOTH = "return fall(model), fall(model.replace(actuation=False))"
STEP = "sm.step(model, data, round(1 / model.timestep))"
ANGLE = "math.degrees(data.qpos[place])"
OWN_DATA = "        data = sm.make_data(model)\n"
LIFT = 'model.jnt_qposadr[model.joint_id("shoulder_lift")]'
SERVOS = "model.raw.opt.disableflags {} int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)"
OFF, ON = SERVOS.format("|="), SERVOS.format("&= ~")
OWN_SCENE = 'model = sm.load("so101/scene", backend=model.backend)\n    '
# Of forward: r reads, f recomputes, w writes.
ACTS = {
    "r": "tips.append(data.site_xpos[tip].copy())",
    "f": "sm.forward(model, data)",
    "w": f"data.qpos[{LIFT}] = 0.8",
}
SITE = 'model.site_id("gripperframe")'
# Of state and of replay.
SLOTS = "return slots, data.time"
RESET = "        sm.reset(model, data, keyframe=0)\n"
ZERO = "        data.time = 0.0\n"
COMMAND = "data.ctrl[:] = ctrl"
TWICE = "first, second = once(), once()"
EQUAL = "np.array_equal(first, second), first, second"
RUN = "sm.step(model, data, nstep)"


def _ordered(acts: str) -> Changes:
    """Put the acts of forward into another order."""
    _, _, rest = _SOURCES["forward"].partition("    tips = [")
    body, _, _ = rest.partition("    return")
    lines = "".join(f"    {ACTS[act]}\n" for act in acts)
    return {f"    tips = [{body}": f"    tips = []\n{lines}"}


def _outside(*moved: str) -> Changes:
    """Replay with one Data for both runs; what else is done once and not for each."""
    before = "".join(line.replace("        ", "    ", 1) for line in (OWN_DATA, *moved))
    return dict.fromkeys((OWN_DATA, *moved), "") | {"    def once": f"{before}\n    def once"}


WRONG_ONES: dict[str, dict[str, tuple[str, Changes]]] = {
    "gravity": {
        "address_by_name": (
            "model.jnt_qposadr takes a number in brackets, not a name: write model.jnt_qposadr[mod",
            {LIFT: 'model.jnt_qposadr["shoulder_lift"]'},
        ),
        "servos_follow_the_arm": (
            "you wrote ctrl[0] (shoulder_pan), which was -",
            {STEP: f"data.ctrl[:] = data.qpos[:6] - 0.1\n            {STEP}"},
        ),
        "a_pair_for_each_second": (
            "a list of 5, with a pair for each second: return two lists",
            {BOTH: BOTH.replace("return ", "return list(zip(") + "))"},
        ),
        "views_kept": (
            "all of them are the number at the end: you kept a view",
            {
                ANGLE: "data.qpos[place:place + 1]",
                "return angles": "return np.degrees(angles).ravel()",
            },
        ),
        "radians_again": (
            "np.radians was called on what is in radians already",
            {ANGLE: "math.radians(data.qpos[place])"},
        ),
        "seconds_typed_in": (
            "servos on: you return 5 numbers; 4 are needed, one at each of 0 … 3 s, where 3 is the",
            {"range(seconds)": "range(4)"},
        ),
        "all_joints": (
            "servos on: you return 6 numbers for each second; one is needed",
            {ANGLE: "np.degrees(data.qpos)"},
        ),
        "options_of_mujoco": (
            "a Model has no attribute 'opt': write model.replace(",
            {BOTH: f"model.opt.disableflags |= 1\n    {BOTH}"},
        ),
        "option_assigned": (
            "a Model never changes: model.replace(actuation=…) gives another Model",
            {BOTH: f"model.actuation = False\n    {BOTH}"},
        ),
        "verb_of_the_data": (
            "a Data has no attribute 'step': write sm.step(model, data)",
            {STEP: "data.step()"},
        ),
        "steps_in_a_range": (
            "a whole number is needed where there is a float: round(…) makes one",
            {STEP: "for _ in range(1 / model.timestep):\n                sm.step(model, data)"},
        ),
        "replace_thrown_away": (
            "the servos were still on in this run",
            {BOTH: "model.replace(actuation=False)\n    return fall(model), fall(model)"},
        ),
        "the_same_data_again, raw": (
            "this run goes on where the other one ended",
            {
                OWN_DATA: "",
                BOTH: f"import mujoco\n\n    data = sm.make_data(model)\n    on = fall(model)\n"
                f"    {OFF}\n    off = fall(model)\n    {ON}\n    return on, off",
            },
        ),
        "flag_left_switched_off, raw": (
            "the model was given back with its servos off",
            {BOTH: f"import mujoco\n\n    on = fall(model)\n    {OFF}\n    return on, fall(model)"},
        ),
        "flag_before_both, raw": (
            "the servos were off already in this run",
            {
                BOTH: f"import mujoco\n\n    {OFF}\n    falls = fall(model), fall(model)\n"
                f"    {ON}\n    return falls"
            },
        ),
        "gravity_left_changed, raw": (
            "another model.raw.opt.gravity",
            {
                BOTH: f"{BOTH.replace('return', 'falls =')}\n"
                "    model.raw.opt.gravity[2] = 0\n    return falls"
            },
        ),
        "printed_only": ("return` hands it over", {BOTH: f"{BOTH.replace('return ', 'print(')})"}),
        "data_of_the_other_model": (
            "ForeignDataError",
            {
                OWN_DATA: "",
                BOTH: f"data = sm.make_data(model)\n    {BOTH}",
            },
        ),
        "nothing_read_from_the_runs": (
            "Are they its speed, qvel, or another joint? shoulder_lift is at qpos[",
            {"return angles": "return [0.0] * (seconds + 1)"},
        ),
        "printed_constants": (
            "that belongs to the course's own scene: ",
            {BOTH: OWN_SCENE + BOTH},
        ),
        "loads_its_own": (
            "your function steps a model of its own",
            {BOTH: OWN_SCENE + BOTH},
        ),
        "read_after_a_step_too_many": (
            "that is the arm 0.004 s later",
            {"for _ in": "sm.step(model, data)\n        for _ in"},
        ),
        "stepped_by_the_clock": (
            "you took 201 steps from 1 s to 2 s, where a second has 200. After 400 steps data.time",
            {
                "for _ in range(seconds)": "for second in range(1, seconds + 1)",
                STEP: "while data.time < second:\n                sm.step(model, data)",
            },
        ),
        "every_step": (
            "servos on: you return 801 numbers; 5 are needed, one at each of 0 … 4 s",
            {
                STEP: "sm.step(model, data)",
                "range(seconds)": "range(seconds * round(1 / model.timestep))",
            },
        ),
        "no_numbers": (
            "you return nan at 1 s",
            {BOTH: "return ([0.0] + [math.nan] * seconds,) * 2"},
        ),
        "speed_for_position": (
            "that is the speed of the joint, from qvel",
            {"jnt_qposadr": "jnt_dofadr", "data.qpos": "data.qvel"},
        ),
        "radians": ("these are radians; np.degrees", {ANGLE: "float(data.qpos[place])"}),
        "degrees_twice": ("np.degrees was called twice", {ANGLE: f"math.degrees({ANGLE})"}),
        "weightless": (
            "nothing moves in this run, as if there were no gravity",
            {"actuation=False": "gravity=(0, 0, 0)"},
        ),
        "swapped": (
            "the two lists are swapped",
            {BOTH: "return fall(model.replace(actuation=False)), fall(model)"},
        ),
        "arithmetic_address": ("that is qpos[1], of 'crate'", {LIFT: "1"}),
        "arithmetic_address, the start typed in": (
            "of 'crate'; shoulder_lift is at qpos[8]",
            {LIFT: "1", f"[{ANGLE}]": "[0.0]"},
        ),
        "servos_on_and_radians": (
            "servos are off. These are radians, too",
            {ANGLE: "float(data.qpos[place])", "model.replace(actuation=False)": "model"},
        ),
        "timestep_taken_for_granted": (
            "you took 200 steps for a second, and at 4 ms a step a second has 250",
            {"round(1 / model.timestep)": "200"},
        ),
        "timestep_taken_for_granted, once too often": (
            "you took 200 steps for a second, and at 4 ms a step a second has 250",
            {
                "round(1 / model.timestep)": "200",
                "range(seconds)": "range(seconds + 1)",
                "return angles": "return angles[:-1]",
            },
        ),
        "the_start_left_out": (
            "that is the arm 1 s later",
            {"range(seconds)": "range(seconds + 1)", "return angles": "return angles[1:]"},
        ),
        "zeros": (
            "no step was taken with the model that you got",
            {BOTH: "return [0.0] * (seconds + 1), [0.0] * (seconds + 1)"},
        ),
        "holds_with_ctrl": (
            "you wrote ctrl[1] (shoulder_lift), which was 0.5 then",
            {
                OWN_DATA: f"{OWN_DATA}        data.ctrl[1] = ctrl\n",
                "def fall(model)": "def fall(model, ctrl=0.0)",
                "actuation=False)": "actuation=False), 0.5",
            },
        ),
        "one_list": ("a tuple of 1", {BOTH: "return (fall(model),)"}),
        "one_step_a_second": (
            "you took 1 step for a second, and at 5 ms a step a second has 200",
            {"round(1 / model.timestep)": "1"},
        ),
    },
    "state": {
        "mujocos_name_for_ours": (
            "a Model has no attribute 'jnt_names': write model.joint_names",
            {"model.joint_names": "model.jnt_names"},
        ),
        "misspelled": (
            "a Model has no attribute 'jnt_qposaddr'. Did you mean model.jnt_qposadr?",
            {"jnt_qposadr": "jnt_qposaddr"},
        ),
        "where_they_begin": (
            "shoulder_pan: the pair holds numbers; write slice(begin, end)",
            {"slice(place, place + kind.nq), slice(dof, dof + kind.nv)": "(place, dof)"},
        ),
        "what_stands_there": (
            "shoulder_pan: the pair holds arrays",
            {"slice(place, place + kind.nq), slice(dof, dof + kind.nv)": "np.ones(1), np.ones(1)"},
        ),
        "one_slice": (
            "shoulder_pan: you return one slice; a pair is needed",
            {", slice(dof, dof + kind.nv)": ""},
        ),
        "each_pair_swapped": (
            "each pair is swapped",
            {
                "slice(place, place + kind.nq), slice(dof, dof + kind.nv)": (
                    "slice(dof, dof + kind.nv), slice(place, place + kind.nq)"
                )
            },
        ),
        "time_first": ("the two are swapped", {SLOTS: "return data.time, slots"}),
        "time_zeroed": (
            "data.time was set to zero; return it as the reset leaves it",
            {"keyframe=0)": "keyframe=0)\n    data.time = 0.0"},
        ),
        "keys_are_numbers": (
            "an int: 0 is the name of no joint: the keys must be model.joint_names",
            {"slots[name]": "slots[joint]"},
        ),
        "type_without_its_name": (
            "model.jnt_type has plain numbers: JointType(model.jnt_type[k]) has .nq",
            {"JointType(model.jnt_type[joint])": "model.jnt_type[joint]"},
        ),
        "ranges": ("the pair holds a range: range(0, 1)", {"slice(": "range("}),
        "time_after_a_step": (
            "read it right after the reset",
            {"keyframe=0)": "keyframe=0)\n    sm.step(model, data)"},
        ),
        "not_written": (
            "not written yet",
            {"slots = {}": 'raise NotImplementedError("TODO(you): later")'},
        ),
        "not_even_a_pair": (
            "shoulder_pan: you return a str: 'nothing'; a pair is needed",
            {SLOTS: 'return slots | {model.joint_names[0]: "nothing"}, data.time'},
        ),
        "hinges_only": (
            "1 of 7 joints are missing: box",
            {SLOTS: 'return {k: v for k, v in slots.items() if k != "box"}, data.time'},
        ),
        "pairs_of_numbers": (
            "shoulder_pan: the pair holds tuples; write slice(0, 1)",
            {"slice(": "("},
        ),
        "keyframe_forgotten": (
            "should be 6 s, you return 0: that is the time of a new Data",
            {"    sm.reset(model, data, keyframe=0)\n": ""},
        ),
        "the_other_keyframe": (
            "you return 59.522: that is the time of keyframe 1",
            {"keyframe=0": "keyframe=1"},
        ),
        "time_typed_in": (
            "should be 2.5 s, you return 6: that is the time in the course's own scene",
            {"data.time": "6.0"},
        ),
        "nv_taken_as_nq": ("six in qvel, not seven", {"kind.nv": "kind.nq"}),
        "nq_taken_as_nv": ("seven in qpos, not six", {"kind.nq": "kind.nv"}),
        "one_number_a_joint": (
            "a free joint owns more than one number",
            {"kind.nq": "1", "kind.nv": "1"},
        ),
        "slices_by_joint_number": (
            "it begins at the number of the joint, 1",
            {"model.jnt_qposadr[joint], model.jnt_dofadr[joint]": "joint, joint"},
        ),
        "qvel_begins_where_qpos_does": (
            "that is where it begins in qpos; see model.jnt_dofadr",
            {"jnt_dofadr": "jnt_qposadr"},
        ),
        "last_number_included": (
            "the end of a slice is one after the last number",
            {"kind.nq": "kind.nq - 1", "kind.nv": "kind.nv - 1"},
        ),
        "a_joint_too_many": (
            "no joint is called 'table'",
            {SLOTS: 'return slots | {"table": (slice(0, 1), slice(0, 1))}, data.time'},
        ),
        "a_list_of_slots": (
            "slots is a list of 7, and must be a dict",
            {SLOTS: "return list(slots.values()), data.time"},
        ),
        "time_as_text": (
            "time must be a number of seconds",
            {SLOTS: 'return slots, f"{data.time} s"'},
        ),
        "whole_seconds": ("should be 2.5 s, you return 2", {"data.time": "int(data.time)"}),
        "only_the_place": (
            "it begins at the right place and has 3 numbers, not 7",
            {"kind.nq": "min(kind.nq, 3)"},
        ),
    },
    "forward": {
        "no_copies_and_step_for_forward, raw": (
            "m: what you read is the simulator's own memory",
            {".copy()": "", "sm.forward": "sm.step"},
        ),
        "forward_on_another_data": (
            "forward was called on another Data than the one that you read",
            {"sm.forward(model, data)": "sm.forward(model, sm.make_data(model))"},
        ),
        "a_new_data_for_each_reading": (
            "it is of a new Data, on which forward was not called",
            {ACTS["w"]: f"data = sm.make_data(model)\n    {ACTS['w']}"},
        ),
        "read_once": (
            "was the place read once, before it? Read data.site_xpos",
            {"return tips": "return [tips[0]] * 4"},
        ),
        "our_model_for_mujocos, raw": (
            "MuJoCo's own functions take MuJoCo's own objects: give them model.raw and data.raw",
            {"sm.forward(": "__import__('mujoco').mj_forward("},
        ),
        "site_by_name": (
            "data.site_xpos takes a number in brackets, not a name: write data.site_xpos[model.sit",
            {SITE: '"gripperframe"', "data.site_xpos[tip]": 'data.site_xpos["gripperframe"]'},
        ),
        "derived_written": (
            "this array is read-only, because it is derived: write data.qpos",
            {ACTS["w"]: "data.site_xpos[tip] = 0.8"},
        ),
        "mujocos_name_in_this_package": (
            "has no attribute 'mj_forward'; write sm.forward(model, data)",
            {"sm.forward": "sm.mj_forward"},
        ),
        "no_copies, raw": ("what you read is the simulator's own memory", {".copy()": ""}),
        "one_joint_too_many": (
            "you also wrote qpos[2], which is 'elbow_flex'; leave that out",
            {ACTS["w"]: f"{ACTS['w']}\n    {ACTS['w'].replace('shoulder_lift', 'elbow_flex')}"},
        ),
        "nearly": (
            "is expected, 3.46e-06 mm away",
            {"return tips": "return [tips[0], tips[1] + 2e-9, *tips[2:]]"},
        ),
        "second_forward_forgotten": (
            "derived values were read before forward: that is the old pose, 270 mm away",
            _ordered("rfrwrr"),
        ),
        "forward_only_at_the_end": (
            "reading 2, after forward: derived values were read before any forward",
            _ordered("rrwrfr"),
        ),
        "forward_right_after_the_write": (
            "reading 3, after the write: forward was called before it was read",
            _ordered("rfrwfrr"),
        ),
        "forward_before_the_first": (
            "forward was called before this reading: in a new Data",
            _ordered("frrwrfr"),
        ),
        "step_for_forward": ("0.005 s passed: step was called", {"sm.forward": "sm.step"}),
        "degrees_for_radians": ("that is the arm at 0.8 degrees", {"0.8": "np.radians(0.8)"}),
        "radians_for_degrees": ("that is the arm at 45.8 rad", {"0.8": "np.degrees(0.8)"}),
        "arithmetic_address": ("you wrote qpos[1], which is 'crate'", {LIFT: "1"}),
        "joint_number_for_address": (
            "you wrote qpos[2], which is 'crate'; shoulder_lift is at qpos[8]",
            {LIFT: 'model.joint_id("shoulder_lift")'},
        ),
        "another_joint": (
            "you wrote qpos[2], which is 'elbow_flex'",
            {"shoulder_lift": "elbow_flex"},
        ),
        "written_into_a_copy": (
            "nothing was written into qpos of a Data",
            {"data.qpos": "data.qpos.copy()"},
        ),
        "body_for_site": (
            "that is the place of body 'gripper'",
            {SITE: 'model.body_id("gripper")', "site_xpos": "xpos"},
        ),
        "the_first_body": (
            "and body 'base'; read the site",
            {SITE: 'model.body_id("base")', "site_xpos": "xpos"},
        ),
        "printed_constants": (
            "crate before the arm: reading 2, after forward: that belongs to the course's own",
            {"data = ": f"{OWN_SCENE}data = "},
        ),
        "two_readings": ("a list of 2; it must return four positions", _ordered("rfr")),
        "heights_only": (
            "reading 1 must be an array of shape (3,)",
            {"return tips": "return [tip[2] for tip in tips]"},
        ),
        "counts_too_far": (
            "IndexError: ",
            {"return tips": "return [tips[k] for k in range(5)]"},
        ),
        "command_for_position": (
            "you wrote ctrl[1], a command, on which the arm would act with time",
            {ACTS["w"]: "data.ctrl[1] = 0.8"},
        ),
        "speed_for_position": (
            "you wrote qvel[1], a speed",
            {ACTS["w"]: "data.qvel[1] = 0.8"},
        ),
        "another_angle": ("that is the arm at 0.7 rad", {"0.8": "0.7"}),
        "the_first_site": ("that is the place of site 'baseframe'", {SITE: "0"}),
        "no_forward_at_all": ("before any forward, which was never called", _ordered("rrwrr")),
        "written_too_early": (
            "reading 2, after forward: qpos was written before the first forward",
            _ordered("rwfrrfr"),
        ),
        "fourth_reading_too_early": (
            "it was read before the second forward",
            _ordered("rfrwrrf"),
        ),
        "something_else": (
            "reading 1, fresh: you return [0.5000 0.0000 0.0000] m where [0.0000 0.0000",
            {"return tips": "return [[0.5, 0, 0], *tips[1:]]"},
        ),
        "rounded": ("it was rounded, 0.0", {"return tips": "return np.round(tips, 4)"}),
        "half_precision": (
            "float16 keeps few digits",
            {"return tips": "return np.array(tips, np.float16)"},
        ),
        "millimetres": (
            "the readings are in millimetres",
            {"return tips": "return [tip * 1000 for tip in tips]"},
        ),
        "copies_at_the_end": (
            "read only at the end, or from the simulator's own memory",
            {"return tips": "return [tips[3].copy() for _ in tips]"},
        ),
    },
    "replay": {
        "true_typed_in_after_an_assert": (
            "this assert failed. Where the result may be either, return what you compared",
            {EQUAL: "True, first, second", TWICE: f"{TWICE}\n    assert (first == second).all()"},
        ),
        "another_order": (
            "the order is (same, first, second); you return same as number 3",
            {EQUAL: "first, second, np.array_equal(first, second)"},
        ),
        "speeds_for_positions": (
            "first has 12 numbers, as qvel has; return a copy of qpos, which has 13",
            {"data.qpos.copy()": "data.qvel.copy()"},
        ),
        "the_data_itself": (
            "first must be a copy of qpos; you return a Data",
            {"data.qpos.copy()": "data", EQUAL: "True, first, second"},
        ),
        "forward_for_step": (
            "no step was taken: forward takes no time",
            {RUN: "sm.forward(model, data)"},
        ),
        "command_into_a_copy": (
            "a copy of ctrl is no command. Write data.ctrl[:] = ctrl after the reset",
            {COMMAND: "data.ctrl.copy()[:] = ctrl"},
        ),
        "command_typed_in": (
            "the command is [-0.2 -0.5 0.4 1.5 1.5 0.28], the argument ctrl",
            {COMMAND: "data.ctrl[:] = [0.4, -0.8, 0.5, 1.6, 1.57, 0.28]"},
        ),
        "one_number_of_ctrl_forgotten": (
            "at its first step ctrl[5] (gripper) was 0; the command there is 0.28",
            {COMMAND: f"{COMMAND}\n        data.ctrl[5] = 0.0"},
        ),
        "command_into_all_of_qpos": (
            "6 numbers were written into 13. Here qpos has 13 (model.nq)",
            {COMMAND: "data.qpos[:] = ctrl"},
        ),
        "steps_as_a_float": (
            "nstep must be a whole number of at least 1; got 600.0: type round(600.0)",
            {RUN: "sm.step(model, data, nstep / 1)"},
        ),
        "one_data_no_copy": (
            "both show the last run",
            _outside() | {"data.qpos.copy()": "data.qpos"},
        ),
        "no_reset_between": ("there was one run of 1200 steps", _outside(RESET, ZERO)),
        "second_only_zeroes_the_time": (
            "second run: it did not begin at keyframe 0",
            _outside(RESET),
        ),
        "pushed_at_the_start": (
            "it did not begin at keyframe 0: qvel was up to 0.1 away",
            {COMMAND: f"{COMMAND}\n        data.qvel[0] += 0.1"},
        ),
        "command_for_position": (
            "the command was written into qpos, and the arm was there at once",
            {COMMAND: "data.qpos[model.jnt_qposadr[model.actuator_jntid]] = ctrl"},
        ),
        "command_added": (
            "+= adds to it; data.ctrl[:] = ctrl sets it",
            {COMMAND: "data.ctrl[:] += ctrl"},
        ),
        "ctrl_changes_on_the_way": (
            "ctrl was changed after step 300",
            {
                RUN: "sm.step(model, data, nstep // 2)\n        data.ctrl[0] = 0.0\n"
                "        sm.step(model, data, nstep - nstep // 2)"
            },
        ),
        "ctrl_before_the_reset": (
            "a reset overwrites ctrl",
            {f"        {COMMAND}\n": "", RESET: f"        {COMMAND}\n{RESET}"},
        ),
        "one_run_under_two_names": (
            "there was only one run: one run compared with itself is always equal. Run twice",
            {TWICE: "first = second = once()"},
        ),
        "one_run_with_itself": (
            "there was only one run: one run compared with itself",
            {TWICE: "first = once()\n    second = first.copy()"},
        ),
        "loads_its_own": (
            "no step was taken with the model that you got, but with another",
            {TWICE: f'model = sm.load("so101/scene_box", backend=model.backend)\n    {TWICE}'},
        ),
        "allclose": (
            "apart and you call them equal: nearly equal is not equal",
            {"array_equal": "allclose"},
        ),
        "always_true": (
            "0.1 apart, and same is True: is True typed in",
            {EQUAL: "True, first, second"},
        ),
        "first_with_first": (
            "first and second are one array",
            {EQUAL: "np.array_equal(first, first), first, first"},
        ),
        "first_with_a_copy_of_it": (
            "the first run was returned twice",
            {EQUAL: "np.array_equal(first, second), first, first.copy()"},
        ),
        "second_twice": (
            "that is the end of the second run",
            {EQUAL: "np.array_equal(first, second), second, second.copy()"},
        ),
        "compared_by_identity": (
            "ended in the same bits and you call them different",
            {EQUAL: "first is second, first, second"},
        ),
        "not_all_compared": (
            "an array of shape (13,), one answer for each number",
            {EQUAL: "first == second, first, second"},
        ),
        "no_copy": ("first is data.qpos itself", {"data.qpos.copy()": "data.qpos"}),
        "default_state": ("first run: it did not begin at keyframe 0", {RESET: ""}),
        "time_not_zeroed": ("it began at 6 s, the keyframe's time", {ZERO: ""}),
        "a_step_short": (
            "second run: it took 599 steps where 600",
            {
                "def once()": "def once(nstep)",
                TWICE: "first, second = once(nstep), once(nstep - 1)",
            },
        ),
        "a_step_too_many": (
            "first run: it took 601 steps where 600",
            {RUN: "sm.step(model, data, nstep + 1)"},
        ),
        "number_of_steps_typed_in": (
            "it took 600 steps where 150",
            {RUN: "sm.step(model, data, 600)"},
        ),
        "ctrl_one_step_late": (
            "second run: at its first step ctrl was the keyframe's own, and it was written only",
            {
                "def once()": "def once(late=0)",
                f"{COMMAND}\n": f"if late:\n            sm.step(model, data, late)\n"
                f"        {COMMAND}\n",
                RUN: "sm.step(model, data, nstep - late)",
                TWICE: "first, second = once(), once(1)",
            },
        ),
        "rounded": ("was it rounded", {"data.qpos.copy()": "np.round(data.qpos, 4)"}),
        "nothing_happens": (
            "no step was taken",
            {TWICE: "first, second = np.zeros(model.nq), np.zeros(model.nq)"},
        ),
        "three_runs": ("there were 3 runs", {TWICE: "_, first, second = once(), once(), once()"}),
        "one_step": (
            "first run: it took 1 step where 600",
            {RUN: "sm.step(model, data)"},
        ),
        "single_precision": (
            "first is float32, which has fewer digits",
            {"data.qpos.copy()": "np.float32(data.qpos)"},
        ),
        "command_in_degrees": (
            "degrees were made of it, and the command is in radians",
            {COMMAND: "data.ctrl[:] = np.degrees(ctrl)"},
        ),
    },
}

RIGHT_ONES: dict[str, dict[str, Changes]] = {
    "gravity": {
        "a_step_after_the_last_reading": {
            f"angles = [{ANGLE}]": "angles, each = [], round(1 / model.timestep)",
            "for _ in range(seconds)": "for k in range(seconds * each + 1)",
            STEP: "if k % each == 0:",
            "angles.append": "    angles.append",
            "        return angles": "            sm.step(model, data)\n        return angles",
        },
        "limp_first_in_one_data_each": {OWN_DATA: f"{OWN_DATA}        data.ctrl[1] = 0.0\n"},
        "raw_mujoco, raw": {
            "def fall(model)": "import mujoco\n\n    def fall()",
            f"        place = {LIFT}\n": "",
            "sm.make_data(model)": "mujoco.MjData(model.raw)",
            "data.qpos[place]": 'data.joint("shoulder_lift").qpos[0]',
            STEP: "for _ in range(round(1 / model.raw.opt.timestep)):\n"
            "                mujoco.mj_step(model.raw, data)",
            BOTH: f"on = fall()\n    {OFF}\n    off = fall()\n    {ON}\n    return on, off",
        },
        "single_precision": {BOTH: f"{BOTH.replace('return ', 'return np.array([')}], np.float32)"},
        "rounded_arrays": {BOTH: f"{BOTH.replace('return ', 'return np.round([')}], 2)"},
    },
    "state": {
        "open_and_from_the_end": {
            SLOTS: "last = model.joint_names[-1]\n    position, velocity = slots[last]\n"
            "    from_the_end = slice(velocity.start - model.nv, None, 1)\n"
            f"    slots[last] = slice(position.start, None), from_the_end\n    {SLOTS}"
        },
        "raw_mujoco, raw": {
            "slots = {}": "import mujoco\n\n    slots, raw = {}, model.raw\n"
            "    widths = {0: (7, 6), 1: (4, 3), 2: (1, 1), 3: (1, 1)}",
            "for joint, name in enumerate(model.joint_names)": "for joint in range(raw.njnt)",
            "kind = JointType(model.jnt_type[joint])": "nq, nv = widths[int(raw.jnt_type[joint])]",
            "slots[name]": "slots[raw.joint(joint).name]",
            "kind.": "",
            "sm.make_data(model)": "mujoco.MjData(raw)",
            "sm.reset(model, data, keyframe=0)": "mujoco.mj_resetDataKeyframe(raw, data, 0)",
        },
    },
    "forward": {
        "raw_mujoco, raw": {
            "data = sm.make_data(model)": "import mujoco\n\n    data = mujoco.MjData(model.raw)",
            SITE: 'data.site("gripperframe")',
            "data.site_xpos[tip]": "tip.xpos",
            "sm.forward(model, data)": "mujoco.mj_forward(model.raw, data)",
            f"data.qpos[{LIFT}]": 'data.joint("shoulder_lift").qpos',
        },
        "single_precision": {"return tips": "return np.array(tips, np.float32)"},
        "command_written_too": {ACTS["w"]: f"{ACTS['w']}\n    data.ctrl[1] = 0.8"},
        "plain_lists": {"return tips": "return [tip.tolist() for tip in tips]"},
        "one_array": {"return tips": "return np.array(tips)"},
    },
    "replay": {
        "one_data_reset_between_step_by_step": _outside()
        | {
            f"        {COMMAND}\n": "",
            RUN: "for _ in range(nstep):\n            data.ctrl = ctrl\n"  # again and again
            "            sm.step(model, data)",
            EQUAL: "bool((first == second).all()), first, second",
        },
        "raw_mujoco, raw": {
            "def once": "import mujoco\n\n    def once",
            "sm.make_data(model)": "mujoco.MjData(model.raw)",
            "sm.reset(model, data, keyframe=0)": "mujoco.mj_resetDataKeyframe(model.raw, data, 0)",
            RUN: "for _ in range(nstep):\n            mujoco.mj_step(model.raw, data)",
        },
        "raw_through_our_data_in_two_halves, raw": {
            "def once": "import mujoco\n\n    def once",
            "sm.reset(model, data": "mujoco.mj_resetDataKeyframe(model.raw, data.raw",
            "keyframe=0": "0",
            "data.time": "data.raw.time",
            COMMAND: "data.raw.ctrl = ctrl",
            RUN: "for _ in range(nstep):\n            mujoco.mj_step1(model.raw, data.raw)\n"
            "            mujoco.mj_step2(model.raw, data.raw)",
        },
    },
}


@dataclass(frozen=True)
class Attempt:
    """A solution, the function of the exercise that it is for, and what must be said of it.

    `raw`: it uses MuJoCo itself.
    """

    name: str
    solves: str
    text: str
    message: str
    raw: bool

    @cached_property
    def function(self) -> Callable[..., Any]:
        """Of the file with the text, whose lines Python can show."""
        file = f"<{self.name}>"
        linecache.cache[file] = len(self.text), None, self.text.splitlines(keepends=True), file
        names: dict[str, Any] = {}
        exec(compile(self.text, file, "exec"), names)
        return names[self.solves]


def _attempts(tables: dict[str, dict[str, tuple[str, Changes]]]) -> Iterator[Attempt]:
    for solves, table in tables.items():
        for name, (message, changes) in table.items():
            source = _SOURCES[solves]
            for old, new in changes.items():
                assert old in source, (name, old)
                source = source.replace(old, new)
            mistake, _, variant = name.partition(", ")
            yield Attempt(
                f"{solves}-{mistake}",
                f"demo_{solves}",
                _IMPORTS + source,
                message,
                variant == "raw",
            )


WRONG = [*_attempts(WRONG_ONES)]
RIGHT = [*_attempts({s: {n: ("", c) for n, c in t.items()} for s, t in RIGHT_ONES.items()})]
