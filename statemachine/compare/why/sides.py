"""One side of a comparison, as something that can be built with other settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...engines import part
from ...engines.parts import Dials, DialsPart, Setting
from ...errors import UnsupportedError
from ...interface import Model
from ...measures.text import milliseconds, rounded, significant
from .factors import FACTORS, Factor

How = Literal["parity", "off"]
Values = Mapping[str, Any]
FINER = 4
_SWITCHED = ("servo", "limits", "contact")  # `replace` can only switch these


@dataclass(frozen=True, eq=False)
class Change:
    """What is done to one factor on one side.

    Attributes:
        how: "parity" to take the other side's values; "off" to leave it out.
        values: Those values, by name.
    """

    how: How
    values: Values


Changes = Mapping[str, Change]


class ModelSide:
    """Any Model: changed by `replace`, and by its compiled model where `raw` is one.

    Attributes:
        label: What it is, in words.
        makes: What makes its motion: two sides that say the same treat equal settings alike.
        fresh: Whether it has settings of its engine's own.
    """

    fresh = False

    def __init__(self, model: Model, options: Mapping[str, Any]) -> None:
        self._base, self._options = model, dict(options)
        self._as_it_comes = model.replace(**options) if options else model
        self.label = self.makes = f"{model.backend} {model.engine_version}"

    def values(self, factor: Factor, changes: Changes) -> Values | None:
        """What it has of a factor, as it comes; None if it has no such thing."""
        model = self._as_it_comes
        found = {name: getattr(model, name) for name in factor.facts}
        for name in factor.raw:
            value = _raw(model, name)
            if value is not None:
                found[name] = np.array(value)
        on = _switched_on(model, factor)
        return found if on is None else {**found, "on": on}

    def words(self, factor: Factor) -> str:
        """The same in a few words."""
        if self._options.get(factor.options[0] if factor.options else "", True) is False:
            return "off"
        return _in_words(factor, self.values(factor, {}) or {})

    def refuses(self, factor: Factor, how: How, values: Values, changes: Changes) -> str:
        """Why a change cannot be made on top of others; "" if it can."""
        known = self._as_it_comes.capabilities.options
        missing = [name for name in factor.options if name not in known]
        if how == "off":
            if not factor.off:
                return "the other engine has nothing that corresponds"
            if factor.name == "surfaces":
                able = _raw(self._as_it_comes, "geom_friction") is not None
                able = able or part(self._base.backend, "dials") is not None
                return "" if able else f"{self._base.backend} has no way to set friction"
            if missing:
                return f"{self._base.backend} cannot leave it out"
            if factor.options[0] in self._options:
                return "this experiment says what it is"
            return ""
        own = self.values(factor, changes) or {}
        shared = [name for name in values if name in own]
        if any(np.shape(own[name]) != np.shape(values[name]) for name in shared):
            return "the two models have other numbers of it"
        settable = {name for name in factor.raw if name in own}
        if not missing:
            settable |= {"on"} if factor.name in _SWITCHED else set(factor.facts)
        if factor.raw and settable >= set(
            factor.raw
        ):  # what a Model tells of them follows from them
            settable |= set(factor.facts)
        differing = {name for name in shared if not same(own[name], values[name])}
        if not differing <= settable:
            return f"{self._base.backend} takes it from the model's file"
        return ""

    def without(self, factor: Factor, changes: Changes) -> Changes:
        """Changes without that of a factor, and without those that need it."""
        return {name: change for name, change in changes.items() if name != factor.name}

    def build(self, changes: Changes) -> Model:
        """The Model with these changes."""
        model, options = self._base, dict[str, Any]()
        for name, change in changes.items():
            factor = FACTORS[name]
            if change.how == "off" and name == "surfaces":
                smooth = _raw(model, "geom_friction")
                if smooth is not None:
                    model = _written(model, {"geom_friction": np.zeros(smooth.shape)})
                continue
            if change.how == "off":
                options |= self._off(factor)
                continue
            if "integrator" in change.values:
                options["integrator"] = change.values["integrator"]
            written = {key: value for key, value in change.values.items() if key in factor.raw}
            if any(_raw(model, key) is not None for key in written):
                model = _written(model, written)
            own = self.values(factor, {}) or {}
            if not same(own.get("on"), change.values.get("on", own.get("on"))):
                options[factor.options[0]] = change.values["on"]
            if name not in _SWITCHED:
                for fact, option in zip(factor.facts, factor.options, strict=False):
                    if not same(own[fact], change.values[fact]):
                        options[option] = change.values[fact]
        options = {**self._options, **options}
        model = model.replace(**options) if options else model
        smoothed = "surfaces" in changes and changes["surfaces"].how == "off"
        dials: DialsPart | None = part(model.backend, "dials") if smoothed else None
        return dials.frictionless(model) if dials else model

    def _off(self, factor: Factor) -> dict[str, Any]:
        if factor.name == "gravity":
            return {"gravity": np.zeros(3)}
        if factor.name == "timestep":
            return {"substeps": FINER * self._as_it_comes.substeps}
        if factor.name in ("armature", "damping", "frictionloss"):
            return {factor.name: 0.0}
        return {factor.options[0]: False}


class EngineSide:
    """A Model with `defaults="engine"`: its settings are dials between the engine's and ours."""

    fresh = True

    def __init__(self, model: Model, options: Mapping[str, Any], dials: Dials) -> None:
        self._dials, self._options = dials, dict(options)
        self._emulated = ModelSide(dials.emulated, {})
        self.label = f"{model.backend} {model.engine_version}, engine defaults"
        self.makes = self.label

    def values(self, factor: Factor, changes: Changes) -> Values | None:
        model = self._dials.model
        if factor.name in ("gravity", "timestep"):
            return {name: getattr(model, name) for name in factor.facts}
        if factor.name == "integrator":
            return {} if "servo" in changes else None
        if factor.name in self._dials.with_servo and "servo" not in changes:
            return None
        return {} if factor.name == "contact" else {"as it comes": self.words(factor)}

    def words(self, factor: Factor) -> str:
        if factor.name in ("gravity", "timestep"):
            return _in_words(factor, self.values(factor, {}) or {})
        if factor.name == "servo":
            on = self._options.get("actuation", True)
            return "its motors" if on else "motors hold"
        if factor.name == "surfaces":
            return f"friction {_span(self._dials.frictions)}"
        return self._dials.words[factor.name]

    def refuses(self, factor: Factor, how: How, values: Values, changes: Changes) -> str:
        if how == "off":
            able = factor.name in ("gravity", "limits", "contact", "damping")
            return "" if able else "the engine has no way to leave it out"
        if factor.name in (*self._dials.with_servo, "limits") and "servo" not in changes:
            return "the engine has no such thing without the model's servo law"
        if factor.name in ("contact", "integrator"):
            return "the engine has its own"
        # What only the adapter gives is that of the file.
        if factor.name == "servo":
            return self._emulated.refuses(factor, how, values, changes)
        return ""

    def without(self, factor: Factor, changes: Changes) -> Changes:
        gone = {factor.name}
        if factor.name == "servo":
            gone |= {*self._dials.with_servo, "limits"}
        return {name: change for name, change in changes.items() if name not in gone}

    def build(self, changes: Changes) -> Model:
        settings: dict[str, Setting] = {
            name: "off" if c.how == "off" else "model" for name, c in changes.items()
        }
        values: dict[str, Any] = {}
        for name, change in changes.items():
            if name == "timestep":
                values[name] = change.values["timestep"], int(change.values["substeps"])
            elif change.how == "parity" and FACTORS[name].facts:
                values[name] = change.values.get(FACTORS[name].facts[0])
        return self._dials.build(settings, values)


