"""The recorder of calls: complete, without effect on the run, and gone afterwards."""

from __future__ import annotations

import ast
import contextlib
import gc
import io
import itertools
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine import backends, installed
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.engines.call_watch import CLOSED, NEW
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.lab.probes import calls
from statemachine.lab.probes import calls_page as words
from statemachine.lab.probes.calls import (
    CallRecorder,
    RecordedStatement,
    Recording,
    record,
    recorded_engines,
)
from statemachine.show.as_json import dumps
from statemachine.show.blocks import Page, Table

from .support.claims import assert_has, assert_in, refused
from .support.pages import blocks, shown
from .support.patches import Patch, around
from .support.requirements import need_engine

# A little of everything: a keyframe in mid-contact, a write, both verbs, each kind of
# derived array, a State, a variant of the model, two Data.
# What the recorder calls the worlds of PyBullet, each with whose it is.
WORLD, STILL_COPY, LOOK_AHEAD = "the world of", "the still copy of", "the look-ahead of"
WHOLE = """\
import statemachine as sm
model = sm.load("so101/scene_box", backend="{engine}")
data = sm.make_data(model)
sm.reset(model, data, keyframe=0)
sm.forward(model, data)
print(data.contacts, data.qfrc_bias, data.qfrc_contact)
data.ctrl[:2] += (0.4, -0.2)
sm.step(model, data, 30)
for _ in range(5):
    sm.step(model, data)
print(data.xpos[3], data.contacts)
state = sm.get_state(model, data)
off = model.replace(actuation=False)
other = sm.make_data(off)
sm.set_state(model, data, state)
sm.step(off, other, 3)
sm.step(model, data, 25)
other.close()
print(data.qpos.tobytes().hex(), data.qvel.tobytes().hex())
"""
SHORT = """\
import statemachine as sm
model = sm.load("so101/scene", backend="{engine}")
data = sm.make_data(model)
{code}
"""


@pytest.fixture(params=recorded_engines())
def engine(request: pytest.FixtureRequest) -> str:
    need_engine(request.param)
    return request.param


def short(engine: str, code: str) -> list[RecordedStatement]:
    """Return what each line of some code did, after a Data was made."""
    recording = record(SHORT.format(engine=engine, code=code), engine)
    assert recording.error is None
    return list(recording.statements[3:])


def counts(recording: Recording) -> Counter[str]:
    calls = [call for statement in recording.statements for call in statement.calls]
    return Counter(itertools.chain(*([call.function] * call.count for call in calls)))


def run_plainly(code: str) -> str:
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, "<plain>", "exec"), {"__name__": "__main__"})
    return out.getvalue()


def owners(engine: str) -> list[Any]:
    """Return whatever has functions that are replaced."""
    more = [installed.require("pybullet")] if engine == "pybullet" else []
    return [mujoco, mujoco.MjModel, mujoco.MjData, mujoco.MjSpec, *more]


def functions_of(owner: Any) -> dict[int, str]:
    """Return the names of what is called into C, by the id under which a profile tells it."""
    if isinstance(owner, type):
        return {
            id(value.__func__): f"{owner.__name__}.{name}"
            for name, value in vars(owner).items()
            if type(value).__name__ in ("instancemethod", "staticmethod") and name != "__init__"
        }
    return {
        id(value): name
        for name, value in vars(owner).items()
        if type(value).__name__ == "builtin_function_or_method"
    }


@contextlib.contextmanager
def profiled(engine: str, heard: Callable[[Any, str], None]) -> Any:
    """Hear Python's own account of calls into C: (frame, name) of each that is the engine's."""
    functions = {key: name for owner in owners(engine) for key, name in functions_of(owner).items()}

    def profile(frame: Any, event: str, argument: Any) -> None:
        if event == "c_call" and id(argument) in functions:
            heard(frame, functions[id(argument)])

    sys.setprofile(profile)
    try:
        yield
    finally:
        sys.setprofile(None)


