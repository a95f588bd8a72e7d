"""Any robot for Gymnasium: its own checker, the bits of every world, faults."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

import statemachine as sm
from examples import held_box, reach
from statemachine.engines.pictures import renderer_here
from statemachine.errors import (
    BadInputError,
    ClosedDataError,
    DivergedWarning,
    UnknownNameError,
)
from statemachine.gym import RobotVectorEnv, Start, WorldView, joint_state, make_env, make_vec
from statemachine.show.drawing.scene import Camera

from .support.backends import each_of_both
from .support.claims import assert_has, refused
from .support.files import written
from .support.processes import runs_in_silence
from .support.requirements import ROOT
from .support.small_models import loaded, mjcf

pytestmark = pytest.mark.filterwarnings("error", "ignore:MotrixSim, of scene.*.xml. it ignores")

CART = """
<body name="cart"><joint name="rail" type="slide" axis="1 0 0" limited="true" range="-2 2"/>
  <geom type="box" size=".2 .1 .05" mass="1" contype="0" conaffinity="0"/>
  <body name="pole"><joint name="hinge" axis="0 1 0"/>
    <geom type="box" pos="0 0 .3" size=".03 .03 .3" mass=".1" contype="0" conaffinity="0"/>
    <site name="top" pos="0 0 .6"/></body></body>
