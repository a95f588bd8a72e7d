"""What a submission tries to read: judges, answers, files of the teacher's, and how each try ends.

Each attack stands as a function of a student's file, which returns "GOT" and what it read. It must
not have read it, and the teacher is told of the try wherever it can be seen. They run where a
student's process is shut in, and, as far as Python tells of itself, where it is only watched.
"""

from __future__ import annotations

import os
import re
import struct
import sys
import textwrap
import tomllib
from inspect import ismodule
from pathlib import Path

import pytest

import statemachine as sm
from statemachine.course.grading import exercise, recording
from statemachine.course.grading.class_page import class_page
from statemachine.course.grading.classroom import judge_all
from statemachine.course.grading.faults.run import examine
from statemachine.course.grading.inside.guard import PUBLIC, ROOMS
from statemachine.course.grading.judges import JUDGES, Judgement
from statemachine.course.grading.links import leads_out
from statemachine.course.grading.overview import class_result
from statemachine.course.grading.page import ONLY_WATCHED, grade_page, gradescope_results
from statemachine.course.grading.submissions import submissions
from statemachine.errors import BadInputError
from statemachine.processes import sandbox

from .support.claims import refused
from .support.exercises import SOLUTION, TEMPLATE
from .support.files import written, written_all
from .support.pages import shown
from .support.requirements import ROOT

SECRET = "the-text-of-a-file-of-the-teachers"
JUDGE = ROOT / "statemachine" / "course" / "grading" / "judges" / "gravity.py"

