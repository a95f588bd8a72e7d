"""Put each mutant into a copy of the checkout and run the tests that cover it: `make mutate`."""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import Any

from .covered import Covered, measure
from .draw import ROOT, Mutant, all_sites, by_code, draw, find
from .places import WORK, Place, copy, git
from .renew import NOT_TRIED, Row, renewed

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results.json"
SECOND = HERE / "second.json"
SECONDS = 20.0  # processor time of the tests that judge a mutant, as coverage.py measured it
_STATES = ("killed", "survived", "timed out", "not covered", "gone", NOT_TRIED)


def _measured(tree: Path) -> Path:
    """Return the folder that says which tests run which line of what is committed.

    It is measured once for a state of the package and the tests. Where only files of tests are
    other than when it was last measured, these alone are measured again, and what the other tests
    noticed stands.
    """
    package, tests = (git("rev-parse", f"HEAD:{folder}") for folder in ("statemachine", "tests"))
    folder = WORK / f"covered-{package[:8]}-{tests[:8]}"
    if (folder / "data").exists():
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    for earlier in sorted(
        WORK.glob(f"covered-{package[:8]}-*"), key=lambda at: -at.stat().st_mtime
    ):
        changed = git("diff", "--name-only", earlier.name.rpartition("-")[2], tests).split()
        files = [f"tests/{name}" for name in changed]
        is_tests = all(re.fullmatch(r"tests/test_\w+\.py", name) for name in files)
        if (earlier / "data").exists() and is_tests:
            shutil.copytree(earlier, folder)
            log = folder / "tried.jsonl"
            lines = [
                json.dumps(asdict(line)) + "\n"
                for line in read_tried(log)
                if line.result == "killed" and line.test.partition("::")[0] not in files
            ]
            log.write_text("".join(lines), "utf-8")
            measure(tree, folder, [name for name in files if (tree / name).exists()])
            return folder
    measure(tree, folder)
    return folder


@dataclass(frozen=True)
class Tried:
    """What became of a mutant, as it stands in a line of the log.

    Attributes:
        mutant: The mutant as text.
        result: As in Row.
        test: As in Row.
        seconds: The processor time that its tests were given [s].
    """

    mutant: str
    result: str
    test: str
    seconds: float


def read_tried(log: Path) -> list[Tried]:
    """Return what became of the mutants that were tried before."""
    text = log.read_text("utf-8") if log.exists() else ""
    return [Tried(**json.loads(line)) for line in text.splitlines()]


def _run(
    mutants: Sequence[Mutant], seconds: float, earlier: Mapping[Mutant, str] | None = None
) -> list[Row]:
    """Return every mutant with what became of it; those that an interrupt leaves are not tried.

    Args:
        mutants: The mutants.
        seconds: Processor time that the tests of each may take. One that survived tests of less
            time is tried again.
        earlier: The test that noticed a mutant before.
    """
    noticed_by = earlier or {}
    trees = [copy(f"tree{number}") for number in range(os.cpu_count() or 1)]
    folder = _measured(trees[0])
    standing = by_code(all_sites(trees[0]))
    found = [(mutant, find(mutant, standing)) for mutant in mutants]
    covered = Covered(folder)
    log = folder / "tried.jsonl"  # typed again, what was interrupted goes on
    tried = {line.mutant: line for line in read_tried(log)}
    free: SimpleQueue[Place] = SimpleQueue()
    writing = Lock()
    with ExitStack() as opened, ThreadPoolExecutor(len(trees)) as pool:
        for tree in trees:
            free.put(opened.enter_context(Place(tree)))

        def one(number: int) -> Row:
            mutant, site = found[number]
            known = tried.get(str(mutant))
            is_known = known is not None and (known.result == "killed" or known.seconds >= seconds)
            if known is None or not is_known:
                known = Tried(str(mutant), "gone", "", seconds)
                if site is not None:
                    with writing:
                        chosen = covered.chosen(site, seconds, noticed_by.get(mutant, ""))
                    place = free.get()
                    try:
                        result, test = place.outcome(site, chosen)
                    finally:
                        free.put(place)
                    known = replace(known, result=result, test=test)
                with writing, log.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps(asdict(known)) + "\n")
                tried[str(mutant)] = known
            result = f"{known.result:12} {mutant.file} {mutant.scope} {mutant.kind} {known.test}"
            print(result, flush=True)
            return row_of(number)

        def row_of(number: int) -> Row:
            mutant, site = found[number]
            known = tried.get(str(mutant), Tried(str(mutant), NOT_TRIED, "", 0.0))
            return Row(site.mutant if site else mutant, known.result, known.test)

        # In an order that says nothing of their rooms: what is interrupted is a sample of them.
        order = random.Random(len(found)).sample(range(len(found)), len(found))
        with suppress(KeyboardInterrupt):
            for _ in pool.map(one, order):
                pass
        return [row_of(number) for number in range(len(found))]


def _room(file: str) -> str:
    """Return the room of a module: its folder in the package, two deep at most."""
    _, *folders, name = file.split("/")
    return "/".join(folders[:2]) if folders else name.removesuffix(".py")


