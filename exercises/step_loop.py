"""The step loop, by you: four functions to write, two to read.

    python step_loop.py                 what there is, and what is still to do
    python step_loop.py --gravity       run one of yours, and see what it shows
    python step_loop.py --hold          run one of the two that are written already
    python step_loop.py --gravity --backend pybullet      the same on another engine
    python step_loop.py --gravity --traceback             where an error came from, in full
    statemachine check step_loop.py     judges what your four functions do

Replace each `raise NotImplementedError` by your code. A function gets a `model`, and whatever
else it needs, and RETURNS what its docstring asks for; the part below the line at the end
prints it. What you may need, with `import statemachine as sm`:

    data = sm.make_data(model)              a new Data: everything that changes
    sm.step(model, data, 100)               100 steps; 1 without a number
    sm.forward(model, data)                 recompute what is derived; no time passes
    sm.reset(model, data)                   back to the default state
    sm.reset(model, data, keyframe=0)       or to the first state that the model file names
    data.qpos, data.qvel, data.ctrl         arrays that you may read, and write into: positions,
                                            velocities, and the angles that servos aim at [rad]
    data.time                               a number [s] that you may read and write
    data.site_xpos[model.site_id("…")]      where a site is, three numbers [m]; read only
    model.timestep                          how much time one step takes [s]
    model.joint_names                       names of all joints, in the order of their numbers
    model.joint_id("shoulder_lift")         the number of a joint
    model.jnt_qposadr, model.jnt_dofadr     where each joint begins in qpos, and in qvel
    model.jnt_type                          what each joint is: JointType(…).name, .nq, .nv
    model.replace(actuation=False)          another Model: the same robot, its servos off

A Data belongs to the Model that made it. An array that you read from `data` may be the
simulator's own memory: `.copy()` keeps what it says now. On MuJoCo, `model.raw` and `data.raw`
are the engine's own MjModel and MjData, and what you do with them counts just as well.

When all four pass, see how far one late command takes two runs apart:

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

# The command of demo_replay, one target angle for each of the six servos [rad].
CTRL = [0.4, -0.8, 0.5, 1.6, 1.57, 0.28]


def demo_gravity(model, seconds=4):
    """TODO(you): nobody writes ctrl. Who holds the arm up?

    Run twice from the default state, each time in a new Data, and never write ctrl: first
    with the model as it is, then with its servos off. For the second run, `model.replace`
    gives you another Model. Or the raw way, on MuJoCo: set the bit mjDSBL_ACTUATION of
    `mujoco.mjtDisableBit` in `model.raw.opt.disableflags`, and give the model back as you
    found it.

    Args:
        model: A Model of the arm. Do not rely on its timestep, nor on where a joint begins.
        seconds: A whole number: how long each run lasts [s of simulated time].

    Returns:
        (on, off): Two lists of seconds + 1 numbers: the position of the joint shoulder_lift
        at 0, 1, 2 … seconds, in DEGREES, with the servos on and with the servos off.
    """
    raise NotImplementedError("TODO(you): leave the arm alone, with servos and without")


def demo_state(model):
    """TODO(you): which numbers of qpos and qvel belong to which joint?

    A joint may own more than one number, and not equally many in qpos and in qvel: a hinge
    owns one and one; a free joint, which lets a body fly, owns more. `JointType` knows.

    Args:
        model: A Model with at least one keyframe.

    Returns:
        (slots, time): slots is a dict {name of the joint: (slice of qpos, slice of qvel)},
        with one entry for every joint, as {"gripper": (slice(5, 6), slice(5, 6)), …}, so that
        data.qpos[slots["gripper"][0]] is its position. time is data.time [s] right after a
        reset to keyframe 0.
    """
    raise NotImplementedError("TODO(you): tell which slots each joint owns")


def demo_forward(model):
    """TODO(you): where is the fingertip, and who works it out when?

    In one new Data, read the position of the site gripperframe four times:
    1. at once; 2. after a forward; 3. after writing 0.8 [rad] into the place of joint
    shoulder_lift in qpos; 4. after a second forward. No time passes in all this.

    Args:
        model: A Model of the arm. Do not rely on where a joint begins in qpos.

    Returns:
        The four positions [m], in this order: a list of four, or an array of shape (4, 3).
    """
    raise NotImplementedError("TODO(you): read the fingertip four times")


def demo_replay(model, ctrl, nstep=600):
    """TODO(you): the same start, the same commands: the same end?

    Do this twice: go to keyframe 0, set the time to zero, write `ctrl` into the command,
    take `nstep` steps, and keep a copy of qpos. Then compare the two: every bit, not nearly.

    Args:
        model: A Model with at least one keyframe.
        ctrl: The command of both runs, from before the first step to the last [rad].
        nstep: How many steps each run takes.

    Returns:
        (same, first, second): whether the two copies are equal (True or False), and the
        copies, each of shape (nq,).
    """
    raise NotImplementedError("TODO(you): run twice, and compare exactly")


def demo_hold(model, seconds=2):
    """Written for you: six numbers in, and the arm follows.

    Returns:
        A list of (time [s], largest distance of a joint from its target [degrees]).
    """
    target = np.array([0.0, -0.6, 1.2, 0.5, 0.0, 0.6])
    joints = model.jnt_qposadr[model.actuator_jntid]  # where what each servo drives is in qpos
    data = sm.make_data(model)
    data.ctrl[:] = target  # once: it stays until somebody writes another
    every = round(0.25 / model.timestep)
    trace = []
    for _ in range(4 * seconds + 1):
        away = np.abs(data.qpos[joints] - target).max()
        trace.append((data.time, math.degrees(away)))
        sm.step(model, data, every)
    return trace


def demo_speed(model, nstep=4000):
    """Written for you: how much faster than the world is a simulation?

    Returns:
        (simulated time [s], time on the clock [s]).
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
    print("shoulder_lift, ctrl never written")
    print("   time    servos on   servos off")
    for second, (one, two) in enumerate(zip(on, off, strict=True)):
        print(f"{second:5d} s  {one:10.3f}°  {two:10.3f}°")


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
                print(f"Readings {one + 1} and {two + 1} are equal, bit by bit. Why?")


