"""What the guard of a student's process refuses, and what it tells, asked in this process."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

import statemachine
from tests.support.guarded import Guarded

PACKAGE = Path(statemachine.__file__).resolve().parent
JUDGE = PACKAGE / "course" / "grading" / "judges" / "gravity.py"
FAULT = PACKAGE / "course" / "grading" / "faults" / "patches.py"
READ = (None, os.O_RDONLY)
Ask = Callable[[Guarded], None]

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="events and folders of POSIX")


@pytest.fixture
def guarded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Guarded:
    """Return a guard beside a process that is shut in."""
    return Guarded(monkeypatch, tmp_path)


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Guarded:
    """Return a guard that is all that stands between a student's code and this machine."""
    return Guarded(monkeypatch, tmp_path, alone=True)


# By what is said of them, which is the same of a group.
REFUSED = (
    ("os.fork", "os.forkpty", "os.posix_spawn", "os.spawn", "os.startfile"),
    ("os.system", "os.exec", "subprocess.Popen", "_winapi.CreateProcess"),
    ("os.kill", "os.killpg", "signal.pthread_kill"),
    (
        "socket.connect", "socket.bind", "socket.sendto", "socket.sendmsg", "socket.getaddrinfo",
    ),
)  # fmt: skip


@pytest.mark.parametrize("event", [event for group in REFUSED for event in group])
def test_an_event_that_no_exercise_needs_is_refused_and_told_with_its_line(
    event: str, guarded: Guarded
) -> None:
    with pytest.raises(PermissionError):
        guarded.by_student(event, line=7)
    [text] = guarded.forbidden
    assert text.startswith("line 7: ")
    assert f"({event})" in text


def test_events_of_one_kind_are_told_in_the_same_words(guarded: Guarded) -> None:
    words: list[set[str]] = []
    for group in REFUSED:
        texts: set[str] = set()
        for event in group:
            with pytest.raises(PermissionError) as refusal:
                guarded.event(event, ())
            texts.add(str(refusal.value))
        words.append(texts)
    assert [len(texts) for texts in words] == [1, 1, 1, 1]
    assert len(set.union(*words)) == len(REFUSED)


def test_an_event_that_is_not_listed_is_let_through(guarded: Guarded) -> None:
    guarded.by_student("os.listdir", "/")
    assert guarded.told == []


def test_what_is_refused_twice_is_told_once(guarded: Guarded) -> None:
    for _ in range(2):
        with pytest.raises(PermissionError):
            guarded.by_student("os.system", "true")
    assert len(guarded.told) == 1


def test_what_is_refused_in_two_lines_is_told_of_both(guarded: Guarded) -> None:
    for line in (3, 5):
        with pytest.raises(PermissionError):
            guarded.by_student("os.system", "true", line=line)
    assert [text.partition(":")[0] for text in guarded.forbidden] == ["line 3", "line 5"]


def test_twenty_things_are_told_at_most(guarded: Guarded) -> None:
    for number in range(30):
        guarded.by_student("open", str(guarded.other / f"{number}"), "r", 0)
    assert guarded.read == [str(guarded.other / f"{number}") for number in range(20)]


def test_what_a_package_tries_is_refused_and_not_told(guarded: Guarded) -> None:
    with pytest.raises(PermissionError):
        guarded.by_file(Path("/venv/site-packages/fonts/__init__.py"), "subprocess.Popen")
    assert guarded.told == []


def test_what_no_line_of_the_student_tries_is_told_without_one(guarded: Guarded) -> None:
    errors: list[BaseException] = []

    def kill() -> None:
        try:
            guarded.event("os.kill", (1, 9))
        except PermissionError as error:
            errors.append(error)

    thread = threading.Thread(target=kill)  # without the frames of pytest, which is a package
    thread.start()
    thread.join()
    assert len(errors) == 1
    [text] = guarded.forbidden
    assert "(os.kill)" in text
    assert "line" not in text


@pytest.mark.parametrize("place", ["Popen", "fork_exec"])
def test_no_program_starts_by_the_way_of_which_no_event_tells(place: str, guarded: Guarded) -> None:
    starts = importlib.import_module("_posixsubprocess")
    ways = {
        "Popen": lambda: subprocess.Popen(["true"]),
        "fork_exec": lambda: starts.fork_exec("true"),
    }
    with pytest.raises(PermissionError):
        ways[place]()


def path_of(guarded: Guarded, name: str) -> Path:
    """Return a file of a name that begins with that of a folder, and make it unless "missing"."""
    folder, _, rest = name.partition("/")
    roots = {"mine": guarded.folder, "work": guarded.work, "other": guarded.other}
    path = roots[folder] / rest
    if "missing" not in rest:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return path


