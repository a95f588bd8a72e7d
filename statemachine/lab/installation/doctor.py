"""What works on this machine, what does not, and what to do about it."""

from __future__ import annotations

import importlib.metadata
import platform
import subprocess
import sys
from dataclasses import dataclass, replace

from ...engines import raw_engine_of
from ...installed import DEFAULT, ENGINES, engine_version
from ...installing import install_command, pip, wheel_here
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render

_PATIENCE = 60  # seconds for an import


@dataclass(frozen=True)
class HealthCheck:
    """One thing looked at: its state, and the next step if it is not well."""

    name: str
    works: bool
    found: str
    next_step: str = ""
    optional: bool = False


@dataclass(frozen=True)
class OptionalPackage:
    """A package that nothing needs but what an extra of this library is for.

    Attributes:
        name: As pip calls it.
        role: What it is for.
        extras: Those that bring it.
        version: That is installed; None where it is not.
    """

    name: str
    role: str
    extras: tuple[str, ...]
    version: str | None


@dataclass(frozen=True)
class Diagnosis:
    """What works on this machine.

    Attributes:
        findings: What was looked at, each with its state.
        packages: The optional ones.
        healthy: Whether everything that is not optional works.
    """

    findings: tuple[HealthCheck, ...]
    packages: tuple[OptionalPackage, ...]
    healthy: bool


@dataclass(frozen=True)
class DoctorPage(PageContent):
    """What the page of a diagnosis shows.

    Attributes:
        diagnosis: Of this machine.
        findings: Table of what was looked at.
        packages: Table of the optional packages.
        install_plot: The command that installs the extra `plot`.
        python: Version of Python; system, machine: what it runs on.
    """

    template = "doctor.md.j2"
    diagnosis: Diagnosis
    findings: Table
    packages: Table
    install_plot: str
    python: str = platform.python_version()
    system: str = platform.system()
    machine: str = platform.machine()

    @property
    def next_steps(self) -> list[HealthCheck]:
        """Return the checks that ask for something to be done."""
        return [finding for finding in self.diagnosis.findings if finding.next_step]


# A package that nothing needs but what an extra of this library is for: as pip calls it, what it
# is for, and the extras that bring it. pyproject.toml names the same, which a test compares;
# `viser` is imported, see `_viewer`.
_PACKAGES = (
    ("pillow", "pictures and films", ("render",)),
    ("matplotlib", "plots", ("plot", "docs", "notebook")),
    ("pyarrow", "parquet traces, sweeps, recordings of an arm", ("parquet", "sweep", "recordings")),
    ("joblib", "sweeps", ("sweep",)),
    ("scipy", "sweeps, fits of an arm", ("sweep", "recordings")),
    ("threadpoolctl", "fits of an arm", ("recordings",)),
    ("distributed", "sweeps through Dask", ("cluster",)),
    ("gymnasium", "reinforcement learning", ("gym",)),
    ("onnxruntime", "walking policies", ("policy",)),
    ("pyyaml", "contracts of policies", ("policy",)),
    ("mujoco-menagerie", "public robots", ("menagerie",)),
    ("robot_descriptions", "public robots", ("robots",)),
    ("pytest", "check --faults", ("faults",)),
    ("jupyterlab", "the path as a notebook", ("notebook",)),
    ("sphinx", "pages (make docs)", ("docs",)),
    ("furo", "pages (make docs)", ("docs",)),
    ("myst-parser", "pages (make docs)", ("docs",)),
)


def examine() -> Diagnosis:
    """Look at Python, the engines, rendering, the viewer, the import name and the extras."""
    python = HealthCheck("python", True, f"{platform.python_version()}, {sys.executable}")
    drawing = HealthCheck("rendering", *raw_engine_of(DEFAULT).drawing_diagnosis(), optional=True)
    findings = [python, *map(_engine, ENGINES), drawing, _viewer(), _clash()]
    packages = [
        OptionalPackage(name, role, extras, _version(name)) for name, role, extras in _PACKAGES
    ]
    healthy = all(finding.works or finding.optional for finding in findings)
    return Diagnosis(tuple(findings), tuple(packages), healthy)


def page(diagnosis: Diagnosis) -> Page:
    """Return the diagnosis as a page."""
    findings = Table.of(
        diagnosis.findings,
        {
            "what": lambda finding: finding.name,
            "state": lambda finding: "works" if finding.works else "no",
            "found": lambda finding: finding.found,
        },
        "What this machine has",
        words={"state", "found"},
    )
    packages = Table.of(
        diagnosis.packages,
        {
            "package": lambda package: package.name,
            "found": lambda package: package.version or "no",
            "for": lambda package: package.role,
            "extra": lambda package: ", ".join(package.extras),
        },
        "Optional packages",
        words={"found", "for", "extra"},
    )
    return render(DoctorPage(diagnosis, findings, packages, install_command("plot")))


def _engine(name: str) -> HealthCheck:
    code = f"from statemachine.installed import require; require({name!r})"
    check = _imported(name, code, name != DEFAULT)
    if check.works:
        return replace(check, found=f"{engine_version(name)}, {ENGINES[name].role}")
    says_what_to_do = any(
        word in check.found for word in ("pip install", "no wheel", "apt-get", "unset it")
    )
    wheel = wheel_here(ENGINES[name])
    if says_what_to_do or check.next_step or not wheel:
        return check
    return replace(check, next_step=f"{pip()} install --force-reinstall {wheel.requirement}")


def _viewer() -> HealthCheck:
    code = "from statemachine.view.server import require_viser; require_viser()"
    check = _imported("viser", code, optional=True)
    return replace(check, found=check.found or f"{_version('viser')}, for `statemachine view`")


def _imported(name: str, code: str, optional: bool) -> HealthCheck:
    """Return whether something can be imported, and what is said if not."""
    # In a subprocess: a broken engine may take its process down, or print at will.
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return HealthCheck(name, False, f"import takes over {_PATIENCE} s", "try again", optional)
    if done.returncode == 0:
        return HealthCheck(name, True, "", optional=optional)
    reason = (done.stderr.strip().splitlines() or [f"import ended with code {done.returncode}"])[-1]
    reason = reason.removeprefix("statemachine.errors.MissingEngineError: ")
    return HealthCheck(name, False, reason, optional=optional)


def _version(name: str) -> str | None:
    """Return the version of an installed package, which is not imported."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _clash() -> HealthCheck:
    version = _version("python-statemachine")
    if version is None:
        return HealthCheck("import name", True, "no other package is imported as statemachine")
    return HealthCheck(
        "import name",
        False,
        f"python-statemachine {version} uses the same import name",
        "pip uninstall python-statemachine, then pip install --force-reinstall statemachine-sim",
    )
