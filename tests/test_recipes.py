"""The recipes of CONTRIBUTING are followed, in a copy of the package."""

from __future__ import annotations

import json
import re
import shutil
import textwrap
from pathlib import Path

import pytest

from .support.claims import assert_in
from .support.files import distribution, written_all
from .support.processes import of_python
from .support.requirements import ROOT, need_engine

# Where a recipe says "in _KINDS": how the line of the file begins after which its lines go.
PLACES = {
    "statemachine/course/lessons/__init__.py, in _LESSONS": "_LESSONS = (",
    "statemachine/measures/quantities.py, in _KINDS": '    Quantity("force"',
    "statemachine/measures/quantities.py, in _SUFFIXES": "_SUFFIXES = (",
    "statemachine/lab/compare/series.py, in series": "            curves += _joint(",
    "statemachine/lab/probes/conventions/__init__.py, in QUESTIONS": '    "timestep": ',
}


def recipe(title: str) -> str:
    """Return one section of CONTRIBUTING."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    return text.split(f"## {title}\n")[1].split("\n## ")[0]


def code(text: str, kinds: str = "python|markdown") -> list[str]:
    """Return its blocks of Python and of pages, or of other kinds."""
    found = re.findall(rf"^ *```(?:{kinds})\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(block) for block in found]


class Copy:
    """A copy of the package, to be changed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "statemachine", folder / "statemachine", ignore=ignored)
        shutil.copy(ROOT / "statemachine_sim.py", folder)
        (folder / "models").symlink_to(ROOT / "models")

    def follow(self, title: str) -> None:
        """Put each block of a recipe where its first line says."""
        for block in code(recipe(title)):
            head, _, body = block.partition("\n")
            place = re.sub(r"^(# |<!-- )| -->$", "", head)
            path, _, where = place.partition(", ")
            file = self.folder / path
            if not where:
                assert not file.exists()
                file.parent.mkdir(exist_ok=True)
                file.write_text(body)
            elif where == "at the end":
                file.write_text(f"{file.read_text()}\n\n{body}")
            else:
                if where.removeprefix("in ").isupper():  # an entry of a table
                    body = f"{body.rstrip()},\n"
                before, start, after = file.read_text().partition(f"\n{PLACES[place]}")
                line, _, rest = after.partition("\n")
                file.write_text(f"{before}{start}{line}\n{textwrap.indent(body, ' ' * 4)}{rest}")

    def run(self, *words: str, code: int = 0) -> str:
        """Return a command of the copy; what it prints."""
        here = {"PYTHONPATH": str(self.folder), "PYTHONUTF8": "1"}
        return of_python("-m", "statemachine", *words, folder=self.folder, code=code, **here).stdout


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    """Return a copy of the package as it is."""
    return Copy(tmp_path)


@pytest.mark.slow
def test_the_recipe_for_a_lesson_gives_a_lesson(copy: Copy) -> None:
    copy.follow("Add a lesson")
    assert 0 < json.loads(copy.run("lesson", "coast", "--json"))["mujoco"]["angle"] < 1
    assert "A push and nothing else" in copy.run("lesson", "--help")
    need_engine("pybullet")
    text = copy.run("lesson", "coast", "--backend", "all")
    assert text.count("and stands still") >= 1
    assert "✗" not in text


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_recipe_for_a_quantity_gives_a_compared_quantity(copy: Copy) -> None:
    copy.follow("Add a compared quantity")
    assert_in(copy.run("compare", "hold", "--seconds", "0.5", code=1), "rad/s", "gripper speed")
    given = ("--tolerance", "joint-speed=100rad/s", "--json", "--html", "hold.html")
    found = json.loads(copy.run("compare", "hold", "--seconds", "0.5", *given, code=1))
    rows = found["comparison"]["agreements"]
    assert [row["verdict"] for row in rows if row["kind"] == "joint speed"] == ["agrees"] * 6
    assert "elbow_flex speed" in (copy.folder / "hold.html").read_text()


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_recipe_for_a_convention_gives_a_question(copy: Copy) -> None:
    copy.follow("Add a convention")
    found = copy.run("conventions", "precision")
    assert "How precisely does the engine keep a position?" in found
    assert found.count("double") >= 2


@pytest.mark.slow
def test_the_recipe_for_a_backend_gives_one_that_keeps_the_contract(copy: Copy) -> None:
    text = (ROOT / "tests" / "support" / "hidden_world.py").read_text()
    backend = text.replace('backend="hidden"', 'backend="mine"')
    package = written_all(copy.folder / "my_package", {"backend.py": backend, "__init__.py": ""})
    shutil.copytree(ROOT / "tests" / "support" / "made_up", package / "room")
    (register,) = code(recipe("Add a backend"))
    here = {"PYTHONPATH": str(copy.folder)}
    done = of_python("-c", register, folder=copy.folder, code=0, **here)
    results = [line.split()[0] for line in done.stdout.splitlines()]
    assert set(results) <= {"passed", "skipped"}
    assert results.count("passed") > 40
    (toml,) = code(recipe("Add a backend"), "toml")
    entries = toml.replace("project.entry-points.", "").replace('"', "")
    distribution(copy.folder, "my-package", "1.0", entries)
    assert "mine" in copy.run("lesson", "hold", "--backend", "mine")
    assert "mine" in copy.run(
        "compare", "hold", "--seconds", "0.3", "--backend", "mujoco", "--backend", "mine"
    )


@pytest.mark.slow
def test_the_change_of_the_first_hour_passes_its_test(copy: Copy) -> None:
    copy.follow("A first hour")
    here = {"PYTHONPATH": str(copy.folder)}
    of_python("-m", "pytest", "-q", "tests/test_micrometres.py", folder=copy.folder, code=0, **here)


def joint_that_coasts() -> str:
    """Return the code of the recipe that holds both engines against a closed form."""
    _, coasts = code(recipe("Find and mend a fault in PyBullet's joint dynamics"))
    return coasts


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_a_joint_coasts_as_its_closed_form_says(copy: Copy) -> None:
    of_python("-c", joint_that_coasts(), folder=copy.folder, code=0, PYTHONPATH=str(copy.folder))


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_closed_form_notices_the_fault_to_try_out(copy: Copy) -> None:
    file = copy.folder / "statemachine" / "backends" / "bullet" / "joint_dynamics.py"
    right = "-self._dry_damping * speed[self._dry_joints]"
    text = file.read_text()
    assert text.count(right) == 1
    assert right in recipe("Find and mend a fault in PyBullet's joint dynamics")
    file.write_text(text.replace(right, "0.0 * speed[self._dry_joints]"))
    here = {"PYTHONPATH": str(copy.folder)}
    done = of_python("-c", joint_that_coasts(), folder=copy.folder, code=1, **here)
    assert "AssertionError" in done.stderr
