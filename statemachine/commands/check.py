"""`statemachine check`: exercises, or a student's tests, judged by what they do."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from ..installed import DEFAULT
from ._common import (
    NEEDS,
    REPEATED,
    SAYS_NO,
    add_rules,
    add_table,
    backend_of,
    file_name,
    json_of,
    one_backend,
    refuse,
    resumable,
    show,
)


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Call each function of a student's file on several models, in a process of "
        "its own with limits, and say what is wrong with what it does. Several files, or the "
        "folder of a class: a table. Or, with --faults: put faults into the arm, and say which "
        "of them a student's tests catch."
    )
    parser.epilog = (
        "Exit code 1: a function does not do what it should; of a class: a file could not be "
        "judged."
    )
    add_table(
        parser,
        (
            "files",
            "FILE|FOLDER",
            "the student's file, like step_loop.py, or the folder that it is in; or those of a "
            "class, each in the folder or in a folder of its own there",
            {"nargs": "*"},
        ),
        backend_of(f"mujoco or pybullet (default {DEFAULT})"),
        (
            "--time-limit",
            "S",
            "seconds that each function of FILE may compute (default 5); time in which the "
            "machine is busy with others does not count, up to 60 s on the clock, or 12 times S",
            {"default": 5.0},
        ),
        (
            "--csv",
            "TABLE",
            "of a class: write the table there after each file; typed again, it judges only "
            "files that are new or changed",
            {"type": file_name},
        ),
        (
            "--jobs",
            "N",
            "of a class: how many files are judged at once (default: one for two processors)",
        ),
        (
            "--roster",
            "LIST",
            "of a class: a CSV file with a row for each student, whose cells (a name, a number) "
            "are looked for in the names of files; who handed in nothing is a row of the table",
            {"type": Path},
        ),
        (
            "--tests",
            "",
            "of a class: run the test_arm.py in each student's folder on arms with faults, too",
        ),
        (
            "--gradescope",
            "RESULTS",
            "of one file, or a folder with one: write Gradescope's results.json, too",
            {"type": file_name},
        ),
        (
            "--faults",
            "TESTFILE",
            "run these tests on the arm with one fault at a time, and say which they catch",
        ),
        (
            "--only",
            "FAULT",
            "with --faults: only this fault; may be given several times",
            REPEATED,
        ),
        json_of("judgement"),
    )
    add_rules(parser, ("only", NEEDS, "faults"))


def run(options: argparse.Namespace) -> int:
    """Judge, and show."""
    refuse(
        (
            (not options.files) == (options.faults is None),
            "expected one of FILE and --faults TESTFILE",
        )
    )
    from ..grading.classroom import is_one_students
    from ..runs.whole import check_place

    folder = any(Path(file).is_dir() for file in options.files)
    table = options.csv or options.roster or options.tests or options.jobs is not None
    single = options.gradescope or (
        folder and not table and is_one_students(Path(options.files[0]))
    )
    several = len(options.files) > 1 or (folder and not single)
    refuse(
        (
            (options.faults is not None or several) and options.gradescope,
            "--gradescope goes with one FILE, or one FOLDER",
        ),
        (
            not several and table and all(Path(file).exists() for file in options.files),
            "--csv, --jobs, --roster and --tests go with several files, or a folder",
        ),
    )
    if options.faults is not None:
        return _faults(options)
    for target in (options.csv, options.gradescope):
        if target is not None:
            check_place(target)
    return _class(options) if several else _one(options)


def _backend(options: argparse.Namespace) -> str:
    """Return the name of the backend that exercises are judged on."""
    backend = one_backend(options.backend, "check")
    if backend.defaults == "engine":
        raise BadInputError(f"exercises are judged on {backend.name}, which keeps the contract")
    return backend.name


def _faults(options: argparse.Namespace) -> int:
    """A student's tests, on an arm with each of the faults."""
    from ..grading.faults.run import examine
    from ..report.grading import faults_page
    from ..report.terminal import progress

    with progress("faults") as report:
        examination = examine(options.faults, _backend(options), options.only, progress=report)
    return show(faults_page(examination), examination, options.json)


def _one(options: argparse.Namespace) -> int:
    """One student's file."""
    from ..grading import classroom, exercise
    from ..report.grading import grade_page
    from ..report.terminal import progress

    (file,) = options.files
    folder = Path(file) if Path(file).is_dir() else None
    try:
        if folder:
            file = classroom.submission_in(folder)
        with progress("check") as report:
            grade = exercise.run(file, _backend(options), options.time_limit, report, folder=folder)
    except BadInputError as error:
        if options.gradescope:  # the student sees why
            _gradescope(options.gradescope, None, str(error))
        raise
    if options.gradescope:
        _gradescope(options.gradescope, grade, "")
    return show(grade_page(grade), grade, options.json)


def _gradescope(target: Path, grade: Any, refusal: str) -> None:
    from ..report.grading import gradescope_results
    from ..runs.whole import replace_text

    replace_text(target, gradescope_results(grade, refusal))


def _class(options: argparse.Namespace) -> int:
    """The files of a class."""
    from ..grading import classroom
    from ..report.grading import class_page
    from ..report.terminal import progress

    submitted = classroom.submissions(options.files)
    if options.roster:
        submitted = classroom.enrolled(submitted, options.roster)
    with resumable(options.csv, "judged"), progress(f"{len(submitted)} files") as report:
        entries = classroom.judge_all(
            submitted,
            _backend(options),
            time_limit=options.time_limit,
            jobs=options.jobs,
            table=options.csv,
            tests=options.tests,
            progress=report,
        )
    show(class_page(entries, classroom.not_looked_at(options.files)), entries, options.json)
    return 0 if all(entry.judged for entry in entries) else SAYS_NO
