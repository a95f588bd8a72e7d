"""Robots with hidden edits: does `compare` find them, with the shares of a raw recomputation?

A legged robot is drawn by a seed, and a copy of it in which some parameters are changed. What
`compare` and `compare --why` print of the two is held against plain MuJoCo: which parameters
changed, the Shapley share of each in the gap (every set of edits is compiled and run), and that no
verdict is good where the runs differ.
"""

from __future__ import annotations

import math
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from statemachine import releases

from ._against_raw import (
    PATIENCE,
    SAME,
    SECONDS,
    SHARE,
    TIMESTEP,
    asked,
    asked_why,
    raw_joints,
    raw_shares,
)
from ._tally import Tally, command, run_bounded

TRIES = 100
RELEASE = "mujoco==3.3.7"
_FIXED = "fixed"  # what the written file is called
_HEIGHT = 0.42  # m, of the base: the feet are above the floor, and fall onto it

Parameters = Mapping[str, float]

# What an edit changes, and by which name `--why` calls that. {} is the place of a leg.
_EDITS = {
    "mass.base": "mass of base",
    "mass.thigh{}": "mass of thigh{}",
    "mass.shank{}": "mass of shank{}",
    "damping.hip{}": "damping of hip{}",
    "damping.knee{}": "damping of knee{}",
    "armature.knee{}": "armature of knee{}",
    "kp.hip{}": "gains of hip{}",
    "kp.knee{}": "gains of knee{}",
}
_CONTACT_EDITS = {"friction.foot{}": "friction of foot{}"}
_CONTROLLER = '''
import math

def trot(model, data):
    """Return the command of each servo: opposite legs move together."""
    swing = math.sin({rate} * data.time)
    return [{offset} + {size} * swing * (-1) ** (i // 2) for i in range(model.nu)]
'''


def run(seed: int, tries: int) -> Tally:
    """Draw pairs of each kind in turn, and compare what is printed with plain MuJoCo."""
    draw, tally = random.Random(seed), Tally()
    for index in range(tries):
        kind = list(KINDS)[index % len(KINDS)]
        one = draw.randrange(2**32)
        tally.tried += 1
        with tempfile.TemporaryDirectory() as name:
            problems = KINDS[kind](random.Random(one), Path(name))
        tally.failures += [f"{kind}, seed {one}: {problem}" for problem in problems]
    return tally


# The robots.


def drawn_parameters(draw: random.Random, legs: int) -> dict[str, float]:
    """Return the parameters of a robot with this many legs, of two joints each."""
    parameters = {"mass.base": draw.uniform(3, 8)}
    for leg in range(legs):
        parameters |= {
            f"mass.thigh{leg}": draw.uniform(0.4, 1.0),
            f"mass.shank{leg}": draw.uniform(0.2, 0.5),
            f"damping.hip{leg}": draw.uniform(0.2, 0.6),
            f"damping.knee{leg}": draw.uniform(0.1, 0.4),
            f"armature.knee{leg}": draw.uniform(0.01, 0.03),
            f"kp.hip{leg}": draw.uniform(30, 60),
            f"kp.knee{leg}": draw.uniform(20, 40),
            f"friction.foot{leg}": draw.uniform(0.5, 1.0),
        }
    return parameters


def edited(
    draw: random.Random, parameters: Parameters, names: Mapping[str, str], count: int
) -> tuple[dict[str, float], dict[str, str]]:
    """Return changed parameters, and the cause that each edit is: parameter to its name."""
    legs = sum(name.startswith("mass.thigh") for name in parameters)
    causes: dict[str, str] = {}
    while len(causes) < count:
        parameter, cause = draw.choice(list(names.items()))
        leg = draw.randrange(legs)
        causes[parameter.format(leg)] = cause.format(leg)
    changed = dict(parameters)
    for name in causes:
        changed[name] = float(f"{parameters[name] * draw.choice([0.5, 0.7, 1.4, 2.0]):.6g}")
    return changed, causes


