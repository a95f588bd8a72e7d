"""What is refused of a model's files before an engine opens them, and what else is no file."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.course.grading import answers_in
from statemachine.errors import BadInputError, EngineWarning, ModelError, ModelFileError, TraceError
from statemachine.kinematics import Kinematics
from statemachine.lab.recordings import read
from statemachine.lab.robots.table import read_table
from statemachine.lab.runs import controllers
from statemachine.lab.sweep import read_manifest
from statemachine.model_files import check_model_file, checked_path

from .support.claims import refused
from .support.files import written
from .support.processes import Cli, of_python
from .support.requirements import ROOT

pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")

ARM = """
<mujoco>
  <worldbody>
    <body name="link" pos="0 0 1">
      <joint name="hinge" axis="0 1 0" range="-1 1" damping="0.1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom name="ball" size="0.1" friction="1 0.1 0.1"/>
      <site name="tip" pos="0 0 0.1"/>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="hinge" kp="10" ctrlrange="-1 1"/></actuator>
  <keyframe><key name="start" time="0" qpos="0" ctrl="0"/></keyframe>
</mujoco>
"""
URDF = """
<robot name="arm">
  <link name="base"/>
  <link name="link">
    <inertial>
      <mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="link"/><origin xyz="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics damping="0.1"/>
  </joint>
