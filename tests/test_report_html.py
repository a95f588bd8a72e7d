"""The report of a comparison, looked at in a real browser as a reader would."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import io
import itertools
import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image

import statemachine as sm
from statemachine.course.notebook import markdown
from statemachine.engines.records import DifferingQuantity
from statemachine.errors import BadInputError, MissingEngineError
from statemachine.lab.compare import Comparison, SidesRun, compare, touches
from statemachine.lab.compare.series import total_forces
from statemachine.lab.questions.compare_report import (
    ReportParts,
    explained_quantity,
    report_page,
)
from statemachine.lab.questions.finding import finding_of, leading
from statemachine.lab.questions.sides_page import commands_table
from statemachine.lab.questions.stage.bones import bones_of
from statemachine.lab.questions.stage.page import report
from statemachine.lab.questions.stage.poses import rows_at
from statemachine.lab.questions.stage.quantity_chart import CHARTS_SHOWN, charts_of
from statemachine.lab.questions.stage.scene import Look, moments_of
from statemachine.lab.recordings import Trace, read_shipped_trace, record_scenario
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.lab.why import Explanation, Share
from statemachine.lab.why.answer_page import answer, parts
from statemachine.lab.why.gap import FirstTouch
from statemachine.lab.why.locate import Localisation
from statemachine.lab.why.page import causes, steps
from statemachine.measures import Deviation
from statemachine.measures.text import quantity
from statemachine.show.blocks import (
    Headline,
    Items,
    Page,
    Section,
    Table,
    TableCell,
    Text,
    Verdict,
)
from statemachine.show.drawing import drawing_of
from statemachine.show.html import check_target, write_report
from statemachine.show.html import report as html_of
from statemachine.show.html.geometry import mesh_as_data, mesh_of

from .support.browser import Tab, browser, one_browser
from .support.claims import assert_has, assert_in, refused
from .support.colours import contrast
from .support.compared import result_of
from .support.processes import soon
from .support.requirements import ROOT
from .support.shapes import area_of
from .support.traces import added, cut
from .support.traces import changed as edited

LIMIT = 2_000_000  # bytes
CSS = ROOT / "statemachine/show/html/page.css"
Made = tuple[Comparison, Trace, Trace, Look]
Seen = Callable[..., Any]


def of(one: Trace, two: Trace) -> Made:
    return of_look(one, two, drawing_of(sm.load(one.header.provenance.model_file)))


def page_of(made: Made, looks: Any = None, said: Sequence[str] = (), **more: Any) -> str:
    run = SidesRun(*made[1:3], made[2], notes=tuple(said))
    page = report_page(result_of(made[0], run), ReportParts(**more))
    return report(page, looks or made[3:] * 2)


def recorded(name: str, kind: Any = "model") -> Made:
    """MuJoCo against the recorded run of PyBullet: no second engine is needed."""
    scenario = SCENARIOS[name]
    one = record_scenario(scenario, sm.load(scenario.model, defaults=kind), defaults=kind)
    return of(one, read_shipped_trace(name, "pybullet", kind))


@pytest.fixture(scope="module")
def hold() -> Made:
    return recorded("hold")


@pytest.fixture(scope="module")
def uneven() -> Made:
    """Each with the timestep of its engine."""
    return recorded("hold", "engine")


def data_of(text: str) -> Any:
    """What the script of a page reads."""
    return json.loads(re.findall(r'id="data">(.*?)</script>', text, re.S)[0])


@pytest.fixture(scope="module")
def page(hold: Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(
        tmp_path_factory.mktemp("report") / "hold.html",
        page_of(hold, command="statemachine compare hold --html hold.html"),
    )


@pytest.fixture(scope="module", autouse=True)
def _one_browser() -> Iterator[None]:
    """One browser for all that is looked at; each test has a profile of its own."""
    with one_browser():
        yield


@contextmanager
def looking(page: Path, *scripts: str, **context: Any) -> Iterator[Tab]:
    """A browser with a page, with which nothing is wrong; the scripts run before its own."""
    with browser(**context) as tab:
        for script in scripts:
            tab.add_init_script(script)
        tab.goto(page.as_uri())
        tab.wait_for_timeout(300)
        yield tab
        tab.nothing_wrong()


@pytest.fixture
def tab(page: Path) -> Iterator[Tab]:
    """A browser with the page."""
    with looking(page, height=1000) as opened:
        yield opened


@pytest.fixture
def seen(tmp_path: Path) -> Seen:
    """Opens the page of a comparison in a browser."""

    return lambda made, **more: looking(
        write_report(tmp_path / "x.html", page_of(made, **more)), height=1000
    )


def picture(tab: Tab, where: str = "#scene") -> np.ndarray:
    if where == "#scene":
        tab.mouse.move(0, 0)  # nothing under it is in another colour
        # Always at the same place of the screen: else its edges are rounded otherwise.
        tab.evaluate(
            "document.activeElement.blur(); document.querySelector('#stage').scrollIntoView()"
        )
        tab.wait_for_timeout(50)
        tab.wait_for_selector("#scene[data-drawn=fine]")
    return np.asarray(Image.open(io.BytesIO(tab.locator(where).screenshot())).convert("RGB"), int)


def changed(before: np.ndarray, after: np.ndarray) -> int:
    """How many pixels are clearly of another colour."""
    return int(where_changed(before, after).sum())


def where_changed(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Pixels that are clearly of another colour."""
    return np.abs(before - after).max(axis=2) > 24


def bare_stage(tab: Tab) -> None:
    """Nothing but the robots in the picture."""
    for name in ("marks", "trails"):
        tab.locator(f"#{name}").uncheck()


def unfold(tab: Tab, *names: str) -> None:
    """Open sections that are folded, as a reader does."""
    for name in names:
        tab.locator(f"#{name} > summary").click()


