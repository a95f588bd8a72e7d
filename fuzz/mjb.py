"""Binary models with wrong bytes: refused, or used without a crash.

Each is loaded and used in a process of its own, whose end by a signal is a failure.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ._tally import Tally

_ROOT = Path(__file__).resolve().parent.parent
_PATIENCE = 120.0
_MODEL = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .1"><freejoint/><geom size=".1"/></body>
<body pos="0 0 1"><joint name="j" axis="0 1 0" limited="true" range="-1 1"/>
<geom type="capsule" size=".02" fromto="0 0 0 .2 0 0"/><site name="s"/>
<body pos=".2 0 0"><joint name="k" type="ball"/><geom size=".03"/></body></body></worldbody>
<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
<equality><joint joint1="j"/></equality><sensor><jointpos joint="j"/></sensor>
<actuator><position joint="j" kp="5"/><general tendon="t" dyntype="integrator"/></actuator>
<keyframe><key name="k" time="1"/></keyframe></mujoco>"""
_USE = """
import sys, warnings, statemachine as sm
warnings.simplefilter("ignore")
try:
    model = sm.load(sys.argv[1])
    data = sm.make_data(model)
    sm.forward(model, data)
    sm.step(model, data, 5)
    sm.reset(model, data, 0)
    data.contacts
    sm.set_state(model, data, sm.get_state(model, data))
    sm.step(model, data)
except sm.errors.StateMachineError:
    pass
"""


def run(seed: int, seconds: float) -> Tally:
    """Damage a small model in a few bytes, again and again."""
    import mujoco

    tally, chance, end = Tally(), random.Random(seed), time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "damaged.mjb"
        mujoco.mj_saveModel(mujoco.MjModel.from_xml_string(_MODEL), str(file))
        sound = file.read_bytes()
        while not tally.tried or time.monotonic() < end:
            damaged, places = bytearray(sound), []
            for _ in range(chance.choice([1, 1, 1, 2, 8])):
                places.append(chance.randrange(chance.choice([1000, len(sound)])))
                damaged[places[-1]] = chance.choice([0, 255, 127, 128, chance.randrange(256)])
            file.write_bytes(bytes(damaged))
            ended = _use(file)
            tally.tried += 1
            if ended:
                tally.failures.append(f"bytes {places}: {ended}")
    return tally


def _use(file: Path) -> str:
    """How a process that uses the file ends; "" if well."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _USE, str(file)],
            cwd=_ROOT,
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"not within {_PATIENCE:g} s"
    return "" if done.returncode == 0 else f"{done.returncode} {done.stderr.strip()[-80:]}"
