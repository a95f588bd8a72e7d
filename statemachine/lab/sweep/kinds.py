"""What a name behind `--vary` stands for: an option of the robot or a parameter of the function."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import BadInputError, UnknownNameError, did_you_mean, shown
from ...interface import Model
from ...interface.records import READ_OPTIONS
from ...measures.text import listed
from .design import MODEL, STATES, Kind, Vary

_SERVO_GAINS = ("kp", "kv")
# Options with one number for each element of a kind: its attribute of `Model`, and its name.
_ELEMENTS = {
    "armature": ("nv", "joints"),
    "damping": ("nv", "joints"),
    "frictionloss": ("nv", "joints"),
    "limits": ("nv", "joints"),
    "max_qvel": ("nv", "joints"),
    "friction": ("ngeom", "geoms"),
    "actuation": ("nu", "actuators"),
    "latency": ("nu", "actuators"),
}


@dataclass(frozen=True)
class VariableNames:
    """The names that a sweep can vary.

    Attributes:
        options: Options that act on a model of the sweep.
        without_effect: Options that act on no model of the sweep, each with the reason.
        parameters: Keyword arguments of the user's function that can be varied.
        function: The name of the function; "" for an experiment.
        model: The name of the model's file, or of the first of several.
    """

    options: Sequence[str]
    without_effect: Mapping[str, str] = field(default_factory=dict[str, str])
    parameters: Sequence[str] = ()
    function: str = ""
    model: str = ""

    @property
    def all_names(self) -> tuple[str, ...]:
        """Return every name that can be varied."""
        return (*self.parameters, *self.options, MODEL, *STATES)

    def __str__(self) -> str:
        """Return what can be varied, in words."""
        parts: list[str] = []
        if self.function:
            takes = listed(list(self.parameters)) if self.parameters else "no parameter"
            parts.append(f"{self.function} takes {takes}")
        robot = self.model if self.model else "the robot"
        parts.append(f"{robot} has {', '.join(self.options)}")
        parts.append(f"{MODEL}, qpos[JOINT] and qvel[JOINT] can be varied, too")
        return "; ".join(parts)


def variable_names(
    models: Sequence[Model], function: str = "", parameters: Sequence[str] = ()
) -> VariableNames:
    """Return the names that a sweep of some models and a function can vary.

    Args:
        models: Every model of the sweep on every backend.
        function: The name of the user's function; "" for an experiment.
        parameters: The keyword arguments of the function that can be varied.
    """
    options: dict[str, None] = {}
    without_effect: dict[str, str] = {}
    for model in models:
        for name in model.capabilities.options:
            reason = _why_without_effect(model, name)
            if reason:
                without_effect[name] = reason
            else:
                options[name] = None
    for name in READ_OPTIONS:
        options[name] = None
    for name in options:
        without_effect.pop(name, None)
    return VariableNames(
        options=tuple(options),
        without_effect=without_effect,
        parameters=tuple(parameters),
        function=function,
        model=models[0].path.name,
    )


def _why_without_effect(model: Model, option: str) -> str:
    """Return why an option changes nothing of a model; "" if it may."""
    if option in _SERVO_GAINS and bool(np.isnan(model.actuator_kp).all()):
        return f"{option} is of position servos, and {model.path.name} has none"
    if option in _ELEMENTS:
        attribute, elements = _ELEMENTS[option]
        if not getattr(model, attribute):
            return f"{option} is of {elements}, and {model.path.name} has none"
    return ""


def resolve_kinds(factors: Iterable[Vary], names: VariableNames) -> tuple[Vary, ...]:
    """Return the same factors, each with its kind.

    Args:
        factors: As parsed.
        names: What can be varied.

    Raises:
        UnknownNameError: There is nothing of this name.
        BadInputError: An option acts on no model of the sweep, a name is an option and a parameter
            at once, or what is typed is no value of that factor.
    """
    return tuple(replace(vary, kind=_kind(vary, names)) for vary in factors)


def _kind(vary: Vary, names: VariableNames) -> Kind:
    """Return what a factor varies, and check that it can be varied as it is typed.

    Raises:
        UnknownNameError: There is nothing of its name.
        BadInputError: It is an option and a parameter, it is varied as a whole and has no parts,
            or the other way round, or it has no value of the model's own that could be multiplied.
    """
    name = vary.name
    kind = _kind_of_name(vary, names)
    if kind == "model" and vary.place:
        raise BadInputError("model is varied as a whole: model=so101/scene,so101/scene_box")
    if kind == "state" and not vary.place:
        raise BadInputError(f"{name} is varied one coordinate at a time: {name}[JOINT]=…")
    if vary.times and kind != "option":
        raise BadInputError(f"{vary.label} has no value of the model's own: leave the x out")
    if name in READ_OPTIONS and (vary.place or vary.times):
        raise BadInputError(f"{name} is varied as a whole: {name}=on,off")
    return kind


def _kind_of_name(vary: Vary, names: VariableNames) -> Kind:
    """Return what is varied by its name.

    Raises:
        UnknownNameError: There is nothing of this name.
        BadInputError: It acts on no model of the sweep, or is an option and a parameter at once.
    """
    name = vary.name
    is_parameter = name in names.parameters
    if is_parameter and name in (*names.options, *names.without_effect, MODEL, *STATES):
        raise BadInputError(
            f"{name} is a parameter of {names.function} and an option of the robot: give the "
            f"parameter another name. There is: {names}"
        )
    if name == MODEL:
        return "model"
    if name in STATES:
        return "state"
    if name in names.options:
        return "option"
    if is_parameter and not vary.place:
        return "parameter"
    if name in names.without_effect:
        raise BadInputError(f"{names.without_effect[name]}. There is: {names}")
    if is_parameter:
        raise BadInputError(f"{vary.label}: a parameter of a function has no parts: {name}=…")
    known = names.all_names
    hint = did_you_mean(name, known, show=repr)
    message = f"nothing to vary is named {shown(name)}. There is: {names}{hint}"
    raise UnknownNameError(message, kind="thing to vary", name=name, known=known)
