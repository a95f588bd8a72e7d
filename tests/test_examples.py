"""The tasks under examples/ do what they say, on every backend."""

from __future__ import annotations

import re
from contextlib import closing
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from examples import held_box, reach
from examples.arm import TIP, Episodes, play
from statemachine.gym import make_env, make_vec

from .support.claims import assert_has
from .support.processes import of_python
from .support.requirements import need_engine

EXAMPLES = {"reach": reach, "held_box": held_box}
# Episodes that end within 1 cm, steps and reward of 16, by policy.
# Episodes that end within 1 cm, steps and reward of 16, by policy: random, and scripted.
PRINTS = {
    ("reach", "mujoco"): ((0, 100.0, -42.58), (15, 100.0, -6.72)),
    ("reach", "pybullet"): ((0, 100.0, -42.80), (15, 100.0, -6.73)),
    ("held_box", "mujoco"): ((0, 11.6, 9.68), (16, 150.0, 149.53)),
    ("held_box", "pybullet"): ((0, 21.8, 19.07), (16, 150.0, 149.53)),
}
_LINE = re.compile(r"(\d+) of 16.* ([\d.]+) steps, reward +(-?[\d.]+)$")


def figures_of(line: str) -> tuple[int, float, float]:
    """Return (episodes within 1 cm, mean steps, mean reward) of a line that an example prints."""
    found = _LINE.search(line)
    assert found, line
    return int(found[1]), float(found[2]), float(found[3])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "engine"), PRINTS)
def test_an_example_prints_a_line_of_each_policy(name: str, engine: str) -> None:
    """The scripted policy comes within a centimetre, and the random one does not."""
    need_engine(engine)
    need_engine("pinocchio")
    chance, scripted = of_python("-m", f"examples.{name}", engine, code=0).stdout.splitlines()
    assert chance.startswith(f"{name.replace('_', ' ')} on {engine}, random: ")
    by_chance, by_script = PRINTS[name, engine]
    assert figures_of(scripted) == pytest.approx(by_script, abs=0.0051)
    assert figures_of(chance)[0] == by_chance[0]
    if engine == "mujoco" or name == "reach":  # of a box that falls rounding decides more
        assert figures_of(chance) == pytest.approx(by_chance, abs=0.0051)


WITHOUT_GYMNASIUM = """
import importlib.util, runpy, sys
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: (
    None if name == "gymnasium" else find_spec(name, *more)
)
sys.argv = ["{name}", "--help"]
runpy.run_module("examples.{name}", run_name="__main__")
"""


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_without_its_extra_says_which_in_one_line(name: str) -> None:
    done = of_python("-c", WITHOUT_GYMNASIUM.format(name=name), code=1)
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "[gym]" in done.stderr


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_has_a_help_and_refuses_an_unknown_engine_in_words(name: str) -> None:
    assert "backend" in of_python("-m", f"examples.{name}", "--help", code=0).stdout
    error = of_python("-m", f"examples.{name}", "mujcoo", code=2).stderr
    assert "Did you mean 'mujoco'" in error
    assert "Traceback" not in error


@pytest.mark.parametrize("name", EXAMPLES)
def test_targets_can_be_reached_and_are_the_same_on_every_backend(name: str, backend: str) -> None:
    example = EXAMPLES[name]
    here, there = (example.task(engine)["model"] for engine in (backend, "mujoco"))
    for seed in range(20):
        goals: list[Any] = [
            example.reset(model, np.random.default_rng(seed)).goal for model in (here, there)
        ]
        assert np.array_equal(*goals)
        assert 0.03 < goals[0][2] < 0.6


def test_reach_observes_the_fingertip_of_now_and_rewards_its_distance(backend: str) -> None:
    with closing(make_env(**reach.task(backend))) as env, sm.make_data(env.model) as data:
        env.reset(seed=1)
        observation, reward, _, _, info = env.step(np.ones(6, dtype=np.float32))
        data.qpos[:] = observation[:6]
        sm.forward(env.model, data)
        tip = data.site_xpos[env.model.site_id(TIP)]
    assert np.array_equal(observation[12:15], tip)
    assert np.array_equal(observation[18:21], observation[15:18] - tip)
    distance = float(np.linalg.norm(observation[18:21]))
    assert info == {"distance": distance, "is_success": False, "diverged": False}
    assert reward == -distance


def test_reach_observes_the_velocities(backend: str) -> None:
    with closing(make_env(**reach.task(backend))) as env:
        env.reset(seed=1)
        observation, *_ = env.step(np.ones(6, dtype=np.float32))
        assert np.array_equal(observation[6:12], env.data.qvel)
    assert np.abs(observation[6:12]).max() > 0.5


def test_an_episode_of_the_box_begins_in_the_keyframe(backend: str) -> None:
    with closing(make_env(**held_box.task(backend))) as env:
        first, info = env.reset(seed=0)
        assert np.array_equal(first[:13], env.model.keyframes[0].qpos)
        assert 0.04 < info["distance"] < 0.4


def test_the_box_is_held_by_the_action_0(backend: str) -> None:
    with closing(make_env(**held_box.task(backend))) as env:
        env.reset(seed=0)
        for _ in range(40):
            _, reward, terminated, truncated, info = env.step(np.zeros(6, dtype=np.float32))
            assert (terminated, truncated, reward) == (False, False, 1 - info["distance"])
        assert np.allclose(env.data.ctrl, env.model.keyframes[0].ctrl, atol=1e-12)


def test_the_box_is_dropped_by_open_jaws(backend: str) -> None:
    opens = np.eye(6, dtype=np.float32)[5]
    with closing(make_env(**held_box.task(backend))) as env:
        env.reset(seed=0)
        ends = (env.step(opens) for _ in range(60))
        reward, info = next((end[1], end[4]) for end in ends if end[2])
    assert_has(info, distance=-reward, is_success=False, diverged=False)


def test_episodes_count_only_until_their_end(backend: str) -> None:
    """Open jaws drop the box; the world then starts anew, which is another episode."""
    with closing(make_vec(num_envs=2, **held_box.task(backend))) as envs:
        opened = np.tile(np.eye(6, dtype=np.float32)[5], (2, 1))
        episodes = play(envs, lambda _: opened, 0)
    assert isinstance(episodes, Episodes)
    assert (episodes.steps < 60).all()
    assert (episodes.returned < episodes.steps).all()
