"""Every truth of the battery a second way: quadrature, an integrator of SciPy, a conserved number.

No engine runs here. The numbers of the cases are written anew, so that a slip in a truth shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.pendulums import double_pendulum_energy
from statemachine.lab.validate.rotation import chain_momenta

integrate = pytest.importorskip("scipy.integrate")
optimize = pytest.importorskip("scipy.optimize")

G = 9.81
Array = Any


def path(rates: Callable[[float, Array], Any], start: Any, seconds: float, **more: Any) -> Any:
    """What SciPy's integrator of order 8 gives, to 1e-12."""
    return integrate.solve_ivp(
        rates, (0.0, seconds), start, method="DOP853", rtol=1e-12, atol=1e-13, **more
    )


def end(rates: Callable[[float, Array], Any], start: Any, seconds: float) -> Array:
    return path(rates, start, seconds).y[:, -1]


def second_order(force: Callable[[float, float], float]) -> Callable[[float, Array], Any]:
    """Rates of a coordinate whose acceleration depends on it and its rate."""
    return lambda _, y: [y[1], force(y[0], y[1])]


# Falls, springs, damping.


def fall() -> float:
    return float(end(second_order(lambda q, v: -G), [0.0, 0.0], 1.0)[0])


def off_the_parabola() -> float:
    flown = end(lambda _, y: [*y[3:], 0.0, 0.0, -G], [0, 0, 0, 1.0, -2.0, 5.0], 1.0)[:3]
    return float(np.linalg.norm(flown - [1.0, -2.0, 5.0 - G / 2]))


def spring_period() -> float:
    run = path(second_order(lambda q, v: -100.0 * q), [1.0, 0.0], 2.0, events=lambda t, y: y[0])
    times = run.t_events[0]
    return float(times[2] - times[0])


def spring_energy() -> float:
    q, v = end(second_order(lambda q, v: -100.0 * q), [1.0, 0.0], 10.0)
    return float((v * v + 100.0 * q * q) / 100.0 - 1.0)


def damped() -> float:
    return float(end(second_order(lambda q, v: -100.0 * q - v), [1.0, 0.0], 0.5)[0])


def sinking(seconds: float) -> float:
    return float(end(second_order(lambda q, v: -G - 4.0 * v), [0.0, 0.0], seconds)[1])


def branches_are_the_same() -> float:
    """The robots have equal branches, whatever their order: nothing else can differ."""
    tree = ElementTree.fromstring(f"<a>{CASES['order-of-branches'].mjcf}</a>")
    kinds = set[str]()
    for base in tree.findall("worldbody/body"):
        robot = base.get("name", "")
        branches = sorted(base.findall("body"), key=lambda body: body.get("name", ""))
        text = "".join(ElementTree.tostring(branch, "unicode") for branch in branches)
        kinds.add(text.replace(f'"{robot}', '"'))
    return float(len(kinds) - 1)


# Pendulums.


def swing(inertia: float, moment: float, amplitude: float) -> float:
    """The period by quadrature, q = a sin u taking the root out of the integrand's end."""

    def integrand(u: float) -> float:
        angle = 2.0 * math.asin(math.sin(amplitude / 2.0) * math.sin(u))
        return 1.0 / math.cos(angle / 2.0)

    quarter = integrate.quad(integrand, 0.0, math.pi / 2.0, epsabs=1e-13)[0]
    return 4.0 * math.sqrt(inertia / moment) * quarter


def pendulum(q: float, v: float) -> float:
    return -G * math.sin(q) / (1.0 + 1e-6)


def quarter() -> float:
    def lowest(t: float, y: Array) -> float:
        return y[0]

    run = path(second_order(pendulum), [math.radians(60.0), 0.0], 1.0, events=lowest)
    return float(run.t_events[0][0])


def rise() -> float:
    start = math.radians(120.0)
    tops = path(second_order(pendulum), [start, 0.0], 9.0, events=lambda t, y: y[1])
    return float(np.abs(tops.y_events[0][1:, 0]).max() - start)


def double_rates(_: float, y: Array) -> Array:
    """Two point masses on rods of 1 m, from absolute angles: M a = f."""
    first, second = y[0], y[0] + y[1]
    u, w = y[2], y[2] + y[3]
    c, s = math.cos(first - second), math.sin(first - second)
    mass = np.array([[2.0 + 1e-6, c], [c, 1.0 + 1e-6]])
    force = [-s * w * w - 2.0 * G * math.sin(first), s * u * u - G * math.sin(second)]
    a, b = np.linalg.solve(mass, force)
    return np.array([y[2], y[3], a, b - a])


