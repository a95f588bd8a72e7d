"""Places of a robot whose file MuJoCo refuses for what has no part in them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import EngineWarning, ModelError
from statemachine.lab.validate.fingertip import certify
from statemachine.lab.validate.fingertip_request import FingertipRequest, answer
from statemachine.lab.validate.fingertip_result import FingertipResult

from .support.files import written
from .support.processes import Cli
from .support.requirements import need_engine

pytestmark = pytest.mark.usefixtures("pinocchio")

BALANCED = "1e-5", "1e-5", "1.5e-5"
UNBALANCED = "1e-5", "1e-5", "3e-5"
MESH = '<collision><geometry><mesh filename="tip.dae"/></geometry></collision>'


def finger(folder: Path, moments: tuple[str, str, str], mesh: str = "") -> Path:
    """Write a finger of one joint; its tip has such principal moments [kg m^2]."""
    ixx, iyy, izz = moments
    return written(
        folder / "finger.urdf",
        f"""<robot name="f"><link name="base"/><link name="tip">{mesh}<inertial>
<mass value=".05"/><inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>
</inertial></link><joint name="j" type="revolute"><parent link="base"/><child link="tip"/>
<origin xyz="0 .1 .2" rpy=".3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="2" velocity="2"/></joint></robot>""",
    )


def certificate(file: Path, backend: str = "mujoco") -> FingertipResult:
    """Return the certificate of a file on a backend."""
    request = FingertipRequest(model=file, backends=(backend,), poses=5)
    return answer(request)[backend]


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_an_inertia_that_is_refused_does_not_stop_places(tmp_path: Path, backend: str) -> None:
    import pinocchio as pin

    need_engine(backend)
    file = finger(tmp_path, UNBALANCED)
    result = certificate(file, backend)
    raw = pin.buildModelFromUrdf(str(file))
    data = raw.createData()
    pin.framesForwardKinematics(raw, data, np.zeros(1))
    tip = data.oMf[raw.getFrameId("tip")].translation
    assert result.agrees
    assert result.default_pose == pytest.approx(tip.tolist(), abs=1e-12)


def test_a_balanced_inertia_is_told_with_its_moments(tmp_path: Path) -> None:
    result = certificate(finger(tmp_path, UNBALANCED))
    assert "A + B >= C" in result.refusal
    (repair,) = result.repairs
    assert (repair.name, repair.quantity) == ("tip", "inertia")
    assert repair.stated == pytest.approx((1e-5, 1e-5, 3e-5))
    assert repair.used == pytest.approx((5e-5 / 3,) * 3)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_a_mesh_that_is_refused_does_not_stop_places(tmp_path: Path, backend: str) -> None:
    need_engine(backend)
    written(tmp_path / "tip.dae", "<COLLADA/>")
    result = certificate(finger(tmp_path, BALANCED, MESH), backend)
    assert result.agrees
    assert result.refusal
    assert [repair.kind for repair in result.repairs] == ["mesh", "geom"]


def test_a_file_that_is_read_as_it_is_has_no_repairs(tmp_path: Path) -> None:
    result = certificate(finger(tmp_path, BALANCED))
    assert (result.refusal, result.repairs) == ("", ())


def test_a_file_that_nothing_mends_is_refused_as_before(tmp_path: Path) -> None:
    file = written(tmp_path / "broken.urdf", '<robot name="r"><joint name="j"/></robot>')
    with pytest.raises(ModelError, match=r"broken\.urdf"):
        certificate(file)


def test_repairs_are_in_json_and_on_the_page(here: Cli, tmp_path: Path) -> None:
    file = finger(tmp_path, UNBALANCED)
    words = ("fingertip", str(file), "--poses", "5")
    found = json.loads(here(*words, "--json", code=0).stdout)["mujoco"]
    assert [repair["name"] for repair in found["repairs"]] == ["tip"]
    assert "balanced of tip" in " ".join(here(*words, code=0).stdout.split())


def test_what_the_caller_balanced_is_told_too(tmp_path: Path) -> None:
    with pytest.warns(EngineWarning):
        model = sm.load(finger(tmp_path, UNBALANCED), balance_inertia=True)
    result = certify(model, poses=5)
    assert (result.refusal, len(result.repairs)) == ("", 1)
