"""How far apart two runs are, in one number for each quantity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...drawing.scene import posed
from ...errors import BadInputError, DivergedError, TraceError
from ...interface import Array, JointType, Model, usual_site
from ...measures import (
    QUANTITIES,
    SAME,
    Deviation,
    JointPlaces,
    at_moments,
    common_moments,
    distances,
    farthest,
    turns,
)
from ...page import Figures
from ...runs import Trace
from ..matching import Matched
from ..series import SCALARS

BALLS = "ball joints"
# One run, as the quantities that runs are compared by: for each moment k numbers (n, k), in the
# unit of the quantity.
Curves = dict[str, Array]


class Ruler:
    """What all runs of one attribution are measured by: the same moments and quantities.

    Attributes:
        time: (n,) moments since the start [s].
        between: Whether rows had to be interpolated, for want of common moments.
        units: Unit of each quantity.
    """

    def __init__(
        self, matched: Matched, left: Trace, right: Trace, quantity: str | None = None
    ) -> None:
        """Of two runs as they come.

        Args:
            matched: What of the one Model is what of the other. Poses are computed with the
                first, unless `curves` is given another.
            left: A run of the first Model.
            right: One of the second.
            quantity: A joint that is measured beside all of them, hinge or slide, as on the left.
        """
        try:
            self.between = False
            self.time = common_moments(left.time, right.time, (left.timestep, right.timestep)).time
        except TraceError:  # too few: rows of the second are made up between its own
            time, end = left.time - left.time[0], right.time[-1] - right.time[0]
            self.between, self.time = True, time[time <= end + SAME * left.header.timestep]
        self._model = model = matched.left
        joints, models = np.array(matched.joints, np.int64).reshape(-1, 2).T, (model, matched.right)
        tip = usual_site([model.site_names[a] for a, _ in matched.sites])
        self._tips = (None, None) if tip is None else matched.sites[tip]
        self._places = [
            JointPlaces.of(m.jnt_type[j], m.jnt_qposadr[j])
            for m, j in zip(models, joints, strict=True)
        ]
        self._bodies = [
            m.jnt_bodyid[j[m.jnt_type[j] == int(JointType.FREE)]]
            for m, j in zip(models, joints, strict=True)
        ]
        free = joints[0][model.jnt_type[joints[0]] == int(JointType.FREE)]
        self._names = [left.header.joint_labels[joint] for joint in free]
        tip = self._tips[0]
        self._tip = "" if tip is None else model.site_names[tip] or f"site {tip}"
        # What kind each quantity is of: that says its unit and its tolerance.
        self._kinds = {
            name: kind
            for name, kind, places in (
                ("joints", "joint", self._places[0].hinges),
                ("slides", "slide", self._places[0].slides),
                (BALLS, "joint", self._places[0].balls),
            )
            if len(places)
        }
        self._single: dict[str, tuple[int, int]] = {}
        for a, b in matched.joints:
            name, kind = left.header.joint_labels[a], SCALARS.get(JointType(model.jnt_type[a]))
            if name == quantity and kind:
                self._kinds[name] = kind
                self._single[name] = int(model.jnt_qposadr[a]), int(matched.right.jnt_qposadr[b])
        if self._tip:
            self._kinds[self._tip] = "body"
        for name in self._names:
            self._kinds |= {name: "body", f"{name}, rotation": "body rotation"}
            if self._tip:
                self._kinds[self._relative_to_tip(name)] = "body"
        self.units = {name: QUANTITIES[kind].unit for name, kind in self._kinds.items()}
        if not self.units:
            raise BadInputError(
                f"nothing can be measured in {model.path.name}: it has no joint that the other "
                "has, too"
            )

    def named(self, words: str) -> str:
        """The quantity that a table calls so: "torso rotation", "torso position"."""
        places = {f"{name} position": name for name in self.units}
        known = places | {name.replace(",", ""): name for name in self.units}
        return known.get(words.replace(",", ""), words)

    def curves(self, trace: Trace, model: Model | None = None, side: int = 0) -> Curves | None:
        """A run at the moments of the ruler; None if it ended before the last of them.

        Args:
            trace: The run.
            model: What its poses are computed with; None for the ruler's own Model.
            side: 0 for a run of the first Model, 1 for one of the second.
        """
        time, slack = trace.time - trace.time[0], SAME * trace.header.timestep + 1e-9
        if trace.header.ended or time[-1] < self.time[-1] - slack:
            return None
        qpos, places = at_moments(time, trace.qpos, self.time, slack), self._places[side]
        curves = {
            "joints": qpos[:, places.hinges],
            "slides": qpos[:, places.slides],
            BALLS: qpos[:, places.balls[:, None] + np.arange(4)],
            **{name: qpos[:, [at[side]]] for name, at in self._single.items()},
        }
        for name, start in zip(self._names, places.free, strict=True):
            curves[f"{name}, rotation"] = qpos[:, start + 3 : start + 7]
        if self._tip or self._names:
            try:
                curves |= self._poses(qpos, model or self._model, side)
            except DivergedError:
                return None
        return {name: curves[name] for name in self.units}

    def _poses(self, qpos: Array, model: Model, side: int) -> Curves:
        """Where the tip and the free bodies are, and these in the axes of the tip."""
        tip, rows = self._tips[side], []
        for data in posed(model, qpos):
            site = () if tip is None else (data.site_xpos[tip], data.site_xmat[tip])
            parts = (data.xpos[self._bodies[side]], *site)
            rows.append(np.concatenate([part.ravel() for part in parts]))
        count = len(self._names)
        values = np.array(rows)
        where = values[:, : 3 * count].reshape(len(rows), count, 3)
        curves = {name: where[:, k] for k, name in enumerate(self._names)}
        if tip is not None:
            curves[self._tip] = site = values[:, 3 * count : 3 * count + 3]
            turned = np.ascontiguousarray(values[:, 3 * count + 3 :]).reshape(-1, 3, 3)
            for k, name in enumerate(self._names):
                relative = np.einsum("nij,ni->nj", turned, where[:, k] - site)
                curves[self._relative_to_tip(name)] = relative
        return curves

    def _relative_to_tip(self, body: str) -> str:
        """The quantity that is a free body's place in the axes of the tip."""
        return f"{body} relative to {self._tip}"

    def default_quantity(self, touching: frozenset[str]) -> str:
        """What is measured unless asked: a touched body relative to the tip, else the joints."""
        names = [
            self._relative_to_tip(name) for name in self._names if name in touching and self._tip
        ]
        return next(iter([*names, *self.units]))

    @property
    def coordinates(self) -> list[str]:
        """The quantities that follow from no others, as those that `compare` names first."""
        places = {self._tip, *map(self._relative_to_tip, self._names)}
        return [name for name in self.units if name not in places]

    def tolerance(self, quantity: str) -> float:
        """What a gap has to be above to matter; of a place, that of a body."""
        return QUANTITIES[self._kinds[quantity]].tolerance or 0.0

    def distances(self, quantity: str, left: Curves, right: Curves) -> Array:
        """(n,) how far apart: the worst joint, or the length of the way between."""
        a, b = left[quantity], right[quantity]
        match self._kinds[quantity]:
            case "body":
                return distances(a, b)
            case "body rotation":
                return turns(a, b)
        return turns(a, b).max(axis=1) if quantity == BALLS else farthest(a, b)

    def gap(self, quantity: str, left: Curves, right: Curves) -> Deviation:
        """In one quantity."""
        return Deviation.of(self.distances(quantity, left, right), self.time, self.units[quantity])

    def gaps(self, left: Curves, right: Curves) -> dict[str, Deviation]:
        """In every quantity."""
        return {name: self.gap(name, left, right) for name in self.units}

    def floor(
        self, run: Curves, perturbed: Sequence[Curves | None], measure: str
    ) -> dict[str, float]:
        """Return how far perturbed runs of a side get from it, in every quantity, in its unit.

        Args:
            run: The side as it comes.
            perturbed: The same side from `perturbed_runs`; None, which leaves no bound, for a run
                that ended early.
            measure: Which figure of a Deviation; the largest of a perturbed run counts.
        """
        stood = [curves for curves in perturbed if curves is not None]
        bound = 0.0 if len(stood) == len(perturbed) else np.inf
        return {
            name: max([bound, *(getattr(self.gap(name, run, curves), measure) for curves in stood)])
            for name in self.units
        }


