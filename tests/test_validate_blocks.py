"""What the cases of bodies at rest and of blocks on an edge measure, held by the raw engine."""

from __future__ import annotations

import copy
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from statemachine.backends import parse_backend
from statemachine.lab.validate import contact_rest, contact_tipping
from statemachine.lab.validate.case import GRAVITY
from statemachine.lab.validate.case_runs import measure
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.variants import Variant
from statemachine.lab.validate.verdict import CaseMeasurement

TIMESTEP = 0.005  # [s]
WIDE, TALL = 0.05, 0.15  # [m] half those of the block that rocks
TIME = contact_tipping.rocking_time()  # held by its equation of motion in another file


@cache
def by_us(name: str) -> CaseMeasurement:
    """Return what a case measures on MuJoCo with Euler's integrator."""
    return measure(CASES[name], Variant(parse_backend("mujoco"), "Euler"), TIMESTEP)


def by_mujoco(
    name: str, duration: float, ctrl: float = 0.0
) -> tuple[mujoco.MjModel, list[mujoco.MjData]]:
    """Return the raw engine's data before the first step of a case and after each."""
    model = mujoco.MjModel.from_xml_string(CASES[name].model_text(TIMESTEP, "Euler"))
    data = mujoco.MjData(model)
    data.ctrl[:] = ctrl
    states = [copy.copy(data)]
    for _ in range(round(duration / TIMESTEP)):
        mujoco.mj_step(model, data)
        states.append(copy.copy(data))
    return model, states


def force_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """Return the force of a geom on all that it touches, in world axes, (3,) [N]."""
    total, force = np.zeros(3), np.zeros(6)
    for k, contact in enumerate(data.contact[: data.ncon]):
        mujoco.mj_contactForce(model, data, k, force)
        in_world = contact.frame.reshape(3, 3).T @ force[:3]
        if geom in contact.geom:
            total += in_world if contact.geom[0] == geom else -in_world
    return total


def angles_and_energies(states: Sequence[mujoco.MjData]) -> tuple[np.ndarray, np.ndarray]:
    """Return the angle [rad] and the energy [J] of the block of 1 kg."""
    angles: list[float] = []
    energies: list[float] = []
    for data in states:
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, data.qpos[3:7])
        angles.append(math.atan2(axes[2], axes[8]))
        inertia = ((2 * WIDE) ** 2 + (2 * TALL) ** 2) / 12.0  # of a box about its middle
        kinetic = 0.5 * float(data.qvel[:3] @ data.qvel[:3]) + 0.5 * inertia * data.qvel[4] ** 2
        energies.append(9.81 * data.qpos[2] + kinetic)
    return np.array(angles), np.array(energies)


def threshold() -> float:
    _, states = by_mujoco("tipping-threshold", 1.0)
    tilted: list[bool] = []
    for quat in states[-1].qpos.reshape(-1, 7)[:, 3:]:
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, quat)
        tilted.append(bool(math.acos(axes[8]) > 0.5))  # [rad]
    last, first = max(np.flatnonzero(tilted)), min(np.flatnonzero(np.logical_not(tilted)))
    assert first == last + 1
    return (contact_tipping.RATIOS[last] + contact_tipping.RATIOS[first]) / 2.0


def time_to_stand() -> float:
    model, states = by_mujoco("rocking-time", 1.5 * TIME)
    angles, _ = angles_and_energies(states)
    after = int(np.argmax(angles < 0))
    rows = slice(after - 2, after + 2)
    cubic = np.polyfit(angles[rows], [data.time for data in states[rows]], 3)
    assert model.opt.timestep == TIMESTEP
    return float(cubic[-1])  # the time as a cubic of the angle, at zero


def energy_error() -> float:
    _, states = by_mujoco("rocking-energy", 0.9 * TIME)
    _, energies = angles_and_energies(states)
    # What falls is the height of the middle: from that of the leaning block to half its own.
    lean = 0.6 * math.atan(WIDE / TALL)
    height = math.hypot(WIDE, TALL) * math.cos(math.atan(WIDE / TALL) - lean)
    return max(abs(energies - energies[0])) / (9.81 * (height - TALL))


def rebound() -> float:
    _, states = by_mujoco("rocking-rebound", 4.0 * TIME)
    angles, _ = angles_and_energies(states)
    return -min(angles) / math.atan(WIDE / TALL)


def floor_force(name: str) -> float:
    model, states = by_mujoco(name, 1.0)
    return float(force_of(model, states[-1], 0)[2])


def groove_force() -> float:
    model, states = by_mujoco("groove-force", 1.0)
    return float(np.linalg.norm(force_of(model, states[-1], 0)))


def sag() -> float:
    _, states = by_mujoco("stack-sag", 1.0)
    return 0.45 - float(states[-1].qpos[4 * 7 + 2])  # of the fifth box


def slip() -> float:
    model, states = by_mujoco("held-box", 1.5, ctrl=0.01)
    place = model.joint(2).qposadr[0] + 2
    return float(states[100].qpos[place] - states[-1].qpos[place])


def gap_of_towers() -> float:
    _, states = by_mujoco("order-of-bodies", 0.5)
    first, second, third, fourth = states[-1].qpos.reshape(4, 7)[:, :3]
    away = np.array([5.0, 0.0, 0.0])
    lower, upper = fourth - first - away, third - second - away
    return float(max(abs(np.concatenate([lower, upper]))))


RAW: dict[str, Callable[[], float]] = {
    "tipping-threshold": threshold,
    "rocking-energy": energy_error,
    "rocking-rebound": rebound,
    "resting-force": lambda: floor_force("resting-force"),
    "stack-force": lambda: floor_force("stack-force"),
    "stack-sag": sag,
    "groove-force": groove_force,
    "held-box": slip,
    "order-of-bodies": gap_of_towers,
}


