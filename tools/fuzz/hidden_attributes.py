"""Robots of any shape, some attributes of which are changed: does `compare --why` find each?

A tree of links is drawn, with springs, limits, friction, tendons, couplings, motors of several
kinds and contact, and a copy of it in which some attributes have other values. What `compare --why`
says is held against plain MuJoCo: which line and attribute of the file, the Shapley share of each
(every set of edits is compiled and run), and the file of `--write`.
"""

from __future__ import annotations

import math
import random
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ._against_raw import SAME, SHARE, TIMESTEP, asked_why, raw_joints, raw_shares
from ._tally import Tally

TRIES = 100
_EDITS = 3
_NOTHING = 1e-12  # of the gap: it has no effect

Edit = Callable[[random.Random, str], str]  # what it makes of the text of an attribute
_CONTROLLER = '''
import math

def swing(model, data):
    """Return the command of each actuator."""
    return [{size} * math.sin({rate} * data.time + i) for i in range(model.nu)]
'''


@dataclass
class Element:
    """An element of a file, on a line of its own.

    Attributes:
        head: What stands before its attributes, such as "<joint".
        attributes: Its attributes, each a text.
        end: What closes it.
    """

    head: str
    attributes: dict[str, str]
    end: str = "/>"

    @property
    def line(self) -> str:
        """The element as a line of the file."""
        words = [f'{name}="{value}"' for name, value in self.attributes.items()]
        return " ".join([self.head, *words]) + self.end


@dataclass
class Robot:
    """A robot as the lines of its file.

    Attributes:
        lines: Elements, and what closes them.
        editable: What may be changed: the index of the line, the attribute, and what changes it.
    """

    lines: list[Element | str] = field(default_factory=list)
    editable: list[tuple[int, str, Edit]] = field(default_factory=list)

    def add(
        self,
        head: str,
        attributes: Mapping[str, str],
        end: str = "/>",
        **edits: Edit,
    ) -> None:
        """Add an element, of which some attributes may be changed."""
        self.editable += [(len(self.lines), name, edit) for name, edit in edits.items()]
        self.lines.append(Element(head, dict(attributes), end))

    def text(self, values: Mapping[str, str]) -> str:
        """Return the file with other values of some attributes, "line attribute=value"."""
        rows: list[str] = []
        for number, line in enumerate(self.lines):
            if isinstance(line, str):
                rows.append(line)
                continue
            changed = dict(line.attributes)
            for name in changed:
                key = f"{number + 1} {name}"
                if key in values:
                    changed[name] = values[key]
            rows.append(Element(line.head, changed, line.end).line)
        return "\n".join(rows) + "\n"


# What an edit makes of the text of an attribute.


def scaled(draw: random.Random, text: str) -> str:
    """Return all numbers times one factor."""
    factor = draw.choice([0.5, 0.7, 1.4, 2.0])
    return " ".join(f"{float(word) * factor:.6g}" for word in text.split())


def first_scaled(draw: random.Random, text: str) -> str:
    """Return the first number times a factor, the others as they are."""
    first, *rest = text.split()
    return " ".join([f"{float(first) * draw.choice([0.3, 0.6, 1.7]):.6g}", *rest])


def shifted(draw: random.Random, text: str) -> str:
    """Return a place some centimetres off."""
    return " ".join(f"{float(word) + draw.uniform(-0.03, 0.03):.6g}" for word in text.split())


def turned(draw: random.Random, text: str) -> str:
    """Return an axis, or a quaternion, that is turned a little."""
    return " ".join(f"{float(word) + draw.uniform(-0.15, 0.15):.6g}" for word in text.split())


def _place(draw: random.Random, size: float = 0.1) -> str:
    return " ".join(f"{draw.uniform(-size, size):.5g}" for _ in range(3))


