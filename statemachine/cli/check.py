"""`statemachine check`: exercises, or a student's tests, judged by what they do."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BadInputError
from ..installed import DEFAULT
from ..typed_numbers import typed_float, typed_int
from .common import (
    SAYS_NO,
    TerminalReporter,
    add_backend,
    add_json,
    file_name,
    show,
    word_of_one_backend,
)
from .resuming import resumable

if TYPE_CHECKING:
    from ..course.grading.request import CheckRequest, ClassRequest, FaultsRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
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
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE|FOLDER",
        help="the student's file, like step_loop.py, or the folder that it is in; or those of a "
        "class, each in the folder or in a folder of its own there",
    )
    add_backend(parser, f"mujoco, pybullet or motrix (default {DEFAULT})")
    parser.add_argument(
        "--time-limit",
        type=typed_float,
        default=5.0,
        metavar="S",
        help="seconds that each function of FILE may compute (default 5); time in which the "
        "machine is busy with others does not count, up to 60 s on the clock, or 12 times S",
    )
    parser.add_argument(
        "--csv",
        type=file_name,
        metavar="TABLE",
        help="of a class: write the table there after each file; typed again, the command judges "
        "only files that are new or changed",
    )
    parser.add_argument(
        "--html",
        type=file_name,
        metavar="PAGE.html",
        help="of a class: write a page with all remarks there",
    )
    parser.add_argument(
        "--jobs",
        type=typed_int,
        metavar="N",
        help="of a class: how many files are judged at once (default: one a processor)",
    )
    parser.add_argument(
        "--roster",
        type=Path,
        metavar="LIST",
        help="of a class: a CSV file with a row for each student, whose cells (a name, a number) "
        "are looked for in the names of files; who handed in nothing is a row of the table",
    )
    parser.add_argument(
        "--tests",
        action="store_true",
        help="of a class: run the test_arm.py in each student's folder on arms with faults, too",
    )
    parser.add_argument(
        "--gradescope",
        type=file_name,
        metavar="RESULTS",
        help="of one file, or a folder with one: write Gradescope's results.json, too",
    )
    parser.add_argument(
        "--faults",
        metavar="TESTFILE",
        help="run these tests on the arm with one fault at a time, and say which they catch",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="FAULT",
        help="with --faults: only this fault; may be given several times",
    )
    add_json(parser, "judgement")


def run(options: argparse.Namespace) -> int:
    """Judge, and show."""
    if options.only and options.faults is None:
        raise BadInputError("--only goes with --faults")
    if bool(options.files) == (options.faults is not None):
        raise BadInputError("expected one of FILE and --faults TESTFILE")
    is_class = _is_class(options)
    if options.gradescope is not None and (options.faults is not None or is_class):
        raise BadInputError("--gradescope goes with one FILE, or one FOLDER")
    are_here = all(Path(file).exists() for file in options.files)
    if _wants_table(options) and not is_class and are_here:
        raise BadInputError(
            "--csv, --html, --jobs, --roster and --tests go with several files, or a folder"
        )
    if options.faults is not None:
        return _run_faults(options)
    return _run_class(options) if is_class else _run_one(options)


def _is_class(options: argparse.Namespace) -> bool:
    """Tell whether files are those of a class, and not one student's."""
    from ..course.grading.submissions import is_one_students

    if len(options.files) != 1:
        return len(options.files) > 1
    file = Path(options.files[0])
    if not file.is_dir() or options.gradescope is not None:
        return False
    return _wants_table(options) or not is_one_students(file)


def _wants_table(options: argparse.Namespace) -> bool:
    """Tell whether an option of a class is given."""
    return (
        options.csv is not None
        or options.html is not None
        or options.roster is not None
        or options.tests
        or options.jobs is not None
    )


def request_of(options: argparse.Namespace) -> CheckRequest:
    """Return what is to be judged, of one student.

    Raises:
        BadInputError: A number is out of range, or the backend is not one.
        UnknownNameError: There is no such backend.
    """
    from ..course.grading.request import CheckRequest

    return CheckRequest(
        file=options.files[0],
        backend=word_of_one_backend(options.backend, "check"),
        time_limit=options.time_limit,
    )


def class_request_of(options: argparse.Namespace) -> ClassRequest:
    """Return what is to be judged, of a class.

    Raises:
        BadInputError: A number is out of range, the table cannot be written, or the backend is
            not one.
        UnknownNameError: There is no such backend.
    """
    from ..course.grading.request import ClassRequest

    return ClassRequest(
        paths=tuple(options.files),
        backend=word_of_one_backend(options.backend, "check"),
        time_limit=options.time_limit,
        jobs=options.jobs,
        table=options.csv,
        roster=options.roster,
        tests=options.tests,
    )


def faults_request_of(options: argparse.Namespace) -> FaultsRequest:
    """Return which tests are to be run.

    Raises:
        BadInputError: The backend is not one.
        UnknownNameError: There is no such fault or backend.
    """
    from ..course.grading.request import FaultsRequest

    return FaultsRequest(
        file=options.faults,
        backend=word_of_one_backend(options.backend, "check"),
        only=tuple(options.only),
    )


def _run_faults(options: argparse.Namespace) -> int:
    """Run a student's tests on an arm with each of the faults."""
    from ..course.grading.page import faults_page
    from ..course.grading.request import answer_faults

    examination = answer_faults(faults_request_of(options), TerminalReporter())
    return show(faults_page(examination), examination, options.json)


def _run_one(options: argparse.Namespace) -> int:
    """Judge one student's file, and write Gradescope's results."""
    from ..atomic_files import check_place, replace_text
    from ..course.grading.page import grade_page, gradescope_results
    from ..course.grading.request import answer

    if options.gradescope is None:
        grade = answer(request_of(options), TerminalReporter())
        return show(grade_page(grade), grade, options.json)
    check_place(options.gradescope)
    try:
        grade = answer(request_of(options), TerminalReporter())
    except BadInputError as error:  # the student sees why
        replace_text(options.gradescope, gradescope_results(None, str(error)))
        raise
    replace_text(options.gradescope, gradescope_results(grade))
    return show(grade_page(grade), grade, options.json)


def _run_class(options: argparse.Namespace) -> int:
    """Judge the files of a class."""
    from ..course.grading import judged_before
    from ..course.grading.class_page import class_page
    from ..course.grading.request import answer_class
    from ..show.html import check_target, report, write_report

    request = class_request_of(options)
    if options.html is not None:
        check_target(options.html)
    store_folder = judged_before.folder() if request.table is None else request.table
    with resumable(store_folder, "judged"):
        result = answer_class(request, TerminalReporter())
    if options.html is not None:
        target = write_report(options.html, report(class_page(result)))
        print(f"wrote {target}", file=sys.stderr)
    show(class_page(result), result, options.json)
    return 0 if result.complete else SAYS_NO
