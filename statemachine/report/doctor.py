"""What works on this machine, what does not, and what to do about it."""

from __future__ import annotations

import importlib.metadata
import platform
import subprocess
import sys
from dataclasses import dataclass, replace

from ..engines import room
from ..installed import DEFAULT, ENGINES, engine_version, wheel_here
from ..page import Page, Table, Text, Verdict

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
        version: That is here; None without it.
    """

    name: str
    role: str
    extras: tuple[str, ...]
    version: str | None = None


# pyproject.toml names the same, which a test compares; `viser` is imported, see `_viewer`.
_PACKAGES = (
    OptionalPackage("pillow", "pictures and films", ("render", "mp4")),
    OptionalPackage("imageio-ffmpeg", "films as mp4", ("mp4",)),
    OptionalPackage("matplotlib", "plots", ("plot", "docs", "notebook")),
    OptionalPackage("pyarrow", "parquet traces, sweeps", ("parquet", "sweep")),
    OptionalPackage("joblib", "sweeps", ("sweep",)),
    OptionalPackage("scipy", "sweeps", ("sweep",)),
    OptionalPackage("distributed", "sweeps through Dask", ("cluster",)),
    OptionalPackage("gymnasium", "reinforcement learning", ("gym",)),
    OptionalPackage("mujoco-menagerie", "public robots", ("menagerie",)),
    OptionalPackage("robot_descriptions", "public robots", ("robots",)),
    OptionalPackage("pytest", "check --mutants", ("mutants",)),
    OptionalPackage("jupyterlab", "the path as a notebook", ("notebook",)),
    OptionalPackage("sphinx", "pages (make docs)", ("docs",)),
    OptionalPackage("furo", "pages (make docs)", ("docs",)),
    OptionalPackage("myst-parser", "pages (make docs)", ("docs",)),
)


@dataclass(frozen=True)
class Diagnosis:
    """All findings, and what optional packages are here."""

    findings: tuple[HealthCheck, ...]
    packages: tuple[OptionalPackage, ...] = ()

    @property
    def healthy(self) -> bool:
        """Whether everything that is not optional works."""
        return all(finding.works or finding.optional for finding in self.findings)


def examine() -> Diagnosis:
    """Look at Python, the engines, rendering, the viewer, the import name and the extras."""
    python = HealthCheck("python", True, f"{platform.python_version()}, {sys.executable}")
    findings = [python, *map(_engine, ENGINES), _rendering(), _viewer(), _clash()]
    packages = (replace(package, version=_version(package.name)) for package in _PACKAGES)
    return Diagnosis(tuple(findings), tuple(packages))


def page(diagnosis: Diagnosis) -> Page:
    """The diagnosis as a page."""
    rows = [
        (finding.name, ("works" if finding.works else "no"), finding.found)
        for finding in diagnosis.findings
    ]
    blocks = [
        Table(("", "", "found"), rows, title="What this machine has", words=frozenset({0, 1, 2})),
        Table(
            ("", "found", "for", "extra"),
            [
                (package.name, package.version or "no", package.role, ", ".join(package.extras))
                for package in diagnosis.packages
            ],
            title="Optional packages",
            words=frozenset({0, 1, 2, 3}),
        ),
        Text("An extra is installed by its name: pip install 'statemachine-sim[plot]'"),
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


def _engine(name: str) -> HealthCheck:
    code = f"from statemachine.installed import require; require({name!r})"
    check = _imported(name, code, name != DEFAULT)
    if check.works:
        return replace(check, found=f"{engine_version(name)}, {ENGINES[name].role}")
    told = any(word in check.found for word in ("pip install", "no wheel", "apt-get", "unset it"))
    wheel = wheel_here(ENGINES[name])
    if told or check.next_step or not wheel:
        return check
    return replace(check, next_step=f"pip install --force-reinstall {wheel.requirement}")


def _viewer() -> HealthCheck:
    name = "viser"
    code = "from statemachine.view.server import require_viser; require_viser()"
    check = _imported(name, code, optional=True)
    if not check.works:
        return check
    return replace(check, found=f"{importlib.metadata.version(name)}, for `statemachine view`")


def _imported(name: str, code: str, optional: bool) -> HealthCheck:
    """Whether something can be imported, and what is said if not."""
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


def _rendering() -> HealthCheck:
    works, found, step = room(DEFAULT).drawing_diagnosis()
    return HealthCheck("rendering", works, found, step, optional=True)


def _version(name: str) -> str | None:
    """Version of an installed package, which is not imported."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _clash() -> HealthCheck:
    try:
        version = importlib.metadata.version("python-statemachine")
    except importlib.metadata.PackageNotFoundError:
        return HealthCheck("import name", True, "statemachine is ours alone")
    return HealthCheck(
        "import name",
        False,
        f"python-statemachine {version} uses the same import name",
        "pip uninstall python-statemachine, then pip install --force-reinstall statemachine-sim",
    )
