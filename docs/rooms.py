"""How many files and lines each room of the package has: `python docs/rooms.py`."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "statemachine"


def rooms() -> dict[str, list[Path]]:
    """Return the modules of each room: a folder of the package, or a module beside them."""
    found: dict[str, list[Path]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        found.setdefault(f"{parts[0]}/" if len(parts) > 1 else parts[0], []).append(path)
    return found


def table() -> str:
    """Write a table of files and lines, the largest room first."""
    lines = {
        room: sum(len(path.read_text("utf-8").splitlines()) for path in paths)
        for room, paths in rooms().items()
    }
    files = {room: len(paths) for room, paths in rooms().items()}
    rows = [
        f"| `{room}` | {files[room]:,} | {lines[room]:,} |"
        for room in sorted(lines, key=lambda room: -lines[room])
    ]
    total = f"| all | {sum(files.values()):,} | {sum(lines.values()):,} |"
    head = "# Lines per room\n\n| room | files | lines |\n|---|--:|--:|"
    return "\n".join([head, *rows, total]) + "\n"


if __name__ == "__main__":
    print(table(), end="")
