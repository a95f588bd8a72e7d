"""The audit: what is known of the engines' state, and faults that it must find."""

from __future__ import annotations

import math
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.cells import cell_len

import statemachine as sm
from statemachine.backends import mujoco_backend
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.cli import main
from statemachine.engines.measured import FutureGap, gap
from statemachine.engines.mujoco.audit import MujocoDriver
from statemachine.errors import BadInputError, EngineError, EngineWarning
from statemachine.installed import require
from statemachine.interface import JointType
from statemachine.measures import JointPlaces
from statemachine.page import Figures, Items, Page, Table
from statemachine.probes import audit
from statemachine.probes.audit import conclude, drivers_of, trials
from statemachine.probes.audit.interface_driver import points, run_elsewhere
from statemachine.report import audit as report

from .conftest import (
    Patch,
    around,
    assert_has,
    assert_in,
    blocks,
    bullet_clients,
    followed_by,
    need_engine,
    refused,
    registered,
    shown,
    with_figures,
)
from .small_models import loaded, model_of

SCENE = "so101/scene_box"


# Gaps, against closed forms.

HINGE = JointPlaces.of([JointType.HINGE], [0])
FREE = JointPlaces.of([JointType.FREE], [0])


def test_what_is_compared_are_bytes() -> None:
    zero = np.zeros((4, 2))
    other = zero.copy()
    assert gap(zero, other, HINGE).exact
    other[2, 1] = -0.0
    assert gap(zero, other, HINGE) == FutureGap(3, 2, 0.0, 0.0)
    other[2, 1] = 5e-324  # the last bit
    assert gap(zero, other, HINGE).first == 2
    lost = np.full((4, 2), math.nan)
    assert gap(lost, lost, HINGE).exact
    assert gap(zero, lost, HINGE).angle == math.inf


def test_the_first_row_is_before_any_step() -> None:
    one, other = np.zeros((3, 2)), np.ones((3, 2))
    assert gap(one, other, HINGE).first == 0
    assert gap(one, other, HINGE, np.array([0, 7, 8])) == FutureGap(8, 0, 1.0, 0.0)
    other[0] = 0
    assert gap(one, other, HINGE, np.array([0, 7, 8])).first == 7


@pytest.mark.parametrize("angle", [1e-9, 0.3, 3.0])
def test_quaternions_are_apart_by_their_angle(angle: float) -> None:
    one = np.array([[0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]])
    other = one.copy()
    other[0, 3:] = math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0
    assert gap(one, other, FREE).angle == pytest.approx(angle, rel=1e-6)
    other[0, 3:] *= -1
    assert_has(gap(one, other, FREE), angle=pytest.approx(angle, rel=1e-6), length=0)
    other = one.copy()
    other[0, 1] += 0.25
    assert gap(one, other, FREE).length == pytest.approx(0.25)


# What is known of the engines.


@pytest.fixture(scope="module")
def of_mujoco() -> Figures:
    return audit.run(sm.load(SCENE), steps=40)


@pytest.fixture(scope="module")
def of_pybullet() -> Figures:
    need_engine("pybullet")
    return audit.run(sm.load(SCENE, backend="pybullet"), steps=40)


@pytest.mark.slow
def test_mujoco_needs_its_warm_start_in_contact(of_mujoco: Figures) -> None:
    engine, interface = of_mujoco.audited
    found = engine.conclusion
    assert found.suffice == ("mjSTATE_INTEGRATION", "mj_copyData")
    assert interface.conclusion.suffice == ("get_state, set_state",)
    missing = {each.field: each for each in found.missing}
    assert set(missing) == {
        "time",
        "qpos",
        "qvel",
        "warmstart",
        "ctrl",
        "qfrc_applied",
        "xfrc_applied",
    }
    assert_has(found, smallest=True, idle=())
    assert missing["warmstart"].points == ("default", "keyframe", "limp", "limit", "clock")
    assert missing["warmstart"].gap.first == 1
    assert 0 < missing["warmstart"].gap.size < 1e-6
    # Only where a controller reads it.
    assert missing["time"].points == ("clock",)
    # What only others write into is there again, in the run itself.
    assert {name for name, each in missing.items() if each.itself} == {
        "time",
        "qpos",
        "qvel",
        "warmstart",
    }


