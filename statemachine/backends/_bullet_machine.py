"""The state machine of one Data on PyBullet: arrays outside, a hidden world inside.

What is written into the arrays reaches the engine with the next step; what the engine
does reaches the arrays at its end. Whatever is derived is computed when it is read, from
copies of the moment that it belongs to.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from ..errors import BadInputError, DivergedError
from ..interface import DERIVED, POSES, Array, Contacts
from ..interface.checks import HUGE, check_entries
from ..rotations import matrix_from_quat
from . import _dense as dense
from ._bullet_arm import Arm, Motors
from ._bullet_client import pb
from ._bullet_contacts import contacts
from ._bullet_law import Law
from ._bullet_shared import Shared, free_dynamics
from ._bullet_world import World


@dataclass(slots=True)
class Moment:
    """All that what is derived at one moment depends on.

    Attributes:
        qpos, qvel, ctrl: Whole arrays of the model.
        observed: What each arm knows of the step before: contact (n,) and friction (n,).
    """

    qpos: Array
    qvel: Array
    ctrl: Array
    observed: Observed


Observed = list[tuple[Array, Array]]


_MANY = HUGE * HUGE


class Mirror:
    """A machine that takes one step from the present of any Data of a Model, for `forward`.

    So forward takes no time, perturbs nothing, and says the same of equal states.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared

    def __reduce__(self) -> tuple[Any, ...]:
        return Mirror, (self._shared,)

    @cached_property
    def _machine(self) -> Machine:
        return Machine(self._shared, None, lambda _: None, lambda _name, _index: "", 1)

    def look(self, moment: Moment) -> dict[str, Any]:
        """Contacts and forces of a moment."""
        with self._shared.lock:
            return self._machine.look(moment)


