"""From a file to a Model: frames of fused links, meshes named otherwise, options of `load`."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import on_default
from statemachine.backends.compiled.repairs import compile_mended
from statemachine.errors import BadInputError, EngineWarning, ModelError, UnsupportedError
from statemachine.interface.sites import usual_site
from statemachine.lab.compare.matching import match_models
from statemachine.lab.compare.witnessed import witness
from statemachine.lab.recordings import record, write
from statemachine.lab.recordings.request import PlayRequest, answer_play
from statemachine.lab.validate.fingertip import certify
from statemachine.releases import is_here

from .support.backends import BOTH
from .support.requirements import SHARED, shared

mujoco = pytest.importorskip("mujoco")

ROUND = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
UNBALANCED = '<inertia ixx="1e-3" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
# Of `tool` in `lower`: what the fixed joints of the file say one after the other.
TOOL_LINK = '<link name="tool"/>'
HAND, TOOL = ("0.1 0 0.2", "0.3 -0.2 0.5"), ("0 0.05 0.1", "0 0 1.2")


def link(name, inertia=ROUND, mesh=""):
    shape = f'<collision><geometry><mesh filename="{mesh}"/></geometry></collision>' if mesh else ""
    return f'<link name="{name}"><inertial><mass value="0.2"/>{inertia}</inertial>{shape}</link>'


def fixed(parent, child, xyz="0 0 0", rpy="0 0 0"):
    return (
        f'<joint name="{child}_mount" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/></joint>'
    )


def hinge(name, parent, child, axis="0 1 0"):
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.3"/><axis xyz="{axis}"/>'
        '<limit lower="-2" upper="2" effort="9" velocity="9"/></joint>'
    )


def arm(folder, inertia=ROUND, mesh="", compiler="", lower=ROUND):
    """Write a URDF: stand (on the world), upper, lower; hand and tool are fixed to lower."""
    path = folder / "arm.urdf"
    head = f"<mujoco><compiler {compiler}/></mujoco>" if compiler else ""
    path.write_text(
        f'<robot name="arm">{head}{link("stand")}{link("upper", mesh=mesh)}{link("lower", lower)}'
        f"{link('hand', inertia)}{TOOL_LINK}"
        + hinge("shoulder", "stand", "upper")
        + hinge("elbow", "upper", "lower", "0 0.6 0.8")
        + fixed("lower", "hand", *HAND)
        + fixed("hand", "tool", *TOOL)
        + "</robot>"
    )
    return path


def pinocchio_pose(path, frame, qpos):
    """Return place (3,) and rotation (3, 3) of a frame, by Pinocchio alone."""
    pin = pytest.importorskip("pinocchio")
    robot = pin.buildModelFromUrdf(str(path))
    data = robot.createData()
    pin.framesForwardKinematics(robot, data, np.asarray(qpos, float))
    pose = data.oMf[robot.getFrameId(frame)]
    return pose.translation.copy(), pose.rotation.copy()


def needs(backend):
    pytest.importorskip(backend)


# Frames behind fixed joints.


@pytest.mark.parametrize("defaults", ["model", "engine"])
@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize("frame", ["tool", "hand", "stand"])
def test_the_frame_of_a_fused_link_is_a_site(tmp_path, backend, defaults, frame):
    needs(backend)
    path = arm(tmp_path)
    model = sm.load(path, backend=backend, defaults=defaults)
    with sm.make_data(model) as data:
        data.qpos[:] = 0.4, -0.7
        sm.forward(model, data)
        site = model.site_id(frame)
        pos, mat = data.site_xpos[site].copy(), data.site_xmat[site].reshape(3, 3).copy()
    where, turned = pinocchio_pose(path, frame, [0.4, -0.7])
    tolerance = 1e-12 if defaults == "model" else 1e-6
    assert pos == pytest.approx(where, abs=tolerance)
    assert mat == pytest.approx(turned, abs=tolerance)


@pytest.mark.parametrize("backend", BOTH)
def test_a_link_that_moves_stays_a_body_and_no_site(tmp_path, backend):
    needs(backend)
    model = sm.load(arm(tmp_path), backend=backend)
    assert model.body_names == ("world", "upper", "lower")
    assert model.site_names == ("stand", "hand", "tool")


def test_frames_change_no_other_number_of_the_compiled_model(tmp_path):
    path = arm(tmp_path)
    ours, raw = sm.load(path).raw, mujoco.MjModel.from_xml_path(str(path))
    for name in ("body_mass", "body_ipos", "body_iquat", "body_inertia", "dof_M0", "qpos0"):
        assert getattr(ours, name).tobytes() == getattr(raw, name).tobytes(), name


def test_states_move_between_files_with_and_without_frames(tmp_path):
    path = arm(tmp_path)
    text = path.read_text()
    without = tmp_path / "plain.urdf"
    without.write_text(text.replace(fixed("hand", "tool", *TOOL), "").replace(TOOL_LINK, ""))
    model, other = sm.load(path), sm.load(without)
    assert model.site_names != other.site_names
    with sm.make_data(model) as data, sm.make_data(other) as there:
        data.qpos[:] = 0.1, 0.2
        sm.set_state(other, there, sm.get_state(model, data))
        assert there.qpos.tolist() == [0.1, 0.2]


def test_a_link_stays_a_body_where_the_file_says_not_to_fuse(tmp_path):
    model = sm.load(arm(tmp_path, compiler='fusestatic="false"'))
    assert {"hand", "tool"} <= set(model.body_names)
    assert model.nsite == 0


def test_an_mjcf_that_fuses_keeps_its_frames_and_its_sites(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco><compiler fusestatic="true"/><worldbody><body name="a" pos="0 0 1"><joint/>
        <geom size="0.1"/><body name="flange" pos="0 0.2 0"><geom size="0.05"/>
        <site name="own" pos="0 0 0.1"/><body name="own2" pos="0.3 0 0"/></body></body>
        </worldbody></mujoco>"""
    )
    model = sm.load(path)
    assert model.body_names == ("world", "a")
    assert sorted(model.site_names) == ["flange", "own", "own2"]
    assert model.site_pos[model.site_id("own2")].tolist() == [0.3, 0.2, 0]


