"""Files of traces that are damaged, made by strangers to do harm, or cut off by a kill."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import random
import tracemalloc
import zipfile
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.lib import format as npy

import statemachine as sm
from statemachine import atomic_files as whole
from statemachine.errors import TraceError
from statemachine.lab.recordings import (
    RunMetadata,
    RunStart,
    Trace,
    export_csv,
    read,
    record,
    write,
)

from .support.claims import refused
from .support.files import written
from .support.patches import around
from .support.processes import Cli
from .support.traces import cut, same


@pytest.fixture(scope="module")
def box() -> Trace:
    return record(
        sm.load("so101/scene_box"),
        seconds=0.1,
        start=RunStart(keyframe="held"),
        metadata=RunMetadata(experiment="box"),
    )


def npz(path: Path, trace: Trace, changes: Any = None, **entries: Any) -> Path:
    """Return a trace's file with another header and other entries.

    These are bytes as they are, arrays, what makes another array of one, or None for none; behind
    a slash stands a name as it is.
    """
    facts = json.loads(trace.header.as_json()) | (changes or {})
    arrays: dict[str, Any] = {name: np.array(array) for name, array in trace.columns.items()}
    arrays["header"] = np.frombuffer(json.dumps(facts).encode(), dtype=np.uint8)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in (arrays | entries).items():
            if value is not None:
                array: Any = value(arrays[name]) if callable(value) else value
                with archive.open(name[1:] if name[0] == "/" else f"{name}.npy", "w") as out:
                    out.write(value) if isinstance(value, bytes) else np.save(out, array)
    return path


def put(value: Any, place: int = -1) -> Any:
    """Return what puts a number into an array."""

    def change(array: np.ndarray) -> np.ndarray:
        array.flat[place] = value
        return array

    return change


def claim(*shape: int) -> bytes:
    """Return the first bytes of an array of this shape, and no more."""
    out = io.BytesIO()
    npy.write_array_header_1_0(out, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return out.getvalue()


# Parquet: a checksum of content.


def test_a_parquet_file_that_others_changed_is_refused(box: Trace, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = write(box, tmp_path / "box.parquet")
    table = parquet.read_table(path)
    parquet.write_table(table, path, compression="gzip")  # another packing of the same numbers
    assert same(read(path), box)
    parquet.write_table(table.drop_columns(["qfrc_bias"]), path)
    refused((TraceError, "damaged", lambda: read(path)))


def test_no_flipped_bit_of_an_archives_list_hides_a_column(box: Trace, tmp_path: Path) -> None:
    path = write(box, tmp_path / "box.npz")
    good = path.read_bytes()
    place = good.rindex(b"PK\x01\x02", 0, good.rindex(b"PK\x01\x02"))
    for offset in (30, 32):  # the lengths of what may follow a name: extra field, comment
        for bit in range(8):
            bad = bytearray(good)
            bad[place + offset] ^= 1 << bit
            path.write_bytes(bad)
            refused((TraceError, "", lambda: read(path)))


# What a stranger's file may do.


def test_a_small_file_does_not_take_much_memory(box: Trace, tmp_path: Path) -> None:
    claims = {
        name: claim(10_000_000, *box.header.shape(name))
        for name in box.columns
        if not name.startswith("contact")
    }
    files = [
        (TraceError, says, partial(read, npz(tmp_path / f"{name}.npz", box, **entries)))
        for name, entries, says in (
            ("header", {"header": np.zeros(100_000_000, dtype=np.uint8)}, "header of"),
            ("column", {"qpos": np.zeros(100_000_000, dtype=np.uint8)}, "shape"),
            ("rows", claims, "unfolds into"),
        )
    ]
    tracemalloc.start()
    try:
        refused(*files)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("header", "entries", "says"),
    [
        *(
            (header, {}, says)
            for header, says in [
                ({"schema": 99}, "this version reads 2"),
                ({"joints": ["a"]}, "entries"),
                ({"provenance": {}}, "not a header"),
                ({"joints": ["gripper"] * 7}, "called 'gripper'"),
                ({"jnt_qposadr": [12] * 7}, "place in qpos"),
                ({"jnt_type": [9] * 7}, "jnt_type of the trace"),
                ({"body_parentid": [99] * 10}, "not there"),
                # What no run writes.
                *(
                    (change, "of the trace is")
                    for change in (
                        {"nq": -1},
                        {"nq": "7"},
                        {"timestep": 0},
                        {"options": {"self": 1}},
                        {"options": {"damping": [[1, 2], [3]]}},
                        {"options": {"damping": {"a": 1}}},
                        {"options": {"timestep": float("nan")}},
                        {"options": {"gravity": [1e308, 0, 0]}},
                        {"gravity": [10**400, 0, 0]},
                        {"gravity": [float("nan")] * 3},
                        {"rewritten": 10**4000},
                        {"experiment": "\ud800"},
                        {"experiment": "x" * 10**6},
                    )
                ),
            ]
        ),
        *(
            ({}, entries, says)
            for entries, says in [
                ({"header": None}, "no header"),
                ({"header": np.frombuffer(b"{}", dtype=np.uint8)}, "schema None"),
                ({"header": np.frombuffer(b"\xff\xfe", dtype=np.uint8)}, "not a trace"),
                ({"qpos": np.zeros((3, 3))}, "shape"),
                ({"qpos": np.array(["a"])}, "not numbers"),
                ({"qpos": np.array([{}], dtype=object)}, "not numbers"),
                ({"qpos": None}, "column 'qpos'"),
                ({"time": None}, "a column 'time'"),
                ({"qvel": put(np.nan)}, "finite number"),
                ({"contact_row": put(0)}, "ascending"),
                ({"contact_geom": put(999)}, "not there"),
                ({"contact_dist": None}, "contacts only"),
                ({"speed": np.zeros(3)}, "no column 'speed'"),
                ({"qpos": b"hello"}, "not a trace"),  # what is not an array
                ({"/notes.txt": b"hello"}, ""),
                ({"/header": b"{}"}, ""),  # beside header.npy
                ({"header": np.frombuffer(b"[" * 100_000, dtype=np.uint8)}, "not a header"),
                ({"time": claim(10**14)}, "shape"),
                ({"qpos": claim(10**12)}, "shape"),
                ({"qpos": claim(0, 10**18)}, "shape"),
                ({"qpos": claim(21, 13)}, "not a trace"),  # and nothing after it
                ({"qpos": b"\x93NUMPY\x01\x00\x10\x00__import__('os')"}, "not a trace"),
                ({"qpos": b"\x93NUMPY\x09\x00\x10\x00"}, "npy version"),
                ({"time": put(0.005, 2)}, "after row 1"),
                # Numbers that no run gives.
                *(
                    ({name: put(value, 3)}, f"column '{name}' has an entry")
                    for name, value in (
                        ("qpos", 1e308),
                        ("ctrl", 1e300),
                        ("xpos", 1e308),
                        ("xpos", np.inf),
                    )
                ),
            ]
        ),
    ],
)
def test_a_broken_file_is_one_line(
    header: Any, entries: Any, says: str, box: Trace, tmp_path: Path
) -> None:
    path = npz(tmp_path / "bad.npz", box, header, **entries)
    told = str(refused((TraceError, says, lambda: read(path))))
    assert "bad.npz" in told
    assert len(told) < 250


def test_a_run_that_would_take_days_is_not_begun(box: Trace, tmp_path: Path, cli: Cli) -> None:
    npz(tmp_path / "slow.npz", box, {"options": {"substeps": 10**9}})
    done = cli("trace", "play", "slow.npz", code=2)
    assert "at most" in done.stderr
    assert len(done.stderr.splitlines()) <= 2  # one says that the model's digest is another


def test_what_cannot_be_read_again_is_not_written(box: Trace, tmp_path: Path) -> None:
    odd = Trace(dataclasses.replace(box.header, description="\udcff"), box.columns)
    refused((TraceError, "description", lambda: write(odd, tmp_path / "odd.npz")))
    assert list(tmp_path.iterdir()) == []


# Writes that are cut off.


def test_what_a_killed_write_left_is_removed_by_the_next(box: Trace, tmp_path: Path) -> None:
    left = tmp_path / ".box.npz.part-abcdefgh.npz"
    mine = [tmp_path / ".box.npz.notes", tmp_path / ".other.npz.part-abcdefgh.npz"]
    for file in (left, *mine):
        file.write_bytes(b"half")
        os.utime(file, (0, 0))
    with whole.beside(tmp_path / "box.npz") as (name,):  # a writer that is alive
        write(box, tmp_path / "box.npz")
        assert os.path.exists(name)
        assert not left.exists()
    assert sorted(tmp_path.iterdir()) == sorted([*mine, tmp_path / "box.npz"])


def test_a_csv_and_its_contacts_are_replaced_together(
    box: Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, contacts = (written(tmp_path / f"box.{end}", "old") for end in ("csv", "contacts.csv"))
    seen: list[set[str]] = []

    @around(whole.os, "replace")
    def watched(right: Any, *paths: Path) -> None:
        seen.append({f.name for f in (table, contacts) if f.exists() and f.read_text() == "old"})
        right(*paths)

    watched(monkeypatch)
    assert export_csv(box, table) == [table, contacts]
    assert seen == [{"box.csv"}, set()]  # never a new table beside old contacts
    assert "force.normal" in contacts.read_text()


def test_a_csv_stays_where_its_contacts_cannot_be_written(
    box: Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, contacts = export_csv(box, tmp_path / "box.csv")
    before = table.read_bytes(), contacts.read_bytes()
    monkeypatch.setattr(
        "statemachine.lab.recordings.files.write_contacts",
        Mock(side_effect=OSError(28, "No space left on device")),
    )
    refused((OSError, "No space", lambda: export_csv(cut(box, 2), table)))
    assert (table.read_bytes(), contacts.read_bytes()) == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["box.contacts.csv", "box.csv"]


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_no_flipped_bit_of_a_trace_is_another_trace(
    suffix: str, box: Trace, tmp_path: Path
) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path, draw = write(box, tmp_path / f"box{suffix}"), random.Random(1)
    whole = path.read_bytes()
    wanted, refusals = read(path), 0
    for _ in range(250):
        bad = bytearray(whole)
        bad[draw.randrange(len(whole))] ^= 1 << draw.randrange(8)
        path.write_bytes(bad)
        try:
            found = read(path)
        except TraceError:
            refusals += 1
        else:
            assert same(found, wanted)
            assert found.header == wanted.header
    assert refusals > 200