def test_mujoco_is_tried_where_it_should_be(of_mujoco: Figures) -> None:
    seen = {each.point: each for each in of_mujoco.audited[0].points}
    assert seen["default"].speed < 1e-6
    assert seen["motion"].contacts == 0
    assert seen["motion"].speed > 1
    assert seen["keyframe"].contacts > 0
    assert seen["limp"].contacts > 0
    assert seen["limit"].limits
    assert_has(of_mujoco, without=(), holds=True)


@pytest.mark.slow
def test_pybullet_forgets_its_contacts(of_pybullet: Figures) -> None:
    engine, interface = of_pybullet.audited
    found = engine.conclusion
    assert found.suffice == ()
    # Of a held box even two restores of a saved world part.
    assert set(found.agree) == {"taken apart + targets"}
    assert set(found.in_contact) >= {"keyframe"}
    assert "motion" not in found.in_contact
    for way in ("written", "saveState", "saveBullet"):
        assert_in(found.forgotten[way], "motor targets", "a waiting force")
    assert any(
        each.gap.exact
        for each in engine.findings
        if (each.experiment, each.case) == (trials.RESTORE, "saveState + targets")
        and each.point == "motion"
    )
    assert [line.partition(":")[0] for line in of_pybullet.without] == ["limit"]
    assert interface.conclusion.suffice == ()
    assert "get_state, set_state" in interface.conclusion.agree
    assert of_pybullet.holds


COMMON = {"again", "look", "two at once", "restore", "threads", "process"}


@pytest.mark.slow
def test_a_call_that_is_harmless_here_moves_falling_boxes(of_pybullet: Figures) -> None:
    """By 0.6 mm to 13 cm, as was measured on the raw engine, where contacts come and go."""
    call, engine = "performCollisionDetection", of_pybullet.audited[0]
    found = [each for each in engine.findings if each.case == call]
    drops = [each for each in found if each.point.startswith(trials.FALL)]
    assert len(drops) == trials.DROPS < len(found)
    assert all(each.gap.exact for each in found if each not in drops)
    assert {each.promised for each in found} == {False}
    assert all(each.gap.steps == trials.STEPS for each in drops)
    assert 1e-3 < max(each.gap.length for each in drops) < 0.3
    # What only reads is asked in the same falls, and leaves no trace there either.
    for case in ("getContactPoints", "saveState"):
        asked = [e for e in engine.findings if e.case == case and e.point.startswith(trials.FALL)]
        assert len(asked) == trials.DROPS
        assert all(each.gap.exact for each in asked)
    off = max(each.gap.length for each in drops)
    tables = blocks(report.page({"x": of_pybullet}), Table)
    rows = [row for t in tables if t.headers[1] == "differs at" for row in t.rows]
    assert [(row[0], row[2]) for row in rows] == [(call, f"{1e3 * off:.0f} mm")]


def test_no_call_of_mujoco_moves_falling_boxes(of_mujoco: Figures) -> None:
    engine, interface = of_mujoco.audited
    drops = [each for each in engine.findings if each.point.startswith(trials.FALL)]
    assert {each.case for each in drops} >= {"mj_forward", "mj_inverse"}
    assert all(each.gap.exact for each in drops)
    assert not any(each.point.startswith(trials.FALL) for each in interface.findings)


def _experiments(one: Figures) -> set[str]:
    assert all(each.gap.steps > 0 for each in one.findings)
    return {each.experiment for each in one.findings}


@pytest.mark.parametrize(
    ("of", "more"),
    [
        ("of_mujoco", {"reset", "step(n)", "pools", "leave one out"}),
        pytest.param("of_pybullet", {"forgets", "contacts off"}, marks=pytest.mark.slow),
    ],
)
def test_everything_is_asked(of: str, more: set[str], request: pytest.FixtureRequest) -> None:
    engine, interface = request.getfixturevalue(of).audited
    assert _experiments(engine) == COMMON | more
    assert _experiments(interface) == COMMON | {"reset", "step(n)", "pickled State"}


MODELS = {
    "a box": '<freejoint/><geom type="box" size=".05 .06 .07"/>',
    "a ball joint": '<joint type="ball"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>',
    "a hinge": '<joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>',
}


@pytest.mark.parametrize("body", MODELS)
def test_any_model_has_save_points(body: str, tmp_path: Path) -> None:
    world = f'<geom type="plane" size="3 3 1"/><body pos="0 0 .5">{MODELS[body]}</body>'
    result = audit.run(loaded(tmp_path, world), steps=20)
    assert result.holds
    assert {each.point for each in result.audited[0].points} == {"default", "motion"}
    assert {line.partition(":")[0] for line in result.without} == {
        "keyframe",
        "limp",
        "limit",
        "clock",
    }
    assert "mjSTATE_INTEGRATION" in result.audited[0].conclusion.suffice
    assert result.audited[0].conclusion.smallest is True


