"""Every command, code block and number of the README and of the guides holds."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from statemachine.course.grading.faults import FAULTS
from statemachine.course.grading.judges import JUDGES
from statemachine.course.lessons import LESSONS, PATH
from statemachine.course.lessons.page import page as page_of
from statemachine.course.lessons.questions import ASKED
from statemachine.course.lessons.request import LessonRequest, answer
from statemachine.course.quiz import lettered
from statemachine.interface import Model
from statemachine.lab.probes.conventions import QUESTIONS
from statemachine.show.blocks import Question

from .support.claims import assert_in
from .support.files import written, written_all
from .support.motions import opened
from .support.pages import QUICK
from .support.processes import Cli, of_python
from .support.requirements import ROOT, need_engine

PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
    for path in (*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")))
}
README = PAGES["README.md"]


def blocks(page: str, language: str) -> list[str]:
    """Return the fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


COMMANDS = list(
    dict.fromkeys(
        line.split("#")[0].strip()
        for page in PAGES.values()
        for block in blocks(page, "console")
        for line in block.splitlines()
        if line.startswith(("statemachine", "python exercises"))
    )
)
# What makes a file for the command behind it, by the name of the file.
SEDS = {
    line.split()[-1]: line.partition(" > ")[0]
    for page in PAGES.values()
    for line in re.findall(r"^sed .* > \S+$", page, re.MULTILINE)
}
# What a page shows: the command is the last that its introduction names.
SHOWN = [
    pytest.param(shlex.split(command)[1:], part[1].rstrip("\n"), id=f"{name}: {command}")
    for name, page in PAGES.items()
    for part in re.finditer(r"^```text\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    for command in re.findall(r"`(statemachine [^`]*)`", page[: part.start()])[-1:]
]
# Run by the tests of lessons, and by those of what is shown.
RUN_ELSEWHERE = {
    *(f"statemachine lesson {name}" for name in LESSONS if name not in QUICK),
    *(str(param.id).partition(": ")[2] for param in SHOWN),
}
# What the words of a command need to be there.
ENGINE_OF = {
    **dict.fromkeys(("pybullet", "compare", "view", "trace", "sweep"), "pybullet"),
    "fingertip": "pinocchio",
}
ROBOT = (
    "<mujoco><worldbody><body name='a'><inertial mass='1' pos='.5 0 0' diaginertia='1 1 1'/>"
    "<joint name='j' axis='0 1 0'/><site name='tip' pos='1 0 0'/></body></worldbody></mujoco>"
)
SUBMITTED = ("submissions/ann.py", "submissions/bob.py")
MADE = ("path/", "reference/", "comparisons/")  # by `make docs`
PYTHON = {name: "".join(blocks(page, "python")) for name, page in PAGES.items()}
# Of exercises that are still to be written.
SAYS_NO = (
    "statemachine check exercises/step_loop.py",
    "statemachine check --faults exercises/test_arm.py",
    "python exercises/step_loop.py --gravity",
)
# The sides differ there: not where that is explained, nor where the arms of two files move alike.
DIFFERS = re.compile(
    r"statemachine (compare ((hold|models/|lerobot:)(?!.*--why|.* so101/scene_box)|--models)"
    r"|policy .*--against)"
)


def test_commands_and_outputs_of_the_guides_are_found() -> None:
    assert len(COMMANDS) >= 40
    assert set(SAYS_NO) <= set(COMMANDS)
    assert len(SHOWN) == sum(len(blocks(page, "text")) for page in PAGES.values()) >= 5


def test_readme_and_guides_are_short() -> None:
    assert len(README.split()) <= 500
    assert len(re.sub(r"^```.*?^```", "", README, flags=re.S | re.M).split()) <= 350
    listed = (ROOT / "docs" / "contents.txt").read_text("utf-8")
    guides = re.findall(r"^\w+$", listed.partition("Students\n")[2].partition("What the")[0], re.M)
    assert len(guides) <= 13
    words = {name: len(PAGES[f"docs/{name}.md"].split()) for name in guides}
    assert sum(words.values()) - words["api"] <= 10_900  # which names what autodoc inserts
    # A page about one question; its tables and what it cannot tell are not to be left out.
    assert len(PAGES["docs/real_arm.md"].split()) <= 1_000


@pytest.mark.slow
@pytest.mark.parametrize("command", [c for c in COMMANDS if c not in RUN_ELSEWHERE])
def test_a_command_of_the_guides_ends_as_it_should(
    here: Cli, cli: Cli, command: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    words = shlex.split(command)[1:]
    for engine in {ENGINE_OF[word] for word in words if word in ENGINE_OF}:
        need_engine(engine)
    if "mujoco==" in command or "--versions" in command:
        request.getfixturevalue("old_releases")
    solution = (ROOT / "teaching" / "solutions" / "step_loop.py").read_text()
    written_all(tmp_path, {"robot.xml": ROBOT, **dict.fromkeys(SUBMITTED, solution)})
    for made, line in SEDS.items():
        if made in words:
            written(tmp_path / made, output_of_sed(line))
    if "path/to/menagerie" in words:
        words[words.index("path/to/menagerie")] = str(request.getfixturevalue("menagerie"))
    words = [word.replace("path/to/robot.xml", "robot.xml") for word in words]
    ours = ("exercises/", "models")
    words = [str(ROOT / word) if word.startswith(ours) else word for word in words]
    if "view" in words:
        words += ["--seconds", "1", "--port", "0"]
    if {"waves.npz", "played.npz", "my_controller.py"} & set(words):
        _make_traces(here, tmp_path, words)
    if words[:2] == ["sweep", "--report"]:  # of a sweep that the line before has made
        made = COMMANDS[COMMANDS.index(command) - 1]
        assert f"--out {words[2]}" in made
        assert here(*shlex.split(made)[1:]).returncode == 0
    if command.startswith("python"):
        done = of_python(*words)
    elif "view" in words:  # what serves a page has a process of its own
        done = cli(*words)
    else:
        done = here(*words)
    no = command in SAYS_NO or DIFFERS.match(command)
    assert done.returncode == (1 if no else 0), done.stderr
    assert done.stdout or words[:2] == ["trace", "plot"]


def output_of_sed(line: str) -> str:
    """Return what a line of the guides prints, typed in the checkout."""
    return subprocess.run(
        shlex.split(line), cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout


def test_the_contract_that_a_guide_makes_has_its_gyroscope_in_world_axes() -> None:
    before = (ROOT / "models" / "quadruped" / "contract.yaml").read_text("utf-8")
    after = output_of_sed(SEDS["world_gyro.yaml"])
    changed = [
        pair
        for pair in zip(before.splitlines(), after.splitlines(), strict=True)
        if pair[0] != pair[1]
    ]
    assert changed == [("  imu: {site: imu, frame: body}", "  imu: {site: imu, frame: world}")]


def _make_traces(here: Cli, folder: Path, words: list[str]) -> None:
    """Write the files that a command takes as there."""
    (folder / "my_controller.py").write_text(blocks(PAGES["docs/traces.md"], "python")[0])
    for name, line in (
        ("waves.npz", "trace record waves --seed 3 -o waves.npz"),
        ("played.npz", "trace play waves.npz --backend pybullet -o played.npz"),
    ):
        if name in words and words[-2:] != ["-o", name]:
            assert here(*line.split()).returncode == 0


def make(*words: str) -> subprocess.CompletedProcess[str]:
    """Return what make does in this checkout, with this environment, which is taken as set up."""
    environment = Path(sys.executable).parent.parent
    old = [f"-o{environment / stamp}" for stamp in ("run.stamp", "test.stamp")]
    return subprocess.run(
        ["make", *old, f"VENV={environment}", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_make_lesson_walks_the_path() -> None:
    need_engine("pybullet")
    done = make("lesson")
    assert done.returncode == 0, done.stderr
    for number, lesson in enumerate(PATH, start=1):
        assert f"{number} of {len(PATH)}, {lesson.name}: " in done.stdout


def test_make_test_runs_the_checks_and_the_quick_tests() -> None:
    done = make("--dry-run", "test")
    assert done.returncode == 0, done.stderr
    assert_in(done.stdout, "ruff check", "pyright", '-m "not slow"')


def test_what_the_readme_asks_for_is_what_the_package_needs() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    (version,) = re.findall(r"Python (3\.\d+) or\s+newer", README)
    assert project["requires-python"].startswith(f">={version}")


def test_times_of_the_readme_are_those_of_the_model(mujoco_box: Model) -> None:
    (timestep,) = re.findall(r"A step is (\d+) ms", README)
    assert mujoco_box.timestep == pytest.approx(int(timestep) / 1000)
    (asked,) = re.findall(r"Is the time\s+(\d+) s\?", README)
    (steps,) = re.findall(r"sm\.step\(model, data, (\d+)\)", README)
    assert int(steps) * mujoco_box.timestep == pytest.approx(float(asked))


def test_the_code_of_the_readme_prints_a_time_and_a_place(
    tmp_path: Path, mujoco_box: Model
) -> None:
    """Its question is answered by the lesson, and not above it."""
    out = of_python("-c", PYTHON["README.md"], folder=tmp_path, code=0).stdout
    time, *place = (float(word) for word in re.findall(r"-?\d+\.\d+", out))
    assert time == pytest.approx(mujoco_box.raw.key_time[0] + 3)
    assert len(place) == 3
    assert not re.search(rf"\b{time:.0f}\.0|\b{mujoco_box.raw.key_time[0]:.0f} s\b", README)


def test_the_question_of_the_readme_is_that_of_the_lesson() -> None:
    """And what it asks is told below, after the three doors."""
    request = LessonRequest("gravity")
    blocks_of_page = page_of(request, answer(request)).blocks
    (question,) = (block for block in blocks_of_page if isinstance(block, Question))
    (shown,) = re.findall(r"^```\n(Before.*?)^```", README, re.DOTALL | re.MULTILINE)
    text = shown.replace("\n  ", "|").replace("\n", " ").strip()
    expected = [f"Before you read on: {question.text}", *lettered(question)]
    assert text == "|".join(expected).replace("`", "")
    places = ("Before you read on", "## Three doors", "servos on   servos off")
    assert sorted(places, key=README.index) == [*places]


