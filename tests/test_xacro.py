"""A xacro is no model, by whatever way it comes: it is refused where files are found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.cli import main
from statemachine.errors import ModelError
from statemachine.kinematics import Kinematics
from statemachine.lab.model_differences import read
from statemachine.lab.robots import examine_all, find
from statemachine.models import refuse_xacro, resolve

from .support.claims import refused
from .support.files import written

SAYS = r"it is a xacro: .*`xacro robot\.urdf > OUT\.urdf`"
DECLARED = 'xmlns:xacro="http://ros.org/wiki/xacro"'
INERTIAL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
)


def urdf(more: str = "", declared: str = DECLARED, origin: str = "0 0 0.1") -> str:
    """Return a turret that is a robot without what is not plain URDF in it."""
    return (
        f'<robot name="r" {declared}><link name="base"/><link name="turret">{INERTIAL}</link>'
        f'<joint name="pan" type="continuous"><parent link="base"/><child link="turret"/>'
        f'<origin xyz="{origin}"/><axis xyz="0 0 1"/></joint>{more}</robot>'
    )


XACROS = {
    "a macro is called": urdf('<xacro:arm parent="turret"/>'),
    "a file is included": urdf('<xacro:include filename="arm.xacro"/>'),
    "the prefix is not declared": urdf('<xacro:arm parent="turret"/>', ""),
    "another prefix": urdf('<x:arm parent="turret"/>', 'xmlns:x="http://www.ros.org/wiki/xacro"'),
    "an expression": urdf(declared="", origin="0 0 ${height / 2}"),
    "an expression in a name": urdf('<link name="${side}_arm"/>', ""),
    "an argument": urdf(declared="", origin="0 0 $(arg height)"),
    "a package": urdf(
        '<link name="m"><visual><geometry><mesh filename="$(find robot)/m.stl"/></geometry>'
        "</visual></link>",
        "",
    ),
    "deep inside": urdf(f'<link name="a">{"<b>" * 50}<xacro:x/>{"</b>" * 50}</link>'),
    "what is not XML before it": urdf("<link name=a/><xacro:arm/>", ""),
}
PLAIN = {
    "only declared": urdf(),
    "in a comment": urdf("<!-- <xacro:arm/> ${pi} $(find robot) -->"),
    "in a text": urdf("<gazebo><plugin><parameters>$(find robot)/x</parameters></plugin></gazebo>"),
    "a name": urdf().replace('"turret"', '"xacro"'),
}


@pytest.mark.parametrize("what", XACROS)
def test_a_xacro_is_refused(tmp_path: Path, what: str) -> None:
    path = written(tmp_path / "robot.urdf", XACROS[what])
    refused((ModelError, rf"^robot\.urdf: {SAYS} \(line 1 has ", lambda: resolve(path)))


@pytest.mark.parametrize("what", PLAIN)
def test_what_only_speaks_of_xacro_is_a_robot(tmp_path: Path, what: str) -> None:
    assert resolve(written(tmp_path / "robot.urdf", PLAIN[what])).is_file()


def test_a_generated_urdf_with_the_declaration_loads(tmp_path: Path) -> None:
    assert sm.load(written(tmp_path / "robot.urdf", urdf())).joint_names == ("pan",)


def test_the_suffix_of_a_xacro_is_known(tmp_path: Path) -> None:
    path = written(tmp_path / "robot.urdf.xacro", urdf())
    says = r"a xacro: .*`xacro robot\.urdf\.xacro > OUT\.urdf`"
    refused((ModelError, says, lambda: resolve(path)))


MJCF = '<mujoco><worldbody><body name="a"><geom size="1"/></body></worldbody>{}</mujoco>'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("<include file='part.xml'/>", "<mujoco><custom/><xacro:arm/></mujoco>"),
        (
            "<include file='part.xml'/>",
            MJCF.format("").replace('"a"', '"${side}_a"'),
        ),
        ("<asset><model name='m' file='part.xml'/></asset>", urdf("<xacro:arm/>")),
    ],
)
def test_what_an_mjcf_includes_or_attaches_is_looked_at(
    tmp_path: Path, name: str, text: str
) -> None:
    """Over a file between them, which may be included twice, or include itself."""
    inside = "robots"
    (tmp_path / inside).mkdir()
    written(tmp_path / inside / "part.xml", text)
    between = written(tmp_path / inside / "between.xml", f"<mujoco>{name}</mujoco>")
    path = written(tmp_path / "scene.xml", MJCF.format(f"<include file='{inside}/between.xml'/>"))
    refused((ModelError, r"^scene\.xml includes part\.xml: it is a xacro: ", lambda: resolve(path)))
    written(between, f"<mujoco><include file='between.xml'/>{name}</mujoco>")
    refused((ModelError, r"^scene\.xml includes part\.xml: it is a xacro: ", lambda: resolve(path)))


def test_an_mjcf_may_keep_any_text_for_its_user(tmp_path: Path) -> None:
    text = MJCF.format('<custom><text name="note" data="${x} $(arg y)"/></custom>')
    refuse_xacro(written(tmp_path / "m.xml", text))
    called = MJCF.format('<xacro:if value="1"/>')
    says = r"a xacro: .*`xacro m\.xml > OUT\.xml`"
    refused((ModelError, says, lambda: refuse_xacro(written(tmp_path / "m.xml", called))))


CALLS: dict[str, Callable[[Path], object]] = {
    "load": sm.load,
    "load, contacts off": lambda path: sm.load(path, contacts=False),
    "load, a release": lambda path: sm.load(path, backend="mujoco==3.3.7"),
    "read": read,
    "read by mujoco": lambda path: read(path, "mujoco"),
}
OF_BULLET: dict[str, Callable[[Path], object]] = {
    "load on pybullet": lambda path: sm.load(path, backend="pybullet"),
    "load as pybullet comes": lambda path: sm.load(path, backend="pybullet", defaults="engine"),
    "read by pybullet": lambda path: read(path, "pybullet"),
}


@pytest.mark.parametrize("way", CALLS)
def test_no_call_takes_one(tmp_path: Path, way: str) -> None:
    path = written(tmp_path / "robot.urdf", urdf("<xacro:arm/>"))
    refused((ModelError, SAYS, lambda: CALLS[way](path)))


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("way", OF_BULLET)
def test_no_call_of_pybullet_takes_one(tmp_path: Path, way: str) -> None:
    path = written(tmp_path / "robot.urdf", urdf("<xacro:arm/>"))
    refused((ModelError, SAYS, lambda: OF_BULLET[way](path)))


@pytest.mark.usefixtures("pinocchio")
def test_the_witness_takes_none(tmp_path: Path) -> None:
    path = written(tmp_path / "robot.urdf", urdf("<xacro:arm/>"))
    refused((ModelError, SAYS, lambda: Kinematics(path)))


COMMANDS = (
    "fingertip {0}",
    "compare gravity {0}",
    "compare gravity {0} --why",
    "compare gravity {0} {0}@mujoco:engine",
    "compare --models {0} {0}",
    "view {0} --seconds 1",
    "lesson hold --model {0}",
    "trace record gravity {0}",
    "sweep gravity {0} --out data",
    "sweep gravity --vary model={0} --out data",
)


@pytest.mark.usefixtures("pinocchio")
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_takes_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any, command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "robot.urdf", urdf("<xacro:arm/>"))
    assert main(command.format("robot.urdf").split()) == 2
    printed = capsys.readouterr()
    assert "is a xacro" in " ".join(printed.err.split())


def test_the_table_of_robots_says_why_one_does_not_load(tmp_path: Path) -> None:
    written(tmp_path / "robot.urdf", urdf("<xacro:arm/>"))
    (row,) = examine_all(find([tmp_path]), quick=True).models
    assert "is a xacro" in repr(row)
