"""One step, finer steps, releases and two files: the verdict first, on one screen of a terminal."""

from __future__ import annotations

import argparse
import re
import shlex
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from statemachine.cli.compare.options import add
from statemachine.cli.compare.requests import request_of
from statemachine.engines.description.file_changes import UnwrittenChange
from statemachine.engines.records import KnownChange
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.model_differences import ModelsComparison, compare
from statemachine.lab.model_differences.page import page as models_page
from statemachine.lab.model_differences.page import weightiest
from statemachine.lab.questions.convergence import page as converge_page
from statemachine.lab.questions.one_step import page as one_step_page
from statemachine.lab.questions.requests import converge, gap, models, one_step
from statemachine.lab.questions.requests.versions import (
    ReleasePair,
    VersionsRequest,
    VersionsResult,
)
from statemachine.lab.questions.versions import page as versions_page
from statemachine.lab.shown_result import ShownResult
from statemachine.show.blocks import Code, Page, Table
from statemachine.show.first_screen import LINES, first_screen, lines_of

from .support.files import written
from .support.pages import blocks, shown
from .support.requirements import SHARED, shared

LINK = """<body name="{name}" pos="0.1 0 0"><joint name="{name}_abduction_joint" axis="0 1 0"
 damping="{damping}" range="-2 2" limited="true"/>
 <inertial mass="{mass}" pos="0.05 0 0" diaginertia="0.001 0.002 0.003"/>{inner}</body>"""
CHAIN = """<mujoco><option timestep="0.004"/><worldbody>{links}</worldbody><actuator>{drives}
</actuator></mujoco>"""
DRIVE = '<position name="{name}_drive" joint="{name}_abduction_joint" kp="{kp}" kv="0.3"/>'
NAMES = [f"the_left_front_leg_of_the_robot_number_{k}" for k in range(12)]


def chain(damping: float = 0.1, mass: float = 0.2, kp: float = 5.0) -> str:
    """Return a chain of twelve links with long names."""
    inner = ""
    for k, name in enumerate(reversed(NAMES)):
        inner = LINK.format(
            name=name, damping=damping * (1 + k / 10), mass=mass * (1 + k / 20), inner=inner
        )
    drives = "".join(DRIVE.format(name=name, kp=kp) for name in NAMES)
    return CHAIN.format(links=inner, drives=drives)