def double_energy() -> float:
    start = np.array([math.radians(120.0), 0.0, 0.0, 0.0])
    late = end(double_rates, start, 3.0)
    return float(double_pendulum_energy(late) / double_pendulum_energy(start) - 1.0)


# Bodies that turn.


def off_centre() -> tuple[float, float]:
    """The origin of a body that spins about the vertical, by its acceleration; drift and angle."""

    def rates(_: float, y: Array) -> list[float]:
        angle = y[4]
        pull = 10.0**2 * 0.3  # the origin is drawn to the centre
        return [y[2], y[3], pull * math.cos(angle), pull * math.sin(angle), 10.0]

    x, y, _, _, angle = end(rates, [0.0, 0.0, 1.0, 0.0, 0.0], 1.0)
    centre = np.array([x + 0.3 * math.cos(angle), y + 0.3 * math.sin(angle)])
    return float(np.linalg.norm(centre - [1.3, 3.0])), float(angle)


def euler(inertia: Array) -> Callable[[float, Array], Array]:
    return lambda _, w: -np.cross(w, inertia * w) / inertia


MIDDLE = np.array([1.0, 2.0, 3.0])
TUMBLE = np.array([0.01, 5.0, 0.01])


def tumbling_energy() -> float:
    w = end(euler(MIDDLE), TUMBLE, 20.0)
    return float(MIDDLE @ w**2 / (MIDDLE @ TUMBLE**2) - 1.0)


def tumbling_momentum() -> float:
    w = end(euler(MIDDLE), TUMBLE, 20.0)
    return float(np.linalg.norm(MIDDLE * w) / np.linalg.norm(MIDDLE * TUMBLE) - 1.0)


def flip() -> float:
    run = path(euler(MIDDLE), TUMBLE, 9.0, events=lambda t, w: w[1])
    return float(np.diff(run.t_events[0])[0])


def symmetric() -> float:
    w = end(euler(np.array([1.0, 1.0, 1.5])), [0.5, 0.0, 4.0], 1.0)
    return math.atan2(w[1], w[0])


def top() -> float:
    """The angle of precession after 1 s, from the equations of motion in Euler angles."""
    across, along, tilt = 0.002 + 0.1**2, 0.001, math.radians(30.0)
    spin = along * 300.0  # the momentum about the axis, which stays
    turning = CASES["top-ball"].truth()  # by which it starts; a wrong one would nutate
    vertical = across * turning * math.sin(tilt) ** 2 + spin * math.cos(tilt)

    def rates(_: float, y: Array) -> list[float]:
        angle, rate, _ = y
        turn = (vertical - spin * math.cos(angle)) / (across * math.sin(angle) ** 2)
        pull = G * 0.1 * math.sin(angle) - spin * turn * math.sin(angle)
        pull += across * turn**2 * math.sin(angle) * math.cos(angle)
        return [rate, pull / across, turn]

    angle, _, turned = end(rates, [tilt, 0.0, 0.0], 1.0)
    assert angle == pytest.approx(tilt, abs=1e-9)  # a regular precession
    return float(turned)


def gimbal() -> float:
    """The angle of the outer gimbal after 1 s, from Routh's function of both gimbals."""
    spin = 0.01 * 50.0
    turning = 0.25 / spin

    def around(tilt: float) -> float:
        """Moment of inertia of all about the outer axis."""
        return 0.003 + 0.001 * math.sin(tilt) ** 2 + (0.002 + 0.006) * math.cos(tilt) ** 2

    vertical = around(0.0) * turning

    def rates(_: float, y: Array) -> list[float]:
        tilt, rate, _ = y
        turn = (vertical + spin * math.sin(tilt)) / around(tilt)
        pull = 0.25 - spin * math.cos(tilt) * turn
        pull += (0.001 - 0.008) * math.sin(tilt) * math.cos(tilt) * turn**2
        return [rate, pull / (0.002 + 0.006), turn]

    return float(end(rates, [0.0, 0.0, 0.0], 1.0)[2])


# Driven joints.


def servo(mass: float, kp: float, kv: float, target: float, pull: float, damping: float) -> Any:
    return second_order(lambda q, v: (kp * (target - q) - (kv + damping) * v - pull) / mass)


