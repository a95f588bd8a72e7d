"""Of the cases that no wrong parameter names: one that each notices, on MuJoCo."""

from __future__ import annotations

from statemachine.lab.validate.case import Integrator

# By case: the name of the wrong parameter, and an integrator with which the engine is right.
OTHER_CASES: dict[str, tuple[str, Integrator]] = {
    "spring-energy": ("gravity along x", "Euler"),
    "order-of-branches": ("mass of one body 1 % too large", "Euler"),
    "pendulum-120": ("gravity 1 % too large", "Euler"),
    "pendulum-quarter": ("gravity 1 % too large", "Euler"),
    "pendulum-rise": ("gravity upwards", "Euler"),
    "double-pendulum-energy": ("gravity upwards", "Euler"),
    "thrown-off-centre": ("gravity along x", "Euler"),
    "thrown-spin": ("timestep 1 % too short", "Euler"),
    "tumbling-energy": ("moment of inertia 1 % too large", "RK4"),
    "tumbling-momentum": ("moments of inertia in another order", "Euler"),
    "tumbling-flip": ("moment of inertia 1 % too large", "Euler"),
    "chain-momentum": ("mass of one body 1 % too large", "Euler"),
    "chain-angular-momentum": ("mass of one body 1 % too large", "Euler"),
    "top-ball": ("gravity 1 % too large", "RK4"),
    "top-hinges": ("gravity 1 % too large", "Euler"),
    "gyroscope": ("timestep 1 % too short", "Euler"),
    "dry-friction-below": ("gravity along x", "Euler"),
    "dry-friction-stop": ("gravity along x", "Euler"),
    "block-sticks": ("gravity upwards", "Euler"),
    "block-sticks-pyramidal": ("gravity upwards", "Euler"),
    "block-sticks-diagonal": ("gravity upwards", "Euler"),
    "block-sticks-diagonal-pyramidal": ("gravity upwards", "Euler"),
    "block-slides-diagonal-pyramidal": ("gravity upwards", "Euler"),
    "friction-cone": ("gravity upwards", "Euler"),
    "friction-cone-diagonal-pyramidal": ("gravity upwards", "Euler"),
    "block-stops": ("gravity 1 % too large", "Euler"),
    "block-stops-diagonal-pyramidal": ("gravity upwards", "Euler"),
}
