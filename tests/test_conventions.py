"""What the engines take for granted: the known facts, and probes that can answer otherwise."""

from __future__ import annotations

import dataclasses
import math
import re
import tempfile
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from rich.cells import cell_len

from statemachine import engines
from statemachine.cli import main
from statemachine.engines import raw_engine_of, samples
from statemachine.engines.measured import AfterNan
from statemachine.engines.mujoco import pile as mujoco_pile
from statemachine.engines.samples import TREE
from statemachine.errors import MissingEngineError, UnknownNameError
from statemachine.installed import ENGINES, available, require
from statemachine.lab.probes.calls import record
from statemachine.lab.probes.conventions import (
    CONCEPTS,
    QUESTIONS,
    ask,
    probe,
    run_phrases,
)
from statemachine.lab.probes.conventions import page as report
from statemachine.lab.probes.conventions.answers import (
    NO_ANSWER,
    UNDECIDED,
    BestHypothesis,
    closest,
)
from statemachine.lab.probes.conventions.frames import FIXED, ORDERS

from .support.backends import BOTH, bullet_clients
from .support.claims import assert_has, assert_in, assert_not_in, refused
from .support.files import written
from .support.patches import Patch, around, followed_by
from .support.processes import Cli, in_its_own_python, of_python
from .support.requirements import ROOT, need_engine

