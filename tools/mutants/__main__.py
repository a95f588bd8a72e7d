"""Put each mutant into a copy of the checkout and run the tests that cover it: `make mutate`."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

from .covered import Covered, environment, measure
from .draw import ROOT, Mutant, Site, all_sites, by_code, draw, find
from .renew import NOT_TRIED, Row, renewed

HERE = Path(__file__).resolve().parent
WORK = ROOT / "build" / "mutants"
RESULTS = HERE / "results.json"
SECONDS = 60.0  # a mutant may take; its tests took a third of that without it
_STATES = ("killed", "survived", "timed out", "not covered", "gone", NOT_TRIED)


def _git(*arguments: str) -> str:
    return subprocess.check_output(["git", *arguments], cwd=ROOT, text=True).strip()


def _copy(name: str) -> Path:
    """Clone what is committed, where shared data are found as they are beside the checkout."""
    tree = WORK / name
    shutil.rmtree(tree, ignore_errors=True)
    _git("clone", "-q", "--shared", str(ROOT), str(tree))
    link = WORK / "shared"
    if not link.exists() and (ROOT.parent / "shared").exists():
        link.symlink_to(ROOT.parent / "shared")
    return tree


def _end(running: subprocess.Popen[bytes], tree: Path) -> None:
    """End the tests of a copy, with what they started: a fault may have left that in a loop."""
    running.kill()
    running.wait()
    mark = f"PYTHONPATH={tree}\0".encode()
    for started in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark in started.read_bytes():
                os.kill(int(started.parent.name), signal.SIGKILL)


def outcome_of(site: Site, tests: list[str], tree: Path) -> tuple[str, str]:
    """Return what became of a mutant, and the test that noticed it."""
    if not tests:
        return "not covered", ""
    path, listed = tree / site.mutant.file, tree.with_suffix(".txt")
    original, times = path.read_bytes(), path.stat()
    listed.write_text("\n".join(tests), "utf-8")
    path.write_bytes(site.source(tree))
    command = [sys.executable, "-m", "pytest", "-x", "-rfE", "-p", "no:cacheprovider", f"@{listed}"]
    log = tree.with_suffix(".log")
    with log.open("wb") as written:
        running = subprocess.Popen(
            command, cwd=tree, env=environment(tree), stdout=written, stderr=subprocess.STDOUT
        )
        try:
            running.wait(SECONDS)
        except subprocess.TimeoutExpired:
            return "timed out", ""
        finally:
            _end(running, tree)
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    if running.returncode == 0:
        return "survived", ""
    named = re.search(r"^(?:FAILED|ERROR) (\S+)", log.read_text(errors="replace"), re.MULTILINE)
    return "killed", named[1] if named else f"exit code {running.returncode}"


def _run(mutants: Sequence[Mutant]) -> list[Row]:
    """Return every mutant with what became of it."""
    trees = [_copy(f"tree{number}") for number in range(os.cpu_count() or 1)]
    states = [_git("rev-parse", f"HEAD:{folder}")[:8] for folder in ("statemachine", "tests")]
    tested = WORK / "-".join(["covered", *states])
    if not (tested / "data").exists():
        shutil.rmtree(tested, ignore_errors=True)
        measure(trees[0], tested)
    standing = by_code(all_sites(trees[0]))
    found = [(mutant, find(mutant, standing)) for mutant in mutants]
    covered = Covered(tested)
    chosen = [covered.tests(site, SECONDS / 3) if site else [] for _, site in found]
    log = tested / "tried.jsonl"  # typed again, what was interrupted goes on
    log.touch()
    tried = dict(json.loads(line) for line in log.read_text("utf-8").splitlines())
    free: SimpleQueue[Path] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def one(number: int) -> Row:
        mutant, site = found[number]
        if str(mutant) not in tried:
            tree = free.get()
            outcome = outcome_of(site, chosen[number], tree) if site else ("gone", "")
            free.put(tree)
            tried[str(mutant)] = outcome
            with log.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps([str(mutant), outcome]) + "\n")
        result, test = tried[str(mutant)]
        print(f"{result:12} {mutant.file} {mutant.scope} {mutant.kind}", flush=True)
        return Row(site.mutant if site else mutant, result, test)

    with ThreadPoolExecutor(len(trees)) as pool:
        return list(pool.map(one, range(len(found))))


def _room(file: str) -> str:
    """Return the room of a module: its folder in the package, two deep at most."""
    _, *folders, name = file.split("/")
    return "/".join(folders[:2]) if folders else name.removesuffix(".py")


def _table(rows: Sequence[Row]) -> str:
    """Return the score by room and what survived, as a page."""
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
    for state in _STATES[1:]:
        mutants = [row.mutant for row in rows if row.result == state]
        lines += ["", f"## {state.capitalize()}: {len(mutants)}", ""] if mutants else []
        lines += [
            f"- `{mutant.file}`, `{mutant.scope or 'module'}`, {mutant.kind}: "
            f"`` {mutant.statement} ``, {mutant.index}: `` {mutant.becomes} ``".replace("\n", " ")
            for mutant in mutants
        ]
    return "\n".join(lines) + "\n"


def read() -> list[Row]:
    """Return the mutants of results.json, with what became of each."""
    rows = []
    for entry in json.loads(RESULTS.read_text("utf-8")):
        result, test = entry.pop("result"), entry.pop("test")
        rows.append(Row(Mutant(**entry), result, test))
    return rows


def write(rows: Sequence[Row]) -> None:
    """Write results.json and SCORE.md, and print the score."""
    entries = [row.to_dict() for row in rows]
    RESULTS.write_text(json.dumps(entries, indent=1, ensure_ascii=False) + "\n", "utf-8")
    (HERE / "SCORE.md").write_text("# Score\n\n" + _table(rows), "utf-8")
    print(_table(rows).partition("##")[0])


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
    options = parser.parse_args()
    if options.renew:
        write(renewed(read(), all_sites(ROOT), options.seed))
        return 0
    if options.draw:
        write(_run(draw(options.draw, options.seed)))
        return 0
    before = read()
    now = _run([row.mutant for row in before])
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