# A file; whether it is told when the student opens it, and when ours does.
OPENED = (
    ("mine/data.txt", False, False),
    ("mine/missing.txt", True, True),
    ("mine/__pycache__/missing.pyc", False, False),
    ("work/data.txt", False, False),
    ("work/missing.txt", False, False),
    ("other/data.txt", True, True),
    ("other/missing.txt", True, False),
)


@pytest.mark.parametrize(("name", "told", "_"), OPENED)
def test_a_file_that_the_student_opens_is_told_unless_it_is_his(
    name: str, told: bool, _: bool, guarded: Guarded
) -> None:
    path = path_of(guarded, name)
    guarded.by_student("open", str(path), "r", 0)
    assert guarded.told == [("reads", str(path))] * told


@pytest.mark.parametrize(("name", "_", "told"), OPENED)
def test_a_file_that_we_open_is_told_where_it_is_there(
    name: str, _: bool, told: bool, guarded: Guarded
) -> None:
    path = path_of(guarded, name)
    guarded.event("open", (str(path), "r", 0))
    assert guarded.told == [("reads", str(path))] * told


@pytest.mark.parametrize(("name", "student", "ours"), OPENED)
def test_the_only_guard_refuses_files_of_other_folders(
    name: str, student: bool, ours: bool, alone: Guarded
) -> None:
    path = path_of(alone, name)
    for ask, told in (
        (lambda: alone.by_student("open", str(path), "r", 0), student),
        (lambda: alone.event("open", (str(path), "r", 0)), ours),
    ):
        if told and name.startswith("other"):
            with pytest.raises(PermissionError, match=str(path)):
                ask()
        else:
            ask()


def test_a_name_in_bytes_is_that_of_the_same_file(guarded: Guarded) -> None:
    guarded.by_student("open", os.fsencode(guarded.other / "data"), "r", 0)
    assert guarded.read == [str(guarded.other / "data")]


def test_a_class_of_text_does_not_hide_its_name(guarded: Guarded) -> None:
    class Name(str):
        def __str__(self) -> str:
            return "answer.py"

    guarded.by_student("open", Name(guarded.other / "data"), "r", 0)
    assert guarded.read == [str(guarded.other / "data")]


def test_a_student_does_not_open_a_file_by_an_object(guarded: Guarded) -> None:
    with pytest.raises(PermissionError):
        guarded.by_student("open", guarded.file, "r", 0)
    assert len(guarded.forbidden) == 1


@pytest.mark.parametrize("name", [3, object(), "no\0name"])
def test_what_names_no_file_is_not_looked_at(name: object, guarded: Guarded) -> None:
    guarded.event("open", (name, "r", 0))
    assert guarded.told == []


def test_a_student_may_read_an_open_file(guarded: Guarded) -> None:
    guarded.by_student("open", 0, "r", 0)
    assert guarded.told == []


@pytest.mark.parametrize("place", ["/etc/hostname", os.__file__, str(PACKAGE / "__init__.py")])
def test_files_of_the_system_of_python_and_of_the_package_are_open(
    place: str, alone: Guarded
) -> None:
    alone.by_student("open", place, "r", 0)
    assert alone.told == []


ROOMS = ("interface/records.py", "course/__init__.py", "course/grading/inside/guard.py")


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_that_are_shown_are_open(room: str, alone: Guarded) -> None:
    alone.by_student("open", str(PACKAGE / room), "r", 0)
    assert alone.told == []


@pytest.mark.parametrize("path", [JUDGE, FAULT, PACKAGE / "cli" / "check.py"])
def test_rooms_of_the_judges_are_closed_to_everybody(path: Path, guarded: Guarded) -> None:
    for ask in (lambda: guarded.event("open", (str(path), "r", 0)),
                lambda: guarded.by_student("open", str(path), "r", 0)):  # fmt: skip
        with pytest.raises(PermissionError, match=path.name):
            ask()
    assert guarded.read == []


