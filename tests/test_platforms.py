"""Where an engine has no wheel: what is installed there, and what is said without it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
import unicodedata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from .conftest import ROOT, Cli, need_engine

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

# (platform, Python) -> the engines that it has besides MuJoCo; README's table.
PLATFORMS = {
    ("x86_64-unknown-linux-gnu", "3.11"): {"pybullet", "pin"},
    ("x86_64-unknown-linux-gnu", "3.12"): {"pin"},
    ("x86_64-unknown-linux-gnu", "3.13"): {"pin"},
    ("aarch64-unknown-linux-gnu", "3.11"): {"pin"},
    ("aarch64-apple-darwin", "3.11"): {"pin"},
    ("aarch64-apple-darwin", "3.13"): {"pin"},
    ("x86_64-pc-windows-msvc", "3.11"): set[str](),
    ("x86_64-pc-windows-msvc", "3.13"): set[str](),
}


def _resolve(platform: str, python: str) -> subprocess.CompletedProcess[str]:
    """The versions that an installer would take there, from wheels alone."""
    command = (
        "uv", "pip", "compile", "-q", "--no-header", "--no-annotate", "--only-binary", ":all:",
        "--python-platform", platform, "--python-version", python, ROOT / "pyproject.toml",
    )  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    if done.returncode and re.search(r"[Ff]ailed to fetch|error sending request", done.stderr):
        pytest.skip(f"no package index can be reached: {done.stderr.splitlines()[0]}")
    return done


@pytest.mark.parametrize(("platform", "python"), PLATFORMS)
def test_markers_name_the_engines_of_each_platform(platform: str, python: str) -> None:
    machine, system = platform.split("-", maxsplit=1)[0], platform.split("-", 2)[2]
    environment = {
        "sys_platform": {"linux-gnu": "linux", "darwin": "darwin", "windows-msvc": "win32"}[system],
        "platform_machine": machine,
        "platform_python_implementation": "CPython",
        "python_version": python,
    }
    asked = [Requirement(line) for line in PROJECT["dependencies"]]
    found = {r.name for r in asked if r.marker is None or r.marker.evaluate(environment)}
    assert "mujoco" in found
    assert found & {"pybullet", "pin"} == PLATFORMS[platform, python]


@pytest.mark.slow
@pytest.mark.network
@pytest.mark.parametrize(("platform", "python"), PLATFORMS)
def test_what_is_installed_needs_no_compiler(platform: str, python: str) -> None:
    done = _resolve(platform, python)
    assert done.returncode == 0, done.stderr
    found = set(re.findall(r"^([\w-]+)==", done.stdout, re.MULTILINE))
    assert "mujoco" in found
    assert found & {"pybullet", "pin"} == PLATFORMS[platform, python]


@pytest.mark.slow
@pytest.mark.network
def test_intel_macs_are_not_promised() -> None:
    """README says that MuJoCo has no wheel there; when it has, the table can say so."""
    done = _resolve("x86_64-apple-darwin", "3.11")
    assert done.returncode != 0
    assert "mujoco" in done.stderr


@pytest.fixture
def without_pybullet(tmp_path: Path) -> dict[str, str]:
    """An environment in which PyBullet is not there, whatever this machine has."""
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / "sitecustomize.py").write_text(
        "import sys\n"
        "class Hide:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'pybullet':\n"
        "            raise ModuleNotFoundError(f'No module named {name!r}', name=name)\n"
        "sys.meta_path.insert(0, Hide())\n"
    )
    return {"PYTHONPATH": f"{hidden}:{ROOT}"}


def test_one_line_says_what_is_missing(cli: Cli, without_pybullet: dict[str, str]) -> None:
    done = cli("lesson", "gravity", "--backend", "pybullet", **without_pybullet)
    assert done.returncode == 3
    assert not done.stdout
    (line,) = done.stderr.splitlines()
    assert "pip install pybullet" in line
    assert "CPython 3.11" in line


def test_all_goes_on_with_the_engines_that_are_there(
    cli: Cli, without_pybullet: dict[str, str]
) -> None:
    done = cli("lesson", "gravity", "--backend", "all", **without_pybullet)
    assert done.returncode == 0
    assert "23.92°" in done.stdout
    assert "Where they differ" not in done.stdout
    (line,) = done.stderr.splitlines()
    assert "pybullet is not installed here" in line
    told = cli("lesson", "state", "--backend", "all", "--json", **without_pybullet)
    assert list(json.loads(told.stdout)) == ["mujoco"]


def test_the_doctor_calls_it_optional(cli: Cli, without_pybullet: dict[str, str]) -> None:
    done = cli("doctor", "--json", **without_pybullet)
    assert done.returncode == 0
    (finding,) = (f for f in json.loads(done.stdout)["findings"] if f["name"] == "pybullet")
    assert not finding["works"]
    assert "pip install" in finding["found"]


def test_with_it_every_lesson_speaks_of_both(cli: Cli) -> None:
    need_engine("pybullet")
    for lesson in ("state", "forward", "hold", "gravity"):
        done = cli("lesson", lesson, "--backend", "all")
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        # Differences come last, but for what to do next.
        after = done.stdout.partition("Where they differ, and by how much")[2]
        assert "pybullet against mujoco" in after
        assert "✓" not in after
        for line in done.stdout.splitlines():
            assert len([char for char in line if not unicodedata.combining(char)]) <= 80