"""
PUSH = (
    '<actuator><motor name="push" joint="rail" ctrllimited="true" ctrlrange="-10 20"/></actuator>'
)
KEY = '<keyframe><key name="left" qpos="-1 0.1" qvel="0 0.5"/></keyframe>'
STILL = np.zeros(1, dtype=np.float32)


def upright(world: WorldView) -> float:
    """Return a reward of what is derived."""
    return float(world.site_xpos[0, 2])


def fallen(world: WorldView) -> bool:
    return abs(world.qpos[1]) > 0.3


def start(model: sm.Model, rng: np.random.Generator) -> Start:
    qpos, qvel = rng.uniform(-0.05, 0.05, (2, model.nq))
    return Start(qpos, qvel, goal=rng.uniform(-1, 1))


def facts(world: WorldView) -> dict[str, Any]:
    return {"away": float(world.qpos[0] - world.goal), "fallen": fallen(world)}


BALANCE: dict[str, Any] = {
    "reward": upright,
    "reset": start,
    "terminated": fallen,
    "info": facts,
    "frame_skip": 5,
}


@pytest.fixture
def cart(backend: str, tmp_path: Path) -> sm.Model:
    """A cart with a pole, on every backend."""
    return loaded(tmp_path, CART, PUSH + KEY, backend=backend)


@pytest.fixture
def env(cart: sm.Model) -> Iterator[Any]:
    """It as an Env."""
    with closing(make_env(cart, **BALANCE)) as made:
        yield made


def tasks(backend: str, folder: Path) -> dict[str, dict[str, Any]]:
    """Return the cart and the arms of the examples, as arguments of `make_env`."""
    return {
        "cart": {"model": loaded(folder, CART, PUSH, backend=backend), **BALANCE},
        "reach": reach.task(backend),
        "held box": held_box.task(backend),
    }


TASKS = ("cart", "reach", "held box")


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_finds_no_fault(task: str, backend: str, tmp_path: Path) -> None:
    with closing(make_env(**tasks(backend, tmp_path)[task])) as made:
        check_env(made, skip_render_check=True)
        assert made.observation_space.dtype == np.float64
        assert made.action_space.dtype == np.float32


@pytest.mark.slow
def test_gymnasium_finds_no_fault_in_pictures(backend: str, tmp_path: Path) -> None:
    """Registered, as it is told of the render modes by a spec."""
    renderer_here()
    path = written(tmp_path / "cart.xml", mjcf(CART, PUSH))
    arguments = {"model": path, "backend": backend, **BALANCE}
    entry_point = "statemachine.gym:make_env"
    gymnasium.register("tests/Cart-v0", entry_point=entry_point, kwargs=arguments)
    try:
        with gymnasium.make("tests/Cart-v0", render_mode="rgb_array") as made:
            check_env(made.unwrapped)
            made.reset(seed=0)
            before: Any = made.render()
            for _ in range(10):
                made.step(np.ones(1, dtype=np.float32))
            assert before.shape == (360, 480, 3)
            assert before.std() > 5
            now: Any = made.render()
            assert not np.array_equal(before, now)
    finally:
        gymnasium.registry.pop("tests/Cart-v0")


@pytest.mark.slow
def test_each_world_has_its_picture_and_the_camera_is_as_told(tmp_path: Path) -> None:
    renderer_here()
    cart, side = loaded(tmp_path, CART, PUSH), Camera((0, 0, 0.3), 4, 90, -10)
    options: Any = {"render_mode": "rgb_array", "camera": side, **BALANCE}
    with closing(make_vec(cart, 2, **options)) as envs, closing(make_env(cart, **options)) as one:
        refused((ResetNeeded, "before render", envs.render), (ResetNeeded, "before", one.render))
        envs.reset(seed=3)
        one.reset(seed=4)
        pictures = envs.render()
        assert not np.array_equal(*pictures)
        assert np.array_equal(pictures[1], one.render())
        one.data.qvel[1] = np.nan
        assert one.step(STILL)[4] == {"diverged": True}
        assert np.array_equal(pictures[1], one.render())


def test_qpos_and_qvel_of_the_default_state_are_observed_unless_told_otherwise(
    cart: sm.Model,
) -> None:
    with closing(make_env(cart, upright)) as made:
        observation, info = made.reset(seed=1)
    assert np.array_equal(observation, np.zeros(4))
    assert info == {"diverged": False}


def test_no_episode_ends_unless_told_otherwise(cart: sm.Model) -> None:
    with closing(make_env(cart, upright)) as made:
        made.reset(seed=1)
        _, reward, terminated, truncated, _ = made.step(STILL)
    assert (reward, terminated, truncated) == (pytest.approx(0.6), False, False)


def test_a_step_is_a_timestep_unless_told_otherwise(cart: sm.Model) -> None:
    with closing(make_env(cart, upright)) as made:
        made.reset(seed=1)
        made.step(STILL)
        assert made.data.time == pytest.approx(cart.timestep)
        assert made.metadata["render_fps"] == round(1 / cart.timestep)


def test_nothing_is_rendered_unless_told_otherwise(cart: sm.Model) -> None:
    with closing(make_env(cart, upright)) as made:
        made.reset(seed=1)
        assert made.render() is None


def test_an_observation_is_of_the_present(env: Any) -> None:
    """What is derived is that of the qpos beside it, not that of a timestep before."""
    env.reset(seed=1)
    observation, reward, *_ = env.step(np.ones(1, dtype=np.float32))
    with sm.make_data(env.model) as data:
        data.qpos[:] = observation[:2]
        sm.forward(env.model, data)
        assert reward == data.site_xpos[0, 2]
    assert env.data.time == pytest.approx(5 * env.model.timestep)
    assert reward != pytest.approx(0.6, abs=1e-9)


@pytest.mark.parametrize(("action", "ctrl"), [(-1, -10), (1, 20), (0, 5), (3, 20)])
def test_an_action_is_a_command_within_its_range(env: Any, action: float, ctrl: float) -> None:
    env.reset(seed=0)
    env.step(np.full(1, action, dtype=np.float32))
    assert env.data.ctrl[0] == pytest.approx(ctrl)


def test_a_range_of_commands_can_be_asked_for(env: Any) -> None:
    with closing(make_env(env.model, upright, ctrl_range=[[-1, 3]])) as narrow:
        narrow.reset()
        narrow.step(STILL)
        assert narrow.data.ctrl[0] == 1


def pushed_start(model: sm.Model, rng: np.random.Generator) -> Start:
    return Start(qvel=[2.0, 0.0])


@pytest.mark.parametrize(
    ("options", "qvel"), [({}, [0, 0.5]), ({"reset": pushed_start}, [2, 0])], ids=["", "pushed"]
)
def test_a_keyframe_is_the_start_that_reset_adds_to(
    options: dict[str, Any], qvel: list[float], cart: sm.Model
) -> None:
    with closing(make_env(cart, upright, keyframe="left", **options)) as made:
        assert made.reset()[0].tolist() == [-1, 0.1, *qvel]


@pytest.fixture
def seen(cart: sm.Model) -> Iterator[tuple[WorldView, WorldView, Any]]:
    """What a function was given in a step of an Env, of an Env of two worlds, and the first."""
    views: list[WorldView] = []

    def keep(world: WorldView) -> float:
        views.append(world)
        return 0.0

    with closing(make_env(cart, keep)) as made, closing(make_vec(cart, 2, keep)) as envs:
        made.reset()
        envs.reset()
        made.step(STILL)
        of_one = views[-1]
        envs.step(np.zeros((2, 1), dtype=np.float32))
        yield of_one, views[-1], made


READABLE = [name for name in vars(WorldView) if isinstance(vars(WorldView)[name], property)]


def test_a_world_has_13_attributes_to_read() -> None:
    assert len(READABLE) == 13


@each_of_both
@pytest.mark.parametrize("name", READABLE)
def test_what_a_function_reads_is_that_of_the_data(
    name: str, seen: tuple[WorldView, WorldView, Any]
) -> None:
    of_one, of_several, made = seen
    expected = getattr(made.data, name)
    assert np.array_equal(getattr(of_one, name), expected)
    assert np.array_equal(getattr(of_several, name), expected)


@pytest.mark.parametrize("name", ["qpos", "xpos"])
def test_what_a_function_reads_cannot_be_written(
    name: str, seen: tuple[WorldView, WorldView, Any]
) -> None:
    for world in seen[:2]:
        assert not getattr(world, name).flags.writeable


@pytest.mark.parametrize("name", ["qpos", "goal"])
def test_what_is_read_of_an_env_cannot_be_written(
    name: str, seen: tuple[WorldView, WorldView, Any]
) -> None:
    assert not getattr(seen[2].world, name).flags.writeable


# One way of each to start anew is quick enough for every run of the tests.
_QUICK = ("cart", AutoresetMode.NEXT_STEP, 2)


@pytest.mark.parametrize(
    ("task", "mode", "workers"),
    [
        pytest.param(*case, marks=() if case == _QUICK else pytest.mark.slow)
        for case in itertools.product(TASKS, AutoresetMode, (1, 2, 3))
        if case[0] == "cart" or case[2] == 2  # three worlds on two workers, of one task the others
    ],
)
def test_a_world_is_a_single_env_bit_for_bit(
    task: str, mode: AutoresetMode, workers: int, backend: str, tmp_path: Path
) -> None:
    """Ours against Gymnasium's own loop over single ones, in every way to start anew."""
    arguments = {**tasks(backend, tmp_path)[task], "max_episode_steps": 9}
    ours = make_vec(num_envs=3, workers=workers, autoreset_mode=mode, **arguments)
    theirs = SyncVectorEnv(3 * [partial(make_env, **arguments)], autoreset_mode=mode)
    assert_has(
        ours,
        metadata=theirs.metadata,
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
def test_processes_of_gymnasium_give_the_same_bits(backend: str, tmp_path: Path) -> None:
    path = written(tmp_path / "cart.xml", mjcf(CART, PUSH))
    single = partial(make_env, path, backend=backend, **BALANCE)
    theirs = AsyncVectorEnv(2 * [single], context="spawn")
    ours = make_vec(path, 2, backend=backend, **BALANCE)
    with closing(ours), closing(theirs):
        assert data_equivalence(ours.reset(seed=3), theirs.reset(seed=3), exact=True)
        for _ in range(5):
            actions = ours.action_space.sample()
            assert data_equivalence(ours.step(actions), theirs.step(actions), exact=True)


@dataclass(frozen=True)
class DivergedStep:
    """A step in which one of several worlds diverged.

    Attributes:
        envs: The worlds.
        first: Observations after the reset before, shape (n, k).
        observations, rewards, terminated, truncated, infos: What the step returned.
        is_same: Whether a world starts anew in the step in which its episode ended.
    """

    envs: Any
    first: np.ndarray
    observations: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    infos: dict[str, Any]
    is_same: bool


@pytest.fixture(params=["NextStep", "SameStep"])
def diverged(request: pytest.FixtureRequest, cart: sm.Model) -> Iterator[DivergedStep]:
    """Three worlds of which the second diverged in a step, in two ways to start anew."""
    envs = make_vec(cart, 3, autoreset_mode=request.param, **BALANCE)
    with warnings.catch_warnings(action="error", category=DivergedWarning), closing(envs):
        first, _ = envs.reset(seed=0)
        envs.worlds.qvel[1] = 1e12
        ended = envs.step(np.zeros((3, 1), dtype=np.float32))
        yield DivergedStep(envs, first, *ended, is_same=request.param == "SameStep")


def test_a_world_that_diverges_is_truncated_and_no_other(diverged: DivergedStep) -> None:
    assert diverged.truncated.tolist() == [False, True, False]
    assert not diverged.terminated.any()


def test_what_is_observed_of_a_world_that_diverged_is_finite(diverged: DivergedStep) -> None:
    assert np.isfinite(diverged.observations).all()
    assert np.isfinite(diverged.rewards).all()
    assert diverged.is_same or diverged.rewards[1] == 0


def test_the_last_observation_of_a_world_that_diverged_is_the_one_before(
    diverged: DivergedStep,
) -> None:
    if diverged.is_same:
        info, last = diverged.infos["final_info"], diverged.infos["final_obs"]
    else:
        info, last = diverged.infos, diverged.observations
    assert info["diverged"].tolist() == [False, True, False]
    assert np.array_equal(last[1], diverged.first[1])


def test_a_world_that_diverged_starts_anew_and_the_others_go_on(diverged: DivergedStep) -> None:
    envs = diverged.envs
    after, _, _, truncated, infos = envs.step(np.zeros((3, 1), dtype=np.float32))
    assert not truncated.any()
    assert not infos["diverged"].any()
    assert not envs.worlds.diverged
    assert (after != diverged.first).any(axis=1).all()


def huge_when_pushed(world: WorldView) -> np.ndarray:
    return np.array([1e11 * (world.ctrl[0] > 6)])


@pytest.mark.parametrize("leaves", [False, True])
def test_one_that_diverges_or_leaves_the_space_is_truncated(leaves: bool, cart: sm.Model) -> None:
    observe: Any = huge_when_pushed if leaves else joint_state
    with closing(make_env(cart, observe=observe, **BALANCE)) as made:
        first, _ = made.reset(seed=0)
        if not leaves:
            made.data.qvel[1] = 1e12
        pushed = np.ones(1, dtype=np.float32)
        after, reward, terminated, truncated, info = made.step(pushed)
        assert (reward, terminated, truncated, info) == (0, False, True, {"diverged": True})
        assert np.array_equal(after, first)
        made.reset(seed=0)
        assert not made.step(STILL)[3]


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
def test_no_command_within_the_ranges_diverges(task: str, backend: str, tmp_path: Path) -> None:
    """The hardest ones: from end to end of every joint."""
    with closing(make_env(**tasks(backend, tmp_path)[task])) as made:
        rng = np.random.default_rng(0)
        for seed in range(6):
            made.reset(seed=seed)
            actions = rng.choice([-1.0, 1.0], (8, made.model.nu)).astype(np.float32)
            for k in range(60):
                observation, _, terminated, truncated, info = made.step(actions[k // 8])
                assert observation in made.observation_space
                assert not info["diverged"]
                if terminated or truncated:
                    break


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"reward": lambda _: np.nan}, r"reward\(world\) = nan is not a finite number"),
        ({"reward": lambda world: world.qpos}, r"reward\(world\) must be one number; .*\(2,\)"),
        ({"reward": lambda _: None}, r"reward\(world\) must be real numbers"),
        ({"reward": 1.0}, "reward must be a function; got 1.0"),
        ({"observe": lambda _: [1, np.inf]}, r"observe\(world\)\[1\] = inf is not a finite"),
        ({"observe": lambda _: "far"}, r"observe\(world\) must be real numbers; got 'far'"),
        ({"terminated": lambda _: 1}, r"terminated\(world\) must be True or False; got 1"),
        ({"info": lambda _: [1]}, r"info\(world\) must return a dict; got \[1\]"),
        ({"reset": lambda model, rng: [0, 0]}, r"must return a Start; got \[0, 0\]"),
        ({"reset": lambda model, rng: Start([0, 0, 0])}, r"qpos takes 2 numbers.*\(3,\)"),
        ({"reset": lambda model, rng: Start(qvel=[0, np.nan])}, r"qvel\[1\] = nan"),
        ({"reset": lambda model, rng: Start(goal=np.inf)}, r"goal = inf"),
        ({"keyframe": "lift"}, "no keyframe named 'lift'.*'left'"),
        ({"frame_skip": 0}, "frame_skip must be a whole number"),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number"),
        ({"ctrl_range": [1, 2]}, r"ctrl_range takes .*shape \(1, 2\)"),
        ({"ctrl_range": [[2, 2]]}, "'push' must go up from action -1 to 1; got 2 and 2"),
        ({"ctrl_range": [[0, np.inf]]}, "inf is not a finite number"),
        ({"render_mode": "human"}, "no render mode named 'human'"),
        ({"backend": "pybullet"}, "leave backend= out"),
        ({"num_envs": 0}, "num_envs must be a whole number"),
        ({"num_envs": 2, "autoreset_mode": "Never"}, "no autoreset mode named 'Never'"),
    ],
)
def test_what_nothing_can_be_made_of_is_one_clear_line(
    options: Any, says: str, tmp_path: Path
) -> None:
    make: Any = make_vec if "num_envs" in options else make_env
    arguments = {"model": loaded(tmp_path, CART, PUSH + KEY), "reward": upright, **options}
    refused(((BadInputError, UnknownNameError), says, lambda: make(**arguments)))


