"""The command line, end to end; in a process of its own where its start or end is asked for."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from rich.cells import cell_len

from statemachine.course.lessons import LESSONS
from statemachine.models import models_dir

from .support.backends import BOTH
from .support.claims import assert_has, assert_in, assert_not_in
from .support.explained import with_changes
from .support.files import written
from .support.pages import QUICK, need_engines_of
from .support.processes import Cli, run_main, without_estimates
from .support.requirements import ROOT
from .support.small_models import mjcf


def _json(cli: Cli, *arguments: str) -> Any:
    done = cli(*arguments, "--json", code=0)
    assert done.stderr == ""
    return json.loads(done.stdout, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


@pytest.mark.slow
@pytest.mark.parametrize("lesson", LESSONS)
@pytest.mark.parametrize("backend", BOTH, indirect=True)
def test_every_lesson_runs_and_reads_well_piped(here: Cli, lesson: str, backend: str) -> None:
    need_engines_of(lesson)
    done = here("lesson", lesson, "--backend", backend, *QUICK.get(lesson, ()), code=0)
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert len(lines) > 8
    assert max(map(cell_len, lines)) <= 80
    assert all(line == line.rstrip() for line in lines)
    assert_not_in(done.stdout, "\x1b", "✗")
    assert "nan" not in done.stdout.lower().split()


@pytest.mark.parametrize(
    "row", ["0.000° 0.00°", "0.033° 23.88°", "0.033° 23.89°", "0.033° 23.90°", "0.033° 23.92°"]
)
def test_gravity_prints_the_table_of_the_course(row: str, gravity_page: str) -> None:
    assert re.search(row.replace(" ", r"\s+").replace(".", r"\."), gravity_page)


@pytest.fixture(scope="module")
def gravity_page() -> str:
    """What the lesson on gravity prints."""
    return run_main("lesson", "gravity").stdout


@pytest.fixture(scope="module")
def gravity() -> dict[str, Any]:
    """The JSON of the lesson on gravity, of MuJoCo."""
    return json.loads(run_main("lesson", "gravity", "--json").stdout)["mujoco"]


def test_the_floor_holds_the_fallen_arm_and_not_damping_or_dry_friction(
    gravity: dict[str, Any],
) -> None:
    off = gravity["servos_off"]
    assert_has(off, ctrl_untouched=True, touching=["gripper on floor (fixed_stud_1)"])
    assert off["forces"]["contact"] / off["forces"]["bias"] > 0.95
    assert abs(off["forces"]["friction"]) < 0.052


def test_the_falling_arm_touches_the_floor_before_a_second(gravity: dict[str, Any]) -> None:
    assert 0.5 < min(gravity["servos_off"]["touches"].values()) < 1.0


@pytest.mark.parametrize("run", ["servos_on", "servos_off"])
def test_forces_of_an_arm_at_rest_add_up_to_nothing(run: str, gravity: dict[str, Any]) -> None:
    assert abs(gravity[run]["forces"]["total"]) < 1e-5


def test_nothing_touches_an_arm_that_is_held(gravity: dict[str, Any]) -> None:
    assert gravity["servos_on"]["forces"]["contact"] == 0.0


@pytest.mark.slow
def test_gravity_on_the_public_scene_is_the_table_of_the_course(here: Cli, menagerie: Path) -> None:
    page = here("lesson", "gravity", "--menagerie", menagerie).stdout
    assert "robotstudio_so101/scene.xml" in page
    assert re.search(r"0\.033°\s+23\.92°", page)


@pytest.mark.slow
def test_the_folder_of_the_arm_stands_for_that_of_all_robots(cli: Cli, menagerie: Path) -> None:
    inside = cli("lesson", "reset", MENAGERIE=str(menagerie / "robotstudio_so101"))
    assert "'pickup'" in inside.stdout


@pytest.mark.slow
@pytest.mark.parametrize("lesson", [name for name in LESSONS if name != "energy"])  # of no arm
def test_a_lesson_runs_on_the_public_scenes(here: Cli, menagerie: Path, lesson: str) -> None:
    need_engines_of(lesson)
    here("lesson", lesson, "--menagerie", menagerie, *QUICK.get(lesson, ()), code=0)


def test_fingertip_of_other_models_and_frames(here: Cli, pinocchio: None) -> None:
    here("fingertip", "--site", "baseframe", code=0)
    scene = ("fingertip", "so101/scene_box")
    assert_in(here(*scene, code=0).stdout, "included files read in: 2", "own reading")
    here(*scene, "--witness", "so101", code=0)


MOVED, LONGER = ("-0.098127", "-0.078227"), ("-0.11257 -0.028 0", "-0.11258 -0.028 0")
TURNED = ('-0.098127" quat="0.7071067811865475 0 0.7071067811865475 0', '-0.078227" quat="1 0 0 0')
NEARLY = ('pos="0.012 -0.000218', 'pos="0.01201 -0.000218')
NEARLY_TURNED = ('quat="0.7071067811865475 0 0.7071067811865475', 'quat="0.70711 0 0.7071')
RENAMED = ('body name="gripper"', 'body name="hand"')


@pytest.mark.parametrize(
    ("edits", "said"),
    [
        ((TURNED,), ("19.90 mm, 90.00°", "refused")),
        ((NEARLY,), ("refused",)),
        ((NEARLY_TURNED,), ("refused",)),
        ((LONGER,), ("DISAGREE", "1.0e-05")),
        ((RENAMED,), ()),
        ((RENAMED, MOVED), ("19.90 mm, 0.00°",)),
        ((RENAMED, MOVED, LONGER), ("19.90 mm, 0.00°", "refused")),
        ((RENAMED, LONGER), ("DISAGREE", "1.0e-05")),
    ],
)
def test_fingertip_against_another_arm(
    here: Cli, tmp_path: Path, pinocchio: None, edits: tuple[tuple[str, str], ...], said: Any
) -> None:
    text = (models_dir() / "so101" / "so101.xml").read_text()
    text = re.sub(r"<mesh name.*\n|<geom class=\"look\".*\n", "", text)
    file = written(tmp_path / "other.xml", with_changes(text, edits))
    page = here("fingertip", "--witness", str(file))
    assert page.returncode == bool(said)
    assert all(part in page.stdout for part in said)
    found = json.loads(here("fingertip", "--witness", str(file), "--json").stdout)["mujoco"]
    assert found["agrees"] == (not said)
    assert found["position_worst"] is None or "refused" not in said


def test_alone_it_names_the_commands_to_begin_with(here: Cli) -> None:
    text = here(code=0).stdout
    commands = re.findall(r"^    statemachine (\w+)", text, re.M)
    assert commands == ["lesson", "check", "compare", "doctor"]
    assert "statemachine --help" in text
    assert max(map(len, text.splitlines())) <= 80
    assert text.count("\n") <= 14


def test_the_help_of_lesson_lists_the_lessons_in_order(here: Cli) -> None:
    text = here("lesson", "--help", code=0).stdout
    places = [text.index(f"\n    {name} ") for name in LESSONS]
    assert places == sorted(places)


def in_a_shell(command: str) -> subprocess.CompletedProcess[str]:
    """Return what becomes of a command of ours with something behind it."""
    done = subprocess.run(
        ["sh", "-c", f"{sys.executable} -m statemachine {command}"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    done.stderr = without_estimates(done.stderr)
    return done


def test_a_pipe_that_closes_early_is_no_error() -> None:
    assert in_a_shell("lesson state | head -1").stderr == ""


def test_a_pipe_whose_reader_has_left_ends_the_command_in_silence() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "statemachine"],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.slow
def test_a_terminal_without_unicode(cli: Cli) -> None:
    done = cli(
        "lesson", "gravity", PYTHONUTF8="0", PYTHONIOENCODING="ascii:strict", LC_ALL="C", code=0
    )
    assert "23.92" in done.stdout


def test_the_doctor_knows_every_package_of_an_extra(here: Cli) -> None:
    """But for those that only work on this library itself needs."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    own_work = ("test", "check", "policy-training")
    named: dict[str, list[str]] = {}
    for extra, requirements in project["optional-dependencies"].items():
        for requirement in requirements if extra not in own_work else ():
            package = re.split(r"[<>=\[]", requirement)[0]
            # The viewer and an engine have lines of their own.
            if package not in ("statemachine-sim", "viser", "motrixsim"):
                named.setdefault(package, []).append(extra)
    found = json.loads(here("doctor", "--json").stdout)
    told, findings = found["packages"], {f["name"]: f for f in found["findings"]}
    assert (findings["mujoco"]["works"], findings["viser"]["optional"]) == (True, True)
    assert {each["name"]: sorted(each["extras"]) for each in told} == {
        package: sorted(extras) for package, extras in named.items()
    }
    assert {each["name"]: each["version"] for each in told}["pytest"] == pytest.__version__


