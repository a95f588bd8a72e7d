"""Sweeps: the design, the cells, the dataset, and what happens when something dies."""

from __future__ import annotations

import dataclasses
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    EngineWarning,
    MissingEngineError,
    StateMachineError,
    UnknownNameError,
)
from statemachine.lab.recordings import record_scenario
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.sweep import (
    COLUMNS,
    Design,
    Sweep,
    Vary,
    design_of,
    prepare_sweep,
    read_cells,
    read_manifest,
    run_sweep,
)
from statemachine.lab.sweep.design import parse_vary
from statemachine.lab.sweep.folder import locked, write_or_check_manifest
from statemachine.lab.sweep.kinds import VariableNames, resolve_kinds
from statemachine.lab.sweep.rows import KEY, RowWriter, iter_cell_outcomes, remove_failed
from statemachine.lab.sweep.worker import environment_difference, run_batch

from .support.backends import BOTH
from .support.claims import assert_has, assert_in, refused
from .support.files import written
from .support.processes import files_below, in_its_own_python, soon, without_estimates
from .support.requirements import ROOT
from .support.sweeps import rows_of

pytest.importorskip("pyarrow")
pytest.importorskip("joblib")
pytest.importorskip("scipy")

POLICY = """
import os, signal, time

def still(model, data, gain=1.0, seed=0):
    return [gain * 0.001 + 0.01 * seed] * model.nu

AT_ONCE = os.path.join(os.path.dirname(__file__), "at_once")

def slow(model, data, gain=1.0):
    if not os.path.exists(AT_ONCE):
        time.sleep(0.02)

def ends(model, data, gain=1.0):
    if gain == 2:
        os.kill(os.getpid(), signal.SIGKILL)

def hangs(model, data, gain=1.0):
    while gain == 2:
        pass

def fails(model, data, gain=1.0):
    return [1 / (gain - 2)] * model.nu

def mended(model, data, gain=1.0):
    if gain > 2 and not os.path.exists(os.environ["MENDED"]):
        raise RuntimeError("not yet")
"""


@pytest.fixture
def policy(tmp_path: Path) -> str:
    """Return a file of functions."""
    return str(written(tmp_path / "policy.py", POLICY))


def small(what: str, *vary: str, **others: Any) -> Sweep:
    given = {"backends": ("mujoco",), "seconds": 0.05, "model": "so101", **others}
    return Sweep(what, vary=vary, **given)


def values(folder: Path) -> Any:
    """Return the dataset, without what is measured."""
    return read_cells(folder).drop_columns(["wall_seconds"])


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_an_engine_as_it_comes_is_a_backend_of_a_sweep(tmp_path: Path) -> None:
    """Its cells are those of `load(defaults="engine")`, in a folder that Windows takes, too."""
    engines = ("pybullet", "pybullet:engine")
    folder = tmp_path / "cells"
    with warnings.catch_warnings(action="ignore", category=EngineWarning):  # of what is dropped
        run_sweep(small("hold", backends=engines), folder, jobs=1)
        model = sm.load("so101", backend="pybullet", defaults="engine")
    alone = record_scenario(dataclasses.replace(scenario("hold"), seconds=0.05), model)
    rows = {row["backend"]: row["qpos"] for row in read_cells(folder).to_pylist()}
    assert rows.keys() == set(engines)
    assert rows["pybullet:engine"] == alone.qpos[-1].tolist() != rows["pybullet"]
    assert not [path for path in folder.rglob("*") if ":" in path.name]


