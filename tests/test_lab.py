"""Questions from Python: keyword arguments make the Request, and a Result shows itself."""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import cli, lab
from statemachine.errors import BadInputError, StateMachineError, UnknownNameError
from statemachine.lab.compare.perturbed import Uncertainty
from statemachine.lab.questions.requests.gap import CompareResult
from statemachine.lab.recordings import record, write

from .support.files import written
from .support.processes import of_python
from .support.screens import wide_lines
from .support.small_models import TWO_LINKS, TWO_SERVOS

LINKS = {"drives": "".join(TWO_SERVOS), "keys": ""}


@pytest.fixture
def light(tmp_path: Path) -> str:
    return str(written(tmp_path / "light.xml", TWO_LINKS.format(mass=0.3, **LINKS)))


@pytest.fixture
def heavy(tmp_path: Path) -> str:
    return str(written(tmp_path / "heavy.xml", TWO_LINKS.format(mass=0.4, **LINKS)))


def swing(model: sm.Model, data: sm.Data) -> np.ndarray:
    """Command both servos to follow a sine."""
    return np.full(model.nu, 0.4 * np.sin(5 * data.time))


# What can be typed can be written in Python.

# Options of `compare` that are no argument of a function of `lab`, and where they are instead.
ELSEWHERE = {
    "help": "help(lab.compare)",
    "help_all": "help(lab.compare)",
    "json": "result.to_json()",
    "details": "result.text(details=True)",
    "html": "lab.write",
    "no_why": "lab.write(…, why=False)",
    "junit": "lab.write",
    "plot": "lab.write",
    "film": "lab.write",
    "trust_binary": "sm.load(…, trust_binary=True), and the Model as a side",
}
# What an option is called in Python, where not the same.
CALLED = {
    "backend": "backends",
    "tolerance": "tolerances",
    "no_chaos": "chaos",
    "map": "names",
    "frame": "frames",
    "versions": "releases",
    "report": "folder",
}
FUNCTIONS = {"why": "why", "one_step": "one_step", "converge": "converge", "models": "models"}


def options_of(command: str) -> Iterator[str]:
    """Return the names of the options and words of a command, as argparse keeps them."""
    parser = cli.parser_of([command])
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    for action in commands.choices[command]._actions:
        yield action.dest


def arguments_of(*functions: Callable[..., Any]) -> set[str]:
    names = set[str]()
    for function in functions:
        names |= set(inspect.signature(function).parameters)
    return names


def test_every_option_of_compare_can_be_written_in_python() -> None:
    asked = (lab.compare, lab.why, lab.one_step, lab.converge, lab.versions, lab.models)
    known = arguments_of(*asked, lab.recording, lab.identify) | set(FUNCTIONS)
    missing = [
        name
        for name in options_of("compare")
        if name not in ELSEWHERE and CALLED.get(name, name) not in known
    ]
    assert missing == []


def test_every_option_of_sweep_can_be_written_in_python() -> None:
    known = arguments_of(lab.sweep, lab.sweep_report)
    missing = [
        name
        for name in options_of("sweep")
        if name not in ELSEWHERE and CALLED.get(name, name) not in known
    ]
    assert missing == []


def test_an_option_that_is_elsewhere_is_still_one() -> None:
    typed = {*options_of("compare"), *options_of("sweep")}
    assert {*ELSEWHERE, *CALLED} <= typed | {"help", "help_all"}


@pytest.mark.parametrize(
    "name",
    [
        *("compare", "why", "one_step", "converge", "engines", "versions", "models", "sweep"),
        *("recording", "identify"),
    ],
)
def test_every_argument_is_documented(name: str) -> None:
    function = getattr(lab, name)
    documented = set(re.findall(r"^        (\w+): ", inspect.getdoc(function) or "", re.M))
    documented |= set(re.findall(r"^    (\w+): ", inspect.getdoc(function) or "", re.M))
    assert set(inspect.signature(function).parameters) - documented == set()


# The names of `lab`.


def test_a_question_is_a_function_after_its_room_was_imported() -> None:
    code = (
        "import statemachine.lab.compare.sides, statemachine.lab.why, statemachine.lab.sweep\n"
        "from statemachine import lab\n"
        "print(lab.compare.__name__, lab.why.__name__, lab.sweep.__name__)"
    )
    assert of_python("-c", code, code=0).stdout.split() == ["compare", "why", "sweep"]


