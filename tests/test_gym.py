"""The tasks for Gymnasium: its own checker, the bits of every world, policies, faults."""

from __future__ import annotations

import itertools
import warnings
from contextlib import closing
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode

import statemachine as sm
import statemachine.gym  # registers the tasks
from statemachine.engines.pictures import renderer_here
from statemachine.errors import (
    BadInputError,
    ClosedDataError,
    DivergedWarning,
    UnknownNameError,
)
from statemachine.gym.env import CAMERA, SIZE
from statemachine.gym.policies import play, random_policy, scripted_policy
from statemachine.gym.tasks import TASKS, HeldBox, Reach
from statemachine.gym.vector import ArmVectorEnv

from .conftest import ROOT, assert_has, refused, runs_in_silence
from .rendering import seen_by

IDS = [task.id for task in TASKS.values()]
REACH, HELD_BOX = IDS
pytestmark = pytest.mark.filterwarnings("error")


def _make(task: str, backend: str, **options: Any) -> Any:
    return gymnasium.make(task, backend=backend, **options)


def _make_vec(task: str, backend: str, num_envs: int, **options: Any) -> Any:
    return gymnasium.make_vec(task, num_envs=num_envs, backend=backend, **options)


@pytest.mark.parametrize("task", IDS)
def test_gymnasium_finds_no_fault(task: str, backend: str) -> None:
    with _make(task, backend) as env:
        check_env(env.unwrapped, skip_render_check=True)
        assert env.observation_space.dtype == np.float64
        assert env.action_space.dtype == np.float32


@pytest.mark.slow
@pytest.mark.parametrize("task", IDS)
def test_gymnasium_finds_no_fault_in_pictures(task: str, backend: str) -> None:
    renderer_here()
    with _make(task, backend, render_mode="rgb_array") as env:
        check_env(env.unwrapped)
        env.reset(seed=0)
        before = env.render()
        for _ in range(10):
            env.step(env.action_space.sample())
        assert before.shape == (360, 480, 3)
        assert before.std() > 10
        assert not np.array_equal(before, env.render())


@pytest.mark.slow
@pytest.mark.parametrize("task", IDS)
def test_the_target_is_in_the_picture(task: str) -> None:
    """A violet ball where the target is, and nowhere else; in each world its own."""
    renderer_here()
    with closing(_make_vec(task, "mujoco", 2, render_mode="rgb_array")) as envs:
        seen, _ = envs.reset(seed=1)
        for picture, target in zip(envs.render(), seen[:, -6:-3], strict=True):
            x, y = seen_by(CAMERA, target[None], SIZE[0] / SIZE[1])[0]
            column, row = np.round((np.array([x, -y]) + 1) / 2 * SIZE - 0.5).astype(int)
            red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
            violet = (blue > green + 25) & (red > green + 10)
            rows, columns = np.nonzero(violet)
            assert violet[row - 1 : row + 2, column - 1 : column + 2].all()
            assert np.hypot(rows - row, columns - column).max() < 20
    with _make(task, "mujoco", render_mode="rgb_array") as env:
        refused((ResetNeeded, "before render", env.unwrapped.render))


def test_an_observation_is_of_the_present(backend: str) -> None:
    """The fingertip is that of the qpos beside it, not that of a timestep before."""
    with _make(REACH, backend) as env, sm.make_data(env.unwrapped.model) as data:
        env.reset(seed=1)
        seen, reward, _, _, info = env.step(np.ones(6, dtype=np.float32))
        model = env.unwrapped.model
        data.qpos[:] = seen[:6]
        sm.forward(model, data)
        tip = data.site_xpos[model.site_id("gripperframe")]
        assert np.array_equal(seen[12:15], tip)
        assert np.array_equal(seen[18:21], seen[15:18] - tip)
        assert np.abs(seen[6:12]).max() > 0.5
        assert info["distance"] == pytest.approx(np.linalg.norm(seen[18:21]), rel=1e-12)
        assert reward == -info["distance"]


