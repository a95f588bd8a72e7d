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
from statemachine.backends import backend_engine, backend_names
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
from statemachine.worlds import BATCHED

from .support.backends import readable_arrays
from .support.claims import overlapping, refused
from .support.data_uses import meanwhile
from .support.lives import equal, live
from .support.motions import opened, started
from .support.processes import runs_in_silence
from .support.requirements import ROOT, SHARED, need_engine, shared
from .support.small_models import RICH, loaded, model_of

N = 4


def worlds_of(model: sm.Model, n: int = N, **options: Any) -> many.Worlds:
    if "derived" not in options:
        told = readable_arrays(model)
        options["derived"] = [name for name in BATCHED if name in told]
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
    fields = ["time", "qpos", "qvel", "ctrl", "xpos", "qfrc_constraint"]
    if "qfrc_constraint" not in readable_arrays(box):
        fields.pop()
    with worlds_of(box) as worlds:
        many.reset(worlds, keyframe=0)
        rows = many.record(worlds, steps, fields, every=every, ctrl=ctrl if commanded else None)
        assert list(rows) == fields
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
    """Return what a step of one Data raises after something was spoilt."""
    with opened(model, 0) as (_, data):
        spoil(data)
        return refused((StateMachineError, "", lambda: sm.step(model, data, nstep)))


SPOILS = {
    "a NaN in ctrl": lambda of: of.ctrl.__setitem__((..., 2), np.nan),
    "a NaN in qpos": lambda of: of.qpos.__setitem__((..., 1), np.nan),
    "too fast": lambda of: of.qvel.__setitem__((..., slice(None)), 1e9),
    "a zero quaternion": lambda of: of.qpos.__setitem__((..., slice(9, 13)), 0.0),
}


@pytest.fixture(scope="module", params=backend_names())
def lasting(request: pytest.FixtureRequest) -> Iterator[many.Worlds]:
    """Provide worlds of the box that several tests use, each after a reset."""
    engine = backend_engine(request.param)
    if engine:
        need_engine(engine)
    with worlds_of(sm.load("so101/scene_box", backend=request.param)) as worlds:
        yield worlds


@pytest.fixture(params=SPOILS)
def spoil(request: pytest.FixtureRequest) -> Callable[[Any], None]:
    """Return what lets a Data, or a row of Worlds, diverge."""
    return SPOILS[request.param]


@pytest.fixture(params=[False, True], ids=["stepped", "recorded"])
def recorded(request: pytest.FixtureRequest) -> bool:
    """Tell whether the worlds are recorded; else they take their steps."""
    return request.param


def diverged(worlds: many.Worlds, spoil: Callable[[Any], None], recorded: bool) -> Any:
    """Let world 1 diverge in 20 steps from the keyframe; return the rows of a record."""
    many.reset(worlds, keyframe=0)
    spoil(SimpleNamespace(**{name: getattr(worlds, name)[1] for name in ("qpos", "qvel", "ctrl")}))
    use = partial(many.record, fields=("qpos", "time")) if recorded else many.step
    with pytest.warns(DivergedWarning) as told:
        rows = use(worlds, 20)
    assert len(told) == 1
    assert str(told[0].message).startswith(f"1 of {N} worlds")
    return rows


def test_a_world_that_diverges_has_the_error_of_its_data(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool
) -> None:
    wanted = single_error(lasting.model, spoil, 1 if recorded else 20)
    diverged(lasting, spoil, recorded)
    ((world, error),) = lasting.diverged.items()
    assert (world, type(error)) == (1, type(wanted))
    for fact in ("quantity", "index", "time"):
        assert getattr(error, fact, None) == getattr(wanted, fact, None)


def test_a_world_that_diverges_leaves_the_others_alone(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool
) -> None:
    diverged(lasting, spoil, recorded)
    with opened(lasting.model, 0, nstep=20) as (_, data):
        equal(lasting, [data] * N, [0, 2, 3])


def test_the_rows_of_a_world_that_diverged_are_nan(
    lasting: many.Worlds, spoil: Callable[[Any], None]
) -> None:
    rows = diverged(lasting, spoil, recorded=True)
    assert np.isnan(rows["qpos"][1, -1]).all()
    assert np.isnan(rows["time"][1, -1])
    assert np.isfinite(np.delete(rows["qpos"], 1, axis=0)).all()


