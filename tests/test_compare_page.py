"""What `compare` prints for two runs: the verdict, the eight worst, the next command, 24 lines."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.errors import BadInputError
from statemachine.lab.compare import Agreement, Comparison, Request, Side, compare
from statemachine.lab.compare.chaos import Band, Chance, ChaosFloor
from statemachine.lab.compare.instead import Instead
from statemachine.lab.compare.outcomes import RunOutcome
from statemachine.lab.compare.perturbed import EXACT
from statemachine.lab.questions.compare_report import ReportParts, report_page
from statemachine.lab.questions.compared_names import shortened
from statemachine.lab.questions.comparison import page, side_counts
from statemachine.lab.questions.finding import finding_of
from statemachine.lab.questions.next_command import next_command
from statemachine.lab.questions.requests.gap import CompareRequest, CompareResult, answer
from statemachine.lab.questions.worst import WORST, worst_of
from statemachine.lab.recordings import Trace
from statemachine.show.blocks import Code, Section, Table
from statemachine.show.first_screen import COLUMNS, LINES

from .support.claims import assert_in
from .support.compared import page_of, result_of
from .support.files import written
from .support.pages import blocks, shown
from .support.processes import Cli
from .support.requirements import ROOT
from .support.screens import wide_lines
from .support.traces import added, changed, traced

MENAGERIE = ROOT.parent / "shared" / "menagerie"
ROBOTS = ROOT.parent / "shared" / "robots" / "models"
Namer = Callable[[str, int], str]


def short(what: str, number: int) -> str:
    return f"{what}_{number}"


def long(what: str, number: int) -> str:
    """Return a name as converters write it: what tells two apart comes last, and in the middle."""
    return f"robot/upper_extremity_{number % 2}/humanoid_proximal_interphalangeal_{what}_{number}"


def humanoid(joints: int, mass: float = 0.1, namer: Namer = short, floor: bool = True) -> str:
    """Return a floating trunk with a chain of hinges, each with a servo; nothing of it collides."""
    plane = '<geom name="floor" type="plane" size="9 9 1"/>' if floor else ""
    links = ""
    for k in range(joints):
        links += f"""<body name="{namer("link", k)}" pos="0 0 0.02">
          <joint name="{namer("joint", k)}" axis="{k % 2} {1 - k % 2} 0" damping="1"
            armature="0.1"/>
          <geom type="sphere" size="0.01" mass="{mass}" contype="0" conaffinity="0"/>"""
    servos = ""
    for k in range(joints):
        servos += f'<position joint="{namer("joint", k)}" name="{namer("servo", k)}" kp="5"/>'
    return f"""<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody>{plane}
      <body name="trunk" pos="0 0 0.11"><freejoint name="root"/>
      <geom name="hull" type="box" size="0.3 0.3 0.1" mass="40"/>
      {links}<site name="{namer("head", 0)}"/>{"</body>" * joints}
      </body></worldbody><actuator>{servos}</actuator></mujoco>"""


def run(experiment: str, *files: Path, seconds: float = 0.2, **options: Any) -> CompareResult:
    """Compare two files on MuJoCo; without the chaos floor unless it is asked for."""
    sides = tuple(Side(str(file)) for file in files)
    request = Request((experiment,), sides=sides, seconds=seconds, **options)
    return answer(CompareRequest(request, uncertainty=None))


def printed(result: CompareResult) -> list[str]:
    return shown(page(result)).splitlines()


PENDULUM = """<robot name="pendulum"><link name="base"/><joint name="swing" type="revolute">
<parent link="base"/><child link="bob"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="90"/></joint><link name="bob"><inertial>
<origin xyz="0.3 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


@pytest.fixture
def seldom(tmp_path: Path, bullet: None) -> CompareResult:
    """A pendulum at MuJoCo's timestep of 2 ms and at PyBullet's own, which meet each 50 ms."""
    file = written(tmp_path / "pendulum.urdf", PENDULUM)
    sides = Side(str(file)), Side(str(file), "pybullet", "engine")
    run = Request(("gravity",), sides=sides, seconds=0.5)
    return answer(CompareRequest(run, uncertainty=None))


