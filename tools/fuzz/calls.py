"""Calls of the verbs, in any order and with any argument, from one thread and from several.

A call may succeed, or raise one of the library's errors in one line; where it raises and the
Data does not refuse from then on, nothing has changed. Nothing that is read is NaN.
"""

from __future__ import annotations

import random
import threading
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import statemachine as sm
from statemachine.errors import BusyDataError, StateMachineError
from statemachine.interface import DERIVED, INPUTS

from ._tally import Tally

TRIES = 150_000
_THREADS = 3
_ODD: tuple[Any, ...] = (
    0, -1, True, None, 1.5, float("nan"), float("inf"), 1e300, 10**400, 2**31, "1", "", b"x", [],
    [[1], [1, 2]], {}, (), object(), np.float64("nan"), np.array([]), np.array("x"), 1j, "\ud800",
    slice(1), int, np.zeros((2, 2)), "home", "\x00",
)  # fmt: skip


class _Calls:
    """A few Data, and random calls on them."""

    def __init__(self, seed: int) -> None:
        self.random, self.numbers = random.Random(seed), np.random.default_rng(seed)
        self.models = [sm.load("so101/scene_box"), sm.load("so101/scene").replace(substeps=2)]
        self.datas = [(model, sm.make_data(model)) for model in self.models for _ in (0, 1)]
        self.states = [sm.get_state(model, data) for model, data in self.datas]

    def draw(self) -> tuple[str, sm.Data, Callable[[], Any]]:
        """Draw a call: what it is, on which Data, and how it is made."""
        chance = self.random
        model, data = chance.choice(self.datas)
        if chance.random() < 0.1:
            model = chance.choice([*self.models, *_ODD])
        odd = chance.choice(_ODD)
        entry, value = chance.choice(INPUTS), self.value()
        count = chance.choice([1, 1, 1, 2, 5, odd])
        key, state = chance.choice([None, 0, odd]), chance.choice([*self.states, odd])
        option = chance.choice(["gravity", "timestep", "substeps", "damping", "limits"])
        name = chance.choice([*DERIVED, "contacts", "time"])
        calls: dict[str, Callable[[], Any]] = {
            f"step({count!r:.40})": lambda: sm.step(model, data, count),
            "forward": lambda: sm.forward(model, data),
            f"reset({key!r:.40})": lambda: sm.reset(model, data, key),
            "get_state": lambda: self.states.__setitem__(0, sm.get_state(model, data)),
            f"set_state({type(state).__name__})": lambda: sm.set_state(model, data, state),
            f"{entry} = {value!r:.40}": lambda: setattr(data, entry, value),
            f"{entry}[0] = {odd!r:.40}": lambda: self.write(data, entry),
            f"time = {odd!r:.40}": lambda: setattr(data, "time", odd),
            name: lambda: getattr(data, name),
            f"replace({option}={odd!r:.40})": lambda: self.models[0].replace(**{option: odd}),
            f"load({odd!r:.40})": lambda: sm.load(odd),
        }
        words = chance.choice(list(calls))
        return words, data, calls[words]

    def value(self) -> Any:
        """Draw a value to assign to an array, valid or not."""
        size = self.random.choice([6, 6, 12, 13, 13, 0, 5])
        value = self.numbers.normal(size=size) * self.random.choice([0.01, 1, 1e5])
        return self.random.choice([value, value.tolist(), value.astype("f4"), *_ODD])

    def write(self, data: sm.Data, entry: str) -> None:
        """Write into an array past the checks, as a controller does."""
        array = getattr(data, entry)
        number = self.random.choice([0.0, 0.1, -0.1, 1e11, float("nan"), float("inf")])
        array[self.random.randrange(len(array))] = number


def _looks(data: sm.Data) -> tuple[Any, ...]:
    return (*(getattr(data, name).tobytes() for name in INPUTS), data.time)


def _judge(words: str, data: sm.Data, call: Callable[[], Any], alone: bool) -> str:
    """Return what is wrong with the effect of a call; "" if nothing is."""
    before = _looks(data)
    try:
        value = call()
    except BusyDataError:
        return f"{words}: refused without a second thread" if alone else ""
    except (StateMachineError, TypeError) as error:
        if len(str(error).splitlines()) > 1:
            return f"{words}: {type(error).__name__} of several lines"
        ours = isinstance(error, StateMachineError) or "got " in str(error)
        if not ours:
            return f"{words}: TypeError {error}"
        if alone and not data._unusable and _looks(data) != before:
            return f"{words}: {type(error).__name__}, and something has changed"
        return ""
    except Exception as error:
        return f"{words}: {type(error).__name__} {str(error)[:80]}"
    if alone and isinstance(value, np.ndarray) and not np.isfinite(value).all():
        return f"{words}: not a number, in silence"
    if alone and words.startswith(("step", "forward", "reset", "set_state")):
        arrays = (data.qpos, data.qvel, data.qacc)
        if not data._unusable and not all(np.isfinite(array).all() for array in arrays):
            return f"{words}: not a number after it, in silence"
    return ""


def run(seed: int, tries: int) -> Tally:
    """Make half of the calls from one thread, half of them from several at once."""
    tally, failures = Tally(), set[str]()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        calls, tally.tried = _Calls(seed), tries
        for _ in range(tries // 2):
            failures.add(_judge(*calls.draw(), alone=True))

        def work(number: int) -> None:
            mine = _Calls(seed + number)
            mine.models, mine.datas = calls.models, calls.datas  # shared on purpose
            for _ in range(tries // 2 // _THREADS):
                failures.add(_judge(*mine.draw(), alone=False))

        threads = [threading.Thread(target=work, args=(k,)) for k in range(_THREADS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    tally.failures += sorted(failures - {""})
    return tally
