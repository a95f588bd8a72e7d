"""What users can type is in `surface.toml`: a new option or name is a decision, and seen there."""

from __future__ import annotations

import argparse
import re
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

import statemachine as sm
from statemachine import cli
from statemachine.cli.common import (
    BAD_INPUT,
    FAULT,
    INTERRUPTED,
    MISSING,
    NO_OUTPUT,
    SAYS_NO,
)
from statemachine.interface import OPTIONS
from statemachine.interface.records import READ_OPTIONS

from .support.requirements import ROOT


@pytest.fixture(scope="module")
def surface() -> dict[str, Any]:
    """Return what surface.toml says."""
    return tomllib.loads((ROOT / "surface.toml").read_text("utf-8"))


def options_of(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Give the options of a parser and of those below it, hidden ones too."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from options_of(below)
        elif action.option_strings:
            yield max(action.option_strings, key=len)


def test_the_commands_are_those_of_the_surface(surface: dict[str, Any]) -> None:
    assert list(surface["options"]) == sorted(cli.COMMANDS)


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_a_command_has_as_many_options_as_the_surface_says(
    command: str, surface: dict[str, Any]
) -> None:
    parser = cli.parser_of([command])
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    names = {*options_of(commands.choices[command])} - {"--help", "--help-all"}
    assert len(names) == surface["options"][command], sorted(names)


def test_a_side_has_as_many_options_as_the_surface_says(surface: dict[str, Any]) -> None:
    options = (*OPTIONS, *READ_OPTIONS)
    assert len(options) == surface["side"]["options"], options


def test_the_public_names_are_those_of_the_surface(surface: dict[str, Any]) -> None:
    assert surface["names"]["public"] == sorted(dir(sm))


def actions_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Give the options of a parser and of those below it that have a default, each once."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from actions_of(below)
        elif action.default not in (None, argparse.SUPPRESS):
            yield action


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_a_number_in_brackets_at_the_end_of_a_help_is_the_default(command: str) -> None:
    for action in actions_of(cli.parser_of([command])):
        told = re.search(r"\((?:default )?(\d[\d.]*)\)$", action.help or "")
        if told:
            assert float(told[1]) == float(action.default), action.option_strings


def test_exit_codes_are_those_of_sysexits_and_of_the_reference() -> None:
    assert (FAULT, NO_OUTPUT) == (70, 74)  # EX_SOFTWARE, EX_IOERR
    page = (ROOT / "docs" / "api.md").read_text("utf-8").partition("## Exit codes")[2]
    told = {
        int(code) for row in re.findall(r"^\| ([\d, ]+) \|", page, re.M) for code in row.split(",")
    }
    assert told == {0, SAYS_NO, BAD_INPUT, MISSING, FAULT, NO_OUTPUT, INTERRUPTED, 141}
