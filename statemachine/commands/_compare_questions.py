"""Questions to `statemachine compare` beside how far apart: what of a step, why, what of a file.

--one-step, --converge and --versions say of what it is a difference, --why which difference
explains how much of it, and --models compares two files before anything moves.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..errors import BadInputError, StateMachineError
from ..installed import PAIR
from ._common import (
    JOBS,
    PARTS,
    PROGRAM,
    REPEATED,
    Row,
    chosen_backends,
    complain,
    pairs_of,
    refuse,
    show,
)
from ._compare_files import write_tests

OF_STEPS: tuple[Row, ...] = (
    (
        "--one-step",
        "",
        "one step on each side from each state of the left one: the first stage that differs",
    ),
    (
        "--converge",
        "",
        "run with steps as given, halved and quartered: what vanishes is discretisation",
    ),
    (
        "--versions",
        "V,V,…",
        "run on releases of MuJoCo, and on the one that is installed: between which it changes",
    ),
    (
        "--bisect",
        "",
        "with --versions V: add releases since V until it is known which one changed it",
    ),
)


def run_steps(options: argparse.Namespace, request: Any) -> int:
    """Answer, and show.

    Args:
        options: `one_step` and `json` are read.
        request: The `compare.Request`; not of recorded traces alone.
    """
    asked = {"--one-step": _one_step, "--converge": _converge, "--versions": _versions}
    flag = "--one-step" if options.one_step else "--converge" if options.converge else "--versions"
    refuse(
        (
            request.is_traces and not request.sides,
            f"{flag} runs both sides, and a trace is a run that was made: {PROGRAM} compare hold",
        ),
        (
            options.versions and request.sides,
            f"--versions runs one model: {PROGRAM} compare hold FILE --versions {options.versions}",
        ),
    )
    return asked[flag](options, request)


def _one_step(options: argparse.Namespace, request: Any) -> int:
    from ..compare import prepare_sides
    from ..compare.labels import numbered
    from ..compare.one_step import one_step
    from ..report import steps
    from ..report.terminal import progress

    (left, right), _, _ = prepare_sides(request)
    with progress("one step") as bar:
        result = one_step(left, right.model, names=request.names, progress=bar)
    labels = numbered(tuple(side.label for side in request.sides) or request.backends)
    return show(steps.one_step(result, labels, Path(request.what[0]).name), result, options.json)


def _converge(options: argparse.Namespace, request: Any) -> int:
    from ..compare import run_sides
    from ..compare.convergence import convergence
    from ..report import steps
    from ..report.terminal import progress

    def with_more(options: dict[str, Any], usual: int, times: int) -> dict[str, Any]:
        return {**options, "substeps": options.get("substeps", usual) * times}

    def run(times: int) -> Any:
        given = request.options.get("substeps", 1)
        sides = tuple(
            replace(side, options=with_more(side.options, given, times)) for side in request.sides
        )
        both = with_more(request.options, 1, times)
        return run_sides(replace(request, options=both, sides=sides)).traces

    with progress("converge") as bar:
        result = convergence(run, progress=bar)
    return show(steps.convergence(result, Path(request.what[0]).name), result, options.json)


def _versions(options: argparse.Namespace, request: Any) -> int:
    from ..compare import compare, run_sides
    from ..measures import parse_tolerances
    from ..releases import around_a_change, backends_of, published
    from ..report import steps
    from ..report.figures import write_pictures
    from ..report.terminal import progress
    from ..runs.drive import part_of

    tolerances = parse_tolerances(options.tolerance)

    def compared(pair: tuple[str, str], *bar: Any) -> Any:
        traces = run_sides(replace(request, backends=pair), *bar).traces
        return compare(*traces, tolerances=tolerances)

    if options.bisect:
        backends = around_a_change(
            published(options.versions), compared, lambda text: complain(text, 0)
        )
    else:
        backends = backends_of(options.versions)
    pairs = list(pairwise(backends))
    with progress("versions") as bar:
        comparisons = [
            compared(pair, part_of(bar, k / len(pairs), 1 / len(pairs)))
            for k, pair in enumerate(pairs)
        ]
    write_tests(options, comparisons)
    page = steps.versions(comparisons, request)
    if options.plot is not None:
        write_pictures(page.blocks, options.plot)
    return show(page, comparisons, options.json)


OF_WHY: tuple[Row, ...] = (
    ("--why", "", "which difference explains how much of the gap"),
    ("--quantity", "NAME", "what the gap is measured in, such as joints, one joint or a body"),
    (
        "--measure",
        None,
        "which figure of the gap is explained (worst)",
        {"choices": ("worst", "end", "rms")},
    ),
    ("--finer", "", "every difference by its entries"),
    ("--budget", "N", "how many sets of causes may be run where they interact (200)"),
    JOBS,
)


def run_why(options: argparse.Namespace, request: Any) -> int:
    """Explain, and show.

    Args:
        options: Those of the command.
        request: A `compare.Request` that names what is run.
    """
    from ..report import why
    from ..report.terminal import progress

    with progress("why") as bar:
        result = explain(options, request, bar)
    said = (*request.taken, *([why.PLAYED] if request.is_traces else []))
    return show(why.page(result, said), result, options.json)


def explain(options: argparse.Namespace, request: Any, progress: Any) -> Any:
    """The explanation of what two sides differ in.

    Args:
        options: Those of the command.
        request: A `compare.Request`.
        progress: Told the fraction that is done.
    """
    from ..compare import why
    from ..compare.alike import for_left
    from ..compare.perturbed import parse_uncertainty
    from ..compare.sides import with_options
    from ..compare.two_sides import recorded_sides

    if request.is_traces:
        asked, sides, traces = recorded_sides(request)
    else:
        asked, traces = request.scenario(), ()
        sides = request.both_sides(asked.model)
    left_label, right_label = (side.label for side in sides)
    sides, given = with_options(sides, {**asked.options, **request.options})
    left, right = (side.load() for side in sides)
    question = why.WhyRequest(
        left,
        right,
        replace(asked, options=given),
        recordings=tuple(
            for_left(t, model, request) for t, model in zip(traces, (left, right), strict=False)
        ),
        seconds=request.seconds,
        seed=request.seed,
        names=request.names,
        quantity=options.quantity,
        measure=options.measure or "worst",
        finer=options.finer,
        budget=200 if options.budget is None else options.budget,
        labels=None if left_label == right_label else (left_label, right_label),
        uncertain=None if options.no_chaos else parse_uncertainty(options.uncertainty),
        jobs=options.jobs,
    )
    return why.explain(question, progress)


OF_MODELS: tuple[Row, ...] = (
    (
        "--models",
        "NAME|FILE",
        "two models, URDF or MJCF, before anything moves; FILE@ENGINE:engine, or --backend twice "
        "and one model: what an engine itself makes of it",
        {"nargs": "*"},
    ),
    ("--frame", "LEFT=RIGHT", "a frame of the left and what the right calls it", REPEATED),
    ("--all", "", "a row for every figure that differs"),
)


def run_models(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..compare.models import compare
    from ..compare.sides import is_trace, parse_sides
    from ..report import model_diff
    from ..report.terminal import progress
    from ..runs.controllers import is_function
    from ..runs.scenarios import SCENARIOS

    refuse(
        (
            any(word in SCENARIOS or is_trace(word) or is_function(word) for word in options.what),
            f"--models compares descriptions, and runs nothing: {PROGRAM} compare --models "
            f"{' '.join(options.what[1:] or ['LEFT', 'RIGHT'])}; to run something, type "
            f"{PROGRAM} compare {' '.join([*options.what, *options.models])}",
        ),
        (options.seed < 0, f"--seed must not be negative; got {options.seed}"),
    )
    words = [*options.what, *options.models]
    sides = [side for word in words for side in parse_sides([word], options.menagerie)]
    # The file itself, unless an engine is named.
    engines = [None if s.file == word else s.engine for s, word in zip(sides, words, strict=True)]
    refuse(
        (
            options.backend and any(engines),
            "--backend and FILE@ENGINE say the same: give one of them",
        ),
        (
            any(side.options for side in sides),
            "--models compares what the files say, without options of a run",
        ),
    )
    if options.backend:
        engines = [backend.name for backend in chosen_backends(options.backend)]
        sides *= 3 - len(sides)
    refuse(
        (
            len(sides) != 2 or len(engines) != 2,
            f"--models wants two models, or one and --backend A --backend B; got {len(words)}",
        )
    )
    files = [side.file for side in sides]
    if engines[0] is not None and (files[0], engines[0]) == (files[1], engines[1]):
        raise BadInputError(
            f"both sides are what {engines[0]} itself makes of {files[0]}: name two engines, or "
            "two files"
        )
    with progress("compare"):
        result = compare(
            *files,
            engines=(engines[0], engines[1]),
            frames=pairs_of(options.frame, "--frame"),
            rename=pairs_of(options.map, "--map"),
            seed=options.seed,
            menagerie=options.menagerie,
        )
    typed = [
        f"{file}@{engine}" if engine else file for file, engine in zip(files, engines, strict=True)
    ]
    return show(model_diff.page(result, typed, options.all), result, options.json)


def for_page(
    options: argparse.Namespace, request: Any, traces: Sequence[Any], ended: bool
) -> dict[str, Any]:
    """What a page says besides: causes, what each engine makes of the model, what was typed."""
    more = {"models": _models(request, traces), "command": _typed(options, request)}
    if options.no_why or ended:
        return more
    if any(trace.header.recorded for trace in traces):
        says = (
            "What causes it was not looked for: one side is a recorded run, and causes are found "
            "by running both again."
        )
        return {**more, "why_not": says}
    from ..report.terminal import progress

    try:
        with progress("why") as bar:
            return {**more, "explanation": explain(options, request, bar)}
    except StateMachineError as error:
        return {**more, "why_not": f"What causes it could not be found: {error}."}


def _models(request: Any, traces: Sequence[Any]) -> Any:
    """The page of what each engine makes of the model; None where that cannot be read."""
    recorded = [trace.header.provenance.model_file for trace in traces]
    names = [side.path for side in request.sides] or recorded
    engines = tuple(trace.header.backend for trace in traces)
    sides = [f"{Path(name).name}@{engine}" for name, engine in zip(names, engines, strict=True)]
    if engines[0] == engines[1] and names[0] == names[1]:
        return None
    from ..compare.models import compare
    from ..report.model_diff import page

    files = [request.model or name for name in names]
    given = {"engines": engines, "rename": request.names, "menagerie": request.menagerie}
    try:
        return page(compare(*files, **given), sides)
    except (StateMachineError, OSError):
        return None


def _typed(options: argparse.Namespace, request: Any) -> str:
    """The command as typed, without folders of this machine."""
    from ..compare.labels import typed_option
    from ..measures.text import command

    words = [PROGRAM, "compare", *request.words, *(side.label for side in request.sides)]
    words += [typed_option(*o) for o in request.options.items() if o[0] != "timestep"]
    if not request.sides and tuple(request.backends) != PAIR:
        words += [word for backend in request.backends for word in ("--backend", backend)]
    return command(
        words,
        ("--menagerie", request.menagerie and "DIR", None),
        ("--seconds", request.seconds, None),
        ("--timestep", request.options.get("timestep"), None),
        ("--seed", request.seed, 0),
        ("--every", request.every, 1),
        ("--keyframe", request.keyframe, None),
        *(("--map", f"{a}={b}", None) for a, b in request.names.items()),
        *(("--tolerance", text, None) for text in options.tolerance),
        *((f"--{part}", getattr(options, part), None) for part in PARTS),
        *(("--uncertainty", text, None) for text in options.uncertainty),
        ("--no-chaos", options.no_chaos, False),
        ("--quantity", options.quantity or None, None),
        ("--no-why", options.no_why, False),
        ("--html", Path(options.html).name, None),
    )
