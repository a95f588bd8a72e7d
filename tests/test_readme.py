"""Every command, code block and number of the README holds."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT, Cli, need_engine

README = (ROOT / "README.md").read_text()
PAGES = [README, *(path.read_text() for path in sorted((ROOT / "docs").glob("*.md")))]
COMMANDS = list(
    dict.fromkeys(
        line.split("#")[0].strip()
        for page in PAGES
        for block in re.findall(r"```console\n(.*?)```", page, re.DOTALL)
        for line in block.splitlines()
        if line.startswith(("statemachine", "python exercises"))
    )
)
# Of exercises that are still to be written.
SAYS_NO = (
    "statemachine check exercises/step_loop.py",
    "statemachine check --mutants exercises/test_arm.py",
    "python exercises/step_loop.py --gravity",
)
# The engines differ there.
DIFFERS = re.compile(r"statemachine compare (hold(?!.*--why)|--models)")


def test_there_are_commands() -> None:
    assert len(COMMANDS) >= 25
    assert set(SAYS_NO) <= set(COMMANDS)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_command(cli: Cli, command: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    words = shlex.split(command)[1:]
    if "pybullet" in words:
        need_engine("pybullet")
    if "fingertip" in words:
        need_engine("pinocchio")
    if "path/to/menagerie" in words:
        folder = request.getfixturevalue("menagerie")
        words = [str(folder) if word == "path/to/menagerie" else word for word in words]
    if "path/to/robot.xml" in words:
        file = tmp_path / "robot.xml"
        file.write_text(
            "<mujoco><worldbody><body name='a'><inertial mass='1' pos='0 0 0' diaginertia='1 1 1'/>"
            "<joint name='j'/><site name='tip' pos='1 0 0'/></body></worldbody></mujoco>"
        )
        words = [str(file) if word == "path/to/robot.xml" else word for word in words]
    if "submissions" in words:
        (tmp_path / "submissions").mkdir()
        for name in ("ann.py", "bob.py"):
            solution = (ROOT / "teaching" / "solutions" / "step_loop.py").read_text()
            (tmp_path / "submissions" / name).write_text(solution)
    words = [str(ROOT / word) if word.startswith("exercises/") else word for word in words]
    if words and words[0] in ("compare", "audit", "view", "trace"):
        need_engine("pybullet")
    if "view" in words:
        words += ["--seconds", "1", "--port", "0"]
    if {"waves.npz", "played.npz", "my_controller.py"} & set(words):
        _make_traces(cli, tmp_path, words)
    if command.startswith("python"):
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, env=environment, check=False
        )
    else:
        done = cli(*words)
    no = command in SAYS_NO or DIFFERS.match(command)
    assert done.returncode == (1 if no else 0), done.stderr
    assert done.stdout or words[:2] == ["trace", "plot"]


def _make_traces(cli: Cli, folder: Path, words: list[str]) -> None:
    """The files that a command of the README takes as there."""
    (folder / "my_controller.py").write_text(
        "def controller(time, data):\n    return [0.1, -0.3, 0.5, 0.2, 0.0, 0.3]\n"
    )
    for name, line in (
        ("waves.npz", "trace record waves --seed 3 -o waves.npz"),
        ("played.npz", "trace play waves.npz --backend pybullet -o played.npz"),
    ):
        if name in words and words[-2:] != ["-o", name]:
            assert cli(*line.split()).returncode == 0


def test_python_block(tmp_path: Path) -> None:
    code, more = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    code += more
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("9.0")  # 6 s of the keyframe and 600 steps
    tip = [float(word) for word in re.findall(r"-?\d\.\d+", done.stdout)[1:]]
    assert f"[{' '.join(f'{value:.4f}' for value in tip[:3])}]" in README
    assert "Derived values of scene_box on mujoco" in done.stdout
    assert "1 of 1 reads were stale" in done.stdout


@pytest.mark.slow
def test_the_output_that_is_shown(cli: Cli) -> None:
    alone, both, part, causes = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    assert alone in cli("lesson", "gravity").stdout
    need_engine("pybullet")
    assert both in cli("lesson", "gravity", "--backend", "all").stdout
    assert part in cli("compare", "hold").stdout
    assert causes in cli("compare", "hold", "--defaults", "engine", "--why").stdout
    assert "one on top of the other: contact > 99.9 %." in cli("compare", "hold", "--why").stdout


def test_files_that_are_linked_exist() -> None:
    for file in (ROOT / "README.md", ROOT / "models" / "so101" / "README.md"):
        for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", file.read_text()):
            assert (file.parent / target).exists(), target


def test_numbers_of_the_models_readme() -> None:
    """The figures that the README of the model states are those of the model."""
    import numpy as np

    import statemachine as sm

    text = (ROOT / "models" / "so101" / "README.md").read_text()
    model = sm.load("so101")
    mass = model.raw.body_mass.sum()
    assert f"{mass:.2f} kg" in text
    for value in ("0.028", "0.052", "998.22", "2.731", "2.94", "2.841", "2.744"):
        assert value in text
    assert model.dof_armature[0] == 0.028
    box = sm.load("so101/scene_box")
    with sm.make_data(box) as data:
        sm.reset(box, data, keyframe=0)
        sm.forward(box, data)
        geom = box.geom_id("box")
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        turn = data.raw.geom_xmat[geom].reshape(3, 3)
        low = (data.raw.geom_xpos[geom] + (corners * box.raw.geom_size[geom]) @ turn.T)[:, 2].min()
    assert f"{low * 1e3:.0f} mm clear" in text