AdjustableSide = ModelSide | EngineSide  # a side that `attribute` can build with other settings


def side_of(model: Model, options: Mapping[str, Any]) -> AdjustableSide:
    """The side of a Model, in an experiment with some options."""
    own: DialsPart | None = part(model.backend, "dials")
    dials = own.dials(model, options) if own else None
    return EngineSide(model, options, dials) if dials else ModelSide(model, options)


def same(one: Any, two: Any) -> bool:
    """Whether two values are equal, entry by entry; NaN is equal to NaN."""
    return bool(np.array_equal(one, two, equal_nan=np.asarray(one).dtype.kind == "f"))


def _switched_on(model: Model, factor: Factor) -> bool | None:
    """Whether something that can be switched is on; None where a Model does not tell."""
    if factor.name not in _SWITCHED or _raw(model, "opt.disableflags") is None:
        return None
    on = model.replace(**{factor.options[0]: True})
    return bool(_raw(on, "opt.disableflags") == _raw(model, "opt.disableflags"))


def _raw(model: Model, name: str) -> Any:
    """An array of a compiled model; None where `raw` is none."""
    holder, _, last = name.rpartition(".")
    owner = getattr(model.raw, holder, None) if holder else model.raw
    return getattr(owner, last, None)


def _written(model: Model, values: Values) -> Model:
    """Another Model, into whose compiled model these arrays are written."""
    made = model.replace()
    if made.raw is model.raw:
        raise UnsupportedError(
            f"{model.backend} gives no copy of its compiled model",
            backend=model.backend,
            feature="raw",
            reason="replace() gives the same one",
        )
    for name, value in values.items():
        holder, _, last = name.rpartition(".")
        owner = getattr(made.raw, holder) if holder else made.raw
        if np.ndim(value):
            getattr(owner, last)[:] = value
        else:
            setattr(owner, last, np.asarray(value).item())
    return made


def _in_words(factor: Factor, values: Values) -> str:
    if factor.name == "gravity":
        return rounded(float(np.linalg.norm(values["gravity"])), "m/s²")
    if factor.name == "timestep":
        step, substeps = float(values["timestep"]), int(values["substeps"])
        return milliseconds(step, 3) + (f" / {substeps}" if substeps > 1 else "")
    if factor.name in ("armature", "damping", "frictionloss"):
        return _span(values[factor.facts[0]])
    if factor.name == "servo":
        gains = np.asarray(values["actuator_kp"])
        known = gains[np.isfinite(gains)]
        return f"kp {_span(known)}" if known.size else "no servos" if gains.size else "none"
    if factor.name == "limits":
        return f"of {int(np.sum(values['jnt_limited']))} joints"
    if factor.name == "surfaces" and "geom_friction" in values:
        return f"friction {_span(np.asarray(values['geom_friction'])[:, 0])}"
    return "of the file"


def _span(values: Any) -> str:
    """The numbers of an array that are not zero: one, or the least and the largest."""
    found = np.unique(np.asarray(values)[np.asarray(values) != 0])
    if not found.size:
        return "none"
    return significant(found[0]) + (f" to {significant(found[-1])}" if found.size > 1 else "")