def mjcf_of(parameters: Parameters, floats: bool = True) -> str:
    """Return the robot as MJCF."""
    legs = sum(name.startswith("mass.thigh") for name in parameters)
    bodies, servos = [], []
    for leg in range(legs):
        x, y = 0.15 - 0.3 * (leg // 2), 0.1 - 0.2 * (leg % 2)
        bodies.append(
            f"""<body name="thigh{leg}" pos="{x:g} {y:g} 0">
            <joint name="hip{leg}" axis="0 1 0" damping="{parameters[f"damping.hip{leg}"]!r}"/>
            <inertial pos="0.04 0 -0.1" mass="{parameters[f"mass.thigh{leg}"]!r}"
              diaginertia="0.004 0.004 0.001"/>
            <body name="shank{leg}" pos="0 0 -0.2">
              <joint name="knee{leg}" axis="0 1 0"
                damping="{parameters[f"damping.knee{leg}"]!r}"
                armature="{parameters[f"armature.knee{leg}"]!r}"/>
              <inertial pos="0 0 -0.1" mass="{parameters[f"mass.shank{leg}"]!r}"
                diaginertia="0.002 0.002 0.0005"/>
              <geom name="foot{leg}" size="0.02" pos="0 0 -0.19"
                friction="{parameters[f"friction.foot{leg}"]!r} 0.005 0.0001"/>
            </body></body>"""
        )
        servos += [
            f'<position name="{joint}{leg}" joint="{joint}{leg}" kv="1"\n'
            f'  kp="{parameters[f"kp.{joint}{leg}"]!r}"/>'
            for joint in ("hip", "knee")
        ]
    free = "<freejoint/>" if floats else ""
    return f"""<mujoco>
    <compiler angle="radian"/><option timestep="{TIMESTEP}" integrator="implicitfast"/>
    <worldbody><geom name="floor" type="plane" size="5 5 1" friction="0.1 0.005 0.0001"/>
    <body name="base" pos="0 0 {_HEIGHT}">{free}
      <inertial pos="0 0 0" mass="{parameters["mass.base"]!r}" diaginertia="0.05 0.08 0.1"/>
      {"".join(bodies)}</body></worldbody>
    <actuator>{"".join(servos)}</actuator></mujoco>"""


def urdf_of(parameters: Parameters) -> str:
    """Return the robot as URDF, which knows no armature, no servos and no friction of shapes."""
    legs = sum(name.startswith("mass.thigh") for name in parameters)
    parts = [_link("base", parameters["mass.base"], "0.05 0.08 0.1", "0 0 0", "")]
    for leg in range(legs):
        x, y = 0.15 - 0.3 * (leg // 2), 0.1 - 0.2 * (leg % 2)
        foot = (
            '<collision><origin xyz="0 0 -0.19"/><geometry><sphere radius="0.02"/></geometry>'
            "</collision>"
        )
        thigh, shank = parameters[f"mass.thigh{leg}"], parameters[f"mass.shank{leg}"]
        parts += [
            _link(f"thigh{leg}", thigh, "0.004 0.004 0.001", "0.04 0 -0.1", ""),
            _link(f"shank{leg}", shank, "0.002 0.002 0.0005", "0 0 -0.1", foot),
            _joint(f"hip{leg}", "base", f"thigh{leg}", f"{x:g} {y:g} 0", parameters),
            _joint(f"knee{leg}", f"thigh{leg}", f"shank{leg}", "0 0 -0.2", parameters),
        ]
    return f'<robot name="legged">{"".join(parts)}</robot>'


def _link(name: str, mass: float, inertia: str, centre: str, shape: str) -> str:
    ixx, iyy, izz = inertia.split()
    return (
        f'<link name="{name}">\n<inertial><origin xyz="{centre}"/>\n<mass value="{mass!r}"/>\n'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
        f"{shape}</link>\n"
    )


def _joint(name: str, parent: str, child: str, place: str, parameters: Parameters) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}"/><axis xyz="0 1 0"/>\n'
        f'<dynamics damping="{parameters[f"damping.{name}"]!r}"/>\n'
        '<limit lower="-3" upper="3" effort="100" velocity="100"/></joint>\n'
    )


def _wrong_causes(
    answer: Mapping[str, Any], causes: Mapping[str, str], shares: Mapping[str, float]
) -> list[str]:
    """Return which causes are missing, too many, or have another share than the raw one."""
    rows = answer.get("shares", [])
    assert isinstance(rows, list)
    told = {row["name"]: row for row in rows}
    wrong = [f"no cause {cause!r}" for cause in causes.values() if cause not in told]
    wrong += [f"{name!r} is no edit" for name in told if name not in causes.values()]
    for parameter, cause in causes.items():
        share = told.get(cause, {}).get("share")
        if cause in told and (share is None or abs(share - shares[parameter]) > SHARE):
            wrong.append(f"{cause!r} has the share {share}, raw {shares[parameter]:.4f}")
    return wrong


def _wrong_answer(
    found: tuple[int | None, dict[str, Any], str],
    causes: Mapping[str, str],
    raw: tuple[float, Mapping[str, float]],
) -> list[str]:
    code, answer, error = found
    if code != 0:
        return [f"exit code {code}: {error.strip()[-300:]}"]
    gap, shares = raw
    told = answer["gap"]
    assert isinstance(told, float)
    if not math.isclose(told, gap, rel_tol=SAME, abs_tol=1e-9):
        return [f"the gap is told as {told}, raw {gap}"]
    return _wrong_causes(answer, causes, shares)


# The kinds of pairs.