def test_tests_may_read_what_makes_the_faults(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    guarded = Guarded(monkeypatch, tmp_path, faults=True)
    guarded.by_student("open", str(FAULT), "r", 0)
    with pytest.raises(PermissionError):
        guarded.by_student("open", str(JUDGE), "r", 0)


INTO_PROCESSES = (
    "/proc/self/mem", "/proc/1/root/etc/passwd", "/proc/self/fd/3", "/proc/1/task/1/environ",
    "/proc/self/../self/maps",
)  # fmt: skip


@pytest.mark.parametrize("name", INTO_PROCESSES)
def test_a_student_does_not_look_into_a_process(name: str, guarded: Guarded) -> None:
    with pytest.raises(PermissionError):
        guarded.by_student("open", name, "r", 0)
    [text] = guarded.forbidden
    assert name in text


@pytest.mark.parametrize("name", ["/proc/cpuinfo", "/proc/self/status", "/proc/memory/x"])
def test_a_student_may_read_what_proc_says_of_the_machine(name: str, guarded: Guarded) -> None:
    guarded.by_student("open", name, "r", 0)
    assert guarded.forbidden == []


def test_we_may_look_into_a_process(guarded: Guarded) -> None:
    guarded.event("open", ("/proc/self/maps", "r", 0))
    assert guarded.told == []


def test_a_name_that_goes_to_proc_from_the_working_folder_is_refused(
    guarded: Guarded, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(guarded.folder)
    name = os.path.relpath("/proc/self/mem", guarded.folder)
    with pytest.raises(PermissionError):
        guarded.by_student("open", name, "r", 0)


# What `os.open` gets from a student, and whether it is refused.
LOW_LEVEL: dict[str, tuple[Callable[[Guarded], str], int, bool]] = {
    "own file": (lambda guarded: str(guarded.file), 0, False),
    "own folder": (lambda guarded: str(guarded.folder), 0, False),
    "work folder": (lambda guarded: str(guarded.work), 0, False),
    "other folder": (lambda guarded: str(guarded.other), 0, True),
    "upwards": (lambda guarded: "../mine/answer.py", 0, True),
    "upwards from the root": (lambda guarded: f"{guarded.folder}/../mine/answer.py", 0, False),
    "own file as a place": (lambda guarded: str(guarded.file), getattr(os, "O_PATH", 0), True),
}


@pytest.mark.parametrize("case", LOW_LEVEL)
def test_a_student_opens_no_way_out_of_his_folders(
    case: str, guarded: Guarded, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, flags, refused = LOW_LEVEL[case]
    monkeypatch.chdir(guarded.folder)
    if refused:
        with pytest.raises(PermissionError):
            guarded.by_student("open", name(guarded), None, flags)
    else:
        guarded.by_student("open", name(guarded), None, flags)
    assert len(guarded.forbidden) == refused


@pytest.mark.parametrize("case", LOW_LEVEL)
def test_we_may_open_any_folder(
    case: str, guarded: Guarded, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, flags, _ = LOW_LEVEL[case]
    monkeypatch.chdir(guarded.folder)
    guarded.event("open", (name(guarded), None, flags))
    assert guarded.forbidden == []


def test_an_ordinary_open_may_go_upwards_in_his_folders(
    guarded: Guarded, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(guarded.folder)
    guarded.by_student("open", "../mine/answer.py", "r", 0)
    assert guarded.told == []


@pytest.mark.parametrize("name", ["", ":memory:", None, 5])
def test_a_database_in_memory_is_no_file(name: object, guarded: Guarded) -> None:
    guarded.by_student("sqlite3.connect", name)
    assert guarded.told == []


def test_a_database_is_a_file(guarded: Guarded) -> None:
    guarded.by_student("sqlite3.connect", str(guarded.other / "data.db"))
    assert guarded.read == [str(guarded.other / "data.db")]


@pytest.mark.parametrize("event", ["os.link", "os.rename"])
def test_a_file_that_gets_another_name_is_told(event: str, guarded: Guarded) -> None:
    source = guarded.other / "data"
    guarded.by_student(event, str(source), str(guarded.folder / "data"), -1, -1)
    assert guarded.told == [("reads", str(source))]


# Where a symbolic link leads, seen from the student's folder, and whether it is refused.
LINKS = (
    ("answer.py", False), ("../work/data", False), ("../mine-too/data", True), ("/etc", True),
)  # fmt: skip


@pytest.mark.parametrize(("goal", "refused"), LINKS)
def test_a_student_makes_no_link_to_other_folders(
    goal: str, refused: bool, guarded: Guarded
) -> None:
    target = str(guarded.folder / "link")
    if refused:
        with pytest.raises(PermissionError):
            guarded.by_student("os.symlink", goal, target, -1)
    else:
        guarded.by_student("os.symlink", goal, target, -1)
    assert len(guarded.told) == refused


@pytest.mark.parametrize("folders", [(3, -1), (-1, 3), (0, -1)])
def test_a_student_makes_no_link_by_an_open_folder(
    folders: tuple[int, int], guarded: Guarded
) -> None:
    with pytest.raises(PermissionError):
        guarded.by_student("os.rename", "answer.py", str(guarded.folder / "b.py"), *folders)
    assert len(guarded.forbidden) == 1


@pytest.mark.parametrize("event", ["os.symlink", "os.rename"])
def test_we_may_make_any_link(event: str, guarded: Guarded) -> None:
    goal = guarded.other / "missing"
    guarded.event(event, (str(goal), str(guarded.folder / "link"), 3, 4))
    assert guarded.told == []


def test_where_a_link_leads_is_not_told(guarded: Guarded) -> None:
    goal = path_of(guarded, "other/data.txt")
    guarded.event("os.symlink", (str(goal), str(guarded.folder / "link"), -1))
    assert guarded.told == []


IMPORTED = (
    ("statemachine", False),
    ("statemachine.lab", False),
    ("statemachine.lab.sweep", False),
    ("statemachine.lab._hidden", True),
    ("statemachine.interface.records", False),
    ("statemachine.course", True),
    ("statemachine.course.grading", True),
    ("statemachine.cli", True),
    ("statemachine._models", True),
    ("numpy._core", False),
    ("_posixsubprocess", True),
    ("_socket", False),
)


@pytest.mark.parametrize(("name", "refused"), IMPORTED)
def test_a_student_imports_what_is_public(name: str, refused: bool, guarded: Guarded) -> None:
    if refused:
        with pytest.raises(ImportError):
            guarded.by_student("import", name, None, None, None, None)
    else:
        guarded.by_student("import", name, None, None, None, None)
    assert len(guarded.forbidden) == refused


@pytest.mark.parametrize("name", [name for name, refused in IMPORTED if refused])
def test_we_and_tests_of_faults_import_what_we_like(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    ours = Guarded(monkeypatch, tmp_path / "one")
    ours.event("import", (name, None, None, None, None))
    tests = Guarded(monkeypatch, tmp_path / "two", faults=True)
    tests.by_student("import", name, None, None, None, None)
    assert ours.forbidden + tests.forbidden == []


def test_only_the_only_guard_refuses_compiled_code_of_the_student(
    guarded: Guarded, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "alone").mkdir()
    alone = Guarded(monkeypatch, tmp_path / "alone", alone=True)
    guarded.by_student("import", "fast", str(guarded.folder / "fast.so"), None, None, None)
    assert guarded.forbidden == []
    for folder in (alone.folder, alone.work):
        with pytest.raises(ImportError):
            alone.by_student("import", "fast", str(folder / "fast.so"), None, None, None)
    alone.by_student("import", "json", "/usr/lib/fast.so", None, None, None)
    assert len(alone.forbidden) == 2


def test_a_module_that_is_not_in_his_folder_is_told(guarded: Guarded) -> None:
    (guarded.folder / "here.py").touch()
    for name in ("here", "helper", "json"):
        guarded.by_student("import", name, None, None, None, None)
    assert guarded.read == [str(guarded.folder / "helper.py")]


C_CODE = ("ctypes.dlopen", "ctypes.dlsym", "ctypes.dlsym/handle", "ctypes.call_function")


@pytest.mark.parametrize("event", C_CODE)
def test_only_the_only_guard_keeps_a_student_from_c(
    event: str, guarded: Guarded, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "alone").mkdir()
    alone = Guarded(monkeypatch, tmp_path / "alone", alone=True)
    guarded.by_student(event, "libc.so.6")
    alone.event(event, ("libc.so.6",))
    with pytest.raises(PermissionError):
        alone.by_student(event, "libc.so.6", line=4)
    assert guarded.told == []
    [text] = alone.forbidden
    assert text.startswith("line 4: ")


# Whose code opens a file by an object, which a student may not; whether its module is there.
CODE = (
    ("/venv/lib/site-packages/pack/__init__.py", True, False),
    ("/venv/lib/dist-packages/pack/__init__.py", True, False),
    ("/venv/lib/site-packages/pack/__init__.py", False, True),
    (str(PACKAGE / "rotations.py"), True, False),
    (str(PACKAGE / "rotations.py"), False, True),
    (str(PACKAGE / "course" / "grading" / "inside" / "calls.py"), False, False),
    ("/class/student/answer.py", True, True),
    ("<string>", False, True),
)


@pytest.mark.parametrize(("file", "genuine", "is_student"), CODE)
def test_code_is_the_students_that_is_of_no_module_of_ours_or_of_a_package(
    file: str, genuine: bool, is_student: bool, guarded: Guarded
) -> None:
    if is_student:
        with pytest.raises(PermissionError):
            guarded.by_file(Path(file), "open", object(), "r", 0, genuine=genuine)
    else:
        guarded.by_file(Path(file), "open", object(), "r", 0, genuine=genuine)


def test_who_asks_by_pythons_own_library_asks(guarded: Guarded) -> None:
    code = (
        "import contextlib\n"
        "with contextlib.ExitStack() as stack:\n"
        "    stack.callback(event, name, arguments)\n"
    )
    with pytest.raises(PermissionError):
        guarded.run(code, "open", (object(), "r", 0))
