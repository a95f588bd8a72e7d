"""Strange model files for every reader of the package: a clear error, or finite numbers."""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from statemachine.installed import available

from ._tally import Tally, run_bounded

TRIES = 100
_ARM = (
    '<body name="b"><joint name="j" axis="0 1 0"/>'
    '<geom name="g" size=".1 .1" type="capsule" mass="1"/><site name="s" pos="0 0 .1"/></body>'
)
_MJCF = (
    f"<mujoco><worldbody>{_ARM}</worldbody><actuator>"
    '<position joint="j" kp="5"/></actuator></mujoco>'
)
_URDF = (
    '<robot name="r"><link name="base"/><link name="l"><inertial><mass value="1"/>'
    '<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
    '<sphere radius=".1"/></geometry></collision></link><joint name="j" type="revolute">'
    '<parent link="base"/><child link="l"/><axis xyz="0 1 0"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
)
_VALUES = [
    "nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "", "x", "1 2", "&lt;script&gt;",
    "a&#10;b", "j" * 5000, "関節", "../../etc", "%s%n", "[red]x[/red]", "/etc/passwd",
]  # fmt: skip
# One file and one reader, in a process of its own; what it says begins with RESULT.
READER = """
import sys, warnings
warnings.simplefilter("ignore")
import numpy as np
import statemachine as sm
from statemachine.errors import StateMachineError
path, reader = sys.argv[1:]
try:
    if reader == "kinematics":
        sm.Kinematics(path)
    else:
        model = sm.load(path, backend=reader)
        with sm.make_data(model) as data:
            sm.forward(model, data)
            sm.step(model, data, 5)
            sm.set_state(model, data, sm.get_state(model, data))
            for name in ("qpos", "qvel", "xpos", "xquat"):
                if not np.isfinite(getattr(data, name)).all():
                    sys.exit(f"RESULT {name} is not finite")
    print("RESULT ok")
except StateMachineError as error:
    print("RESULT an error of several lines" if "\\n" in str(error) else "RESULT ok")
except Exception as error:
    print("RESULT", type(error).__name__, str(error)[:200].encode())
"""


def run(seed: int, tries: int) -> Tally:
    """Change a model's text, and let each reader read it."""
    draw, tally = random.Random(seed), Tally()
    engines = set(available()[0])
    readers = [name for name in ("mujoco", "pybullet") if name in engines]
    readers += ["kinematics"] if "pinocchio" in engines else []
    with tempfile.TemporaryDirectory() as name:
        for _ in range(tries):
            change, suffix, content = strange(draw)
            path = Path(name) / f"m{suffix}"
            path.write_bytes(content)
            reader = draw.choice(readers)
            tally.tried += 1
            problem = examine([sys.executable, "-c", READER, str(path), reader], path.parent)
            if problem:
                tally.failures.append(f"{reader}, {change}: {problem}")
    return tally


def strange(draw: random.Random) -> tuple[str, str, bytes]:
    """Draw a damaged model file: what was changed, the suffix, and its bytes."""
    suffix, good = draw.choice([(".xml", _MJCF), (".urdf", _URDF)])
    change = draw.choice([_attribute, _attribute, _attribute, _cut, _nested, _bytes])
    what, content = change(draw, good)
    return f"{suffix} {what}", suffix, content


def _attribute(draw: random.Random, good: str) -> tuple[str, bytes]:
    parts = good.split('"')
    place = draw.randrange(1, len(parts), 2)
    name, value = parts[place - 1].split()[-1], draw.choice(_VALUES)
    parts[place] = value
    return f"{name}{value[:20]!r}", '"'.join(parts).encode()


def _cut(draw: random.Random, good: str) -> tuple[str, bytes]:
    start, length = draw.randrange(len(good)), draw.choice([1, 10, 10**6])
    return "with a part cut out", (good[:start] + good[start + length :]).encode()


def _nested(draw: random.Random, good: str) -> tuple[str, bytes]:
    depth = draw.choice([10, 200, 2000])
    return f"nested {depth} deep", good.replace(
        _ARM, "<body>" * depth + _ARM + "</body>" * depth
    ).encode()


def _bytes(draw: random.Random, good: str) -> tuple[str, bytes]:
    codings: list[Callable[[str], bytes]] = [
        lambda text: text.encode("utf-16"),
        lambda text: text.replace('"j"', '"jü"').encode("latin-1"),
        lambda text: text.encode() + b"\0",
        lambda _text: draw.randbytes(500),
        lambda _text: b"",
    ]
    return "of other bytes", draw.choice(codings)(good)


def examine(words: list[str | bytes] | list[str], folder: Path) -> str:
    """Return what is wrong with how a file is read, or ""."""
    code, out, said = run_bounded(words, folder)
    if code is None:
        return "it hangs"
    results = [line for line in (out + said).splitlines() if line.startswith("RESULT ")]
    if not results:
        last = (said.strip() or "nothing said").splitlines()[-1]
        return f"its process ended with code {code}: {last}"
    result = results[-1].removeprefix("RESULT ")
    return "" if result == "ok" else result
