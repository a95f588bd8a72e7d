"""Rows of the table of robots: bounds of a gap, commands that are drawn, and who examines what.

No other process is started: what examines a model is put in its place.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    DivergedError,
    EngineWarning,
    ModelError,
    UnsupportedError,
)
from statemachine.interface import Model
from statemachine.lab.recordings import record
from statemachine.lab.robots import (
    BackendRow,
    EngineTally,
    ExaminedModel,
    ModelFile,
    RefusedFeature,
    RunGap,
    Survey,
    WitnessRow,
    examine,
    examine_all,
    gaps,
)
from statemachine.lab.robots.request import RobotsRequest
from statemachine.lab.robots.survey import reason_in_general
from statemachine.lab.robots.table import read_table, write_table
from statemachine.processes import sandbox

from .support.backends import BOTH
from .support.files import written
from .support.requirements import need_engine
from .support.small_models import loaded

FAR = RunGap(400, 1e-3, moved=1.0)


# A gap at its bounds


def test_the_largest_of_a_gap_is_that_of_any_kind() -> None:
    for name in ("hinge", "slide", "position", "turn"):
        gap = RunGap(1, hinge=1e-6, slide=1e-6, position=1e-6, turn=1e-6)
        assert replace(gap, **{name: 2e-3}).largest == 2e-3
    assert RunGap(1).largest == 0.0


@pytest.mark.parametrize(
    ("floor", "is_so"), [(None, False), (1e-3 / 3.1, False), (1e-3 / 2.9, True)]
)
def test_a_gap_is_rounding_up_to_three_times_its_floor(floor: float | None, is_so: bool) -> None:
    assert replace(FAR, floor=floor).is_rounding is is_so


@pytest.mark.parametrize(
    ("hinge", "moved", "is_so"),
    [(9.9, 1.0, False), (10.1, 1.0, True), (2.9, 0.1, False), (3.1, 0.1, True), (3.1, 0.4, False)],
)
def test_a_gap_explodes_that_is_ten_times_as_large_as_the_motion(
    hinge: float, moved: float, is_so: bool
) -> None:
    assert RunGap(400, hinge, moved=moved).explodes is is_so


@pytest.mark.parametrize(("shrinks", "is_so"), [(None, False), (1.49, False), (1.5, True)])
def test_a_gap_vanishes_that_half_the_timestep_makes_less(
    shrinks: float | None, is_so: bool
) -> None:
    assert replace(FAR, shrinks=shrinks).first_order is is_so


@pytest.mark.parametrize(
    ("gap", "warned", "is_so"),
    [
        (None, False, False),
        (RunGap(400, 1e-6), False, False),
        (RunGap(400, 1.01e-6), False, True),
        (RunGap(400, 1.01e-6), True, False),
        (RunGap(400, 0.0, ended="it stopped"), True, True),
    ],
)
def test_a_gap_above_a_millionth_wants_a_reason(
    gap: RunGap | None, warned: bool, is_so: bool
) -> None:
    told = ("RK4 acts as Euler",) if warned else ()
    assert BackendRow(without_contacts=gap, warnings_without=told).unexplained is is_so


@pytest.mark.parametrize(("gap", "is_wrong"), [(None, False), (1e-9, False), (1.1e-9, True)])
def test_the_witness_places_a_frame_within_a_nanometre(gap: float | None, is_wrong: bool) -> None:
    row = ExaminedModel("a.xml", "", "", witness=WitnessRow("own reading", "", 1, gap))
    assert bool(row.wrong("mujoco")) is is_wrong


def test_a_gap_of_the_default_backend_itself_is_not_told() -> None:
    row = ExaminedModel("a.xml", "", "", backends={"mujoco": BackendRow(without_contacts=FAR)})
    assert row.wrong("mujoco") == ()
    assert len(row.wrong("pybullet")) == 1


@pytest.mark.parametrize(("backend", "is_wrong"), [("pybullet", True), ("motrix", False)])
def test_a_gap_is_wrong_where_our_backend_computes_the_joints(backend: str, is_wrong: bool) -> None:
    rows = {backend: BackendRow(without_contacts=RunGap(400, 0.1))}
    assert bool(ExaminedModel("", "", "", backends=rows).wrong("mujoco")) is is_wrong


@pytest.mark.parametrize(("backend", "is_wrong"), [("pybullet", True), ("motrix", False)])
def test_an_explosion_is_wrong_where_our_backend_computes_the_joints(
    backend: str, is_wrong: bool
) -> None:
    rows = {backend: BackendRow(with_contacts=RunGap(400, 1e3))}
    assert bool(ExaminedModel("", "", "", backends=rows).wrong("mujoco")) is is_wrong


def test_a_part_is_a_model_where_it_loads_and_moves() -> None:
    part = ExaminedModel("a.xml", "", "", part_of="b.xml")
    assert not part.is_model
    assert not replace(part, nv=0).is_model
    assert replace(part, nv=1).is_model
    assert replace(part, part_of="").is_model


# Sums


def test_the_sums_of_engines_count_each_thing_by_itself() -> None:
    rows = [
        BackendRow(without_contacts=RunGap(400, 1e-6)),
        BackendRow(without_contacts=replace(FAR, floor=1.0)),
        BackendRow(without_contacts=replace(FAR, floor=1.0)),
        BackendRow(refusal="no", without_contacts=replace(FAR, shrinks=2.0)),
        BackendRow(without_contacts=replace(FAR, shrinks=2.0, ended="it stopped")),
        BackendRow(refusal="no", refusal_without="no", features=("tendon", "mesh")),
        BackendRow(refusal="no", features=("tendon",)),
    ]
    exact = [True, True, True, False, None, None, None]
    models: list[ExaminedModel] = []
    for k, (row, is_exact) in enumerate(zip(rows, exact, strict=True)):
        both = {"mujoco": BackendRow(equals_engine=is_exact), "pybullet": row}
        models.append(ExaminedModel(f"{k}.xml", "", "", backends=both))
    survey = Survey("mujoco", models, (), "w")
    assert survey.engines == (
        EngineTally("mujoco", 7, 0, 3, None, None, None),
        EngineTally("pybullet", 4, 2, None, within=1, rounding=2, vanishes=1),
    )
    assert survey.refused_features("pybullet") == (
        RefusedFeature("tendon", models=2, alone=1, loaded_without_contacts=1),
        RefusedFeature("mesh", models=1, alone=0, loaded_without_contacts=0),
    )


@pytest.mark.parametrize(
    ("refusal", "reason"),
    [
        ("MuJoCo cannot read /a b/c.xml: no mesh 'hip'", "no mesh …"),
        (
            "MotrixSim cannot read c.xml: failed to load scene, Invalid inertia for Link at link "
            'index 26 ("hip"): not positive [[0.0, 0.0, 0.0]]',
            "Invalid inertia for Link at link index … (…): not positive …",
        ),
        (
            "MotrixSim cannot read C:\\a.xml: unknown variant `include`, expected one of `body`",
            "unknown variant `include`",
        ),
        ("MotrixSim cannot read c.xml: Invalid extension: /a/b.msh", "Invalid extension: …"),
        ("it is out of order", "it is out of order"),
    ],
)
def test_a_reason_in_general_has_nothing_of_one_file(refusal: str, reason: str) -> None:
    assert reason_in_general(refusal) == reason


@pytest.mark.parametrize(("default", "has_reason"), [("", True), ("no mesh", False)])
def test_why_a_file_is_not_read_is_told_where_the_default_engine_reads_it(
    default: str, has_reason: bool
) -> None:
    unread = BackendRow(refusal="motrix cannot read a.xml: no box 3", features=("not read",))
    backends = {"mujoco": BackendRow(refusal=default), "motrix": unread}
    survey = Survey("mujoco", (ExaminedModel("a.xml", "", "", backends=backends),), (), "")
    (refused,) = survey.refused_features("motrix")
    assert refused.feature == ("not read: no box …" if has_reason else "not read")


def test_a_survey_of_one_model_has_no_parts() -> None:
    row = ExaminedModel("a.xml", "", "")
    assert Survey("mujoco", (row,), (), "").is_of_one_model
    assert not Survey("mujoco", (row,), (row,), "").is_of_one_model
    assert not Survey("mujoco", (row, row), (), "").is_of_one_model


# Commands


MANY = """<body><joint name="a" axis="0 1 0"/><geom size="0.1"/></body>
<body pos="1 0 0"><joint name="b" axis="0 1 0" limited="true" range="-0.5 1.5"/>
<geom size="0.1"/></body><body pos="2 0 0"><joint name="c" type="slide"/><geom size="0.1"/></body>
<body pos="3 0 0"><joint name="d" type="slide"/><geom size="0.1"/></body>"""
DRIVES = """<actuator><position joint="a" kp="5" ctrllimited="true" ctrlrange="1 3"/>
<position joint="b" kp="5"/><position joint="a" kp="5"/>
<motor joint="c" ctrllimited="true" ctrlrange="2 6"/><motor joint="d"/></actuator>"""


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Model:
    option = "<compiler angle='radian'/><option timestep='0.002'/>"
    return loaded(tmp_path_factory.mktemp("many"), MANY, DRIVES, option=option)


def test_a_command_is_about_the_middle_of_its_range_by_a_share_of_it(many: Model) -> None:
    drawn = gaps.commands(many, 50 * 400, 0)
    assert drawn.shape == (50 * 400, 5)
    # Half of a servo's range, its joint's where it has none, or of 1; a tenth of a motor's.
    for column, (middle, half) in enumerate(
        ((2.0, 0.5), (0.5, 0.5), (0.0, 0.5), (4.0, 0.2), (0.0, 0.1))
    ):
        values = drawn[:, column]
        assert np.abs(values - middle).max() <= half
        assert values.max() == pytest.approx(middle + half, rel=0.02, abs=0.02 * half)
        assert values.min() == pytest.approx(middle - half, rel=0.02, abs=0.02 * half)


def test_a_command_holds_for_fifty_steps(many: Model) -> None:
    drawn = gaps.commands(many, 120, 3)
    assert len(drawn) == 120
    changes = np.flatnonzero((np.diff(drawn, axis=0) != 0).any(axis=1)) + 1
    assert changes.tolist() == [50, 100]
    assert np.array_equal(drawn, gaps.commands(many, 130, 3)[:120])
    assert not np.array_equal(drawn, gaps.commands(many, 120, 4))


def test_a_run_has_the_start_and_a_row_for_each_step(many: Model) -> None:
    orders = gaps.commands(many, 60, 0)
    rows, ended = gaps.run(many, orders)
    trace = record(many, gaps.in_order(np.vstack([orders, orders[-1:]])), seconds=60 * 0.002)
    assert ended == ""
    assert rows[:, : many.nq].tolist() == trace.qpos.tolist()
    assert rows[:, many.nq :].tolist() == trace.qvel.tolist()


def test_a_run_that_stops_tells_why(many: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    def drives(model: Model, data: sm.Data, *_: Any) -> Any:
        yield 0
        raise DivergedError("it left every bound", time=0.0, quantity="qpos", index=0)

    monkeypatch.setattr(gaps, "drive", drives)
    rows, ended = gaps.run(many, np.zeros((5, 5)))
    assert len(rows) == 1
    assert "mujoco" in ended
    assert "it left every bound" in ended


MIXED = """<body name="ball" pos="0 0 1"><freejoint/><geom size="0.1"/></body>
<body pos="1 0 0"><joint name="a" axis="0 1 0"/><geom size="0.1" pos="0.1 0 0"/></body>
<body pos="2 0 0"><joint name="c" type="slide" axis="0 0 1"/><geom size="0.1"/></body>"""


def test_a_gap_is_told_by_the_kind_of_coordinate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two runs of two rows: free body, hinge and slide, each off by its own amount."""
    model = loaded(tmp_path, MIXED)
    start = np.zeros(model.nq + model.nv)
    start[3] = 1.0
    one = np.array([start, start])
    one[1, [0, 8]] = 0.25, -0.75  # how far the first engine moves
    other = one.copy()
    other[1, 1], other[1, 7], other[1, 8] = 0.5, 0.125, -1.0
    other[1, 3:5] = np.cos(0.2), np.sin(0.2)
    other[1, model.nq + 2] = -7.0
    runs = iter([(one, ""), (np.vstack([other, other]), "it stopped")])
    monkeypatch.setattr(gaps, "run", lambda *_: next(runs))
    gap = gaps.run_gap(model, model.replace(timestep=0.001), 0)
    assert gap.steps == 1
    assert (gap.hinge, gap.slide, gap.position) == (0.125, 0.25, 0.5)
    assert gap.turn == pytest.approx(0.4)
    assert (gap.moved, gap.fastest, gap.ended) == (0.75, 7.0, "it stopped")


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Model, Model]:
    """Return a slide on two sides, whose runs are put in its place."""
    text = '<body><joint name="c" type="slide" axis="0 0 1"/><geom size="0.1"/></body>'
    model = loaded(tmp_path, text)
    return model, model.replace(gravity=[0, 0, -9])


