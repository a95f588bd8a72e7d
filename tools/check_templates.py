"""Check every template of a page against the class of its content.

    python tools/check_templates.py

Templates of labels have macros alone. Any other template that no class names is reported, too. The
exit code is 1 where anything is reported.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Iterator
from pathlib import Path

import statemachine
from statemachine.show.check_templates import faults_of, label_faults
from statemachine.show.templates import PageContent

ROOMS = ("cli", "course", "lab", "show")


def contents() -> list[type[PageContent]]:
    """Return every class of a page's content."""
    for room in ROOMS:
        name = f"statemachine.{room}"
        for module in pkgutil.walk_packages(importlib.import_module(name).__path__, f"{name}."):
            importlib.import_module(module.name)
    classes = _subclasses(PageContent)
    return [content for content in classes if content.__module__.startswith("statemachine.")]


def _subclasses(kind: type[PageContent]) -> Iterator[type[PageContent]]:
    for subclass in kind.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


def main() -> int:
    """Print what is wrong; the exit code."""
    classes = contents()
    reports = [str(fault) for content in classes for fault in faults_of(content)]
    named = {content.template for content in classes}
    package = Path(statemachine.__file__).parent
    for file in sorted(package.rglob("*.md.j2")):
        if file.name.endswith("_labels.md.j2"):
            reports += map(str, label_faults(file.read_text("utf-8"), file.name))
        elif file.name not in named:
            reports.append(f"{file.name}: no content has this template")
    print("\n".join(reports), end="\n" if reports else "")
    return 1 if reports else 0


if __name__ == "__main__":
    sys.exit(main())