# By name: what is tried, and what is said of it, a pattern; "" where nothing can be seen.
Attacks = dict[str, tuple[str, str]]
SEEN_BY_THE_WATCH: Attacks = {
    "import a judge": (
        "from statemachine.course.grading.judges import gravity\nreturn 'GOT', gravity.TOLERANCE",
        r"it imports statemachine\.course\.grading",
    ),
    "import a judge by its name": (
        "import importlib\n"
        "return 'GOT', importlib.import_module('statemachine.course.grading.judges.state').right",
        r"it opens __init__\.\S+ of the judges",
    ),
    "unpickle a judge": (
        "import pickle\n"
        "return 'GOT', pickle.loads(b'cstatemachine.course.grading.judges.gravity\\nright\\n.')",
        r"it imports statemachine\.course\.grading",
    ),
    "load the file of a judge": (
        "from importlib.machinery import SourceFileLoader\n"
        "name = 'statemachine.course.grading.judges'\n"
        "return 'GOT', SourceFileLoader(name, {judge!r}).load_module()",
        "of the judges|it imports statemachine",
    ),
    "what a judge was compiled to": (
        "import glob, os\n"
        "folder = os.path.join(os.path.dirname({judge!r}), '__pycache__')\n"
        "return 'GOT', open(folder + '/gravity.cpython-311.pyc', 'rb').read()",
        "it opens gravity.cpython-311.pyc of the judges",
    ),
    "the data of the package": (
        "import pkgutil\n"
        "return 'GOT', pkgutil.get_data('statemachine', 'course/grading/judges/gravity.py')",
        "it opens gravity.py of the judges",
    ),
    "a lesson": (
        "from statemachine.course.lessons import gravity\nreturn 'GOT', gravity",
        r"it imports statemachine\.course\.lessons",
    ),
    "a file of the teacher's": (
        "return 'GOT', open({secret!r}).read()",
        "it tried to open {secret}",
    ),
    "by NumPy": (
        "import numpy\nreturn 'GOT', bytes(numpy.fromfile({secret!r}, dtype='u1'))",
        "it tried to open {secret}",
    ),
    "by the lines of a traceback": (
        "import linecache\nlines = linecache.getlines({secret!r})\n"
        "return ('GOT', lines) if lines else 1",
        # It asks whether the file is there, and no more.
        "it tried to open {secret}|it returns an int: 1",
    ),
    "run as a program": (
        "import runpy\nreturn 'GOT', runpy.run_path({judge!r})",
        "of the judges",
    ),
    "out of an open folder, after chdir": (
        "import os\nos.chdir('/usr')\nfolder = os.open('/usr/lib', os.O_RDONLY)\n"
        "name = os.path.relpath({secret!r}, os.path.realpath('/usr/lib'))\n"
        "return 'GOT', os.read(os.open(name, os.O_RDONLY, dir_fd=folder), 99)",
        r"it opens the folder or file .* \(os\.open\)",
    ),
    "out of an open folder of its own": (
        "import os\nfolder = os.open('.', os.O_RDONLY)\n"
        "name = os.path.relpath({secret!r}, os.path.realpath('.'))\n"
        "os.chdir('/usr')\n"
        "return 'GOT', os.read(os.open(name, os.O_RDONLY, dir_fd=folder), 99)",
        r"it opens the folder or file '\.\./.* \(os\.open\)",
    ),
    "a program by fork_exec": (
        "import os, _posixsubprocess\nread, write = os.pipe()\nsaid, error = os.pipe()\n"
        "words = [b'/bin/cat', {secret!r}.encode()]\n"
        "_posixsubprocess.fork_exec(words, words[:1], True, (error,), None, None, -1, -1,"
        " -1, write, -1, -1, said, error, False, False, -1, None, None, None, -1, None, False)\n"
        "os.close(write)\nreturn 'GOT', os.read(read, 99)",
        r"it starts another program \(fork_exec\)",
    ),
    "fork_exec of a module made anew": (
        "import sys\ndel sys.modules['_posixsubprocess']\nimport _posixsubprocess\n"
        "return 'GOT', _posixsubprocess.fork_exec",
        "it imports _posixsubprocess",
    ),
    "the root of a process": (
        "import os\nfolder = os.open('/proc/self/root', os.O_RDONLY)\n"
        "return 'GOT', os.read(os.open({secret!r}[1:], os.O_RDONLY, dir_fd=folder), 99)",
        "it opens /proc/self/root",
    ),
    "a file below the root of a process": (
        "return 'GOT', open('/proc/self/root' + {secret!r}).read()",
        "it opens /proc/self/root/",
    ),
    "the parent's root": (
        "import os\nreturn 'GOT', open(f'/proc/{{os.getppid()}}/root' + {secret!r}).read()",
        "it opens /proc/[0-9]+/root",
    ),
    "the parent's memory": (
        "import os\nreturn 'GOT', open(f'/proc/{{os.getppid()}}/mem', 'rb').fileno()",
        "it opens /proc/[0-9]+/mem",
    ),
    "what the parent was started with": (
        "import os\nreturn 'GOT', open(f'/proc/{{os.getppid()}}/environ', 'rb').read()",
        "it opens /proc/[0-9]+/environ",
    ),
    "a link that is made meanwhile": (
        "import os\nos.symlink({secret!r}, 'mine.txt')\nreturn 'GOT', open('mine.txt').read()",
        r"it makes a link to .* \(os\.symlink\)",
    ),
    "a second name for a file": (
        "import os\nos.link({secret!r}, 'mine.txt')\nreturn 'GOT', open('mine.txt').read()",
        "it tried to open {secret}",
    ),
    "a socket": (
        "import socket\nsocket.socket().connect(('127.0.0.1', 9))\nreturn 'GOT'",
        "it wants to use the network",
    ),
    "by a thread": (
        "import threading\nfound = []\n"
        "thread = threading.Thread(target=lambda: found.append(open({secret!r}).read()))\n"
        "thread.start(); thread.join()\nreturn ('GOT', found) if found else 1",
        "it tried to open {secret}",
    ),
    "by an object that has two names": (
        "import io\nnames = iter([{secret!r}, 'mine.txt'])\n"
        "class Both:\n    def __fspath__(self): return next(names)\n"
        "return 'GOT', io.FileIO(Both()).read()",
        r"it opens a file by an object \(open\)",
    ),
    "by a text that lies": (
        "class Text(str):\n    def startswith(self, *_): return True\n"
        "    def partition(self, *_): return '', '', ''\n"
        "return 'GOT', open(Text({secret!r})).read()",
        "it tried to open {secret}",
    ),
    "with functions of os.path replaced": (
        "import os\nos.path.realpath = os.path.abspath = lambda name, **_: '/usr/lib'\n"
        "return 'GOT', open({secret!r}).read()",
        "it tried to open {secret}",
    ),
    "as if by a package": (
        "text = 'def read(name): return open(name).read()'\n"
        "code = compile(text, '/site-packages/x.py', 'exec')\n"
        "names = {{}}\nexec(code, names)\nreturn 'GOT', names['read']({secret!r})",
        "it tried to open {secret}",
    ),
    "by a function of this package": (
        "import statemachine.models as own\n"
        "exec(compile('def get():\\n import statemachine.course.grading.judges as j; return j',"
        " own.__file__, 'exec'), vars(own))\nreturn 'GOT', own.get()",
        "of the judges|No module named 'statemachine.course.grading.judges'",
    ),
    "as a database": (
        "import sqlite3\nfile = sqlite3.connect({secret!r})\n"
        "return 'GOT', file.execute('select 1').fetchall()",
        "it tried to open {secret}",
    ),
    "everything in /proc": (
        "import glob\nfound = []\nfor name in glob.glob('/proc/[0-9]*/environ'):\n"
        "    try: found.append(open(name).read())\n    except OSError: pass\n"
        "return ('GOT', found) if found else 1",
        "it opens /proc/1/environ",
    ),
}
# What Python does not tell of: only a process that is shut in is kept from it.
SHUT_IN_ONLY: Attacks = {
    "by C": (
        "import ctypes\nc = ctypes.CDLL(None)\nplace = c.open({secret!r}.encode(), 0)\n"
        "text = ctypes.create_string_buffer(99)\n"
        "return ('GOT', text.raw) if c.read(place, text, 99) > 0 else 1",
        "",
    ),
    "a program by C": (
        "import ctypes\nc = ctypes.CDLL(None)\n"
        "c.system(b'cat ' + {secret!r}.encode() + b' > mine.txt')\n"
        "return ('GOT', text) if (text := open('mine.txt').read()) else 1",
        "",
    ),
    "the root, mounted again by C": (
        "import ctypes\nc = ctypes.CDLL(None)\nc.unshare(0x10020000)\n"
        "c.mount(b'proc', b'/proc', b'proc', 0, None)\nc.umount2(b'/', 2)\n"
        "place = c.open({secret!r}.encode(), 0)\n"
        "return ('GOT', place) if place >= 0 else 1",
        "",
    ),
    "into the parent by ptrace": (
        "import ctypes, os\n"
        "found = [ctypes.CDLL(None).ptrace(16, pid, 0, 0) for pid in (os.getppid(), 1)]\n"
        "return ('GOT', found) if 0 in found else 1",
        "",
    ),
    "by an engine, as a field of heights": (
        'import mujoco\nmujoco.MjModel.from_xml_string(\'<mujoco><asset><hfield name="h" file="\''
        ' + {secret!r} + \'" content_type="image/vnd.mujoco.hfield"/></asset></mujoco>\')\n'
        "return 'GOT'",
        "",
    ),
    "who else handed in": (
        "import os\nnames = os.listdir(os.path.dirname({secret!r}))\nreturn 'GOT', names",
        "",
    ),
    "what it is told of the machine": (
        "import os\nsaid = [n for n, v in os.environ.items() if {root!r} in v]\n"
        "return ('GOT', said) if said else 1",
        "",
    ),
    "objects that know what is right": (
        "import gc, sys\n"
        "ours = 'statemachine.course'\n"
        "known = [n for n in sys.modules if 'judge' in n or n.startswith(ours)]\n"
        "known += [o for o in gc.get_objects() if isinstance(o, dict) and 'TOLERANCE' in o"
        " and '_mistakes' in o]\n"
        "frame = sys._getframe()\n"
        "while frame:\n"
        "    known += [n for n in ('right', 'rights', 'expected') if n in frame.f_locals]\n"
        "    frame = frame.f_back\n"
        "return ('GOT', known) if known else 1",
        "",
    ),
    "the tests and the solutions": (
        "import os\nfound = [n for n in ('tests', 'teaching', 'exercises', '.git')"
        " if os.path.exists(os.path.join({root!r}, n))]\n"
        "return ('GOT', found) if found else 1",
        "",
    ),
}