def test_a_world_that_diverged_is_left_out_of_later_steps_without_a_word(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool
) -> None:
    diverged(lasting, spoil, recorded)
    before, others = lasting.time[1], lasting.time[0]
    with warnings.catch_warnings(action="error"):
        many.step(lasting, ids=[0, 1])
        many.forward(lasting)
    assert lasting.time[1] == before or np.isnan(before)
    assert lasting.time[0] == pytest.approx(others + lasting.model.timestep)


def test_a_world_that_diverged_gives_no_state(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool
) -> None:
    diverged(lasting, spoil, recorded)
    refused((DivergedError, r"world 1 .* reset it", lambda: many.get_state(lasting, 1)))
    assert list(many.get_states(lasting)) == [0, 2, 3]


def test_a_refused_reset_leaves_a_world_diverged(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool
) -> None:
    diverged(lasting, spoil, recorded)
    refused((UnknownNameError, "", lambda: many.reset(lasting, ids=[1], keyframe="no such")))
    assert 1 in lasting.diverged


@pytest.mark.parametrize("way", ["reset", "set_states"])
def test_a_world_that_diverged_goes_on_after_a_reset_or_a_state(
    lasting: many.Worlds, spoil: Callable[[Any], None], recorded: bool, way: str
) -> None:
    diverged(lasting, spoil, recorded)
    if way == "reset":
        many.reset(lasting, ids=[1], keyframe=0)
    else:
        many.set_states(lasting, {1: many.get_states(lasting)[2]})
    assert not lasting.diverged
    before = lasting.time.copy()
    many.step(lasting)
    assert lasting.time == pytest.approx(before + lasting.model.timestep)


def test_a_warning_names_a_few(box: sm.Model) -> None:
    with worlds_of(box, 7) as worlds:
        worlds.ctrl[:, 0] = np.nan
        with pytest.warns(DivergedWarning) as told:
            many.step(worlds)
        text = str(told[0].message)
        assert text.startswith("7 of 7")
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


Call = Callable[[many.Worlds], object]
anything: Any = many  # what is given to it is not always of the type that it wants


def assert_refused(
    worlds: many.Worlds, *cases: tuple[type[Exception] | tuple[type[Exception], ...], str, Call]
) -> None:
    """Assert that every call raises its error, and that nothing was done by any of them."""
    many.reset(worlds)
    refused(*((error, says, partial(call, worlds)) for error, says, call in cases))
    assert not worlds.time.any()
    assert not worlds.xpos.any()


@pytest.mark.parametrize("verb", ["step", "forward", "reset"])
def test_ids_are_different_whole_numbers_of_worlds(lasting: many.Worlds, verb: str) -> None:
    use = getattr(anything, verb)
    wrong = [0, 0], [N], [-1], 2, [0.5], [[1]], [True, False], "a", [[1], [2, 3]]
    assert_refused(lasting, *((BadInputError, "", partial(use, ids=ids)) for ids in wrong))


def test_no_ids_are_no_worlds(lasting: many.Worlds) -> None:
    many.reset(lasting)
    many.step(lasting, ids=[])
    assert not lasting.time.any()
    assert not lasting.xpos.any()


@pytest.mark.parametrize("verb", ["step", "record"])
def test_a_number_of_steps_is_whole_and_above_zero(lasting: many.Worlds, verb: str) -> None:
    use, wrong = getattr(anything, verb), (0, -1, 1.0, True, "3", 2**31)
    assert_refused(lasting, *((BadInputError, "", partial(use, nstep=nstep)) for nstep in wrong))


def test_one_world_is_named_by_its_number(lasting: many.Worlds) -> None:
    states: list[tuple[type[Exception], str, Call]] = [
        (BadInputError, "", lambda w, number=number: anything.get_state(w, number))
        for number in (N, -1, 0.0, None, True)
    ]
    models: list[tuple[type[Exception], str, Call]] = [
        (BadInputError, "no world", lambda w, number=number: w.model_of(number))  # pyright: ignore
        for number in (N, -1, "x", 1.5, True)
    ]
    assert_refused(lasting, *states, *models)


def test_a_record_is_of_whole_parts_of_its_steps(lasting: many.Worlds) -> None:
    assert_refused(
        lasting,
        *((BadInputError, "", partial(many.record, nstep=4, every=every)) for every in (0, 3, 8)),
    )


