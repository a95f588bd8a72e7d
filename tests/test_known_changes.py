"""Known changes between releases of MuJoCo: told where a run has something of them, and probed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine import releases
from statemachine.engines.mujoco import known_changes
from statemachine.engines.mujoco.release_probes import kv_in_derivative
from statemachine.engines.records import KnownChange
from statemachine.errors import EngineWarning
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.questions.requests import causes, gap
from statemachine.lab.questions.requests.versions import ReleasePair, VersionsRequest, answer
from statemachine.lab.questions.versions import page
from statemachine.lab.why import page as why
from statemachine.show.blocks import Items

from .support.backends import RELEASES
from .support.files import written
from .support.pages import blocks

LIMITED_KV = "kv of a limited servo"  # the known change
OLD = RELEASES[0]
PROBES = Path(known_changes.__file__).with_name("release_probes.py")

SERVO = """<mujoco><option timestep="0.01" integrator="{integrator}" gravity="0 0 0"/><worldbody>
<body><joint name="hinge" axis="0 1 0"/>
<inertial mass="1" pos="0 0 0" diaginertia="0.01 0.01 0.01"/></body></worldbody>
<actuator><position name="servo" joint="hinge" kp="10" kv="2" {limit}/></actuator></mujoco>"""
FORCE = 0.05
LIMIT = f'forcerange="-{FORCE} {FORCE}"'
LINK = """<link name="{name}"><inertial><mass value="1"/><origin xyz="0.1 0 0" rpy="{rpy}"/>
<inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}_j" type="continuous"><parent link="base"/><child link="{name}"/>
<axis xyz="{axis}"/>{mimic}</joint>"""
STEP = """
d = mujoco.MjData(m); d.ctrl[:] = 1.0; mujoco.mj_step(m, d); print(json.dumps(d.qvel.tolist()))
"""


def urdf(rpy: str = "0 0 0", mimic: str = "", mass: str = "1") -> str:
    """Return two arms that hang on one base."""
    first = LINK.format(name="a", rpy=rpy, axis="0 1 0.3", mimic="")
    second = LINK.format(name="b", rpy="0 0 0", axis="0 1 0", mimic=mimic)
    second = second.replace('value="1"', f'value="{mass}"')
    return f'<robot name="r"><link name="base"/>{first}{second}</robot>'


def raw(python: Path | str, file: Path, code: str) -> Any:
    """Return what code prints as JSON in a Python, of the model `m` of a file."""
    start = f"import json, mujoco\nm = mujoco.MjModel.from_xml_path({str(file)!r})\n"
    done = subprocess.check_output([str(python), "-I", "-c", start + code], text=True)
    return json.loads(done)


def pair_of(file: Path, experiment: str = "hold", seconds: float = 0.5) -> ReleasePair:
    """Return the old release and the installed one."""
    run = Request((experiment,), model=str(file), seconds=seconds)
    (pair,) = answer(VersionsRequest(run, OLD.partition("==")[2])).pairs
    return pair


def names(changes: tuple[KnownChange, ...]) -> list[str]:
    return [change.name for change in changes]


@pytest.mark.parametrize(
    "integrator", [pytest.param("implicit", marks=pytest.mark.slow), "implicitfast"]
)
def test_kv_of_a_servo_at_its_limit_is_told_with_the_part_that_plain_mujoco_has_of_it(
    tmp_path: Path, old_releases: None, integrator: str
) -> None:
    file = written(tmp_path / "m.xml", SERVO.format(integrator=integrator, limit=LIMIT))
    (change,) = pair_of(file).changes
    assert (change.name, change.probe) == (LIMITED_KV, integrator)
    assert change.elements == ("servo",)
    # A step from rest gives v = h F / (I + h c kv), with the part c of kv.
    for python, part in ((releases.python_of(OLD), change.left), (sys.executable, change.right)):
        (speed,) = raw(python, file, STEP)
        assert (0.01 * FORCE / speed - 0.01) / (0.01 * 2.0) == pytest.approx(part, abs=1e-9)
    assert (change.left, change.right) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-9))


@pytest.mark.parametrize(
    ("integrator", "limit"),
    [("implicitfast", ""), ("implicitfast", 'forcerange="-99 99"'), ("Euler", LIMIT)],
)
def test_nothing_is_told_of_servos_where_the_run_has_none_at_its_limit(
    tmp_path: Path, old_releases: None, integrator: str, limit: str
) -> None:
    file = written(tmp_path / "m.xml", SERVO.format(integrator=integrator, limit=limit))
    pair = pair_of(file)
    assert pair.changes == ()
    assert pair.comparison.agrees


@pytest.mark.slow
def test_a_turned_inertial_of_a_urdf_is_told(tmp_path: Path, old_releases: None) -> None:
    file = written(tmp_path / "m.urdf", urdf(rpy="0 0 0.9"))
    pair = pair_of(file, "fall")
    (change,) = [c for c in pair.changes if c.name == "turned inertial of a URDF"]
    assert change.elements == ("a",)
    code = "print(json.dumps([m.body('a').iquat.tolist(), m.body('a').inertia.tolist()]))"
    tensors: list[Any] = []
    for python in (releases.python_of(OLD), sys.executable):
        iquat, inertia = raw(python, file, code)
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, np.array(iquat))
        axes = axes.reshape(3, 3)
        tensors.append(axes @ np.diag(inertia) @ axes.T)
    products = [tensor[0, 1] for tensor in tensors]
    assert products == pytest.approx([0.0, (0.01 - 0.02) / 2 * np.sin(1.8)], abs=1e-9)
    assert [change.left, change.right] == pytest.approx(products, abs=1e-9)


@pytest.mark.slow
def test_a_mimic_of_a_urdf_is_told(tmp_path: Path, old_releases: None) -> None:
    text = urdf(mimic='<mimic joint="a_j" multiplier="-1"/>', mass="3")
    file = written(tmp_path / "m.urdf", text)
    with pytest.warns(EngineWarning, match="b_j follows a_j"):
        pair = pair_of(file, "fall")
    (change,) = [c for c in pair.changes if c.name == "mimic of a URDF"]
    assert change.elements == ("b_j",)
    counts = [raw(p, file, "print(m.neq)") for p in (releases.python_of(OLD), sys.executable)]
    assert [change.left, change.right] == counts == [0, 1]


def test_a_comparison_of_two_releases_tells_them_too_and_of_two_files_none(
    tmp_path: Path, old_releases: None
) -> None:
    text = SERVO.format(integrator="implicitfast", limit=LIMIT)
    file, other = (str(written(tmp_path / name, text)) for name in ("m.xml", "n.xml"))
    told: list[list[str]] = []
    for right in (file, other):
        run = Request(("hold",), sides=(Side(file, OLD), Side(right)), seconds=0.5)
        told.append(names(gap.answer(gap.CompareRequest(run, uncertainty=None)).changes))
    assert told == [[LIMITED_KV], []]


def test_causes_of_a_gap_between_two_releases_have_them_too(
    tmp_path: Path, old_releases: None
) -> None:
    text = SERVO.format(integrator="implicitfast", limit=LIMIT)
    file = str(written(tmp_path / "m.xml", text))
    run = Request(("hold",), sides=(Side(file, OLD), Side(file)), seconds=0.5)
    compared = gap.answer(gap.CompareRequest(run, uncertainty=None))
    result = causes.answer(causes.ExplainRequest(run, uncertainty=None, jobs=1))
    assert result.changes == compared.changes
    assert names(result.changes) == [LIMITED_KV]
    (items,) = blocks(why.page(result), Items)
    assert OLD.partition("==")[2] in items.texts[0]


BOXES = """<mujoco><worldbody><geom type="plane" size="2 2 0.1"/>
<body name="low" pos="0 0 0.11"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
<body name="high" pos="0.05 0.05 0.4" euler="30 40 20"><freejoint/>
<geom type="{shape}" size="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("shape", "name"),
    [
        ("box", "boxes in contact"),
        pytest.param("cylinder", "cylinders in contact", marks=pytest.mark.slow),
    ],
)
def test_shapes_with_other_contact_points_are_told_by_the_bodies_that_touch(
    tmp_path: Path, old_releases: None, shape: str, name: str
) -> None:
    pair = pair_of(written(tmp_path / "m.xml", BOXES.format(shape=shape)), "gravity", 1.0)
    assert pair.is_changed
    assert names(pair.changes) == [name]
    assert pair.changes[0].elements == ("low and high",)


