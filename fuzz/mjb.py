"""Binary models with wrong bytes: refused before MuJoCo reads them; the sound one is loaded."""

from __future__ import annotations

import os
import random
import tempfile
from pathlib import Path
from typing import Any

import statemachine as sm
from statemachine.errors import ModelError

from ._tally import Tally

TRIES = 4000
_MODEL = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .1"><freejoint/><geom size=".1"/></body>
<body pos="0 0 1"><joint name="j" axis="0 1 0" limited="true" range="-1 1"/>
<geom type="capsule" size=".02" fromto="0 0 0 .2 0 0"/><site name="s"/>
<body pos=".2 0 0"><joint name="k" type="ball"/><geom size=".03"/></body></body></worldbody>
<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
<equality><joint joint1="j"/></equality><sensor><jointpos joint="j"/></sensor>
<actuator><position joint="j" kp="5"/><general tendon="t" dyntype="integrator"/></actuator>
<keyframe><key name="k" time="1"/></keyframe></mujoco>"""


def run(seed: int, tries: int) -> Tally:
    """Damage a small model in a few bytes, again and again."""
    tally, chance = Tally(), random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder  # for its digest
        text, file = Path(folder) / "sound.xml", Path(folder) / "model.mjb"
        text.write_text(_MODEL)
        model: Any = sm.load(text)
        model.save_binary(file)
        sound = file.read_bytes()
        for turn in range(tries):
            damaged, places = bytearray(sound), []
            for _ in range(chance.choice([1, 1, 1, 2, 8]) if turn % 100 else 0):
                places.append(chance.randrange(chance.choice([1000, len(sound)])))
                damaged[places[-1]] ^= chance.randrange(1, 256)
            if chance.random() < 0.1:
                del damaged[chance.randrange(len(damaged)) :]
            file.write_bytes(bytes(damaged))
            tally.tried += 1
            problem = examine(file, bytes(damaged) == sound)
            if problem:
                tally.failures.append(f"bytes {places} of {len(damaged)}: {problem}")
    return tally


def examine(file: Path, sound: bool) -> str:
    """What is wrong with how a file is taken, or ""."""
    try:
        sm.load(file)
    except ModelError as error:
        several = len(str(error).splitlines()) > 1
        return "an error of several lines" if several else "refused" if sound else ""
    return "" if sound else "not refused"
