"""What is particular to the PyBullet backend: how near it comes, and what it must not lose."""

from __future__ import annotations

import gc
import os
import shlex
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    EngineError,
    EngineWarning,
    UnsupportedError,
)

from .support.backends import bullet_clients
from .support.claims import assert_has, assert_in, overlapping, refused
from .support.files import written
from .support.golden import angles
from .support.motions import after, opened, path
from .support.patches import around
from .support.processes import memory_of, runs_in_silence
from .support.pybullet_claims import two_free_bodies_are_two
from .support.requirements import ROOT
from .support.small_models import TWO_ROOTS, on_both

Golden = Callable[[str], np.ndarray]
HOLD = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)
LIFT = 1  # the place of shoulder_lift
linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc, or forks")
pytestmark = pytest.mark.usefixtures("bullet")
load = partial(sm.load, backend="pybullet")
posix = pytest.mark.skipif(os.name != "posix", reason="signals and descriptors of POSIX")


@pytest.fixture
def box(bullet: None) -> sm.Model:
    """Return the arm with a box, on PyBullet."""
    return load("so101/scene_box")


def mjcf(folder: Path, inside: str, name: str = "m.xml") -> Path:
    return written(folder / name, f"<mujoco model='m'>{inside}</mujoco>")


# How near it comes to MuJoCo, at the 5 ms of the model.


@pytest.mark.parametrize(
    ("actuation", "ctrl", "steps", "table", "most"),
    [
        (True, HOLD, 53, "golden_hold", 0.03),  # 0.019 was measured, in the last step
        (True, (0.0,) * 6, 800, "golden_gravity_on", 0.005),  # 0.0023 was measured
        (False, (0.0,) * 6, 40, "golden_gravity_off", 1e-4),  # 8e-7 was measured
    ],
)
def test_until_the_first_contact_it_moves_as_the_golden_run(
    golden: Golden, actuation: bool, ctrl: tuple[float, ...], steps: int, table: str, most: float
) -> None:
    with opened(load("so101/scene", actuation=actuation), ctrl=ctrl) as (model, data):
        for expected in angles(golden(table))[: steps + 1]:
            assert np.abs(np.degrees(data.qpos - expected)).max() < most
            assert not len(data.contacts)
            sm.step(model, data)


def test_fallen_arm_on_the_floor(golden: Golden) -> None:
    with opened(load("so101/scene", actuation=False)) as (model, data):
        for expected in angles(golden("golden_gravity_off"))[200:801:200]:
            sm.step(model, data, 200)
            assert abs(np.degrees(data.qpos - expected)[LIFT]) < 0.15  # 0.08 was measured
        assert len(data.contacts)


# Replay.


