"""Whether a policy does as it is asked: what it is asked, what is tolerated, and what is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from statemachine import load
from statemachine.backends import BackendChoice
from statemachine.errors import BadInputError, EngineWarning, MissingEngineError
from statemachine.interface import Model
from statemachine.lab.policy.command import Command, usual_commands
from statemachine.lab.policy.contract import Contract
from statemachine.lab.policy.contract_file import read_contract
from statemachine.lab.policy.floor import check_floor
from statemachine.lab.policy.page import page
from statemachine.lab.policy.request import PolicyRequest, PolicyResult, answer
from statemachine.lab.policy.walk import Walk
from statemachine.lab.runs.drive import Progress
from statemachine.lab.runs.each_backend import on_each_backend
from statemachine.lab.runs.reporter import QuietReporter
from statemachine.models import AnyPath
from statemachine.show.blocks import Code, Verdict
from tools.policy_faults import FAULTS, written_with

from .support.files import written
from .support.policies import (
    GO1_CONTRACT,
    constant_network,
    content,
    contract,
    contract_file,
    robot,
)
from .support.requirements import ROOT, SHARED, need_engine, shared

yaml = pytest.importorskip("yaml")
QUADRUPED = ROOT / "models" / "quadruped"
LIMIT = "policy_io.commands.base_velocity.limit"


def walk(command: Command, *reached: float) -> Walk:
    """Return a run that reached three speeds."""
    vx, vy, wz = reached
    return Walk(command, 10.0, "walked", (vx, vy, wz), 0.0, 0.0, 0.0, None, 0.0, "", 0.0)


# -- what is asked ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "forward", "turn"),
    [
        ({}, 0.5, 0.5),
        ({"vx": [-0.4, 1.5]}, 1.5, 0.5),
        ({"wz": [-0.6, 0.3]}, 0.5, 0.3),
        ({"vx": [-0.5, 0.5], "wz": [-0.6, 0.6]}, 0.5, 0.6),
    ],
)
def test_a_policy_is_asked_for_the_largest_speeds_of_its_contract(
    tmp_path: Path, limits: dict[str, Any], forward: float, turn: float
) -> None:
    commands = usual_commands(contract(tmp_path, {LIMIT: limits}))
    assert commands == (Command(forward), Command(forward, 0.0, turn))


@pytest.mark.parametrize(
    ("command", "tolerances"),
    [
        (Command(0.5, 0.0, 0.6), (0.1, 0.05, 0.12)),
        (Command(-1.0, 0.4, -2.0), (0.2, 0.08, 0.4)),
        (Command(0.1), (0.05, 0.05, 0.1)),
    ],
)
def test_a_part_of_each_speed_is_tolerated_and_at_least_so_much(
    command: Command, tolerances: tuple[float, float, float]
) -> None:
    assert command.tolerances == pytest.approx(tolerances)


@pytest.mark.parametrize(
    ("reached", "verdict"),
    [
        ((0.3, 0.0, 0.5), "walks"),
        ((0.25, 0.0, 0.5), "walks"),
        ((0.22, 0.0, 0.5), "wrong speed"),  # of a clock that is half as fast
        ((0.39, 0.0, 0.5), "wrong speed"),
        ((0.3, 0.04, 0.5), "walks"),
        ((0.3, -0.06, 0.5), "wrong speed"),
        ((0.3, 0.0, 0.41), "walks"),
        ((0.3, 0.0, 0.39), "wrong speed"),
    ],
)
def test_each_speed_is_to_be_met(reached: tuple[float, float, float], verdict: str) -> None:
    assert walk(Command(0.3, 0.0, 0.5), *reached).verdict == verdict


def test_the_worst_axis_is_that_farthest_beyond_what_is_tolerated() -> None:
    """0.07 of 0.1 rad/s is less than 0.04 of 0.05 m/s to the left."""
    assert walk(Command(0.3, 0.0, 0.5), 0.3, 0.04, 0.43).worst_axis == "vy"


# -- what runs give ---------------------------------------------------------------


def of_quadruped(folder: Path, fault: str, backend: str) -> PolicyResult:
    """Return how the quadruped walks by its contract with a fault, where nothing else is named."""
    need_engine(backend)
    fields = yaml.safe_load((QUADRUPED / "contract.yaml").read_text("utf-8"))
    file = written_with(fields, fault, folder)
    policy = QUADRUPED / "policy.onnx"
    return answer(PolicyRequest(policy, file, "quadruped/scene", (backend,)))


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "pybullet", "motrix"])
def test_a_sound_contract_holds_with_room(tmp_path: Path, backend: str) -> None:
    (engine,) = of_quadruped(tmp_path, "", backend).engines
    assert max(run.error for run in engine.walks) < 0.75


@pytest.mark.slow
@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_no_fault_of_a_contract_passes(tmp_path: Path, fault: str) -> None:
    result = of_quadruped(tmp_path, fault, "mujoco")
    assert not result.holds
    assert max(run.error for run in result.engines[0].walks) > 1.3


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_a_public_policy_holds(tmp_path: Path, backend: str) -> None:
    need_engine(backend)
    policy = shared(SHARED / "policies" / "go1" / "policy.onnx")
    file = written(tmp_path / "go1.yaml", GO1_CONTRACT)
    assert answer(PolicyRequest(policy, file, policy.with_name("scene.xml"), (backend,))).holds


def test_a_policy_that_starts_inside_the_floor_is_told_so(tmp_path: Path) -> None:
    need_engine("mujoco")
    policy = shared(SHARED / "policies" / "go1" / "policy.onnx")
    file = written(tmp_path / "go1.yaml", GO1_CONTRACT)
    scene, straight = policy.with_name("scene.xml"), (Command(0.5),)
    with pytest.warns(EngineWarning, match="FR_calf on floor by 16.5 mm"):
        answer(PolicyRequest(policy, file, scene, commands=straight, seconds=0.1))


# -- what is said -----------------------------------------------------------------


def of_robot(folder: Path, changes: dict[str, Any] | None = None, **asked: Any) -> PolicyResult:
    """Return what the small robot does in 0.1 s whose policy tells its legs to keep still."""
    need_engine("mujoco")
    network = constant_network(folder, [0.0, 0.0])
    file = contract_file(folder, content(changes))
    return answer(PolicyRequest(network, file, robot(folder), seconds=0.1, **asked))


def next_words(result: PolicyResult) -> list[str]:
    """Return the words of the command that a page ends with."""
    (code,) = [block for block in page(result).blocks if isinstance(block, Code)]
    return " ".join(code.lines).replace("\\ ", " ").split()


def test_what_is_asked_of_a_robot_that_stands_still_is_missed(tmp_path: Path) -> None:
    result = of_robot(tmp_path, commands=(Command(0.5),))
    assert next_words(result)[-1] == "--faults"


def test_what_is_met_leads_to_the_details(tmp_path: Path) -> None:
    assert next_words(of_robot(tmp_path, commands=(Command(0.0),)))[-1] == "--details"


def test_the_next_command_has_short_lines(tmp_path: Path) -> None:
    (code,) = [block for block in page(of_robot(tmp_path)).blocks if isinstance(block, Code)]
    assert len(code.lines) > 1
    assert all(len(line) <= 76 or len(line.split()) <= 3 for line in code.lines)


@pytest.mark.parametrize(("vx", "tolerance"), [(0.0, "0.05"), (0.1, "50.0 %"), (0.5, "20.0 %")])
def test_the_verdict_has_what_is_tolerated(tmp_path: Path, vx: float, tolerance: str) -> None:
    result = of_robot(tmp_path, commands=(Command(vx),))
    (verdict,) = [block for block in page(result).blocks if isinstance(block, Verdict)]
    assert verdict.holds == (vx == 0.0)
    assert tolerance in " ".join(str(verdict.text).split("\N{NO-BREAK SPACE}"))


# -- fields that nothing reads ----------------------------------------------------


@pytest.mark.parametrize(
    ("field", "nearest"),
    [
        ("policy_io.imo", "policy_io.imu"),
        ("control.actions.joint_pos.dealy_steps", "control.actions.joint_pos.delay_steps"),
        ("model.armatur", "model.armature"),
        ("timing.remark", ""),
        ("colour", ""),
    ],
)
def test_a_field_that_nothing_reads_has_the_one_that_it_may_mean(
    tmp_path: Path, field: str, nearest: str
) -> None:
    (unread,) = contract(tmp_path, {field: {"site": "imu"}}).unread
    assert (unread.name, unread.nearest) == (field, nearest)


def test_a_misspelt_field_is_no_mere_note(tmp_path: Path) -> None:
    result = of_robot(tmp_path, {"policy_io.imo": {"frame": "world"}, "colour": "red"})
    kinds = [(note.kind, note.names, note.nearest) for note in result.notes]
    assert ("misspelt", ("policy_io.imo",), "policy_io.imu") in kinds
    assert ("unread", ("colour",), "") in kinds


def test_nothing_is_misspelt_in_the_contract_of_the_quadruped() -> None:
    assert sound().misspelt == ()


def sound() -> Contract:
    return read_contract(QUADRUPED / "contract.yaml")


# -- what it stands on ------------------------------------------------------------


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_a_robot_without_a_floor_is_told_its_scene(backend: str) -> None:
    need_engine(backend)
    with pytest.raises(BadInputError, match=r"take quadruped/scene$"):
        check_floor(load("quadruped/quadruped", backend=backend))


PLANE = '<geom name="floor" type="plane" size="0 0 1"/>'


@pytest.mark.parametrize(
    "floor",
    [
        pytest.param(PLANE, id="a plane"),
        pytest.param('<geom type="box" size="9 9 1" pos="0 0 -1"/>', id="a box"),
        pytest.param(
            '<body><joint type="slide"/><geom type="box" size="9 9 1" pos="0 0 -1"/></body>',
            id="a belt that moves",
        ),
    ],
)
def test_a_floor_is_whatever_else_can_be_touched(tmp_path: Path, floor: str) -> None:
    need_engine("mujoco")
    check_floor(load(on_floor(tmp_path, floor)))


def test_what_falls_with_a_robot_is_no_floor(tmp_path: Path) -> None:
    need_engine("mujoco")
    box = '<body pos="9 0 1"><freejoint/><geom type="box" size="1 1 1"/></body>'
    with pytest.raises(BadInputError, match="no floor"):
        check_floor(load(on_floor(tmp_path, box)))


def test_a_floor_is_what_a_pair_of_contacts_names(tmp_path: Path) -> None:
    need_engine("mujoco")
    file = on_floor(tmp_path, PLANE.replace("/>", ' contype="0" conaffinity="0"/>'))
    with pytest.raises(BadInputError, match="no floor"):
        check_floor(load(file))
    pair = '<contact><pair geom1="floor" geom2="body"/></contact><actuator>'
    text = file.read_text().replace('<geom type="box"', '<geom name="body" type="box"', 1)
    file.write_text(text.replace("<actuator>", pair))
    check_floor(load(file))


def on_floor(folder: Path, floor: str) -> Path:
    """Write the small robot with something else in place of its floor, and return its file."""
    file = robot(folder)
    text = file.read_text()
    assert PLANE in text
    return written(file, text.replace(PLANE, floor))


@pytest.mark.parametrize("asked", ["answer", "diagnose"])
def test_nothing_is_run_without_a_floor(tmp_path: Path, asked: str) -> None:
    need_engine("mujoco")
    from statemachine.lab.policy.diagnosis import diagnose

    file = on_floor(tmp_path, "")
    network = constant_network(tmp_path, [0.0, 0.0])
    request = PolicyRequest(network, contract_file(tmp_path, content()), file)
    with pytest.raises(BadInputError, match="no floor"):
        {"answer": answer, "diagnose": diagnose}[asked](request)


# -- which engines ----------------------------------------------------------------


class Notes(QuietReporter):
    """A reporter that keeps its notes."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        """Keep a note."""
        self.notes.append(text)


def test_of_all_engines_one_that_is_missing_is_noted_once_and_left_out(tmp_path: Path) -> None:
    need_engine("mujoco")
    reporter = Notes()

    def load_on_mujoco(backend: BackendChoice, model: AnyPath, menagerie: AnyPath | None) -> Model:
        if str(backend) != "mujoco":
            raise MissingEngineError("it is not installed here")
        return load(model)

    def name_of(_model: Model, backend: str, _progress: Progress) -> str:
        return backend

    results = on_each_backend(
        ("all",), "", robot(tmp_path), None, name_of, reporter, load_on_mujoco
    )
    assert results == {"mujoco": "mujoco"}
    assert reporter.notes == ["left out: it is not installed here"]
