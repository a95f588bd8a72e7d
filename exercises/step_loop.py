"""The step loop, by you: four functions to write, and two to read.

    python step_loop.py                 list the six functions
    python step_loop.py --gravity       run demo_gravity, and print what it returns
    python step_loop.py --hold          run demo_hold, which is written already
    python step_loop.py --gravity --backend pybullet      the same on another engine
    python step_loop.py --gravity --traceback             show an error in full
    statemachine check step_loop.py     judge what your four functions do, with a hint for each

Replace each `raise NotImplementedError` by your code. A function gets a `model`, and whatever
else it needs, and RETURNS what its docstring asks for; the code below the line at the end of this
file prints it. What you may need, with `import statemachine as sm`:

    data = sm.make_data(model)              a new Data: everything that changes
    sm.step(model, data, 100)               100 steps; one step without the number
    sm.forward(model, data)                 recompute what is derived; no time passes
    sm.reset(model, data)                   back to the default state
    sm.reset(model, data, keyframe=0)       to keyframe 0, a state that the model's file names
    data.qpos, data.qvel                    positions [rad or m] and velocities: arrays that you
                                            may read, and write into
    data.ctrl                               the command: a target angle for each servo [rad];
                                            an array that you may write into
    data.time                               simulated time [s]; you may read and write it
    data.site_xpos[model.site_id("…")]      where a site is, three numbers [m]; read only. A site
                                            is a point with a name, such as the fingertip
    model.timestep                          how much time one step takes [s]
    model.joint_names                       names of all joints, in the order of their numbers
    model.joint_id("shoulder_lift")         the number of a joint
    model.jnt_qposadr, model.jnt_dofadr     where each joint begins in qpos, and in qvel: by its
                                            number, not by its name
    model.jnt_type                          the type of each joint: JointType(model.jnt_type[k])
                                            has .name, .nq and .nv, its numbers in qpos and qvel
    model.replace(actuation=False)          another Model: the same robot, its servos off

A Data belongs to the Model that made it. An array that you read from `data` may be the
simulator's own memory, which changes with the next step: `.copy()` keeps the numbers of now. On
MuJoCo, `model.raw` and `data.raw` are MuJoCo's own MjModel and MjData, and you may use them, too.

When all four are right, see how different two runs become after one late command, or one more step:

    statemachine lesson replay --break late-ctrl
    statemachine lesson replay --break extra-step
"""

from __future__ import annotations

import argparse
import math
import sys
import time
import traceback

import numpy as np

import statemachine as sm
from statemachine.errors import StateMachineError
from statemachine.interface import JointType  # noqa: F401  (for demo_state)

# The command of demo_replay: a target angle for each of the six servos [rad].
CTRL = [0.4, -0.8, 0.5, 1.6, 1.57, 0.28]


def demo_gravity(model, seconds=4):
    """TODO(you): you never write ctrl. Who holds the arm up?

    Run twice from the default state, each time with a new Data, and never write ctrl: first
    with the model as it is, then with its servos off. For the second run, `model.replace`
    gives you another Model. MuJoCo's own way: set the bit mjDSBL_ACTUATION of
    `mujoco.mjtDisableBit` in `model.raw.opt.disableflags`, and switch it back before you return.
    `statemachine lesson gravity` shows such a run.

    Args:
        model: A Model of the arm. Ask it for its timestep, and for where a joint begins in
            qpos: you are called with several models, and they differ in both.
        seconds: How long each run lasts, in simulated time; a whole number [s].

    Returns:
        (on, off): Two lists of seconds + 1 numbers: the position of the joint shoulder_lift
        at 0, 1, 2 … seconds, in DEGREES, with the servos on and with the servos off.
    """
    raise NotImplementedError("TODO(you): leave the arm alone, with servos and without")