DEPTH, ALPHABET = "depth first, children as listed", "depth first, children by alphabet"
ASKED = (*BOTH, "pinocchio")  # the engines of the facts below
# What each engine answers, by part of the question; measured by others and by hand before.
FACTS = {
    "quaternion": {
        "mujoco": {"": "wxyz"},
        "pybullet": {"": "xyzw"},
        "pinocchio": {"": "xyzw"},
        "motrix": {"": "xyzw"},
    },
    "velocity": {
        "mujoco": {
            "position": "body origin",
            "order": "linear first",
            "linear": "world axes, body origin",
            "angular": "body axes",
        },
        "pybullet": {
            "position": "centre of mass",
            "order": "linear first",
            "linear": "world axes, centre of mass",
            "angular": "world axes",
        },
        "pinocchio": {
            "position": "body origin",
            "order": "linear first",
            "linear": "body axes, body origin",
            "angular": "body axes",
        },
        "motrix": {
            "position": "body origin",
            "order": "linear first",
            "linear": "world axes, body origin",
            "angular": "body axes",
        },
    },
    "gravity": {
        "mujoco": {"": "0 0 -9.81"},
        "pybullet": {"": "0 0 0"},
        "pinocchio": {"": "0 0 -9.81"},
        "motrix": {"": "0 0 -9.81"},
    },
    "timestep": {
        "mujoco": {"one step": "2 ms", "clock": "data.time"},
        "pybullet": {"one step": f"{1e3 / 240:.4g} ms", "clock": "none"},
        "pinocchio": {"one step": NO_ANSWER},
        "motrix": {"one step": "2 ms", "clock": "none"},
    },
    "actuation": {
        "mujoco": {"no actuator": "falls", "a position actuator": "held"},
        "pybullet": {"as loaded": "held", "motor off": "falls"},
        "pinocchio": {"aba at zero torque": "falls"},
        "motrix": {"no actuator": "falls", "a position actuator": "held"},
    },
    "command": {
        "mujoco": {"ctrl": "stays"},
        "pybullet": {"TORQUE_CONTROL": "lasts one step", "VELOCITY_CONTROL": "stays"},
        "pinocchio": {"": NO_ANSWER},
        "motrix": {"actuator_ctrls": "stays"},
    },
    "damping": {
        "mujoco": {"a body at 1 m/s": "keeps it", "a joint at 200 rad/s": "keeps it"},
        "pybullet": {
            "a body at 1 m/s": "loses 7.5 % in 1 s",
            "a joint at 200 rad/s": "cut to 100 rad/s",
        },
        "pinocchio": {"": NO_ANSWER},
        "motrix": {"a body at 1 m/s": "keeps it", "a joint at 200 rad/s": "keeps it"},
    },
    "fresh": {
        "mujoco": {"the tip": "not computed", "the contact": "not computed"},
        "pybullet": {"the tip": "computed", "the contact": "not computed"},
        "pinocchio": {"the tip": "not computed"},
        "motrix": {"the tip": "computed"},
    },
    "write": {
        "mujoco": {"the tip": "stale", "the contact": "stale"},
        "pybullet": {"the tip": "fresh", "the contact": "stale"},
        "pinocchio": {"the tip": "stale", "the tip, after forwardKinematics": "stale"},
        "motrix": {"the tip": "stale"},
    },
    "step": {
        "mujoco": {"the tip": "stale", "the contact": "stale"},
        "pybullet": {"the tip": "stale", "the contact": "stale"},
        "pinocchio": {"": NO_ANSWER},
        "motrix": {"the tip": "stale"},
    },
    "joints": {
        "mujoco": {
            "URDF": DEPTH,
            "fixed joint, URDF": "none",
            "MJCF": DEPTH,
            "fixed joint, MJCF": "none",
        },
        "pybullet": {"URDF": DEPTH, "fixed joint, URDF": "takes a number"},
        "pinocchio": {
            "URDF": ALPHABET,
            "fixed joint, URDF": "none",
            "MJCF": DEPTH,
            "fixed joint, MJCF": "none",
        },
        "motrix": {"MJCF": DEPTH, "fixed joint, MJCF": "none"},
    },
    "reset": {
        "mujoco": {"mj_resetData": "keeps gravity, timestep, bodies"},
        "pybullet": {
            "resetSimulation": "keeps timestep",
            "resetBase…, resetJointState": (
                "keeps motor target, applied force, gravity, timestep, bodies"
            ),
        },
        "pinocchio": {"": NO_ANSWER},
        "motrix": {"SceneData.reset": "keeps gravity override, gravity, timestep, bodies"},
    },
    "friction": {
        "mujoco": {"equal priority": "the larger", "the block has priority": "the block's"},
        "pybullet": {"": "their product"},
        "pinocchio": {"": NO_ANSWER},
        "motrix": {"": "the larger"},
    },
    "save": {
        "mujoco": {
            "qpos and qvel copied": (
                "forgets time, ctrl, applied forces, warm start, gravity, timestep"
            ),
            "mjSTATE_FULLPHYSICS": "forgets ctrl, applied forces, warm start, gravity, timestep",
            "mjSTATE_INTEGRATION": "forgets gravity, timestep",
        },
        "pybullet": dict.fromkeys(
            (
                "positions, velocities written",
                "saveState, restoreState",
                "saveBullet, restoreState",
            ),
            "forgets motor target, applied force, gravity, timestep",
        ),
        "pinocchio": {"": NO_ANSWER},
        "motrix": dict.fromkeys(
            ("dof_pos and dof_vel copied", "reset to copies of them"),
            "forgets actuator_ctrls, gravity override, gravity, timestep",
        ),
    },
    "future": {
        "mujoco": {
            "mj_resetData": "exact",
            "qpos and qvel copied": "differs",
            "mjSTATE_FULLPHYSICS": "differs",
            "mjSTATE_INTEGRATION": "exact",
        },
        "pybullet": {
            "resetSimulation": "exact",
            "resetBase…, resetJointState": "differs",
            "positions, velocities written": "differs",
            "saveState, restoreState": "differs",
            "saveBullet, restoreState": "differs",
        },
        "pinocchio": {"a used Data, a new one": "exact"},
        "motrix": {
            "SceneData.reset": "exact",
            "dof_pos and dof_vel copied": "differs",
            "reset to copies of them": "differs",
        },
    },
    "invalid": {
        "mujoco": {"autoreset": "starts again", 'autoreset="disable"': "NaN stays"},
        "pybullet": {"": "NaN stays"},
        "pinocchio": {"integrate": "NaN stays"},
        "motrix": {"": "NaN stays"},
    },
}


def answers(question: str, engine: str) -> dict[str, str]:
    return {finding.of: finding.answer for finding in ask(question, engine) or ()}


def figures(question: str, engine: str, of: str = "") -> dict[str, Any]:
    finding = next(each for each in ask(question, engine) or () if each.of == of)
    return {figure.name: figure.value for figure in finding.figures}


@pytest.fixture(params=ASKED)
def engine(request: pytest.FixtureRequest) -> str:
    need_engine(request.param)
    return request.param


def mujoco() -> Any:
    return require("mujoco")


def pybullet() -> Any:
    return require("pybullet")


# The facts.


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_engines_are_as_they_were(question: str, engine: str) -> None:
    """When this fails, an engine has changed: look at the README and at our backends."""
    assert answers(question, engine) == FACTS[question][engine]


