"""A table of models, and one model in detail, as a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

from ..measures.text import NONE, count, few, figure, listed, rough, sentence
from ..page import Block, Page, Table, Text, Verdict
from ..robots.examine import TRIED
from ..robots.gaps import STEPS
from ..robots.records import (
    RUNS,
    TOLERANCE,
    BackendRow,
    ExaminedModel,
    RunGap,
    Survey,
    WitnessRow,
)
from . import template

_WIDEST = 28  # characters of a name
_LISTED = 20  # of what is wrong, and of features

SUMS = (
    "How many of {total} models load, and of how many the gap without contacts to {default} is "
    "within {tolerance:g} rad or m, no more than rounding makes, or vanishes with the timestep"
)
_SUMS_HEADERS = (
    "engine",
    "loads",
    "only without contacts",
    "bits of the engine",
    "within",
    "rounding",
    "vanishes",
)
_MARKS = {None: NONE, True: "✓", False: "✗"}


def page(survey: Survey, widest: int = _WIDEST) -> Page:
    """The table; of one model alone, all that was found of it.

    Args:
        survey: What was found.
        widest: Characters of a model's name.
    """
    if len(survey.models) == 1 and not survey.parts:
        return _one(survey, survey.models[0])
    backends = list(dict.fromkeys(name for row in survey.models for name in row.backends))
    others = [name for name in backends if name != survey.default]
    tried = any(each.scenarios for row in survey.models for each in row.backends.values())
    wrong = [f"{file}: {text}" for file, texts in survey.wrong.items() for text in texts]
    return template.page(
        "robots",
        models=count(len(survey.models), "model"),
        made_with=survey.made_with,
        table=[_table(survey, others, widest, tried)],
        default=survey.default,
        steps=STEPS,
        tried=", ".join(TRIED) if tried else None,
        backends=listed(backends),
        sums=_sums(survey, others),
        refused=[block for other in others for block in _refused(survey.models, other)],
        parts=count(len(survey.parts), "file") if survey.parts else None,
        wrong=[Verdict(text, False) for text in wrong[:_LISTED]],
        more=max(len(wrong) - _LISTED, 0) or None,
        fine=None if wrong else True,
    )


def _table(survey: Survey, others: Sequence[str], widest: int, tried: bool) -> Table:
    """A row for each model."""
    models = survey.models
    columns = {
        "model": [_short(row.file, widest) for row in models],
        "bits": [_bits(survey, row) for row in models],
    }
    for other in others:
        of = f"{other}, " if len(others) > 1 else ""
        columns[f"{of}no contacts"] = [_gap(row, other, True) for row in models]
        columns[f"{of}contacts"] = [_gap(row, other, False) for row in models]
    columns["witness"] = [_witness(row) for row in models]
    if tried:
        columns |= {"runs": list(map(_runs, models)), "cost": list(map(_cost, models))}
    words = {"model", "bits", "witness", "runs"}
    return Table(
        list(columns),
        list(zip(*columns.values(), strict=True)),
        words=frozenset(k for k, name in enumerate(columns) if name in words),
        wide=frozenset(k for k, name in enumerate(columns) if name == "cost"),
    )


def _short(name: str, widest: int) -> str:
    """The end of a long name, which tells more than its beginning."""
    return name if len(name) <= widest else f"…{name[1 - widest :]}"


def _bits(survey: Survey, row: ExaminedModel) -> str:
    if row.ended:
        return "ended"
    first = row.backends.get(survey.default)
    if first is None or (first.refusal and first.refusal_without):
        return "no"
    told = [v for each in row.backends.values() for v in (each.equals_engine, each.restores)]
    return "✗" if False in told else "✓" if True in told else NONE


def _gap(model: ExaminedModel, other: str, without: bool) -> str:
    row = model.backends.get(other)
    if row is None:
        return NONE
    gap = row.without_contacts if without else row.with_contacts
    if gap is None:
        return "refused" if (row.refusal_without if without else row.refusal) else NONE
    outcomes = {
        "still": not model.nv,
        "explodes": gap.explodes,
        "stops": gap.ended,
        "rounding": gap.is_rounding,
    }
    size = figure(gap.largest) + (" h" if gap.first_order else "")
    return next((word for word, holds in outcomes.items() if holds), size)


def _witness(row: ExaminedModel) -> str:
    if row.witness is None:
        return NONE
    if row.witness.gap is None:
        return "refused"
    return f"{row.witness.grade.partition(' ')[0]} {rough(row.witness.gap)}"


def _runs(row: ExaminedModel) -> str:
    tried = [list(each.scenarios.values()) for each in row.backends.values() if each.scenarios]
    return " ".join(str(words.count(RUNS)) for words in tried) or NONE


def _cost(row: ExaminedModel) -> str:
    costs = [f"{each.cost:.3g}" for each in row.backends.values() if each.cost is not None]
    return " ".join(costs) or NONE


def _sums(survey: Survey, others: Sequence[str]) -> list[Block]:
    """How many models each engine loads and what becomes of them, and what the witness reads."""
    models, total = survey.models, len(survey.models)
    rows = []
    for name in (survey.default, *others):
        found = [row.backends[name] for row in models if name in row.backends]
        gaps = [row.without_contacts for row in found if row.without_contacts]
        counts = [
            sum(row.loads for row in found),
            sum(not row.loads and not row.refusal_without for row in found),
            sum(row.equals_engine is True for row in found),
            sum(not gap.ended and gap.largest <= TOLERANCE for gap in gaps),
            sum(not gap.ended and gap.is_rounding for gap in gaps),
            sum(not gap.ended and gap.first_order for gap in gaps),
        ]
        known = range(3) if name == survey.default else (0, 1, 3, 4, 5)
        rows.append((name, *(str(n) if k in known else NONE for k, n in enumerate(counts))))
    title = SUMS.format(total=total, default=survey.default, tolerance=TOLERANCE)
    inside = [f"{row.file}, {row.inside[0]}" for row in models if row.inside]
    grades = Counter(row.witness.grade or "refused" for row in models if row.witness is not None)
    read = [(grade, str(number)) for grade, number in sorted(grades.items())]
    return template.blocks(
        "robots_sums",
        sums=[Table(_SUMS_HEADERS, rows, title)],
        inside=len(inside) or None,
        total=total,
        pairs=few(inside, _LISTED, "; "),
        grades=[Table(("the witness's reading", "models"), read)] if read else [],
    )


def _refused(rows: Sequence[ExaminedModel], other: str) -> list[Block]:
    """What is refused, how often, and for how many models it alone stands in the way."""
    all_of, alone, solved = Counter[str](), Counter[str](), Counter[str]()
    for row in rows:
        found = row.backends.get(other)
        if found is None or not found.refusal:
            continue
        all_of.update(found.features)
        alone.update(found.features if len(found.features) == 1 else ())
        solved.update(found.features if not found.refusal_without else ())
    if not all_of:
        return []
    return [
        Table(
            ("feature", "models", "the only one in", "not with contacts off in"),
            [
                (name, str(number), str(alone[name]), str(solved[name]))
                for name, number in all_of.most_common(_LISTED)
            ],
            title=f"What {other} refuses",
        )
    ]


def _one(survey: Survey, row: ExaminedModel) -> Page:
    """All that was found of one model."""
    wrong, witness = row.wrong(survey.default), row.witness or WitnessRow()
    reason = sentence(witness.refusal) if witness.refusal else None
    facts: dict[str, Callable[[BackendRow], str]] = {
        "loads": _loads,
        "the bits of the engine without us": lambda each: _MARKS[each.equals_engine],
        "two futures of a State are one": lambda each: _MARKS[each.restores],
        "gap without contacts": lambda each: _whole(each.without_contacts),
        "gap with contacts": lambda each: _whole(each.with_contacts),
        **{f"scenario {name}": partial(_scenario, name) for name in TRIED},
        "cost of a step, on this machine": lambda each: (
            NONE if each.cost is None else f"{each.cost:.3g} ×"
        ),
    }
    rows = [(fact, *map(cell, row.backends.values())) for fact, cell in facts.items()]
    rows = [cells for cells in rows if set(cells[1:]) != {NONE}]
    table = Table(("what", *row.backends), rows, words=frozenset(range(9)))
    return template.page(
        "robots_one",
        file=row.file,
        made_with=row.made_with,
        **{name: getattr(row, name) for name in ("nq", "nv", "nu", "nbody", "ngeom", "took")},
        table=[table] if row.backends else [],
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
    reasons: dict[str, list[str]] = {}
    for scenario, word in row.scenarios.items():
        reasons.setdefault(word, []).append(scenario)
    stops = [f"{', '.join(of)} on {name}: {why}" for why, of in reasons.items() if why != RUNS]
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


def _loads(row: BackendRow) -> str:
    if row.loads:
        return "✓"
    return "no" if row.refusal_without else "with contacts off"


def _whole(gap: RunGap | None) -> str:
    if gap is None:
        return NONE
    sizes = {"hinge": "rad", "slide": "m", "position": "m", "turn": "rad"}
    parts = [
        f"{'free body' if name == 'position' else name} {rough(getattr(gap, name))} {unit}"
        for name, unit in sizes.items()
        if getattr(gap, name) is not None
    ]
    text = ", ".join(parts) or NONE
    if gap.shrinks is not None:
        text += f"; {gap.shrinks:.3g} times that at half the timestep"
    if gap.floor is not None:
        text += f"; rounding alone makes {rough(gap.floor)}"
    return f"{text}; {gap.ended} (after {count(gap.steps, 'step')})" if gap.ended else text
