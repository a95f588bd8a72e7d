"""What an engine as it comes sets in its own way, and what can be left out on any engine.

The settings of an engine as it comes are causes of a gap, beside what differs between files: each
can be brought to the model's own by a dial of the engine's room. What no setting holds, such as the
law of contact, is only located: it is left out on both sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engines.records import Dials, DifferingQuantity, ModelDifference, Setting
from ...interface import JointType, Model
from ...measures.text import milliseconds, rounded, significant

# In the order of the tables: the world before the robot.
TITLES: Mapping[str, str] = {
    "gravity": "gravity",
    "timestep": "timestep",
    "inertia": "inertias",
    "damping": "damping",
    "servo": "servo law",
    "armature": "armature",
    "frictionloss": "dry friction",
    "limits": "joint limits",
    "surfaces": "surfaces",
    "self-collision": "self-collision",
    "equality": "joints that follow",
}
# Of a title the one that it needs. An engine's explicit damping does not stand without its motors,
# and what the engine lacks, or has in another way, an adapter can give it only together with the
# model's servo law.
NEEDS: Mapping[str, str] = {
    "servo law": "damping",
    "armature": "servo law",
    "dry friction": "servo law",
    "joint limits": "servo law",
    "self-collision": "servo law",
    "joints that follow": "servo law",
}
_FINER = 4


@dataclass(frozen=True)
class Feature:
    """What both engines compute, each in its own way, and what can be left out.

    Attributes:
        name: What it is called.
        without: What a run without it is, in words.
        option: The option of `Model.replace` that leaves it out.
        value: What that option is given; of "substeps", how many times as many.
    """

    name: str
    without: str
    option: str
    value: float


CONTACT = Feature("contact", "nothing touches", "contacts", False)
# What acts now and then comes first. Gravity and the servos are not among them: they drive the
# motion, and with it goes whatever there is between two sides.
FEATURES = (
    CONTACT,
    Feature("limits", "no joint limits", "limits", False),
    Feature("frictionloss", "no dry friction", "frictionloss", 0.0),
    Feature("damping", "no damping", "damping", 0.0),
    Feature("armature", "no armature", "armature", 0.0),
    Feature("timestep", f"steps {_FINER} times finer", "substeps", _FINER),
)


ENGINE_CAN_BE_WITHOUT = ("limits", "contact", "damping")  # of the features, as it comes


class OwnSettings:
    """The settings of a Model with `defaults="engine"`, each as it comes or as the model has it.

    Attributes:
        names: Of the settings, as in `TITLES`.
        emulated: The file behind the contract.
    """

    def __init__(self, dials: Dials, other: Model, actuated: bool) -> None:
        """Find what of an engine as it comes differs from the model.

        Args:
            dials: Those of its room.
            other: The Model of the other side, whose gravity and timestep are the model's.
            actuated: Whether its motors follow ctrl.
        """
        self._dials, self._other, self._actuated = dials, other, actuated
        self.emulated = dials.emulated
        alike = self._alike_in_the_world() | self._alike_in_the_robot()
        self.names = tuple(name for name in TITLES if not alike.get(name))

    def _alike_in_the_world(self) -> dict[str, bool]:
        """Tell of gravity and timestep whether the engine has them as the other side."""
        model, other = self._dials.model, self._other
        steps, other_steps = (model.timestep, model.substeps), (other.timestep, other.substeps)
        return {
            "gravity": np.array_equal(model.gravity, other.gravity),
            "timestep": steps == other_steps,
        }

    def _alike_in_the_robot(self) -> dict[str, bool]:
        """Tell of parts of a robot whether this one has none of them."""
        emulated = self.emulated
        return {
            "armature": not emulated.dof_armature.any(),
            "frictionloss": not emulated.dof_frictionloss.any(),
            "limits": not emulated.jnt_limited.any(),
            "self-collision": not self._dials.self_pairs,
            "equality": emulated.compiled is None or not emulated.compiled.neq,
        }

    def differences(self, side: int) -> list[ModelDifference]:
        """Return the settings as differences; `side` is that of the engine as it comes, 0 or 1."""
        rows: list[ModelDifference] = []
        for name in self.names:
            engine_word, model_word = self._own_word(name), self._model_word(name)
            left, right = (model_word, engine_word) if side else (engine_word, model_word)
            title = TITLES[name]
            value = DifferingQuantity(title, left, right)
            rows.append(ModelDifference(title, "engine", "", (value,)))
        return rows

    def _model_word(self, name: str) -> str:
        """Return what the model has of a setting, in a few words."""
        if name == "self-collision":
            return f"on, {_count(self._dials.self_pairs, 'pair')}"
        if name in ("gravity", "timestep"):
            return _word(name, self._other)
        return _word(name, self.emulated)

    def build(
        self, model: Model, emulated: Model, names: frozenset[str], without: frozenset[str]
    ) -> Model:
        """Return the engine with some settings at the model's.

        Args:
            model: The file as the engine comes.
            emulated: The same file behind the contract.
            names: Of the settings.
            without: Names of features to leave out.

        Raises:
            UnsupportedError, EngineError: As the room of the engine does.
        """
        other = self._other
        values = {
            "gravity": other.gravity,
            "timestep": (other.timestep, other.substeps),
            "armature": emulated.dof_armature,
            "damping": emulated.dof_damping,
            "frictionloss": emulated.dof_frictionloss,
        }
        settings: dict[str, Setting] = {
            **dict.fromkeys(names, "model"),
            **dict.fromkeys(without, "off"),
        }
        return type(self._dials)(model, emulated).build(settings, values)

    def _own_word(self, name: str) -> str:
        """Return what the engine has of a setting, in a few words."""
        match name:
            case "gravity" | "timestep":
                return _word(name, self._dials.model)
            case "servo":
                if not self._actuated:
                    return "motors hold"
                if _is_driven(self._dials.model):
                    return "its motors"
                return "motors in all joints"
            case "surfaces":
                return f"friction {_span(self._dials.frictions)}, hard"
        return self._dials.words[name]


def leave_out(model: Model, features: frozenset[str]) -> Model:
    """Return a Model without some features, by `Model.replace`."""
    options: dict[str, float] = {}
    for feature in FEATURES:
        if feature.name in features:
            options[feature.option] = feature.value
    if "substeps" in options:
        options["substeps"] = _FINER * model.substeps
    return model.replace(**options) if options else model


def _word(name: str, model: Model) -> str:
    match name:
        case "gravity":
            return rounded(float(np.linalg.norm(model.gravity)), "m/s²")
        case "timestep":
            text = milliseconds(model.timestep, 3)
            if model.substeps > 1:
                return f"{text} / {model.substeps}"
            return text
        case "armature" | "damping" | "frictionloss":
            return _span(getattr(model, f"dof_{name}"))
        case "servo":
            gains = model.actuator_kp[np.isfinite(model.actuator_kp)]
            if not gains.size:
                return "no servos"
            idle = "" if _is_driven(model) else ", else none"
            return f"kp {_span(gains)}{idle}"
        case "limits":
            return f"soft, {int(model.jnt_limited.sum())} joints"
        case "equality" if model.compiled is not None:
            return _count(int(model.compiled.neq), "joint")
        case "surfaces" if model.compiled is not None:
            return f"friction {_span(model.compiled.geom_friction[:, 0])}"
    return "of the file"


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def _is_driven(model: Model) -> bool:
    """Tell whether each hinge and slide has an actuator of its own."""
    kinds = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    return set(np.flatnonzero(kinds)) <= set(model.actuator_jntid)


def _span(values: Any) -> str:
    """Return the numbers of an array that are not zero: one, or the least and the largest."""
    numbers = np.unique(np.asarray(values)[np.asarray(values) != 0])
    if not numbers.size:
        return "none"
    least = significant(numbers[0])
    return f"{least} to {significant(numbers[-1])}" if numbers.size > 1 else least
