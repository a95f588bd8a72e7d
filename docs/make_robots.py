"""Write docs/robots_packages.md: the models of packages, examined.

    pip install --no-deps --target FOLDER gymnasium gymnasium-robotics dm_control robosuite
    python docs/make_robots.py FOLDER

The tables are kept beside FOLDER, and what they say already is not examined again.
"""

from __future__ import annotations

import sys
from importlib.metadata import distributions
from pathlib import Path

from statemachine.report.markdown import body
from statemachine.report.robots import page
from statemachine.robots import examine_all, find

PACKAGES = {
    "gymnasium": "gymnasium",
    "gymnasium-robotics": "gymnasium_robotics",
    "dm_control": "dm_control",
    "robosuite": "robosuite",
}
TARGET = Path(__file__).parent / "robots_packages.md"
_HEAD = """---
orphan: true
---

# The models of some packages

Made by `docs/make_robots.py`, for [any folder of models](robots.md), where the columns are
explained; without experiments and costs, which are of a machine. A file that a package does not
ship, as a mesh, makes MuJoCo refuse the model.
"""


def main(folder: str) -> None:
    """Examine the models of each package in a folder, and write the page."""
    versions = {each.name: each.version for each in distributions(path=[folder])}
    parts = [_HEAD]
    for name, module in PACKAGES.items():
        root = Path(folder) / module
        if not root.is_dir():
            sys.exit(f"{name} is not in {folder}")
        table = Path(folder).with_name(f"robots-{module}.json")
        survey = examine_all(find([root]), quick=True, table=table)
        parts.append(f"## {name} {versions[name]}")
        parts += [part for part in body(page(survey, widest=80), lambda _: "") if part]
    text = "\n\n".join(part.strip() for part in parts) + "\n"
    TARGET.write_text(text.replace(folder, "…"), "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
