"""A Data belongs to one thread at a time, and what interrupts a verb finds it whole."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import Any
from unittest.mock import Mock, patch

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.errors import (
    BadInputError,
    BusyDataError,
    ClosedDataError,
    DivergedError,
    EngineError,
)
from statemachine.interface import DERIVED

from .support.backends import readable_arrays, registered
from .support.claims import refused
from .support.data_uses import meanwhile
from .support.motions import bits, opened
from .support.patches import interrupted_at
from .support.processes import runs_in_silence
from .support.requirements import ROOT
from .support.small_models import crowded

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


@pytest.fixture
def model(box: sm.Model) -> sm.Model:
    return box


@pytest.mark.parametrize("name", USES)
@pytest.mark.parametrize(("verb", "hook"), [("bulk", "_advance"), ("reset", "_reset")])
def test_a_second_thread_is_refused_while_one_steps_or_resets(
    model: sm.Model, verb: str, hook: str, name: str
) -> None:
    """And the Data is not one that diverged: it is only in the middle of something."""
    if name in DERIVED and name not in readable_arrays(model):
        pytest.skip(f"{model.backend} tells no {name}")
    with opened(model, 0, nstep=20) as (_, data), opened(model, 0, nstep=20) as (_, alone):
        raised = meanwhile(data, lambda: USES[name](model, data), hook)
        for each in (data, alone):
            USES[verb](model, each)
            sm.step(model, each, 3)
        assert [type(error) for error in raised] == [BusyDataError]
        assert np.array_equal(data.qacc, alone.qacc)
        assert sm.get_state(model, data) == sm.get_state(model, alone)
        USES[name](model, data)  # afterwards nothing is held any more


@contextmanager
def in_each_step(act: Callable[[], object]) -> Iterator[None]:
    """Let something happen in the middle of each step of MuJoCo, by a callback of its own."""
    mujoco.set_mjcb_control(lambda _model, _data: act())
    try:
        yield
    finally:
        mujoco.set_mjcb_control(None)


def is_refused(model: sm.Model, data: sm.Data) -> bool:
    """Tell whether a Data refuses all but a reset and a State."""
    try:
        sm.get_state(model, data)
    except DivergedError:
        return True
    return False


def test_a_callback_may_use_what_its_own_data_offers(mujoco_arm: sm.Model) -> None:
    """A callback, a signal handler, a backend's hook: the same thread is not a second one."""
    use = Mock(side_effect=lambda: (data.site_xpos, sm.get_state(mujoco_arm, data)))
    with sm.make_data(mujoco_arm) as data, in_each_step(use):
        sm.step(mujoco_arm, data)
    use.assert_called_once_with()


@pytest.mark.slow
def test_two_data_in_two_threads_equal_serial(
    model: sm.Model, request: pytest.FixtureRequest
) -> None:
    """PyBullet's share the Model's ghost and mirror, which poses and forward go through."""

    arrays = [name for name in readable_arrays(model) if name != "contacts"]

    def run(seed: int) -> list[bytes]:
        generator, blobs = np.random.default_rng(seed), []
        with opened(model, 0) as (_, data):
            for k in range(150):
                data.ctrl[:] += generator.normal(scale=0.02, size=model.nu)
                sm.step(model, data, 1 + k % 3)
                if k % 3 == 0:
                    sm.forward(model, data)
                    blobs += [getattr(data, name).tobytes() for name in arrays]
                    blobs.append(sm.get_state(model, data).blob)
        return blobs

    serial = [run(seed) for seed in range(2)]
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-5)  # so that they interrupt each other everywhere
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(run, range(2))) == serial


@pytest.fixture
def mid_contact(request: pytest.FixtureRequest) -> Iterator[tuple[sm.Model, sm.Data]]:
    """The held box on a backend, whose name may have " as it comes" behind it."""
    name = request.param.removesuffix(" as it comes")
    defaults: Any = "model" if name == request.param else "engine"
    with (
        registered("hidden", "tests.support.hidden_world:load"),
        opened(sm.load("so101/scene_box", name, defaults=defaults), 0, nstep=20) as opened_data,
    ):
        yield opened_data


INTERRUPTED: dict[str, Use] = {
    "step": lambda model, data: sm.step(model, data, 2),
    "reset": lambda model, data: sm.reset(model, data, 0),
    "set_state": USES["set_state"],
    "forward": USES["forward"],
    "get_state": USES["get_state"],
    "read": lambda model, data: (
        sm.forward(model, data),
        data.qfrc_bias,
        model.capabilities.behaviours["forces by part"].support != "unsupported" and data.qacc,
    ),
}