@pytest.mark.slow
def test_every_call_is_recorded(engine: str) -> None:
    """Against Python's own account of the same code, run without the recorder."""
    code = WHOLE.format(engine=engine)
    run_plainly(code)  # so that what happens once in a process has happened
    recorded, seen = counts(record(code, engine)), Counter[str]()
    gc.collect()  # so that no Data of these runs ends in the next one
    namespace: dict[str, Any] = {"__name__": "__main__"}
    with (
        contextlib.redirect_stdout(io.StringIO()),
        profiled(engine, lambda _, name: seen.update([name])),
    ):
        exec(compile(code, "<plain>", "exec"), namespace)
    # Python's account lacks what C calls for it: constructors and copy.
    assert recorded.pop("MjData") >= 2
    assert recorded.pop("MjModel.__copy__") + recorded.pop("MjData.__copy__", 0) >= 1
    if engine == "mujoco":
        assert recorded["mj_step"] == 1 + 5 + 1 + 1
    if sys.version_info[:2] == (3, 12):  # its account lacks methods of objects, too
        recorded = Counter({name: recorded[name] for name in recorded if name in seen})
    assert recorded == seen
    assert sum(seen.values()) > 20


def is_a_look(frame: Any) -> bool:
    """Tell whether code is the recorder's own, or that with which an engine's room looks."""
    file = Path(frame.f_code.co_filename)
    return (file.parts[-3::2] == ("engines", "calls.py")) or file == Path(calls.__file__)


def past_the_recorder(engine: str, run: Callable[[], object]) -> set[str]:
    """Return the engine's functions that are called while a run is recorded, past the recorder."""
    names: set[str] = set()

    def heard(frame: Any, name: str) -> None:
        if CallRecorder.is_active and not is_a_look(frame):  # at its end, Data are collected
            names.add(name)

    with profiled(engine, heard):
        run()
    return names


@pytest.mark.slow
def test_no_call_goes_round_the_recorder(engine: str) -> None:
    """What holds on to an engine's function from before would not be heard."""
    assert not past_the_recorder(engine, lambda: record(WHOLE.format(engine=engine), engine))


@pytest.mark.slow
def test_looks_disturb_nothing_for_long(engine: str) -> None:
    """Many steps of a box that is held: every call of each is looked at."""
    code = WHOLE.format(engine=engine).replace("range(5)", "range(200)")
    recording = record(code, engine)
    assert recording.printed == run_plainly(code)
    (loop,) = [each for each in recording.statements if each.source.startswith("for")]
    step = "mj_step" if engine == "mujoco" else "stepSimulation"
    assert [call.count for call in loop.calls if call.function == step] == [200]


@pytest.mark.usefixtures("bullet")
def test_looks_leave_stale_what_is_stale() -> None:
    """Link poses and contact points are those of before the step until someone asks anew."""
    reads = """
import pybullet
arm = next(tree.body for tree in data.raw.trees if tree.joints)
links = [pybullet.getLinkState(arm, k, physicsClientId=data.raw.client)[4] for k in range(6)]
print(links, pybullet.getContactPoints(physicsClientId=data.raw.client))
"""
    code = WHOLE.format(engine="pybullet") + reads
    plain = run_plainly(code)
    assert record(code, "pybullet").printed == plain
    fresh = code.replace("data.raw.client)[4]", "data.raw.client, computeForwardKinematics=1)[4]")
    assert run_plainly(fresh) != plain  # so that the comparison could have failed


@pytest.mark.parametrize(
    ("code", "printed"),
    [
        ("import weakref\nheld = weakref.ref(data.raw)\ndata.close()\nprint(held())", "None\n"),
        ("import mujoco\nprint(isinstance(data.raw, mujoco.MjData))", "True\n"),
        ("import mujoco\nprint(isinstance(1, mujoco.MjModel))", "False\n"),
    ],
)
def test_objects_live_and_are_as_long_as_without_a_recorder(code: str, printed: str) -> None:
    assert short("mujoco", code)[-1].printed == printed


@pytest.mark.usefixtures("bullet")
def test_a_world_is_not_taken_for_the_next_of_its_number() -> None:
    lines = short("pybullet", "data.close()\nother = sm.make_data(model)\nsm.step(model, other)")
    assert [call.on for call in lines[0].calls] == [f"{WORLD} data"]
    assert f"{WORLD} data" not in {call.on for line in lines[1:] for call in line.calls}
    assert f"{WORLD} other" in {call.on for call in lines[2].calls}


