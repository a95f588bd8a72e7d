"""Every mistake of a command is one line that says what to type, and nothing is written."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from statemachine import load
from statemachine.lab.recordings import record, write

from .support.files import written_all
from .support.processes import Cli, one_line
from .support.requirements import ROOT
from .support.small_models import BENT, TWO_LINKS, TWO_SERVOS

CONTROLLERS = """
def controller(model, data):
    return [0.1] * 6

def late(model, data):
    if data.time > 0.1:
        return 1 / 0
"""

FUNCTIONS = """
import numpy as np

_draw = np.random.default_rng()

def hold(model, data):
    return [0.4, 0]

def drawn(model, data):
    return [float(_draw.normal()), 0.0]
"""

TWICE = " --backend mujoco --backend mujoco"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return files of the user: models, functions, and some that are neither."""
    keys = BENT.format(qpos=".2 -.3")
    arm = TWO_LINKS.format(mass="0.2", drives="".join(TWO_SERVOS), keys=keys)
    made = written_all(
        tmp_path_factory.mktemp("mistakes"),
        {
            "arm.xml": arm,
            "ball.xml": arm,
            "bad.urdf": "<robot",
            "heavy.xml": arm.replace('mass="0.2"', 'mass="0.4"'),
            "turned.xml": arm.replace("".join(TWO_SERVOS), "".join(reversed(TWO_SERVOS))),
            "own.py": FUNCTIONS,
            "empty.xml": "<mujoco/>",
            "waves.csv": "time\n",
            "c.py": CONTROLLERS,
            "e.py": "def controller(:",
            "picture.py": "\x89PNG\0\0",
            "notes.txt": "hello",
        },
    )
    (made / "empty").mkdir()
    write(record(load("so101"), seconds=0.05), made / "run.npz")
    (made / "folder.svg").mkdir()
    return made


@pytest.fixture
def needed(command: str, request: pytest.FixtureRequest) -> None:
    """Skip a command where what it needs is not installed."""
    for start, fixture in (("view", "viser"), ("fingertip", "pinocchio")):
        if command.startswith(start):
            request.getfixturevalue(fixture)


