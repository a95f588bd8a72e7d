"""A table of models, and one model in detail, as a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ...measures.text import NO_NUMBER, count, figure, grouped, rough
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from .examine import TRIED
from .gaps import STEPS
from .records import (
    RUNS,
    TOLERANCE,
    BackendRow,
    Exactness,
    ExaminedModel,
    Loading,
    RunGap,
    WitnessRow,
)
from .survey import Survey

_WIDEST = 28  # characters of a name
_LISTED = 20  # of what is wrong, and of features

_MARKS = {None: NO_NUMBER, True: "✓", False: "✗"}


@dataclass(frozen=True)
class _Refusals:
    """What a backend refuses.

    Attributes:
        backend: Its name.
        features: Table of what it refuses, how often, and for how many models it alone stands in
            the way.
    """

    backend: str
    features: Table


@dataclass(frozen=True)
class RobotsPage(PageContent):
    """What the page of many models shows.

    Attributes:
        survey: What was found.
        models: Table with a row for each model.
        gaps: Table of the gaps of each, where there are several engines beside the default one.
        engines: Table with a row for each engine.
        grades: Table of what the witness read how often.
        refusals: Of each backend but the default one.
    """

    template = "robots.md.j2"
    survey: Survey
    models: Table
    gaps: Table
    engines: Table
    grades: Table
    refusals: Sequence[_Refusals]
    steps: int = STEPS
    tolerance: float = TOLERANCE
    most_listed: int = _LISTED
    experiments: Sequence[str] = TRIED

    @property
    def model_count(self) -> int:
        """Return the number of models."""
        return len(self.survey.models)

    @property
    def inside(self) -> list[str]:
        """Return the models whose shapes overlap at the start, each with the deepest pair."""
        return [f"{row.file}, {row.inside[0]}" for row in self.survey.models if row.inside]

    @property
    def wrong(self) -> list[str]:
        """Return all that contradicts, each with its model's file."""
        wrong = self.survey.wrong.items()
        return [f"{file}: {text}" for file, texts in wrong for text in texts]

    @property
    def wrong_listed(self) -> list[str]:
        """Return the first of what contradicts."""
        return self.wrong[:_LISTED]

    @property
    def wrong_unlisted(self) -> int:
        """Return the number of further contradictions."""
        return max(len(self.wrong) - _LISTED, 0)


@dataclass(frozen=True)
class _Stop:
    """Experiments that a backend does not run, and why."""

    experiments: Sequence[str]
    reason: str


@dataclass(frozen=True)
class _BackendRefusals:
    """What a backend refuses of one model, and of what it warns.

    Attributes:
        name: Of the backend.
        refusal: Why it does not load the model; "" if it does.
        refusal_without: The same with contacts off; "" if that is the same.
        warnings: What it told when it loaded the model.
        stops: Experiments that it does not run.
    """

    name: str
    refusal: str
    refusal_without: str
    warnings: Sequence[str]
    stops: Sequence[_Stop]


@dataclass(frozen=True)
class RobotPage(PageContent):
    """What the page of one model shows.

    Attributes:
        model: What was found.
        witness: What the witness says.
        facts: Table with a row for each fact and a column for each backend.
        backends: What each refuses.
        wrong: What contradicts.
    """

    template = "robots_one.md.j2"
    model: ExaminedModel
    witness: WitnessRow
    facts: Table
    backends: Sequence[_BackendRefusals]
    wrong: Sequence[str]

    @property
    def was_loaded(self) -> bool:
        """Tell whether an engine gave the sizes of the model."""
        return self.model.nq is not None


def page(survey: Survey, widest: int = _WIDEST) -> Page:
    """Return the table as a page; of one model alone, all that was found of it.

    Args:
        survey: What was found.
        widest: Characters of a model's name.
    """
    if survey.is_of_one_model:
        return _page_of_one(survey, survey.models[0])
    models, gaps = _tables(survey, widest)
    content = RobotsPage(
        survey,
        models=models,
        gaps=gaps,
        engines=_engines_table(survey),
        grades=_grades_table(survey),
        refusals=[_Refusals(other, _refused_features(survey, other)) for other in survey.others],
    )
    return render(content)


