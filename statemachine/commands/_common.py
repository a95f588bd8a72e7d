"""What the commands share: options of a model, runs on each backend, how a page is shown."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import (
    BadInputError,
    MissingEngineError,
    ModelError,
    StateMachineError,
    UnsupportedError,
    printable,
)
from ..installed import DEFAULT
from ..typed_numbers import typed_float, typed_int

if TYPE_CHECKING:
    from ..backends import BackendChoice

PROGRAM = "statemachine"
# Exit codes: the result says no; bad input; an engine is missing; a fault of this program; nowhere
# to write. The last two are those of sysexits.h.
SAYS_NO, BAD_INPUT, MISSING, FAULT, NO_OUTPUT = 1, 2, 3, 70, 74


def complain(error: Exception | str, code: int) -> int:
    """Say it in one line on standard error; returns `code`."""
    print(f"{PROGRAM}: {printable(error)}", file=sys.stderr)
    return code


@contextmanager
def resumable(written: Path | None, what: str, but: str = "") -> Iterator[None]:
    """Say, where a Ctrl-C ends it, what there is already, and how to go on.

    Args:
        written: The file or the folder that it is in.
        what: What was done with what is there.
        but: What is to be typed otherwise.
    """
    try:
        yield
    except KeyboardInterrupt:
        if written is not None and written.exists():
            text = f"stopped; {written} has what was {what}. Type the same{but} to go on"
            raise SystemExit(complain(text, 130)) from None
        raise


def is_given(options: argparse.Namespace, name: str) -> bool:
    """Tell whether an option is given that is None, False or empty where it is not."""
    value = getattr(options, name)
    return value is not None and value is not False and value != []  # 0 is given


def refuse_given(options: argparse.Namespace, names: Iterable[str], text: str) -> None:
    """Refuse options that have no meaning for what was asked.

    Args:
        options: Those of the command.
        names: Of the options.
        text: What is said of one; {} is its flag.

    Raises:
        BadInputError: One of them is given.
    """
    for name in names:
        if is_given(options, name):
            raise BadInputError(text.format(flag_of(name)))


# Of options: their names, whether they need one of the others or exclude them all, the others'
# names, and what is said where that is not the usual.
Rule = tuple[str, ...]
NEEDS, EXCLUDES = "{flag} goes with {others}", "{flag} goes without {others}"


def add_rules(parser: argparse.ArgumentParser, *rules: Rule) -> None:
    """What options need of each other, which `check_rules` refuses before a command runs."""
    parser.set_defaults(
        rules=rules, usual={action.dest: action.default for action in parser._actions}
    )


def check_rules(options: argparse.Namespace) -> None:
    """Raise BadInputError for the first rule of a command that is broken."""
    # A default is one object: what is typed is another, also where it is equal.
    given = [
        name
        for name, usual in getattr(options, "usual", {}).items()
        if getattr(options, name, usual) is not usual and getattr(options, name) != []
    ]
    for names, needs_or_excludes, others, *text in getattr(options, "rules", ()):
        present = [other for other in others.split() if other in given]
        if bool(present) == (needs_or_excludes == EXCLUDES):
            shown = " or ".join(map(flag_of, present or others.split()))
            for name in (name for name in names.split() if name in given):
                template = text[0] if text else needs_or_excludes
                raise BadInputError(template.format(flag=flag_of(name), others=shown))


class _HelpAll(argparse.Action):
    """--help-all: the help of every option; `const` has what --help leaves out."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        for action, text in (self.const or {}).items():
            action.help = text
        self.help = "every option: this list"
        parser.print_help()
        parser.exit()


def shorten_help(parser: argparse.ArgumentParser, first: Collection[str]) -> None:
    """Let --help show the options that are needed first, and --help-all all of them.

    Args:
        parser: Of the command, with all its options.
        first: The names of those that are needed first.
    """
    later = {
        action: action.help
        for action in parser._actions
        if action.dest != "help" and action.dest not in first and action.help != argparse.SUPPRESS
    }
    for action in later:
        action.help = argparse.SUPPRESS
    says = f"every option: {len(later)} more"
    parser.add_argument("--help-all", action=_HelpAll, nargs=0, const=later, help=says)


def flag_of(name: str) -> str:
    """An option as it is typed."""
    return f"--{name.replace('_', '-')}"


# What an option is: its flags, its metavar, its help, and what else argparse is told.
Row = tuple[Any, ...]
REPEATED = {"action": "append", "default": []}


