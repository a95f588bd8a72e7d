"""Files of one run or two: checks before anything runs, then figures, films, tests, pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...atomic_files import check_place, replace_text
from ...backends import load
from ...engines.pictures import Renderer, renderer_here, renderers
from ...errors import MissingEngineError, ModelFileError, StateMachineError, UnknownNameError
from ...interface import Model
from ...models import AnyPath
from ...show.blocks import Page
from ...show.charts import check_suffix, require_matplotlib
from ...show.drawing import Drawing, drawing_of
from ...show.html import check_target, write_report
from ..compare import Comparison
from ..compare.alike import with_bodies_of
from ..compare.chaos import ChaosFloor
from ..compare.sides import Request
from ..recordings import Trace
from ..runs.provenance import provenance
from ..runs.reporter import QUIET, Reporter
from . import film as films
from . import plot
from .junit import junit
from .stage.page import report


@dataclass(frozen=True)
class RunFiles:
    """Files that are to be written of one run, or of two and how far apart they are.

    Attributes:
        html: A page of two runs, .html.
        junit: Each quantity of a comparison as a test of JUnit, .xml.
        plot: A figure, .svg, .png or .pdf.
        film: A film, .webp.
    """

    html: Path | None = None
    junit: Path | None = None
    plot: Path | None = None
    film: Path | None = None

    def check(self, reporter: Reporter = QUIET) -> None:
        """Check all of them before anything runs.

        Args:
            reporter: Told what is missing that a file can do without.

        Raises:
            BadInputError: A file has another suffix, or cannot be written.
            MissingEngineError: An extra is missing.
        """
        if self.html is not None:
            check_target(self.html)
            try:
                require_matplotlib()
            except MissingEngineError as error:
                reporter.note(f"the page will have no charts: {error}")
        if self.plot is not None:
            check_suffix(self.plot)
        if self.film is not None:
            films.check_film(self.film)
        for file in (self.junit, self.plot, self.film):
            if file is not None:
                check_place(file)


@dataclass(frozen=True)
class ShownModels:
    """Models that runs are drawn with.

    Attributes:
        files: A name or a file for each run; None for the one that its trace names.
        menagerie: A menagerie folder to look them up in.
        own_names: Whether the bodies of a trace go by the names of another side's file, so that
            it is drawn by those of its own.
    """

    files: Sequence[AnyPath | None]
    menagerie: AnyPath | None = None
    own_names: bool = False

    @classmethod
    def of(cls, run: Request) -> ShownModels:
        """Return what both runs of a comparison are drawn with."""
        if run.sides:
            return cls([side.path for side in run.sides], run.menagerie, own_names=True)
        return cls([run.model, run.model], run.menagerie)

    def load(self, number: int, trace: Trace) -> tuple[AnyPath, Model, bool]:
        """Load the model of a run.

        Args:
            number: Of the run.
            trace: Of the run.

        Returns:
            Its file, the Model, and whether the file is as the trace was recorded with it.

        Raises:
            StateMachineError: It cannot be loaded.
        """
        recorded = trace.header.provenance
        file = self.files[number] or recorded.model_file
        model = load(file, menagerie=self.menagerie)
        return file, model, provenance(model).model_sha256 == recorded.model_sha256


def find_renderer(reporter: Reporter = QUIET) -> Renderer:
    """Return what draws a film here; note it if it is not the first choice.

    Raises:
        MissingEngineError: Nothing here can.
    """
    with reporter.stage("looking for OpenGL"):
        renderer = renderer_here()
    if renderer.name != renderers()[0]:
        reporter.note(f"no OpenGL here: the film is drawn by {renderer}")
    return renderer


def write_tests(file: Path, comparisons: Sequence[Comparison]) -> None:
    """Write comparisons as tests of JUnit."""
    replace_text(file, junit(comparisons))


def write_figure(
    file: Path,
    traces: Sequence[Trace],
    comparison: Comparison | None = None,
    floor: ChaosFloor | None = None,
    reporter: Reporter = QUIET,
) -> None:
    """Draw a figure of one run, or of two, and note its size.

    Args:
        file: Where to write it.
        traces: One, or the two of a comparison.
        comparison: Of the two.
        floor: The chaos floor of the comparison.
        reporter: Told how it gets on.
    """
    with reporter.stage("figure"):
        if comparison is None:
            figure = plot.of_trace(traces[0])
        else:
            figure = plot.of_comparison(comparison, floor)
        size = plot.write_plot(figure, file)
    reporter.note(f"{file}: a figure, {_bytes(size)}")


def write_film(
    file: Path,
    traces: Sequence[Trace],
    shown_models: ShownModels,
    renderer: Renderer,
    comparison: Comparison | None = None,
    reporter: Reporter = QUIET,
) -> None:
    """Make a film of one run, or of two, and note what came of it.

    Args:
        file: Where to write it.
        traces: One, or the two of a comparison.
        shown_models: What they are drawn with.
        renderer: What draws, from `find_renderer`.
        comparison: Of the two.
        reporter: Told how it gets on.

    Raises:
        ModelFileError: A model is not here.
    """
    models = [_filmed(shown_models, number, trace, reporter) for number, trace in enumerate(traces)]
    if shown_models.own_names:
        traces = [with_bodies_of(trace, model) for trace, model in zip(traces, models, strict=True)]
    with reporter.stage("film") as progress:
        film = films.write_film(file, traces, models, renderer, comparison, progress=progress)
    reporter.note(
        f"{film.path}: a film of {film.seconds:.3g} s, {film.pictures} pictures, "
        f"{_bytes(film.size)}, drawn by {film.renderer}"
    )


def _bytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{max(1, round(size / 1000))} kB"


def _filmed(shown_models: ShownModels, number: int, trace: Trace, reporter: Reporter) -> Model:
    """Return what a run is filmed with; note it where it was recorded with another."""
    try:
        file, model, is_same = shown_models.load(number, trace)
    except (ModelFileError, UnknownNameError) as error:
        raise ModelFileError(f"a film needs the model: {error}; name it behind the trace") from None
    if not is_same:
        reporter.note(
            f"the film shows {file} as it is here; the trace of {trace.header.label} was "
            "recorded with another state of that file"
        )
    return model


def write_page(file: Path, traces: Sequence[Trace], shown_models: ShownModels, page: Page) -> str:
    """Write a page of two runs that stands alone, and return what was written, in a line.

    Args:
        file: Where to write it.
        traces: The two runs.
        shown_models: What they are drawn with.
        page: What it says.
    """
    left, right = (trace.header for trace in traces)
    look = _look(shown_models, 0, traces[0])
    looks = [look, look]
    if (left.provenance.model_sha256, left.bodies) != (right.provenance.model_sha256, right.bodies):
        looks[1] = _look(shown_models, 1, traces[1])
    text = report(page, looks)
    target = write_report(file, text)
    return f"wrote {target} ({len(text.encode()) / 1e6:.2f} MB)"


def _look(shown_models: ShownModels, number: int, trace: Trace) -> Drawing | str:
    """Return what a run is drawn as on a page, or why that cannot be had."""
    file = trace.header.provenance.model_file
    try:
        _, model, is_same = shown_models.load(number, trace)
        if model.nbody != len(trace.header.bodies):
            return f"{file} as it is here has other bodies"
        return drawing_of(model) if is_same else f"{file} as it is here has another digest"
    except MissingEngineError as error:
        return str(error)
    except StateMachineError:
        return f"there is no {file} here"
