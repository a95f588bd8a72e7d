"""Many worlds: each what one Data would be, bit for bit, on every backend."""

from __future__ import annotations

import os
import pickle
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import worlds as many
from statemachine.errors import (
    BadInputError,
    BusyDataError,
    ClosedDataError,
    DivergedError,
    DivergedWarning,
    ForeignStateError,
    ReadOnlyError,
    StateMachineError,
    UnknownNameError,
    UnsupportedError,
)

from .support.claims import overlapping, refused
from .support.data_uses import meanwhile
from .support.lives import equal, live
from .support.motions import opened, started
from .support.processes import runs_in_silence
from .support.requirements import ROOT, SHARED, shared
from .support.small_models import RICH, loaded, model_of

N = 4


def worlds_of(model: sm.Model, n: int = N, **options: Any) -> many.Worlds:
    return many.make_worlds(model, n, workers=options.pop("workers", 2), **options)


@pytest.fixture(params=["so101", "so101/scene_box"])
def model(request: pytest.FixtureRequest, backend: str) -> sm.Model:
    return sm.load(request.param, backend=backend)


@pytest.fixture
def worlds(box: sm.Model) -> Iterator[many.Worlds]:
    with worlds_of(box) as worlds:
        yield worlds


def commands(model: sm.Model, *shape: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.8, 0.8, (*shape, model.nu))


