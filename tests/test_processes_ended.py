"""Processes of ours that end by a signal, by their computing, or with the one that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest

from statemachine.cli.long_work import LongWorkReporter
from statemachine.processes.parallel import unwinding

from .support.requirements import ROOT

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and forks are POSIX")

UNWINDING = """
import os, signal, sys
from statemachine.processes.parallel import unwinding
try:
    with unwinding(at_once={at_once}) as raise_if_ended:
        try:
            os.kill(os.getpid(), signal.{name})
            print("went on", flush=True)
            raise_if_ended()
            print("not here", flush=True)
        finally:
            os.kill(os.getpid(), signal.{name})  # a second one does not disturb
            print("unwound", flush=True)
finally:
    print("left", flush=True)
"""


def _run(code: str, **options: object) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=environment,
        timeout=30,
        check=False,
        **options,  # type: ignore[call-overload]  # options of subprocess
    )


@pytest.mark.parametrize(
    ("at_once", "lines"), [(True, ["unwound"]), (False, ["went on", "unwound"])]
)
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_unwinds_and_then_ends_the_process_as_usual(
    name: str, at_once: bool, lines: list[str]
) -> None:
    done = _run(UNWINDING.format(at_once=at_once, name=name))
    assert done.returncode == -getattr(signal, name)
    assert done.stdout.split("\n")[:-1] == lines


def test_an_interrupt_unwinds_and_is_raised() -> None:
    done = _run(UNWINDING.format(at_once=True, name="SIGINT"))
    assert done.stdout.split("\n")[:-1] == ["unwound", "left"]
    assert "KeyboardInterrupt" in done.stderr


def test_a_signal_that_somebody_takes_becomes_an_exit() -> None:
    taken = "import signal\nsignal.signal(signal.SIGTERM, lambda *_: print('taken', flush=True))\n"
    done = _run(taken + UNWINDING.format(at_once=True, name="SIGTERM"))
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stdout.split("\n")[:-1] == ["unwound", "taken", "left"]


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    ignored = "import signal\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
    done = _run(ignored + UNWINDING.format(at_once=True, name="SIGHUP"))
    assert done.returncode == 0
    assert done.stdout.split("\n")[:-1] == ["went on", "not here", "unwound", "left"]


def test_a_signal_that_comes_last_is_not_lost() -> None:
    code = UNWINDING.format(at_once=False, name="SIGTERM").replace("raise_if_ended()", "pass")
    done = _run(code)
    assert done.returncode == -signal.SIGTERM
    assert done.stdout.split("\n")[:-1] == ["went on", "not here", "unwound"]


def test_afterwards_signals_are_taken_by_whom_they_were() -> None:
    before = [signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)]
    with unwinding():
        inside = [signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT)]
    after = [signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)]
    assert after == before
    assert inside[0] == inside[1] != before[0]


def test_beside_the_main_thread_no_signal_is_taken() -> None:
    seen: list[object] = []

    def beside() -> None:
        with unwinding() as raise_if_ended:
            raise_if_ended()
            seen.append(signal.getsignal(signal.SIGTERM))

    before = signal.getsignal(signal.SIGTERM)
    thread = threading.Thread(target=beside)
    thread.start()
    thread.join()
    assert seen == [before]


LIMITED = """
import resource, sys, time
from statemachine.processes.sandbox import limit_cpu
before = time.process_time()
limit_cpu({seconds}, sys.stderr)
print(*resource.getrlimit(resource.RLIMIT_CPU), flush=True)
while {condition}:
    took = time.process_time() - before
print("ended by itself")
"""


def test_a_process_ends_after_so_much_computing_and_says_where() -> None:
    began = os.times().children_user + os.times().children_system
    done = _run(LIMITED.format(seconds=0.3, condition="True"))
    used = os.times().children_user + os.times().children_system - began
    assert done.returncode == -signal.SIGPROF
    assert "line 8" in done.stderr  # the loop, and no line before
    assert 0.3 <= used < 2.5


def test_a_process_that_computes_less_ends_by_itself() -> None:
    done = _run("took = 0\n" + LIMITED.format(seconds=5.0, condition="took < 0.05"))
    assert (done.returncode, done.stdout.split("\n")[1]) == (0, "ended by itself")


def test_the_limit_of_the_system_is_a_second_later() -> None:
    done = _run("took = 1\n" + LIMITED.format(seconds=40.0, condition="took < 0.05"))
    soft, hard = map(int, done.stdout.split("\n")[0].split())
    assert soft == hard
    assert soft - 40 in (2, 3)  # of what was computed until then, a part of a second or one


CHILD = """
import os, sys, time
from statemachine.processes import end_with_parent
end_with_parent()
print(os.getpid(), flush=True)
time.sleep(60)
"""


def test_a_process_ends_with_the_one_that_started_it() -> None:
    parent = (
        "import subprocess, sys, time\n"
        f"child = subprocess.Popen([sys.executable, '-c', {CHILD!r}], stdout=subprocess.PIPE)\n"
        "print(child.stdout.readline().decode(), flush=True)\n"
    )
    done = _run(parent)
    number = int(done.stdout.split()[0])
    deadline = time.monotonic() + 10
    while _lives(number) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _lives(number)


def test_a_process_lives_while_the_one_that_started_it_does() -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", CHILD], stdout=subprocess.PIPE, env=environment
    ) as child:
        assert child.stdout is not None
        child.stdout.readline()
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(1.3)
        child.kill()


def test_a_silent_child_prints_nothing_and_reads_nothing() -> None:
    code = (
        "import os, sys\n"
        "from statemachine.processes.parallel import silence_child\n"
        "said = os.dup(1)\n"
        "silence_child()\n"
        "print('a'); print('b', file=sys.stderr); os.write(1, b'c'); os.write(2, b'd')\n"
        "import faulthandler\n"
        "told = (os.read(0, 1), faulthandler.is_enabled())\n"
        "os.write(said, repr(told).encode())\n"
    )
    done = _run(f"import faulthandler; faulthandler.enable()\n{code}", input="x")
    assert (done.stdout, done.stderr) == ("(b'', False)", "")


def _lives(number: int) -> bool:
    """Tell whether a process lives; one that nobody waited for yet has ended."""
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return False
        return not Path("/proc").is_dir()
    return state != "Z"


def _stage_with_a_lost_interrupt() -> None:
    with LongWorkReporter().stage("a run") as progress:
        owner = _Owner()
        weakref.finalize(owner, signal.raise_signal, signal.SIGINT)
        del owner
        progress(0.5)
        pytest.fail("the interrupt was lost")


@pytest.mark.usefixtures("python_takes_signals")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_a_finalizer_swallows_ends_the_stage_all_the_same() -> None:
    with pytest.raises(KeyboardInterrupt):
        _stage_with_a_lost_interrupt()


@pytest.mark.usefixtures("python_takes_signals")
def test_an_interrupt_that_was_taken_ends_no_later_stage() -> None:
    with pytest.raises(KeyboardInterrupt), LongWorkReporter().stage("a run"):
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with LongWorkReporter().stage("another run") as progress:
        progress(1.0)


class _Owner:
    """What goes, with what is called then."""


@pytest.fixture
def python_takes_signals() -> Iterator[None]:
    """Let a Ctrl-C raise, as in a program that nobody watches."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