def cursors(tab: Tab) -> list[float]:
    """Where the cursor is in each plot that is seen, as a share of its width."""
    return tab.evaluate(
        """() => [...document.querySelectorAll('.cursor')].map((c) => {
          const a = c.parentElement.getBoundingClientRect(), b = c.getBoundingClientRect();
          return a.width && b.height ? (b.left + b.width / 2 - a.left) / a.width : null;
        }).filter((x) => x !== null)"""
    )


def go(tab: Tab, row: int) -> None:
    """Move the slider as a reader does."""
    slider = tab.locator("#slider")
    slider.focus()
    slider.fill(str(row))


# What it is as a file.


@pytest.mark.slow
def test_it_asks_for_nothing_and_nothing_is_wrong(page: Path) -> None:
    with looking(page, offline=True) as tab:
        assert tab.requests[0] == page.as_uri()
        assert {url.split(":")[0] for url in tab.requests[1:]} <= {"data"}
    assert page.stat().st_size <= LIMIT


def test_its_policy_lets_nothing_in(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy[1].startswith("default-src 'none'")
    assert "http" not in policy[1]
    assert "unsafe-inline'; script" in policy[1]  # styles alone
    scripts = re.findall(r"<script>(.*?)</script>", text, re.S)
    digests = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert re.findall(r"'sha256-([^']+)'", policy[1]) == digests
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)", text)
    assert str(ROOT) not in text


def hostile(text: str) -> str:
    return f"{text}</script><img src=x onerror=window.hit=1>\"'&{{{{data}}}}\u202e\ud800"


@pytest.mark.slow
def test_names_that_are_markup_do_nothing(hold: Made, seen: Seen) -> None:
    def spoiled(trace: Trace) -> Trace:
        header = trace.header
        names = {
            name: tuple(hostile(each) for each in getattr(header, name))
            for name in ("joints", "sites", "bodies", "geoms", "actuators")
        }
        prov = dataclasses.replace(
            header.provenance, model_file=hostile("m"), backend=hostile("b"),
            versions={hostile("v"): hostile("1")}, emulated=(hostile("e"),),
        )  # fmt: skip
        texts = ("experiment", "description", "command", "keyframe", "ended")
        options = {hostile("o"): hostile("p")}
        names |= {name: hostile(name) for name in texts}
        return edited(trace, {"provenance": prov, "options": options, **names})

    made = of_look(spoiled(hold[1]), spoiled(hold[2]), hold[3])
    with seen(made, said=(hostile("said"),), command=hostile("typed")) as tab:
        assert tab.evaluate("window.hit") is None
        assert tab.locator("img").count() == 0
        assert "onerror" in tab.locator("main").inner_text()


def of_look(one: Trace, two: Trace, look: Look) -> Made:
    return compare(one, two), one, two, look


def test_a_long_run_is_small_too_and_keeps_the_moments_that_count() -> None:
    one = record_scenario(SCENARIOS["hold"], sm.load("so101/scene"), seconds=20.0)
    two = edited(one, qpos=added(one.qpos, (1234, 2), 0.1))
    made = of(one, two)
    assert len(page_of(made).encode()) <= LIMIT
    at = made[0].agreements[2].at
    assert at == pytest.approx(1234 * 0.005)
    assert np.abs(moments_of(one, two, (at,))[0] - at).min() < 1e-9
    assert len(moments_of(one, two)[0]) < len(one)


@pytest.mark.slow
def test_much_to_draw_is_drawn_with_less(hold: Made) -> None:
    """Many contacts at once."""
    _, one, two, look = hold
    rows = np.repeat(np.arange(len(one)), 60)
    columns = {
        f"contact_{name}": np.random.default_rng(0).normal(size=(len(rows), *width))
        for name, width in {"dist": (), "pos": (3,), "frame": (9,), "force": (3,)}.items()
    }
    geoms = np.tile([0, 34], (len(rows), 1))
    many = edited(one, None, contact_row=rows, contact_geom=geoms, **columns)
    text = page_of(of_look(many, two, look))
    assert len(text.encode()) <= LIMIT
    assert "strongest are drawn" in text


# What it says.


def headline_of_page(made: Made, **more: Any) -> Headline:
    headline = report_page(result_of(made[0]), ReportParts(**more)).headline
    assert headline is not None
    return headline


def test_the_headline_is_made_of_the_figures(hold: Made) -> None:
    comparison, one, *_ = hold
    (wrist,) = (each for each in comparison.agreements if each.name == "wrist_flex")
    finding, shown = finding_of(comparison), headline_of_page(hold)
    since = min(row.since for row in comparison.agreements if row.since is not None)
    far, end = (quantity(value, wrist.unit) for value in (wrist.max, wrist.settled))
    assert_in(
        shown.lead,
        far,
        f"{wrist.at:.3f} s",
        f"{end} on average in the last 0.2 s",
        f"at {since:.3f} s",
    )
    assert shown.causes == ()  # nothing was asked about causes
    # The end is a mean over the last tenth.
    (curve,) = (each for each in comparison.curves if each.name == "wrist_flex")
    tail = curve.difference[curve.time >= 1.8 - 1e-9]
    assert finding.lead.settled == pytest.approx(tail.mean())
    assert finding.is_changing
    still = edited(one, qpos=added(one.qpos, np.s_[100:, 3], 0.05))
    assert not finding_of(compare(one, still)).is_changing