@pytest.mark.parametrize("backend", BOTH)
def test_the_tool_of_a_urdf_can_be_certified(tmp_path, backend):
    needs(backend)
    pytest.importorskip("pinocchio")
    path = arm(tmp_path)
    result = certify(sm.load(path, backend=backend), poses=20, site="tool")
    where, _ = pinocchio_pose(path, "tool", [0, 0])
    assert result.verdict == "agrees"
    assert result.default_pose == pytest.approx(tuple(where), abs=1e-12)


# Meshes that are named otherwise than where they are.


def with_mesh(folder, name, **more):
    (folder / "meshes").mkdir()
    (folder / "meshes" / "part.obj").write_text(TETRAHEDRON)
    return arm(folder, mesh=name, **more)


@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize(
    "name", ["meshes/part.obj", "package://arm_description/meshes/part.obj", "part.obj"]
)
def test_a_mesh_is_read_whose_name_has_the_meshdir_once_more(tmp_path, backend, name):
    needs(backend)
    path = with_mesh(tmp_path, name, compiler='meshdir="meshes"')
    model = sm.load(path, backend=backend)
    assert model.ngeom == 1
    assert model.compiled.mesh_vert.max() - model.compiled.mesh_vert.min() > 0.9


def test_what_is_named_as_written_goes_before_what_is_found_without_its_folders(tmp_path):
    path = with_mesh(tmp_path, "meshes/part.obj", compiler='meshdir="."')
    (tmp_path / "part.obj").write_text(TETRAHEDRON.replace("1", "3", 1))
    raw = sm.load(path).raw
    paths = raw.paths.decode().split("\0")
    assert any(Path(name).parts[-2:] == ("meshes", "part.obj") for name in paths)


