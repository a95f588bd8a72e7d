"""What works on this machine, what does not, and what to do about it."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import platform
import subprocess
import sys
from dataclasses import dataclass

from ..installed import ENGINES, engine_version, wheel_here
from ..page import Page, Table, Text, Verdict
from ..rendering.probe import PATIENCE, offscreen_opengl, opengl_remedy

_ROLES = {
    "mujoco": "runs every lesson",
    "pybullet": "the second engine of every lesson",
    "pinocchio": "the witness of `statemachine fingertip`",
}


@dataclass(frozen=True)
class Finding:
    """One thing looked at: its state, and the next step if it is not well."""

    name: str
    works: bool
    found: str
    next_step: str = ""
    optional: bool = False


@dataclass(frozen=True)
class Diagnosis:
    """All findings."""

    findings: tuple[Finding, ...]

    @property
    def healthy(self) -> bool:
        """Whether everything that is not optional works."""
        return all(finding.works or finding.optional for finding in self.findings)


def examine() -> Diagnosis:
    """Look at Python, the engines, rendering and the import name."""
    findings = [_python(), *map(_engine, ENGINES), _rendering(), _clash()]
    return Diagnosis(tuple(findings))


def page(diagnosis: Diagnosis) -> Page:
    """The diagnosis as a page."""
    rows = [
        (finding.name, ("works" if finding.works else "no"), finding.found)
        for finding in diagnosis.findings
    ]
    blocks = [
        Table(("", "", "found"), rows, title="What this machine has", words=frozenset({0, 1, 2}))
    ]
    steps = [f"{f.name}: {f.next_step}" for f in diagnosis.findings if f.next_step]
    return Page(
        "statemachine doctor",
        f"Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        [
            *blocks,
            *(Text(step) for step in steps),
            Verdict(
                "everything that the lessons need on MuJoCo is here"
                if diagnosis.healthy
                else "the lessons cannot run yet: see above",
                diagnosis.healthy,
            ),
        ],
    )


def _python() -> Finding:
    return Finding("python", True, f"{platform.python_version()}, {sys.executable}")


def _engine(name: str) -> Finding:
    optional = name != "mujoco"
    code = f"from statemachine.installed import require; require({name!r})"
    # In a subprocess: a broken engine may take its process down, or print at will.
    try:
        done = _run(code)
    except subprocess.TimeoutExpired:
        return Finding(name, False, f"import takes over {PATIENCE} s", "try again", optional)
    if done.returncode == 0:
        found = f"{engine_version(name)}, {_ROLES[name]}"
        return Finding(name, True, found, optional=optional)
    reason = (done.stderr.strip().splitlines() or [f"import ended with code {done.returncode}"])[-1]
    reason = reason.removeprefix("statemachine.errors.MissingEngineError: ")
    told = any(word in reason for word in ("pip install", "no wheel", "apt-get", "unset it"))
    wheel = wheel_here(ENGINES[name])
    step = "" if told or not wheel else f"pip install --force-reinstall {wheel.requirement}"
    return Finding(name, False, reason, step, optional)


def _rendering() -> Finding:
    if importlib.util.find_spec("mujoco") is None:
        return Finding("rendering", False, "needs mujoco", optional=True)
    works = offscreen_opengl()
    if works is None:
        step = opengl_remedy()
        return Finding("rendering", False, "no offscreen OpenGL", step, optional=True)
    if works == os.environ.get("MUJOCO_GL", ""):
        return Finding("rendering", True, "offscreen", optional=True)
    found = f"offscreen with MUJOCO_GL={works}" if works else "offscreen by default"
    step = f"export MUJOCO_GL={works}" if works else "unset MUJOCO_GL"
    return Finding("rendering", True, found, f"{step}, before rendering", optional=True)


def _clash() -> Finding:
    try:
        version = importlib.metadata.version("python-statemachine")
    except importlib.metadata.PackageNotFoundError:
        return Finding("import name", True, "statemachine is ours alone")
    return Finding(
        "import name",
        False,
        f"python-statemachine {version} uses the same import name",
        "pip uninstall python-statemachine, then pip install --force-reinstall statemachine-sim",
    )


def _run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
