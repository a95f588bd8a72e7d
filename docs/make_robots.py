"""Write docs/robots_packages.md: the models of packages, examined.

    pip install --no-deps --target FOLDER gymnasium gymnasium-robotics dm_control robosuite \
        pybullet
    python docs/make_robots.py FOLDER

The tables are kept beside FOLDER, and what they say already is not examined again.
"""

from __future__ import annotations

import sys
from collections import Counter
from importlib.metadata import distributions
from pathlib import Path

from statemachine.course.notebook import body
from statemachine.lab.robots import examine_all, find
from statemachine.lab.robots.page import page

PACKAGES = {
    "gymnasium": "gymnasium",
    "gymnasium-robotics": "gymnasium_robotics",
    "dm_control": "dm_control",
    "robosuite": "robosuite",
    "pybullet": "pybullet_data",
}
# Of pybullet: a thousand single objects with izz = 0 in their URDF, none of which MuJoCo takes.
LEFT_OUT = "random_urdfs/"
TARGET = Path(__file__).parent / "robots_packages.md"
_HEAD = """---
orphan: true
---

# The models of some packages

Made by `docs/make_robots.py`, for [any folder of models](models.md), where the columns are
explained; without experiments and costs, which are of a machine. A file that a package does not
ship, as a mesh, makes MuJoCo refuse the model. Left out is `random_urdfs` of `pybullet_data`: a
thousand single objects whose URDF gives `izz="0"`, which MuJoCo refuses.

With contacts a gap is largest where shapes overlap at the start, as laikago's do by 109 mm: each
engine pushes them apart in its own way.
"""


def main(folder: str) -> None:
    """Examine the models of each package in a folder, and write the page."""
    versions = {each.name: each.version for each in distributions(path=[folder])}
    parts, witnessed = [], Counter[str]()
    for name, module in PACKAGES.items():
        root = Path(folder) / module
        if not root.is_dir():
            sys.exit(f"{name} is not in {folder}")
        table = Path(folder).with_name(f"robots-{module}.json")
        models = [each for each in find([root]) if not each.name.startswith(LEFT_OUT)]
        survey = examine_all(models, quick=True, table=table)
        witnessed.update(each.witness.grade for each in survey.models if each.witness is not None)
        parts.append(f"## {name} {versions[name]}")
        parts += [part for part in body(page(survey, widest=80), lambda _: "") if part]
    own, asked = witnessed["own reading"], witnessed.total()
    share = f"Of {asked} models that move, the witness has read {own} itself ({own / asked:.1%})."
    text = "\n\n".join(part.strip() for part in (_HEAD, share, *parts)) + "\n"
    TARGET.write_text(text.replace(folder, "…"), "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