def test_each_probe_measures_one_number_on_the_installed_release() -> None:
    done = subprocess.check_output([sys.executable, "-I", str(PROBES)], text=True)
    measured = json.loads(done)
    assert set(measured) == {
        *("implicit", "implicitfast", "mimic", "turned inertial"),
        *("box on box", "cylinder on box"),
    }
    assert all(isinstance(value, int | float) for value in measured.values())


def test_nothing_is_told_where_the_probe_is_the_same_on_both(
    tmp_path: Path, old_releases: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A change that is known elsewhere is no reason here."""
    monkeypatch.setattr(known_changes, "probe_results", lambda _backend: {"implicitfast": 1.0})
    file = written(tmp_path / "m.xml", SERVO.format(integrator="implicitfast", limit=LIMIT))
    pair = pair_of(file)
    assert pair.is_changed
    assert pair.changes == ()


def test_the_page_has_a_sentence_for_each(tmp_path: Path, old_releases: None) -> None:
    file = written(tmp_path / "m.xml", SERVO.format(integrator="implicitfast", limit=LIMIT))
    run = Request(("hold",), model=str(file), seconds=0.5)
    result = answer(VersionsRequest(run, OLD.partition("==")[2]))
    (items,) = blocks(page(result), Items)
    assert len(items.texts) == len(result.pairs[0].changes) == 1
    assert "servo" in items.texts[0]


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast"])
def test_this_release_has_no_kv_of_a_servo_at_its_limit_in_its_derivative(integrator: str) -> None:
    assert kv_in_derivative(integrator) == pytest.approx(0.0, abs=1e-9)