def touched_at_start(trace: Trace, robot: frozenset[str]) -> frozenset[str]:
    """Names of the bodies that some bodies of the robot touch from the start."""
    pairs = [pair.split(" on ") for pair, rows in trace.touches().items() if rows[0]]
    return frozenset(b for pair in pairs for b in pair if not robot.isdisjoint(pair)) - robot


def first_touch(traces: Sequence[Trace], time: Array, apart: Array) -> Figures | None:
    """The first contact of some runs; None where nothing touches, or no engine tells of it.

    Args:
        traces: The runs.
        time: (n,) moments since the start [s].
        apart: (n,) how far apart the runs are there.

    Returns:
        time: Since the start [s]; 0 if something touches from the start.
        what: What touched what.
        before: The gap of the runs as they come, at the moments until then.
        moments: How many these are.
    """
    met = [
        (float(trace.time[rows.argmax()] - trace.time[0]), pair)
        for trace in traces
        for pair, rows in trace.touches().items()
        if rows.any()
    ]
    if not met:
        return None
    when, what = min(met, key=lambda touch: touch[0])
    # A contact found at a moment acts from that moment on: the moment itself is before it. Where
    # something touches at the start no moment shows the rest alone.
    before = apart[(time <= when + 1e-9) & (when > 0)]
    return Figures(time=when, what=what, before=float(before.max(initial=0.0)), moments=len(before))
