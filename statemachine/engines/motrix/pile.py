"""MotrixSim's world in which something can be kept and forgotten: boxes, a driven joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np

from ...backends.motrix.links import mx
from ...interface import Array
from ...processes.stderr_capture import stderr_capture
from ..pile import PILE_MJCF, Pile


def loaded(text: str) -> tuple[Any, Any]:
    """Return a SceneModel of an MJCF text and a fresh SceneData."""
    with stderr_capture():
        scene = mx.load_mjcf_str(text)
    return scene, mx.SceneData(scene)


def floats(numbers: Sequence[float] | Array) -> Any:
    """Return numbers in single precision, as MotrixSim takes them."""
    return np.asarray(numbers, dtype=np.float32)


def _same(values: Any) -> float:
    """Return the value of all of some numbers; NaN if they differ."""
    numbers = np.ravel(values)
    return float(numbers[0]) if (numbers == numbers[0]).all() else np.nan


def _positions(scene: MotrixPile) -> float:
    return _same(scene.data.dof_pos)


def _velocities(scene: MotrixPile) -> float:
    return _same(scene.data.dof_vel)


def _command(scene: MotrixPile) -> float:
    return _same(scene.data.actuator_ctrls)


def _override(scene: MotrixPile) -> float:
    return _same(scene.model.get_gravity_override(scene.data))


def _gravity(scene: MotrixPile) -> float:
    return _same(scene.model.options.gravity)


def _timestep(scene: MotrixPile) -> float:
    return float(scene.model.options.timestep)


def _set_positions(scene: MotrixPile, value: float) -> None:
    scene.data.low.set_dof_positions_unchecked(0 * scene.data.dof_pos + floats([value]))


def _set_velocities(scene: MotrixPile, value: float) -> None:
    scene.data.set_dof_vel(0 * scene.data.dof_vel + floats([value]))


def _set_command(scene: MotrixPile, value: float) -> None:
    scene.data.actuator_ctrls = floats([value])


def _set_override(scene: MotrixPile, value: float) -> None:
    scene.model.set_gravity_override(scene.data, floats([value] * 3))


def _set_gravity(scene: MotrixPile, value: float) -> None:
    scene.model.options.gravity = floats([value] * 3)


def _set_timestep(scene: MotrixPile, value: float) -> None:
    scene.model.options.timestep = abs(value)  # of a negative one it would raise


@contextmanager
def _written(scene: MotrixPile) -> Iterator[Callable[[Any], object]]:
    """Copy positions and velocities, and yield what writes them back."""
    positions, velocities = np.array(scene.data.dof_pos), np.array(scene.data.dof_vel)

    def restore(other: MotrixPile) -> None:
        other.data.low.set_dof_positions_unchecked(positions)
        other.data.set_dof_vel(velocities)

    yield restore


@contextmanager
def _reset_to(scene: MotrixPile) -> Iterator[Callable[[Any], object]]:
    """Copy positions and velocities, and yield what resets to them."""
    positions, velocities = np.array(scene.data.dof_pos), np.array(scene.data.dof_vel)
    yield lambda other: other.data.reset(other.model, positions, velocities)


class MotrixPile(Pile):
    """A SceneModel and a SceneData."""

    near: ClassVar = 1e-6  # single precision

    # What decides the future; the last two belong to the SceneModel.
    quantities: ClassVar = {
        "dof_pos": (_set_positions, _positions),
        "dof_vel": (_set_velocities, _velocities),
        "actuator_ctrls": (_set_command, _command),
        "gravity override": (_set_override, _override),
        "gravity": (_set_gravity, _gravity),
        "timestep": (_set_timestep, _timestep),
    }
    resets: ClassVar = {"SceneData.reset": lambda scene: scene.data.reset(scene.model)}
    ways_to_save: ClassVar = {
        "dof_pos and dof_vel copied": _written,
        "reset to copies of them": _reset_to,
    }

    def __init__(self) -> None:
        self.model, self.data = loaded(PILE_MJCF)

    @classmethod
    @contextmanager
    def fresh(cls) -> Iterator[MotrixPile]:
        yield cls()

    @property
    def timestep(self) -> float:
        return self.model.options.timestep

    def bodies(self) -> int:
        return self.model.num_bodies

    def run(self, steps: int) -> Array:
        trace: list[Array] = []
        for _ in range(steps):
            self.model.step(self.data)
            trace.append(np.array(self.data.dof_pos, dtype=np.float64))
        return np.array(trace)
