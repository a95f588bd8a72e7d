"""The report of a comparison, looked at in a real browser as a reader would."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import io
import itertools
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import statemachine as sm
from statemachine.compare import Comparison, Request, compare, series, sides_of, touches
from statemachine.compare.series import total_forces
from statemachine.compare.why import Attribution, FactorTrial, FirstTouch
from statemachine.drawing import drawing_of
from statemachine.errors import BadInputError
from statemachine.measures import Deviation
from statemachine.measures.text import quantity
from statemachine.page import (
    Block,
    Headline,
    Items,
    Page,
    Section,
    Table,
    TableCell,
    Text,
    Verdict,
)
from statemachine.report import terminal
from statemachine.report.compare import page as compared
from statemachine.report.contacts import contact_words
from statemachine.report.events import events_of
from statemachine.report.finding import headline
from statemachine.report.html import SideDrawing, check_target, report, write_report
from statemachine.report.html.between import shown_series, shown_traces
from statemachine.report.html.charts import difference_chart, spread
from statemachine.report.html.geometry import bones_of, mesh_of, octahedral
from statemachine.report.html.timeline import frames_of
from statemachine.report.markdown import markdown
from statemachine.report.over_time import chart_of
from statemachine.runs import Trace, record_scenario, shipped, write
from statemachine.runs.scenarios import SCENARIOS

from .browser import Tab, browser
from .conftest import ROOT, Cli

LIMIT = 2_000_000  # bytes
Made = tuple[Comparison, Trace, Trace, SideDrawing]
Seen = Callable[..., Any]


def of(one: Trace, two: Trace) -> Made:
    return compare(one, two), one, two, look_of(one)


def look_of(trace: Trace) -> SideDrawing:
    return SideDrawing(drawing_of(sm.load(trace.header.provenance.model_file)))


def page_of(made: Made, **more: Any) -> str:
    comparison, one, two, look = made
    looks = more.pop("looks", (look, look))
    return report(compared(comparison, one, two, **more), looks)


def rows(trace: Trace, count: int) -> Trace:
    """The first rows of a trace."""
    columns = {}
    few = trace["contact_row"] < count
    for name, array in trace.columns.items():
        columns[name] = array[few] if name.startswith("contact") else array[:count]
    return Trace(trace.header, columns)


@pytest.fixture(scope="module")
def hold() -> Made:
    """MuJoCo against the recorded run of PyBullet: no second engine is needed."""
    return of(
        record_scenario(SCENARIOS["hold"], sm.load("so101/scene")), shipped("hold", "pybullet")
    )


@pytest.fixture(scope="module")
def page(hold: Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("report") / "hold.html"
    return write_report(target, page_of(hold, command="statemachine compare hold --html hold.html"))


def open_page(tab: Tab, path: Path) -> None:
    tab.goto(path.as_uri())
    tab.wait_for_timeout(300)


@pytest.fixture
def tab(page: Path) -> Iterator[Tab]:
    """A browser with the page."""
    with browser(height=1000) as opened:
        open_page(opened, page)
        yield opened
        opened.nothing_wrong()


@pytest.fixture
def seen(tmp_path: Path) -> Seen:
    """Opens the page of a comparison in a browser."""

    @contextmanager
    def opened(made: Made, **more: Any) -> Iterator[Tab]:
        with browser(height=1000) as tab:
            open_page(tab, write_report(tmp_path / "x.html", page_of(made, **more)))
            yield tab
            tab.nothing_wrong()

    return opened


@pytest.fixture
def bare(page: Path) -> Iterator[Tab]:
    """A browser with the page that runs no script."""
    with browser(java_script_enabled=False) as opened:
        open_page(opened, page)
        yield opened


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
    return int((np.abs(before - after).max(axis=2) > 24).sum())


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


def test_it_asks_for_nothing_and_nothing_is_wrong(page: Path) -> None:
    with browser(offline=True) as tab:
        open_page(tab, page)
        assert tab.requests[0] == page.as_uri()
        assert {url.split(":")[0] for url in tab.requests[1:]} <= {"data"}
        tab.nothing_wrong()


def test_its_policy_lets_nothing_in(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy
    assert policy[1].startswith("default-src 'none'")
    assert "http" not in policy[1]
    assert "unsafe-inline'; script" in policy[1]  # styles alone
    scripts = re.findall(r"<script>(.*?)</script>", text, re.S)
    digests = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert re.findall(r"'sha256-([^']+)'", policy[1]) == digests
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)", text)
    assert str(ROOT) not in text


@pytest.mark.slow
def test_a_script_that_was_put_in_is_not_run(page: Path, tmp_path: Path) -> None:
    """The policy does what it says: else the test above would say nothing."""
    text = page.read_text(encoding="utf-8")
    bad = tmp_path / "bad.html"
    extra = "<script>window.came_in = 1</script><img src='http://outside.invalid/a.png'></body>"
    bad.write_text(text.replace("</body>", extra), encoding="utf-8")
    with browser() as tab:
        open_page(tab, bad)
        assert tab.evaluate("window.came_in") is None
        assert any("Content Security Policy" in error for error in tab.errors)


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
        texts = {name: hostile(name) for name in ("experiment", "says", "command", "keyframe")}
        options = {hostile("o"): hostile("p")}
        found = dataclasses.replace(
            header, provenance=prov, ended=hostile("end"), options=options, **names, **texts
        )
        return Trace(found, trace.columns)

    _, one, two, look = hold
    made = of_look(spoiled(one), spoiled(two), look)
    with seen(made, said=(hostile("said"),), command=hostile("typed")) as tab:
        assert tab.evaluate("window.hit") is None
        assert tab.locator("img").count() == 0
        assert "onerror" in tab.locator("main").inner_text()


def of_look(one: Trace, two: Trace, look: SideDrawing) -> Made:
    return compare(one, two), one, two, look


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hold", "gravity", "box", "hold.engine"])
def test_it_is_small(name: str, tmp_path: Path) -> None:
    experiment, _, engine = name.partition(".")
    scenario = SCENARIOS[experiment]
    kind: Any = "engine" if engine else "model"
    one = record_scenario(scenario, sm.load(scenario.model, defaults=kind), defaults=kind)
    text = page_of(of(one, shipped(experiment, "pybullet", kind)))
    assert len(text.encode()) <= LIMIT
    with browser() as tab:
        open_page(tab, write_report(tmp_path / "x.html", text))
        assert tab.locator("#scene").is_visible()
        tab.nothing_wrong()


def test_a_long_run_is_small_too_and_keeps_the_moments_that_count() -> None:
    one = record_scenario(SCENARIOS["hold"], sm.load("so101/scene"), seconds=20.0)
    qpos = one.qpos.copy()
    qpos[1234, 2] += 0.1
    two = Trace(one.header, {**one.columns, "qpos": qpos})
    made = of(one, two)
    assert len(page_of(made).encode()) <= LIMIT
    at = made[0].agreements[2].at
    assert at == pytest.approx(1234 * 0.005)
    assert np.abs(frames_of(one, two, (at,)).time - at).min() < 1e-9
    assert len(frames_of(one, two)) < len(one)


@pytest.mark.slow
def test_much_to_draw_is_drawn_with_less(hold: Made) -> None:
    """Many contacts at once, and a shape of two hundred thousand triangles."""
    _, one, two, look = hold
    count = 60
    n = len(one) * count
    columns = dict(one.columns)
    columns["contact_row"] = np.repeat(np.arange(len(one)), count)
    columns["contact_geom"] = np.tile([0, 34], (n, 1))
    for name, width in (("dist", ()), ("pos", (3,)), ("frame", (9,)), ("force", (3,))):
        columns[f"contact_{name}"] = np.random.default_rng(0).normal(size=(n, *width))
    assert look.drawing
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 320), np.linspace(0.01, 3.13, 320))
    ball = 0.1 * np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    a = np.arange(320 * 320).reshape(320, 320)
    a, b, c, d = (x.ravel() for x in (a[:-1, :-1], a[:-1, 1:], a[1:, 1:], a[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    part = dataclasses.replace(
        look.drawing.parts[1],
        vertices=ball.reshape(-1, 3).astype(np.float32),
        faces=faces.astype(np.int32),
    )
    big = SideDrawing(dataclasses.replace(look.drawing, parts=(*look.drawing.parts, part)))
    text = page_of(of_look(Trace(one.header, columns), two, big))
    assert len(text.encode()) <= LIMIT
    assert "triangles" in text
    assert "strongest are drawn" in text


# What it says.


def test_the_headline_is_made_of_the_figures(hold: Made) -> None:
    comparison, one, two, _ = hold
    found = {each.name: each for each in comparison.agreements}
    curves = series(one, two)
    finding = headline(comparison, events_of(comparison, touches(one, two)), None, curves)
    wrist = found["wrist_flex"]
    far, at = quantity(wrist.max, wrist.unit), f"{wrist.at:.3f} s"
    assert finding.lead.startswith(f"Joint wrist_flex is up to {far} apart")
    assert f", at {at}; " in finding.lead
    since = min(each.since for each in comparison.agreements if each.since is not None)
    assert f"the runs part at {since:.3f} s, when gripper touches floor" in finding.lead
    assert finding.causes == ()  # nothing was asked about causes
    # The end is a mean over the last tenth, and the last moment is something else.
    (curve,) = (each for each in curves if each.name == "wrist_flex")
    tail = np.degrees(curve.difference[curve.time >= 1.8 - 1e-9])
    assert finding.end.startswith("On average over the last 0.2 s joint wrist_flex is still ")
    said = [float(x) for x in re.findall(r"([\d.]+)°", finding.end)]
    assert said == pytest.approx([tail.mean(), tail[-1]], rel=0.005)
    assert tail[0] - tail[-1] > 0.0879
    assert "still changing" in finding.end


def test_what_stands_still_in_the_end_is_not_called_changing(hold: Made) -> None:
    _, one, _, _ = hold
    qpos = one.qpos.copy()
    qpos[100:, 3] += 0.05
    two = Trace(one.header, {**one.columns, "qpos": qpos})
    end = headline(compare(one, two), [], None, series(one, two)).end
    assert "wrist_flex is still 2.86° apart" in end
    assert "changing" not in end
    qpos = one.qpos.copy()
    qpos[100:200, 3] += 0.05
    two = Trace(one.header, {**one.columns, "qpos": qpos})
    assert "within its tolerance" in headline(compare(one, two), [], None, series(one, two)).end


def attribution_of(made: Made, quantity: str = "joints", **more: Any) -> Attribution:
    """An attribution with figures of our own: a servo law, and contact that hides the rest."""
    comparison, one, two, _ = made
    worst = max((a for a in comparison.agreements if a.kind == "joint"), key=lambda a: a.max)
    gap = Deviation("rad", worst.max, worst.at, worst.rms, worst.settled)
    g = worst.max

    def trial(factor: str, way: Any, after: float, before: float, moved: float) -> FactorTrial:
        return FactorTrial(
            factor, way, ("kp 998.2", "its motors"), "as mujoco" if way == "parity" else "none",
            {}, after * g, before - after, moved,
        )  # fmt: skip

    ladder = (
        trial("servo", "parity", 0.4, 1.0, 0.0),
        trial("armature", "parity", 0.5, 0.4, 0.0),
        trial("contact", "off", 1e-8, 0.5, 0.3),
    )
    alone = (
        trial("servo", "parity", 4.0, 1.0, 0.0),
        trial("gravity", "off", 0.5, 1.0, 0.2),
        trial("armature", "off", 0.9, 1.0, 0.2),
        trial("contact", "off", 0.8, 1.0, 0.3),
    )
    fields: dict[str, Any] = {
        "experiment": "hold", "says": "", "seconds": 2.0, "one": "mujoco", "two": "pybullet",
        "names": ("mujoco", "pybullet"), "quantity": quantity, "unit": "rad",
        "first": {quantity: gap}, "alone": alone, "ladder": ladder, "left": 1e-8 * g,
        "negligible": 1e-9, "floor": 0.0, "extent": 1.0, "touch": None, "moments": 401,
        "between": False,
        "order": ("First.", "Then."), "runs": 9,
        "provenance": (one.header.provenance, two.header.provenance),
    }  # fmt: skip
    return Attribution(**{**fields, **more})


def test_causes_are_of_the_difference_that_leads(hold: Made) -> None:
    comparison = hold[0]
    found = headline(comparison, [], attribution_of(hold))
    assert found.lead.startswith("Joint wrist_flex is up to 2.58° apart")
    assert (
        found.causes[0] == "Of that, made the same, each added to those before: servo law 60.0 %."
    )
    # What moves the first side too is a hint, wherever it is said.
    assert "contact takes 50.0 % of it away*" in found.causes[1]
    assert "a hint, not a proof" in found.causes[1]
    # A proof comes before.
    touch = FirstTouch(0.27, "gripper on floor (finger); other", 3e-16, 55)
    found = headline(comparison, [], attribution_of(hold, touch=touch))
    assert found.causes[0].startswith("Until the first touch, gripper on floor (finger) at 0.270 s")
    assert "2e-14° apart" in found.causes[0]
    late = FirstTouch(0.27, "finger on floor", 0.01, 55)  # they were apart before
    assert len(headline(comparison, [], attribution_of(hold, touch=late)).causes) == 2
    # Of another quantity than any that is compared: named as it is.
    other = headline(comparison, [], attribution_of(hold, quantity="box in the hand"))
    assert other.lead.startswith("The box in the hand is up to 2.58° apart")


def test_the_section_of_causes(hold: Made, tmp_path: Path) -> None:
    text = page_of(hold, attribution=attribution_of(hold))
    with browser(java_script_enabled=False) as tab:
        open_page(tab, write_report(tmp_path / "x.html", text))
        why = tab.locator("#why")
        table, alone = why.locator("table").all()
        assert "explains" in table.inner_text()
        assert not alone.is_visible()
        why.locator("summary").click()
        head = alone.locator("thead").inner_text()
        assert "change of the gap" in head
        assert "explains" not in head

        def bar(where: Any, row: str) -> tuple[float, float, str]:
            line = where.locator("tr", has_text=row)
            whole = line.locator(".bar").bounding_box()
            fill = line.locator(".bar i").bounding_box()
            zero = whole["x"] + whole["width"] / 2
            looks = line.locator(".bar").get_attribute("class")
            return (
                (fill["x"] - zero) / whole["width"],
                (fill["x"] + fill["width"] - zero) / whole["width"],
                looks,
            )

        # Gravity halves the gap: to the left of zero. The servo law alone makes it four times.
        low, high, looks = bar(alone, "Gravity")
        assert (low, high) == pytest.approx((-0.25, 0.0), abs=0.02)
        assert "cut" not in looks
        low, high, looks = bar(alone, "Servo law")
        assert (low, high) == pytest.approx((0.0, 0.5), abs=0.02)
        assert "cut up" in looks
        assert "+300.0 %" in alone.inner_text().replace("\u00a0", " ")
        # In the ladder armature makes the gap wider: to the left.
        low, high, _ = bar(table, "Armature")
        assert (low, high) == pytest.approx((-0.05, 0.0), abs=0.02)
        steps = tab.locator("#agree ol li").all_inner_texts()
        assert [step.split(" – ")[0].replace("\u00a0", " ") for step in steps] == [
            "Servo law of pybullet: its motors → kp 998.2",
            "Armature of pybullet: its motors → kp 998.2",
        ]
        assert "What remains with all of it: 1.29°" in tab.locator("#agree").inner_text()
    # The conclusion stands once.
    assert text.count("Of the 2.58°") == 1
    assert 'id="agree"' not in page_of(hold)


def test_who_presses_on_what(hold: Made) -> None:
    comparison, one, two, _ = hold
    (touch,) = touches(one, two)
    late = one["contact_row"] >= 360  # the last tenth of 401 rows
    mean = float(one["contact_force"][late, 0].sum()) / 41
    assert touch.pair == "gripper on floor"
    assert touch.one.force == pytest.approx(mean)
    assert touch.one.deepest == -float(one["contact_dist"].min())
    said = texts(contact_words(comparison, touches(one, two)))
    assert not any("never touches" in each for each in said)
    both = f"with {mean:.1f} N (with friction {touch.one.total:.1f} N)"
    assert f"gripper presses on floor {both}" in said[0]
    whole = total_forces(one)["gripper on floor"][360:]
    assert touch.one.total == pytest.approx(whole.mean())
    assert whole.mean() > mean
    said_under = "it is at most 351 N; the whole force, friction added as vectors, is at most 383 N"
    assert said_under in page_of(hold)
    last = float(two.time[two["contact_row"][-1]])
    assert f"on pybullet nothing touches after {last:.3f} s" in said[0]
    # A side that never touches.
    none = {
        name: array[:0] if name.startswith("contact") else array
        for name, array in two.columns.items()
    }
    bare = Trace(two.header, none)
    said = texts(contact_words(compare(one, bare), touches(one, bare)))
    assert said[0] == "On pybullet gripper never touches floor in this run."
    assert "on pybullet nothing touches at all" in said[1]
    text = page_of(of_look(one, bare, hold[3]))
    assert "On pybullet gripper never touches floor" in text
    assert "gripper on floor normal force over time on both sides" in text


def texts(blocks: list[Block]) -> list[str]:
    """The paragraphs among blocks, those of sections too."""
    said = []
    for block in blocks:
        if isinstance(block, Section):
            said += texts(list(block.blocks))
        elif isinstance(block, Text):
            said.append(block.text)
    return said


@pytest.mark.slow
def test_names_in_a_list_have_no_comma(hold: Made, tab: Tab) -> None:
    text = tab.locator("main").inner_text()
    assert "gripperframe rotation" in text
    assert "gripperframe, " not in text
    assert "gripper, normal force" not in text
    assert "largest difference: elbow_flex; gripper" in text.lower()
    # One sign for minus in all figures but those of a command.
    assert not re.findall(r"(?<![\w–-])-\d|\de-\d", text)


def test_what_was_commanded(hold: Made) -> None:
    text = page_of(hold).replace("\u00a0", " ")
    for name, value in zip(hold[1].header.actuators, hold[1].ctrl[0], strict=True):
        shown = "0" if value == 0 else f"{np.degrees(value):.1f}".replace("-", "−")
        assert f"{name} {shown}°" in text
    still = [
        Trace(dataclasses.replace(t.header, options={"actuation": False}), t.columns)
        for t in hold[1:3]
    ]
    assert "nothing is commanded" in page_of(of_look(still[0], still[1], hold[3]))
    moving = hold[1].ctrl.copy()
    moving[200:, 1] = 0.25
    told = Trace(hold[1].header, {**hold[1].columns, "ctrl": moving})
    assert "in the end" in page_of(of_look(told, told, hold[3]))


def test_a_link_only_to_what_is_there(hold: Made) -> None:
    models = Page("models", "", [Verdict("1 figure differs", False)])
    for header in (hold[2].header, dataclasses.replace(hold[2].header, defaults="engine")):
        two = Trace(header, hold[2].columns)
        text = page_of(of_look(hold[1], two, hold[3]), models=models)
        targets = set(re.findall(r'id="([^"]+)"', text))
        links = set(re.findall(r'href="#([^"]+)"', text))
        assert links <= targets
        assert ("emulated" in links) == (header.defaults == "model")


def test_figures_between_moments_are_those_of_the_picture() -> None:
    scenario = SCENARIOS["hold"]
    one = record_scenario(scenario, sm.load(scenario.model, defaults="engine"), defaults="engine")
    two = shipped("hold", "pybullet", "engine")
    frames = frames_of(one, two)
    curves = series(one, two)
    found = {each.name: each for each in shown_series(shown_traces(one, two, frames), None, curves)}
    other = np.interp(frames.time, two.time - two.time[0], two.qpos[:, 2])
    assert found["elbow_flex"].two == pytest.approx(other, abs=1e-12)
    assert found["elbow_flex"].difference == pytest.approx(
        np.abs(one.qpos[frames.one, 2] - other), abs=1e-12
    )
    assert found["elbow_flex"].difference[4] > 0.1  # at 0.020 s the arms are apart, and it is said
    # At a common moment nothing is taken between.
    tip = next(each for each in curves if each.kind == "tip rotation")
    common = np.searchsorted(frames.time, tip.time - 1e-9)
    assert found[tip.name].difference[common] == pytest.approx(tip.difference, abs=1e-9)
    text = page_of(of(one, two))
    assert "at the first common moment already, 0.025\u00a0s" in text
    assert "meet every 25\u00a0ms" in text


def test_a_difference_far_beyond_its_tolerance_has_a_log_axis(hold: Made) -> None:
    _, one, two, _ = hold
    before = page_of(hold).count("log axis")
    qpos = two.qpos.copy()
    qpos[100:110, 2] += 1.0
    far = Trace(two.header, {**two.columns, "qpos": qpos})
    made = of_look(one, far, hold[3])
    text = page_of(made)
    assert text.count("log axis") == before + 1
    found = next(a for a in made[0].agreements if a.name == "elbow_flex")
    curve = next(c for c in series(one, far) if c.name == "elbow_flex")
    chart = difference_chart(chart_of(curve, found, ("a", "b")))
    heights = {float(y) for y in re.findall(r'y="([\d.]+)"', chart)}
    (band,) = heights
    assert 30 < band < 70  # the tolerance is seen, two decades over the foot of the axis
    ticks = re.findall(r'ytick" style="[^"]*">([^<]+)<', chart)
    assert ticks[-1] == "10"
    assert len(ticks) >= 4


def test_names_at_the_end_of_a_chart_do_not_cover_each_other() -> None:
    assert spread([10.0, 50.0, 90.0]) == [10.0, 50.0, 90.0]
    places = spread([99.0, 98.0, 5.0], 13.0)
    assert places[2] == 5.0
    assert places[0] - places[1] >= 13.0
    assert max(places) <= 100.0


@pytest.mark.slow
def test_ticks_have_their_labels_under_them(tab: Tab) -> None:
    far = tab.evaluate(
        """() => [...document.querySelectorAll('.area + .times')].filter((t) => t.offsetWidth)
        .flatMap((times) => [...times.children].map((label) => {
          const range = document.createRange();
          range.selectNode(label.firstChild);
          const text = range.getBoundingClientRect(), box = times.getBoundingClientRect();
          const at = box.left + parseFloat(label.style.left) / 100 * box.width;
          return Math.abs(text.left + text.width / 2 - at);
        }))"""
    )
    assert len(far) > 20
    assert max(far) < 1.5


@pytest.mark.slow
def test_on_a_phone_the_slider_is_under_the_picture(page: Path) -> None:
    with browser(width=390, height=844) as tab:
        open_page(tab, page)
        scene, slider = (tab.locator(s).bounding_box() for s in ("#scene", "#slider"))
        assert 0 < slider["y"] - scene["y"] - scene["height"] < 100
        assert tab.locator(".kicker .against").is_visible()
        # The verdicts are seen without scrolling, and a shadow says that there is more.
        badge = tab.locator("#figures .badge").first.bounding_box()
        assert badge["x"] + badge["width"] <= 390
        wide = tab.locator("#figures .wide").first
        assert wide.evaluate("(e) => e.scrollWidth > e.clientWidth")
        wide.scroll_into_view_if_needed()
        edge = picture(tab, "#figures .wide >> nth=0")[40:200]
        tab.evaluate("document.documentElement.style.setProperty('--cue', 'transparent')")
        assert changed(edge, picture(tab, "#figures .wide >> nth=0")[40:200]) > 200


def test_it_opens_near_the_tool_where_the_gap_is_small(hold: Made, tmp_path: Path) -> None:
    def begins_near(made: Made) -> bool:
        data = re.search(r'id="data">(.*?)</script>', page_of(made), re.S)
        assert data
        return json.loads(data[1])["scene"]["begin_near"]

    assert begins_near(hold)  # 7 mm
    far = hold[2]["site_xpos"] + 0.2
    assert not begins_near(
        of_look(hold[1], Trace(hold[2].header, {**hold[2].columns, "site_xpos": far}), hold[3])
    )
    assert not begins_near(of_look(hold[1], hold[1], hold[3]))


def test_other_figures_make_another_headline(hold: Made) -> None:
    comparison, one, two, _ = hold
    same = compare(one, one)
    assert "same in every figure" in headline(same, events_of(same, touches(one, one))).text
    near = compare(one, Trace(one.header, {**one.columns, "qpos": one.qpos + 1e-6}))
    assert "agree for 2 s" in headline(near, []).text
    # Without contacts, nothing is said of a touch.
    bare = [
        Trace(t.header, {k: v for k, v in t.columns.items() if not k.startswith("contact")})
        for t in (one, two)
    ]
    apart = compare(*bare)
    assert "touches" not in headline(apart, events_of(apart, touches(*bare))).text
    assert comparison.agreements != apart.agreements


def test_every_figure_of_the_comparison_is_on_the_page(hold: Made, bare: Tab) -> None:
    text = (
        bare.locator("#figures table").first.inner_text().replace("−", "-").replace("\u00a0", " ")
    )
    for found in hold[0].agreements:
        (line,) = [
            row for row in text.splitlines() if row.startswith(found.name.replace(", ", " ") + "\t")
        ]
        assert quantity(found.tolerance, found.unit) in line
        assert found.verdict in line
        if found.kind != "contact":
            for value in (found.max, found.rms, found.settled):
                assert quantity(value, found.unit) in line


def test_it_reads_without_a_script(bare: Tab) -> None:
    assert bare.locator("#still svg").is_visible()
    assert bare.locator("#curves .plot").first.is_visible()
    assert not bare.locator("#slider").is_visible()
    assert not bare.locator("#play").is_visible()
    assert not bare.locator(".cursor").first.is_visible()
    text = bare.locator("main").inner_text()
    for heading in ("How far apart, over time", "What happens when", "Where this comes from"):
        assert heading in text


# What moves.


@pytest.mark.slow
def test_the_slider_moves_both_arms_the_cursors_and_the_figures(tab: Tab, hold: Made) -> None:
    for name in ("marks", "trails"):
        tab.locator(f"#{name}").uncheck()
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
    values = hold[1].qpos[120, 3], hold[2].qpos[120, 3]
    cells = tab.locator("#readout tr", has_text="wrist_flex").locator("td").all_inner_texts()
    shown = [float(cell.rstrip("°").replace("−", "-")) for cell in cells]
    assert shown[:2] == pytest.approx(np.degrees(values), abs=0.06)
    assert shown[2] == pytest.approx(abs(np.degrees(values[0] - values[1])), abs=0.006)


@pytest.mark.slow
def test_each_side_is_drawn_and_can_be_left_out(tab: Tab) -> None:
    before = picture(tab)
    for name in ("solid", "ghost", "marks", "trails"):
        tab.locator(f"#{name}").uncheck()
        without = picture(tab)
        assert changed(before, without) > 150, name
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
    two = Trace(one.header, {**one.columns, "xpos": xpos, "xquat": turned})
    with seen(of_look(one, two, look)) as tab:
        for name in ("marks", "trails"):
            tab.locator(f"#{name}").uncheck()
        both = picture(tab)
        tab.locator("#ghost").uncheck()
        ghost = np.abs(picture(tab) - both).max(axis=2) > 24
        tab.locator("#solid").uncheck()
        empty = picture(tab)
        tab.locator("#solid").check()
        solid = np.abs(picture(tab) - empty).max(axis=2) > 24
    assert (ghost & ~solid).sum() > 0.5 * ghost.sum()


def until(tab: Tab, holds: Callable[[], bool]) -> None:
    """Wait for something; the page's policy keeps the browser from doing it itself."""
    for _ in range(300):
        if holds():
            return
        tab.wait_for_timeout(50)
    pytest.fail("it did not happen")


