"""Traces: what is recorded is what was run, and a file holds it whole."""

from __future__ import annotations

import csv
import dataclasses
import json
import platform
import sys
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    EngineError,
    MissingEngineError,
    TraceError,
    UnknownNameError,
)
from statemachine.interface import MOCAP
from statemachine.lab.recordings import (
    COLUMNS,
    CONTACTS,
    RunStart,
    Trace,
    export_csv,
    play,
    read,
    read_shipped_trace,
    record,
    record_scenario,
    shipped_trace_names,
    write,
)
from statemachine.lab.recordings.rerun import rerun_of
from statemachine.lab.runs.scenarios import SCENARIOS

from .support.backends import readable_arrays
from .support.claims import assert_has, assert_in, refused
from .support.motions import opened
from .support.pages import lesson_result
from .support.processes import Cli, runs_in_silence
from .support.requirements import ROOT
from .support.small_models import ROTOR_PENDULUM, mjcf, model_of
from .support.traces import same, traced

INPUTS = ("time", "qpos", "qvel", "ctrl")


def as_it_comes(name: str, **options: Any) -> Trace:
    """Return a short run of PyBullet with the defaults of the engine."""
    raw = sm.load("so101/scene", backend="pybullet", defaults="engine")
    return record_scenario(SCENARIOS[name], raw, seconds=0.1, defaults="engine", **options)


@pytest.fixture(scope="module")
def box() -> Trace:
    return traced("box", seconds=0.3)


# What is recorded is what was run.


def test_the_rows_are_those_of_a_bare_loop(backend: str) -> None:
    trace = traced("hold", backend)
    with opened(sm.load("so101/scene", backend=backend)) as (model, data):
        for k in range(101):
            data.ctrl[:] = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)
            assert trace.time[k] == data.time
            for name in ("qpos", "qvel", "ctrl"):
                assert trace[name][k].tobytes() == getattr(data, name).tobytes(), (name, k)
            sm.step(model, data)
    assert (len(trace), trace.header.rewritten) == (101, 0)


@pytest.mark.parametrize(("substeps", "integrator"), [(1, "Euler"), (3, "Euler"), (1, "RK4")])
@pytest.mark.filterwarnings("ignore:PyBullet. the integrator RK4")
def test_derived_columns_are_of_the_state_of_their_row(
    tmp_path: Path, backend: str, substeps: int, integrator: str
) -> None:
    file = sm.load("so101/scene").path
    scene = mjcf(
        "",
        f'<include file="{file}"/><compiler meshdir="{file.parent}/look"/>'
        f'<option integrator="{integrator}"/>',
    )
    model = model_of(tmp_path, scene, backend=backend).replace(substeps=substeps)
    trace = record_scenario(SCENARIOS["hold"], model, seconds=0.2)
    columns = "xpos", "xquat", "site_xpos", "site_xmat", "qfrc_bias", "qfrc_actuator"
    names = [name for name in columns if name in readable_arrays(model)]
    with sm.make_data(model) as data:
        for row in (0, 7, 20, len(trace) - 1):
            data.qpos, data.qvel, data.ctrl = trace.qpos[row], trace.qvel[row], trace.ctrl[row]
            sm.forward(model, data)
            for name in names:
                assert np.allclose(trace[name][row], getattr(data, name), atol=1e-9), (name, row)
    # Nothing else would show a column that is one row late.
    assert not np.allclose(trace["site_xpos"][7], trace["site_xpos"][8], atol=1e-6)


def test_what_is_read_as_a_run_goes_is_that_of_its_repetition(backend: str) -> None:
    model = sm.load("so101/scene_box", backend=backend)
    run = rerun_of(SCENARIOS["box"], model, seconds=0.2)
    repeated, read_along = run.record(), run.record(derived="run")
    assert len(repeated["contact_row"])
    assert same(read_along, repeated)


def test_contacts_are_those_of_the_step(box: Trace) -> None:
    with opened(sm.load("so101/scene_box"), keyframe="held") as (model, data):
        for row in range(30):
            data.ctrl[:] = box.ctrl[row]
            sm.step(model, data)
            mine = box["contact_row"] == row
            assert box["contact_geom"][mine].tolist() == data.contacts.geom.tolist()
            assert box["contact_force"][mine].tobytes() == data.contacts.force.tobytes()
    touches = box.touches()
    assert set(touches) == {"gripper on box", "moving_jaw_so101_v1 on box"}
    assert all(rows.all() for rows in touches.values())


