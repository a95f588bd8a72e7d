"""What is run on two sides, as somebody writes it in Python, as a Request."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

from ...errors import BadInputError, shown
from ...installed import DEFAULT, PAIR
from ...interface import Model
from ...interface.options import OptionValue
from ...measures import parse_tolerances
from ...models import AnyPath
from ..compare.perturbed import Uncertainty, parse_uncertainty
from ..compare.sides import Request, Side
from ..compare.typed_sides import parse_sides
from ..compare.what import What
from ..policy.command import speeds_of
from ..recordings import Trace
from ..runs.call_period import Every
from ..runs.scenarios import SCENARIOS
from ..shown_result import ShownResult

AnySide = AnyPath | Model | Side
AnyWhat = What | os.PathLike[str]
Which = Literal["left", "right"]
_RUNS = f"an experiment ({', '.join(SCENARIOS)}), a function (model, data), a policy, or traces"


@dataclass(frozen=True)
class RunArguments:
    """What is run on two sides, as the arguments of a function.

    Attributes:
        left: The left side, or the only model; or a Request, which says all of it.
        right: The right side.
        what: What is run; None where `left` is a Request.
        backends: The two backends, where no sides are given.
        menagerie: A menagerie folder to look names up in.
        seconds: Simulated time [s].
        timestep: Length of a step, on both sides [s].
        seed: Of what an experiment draws.
        names: Joints, bodies, sites and actuators of the left that have other names on the right;
            None for none.
        actuators: The side whose actuators both have.
        floor: The side whose floor both have.
        every: Steps for which what a function returned holds, or a time such as "5ms".
        keyframe: Where it starts, on both sides.
        contract: What a policy expects of the simulator: a file.
        command: (3,) speeds that a policy is asked for.
    """

    left: AnySide | Request | None = None
    right: AnySide | None = None
    what: AnyWhat | Sequence[AnyWhat] | None = None
    backends: tuple[str, str] = PAIR
    menagerie: AnyPath | None = None
    seconds: float | None = None
    timestep: float | None = None
    seed: int = 0
    names: Mapping[str, str] | None = None
    actuators: Which | None = None
    floor: Which | None = None
    every: Every = 1
    keyframe: str | None = None
    contract: AnyPath | None = None
    command: Sequence[float] | None = None

    @classmethod
    def of(cls, arguments: Mapping[str, Any]) -> RunArguments:
        """Return what is run, of all that a function was called with.

        Args:
            arguments: By name, as `locals()` has them; those that are no field are left out.
        """
        names = [each.name for each in fields(cls) if each.name in arguments]
        return cls(**{name: arguments[name] for name in names})

    @property
    def pairs_of_names(self) -> Mapping[str, str]:
        """Return the names of the left by those of the right; empty where none were named."""
        return {} if self.names is None else self.names

    def request(self) -> Request:
        """Return the Request.

        Raises:
            BadInputError: Arguments contradict each other, or a side or what is run is missing.
            StateMachineError: A side is no model, engine or option.
        """
        if isinstance(self.left, Request):
            if self != RunArguments(self.left):
                raise BadInputError(
                    "a Request says what is run, on which sides, and how: leave the other "
                    "arguments of a run out, or write another Request"
                )
            return self.left
        if self.left is not None and self.right is not None:
            return self._of_sides(self.left, self.right)
        return self._of_model(self.left)

    def _of_sides(self, left: AnySide, right: AnySide) -> Request:
        """Return the Request of two sides."""
        if self.backends != PAIR:
            raise BadInputError(
                'backends goes without sides: each names its engine, as in "FILE@pybullet"'
            )
        sides = self._taking_parts(self._side(left), self._side(right))
        options: dict[str, OptionValue] = {}
        if self.timestep is not None:
            options["timestep"] = self.timestep
        return replace(self._request(options), sides=sides)

    def _of_model(self, model: AnySide | None) -> Request:
        """Return the Request of one model, or of that of the experiment, on two backends."""
        for name in ("names", "actuators", "floor"):
            if getattr(self, name):
                raise BadInputError(f"{name} is of two sides: compare(left, right, {name}=…)")
        if self.right is not None:
            raise BadInputError("there is a right side and no left one: compare(left, right)")
        if isinstance(model, Model):
            raise BadInputError(
                "a loaded Model has one engine: name the other side, as in "
                f'compare(model, "{model.path.name}@pybullet")'
            )
        options: dict[str, OptionValue] = {}
        file = None
        if model is not None:
            side = self._side(model)
            if side.engine != DEFAULT or side.defaults != "model":
                raise BadInputError(
                    f"one side only, {side.label}: name the other, as in compare(left, right)"
                )
            options |= side.options
            file = side.model
        if self.timestep is not None:
            options["timestep"] = self.timestep
        return replace(self._request(options), model=file)

    def _request(self, options: Mapping[str, OptionValue]) -> Request:
        """Return a Request with all that it has whatever the sides are."""
        contract = _text(self.contract)
        command = None if self.command is None else speeds_of(self.command)
        return Request(
            what=self._what(),
            backends=self.backends,
            menagerie=_text(self.menagerie),
            seconds=self.seconds,
            seed=self.seed,
            options=options,
            names=self.pairs_of_names,
            every=self.every,
            keyframe=self.keyframe,
            contract=contract,
            command=command,
        )

    def _what(self) -> tuple[What, ...]:
        """Return what is run."""
        if self.what is None:
            raise BadInputError(f"what is to be run? what={_RUNS}")
        if isinstance(self.what, Sequence) and not isinstance(self.what, str):
            return tuple(_what_of(what) for what in self.what)
        return (_what_of(self.what),)

    def _side(self, side: AnySide) -> Side:
        return side_of(side, self.menagerie)

    def _taking_parts(self, left: Side, right: Side) -> tuple[Side, Side]:
        """Return both sides, each with the parts that it has of the other."""
        parts = {"actuators": self.actuators, "floor": self.floor}
        for name, which in parts.items():
            if which not in (None, "left", "right"):
                raise BadInputError(f'{name} must be "left" or "right"; got {shown(which)}')
        of_left = [name for name, which in parts.items() if which == "left"]
        of_right = [name for name, which in parts.items() if which == "right"]
        back = {right_name: left_name for left_name, right_name in self.pairs_of_names.items()}
        return left.taking(of_right, right, back), right.taking(of_left, left, self.pairs_of_names)


def side_of(side: AnySide, menagerie: AnyPath | None = None) -> Side:
    """Return a side.

    Args:
        side: "FILE", "FILE@ENGINE" or "FILE@ENGINE:engine", with options behind it as in
            "a.xml@pybullet timestep=0.001"; a path; a loaded Model; or a Side.
        menagerie: A menagerie folder to look names up in.

    Raises:
        BadInputError: It is none of these, or several.
        StateMachineError: There is no such model, engine or option.
    """
    if isinstance(side, Side):
        return side
    if isinstance(side, Model):
        return Side.of_model(side)
    if isinstance(side, ShownResult):
        raise BadInputError(
            f"a {type(side).__name__} is an answer, not a side; what was run on both sides is "
            "result.request.run, as in lab.why(result.request.run)"
        )
    if not isinstance(side, str | os.PathLike):
        raise BadInputError(
            f'a side is "FILE@ENGINE option=value", a path, a Model or a Side; got {shown(side)}'
        )
    sides = parse_sides([os.fspath(side)], _text(menagerie))
    return sides[0]


def _what_of(what: AnyWhat) -> What:
    """Return one of what is run.

    Raises:
        BadInputError: It can be nothing of the kind.
    """
    if isinstance(what, str | Trace) or callable(what):
        return what
    if isinstance(what, os.PathLike):
        return os.fspath(what)
    raise BadInputError(f"what is run is {_RUNS}; got {shown(what)}")


def _text(path: AnyPath | None) -> str | None:
    return None if path is None else os.fspath(path)


def tolerances_of(tolerances: Mapping[str, float | str] | None) -> dict[str, float]:
    """Return tolerances in SI units, of which some may be words such as "0.5deg".

    Raises:
        BadInputError: A word is no size of that kind.
        UnknownNameError: There is no such kind of quantity.
    """
    sizes: dict[str, float] = {}
    if tolerances is None:
        return sizes
    for kind, size in tolerances.items():
        if isinstance(size, str):
            sizes |= parse_tolerances([f"{kind}={size}"])
        else:
            sizes[kind] = size
    return sizes


def uncertainty_of(
    uncertainty: Uncertainty | str | Sequence[str], chaos: bool
) -> Uncertainty | None:
    """Return how uncertain the start is; None where no chaos floor is asked for.

    Raises:
        BadInputError: A word is no length or angle, or there is to be no floor of it.
    """
    if isinstance(uncertainty, str):
        uncertainty = (uncertainty,)
    if not chaos:
        if uncertainty not in ((), Uncertainty()):
            raise BadInputError("uncertainty is of the chaos floor: leave chaos=False out")
        return None
    if isinstance(uncertainty, Uncertainty):
        return uncertainty
    return parse_uncertainty(uncertainty)


def check_alone(function: Callable[..., object], arguments: Mapping[str, object]) -> None:
    """Check that beside a Request of a question nothing else is given.

    Args:
        function: That takes it as its first argument.
        arguments: What it was called with, by name.

    Raises:
        BadInputError: Something is given.
    """
    parameters = list(inspect.signature(function).parameters.values())
    request = type(arguments[parameters[0].name]).__name__
    for parameter in parameters[1:]:
        value = arguments[parameter.name]
        if parameter.name != "reporter" and value != parameter.default:
            raise BadInputError(f"a {request} says all that is asked: leave {parameter.name} out")
