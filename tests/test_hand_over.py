"""A Data goes from thread to thread: at moments that are chosen, and at many that are not."""

from __future__ import annotations

import inspect
import itertools
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

import statemachine as sm
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.errors import BusyDataError
from statemachine.interface import data as data_module
from statemachine.interface import turns, verbs

from .support.processes import runs_in_silence
from .support.requirements import ROOT
from .support.turns import USES


class Other:
    """A second thread, which is inside a step of the Data from `begin` to `end`.

    Attributes:
        inside: Whether it is.
        doubles: How often this thread was inside meanwhile.
    """

    def __init__(
        self, model: sm.Model, data: sm.Data, patch: Callable[[Any, str, Any], None]
    ) -> None:
        self.inside, self.doubles = False, 0
        self._model, self._data = model, data
        self._go, self._done = threading.Semaphore(0), threading.Semaphore(0)
        object.__setattr__(data, "_advance", self._watched(data._advance))
        for name in ("_derive", "_reset"):
            right = getattr(MujocoData, name)
            patch(MujocoData, name, lambda *args, right=right: self._watched(right)(*args))
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _watched(self, right: Callable[..., Any]) -> Callable[..., Any]:
        def instead(*args: object) -> Any:
            if threading.current_thread() is not self._thread:
                self.doubles += self.inside
                return right(*args)
            self.inside = True
            self._done.release()
            self._go.acquire()
            self.inside = False

        return instead

    def _work(self) -> None:
        while True:
            self._go.acquire()
            with suppress(BusyDataError):
                verbs.step(self._model, self._data)
            self._done.release()

    def begin(self) -> None:
        """Begin a step: it is inside afterwards, or was refused."""
        self._go.release()
        assert self._done.acquire(timeout=300)

    def end(self) -> None:
        """End the step, if it is inside one."""
        if self.inside:
            self.begin()


def _doubles(name: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """How often both threads are inside, over all schedules of one kind.

    The other thread is inside a step. Before one instruction of `step` or `alone` here it ends
    that step; before a later one, or the same, it begins another.
    """
    model = sm.load("so101")
    data = sm.make_data(model)
    other = Other(model, data, monkeypatch.setattr)

    def run(out: int, again: int) -> int:
        """Use the Data in this schedule; how many instructions that took."""
        count = 0

        def trace(frame: Any, event: str, _arg: object) -> Any:
            nonlocal count
            if frame.f_code.co_name not in ("step", "alone"):
                return None
            frame.f_trace_opcodes = True
            if event == "opcode":
                count += 1
                if count == out:
                    other.end()
                if count == again:
                    other.begin()
            return trace

        other.begin()
        before = sys.gettrace()
        sys.settrace(trace)
        try:
            USES[name](model, data)
        except BusyDataError:
            pass
        finally:
            sys.settrace(before)
            other.end()
        return count

    assert run(0, 0) > 20  # or nothing was traced, which proves nothing
    for out in itertools.count(1):
        again = out
        while run(out, again) >= again:
            again += 1
        if again == out:  # the end was reached before the other ended its step
            return other.doubles
    return 0


@pytest.mark.parametrize("use", USES)
def test_no_schedule_lets_a_second_thread_in(use: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _doubles(use, monkeypatch) == 0


# A thread goes on where the Data is free again but not its own; a look and then the deletion.
MUTATIONS = {
    "refuse_unless_held(data)": "hasattr(turn, 'free') or refuse_unless_held(data)",
    "del turn.free; held = True": "turn.free; held = True; delattr(turn, 'free')",
}


@pytest.mark.parametrize("line", MUTATIONS)
def test_a_wrong_hand_over_is_found(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    holders, found = set(turns.HOLDERS), 0
    for module, name in ((turns, "alone"), (verbs, "step")):
        source = inspect.getsource(getattr(module, name)).replace(line, MUTATIONS[line])
        found += MUTATIONS[line] in source
        space = dict(vars(module))
        exec(
            "from __future__ import annotations\nfrom contextlib import suppress\n" + source, space
        )
        for user in (verbs, data_module):
            monkeypatch.setattr(user, name, space[name], raising=False)
        holders.add(space[name].__code__)
        monkeypatch.setattr(turns, "alone", verbs.alone)
    monkeypatch.setattr(turns, "HOLDERS", holders)
    assert found
    assert _doubles("contacts", monkeypatch) > 0


def test_threads_that_take_turns_all_the_time_are_never_inside_together() -> None:
    """Four threads use one Data, and Python changes between them whenever it may."""
    runs_in_silence(
        """
import sys, threading, time
import statemachine as sm
from tests.support.turns import USES

model = sm.load("so101")
data, end, inside, entered = sm.make_data(model), time.time() + 2.5, [], set()
advance, refused, barrier = data._advance, [], threading.Barrier(4)

def watched(*args):
    inside.append(threading.get_ident())
    advance(*args)
    entered.add(threading.get_ident())
    for _ in range(3):  # moments to change threads at
        assert len(inside) == 1, inside
    inside.pop()

def loop():
    barrier.wait()
    for use in 100_000 * list(USES.values()):
        try:
            use(model, data)
        except sm.errors.BusyDataError:
            refused.append(1)
        except BaseException as error:
            failed.append(error)
        if time.time() > end:
            if failed or len(entered) > 1 or time.time() > end + 60:
                return
            time.sleep(1e-3)  # on a busy machine those that are refused may leave no other a turn

object.__setattr__(data, "_advance", watched)
sys.setswitchinterval(1e-6)
threads, failed = [threading.Thread(target=loop) for _ in range(4)], []
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert hasattr(data._turn, "free")
assert not failed, failed
assert len(entered) >= 2 and len(refused) >= 100, (len(entered), len(refused))
""",
        ROOT,
    )


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_an_interrupt_leaves_nothing_taken() -> None:
    """Ctrl-C, thousands of times at moments that nobody chose: another thread goes on."""
    runs_in_silence(
        """
import random, signal, threading, time
import statemachine as sm
from tests.support.turns import USES

model = sm.load("so101")
data, end, interrupts, delay = sm.make_data(model), time.time() + 3, 0, random.Random(0)
armed = False

def interrupt(*_):
    global armed
    if armed:
        armed = False
        raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
while time.time() < end:
    try:
        armed = True
        signal.setitimer(signal.ITIMER_REAL, delay.uniform(1e-6, 1e-4))
        while True:
            for use in USES.values():
                use(model, data)
    except KeyboardInterrupt:
        interrupts += 1
    assert hasattr(data._turn, "free"), interrupts
    if interrupts % 20 == 0:
        failed = []

        def reset():
            try:
                sm.reset(model, data)
                sm.step(model, data)
            except BaseException as error:
                failed.append(error)

        thread = threading.Thread(target=reset)
        thread.start()
        thread.join()
        assert not failed, failed
    if data._trouble:
        sm.reset(model, data)
assert interrupts >= 200, interrupts
""",
        ROOT,
    )
