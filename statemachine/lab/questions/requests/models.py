"""What two descriptions of a robot differ in, before anything moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

from ....backends import load_to_run
from ....engines.description.file_changes import UnwrittenChange
from ....engines.description.lines import SourceLine
from ....errors import BadInputError
from ....interface import Model
from ....models import AnyPath, resolve
from ....show.blocks import Page
from ....show.first_screen import first_that_fits
from ...model_differences import ModelsComparison, Value, compare
from ...model_differences.page import ever_shorter
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of
from ...why.rewriting import RewriteRequest, RewrittenFile, check_target, rewrite
from ...why.rewritten_page import rewritten_blocks

_MOST_ROWS = 8  # of what was written, without details
_ONLY_TEXT = "only the text of the file tells of it, and no compiled model does"


@dataclass(frozen=True)
class ModelsRequest:
    """Question what two descriptions of a robot differ in.

    Attributes:
        models: A name or a path of each, URDF or MJCF, as `load` takes it.
        engines: For each the engine that it is asked of; None for the file itself. Of "pybullet"
            what its backend supplies in a run does not matter; of "pybullet:engine" it does.
        frames: Frames of the left that go by other names on the right.
        names: Joints, links and frames of the left that go by other names on the right.
        seed: Of the poses at which both are compared, at least 0.
        menagerie: A menagerie folder to look names up in.
        write: Where the right's file is written with the left's values; None for nowhere.
    """

    models: tuple[AnyPath, AnyPath]
    engines: tuple[str | None, str | None] = (None, None)
    frames: Mapping[str, str] = field(default_factory=dict[str, str])
    names: Mapping[str, str] = field(default_factory=dict[str, str])
    seed: int = 0
    menagerie: AnyPath | None = None
    write: AnyPath | None = None

    def __post_init__(self) -> None:
        if len(self.models) != 2 or len(self.engines) != 2:
            raise BadInputError(f"two files are compared, each of one engine or none; got {self}")
        if self.seed < 0:
            raise BadInputError(f"--seed must not be negative; got {self.seed}")
        if self.write is not None and self.engines != (None, None):
            raise BadInputError("--write brings one file to another one: name no engine")
        left, right = zip(self.models, self.engines, strict=True)
        if left == right and left[1] is not None:
            raise BadInputError(
                f"both sides are what {left[1]} itself makes of {left[0]}: "
                "name two engines, or two files"
            )


@dataclass(frozen=True, repr=False)
class ModelsResult(ShownResult, ModelsComparison):
    """Every difference between two descriptions of a robot, and what was asked.

    Attributes:
        request: What was asked.
        rewritten: The right's file with the left's values; None where none was to be written.
    """

    page_function: ClassVar[str] = "model_differences.page:page"

    request: ModelsRequest = field(kw_only=True, metadata={"json": False})
    rewritten: RewrittenFile | None = field(kw_only=True, default=None)

    def page(self, details: bool = False) -> Page:
        """Return the page, with what was written at its end."""
        rewritten = self.rewritten
        if rewritten is None:
            return super().page(details)
        if not details:
            return first_that_fits(self._shorter_pages(rewritten))
        page = super().page(details)
        return replace(page, blocks=[*page.blocks, *rewritten_blocks(rewritten)])

    def _shorter_pages(self, rewritten: RewrittenFile) -> Iterator[Page]:
        """Yield the page with ever fewer rows of differences, then of what was not written."""
        for refusals in range(_MOST_ROWS, -1, -1):
            blocks = rewritten_blocks(rewritten, refusals)
            for page in ever_shorter(self):
                yield replace(page, blocks=[*page.blocks, *blocks])

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each quantity of an element that is not the same in both.

        "left" and "right" are texts, for a value may be a number, several, or a word; lines are
        those of each file, None where they are not known.
        """
        rows = self.differences
        columns = columns_of(rows, ("subject", "kind", "element", "quantity", "unit"))
        columns["left"] = [_text_of(row.left) for row in rows]
        columns["right"] = [_text_of(row.right) for row in rows]
        columns |= columns_of(rows, ("size", "share", "effect", "matters"))
        columns["left_line"] = [_number_of(row.left_line) for row in rows]
        columns["right_line"] = [_number_of(row.right_line) for row in rows]
        return columns


def _number_of(line: SourceLine | None) -> int | None:
    """Return the number of a line of a file; None where it is not known."""
    return None if line is None else line.line


def _text_of(value: Value) -> str | None:
    """Return a value as a file has it; None where the file does not say."""
    if value is None:
        return None
    if isinstance(value, tuple):
        return " ".join(f"{number:.15g}" for number in value)
    return str(value)


def answer(request: ModelsRequest, reporter: Reporter = QUIET) -> ModelsResult:
    """Find every difference between two descriptions.

    Raises:
        StateMachineError: A file cannot be read, or an engine is missing.
    """
    paths = [resolve(model, request.menagerie) for model in request.models]
    if request.write is not None:
        check_target(Path(request.write), paths[0], paths[1])
    with reporter.stage("compare"):
        differences = compare(
            *request.models,
            engines=request.engines,
            frames=request.frames,
            rename=request.names,
            seed=request.seed,
            menagerie=request.menagerie,
        )
        rewritten = None
        if request.write is not None:
            rewritten = _rewritten(request, differences, Path(request.write))
    return ModelsResult(**vars(differences), request=request, rewritten=rewritten)


def _rewritten(
    request: ModelsRequest, differences: ModelsComparison, target: Path
) -> RewrittenFile:
    """Write the right's file with the left's values.

    Args:
        request: What was asked.
        differences: What both files differ in.
        target: The file that is written.
    """

    def load(model: AnyPath) -> Model:
        return load_to_run(model, menagerie=request.menagerie)

    left, right = (load(model) for model in request.models)
    written, _ = rewrite(RewriteRequest(left, right, target, load, request.names))
    only_text = [
        UnwrittenChange(f"{row.quantity} of {row.element}", _ONLY_TEXT)
        for row in differences.differences
        if row.matters and not row.cause
    ]
    return replace(written, not_written=(*written.not_written, *only_text))