def number_list(text: str) -> list[float]:
    """Read numbers of a list like 0,-0.6,1.2, as an option's type."""
    try:
        return [typed_float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers like 0,-0.6") from None


# By the metavar.
_TYPES: dict[str | None, Any] = {
    "N": typed_int,
    "S": typed_float,
    "X": typed_float,
    "X,X,…": number_list,
}


def file_name(text: str) -> Path:
    """A file to be written, as an option's type."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a file")
    return Path(text)


def add_table(parser: Any, *rows: Row) -> None:
    """Options from a table; one whose metavar is "" is a switch.

    Args:
        parser: A parser, or a group of one.
        *rows: The options.
    """
    for flags, metavar, says, *more in rows:
        settings: dict[str, Any] = {"help": says, "metavar": metavar, "type": _TYPES.get(metavar)}
        if metavar == "":
            settings = {"help": says, "action": "store_true"}
        for further in more:
            settings |= further
        parser.add_argument(*flags.split(), **settings)


# What several commands have.
_RUNS = "mujoco, pybullet or a release, mujoco==3.3.7"
_AS_IT_COMES = f"{_RUNS}; pybullet:engine: as its own users meet it"
_EACH = f"all: those that are installed; may be repeated (default {DEFAULT})"


def backend_of(says: str) -> Row:
    """The option --backend, which may be repeated; the command says how often."""
    return "--backend", "NAME", says, {"action": "append"}


ENGINE = backend_of(f"{_AS_IT_COMES} (default {DEFAULT})")  # one
BACKEND = backend_of(f"{_AS_IT_COMES}; {_EACH}")  # one or several
LESSON_BACKEND = backend_of(f"{_RUNS}; {_EACH}")  # the same, each with the contract
SIDES = ("left", "right")
PARTS = ("actuators", "floor")  # of a file, that another side can have, too
JOBS = ("--jobs", "N", "parallel processes (default: one a processor)")
SECONDS = ("--seconds", "S", "simulated time")
TRUST = (
    "--trust-binary",
    "",
    "read a binary model (.mjb); a damaged one can do harm",
)


def menagerie() -> tuple[Row, Row]:
    """The options --trust-binary, which `cli.main` obeys, and --menagerie."""
    folder = os.environ.get("MENAGERIE") or None
    says = "look the model up in this folder of public models (default $MENAGERIE)"
    return TRUST, ("--menagerie", "DIR", says, {"default": folder})


def json_of(what: str = "result") -> Row:
    """The option --json."""
    return "--json", "", f"print the {what} as JSON"


def model_of(says: str = "the model", default: str | None = None) -> Row:
    """The model, as a word."""
    says += f" (default {default})" if default else ""
    return "model", "NAME|FILE", says, {"nargs": "?", "default": default}


def seed_of(what: str) -> Row:
    """The option --seed."""
    return "--seed", "N", f"random seed of {what} (0)", {"default": 0}


# As `scenarios.SCENARIOS`, which needs NumPy; a test compares them.
EXPERIMENTS = {
    "hold": "the servos go to one pose and hold it",
    "gravity": "actuators off: what can move falls",
    "droop": "nobody writes ctrl: the servos keep their first targets",
    "fall": "actuators off, and nothing can touch",
    "box": "the SO-101 swings with a box in its jaws",
    "waves": "every actuator follows waves that a seed draws",
}


def experiments() -> str:
    """Return a line for each experiment."""
    return "\n".join(f"  {name:<9} {says}" for name, says in EXPERIMENTS.items())


class TerminalReporter:
    """A `Reporter` that shows a bar of progress and prints each note, on standard error."""

    def stage(self, what: str) -> AbstractContextManager[Callable[[float], None]]:
        """Show a bar for a stage of the work."""
        from ..report.terminal import progress

        return progress(what)

    def note(self, text: str) -> None:
        """Print a note in one line."""
        complain(text, 0)


# Options that several commands have.
_RUNS = "mujoco, pybullet or a release, mujoco==3.3.7"
_EACH = f"all: those that are installed; may be repeated (default {DEFAULT})"
ONE_BACKEND = f"{_RUNS}; pybullet:engine: as its own users meet it (default {DEFAULT})"
EACH_BACKEND = f"{_RUNS}; pybullet:engine: as its own users meet it; {_EACH}"
CONTRACT_BACKENDS = f"{_RUNS}; {_EACH}"  # each with the contract of this library
SIDES = ("left", "right")


def add_backend(parser: argparse._ActionsContainer, says: str) -> None:
    """Add --backend, which may be repeated; the command says how often."""
    parser.add_argument("--backend", action="append", metavar="NAME", help=says)


def add_json(
    parser: argparse._ActionsContainer, what: str = "result", default: object = False
) -> None:
    """Add --json, which prints the result as JSON.

    Args:
        parser: The parser that gets the option.
        what: What the help calls the result.
        default: `argparse.SUPPRESS` where a parser above this one has the option, too.
    """
    says = f"print the {what} as JSON"
    parser.add_argument("--json", action="store_true", default=default, help=says)


def add_seed(parser: argparse._ActionsContainer, what: str) -> None:
    """Add --seed, of what is drawn at random."""
    says = f"random seed of {what} (0)"
    parser.add_argument("--seed", type=typed_int, default=0, metavar="N", help=says)


def add_seconds(parser: argparse._ActionsContainer) -> None:
    """Add --seconds, the simulated time."""
    parser.add_argument("--seconds", type=typed_float, metavar="S", help="simulated time")


def add_timestep(parser: argparse._ActionsContainer) -> None:
    """Add --timestep, the length of a step."""
    parser.add_argument("--timestep", type=typed_float, metavar="S", help="length of a step [s]")


def add_jobs(parser: argparse._ActionsContainer) -> None:
    """Add --jobs, the number of processes."""
    says = "parallel processes (default: one a processor)"
    parser.add_argument("--jobs", type=typed_int, metavar="N", help=says)


def add_model(
    parser: argparse._ActionsContainer, says: str = "the model", default: str | None = None
) -> None:
    """Add the model, as a word that may be left out."""
    if default is not None:
        says += f" (default {default})"
    parser.add_argument("model", nargs="?", default=default, metavar="NAME|FILE", help=says)


def add_trust(parser: argparse._ActionsContainer) -> None:
    """Add --trust-binary, which `cli.main` obeys."""
    says = "read a binary model (.mjb); a damaged one can do harm"
    parser.add_argument("--trust-binary", action="store_true", help=says)


def add_menagerie(parser: argparse._ActionsContainer) -> None:
    """Add --menagerie, the folder in which models are looked up, and --trust-binary."""
    add_trust(parser)
    folder = os.environ.get("MENAGERIE") or None
    says = "look the model up in this folder of public models (default $MENAGERIE)"
    parser.add_argument("--menagerie", default=folder, metavar="DIR", help=says)


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


def chosen_backends(words: Sequence[str] | None) -> list[BackendChoice]:
    """Return the backends that --backend names, as they were typed.

    Args:
        words: What was typed, MuJoCo where nothing was; "all" are those of all engines, whether or
            not they are installed.

    Raises:
        UnknownNameError: There is no such backend.
    """
    from ..backends import BackendChoice, backend_names, parse_backend

    chosen: list[BackendChoice] = []
    for word in words or [DEFAULT]:
        if word == "all":
            chosen += [BackendChoice(name) for name in backend_names()]
        else:
            chosen.append(parse_backend(word))
    return chosen


def one_backend(words: Sequence[str] | None, what: str) -> BackendChoice:
    """Return the one backend that --backend names.

    Args:
        words: What was typed.
        what: The command, for the message.

    Raises:
        BadInputError: Several are named.
        UnknownNameError: There is no such backend.
    """
    chosen = chosen_backends(words)
    if len(chosen) > 1 or "all" in (words or ()):
        raise BadInputError(f"{what} takes one --backend; got {' and '.join(words or ())}")
    return chosen[0]


def on_each_backend(
    options: argparse.Namespace, what: str, model: str, run: Callable[[Any, str, Any], Any]
) -> dict[str, Any]:
    """Return results by backend; an engine that is missing is named and left out of `all`.

    Args:
        options: Its `backend` and `menagerie` are read.
        what: Shown beside the progress.
        model: A model's name or file.
        run: Called with the Model, the backend's name and what is told the fraction that is done.
    """
    from ..report.terminal import progress

    words = options.backend
    everyone = words is not None and "all" in words
    results: dict[str, Any] = {}
    missing: list[StateMachineError] = []
    for backend in dict.fromkeys(chosen_backends(words)):
        try:
            loaded = backend.load_to_run(model, menagerie=options.menagerie)
        except (MissingEngineError, ModelError, UnsupportedError) as error:
            if not everyone:
                raise
            missing.append(error)
            continue
        with progress(f"{what} on {backend}") as report:
            results[str(backend)] = run(loaded, str(backend), report)
    say_missing([*{str(error): error for error in missing}.values()], results)  # each text once
    return results


def say_missing(errors: Sequence[StateMachineError], others: Collection[Any]) -> None:
    """A line for each engine that is missing; the last one is raised where there is no other."""
    for error in errors if others else errors[:-1]:
        complain(error, MISSING)
    if not others:
        raise errors[-1]


def pairs_of(given: list[str], option: str) -> dict[str, str]:
    """Names of the left and what the right calls them, from words A=B."""
    names: dict[str, str] = {}
    for text in given:
        left, sign, right = text.partition("=")
        if not (left and sign and right):
            raise BadInputError(f"{option} wants A=B, a name of A's and one of B's; got {text!r}")
        names[left] = right
    return names


def show(page: Any, result: Any, as_json: bool, footer: str = "", reader: Any = None) -> int:
    """Print a page, or what it was made from as JSON; the exit code."""
    if as_json:
        from ..report.as_json import dumps

        print(dumps(result))
    else:
        from ..report import terminal

        terminal.show(page, footer, reader)
    return 0 if page.holds else SAYS_NO