def drawn_robot(draw: random.Random) -> Robot:
    """Return a robot of two to six joints."""
    robot = Robot()
    robot.lines += ["<mujoco>", '<compiler angle="radian"/>']
    option = {
        "timestep": f"{TIMESTEP}",
        "integrator": draw.choice(["Euler", "implicit", "implicitfast", "RK4"]),
        "gravity": "0 0 -9.81",
        "density": draw.choice(["0", "200"]),
        "viscosity": draw.choice(["0", "0.5"]),
        "impratio": draw.choice(["1", "5"]),
        "cone": draw.choice(["pyramidal", "elliptic"]),
    }
    robot.add("<option", option, gravity=scaled)
    robot.lines += ["<worldbody>"]
    robot.add(
        '<geom name="ground" type="plane"',
        {"size": "5 5 1", "friction": "0.4 0.005 0.0001", "solref": "0.02 1"},
    )
    joints = draw.randint(2, 6)
    floats = draw.random() < 0.3
    robot.lines.append(f'<body name="base" pos="0 0 {0.35 if floats else 0.5}">')
    if floats:
        robot.lines.append('<freejoint name="root"/>')
    robot.add(
        "<inertial", {"pos": "0 0 0", "mass": "3", "diaginertia": "0.03 0.04 0.05"}, mass=scaled
    )
    open_bodies = 0
    for number in range(joints):
        _add_link(robot, draw, number)
        open_bodies += 1
        while open_bodies > 1 and draw.random() < 0.3:
            robot.lines.append("</body>")
            open_bodies -= 1
    robot.lines += ["</body>"] * (open_bodies + 1)
    robot.lines.append("</worldbody>")
    _add_couplings(robot, draw, joints)
    robot.lines.append("<actuator>")
    for number in range(joints):
        _add_actuator(robot, draw, number)
    robot.lines += ["</actuator>", "</mujoco>"]
    return robot


def _add_link(robot: Robot, draw: random.Random, number: int) -> None:
    robot.add(
        f'<body name="link{number}"',
        {
            "pos": f"{draw.uniform(0.02, 0.1):.5g} {draw.uniform(-0.05, 0.05):.5g} -0.05",
            "quat": f"1 {draw.uniform(-0.3, 0.3):.5g} {draw.uniform(-0.3, 0.3):.5g} 0",
            "gravcomp": draw.choice(["0", "0.5"]),
        },
        ">",
        pos=shifted, quat=turned,
        gravcomp=lambda draw, text: f"{float(text) + draw.uniform(0.1, 0.4):.5g}",
    )  # fmt: skip
    axis = [0.05, 0.05, 0.05]
    axis[draw.randrange(3)] = 1.0
    robot.add(
        f'<joint name="hinge{number}"',
        {
            "axis": " ".join(f"{part:g}" for part in axis),
            "pos": _place(draw, 0.02),
            "damping": f"{draw.uniform(0.05, 0.4):.5g}",
            "armature": f"{draw.uniform(0.005, 0.03):.5g}",
            "stiffness": f"{draw.uniform(0.5, 5):.5g}",
            "springref": f"{draw.uniform(-0.4, 0.4):.5g}",
            "frictionloss": f"{draw.uniform(0.01, 0.1):.5g}",
            "limited": "true",
            "range": f"{draw.uniform(-0.5, -0.1):.5g} {draw.uniform(0.1, 0.5):.5g}",
            "ref": f"{draw.uniform(-0.05, 0.05):.5g}",
        },
        axis=turned, pos=shifted, damping=scaled, armature=scaled, stiffness=scaled,
        springref=shifted, frictionloss=scaled, range=scaled,
    )  # fmt: skip
    robot.add(
        "<inertial",
        {
            "pos": _place(draw, 0.05),
            "mass": f"{draw.uniform(0.2, 1):.5g}",
            "diaginertia": "0.003 0.0035 0.004",
        },
        pos=shifted, mass=scaled, diaginertia=scaled,
    )  # fmt: skip
    kind = draw.choice(["sphere", "capsule", "box"])
    size = {"sphere": "0.03", "capsule": "0.02 0.03", "box": "0.02 0.03 0.02"}[kind]
    robot.add(
        f'<geom name="shape{number}" type="{kind}"',
        {
            "size": size,
            "pos": f"{draw.uniform(-0.02, 0.02):.5g} 0 -0.07",
            "friction": f"{draw.uniform(0.3, 1):.5g} 0.005 0.0001",
            "solref": "0.02 1",
            "margin": "0",
            "contype": "1",
            "conaffinity": "0",
        },
        size=scaled, pos=shifted, friction=first_scaled, solref=first_scaled,
    )  # fmt: skip