def test_lab_loads_no_engine() -> None:
    code = "import sys\nfrom statemachine import lab\nprint({'mujoco', 'rich'} & set(sys.modules))"
    assert of_python("-c", code, code=0).stdout.strip() == "set()"


def test_lab_lists_its_names_and_knows_no_other() -> None:
    names = {"compare", "why", "one_step", "converge", "engines", "versions", "models"}
    assert names <= set(dir(lab))
    assert not hasattr(lab, "comparre")


# What a side is.


def test_a_model_is_a_side_as_its_file_is(light: str, heavy: str) -> None:
    typed = lab.compare(light, heavy, what=swing, seconds=0.2, chaos=False)
    loaded = lab.compare(sm.load(light), sm.load(heavy), what=swing, seconds=0.2, chaos=False)
    assert loaded.to_dict() == typed.to_dict()
    assert max(typed.to_dict()["max"]) > 1e-3


def test_a_replaced_model_is_the_side_with_that_option(light: str) -> None:
    model = sm.load(light)
    typed = lab.compare(light, f"{light} damping=2", what="hold", seconds=0.2, chaos=False)
    loaded = lab.compare(model, model.replace(damping=2.0), what="hold", seconds=0.2, chaos=False)
    assert loaded.to_dict() == typed.to_dict()


def test_a_model_that_was_changed_by_hand_is_run_as_it_is(light: str, heavy: str) -> None:
    changed = sm.load(light)
    changed.raw.dof_damping[:] = 1.5
    by_hand = lab.compare(light, changed, what=swing, seconds=0.2, chaos=False)
    by_option = lab.compare(light, f"{light} damping=1.5", what=swing, seconds=0.2, chaos=False)
    assert by_hand.to_dict()["max"] == by_option.to_dict()["max"]


def test_a_model_of_another_engine_is_a_side(light: str) -> None:
    result = lab.compare(
        sm.load(light), sm.load(light, backend="pybullet"), what="hold", seconds=0.1, chaos=False
    )
    assert [side.engine for side in result.request.run.sides] == ["mujoco", "pybullet"]


def test_an_option_of_what_is_run_is_put_into_a_model(light: str) -> None:
    """Gravity switches actuators off, in a Model that has them as in a file."""
    model = sm.load(light)
    loaded = lab.compare(
        model, model.replace(damping=2.0), what="gravity", seconds=0.2, chaos=False
    )
    assert loaded.run.left.header.options["actuation"] is False
    typed = lab.compare(light, f"{light} damping=2", what="gravity", seconds=0.2, chaos=False)
    assert loaded.to_dict()["max"] == typed.to_dict()["max"]


def test_finer_steps_of_a_model_are_finer_than_its_own(light: str) -> None:
    model = sm.load(light)
    sides = model.replace(substeps=2), model.replace(substeps=2, damping=2.0)
    typed = f"{light} substeps=2", f"{light} substeps=2 damping=2"
    assert (
        lab.converge(*sides, what="hold", seconds=0.1).to_dict()
        == lab.converge(*typed, what="hold", seconds=0.1).to_dict()
    )


def test_causes_of_two_models_are_found(light: str) -> None:
    model = sm.load(light)
    result = lab.why(model, model.replace(damping=2.0), what=swing, seconds=0.3, chaos=False)
    table = result.to_dict()
    assert "damping" in table["cause"][0]
    assert sum(table["share"]) == pytest.approx(1.0, abs=0.01)


def test_one_step_of_two_models_names_the_stage(light: str) -> None:
    model = sm.load(light)
    result = lab.one_step(model, model.replace(damping=2.0), what=swing, seconds=0.1)
    assert result.first is not None
    assert result.first.stage == "passive"


# What is run.


def closure_of(size: float) -> Callable[[sm.Model, sm.Data], list[float]]:
    return lambda model, data: [size] * model.nu


class Policy:
    """A controller that keeps something, as an object that can be called."""

    def __call__(self, model: sm.Model, data: sm.Data) -> list[float]:
        return [0.3] * model.nu


def gained(model: sm.Model, data: sm.Data, gain: float) -> list[float]:
    return [gain] * model.nu


@pytest.mark.parametrize(
    "function",
    [closure_of(0.3), Policy(), partial(gained, gain=0.3)],
    ids=["closure", "object", "partial"],
)
def test_anything_that_can_be_called_is_run(function: Any, light: str, heavy: str) -> None:
    constant = lab.compare(
        light, heavy, what=lambda model, data: [0.3, 0.3], seconds=0.1, chaos=False
    )
    result = lab.compare(light, heavy, what=function, seconds=0.1, chaos=False)
    assert result.to_dict()["max"] == constant.to_dict()["max"]


