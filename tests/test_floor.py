"""The chaos floor: how far a side gets from itself, and what of a gap lies inside that."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, EndedEarlyError, EngineWarning
from statemachine.lab.compare import Uncertainty, chaos_floor, compare, perturbed_runs
from statemachine.lab.compare.chaos import Band
from statemachine.lab.compare.convergence import Convergence, convergence, verdict_of
from statemachine.lab.compare.matching import match_models
from statemachine.lab.compare.perturbed import RUNS, parse_uncertainty
from statemachine.lab.compare.sides import Request
from statemachine.lab.questions.convergence import page
from statemachine.lab.questions.finding import finding_of, leading
from statemachine.lab.questions.requests.converge import ConvergeRequest, ConvergeResult
from statemachine.lab.recordings import Rerun, Trace, record
from statemachine.lab.why.gap import Ruler
from statemachine.show.blocks import Code

from .support.claims import assert_in, refused
from .support.compared import page_of as compared_page
from .support.files import written
from .support.pages import blocks, shown
from .support.processes import Cli
from .support.small_models import (
    BAR_OUTSIDE,
    DOUBLE_PENDULUM,
    FALLING_BAR,
    PENDULUM,
    TILTED_BOX,
    model_of,
)


def rerun(model: sm.Model, seconds: float, **start: Any) -> Rerun:
    return Rerun(model, lambda _: None, seconds, **start)


def band_of(run: Rerun, name: str, two: Trace | None = None, **how: Any) -> Band:
    """Return the floor of one quantity of a run, against itself or one that was recorded."""
    one = run.record()
    floor = chaos_floor(compare(one, two or one), (run, None), **how)
    (band,) = [band for band in floor.bands if band.name == name]
    return band


def test_a_damped_pendulum_that_hangs_has_a_floor_at_rounding(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, PENDULUM), 5.0, qpos=np.array([0.3]))
    band = band_of(run, "swing")
    assert 0 < band.most < 5 * run.model.capabilities.rounding
    assert band.end < band.most


@pytest.mark.slow
def test_the_floor_of_a_double_pendulum_grows(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 20.0, qpos=np.array([2.5, 1.0]))
    band = band_of(run, "lower")
    assert band.width[0] < 1e-9
    assert band.end > 1e4 * band.width[0]


def test_the_floor_of_a_box_that_lands_on_an_edge_grows_with_the_impact(tmp_path: Path) -> None:
    tilt = np.array([0.0, 0.0, 0.4, np.cos(0.6), np.sin(0.6) * 0.8, np.sin(0.6) * 0.6, 0.0])
    band = band_of(rerun(model_of(tmp_path, TILTED_BOX), 1.0, qpos=tilt), "box, rotation")
    assert band.most > 20 * band.width[:75].max()  # of 0.15 s


def test_identical_sides_are_inside_all_the_time(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 2.0, qpos=np.array([2.5, 1.0]))
    comparison = compare(*[run.record()] * 2)
    floor = chaos_floor(comparison, (run, run))
    assert {band.inside_from for band in floor.bands} == {0.0}
    assert {band.chance for band in floor.bands} == {None}


@pytest.mark.slow
def test_a_gap_of_chaos_alone_is_told_from_one_that_was_made(tmp_path: Path) -> None:
    # For 15 s a difference grows by the same factor, whatever its size; later the pendulums are as
    # far apart as they can be, and last bits say which pair is farther.
    seconds = 15.0
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), seconds, qpos=np.array([2.5, 1.0]))
    # Two that differ by rounding part as the floor does; one that is heavier is apart before.
    chance = rerun(run.model, seconds, qpos=np.array([2.5 + 1e-13, 1.0])).record()
    text = DOUBLE_PENDULUM.replace('size="0.02"', 'size="0.025"', 1)
    heavier = model_of(tmp_path, text, "heavier.xml")
    made = rerun(heavier, seconds, qpos=np.array([2.5, 1.0])).record()
    bands = [band_of(run, "lower", two) for two in (chance, made)]
    assert [band.chance for band in bands] == ["inside", "beyond"]


def swapped_pair(folder: Path, seconds: float) -> tuple[Rerun, Rerun]:
    """Return a double pendulum that swings without damping, and one that comes to rest."""
    start = np.array([2.9, 0.3])
    damped = DOUBLE_PENDULUM.replace("<joint ", '<joint damping="0.1" ')
    assert damped != DOUBLE_PENDULUM
    models = model_of(folder, damped, "damped.xml"), model_of(folder, DOUBLE_PENDULUM, "free.xml")
    one, two = (rerun(model, seconds, qpos=start) for model in models)
    return one, two


@pytest.mark.slow
def test_the_floor_is_the_largest_of_both_sides_and_swapping_them_changes_nothing(
    tmp_path: Path,
) -> None:
    calm, chaotic = swapped_pair(tmp_path, 12.0)
    comparison = compare(calm.record(), chaotic.record())
    both = chaos_floor(comparison, (calm, chaotic))
    swapped = chaos_floor(compare(chaotic.record(), calm.record()), (chaotic, calm))
    for band, other in zip(both.bands, swapped.bands, strict=True):
        assert (band.name, band.chance, band.most) == (other.name, other.chance, other.most)
        np.testing.assert_array_equal(band.width, other.width)
    ours, theirs = (
        {band.name: band.most for band in chaos_floor(comparison, one).bands}
        for one in ((calm, None), (None, chaotic))
    )
    assert ours["lower"] < 1e-9
    assert theirs["lower"] > 1e-3
    assert {band.name: band.most for band in both.bands} == theirs


SLEEPER = """
<mujoco>
  <option><flag sleep="enable"/></option>
  <worldbody>
    <body name="sleeper" pos="0 0 3" sleep="init"><freejoint/><geom size="0.1" mass="1"/></body>
    <body pos="2 0 1"><joint name="swing" type="hinge" axis="0 1 0"/>
      <geom pos="0 0 -0.5" size="0.1" mass="{mass}"/></body>
  </worldbody>
