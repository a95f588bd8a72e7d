"""How each side is run with some causes equalized: its Model, its start, its commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...engines import raw_engine_of
from ...engines.records import Edit, ModelDifference, SpecEdit
from ...installed import DEFAULT
from ...interface import Model
from ..compare.alike import commands_alike, controller_for_right, translated
from ..compare.matching import Matched
from ..recordings import (
    Rerun,
    SideStart,
    Trace,
    controller_of_trace,
    start_of,
    start_of_scenario,
    with_first_ctrl,
)
from ..runs.scenarios import Controller
from .causes import EXTRA_ACTUATOR, Cause, built, causes, differences_of
from .imported import with_imported_figures
from .option_differences import differences_by_option, options_that_equalize
from .order import in_order_of_left, seen_in_order_of_left, slots_of_ctrl, sorted_by_number
from .request import WhyRequest
from .run_differences import (
    COMMANDS,
    ORDER,
    ORDER_OF_MOCAP,
    ORDER_OF_QPOS,
    START,
    of_the_run,
    orders_of,
)
from .settings import ENGINE_CAN_BE_WITHOUT, NEEDS, TITLES, Feature, OwnSettings, leave_out
from .stiff_servos import needs_of_limits

NONE = frozenset[str]()


@dataclass(frozen=True)
class RunKey:
    """What makes one run.

    Attributes:
        side: 0 or 1.
        equalized: Names of the causes that are equalized, as far as they change this side.
        without: Names of the features that are left out.
        integrator: Another one than the file's; "" for that.
        imported: Whether the installed MuJoCo runs the figures that the import of the side made;
            nothing is equalized then.
    """

    side: int
    equalized: frozenset[str] = NONE
    without: frozenset[str] = NONE
    integrator: str = ""
    imported: bool = False


class Setup:
    """Two sides, and how they are run with some of their causes equalized.

    Attributes:
        models: Both with the options of the scenario; the second is brought to the first.
        matched: What of one is what of the other.
        scenario: What is run, as it is on the first.
        seconds: Simulated time.
        seed: Of what the scenario draws.
    """

    def __init__(self, request: WhyRequest, matched: Matched) -> None:
        """Find where both sides start, and what they have in an engine's own way.

        Args:
            request: The question; its scenario is as it is on the left.
            matched: What of the left is what of the right.
        """
        options = dict(request.scenario.options)
        self._own_settings = _own_settings((request.left, request.right), options)
        left, right = request.left, request.right
        if options:
            left, right = left.replace(**options), right.replace(**options)
        self.models, self.matched, self.scenario = (left, right), matched, request.scenario
        self.seconds, self.seed = request.duration, request.seed
        self._keyframes = _keyframes(request.scenario.keyframe, right)
        left_start = start_of(left, self._keyframes[0])
        right_start = start_of(right, self._keyframes[1])
        self._recordings = self._recorded(request.recordings, right_start)
        if self._recordings:
            left_start, right_start = (_start_of_trace(trace) for trace in self._recordings)
        elif (start := start_of_scenario(self.scenario, left)) is not None:
            left_start, right_start = start, matched.start(start, right_start)
        elif self._keyframes[0] != self._keyframes[1]:
            right_start = matched.start(left_start, right_start)
        self._starts = left_start, right_start
        self._periods_differ = request.periods is not None and request.periods.differ
        self._causes: dict[str, Cause] = {}
        self._by_option = NONE  # names of the causes that are equalized by `Model.replace`

    def _recorded(
        self, recordings: Sequence[Trace], start: SideStart
    ) -> tuple[Trace, Trace] | None:
        """Return the runs that each side is commanded by; None without recordings."""
        if not recordings:
            return None
        if len(recordings) > 1:
            return recordings[0], recordings[1]
        return recordings[0], translated(recordings[0], self.matched, start)

    def causes(self, finer: bool) -> tuple[Cause, ...]:
        """Return all that can be a cause: of the files, of an engine's own settings, of the run.

        Args:
            finer: Differences of files by their single entries, each by itself.
        """
        has_own_settings = any(self._own_settings)
        by_option = (
            []
            if has_own_settings
            else list(differences_by_option(*self.models, self._periods_differ))
        )
        self._by_option = frozenset(row.subject for row in by_option)
        rows = [*self._differences_of_files(finer), *self._difference_of_commands()]
        for side, settings in enumerate(self._own_settings):
            if settings:
                rows += settings.differences(side)
        rows += by_option
        is_by_number = self.scenario.is_user_function and not self.scenario.is_policy
        if is_by_number and not self._recordings:
            rows += orders_of(self.matched)
        all_causes = causes(rows, finer)
        self._causes = {cause.name: cause for cause in all_causes}
        return all_causes

    def _differences_of_files(self, finer: bool) -> list[ModelDifference]:
        """Return what compiled models differ in, and where the runs start."""
        left, right = self.models
        if left.compiled is None or right.compiled is None:
            return []
        elsewhere = ["timestep"]  # it is equalized by an option
        if len(self.selects) == 1:
            # An integrator that one side does not read is chosen on the other, see `locate`.
            elsewhere.append("integrator")
        rows = differences_of(
            left,
            right,
            self.matched,
            world=not any(self._own_settings),
            finer=finer,
            readable=self.scenario.is_user_function,
        )
        return [
            *(row for row in rows if row.subject not in elsewhere),
            *of_the_run(self.matched, self._starts, self._keyframes[1]),
        ]

    def _difference_of_commands(self) -> list[ModelDifference]:
        """Return that the recorded commands differ, if they do."""
        if not self._recordings:
            return []
        left, right = self._recordings
        if commands_alike(translated(left, self.matched, self._starts[1]), right):
            return []
        return [ModelDifference(COMMANDS, "run", "", ())]

    @property
    def needs(self) -> dict[str, str]:
        """Return for a cause the one that has to be equalized before it."""
        if not any(self._own_settings):
            integrators = self.integrator_of(0), self.integrator_of(1)
            return needs_of_limits(self._causes.values(), self.models[1], integrators)
        known = self._causes.keys()
        return {cause: needed for cause, needed in NEEDS.items() if {cause, needed} <= known}

    @property
    def selects(self) -> tuple[int, ...]:
        """Return the sides, 0 and 1, that have integrators to choose from."""
        return tuple(k for k in (0, 1) if self.models[k].capabilities.integrators)

    @property
    def integrators(self) -> list[str]:
        """Return the integrators that are on every side which has several, sorted."""
        choices = [set(self.models[side].capabilities.integrators) for side in self.selects]
        return sorted(set[str].intersection(*choices)) if choices else []

    def integrator_of(self, side: int) -> str:
        """Return what a side integrates with as it comes."""
        model = self.models[side]
        if side in self.selects and model.compiled is not None:
            return raw_engine_of(DEFAULT).integrator(model.compiled)
        return "its own"

    def can_be_without(self, feature: Feature) -> bool:
        """Tell whether a feature can be left out on both sides.

        What the scenario itself sets cannot.
        """
        if feature.option in self.scenario.options:
            return False
        for settings, model in zip(self._own_settings, self.models, strict=True):
            if settings and feature.name not in ENGINE_CAN_BE_WITHOUT:
                return False
            if not settings and feature.option not in model.capabilities.options:
                return False
        return True

    def runs_of(
        self, equalized: frozenset[str], without: frozenset[str] = NONE, integrator: str = ""
    ) -> tuple[RunKey, RunKey]:
        """Return the runs of both sides.

        Args:
            equalized: Causes that are equalized.
            without: Features that are left out on both sides.
            integrator: Another one, on the sides that have several.
        """
        left, right = (
            RunKey(
                side,
                self._acting(side, equalized),
                without,
                integrator if side in self.selects else "",
            )
            for side in (0, 1)
        )
        return left, right

    def _acting(self, side: int, equalized: frozenset[str]) -> frozenset[str]:
        """Return the causes that change this side."""
        return frozenset(name for name in equalized if self._acts_on(side, self._causes[name]))

    def _acts_on(self, side: int, cause: Cause) -> bool:
        """Tell whether a side is changed where a cause is equalized."""
        if cause.edits(side) or cause.spec_edits(side):
            return True
        if cause.kind == "engine" and self._own_settings[side]:
            return True
        if side == 0:
            return False
        return cause.name in self._by_option or cause.kind == "run" or self._is_in_ctrl(cause)

    def _is_in_ctrl(self, cause: Cause) -> bool:
        """Tell whether a cause moves the numbers of ctrl that a function of the user's writes."""
        is_by_number = self.scenario.is_user_function and not self.scenario.is_policy
        return is_by_number and _has_extra_actuator(cause)

    def model(self, run: RunKey) -> Model:
        """Return the Model of a run.

        Raises:
            StateMachineError: It cannot be made.
        """
        if run.imported:
            figures = with_imported_figures(self.models[run.side], self.models[1 - run.side])
            return leave_out(figures, run.without)
        own_settings = self._own_settings[run.side]
        edits: list[Edit] = []
        spec_edits: list[SpecEdit] = []
        for name in sorted(run.equalized):
            edits += self._causes[name].edits(run.side)
            spec_edits += self._causes[name].spec_edits(run.side)
        model = built(self.models[run.side], tuple(edits), tuple(spec_edits))
        if run.side and not own_settings:
            options = options_that_equalize(run.equalized & self._by_option, self.models[0])
            model = model.replace(**options) if options else model
        if run.integrator:
            model = model.replace(integrator=run.integrator)
        settings = self._settings_in(run.equalized)
        if own_settings and (settings or run.without):
            emulated = built(own_settings.emulated, tuple(edits), tuple(spec_edits))
            return own_settings.build(model, emulated, settings, run.without)
        return leave_out(model, run.without)

    def _settings_in(self, equalized: frozenset[str]) -> frozenset[str]:
        """Return the settings of an engine as it comes that are among some causes."""
        return frozenset(
            setting
            for setting, title in TITLES.items()
            if title in equalized and self._causes[title].kind == "engine"
        )

    def rerun(self, run: RunKey, model: Model) -> Rerun:
        """Return how a Model of `model` is run."""
        start = self._starts[run.side]
        qpos, qvel = start.qpos, start.qvel
        if START in run.equalized:
            left_start = self._starts[0]
            qpos = self.matched.to_right("qpos", left_start.qpos, qpos)
            qvel = self.matched.to_right("qvel", left_start.qvel, qvel)
        return Rerun(
            model,
            lambda model: self._controller(run.side, model, run.equalized),
            self.seconds,
            keyframe=self._keyframes[run.side],
            qpos=qpos,
            qvel=qvel,
            experiment=self.scenario.name,
        )

    def _controller(self, side: int, model: Model, equalized: frozenset[str]) -> Controller:
        """Return what commands a side.

        A function of the user's answers each side. What an experiment commands is the left's: that
        of the left as it comes, whatever is edited.
        """
        is_user_function = self.scenario.is_user_function
        if is_user_function and side and not self._recordings:
            return self._own_controller(model, equalized)
        if self._recordings:
            if side and COMMANDS not in equalized:
                return controller_of_trace(self._recordings[1])
            controller = controller_of_trace(
                self._recordings[0]
            )  # in the order of the left's actuators
        else:
            controller = self.scenario.controller(
                model if is_user_function else self.models[0], self.seed
            )
        if side == 0:
            return controller
        start = self._starts[1].ctrl
        return self._from_start(controller_for_right(controller, self.matched, start))

    def _own_controller(self, model: Model, equalized: frozenset[str]) -> Controller:
        """Return a function of the user's on the right, as far as that has the order of the left.

        An actuator that only one side has is put back, or taken out, in its place of ctrl: the
        numbers of the others are then those of the left.
        """
        if self.scenario.is_policy:  # it finds what it reads and commands by names
            return self._from_start(self.scenario.controller(model, self.seed))
        matched = self.matched
        completed = any(_has_extra_actuator(self._causes[name]) for name in equalized)
        ordered = ORDER in equalized
        mocap_in_order = ORDER_OF_MOCAP in equalized
        if not (ordered or completed or mocap_in_order or ORDER_OF_QPOS in equalized):
            return self._from_start(self.scenario.controller(model, self.seed))
        slots = slots_of_ctrl(matched, ordered=ordered, completed=completed)
        reads_in_order = ORDER_OF_QPOS in equalized or not matched.joints_elsewhere
        if not reads_in_order or model.compiled is None:
            controller = self.scenario.controller(model, self.seed)
            return self._from_start(sorted_by_number(controller, slots, self._starts[1].ctrl))
        left = self.model(RunKey(0, self._acting(0, equalized)))
        controller = seen_in_order_of_left(
            lambda shown: self.scenario.controller(shown, self.seed),
            in_order_of_left(left, model, matched),
            matched,
            slots,
            (self._starts[0].ctrl, self._starts[1].ctrl),
            mocap_in_order=mocap_in_order,
        )
        return self._from_start(controller)

    def _from_start(self, controller: Controller) -> Controller:
        """Return a controller of the right.

        Without a keyframe of its own it starts with the commands of the left, too.
        """
        if self._keyframes[0] == self._keyframes[1]:
            return controller
        start = self._starts[1].ctrl
        return with_first_ctrl(lambda _: start, controller)


def _keyframes(
    keyframe: int | str | None, right: Model
) -> tuple[int | str | None, int | str | None]:
    """Return where each side starts; the right, if it has no such keyframe, where the left does."""
    known = keyframe is None or keyframe in [frame.name for frame in right.keyframes]
    return keyframe, keyframe if known else None


def _start_of_trace(trace: Trace) -> SideStart:
    return SideStart(trace.qpos[0], trace.qvel[0], trace.ctrl[0])


def _has_extra_actuator(cause: Cause) -> bool:
    return any(row.subject == EXTRA_ACTUATOR for row in cause.differences)


def _own_settings(
    models: tuple[Model, Model], options: dict[str, Any]
) -> tuple[OwnSettings | None, OwnSettings | None]:
    """Return the settings of each side that comes with its engine's, where the other does not."""
    left, right = models
    left_dials = raw_engine_of(left.backend).dials(left, options)
    right_dials = raw_engine_of(right.backend).dials(right, options)
    actuated = options.get("actuation", True)
    if left_dials and not right_dials:
        return OwnSettings(left_dials, right.replace(**options), actuated), None
    if right_dials and not left_dials:
        return None, OwnSettings(right_dials, left.replace(**options), actuated)
    return None, None
