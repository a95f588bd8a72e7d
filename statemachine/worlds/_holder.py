"""Some of many worlds, in the process that holds them, and what can be asked of them."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..interface import (
    INPUTS,
    MOCAP,
    Array,
    Data,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..interface.records import Errors
from ..processes import resident_memory

# Of each array where it starts, its shape and its type.
Layout = dict[str, tuple[int, tuple[int, ...], str]]


class StepStopped(BaseException):
    """Nobody wants any longer what is being done."""


def arrays_in(memory: Any, layout: Layout) -> dict[str, NDArray[Any]]:
    """The arrays of a layout."""
    return {
        name: np.frombuffer(memory, kind, int(np.prod(shape)), start).reshape(shape)
        for name, (start, shape, kind) in layout.items()
    }


class Holder:
    """World `number`, and every `workers`-th after it, as Data beside the arrays of all worlds.

    Attributes:
        running: Whether a Data is being changed; this may be interrupted.
    """

    def __init__(self, memory: Any, number: int, model: Any) -> None:
        self._memory, self._number, self._model = memory, number, model
        self.running = False
        self._variants: dict[bytes, Model] = {}  # by the options that they differ in
        self._models: list[Model] = []
        self._data: list[Data] = []
        self._inputs: list[list[tuple[Array, Array]]] = []  # of a Data, and its row of all

    def stopped(self) -> bool:
        """Whether nobody wants any longer what is being done."""
        return False

    def answer(
        self, verb: str, argument: int, payload: Any, of_ids: bool, wanted: int
    ) -> tuple[Any, Exception | None, Errors]:
        """Do what is asked; the value, what was raised, and the error of each world that ended.

        Args:
            verb: A method of this class, without its underscore.
            argument: A whole number.
            payload: Anything.
            of_ids: Whether it is for the worlds of `ids` only.
            wanted: The derived arrays that are read afterwards, as bits.
        """
        self._errors: Errors = {}
        value: Any = None
        raised: Exception | None = None
        try:
            places: Sequence[int] = range(len(self._data))
            if of_ids:
                places = np.flatnonzero(self._chosen[self._number :: self._stride]).tolist()
            value = getattr(self, f"_{verb}")(argument, payload, places)
            self._derive(wanted, payload, places)
        except StepStopped:
            pass
        except Exception as error:
            raised = error
        return value, raised, self._errors

    def close(self) -> None:
        """Give back what the engine holds."""
        for data in self._data:
            data.close()

    def _world(self, place: int) -> int:
        return self._number + place * self._stride

    def _start(self, _argument: int, job: Mapping[str, Any], _places: Any) -> dict[str, Any]:
        """Make the first two Data: what they take tells what all will."""
        self._stride, self._derived, self._options = job["workers"], job["derived"], job["options"]
        self._all = len(range(self._number, job["n"], self._stride))
        self._arrays = arrays = arrays_in(self._memory, job["layout"])
        self._time, self._chosen, self._rows = arrays["time"], arrays["ids"], arrays["rows"]
        self._make(1)
        first = resident_memory()
        self._make(2)
        of_one = resident_memory() - first if len(self._data) == 2 else 0
        return {"each": of_one, "left": self._all - len(self._data)}

    def _fill(self, _argument: int, _payload: Any, _places: Any) -> Any:
        self._make(self._all)
        return [data._layout for data in self._data[: None if self._options else 1]]

    def _make(self, most: int) -> None:
        while len(self._data) < min(most, self._all):
            world = self._world(len(self._data))
            options = {name: values[world] for name, values in self._options.items()}
            key = pickle.dumps(options)
            if key not in self._variants:
                self._variants[key] = self._model.replace(**options) if options else self._model
            data = make_data(self._variants[key])
            self._models.append(self._variants[key])
            self._data.append(data)
            names = *INPUTS, *MOCAP
            self._inputs.append([(getattr(data, k), self._arrays[k][world]) for k in names])
            self._take(len(self._data) - 1)

    def _put(self, place: int) -> None:
        """Copy what the arrays have into a Data, bit by bit: it sees itself what was written."""
        data, time = self._data[place], self._time.item(self._world(place))
        for own, row in self._inputs[place]:
            own[:] = row
        if time != data.time:
            data.time = time

    def _take(self, place: int) -> None:
        """Copy what a Data has into the arrays: in a line without a call, where no signal comes."""
        world, time = self._world(place), self._data[place].time
        (qpos, q), (qvel, v), (ctrl, u), (where, w), (turn, t) = self._inputs[place]
        q[:], v[:], u[:], w[:], t[:], self._time[world] = qpos, qvel, ctrl, where, turn, time

    def _step(self, nstep: int, _payload: Any, places: Sequence[int]) -> None:
        self._for_all(places, partial(step, nstep=nstep))

    def _forward(self, _argument: int, _payload: Any, places: Sequence[int]) -> None:
        self._for_all([k for k in places if self._world(k) not in self._errors], forward)

    def _step_and_forward(self, nstep: int, payload: Any, places: Sequence[int]) -> None:
        self._step(nstep, payload, places)
        self._forward(0, payload, places)

    def _reset(self, key: int, _payload: Any, places: Sequence[int]) -> None:
        self._for_all(places, partial(reset, keyframe=None if key < 0 else key), True)

    def _for_all(
        self, places: Sequence[int], call: Callable[[Model, Data], None], overwrites: bool = False
    ) -> None:
        """Call a verb for each world that is meant; what it raises ends this world.

        Where it overwrites the Data, what is in the arrays does not matter, and it must not raise.
        """
        for place in places:
            if self.stopped():
                return
            begun = False
            try:
                if not overwrites:
                    self._put(place)
                begun = self.running = True
                call(self._models[place], self._data[place])
            except Exception as error:
                self.running = False
                if overwrites:
                    raise
                self._errors[self._world(place)] = error
            finally:
                self.running = False
                if begun:  # interrupted or not: the Data is where it was, or where it was to be
                    self._take(place)

    def _get_states(self, _argument: int, _payload: Any, places: Sequence[int]) -> Any:
        blobs = {}
        for place in places:
            self._put(place)
            blobs[self._world(place)] = get_state(self._models[place], self._data[place]).blob
        return blobs

    def _set_states(self, _argument: int, states: Mapping[int, State], places: Any) -> None:
        for place in places:
            self._for_all([place], partial(set_state, state=states[self._world(place)]), True)

    def _record(self, every: int, layout: Layout, places: Sequence[int]) -> None:
        arrays = arrays_in(self._memory, layout)
        commands = arrays.pop("commands", None)
        rows = next(iter(layout.values()))[1][1]

        def run(world: int, model: Model, data: Data) -> None:
            for row in range(rows):
                if commands is not None:
                    data.ctrl[:] = commands[world, row]
                step(model, data, every)
                for name, array in arrays.items():
                    array[world, row] = getattr(data, name)
                self._rows[world] = row + 1

        for place in places:
            self._for_all([place], partial(run, self._world(place)))

    def _derive(self, wanted: int, _payload: Any, places: Sequence[int]) -> None:
        """Write derived arrays of the worlds that are meant, but of those that have just ended."""
        names = [name for k, name in enumerate(self._derived) if wanted >> k & 1]
        for place in places if names else ():
            world = self._world(place)
            if self.stopped():
                return
            for name in names if world not in self._errors else ():
                self._arrays[name][world] = getattr(self._data[place], name)
