"""Where mutants are tried: a copy of the checkout, and a session of pytest that stays in it."""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from types import TracebackType

from .covered import FROZEN, QUICK, Chosen, environment
from .draw import ROOT, Site
from .session import PIPES, Answer, Order

WORK = ROOT / "build" / "mutants"
# A fault may take twice the processor time of its tests without it, and what starting takes [s].
# The clock only ends what waits for ever: with many other processes it says little.
PROCESSOR = 3.0
CLOCK = 240.0
START, START_CLOCK = 300, 1200.0  # what collecting all tests may take [s]
HARD = 10  # between the limit that ends a process and the one that its forks cannot exceed [s]
_sessions: set[int] = set()  # process identifiers of those that run


def git(*arguments: str) -> str:
    """Return what git prints in the root of the project."""
    return subprocess.check_output(["git", *arguments], cwd=ROOT, text=True).strip()


def copy(name: str) -> Path:
    """Clone what is committed, where shared data are found as they are beside the checkout.

    A clone that stands there already is brought to that commit: its compiled modules stay.
    """
    tree = WORK / name
    if not (tree / ".git").exists():
        shutil.rmtree(tree, ignore_errors=True)
        git("clone", "-q", "--shared", str(ROOT), str(tree))
    inside = "git", "-C", str(tree)
    subprocess.run([*inside, "fetch", "-q", str(ROOT), "HEAD"], check=True)
    subprocess.run([*inside, "reset", "-q", "--hard", "FETCH_HEAD"], check=True)
    link = WORK / "shared"
    if not link.exists() and (ROOT.parent / "shared").exists():
        link.symlink_to(ROOT.parent / "shared")
    return tree


class Session:
    """A process of pytest that has collected tests and runs those of each order in a fork."""

    def __init__(self, tree: Path, arguments: list[str], seconds: int) -> None:
        """Start it.

        Args:
            tree: The copy of the checkout.
            arguments: What pytest is told to collect.
            seconds: Processor time that it may take, without its forks [s].
        """
        self._tree = tree
        self.log = tree.with_suffix(".log")
        reading, answers = os.pipe()
        orders, writing = os.pipe()
        command = [sys.executable, "-m", "pytest", "-p", "tools.mutants.session", "-rfE"]
        with self.log.open("wb") as written:
            self._running = subprocess.Popen(
                [*command, "-p", "no:cacheprovider", *arguments],
                cwd=tree,
                env={**environment(tree), PIPES: f"{orders},{answers}"},
                stdout=written,
                stderr=subprocess.STDOUT,
                pass_fds=(orders, answers),
            )
        _sessions.add(self._running.pid)
        resource.prlimit(self._running.pid, resource.RLIMIT_CPU, (seconds, seconds + HARD))
        os.close(answers)
        os.close(orders)
        self._orders = os.fdopen(writing, "w")
        self._answers = os.fdopen(reading)
        waiting = threading.Timer(START_CLOCK, self._running.kill)
        waiting.start()
        self.ready = bool(self._answers.readline())
        waiting.cancel()

    def run(self, order: Order) -> Answer:
        """Return what comes of an order, and end what its tests left running."""
        try:
            print(json.dumps(asdict(order)), file=self._orders, flush=True)
            answer = Answer(**json.loads(self._answers.readline()))
        finally:
            self._end_others()
        return answer

    def close(self) -> int:
        """End the session, and return its exit code."""
        with contextlib.suppress(BrokenPipeError):
            self._orders.close()
        self._answers.close()
        code = self._running.wait()
        _sessions.remove(self._running.pid)
        self._end_others()
        return code

    def _end_others(self) -> None:
        """End what runs in the copy but the session: a fault may have left that in a loop."""
        mark = f"PYTHONPATH={self._tree}\0".encode()
        for started in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                process = int(started.parent.name)
                if process not in _sessions and mark in started.read_bytes():
                    os.kill(process, signal.SIGKILL)


class Place:
    """A copy of the checkout in which one mutant after the other is tried."""

    def __init__(self, tree: Path) -> None:
        self.tree = tree
        self._session: Session | None = None
        self._passes: dict[str, bool] = {}

    def __enter__(self) -> Place:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._session is not None:
            self._session.close()

    def outcome(self, site: Site, chosen: Chosen) -> tuple[str, str]:
        """Return what became of a mutant, and the test that noticed it.

        A test that fails without the fault too has noticed nothing: the others are tried.
        """
        tests = list(chosen.tests)
        while tests:
            answer = self._answer(site, tests, chosen)
            if answer.test not in tests or self._passes_without(answer.test):
                return answer.result, answer.test
            tests.remove(answer.test)
        return "not covered", ""

    def _answer(self, site: Site, tests: list[str], chosen: Chosen) -> Answer:
        """Return what the tests say of a mutant."""
        path = self.tree / site.mutant.file
        before, after = path.read_bytes(), site.source(self.tree)
        limit = int(PROCESSOR + 2 * chosen.seconds)
        order = Order(tests, limit, CLOCK, site.mutant.file, before.decode(), after.decode())
        with self._with_fault(path, after):
            if not chosen.at_import:
                answer = self._staying().run(order)
                if answer.result != "not patched":
                    return answer
            return self._started(Order(tests, limit, CLOCK))

    @contextlib.contextmanager
    def _with_fault(self, path: Path, source: bytes) -> Iterator[None]:
        """Put a source in the place of a module, and give its own back with its times."""
        self._staying()  # imports what is without a fault
        original, times = path.read_bytes(), path.stat()
        path.write_bytes(source)
        try:
            yield
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def _staying(self) -> Session:
        """Return the session of all tests."""
        if self._session is None:
            ignored = [f"--ignore={path}" for path in FROZEN]
            self._session = Session(self.tree, ["-m", QUICK, *ignored], START)
            if not self._session.ready:
                raise RuntimeError(f"pytest could not collect the tests: {self._session.log}")
        return self._session

    def _started(self, order: Order) -> Answer:
        """Return what the tests say in a process of their own, where imports have the fault."""
        listed = self.tree.with_suffix(".txt")
        listed.write_text("\n".join(order.tests), "utf-8")
        session = Session(self.tree, [f"@{listed}"], order.processor + int(PROCESSOR))
        if session.ready:
            answer = session.run(order)
            session.close()
            return answer
        code = session.close()
        if code in (-signal.SIGXCPU, -signal.SIGKILL):
            return Answer("timed out")
        text = session.log.read_text(errors="replace")
        named = re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE)
        return Answer("killed", named[1] if named else f"exit code {code}")

    def _passes_without(self, test: str) -> bool:
        """Return whether a test passes alone, and without a fault."""
        if test not in self._passes:
            order = Order([test], START, CLOCK)
            self._passes[test] = self._staying().run(order).result == "survived"
        return self._passes[test]
