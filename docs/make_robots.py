"""Write docs/robots_packages.md: the models of packages, examined.

    pip install --no-deps --target FOLDER gymnasium gymnasium-robotics dm_control robosuite \
        pybullet
    python docs/make_robots.py FOLDER [MORE]

MORE is a folder with a few models of each of these and of others, as `../shared/robots`. The tables
are kept beside FOLDER, and what they say already is not examined again.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable
from importlib.metadata import distributions
from pathlib import Path

from statemachine.course.notebook import body
from statemachine.installed import DEFAULT
from statemachine.lab.robots import Survey, examine_all, find
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
SECONDS = 300.0  # for a model, on a machine that does something else, too
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


def main(folder: str, more: str = "") -> None:
    """Examine the models of each package in a folder, and of another folder; write the page."""
    versions = {each.name: each.version for each in distributions(path=[folder])}
    surveys: dict[str, Survey] = {}
    for name, module in PACKAGES.items():
        root = Path(folder) / module
        if not root.is_dir():
            sys.exit(f"{name} is not in {folder}")
        surveys[f"{name} {versions[name]}"] = survey_of(root, Path(folder), module)
    share = _share(surveys.values())
    if more:
        surveys["A few of each, and of others"] = survey_of(Path(more), Path(folder), "more")
    parts: list[str] = []
    for heading, survey in surveys.items():
        parts.append(f"## {heading}")
        parts += [part for part in body(page(survey, widest=80), lambda _: "") if part]
    text = "\n\n".join(part.strip() for part in (_HEAD, share, *parts)) + "\n"
    TARGET.write_text(text.replace(folder, "…"), "utf-8")


def survey_of(root: Path, folder: Path, name: str) -> Survey:
    """Examine the models in a folder; their table stands beside another folder, by a name."""
    table = folder.with_name(f"robots-{name}.json")
    models = [each for each in find([root]) if not each.name.startswith(LEFT_OUT)]
    return examine_all(models, quick=True, table=table, seconds=SECONDS)


def _share(surveys: Iterable[Survey]) -> str:
    """Return how many models each engine loads, and the witness has read itself."""
    witnessed, loaded = Counter[str](), Counter[str]()
    for model in (model for survey in surveys for model in survey.models):
        if model.witness is not None:
            witnessed[model.witness.grade] += 1
        if model.backends[DEFAULT].loads:
            loaded.update(name for name, row in model.backends.items() if row.loads)
    own, asked = witnessed["own reading"], witnessed.total()
    others = [f"{name} {count}" for name, count in loaded.items() if name != DEFAULT]
    return (
        f"How many are loaded: {DEFAULT} {loaded[DEFAULT]}, of these {', '.join(others)}. What "
        f"stands in the way is listed for each package. Of {asked} models that move, the witness "
        f"has read {own} itself ({own / asked:.1%})."
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
