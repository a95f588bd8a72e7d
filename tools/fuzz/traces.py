"""Flipped bits and changed parts of traces: the same numbers, or one clear error."""

from __future__ import annotations

import io
import json
import random
import tempfile
import tracemalloc
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import statemachine as sm
from statemachine.errors import MissingEngineError, TraceError
from statemachine.lab.recordings import RunMetadata, RunStart, Trace, files, record, write

from ._tally import Tally

TRIES = 3000
_MEMORY = 300e6  # bytes that reading may take: what a small file may unfold into, and a bit
_ODD = (None, True, -1, 10**400, 2**63, 1e308, float("nan"), "", "\ud800", "x" * 10**5, [], {})


def run(seed: int, tries: int) -> Tally:
    """Damage files of one trace, and read them."""
    draw, tally = random.Random(seed), Tally()
    trace = record(
        sm.load("so101/scene_box"),
        seconds=0.1,
        start=RunStart(keyframe="held"),
        metadata=RunMetadata(experiment="box"),
    )
    with tempfile.TemporaryDirectory() as folder:
        sources = [write(trace, Path(folder) / "box.npz")]
        with suppress(MissingEngineError):
            sources.append(write(trace, Path(folder) / "box.parquet"))
        good = {source: source.read_bytes() for source in sources}
        tracemalloc.start()
        for _ in range(tries):
            source = draw.choice(sources)
            change = draw.choice(CHANGES if source.suffix == ".npz" else CHANGES[:3])
            bad, exact = change(draw, good[source], trace)
            source.write_bytes(bad)
            tally.tried += 1
            problem = examine(source, trace, exact)
            if problem:
                tally.failures.append(f"{change.__name__} of {source.suffix}: {problem}")
        tracemalloc.stop()
    return tally


def examine(path: Path, trace: Trace, exact: bool) -> str:
    """Return what is wrong with how a damaged file is read, or "".

    Args:
        path: The file.
        trace: What it was.
        exact: Whether it must be that, if it opens.
    """
    tracemalloc.reset_peak()
    try:
        found = files.read(path)
    except TraceError as error:
        problem = "an error of several lines" if len(str(error).splitlines()) > 1 else ""
        problem = problem or ("a long error" if len(str(error)) > 500 else "")
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    else:
        problem = "other numbers" if exact and not _same(found, trace) else ""
    if tracemalloc.get_traced_memory()[1] > _MEMORY:
        problem = f"{tracemalloc.get_traced_memory()[1] / 1e6:.0f} MB"
    return problem


def _same(found: Trace, trace: Trace) -> bool:
    return set(found.columns) == set(trace.columns) and all(
        np.array_equal(found[name], trace[name], equal_nan=True) for name in trace.columns
    )


def flip(draw: random.Random, good: bytes, _trace: Trace) -> tuple[bytes, bool]:
    """Flip one bit, anywhere or near the end, where the lists of contents are."""
    bad = bytearray(good)
    far = len(bad) if draw.random() < 0.6 else min(len(bad), 6000)
    bad[len(bad) - 1 - draw.randrange(far)] ^= 1 << draw.randrange(8)
    return bytes(bad), True


def _scramble(draw: random.Random, good: bytes, _trace: Trace) -> tuple[bytes, bool]:
    """Change several bytes."""
    bad = bytearray(good)
    for _ in range(draw.choice([2, 10, 100])):
        bad[draw.randrange(len(bad))] = draw.randrange(256)
    return bytes(bad), True


def _cut(draw: random.Random, good: bytes, _trace: Trace) -> tuple[bytes, bool]:
    """Cut the file to its beginning or its end, or put something in between."""
    place = draw.randrange(len(good))
    between = draw.randbytes(20)
    return draw.choice([good[:place], good[place:], good[:place] + between + good[place:]]), True


def _column(draw: random.Random, _good: bytes, trace: Trace) -> tuple[bytes, bool]:
    """Give a column another shape, dtype or content, or put in an entry that is not an array."""
    name = draw.choice(list(trace.columns))
    array: Any = np.array(trace[name])
    odd = [
        array.astype(np.float16),
        array[:-1],
        array.T.copy(),
        array * 1e308,
        np.full_like(array, -5),
        np.array(["x"]),
        np.zeros(2 * 10**7, dtype=np.uint8),
        draw.randbytes(50),
        b"",
        _claim(draw, array),
    ]
    return _packed(trace, {}, {name: draw.choice(odd)}), False


def _claim(draw: random.Random, array: Any) -> bytes:
    """Return the bytes of an array that claims to be larger than it is."""
    out = io.BytesIO()
    shape = draw.choice([(10**12,), (-5,), (0, 10**18), (2**62, 2**62), array.shape])
    np.lib.format.write_array_header_1_0(
        out, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    return out.getvalue()


def _header(draw: random.Random, _good: bytes, trace: Trace) -> tuple[bytes, bool]:
    """Give one fact of the header, or an option, an odd value."""
    facts = json.loads(trace.header.as_json())
    name, value = draw.choice(list(facts)), draw.choice([*_ODD, [None] * 7, [[1], [2, 3]]])
    if draw.random() < 0.3:
        facts["options"] = {draw.choice(["self", "gravity", "substeps", "nope"]): value}
    elif draw.random() < 0.3:
        facts["provenance"][draw.choice(list(facts["provenance"]))] = value
    else:
        facts[name] = value
    return _packed(trace, facts, {}), False


def _packed(trace: Trace, facts: dict[str, Any], entries: dict[str, Any]) -> bytes:
    """Return the bytes of an npz with another header or other entries."""
    text = json.dumps(facts) if facts else trace.header.as_json()
    arrays: dict[str, Any] = dict(trace.columns)
    arrays["header"] = np.frombuffer(text.encode(), dtype=np.uint8)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in (arrays | entries).items():
            entry = io.BytesIO()
            if isinstance(value, bytes):
                entry.write(value)
            else:
                np.save(entry, value)
            archive.writestr(f"{name}.npy", entry.getvalue())
    return out.getvalue()


CHANGES: list[Callable[[random.Random, bytes, Trace], tuple[bytes, bool]]] = [
    flip,
    _scramble,
    _cut,
    _column,
    _header,
]