@pytest.mark.parametrize("size", [20, 400])
def test_a_turning_body_adds_up_in_bulk(tmp_path: Path, size: int) -> None:
    """However far it turns in one call, here three turns: of its two quaternions the same."""
    ball = "<body><freejoint/><geom size='0.1' mass='1'/></body>"
    model = load(mjcf(tmp_path, f"<option gravity='0 0 0' timestep='.005'/>{_world(ball)}"))
    spin = (0.0, 0.0, 0.0, 1.0, 9.0, 3.0)
    with opened(model, qvel=spin) as (_, data):
        for _ in range(400 // size):
            sm.step(model, data, size)
        assert np.array_equal(data.qpos, path(model, 400, qvel=spin)[-1])


def _world(inside: str) -> str:
    return f"<worldbody>{inside}</worldbody>"


# Other models than the arm.


def test_a_fast_ball_has_the_signs_of_mujoco(tmp_path: Path) -> None:
    """Its quaternion turns through both halves of the sphere, step by step."""
    ball = _world("<body><freejoint/><geom size='0.1'/></body>")
    start = {"nstep": 300, "qvel": (0.1, 0.2, 0.3, 40, -30, 20)}
    theirs, ours = (path(model, **start)[:, 3:] for model in on_both(mjcf(tmp_path, ball)))
    assert (np.einsum("ni,ni->n", theirs, ours) > 0.99).all()
    assert set(np.sign(theirs[:, 0])) == {1, -1}


def test_two_free_bodies_are_two(tmp_path: Path) -> None:
    """Each is loaded from a text of its own, under a name that may be the other's again."""
    two_free_bodies_are_two(tmp_path)


# Noise.

_ALL = """
import os, sys
import statemachine as sm
for defaults in ("model", "engine"):
    model = sm.load("so101/scene_box", backend="pybullet", defaults=defaults)
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    sm.step(model, data, 5)
    assert len(data.contacts) > 0
    sm.forward(model, data)
    assert len(data.contacts) > 0 and data.qfrc_bias.any() and data.xpos.any()
    sm.set_state(model, data, sm.get_state(model, data))
    sm.step(model, data)
    sm.reset(model, data)
    sm.make_data(model)
    data.close()
open("mark", "w").write("done")
"""


@posix
@pytest.mark.parametrize(
    "shell",
    [
        "<&- >&- 2>&-",
        *(pytest.param(s, marks=pytest.mark.slow) for s in ("", ">&-", "2>&-", ">&- 2>&-")),
    ],
)
def test_it_prints_nothing_and_works_without_streams(tmp_path: Path, shell: str) -> None:
    """The shell takes streams away before Python starts."""
    done = subprocess.run(
        ["/bin/sh", "-c", f"exec {shlex.quote(sys.executable)} -c {shlex.quote(_ALL)} {shell}"],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "mark").read_text() == "done"


# Refusals.

_G = '<geom size="0.1" mass="1"/>'
_JOINT = f'<worldbody><body name="x"><joint name="j"/>{_G}</body></worldbody>'
REFUSED = {
    "ball joint": _world(f'<body><joint name="wrist" type="ball"/>{_G}</body>'),
    "two limits at once": _world(
        f'<body><joint name="wrist" range="-1 1" margin="0.1"/>{_G}</body>'
    ),
    "actuator transmission": _world(f'<body><joint/>{_G}<site name="s"/></body>')
    + '<actuator><motor name="pull" site="s"/></actuator>',
    "actuator of a free joint": _world(f'<body><freejoint name="f"/>{_G}</body>')
    + '<actuator><motor name="jet" joint="f" gear="1 0 0 0 0 0"/></actuator>',
    "actuator dynamics": _JOINT
    + '<actuator><general name="lag" joint="j" dyntype="user" actdim="1"/></actuator>',
    "actuator gain": f'{_JOINT}<actuator><general name="odd" joint="j" gaintype="affine" '
    'gainprm="1 1 1"/></actuator>',
    "stiffness of a free joint": _world(
        f'<body><joint name="f" type="free" stiffness="30"/>{_G}</body>'
    ),
    "shape of a geom": '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>'
    + _world(f'<geom name="hills" type="hfield" hfield="h"/><body><joint/>{_G}</body>'),
    "fluid around an ellipsoid": '<option density="1.2"/>'
    + _world(
        f'<body><joint/>{_G.replace("/>", """ name="fin" fluidshape="ellipsoid"/>""")}</body>'
    ),
    "compensation of gravity by actuators": _world(
        f'<body gravcomp="1"><joint name="j" actuatorgravcomp="true"/>{_G}</body>'
    ),
    "interpolated latency": f'{_JOINT}<actuator><motor joint="j" delay=".007" nsample="9" '
    'interp="linear"/></actuator>',
}
# The part of a file that an error has to name, where it has a name.
NAMED = {
    "ball joint": "wrist", "two limits at once": "wrist", "actuator transmission": "pull",
    "actuator of a free joint": "jet", "actuator dynamics": "lag", "actuator gain": "odd",
    "shape of a geom": "hills", "fluid around an ellipsoid": "fin",
}  # fmt: skip


@pytest.mark.parametrize("feature", REFUSED)
@overlapping
def test_what_it_cannot_do_is_refused_by_name(feature: str, tmp_path: Path) -> None:
    file = mjcf(tmp_path, REFUSED[feature])
    sm.load(file)  # MuJoCo takes it
    for defaults in ("model", "engine"):
        told = partial(load, file, defaults=defaults)
        error = refused((UnsupportedError, NAMED.get(feature, feature), told))
        assert error.backend == "pybullet"
        assert feature in str(error)


def test_an_ellipsoid_that_touches_nothing_is_taken(tmp_path: Path) -> None:
    egg = '<geom type="ellipsoid" size="0.1 0.2 0.3" mass="1" contype="0" conaffinity="0"/>'
    model = load(mjcf(tmp_path, _world(f"<body><joint/>{egg}</body>")))
    # Nothing brakes it.
    assert after(model, 10, qvel=1.0)[0] == pytest.approx(10 * model.timestep)


def test_all_problems_of_a_file_are_named(tmp_path: Path) -> None:
    both = REFUSED["shape of a geom"] + REFUSED["two limits at once"]
    error = refused((UnsupportedError, "", lambda: load(mjcf(tmp_path, both))))
    assert_in(str(error), "joint wrist", "geom hills")


def test_a_contact_margin_is_told(tmp_path: Path) -> None:
    skin = '<body><joint/><geom name="{}" size="0.1" mass="1" margin="{}" {}/></body>'
    look = skin.format("look", 0.1, 'contype="0" conaffinity="0"')
    file = mjcf(tmp_path, _world(skin.format("skin", 0.01, "") + look))
    with pytest.warns(EngineWarning, match=r"margin of 1 geoms \(the largest: 10 mm, skin\)"):
        load(file)
    with warnings.catch_warnings(action="error"):
        load(file, contacts=False)


def test_what_is_switched_off_at_load_is_not_refused(tmp_path: Path) -> None:
    file = mjcf(tmp_path, REFUSED["shape of a geom"])
    models = on_both(file, contacts=False, timestep=0.01, substeps=2)
    for model in models:
        assert_has(model, timestep=0.01, substeps=2)
        with opened(model, qvel=1.0, nstep=10) as (_, data):
            assert data.time == pytest.approx(0.1)
    refused(
        (UnsupportedError, "hills", lambda: models[1].replace(contacts=True)),
        (UnsupportedError, "'contcts'", lambda: load(file, contcts=False)),
    )


@pytest.mark.slow
def test_a_urdf_with_two_roots_is_no_crash(tmp_path: Path) -> None:
    """PyBullet's own reader crashes on it; MuJoCo, which reads it here, fuses both roots."""
    (tmp_path / "two.urdf").write_text(TWO_ROOTS)
    code = """
import statemachine as sm
ends = []
for backend in ("mujoco", "pybullet"):
    model = sm.load("two.urdf", backend=backend)
    with sm.make_data(model) as data:
        data.qvel[:] = 1.0
        sm.step(model, data, 10)
        ends.append((model.body_names, model.joint_names, data.qpos.round(12).tolist()))
assert ends[0] == ends[1], ends
print(ends[1][:2])
"""
    runs_in_silence(code, tmp_path, "(('world', 'c'), ('j',))\n")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("", marks=pytest.mark.slow),
        pytest.param("<mujoco>", marks=pytest.mark.slow),
        "no XML at all",
    ],
)
def test_a_file_that_nobody_reads_is_an_error_of_ours(text: str, tmp_path: Path) -> None:
    for suffix in ("xml", "urdf"):
        written(tmp_path / f"bad.{suffix}", text)
        code = f"""
import statemachine as sm
try:
    sm.load("bad.{suffix}", backend="pybullet")
except sm.errors.StateMachineError as error:
    print(type(error).__name__)
"""
        runs_in_silence(code, tmp_path, "ModelError\n")


