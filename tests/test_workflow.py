"""The file for public machines: its matrix asks for the engines that pyproject.toml installs."""

from __future__ import annotations

import re
from itertools import product
from typing import Any

import pytest
import yaml

from statemachine.installed import ENGINES

from .conftest import ROOT
from .test_platforms import LINUX, LINUX_ARM, MAC, PROJECT, WINDOWS, asked

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
        installed = asked(RUNNERS[runner], python, PROJECT["dependencies"])
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