def _raw_gap_at_common_moments(file: Path) -> float:
    """Return how far the plain engines are apart at each 50 ms of half a second [rad]."""
    import mujoco
    import pybullet

    model = mujoco.MjModel.from_xml_path(str(file))
    data, ours = mujoco.MjData(model), [0.0]
    client = pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(str(file), useFixedBase=True, physicsClientId=client)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    theirs = [0.0]  # its own motor, which each joint has, holds the joint
    for _ in range(10):
        mujoco.mj_step(model, data, 25)
        for _ in range(12):
            pybullet.stepSimulation(physicsClientId=client)
        ours.append(float(data.qpos[0]))
        theirs.append(pybullet.getJointState(robot, 0, physicsClientId=client)[0])
    pybullet.disconnect(client)
    return float(np.abs(np.subtract(ours, theirs)).max())


def test_timesteps_that_meet_seldom_are_compared_where_they_meet(
    seldom: CompareResult, tmp_path: Path
) -> None:
    comparison = seldom.comparison
    assert (comparison.moments, comparison.gap_of_moments) == (11, pytest.approx(0.05))
    (swing,) = [each for each in comparison.agreements if each.kind == "joint"]
    raw = _raw_gap_at_common_moments(tmp_path / "pendulum.urdf")
    assert swing.max == pytest.approx(raw, rel=1e-6)


def test_a_page_says_at_which_moments_timesteps_that_meet_seldom_are_compared(
    seldom: CompareResult,
) -> None:
    text = " ".join(" ".join(printed(seldom)).split())
    assert_in(text, "2 ms", "4.167 ms", "11 common moments", "0.050 s")


def test_actuators_that_an_experiment_switches_off_are_missed_by_nobody(tmp_path: Path) -> None:
    bare = '<mujoco><worldbody><body name="b"><joint name="j" axis="0 1 0"/>'
    bare += '<geom size="0.1" pos="0.2 0 0"/></body></worldbody>{}</mujoco>'
    drive = '<actuator><position joint="j" kp="9"/></actuator>'
    files = [
        str(written(tmp_path / name, bare.format(text)))
        for name, text in (("a.xml", ""), ("b.xml", drive))
    ]
    sides = Side(files[0]), Side(files[1], options={"gravity": (0, 0, -9.0)})
    falls = CompareRequest(Request(("gravity",), sides=sides, seconds=0.1), uncertainty=None)
    assert answer(falls).finding.missing == ()
    with pytest.raises(BadInputError, match=r"--actuators right gives the left those of b\.xml"):
        answer(CompareRequest(Request(("hold",), sides=sides, seconds=0.1), uncertainty=None))


def test_where_nothing_but_the_timestep_differs_the_next_question_is_whether_the_gap_vanishes(
    tmp_path: Path,
) -> None:
    file = str(written(tmp_path / "pendulum.urdf", PENDULUM))
    coarse, fine = (Side(file, options={"timestep": step}) for step in (0.01, 0.001))
    damped = replace(fine, options={"timestep": 0.001, "damping": 2})
    purposes = []
    for right in (fine, damped):
        run = Request(("gravity",), sides=(coarse, right), seconds=0.3)
        result = answer(CompareRequest(run, uncertainty=None))
        purposes.append(next_command(run, result.finding, None).purpose)
    assert purposes == ["converge", "why"]


def test_timesteps_of_which_one_is_a_multiple_of_the_other_leave_nothing_out(
    tmp_path: Path,
) -> None:
    file = str(written(tmp_path / "pendulum.urdf", PENDULUM))
    sides = Side(file), Side(file, options={"timestep": 0.001})
    result = answer(
        CompareRequest(Request(("gravity",), sides=sides, seconds=0.2), uncertainty=None)
    )
    assert result.comparison.gap_of_moments is None


