"""A simulation that is shown while it runs, on one engine or on two at the same steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError, StateMachineError
from ..interface import Data, Model, forward, make_data, reset, step
from ..interface.sites import usual_site
from .controls import controls_of
from .session import EnginePose, Frame, Joints, Session


class _Arm(NamedTuple):
    """A Model and its Data."""

    model: Model
    data: Data


def _check_twins(first: Model, other: Model) -> None:
    """Raise BadInputError where two models are not the same file at the same timestep."""
    if (other.nq, other.nu, other.nbody) != (first.nq, first.nu, first.nbody):
        raise BadInputError(f"{other!r} is another model than {first!r}")
    if other.timestep != first.timestep:
        raise BadInputError(
            f"the timesteps differ: {first.timestep:g} s on {first.backend}, "
            f"{other.timestep:g} s on {other.backend}"
        )


class LiveSession(Session, ExitStack):
    """One or two engines under the same commands, at the same steps.

    Whoever makes it is the only one to touch its Data: what other threads want comes as
    calls through a queue of theirs.
    """

    def __init__(
        self, models: Sequence[Model], keyframe: int | str | None = None, site: str | None = None
    ) -> None:
        """Make a Data on each engine, until `close`, and put it to its start; paused.

        Args:
            models: One Model, or the same file on two engines: the second is the ghost.
            keyframe: Where to start; None for the default state.
            site: What stands for the fingertip; None for the usual site.

        Raises:
            UnknownNameError: There is no such keyframe or site.
            BadInputError: The two are not the same model at the same timestep.
        """
        ExitStack.__init__(self)
        first = models[0]
        for other in models[1:]:
            _check_twins(first, other)
        if site is None:
            tip_site = usual_site(first.site_names, first.moving_sites)
        else:
            tip_site = first.site_id(site)
        super().__init__(
            tuple(model.backend for model in models),
            first.timestep,
            Joints(first.joint_names, first.jnt_type, first.jnt_qposadr),
            first.site_names,
            tip_site,
        )
        self.controls = controls_of(first)
        self.places = tuple(k.name or f"keyframe {n}" for n, k in enumerate(first.keyframes))
        self.arms: list[_Arm] = []
        # Those of the last moment that was good.
        self._time = 0.0
        self._poses: tuple[EnginePose, ...] = ()
        try:
            for model in models:
                self.arms.append(_Arm(model, self.enter_context(make_data(model))))
            self.reset(keyframe)
        except BaseException:
            self.close()
            raise

    def set_ctrl(self, index: int, value: float) -> None:
        if not 0 <= index < len(self.controls) or not np.isfinite(value):
            raise BadInputError(f"actuator {index} cannot be set to {value}")
        for _, data in self.arms:
            data.ctrl[index] = value

    def advance(self, count: int = 1) -> None:
        """Take steps on every engine; one that fails stops them all until a reset."""
        if self._all_do(lambda model, data: step(model, data, count)):
            self.steps += count

    def reset(self, keyframe: int | str | None = None) -> None:
        for model, data in self.arms:
            reset(model, data, keyframe)
        self._error, self.steps = "", 0
        self._resets += 1

    def frame(self) -> Frame:
        """Return this moment; after an engine failed, the last one that was good.

        Looking changes nothing: the run goes on as if nobody had looked.
        """
        solid = self.arms[0].data
        if self._all_do(forward):
            self._time = solid.time
            self._poses = tuple(self._pose(model, data) for model, data in self.arms)
        return self._snapshot(self._time, np.array(solid.ctrl), self._poses)

    def _pose(self, model: Model, data: Data) -> EnginePose:
        """Return the pose of a Data of now."""
        tip = None if self._site is None else np.array(data.site_xpos[self._site])
        return EnginePose(
            name=model.backend,
            xpos=np.array(data.xpos),
            xquat=np.array(data.xquat),
            qpos=np.array(data.qpos),
            tip=tip,
        )

    def _all_do(self, verb: Callable[[Model, Data], None]) -> bool:
        """Call a verb on every engine; return whether there is no error, now or before."""
        if self._error:
            return False
        for model, data in self.arms:
            try:
                verb(model, data)
            except StateMachineError as error:
                self.running = False
                if not self._error:
                    self._error = f"{model.backend}: {error}"
        return not self._error
