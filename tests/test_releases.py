"""Other releases of MuJoCo, each in an environment and a process of its own."""

from __future__ import annotations

import copy
import gc
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import conformance, releases
from statemachine.cli import main
from statemachine.errors import (
    BadInputError,
    DivergedError,
    EngineError,
    MissingEngineError,
    ModelError,
    UnknownNameError,
    UnsupportedError,
)
from statemachine.installed import engine_version
from statemachine.processes import resident_memory
from statemachine.worlds import make_worlds, step

from .support.backends import RELEASES, process_of, registered
from .support.claims import assert_in, refused
from .support.files import written, written_all
from .support.motions import after, bits, opened, path
from .support.pages import lesson_result
from .support.processes import lives, memory_of, soon
from .support.small_models import LINKS_AND_BALL, mjcf, model_of

OLD, STRANGE, SAME = RELEASES
HOLD = [0.0, -0.6, 1.2, 0.5, 0.0, 0.6]
MISSING, BAD_INPUT, SAYS_NO = 3, 2, 1


@pytest.fixture
def nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a user without any release."""
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(tmp_path))
    return tmp_path


installs = pytest.mark.usefixtures("old_releases")


def run_of(model: Any, nstep: int = 400, call: int = 1) -> Any:
    """Return positions of `hold` after each call of so many steps, and its Data."""
    data, rows = sm.make_data(model), []
    data.ctrl[:] = HOLD
    for _ in range(nstep // call):
        sm.step(model, data, call)
        rows.append(data.qpos.copy())
    return np.array(rows), data


@pytest.mark.parametrize(
    ("name", "error", "says"),
    [
        (OLD, MissingEngineError, f"statemachine engines add {OLD}"),
        ("mujoco==new", BadInputError, "type mujoco==3.3.7"),
        ("mujoco==３.3.7", BadInputError, "release of mujoco"),
        ("mujoco==3.3.7é", BadInputError, "release of mujoco"),
        ("mujoco==3.3", BadInputError, "type mujoco==3.3.0"),
        ("pybullet==3.2.5", UnknownNameError, "named 'pybullet'"),
        ("pinocchio==3.0.0", UnknownNameError, "named 'pinocchio'"),
    ],
)
@pytest.mark.usefixtures("nothing")
def test_what_is_not_here_is_one_line(name: str, error: type[Exception], says: str) -> None:
    refused((error, says, lambda: sm.load("so101", backend=name)))


def test_exit_codes_of_commands_without_any_release(
    nothing: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = {
        "engines": 0,
        "engines --json": 0,
        "engines list --json": 0,
        f"engines remove {OLD}": MISSING,
        "engines add mujoco": BAD_INPUT,
        f"engines add {OLD} --python no-such-python": BAD_INPUT,
        f"compare hold so101@{OLD} so101": MISSING,
        "compare hold --versions=": BAD_INPUT,
        f"compare hold --versions {engine_version('mujoco')}": BAD_INPUT,
        "compare hold a b --models": BAD_INPUT,
        "compare hold --versions 3.3.7,3.1.6": MISSING,
    }
    assert {words: main(words.split()) for words in asked} == asked
    said = capsys.readouterr().err
    assert_in(said, "'mujoco=='", "compare --models a b")
    assert "Traceback" not in said
    assert said.endswith("statemachine engines add mujoco==3.1.6 mujoco==3.3.7\n")
    assert not list(nothing.iterdir())


def test_what_is_half_made_is_never_found(nothing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(name: str, *command: str) -> None:
        if "venv" not in command:
            raise EngineError(f"{name} cannot be installed: the disk is full")

    monkeypatch.setattr(releases, "run_installer", fails)
    refused((EngineError, "the disk is full", lambda: releases.add(OLD, say=lambda _line: None)))
    assert not list(nothing.iterdir())


# It makes an environment whose Python says that it has the engine.
_UV = """#!/bin/sh
{trouble}
test "$1" = venv || exit 0
for place; do :; done
mkdir -p "$place/bin"
printf '#!/bin/sh\necho 3.3.7\n' > "$place/bin/python"
chmod +x "$place/bin/python"
"""


@pytest.fixture
def adding(nothing: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Return processes that add a release, where that meets some trouble."""
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(nothing / "home"))
    monkeypatch.setenv("PATH", f"{nothing}{os.pathsep}{os.environ['PATH']}")

    def start(trouble: str) -> subprocess.Popen[str]:
        written(nothing / "uv", _UV.format(trouble=trouble)).chmod(0o755)
        return subprocess.Popen(
            [sys.executable, "-m", "statemachine", "engines", "add", OLD],
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    return start


def test_a_disk_that_is_full_while_it_is_added(adding: Callable[[str], Any]) -> None:
    with adding("echo 'error: No space left on device' >&2; exit 1") as process:
        _, said = process.communicate()
    assert (process.returncode, said.count("\n")) == (BAD_INPUT, 1)
    assert_in(said, OLD, "No space left")
    assert not list(releases.folder().iterdir())


def test_ctrl_c_while_it_is_added(adding: Callable[[str], Any]) -> None:
    with adding("sleep 30") as process:
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)
        out, said = process.communicate()
    assert (process.returncode, out, said) == (130, "", "\n")
    assert not list(releases.folder().iterdir())