def test_a_world_is_what_one_data_is(model: sm.Model) -> None:
    with worlds_of(model) as worlds:
        live(worlds, [model] * N, 42)


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("commanded", [False, True])
def test_a_record_is_what_a_loop_reads(box: sm.Model, every: int, commanded: bool) -> None:
    steps = 12
    ctrl = commands(box, N, steps // every)
    fields = ("time", "qpos", "qvel", "ctrl", "xpos", "qfrc_constraint")
    with worlds_of(box) as worlds:
        many.reset(worlds, keyframe=0)
        rows = many.record(worlds, steps, fields, every=every, ctrl=ctrl if commanded else None)
        assert list(rows) == list(fields)
        for i in range(N):
            with started(box) as data:
                for k in range(steps // every):
                    if commanded:
                        data.ctrl = ctrl[i, k]
                    sm.step(box, data, every)
                    for name in fields:
                        assert np.array_equal(rows[name][i, k], getattr(data, name)), (name, i, k)
                equal(worlds, [data] * N, [i])


def single_error(model: sm.Model, spoil: Any, nstep: int) -> Any:
    """What a step of one Data raises after something was spoilt."""
    with opened(model, 0) as (_, data):
        spoil(data)
        return refused((StateMachineError, "", lambda: sm.step(model, data, nstep)))


SPOILS = {
    "a NaN in ctrl": lambda of: of.ctrl.__setitem__((..., 2), np.nan),
    "a NaN in qpos": lambda of: of.qpos.__setitem__((..., 1), np.nan),
    "too fast": lambda of: of.qvel.__setitem__((..., slice(None)), 1e9),
    "a zero quaternion": lambda of: of.qpos.__setitem__((..., slice(9, 13)), 0.0),
}


@pytest.mark.parametrize("what", SPOILS)
@pytest.mark.parametrize("recorded", [False, True])
def test_a_world_that_diverges_leaves_the_others_alone(
    worlds: many.Worlds, what: str, recorded: bool
) -> None:
    model = worlds.model
    many.reset(worlds, keyframe=0)
    row = {name: getattr(worlds, name)[1] for name in ("qpos", "qvel", "ctrl")}
    SPOILS[what](SimpleNamespace(**row))
    wanted = single_error(model, SPOILS[what], 1 if recorded else 20)
    with warnings.catch_warnings(record=True, action="always") as told:
        use = partial(many.record, fields=("qpos", "time")) if recorded else many.step
        rows: Any = use(worlds, 20)
    assert [w.category for w in told] == [DivergedWarning]
    assert str(told[0].message).startswith(f"1 of {N} worlds diverged and is left out")
    if recorded:
        assert np.isnan(rows["qpos"][1, -1]).all()
        assert np.isnan(rows["time"][1, -1])
        assert np.isfinite(np.delete(rows["qpos"], 1, axis=0)).all()
    ((world, error),) = worlds.diverged.items()
    assert (world, type(error)) == (1, type(wanted))
    for fact in ("quantity", "index", "time"):
        assert getattr(error, fact, None) == getattr(wanted, fact, None)
    with opened(model, 0, nstep=20) as (_, data):
        equal(worlds, [data] * N, [0, 2, 3])
        after = data.time
    refused((DivergedError, r"world 1 .* reset it", lambda: many.get_state(worlds, 1)))
    before = worlds.time[1]
    many.step(worlds, ids=[0, 1])  # left out, and not told of again
    assert worlds.time[1] == before or np.isnan(before)
    assert worlds.time[0] == pytest.approx(after + model.timestep)
    many.forward(worlds)
    refused((UnknownNameError, "", lambda: many.reset(worlds, ids=[1], keyframe="no such")))
    assert 1 in worlds.diverged
    states = many.get_states(worlds)
    assert list(states) == [0, 2, 3]
    if recorded:
        many.reset(worlds, ids=[1], keyframe=0)
    else:
        many.set_states(worlds, {1: states[2]})
    assert not worlds.diverged
    many.step(worlds)
    assert worlds.time.all()


def test_a_warning_names_a_few(box: sm.Model) -> None:
    with worlds_of(box, 7) as worlds:
        worlds.ctrl[:, 0] = np.nan
        with pytest.warns(DivergedWarning) as told:
            many.step(worlds)
        text = str(told[0].message)
        assert text.startswith("7 of 7 worlds diverged and are left out until reset or set_state")
        assert ("0 (" in text, "5 (" in text, text.endswith("and 2 more")) == (True, False, True)
        many.step(worlds, 3)  # none is left
        assert many.record(worlds, 2)["qpos"].shape == (7, 2, box.nq)
        assert told[0].filename == __file__


def test_forward_refuses_before_anything_changes(worlds: many.Worlds) -> None:
    worlds.qpos[2, 1] = np.nan
    says = r"^world 2: qpos\[1\] \(shoulder_lift\)"
    error = refused((BadInputError, says, lambda: many.forward(worlds)))
    assert (error.quantity, error.index, error.world) == ("qpos", 1, 2)
    assert not worlds.xpos.any()
    assert not worlds.diverged
    refused((BadInputError, "world 2", lambda: many.get_state(worlds, 2)))
    many.forward(worlds, ids=[0, 1, 3])
    assert worlds.xpos[3].any()
    many.reset(worlds)
    worlds.qpos[3, 9:13] = 0
    refused((BadInputError, r"world 3: .* is zero", lambda: many.forward(worlds)))


def test_assignment_copies_a_row_or_all(worlds: many.Worlds) -> None:
    model, kept = worlds.model, worlds.ctrl
    worlds.ctrl = np.arange(model.nu)
    assert (worlds.ctrl == np.arange(model.nu)).all()
    worlds.ctrl = commands(model, N)
    assert np.array_equal(kept, commands(model, N))
    worlds.ctrl *= 2
    assert np.array_equal(kept, 2 * commands(model, N))
    assert worlds.ctrl is kept
    worlds.time = 3
    many.step(worlds)
    assert worlds.time == pytest.approx([3 + model.timestep] * N)
    wrong: list[tuple[type[Exception], str, Any]] = [
        *((BadInputError, "ctrl", np.zeros(shape)) for shape in ((N, model.nu + 1), (N + 1, 6))),
        *((BadInputError, "ctrl", bad) for bad in ("x", [[1], [1, 2]])),
        (BadInputError, "qvel", np.full((N, model.nv), np.inf)),
        (BadInputError, "qpos", np.zeros((N, model.nq))),  # with a quaternion of zeros
        *((ReadOnlyError, name, 1) for name in ("xpos", "n", "anything")),
    ]
    refused(
        *((error, "", partial(setattr, worlds, *rest)) for error, *rest in wrong),
        (ValueError, "read-only", lambda: worlds.xpos.fill(1)),
    )
    assert np.array_equal(kept, 2 * commands(model, N))
    worlds.ctrl.setflags(write=False)
    refused((ReadOnlyError, r"worlds\.ctrl", lambda: setattr(worlds, "ctrl", 0)))


def test_arguments_are_checked(worlds: many.Worlds) -> None:
    model: Any = worlds.model
    other = sm.load("so101", backend=model.backend)
    foreign = sm.get_state(other, sm.make_data(other))
    anything: Any = many  # what is given to it is not always of the type that it wants
    wrong: dict[type[Exception], list[Callable[[], object]]] = {
        BadInputError: [
            *(
                partial(verb, worlds, ids=ids)
                for ids in ([0, 0], [N], [-1], 2, [0.5], [[1]], [True, False], "a", [[1], [2, 3]])
                for verb in (anything.step, anything.forward, anything.reset)
            ),
            *(
                partial(verb, worlds, nstep)
                for nstep in (0, -1, 1.0, True, "3", 2**31)
                for verb in (anything.step, anything.record)
            ),
            *(partial(anything.get_state, worlds, number) for number in (N, -1, 0.0, None, True)),
            *(partial(many.record, worlds, 4, every=every) for every in (0, 3, 8)),
            *(
                partial(many.record, worlds, 4, every=2, ctrl=np.full(shape, value))
                for shape, value in (((N, 4, model.nu), 0), (model.nu, 0), ((2, model.nu), np.nan))
            ),
            partial(many.make_worlds, model, 0),
            partial(many.make_worlds, model, 2, workers=0),
            partial(many.make_worlds, model, 2, timestep=[0.1]),
        ],
        UnknownNameError: [
            partial(many.reset, worlds, keyframe=77),
            partial(many.make_worlds, model, 2, derived=["contacts"]),
        ],
        ForeignStateError: [partial(many.set_state, worlds, 0, foreign)],
        TypeError: [
            partial(anything.set_state, worlds, 0, b""),
            partial(anything.step, sm.make_data(model)),
            partial(anything.make_worlds, worlds, 1),
        ],
        UnsupportedError: [partial(many.make_worlds, model, 2, colour=[1, 2])],
    }
    said: list[tuple[Callable[[Any], object], type[Exception], str]] = [
        (lambda w: many.record(w, 1, ["qpo"]), UnknownNameError, "Did you mean 'qpos'"),
        (lambda w: many.record(w, 2, None), BadInputError, "names of fields are wanted"),  # pyright: ignore
        (
            lambda w: many.record(w, 10**9, ("qpos", "time")),
            BadInputError,
            r"1000000000 rows of qpos, time takes .* GB",
        ),
        (
            lambda w: many.make_worlds(w.model, 2, timestep=[0.001, -1]),
            BadInputError,
            "world 1: timestep",
        ),
        *(
            (
                partial(lambda kp, w: many.make_worlds(w.model, 2, kp=kp), values),
                BadInputError,
                "kp takes 2 values",
            )
            for values in ({700.0: 0, 900.0: 1}, {700.0, 900.0}, "ab", 3.0, np.array(3.0))
        ),
        (
            lambda w: setattr(w, "ctrl", np.zeros((3, 6))),
            BadInputError,
            r"ctrl takes 24 numbers, shape \(4, 6\)",
        ),
        *(
            (partial(lambda name, w: delattr(w, name), name), ReadOnlyError, "cannot be deleted")
            for name in ("ctrl", "xpos", "nosuch")
        ),
        (
            lambda w: sm.step(w.model, w),
            TypeError,
            r"got Worlds, which statemachine\.worlds\.step takes",
        ),
        (pickle.dumps, TypeError, "get_state"),
        *(
            (partial(lambda world, w: w.model_of(world), world), BadInputError, "there is no world")
            for world in (4, -1, "x", 1.5, True)
        ),
    ]
    refused(
        *((error, "", call) for error, calls in wrong.items() for call in calls),
        *((error, says, partial(call, worlds)) for call, error, says in said),
    )
    many.step(worlds, ids=[])
    assert not worlds.time.any()
    assert not worlds.xpos.any()


def test_what_is_not_kept_is_not_there(box: sm.Model) -> None:
    with worlds_of(box, 2, derived=("xpos",)) as worlds:
        many.step(worlds)
        assert (worlds.derived, worlds.xpos.shape) == (("xpos",), (2, box.nbody, 3))
        refused(
            (AttributeError, "do not keep 'qacc'", lambda: worlds.qacc),
            (UnknownNameError, "", lambda: many.record(worlds, 1, ["qacc"])),
        )


def test_closed_worlds_keep_their_inputs_and_refuse(box: sm.Model) -> None:
    with worlds_of(box) as worlds:
        many.step(worlds, 3)
        view, qpos = worlds.ctrl, worlds.qpos.copy()
        assert len(worlds) == N
        assert f"{N} of" in repr(worlds)
    worlds.close()
    assert np.array_equal(worlds.qpos, qpos)
    assert worlds.time == pytest.approx([3 * box.timestep] * N)
    uses: list[Callable[[many.Worlds], object]] = [
        many.step,
        many.forward,
        many.reset,
        lambda worlds: many.get_state(worlds, 0),
        lambda worlds: worlds.xpos,
        lambda worlds: setattr(worlds, "ctrl", np.zeros(box.nu)),
    ]
    refused(
        *((ClosedDataError, "", partial(use, worlds)) for use in uses),
        (ValueError, "read-only", lambda: view.fill(1)),
    )


@pytest.mark.parametrize("use", [many.forward, many.reset, many.get_states])
def test_one_thread_at_a_time(worlds: many.Worlds, use: Callable[[many.Worlds], object]) -> None:
    raised: Any = meanwhile(worlds, partial(use, worlds), "_step")
    many.step(worlds)
    assert [type(error) for error in raised] == [BusyDataError]
    assert "another thread is using this Worlds" in str(raised[0])
    use(worlds)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_worlds_belong_to_the_process_that_made_them(backend: str) -> None:
    code = f"""
import os, statemachine as sm
from statemachine.worlds import make_worlds, step
worlds = make_worlds(sm.load("so101", backend="{backend}"), 4, workers=2)
if not os.fork():
    try:
        step(worlds)
    except sm.errors.BusyDataError as error:
        worlds.close()
        os._exit("another process" not in str(error))
    os._exit(2)
assert os.wait()[1] == 0
step(worlds)
assert worlds.time.all()
"""
    runs_in_silence(code, ROOT)


@pytest.mark.parametrize(("flag", "substeps"), [("", 1), ("", 2), ('sleep="enable"', 1)])
def test_what_a_file_may_have(tmp_path: Path, flag: str, substeps: int) -> None:
    text = RICH.replace('0.002"/>', f'0.002"><flag {flag}/></option>', 1)
    model = model_of(tmp_path, text, substeps=substeps)
    with worlds_of(model, 5, workers=3) as worlds:
        live(worlds, [model] * 5, 28)
        with started(model) as data:
            data.mocap_pos[0] = [0.2, 0.1, 0.9]
            many.set_state(worlds, 4, sm.get_state(model, data))
            many.step(worlds, 30)
            sm.step(model, data, 30)
            equal(worlds, [data] * 5, [4])
            assert sm.get_state(model, data) == many.get_state(worlds, 4)


ROBOTS = {
    "ant": "gym/gymnasium/envs/mujoco/assets/ant.xml",
    "car": "mj/model/car/car.xml",
    "adhesion": "mj/model/adhesion/active_adhesion.xml",
    "carousel": "mj/model/surfacevel/carousel.xml",
    "ball in cup": "dmc/dm_control/suite/ball_in_cup.xml",
    "humanoid": "dmc/dm_control/suite/humanoid.xml",
}


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_of_others(name: str) -> None:
    path = shared(SHARED / "robots" / "models" / ROBOTS[name])
    with worlds_of(sm.load(path), 3) as worlds:
        live(worlds, [worlds.model] * 3, 14)


def test_where_the_engine_resets_by_itself() -> None:
    model = sm.load("so101/scene_box", defaults="engine")
    with worlds_of(model) as worlds:
        many.reset(worlds, keyframe=0)
        worlds.qvel[1] = 1e9
        wanted = single_error(model, SPOILS["too fast"], 20)
        with pytest.warns(DivergedWarning):
            many.step(worlds, 20)
        assert str(worlds.diverged[1]).split(".")[0] == str(wanted).split(".")[0]


def test_a_python_callback_is_refused() -> None:
    import mujoco

    with worlds_of(sm.load("so101")) as worlds:
        mujoco.set_mjcb_passive(lambda _m, _d: None)
        try:
            refused((UnsupportedError, "worlds", lambda: many.step(worlds)))
        finally:
            mujoco.set_mjcb_passive(None)
        many.step(worlds)
        assert worlds.time.all()


@overlapping
def test_a_record_goes_on_past_a_warning_that_ends_nothing(tmp_path: Path) -> None:
    """The engine's own rollout stops a world at any warning."""
    balls = "".join(
        f'<body pos="{0.05 * (k % 5)} {0.05 * (k // 5)} .04"><freejoint/><geom size=".05"/></body>'
        for k in range(20)
    )
    world = f'<geom type="plane" size="2 2 .1"/>{balls}'
    model = loaded(tmp_path, world, '<size memory="60K"/>')
    data = sm.make_data(model)
    with warnings.catch_warnings(record=True, action="always") as single:
        for _ in range(10):
            sm.step(model, data)
    assert single
    with (
        worlds_of(model, 3) as worlds,
        warnings.catch_warnings(record=True, action="always") as ours,
    ):
        rows = many.record(worlds, 10)
        equal(worlds, [data] * 3)
        assert np.array_equal(rows["qpos"][2, -1], data.qpos)
    assert {str(w.message) for w in ours} == {str(w.message) for w in single}


@pytest.mark.slow
def test_the_engine_prints_nothing_and_writes_no_log(tmp_path: Path) -> None:
    code = """
import warnings, numpy as np, statemachine as sm
from statemachine import worlds as many
warnings.simplefilter("ignore")
worlds = many.make_worlds(sm.load("so101/scene_box"), 64, workers=4)
for _ in range(5):
    worlds.ctrl[::2, 3] = np.nan
    worlds.qvel[1::4] = 1e9
    many.step(worlds, 10)
    assert len(worlds.diverged) == 48, len(worlds.diverged)
    many.reset(worlds)
worlds.close()
"""
    runs_in_silence(code, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_time_that_is_no_number_is_refused(model: sm.Model) -> None:
    with many.make_worlds(model, 2) as worlds:
        worlds.time[1] = np.nan
        uses = many.step, many.forward, lambda w: many.record(w, 2)
        refused(*((BadInputError, r"time\[1\] = nan", partial(use, worlds)) for use in uses))
        many.step(worlds, ids=[0])
        many.reset(worlds)
        many.step(worlds)