@pytest.mark.filterwarnings("ignore:Exception ignored in. <finalize")  # of a Data before
@pytest.mark.parametrize("verb", INTERRUPTED)
@pytest.mark.parametrize(
    "mid_contact",
    [
        "mujoco",
        pytest.param("pybullet", marks=pytest.mark.slow),
        pytest.param("pybullet as it comes", marks=pytest.mark.slow),
        "hidden",
    ],
    indirect=True,
)
def test_an_interrupted_verb_completes_or_undoes_or_refuses(
    mid_contact: tuple[sm.Model, sm.Data], verb: str
) -> None:
    """Before each line in turn; the future is that of a Data that nobody interrupted.

    An engine as it comes runs the same lines of ours: before every third of them.
    """
    model, data = mid_contact
    call = INTERRUPTED[verb] if verb != "set_state" else lambda m, d: sm.set_state(m, d, base)
    base, futures = sm.get_state(model, data), {}
    sm.step(model, data, 20)
    start = sm.get_state(model, data)
    with sm.make_data(model) as twin:
        for use in (lambda *_: None, call):
            sm.set_state(model, twin, start)
            use(model, twin)
            now = sm.get_state(model, twin)
            sm.step(model, twin, 5)
            futures[now] = sm.get_state(model, twin)
    at, stride = 0, 3 if model.defaults == "engine" else 1
    if verb == "read":  # which goes through thousands of lines
        stride *= 25
    sm.set_state(model, data, start)
    while interrupted_at(at := at + stride, lambda: call(model, data), "statemachine"):
        if is_refused(model, data):
            uses = sm.step, sm.forward, sm.get_state, lambda _, data: data.contacts
            refused(*((DivergedError, "interrupted", partial(use, model, data)) for use in uses))
            call(model, data)
        now = sm.get_state(model, data)
        assert now in futures, at
        sm.step(model, data, 5)
        assert sm.get_state(model, data) == futures[now], at
        sm.set_state(model, data, start)
    assert at > 5


@pytest.mark.parametrize(
    "mid_contact",
    [
        *("mujoco", "hidden"),
        pytest.param(
            "pybullet",
            marks=pytest.mark.xfail(
                strict=True, reason="what was not read before the interrupt comes from the mirror"
            ),
        ),
    ],
    indirect=True,
)
def test_an_interrupted_step_leaves_what_is_derived(
    mid_contact: tuple[sm.Model, sm.Data],
) -> None:
    model, derived = mid_contact[0], list[list[bytes]]()
    for at in range(0, 90, 3):
        with opened(model, 0, nstep=40) as (_, data):
            before = sm.get_state(model, data)
            if at:
                interrupted_at(at, lambda data=data: sm.step(model, data, 3), "statemachine")
            if sm.get_state(model, data) == before:
                derived.append(bits(data))
    assert len(derived) > 2
    assert derived == derived[:1] * len(derived)


def test_a_state_that_is_refused_leaves_the_data_as_it_was() -> None:
    with opened(sm.load("so101"), nstep=3) as (model, data):
        before = sm.get_state(model, data)
        with patch.object(MujocoData, "_set_state", Mock(side_effect=BadInputError("no"))):
            refused((BadInputError, "", lambda: sm.set_state(model, data, before)))
        assert sm.get_state(model, data) == before


def test_an_engine_that_gives_up_in_forward_is_an_error_of_ours(tmp_path: Any) -> None:
    with opened(crowded(tmp_path, 30, "100K")) as (model, data):
        refused(
            (EngineError, "gave up", lambda: sm.forward(model, data)),
            (DivergedError, "gave up", lambda: sm.forward(model, data)),
        )


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_what_another_thread_holds_at_a_fork_is_free_in_the_child() -> None:
    """It has no such thread; what was half done there is overwritten first.

    What the thread holds that forks, in a callback, stays its own.
    """
    code = """
import os, threading
import statemachine as sm

model = sm.load("so101/scene_box")
data, other, mine = (sm.make_data(model) for _ in range(3))
advance, begun, ended = data._advance, threading.Event(), threading.Event()

def wait(*args):
    begun.set()
    ended.wait(20)

def refused(call, *args):
    try:
        call(*args)
    except sm.errors.StateMachineError as error:
        return type(error).__name__, "at the fork" in str(error)

def fork(*args):
    global child
    child = os.fork()
    sm.get_state(model, mine)
    found = []
    thread = threading.Thread(target=lambda: found.append(refused(sm.get_state, model, mine)))
    thread.start()
    thread.join()
    assert found == [("BusyDataError", False)], found

data._advance, mine._advance = wait, fork
thread = threading.Thread(target=sm.step, args=(model, data))
thread.start()
begun.wait(10)
sm.step(model, mine)
if not child:
    data._advance = advance
    for use in (sm.step, sm.forward, sm.get_state):
        assert refused(use, model, data) == ("DivergedError", True)
    for each in (data, other):
        sm.reset(model, each, 0)
        sm.step(model, each, 5)
    os._exit(sm.get_state(model, data) != sm.get_state(model, other))
_, status = os.waitpid(child, 0)
ended.set()
thread.join()
raise SystemExit(status)
"""
    runs_in_silence(code, ROOT)


def test_a_data_closed_by_a_callback_in_a_step_says_so(mujoco_arm: sm.Model) -> None:
    """What a callback does to its own Data holds when the step around it has ended."""
    data = sm.make_data(mujoco_arm)
    with in_each_step(data.close):
        sm.step(mujoco_arm, data)
    refused((ClosedDataError, "", lambda: sm.step(mujoco_arm, data)))
