"""Traces that are broken, cut short, edited or foreign: nothing of them may pass for agreement."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine.atomic_files import check_place, replace_file
from statemachine.errors import BadInputError, ModelFileError, TraceError
from statemachine.interface import JointType
from statemachine.lab.compare import compare, witness
from statemachine.lab.recordings import (
    RunMetadata,
    RunStart,
    Trace,
    model_file,
    read,
    record,
    write,
)

from .support.claims import assert_has, assert_in, refused
from .support.compared import page_of
from .support.files import written_all
from .support.pages import shown
from .support.processes import Cli
from .support.small_models import TWO_NAMELESS, model_of
from .support.traces import added, changed, cut, named


@pytest.fixture(scope="module")
def box() -> Trace:
    return record(
        sm.load("so101/scene_box"),
        seconds=0.3,
        start=RunStart(keyframe="held"),
        metadata=RunMetadata(experiment="box"),
    )


@pytest.mark.parametrize(
    ("column", "quantity"),
    [
        ("site_xpos", "gripperframe, position"),
        ("site_xmat", "gripperframe, rotation"),
        ("energy", "energy"),
        ("contact_force", "gripper on box, normal force"),
    ],
)
def test_what_is_no_number_never_agrees(column: str, quantity: str, box: Trace) -> None:
    found = compare(box, changed(box, None, **{column: added(box[column], 20, np.nan)}))
    assert not found.agrees
    assert (named(found)[quantity].verdict, found.worst.name) == ("differs", quantity)
    assert any(note.startswith(f"{quantity}: no number") for note in found.notes)
    assert "nan" not in shown(page_of(found, details=True))


def test_a_column_that_is_not_told_is_not_compared_and_that_is_said(box: Trace) -> None:
    for column, what in (("site_xpos", "fingertip"), ("contact_force", "contact forces")):
        found = compare(box, changed(box, None, **{column: np.full_like(box[column], np.nan)}))
        assert any(note.endswith(f": {what}") for note in found.notes)
        assert len(found.agreements) < len(compare(box, box).agreements)
    bare = {n: a for n, a in box.columns.items() if not n.startswith("contact_")}
    found = compare(box, Trace(box.header, bare))
    assert not any(each.kind in ("contact", "force") for each in found.agreements)


def test_a_rotation_that_is_none_differs(box: Trace) -> None:
    qpos = np.array(box.qpos)
    at = box.header.jnt_qposadr[box.header.joints.index("box")]
    qpos[:, at + 3 : at + 7] = 0.0
    assert named(compare(box, changed(box, qpos=qpos)))["box, rotation"].verdict == "differs"


def test_who_ended_early_does_not_agree(box: Trace) -> None:
    found = compare(box, cut(box, 5, ended="it diverged"))
    assert {each.verdict for each in found.agreements} == {"agrees"}
    assert_has(found, ended=True, agrees=False)
    assert not page_of(found).holds
    assert any("0.02 s" in note for note in found.notes)


def test_a_shorter_run_is_compared_as_far_as_it_goes_and_that_is_said(box: Trace) -> None:
    found = compare(cut(box, 30), box)
    assert found.agrees
    (note,) = (note for note in found.notes if "s long" in note)
    assert_in(note, "0.145 and 0.3", f"{box.header.label} (second)")
    # Other commands are found in runs of other lengths, too.
    notes = compare(cut(box, 30), changed(box, ctrl=added(box.ctrl, 3, 0.1))).notes
    assert any("the commands differ" in note for note in notes)


def test_bodies_in_another_order_are_the_same_bodies(box: Trace) -> None:
    header = box.header
    order = [0, *range(len(header.bodies) - 1, 0, -1)]
    place = {body: k for k, body in enumerate(order)}
    turned = changed(
        box,
        {
            "bodies": tuple(header.bodies[body] for body in order),
            "body_parentid": tuple(place[header.body_parentid[body]] for body in order),
            "geom_bodyid": tuple(place[body] for body in header.geom_bodyid),
            "jnt_bodyid": tuple(place[body] for body in header.jnt_bodyid),
        },
        xpos=box["xpos"][:, order],
        xquat=box["xquat"][:, order],
    )
    for found in (compare(box, turned), compare(turned, box)):
        assert found.agrees
        assert named(found).keys() == named(compare(box, box)).keys()


def test_bodies_without_names_are_told_apart(tmp_path: Path) -> None:
    trace = record(model_of(tmp_path, TWO_NAMELESS), seconds=0.2)
    pairs = {"body 1 on world", "body 2 on world"}
    assert trace.touches().keys() == pairs
    forces = {each.name for each in compare(trace, trace).agreements if each.kind == "force"}
    assert forces == {f"{pair}, normal force" for pair in pairs}


# What one side has otherwise, and the note that says so.
NOTED: dict[str, Callable[[Trace], Trace]] = {
    "not start in the same state": lambda box: changed(box, qpos=added(box.qpos, 0, 0.1)),
    "commands differ": lambda box: changed(box, ctrl=added(box.ctrl, 3, 0.1)),
    "ended early: it diverged": lambda box: changed(box, {"ended": "it diverged"}),
    "in 7 rows the state was written": lambda box: changed(box, {"rewritten": 7}),
    "not compared, for they are joints of another kind: shoulder_pan": lambda box: changed(
        box, {"jnt_type": (int(JointType.SLIDE), *box.header.jnt_type[1:])}
    ),
}


@pytest.mark.parametrize("note", NOTED)
def test_what_a_comparison_is_not_of_is_said(note: str, box: Trace) -> None:
    assert any(note in line for line in compare(box, NOTED[note](box)).notes)


def test_a_run_whose_time_goes_back_is_no_trace() -> None:
    def back(_model: sm.Model, data: sm.Data) -> None:
        data.time = 0.0

    refused((TraceError, "time does not", lambda: record(sm.load("so101"), back, 0.1)))


def test_what_a_reader_says_at_length_is_cut(box: Trace, tmp_path: Path) -> None:
    """One bit makes the name of an entry 1,024 bytes longer, and zipfile repeats it."""
    file = write(box, tmp_path / "long.npz")
    content = bytearray(file.read_bytes())
    content[content.index(b"PK\x03\x04") + 27] |= 4  # of the length of the first name
    file.write_bytes(content)
    assert len(str(refused((TraceError, "is not a trace", lambda: read(file))))) < 300


def test_a_name_from_a_file_does_nothing_to_a_terminal(
    box: Trace, tmp_path: Path, here: Cli
) -> None:
    evil = "\x1b]0;owned\x07\u202e"
    path = write(changed(box, {"experiment": evil}), tmp_path / "evil.npz")
    played = here("trace", "play", path, "-o", tmp_path / "played.npz")
    names = write(changed(box, {"actuators": (evil, *box.header.actuators[1:])}), path)
    refused = here("trace", "play", names, "-o", tmp_path / "played.npz")
    assert (played.returncode, refused.returncode) == (0, 2)
    for text in (played.stdout, refused.stderr):
        assert text
        assert not {"\x1b", "\x07", "\u202e"} & set(text)


def test_the_model_of_a_trace_is_looked_for_by_its_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Cli
) -> None:
    text = (
        '<mujoco><worldbody><body name="b"><joint name="j" axis="0 1 0"/>'
        '<geom size=".1" pos=".3 0 0"/><site name="tip" pos=".3 0 0"/></body></worldbody></mujoco>'
    )
    one, other = (tmp_path / name / "one.xml" for name in ("robots", "elsewhere"))
    written_all(tmp_path, {"robots/one.xml": text, "elsewhere/empty.txt": ""})
    trace = record(sm.load(one), seconds=0.2, metadata=RunMetadata(experiment="swing"))
    monkeypatch.chdir(other.parent)
    refused((ModelFileError, "behind the trace", lambda: model_file(trace.header)))
    assert model_file(trace.header, beside=one.with_name("t.npz")) == (one, True)
    # Another file of that name here does not take the place of the one that it was.
    for _ in range(2):
        assert model_file(trace.header, menagerie=tmp_path) == (one, True)
        other.write_text(text.replace(".3 0 0", ".4 0 0"))
    assert model_file(trace.header) == (other, False)
    assert witness(trace, trace) is None
    one.unlink()
    write(trace, other.with_name("swing.npz"))
    ran = cli("trace", "play", "elsewhere/swing.npz", "-o", "played.npz", code=0)
    assert "trace was recorded" in ran.stderr
    again = read(tmp_path / "played.npz").header
    assert again.provenance.model_sha256 != trace.header.provenance.model_sha256


def test_the_command_of_a_played_trace_says_what_was_asked(
    box: Trace, tmp_path: Path, here: Cli
) -> None:
    path, out = write(box, tmp_path / "box.npz"), tmp_path / "played.npz"
    here("trace", "play", path, "so101/scene_box", "--backend", "mujoco:engine", "-o", out)
    assert read(out).header.command == (
        "statemachine trace play box.npz so101/scene_box --backend mujoco:engine"
    )


def test_why_finds_common_moments_without_a_table_of_all_pairs(mujoco_arm: sm.Model) -> None:
    """A table of 60 000 × 60 000 numbers would be 29 GB."""
    from statemachine.lab.compare.matching import match_models
    from statemachine.lab.why.gap import Ruler

    short = record(mujoco_arm, seconds=0.1, derived="nothing")
    time = np.arange(60_000) * 0.005
    columns = {n: np.repeat(short[n][:1], len(time), axis=0) for n in ("qpos", "qvel", "ctrl")}
    long = Trace(short.header, {**columns, "time": time})
    ruler = Ruler(match_models(mujoco_arm, mujoco_arm), long, long)
    assert np.array_equal(ruler.time, time)
    assert not ruler.between


@pytest.mark.slow
def test_models_compare_alike_whatever_strings_hash_to(cli: Cli) -> None:
    words = ("compare", "--models", "so101", "so101", "--json")
    one, two = (cli(*words, PYTHONHASHSEED=seed, code=0).stdout for seed in ("1", "77"))
    assert one == two


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc, which takes no file")
def test_a_filesystem_that_takes_no_file_is_refused_before_anything_is_run() -> None:
    refused((BadInputError, "cannot be written", lambda: check_place(Path("/proc/fitted.xml"))))


def test_looking_at_a_place_leaves_nothing_there(tmp_path: Path) -> None:
    check_place(tmp_path / "fitted.xml")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_what_is_no_file_is_written_into_and_stays(tmp_path: Path) -> None:
    """A rename would put a file in its place; as root, in that of /dev/null."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    check_place(pipe)
    replace_file(pipe, lambda out: out.write(b"whole"))
    reader.join(20)
    assert got == [b"whole"]
    assert pipe.is_fifo()
    assert [each.name for each in tmp_path.iterdir()] == ["pipe"]
    link, null = tmp_path / "link", Path(os.devnull)
    before = null.stat()
    link.symlink_to(null)
    replace_file(link, lambda out: out.write(b"x"))
    assert link.is_symlink()
    assert_has(null.stat(), st_mode=before.st_mode, st_rdev=before.st_rdev)


def test_what_a_library_says_of_a_file_is_not_lost(tmp_path: Path) -> None:
    """Pillow and pyarrow raise an OSError that has words and no number."""

    refused(
        (
            OSError,
            "encoder error -2",
            lambda: replace_file(
                tmp_path / "a.png",
                Mock(side_effect=OSError("encoder error -2 when writing image file")),
            ),
        )
    )
    assert list(tmp_path.iterdir()) == []
