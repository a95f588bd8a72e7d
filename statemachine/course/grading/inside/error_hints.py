"""What to write instead, for errors whose own text a beginner cannot read.

Nothing here knows what is right in an exercise: each hint is about a use of Python, NumPy, MuJoCo
or the interface that cannot work.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from types import ModuleType
from typing import NamedTuple

from ....errors import did_you_mean
from ....interface import DERIVED, Model

# What gives the number that belongs into the brackets of an array, by how the array's name begins;
# the first that fits counts.
_NUMBERS_OF = {
    "qpos": 'model.jnt_qposadr[model.joint_id("{name}")]',
    "qvel": 'model.jnt_dofadr[model.joint_id("{name}")]',
    "qacc": 'model.jnt_dofadr[model.joint_id("{name}")]',
    "qfrc_": 'model.jnt_dofadr[model.joint_id("{name}")]',
    "dof_": 'model.jnt_dofadr[model.joint_id("{name}")]',
    "ctrl": 'model.actuator_id("{name}")',
    "actuator_": 'model.actuator_id("{name}")',
    "site_": 'model.site_id("{name}")',
    "geom_": 'model.geom_id("{name}")',
    "jnt_": 'model.joint_id("{name}")',
    "x": 'model.body_id("{name}")',
    "body_": 'model.body_id("{name}")',
}
_NAME_IN_BRACKETS = re.compile(r"((?:\w+\.)*)(\w+)\[\s*(?:[\"']([^\"']+)[\"']|(\w+))\s*\]")

# The texts; slots are filled by the functions below, or by the groups of the error's own text.
_NAME_FOR_NUMBER = "{array} takes a number in brackets, not a name: write {array}[{number}]"
_NO_NUMBER = (
    "an array takes a number in brackets, not a name: model.joint_id(…) gives the number of a joint"
)
_DERIVED = (
    "this array is read-only, because it is derived: write data.qpos, data.qvel or data.ctrl, and "
    "call sm.forward(model, data)"
)
_CONSTANT = "this array is read-only: a Model never changes, and model.replace(…) gives another"
_OTHER_LENGTH = (
    "{left} numbers were written into {right}. Here qpos has {nq} (model.nq), qvel {nv} (model.nv) "
    "and ctrl {nu} (model.nu)"
)
_RAW = "MuJoCo's own functions take MuJoCo's own objects: give them model.raw and data.raw"
_JOINT_TYPE = (
    "model.jnt_type has plain numbers: JointType(model.jnt_type[k]) has .nq, .nv and .name"
)
_ASSERTION = (
    "this assert failed. Where the result may be either, return what you compared, and do not "
    "assert it"
)
_MISSING_ARGUMENT = "{verb} needs the model and the data: sm.{verb}(model, data)"
_WHOLE_NUMBER = "a whole number is needed where there is a float: round(…) makes one"
_NO_DATA = "there is no data yet: data = sm.make_data(model)"
_NO_MODULE = "statemachine has no {name}{hint}"


def _misnamed(error: BaseException, code: str, model: Model) -> str:
    """Return which number belongs into the brackets where there is a name."""
    for path, array, quoted, variable in _NAME_IN_BRACKETS.findall(code):
        for beginning, number in _NUMBERS_OF.items():
            if array.startswith(beginning):
                text = number.format(name=quoted)
                if variable:
                    text = number.replace('"{name}"', variable)
                return _NAME_FOR_NUMBER.format(array=path + array, number=text)
    return _NO_NUMBER


def _read_only(error: BaseException, code: str, model: Model) -> str:
    """Return why an array cannot be written to: it is derived, or the Model's."""
    return _DERIVED if any(name in code for name in DERIVED) else _CONSTANT


def _of_other_length(error: BaseException, code: str, model: Model) -> str:
    """Return how long the inputs are, where arrays of two lengths do not fit."""
    left, right = re.findall(r"\((\d+),\)", str(error))
    return _OTHER_LENGTH.format(left=left, right=right, nq=model.nq, nv=model.nv, nu=model.nu)


def _without_argument(error: BaseException, code: str, model: Model) -> str:
    """Return how a verb is called."""
    return _MISSING_ARGUMENT.format(verb=str(error).partition("(")[0])


def _unknown_in_module(error: BaseException, code: str, model: Model) -> str:
    """Return the name that was meant, of what `import statemachine as sm` has; "" for its own."""
    if not isinstance(error, AttributeError) or not isinstance(error.obj, ModuleType):
        return ""
    if "; " in str(error):  # it says what to write
        return ""
    hint = did_you_mean(error.name, dir(error.obj), show="sm.{}".format)
    return _NO_MODULE.format(name=error.name, hint=hint)


class _ErrorHint(NamedTuple):
    """Hint for one kind of error.

    Attributes:
        kind: The type of the error.
        pattern: What its text begins with, a regular expression.
        hint: What is said; or what works it out of the error, the line of code and the Model.
    """

    kind: type[BaseException]
    pattern: str
    hint: str | Callable[[BaseException, str, Model], str]


_HINTS = (
    _ErrorHint(IndexError, "only integers, slices", _misnamed),
    _ErrorHint(ValueError, "assignment destination is read-only", _read_only),
    _ErrorHint(
        ValueError, r"could not broadcast input array from shape \(\d+,\) into shape \(\d+,\)",
        _of_other_length,
    ),
    _ErrorHint(TypeError, r"mj_\w+\(\): incompatible function arguments", _RAW),
    _ErrorHint(TypeError, r"__init__\(\): incompatible constructor arguments.*MjData", _RAW),
    _ErrorHint(
        AttributeError, r"'(?:numpy\.)?int\d*' object has no attribute '(?:nq|nv|name)'",
        _JOINT_TYPE,
    ),
    _ErrorHint(AttributeError, "module 'statemachine' has no attribute", _unknown_in_module),
    _ErrorHint(AssertionError, "$", _ASSERTION),
    _ErrorHint(TypeError, r"(?:step|forward|reset)\(\) missing", _without_argument),
    _ErrorHint(
        TypeError, r"'(?:float|numpy.float64)' object cannot be interpreted as an integer",
        _WHOLE_NUMBER,
    ),
    _ErrorHint(TypeError, "slice indices must be integers", _WHOLE_NUMBER),
    _ErrorHint(NameError, "name 'data' is not defined", _NO_DATA),
)  # fmt: skip


def hint_of(error: BaseException, code: str, model: Model) -> str:
    """Return what to write instead of what raised an error; "" where nothing is known.

    Args:
        error: That ended a student's function.
        code: The line of the student's file in which it was raised.
        model: What the function got.
    """
    text = " ".join(str(error).split())
    for kind, pattern, hint in _HINTS:
        if isinstance(error, kind) and re.match(pattern, text):
            return hint if isinstance(hint, str) else hint(error, code, model)
    return ""
