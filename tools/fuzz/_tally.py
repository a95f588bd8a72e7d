"""What a target hands back, and what the targets share."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_MEMORY = 6 * 2**30  # bytes of address space that a child may take


@dataclass
class Tally:
    """How many inputs were tried, and a line for each that failed."""

    tried: int = 0
    failures: list[str] = field(default_factory=list)


def limit_memory() -> None:
    """Let this process take no more address space than a fuzzed input should need."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))


def command(*words: str) -> list[str]:
    """Return a command line of this checkout."""
    return [sys.executable, "-m", "statemachine", *words]


def environment() -> dict[str, str]:
    """Return an environment in which this checkout is found, and nothing of the user's counts."""
    kept = {name: value for name, value in os.environ.items() if name != "MENAGERIE"}
    return kept | {"PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def run_bounded(
    words: Sequence[str | bytes], folder: Path, patience: float = 60.0
) -> tuple[int | None, str, str]:
    """Run a process with limits: its exit code, None if it hangs, and what it said."""
    try:
        done = subprocess.run(
            list(words),
            capture_output=True,
            stdin=subprocess.DEVNULL,
            cwd=folder,
            env=environment(),
            timeout=patience,
            preexec_fn=limit_memory if os.name == "posix" else None,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None, "", ""
    return (
        done.returncode,
        done.stdout.decode(errors="replace"),
        done.stderr.decode(errors="replace"),
    )
