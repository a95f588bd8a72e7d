"""From a name to a file, and from a file to a Model."""

from __future__ import annotations

import inspect
import itertools
import pickle
import re
import stat
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import statemachine as sm
from statemachine import backends, errors, rotations
from statemachine.engines.mujoco.file_reading import read_file
from statemachine.interface.checks import as_vector
from statemachine.lab.compare import parse_sides
from statemachine.lab.robots import find
from statemachine.models import models_dir, resolve
from statemachine.show.as_json import dumps

from .support.backends import each_of_both, registered
from .support.claims import assert_has, refused
from .support.files import written, written_all
from .support.motions import opened
from .support.small_models import MOTORS, PACKAGED_URDF, model_of

ONE_JOINT = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"


def test_a_model_is_found_by_its_name_or_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = models_dir() / "so101" / "so101.xml"
    own = written(tmp_path / "a.xml", "<mujoco/>")
    monkeypatch.chdir(tmp_path)
    files = {"so101/scene": arm.with_name("scene.xml"), "a.xml": own}
    files |= dict.fromkeys(("so101", "so101/so101", str(arm), arm), arm)
    assert {name: resolve(name) for name in files} == files


def test_a_model_is_found_in_a_menagerie_or_in_one_of_its_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "robotstudio_so101"
    written_all(home, {"so101.xml": "<mujoco/>", "scene.xml": "<mujoco/>"})
    for root in (tmp_path, home):
        for name, file in (
            ("so101/scene", "scene.xml"),
            ("so101", "so101.xml"),
            ("robotstudio_so101/scene", "scene.xml"),
        ):
            assert resolve(name, root) == home / file
    refused(
        (
            errors.UnknownNameError,
            "Did you mean 'robotstudio_so101/scene'",
            lambda: resolve("so101/scen", tmp_path),
        )
    )
    monkeypatch.setenv("MENAGERIE", str(tmp_path))
    assert resolve("robotstudio_so101/scene") == home / "scene.xml"
    # Our own names stay ours, whatever the environment says.
    assert resolve("so101/scene") == models_dir() / "so101" / "scene.xml"


def test_what_is_no_model_is_refused(tmp_path: Path) -> None:
    files = ["", " ", "\0", "a\0.xml", "nowhere.xml", "nowhere/so101.xml"]
    names = ["so101/scen", "so10", "scene", "../so101", "so101/../so101"]
    text = written(tmp_path / "robot.txt", "hello")
    (tmp_path / "robot.xml").mkdir()
    refused(
        *((errors.ModelFileError, "", partial(resolve, name)) for name in files),
        *((errors.UnknownNameError, "", partial(resolve, name)) for name in names),
        (errors.ModelFileError, "folder", lambda: resolve(tmp_path / "robot.xml")),
        (errors.ModelFileError, r"\.xml", lambda: resolve(text)),
    )


def test_a_mesh_that_is_missing_is_told_with_its_folder(tmp_path: Path) -> None:
    text, folder = resolve("so101").read_text(), re.escape(str(tmp_path / "look"))
    refused((errors.ModelError, f"{folder}: copy that folder", lambda: model_of(tmp_path, text)))


def test_an_mjcf_may_say_so_in_its_name(tmp_path: Path) -> None:
    file = written(tmp_path / "robot.mjcf", ONE_JOINT)
    assert sm.load(file).path == file
    assert [found.name for found in find([tmp_path])] == ["robot.mjcf"]
    assert parse_sides([f"{file}@mujoco"])[0].path == file
    assert read_file(file).format == "MJCF"


@pytest.mark.parametrize(
    "content",
    ["", "<mujoco", "<robot", "<mujoco><worldbody><body><geom/></body></worldbody></mujoco>",
     "\x00\x01\x02", "<mujoco><include file='gone.xml'/></mujoco>",
     "<mujoco><asset><mesh file='gone.stl'/></asset></mujoco>"],
)  # fmt: skip
def test_a_malformed_file_is_refused_without_a_word_of_the_engine(
    tmp_path: Path, content: str, capfd: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path / "bad.xml", content)
    refused((errors.ModelError, re.escape(str(file)), lambda: sm.load(file)))
    assert capfd.readouterr() == ("", "")


def test_a_file_with_a_unicode_name_and_spaces(tmp_path: Path) -> None:
    assert sm.load(written(tmp_path / "Ärm № 1.xml", ONE_JOINT)).nq == 1


def test_a_model_survives_a_pickle(backend: str) -> None:
    model = sm.load("so101/scene_box", backend=backend).replace(gravity=[0, 0, -1])
    copy = pickle.loads(pickle.dumps(model))
    assert not copy.jnt_range.flags.writeable
    assert not copy.keyframes[0].qpos.flags.writeable
    with opened(model, 0, nstep=20) as (_, data), opened(copy, 0, nstep=20) as (_, other):
        assert sm.get_state(model, data) == sm.get_state(copy, other)


def test_a_model_is_constant(arm: sm.Model) -> None:
    names = "jnt_range", "actuator_ctrlrange", "actuator_kp", "site_pos", "jnt_qposadr"
    refused(
        *((ValueError, "read-only", partial(getattr(arm, name).fill, 1)) for name in names),
        (errors.ReadOnlyError, "", lambda: setattr(arm, "timestep", 1.0)),
    )


