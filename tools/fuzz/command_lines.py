"""Odd command lines: no traceback, one line on standard error, a documented exit code."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

from ._tally import Tally, command, run_bounded

TRIES = 100
# Well; the result says no; bad input; an engine is missing; nowhere to write.
_CODES = (0, 1, 2, 3, 74)
_NUMBERS = [
    "nan", "inf", "-1", "0", "1e308", "1e400", "0x10", "٣", "1_0", "", " ", "1,5", "--", "½",
    "9" * 400, "0.001", "1e-300", "1e9", "2147483648", "True",
]  # fmt: skip
_NAMES = [
    "so101", "so101/scen", "", "/", "/dev/null", "/dev/zero", "nofile.xml", "ü.xml", "\u202e.xml",
    "a\nb", "<script>", "~nobody/x.xml", "x" * 5000 + ".xml", "t.npz", "-x", "*", "%s%n", "\udcff",
    "\udcff.xml", "file:///etc/passwd", "bad.npz", "empty.parquet", "folder.npz",
]  # fmt: skip
_OUTPUTS = [
    "o.npz", "o.csv", "o.svg", "o.html", "/dev/full", "/nowhere/o.npz", "o", "", ".", "a\nb.npz",
    "x" * 300 + ".npz", "folder.npz", "\udcff.npz", "link.npz",
]  # fmt: skip
BASES = [
    ["lesson", "state"],
    ["lesson", "gravity", "--json"],
    ["conventions", "quaternion"],
    ["fingertip", "so101", "--poses", "5", "--seed", "1"],
    ["doctor"],
    ["check", "idle.py", "--time-limit", "1"],
    ["compare", "hold", "--seconds", "0.05", "--no-why"],
    ["compare", "t.npz", "t.npz", "--json"],
    ["compare", "hold", "so101", "timestep=0.01", "--seconds", "0.05", "--json"],
    ["compare", "--models", "so101", "so101/scene"],
    ["trace", "record", "hold", "--seconds", "0.05", "-o", "o.npz"],
    ["trace", "record", "idle.py", "--seconds", "0.05", "-o", "o.npz"],
    ["trace", "play", "t.npz", "-o", "o.npz"],
    ["trace", "show", "t.npz"],
    ["trace", "csv", "t.npz", "-o", "o.csv"],
    ["view", "--seconds", "0.1", "--port", "0"],
]


def run(seed: int, tries: int) -> Tally:
    """Change one word of commands that are well."""
    draw, tally = random.Random(seed), Tally()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        furnish(folder)
        for _ in range(tries):
            words = odd(draw)
            tally.tried += 1
            problem = examine(command(*words), folder)
            if problem:
                tally.failures.append(f"{words}: {problem}")
    return tally


def odd(draw: random.Random) -> list[str]:
    """Draw a command with a word changed, left out, put in or said twice."""
    words = list(draw.choice(BASES))
    place = draw.randrange(1, len(words)) if len(words) > 1 else 1
    pool = draw.choice([_NUMBERS, _NAMES, _OUTPUTS])
    kind = draw.random()
    if kind < 0.6 and place < len(words):
        words[place] = draw.choice(pool)
    elif kind < 0.75 and place < len(words):
        del words[place]
    elif kind < 0.9:
        words.insert(place, draw.choice(pool))
    else:
        words.append(words[-1])
    return words


def examine(words: list[str], folder: Path) -> str:
    """Return what is wrong with how a command ends, or ""."""
    code, out, said = run_bounded(words, folder)
    if code is None:
        return "it hangs"
    if "Traceback" in out + said or "Exception ignored" in said:
        return f"a traceback: {said[-200:]}"
    if code not in _CODES:
        return f"exit code {code}"
    lines = [line for line in said.splitlines() if line.strip()]
    if code == 2 and len(lines) != 1:
        return f"{len(lines)} lines on standard error: {said[:200]}"
    return ""


def furnish(folder: Path) -> None:
    """Write the files that the commands work on."""
    run_bounded(command("trace", "record", "hold", "--seconds", "0.05", "-o", "t.npz"), folder)
    (folder / "idle.py").write_text("def controller(model, data): return None\n")
    (folder / "bad.npz").write_bytes(b"PK\x03\x04garbage")
    (folder / "empty.parquet").touch()
    (folder / "folder.npz").mkdir()
    (folder / "link.npz").symlink_to("t.npz")
