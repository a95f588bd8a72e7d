"""One Data in several threads that take turns at every bytecode: each call alone, or refused.

A call that was let in did all of its work and nothing of another's: the steps that were counted
lead to the bits that one thread makes with as many. A crash is seen by who runs this.
"""

from __future__ import annotations

import random
import sys
import threading

import statemachine as sm
from statemachine.errors import BusyDataError
from statemachine.installed import available

from ._tally import Tally

TRIES = 300
_THREADS, _CALLS = 4, 300
_SWITCH = 1e-6  # seconds after which Python lets another thread go on, if it can


def run(seed: int, tries: int) -> Tally:
    """Step one Data from all threads at once, again and again."""
    draw, tally = random.Random(seed), Tally()
    engines = [name for name in ("mujoco", "pybullet") if name in available()[0]]
    models = {name: sm.load("so101", backend=name) for name in engines}
    before = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH)
    try:
        for _ in range(tries):
            name = draw.choice(engines)
            tally.tried += 1
            problem = examine(models[name], draw)
            if problem:
                tally.failures.append(f"{name}: {problem}")
    finally:
        sys.setswitchinterval(before)
    return tally


def examine(model: sm.Model, draw: random.Random) -> str:
    """Return what is wrong with a Data that all threads step, or ""."""
    done, wrong = [0] * _THREADS, list[str]()

    def work(number: int, counts: list[int]) -> None:
        for count in counts:
            try:
                sm.step(model, data, count)
            except BusyDataError:
                continue
            except Exception as error:
                wrong.append(f"{type(error).__name__}: {error}")
            else:
                done[number] += count

    with sm.make_data(model) as data, sm.make_data(model) as alike:
        threads = [
            threading.Thread(target=work, args=(k, draw.choices([1, 1, 1, 3], k=_CALLS)))
            for k in range(_THREADS)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        if wrong:
            return wrong[0]
        try:
            sm.step(model, data)
        except BusyDataError:
            return "refused when all threads were gone"
        sm.step(model, alike, sum(done) + 1)
        same = data.qpos.tobytes() == alike.qpos.tobytes()
        return "" if same else f"{sum(done)} steps are others than one thread's"