def _grades_table(survey: Survey) -> Table:
    """Return how many models the witness read in which way."""
    rows = [(grade, str(number)) for grade, number in survey.grades.items()]
    return Table(("reading", "models"), rows)


def _tables(survey: Survey, widest: int) -> tuple[Table, Table]:
    """Return a row for each model, and the gaps, in a table of their own where engines are several.

    A model is called by as much of the end of its path as tells it apart.
    """
    called = unique_ends([row.file for row in survey.models])

    def shortened(row: ExaminedModel) -> str:
        # The end of a long name tells more than its beginning.
        name = called[row.file]
        return name if len(name) <= widest else f"…{name[1 - widest :]}"

    columns: dict[str, Callable[[ExaminedModel], str]] = {
        "model": shortened,
        "bits": partial(_bits, survey),
    }
    gaps: dict[str, Callable[[ExaminedModel], str]] = {}
    for other in survey.others:
        of = f"{other}, " if len(survey.others) > 1 else ""
        gaps[f"{of}no contacts"] = partial(_gap, other=other, contacts=False)
        gaps[f"{of}contacts"] = partial(_gap, other=other, contacts=True)
    if len(survey.others) == 1:
        columns |= gaps
    columns["witness"] = _witness
    if survey.ran_experiments:
        columns |= {"runs": _runs, "cost": _costs}
    words = {"model", "bits", "witness", "runs"}
    table = Table.of(survey.models, columns, words=words, wide={"cost"})
    if len(survey.others) < 2:
        return table, Table((), [])
    return table, Table.of(survey.models, {"model": shortened, **gaps}, words={"model"})


def unique_ends(files: Sequence[str]) -> dict[str, str]:
    """Return by path the shortest end of it, in whole parts, that no other path has."""
    ends: dict[str, str] = {}
    counts = Counter(end for file in dict.fromkeys(files) for end in _ends(file))
    for file in files:
        ends[file] = next((end for end in _ends(file) if counts[end] == 1), file)
    return ends


def _ends(file: str) -> list[str]:
    """Return all ends of a path, in whole parts, the shortest first."""
    parts = Path(file).parts
    return ["/".join(parts[-k:]) for k in range(1, len(parts) + 1)]


def _runs(row: ExaminedModel) -> str:
    """Return how many experiments run, by backend."""
    tried = [backend.scenarios.values() for backend in row.backends.values() if backend.scenarios]
    numbers = [str(list(words).count(RUNS)) for words in tried]
    return ", ".join(numbers) if numbers else NO_NUMBER


def _costs(row: ExaminedModel) -> str:
    """Return what a step costs over the engine's own, by backend."""
    costs = [backend.cost for backend in row.backends.values() if backend.cost is not None]
    return " ".join(f"{cost:.3g}" for cost in costs) if costs else NO_NUMBER


_EXACTNESS: dict[Exactness, str] = {
    "ended": "ended",
    "refused": "no",
    "differs": "✗",
    "exact": "✓",
    "not asked": NO_NUMBER,
}


def _bits(survey: Survey, row: ExaminedModel) -> str:
    """Return whether all that must be equal to the bit is."""
    return _EXACTNESS[row.exactness(survey.default)]


def _gap(row: ExaminedModel, other: str, contacts: bool) -> str:
    """Return the size of a gap, or in a word what became of the comparison."""
    comparison = row.comparison(other, contacts)
    if comparison == "not compared":
        return NO_NUMBER
    gap = row.backends[other].gap(contacts)
    if gap is None or comparison in ("still", "explodes", "stops", "rounding"):
        return comparison
    size = figure(gap.largest)
    return f"{size} → 0" if comparison == "vanishes" else size


def _witness(row: ExaminedModel) -> str:
    if row.witness is None:
        return NO_NUMBER
    if row.witness.gap is None:
        return "refused"
    return f"{row.witness.grade.partition(' ')[0]} {rough(row.witness.gap)}"