@pytest.mark.usefixtures("shut_in")
def test_bytecode_is_made_for_all_processes_where_there_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.cache_from_source", lambda _: str(tmp_path / "none"))
    folder = recording.with_bytecode("mujoco", tmp_path / "bytecode")
    assert folder is not None
    names = {file.name.partition(".")[0] for file in folder.rglob("*.pyc")}
    assert {"child", "guard", "calls", "mujoco_backend", "numeric"} <= names


def test_no_bytecode_is_made_where_python_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.cache_from_source", lambda _: str(tmp_path))
    assert recording.with_bytecode("mujoco", tmp_path / "bytecode") is None


@pytest.mark.usefixtures("shut_in")
def test_verdicts_with_bytecode_of_the_class_are_the_same(tmp_path: Path) -> None:
    with exercise.ExerciseJudge("mujoco") as judge:
        before = judge.judge(SOLUTION)
        judge.prepare()
        assert judge.judge(SOLUTION) == before


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    """Return a file of the teacher's, beside the folder of a class."""
    return written(tmp_path / "answers.txt", SECRET)


def _tried(folder: Path, secret: Path, attacks: list[str]) -> list[Judgement]:
    """Judge a file with one attack in each function; the judgements in the order of the attacks."""
    text = ""
    for name, attack in zip(JUDGES, attacks, strict=False):
        body = attack.format(secret=str(secret), judge=str(JUDGE), root=str(ROOT))
        text += f"def {name}(model, *_):\n{textwrap.indent(body, '    ')}\n\n\n"
    folder.mkdir(exist_ok=True)
    grade = exercise.run(written(folder / "step_loop.py", text))
    return list(grade.functions)[: len(attacks)]


