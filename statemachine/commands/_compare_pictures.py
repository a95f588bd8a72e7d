"""Pictures of a comparison: the options, what is checked before the runs, and the files."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import ModelFileError, UnknownNameError
from ._common import Row, complain, file_name


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"a size reads like 640x480; got {text}")
    return int(width), int(height)


OF_FILM: tuple[Row, ...] = (
    ("--fps", "N", "of the film (default 30)", {"type": float, "default": 30.0}),
    ("--slow", "N", "of the film: N times slower", {"type": float, "default": 1.0}),
    ("--size", "WxH", "of the film (640x480)", {"type": _size, "default": (640, 480)}),
    (
        "--renderer",
        "NAME",
        "of the film: an engine that draws, or auto: the first that can here",
    ),
)
OPTIONS: tuple[Row, ...] = (
    ("--plot", "FILE", "write a figure: .svg, .png or .pdf", {"type": file_name}),
    ("--film", "FILE", "write a film of both sides: .webp or .mp4", {"type": file_name}),
    *OF_FILM,
)


def checked(options: argparse.Namespace) -> Any:
    """What draws the film, before anything runs; None where none is asked for.

    Raises:
        BadInputError: A file has another suffix or cannot be written, or a figure is none.
        MissingEngineError: An extra is missing, or nothing here can draw a film.
    """
    from ..runs.whole import check_place

    if options.plot is not None:
        from ..report import figures

        figures.check_suffix(options.plot)
        check_place(options.plot)
    renderer = None
    if options.film is not None:
        from ..engines.pictures import renderer_here, renderers
        from ..report import film as films
        from ..report.progress import progress

        films.check_film(options.film, options.size, options.fps, options.slow)
        check_place(options.film)
        with progress("looking for OpenGL"):
            asked = None if options.renderer == "auto" else options.renderer
            renderer = renderer_here(asked)
        if not asked and renderer.name != renderers()[0]:
            complain(f"no OpenGL here: the film is drawn by {renderer}", 0)
    return renderer


def write(
    renderer: Any,
    options: Any,
    one: Any,
    two: Any = None,
    comparison: Any = None,
    request: Any = None,
    floor: Any = None,
) -> None:
    """Write what was asked for; a line for each file on standard error.

    Args:
        renderer: From `checked`.
        options: `plot`, `film` and those of a film; `model` and `menagerie` say what it shows, if
            not the traces.
        one: A trace.
        two: The other one; None for pictures of one trace.
        comparison: Of the two.
        request: The `compare.Request`; its sides say what a film of theirs shows.
        floor: The chaos floor of the comparison, or None.
    """
    from ..report.progress import progress

    if options.plot is not None:
        from ..report import plot

        with progress("figure"):
            figure = (
                plot.of_trace(one)
                if two is None
                else plot.of_comparison(one, two, comparison, floor)
            )
            size = plot.write_plot(figure, options.plot)
        complain(f"{options.plot}: a figure, {_bytes(size)}", 0)
    if options.film is not None:
        from ..report import film as films

        files = [side.path for side in request.sides] if request else []
        traces = [trace for trace in (one, two) if trace is not None]
        models = _models(options, files, *traces)
        if files and two is not None:
            from ..compare.alike import with_bodies_of

            traces = [with_bodies_of(*side) for side in zip(traces, models, strict=True)]
        with progress("film") as told:
            film = films.write_film(
                options.film,
                traces,
                models,
                renderer,
                comparison,
                size=options.size,
                fps=options.fps,
                slow=options.slow,
                progress=told,
            )
        complain(
            f"{film.path}: a film of {film.seconds:.3g} s, {film.pictures} pictures, "
            f"{_bytes(film.size)}, drawn by {film.renderer}",
            0,
        )


def _models(options: Any, files: Any, *traces: Any) -> Any:
    """What the traces are drawn with; a word where it is not what they were recorded with."""
    from ..backends import load
    from ..runs.provenance import provenance

    models = []
    for k, trace in enumerate(traces):
        known = trace.header.provenance
        name = files[k] if files else options.model or known.model_file
        try:
            model = load(name, menagerie=options.menagerie)
        except (ModelFileError, UnknownNameError) as error:
            raise ModelFileError(f"a film needs the model: {error}; name it with --model") from None
        if provenance(model).model_sha256 != known.model_sha256:
            complain(
                f"the film shows {name} as it is here; the trace of {trace.header.label} was "
                "recorded with another state of that file",
                0,
            )
        models.append(model)
    return tuple(models)


def _bytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{max(1, round(size / 1000))} kB"
