"""Files that a test writes."""

from __future__ import annotations

from pathlib import Path


def written(file: Path, text: str) -> Path:
    """A file with a text."""
    file.write_text(text)
    return file


def written_all(folder: Path, texts: dict[str, str]) -> Path:
    """A folder with texts, by their paths in it."""
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        written(folder / name, text)
    return folder


def distribution(folder: Path, name: str, version: str, entries: str = "") -> Path:
    """A folder that looks as if a distribution was installed into it."""
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    return written_all(
        folder / f"{name.replace('-', '_')}-{version}.dist-info",
        {"METADATA": metadata, "entry_points.txt": entries},
    )