# PyBullet as its own users meet it.


_as_it_comes = partial(load, "so101/scene", defaults="engine")


def test_frictions_of_the_engine_as_it_comes_are_pybullet_s() -> None:
    """The rest of what it comes with shows bit for bit in the run of a script of its own."""
    from statemachine.backends.bullet.client import pb

    with sm.make_data(_as_it_comes()) as data:
        for tree in data.raw.trees:
            for link in range(-1, pb.getNumJoints(tree.body, data.raw.client)):
                assert pb.getDynamicsInfo(tree.body, link, data.raw.client)[1] == 0.5


def test_engine_motors_hold_an_arm_that_nobody_drives() -> None:
    with opened(_as_it_comes(gravity=[0, 0, -9.81], actuation=False), nstep=240) as (_, data):
        # Limp, it falls 24° in half a second; 0.012° was measured.
        assert abs(np.degrees(data.qpos[LIFT])) < 0.1
        assert np.abs(np.degrees(data.qpos)).max() < 1.0  # the gripper moves 0.7°
        # The motor carries the weight of the arm, 0.5694 N·m.
        assert data.qfrc_actuator[LIFT] == pytest.approx(-0.5694, rel=0.01)
        assert data.qfrc_actuator[LIFT] == pytest.approx(data.qfrc_bias[LIFT], rel=0.01)


