"""A release of MuJoCo that reads other elements in a file than the one that is installed."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import releases
from statemachine.cli import main
from statemachine.errors import BadInputError, EngineWarning
from statemachine.installed import engine_version
from statemachine.lab.compare.sides import Request
from statemachine.lab.installation.engines import AddReleasesRequest
from statemachine.lab.questions.requests.versions import VersionsRequest, answer

from .support.backends import RELEASES
from .support.claims import refused, warnings_of
from .support.files import written
from .support.motions import path

OLD = RELEASES[0]
SAYS_NO, BAD_INPUT = 1, 2

# Two pendulums; the second follows the first by the file, and none of it in MuJoCo 3.3.7.
MIMIC = """<robot name="grip">
<link name="palm"><inertial><mass value="1"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial></link>
{fingers}</robot>"""
FINGER = """<link name="{name}"><inertial><origin xyz="0.1 0 0"/><mass value="{mass}"/>
<inertia ixx="1e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}_j" type="continuous"><parent link="palm"/><child link="{name}"/>
<origin xyz="0 {place} 0"/><axis xyz="0 1 0"/>{mimic}</joint>"""
FOLLOWS = '<mimic joint="a_j" multiplier="-1"/>'


@pytest.fixture
def gripper(tmp_path: Path, old_releases: None) -> Path:
    """Return a URDF with a mimic, and the releases are here."""
    fingers = FINGER.format(name="a", mass=0.1, place=0.1, mimic="") + FINGER.format(
        name="b", mass=0.3, place=-0.1, mimic=FOLLOWS
    )
    return written(tmp_path / "grip.urdf", MIMIC.format(fingers=fingers))


def loaded_in_old(file: Path) -> tuple[Any, str]:
    """Return a Model of the old release, and what was warned of."""
    return warnings_of(lambda: sm.load(file, backend=OLD))


def raw_of_release(file: Path, code: str) -> Any:
    """Run Python in the environment of the old release; what it prints as JSON."""
    start = f"import json, mujoco\nm = mujoco.MjModel.from_xml_path({str(file)!r})\n"
    done = subprocess.check_output([releases.python_of(OLD), "-I", "-c", start + code], text=True)
    return json.loads(done)


def test_a_model_has_what_its_release_reads(gripper: Path) -> None:
    """The counts are those of plain MuJoCo in either environment."""
    model, told = loaded_in_old(gripper)
    assert mujoco.MjModel.from_xml_path(str(gripper)).neq == 1
    assert raw_of_release(gripper, "print(json.dumps(m.neq))") == 0 == model.compiled.neq
    (element,) = model.unshared
    assert (element.size, element.count, element.other_count) == ("neq", 1, 0)
    assert (element.reader, element.other) == (f"MuJoCo {engine_version('mujoco')}", "MuJoCo 3.3.7")
    assert element.label == "b_j follows a_j"
    assert element.label in told


def test_it_moves_as_plain_mujoco_of_that_release(gripper: Path) -> None:
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        model = sm.load(gripper, backend=OLD)
    ours = path(model, 200)[1:]
    code = (
        "d = mujoco.MjData(m); rows = []\n"
        "for _ in range(200):\n    mujoco.mj_step(m, d); rows.append(d.qpos.tolist())\n"
        "print(json.dumps(rows))"
    )
    assert np.array_equal(ours, raw_of_release(gripper, code))
    installed = path(sm.load(gripper), 200)[1:]
    assert np.abs(ours - installed).max() > 0.1, "the coupling is felt"


def test_an_edit_reaches_the_model_that_the_release_reads(gripper: Path) -> None:
    """By the fields of what the release reads, not of what the installed one does."""
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        model = sm.load(gripper, backend=OLD)
    ours = path(model.replace(damping=np.full(2, 0.2), timestep=0.001), 100)[-1]
    code = (
        "m.dof_damping[:] = 0.2; m.opt.timestep = 0.001; d = mujoco.MjData(m)\n"
        "mujoco.mj_step(m, d, 100); print(json.dumps(d.qpos.tolist()))"
    )
    assert ours == pytest.approx(raw_of_release(gripper, code), abs=1e-12)


def test_versions_run_both_and_say_what_was_read_otherwise(gripper: Path) -> None:
    request = VersionsRequest(Request(("fall",), model=str(gripper)), "3.3.7")
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        (pair,) = answer(request).pairs
    comparison = pair.comparison
    assert not comparison.agrees
    assert [note for note in comparison.notes if "b_j follows a_j" in note]


def test_nothing_is_said_of_two_releases_that_read_alike(
    tmp_path: Path, old_releases: None
) -> None:
    fingers = FINGER.format(name="a", mass=0.1, place=0.1, mimic="")
    file = written(tmp_path / "one.urdf", MIMIC.format(fingers=fingers))
    model, told = loaded_in_old(file)
    assert (model.unshared, told) == ((), "")
    request = VersionsRequest(Request(("fall",), model=str(file)), "3.3.7")
    (pair,) = answer(request).pairs
    assert pair.comparison.notes == ()


def test_compare_models_lists_what_a_release_reads_otherwise(
    gripper: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sides = (f"{gripper}@{OLD}", f"{gripper}@mujoco")
    assert main(["compare", "--models", *sides, "--json"]) == SAYS_NO
    found = json.loads(capsys.readouterr().out)
    assert len(found["differences"]) == 1


def test_meshes_are_found_where_the_file_has_them(tmp_path: Path, old_releases: None) -> None:
    """What the release writes of the file names meshes as the file does."""
    written(
        tmp_path / "part.obj",
        "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    )
    mesh = '<collision><geometry><mesh filename="part.obj"/></geometry></collision></link>'
    fingers = FINGER.format(name="a", mass=0.1, place=0.1, mimic="").replace("</link>", mesh)
    fingers += FINGER.format(name="b", mass=0.3, place=-0.1, mimic=FOLLOWS)
    file = written(tmp_path / "grip.urdf", MIMIC.format(fingers=fingers))
    model, _ = loaded_in_old(file)
    assert (model.compiled.neq, model.compiled.nmesh) == (0, 1)
    assert path(model, 20).shape == (21, 2)


TOO_OLD = "mujoco==2.3.7"


@pytest.mark.parametrize(
    "words",
    [
        f"engines add {TOO_OLD}",
        f"engines add {OLD} {TOO_OLD}",
        f"compare fall so101@{TOO_OLD} so101",
        "compare fall --versions 2.3.7 so101",
        "compare fall --versions 2.3.7 --bisect so101",
    ],
)
def test_a_release_that_is_too_old_is_refused_before_anything_is_downloaded(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: str,
) -> None:
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(tmp_path / "home"))
    monkeypatch.setattr(releases, "run_installer", lambda *_: pytest.fail("it downloads"))
    assert main(words.split()) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert TOO_OLD in said
    assert "mujoco==3.0.0" in said
    assert not (tmp_path / "home").exists()


def test_the_oldest_release_that_is_taken_is_3_0_0() -> None:
    refused((BadInputError, "too old", lambda: AddReleasesRequest(("mujoco==2.99.9",))))
    assert AddReleasesRequest(("mujoco==3.0.0",)).python == sys.executable


def test_one_that_is_too_old_can_be_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(tmp_path))
    (tmp_path / TOO_OLD).mkdir()
    releases.remove(TOO_OLD)
    assert not list(tmp_path.iterdir())
