"""`statemachine compare EXPERIMENT --html FILE`: the comparison as one page that stands alone."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ..errors import MissingEngineError, StateMachineError
from ..installed import PAIR
from ._common import PARTS, PROGRAM, Row, complain

OPTIONS: tuple[Row, ...] = (
    (
        "--html",
        "PAGE.html",
        "write a report that stands alone: both runs in 3D, curves, figures, what causes it",
    ),
    ("--no-why", "", "with --html: skip the search for causes"),
)


def check(options: argparse.Namespace) -> None:
    """Whether the report can be written, before anything is run.

    Raises:
        BadInputError: It cannot.
    """
    if options.html is None:
        return
    from ..report.figures import require_matplotlib
    from ..report.html import check_target

    check_target(options.html)
    try:
        require_matplotlib()
    except MissingEngineError as error:
        complain(f"the page will have no charts: {error}", 0)


def write(
    options: argparse.Namespace,
    request: Any,
    comparison: Any,
    traces: tuple[Any, Any],
    said: tuple[str, ...],
    witness: Any = None,
    run: Any = None,
    played: Any = None,
    floor: Any = None,
) -> None:
    """Look for causes and shapes, and write the page.

    Args:
        options: `html`, `no_why` and `tolerance` are read.
        request: The `compare.Request`.
        comparison: What was found.
        traces: Both sides.
        said: What stood in for a run.
        witness: The third party's figures, or None.
        run: The `compare.SidesRun`, if sides were given.
        played: The figures of its open loop, if that is another run.
        floor: The chaos floor, or None.
    """
    from ..report import compare as pages
    from ..report.html import report, write_report

    explanation, why_not = None, ""
    if not (options.no_why or comparison.ended):
        explanation, why_not = _why(options, request, traces)
    page = pages.page(
        comparison,
        *traces,
        said=said,
        witness=witness,
        explanation=explanation,
        why_not=why_not,
        models=_models(request, traces),
        command=_typed(options, request),
        run=run,
        played=played,
        floor=floor,
    )
    text = report(page, _looks(request, traces))
    target = write_report(options.html, text)
    print(f"wrote {target} ({len(text.encode()) / 1e6:.2f} MB)", file=sys.stderr)


def _why(options: argparse.Namespace, request: Any, traces: tuple[Any, Any]) -> tuple[Any, str]:
    """The explanation, or why there is none."""
    if any(trace.header.recorded for trace in traces):
        return None, (
            "What causes it was not looked for: one side is a recorded run, and causes are found "
            "by running both again."
        )
    from ..report.progress import progress
    from ._compare_why import explain

    try:
        with progress("why") as told:
            return explain(options, request, told), ""
    except StateMachineError as error:
        return None, f"What causes it could not be found: {error}."


def _models(request: Any, traces: tuple[Any, Any]) -> Any:
    """The page of what each engine makes of the model; None where that cannot be read."""
    recorded = [trace.header.provenance.model_file for trace in traces]
    names = [side.path for side in request.sides] or recorded
    engines = tuple(trace.header.backend for trace in traces)
    if engines[0] == engines[1] and names[0] == names[1]:
        return None
    from ..compare.models import compare
    from ..report.model_diff import page

    files = [request.model or name for name in names]
    try:
        return page(
            compare(
                *files,
                engines=engines,
                rename=request.names,
                menagerie=request.menagerie,
            )
        )
    except (StateMachineError, OSError):
        return None


def _looks(request: Any, traces: tuple[Any, Any]) -> tuple[Any, Any]:
    """What each side is drawn as: its model, if it is the one that the trace is of."""
    one = _look(request, traces[0], 0)
    a, b = (trace.header for trace in traces)
    same = (a.provenance.model_sha256, a.bodies) == (b.provenance.model_sha256, b.bodies)
    return one, one if same else _look(request, traces[1], 1)


def _look(request: Any, trace: Any, place: int) -> Any:
    """What a side is drawn as, or why that cannot be had."""
    from ..backends import load
    from ..drawing import drawing_of
    from ..runs.provenance import provenance

    header = trace.header
    file = header.provenance.model_file
    wanted = request.sides[place].path if request.sides else request.model or file
    try:
        model = load(wanted, menagerie=request.menagerie)
        if model.nbody != len(header.bodies):
            return f"{file} as it is here has other bodies"
        if provenance(model).model_sha256 != header.provenance.model_sha256:
            return f"{file} as it is here has another digest"
        return drawing_of(model)
    except MissingEngineError as error:
        return str(error)
    except StateMachineError:
        return f"there is no {file} here"


def _typed(options: argparse.Namespace, request: Any) -> str:
    """The command as typed, without folders of this machine."""
    from ..measures.text import command

    words = [PROGRAM, "compare", *(Path(word).name for word in request.what)]
    words += [side.label for side in request.sides]
    if not request.sides and tuple(request.backends) != PAIR:
        words += ["--backends", *request.backends]
    return command(
        words,
        ("--defaults", request.defaults, "model"),
        ("--model", request.model and Path(request.model).name, None),
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