def moved(tab: Tab, since: float) -> float:
    """The row once the slider has gone on by itself."""
    slider = tab.locator("#slider")
    until(tab, lambda: float(slider.input_value()) > since)
    return float(slider.input_value())


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
    then = float(tab.locator("#slider").input_value())
    assert 0 < first < then < 400
    tab.wait_for_timeout(400)
    assert float(tab.locator("#slider").input_value()) == then
    assert cursors(tab)[0] == pytest.approx(then / 400, abs=0.004)
    until(tab, lambda: tab.locator("#said").text_content().startswith("Paused at "))


@pytest.mark.slow
def test_it_can_be_used_by_keyboard(tab: Tab) -> None:
    slider = tab.locator("#slider")
    slider.focus()
    for key, value in (("Home", 0), ("ArrowRight", 1), ("End", 400), ("ArrowLeft", 399)):
        tab.keyboard.press(key)
        assert int(slider.input_value()) == value
    assert re.fullmatch(
        r"1\.995 s: wrist_flex [\d.]+°; gripperframe position [\d.]+\u00a0mm apart",
        slider.get_attribute("aria-valuetext"),
    )
    tab.keyboard.press("Home")
    tab.keyboard.press(" ")
    moved(tab, 0)
    tab.keyboard.press(" ")
    assert 0 < int(slider.input_value()) < 400
    tab.locator("#scene").press("0")
    before = picture(tab)
    tab.locator("#scene").press("ArrowLeft")
    assert changed(before, picture(tab)) > 1000
    tab.locator("#scene").press("0")
    assert changed(before, picture(tab)) == 0
    # Whatever can be reached shows that it was.
    for _ in range(12):
        tab.keyboard.press("Tab")
        style = tab.evaluate(
            "(() => { const s = getComputedStyle(document.activeElement);"
            "return [s.outlineStyle, parseFloat(s.outlineWidth)]; })()"
        )
        assert style[0] != "none"
        assert style[1] >= 2


