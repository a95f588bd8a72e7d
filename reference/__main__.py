"""`python -m reference make` writes the figures, `compare` says what has changed since."""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from .groups import GROUPS, QUICK, absent, changes, figures, write


def main() -> int:
    """Compute groups of figures in processes of their own, and write or compare them."""
    parser = argparse.ArgumentParser("python -m reference", description=__doc__)
    parser.add_argument("action", choices=("make", "compare"))
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=", ".join(GROUPS))
    parser.add_argument("--quick", action="store_true", help="only the groups of `make test`")
    options = parser.parse_args()
    chosen = options.groups or (QUICK if options.quick else tuple(GROUPS))
    asked = [group for group in chosen if not absent(group)]
    done, changed = write if options.action == "make" else changes, 0
    # A process for each group: what one engine keeps for a process reaches no other group.
    with ProcessPoolExecutor(
        os.cpu_count(), mp_context=get_context("spawn"), max_tasks_per_child=1
    ) as pool:
        for group, now in zip(asked, pool.map(figures, asked), strict=True):
            lines = done(group, now)
            changed += len(lines)
            print("\n".join([f"{group}: {len(lines)} changed", *lines]), flush=True)
    return bool(changed)


if __name__ == "__main__":
    sys.exit(main())
