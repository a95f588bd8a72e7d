"""The command line. Nothing heavy is imported before a command needs it."""

from __future__ import annotations

import argparse
import difflib
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from . import __version__
from .errors import (
    EngineWarning,
    MissingEngineError,
    ModelError,
    StateMachineError,
    UnsupportedError,
)
from .lessons import LESSONS, Lesson, module

PROGRAM = "statemachine"
# Exit codes: the result says no; bad input; an engine is missing; nowhere to write.
SAYS_NO, BAD_INPUT, MISSING, NO_OUTPUT = 1, 2, 3, 74


class _Parser(argparse.ArgumentParser):
    """A parser whose every complaint is one line, with the nearest spelling."""

    def error(self, message: str) -> NoReturn:
        message = message.replace("'", "")
        wrong, _, rest = message.partition("invalid choice: ")
        if rest:
            given, _, choices = rest.partition(" (choose from ")
            known = [choice.strip() for choice in choices.rstrip(")").split(",")]
            close = difflib.get_close_matches(given, known, n=1, cutoff=0.5)
            hint = f". Did you mean {close[0]}?" if close else ""
            if given in LESSONS:
                hint = f". Did you mean {PROGRAM} lesson {given}?"
            elif given in ("fingertip", "doctor"):
                hint = f". Did you mean {PROGRAM} {given}?"
            message = f"{wrong}no {given!r}; known: {', '.join(known)}{hint}"
        if "expected one argument" in message:
            flag = message.split(":")[0].removeprefix("argument ").split("/")[0]
            message += f" (one that begins with a minus: {flag}={_after(flag)})"
        print(f"{self.prog}: {message}", file=sys.stderr)
        raise SystemExit(BAD_INPUT)


def _after(flag: str) -> str:
    """What was typed after a flag, to show it as it would be taken."""
    typed = sys.argv[sys.argv.index(flag) + 1 :] if flag in sys.argv else []
    return typed[0] if typed else "-1"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 well, 1 the result says no, 2 bad input."""
    # Closed by the caller, as by >&- or 2>&-.
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a console without Unicode must not end a lesson
            stream.reconfigure(errors="replace")
    warnings.showwarning = _show_warning
    parser = _parser()
    options = parser.parse_args(arguments)
    if getattr(options, "run", None) is None:
        options.run = _list_lessons
    try:
        code = options.run(options)
        sys.stdout.flush()
        return code
    except MissingEngineError as error:
        return _complain(error, MISSING)
    except StateMachineError as error:
        return _complain(error, BAD_INPUT)
    except KeyboardInterrupt:
        print(file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of a pipe left (`| head`)
        _let_go_of_output()
        return 141
    except OSError as error:
        if error.filename is not None:  # a file of the model's
            return _complain(error, BAD_INPUT)
        _let_go_of_output()
        return _complain(OSError(f"the output cannot be written: {error.strerror}"), NO_OUTPUT)


def _show_warning(message: Warning | str, category: type[Warning], *where: Any) -> None:
    """What an engine warns of in one line; where in our code it came up is no help."""
    if issubclass(category, EngineWarning):
        _complain(message, 0)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, *where[:2]))


def _let_go_of_output() -> None:
    """Nothing more can be said there; without this, Python would try once more at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(error: Exception | str, code: int) -> int:
    print(f"{PROGRAM}: {' '.join(str(error).split())}", file=sys.stderr)
    return code


def _overview() -> str:
    lines = [
        "A physics simulator is a state machine that you advance.",
        "",
        "The lessons, in the order of the course:",
        *(f"  {PROGRAM} lesson {name:<9} {lesson.question}" for name, lesson in LESSONS.items()),
        "",
        "And beside them:",
        f"  {PROGRAM} fingertip        the engine against an independent witness",
        f"  {PROGRAM} doctor           what this machine has, and what to do",
        "",
        f"Each takes --help. Start with: {PROGRAM} lesson state",
    ]
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=PROGRAM,
        description="A physics simulator is a state machine that you advance.",
        epilog=f"`{PROGRAM}` alone lists the lessons.",
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(metavar="command")
    lessons = commands.add_parser(
        "lesson", help="run a lesson", description="The lessons, in the order of the course."
    )
    lessons.set_defaults(run=_list_lessons)
    named = lessons.add_subparsers(metavar="name")
    for lesson in LESSONS.values():
        _add_lesson(named, lesson)
    _add_fingertip(commands)
    doctor = commands.add_parser("doctor", help="what this machine has, and what to do")
    doctor.add_argument("--json", action="store_true", help="print the findings as JSON")
    doctor.set_defaults(run=_doctor)
    return parser