@pytest.mark.parametrize("defaults", ["model", "engine"])
def test_a_short_run_is_the_beginning_of_a_long_one(
    backend: str, defaults: Literal["model", "engine"]
) -> None:
    model = sm.load("so101/scene_box", backend=backend, defaults=defaults)
    # Energies stand on what `load` was given.
    long = record_scenario(SCENARIOS["box"], model, seconds=0.5, defaults=defaults)
    short = record_scenario(SCENARIOS["box"], model, seconds=0.25, defaults=defaults)
    # The last row of one is in the middle of the other: its contacts have a past.
    kept = long["contact_row"] < len(short)
    for name in short.columns:
        rows = long[name][kept] if name.startswith("contact") else long[name][: len(short)]
        if name == "energy" or backend == "pybullet":
            assert rows.tobytes() == short[name].tobytes(), name
        else:
            assert np.allclose(rows, short[name], rtol=1e-12, atol=1e-12, equal_nan=True), name


def test_energies_of_a_pendulum_are_those_on_paper(tmp_path: Path) -> None:
    trace = record(
        model_of(tmp_path, ROTOR_PENDULUM), None, 0.5, start=RunStart(qpos=[1.0], qvel=[0.7])
    )
    angle, speed = trace.qpos[:, 0], trace.qvel[:, 0]
    inertia = 0.1 + 2 * 0.5**2 + 0.3  # body about the joint, and rotor
    assert np.allclose(trace["energy"][:, 0], 0.5 * inertia * speed**2, rtol=1e-12)
    assert np.allclose(trace["energy"][:, 1], -2 * 9.81 * 0.5 * np.cos(angle), rtol=1e-12)
    assert trace.header.energy_by.startswith("mujoco ")


@pytest.mark.usefixtures("bullet")
def test_energies_of_both_engines_are_measured_by_one_yardstick() -> None:
    one, two = traced("droop"), traced("droop", "pybullet")
    assert one["energy"][0].tolist() == two["energy"][0].tolist()
    # It has no gravity there; its states are weighed by the model's.
    assert as_it_comes("droop")["energy"][0].tolist() == one["energy"][0].tolist()
    # Unless it was given one: then that is both sides'.
    moon = {"gravity": [0.0, 0.0, -1.62]}
    traces = traced("droop", options=moon), as_it_comes("droop", options=moon)
    there = [trace["energy"][0, 1] for trace in traces]
    assert there[0] == there[1] == pytest.approx(one["energy"][0, 1] * 1.62 / 9.81, rel=1e-12)


@pytest.mark.usefixtures("bullet")
def test_an_engine_that_does_not_tell_leaves_nan() -> None:
    trace = as_it_comes("hold")
    assert np.isnan(trace["qfrc_contact"]).all()
    assert np.isfinite(trace["site_xpos"]).all()
    assert trace.header.label.endswith("engine defaults")


# Controllers.


def test_a_controller_sees_time_and_data_and_gives_ctrl(mujoco_arm: sm.Model) -> None:
    seen: list[float] = []

    def controller(_model: sm.Model, data: sm.Data) -> list[float] | None:
        seen.append(data.time)
        return [0.1] * 6 if data.qpos[0] < 0.05 else None

    trace = record(mujoco_arm, controller, 0.1)
    assert len(seen) == len(trace) == 21
    assert (trace.ctrl[0].tolist(), trace.header.experiment) == ([0.1] * 6, "controller")


@pytest.mark.parametrize(
    ("gives", "says"),
    [
        (0.3, "takes 6 numbers"),
        ([0.1] * 5, "takes 6 numbers"),
        ([float("nan")] * 6, "is not a finite number"),
        ("up", "real numbers"),
        ([1j] * 6, "real numbers"),
        (np.full(6, np.nan), "ctrl"),
    ],
)
def test_what_is_no_ctrl_is_said_with_the_time(arm: sm.Model, gives: Any, says: str) -> None:
    """Also in the last row, after the last step."""
    for at in (0.025, 0.1):

        def late_one(_model: sm.Model, data: sm.Data, at: float = at) -> Any:
            return gives if data.time > at - 4e-3 else None

        late = partial(record, arm, late_one, 0.1)
        told = str(refused((BadInputError, says, late)))
        assert says == "ctrl" or f"{at:.3f} s" in told