ENDS = (True, False, False)  # the right side, as it is


def runs_by_timestep(
    pair: tuple[Model, Model], places: dict[tuple[bool, bool, bool], float]
) -> Callable[..., tuple[np.ndarray, str]]:
    """Return a run that ends at a place: by right or left, nudged or not, finer or not."""
    gravity = pair[1].raw.opt.gravity[2]

    def run(model: Model, orders: np.ndarray, nudge: Any = None) -> tuple[np.ndarray, str]:
        is_right = model.raw.opt.gravity[2] == gravity
        is_finer = model.timestep < pair[0].timestep
        assert len(orders) == (2 if is_finer else 1) * gaps.STEPS
        place = places.get((is_right, nudge is not None, is_finer), 0.0)
        return np.array([[0.0, 0.0], [place, 0.0]]), ""

    return run


@pytest.mark.parametrize(
    ("places", "floor", "shrinks"),
    [
        # The gap is 1e-6 and no more is asked; above that the floor of the farther side is.
        ({ENDS: 1e-6}, None, None),
        ({ENDS: 1.1e-6, (True, True, False): 1.1e-6}, 0.0, None),
        (
            {
                ENDS: 0.4,
                (True, True, False): 0.41,
                (False, True, False): 0.02,
                (True, False, True): 0.1,
            },
            0.02,
            4.0,
        ),
        # Of rounding nothing more is asked.
        (
            {ENDS: 0.4, (True, True, False): 0.2, (True, False, True): 0.1},
            0.2,
            None,
        ),
        ({ENDS: 0.4, (True, True, False): 0.4}, 0.0, None),  # no gap is left
    ],
)
def test_what_is_asked_of_a_gap(
    pair: tuple[Model, Model],
    monkeypatch: pytest.MonkeyPatch,
    places: dict[tuple[bool, bool, bool], float],
    floor: float | None,
    shrinks: float | None,
) -> None:
    monkeypatch.setattr(gaps, "run", runs_by_timestep(pair, places))
    gap = gaps.run_gap(*pair, 0, halve=True)
    assert gap.slide == places[ENDS]
    assert gap.floor == (None if floor is None else pytest.approx(floor))
    assert gap.shrinks == (None if shrinks is None else pytest.approx(shrinks))
    assert gaps.run_gap(*pair, 0).shrinks is None


