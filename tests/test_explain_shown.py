"""What `--why` finds is the same from Python, in `--json`, in a terminal and on a page."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from statemachine.cli import main
from statemachine.compare import Request, Side
from statemachine.compare import why as instrument
from statemachine.compare.why import Explanation, explain
from statemachine.measures.text import capital, percent
from statemachine.report.why_words import three

from . import test_explain as known
from .conftest import need_engine
from .explained import ALONE, ARM, Case, changed, write

CASES = (
    *("mass", "gains", "damping", "armature", "axis", "place"),
    *("gravity", "integrator", "geom moved", "softness", "extra shape"),
)
SWING = """
def swing(model, data):
    ctrl = data.ctrl.copy()
    early = data.time < 0.25
    ctrl[model.actuator_id("shoulder")] = 0.8 if early else -0.3
    ctrl[model.actuator_id("elbow")] = -0.5 if early else 0.6
    return ctrl
"""
# A second cause, so that the shares are not all zero and one.
ALSO = Case('stiffness="40"', 'stiffness="42"', "spring of spring")
OTHER = Case('mass="0.5" pos', 'mass="0.505" pos', "mass of upper")


def _words(folder: Path, name: str) -> tuple[list[str], str]:
    """The words of the command, and the quantity."""
    case = ALONE[name]
    more = ALSO if case.quantity == "slides" else OTHER
    left = write(folder, "left.xml", ARM)
    right = write(folder, "right.xml", changed(ARM, case, more))
    function = f"{write(folder, 'swing.py', SWING)}:swing"
    words = [function, str(left), str(right), "--keyframe", "home", "--seconds", "0.5"]
    return ["compare", *words, "--quantity", case.quantity], case.quantity


def _from_python(words: list[str], quantity: str) -> Explanation:
    left, right = Side(words[2]), Side(words[3])
    scenario = Request((words[1],), sides=(left, right), keyframe="home").scenario()
    return explain(left.load(), right.load(), scenario, seconds=0.5, quantity=quantity)


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


@pytest.mark.parametrize(
    "name", [*CASES[:2], *(pytest.param(name, marks=pytest.mark.slow) for name in CASES[2:])]
)
def test_json_terminal_and_page_say_what_python_finds(name, tmp_path, capsys):
    words, quantity = _words(tmp_path, name)
    found = _from_python(words, quantity)
    assert found.shares[0].name == ALONE[name].cause
    code = 0 if found.is_explained else 1

    assert main([*words, "--why", "--json"]) == code
    told = json.loads(capsys.readouterr().out)
    assert [(each["name"], each["share"]) for each in told["shares"]] == [
        (each.name, each.share) for each in found.shares
    ]
    assert (told["gap"], told["explained"]) == (found.gap, found.explained)

    assert main([*words, "--why"]) == code
    text = capsys.readouterr().out
    first = found.shares[0]
    (row,) = [line for line in text.splitlines() if line.startswith(capital(first.name))][:1]
    assert percent(first.share) in row

    page = tmp_path / "page.html"
    main([*words, "--why", "--html", str(page)])
    capsys.readouterr()
    rows = _rows(page.read_text(encoding="utf-8"), "What differs, and its part of the")
    shown = [row for row in rows if len(row) == 6][-len(found.shares) :]
    assert [row[0].partition(" (")[0] for row in shown] == [
        capital(each.name) for each in found.shares
    ]
    assert [row[3] for row in shown] == [percent(each.share) for each in found.shares]


MOVES = """
def swing(model, data):
    ctrl = data.ctrl.copy() * 0
    for name, values in (("shoulder", (0.8, -0.3)), ("elbow", (-0.5, 0.6))):
        ctrl[model.actuator_id(name)] = values[data.time >= 0.5 - 1e-9]
    return ctrl


def turn(model, data):
    return [0.8, -0.5] if data.time < 0.5 - 1e-9 else [-0.3, 0.6]


def leave(model, data):
    return None


def zero(model, data):
    return data.ctrl * 0
