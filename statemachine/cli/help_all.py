"""--help of a command with many options: those that are needed first; --help-all has all."""

from __future__ import annotations

import argparse
from collections.abc import Collection
from typing import Any


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
    help_text = f"every option: {len(later)} more"
    parser.add_argument("--help-all", action=_HelpAll, nargs=0, const=later, help=help_text)
