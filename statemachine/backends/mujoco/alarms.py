"""What MuJoCo warns of: which Data it concerns, what it says, and who else listens.

MuJoCo counts the warnings of an MjData in the MjData itself. These counters decide: they
are right in every thread, and whoever set the process's warning handler. The handler adds
two things. Without one MuJoCo writes to the terminal and to a log file; and its texts name
the first bad entry of a bulk step, where a counter knows the last.
"""

from __future__ import annotations

import re
import threading
import warnings
import weakref
from collections import deque
from collections.abc import Callable

import mujoco
import numpy as np

from ...errors import BadInputError, DivergedError, EngineError, EngineWarning
from ...interface import Model
from ...interface.checks import HUGE

_KIND = mujoco.mjtWarning
# Warnings that make a Data useless, in the order in which a step looks for it.
FATAL = {
    "qpos": int(_KIND.mjWARN_BADQPOS),
    "qvel": int(_KIND.mjWARN_BADQVEL),
    "ctrl": int(_KIND.mjWARN_BADCTRL),
    "qacc": int(_KIND.mjWARN_BADQACC),
}
_AUTORESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
_BAD = re.compile(r"value in (\w+) at \w+ (\d+).*Time = ([-+.\deE]+\d)")

Handler = Callable[[str], object]

RECENT_TEXTS: deque[str] = deque(maxlen=256)
# A function in C: a Ctrl-C inside one in Python would have to cross MuJoCo, which ends
# the process. So it is chained, in Python, only to the handler of somebody else.
_KEEP = RECENT_TEXTS.append
_LOCK = threading.RLock()  # a finalizer may run within
_users = 0


class _Both:
    """A handler that keeps a text and passes it on to the handler that was there before."""

    def __init__(self, other: Handler) -> None:
        self.other = other

    def __call__(self, text: str) -> None:
        _KEEP(text)
        self.other(text)


def listen() -> bool:
    """Put our handler in front of whatever handler there is; whether it was there already."""
    with _LOCK:
        handler = mujoco.get_mju_user_warning()
        ours = handler is _KEEP or isinstance(handler, _Both)
        if not ours:
            mujoco.set_mju_user_warning(_KEEP if handler is None else _Both(handler))
        return ours


def listen_for(user: object) -> None:
    """Listen for as long as an MjData, or whatever else runs the engine, lives."""
    global _users  # noqa: PLW0603
    with _LOCK:
        _users += 1
        listen()
    weakref.finalize(user, _end)


def _end() -> None:
    """Give the handler back after the last use, unless somebody else has set one since."""
    global _users  # noqa: PLW0603
    with _LOCK:
        _users -= 1
        handler = mujoco.get_mju_user_warning()
        if not _users and (handler is _KEEP or isinstance(handler, _Both)):
            mujoco.set_mju_user_warning(getattr(handler, "other", None))


def pass_on(texts: list[str], stacklevel: int) -> None:
    """Give texts of MuJoCo as Python's warnings."""
    for text in texts:
        warnings.warn(f"MuJoCo: {text}", EngineWarning, stacklevel=stacklevel)


class AlarmError(Exception):
    """MuJoCo found an entry that is not a number: the first, if that is known, and when [s]."""

    def __init__(self, quantity: str, index: int | None, time: float) -> None:
        super().__init__(quantity, index, time)
        self.quantity, self.index, self.time = quantity, index, time

    def entry(self, model: Model) -> str:
        """Return the entry in words, as 'qpos[2] (elbow_flex)'."""
        if self.index is None:
            return f"an entry of {self.quantity} (MuJoCo did not tell which)"
        name = model._coordinate_name(self.quantity, self.index)
        return f"{self.quantity}[{self.index}]{name}"