def _add_couplings(robot: Robot, draw: random.Random, joints: int) -> None:
    first, second = draw.sample(range(joints), 2)
    if draw.random() < 0.5:
        robot.lines.append("<equality>")
        robot.add(
            f'<joint name="coupling" joint1="hinge{first}" joint2="hinge{second}"',
            {"polycoef": f"0 {draw.uniform(0.4, 1.2):.5g} 0 0 0", "solref": "0.02 1"},
            polycoef=scaled, solref=first_scaled,
        )  # fmt: skip
        robot.lines.append("</equality>")
    if draw.random() < 0.5:
        robot.lines.append("<tendon>")
        robot.add(
            '<fixed name="cord"',
            {
                "stiffness": f"{draw.uniform(1, 5):.5g}",
                "damping": f"{draw.uniform(0.05, 0.3):.5g}",
                "springlength": f"{draw.uniform(0.1, 0.3):.5g}",
            },
            ">",
            stiffness=scaled, damping=scaled, springlength=scaled,
        )  # fmt: skip
        robot.add(f'<joint joint="hinge{first}"', {"coef": "1"}, coef=scaled)
        robot.add(f'<joint joint="hinge{second}"', {"coef": "-0.7"}, coef=scaled)
        robot.lines += ["</fixed>", "</tendon>"]


def _add_actuator(robot: Robot, draw: random.Random, number: int) -> None:
    kind = draw.choice(["position", "motor", "velocity", "general"])
    head = f'<{kind} name="drive{number}" joint="hinge{number}"'
    common = {
        "gear": f"{draw.choice([1, 1, 2])}",
        "ctrllimited": "true",
        "ctrlrange": f"-{draw.uniform(0.1, 0.5):.5g} {draw.uniform(0.1, 0.5):.5g}",
        "forcelimited": "true",
        "forcerange": f"-{draw.uniform(1, 4):.5g} {draw.uniform(1, 4):.5g}",
    }
    edits: dict[str, Edit] = {"gear": scaled, "ctrlrange": scaled, "forcerange": scaled}
    match kind:
        case "position":
            gains = {"kp": f"{draw.uniform(10, 30):.5g}", "kv": f"{draw.uniform(0.3, 1):.5g}"}
            edits |= {"kp": scaled, "kv": scaled}
        case "velocity":
            gains = {"kv": f"{draw.uniform(0.3, 1):.5g}"}
            edits |= {"kv": scaled}
        case "general":
            gains = {
                "biastype": "affine",
                "dyntype": "filter",
                "dynprm": f"{draw.uniform(0.02, 0.1):.5g}",
                "gainprm": f"{draw.uniform(10, 20):.5g}",
                "biasprm": f"0 -{draw.uniform(10, 20):.5g} -{draw.uniform(0.3, 0.6):.5g}",
            }
            edits |= {"dynprm": scaled, "gainprm": scaled, "biasprm": scaled}
        case _:
            gains = {}
    robot.add(head, common | gains, "/>", **edits)


# Held against plain MuJoCo.