def explanation_of(made: Made, quantity: str = "joints", **more: Any) -> Explanation:
    """An explanation with figures of our own: a servo law, armature that hides, and contact."""
    comparison, one, two, _ = made
    worst = max((a for a in comparison.agreements if a.kind == "joint"), key=lambda a: a.max)
    gap = Deviation("rad", worst.max, worst.at, worst.rms, worst.settled)
    contact = Localisation(
        name="contact", values=None, without="nothing touches", share=0.5, alone=None,
        gap=1e-8 * gap.worst, is_still=False,
    )  # fmt: skip

    def row(name: str, share: float) -> Share:
        values = (DifferingQuantity(name, "kp 998.2", "its motors"),)
        return Share(
            name=name, kind="engine", values=values, share=share, alone=share,
            last=share, place=None,
        )  # fmt: skip

    fields: dict[str, Any] = {
        "experiment": "hold", "description": "", "seconds": 2.0,
        "labels": ("mujoco", "pybullet:engine"),
        "quantity": quantity, "unit": "rad", "measure": "worst", "first": {quantity: gap},
        "gap": gap.worst, "shares": (row("servo law", 0.6), row("armature", -0.1)),
        "method": "all sets", "orders": 0, "equalized_gap": 0.5 * gap.worst,
        "found_in": (contact,),
        "explained": 0.5, "located": 0.5, "unexplained": 1e-8, "negligible": 1e-9, "floor": 0.0,
        "tolerance": 1e-3, "draws": 8, "one_engine": False,
        "redundant": (), "impossible": (), "ended_by": "",
        "unread": (), "unmatched": ({}, {}), "missing": (),
        "notes": (), "still": (), "touch": None, "moments": 401, "between": False, "runs": 9,
        "took": 1.0, "motion": comparison.motion, "instead": None,
        "provenance": (one.header.provenance, two.header.provenance),
    }  # fmt: skip
    return Explanation(**{**fields, **more})


def test_causes_are_of_the_difference_that_leads(hold: Made) -> None:
    def said(**more: Any) -> Headline:
        return headline_of_page(hold, explanation=explanation_of(hold, **more))

    assert_in(said().lead, "wrist_flex", "2.58°")
    (cause,) = said().causes
    assert_in(cause, "Servo law", "kp 998.2", "60.0 %", "2.58°")
    # What the run shows itself comes before.
    touch = FirstTouch(0.27, "gripper on floor", before=3e-16, moments=54)
    assert_in(said(touch=touch).causes[0], "gripper on floor", "0.270 s", "2e-14°")
    late = FirstTouch(0.27, "finger on floor", before=0.01, moments=54)  # they were apart before
    assert len(said(touch=late).causes) == 1
    # Of two that are as far apart the page names one, here and where it counts agreements.
    lead = leading(hold[0])
    tied = (replace(lead, max=lead.max * (1 - 1e-9)), *hold[0].agreements)
    assert explained_quantity(replace(hold[0], agreements=tied), explanation_of(hold)) is lead
    # Of another quantity than any that is compared no cause stands beside the lead.
    relative = "box relative to gripperframe"
    assert said(quantity=relative).causes == ()


def refused_cause(name: str, why: str) -> Share:
    return Share(name, values=(), place=None, kind="joint", note=why)


def test_what_is_said_first_is_the_largest_part(hold: Made) -> None:
    located = explanation_of(hold, shares=(), explained=0.0, located=1.0)
    wider: dict[str, Any] = {
        "explained": -0.25,
        "located": 1.25,
        "equalized_gap": 1.25 * located.gap,
    }
    worse = explanation_of(hold, **wider)  # all brought over widens the gap
    (contact,), rows = located.found_in, worse.shares
    switch = replace(
        rows[0], name="contact", values=(DifferingQuantity("contact", True, False),), share=0.1
    )
    # Two values that read the same are shown with all their digits.
    close = DifferingQuantity("range", (-1.5708, 1.5708), (-1.5708, 1.570796), "rad")
    rounded = replace(rows[0], values=(close,))
    masked = [
        [replace(row, **{part: value}) for row, value in zip(rows, values, strict=True)]
        for part, *values in (
            *(("share", -217.0, 127.0), ("share", 127.0, -126.5)),
            *(("alone", -0.094, 0.0), ("last", -0.094, 0.0)),  # it widens the gap at first, or last
        )
    ]
    apart = [replace(row, alone=0.05, last=1.1) for row in rows]
    still = replace(located, found_in=(replace(contact, is_still=True),))
    for explanation, says in (
        (located, "^50.0 % of the 2.58° comes from contact"),
        (
            explanation_of(hold, shares=(), found_in=(), explained=0.0, located=0.0, unexplained=1),
            "^The cause was not found: 100.0 % of the 2.58°",
        ),
        *(
            (each, "^No single difference causes the 2.58°")
            for each in (explanation_of(hold, shares=shares) for shares in masked)
        ),
        (worse, "^The differences do not cause the 2.58°: without them it is 3.22°$"),
        (explanation_of(hold, shares=apart), "5.0 % alone and 110.0 % last"),
        (still, "a weak hint$"),
        (
            replace(located, shares=(refused_cause("extra joint of a", "no"),)),
            "goes without contact on both sides; it may come from extra joint of a, which cannot",
        ),
        (
            explanation_of(hold, shares=(switch,)),
            r"^50.0 % of the 2.58° comes from contact \(left: on, right: off\)$",
        ),
        (
            explanation_of(hold, shares=(rounded,)),
            "-90.0002 90.0002° on the left and -90.0002 90° on the right",
        ),
        (
            explanation_of(hold, floor=0.05),
            "^Nothing can be concluded: the gap is 2.58°, and the chaos",
        ),
        (
            explanation_of(hold, floor=0.04),
            "^Whether the gap of 2.58° is more than chance cannot be told: the chaos floor is",
        ),
        (explanation_of(hold, floor=0.04, tolerance=0.1), "^The gap of 2.58° is within its tol"),
        (
            replace(located, one_engine=True),
            "^The cause was not found: 50.0 % of the 2.58° goes without contact on both sides",
        ),
        (explanation_of(hold, negligible=1.0), "^The two sides move alike"),
    ):
        assert re.search(says, answer(explanation)), says
    # An integrator that parts the sides only where nothing touches says what it does with contact.
    chosen = replace(contact, name="integrator", values=("rk4", "its own"), without="euler")
    chosen = replace(chosen, share=0.2, alone=0.013)
    beyond = [replace(row, share=share) for row, share in zip(rows, (1.4, 0.1), strict=True)]
    for explanation, says in (
        (
            replace(located, found_in=(contact, chosen)),
            "As the sides come, with contact, euler takes away 1.3 % of the gap.",
        ),
        (
            replace(located, found_in=(chosen,)),
            "† Integrator: this part goes when both sides run with euler, as far as they can",
        ),
        (explanation_of(hold, shares=beyond), "A part beyond 100 % says that the gap cannot be"),
    ):
        texts = [block.text for block in causes(explanation) if isinstance(block, Text)]
        assert sum(says in text for text in texts) == 1, says
    tiny = [replace(row, **dict.fromkeys(("share", "alone", "last"), 2e-4)) for row in rows]
    # What is not in the list of changes may move what is not explained.
    several: Any = {"first": {"joints": worse.first["joints"], "box": worse.first["joints"]}}
    for shares, missing in (((rows[0], *tiny), True), (rows, False)):
        changes = steps(explanation_of(hold, shares=shares, **several))
        texts = [block.text for block in changes if isinstance(block, Text)]
        assert any("gap of the joints" in text for text in texts)
        assert any("may be missing" in text for text in texts) is missing
    for explanation, column, cells in (
        (explanation_of(hold, floor=0.2 * worse.gap), 3, ["60.0 %", "< 20.0 %", "50.0 %*"]),
        (
            explanation_of(hold, shares=(rows[0], *tiny)),
            0,
            ["Servo law", "Contact", "2 more, none above 0.1 %"],
        ),
    ):
        (table,) = [block for block in causes(explanation) if isinstance(block, Table)]
        assert [row[column] for row in table.rows] == cells
    # Where something cannot be brought to the same, a location is not an explanation.
    row = refused_cause("shape of box", "another size")
    found = (replace(contact, share=1.0),)
    assert_in(parts(worse), "3.22°", "100.0 %", "< 0.1 %")
    assert [each.verdict.holds for each in (located, worse, still)] == [True, False, False]
    assert not replace(located, shares=(row,), found_in=found).verdict.holds


