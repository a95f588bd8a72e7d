"""How far apart two runs are, in one number for each quantity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import BadInputError, DivergedError, TraceError
from ...interface import Array, Ints, JointType, Model
from ...interface.sites import usual_site
from ...measures import (
    QUANTITIES,
    SAME_MOMENT,
    Deviation,
    JointAddresses,
    at_moments,
    common_moments,
    distances,
    largest_difference,
    rotation_angles,
)
from ...show.drawing.scene import posed
from ..compare.matching import Matched
from ..compare.outcomes import OUTCOMES
from ..compare.series import BASE, SCALARS
from ..recordings import Trace
from ..runs.floating import free_joint_of_robot
from .asked_quantities import ASKED, Curves, curves_asked, further_asked, kinds_asked

BALLS = "ball joints"
Measure = Literal["worst", "end", "rms"]


def size_of(gap: Deviation, measure: Measure) -> float:
    """Return one figure of a gap: the worst at any moment, that of the end, or the rms."""
    if measure == "worst":
        return gap.worst
    if measure == "end":
        return gap.end
    return gap.rms


@dataclass(frozen=True)
class FirstTouch:
    """The first contact of some runs.

    Attributes:
        time: Since the start [s]; 0 if something touches from the start.
        what: What touched what.
        before: The gap of the runs as they come, at the moments until then.
        moments: How many these are.
    """

    time: float
    what: str
    before: float
    moments: int


@dataclass(frozen=True, eq=False)
class _Places:
    """Where one Model has what both sides have.

    Attributes:
        joints: Where in qpos its joints are.
        free_bodies: (n,) ids of the bodies that are free.
        tip: Id of the site that is the tip; None without one.
        base: Where in qpos the pose of the floating base begins; None of a fixed one.
    """

    joints: JointAddresses
    free_bodies: Ints
    tip: int | None
    base: int | None

    @classmethod
    def of(cls, model: Model, joints: Ints, tip: int | None, base: int | None) -> _Places:
        """Find the places.

        Args:
            model: The Model.
            joints: (n,) ids of the joints that both sides have.
            tip: Id of its tip, or None.
            base: Id of the free joint of its base, or None.
        """
        types = model.jnt_type[joints]
        free = joints[types == int(JointType.FREE)]
        return cls(
            joints=JointAddresses.of(types, model.jnt_qposadr[joints]),
            free_bodies=model.jnt_bodyid[free],
            tip=tip,
            base=None if base is None else int(model.jnt_qposadr[base]),
        )


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
        """Take the moments and the quantities of two runs as they come.

        Args:
            matched: What of the one Model is what of the other. Poses are computed with the
                first, unless `curves` is given another.
            left: A run of the first Model.
            right: One of the second.
            quantity: What is measured beside all of them: a joint, hinge or slide, as on the left;
                "base x", "base y", "base z", or an outcome, such as "fell".
        """
        self.time, self.between = _moments_of(left, right)
        self._model = model = matched.left
        joints = np.array(matched.joints, np.int64).reshape(-1, 2).T
        moving, sites = model.moving_sites, [a for a, _ in matched.sites]
        usual_tip = usual_site([model.site_names[a] for a in sites], [moving[a] for a in sites])
        tips = (None, None) if usual_tip is None else matched.sites[usual_tip]
        bases = _bases(matched)
        self._places = (
            _Places.of(model, joints[0], tips[0], bases[0]),
            _Places.of(matched.right, joints[1], tips[1], bases[1]),
        )
        labels = left.header.joint_labels
        free = joints[0][model.jnt_type[joints[0]] == int(JointType.FREE)]
        self._names = [BASE if joint == bases[0] else labels[joint] for joint in free]
        self._tip = "" if tips[0] is None else model.site_names[tips[0]] or f"site {tips[0]}"
        self._kinds = self._kinds_of_joints()
        self._single: dict[str, tuple[int, int]] = {}  # places in qpos of a joint asked for
        for a, b in matched.joints:
            name, kind = labels[a], SCALARS.get(JointType(model.jnt_type[a]))
            if name == quantity and kind:
                self._kinds[name] = kind
                self._single[name] = int(model.jnt_qposadr[a]), int(matched.right.jnt_qposadr[b])
        self._kinds |= self._kinds_of_bodies()
        until = float(self.time[-1])
        self._further = further_asked(left)
        self._kinds |= kinds_asked(quantity, (left, right), until, floats=bases[0] is not None)
        self.units = {name: QUANTITIES[kind].unit for name, kind in self._kinds.items()}
        if not self.units:
            raise BadInputError(
                f"nothing can be measured in {model.path.name}: it has no joint that the other "
                "has, too"
            )

    def _kinds_of_joints(self) -> dict[str, str]:
        """Return the kind of each quantity of all joints: it says the unit and the tolerance."""
        joints = self._places[0].joints
        kinds: dict[str, str] = {}
        if len(joints.hinges):
            kinds["joints"] = "joint"
        if len(joints.slides):
            kinds["slides"] = "slide"
        if len(joints.balls):
            kinds[BALLS] = "joint"
        return kinds

    def _kinds_of_bodies(self) -> dict[str, str]:
        """Return the kind of each quantity of the tip and of the free bodies."""
        kinds: dict[str, str] = {}
        if self._tip:
            kinds[self._tip] = "body"
        for name in self._names:
            kind = "base" if name == BASE and self._places[0].base is not None else "body"
            kinds[name] = kind
            kinds[f"{name}, rotation"] = f"{kind} rotation"
            if self._tip and kind == "body":
                kinds[self._relative_to_tip(name)] = "body"
        return kinds

    @property
    def further_quantities(self) -> tuple[str, ...]:
        """Return what is measured only where it is asked for, of a robot that floats."""
        return () if self._places[0].base is None else self._further

    def quantity_of(self, words: str) -> str:
        """Return the quantity that a table calls so: "torso rotation", "torso position"."""
        places = {f"{name} position": name for name in self.units}
        known = places | {name.replace(",", ""): name for name in self.units}
        return known.get(words.replace(",", ""), words)

    def curves(self, trace: Trace, model: Model | None = None, side: int = 0) -> Curves | None:
        """Return a run at the moments of the ruler; None if it ended before the last of them.

        Args:
            trace: The run.
            model: What its poses are computed with; None for the ruler's own Model.
            side: 0 for a run of the first Model, 1 for one of the second.
        """
        time = trace.time - trace.time[0]
        slack = SAME_MOMENT * trace.header.timestep + 1e-9
        if trace.header.ended or time[-1] < self.time[-1] - slack:
            return None
        qpos = at_moments(time, trace.qpos, self.time, slack)
        curves = self._of_joints(qpos, side)
        if self._tip or self._names:
            try:
                curves |= self._poses(qpos, model or self._model, side)
            except DivergedError:
                return None
        base, until = self._places[side].base, float(self.time[-1])
        curves |= curves_asked(self._kinds, trace, qpos, base, until)
        return {name: curves[name] for name in self.units}

    def _of_joints(self, qpos: Array, side: int) -> Curves:
        """Return what is read from qpos (n, nq) itself."""
        joints = self._places[side].joints
        curves = {
            "joints": qpos[:, joints.hinges],
            "slides": qpos[:, joints.slides],
            BALLS: qpos[:, joints.balls[:, None] + np.arange(4)],
        }
        for name, places in self._single.items():
            curves[name] = qpos[:, [places[side]]]
        for name, start in zip(self._names, joints.free, strict=True):
            curves[f"{name}, rotation"] = qpos[:, start + 3 : start + 7]
        return curves

    def _poses(self, qpos: Array, model: Model, side: int) -> Curves:
        """Return where the tip and the free bodies are, and these in the axes of the tip."""
        tip, bodies = self._places[side].tip, self._places[side].free_bodies
        rows: list[Array] = []
        for data in posed(model, qpos):
            parts = [data.xpos[bodies].ravel()]
            if tip is not None:
                parts += [data.site_xpos[tip], data.site_xmat[tip].ravel()]
            rows.append(np.concatenate(parts))
        count = len(self._names)
        values = np.array(rows)
        where = values[:, : 3 * count].reshape(len(rows), count, 3)
        curves = {name: where[:, k] for k, name in enumerate(self._names)}
        if tip is not None:
            curves[self._tip] = site = values[:, 3 * count : 3 * count + 3]
            turned = np.ascontiguousarray(values[:, 3 * count + 3 :]).reshape(-1, 3, 3)
            for k, name in enumerate(self._names):
                if self._kinds[name] == "base":
                    continue
                relative = np.einsum("nij,ni->nj", turned, where[:, k] - site)
                curves[self._relative_to_tip(name)] = relative
        return curves

    def _relative_to_tip(self, body: str) -> str:
        """Return the quantity that is a free body's place in the axes of the tip."""
        return f"{body} relative to {self._tip}"

    def default_quantity(self, touching: frozenset[str]) -> str:
        """Return what is measured unless asked.

        It is the place of the base of a robot that floats; else a body that is touched, relative to
        the tip; else the joints.
        """
        if self._places[0].base is not None:
            return BASE
        if self._tip:
            for name in self._names:
                if name in touching:
                    return self._relative_to_tip(name)
        return next(iter(self.units))

    def of_motion(self, quantity: str) -> str:
        """Return the quantity that tells whether anything moves: of an outcome the usual one."""
        return self.default_quantity(frozenset()) if quantity in OUTCOMES else quantity

    @property
    def coordinates(self) -> list[str]:
        """Return the quantities that follow from no others, which `compare` names first, too."""
        places = {self._tip, *map(self._relative_to_tip, self._names)}
        coordinates = [name for name in self.units if name not in places]
        return [name for name in coordinates if name not in ASKED]

    @property
    def of_base(self) -> list[str]:
        """Return the quantities of the pose of the floating base; none where it is fixed."""
        return [name for name in self.coordinates if QUANTITIES[self._kinds[name]].of_base]

    def tolerance(self, quantity: str) -> float:
        """Return what a gap has to be above to matter; of a place, that of a body."""
        tolerance = QUANTITIES[self._kinds[quantity]].tolerance
        if tolerance is None:  # of a distance, which is compared with no run here
            tolerance = QUANTITIES["base"].tolerance
        return tolerance or 0.0

    def distances(self, quantity: str, left: Curves, right: Curves) -> Array:
        """Return how far apart (n,): the worst joint, or the length of the way between."""
        a, b = left[quantity], right[quantity]
        match self._kinds[quantity]:
            case "body" | "base":
                return distances(a, b)
            case "body rotation" | "base rotation":
                return rotation_angles(a, b)
        if quantity == BALLS:
            return rotation_angles(a, b).max(axis=1)
        return largest_difference(a, b)

    def gap(self, quantity: str, left: Curves, right: Curves) -> Deviation:
        """Return how far apart two runs are in one quantity."""
        return Deviation.of(self.distances(quantity, left, right), self.time, self.units[quantity])

    def gaps(self, left: Curves, right: Curves) -> dict[str, Deviation]:
        """Return how far apart two runs are in every quantity."""
        return {name: self.gap(name, left, right) for name in self.units}

    def floor(
        self, run: Curves, perturbed: Sequence[Curves | None], measure: Measure
    ) -> dict[str, float]:
        """Return how far perturbed runs of a side get from it, in every quantity, in its unit.

        Args:
            run: The side as it comes.
            perturbed: The same side from `perturbed_runs`; None, which leaves no bound, for a run
                that ended early.
            measure: Which figure of a Deviation; the largest of a perturbed run counts.
        """
        completed = [curves for curves in perturbed if curves is not None]
        bound = 0.0 if len(completed) == len(perturbed) else np.inf
        floors: dict[str, float] = {}
        for name in self.units:
            sizes = [size_of(self.gap(name, run, curves), measure) for curves in completed]
            floors[name] = max([bound, *sizes])
        return floors