class Machine:
    """The state of one Data, and the step that advances it.

    Attributes:
        qpos, qvel, ctrl: The Data's arrays.
        time: Simulated time [s].
    """

    def __init__(
        self,
        shared: Shared,
        mirror: Mirror | None,
        check_qpos: Callable[[Array], None],
        label: Callable[[str, int], str],
        substeps: int,
    ) -> None:
        raw = shared.raw
        self._shared, self._mirror = shared, mirror
        self._check_qpos, self._label = check_qpos, label
        self._substeps = substeps
        self._timestep = float(raw.opt.timestep)
        self.qpos, self.qvel, self.ctrl = raw.qpos0.copy(), np.zeros(raw.nv), np.zeros(raw.nu)
        self._open()
        self.restart(0.0, self.qpos, self.qvel, self.ctrl)

    def _open(self) -> None:
        raw, shared = self._shared.raw, self._shared
        world = World(shared.plan, shared.kind)
        trees = [tree for tree in world.trees if tree.joints]
        self._free = [tree for tree in world.trees if tree.free]
        self._arms: list[Any]
        if shared.kind == "engine":
            self._arms = [Motors(world, tree, raw) for tree in trees]
        else:
            self._arms = [Arm(world, tree, shared.ghost, Law(raw, tree)) for tree in trees]
        self._unobserved = [(arm.nothing, arm.nothing) for arm in self._arms]
        self.world, self._used, self._driven = world, False, False

    def close(self) -> None:
        """Give the world back."""
        self.world.close()

    def check_writable(self, *names: str) -> None:
        """Raise for an input that NumPy will not write into, before anything moves.

        Raises:
            BadInputError: Its flag was taken away with `setflags`.
        """
        for name in names:
            if not getattr(self, name).flags.writeable:
                raise BadInputError(
                    f"{name} was made read-only, and the engine writes into it: "
                    f"data.{name}.setflags(write=True)",
                    quantity=name,
                )

    def restart(
        self,
        time: float,
        qpos: Array,
        qvel: Array,
        ctrl: Array,
        observed: Observed | None = None,
    ) -> None:
        """Take a state whole; nothing of before has any part in what follows."""
        if self._used and self._shared.kind == "engine":
            old = self.world  # only one that is loaded anew starts alike
            self._open()
            old.close()
        self.time, self.qpos[:], self.qvel[:], self.ctrl[:] = time, qpos, qvel, ctrl
        self._place(observed)
        self._heed()
        self._moment: Moment | None = None
        self._lives = False
        self._derived: dict[str, Any] = {}

    def _place(self, observed: Observed | None = None) -> None:
        self._astray, self._lives = True, False  # until all is in its place
        if self._driven:  # it was interrupted: let go of what it was driven with
            pb.stepSimulation(self.world.client)
            self._driven = False
        place = self.world.put if self._shared.kind == "engine" else self.world.place
        place(self.qpos, self.qvel)
        for arm, known in zip(self._arms, observed or self._unobserved, strict=True):
            arm.place(self.qpos, self.qvel, *known)
        # What the arrays were left at, and its bytes, by which a write is seen.
        qpos, qvel = self.qpos.copy(), self.qvel.copy()
        self._left = qpos, qvel, qpos.tobytes(), qvel.tobytes()
        self._astray = False

    def _heed(self) -> None:
        """Take the command as it is now."""
        self._commanded = b"?"  # until every arm knows
        self._ctrl = self.ctrl.copy()
        for arm in self._arms:
            arm.command(self._ctrl)
        self._commanded = self._ctrl.tobytes()

    def run(self, nstep: int = 1) -> None:
        """Advance by `nstep` timesteps; all of it or, if anything is raised, nothing."""
        steps = nstep * self._substeps
        if steps >= 2**31:
            raise BadInputError(f"nstep {nstep} × {self._substeps} substeps is too large")
        self.check_writable("qpos", "qvel")
        if self.ctrl.tobytes() != self._commanded:
            reached = self.ctrl.copy()  # by the servos: what is infinite may end at a limit
            for arm in self._arms:
                arm.clamp(reached)
            check_entries(reached, "ctrl", self._label)
            self._heed()
        if self._written:
            check_entries(self.qpos, "qpos", self._label)
            check_entries(self.qvel, "qvel", self._label)
            self._check_qpos(self.qpos)
            self._place()
        elif self._astray:
            self._place(self._observed)
        self._used, start = True, self._observed
        kept = self._moment, self._derived
        try:
            time = self._several(steps - 1, self.time)
            before = self._read() if steps > 1 else self._left[:2]
            observed = start if steps == 1 else self._observed
            moment = Moment(*before, self._ctrl, observed)
            time = self._several(1, time)
            qpos, qvel = self._read()
            if self._free and not (qpos.dot(qpos) < _MANY and qvel.dot(qvel) < _MANY):
                self._diverge(time)
            left = qpos, qvel, qpos.tobytes(), qvel.tobytes()
            self._moment, self._lives, self._derived = moment, True, {}
            # Nothing can interrupt this line, and no other moves the Data.
            self.qpos[:], self.qvel[:], self.time, self._left = qpos, qvel, time, left
        except BaseException:
            # The engine is elsewhere now; the arrays are not, nor is what else is known.
            self._astray, self._lives = True, False
            self._moment, self._derived = kept
            for arm, known in zip(self._arms, start, strict=True):
                arm.place(self.qpos, self.qvel, *known)
            raise

    def _several(self, steps: int, time: float) -> float:
        """Take engine steps; returns the time after them."""
        for _ in range(steps):
            self._once()
            time += self._timestep
            for tree in self._free:
                self.world.follow(tree.body)
            for arm in self._arms:
                arm.read()
                if not arm.angles.dot(arm.angles) + arm.speed.dot(arm.speed) < _MANY:
                    self._diverge(time)
        return time

    def _once(self, afresh: bool = False) -> None:
        self._driven = True  # torques add up until a step takes them
        for arm in self._arms:
            arm.drive(afresh)
        pb.stepSimulation(self.world.client)
        self._driven = False

    def _read(self) -> tuple[Array, Array]:
        """Where the engine is: new arrays qpos and qvel."""
        qpos, qvel = self.qpos.copy(), self.qvel.copy()
        for arm in self._arms:
            qpos[arm.tree.qpos], qvel[arm.tree.qvel] = arm.angles, arm.speed
        for tree in self._free:
            qpos[tree.qpos], qvel[tree.qvel] = self.world.read_free(tree)
        return qpos, qvel

    def _diverge(self, time: float) -> None:
        qpos, qvel = self._read()
        for name, array in (("qpos", qpos), ("qvel", qvel)):
            bad = np.flatnonzero(~(np.abs(array) <= HUGE))
            if len(bad):
                index = int(bad[0])
                raise DivergedError(
                    f"{name}[{index}]{self._label(name, index)} became NaN, infinite or huge at "
                    f"time {time:g} s. This Data now takes only reset and set_state",
                    quantity=name,
                    index=index,
                    time=time,
                )

    @property
    def _written(self) -> bool:
        """Whether qpos or qvel is no longer what it was left at."""
        return self._left[2:] != (self.qpos.tobytes(), self.qvel.tobytes())

    @property
    def _observed(self) -> Observed:
        return [(arm.contact, arm.friction) for arm in self._arms]

    @property
    def present(self) -> Moment:
        """All that decides the future but the time."""
        # After a write, what was observed belongs to another state.
        observed = self._unobserved if self._written else self._observed
        return Moment(self.qpos.copy(), self.qvel.copy(), self.ctrl.copy(), observed)

    def forward(self) -> None:
        """Let everything derived belong to the present."""
        self._moment, self._lives, self._derived = self.present, False, {}

    def derive(self, name: str) -> Any:
        """An array of `records.DERIVED`, or "contacts"; computed at the first reading."""
        if name not in self._derived:
            found = self._compute(name)
            for value in found.values():
                if isinstance(value, np.ndarray):
                    value.setflags(write=False)
            self._derived |= found
        return self._derived[name]

    def _compute(self, name: str) -> dict[str, Any]:
        moment, raw = self._moment, self._shared.raw
        if moment is None:
            return _zeros(raw)
        if name in POSES:
            return self._shared.poses(moment.qpos)
        if self._lives:
            return {"contacts": self._contacts()} if name == "contacts" else self._forces()
        if self._mirror is None:
            raise AssertionError("a mirror looks into no mirror")
        return self._mirror.look(moment)

    def gathered(self, observed: Observed) -> tuple[Array, Array]:
        """Contact and friction of the arms as arrays (nv,)."""
        contact, friction = np.zeros(len(self.qvel)), np.zeros(len(self.qvel))
        for arm, known in zip(self._arms, observed, strict=True):
            contact[arm.tree.dofs], friction[arm.tree.dofs] = known
        return contact, friction

    def parted(self, contact: Array, friction: Array) -> Observed:
        """The other way round."""
        return [(contact[arm.tree.dofs], friction[arm.tree.dofs]) for arm in self._arms]

    def look(self, moment: Moment) -> dict[str, Any]:
        """What one step from a moment shows, contacts and forces; a mirror's only use."""
        self.restart(0.0, moment.qpos, moment.qvel, moment.ctrl, moment.observed)
        self._used = self._lives = True
        self._moment = moment
        self._once(afresh=True)
        for arm in self._arms:
            arm.read()
        self._left = (*self._read(), b"", b"")
        return {"contacts": self.derive("contacts"), **self._forces()}

    def _contacts(self) -> Contacts:
        """Of the world's last step, in which it found them before it moved."""
        return contacts(self._shared.raw, self.world, self.derive("xpos"), self.derive("xquat"))

    def _forces(self) -> dict[str, Array]:
        """Accelerations and forces of the world's last step."""
        raw, moment = self._shared.raw, self._moment
        assert moment is not None  # there was a step
        names = [name for name in DERIVED if name not in POSES]
        found = {name: np.zeros(raw.nv) for name in names}
        for arm in self._arms:
            for name, values in arm.forces().items():
                found[name][arm.tree.dofs] = values
        touched = set(raw.geom_bodyid[self.derive("contacts").geom].ravel().tolist())
        for tree in self._free:
            own, turn = tree.qvel, matrix_from_quat(self.derive("xquat")[tree.root])
            inertia, bias = free_dynamics(raw, tree.root, turn, moment.qvel[own])
            found["qfrc_bias"][own] = bias
            if tree.root in touched:  # what it did beyond falling, contact did
                rate = (self._left[1][own] - moment.qvel[own]) / self._timestep
                found["qfrc_contact"][own] = dense.times(inertia, rate) + bias
            pushed = found["qfrc_contact"][own] - bias
            found["qacc"][own] = dense.solved(dense.factored(inertia), pushed)
        parts = ("contact", "friction", "limit")
        for part in parts:
            found["qfrc_constraint"] += found[f"qfrc_{part}"]
        return found


def _zeros(raw: mujoco.MjModel) -> dict[str, Any]:
    shapes = {
        "xpos": (raw.nbody, 3),
        "xquat": (raw.nbody, 4),
        "site_xpos": (raw.nsite, 3),
        "site_xmat": (raw.nsite, 9),
    }
    found: dict[str, Any] = {name: np.zeros(shapes.get(name, (raw.nv,))) for name in DERIVED}
    none = np.zeros(0)
    found["contacts"] = Contacts(
        geom=np.zeros((0, 2), dtype=np.int64),
        dist=none,
        pos=np.zeros((0, 3)),
        frame=np.zeros((0, 3, 3)),
        force=np.zeros((0, 3)),
        torque=np.zeros((0, 3)),
    )
    return found