def test_a_gap_that_is_there_is_looked_for_at_half_the_timestep(
    pair: tuple[Model, Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    timesteps: set[float] = set()
    places = {ENDS: 0.4, (True, True, False): 0.4, (True, False, True): 0.1}
    run = runs_by_timestep(pair, places)

    def noting(model: Model, *more: Any) -> tuple[np.ndarray, str]:
        timesteps.add(model.timestep)
        return run(model, *more)

    monkeypatch.setattr(gaps, "run", noting)
    gaps.run_gap(*pair, 0, halve=True)
    assert timesteps == {pair[0].timestep, pair[0].timestep / 2}


# What examines, and its table

CODE: dict[str, Any] = {"end": "code", "code": 0, "how": "ended the process with code 0"}


def ending(**facts: Any) -> sandbox.ProcessOutcome:
    usual = {"started": True, "stdout": "", "stderr": "", "seconds": 1.0} | CODE
    names = sandbox.ProcessOutcome.__dataclass_fields__
    return sandbox.ProcessOutcome(**{name: (usual | facts).get(name, 0) for name in names})


def answers(
    patch: pytest.MonkeyPatch,
    outcome: sandbox.ProcessOutcome | None = None,
    part: str = "",
    nv: int = 2,
) -> list[dict[str, Any]]:
    """Put an answer in the place of the process that examines; return what it is asked."""
    asked: list[dict[str, Any]] = []

    def run(command: list[str], limits: sandbox.Limits, **more: Any) -> sandbox.ProcessOutcome:
        path, quick, seed, answer = command[-4:]
        folder = Path(more["cwd"])
        assert Path(answer).parent == folder
        asked.append({"path": path, "quick": quick, "seed": seed, "limits": limits})
        if part != "start":
            Path(answer).write_bytes(pickle.dumps((part, ExaminedModel("", "", "", nv=nv))))
        return outcome or ending()

    patch.setattr("statemachine.lab.robots.sandbox.run", run)
    return asked


def files(*names: str, part_of: str = "") -> list[ModelFile]:
    return [ModelFile(name, Path("/robots") / name, f"digest of {name}", part_of) for name in names]


def test_a_model_is_examined_with_its_settings_and_within_its_limits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = answers(monkeypatch)
    survey = examine_all(files("a.xml"), quick=True, seconds=20.0, seed=7, jobs=1)
    (told,) = asked
    assert (told["path"], told["quick"], told["seed"]) == ("/robots/a.xml", "quick", "7")
    limits = told["limits"]
    assert (limits.cpu, limits.wall, limits.memory_most) == (140.0, 20.0, 8 * 1024**3)
    (row,) = survey.models
    assert (row.file, row.sha256, row.limit) == ("a.xml", "digest of a.xml", 20.0)
    assert (row.nq, row.nv, row.ended, row.made_with) == (None, 2, "", survey.made_with)
    assert 0.0 <= row.took < 5.0


def test_without_a_word_everything_is_examined(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = answers(monkeypatch)
    examine_all(files("a.xml"), jobs=1)
    assert (asked[0]["quick"], asked[0]["seed"], asked[0]["limits"].wall) == ("", "0", 60.0)


@pytest.mark.parametrize(
    ("outcome", "part", "ended"),
    [
        (ending(), "", ""),
        (ending(), "witness", "it ended the process with code 0 (at: witness)"),
        (ending(code=1, how="ended so"), "", "it ended so (at: the end)"),
        (ending(code=1, stderr="first\nlast\n"), "cost", "its process failed: last (at: cost)"),
        (ending(end="clock", how="took long", stderr="a\nb"), "cost", "it took long (at: cost)"),
        (ending(code=1, how="ended so"), "start", "it ended so (at: start)"),
        (ending(code=1, stderr="x" * 300), "", f"its process failed: {'x' * 200} (at: the end)"),
    ],
)
def test_a_row_says_how_an_examination_ended_that_did_not_come_to_its_end(
    monkeypatch: pytest.MonkeyPatch, outcome: sandbox.ProcessOutcome, part: str, ended: str
) -> None:
    answers(monkeypatch, outcome, part)
    (row,) = examine_all(files("a.xml"), jobs=1).models
    assert row.ended == ended


def test_progress_is_the_share_of_models_that_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch)
    fractions: list[float] = []
    survey = examine_all(
        files("a.xml", "b.xml", "c.xml", "d.xml"), jobs=1, progress=fractions.append
    )
    assert [row.file for row in survey.models] == ["a.xml", "b.xml", "c.xml", "d.xml"]
    assert set(fractions) <= {0.0, 0.25, 0.5, 0.75, 1.0}
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_a_part_that_moves_nothing_is_counted_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, nv=0)
    survey = examine_all([*files("a.xml"), *files("b.xml", part_of="a.xml")], jobs=1)
    assert [row.file for row in survey.models] == ["a.xml"]
    assert [row.file for row in survey.parts] == ["b.xml"]


def again(
    patch: pytest.MonkeyPatch, table: Path, models: list[ModelFile], **settings: Any
) -> list[str]:
    """Return the names of what is examined for a table that may have it."""
    asked = answers(patch)
    examine_all(models, jobs=1, table=table, **settings)
    return [Path(told["path"]).name for told in asked]


def test_what_a_table_has_is_not_examined_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, models = tmp_path / "table.csv", files("a.xml", "b.xml")
    assert again(monkeypatch, table, models) == ["a.xml", "b.xml"]
    assert again(monkeypatch, table, models) == []
    assert again(monkeypatch, table, models, seconds=30.0) == []
    assert again(monkeypatch, table, [models[0], replace(models[1], sha256="other")]) == ["b.xml"]
    assert again(monkeypatch, table, models[:1], seed=1) == ["a.xml"]
    assert len(read_table(table)) == 1  # of the models that are asked for alone


def test_what_ended_early_is_examined_again_with_another_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, models = tmp_path / "table.json", files("a.xml")
    answers(monkeypatch, ending(end="clock", how="took long"))
    examine_all(models, jobs=1, table=table, seconds=20.0)
    assert again(monkeypatch, table, models, seconds=20.0) == []
    assert again(monkeypatch, table, models, seconds=21.0) == ["a.xml"]


def test_what_a_table_has_takes_over_what_the_file_is_part_of_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "table.csv"
    answers(monkeypatch)
    examine_all(files("a.xml"), jobs=1, table=table)
    (row,) = examine_all(files("a.xml", part_of="b.xml"), jobs=1, table=table).models
    assert row.part_of == "b.xml"


@pytest.mark.parametrize(
    ("settings", "is_right"),
    [
        ({"seconds": 86400.0}, True),
        ({"seconds": 86401.0}, False),
        ({"seconds": 0.0}, False),
        ({"seconds": 1e-3}, True),
        ({"seed": -1}, False),
        ({"seed": 0}, True),
        ({"jobs": 0}, False),
    ],
)
def test_the_limits_of_settings(settings: dict[str, Any], is_right: bool) -> None:
    if is_right:
        assert RobotsRequest(("a",), **settings).paths == ("a",)
        return
    with pytest.raises(BadInputError):
        RobotsRequest(("a",), **settings)


def test_a_cell_of_a_table_is_read_as_what_it_was(tmp_path: Path) -> None:
    gap = RunGap(3, None, 0.5, ended="it stopped", floor=0.0)
    row = ExaminedModel(
        "a.xml", "1", "w", nq=0, backends={"mujoco": BackendRow(restores=False, with_contacts=gap)}
    )
    for suffix in ("csv", "json"):
        table = tmp_path / f"t.{suffix}"
        write_table(table, [row])
        assert list(read_table(table).values()) == [row]


# What is found of a model, part by part

TINY = """<mujoco><option timestep='0.002'/><worldbody><body name='arm' pos='0 0 1'>
<joint name='j' axis='0 1 0' damping='0.1'/>
<geom type='capsule' fromto='0 0 0 0.4 0 0' size='0.03'/>
</body></worldbody><actuator><position joint='j' kp='5' ctrlrange='-1 1'/></actuator></mujoco>"""


def examined(
    folder: Path,
    patch: pytest.MonkeyPatch,
    loads: Callable[..., Model],
    run_gap: Callable[..., RunGap] = lambda *_, **__: RunGap(1),
    backends: Sequence[str] = BOTH,
) -> tuple[ExaminedModel, list[str]]:
    """Return the row of a small model that is loaded so, and the parts that were told."""
    parts: list[str] = []
    patch.setattr(examine, "load_to_run", loads)
    patch.setattr(examine, "backend_names", lambda: list(backends))
    patch.setattr(gaps, "run_gap", run_gap)
    patch.setattr(examine, "certify", lambda *_, **__: 1 / 0)
    path = written(folder / "tiny.xml", TINY)
    row = examine.examine(
        path, ExaminedModel("", "", ""), True, 0, lambda _row, part: parts.append(part)
    )
    return row, parts


def load_with(
    told: Mapping[tuple[str, bool], str | Exception],
) -> Callable[..., Model]:
    """Return a loader that warns or raises, by backend and whether there are contacts."""

    def load(path: Path, backend: str, contacts: bool = True) -> Model:
        said = told.get((backend, contacts))
        if isinstance(said, Exception):
            raise said
        if said:
            warnings.warn(said, EngineWarning, stacklevel=2)
        return sm.load(path, backend) if contacts else sm.load(path, backend, contacts=False)

    return load


def test_a_warning_that_the_default_gave_too_is_not_of_another_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {
        ("mujoco", True): "MuJoCo, which compiles it: a mesh is open",
        ("pybullet", True): "PyBullet, which reads it: a mesh is open",
        ("pybullet", False): "RK4 acts as Euler",
    }
    row, _ = examined(tmp_path, monkeypatch, load_with(told))
    assert row.backends["mujoco"].warnings == ("MuJoCo, which compiles it: a mesh is open",)
    assert row.backends["pybullet"].warnings == ()
    assert row.backends["pybullet"].warnings_without == ("RK4 acts as Euler",)


def test_what_is_refused_is_told_with_contacts_and_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking = UnsupportedError("no mesh", backend="pybullet", feature="mesh", reason="it has none")
    told = {
        ("pybullet", True): lacking,
        ("mujoco", False): ModelError("it cannot be read"),
    }
    row, parts = examined(tmp_path, monkeypatch, load_with(told))
    pybullet, default = row.backends["pybullet"], row.backends["mujoco"]
    assert (pybullet.features, bool(pybullet.refusal), pybullet.loading) == (
        ("mesh",),
        True,
        "without contacts",
    )
    assert (default.features, default.refusal) == (("not read",), "")
    assert default.refusal_without
    # There is no pair of Models, with contacts or without.
    assert not [part for part in parts if part.startswith("gap")]
    assert pybullet.restores is True
    assert default.equals_engine is True


def test_both_gaps_are_compared_where_both_engines_load(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[bool, bool]] = []

    def run_gap(left: Model, right: Model, seed: int, halve: bool = False) -> RunGap:
        assert (left.backend, right.backend) == ("mujoco", "pybullet")
        has_contacts = "contacts" not in left.options
        asked.append((has_contacts, halve))
        return RunGap(7 if has_contacts else 8)

    row, parts = examined(tmp_path, monkeypatch, load_with({}), run_gap)
    assert asked == [(False, True), (True, False)]
    assert row.backends["pybullet"].without_contacts == RunGap(8)
    assert row.backends["pybullet"].with_contacts == RunGap(7)
    assert (row.nq, row.nv, row.nu, row.nbody, row.ngeom) == (1, 1, 1, 2, 1)
    assert [fault.partition(":")[0] for fault in row.faults] == ["witness"]
    assert parts[0] == "loading, mujoco"
    assert row.backends["mujoco"].scenarios == {}


def test_an_error_that_nobody_meant_is_a_fault_and_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {("pybullet", True): ZeroDivisionError("a slip")}
    row, _ = examined(tmp_path, monkeypatch, load_with(told))
    assert row.backends["pybullet"].refusal == "ZeroDivisionError: a slip"
    assert any(fault.startswith("loading, pybullet") for fault in row.faults)


@pytest.mark.parametrize(
    ("backend", "number", "restores"),
    [("mujoco", 0, False), ("mujoco", 2, False), ("pybullet", 0, True), ("pybullet", 2, False)],
)
def test_a_restore_that_parts_from_its_run_is_told_where_equality_is_promised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backend: str, number: int, restores: bool
) -> None:
    """One of three futures is another: that of the run itself, or that of the second restore."""
    calls = {"mujoco": 0, "pybullet": 0}

    def future(model: Model, data: sm.Data, steps: int) -> np.ndarray:
        count = calls[model.backend]
        calls[model.backend] += 1
        assert steps == 60
        return np.array([float((model.backend, count) == (backend, number))])

    monkeypatch.setattr(examine, "future", future)
    row, _ = examined(tmp_path, monkeypatch, load_with({}))
    assert row.backends[backend].restores is restores


@pytest.mark.parametrize(("backend", "is_fault"), [("pybullet", True), ("motrix", False)])
def test_a_run_that_diverges_is_a_fault_where_our_backend_computes_the_joints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backend: str, is_fault: bool
) -> None:
    need_engine(backend)

    def diverging(model: Model, *_: object) -> np.ndarray:
        if model.backend == backend:
            raise DivergedError("it went beyond max_qvel")
        return np.zeros(3)

    monkeypatch.setattr(examine, "future", diverging)
    backends = ("mujoco", backend)
    row, _ = examined(tmp_path, monkeypatch, load_with({}), backends=backends)
    assert any(backend in fault for fault in row.faults) is is_fault
    assert row.backends[backend].restores is None
    assert row.backends["mujoco"].restores is True