def test_the_guide_lists_the_columns() -> None:
    page = (ROOT / "docs" / "sweeps.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `([^`]+)` \| (.*) \|$", page.partition("| column |")[2], re.M))
    for name, kind, unit, says in COLUMNS:
        assert rows[name] == f"{kind} | {unit} | {says}".replace("|  |", "| |")


Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(tmp_path: Path) -> Start:
    """Return what starts a command in a process and a group of its own."""

    def start(*words: str, program: Sequence[str] = ("-m", "statemachine")) -> Any:
        return subprocess.Popen(
            [sys.executable, *program, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            start_new_session=True,
        )

    return start


# What is varied.


@pytest.mark.parametrize(
    ("word", "values", "times"),
    [
        ("timestep=0.001,0.005", (0.001, 0.005), False),
        ("damping=0:1:3", (0.0, 0.5, 1.0), False),
        ("damping=0.5x:1.5x:11", tuple(round(0.5 + k / 10, 1) for k in range(11)), True),
        ("contacts=on,off", (True, False), False),
        ("integrator=Euler,RK4", ("Euler", "RK4"), False),
        ("model=a.xml,b.xml", ("a.xml", "b.xml"), False),
        ("gain=1", (1.0,), False),
    ],
)
def test_values_that_are_typed_are_read(word: str, values: tuple[Any, ...], times: bool) -> None:
    options = ("timestep", "damping", "contacts", "integrator")
    (vary,) = resolve_kinds(parse_vary([word]), VariableNames(options, parameters=("gain",)))
    assert_has(vary, values=values, times=times, bounds=None, numeric=isinstance(values[0], float))


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (("timestp=0.1",), "Did you mean 'timestep'"),
        (("timestep",), "--vary wants NAME="),
        (("timestep=0.001,on",), "mixes values"),
        (("timestep=0.001,0.001",), "a value twice"),
        (("timestep=0.001", "timestep=0.002"), "varied twice"),
        (("timestep=0.002:0.001:3",), "smaller number first"),
        (("timestep=0.001:0.002:1",), "count from 2"),
        (("timestep=0.001:0.002",), "say --samples N"),
        (("timestep=-1",), "timestep must"),
        (("timestep=1",), "longer than"),
        (("damping[elbow]=1",), "named 'elbow'"),
        (("damping=1", "damping[elbow_flex]=1"), "both varied"),
        (("mass.gripper=0.5x",), "--vary 'mass[gripper]=0.5x'"),
        (("meshes=1",), "meshes must be"),
        (("balance_inertia[base]=on",), "balance_inertia is varied"),
        (("gravity[w]=1",), "named 'w'"),
        (("qpos=1",), "qpos[JOINT]"),
        (("qpos[elbow]=1",), "named 'elbow'"),
        (("qpos[elbow_flex]=1x",), "the x out"),
        (("damping==1",), "got '=1'"),
        (("damping=",), "damping has an empty"),
        (("integrator=Euler4",), "no integrator named"),
        ({"vary": ("model=",), "model": None}, "model has an empty"),
        (("damping=0:1:20000", "frictionloss=0:1:20000"), "more than a sweep"),
        ({"samples": 8}, "none is varied"),
        ({"backends": ("mujocco",)}, "Did you mean 'mujoco'"),
        ({"spread": "1"}, "uncertainty reads"),
        ({"what": "policy.py:still", "vary": ("gian=1",)}, "Did you mean 'gain'"),
        ({"what": "policy.py:still", "vary": ("seed=1",)}, "named 'seed'"),
        ({"what": "policy.py:missing"}, "function missing"),
        ({"what": "policy.py:still", "keyframe": "away"}, "named 'away'"),
    ],
)
def test_what_is_refused_before_anything_runs(
    asked: Any, says: str, policy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(policy).parent)
    given = asked if isinstance(asked, dict) else {"vary": asked}
    sweep = small("hold")
    refused(
        (
            StateMachineError,
            re.escape(says),
            lambda: prepare_sweep(dataclasses.replace(sweep, **given)),
        )
    )


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"what": "holt"}, "Did you mean 'hold'"),
        ({"every": 5}, "--every is of"),
        ({"keyframe": "home"}, "--keyframe is of"),
        ({"seeds": 0}, "--seeds must"),
        ({"samples": -1}, "--samples must"),
        ({"moments": 0}, "--moments must"),
        ({"timeout": 0.0}, "--timeout must"),
        ({"vary": ("model=so101,so102",)}, "one model"),
    ],
)
def test_a_request_checks_itself(asked: Any, says: str) -> None:
    with pytest.raises(StateMachineError, match=re.escape(says)):
        dataclasses.replace(small("hold"), **asked)


TWO_NAMES = """
def walk(model, data, gain=1.0, friction=1.0):
    return None
"""

MOTOR = """
<mujoco><option timestep="0.01"/><worldbody><body name="link" pos="0 0 1">
  <joint name="hinge" type="hinge" axis="0 1 0"/>
  <geom name="rod" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/>
</body></worldbody><actuator><motor name="motor" joint="hinge"/></actuator></mujoco>
"""


@pytest.mark.parametrize(
    ("word", "kind", "says"),
    [
        ("friction=1,2", BadInputError, "a parameter of walk"),
        ("kp=1,2", BadInputError, "motor.xml has none"),
        ("gian=1,2", UnknownNameError, "Did you mean 'gain'"),
        ("gain[hinge]=1,2", BadInputError, "has no parts"),
    ],
)
def test_a_name_of_nothing_of_both_or_without_effect_is_refused_in_one_line(
    word: str, kind: type[Exception], says: str, tmp_path: Path
) -> None:
    function = f"{written(tmp_path / 'walk.py', TWO_NAMES)}:walk"
    model = str(written(tmp_path / "motor.xml", MOTOR))
    with pytest.raises(kind, match=re.escape(says)) as caught:
        prepare_sweep(small(function, word, model=model))
    message = str(caught.value)
    assert "\n" not in message
    if not word.startswith("gain["):  # what there is
        assert_in(message, "gain and friction", "motor.xml has", "actuation, gravity")
        assert "kp" not in message.partition("motor.xml has")[2]


def test_a_parameter_of_the_function_and_one_of_the_robot_vary_in_one_sweep(tmp_path: Path) -> None:
    function = f"{written(tmp_path / 'walk.py', TWO_NAMES.replace('friction', 'other'))}:walk"
    model = str(written(tmp_path / "motor.xml", MOTOR))
    ready = prepare_sweep(small(function, "gain=1,2", "mass[link]=0.5x,1x", model=model))
    assert [vary.kind for vary in ready.design.factors] == ["parameter", "option"]


