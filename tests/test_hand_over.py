"""A Data goes from thread to thread: at moments that are chosen, and at many that are not."""

from __future__ import annotations

import dis
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
from statemachine.interface import exclusive_access, verbs

from .support.data_uses import USES
from .support.processes import runs_in_silence
from .support.requirements import ROOT

TAKES = {"step": verbs.step, "with_exclusive_access": exclusive_access.with_exclusive_access}

# Instructions of CPython 3.11 to 3.13 that neither call a function of Python's nor look at signals
# and other threads: of slots, locals and whole numbers, which is what they are used on here.
ATOMIC = {
    *("CACHE", "EXTENDED_ARG", "NOP", "TO_BOOL", "LOAD_ATTR", "STORE_ATTR"),
    *("LOAD_FAST", "LOAD_FAST_LOAD_FAST", "LOAD_CONST", "STORE_FAST"),
    *("POP_JUMP_FORWARD_IF_TRUE", "POP_JUMP_IF_TRUE"),
}
# After these it looks at signals, and at threads that wait.
SWITCHES = ("CALL", "JUMP_BACKWARD", "RESUME")


@pytest.mark.parametrize("name", TAKES)
def test_no_call_or_jump_back_lies_between_test_and_store(name: str) -> None:
    """From the test whether nobody uses the Data to the store that this thread does, and holds."""
    if sys.implementation.name != "cpython" or not (3, 11) <= sys.version_info < (3, 14):
        pytest.skip(f"the instructions of {sys.implementation.name} {sys.version} are not known")
    if not getattr(sys, "_is_gil_enabled", lambda: True)():
        pytest.skip("without the global lock two threads run at once")
    code = list(dis.get_instructions(TAKES[name]))
    stores = [
        k for k, each in enumerate(code) if (each.opname, each.argval) == ("STORE_ATTR", "thread")
    ]
    first = stores[0]  # the others give the Data back
    tested = max(k for k in range(first) if code[k].argval == "thread")
    held = next(k for k in range(first, len(code)) if "held" in str(code[k].argval))
    between = {each.opname for each in code[tested : held + 1]}
    assert "STORE_FAST" in {name.removesuffix("_LOAD_FAST") for name in between}
    assert between - {"STORE_FAST_LOAD_FAST"} <= ATOMIC


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
    """Return how often both threads are inside, over all schedules of one kind.

    The other thread is inside a step. At one moment here at which Python may change threads it
    ends that step; at a later one, or the same, it begins another.
    """
    model = sm.load("so101")
    data = sm.make_data(model)
    other = Other(model, data, monkeypatch.setattr)

    def run(out: int, again: int) -> int:
        """Use the Data in this schedule; how many such moments there were."""
        count = 0
        before: dict[Any, str] = {}  # the last instruction of each frame

        def trace(frame: Any, event: str, _arg: object) -> Any:
            nonlocal count
            if frame.f_code.co_name not in TAKES:
                return None
            frame.f_trace_opcodes = True
            if event == "opcode":
                may_switch = before.get(frame, "RESUME").startswith(SWITCHES)
                before[frame] = dis.opname[frame.f_code.co_code[frame.f_lasti]]
                if may_switch:
                    count += 1
                    if count == out:
                        other.end()
                    if count == again:
                        other.begin()
            return trace

        other.begin()
        tracer = sys.gettrace()
        sys.settrace(trace)
        try:
            USES[name](model, data)
        except BusyDataError:
            pass
        finally:
            sys.settrace(tracer)
            other.end()
        return count

    assert run(0, 0) >= 3  # or nothing was traced, which proves nothing
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


# A call between the test and the store; and no look at who uses the Data.
MUTATIONS = {
    "owner.thread = me; ": "kind_of(data); owner.thread = me; ",
    "raise _busy(data)": "pass",
}


@pytest.mark.parametrize("line", MUTATIONS)
def test_a_wrong_hand_over_is_found(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    replaced = 0
    for module, name in ((exclusive_access, "with_exclusive_access"), (verbs, "step")):
        source = inspect.getsource(getattr(module, name)).replace(line, MUTATIONS[line])
        replaced += MUTATIONS[line] in source
        space = dict(vars(module))
        exec("from __future__ import annotations\n" + source, space)
        for user in (exclusive_access, verbs, data_module):
            monkeypatch.setattr(user, name, space[name], raising=False)
    assert replaced
    assert _doubles("contacts", monkeypatch) > 0


LONG = pytest.param(10, marks=pytest.mark.slow)


@pytest.mark.parametrize("seconds", [1, LONG])
def test_threads_that_use_one_data_all_the_time_are_never_inside_together(seconds: int) -> None:
    """Four threads use one Data, and Python changes between them whenever it may."""
    runs_in_silence(
        f"""
import itertools, sys, threading, time
import statemachine as sm
from tests.support.data_uses import USES

model = sm.load("so101")
data, end, inside, entered = sm.make_data(model), time.time() + {seconds}, [], set()
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
    for use in itertools.cycle(USES.values()):
        try:
            use(model, data)
        except sm.errors.BusyDataError:
            refused.append(1)
        except BaseException as error:
            failed.append(error)
        if time.time() > end:
            if failed or len(entered) > 1 or time.time() > end + 60:
                return
            time.sleep(1e-3)  # on a busy machine those that are refused may leave no other a chance

object.__setattr__(data, "_advance", watched)
sys.setswitchinterval(1e-6)
threads, failed = [threading.Thread(target=loop) for _ in range(4)], []
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert data._owner.thread == 0
assert not failed, failed
assert len(entered) >= 2 and len(refused) >= 100, (len(entered), len(refused))
""",
        ROOT,
    )


# What interrupts the main thread, once and within 0.1 ms, when `arm` is called.
SIGNAL = """
import signal

armed = False

def interrupt(*_):
    global armed
    if armed:
        armed = False
        raise Interrupt

signal.signal(signal.SIGALRM, interrupt)

def arm():
    global armed
    armed = True
    signal.setitimer(signal.ITIMER_REAL, delay.uniform(1e-6, 1e-4))
"""
FROM_A_THREAD = """
import ctypes

main, wanted = threading.get_ident(), threading.Semaphore(0)

def interrupt():
    while True:
        wanted.acquire()
        time.sleep(delay.uniform(1e-6, 1e-4))
        kind = ctypes.py_object(Interrupt)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(main), kind)

threading.Thread(target=interrupt, daemon=True).start()
sys.setswitchinterval(1e-5)
arm = wanted.release
"""


@pytest.mark.parametrize("seconds", [1, LONG])
@pytest.mark.parametrize(
    "source",
    [
        pytest.param(
            SIGNAL,
            id="signal",
            marks=pytest.mark.skipif(sys.platform == "win32", reason="signals"),
        ),
        pytest.param(FROM_A_THREAD, id="another thread"),
    ],
)
def test_an_interrupt_leaves_nothing_taken(source: str, seconds: int) -> None:
    """Hundreds of times at moments that nobody chose: another thread goes on."""
    runs_in_silence(
        f"""
import random, sys, threading, time
import statemachine as sm
from tests.support.data_uses import USES

class Interrupt(BaseException):
    pass

model, delay = sm.load("so101"), random.Random(0)
{source}
data, end, interrupts = sm.make_data(model), time.time() + {seconds}, 0
while time.time() < end:
    try:
        arm()
        while True:
            for use in USES.values():
                use(model, data)
    except Interrupt:
        interrupts += 1
    assert data._owner.thread == 0, interrupts
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
    if data._unusable:
        sm.reset(model, data)
assert interrupts >= 100 * {seconds}, interrupts
""",
        ROOT,
    )
