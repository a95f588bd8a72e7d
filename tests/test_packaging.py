"""What a user installs: the wheel, in an empty environment, used from another folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from statemachine import __version__

from .support.claims import assert_in
from .support.project import makefile_text, project_table
from .support.requirements import ROOT

PIP = sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"


def _run(*command: str | Path, cwd: Path) -> str:
    # Without what the surrounding checkout put into the environment.
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**clean, "PYTHONUTF8": "1"},
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    _run(*PIP, "wheel", "--no-deps", "--wheel-dir", folder, ROOT, cwd=folder)
    (file,) = folder.glob("*.whl")
    return file


@pytest.mark.slow
@pytest.mark.network
def test_the_wheel_holds_the_models_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert_in(
        names,
        "statemachine/_models/so101/so101.xml",
        "statemachine/_models/so101/look/base_print.stl",
        "statemachine/py.typed",
        *(
            f"statemachine/show/html/{name}"
            for name in ("page.html", "page.css", "notebook.css", "gl.js")
        ),
        *(
            f"statemachine/lab/questions/stage/{name}"
            for name in ("stage.html", "stage.js", "scene.js")
        ),
        "statemachine/lab/recordings/recorded/hold.pybullet.npz",
        "statemachine/lab/recordings/synthetic/meta/info.json",
        "statemachine/lab/recordings/synthetic/data/chunk-000/file-000.parquet",
    )
    tops = {name.split("/")[0] for name in names if ".dist-info/" not in name}
    assert tops == {"statemachine", "statemachine_sim.py"}
    assert not [name for name in names if re.search(r"(^|/)tests?[/_]|__pycache__", name)]


@pytest.mark.slow
@pytest.mark.network
def test_the_installed_wheel_runs_a_lesson_from_another_folder(wheel: Path, tmp_path: Path) -> None:
    home = tmp_path / "environment"
    _run(sys.executable, "-m", "venv", "--without-pip", home, cwd=tmp_path)
    binaries = home / ("Scripts" if os.name == "nt" else "bin")
    pip = (*PIP, "--python", binaries / "python")
    # Only what the commands import is compiled, when they do.
    install = "install", "--no-compile", "-c", ROOT / "constraints.txt", wheel
    _run(*pip, *install, cwd=tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    page = _run(binaries / "statemachine", "lesson", "gravity", cwd=elsewhere)
    assert re.search(r"0\.033°\s+23\.92°", page)
    _run(binaries / "statemachine", "fingertip", cwd=elsewhere)
    where = _run(
        binaries / "python",
        "-c",
        "import statemachine; print(statemachine.__file__)",
        cwd=elsewhere,
    )
    assert str(home) in where
    assert not list(elsewhere.iterdir())


def test_constraints_pin_every_dependency_without_addresses() -> None:
    text = (ROOT / "constraints.txt").read_text()
    assert "://" not in text
    project = project_table()
    asked = project["dependencies"], *project["optional-dependencies"].values()
    names = {re.split(r"[\[><=;\s]", line)[0].lower() for lines in asked for line in lines}
    assert names - {"statemachine-sim"} <= set(re.findall(r"^(\S+?)==", text, re.MULTILINE))


def test_the_citation_names_this_version_and_the_contributors() -> None:
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    assert re.findall(r"^version: (.+)$", text, re.MULTILINE) == [__version__]
    assert re.findall(r"^  - name: (.+)$", text, re.MULTILINE) == ["statemachine contributors"]


def test_no_machine_path_and_no_address_is_committed() -> None:
    listed = subprocess.run(
        ["git", "ls-files"], capture_output=True, text=True, cwd=ROOT, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    addresses = re.compile("index" + r"-url|https?://[^ )\"]*(/simple|[.]whl)")
    paths = re.compile(r"(?<![\w.])/(home|root|Users|work)/\w")
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix in (".png", ".stl", ".npz", ".onnx", ".parquet") or not path.is_file():
            continue
        text = path.read_text()
        assert not paths.search(text), name
        assert not addresses.search(text), name


def test_every_target_of_the_makefile_that_is_documented_exists() -> None:
    text = makefile_text()
    targets = set(" ".join(re.findall(r"^([a-z][a-z -]*):", text, re.MULTILINE)).split())
    assert {"lesson", "test", "check", "bench", "test-slow", "test-newest", "picture"} <= targets
    assert set(re.findall(r"^# make ([a-z-]+)", text, re.MULTILINE)) <= targets
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    text = "\n".join(page.read_text("utf-8") for page in pages)
    used = set(re.findall(r"`make ([a-z-]+)`|^make ([a-z-]+)", text, re.MULTILINE))
    assert {"lesson", "check"} <= {name for pair in used for name in pair if name} <= targets