def test_every_question_has_facts() -> None:
    assert list(FACTS) == list(QUESTIONS)


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    ("question", "engine_name", "of", "expected", "rel"),
    [
        # A tip at 0.8 m and 0.4 rad is a chord away from where it was.
        ("write", "mujoco", "the tip", 0.8 * 2 * 0.198669331, 1e-6),
        # It lags by its way in one step: speed · timestep.
        ("step", "mujoco", "the contact", 3 * 0.002, 1e-6),
        ("step", "mujoco", "the tip", 0.8 * 3 * 0.002, 0.02),
        ("step", "pybullet", "the tip", 0.8 * 3 / 240, 0.02),
    ],
)
def test_what_is_stale_is_off_by_a_closed_form(
    question: str, engine_name: str, of: str, expected: float, rel: float
) -> None:
    """Not what the engines gave before: what they must give."""
    assert figures(question, engine_name, of)["off by"] == pytest.approx(expected, rel)


@pytest.mark.usefixtures("bullet")
def test_pybullet_s_own_motor_holds_the_weight_of_the_pendulum() -> None:
    held = figures("actuation", "pybullet", "as loaded")
    assert held["moves"] == pytest.approx(0, abs=1e-6)
    assert -held["its motor exerts"] == pytest.approx(9.81 * 0.5)


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    ("words", "coefficient"),
    [(("pybullet",), 0.25 * 0.75), (("mujoco", "equal priority"), 0.75)],
    ids=["their product", "the larger"],
)
def test_two_coefficients_of_friction_act_as_one(
    words: tuple[str, ...], coefficient: float
) -> None:
    slopes = figures("friction", *words)
    assert slopes == pytest.approx(dict.fromkeys(slopes, coefficient), rel=0.05)


@pytest.mark.slow
def test_a_second_look_sees_the_same() -> None:
    """Bit by bit: nothing is random, and no probe leaves a trace in the next."""
    engines_here = available()[0]
    assert probe(engines_here) == probe(engines_here)


@pytest.mark.parametrize("seconds", [0.1, 0.25, 0.4])
def test_the_limp_pendulum_keeps_its_energy(seconds: float) -> None:
    """Half I ω² is what gravity gave; ω by a difference of two angles."""
    h = 1e-4
    rate = (samples.limp(seconds + h) - samples.limp(seconds - h)) / (2 * h)
    fallen = -samples.tip_at(samples.limp(seconds))[2] / samples.TIP
    assert rate**2 == pytest.approx(2 * samples.RATE * fallen, rel=1e-5)


def test_no_two_orders_of_the_joints_are_the_same() -> None:
    moving = [[name for name in order if name != FIXED] for order in ORDERS.values()]
    assert len({tuple(order) for order in moving}) == len(ORDERS)
    assert all(sorted(order) == sorted(moving[0]) for order in moving)


def test_the_closest_hypothesis_comes_with_the_next() -> None:
    assert closest({"a": 0.1, "b": 1.0, "c": 2.0}) == BestHypothesis("a", 0.1, 1.0)


@pytest.mark.parametrize(("a", "b"), [(0.9, 1.0), (0.0, 0.0)])
def test_what_nothing_or_all_explains_is_undecided(a: float, b: float) -> None:
    assert closest({"a": a, "b": b}).hypothesis == UNDECIDED


@pytest.mark.parametrize(
    ("read", "recomputed", "expected"),
    [(1.0, 1.0, "computed"), (0.0, 1.0, "not computed"), (0.0, 0.0, UNDECIDED)],
)
def test_what_is_fresh_follows_from_what_is_read(
    read: float, recomputed: float, expected: str
) -> None:
    (answer,) = QUESTIONS["fresh"].answer([("the tip", read, recomputed, 1.0)])
    assert answer.answer == expected


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(math.nan, "NaN stays"), (0.004, "starts again"), (0.4, "NaN is not written")],
)
def test_what_a_nan_does_follows_from_the_angle(angle: float, expected: str) -> None:
    (answer,) = QUESTIONS["invalid"].answer([AfterNan("", angle, "")])
    assert answer.answer == expected


@pytest.mark.parametrize("part", ["autoreset", 'autoreset="disable"'])
def test_mujoco_warns_of_a_nan(part: str) -> None:
    assert figures("invalid", "mujoco", part)["it says"] == "warning"


# An engine that behaved otherwise would get another answer.