@pytest.mark.slow
def test_the_doctor_says_what_the_viewer_lacks(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "viser.py").write_text("raise ImportError('gone')\n")
    done = cli("doctor", "--json", PYTHONPATH=f"{tmp_path}{os.pathsep}{ROOT}", code=0)
    (viewer,) = (f for f in json.loads(done.stdout)["findings"] if f["name"] == "viser")
    assert not viewer["works"]
    assert "pip install -e " in viewer["found"]
    assert "[view]" in viewer["found"]


def test_the_command_says_its_version(cli: Cli) -> None:
    from statemachine import __version__

    assert cli("--version").stdout.split() == ["statemachine", __version__]


def _model(folder: Path, body: str, rest: str = "") -> str:
    return str(written(folder / "robot.xml", mjcf(body, rest)))


@pytest.mark.slow
def test_gravity_at_the_moment_of_the_first_touch(cli: Cli) -> None:
    for seconds in ("0.005", "0.3", "0.535", "0.54", "1"):
        cli("lesson", "gravity", "--seconds", seconds, code=0)


def test_gravity_of_a_slide_and_of_an_equality(here: Cli, tmp_path: Path) -> None:
    file = _model(
        tmp_path,
        "<body name='p'><joint name='j' type='slide' axis='0 0 1'/>"
        "<geom size='0.1' mass='1'/></body>",
        "<equality><joint joint1='j'/></equality><actuator><position joint='j' kp='1'/></actuator>",
    )
    page = here("lesson", "gravity", "--model", file, "--joint", "j", code=0)
    assert re.search(r"by +equality +equality", page.stdout)
    assert_in(page.stdout, "[N]", "mm")


