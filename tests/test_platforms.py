"""Where an engine has no wheel: what is installed there, and what is said without it."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform as machine
import re
import subprocess
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
import yaml
from packaging.requirements import Requirement

from statemachine import installed
from statemachine.errors import MissingEngineError
from statemachine.installed import ENGINES, engine_version

from .support.backends import BOTH
from .support.claims import assert_in, refused
from .support.files import distribution
from .support.processes import Cli, of_python
from .support.project import pinned_lines, project_table
from .support.requirements import ROOT

NAMES = {"mujoco", "pybullet", "pybullet-arm64", "pin", "motrixsim"}

LINUX, LINUX_ARM = "x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"
MAC, WINDOWS, WINDOWS_ARM = (
    "aarch64-apple-darwin", "x86_64-pc-windows-msvc", "aarch64-pc-windows-msvc",
)  # fmt: skip
# (platform, Python) -> the engines that it has besides MuJoCo; README's table.
FORK, MOTRIX = "pybullet-arm64==3.2.8", "motrixsim==0.10.1"
PLATFORMS = {
    (LINUX, "3.11"): {"pybullet==3.2.7", "pin", MOTRIX},
    (LINUX, "3.12"): {FORK, "pin", MOTRIX},
    (LINUX, "3.13"): {FORK, "pin", MOTRIX},
    (LINUX, "3.14"): {"pin"},
    (LINUX_ARM, "3.11"): {"pin", MOTRIX},
    (LINUX_ARM, "3.13"): {"pin", MOTRIX},
    (MAC, "3.11"): {FORK, "pin", MOTRIX},
    (MAC, "3.12"): {FORK, "pin", MOTRIX},
    (MAC, "3.13"): {"pybullet-arm64==3.2.7", "pin", MOTRIX},
    (MAC, "3.14"): {"pin"},
    (WINDOWS, "3.11"): {FORK, MOTRIX},
    (WINDOWS, "3.12"): {FORK, MOTRIX},
    (WINDOWS, "3.13"): {FORK, MOTRIX},
    (WINDOWS, "3.14"): set[str](),
}
_SYSTEMS = {"linux-gnu": "linux", "darwin": "darwin", "windows-msvc": "win32"}
_MACHINES = {MAC: "arm64", WINDOWS: "AMD64", WINDOWS_ARM: "ARM64"}


def _machine(platform: str) -> tuple[str, str]:
    """Return what Python calls the system and the processor of a platform."""
    processor, _, system = platform.split("-", 2)
    return _SYSTEMS[system], _MACHINES.get(platform, processor)


def engine_lines() -> list[str]:
    """Return the requirements of the project, with those of the extras that bring an engine."""
    table, extras = project_table(), {engine.extra for engine in ENGINES.values()} - {""}
    lines = list(table["dependencies"])
    for extra in sorted(extras):
        lines += table["optional-dependencies"][extra]
    return lines


def asked(platform: str, python: str, lines: Iterable[str]) -> dict[str, Requirement]:
    """Return the requirements whose markers hold there, by name; no name twice."""
    system, machine = _machine(platform)
    environment = {
        "sys_platform": system,
        "platform_machine": machine,
        "platform_python_implementation": "CPython",
        "python_version": python,
    }
    every = map(Requirement, lines)
    found = [r for r in every if r.marker is None or r.marker.evaluate(environment)]
    assert len({r.name for r in found}) == len(found)
    return {r.name: r for r in found}


def versions(platform: str, python: str) -> dict[str, str]:
    """Return the engines that a platform has besides MuJoCo, and their versions, "" for any."""
    wanted = (name.partition("==") for name in PLATFORMS[platform, python])
    return {name: version for name, _, version in wanted}


@pytest.mark.parametrize(("platform", "python"), PLATFORMS)
def test_markers_name_the_engines_of_each_platform(platform: str, python: str) -> None:
    found = asked(platform, python, engine_lines())
    wanted = versions(platform, python)
    assert set(found) & NAMES == {"mujoco", *wanted}
    pinned = asked(platform, python, pinned_lines())
    for name, version in wanted.items():
        assert version in str(pinned[name].specifier)
        assert pinned[name].specifier.contains(version or "4.1.0")
        assert found[name].specifier.contains(version or "4.1.0")


@pytest.mark.parametrize("platform", [LINUX, LINUX_ARM, MAC, WINDOWS, WINDOWS_ARM])
@pytest.mark.parametrize("minor", [11, 12, 13, 14])
def test_what_the_engines_say_to_install_is_what_the_markers_take(
    platform: str, minor: int
) -> None:
    found = asked(platform, f"3.{minor}", engine_lines())
    for engine in ENGINES.values():
        said = [wheel for wheel in engine.wheels if wheel.fits(*_machine(platform), minor)]
        assert {wheel.distribution for wheel in said} == set(found) & set(engine.distributions)
        assert len(said) <= 1
        for wheel in said:
            specifier = Requirement(wheel.requirement).specifier
            assert specifier in ("", found[wheel.distribution].specifier)


def _resolved(platform: str, python: str) -> subprocess.CompletedProcess[str]:
    """Ask uv which wheels would be installed on a platform."""
    return of_python(
        "-m", "uv", "pip", "compile", "-q", "--no-header", "--no-annotate", "--only-binary",
        ":all:", "--python-platform", platform, "--python-version", python, "--extra", "motrix",
        ROOT / "pyproject.toml",
    )  # fmt: skip


@pytest.fixture(scope="module")
def resolutions() -> dict[tuple[str, str], subprocess.CompletedProcess[str]]:
    """What uv says of each platform: all at once, for it waits for the package index."""
    with ThreadPoolExecutor(len(PLATFORMS)) as pool:
        return dict(zip(PLATFORMS, pool.map(_resolved, *zip(*PLATFORMS, strict=True)), strict=True))


@pytest.mark.slow
@pytest.mark.network
@pytest.mark.parametrize(("platform", "python"), PLATFORMS)
def test_what_is_installed_needs_no_compiler(
    platform: str,
    python: str,
    resolutions: dict[tuple[str, str], subprocess.CompletedProcess[str]],
) -> None:
    done = resolutions[platform, python]
    if done.returncode and re.search(r"[Ff]ailed to fetch|error sending request", done.stderr):
        pytest.skip(f"no package index can be reached: {done.stderr.splitlines()[0]}")
    assert done.returncode == 0, done.stderr
    found = dict(re.findall(r"^([\w-]+)==(\S+)", done.stdout, re.MULTILINE))
    wanted = versions(platform, python)
    assert set(found) & NAMES == {"mujoco", *wanted}
    for name, version in wanted.items():
        assert found[name] == version or not version


def test_what_to_install_depends_on_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """On another machine, as far as Python tells, on which no engine is installed."""
    nothing = Mock(side_effect=importlib.metadata.PackageNotFoundError("nothing"))
    monkeypatch.setattr(importlib.metadata, "version", nothing)
    for system, processor, minor, text in (
        ("linux", "x86_64", 11, "pip install pybullet ("),
        ("linux", "x86_64", 13, "pip install pybullet-arm64==3.2.8 ("),
        ("win32", "AMD64", 12, "pip install pybullet-arm64==3.2.8 ("),
        ("darwin", "arm64", 13, "pip install pybullet-arm64==3.2.7 ("),
        ("linux", "aarch64", 12, "no wheel for linux aarch64 and Python 3.12, only for Linux"),
        ("win32", "ARM64", 12, "no wheel for win32 ARM64 and Python 3.12"),
    ):
        monkeypatch.setattr(installed.sys, "platform", system)
        monkeypatch.setattr(machine, "machine", Mock(return_value=processor))
        monkeypatch.setattr(machine, "system", Mock(return_value=system))
        version = SimpleNamespace(major=3, minor=minor, micro=0)
        monkeypatch.setattr(installed.sys, "version_info", version)
        refused((MissingEngineError, re.escape(text), lambda: engine_version("pybullet")))


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_two_distributions_at_once_are_an_error_that_says_what_to_type(
    cli: Cli, tmp_path: Path
) -> None:
    both = tmp_path / "both"
    for name in ENGINES["pybullet"].distributions:
        distribution(both, name, "3.2.9")
    path = {"PYTHONPATH": os.pathsep.join((str(both), str(ROOT)))}
    done = cli("lesson", "gravity", "--backend", "pybullet", **path, code=3)
    (line,) = done.stderr.splitlines()
    assert_in(
        line,
        "pybullet and pybullet-arm64 are both installed",
        "pip uninstall -y pybullet pybullet-arm64, then ",
        "-m pip install pybullet",
    )
    found = json.loads(cli("doctor", "--json", **path).stdout)["findings"]
    (finding,) = (f for f in found if f["name"] == "pybullet" and not f["works"])
    assert "are both installed" in finding["found"]


def test_the_record_names_the_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    class Installed(dict[str, str]):
        def __missing__(self, name: str) -> str:
            raise importlib.metadata.PackageNotFoundError(name)

    official, fork = {"pybullet": "3.2.7"}, {"pybullet-arm64": "3.2.8"}
    for there, told in ((official, "3.2.7"), (fork, "3.2.8 (pybullet-arm64)")):
        monkeypatch.setattr(importlib.metadata, "version", Installed(there).__getitem__)
        assert engine_version("pybullet") == told
    monkeypatch.setattr(importlib.metadata, "version", Installed(official | fork).__getitem__)
    refused((MissingEngineError, "both installed", lambda: engine_version("pybullet")))


@pytest.mark.slow
def test_all_goes_on_with_the_engines_that_are_there(
    cli: Cli, without_pybullet: dict[str, str]
) -> None:
    done = cli("lesson", "gravity", "--backend", "all", **without_pybullet, code=0)
    assert "23.92°" in done.stdout
    (line,) = [line for line in done.stderr.splitlines() if "pybullet" in line]
    assert "pybullet is not installed here" in line
    told = cli("lesson", "state", "--backend", "all", "--json", **without_pybullet)
    assert [name for name in json.loads(told.stdout) if name in BOTH] == ["mujoco"]


# The file for public machines: its matrix asks for the engines that pyproject.toml installs


FILE = ROOT / ".github" / "workflows" / "tests.yml"
RUNNERS = {
    "ubuntu-24.04": LINUX,
    "ubuntu-24.04-arm": LINUX_ARM,
    "macos-15": MAC,
    "windows-2025": WINDOWS,
}


@pytest.fixture(scope="module")
def job() -> dict[str, Any]:
    return yaml.safe_load(FILE.read_text(encoding="utf-8"))["jobs"]["test"]


def test_each_machine_requires_the_engines_that_it_gets(job: dict[str, Any]) -> None:
    matrix = job["strategy"]["matrix"]
    required = {each["os"]: set(each["require"].split(",")) for each in matrix["include"]}
    assert set(required) == set(matrix["os"]) == set(RUNNERS)
    assert matrix["python"] == ["3.11", "3.12", "3.13"]
    for runner, python in product(matrix["os"], matrix["python"]):
        installed = asked(RUNNERS[runner], python, engine_lines())
        engines = {name for name, e in ENGINES.items() if installed.keys() & set(e.distributions)}
        assert required[runner] - {"render", "browser"} == engines, (runner, python)
    assert job["env"]["STATEMACHINE_REQUIRE"] == "${{ matrix.require }}"


def test_actions_are_pinned_and_steps_are_the_makefile_s(job: dict[str, Any]) -> None:
    used = [step["uses"] for step in job["steps"] if "uses" in step]
    assert used
    assert all(re.fullmatch(r"actions/[\w-]+@v\d+(\.\d+)*", each) for each in used)
    commands = "\n".join(step.get("run", "") for step in job["steps"])
    assert "make test" in commands
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for tool in ("ruff check .", "ruff format --check .", "lint-imports", "pyright --pythonpath"):
        assert f"$(BIN)/{tool}" in makefile
        assert rf".venv\Scripts\{tool}" in commands
