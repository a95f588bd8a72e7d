"""A table of models, and one model in detail, as a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

from ..measures.text import NONE, count, few, figure, grouped, listed, rough, sentence
from ..page import Block, Page, Table, Text, Verdict
from ..robots.examine import TRIED
from ..robots.gaps import STEPS
from ..robots.records import RUNS, TOLERANCE, BackendRow, ExaminedModel, RunGap, WitnessRow
from ..robots.survey import Survey
from . import template

_WIDEST = 28  # characters of a name
_LISTED = 20  # of what is wrong, and of features

SUMS = (
    "How many of {total} models load, and of how many the gap without contacts to {default} is "
    "within {tolerance:g} rad or m, no more than rounding makes, or vanishes with the timestep"
)
_MARKS = {None: NONE, True: "✓", False: "✗"}


def page(survey: Survey, widest: int = _WIDEST) -> Page:
    """The table; of one model alone, all that was found of it.

    Args:
        survey: What was found.
        widest: Characters of a model's name.
    """
    models = survey.models
    if len(models) == 1 and not survey.parts:
        return _one(survey, models[0])
    backends = list(dict.fromkeys(name for row in models for name in row.backends))
    others = [name for name in backends if name != survey.default]
    tried = any(backend.scenarios for row in models for backend in row.backends.values())
    wrong = [f"{file}: {text}" for file, texts in survey.wrong.items() for text in texts]
    inside = [f"{row.file}, {row.inside[0]}" for row in models if row.inside]
    grades = Counter(row.witness.grade or "refused" for row in models if row.witness is not None)
    return template.page(
        "robots",
        models=count(len(models), "model"),
        made_with=survey.made_with,
        table=_table(survey, others, widest, tried),
        default=survey.default,
        steps=STEPS,
        tried=", ".join(TRIED) if tried else None,
        backends=listed(backends),
        sums=_sums(survey, others),
        inside=len(inside) or None,
        total=len(models),
        pairs=few(inside, _LISTED, "; "),
        grades=Table(
            ("the witness's reading", "models"),
            [(grade, str(number)) for grade, number in sorted(grades.items())],
        ),
        refused=[_refused(models, other) for other in others],
        parts=count(len(survey.parts), "file") if survey.parts else None,
        wrong=[Verdict(text, False) for text in wrong[:_LISTED]],
        more=max(len(wrong) - _LISTED, 0) or None,
        fine=None if wrong else True,
    )


def _table(survey: Survey, others: Sequence[str], widest: int, tried: bool) -> Table:
    """A row for each model."""
    columns: dict[str, Callable[[ExaminedModel], str]] = {
        # The end of a long name tells more than its beginning.
        "model": lambda row: row.file if len(row.file) <= widest else f"…{row.file[1 - widest :]}",
        "bits": lambda row: _bits(survey, row),
    }
    for other in others:
        of = f"{other}, " if len(others) > 1 else ""
        columns[f"{of}no contacts"] = partial(_gap, other=other, without=True)
        columns[f"{of}contacts"] = partial(_gap, other=other, without=False)
    columns["witness"] = _witness
    if tried:
        columns |= {
            "runs": lambda row: (
                " ".join(
                    str(list(backend.scenarios.values()).count(RUNS))
                    for backend in row.backends.values()
                    if backend.scenarios
                )
                or NONE
            ),
            "cost": lambda row: (
                " ".join(
                    f"{backend.cost:.3g}"
                    for backend in row.backends.values()
                    if backend.cost is not None
                )
                or NONE
            ),
        }
    return Table.of(
        survey.models, columns, words={"model", "bits", "witness", "runs"}, wide={"cost"}
    )


def _bits(survey: Survey, row: ExaminedModel) -> str:
    if row.ended:
        return "ended"
    first = row.backends.get(survey.default)
    if first is None or (first.refusal and first.refusal_without):
        return "no"
    exact = [
        v for backend in row.backends.values() for v in (backend.equals_engine, backend.restores)
    ]
    return "✗" if False in exact else "✓" if True in exact else NONE


def _gap(row: ExaminedModel, other: str, without: bool) -> str:
    backend = row.backends.get(other, BackendRow())
    gap = backend.without_contacts if without else backend.with_contacts
    if gap is None:
        return "refused" if (backend.refusal_without if without else backend.refusal) else NONE
    outcomes = {
        "still": not row.nv,
        "explodes": gap.explodes,
        "stops": gap.ended,
        "rounding": gap.is_rounding,
    }
    size = figure(gap.largest) + (" → 0" if gap.first_order else "")
    return next((word for word, holds in outcomes.items() if holds), size)


def _witness(row: ExaminedModel) -> str:
    if row.witness is None:
        return NONE
    if row.witness.gap is None:
        return "refused"
    return f"{row.witness.grade.partition(' ')[0]} {rough(row.witness.gap)}"


def _sums(survey: Survey, others: Sequence[str]) -> Table:
    """How many models each engine loads, and what becomes of them."""
    rows = grouped(pair for row in survey.models for pair in row.backends.items())

    def counted(of: Callable[[BackendRow], object], name: str) -> str:
        return str(sum(bool(of(row)) for row in rows.get(name, ())))

    def gaps(of: Callable[[RunGap], bool], name: str) -> str:
        """Of runs that did not end early, against the default engine; which has none."""
        if name == survey.default:
            return NONE
        runs = [row.without_contacts for row in rows.get(name, ()) if row.without_contacts]
        return str(sum(of(gap) for gap in runs if not gap.ended))

    return Table.of(
        (survey.default, *others),
        {
            "engine": str,
            "loads": partial(counted, lambda row: row.loads),
            "only without contacts": partial(
                counted, lambda row: not row.loads and not row.refusal_without
            ),
            "bits of the engine": lambda name: (
                counted(lambda row: row.equals_engine, name) if name == survey.default else NONE
            ),
            "within": partial(gaps, lambda gap: gap.largest <= TOLERANCE),
            "rounding": partial(gaps, lambda gap: gap.is_rounding),
            "vanishes": partial(gaps, lambda gap: gap.first_order),
        },
        SUMS.format(total=len(survey.models), default=survey.default, tolerance=TOLERANCE),
    )


def _refused(models: Sequence[ExaminedModel], other: str) -> Table:
    """What is refused, how often, and for how many models it alone stands in the way."""
    rows = [row.backends[other] for row in models if other in row.backends]
    refused = [row for row in rows if row.refusal]
    features = Counter(name for row in refused for name in row.features)
    alone = Counter(row.features for row in refused)
    solved = Counter(n for row in refused for n in row.features if not row.refusal_without)
    return Table.of(
        [name for name, _ in features.most_common(_LISTED)],
        {
            "feature": str,
            "models": lambda name: str(features[name]),
            "the only one in": lambda name: str(alone[(name,)]),
            "not with contacts off in": lambda name: str(solved[name]),
        },
        f"What {other} refuses",
    )


def _one(survey: Survey, row: ExaminedModel) -> Page:
    """All that was found of one model."""
    wrong, witness = row.wrong(survey.default), row.witness or WitnessRow()
    reason = sentence(witness.refusal) if witness.refusal else None
    facts: dict[str, Callable[[BackendRow], str]] = {
        "loads": lambda backend: (
            "✓" if backend.loads else "no" if backend.refusal_without else "with contacts off"
        ),
        "the bits of the engine without us": lambda backend: _MARKS[backend.equals_engine],
        "two futures of a State are one": lambda backend: _MARKS[backend.restores],
        "gap without contacts": lambda backend: _gap_in_full(backend.without_contacts),
        "gap with contacts": lambda backend: _gap_in_full(backend.with_contacts),
        **{f"experiment {name}": partial(_scenario, name) for name in TRIED},
        "cost of a step over the engine's own, here": lambda backend: (
            NONE if backend.cost is None else f"{backend.cost:.3g} ×"
        ),
    }
    rows = [(fact, *map(cell, row.backends.values())) for fact, cell in facts.items()]
    rows = [cells for cells in rows if set(cells[1:]) != {NONE}]
    return template.page(
        "robots_one",
        file=row.file,
        made_with=row.made_with,
        **{name: getattr(row, name) for name in ("nq", "nv", "nu", "nbody", "ngeom", "took")},
        table=Table(("what", *row.backends), rows, words=frozenset(range(9))),
        backends=[block for name in row.backends for block in _refusals(name, row.backends[name])],
        refusal=None if witness.gap is not None else reason,
        grade=witness.grade,
        frames=count(witness.frames, "frame"),
        gap=None if witness.gap is None else rough(witness.gap),
        no_reading=sentence(witness.refusal)
        if witness.gap is not None and witness.refusal
        else None,
        wrong=[Verdict(text, False) for text in wrong],
        fine=None if wrong else True,
    )


def _refusals(name: str, row: BackendRow) -> list[Block]:
    """What an engine refuses of a model, and of what it warns."""
    warnings = [f"{name} warns: {text}" for text in row.warnings or row.warnings_without]
    reasons = grouped((word, scenario) for scenario, word in row.scenarios.items() if word != RUNS)
    stops = [f"{', '.join(names)} on {name}: {why}" for why, names in reasons.items()]
    without = row.refusal_without if row.refusal_without != row.refusal else ""
    return template.blocks(
        "robots_backend",
        name=name,
        refusal=row.refusal or None,
        refusal_without=without or None,
        further=[Text(text) for text in (*warnings, *stops)],
    )


def _scenario(name: str, row: BackendRow) -> str:
    """Whether an experiment runs."""
    word = row.scenarios.get(name)
    return NONE if word is None else "✓" if word == RUNS else "no"


def _gap_in_full(gap: RunGap | None) -> str:
    if gap is None:
        return NONE
    sizes = {"hinge": gap.hinge, "slide": gap.slide, "free body": gap.position, "turn": gap.turn}
    units = ("rad", "m", "m", "rad")
    known = [
        f"{name} {rough(size)} {unit}"
        for (name, size), unit in zip(sizes.items(), units, strict=True)
        if size is not None
    ]
    parts = [", ".join(known) or NONE]
    if gap.shrinks is not None:
        parts.append(f"divided by {gap.shrinks:.3g} at half the timestep")
    if gap.floor is not None:
        parts.append(f"rounding alone makes {rough(gap.floor)}")
    if gap.ended:
        parts.append(f"{gap.ended} (after {count(gap.steps, 'step')})")
    return "; ".join(parts)
