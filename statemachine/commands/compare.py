"""`statemachine compare`: where two engines part, by how much, and why."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BadInputError, EndedEarlyError
from ..installed import PAIR
from ..typed_numbers import typed_int
from ._common import (
    EXPERIMENTS,
    PROGRAM,
    SIDES,
    TerminalReporter,
    add_backend,
    add_jobs,
    add_json,
    add_menagerie,
    add_seconds,
    add_seed,
    add_timestep,
    complain,
    experiments,
    file_name,
    flag_of,
    is_given,
    pairs_of,
    shorten_help,
    show,
)

if TYPE_CHECKING:
    from ..compare import Request, Side
    from ..compare.perturbed import Uncertainty
    from ..compare.questions.causes import ExplainRequest
    from ..compare.questions.converge import ConvergeRequest
    from ..compare.questions.gap import CompareRequest, CompareResult
    from ..compare.questions.models import ModelsRequest
    from ..compare.questions.one_step import OneStepRequest
    from ..compare.questions.versions import VersionsRequest
    from ..engines.pictures import Renderer
    from ..interface.options import OptionValue
    from ..report.run_files import RunFiles, ShownModels

    Question = (
        CompareRequest
        | ExplainRequest
        | OneStepRequest
        | ConvergeRequest
        | VersionsRequest
        | ModelsRequest
    )

_PARTS = ("actuators", "floor")  # of a file, that another side can have, too


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Run something on two sides, or open recorded traces, and compare: each quantity\n"
        "with its tolerance and a verdict. An experiment alone, or with one FILE, runs on\n"
        "both engines; the ctrl of one trace is played on the other engine.\n\n"
        "A side is FILE, FILE@ENGINE or FILE@ENGINE:engine (as the engine's own users\n"
        "meet it), and options behind it, such as timestep=0.002 contacts=off:\n"
        f"  {PROGRAM} compare hold A.xml\n"
        f"  {PROGRAM} compare hold A.xml@mujoco B.urdf@pybullet\n"
        f"  {PROGRAM} compare hold so101 timestep=0.002 so101 timestep=0.001\n"
        f"  {PROGRAM} compare walk.py:policy A.xml B.xml --every 5 --keyframe home\n"
        f"  {PROGRAM} compare run.npz A.xml B.xml"
    )
    parser.epilog = (
        f"experiments:\n{experiments()}\n\n"
        "Exit code 1: something differs, or a run ends before its time; with --why, but\n"
        "without --html: something stays unexplained, or is only a weak hint."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "what",
        nargs="*",
        metavar="WHAT",
        help="what is run: an experiment, FILE.py:FUNCTION or a recorded TRACE; then nothing, a "
        "model for both engines, two sides, or a second trace",
    )
    add_backend(
        parser,
        "the left's engine, and once more the right's: mujoco, pybullet, pybullet:engine (as "
        "its own users meet it) or a release, mujoco==3.3.7 (default mujoco and pybullet)",
    )
    add_menagerie(parser)
    add_seconds(parser)
    add_timestep(parser)
    add_seed(parser, "what is drawn")
    parser.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="KIND=VALUE",
        help="another tolerance, such as joint=0.5deg, tip=2mm, energy=0.1J",
    )
    parser.add_argument(
        "--uncertainty",
        action="append",
        default=[],
        metavar="SIZE",
        help="how uncertain the start of your robot is, such as 0.1mm or 0.1deg",
    )
    parser.add_argument(
        "--no-chaos", action="store_true", help="do not look for the chaos floor: faster"
    )
    parser.add_argument(
        "--html",
        metavar="PAGE.html",
        help="write a report that stands alone: both runs in 3D, curves, figures, what causes it",
    )
    parser.add_argument(
        "--no-why", action="store_true", help="with --html: skip the search for causes"
    )
    add_json(parser)
    parser.add_argument(
        "--junit",
        type=file_name,
        metavar="FILE",
        help="write each quantity as a test of JUnit, for CI",
    )
    _add_sides(parser.add_argument_group("two sides"))
    _add_why(parser.add_argument_group("why"))
    _add_steps(parser.add_argument_group("is it a difference, and of what?"))
    _add_pictures(parser.add_argument_group("pictures"))
    _add_models(parser.add_argument_group("comparing descriptions of a robot"))
    first = ("what", "backend", "why", "html", "converge", "seconds", "tolerance", "one_step")
    shorten_help(parser, first=(*first, "versions", "models", "json"))


def _add_sides(group: argparse._ArgumentGroup) -> None:
    """Add the options of two sides."""
    group.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="LEFT=RIGHT",
        help="a joint, body, site or actuator of the left and its name on the right; of --models, "
        "too",
    )
    group.add_argument(
        "--actuators",
        choices=SIDES,
        metavar="SIDE",
        help="both sides have those of the left, or of the right",
    )
    group.add_argument(
        "--floor",
        choices=SIDES,
        metavar="SIDE",
        help="both have that of the left, or of the right",
    )
    group.add_argument(
        "--every",
        type=typed_int,
        metavar="N",
        help="steps for which what FUNCTION(model, data) returned holds (1)",
    )
    group.add_argument("--keyframe", metavar="NAME", help="where it starts, on both sides")


def _add_why(group: argparse._ArgumentGroup) -> None:
    """Add the options of the search for causes."""
    group.add_argument(
        "--why", action="store_true", help="which difference explains how much of the gap"
    )
    group.add_argument(
        "--quantity",
        metavar="NAME",
        help="what the gap is measured in, such as joints, one joint or a body",
    )
    group.add_argument(
        "--measure",
        choices=("worst", "end", "rms"),
        help="which figure of the gap is explained (worst)",
    )
    group.add_argument("--finer", action="store_true", help="every difference by its entries")
    group.add_argument(
        "--budget",
        type=typed_int,
        metavar="N",
        help="how many sets of causes may be run where they interact (200)",
    )
    add_jobs(group)


def _add_steps(group: argparse._ArgumentGroup) -> None:
    """Add the questions of what a difference is."""
    group.add_argument(
        "--one-step",
        action="store_true",
        help="one step on each side from each state of the left one: the first stage that differs",
    )
    group.add_argument(
        "--converge",
        action="store_true",
        help="run with steps as given, halved and quartered: what vanishes is discretisation",
    )
    group.add_argument(
        "--versions",
        metavar="V,V,…",
        help="run on releases of MuJoCo, and on the one that is installed: between which it "
        "changes",
    )
    group.add_argument(
        "--bisect",
        action="store_true",
        help="with --versions V: add releases since V until it is known which one changed it",
    )


def _add_pictures(group: argparse._ArgumentGroup) -> None:
    """Add the options of pictures."""
    group.add_argument(
        "--plot", type=file_name, metavar="FILE", help="write a figure: .svg, .png or .pdf"
    )
    group.add_argument(
        "--film", type=file_name, metavar="FILE", help="write a film of both sides: .webp"
    )


def _add_models(group: argparse._ArgumentGroup) -> None:
    """Add the options of comparing two files."""
    group.add_argument(
        "--models",
        nargs="*",
        metavar="NAME|FILE",
        help="two models, URDF or MJCF, before anything moves; FILE@ENGINE:engine, or --backend "
        "twice and one model: what an engine itself makes of it",
    )
    group.add_argument(
        "--frame",
        action="append",
        default=[],
        metavar="LEFT=RIGHT",
        help="a frame of the left and what the right calls it",
    )
    group.add_argument("--all", action="store_true", help="a row for every figure that differs")


# What options need of each other.


def check_options(options: argparse.Namespace) -> None:
    """Check that the options belong to what is asked.

    Raises:
        BadInputError: One does not.
    """
    _need(options, ("measure", "finer", "budget", "jobs"), ("why",))
    _need(options, ("quantity",), ("why", "html"))
    _need(options, ("no_why",), ("html",))
    _need(options, ("frame", "all"), ("models",))
    _exclude(options, "uncertainty", ("no_chaos",))
    other_answers = ("why", "html", "plot", "film", "models", "uncertainty", "tolerance")
    _exclude(options, "one_step", other_answers)
    _exclude(options, "converge", other_answers)
    _exclude(options, "versions", ("why", "html", "film", "models", "uncertainty", "backend"))
    _exclude(options, "one_step", ("converge",))
    _exclude(options, "junit", ("why", "one_step", "converge", "models"))
    _need(options, ("bisect",), ("versions",))
    _exclude(options, "versions", ("one_step", "converge"))
    of_a_run = (
        *("why", "quantity", "html", "plot", "film", "seconds", "timestep", "tolerance"),
        *("uncertainty", "every", "keyframe", *_PARTS),
    )
    if is_given(options, "models"):
        _refuse(options, of_a_run, "{} is of a run, and --models runs nothing")


def _need(options: argparse.Namespace, names: Iterable[str], others: Sequence[str]) -> None:
    """Check that options are given with one of some others only."""
    if not any(is_given(options, other) for other in others):
        _refuse(options, names, f"{{}} goes with {_either(others)}")


def _exclude(options: argparse.Namespace, name: str, others: Iterable[str]) -> None:
    """Check that an option is given with none of some others."""
    both = [other for other in others if is_given(options, other)]
    if both:
        _refuse(options, (name,), f"{{}} goes without {_either(both)}")


def _refuse(options: argparse.Namespace, names: Iterable[str], text: str) -> None:
    """Raise BadInputError for the first of these options that is given; {} is its flag."""
    for name in names:
        if is_given(options, name):
            raise BadInputError(text.format(flag_of(name)))


def _either(names: Iterable[str]) -> str:
    return " or ".join(flag_of(name) for name in names)


# What is asked.


def request_of(options: argparse.Namespace) -> Question:
    """Return what was asked for.

    Raises:
        BadInputError: What is typed contradicts itself, or is out of range.
        UnknownNameError: There is no such experiment, model, backend or kind of quantity.
    """
    from ..compare.questions.converge import ConvergeRequest
    from ..compare.questions.gap import CompareRequest
    from ..compare.questions.one_step import OneStepRequest
    from ..compare.questions.versions import VersionsRequest
    from ..measures import parse_tolerances

    if options.models is not None:
        return _models_request_of(options)
    if not options.what:
        raise BadInputError(
            f"compare what? An experiment ({', '.join(EXPERIMENTS)}), FILE.py:FUNCTION or traces: "
            f"{PROGRAM} compare hold"
        )
    run = run_of(options)
    if options.one_step:
        return OneStepRequest(run)
    if options.converge:
        return ConvergeRequest(run)
    tolerances = parse_tolerances(options.tolerance)
    if options.versions is not None:
        return VersionsRequest(run, options.versions, options.bisect, tolerances)
    if options.why and options.html is None:
        return _explain_request_of(options, run)
    if run.is_traces and len(run.what) == 2:
        _refuse(options, ["backend"], "{} is of a run, and two traces are runs that were made")
    return CompareRequest(run, tolerances, _uncertainty(options))


def _uncertainty(options: argparse.Namespace) -> Uncertainty | None:
    """Return how uncertain the start is; None where no chaos floor is asked for."""
    from ..compare.perturbed import parse_uncertainty

    return None if options.no_chaos else parse_uncertainty(options.uncertainty)


def _explain_request_of(options: argparse.Namespace, run: Request) -> ExplainRequest:
    """Return what is asked of causes, with --why or on a page."""
    from ..compare.questions.causes import ExplainRequest

    return ExplainRequest(
        run,
        quantity=options.quantity,
        measure=options.measure or "worst",
        finer=options.finer,
        budget=200 if options.budget is None else options.budget,
        uncertainty=_uncertainty(options),
        jobs=options.jobs,
    )


def run_of(options: argparse.Namespace) -> Request:
    """Return what is run on two sides, or which traces are opened."""
    from ..compare import Request, split_words

    what, sides = split_words(options.what, options.menagerie)
    common: dict[str, OptionValue] = {}
    if options.timestep is not None:
        common["timestep"] = options.timestep
    model = None
    if len(sides) == 1:  # of both engines
        model = sides[0].file
        common |= sides[0].options
        sides = ()
    _check_options_of_run(options, what, sides)
    names = pairs_of(options.map, "--map")
    if sides:
        sides = _with_parts(options, sides[0], sides[1], names)
    return Request(
        what=what,
        backends=_backends(options, what),
        model=model,
        menagerie=options.menagerie,
        seconds=options.seconds,
        seed=options.seed,
        options=common,
        sides=sides,
        names=names,
        every=1 if options.every is None else options.every,
        keyframe=options.keyframe,
    )


def _check_options_of_run(
    options: argparse.Namespace, what: Sequence[str], sides: Sequence[Side]
) -> None:
    """Check that an option of a run has a meaning for what is run.

    Raises:
        BadInputError: It has none.
    """
    from ..runs.controllers import is_function

    if sides:
        text = "{} goes without sides: each side names its engine: FILE@ENGINE"
        _refuse(options, ["backend"], text)
    else:
        _refuse(
            options, ("map", *_PARTS), f"{{}} is of two sides: {PROGRAM} compare hold LEFT RIGHT"
        )
    if not (len(what) == 1 and is_function(what[0])):
        _refuse(options, ["every"], "{} goes with FILE.py:FUNCTION")
    if options.every is not None and options.every < 1:
        raise BadInputError(f"--every wants a number of steps, at least 1; got {options.every}")


def _with_parts(
    options: argparse.Namespace, left: Side, right: Side, names: dict[str, str]
) -> tuple[Side, Side]:
    """Return two sides, each with the parts that it has of the other."""
    of_left = [part for part in _PARTS if getattr(options, part) == "left"]
    of_right = [part for part in _PARTS if getattr(options, part) == "right"]
    back = {there: here for here, there in names.items()}
    return left.taking(of_right, right, back), right.taking(of_left, left, names)


def _backends(options: argparse.Namespace, what: Sequence[str]) -> tuple[str, str]:
    """Return the two backends; one that is named is where a trace is played.

    Raises:
        BadInputError: There are not two.
        UnknownNameError: There is no such backend.
    """
    from ..backends.chosen import chosen_backends
    from ..compare.sides import is_trace

    if not options.backend:
        return PAIR
    chosen = [str(backend) for backend in chosen_backends(options.backend)]
    if len(chosen) == 1 and len(what) == 1 and is_trace(what[0]):
        return chosen[0], chosen[0]
    if len(chosen) != 2:
        raise BadInputError(
            "compare takes two engines, as in --backend mujoco --backend pybullet:engine; "
            f"got {' and '.join(chosen)}"
        )
    return chosen[0], chosen[1]


def _models_request_of(options: argparse.Namespace) -> ModelsRequest:
    """Return which files are compared."""
    from ..backends.chosen import chosen_backends
    from ..compare.questions.models import ModelsRequest
    from ..compare.sides import parse_sides

    _check_words_of_models(options)
    words = [*options.what, *options.models]
    sides = [side for word in words for side in parse_sides([word], options.menagerie)]
    # The file itself, unless an engine is named.
    engines = [None if s.file == word else s.engine for s, word in zip(sides, words, strict=True)]
    if options.backend and any(engines):
        raise BadInputError("--backend and FILE@ENGINE say the same: give one of them")
    if any(side.options for side in sides):
        raise BadInputError("--models compares what the files say, without options of a run")
    files = [side.file for side in sides]
    if options.backend:
        engines = [backend.name for backend in chosen_backends(options.backend)]
        if len(files) == 1:
            files *= 2
    if len(files) != 2 or len(engines) != 2:
        raise BadInputError(
            f"--models wants two models, or one and --backend A --backend B; got {len(words)}"
        )
    return ModelsRequest(
        files=(files[0], files[1]),
        engines=(engines[0], engines[1]),
        frames=pairs_of(options.frame, "--frame"),
        names=pairs_of(options.map, "--map"),
        seed=options.seed,
        menagerie=options.menagerie,
    )


def _check_words_of_models(options: argparse.Namespace) -> None:
    """Check that nothing is named that is run.

    Raises:
        BadInputError: Something is.
    """
    from ..compare.sides import is_trace
    from ..runs.controllers import is_function
    from ..runs.scenarios import SCENARIOS

    for word in options.what:
        if word in SCENARIOS or is_trace(word) or is_function(word):
            others = " ".join(options.what[1:]) or "LEFT RIGHT"
            run = " ".join([*options.what, *options.models])
            raise BadInputError(
                f"--models compares descriptions, and runs nothing: {PROGRAM} compare --models "
                f"{others}; to run something, type {PROGRAM} compare {run}"
            )


# The answers.


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..compare.questions.causes import ExplainRequest
    from ..compare.questions.converge import ConvergeRequest
    from ..compare.questions.models import ModelsRequest
    from ..compare.questions.one_step import OneStepRequest
    from ..compare.questions.versions import VersionsRequest

    check_options(options)
    _check_why_alone(options)
    match request_of(options):
        case ModelsRequest() as request:
            return _run_models(options, request)
        case OneStepRequest() as request:
            return _run_one_step(options, request)
        case ConvergeRequest() as request:
            return _run_converge(options, request)
        case VersionsRequest() as request:
            return _run_versions(options, request)
        case ExplainRequest() as request:
            return _run_explain(options, request)
        case request:
            return _run_compare(options, request)


def _check_why_alone(options: argparse.Namespace) -> None:
    """Check what goes with --why where no page is written.

    Raises:
        BadInputError: Something does not.
    """
    if not options.why or options.html is not None:
        return
    if options.tolerance:
        raise BadInputError("--why takes no --tolerance: it explains the gap, whatever its size")
    if options.plot is not None or options.film is not None:
        raise BadInputError("--why runs many times: --plot and --film go without it")


def _run_models(options: argparse.Namespace, request: ModelsRequest) -> int:
    """Compare two files."""
    from ..compare.questions.models import answer
    from ..report import model_diff

    result = answer(request, TerminalReporter())
    return show(model_diff.page(result, request.labels, options.all), result, options.json)


def _run_one_step(options: argparse.Namespace, request: OneStepRequest) -> int:
    """Compare one step of both sides."""
    from ..compare.labels import numbered
    from ..compare.questions.one_step import answer
    from ..report import steps

    run = request.run
    result = answer(request, TerminalReporter())
    labels = run.backends
    if run.sides:
        labels = run.sides[0].label, run.sides[1].label
    page = steps.one_step(result, numbered(labels), Path(run.what[0]).name)
    return show(page, result, options.json)


def _run_converge(options: argparse.Namespace, request: ConvergeRequest) -> int:
    """Run both sides with ever finer steps."""
    from ..compare.questions.converge import answer
    from ..report import steps

    result = answer(request, TerminalReporter())
    page = steps.convergence(result, Path(request.run.what[0]).name)
    return show(page, result, options.json)


def _run_versions(options: argparse.Namespace, request: VersionsRequest) -> int:
    """Compare each release with the next one."""
    from ..compare.questions.versions import answer
    from ..report import steps
    from ..report.figures import write_pictures
    from ..report.run_files import write_tests

    _files_of(options).check(TerminalReporter())
    comparisons = answer(request, TerminalReporter())
    if options.junit is not None:
        write_tests(options.junit, comparisons)
    page = steps.versions(comparisons, request.run)
    if options.plot is not None:
        write_pictures(page.blocks, options.plot)
    return show(page, comparisons, options.json)


def _run_explain(options: argparse.Namespace, request: ExplainRequest) -> int:
    """Explain the gap; of runs that end early, say what there is until then, and no cause."""
    from ..compare.questions.causes import answer
    from ..compare.questions.gap import CompareRequest
    from ..report import why

    try:
        result = answer(request, TerminalReporter())
    except EndedEarlyError as error:
        until_then = CompareRequest(request.run, uncertainty=request.uncertainty)
        return _run_compare(options, until_then, f"No cause is named: {error}.")
    lines = [*request.run.taken]
    if request.run.is_traces:
        lines.append(why.PLAYED)
    return show(why.page(result, lines), result, options.json)


def _run_compare(options: argparse.Namespace, request: CompareRequest, no_cause: str = "") -> int:
    """Compare both runs, write what is asked for, and show."""
    from ..compare.questions.gap import answer
    from ..report import comparison
    from ..report.run_files import find_renderer, write_page, write_tests

    reporter = TerminalReporter()
    files = _files_of(options)
    files.check(reporter)
    renderer = None if files.film is None else find_renderer(reporter)
    asked = None
    if files.html is not None and not options.no_why:
        asked = _explain_request_of(options, request.run)
    result = answer(request, reporter)
    if files.html is None:
        page = comparison.page(result, no_cause)
    else:
        page = comparison.whole_page(result, asked, _typed(options, request.run), reporter)
        line = write_page(files.html, result.run.traces, _shown(request.run), page)
        print(line, file=sys.stderr)
    if files.junit is not None:
        write_tests(files.junit, [result.comparison])
    if options.json:
        for line in (*result.run.unmatched, *result.run.said):
            complain(line, 0)
    code = show(page, result.figures(), options.json)
    _write_pictures(files, result, renderer)
    return code


def _files_of(options: argparse.Namespace) -> RunFiles:
    """Return the files that are to be written."""
    from ..report.run_files import RunFiles

    html = None if options.html is None else Path(options.html)
    return RunFiles(html=html, junit=options.junit, plot=options.plot, film=options.film)


def _shown(run: Request) -> ShownModels:
    """Return what both runs are drawn with."""
    from ..report.run_files import ShownModels

    if run.sides:
        return ShownModels([side.path for side in run.sides], run.menagerie, own_names=True)
    return ShownModels([run.model, run.model], run.menagerie)


def _write_pictures(files: RunFiles, result: CompareResult, renderer: Renderer | None) -> None:
    """Write the figure and the film that are asked for."""
    from ..report.run_files import write_figure, write_film

    reporter, traces = TerminalReporter(), result.run.traces
    if files.plot is not None:
        write_figure(files.plot, traces, result.comparison, result.floor, reporter)
    if files.film is not None and renderer is not None:
        shown = _shown(result.request.run)
        write_film(files.film, traces, shown, renderer, result.comparison, reporter)


def _typed(options: argparse.Namespace, run: Request) -> str:
    """Return the command that makes a page again, without folders of this machine."""
    from ..compare.labels import typed_option
    from ..measures.text import command

    words = [PROGRAM, "compare", *run.words, *(side.label for side in run.sides)]
    for name, value in run.options.items():
        if name != "timestep":
            words.append(typed_option(name, value))
    repeated = [(flag_of(part), getattr(options, part), None) for part in _PARTS]
    if not run.sides and tuple(run.backends) != PAIR:
        for backend in run.backends:
            words += ["--backend", backend]
    mapped = [("--map", f"{left}={right}", None) for left, right in run.names.items()]
    tolerances = [("--tolerance", text, None) for text in options.tolerance]
    uncertainties = [("--uncertainty", text, None) for text in options.uncertainty]
    return command(
        words,
        ("--menagerie", run.menagerie and "DIR", None),
        ("--seconds", run.seconds, None),
        ("--timestep", run.options.get("timestep"), None),
        ("--seed", run.seed, 0),
        ("--every", run.every, 1),
        ("--keyframe", run.keyframe, None),
        *mapped,
        *tolerances,
        *repeated,
        *uncertainties,
        ("--no-chaos", options.no_chaos, False),
        ("--quantity", options.quantity or None, None),
        ("--no-why", options.no_why, False),
        ("--html", Path(options.html).name, None),
    )
