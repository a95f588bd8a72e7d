"""What an engine as it comes sets in its own way, and what can be left out on any engine.

The settings of an engine as it comes are causes of a gap, beside what differs between files: each
can be brought to the model's own by a dial of the engine's room. What no setting holds, such as the
law of contact, is only located: it is left out on both sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...engines.records import Dials, ModelDifference, Setting
from ...interface import JointType, Model
from ...measures.text import milliseconds, rounded, significant
from ...page import Figures

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


# What both engines compute, each in its own way, and what can be left out: its name, what a run
# without it is, and the option of `Model.replace` with the value that leaves it out.
# What acts now and then comes first. Gravity and the servos are not among them: they drive the
# motion, and with it goes whatever there is between two sides.
FEATURES = (
    Figures(name="contact", without="nothing touches", option="contacts", value=False),
    Figures(name="limits", without="no joint limits", option="limits", value=False),
    Figures(name="frictionloss", without="no dry friction", option="frictionloss", value=0.0),
    Figures(name="damping", without="no damping", option="damping", value=0.0),
    Figures(name="armature", without="no armature", option="armature", value=0.0),
    Figures(
        name="timestep", without=f"steps {_FINER} times finer", option="substeps", value=_FINER
    ),
)


ENGINE_CAN_BE_WITHOUT = ("limits", "contact", "damping")  # of the features, as it comes


class OwnSettings:
    """The settings of a Model with `defaults="engine"`, each as it comes or as the model has it.

    Attributes:
        names: Of the settings, as in `TITLES`.
        emulated: The file behind the contract.
    """

    def __init__(self, dials: Dials, other: Model, actuated: bool) -> None:
        """Of an engine as it comes.

        Args:
            dials: Those of its room.
            other: The Model of the other side, whose gravity and timestep are the model's.
            actuated: Whether its motors follow ctrl.
        """
        self._dials, self._other, self._actuated = dials, other, actuated
        model, self.emulated = dials.model, dials.emulated
        alike = {
            "gravity": np.array_equal(model.gravity, other.gravity),
            "timestep": (model.timestep, model.substeps) == (other.timestep, other.substeps),
            "armature": not self.emulated.dof_armature.any(),
            "frictionloss": not self.emulated.dof_frictionloss.any(),
            "limits": not self.emulated.jnt_limited.any(),
            "self-collision": not dials.self_pairs,
            "equality": self.emulated.compiled is None or not self.emulated.compiled.neq,
        }
        self.names = tuple(name for name in TITLES if not alike.get(name))

    def differences(self, side: int) -> list[ModelDifference]:
        """The settings as differences; `side` is that of the engine as it comes, 0 or 1."""
        rows = []
        for name in self.names:
            source = self._other if name in ("gravity", "timestep") else self.emulated
            own, model = self._own_word(name), _word(name, source)
            if name == "self-collision":
                model = f"on, {_count(self._dials.self_pairs, 'pair')}"
            values = ((TITLES[name], *((model, own) if side else (own, model))),)
            rows.append(ModelDifference(TITLES[name], "engine", "", values))
        return rows

    def build(
        self, model: Model, emulated: Model, names: frozenset[str], without: frozenset[str]
    ) -> Model:
        """The engine with some settings at the model's.

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
        """What the engine has of a setting, in a few words."""
        match name:
            case "gravity" | "timestep":
                return _word(name, self._dials.model)
            case "servo":
                own = "its motors" if _is_driven(self._dials.model) else "motors in all joints"
                return own if self._actuated else "motors hold"
            case "surfaces":
                return f"friction {_span(self._dials.frictions)}, hard"
        return self._dials.words[name]


def leave_out(model: Model, features: frozenset[str]) -> Model:
    """A Model without some features, by `Model.replace`."""
    options = {
        feature.option: _FINER * model.substeps if feature.option == "substeps" else feature.value
        for feature in FEATURES
        if feature.name in features
    }
    return model.replace(**options) if options else model


def _word(name: str, model: Model) -> str:
    match name:
        case "gravity":
            return rounded(float(np.linalg.norm(model.gravity)), "m/s²")
        case "timestep":
            text = milliseconds(model.timestep, 3)
            return f"{text} / {model.substeps}" if model.substeps > 1 else text
        case "armature" | "damping" | "frictionloss":
            return _span(getattr(model, f"dof_{name}"))
        case "servo":
            gains = model.actuator_kp[np.isfinite(model.actuator_kp)]
            idle = "" if _is_driven(model) else ", else none"
            return f"kp {_span(gains)}{idle}" if gains.size else "no servos"
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
    """Whether each hinge and slide has an actuator of its own."""
    kinds = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    return set(np.flatnonzero(kinds)) <= set(model.actuator_jntid)


def _span(values: Any) -> str:
    """The numbers of an array that are not zero: one, or the least and the largest."""
    numbers = np.unique(np.asarray(values)[np.asarray(values) != 0])
    if not numbers.size:
        return "none"
    least = significant(numbers[0])
    return f"{least} to {significant(numbers[-1])}" if numbers.size > 1 else least