def test_what_a_killed_add_left_is_cleared_and_what_one_that_runs_makes_is_not(
    adding: Callable[[str], Any],
) -> None:
    with adding("sleep 30") as killed, adding("sleep 30") as running:
        for process in (killed, running):
            process.stdout.readline()
        os.killpg(killed.pid, signal.SIGKILL)
        killed.wait()
        made = list(releases.folder().iterdir())
        assert len(made) == 2
        for place in made:
            os.utime(place / "lock", (0, 0))  # they were made long ago
        assert main(["engines"]) == 0
        (left,) = releases.folder().iterdir()
        os.killpg(running.pid, signal.SIGINT)
        running.communicate()
    assert left in made
    assert not list(releases.folder().iterdir())
    assert not releases.is_here(OLD)


def test_two_that_add_it_at_once(adding: Callable[[str], Any]) -> None:
    (releases.folder() / OLD / "bin").mkdir(parents=True)  # one whose Python was lost
    both = [adding("sleep 0.3") for _ in range(2)]
    ends = [process.communicate() for process in both]
    assert [process.returncode for process in both] == [0, 0], ends
    assert [place.name for place in releases.folder().iterdir()] == [OLD]
    assert [release.name for release in releases.releases()] == [OLD]


def test_the_index_is_asked_by_uv_where_there_is_no_pip(
    nothing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    versions = f"9.0.0, {engine_version('mujoco')}, 3.10.0, 3.9.0, 3.8.0"
    script = f"#!/bin/sh\ntest $6 = index && echo 'Available versions: {versions}'"
    written(nothing / "uv", script).chmod(0o755)
    monkeypatch.setenv("PATH", f"{nothing}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(releases, "find_spec", lambda _name: None)
    assert releases.published("3.9.0") == ["mujoco==3.9.0", "mujoco==3.10.0", "mujoco"]


@pytest.mark.usefixtures("nothing")
def test_bisection_leaves_out_what_cannot_be_added(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is 5 that changed the motion; 4 and 5 have no wheel for this Python."""

    def add(name: str, say: Callable[[str], object]) -> None:
        if name[-1] in "45":
            raise EngineError(f"{name} cannot be installed")

    monkeypatch.setattr(releases, "add", add)
    rows, said = [*(f"mujoco==3.0.{k}" for k in range(9)), "mujoco"], list[str]()
    found = releases.around_a_change(
        rows,
        lambda pair: SimpleNamespace(outcome="differs" if pair[1] in rows[5:] else "agrees"),
        said.append,
    )
    assert found == [rows[0], rows[3], rows[6], "mujoco"]
    assert [line.split()[0] for line in said] == [rows[4], rows[5]]


# What a run begins with beside positions and velocities: an activation, the pose of a mocap body.
REMEMBERED = mjcf(
    "<geom type='plane' size='1 1 .1'/>"
    "<body name='hand' mocap='true' pos='0 0 1'><geom size='.05' contype='0'/></body>"
    "<body name='box' pos='.3 0 .1'><freejoint/><geom type='box' size='.1 .1 .1'/></body>"
    "<body pos='0 1 1'><joint name='j' axis='0 1 0'/><geom size='.05' pos='.3 0 0'/></body>",
    "<equality><weld body1='hand' body2='box'/></equality>"
    "<actuator><general joint='j' dyntype='filter' dynprm='.1' gainprm='3'/></actuator>"
    "<keyframe><key qpos='.3 0 .1 1 0 0 0 .2' act='.7' mpos='0 .2 1'/></keyframe>",
    "<option solver='PGS' tolerance='1e-5'/>",
)
CLOTH = (
    "<flexcomp name='f' type='grid' count='3 3 1' spacing='.1 .1 .1' mass='.5' dim='2'>"
    "<edge equality='true'/></flexcomp>"
)
GROUND = mjcf(
    "<geom type='hfield' hfield='h'/><geom type='mesh' mesh='m' pos='9 9 9'/>"
    "<body pos='0 0 1'><freejoint/><geom size='.1' pos='.03 0 0'/></body>",
    "<asset><hfield name='h' nrow='2' ncol='2' size='1 1 .5 .1'/>"
    "<mesh name='m' vertex='0 0 0  1 0 0  0 1 0  0 0 1'/></asset>",
)


def pushed(model: Any, key: int | None = None) -> np.ndarray:
    """Return where three times the mass is, after velocities were written."""
    with opened(model.replace(mass=model.body_mass * 3), key) as (heavy, data):
        for _ in range(20):
            sm.step(heavy, data)
            data.qvel[0] += 0.1
            data.mocap_pos[:, 2] += 0.001
        return data.qpos.copy()


def on_raised_ground(model: Any) -> np.ndarray:
    """Return where it lands, where heights are written into the compiled model."""
    raised = copy.copy(model.compiled)
    raised.hfield_data[:] = 1
    return after(model.with_compiled(raised), 400)


@pytest.mark.slow
@pytest.mark.network
@installs
class TestReleases:
    def test_the_same_release_gives_the_same_bits(self) -> None:
        models = [sm.load("so101/scene", backend=name) for name in ("mujoco", SAME)]
        (rows, ours), (others, theirs) = (run_of(model, 600) for model in models)
        assert np.array_equal(rows, others)
        assert bits(ours) == bits(theirs)

    @pytest.mark.parametrize(
        ("text", "play", "backends"),
        [
            (REMEMBERED, pushed, ("mujoco", SAME)),
            (REMEMBERED, partial(pushed, key=0), ("mujoco", SAME)),
            (mjcf(CLOTH), pushed, ("mujoco", SAME)),
            (GROUND, on_raised_ground, ("mujoco", SAME)),
        ],
    )
    def test_what_is_not_read_from_the_file_is_there(
        self, text: str, play: Any, backends: Any, tmp_path: Path
    ) -> None:
        assert np.array_equal(*(play(model_of(tmp_path, text, backend=b)) for b in backends))

    def test_constants_of_a_release_follow_masses_in_its_own_way(self, tmp_path: Path) -> None:
        """The mean inertia, with which a solver of 3.3 scales, stays as it is in 4.0."""
        model: Any = model_of(tmp_path, REMEMBERED, backend=OLD)
        ours = after(model.replace(mass=model.body_mass * 3), 20)
        code = (
            f"import mujoco; model = mujoco.MjModel.from_xml_path({str(model.path)!r})\n"
            "model.body_mass[:] *= 3; model.body_inertia[:] *= 3; data = mujoco.MjData(model)\n"
            "mujoco.mj_setConst(model, data); mujoco.mj_resetData(model, data)\n"
            "mujoco.mj_step(model, data, 20); print(*data.qpos)"
        )
        raw = subprocess.check_output([releases.python_of(OLD), "-I", "-c", code], text=True)
        assert ours == pytest.approx(list(map(float, raw.split())), abs=1e-12)

    def test_what_cannot_be_there_is_one_line(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        model = model_of(tmp_path, GROUND, backend=SAME)
        edited = copy.copy(model.compiled)
        edited.mesh_vert[:] *= 2
        refused(
            (
                UnsupportedError,
                "'mesh_vert'",
                lambda: model.with_compiled(edited),
            ),
        )

    def test_the_contract_is_kept(self) -> None:
        assert not [o for o in conformance.run(SAME) if o.result == "failed"]

    def test_until_3_4_a_clamped_servo_damps(self, capsys: pytest.CaptureFixture[str]) -> None:
        """The update of velocities took kv in where the force is clamped; Euler's never did."""
        models = [sm.load("so101", backend=name) for name in ("mujoco", OLD)]
        for integrator, gap, most in (("implicitfast", 6.2, 0.05), ("euler", 0.0, 1e-8)):
            new, old = (run_of(model.replace(integrator=integrator))[0] for model in models)
            assert np.degrees(np.abs(new - old).max()) == pytest.approx(gap, abs=most)
        sides = (f"so101@{OLD}", "so101")
        for words, code, *says in (
            (("hold", *sides, "--one-step"), SAYS_NO, "that differs is “velocity update”"),
            (
                *(("hold", *sides, "--why", "--details"), 0),
                *("Integrator implicitfast implicitfast", "both sides run with euler"),
            ),
            (("--models", *sides, "--details"), 0, "loaded into mujoco 3.3.7"),
        ):
            assert main(["compare", *words]) == code
            assert_in(" ".join(capsys.readouterr().out.split()), *says)

    def test_between_which_releases_it_changed(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        versions = ("--versions", "3.3.7," + SAME.partition("==")[2], "so101")
        assert main(["compare", "hold", *versions, "--json"]) == SAYS_NO
        (pair,) = json.loads(capsys.readouterr().out)["pairs"]
        assert pair["backends"] == [OLD, "mujoco"]
        picture = tmp_path / "releases.svg"
        assert main(["compare", "hold", *versions, "--plot", str(picture)]) == SAYS_NO
        assert f"3.3.7 to {engine_version('mujoco')}" in picture.read_text("utf-8")
        assert_in(capsys.readouterr().out, "3.3.7", "4.0.0")
        assert main(["compare", "fall", *versions]) == 0
        assert "is the same" in capsys.readouterr().out

    def test_bisection_finds_the_release_that_changed_it(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        first, *since, last = releases.published("3.3.7")
        assert (first, last) == (OLD, "mujoco")
        assert "mujoco==3.4.0" in since
        assert SAME not in since
        refused(
            (BadInputError, r"has no mujoco==3\.3\.99 before", lambda: releases.published("3.3.99"))
        )
        # Each release of this row is here: the change is from the last 3.3.7 to the first 4.0.0.
        monkeypatch.setattr(
            releases, "published", lambda _since: [OLD] * 4 + [SAME] * 3 + ["mujoco"]
        )
        asked = ("--versions", "3.3.7", "--bisect", "so101", "--json")
        assert main(["compare", "hold", *asked]) == SAYS_NO
        pairs = [
            (*pair["backends"], pair["comparison"]["agrees"])
            for pair in json.loads(capsys.readouterr().out)["pairs"]
        ]
        assert pairs == [(OLD, OLD, True), (OLD, SAME, False), (SAME, "mujoco", True)]

    def test_what_a_release_cannot_read_is_said(self) -> None:
        refused(
            (
                ModelError,
                r"MuJoCo 3\.0\.1 cannot read .*'kv'",
                lambda: sm.load("so101", backend=STRANGE),
            )
        )

    def test_a_dead_process_is_one_error_and_the_others_go_on(self) -> None:
        model = sm.load("so101", backend=OLD)
        (whole, _), (rows, data), (_, other) = (run_of(model, nstep) for nstep in (20, 10, 10))
        os.kill(process_of(model), signal.SIGKILL)
        time.sleep(0.2)
        refused((EngineError, "ended by SIGKILL", lambda: sm.step(model, data)))
        assert np.array_equal(data.qpos, rows[-1])
        for _ in range(10):  # what it was is known here
            sm.step(model, other)
        assert np.array_equal(other.qpos, whole[-1])
        sm.reset(model, data)
        sm.step(model, data)

    def test_another_release_in_its_place_is_seen(self, nothing: Path) -> None:
        strange, broken = nothing / "mujoco==3.3.6", nothing / OLD
        strange.symlink_to(Path(sys.prefix, "engines", OLD))
        written_all(broken, {"bin/python": ""})
        refused(
            (
                EngineError,
                "has 3.3.7: statemachine",
                lambda: sm.load("so101", backend=strange.name),
            ),
            (
                EngineError,
                "Permission denied.*; to make it anew",
                lambda: sm.load("so101", backend=OLD),
            ),
        )
        assert lesson_result("hold", sm.load("so101/scene"), further=True).older.recorded
        releases.remove(OLD)
        assert not broken.exists()

    def test_one_that_begins_anew_by_itself_has_diverged(self, tmp_path: Path) -> None:
        """Until 3.3 no flag keeps it from that."""
        body = "<body><joint name='j' axis='0 1 0'/><geom size='.1' pos='.2 0 0'/></body>"
        drive = "<actuator><motor joint='j' gear='1e12'/></actuator>"
        model = model_of(tmp_path, mjcf(body, drive), backend=STRANGE)
        refused(
            (DivergedError, "", lambda: path(model, 400, ctrl=[1e5])),
            (DivergedError, "", opened(model, nstep=400, ctrl=[1e5]).__enter__),
        )

    def test_a_fork_while_a_thread_steps(self) -> None:
        model = sm.load("so101", backend=OLD)
        thread = threading.Thread(target=sm.step, args=(model, sm.make_data(model), 100_000))
        thread.start()
        pid = os.fork()
        if not pid:
            os._exit(0)
        ended = soon(lambda: not lives(pid))
        thread.join()
        assert ended
        os.waitpid(pid, 0)

    def test_a_kill_at_any_moment_is_one_error(self) -> None:
        """The next state goes on where the last call that ended was."""
        model: Any = sm.load("so101", backend=OLD)
        rows, _ = run_of(model, 400, 20)
        data = sm.make_data(model)
        generator, ends = np.random.default_rng(0), list[str]()
        for _ in range(15):
            sm.reset(model, data)
            data.ctrl[:] = HOLD
            kill = partial(os.kill, process_of(model), signal.SIGKILL)
            killer = threading.Timer(generator.uniform(0, 0.01), kill)
            killer.start()
            try:
                for row in rows:
                    sm.step(model, data, 20)
                    assert np.array_equal(data.qpos, row)
            except EngineError as error:
                ends.append(str(error))
            killer.join()
        assert {re.sub(".*: ", "", end) for end in ends} == {"ended by SIGKILL"}

    def test_it_ends_with_its_parent(self) -> None:
        code = (
            "import statemachine as sm, threading\n"
            "from tests.support.backends import process_of\n"
            f"model = sm.load('so101', backend={OLD!r})\n"
            "data, pid = sm.make_data(model), process_of(model)\n"
            "threading.Timer(0.5, lambda: print(pid, flush=True)).start()\n"
            "sm.step(model, data, 10**8)"
        )
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as parent:
            assert parent.stdout is not None
            pid = int(parent.stdout.readline())
            parent.kill()
        assert soon(lambda: not lives(pid))

    def test_a_file_that_changed_is_not_another_robot(self, tmp_path: Path) -> None:
        model: Any = model_of(tmp_path, LINKS_AND_BALL, backend=OLD)
        first, other = sm.make_data(model), model.replace(damping=0.3)
        model.path.write_text(LINKS_AND_BALL.replace('damping="0.1"', 'damping="0.2"'))
        sm.step(model, first)
        sm.step(model, sm.make_data(model))  # what was compiled is there, once for all Data
        refused((EngineError, "another file", lambda: sm.make_data(other)))

    def test_what_is_closed_or_collected_is_forgotten_there(
        self, request: pytest.FixtureRequest
    ) -> None:
        model = sm.load("so101", backend=OLD)
        pid = process_of(model)
        sizes = []
        gc.disable()  # no world waits for the collector of cycles
        request.addfinalizer(gc.enable)
        for _ in range(3):
            for k in range(40):
                data = sm.make_data(model.replace(damping=0.1 + k / 100))
                sm.step(data.model, data)
                if k % 2:
                    data.close()
            sizes.append(1e6 * memory_of(pid))
        assert sizes[2] < sizes[0] + 20e6  # forgotten by nobody, 40 took 100 MB
        # What is there is counted, too.
        assert resident_memory() > 1e6 * memory_of(os.getpid()) + sizes[2] / 2

    def test_worlds_of_a_release_are_its_data(self) -> None:
        model = sm.load("so101", backend=OLD)
        with make_worlds(model, 3, workers=2) as worlds:
            worlds.ctrl[:] = HOLD
            step(worlds, 20)
            assert np.array_equal(worlds.qpos[2], run_of(model, 20)[0][-1])

    def test_any_engine_by_one_file(self, monkeypatch: pytest.MonkeyPatch) -> None:
        with registered("made up", "tests.support.backends:load_made_up") as name:
            outcomes = conformance.run(name)
            model = sm.load("so101", backend=name)
        assert model.engine_version == f"made up on {engine_version('mujoco')}"
        assert not [outcome for outcome in outcomes if outcome.result == "failed"]
        assert {outcome.result for outcome in outcomes} == {"passed", "skipped"}
        assert np.array_equal(run_of(model)[0], run_of(sm.load("so101"))[0])
        refused((UnsupportedError, "contacts", lambda: model.replace(contacts=False)))  # a flag