def test_a_function_is_run_as_that_of_a_file(light: str, heavy: str, tmp_path: Path) -> None:
    file = written(
        tmp_path / "own.py",
        "import numpy as np\n\n\ndef swing(model, data):\n"
        "    return np.full(model.nu, 0.4 * np.sin(5 * data.time))\n",
    )
    of_file = lab.compare(light, heavy, what=f"{file}:swing", seconds=0.2, chaos=False)
    of_function = lab.compare(light, heavy, what=swing, seconds=0.2, chaos=False)
    assert of_function.to_dict() == of_file.to_dict()


@pytest.mark.parametrize(
    "function", [lambda state: None, lambda model, data, gain: None, lambda: None]
)
def test_another_signature_is_refused_with_what_to_write(function: Any, light: str) -> None:
    for ask in (
        lambda: lab.compare(light, light, what=function),
        lambda: lab.why(light, light, what=function),
        lambda: record(sm.load(light), function, 0.1),
    ):
        with pytest.raises(BadInputError, match=r"write def controller\(model, data\)") as refused:
            ask()
        assert "\n" not in str(refused.value)


def test_what_goes_wrong_in_a_function_is_said_with_its_time(light: str) -> None:
    def fails(model: sm.Model, data: sm.Data) -> None:
        if data.time > 0.05:
            raise ValueError("no more")

    with pytest.raises(BadInputError, match=r"at 0\.05\d s: ValueError: no more"):
        lab.compare(light, light, what=fails, seconds=0.2)


def test_traces_and_their_files_are_compared_alike(light: str, heavy: str, tmp_path: Path) -> None:
    traces = [record(sm.load(file), swing, 0.2) for file in (light, heavy)]
    files = [
        write(trace, tmp_path / f"{name}.npz") for name, trace in zip("ab", traces, strict=True)
    ]
    of_traces = lab.compare(what=traces)
    assert of_traces.to_dict() == lab.compare(what=[str(file) for file in files]).to_dict()
    assert of_traces.run.commands == "recorded"


def test_a_trace_is_played_on_two_models(light: str, heavy: str) -> None:
    trace = record(sm.load(light), swing, 0.2)
    result = lab.compare(sm.load(light), sm.load(heavy), what=trace, chaos=False)
    assert np.array_equal(result.run.left.qpos, trace.qpos)


# Requests.


def test_a_request_is_handed_over(light: str, heavy: str) -> None:
    first = lab.compare(light, heavy, what=swing, seconds=0.1, chaos=False)
    assert lab.compare(first.request).to_dict() == first.to_dict()


def test_what_was_run_is_asked_another_question(light: str, heavy: str) -> None:
    first = lab.compare(light, heavy, what=swing, seconds=0.2, chaos=False)
    result = lab.why(first.request.run, quantity="elbow", chaos=False)
    assert result.request.run is first.request.run
    assert result.quantity == "elbow"


@pytest.fixture
def asked_for_much(light: str, heavy: str) -> CompareResult:
    """The answer to a question with every kind of argument."""
    return lab.compare(
        light,
        heavy,
        what=swing,
        seconds=0.1,
        timestep=0.001,
        every=2,
        names={"elbow": "elbow"},
        tolerances={"joint": "1deg", "tip": 0.01},
        uncertainty="0.1deg",
    )


def test_arguments_of_a_run_are_in_the_request(asked_for_much: CompareResult) -> None:
    run = asked_for_much.request.run
    assert (run.seconds, run.every, run.options) == (0.1, 2, {"timestep": 0.001})
    assert dict(run.names) == {"elbow": "elbow"}


def test_tolerances_of_the_request_are_in_si_units(asked_for_much: CompareResult) -> None:
    tolerances = asked_for_much.request.tolerances
    assert tolerances == {"joint": pytest.approx(np.radians(1)), "tip": 0.01}


def test_an_uncertainty_of_the_start_makes_a_floor(asked_for_much: CompareResult) -> None:
    uncertainty = asked_for_much.request.uncertainty
    assert isinstance(uncertainty, Uncertainty)
    assert (uncertainty.length, uncertainty.angle) == (0.0, pytest.approx(np.radians(0.1)))
    assert asked_for_much.floor is not None