@pytest.mark.usefixtures("needed")
def files_of(folder: Path) -> list[Path]:
    """Return all files, but for the bytecode that Python keeps of a program."""
    return sorted(path for path in folder.rglob("*") if "__pycache__" not in path.parts)


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("lesson gravty", "Did you mean gravity?"),
        ("lesson hold --bakend pybullet", "Did you mean --backend?"),
        ("lesson hold --break", "lesson replay"),
        ("lesson time --plot a.svg", "unrecognized"),
        ("lesson replay --break", "extra-step|late-ctrl"),
        ("lesson 11", "no '11'"),
        ("lesson --from gravty", "Did you mean gravity?"),
        ("check", "expected one of FILE"),
        ("check --faults", "expected one argument"),
        ("compare hold --html", "--html PAGE.html"),
        ("compare hold --frame gripperframe", "--models"),
        ("compare hold --html --no-why", "--html PAGE.html"),
        ("lessn", "Did you mean lesson?"),
        ("gravity", "Did you mean statemachine lesson gravity?"),
        ("lesson fingertip", "Did you mean statemachine fingertip?"),
        ("lesson gravity --backend mujcoo", "Did you mean 'mujoco'?"),
        ("lesson gravity --model so101/scen", "Did you mean 'so101/scene'?"),
        ("lesson gravity --model nowhere.xml", "does not exist"),
        ("lesson gravity --menagerie nowhere", "does not exist"),
        ("lesson gravity --joint elbow", "elbow_flex"),
        ("lesson gravity --seconds -1", "above 0"),
        ("lesson gravity --seconds nan", "above 0"),
        ("lesson gravity --seconds inf", "above 0"),
        ("lesson gravity --seconds long", "invalid float"),
        ("lesson forward --value nan", "finite number"),
        ("lesson hold --ctrl 1,2", "6 numbers"),
        ("lesson hold --ctrl a,b", "list of numbers"),
        ("lesson hold --ctrl -1,2", "--ctrl=-1,2"),
        ("lesson hold --ctrl ''", "6 numbers"),
        ("lesson hold --seconds 1e9", "at most 10,000,000"),
        ("lesson time --steps 9999999999", "below"),
        ("lesson replay --steps 0", "at least 1"),
        ("lesson replay --break legs", "extra-step"),
        ("lesson replay --ctrl 1,nan,0,0,0,0", "finite number"),
        ("lesson time --steps 1.5", "invalid int"),
        ("fingertip --poses 0", "at least 1"),
        ("fingertip --poses 1", "from 2"),
        ("fingertip --seed -1", "negative"),
        ("fingertip --site tip", "gripperframe"),
        ("--colour", "unrecognized"),
        ("lesson --from time hold", "--from time, or"),
        ("lesson --from hold questions", "statemachine lesson questions"),
        ("lesson time --seconds 3", "with --realtime"),
        ("lesson hold --ctrl=nan,0,0,0,0,0", "ctrl[0] = nan"),
        ("lesson replay --ctrl=0,inf,0,0,0,0", "ctrl[1] = inf"),
        ("conventions gravty", "Did you mean 'gravity'?"),
        ("conventions --backend mujcoo", "Did you mean 'mujoco'?"),
        ("conventions gravity --calls", "takes no question"),
        ("check --faults nothing.py", "nothing.py"),
        ("check --faults .", "no file ."),
        ("check --faults ROOT/README.md", "README.md"),
        ("check --faults ROOT/exercises/test_arm.py --only xyz", "Did you mean 'xyzw'?"),
        ("check --faults ROOT/exercises/test_arm.py --backend mujcoo", "known: mujoco, pybullet"),
        ("check ROOT/exercises/step_loop.py --csv g.csv", "several files"),
        ("check ROOT/exercises/a.py ROOT/exercises/b.py --gradescope r.json", "goes with one FILE"),
        ("check --faults ROOT/exercises/test_arm.py --jobs 2", "several files"),
        ("check", "FILE and --faults"),
        ("trace record", "record what?"),
        ("trace", "trace what?"),
        ("trace record hodl", "Did you mean 'hold'?"),
        ("trace record hold -o x.csv", ".npz or .parquet"),
        ("trace record hold -o nowhere/x.npz", "no folder nowhere"),
        ("trace record hold --keyframe held", "named 'held'"),
        ("trace record hold so1O1", "Did you mean 'so101/so101'?"),
        ("trace record hold arm.xml ball.xml", "ball.xml;"),
        ("trace record hold --seconds -1", "seconds must"),
        ("trace record c.py:late", "c.py, line 7, at 0.100 s"),
        ("trace record c.py:never", "function never"),
        ("trace record cc.py", "mean c.py?"),
        ("trace record e.py", "e.py, line 1: SyntaxError: "),
        ("trace show c.npz", "c.npz"),
        ("trace csv c.npz --contacts", "unrecognized arguments: --contacts"),
        ("trace show c.py", ".npz or .parquet"),
        ("compare", "compare what?"),
        ("compare hodl", "Did you mean 'hold'?"),
        ("compare hold gravity", "both engines"),
        ("compare hold x.npz", "compare x.npz FILE"),
        ("compare x.npz", "x.npz"),
        ("compare hold --backend mujoco --backend bullet", "named 'bullet'"),
        ("compare hold --tolerance joint=1mm", "deg, rad"),
        ("compare hold --timestep -1", "timestep must"),
        ("compare hold --timestep 10", "timestep of 10 s"),
        ("compare hold --seconds 0", "seconds must"),
        ("compare hold so101/scene_box --backend mujoco --backend pybullet:both", "both"),
        (f"compare hold --quantity box --why{TWICE}", "known: joints"),
        (
            f"compare hold --tolerance joint=1deg --why{TWICE}",
            "--tolerance",
        ),
        ("compare hold --backend mujoco --backend pybulet --why", "Did you mean 'pybullet'"),
        (f"compare hold --seconds 0 --why{TWICE}", "above 0"),
        (f"compare hold gravity --why{TWICE}", "one experiment"),
        (f"compare hold so101/scen --why{TWICE}", "scen"),
        (
            f"compare hold --seconds 0.1 --timestep -1 --why{TWICE}",
            "timestep",
        ),
        (f"compare hold --quantity joints{TWICE}", "--why"),
        ("compare hold --html out.pdf", "file .html"),
        ("compare hold --html no/such/out.html", "no/such"),
        ("compare hold --html .", "file .html"),
        ("compare hold --no-why", "with --html"),
        ("compare --models so101 so101 --html x.html", "--models runs"),
        ("compare hold --plot a.gif", ".svg, .png or .pdf"),
        ("compare hold --film a.gif", "file .webp"),
        ("compare hold --film a", "file .webp"),
        ("compare hold --plot nowhere/a.svg", "folder nowhere"),
        ("compare hold --film nowhere/a.webp", "folder nowhere"),
        ("compare hold --plot folder.svg", "is a folder"),
        ("compare hold --film a.webp --why", "go without it"),
        (
            "compare --models arm.xml,turned.xml",
            "type arm.xml turned.xml",
        ),
        ("compare hold arm.xml,turned.xml", "type arm.xml turned.xml"),
        (
            "compare hold arm.xml@ turned.xml",
            "type arm.xml@mujoco, or",
        ),
        (
            "compare hold arm.xml:mujoco turned.xml",
            "type arm.xml@mujoco",
        ),
        ("compare hold arm.xml turned.xml@bullet", "named 'bullet'"),
        ("compare --models arm.xml turned.xml@bullet", "named 'bullet'"),
        (
            "compare hold arm.xml timestep 0.001 turned.xml",
            "type timestep=VALUE",
        ),
        ("compare hold arm.xml timestep=abc turned.xml", "timestep=abc"),
        ("compare hold arm.xml turned.xml --map a", "--map wants A=B"),
        ("compare hold arm.xml turned.xml --map elbow=nosuch", "named 'nosuch'"),
        ("compare hodl arm.xml turned.xml", "Did you mean 'hold'?"),
        ("compare hold . turned.xml", ". is a folder"),
        ("compare hold arm.xml turned.xml arm.xml", "named twice"),
        ("compare hold arm.xml turned.xml ball.xml --why", "goes with two sides"),
        ("compare hold arm.xml@mujoco", "one side only"),
        ("compare hold timestep=0.1 arm.xml", "type FILE timestep=0.1"),
        ("compare hold missing.xml", "missing.xml"),
        ("compare hold so1O1", "Did you mean 'so101/so101'?"),
        ("compare hodl so101", "Did you mean 'hold'?"),
        ("compare hold arm.xml --map a=b", "two sides"),
        ("compare hold arm.xml turned.xml --why --jobs 0", "got 0"),
        ("compare hold arm.xml turned.xml --jobs 2", "with --why"),
        ("compare hold so101@pybullet", "hold so101@pybullet so101@mujoco"),
        ("compare x.py:f", "compare x.py:f so101"),
        ("compare hold so101 so101 so101", "mujoco is named twice"),
        ("compare arm.xml heavy.xml", "compare hold arm.xml heavy.xml"),
        ("compare arm.xml heavy.xml", "compare --models arm.xml heavy.xml"),
        ("compare so101 so101/scene", "compare what?"),
        ("compare so101", "compare hold so101"),
        ("compare so101@pybullet", "compare hold so101@pybullet so101@mujoco"),
        ("compare hold so101 so101 --versions 3.3.7", "compare hold FILE --versions 3.3.7"),
        ("compare hold --model so101", "type statemachine compare hold so101"),
        ("compare hold so101 so101 --backend mujoco --backend mujoco", "FILE@ENGINE"),
        ("compare hold --backend mujoco", "two engines"),
        ("compare hold --map a=b", "two sides"),
        ("compare hold --every 2", "--every goes with FILE.py:FUNCTION"),
        ("compare hold so101 so101 --keyframe x", "named 'x'"),
        ("compare own.py:hold arm.xml arm.xml --every 0", "5ms or 0.005s"),
        (
            "compare own.py:drawn arm.xml arm.xml damping=0.5 --why",
            "same twice",
        ),
        ("compare waves.csv", ".npz or .parquet"),
        (
            "compare waves empty.xml --why --seconds 0.1 --backend mujoco --backend mujoco",
            "can move",
        ),
        ("compare run.npz run.npz --one-step", "runs both sides"),
        ("compare run.npz run.npz --uncertainty 1mm", "recorded run"),
        ("compare run.npz run.npz --seconds 1", "seconds is of"),
        ("compare run.npz run.npz --timestep 0.01", "timestep is of"),
        ("trace record hold --backend all", "one --backend"),
        ("compare run.npz run.npz --backend mujoco --backend mujoco", "--backend"),
        ("compare run.npz run.npz so101 contacts=off", "contacts is of"),
        ("compare run.npz run.npz so101 so101", "two traces"),
        ("compare run.npz --seed 3", "seed is of"),
        ("compare run.npz so101@mujoco", "compare run.npz so101@mujoco so101@pybullet"),
        ("lesson state --record mine.json", "a terminal"),
        ("lesson hold --no-questions --plot hold.txt", ".svg"),
        ("view --seconds 0.1 --keyframe hled", "Did you mean 'held'"),
        ("view --seconds 0.1 --keyframe 7", "7"),
        ("view --seconds 0.1 --port 70000", "70000"),
        ("view --seconds 0.1 --host ''", "an address"),
        ("view --seconds 0.1 --host 192.0.2.1", "192.0.2.1"),
        ("view --seconds 0.1 --host no.such.host.invalid", "not an address"),
        ("view --seconds 0.1 --speed 0", "speed"),
        ("view --seconds 0.1 --speed nan", "speed"),
        ("view --seconds 0.1 --site nose", "nose"),
        ("view --seconds 0.1 --backend mujoco --backend pybulet", "pybullet"),
        ("view --seconds 0.1 so1O1", "so101"),
        ("view --seconds 0.1 --seconds -1", "seconds"),
        ("view --seconds 0.1 --seconds nan", "seconds"),
        ("view --seconds 0.1 gone.npz", "gone.npz"),
        ("view --seconds 0.1 gone.npz --backend mujoco --backend pybullet", "recording"),
        ("view --seconds 0.1 a.npz b.npz c.npz", "one trace or two"),
        ("view --seconds 0.1 arm.xml ball.xml", "got arm.xml and ball.xml"),
        ("view --seconds 0.1 run.npz arm.xml", "than arm.xml"),
        ("compare --models so101 bad.urdf", "bad.urdf:"),
        ("compare --models so101@mujoco so101@mujoco", "both sides"),
        ("lesson state --backend pybullet:engine", "lessons are about engines"),
        ("sweep --report somewhere --seconds 2", "--seconds is of"),
        ("sweep --report somewhere --quantity nonsense", "'nonsense'"),
        (
            "sweep hold --out t --report --backend mujoco --backend pybullet "
            "--backend pybullet:engine",
            "one engine",
        ),
        ("compare --models so101 so102", "'so102'"),
        (
            "compare --models so101",
            "got 1",
        ),
        ("compare --models so101 so101 so101", "got 3"),
        ("compare --models so101 --backend mujoco --backend bulet", "'bulet'"),
        ("compare --models so101@mujoco so101 --backend mujoco --backend mujoco", "say the same"),
        ("compare --models so101 so101 --frame gripperframe", "--frame wants A=B"),
        ("compare --models so101 so101 --frame x=y", "named 'x'"),
        ("compare hold --models so101 so101", "compare --models LEFT RIGHT"),
        ("compare --models so101 so101 --seconds 1", "--seconds is of"),
        ("compare hold --one-step --converge", "goes without"),
        ("compare hold --converge --why", "goes without"),
        ("compare hold --one-step --uncertainty=1mm", "goes without"),
        ("compare hold --floor left", "two sides"),
        ("compare waves --seed=-1", ""),
        ("compare waves --why --seed=-1", ""),
        ("sweep hold --out t --quantity x", "goes with --report"),
        ("sweep hold", "--report DIR"),
        ("sweep hold --report --extend", "--out DIR"),
        ("sweep hold --out t --details", "--details goes with --report"),
        ("sweep hold --report --quantity fell", "floating base"),
        ("sweep hold --report --quantity tip", "tip x to tip z"),
        ("sweep hold --report --quantity qpos", "qpos[0]"),
        ("sweep hold --out t missing.xml", "missing.xml"),
        ("sweep hold missing.xml", "--report DIR"),
        ("sweep hold --out t so101 arm.xml", "arm.xml;"),
        ("fingertip arm.xml ball.xml", "ball.xml;"),
        ("fingertip arm.xm", "arm.xm"),
        ("fingertip --model arm.xml", "--model; type"),
        ("fingertip --poses 3 missing.xml", "does not exist"),
        ("lesson hold arm.xml", "--model FILE"),
        ("sweep hold --out t --report d", "takes no folder"),
        ("sweep --report .", "not a sweep"),
        ("sweep hold --out ''", "has no name"),
        ("robots arm.xml --out t.txt", ".csv or .json"),
        ("robots arm.xml --jobs 0", "jobs must be"),
        ("robots arm.xml --seconds 0", "seconds must be"),
        ("robots arm.xml --seed -1", "seed must not"),
        ("check nowhere.py", "nowhere.py"),
        ("check empty", "no Python files"),
        ("check picture.py", "a Python file"),
        ("check notes.txt", "end in .py"),
        ("check ROOT/exercises/test_arm.py", "check --faults"),
        ("check ROOT/teaching/solutions/step_loop.py --backend mujcoo", "Did you mean 'mujoco'?"),
        ("check ROOT/teaching/solutions/step_loop.py --time-limit 0", "above 0 s"),
        ("check ROOT/teaching/solutions/step_loop.py --time-limit nan", "above 0 s"),
    ],
)
def test_a_mistake_is_one_line(
    command: str, says: str, folder: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    there = files_of(folder)
    one_line(here(*(word.replace("ROOT", str(ROOT)) for word in shlex.split(command))), says)
    assert files_of(folder) == there


@pytest.mark.parametrize("command", ["sweep hold --html x.html", "robots models --html x.html"])
def test_what_is_like_no_option_is_not_guessed(here: Cli, command: str) -> None:
    assert here(*command.split()).stderr.endswith("unrecognized arguments: --html x.html\n")
