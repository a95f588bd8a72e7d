"""The sandbox: whatever a command does, we come back, and nothing of it is left."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures.process import BrokenProcessPool
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from statemachine.processes import sandbox
from statemachine.processes.parallel import worker_processes
from statemachine.processes.places import View, bare_python

from .support.claims import assert_has, refused
from .support.files import written_all
from .support.processes import lives, processes_with
from .support.requirements import ROOT

POSIX = pytest.mark.skipif(os.name != "posix", reason="limits and sessions are POSIX")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="processes are found in /proc")


def _python(
    code: str, cpu: float = 20.0, wall: float = 120.0, **more: Any
) -> sandbox.ProcessOutcome:
    """Run some code under limits, and with other arguments of `sandbox.run`."""
    named = {field.name for field in fields(sandbox.Limits)}
    further = {name: more.pop(name) for name in named & more.keys()}
    return sandbox.run([sys.executable, "-c", code], sandbox.Limits(cpu, wall, **further), **more)


def test_what_a_command_says_and_how_it_ends(tmp_path: Path) -> None:
    code = "import os, sys; print(os.getcwd(), os.environ.get('X')); sys.exit('no')"
    done = _python(code, cwd=tmp_path, env={"X": "y", "PATH": os.environ["PATH"]})
    assert (done.end, done.code) == ("code", 1)
    assert done.stdout.split() == [str(tmp_path.resolve()), "y"]
    assert done.stderr.strip() == "no"


def test_nothing_is_read_from_us() -> None:
    assert "EOFError" in _python("input()").stderr


def test_the_time_until_it_is_ready_does_not_count(tmp_path: Path) -> None:
    code = "import time; time.sleep(3.0); open('ready', 'w').close(); time.sleep(0.2)"
    ready = (tmp_path / "ready").exists
    done = _python(code, wall=2.5, start=100.0, started=ready, cwd=tmp_path)
    assert_has(done, started=True, end="code", code=0)
    never = _python("import time; time.sleep(60)", start=0.5, started=lambda: False)
    assert_has(never, started=False, end="clock")


def test_where_a_process_cannot_limit_itself_it_is_watched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("psutil")
    monkeypatch.setattr(sandbox, "WATCHED", True)
    busy = _python("import time\nwhile time.process_time() < 30: pass", cpu=1.0, start_cpu=60.0)
    assert busy.end == "cpu"
    assert busy.cpu < 10
    assert_has(_python("import time; time.sleep(1.5)", cpu=1.0), end="code", code=0)


def test_it_is_ended_from_outside() -> None:
    stop = threading.Event()
    threading.Timer(0.3, stop.set).start()
    assert _python("while True: pass", cpu=30.0, stop=stop).wall < 20


def test_a_flood_is_read_and_dropped() -> None:
    done = _python("import os\nfor _ in range(300): os.write(2, b'x' * 65536)", output_most=1000)
    assert (done.code, len(done.stderr)) == (0, 1000)


def test_a_flood_without_end_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox, "FLOOD_BYTES", 5_000_000)
    assert _python("import os\nwhile True: os.write(1, b'x' * 65536)").end == "flood"


@LINUX
def test_what_is_left_in_the_session_is_ended() -> None:
    done = _python(
        "import subprocess, sys\n"
        "p = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(50)'], env={})\n"
        "print(p.pid)"
    )
    assert done.code == 0
    assert done.wall < 15  # although it holds our pipes open
    assert not lives(int(done.stdout))


@LINUX
def test_what_left_the_session_is_found_and_ended() -> None:
    done = _python(
        "import os, time\n"
        "pid = os.fork()\n"
        "if pid == 0:\n"
        "    os.setsid()\n"
        "    time.sleep(50)\n"
        "else:\n"
        "    print(pid, flush=True)\n"
        "    while os.getsid(pid) == os.getsid(0): time.sleep(0.01)\n"
    )
    assert not lives(int(done.stdout))


@LINUX
def test_no_other_process_is_touched() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        _python("pass")
        assert lives(other.pid)


@POSIX
def test_a_program_that_is_not_there() -> None:
    done = sandbox.run(["no-such-program"], sandbox.Limits(cpu=5, wall=60))
    assert done.code == 1
    assert "no-such-program: " in done.stderr


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    refused((FileNotFoundError, "", lambda: _python("pass", cwd=tmp_path / "nowhere")))


# Shut in, where the system permits it.


def _shut_in(
    folder: Path, code: str, cpu: float = 20.0, wall: float = 120.0, **more: object
) -> sandbox.ProcessOutcome:
    return _python(code, cpu, wall, cwd=folder, writable=folder, **more)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder for a command that can be shut in; without such, there is nothing to test."""
    if sys.platform != "linux":
        pytest.skip("namespaces are Linux")
    place = tmp_path / "inside"
    place.mkdir()
    if _shut_in(place, "import os; print(os.getpid())").stdout != "2\n":
        pytest.skip("this system does not let a user make namespaces")
    return place