def droop() -> float:
    return float(end(servo(2.0, 500.0, 20.0, 0.0, 2.0 * G, 1.0), [0.0, 0.0], 5.0)[0])


def servo_step() -> float:
    return float(end(servo(1.0, 100.0, 20.0, 1.0, 0.0, 0.0), [0.0, 0.0], 0.2)[0])


def limited() -> float:
    def force(q: float, v: float) -> float:
        return float(np.clip(1000.0 * (100.0 - q) - v, -3.0, 3.0)) / 1.5

    return float(end(second_order(force), [0.0, 0.0], 1.0)[1])


def motor_speed() -> float:
    def torque(q: float, v: float) -> float:
        return (min(5.0, 1.0) - 0.5 * v) / 0.01

    return float(end(second_order(torque), [0.0, 0.0], 2.0)[1])


def stuck() -> float:
    """Dry friction may be any force up to its bound: it needs none beyond to hold."""
    return max(0.0, 0.9 - 1.0)


def slipping() -> float:
    return float(end(second_order(lambda q, v: 1.1 - 1.0), [0.0, 0.0], 1.0)[1])


def braking() -> float:
    """The distance at which friction has done the work of the kinetic energy."""
    return float(optimize.brentq(lambda d: 1.0 * d - 0.5 * 1.0**2, 0.0, 9.0, xtol=1e-14))


def rotor() -> float:
    """The speed whose energy, link's and rotor's, is the work of the motor in 1 s."""

    def too_much(speed: float) -> float:
        return 0.5 * (0.15 + 0.05) * speed**2 - 0.4 * (speed / 2.0) * 1.0

    return float(optimize.brentq(too_much, 0.1, 9.0, xtol=1e-14))


def geared() -> Array:
    """Accelerations of both joints and the force between them: with a multiplier."""
    system = np.array([[0.1, 0.0, 3.0], [0.0, 0.02, -1.0], [3.0, -1.0, 0.0]])
    return np.linalg.solve(system, [0.2, 0.0, 0.0])


def limit_place() -> float:
    """How far beyond the limit the potential energy is least, where it may not be beyond."""
    least = optimize.linprog([2.0 * G], bounds=[(-0.5, 1.0)])
    return float(-0.5 - least.x[0])


def limit_force() -> float:
    return float(optimize.linprog([2.0 * G], bounds=[(-0.5, 1.0)]).lower.marginals[0])


def lagrangian(q: Array, v: Array) -> float:
    """Kinetic less potential energy of the arm of two links; a positive angle lowers it."""
    energy = 0.0
    parts = ((2.0, 0.04, 0.25, False), (1.0, 0.02, 0.2, True))
    for mass, inertia, reach, is_lower in parts:
        angle, rate = (q[0] + q[1], v[0] + v[1]) if is_lower else (q[0], v[0])
        velocity = reach * rate * np.array([-math.sin(angle), -math.cos(angle)])
        height = -reach * math.sin(angle)
        if is_lower:
            velocity = velocity + 0.5 * v[0] * np.array([-math.sin(q[0]), -math.cos(q[0])])
            height -= 0.5 * math.sin(q[0])
        energy += 0.5 * mass * velocity @ velocity + 0.5 * inertia * rate**2 - mass * G * height
    return float(energy)


def torque(velocity: tuple[float, float]) -> float:
    """d/dt dL/dv - dL/dq of the shoulder without acceleration, by differences."""
    q, v, h = np.array([0.0, math.radians(40.0)]), np.array(velocity), 1e-4
    axis = np.array([1.0, 0.0])

    def momentum(at: Array) -> float:
        return (lagrangian(at, v + h * axis) - lagrangian(at, v - h * axis)) / (2.0 * h)

    rate = (momentum(q + h * v) - momentum(q - h * v)) / (2.0 * h)
    slope = (lagrangian(q + h * axis, v) - lagrangian(q - h * axis, v)) / (2.0 * h)
    return rate - slope


# Loops, pins and welds.


def closure() -> float:
    """How far the end of a level coupler is off the circle about the second pin."""
    off: list[float] = []
    for angle in np.linspace(-1.0, 1.0, 9):
        coupler = np.array([-math.sin(angle) + 0.6, -math.cos(angle)])
        off.append(abs(math.dist(coupler, (0.6, 0.0)) - 1.0))
    return max(off)


