"""What to compare, as it was asked for: what is run, and the sides that it is run on.

A side is a file, an engine, its defaults, and options.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from ...backends import BackendChoice, load_to_run, parse_backend
from ...engines import raw_engine_of
from ...errors import BadInputError, shown
from ...installed import DEFAULT, PAIR
from ...interface import Model
from ...interface.free_base import FreeBase
from ...interface.options import OptionValue
from ...interface.read_options import non_default_options
from ...interface.records import READ_OPTIONS
from ...measures.text import listed
from ...models import resolve
from ..policy.scenario import check_contract, policy_scenario
from ..recordings import Trace
from ..runs.call_period import CallPeriods, Every, call_periods, checked_every
from ..runs.controllers import function_scenario, is_function, is_policy
from ..runs.scenarios import Scenario, scenario
from .labels import numbered, typed_option
from .matching import match_models
from .what import What, is_trace, trace_of, without_folders, word_of


@dataclass(frozen=True)
class Side:
    """What one side of a comparison is.

    Attributes:
        model: A name or a path, as `load` takes it.
        engine: The backend to run it on.
        defaults: "model", or "engine" for the engine as its own users meet it.
        options: As `load` takes them: those of `Model.replace`, base,
            balance_inertia, meshes.
        menagerie: A menagerie folder to look the name up in.
        replaced_parts: Parts of another side's file that stand in place of its own.
        loaded: The Model that all of the above is of, where somebody loaded it, and perhaps changed
            it since; None where it is still to be loaded.
    """

    model: str
    engine: str = DEFAULT
    defaults: Literal["model", "engine"] = "model"
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    menagerie: str | None = None
    replaced_parts: ReplacedParts | None = None
    loaded: Model | None = field(default=None, repr=False, metadata={"json": False})

    @classmethod
    def of_model(cls, model: Model) -> Side:
        """Return a side that is a Model as it is."""
        options = {**non_default_options(model.read_options), **model.options}
        return cls(str(model.path), model.backend, model.defaults, options, loaded=model)

    def to_be_loaded(self) -> Side:
        """Return the same side without the Model that was loaded of it."""
        return replace(self, loaded=None)

    def chosen_backend(self) -> BackendChoice:
        """Return the engine and its defaults, as one types them behind --backend."""
        return BackendChoice(self.engine, self.defaults)

    @property
    def path(self) -> Path:
        """Return the path of its model file; raises as `models.resolve` does."""
        if self.loaded is not None:
            return self.loaded.path
        return resolve(self.model, self.menagerie)

    @property
    def label(self) -> str:
        """Return the side as one types it, without folders: "so101@mujoco timestep=0.002"."""
        options = (typed_option(name, value) for name, value in self.options.items())
        return " ".join([f"{without_folders(self.model)}@{self.chosen_backend()}", *options])

    def load(self, base: OptionValue | FreeBase | None = None, **options: OptionValue) -> Model:
        """Return the Model; `options` are those of an experiment, over which its own win.

        Args:
            base: That of the robot where neither says it, as `load` takes it.
            **options: As `load` takes them.

        Raises:
            StateMachineError: As `load` does.
        """
        all_options: dict[str, OptionValue | FreeBase] = {**options, **self.options}
        if base is not None:
            all_options.setdefault("base", base)
        if self.loaded is not None:
            return self._from_loaded(self.loaded, all_options)
        load_it = partial(self.chosen_backend().load_to_run, self.model, menagerie=self.menagerie)
        if self.replaced_parts is None:
            return load_it(**all_options)
        read = {name: all_options.pop(name) for name in READ_OPTIONS if name in all_options}
        model = self.replaced_parts.apply_to(load_it(**read))
        return model.replace(**all_options) if all_options else model

    def _from_loaded(self, model: Model, all_options: dict[str, OptionValue | FreeBase]) -> Model:
        """Return a loaded Model with the options that it does not have yet."""
        if self.replaced_parts is not None:
            model = self.replaced_parts.apply_to(model)  # all else is as its file has it
        else:
            all_options = {
                name: all_options[name]
                for name in all_options
                if not _has(model, name, all_options[name])
            }
        return model.replace(**all_options) if all_options else model

    def taking(self, parts: Sequence[str], of: Side, names: Mapping[str, str]) -> Side:
        """Return the side with some parts of another's file; `names` as of `ReplacedParts`."""
        return (
            replace(self, replaced_parts=ReplacedParts(tuple(parts), of, names)) if parts else self
        )