def _groups(attacks: Attacks) -> list[pytest.param]:  # pyright: ignore
    """Return the attacks by four, for a file has four functions; the first file is quick."""
    names = list(attacks)
    groups: list[pytest.param] = []  # pyright: ignore
    for k in range(0, len(names), len(JUDGES)):
        four = names[k : k + len(JUDGES)]
        marks = [pytest.mark.slow] if k else []
        groups.append(pytest.param(four, id="; ".join(four), marks=marks))
    return groups


def _assert_got_nothing(attacks: Attacks, names: list[str], folder: Path, secret: Path) -> None:
    judgements = _tried(folder, secret, [attacks[name][0] for name in names])
    for name, judgement in zip(names, judgements, strict=True):
        said = re.sub(r" \(in `.*`\)", "", "\n".join(judgement.remarks))  # lines of the file
        assert not judgement.passed, name
        assert "GOT" not in said, (name, said)
        assert "a tuple of" not in said, (name, said)
        assert SECRET not in said, (name, said)
        assert re.search(attacks[name][1].format(secret=re.escape(secret.as_posix())), said), (
            name,
            said,
        )


@pytest.fixture
def shut_in() -> None:
    """Skip where this system cannot shut a process in."""
    if not sandbox.shut_in():
        pytest.skip("this system does not let a user make namespaces")


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no namespace be available."""
    monkeypatch.setattr(sandbox, "shut_in", lambda: False)


ALL = SEEN_BY_THE_WATCH | SHUT_IN_ONLY


@pytest.mark.usefixtures("shut_in")
@pytest.mark.parametrize("names", _groups(ALL))
def test_who_is_shut_in_reads_nothing(names: list[str], tmp_path: Path, secret: Path) -> None:
    _assert_got_nothing(ALL, names, tmp_path / "class", secret)


@pytest.mark.skipif(sys.platform == "win32", reason="the attacks are those of POSIX")
@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize("names", _groups(SEEN_BY_THE_WATCH))
def test_who_is_watched_is_refused(names: list[str], tmp_path: Path, secret: Path) -> None:
    _assert_got_nothing(SEEN_BY_THE_WATCH, names, tmp_path / "class", secret)


# What the watch does not see, as docs/teaching.md says: for these, only to be shut in helps.
UNSEEN = {
    "code that changes the watch": (
        "import gc\n"
        "for each in gc.get_objects():\n"
        "    if type(each).__name__ == 'Guard':\n"
        "        each._open = ('/',)\n"
        "raise ValueError('GOT ' + open({secret!r}).read())"
    ),
    "C code that opens files": (
        "import mujoco\n"
        'xml = \'<mujoco><asset><hfield name="h" size="1 1 1 1" file="\' + {heights!r} + \'" \'\n'
        "xml += 'content_type=\"image/vnd.mujoco.hfield\"/></asset></mujoco>'\n"
        "heights = mujoco.MjModel.from_xml_string(xml).hfield_data\n"
        "raise ValueError('GOT ' + str(heights))"
    ),
}


@pytest.mark.skipif(sys.platform != "linux", reason="both ways are tried where both can be")
@pytest.mark.usefixtures("shut_in")
@pytest.mark.parametrize("attack", UNSEEN)
@pytest.mark.slow
def test_where_it_is_only_watched_who_changes_the_watch_is_not_seen(
    attack: str, tmp_path: Path, secret: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heights = tmp_path / "answers.hfield"
    heights.write_bytes(struct.pack("ii4f", 2, 2, 0.0, 0.25, 0.5, 1.0))
    body = UNSEEN[attack].format(secret=str(secret), heights=str(heights))
    text = f"def demo_state(model):\n{textwrap.indent(body, '    ')}\n"
    file = written_all(tmp_path / "class", {"step_loop.py": text}) / "step_loop.py"
    for is_shut_in in (True, False):
        if not is_shut_in:
            monkeypatch.setattr(sandbox, "shut_in", lambda: False)
        _, judgement, _, _ = exercise.run(file).functions
        (remark,) = judgement.remarks
        assert ("GOT" in re.sub(r" \(in `.*`\)", "", remark)) != is_shut_in, remark


# A submission is still what it was.


@pytest.mark.parametrize("way", ["shut_in", pytest.param("watched", marks=pytest.mark.slow)])
def test_what_a_submission_needs_is_there(
    way: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    request.getfixturevalue(way)
    written_all(
        tmp_path / "ann",
        {
            "step_loop.py": "from solution import *\nfrom tools import table\ntable()\n"
            "import tempfile, importlib, numpy, sys, statemachine as sm\n"
            "with tempfile.TemporaryFile('w') as file: file.write('x')\n"
            "with open('mine.txt', 'w') as file: file.write('x')\n"
            "assert open('mine.txt').read() == 'x'\n"
            "import statemachine.interface, statemachine.errors\n"
            f"for name in {PUBLIC}: importlib.import_module(f'statemachine.{{name}}')\n"
            "for name in sm.__all__: getattr(sm, name)\n",
            "solution.py": SOLUTION.read_text("utf-8"),
            "tools/__init__.py": "from pathlib import Path\n"
            "def table(): return Path(__file__).with_name('table.csv').read_text('utf-8')\n",
            "tools/table.csv": "1,2\n",
        },
    )
    grade = exercise.run(tmp_path / "ann" / "step_loop.py", folder=tmp_path / "ann")
    assert grade.right == 4, [judgement.remarks for judgement in grade.functions]


def test_the_public_interface_is_what_the_package_tells() -> None:
    modules = [getattr(sm, name) for name in dir(sm)]
    # The room `freshness` stands for its function once it was imported, and can be called.
    rooms = {
        module.__name__.split(".")[1]
        for module in modules
        if ismodule(module) and not callable(module)
    }
    assert {*rooms, "interface", "worlds"} == set(PUBLIC)


def test_what_lies_below_the_judges_is_shown() -> None:
    """A room that is added below has to be seen in there, or nothing can be judged."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    floors = tools["importlinter"]["contracts"][0]["layers"]
    above = next(number for number, rooms in enumerate(floors) if "course" in rooms)
    below = {room.strip() for rooms in floors[above + 1 :] for room in rooms.split("|")}
    assert below <= set(ROOMS)


