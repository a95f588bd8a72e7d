"""What `--why` finds is the same from Python, in `--json`, in a terminal and on a page."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
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
from .support.processes import run_main
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
    words: tuple[str, ...] = ("--keyframe", "home", "--seconds", "0.6")
    function: str = "swing"
    right_engine: str = "mujoco"
    explained: bool = True


BALL = (*Pair.words, "--quantity", "ball")
SAGS = ("--measure", "end", "--quantity", "slides", "--seconds")


def _alone(name: str) -> Pair:
    words = (*Pair.words, "--quantity", ALONE[name].quantity)
    return Pair(ARM, changed(ARM, ALONE[name]), words)


def _delayed() -> Pair:
    delay, no_delay, *_ = known.EASILY_MISSED["delay on the left"]
    left = with_changes(known.LED, delay)
    return Pair(left, with_changes(left, no_delay), function="turn")


def _across_engines() -> Pair:
    bare = ARM.replace(FLOOR, "")
    words = ("--seconds", "0.6", "--quantity", "joints")
    return Pair(bare, changed(bare, ALONE["mass"]), words, right_engine="pybullet")


# Each way in which figures and values are shown.
PAIRS: dict[str, Callable[[], Pair]] = {
    **{
        name: partial(_alone, name)
        for name in ("mass", "gains", "axis", "place", "gravity", "integrator", "softness")
    },
    "extra shape": lambda: Pair(ARM, changed(ARM, ALONE["extra shape"]), BALL),
    "the same": lambda: Pair(ARM, known.said_otherwise("fullinertia")),
    "add up": lambda: Pair(*known.at_70_to_30(0)[:2], (*SAGS, "3"), "zero"),
    "interact": lambda: Pair(*known.that_interact(0)[:2], (*SAGS, "6"), "zero"),
    "brought over": lambda: Pair(*known.OTHER_SHAPES["a larger mesh"][0](), BALL),
    "the same motion": lambda: Pair(*known.EQUIVALENT["mocap body fixed"](), BALL),
    "delayed": _delayed,
    "across engines": _across_engines,
    "outside the list": lambda: Pair(
        ARM, with_changes(ARM, [known.EXTRA]), ("--seconds", "0.6"), explained=False
    ),
}
QUICK = ("mass", "the same", "add up")


@dataclass(frozen=True)
class Shown:
    """What the command says of a pair, in each form.

    Attributes:
        explained: Whether all of the gap is to be explained.
        found: What was found, once for all forms.
        runs: How often it was asked for.
        codes: The exit codes, of the JSON, the terminal and the page.
        told: The JSON.
        text: What the terminal shows.
        html: The page, without its escapes.
    """

    explained: bool
    found: Explanation
    runs: int
    codes: tuple[int, int, int]
    told: dict[str, Any]
    text: str
    html: str

    @property
    def is_rounding(self) -> bool:
        """Tell whether the gap is so small that there is nothing to divide."""
        return not self.found.verdict.divides

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Return (name, share) of each cause that is shown, as they are written."""
        rows: list[tuple[str, str]] = []
        for cause in self.found.shares:
            if cause.note or (not self.is_rounding and abs(cause.share or 0.0) < 1e-3):
                continue
            share = "\N{EM DASH}" if self.is_rounding else percent(cause.share)
            rows.append((capital(cause.name), share))
        return rows


@pytest.fixture(
    scope="module",
    params=[pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in PAIRS],
)
def shown(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Shown]:
    """One run of the command; the other forms are of what it found."""
    pair = PAIRS[request.param]()
    need_engine(pair.right_engine)
    explanations: list[Explanation] = []

    def explain_once(*args: Any, **more: Any) -> Explanation:
        if not explanations:
            explanations.append(explain(*args, **more))
        return explanations[0]

    folder = tmp_path_factory.mktemp("pair")
    written(folder / "left.xml", pair.left)
    written(folder / "right.xml", pair.right)
    written(folder / "moves.py", MOVES)
    sides = ("left.xml", f"right.xml@{pair.right_engine}")
    words = ("compare", f"moves.py:{pair.function}", *sides, *pair.words, "--why")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(instrument, "explain", explain_once)
        monkeypatch.chdir(folder)  # the paths of a command take lines of the screen
        monkeypatch.delenv("COLUMNS", raising=False)
        as_json = run_main(*words, "--json")
        terminal = run_main(*words)
        page = run_main(*words, "--no-chaos", "--html", "page.html")
        html = unescape((folder / "page.html").read_text("utf-8"))
        yield Shown(
            pair.explained,
            explanations[0],
            len(explanations),
            (as_json.returncode, terminal.returncode, page.returncode),
            json.loads(as_json.stdout),
            terminal.stdout,
            html.replace("\N{MINUS SIGN}", "-").replace("\u00a0", " "),
        )


def test_the_exit_code_says_whether_all_of_the_gap_is_explained(shown: Shown) -> None:
    assert shown.codes[:2] == (int(not shown.explained),) * 2


def test_the_json_has_what_was_found(shown: Shown) -> None:
    expected = json.loads(dumps(shown.found))
    # What both sides were, the command knows, and not who explains two runs.
    differing = {key for key in expected if shown.told[key] != expected[key]}
    assert differing <= {"shares", "ranking", "bases", "cited_case"}
    assert shown.told["bases"]["differ"] is False
    shares = [{**row, "changes": [], "not_written": ""} for row in shown.told["shares"]]
    assert shares == expected["shares"]


def test_the_start_that_both_share_is_no_cause(shown: Shown) -> None:
    assert not any(row["name"].startswith("start") for row in shown.told["shares"])


def test_the_terminal_shows_it_on_one_screen(shown: Shown) -> None:
    assert len(shown.text.splitlines()) <= LINES
    above_command = shown.text.partition("\n    statemachine ")[0]  # a path is not cut
    assert max(map(len, above_command.splitlines())) <= 80


def test_the_terminal_shows_each_cause_with_its_share(shown: Shown) -> None:
    for cause, share in shown.rows:  # a name may go on in a second line
        begins = cause.split()[0]
        lines = [line for line in shown.text.splitlines() if line.strip().startswith(begins)]
        assert shown.is_rounding or any(share in line for line in lines), cause
    assert shown.found.shares or "are the same" in " ".join(shown.text.split())


def test_the_details_have_a_row_of_each_cause(shown: Shown) -> None:
    if shown.is_rounding:
        return
    tables = [block for block in why.causes(shown.found) if isinstance(block, Table)]
    cells = [
        (row[0].partition(" (")[0], row[3].partition(" ±")[0])
        for table in tables
        for row in table.rows
    ]
    assert cells[: len(shown.rows)] == shown.rows


def test_the_html_page_has_each_cause_with_its_share(shown: Shown) -> None:
    assert shown.runs == 1
    if not shown.is_rounding:
        words = itertools.chain.from_iterable(shown.rows)
        assert_in(shown.html, *words, why.parts(shown.found))
