"""The latency of actuators: MuJoCo's `actuator_delay`, and the room that it needs.

MuJoCo keeps the last commands of an actuator in a buffer of MjData, and takes that of `delay`
seconds ago. How many are kept is fixed when a model is compiled; `with_room` gives a compiled
model more. A delay that is a whole number of steps would be that many or one more, by the
rounding of time; so `latency` is written a millionth shorter.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BadInputError
from ..interface import Array, Ints
from ..processes import free_memory
from .actuators import commands_needed
from .compiled.binary_models import compile_text, from_binary, saved

if TYPE_CHECKING:
    from .compiled.types import MjModel

SHORTER = 1 - 1e-6
_LARGE = 1e7  # bytes of buffers, from which on it is asked what memory is free
_MOST = 8.0 * 2**31  # bytes: the engine counts the numbers of the buffers in a C int
_SMALL = """<mujoco><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>
<actuator><motor joint="j" delay="1" nsample="{}"/></actuator></mujoco>"""


def commands_kept(m: MjModel, delay: Array, timestep: Array | float) -> Ints:
    """Return how many commands each actuator keeps: those of its delay, and those that the file
    asks for.

    Args:
        m: The compiled model; its own delays and timestep are not looked at.
        delay: (..., nactuator) [s].
        timestep: (...) length of an engine step [s].

    Returns:
        (..., nactuator).

    Raises:
        BadInputError: The memory that is free cannot hold so many.
    """
    steps = np.asarray(timestep)[..., None]
    counts = np.maximum(commands_needed(delay, steps), m.actuator_history[:, 0])
    sizes = 8.0 * (counts * (1 + m.actuator_ctrlnum)).sum(axis=-1)  # bytes
    if sizes.max() > _LARGE:
        limit = min(_MOST, free_memory() or _MOST)
        if sizes.max() > limit:
            worst = np.unravel_index(sizes.argmax(), sizes.shape)
            longest = float(np.broadcast_to(delay, counts.shape)[worst].max()) / SHORTER
            length = float(np.broadcast_to(timestep, sizes.shape)[worst])
            raise BadInputError(
                f"a latency of {longest:.4g} s is too long for engine steps of {length:.4g} s: "
                f"the {counts[worst].max():.3g} commands that are on their way take "
                f"{sizes[worst] / 1e9:.3g} GB in a Data, which may take {limit / 1e9:.3g} GB here"
            )
    return counts.astype(np.int64)


def with_room(m: MjModel, counts: Ints | None = None) -> MjModel:
    """Return the same model with a buffer for the delay of every actuator, or itself if it has
    them.

    Args:
        m: The compiled model, with its timestep and delays.
        counts: Commands to keep, (nactuator,); by default `commands_kept` of its own delays.

    Raises:
        BadInputError: As in `commands_kept`.
    """
    if counts is None:
        counts = commands_kept(m, m.actuator_delay, m.opt.timestep)
    short, starts = _appended(m, counts)
    if not len(short):
        return m
    roomy = _of_size(m, int(starts[-1]))
    roomy.actuator_history[short, 0] = counts[short]
    roomy.actuator_historyadr[short] = starts[:-1]
    return roomy


def with_room_of(m: MjModel, before: MjModel, counts: Ints) -> MjModel:
    """Return what `with_room` would make of one of many worlds that share larger buffers.

    Args:
        m: The compiled model of the world, in the buffers that all share.
        before: The compiled model before it got room for all.
        counts: Commands that this world keeps, (nactuator,).
    """
    own = _of_size(m, before.nhistory)
    own.actuator_history[:] = before.actuator_history
    own.actuator_historyadr[:] = before.actuator_historyadr
    return with_room(own, counts)


def places_of(before: MjModel, shared: MjModel, counts: Ints) -> Ints:
    """Return where the buffers of a Data of one world's model lie in those that many worlds share.

    Args:
        before: The compiled model before it got room.
        shared: With room for all worlds.
        counts: Commands that this world keeps, (nactuator,).

    Returns:
        (nhistory of that Data,), places in (nhistory of `shared`,).
    """
    short, starts = _appended(before, counts)
    first = before.actuator_historyadr.copy()
    first[short] = starts[:-1]
    places = np.arange(starts[-1])
    for a in np.flatnonzero(counts):
        size = 2 + int(counts[a]) * (1 + int(before.actuator_ctrlnum[a]))
        start = int(shared.actuator_historyadr[a])
        places[first[a] : first[a] + size] = np.arange(start, start + size)
    return places


def hold(m: MjModel, history: Array, ctrl: Array, counts: Ints | None = None) -> None:
    """Let the commands before the start have been that of the start.

    Args:
        m: The compiled model.
        history: (..., nhistory), the buffers of MjData after a reset; written to.
        ctrl: (..., nu).
        counts: (n, nactuator) commands that each of n worlds keeps, where they differ.
    """
    groups: list[tuple[Any, Any]] = [(m.actuator_history[:, 0], ...)]
    if counts is not None:
        groups = [(alike, (counts == alike).all(axis=1)) for alike in np.unique(counts, axis=0)]
    for stored, which in groups:
        rows = history[which]
        for a in np.flatnonzero(stored):
            own, number = int(m.actuator_ctrlnum[a]), int(m.actuator_ctrladr[a])
            first = int(m.actuator_historyadr[a]) + 2 + int(stored[a])
            commands = np.tile(ctrl[which][..., number : number + own], int(stored[a]))
            rows[..., first : first + commands.shape[-1]] = commands
        history[which] = rows


def _appended(m: MjModel, counts: Ints) -> tuple[Ints, Ints]:
    """Return the actuators that need a larger buffer, and where each starts; last, where they
    all end.
    """
    short = np.flatnonzero(counts > m.actuator_history[:, 0])
    # Two numbers of the buffer's own, and a time and a command for each that is kept.
    sizes = 2 + counts[short] * (1 + m.actuator_ctrlnum[short])
    return short, m.nhistory + np.cumsum([0, *sizes])


def _of_size(m: MjModel, nhistory: int) -> MjModel:
    """Return a copy whose Data have buffers of another size."""
    blob = saved(m)
    at = _history_offset()
    blob[at : at + 8] = np.frombuffer(struct.pack("<q", nhistory), np.uint8)
    return from_binary(blob.tobytes())


@cache
def _history_offset() -> int:
    """Return where the size of the buffers, `nhistory`, stands in a saved model.

    It is the first in which two models with other buffers differ; sizes come before arrays.
    """
    few, more = (compile_text(_SMALL.format(count)) for count in (1, 2))
    at = int(np.flatnonzero(saved(few) != saved(more))[0])
    for model in (few, more):
        size = struct.unpack("<q", saved(model)[at : at + 8].tobytes())[0]
        if size != model.nhistory:
            raise NotImplementedError("this MuJoCo saves its models in another way")
    return at