@pytest.mark.parametrize("way", ["shut_in", pytest.param("watched", marks=pytest.mark.slow)])
def test_tests_on_arms_with_faults_read_nothing_either(
    way: str, tmp_path: Path, secret: Path, request: pytest.FixtureRequest
) -> None:
    request.getfixturevalue(way)
    names = [str(secret), str(JUDGE), str(SOLUTION), str(tmp_path / "bob" / "test_arm.py")]
    text = (
        "import helper\n"
        "def test_files():\n"
        f"    for name in {names}:\n"
        "        try: open(name).read()\n"
        "        except OSError: continue\n"
        "        raise AssertionError(name)\n"
        "def test_judges():\n"
        "    try: import statemachine.course.grading.judges.gravity\n"
        "    except (OSError, ImportError): return\n"
        "    raise AssertionError('it is there')\n"
        "def test_help(): assert helper.ONE == 1\n"
    )
    written_all(
        tmp_path,
        {
            "ann/test_arm.py": text,
            "ann/helper.py": "ONE = 1\n",
            "bob/test_arm.py": "def test_x(): pass\n",
        },
    )
    found = examine(tmp_path / "ann" / "test_arm.py", only=["xyzw"])
    assert found.failures == ()
    assert found.tests == ("test_files", "test_judges", "test_help")


