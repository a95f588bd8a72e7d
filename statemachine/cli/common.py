"""What the commands share: options, exit codes, progress, and how a page is shown."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import printable
from ..installed import DEFAULT
from ..typed_numbers import typed_float, typed_int

if TYPE_CHECKING:
    from ..course.quiz import Reader
    from ..show.blocks import Page

PROGRAM = "statemachine"
# Exit codes: the result says no; bad input; an engine is missing; a fault of this program; nowhere
# to write (these two are those of sysexits.h); Ctrl-C, as a shell has it.
SAYS_NO, BAD_INPUT, MISSING, FAULT, NO_OUTPUT, INTERRUPTED = 1, 2, 3, 70, 74, 130


def print_error(error: Exception | str, code: int) -> int:
    """Print it in one line on standard error, and return `code`."""
    print(f"{PROGRAM}: {printable(error)}", file=sys.stderr)
    return code


def is_given(options: argparse.Namespace, name: str) -> bool:
    """Tell whether an option is given that is None, False or empty where it is not."""
    value = getattr(options, name)
    return value is not None and value is not False and value != []  # 0 is given


def flag_of(name: str) -> str:
    """Return an option as it is typed."""
    return f"--{name.replace('_', '-')}"


def number_list(text: str) -> list[float]:
    """Read numbers of a list like 0,-0.6,1.2, as an option's type."""
    try:
        return [typed_float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers like 0,-0.6") from None


def file_name(text: str) -> Path:
    """Read the name of a file to be written, as an option's type."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a file")
    return Path(text)


class TerminalReporter:
    """A `Reporter` that shows a bar of progress and prints each note, on standard error."""

    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> AbstractContextManager[Callable[[float], None]]:
        """Show a bar for a stage of the work."""
        from ..show.progress import progress

        return progress(what, runs_at_once, expected_seconds)

    def note(self, text: str) -> None:
        """Print a note in one line."""
        print_error(text, 0)

    def so_far(self, page: Page) -> None:
        """Print a page on standard error: the result alone is for standard output."""
        from ..show import terminal

        with redirect_stdout(sys.stderr):
            terminal.show(page)


# Options that several commands have.
_RUNS = "mujoco, pybullet, motrix or a release, mujoco==3.3.7"
_EACH = f"all: those that are installed; may be repeated (default {DEFAULT})"
ONE_BACKEND = f"{_RUNS}; pybullet:engine: as its own users meet it (default {DEFAULT})"
EACH_BACKEND = f"{_RUNS}; pybullet:engine: as its own users meet it; {_EACH}"
CONTRACT_BACKENDS = f"{_RUNS}; {_EACH}"  # each with the contract of this library
SIDES = ("left", "right")


def add_backend(parser: argparse._ActionsContainer, help_text: str) -> None:
    """Add --backend, which may be repeated; the command says how often."""
    parser.add_argument("--backend", action="append", metavar="NAME", help=help_text)


def add_json(
    parser: argparse._ActionsContainer, what: str = "result", default: object = False
) -> None:
    """Add --json, which prints the result as JSON.

    Args:
        parser: The parser that gets the option.
        what: What the help calls the result.
        default: `argparse.SUPPRESS` where a parser above this one has the option, too.
    """
    help_text = f"print the {what} as JSON"
    parser.add_argument("--json", action="store_true", default=default, help=help_text)


def add_seed(parser: argparse._ActionsContainer, what: str) -> None:
    """Add --seed, of what is drawn at random."""
    help_text = f"random seed of {what} (0)"
    parser.add_argument("--seed", type=typed_int, default=0, metavar="N", help=help_text)


def add_policy(parser: argparse._ActionsContainer) -> None:
    """Add --contract and --command, of a policy that is run like a function."""
    parser.add_argument(
        "--contract", metavar="FILE", help="what POLICY.onnx expects, as of `statemachine policy`"
    )
    parser.add_argument(
        "--command",
        type=number_list,
        metavar="VX,VY,WZ",
        help="speeds that POLICY.onnx is asked for [m/s, m/s, rad/s] (straight on)",
    )


def add_seconds(parser: argparse._ActionsContainer) -> None:
    """Add --seconds, the simulated time."""
    parser.add_argument("--seconds", type=typed_float, metavar="S", help="simulated time")


def add_timestep(parser: argparse._ActionsContainer) -> None:
    """Add --timestep, the length of a step."""
    parser.add_argument("--timestep", type=typed_float, metavar="S", help="length of a step [s]")


def add_jobs(parser: argparse._ActionsContainer) -> None:
    """Add --jobs, the number of processes."""
    help_text = "parallel processes (default: one a processor)"
    parser.add_argument("--jobs", type=typed_int, metavar="N", help=help_text)


def add_model(
    parser: argparse._ActionsContainer, help_text: str = "the model", default: str | None = None
) -> None:
    """Add the model, as a word that may be left out."""
    if default is not None:
        help_text += f" (default {default})"
    parser.add_argument("model", nargs="?", default=default, metavar="NAME|FILE", help=help_text)


def add_trust(parser: argparse._ActionsContainer) -> None:
    """Add --trust-binary, which `cli.main` obeys."""
    help_text = "read a binary model (.mjb); a damaged one can do harm"
    parser.add_argument("--trust-binary", action="store_true", help=help_text)


def add_menagerie(parser: argparse._ActionsContainer) -> None:
    """Add --menagerie, the folder in which models are looked up, and --trust-binary."""
    add_trust(parser)
    folder = os.environ.get("MENAGERIE") or None
    help_text = "look the model up in this folder of public models (default $MENAGERIE)"
    parser.add_argument("--menagerie", default=folder, metavar="DIR", help=help_text)


def word_of_one_backend(words: Sequence[str] | None, what: str) -> str:
    """Return the one backend that --backend names, as it was typed; MuJoCo where nothing was.

    Args:
        words: What was typed.
        what: The command, for the message.

    Raises:
        BadInputError: Several are named.
        UnknownNameError: There is no such backend.
    """
    from ..backends.chosen import one_backend

    return str(one_backend(words or [DEFAULT], what))


def show(
    page: Page, result: object, as_json: bool, footer: str = "", reader: Reader | None = None
) -> int:
    """Print a page, or the result that it was made from as JSON, and return the exit code.

    Args:
        page: The page.
        result: What JSON shows.
        as_json: Whether JSON is printed, and not the page.
        footer: The last line of the page.
        reader: Somebody at a terminal who answers the questions of the page.
    """
    if as_json:
        from ..show.as_json import dumps

        print(dumps(result))
    else:
        from ..show import terminal

        terminal.show(page, footer, reader)
    return 0 if page.holds else SAYS_NO