"""


@dataclass(frozen=True)
class Pair:
    """Two sides, what they do, and what is to be found.

    Attributes:
        left, right: Texts of the models.
        causes: The causes with a share of at least 2 %, and between what these are; None where
            nothing is known of them but that they explain all.
        words: Of the command, behind the sides.
        function: What they do.
        right_engine: Of the right side; the left is on the default.
        explained: Whether all of the gap is.
    """

    left: str
    right: str
    causes: dict[str, tuple[float, float]] | None
    words: tuple[str, ...] = ("--keyframe", "home", "--seconds", "1")
    function: str = "swing"
    right_engine: str = "mujoco"
    explained: bool = True


def _all(*causes: str) -> dict[str, tuple[float, float]]:
    """One cause is all of it."""
    return dict.fromkeys(causes, (0.95, 1.05))


def _pairs() -> dict[str, Pair]:
    home, ball = Pair.words, (*Pair.words, "--quantity", "ball")
    pairs = {}
    for name, case in ALONE.items():
        words = (*home, "--quantity", case.quantity)
        pairs[name] = Pair(ARM, changed(ARM, case), _all(case.cause), words)
    sags = ("--seconds", "3", "--measure", "end", "--quantity", "slides")
    for seed in range(8):
        left, right = known.at_70_to_30(seed)[:2]
        parts = {"mass of slider": (0.65, 0.75), "mass of load": (0.25, 0.35)}
        pairs[f"70 to 30, seed {seed}"] = Pair(left, right, parts, sags, "zero")
        left, right, heavier, stiffer = known.that_interact(seed)
        parts = {"mass of slider": (heavier - 0.01, heavier + 0.01)}
        parts["gains of slider"] = (stiffer - 0.01, stiffer + 0.01)
        words = ("--seconds", "6", *sags[2:])
        pairs[f"interacting, seed {seed}"] = Pair(left, right, parts, words, "zero")
    for name in known.SAME:
        pairs[f"same: {name}"] = Pair(ARM, known.said_otherwise(name), {})
    for name, (left, right) in known.EQUIVALENT.items():
        pairs[f"same: {name}"] = Pair(left, right, None, ball)
    for k, (left, right, cause) in enumerate(known.BROUGHT_OVER):
        pairs[f"brought over {k}: {cause}"] = Pair(left, right, _all(cause), ball)
    for k, (left, right, causes) in enumerate(known.SHARED):
        pairs[f"shared mesh {k}"] = Pair(left, right, _all(*causes) if k < 3 else None, ball)
    for name, (both, other, cause, *quantity) in known.EASILY_MISSED.items():
        left = known.with_changes(known.LED, both)
        words = (*home, "--quantity", quantity[0]) if quantity else home
        function = "turn" if "delay" in name else "leave"
        right = known.with_changes(left, other)
        pairs[f"easily missed: {name}"] = Pair(left, right, _all(cause), words, function)
    for name in known.ACROSS:
        left = ARM.replace(known.FLOOR, "")
        right, words = changed(left, ALONE[name]), ("--seconds", "1", "--quantity", "joints")
        cause = _all(ALONE[name].cause)
        pairs[f"across engines: {name}"] = Pair(left, right, cause, words, right_engine="pybullet")
    right = known.with_changes(ARM, [known.EXTRA])
    words = ("--seconds", "1")
    pairs["outside the list"] = Pair(ARM, right, {}, words, explained=False)
    return pairs


PAIRS = _pairs()
QUICK = ("mass", "same: fullinertia", "70 to 30, seed 0")


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
def test_every_known_case_in_json_terminal_and_page(name, ran, tmp_path, capsys):
    """One run of the command; the other forms are of what it found."""
    pair = PAIRS[name]
    need_engine(pair.right_engine)
    left, right = write(tmp_path, "left.xml", pair.left), write(tmp_path, "right.xml", pair.right)
    function = f"{write(tmp_path, 'moves.py', MOVES)}:{pair.function}"
    words = ["compare", function, str(left), f"{right}@{pair.right_engine}", *pair.words, "--why"]

    assert main([*words, "--json"]) == (0 if pair.explained else 1)
    told = json.loads(capsys.readouterr().out)
    (found,) = ran
    assert not any(each["name"].startswith("start") for each in told["shares"]) or name == "start"
    if pair.causes is not None:
        large = {
            each["name"]: each["share"] for each in told["shares"] if abs(each["share"] or 0) > 0.02
        }
        assert large.keys() == pair.causes.keys()
        for cause, (least, most) in pair.causes.items():
            assert least <= large[cause] <= most
    for part in ("explained", "located", "unexplained", "gap", "quantity", "unit"):
        assert told[part] == getattr(found, part)
    assert [(each["name"], each["share"]) for each in told["shares"]] == [
        (each.name, each.share) for each in found.shares
    ]

    able = [each for each in found.shares if not each.note]
    rounding = found.is_rounding
    rows = [
        (capital(each.name), "\N{EM DASH}" if rounding else percent(each.share)) for each in able
    ]
    sentence = three(found.explained, found.located, found.unexplained)
    main(words)
    text = capsys.readouterr().out
    flat = " ".join(text.split())
    assert (sentence in flat) != rounding
    for cause, share in rows:  # a name may go on in a second line
        begins = cause.split()[0]
        lines = [line for line in text.splitlines() if line.strip().startswith(begins)]
        assert rounding or any(share in line for line in lines)

    page = tmp_path / "page.html"
    main([*words, "--no-floor", "--html", str(page)])
    capsys.readouterr()
    assert len(ran) == 1
    html = page.read_text(encoding="utf-8")
    if not rounding:
        assert sentence in _plain(html)
    if able:
        title = "What differs" if rounding else "What differs, and its part of the"
        shown = [row for row in _rows(html, title) if len(row) == 6][-len(able) :]
        assert [row[0].partition(" (")[0] for row in shown] == [cause for cause, _ in rows]
        assert rounding or [row[3].partition(" ±")[0] for row in shown] == [s for _, s in rows]
    elif not found.shares:
        assert "The files, options and starts of the two sides are the same." in flat