def _add_common(parser: argparse.ArgumentParser, model: str) -> None:
    parser.add_argument(
        "--backend", default="mujoco", metavar="NAME", help="an engine, or all (default mujoco)"
    )
    parser.add_argument(
        "--model", default=model, metavar="NAME|FILE", help=f"the model (default {model})"
    )
    parser.add_argument(
        "--menagerie",
        default=os.environ.get("MENAGERIE") or None,
        metavar="DIR",
        help="look the model up in this folder of public models (default $MENAGERIE)",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def _add_lesson(named: Any, lesson: Lesson) -> None:
    parser = named.add_parser(lesson.name, help=lesson.question, description=lesson.question)
    _add_common(parser, lesson.model)
    for option in lesson.options:
        default = "" if option.default is None else f" (default {option.default})"
        parser.add_argument(
            option.flag,
            dest=option.key,
            default=option.default,
            type=_numbers if option.many else option.kind,
            choices=option.choices,
            metavar=None if option.choices else "X,X,…" if option.many else option.key.upper(),
            help=option.help + default,
        )
    parser.set_defaults(run=_run_lesson, lesson=lesson)


def _numbers(text: str) -> list[float]:
    """Numbers of a list like 0,-0.6,1.2."""
    try:
        return [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers like 0,-0.6") from None


def _add_fingertip(commands: Any) -> None:
    parser = commands.add_parser(
        "fingertip",
        help="the engine's fingertip against an independent witness",
        description="Compare a site's pose on an engine with Pinocchio's, over many poses.",
    )
    _add_common(parser, "so101")
    parser.add_argument("--poses", type=int, default=200, metavar="N", help="how many (200)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the poses (0)")
    parser.add_argument("--site", default="gripperframe", help="the frame (gripperframe)")
    parser.add_argument(
        "--witness", default=None, metavar="FILE", help="what Pinocchio reads (default: the model)"
    )
    parser.add_argument(
        "--witness-frame", default=None, metavar="NAME", help="the frame's name there"
    )
    parser.set_defaults(run=_fingertip)


def _list_lessons(_options: argparse.Namespace) -> int:
    print(_overview())
    return 0


def _run_lesson(options: argparse.Namespace) -> int:
    lesson: Lesson = options.lesson
    code = module(lesson.name)
    values = {option.key: getattr(options, option.key) for option in lesson.options}
    results = _on_each_backend(
        options, lesson.name, lambda model, report: code.run(model, values, report)
    )
    names = list(LESSONS)
    later = names[names.index(lesson.name) + 1 :]
    following = f"lesson {later[0]}" if later else "fingertip"
    return _show(options, code, results, f"Next: {PROGRAM} {following}")


def _fingertip(options: argparse.Namespace) -> int:
    from .experiments import fingertip
    from .lessons import fingertip as words

    results = _on_each_backend(
        options,
        "fingertip",
        lambda model, report: fingertip.run(
            model,
            poses=options.poses,
            seed=options.seed,
            site=options.site,
            witness=options.witness,
            witness_frame=options.witness_frame,
            progress=report,
        ),
    )
    return _show(options, words, results)


def _on_each_backend(
    options: argparse.Namespace, what: str, run: Callable[[Any, Any], Any]
) -> dict[str, Any]:
    """Results by backend; an engine that is missing is named and left out of `all`."""
    from .backends import backend_names, load
    from .report.progress import progress

    everyone = options.backend == "all"
    results: dict[str, Any] = {}
    missing: list[StateMachineError] = []
    for backend in backend_names() if everyone else [options.backend]:
        try:
            model = load(options.model, backend=backend, menagerie=options.menagerie)
        except (MissingEngineError, ModelError, UnsupportedError) as error:
            if not everyone:
                raise
            missing.append(error)
            continue
        with progress(f"{what} on {backend}") as report:
            results[backend] = run(model, report)
    refusals = list({str(error): error for error in missing}.values())  # each text once
    for error in refusals if results else refusals[:-1]:
        _complain(error, MISSING)
    if not results:
        raise refusals[-1]
    return results


def _show(
    options: argparse.Namespace,
    words: Any,
    results: dict[str, Any],
    footer: str = "",
) -> int:
    page = words.page(results)
    if options.json:
        from .report.as_json import dumps

        print(dumps(results))
    else:
        from .report.terminal import show

        show(page, footer)
    return 0 if page.holds else SAYS_NO


def _doctor(options: argparse.Namespace) -> int:
    from .report import doctor

    diagnosis = doctor.examine()
    if options.json:
        from .report.as_json import dumps

        print(dumps(diagnosis))
    else:
        from .report.terminal import show

        show(doctor.page(diagnosis))
    return 0 if diagnosis.healthy else MISSING
