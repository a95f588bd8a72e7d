"""Any folder of models: what each does on each engine, in a table.

    models = find(["my_robots"])
    survey = examine_all(models, table=Path("table.csv"))

Each model is examined in a process of its own, so that one that crashes or never ends costs its
row, and not the table.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from ... import __version__
from ...errors import BadInputError, MissingEngineError
from ...installed import DEFAULT, ENGINES, engine_version, require
from ...models import SUFFIXES, AnyPath
from ...processes import ALONE, checked_jobs, fresh_python, sandbox
from ...processes.parallel import in_parallel, unwinding
from ..runs.drive import Progress, no_progress
from ..runs.provenance import model_digest, model_files
from .gaps import STEPS
from .records import (
    BackendRow,
    ExaminedModel,
    ModelFile,
    RunGap,
    WitnessRow,
)
from .survey import EngineTally, RefusedFeature, Survey
from .table import read_table, write_table

__all__ = [
    "BackendRow",
    "EngineTally",
    "ExaminedModel",
    "ModelFile",
    "RefusedFeature",
    "RunGap",
    "Survey",
    "WitnessRow",
    "examine_all",
    "find",
]


# Models among files and folders, each in a process of its own, into a table that is resumed.

_ROOTS = (DEFAULT, "robot")  # of MJCF, whose root is called after its engine, and of URDF
_BINARY = ".mjb"
_START = 65536  # bytes in which a file that is not XML may say what it was meant to be


def find(paths: Sequence[AnyPath]) -> list[ModelFile]:
    """Find the models among files and folders, in an order that does not change.

    In a folder, and in all below it, each MJCF and URDF is one; a binary model must be named.
    A file without bodies, itself or in what it includes, is left out.

    Raises:
        BadInputError: A path is not there, or nothing is found at all.
    """
    files: dict[Path, tuple[str, Path]] = {}  # by where each is: its name, and as it was found
    for path in map(Path, paths):
        if path.is_file():
            if path.suffix.lower() not in SUFFIXES:
                raise BadInputError(
                    f"{path} is not a model: it does not end in {', '.join(SUFFIXES)}"
                )
            files.setdefault(path.resolve(), (path.as_posix(), path))
            continue
        if not path.is_dir():
            raise BadInputError(f"there is no file or folder {path}")
        for file in _below(path):
            name = file.relative_to(path) if len(paths) == 1 else file
            files.setdefault(file.resolve(), (name.as_posix(), file))
    if not files:
        raise BadInputError(f"no models (MJCF or URDF) in {', '.join(map(str, paths))}")
    owners = _owners(files.values())
    models: list[ModelFile] = []
    for place, (name, file) in files.items():
        models.append(ModelFile(name, file.absolute(), _digest(file), owners.get(place, "")))
    return models


def _owners(files: Iterable[tuple[str, Path]]) -> dict[Path, str]:
    """Return the name of the first file that includes each included one."""
    owners: dict[Path, str] = {}
    for name, file in files:
        with suppress(ValueError, OSError):
            for part in list(model_files(file))[1:]:  # what it includes
                owners.setdefault(part.resolve(), name)
    return owners


_WITH_BODIES = ("body", "attach", "replicate", "composite", "flexcomp")  # elements of an MJCF


def _below(folder: Path) -> Iterator[Path]:
    for file in sorted(folder.rglob("*")):
        parts = file.relative_to(folder).parts
        if any(part.startswith(".") or part in ("__pycache__", "__MACOSX") for part in parts):
            continue
        if file.suffix.lower() in SUFFIXES and file.suffix.lower() != _BINARY and file.is_file():
            root = _root(file)
            if root in _ROOTS and (root == "robot" or _has_bodies(file)):
                yield file


def _root(file: Path) -> str:
    """Return the name of a file's root element; of one that is not XML, how it begins; or ""."""
    try:
        with file.open("rb") as content:
            for _, element in ElementTree.iterparse(content, events=("start",)):
                return element.tag
    except (ElementTree.ParseError, UnicodeError, ValueError):
        pass
    except OSError:
        return ""
    with file.open("rb") as content:
        start = content.read(_START)
    return next((root for root in _ROOTS if f"<{root}".encode() in start), "")


