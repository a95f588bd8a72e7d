"""The fitted figures of an arm in the text of its model's file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from statemachine import load
from statemachine.errors import BadInputError
from statemachine.interface import Model
from statemachine.lab.identification.recorded_gap import gap_held_out
from statemachine.lab.identification.results import IdentificationResult
from statemachine.lab.identification.written_model import check_written, with_written
from statemachine.lab.runs.robot import SO101_JOINTS
from statemachine.lab.why.rewriting import RewrittenFile
from statemachine.models import models_dir

from .support.arm_recordings import identification_result, request, with_verdicts
from .support.requirements import need_engine

ARM = models_dir() / "so101" / "so101.xml"
ELBOW, PAN = 2, 0
Written = tuple[RewrittenFile, Model]


@pytest.fixture(scope="module")
def fitted() -> IdentificationResult:
    need_engine("mujoco")
    return identification_result()


def written(result: IdentificationResult, target: Path, model: str | Path = "so101") -> Written:
    """Write the file of a result, and load it."""
    asked = replace(result.request, model=model, write=target)
    check_written(asked)
    rewritten = with_written(replace(result, request=asked, arm=load(model))).rewritten
    assert rewritten is not None
    return rewritten, load(target)


@pytest.fixture(scope="module")
def file(fitted: IdentificationResult, tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Return what was written of the fixture, and its model."""
    return written(fitted, tmp_path_factory.mktemp("written") / "fitted.xml")


def arrays(model: Model) -> Any:
    """Return the compiled model."""
    return model.compiled


@pytest.mark.parametrize(
    ("array", "index", "expected"),
    [
        ("actuator_gainprm", (ELBOW, 0), 8.5),
        ("actuator_biasprm", (ELBOW, 1), -8.5),
        ("actuator_biasprm", (ELBOW, 2), -0.7),
        ("dof_damping", ELBOW, 0.2),
        ("dof_frictionloss", ELBOW, 0.11),
    ],
)
def test_what_is_determined_is_in_the_file(
    file: Written, array: str, index: Any, expected: float
) -> None:
    assert getattr(arrays(file[1]), array)[index] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("array", "index"),
    [
        ("actuator_gainprm", (PAN, 0)),
        ("actuator_biasprm", (PAN, 2)),
        ("dof_damping", PAN),
        ("dof_frictionloss", PAN),
        ("dof_armature", ELBOW),
    ],
)
def test_what_the_recording_cannot_tell_is_as_it_was(
    file: Written, fitted: IdentificationResult, array: str, index: Any
) -> None:
    before = getattr(arrays(fitted.arm), array)[index]
    assert getattr(arrays(file[1]), array)[index] == before


def test_a_payload_is_added_at_the_gripper(file: Written, fitted: IdentificationResult) -> None:
    added = arrays(file[1]).body_mass - arrays(fitted.arm).body_mass
    expected = np.zeros_like(added)
    expected[fitted.arm.body_id("gripper")] = 0.060
    np.testing.assert_allclose(added, expected, atol=1e-12)


def test_a_delay_is_that_of_every_servo_in_whole_steps(file: Written) -> None:
    model = file[1]
    np.testing.assert_allclose(model.actuator_delay, np.full(6, 0.11))  # 0.106 s, steps of 5 ms


def test_the_text_changes_in_those_elements_alone(
    fitted: IdentificationResult, tmp_path: Path
) -> None:
    copy = tmp_path / "arm.xml"
    copy.write_text(
        ARM.read_text("utf-8").replace('meshdir="look"', f'meshdir="{ARM.parent}/look"')
    )
    rewritten, _ = written(fitted, tmp_path / "fitted.xml", copy)
    before, after = (ElementTree.parse(file).iter() for file in (copy, tmp_path / "fitted.xml"))
    differing = {
        (old.tag, old.get("name"))
        for old, new in zip(before, after, strict=True)
        if old.attrib != new.attrib
    }
    servos = {("position", joint) for joint in SO101_JOINTS}  # each has the delay
    joints = {("joint", "shoulder_lift"), ("joint", "elbow_flex")}
    assert differing == servos | joints | {("inertial", None)}
    assert {change.file for change in rewritten.written} == {"arm.xml"}


def test_an_offset_is_not_written_and_that_is_told(
    fitted: IdentificationResult, tmp_path: Path
) -> None:
    parameters = with_verdicts(fitted.parameters, lambda p: p.kind == "offset")
    rewritten, model = written(replace(fitted, parameters=parameters), tmp_path / "f.xml")
    assert len(rewritten.not_written) == 6
    assert rewritten.written == ()
    np.testing.assert_array_equal(arrays(model).qpos0, arrays(fitted.arm).qpos0)


def test_a_figure_that_the_file_cannot_say_is_told(
    fitted: IdentificationResult, tmp_path: Path
) -> None:
    """A motor has no kp."""
    text = ARM.read_text("utf-8").replace('meshdir="look"', f'meshdir="{ARM.parent}/look"')
    text = text.replace('<position name="elbow_flex"', '<velocity name="elbow_flex"')
    arm = tmp_path / "arm.xml"
    arm.write_text(text)
    rewritten, _ = written(fitted, tmp_path / "f.xml", arm)
    assert "kp of elbow_flex" in {each.cause for each in rewritten.not_written}


def test_the_file_is_played_on_what_was_not_fitted(
    fitted: IdentificationResult, tmp_path: Path
) -> None:
    nothing = with_verdicts(fitted.parameters, lambda _: False)
    as_it_is, _ = written(replace(fitted, parameters=nothing), tmp_path / "same.xml")
    assert as_it_is.gap == gap_held_out(fitted.arm, fitted.recordings)
    changed, _ = written(fitted, tmp_path / "changed.xml")
    assert changed.gap != pytest.approx(as_it_is.gap, rel=0.01)
    assert changed.before == fitted.gap.model


def test_of_an_arm_without_servos_no_gap_is_told(
    fitted: IdentificationResult, tmp_path: Path
) -> None:
    text = ARM.read_text("utf-8").replace('meshdir="look"', f'meshdir="{ARM.parent}/look"')
    arm = tmp_path / "arm.xml"
    arm.write_text(text.replace("<position name=", "<velocity name="))
    assert gap_held_out(load(arm), fitted.recordings) is None


def test_nothing_is_written_where_that_is_not_asked(fitted: IdentificationResult) -> None:
    assert with_written(fitted) is fitted


@pytest.mark.parametrize(
    ("target", "says"),
    [
        ("there.xml", "replaces no file"),
        ("x.urdf", "ends in .xml"),
        ("nowhere/x.xml", "there is no folder"),
    ],
)
def test_a_place_that_cannot_be_written_is_refused_before_the_fit(
    tmp_path: Path, target: str, says: str
) -> None:
    (tmp_path / "there.xml").write_text("<mujoco/>")
    with pytest.raises(BadInputError, match=says):
        check_written(replace(request(), write=tmp_path / target))


def test_a_file_that_is_no_mjcf_is_refused(tmp_path: Path) -> None:
    asked = replace(request(), model=ARM.with_suffix(".urdf"), write=tmp_path / "x.urdf")
    with pytest.raises(BadInputError, match="text of an MJCF"):
        check_written(asked)
