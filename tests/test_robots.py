"""A folder of models: what is found in it, and that no model can spoil the table."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import mujoco
import numpy as np
import pytest

from statemachine.backends import load
from statemachine.errors import BadInputError
from statemachine.installed import engine_version
from statemachine.lab.recordings import record_scenario
from statemachine.lab.robots import (
    BackendRow,
    EngineTally,
    ExaminedModel,
    RefusedFeature,
    RunGap,
    Survey,
    WitnessRow,
    examine_all,
    find,
    gaps,
)
from statemachine.lab.robots.page import page, unique_ends
from statemachine.lab.robots.table import read_table, write_table
from statemachine.lab.runs.provenance import model_files
from statemachine.lab.runs.scenarios import scenario

from .support.claims import assert_has, assert_in, refused
from .support.files import written, written_all
from .support.pages import shown
from .support.patches import around
from .support.processes import processes_with, soon
from .support.requirements import ROOT, need_engine
from .support.small_models import mjcf

GOOD = """<mujoco><option timestep='0.002'/><worldbody>
<body name='arm' pos='0 0 1'><joint name='j' axis='0 1 0' damping='0.1'/>
<geom name='rod' type='capsule' fromto='0 0 0 0.4 0 0' size='0.03'/>
<body name='hand' pos='0.4 0 0'><joint name='k' axis='0 1 0' damping='0.1'/>
<geom type='sphere' size='0.05'/></body></body></worldbody>
<actuator><position joint='j' kp='5' ctrlrange='-1 1'/></actuator></mujoco>"""
TENDON = (
    GOOD.replace("<geom name", "<site name='s'/><geom name")
    .replace(
        "</worldbody>",
        "<body pos='1 0 0'><freejoint/><geom size='.05'/><site name='t'/></body></worldbody>",
    )
    .replace(
        "</mujoco>",
        "<tendon><spatial stiffness='1'><site site='s'/><site site='t'/></spatial>"
        "</tendon></mujoco>",
    )
)
URDF = """<robot name='r'><link name='base'/><link name='tip'><inertial><mass value='1'/>
<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='a' type='revolute'><parent link='base'/><child link='tip'/><axis xyz='0 1 0'/>
<limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>"""
# Read before anything else by the Python that examines; by the name of its model it goes wrong.
SABOTAGE = """
import os, sys, time
if "statemachine.lab.robots.examine" in " ".join(sys.orig_argv):
    file = os.path.basename(sys.orig_argv[-4])
    if "crash" in file or ("hang" in file and "AGAIN" in os.environ):
        os.abort()
    if "hang" in file:
        time.sleep(600)
    if "memory" in file:
        sys.stderr.write("MemoryError")
        os._exit(1)
    with open(os.environ["EXAMINED"], "a") as log:
        log.write(file + "\\n")
"""


TEXTS = {
    "good.xml": GOOD,
    "arm.urdf": URDF,
    "broken.xml": "<mujoco><worldbody><body></worldbody>",
    "scene.xml": "<mujoco><include file='parts/hand.xml'/></mujoco>",
    "parts/hand.xml": mjcf("<body><geom size='.1' material='m'/></body>"),
    "parts/colours.xml": "<mujoco><asset/></mujoco>",
    "tendon.xml": TENDON,
    "package.xml": "<package/>",
    "binary.mjb": "\0",
    ".git/old.xml": GOOD,
    "notes.txt": "none",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with models, parts of models, and what is neither."""
    return written_all(tmp_path / "robots", TEXTS)


def sabotaged(folder: Path, patch: pytest.MonkeyPatch) -> Path:
    """Let models of some names go wrong; return the file in which the others are noted."""
    patch.syspath_prepend(written_all(folder / "site", {"sitecustomize.py": SABOTAGE}))
    log = written(folder / "examined.txt", "")
    patch.setenv("EXAMINED", str(log))
    return log