@pytest.mark.parametrize("ending", ["pass", "1 / 0", "raise KeyboardInterrupt", "def"])
def test_every_function_is_put_back(engine: str, ending: str) -> None:
    before = [dict(vars(owner)) for owner in owners(engine)]
    errors: Any = (ZeroDivisionError, KeyboardInterrupt, SyntaxError)
    with contextlib.nullcontext() if ending == "pass" else pytest.raises(errors):
        record(SHORT.format(engine=engine, code=f"sm.step(model, data)\n{ending}"), engine)
    for owner, attributes in zip(owners(engine), before, strict=True):
        assert vars(owner).keys() == attributes.keys()
        assert all(vars(owner)[name] is value for name, value in attributes.items())


def test_a_run_can_be_recorded_after_one_that_failed(engine: str) -> None:
    with pytest.raises(ZeroDivisionError):
        record("1 / 0", engine)
    assert record(SHORT.format(engine=engine, code=""), engine).error is None


def test_mujoco_s_class_is_its_own_after_a_run() -> None:
    record(SHORT.format(engine="mujoco", code=""), "mujoco")
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert isinstance(mujoco.MjData(empty), mujoco.MjData)


def test_a_data_outlives_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    """It keeps the engine's function that it was made with."""
    kept: list[Any] = []
    monkeypatch.setitem(sys.modules, "kept_by_the_test", kept)
    short("mujoco", "import sys\nsys.modules['kept_by_the_test'].append((sm, model, data))")
    sm, model, data = kept[0]
    sm.step(model, data, 3)
    assert data.time == pytest.approx(3 * model.timestep)


@pytest.mark.parametrize(
    ("code", "function", "first", "changed", "unchanged"),
    [
        (
            "sm.forward(model, data)",
            "mj_forward",
            (),
            {"xpos", "xquat", "site_xpos", "qacc"},
            {"time", "qpos", "qvel", "ctrl", "act", "qacc_warmstart"},
        ),
        ("sm.step(model, data, 800)", "mj_step", ("time", "qpos", "qvel"), set(), {"ctrl"}),
    ],
)
def test_a_verb_on_mujoco_is_one_call(
    code: str, function: str, first: tuple[str, ...], changed: set[str], unchanged: set[str]
) -> None:
    write, line = short("mujoco", f"data.qpos[1] = 0.8\n{code}")
    assert (write.calls, write.changed) == ((), ("data.qpos[1]",))
    (call,) = line.calls
    assert (call.function, call.on, call.count) == (function, "data", 1)
    assert call.changed[: len(first)] == first
    assert changed <= set(call.changed)
    assert not unchanged & set(call.changed)
    assert line.changed == ()


def test_a_read_on_mujoco_is_no_call() -> None:
    _, line = short("mujoco", "sm.forward(model, data)\nprint(data.site_xpos.shape)")
    assert_has(line, calls=(), changed=(), printed="(2, 3)\n")


@pytest.mark.parametrize(
    ("code", "changed"),
    [
        ("data.ctrl[:2] = (1, 2)", "data.ctrl[0:2]"),
        ("data.ctrl = [1, 2, 3, 4, 5, 6]", "data.ctrl"),
        ("data.time = 2", "data.time"),
        ("data.raw.qfrc_applied[3] = 1", "data.raw.qfrc_applied[3]"),
        ("model.raw.opt.disableflags |= 1", "model.raw.opt.disableflags"),
        ("model.raw.opt.gravity[2] = 0", "model.raw.opt.gravity"),
        ("model.raw.body_mass[2] = 5", "model.raw.body_mass"),
        ("model.raw.tex_data[0] += 1", "model.raw.tex_data"),  # of a megabyte
    ],
)
def test_a_write_is_spelled_as_it_is_typed(code: str, changed: str) -> None:
    (line,) = short("mujoco", code)
    assert_has(line, calls=(), changed=(changed,))


def test_the_interface_s_own_write_at_load_is_told() -> None:
    """The engine's automatic reset is turned off by a flag: no function does it."""
    load = record(SHORT.format(engine="mujoco", code=""), "mujoco").statements[1]
    assert load.changed == ("model.raw.opt.disableflags",)
    (call,) = (call for call in load.calls if call.function == "MjSpec.compile")
    assert_has(call, on="model", count=1, changed=(NEW,))