@pytest.mark.slow
def test_the_section_of_causes(hold: Made, tmp_path: Path) -> None:
    text = page_of(hold, explanation=explanation_of(hold))
    with looking(write_report(tmp_path / "x.html", text), java_script_enabled=False) as tab:
        (table,) = tab.locator("#why").locator("table").all()
        assert "alone" in table.inner_text()

        def bar(row: str) -> tuple[float, float]:
            line = table.locator("tr", has_text=row)
            whole, fill = (line.locator(s).bounding_box() for s in (".bar", ".bar i"))
            start = (fill["x"] - whole["x"]) / whole["width"] - 0.5
            return start, start + fill["width"] / whole["width"]

        # Armature makes the gap wider: to the left of zero.
        bars = [(0.0, 0.3), (-0.05, 0.0), (0.0, 0.25)]
        found = [bar(row) for row in ("Servo law", "Armature", "Contact")]
        np.testing.assert_allclose(found, bars, atol=0.02)
        steps = tab.locator("#agree ul li").all_inner_texts()  # all that was brought over
        assert [step.partition(":")[0] for step in steps] == ["servo law", "armature"]
        assert all("998.2" in step for step in steps)
    assert 'id="agree"' not in page_of(hold)


def test_who_presses_on_what(hold: Made) -> None:
    _, one, two, _ = hold
    (touch,) = touches(one, two)
    late = one["contact_row"] >= 360  # the last tenth of 401 rows
    mean = float(one["contact_force"][late, 0].sum()) / 41
    assert touch.pair == "gripper on floor"
    assert_has(touch.left, force=pytest.approx(mean), deepest=-float(one["contact_dist"].min()))
    whole = total_forces(one)["gripper on floor"][360:]
    assert touch.left.total == pytest.approx(whole.mean())
    assert whole.mean() > mean
    bare = {n: a[:0] for n, a in two.columns.items() if n.startswith("contact")}
    never = of_look(one, edited(two, None, **bare), hold[3])
    assert touches(*never[1:3])[0].right.first is None
    assert "never touches" in page_of(never)


@pytest.mark.slow
def test_what_was_commanded(hold: Made) -> None:
    table = commands_table(hold[0])
    for row, value in zip(table.rows, hold[1].ctrl[0], strict=True):
        assert float(row[1]) == float(row[2]) == pytest.approx(value, rel=1e-2)
    assert table.rows[0][0] in page_of(hold)
    one, two = (edited(trace, {"options": {"actuation": False}}) for trace in hold[1:3])
    assert "nothing is commanded" in page_of(of_look(one, two, hold[3]))


@pytest.mark.slow
def test_a_link_only_to_what_is_there(hold: Made) -> None:
    models = Page("models", "", [Verdict("1 figure differs", False)])
    for kind in ("model", "engine"):
        other = edited(hold[2], {"defaults": kind})
        text = page_of(of_look(hold[1], other, hold[3]), models=models)
        links = set(re.findall(r'href="#([^"]+)"', text))
        assert links <= set(re.findall(r'id="([^"]+)"', text))


def test_charts_show_what_was_compared_and_are_few(hold: Made) -> None:
    comparison, one, two, _ = hold
    curves = comparison.curves
    charts = charts_of(comparison)
    assert [chart.curve.name for chart in charts] == [curve.name for curve in curves]
    lift = next(chart for chart in charts if chart.title == "shoulder_lift")
    for (_, shown), trace in zip(lift.values().curves.values(), (one, two), strict=True):
        np.testing.assert_allclose(shown, np.degrees(trace.qpos[:, 1]))
    ((_, gap),) = lift.gap().curves.values()
    np.testing.assert_allclose(gap, np.degrees(np.abs(one.qpos[:, 1] - two.qpos[:, 1])))
    assert lift.gap().tolerance == pytest.approx(360 / 4096)
    # Of many, those that are most beyond their tolerance.
    many = [replace(curve, name=f"{curve.name} {k}") for k in range(4) for curve in curves]
    agreements = [
        replace(a, name=f"{a.name} {k}", max=a.max / (k + 1))
        for k in range(4)
        for a in comparison.agreements
    ]
    some = charts_of(replace(comparison, agreements=tuple(agreements), curves=many))
    assert len(some) == CHARTS_SHOWN < len(many)
    assert "wrist_flex 0" in {chart.title for chart in some}


