"""What moves a quantity of a sweep: main effects against closed forms, and where it is largest."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from statemachine.cli import main
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.lab.sweep import Design, Sweep, Vary, run_sweep
from statemachine.lab.sweep.analysis import SweepEffects, effects
from statemachine.lab.sweep.folder import write_manifest
from statemachine.lab.sweep.main_effects import MainEffects, main_effects
from statemachine.lab.sweep.manifest import SweepManifest
from statemachine.lab.sweep.page import page
from statemachine.lab.sweep.quantities import cell_values, parse_quantity
from statemachine.lab.sweep.request import MANIFEST_VERSION
from statemachine.lab.sweep.rows import DONE, FAILED, RowWriter, schema_of

from .support.claims import assert_has, assert_in, refused
from .support.pages import shown

SIDES = ("mujoco", "pybullet")
TIMES = 5  # moments of a made-up run
Value = Callable[..., float]  # of the values of a setting
TipOf = Callable[..., Any]  # of the values of a setting and a seed


def grid(name: str, low: float, high: float, count: int, **more: Any) -> Vary:
    return Vary(name, values=tuple(np.linspace(low, high, count).tolist()), **more)


def ranges(names: str, low: float, high: float, samples: int) -> Design:
    factors = tuple(Vary(name, bounds=(low, high)) for name in names)
    return Design(factors, samples=samples, seed=1)


def found(design: Design, value: Value, seeds: int = 1) -> MainEffects:
    """Return the main effects on a function of the values."""
    values = np.array([value(*point.values) for point in design.points()])
    return main_effects(design, np.repeat(values[:, None], seeds, axis=1), rounding=1e-12)


def numbers(shares: Mapping[str, float | None]) -> dict[str, float]:
    """Return shares, or their errors, each of which is there."""
    assert None not in shares.values()
    return {name: share for name, share in shares.items() if share is not None}


# Shares of the variance.


def ishigami(x: float, y: float, z: float) -> float:
    """Return the function of T. Ishigami and T. Homma, 1990, with a = 7, b = 0.1."""
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


# Its variance a²/8 + b π⁴/5 + b² π⁸/18 + 1/2, and what of it x and y explain alone.
_VARIANCE = 49 / 8 + 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5
_BY_X = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2
ISHIGAMI = {"x": _BY_X / _VARIANCE, "y": 49 / 8 / _VARIANCE, "z": 0.0}


@pytest.mark.parametrize(("samples", "near"), [(64, 0.12), (256, 0.04), (1024, 0.015)])
def test_shares_of_the_ishigami_function_are_its_closed_form(samples: int, near: float) -> None:
    assert [*ISHIGAMI.values()] == pytest.approx([0.3139, 0.4424, 0.0], abs=1e-4)
    answer = found(ranges("xyz", -np.pi, np.pi, samples), ishigami)
    assert answer.shares == pytest.approx(ISHIGAMI, abs=near)
    for name, error in numbers(answer.errors).items():
        assert 0 < error < 1.3 / np.sqrt(samples)
        assert abs(numbers(answer.shares)[name] - ISHIGAMI[name]) < 3 * error


WEIGHTS = {"x": 3.0, "y": 2.0, "z": 1.0}
SQUARES = sum(weight**2 for weight in WEIGHTS.values())
LINEAR = {name: weight**2 / SQUARES for name, weight in WEIGHTS.items()}


def linear(x: float, y: float, z: float) -> float:
    return 5 + 3 * x + 2 * y - z


def test_shares_of_a_sum_are_those_of_its_terms_in_a_grid() -> None:
    design = Design(tuple(grid(name, -1, 1, 4) for name in "xyz"))
    answer = found(design, linear)
    assert answer.shares == pytest.approx(LINEAR, abs=1e-12)
    assert_has(answer, mean=pytest.approx(5), settings=64, left_out={}, why_none="")
    # Of four levels from -1 to 1 the variance is 5/9.
    assert answer.deviation == pytest.approx(np.sqrt(SQUARES * 5 / 9))


def test_shares_of_a_sum_are_those_of_its_terms_in_samples() -> None:
    # What a range varies within one of its eight classes is lost: 1/8² of its share.
    expected = {name: share * (1 - 1 / 64) for name, share in LINEAR.items()}
    assert found(ranges("xyz", -1, 1, 64), linear).shares == pytest.approx(expected, abs=0.015)


def test_levels_of_different_spread_count_by_their_variance() -> None:
    """A share is a² σ² over the sum: y has a hundredth of the range, and ten times the slope."""
    design = Design((grid("x", 0, 1, 5), grid("y", 0, 0.01, 5)))
    answer = found(design, lambda x, y: x + 10 * y)
    assert answer.shares == pytest.approx({"x": 1 / 1.01, "y": 0.01 / 1.01})


@pytest.mark.parametrize("design", [Design((grid("x", -1, 1, 4), grid("y", -1, 1, 4))),
                                    ranges("xy", -1, 1, 64)])  # fmt: skip
def test_a_pure_interaction_has_no_main_effect(design: Design) -> None:
    answer = found(design, lambda x, y: x * y)
    assert answer.shares == pytest.approx({"x": 0.0, "y": 0.0}, abs=0.01)
    assert answer.deviation > 0.3


def test_names_and_switches_are_classes() -> None:
    kinds = Vary("kind", values=("euler", "implicit", "fast"))
    design = Design((kinds, Vary("on", values=(True, False)), Vary("x", bounds=(0.0, 1.0))), 16)
    size = {"euler": 0.0, "implicit": 3.0, "fast": 6.0}
    answer = found(design, lambda kind, on, x: size[kind] + 2 * on + 1e-9 * x)
    assert answer.shares == pytest.approx({"kind": 6 / 7, "on": 1 / 7, "x": 0.0}, abs=1e-6)


@pytest.mark.parametrize(
    ("design", "value", "says"),
    [
        (Design((grid("x", 0, 1, 3),)), lambda _: 4.2, "at every setting"),
        (Design((grid("x", 0, 1, 3),)), lambda _: 0.0, "at every setting"),
        (Design((grid("x", 0, 1, 3),)), lambda x: 4 + 1e-14 * x, "at every setting"),
        (Design((Vary("x", values=(1.0,)),)), lambda x: x, "no two settings"),
        (ranges("x", 0, 1, 2), lambda x: x, "too few values"),
        (Design(), lambda: 4.2, "nothing is varied"),
    ],
)
def test_where_there_is_no_share_it_is_said_why(design: Design, value: Value, says: str) -> None:
    answer = found(design, value)
    assert set(answer.shares.values()) <= {None}
    assert answer.errors.keys() == answer.shares.keys()
    assert says in answer.why_none


def test_the_error_in_a_grid_is_that_of_the_seeds() -> None:
    design, seeds = Design((grid("x", 0, 1, 4), grid("y", 0, 1, 4))), 8
    draw = np.random.default_rng(0)
    settings = np.array([np.sum([float(v) for v in point.values]) for point in design.points()])
    few, many = (
        main_effects(design, settings[:, None] + draw.normal(0, noise, (16, seeds)))
        for noise in (0.01, 0.3)
    )
    assert 0 < numbers(few.errors)["x"] < 0.02 < numbers(many.errors)["x"] < 0.3
    assert set(found(design, lambda x, y: x + y, seeds=2).errors.values()) == {None}
    again = main_effects(design, settings[:, None] + np.zeros((16, seeds)))
    assert again.errors == pytest.approx({"x": 0.0, "y": 0.0}, abs=1e-12)


def without(design: Design, value: Value, is_hole: Callable[..., bool]) -> MainEffects:
    """Return the main effects where some settings have no figure."""
    values = [
        np.nan if is_hole(*point.values) else value(*point.values) for point in design.points()
    ]
    return main_effects(design, np.array(values)[:, None])


def test_a_grid_with_holes_keeps_the_rest() -> None:
    design = Design(tuple(grid(name, -1, 1, 3) for name in "xy"))
    for is_hole in (lambda _x, y: y == 1, lambda x, y: y == 1 and x == 0):
        answer = without(design, lambda x, _: 10 + 3 * x, is_hole)
        assert answer.settings == 6
        gone = next(iter(answer.left_out.items()))
        assert gone in {("y", (1.0,)), ("x", (0.0,))}
        assert answer.shares == pytest.approx({"x": 1, "y": 0})
    # Only one value of y is left: nothing is known of it.
    answer = without(design, lambda x, _: x, lambda _x, y: y >= 0)
    assert answer.shares == {"x": pytest.approx(1), "y": None}
    # Wherever the holes are, something stays.
    answer = without(design, lambda x, y: x + y, lambda x, y: (x + y) % 2 == 0)
    assert answer.settings >= 1


def test_samples_without_a_figure_are_left_out() -> None:
    design = ranges("xyz", -np.pi, np.pi, 256)
    gone = {point.values for point in list(design.points())[::10]}
    answer = without(design, ishigami, lambda *values: values in gone)
    assert answer.settings == 256 - 26
    assert answer.shares == pytest.approx(ISHIGAMI, abs=0.09)


# The dataset.


def made_up(
    folder: Path,
    design: Design,
    tips: dict[str, TipOf],
    seeds: int = 1,
    fails: Callable[[str, tuple[Any, ...], int], bool] = lambda *_: False,
) -> Path:
    """Return a dataset whose fingertips are functions of values and seed: (3,) [m]."""
    folder.mkdir()
    manifest = {
        "schema": MANIFEST_VERSION,
        "request": {"what": "made up", "function": "", "moments": TIMES},
        "files": {"no-such-model": ""},
        "versions": {"statemachine": "0", **dict.fromkeys(tips, "0")},
        "command": "statemachine sweep made-up.py:up --out DIR",
        "design": {
            "vary": [], "seeds": seeds, "backends": [*tips], "samples": design.samples,
            "design_seed": design.seed,
        },
        "factors": [{**asdict(vary), "label": vary.label} for vary in design.factors],
    }  # fmt: skip
    write_manifest(folder, cast(SweepManifest, manifest))
    writer = RowWriter(folder, design.factors, {})
    for backend, point, seed in product(tips, list(design.points()), range(seeds)):
        row: dict[str, Any] = {
            "cell": f"{point.id}{seed}{backend}",
            "point": point.id,
            "seed": seed,
            "backend": backend,
            **dict(zip((v.column for v in design.factors), point.values, strict=True)),
        }
        tip = [float(x) for x in tips[backend](*point.values, seed)]
        row |= {"status": DONE, "steps": 100, "time": 1.0, "tip": tip, "max_qvel": 2 * tip[0],
                "sample_tip": [tip] * TIMES, "sample_qpos": [[0.0]] * TIMES}  # fmt: skip
        if fails(backend, point.values, seed):
            row |= {"status": FAILED, "error_class": "DivergedError"}
        writer.add([row])
    writer.flush()
    return folder


def nowhere(*_: Any) -> list[float]:
    return [0.0, 0.0, 0.0]


def two_engines(folder: Path) -> Path:
    """Write gaps of 0 to 4 mm over x, and a second seed 2 mm worse where y is 1."""
    design = Design((grid("x", 0, 4, 5, kind="parameter"), grid("y", 0, 1, 2, times=True)))
    right: TipOf = lambda x, y, seed: [1e-3 * (x + (2 * seed if y else 0)), 0, 0.5]  # noqa: E731
    left: TipOf = lambda *_: [0.0, 0.0, 0.5]  # noqa: E731
    return made_up(
        folder, design, {"mujoco": left, "pybullet": right}, 2,
        fails=lambda backend, values, _: backend == "pybullet" and values == (3.0, 0.0),
    )  # fmt: skip


def text_of(answer: SweepEffects, details: bool = False) -> str:
    lines = shown(page(answer, details)).splitlines()
    lines = [line for line in lines if not line.startswith("    ")]  # what is typed is not broken
    assert max(map(len, lines)) <= 80
    return " ".join(" ".join(lines).split())


@pytest.fixture(scope="module")
def gap_report(tmp_path_factory: pytest.TempPathFactory) -> SweepEffects:
    """Return the report of the gap between two engines."""
    return effects(two_engines(tmp_path_factory.mktemp("gap") / "s"))


# Of x = 3 nothing is left; the other gaps are 0, 1, 2, 4 mm, and 1 mm more where y is 1.
BY_X, BY_Y = float(np.var([0, 1, 2, 4])), 0.25


def test_a_report_is_of_the_gap_between_two_engines(gap_report: SweepEffects) -> None:
    assert_has(gap_report, backends=SIDES, quantity="sample_tip", unit="m", scaled=("y",), seeds=2)


def test_a_report_names_the_setting_and_the_seed_of_the_largest_gap(
    gap_report: SweepEffects,
) -> None:
    assert_has(gap_report.largest, value=pytest.approx(6e-3), settings=(4.0, 1.0), seed=1)


def test_shares_of_a_gap_are_parts_of_its_variance_by_size(gap_report: SweepEffects) -> None:
    shares = {each.parameter: each.share for each in gap_report.effects}
    whole = BY_X + BY_Y
    assert shares == pytest.approx({"x": BY_X / whole, "y": BY_Y / whole})
    assert [*shares] == ["x", "y"]


def test_settings_without_a_result_are_left_out_and_counted(gap_report: SweepEffects) -> None:
    assert_has(gap_report, settings=8, left_out=2, left_out_values={"x": (3.0,)}, missing=0)
    assert gap_report.failed == {"DivergedError": 2}


def test_mean_and_deviation_of_a_gap_are_those_of_its_settings(gap_report: SweepEffects) -> None:
    assert gap_report.mean == pytest.approx(1e-3 * (1.75 + 0.5))
    assert gap_report.deviation == pytest.approx(1e-3 * np.sqrt(BY_X + BY_Y))


def test_the_page_of_a_gap_says_its_figures(gap_report: SweepEffects) -> None:
    answer = gap_report
    assert_in(
        text_of(answer),
        "sample_tip",
        "89.7 %",
        "6.00 mm",
        "0.500 mm",
        "4.50 mm",
        "2 cells",
    )
    assert_in(
        text_of(answer, details=True),
        "x = 4",
        "y = 1x",
        "DivergedError: 2.",
        "x = 3",
        "three seeds",
    )


def test_a_report_is_of_a_quantity_on_one_engine(tmp_path: Path) -> None:
    design = Design((grid("x", 0, 4, 5), Vary("model", values=("a", "b"), kind="model")))
    folder = made_up(
        tmp_path / "s", design, {"mujoco": lambda x, model, _: [x, 0, x if model == "a" else 0]}
    )
    answer = effects(folder)
    assert_has(answer, backends=("mujoco",), quantity="tip z", unit="m")
    assert_has(answer.largest, value=4.0, settings=(4.0, "a"))
    answer = effects(folder, "max_qvel")
    assert {each.parameter: each.share for each in answer.effects} == pytest.approx(
        {"x": 1.0, "model": 0.0}
    )
    levels = {each.parameter: each.levels for each in answer.effects}
    ends = levels["x"][0], levels["x"][-1]
    assert [(level.value, level.mean) for level in ends] == [(0.0, 0.0), (4.0, 8.0)]
    assert (answer.smallest.value, answer.largest.value) == (0.0, 8.0)


def test_one_engine_of_two_may_be_named(tmp_path: Path) -> None:
    folder = two_engines(tmp_path / "s")
    answer = effects(folder, backends=["mujoco"])
    assert_has(answer, backends=("mujoco",), quantity="tip z", left_out=0, failed={})
    assert "at every setting" in answer.why_none
    assert answer.verdict == "none"
    assert effects(folder, backends=SIDES[::-1]).effects == effects(folder).effects


def test_a_gap_that_is_rounding_of_its_sides_has_no_shares(tmp_path: Path) -> None:
    def right(x: float, _seed: int) -> list[float]:
        return [0.0, 0.0, 0.5 + 2e-16 * x]

    tips = {"mujoco": lambda *_: [0.0, 0.0, 0.5], "pybullet": right}
    answer = effects(made_up(tmp_path / "s", Design((grid("x", 0, 4, 5),)), tips))
    assert 0 < answer.largest.value < 1e-15
    assert "rounding" in answer.why_none


def test_what_no_report_can_be_of_is_refused(tmp_path: Path) -> None:
    report = partial(effects, two_engines(tmp_path / "s"))
    three = made_up(
        tmp_path / "t", Design((grid("x", 0, 1, 2),)), dict.fromkeys((*SIDES, "other"), nowhere)
    )
    failed = made_up(
        tmp_path / "f", Design((grid("x", 0, 1, 2),)), dict.fromkeys(SIDES, nowhere),
        fails=lambda backend, *_: backend == "pybullet",
    )  # fmt: skip
    one = partial(report, backends=["mujoco"])
    refused(
        (UnknownNameError, "'touch'", lambda: report("touch")),
        (UnknownNameError, "'seed'", lambda: report("seed")),
        (UnknownNameError, "backend of this sweep", lambda: report(backends=["drake"])),
        (UnknownNameError, "'tip_w'", lambda: report("tip w")),
        (BadInputError, r"no tip\[3\]: tip has 3 numbers", lambda: report("tip[3]")),
        (BadInputError, r"no time\[0\]: time is one number", lambda: report("time[0]")),
        (BadInputError, "tip x to tip z", lambda: one("tip")),
        (BadInputError, "of one engine tip x", lambda: one("sample_tip x")),
        (BadInputError, "--backend", lambda: effects(three)),
        (BadInputError, "both mujoco and pybullet", lambda: effects(failed)),
        (BadInputError, "energy on mujoco", lambda: one("energy")),
    )
    assert effects(three, backends=["other"]).largest.value == 0.0
    assert effects(failed, backends=["mujoco"]).failed == {}


def rows_of(*rows: dict[str, Any]) -> Any:
    """Return a table of runs of one point and seed: the first is the left engine's."""
    arrow = pytest.importorskip("pyarrow")
    given = [
        {"backend": SIDES[k % 2], "point": str(k // 2), "seed": 0, "status": DONE, **row}
        for k, row in enumerate(rows)
    ]
    schema = schema_of((), {}).append(arrow.field("backend", arrow.string()))
    return arrow.Table.from_pylist(given, schema)


def gaps(name: str, *rows: dict[str, Any]) -> list[float]:
    points = [str(k) for k in range(len(rows) // 2)]
    found = cell_values(rows_of(*rows), parse_quantity(name), SIDES, points, 1)
    return found.values[:, 0].tolist()


def test_the_gap_of_a_place_is_a_length_and_of_others_the_largest_difference() -> None:
    here, there = [0.0, 0.0, 0.0], [3.0, 4.0, 0.0]
    assert gaps("tip", {"tip": here}, {"tip": there}) == [5.0]
    assert gaps("tip[0]", {"tip": there}, {"tip": here}) == [3.0]
    assert gaps("qpos", {"qpos": here}, {"qpos": there}) == [4.0]
    assert gaps("energy", {"energy": 1.0}, {"energy": -2.0}) == [3.0]
    moments = {"sample_tip": [here, there, here]}
    assert gaps("sample_tip", moments, {"sample_tip": [here] * 3}) == [5.0]


def test_runs_of_several_lengths_keep_their_last_moment_last() -> None:
    long, short = [[1.0], [2.0], [5.0]], [[4.0]]
    assert gaps("sample_qpos", {"sample_qpos": long}, {"sample_qpos": short}) == [1.0]
    # A run without any moment, and one that failed, have none.
    rows = {"sample_qpos": long}, {"sample_qpos": None}, {"sample_qpos": long}
    found = gaps("sample_qpos", *rows, {"sample_qpos": long, "status": FAILED})
    assert np.isnan(found).all()


@pytest.mark.parametrize(
    ("left", "right", "gap"),
    [(0.25, 0.5, 0.25), (0.25, None, 0.8), (None, 0.5, 0.8), (None, None, 0.0)],
)
def test_a_touch_that_one_engine_has_is_as_far_as_the_run_is_long(
    left: float | None, right: float | None, gap: float
) -> None:
    rows = {"first_touch": left, "time": 1.0}, {"first_touch": right, "time": 0.8}
    assert gaps("first_touch", *rows) == [gap]
    assert np.isnan(gaps("first_touch", rows[0], {**rows[1], "status": FAILED})).all()


# The command.


def test_the_command_prints_the_report_as_page_and_as_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(two_engines(tmp_path / "s"))
    assert main(["sweep", "--report", folder, "--quantity", "tip", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["largest"]["value"] == pytest.approx(6e-3)
    assert answer["largest"]["settings"] == [4.0, 1.0]
    assert answer["effects"][0] == {
        "parameter": "x", "share": pytest.approx(0.897, abs=1e-3), "error": None,
        "levels": [
            {"value": float(x), "mean": pytest.approx(1e-3 * (x + 0.5))} for x in (0, 1, 2, 4)
        ],
    }  # fmt: skip
    assert main(["sweep", "--report", folder, "--backend", "pybullet"]) == 0
    assert "tip z" in capsys.readouterr().out
    assert main(["sweep", "--report", folder, "--quantity", "tips"]) == 2


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_a_real_sweep_is_answered(tmp_path: Path) -> None:
    sweep = Sweep(
        "hold", vary=("damping=0.6x:1.4x", "kp=0.9x:1.1x:2"), backends=SIDES, samples=8,
        seconds=0.5,
    )  # fmt: skip
    run_sweep(sweep, tmp_path / "s", jobs=1)
    of_gap, of_one = effects(tmp_path / "s"), effects(tmp_path / "s", "max_qvel", ["mujoco"])
    for answer in (of_gap, of_one):
        assert_has(answer, settings=16, why_none="", missing=0)
        shares = numbers({each.parameter: each.share for each in answer.effects})
        errors = numbers({each.parameter: each.error for each in answer.effects})
        assert 0 <= min(shares.values()) <= max(shares.values()) <= 1
        assert min(errors.values()) > 0
    assert_has(of_gap, is_of_a_gap=True, is_sampled=True, has_shares=True, has_no_errors=False)
    assert not of_one.is_of_a_gap
    assert of_gap.where_largest == dict(
        zip(("damping", "kp"), of_gap.largest.settings, strict=True)
    )
    assert 0 < of_gap.largest.value < 0.1
    assert of_one.effects[0].parameter == "damping"