def test_how_a_file_is_read_is_varied_where_it_is_loaded(tmp_path: Path) -> None:
    """One of its moments is larger than the two others together: MuJoCo refuses it as it is."""
    inertial = '<inertial pos="0 0 -0.1" mass="1" diaginertia="0.1 0.01 0.01"/><geom name="rod"'
    model = str(written(tmp_path / "odd.xml", MOTOR.replace('<geom name="rod"', inertial)))
    sweep = small("gravity", "balance_inertia=on,off", model=model)
    with pytest.warns(EngineWarning, match="balance_inertia: link had moments"):
        rows = {row["vary.balance_inertia"]: row for row in rows_of(sweep)}
    assert (rows[True]["status"], rows[False]["status"]) == ("done", "failed")
    assert rows[False]["error_class"] == "ModelError"


def test_many_cells_are_told_beforehand() -> None:
    assert any("20,000 cells" in line for line in prepare_sweep(small("hold", seeds=20_000)).notes)


RANGES = Vary("damping", bounds=(0.0, 2.0)), Vary("kp", bounds=(10.0, 20.0))


def test_the_points_of_a_design() -> None:
    listed = Vary("contacts", values=(True, False))
    few, more = (Design((RANGES[0], listed, RANGES[1]), samples=count) for count in (8, 16))
    points = {point.id: point.values for point in few.points()}
    assert len(points) == len(list(few.points())) == few.size == 16
    drawn = np.array([(one, two) for one, on, two in points.values() if on])
    # Each eighth of each range has one point: a Sobol sequence, not a random one.
    eighths = np.sort((drawn - [0, 10]) // [0.25, 1.25], axis=0)
    assert eighths.T.tolist() == [[*range(8)]] * 2
    # More samples keep the first ones.
    assert points.keys() < {point.id for point in more.points()}


def test_a_start_outside_the_range_of_its_joint_is_told_once() -> None:
    """It is legal, and usually a mistake."""
    low, high = sm.load("so101").jnt_range[sm.load("so101").joint_id("elbow_flex")]
    words = (
        "qpos[elbow_flex]=-3:1:3",
        f"qpos[elbow_flex]={low}:{high}:3",
        "qvel[elbow_flex]=-30:30:3",
    )
    said = [line for word in words for line in prepare_sweep(small("hold", word)).notes]
    (line,) = (line for line in said if "outside" in line)
    assert line.startswith("qpos[elbow_flex]=-3 ")
    assert f"{low:.4g} to {high:.4g} rad" in line


# The cells.


def test_a_cell_is_the_run_of_a_trace(scene: sm.Model, backend: str) -> None:
    sweep = Sweep("hold", ("timestep=0.004", "damping=0.5x"), (backend,), seconds=0.4)
    (row,) = rows_of(sweep)
    options = {"timestep": 0.004, "damping": 0.5 * scene.dof_damping}
    trace = record_scenario(scenario("hold"), scene, seconds=0.4, options=options)
    assert row["status"] == "done", row
    rows = np.searchsorted(trace.time, np.array(row["sample_time"]) - 1e-9)
    assert_has(
        row,
        steps=100,
        time=trace.time[-1],
        qpos=trace.qpos[-1].tolist(),
        qvel=trace.qvel[-1].tolist(),
        max_qvel=np.abs(trace.qvel[1:]).max(),
        sample_qpos=trace.qpos[rows].tolist(),
        energy=pytest.approx(trace["energy"][-1].sum(), abs=1e-9),
        first_touch=trace.time[trace["contact_row"][0]],
    )
    tip = trace["site_xpos"][rows, scene.site_id("gripperframe")]
    assert np.allclose(row["sample_tip"], tip, atol=1e-9)
    assert row["touch"]


def test_a_cell_does_not_depend_on_the_one_before(backend: str) -> None:
    """They use one Data, also of PyBullet, whose contacts remember."""
    ready = prepare_sweep(Sweep("hold", (), (backend,), 3, model="so101/scene_box", seconds=0.5))
    cells = list(ready.cells(backend))
    rows, reversed_rows = (run_batch(ready, order, False) for order in (cells, cells[::-1]))
    for row, other in zip(rows, reversed_rows[::-1], strict=True):
        assert {**row, "wall_seconds": 0} == {**other, "wall_seconds": 0}


@pytest.mark.usefixtures("bullet")
def test_a_seed_draws_the_same_start_everywhere() -> None:
    sweep = Sweep("hold", backends=("mujoco", "pybullet"), seeds=3, seconds=0.005, moments=1)
    rows = {(row["backend"], row["seed"]): np.array(row["qpos"]) for row in rows_of(sweep)}
    one, two = rows["mujoco", 1], rows["pybullet", 1]
    still = rows_of(Sweep("hold", backends=("mujoco",), seeds=2, seconds=0.005, spread="0"))
    assert np.array_equal(rows["mujoco", 0], still[0]["qpos"])
    assert still[0]["qpos"] == still[1]["qpos"]
    assert 1e-3 < np.abs(one - rows["mujoco", 0]).max() < np.deg2rad(1.1)
    assert np.abs(one - two).max() < 1e-3 < np.abs(one - rows["mujoco", 2]).max()


def test_a_start_a_place_and_a_parameter(policy: str) -> None:
    vary = ("qpos[elbow_flex]=0.5", "gravity[z]=0", "gain=1,2")
    rows = rows_of(small(f"{policy}:still", *vary, seconds=0.005))
    names = ("vary.qpos[elbow_flex]", "vary.gravity[z]", "vary.gain")
    assert [tuple(row[name] for name in names) for row in rows] == [(0.5, 0, 1), (0.5, 0, 2)]
    elbow = sm.load("so101").joint_id("elbow_flex")
    assert all(abs(row["qpos"][elbow] - 0.5) < 0.01 for row in rows)
    assert rows[0]["qpos"] != rows[1]["qpos"]


@pytest.mark.usefixtures("bullet")
def test_a_cell_that_fails_is_a_row(policy: str) -> None:
    both = Sweep("hold", ("integrator=euler",), ("mujoco", "pybullet"), seconds=0.05)
    rows = {row["backend"]: row for row in rows_of(both)}
    fast, fine = rows_of(small("hold", "qvel[elbow_flex]=1e9,0"))
    (late,) = rows_of(small("hold", "timestep=1e-4", timeout=1e-6))
    good, wrong = rows_of(small(f"{policy}:fails", "gain=1,2"))
    failed = rows["pybullet"], fast, late, wrong
    assert {row["status"] for row in (rows["mujoco"], fine, good)} == {"done"}
    assert [row["error_class"] for row in failed] == [
        "UnsupportedError", "DivergedError", "TimedOutError", "BadInputError",
    ]  # fmt: skip
    assert late["steps"] < 500
    assert "policy.py, line" in wrong["error"]


# The folder.


def test_a_request_is_kept_and_another_one_refused(tmp_path: Path) -> None:
    first = prepare_sweep(small("hold", "timestep=0.005,0.01"))
    write_or_check_manifest(tmp_path, first.manifest(), False)
    write_or_check_manifest(tmp_path, first.manifest(), False)
    told = read_manifest(tmp_path)
    assert (design_of(told), told["cells"], told["points"]) == (first.design, 2, 2)
    longer, more, other = (
        prepare_sweep(small("hold", vary, **others)).manifest()
        for vary, others in (
            ("timestep=0.005,0.01", {"seconds": 0.1}),
            ("timestep=0.005,0.01", {"seeds": 2}),
            ("damping=1", {}),
        )
    )
    settled = partial(write_or_check_manifest, tmp_path)
    refused(
        (BadInputError, r"seconds 0.05 there, 0.1 here", lambda: settled(longer, True)),
        (BadInputError, "varies timestep", lambda: settled(other, True)),
        (BadInputError, r"seeds 1 there, 2 here.*--extend", lambda: settled(more, False)),
    )
    settled(more, True)
    assert read_manifest(tmp_path)["design"]["seeds"] == 2


def test_two_drivers_are_refused(tmp_path: Path) -> None:
    with locked(tmp_path):
        code = (
            "from pathlib import Path; from statemachine.lab.sweep.folder import locked\n"
            f"with locked(Path({str(tmp_path)!r})): pass"
        )
        assert "another sweep runs" in in_its_own_python(code, tmp_path).stderr
    with locked(tmp_path):  # it was let go
        pass


@pytest.fixture
def two_rows(tmp_path: Path) -> tuple[RowWriter, list[Any]]:
    """Return what writes a sweep of two cells into the folder, and their rows."""
    sweep = prepare_sweep(small("hold", "timestep=0.005,0.01"))
    rows = run_batch(sweep, list(sweep.cells("mujoco")), False)
    return RowWriter(tmp_path, sweep.design.factors, {"request": {}}), rows


def test_rows_are_written_whole_and_read_in_order(two_rows: Any, tmp_path: Path) -> None:
    writer, rows = two_rows
    for row in rows:
        writer.add([row])
        writer.flush()
    place = tmp_path / "cells" / "backend=mujoco"
    (place / ".part-x.parquet.part-1.parquet").write_bytes(b"half")  # of a driver that was killed
    assert dict(iter_cell_outcomes(tmp_path)) == {row["cell"]: "done" for row in rows}
    table = read_cells(tmp_path)
    assert table["cell"].to_pylist() == sorted(row["cell"] for row in rows)
    both = zip(table["backend"].to_pylist(), table["vary.timestep"].to_pylist(), strict=True)
    assert set(both) == {("mujoco", 0.005), ("mujoco", 0.01)}
    assert table.column_names == [
        *[name for name, *_ in COLUMNS[:3]],
        "vary.timestep",
        *[name for name, *_ in COLUMNS[3:]],
        "backend",
    ]
    (place / "part-0.parquet").write_bytes(b"no parquet")
    refused((BadInputError, "cannot be read", lambda: dict(iter_cell_outcomes(tmp_path))))


@pytest.fixture
def dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a sweep of one file."""
    monkeypatch.setattr(sys.modules["statemachine.lab.sweep.rows"], "MIN_PAUSE", 60.0)
    run_sweep(small("hold", "damping=0.5x,1x", "timestep=0.005"), tmp_path / "s", jobs=1)
    return tmp_path / "s"


def _part(folder: Path) -> Path:
    (part,) = folder.glob("cells/*/*.parquet")
    return part


def test_a_flipped_bit_is_never_another_value(dataset: Path) -> None:
    part, draw = _part(dataset), random.Random(1)
    whole, says = part.read_bytes(), re.escape(f"{part} cannot be read")
    places = [
        *range(len(whole) - 200, len(whole)),
        *(draw.randrange(len(whole)) for _ in range(400)),
    ]
    for place in places:
        bad = bytearray(whole)
        bad[place] ^= 1 << draw.randrange(8)
        part.write_bytes(bad)
        refused(
            (BadInputError, says, lambda: read_cells(dataset)),
            (BadInputError, says, lambda: dict(iter_cell_outcomes(dataset))),
        )
    part.write_bytes(whole)
    assert read_cells(dataset).num_rows == 2


@pytest.mark.skipif(sys.platform != "linux", reason="counts the threads in /proc")
def test_a_dataset_is_read_without_another_thread(dataset: Path) -> None:
    """One of Arrow's that still has the file when Python ends would abort the process."""
    code = (
        "import os; from statemachine.lab.sweep import read_cells\n"
        "from statemachine.lab.sweep.rows import require_parquet\n"
        "require_parquet()\n"
        "before = len(os.listdir('/proc/self/task'))\n"
        "read_cells('s'); print(len(os.listdir('/proc/self/task')) - before)"
    )
    assert in_its_own_python(code, dataset.parent).stdout == "0\n"


def test_other_readers_can_verify_the_pages(dataset: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    part = _part(dataset)
    group = parquet.read_metadata(part).row_group(0)
    (energy,) = [
        column for k in range(group.num_columns)
        if (column := group.column(k)).path_in_schema == "energy"
    ]  # fmt: skip
    content = bytearray(part.read_bytes())
    content[energy.data_page_offset + energy.total_compressed_size - 60] ^= 1
    assert parquet.read_table(part, page_checksum_verification=True).num_rows == 2
    part.write_bytes(bytes(content))
    refused(
        (OSError, "CRC checksum", lambda: parquet.read_table(part, page_checksum_verification=True))
    )


def test_a_file_says_what_it_is_without_the_manifest(dataset: Path) -> None:
    schema = pytest.importorskip("pyarrow.parquet").read_schema(_part(dataset))
    facts = {field.name: field.metadata for field in schema}
    assert all(facts.values())
    assert b"multiple of the model's own" in facts["vary.damping"][b"meaning"]
    assert facts["vary.timestep"] == {b"unit": b"s", b"meaning": b"timestep of the model"}
    units = {"vary.damping": b"", "max_qvel": b"rad/s or m/s"}
    assert {name: facts[name][b"unit"] for name in units} == units
    told = json.loads(schema.metadata[KEY])
    assert_has(told["design"], vary=["damping=0.5x,1x", "timestep=0.005"], seeds=1)
    assert told["request"]["what"] == "hold"
    assert told["files"]


def test_every_kind_of_factor_has_a_meaning() -> None:
    told = {
        "model=so101": ("", "the model, by its name or file"),
        "qpos[elbow_flex]=0,1": ("rad or m", "qpos[elbow_flex] where the run starts"),
        "mass=1,2": ("", "mass, a keyword argument of the function"),
        "damping=1,2": ("N·m·s/rad or N·s/m", "damping of the model"),
        "contacts=on": ("", "contacts of the model"),
    }
    names = VariableNames(["damping", "contacts"], parameters=["mass"])
    found = resolve_kinds(parse_vary(told), names)
    assert [(vary.unit_on(), vary.meaning) for vary in found] == list(told.values())


def test_a_file_of_another_sweep_is_refused(dataset: Path, tmp_path: Path) -> None:
    run_sweep(small("hold", "armature=1x,2x"), tmp_path / "other", jobs=1)
    _part(tmp_path / "other").rename(_part(dataset).with_name("part-other.parquet"))
    refused((BadInputError, r"part-other\.parquet has other columns", lambda: read_cells(dataset)))


def test_a_folder_of_something_else_and_an_extra_that_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    thesis = written(tmp_path / "thesis.tex", "")
    run = partial(run_sweep, prepare_sweep(small("hold")))
    cluster = partial(run, tmp_path / "new", scheduler="tcp://127.0.0.1:1")
    monkeypatch.setitem(sys.modules, "distributed", None)
    refused(
        (BadInputError, r"holds thesis.tex and no sweep\.json", partial(run, tmp_path)),
        (FileExistsError, "", partial(run, thesis)),
        (MissingEngineError, r"\[cluster\]", cluster),
    )
    monkeypatch.setitem(sys.modules, "joblib", None)
    refused((MissingEngineError, r"\[sweep\]", lambda: prepare_sweep(small("hold"))))


def test_a_manifest_that_is_damaged_or_missing_is_one_line(tmp_path: Path) -> None:
    sweep = prepare_sweep(small("hold"))
    (tmp_path / "cells").mkdir()
    run, read = partial(run_sweep, sweep, tmp_path), partial(read_manifest, tmp_path)
    refused(
        (BadInputError, r"holds cells and no sweep\.json", run),
        (BadInputError, r"has no sweep\.json", read),
    )
    without_digest = json.dumps(sweep.manifest())
    for text in ("", "[1]", "null", without_digest[:200], without_digest, '{"sha256": 1}'):
        (tmp_path / "sweep.json").write_text(text)
        refused(*((BadInputError, r"sweep\.json is damaged", use) for use in (run, read)))
    (tmp_path / "sweep.json").write_text(json.dumps({**sweep.manifest(), "schema": 2}))
    refused((BadInputError, r"has schema 2; this version reads 5", read))


def test_no_changed_letter_of_a_manifest_is_another_sweep(tmp_path: Path) -> None:
    """Letters that make other valid JSON are tried, too: a digit for a digit, a key's letter."""
    sweep = prepare_sweep(small("hold", "damping=0.5x,1x", "qpos[elbow_flex]=0:1:3", seeds=2))
    write_or_check_manifest(tmp_path, sweep.manifest(), extend=False)
    path, draw = tmp_path / "sweep.json", random.Random(1)
    whole = path.read_bytes()
    assert read_manifest(tmp_path) == json.loads(json.dumps(sweep.manifest()))
    digits = [place for place, letter in enumerate(whole) if chr(letter).isdigit()]
    changes = [(draw.randrange(len(whole)), 1 << draw.randrange(8)) for _ in range(250)]
    changes += [(place, 1) for place in draw.sample(digits, 50)]
    for place, bits in changes:
        bad = bytearray(whole)
        bad[place] ^= bits
        path.write_bytes(bad)
        says = rf"^{re.escape(str(path))} is damaged"
        refused(
            (BadInputError, says, lambda: read_manifest(tmp_path)),
            (
                BadInputError,
                says,
                lambda: write_or_check_manifest(tmp_path, sweep.manifest(), True),
            ),
        )
    path.write_bytes(whole)
    write_or_check_manifest(tmp_path, sweep.manifest(), extend=False)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the limit stands in for a full disk")
def test_a_full_disk_is_one_line_and_nothing_is_half_written(tmp_path: Path) -> None:
    code = (
        "import resource, sys; from statemachine.cli import main\n"
        "from statemachine.lab.sweep import rows\n"
        "flush = rows.RowWriter.flush\n"
        "def full(self):\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048)); flush(self)\n"
        "rows.RowWriter.flush = full\n"
        "sys.exit(main(['sweep', 'hold', '--vary', 'damping=1:2:8', '--backend', 'mujoco',"
        " '--seconds', '0.05', '--jobs', '1', '--out', 'full']))"
    )
    done = in_its_own_python(code, tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1, done.stderr
    assert re.search(r"full/cells/backend=mujoco/part-\w+\.parquet: File too large", done.stderr)
    assert not [each for each in (tmp_path / "full").rglob("*part-*") if each.is_file()]


# Workers, and what dies.


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_jobs_do_not_change_results(tmp_path: Path) -> None:
    vary = ("timestep=0.005,0.01", "damping=1x,2x")
    sweep = Sweep("hold", vary, seeds=2, seconds=0.1, backends=BOTH)
    serial = sorted(rows_of(sweep), key=lambda row: row["cell"])
    for jobs, ran in ((1, 16), (2, 16), (2, 0)):
        summary = run_sweep(sweep, tmp_path / str(jobs), jobs=jobs)
        assert_has(summary, cells=16, done=16, ran=ran, missing=0)
        table = values(tmp_path / str(jobs))
        assert table.equals(values(tmp_path / "1"))
        for name in ("cell", "seed", "qpos", "sample_qpos", "sample_tip", "energy", "touch"):
            assert table[name].to_pylist() == [row.get(name) for row in serial]


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_worker_that_dies_or_hangs_is_a_row(policy: str, tmp_path: Path, jobs: int) -> None:
    for name, kind in (("ends", "WorkerEndedError"), ("hangs", "TimedOutError")):
        sweep = small(f"{policy}:{name}", "gain=1,2,3,4", seeds=2, timeout=3.0)
        out = tmp_path / name
        summary = run_sweep(sweep, out, jobs=jobs)
        assert (summary.done, dict(summary.failed), summary.missing) == (6, {kind: 2}, 0)
        assert (summary.failed_cells, summary.cells_before) == (2, 0)
        rows = read_cells(out).to_pylist()
        assert [r["vary.gain"] for r in rows if r["status"] == "failed"] == [2.0, 2.0]


NO_ALARM = """
import signal, time
from statemachine.lab.sweep import worker
del signal.setitimer
worker._GRACE = 0.1
with worker._limited(0.2, True):
    time.sleep(60)
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="it has none")
def test_without_an_alarm_a_function_that_hangs_ends_its_process(tmp_path: Path) -> None:
    """As on Windows."""
    assert in_its_own_python(NO_ALARM, tmp_path).returncode == 1


# The command, which waits for less than five seconds until it writes what is done.
WRITES_OFTEN = (
    "-c",
    "import sys; from statemachine_sim import main; from statemachine.lab.sweep import rows; "
    "rows.MIN_PAUSE = 0.5; sys.exit(main())",
)
CELLS = 30  # of which a worker does two or three in a second


def slow_sweep(policy: str, *more: str) -> list[str]:
    """Return the command of a sweep that takes some seconds until `at_once` lies beside it."""
    words = ["sweep", f"{policy}:slow", "so101", "--vary", f"gain=1:{CELLS}:{CELLS}"]
    return [*words, "--seconds", "0.1", "--backend", "mujoco", "--out", "out", *more]


def _group(leader: int) -> list[str]:
    """Return the processes of a group."""
    listed = subprocess.run(["ps", "-eo", "pgid,args"], capture_output=True, text=True, check=True)
    return [line for line in listed.stdout.splitlines() if line.split()[0] == str(leader)]


STOPPED = "statemachine: stopped; out has what was done. Type the same to go on\n"


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Provide a scheduler of Dask on this machine, with two workers."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as running:
        yield running


WRITTEN = "cells/*/part-*.parquet"
# How it runs, what is there when it is stopped, how, and its exit codes.
STOPS = [
    *(
        (jobs, begun, how, codes)
        for jobs in ("1", "2")
        for begun in ("sweep.json", WRITTEN)
        for how, codes in (
            ("SIGINT", {130}),
            ("SIGINT twice", {130, -signal.SIGINT}),
            ("SIGTERM", {-signal.SIGTERM}),  # of a batch system, to the driver alone
        )
    ),
    ("2", WRITTEN, "SIGKILL", {-9}),
    ("dask", WRITTEN, "SIGTERM", {-signal.SIGTERM}),
    ("dask", WRITTEN, "SIGINT", {130}),
]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no such signals")
@pytest.mark.parametrize(("jobs", "begun", "how", "codes"), STOPS)
def test_a_sweep_that_is_stopped_or_killed_keeps_what_was_done_and_goes_on(
    request: pytest.FixtureRequest,
    policy: str,
    tmp_path: Path,
    start: Start,
    jobs: str,
    begun: str,
    how: str,
    codes: set[int],
) -> None:
    on = ("--jobs", jobs)
    if jobs == "dask":
        on = ("--scheduler", request.getfixturevalue("cluster").scheduler_address)
    words, out = slow_sweep(policy, "--json", *on), tmp_path / "out"
    driver = start(*words, program=WRITES_OFTEN)
    assert soon(lambda: files_below(out, begun), 120)
    time.sleep(0.4)  # its workers begin, and must not say that they were interrupted
    for _ in how.split():
        (os.killpg if how.startswith("SIGINT") else os.kill)(
            driver.pid, getattr(signal, how.split(maxsplit=1)[0])
        )
        time.sleep(0.05)
    told, error = driver.communicate(timeout=120)  # its workers end by themselves
    said = [told, without_estimates(error)]
    assert driver.returncode in codes
    assert how == "SIGKILL" or said == ["", STOPPED if how.startswith("SIGINT") else ""]
    before = dict(iter_cell_outcomes(out))
    assert len(before) < CELLS
    assert before or begun == "sweep.json"
    assert soon(lambda: not _group(driver.pid), 120 if how == "SIGKILL" else 10)
    if begun == "sweep.json":
        return
    Path(policy).with_name("at_once").touch()
    second = start(*words)  # on the same workers, if they are Dask's
    told, error = second.communicate(timeout=120)
    assert second.returncode == 0, error
    assert_has(json.loads(told), done=CELLS, missing=0, ran=CELLS - len(before))
    cells = [cell for cell, _ in iter_cell_outcomes(out)]
    sweep = small(f"{policy}:slow", f"gain=1:{CELLS}:{CELLS}", seconds=0.1)
    assert sorted(cell.id for cell in prepare_sweep(sweep).cells("mujoco")) == sorted(cells)


@dataclasses.dataclass(frozen=True)
class FailingSweep:
    """A sweep of eight cells whose function fails for six gains until it is mended.

    Attributes:
        words: The command.
        out: Its folder.
        mended: The function fails no more where this file is.
        start: Starts the command with further words.
    """

    words: list[str]
    out: Path
    mended: Path
    start: Start

    def run(self, *more: str) -> dict[str, Any]:
        """Return the summary of a run, whose exit code tells whether a cell failed."""
        driver = self.start(*self.words, *more)
        told, error = driver.communicate(timeout=120)
        summary: dict[str, Any] = json.loads(told)
        assert driver.returncode == bool(summary["failed"]), error
        return summary

    def outcomes(self) -> Counter[str]:
        """Count the cells of the folder by their outcomes."""
        return Counter(dict(iter_cell_outcomes(self.out)).values())


@pytest.fixture
def failing(
    policy: str, tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> FailingSweep:
    """Return a sweep of which six of eight cells have failed."""
    mended = tmp_path / "mended"
    monkeypatch.setenv("MENDED", str(mended))
    words = ["sweep", f"{policy}:mended", "so101", "--vary", "gain=1:8:8", "--json"]
    words += ["--seconds", "0.05", "--backend", "mujoco", "--jobs", "1", "--out", "out"]
    sweep = FailingSweep(words, tmp_path / "out", mended, start)
    first = sweep.run()
    assert (first["done"], first["failed"], first["ran"]) == (2, {"BadInputError": 6}, 8)
    mended.touch()
    return sweep


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
class TestCellsThatFailed:
    def test_are_left_as_they_are_where_nobody_asks(self, failing: FailingSweep) -> None:
        assert failing.run()["ran"] == 0

    def test_stay_where_the_request_is_refused(self, failing: FailingSweep) -> None:
        assert failing.start(*failing.words, "--retry-failed", "--seeds", "2").wait() == 2
        assert failing.outcomes() == {"done": 2, "BadInputError": 6}

    def test_are_run_again_where_somebody_asks(self, failing: FailingSweep) -> None:
        last = failing.run("--retry-failed")
        assert (last["done"], last["failed"], last["ran"]) == (8, {}, 6)
        cells = [cell for cell, _ in iter_cell_outcomes(failing.out)]
        assert len(cells) == len(set(cells)) == 8
        assert read_cells(failing.out)["error"].null_count == 8

    def test_are_missing_where_it_was_killed_before_they_ran_again(
        self, failing: FailingSweep
    ) -> None:
        code = (
            "import os, signal, sys; import statemachine.lab.sweep\n"
            "sweep = sys.modules['statemachine.lab.sweep']\n"
            "from statemachine.cli import main\n"
            "sweep._batches = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
            "main(sys.argv[1:])"
        )
        killed = failing.start("--retry-failed", program=["-c", code, *failing.words])
        assert killed.wait() == -signal.SIGKILL
        assert failing.outcomes() == {"done": 2}
        assert failing.run("--retry-failed")["ran"] == 6


def test_the_rows_of_failed_cells_are_removed_alone(two_rows: Any, tmp_path: Path) -> None:
    writer, rows = two_rows
    writer.add([{**rows[0], "status": "failed", "error_class": "DivergedError"}, rows[1]])
    writer.flush()
    remove_failed(tmp_path)
    assert dict(iter_cell_outcomes(tmp_path)) == {rows[1]["cell"]: "done"}


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
def test_dask_with_a_worker_that_is_killed(policy: str, tmp_path: Path, cluster: Any) -> None:
    sweep = small(f"{policy}:slow", "gain=1:12:12", seconds=0.2)
    with cluster.get_client() as client:
        first = next(iter(client.run(os.getpid).values()))
        killed: list[int] = []

        def progress(_fraction: float) -> None:
            if not killed:
                killed.append(first)
                os.kill(first, signal.SIGKILL)

        summary = run_sweep(
            sweep, tmp_path / "dask", scheduler=cluster.scheduler_address, progress=progress
        )
    assert killed
    assert (summary.done, summary.missing, dict(summary.failed)) == (12, 0, {})
    Path(policy).with_name("at_once").touch()  # without the pauses, which change no value
    run_sweep(sweep, tmp_path / "here", jobs=1)
    assert values(tmp_path / "dask").equals(values(tmp_path / "here"))


def test_a_worker_with_another_version_or_file_is_told_of(policy: str) -> None:
    ready = prepare_sweep(small(f"{policy}:still"))
    assert environment_difference(ready, sm.__version__) == ""
    others = dataclasses.replace(ready, files={"so101": "", "none": ""}, places={
        "so101": "so101", "none": "none.xml"}, function="")  # fmt: skip
    assert environment_difference(others, "0") == "statemachine, so101 and none"
    Path(policy).write_text("")
    assert environment_difference(ready, sm.__version__) == f"{policy}:still"


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(sys.modules["statemachine.lab.sweep"], "SCHEDULER_TIMEOUT", 0.5)
    refused(
        (
            BadInputError,
            "no Dask scheduler",
            lambda: run_sweep(
                prepare_sweep(small("hold")), tmp_path, scheduler="tcp://127.0.0.1:9"
            ),
        )
    )