def test_between_compared_moments_the_figures_are_of_the_last_one(uneven: Made) -> None:
    text = page_of(uneven)
    assert_in(text, "0.025\u00a0s", "25\u00a0ms")
    data = data_of(text)
    shown, compared = (np.frombuffer(base64.b64decode(data[name])) for name in ("time", "compared"))
    assert compared == pytest.approx(0.025 * np.floor(shown / 0.025 + 1e-6), abs=1e-9)


@pytest.mark.slow
def test_on_a_phone_the_slider_is_under_the_picture(page: Path) -> None:
    with looking(page, width=390, height=844) as tab:
        scene, slider = (tab.locator(s).bounding_box() for s in ("#scene", "#slider"))
        assert 0 < slider["y"] - scene["y"] - scene["height"] < 100
        assert tab.locator(".kicker .against").is_visible()
        # The verdicts are seen without scrolling, and a shadow says that there is more.
        unfold(tab, "figures")
        badge = tab.locator("#figures .badge").first.bounding_box()
        assert badge["x"] + badge["width"] <= 390
        wide = tab.locator("#figures .wide").first
        assert wide.evaluate("(e) => e.scrollWidth > e.clientWidth")
        wide.scroll_into_view_if_needed()
        edge = picture(tab, "#figures .wide >> nth=0")[40:200]
        tab.evaluate("document.documentElement.style.setProperty('--cue', 'transparent')")
        assert changed(edge, picture(tab, "#figures .wide >> nth=0")[40:200]) > 200


@pytest.mark.slow
def test_on_a_phone_words_wrap_and_a_row_leads_to_another(tmp_path: Path) -> None:
    name, words = "somebody_with_a_long_name.py", "what is said of it, which takes a line or more"
    rows = Table(("who", "right"), [(TableCell(name, link="there"), "✗")])
    remarks = Table(
        ("who", "function", "what"),
        [(TableCell(name, name="there"), "forward", words)],
        words=frozenset({0, 1, 2}),
    )
    blocks = [rows, Section("remarks", "Remarks", [remarks])]
    file = tmp_path / "class.html"
    write_report(file, html_of(Page("A class", "made here", blocks)))
    with looking(file, width=390, height=844) as tab:
        wide = tab.locator("section .wide")
        assert wide.evaluate("(e) => e.scrollWidth") <= wide.evaluate("(e) => e.clientWidth")
        tab.locator("tbody th a").click()
        assert tab.locator("th:target").inner_text() == name


