"""`statemachine lesson`: the lessons, in the order of the course."""

from __future__ import annotations

import argparse
from typing import Any

from ..lessons import LESSONS, Lesson, module
from ._common import PROGRAM, add_model, on_each_backend, show


def add(commands: Any) -> None:
    """The subparser, with one of its own for each lesson."""
    lessons = commands.add_parser(
        "lesson", help="run a lesson", description="The lessons, in the order of the course."
    )
    lessons.set_defaults(run=overview)
    named = lessons.add_subparsers(metavar="name")
    for lesson in LESSONS.values():
        _add_lesson(named, lesson)


def _add_lesson(named: Any, lesson: Lesson) -> None:
    parser = named.add_parser(lesson.name, help=lesson.question, description=lesson.question)
    add_model(parser, lesson.model)
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
    parser.set_defaults(run=run, lesson=lesson)


def _numbers(text: str) -> list[float]:
    """Numbers of a list like 0,-0.6,1.2."""
    try:
        return [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers like 0,-0.6") from None


def overview(_options: argparse.Namespace) -> int:
    """List what there is."""
    lines = [
        "A physics simulator is a state machine that you advance.",
        "",
        "The lessons, in the order of the course:",
        *(f"  {PROGRAM} lesson {name:<9} {lesson.question}" for name, lesson in LESSONS.items()),
        "",
        "And beside them:",
        f"  {PROGRAM} check FILE       your exercise, judged by what it does",
        f"  {PROGRAM} fingertip        the engine against an independent witness",
        f"  {PROGRAM} doctor           what this machine has, and what to do",
        "",
        f"Each takes --help. Start with: {PROGRAM} lesson state",
    ]
    print("\n".join(lines))
    return 0


def run(options: argparse.Namespace) -> int:
    """One lesson, on one backend or all."""
    lesson: Lesson = options.lesson
    code = module(lesson.name)
    values = {option.key: getattr(options, option.key) for option in lesson.options}
    results = on_each_backend(
        options, lesson.name, lambda model, report: code.run(model, values, report)
    )
    names = list(LESSONS)
    later = names[names.index(lesson.name) + 1 :]
    following = f"lesson {later[0]}" if later else "fingertip"
    return show(code.page(results), results, options.json, f"Next: {PROGRAM} {following}")