# A record that is made up.

FORGED = """
import base64, os, sys
import numpy as np
import statemachine as sm
def row(values):
    data = base64.b64encode(np.array(values, float).tobytes()).decode()
    return {"array": ["<f8", [len(values)], data]}
def inputs(qpos, qvel, ctrl, time):
    parts = dict(data=0, qpos=row(qpos), qvel=row(qvel), ctrl=row(ctrl), time=time)
    return {"Inputs": parts}
def demo_replay(model, ctrl, nstep=600):
    frame = sys._getframe()
    while "say" not in frame.f_locals: frame = frame.f_back
    say, worlds = frame.f_locals["say"], frame.f_locals["worlds"]
    for world in worlds:
        ctrl, nstep = world.arguments
        data = sm.make_data(world.model)
        sm.reset(world.model, data, keyframe=0)
        runs, ends = [], []
        for k in range(2):
            end = data.qpos + 0.125
            if k and world.nudge:
                end[0] += 1
            ends.append(row(end))
            start, stop = (inputs(q, data.qvel, ctrl, t) for q, t in ((data.qpos, 0.0), (end, 1.0)))
            runs.append({"EngineRun": dict(on_given_model=True, nstep=nstep, ctrl_changed=None,
                start=start, end=stop)})
        result = {"tuple": [world.nudge is None, *ends]}
        say("answer", answer={"Answer": dict(result=result, memory={"tuple": [0, 1, 2]},
            live={"tuple": ["", "", ""]}, runs={"tuple": runs}, forwards={"tuple": []},
            ends={"tuple": []}, changed={"dict": []})})
    os._exit(0)
"""


def test_a_record_of_runs_that_never_were_does_not_pass(tmp_path: Path) -> None:
    grade = exercise.run(written(tmp_path / "step_loop.py", FORGED))
    judgement = grade.functions[-1]
    assert not judgement.passed
    (remark,) = judgement.remarks
    assert remark.startswith("first run:")
    assert "600 steps" in remark


@pytest.mark.slow
def test_a_record_of_his_own_making_with_the_right_numbers_passes(tmp_path: Path) -> None:
    """docs/teaching.md says so: no verdict rests on that nobody can write one."""
    made_up = """
            end = data.qpos + 0.125
            if k and world.nudge:
                end[0] += 1
"""
    worked_out = """
            other = sm.make_data(world.model)
            sm.reset(world.model, other, keyframe=0)
            other.time, other.ctrl = 0.0, ctrl
            sm.step(world.model, other, nstep)
            end = other.qpos.copy()
            if k and world.nudge:
                place = world.nudge.place
                end[place] = world.nudge.pushed(end[place])
"""
    assert made_up in FORGED
    forged = FORGED.replace(made_up, worked_out)
    forged = forged.replace("runs, ends = [], []", "runs, ends = [], []; data.time = 0.0")
    grade = exercise.run(written(tmp_path / "step_loop.py", forged))
    assert grade.functions[-1].passed, grade.functions[-1].remarks