def test_engine_bias_of_the_first_step_does_not_follow_writes() -> None:
    """That of a step right after a reset, of which the arrays are the only copy."""
    with opened(load("so101", defaults="engine", gravity=(0, 0, -9.81)), nstep=1) as (_, data):
        bias = data.qfrc_bias.copy()
    with opened(data.model, nstep=1) as (_, written_to):
        written_to.qpos[:] = 0.7
        written_to.qvel[:] = 3.0
        assert bias.any()
        assert np.array_equal(written_to.qfrc_bias, bias)


def test_engine_does_not_tell_forces_by_part() -> None:
    with opened(_as_it_comes(), nstep=1) as (model, data):
        parts = "qacc", "qfrc_contact", "qfrc_passive", "qfrc_friction", "qfrc_constraint"
        refused(
            *((UnsupportedError, "forces by part", partial(getattr, data, p)) for p in parts),
            (UnsupportedError, "armature", lambda: model.replace(armature=0.1)),
            (UnsupportedError, "damping", lambda: model.replace(damping=0.1)),
            (UnsupportedError, "limits", lambda: model.replace(limits=False)),
        )


# What a Data costs, and gives back.


@linux
@pytest.mark.parametrize(
    ("backend", "name", "cycles"),
    [
        pytest.param("mujoco", "so101/scene_box", 2_000, marks=pytest.mark.slow),
        pytest.param("pybullet", "so101", 400, marks=pytest.mark.slow),
        pytest.param("pybullet", "so101/scene_box", 800, marks=pytest.mark.slow),
    ],
)
def test_memory_stays_flat(backend: str, name: str, cycles: int) -> None:
    model = sm.load(name, backend=backend)
    clients, start = set[int](), 0.0
    for k in range(cycles):
        if k == cycles // 8:  # by then allocators have what they want
            clients, start = bullet_clients(), memory_of()
        after(model, 1)
    # A client that is not given back costs 28 MB; 0.01 MB in 800 cycles was measured.
    assert memory_of() - start < 4.0
    assert bullet_clients() == clients


def test_what_is_dropped_gives_its_clients_back_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    model = load("so101/scene_box")
    before = len(bullet_clients())
    monkeypatch.setattr(gc, "collect", lambda: 0)  # it is in no circle that has to be found first
    kept = [sm.make_data(model) for _ in range(5)]
    for data in kept:
        sm.step(model, data)
        sm.forward(model, data)
        assert data.qacc.any()
    shared = 2  # of the Model's own: the ghost and the mirror
    assert len(bullet_clients()) == before + 5 + shared
    data = kept.clear()
    assert len(bullet_clients()) == before + shared
    del model
    assert len(bullet_clients()) == before


@pytest.mark.parametrize("memory", ["free", "gone"])
def test_no_room_for_a_client_is_said(monkeypatch: pytest.MonkeyPatch, memory: str) -> None:
    from statemachine.backends.bullet import client as bullet_client

    model, answers = load("so101"), [-1, -1]
    where, name, said = {
        "free": (bullet_client.pb, "connect", "1024 worlds in one process at most, of 35 MB each"),
        "gone": (bullet_client, "free_memory", "no memory for another world .*: one takes 35 MB"),
    }[memory]
    around(where, name)(lambda right, *_: answers.pop() if answers else right(*_))(monkeypatch)
    refused((EngineError, f"{said}.*close some Data", lambda: sm.make_data(model)))
    answers.append(-1)  # full once, and not after what was dropped is collected
    after(model, 1)


