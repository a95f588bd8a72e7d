"""What two compiled models differ in: every array is compared, and edits undo a difference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.mujoco import compared_fields as fields
from statemachine.engines.mujoco.differences import differences, edited, entries
from statemachine.lab.compare.matching import match_models

from .support.explained import ALONE, ARM, changed
from .support.files import written


def test_every_array_of_a_compiled_model_is_compared_or_has_no_effect() -> None:
    """A later engine may have more of them: then this fails, and the tables are to grow."""
    raw = sm.load("so101/scene").compiled
    arrays = [n for n in dir(raw) if n[0] != "_" and isinstance(getattr(raw, n), np.ndarray)]
    assert [name for name in arrays if not fields.known(name)] == []


def test_every_option_of_a_compiled_model_is_compared() -> None:
    options = sm.load("so101/scene").compiled.opt
    known = {name for names in fields.OPTIONS.values() for name in names} | set(fields.FLAGS)
    assert [name for name in dir(options) if name[0] != "_" and name not in known] == []


def test_flags_that_change_no_motion_are_flags_of_the_engine() -> None:
    flags = {*mujoco.mjtDisableBit.__members__, *mujoco.mjtEnableBit.__members__}
    assert set(fields.IDLE_FLAGS) <= flags


# Compared only where something else of the file makes them act; they have tests of their own.
ACTS_WITH_AN_OPTION = ("body_gravcomp", "actuator_group", "tree_sleep_policy")


def _changed_entry(entry: np.ndarray) -> np.ndarray:
    """Return another value of the same kind: a flag, a number of an enumeration, a figure."""
    if entry.dtype.kind == "b":
        return ~entry
    return entry + (1 if entry.dtype.kind == "i" else 0.01)


@pytest.mark.slow
def test_each_figure_of_a_model_is_found_and_equalized() -> None:
    """One entry of each array is changed: the list has it, and the edits undo it."""
    left, random = sm.load("so101/scene_box"), np.random.default_rng(0)
    raw, tried = left.compiled, 0
    for row in (row for rows in fields.ROWS.values() for row in rows):
        name = row.fields[0]
        array = getattr(raw, name)
        places = np.arange(len(array))
        if name.startswith("geom"):
            places = np.flatnonzero(raw.geom_contype | raw.geom_conaffinity)
        if not len(places) or row.when or name in ACTS_WITH_AN_OPTION:
            continue
        place = int(random.choice(places))
        edit = name, (place,), _changed_entry(np.array(array[place]))
        right = left.with_compiled(edited(raw, [edit]))
        (found,) = differences(raw, right.compiled, match_models(left, right))
        assert np.array_equal(getattr(edited(right.compiled, found.edits), name), array), name
        tried += 1
    assert tried > 15


def _is_same(left: Any, right: Any) -> bool:
    """Tell whether two arrays are equal but for rounding; a range without an end has any."""
    if left.shape != right.shape or left.dtype.kind != "f":
        return np.array_equal(left, right)
    no_end = np.isinf(left) | np.isinf(right)
    return bool((no_end | np.isclose(left, right, rtol=1e-9, atol=1e-15)).all())


@pytest.mark.parametrize("name", ALONE)
def test_entries_equalize_what_the_whole_difference_equalizes(name: str, tmp_path: Path) -> None:
    texts = ARM, changed(ARM, ALONE[name])
    left, right = (sm.load(written(tmp_path / f"{k}.xml", text)) for k, text in enumerate(texts))
    found = differences(left.compiled, right.compiled, match_models(left, right))
    parts = [part for each in found for part in entries(right.compiled, each)]
    by_whole, by_entries = (
        edited(right.compiled, [edit for each in those for edit in each.edits])
        for those in (found, parts)
    )
    arrays = [n for n in dir(by_whole) if isinstance(getattr(by_whole, n), np.ndarray)]
    other = [n for n in arrays if not _is_same(getattr(by_whole, n), getattr(by_entries, n))]
    assert len(arrays) > 100
    assert other == []