def demo_state(model):
    """TODO(you): which numbers of qpos and qvel belong to which joint?

    A joint may own several numbers, and another number of them in qpos than in qvel. A hinge
    owns one in each. A free joint, which lets a body move anywhere, owns more: see `JointType`,
    and `statemachine lesson state`.

    Args:
        model: A Model with at least one keyframe.

    Returns:
        (slots, time): slots is a dict {name of the joint: (slice of qpos, slice of qvel)},
        with an entry for every joint, as {"gripper": (slice(5, 6), slice(5, 6)), …}. Then
        data.qpos[slots["gripper"][0]] is the position of that joint. time is data.time [s]
        right after a reset to keyframe 0.
    """
    raise NotImplementedError("TODO(you): return the slots of each joint, and the time")


def demo_forward(model):
    """TODO(you): where is the fingertip, and when is that computed?

    In one new Data, read the position of the site gripperframe four times:
    1. at once; 2. after a forward; 3. after you have written 0.8 [rad] into qpos, at the place
    of the joint shoulder_lift; 4. after a second forward. No time passes in all this.
    `statemachine lesson forward` asks the same question.

    Args:
        model: A Model of the arm. Ask it where a joint begins in qpos.

    Returns:
        The four positions [m], in this order: a list of four, or an array of shape (4, 3). Do not
        round them.
    """
    raise NotImplementedError("TODO(you): read the fingertip four times")


def demo_replay(model, ctrl, nstep=600):
    """TODO(you): do two equal runs end in the same state?

    Do this twice: reset to keyframe 0, set data.time to zero, write the command `ctrl` into
    data.ctrl, take `nstep` steps, and keep a copy of qpos. Then compare the two copies
    exactly: every bit counts, and nearly equal is not equal. See `statemachine lesson replay`.

    Args:
        model: A Model with at least one keyframe.
        ctrl: The command of both runs, from before the first step to the last [rad].
        nstep: How many steps each run takes.

    Returns:
        (same, first, second): whether the two copies are equal, as the bool True or False, not
        1 or 0; and the two copies, each of shape (nq,), not rounded.
    """
    raise NotImplementedError("TODO(you): run twice, and compare exactly")


def demo_hold(model, seconds=2):
    """Written for you: you write six numbers, and the arm follows.

    Returns:
        A list of (time [s], the largest difference between a joint and its target [degrees]).
    """
    target = np.array([0.0, -0.6, 1.2, 0.5, 0.0, 0.6])
    joints = model.jnt_qposadr[model.actuator_jntid]  # the place in qpos of each servo's joint
    data = sm.make_data(model)
    data.ctrl[:] = target  # once: the command stays until somebody writes another
    every = round(0.25 / model.timestep)
    trace = []
    for _ in range(4 * seconds + 1):
        away = np.abs(data.qpos[joints] - target).max()
        trace.append((data.time, math.degrees(away)))
        sm.step(model, data, every)
    return trace


def demo_speed(model, nstep=4000):
    """Written for you: how much faster than real time is a simulation?

    Returns:
        (simulated time [s], time that passed on the clock [s]).
    """
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    data.time = 0.0
    began = time.perf_counter()
    for _ in range(nstep):
        sm.step(model, data)
    return data.time, time.perf_counter() - began


# ---------------------------------------------------------------------------------------
# The rest is written for you: it loads the model, calls the function, prints the result.


def show_gravity(model, result):
    on, off = result
    print("The position of shoulder_lift; ctrl was never written")
    print("   time    servos on   servos off")
    for second, (one, two) in enumerate(zip(on, off, strict=True)):
        print(f"{second:5d} s  {one:10.3f}°  {two:10.3f}°")
    if len(on) != 5:
        print(f"You return {len(on)} of each; 5 are asked for: at 0, 1, 2, 3 and 4 s")


def show_state(model, result):
    slots, start = result
    print(f"qpos has {model.nq} numbers, qvel has {model.nv}")
    for name, (position, velocity) in slots.items():
        places = f"qpos[{position.start}:{position.stop}]"
        print(f"  {name:<14} {places:<12} qvel[{velocity.start}:{velocity.stop}]")
    print(f"data.time at keyframe 0: {start:g} s")