@linux
@pytest.mark.slow
def test_memory_that_ends_is_said_before_it_does(tmp_path: Path) -> None:
    """The engine itself ends the process: std::bad_alloc, or a null pointer."""
    code = """
import resource
import statemachine as sm

model = sm.load("so101/scene", backend="pybullet")
kept = [sm.make_data(model)]
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (400 << 20),) * 2)
try:
    while True:
        kept.append(sm.make_data(model))
except sm.errors.EngineError as error:
    assert "no memory for another world" in str(error), error
assert len(kept) > 8, len(kept)
for data in kept:
    sm.step(model, data)
kept.pop().close()
"""
    runs_in_silence(code, tmp_path)


# Processes and threads.


@linux
@pytest.mark.slow
def test_a_killed_process_leaves_no_file(tmp_path: Path) -> None:
    code = """
import statemachine as sm
while True:
    model = sm.load("so101/scene_box", backend="pybullet")
    with sm.make_data(model) as data:
        sm.step(model, data, 3)
        sm.forward(model, data)
        data.qacc
        print("went", flush=True)
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    begin = partial(subprocess.Popen, [sys.executable, "-c", code], env=environment)
    for delay in (0.0, 0.013, 0.041):
        with begin(stdout=subprocess.PIPE) as child:
            try:
                assert child.stdout.readline() == b"went\n"
                time.sleep(delay)
                assert "/dev/shm" not in Path(f"/proc/{child.pid}/maps").read_text()
                rows = Path("/proc/sysvipc/shm").read_text().splitlines()[1:]
                assert str(child.pid) not in [row.split()[4] for row in rows]
            finally:
                child.kill()
        assert not list(tmp_path.iterdir())


@linux
def test_a_forked_child_has_a_copy(tmp_path: Path) -> None:
    code = """
import os, sys
import statemachine as sm

model = sm.load("so101/scene_box", backend="pybullet")

def start():
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    sm.step(model, data, 20)
    return data

def go_on(data):
    for k in range(60):
        data.ctrl[0] += 0.01
        sm.step(model, data)
        if k % 20 == 0:
            sm.forward(model, data)
            assert len(data.contacts) > 0
    return sm.get_state(model, data).blob

data, alone = start(), start()
read, write = os.pipe()
child = os.fork()
if not child:
    os.write(write, go_on(data))
    sys.exit(0)  # with all that Python does at its end
mine = go_on(data)
theirs = os.read(read, 100_000)
_, status = os.waitpid(child, 0)
assert status == 0, status
assert mine == theirs == go_on(alone)
assert go_on(data) == go_on(alone)
"""
    runs_in_silence(code, tmp_path)


# Writes.


def test_a_quaternion_of_any_length_is_its_rotation(box: sm.Model) -> None:
    ends = []
    for length in (1.0, 1.0001, 3.0):
        with opened(box, 0) as (model, data):
            data.qpos[9:13] *= length
            sm.forward(model, data)
            quat = data.qpos[9:13] / np.linalg.norm(data.qpos[9:13])
            assert np.abs(data.xquat[model.body_id("box")] - quat).max() < 1e-15
            sm.step(model, data, 20)
            assert abs(np.linalg.norm(data.qpos[9:13]) - 1) < 1e-12
            ends.append(data.qpos.copy())
    assert np.ptp(ends, axis=0).max() < 1e-6  # a last bit of the length, in contact for 20 steps


def test_a_write_that_is_undone_was_none(box: sm.Model) -> None:
    ends = []
    for write in (False, True):
        with opened(box, 0, nstep=40) as (model, data):
            if write:
                kept = data.qpos.copy()
                data.qpos[:] += 0.1
                data.qpos[:] = kept
            sm.step(model, data, 40)
            ends.append(sm.get_state(model, data))
    assert ends[0] == ends[1]