def test_several_data_are_told_apart(engine: str) -> None:
    lines = short(
        engine,
        "more = [sm.make_data(model) for _ in range(2)]\n"
        "sm.step(model, more[1])\nsm.step(model, data, 2)\nmore[1].close(); more.clear()",
    )
    step, world = ("mj_step", "{}") if engine == "mujoco" else ("stepSimulation", f"{WORLD} {{}}")
    stepped = [
        [(call.on, call.count) for call in line.calls if call.function == step] for line in lines
    ]
    once, twice = (world.format("more[1]"), 1), (world.format("data"), 2)
    if engine == "mujoco":
        twice = ("data", 1)  # one call with nstep
    assert stepped == [[], [once], [twice], [], []]
    if engine == "pybullet":
        ended = [(c.function, c.on, c.changed) for line in lines[3:] for c in line.calls]
        assert ended == [
            ("disconnect", f"{WORLD} more[1]", (CLOSED,)),
            ("disconnect", f"{WORLD} more[0]", (CLOSED,)),
        ]


@pytest.fixture(scope="module")
def lines_of_reads() -> dict[str, RecordedStatement]:
    """What PyBullet does in a forward, two reads, some steps, and a read after them."""
    need_engine("pybullet")
    code = (
        "sm.forward(model, data)\nprint(data.site_xpos)\nprint(data.site_xpos)\n"
        "sm.step(model, data, 4)\nprint(data.site_xpos)"
    )
    names = ("forward", "first read", "second read", "step", "late read")
    return dict(zip(names, short("pybullet", code), strict=True))


def test_pybullet_computes_nothing_in_a_forward(
    lines_of_reads: dict[str, RecordedStatement],
) -> None:
    assert_has(lines_of_reads["forward"], calls=(), changed=(), due=("data",))


@pytest.mark.parametrize("read", ["first read", "late read"])
def test_pybullet_computes_poses_on_its_still_copy_when_they_are_read(
    read: str, lines_of_reads: dict[str, RecordedStatement]
) -> None:
    line = lines_of_reads[read]
    asked = {call.function: call.on for call in line.calls if call.engine == "pybullet"}
    assert asked["getLinkStates"] == f"{STILL_COPY} model"
    assert_has(line, changed=("data.site_xpos",), due=())


def test_pybullet_computes_nothing_in_a_second_read(
    lines_of_reads: dict[str, RecordedStatement],
) -> None:
    assert_has(lines_of_reads["second read"], calls=(), changed=(), due=())


def test_a_step_of_pybullet_moves_its_world_and_reads_it(
    lines_of_reads: dict[str, RecordedStatement],
) -> None:
    line = lines_of_reads["step"]
    assert_has(line, changed=("data.qpos", "data.qvel", "data.time"), due=("data",))
    of_the_world = {call.function: call for call in line.calls if call.on == f"{WORLD} data"}
    moved = of_the_world["stepSimulation"]
    assert moved.count == 4
    assert {"joint positions", "joint velocities"} <= set(moved.changed)
    assert of_the_world["getJointStates"].changed == ()


@pytest.fixture(scope="module")
def whole_run() -> Recording:
    """The calls of PyBullet in all that a program does."""
    need_engine("pybullet")
    return record(WHOLE.format(engine="pybullet"), "pybullet")


def calls_of(recording: Recording) -> set[tuple[str, str]]:
    """Return (what it is about, function) of each call of PyBullet."""
    calls = itertools.chain.from_iterable(line.calls for line in recording.statements)
    return {(call.on, call.function) for call in calls if call.engine == "pybullet"}


def test_the_still_copy_is_never_stepped(whole_run: Recording) -> None:
    calls = calls_of(whole_run)
    assert_in(
        calls,
        (f"{STILL_COPY} model", "calculateMassMatrix"),
        (f"{LOOK_AHEAD} model", "stepSimulation"),
    )
    assert (f"{STILL_COPY} model", "stepSimulation") not in calls


def test_every_world_of_a_run_has_a_name(whole_run: Recording) -> None:
    assert {name for name, _ in calls_of(whole_run)} <= {
        *(f"{STILL_COPY} model", f"{STILL_COPY} off"),
        *(f"{LOOK_AHEAD} model", f"{LOOK_AHEAD} off"),
        *(f"{WORLD} data", f"{WORLD} other"),
        "a world that is gone again",  # in which load tries what it wrote
    }