def test_a_mesh_that_is_nowhere_is_an_error_that_names_strippath(tmp_path):
    path = arm(tmp_path, mesh="meshes/part.obj", compiler='meshdir="meshes"')
    with pytest.raises(ModelError, match=r"strippath.*meshes=False"):
        sm.load(path)


def test_a_stripped_name_that_the_file_asks_for_is_read_by_the_engine_itself(tmp_path):
    path = with_mesh(tmp_path, "x/part.obj", compiler='meshdir="meshes" strippath="true"')
    assert sm.load(path).ngeom == mujoco.MjModel.from_xml_path(str(path)).ngeom == 1


# Options that act while a file is read.


@pytest.mark.parametrize("backend", BOTH)
def test_balance_inertia_reads_what_the_engine_refuses(tmp_path, backend):
    needs(backend)
    path = arm(tmp_path, lower=UNBALANCED)
    with pytest.raises(ModelError, match="balance_inertia=True"):
        sm.load(path, backend=backend)
    with pytest.warns(EngineWarning, match="lower"):
        model = sm.load(path, backend=backend, balance_inertia=True)
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.balanceinertia = True
    assert model.compiled.body_inertia == pytest.approx(spec.compile().body_inertia)
    assert model.read_options.balance_inertia


def test_balance_inertia_says_nothing_of_a_file_that_needs_it_not(tmp_path):
    with warnings.catch_warnings(action="error"):
        sm.load(arm(tmp_path), balance_inertia=True)


@pytest.mark.parametrize("defaults", ["model", "engine"])
@pytest.mark.parametrize("backend", BOTH)
def test_meshes_off_reads_a_file_whose_meshes_are_missing(tmp_path, backend, defaults):
    needs(backend)
    path = arm(tmp_path, mesh="absent.stl")
    with pytest.raises(ModelError, match="meshes=False"):
        sm.load(path, backend=backend, defaults=defaults)
    with pytest.warns(EngineWarning, match="upper"):
        model = sm.load(path, backend=backend, defaults=defaults, meshes=False)
    assert model.ngeom == 0
    with sm.make_data(model) as data:
        sm.step(model, data, 3)
        assert np.isfinite(data.qpos).all()


def test_both_options_are_named_where_both_are_needed(tmp_path):
    path = arm(tmp_path, mesh="absent.stl", lower=UNBALANCED)
    with pytest.raises(ModelError, match="balance_inertia=True, meshes=False"):
        sm.load(path)


def test_an_error_that_no_option_mends_names_none(tmp_path):
    path = tmp_path / "ball.xml"
    path.write_text('<mujoco><worldbody><geom size="-1"/></worldbody></mujoco>')
    with pytest.raises(ModelError) as raised:
        sm.load(path)
    assert "load(" not in str(raised.value)


def test_a_variant_of_a_model_was_read_as_the_model_was(tmp_path):
    path = arm(tmp_path, mesh="absent.stl")
    with pytest.warns(EngineWarning):
        model = sm.load(path, meshes=False)
    assert model.replace(timestep=0.001).read_options == model.read_options
    assert model.replace(meshes=False, timestep=0.001).timestep == 0.001


def test_how_a_file_was_read_cannot_be_replaced(tmp_path):
    with pytest.raises(UnsupportedError, match="while a file is read"):
        sm.load(arm(tmp_path)).replace(meshes=False)


def test_options_are_on_or_off(tmp_path):
    with pytest.raises(BadInputError, match="meshes"):
        sm.load(arm(tmp_path), meshes="no")  # pyright: ignore[reportArgumentType]


def test_a_binary_model_is_read_as_it_is(tmp_path):
    file = tmp_path / "arm.mjb"
    mujoco.mj_saveModel(sm.load(arm(tmp_path)).raw, str(file))
    with pytest.warns(EngineWarning), pytest.raises(BadInputError, match="binary"):
        sm.load(file, trust_binary=True, meshes=False)


