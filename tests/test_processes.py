"""Children that do work: how they are started, how they end, what they may take and find."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from statemachine import processes
from statemachine.errors import BadInputError
from statemachine.processes import PipedChild, places, sandbox

from .support.files import written_all

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and forks are POSIX")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="what there is stands in /proc")


# A fresh Python


def test_a_function_is_called_in_a_fresh_python_with_what_we_find() -> None:
    command, environment = processes.fresh_python("builtins:print", "a b", "c")
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["a", "b", "c"]


def test_the_folders_of_our_imports_are_those_of_a_fresh_python(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path), ""])
    monkeypatch.chdir(tmp_path)
    _, environment = processes.fresh_python("builtins:print")
    folders = environment["PYTHONPATH"].split(os.pathsep)
    assert folders[0] == str(Path(processes.__file__).resolve().parents[2])
    assert folders.count(str(tmp_path)) == 1  # the empty path is where we are
    assert "" not in folders


# How many, and how much


@pytest.mark.parametrize(("usable", "processors", "expected"), [(8, 1, 8), (8, 3, 2), (2, 4, 1)])
def test_as_many_processes_run_as_there_are_processors_for(
    monkeypatch: pytest.MonkeyPatch, usable: int, processors: int, expected: int
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(usable)), raising=False)
    assert processes.checked_jobs(None, processors) == expected


def test_as_many_processes_run_as_were_asked_for() -> None:
    assert [processes.checked_jobs(jobs) for jobs in (1, 7)] == [1, 7]
    for jobs in (0, -1):
        with pytest.raises(BadInputError):
            processes.checked_jobs(jobs)


@LINUX
def test_free_memory_is_what_the_limit_of_addresses_leaves() -> None:
    code = (
        "import resource\n"
        "from statemachine.processes import free_memory\n"
        "before = free_memory()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31))\n"
        "pages = int(open('/proc/self/statm').read().split()[0])\n"
        "print(before, free_memory(), 2**31 - pages * resource.getpagesize())"
    )
    command, environment = processes.fresh_python("builtins:exec", code)
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    before, limited, left = map(int, done.stdout.split())
    available = int(Path("/proc/meminfo").read_text().split("MemAvailable:")[1].split()[0]) << 10
    assert 0 < before <= available * 1.5
    assert limited == pytest.approx(min(left, before), rel=0.1)


@LINUX
def test_resident_memory_is_that_of_this_process_and_its_servers() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    alone = processes.resident_memory()
    assert alone == pytest.approx(pages * os.sysconf("SC_PAGE_SIZE"), rel=0.2)


# A child with pipes

_ECHO = (
    "import sys\nfor line in sys.stdin.buffer: sys.stdout.buffer.write(line); sys.stdout.flush()"
)


def _child(code: str) -> PipedChild:
    return PipedChild([sys.executable, "-S", "-c", code], dict(os.environ))


@pytest.fixture
def echo() -> Iterator[PipedChild]:
    child = _child(_ECHO)
    yield child
    child.close()


def test_a_child_is_told_by_a_pipe_and_answers_by_another(echo: PipedChild) -> None:
    echo.to.write(b"hello\n")
    echo.to.flush()
    assert echo.out.readline() == b"hello\n"
    assert echo.how_it_ended(0.0) == ""
    assert echo in processes.SERVERS


def test_a_child_ends_with_its_input_and_can_be_closed_twice(echo: PipedChild) -> None:
    echo.leave()
    assert echo.how_it_ended(60.0) == "exit code 0"
    echo.close()
    echo.close()


@pytest.mark.parametrize(
    ("code", "how"),
    [
        ("import sys; sys.exit(3)", "exit code 3"),
        ("import sys; print('a\\nlast words', file=sys.stderr); sys.exit(1)", "last words"),
    ],
)
def test_a_child_that_ended_says_how(code: str, how: str) -> None:
    child = _child(code)
    assert child.how_it_ended(60.0) == how
    child.close()


@POSIX
def test_a_child_that_is_killed_says_by_what(echo: PipedChild) -> None:
    echo.kill()
    assert echo.how_it_ended(60.0) == "ended by SIGKILL"


@POSIX
def test_a_child_is_in_a_session_of_its_own(echo: PipedChild) -> None:
    assert os.getsid(echo.pid) == echo.pid


@POSIX
def test_a_fork_does_not_keep_the_pipes_of_a_child(echo: PipedChild) -> None:
    fork = os.fork()
    if not fork:
        closed = [pipe.raw.closed for pipe in (echo.to, echo.out)]  # pyright: ignore
        os._exit(0 if closed == [True, True] else 1)
    assert os.waitpid(fork, 0)[1] == 0
    echo.to.write(b"still here\n")
    echo.to.flush()
    assert echo.out.readline() == b"still here\n"


def test_a_signal_has_its_name_or_its_number() -> None:
    assert processes.signal_name(signal.SIGTERM) == "SIGTERM"
    assert processes.signal_name(250) == "signal 250"


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (b"", "exit code 4"),
        (b" \n", "exit code 4"),
        (b"one\ntwo\n\n", "two"),
        (b"\xff\n", "\ufffd"),
    ],
)
def test_the_last_line_is_told_or_the_exit_code(said: bytes, expected: str) -> None:
    assert processes.last_line(said, 4) == expected


# Where packages are


def test_folders_of_packages_are_those_with_what_was_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"installed/x-1.dist-info/METADATA": "", "sources/x.py": "", "site-packages/y.py": ""}
    written_all(tmp_path, files)
    further = [str(tmp_path / name) for name in ("installed", "sources", "site-packages", "none")]
    monkeypatch.setattr(sys, "path", [*sys.path, *further])
    folders = set(places.package_folders())
    assert {tmp_path / "installed", tmp_path / "site-packages"} <= folders
    assert not {tmp_path / "sources", tmp_path / "none"} & folders


@pytest.mark.parametrize("is_on", [True, False])
def test_the_folder_of_the_user_is_one_where_it_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_on: bool
) -> None:
    monkeypatch.setattr(places.site, "ENABLE_USER_SITE", is_on)
    monkeypatch.setattr(places.site, "getusersitepackages", lambda: str(tmp_path))
    assert (tmp_path in set(places.package_folders())) is is_on


def test_of_the_python_path_stays_what_holds_packages_or_the_modules_that_are_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "needed/mine.py": "", "other/yours.py": "", "installed/x-1.dist-info/METADATA": "",
        "empty/mine/data.txt": "",
    }  # fmt: skip
    written_all(tmp_path, files)
    names = ["other", "needed", "installed", "empty", "needed"]
    folders = [str(tmp_path / name) for name in names]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*folders, ""]))
    monkeypatch.setattr(sys, "path", [*sys.path, *folders])
    assert places.python_path(["mine"]) == folders[1:3]
    assert places.python_path([]) == [folders[2]]


def test_a_view_has_python_and_the_files_of_a_module_that_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written_all(tmp_path, {"alone.py": "", "folder/__init__.py": ""})
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    view = places.python_view(["alone", "folder", "is.not.there"])
    assert {tmp_path / "alone.py", tmp_path / "folder", Path(sys.executable)} <= set(view.shown)
    assert tmp_path not in view.shown
    before = len(view.shown), len(view.emptied)
    more = view.with_more([tmp_path], [tmp_path / "folder"])
    assert (len(more.shown), len(more.emptied)) == (before[0] + 1, before[1] + 1)


# A command under limits


def _run(code: str, folder: Path, **limits: Any) -> sandbox.ProcessOutcome:
    named: dict[str, Any] = {"cpu": 20.0, "wall": 120.0, **limits}
    told = sandbox.Limits(**named)
    return sandbox.run([sys.executable, "-c", code], told, cwd=folder, writable=folder)


@pytest.fixture
def not_shut_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox, "shut_in", lambda: False)


@pytest.mark.usefixtures("not_shut_in")
def test_a_command_has_its_home_and_its_temporary_files_in_its_folder(tmp_path: Path) -> None:
    code = "import os, tempfile; print(os.path.expanduser('~'), tempfile.gettempdir())"
    assert set(_run(code, tmp_path).stdout.split()) == {str(tmp_path.resolve())}


@pytest.mark.usefixtures("not_shut_in")
def test_of_what_a_command_prints_the_first_bytes_stay(tmp_path: Path) -> None:
    code = "import sys; print('x' * 5000, end=''); print('y' * 10, end='', file=sys.stderr)"
    done = _run(code, tmp_path, output_most=1000)
    assert (done.stdout, done.stderr) == ("x" * 1000, "y" * 10)


@POSIX
@pytest.mark.usefixtures("not_shut_in")
def test_a_command_that_kills_itself_was_ended_by_that_signal(tmp_path: Path) -> None:
    done = _run("import os; os.kill(os.getpid(), 9)", tmp_path)
    assert (done.end, done.code) == ("signal", signal.SIGKILL)
    assert "SIGKILL" in done.how


@POSIX
@pytest.mark.usefixtures("not_shut_in")
def test_a_command_that_limits_itself_is_ended_by_its_computing(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        f"sys.path.insert(0, {str(Path(processes.__file__).parents[2])!r})\n"
        "from statemachine.processes.sandbox import limit_cpu\n"
        "limit_cpu(0.4, sys.stderr)\n"
        "while True: pass\n"
    )
    done = _run(code, tmp_path)
    assert (done.end, done.code) == ("cpu", signal.SIGPROF)
    assert "line 5 in <module>" in done.stderr
    assert done.cpu < 5.0


@POSIX
@pytest.mark.usefixtures("not_shut_in")
def test_a_command_leaves_no_core_and_cannot_write_a_file_without_end(tmp_path: Path) -> None:
    code = (
        "import resource as r\n"
        "print([r.getrlimit(getattr(r, 'RLIMIT_' + n)) for n in ('CORE', 'FSIZE', 'CPU', 'AS')])"
    )
    done = _run(code, tmp_path, cpu=7.2, start_cpu=2.0, memory_most=3 * sandbox.GB)
    half, most = sandbox.GB // 2, 3 * sandbox.GB
    assert done.stdout.strip() == str([(0, 0), (half, half), (10, 11), (most, most)])
