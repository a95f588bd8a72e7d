"""From a sweep to an answer: agreement, sensitivity and fits against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from statemachine.cli import main
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.page import Figures, HeatMap, Traces
from statemachine.report.as_json import plain
from statemachine.report.sweep_pictures import pictures
from statemachine.report.sweep_report import page
from statemachine.sweep import Design, Sweep, Vary, run_sweep
from statemachine.sweep.analysis import sweep_report
from statemachine.sweep.analysis_data import SweepData, read_runs, sweep_data
from statemachine.sweep.analysis_fit import fit_curves, values_within
from statemachine.sweep.analysis_gaps import agreement_of, gap_map
from statemachine.sweep.analysis_runs import ModelFacts, facts_of
from statemachine.sweep.analysis_together import REFINED, brought_together
from statemachine.sweep.folder import design_of, read_manifest, write_manifest
from statemachine.sweep.request import MANIFEST_VERSION
from statemachine.sweep.rows import DONE, FAILED, RowWriter, read_cells, schema_of

from .conftest import assert_has, assert_in, refused, shown

SIDES = ("mujoco", "pybullet")
TIMES = 5  # moments of a made-up run
TipOf = Callable[..., Any]
T = TypeVar("T")


def the(value: T | None) -> T:
    """What is there."""
    assert value is not None
    return value


def made_up(
    folder: Path,
    design: Design,
    left: TipOf,
    right: TipOf,
    seeds: int = 1,
    fails: Callable[[str, tuple[Any, ...], int], bool] = lambda *_: False,
) -> Path:
    """A dataset whose fingertips are functions of values and seed: (3,) [m]."""
    folder.mkdir()
    manifest = {
        "schema": MANIFEST_VERSION,
        "request": {"what": "made up", "function": "", "moments": TIMES},
        "files": {"no-such-model": ""},
        "versions": {"statemachine": "0", **dict.fromkeys(SIDES, "0")},
        "design": {
            "vary": [], "seeds": seeds, "backends": SIDES, "samples": design.samples,
            "indices": design.indices, "design_seed": design.seed,
        },
        "factors": [{**asdict(vary), "label": vary.label} for vary in design.factors],
    }  # fmt: skip
    write_manifest(folder, manifest)
    writer = RowWriter(folder, design.factors, {})
    sides = zip(SIDES, (left, right), strict=True)
    for (backend, tip_of), point, seed in product(sides, list(design.points()), range(seeds)):
        row: dict[str, Any] = {
            "cell": f"{point.id}{seed}{backend}",
            "point": point.id,
            "seed": seed,
            "backend": backend,
            **dict(zip((v.column for v in design.factors), point.values, strict=True)),
        }
        if fails(backend, point.values, seed):
            row |= {"status": FAILED, "error_class": "DivergedError"}
        else:
            row |= ran(np.broadcast_to(tip_of(*point.values, seed), (TIMES, 3)).tolist())
        writer.add([row])
    writer.flush()
    return folder


def ran(tips: list[list[float]] | None) -> dict[str, Any]:
    """What the row of a run has whose fingertip was there."""
    angles = [[0.0]] * len(tips or ())
    return {
        "status": DONE, "steps": 100, "time": 1.0, "sample_tip": tips, "sample_qpos": angles,
    }  # fmt: skip


def along_x(length: float) -> list[float]:
    return [float(length), 0.0, 0.0]


def nowhere(*_: Any) -> list[float]:
    return [0.0, 0.0, 0.0]


def grid(name: str, low: float, high: float, count: int, **more: Any) -> Vary:
    return Vary(name, values=tuple(np.linspace(low, high, count).tolist()), **more)


GAIN = grid("gain", 0, 2, 9, kind="parameter")


def of(folder: Path, **given: Any) -> Figures:
    return sweep_report(folder, run=False, **given)


def shares(found: Figures) -> dict[str, tuple[float, float]]:
    return {each.label: (each.first, each.total) for each in the(found.sensitivity).indices}


def ishigami(x: float, y: float, z: float, _seed: int) -> list[float]:
    """T. Ishigami and T. Homma, 1990, with a = 7, b = 0.1; moved above 0, for a gap."""
    return along_x(20 + np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x))


# Of its closed form: V = a²/8 + b π⁴/5 + b² π⁸/18 + 1/2.
_V = 49 / 8 + 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5
_VX = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2
_VXZ = 0.01 * np.pi**8 * (1 / 18 - 1 / 50)
ISHIGAMI = {
    "x": (_VX / _V, (_VX + _VXZ) / _V),
    "y": (49 / 8 / _V, 49 / 8 / _V),
    "z": (0.0, _VXZ / _V),
}


def sobol(samples: int) -> Design:
    factors = tuple(Vary(name, bounds=(-np.pi, np.pi)) for name in "xyz")
    return Design(factors, samples=samples, indices=True, seed=1)


def test_sobol_indices_are_those_of_the_ishigami_function(tmp_path: Path) -> None:
    found = of(made_up(tmp_path / "s", sobol(1024), nowhere, ishigami))
    assert_has(the(found.sensitivity), method="sobol", samples=1024)
    assert shares(found).keys() == ISHIGAMI.keys()
    for each in the(found.sensitivity).indices:
        for name, value in zip(("first", "total"), ISHIGAMI[each.label], strict=True):
            assert getattr(each, name) == pytest.approx(value, abs=0.03), each
            low, high = getattr(each, f"{name}_interval")
            assert low - 0.02 < value < high + 0.02  # 95 %, six of them
            assert 0 < high - low < 0.3
    assert the(found.sensitivity).indices[0].label == "x"
    assert_has(the(found.map), across="x", up="y", others=("z",))


def test_failed_cells_leave_their_samples_out_of_the_indices(tmp_path: Path) -> None:
    gone = list(sobol(256).points())[300].values
    found = of(
        made_up(
            *(tmp_path / "s", sobol(256), nowhere, ishigami),
            fails=lambda backend, values, _: backend == "mujoco" and values == gone,
        )
    )
    assert (found.failed, found.quantity.counts["no runs"]) == ({"DivergedError": 1}, 1)
    assert the(found.sensitivity).samples == 128
    assert "1 of 256 samples" in the(found.sensitivity).notes[0]
    assert shares(found)["y"][0] == pytest.approx(ISHIGAMI["y"][0], abs=0.15)


def test_a_full_factorial_is_taken_apart_as_its_closed_form(tmp_path: Path) -> None:
    # f = 10 + 3 x + 2 y + x y + 0 z over levels -1, 0, 1, whose variance is 2/3.
    design = Design(tuple(grid(name, -1, 1, 3) for name in "xyz"))
    right: TipOf = lambda x, y, z, _: along_x(10 + 3 * x + 2 * y + x * y)  # noqa: E731
    found = of(made_up(tmp_path / "s", design, nowhere, right))
    x, y, both = np.array([6, 8 / 3, 4 / 9]) / (6 + 8 / 3 + 4 / 9)
    expected = {"x": (x, x + both), "y": (y, y + both), "z": (0.0, 0.0)}
    assert shares(found) == {name: pytest.approx(e, abs=1e-9) for name, e in expected.items()}
    assert the(found.sensitivity).method == "factorial"
    assert the(found.sensitivity).indices[0].first_interval is None  # of one seed


def test_a_factorial_with_holes_keeps_the_rest(tmp_path: Path) -> None:
    design = Design(tuple(grid(name, -1, 1, 3) for name in "xy"))
    found = of(
        made_up(
            *(tmp_path / "s", design, nowhere, lambda x, y, _: along_x(10 + 3 * x)),
            fails=lambda _backend, values, _seed: values[1] == 1,
        )
    )
    assert_has(shares(found), x=pytest.approx((1, 1)), y=pytest.approx((0, 0)))
    assert "y = 1.0" in the(found.sensitivity).notes[0]
    assert found.failed == {"DivergedError": 6}


def agreement(folder: Path, seeds: int = 2) -> Path:
    """Gaps of 0 to 4 mm over x, and one seed that is 2 mm worse where y is 1."""
    design = Design((grid("x", 0, 4, 5, kind="parameter"), grid("y", 0, 1, 2)))
    return made_up(
        folder, design, nowhere,
        lambda x, y, seed: along_x(1e-3 * (x + (2 * seed if y else 0))), seeds,
        fails=lambda backend, values, _: backend == "pybullet" and values == (3.0, 0.0),
    )  # fmt: skip


def test_settings_agree_by_the_tolerance(tmp_path: Path) -> None:
    found = of(agreement(tmp_path / "s"), tolerances={"tip": 1.5e-3}, quantity="tip")
    # y = 0: x = 0, 1 agree, 2 and 4 differ, 3 has no runs; y = 1: of two seeds the better one
    # agrees at 0 and 1.
    assert found.quantity.counts == {"agrees": 2, "some seeds": 2, "differs": 5, "no runs": 1}
    assert found.agreed == 2
    by = {each.values: each for each in found.settings}
    assert_has(by[2.0, 1.0], median=pytest.approx(3e-3), worst=pytest.approx(4e-3))
    assert by[3.0, 0.0].median is None
    for y, row in zip(the(found.map).rows, the(found.map).gap, strict=True):
        for x, value in zip(the(found.map).columns, row, strict=True):
            gone = {x, y} == {3.0, 0.0}  # whichever of the two is across
            assert value == (None if gone else pytest.approx(1e-3 * (float(x) + float(y))))
    said = shown(page(found))
    assert_in(
        " ".join(said.split()),
        "In 2 of 10 settings mujoco and pybullet agree within 1.5 mm",
        "failed with DivergedError: 2",
        "thereby have no gap: 1",
    )
    assert max(map(len, said.splitlines())) <= 80


def test_a_sweep_that_failed_everywhere_has_no_report(tmp_path: Path) -> None:
    design = Design((grid("x", 0, 1, 2, kind="parameter"),))
    for failed in (("pybullet",), SIDES):
        folder = made_up(
            tmp_path / str(len(failed)), design, nowhere, nowhere,
            fails=lambda backend, _values, _seed, failed=failed: backend in failed,
        )  # fmt: skip
        refused((BadInputError, r"no setting .* both mujoco and pybullet", partial(of, folder)))


def data_of(folder: Path) -> SweepData:
    return sweep_data(read_cells(folder), design_of(read_manifest(folder)), SIDES, 1, TIMES)


def test_a_gap_inside_the_chaos_floor_is_no_difference(tmp_path: Path) -> None:
    data = data_of(agreement(tmp_path / "s", seeds=1))
    width, tolerances = np.full(10, 2.5e-3), {"tip": 1.5e-3}
    found, settings = agreement_of(data, "tip", width, ModelFacts(), tolerances)
    verdicts = {each.values[0]: each.verdict for each in settings if each.values[1] == 0}
    assert verdicts == {0: "agrees", 1: "agrees", 2: "chaos", 3: "no runs", 4: "differs"}
    assert the(gap_map(data, "tip", width, None)).inside[0] == (True, True, True, False, False)
    assert found.counts["chaos"] == 2


def fitted(
    folder: Path, best: float, least: float = 0.0, seeds: int = 4, spread: float = 0.0
) -> Figures:
    """Left and right part by 5 mm for each unit of gain from the best one, and by `least`."""
    design = Design((GAIN, grid("y", 0, 1, 2)))

    def right(gain: float, _y: float, seed: int) -> list[float]:
        return [5e-3 * (gain - (best + spread * (seed - (seeds - 1) / 2))), least, 0.0]

    folder = made_up(folder, design, nowhere, right, seeds)
    return of(folder, tolerances={"tip": 0.2e-3}, fit=["gain"])


def test_the_value_that_brings_them_together_is_found(tmp_path: Path) -> None:
    (found,) = fitted(tmp_path / "s", best=0.61, least=0.1e-3).together
    assert found.varied == "both"  # a parameter of a function is not a side's own
    assert_has(found, verdict="together", measured=None)
    assert_has(
        the(found.fit),
        value=pytest.approx(0.61, abs=1e-3),
        gap=pytest.approx(0.1e-3, rel=1e-3),
        error=pytest.approx(0.0, abs=1e-3),  # the seeds are alike
    )
    reach = np.sqrt(0.2**2 - 0.1**2) / 5  # where hypot(5 mm · reach, 0.1 mm) is 0.2 mm
    assert values_within(the(found.fit), 0.2e-3) == pytest.approx(
        (0.61 - reach, 0.61 + reach), abs=6e-3
    )
    assert values_within(the(found.fit), 0.05e-3) is None
    assert np.interp(1.61, *the(found.fit)._scan) == pytest.approx(np.hypot(5e-3, 0.1e-3), rel=0.01)


def test_its_error_is_that_of_the_seeds(tmp_path: Path) -> None:
    seeds, spread = 16, 0.02
    (found,) = fitted(tmp_path / "s", best=0.9, least=5e-3, seeds=seeds, spread=spread).together
    # The gap is a parabola here, so that the value is the mean of 16 that are evenly spread;
    # the curves of a seed at 2 values of y are the same, and count once.
    deviation = spread * np.sqrt((seeds**2 - 1) / 12)
    assert_has(
        the(found.fit),
        value=pytest.approx(0.9, abs=0.02),
        error=pytest.approx(deviation / np.sqrt(seeds), rel=0.15),
        of="16 seeds drawn again",
    )
    assert found.verdict == "closer"


def test_at_the_edge_no_value_and_only_closer(tmp_path: Path) -> None:
    for name, best, least, says in (
        ("edge", 5.0, 0.0, "at the edge of the range"),
        ("none", 1.0, 0.5, "No value of gain is better"),
        ("closer", 0.9, 5e-3, "brings mujoco and pybullet closer, not together"),
    ):
        report = fitted(tmp_path / name, best=best, least=least)
        assert report.together[0].verdict == name
        assert says in " ".join(shown(page(report)).split())


def test_one_curve_has_its_error_from_the_curvature(tmp_path: Path) -> None:
    right: TipOf = lambda gain, _: [5e-3 * (gain - 1), 1e-3, 0.0]  # noqa: E731
    (found,) = of(made_up(tmp_path / "s", Design((GAIN,)), nowhere, right)).together
    # One unknown: s² = 5 · 1e-6 / 14 left over, Σ slope² = 5 · 25e-6.
    assert the(found.fit).error == pytest.approx(np.sqrt(5e-6 / 14 / (5 * 25e-6)), rel=0.02)


def moments(x: list[float], steps: int, d: int = 2) -> NDArray[np.float64]:
    """(1, k, m, d) a curve whose runs keep so many moments; NaN before them."""
    made = np.full((1, len(x), 4, d), np.nan)
    made[0, :, 4 - steps :] = np.array(x)[:, None, None]
    return made


def test_runs_that_keep_fewer_moments_are_fitted_by_those_they_have() -> None:
    levels = np.array([0.0, 1.0, 2.0])
    right = np.concatenate([moments([-1, 0, 1], steps) for steps in (4, 2)])
    found = fit_curves("qpos", levels, 0 * right, right, [0, 0])
    assert (the(found).value, the(found).curves) == (pytest.approx(1.0, abs=1e-3), 2)
    assert the(found)._scan[1][-1] == pytest.approx(1.0)


def test_of_a_curve_with_runs_of_several_lengths_the_end_is_fitted() -> None:
    """As where the timestep itself is fitted: the moments before are no longer the same."""
    levels = np.array([0.0, 1.0, 2.0])
    right = moments([-1, 0, 1], 4)
    right[0, :, :-1] = 7.0
    right[0, 0, :2] = np.nan
    found = fit_curves("qpos", levels, 0 * np.nan_to_num(right), right, [0])
    assert (the(found).value, the(found).gap) == (
        pytest.approx(1.0, abs=1e-3),
        pytest.approx(0.0, abs=1e-3),
    )


def test_a_sampled_range_is_fitted_by_a_parabola(tmp_path: Path) -> None:
    ranges = (Vary("gain", kind="parameter", bounds=(0.0, 2.0)), Vary("y", bounds=(0.0, 1.0)))
    folder = made_up(
        tmp_path / "s", Design(ranges, samples=64), nowhere,
        lambda gain, y, _: [5e-3 * (gain - 0.7), 1e-3 * y, 0.0],
    )  # fmt: skip
    report = of(folder, fit=["gain"])
    (found,) = report.together
    assert the(found.fit).value == pytest.approx(0.7, abs=0.02)
    assert the(report.sensitivity).method == "rank"
    assert "run it with --indices" in the(report.sensitivity).notes[0]


def test_pictures_and_page_are_of_the_same_figures(tmp_path: Path) -> None:
    folder = agreement(tmp_path / "s")
    found = of(folder, tolerances={"tip": 1.5e-3})
    chart = next(each for each in pictures(found) if isinstance(each, HeatMap))
    within = [[v is not None and v <= 1.5 for v in row] for row in chart.values]
    assert sum(map(sum, chart.framed)) == sum(map(sum, within))
    html, plot = tmp_path / "r.html", tmp_path / "r.png"
    arguments = ["sweep", "--report", str(folder), "--no-runs", "--tolerance", "tip=1.5mm"]
    assert main([*arguments, "--html", str(html), "--plot", str(plot)]) == 1
    assert (chart.across, chart.unit) == ("x", "gap [mm]")
    page_text = html.read_text("utf-8")
    assert page_text.count("data:image/svg+xml;base64,") == 3
    assert "In 2 of 10 settings" in page_text
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert plain(found)["agreed"] == 2


def test_one_parameter_is_a_curve(tmp_path: Path) -> None:
    design = Design((grid("x", 0, 4, 5),))
    folder = made_up(tmp_path / "s", design, nowhere, lambda x, _: along_x(1e-3 * x))
    curve = pictures(of(folder))[0]
    assert isinstance(curve, Traces)
    assert curve.curves["median of the seeds"] == ([0, 1, 2, 3, 4], pytest.approx([0, 1, 2, 3, 4]))


def test_an_axis_says_what_its_values_are_in() -> None:
    pytest.importorskip("mujoco")
    factors = [
        Vary("timestep", values=(0.001, 0.002)),
        Vary("damping", values=(0.5, 1.0), times=True),
        Vary("damping", "elbow_flex", values=(0.5, 1.0)),
        Vary("qpos", "elbow_flex", "state", values=(0.5, 1.0)),
        Vary("gain", kind="parameter", values=(0.5, 1.0)),
    ]
    assert facts_of({"files": {"so101/scene_box": ""}}, factors, ["mujoco"]).units == {
        "timestep": "s", "damping": "", "damping[elbow_flex]": "N·m·s/rad",
        "qpos[elbow_flex]": "rad", "gain": "",
    }  # fmt: skip


def test_what_no_sweep_has_is_refused(tmp_path: Path) -> None:
    report = partial(of, agreement(tmp_path / "s"))
    refused(
        (UnknownNameError, "parameter", lambda: report(fit=["z"])),
        (UnknownNameError, "quantity", lambda: report(quantity="touch")),
        (BadInputError, "two engines", lambda: report(backends=["mujoco"])),
    )


def test_runs_of_several_lengths_keep_their_last_moment_last() -> None:
    arrow = pytest.importorskip("pyarrow")
    tips = [[[1.0, 2.0, 3.0]], [[4.0, 5.0, 6.0], [7.0, 8.0, 9.0]], None, [[1.0, 1.0, 1.0]] * 2]
    rows = [ran(tip) | {"steps": 4, "sample_qpos": [[0.0, 1.0]]} for tip in tips]
    rows[1]["first_touch"] = 0.5
    rows[3]["status"] = FAILED
    runs = read_runs(arrow.Table.from_pylist(rows, schema_of((), {})), 3, [1])
    assert (runs["tip"].shape, runs["qpos"].shape) == ((4, 3, 3), (4, 3, 1))
    for run, tip in zip(runs["tip"], [*tips[:2], None, None], strict=True):
        there = tip or np.empty((0, 3))
        np.testing.assert_array_equal(run[3 - len(there) :], there)
        assert np.isnan(run[: 3 - len(there)]).all()
    np.testing.assert_array_equal(runs["touch"], [np.inf, 0.5, np.inf, np.nan])
    np.testing.assert_array_equal(runs["timestep"], [0.25, 0.25, 0.25, np.nan])


def tried(folder: Path, left: TipOf, right: TipOf) -> Any:
    """What fitting the gain gives where the made-up engines can be run at any value."""
    arrow, tip_of = pytest.importorskip("pyarrow"), dict(zip(SIDES, (left, right), strict=True))

    def run(asked: Any, **_: Any) -> Any:
        rows = [ran([tip_of[backend](*values, seed)]) for backend, values, seed in asked]
        return read_runs(arrow.Table.from_pylist(rows, schema_of((), {})), TIMES)

    runner: Any = SimpleNamespace(run=run)
    return brought_together(data_of(folder), GAIN, "tip", 0.2e-3, varied="both", runner=runner)


def test_where_a_run_contradicts_the_fit_the_best_run_is_the_answer(tmp_path: Path) -> None:
    """A tip that jumps over what the left one does, as over a contact: 5 mm is the least gap."""

    def right(gain: float, _seed: int) -> list[float]:
        return along_x(5e-3 + 20e-3 * (gain - 0.62) if gain >= 0.62 else -20e-3 + 2e-3 * gain)

    folder = made_up(tmp_path / "s", Design((GAIN,)), nowhere, right)
    report = of(folder, tolerances={"tip": 0.2e-3}, fit=["gain"])
    (fit,) = report.together
    assert the(fit.fit).gap < 1e-3  # which no run gives
    assert fit.tried is None
    found = tried(folder, nowhere, right)
    assert the(found.measured) > 5e-3
    assert_has(
        found,
        value=pytest.approx(0.625),
        error=pytest.approx(0.25 / (REFINED - 1)),
        verdict="closer",
        cells=2 * (1 + REFINED),
    )
    assert found.after == min(the(found.tried)[1]) == pytest.approx(5.1e-3)
    assert_in(
        " ".join(shown(page(Figures(**vars(report) | {"together": (found,)}))).split()),
        "gain = 0.625 ± 0.031 in both brings mujoco and pybullet closer",
        "9 values from 0.5 to 0.75 were run, 0.03125 apart",
    )
    # Where it agrees with the fit nothing more is run.
    sides = nowhere, lambda gain, _: along_x(5e-3 * (gain - 0.61))
    found = tried(made_up(tmp_path / "t", Design((GAIN,)), *sides), *sides)
    assert (found.tried, found.cells) == (None, 2)


@pytest.mark.slow
def test_a_real_sweep_is_answered(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    from statemachine import load

    sweep = Sweep(
        "hold", vary=("damping=0.6x:1.4x:5",), backends=SIDES, seeds=2, seconds=0.4,
        spread="0.5deg",
    )  # fmt: skip
    run_sweep(sweep, tmp_path / "s", jobs=1)
    found = sweep_report(tmp_path / "s", floor_cells=8, jobs=1)
    assert (the(found.floor).cells, the(found.floor).settings) == (8, 2)
    assert 0 < max(each.floor or 0 for each in found.settings) < 1e-6
    (fit,) = found.together
    assert_has(fit, label="damping", varied="right", own=1.0, pairs=2)
    assert load("so101/scene").dof_damping.any()
    # Both engines have the same model: its own damping, or one near it, is the best.
    assert the(fit.fit).value == pytest.approx(1.0, abs=0.15)
    assert the(fit.measured) < np.interp(0.6, *the(fit.fit)._scan)
    assert found.ran == the(found.floor).cells + fit.cells
