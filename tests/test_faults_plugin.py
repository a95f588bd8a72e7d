"""The plugin by which a student's tests run on an arm with a fault, asked in this process."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from statemachine.backends import backend_names
from statemachine.course.grading.faults import FAULT, FAULTS, IMPORT, patches, plugin
from statemachine.course.grading.faults.plugin import PytestRecorder


class Config:
    """The configuration of a session of pytest, and what is made of it.

    Attributes:
        options: By name.
        args: What is typed behind the options.
        registered: The plugins that were added.
        guards: What the guard was told to guard.
        loaded: Which model was loaded, on which engine.
        patched: The faults that were put in.
    """

    def __init__(self, patch: pytest.MonkeyPatch, root: Path) -> None:
        self.tests, self.record = root / "mine" / "test_arm.py", root / "out" / "record"
        for folder in (self.tests.parent, self.record.parent):
            folder.mkdir()
        patch.chdir(self.tests.parent)
        self.options: dict[str, Any] = {"record": None, "engine": "pybullet", "watched": False}
        self.args = ["test_arm.py::test_one"]
        self.registered: list[Any] = []
        self.guards: list[dict[str, Any]] = []
        self.loaded: list[tuple[str, str]] = []
        self.patched: list[str] = []
        self.pluginmanager = SimpleNamespace(register=self.registered.append)
        patch.delenv(FAULT, raising=False)
        patch.setattr(plugin, "Guard", self._guard)
        patch.setattr(
            plugin.sm, "load", lambda model, backend: self.loaded.append((model, backend))
        )
        faults = {name: lambda _, name=name: self.patched.append(name) for name in FAULTS}
        patch.setattr(patches, "PATCHES", faults)

    def getoption(self, name: str) -> Any:
        """Return the value of an option."""
        return self.options[name]

    def _guard(self, file: Path, mine: Path, work: Path, report: Any, **flags: bool) -> None:
        report("reads", "nothing is done with it")
        self.guards.append({"file": file, "mine": mine, "work": work, **flags})


@pytest.fixture
def config(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Config:
    """Return the configuration of a session that has not begun."""
    return Config(monkeypatch, tmp_path)


def configure(config: Any) -> None:
    """Begin a session."""
    plugin.pytest_configure(config)


@pytest.mark.parametrize("name", ["xyzw", "no-replay"])
def test_the_fault_that_is_named_is_put_in_and_its_name_taken_away(
    name: str, config: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FAULT, name)
    configure(config)
    assert config.patched == [name]
    assert FAULT not in os.environ


def test_without_a_name_the_arm_is_healthy(config: Config) -> None:
    configure(config)
    assert config.patched == []


def test_without_a_record_nothing_is_watched(config: Config) -> None:
    configure(config)
    assert (config.registered, config.guards, config.loaded) == ([], [], [])
    assert Path.cwd() == config.tests.parent


@pytest.mark.parametrize("watched", [False, True])
def test_with_a_record_the_tests_are_watched(watched: bool, config: Config) -> None:
    config.options |= {"record": str(config.record), "watched": watched}
    configure(config)
    [guard] = config.guards
    assert guard == {
        "file": config.tests,
        "mine": config.tests.parent,
        "work": config.record.parent,
        "is_only_guard": watched,
        "faults": True,
    }


def test_with_a_record_what_tests_write_ends_up_beside_it(config: Config) -> None:
    config.options["record"] = str(config.record)
    configure(config)
    assert Path.cwd() == config.record.parent


def test_the_arm_is_loaded_on_the_engine_before_anything_is_watched(config: Config) -> None:
    config.options["record"] = str(config.record)
    configure(config)
    assert config.loaded == [("so101/scene_box", "pybullet")]


def test_with_a_record_it_is_written(config: Config) -> None:
    config.options["record"] = str(config.record)
    configure(config)
    [recorder] = config.registered
    assert isinstance(recorder, PytestRecorder)
    assert lines_of(config.record) == [{"ready": True}]


def test_the_options_of_a_session_are_the_engine_and_the_record() -> None:
    added: dict[str, dict[str, Any]] = {}
    groups: list[str] = []

    def getgroup(name: str) -> Any:
        groups.append(name)
        return SimpleNamespace(addoption=lambda flag, **facts: added.update({flag: facts}))

    parser: Any = SimpleNamespace(getgroup=getgroup)
    plugin.pytest_addoption(parser)
    assert groups == ["statemachine"]
    assert list(added) == ["--engine", "--record", "--watched"]
    assert tuple(added["--engine"]["choices"]) == tuple(backend_names())
    assert added["--engine"]["default"] == "mujoco"
    assert added["--watched"]["action"] == "store_true"


# The record.


def lines_of(record: Path) -> list[dict[str, Any]]:
    """Return the lines of a record."""
    return [json.loads(line) for line in record.read_text("utf-8").splitlines()]


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """Return the file of a record, with a line of an earlier session."""
    file = tmp_path / "record"
    file.write_text('{"before": 1}\n', "utf-8")
    return file


def recorded(record: Path, *events: tuple[str, Any]) -> list[dict[str, Any]]:
    """Return the lines that a recorder adds for some events, behind that it is ready."""
    recorder: Any = PytestRecorder(record)
    for name, argument in events:
        getattr(recorder, f"pytest_{name}")(argument)
    first, ready, *lines = lines_of(record)
    assert (first, ready) == ({"before": 1}, {"ready": True})
    return lines


def item(name: str) -> Any:
    """Return a test that was found."""
    return SimpleNamespace(nodeid=f"mine/test_arm.py::{name}")


def test_tests_are_named_as_within_their_file(record: Path) -> None:
    found = [item("test_one"), item("TestArm::test_two[a::b]")]
    lines = recorded(record, ("collection_modifyitems", found))
    assert lines == [{"tests": ["test_one", "TestArm::test_two[a::b]"]}]


def test_a_test_that_begins_is_written_at_once(record: Path) -> None:
    started = ("runtest_logstart", "mine/test_arm.py::test_one")
    assert recorded(record, started) == [{"begins": "test_one"}]


@pytest.mark.parametrize("outcome", ["passed", "failed", "skipped"])
def test_a_report_is_written_as_it_comes(outcome: str, record: Path) -> None:
    report = SimpleNamespace(
        nodeid="mine/test_arm.py::test_one", when="call", outcome=outcome, longreprtext="E   no é"
    )
    assert recorded(record, ("runtest_logreport", report)) == [
        {"test": "test_one", "when": "call", "outcome": outcome, "text": "E   no é"}
    ]


@pytest.mark.parametrize("failed", [False, True])
def test_a_file_that_cannot_be_imported_is_written(failed: bool, record: Path) -> None:
    report = SimpleNamespace(failed=failed, longreprtext="E   NameError")
    line = {"test": IMPORT, "when": "collect", "outcome": "failed", "text": "E   NameError"}
    assert recorded(record, ("collectreport", report)) == [line] * failed