def show_forward(model, result):
    when = ("fresh", "after forward", "after writing qpos", "after forward again")
    print("The fingertip")
    for number, (words, tip) in enumerate(zip(when, result, strict=True), start=1):
        print(f"  {number}  {words:<20} [{tip[0]:8.4f} {tip[1]:8.4f} {tip[2]:8.4f}] m")
    for one in range(4):
        for two in range(one + 1, 4):
            if np.array_equal(result[one], result[two]):
                print(f"Readings {one + 1} and {two + 1} are equal, bit for bit. Why?")


def show_replay(model, result):
    same, first, second = result
    print("qpos at the end of the first run, and of the second")
    for one, two in zip(first, second, strict=True):
        print(f"  {one:20.15f}  {two:20.15f}")
    print(f"The largest difference between two numbers: {np.abs(first - second).max():.1e}")
    print(f"Your answer: {'equal' if same else 'not equal'}")


def show_hold(model, result):
    print("   time    the largest difference between a joint and its target")
    for moment, away in result:
        print(f"{moment:5.2f} s  {away:10.3f}°")


def show_speed(model, result):
    simulated, clock = result
    print(f"{simulated:g} s of simulated time took {clock:.2f} s on the clock.")
    print(f"That is {simulated / clock:.0f} times as fast as real time.")


# For each flag: what prints the result, the model, and the further arguments of the function.
SHOWS = {
    "gravity": (show_gravity, "so101/scene", ()),
    "state": (show_state, "so101/scene_box", ()),
    "forward": (show_forward, "so101/scene", ()),
    "replay": (show_replay, "so101/scene_box", (CTRL,)),
    "hold": (show_hold, "so101/scene", ()),
    "speed": (show_speed, "so101/scene_box", ()),
}


def where(error, file):
    """Return the file and line in which an error arose, in a function of this file; or ""."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [at.lineno for at in frames if at.filename == file and at.name != "main"]
    return f"{sys.argv[0]}, line {lines[-1]}: " if lines else ""


def about_function(function):
    """Return the first line about a function, and whether it is still to be written."""
    words = (function.__doc__ or function.__name__).splitlines()[0].removeprefix("TODO(you): ")
    todo = "NotImplementedError" in function.__code__.co_names
    return f"TODO(you): {words}" if todo else words


def main(functions):
    """Run the function that the command line names; `functions` has the six by name."""
    about = {name: about_function(functions[f"demo_{name}"]) for name in SHOWS}
    parser = argparse.ArgumentParser(
        description="The step loop, by you: four functions to write, and two to read."
    )
    chosen = parser.add_mutually_exclusive_group()
    for name, words in about.items():
        chosen.add_argument(f"--{name}", action="store_const", dest="name", const=name, help=words)
    parser.add_argument("--backend", default="mujoco", metavar="NAME", help="an engine (mujoco)")
    parser.add_argument("--traceback", action="store_true", help="show all of an error")
    options = parser.parse_args()
    if options.name is None:
        for name, words in about.items():
            print(f"  --{name:<8} {words}")
        print(f"Start with: python {sys.argv[0]} --gravity")
        return 0
    show, scene, more = SHOWS[options.name]
    called = f"demo_{options.name}"
    try:
        model = sm.load(scene, backend=options.backend)
        result = functions[called](model, *more)
    except NotImplementedError as todo:
        print(f"{called}: {todo}")
        return 1
    except Exception as error:
        if options.traceback:
            raise
        place, known = where(error, functions.get("__file__")), isinstance(error, StateMachineError)
        print(f"{called}: {place}{error if known else f'{type(error).__name__}: {error}'}")
        if place:
            print(f"For a hint, type: statemachine check {sys.argv[0]}")
        return 2 if known else 1
    if result is None:
        print(f"{called} returned nothing: end it with `return`, and the result")
        return 1
    try:
        show(model, result)
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        print(f"{called}: its result cannot be shown ({error}); see Returns in its docstring")
        print(f"For a hint, type: statemachine check {sys.argv[0]}")
        return 1
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(globals()))
    except KeyboardInterrupt:
        sys.exit(130)