def on_a_pin(q: float, v: float) -> float:
    return -2.0 * G * 0.5 * math.sin(q) / (0.05 + 2.0 * 0.5**2)


def largest_reaction() -> float:
    """The force upwards on the pin along the first swing: weight and acceleration of the centre."""
    run = path(second_order(on_a_pin), [math.radians(60.0), 0.0], 0.9, dense_output=True)

    def upwards(t: float) -> float:
        q, v = run.sol(t)
        a = on_a_pin(q, v)
        return 2.0 * (G + 0.5 * (a * math.sin(q) + v * v * math.cos(q)))

    best = optimize.minimize_scalar(
        lambda t: -upwards(t), bounds=(0.2, 0.7), method="bounded", options={"xatol": 1e-10}
    )
    return -float(best.fun)


def pinned_energy() -> float:
    q, v = end(second_order(on_a_pin), [math.radians(60.0), 0.0], 2.0)
    energy = 0.5 * 0.55 * v * v + 2.0 * G * 0.5 * (1.0 - math.cos(q))
    return float(energy / (2.0 * G * 0.5 * (1.0 - math.cos(math.radians(60.0)))) - 1.0)


def welded() -> Array:
    """Where two masses rest on a servo, tied by a multiplier: both places, and the force."""
    system = np.array([[10_000.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, -1.0, 0.0]])
    return np.linalg.solve(system, [-10.0 * G, -90.0 * G, 0.0])


def free_ways_of_leaning() -> float:
    """How many ways two hinged links can move whose tips are one point: none."""
    left = np.array([0.8, -0.6])  # how the tip moves with either angle
    right = np.array([0.8, 0.6])
    return float(2 - np.linalg.matrix_rank(np.column_stack([left, -right])))


SECOND_WAYS: dict[str, tuple[Callable[[], float], float]] = {
    # By case what is computed, and how far it may be from the truth.
    "free-fall": (fall, 1e-11),
    "thrown-body": (off_the_parabola, 1e-11),
    "spring-period": (spring_period, 1e-11),
    "spring-energy": (spring_energy, 1e-10),
    "damped-spring": (damped, 1e-11),
    "sinking-speed": (lambda: sinking(0.25), 1e-11),
    "terminal-speed": (lambda: sinking(8.0), 1e-11),
    "order-of-branches": (branches_are_the_same, 0.0),
    "pendulum-60": (lambda: swing(1.0 + 1e-6, G, math.radians(60.0)), 1e-12),
    "pendulum-120": (lambda: swing(1.0 + 1e-6, G, math.radians(120.0)), 1e-12),
    "pendulum-quarter": (quarter, 1e-11),
    "pendulum-rise": (rise, 1e-10),
    "double-pendulum-energy": (double_energy, 1e-9),
    "thrown-off-centre": (lambda: off_centre()[0], 1e-11),
    "thrown-spin": (lambda: off_centre()[1], 1e-11),
    "tumbling-energy": (tumbling_energy, 1e-9),
    "tumbling-momentum": (tumbling_momentum, 1e-9),
    "tumbling-flip": (flip, 1e-8),
    "symmetric-body": (symmetric, 1e-10),
    "top-ball": (top, 1e-9),
    "top-hinges": (top, 1e-9),
    "gyroscope": (gimbal, 1e-10),
    "servo-droop": (droop, 1e-10),
    "servo-step": (servo_step, 1e-11),
    "effort-limit": (limited, 1e-10),
    "speed-limit": (motor_speed, 1e-10),
    "dry-friction-below": (stuck, 0.0),
    "dry-friction-above": (slipping, 1e-11),
    "dry-friction-stop": (braking, 1e-11),
    "armature": (rotor, 1e-11),
    "reflected-inertia": (lambda: 0.5 * float(geared()[0]), 1e-12),
    "mimic": (lambda: float(geared()[1] - 3.0 * geared()[0]), 1e-12),
    "limit-rest": (limit_place, 1e-12),
    "limit-force": (limit_force, 1e-9),
    "torque-at-rest": (lambda: torque((0.0, 0.0)), 1e-6),
    "torque-moving": (lambda: torque((2.0, -3.0)), 1e-6),
    "four-bar-period": (lambda: swing(1.27, 1.5 * G, math.radians(60.0)), 1e-12),
    "four-bar-closure": (closure, 1e-15),
    "reaction-at-rest": (lambda: float(welded()[2]) * 2.0 / 90.0, 1e-9),
    "reaction-moving": (largest_reaction, 1e-9),
    "pinned-energy": (pinned_energy, 1e-10),
    "weld-payload": (lambda: float(welded()[0] - welded()[1]), 1e-12),
    "weld-droop": (lambda: float(welded()[0]), 1e-12),
    "weld-loop": (free_ways_of_leaning, 0.0),
}
# What the tests below hold, instead of a number.
OTHERWISE = {"chain-momentum", "chain-angular-momentum", "limit-rebound"}