@around(pybullet, "getBasePositionAndOrientation")
def reads_wxyz(right: Any, body: int, client: int) -> Any:
    pos, (x, y, z, w) = right(body, client)
    return pos, (w, x, y, z)


@around(pybullet, "resetBasePositionAndOrientation")
def writes_wxyz(right: Any, body: int, pos: Any, quat: Any, client: int) -> None:
    right(body, pos, (*quat[1:], quat[0]), client)


@around(pybullet, "resetBaseVelocity")
def angular_first(right: Any, body: int, linear: Any, angular: Any, client: int) -> None:
    right(body, angular, linear, client)


@around(pybullet, "connect")
def prepared_world(right: Any, mode: int) -> int:
    client = right(mode)
    pybullet().setGravity(0, -1.5, -3, client)
    pybullet().setTimeStep(0.01, client)
    return client


_commands: list[Any] = []


@around(pybullet, "setJointMotorControl2")
def remembers_the_command(right: Any, *words: Any, **named: Any) -> None:
    _commands[:] = [lambda: right(*words, **named)]
    right(*words, **named)


@around(pybullet, "stepSimulation")
def repeats_the_command(right: Any, client: int) -> None:
    right(client)
    for command in _commands:
        command()


@around(pybullet, "loadURDF")
def undamped(right: Any, *words: Any, physicsClientId: int, **named: Any) -> int:  # noqa: N803
    body = right(*words, physicsClientId=physicsClientId, **named)
    for link in range(-1, pybullet().getNumJoints(body, physicsClientId)):
        pybullet().changeDynamics(
            body, link, linearDamping=0, maxJointVelocity=1e3, physicsClientId=physicsClientId
        )
    return body


@around(pybullet, "loadURDF")
def without_a_motor(right: Any, *words: Any, physicsClientId: int, **named: Any) -> int:  # noqa: N803
    body, pb = right(*words, physicsClientId=physicsClientId, **named), pybullet()
    pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=physicsClientId)
    return body


@around(pybullet, "stepSimulation")
def recomputing_step_of_pybullet(right: Any, client: int) -> None:
    right(client)
    for body in range(pybullet().getNumBodies(client)):
        for link in range(pybullet().getNumJoints(body, client)):
            pybullet().getLinkState(body, link, computeForwardKinematics=1, physicsClientId=client)


NAMES = sorted(name for name, _, _ in TREE)


@around(pybullet, "getJointInfo")
def joints_by_alphabet(right: Any, body: int, k: int, client: int) -> Any:
    return (k, NAMES[k].encode(), *right(body, k, client)[2:])


@around(pybullet, "changeDynamics")
def rooted_friction(right: Any, *of: Any, lateralFriction: float, **more: Any) -> None:  # noqa: N803
    """Return the product of two roots, which is the geometric mean."""
    right(*of, lateralFriction=lateralFriction**0.5, **more)


@around(mujoco, "mj_resetData")
def reset_keeps_time(right: Any, model: Any, data: Any) -> None:
    time = data.time
    right(model, data)
    data.time = time


recomputing_step = followed_by(mujoco, "mj_step", lambda *of: mujoco().mj_forward(*of[:2]))
cold_restore = followed_by(
    mujoco, "mj_setState", lambda _, data, *state: data.qacc_warmstart.fill(0)
)


def no_warm_start(monkeypatch: pytest.MonkeyPatch) -> None:
    flag = '<option><flag warmstart="disable"/></option><worldbody>'
    text = mujoco_pile.PILE_MJCF.replace("<worldbody>", flag)
    monkeypatch.setattr(mujoco_pile, "PILE_MJCF", text)


@around(pybullet, "restoreState")
def file_restores_nothing(right: Any, *state: int, fileName: str = "", **more: Any) -> Any:  # noqa: N803
    return None if fileName else right(*state, **more)