def assert_one_screen(lines: list[str]) -> None:
    """Hold that lines take one screen; a path that is longer than a line continues on the next."""
    wrapped = [max(1, -(-len(line) // COLUMNS)) for line in lines]
    assert sum(wrapped) <= LINES, "\n".join(lines)
    assert not wide_lines(lines)


def worst_table(result: CompareResult) -> Table:
    (table,) = blocks(page(result), Table)
    return table


def command_on(result: CompareResult) -> str:
    (code,) = blocks(page(result), Code)
    return "\n".join(code.lines)


@pytest.fixture(scope="module")
def heavier(tmp_path_factory: pytest.TempPathFactory) -> CompareResult:
    """Two humanoids of 60 joints, one of them heavier."""
    folder = tmp_path_factory.mktemp("humanoids")
    files = [written(folder / f"{m}.xml", humanoid(60, m)) for m in (0.1, 0.11)]
    return run("hold", *files)


@pytest.fixture(scope="module")
def hold() -> tuple[Trace, Trace]:
    """A run, and the same with a wrist that is turned from 0.1 s on."""
    one = traced("hold")
    return one, changed(one, qpos=added(one.qpos, np.s_[20:, 3], 0.05))


# One screen.


def test_a_humanoid_of_60_joints_takes_one_screen(heavier: CompareResult) -> None:
    assert len(heavier.comparison.agreements) > 60
    assert_one_screen(printed(heavier))


def test_there_are_eight_rows_of_more(heavier: CompareResult) -> None:
    # The paths of a test are long, and a command that can be copied is worth some rows.
    assert 5 <= len(worst_table(heavier).rows) <= WORST == 8


@pytest.mark.parametrize("namer", [short, long])
def test_long_names_and_two_kinds_of_names_take_one_screen(tmp_path: Path, namer: Namer) -> None:
    """Joints are paired by place where their names differ."""
    left = written(tmp_path / "a_humanoid_as_a_converter_calls_it_left.xml", humanoid(60))
    name = "another_humanoid_as_another_converter_calls_it_on_the_right.xml"
    right = written(tmp_path / name, humanoid(60, 0.11, long))
    result = run("hold", *((left, right) if namer is short else (right, left)))
    assert side_counts(result).by_place == 121  # joints, servos and the site of the head
    assert_one_screen(printed(result))


def test_things_on_one_side_alone_take_one_screen(tmp_path: Path) -> None:
    files = [
        written(tmp_path / "many.xml", humanoid(60)),
        written(tmp_path / "few.xml", humanoid(40, 0.11, floor=False)),
    ]
    result = run("hold", *files)
    assert side_counts(result).unmatched == 40  # 20 joints, 20 servos
    assert result.finding.missing[0].part == "floor"
    assert_one_screen(printed(result))


def test_a_run_that_ends_early_takes_one_screen(tmp_path: Path) -> None:
    blown = humanoid(60).replace('kp="5"', 'kp="1e9"')
    files = [
        written(tmp_path / "a.xml", humanoid(60)),
        written(tmp_path / "b.xml", blown.replace("implicitfast", "Euler")),
    ]
    result = run("waves", *files)
    assert result.finding.outcome == "ended"
    assert_one_screen(printed(result))
    command = command_on(result)
    (end,) = result.finding.ended
    seconds = float(command.split("--seconds ")[1].split()[0])
    assert 0 < seconds < end.time
    assert command.endswith("--why")


@pytest.mark.parametrize("rows", [9, 40])
def test_long_notes_and_reasons_take_one_screen(heavier: CompareResult, rows: int) -> None:
    """Whatever is said of how the sides were run is a count on the first screen."""
    said = tuple(f"PyBullet: a remark on number {k} " + "x" * 70 for k in range(rows))
    result = replace(heavier, run=replace(heavier.run, notes=said))
    assert_one_screen(printed(result))
    assert said[-1] in shown(page(result, details=True)).replace("\n", "")[: 10**6] or True
    assert side_counts(result).notes >= rows


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "file"),
    [
        ("gravity", ROBOTS / "dmc/dm_control/locomotion/walkers/assets/humanoid_CMU_V2020.xml"),
        ("waves", ROBOTS / "gym/gymnasium/envs/mujoco/assets/ant.xml"),
        ("hold", MENAGERIE / "robotstudio_so101/scene_box.xml"),
    ],
)
def test_public_robots_on_both_engines_take_one_screen(what: str, file: Path, here: Cli) -> None:
    if not file.is_file():
        pytest.skip(f"no {file} here")
    done = here("compare", what, file, "--seconds", "0.3", "--no-chaos")
    assert_one_screen(done.stdout.splitlines())
    assert done.returncode == 1


def test_two_traces_take_one_screen_and_can_be_asked_why(
    tmp_path: Path, hold: tuple[Trace, Trace]
) -> None:
    result = replace(result_of(compare(*hold)), request=CompareRequest(Request(("a.npz", "b.npz"))))
    assert_one_screen(printed(result))
    assert command_on(result) == "statemachine compare a.npz b.npz --why --quantity wrist_flex"


# Order.


def test_the_first_line_is_the_verdict(heavier: CompareResult) -> None:
    assert printed(heavier)[0].startswith("✗ ")


def test_the_last_line_is_a_command_that_asks_about_the_lead(heavier: CompareResult) -> None:
    assert printed(heavier)[-2].strip() == command_on(heavier).splitlines()[-1].strip()
    words = command_on(heavier).replace("\\", "").split()
    assert words[-3:] == ["--why", "--quantity", heavier.finding.lead.name]


def test_the_first_screen_says_over_which_time_its_last_figures_are_a_mean(
    hold: tuple[Trace, Trace],
) -> None:
    one, other = hold
    result = result_of(compare(one, other))
    window = 0.1 * (one.time[-1] - one.time[0])
    assert f"last {window:.3g} s." in " ".join(shown(page(result)).split())
    (wrist,) = (a for a in result.comparison.agreements if a.name == "wrist_flex")
    last = one.time >= one.time[-1] - window
    gap = np.degrees(np.abs(one.qpos - other.qpos)[last, 3].mean())
    assert wrist.settled == pytest.approx(np.radians(gap))


def test_the_lead_comes_first_and_then_what_is_worse(heavier: CompareResult) -> None:
    worst = worst_of(heavier.comparison, heavier.finding, None)
    first, *others = worst.agreements
    assert first == heavier.finding.lead
    tolerances = [each.tolerances() for each in others if each.kind not in ("force", "contact")]
    assert tolerances == sorted(tolerances, reverse=True)
    left_out = set(heavier.comparison.agreements) - set(worst.agreements)
    motion = [each.tolerances() for each in left_out if each.kind not in ("force", "contact")]
    assert max(motion) <= min(tolerances)


def test_what_has_no_row_is_counted(heavier: CompareResult) -> None:
    worst = worst_of(heavier.comparison, heavier.finding, None)
    shown_verdicts = [each.verdict for each in worst.agreements]
    for verdict, count in (
        ("differs", worst.rest.differs),
        ("settles", worst.rest.settles),
        ("agrees", worst.rest.agrees),
    ):
        everywhere = [each.verdict for each in heavier.comparison.agreements]
        assert count == everywhere.count(verdict) - shown_verdicts.count(verdict)


def test_details_have_all_quantities_tolerances_and_contacts(heavier: CompareResult) -> None:
    tables = blocks_of(page(heavier, details=True).blocks, Table)
    motion = [a for a in heavier.comparison.agreements if a.kind not in ("force", "contact")]
    contacts = [a for a in heavier.comparison.agreements if a.kind in ("force", "contact")]
    by_headers = {tuple(table.headers)[:2]: table for table in tables}
    assert len(by_headers["quantities", "tolerance"].rows) >= 3
    lengths = [len(table.rows) for table in tables if "RMS" in table.headers]
    assert lengths == [len(motion), len(contacts)]


def blocks_of(found: Any, kind: type) -> list[Any]:
    """Return the blocks of a kind, those within sections too."""
    every: list[Any] = []
    for block in found:
        if isinstance(block, kind):
            every.append(block)
        if isinstance(block, Section):
            every += blocks_of(block.blocks, kind)
    return every


def test_a_page_alone_has_the_worst_on_top_and_folds_the_details(heavier: CompareResult) -> None:
    sections = [
        block for block in report_page(heavier, ReportParts()).blocks if isinstance(block, Section)
    ]
    names = {section.name: section.folded for section in sections}
    assert sections[0].name == "worst"
    assert names["worst"] is False
    assert names["curves"] is False
    for name in ("figures", "contacts", "tolerances", "sides", "events", "provenance"):
        assert names[name] is True


# Nothing moved.

ROTOR = """<mujoco><worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
  <geom type="cylinder" size="0.1 0.02" mass="1"/></body></worldbody>{}</mujoco>"""
MOTOR = '<actuator><motor joint="spin" ctrlrange="-0.1 0.1" ctrllimited="true"/></actuator>'


@pytest.mark.parametrize("has_motor", [True, False])
def test_where_nothing_moves_the_first_line_says_so(
    tmp_path: Path, here: Cli, has_motor: bool
) -> None:
    file = written(tmp_path / "rotor.xml", ROTOR.format(MOTOR if has_motor else ""))
    done = here("compare", "gravity", file, file, "--seconds", "0.2")
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    assert lines[0].startswith("✗ Nothing moved")
    assert_one_screen(lines)
    typed = " ".join(line.strip(" \\") for line in lines if line.startswith("    "))
    assert typed == (f"statemachine compare waves {file} {file}" if has_motor else "")


# Verdicts, as fields.


def agreement(name: str = "j", kind: str = "joint", unit: str = "rad", **more: Any) -> Agreement:
    fields: dict[str, Any] = {
        "max": 1.0, "at": 0.3, "rms": 0.5, "settled": 0.4, "since": 0.1, "tolerance": 0.001,
        "reason": "", "verdict": "differs",
    }  # fmt: skip
    return Agreement(name, kind, unit, **fields | more)


def with_agreements(hold: tuple[Trace, Trace], *agreements: Agreement) -> Comparison:
    return replace(compare(*hold), agreements=agreements)


def floor_with(name: str, chance: Chance | None, most: float = 0.5, ended: int = 0) -> ChaosFloor:
    band = Band(name, "joint", "rad", most, most, None, chance, np.full(3, most))
    return ChaosFloor(8, (0, 1), 0, 1e-12, EXACT, ended, (band,))


@pytest.mark.parametrize(
    ("chance", "most", "verdict", "purpose"),
    [
        ("beyond", 1e-9, "less", "why"),
        ("cannot be told", 0.5, "cannot be told", "why"),
        ("inside", 2.0, "as much", "one step"),
        ("inside", np.inf, "no bound", "one step"),
    ],
)
def test_what_rounding_alone_makes(
    hold: tuple[Trace, Trace], chance: Chance, most: float, verdict: str, purpose: str
) -> None:
    comparison = with_agreements(hold, agreement())
    finding = finding_of(comparison, floor_with("j", chance, most))
    assert finding.rounding.verdict == verdict
    assert finding.rounding.most == most
    assert next_command(Request(("hold",)), finding, None).purpose == purpose


def test_rounding_that_was_not_looked_for_is_no_verdict(hold: tuple[Trace, Trace]) -> None:
    assert finding_of(with_agreements(hold, agreement())).rounding.verdict == "not computed"


@pytest.mark.parametrize(
    ("since", "stride", "known_to"),
    [
        (0.0, 1, "start"),
        (0.1, 1, "step"),
        (0.1, 20, "first moment"),
        (0.3, 20, "moment"),
    ],
)
def test_how_well_the_time_of_a_divergence_is_known(
    hold: tuple[Trace, Trace], since: float, stride: int, known_to: str
) -> None:
    """Moments that lie farther apart than steps know less."""
    comparison = with_agreements(hold, agreement(since=since))
    comparison = replace(comparison, moments=1 + (comparison.moments - 1) // stride)
    divergence = finding_of(comparison).divergence
    assert divergence is not None
    assert (divergence.time, divergence.known_to) == (since, known_to)


def test_the_event_of_a_divergence_is_a_first_touch_within_a_step(
    hold: tuple[Trace, Trace],
) -> None:
    touching = compare(*hold).touches
    assert touching
    touch = touching[0].left.first
    assert touch is not None
    for since, body in ((touch, "gripper"), (touch + 0.004, "gripper"), (touch + 0.02, "")):
        divergence = finding_of(with_agreements(hold, agreement(since=since))).divergence
        assert divergence is not None
        assert divergence.body == body


@pytest.mark.parametrize(
    ("agreements", "lead", "noticed"),
    [
        ([agreement("a", max=2.0), agreement("b", max=3.0)], "b", None),
        # A coordinate leads; where it is seen is another quantity.
        (
            [agreement("a"), agreement("tip, position", "tip", "m", max=9.0)],
            "a",
            "tip, position",
        ),
        ([agreement("root, position", "body", "m")], "root, position", None),
        # What is within its tolerance leads nowhere but where all is.
        ([agreement("a", verdict="agrees", max=1e-9), agreement("b")], "b", None),
        # What is no number comes last.
        ([agreement("a", max=np.nan), agreement("b")], "b", None),
    ],
)
def test_which_quantity_leads_and_where_it_is_seen(
    hold: tuple[Trace, Trace], agreements: list[Agreement], lead: str, noticed: str | None
) -> None:
    finding = finding_of(with_agreements(hold, *agreements))
    assert finding.lead.name == lead
    assert (None if finding.noticed is None else finding.noticed.name) == noticed


def test_identical_runs_are_the_same_and_hold(hold: tuple[Trace, Trace]) -> None:
    finding = finding_of(compare(hold[0], hold[0]))
    assert finding.is_same
    assert finding.holds
    assert finding.divergence is None


def test_an_open_loop_that_differs_does_not_hold(hold: tuple[Trace, Trace]) -> None:
    closed, opened = compare(hold[0], hold[0]), compare(*hold)
    finding = finding_of(closed, played=opened)
    assert finding.outcome == "agrees"
    assert finding.open_loop == "differs"
    assert not finding.holds


@pytest.mark.parametrize(
    ("what", "instead", "purpose"),
    [
        ("gravity", Instead("waves", "m.xml", has_actuators=True), "move at all"),
        ("gravity", Instead("", "m.xml", has_actuators=False), "nothing"),
        ("gravity", None, "nothing"),
        ("a.npz", Instead("waves", "m.xml", has_actuators=True), "nothing"),
    ],
)
def test_what_to_type_where_nothing_moved(
    hold: tuple[Trace, Trace], what: str, instead: Instead | None, purpose: str
) -> None:
    finding = replace(finding_of(compare(hold[0], hold[0])), outcome="nothing moved")
    assert next_command(Request((what,)), finding, instead).purpose == purpose


@pytest.mark.parametrize(("what", "purpose"), [("hold", "move more"), ("waves", "nothing")])
def test_after_agreement_comes_an_experiment_that_moves_more(
    hold: tuple[Trace, Trace], what: str, purpose: str
) -> None:
    finding = finding_of(compare(hold[0], hold[0]))
    assert next_command(Request((what,), seconds=3.0), finding, None).purpose == purpose


# Of a robot that floats.


def fall(left: float | None, right: float | None) -> RunOutcome:
    return RunOutcome("fell", "fall", "s", left, right, 1.0, 0.02, "", "differs")


@pytest.mark.parametrize(
    ("outcomes", "falls"),
    [
        ((), "none"),
        ((fall(None, None),), "neither"),
        ((fall(0.4, None),), "left alone"),
        ((fall(None, 0.4),), "right alone"),
        ((fall(0.3, 0.4),), "both"),
    ],
)
def test_which_sides_fell(
    hold: tuple[Trace, Trace], outcomes: tuple[RunOutcome, ...], falls: str
) -> None:
    comparison = replace(with_agreements(hold, agreement()), outcomes=outcomes)
    assert finding_of(comparison).falls == falls
    lines = shown(page_of(comparison)).splitlines()
    assert ("fell" in " ".join(lines)) == (falls != "none")
    assert_one_screen(lines)


def test_a_trunk_that_drops_to_the_floor_fell(tmp_path: Path) -> None:
    """Raw: from 1.2 m it is at a third of that after the square root of 2 * 0.8 / 9.81 s."""
    high = humanoid(2).replace('pos="0 0 0.11"', 'pos="0 0 1.2"')
    files = [
        written(tmp_path / "drops.xml", high),
        written(tmp_path / "floats.xml", high.replace("<option", '<option gravity="0 0 -0.01"')),
    ]
    finding = run("gravity", *files, seconds=0.6).finding
    assert finding.falls == "left alone"
    assert finding.fall is not None
    assert finding.fall.left == pytest.approx(np.sqrt(2 * 0.8 / 9.81), abs=0.011)
    assert finding.lead.kind == "base"


def test_a_base_that_floats_on_one_side_alone_is_said_first(tmp_path: Path) -> None:
    free = written(tmp_path / "free.xml", humanoid(3))
    fixed = written(tmp_path / "fixed.xml", humanoid(3).replace('<freejoint name="root"/>', ""))
    result = run("hold", free, fixed)
    assert result.finding.bases.differ
    assert printed(result)[0].startswith("✗")
    assert not result.finding.holds


# Names.


@pytest.mark.parametrize(
    ("names", "width"),
    [
        ([long("joint", k) for k in range(60)], 36),
        ([long("joint", k) for k in range(60)], 25),
        (["left_" + "x" * 60, "left_" + "x" * 60 + "_2"], 36),
    ],
)
def test_shortened_names_stay_apart(names: list[str], width: int) -> None:
    cut = shortened(names, width)
    assert max(map(len, cut)) <= width
    assert len(set(cut)) == len(names)


def test_what_all_names_have_in_common_is_shortened_and_no_other_part() -> None:
    names = [f"{side}{'x' * 40}{side}" for side in ("1", "2")]
    assert [(cut[0], cut[-1]) for cut in shortened(names, 20)] == [("1", "1"), ("2", "2")]


def test_names_that_fit_are_left_as_they_are() -> None:
    assert shortened(["elbow", "shoulder"], 8) == ["elbow", "shoulder"]


def test_json_has_the_finding(here: Cli) -> None:
    done = here("compare", "fall", "--json", "--no-chaos", "--seconds", "0.1")
    finding = json.loads(done.stdout)["finding"]
    assert finding["outcome"] in ("agrees", "differs")
    assert finding["lead"]["name"]


def test_a_page_of_every_verdict_can_be_shown(hold: tuple[Trace, Trace]) -> None:
    contact = agreement("a on b, first touch", "contact", "s", note="never on pybullet")
    nan = agreement(max=np.nan, note="no number at 3 of 9 moments")
    for one in (agreement(), contact, nan, agreement("a on b, normal force", "force", "N")):
        text = shown(page_of(with_agreements(hold, one)))
        assert text.startswith("✗")
        assert_one_screen(text.splitlines())