def _has_bodies(file: Path) -> bool:
    """Return whether a body is in an MJCF, or in what it includes; one that is not XML may have."""
    # A file that `iterparse` opens itself is closed by the garbage collector, in which a Ctrl-C is
    # printed and lost.
    try:
        for part in model_files(file):
            with part.open("rb") as content:
                for _, element in ElementTree.iterparse(content, events=("start",)):
                    if element.tag in _WITH_BODIES:
                        return True
    except (ElementTree.ParseError, UnicodeError, ValueError, OSError):
        return True
    return False


def _digest(file: Path) -> str:
    with suppress(ValueError, OSError):
        return model_digest(file)
    with suppress(OSError):
        return hashlib.sha256(file.read_bytes()).hexdigest()
    return ""


SECONDS = 60.0  # for a model
_MEMORY = 8 * sandbox.GB  # address space, of which engines reserve far more than they use


def check_settings(seconds: float, seed: int) -> None:
    """Check what an examination is given.

    Raises:
        BadInputError: The time of a model, or the seed, is out of range.
    """
    if not 0 < seconds <= 86400:
        raise BadInputError(f"seconds must be above 0, and at most 86400; got {seconds:g}")
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")


def examine_all(
    models: Sequence[ModelFile],
    *,
    quick: bool = False,
    seconds: float = SECONDS,
    jobs: int | None = None,
    seed: int = 0,
    table: Path | None = None,
    progress: Progress = no_progress,
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
        BadInputError: `seconds`, `jobs` or `seed` is invalid, or `table` is there and no
            such table.
        MissingEngineError: The default engine is not installed here.
    """
    jobs = checked_jobs(jobs)
    check_settings(seconds, seed)
    require(DEFAULT)
    made_with = _made_with(quick, seed)
    before = read_table(table) if table is not None and table.exists() else {}
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

    def kept(examined: Mapping[str, ExaminedModel | None]) -> list[ExaminedModel]:
        """Return the rows so far in their order, of which the table is made."""
        in_order = [row for model in models if (row := examined.get(model.name))]  # None: stopped
        if table is not None:
            write_table(table, in_order)
        return in_order

    with unwinding():
        examined = in_parallel(
            work, jobs, stop.set, lambda left: progress(1 - left / max(1, len(models))), kept, rows
        )
    done = kept(examined)
    return Survey(
        DEFAULT,
        tuple(row for row in done if row.is_model),
        tuple(row for row in done if not row.is_model),
        made_with,
    )


def _made_with(quick: bool, seed: int) -> str:
    """Return versions and settings in one line."""
    versions = [f"statemachine {__version__}", f"python {platform.python_version()}"]
    for name in ENGINES:
        with suppress(MissingEngineError):
            versions.append(f"{name} {engine_version(name)}")
    settings = [f"{STEPS} steps", f"seed {seed}"]
    if quick:
        settings.append("quick")
    return f"{', '.join(versions)}; {', '.join(settings)}"


def _examined(
    model: ModelFile,
    made_with: str,
    *,
    quick: bool,
    seconds: float,
    seed: int,
    stop: threading.Event,
) -> ExaminedModel | None:
    """Return a model's row, from a process of its own; None if stopped."""
    if stop.is_set():
        return None
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True) as folder:
        answer = Path(folder) / "answer"
        words = os.fspath(model.path), "quick" if quick else "", str(seed), os.fspath(answer)
        command, environment = fresh_python(f"{__package__}.examine:main", *words)
        outcome = sandbox.run(
            command,
            sandbox.Limits(cpu=4 * seconds + 60, wall=seconds, memory_most=_MEMORY),
            cwd=folder,  # engines leave logs where they run
            env={**environment, **ALONE},
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