def test_a_backend_is_named_with_a_file() -> None:
    refused((UnknownNameError, "Did you mean", lambda: make_env("so101", upright, backend="mjc")))


@pytest.mark.parametrize(
    ("actuators", "says"),
    [
        ("", r"m\.xml has no actuators"),
        ('<actuator><motor name="m" joint="rail"/></actuator>', "'m' has no ctrlrange: give ctrl_"),
    ],
)
def test_a_model_without_commands_between_bounds_is_refused(
    actuators: str, says: str, cart: sm.Model, tmp_path: Path
) -> None:
    model = loaded(tmp_path, CART, actuators, backend=cart.backend)
    refused((BadInputError, says, lambda: make_env(model, upright)))


def after(calls: int, first: Any, then: Any) -> Callable[[WorldView], Any]:
    """Return a function that returns something else from a call on."""
    seen = itertools.count()
    return lambda _: first if next(seen) < calls else then


@pytest.mark.parametrize(
    ("name", "first", "then", "says"),
    [
        ("observe", [1.0, 2.0], [1.0], r"observe\(world\) must always have .*\(2,\); got \(1,\)"),
        ("observe", [1.0], [np.nan], r"observe\(world\)\[0\] = nan"),
        ("reward", 1.0, np.inf, r"reward\(world\) = inf"),
        ("terminated", False, None, r"terminated\(world\) must be True or False; got None"),
        ("info", {}, None, r"info\(world\) must return a dict; got None"),
    ],
)
def test_what_a_function_returns_later_is_checked_too(
    name: str, first: Any, then: Any, says: str, cart: sm.Model
) -> None:
    makes: list[Any] = [make_env, partial(make_vec, num_envs=2)]
    for make, action in zip(makes, (STILL, np.zeros((2, 1))), strict=True):
        options = {"reward": upright, name: after(12, first, then)}
        with closing(make(cart, **options)) as made:

            def steps(made: Any = made, action: Any = action) -> None:
                made.reset(seed=0)
                for _ in range(12):
                    made.step(action)

            refused((BadInputError, says, steps))