@pytest.mark.parametrize("name", RAW)
def test_a_case_measures_what_the_raw_engine_does(name: str) -> None:
    assert by_us(name).measured == pytest.approx(RAW[name](), rel=1e-9, abs=1e-14)


def test_time_until_the_block_stands_is_that_of_the_raw_engine() -> None:
    # Two cubics: of the angle over the time, and of the time over the angle.
    assert by_us("rocking-time").measured == pytest.approx(time_to_stand(), abs=1e-5)


# Simulated time of each [s].
LASTS = {
    "tipping-threshold": 1.0,
    "rocking-time": 1.5 * TIME,
    "rocking-energy": 0.9 * TIME,
    "rocking-rebound": 4.0 * TIME,
    "resting-force": 1.0,
    "stack-force": 1.0,
    "stack-sag": 1.0,
    "groove-force": 1.0,
    "held-box": 1.5,
    "order-of-bodies": 0.5,
}


@pytest.mark.parametrize("name", LASTS)
def test_a_case_lasts_as_long_as_it_has_to(name: str) -> None:
    assert by_us(name).steps == round(LASTS[name] / TIMESTEP)


# Hand-computed, from what the descriptions of the cases say.
TRUTHS = {
    "tipping-threshold": 1.0,
    "rocking-energy": 0.0,
    "resting-force": 2.0 * 9.81,
    "stack-force": 5.0 * 9.81,
    "groove-force": 2.0 * 9.81 * math.sqrt(3.0) / 2.0,
    "held-box": 0.0,
    "order-of-bodies": 0.0,
}


@pytest.mark.parametrize("name", TRUTHS)
def test_the_truth_of_a_case_is_that_of_its_description(name: str) -> None:
    assert CASES[name].truth() == pytest.approx(TRUTHS[name], rel=1e-12)


FAR = 0.05  # of the truth, or of 1: farther than any of these is on MuJoCo at this timestep


@pytest.mark.parametrize("name", [*RAW, "rocking-time"])
def test_mujoco_is_near_the_truth(name: str) -> None:
    measured, truth = by_us(name).measured, CASES[name].truth()
    assert measured is not None
    far = 0.09 if name == "rocking-energy" else FAR
    assert abs(measured - truth) <= far * max(abs(truth), 1e-9) + far * (truth == 0.0)


def still(name: str) -> float | None:
    """Return what a case measures where nothing pulls."""
    case = replace(CASES[name], gravity=(0.0, 0.0, 0.0))
    return measure(case, Variant(parse_backend("mujoco"), "Euler"), TIMESTEP).measured


def test_a_block_on_which_nothing_pulls_never_stands() -> None:
    assert still("rocking-time") == math.inf


def test_a_block_on_which_nothing_pulls_keeps_its_angle() -> None:
    assert still("rocking-rebound") == pytest.approx(-contact_tipping.RELEASE, rel=1e-9)


def test_no_block_tips_over_on_the_level() -> None:
    case = replace(CASES["tipping-threshold"], gravity=(0.0, 0.0, -GRAVITY))
    measured = measure(case, Variant(parse_backend("mujoco"), "Euler"), TIMESTEP).measured
    assert measured == pytest.approx(contact_tipping.RATIOS[0] - 0.0025, rel=1e-12)


def test_nothing_presses_where_nothing_pulls() -> None:
    assert still("resting-force") == pytest.approx(0.0, abs=1e-9)


def boxes_of(name: str) -> list[tuple[list[float], list[float], float]]:
    """Return the places, half sizes and masses of the boxes of a case's file."""
    found: list[tuple[list[float], list[float], float]] = []
    for body in ET.fromstring(f"<m>{CASES[name].mjcf}</m>").iter("body"):
        place = [float(text) for text in body.get("pos", "").split()]
        for geom in body.iter("geom"):
            size = [float(text) for text in geom.get("size", "").split()]
            found.append((place, size, float(geom.get("mass", ""))))
    return found


def test_boxes_of_the_stack_lie_on_each_other() -> None:
    places = [place for place, _, _ in boxes_of("stack-sag")]
    assert places == [[0, 0, pytest.approx(z)] for z in (0.05, 0.15, 0.25, 0.35, 0.45)]
    assert [mass for _, _, mass in boxes_of("stack-sag")] == [1.0] * contact_rest.STACK


def test_towers_have_the_light_box_below_and_fall_a_centimetre() -> None:
    boxes = {(place[0], place[2]): mass for place, _, mass in boxes_of("order-of-bodies")}
    assert boxes == {(0, 0.06): 1, (0, 0.17): 2, (5, 0.17): 2, (5, 0.06): 1}


def test_the_leaning_block_stands_on_its_edge() -> None:
    model = mujoco.MjModel.from_xml_string(CASES["rocking-time"].model_text(TIMESTEP, "Euler"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.xmat[1].reshape(3, 3)
    corners = [data.xpos[1] + axes @ [x, 0.0, z] for x in (-WIDE, WIDE) for z in (-TALL, TALL)]
    lowest = min(corners, key=lambda corner: corner[2])
    assert lowest == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert math.atan2(axes[0, 2], axes[2, 2]) == pytest.approx(0.6 * math.atan2(WIDE, TALL))


def test_fingers_press_with_twice_what_friction_needs() -> None:
    weight, friction = 0.5 * 9.81, 0.5
    assert contact_rest.GRIP == 10.0
    assert 2 * friction * contact_rest.GRIP / weight == pytest.approx(2.04, abs=0.01)