def test_actions_are_commands(backend: str) -> None:
    with _make(REACH, backend) as env:
        env.reset(seed=0)
        low, high = env.unwrapped.model.actuator_ctrlrange.T
        for action, ctrl in ((-1, low), (1, high), (0, (low + high) / 2)):
            env.step(np.full(6, action, dtype=np.float32))
            assert np.allclose(env.unwrapped.data.ctrl, ctrl, atol=1e-12)
    task = HeldBox(backend, 4)
    held = task.model.keyframes[0].ctrl
    assert np.array_equal(task.ctrl(np.zeros(6), (6,)), held)
    assert np.array_equal(task.ctrl(np.full(6, 2.0), (6,)), task.ctrl(np.ones(6), (6,)))
    away = np.array([0.3, -0.2, 0.1, 0.0, 0.1, 0.05])
    assert np.allclose(task.ctrl(task.action(held + away), (6,)), held + away, atol=1e-7)


def test_targets_can_be_reached_and_are_the_same_on_every_backend(backend: str) -> None:
    for kind in (Reach, HeldBox):
        here, there = kind(backend, 4), kind("mujoco", 4)
        for seed in range(20):
            one, two = (task.start(np.random.default_rng(seed))[1] for task in (here, there))
            assert np.array_equal(one, two)
            assert 0.03 < one[2] < 0.6
    with _make(HELD_BOX, backend) as env:
        seen, info = env.reset(seed=4)
        assert 0.04 < info["distance"] < 0.4
        assert np.array_equal(seen[:13], env.unwrapped.model.keyframes[0].qpos)


def test_the_box_is_held_by_the_action_0_and_dropped_by_open_jaws(backend: str) -> None:
    with _make(HELD_BOX, backend) as env:
        env.reset(seed=0)
        for _ in range(40):
            _, reward, terminated, truncated, info = env.step(np.zeros(6, dtype=np.float32))
            assert (terminated, truncated, reward) == (False, False, 1 - info["distance"])
        steps, terminated, reward, info = 0, False, 0.0, {}
        while not terminated:
            _, reward, terminated, truncated, info = env.step(np.eye(6, dtype=np.float32)[5])
            steps += 1
            assert steps < 60
        assert_has(info, distance=-reward, is_success=False, diverged=False)


# One way of each to start anew is quick enough for every run of the tests.
_QUICK = (REACH, AutoresetMode.NEXT_STEP, 2)


@pytest.mark.parametrize(
    ("task", "mode", "workers"),
    [
        pytest.param(*case, marks=() if case == _QUICK else pytest.mark.slow)
        for case in itertools.product(IDS, AutoresetMode, (1, 2, 3))
    ],
)
def test_a_world_is_a_single_env_bit_for_bit(
    task: str, mode: AutoresetMode, workers: int, backend: str
) -> None:
    """Ours against Gymnasium's own loop over single ones, in every way to start anew."""
    ours = _make_vec(task, backend, 3, workers=workers, autoreset_mode=mode, max_episode_steps=9)
    theirs = _make_vec(
        task, backend, 3, vectorization_mode="sync", max_episode_steps=9,
        vector_kwargs={"autoreset_mode": mode},
    )  # fmt: skip
    assert isinstance(ours, ArmVectorEnv)
    assert ours.metadata["autoreset_mode"] is mode
    assert_has(
        ours,
        single_observation_space=theirs.single_observation_space,
        observation_space=theirs.observation_space,
        action_space=theirs.action_space,
    )
    with closing(ours), closing(theirs):
        assert data_equivalence(ours.reset(seed=3), theirs.reset(seed=3), exact=True)
        ours.action_space.seed(0)
        ended = 0
        for _ in range(30):
            actions = ours.action_space.sample()
            one, two = ours.step(actions), theirs.step(actions)
            assert data_equivalence(one, two, exact=True)
            over = one[2] | one[3]
            ended += int(over.sum())
            if mode is AutoresetMode.DISABLED and over.any():
                again = [each.reset(seed=[7, None, 2], options={"reset_mask": over.copy()})
                         for each in (ours, theirs)]  # fmt: skip
                assert data_equivalence(*again, exact=True)
        seeds: Any = ours.np_random_seed
        assert tuple(seeds) == theirs.np_random_seed
        assert data_equivalence(ours.reset(), theirs.reset(), exact=True)
    assert ended >= 6