REFUSED: list[tuple[Callable[[str], object], str]] = [
    (lambda file: lab.compare(file, file), "what is to be run"),
    (lambda file: lab.compare(sm.load(file), what="hold"), "a loaded Model has one engine"),
    (lambda file: lab.compare(f"{file}@pybullet", what="hold"), "one side only"),
    (lambda file: lab.compare(None, file, what="hold"), "no left one"),
    (lambda file: lab.compare(file, file, what=7), "what is run is an experiment"),  # pyright: ignore
    (lambda file: lab.compare(7, file, what="hold"), "a side is"),  # pyright: ignore
    (lambda file: lab.compare(file, what="hold", names={"a": "b"}), "names is of two sides"),
    (lambda file: lab.compare(file, file, what="hold", floor="up"), "floor must be"),  # pyright: ignore
    (
        lambda file: lab.compare(file, file, what="hold", backends=("mujoco", "mujoco")),
        "backends goes without sides",
    ),
    (
        lambda file: lab.compare(file, file, what="hold", uncertainty="1deg", chaos=False),
        "leave chaos=False out",
    ),
    (
        lambda file: lab.compare(
            lab.CompareRequest(lab.Request(("hold",), model=file)), seconds=3.0
        ),
        "a CompareRequest says all that is asked: leave seconds out",
    ),
    (
        lambda file: lab.why(lab.Request(("hold",), model=file), seconds=3.0),
        "a Request says what is run",
    ),
    (lambda file: lab.models(sm.load(file).replace(damping=2.0), file), "options of a run"),
    (lambda file: lab.models(file), "name two descriptions"),
    (lambda file: lab.versions(file, what="hold"), "name releases"),
]


