"""A release of PyBullet, as `_child_server` asks it, in the Python of that release's environment.

There is MuJoCo, too, and this package is found where it is: what a world is sent as, and what
drives it, is the same for every release.
"""

from __future__ import annotations

import pickle
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[2]))

from statemachine.backends._hidden_world import Moment, derived_by


class SentWorld:
    """A world that was sent."""

    def __init__(self, model) -> None:
        self.world = world = model()
        self.memory, self.untold = world.memory_layout, world.untold
        self.kept_memory = tuple(world.kept_memory)

    def _moment(self, vector):
        nq, lengths = len(self.world.qpos0), [length for _, length in self.memory]
        nv = len(vector) - nq - sum(lengths)
        qpos, qvel, *memory = np.split(vector, np.cumsum([nq, nv, *lengths])[:-1])
        return Moment(qpos, qvel, self.ctrl, memory)

    def place(self, vector) -> None:
        """Take a state, in a world without traces of another."""
        self.ctrl = np.zeros(0)  # it comes
        self.placed = placed = self._moment(vector)
        self.world = self.world.renewed()
        self.world.place(placed.qpos, placed.qvel, placed.memory)

    def state(self):
        """The state, in a row."""
        return np.concatenate([*self.world.read(), *self.world.memory])

    def command(self, ctrl) -> None:
        """Take a command."""
        self.ctrl = ctrl
        self.world.command(ctrl)

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps; the last one of a call is taken by itself."""
        return self.world.advance(steps, fastest)

    def forward(self) -> None:
        """Derive of the present."""
        self.placed.ctrl = self.ctrl
        self.world.look(self.placed)

    def derived(self, vector):
        """All that the engine tells of a moment, by name."""
        values = derived_by(self.world, self._moment(vector))
        contacts = vars(values.pop("contacts"))
        return {name: values[name] for name in values.keys() - self.untold} | contacts


Simulation = SentWorld


def load(file, text, names):
    """What opens the worlds of a Model, in the place of a text; `file` is MuJoCo's release."""
    here, there = version("pybullet"), version("mujoco")
    if there != file:
        raise ImportError(
            f"its environment has MuJoCo {there}, not {file}: "
            f"statemachine engines remove pybullet=={here}, then add"
        )
    return pickle.loads(text), {"version": here}, {}
