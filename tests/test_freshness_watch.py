"""Watching for stale reads: what is counted, where it was read, and that nothing stays behind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, ClosedDataError, StaleReadError
from statemachine.freshness.watch import Watch
from statemachine.interface import Data, Model

from .support.backends import each_of_both, readable_arrays
from .support.claims import assert_has, assert_in, refused
from .support.motions import opened

TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)


# What a program gets wrong shows by value.


@pytest.fixture
def pushed() -> Iterator[tuple[Model, Data]]:
    """An arm with a force that only the engine's own object takes, written after `forward`."""
    with opened(sm.load("so101"), derived=True) as (model, data):
        data.raw.qfrc_applied[1] = 0.1
        yield model, data


def test_what_is_written_past_the_interface_is_stale(pushed: tuple[Model, Data]) -> None:
    assert "qacc" in sm.freshness(*pushed).stale


def test_a_watch_sees_what_is_written_past_the_interface(pushed: tuple[Model, Data]) -> None:
    model, data = pushed
    with sm.watch_freshness(model, data, raise_on_stale=True):
        error = refused((StaleReadError, "qacc", lambda: data.qacc))
    assert_has(error, name="qacc", steps=None)


# Watching.


@pytest.fixture
def watched(box: Model) -> Iterator[Data]:
    """A Data under watch, from before anything was computed of it."""
    with sm.make_data(box) as data, sm.watch_freshness(box, data):
        yield data


def count(model: Model, data: Data, name: str) -> tuple[str, int | None, int | None]:
    """Return of which moment an array is, and how many steps and writes ago that was."""
    row = sm.freshness(model, data)[name]
    return row.of, row.steps, row.writes


def write_four_times(model: Model, data: Data) -> None:
    """Write once to qpos, and three times to ctrl in three ways."""
    data.qpos[1] = 0.8
    data.ctrl[:] = 0.2
    data.ctrl[2] = 0.3
    data.ctrl[2] = 0.3  # the same again is not a change
    data.ctrl = np.full(model.nu, 0.1)


def test_what_was_never_computed_has_no_counts(box: Model, watched: Data) -> None:
    assert count(box, watched, "xpos") == ("never computed", None, None)


def test_what_forward_computes_is_of_now(box: Model, watched: Data) -> None:
    sm.forward(box, watched)
    assert count(box, watched, "xpos") == ("now", 0, 0)


@each_of_both
def test_writes_are_counted_of_what_an_array_depends_on(box: Model, watched: Data) -> None:
    sm.forward(box, watched)
    write_four_times(box, watched)
    assert count(box, watched, "xpos") == ("1 write ago", 0, 1)
    assert count(box, watched, "qfrc_actuator") == ("4 writes ago", 0, 4)


def test_the_entries_that_were_written_are_named(box: Model, watched: Data) -> None:
    sm.forward(box, watched)
    write_four_times(box, watched)
    written = sm.freshness(box, watched).written
    assert written[:2] == ("qpos[1] (shoulder_lift)", "ctrl[0] (shoulder_pan)")


@each_of_both
def test_a_value_that_is_back_where_it_was_makes_poses_of_now(box: Model, watched: Data) -> None:
    sm.forward(box, watched)
    write_four_times(box, watched)
    watched.qpos[1] = 0.0
    assert count(box, watched, "xpos") == ("now", 0, 0)
    assert count(box, watched, "qfrc_actuator") == ("5 writes ago", 0, 5)


def test_a_step_begins_the_counts_anew(box: Model, watched: Data) -> None:
    sm.forward(box, watched)
    write_four_times(box, watched)
    sm.step(box, watched, 12)
    assert count(box, watched, "xpos") == ("1 step ago", 1, 0)


@each_of_both
def test_writes_after_a_step_are_counted_beside_it(box: Model, watched: Data) -> None:
    watched.ctrl[:] = 0.1
    sm.step(box, watched, 12)
    watched.qpos[1] += 0.1
    assert count(box, watched, "xpos")[1:] == (1, 1)
    assert sm.freshness(box, watched).written == ("qpos[1] (shoulder_lift)",)
    watched.qvel[1] = 3.0
    watched.ctrl[1] = 0.7
    assert count(box, watched, "qfrc_bias")[1:] == (1, 2)  # ctrl is not its
    assert count(box, watched, "qfrc_actuator")[1:] == (1, 3)


@pytest.mark.parametrize("verb", ["reset", "set_state"])
def test_nothing_was_computed_of_a_state_that_was_put_in(
    box: Model, watched: Data, verb: str
) -> None:
    state = sm.get_state(box, watched)
    sm.forward(box, watched)
    if verb == "reset":
        sm.reset(box, watched)
    else:
        sm.set_state(box, watched, state)
    assert count(box, watched, "xpos") == ("never computed", None, None)


def test_a_watch_begins_with_the_step_that_is_found(arm: Model) -> None:
    with opened(arm, ctrl=0.3, nstep=10) as (model, data), sm.watch_freshness(model, data):
        data.qpos[0] += 0.1
        assert count(model, data, "xpos")[1:] == (1, 1)


def test_a_watch_begins_with_an_earlier_state_where_none_is_found(arm: Model) -> None:
    with opened(arm, ctrl=0.3, nstep=10) as (model, data):
        sm.forward(model, data)
        data.qpos[0] += 0.1
        with sm.watch_freshness(model, data):
            data.qpos[0] += 0.1
            assert sm.freshness(model, data)["xpos"].of == "an earlier state"


@pytest.fixture
def strict(box: Model) -> Iterator[Data]:
    """A Data under a watch that raises on a stale read."""
    with sm.make_data(box) as data, sm.watch_freshness(box, data, raise_on_stale=True):
        yield data