# The faults, and what is then answered of which engine instead of the facts.
OTHERWISE: dict[str, tuple[tuple[Patch, ...], str, str, dict[str, str]]] = {
    "quaternions read in another order": (
        (reads_wxyz,), "quaternion", "pybullet", {"": "xyzw written, wxyz read"}
    ),
    "quaternions in another order": (
        (reads_wxyz, writes_wxyz), "quaternion", "pybullet", {"": "wxyz"}
    ),
    "velocities in another order": (
        (angular_first,), "velocity", "pybullet", {"order": "angular first"}
    ),
    "a fresh world with gravity": ((prepared_world,), "gravity", "pybullet", {"": "0 -1.5 -3"}),
    "a fresh world with another timestep": (
        (prepared_world,), "timestep", "pybullet", {"one step": "10 ms"}
    ),
    "a command that is kept": (
        (remembers_the_command, repeats_the_command),
        "command", "pybullet", {"TORQUE_CONTROL": "stays"},
    ),
    "a body that is not damped": (
        (undamped,), "damping", "pybullet",
        {"a body at 1 m/s": "keeps it", "a joint at 200 rad/s": "cut to 200 rad/s"},
    ),
    "joints without a motor": ((without_a_motor,), "actuation", "pybullet", {"as loaded": "falls"}),
    "a step that recomputes": (
        (recomputing_step,), "step", "mujoco", {"the tip": "fresh", "the contact": "fresh"}
    ),
    "a step of PyBullet that recomputes": (
        (recomputing_step_of_pybullet,), "step", "pybullet", {"the tip": "fresh"}
    ),
    # Both readings are alike then, and both are wrong: that is not called fresh.
    "a recomputation that does nothing": (
        (around(mujoco, "mj_forward")(lambda _right, _model, _data: None),),
        "write", "mujoco", {"the tip": UNDECIDED, "the contact": UNDECIDED},
    ),
    "joints by alphabet": ((joints_by_alphabet,), "joints", "pybullet", {"URDF": "by alphabet"}),
    "joints in no order": (
        (around(pybullet, "getJointInfo")(lambda _right, _b, k, _c: (k, NAMES[k - 1].encode())),),
        "joints", "pybullet", {"URDF": UNDECIDED},
    ),
    "another rule of friction": (
        (rooted_friction,), "friction", "pybullet", {"": "their geometric mean"}
    ),
    "a reset that keeps other things": (
        (reset_keeps_time,),
        "reset", "mujoco", {"mj_resetData": "keeps time, gravity, timestep, bodies"},
    ),
    "a restore that loses the warm start": (
        (cold_restore,),
        "save", "mujoco", {"mjSTATE_INTEGRATION": "forgets warm start, gravity, timestep"},
    ),
    "a future without the warm start": (
        (cold_restore,), "future", "mujoco", {"mjSTATE_INTEGRATION": "differs"}
    ),
    # Then positions and velocities are all that there is.
    "no warm start at all": (
        (no_warm_start,), "future", "mujoco",
        dict.fromkeys(("qpos and qvel copied", "mjSTATE_FULLPHYSICS"), "exact"),
    ),
    "a file that restores nothing": (
        (file_restores_nothing,), "save", "pybullet",
        {"saveBullet, restoreState": (
            "forgets joint position, joint velocity, base position, base velocity, motor target, "
            "gravity, timestep"
        )},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERWISE)
def test_an_engine_that_behaved_otherwise(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patches, question, engine, changed = OTHERWISE[name]
    need_engine(engine)
    for patch in patches:
        patch(monkeypatch)
    assert answers(question, engine) == FACTS[question][engine] | changed


# What is left behind.


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
def test_no_world_and_no_file_stays(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    # Worlds of other tests may still wait for the garbage collector.
    before = bullet_clients()
    probe(["pybullet"])
    run_phrases(["pybullet"])

    monkeypatch.setattr(pybullet(), "stepSimulation", Mock(side_effect=RuntimeError("as seeded")))
    refused(
        *(
            (RuntimeError, "as seeded", partial(ask, question, "pybullet"))
            for question in ("gravity", "future", "save")
        )
    )
    found = {call.concept: call for call in run_phrases(["pybullet"]).engines["pybullet"]}
    assert found["state"].works
    assert found["step"].fault == "RuntimeError: as seeded"
    assert bullet_clients() <= before
    assert not list(tmp_path.iterdir())


# The calls.


def test_every_call_works(engine: str) -> None:
    table = run_phrases([engine]).engines[engine]
    assert [(call.concept, call.works) for call in table] == [(name, True) for name in CONCEPTS]


def test_the_cells_of_an_engine_are_a_program(engine: str, tmp_path: Path) -> None:
    """As a reader would type them, with nothing of ours."""
    own = raw_engine_of(engine).phrases()
    file = written(tmp_path / own.file[0], own.file[1])
    lines = [f"file = {str(file)!r}", *(own.cells[name].code for name in CONCEPTS)]
    lines.append("print(len(worlds))")
    done = of_python("-c", "\n".join(lines), folder=tmp_path, code=0)
    assert done.stdout.splitlines()[-1] == "3"


@pytest.mark.parametrize("concept", CONCEPTS[1:])
def test_a_cell_that_does_nothing_is_found_out(
    engine: str, concept: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cells: Any = raw_engine_of(engine).phrases().cells
    monkeypatch.setitem(cells, concept, dataclasses.replace(cells[concept], code="pass"))
    table = run_phrases([engine])
    assert concept in [call.concept for call in table.engines[engine] if not call.works]
    assert not report.calls_page(table).holds


# The command.


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("--calls",)])
def test_the_page_reads_well_piped(cli: Cli, arguments: tuple[str, ...]) -> None:
    for name in ASKED:
        need_engine(name)
    done = cli("conventions", *arguments, code=0)
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert max(map(cell_len, lines)) <= 80
    assert all(line == line.rstrip() for line in lines)
    assert_not_in(done.stdout, "\x1b", "✗", UNDECIDED)
    assert_in(done.stdout, *ASKED)


@pytest.mark.parametrize("more", [(), ("--calls",)])
def test_a_missing_engine_is_left_out(cli: Cli, without: Any, more: tuple[str, ...]) -> None:
    done = cli("conventions", *more, code=0, **without("pybullet", "pinocchio"))
    missing = re.findall(r"left out: (\w+)", done.stderr)
    assert [name for name in missing if name in ASKED] == ["pybullet", "pinocchio"]
    assert "mujoco 4" in done.stdout
    assert not any(line.startswith(("pybullet", "pinocchio")) for line in done.stdout.splitlines())


def test_all_engines_are_missing(cli: Cli, without: Any) -> None:
    modules = {engine.module for engine in ENGINES.values()}
    done = cli("conventions", **without(*modules), code=3)
    assert (done.stdout, done.stderr.count("\n")) == ("", len(ENGINES)), done.stderr


def test_a_call_that_fails_is_the_exit_code() -> None:
    done = in_its_own_python(
        "import mujoco, sys\nfrom statemachine.cli import main\n"
        "mujoco.mj_forward = lambda m, d: None\n"
        "sys.exit(main(('conventions', '--calls', '--backend', 'mujoco')))",
        ROOT,
    )
    assert (done.returncode, done.stderr) == (1, "")
    assert "mujoco, recompute" in re.findall(r"✗ (\w+, \w+):", done.stdout)


# An engine that has no room, or less in it.


def test_a_room_of_another_package_may_have_some_of_the_methods(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "their_room.py").write_text(
        "from statemachine.engines import RawEngine\n"
        "from statemachine.engines.measured import Cell, Phrases\n"
        "class Theirs(RawEngine):\n"
        "    def measurement(self, question):\n"
        "        gravity = lambda steps: ((0, 0, -steps), (0, 0, -1))\n"
        "        return gravity if question == 'gravity' else None\n"
        "    def phrases(self):\n"
        "        load = Cell('a = int(open(file).read())', lambda n: n.a == 7)\n"
        "        return Phrases(('a.txt', '7'), {'load': load})\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(engines, "ROOMS", dict(engines.ROOMS))
    engines.register("theirs", "their_room:Theirs")
    assert answers("gravity", "theirs") == {"": "told 0 0 -50, felt 0 0 -1"}
    assert ask("timestep", "theirs") is None
    (phrase,) = run_phrases(["theirs"]).engines["theirs"]
    assert_has(phrase, concept="load", works=True, fault="")
    refused((UnknownNameError, "calls can be recorded", lambda: record("", "theirs")))


def test_a_room_that_cannot_be_imported_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(engines, "ROOMS", dict(engines.ROOMS))
    engines.register("broken", "no_such_package")
    assert "broken" not in engines.raw_engines_with("measurement")
    refused(
        (MissingEngineError, "room of 'broken' cannot be loaded", lambda: ask("gravity", "broken"))
    )
    assert main(("conventions", "gravity")) == 0
    out, err = capsys.readouterr()
    assert "room of 'broken'" in err
    assert "broken" not in out


def test_a_question_that_there_is_not_is_refused_before_any_is_asked() -> None:
    asked: list[float] = []
    known = next(iter(QUESTIONS))
    refused(
        (UnknownNameError, "nosuch", lambda: probe(["mujoco"], [known, "nosuch"], asked.append))
    )
    assert asked == []