@pytest.mark.slow
def test_components_of_other_models_are_tried(tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="m" mocap="true" pos="1 0 1"><geom size=".05"/></body>
        <body pos="0 0 1"><joint name="j" axis="0 1 0"/><geom size=".05" pos=".3 0 0"/></body>
        <body name="f" pos="0 -1 .5"><freejoint/><geom size=".05"/></body></worldbody>
        <equality><weld body1="f" body2="m"/></equality><actuator>
        <general joint="j" dyntype="filter" dynprm=".1" gainprm="5"/></actuator></mujoco>"""
    found = audit.run(model_of(tmp_path, text), steps=20).audited[0].conclusion
    assert {"act", "eq_active", "mocap_pos"} <= {each.field for each in found.missing}
    assert found.smallest is True


def test_what_cannot_be_audited_is_one_line(tmp_path: Path) -> None:
    refused(
        (BadInputError, "nothing moves", lambda: audit.run(loaded(tmp_path, '<geom size="1"/>'))),
        (
            EngineError,
            "a fresh process failed: ValueError",  # of a seed that is none
            lambda: run_elsewhere(sm.load(SCENE), -1, 10, {}, ()),
        ),
    )


@pytest.mark.slow
def test_where_a_run_diverges_it_is_not_saved(tmp_path: Path) -> None:
    with pytest.warns(EngineWarning, match="stiffness of joint j is negative"):
        model = loaded(
            tmp_path,
            """<body><joint name="j" axis="0 1 0" stiffness="-3e4" damping="10"/>
            <geom size=".1" pos=".3 0 0"/></body>""",
            '<actuator><position joint="j" kp="9e4" ctrlrange="-1 1"/></actuator>',
        )
    with warnings.catch_warnings(action="error"):  # nothing is said of it but that
        result = audit.run(model, steps=20)
    assert result.holds
    assert {each.point for each in result.audited[0].points} == {"default", "motion", "clock"}
    assert "limp: the run diverges" in result.without


@pytest.mark.slow
def test_a_backend_without_a_driver_is_audited_through_the_interface() -> None:
    with registered("hidden", "tests.hidden_world:load") as name:
        result = audit.run(sm.load(SCENE, backend=name), steps=10)
    assert [each.layer for each in result.audited] == ["interface"]
    assert result.holds
    assert report.page({name: result}).holds


# Faults. Each is put into an engine or a backend, and one question must notice it.

QUESTIONS = {
    "again": trials.again,
    "reset": trials.after_reset,
    "step(n)": trials.pieces,
    "look": trials.look,
    "two at once": trials.beside,
    "restore": trials.restored,
    "threads": lambda driver, run: trials.threads(driver, (run,)),
    "pools": trials.pools,
}


def asked(
    question: str, backend: str = "mujoco", only: Iterable[str] = ("keyframe", "limp")
) -> list[Figures]:
    """What a question finds of an engine and of the interface to it, in few steps."""
    model = sm.load(SCENE, backend=backend)
    places = [point for point in points(model, 0)[0] if point.name in only]
    return [
        finding
        for driver in drivers_of(model, 0)
        for point in places
        for finding in QUESTIONS[question](driver, driver.run(point, 30))
    ]


def broken(findings: Iterable[Figures]) -> set[tuple[str, str]]:
    """Layer and case of all that is promised and does not hold."""
    return {(each.layer, each.case) for each in findings if not each.holds}


def nudge(data: Any, *_: Any) -> None:
    """The smallest change there is, of one velocity."""
    raw = data.raw if isinstance(data, sm.Data) else data
    raw.qvel[0] = np.nextafter(raw.qvel[0], 10.0)


def forget_warm_start(data: MujocoData, *_: Any) -> None:
    data.raw.qacc_warmstart[:] = 0


def leave_a_force(data: MujocoData, *_: Any) -> None:
    data.raw.qfrc_applied[1] = 1e-9


@around(MujocoDriver, "advance")
def bulk_of_the_engine_is_one_short(
    right: Any, self: MujocoDriver, machine: Any, nstep: int = 1
) -> None:
    right(self, machine, max(1, nstep - 1))


@around(mujoco_backend, "_transition")
def bulk_is_one_long(right: Any, model: Any, raw: Any) -> Callable[..., None]:
    step = right(model, raw)
    return lambda model, raw, nstep=1: step(model, raw, nstep + (nstep > 1))


_hidden = np.random.default_rng()


@around(MujocoDriver, "advance")
def noise(right: Any, self: MujocoDriver, machine: Any, nstep: int = 1) -> None:
    """Something decides the future that is nobody's state."""
    machine.qvel[0] += 1e-12 * _hidden.random()
    right(self, machine, nstep)


_last: list[Any] = [None]


@around(mujoco_backend, "_transition")
def one_disturbs_the_other(right: Any, model: Any, raw: Any) -> Callable[..., None]:
    """Whoever is stepped after another one feels it."""
    step = right(model, raw)

    def stepped(*args: Any) -> None:
        if _last[0] is not raw and raw.time > 0.21:  # neither is on its way to the start
            nudge(raw)
        _last[0] = raw
        step(*args)

    return stepped


@around(MujocoDriver, "advance")
def another_thread_feels_it(right: Any, self: MujocoDriver, machine: Any, nstep: int = 1) -> None:
    if threading.current_thread() is not threading.main_thread():
        nudge(machine)
    right(self, machine, nstep)


@around(MujocoDriver, "_batch")
def pool_of_the_engine_is_cold(right: Any, *of: Any) -> list[Any]:
    return [future + 1e-15 for future in right(*of)]


@around(lambda: require("pybullet"), "getContactPoints")
def read_of_pybullet_perturbs(right: Any, *, physicsClientId: int, **named: Any) -> Any:  # noqa: N803
    require("pybullet").setGravity(0, 0, -9.80000001, physicsClientId)
    return right(physicsClientId=physicsClientId, **named)


STATE = "get_state, set_state"
FAULTS: dict[str, tuple[str, Patch, tuple[str, str]]] = {
    "a restore forgets the warm start": (
        "restore",
        followed_by(MujocoData, "_set_state", forget_warm_start),
        ("interface", STATE),
    ),
    "a restore leaves a force": (
        "restore",
        followed_by(MujocoData, "_set_state", leave_a_force),
        ("interface", STATE),
    ),
    "a save perturbs": (
        "look",
        followed_by(MujocoData, "_get_state", nudge),
        ("interface", "get_state"),
    ),
    "forward perturbs": (
        "look",
        followed_by(MujocoData, "_recompute", nudge),
        ("interface", "forward"),
    ),
    "forward of the engine perturbs": (
        "look",
        followed_by(lambda: require("mujoco"), "mj_forward", lambda _, data: nudge(data)),
        ("engine", "mj_forward"),
    ),
    "forward takes a step": (
        "look",
        followed_by(MujocoData, "_recompute", lambda d: d._advance(d._raw_model, d._raw)),
        ("interface", "forward"),
    ),
    "a read perturbs": (
        "look",
        followed_by(MujocoData, "_derive", lambda data, _: nudge(data)),
        ("interface", "reading what is derived"),
    ),
    "a read of PyBullet perturbs": (
        "look",
        read_of_pybullet_perturbs,
        ("engine", "getContactPoints"),
    ),
    "several steps are one too many": ("step(n)", bulk_is_one_long, ("interface", "step(n)")),
    "several steps of the engine are one too few": (
        "step(n)",
        bulk_of_the_engine_is_one_short,
        ("engine", "step(n)"),
    ),
    "reset leaves a force": (
        "reset",
        followed_by(MujocoData, "_reset", leave_a_force),
        ("interface", "a used one, reset"),
    ),
    "the engine is not deterministic": ("again", noise, ("engine", "in a new one")),
    "one Data disturbs another": (
        "two at once",
        one_disturbs_the_other,
        ("interface", "turn by turn with another"),
    ),
    "a thread computes otherwise": (
        "threads",
        another_thread_feels_it,
        ("engine", "a pool of 4 threads"),
    ),
    "a pool of the engine computes otherwise": (
        "pools",
        pool_of_the_engine_is_cold,
        ("engine", "mujoco.batch, 2 threads"),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    question, apply, finder = FAULTS[fault]
    backend = "pybullet" if "PyBullet" in fault else "mujoco"
    need_engine(backend)
    apply(monkeypatch)
    assert finder in broken(asked(question, backend))


def test_an_engine_whose_restore_drops_the_warm_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the engine itself it is a fact; of the interface on it, a broken promise."""
    mujoco = require("mujoco")
    followed_by(mujoco, "mj_setState", lambda _, data, *state: data.qacc_warmstart.fill(0))(
        monkeypatch
    )
    found = asked("restore")
    engine = conclude([each for each in found if each.layer == "engine"])
    assert engine.suffice == ("mj_copyData",)
    assert "mjSTATE_INTEGRATION" in engine.fail
    assert broken(found) == {("interface", STATE)}


@pytest.mark.usefixtures("bullet")
def test_a_restore_of_pybullet_that_depends_on_the_past(monkeypatch: pytest.MonkeyPatch) -> None:
    from statemachine.backends._bullet_world import World

    monkeypatch.setattr(World, "place", World.put)
    found = asked("restore", "pybullet", only=("keyframe", "limp"))
    assert broken(found) == {("interface", STATE)}
    assert {each.into for each in found if not each.holds} == {"each other"}
    of_the_engine = [each for each in found if each.layer == "engine"]
    assert "taken apart + targets" not in conclude(of_the_engine).agree


@pytest.mark.slow
def test_another_process_that_computes_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    """This one does, always in the same way: only the other one can tell."""
    followed_by(MujocoData, "_set_state", leave_a_force)(monkeypatch)
    followed_by(MujocoDriver, "start", lambda _, raw, __: raw.qfrc_applied.put(1, 1e-9))(
        monkeypatch
    )
    result = audit.run(sm.load(SCENE), steps=10)
    engine, interface = result.audited
    assert {each.experiment for each in engine.findings if not each.holds} == {"process"}
    assert "pickled State" in {each.experiment for each in interface.findings if not each.holds}
    assert not report.page({"mujoco": result}).holds


# Conclusions follow from findings, and a page from conclusions.


def test_conclusions_follow_from_findings(of_mujoco: Figures) -> None:
    """Another engine would get other sentences."""
    engine = of_mujoco.audited[0]

    changed = [
        with_figures(each, gap=FutureGap(each.gap.steps, None, 0.0, 0.0))
        if each.case == "warmstart"
        else each
        for each in engine.findings
    ]
    found = conclude(changed)
    assert found.idle == ("warmstart",)
    other = with_figures(engine, findings=tuple(changed), conclusion=found)
    changed_page = report.page({"x": with_figures(of_mujoco, audited=(other,))})
    assert "warmstart" not in _needed(changed_page)
    assert any("warmstart" in line for line in _lines(changed_page))
    assert not any("warmstart" in line for line in _lines(report.page({"x": of_mujoco})))


def _needed(page: Page) -> dict[str, tuple[str, ...]]:
    """What has to be restored, and the cells beside it."""
    return {
        str(row[0]): tuple(row[1:])
        for table in blocks(page, Table)
        if table.headers[0] == "left out"
        for row in table.rows
    }


def _lines(page: Page) -> list[str]:
    return [line for items in blocks(page, Items) for line in items.texts]


def test_the_page_says_what_suffices(of_mujoco: Figures) -> None:
    page = report.page({"x": of_mujoco})
    places = {name: str(cells[0]) for name, cells in _needed(page).items()}
    assert_has(places, time="clock", warmstart="default, keyframe, limp, limit, clock", qpos="all")
    assert places["ctrl"].startswith("none")
    assert max(map(cell_len, shown(page).splitlines())) <= 80
    assert set(places) == {each.field for each in of_mujoco.audited[0].conclusion.missing}
    assert page.holds


@pytest.mark.slow
def test_the_page_says_that_nothing_suffices(of_pybullet: Figures) -> None:
    page = report.page({"x": of_pybullet})
    assert _needed(page) == {}
    assert any("acts through contacts" in line for line in _lines(page))
    assert max(map(cell_len, shown(page).splitlines())) <= 80
    assert page.holds


# The command.


@pytest.mark.slow
def test_a_broken_promise_is_exit_code_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    followed_by(MujocoData, "_set_state", forget_warm_start)(monkeypatch)
    assert main(["audit", "--steps", "10"]) == 1
    assert "yes, broken" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_no_file_and_no_world_stay(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    before = bullet_clients()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    audit.run(sm.load(SCENE, backend="pybullet"), steps=5)
    assert (bullet_clients(), list(tmp_path.iterdir())) == (before, [])