def test_faults_are_one_clear_line(env: Any) -> None:
    envs = make_vec(env.model, 2, **BALANCE)
    for each, action in ((env, STILL), (envs, np.tile(STILL, (2, 1)))):
        refused((ResetNeeded, "call reset before step", partial(each.step, action)))
        each.reset(seed=0)
        bad, nan = action.copy(), r"action\[\d+\] = nan is not a finite number"
        bad[..., 0] = np.nan
        commanded = env.data if each is env else envs.worlds
        before = commanded.ctrl.copy()
        refused(
            (BadInputError, r"action takes .* got shape \(5,\)", partial(each.step, np.zeros(5))),
            (BadInputError, nan, partial(each.step, bad)),
        )
        # The engine never saw it: the next step is as if nothing had been.
        assert np.array_equal(commanded.ctrl, before)
        assert np.isfinite(each.step(action)[0]).all()
    refused(
        (BadInputError, "seed takes 2 seeds", lambda: envs.reset(seed=[1, 2, 3])),
        (
            BadInputError,
            "reset_mask takes 2 bools",
            lambda: envs.reset(options={"reset_mask": np.array([False, False])}),
        ),
    )
    envs.close()


def test_an_ended_world_must_be_reset_where_nobody_else_does(tmp_path: Path) -> None:
    cart = loaded(tmp_path, CART, PUSH)
    options: Any = {"autoreset_mode": "Disabled", "max_episode_steps": 1, **BALANCE}
    with closing(make_vec(cart, 2, **options)) as envs:
        envs.reset(seed=0)
        actions = np.zeros((2, 1), dtype=np.float32)
        envs.step(actions)
        refused((ResetNeeded, r"worlds \[0, 1\] have ended", lambda: envs.step(actions)))