def test_a_controller_that_kicks_is_repeated_exactly(scene: sm.Model) -> None:

    def kick(_model: sm.Model, data: sm.Data) -> None:
        if abs(data.time - 0.1) < 1e-6:
            data.qvel[1] = 3.0

    trace = record(scene, kick, 0.3)
    assert trace.header.rewritten == 1
    row = int(np.argmax(np.abs(trace.qvel[:, 1])))
    assert (trace.qvel[row, 1], trace.time[row]) == (3.0, pytest.approx(0.1, abs=1e-6))


def test_an_engine_that_does_not_repeat_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from statemachine.lab.runs import drive

    honest, calls = drive.step, []

    def restless(model: sm.Model, data: sm.Data) -> None:
        calls.append(1)
        honest(model, data)
        data.qpos[0] += 1e-15 * len(calls)

    monkeypatch.setattr(drive, "step", restless)
    refused(
        (EngineError, "could not be repeated", lambda: traced("hold", seconds=0.1)),
        (EngineError, "could not be repeated", lambda: record(sm.load("so101"), None, 0.1)),
    )


def test_a_run_that_diverges_keeps_its_rows(mujoco_arm: sm.Model, tmp_path: Path) -> None:

    def wild(_model: sm.Model, data: sm.Data) -> None:
        if data.time > 0.05:
            data.qvel[:] = 9e9

    trace = record(mujoco_arm, wild, 0.5)
    assert trace.header.ended
    assert 10 < len(trace) < 101
    assert same(trace, read(write(trace, tmp_path / "wild.npz")))


def test_it_starts_where_it_is_told(mujoco_box: sm.Model) -> None:
    assert record(mujoco_box, None, 0.01, start=RunStart(keyframe="held")).header.keyframe == "held"
    with opened(mujoco_box, "held", nstep=20) as (_, data):
        state = sm.get_state(mujoco_box, data)
        sm.step(mujoco_box, data)
        after = data.qpos.copy()
    assert (
        record(mujoco_box, None, 0.01, start=RunStart(state=state)).qpos[1].tobytes()
        == after.tobytes()
    )
    refused(
        (
            BadInputError,
            "not from both",
            lambda: record(mujoco_box, None, 0.01, start=RunStart(state=state, keyframe="held")),
        ),
        (
            UnknownNameError,
            "",
            lambda: record(mujoco_box, None, 0.01, start=RunStart(keyframe="hold")),
        ),
    )


def test_the_seed_makes_the_waves() -> None:
    one, again, other = (traced("waves", seed=seed) for seed in (3, 3, 4))
    assert same(one, again)
    assert not np.array_equal(one.ctrl, other.ctrl)
    assert one.header.provenance.seed == 3
    low, high = np.array(one.header.ctrlrange).T
    assert ((one.ctrl >= low) & (one.ctrl <= high)).all()


# Playing on another engine.


def test_played_on_its_own_engine_it_is_the_same_run(backend: str) -> None:
    trace = traced("waves", backend)
    assert same(trace, play(trace, sm.load("so101", backend=backend)))


def test_played_with_another_timestep_commands_hold() -> None:
    trace = traced("waves")
    finer = play(trace, sm.load("so101").replace(timestep=0.0025))
    assert len(finer) == 2 * len(trace) - 1
    assert np.array_equal(finer.ctrl[::2], trace.ctrl)
    assert np.array_equal(finer.ctrl[1::2], trace.ctrl[:-1])


