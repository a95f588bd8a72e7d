"""What is asked: the commands of each group, on models, on pairs of files, and by the interface."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
_ROBOTS = ROOT.parent / "shared" / "robots" / "models"

# The arm's three scenes and its URDF; public robots are read from beside the checkout.
MODELS = {
    "arm": "so101",
    "arm on a floor": "so101/scene",
    "arm with a box": "so101/scene_box",
    "arm as URDF": ROOT / "models" / "so101" / "so101.urdf",
    "inverted pendulum": _ROBOTS / "gym/gymnasium/envs/mujoco/assets/inverted_pendulum.xml",
    "reacher": _ROBOTS / "gym/gymnasium/envs/mujoco/assets/reacher.xml",
    "hopper": _ROBOTS / "gym/gymnasium/envs/mujoco/assets/hopper.xml",
    "floating ant": _ROBOTS / "gym/gymnasium/envs/mujoco/assets/ant.xml",
    "cheetah": _ROBOTS / "dmc/dm_control/suite/cheetah.xml",
    "fixed ant": _ROBOTS / "dmc/dm_control/third_party/ant/ant.xml",
    "manipulator": _ROBOTS / "dmc/dm_control/suite/manipulator.xml",
    "newton cradle": _ROBOTS / "mj/model/replicate/newton_cradle.xml",
}
PAIRS = tomllib.loads((HERE / "pairs.toml").read_text("utf-8"))
_LESSONS = (
    *("nowhere", "objects", "state", "forward", "hold", "gravity", "reset", "replay", "time"),
    *("summary", "questions"),
)
# Without them the lesson looks how fast the machine is; what many worlds cost is no figure here.
_LENGTHS = {"gravity": ("--seconds", "4", "--longer", "20"), "objects": ("--most", "4")}
# Runs [s] until after the first touch, of what takes steps of 0.1 ms, and of public robots whose
# steps are dear; the others run as long as an experiment takes.
_SHORT = {
    "newton cradle": ("--seconds", "0.25"),
    **dict.fromkeys(("manipulator", "fixed ant", "floating ant"), ("--seconds", "0.5")),
    **dict.fromkeys(("cheetah", "hopper"), ("--seconds", "1")),
}
_NOT_CONVERGED = {"manipulator", "cheetah", "hopper", "arm with a box"}  # a long time each
# Lessons of what takes small or dear steps; the others take all.
_LESSONS_OF = {
    "newton cradle": ("state", "reset"),
    **dict.fromkeys(("manipulator", "fixed ant"), ("objects", "state", "forward", "reset")),
}
_EXPERIMENTS = ("hold", "droop", "fall", "box")
_RECORDED = ("gravity", "waves")  # of which the traces are figures, and then compared
_NOT_RECORDED = {"newton cradle"}  # the same fall as its experiment's
# Places of these are compared with the witness's, too, which takes the model.
_WITNESSED = {"arm as URDF", "fixed ant", "manipulator"}


@dataclass(frozen=True)
class Case:
    """A command.

    Attributes:
        name: What is asked, as in the key of its figures.
        kind: Section of words.toml for its output; "" for what prints no JSON.
        arguments: Of `statemachine`.
        writes: A trace that it writes, whose arrays are figures too.
    """

    name: str
    kind: str
    arguments: tuple[str, ...]
    writes: str = ""

    @property
    def is_lesson(self) -> bool:
        """Tell whether it takes a lesson."""
        return self.kind.startswith("lesson ")


def of_model(model: str) -> Iterator[Case]:
    """Yield every question about a model, on both engines."""
    path = str(MODELS[model])
    both = ("--backend", "mujoco", "--backend", "pybullet")
    short = _SHORT.get(model, ())
    for name in _LESSONS_OF.get(model, _LESSONS):
        case = f"lesson {name}"
        command = ("lesson", name, "--model", path, *both, *_LENGTHS.get(name, ()))
        yield Case(case, case, (*command, "--json"))
    for name in () if model in _NOT_RECORDED else _RECORDED:
        files: list[str] = []
        for engine in ("mujoco", "pybullet"):
            files.append(f"{name}-{engine}.npz")
            run = ("trace", "record", name, path, "--backend", engine, *short, "-o", files[-1])
            yield Case(f"trace of {name}, {engine}", "", run, files[-1])
        compared = ("compare", *files)  # the runs are not made again
        if model in _WITNESSED:
            compared = ("compare", name, path, *short)
        yield Case(f"compare {name}", "compare", (*compared, "--no-chaos", "--json"))
    for name in _EXPERIMENTS:
        # The chaos floor runs both sides eight times more: of one experiment.
        floor = () if name == "hold" else ("--no-chaos",)
        yield Case(f"compare {name}", "compare", ("compare", name, path, *short, *floor, "--json"))
    compare = ("compare", "hold", path, *short, "--json")
    yield Case("what explains hold", "why", (*compare, "--why"))
    yield Case("one step of hold", "onestep", (*compare, "--one-step"))
    if model not in _NOT_CONVERGED:
        yield Case("convergence of hold", "converge", (*compare, "--converge"))
    models = ("compare", "--models", path, *both, "--json")
    yield Case("what the engines make of it", "models", models)
    yield Case("fingertip", "fingertip", ("fingertip", path, *both, "--poses", "20", "--json"))
    shipped = ROOT / "models" / (f"{path}.xml" if "/" in path else f"{path}/{path}.xml")
    file = path if Path(path).exists() else str(shipped)
    yield Case("robots", "robots", ("robots", file, "--quick", "--json"))


def of_pair(name: str) -> Iterator[Case]:
    """Yield what two files differ in, how far apart they run, and why; write the right one."""
    pair = PAIRS[name]
    source = HERE / "pairs" / pair["file"]
    other = HERE / "pairs" / pair.get("other", pair["file"])
    text = other.read_text("utf-8")
    for before, after in pair["edits"]:
        if before not in text:
            raise ValueError(f"{name}: {other.name} has no {before}")
        text = text.replace(before, after)
    changed = Path(f"right{other.suffix}").resolve()
    changed.write_text(text, "utf-8")
    left, *told_left = f"{source}{pair.get('left', '')}".split()
    right, *told_right = f"{changed}{pair.get('right', '')}".split()
    yield Case("files", "models", ("compare", "--models", str(source), str(changed), "--json"))
    sides = ("compare", pair["of"], left, *told_left, right, *told_right, "--json")
    yield Case("runs", "compare", sides)
    yield Case("causes", "why", (*sides, "--why", "--jobs", "1"))
