"""The JSON of every command: its keys, and the types of what stands under them, all the way down.

The figures are tested where they are made. After a change that was meant, write the table anew:
`python -m tests.test_json_shapes`.
"""

from __future__ import annotations

import json
import shlex
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from statemachine.course.lessons import LESSONS

from .support.pages import QUICK
from .support.processes import of_python
from .support.requirements import ROOT, need_engine

TABLE = Path(__file__).with_suffix(".json")
MAY_BE_NULL = {"data_bytes", "world_bytes"}  # memory grows by pages, and freed ones are used again
ITSELF = "--backend mujoco --backend mujoco --seconds 0.2"
QUADRUPED = ROOT / "models" / "quadruped"
OTHER_CONTRACT = "world_gyro.yaml"  # written beside the command that names it
POLICY = (
    "policy {ROOT}/models/quadruped/policy.onnx quadruped/scene --contract "
    "{ROOT}/models/quadruped/contract.yaml --backend mujoco --seconds 0.4"
)
COMMANDS = [
    *(shlex.join(("lesson", name, *QUICK.get(name, ()))) for name in LESSONS),
    "doctor",
    "conventions quaternion gravity --backend mujoco",
    "conventions --calls --backend mujoco",
    "fingertip --poses 5",
    "validate --case free-fall --timestep 0.005",
    f"compare hold {ITSELF}",
    f"compare hold {ITSELF} --why",
    f"compare hold {ITSELF} --one-step",
    f"compare hold {ITSELF} --converge",
    "compare hold so101/scene so101/scene damping=1 --seconds 0.2",
    "compare hold so101/scene damping=1 so101/scene --seconds 0.2 --why",
    "compare hold so101 so101 damping=1 so101 damping=1.001 --seconds 0.2 --no-chaos",
    "compare --models so101 so101/scene",
    "compare lerobot:synthetic so101 --seconds 2",
    "compare lerobot:synthetic so101 --seconds 2 --why",
    "trace show {ROOT}/statemachine/lab/recordings/recorded/droop.pybullet.npz",
    "check {ROOT}/teaching/solutions/step_loop.py",
    "check --faults {ROOT}/exercises/test_arm.py --only xyzw",
    "robots {ROOT}/models/so101/so101.xml --quick",
    "sweep droop --vary damping=0.5,0.6 --seconds 0.1 --backend mujoco --out swept",
    f"{POLICY} --command 3,0,0",
    f"{POLICY} --faults",
    f"{POLICY} --against {OTHER_CONTRACT}",
]


def _said(command: str, folder: str | Path) -> Any:
    words = shlex.split(command.format(ROOT=ROOT))
    if OTHER_CONTRACT in words:
        contract = (QUADRUPED / "contract.yaml").read_text("utf-8")
        other = contract.replace("frame: body", "frame: world")
        (Path(folder) / OTHER_CONTRACT).write_text(other, "utf-8")
    done = of_python("-m", "statemachine", *words, "--json", folder=Path(folder))
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


def shape(value: Any) -> Any:
    """Return keys with the shapes under them, the shapes of a list, or the name of a type.

    Objects of a list that have the same keys are one shape: which of them stand there is for the
    tests of the figures, and may hang on the processor.
    """
    if isinstance(value, dict):
        return {
            name: {"either": ["null", "number"]}
            if name in MAY_BE_NULL and isinstance(inner, int | float | None)
            else shape(inner)
            for name, inner in value.items()
        }
    if isinstance(value, list):
        return _shapes_in_a_list(shape(inner) for inner in value)
    return {bool: "true or false", int: "number", float: "number", str: "text"}.get(
        type(value), "null"
    )


def _shapes_in_a_list(shapes: Iterable[Any]) -> list[Any]:
    """Return each shape once, those of objects with the same keys as one."""
    by_kind: dict[str, Any] = {}
    for found in shapes:
        kind = _kind(found)
        if kind not in by_kind:
            by_kind[kind] = found
        elif isinstance(found, list):
            by_kind[kind] = _shapes_in_a_list([*by_kind[kind], *found])
        elif isinstance(found, dict):
            by_kind[kind] = {name: _either(by_kind[kind][name], found[name]) for name in found}
    return [by_kind[kind] for kind in sorted(by_kind)]


def _kind(found: Any) -> str:
    """Return what two shapes that become one have in common."""
    if isinstance(found, list):
        return "list"
    return json.dumps(sorted(found)) if isinstance(found, dict) else found


def _either(one: Any, other: Any) -> Any:
    """Return the shape of what has one of two shapes."""
    shapes = _shapes_in_a_list([*_alternatives(one), *_alternatives(other)])
    return shapes[0] if len(shapes) == 1 else {"either": shapes}


def _alternatives(found: Any) -> list[Any]:
    """Return the shapes of which something has one."""
    if isinstance(found, dict) and set(found) == {"either"}:
        return found["either"]
    return [found]


def test_objects_with_the_same_keys_are_one_shape() -> None:
    found = [{"low": 1.0, "reasons": []}, {"low": None, "reasons": ["far"]}, {"name": "a"}]
    assert shape(found) == [
        {"low": {"either": ["null", "number"]}, "reasons": ["text"]},
        {"name": "text"},
    ]


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_the_json_of_a_command_has_its_keys_and_types(command: str, tmp_path: Path) -> None:
    need_engine("pinocchio")  # without, what a witness says is null
    if command.startswith(POLICY):
        pytest.importorskip("onnxruntime")
    assert shape(_said(command, tmp_path)) == json.loads(TABLE.read_text("utf-8"))[command]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as home:
        found = {command: shape(_said(command, home)) for command in COMMANDS}
    TABLE.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", "utf-8")