@pytest.mark.slow
def test_it_opens_with_the_whole_robot(tab: Tab) -> None:
    opened = picture(tab)
    tab.locator("#view-near").click()
    assert changed(opened, picture(tab)) > 2000
    tab.locator("#view-all").click()
    assert changed(opened, picture(tab)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("width", [480, 1200])
def test_no_name_beside_the_slider_is_cut(page: Path, width: int) -> None:
    with looking(page, width=width) as tab:
        names = tab.locator(".lane-name")
        assert names.count() > 5
        cut = names.evaluate_all("(all) => all.filter((e) => e.scrollWidth > e.clientWidth).length")
        assert cut == 0


@pytest.mark.slow
def test_without_a_script_every_figure_of_the_comparison_is_on_the_page(
    hold: Made, page: Path
) -> None:
    parts = "#curves .plot svg", "#slider", "#play", ".cursor"
    with looking(page, java_script_enabled=False) as tab:
        seen = [part for part in parts if tab.locator(part).first.is_visible()]
        unfold(tab, "figures", "contacts")
        whole, *tables = (
            part.inner_text().replace("−", "-").replace("\u00a0", " ")
            for part in tab.locator("main, #figures table, #contacts table").all()
        )
    assert seen == ["#curves .plot svg"]
    assert_in(whole, "How far apart, over time", "What happens when", "What made both runs")
    for found in hold[0].agreements:
        (line,) = [
            row
            for row in "\n".join(tables).splitlines()
            if row.startswith(found.name.replace(", ", " ") + "\t")
        ]
        apart = (found.max, found.rms, found.settled) if found.kind != "contact" else ()
        values = [quantity(value, found.unit) for value in (found.tolerance, *apart)]
        assert_in(line, found.verdict, *values)


# What moves.


@pytest.mark.slow
def test_the_slider_moves_both_arms_the_cursors_and_the_figures(tab: Tab, hold: Made) -> None:
    bare_stage(tab)
    for alone in ("solid", "ghost"):
        for name in ("solid", "ghost"):
            tab.locator(f"#{name}").set_checked(name == alone)
        go(tab, 20)
        first, at = picture(tab), tab.locator("#readout-box").inner_text()
        assert changed(first, picture(tab)) == 0  # it stands still by itself
        go(tab, 120)
        assert changed(first, picture(tab)) > 2000, alone
        assert tab.locator("#readout-box").inner_text() != at
    assert tab.locator("#clock").inner_text() == "0.600 s"
    places = cursors(tab)
    assert len(places) > 15
    assert places == pytest.approx([0.6 / 2.0] * len(places), abs=0.004)
    one, two = (np.degrees(trace.qpos[120, 3]) for trace in hold[1:3])
    cells = tab.locator("#readout tr", has_text="wrist_flex").locator("td").all_inner_texts()
    shown = [float(cell.rstrip("°").replace("−", "-")) for cell in cells[:3]]
    assert shown[:2] == pytest.approx([one, two], abs=0.06)
    assert shown[2] == pytest.approx(abs(one - two), abs=0.006)


@pytest.mark.slow
def test_each_side_is_drawn_and_can_be_left_out(tab: Tab) -> None:
    before = picture(tab)
    for name in ("solid", "ghost", "marks", "trails"):
        tab.locator(f"#{name}").uncheck()
        assert changed(before, picture(tab)) > 150, name
        tab.locator(f"#{name}").check()
        assert changed(before, picture(tab)) == 0, name


@pytest.mark.slow
def test_the_sides_are_drawn_where_they_are(hold: Made, seen: Seen) -> None:
    """A run against itself turned by a quarter: the ghost is somewhere else."""
    _, one, _, look = hold
    xpos = one["xpos"][..., [1, 0, 2]] * [-1, 1, 1]
    half = np.sqrt(0.5)
    w, x, y, z = np.moveaxis(one["xquat"], -1, 0)
    turned = np.stack([w - z, x - y, y + x, z + w], axis=-1) * half
    with seen(of_look(one, edited(one, xpos=xpos, xquat=turned), look)) as tab:
        bare_stage(tab)
        both = picture(tab)
        tab.locator("#ghost").uncheck()
        alone = picture(tab)
        tab.locator("#solid").uncheck()
        empty = picture(tab)
    ghost, solid = (where_changed(alone, other) for other in (both, empty))
    assert (ghost & ~solid).sum() > 0.5 * ghost.sum()


def moved(tab: Tab, since: float) -> float:
    """The row once the slider has gone on by itself."""
    assert soon(lambda: at_row(tab) > since)
    return at_row(tab)


def at_row(tab: Tab) -> float:
    """The row of the slider."""
    return float(tab.locator("#slider").input_value())


@pytest.mark.slow
def test_it_plays_and_pauses(tab: Tab) -> None:
    slowest = tab.locator("#speed option").evaluate_all(
        "options => options.map(o => o.value).sort((a, b) => a - b)[0]"
    )
    tab.locator("#speed").select_option(slowest)  # a busy machine must not miss its end
    tab.locator("#play").click()
    assert tab.locator("#play").inner_text() == "Pause"
    first = moved(tab, 0)
    moved(tab, first)
    tab.locator("#play").click()
    then = at_row(tab)
    assert 0 < first < then < 400
    tab.wait_for_timeout(400)
    assert at_row(tab) == then
    assert cursors(tab)[0] == pytest.approx(then / 400, abs=0.004)
    assert soon(lambda: tab.locator("#said").text_content().startswith("Paused at "))


@pytest.mark.slow
def test_it_can_be_used_by_keyboard(tab: Tab) -> None:
    slider, scene = tab.locator("#slider"), tab.locator("#scene")
    slider.focus()
    for key, value in (("Home", 0), ("ArrowRight", 1), ("End", 400), ("ArrowLeft", 399)):
        tab.keyboard.press(key)
        assert at_row(tab) == value
    assert re.fullmatch(
        r"1\.995 s: wrist_flex [\d.]+°; gripperframe position [\d.]+\u00a0mm apart",
        slider.get_attribute("aria-valuetext"),
    )
    for key in ("Home", " "):
        tab.keyboard.press(key)
    moved(tab, 0)
    tab.keyboard.press(" ")
    assert 0 < at_row(tab) < 400
    scene.press("0")
    before = picture(tab)
    for key, least, most in (("ArrowLeft", 1000, np.inf), ("0", 0, 0)):
        scene.press(key)
        assert least <= changed(before, picture(tab)) <= most
    # Whatever can be reached shows that it was.
    for _ in range(12):
        tab.keyboard.press("Tab")
        assert tab.evaluate(
            "(() => { const s = getComputedStyle(document.activeElement);"
            "return s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 2; })()"
        )


@pytest.mark.slow
def test_a_time_in_a_table_and_a_press_on_a_chart_go_there(page: Path) -> None:
    # Else the page glides to its picture, and a press may miss what moves.
    with looking(page, height=1000, reduced_motion="reduce") as tab:
        before = tab.locator("#slider").input_value()
        tab.wait_for_timeout(500)
        assert tab.locator("#slider").input_value() == before  # nothing moves by itself
        unfold(tab, "events")
        button, clock = tab.locator("#events button.go").first, tab.locator("#clock")
        button.click()
        y = tab.evaluate("scrollY")
        assert soon(lambda: clock.inner_text() == button.inner_text())
        tab.wait_for_timeout(200)
        assert tab.evaluate("scrollY") == y
        area = tab.locator("#curves .area").first
        area.click(position={"x": 0.75 * area.bounding_box()["width"], "y": 20})
        # A pixel of the chart is about as wide as a row.
        assert soon(lambda: abs(float(clock.inner_text().rstrip(" s")) - 1.5) < 0.011)


@pytest.mark.slow
def test_the_view_turns_and_comes_back(tab: Tab) -> None:
    tab.locator("#view-all").click()
    before = picture(tab)
    box = tab.locator("#scene").bounding_box()
    tab.mouse.move(box["x"] + 200, box["y"] + 200)
    tab.mouse.down()
    tab.mouse.move(box["x"] + 300, box["y"] + 230, steps=4)
    tab.mouse.up()
    assert changed(before, picture(tab)) > 2000
    for view, least, most in (("near", 2000, np.inf), ("all", 0, 0)):
        tab.locator(f"#view-{view}").click()
        assert least <= changed(before, picture(tab)) <= most


# How it looks, and to whom.


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 768, 1280])
def test_nothing_is_wider_than_the_screen(page: Path, width: int) -> None:
    with looking(page, width=width, height=700) as tab:
        for summary in tab.locator("summary").all():
            summary.click()
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        box = tab.locator("#scene").bounding_box()
        assert 0 <= box["x"] <= width - box["width"]


@pytest.mark.slow
def test_dark_and_light(page: Path) -> None:
    def paper(tab: Tab) -> float:
        colour = tab.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(map(int, re.findall(r"\d+", colour)[:3])) / 3

    with looking(page, color_scheme="light") as tab:
        assert paper(tab) > 230
        before = picture(tab)
        button = tab.get_by_role("button", name="Dark colours")
        assert button.inner_text() == "Dark"
        button.click()
        assert paper(tab) < 50
        assert tab.get_by_role("button", name="Light colours").inner_text() == "Light"
        assert changed(before, picture(tab)) > 10_000


