"""A table of models, and one model in detail, as a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from ..measures.text import NONE, count, few, figure, listed, rough, sentence
from ..page import Block, Page, Table, Text, Verdict
from ..robots.examine import TRIED
from ..robots.gaps import STEPS
from ..robots.records import RUNS, TOLERANCE, BackendRow, ExaminedModel, RunGap, Survey

_WIDEST = 28  # characters of a name
_LISTED = 20  # of what is wrong, and of features

LEGEND = (
    "bits: {default} computes the bits of the engine without us, and two futures of a State are "
    "the same bits on every engine. no contacts, contacts: the largest gap to {default} within "
    "{steps} steps under random commands, in rad (hinges) or m (slides and free bodies), whichever "
    "is larger; h: it vanishes with the timestep; rounding: changed by rounding alone, {default} "
    "gets as far from its own run; still: nothing in it moves. witness: its reading, and its "
    "largest gap in m."
)
LEGEND_RUNS = " runs: of {tried}, how many run on {backends}."
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
INSIDE = "Shapes are inside each other at the start of {number} of {total}: {pairs}."


def page(survey: Survey, widest: int = _WIDEST) -> Page:
    """The table; of one model alone, all that was found of it.

    Args:
        survey: What was found.
        widest: Characters of a model's name.
    """
    if len(survey.models) == 1 and not survey.parts:
        return _one(survey, survey.models[0])
    others = _others(survey)
    headers = ["model", "bits", *_headers(others), "witness"]
    words = {0, 1, len(headers) - 1}
    wide: set[int] = set()
    if tried := any(each.scenarios for row in survey.models for each in row.backends.values()):
        words, wide = words | {len(headers)}, {len(headers) + 1}
        headers += ["runs", "cost"]
    rows = [
        [_short(row.file, widest), *_row(survey, row, others)][: len(headers)]
        for row in survey.models
    ]
    blocks: list[Block] = [
        Table(headers, rows, words=frozenset(words), wide=frozenset(wide)),
        Text(_legend(survey, tried), small=True),
    ]
    blocks += _sums(survey, others)
    for other in others:
        blocks += _refused(survey.models, other)
    if survey.parts:
        files = count(len(survey.parts), "file")
        verb = "is" if len(survey.parts) == 1 else "are"
        blocks.append(Text(f"{files} that others include {verb} no model alone: left out."))
    wrong = [(file, text) for file, said in survey.wrong.items() for text in said]
    blocks += [Verdict(f"{file}: {text}", False) for file, text in wrong[:_LISTED]]
    if len(wrong) > _LISTED:
        blocks.append(Text(f"And {len(wrong) - _LISTED} more like these; --json has them all."))
    if not wrong:
        blocks.append(Verdict("every model was examined, and nothing contradicts another", True))
    return Page(f"{count(len(survey.models), 'model')} on every engine", survey.made_with, blocks)


def _others(survey: Survey) -> list[str]:
    names = dict.fromkeys(name for row in survey.models for name in row.backends)
    return [name for name in names if name != survey.default]


def _headers(others: Sequence[str]) -> list[str]:
    if len(others) == 1:
        return ["no contacts", "contacts"]
    return [f"{name}, {what}" for name in others for what in ("no contacts", "contacts")]


def _row(survey: Survey, row: ExaminedModel, others: Sequence[str]) -> list[str]:
    gaps = [_gap(row, other, without) for other in others for without in (True, False)]
    return [_bits(survey, row), *gaps, _witness(row), _runs(row), _cost(row)]


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
    if not model.nv:
        return "still"
    if gap.explodes:
        return "explodes"
    if gap.ended:
        return "stops"
    if gap.is_rounding:
        return "rounding"
    return figure(gap.largest) + (" h" if gap.first_order else "")


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


def _legend(survey: Survey, tried: bool) -> str:
    backends = list(dict.fromkeys(name for row in survey.models for name in row.backends))
    runs = LEGEND_RUNS.format(tried=", ".join(TRIED), backends=listed(backends)) * tried
    return LEGEND.format(default=survey.default, steps=STEPS) + runs


def _sums(survey: Survey, others: Sequence[str]) -> Iterator[Block]:
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
    yield Table(_SUMS_HEADERS, rows, title)
    inside = [f"{row.file}, {row.inside[0]}" for row in models if row.inside]
    if inside:
        pairs = few(inside, _LISTED, "; ")
        yield Text(INSIDE.format(number=len(inside), total=total, pairs=pairs))
    asked = [row.witness for row in models if row.witness is not None]
    grades = Counter(witness.grade or "refused" for witness in asked)
    if asked:
        rows = [(grade, str(number)) for grade, number in sorted(grades.items())]
        yield Table(("the witness's reading", "models"), rows)


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
    names, backends = list(row.backends), row.backends.values()
    blocks: list[Block] = []
    if row.nq is not None:
        sizes = f"nq {row.nq}, nv {row.nv}, nu {row.nu}, nbody {row.nbody}, ngeom {row.ngeom}"
        blocks.append(Text(f"{sizes}; examined in {row.took:g} s."))
    lines = [
        ("loads", [_loads(each) for each in backends]),
        ("the bits of the engine without us", [_mark(each.equals_engine) for each in backends]),
        ("two futures of a State are one", [_mark(each.restores) for each in backends]),
        ("gap without contacts", [_whole(each.without_contacts) for each in backends]),
        ("gap with contacts", [_whole(each.with_contacts) for each in backends]),
    ]
    for name in TRIED:
        cells = [each.scenarios.get(name) for each in backends]
        marks = [NONE if cell is None else "✓" if cell == RUNS else "no" for cell in cells]
        lines.append((f"scenario {name}", marks))
    costs = [NONE if each.cost is None else f"{each.cost:.3g} ×" for each in backends]
    lines.append(("cost of a step, on this machine", costs))
    lines = [(what, cells) for what, cells in lines if set(cells) != {NONE}]
    table = Table(
        ("", *names), [(what, *cells) for what, cells in lines], words=frozenset(range(9))
    )
    blocks += [table] if names else []
    for name, found in row.backends.items():
        for when, text in (("", found.refusal), (" with contacts off", found.refusal_without)):
            if text and not (when and text == found.refusal):
                blocks.append(Text(f"{name} refuses it{when}: {text}"))
        blocks += [
            Text(f"{name} warns: {text}") for text in found.warnings or found.warnings_without
        ]
        refused = dict.fromkeys(word for word in found.scenarios.values() if word != RUNS)
        for reason in refused:
            which = [scenario for scenario, word in found.scenarios.items() if word == reason]
            blocks.append(Text(f"{', '.join(which)} on {name}: {reason}"))
    if row.witness is not None:
        blocks.append(Text(_witness_words(row)))
    wrong = row.wrong(survey.default)
    blocks += [Verdict(text, False) for text in wrong]
    if not wrong:
        blocks.append(Verdict("it was examined, and nothing contradicts another", True))
    return Page(f"{row.file} on every engine", row.made_with, blocks)


def _loads(row: BackendRow) -> str:
    if row.loads:
        return "✓"
    return "no" if row.refusal_without else "with contacts off"


def _mark(value: bool | None) -> str:
    return NONE if value is None else "✓" if value else "✗"


def _whole(gap: RunGap | None) -> str:
    if gap is None:
        return NONE
    parts = [
        f"{what} {rough(value)} {unit}"
        for what, value, unit in (
            ("hinge", gap.hinge, "rad"),
            ("slide", gap.slide, "m"),
            ("free body", gap.position, "m"),
            ("turn", gap.turn, "rad"),
        )
        if value is not None
    ]
    text = ", ".join(parts) or NONE
    if gap.shrinks is not None:
        text += f"; {gap.shrinks:.3g} times that at half the timestep"
    if gap.floor is not None:
        text += f"; rounding alone makes {rough(gap.floor)}"
    return f"{text}; {gap.ended} (after {count(gap.steps, 'step')})" if gap.ended else text


def _witness_words(row: ExaminedModel) -> str:
    witness = row.witness
    assert witness is not None
    if witness.gap is None:
        return f"The witness refuses it: {sentence(witness.refusal)}"
    text = (
        f"The witness, by its {witness.grade}, places {count(witness.frames, 'frame')} within "
        f"{rough(witness.gap)} m of the engine."
    )
    if witness.refusal:
        text += f" It has no reading of its own: {sentence(witness.refusal)}"
    return text
