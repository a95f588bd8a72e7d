"""The actuators of a compiled model: who takes each number of ctrl, and how it acts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..interface import Array, Ints
from .compiled.actuators import ActivationKind, BiasKind, CtrlChart, CtrlInput, GainKind
from .controls import ctrl_owners

if TYPE_CHECKING:
    from .compiled.types import MjModel

# What the controls of an actuator with several are: bits of its ctrlspec, in their order.
_INPUTS = {
    CtrlInput.POSITION: "position",
    CtrlInput.VELOCITY: "velocity",
    CtrlInput.FEEDFORWARD: "feedforward",
    CtrlInput.VOLTAGE: "voltage",
    CtrlInput.PRESSURE: "pressure",
}
_CHARTS: dict[int, tuple[str, ...]] = {
    CtrlChart.EXPMAP: ("x", "y", "z"),
    CtrlChart.QUAT: ("w", "x", "y", "z"),
}


def servos(m: MjModel) -> tuple[Ints, NDArray[np.bool_]]:
    """Return the actuator of each number of ctrl (nu,), and whether it is a position servo.

    An actuator may take several numbers of ctrl.
    """
    owner = ctrl_owners(m)
    fixed = m.actuator_gaintype == GainKind.FIXED
    affine = m.actuator_biastype == BiasKind.AFFINE
    gain = m.actuator_gainprm[:, 0]
    servo = fixed & affine & (m.actuator_biasprm[:, 1] == -gain) & (gain != 0)
    # An integrator's ctrl is a velocity.
    direct = (ActivationKind.NONE, ActivationKind.FILTER, ActivationKind.FILTEREXACT)
    servo &= np.isin(m.actuator_dyntype, direct)
    return owner, servo[owner]


def control_names(m: MjModel) -> Iterator[str]:
    """Yield a name for each number of ctrl: the actuator's, with a suffix if it takes several."""
    for i in range(m.nactuator):
        name, count, spec = m.actuator(i).name, int(m.actuator_ctrlnum[i]), m.actuator_ctrlspec[i]
        if m.actuator_gaintype[i] == GainKind.SO3:
            parts = _CHARTS.get(int(spec), ())
        else:
            parts = tuple(part for bit, part in _INPUTS.items() if int(spec) & bit)
        if len(parts) != count:  # a signature of a later engine
            parts = tuple(str(k) for k in range(count))
        yield from (f"{name}.{part}" if name and count > 1 else name for part in parts)


def delay_steps(m: MjModel) -> Ints:
    """Return the engine steps (nu,) by which each number of ctrl acts late."""
    steps = np.minimum(commands_needed(m.actuator_delay, m.opt.timestep), m.actuator_history[:, 0])
    return steps.astype(np.int64)[ctrl_owners(m)]


def commands_needed(delay: Array, timestep: Array | float) -> Array:
    """Return how many commands have to be kept for delays [s], of any shape: the oldest acts."""
    with np.errstate(over="ignore"):  # infinitely many, which `commands_kept` refuses
        return np.ceil(delay / timestep - 1e-9)
