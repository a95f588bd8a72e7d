"""Random small models, and pairs of them, through all that reads a model: no traceback.

A command may refuse a model, or find that two differ. What must not happen is an exception that
nobody meant to raise, an exit code that is documented nowhere, a crash, or a hang.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import random
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from ._mjcf import changed, drawn, text_of
from ._tally import Tally

TRIES = 2000
_PATIENCE = 120.0  # seconds for all readers of one model on a busy machine
_READERS_OF_A_MODEL = 5  # drawn for each
# Well; the result says no; bad input; an engine is missing; nowhere to write.
_CODES = (0, 1, 2, 3, 74)
_SHORT = ("--seconds", "0.05")
_EXPERIMENTS = ("hold", "gravity", "droop", "fall", "waves")
# Words of a command, and how often one is drawn beside the others. LEFT and RIGHT are the files.
COMMANDS: dict[tuple[str, ...], int] = {
    ("compare", "--models", "LEFT", "RIGHT"): 60,
    ("compare", "--models", "LEFT", "RIGHT", "--json"): 10,
    ("compare", "EXPERIMENT", "LEFT", "RIGHT", *_SHORT): 30,
    ("compare", "EXPERIMENT", "LEFT", "RIGHT", *_SHORT, "--why"): 50,
    ("compare", "EXPERIMENT", "LEFT", "RIGHT", *_SHORT, "--why", "--json"): 10,
    ("compare", "EXPERIMENT", "LEFT", "RIGHT", *_SHORT, "--one-step"): 40,
    ("compare", "EXPERIMENT", "LEFT", *_SHORT): 10,
    ("compare", "EXPERIMENT", "LEFT", *_SHORT, "--why"): 15,
    ("compare", "EXPERIMENT", "LEFT", *_SHORT, "--one-step"): 10,
    ("compare", "EXPERIMENT", "LEFT", "RIGHT@pybullet", *_SHORT): 10,
    ("compare", "EXPERIMENT", "LEFT@mujoco:engine", "LEFT@pybullet:engine", *_SHORT): 5,
    ("compare", "EXPERIMENT", "LEFT", "timestep=0.001", "RIGHT", *_SHORT): 10,
    ("fingertip", "LEFT", "--poses", "3"): 20,
    ("fingertip", "LEFT", "--poses", "3", "--backend", "all"): 10,
    ("trace", "record", "EXPERIMENT", "LEFT", *_SHORT, "-o", "run.npz"): 10,
    ("lesson", "LESSON", "--model", "LEFT", "--no-questions"): 40,
    ("lesson", "LESSON", "--model", "LEFT", "--no-questions", "--backend", "all"): 10,
    # These take seconds.
    ("compare", "EXPERIMENT", "LEFT", "RIGHT", *_SHORT, "--html", "page.html"): 2,
    ("compare", "EXPERIMENT", "LEFT", "--converge", *_SHORT): 2,
}
_WELL = (
    '<mujoco><worldbody><body><joint name="j" axis="0 1 0"/><geom size=".1" pos=".1 0 0"/></body>'
    '</worldbody><actuator><position joint="j" kp="5"/></actuator></mujoco>'
)
# Lessons that take any model, with what makes them short.
_LESSONS: dict[str, tuple[str, ...]] = {
    "state": (),
    "nowhere": (),
    "forward": (),
    "objects": ("--most", "4"),
    "hold": ("--seconds", "0.05"),
    "gravity": ("--seconds", "0.05"),
    "reset": (),
    "replay": ("--steps", "5"),
}


def run(seed: int, tries: int) -> Tally:
    """Draw pairs of models, and let some readers read each."""
    draw, tally = random.Random(seed), Tally()
    with tempfile.TemporaryDirectory() as name:
        _import_readers(Path(name))
        for _ in range(tries):
            one = draw.randrange(2**32)
            tally.tried += 1
            tally.failures += [f"seed {one}: {problem}" for problem in examined_apart(one, name)]
    return tally


def examined_apart(seed: int, folder: str) -> list[str]:
    """Return what is wrong with how a pair is read, each model of it in a fork of this process.

    A crash or a hang of the fork is a failure, too.
    """
    fork = multiprocessing.get_context("fork")
    ours, theirs = fork.Pipe(duplex=False)
    child = fork.Process(target=_tell, args=(theirs, seed, folder))
    child.start()
    theirs.close()
    try:
        if not ours.poll(_PATIENCE):
            child.kill()
            return [f"it did not end within {_PATIENCE:g} s"]
        return ours.recv()
    except EOFError:
        child.join()
        return [f"its process ended with code {child.exitcode}"]
    finally:
        child.join()
        ours.close()


def _import_readers(folder: Path) -> None:
    """Read a model that is well, so that a fork finds imported what the readers import."""
    file = folder / "well.xml"
    file.write_text(_WELL, encoding="utf-8")
    for words in (
        ["compare", "--models", str(file), str(file)],
        ["compare", "fall", str(file), "timestep=0.001", str(file), *_SHORT, "--why"],
        ["compare", "hold", str(file), str(file), *_SHORT, "--one-step"],
        ["fingertip", str(file), "--poses", "1", "--backend", "all"],
        ["lesson", "state", "--model", str(file), "--no-questions", "--backend", "all"],
    ):
        ended_badly(words)


def _tell(pipe: Connection, seed: int, folder: str) -> None:
    os.chdir(folder)
    pipe.send(examined(seed, Path(folder)))


def pair(draw: random.Random, folder: Path) -> tuple[Path, Path]:
    """Write a model and a changed copy of it."""
    model = drawn(draw)
    left, right = folder / "left.xml", folder / "right.xml"
    left.write_text(text_of(model), encoding="utf-8")
    right.write_text(text_of(changed(draw, model)), encoding="utf-8")
    return left, right


def examined(
    seed: int, folder: Path, readers: int = _READERS_OF_A_MODEL, thorough: bool = True
) -> list[str]:
    """Draw a pair, let some readers read it, and return what is wrong.

    Args:
        seed: Of the pair, and of what reads it.
        folder: Where the files are written.
        readers: How many read it.
        thorough: Whether `robots` and `sweep` read it, too, now and then.
    """
    draw = random.Random(seed)
    files = pair(draw, folder)
    tasks: list[Callable[[], str]] = []
    chosen = draw.choices([*COMMANDS], [*COMMANDS.values()], k=readers)
    for words in chosen:
        typed = typed_words(draw, words, *files)
        tasks.append(lambda typed=typed: ended_badly(typed))
    if thorough and draw.random() < 0.1:
        tasks.append(lambda: faults_of_robots(files[0], folder, seed))
    if thorough and draw.random() < 0.02:
        tasks.append(lambda: swept_badly(files[0], folder))
    problems: list[str] = []
    for task in tasks:
        if problem := task():
            problems.append(problem)
    return problems


def typed_words(draw: random.Random, words: Sequence[str], left: Path, right: Path) -> list[str]:
    """Return a command with its files, an experiment and a lesson filled in."""
    typed: list[str] = []
    for word in words:
        if word == "EXPERIMENT":
            typed.append(draw.choice(_EXPERIMENTS))
        elif word == "LESSON":
            lesson = draw.choice([*_LESSONS])
            typed += [lesson, *_LESSONS[lesson]]
        else:
            typed.append(word.replace("LEFT", left.name).replace("RIGHT", right.name))
    return typed


def ended_badly(words: list[str]) -> str:
    """Run a command in this process; what is wrong with its end, or ""."""
    from statemachine import cli

    out, said = io.StringIO(), io.StringIO()
    sys.argv = ["statemachine", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
            code = cli.main(words)
    except SystemExit as end:  # of argparse
        code = end.code
    if code not in _CODES or "Traceback" in said.getvalue():
        lines = [line.strip() for line in said.getvalue().splitlines() if line.strip()]
        return f"{' '.join(words)}: exit code {code}: {' | '.join(lines[-6:])}"
    return ""


def faults_of_robots(file: Path, folder: Path, seed: int) -> str:
    """Examine a model as `robots` does; what it calls a fault, or ""."""
    from statemachine.lab.robots import Survey
    from statemachine.lab.robots.examine import examine
    from statemachine.lab.robots.page import page
    from statemachine.lab.robots.records import ExaminedModel

    try:
        with warnings.catch_warnings(action="ignore"):
            quick = bool(seed % 2)
            row = examine(file, ExaminedModel(file.name, "", ""), quick, 0, lambda *_of: None)
        page(Survey("mujoco", [row], [], ""))
    except Exception:
        return f"robots {file.name}: {traceback.format_exc(limit=-3)}"
    # What throws a random robot apart is its own motors.
    faults = [fault for fault in row.faults if "DivergedError" not in fault]
    return f"robots {file.name}: {faults}" if faults else ""


def swept_badly(file: Path, folder: Path) -> str:
    """Sweep a model, and report it; what is wrong with its end, or ""."""
    words = ["sweep", "gravity", file.name, "--vary", "timestep=0.002,0.004", *_SHORT]
    with tempfile.TemporaryDirectory(dir=folder) as out:
        return ended_badly([*words, "--jobs", "1", "--out", out, "--report"])