def test_a_side_of_a_comparison_takes_the_options(tmp_path):
    from statemachine.lab.compare.typed_sides import parse_sides

    path = arm(tmp_path, mesh="absent.stl", lower=UNBALANCED)
    (side,) = parse_sides([str(path), "balance_inertia=on", "meshes=off"])
    with pytest.warns(EngineWarning):
        model = side.load(timestep=0.001)
    assert (model.ngeom, model.timestep) == (0, 0.001)


# Other releases.


def release():
    """Return an older release of MuJoCo that is installed here, as a backend."""
    name = "mujoco==3.3.7"
    if not is_here(name):
        pytest.skip(f"{name} is not installed here: statemachine engines add {name}")
    return name


@pytest.mark.slow
def test_a_release_has_the_frames_of_fused_links(tmp_path):
    path = arm(tmp_path)
    model = sm.load(path, backend=release())
    with sm.make_data(model) as data:
        data.qpos[:] = 0.4, -0.7
        sm.forward(model, data)
        site = model.site_id("tool")
        pos, mat = data.site_xpos[site].copy(), data.site_xmat[site].reshape(3, 3).copy()
    where, turned = pinocchio_pose(path, "tool", [0.4, -0.7])
    assert pos == pytest.approx(where, abs=1e-12)
    assert mat == pytest.approx(turned, abs=1e-12)


@pytest.mark.slow
def test_a_release_reads_a_mesh_whose_name_has_the_meshdir_once_more(tmp_path):
    path = with_mesh(tmp_path, "meshes/part.obj", compiler='meshdir="meshes"')
    assert sm.load(path, backend=release()).ngeom == 1


@pytest.mark.slow
@pytest.mark.parametrize("form", ["urdf", "xml"])
def test_a_release_reads_with_the_options(tmp_path, form):
    path = arm(tmp_path, mesh="absent.stl", lower=UNBALANCED)
    if form == "xml":
        path = tmp_path / "arm.xml"
        path.write_text(
            '<mujoco><asset><mesh name="m" file="absent.stl"/></asset><worldbody><body name="a">'
            '<joint/><inertial pos="0 0 0" mass="1" diaginertia="1 0.1 0.1"/>'
            '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
        )
    with pytest.warns(EngineWarning):
        here = sm.load(path, balance_inertia=True, meshes=False)
    with pytest.warns(EngineWarning):
        there = sm.load(path, backend=release(), balance_inertia=True, meshes=False)
    assert there.ngeom == 0
    assert there.read_options == here.read_options
    assert there.compiled.body_inertia == pytest.approx(here.compiled.body_inertia)


def test_the_frame_behind_the_fixed_joints_of_the_shared_case():
    folder = shared(SHARED / "cases") / "frame_behind_fixed_joint"
    model = sm.load(folder / "arm.urdf")
    with sm.make_data(model) as data:
        sm.forward(model, data)
        tool = data.site_xpos[model.site_id("tool0")]
        assert tool == pytest.approx([0.02263199, -0.05207348, 0.70635730], abs=1e-8)
        assert data.site_xpos[model.site_id("hand")] == pytest.approx([0, 0, 0.65])


def test_a_frame_of_the_world_is_not_the_usual_site(tmp_path):
    moving = sm.load(arm(tmp_path))
    assert moving.moving_sites == (False, True, True)
    assert usual_site(moving.site_names, moving.moving_sites) == moving.site_id("tool")
    path = tmp_path / "bar.urdf"
    path.write_text(
        f'<robot name="bar">{link("stand")}{link("bar")}{hinge("j", "stand", "bar")}</robot>'
    )
    still = sm.load(path)
    assert still.site_names == ("stand",)
    assert usual_site(still.site_names, still.moving_sites) is None


def test_a_run_of_a_file_that_was_read_with_options_is_played_again(tmp_path):
    path = arm(tmp_path, mesh="absent.stl")
    with pytest.warns(EngineWarning):
        model = sm.load(path, meshes=False)
    trace = record(model, None, 0.01)
    assert trace.header.options == {"meshes": False}
    file = write(trace, tmp_path / "run.npz")
    with pytest.warns(EngineWarning):
        again = answer_play(PlayRequest(str(file)))
    assert again.qpos.tolist() == trace.qpos.tolist()