def end_error(model: Model, alarm: AlarmError, who: str) -> BadInputError | DivergedError:
    """Return the error for a Data or a world that has diverged, as `who` names it."""
    kind, happened = DivergedError, f"became NaN, infinite or huge at time {alarm.time:g} s"
    if alarm.quantity == "ctrl":
        kind, happened = BadInputError, f"was no number at time {alarm.time:g} s"
        happened += ": MuJoCo stepped as if ctrl were zero"
    return kind(
        f"{alarm.entry(model)} {happened}. {who} now takes only reset and set_state",
        quantity=alarm.quantity,
        index=alarm.index,
        time=alarm.time,
    )


def gave_up(error: object) -> EngineError:
    """Return the error for one of MuJoCo's own, or for a memory that is full."""
    return EngineError(f"MuJoCo gave up: {' '.join(str(error).split()) or 'out of memory'}")


def resets_itself(model: mujoco.MjModel) -> bool:
    """Tell whether MuJoCo resets what diverges, with no other sign than its warning."""
    return not model.opt.disableflags & _AUTORESET


class Alarms:
    """The warning counters of one MjData.

    Attributes:
        now: The counters, as the memory of the engine has them.
        seen: What they were when they were last looked at. They differ where MuJoCo has
            warned since; to compare them is all that a step does about warnings.
    """

    def __init__(self, model: mujoco.MjModel, raw: mujoco.MjData) -> None:
        listen_for(raw)
        self._model, self._raw = model, raw
        last = raw.warning.lastinfo  # (kinds,); in memory each is followed by its number
        pairs = np.lib.stride_tricks.as_strided(last, (2 * len(last),), (last.itemsize,))
        self._now, self._seen = pairs.reshape(-1, 2), np.zeros((len(last), 2), pairs.dtype)
        # Eight bytes at once: Python compares two such views without making an object.
        self.now = pairs.view(np.uint64).data
        self.seen = self._seen.reshape(-1).view(np.uint64).data

    def clear(self) -> None:
        """Forget the seen warnings: a reset has set the engine's counters to zero."""
        self._seen[:] = 0
        listen()

    def raise_pending(self) -> None:
        """Look at what MuJoCo warned of since the last time, and pass it on.

        Raises:
            AlarmError: It makes the Data useless.
        """
        trusted = listen()
        counts = (self._now - self._seen)[:, 1]
        self._seen[:] = self._now
        fatal = {name: int(counts[kind]) for name, kind in FATAL.items() if counts[kind] > 0}
        if fatal:
            raise self._first(fatal, trusted)
        # MuJoCo says a thing only the first time after a reset, and so do we.
        first = np.flatnonzero((counts > 0) & (counts == self._now[:, 1])).tolist()
        texts = [mujoco.mju_warningText(kind, int(self._now[kind, 0])) for kind in first]
        pass_on(texts, stacklevel=5)

    def _first(self, fatal: dict[str, int], trusted: bool) -> AlarmError:
        raw, resets = self._raw, resets_itself(self._model)
        # Without a reset what is bad stays bad: each step since the first has counted.
        steps = 1 if resets else max(fatal.values())
        quantity = next(name for name in fatal if resets or fatal[name] == steps)
        # Without the last digits, which are those of a long sum.
        time = float(raw.time) if resets else round(raw.time - steps * self._model.opt.timestep, 9)
        index: int | None = int(self._now[FATAL[quantity], 0])
        # Where it is not reset, what is bad stays bad.
        bad = np.flatnonzero(~(np.abs(getattr(raw, quantity)) <= HUGE)).tolist()
        if trusted and (resets or steps > 1):
            for text in reversed(list(RECENT_TEXTS)):
                match = _BAD.search(text)
                if not match or match[1].lower() != quantity:
                    continue
                if resets:
                    return AlarmError(quantity, int(match[2]), float(match[3]))
                # A text of the same moment may be another thread's.
                if abs(float(match[3]) - time) < 1e-4 and int(match[2]) in bad:
                    return AlarmError(quantity, int(match[2]), time)
        # A counter knows the entry of its last warning. It was that of the first, too, where no
        # other entry is bad by now; the command is the same in all steps.
        if fatal[quantity] > 1 and quantity != "ctrl" and (resets or bad != [index]):
            index = None
        return AlarmError(quantity, index, time)
