"""The process of an engine that runs in a Python of its own: it answers for models and worlds.

It is run by the interpreter of the engine's environment, on Python 3.9 or later, needs NumPy
only, and imports nothing of this package. Its argument is a file that knows the engine, and has

- `load(file, text, names)`: return the model of a file, or of its text where that is not empty; a
  dictionary of facts, "version" of the engine at least; and the numeric fields of those names, if
  the engine has such. A release of MuJoCo is also given, as `read`, how it reads the file;
- `Simulation(model)`: a world; those of a model share it. `memory` is name and length of each
  array that the engine remembers from step to step beside qpos and qvel, `kept_memory` the names
  of those that a write into qpos or qvel leaves as they are, `unavailable` the names of derived
  arrays that the engine does not offer.
  `place(vector)` takes qpos, qvel and the memory in a row, and overwrites the whole state;
  `state()` returns the same vector; `command(ctrl)` takes a command, in which the poses of mocap
  bodies follow ctrl. `advance(steps, fastest)` takes engine steps, up to one after which a position
  is beyond 1e10 or a velocity beyond `fastest`, and returns how many. `forward()` derives of the
  present. `derived(vector)` returns the derived arrays by name, and of the contacts geom, dist,
  pos, frame, force and torque: of the state that the last step started from or, after `forward`,
  of the present, which is passed to it again;
- `edit(model, edits, flags)`, if it can change a model: set fields to other values, and the flags;
- `written(file, text)`, if its elements may differ from those that the installed MuJoCo reads:
  return what it reads in the file, as MJCF. It is called where "names" of elements, by kind, are
  among the facts of `load`, and differ.

A message and its answer are pickled: facts, and arrays as shapes and bytes, since an older NumPy
cannot read the arrays of a later one. The process ends with its input, in the midst of a step,
too; on Windows after the step.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import runpy
import select
import sys
import threading
import time
from types import ModuleType

import numpy as np

_PROTOCOL = 4  # of Python 3.9, and earlier
# How long a message is looked for [s]: at least; in a row of calls at most; how much longer after
# one that came later, and with how much to make up for where that is no good.
SPIN, LONGEST, MORE, PAUSE = 50e-6, 1e-3, 10e-6, -500e-6


def send(pipe, facts, arrays) -> None:
    """Send a message: what is facts, and arrays of numbers by name."""
    packed = {name: (a.shape, a.dtype.str, a.tobytes()) for name, a in arrays.items()}
    pickle.dump((facts, packed), pipe, _PROTOCOL)
    pipe.flush()


def receive(pipe, patience):
    """Receive the next message, and the patience for the one after it.

    A process that sleeps takes longer to wake than most calls take. So a message is looked for,
    and waited for asleep where it does not come soon, or somebody else wants the processor: then
    a look takes long. The processor is not yielded: where many want it, it is gone for long.

    Args:
        pipe: Where it comes. On Windows no pipe can be looked at.
        patience: How long to look for it [s].
    """
    began = now = time.perf_counter()
    calm, until = True, began + max(patience, SPIN)
    while os.name != "nt" and calm and now < until and not select.select([pipe], [], [], 0)[0]:
        before, now = now, time.perf_counter()
        calm = now - before < SPIN
    facts, packed = pickle.load(pipe)
    waited = time.perf_counter() - began
    if not calm or waited > LONGEST:
        patience = PAUSE
    elif waited > patience:
        patience += MORE
    arrays = {
        name: np.frombuffer(buffer, kind).reshape(shape).copy()
        for name, (shape, kind, buffer) in packed.items()
    }
    return facts, arrays, patience


class Answerer:
    """The models and worlds of this process, by number, and what can be asked of them."""

    def __init__(self, engine) -> None:
        self.engine, self.things = engine, {}

    def keep(self, thing):
        """Keep a model and return its number."""
        self.things[id(thing)] = thing
        return id(thing)

    def load(self, job, edits):
        """Compile a file and edit fields; return the model's number, and the fields as in the file.

        Raises:
            ValueError: The file is another one than when it was loaded.
        """
        names = job.get("fields", ())
        options = {"read": job["read"]} if "read" in job else {}
        model, facts, fields = self.engine.load(job["file"], job["text"], names, **options)
        read = (array.tobytes() for array in fields.values())
        digest = hashlib.sha256(b"".join([repr(facts).encode(), *read])).hexdigest()
        if job.get("digest", digest) != digest:
            raise ValueError(job["file"] + " is another file than when it was loaded")
        if edits or job.get("flags"):
            self.engine.edit(model, edits, job["flags"])
        return {"model": self.keep(model), "digest": digest, **facts}, fields

    def written(self, job, _):
        """Return the MJCF that the engine writes of a file."""
        options = {"read": job["read"]} if "read" in job else {}
        return {"text": self.engine.written(job["file"], job["text"], **options)}, {}

    def make(self, job, _):
        """Make a world of a model."""
        world = self.engine.Simulation(self.things[job["model"]])
        facts = {name: getattr(world, name) for name in ("memory", "kept_memory", "unavailable")}
        return {"world": self.keep(world), **facts}, {}

    def run(self, job, arrays):
        """Place a state if one is given, take a command and steps, and one more if it is asked."""
        world = self.things[job["world"]]
        if "state" in arrays:
            world.place(arrays["state"])
        world.command(arrays["ctrl"])
        taken = world.advance(job["steps"], job["fastest"])
        states = {"before": world.state()}
        if taken == job["steps"] and job["ahead"]:
            world.advance(1, np.inf)
            states["after"] = world.state()
        return {"taken": taken}, states

    def look(self, job, arrays):
        """Return the derived arrays of a state and a command, or of where the last step started."""
        world = self.things[job["world"]]
        if "ctrl" in arrays:
            world.place(arrays["state"])
            world.command(arrays["ctrl"])
            world.forward()
        return {}, world.derived(arrays["state"])


def end_with(pipe) -> None:
    """End when nobody is left at the other side of a pipe."""
    end = select.poll()
    end.register(pipe, 0)  # its end is told unasked
    end.poll()
    os._exit(0)


def main() -> None:
    """Answer until there is nobody to ask."""
    source, out = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what an engine prints is not an answer
    if hasattr(select, "poll"):
        threading.Thread(target=end_with, args=(source,), daemon=True).start()
    engine = ModuleType("engine")
    vars(engine).update(runpy.run_path(sys.argv[1]))
    server = Answerer(engine)
    patience = SPIN
    while True:
        try:
            job, arrays, patience = receive(source, patience)
        except EOFError:
            return
        for number in job["free"]:  # models and worlds that nobody needs any more
            server.things.pop(number, None)
        try:
            answer = getattr(server, job["verb"])(job, arrays)
        except Exception as error:
            answer = {"error": " ".join(str(error).split()) or type(error).__name__}, {}
        send(out, *answer)


if __name__ == "__main__":
    main()
