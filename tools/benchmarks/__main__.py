"""What the interface costs, against the engine alone: `make bench`.

Every figure is a ratio, taken in one process and in turns; the null is the baseline
against itself. A null that is far from 1 says that this machine is too noisy now. What is timed
at once takes less than a millisecond where it can: a longer one is interrupted more often by
whatever else runs, and its ratio to a shorter one would show that.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from threading import get_ident

import mujoco
import mujoco.batch
import numpy as np

import statemachine as sm
from statemachine import __version__, releases
from statemachine.lab.recordings import recorder
from statemachine.lab.runs.drive import drive, no_progress
from statemachine.lab.runs.interleaved_timing import time_interleaved
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import WhyRequest, explain
from statemachine.lab.why.causes import built
from statemachine.worlds import make_worlds
from statemachine.worlds import step as step_worlds

from .interleave import NULL, Ratio, interleaved

STEPS = 100
_LONG = 500  # of what begins anew each time
_N, _MANY = 64, 4096  # worlds


def step(name: str, rounds: int) -> list[Ratio]:
    """Compare `sm.step` with `mj_step`, one step at a time, of the same Data.

    Its place in memory counts.
    """
    model = sm.load(name)
    data = sm.make_data(model)
    raw_model, raw_data = model.raw, data.raw

    def raw() -> None:
        call = mujoco.mj_step
        for _ in range(STEPS):
            call(raw_model, raw_data)

    def interface() -> None:
        call = sm.step
        for _ in range(STEPS):
            call(model, data)

    return interleaved(raw, {f"sm.step, {name}": interface}, rounds)


def parts(name: str, rounds: int) -> list[Ratio]:
    """Compare the parts of a step: a call of Python's, exclusive access, the look at the warnings.

    The baseline is the engine's own step; the others add one thing each, to one Data.
    """
    model = sm.load(name)
    data = sm.make_data(model)

    def steps() -> None:
        advance, args = data._advance, (data._raw_model, data._raw)
        for _ in range(STEPS):
            advance(*args)

    def call(_model: sm.Model, data: sm.Data, _nstep: int = 1) -> None:
        data._advance(data._raw_model, data._raw)

    def called() -> None:
        for _ in range(STEPS):
            call(model, data)

    def exclusive() -> None:
        advance, args = data._advance, (data._raw_model, data._raw)
        owner = data._owner
        for _ in range(STEPS):
            me = get_ident()
            if data._model is model and not data._unusable and not owner.thread:
                owner.thread = me
                advance(*args)
                owner.thread = 0

    def watched() -> None:
        advance, args = data._advance, (data._raw_model, data._raw)
        for _ in range(STEPS):
            advance(*args)
            if data._pending_warnings != data._seen_warnings:
                data._raise_pending_warnings()

    added = {"the call": called, "exclusive access": exclusive, "the look at warnings": watched}
    named = {f"of it {words}, {name}": run for words, run in added.items()}
    return interleaved(steps, named, rounds)


def bulk(name: str, rounds: int) -> list[Ratio]:
    """Compare `sm.step(…, n)` with `mj_step(…, n)`."""
    model = sm.load(name)
    ours, theirs = sm.make_data(model), sm.make_data(model)
    return interleaved(
        lambda: mujoco.mj_step(model.raw, theirs.raw, STEPS),
        {f"sm.step in bulk, {name}": lambda: sm.step(model, ours, STEPS)},
        rounds,
    )


def control_loop(name: str, rounds: int) -> list[Ratio]:
    """Write ctrl, step, read a joint: the raw idiom against ours."""
    model = sm.load(name)
    ours, theirs = sm.make_data(model), sm.make_data(model)
    raw_model, raw_data = model.raw, theirs.raw
    target = np.zeros(model.nu)

    def raw() -> None:
        for _ in range(STEPS):
            raw_data.ctrl[:] = target
            mujoco.mj_step(raw_model, raw_data)
            _ = raw_data.qpos[1]

    def interface() -> None:
        for _ in range(STEPS):
            ours.ctrl[:] = target
            sm.step(model, ours)
            _ = ours.qpos[1]

    return interleaved(raw, {f"control loop, {name}": interface}, rounds)


def kinematics(name: str, rounds: int) -> list[Ratio]:
    """Compare a batch of poses by Pinocchio with a loop of `mj_kinematics`."""
    model = sm.load(name)
    witness = sm.Kinematics(name)
    data, tip = mujoco.MjData(model.raw), model.site_id("gripperframe")
    poses = np.random.default_rng(0).uniform(-1, 1, (_LONG, model.nq))

    def raw() -> None:
        positions, matrices = np.empty((_LONG, 3)), np.empty((_LONG, 9))
        qpos, pos, mat = data.qpos, data.site_xpos[tip], data.site_xmat[tip]
        for k in range(_LONG):
            qpos[:] = poses[k]
            mujoco.mj_kinematics(model.raw, data)
            positions[k] = pos
            matrices[k] = mat

    return interleaved(
        raw,
        {f"batch of poses by Pinocchio, {name}": lambda: witness.poses(poses, "gripperframe")},
        rounds,
    )


def recording(name: str, rounds: int) -> list[Ratio]:
    """Compare a recorded run with a bare loop with the same controller."""
    model = sm.load(name)
    bare, watched = sm.make_data(model), sm.make_data(model)
    target = np.array(_FLOOR)

    def controller(_model: sm.Model, _data: sm.Data) -> np.ndarray:
        return target

    def loop() -> None:
        for _ in range(_LONG):
            bare.ctrl[:] = controller(model, bare)
            sm.step(model, bare)

    def recorded() -> None:
        moments = drive(model, watched, controller, _LONG, once_more=True)
        recorder._run(model, watched, moments, _LONG, no_progress)

    return interleaved(loop, {f"recorded, {name}": recorded}, rounds)


_AIR = [0.0, -0.3, 0.6, 0.3, 0.0, 0.6]
_FLOOR = [0.0, -0.6, 1.2, 0.5, 0.0, 0.6]  # of `lesson hold`, where the finger meets the floor


def emulation(name: str, rounds: int, target: list[float]) -> list[Ratio]:
    """Compare a step of the emulated arm on PyBullet with the engine's own idiom in that world.

    All hold one pose; nothing derived is read.
    """
    model = sm.load(name, backend="pybullet")
    import pybullet

    ours, theirs = _holding(model, target), _holding(model, target)
    world = theirs.raw
    (arm,) = (tree for tree in world.trees if tree.joints)

    def engine() -> None:
        for _ in range(STEPS // 20):
            pybullet.setJointMotorControlArray(
                arm.body,
                arm.joints,
                pybullet.POSITION_CONTROL,
                targetPositions=target,
                physicsClientId=world.client,
            )
            pybullet.stepSimulation(world.client)

    def emulated() -> None:
        for _ in range(STEPS // 20):
            sm.step(model, ours)

    return interleaved(engine, {f"PyBullet, {name}, {_where(target)}": emulated}, rounds)


def _where(target: list[float]) -> str:
    return "floor" if target is _FLOOR else "air"


def _holding(model: sm.Model, target: list[float]) -> sm.Data:
    data = sm.make_data(model)
    data.ctrl[:] = target
    sm.step(model, data, 400)
    return data


def reading_emulated(name: str, rounds: int, target: list[float]) -> list[Ratio]:
    """Compare a step on PyBullet that is read, the fingertip or the contacts, with the step."""
    model = sm.load(name, backend="pybullet")

    def steps(read: Callable[[sm.Data], object]) -> Callable[[], None]:
        data = _holding(model, target)

        def run() -> None:
            for _ in range(STEPS // 20):
                sm.step(model, data)
                read(data)

        return run

    others = {
        f"PyBullet, {_where(target)}, tip read": steps(lambda data: data.site_xpos),
        f"PyBullet, {_where(target)}, contacts read": steps(lambda data: data.contacts),
    }
    return interleaved(steps(lambda _: None), others, rounds)


def looped(name: str, rounds: int, count: int, steps: int) -> list[Ratio]:
    """Compare worlds on PyBullet with as many Data stepped one after the other."""
    model = sm.load(name, backend="pybullet")
    singles = [sm.make_data(model) for _ in range(count)]

    def serial() -> None:
        for data in singles:
            sm.step(model, data, steps)

    with make_worlds(model, count, derived=()) as worlds:
        name = f"PyBullet, {count} worlds, {steps} steps"
        return interleaved(serial, {name: partial(step_worlds, worlds, steps)}, rounds // 5 + 1)


def freshness(name: str, rounds: int) -> list[Ratio]:
    """Measure what `sm.freshness` and a watch cost: nothing to a step when they are not in use.

    The baseline is `sm.step` on a Data that nobody ever asked; another one like it is a null
    of two Data. One was asked and watched before; the last is watched, and counted.
    """
    model = sm.load(name)
    never, null, before, watched = (sm.make_data(model) for _ in range(4))
    call = sm.step

    def steps(data: sm.Data) -> Callable[[], None]:
        def run() -> None:
            for _ in range(STEPS):
                call(model, data)

        return run

    sm.freshness(model, before)
    with sm.watch_freshness(model, before):
        call(model, before)
    with sm.watch_freshness(model, watched):
        others = {
            "another Data (null)": steps(null),
            "asked before": steps(before),
            "watched": steps(watched),
        }
        ratios = interleaved(
            steps(never),
            {f"sm.step, {words}, {name}": each for words, each in others.items()},
            rounds,
        )
    return ratios


def reading(name: str, rounds: int) -> list[Ratio]:
    """Step, forward and read the fingertip: by itself, and under a watch.

    With a stale read, each is computed anew beside: what that costs is the last.
    """
    model = sm.load(name)
    alone, watched, late = (sm.make_data(model) for _ in range(3))
    count = STEPS // 10

    def run(data: sm.Data, up_to_date: bool) -> Callable[[], None]:
        def each() -> None:
            for _ in range(count):
                sm.step(model, data)
                if up_to_date:
                    sm.forward(model, data)
                _ = data.site_xpos

        return each

    with sm.watch_freshness(model, watched), sm.watch_freshness(model, late):
        return interleaved(
            run(alone, True),
            {
                f"step, forward, read, watched, {name}": run(watched, True),
                f"step, stale read, watched, {name}": run(late, False),
            },
            rounds,
        )


def _worlds(name: str, rounds: int, workers: int) -> list[Ratio]:
    """Compare many worlds with a loop of bulk calls, one for each of as many MjData.

    The engine's own batch, on as many threads, tells what this machine can give.
    """
    model, steps = sm.load(name), 10
    data = [sm.make_data(model) for _ in range(_N)]
    raw_model, raws = model.raw, [each.raw for each in data]
    worlds = make_worlds(model, _N, workers=workers)
    batch, ids = mujoco.batch.Batch(raw_model, _N, workers), np.arange(_N)

    def loop() -> None:
        call = mujoco.mj_step
        for raw in raws:
            call(raw_model, raw, steps)

    threads = f"{workers} thread{'s' * (workers > 1)}"
    others = {
        f"{_N} worlds, {threads}, {name}": lambda: step_worlds(worlds, steps),
        f"mujoco.batch, {threads}": lambda: batch.step(ids, steps),
    }
    return interleaved(loop, others, rounds // 3 + 1)


def worlds_alone(name: str, rounds: int) -> list[Ratio]:
    """Compare many worlds on one thread with the loop of bulk calls."""
    return _worlds(name, rounds, 1)


def worlds_on_two(name: str, rounds: int) -> list[Ratio]:
    """Compare many worlds on two processors with the loop of bulk calls."""
    return _worlds(name, rounds, 2)


def worlds_memory(name: str, _rounds: int) -> list[Ratio]:
    """Measure the resident memory of a world [kB], with all derived arrays.

    Of a process of its own, twice: one that ran before has memory that can be used again.
    """
    code = f"""