def test_what_was_never_computed_cannot_be_read(strict: Data) -> None:
    error = refused((StaleReadError, "never computed", lambda: strict.xpos))
    assert_has(error, name="xpos", steps=None, writes=None)


def test_all_can_be_read_after_forward(box: Model, strict: Data) -> None:
    sm.forward(box, strict)
    for name in readable_arrays(box):
        getattr(strict, name)


@each_of_both
def test_only_what_depends_on_a_write_cannot_be_read(box: Model, strict: Data) -> None:
    sm.forward(box, strict)
    strict.qvel[0] = 0.5
    _ = strict.site_xpos, strict.xquat  # do not depend on it
    refused((StaleReadError, "", lambda: strict.qfrc_passive))


def test_a_stale_read_says_how_old_and_how_far_off_it_is(box: Model, strict: Data) -> None:
    sm.forward(box, strict)
    strict.qvel[0], strict.qpos[1] = 0.5, 0.8
    error = refused((StaleReadError, r"sm\.forward\(model, data\)", lambda: strict.site_xpos))
    assert_has(error, name="site_xpos", steps=0, writes=1)
    millimetres = 1e3 * error.gaps[0].size
    assert millimetres == pytest.approx(270, abs=1)
    assert_in(str(error), f"{millimetres:.3g} mm", "gripperframe", "qpos[1]")


def test_contacts_that_are_stale_cannot_be_read(box: Model, strict: Data) -> None:
    sm.forward(box, strict)
    strict.qvel[0], strict.qpos[1] = 0.5, 0.8
    error = refused((StaleReadError, "", lambda: strict.contacts))
    assert_has(error, name="contacts", steps=0, writes=2)
    assert "appears" in {gap.unit for gap in error.gaps}


def test_all_can_be_read_where_everything_is_back(box: Model, strict: Data) -> None:
    sm.forward(box, strict)
    strict.qvel[0], strict.qpos[1] = 0.5, 0.8
    strict.qpos[1] = strict.qvel[0] = 0.0
    _ = strict.contacts, strict.xpos


def test_poses_cannot_be_read_after_a_step(box: Model, strict: Data) -> None:
    sm.step(box, strict, 3)
    error = refused((StaleReadError, "", lambda: strict.xpos))
    assert_has(error, name="xpos", steps=1, writes=0)
    assert error.gaps[0].unit == "m"


def test_a_stale_read_has_no_gap_where_a_coordinate_is_no_number(box: Model, strict: Data) -> None:
    sm.step(box, strict, 3)
    strict.qpos[1] = np.nan
    error = refused((StaleReadError, "", lambda: strict.xpos))
    assert_has(error, steps=1, writes=1, gaps=())


@pytest.fixture
def hold(box: Model) -> tuple[Watch, list[float]]:
    """0.3 s of the lesson's hold whose controller reads the fingertip, which is one step behind.

    Returns:
        The watch; and how far off each read was [m].
    """
    lags: list[float] = []
    with sm.make_data(box) as data:
        data.ctrl[:6] = TARGET
        with sm.watch_freshness(box, data) as watch:
            for _ in range(60):
                sm.step(box, data)
                read_the_tip(data)
                lags.append(sm.freshness(box, data)["site_xpos"].gaps[0].size or 0.0)
            sm.forward(box, data)
            read_the_tip(data)
        read_the_tip(data)  # nobody watches any more
    return watch, lags


def read_the_tip(data: Data) -> None:
    _ = data.site_xpos


def test_a_watch_counts_all_reads_until_its_end(hold: tuple[Watch, list[float]]) -> None:
    assert hold[0].reads == 61


def test_a_watch_names_the_line_that_reads(hold: tuple[Watch, list[float]]) -> None:
    (read,) = hold[0].stale_reads
    place = f"{Path(__file__).name}:{read_the_tip.__code__.co_firstlineno + 1}"
    assert_has(read, name="site_xpos", count=60, of="1 step ago", place=place)


@each_of_both
def test_a_watch_keeps_the_worst_read(hold: tuple[Watch, list[float]]) -> None:
    (read,), lags = hold[0].stale_reads, hold[1]
    assert read.gaps[0].size == max(lags) == pytest.approx(9.95e-3, abs=1e-5)
    assert lags[-1] < max(lags)


def test_the_table_of_a_watch_fits(hold: tuple[Watch, list[float]]) -> None:
    lines = str(hold[0]).splitlines()
    assert lines[0].split()[:3] == ["60", "of", "61"]
    assert max(map(len, lines)) <= 80


def test_a_data_under_watch_is_of_its_kind(box: Model) -> None:
    with sm.make_data(box) as data:
        kind = type(data)
        with sm.watch_freshness(box, data):
            assert isinstance(data, kind)
            assert type(data).__name__ == kind.__name__
        assert type(data) is kind


def test_steps_and_reads_after_a_watch_are_not_counted(box: Model) -> None:
    with sm.make_data(box) as data:
        with sm.watch_freshness(box, data) as watch:
            sm.step(box, data)
        sm.step(box, data)
        _ = data.xpos
    assert (watch.reads, watch.stale_reads) == (0, ())


def test_a_data_is_watched_once_at_a_time(box: Model) -> None:
    with sm.make_data(box) as data, sm.watch_freshness(box, data):
        second = sm.watch_freshness(box, data)
        refused((BadInputError, "watched already", second.__enter__))


def test_a_data_may_be_closed_under_watch(box: Model) -> None:
    with sm.make_data(box) as data:
        with sm.watch_freshness(box, data):
            data.close()
            assert data.qpos.shape == (box.nq,)
        refused((ClosedDataError, "", lambda: data.xpos))