def test_gains_and_ranges_are_the_servos(tmp_path: Path) -> None:
    assert np.allclose(sm.load("so101").actuator_forcerange, [-2.94, 2.94])
    model = model_of(tmp_path, MOTORS)
    assert np.isnan(model.actuator_kp).all()
    assert np.isinf(model.actuator_ctrlrange).all()
    assert not model.jnt_limited.any()


def test_backends_can_be_registered() -> None:
    with registered("other", "statemachine.backends.mujoco_backend:load"):
        assert sm.load("so101", backend="other").nq == 6
        assert "other" in backends.backend_names()
    refused((errors.BadInputError, "", lambda: backends.register("other", "no colon")))


def test_a_model_without_anything_steps(tmp_path: Path) -> None:
    """No joints, no actuators: empty arrays, not errors; and a read-only folder is enough."""
    file = written(tmp_path / "empty.xml", "<mujoco/>")
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    with opened(sm.load(file)) as (model, data):
        tmp_path.chmod(stat.S_IRWXU)
        sm.forward(model, data)
        sm.step(model, data, 3)
        sm.set_state(model, data, sm.get_state(model, data))
        assert (data.qpos.shape, data.time) == ((0,), pytest.approx(3 * model.timestep))


@pytest.mark.parametrize("where", ["robot/urdf", "robot"])
def test_meshes_of_ros_packages_are_found_in_the_folders_above(tmp_path: Path, where: str) -> None:
    meshes = tmp_path / "robot" / "meshes"
    meshes.mkdir(parents=True)
    corners = itertools.product("01", repeat=3)
    written(meshes / "a & b.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in corners))
    file = tmp_path / where / "robot.urdf"
    file.parent.mkdir(exist_ok=True)
    file.write_text(PACKAGED_URDF.format(name="a &amp; b.obj"))
    model = sm.load(file)
    assert (model.nq, model.compiled.nmesh) == (1, 1)
    file.write_text(PACKAGED_URDF.format(name="none.obj"))
    refused((errors.ModelError, r"none\.obj", lambda: sm.load(file)))


# Small things
quats = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
    lambda q: float(np.linalg.norm(q)) > 0.1
)


def test_every_error_is_also_a_fitting_builtin_and_survives_a_pickle() -> None:
    kinds = [
        kind
        for _, kind in inspect.getmembers(errors, inspect.isclass)
        if issubclass(kind, errors.StateMachineError)
    ]
    assert len(kinds) > 10
    for kind in kinds:
        copy = pickle.loads(pickle.dumps(kind("what happened", time=1.5, index=3)))
        assert_has(copy, __class__=kind, time=1.5, index=3)
        assert str(copy) == "what happened"
        if kind is not errors.StateMachineError:
            _, builtin = kind.__bases__
            assert builtin.__module__ == "builtins"


@given(quats)
def test_quaternion_orders_are_inverse(quat: list[float]) -> None:
    assert np.array_equal(rotations.wxyz_from_xyzw(rotations.xyzw_from_wxyz(quat)), quat)
    assert rotations.xyzw_from_wxyz(quat)[3] == quat[0]


@given(quats)
def test_matrices_of_quaternions(quat: list[float]) -> None:
    unit = np.array(quat) / np.linalg.norm(quat)
    matrix = rotations.matrix_from_quat(unit)
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1)
    assert np.allclose(matrix, rotations.matrix_from_quat(-unit), atol=1e-12)
    # The vector part is the axis, which a rotation leaves alone.
    assert np.allclose(matrix @ unit[1:], unit[1:], atol=1e-12)


@given(st.sampled_from(["x", "y", "z"]), st.floats(-3.0, 3.0) | st.floats(-1e-9, 1e-9))
def test_angle_between_keeps_its_digits(axis: str, angle: float) -> None:
    quat = [np.cos(angle / 2), *(np.sin(angle / 2) * np.eye(3)["xyz".index(axis)])]
    found = rotations.angle_between(np.eye(3), rotations.matrix_from_quat(quat))
    assert float(found) == pytest.approx(abs(angle), rel=1e-9, abs=1e-15)


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=8))
def test_as_vector_takes_what_is_finite_and_nothing_else(values: list[float]) -> None:
    if len(values) == 6 and all(abs(value) <= 1e10 for value in values):
        assert np.array_equal(as_vector(values, (6,), "x"), values)
    else:
        refused((errors.BadInputError, "", lambda: as_vector(values, (6,), "x")))


def test_a_state_reads_as_what_it_holds(backend: str) -> None:
    with opened(sm.load("so101", backend=backend)) as (model, data):
        data.qpos[1] = 0.5
        data.time = 3.0
        state = sm.get_state(model, data)
    assert_has(state, time=3.0, backend=backend)
    assert state["qpos"].tolist() == [0, 0.5, 0, 0, 0, 0]
    refused(
        (errors.UnknownNameError, "qpos", lambda: state["qpo"]),
        (AttributeError, "", lambda: setattr(state, "blob", b"")),
    )


@each_of_both  # which start from a compiled model
def test_a_model_tells_what_it_was_compiled_to(box: sm.Model) -> None:
    assert box.compiled.nq == box.nq
    assert np.array_equal(box.compiled.key_qpos[0], box.keyframes[0].qpos)
    faster = box.replace(timestep=0.001)
    assert (box.compiled.opt.timestep, faster.compiled.opt.timestep) == (0.005, 0.001)


def test_json_has_no_nan() -> None:
    text = dumps({"a": float("nan"), "b": np.array([1.0, np.inf])})
    assert text == dumps({"a": None, "b": [1.0, None]})