def show_replay(model, result):
    same, first, second = result
    print("qpos at the end of the first run, and of the second")
    for one, two in zip(first, second, strict=True):
        print(f"  {one:20.15f}  {two:20.15f}")
    print(f"largest difference: {np.abs(first - second).max():.1e}")
    print(f"you say: {'equal' if same else 'not equal'}")


def show_hold(model, result):
    print("   time    farthest from its target")
    for moment, away in result:
        print(f"{moment:5.2f} s  {away:10.3f}°")


def show_speed(model, result):
    simulated, clock = result
    print(f"{simulated:g} s of simulated time took {clock:.2f} s on the clock:")
    print(f"{simulated / clock:.0f} times as fast as the world")


# For each flag: what prints its result, the model, and what the function gets beside it.
SHOWS = {
    "gravity": (show_gravity, "so101/scene", ()),
    "state": (show_state, "so101/scene_box", ()),
    "forward": (show_forward, "so101/scene", ()),
    "replay": (show_replay, "so101/scene_box", (CTRL,)),
    "hold": (show_hold, "so101/scene", ()),
    "speed": (show_speed, "so101/scene_box", ()),
}


def where(error, file):
    """The last line of a function of a file that had a part in an error."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [at.lineno for at in frames if at.filename == file and at.name != "main"]
    return f"{sys.argv[0]}, line {lines[-1]}: " if lines else ""


def main(functions):
    """Run what the command line names; `functions` has the six by name."""
    about = {name: (functions[f"demo_{name}"].__doc__ or name).splitlines()[0] for name in SHOWS}
    parser = argparse.ArgumentParser(
        description="The step loop, by you: four functions to write, two to read."
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
        return 2 if known else 1
    if result is None:
        print(f"{called} returned nothing: it must hand its result over with `return`")
        return 1
    try:
        show(model, result)
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        print(f"{called}: what it returned cannot be shown ({error}); see what its docstring asks")
        return 1
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(globals()))
    except KeyboardInterrupt:
        sys.exit(130)