def test_commands_of_a_record_have_a_row_for_each_part_and_finite_numbers(
    lasting: many.Worlds,
) -> None:
    nu = lasting.model.nu
    wrong = np.zeros((N, 4, nu)), np.zeros(nu), np.full((2, nu), np.nan)
    assert_refused(
        lasting,
        *((BadInputError, "", partial(many.record, nstep=4, every=2, ctrl=c)) for c in wrong),
    )


def test_a_record_is_of_known_fields_that_fit_into_memory(lasting: many.Worlds) -> None:
    fields = ("qpos", "time")
    assert_refused(
        lasting,
        (UnknownNameError, "'qpos'", lambda w: many.record(w, 1, ["qpo"])),
        (BadInputError, "names of fields", lambda w: anything.record(w, 2, None)),
        (BadInputError, r"1000000000 rows .* GB", lambda w: many.record(w, 10**9, fields)),
    )


def test_worlds_are_made_of_a_model_with_a_number_of_them(lasting: many.Worlds) -> None:
    assert_refused(
        lasting,
        (BadInputError, "", lambda w: many.make_worlds(w.model, 0)),
        (BadInputError, "", lambda w: many.make_worlds(w.model, 2, workers=0)),
        (UnknownNameError, "", lambda w: many.make_worlds(w.model, 2, derived=["contacts"])),
        (UnsupportedError, "", lambda w: many.make_worlds(w.model, 2, colour=[1, 2])),
        (TypeError, "", lambda w: anything.make_worlds(w, 1)),
    )


def test_an_option_of_worlds_has_a_value_for_each(lasting: many.Worlds) -> None:
    wrong = {700.0: 0, 900.0: 1}, {700.0, 900.0}, "ab", 3.0, np.array(3.0)
    assert_refused(
        lasting,
        (BadInputError, "", lambda w: many.make_worlds(w.model, 2, timestep=[0.1])),
        (
            BadInputError,
            "world 1: timestep",
            lambda w: many.make_worlds(w.model, 2, timestep=[0.001, -1]),
        ),
        *(
            (BadInputError, "kp takes 2", lambda w, kp=kp: many.make_worlds(w.model, 2, kp=kp))
            for kp in wrong
        ),
    )


def test_a_keyframe_that_is_not_there_is_refused(lasting: many.Worlds) -> None:
    assert_refused(lasting, (UnknownNameError, "", partial(many.reset, keyframe=77)))


def test_a_state_is_one_of_the_model(lasting: many.Worlds) -> None:
    other = sm.load("so101", backend=lasting.model.backend)
    foreign = sm.get_state(other, sm.make_data(other))
    assert_refused(
        lasting,
        (ForeignStateError, "", lambda w: many.set_state(w, 0, foreign)),
        (TypeError, "", lambda w: anything.set_state(w, 0, b"")),
    )


def test_a_data_is_no_worlds_and_worlds_are_no_data(lasting: many.Worlds) -> None:
    assert_refused(
        lasting,
        (TypeError, "", lambda w: anything.step(sm.make_data(w.model))),
        (TypeError, r"statemachine\.worlds\.step", lambda w: sm.step(w.model, w)),  # pyright: ignore
    )


def test_attributes_of_worlds_have_a_shape_and_stay(lasting: many.Worlds) -> None:
    assert_refused(
        lasting,
        (BadInputError, r"\(4, 6\)", lambda w: setattr(w, "ctrl", np.zeros((3, 6)))),
        *(
            (ReadOnlyError, "deleted", lambda w, name=name: delattr(w, name))
            for name in ("ctrl", "xpos", "nosuch")
        ),
    )


def test_worlds_are_pickled_by_their_states(lasting: many.Worlds) -> None:
    assert_refused(lasting, (TypeError, "get_state", pickle.dumps))


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
    assert "another thread" in str(raised[0])
    use(worlds)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_worlds_belong_to_the_process_that_made_them(backend: str) -> None:
    code = f"""
import os, warnings
import statemachine as sm
from statemachine.worlds import make_worlds, step
warnings.simplefilter("ignore")
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
def test_worlds_of_public_robots_are_their_data(name: str) -> None:
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
from statemachine.backends import backend_engine, backend_names
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


@pytest.mark.parametrize("verb", [many.step, many.forward, many.reset])
def test_what_is_no_worlds_is_refused_by_its_kind(verb: Callable[[Any], object]) -> None:
    refused((TypeError, "from make_worlds; got str", lambda: verb("so101")))
