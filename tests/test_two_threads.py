"""A Data belongs to one thread at a time: the second is refused, and disturbs nothing."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import errors

from .conftest import need_engine

Use = Callable[[sm.Model, sm.Data], object]
USES: dict[str, Use] = {
    "step": lambda model, data: sm.step(model, data),
    "bulk": lambda model, data: sm.step(model, data, 20),
    "forward": lambda model, data: sm.forward(model, data),
    "reset": lambda model, data: sm.reset(model, data),
    "get_state": lambda model, data: sm.get_state(model, data),
    "set_state": lambda model, data: sm.set_state(model, data, sm.get_state(model, data)),
    "close": lambda _, data: data.close(),
    "with": lambda _, data: data.__exit__(),
    "contacts": lambda _, data: data.contacts,
    "xpos": lambda _, data: data.xpos,
    "site_xmat": lambda _, data: data.site_xmat,
    "qacc": lambda _, data: data.qacc,
    "qfrc_bias": lambda _, data: data.qfrc_bias,
    "qfrc_contact": lambda _, data: data.qfrc_contact,
}


@pytest.fixture(params=["mujoco", "pybullet"])
def model(request: pytest.FixtureRequest) -> sm.Model:
    need_engine(request.param)
    return sm.load("so101/scene_box", backend=request.param)


def _meanwhile(data: sm.Data, use: Callable[[], object]) -> list[Exception | None]:
    """Let another thread use something in the middle of the next step; what it raised."""
    right, raised = data._advance, []

    def work() -> None:
        try:
            use()
        except Exception as error:
            raised.append(error)
        else:
            raised.append(None)

    def advance(*args: object) -> None:
        object.__setattr__(data, "_advance", right)
        right(*args)
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()

    object.__setattr__(data, "_advance", advance)
    return raised


@pytest.mark.parametrize("name", USES)
def test_a_second_thread_is_refused_while_one_steps(model: sm.Model, name: str) -> None:
    with sm.make_data(model) as data, sm.make_data(model) as alone:
        for each in (data, alone):
            sm.reset(model, each, keyframe=0)
            sm.step(model, each, 20)
        raised = _meanwhile(data, lambda: USES[name](model, data))
        for each in (data, alone):
            sm.step(model, each, 3)
        (error,) = raised
        assert isinstance(error, errors.BusyDataError)
        assert np.array_equal(data.qacc, alone.qacc)
        assert sm.get_state(model, data) == sm.get_state(model, alone)
        USES[name](model, data)  # afterwards nothing is held any more


@pytest.mark.parametrize("name", USES)
def test_a_reset_under_way_is_a_busy_data(
    model: sm.Model, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not one that diverged: it is only in the middle of a reset."""
    raised: list[Exception] = []

    def use() -> None:
        try:
            USES[name](model, data)
        except Exception as error:
            raised.append(error)

    with sm.make_data(model) as data:
        right = type(data)._reset

        def slow(self: Any, key: int | None) -> None:
            thread = threading.Thread(target=use)
            thread.start()
            thread.join()
            right(self, key)

        with monkeypatch.context() as patch:
            patch.setattr(type(data), "_reset", slow)
            sm.reset(model, data)
        assert [type(error) for error in raised] == [errors.BusyDataError]
        USES[name](model, data)


def test_another_data_is_not_refused(model: sm.Model) -> None:
    """The Model, and what its Data share behind it, may be used by all threads."""
    with sm.make_data(model) as data, sm.make_data(model) as other:

        def use() -> None:
            sm.step(model, other, 5)
            sm.forward(model, other)
            assert other.qacc.any()
            with sm.make_data(model) as third:
                sm.step(model, third)

        raised = _meanwhile(data, use)
        sm.step(model, data)
        assert raised == [None]


def test_nothing_of_two_threads_is_lost(model: sm.Model) -> None:
    """Both step one Data as fast as they can: each step counts, or is refused."""
    taken: list[int] = []

    def work(data: sm.Data) -> None:
        count = 0
        for _ in range(150):
            try:
                sm.step(model, data, 2)
            except errors.BusyDataError:
                pass
            else:
                count += 1
        taken.append(count)

    with sm.make_data(model) as data, sm.make_data(model) as alone:
        _together(work, data)
        for _ in range(sum(taken)):
            sm.step(model, alone, 2)
        assert sm.get_state(model, data) == sm.get_state(model, alone)


def _together(work: Callable[..., Any], *args: object) -> None:
    threads = [threading.Thread(target=work, args=args) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
