"""The process of an engine that runs in a Python of its own: it answers for models and worlds.

It is run by the interpreter of the engine's environment, on Python 3.9 or later, needs NumPy
only, and imports nothing of this package. Its argument is a file that knows the engine, and has

- `load(file, text, names)`: a model of a file, or of its text where that is not empty; what is
  said of it, and numeric fields of those names, if the engine has such. What is said:
  "version" of the engine; "memory", name and length of each array that the engine remembers
  from step to step beside qpos and qvel; "untold", names of derived arrays that it does not tell,
  which may be left out;
- `Simulation(model)`: a world. `place(vector)` takes qpos, qvel and the memory in a row, so that
  nothing of before is left; `state()` gives the same vector; `command(ctrl)` takes a command.
  `advance(steps, fastest)` takes engine steps, up to one after which a position is beyond 1e10 or
  a velocity beyond `fastest`, and returns how many. `forward()` derives of the present. `derived()`
  gives what is derived, of the moment that the last step started from or of the present after
  `forward`, by name, and of the contacts geom, dist, pos, frame, force and torque;
- `edit(model, edits, flags)`, if it can change a model: another one, with other values in fields.

A message and its answer are two lengths, a header in JSON, and bytes; it ends with its input.
"""

from __future__ import annotations

import json
import os
import runpy
import select
import struct
import sys
import time
from types import SimpleNamespace

import numpy as np

SIZES = struct.Struct("<QQ")
SPIN = 50e-6  # [s]


def await_message(pipe):
    """Look for a message for a short time; then it is waited for, asleep.

    A process that sleeps takes longer to wake than most calls take.
    """
    if os.name == "nt":  # where no pipe can be looked at so
        return
    until = time.perf_counter() + SPIN
    while time.perf_counter() < until and not select.select([pipe], [], [], 0)[0]:
        os.sched_yield()


class Answerer:
    """The models and worlds of this process, by number, and what can be asked of them."""

    def __init__(self, engine) -> None:
        self.engine, self.things, self.number = engine, {}, 0

    def keep(self, thing):
        """Its number."""
        self.number += 1
        self.things[self.number] = thing
        return self.number

    def load(self, job, _):
        """Compile a file; numeric fields of the compiled model that were asked for."""
        model, said, fields = self.engine.load(job["file"], job["text"], job["fields"])
        return {"model": self.keep(model), **said}, fields

    def edit(self, job, content):
        """A copy of a model with other values in some fields."""
        edits, start = {}, 0
        for name, size in job["edits"]:
            edits[name], start = content[start : start + size], start + size
        model = self.engine.edit(self.things[job["model"]], edits, job["flags"])
        return {"model": self.keep(model)}, {}

    def make(self, job, _):
        """A world of a model."""
        return {"world": self.keep(self.engine.Simulation(self.things[job["model"]]))}, {}

    def run(self, job, content):
        """Place a state if one is given, take a command and steps, and one more if it is asked."""
        world = self.things[job["world"]]
        if len(content) > job["nu"]:
            world.place(content[job["nu"] :])
        world.command(content[: job["nu"]])
        taken = world.advance(job["steps"], job["fastest"])
        states = {"before": world.state()}
        if taken == job["steps"] and job["ahead"]:
            world.advance(1, np.inf)
            states["after"] = world.state()
        return {"taken": taken}, states

    def look(self, job, content):
        """What is derived: of a state and a command if they are given, else of the last step."""
        world = self.things[job["world"]]
        if len(content):
            world.place(content[job["nu"] :])
            world.command(content[: job["nu"]])
            world.forward()
        return {}, world.derived()


def main() -> None:
    """Answer until there is nobody to ask."""
    source, out = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what an engine prints is no answer
    server = Answerer(SimpleNamespace(**runpy.run_path(sys.argv[1])))
    while True:
        await_message(source)
        lengths = source.read(SIZES.size)
        if len(lengths) < SIZES.size:
            return
        size, rest = SIZES.unpack(lengths)
        job = json.loads(source.read(size))
        content = np.frombuffer(source.read(rest))
        for number in job["free"]:  # models and worlds that nobody needs any more
            server.things.pop(number, None)
        try:
            answer, arrays = getattr(server, job["verb"])(job, content)
        except Exception as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            answer, arrays = {"error": reason, "kind": type(error).__name__}, {}
        arrays = {name: np.asarray(array, float) for name, array in arrays.items()}
        answer = {**answer, "arrays": [(name, a.shape) for name, a in arrays.items()]}
        blob = b"".join(array.tobytes() for array in arrays.values())
        head = json.dumps(answer).encode()
        out.write(SIZES.pack(len(head), len(blob)) + head + blob)
        out.flush()


if __name__ == "__main__":
    main()