# Of each guide with code: what its code prints.
PRINTS = {
    "docs/audit.md": (
        "restored whole, against going on: same bytes",
        "idle here: ('time',)",
        "Derived values of scene_box on mujoco",
        "1 of 1 reads were stale",
    ),
    "docs/comparing.md": ("lab.why(left, right, what=swing", "['damping of 6 joints'] [1.0]"),
    "docs/gym.md": (
        "mujoco: the pole stays up for 200 of 200 steps",
        "pybullet: the pole stays up for 200 of 200 steps",
        "start from the same bits: True",
    ),
    "docs/interface.md": ("no joint named 'elbow'; known: ", "0.001\n", "options of replace: "),
    "docs/models.md": ("13 coordinates", "True {}", "'gripperframe')"),
    "docs/platforms.md": ("armature: emulated", "position servo: emulated"),
    "docs/real_arm.md": ("True True\nTrue\nTrue\n",),
    "docs/sweeps.md": ("2 cells done, none failed", "{'parameter': ['gain'], 'share': [1.0]"),
    "docs/traces.md": ("101 (101, 6)",),
    "docs/worlds.md": (
        "(64, 13) (64, 2, 3)",
        "\nTrue\n(64, 10, 13)\n1 of 64 worlds diverged and is left out",
        "the fingertip is ",
        "in world 7",
    ),
}


