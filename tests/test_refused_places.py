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


# A body that moves and has no mass.

MASSLESS_URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 .1"/><mass value="1"/>
    <inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="wrist"/>
  <link name="tool"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="wrist"/>
    <origin xyz="0 0 .2" rpy="0 .4 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
  <joint name="c" type="revolute"><parent link="wrist"/><child link="tool"/>
    <origin xyz="0 .1 .3"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="1"/></joint>
</robot>"""
MASSLESS_MJCF = """<mujoco><worldbody>
  <body name="upper"><joint name="a" axis="0 1 0"/><geom size=".1"/>
    <body name="tool" pos="0 0 .3"><joint name="b" axis="0 1 0"/><site name="s"/></body>
  </body></worldbody></mujoco>"""


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_links_without_mass_do_not_stop_places(tmp_path: Path, backend: str) -> None:
    import pinocchio as pin

    need_engine(backend)
    file = written(tmp_path / "arm.urdf", MASSLESS_URDF)
    result = certificate(file, backend)
    raw = pin.buildModelFromUrdf(str(file))
    data = raw.createData()
    pin.framesForwardKinematics(raw, data, np.zeros(3))
    tool = data.oMf[raw.getFrameId("tool")].translation
    assert result.agrees
    assert result.default_pose == pytest.approx(tool.tolist(), abs=1e-12)
    assert {repair.name for repair in result.repairs} == {"wrist", "tool"}
    assert all(repair.is_massless for repair in result.repairs)
    assert "boundmass" not in result.refusal  # that is what to write, and it was done here


def test_a_body_of_an_mjcf_without_mass_does_not_stop_places(tmp_path: Path) -> None:
    result = certificate(written(tmp_path / "arm.xml", MASSLESS_MJCF))
    assert result.agrees
    assert {repair.name for repair in result.repairs} == {"tool"}


def test_bodies_without_mass_are_on_the_page(here: Cli, tmp_path: Path) -> None:
    file = written(tmp_path / "arm.urdf", MASSLESS_URDF)
    text = " ".join(here("fingertip", str(file), "--poses", "5", code=0).stdout.split())
    assert "wrist and tool" in text
    assert "balanced" not in text


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("arm.urdf", MASSLESS_URDF, ("line 5:", "'wrist', 'tool'", "into <robot>")),
        ("arm.xml", MASSLESS_MJCF, ("line 3:", "body 'tool' moves", "into <mujoco>")),
    ],
)
def test_load_names_what_moves_without_mass_and_what_to_write(
    tmp_path: Path, backend: str, name: str, content: str, says: tuple[str, ...]
) -> None:
    need_engine(backend)
    with pytest.raises(ModelError) as refusal:
        sm.load(written(tmp_path / name, content), backend=backend)
    message = str(refusal.value)
    assert "\n" not in message
    for part in says:
        assert part in message


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_what_load_says_to_write_is_read(tmp_path: Path, backend: str) -> None:
    need_engine(backend)
    bounds = '<compiler boundmass="0.001" boundinertia="1e-6"/>'
    mjcf = MASSLESS_MJCF.replace("<mujoco>", f"<mujoco>{bounds}")
    urdf = MASSLESS_URDF.replace('name="arm">', f'name="arm"><mujoco>{bounds}</mujoco>')
    for name, content in (("arm.xml", mjcf), ("arm.urdf", urdf)):
        model = sm.load(written(tmp_path / name, content), backend=backend)
        assert model.body_mass[model.body_id("tool")] == 0.001


def test_a_missing_mesh_and_a_link_without_mass_do_not_hide_each_other(tmp_path: Path) -> None:
    mesh = '<collision><geometry><mesh filename="no.stl"/></geometry></collision>'
    upper = '<link name="upper">'
    file = written(tmp_path / "arm.urdf", MASSLESS_URDF.replace(upper, upper + mesh))
    result = certificate(file)
    assert result.agrees
    assert {repair.name for repair in result.repairs if repair.is_massless} == {"wrist", "tool"}


# Which place is compared where none is named.


def test_the_result_says_which_place_was_chosen(tmp_path: Path) -> None:
    file = written(tmp_path / "arm.urdf", MASSLESS_URDF)
    chosen = certificate(file)
    assert (chosen.site_asked, chosen.chosen, chosen.kind) == (None, ("tool",), "body")
    asked = answer(FingertipRequest(model=file, poses=5, site="wrist"))["mujoco"]
    assert (asked.site_asked, asked.chosen, asked.site) == ("wrist", (), "wrist")
    usual = certificate(Path("so101"))
    assert (usual.chosen, usual.kind) == (("gripperframe",), "site")


def test_the_page_says_which_place_was_chosen(here: Cli, tmp_path: Path) -> None:
    file = written(tmp_path / "arm.urdf", MASSLESS_URDF)
    words = ("fingertip", str(file), "--poses", "5")
    chosen = " ".join(here(*words, code=0).stdout.split())
    assert "body tool" in chosen.replace("`", "")
    asked = here(*words, "--site", "wrist", code=0).stdout
    assert "No --site" not in asked.replace("`", "")