@pytest.mark.slow
def test_a_time_in_a_table_and_a_press_on_a_chart_go_there(page: Path) -> None:
    # Else the page glides to its picture, and a press may miss what moves.
    with browser(height=1000, reduced_motion="reduce") as tab:
        open_page(tab, page)
        button = tab.locator("#events button.go").first
        text = button.inner_text()
        button.click()
        clock = tab.locator("#clock")
        until(tab, lambda: clock.inner_text() == text)
        area = tab.locator("#curves .area").first
        area.click(position={"x": 0.75 * area.bounding_box()["width"], "y": 20})
        until(tab, lambda: clock.inner_text() == "1.500 s")


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
    tab.locator("#view-near").click()
    near = picture(tab)
    assert changed(before, near) > 2000
    tab.locator("#view-all").click()
    assert changed(before, picture(tab)) == 0


# How it looks, and to whom.


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 768, 1280])
def test_nothing_is_wider_than_the_screen(page: Path, width: int) -> None:
    with browser(width=width, height=700) as tab:
        open_page(tab, page)
        for summary in tab.locator("summary").all():
            summary.click()
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        box = tab.locator("#scene").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width


@pytest.mark.slow
def test_dark_and_light(page: Path) -> None:
    def paper(tab: Tab) -> float:
        colour = tab.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(map(int, re.findall(r"\d+", colour)[:3])) / 3

    with browser(color_scheme="light") as tab:
        open_page(tab, page)
        assert paper(tab) > 230
        before = picture(tab)
        button = tab.get_by_role("button", name="Dark colours")
        assert button.inner_text() == "Dark"
        button.click()
        assert paper(tab) < 50
        assert tab.get_by_role("button", name="Light colours").inner_text() == "Light"
        assert changed(before, picture(tab)) > 10_000
    with browser(color_scheme="dark") as tab:
        open_page(tab, page)
        assert paper(tab) < 50
        tab.get_by_role("button", name="Light colours").click()
        assert paper(tab) > 230


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.2)."""
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    r, g, b = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(one: str, two: str) -> float:
    high, low = sorted((luminance(one), luminance(two)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_every_text_can_be_read(page: Path) -> None:
    css = (ROOT / "statemachine/report/html/page.css").read_text()
    blocks = re.findall(r":root[^{]*\{([^}]*--paper[^}]*)\}", css)
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
    css = (ROOT / "statemachine/report/html/page.css").read_text()
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
    heard = tab.locator("body").aria_snapshot()
    for part in (
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
    ):
        assert part in heard, part
    levels = [
        int(name[1])
        for name in tab.evaluate(
            "[...document.querySelectorAll('h1,h2,h3,h4')].map((h) => h.tagName)"
        )
    ]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
    nameless = tab.evaluate(
        """[...document.querySelectorAll('button, input, select, a, [role=img], [tabindex]')]
        .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim()
          || (e.labels && e.labels.length))).map((e) => e.outerHTML)"""
    )
    assert nameless == []
    tables = tab.evaluate(
        "[...document.querySelectorAll('table')].map((t) => [!!t.caption?.textContent,"
        "[...t.querySelectorAll('th')].every((h) => h.scope)])"
    )
    assert all(caption and scoped for caption, scoped in tables)
    assert tab.locator("#said").get_attribute("aria-live") == "polite"


@pytest.mark.slow
def test_it_prints_with_all_sections_and_the_picture(page: Path) -> None:
    with browser(color_scheme="dark") as tab:
        open_page(tab, page)
        # What a browser does when it prints, held still to be looked at.
        tab.evaluate("dispatchEvent(new Event('beforeprint'))")
        tab.emulate_media(media="print")
        tab.wait_for_timeout(300)
        assert (
            tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        )
        text = tab.locator("main").inner_text()
        for heading in tab.locator("h2").all_inner_texts():
            assert heading in text
        assert "shoulder_pan" in tab.locator("#curves > details").inner_text()
        assert tab.locator("#printed").is_visible()
        assert picture(tab, "#printed").std() > 10
        for name in ("#play", "#slider", "#theme", "#views", "#checks"):
            assert not tab.locator(name).is_visible()
        tab.emulate_media(media="screen")
        tab.evaluate("dispatchEvent(new Event('afterprint'))")
        assert tab.locator("#printed").count() == 0
        assert not tab.locator("#curves > details").evaluate("(e) => e.open")
        pdf = tab.page.pdf(format="A4")
        assert len(re.findall(rb"/Type\s*/Page\b", pdf)) >= 3
        tab.nothing_wrong()


@pytest.mark.slow
def test_it_says_so_without_webgl(page: Path, tmp_path: Path) -> None:
    with browser() as tab:
        tab.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
        open_page(tab, page)
        assert "no WebGL" in tab.locator("#no-scene").inner_text()
        assert tab.locator("#still svg").is_visible()
        assert not tab.locator("#scene").is_visible()
        go(tab, 100)
        assert tab.locator("#clock").inner_text() == "0.500 s"
        tab.nothing_wrong()


@pytest.mark.slow
def test_it_does_not_move_by_itself_nor_smoothly_where_that_is_not_wanted(page: Path) -> None:
    with browser(reduced_motion="reduce") as tab:
        open_page(tab, page)
        before = tab.locator("#slider").input_value()
        tab.wait_for_timeout(500)
        assert tab.locator("#slider").input_value() == before
        tab.locator("#events button.go").first.click()
        y = tab.evaluate("scrollY")
        tab.wait_for_timeout(200)
        assert tab.evaluate("scrollY") == y


# Whatever the traces are.


def ended(made: Made) -> Made:
    _, one, two, look = made
    early = rows(two, 150)
    header = dataclasses.replace(early.header, ended="it diverged at 0.745 s")
    return of_look(one, Trace(header, early.columns), look)


def single(made: Made) -> Made:
    _, one, two, look = made
    return of_look(rows(one, 1), rows(two, 1), look)


def same(made: Made) -> Made:
    return of_look(made[1], made[1], made[3])


def not_finite(made: Made) -> Made:
    _, one, two, look = made
    xpos = two["xpos"].copy()
    xpos[100:] = np.nan
    xpos[90] = 1e12
    return of_look(one, Trace(two.header, {**two.columns, "xpos": xpos}), look)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ended, single, same, not_finite])
def test_other_traces(hold: Made, kind: Callable[[Made], Made], seen: Seen) -> None:
    made = kind(hold)
    with seen(made) as tab:
        assert tab.locator("#scene").is_visible()
        last = int(tab.locator("#slider").get_attribute("max"))
        go(tab, last)
        assert tab.locator("#clock").inner_text() == f"{made[0].until:.3f} s"
        text = tab.locator("body").inner_text()
        if kind is ended:
            assert "it diverged at 0.745 s" in text
        if kind is same:
            assert "The two runs are the same in every figure" in text
        assert "NaN" not in text
        assert tab.locator("#play").is_visible() == (kind is not single)


@pytest.mark.slow
def test_timesteps_that_differ_are_drawn_between_and_it_is_said(seen: Seen) -> None:
    scenario = SCENARIOS["hold"]
    one = record_scenario(scenario, sm.load(scenario.model, defaults="engine"), defaults="engine")
    two = shipped("hold", "pybullet", "engine")
    assert one.header.timestep != two.header.timestep
    frames = frames_of(one, two)
    assert len(frames) > 4 * compare(one, two).moments
    assert frames.between
    # At a compared moment nothing is taken between.
    common = np.isclose(frames.time % 0.025, 0, atol=1e-9) | np.isclose(frames.time % 0.025, 0.025)
    assert (frames.share[common] == 0).all()
    with seen(of(one, two)) as tab:
        assert "taken between two of its rows" in tab.locator("#picture").inner_text()
        go(tab, 7)
        assert "between two of its rows" in tab.locator("#now").inner_text()
        cell = tab.locator("#readout tr", has_text="elbow_flex").locator("td").last.inner_text()
        # Rows of 5 ms and of 1/240 s: at 35 ms the other is between its rows 8 and 9.
        apart = abs(one.qpos[7, 2] - (0.6 * two.qpos[8, 2] + 0.4 * two.qpos[9, 2]))
        assert float(cell.strip("● °")) == pytest.approx(np.degrees(apart), rel=0.01)


@pytest.mark.slow
def test_without_the_model_there_are_sticks(hold: Made, seen: Seen) -> None:
    none = SideDrawing(None, "there is no so101/scene.xml here")
    with seen(hold, looks=(none, none)) as tab:
        assert "there is no so101/scene.xml here" in tab.locator("#picture").inner_text()
        tab.locator("#view-all").click()
        before = picture(tab)
        go(tab, 0)
        assert changed(before, picture(tab)) > 2000


@pytest.mark.slow
def test_without_poses_there_is_no_scene_and_it_is_said(hold: Made, seen: Seen) -> None:
    bare = [
        Trace(t.header, {k: v for k, v in t.columns.items() if k not in ("xpos", "xquat")})
        for t in hold[1:3]
    ]
    with seen(of_look(bare[0], bare[1], hold[3])) as tab:
        assert "no poses" in tab.locator("#stage").inner_text()
        go(tab, 100)
        assert tab.locator("#clock").inner_text() == "0.500 s"


# Shapes.


def test_a_mesh_keeps_its_surface() -> None:
    drawing = drawing_of(sm.load("so101/scene"))
    mesh = mesh_of(drawing)
    wanted = sum(area(p.vertices, p.faces) for p in drawing.parts if not p.endless)
    assert area(mesh.vertices, mesh.faces) == pytest.approx(wanted, rel=1e-5)
    assert not mesh.simplified
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    corners = mesh.vertices[mesh.faces].astype(float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = (normal[:, None] * mesh.normals[mesh.faces]).sum(axis=2)
    assert (facing > 0).mean() > 0.999


def area(vertices: Any, faces: Any) -> float:
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_too_many_triangles_are_made_fewer() -> None:
    drawing = drawing_of(sm.load("so101/scene"))
    mesh = mesh_of(drawing, most=2000)
    assert 500 < len(mesh.faces) <= 2000 < mesh.simplified
    whole = mesh_of(drawing)
    for k in (0, 1):
        ends = [np.sort(m.vertices, axis=0)[[0, -1][k]] for m in (mesh, whole)]
        assert ends[0] == pytest.approx(ends[1], abs=0.02)
    assert not whole.simplified


def test_folded_normals_unfold() -> None:
    random = np.random.default_rng(0)
    n = random.normal(size=(1000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    f = octahedral(n) / 32767
    z = 1 - np.abs(f).sum(axis=1)
    t = np.maximum(-z, 0)[:, None]
    found = np.column_stack([f - np.where(f >= 0, t, -t), z])
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    assert np.abs(found - n).max() < 1e-4


def test_bones_reach_from_body_to_body(hold: Made) -> None:
    one = hold[1]
    drawing = bones_of(one)
    chain = [body for body, parent in enumerate(one.header.body_parentid) if body and parent]
    assert len(drawing.parts) == len(chain) + 2  # a knob at the end of each branch
    for body, part in zip(chain, drawing.parts, strict=False):
        end = part.vertices[-1]
        apart = one["xpos"][0, body] - one["xpos"][0, one.header.body_parentid[body]]
        if not apart.any():
            continue  # the camera's mount has its origin where the gripper has
        assert np.linalg.norm(end) == pytest.approx(np.linalg.norm(apart), abs=1e-6)


# The command.


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
def test_the_command_writes_it(cli: Cli, tmp_path: Path) -> None:
    done = cli("compare", "hold", "--no-why", "--html", "out.html", code=1)
    assert "wrote out.html" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["out.html"]
    text = (tmp_path / "out.html").read_text(encoding="utf-8")
    assert "statemachine compare hold --no-why --html out.html" in text
    assert str(tmp_path) not in text
    json.loads(cli("compare", "hold", "--no-why", "--html", "out.html", "--json").stdout)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("hold", "--html", "out.pdf"), "a report is a file .html"),
        (("hold", "--html", "no/such/out.html"), "there is no folder no/such"),
        (("hold", "--html", "."), "a report is a file .html"),
        (("hold", "--no-why"), "--no-why goes with --html"),
        (("--models", "so101", "so101", "--html", "x.html"), "--models runs nothing"),
    ],
)
def test_mistakes_are_one_line_before_anything_runs(
    cli: Cli, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    done = cli("compare", *words, code=2)
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert said in done.stderr
    assert done.stdout == ""
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_into(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(
        "statemachine.report.html.writing.os.access", lambda *_: False
    )  # root may write anywhere
    with pytest.raises(BadInputError, match="cannot be written"):
        check_target(tmp_path / "x.html")
    (tmp_path / "folder.html").mkdir()
    with pytest.raises(BadInputError, match="is a folder"):
        check_target(tmp_path / "folder.html")


@pytest.mark.slow
def test_traces_make_a_report_without_a_cause(cli: Cli, hold: Made, tmp_path: Path) -> None:
    for name, trace in (("one", hold[1]), ("two", hold[2])):
        write(rows(trace, 120), tmp_path / f"{name}.npz")
    cli("compare", "one.npz", "two.npz", "--html", "out.html", code=1)
    assert "causes are found by running an experiment again" in (tmp_path / "out.html").read_text()


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
def test_the_cause_is_on_the_page(cli: Cli, tmp_path: Path) -> None:
    assert cli("compare", "hold", "--html", "out.html").returncode == 1
    with browser() as tab:
        open_page(tab, tmp_path / "out.html")
        title = tab.locator("h1").inner_text()
        assert "Until the first touch" in title
        assert "contact takes > 99.9 % of it away*" in title.replace("\u00a0", " ")
        why = tab.locator("#why").inner_text()
        assert "What causes it" in why
        # The part that goes, as a bar: nearly all of it.
        row = tab.locator("#why table").first.locator("tr", has_text="Contact")
        bar, fill = (row.locator(s).first.bounding_box()["width"] for s in (".bar", ".bar i"))
        assert fill > 0.97 * bar
        assert tab.locator("#models details").count() == 1
        assert (tmp_path / "out.html").stat().st_size <= LIMIT
        tab.nothing_wrong()


@pytest.mark.usefixtures("bullet")
def test_the_request_of_the_finding_is_not_needed() -> None:
    """An experiment's sides make a page with nothing but what `sides_of` gives."""
    (one, two), said = sides_of(Request(("droop",), seconds=0.2))
    text = report(compared(compare(one, two), one, two, said=said))
    assert "no model was given" in text
    assert Parsed.of(text).unclosed == []


def test_any_page_can_be_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    """One without runs has no slider and no script; a terminal leaves its details out."""
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
    text = report(page)
    assert Parsed.of(text).unclosed == []
    assert "<script></script>" in text
    for part in ("An origin", "First.", "● ", "&lt;b&gt;", "<li>two</li>", 'data-t="1.500000"'):
        assert part.replace("● ", "●") in text
    assert not page.holds
    terminal.show(page)
    said = capsys.readouterr().out
    assert "DIFFERS" in said
    assert said.rstrip().endswith("✗ It differs.")
    assert "Deep" not in said
    written = markdown(page, lambda _: "")
    assert "## More" in written
    assert "<details><summary>Deep</summary>" in written


class Parsed(HTMLParser):
    """Whether every element is closed, by a parser that is not the browser's."""

    VOID = frozenset({"meta", "link", "input", "br", "path", "line", "rect", "i"})

    def __init__(self) -> None:
        super().__init__()
        self.unclosed: list[str] = []

    @classmethod
    def of(cls, text: str) -> Parsed:
        parser = cls()
        parser.feed(text)
        return parser

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag not in self.VOID:
            self.unclosed.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.VOID:
            assert self.unclosed.pop() == tag
