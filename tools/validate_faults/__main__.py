"""Give every case of `statemachine validate` every wrong parameter, and print which it notices.

    python -m tools.validate_faults                        all cases and engines: half an hour
    python -m tools.validate_faults --until-noticed        one noticed for each engine is enough
    python -m tools.validate_faults --backend mujoco --case bounce --csv matrix.csv

A case that notices nothing on an engine that is right there is a defect: the exit code is 1.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path

from statemachine.backends import parse_backend
from statemachine.lab.validate.cases import CASES, cases_of
from statemachine.lab.validate.variants import Variant, variants_of

from .matrix import Cell, cells_of

BACKENDS = ("mujoco", "pybullet", "pybullet:engine", "motrix")


def _variants(words: Sequence[str]) -> list[Variant]:
    """Return the ways in which backends step."""
    variants: list[Variant] = []
    for word in words:
        variants += variants_of(parse_backend(word))
    return variants


def _of_case(name: str, words: Sequence[str], until_noticed: bool) -> list[Cell]:
    """Return the cells of a case; what a process of its own runs."""
    return list(cells_of(CASES[name], _variants(words), until_noticed))


def blind(cells: Sequence[Cell]) -> list[tuple[str, str]]:
    """Return cases that notice nothing, with the engine and the integrator.

    Where an engine refuses a case, is wrong in it anyway, or reads nothing of what is wrong,
    nothing can be noticed.
    """
    outcomes: dict[tuple[str, str], set[str]] = {}
    for cell in cells:
        outcomes.setdefault((cell.case, cell.variant), set()).add(cell.outcome)
    pairs: list[tuple[str, str]] = []
    for pair, seen in outcomes.items():
        if "noticed" not in seen and "missed" in seen:
            pairs.append(pair)
    return pairs


def nowhere(cells: Sequence[Cell]) -> list[str]:
    """Return cases that notice nothing on any engine."""
    noticed = {cell.case for cell in cells if cell.outcome == "noticed"}
    return [name for name in dict.fromkeys(cell.case for cell in cells) if name not in noticed]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the matrix; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.validate_faults", description=__doc__)
    parser.add_argument("--backend", action="append", help=f"default {', '.join(BACKENDS)}")
    parser.add_argument("--case", action="append", default=[], help="a case or a group")
    parser.add_argument("--until-noticed", action="store_true", help="stop at the first")
    parser.add_argument("--csv", type=Path, help="file for every cell")
    arguments = parser.parse_args(argv)
    words = arguments.backend if arguments.backend else list(BACKENDS)
    run = partial(_of_case, words=words, until_noticed=arguments.until_noticed)
    names = [case.name for case in cases_of(arguments.case)]
    cells: list[Cell] = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, of_case in zip(names, pool.map(run, names), strict=True):
            cells += of_case
            counts = Counter(cell.outcome for cell in of_case)
            print(f"{name:32} {dict(counts)}", flush=True)
    if arguments.csv is not None:
        with arguments.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, ["fault", "case", "variant", "outcome"])
            writer.writeheader()
            writer.writerows(asdict(cell) for cell in cells)
    for name in nowhere(cells):
        print(f"no wrong parameter is noticed by {name} on any engine")
    for name, variant in blind(cells):
        print(f"no wrong parameter is noticed by {name} on {variant}")
    return 1 if nowhere(cells) or blind(cells) else 0


if __name__ == "__main__":
    sys.exit(main())