def test_a_model_of_another_engine_is_read_again_as_it_was(tmp_path):
    needs("pybullet")
    with pytest.warns(EngineWarning):
        model = sm.load(arm(tmp_path, mesh="absent.stl"), backend="pybullet", meshes=False)
    assert on_default(model).ngeom == 0


@pytest.mark.parametrize("backend", BOTH)
def test_balance_inertia_reads_a_rod_without_inertia_about_its_axis(tmp_path, backend):
    needs(backend)
    rod = '<inertia ixx="1.2e-4" iyy="1.2e-4" izz="0" ixy="0" ixz="0" iyz="0"/>'
    path = arm(tmp_path, lower=rod, inertia=ROUND)
    with pytest.raises(ModelError, match="balance_inertia=True"):
        sm.load(path, backend=backend)
    with pytest.warns(EngineWarning, match="lower"):
        sm.load(path, backend=backend, balance_inertia=True)
    (repair,) = compile_mended(path).repairs
    assert repair.used == pytest.approx((8e-5, 8e-5, 8e-5))


@pytest.mark.slow
def test_a_release_balances_a_rod_without_inertia_about_its_axis(tmp_path):
    rod = '<inertia ixx="1.2e-4" iyy="1.2e-4" izz="0" ixy="0" ixz="0" iyz="0"/>'
    path = arm(tmp_path, lower=rod)
    with pytest.warns(EngineWarning):
        here = sm.load(path, balance_inertia=True)
    with pytest.warns(EngineWarning):
        there = sm.load(path, backend=release(), balance_inertia=True)
    assert there.compiled.body_inertia == pytest.approx(here.compiled.body_inertia)


@pytest.mark.parametrize("suffix", ["xml", "mjcf"])
def test_what_the_compiler_warns_of_is_one_warning_of_ours(tmp_path, suffix):
    path = tmp_path / f"ball.{suffix}"
    path.write_text(
        '<mujoco><compiler settotalmass="3"/><worldbody><body><joint/><geom size="0.1"/></body>'
        "</worldbody></mujoco>"
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sm.load(path)
    assert [warning.category for warning in caught] == [EngineWarning]
    assert "settotalmass" in str(caught[0].message)


def test_the_frame_of_a_urdf_has_a_third_party_in_a_comparison(tmp_path):
    pytest.importorskip("pinocchio")
    path = arm(tmp_path)
    trace = record(sm.load(path), None, 0.05)
    found = witness(trace, trace, path)
    assert found is not None
    assert (found.site, found.grade) == ("tool", "own reading")
    assert max(found.left, found.right) < 1e-12


def test_frames_of_links_that_are_bodies_in_the_other_file_are_not_missed(tmp_path):
    fused, kept = tmp_path / "fused", tmp_path / "kept"
    fused.mkdir()
    kept.mkdir()
    left, right = sm.load(arm(fused)), sm.load(arm(kept, compiler='fusestatic="false"'))
    matched = match_models(left, right)
    assert matched.only[0]["site"] == ()
    assert [left.body_names[a] for a, _ in matched.bodies][1:] == ["upper", "lower"]


def test_frames_are_matched_by_name_between_two_urdfs(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    left, right = sm.load(arm(one)), sm.load(arm(two))
    matched = match_models(left, right)
    assert list(matched.sites) == [(k, k) for k in range(left.nsite)]
    assert not any(matched.only[0].values())


def test_a_mesh_is_found_by_a_file_url_and_from_the_folder_of_the_urdf(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    place = tmp_path / "elsewhere" / "part.obj"
    place.write_text(TETRAHEDRON)
    for name in (f"file://{place}", "elsewhere/part.obj"):
        assert sm.load(arm(tmp_path, mesh=name, compiler='meshdir="meshes"')).ngeom == 1
