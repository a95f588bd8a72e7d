"""Many models, each in a process of its own, several at once, into a table that is resumed."""

from __future__ import annotations

import os
import pickle
import platform
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from .. import __version__
from ..errors import MissingEngineError, refuse
from ..installed import DEFAULT, ENGINES, engine_version, require
from ..processes import ALONE, checked_jobs, fresh_python, sandbox
from ..processes.parallel import in_parallel, unwinding
from ..runs.drive import Progress, silent
from . import table as tables
from .files import ModelFile
from .gaps import STEPS
from .records import ExaminedModel, Survey

SECONDS = 60.0  # for a model
_MEMORY = 8 * sandbox.GB  # address space, of which engines reserve far more than they use


def examine_all(
    models: Sequence[ModelFile],
    *,
    quick: bool = False,
    seconds: float = SECONDS,
    jobs: int | None = None,
    seed: int = 0,
    table: Path | None = None,
    progress: Progress = silent,
) -> Survey:
    """Examine every model, several at once.

    Args:
        models: From `find`.
        quick: Whether to leave out scenarios and costs.
        seconds: What each may take on the clock.
        jobs: How many at once; by default one for each processor.
        seed: Of the commands and poses that are drawn.
        table: A .csv or .json file that is written anew after each model. What it says already of
            the same content, made with the same versions and settings, is taken over.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `seconds`, `jobs` or `seed` is no such number, or `table` is there and no
            such table.
        MissingEngineError: The default engine is not installed here.
    """
    jobs = checked_jobs(jobs)
    refuse(
        (
            not 0 < seconds <= 86400,
            f"seconds must be above 0, and at most 86400; got {seconds:g}",
        ),
        (seed < 0, f"seed must not be negative; got {seed}"),
    )
    require(DEFAULT)
    made_with = _made_with(quick, seed)
    before = tables.read(table) if table is not None and table.exists() else {}
    rows: dict[str, ExaminedModel] = {}
    work: dict[str, Callable[[], ExaminedModel | None]] = {}
    stop = threading.Event()
    for model in models:
        known = before.get((model.name, model.sha256, made_with))
        if known is not None and not (known.ended and known.limit != seconds):
            rows[model.name] = replace(known, part_of=model.part_of)
        else:
            work[model.name] = partial(
                _examined, model, made_with, quick=quick, seconds=seconds, seed=seed, stop=stop
            )

    def in_order() -> list[ExaminedModel]:
        return [rows[model.name] for model in models if model.name in rows]

    def ended(name: str, row: ExaminedModel | None) -> None:
        if row is None:  # it was stopped
            return
        rows[name] = row
        if table is not None:
            tables.write(table, in_order())

    with unwinding():
        in_parallel(
            work, jobs, ended, stop.set, lambda left: progress(1 - left / max(1, len(models)))
        )
    done = in_order()
    if table is not None:
        tables.write(table, done)
    return Survey(
        DEFAULT,
        tuple(row for row in done if row.is_model),
        tuple(row for row in done if not row.is_model),
        made_with,
    )


def _made_with(quick: bool, seed: int) -> str:
    """Versions and settings, in one line."""
    versions = [f"statemachine {__version__}", f"python {platform.python_version()}"]
    for name in ENGINES:
        with suppress(MissingEngineError):
            versions.append(f"{name} {engine_version(name)}")
    return f"{', '.join(versions)}; {STEPS} steps, seed {seed}{', quick' if quick else ''}"


def _examined(
    model: ModelFile,
    made_with: str,
    *,
    quick: bool,
    seconds: float,
    seed: int,
    stop: threading.Event,
) -> ExaminedModel | None:
    """A model's row, from a process of its own; None if stopped."""
    if stop.is_set():
        return None
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True) as folder:
        answer = Path(folder) / "answer"
        words = os.fspath(model.path), "quick" * quick, str(seed), os.fspath(answer)
        command, environment = fresh_python(f"{__package__}.examine", *words)
        outcome = sandbox.run(
            command,
            cpu=4 * seconds + 60,
            wall=seconds,
            cwd=folder,  # engines leave logs where they run
            env={**environment, **ALONE},
            memory_most=_MEMORY,
            stop=stop,
        )
        if stop.is_set():
            return None
        part, row = "start", ExaminedModel("", "", "")
        with suppress(OSError):
            part, row = pickle.loads(answer.read_bytes())
    ended = ""
    if outcome.end != "code" or outcome.code or part:
        said = outcome.stderr.strip().splitlines() if outcome.end == "code" else []
        ended = f"its process failed: {said[-1][:200]}" if said else f"it {outcome.how}"
        ended += f" (at: {part or 'the end'})"
    return replace(
        row,
        file=model.name,
        sha256=model.sha256,
        made_with=made_with,
        part_of=model.part_of,
        ended=ended,
        limit=seconds,
        took=round(time.monotonic() - began, 1),
    )