@pytest.fixture
def sabotage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let models of some names go wrong; return the file in which the others are noted."""
    return sabotaged(tmp_path, monkeypatch)


def test_models_in_a_folder_are_found_without_their_parts(folder: Path) -> None:
    found = {each.name: each for each in find([folder])}
    assert list(found) == [
        "arm.urdf", "broken.xml", "good.xml", "parts/hand.xml", "scene.xml", "tendon.xml"
    ]  # fmt: skip
    assert found["parts/hand.xml"].part_of == "scene.xml"
    assert not found["scene.xml"].part_of
    assert all(each.path.is_absolute() and len(each.sha256) == 64 for each in found.values())
    (folder / "parts" / "hand.xml").write_text(GOOD)
    kept = {each.name for each in find([folder]) if each.sha256 == found[each.name].sha256}
    assert found.keys() - kept == {"scene.xml", "parts/hand.xml"}  # which it includes


def test_an_include_is_looked_for_beside_the_main_file_then_beside_its_includer(
    tmp_path: Path,
) -> None:
    need_engine("mujoco")

    finger = "<mujoco><worldbody><body name='{}'/></worldbody></mujoco>"
    texts = {
        "main.xml": "<mujoco><include file='parts/hand.xml'/></mujoco>",
        "parts/hand.xml": "<mujoco><include file='finger.xml'/></mujoco>",
        "parts/finger.xml": finger.format("beside its includer"),
    }
    written_all(tmp_path, texts)

    def files() -> list[str]:
        paths = model_files(tmp_path / "main.xml")
        return [path.relative_to(tmp_path).as_posix() for path in paths]

    assert files() == ["main.xml", "parts/hand.xml", "parts/finger.xml"]
    assert "beside its includer" in load(tmp_path / "main.xml").body_names
    written(tmp_path / "finger.xml", finger.format("beside main"))
    assert files() == ["main.xml", "parts/hand.xml", "finger.xml"]
    assert "beside main" in load(tmp_path / "main.xml").body_names


def test_a_run_starts_where_the_experiments_start(tmp_path: Path) -> None:
    need_engine("mujoco")
    for names, start in ((("up", "home"), 1), (("up",), None)):
        keys = "".join(f"<key name='{name}' qpos='0.1 0.2'/>" for name in names)
        text = GOOD.replace("</mujoco>", f"<keyframe>{keys}</keyframe></mujoco>")
        model = load(written(tmp_path / "robot.xml", text))
        assert gaps.keyframe_of(model) == start
        trace = record_scenario(scenario("hold"), model, seconds=0.02)
        rows, _ = gaps.run(model, np.zeros((0, 1)))
        assert rows[0, : model.nq].tolist() == trace["qpos"][0].tolist()


# Five short links that swing freely, from far up: chaos, within 4 s.
CHAOS = "<mujoco><option timestep='0.01' integrator='RK4'/><worldbody>{}</worldbody></mujoco>"


def chaos(links: int = 5) -> str:
    text = ""
    for k in reversed(range(links)):
        text = (
            f"<body name='b{k}' pos='{0.1 * bool(k)} 0 0'><joint name='j{k}' axis='0 1 0'/>"
            f"<geom type='capsule' fromto='0 0 0 0.1 0 0' size='0.01' contype='0'/>{text}</body>"
        )
    return CHAOS.format(text).replace("name='b0'", "name='b0' euler='0 -80 0'")


def test_a_gap_of_rounding_is_no_gap_of_engines(tmp_path: Path) -> None:
    """Gravity that differs by its thirteenth digit: what comes of that is the chaos of the robot.

    Three links are not yet as far apart as they can be: there gap and floor would be two numbers of
    one size, and the last bits of a processor would say which is larger.
    """
    model = load(written(tmp_path / "chaos.xml", chaos(3)))
    same = model.replace(gravity=[0, 0, -9.81 * (1 + 1e-13)])
    gap = gaps.run_gap(model, same, 0, halve=True)
    assert gap.largest > 1e-3
    raw = [mujoco.MjData(model.raw) for _ in range(2)]
    raw[1].qpos[0] = 1e-12
    for data in raw:
        mujoco.mj_step(model.raw, data, gaps.STEPS)
    assert np.abs(raw[0].qpos - raw[1].qpos).max() > 1e-3  # MuJoCo alone
    assert gap.floor is not None
    assert gap.largest < 0.1 * gap.floor
    assert_has(gap, is_rounding=True, shrinks=None)
    assert not BackendRow(without_contacts=gap).unexplained
    # One link is calm, and what is more than rounding stays a gap.
    calm = load(written(tmp_path / "calm.xml", chaos(1)))
    other: Any = gaps.run_gap(calm, calm.replace(gravity=[0, 0, -9.9]), 0)
    assert 0 < other.floor < 1e-6 < other.largest
    assert not other.is_rounding


def test_models_are_found_by_their_files_too(folder: Path) -> None:
    good, binary = folder / "good.xml", folder / "binary.mjb"
    (folder / "empty").mkdir()
    assert [each.path for each in find([good, binary, good])] == [good, binary]
    refused(
        (BadInputError, "no file", lambda: find([folder / "none"])),
        (BadInputError, "is not a model", lambda: find([folder / "notes.txt"])),
        (BadInputError, "no models", lambda: find([folder / "empty"])),
    )


ENDS = {
    "crash.xml": "it crashed the process (SIGABRT)",
    "hang.xml": "it took longer than 20 s",
    "memory.xml": "it asks for more memory",
}


@dataclass(frozen=True)
class TwoSurveys:
    """A survey of models of which some go wrong, and that of the same folder typed again.

    Attributes:
        first: What was found first.
        again: What was found once one of its models had changed.
        examined: Files that were examined for the second, in a Python that goes wrong no more.
    """

    first: Survey
    again: Survey
    examined: list[str]

    def rows(self) -> dict[str, ExaminedModel]:
        """Return the models of the first survey by their files."""
        return {row.file: row for row in self.first.models}


@pytest.fixture(scope="module")
def surveys(tmp_path_factory: pytest.TempPathFactory) -> TwoSurveys:
    """Return the surveys of a folder with every kind of trouble, and of what changed in it."""
    need_engine("pybullet")
    place = tmp_path_factory.mktemp("surveys")
    folder = written_all(place / "robots", TEXTS | dict.fromkeys(ENDS, GOOD))
    table = place / "table.json"
    with pytest.MonkeyPatch.context() as patch:
        log = sabotaged(place, patch)
        first = examine_all(find([folder]), quick=True, seconds=20, jobs=3, table=table)
        log.write_text("")
        patch.setenv("AGAIN", "1")  # what hung ends at once
        (folder / "good.xml").write_text(GOOD.replace("0.05", "0.06"))
        again = examine_all(find([folder]), quick=True, seconds=21, jobs=3, table=table)
        return TwoSurveys(first, again, log.read_text().split())


@pytest.mark.slow
def test_a_survey_has_a_row_for_each_model_and_counts_parts_apart(surveys: TwoSurveys) -> None:
    whole = {"arm.urdf", "broken.xml", "good.xml", "scene.xml", "tendon.xml"}
    assert list(surveys.rows()) == sorted(whole | set(ENDS))
    assert [row.file for row in surveys.first.parts] == ["parts/hand.xml"]


@pytest.mark.slow
def test_a_row_has_the_sizes_of_its_model(surveys: TwoSurveys) -> None:
    assert_has(surveys.rows()["good.xml"], nq=2, nv=2, nu=1, faults=())
    assert surveys.rows()["arm.urdf"].nv == 1


@pytest.mark.slow
def test_a_good_model_restores_on_both_engines_and_has_mujoco_s_bits(surveys: TwoSurveys) -> None:
    backends = surveys.rows()["good.xml"].backends
    assert_has(backends["mujoco"], equals_engine=True, restores=True, scenarios={})  # quick
    assert_has(backends["pybullet"], restores=True, equals_engine=None)


@pytest.mark.slow
def test_a_good_model_has_no_gap_without_contacts(surveys: TwoSurveys) -> None:
    gap = surveys.rows()["good.xml"].backends["pybullet"].without_contacts
    assert gap is not None
    assert_has(gap, hinge=pytest.approx(0, abs=1e-9), slide=None)
    assert gap.moved > 0.1


@pytest.mark.slow
def test_what_an_engine_lacks_is_its_refusal_alone(surveys: TwoSurveys) -> None:
    tendon = surveys.rows()["tendon.xml"].backends
    assert tendon["pybullet"].features == ("tendon between trees",)
    assert "tendon" in tendon["pybullet"].refusal
    assert tendon["mujoco"].equals_engine
    assert "cannot read" in surveys.rows()["broken.xml"].backends["mujoco"].refusal


@pytest.mark.slow
@pytest.mark.parametrize("name", ENDS)
def test_a_model_that_ends_its_process_is_a_row_that_says_how(
    name: str, surveys: TwoSurveys
) -> None:
    assert surveys.rows()[name].ended.startswith(ENDS[name])


@pytest.mark.slow
def test_a_survey_holds_only_without_models_that_end(surveys: TwoSurveys) -> None:
    assert set(surveys.first.wrong) == set(ENDS)
    assert not page(surveys.first).holds


@pytest.mark.slow
def test_a_survey_typed_again_tries_only_what_changed_or_ended(surveys: TwoSurveys) -> None:
    # The names of those that ended let them end again, before they are noted.
    assert surveys.examined == ["good.xml"]
    again = {row.file: row for row in surveys.again.models}
    assert list(again) == list(surveys.rows())
    assert again["tendon.xml"] == surveys.rows()["tendon.xml"]


@pytest.mark.slow
def test_a_row_has_the_scenarios_that_run_and_what_a_step_costs(folder: Path) -> None:
    (row,) = examine_all(find([folder / "good.xml"])).models
    for backend in row.backends.values():
        assert backend.scenarios.keys() == {"hold", "gravity", "droop", "waves"}
        assert backend.scenarios["gravity"] == "runs"
        assert backend.cost > 0
    assert not row.faults


def test_an_error_in_one_part_costs_that_part(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from statemachine.engines import raw_engine_of
    from statemachine.lab.robots import examine, gaps

    monkeypatch.setattr(examine, "get_state", lambda *_: 1 / 0)
    tell = Mock()
    row = examine.examine(folder / "good.xml", ExaminedModel("good.xml", "", ""), True, 0, tell)
    assert row.faults[0].startswith("restore, mujoco: ZeroDivisionError")
    assert row.backends["mujoco"].equals_engine
    stages = {call.args[1] for call in tell.call_args_list}
    assert "gap without contacts, pybullet" in stages or "pybullet" not in row.backends
    assert row.wrong("mujoco")
    # What is not the engine's own is seen.
    monkeypatch.setattr(gaps, "commands", lambda m, n, _: gaps.np.full((n, m.nu), 0.5))
    around(type(raw_engine_of("mujoco")), "plain_run")(
        lambda right, own, path, ctrl, key: right(own, path, ctrl + 1e-15, key)
    )(monkeypatch)
    row = examine.examine(folder / "good.xml", row, True, 0, tell)
    assert row.backends["mujoco"].equals_engine is False
    assert any("not the bits" in fault for fault in row.wrong("mujoco"))


ROW = ExaminedModel(
    "a/b.xml", "0" * 64, "with", 60.0, 1.5, "", "", ("one: \u00e4, \"b\"", "two"), 2, 2, 1, 3, 4,
    {
        "mujoco": BackendRow(
            equals_engine=True, restores=True, scenarios={"hold": "runs", "droop": "-"}, cost=1.01
        ),
        "pybullet": BackendRow(
            "has a tendon", "", ("tendon",), ("RK4",), ("RK4",), None, False,
            RunGap(400, 4e-4, None, 2.5e-17, 0.0, 1.0, 3.0, "", 2.0), None,
        ),
    },
    WitnessRow("own reading", "", 2, 1e-16),
)  # fmt: skip


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_a_table_is_read_as_it_was_written(tmp_path: Path, suffix: str) -> None:
    bare = ExaminedModel("=c.xml", "1" * 64, "with", ended="it crashed")
    target = tmp_path / f"table{suffix}"
    write_table(target, [ROW, bare])
    assert read_table(target) == {(row.file, row.sha256, "with"): row for row in (ROW, bare)}
    if suffix == ".csv":
        first, second = csv.DictReader(target.open(encoding="utf-8-sig"))
        assert first["backends.pybullet.without_contacts.hinge"] == "0.0004"
        assert second["file"] == "'=c.xml"  # no formula
    else:
        assert [row["file"] for row in json.loads(target.read_text())] == [ROW.file, "=c.xml"]
    target.write_text("a,b\n1,2\n" if suffix == ".csv" else '{"a": 1}')
    refused((BadInputError, "is not a table", lambda: read_table(target)))


def test_a_row_tells_what_is_wrong_with_an_engine() -> None:
    def wrong(row: ExaminedModel = ROW, **changes: object) -> str:
        backend = replace(ROW.backends["pybullet"], restores=True, **changes)
        return " ".join(replace(row, faults=(), backends={"pybullet": backend}).wrong("mujoco"))

    far = RunGap(400, 1e-3, moved=1.0)
    assert "two restores" in " ".join(ROW.wrong("mujoco"))
    shrinking, growing = (replace(far, shrinks=times) for times in (2.0, 1.0))
    for said, text in (
        (wrong(), ""),
        (wrong(without_contacts=far, warnings_without=()), "nothing accounts for"),
        (wrong(without_contacts=far, warnings_without=("RK4 acts as Euler",)), ""),
        (wrong(without_contacts=shrinking, warnings_without=()), ""),
        (wrong(without_contacts=growing, warnings_without=()), "nothing accounts"),
        (wrong(without_contacts=replace(far, ended="pybullet stopped")), "stopped"),
        (wrong(with_contacts=replace(far, hinge=1e10)), "explodes"),
        (wrong(with_contacts=replace(far, hinge=3.0)), ""),  # contacts may part
        *(
            (wrong(replace(ROW, witness=WitnessRow("own reading", "", 1, apart))), "the witness")
            for apart in (1e-3, float("nan"))
        ),
    ):
        assert text in said
        assert bool(said) == bool(text), said


@pytest.mark.parametrize(
    ("changes", "outcome"),
    [
        ({}, "measured"),
        ({"shrinks": 1.4}, "measured"),
        ({"shrinks": 2.0}, "vanishes"),
        ({"shrinks": 2.0, "floor": 1.0}, "rounding"),
        ({"floor": 1.0, "ended": "it stopped"}, "stops"),
        ({"ended": "it stopped", "hinge": 1e3}, "explodes"),
    ],
)
def test_the_outcome_of_a_gap_is_the_gravest(changes: dict[str, Any], outcome: str) -> None:
    assert replace(RunGap(400, 1e-3, moved=1.0), **changes).outcome == outcome


@pytest.mark.parametrize(
    ("changes", "loading"),
    [
        ({}, "with contacts"),
        ({"refusal": "has a tendon"}, "without contacts"),
        ({"refusal": "has a tendon", "refusal_without": "has a tendon"}, "never"),
    ],
)
def test_with_what_a_model_loads(changes: dict[str, Any], loading: str) -> None:
    assert BackendRow(**changes).loading == loading


@pytest.mark.parametrize(
    ("changes", "exactness"),
    [
        ({"ended": "it crashed"}, "ended"),
        ({"backends": {}}, "refused"),
        ({"backends": {"mujoco": BackendRow("no", "no")}}, "refused"),
        ({"backends": {"mujoco": BackendRow()}}, "not asked"),
        ({"backends": {"mujoco": BackendRow(restores=True)}}, "exact"),
        ({}, "differs"),  # two restores of PyBullet part
    ],
)
def test_the_exactness_of_a_model(changes: dict[str, Any], exactness: str) -> None:
    assert replace(ROW, **changes).exactness("mujoco") == exactness


def test_the_comparison_of_a_model_on_two_engines() -> None:
    assert ROW.comparison("pybullet", contacts=False) == "vanishes"
    assert ROW.comparison("pybullet", contacts=True) == "refused"
    assert ROW.comparison("mujoco", contacts=True) == "not compared"
    assert ROW.comparison("drake", contacts=True) == "not compared"
    assert replace(ROW, nv=0).comparison("pybullet", contacts=False) == "still"


def test_the_sums_of_a_survey() -> None:
    ended = replace(ROW.backends["pybullet"], without_contacts=RunGap(3, ended="it stopped"))
    models = (ROW, replace(ROW, backends={**ROW.backends, "pybullet": ended}, witness=None))
    survey = Survey("mujoco", models, (), "w")
    mujoco_sums, pybullet_sums = survey.engines
    assert mujoco_sums == EngineTally("mujoco", 2, 0, 2, None, None, None)
    assert pybullet_sums == EngineTally("pybullet", 0, 2, None, 0, 0, 1)
    assert survey.grades == {"own reading": 1}
    assert survey.refused_features("pybullet") == (RefusedFeature("tendon", 2, 2, 2),)
    assert survey.refused_features("mujoco") == ()


def test_a_page_of_80_columns() -> None:
    long = replace(ROW, file="a_very_long_folder/" * 4 + "robot.xml")
    ended = replace(ROW, file="c.xml", ended="x", witness=None)
    many, one = (
        shown(page(Survey("mujoco", rows, (), "w"))) for rows in ((long, ROW, ended), (ROW,))
    )
    assert max(map(len, (many + one).splitlines())) <= 80
    assert_in(many, "…", "4e-4 → 0", "refused", "own 1e-16")
    (row,) = [line for line in many.splitlines() if line.startswith("tendon")]
    assert row.split() == ["tendon", "3", "3", "3"]
    assert_in(one, "has a tendon", "pybullet warns: RK4")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_a_table_and_no_process(
    folder: Path, sabotage: Path, tmp_path: Path, number: signal.Signals
) -> None:
    (folder / "hang.xml").write_text(GOOD)
    table = tmp_path / "table.csv"
    paths = os.pathsep.join([str(tmp_path / "site"), str(ROOT)])
    process = subprocess.Popen(
        [sys.executable, "-m", "statemachine", "robots", str(folder), "--quick", "--jobs", "3",
         "--out", str(table), "--seconds", "300"],
        env={**os.environ, "PYTHONPATH": paths}, text=True, stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )  # fmt: skip
    assert soon(lambda: table.exists() and len(read_table(table)) == 6, 120)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    code, says = {
        signal.SIGINT: (130, "Type the same to go on"),
        signal.SIGTERM: (-signal.SIGTERM, ""),
    }[number]
    assert process.returncode == code
    assert says in err
    assert len(read_table(table)) == 6
    for pid in processes_with("robots.examine"):
        with suppress(OSError):
            assert str(sabotage).encode() not in Path(f"/proc/{pid}/environ").read_bytes()


@pytest.mark.parametrize(("quick", "seed"), [(True, 0), (False, 1)])
def test_versions_and_settings_are_part_of_the_table(quick: bool, seed: int) -> None:
    told = examine_all([], quick=quick, seed=seed).made_with
    assert_in(told, f"seed {seed}", f"mujoco {engine_version('mujoco')}")
    assert told.endswith(", quick") is quick


@pytest.mark.slow
def test_a_file_that_the_engine_alone_cannot_open_is_no_contradiction(tmp_path: Path) -> None:
    """Its mesh is in a ROS package, which the interface finds and MuJoCo does not look for."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
    arm = (
        '<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>'
        f'{inertia}</inertial><collision><geometry><mesh filename="package://r/m.obj"/></geometry>'
        '</collision></link><joint name="j" type="continuous"><parent link="base"/>'
        '<child link="arm"/></joint></robot>'
    )
    survey = examine_all(find([written_all(tmp_path, {"m.obj": mesh, "r.urdf": arm})]), quick=True)
    assert survey.models[0].backends["mujoco"].equals_engine is None
    assert not survey.wrong


def test_a_model_is_called_by_the_end_of_its_path_that_is_its_own() -> None:
    files = ["a/assets/hopper.xml", "b/assets/hopper.xml", "b/assets/ant.xml", "ant.xml"]
    ends = unique_ends(files)
    assert ends == {
        "a/assets/hopper.xml": "a/assets/hopper.xml",
        "b/assets/hopper.xml": "b/assets/hopper.xml",
        "b/assets/ant.xml": "assets/ant.xml",
        "ant.xml": "ant.xml",
    }
