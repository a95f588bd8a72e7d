"""`python -m tools.reference make` writes the figures, `compare` says what has changed since."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from .figures import Figures
from .groups import GROUPS, KEPT, QUICK, absent, changes, figures, write


def main() -> int:
    """Compute groups of figures in processes of their own, and write or compare them."""
    parser = argparse.ArgumentParser("python -m tools.reference", description=__doc__)
    parser.add_argument("action", choices=("make", "compare"))
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=", ".join(GROUPS))
    parser.add_argument("--quick", action="store_true", help="only the groups of `make test`")
    parser.add_argument(
        "--folder", type=Path, default=KEPT, help="where figures are kept; tools/reference/figures"
    )
    parser.add_argument(
        "--bits",
        action="store_true",
        help="compare every bit with figures that this machine made: needs --folder",
    )
    options = parser.parse_args()
    if options.bits and options.folder == KEPT:
        parser.error("--bits compares with figures of this machine: give their --folder")
    chosen = options.groups or (QUICK if options.quick else tuple(GROUPS))
    asked = [group for group in chosen if not absent(group)]
    if options.action == "make":
        done = partial(write, folder=options.folder)
    else:
        done = partial(changes, folder=options.folder, bits=options.bits)
    changed = 0
    for group, now in _figures_of(asked):
        lines = done(group, now)
        changed += len(lines)
        print("\n".join([f"{group}: {len(lines)} changed", *lines]), flush=True)
    return bool(changed)


def _figures_of(groups: Sequence[str]) -> Iterator[tuple[str, dict[str, Figures]]]:
    """Yield each group with its figures.

    Several groups have a process each: what one engine keeps for a process reaches no other group.
    """
    if len(groups) == 1:
        yield groups[0], figures(groups[0])
        return
    with ProcessPoolExecutor(
        os.cpu_count(), mp_context=get_context("spawn"), max_tasks_per_child=1
    ) as pool:
        yield from zip(groups, pool.map(figures, groups), strict=True)


if __name__ == "__main__":
    sys.exit(main())
