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
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue

from .covered import Covered, environment, measure
from .draw import ROOT, Mutant, Site, all_sites, draw, find

HERE = Path(__file__).resolve().parent
WORK = ROOT / "build" / "mutants"
RESULTS = HERE / "results.json"
SECONDS = 60.0  # a mutant may take; its tests took a third of that without it
_STATES = ("killed", "survived", "timed out", "not covered", "gone")


def _git(*arguments: str) -> str:
    return subprocess.check_output(["git", *arguments], cwd=ROOT, text=True).strip()


def _copy(name: str) -> Path:
    """A clone of what is committed, beside which shared data are found as beside the checkout."""
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


def _tried(site: Site, tests: list[str], tree: Path) -> tuple[str, str]:
    """What became of a mutant, and the test that noticed it."""
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


def _run(mutants: list[Mutant]) -> list[dict[str, object]]:
    """Every mutant with what became of it."""
    trees = [_copy(f"tree{number}") for number in range(os.cpu_count() or 1)]
    states = [_git("rev-parse", f"HEAD:{folder}")[:8] for folder in ("statemachine", "tests")]
    tested = WORK / "-".join(["covered", *states])
    if not (tested / "data").exists():
        shutil.rmtree(tested, ignore_errors=True)
        measure(trees[0], tested)
    standing: dict[tuple[str, str, int, str], list[Site]] = defaultdict(list)
    for site in all_sites(trees[0]):
        standing[site.mutant.code].append(site)
    found = [(mutant, find(mutant, standing)) for mutant in mutants]
    covered = Covered(tested)
    chosen = [covered.tests(site, SECONDS / 3) if site else [] for _, site in found]
    log = tested / "tried.jsonl"  # typed again, what was interrupted goes on
    log.touch()
    tried = dict(json.loads(line) for line in log.read_text("utf-8").splitlines())
    free: SimpleQueue[Path] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def one(number: int) -> dict[str, object]:
        mutant, site = found[number]
        if str(mutant) not in tried:
            tree = free.get()
            outcome = _tried(site, chosen[number], tree) if site else ("gone", "")
            free.put(tree)
            tried[str(mutant)] = outcome
            with log.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps([str(mutant), outcome]) + "\n")
        result, test = tried[str(mutant)]
        print(f"{result:12} {mutant.file} {mutant.scope} {mutant.kind}", flush=True)
        return {**asdict(site.mutant if site else mutant), "result": result, "test": test}

    with ThreadPoolExecutor(len(trees)) as pool:
        return list(pool.map(one, range(len(found))))


def _table(results: list[dict[str, object]]) -> str:
    """The score by room and what survived, as a page."""
    rooms: dict[str, Counter[str]] = defaultdict(Counter)
    for row in results:
        room = str(row["file"]).split("/")[1].removesuffix(".py")
        rooms[room][str(row["result"])] += 1
        rooms["**all**"][str(row["result"])] += 1
    lines = ["| room | mutants | " + " | ".join(_STATES) + " | score |", "|---" * 8 + "|"]
    for room, counts in sorted(rooms.items()):
        tried = counts.total() - counts["timed out"] - counts["gone"]
        score = f"{counts['killed'] / tried:.0%}" if tried else "–"
        numbers = " | ".join(str(counts[state]) for state in _STATES)
        lines.append(f"| {room} | {counts.total()} | {numbers} | {score} |")
    for state in _STATES[1:]:
        rows = [row for row in results if row["result"] == state]
        lines += ["", f"## {state.capitalize()}: {len(rows)}", ""] if rows else []
        lines += [
            f"- `{row['file']}`, `{row['scope'] or 'module'}`, {row['kind']}: "
            f"`` {row['statement']} ``, {row['index']}: `` {row['becomes']} ``".replace("\n", " ")
            for row in rows
        ]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Replay the mutants of results.json, or draw them anew."""
    parser = argparse.ArgumentParser("python -m tools.mutants", description=__doc__)
    parser.add_argument("--draw", type=int, metavar="N", help="draw N mutants anew")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn (0)")
    options = parser.parse_args()
    before = json.loads(RESULTS.read_text("utf-8")) if not options.draw else []
    fields = tuple(Mutant.__dataclass_fields__)
    kept = [Mutant(**{name: row[name] for name in fields}) for row in before]
    results = _run(kept or draw(options.draw, options.seed))
    lost = [
        new for old, new in zip(before, results, strict=False)
        if (old["result"], new["result"]) == ("killed", "survived")
    ]  # fmt: skip
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", "utf-8")
    (HERE / "SCORE.md").write_text("# Score\n\n" + _table(results), "utf-8")
    print(_table(results).partition("##")[0])
    for row in lost:
        print(f"killed before, survives now: {row['file']} {row['scope']}: {row['statement']}")
    return bool(lost)


if __name__ == "__main__":
    sys.exit(main())