def _engines_table(survey: Survey) -> Table:
    """Return how many models each engine loads, and what becomes of them."""
    rows: list[tuple[str, ...]] = []
    for tally in survey.engines:
        loaded = _known(tally.loads), _known(tally.only_without_contacts)
        gaps = _known(tally.within), _known(tally.rounding), _known(tally.vanishes)
        rows.append((tally.engine, *loaded, _known(tally.equals_engine), *gaps))
    return Table(_ENGINE_HEADERS, rows)


def _known(number: int | None) -> str:
    return NO_NUMBER if number is None else str(number)


_ENGINE_HEADERS = (
    "engine",
    "loads",
    "only without contacts",
    "bits of the engine",
    "within",
    "rounding",
    "vanishes",
)


def _refused_features(survey: Survey, other: str) -> Table:
    """Return what is refused, how often, and for how many models it alone stands in the way."""
    headers = ("feature", "models", "the only one in", "not with contacts off in")
    rows: list[tuple[str, ...]] = []
    for refused in survey.refused_features(other)[:_LISTED]:
        numbers = (refused.models, refused.alone, refused.loaded_without_contacts)
        rows.append((refused.feature, *map(str, numbers)))
    return Table(headers, rows)


def _page_of_one(survey: Survey, row: ExaminedModel) -> Page:
    """Return all that was found of one model."""
    content = RobotPage(
        row,
        row.witness or WitnessRow(),
        facts=_facts_table(row),
        backends=[_refusals(name, backend) for name, backend in row.backends.items()],
        wrong=row.wrong(survey.default),
    )
    return render(content)


_LOADING: dict[Loading, str] = {
    "with contacts": "✓",
    "without contacts": "with contacts off",
    "never": "no",
}


def _cost(row: BackendRow) -> str:
    return NO_NUMBER if row.cost is None else f"{row.cost:.3g} ×"


def _facts_table(row: ExaminedModel) -> Table:
    """Return a row for each fact that is known on any backend."""
    facts: dict[str, Callable[[BackendRow], str]] = {}
    facts["loads"] = lambda row: _LOADING[row.loading]
    facts["the bits of the engine without us"] = lambda row: _MARKS[row.equals_engine]
    facts["two futures of a State are one"] = lambda row: _MARKS[row.restores]
    facts["gap without contacts"] = lambda row: _gap_in_full(row.without_contacts)
    facts["gap with contacts"] = lambda row: _gap_in_full(row.with_contacts)
    facts |= {f"experiment {name}": partial(_scenario, name) for name in TRIED}
    facts["cost of a step over the engine's own, here"] = _cost
    rows = [(fact, *map(cell, row.backends.values())) for fact, cell in facts.items()]
    known = [cells for cells in rows if set(cells[1:]) != {NO_NUMBER}]
    return Table(("what", *row.backends), known, words=frozenset(range(9)))


def _refusals(name: str, row: BackendRow) -> _BackendRefusals:
    """Return what an engine refuses of a model, and of what it warns."""
    reasons = grouped((word, scenario) for scenario, word in row.scenarios.items() if word != RUNS)
    return _BackendRefusals(
        name,
        row.refusal,
        row.refusal_without if row.refusal_without != row.refusal else "",
        row.warnings or row.warnings_without,
        [_Stop(experiments, reason) for reason, experiments in reasons.items()],
    )


def _scenario(name: str, row: BackendRow) -> str:
    """Return whether an experiment runs."""
    word = row.scenarios.get(name)
    if word is None:
        return NO_NUMBER
    return "✓" if word == RUNS else "no"


def _gap_in_full(gap: RunGap | None) -> str:
    if gap is None:
        return NO_NUMBER
    sizes = {"hinge": gap.hinge, "slide": gap.slide, "free body": gap.position, "turn": gap.turn}
    units = ("rad", "m", "m", "rad")
    known = [
        f"{name} {rough(size)} {unit}"
        for (name, size), unit in zip(sizes.items(), units, strict=True)
        if size is not None
    ]
    parts = [", ".join(known) or NO_NUMBER]
    if gap.shrinks is not None:
        parts.append(f"divided by {gap.shrinks:.3g} at half the timestep")
    if gap.floor is not None:
        parts.append(f"rounding alone makes {rough(gap.floor)}")
    if gap.ended:
        parts.append(f"{gap.ended} (after {count(gap.steps, 'step')})")
    return "; ".join(parts)