def _has(model: Model, name: str, value: OptionValue | FreeBase) -> bool:
    """Tell whether a Model was told a value of an option already."""
    return name in model.options and np.array_equal(model.options[name], np.asarray(value))


@dataclass(frozen=True)
class ReplacedParts:
    """Parts of a file that another file gets instead of its own.

    Attributes:
        parts: "actuators", "floor": the planes that are fixed to the world.
        source: The side whose file has them.
        names: Joints, bodies and sites of `source` that go by other names in the file that gets
            them.
    """

    parts: tuple[str, ...]
    source: Side
    names: Mapping[str, str] = field(default_factory=dict)

    def apply_to(self, model: Model) -> Model:
        """Return a Model of the same engine and file that has the parts of the other file.

        Raises:
            StateMachineError: It cannot be made.
        """
        source_model = load_to_run(self.source.model, menagerie=self.source.menagerie)
        matched = match_models(source_model, model, self.names)
        names = {
            "joint": _renamed(source_model.joint_names, model.joint_names, matched.joints),
            "body": _renamed(source_model.body_names, model.body_names, matched.bodies),
            "site": _renamed(source_model.site_names, model.site_names, matched.sites),
        }
        given = model.with_compiled(
            raw_engine_of(DEFAULT).with_parts(
                model.path, source_model.path, self.parts, names, model.read_options
            )
        )
        # An engine as it comes has not the gravity and the timestep of the file.
        own: dict[str, OptionValue] = {}
        for name in ("gravity", "timestep"):
            if not np.array_equal(getattr(given, name), getattr(model, name)):
                own[name] = getattr(model, name)
        return given.replace(**own) if own else given


def _renamed(
    left_names: Sequence[str], right_names: Sequence[str], pairs: Iterable[tuple[int, int]]
) -> dict[str, str]:
    """Return by what other name each thing goes that has a counterpart."""
    return {left_names[left_id]: right_names[right_id] for left_id, right_id in pairs}


def with_options(
    sides: Sequence[Side], options: Mapping[str, OptionValue]
) -> tuple[list[Side], dict[str, OptionValue]]:
    """Return sides with the options that only they have, and those of `Model.replace` of both.

    Args:
        sides: Two.
        options: Of what is run; those of a side win.
    """
    left, right = ({**options, **side.options} for side in sides)
    both = {
        name: left[name]
        for name in left
        if name in right and np.array_equal(left[name], right[name]) and name not in READ_OPTIONS
    }
    return [_without(sides[0], left, both), _without(sides[1], right, both)], both


def _without(
    side: Side, options: Mapping[str, OptionValue], common: Mapping[str, OptionValue]
) -> Side:
    """Return a side with those of some options that are not among the common ones."""
    side_options = {name: value for name, value in options.items() if name not in common}
    return replace(side, options=side_options)