@pytest.mark.parametrize("name", SECOND_WAYS)
def test_a_truth_is_computed_a_second_way(name: str) -> None:
    second, within = SECOND_WAYS[name]
    assert second() == pytest.approx(CASES[name].truth(), rel=0, abs=within)


def test_every_case_has_a_second_way() -> None:
    ours = {name for name, case in CASES.items() if case.group != "contact"}
    assert ours == set(SECOND_WAYS) | OTHERWISE


def test_momenta_of_a_chain_are_those_of_its_particles() -> None:
    """Both bodies as many points: their momenta by differences of where they are."""
    rng = np.random.default_rng(1)
    qpos, qvel = np.append(rng.normal(size=7), 0.3), rng.normal(size=7)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    h = 1e-5
    before, after = (particles(moved(qpos, qvel, sign * h)) for sign in (-1.0, 1.0))
    masses = np.concatenate([np.full(6, 2.0 / 6), np.full(6, 1.0 / 6)])
    momenta = masses[:, None] * (after - before) / (2.0 * h)
    linear, angular = chain_momenta(qpos, qvel)
    np.testing.assert_allclose(momenta.sum(0), linear, atol=1e-8)
    here = particles(qpos)
    np.testing.assert_allclose(np.cross(here, momenta).sum(0), angular, atol=1e-8)


def moved(qpos: Array, qvel: Array, seconds: float) -> Array:
    """Where a chain is a little later, in MuJoCo's conventions."""
    later = qpos.copy()
    later[:3] += qvel[:3] * seconds
    half = qvel[3:6] * seconds / 2.0
    w, v = qpos[3], qpos[4:7]
    turned = np.append(w - v @ half, v + w * half + np.cross(v, half))
    later[3:7] = turned / np.linalg.norm(turned)
    later[7] += qvel[6] * seconds
    return later


def particles(qpos: Array) -> Array:
    """Six points of each body, which have its mass and moments of inertia together."""
    from scipy.spatial.transform import Rotation

    base = Rotation.from_quat(qpos[[4, 5, 6, 3]])
    second = base * Rotation.from_rotvec([0.0, qpos[7], 0.0])
    hinge = qpos[:3] + base.apply([0.4, 0.0, 0.0])
    points = []
    for turned, origin, mass, centre, inertia in (
        (base, qpos[:3], 2.0, [0.1, 0.0, 0.0], [0.02, 0.03, 0.04]),
        (second, hinge, 1.0, [0.3, 0.0, 0.1], [0.01, 0.02, 0.02]),
    ):
        # On each axis two points at +-d: mass / 3 d² is half the trace less the moment.
        squares = (np.sum(inertia) / 2.0 - np.array(inertia)) * 3.0 / mass
        for axis, square in enumerate(squares):
            for sign in (-1.0, 1.0):
                place = np.array(centre)
                place[axis] += sign * math.sqrt(max(square, 0.0))
                points.append(origin + turned.apply(place))
    return np.array(points)


def test_a_limit_that_pushes_gives_back_no_more_than_the_fall() -> None:
    """The speed at the limit is that of the fall; by energy none above it can follow."""
    fallen = float(end(second_order(lambda q, v: -G), [0.0, 0.0], math.sqrt(2 * 0.5 / G))[1])
    assert 0.5 * fallen**2 == pytest.approx(G * 0.5, rel=1e-10)
    assert CASES["limit-rebound"].truth() == 0.0


@pytest.mark.parametrize(
    "name",
    [name for name, case in CASES.items() if case.discrete and case.group != "contact"],
)
def test_an_exact_discrete_truth_tends_to_the_truth(name: str) -> None:
    case = CASES[name]
    for discrete in case.discrete.values():
        coarse, fine = discrete(1e-3) - case.truth(), discrete(1e-4) - case.truth()
        assert coarse / fine == pytest.approx(10.0, rel=0.01)