@pytest.fixture
def chains(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    """Two files of a robot with long names, whose every link and joint differs."""
    monkeypatch.chdir(tmp_path)
    left, right = "left_with_a_rather_long_name.xml", "right_with_a_rather_long_name.xml"
    written(tmp_path / left, chain())
    written(tmp_path / right, chain(0.3, 0.25, kp=7.0))
    return left, right


def run_of(chains: tuple[str, str], seconds: float = 0.1) -> Request:
    sides = Side(chains[0]), Side(chains[1])
    return Request(("waves",), sides=sides, seconds=seconds)


@pytest.fixture(params=["one step", "converge", "versions", "models"])
def result(request: pytest.FixtureRequest, chains: tuple[str, str]) -> ShownResult:
    """The answer of a question of two robots whose every element differs."""
    run = run_of(chains)
    match request.param:
        case "one step":
            return one_step.answer(one_step.OneStepRequest(run))
        case "converge":
            return converge.answer(converge.ConvergeRequest(run))
        case "models":
            return models.answer(models.ModelsRequest(chains))
    return releases_of(run, chains[0])


def releases_of(run: Request, model: str) -> VersionsResult:
    """Return ten pairs of releases; what is compared stands for what they do."""
    comparison = gap.answer(gap.CompareRequest(run, uncertainty=None)).comparison
    change = KnownChange("kv of a limited servo", "implicitfast", 1.0, 0.0, tuple(NAMES))
    pairs: list[ReleasePair] = []
    for k in range(10):
        backends = f"mujoco==3.{k}.0", f"mujoco==3.{k + 1}.0"
        pairs.append(ReleasePair(f"3.{k}.0", f"3.{k + 1}.0", backends, comparison, (change,)))
    asked = VersionsRequest(Request(("waves",), model=model), "3.0.0")
    return VersionsResult(asked, tuple(pairs))


def test_a_page_takes_one_screen(result: ShownResult) -> None:
    text = shown(result.page())
    assert len(text.splitlines()) <= LINES == 24
    assert max(map(len, text.splitlines())) <= 80


def test_its_verdict_comes_first_and_the_next_command_last(result: ShownResult) -> None:
    page = result.page()
    assert page.headline is not None
    assert shown(page).startswith("✗ ")
    assert isinstance(page.blocks[-1], Code)


def test_two_files_of_which_one_is_written_take_one_screen(
    chains: tuple[str, str],
) -> None:
    request = models.ModelsRequest(chains, write="fixed.xml")
    result = models.answer(request)
    assert result.rewritten is not None
    assert len(result.rewritten.written) == 36
    assert lines_of(result.page()) <= LINES
    refusals = tuple(UnwrittenChange(f"cause {k}", "of a reason " * 5) for k in range(20))
    refused = replace(result.rewritten, not_written=refusals)
    assert lines_of(replace(result, rewritten=refused).page()) <= LINES


def test_details_have_more(result: ShownResult) -> None:
    short, everything = result.page(), result.page(details=True)
    assert sum(len(table.rows) for table in blocks(everything, Table)) > sum(
        len(table.rows) for table in blocks(short, Table)
    )
    assert everything.headline == short.headline


def test_the_next_command_can_be_typed(result: ShownResult) -> None:
    (code, *_) = blocks(result.page(), Code)
    words = shlex.split("\n".join(code.lines).replace("\\\n", " "))
    assert "..." not in words
    options = argparse.ArgumentParser()
    add(options)
    assert request_of(options.parse_args(words[2:]))


def test_a_screen_has_as_many_rows_as_fit() -> None:
    def page_with(rows: int) -> Page:
        return Page("title", "origin", [Code(["line"] * 3 * rows)])

    chosen = first_screen(page_with, 20)
    (code,) = blocks(chosen, Code)
    assert lines_of(chosen) <= LINES < lines_of(page_with(len(code.lines) // 3 + 1))
    assert len(blocks(first_screen(page_with, 0), Code)) == 1


# Two files.


def test_the_weightiest_difference_comes_first_whatever_its_subject(
    chains: tuple[str, str],
) -> None:
    result = compare(*chains)
    shares = [group.first.share for group in weightiest(result)]
    assert shares == pytest.approx(sorted(shares, reverse=True), rel=1e-6)
    acting = [row for row in result.differences if row.matters]
    assert sum(len(group.rows) for group in weightiest(result)) == len(acting)


def test_every_acting_difference_has_a_row_of_the_details(chains: tuple[str, str]) -> None:
    result = compare(*chains)
    acting = [row for row in result.differences if row.matters]
    tables = blocks(models_page(result, details=True), Table)
    rows = sum(len(table.rows) for table in tables if table.headers[0] == "figure")
    assert rows == len(acting)


URDF = """<robot name="r"><link name="base"/>
<link name="tip">
  <inertial><origin xyz="0 0 {com}"/><mass value="{mass}"/>
  <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="{upper}" effort="9" velocity="1"/>
  <dynamics damping="{damping}"/></joint>
</robot>"""
MJCF = """<mujoco><compiler angle="radian"/><worldbody><body name="base"><body name="tip">
  <joint name="j" axis="0 1 0" damping="{damping}" range="-1 {upper}" limited="true"/>
  <inertial pos="0 0 {com}" mass="{mass}" diaginertia="0.02 0.03 0.04"/>
</body></body></worldbody></mujoco>"""
LEFT = {"com": "0.12345678901", "mass": "1.23456789", "upper": "1.1", "damping": "0.31"}
RIGHT = {"com": "0.1", "mass": "1", "upper": "1", "damping": "0.2"}


def changed_text(result: ModelsComparison, text: str) -> str:
    """Return a text with each attribute changed on the line that is named."""
    lines = text.splitlines()
    for change in dict.fromkeys(change.attributes for change in result.changes):
        for attribute in change:
            line = lines[attribute.line - 1]
            assert line.count(attribute.old_text) == 1, (attribute, line)
            lines[attribute.line - 1] = line.replace(attribute.old_text, attribute.new_text)
    return "\n".join(lines)


@pytest.mark.parametrize(("suffix", "text"), [("urdf", URDF), ("xml", MJCF)])
def test_what_to_change_makes_the_file_that_of_the_left(
    tmp_path: Path, suffix: str, text: str
) -> None:
    left = written(tmp_path / f"left.{suffix}", text.format(**LEFT))
    right = written(tmp_path / f"right.{suffix}", text.format(**RIGHT))
    result = compare(left, right)
    assert {each.file for c in result.changes for each in c.attributes} == {right.name}
    changed = mujoco.MjModel.from_xml_string(changed_text(result, text.format(**RIGHT)))
    wanted = mujoco.MjModel.from_xml_path(str(left))
    for field in ("body_mass", "body_ipos", "body_inertia", "jnt_range", "dof_damping"):
        assert np.array_equal(getattr(changed, field), getattr(wanted, field)), field


def test_numbers_that_are_to_be_typed_are_written_in_full(tmp_path: Path) -> None:
    left = written(tmp_path / "left.urdf", URDF.format(**LEFT))
    right = written(tmp_path / "right.urdf", URDF.format(**RIGHT))
    text = shown(models_page(compare(left, right), details=True))
    assert LEFT["com"] in text
    assert LEFT["mass"] in text


SENSORS = "<sensor>{sensors}</sensor></mujoco>"
SENSOR = '<jointpos name="s{k}" joint="j" noise="{noise}"/>'


def test_sensors_and_what_is_drawn_are_one_count(tmp_path: Path) -> None:
    texts: list[str] = []
    for noise in (0, 1):
        drawn = "".join(
            f'<geom name="v{k}" type="box" size="{0.1 + noise / 9} 1 1" contype="0"'
            f' conaffinity="0" group="2" mass="0"/>'
            for k in range(20)
        )
        sensors = "".join(SENSOR.format(k=k, noise=noise) for k in range(20))
        text = MJCF.format(**LEFT).replace("<inertial", f"{drawn}<inertial")
        texts.append(text.replace("</mujoco>", SENSORS.format(sensors=sensors)))
    left, right = (written(tmp_path / f"{k}.xml", text) for k, text in enumerate(texts))
    result = compare(left, right)
    idle = {row.subject for row in result.differences if not row.matters}
    (table,) = [
        table
        for table in blocks(models_page(result, details=True), Table)
        if table.headers[0] == "subject" and "differ" in table.headers
    ]
    assert len(table.rows) == len(idle) <= 2
    assert not any(row.matters for row in result.differences)


def test_each_joint_that_is_paired_by_its_place_is_one_row(chains: tuple[str, str]) -> None:
    right = Path(chains[1])
    right.write_text(right.read_text().replace("_abduction_joint", "_a"))
    result = compare(*chains)
    assert [pair.kind for pair in result.renamed].count("joint") == len(NAMES)
    assert not any("is taken for" in note for note in result.notes)
    tables = blocks(models_page(result, details=True), Table)
    (table,) = [table for table in tables if table.headers[0] == "kind"]
    assert len(table.rows) == len(result.renamed)


# Robots that others made.

ROBOTS = SHARED / "robots" / "models"
SUITE, ASSETS = "dmc/dm_control/suite", "gym/gymnasium/envs/mujoco/assets"
PAIRS = [
    (f"{SUITE}/humanoid.xml", "bullet/examples/pybullet/gym/pybullet_data/mjcf/humanoid.xml"),
    (f"{ASSETS}/ant.xml", "dmc/dm_control/third_party/ant/ant.xml"),
    (f"{ASSETS}/hopper.xml", f"{ASSETS}/walker2d_v5.xml"),
    (f"{SUITE}/cheetah.xml", f"{SUITE}/fish.xml"),
]


@pytest.mark.parametrize("pair", PAIRS)
def test_two_public_robots_take_one_screen(pair: tuple[str, str]) -> None:
    left, right = (shared(ROBOTS / name) for name in pair)
    page = models_page(compare(left, right))
    assert lines_of(page) <= LINES
    assert not page.holds


@pytest.mark.slow
@pytest.mark.parametrize("question", ["one step", "converge"])
def test_two_public_humanoids_take_one_screen(question: str) -> None:
    file = shared(ROBOTS / PAIRS[0][0])
    sides = Side(str(file)), Side(str(file), options={"damping": 3.0})
    run = Request(("fall",), sides=sides, seconds=0.05)
    if question == "one step":
        page = one_step_page(one_step.answer(one_step.OneStepRequest(run)))
    else:
        page = converge_page(converge.answer(converge.ConvergeRequest(run)))
    assert lines_of(page) <= LINES


# Releases.


def test_pairs_of_releases_that_change_it_come_first(chains: tuple[str, str]) -> None:
    several = releases_of(run_of(chains), chains[0])
    agrees = gap.answer(
        gap.CompareRequest(replace(run_of(chains), sides=(Side(chains[0]),) * 2), uncertainty=None)
    ).comparison
    pairs = [replace(pair, comparison=agrees, changes=()) for pair in several.pairs]
    pairs[7] = several.pairs[7]
    result = replace(several, pairs=tuple(pairs))
    (table,) = blocks(versions_page(result), Table)
    assert table.rows[0][:2] == ["3.7.0", "3.8.0"]
    (code,) = blocks(versions_page(result), Code)
    assert re.search(r"@mujoco==3\.7\.0.*@mujoco==3\.8\.0", " ".join(code.lines))