def test_nothing_of_a_world_changes_but_by_a_call_of_the_engine(whole_run: Recording) -> None:
    changed = itertools.chain.from_iterable(line.changed for line in whole_run.statements)
    assert [each for each in changed if each.startswith("the world")] == []


@pytest.mark.parametrize(
    ("function", "arguments", "named", "client"),
    [
        ("stepSimulation", (7,), {}, 7),
        ("stepSimulation", (), {}, 0),
        ("anything", (1, 2), {"physicsClientId": 5}, 5),
        ("anything", (1, 2), {}, None),
        ("getJointStates", (1, [2], 9), {}, 9),
        ("getJointStates", (1, [2]), {}, 0),
    ],
)
def test_the_client_of_a_call_is_found_where_it_is_given(
    function: str, arguments: tuple[Any, ...], named: dict[str, Any], client: int | None
) -> None:
    from statemachine.engines.pybullet.calls import client_of

    assert client_of(function, arguments, named) == client


@pytest.mark.usefixtures("bullet")
def test_the_client_is_the_last_argument_of_each_function_of_the_table() -> None:
    """The engine takes what stands there for a world's number, and nothing after it."""
    from statemachine.engines.pybullet.calls import ARGUMENTS_BEFORE_CLIENT

    pb: Any = installed.require("pybullet")
    nowhere = pb.connect(pb.DIRECT)
    pb.disconnect(nowhere)
    for name, place in ARGUMENTS_BEFORE_CLIENT.items():
        arguments: list[Any] = [0] * place
        if name == "loadURDF":
            arguments[:3] = ["no.urdf", (0, 0, 0), (0, 0, 0, 1)]
        call = partial(getattr(pb, name), *arguments, nowhere)
        if name == "isConnected":
            assert not call()
        else:
            refused((pb.error, "Not connected", call))
        refused((TypeError, "at most", partial(call, nowhere)))


@pytest.mark.usefixtures("bullet")
def test_every_call_of_the_backend_says_its_client() -> None:
    from statemachine.engines.pybullet import calls as watched

    folder = Path(backends.__file__).parent
    files = [*(folder / "bullet").glob("*.py"), folder / "pybullet_backend.py"]
    found = []
    for node in itertools.chain.from_iterable(
        ast.walk(ast.parse(path.read_text(encoding="utf-8"))) for path in files
    ):
        match node:
            case ast.Call(ast.Attribute(ast.Name("pb"), name), given, named):
                if name != "connect" and "physicsClientId" not in {each.arg for each in named}:
                    starred = any(isinstance(each, ast.Starred) for each in given)
                    found.append((name, None if starred else len(given) - 1))
    assert len(found) > 20
    for name, place in found:
        assert place in (None, watched.ARGUMENTS_BEFORE_CLIENT[name]), name


@around(mujoco, "mj_forward")
def write_in_a_call(right: Any, model: Any, data: Any) -> None:
    right(model, data)
    data.qpos[0] = np.nextafter(data.qpos[0], 1)
    model.dof_damping[0] += 1


@around(MujocoData, "_recompute")
def write_beside_a_call(_right: Any, self: Any) -> None:
    mujoco.mj_forward(self._model.raw, self.raw)
    self.raw.qvel[2] = 1e-300
    mujoco.mj_forward(self._model.raw, self.raw)


forward_that_steps = around(MujocoData, "_recompute")(
    lambda _right, self: mujoco.mj_step(self._model.raw, self.raw)
)


