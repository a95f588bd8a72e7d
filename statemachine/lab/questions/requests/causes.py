"""Which difference of two sides explains how much of their gap."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from ....engines.description.file_changes import UnwrittenChange
from ....engines.records import QuantityValue
from ....errors import BadInputError, StateMachineError, check_name
from ....interface import Model
from ....models import AnyPath
from ....processes import checked_jobs
from ...compare.alike import in_layout_of_left
from ...compare.bases import load_sides
from ...compare.labels import typed_option
from ...compare.perturbed import EXACT, Uncertainty
from ...compare.recorded import recorded_sides
from ...compare.sides import Request, Side, with_options
from ...compare.typed_command import typed_command
from ...runs.floating import Bases
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of
from ...why.case_of_cause import with_cited_case
from ...why.explain import explain
from ...why.explanation import Explanation, InterruptedExplanation, Share
from ...why.gap import Measure
from ...why.measured_gap import measured_gap
from ...why.ranking_page import ranking_page
from ...why.request import WhyRequest
from ...why.rewriting import RewriteRequest, check_target, rewrite
from ...why.right_options import options_of_right, with_options_of_right
from ...why.share_changes import with_changes

_PLAYED = "the models were run again, with the recorded starts and commands"
MEASURES: tuple[Measure, ...] = ("worst", "end", "rms")


@dataclass(frozen=True)
class ExplainRequest:
    """Question which difference of two sides explains how much of their gap.

    Attributes:
        run: What is run on two sides, or recorded traces, whose models are run again.
        quantity: What the gap is measured in, such as "joints", one joint or a body; None for what
            `why.explain` chooses.
        measure: Which figure of the gap is explained.
        finer: Whether every difference is divided into its entries.
        time_limit: After how long the search ends, by the clock [s], above 0: what is known by then
            is the answer; None for until all is known.
        uncertainty: How uncertain the start is, for the chaos floor; None for no floor.
        jobs: Number of processes; None for one a processor where that pays.
        write: Where the right's file is written with the left's values; None for nowhere.
    """

    run: Request
    quantity: str | None = None
    measure: Measure = "worst"
    finer: bool = False
    time_limit: float | None = None
    uncertainty: Uncertainty | None = EXACT
    jobs: int | None = None
    write: AnyPath | None = None

    def __post_init__(self) -> None:
        check_name("measure", self.measure, MEASURES)
        if self.write is not None and not (self.run.sides or self.run.is_traces):
            raise BadInputError("--write brings one file to another one: name two sides")
        if self.time_limit is not None and not self.time_limit > 0:
            raise BadInputError(
                f"--time-limit wants a number of seconds above 0; got {self.time_limit:g}"
            )
        checked_jobs(self.jobs)


@dataclass(frozen=True, repr=False)
class ExplainResult(ShownResult, Explanation):
    """Which difference explains how much of a gap, and what was asked.

    Attributes:
        request: What was asked.
    """

    page_function: ClassVar[str] = "why.page:page"

    request: ExplainRequest = field(kw_only=True, metadata={"json": False})

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each cause: the fields of `Share`.

        "left" and "right" are texts: each quantity that differs, with its value there. "least"
        and "most" are the ends of `Share.range`. "file" and "line" say where the right side's value
        stands, None where that is not known; "option" which option says it, "" where none does.
        """
        shares, places = self.shares, [share.place for share in self.shares]
        columns: dict[str, Column] = {"cause": [share.name for share in shares]}
        columns |= columns_of(shares, ("kind", "share", "error", "alone", "last"))
        ranges = [share.range for share in shares]
        columns["least"] = [None if ends is None else ends[0] for ends in ranges]
        columns["most"] = [None if ends is None else ends[1] for ends in ranges]
        columns["left"] = [_values_of(share, "left") for share in shares]
        columns["right"] = [_values_of(share, "right") for share in shares]
        columns["file"] = [None if place is None else place.file for place in places]
        columns["line"] = [None if place is None else place.line for place in places]
        columns["option"] = [share.option for share in shares]
        columns["note"] = [share.note for share in shares]
        return columns


def _values_of(share: Share, side: Literal["left", "right"]) -> str:
    """Return the values that a cause has on a side, as "kp=20; ctrlrange=-2 2"."""
    texts: list[str] = []
    for row in share.values:
        value: QuantityValue = row.left if side == "left" else row.right
        texts.append(f"{row.quantity}={_text_of(value)}")
    return "; ".join(texts)


def _text_of(value: QuantityValue) -> str:
    """Return a value with all of its digits."""
    if isinstance(value, str) or value is None:
        return str(value)
    return " ".join(f"{number:.15g}" for number in np.atleast_1d(value).tolist())


def answer(request: ExplainRequest, reporter: Reporter = QUIET) -> ExplainResult:
    """Explain what two sides differ in.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
        InterruptedExplanation: Ctrl-C; it holds the ExplainResult of what is known by then, and no
            file was written.
    """
    began = time.monotonic()  # loading counts
    question, sides, bases = _question(request, reporter)

    options = _options_of_right(request, question, sides)

    def so_far(explanation: Explanation) -> None:
        reporter.so_far(ranking_page(explanation))

    try:
        explanation = explain(question, reporter, so_far, began)
    except InterruptedExplanation as stop:
        explanation = _with_changes(stop.result, question, request, options)
        raise InterruptedExplanation(_result(explanation, request, bases)) from None
    explanation = _with_changes(explanation, question, request, options)
    with reporter.stage("why: the case that decides it"):
        try:
            explanation = with_cited_case(explanation, question)
        except KeyboardInterrupt:
            raise InterruptedExplanation(_result(explanation, request, bases)) from None
    if request.write is not None:
        target = Path(request.write)
        explanation = _with_file(explanation, question, sides, target, options)
    return _result(explanation, request, bases)


