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
from collections.abc import Iterable, Iterator
from importlib.metadata import distributions
from pathlib import Path
from statistics import median

from statemachine.course.notebook import body
from statemachine.installed import DEFAULT
from statemachine.lab.robots import Survey, examine_all, find
from statemachine.lab.robots.page import page
from statemachine.measures.text import rough

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
_READS = " it reads "  # in a warning of an engine whose reader is its own
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
    of_packages = list(surveys.values())
    if more:
        surveys["A few of each, and of others"] = survey_of(Path(more), Path(folder), "more")
    parts: list[str] = []
    for heading, survey in surveys.items():
        parts.append(f"## {heading}")
        parts += [part for part in body(page(survey, widest=80), lambda _: "") if part]
    text = "\n\n".join(part.strip() for part in (_HEAD, *_sums(of_packages), *parts)) + "\n"
    TARGET.write_text(text.replace(folder, "…"), "utf-8")


def survey_of(root: Path, folder: Path, name: str) -> Survey:
    """Examine the models in a folder; their table stands beside another folder, by a name."""
    table = folder.with_name(f"robots-{name}.json")
    models = [each for each in find([root]) if not each.name.startswith(LEFT_OUT)]
    return examine_all(models, quick=True, table=table, seconds=SECONDS)


def _sums(surveys: Iterable[Survey]) -> Iterator[str]:
    """Yield how many models each engine loads, what comes of reading them, and the witness's."""
    models = [model for survey in surveys for model in survey.models]
    default = [model for model in models if model.backends[DEFAULT].loads]
    yield f"Of {len(models)} models, {DEFAULT} loads {len(default)}."
    for backend in dict.fromkeys(name for model in models for name in model.backends):
        rows = [model.backends[backend] for model in default if backend in model.backends]
        loaded = [row for row in rows if row.loads]
        if backend == DEFAULT:
            continue
        gaps: dict[bool, list[float]] = {True: [], False: []}
        for row in loaded:
            if row.without_contacts is not None:
                reads_otherwise = any(_READS in text for text in row.warnings_without)
                gaps[reads_otherwise].append(row.without_contacts.largest)
        yield f"Of these, {backend} loads {len(loaded)}; what it refuses stands in each section."
        if gaps[True] and gaps[False]:
            yield (
                f"It reads {len(gaps[True])} of them with other numbers, as `load` warns: their "
                f"median gap without contacts is {rough(median(gaps[True]))} rad or m, and that of "
                f"the others {rough(median(gaps[False]))}."
            )
    witnessed = Counter(model.witness.grade for model in models if model.witness is not None)
    own, asked = witnessed["own reading"], witnessed.total()
    yield f"Of {asked} models that move, the witness has read {own} itself ({own / asked:.1%})."


if __name__ == "__main__":
    main(*sys.argv[1:])
