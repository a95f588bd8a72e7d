"""Files that a test writes."""

from __future__ import annotations

from pathlib import Path


def written(file: Path, text: str) -> Path:
    """Write a text into a file, and return the file."""
    file.write_text(text)
    return file


def written_all(folder: Path, texts: dict[str, str]) -> Path:
    """Write texts into a folder, by their paths in it, and return the folder."""
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        written(folder / name, text)
    return folder


def distribution(folder: Path, name: str, version: str, entries: str = "") -> Path:
    """Make a folder that looks as if a distribution was installed into it."""
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    return written_all(
        folder / f"{name.replace('-', '_')}-{version}.dist-info",
        {"METADATA": metadata, "entry_points.txt": entries},
    )
