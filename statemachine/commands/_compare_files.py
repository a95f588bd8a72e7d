"""Files of a comparison: options, what is checked before the runs, and a page, tests, pictures."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from ..errors import MissingEngineError, ModelFileError, StateMachineError, UnknownNameError
from ._common import Row, complain, file_name

OF_PAGE: tuple[Row, ...] = (
    (
        "--html",
        "PAGE.html",
        "write a report that stands alone: both runs in 3D, curves, figures, what causes it",
    ),
    ("--no-why", "", "with --html: skip the search for causes"),
)
OF_TESTS = (
    "--junit",
    "FILE",
    "write each quantity as a test of JUnit, for CI",
    {"type": file_name},
)
OF_PICTURES: tuple[Row, ...] = (
    ("--plot", "FILE", "write a figure: .svg, .png or .pdf", {"type": file_name}),
    ("--film", "FILE", "write a film of both sides: .webp", {"type": file_name}),
)


def checked(options: argparse.Namespace) -> Any:
    """What draws the film, before anything runs; None where none is asked for.

    Raises:
        BadInputError: A file has another suffix or cannot be written, or a figure is invalid.
        MissingEngineError: An extra is missing, or nothing here can draw a film.
    """
    from ..runs.whole import check_place

    given = vars(options)
    if given.get("html") is not None:
        from ..report.figures import require_matplotlib
        from ..report.html import check_target

        check_target(options.html)
        try:
            require_matplotlib()
        except MissingEngineError as error:
            complain(f"the page will have no charts: {error}", 0)
    if options.plot is not None:
        from ..report.figures import check_suffix

        check_suffix(options.plot)
    if given.get("film") is not None:
        from ..report import film as films

        films.check_film(options.film)
    for file in filter(None, (given.get("junit"), options.plot, given.get("film"))):
        check_place(file)
    return _renderer() if given.get("film") else None


def _renderer() -> Any:
    """Return what draws a film here; say so if it is not the first choice."""
    from ..engines.pictures import renderer_here, renderers
    from ..report.terminal import progress

    with progress("looking for OpenGL"):
        renderer = renderer_here()
    if renderer.name != renderers()[0]:
        complain(f"no OpenGL here: the film is drawn by {renderer}", 0)
    return renderer


def write_tests(options: argparse.Namespace, comparisons: Sequence[Any]) -> None:
    """Write comparisons as tests where `--junit` says."""
    from ..report.compare import junit
    from ..runs.whole import replace_text

    if options.junit is not None:
        replace_text(options.junit, junit(comparisons))


def write_pictures(
    renderer: Any,
    options: argparse.Namespace,
    traces: Sequence[Any],
    request: Any = None,
    comparison: Any = None,
    floor: Any = None,
) -> None:
    """Write what was asked for; a line for each file on standard error.

    Args:
        renderer: From `checked`.
        options: `plot` and `film`; `model`, of one trace, and `menagerie` say
            what it shows, if not the traces.
        traces: One, or the two of a comparison.
        request: The `compare.Request`; its sides, or its model, say what a film of it shows.
        comparison: Of the two.
        floor: The chaos floor of the comparison, or None.
    """
    from ..report.terminal import progress

    if options.plot is not None:
        from ..report import plot

        with progress("figure"):
            figure = (
                plot.of_comparison(comparison, floor)
                if comparison is not None
                else plot.of_trace(*traces)
            )
            size = plot.write_plot(figure, options.plot)
        complain(f"{options.plot}: a figure, {_bytes(size)}", 0)
    if options.film is not None:
        from ..report import film as films

        models = [_filmed(options, request, *numbered) for numbered in enumerate(traces)]
        if request and request.sides:
            from ..compare.alike import with_bodies_of

            traces = [with_bodies_of(*side) for side in zip(traces, models, strict=True)]
        with progress("film") as bar:
            film = films.write_film(
                options.film,
                traces,
                models,
                renderer,
                comparison,
                progress=bar,
            )
        complain(
            f"{film.path}: a film of {film.seconds:.3g} s, {film.pictures} pictures, "
            f"{_bytes(film.size)}, drawn by {film.renderer}",
            0,
        )


def _bytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{max(1, round(size / 1000))} kB"


def _model_of(
    options: argparse.Namespace, request: Any, place: int, trace: Any
) -> tuple[Any, Any, bool]:
    """The file of a side, its model, and whether it is as the trace was recorded with it."""
    from ..backends import load
    from ..runs.header import provenance

    known, sides = trace.header.provenance, request.sides if request else ()
    file = sides[place].path if sides else (request or options).model or known.model_file
    model = load(file, menagerie=options.menagerie)
    return file, model, provenance(model).model_sha256 == known.model_sha256


def _filmed(options: argparse.Namespace, request: Any, place: int, trace: Any) -> Any:
    """What a trace is filmed with; a word where it is not what it was recorded with."""
    try:
        file, model, same = _model_of(options, request, place, trace)
    except (ModelFileError, UnknownNameError) as error:
        raise ModelFileError(f"a film needs the model: {error}; name it behind the trace") from None
    if not same:
        complain(
            f"the film shows {file} as it is here; the trace of {trace.header.label} was "
            "recorded with another state of that file",
            0,
        )
    return model


def _look(options: argparse.Namespace, request: Any, place: int, trace: Any) -> Any:
    """What a side is drawn as on a page, or why that cannot be had."""
    from ..drawing import drawing_of

    file = trace.header.provenance.model_file
    try:
        _, model, same = _model_of(options, request, place, trace)
        if model.nbody != len(trace.header.bodies):
            return f"{file} as it is here has other bodies"
        return drawing_of(model) if same else f"{file} as it is here has another digest"
    except MissingEngineError as error:
        return str(error)
    except StateMachineError:
        return f"there is no {file} here"


def write_page(options: argparse.Namespace, request: Any, traces: Sequence[Any], page: Any) -> None:
    """Write a page of two runs where `--html` says."""
    from ..report.html import report, write_report

    looks = [_look(options, request, 0, traces[0])]
    a, b = (trace.header for trace in traces)
    same = (a.provenance.model_sha256, a.bodies) == (b.provenance.model_sha256, b.bodies)
    looks.append(looks[0] if same else _look(options, request, 1, traces[1]))
    text = report(page, looks)
    target = write_report(options.html, text)
    print(f"wrote {target} ({len(text.encode()) / 1e6:.2f} MB)", file=sys.stderr)
