"""A release of PyBullet, as `_child_server` asks it, in the Python of that release's environment.

There is MuJoCo, too, and this package is found where it is: what a world is sent as, and what
drives it, is the same for every release.
"""

from __future__ import annotations

import functools
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
        self.world = model.pop()
        self.memory = [length for _, length in self.world.memory_layout]

    def _moment(self, vector):
        nq = len(self.world.qpos0)
        nv = len(vector) - nq - sum(self.memory)
        qpos, qvel, *memory = np.split(vector, np.cumsum([nq, nv, *self.memory])[:-1])
        return Moment(qpos, qvel, self.ctrl, memory)

    def place(self, vector) -> None:
        """Take a state, in a world without traces of another."""
        self.ctrl = np.zeros(0)  # it comes
        self.start = start = self._moment(vector)
        self.world = self.world.renewed()
        self.world.place(start.qpos, start.qvel, start.memory)

    def state(self):
        """The state, in a row."""
        return np.concatenate([*self.world.read(), *self.world.memory])

    def command(self, ctrl) -> None:
        """Take a command."""
        self.ctrl = ctrl
        self.world.command(ctrl)

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps; the last one of a call is taken by itself."""
        if steps == 1:
            self.start = self._moment(self.state())
        return self.world.advance(steps, fastest)

    def forward(self) -> None:
        """Derive of the present."""
        self.start.ctrl = self.ctrl
        self.world.look(self.start)

    def derived(self):
        """All that the engine tells, by name."""
        values = derived_by(self.world, self.start)
        contacts = vars(values.pop("contacts"))
        return {name: values[name] for name in values.keys() - self.world.untold} | contacts


Simulation = SentWorld


def load(file, text, names):
    """The world that a Model's opener makes, which is sent in the place of a text."""
    world = _opener(text)()
    said = {"version": version("pybullet"), "memory": world.memory_layout}
    return [world], {**said, "untold": sorted(world.untold)}, {}


@functools.lru_cache(8)
def _opener(text):
    return pickle.loads(text)