@pytest.mark.slow
def test_processes_of_gymnasium_have_the_same_bits(backend: str) -> None:
    make = partial(gymnasium.make, f"statemachine.gym:{REACH}", backend=backend)
    with (
        closing(gymnasium.vector.AsyncVectorEnv([make] * 2, context="spawn")) as theirs,
        closing(_make_vec(REACH, backend, 2)) as ours,
    ):
        assert data_equivalence(ours.reset(seed=3), theirs.reset(seed=3), exact=True)
        ours.action_space.seed(0)
        for _ in range(5):
            actions = ours.action_space.sample()
            assert data_equivalence(ours.step(actions), theirs.step(actions), exact=True)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_world_that_diverges_starts_anew_and_the_others_go_on(mode: str, backend: str) -> None:
    envs = _make_vec(REACH, backend, 3, autoreset_mode=mode)
    with warnings.catch_warnings(action="error", category=DivergedWarning), closing(envs):
        seen, _ = envs.reset(seed=0)
        still = np.zeros((3, 6), dtype=np.float32)
        envs.worlds.qvel[1] = 1e12
        after, rewards, terminated, truncated, infos = envs.step(still)
        assert truncated.tolist() == [False, True, False]
        assert not terminated.any()
        assert np.isfinite(after).all()
        assert np.isfinite(rewards).all()
        same = mode == "SameStep"
        final, last = (infos["final_info"], infos["final_obs"]) if same else (infos, after)
        assert final["diverged"].tolist() == [False, True, False]
        assert np.array_equal(last[1], seen[1])
        after, _, _, truncated, infos = envs.step(still)
        assert not truncated.any()
        assert not infos["diverged"].any()
        assert not envs.worlds.diverged
        assert (after != seen).any(axis=1).all()


@pytest.mark.parametrize(("name", "value"), [("qvel", 1e12), ("qpos", 5.0)])
def test_one_that_diverges_or_leaves_the_space_is_truncated(
    name: str, value: float, backend: str
) -> None:
    with _make(REACH, backend) as env:
        seen, _ = env.reset(seed=0)
        getattr(env.unwrapped.data, name)[1] = value  # a position beyond its range is finite
        still = np.zeros(6, dtype=np.float32)
        after, reward, terminated, truncated, info = env.step(still)
        assert (terminated, truncated, info["diverged"]) == (False, True, True)
        assert np.array_equal(after, seen)
        assert np.isfinite(reward)
        env.reset(seed=0)
        assert not env.step(still)[3]


@pytest.mark.slow
@pytest.mark.parametrize("task", IDS)
def test_no_command_within_the_ranges_leaves_the_space(task: str, backend: str) -> None:
    """The hardest ones: from end to end of every joint."""
    with _make(task, backend) as env:
        rng = np.random.default_rng(0)
        for seed in range(6):
            env.reset(seed=seed)
            actions = rng.choice([-1.0, 1.0], (8, 6)).astype(np.float32)
            for k in range(60):
                seen, _, terminated, truncated, info = env.step(actions[k // 8])
                assert seen in env.observation_space
                assert not info["diverged"]
                if terminated or truncated:
                    break


@pytest.mark.slow
@pytest.mark.parametrize("task", IDS)
@pytest.mark.usefixtures("pinocchio")
def test_the_scripted_policy_comes_within_a_centimetre(task: str, backend: str) -> None:
    with closing(_make_vec(task, backend, 16)) as envs:
        scripted = play(envs, scripted_policy(envs.task), 100)
        chance = play(envs, random_policy(envs.task, 0), 100)
    assert (scripted.distance < 0.01).sum() >= 11
    assert (chance.distance < 0.01).sum() <= 2
    assert scripted.returned.mean() > chance.returned.mean() + 20
    assert not scripted.diverged.any()
    assert (scripted.steps == envs._most).all()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_an_episode_is_the_same_however_the_next_one_starts(mode: str) -> None:
    runs, zero = [], np.zeros((4, 6), dtype=np.float32)
    for each in ("NextStep", mode):
        how: Any = {"autoreset_mode": each, "max_episode_steps": 6}
        with closing(_make_vec(HELD_BOX, "mujoco", 4, **how)) as envs:
            runs.append(play(envs, lambda _seen: zero, 0))
    for name in ("returned", "distance", "success", "steps", "diverged"):
        assert np.array_equal(*(getattr(run, name) for run in runs))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"backend": "mujcoo"}, r"no backend named 'mujcoo'.*Did you mean"),
        ({"backend": "mujcoo", "num_envs": 2}, "no backend named"),
        ({"task": "reech"}, r"no task named 'reech'.*'reach'"),
        ({"task": ["reach"]}, "no task named"),
        ({"autoreset_mode": "Never", "num_envs": 2}, "no autoreset mode named 'Never'"),
        ({"frame_skip": 0}, "frame_skip must be a whole number"),
        ({"num_envs": 0}, "num_envs must be a whole number"),
    ],
)
def test_what_nothing_can_be_made_of_is_one_clear_line(options: Any, says: str) -> None:
    make: Any = gymnasium.make_vec if "num_envs" in options else gymnasium.make
    refused(((BadInputError, UnknownNameError), says, lambda: make(REACH, **options)))