# Files.


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
@pytest.mark.parametrize("name", ["box", "droop"])
def test_a_file_holds_every_bit(name: str, suffix: str, tmp_path: Path) -> None:
    trace = traced(name, seconds=0.2)
    path = write(trace, tmp_path / f"one{suffix}")
    again = read(path)
    assert set(again.columns) == set(trace.columns) == {*COLUMNS, *CONTACTS} - {*MOCAP}
    for column in trace.columns:
        assert_has(again[column], dtype=trace[column].dtype, shape=trace[column].shape)
    assert same(trace, again)
    assert again.header == dataclasses.replace(trace.header, recorded=True)
    assert write(trace, tmp_path / f"two{suffix}").read_bytes() == path.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == [f"one{suffix}", f"two{suffix}"]


def test_opening_one_needs_no_engine(tmp_path: Path, box: Trace) -> None:
    path = write(box, tmp_path / "box.npz")
    code = (
        "import sys\n"
        "for name in ('mujoco', 'pybullet', 'pinocchio'): sys.modules[name] = None\n"
        "from statemachine.lab.recordings import read\n"
        "from statemachine.lab.compare import compare\n"
        f"trace = read({str(path)!r})\n"
        "print(len(trace), compare(trace, trace).agrees)"
    )
    runs_in_silence(code, tmp_path, f"{len(box)} True\n")


def test_a_table_reader_understands_the_parquet_file(tmp_path: Path, box: Trace) -> None:
    from pyarrow import parquet

    path = write(box, tmp_path / "box.parquet")
    table = parquet.read_table(path)
    assert table["qpos"][3].as_py() == box.qpos[3].tolist()
    mine = box["contact_row"] == 3
    assert table["contact_dist"][3].as_py() == box["contact_dist"][mine].tolist()
    assert parquet.ParquetFile(path).metadata.row_group(0).column(0).compression == "ZSTD"