import statemachine as sm
from statemachine.processes import resident_memory
from statemachine.worlds import make_worlds, step
model = sm.load({name!r})
kept, sizes = [], []
for n in (1, {_MANY}):
    kept.append(make_worlds(model, n))
    step(kept[-1])
    sizes.append(resident_memory())
print((sizes[1] - sizes[0]) / {_MANY} / 1000)
"""
    runs = [subprocess.run([sys.executable, "-c", code], stdout=-1, check=True) for _ in range(2)]
    size, null = (float(run.stdout) for run in runs)
    return [
        Ratio(NULL, null / size, null / size, null / size, 1),
        Ratio(f"kB a world of {_MANY}, {name}", size, size, size, 1),
    ]


def environments(name: str, rounds: int) -> list[Ratio]:
    """Compare a control step of 64 worlds of an example for Gymnasium with the engine's own batch.

    The baseline writes ctrl, steps and calls forward; the others observe and reward, too.
    """
    from examples import held_box, reach
    from statemachine.gym import make_env, make_vec

    n, workers = 64, 2
    task = {"reach": reach, "held box": held_box}[name].task()
    envs = make_vec(num_envs=n, workers=workers, **task)
    loop = [make_env(**task) for _ in range(n)]
    batch = mujoco.batch.Batch(envs.model.raw, n, workers)
    ctrl, ids = batch.bind("ctrl"), np.arange(n)
    actions = np.zeros((n, envs.model.nu), dtype=np.float32)
    envs.reset(seed=0)
    for world, env in enumerate(loop):
        env.reset(seed=world)
    envs.step(actions)
    commands = envs.worlds.ctrl.copy()

    def raw() -> None:
        ctrl[:] = commands
        batch.step(ids, task["frame_skip"])
        batch.forward(ids)

    def one_by_one() -> None:
        for env, action in zip(loop, actions, strict=True):
            if env.step(action)[3]:
                env.reset()

    others = {
        f"VectorEnv of {n}, {name}": lambda: envs.step(actions),
        f"loop of {n} Envs, {name}": one_by_one,
    }
    ratios = interleaved(raw, others, rounds // 6 + 1)
    for each in (envs, *loop):
        each.close()
    return ratios


def why_in_forks(name: str, rounds: int) -> list[Ratio]:
    """Compare 22 differences explained in two processes with one: `compare --why --jobs 2`."""
    left = sm.load(name)
    edits = [("body_mass", (k,), left.compiled.body_mass[k] * 1.05) for k in range(1, 5)]
    for field in ("dof_damping", "dof_armature", "dof_frictionloss"):
        values = getattr(left.compiled, field)
        edits += [(field, (k,), values[k] * 1.1 + 1e-3) for k in range(6)]
    right = built(left, tuple(edits))
    hold = scenario("hold")

    def explained(jobs: int) -> None:
        explain(WhyRequest(left, right, hold, seconds=1.0, finer=True, jobs=jobs))

    return interleaved(
        partial(explained, 1),
        {f"22 differences, 2 processes, {name}": partial(explained, 2)},
        rounds // 100 + 1,
    )


def in_a_row(model: sm.Model, data: sm.Data) -> None:
    """Make some calls of `STEPS`, as of a loop: the first one finds the other process asleep."""
    for _ in range(20):
        sm.step(model, data, STEPS)


def another_python(name: str, rounds: int) -> list[Ratio]:
    """Compare the installed release in a process of its own with itself in this one.

    The last lines are not ratios: what a call takes, with the tenth and the ninetieth percentile.
    """
    release = f"mujoco=={mujoco.__version__}"
    releases.add(release)
    here, there = sm.load(name), sm.load(name, backend=release)
    ours, theirs = sm.make_data(here), sm.make_data(there)
    ratios = interleaved(
        partial(in_a_row, here, ours),
        {f"in its process, {STEPS} steps a call, {name}": partial(in_a_row, there, theirs)},
        rounds // 3,
    )
    for steps in (1, STEPS):
        times = time_interleaved({"": partial(sm.step, there, theirs, steps)}, 10 * rounds)[""]
        low, median, high = np.percentile(times, [10, 50, 90]) * 1e6
        ratios.append(Ratio(f"µs a call of {steps}, 10 to 90 %", median, low, high, len(times)))
    return ratios


# At most this, measured on a quiet machine; of several figures that of the names with this word.
BUDGET: list[tuple[Callable[[str, int], list[Ratio]], str, float | None, str]] = [
    (step, "so101", 1.04, ""),
    (step, "so101/scene_box", 1.04, ""),
    (parts, "so101", None, ""),
    (parts, "so101/scene_box", None, ""),
    (bulk, "so101", 1.005, ""),
    (control_loop, "so101", 1.01, ""),
    (kinematics, "so101", 0.8, ""),
    (partial(emulation, target=_FLOOR), "so101/scene", 1.2, ""),
    (partial(emulation, target=_AIR), "so101/scene", 1.8, ""),
    (partial(reading_emulated, target=_FLOOR), "so101/scene", 1.5, "tip"),
    (partial(reading_emulated, target=_AIR), "so101/scene", 1.5, "tip"),
    *(
        (partial(looped, count=count, steps=steps), "so101/scene", None, "")
        for count in (2, 8)
        for steps in (1, 10, 100)
    ),
    (freshness, "so101", 1.02, "asked before"),
    (reading, "so101", None, ""),
    (recording, "so101", 1.10, ""),
    (another_python, "so101", 1.15, "in its process"),
    (worlds_memory, "so101", 3.0, ""),
    (worlds_alone, "so101", 1.03, "worlds"),
    (worlds_alone, "so101/scene_box", 1.03, "worlds"),
    (worlds_on_two, "so101", 1 / 1.9, "worlds"),
    (worlds_on_two, "so101/scene_box", 1 / 1.9, "worlds"),
    (environments, "reach", None, ""),
    (environments, "held box", None, ""),
    (why_in_forks, "so101", None, ""),
]


def main() -> None:
    """Print the measured ratios, and at the end those that are over their budget."""
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("--rounds", type=int, default=300, help="how often each is called")
    parser.add_argument("--only", default="", help="measure what has this in its name")
    options = parser.parse_args()
    print(
        f"statemachine {__version__}, MuJoCo {mujoco.__version__}, {options.rounds} rounds in turns"
    )
    print(_HEAD)
    over: list[str] = []
    for measure, name, budget, word in BUDGET:
        if options.only not in getattr(measure, "func", measure).__name__:
            continue
        for ratio in measure(name, options.rounds):
            limit = budget if ratio.name != NULL and word in ratio.name else None
            line = _line(ratio, limit)
            print(line)
            if limit is not None and ratio.median > limit:
                over.append(line)
    print("\n" + "\n".join(["over budget:", _HEAD, *over] if over else ["nothing is over budget"]))


_HEAD = f"{'':44}{'median':>8}{'middle half':>18}{'budget':>8}"


def _line(ratio: Ratio, budget: float | None) -> str:
    spread = f"{ratio.low:.3f} to {ratio.high:.3f}"
    limit = "" if budget is None else f"{budget:.3f}"
    return f"{ratio.name:44}{ratio.median:8.3f}{spread:>18}{limit:>8}".rstrip()


if __name__ == "__main__":
    main()