def _table(rows: Sequence[Row]) -> str:
    """Return the score by room, as a table."""
    rooms: dict[str, Counter[str]] = defaultdict(Counter)
    for row in rows:
        rooms[_room(row.mutant.file)][row.result] += 1
        rooms["**all**"][row.result] += 1
    lines = ["| room | mutants | " + " | ".join(_STATES) + " | score |", "|---" * 9 + "|"]
    for room, counts in sorted(rooms.items()):
        tried = counts["killed"] + counts["survived"] + counts["not covered"]
        score = f"{counts['killed'] / tried:.0%}" if tried else "–"
        numbers = " | ".join(str(counts[state]) for state in _STATES)
        lines.append(f"| {room} | {counts.total()} | {numbers} | {score} |")
    return "\n".join(lines) + "\n"


def _unnoticed(rows: Sequence[Row]) -> str:
    """Return the mutants that no test noticed, each with what a reader found."""
    lines: list[str] = []
    for state in _STATES[1:]:
        same = [row for row in rows if row.result == state]
        lines += ["", f"### {state.capitalize()}: {len(same)}", ""] if same else []
        for row in same:
            mutant = row.mutant
            line = (
                f"- `{mutant.file}`, `{mutant.scope or 'module'}`, {mutant.kind}: "
                f"`` {mutant.statement} ``, {mutant.index}: `` {mutant.becomes} ``"
            )
            note = f". {row.note}" if row.note else ""
            lines.append((line + note).replace("\n", " "))
    return "\n".join(lines) + "\n"


def _rows(entries: Sequence[dict[str, Any]]) -> list[Row]:
    """Return the mutants of a list, with what became of each."""
    names = {field.name for field in fields(Mutant)}
    rows = []
    for entry in entries:
        mutant = Mutant(**{name: entry[name] for name in names})
        rows.append(Row(mutant, entry["result"], entry["test"], entry.get("note", "")))
    return rows


def read() -> list[Row]:
    """Return the mutants of results.json, with what became of each."""
    return _rows(json.loads(RESULTS.read_text("utf-8")))


def _with_notes(rows: Sequence[Row], before: Sequence[Row]) -> list[Row]:
    """Return rows with the notes that stood beside the same mutants where these survived too."""
    notes = {row.mutant: row.note for row in before}
    return [
        row if row.result == "killed" else replace(row, note=notes.get(row.mutant, row.note))
        for row in rows
    ]


def write(rows: Sequence[Row]) -> None:
    """Write results.json and SCORE.md, and print the score."""
    entries = [row.to_dict() for row in rows]
    RESULTS.write_text(json.dumps(entries, indent=1, ensure_ascii=False) + "\n", "utf-8")
    _write_page()
    print(_table(rows))


def write_second(rows: Sequence[Row], seed: int) -> None:
    """Write second.json, the draw that the tests were not written for, and SCORE.md."""
    told = {
        "date": time.strftime("%Y-%m-%d"),
        "seed": seed,
        "mutants": [row.to_dict() for row in rows],
    }
    SECOND.write_text(json.dumps(told, indent=1, ensure_ascii=False) + "\n", "utf-8")
    _write_page()
    print(_table(rows))


def _write_page() -> None:
    """Write SCORE.md: the list that is replayed, then the second draw."""
    first = read()
    parts = ["# Score\n", "## The list that is replayed\n", _table(first)]
    after = [_unnoticed(first)]
    if SECOND.exists():
        told = json.loads(SECOND.read_text("utf-8"))
        rows = _rows(told["mutants"])
        parts += [f"## Drawn with seed {told['seed']} on {told['date']}\n", _table(rows)]
        after += [f"## Not noticed, seed {told['seed']}\n", _unnoticed(rows)]
    page = "\n".join([*parts, "## Not noticed, of the list\n", *after])
    (HERE / "SCORE.md").write_text(re.sub(r"\n{3,}", "\n\n", page), "utf-8")


def main() -> int:
    """Replay the mutants of results.json, bring them up to date, or draw them anew."""
    parser = argparse.ArgumentParser("python -m tools.mutants", description=__doc__)
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--draw", type=int, metavar="N", help="draw N mutants anew")
    action.add_argument(
        "--renew",
        action="store_true",
        help="bring the list up to date with today's source, and try nothing",
    )
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn (0)")
    parser.add_argument(
        "--seconds",
        type=float,
        default=SECONDS,
        help=f"processor time of the tests of each mutant; survivors of less are tried again "
        f"({SECONDS:g})",
    )
    parser.add_argument(
        "--apart",
        action="store_true",
        help="leave the list as it is: what is drawn is written into second.json",
    )
    options = parser.parse_args()
    if options.renew:
        write(renewed(read(), all_sites(ROOT), options.seed))
        return 0
    if options.draw:
        rows = _run(draw(options.draw, options.seed), options.seconds)
        if options.apart:
            write_second(rows, options.seed)
        else:
            write(_with_notes(rows, read()))
        return 0
    before = read()
    noticed_by = {row.mutant: row.test for row in before}
    mutants = [row.mutant for row in before]
    now = _with_notes(_run(mutants, options.seconds, noticed_by), before)
    write(now)
    lost = [
        row
        for old, row in zip(before, now, strict=True)
        if (old.result, row.result) == ("killed", "survived")
    ]
    for row in lost:
        mutant = row.mutant
        print(f"killed before, survives now: {mutant.file} {mutant.scope}: {mutant.statement}")
    return bool(lost)


if __name__ == "__main__":
    sys.exit(main())