@pytest.mark.skipif(sys.platform == "win32", reason="there is no /etc")
@pytest.mark.slow
def test_a_file_of_the_system_is_no_reason_to_look(tmp_path: Path) -> None:
    """docs/teaching.md says so; what lies in another folder is one."""
    written_all(tmp_path, {"other/notes.txt": "hello"})
    elsewhere = tmp_path / "other" / "notes.txt"
    reads = "def demo_state(model):\n"
    for name in ("/etc/passwd", elsewhere.as_posix()):
        reads += f"    try:\n        open({name!r}).read()\n    except OSError:\n        pass\n"
    text = SOLUTION.read_text("utf-8").replace("def demo_state(model):\n", reads)
    written_all(tmp_path, {"ann/step_loop.py": text})
    grade = exercise.run(tmp_path / "ann" / "step_loop.py")
    assert grade.passed
    looks = [remark for remark in grade.functions[1].remarks if remark.startswith(exercise.LOOK)]
    assert len(looks) == 1
    assert "notes.txt" in looks[0]


# Links that lead out of what was handed in.

# What stands in ann's folder: a name, and what it is a link to.
LEAD_OUT = {
    "a file of the system": {"step_loop.py": "/etc/passwd"},
    "a file of the teacher's": {"step_loop.py": "../../answers.py"},
    "another student's file": {"helper.py": "../bob/step_loop.py"},
    "another student's folder": {"tools": "../bob"},
    "a chain of links": {
        "helper.py": "first.py",
        "first.py": "second.py",
        "second.py": "../bob/x.py",
    },
    "out and back again": {"helper.py": "../ann/step_loop.py", "x.py": "../back.py"},
    "by way of a folder": {"here": ".", "helper.py": "here/../../bob/step_loop.py"},
    "the folder above": {"all": ".."},
    "a ring": {"one.py": "two.py", "two.py": "one.py"},
    "to a file that is not there yet": {"helper.py": "../later.py"},
    "test_arm.py": {"test_arm.py": "../../answers.py"},
    "lesson.json": {"lesson.json": "../../answers.py"},
}


