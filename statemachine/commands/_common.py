"""What the commands share: options of a model, runs on each backend, how a page is shown."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import (
    BadInputError,
    MissingEngineError,
    ModelError,
    StateMachineError,
    UnsupportedError,
)
from ..installed import DEFAULT

PROGRAM = "statemachine"
# Exit codes: the result says no; bad input; an engine is missing; nowhere to write.
SAYS_NO, BAD_INPUT, MISSING, NO_OUTPUT = 1, 2, 3, 74


def complain(error: Exception | str, code: int) -> int:
    """Say it in one line on standard error; returns `code`."""
    print(f"{PROGRAM}: {one_line(error)}", file=sys.stderr)
    return code


def one_line(text: object) -> str:
    """Text in one line, with nothing in it that a terminal would do instead of show.

    A name may come from a file that somebody else made.
    """
    return "".join(c if c.isprintable() else "?" for c in " ".join(str(text).split()))


def file_name(text: str) -> Path:
    """A file to be written, as an option's type."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a file")
    return Path(text)


def add_json(parser: argparse.ArgumentParser, what: str = "result", default: Any = False) -> None:
    """The option --json."""
    parser.add_argument(
        "--json", action="store_true", default=default, help=f"print the {what} as JSON"
    )


def add_backend(
    parser: argparse.ArgumentParser, everyone: bool = True, default: str = DEFAULT
) -> None:
    """The option --backend."""
    text = "an engine, or all" if everyone else "an engine"
    parser.add_argument(
        "--backend", default=default, metavar="NAME", help=f"{text} (default {DEFAULT})"
    )


def add_menagerie(parser: argparse.ArgumentParser, default: str | None = None) -> None:
    """The options --menagerie and --trust-binary, of commands that load a model."""
    add_trust(parser, default or False)
    parser.add_argument(
        "--menagerie",
        default=default or os.environ.get("MENAGERIE") or None,
        metavar="DIR",
        help="look the model up in this folder of public models (default $MENAGERIE)",
    )


def add_trust(parser: argparse.ArgumentParser, default: Any = False) -> None:
    """The option --trust-binary; `cli.main` does what it says."""
    parser.add_argument(
        "--trust-binary",
        action="store_true",
        default=default,
        help="read a binary model (.mjb) that this library did not write; it can do harm",
    )


def add_model(parser: argparse.ArgumentParser, model: str) -> None:
    """The option --model."""
    parser.add_argument(
        "--model", default=model, metavar="NAME|FILE", help=f"the model (default {model})"
    )


def on_each_backend(
    options: argparse.Namespace, what: str, model: str, run: Callable[[Any, str, Any], Any]
) -> dict[str, Any]:
    """Results by backend; an engine that is missing is named and left out of `all`.

    Args:
        options: Its `backend` and `menagerie` are read.
        what: Shown beside the progress.
        model: A model's name or file.
        run: Called with the Model, the backend's name and what is told the fraction that is done.
    """
    from ..backends import backend_names, load
    from ..report.progress import progress

    everyone = options.backend == "all"
    results: dict[str, Any] = {}
    missing: list[StateMachineError] = []
    for backend in backend_names() if everyone else [options.backend]:
        try:
            loaded = load(model, backend=backend, menagerie=options.menagerie)
        except (MissingEngineError, ModelError, UnsupportedError) as error:
            if not everyone:
                raise
            missing.append(error)
            continue
        with progress(f"{what} on {backend}") as report:
            results[backend] = run(loaded, backend, report)
    refusals = list({str(error): error for error in missing}.values())  # each text once
    for error in refusals if results else refusals[:-1]:
        complain(error, MISSING)
    if not results:
        raise refusals[-1]
    return results


def pairs_of(given: list[str], option: str) -> dict[str, str]:
    """Names of the left and what the right calls them, from words A=B."""
    found: dict[str, str] = {}
    for text in given:
        one, sign, two = text.partition("=")
        if not (one and sign and two):
            raise BadInputError(f"{option} wants A=B, a name of A's and one of B's; got {text!r}")
        found[one] = two
    return found


def show(page: Any, result: Any, as_json: bool, footer: str = "", reader: Any = None) -> int:
    """Print a page, or what it was made from as JSON; the exit code."""
    if as_json:
        from ..report.as_json import dumps

        print(dumps(result))
    else:
        from ..report import terminal

        terminal.show(page, footer, reader)
    return 0 if page.holds else SAYS_NO