@dataclass(frozen=True)
class Request:
    """What to compare.

    Attributes:
        what: One experiment by name, one "FILE.py:FUNCTION" or function (model, data) itself, the
            ONNX file of one policy, or one or two traces or their files.
        backends: The two backends, as `parse_backend` reads them; of one trace the one that is
            not its own is taken.
        model: Instead of the experiment's own, or a trace's.
        menagerie: Where its name is looked up.
        seconds: Instead of the experiment's own time [s].
        seed: Of an experiment that draws something.
        options: For `Model.replace`, on both sides.
        sides: The two sides, instead of backends and model; empty for those.
        names: Joints, bodies, sites and actuators of the left that go by other names on the
            right.
        every: Steps for which what a FUNCTION returns holds, or a time such as "5ms".
        keyframe: Where it starts; None for the experiment's own, a FUNCTION's default state, and
            the keyframe "home" of a policy.
        contract: What a policy expects of the simulator: a YAML file; None of anything else.
        command: Speeds that a policy is asked for, vx, vy [m/s], wz [rad/s]; None for straight on.
    """

    what: Sequence[What]
    backends: tuple[str, str] = PAIR
    model: str | None = None
    menagerie: str | None = None
    seconds: float | None = None
    seed: int = 0
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    sides: tuple[Side, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    every: Every = 1
    keyframe: str | None = None
    contract: str | None = None
    command: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if len(self.backends) != 2:
            raise BadInputError(f"two backends are compared; got {shown(self.backends)}")
        checked_every(self.every)
        check_contract([word_of(what) for what in self.what], self.contract, self.command)
        if self.is_policy and self.every != 1:
            raise BadInputError(
                f"every is of a function: how often {self.experiment} is called its contract says"
            )

    @property
    def is_traces(self) -> bool:
        """Tell whether traces were named, not an experiment."""
        return any(isinstance(what, Trace) or is_trace(what) for what in self.what)

    @property
    def is_policy(self) -> bool:
        """Tell whether a policy is run."""
        return len(self.what) == 1 and is_policy(self.what[0])

    def traces(self) -> list[Trace]:
        """Return the traces, read from their files.

        Raises:
            TraceError: A file is not a trace.
        """
        return [trace_of(what) for what in self.what]

    def trace_file(self, place: int) -> str | None:
        """Return the file of a trace, by its place; None of one that was handed over itself."""
        what = self.what[place]
        return what if isinstance(what, str) else None

    @property
    def words(self) -> list[str]:
        """Return what is run, and the model if one is named, as one types them, without folders."""
        words = [word_of(what) for what in self.what]
        if self.model:
            words.append(without_folders(self.model))
        return words

    @property
    def experiment(self) -> str:
        """Return in a word what is run: an experiment, a function, or the file of a trace."""
        return word_of(self.what[0])

    @property
    def is_typed(self) -> bool:
        """Tell whether a command line can ask it: no function, trace or Model is an object."""
        words = all(isinstance(what, str) for what in self.what)
        return words and all(side.loaded is None for side in self.sides)

    @property
    def labels(self) -> tuple[str, str]:
        """Return the labels of both sides; where no sides are named, those of the backends."""
        if self.sides:
            left, right = self.sides
            return numbered((left.label, right.label))
        return numbered(self.backends)

    @property
    def notes_on_parts(self) -> tuple[str, ...]:
        """Return a line for each side that has parts of the other's file."""
        names = (("left", "right"), ("right", "left"))
        return tuple(
            f"the {name} has the {listed(side.replaced_parts.parts)} of the {other}, not its own"
            for side, (name, other) in zip(self.sides, names, strict=False)
            if side.replaced_parts
        )

    def call_periods(self, timesteps: tuple[float, float]) -> CallPeriods | None:
        """Return how often a function is called on each side; None where none is run.

        Args:
            timesteps: Of the left and of the right [s].

        Raises:
            BadInputError: A time is not a whole number of steps of a side.
        """
        what = self.what[0]
        if len(self.what) != 1 or isinstance(what, Trace) or not is_function(what):
            return None
        return call_periods(self.every, timesteps)

    def both_sides(self, model: str) -> Sequence[Side]:
        """Return the two sides; where none are named, one model on the two backends.

        Args:
            model: The experiment's own, where none was said either.
        """
        if self.sides:
            return self.sides
        backends = [parse_backend(word) for word in self.backends]
        return [
            Side(self.model or model, backend.name, backend.defaults, {}, self.menagerie)
            for backend in backends
        ]

    def scenario(self) -> Scenario:
        """Return the experiment that is run: one of ours, or the user's function or policy.

        Raises:
            UnknownNameError: There is no such experiment.
            BadInputError: There is no such function, or its file fails; a policy does not fit its
                contract; or two things are named.
            MissingEngineError: The extra of policies is not installed.
        """
        if len(self.what) != 1:
            raise BadInputError(
                "compare takes one experiment: it runs on both engines; two traces are files"
            )
        (what,) = self.what
        if isinstance(what, Trace):
            raise BadInputError("a trace is a run that was made: name an experiment or a function")
        if isinstance(what, str) and is_policy(what) and self.contract is not None:
            return policy_scenario(what, self.contract, self.command, self.keyframe, self.names)
        if not isinstance(what, str) or is_function(what):
            return function_scenario(what, self.every, self.keyframe)
        known = scenario(what)
        return replace(known, keyframe=self.keyframe or known.keyframe)
