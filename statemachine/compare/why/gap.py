"""How far apart two runs are, in one number for each quantity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError, DivergedError, TraceError
from ...interface import Array, Ints, JointType, Model, forward, make_data, usual_site
from ...measures import SAME, common_moments, largest, nearest
from ...runs import Trace
from ..matching import Matched
from ..tolerances import BODY, BODY_TURN, COUNT, SLIDE

BALLS = "ball joints"


@dataclass(frozen=True)
class Deviation:
    """How far apart two runs are in one quantity.

    Attributes:
        unit: Of the distances: "rad" or "m".
        worst: The largest distance at any moment; at: when [s].
        rms: Root of the mean square over the moments.
        end: At the last moment.
    """

    unit: str
    worst: float
    at: float
    rms: float
    end: float


@dataclass(frozen=True, eq=False)
class Curves:
    """One run, as the quantities that runs are compared by.

    Attributes:
        of: By quantity, an array (n, k): for each moment k numbers, in the unit.
    """

    of: dict[str, Array]


@dataclass(frozen=True, eq=False)
class _Measured:
    """Where on one side is what both are measured by.

    Attributes:
        hinges, slides: Addresses in qpos.
        balls: Those of quaternions, four for each ball joint.
        free: Bodies that float; turned: addresses of the quaternion of each, (n, 4).
        tip: The site that is measured; None without one.
    """

    hinges: Ints
    slides: Ints
    balls: Ints
    free: Ints
    turned: Ints
    tip: int | None

    @classmethod
    def of(cls, model: Model) -> _Measured:
        """All of a Model."""
        joints = np.arange(model.njnt)
        return cls._at(model, joints, usual_site(model.site_names))

    @classmethod
    def pair(cls, matched: Matched) -> tuple[_Measured, _Measured]:
        """What two Models have in common."""
        joints = np.array(matched.joints, dtype=np.int64).reshape(-1, 2).T
        names = [matched.one.site_names[a] for a, _ in matched.sites]
        tip = usual_site(names)
        sites = (None, None) if tip is None else matched.sites[tip]
        models = matched.one, matched.two
        one, two = (cls._at(m, j, s) for m, j, s in zip(models, joints, sites, strict=True))
        return one, two

    @classmethod
    def _at(cls, model: Model, joints: Ints, tip: int | None) -> _Measured:
        kinds = model.jnt_type[joints]
        places = model.jnt_qposadr[joints]
        return cls(
            hinges=places[kinds == int(JointType.HINGE)],
            slides=places[kinds == int(JointType.SLIDE)],
            balls=(places[kinds == int(JointType.BALL)][:, None] + np.arange(4)).ravel(),
            free=model.jnt_bodyid[joints[kinds == int(JointType.FREE)]],
            turned=places[kinds == int(JointType.FREE)][:, None] + np.arange(3, 7),
            tip=tip,
        )


class Ruler:
    """What all runs of one attribution are measured by: the same moments and quantities.

    Attributes:
        time: (n,) moments since the start [s].
        between: Whether rows had to be interpolated, for want of common moments.
        units: Unit of each quantity.
    """

    def __init__(
        self, model: Model, one: Trace, two: Trace, matched: Matched | None = None
    ) -> None:
        """Of two runs as they come.

        Args:
            model: That of `one`; poses are computed with it, unless `curves` is given another.
            one: A run.
            two: The other.
            matched: What of `model` is what of the other's Model; None if they are built alike.
        """
        if matched is None and (model.nq, model.joint_names) != (two.header.nq, two.header.joints):
            raise BadInputError("the two models have other joints: there is nothing to attribute")
        try:
            self.between, self.time = False, common_moments(one, two).time
        except TraceError:  # too few: rows of the second are made up between its own
            time, end = one.time - one.time[0], two.time[-1] - two.time[0]
            slack = SAME * one.header.timestep
            self.between, self.time = True, time[time <= end + slack]
        self._model = model
        if matched is None:
            self._sides = (_Measured.of(model),) * 2
        else:
            self._sides = _Measured.pair(matched)
        measured = self._sides[0]
        self.units = {}
        if len(measured.hinges):
            self.units["joints"] = "rad"
        if len(measured.slides):
            self.units["slides"] = "m"
        if len(measured.balls):
            self.units[BALLS] = "rad"
        if measured.tip is not None:
            self.units[self._tip_name] = "m"
        for body in measured.free:
            self.units[self._body(body)] = "m"
            self.units[self._rotation(body)] = "rad"
            if measured.tip is not None:
                self.units[self._in_hand(body)] = "m"
        self._turns = {BALLS, *(self._rotation(body) for body in measured.free)}
        if not self.units:
            raise BadInputError(
                f"nothing can be measured in {model.path.name}: it has no joint"
                + ("" if matched is None else " that the other has, too")
            )

    @property
    def _tip_name(self) -> str:
        tip = self._sides[0].tip
        assert tip is not None
        return self._model.site_names[tip] or f"site {tip}"

    def _body(self, body: int) -> str:
        return self._model.body_names[body] or f"body {body}"

    def _rotation(self, body: int) -> str:
        return f"{self._body(body)}, rotation"

    def _in_hand(self, body: int) -> str:
        return f"{self._body(body)} in the hand"

    def curves(self, trace: Trace, model: Model | None = None, side: int = 0) -> Curves | None:
        """A run at the moments of the ruler; None if it ended before the last of them.

        Args:
            trace: The run.
            model: What its poses are computed with; None for the ruler's own Model.
            side: 0 for a run of the first Model, 1 for one of the second.
        """
        time = trace.time - trace.time[0]
        if trace.header.ended or time[-1] < self.time[-1] - SAME * trace.header.timestep - 1e-9:
            return None
        qpos = _rows(time, trace.qpos, self.time, trace.header.timestep)
        measured, found = self._sides[side], dict[str, Array]()
        if len(measured.hinges):
            found["joints"] = qpos[:, measured.hinges]
        if len(measured.slides):
            found["slides"] = qpos[:, measured.slides]
        if len(measured.balls):
            found[BALLS] = qpos[:, measured.balls]
        for body, places in zip(self._sides[0].free, measured.turned, strict=True):
            found[self._rotation(body)] = qpos[:, places]
        if measured.tip is None and not len(measured.free):
            return Curves(found)
        try:
            found |= self._poses(qpos, model or self._model, measured)
        except DivergedError:
            return None
        return Curves(found)

    def _poses(self, qpos: Array, model: Model, measured: _Measured) -> dict[str, Array]:
        tip = measured.tip
        sites, turns, bodies = [], [], []
        with make_data(model) as data:
            for row in qpos:
                data.qpos = row
                forward(model, data)
                bodies.append(data.xpos[measured.free].copy())
                if tip is not None:
                    sites.append(data.site_xpos[tip].copy())
                    turns.append(data.site_xmat[tip].reshape(3, 3).copy())
        where = np.array(bodies)
        found = {}
        if tip is not None:
            found[self._tip_name] = np.array(sites)
        for k, body in enumerate(self._sides[0].free):
            found[self._body(body)] = where[:, k]
            if tip is not None:  # along the axes of the hand
                apart = where[:, k] - np.array(sites)
                found[self._in_hand(body)] = np.einsum("nij,ni->nj", np.array(turns), apart)
        return found

    def held(self, trace: Trace, touching: frozenset[str]) -> str:
        """The quantity that an experiment is about: what is in the hand, else the joints."""
        for body in self._sides[0].free:
            name = self._in_hand(body)
            if self._body(body) in touching and name in self.units:
                return name
        return next(iter(self.units))

    def tolerance(self, quantity: str) -> float:
        """What a gap has to be above to matter; of a place, that of a body."""
        turn = BODY_TURN if quantity in self._turns else BODY
        return {"joints": COUNT, BALLS: COUNT, "slides": SLIDE}.get(quantity, turn)

    def distances(self, quantity: str, one: Curves, two: Curves) -> Array:
        """(n,) how far apart: the worst joint, or the length of the way between."""
        if quantity in self._turns:
            quats = one.of[quantity], two.of[quantity]
            a, b = (array.reshape(len(array), -1, 4) for array in quats)
            chord = np.minimum(*(np.linalg.norm(a + sign * b, axis=2) for sign in (-1, 1)))
            return 4 * np.arcsin(np.minimum(chord / 2, 1.0)).max(axis=1)
        apart = one.of[quantity] - two.of[quantity]
        if quantity in ("joints", "slides"):
            return np.abs(apart).max(axis=1)
        return np.sqrt((apart**2).sum(axis=1))

    def gap(self, quantity: str, one: Curves, two: Curves) -> Deviation:
        """In one quantity."""
        far = self.distances(quantity, one, two)
        worst, row = largest(far)
        return Deviation(
            unit=self.units[quantity],
            worst=worst,
            at=float(self.time[row]),
            rms=float(np.sqrt((far**2).mean())),
            end=float(far[-1]),
        )

    def gaps(self, one: Curves, two: Curves) -> dict[str, Deviation]:
        """In every quantity."""
        return {name: self.gap(name, one, two) for name in self.units}

    def floor(self, run: Curves, perturbed: Iterable[Curves | None]) -> dict[str, Deviation]:
        """The chaos floor of every quantity: a gap that is no larger says nothing.

        Args:
            run: The side as it comes.
            perturbed: The same side from `perturbed_runs`; None, which leaves no bound, for a run
                that ended early.

        Returns:
            Of each figure the largest that a perturbed run has to `run`.
        """
        found = {name: Deviation(unit, 0.0, 0.0, 0.0, 0.0) for name, unit in self.units.items()}
        for curves in perturbed:
            for name, most in found.items():
                gap = (
                    Deviation(most.unit, np.inf, 0.0, np.inf, np.inf)
                    if curves is None
                    else self.gap(name, run, curves)
                )
                found[name] = Deviation(
                    unit=most.unit,
                    worst=max(most.worst, gap.worst),
                    at=gap.at if gap.worst > most.worst else most.at,
                    rms=max(most.rms, gap.rms),
                    end=max(most.end, gap.end),
                )
        return found


def _rows(time: Array, values: Array, wanted: Array, timestep: float) -> Array:
    """Rows at moments: of the run itself where it has them, else between two of them."""
    near = nearest(time, wanted)
    found = values[near].copy()
    off = np.flatnonzero(np.abs(time[near] - wanted) > SAME * timestep + 1e-9)
    if len(off):
        found[off] = np.column_stack([np.interp(wanted[off], time, column) for column in values.T])
    return found