def test_every_text_can_be_read(page: Path) -> None:
    blocks = re.findall(r":root[^{]*\{([^}]*--paper[^}]*)\}", CSS.read_text())
    assert len(blocks) == 4  # light, dark by the system, dark by hand, print
    colours = [dict(re.findall(r"--([\w-]+): (#\w+)", block)) for block in blocks]
    assert colours[1] == colours[2]
    for each in colours:
        full = {
            k: v if len(v) == 7 else "#" + "".join(c * 2 for c in v[1:]) for k, v in each.items()
        }
        for text in ("ink", "soft", "one", "two", "bad", "link", "edge"):
            for paper in ("paper", "shade"):
                assert contrast(full[text], full[paper]) >= 4.5, (text, paper, full[text])


def test_the_sides_differ_for_the_colour_blind() -> None:
    """Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB."""
    css = CSS.read_text()
    deficient = {
        "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
        "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                   [-0.011820, 0.042940, 0.968881]],
        "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
    }  # fmt: skip
    for one, two in zip(re.findall(r"--one: (#\w+)", css), re.findall(r"--two: (#\w+)", css),
                        strict=True):  # fmt: skip
        linear = [[(int(c[k : k + 2], 16) / 255) ** 2.2 for k in (1, 3, 5)] for c in (one, two)]
        for matrix in deficient.values():
            a, b = (np.clip(np.array(matrix) @ c, 0, 1) ** (1 / 2.2) for c in linear)
            assert np.abs(a - b).max() > 0.2


@pytest.mark.slow
def test_what_a_screen_reader_hears(tab: Tab) -> None:
    assert_in(
        tab.locator("body").aria_snapshot(),
        "- main:",
        "- contentinfo:",
        'heading "Joint wrist_flex is up to',
        "[level=1]",
        '- slider "Moment of the run": ',
        '- button "Play"',
        '- checkbox "mujoco',
        '- region "How far apart, over time"',
        '- columnheader "largest"',
        '- rowheader "wrist_flex"',
        'img "wrist_flex, difference over time: at most 2.58° at 0.355 s',
        '- img "Both runs in three dimensions',
    )
    levels = tab.evaluate(
        "[...document.querySelectorAll('h1,h2,h3,h4')].map((h) => Number(h.tagName[1]))"
    )
    assert (levels[0], levels.count(1)) == (1, 1)
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
    for nameless in (
        """[...document.querySelectorAll('button, input, select, a, [role=img], [tabindex]')]
        .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim()
          || (e.labels && e.labels.length))).map((e) => e.outerHTML)""",
        """[...document.querySelectorAll('table')].filter((t) => !(t.caption?.textContent
          && [...t.querySelectorAll('th')].every((h) => h.scope))).map((t) => t.outerHTML)""",
    ):
        assert tab.evaluate(nameless) == []
    assert tab.locator("#said").get_attribute("aria-live") == "polite"


@pytest.mark.slow
def test_it_prints_with_all_sections_and_the_picture(page: Path) -> None:
    with looking(page, color_scheme="dark") as tab:
        # What a browser does when it prints, held still to be looked at.
        tab.evaluate("dispatchEvent(new Event('beforeprint'))")
        tab.emulate_media(media="print")
        tab.wait_for_timeout(300)
        assert (
            tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        )
        assert_in(tab.locator("main").inner_text(), *tab.locator("h2").all_inner_texts())
        assert "shoulder_pan" in tab.locator("#curves > details").inner_text()
        assert tab.locator("#printed").is_visible()
        assert picture(tab, "#printed").std() > 10
        names = "#play", "#slider", "#theme", "#views", "#checks"
        assert not [name for name in names if tab.locator(name).is_visible()]
        tab.emulate_media(media="screen")
        tab.evaluate("dispatchEvent(new Event('afterprint'))")
        assert tab.locator("#printed").count() == 0
        assert not tab.locator("#curves > details").evaluate("(e) => e.open")
        assert len(re.findall(rb"/Type\s*/Page\b", tab.page.pdf(format="A4"))) >= 3


@pytest.mark.slow
def test_it_says_so_without_webgl(page: Path, tmp_path: Path) -> None:
    with looking(page, "HTMLCanvasElement.prototype.getContext = () => null") as tab:
        assert "no WebGL" in tab.locator("#no-scene").inner_text()
        assert not tab.locator("#scene").is_visible()
        go(tab, 100)
        assert tab.locator("#clock").inner_text() == "0.500 s"


# Whatever the traces are.