def test_without_pyarrow_one_line_names_the_extra(
    tmp_path: Path, box: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    refused(
        (
            MissingEngineError,
            r"\[parquet\]",
            lambda: write(box, tmp_path / "box.parquet"),
        )
    )
    assert not list(tmp_path.iterdir())


def test_what_is_no_trace_at_all(tmp_path: Path, box: Trace) -> None:
    good = write(box, tmp_path / "box.npz").read_bytes()
    (tmp_path / "folder.npz").mkdir()
    says = {
        "box.csv": r"\.npz or \.parquet",
        "empt.npz": r"there is no trace .*Did you mean empty.npz",
        "hold.npz": r"statemachine trace record hold -o .*hold.npz",
        "folder.npz": "is a folder",
    }
    for name, content in (("empty", b""), ("text", b"hello"), ("half", good[: len(good) // 2])):
        for suffix in (".npz", ".parquet"):
            (tmp_path / f"{name}{suffix}").write_bytes(content)
            says[f"{name}{suffix}"] = "is not a trace"
    refused(
        *(
            ((BadInputError, TraceError), words, partial(read, tmp_path / name))
            for name, words in says.items()
        )
    )


def test_csv_has_a_name_for_every_number(tmp_path: Path, box: Trace) -> None:
    main, contacts = export_csv(box, tmp_path / "box.csv")
    with main.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(box)
    for name, value in {
        "qpos.elbow_flex": box.qpos[5, 2],
        "qpos.box.qw": box.qpos[5, 9],
        "qvel.box.wz": box.qvel[5, 11],
        "energy.potential": box["energy"][5, 1],
        "site_xpos.gripperframe.z": box["site_xpos"][5, box.header.sites.index("gripperframe"), 2],
    }.items():
        assert float(rows[5][name]) == value, name
    widths = sum(int(np.prod(box.header.shape(name))) for name in COLUMNS if name in box)
    assert len(rows[0]) == widths
    with contacts.open(encoding="utf-8") as file:
        touching = list(csv.DictReader(file))
    assert len(touching) == len(box["contact_row"])
    assert {row["body_2"] for row in touching} == {"box"}
    assert float(touching[9]["force.normal"]) == box["contact_force"][9, 0]


def test_what_a_trace_cannot_do_is_refused(box: Trace, tmp_path: Path) -> None:
    bare = model_of(tmp_path, mjcf("<body><joint/><geom size='.1'/></body>"))
    refused(
        (BadInputError, "no actuators", lambda: record_scenario(SCENARIOS["hold"], bare)),
        (TraceError, "other joints", lambda: play(traced("waves"), sm.load("so101/scene_box"))),
        (ValueError, "read-only", lambda: box.qpos.fill(1.0)),
        (UnknownNameError, "qpos", lambda: box["qposs"]),
    )


# What comes with the package.


def test_each_scenario_was_recorded_with_both_defaults() -> None:
    expected = {f"{name}.pybullet{end}" for name in SCENARIOS for end in ("", ".engine")}
    assert set(shipped_trace_names()) == {*expected, _of_a_release()}


def test_a_shipped_trace_is_read_by_scenario_backend_and_defaults() -> None:
    assert_has(
        read_shipped_trace("hold", "pybullet", "engine").header, recorded=True, defaults="engine"
    )
    refused((UnknownNameError, "recorded trace", lambda: read_shipped_trace("hold", "mujoco")))


def _of_a_release() -> str:
    """Return the name of the one shipped trace that an older release recorded."""
    (name,) = (name for name in shipped_trace_names() if "==" in name)
    return name


@pytest.mark.parametrize("end", ["", ".engine"])
@pytest.mark.parametrize(
    "scenario",
    [name if name == "droop" else pytest.param(name, marks=pytest.mark.slow) for name in SCENARIOS],
)
@pytest.mark.usefixtures("bullet")
def test_a_recorded_trace_is_what_the_engine_does_here(
    scenario: str, end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On any processor, Python and distribution of PyBullet, to nine digits.

    Whether a compiler for another kind of processor stays within them was not measured.
    """
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        pytest.skip("recorded on Linux x86-64: what another compiler gives was not measured")
    _is_as_recorded(f"{scenario}.pybullet{end}", monkeypatch)


@pytest.mark.slow
@pytest.mark.network
@pytest.mark.usefixtures("old_releases")
def test_the_recorded_run_of_an_older_release_is_what_it_does(
    monkeypatch: pytest.MonkeyPatch, mujoco_scene: sm.Model
) -> None:
    _is_as_recorded(_of_a_release(), monkeypatch)
    here = lesson_result("hold", mujoco_scene, further=True).older
    monkeypatch.setenv("STATEMACHINE_ENGINES", "nowhere")
    recorded = dataclasses.asdict(lesson_result("hold", mujoco_scene, further=True).older)
    assert recorded["recorded"]
    for name, value in dataclasses.asdict(here).items():
        if isinstance(value, float):
            assert recorded[name] == pytest.approx(value, rel=1e-6, abs=1e-6), name
        elif name != "recorded":
            assert recorded[name] == value, name
    assert np.degrees(here.gap) == pytest.approx(6.12, abs=0.01)


def _is_as_recorded(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "models" / "so101")
    import make_traces  # pyright: ignore[reportMissingImports]

    assert set(make_traces.RUNS) == set(shipped_trace_names())
    trace, kept = make_traces.recorded(name), read(make_traces.FOLDER / f"{name}.npz")
    assert kept.header.provenance.model_sha256 == trace.header.provenance.model_sha256
    for column in INPUTS:
        np.testing.assert_allclose(trace[column], kept[column], rtol=1e-9, atol=1e-9)
    for column in set(trace.columns) - set(INPUTS):  # kept in single precision
        rounded = trace[column].astype(np.float32)
        np.testing.assert_allclose(rounded, kept[column], rtol=1e-6, atol=1e-6)


# The command.


def test_the_command_records_plays_shows_and_exports(here: Cli, tmp_path: Path) -> None:
    done = here("trace", "record", "hold", "--seconds", "0.2")
    assert (done.returncode, done.stderr) == (0, "")
    assert_in(done.stdout, "hold.mujoco.npz", "41 rows")
    header = json.loads(here("trace", "show", "hold.mujoco.npz", "--json").stdout)
    assert header["command"] == "statemachine trace record hold --seconds 0.2"
    here("trace", "play", "hold.mujoco.npz", "-o", "again.parquet", code=0)
    assert same(read(tmp_path / "again.parquet"), read(tmp_path / "hold.mujoco.npz"))
    assert here("trace", "csv", "again.parquet").stdout.split() == [
        "again.csv", "again.contacts.csv",
    ]  # fmt: skip