LONG = ("docs/gym.md",)  # what runs for seconds


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(name, marks=pytest.mark.slow)
        for name, code in PYTHON.items()
        if code and name != "README.md"
    ],
)
def test_the_code_of_a_guide_runs(page: str, tmp_path: Path) -> None:
    if '"pybullet"' in PYTHON[page]:
        need_engine("pybullet")
    if page in LONG:
        pytest.importorskip("gymnasium")
    out = of_python("-c", PYTHON[page], folder=tmp_path, code=0).stdout
    assert_in(out, *PRINTS[page])
    lines = {"docs/interface.md": slice(1), "docs/worlds.md": slice(-2, None)}.get(page, slice(0))
    shown = " ".join(PAGES[page].split())  # what it prints is there, too
    assert all(line in shown for line in out.splitlines()[lines])


@pytest.mark.slow
@pytest.mark.parametrize(("words", "shown"), SHOWN)
def test_the_output_that_is_shown(cli: Cli, words: list[str], shown: str) -> None:
    if "compare" in words or "all" in words:
        need_engine("pybullet")
    differs = DIFFERS.match(shlex.join(("statemachine", *words)))
    words = [str(ROOT / word) if word.startswith("models/") else word for word in words]
    assert shown in cli(*words, code=int(differs is not None)).stdout


def test_counts_in_the_guides_are_those_of_the_package() -> None:
    names = (
        "one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen "
        "sixteen"
    )
    word = dict(enumerate(names.split(), start=1))
    counted = {
        "README.md": (
            f"{word[len(PATH)]} lessons",
            f"{word[len(ASKED)]} questions",
            f"{word[len(JUDGES)]} functions",
        ),
        "docs/lessons.md": (
            f"{word[len(PATH)]} lessons",
            f"{word[len(ASKED)]} questions",
        ),
        "docs/exercises.md": (
            f"{word[len(JUDGES)]} functions",
            f"{word[len(FAULTS)].capitalize()} faults are put into the arm",
        ),
        "docs/index.md": (f"{word[len(PATH)]} lessons",),
        "docs/audit.md": (f"{word[len(QUESTIONS)]} questions",),
    }
    for page, phrases in counted.items():
        assert_in(" ".join(PAGES[page].split()), *phrases)


def test_what_is_to_be_installed_exists() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {name for page in PAGES.values() for name in re.findall(r'"\.\[(\w+)\]"', page)}
    assert {"faults", "test", "notebook"} <= extras <= set(project["optional-dependencies"])


def test_files_that_are_linked_exist() -> None:
    for name in (*PAGES, "models/so101/README.md"):
        file = ROOT / name
        page = file.read_text("utf-8")
        for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", page):
            if target.startswith(MADE):
                assert "`make docs`" in page, f"{name}: {target} is not there in a clone"
            else:
                assert (file.parent / target).exists(), f"{name}: {target}"


def test_numbers_of_the_models_readme(mujoco_arm: Model, mujoco_box: Model) -> None:
    """The figures that the README of the model states are those of the model."""
    with opened(mujoco_box, keyframe=0, derived=True) as (_, data):
        box, size = data.raw.geom("box"), mujoco_box.raw.geom("box").size
        low = box.xpos[2] - abs(box.xmat[6:]) @ size  # of its lowest corner
    assert_in(
        (ROOT / "models" / "so101" / "README.md").read_text(),
        *(f"{mujoco_arm.raw.body_mass.sum():.2f} kg", f"{low * 1e3:.0f} mm clear"),
        *("0.028", "0.052", "998.22", "2.731", "2.94", "2.841", "2.744"),
    )
    assert mujoco_arm.dof_armature[0] == 0.028