@pytest.mark.slow
def test_a_body_of_the_scene_is_not_taken_for_the_robot(here: Cli) -> None:
    found = _json(here, "lesson", "gravity", "--model", "so101/scene_box")["mujoco"]["servos_off"]
    assert not [touch for touch in found["touches"] if touch.startswith("box")]
    assert min(found["touches"].values()) > 0.5
    held = _json(here, "lesson", "hold", "--model", "so101/scene_box")["mujoco"]
    assert held["first_contact"] > 0.2


@pytest.mark.parametrize(
    "command",
    ["", *(pytest.param(f"lesson state{o}", marks=pytest.mark.slow) for o in ("", " --json"))],
)
def test_output_that_cannot_be_written(command: str) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    for redirection, code in (("> /dev/full", 74), (">&-", 0), (">/dev/null 2>&-", 0)):
        done = in_a_shell(f"{command} {redirection}")
        assert done.returncode == code, done.stderr
        assert len(done.stderr.splitlines()) == bool(code), done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("lesson", "state", "--backend", "all"), ("mujoco",)),
        (("lesson", "state", "--model", "so101"), ("the same slots",)),
        (("lesson", "forward", "--calls"), ("mj_forward",)),
        # At 0.1 s the joint is slow and about to move: that its forces do not cancel is right.
        (("lesson", "gravity", "--seconds", "0.1"), ("still moves",)),
        (
            ("lesson", "hold", "--ctrl", "100,0,0,0,0,0"),
            ("command", "5729.58°", "110.00°"),
        ),
        (
            ("lesson", "replay", "--break", "late-ctrl", "--ctrl", "0,-0.6,0.5,1.6,1.57,0.28"),
            ("made no difference",),
        ),
    ],
)
def test_what_a_page_says_of_a_special_case(
    here: Cli, arguments: tuple[str, ...], said: tuple[str, ...]
) -> None:
    page = here(*arguments, code=0)
    assert all(part in page.stdout for part in said)
    assert "never by arithmetic" not in page.stdout or "so101" not in arguments


@pytest.mark.parametrize(
    ("body", "loads", "says"),
    [
        ("<body><joint name='b' type='ball'/><geom size='0.1'/></body>", ["mujoco"], "ball joint"),
        ("<nonsense/>", [], "cannot read"),
        (None, ["mujoco", "pybullet"], ""),  # the arm's own URDF
    ],
)
@pytest.mark.usefixtures("bullet", "both_are_all")
def test_each_refusal_of_a_model_is_one_line(
    here: Cli, tmp_path: Path, body: str | None, loads: list[str], says: str
) -> None:
    file = str(models_dir() / "so101" / "so101.urdf") if body is None else _model(tmp_path, body)
    done = here("lesson", "state", "--model", file, "--backend", "all", "--json")
    assert done.returncode == (0 if loads else 2)
    assert [name for name in json.loads(done.stdout or "{}") if name != "schema"] == loads
    assert len(done.stderr.splitlines()) == bool(says)
    assert says in done.stderr


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_what_an_engine_warns_of_is_one_line_without_our_code(cli: Cli, tmp_path: Path) -> None:
    body = (
        "<geom type='plane' size='1 1 1' friction='.1'/><body pos='0 0 1'><joint name='j'/>"
        "<geom size='.1' friction='.1'/><geom pos='1 0 0' size='.1' friction='.9'/></body>"
    )
    done = cli("lesson", "state", "--model", _model(tmp_path, body), "--backend", "pybullet")
    assert re.fullmatch(
        r"statemachine: PyBullet: it has one friction (?:(?!\.py).)*\n", done.stderr
    )


@pytest.mark.parametrize("command", ["compare", "sweep"])
def test_help_shows_few_options_and_help_all_every_one(here: Cli, command: str) -> None:
    few, every = here(command, "--help").stdout, here(command, "--help-all").stdout
    assert few.count("\n  --") <= 12 < every.count("\n  --")


def test_a_lesson_is_called_by_its_number_on_the_path(here: Cli) -> None:
    assert here("lesson", "3", "--code").stdout == here("lesson", "state", "--code").stdout
