"""What `--why` finds is the same from Python, in `--json`, in a terminal and on a page."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from statemachine.cli import main
from statemachine.compare import Request, Side
from statemachine.compare.why import Explanation, explain
from statemachine.comparison.text import capital, percent

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


def _rows(html: str, title: str) -> list[list[str]]:
    """The cells of the table below a title, row by row."""
    table = html[html.index(title) :]
    table = table[: table.index("</table>")]
    rows = re.findall(r"<tr.*?</tr>", table, re.DOTALL)
    cells = [re.findall(r"<t[dh].*?</t[dh]>", row, re.DOTALL) for row in rows]
    return [
        [
            unescape(re.sub(r"<.*?>", "", cell)).replace("\N{NO-BREAK SPACE}", " ").strip()
            for cell in row
        ]
        for row in cells
    ]


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