@LINUX
def test_where_a_user_can_make_namespaces_commands_are_shut_in() -> None:
    """Without this, what tests it would be skipped where a fault of ours is the reason."""
    spaces = "--map-root-user", "--mount", "--pid", "--net", "--ipc", "--fork", "--mount-proc"
    if shutil.which("unshare") is None:
        pytest.skip("there is no unshare here")
    if subprocess.run(["unshare", *spaces, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this system does not let a user make namespaces")
    assert sandbox.shut_in()


def test_shut_in_it_writes_in_its_folder_only(folder: Path) -> None:
    done = _shut_in(
        folder,
        "import os, tempfile\n"
        "open(os.path.expanduser('~/home'), 'w').close()\n"
        "open(os.path.join(tempfile.gettempdir(), 'temporary'), 'w').close()\n"
        "open(os.devnull, 'w').close()\n"
        f"open({str(folder.parent / 'outside')!r}, 'w')",
    )
    assert "Read-only file system" in done.stderr
    assert {entry.name for entry in folder.iterdir()} == {"home", "temporary"}
    assert [entry.name for entry in folder.parent.iterdir()] == ["inside"]


def test_shut_in_it_reaches_no_process_and_no_network(folder: Path) -> None:
    done = _shut_in(
        folder,
        "import ctypes, os, socket\n"
        "kill = ctypes.CDLL(None).kill\n"
        f"print(kill({os.getpid()}, 19))\n"
        "for number in (9, 15, 19): kill(os.getppid(), number)\n"
        "print(kill(-1, 0), flush=True)\n"
        "socket.create_connection(('127.0.0.1', 9))",
    )
    assert_has(done, stdout="-1\n-1\n", end="code", code=1)
    assert "Network is unreachable" in done.stderr


def test_shut_in_nothing_escapes(folder: Path) -> None:
    done = _shut_in(
        folder,
        f"# {folder}\n"
        "import os, time\n"
        "for _ in range(2):\n"
        "    if os.fork() == 0:\n"
        "        os.setsid()\n"
        "        open(str(os.getpid()), 'w').close()\n"
        "        time.sleep(50)\n"
        "        os._exit(0)\n"
        "while len(os.listdir()) < 2: time.sleep(0.01)\n"
        "os._exit(7)",
    )
    assert (done.end, done.code) == ("code", 7)
    assert not processes_with(f"# {folder}\n")
    assert done.wall < 20


@POSIX
@pytest.mark.parametrize("shut_in", [False, True])
def test_signals_and_limits_are_told_alike(shut_in: bool, request: pytest.FixtureRequest) -> None:
    run = partial(_shut_in, request.getfixturevalue("folder")) if shut_in else _python
    for code, end, number, limits in (
        ("import ctypes; ctypes.string_at(0)", "signal", 11, {}),
        ("import os; os.abort()", "signal", 6, {}),
        ("import os; os._exit(77)", "code", 77, {}),
        ("print('on', flush=True)\nwhile True: pass", "cpu", 24, {"cpu": 1.0}),
        ("x = bytearray(10**9)", "memory", 1, {"memory_most": 500_000_000}),
        ("print('on', flush=True)\nimport time; time.sleep(60)", "clock", 0, {"wall": 1.0}),
    ):
        done = run(code, **limits)
        assert (done.end, done.code, done.stdout) == (end, number, "on\n" * ("'on'" in code))
        assert done.cpu < 3


@LINUX
def test_where_it_cannot_be_shut_in_it_runs_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sandbox, "shut_in", lambda: False)
    done = _python("import os; print(os.getpid() > 2)", writable=tmp_path, cwd=tmp_path)
    assert_has(done, code=0, stdout="True\n")


def test_where_it_was_to_be_shut_in_and_is_not_it_does_not_run(folder: Path) -> None:
    done = _python("print('it runs')", writable=folder / "nowhere", cwd=folder)
    assert_has(done, code=1, stdout="")
    assert "cannot be shut in" in done.stderr


def test_what_is_asked_of_the_system_once(monkeypatch: pytest.MonkeyPatch) -> None:
    tries: list[int] = []
    monkeypatch.setattr(sandbox, "shut_in_answers", {})
    monkeypatch.setattr(sandbox, "runs_shut_in", lambda: not tries.append(1))
    if sys.platform == "linux":
        assert [sandbox.shut_in() for _ in range(3)] == [True] * 3
    monkeypatch.setattr(sys, "platform", "darwin")
    assert not sandbox.shut_in()
    assert len(tries) <= 1


@LINUX
def test_a_system_that_permits_no_namespaces_is_known_by_trying(folder: Path) -> None:
    # Within one user namespace the system is told to make no other.
    code = (
        "from statemachine.processes import sandbox\n"
        "open('/proc/sys/user/max_user_namespaces', 'w').write('0')\n"
        "print(sandbox.shut_in())"
    )
    done = subprocess.run(
        ["unshare", "-U", "-r", sys.executable, "-c", code],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    if "Permission denied" in done.stderr or done.returncode == 127:
        pytest.skip("there is no unshare here, or no way to forbid namespaces")
    assert done.stdout == "False\n", done.stderr


# What it sees of the files of this machine.


def _seen(folder: Path, code: str, *shown: Path) -> sandbox.ProcessOutcome:
    return _shut_in(folder, code, view=bare_python().with_more(shown))


def test_with_a_view_it_sees_python_and_what_is_shown(folder: Path) -> None:
    written_all(folder.parent, {"shown/a.txt": "a", "hidden/b.txt": "b", "link/c.txt": "c"})
    (folder.parent / "shown" / "out").symlink_to(folder.parent / "hidden" / "b.txt")
    done = _seen(
        folder,
        "import json, os\n"
        f"os.chdir({str(folder.parent)!r})\n"
        "print(sorted(os.listdir()), sorted(os.listdir('shown')), os.path.exists('shown/out'))\n"
        "print(sorted(set(os.listdir('/etc')) - {'ld.so.cache', 'alternatives'}))\n"
        "print(os.path.exists('/home'), os.path.exists('/var'), os.path.exists('/sys'))\n"
        "open('shown/new', 'w')",
        folder.parent / "shown",
    )
    first, etc, others = done.stdout.splitlines()
    assert first == "['inside', 'shown'] ['a.txt', 'out'] False"
    assert (etc, others) == ("[]", "False False False")
    assert "Read-only file system" in done.stderr


def test_with_a_view_there_is_no_way_back(folder: Path) -> None:
    secret = folder.parent / "secret.txt"
    secret.write_text("SECRET")
    done = _seen(
        folder,
        "import ctypes, glob, os\n"
        f"name = {str(secret)!r}\n"
        "tries = [name, '/proc/self/root' + name, '/proc/1/root' + name, '/proc/self/cwd' + name,\n"
        "         *(f'{link}/..{name}' for link in glob.glob('/proc/self/fd/*')),\n"
        "         *(f'/proc/{n}/root{name}' for n in range(20)), '/../../..' + name]\n"
        "print([t for t in tries if os.path.exists(t)])\n"
        "c = ctypes.CDLL(None, use_errno=True)\n"
        "print([c.unshare(f) for f in (0x10000000, 0x20000, 0x10020000)])\n"
        "print(c.umount2(b'/usr/lib', 2), c.mount(b'none', b'/', b'tmpfs', 0, None))\n"
        "print(c.ptrace(16, 1, 0, 0), len(os.listdir('/proc/self/fd')) <= 4)",
    )
    assert done.stdout == "[]\n[-1, -1, -1]\n-1 -1\n-1 True\n", done.stderr


def test_a_view_follows_links_to_what_it_shows(folder: Path) -> None:
    far = written_all(folder.parent, {"far/real/a.txt": "a"}) / "far"
    (far / "link").symlink_to("real")
    (folder.parent / "way").symlink_to(far / "link")
    place = folder.parent / "way" / "a.txt"
    assert _seen(folder, f"print(open({str(place)!r}).read())", place).stdout == "a\n"


def test_a_view_is_written_outside_in(tmp_path: Path) -> None:
    written_all(tmp_path, {"a/b/c/d.txt": "", "a/e.txt": ""})
    a, b = tmp_path / "a", tmp_path / "a" / "b"
    lines = View((b / "c" / "d.txt", a, a / "e.txt", tmp_path / "nowhere"), (b,)).lines()
    assert lines == [f"show {a}", f"empty {b}", f"show {b / 'c' / 'd.txt'}"]


# What processes share


def _grow() -> None:
    """Let joblib find, after the next call in this process, that it has grown too much."""
    executor = sys.modules["joblib.externals.loky.process_executor"]
    vars(executor).update(_MAX_MEMORY_LEAK_SIZE=-(10**12), _MEMORY_LEAK_CHECK_DELAY=0.0)


def test_a_process_that_has_grown_is_replaced_without_a_word() -> None:
    pytest.importorskip("psutil")  # without it joblib does not look
    pytest.importorskip("joblib")
    with (
        warnings.catch_warnings(record=True, action="always") as told,
        worker_processes(1) as (worker,),
    ):
        calls = [worker(_grow), *(worker(os.getpid) for _ in range(8))]
        numbers = {call.result(timeout=60) for call in calls[1:]}
    assert len(numbers) > 1
    assert told == []


def _end() -> None:
    """End this process at once, by a function that coverage.py lets a worker be sent."""
    os._exit(1)


def test_a_worker_that_ends_loses_nothing_of_another() -> None:
    pytest.importorskip("joblib")
    with worker_processes(2) as (first, second):
        waits = second(time.sleep, 1.0)
        refused((BrokenProcessPool, "", first(_end).result))
        assert (first(abs, -1).result(300), waits.result(300)) == (1, None)