def _contact(draw: random.Random, folder: Path) -> list[str]:
    """Draw legs that fall on the floor with their actuators off."""
    left = drawn_parameters(draw, 4)
    right, causes = edited(draw, left, {**_EDITS_WITHOUT_SERVOS, **_CONTACT_EDITS}, 3)
    _write(folder, mjcf_of(left), mjcf_of(right))
    found = _why(folder, "gravity", "left.xml", "right.xml")
    raw = raw_shares(left, right, lambda parameters: raw_joints(mjcf_of(parameters), None))
    problems = _wrong_answer(found, causes, raw)
    return problems + _wrong_file(folder, lambda text: raw_joints(text, None))


def _function(draw: random.Random, folder: Path) -> list[str]:
    """Draw legs that a function commands."""
    left = drawn_parameters(draw, draw.choice([2, 4]))
    right, causes = edited(draw, left, _EDITS, 3)
    _write(folder, mjcf_of(left), mjcf_of(right))
    swing = {"rate": draw.uniform(5, 15), "size": draw.uniform(0.1, 0.4)}
    swing["offset"] = draw.uniform(-0.2, 0.2)
    (folder / "walk.py").write_text(_CONTROLLER.format(**swing), encoding="utf-8")
    found = _why(folder, "walk.py:trot", "left.xml", "right.xml")

    def command_of(seconds: float, index: int) -> float:
        sign = (-1) ** (index // 2)
        return swing["offset"] + swing["size"] * math.sin(swing["rate"] * seconds) * sign

    raw = raw_shares(left, right, lambda parameters: raw_joints(mjcf_of(parameters), command_of))
    return _wrong_answer(found, causes, raw) + _wrong_file(
        folder, lambda text: raw_joints(text, command_of)
    )


def _releases(draw: random.Random, folder: Path) -> list[str]:
    """Draw one robot in two releases, with edits: each release's own motion gives the gap."""
    left = drawn_parameters(draw, 2)
    right, causes = edited(draw, left, _FIXED_EDITS, 2)
    _write(folder, mjcf_of(left, floats=False), mjcf_of(right, floats=False))
    code, answer, error = _why(folder, "gravity", f"left.xml@{RELEASE}", "right.xml")
    older = _raw_in_release(folder, "left.xml")
    gaps = {}
    for name, parameters in (("right", right), ("left", left)):
        joints = raw_joints(mjcf_of(parameters, floats=False), None)
        gaps[name] = float(np.abs(joints - older).max())
    if gaps["left"] > 0.01 * gaps["right"]:
        return [f"the releases themselves differ by {gaps['left']:.3g}"]
    _, shares = raw_shares(
        left, right, lambda parameters: raw_joints(mjcf_of(parameters, floats=False), None)
    )
    return _wrong_answer((code, answer, error), causes, (gaps["right"], shares))


def _base(draw: random.Random, folder: Path) -> list[str]:
    """Draw a URDF whose base is free on the left: told so, and not told of the right."""
    left = drawn_parameters(draw, 4)
    names = {name: cause for name, cause in _FIXED_EDITS.items() if "armature" not in name}
    right, causes = edited(draw, left, names, 2)
    _write(folder, urdf_of(left), urdf_of(right), ".urdf")
    sides = ("left.urdf", "base=free", "right.urdf")
    code, _, error = asked(
        folder, "compare", "gravity", *sides, "base=fixed", "--seconds", str(SECONDS)
    )
    problems = []
    if code != 1:
        problems.append(f"free against fixed: exit code {code}: {error.strip()[-300:]}")
    # Nothing holds the robot that floats, so its joints stay where they are on both sides.
    code, answer, error = asked_why(folder, "gravity", *sides)
    if code != 0 or answer["gap"] > SAME:
        problems.append(f"free against open: exit code {code}: {error.strip()[-300:]}")
    # One that is fixed hangs and swings, and the side that does not say so is fixed, too.
    found = _why(folder, "gravity", "left.urdf", "base=fixed", "right.urdf")
    raw = raw_shares(left, right, lambda parameters: raw_joints(urdf_of(parameters), None))
    problems += _wrong_answer(found, causes, raw)
    return problems + _wrong_file(folder, lambda text: raw_joints(text, None), ".urdf")


def floating(urdf: str) -> str:
    """Return the robot of a URDF with a base that floats, as MuJoCo itself would save it."""
    import mujoco

    spec = mujoco.MjSpec.from_string(urdf)
    spec.compiler.fusestatic = False
    for body in spec.worldbody.bodies:
        body.add_freejoint()
    spec.compile()
    return spec.to_xml()


def _pybullet(draw: random.Random, folder: Path) -> list[str]:
    """Draw a URDF as PyBullet's users load it, against MuJoCo: no good verdict if they differ."""
    left = drawn_parameters(draw, draw.choice([2, 4]))
    (folder / "left.urdf").write_text(urdf_of(left), encoding="utf-8")
    sides = ("left.urdf", f"timestep={1 / 240!r}", "left.urdf@pybullet:engine")
    words = ("gravity", *sides, "--seconds", str(SECONDS))
    problems = []
    for more in ((), ("--why",)):
        code, _, error = run_bounded(command("compare", *words, *more), folder, PATIENCE)
        if code not in (0, 1) or "Traceback" in error:
            problems.append(f"{' '.join(more)} exit code {code}: {error.strip()[-300:]}")
    code, answer, _ = asked(folder, "compare", *words)
    gap = _gap_to_raw_bullet(folder, left)
    agrees = answer["comparison"]["agrees"]
    if agrees and gap > math.radians(0.1):
        problems.append(f"a good verdict where joints are {gap:.3g} rad apart")
    if agrees is (code == 1):
        problems.append(f"exit code {code} where agrees is {agrees}")
    return problems


_EDITS_WITHOUT_SERVOS = {name: cause for name, cause in _EDITS.items() if name[:2] != "kp"}
_FIXED_EDITS = {name: cause for name, cause in _EDITS_WITHOUT_SERVOS.items() if name != "mass.base"}
KINDS: dict[str, Callable[[random.Random, Path], list[str]]] = {
    "in contact": _contact,
    "a function": _function,
    "two releases": _releases,
    "a free base": _base,
    "PyBullet's own": _pybullet,
}


def _write(folder: Path, left: str, right: str, ending: str = ".xml") -> None:
    (folder / f"left{ending}").write_text(left, encoding="utf-8")
    (folder / f"right{ending}").write_text(right, encoding="utf-8")


def _wrong_file(
    folder: Path, joints_of: Callable[[str], np.ndarray], ending: str = ".xml"
) -> list[str]:
    """Return whether the file that was written moves otherwise than the left one."""
    target = folder / f"{_FIXED}{ending}"
    if not target.exists():
        return ["no file was written"]
    left = (folder / f"left{ending}").read_text("utf-8")
    gap = float(np.abs(joints_of(target.read_text("utf-8")) - joints_of(left)).max())
    return [f"the written file is {gap:.3g} rad from the left one"] if gap > SAME else []


def _why(folder: Path, what: str, *sides: str) -> tuple[int | None, dict[str, Any], str]:
    """Ask what explains the gap, and for the right's file with the left's values."""
    return asked_why(folder, what, *sides, "--write", f"{_FIXED}{Path(sides[-1]).suffix}")


_IN_RELEASE = """
import mujoco, numpy, sys
model = mujoco.MjModel.from_xml_path(sys.argv[1])
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
data, rows = mujoco.MjData(model), []
for _ in range(int(sys.argv[2]) + 1):
    rows.append(data.qpos.copy())
    mujoco.mj_step(model, data)
numpy.save(sys.argv[3], rows)
"""


_IN_BULLET = """
import numpy, pybullet, sys
pybullet.connect(pybullet.DIRECT)
pybullet.setGravity(0, 0, -9.81)
robot = pybullet.loadURDF(sys.argv[1])
joints = list(range(pybullet.getNumJoints(robot)))
for joint in joints:  # its motors, which hold each joint where nobody commands them
    pybullet.setJointMotorControl2(robot, joint, pybullet.VELOCITY_CONTROL, force=0)
rows = []
for _ in range(int(sys.argv[2]) + 1):
    rows.append([state[0] for state in pybullet.getJointStates(robot, joints)])
    pybullet.stepSimulation()
numpy.save(sys.argv[3], rows)
"""


def _gap_to_raw_bullet(folder: Path, parameters: Parameters) -> float:
    """Return how far apart joints of plain MuJoCo and plain PyBullet get [rad], by name."""
    rows = folder / "rows.npy"
    steps = round(SECONDS * 240)
    words = [sys.executable, "-c", _IN_BULLET, str(folder / "left.urdf"), str(steps), str(rows)]
    subprocess.run(words, check=True, capture_output=True)
    ours = raw_joints(floating(urdf_of(parameters)), None, 1 / 240)
    return float(np.abs(np.load(rows) - ours[: steps + 1]).max())


def _raw_in_release(folder: Path, file: str) -> np.ndarray:
    """Return the hinges of a robot without a free joint, by the release's own Python."""
    python = sys.executable
    if releases.is_here(RELEASE):
        python = str(releases.python_of(RELEASE))
    rows = folder / "rows.npy"
    words = [python, "-c", _IN_RELEASE, str(folder / file)]
    subprocess.run([*words, str(round(SECONDS / TIMESTEP)), str(rows)], check=True)
    return np.load(rows)