def run(seed: int, tries: int) -> Tally:
    """Draw pairs, and compare what is printed with plain MuJoCo."""
    draw, tally = random.Random(seed), Tally()
    for _ in range(tries):
        one = draw.randrange(2**32)
        tally.tried += 1
        with tempfile.TemporaryDirectory() as name:
            problems = examined(random.Random(one), Path(name))
        tally.failures += [f"seed {one}: {problem}" for problem in problems]
    return tally


def examined(draw: random.Random, folder: Path) -> list[str]:
    """Draw a pair, and return what is wrong of what is said of it."""
    robot = drawn_robot(draw)
    edits: dict[str, str] = {}
    lines = set[int]()
    while len(edits) < _EDITS:
        number, name, edit = draw.choice(robot.editable)
        element = robot.lines[number]
        assert isinstance(element, Element)
        value = edit(draw, element.attributes[name])
        if number not in lines and value != element.attributes[name]:
            edits[f"{number + 1} {name}"] = value
            lines.add(number)
    left = {key: _value_of(robot, key) for key in edits}
    rate, size = draw.uniform(5, 15), draw.uniform(0.3, 1)
    (folder / "left.xml").write_text(robot.text(left), encoding="utf-8")
    (folder / "right.xml").write_text(robot.text(edits), encoding="utf-8")
    (folder / "drive.py").write_text(_CONTROLLER.format(size=size, rate=rate), encoding="utf-8")

    def command_of(seconds: float, index: int) -> float:
        return size * math.sin(rate * seconds + index)

    def joints_of(values: Mapping[str, str]) -> np.ndarray:
        return raw_joints(robot.text(values), command_of)

    code, answer, error = asked_why(
        folder, "drive.py:swing", "left.xml", "right.xml", "--write", "fixed.xml"
    )
    if code not in (0, 1) or not answer:
        return [f"exit code {code}: {error.strip()[-300:]}"]
    gap, shares = raw_shares(left, edits, joints_of)
    return _wrong(answer, code, gap, shares, folder, joints_of(left), command_of)


def _value_of(robot: Robot, key: str) -> str:
    number, _, name = key.partition(" ")
    element = robot.lines[int(number) - 1]
    assert isinstance(element, Element)
    return element.attributes[name]


def _wrong(
    answer: Mapping[str, Any],
    code: int,
    gap: float,
    shares: Mapping[str, float],
    folder: Path,
    left: np.ndarray,
    command_of: Callable[[float, int], float],
) -> list[str]:
    """Return what is wrong of an answer."""
    if not math.isclose(answer["gap"], gap, rel_tol=SAME, abs_tol=1e-9):
        return [f"the gap is told as {answer['gap']}, raw {gap}"]
    problems = _wrong_shares(answer, shares)
    if (answer["explained"] > 0.95) != (code == 0):
        problems.append(f"exit code {code} where {answer['explained']:.3f} is explained")
    written = folder / "fixed.xml"
    if not written.exists():
        return [*problems, "no file was written"]
    apart = float(np.abs(raw_joints(written.read_text("utf-8"), command_of) - left).max())
    if apart > SAME:
        problems.append(f"the written file is {apart:.3g} rad from the left one")
    return problems


def _wrong_shares(answer: Mapping[str, Any], shares: Mapping[str, float]) -> list[str]:
    """Return which edits are not told, or with another share, and what is told that is none."""
    problems: list[str] = []
    rows = {}
    for row in answer["shares"]:
        keys = {f"{change['line']} {change['attribute']}" for change in row["changes"]}
        same = keys & shares.keys()
        if len(same) != 1:
            problems.append(
                f"{row['name']!r} is to be changed at {sorted(keys)}: edited {sorted(shares)}"
            )
        for key in same:
            rows[key] = row
    for key, share in shares.items():
        told = rows.get(key, {}).get("share")
        if told is None and abs(share) < _NOTHING:  # what cannot act is no cause
            continue
        if told is None or abs(told - share) > SHARE:
            problems.append(f"{key} has the share {told}, raw {share:.4f}")
    return problems
