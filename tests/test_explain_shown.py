"""What `--why` finds is the same from Python, in `--json`, in a terminal and on a page."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from html import unescape
from typing import Any

import pytest

from statemachine.compare import why as instrument
from statemachine.compare.why import Explanation, explain
from statemachine.measures.text import capital, percent
from statemachine.report import why

from . import test_explain as known
from .conftest import need_engine
from .explained import ALONE, ARM, changed, write


def _plain(html: str) -> str:
    """The text of a page, without its spaces that do not break and its signs of minus."""
    text = unescape(re.sub(r"<[^<>]*>", "", html)).replace("\N{MINUS SIGN}", "-")
    return " ".join(text.split())


def _rows(html: str, title: str) -> list[list[str]]:
    """The cells of the table below a title, row by row."""
    table = html[html.index(title) :]
    table = table[: table.index("</table>")]
    rows = re.findall(r"<tr.*?</tr>", table, re.DOTALL)
    cells = [re.findall(r"<t[dh].*?</t[dh]>", row, re.DOTALL) for row in rows]
    return [[_plain(cell) for cell in row] for row in cells]


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
    """Two sides, and what they do; `test_explain` says what is to be found.

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
BARE = ARM.replace(known.FLOOR, "")
DELAYED, _UNDELAYED, *_ = known.EASILY_MISSED["delay on the left"]
DELAYED = known.with_changes(known.LED, DELAYED)
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
    "delayed": Pair(DELAYED, known.with_changes(DELAYED, _UNDELAYED), function="turn"),
    "across engines": Pair(
        BARE,
        changed(BARE, ALONE["mass"]),
        ("--seconds", "1", "--quantity", "joints"),
        right_engine="pybullet",
    ),
    "outside the list": Pair(
        ARM, known.with_changes(ARM, [known.EXTRA]), ("--seconds", "1"), explained=False
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
def test_json_terminal_and_page_say_what_was_found(name, ran, tmp_path, here):
    """One run of the command; the other forms are of what it found."""
    pair = PAIRS[name]
    need_engine(pair.right_engine)
    left, right = write(tmp_path, "left.xml", pair.left), write(tmp_path, "right.xml", pair.right)
    function = f"{write(tmp_path, 'moves.py', MOVES)}:{pair.function}"
    words = ["compare", function, str(left), f"{right}@{pair.right_engine}", *pair.words, "--why"]

    done = here(*words, "--json")
    assert done.returncode == (0 if pair.explained else 1)
    told = json.loads(done.stdout)
    (found,) = ran
    assert not any(each["name"].startswith("start") for each in told["shares"])
    for part in ("explained", "located", "unexplained", "gap", "quantity", "unit"):
        assert told[part] == getattr(found, part)
    assert [(each["name"], each["share"]) for each in told["shares"]] == [
        (each.name, each.share) for each in found.shares
    ]

    able = [e for e in found.shares if not e.note and (found.is_rounding or abs(e.share) >= 1e-3)]
    rounding = found.is_rounding
    rows = [
        (capital(each.name), "\N{EM DASH}" if rounding else percent(each.share)) for each in able
    ]
    sentence = why.parts(found)
    text = here(*words).stdout
    flat = " ".join(text.split())
    assert (sentence in flat) != rounding
    for cause, share in rows:  # a name may go on in a second line
        begins = cause.split()[0]
        lines = [line for line in text.splitlines() if line.strip().startswith(begins)]
        assert rounding or any(share in line for line in lines)

    page = tmp_path / "page.html"
    here(*words, "--no-chaos", "--html", page)
    assert len(ran) == 1
    html = page.read_text(encoding="utf-8")
    if not rounding:
        assert sentence in _plain(html)
    if able:
        title = "What differs" if rounding else "What differs, and its part of the"
        shown = [row for row in _rows(html, title) if len(row) == 6][1 : len(able) + 1]
        assert [row[0].partition(" (")[0] for row in shown] == [cause for cause, _ in rows]
        assert rounding or [row[3].partition(" ±")[0] for row in shown] == [s for _, s in rows]
    elif not found.shares:
        assert "All that is compared is the same" in flat