def _class(folder: Path, links: dict[str, str]) -> Path:
    """Return a class of two, where ann's folder has these links, and no other file of that name."""
    written_all(
        folder,
        {
            "answers.py": SOLUTION.read_text("utf-8"),
            "class/bob/step_loop.py": SOLUTION.read_text("utf-8"),
            "class/ann/step_loop.py": TEMPLATE.read_text("utf-8"),
        },
    )
    (folder / "class" / "back.py").symlink_to("ann/step_loop.py")
    for name, target in links.items():
        link = folder / "class" / "ann" / name
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    return folder / "class"


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Return the files that are read of what was handed in, past all links."""
    seen: list[Path] = []
    right = recording.content

    def content(file: Path, most: int) -> bytes:
        seen.append(Path(os.path.realpath(file)))
        return right(file, most)

    monkeypatch.setattr(recording, "content", content)
    return seen


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
@pytest.mark.parametrize("kind", LEAD_OUT)
def test_a_link_that_leads_out_is_refused_unread(
    kind: str, tmp_path: Path, unread: list[Path]
) -> None:
    links = LEAD_OUT[kind]
    folder = _class(tmp_path, links)
    found = {each.name: each for each in submissions([folder])}
    ann = found["ann"]
    assert ann.path is None
    assert any(
        ann.refusal.startswith(f"{name} is a link to {target},") for name, target in links.items()
    ), ann.refusal
    (entry,) = judge_all([ann], "mujoco")
    assert (entry.judged, entry.refusal, entry.tests, entry.predictions) == (
        False, ann.refusal, "", "",
    )  # fmt: skip
    assert not [file for file in unread if file.name in ("answers.py", "passwd")]
    # And where the folder is the one of one student.
    refused(
        (BadInputError, "is a link to", lambda: exercise.run(
            folder / "bob" / "step_loop.py", folder=folder / "ann")),
    )  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
def test_a_file_or_a_folder_that_is_itself_a_link_is_refused(tmp_path: Path) -> None:
    folder = _class(tmp_path, {})
    (folder / "cy").symlink_to("bob")
    (folder / "dee.py").symlink_to("/etc/passwd")
    (folder / "eve.py").symlink_to("bob/step_loop.py")
    found = {each.name: each for each in submissions([folder])}
    for name in ("cy", "dee.py", "eve.py"):
        assert found[name].path is None, name
        assert name in found[name].refusal
    assert found["bob"].path is not None
    named = submissions([folder / "dee.py", folder / "bob" / "step_loop.py"])
    assert [each.path is None for each in named] == [True, False]
    refused(
        (BadInputError, "eve.py is a link", lambda: exercise.run(folder / "eve.py")),
        (BadInputError, "eve.py is a link", lambda: examine(folder / "eve.py")),
    )


@pytest.mark.skipif(sys.platform == "win32", reason="links are those of POSIX")
@pytest.mark.slow
def test_a_hard_link_is_as_good_as_the_file(tmp_path: Path) -> None:
    """docs/teaching.md says so: nothing tells it from a file."""
    folder = _class(tmp_path, {})
    mine = folder / "ann" / "step_loop.py"
    mine.unlink()
    mine.hardlink_to(folder / "bob" / "step_loop.py")
    ann, bob = judge_all(submissions([folder / "ann", folder / "bob"]), "mujoco")
    assert (ann.right, bob.right) == (4, 4)
    assert ann.flags == ()


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
def test_a_named_link_beside_a_file_is_refused(tmp_path: Path) -> None:
    written_all(tmp_path, {"far/table.csv": SECRET, "ann/step_loop.py": "import table, far\n"})
    (tmp_path / "ann" / "table.csv").symlink_to("../far/table.csv")
    (tmp_path / "ann" / "far").symlink_to("../far")  # a folder that is not given along
    refused(
        (BadInputError, "table.csv is a link", lambda: exercise.run(
            tmp_path / "ann" / "step_loop.py")),
    )  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
@pytest.mark.slow
def test_a_link_within_the_folder_is_as_good_as_the_file(tmp_path: Path) -> None:
    written_all(tmp_path, {"ann/deep/mine.py": SOLUTION.read_text("utf-8")})
    ann = tmp_path / "ann"
    (ann / "step_loop.py").symlink_to("deep/mine.py")
    (ann / "also.txt").symlink_to("step_loop.py")
    assert not [link for link in ann.iterdir() if leads_out(link, ann)]
    assert set(recording.in_folder(ann)) == {"step_loop.py", "also.txt", "deep/mine.py"}
    assert exercise.run(ann / "step_loop.py", folder=ann).right == 4


# Where nothing can be shut in, it is said.


@pytest.mark.slow
@pytest.mark.parametrize("way", ["shut_in", "watched"])
def test_the_table_says_where_reading_is_only_watched(
    way: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    request.getfixturevalue(way)
    written_all(tmp_path / "class", {"ann.py": TEMPLATE.read_text(), "bob.py": "x = 1\n"})
    table = tmp_path / "grades.csv"
    entries = judge_all(submissions([tmp_path / "class"]), "mujoco", table=table)
    grade = exercise.run(tmp_path / "class" / "bob.py")
    is_said = way == "watched"
    assert all(entry.watched is is_said for entry in entries)
    assert table.read_text("utf-8-sig").count("reading only watched") == 2 * is_said
    for page in (class_page(class_result(entries)), grade_page(grade)):
        assert (ONLY_WATCHED in " ".join(shown(page).split())) is is_said
    assert ("only watched" in gradescope_results(grade)) is is_said
