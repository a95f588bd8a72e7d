"""What `--why` finds is the same from Python, in `--json`, in a terminal and on a page."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from html import unescape
from typing import Any

import pytest

from statemachine.lab.questions.requests import causes as instrument
from statemachine.lab.why import Explanation, explain
from statemachine.lab.why import page as why
from statemachine.measures.text import capital, percent
from statemachine.show.as_json import dumps
from statemachine.show.blocks import Table
from statemachine.show.first_screen import LINES

from .support import known_causes as known
from .support.claims import assert_in
from .support.explained import ALONE, ARM, FLOOR, changed, with_changes
from .support.files import written
from .support.requirements import need_engine

MOVES = """
def swing(model, data):
    ctrl = data.ctrl.copy() * 0
    for name, values in (("shoulder", (0.8, -0.3)), ("elbow", (-0.5, 0.6))):
        ctrl[model.actuator_id(name)] = values[data.time >= 0.5 - 1e-9]
    return ctrl


def turn(model, data):
    return [0.8, -0.5] if data.time < 0.5 - 1e-9 else [-0.3, 0.6]


def zero(model, data):
    return data.ctrl * 0
"""


@dataclass(frozen=True)
class Pair:
    """Two sides, and what they do; `known_causes` says what is to be found.

    Attributes:
        left, right: Texts of the models.
        words: Of the command, behind the sides.
        function: What they do.
        right_engine: Of the right side; the left is on the default.
        explained: Whether all of the gap is.
    """

    left: str
    right: str
    words: tuple[str, ...] = ("--keyframe", "home", "--seconds", "1")
    function: str = "swing"
    right_engine: str = "mujoco"
    explained: bool = True


BALL = (*Pair.words, "--quantity", "ball")
SAGS = ("--measure", "end", "--quantity", "slides", "--seconds")
BARE = ARM.replace(FLOOR, "")
DELAYED, _UNDELAYED, *_ = known.EASILY_MISSED["delay on the left"]
DELAYED = with_changes(known.LED, DELAYED)
# Each way in which figures and values are shown.
PAIRS = {
    name: Pair(ARM, changed(ARM, ALONE[name]), (*Pair.words, "--quantity", ALONE[name].quantity))
    for name in ("mass", "gains", "axis", "place", "gravity", "integrator", "softness")
} | {
    "extra shape": Pair(ARM, changed(ARM, ALONE["extra shape"]), BALL),
    "the same": Pair(ARM, known.said_otherwise("fullinertia")),
    "add up": Pair(*known.at_70_to_30(0)[:2], (*SAGS, "3"), "zero"),
    "interact": Pair(*known.that_interact(0)[:2], (*SAGS, "6"), "zero"),
    "brought over": Pair(*known.BROUGHT_OVER[0][:2], BALL),
    "the same motion": Pair(*known.EQUIVALENT["mocap body fixed"], BALL),
    "delayed": Pair(DELAYED, with_changes(DELAYED, _UNDELAYED), function="turn"),
    "across engines": Pair(
        BARE,
        changed(BARE, ALONE["mass"]),
        ("--seconds", "1", "--quantity", "joints"),
        right_engine="pybullet",
    ),
    "outside the list": Pair(
        ARM, with_changes(ARM, [known.EXTRA]), ("--seconds", "1"), explained=False
    ),
}
QUICK = ("mass", "the same", "add up")


@pytest.fixture
def ran(monkeypatch) -> list[Explanation]:
    """What was run: the first explanation is made, and stands for those that follow."""
    found: list[Explanation] = []

    def once(*args: Any, **more: Any) -> Explanation:
        if not found:
            found.append(explain(*args, **more))
        return found[0]

    monkeypatch.setattr(instrument, "explain", once)
    return found


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in PAIRS],
)
def test_json_terminal_and_page_say_what_was_found(name, ran, tmp_path, here, monkeypatch):
    """One run of the command; the other forms are of what it found."""
    pair = PAIRS[name]
    need_engine(pair.right_engine)
    monkeypatch.chdir(tmp_path)  # the paths of a command take lines of the screen
    written(tmp_path / "left.xml", pair.left)
    written(tmp_path / "right.xml", pair.right)
    written(tmp_path / "moves.py", MOVES)
    sides = ("left.xml", f"right.xml@{pair.right_engine}")
    words = ["compare", f"moves.py:{pair.function}", *sides, *pair.words, "--why"]

    told = json.loads(here(*words, "--json", code=int(not pair.explained)).stdout)
    (found,) = ran
    expected = json.loads(dumps(found))
    for key, value in expected.items():
        # What both sides were, the command knows, and not who explains two runs.
        assert key in ("shares", "ranking", "bases") or told[key] == value, key
    assert told["bases"]["differ"] is False
    for each, share in zip(told["shares"], expected["shares"], strict=True):
        assert {**each, "changes": [], "not_written": ""} == share
    assert not any(each["name"].startswith("start") for each in told["shares"])

    rounding, sentence = not found.verdict.divides, why.parts(found)
    able = [e for e in found.shares if not e.note and (rounding or abs(e.share) >= 1e-3)]
    rows = [
        (capital(each.name), "\N{EM DASH}" if rounding else percent(each.share)) for each in able
    ]
    text = here(*words).stdout
    assert len(text.splitlines()) <= LINES
    above_command = text.partition("\n    statemachine ")[0]  # a path is not cut
    assert max(map(len, above_command.splitlines())) <= 80
    for cause, share in rows:  # a name may go on in a second line
        begins = cause.split()[0]
        lines = [line for line in text.splitlines() if line.strip().startswith(begins)]
        assert rounding or any(share in line for line in lines)
    assert found.shares or "Files, options and starts are the same" in " ".join(text.split())
    tables = [block for block in why.causes(found) if isinstance(block, Table)]
    shown = [row for table in tables for row in table.rows]
    cells = [(row[0].partition(" (")[0], row[3].partition(" ±")[0]) for row in shown]
    assert rounding or cells[: len(rows)] == rows

    page = tmp_path / "page.html"
    here(*words, "--no-chaos", "--html", page)
    assert len(ran) == 1
    html = unescape(page.read_text("utf-8")).replace("\N{MINUS SIGN}", "-").replace("\u00a0", " ")
    assert_in(html, *itertools.chain(*([] if rounding else rows)), *[sentence] * (not rounding))