@pytest.mark.parametrize(("ask", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_what_contradicts_itself_is_refused(
    ask: Callable[[str], object], says: str, light: str
) -> None:
    with pytest.raises(StateMachineError, match=re.escape(says)):
        ask(light)


def test_an_engine_that_is_mistyped_is_told(light: str) -> None:
    with pytest.raises(UnknownNameError, match="mujoco"):
        lab.compare(light, f"{light}@mujcoo", what="hold")


# What a result shows.


@pytest.mark.slow
def test_print_shows_what_the_command_prints(light: str, heavy: str) -> None:
    words = ("compare", "hold", light, heavy, "--seconds", "0.1", "--no-chaos")
    printed = of_python("-m", "statemachine", *words, code=1).stdout
    result = lab.compare(light, heavy, what="hold", seconds=0.1, chaos=False)
    option, call = "--details", "`result.text(details=True)`"
    assert str(result).replace(call, option).split() == printed.split()
    assert not wide_lines(str(result).splitlines())
    assert "\x1b" not in str(result)


@pytest.mark.slow
def test_details_are_the_page_of_that_option(light: str, heavy: str) -> None:
    words = ("compare", "hold", light, heavy, "--seconds", "0.1", "--no-chaos", "--details")
    printed = of_python("-m", "statemachine", *words, code=1).stdout
    result = lab.compare(light, heavy, what="hold", seconds=0.1, chaos=False)
    assert result.text(details=True) == printed.strip("\n")


def test_what_cannot_be_typed_is_asked_next_from_python(light: str) -> None:
    model = sm.load(light)
    result = lab.compare(model, model.replace(damping=2.0), what=swing, seconds=0.2, chaos=False)
    assert "lab.why(left, right, what=swing, seconds=0.2, quantity=" in str(result)
    assert "statemachine compare" not in str(result)


@pytest.fixture(params=["compare", "why", "one_step", "converge", "models"])
def any_result(request: pytest.FixtureRequest, light: str, heavy: str) -> Any:
    if request.param == "models":
        return lab.models(light, heavy)
    ask = getattr(lab, request.param)
    more = {"chaos": False} if request.param in ("compare", "why") else {}
    return ask(light, heavy, what="hold", seconds=0.1, **more)


def test_a_table_has_columns_of_one_length_and_type(any_result: Any) -> None:
    """Arrow refuses what a frame of pandas or Polars could not hold as one type."""
    arrow = pytest.importorskip("pyarrow")
    columns = any_result.to_dict()
    table = arrow.table(columns)
    assert table.num_rows >= 1
    assert table.column_names == list(columns)
    for library in ("pandas", "polars"):
        try:
            frames = __import__(library)
        except ImportError:
            continue
        assert len(frames.DataFrame(columns)) == table.num_rows


def test_a_notebook_gets_html_with_tables_and_folds_and_no_script(any_result: Any) -> None:
    html = any_result._repr_html_()  # as a notebook shows it
    assert html.startswith('<div class="statemachine-result">')
    assert "<table>" in html
    assert "<details>" in html
    assert "<script" not in html


def test_the_styles_of_a_result_in_a_notebook_stay_inside(any_result: Any) -> None:
    style = re.search(r"<style>(.*?)</style>", any_result._repr_html_(), re.S)
    assert style is not None
    rules = re.findall(r"([^{}]+)\{", style[1])
    assert len(rules) > 10
    selectors = [selector.strip() for rule in rules for selector in rule.split(",")]
    assert [each for each in selectors if not each.startswith(".statemachine-result")] == []


def test_no_page_of_python_says_an_option_of_the_command(any_result: Any) -> None:
    commands = [line for line in str(any_result).splitlines() if line.startswith("    ")]
    rest = [line for line in str(any_result).splitlines() if line not in commands]
    assert "--details" not in "\n".join(rest)
    assert "--details" not in re.sub(r"<pre.*?</pre>", "", any_result._repr_html_(), flags=re.S)


def test_where_a_page_has_more_it_says_what_to_call(light: str, heavy: str) -> None:
    result = lab.models(light, heavy)
    assert "result.text(details=True)" in str(result)
    assert result.text(details=True) != str(result)


def test_a_name_of_a_file_is_no_markup(tmp_path: Path, light: str) -> None:
    other = written(
        tmp_path / "b.xml",
        TWO_LINKS.format(mass=0.4, **LINKS).replace("elbow", "&lt;b&gt;elbow&lt;/b&gt;"),
    )
    assert "<b>elbow" not in lab.models(light, str(other))._repr_html_()


def test_a_result_is_one_line_in_a_list(any_result: Any) -> None:
    assert "\n" not in repr(any_result)
    assert repr(any_result).startswith(f"<{type(any_result).__name__}: ")


def test_json_is_that_of_the_command(light: str, heavy: str) -> None:
    words = ("compare", "hold", light, heavy, "--seconds", "0.1", "--one-step", "--json")
    printed = of_python("-m", "statemachine", *words, code=1).stdout
    assert lab.one_step(light, heavy, what="hold", seconds=0.1).to_json() == printed.strip()


# Files.


@pytest.mark.parametrize(("name", "begins"), [("a.xml", b"<?xml"), ("a.html", b"<!doctype html>")])
def test_a_file_of_a_comparison_is_written(
    name: str, begins: bytes, light: str, heavy: str, tmp_path: Path
) -> None:
    result = lab.compare(light, sm.load(heavy), what=swing, seconds=0.1, chaos=False)
    file = lab.write(result, tmp_path / name, why=False)
    assert file.read_bytes().lower().startswith(begins)


def test_another_suffix_is_refused_with_those_there_are(
    light: str, heavy: str, tmp_path: Path
) -> None:
    result = lab.compare(light, heavy, what="hold", seconds=0.1, chaos=False)
    with pytest.raises(BadInputError, match=r"\.html.*got 'a\.foo'"):
        lab.write(result, tmp_path / "a.foo")


# Sweeps.


@pytest.fixture
def swept(light: str, tmp_path: Path) -> Any:
    """A sweep of a parameter of a function."""
    pytest.importorskip("joblib")

    def own(model: sm.Model, data: sm.Data, gain: float = 1.0) -> list[float]:
        return [0.1 * gain] * model.nu

    return lab.sweep(
        own,
        light,
        vary={"gain": [1.0, 2.0]},
        backends=("mujoco",),
        seconds=0.1,
        jobs=1,
        out=tmp_path / "runs",
    )


def test_a_sweep_runs_a_function_with_each_value_of_its_parameter(swept: Any) -> None:
    table = swept.to_dict()
    assert sorted(table["vary.gain"]) == [1.0, 2.0]
    assert table["error"] == [None, None]
    assert table["qpos"][0] != table["qpos"][1]


def test_what_a_sweep_varies_is_in_its_request_as_it_would_be_typed(swept: Any) -> None:
    assert swept.request.sweep.vary == ("gain=1,2",)


def test_a_sweep_prints_a_page_of_its_cells(swept: Any) -> None:
    assert "cells" in str(swept)
