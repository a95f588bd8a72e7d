"""Files that MuJoCo refuses, compiled all the same: what was changed is listed, nothing else is."""

import math

import pytest

from statemachine.backends.compiled.repairs import LEAST, compile_mended, stated_moments
from statemachine.errors import ModelError

mujoco = pytest.importorskip("mujoco")

ROUND = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
# 1e-4 > 1e-5 + 1e-5: balanced, a moment of 1e-4 becomes 4e-5, and those of 1e-5 four times larger.
UNBALANCED = '<inertia ixx="1e-5" iyy="1e-4" izz="1e-5" ixy="0" ixz="0" iyz="0"/>'
INDEFINITE = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="3e-4" ixz="0" iyz="0"/>'
ASCII_STL = (
    "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid x\n"
)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def inertial(inertia=ROUND, mass=0.1):
    return f'<inertial><mass value="{mass}"/>{inertia}</inertial>'


def mesh(name, tag="collision"):
    return f'<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>'


def arm(folder, moving=None, fixed=None):
    """Write a URDF: link `arm` on a hinge, link `tip` behind a fixed joint of it."""
    path = folder / "arm.urdf"
    path.write_text(
        '<robot name="arm"><link name="base"/>'
        f'<link name="arm">{inertial() if moving is None else moving}</link>'
        f'<link name="tip">{inertial() if fixed is None else fixed}</link>'
        '<joint name="j" type="revolute"><parent link="base"/><child link="arm"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        '<joint name="f" type="fixed"><parent link="arm"/><child link="tip"/>'
        '<origin xyz="0 0 1"/></joint></robot>'
    )
    return path


def refusal(path):
    """Return what MuJoCo itself says of a file."""
    with pytest.raises(ValueError) as raised:
        mujoco.MjModel.from_xml_path(str(path))
    return str(raised.value)


def test_a_file_that_compiles_is_not_mended(tmp_path):
    path = arm(tmp_path)
    reading = compile_mended(path)
    raw = mujoco.MjModel.from_xml_path(str(path))
    assert reading.repairs == ()
    assert reading.compiled.body_inertia.tolist() == raw.body_inertia.tolist()


def test_an_unbalanced_inertia_gets_the_moments_that_balanceinertia_gives(tmp_path):
    path = arm(tmp_path, moving=inertial(UNBALANCED))
    assert "A + B >= C" in refusal(path)
    reading = compile_mended(path, fuse_static=False)
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.balanceinertia, spec.compiler.fusestatic = True, False
    raw = spec.compile()
    (repair,) = reading.repairs
    assert (repair.kind, repair.name, repair.quantity) == ("body", "arm", "inertia")
    assert repair.stated == pytest.approx((1e-5, 1e-4, 1e-5))
    assert repair.used == pytest.approx(tuple(raw.body("arm").inertia))
    assert repair.factor == pytest.approx(4)
    assert reading.compiled.body_inertia == pytest.approx(raw.body_inertia)
    assert reading.compiled.body_mass.tolist() == raw.body_mass.tolist()


def test_an_unbalanced_inertia_of_a_fused_link_is_listed_by_the_name_of_the_link(tmp_path):
    path = arm(tmp_path, fixed=inertial(UNBALANCED))
    reading = compile_mended(path)
    assert reading.compiled.nbody == 2
    assert [repair.name for repair in reading.repairs] == ["tip"]


def test_every_unbalanced_inertia_is_listed(tmp_path):
    path = arm(tmp_path, inertial(UNBALANCED), inertial(UNBALANCED))
    names = {repair.name for repair in compile_mended(path).repairs}
    assert names == {"arm", "tip"}


def test_the_spec_states_what_the_file_states(tmp_path):
    path = arm(tmp_path, moving=inertial(UNBALANCED))
    spec = compile_mended(path).spec
    assert [body.name for body in spec.bodies] == ["world", "base", "arm", "tip"]
    assert stated_moments(spec.body("arm")) == pytest.approx([1e-5, 1e-4, 1e-5])
    assert stated_moments(spec.body("base")) is None


def test_an_inertia_with_a_negative_moment_gets_their_mean(tmp_path):
    path = arm(tmp_path, moving=inertial(INDEFINITE))
    assert "positive eigenvalues" in refusal(path)
    (repair,) = compile_mended(path).repairs
    assert repair.stated == pytest.approx((-2e-4, 4e-4, 1e-4))
    assert repair.used == pytest.approx((1e-4, 1e-4, 1e-4))
    assert repair.factor == math.inf


def test_a_moving_body_without_mass_gets_the_least(tmp_path):
    path = arm(tmp_path, moving="", fixed="")
    assert "mjMINVAL" in refusal(path)
    reading = compile_mended(path)
    rows = [(repair.quantity, repair.stated, repair.used) for repair in reading.repairs]
    assert rows == [("mass", None, LEAST), ("inertia", None, (LEAST,) * 3)]
    assert reading.compiled.body("arm").mass == LEAST