</mujoco>
"""


def test_forks_give_the_floor_that_one_process_gives(tmp_path: Path) -> None:
    calm, chaotic = swapped_pair(tmp_path, 0.2)
    comparison = compare(calm.record(), chaotic.record())
    widths = [
        [band.width for band in chaos_floor(comparison, (calm, chaotic), runs=2, jobs=jobs).bands]
        for jobs in (1, 2)
    ]
    one, two = widths
    np.testing.assert_array_equal(one, two)


@pytest.mark.slow
def test_no_seed_turns_inside_into_beyond(tmp_path: Path) -> None:
    """Starts that differ by less than the draws, and by about twice as much."""
    start = np.array([2.5, 1.0])
    model = model_of(tmp_path, DOUBLE_PENDULUM).replace(timestep=0.01, integrator="implicit")
    run = rerun(model, 20.0, qpos=start)
    met = set()
    for off in (1e-13, 2e-12):
        comparison = compare(run.record(), rerun(model, 20.0, qpos=start + off).record())
        found: dict[str, set[str | None]] = {}
        for seed in range(7):
            for band in chaos_floor(comparison, (run, None), seed=seed).bands:
                found.setdefault(band.name, set()).add(band.chance)
        for chances in found.values():
            assert not {"inside", "beyond"} <= chances
            met |= chances
    assert "inside" in met


def test_a_perturbed_start_wakes_no_body(tmp_path: Path) -> None:
    """One that sleeps from the start hangs in the air; awake it falls 4.9 m in this second."""
    runs = []
    for name, mass in (("one", 1.0), ("two", 2.0)):
        text = SLEEPER.format(mass=mass)
        runs.append(rerun(model_of(tmp_path, text, f"{name}.xml"), 1.0))
    left, right = (run.record() for run in runs)
    floor = chaos_floor(compare(left, right), runs, runs=2)
    widths = {band.name: band.most for band in floor.bands}
    assert widths["sleeper, position"] < 1e-6  # mm


def test_a_gap_within_its_tolerance_agrees_whatever_the_floor(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 0.05, qpos=np.array([2.5, 1.0]))
    near = rerun(run.model, 0.05, qpos=np.array([2.5 + 1e-9, 1.0]))
    comparison = compare(run.record(), near.record())
    floor = chaos_floor(comparison, (run, near), uncertain=Uncertainty(0.0, 0.5))
    assert comparison.agrees
    assert compared_page(comparison, floor=floor).holds
    assert {band.chance for band in floor.bands} == {None}


def test_what_may_be_chance_is_not_what_leads(tmp_path: Path) -> None:
    """A quantity inside the floor is named only where no other is beyond it."""
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 1.0, qpos=np.array([2.5, 1.0]))
    near = rerun(run.model, 1.0, qpos=np.array([2.5, 1.1]))
    comparison = compare(run.record(), near.record())
    first = leading(comparison)
    floor = chaos_floor(comparison, (run, near), runs=1)
    bands = [replace(b, chance="inside") if b.name == first.name else b for b in floor.bands]
    assert leading(comparison, replace(floor, bands=tuple(bands))).name != first.name
    everywhere = replace(floor, bands=tuple(replace(b, chance="inside") for b in bands))
    finding = finding_of(comparison, everywhere)
    assert finding.rounding.verdict == "as much"
    assert not finding.holds


def test_the_band_is_wide_about_a_moment_and_forgets_it_later(tmp_path: Path) -> None:
    """A running maximum would not fall, and one moment alone would dip at each crossing."""
    run = rerun(model_of(tmp_path, PENDULUM), 5.0, qpos=np.array([1.0]))
    band = band_of(run, "swing", uncertain=Uncertainty(0.0, 0.01))
    assert band.width.min() > 0
    assert band.end < 0.2 * band.most
    # The difference oscillates: at a moment alone it is next to zero again and again.
    assert band.width[:200].min() > 0.2 * band.most


def test_quaternions_of_perturbed_starts_stay_unit(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, TILTED_BOX), 0.01)
    for trace in perturbed_runs(run, uncertain=Uncertainty(1e-4, 0.01), derive=False):
        start = trace.qpos[0]
        assert np.linalg.norm(start[3:]) == pytest.approx(1.0, abs=1e-15)
        assert 2 * np.arccos(start[3]) == pytest.approx(0.01, rel=1e-6)
        assert np.linalg.norm(start[:3] - [0, 0, 0.4]) == pytest.approx(1e-4, rel=1e-6)


def test_a_seed_gives_the_same_runs_again_and_another_gives_others(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 0.1)
    one, again, other = (
        [trace.qpos[0].tobytes() for trace in perturbed_runs(run, seed=seed, derive=False)]
        for seed in (0, 0, 1)
    )
    assert one == again
    assert len({*one, *other}) == 2 * RUNS


def test_a_command_that_stays_as_it_is_does_not_wander() -> None:
    run = Rerun(sm.load("so101"), lambda _: lambda _model, data: None, 0.1)
    for trace in perturbed_runs(run, runs=1, derive=False):
        assert (trace.ctrl == trace.ctrl[0]).all()
        assert 0 < np.abs(trace.ctrl[0]).max() <= run.model.capabilities.rounding


def test_the_ruler_of_causes_has_a_floor_too(tmp_path: Path) -> None:
    run = rerun(model_of(tmp_path, DOUBLE_PENDULUM), 2.0, qpos=np.array([2.5, 1.0]))
    trace = run.record(derived="nothing")
    ruler = Ruler(match_models(run.model, run.model), trace, trace)
    curves: Any = ruler.curves(trace)
    again = [*map(ruler.curves, perturbed_runs(run, derive=False))]
    assert 0 < ruler.floor(curves, again, "worst")["joints"] < 1e-9
    assert ruler.units["joints"] == "rad"


@pytest.mark.parametrize("word", ["0.1", "mm", "-1mm", "0deg", "1furlong", "nanmm"])
def test_what_is_no_uncertainty_is_refused(word: str) -> None:
    refused((BadInputError, "reads like", lambda: parse_uncertainty([word])))


def test_uncertainties_are_read_in_their_units() -> None:
    size = parse_uncertainty(["0.1mm", "0.5deg"])
    assert (size.length, size.angle) == pytest.approx((1e-4, np.radians(0.5)))
    refused((BadInputError, "twice", lambda: parse_uncertainty(["1mm", "2cm"])))


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_command_line_shows_the_floor(here: Cli) -> None:
    asked = ("compare", "hold", "--seconds", "0.4")
    assert json.loads(here(*asked, "--json").stdout)["floor"]["runs"] == RUNS
    assert "chaos" not in here(*asked, "--no-chaos", "--details").stdout
    # Where it is above a tolerance it stands in the table, quantity by quantity.
    assert re.search("the end +verdict\n", here(*asked).stdout)
    assert re.search("rounding +verdict\n", here(*asked, "--uncertainty", "5deg").stdout)


def test_a_trace_has_a_floor_where_it_is_played_on_two_sides(here: Cli, tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    here("trace", "record", "droop", "--seconds", "0.2", "-o", file)
    assert "chaos" not in here("compare", file, file, "--details").stdout
    sides = ("so101/scene", "so101/scene", "damping=0.7")
    assert "chaos floor" in here("compare", file, *sides, "--details").stdout


# What vanishes with the timestep


def found_of(folder: Path, *changes: dict[str, str], seconds: float = 1.0) -> Convergence:
    usual = {"integrator": "implicitfast", "flag": "", "mass": "0.1", "height": "0.3"}
    usual["touch"] = 'contype="0" conaffinity="0"'
    one, two = (model_of(folder, FALLING_BAR.format(**usual | change)) for change in changes)
    return convergence_of(one, two, seconds)


def asked(found: Convergence, what: str) -> ConvergeResult:
    """Return the same as a Result, of which a page can be made."""
    return ConvergeResult(**vars(found), request=ConvergeRequest(Request((what,))))


def convergence_of(one: sm.Model, two: sm.Model, seconds: float) -> Convergence:
    """Return what becomes of the gap of two Models with finer steps."""
    return convergence(
        lambda finer: (
            record(one.replace(substeps=finer), None, seconds),
            record(two.replace(substeps=finer), None, seconds),
        )
    )


@pytest.fixture
def two_dampings(tmp_path: Path) -> Convergence:
    """Explicit against implicit damping, with finer steps."""
    explicit = {"integrator": "Euler", "flag": '<flag eulerdamp="disable"/>'}
    return found_of(tmp_path, {}, explicit)


def test_a_gap_of_explicit_damping_halves_with_the_step(two_dampings: Convergence) -> None:
    """A method of the first order."""
    (joint,) = [each for each in two_dampings.whole_run if each.kind == "joint"]
    assert joint.verdict == "discretisation"
    assert joint.gaps[0] > 1e-3
    assert [joint.gaps[k] / joint.gaps[k + 1] for k in (0, 1)] == pytest.approx([2, 2], rel=0.1)


def test_a_gap_of_explicit_damping_vanishes_and_the_page_holds(two_dampings: Convergence) -> None:
    assert (two_dampings.vanishes, two_dampings.state) == (True, "vanishes")
    assert page(asked(two_dampings, "fall")).holds


@pytest.mark.parametrize(
    ("left", "right", "verdict"), [("RK4", "Euler", "discretisation"), ("RK4", "RK4", "rounding")]
)
def test_another_order_of_integration_is_discretisation_and_one_side_twice_no_gap(
    tmp_path: Path, left: str, right: str, verdict: str
) -> None:
    found = found_of(tmp_path, {"integrator": left}, {"integrator": right})
    assert {each.verdict for each in (*found.whole_run, *found.before_touch)} == {verdict}
    assert found.state == {"discretisation": "vanishes", "rounding": "rounding"}[verdict]
    assert page(asked(found, "fall")).holds


@pytest.mark.parametrize(
    ("gaps", "verdict", "limit"),
    [
        ([3.0 + 8 / 2**k for k in range(4)], "in part", 3.0),
        ([30.0 + 1 / 2**k for k in range(3)], "stays", None),  # level: no order is needed
        ([4.0 - 3 / 2**k for k in range(4)], "stays", 4.0),  # it grows
        ([8 / 2**k for k in range(4)], "discretisation", 0.0),
        ([8 / 4**k for k in range(4)], "discretisation", 0.0),
        # Measured: a pendulum, of which 0 is left, and an ant, of which 5 mm are. The last three
        # gaps of both extrapolate to more than what their order may be off.
        ([2.96, 1.35, 0.699, 0.329, 0.177], "unclear", None),
        ([204.8, 83.7, 41.4, 23.6, 14.3], "in part", 4.124705882352938),
        ([8 / 16**k for k in range(4)], "discretisation", 0.0),  # RK4
        ([1e-3, 1e-10, 1e-13], "discretisation", 0.0),
        ([8 / 2**k for k in range(3)], "unclear", None),  # one order alone may be chance
        ([1e-16, 1e-13, 1e-10], "rounding", None),
        # The limits of the sides differ by 1, and the gap crosses zero on its way there.
        ([abs(1 - 3 / 2**k) for k in range(4)], "unclear", None),
        # Measured of gymnasium's ant, whose joints start outside of their limits [degrees]:
        ([21.7, 9.06, 3.39, 4.54, 5.26], "unclear", None),  # damping 1 and 0.7: 5.7 is left
        ([25.9, 6.10, 5.94, 1.13, 0.777], "unclear", None),  # it vanishes, below 0.5 ms
        ([0.0074, 11.9, 3.87], "unclear", None),
        ([0.0074, 11.9, 3.87, 0.577, 0.0371], "unclear", None),
    ],
)
def test_a_verdict_wants_a_steady_order(
    gaps: list[float], verdict: str, limit: float | None
) -> None:
    assert verdict_of(gaps, 1e-9) == (verdict, limit and pytest.approx(limit))


def test_a_start_outside_of_limits_is_unclear_until_the_steps_are_small(tmp_path: Path) -> None:
    texts = [BAR_OUTSIDE.format(damping=damping) for damping in ("1", "0.7")]
    for timestep, verdict in ((0.01, "unclear"), (0.000625, "stays")):
        one, two = (sm.load(written(tmp_path / "m.xml", x), timestep=timestep) for x in texts)
        with pytest.warns(EngineWarning, match="by 0.524; inside with --keyframe up$"):
            found = convergence_of(one, two, 1.0)
        assert found.whole_run[0].verdict == verdict
        shown_page = page(asked(found, "fall"))
        (code,) = blocks(shown_page, Code)
        ends = "--timestep 0.0025 --converge" if found.unclear else "--one-step"
        assert code.lines[0].endswith(ends)
        everything = shown(page(asked(found, "fall"), details=True))
        assert "Commands come" not in everything
        assert not found.vanishes


def test_unlike_timesteps_ask_for_commands_at_unlike_moments() -> None:
    one, two = (sm.load("so101", timestep=timestep) for timestep in (0.002, 0.004))
    found = asked(convergence_of(one, two, 0.1), "hold")
    text = " ".join(shown(page(found, details=True)).split())
    assert_in(text, "2 ms", "4 ms", "timestep=0.004")


def test_a_touch_parts_what_can_be_said(tmp_path: Path) -> None:
    found: Any = found_of(tmp_path, {"touch": ""}, {"touch": ""}, seconds=0.5)
    assert 0.1 < found.touch < 0.4


def test_a_run_that_ends_early_is_no_limit(tmp_path: Path) -> None:
    text = FALLING_BAR.format(integrator="Euler", flag="", mass="0.1", height="1", touch="")
    model = model_of(tmp_path, text)

    def run(finer: int) -> tuple[Trace, Trace]:
        trace = record(model.replace(substeps=finer), None, 0.1)
        object.__setattr__(trace.header, "ended", "it left every bound")
        return trace, trace

    refused((EndedEarlyError, "it left every bound", lambda: convergence(run)))