def test_faults_are_one_clear_line(backend: str) -> None:
    env, envs = _make(REACH, backend).unwrapped, _make_vec(REACH, backend, 2)
    still = np.zeros(6, dtype=np.float32)
    for each, action in ((env, still), (envs, np.tile(still, (2, 1)))):
        refused((ResetNeeded, "call reset before step", partial(each.step, action)))
        each.reset(seed=0)
        bad, nan = action.copy(), r"action\[\d+\] = nan is not a finite number"
        bad[..., 2] = np.nan
        commanded = env.data if each is env else envs.worlds
        before = commanded.ctrl.copy()
        refused(
            (BadInputError, r"action wants .* got shape \(5,\)", partial(each.step, still[:5])),
            (BadInputError, nan, partial(each.step, bad)),
        )
        # The engine never saw it: the next step is as if nothing had been.
        assert np.array_equal(commanded.ctrl, before)
        assert np.isfinite(each.step(action)[0]).all()
    refused(
        (BadInputError, "seed wants 2 seeds", lambda: envs.reset(seed=[1, 2, 3])),
        (
            BadInputError,
            "reset_mask wants 2 bools",
            lambda: envs.reset(options={"reset_mask": np.array([False, False])}),
        ),
    )
    env.close()
    envs.close()


def test_an_ended_world_must_be_reset_where_nobody_else_does() -> None:
    with closing(
        _make_vec(REACH, "mujoco", 2, autoreset_mode="Disabled", max_episode_steps=1)
    ) as envs:
        envs.reset(seed=0)
        actions = np.zeros((2, 6), dtype=np.float32)
        envs.step(actions)
        refused((ResetNeeded, r"worlds \[0, 1\] have ended", lambda: envs.step(actions)))


def test_without_gymnasium_the_extra_is_named() -> None:
    runs_in_silence(
        "import sys; sys.modules['gymnasium'] = None\n"
        "try:\n    import statemachine.gym\n"
        "except ImportError as error:\n    print(type(error).__name__, error)\n",
        ROOT,
        "MissingEngineError the tasks need Gymnasium: pip install 'statemachine-sim[gym]'\n",
    )


def test_what_is_closed_says_so_and_starts_nothing() -> None:
    """A picture of a closed environment would start a process that nobody ends."""
    env = gymnasium.make(REACH, render_mode="rgb_array").unwrapped
    envs = _make_vec(REACH, "mujoco", 1, render_mode="rgb_array")
    for each, actions in ((env, np.zeros(6)), (envs, np.zeros((1, 6)))):
        each.reset(seed=0)
        each.close()
        each.close()  # twice is as good as once
        refused(
            (ClosedDataError, "closed: make", each.render),
            (ClosedDataError, "closed: make", partial(each.step, actions)),
        )


def test_seeds_may_be_an_array_of_numbers() -> None:
    with closing(_make_vec(REACH, "mujoco", 2)) as envs:
        listed, as_array = (envs.reset(seed=seed)[0] for seed in ([3, 4], np.array([3, 4])))
        assert np.array_equal(listed, as_array)


def test_another_model_and_an_unknown_option_are_refused() -> None:
    for make in (partial(_make, REACH, "mujoco"), partial(_make_vec, REACH, "mujoco", 2)):
        refused(
            (BadInputError, "take no other model", lambda make=make: make(model="so101")),
            (UnknownNameError, "frame_skip", lambda make=make: make(frame_skp=2)),
        )
