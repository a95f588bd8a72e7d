"""Write the zip files of a course: `make student-kit`, `make autograder`.

The student's kit has no solution in it. Both bring the wheel, so that nothing but its
dependencies is asked of a package index.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
HERE = Path(__file__).parent
_WHEN = (2020, 1, 1, 0, 0, 0)  # the same files make the same zip


def wheel(folder: Path) -> Path:
    """Build the wheel into a folder."""
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check"]
    subprocess.run([*command, "--no-deps", "-w", str(folder), str(ROOT)], check=True)
    (built,) = folder.glob("*.whl")
    return built


def student_kit(built: Path) -> dict[str, bytes]:
    """Return what a student needs, by name in the zip."""
    exercises = {name: template_of(name) for name in ("step_loop.py", "test_arm.py", "conftest.py")}
    start = (HERE / "START.md").read_text(encoding="utf-8").replace("WHEEL", built.name)
    return {
        built.name: built.read_bytes(),
        "README.md": start.encode(),
        "constraints.txt": (ROOT / "constraints.txt").read_bytes(),
        "path.ipynb": (ROOT / "notebooks" / "path.ipynb").read_bytes(),
        **{f"exercises/{name}": content for name, content in exercises.items()},
    }


def template_of(name: str) -> bytes:
    """Return a student's file as it is handed out.

    Raises:
        SystemExit: Somebody has worked in it.
    """
    content = (ROOT / "exercises" / name).read_bytes()
    unwritten = content.count(b"raise NotImplementedError(")
    if (name == "step_loop.py" and unwritten != 4) or is_changed(ROOT / "exercises" / name):
        raise SystemExit(
            f"exercises/{name} is not as it is handed out: restore it first. To keep what was "
            f"tried: cp exercises/{name} my_{name}; then: git restore --staged --worktree "
            f"exercises/{name}"
        )
    return content


def is_changed(file: Path) -> bool:
    """Return whether a file differs from the one that is committed; False outside a repository."""
    command = ["git", "-C", str(ROOT), "diff", "--quiet", "HEAD", "--", str(file)]
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 1
    except OSError:
        return False


def autograder(built: Path) -> dict[str, bytes]:
    """Return what Gradescope unpacks as /autograder/source, by name in the zip."""
    return {
        built.name: built.read_bytes(),
        "constraints.txt": (ROOT / "constraints.txt").read_bytes(),
        "run_autograder": (HERE / "gradescope" / "run_autograder").read_bytes(),
        "setup.sh": (HERE / "gradescope" / "setup.sh").read_bytes(),
    }


def write(target: Path, files: dict[str, bytes]) -> None:
    """Write a zip beside its place, then rename it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    beside = target.with_suffix(".tmp")
    with zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in sorted(files.items()):
            info = zipfile.ZipInfo(name, _WHEN)
            info.compress_type = zipfile.ZIP_DEFLATED
            runs = name.endswith(".sh") or name == "run_autograder"
            info.external_attr = (0o755 if runs else 0o644) << 16
            out.writestr(info, content)
    beside.replace(target)


KITS = {"student-kit": student_kit, "autograder": autograder}

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        made = wheel(Path(folder))
        for kit in sys.argv[1:]:
            file = ROOT / "dist" / f"statemachine-{kit}.zip"
            write(file, KITS[kit](made))
            print(file.relative_to(ROOT))
