"""A controller of the user's own, from a Python file."""

from __future__ import annotations

import inspect
import itertools
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...errors import BadInputError, did_you_mean
from ...interface import Data, Model
from ...interface.checks import as_vector
from ...measures.text import count, few
from ...models import kind_of_path
from .call_period import Every, steps_of
from .drive import Controller
from .scenarios import Scenario
from .user_files import error_text, last_user_line, load_module, signature_mismatch

Function = Callable[..., Any]
_POSITIONAL = ("model", "data")  # by position
_POLICY = ".onnx"


def is_function(spec: object) -> bool:
    """Tell whether something is a function, or a word FILE.py or FILE.py:NAME."""
    if isinstance(spec, str):
        return Path(_file_and_name(spec)[0]).suffix == ".py"
    return callable(spec)


def is_policy(spec: object) -> bool:
    """Tell whether something is a word that names the network of a policy, by its suffix."""
    return isinstance(spec, str) and Path(spec).suffix.lower() == _POLICY


def is_controller(spec: object) -> bool:
    """Tell whether something commands by the user's own: a function, or a policy."""
    return is_function(spec) or is_policy(spec)


def function_scenario(
    spec: str | Function,
    every: Every = 1,
    keyframe: str | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Scenario:
    """Return what a function (model, data) of the user's does on any robot.

    Each controller of "FILE.py:NAME" has the file's names to itself: it is run anew for each.

    Args:
        spec: The function; or a file and a function of it, without a name `controller`.
        every: The function is called at the first of so many steps, or once in a time such as
            "5ms", and its ctrl holds.
        keyframe: Where it starts; None for the default state.
        parameters: Further keyword arguments of the function.

    Raises:
        BadInputError: There is no such file or function, or the file fails; the controller
            raises it where the function fails, or returns what is not ctrl.
    """
    path, name = file_and_name_of(spec)
    given = dict(parameters or {})

    def imported() -> Function:
        if isinstance(spec, str):
            return _import_controller(path, name, given)
        _check_signature(spec, name, path, given)
        return spec

    imported()  # that it fails is said before anything is loaded

    def controller_of(model: Model, _seed: int) -> Controller:
        function = imported()
        numbers, steps = itertools.count(), steps_of(every, model.timestep)

        def controller(model: Model, data: Data) -> Any:
            if next(numbers) % steps:
                return None
            with _errors_in_one_line(path, name, data.time):
                ctrl = function(model, data, **given)
                return None if ctrl is None else as_vector(ctrl, (model.nu,), "ctrl")

        return controller

    called = Path(spec).name if isinstance(spec, str) else name
    steps = _how_often(every)
    begins = "the default state" if keyframe is None else f"the keyframe {keyframe!r}"
    says = f"{called} is asked for ctrl at {steps}. It starts in {begins}."
    return Scenario(
        name=called,
        description=says,
        model="",
        seconds=2.0,
        controller=controller_of,
        general_description=says,
        needs=lambda _model: None,
        keyframe=keyframe,
        is_user_function=True,
    )


def _how_often(every: Every) -> str:
    """Return how often a function is called, in words."""
    if isinstance(every, str):
        return f"every {every}"
    return "every step" if every == 1 else f"every {count(every, 'step')}"


def parameters_of(spec: str) -> tuple[str, ...]:
    """Return the keyword parameters of the function (model, data, …) that "FILE.py:NAME" names.

    Raises:
        BadInputError: There is no such function, or the file fails.
    """
    path, name = _file_and_name(spec)
    return _keyword_parameters(_import_function(path, name))


def _keyword_parameters(function: Function) -> tuple[str, ...]:
    """Return what a function (model, data, …) takes by keyword."""
    try:
        given = inspect.signature(function).parameters.values()
    except ValueError:  # something of C's without a signature
        return ()
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    takes = [parameter.name for parameter in given if parameter.kind in kinds][: len(_POSITIONAL)]
    named = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
    return tuple(
        parameter.name
        for parameter in given
        if parameter.kind in named and parameter.name not in takes
    )


def function_file(spec: str) -> Path:
    """Return the file that "FILE.py:NAME" names."""
    return _file_and_name(spec)[0]


def file_and_name_of(spec: str | Function) -> tuple[Path, str]:
    """Return the file and the name of a function of the user's."""
    if isinstance(spec, str):
        return _file_and_name(spec)
    code = getattr(inspect.unwrap(spec), "__code__", None)
    path = Path(code.co_filename if code is not None else type(spec).__name__)
    return path, getattr(spec, "__name__", type(spec).__name__)


def _file_and_name(spec: str) -> tuple[Path, str]:
    """Return the file and the name of the function that "FILE.py:NAME" names."""
    file, colon, name = spec.rpartition(":")
    if not colon or name.endswith(".py") or "/" in name or "\\" in name:
        file, name = spec, "controller"
    return Path(file), name


def _import_controller(path: Path, name: str, parameters: Mapping[str, Any]) -> Function:
    """Run a file, and return its function `name`, which takes a Model, a Data and `parameters`."""
    function = _import_function(path, name)
    _check_signature(function, name, path, parameters)
    return function


def _check_signature(
    function: Function, name: str, path: Path, parameters: Mapping[str, Any]
) -> None:
    """Check that a function can be called with a Model, a Data and these parameters."""
    takes, _ = signature_mismatch(function, *_POSITIONAL, **parameters)
    if takes:
        called_with = ", ".join((*_POSITIONAL, *parameters))
        place = f" of {path.name}" if path.suffix == ".py" else ""
        raise BadInputError(
            f"{name}{place} takes {takes}, and a controller is called with ({called_with}): "
            f"write def {_def_name(name)}({called_with}), which returns ctrl (nu,) or None"
        )


def check_is_controller(function: Function) -> None:
    """Check that a function takes a Model and a Data first, whatever further parameters it has.

    Raises:
        BadInputError: It does not; the message shows what to write.
    """
    path, name = file_and_name_of(function)
    named = dict.fromkeys(_keyword_parameters(function))
    _check_signature(function, name, path, named)


def check_controller(function: Function) -> None:
    """Check that a function can be called with a Model and a Data.

    Raises:
        BadInputError: It takes something else; the message shows what to write.
    """
    path, name = file_and_name_of(function)
    _check_signature(function, name, path, {})


def _def_name(name: str) -> str:
    """Return the name of a function as one writes it behind def; a lambda has none."""
    return name if name.isidentifier() else "controller"


def _import_function(path: Path, name: str) -> Function:
    """Run a file, and return its function `name`."""
    if path.suffix != ".py" or not path.is_file():
        raise _missing(path)
    with _errors_in_one_line(path, name):
        module = load_module(f"controller_{path.stem}", path)
    function = getattr(module, name, None)
    if not callable(function):
        functions = _functions_of(module)
        hint = did_you_mean(name, functions)
        if functions and not hint:
            hint = f"; it has {few(functions)}"
        raise BadInputError(f"{path.name} has no function {name}({', '.join(_POSITIONAL)}){hint}")
    return function


def _functions_of(module: Any) -> list[str]:
    """Return the names of the functions that a module defines, without those that it imports."""
    return [
        name
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__
    ]


def _missing(path: Path) -> BadInputError:
    if path.suffix != ".py":
        return BadInputError(f"a controller is given as FILE.py or FILE.py:NAME; got {str(path)!r}")
    if (kind := kind_of_path(path)) != "nothing":
        return BadInputError(f"{path} is {kind}, not a controller file")
    beside = [f.name for f in path.parent.glob("*.py")] if path.parent.is_dir() else []
    hint = did_you_mean(path.name, beside, 0.6)
    return BadInputError(f"there is no controller file {path}{hint}")


@contextmanager
def _errors_in_one_line(path: Path, name: str, time: float | None = None) -> Iterator[None]:
    """Run what is in a file, its folder among those of Python; an error is one line about it.

    Args:
        path: The file; what was written into a notebook has none that is there.
        name: Of the function.
        time: When it is called [s]; None where the file is only run.
    """
    folder = str(path.parent.absolute())
    sys.path.insert(0, folder)  # as when the file is run
    try:
        yield
    except (Exception, SystemExit) as error:
        place, line, _ = last_user_line(error, path.absolute())
        where = place.name if place.is_file() else name
        where += f", line {line}" if line else ""
        when = "" if time is None else f", at {time:.3f} s"
        raise BadInputError(f"{where}{when}: {error_text(error)}") from error
    finally:
        if folder in sys.path:
            sys.path.remove(folder)
