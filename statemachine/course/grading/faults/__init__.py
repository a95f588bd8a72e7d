"""The arm with one seeded fault at a time, to test the tests of students.

A test that no wrong arm fails says nothing about the right one. `patches` puts a fault into a
running process, `plugin` does it inside pytest, `run` starts pytest once for each fault.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One fault, in words.

    Attributes:
        name: What `--only` takes; the fault is made by `patches.PATCHES[name]`.
        wrong: What is wrong, in a few words.
        hint: What no test looked at, where none catches it.
    """

    name: str
    wrong: str
    hint: str


# From what is read, over what forward and step do, to what a replay is worth.
_FAULTS = (
    Fault(
        "xyzw",
        "quaternions are x y z w",
        "no test compares a quaternion with a turn that you know by hand",
    ),
    Fault(
        "com-for-frame",
        "xpos is a centre of mass",
        "no test compares xpos of a link with a place from the model's file, or turns a joint and "
        "asks whether the origin of its own link stays where it is",
    ),
    Fault(
        "joints-shifted",
        "joints get each other's numbers",
        "no test turns one joint and asks whether the fingertip moves as that joint moves it",
    ),
    Fault(
        "degrees",
        "angles are taken for degrees",
        "no test writes a known angle into qpos and measures how far the arm turned",
    ),
    Fault(
        "no-forward",
        "forward does nothing",
        "no test writes qpos, calls forward, and asks whether the fingertip has moved",
    ),
    Fault(
        "forward-steps",
        "forward takes a step",
        "no test asks whether forward leaves time, qpos and qvel as they were",
    ),
    Fault(
        "step-and-forward",
        "step ends with a forward",
        "no test reads the fingertip right after a step, and asks whether it still is where it was "
        "before",
    ),
    Fault(
        "one-step-short",
        "step(…, n) takes n − 1 steps",
        "no test compares one call of n steps with n calls of one step; data.time does not show it",
    ),
    Fault(
        "motor-left-on",
        "a motor resists every joint",
        "no test turns the servos off (model.replace(actuation=False)) and lets the arm fall",
    ),
    Fault(
        "gains-doubled",
        "servos push twice as hard",
        "no test asks how far the arm sags under its own weight, or how hard a servo pushes",
    ),
    Fault(
        "gravity-up",
        "gravity points up",
        "no test lets something fall and asks where it went",
    ),
    Fault(
        "spin-in-world",
        "a box spins about world axes",
        "no test spins a box that is already turned, and asks about which axis it turns",
    ),
    Fault(
        "reset-keeps-ctrl",
        "reset keeps the old ctrl",
        "no test writes ctrl, resets, and asks whether ctrl is that of the reset",
    ),
    Fault(
        "no-replay",
        "hidden noise is added to ctrl",
        "no test runs the same commands twice from the same start, and asks for the same bits",
    ),
)
FAULTS = {fault.name: fault for fault in _FAULTS}
FAULT = "STATEMACHINE_FAULT"  # the variable that names a fault to the plugin
IMPORT = "the import of the file"  # where that failed, in place of a test's name