def test_a_negative_mass_is_listed_as_it_is_stated(tmp_path):
    path = arm(tmp_path, moving=inertial(mass=-2), fixed="")
    (repair,) = compile_mended(path).repairs
    assert (repair.quantity, repair.stated, repair.used, repair.unit) == ("mass", -2, LEAST, "kg")


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("absent.stl", None, "opening file"),
        ("shape.dae", "<COLLADA/>", "no decoder"),
        ("text.stl", ASCII_STL, "ASCII"),
        ("text.obj", "hello", "vertices"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_deleted(tmp_path, name, content, reason):
    if content is not None:
        (tmp_path / name).write_text(content)
    path = arm(tmp_path, moving=inertial() + mesh(name))
    assert reason in refusal(path)
    reading = compile_mended(path)
    lost, geom = reading.repairs
    assert (lost.kind, lost.stated, lost.is_deleted) == ("mesh", name, True)
    assert reason in lost.reason
    assert (geom.kind, geom.body, geom.stated) == ("geom", "arm", name.partition(".")[0])
    assert reading.compiled.ngeom == 0


def test_meshes_that_can_be_read_stay(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    (tmp_path / "a" / "part.obj").write_text(TETRAHEDRON)
    path = arm(
        tmp_path,
        moving=inertial() + mesh("a/part.obj"),
        fixed=inertial() + mesh("b/part.obj"),
    )
    reading = compile_mended(path)
    assert [repair.stated for repair in reading.repairs if repair.kind == "mesh"] == ["b/part.obj"]
    assert (reading.compiled.ngeom, reading.compiled.nmesh) == (1, 1)


def test_visual_shapes_are_read_where_they_are_asked_for(tmp_path):
    (tmp_path / "part.obj").write_text(TETRAHEDRON)
    path = arm(tmp_path, moving=inertial() + mesh("part.obj", "visual"))
    assert compile_mended(path).compiled.ngeom == 0
    reading = compile_mended(path, visuals=True)
    assert [geom.meshname for geom in reading.spec.geoms] == ["part"]
    assert reading.compiled.geom_contype.tolist() == [0]


def test_assets_of_an_mjcf_are_deleted_with_what_refers_to_them(tmp_path):
    path = tmp_path / "scene.xml"
    path.write_text(
        """<mujoco>
        <asset>
          <mesh name="m" file="no.obj"/>
          <texture name="t" type="2d" file="no.png"/>
          <material name="painted" texture="t"/>
          <hfield name="h" file="other.png" size="1 1 1 1"/>
        </asset>
        <worldbody>
          <site name="s" type="mesh" mesh="m"/>
          <geom name="ground" type="hfield" hfield="h"/>
          <body name="b">
            <joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <geom name="ball" size="0.1" material="painted"/>
            <geom type="mesh" mesh="m"/>
            <geom name="g" type="mesh" mesh="m"/>
          </body>
          <body name="c" pos="0 0 3"><freejoint/><geom name="other" size="0.1"/></body>
        </worldbody>
        <contact><pair name="p" geom1="g" geom2="other"/></contact>
        <sensor><distance name="d" geom1="other" geom2="g"/></sensor>
        </mujoco>"""
    )
    reading = compile_mended(path)
    rows = {(repair.kind, repair.name, repair.used) for repair in reading.repairs}
    assert rows == {
        ("mesh", "m", None),
        ("texture", "t", None),
        ("hfield", "h", None),
        ("geom", "ground", None),
        ("geom", "geom 2", None),
        ("geom", "g", None),
        ("site", "s", "sphere"),
        ("pair", "p", None),
        ("sensor", "d", None),
    }
    raw = reading.compiled
    assert (raw.ngeom, raw.nsite, raw.npair, raw.nsensor, raw.nmat) == (2, 1, 0, 0, 1)


def test_the_line_of_an_mjcf_is_told(tmp_path):
    path = tmp_path / "body.xml"
    path.write_text(
        '<mujoco><worldbody>\n<body><joint/>\n<inertial pos="0 0 0" mass="1" '
        'diaginertia="1 0.1 0.1"/></body></worldbody></mujoco>'
    )
    (repair,) = compile_mended(path).repairs
    assert (repair.name, repair.line) == ("body 1", 2)


def test_what_nothing_here_mends_is_an_error(tmp_path):
    path = tmp_path / "body.xml"
    path.write_text('<mujoco><worldbody><geom size="-1"/></worldbody></mujoco>')
    with pytest.raises(ModelError, match="size"):
        compile_mended(path)


def test_what_the_file_itself_has_balanced_is_listed_too(tmp_path):
    path = arm(tmp_path, moving=inertial(UNBALANCED))
    text = path.read_text().replace(
        '<robot name="arm">',
        '<robot name="arm"><mujoco><compiler balanceinertia="true"/></mujoco>',
    )
    path.write_text(text)
    reading = compile_mended(path, fuse_static=False)
    raw = mujoco.MjModel.from_xml_path(str(path))
    assert [(repair.name, repair.factor) for repair in reading.repairs] == [
        ("arm", pytest.approx(4))
    ]
    assert raw.nbody == 2
    assert reading.compiled.body("arm").inertia == pytest.approx([4e-5, 4e-5, 4e-5])
