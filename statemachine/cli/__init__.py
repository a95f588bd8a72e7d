"""The command line: a file or a folder for each command, which imports nothing heavy early."""

from __future__ import annotations

import argparse
import codecs
import importlib
import io
import os
import sys
import traceback
import warnings
from collections.abc import Collection, Sequence
from contextlib import suppress
from typing import Any, NoReturn

from .. import __version__
from ..errors import EngineWarning, MissingEngineError, StateMachineError, did_you_mean
from ..installed import raise_if_interrupted
from ..show.terminal import spelled
from .commands import COMMANDS, FIRST
from .common import (
    BAD_INPUT,
    FAULT,
    INTERRUPTED,
    MISSING,
    NO_OUTPUT,
    PROGRAM,
    print_error,
)

_MORE = f"""\
more commands:
{{commands}}

`{PROGRAM} lesson --help` lists the lessons.
`{PROGRAM} COMMAND --help` shows the options of a command."""
SHOWN_WARNINGS: set[str] = set()


class _Parser(argparse.ArgumentParser):
    """A parser whose every complaint is one line, with the nearest spelling."""

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, args: Any = None, namespace: Any = None
    ) -> Any:
        """Parse as argparse does, but take words behind an option where words are wanted.

        What argparse leaves over goes to the positionals that take several words, or have none yet.
        What still is over is refused here, by the parser that knows its options.
        """
        options, rest = super().parse_known_args(args, namespace)
        if not any(word.startswith("-") for word in rest):
            for action in self._get_positional_actions():
                value: Any = getattr(options, action.dest, None)
                if action.nargs == "*":
                    setattr(options, action.dest, [*value, *rest])
                    rest = []
                elif rest and action.nargs == "?" and value is action.default:
                    setattr(options, action.dest, rest.pop(0))
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}")
        return options, rest

    def error(self, message: str) -> NoReturn:
        message = " ".join(message.replace("'", "").splitlines())  # as typed words may have
        wrong, _, rest = message.partition("invalid choice: ")
        if rest:
            word, _, choices = rest.partition(" (choose from ")
            known = [choice.strip() for choice in choices.rstrip(")").split(",")]
            message = f"{wrong}no {word!r}{self._hint(word, known)}"
        if "expected one argument" in message:
            flag = message.split(":")[0].removeprefix("argument ").split("/")[0]
            named = {name: each for each in self._actions for name in each.option_strings}
            behind = sys.argv[sys.argv.index(flag) + 1 :] if flag in sys.argv else []
            if behind and behind[0] and behind[0] not in named:
                message += f" (one that begins with a minus: {flag}={behind[0]})"
            elif flag in named and isinstance(metavar := named[flag].metavar, str):
                message += f": {flag} {metavar}"
        if message.startswith("unrecognized arguments: -"):
            word = message.split()[2].partition("=")[0]
            known = {name.lstrip("-"): name for name in self._option_string_actions}
            from ..course.lessons import LESSONS
            from ..measures.text import listed

            others = [x.name for x in LESSONS.values() if word.removeprefix("--") in x.defaults]
            if "lesson" in sys.argv and others:
                message += f"; it is an option of {PROGRAM} lesson {listed(others)}"
            else:
                plain = word == "--model" and "; type the model without it"
                message += plain or did_you_mean(word.lstrip("-"), known, 0.6, known.__getitem__)
        elif message.startswith("unrecognized arguments: "):
            option = "--model" in self._option_string_actions
            message += "; a model is --model FILE" if option else "; this takes no more words"
        print(f"{self.prog}: {message}", file=sys.stderr)
        raise SystemExit(BAD_INPUT)

    def _hint(self, word: str, known: list[str]) -> str:
        """Return what is typed instead of a word that is no choice."""
        from ..course.lessons import LESSONS, moved

        if word in LESSONS:
            return f". Did you mean {PROGRAM} lesson {word}?"
        if moved(word) and "lesson" in self.prog:
            return f" any more; {moved(word)}"
        if word in COMMANDS:
            return f". Did you mean {PROGRAM} {word}?"
        return did_you_mean(word, known) or f"; known: {', '.join(known)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    0: well. 1: the result says no. 2: bad input. 3: an engine is missing. 70: a fault of this
    program, with a traceback. 74: nowhere to write. 130: interrupted. 141: the reader of a pipe
    left.
    """
    _prepare_streams()
    warnings.showwarning = _show_warning
    try:
        options = options_of_words(list(sys.argv[1:] if arguments is None else arguments))
        code = options.run(options)
        sys.stdout.flush()
        return code
    except MissingEngineError as error:
        return print_error(error, MISSING)
    except StateMachineError as error:
        return print_error(error, BAD_INPUT)
    except KeyboardInterrupt:
        with suppress(KeyboardInterrupt):  # a second one
            print(file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of a pipe left (`| head`)
        _let_go_of_output()
        return 141
    except OSError as error:
        return _report_file(error)
    except MemoryError:
        return print_error("this takes more memory than there is", BAD_INPUT)
    except UnicodeError as error:  # a name in a file, or of one
        return print_error(f"this holds text that is not UTF-8: {error}", BAD_INPUT)
    except Exception as error:
        try:
            raise_if_interrupted(error)
        except KeyboardInterrupt:  # while something was imported, which made that fail
            return INTERRUPTED
        return _report_fault(error)


def _prepare_streams() -> None:
    """Let both streams be there, and take letters that their encoding lacks."""
    # Closed by the caller, as by >&- or 2>&-.
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    codecs.register_error("spelled", spelled)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a console without Unicode must not end a lesson
            stream.reconfigure(errors="spelled")


def _report_file(error: OSError) -> int:
    """Say which file cannot be read or written, or that the output cannot be."""
    if error.filename is not None:
        return print_error(f"{error.filename}: {error.strerror or error}", BAD_INPUT)
    _let_go_of_output()
    return print_error(OSError(f"the output cannot be written: {error.strerror}"), NO_OUTPUT)


def _report_fault(error: Exception) -> int:
    """Print an exception that nobody meant to raise, with its traceback, for a report.

    Its exit code is one of its own: 1 is an answer, such as that two sides differ.
    """
    traceback.print_exception(error, file=sys.stderr)
    text = (
        f"this is a fault of {PROGRAM}, and no answer; please report it, with the lines above and "
        "the files that you gave"
    )
    return print_error(text, FAULT)


def options_of_words(words: list[str]) -> argparse.Namespace:
    """Parse the words of a command line."""
    named = next((word for word in words if word in COMMANDS), "")
    parser = parser_of([named])
    if not named:
        from .overview import overview

        parser.set_defaults(run=overview)
    options = parser.parse_args(words)
    if getattr(options, "trust_binary", False):
        from ..backends.binary import TRUST

        os.environ[TRUST] = "1"  # which workers inherit
    return options


def _show_warning(message: Warning | str, category: type[Warning], *where: Any) -> None:
    """Print what an engine warns of in one line; where in our code it came up is no help."""
    if issubclass(category, EngineWarning):
        if str(message) not in SHOWN_WARNINGS:  # a lesson may load a model more than once
            SHOWN_WARNINGS.add(str(message))
            print_error(message, 0)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, *where[:2]))


def _let_go_of_output() -> None:
    """Write no more there; without this, Python would try once more at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def parser_of(wanted: Collection[str]) -> argparse.ArgumentParser:
    """Return a parser that knows all commands, and the options of some."""
    more = [name for name in COMMANDS if name not in FIRST]
    parser = _Parser(
        prog=PROGRAM,
        description="A physics simulator is a state machine that you advance.",
        epilog=_MORE.format(commands="\n".join(f"  {n:<12} {COMMANDS[n]}" for n in more)),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(metavar="command", title="commands")
    for name, help_text in COMMANDS.items():
        shown: dict[str, Any] = {"help": help_text} if name in FIRST else {}
        command = commands.add_parser(name, **shown)
        if name in wanted:
            module = importlib.import_module(f".{name}", __package__)
            command.set_defaults(run=module.run)
            module.add(command)
    return parser
