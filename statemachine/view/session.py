"""The simulation behind a viewer: commands in, frames out; no clock, no thread, no screen."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

import numpy as np

from ..errors import BadInputError, StateMachineError
from ..interface import Array, Data, Ints, Model, forward, make_data, reset, step, usual_site
from ..measures import distances, joint_gap
from .frames import (
    Command,
    Control,
    EnginePose,
    Pause,
    Play,
    ResetTo,
    Separation,
    SetCtrl,
    Snapshot,
    Step,
    controls_of,
)

_STEPS_MOST = 100_000  # of one press of a button


class Session:
    """What is shown, paused at first: where every frame of a viewer comes from.

    Attributes:
        names: Of the engines.
        controls: A slider for each actuator.
        places: Where `ResetTo` can go: names of the keyframes, by number.
        timestep: Simulated time of a step [s].
        tip: The site that stands for the fingertip, or "".
        length: Simulated time from first to last [s]; None: a simulation has no end.
        running: Whether time is to go on by itself.
    """

    controls: tuple[Control, ...] = ()
    places: tuple[str, ...] = ()
    length: float | None = None

    def __init__(
        self,
        names: Sequence[str],
        timestep: float,
        joints: tuple[Sequence[str], Sequence[int] | Ints, Sequence[int] | Ints],
        sites: Sequence[str],
        site: int | None,
    ) -> None:
        """Begin.

        Args:
            names: Of the engines.
            timestep: Simulated time of a step [s].
            joints: Their names, `JointType`s and places in qpos.
            sites: Names of the sites.
            site: Which of them stands for the fingertip; None for none.
        """
        self.names, self.timestep, self._joints, self._site = names, timestep, joints, site
        self.tip = "" if site is None else sites[site]
        self.running, self._trouble, self._steps, self._resets = False, "", 0, 0

    def _snapshot(
        self, time: float, ctrl: Array, poses: tuple[EnginePose, ...], same: bool = True
    ) -> Snapshot:
        """A frame; how far two engines are apart is known if their moments are the same."""
        gap = None
        if same and len(poses) > 1:
            one, two = poses[:2]
            tip = None if one.tip is None or two.tip is None else distances(one.tip, two.tip)
            gap = Separation(
                None if tip is None else float(tip), joint_gap(*self._joints, one.qpos, two.qpos)
            )
        return Snapshot(
            time, self._steps, self.running, ctrl, self._resets, poses, gap, self._trouble
        )


class LiveSession(Session, ExitStack):
    """One or two engines under the same commands, at the same steps.

    Whoever makes it is the only one to touch its Data: what other threads want comes as
    commands through a queue of theirs.
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
            if (other.nq, other.nu, other.nbody) != (first.nq, first.nu, first.nbody):
                raise BadInputError(f"{other!r} is another model than {first!r}")
            if other.timestep != first.timestep:
                raise BadInputError(
                    f"the timesteps differ: {first.timestep:g} s on {first.backend}, "
                    f"{other.timestep:g} s on {other.backend}"
                )
        chosen = usual_site(first.site_names) if site is None else first.site_id(site)
        super().__init__(
            tuple(model.backend for model in models),
            first.timestep,
            (first.joint_names, first.jnt_type, first.jnt_qposadr),
            first.site_names,
            chosen,
        )
        self.controls = controls_of(first)
        self.places = tuple(k.name or f"keyframe {n}" for n, k in enumerate(first.keyframes))
        self._arms: list[tuple[Model, Data]] = []
        # The last moment that was good: its time and the poses.
        self._good: tuple[float, tuple[EnginePose, ...]] = 0.0, ()
        try:
            for model in models:
                self._arms.append((model, self.enter_context(make_data(model))))
            self._reset(keyframe)
        except BaseException:
            self.close()
            raise

    def apply(self, command: Command) -> None:
        """Do what was asked for.

        Raises:
            BadInputError: A value is no number, or out of bounds; nothing is changed then.
            UnknownNameError: There is no such keyframe; nothing is changed then.
        """
        match command:
            case SetCtrl(index, value):
                if not 0 <= index < len(self.controls) or not np.isfinite(value):
                    raise BadInputError(f"actuator {index} cannot be set to {value}")
                for _, data in self._arms:
                    data.ctrl[index] = value
            case Play():
                self.running = not self._trouble
            case Pause():
                self.running = False
            case Step(count):
                if not 1 <= count <= _STEPS_MOST:
                    raise BadInputError(f"steps must be from 1 to {_STEPS_MOST}; got {count}")
                self.running = False
                self.advance(count)
            case ResetTo(keyframe):
                self._reset(keyframe)
            case _:
                raise BadInputError(f"a simulation cannot do {command!r}")

    def advance(self, count: int = 1) -> None:
        """Take steps on every engine; one that fails stops them all until a reset."""
        if self._trouble:
            return
        for model, data in self._arms:
            try:
                step(model, data, count)
            except StateMachineError as error:
                self._stop(model, error)
        if not self._trouble:
            self._steps += count

    def frame(self) -> Snapshot:
        """This moment; after an engine failed, the last one that was good.

        Looking changes nothing: the run goes on as if nobody had looked.
        """
        if not self._trouble:
            self._look()
        time, poses = self._good
        return self._snapshot(time, np.array(self._arms[0][1].ctrl), poses)

    def _look(self) -> None:
        poses = []
        for model, data in self._arms:
            try:
                forward(model, data)
            except StateMachineError as error:
                self._stop(model, error)
                return
            tip = None if self._site is None else np.array(data.site_xpos[self._site])
            where = np.array(data.xpos), np.array(data.xquat), tip, np.array(data.qpos)
            poses.append(EnginePose(model.backend, *where))
        self._good = self._arms[0][1].time, tuple(poses)

    def _reset(self, keyframe: int | str | None) -> None:
        for model, data in self._arms:
            reset(model, data, keyframe)
        self._trouble, self._steps = "", 0
        self._resets += 1

    def _stop(self, model: Model, error: StateMachineError) -> None:
        self.running = False
        self._trouble = self._trouble or f"{model.backend}: {error}"