</robot>
"""


# Numbers that are not finite.


@pytest.mark.parametrize("word", ["nan", "NaN", "inf", "-inf", "1e400"])
@pytest.mark.parametrize(
    ("text", "before", "says"),
    [
        (ARM, 'mass="1"', "mass of <inertial> has"),
        (ARM, 'pos="0 0 1"', "pos of <body name='link'> has"),
        (ARM, 'damping="0.1"', "damping of <joint name='hinge'> has"),
        (ARM, 'diaginertia="1 1 1"', "diaginertia of <inertial> has"),
        (ARM, 'friction="1 0.1 0.1"', "friction of <geom name='ball'> has"),
        (ARM, 'pos="0 0 0.1"', "pos of <site name='tip'> has"),
        (ARM, 'kp="10"', "kp of <position name='servo'> has"),
        (ARM, 'time="0"', "time of <key name='start'> has"),
        (ARM, 'qpos="0"', "qpos of <key name='start'> has"),
        (URDF, 'value="1"', "value of <mass> has"),
        (URDF, 'ixx="1"', "ixx of <inertia> has"),
        (URDF, 'radius="0.1"', "radius of <sphere> has"),
        (URDF, 'xyz="0 0 0"', "xyz of <origin> has"),
        (URDF, 'damping="0.1"', "damping of <dynamics> has"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_by_element_and_attribute(
    text: str, before: str, says: str, word: str, tmp_path: Path
) -> None:
    assert before in text
    first, rest = before.split('"')[1].partition(" ")[::2]
    changed = before.replace(f'"{first}', f'"{word}', 1)
    assert rest in changed
    suffix = "urdf" if text is URDF else "xml"
    file = written(tmp_path / f"arm.{suffix}", text.replace(before, changed))
    says = rf"{re.escape(says)} '{re.escape(word)}', which is not a finite number"
    refused(
        (ModelError, says, lambda: sm.load(file)),
        (ModelError, says, lambda: checked_path(file)),
    )


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_every_engine_and_the_witness_refuse_it_alike(backend: str, tmp_path: Path) -> None:
    pytest.importorskip(backend)
    part = written(tmp_path / "part.xml", ARM.replace('pos="0 0 0.1"', 'pos="nan 0 0.1"'))
    assert part
    file = written(tmp_path / "arm.xml", '<mujoco><include file="part.xml"/></mujoco>')
    says = r"part\.xml: pos of <site name='tip'> has 'nan'"
    refused(
        (ModelError, says, lambda: sm.load(file, backend=backend)),
        (ModelError, says, lambda: sm.load(file, backend=backend, defaults="engine")),
    )
    pytest.importorskip("pinocchio")
    refused((ModelError, says, lambda: Kinematics(file)))


def test_names_texts_and_ranges_without_an_end_stay(tmp_path: Path) -> None:
    text = ARM.replace("hinge", "inf").replace("tip", "nan").replace("start", "1e400")
    text = text.replace('ctrlrange="-1 1"', 'ctrlrange="-1 inf"')
    text = text.replace("<worldbody>", '<custom><numeric name="n" data="nan"/></custom><worldbody>')
    with pytest.warns(EngineWarning, match="NaN"):  # its own, of any text that has these letters
        model = sm.load(written(tmp_path / "arm.xml", text))
    assert (model.joint_names, model.site_names) == (("inf",), ("nan",))


@pytest.mark.parametrize("time", ["-1e300", "1e300", "1e17"])
def test_a_keyframe_whose_time_no_timestep_advances_is_refused(time: str, tmp_path: Path) -> None:
    file = written(tmp_path / "arm.xml", ARM.replace('time="0"', f'time="{time}"'))
    refused((ModelError, "time of key start", lambda: sm.load(file)))


# More memory than there is.


@pytest.mark.parametrize(
    ("element", "says"),
    [
        ('<size memory="100T"/>', "memory of <size> asks for"),
        ('<size nkey="2000000000"/>', "nkey of <size> asks for"),
        ('<size nuser_body="2000000000"/>', "nuser_body of <size> asks for"),
        (
            '<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>',
            "nrow times ncol of <hfield> asks for",
        ),
        (
            '<asset><texture name="t" type="2d" builtin="flat" width="60000" height="60000"/>'
            "</asset>",
            "width times height of <texture> asks for",
        ),
        (
            '<worldbody><replicate count="900000000" offset="1 0 0"><geom size="1"/></replicate>'
            "</worldbody>",
            "count of <replicate> asks for",
        ),
    ],
)
def test_a_file_that_needs_more_memory_than_there_is_says_so(
    element: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("statemachine.model_files.free_memory", lambda: 4e9)
    file = written(tmp_path / "large.xml", f"<mujoco>{element}</mujoco>")
    refused((ModelError, rf"{says} .* GB", lambda: sm.load(file)))


@pytest.mark.skipif(sys.platform != "linux", reason="limits its own memory")
@pytest.mark.parametrize(
    "element",
    [
        '<asset><hfield name="h" nrow="20000" ncol="20000" size="1 1 1 1"/></asset>'
        '<worldbody><geom type="hfield" hfield="h"/></worldbody>',
        '<asset><texture name="t" type="2d" builtin="flat" width="20000" height="20000"/></asset>',
    ],
)
def test_what_the_engine_gives_up_for_memory_is_a_model_error(element: str, tmp_path: Path) -> None:
    """What was not foreseen: with so little memory that the engine fails in its own code."""
    file = written(tmp_path / "large.xml", f"<mujoco>{element}</mujoco>")
    code = (
        "import resource, sys\n"
        "import mujoco\n"
        "import statemachine as sm\n"
        "from statemachine import model_files\n"
        "from statemachine.errors import ModelError\n"
        "sm.load('so101')\n"
        "model_files.free_memory = lambda: None\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + 300_000_000,) * 2)\n"
        "try:\n"
        "    sm.load(sys.argv[1])\n"
        "except ModelError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, file], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert "memory" in done.stdout, done.stdout + done.stderr


# What is there and is no file.

PIPED = {
    "an include": '<mujoco><include file="pipe.xml"/></mujoco>',
    "a mesh": '<mujoco><asset><mesh name="m" file="pipe.xml"/></asset></mujoco>',
    "a mesh in a folder": (
        '<mujoco><compiler meshdir="below"/><asset><mesh name="m" file="pipe.stl"/></asset>'
        "</mujoco>"
    ),
    "a texture": (
        '<mujoco><asset><texture name="t" type="cube" fileright="pipe.xml"/></asset></mujoco>'
    ),
    "a height field": '<mujoco><asset><hfield name="h" file="pipe.xml"/></asset></mujoco>',
    "another model": '<mujoco><asset><model name="m" file="pipe.xml"/></asset></mujoco>',
}


@pipes
@pytest.mark.parametrize("what", PIPED)
def test_a_named_pipe_in_a_model_is_refused_and_not_waited_for(what: str, tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    os.mkfifo(tmp_path / "pipe.xml")
    os.mkfifo(tmp_path / "below" / "pipe.stl")
    file = written(tmp_path / "arm.xml", PIPED[what])
    refused((ModelError, "named pipe", lambda: sm.load(file)))


@pipes
def test_a_pipe_a_socket_a_folder_and_a_device_are_told_by_their_names(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    (tmp_path / "folder.stl").mkdir()
    with socket.socket(socket.AF_UNIX) as server:
        before = Path.cwd()
        os.chdir(tmp_path)  # the path of a socket is short
        try:
            server.bind("socket.stl")
        finally:
            os.chdir(before)
        text = '<mujoco><asset><mesh name="m" file="{}"/></asset></mujoco>'
        for name, kind in (
            ("pipe.stl", "a named pipe"),
            ("folder.stl", "a folder"),
            ("socket.stl", "a socket"),
            ("/dev/null", "a device"),
        ):
            file = written(tmp_path / "arm.xml", text.format(name))
            refused((ModelError, f"is {kind}, not a file", partial(check_model_file, Path(file))))


@pipes
def test_a_mesh_of_a_urdf_in_a_package_is_looked_at(tmp_path: Path) -> None:
    (tmp_path / "arm").mkdir()
    os.mkfifo(tmp_path / "arm" / "pipe.stl")
    mesh = '<mesh filename="package://arm/pipe.stl"/>'
    text = URDF.replace('<sphere radius="0.1"/>', mesh)
    file = written(tmp_path / "arm" / "arm.urdf", text)
    refused((ModelError, "named pipe", lambda: sm.load(file)))


@pipes
def test_what_else_is_read_is_no_pipe_either(tmp_path: Path) -> None:
    for name in ("p.xml", "p.npz", "p.json", "p.py", "sweep.json"):
        os.mkfifo(tmp_path / name)
    reads: list[tuple[type[Exception], str, Callable[[], Any]]] = [
        (ModelFileError, "is a named pipe", lambda: sm.load(tmp_path / "p.xml")),
        (TraceError, "is a named pipe", lambda: read(tmp_path / "p.npz")),
        (BadInputError, "is a named pipe", lambda: read_table(tmp_path / "p.json")),
        (BadInputError, "is a named pipe", lambda: answers_in(tmp_path / "p.json")),
        (BadInputError, "is a named pipe", lambda: read_manifest(tmp_path)),
        (
            BadInputError,
            "is a named pipe",
            lambda: controllers.function_scenario(f"{tmp_path / 'p.py'}:f").controller(
                sm.load("so101"), 0
            ),
        ),
    ]
    refused(*reads)


@pipes
def test_a_submission_that_is_a_pipe_is_refused(tmp_path: Path, cli: Cli) -> None:
    os.mkfifo(tmp_path / "mine.py")
    done = cli("check", str(tmp_path / "mine.py"))
    assert done.returncode == 2
    assert "mine.py is a named pipe" in done.stderr


# Ctrl-C while an interpreter starts.


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no process groups of this kind")
@pytest.mark.parametrize("delay", [0.25, 0.35, 0.5, 0.7, 1.0, 1.5, 2.0])
@pytest.mark.parametrize(
    "words",
    [("lesson", "gravity", "--json"), ("robots", str(ROOT / "models" / "so101"), "--quick")],
)
def test_ctrl_c_at_any_time_prints_no_traceback_of_ours(
    words: tuple[str, ...], delay: float, tmp_path: Path
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    )
    time.sleep(delay)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=120)
    # A Python that has not come to our code yet answers as it does.
    starting = "statemachine" not in said and ("<frozen" in said or "runpy" in said)
    assert starting or "Traceback" not in said, said
    assert starting or process.returncode in (0, 130, -signal.SIGINT)


_THREAD_TAKES_IT = """
import os, signal, threading, time
from statemachine.processes.signals import sigint_blocked

threading.Thread(target=time.sleep, args=(30,), daemon=True).start()
try:
    with sigint_blocked():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)
        print("held")
    print("lost")
except KeyboardInterrupt:
    print("raised")
"""


@pytest.mark.skipif(os.name == "nt", reason="no masks of signals")
def test_a_ctrl_c_is_held_back_though_another_thread_takes_it() -> None:
    assert of_python("-c", _THREAD_TAKES_IT, code=0).stdout.split() == ["held", "raised"]
