"""The latency of actuators: MuJoCo's `actuator_delay`, and the room that it needs.

MuJoCo keeps the last commands of an actuator in a buffer of MjData, and takes that of `delay`
seconds ago. How many are kept is fixed when a model is compiled; `with_room` gives a compiled
model more. A delay that is a whole number of steps would be that many or one more, by the
rounding of time; so `latency` is written a millionth shorter.
"""

from __future__ import annotations

import struct
from functools import cache

import mujoco
import numpy as np

from ..interface import Array, Ints

SHORTER = 1 - 1e-6
_SMALL = """<mujoco><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>
<actuator><motor joint="j" delay="1" nsample="{}"/></actuator></mujoco>"""


def delay_steps(m: mujoco.MjModel) -> Ints:
    """Engine steps (nu,) by which each number of ctrl acts late."""
    owner = np.repeat(np.arange(m.nactuator), m.actuator_ctrlnum)
    steps = needed(m.actuator_delay, m.opt.timestep)
    return np.minimum(steps, m.actuator_history[:, 0])[owner]


def needed(delay: Array, timestep: Array | float) -> Ints:
    """Commands that have to be kept for delays [s], of any shape: the oldest acts."""
    return np.ceil(delay / timestep - 1e-9).astype(np.int64)


def with_room(m: mujoco.MjModel, least: Ints | int = 0) -> mujoco.MjModel:
    """The same model, with a buffer for the delay of every actuator; itself if it has them.

    Args:
        m: The compiled model, with its timestep and delays.
        least: Commands to keep, (nactuator,), where more than the delays need.
    """
    kept = np.maximum(needed(m.actuator_delay, m.opt.timestep), least)
    short = np.flatnonzero(kept > m.actuator_history[:, 0])
    if not len(short):
        return m
    # Two numbers of the buffer's own, and a time and a command for each that is kept.
    sizes = 2 + kept[short] * (1 + m.actuator_ctrlnum[short])
    starts = m.nhistory + np.cumsum([0, *sizes])
    blob = _saved(m)
    at = _history_offset()
    blob[at : at + 8] = np.frombuffer(struct.pack("<q", int(starts[-1])), np.uint8)
    roomy = mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": blob.tobytes()})
    roomy.actuator_history[short, 0] = kept[short]
    roomy.actuator_historyadr[short] = starts[:-1]
    return roomy


def hold(m: mujoco.MjModel, history: Array, ctrl: Array) -> None:
    """Let the commands before the start have been that of the start.

    Args:
        m: The compiled model.
        history: (..., nhistory), the buffers of MjData after a reset; written to.
        ctrl: (..., nu).
    """
    for a in np.flatnonzero(m.actuator_history[:, 0]):
        kept, own = int(m.actuator_history[a, 0]), int(m.actuator_ctrlnum[a])
        first = int(m.actuator_historyadr[a]) + 2 + kept
        number = int(m.actuator_ctrladr[a])
        for k in range(kept):
            start = first + k * own
            history[..., start : start + own] = ctrl[..., number : number + own]


def _saved(m: mujoco.MjModel) -> np.ndarray:
    blob = np.empty(mujoco.mj_sizeModel(m), np.uint8)
    mujoco.mj_saveModel(m, None, blob)
    return blob


@cache
def _history_offset() -> int:
    """Where the size of the buffers, `nhistory`, stands in a saved model.

    It is the first in which two models with other buffers differ; sizes come before arrays.
    """
    few, more = (mujoco.MjModel.from_xml_string(_SMALL.format(count)) for count in (1, 2))
    at = int(np.flatnonzero(_saved(few) != _saved(more))[0])
    for model in (few, more):
        found = struct.unpack("<q", _saved(model)[at : at + 8].tobytes())[0]
        if found != model.nhistory:
            raise NotImplementedError("this MuJoCo saves its models in another way")
    return at