def _bases(matched: Matched) -> tuple[int, int] | tuple[None, None]:
    """Return the free joints of the bases of both robots, where they are counterparts."""
    left, right = free_joint_of_robot(matched.left), free_joint_of_robot(matched.right)
    if left is None or right is None or (left, right) not in matched.joints:
        return None, None
    return left, right


def _moments_of(left: Trace, right: Trace) -> tuple[Array, bool]:
    """Return the moments (n,) of two runs since their start [s], and whether they are made up.

    Where the runs have too few moments in common, they are those of the left: rows of the right
    are interpolated there.
    """
    try:
        common = common_moments(left.time, right.time, (left.timestep, right.timestep))
        return common.time, False
    except TraceError:
        time, end = left.time - left.time[0], right.time[-1] - right.time[0]
        return time[time <= end + SAME_MOMENT * left.header.timestep], True


def touched_at_start(trace: Trace, robot: frozenset[str]) -> frozenset[str]:
    """Return the names of the bodies that some bodies of the robot touch from the start."""
    touched: set[str] = set()
    for words, rows in trace.touches().items():
        pair = words.split(" on ")
        if rows[0] and not robot.isdisjoint(pair):
            touched.update(pair)
    return frozenset(touched) - robot


def first_touch(traces: Sequence[Trace], time: Array, gap: Array) -> FirstTouch | None:
    """Find the first contact of some runs; None where nothing touches, or no engine tells of it.

    Args:
        traces: The runs.
        time: (n,) moments since the start [s].
        gap: (n,) how far apart the runs are there.
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
    before = gap[(time <= when + 1e-9) & (when > 0)]
    return FirstTouch(when, what, float(before.max(initial=0.0)), len(before))