def _question(
    request: ExplainRequest, reporter: Reporter
) -> tuple[WhyRequest, Sequence[Side], Bases]:
    """Load both sides, and return the question about them, the sides as loaded, and their bases."""
    run = request.run
    with reporter.stage("why: loading"):
        if run.is_traces:
            asked, sides, traces = recorded_sides(run)
        else:
            asked, traces = run.scenario(), ()
            sides = run.both_sides(asked.model)
        labels = sides[0].label, sides[1].label
        sides, common = with_options(sides, {**asked.options, **run.options})
        if request.write is not None:
            inputs = [Path(word.partition(":")[0]) for word in run.what if isinstance(word, str)]
            check_target(Path(request.write), sides[0].path, sides[1].path, inputs)
        loaded = load_sides(sides, {}, run.names)
        models = loaded.models
        recordings = [
            in_layout_of_left(trace, model, run)
            for trace, model in zip(traces, models, strict=False)
        ]
        question = WhyRequest(
            models[0],
            models[1],
            replace(asked, options=common),
            recordings=tuple(recordings),
            seconds=run.seconds,
            seed=run.seed,
            names=run.names,
            quantity=request.quantity,
            measure=request.measure,
            finer=request.finer,
            time_limit=request.time_limit,
            labels=None if labels[0] == labels[1] else labels,
            uncertain=request.uncertainty,
            jobs=request.jobs,
            periods=run.call_periods((models[0].timestep, models[1].timestep)),
        )
        return question, sides, loaded.bases


def _with_changes(
    explanation: Explanation,
    question: WhyRequest,
    request: ExplainRequest,
    options: Mapping[str, str],
) -> Explanation:
    """Return an explanation with what to change of the right's file, or of its options."""
    names = request.run.names
    explanation = with_changes(explanation, question.left, question.right, names, request.finer)
    return with_options_of_right(explanation, question, options, request.finer)


def _options_of_right(
    request: ExplainRequest, question: WhyRequest, sides: Sequence[Side]
) -> dict[str, str]:
    """Return which option of the right, as it was typed, makes a difference, by its title.

    Args:
        request: What was asked.
        question: The same, of both sides as loaded.
        sides: The left and the right, with the options that only they have.
    """
    if not request.run.sides or sides[1].loaded is not None:
        return {}
    right = sides[1]
    models: dict[str, Model] = {}
    for name in request.run.sides[1].options:
        if name not in right.options:  # the left has it, too
            continue
        options = {key: value for key, value in right.options.items() if key != name}
        try:
            loaded = load_sides((sides[0], replace(right, options=options)), {}, request.run.names)
        except StateMachineError:  # it cannot be loaded without the option
            continue
        models[typed_option(name, right.options[name])] = loaded.models[1]
    return options_of_right(question, models, request.finer)


def _result(explanation: Explanation, request: ExplainRequest, bases: Bases) -> ExplainResult:
    """Return an explanation with what was typed, and what was asked."""
    run = request.run
    notes = [*run.notes_on_parts]
    if run.is_traces:
        notes.append(_PLAYED)
    words = words_of_why(request)
    if run.is_typed and request.uncertainty is None:
        words.append("--no-chaos")
    explanation = replace(
        explanation,
        notes=(*notes, *explanation.notes),
        command=typed_command(run, words),
        bases=bases,
    )
    facts = vars(explanation)
    return ExplainResult(**facts, request=request)


def words_of_why(request: ExplainRequest) -> list[str]:
    """Return the words that ask this question, without the time that it was given."""
    words = ["--why"]
    if request.quantity is not None:
        words += ["--quantity", request.quantity]
    if request.measure != "worst":
        words += ["--measure", request.measure]
    if request.run.is_typed and request.finer:
        words.append("--finer")
    return words


def _with_file(
    explanation: Explanation,
    question: WhyRequest,
    sides: Sequence[Side],
    target: Path,
    options: Mapping[str, str],
) -> Explanation:
    """Write the right's file with the left's values, and run it.

    Where nothing can be changed nothing is written, and nothing run.

    Args:
        explanation: What both sides differ in.
        question: What was asked.
        sides: The left and the right, as they are loaded.
        target: The file that is written.
        options: Which option of the right makes a difference, by its title.

    Returns:
        The explanation, with what was written.
    """
    names = {} if question.names is None else question.names

    def load(path: Path) -> Model:
        right = replace(sides[1], model=str(path), loaded=None)
        return load_sides((sides[0], right), {}, names).models[1]

    written, model = rewrite(
        RewriteRequest(question.left, question.right, target, load, names, options)
    )
    if written.written:
        quantity = explanation.quantity
        written = replace(
            written,
            gap=measured_gap(question, model, quantity, explanation.measure),
            before=explanation.gap,
            quantity=quantity,
            unit=explanation.unit,
        )
    further = [
        UnwrittenChange(row.name, row.not_written)
        for row in explanation.shares
        if row.kind in ("engine", "run")
    ]
    order = {share.name: number for number, share in enumerate(explanation.shares)}
    not_written = sorted(
        (*written.not_written, *further), key=lambda row: order.get(row.cause, len(order))
    )
    rewritten = replace(written, not_written=tuple(not_written))
    return replace(explanation, rewritten=rewritten)
