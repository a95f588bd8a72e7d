"""Run the fuzzers: `python -m tools.fuzz [--seed N] [--times X] [TARGET …]`.

A target is a file of this folder with `run(seed, tries) -> Tally`, and TRIES, how many inputs it
tries: many where one takes microseconds, and enough where one takes a process. So a seed tries the
same on any machine. Each target runs in a process of its own, so that a crash is a failure that is
counted.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ._tally import ROOT, Tally, environment, limit_memory

_FOLDER = Path(__file__).resolve().parent
_PATIENCE = 1800.0  # seconds for a target on a busy machine; each input has a limit of its own
_WIDTH = 100  # of a failure in the table


def targets() -> list[str]:
    """Return the names of all targets."""
    return sorted(path.stem for path in _FOLDER.glob("[!_]*.py"))


def run_apart(target: str, seed: int, times: float) -> Tally:
    """Run a target in a child process; the end of the child is a failure, too.

    Args:
        target: Its name.
        seed: Of what is drawn.
        times: How many times its TRIES; at least one input.
    """
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "tally.json"
        words = [sys.executable, "-m", "tools.fuzz", "--child", str(answer), target]
        words += ["--seed", str(seed), "--times", str(times)]
        child = subprocess.Popen(
            words, cwd=ROOT, env=environment(), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL
        )
        try:
            _, said = child.communicate(timeout=_PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
            child.communicate()
            return Tally(0, [f"it did not end within {_PATIENCE:g} s"])
        except BaseException:
            child.kill()
            raise
        if child.returncode != 0 or not answer.exists():
            last = (said.decode(errors="replace").strip() or "nothing said").splitlines()[-1]
            return Tally(0, [f"its process ended with code {child.returncode}: {last}"])
        return Tally(**json.loads(answer.read_text()))


def main() -> int:
    """Run the targets, show the table; 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(targets()))
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of all that is drawn (0)")
    parser.add_argument("--times", type=float, default=1.0, metavar="X", help="as many tries (1)")
    parser.add_argument("--child", default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    unknown = sorted(set(options.targets) - set(targets()))
    if unknown:
        parser.error(f"no target {unknown[0]!r}; known: {', '.join(targets())}")
    if options.child:
        limit_memory()
        module = importlib.import_module(f"tools.fuzz.{options.targets[0]}")
        tally = module.run(options.seed, max(1, round(options.times * module.TRIES)))
        Path(options.child).write_text(json.dumps(dataclasses.asdict(tally)))
        return 0
    rows = []
    for number, target in enumerate(chosen := options.targets or targets(), start=1):
        print(f"{number}/{len(chosen)} {target} ...", file=sys.stderr)
        began = time.monotonic()
        rows.append((target, run_apart(target, options.seed, options.times)))
        print(f"    {time.monotonic() - began:.0f} s", file=sys.stderr)
    print(f"{'target':<16}{'seed':>6}{'tried':>8}{'failures':>10}  first failure")
    for target, tally in rows:
        first = " ".join(tally.failures[0].split())[:_WIDTH] if tally.failures else "none"
        print(f"{target:<16}{options.seed:>6}{tally.tried:>8}{len(tally.failures):>10}  {first}")
    return int(any(tally.failures for _, tally in rows))


if __name__ == "__main__":
    raise SystemExit(main())
