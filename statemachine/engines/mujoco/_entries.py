"""A difference of two compiled models as its single entries, each brought over by itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..records import Edit, ModelDifference
from ._figures import plain, same

# Fields whose entries mean something one by one, and what each is called; a name with {} is of all.
_AXES, _ENDS, _NUMBERED = ("x", "y", "z"), ("lower end", "upper end"), ("{}[{}]",)
_SPLIT: dict[str, Sequence[str]] = {
    **dict.fromkeys(
        (
            *("body_ipos", "body_pos", "jnt_pos", "geom_pos", "site_pos", "geom_surfacevel"),
            *("opt.gravity", "opt.wind", "opt.magnetic"),
        ),
        _AXES,
    ),
    **dict.fromkeys(
        (
            *("jnt_range", "jnt_actfrcrange", "tendon_range", "tendon_actfrcrange"),
            *("actuator_ctrlrange", "actuator_forcerange", "actuator_actrange"),
        ),
        _ENDS,
    ),
    **dict.fromkeys(
        ("body_inertia", "geom_size", "geom_friction", "pair_friction", "actuator_gear"), _NUMBERED
    ),
    **dict.fromkeys(("actuator_gainprm", "actuator_biasprm"), _NUMBERED),
}
_CALLED = {"body_inertia": "diaginertia"}
# A difference that sets one of these is a thing of one piece: the rest means something else then.
_KINDS = ("geom_type", "actuator_gaintype", "actuator_biastype", "actuator_dyntype", "body_iquat")
_TURNS = ("body_quat", "geom_quat", "site_quat")


def entries(two: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
    """A difference by its entries, or itself where it is of one piece.

    Args:
        two: The compiled model that its edits are of.
        difference: One of `differences`.
    """
    edits = [edit for edit in difference.edits if not same(edit[2], _now(two, edit))]
    whole = difference.edits_one or difference.refused or difference.subject.startswith("extra ")
    if whole or any(_is_of_one_piece(name, index) for name, index, _ in edits):
        return (difference,)
    found = tuple(_as_entries(two, difference, edits))
    return found if len(found) > 1 else (difference,)


def _is_of_one_piece(name: str, index: tuple[Any, ...]) -> bool:
    flag = name in _KINDS or name.endswith("limited")
    return flag or any(isinstance(each, slice) for each in index)


def _as_entries(
    two: Any, difference: ModelDifference, edits: Sequence[Edit]
) -> Iterator[ModelDifference]:
    rest = list(edits)
    servo = [edit for edit in edits if edit[0] in ("actuator_gainprm", "actuator_biasprm")]
    if len(servo) == 2 and all(_is_servo(values) for values in _gains(two, servo)):
        # The gain of a servo stands in two places.
        (gain, index, ours), (bias, _, others) = servo
        pair: tuple[Edit, ...] = (
            (gain, (*index, 0), float(ours[0])),
            (bias, (*index, 1), float(others[1])),
        )
        yield _entry(difference, "kp", float(ours[0]), float(_now(two, servo[0])[0]), pair)
        rest = [edit for edit in edits if edit not in servo]
        rest += [(bias, (*index, k), float(others[k])) for k in range(2, len(others))]
        rest = [edit for edit in rest if not same(edit[2], _now(two, edit))]
    for edit in rest:
        name, index, value = edit
        now, word = _now(two, edit), _CALLED.get(name, name.partition("_")[2] or name)
        word = word.removeprefix("opt.")
        names = _SPLIT.get(name)
        if names is None or not np.ndim(value):
            number = [k for k in index[1:] if isinstance(k, int)]
            word = f"{word}[{number[0]}]" if number else word
            if name in _TURNS:
                angle = 2 * float(np.arccos(np.clip(abs(np.dot(value, now)), 0.0, 1.0)))
                yield replace(_entry(difference, "turn", 0.0, angle, (edit,)), unit="rad")
            else:
                yield _entry(difference, word, plain(value), plain(now), (edit,))
            continue
        for k in range(len(value)):
            if not same(value[k], now[k]):
                called = names[0].format(word, k) if names is _NUMBERED else names[k]
                part: Edit = (name, (*index, k), float(value[k]))
                yield _entry(difference, called, float(value[k]), float(now[k]), (part,))


def _entry(
    difference: ModelDifference, called: str, one: Any, two: Any, edits: tuple[Edit, ...]
) -> ModelDifference:
    subject = f"{difference.subject} ({called})"
    return replace(difference, subject=subject, values=((called, one, two),), edits=edits)


def _gains(two: Any, servo: Sequence[Edit]) -> Iterator[tuple[Any, Any]]:
    """Gains and biases as they are to be, and as they are."""
    yield servo[0][2], servo[1][2]
    yield _now(two, servo[0]), _now(two, servo[1])


def _is_servo(values: tuple[Any, Any]) -> bool:
    gains, biases = values
    return bool(np.ndim(gains) and gains[0] == -biases[1] and not gains[1:].any() and not biases[0])


def _now(two: Any, edit: Edit) -> Any:
    """What stands where an edit goes."""
    name, index, _ = edit
    holder, _, field = name.rpartition(".")
    owner = getattr(two, holder) if holder else two
    value = getattr(owner, field)
    if holder and not np.ndim(value):
        return bool(value & index[0]) if index else value
    return np.array(value[index]) if index else np.array(value)