OTHERS: dict[str, Callable[[Trace, Trace], tuple[Trace, Trace]]] = {
    "ended": lambda one, two: (one, cut(two, 150, ended="it diverged at 0.745 s")),
    "single": lambda one, two: (cut(one, 1), cut(two, 1)),
    "same": lambda one, _: (one, one),
    "not finite": lambda one, two: (
        one,
        edited(two, xpos=added(added(two["xpos"], np.s_[100:], np.nan), 90, 1e12)),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", OTHERS)
def test_other_traces(hold: Made, kind: str, seen: Seen) -> None:
    made = of_look(*OTHERS[kind](*hold[1:3]), hold[3])
    with seen(made) as tab:
        assert tab.locator("#scene").is_visible()
        go(tab, int(tab.locator("#slider").get_attribute("max")))
        assert tab.locator("#clock").inner_text() == f"{made[0].until:.3f} s"
        text = tab.locator("body").inner_text().replace("\u00a0", " ")
        assert ("0.745 s" in text) == (kind == "ended")
        assert ("the same in all" in text) == (kind == "same")
        assert "NaN" not in text
        assert tab.locator("#play").is_visible() == (kind != "single")


@pytest.mark.slow
def test_timesteps_that_differ_are_drawn_between_and_it_is_said(uneven: Made, seen: Seen) -> None:
    comparison, one, two, _ = uneven
    assert one.header.timestep != two.header.timestep
    times, _ = moments_of(one, two)
    assert len(times) > 4 * comparison.moments
    assert not rows_at(one, times)[1].any()
    assert rows_at(two, times)[1].any()
    with seen(uneven) as tab:
        go(tab, 7)
        assert_in(tab.locator("#now").inner_text(), "0.035 s", "0.025 s")
        cell = tab.locator("#readout tr", has_text="elbow_flex").locator("td").last.inner_text()
        apart = abs(one.qpos[5, 2] - two.qpos[6, 2])
        assert float(cell.strip("● °")) == pytest.approx(np.degrees(apart), rel=0.01)


@pytest.mark.slow
def test_without_the_model_there_are_sticks(hold: Made, seen: Seen) -> None:
    none = "there is no so101/scene.xml here"
    with seen(hold, looks=(none, none)) as tab:
        assert none in tab.locator("#picture").inner_text()
        tab.locator("#view-all").click()
        before = picture(tab)
        go(tab, 0)
        assert changed(before, picture(tab)) > 2000


@pytest.mark.slow
def test_without_poses_there_is_no_scene_and_it_is_said(hold: Made, seen: Seen) -> None:
    one, two = (
        Trace(t.header, {k: v for k, v in t.columns.items() if k not in ("xpos", "xquat")})
        for t in hold[1:3]
    )
    with seen(of_look(one, two, hold[3])) as tab:
        assert "no poses" in tab.locator("#still").inner_text()
        go(tab, 100)
        assert tab.locator("#clock").inner_text() == "0.500 s"


def test_a_page_without_matplotlib_says_where_its_charts_are(
    hold: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "statemachine.show.html.chart.chart",
        Mock(side_effect=MissingEngineError("matplotlib is missing")),
    )
    text = page_of(hold)
    assert "matplotlib is missing" in text
    assert "<polyline" not in text


# Shapes.


def test_a_mesh_keeps_its_surface_and_too_many_triangles_are_made_fewer() -> None:
    drawing = drawing_of(sm.load("so101/scene"))
    whole, fewer = mesh_of(drawing), mesh_of(drawing, most=2000)
    wanted = sum(area_of(p) for p in drawing.parts if not p.endless)
    assert area_of(whole) == pytest.approx(wanted, rel=1e-5)
    assert not whole.simplified
    assert 500 < len(fewer.faces) <= 2000 < fewer.simplified
    for end in (np.min, np.max):
        assert end(fewer.vertices, 0) == pytest.approx(end(whole.vertices, 0), abs=0.02)


@pytest.mark.slow
def test_normals_are_those_of_the_faces(tab: Tab) -> None:
    mesh = mesh_of(drawing_of(sm.load("so101/scene")))
    code = (ROOT / "statemachine" / "show" / "html" / "gl.js").read_text("utf-8")
    found = tab.evaluate(
        f"(mesh) => {{ {code}; const made = creased(mesh);"
        "  return [[...made.points], [...made.normals]]; }",
        mesh_as_data(mesh),
    )
    points, normals = (np.reshape(values, (-1, 3, 3)) for values in found)
    corners = np.ptp(mesh.vertices, axis=0) * points + mesh.vertices.min(axis=0)
    assert np.abs(corners - mesh.vertices[mesh.faces]).max() < 1e-4
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1.0, abs=1e-5)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((face[:, None] * normals).sum(axis=2) > 0).mean() > 0.999


def test_bones_reach_from_body_to_body(hold: Made) -> None:
    one = hold[1]
    drawing = bones_of(one)
    chain = [body for body, parent in enumerate(one.header.body_parentid) if body and parent]
    assert len(drawing.parts) == len(chain) + 2  # a knob at the end of each branch
    for body, part in zip(chain, drawing.parts, strict=False):
        apart = one["xpos"][0, body] - one["xpos"][0, one.header.body_parentid[body]]
        if apart.any():  # the camera's mount has its origin where the gripper has
            reach = np.linalg.norm(part.vertices, axis=1).max()
            assert reach == pytest.approx(np.linalg.norm(apart), abs=1e-6)


# The command.


def test_a_folder_that_cannot_be_written_into(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write anywhere
    (tmp_path / "folder.html").mkdir()
    refused(
        (BadInputError, "cannot be written", lambda: check_target(tmp_path / "x.html")),
        (BadInputError, "is a folder", lambda: check_target(tmp_path / "folder.html")),
    )


def test_any_page_can_be_drawn() -> None:
    """One without runs has no slider and no script."""
    row = (TableCell("1.5", at=1.5), TableCell("differs", verdict="differs"), "<b>")
    page = Page(
        "A title",
        "An origin",
        [
            Text("First."),
            Section("more", "More", [Table(("at", "is", "b"), [row], "A table")]),
            Section("deep", "Deep", [Items(["one", "two"], ordered=True)], detail=True),
        ],
        Headline("It differs", holds=False),
    )
    assert_in(
        report(page),
        "<script></script>",
        *("An origin", "First.", "●", "&lt;b&gt;", "<li>two</li>", 'data-t="1.500000"'),
    )
    assert not page.holds
    assert_in(markdown(page, lambda _: ""), "## More", "<details><summary>Deep</summary>")


@pytest.mark.slow
def test_on_a_phone_a_verdict_is_in_sight_and_no_short_name_is_divided(tmp_path: Path) -> None:
    verdict = TableCell("differs", verdict="differs")
    row = ("gripperframe rotation", *["12.34 mm"] * 6, verdict)
    title = "What is said of a table, in a title that is longer than a phone is wide"
    table = Table(("what", *["largest"] * 6, "verdict"), [row], title=title, words=frozenset({7}))
    file = tmp_path / "wide.html"
    write_report(file, html_of(Page("A table", "made here", [table])))
    with looking(file, width=390, height=844) as tab:
        assert tab.locator(".wide").evaluate("(e) => e.scrollWidth > e.clientWidth")
        for seen in (".badge", ".wide caption span"):
            box = tab.locator(seen).bounding_box()
            assert box["x"] + box["width"] <= 390
        pieces = "(e) => e.getClientRects().length"
        name = tab.locator(".wide tbody th")
        name.evaluate("(e) => { e.innerHTML = '<span>gripperframe</span> rotation' }")
        assert name.locator("span").evaluate(pieces) == 1
