"""What C code prints is caught; what anybody else prints is not."""

from __future__ import annotations

import ctypes
import os
import re
import sys

import pytest

from statemachine.installed import silence

from .support.processes import runs_in_silence
from .support.requirements import ROOT

pytestmark = pytest.mark.skipif(
    sys.platform not in ("linux", "darwin"), reason="C's streams can be exchanged in its library"
)


forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")


def _print(line: bytes) -> None:
    ctypes.CDLL(None).puts(line)


def test_what_c_prints_is_caught() -> None:
    libc = ctypes.CDLL(None)
    with silence() as lines:
        libc.puts(b"one")
        libc.perror(b"two")
        assert lines == []
    assert re.fullmatch("one\ntwo: .*", "\n".join(lines))
    with silence() as lines:
        libc.puts(b"three")
    assert lines == ["three"]


def test_what_is_caught_within_is_told_within() -> None:
    with silence() as outer:
        _print(b"one")
        with silence() as inner:
            _print(b"two")
        _print(b"three")
    assert (outer, inner) == (["one", "three"], ["two"])


def test_after_an_error_the_streams_are_back(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ZeroDivisionError), silence() as lines:  # noqa: PT012
        _print(b"caught")
        raise ZeroDivisionError
    assert lines == ["caught"]
    _print(b"seen")
    ctypes.CDLL(None).fflush(None)
    assert capfd.readouterr() == ("seen\n", "")


# A thread prints two hundred numbered lines while the engine loads and is quiet.
PRINTING = """
import os, threading, time
import statemachine as sm

model = sm.load("so101/scene", backend="pybullet")

def work():
    for k in range(200):
        os.write(1, b"%d\\n" % k)
        time.sleep(0.0005)

printing = threading.Thread(target=work)
printing.start()
made = 0
while printing.is_alive() or made < 3:
    sm.make_data(model).close()
    made += 1
"""

# The child has neither the other thread's lock nor its streams.
FORKING = """
import ctypes, os, threading
from statemachine.installed import silence

begun, ended = threading.Event(), threading.Event()

def work():
    with silence():
        begun.set()
        ended.wait(20)

thread = threading.Thread(target=work)
thread.start()
begun.wait(10)
child = os.fork()
if not child:
    libc = ctypes.CDLL(None)
    with silence() as lines:
        libc.puts(b"caught")
    libc.puts(b"seen")
    libc.fflush(None)
    os._exit(lines != ["caught"])
_, status = os.waitpid(child, 0)
ended.set()
thread.join()
assert status == 0, status
"""

# The worlds that the Data of one Model share are behind a lock, too.
USING = """
import os, threading
import statemachine as sm
from statemachine.backends import HiddenWorld

model = sm.load("so101/scene", backend="pybullet")
data = sm.make_data(model)
begun, ended = threading.Event(), threading.Event()

def work():
    with HiddenWorld.lock:
        begun.set()
        ended.wait(20)

thread = threading.Thread(target=work)
thread.start()
begun.wait(10)
child = os.fork()
if not child:
    sm.forward(model, data)
    os._exit(not data.qacc.any() or not data.xpos.any())
_, status = os.waitpid(child, 0)
ended.set()
thread.join()
assert status == 0, status
"""


@pytest.mark.parametrize(
    ("code", "printed"),
    [
        (PRINTING, "".join(f"{k}\n" for k in range(200))),
        pytest.param(FORKING, "seen\n", marks=forks),
        pytest.param(USING, "", marks=forks),
    ],
    ids=["printing", "forking", "using"],
)
@pytest.mark.usefixtures("bullet")
def test_other_threads_lose_nothing_and_a_fork_does_not_hang(code: str, printed: str) -> None:
    runs_in_silence(code, ROOT, printed)