def test_without_gymnasium_the_extra_is_named() -> None:
    runs_in_silence(
        "import sys; sys.modules['gymnasium'] = None\n"
        "try:\n    import statemachine.gym\n"
        "except ImportError as error:\n    print(type(error).__name__, error)\n",
        ROOT,
        "MissingEngineError statemachine.gym needs Gymnasium: python -m pip install -e '.[gym]'\n",
    )


def test_what_is_closed_says_so_and_starts_nothing(tmp_path: Path) -> None:
    """A picture of a closed environment would start a process that nobody ends."""
    cart = loaded(tmp_path, CART, PUSH)
    env = make_env(cart, upright, render_mode="rgb_array")
    envs = make_vec(cart, 1, upright, render_mode="rgb_array")
    for each, actions in ((env, np.zeros(1)), (envs, np.zeros((1, 1)))):
        each.reset(seed=0)
        each.close()
        each.close()  # twice is as good as once
        refused(
            (ClosedDataError, "closed: make", each.render),
            (ClosedDataError, "closed: make", partial(each.step, actions)),
        )


def test_seeds_may_be_an_array_of_numbers(tmp_path: Path) -> None:
    with closing(make_vec(loaded(tmp_path, CART, PUSH), 2, **BALANCE)) as envs:
        assert isinstance(envs, RobotVectorEnv)
        seeds: list[Any] = [[3, 4], np.array([3, 4])]
        listed, as_array = (envs.reset(seed=seed)[0] for seed in seeds)
        assert np.array_equal(listed, as_array)


def test_what_info_gave_stays_as_it_was(tmp_path: Path) -> None:
    """A view of a Data that goes on would have the last value everywhere."""
    path = written(tmp_path / "cart.xml", mjcf(CART, PUSH))
    given: dict[str, Any] = {**BALANCE, "info": lambda world: {"qpos": world.qpos}}
    with closing(make_env(path, **given)) as env:
        env.reset(seed=0)
        told = [env.step(np.ones(1, dtype=np.float32))[4]["qpos"] for _ in range(3)]
    assert not np.array_equal(told[0], told[2])


def test_an_episode_starts_within_the_bounds(tmp_path: Path) -> None:
    path = written(tmp_path / "cart.xml", mjcf(CART, PUSH))
    given: dict[str, Any] = {**BALANCE, "observe": lambda _world: [1e11]}
    refused((BadInputError, "within", lambda: make_env(path, **given)))