@pytest.mark.parametrize(
    ("patch", "call", "of_the_call", "beside"),
    [
        (forward_that_steps, ("mj_step", 1), {"time", "qvel"}, ()),
        (write_in_a_call, ("mj_forward", 1), {"qpos", "model.raw.dof_damping"}, ()),
        (write_beside_a_call, ("mj_forward", 2), {"xpos"}, ("data.qvel[2]",)),
    ],
)
def test_what_a_forward_should_not_do_is_seen(
    patch: Patch,
    call: tuple[str, int],
    of_the_call: set[str],
    beside: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    patch(monkeypatch)
    (line,) = short("mujoco", "sm.forward(model, data)")
    (seen,) = line.calls
    assert (seen.function, seen.count) == call
    assert of_the_call <= set(seen.changed)
    assert line.changed == beside
    assert not beside or "qvel" not in seen.changed


@pytest.mark.usefixtures("bullet")
def test_a_getter_that_moves_the_world_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    pb: Any = installed.require("pybullet")

    @around(pb, "getJointStates")
    def wrong(right: Any, body: int, joints: Any, client: int) -> Any:
        found = right(body, joints, client)
        pb.resetJointState(body, joints[0], 0.25, 0.0, client)
        return found

    code = SHORT.format(engine="pybullet", code="sm.step(model, data)")
    run_plainly(code)
    wrong(monkeypatch)
    line = record(code, "pybullet").statements[-1]
    assert "joint positions" in next(
        call.changed for call in line.calls if call.function == "getJointStates"
    )


def test_a_refusal_ends_the_run(engine: str) -> None:
    code = "print('here')\nsm.step(model, data, -1)\nprint('not here')"
    recording = record(SHORT.format(engine=engine, code=code), engine)
    assert "nstep" in str(recording.error)
    last = recording.statements[-1].source
    assert (recording.printed, last) == ("here\n", "sm.step(model, data, -1)")


def test_an_engine_whose_calls_cannot_be_recorded_is_refused() -> None:
    refused((UnknownNameError, "mujoco, pybullet", lambda: record("", "mujco")))


@pytest.mark.usefixtures("bullet")
def test_code_of_another_engine_is_refused() -> None:
    other = SHORT.format(engine="pybullet", code="")
    refused((BadInputError, "on pybullet", lambda: record(other, "mujoco")))


def test_a_recording_in_a_recording_is_refused() -> None:
    nested = 'from statemachine.lab.probes.calls import record\nrecord("", "mujoco")'
    assert "cannot record another" in str(record(nested, "mujoco").error)


FUNCTION = "@lambda f: f\ndef g():\n    return '''\n  x'''"


@pytest.fixture
def typed() -> Recording:
    """The recording of code that calls no engine."""
    code = f"a = 1; b = 2\n\n# a comment\n{FUNCTION}\nprint(g(),\n  a)"
    return record(code, "mujoco")


def test_statements_are_those_that_were_typed(typed: Recording) -> None:
    assert [(each.line, each.source) for each in typed.statements] == [
        (1, "a = 1"),
        (1, "b = 2"),
        (4, FUNCTION),
        (8, "print(g(),\n  a)"),
    ]


def test_what_a_run_prints_is_recorded(typed: Recording) -> None:
    assert typed.printed == "\n  x 1\n"


def test_code_without_an_engine_calls_and_changes_nothing(typed: Recording) -> None:
    assert not any(each.calls or each.changed for each in typed.statements)


def page_of(*engines_: str, code: str = "") -> tuple[Page, str]:
    for each in engines_:
        need_engine(each)
    recordings = {each: record(SHORT.format(engine=each, code=code), each) for each in engines_}
    page = Page("calls", "", words.recorded_calls(recordings))
    assert dumps(recordings)
    return page, shown(page)


@pytest.fixture(scope="module")
def both_pages() -> tuple[Page, str]:
    """The page of a forward, a write, a read and some steps on both engines, and its text."""
    need_engine("pybullet")
    code = "sm.forward(model, data)\ndata.qpos[1] = 0.8\nprint(data.qacc)\nsm.step(model, data, 7)"
    return page_of("mujoco", "pybullet", code=code)


def test_a_page_counts_the_calls_of_a_line(both_pages: tuple[Page, str]) -> None:
    rows = blocks(both_pages[0], Table)[-1].rows
    assert ("  stepSimulation", "7") in [tuple(row[:2]) for row in rows]


def test_a_page_shows_each_line_once_with_the_engine_that_differs(
    both_pages: tuple[Page, str],
) -> None:
    text = both_pages[1]
    assert max(map(len, text.splitlines())) <= 80
    assert_in(text, 'backend="mujoco"', 'backend="pybullet"', "data.qpos[1]")
    assert "import statemachine" not in text


def test_a_page_says_how_many_steps_an_engine_took_itself(both_pages: tuple[Page, str]) -> None:
    flat = " ".join(both_pages[1].split())
    assert_in(flat, "this run: 0.", "this run: 1.", "steps there: 0.")


def test_a_page_says_why_the_run_ended() -> None:
    _, text = page_of("mujoco", code="sm.step(model, data, 0)")
    assert "nstep" in " ".join(text.split()).partition("ended there: ")[2]
