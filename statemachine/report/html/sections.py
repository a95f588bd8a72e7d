"""Sections of the page that are tables."""

from __future__ import annotations

from collections.abc import Sequence

from ...compare import Agreement, Comparison, Witness
from ...comparison.text import capital, milliseconds, numbers, quantity, short_time
from ...page import Code, Heading, Page, Printed, Table, Text, Verdict
from ...traces import Header
from .finding import coarsely, name_of, window
from .markup import Html, joined, kept, tag
from .timeline import Event

_BREAK = Html("\n")
ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
VERDICTS = {"agrees": ("○", "agrees"), "settles": ("◐", "settles"), "differs": ("●", "differs")}


def verdict_badge(verdict: str) -> Html:
    """A verdict as a word with a sign, so that it needs no colour."""
    sign, word = VERDICTS[verdict]
    return tag("span", tag("span", sign, aria_hidden="true"), " ", word, class_=f"badge {verdict}")


def go(time: float, text: str = "") -> Html:
    """A moment that the slider goes to when it is pressed."""
    label = text or short_time(time)
    return tag("button", label, type="button", class_="go", data_t=f"{time:.6f}")


def table(
    caption: str, head: Sequence[str], rows: Sequence[Sequence[object]], words: Sequence[int] = ()
) -> Html:
    """A table whose first column names its rows; `words` are columns of words, not figures."""
    top = tag(
        "tr",
        *(
            tag("th", text, scope="col", class_="word" if k == 0 or k in words else None)
            for k, text in enumerate(head)
        ),
    )
    body = [
        tag(
            "tr",
            *(
                tag("th", cell, scope="row")
                if k == 0
                else tag("td", cell, class_="word" if k in words else None, data_name=head[k])
                for k, cell in enumerate(row)
            ),
        )
        for row in rows
    ]
    made = tag("table", tag("caption", caption), tag("thead", top), tag("tbody", *body))
    return tag("div", made, class_="wide", tabindex="0", role="region", aria_label=caption)


def agreements(comparison: Comparison) -> Html:
    """Figures and verdicts, and under them the reason of each tolerance."""
    reasons: dict[tuple[str, str], str] = {}
    rows = []
    for found in comparison.agreements:
        key = quantity(found.tolerance, found.unit), found.reason
        letter = reasons.setdefault(key, _letter(len(reasons)))
        allowed = joined((key[0], tag("sup", tag("a", letter, href=f"#why-{letter}"))))
        rows.append((name_of(found.name), verdict_badge(found.verdict), *_figures(found), allowed))
    one, two = comparison.one.label, comparison.two.label
    notes = [
        tag("li", tag("b", letter), f" {value}: {reason}.", id=f"why-{letter}")
        for (value, reason), letter in reasons.items()
    ]
    return joined(
        (
            table(
                f"{one} against {two}: how far apart",
                ("quantity", "verdict", "largest", "at", "RMS", "settled", "beyond from",
                 "tolerance"),
                rows,
                words=(1,),
            ),
            tag(
                "p",
                kept(
                    f"Compared at {comparison.moments} moments over {comparison.until:g} s. "
                    f"Settled is the mean over {window(comparison)} (of forces: how far apart "
                    "the means are). A quantity agrees if it is never beyond its tolerance, "
                    "settles if what is settled is not beyond it, and differs otherwise. "
                    f"{coarsely(comparison)}"
                ),
            ),
            tag("h3", "What does not matter, and why"),
            tag("ul", *notes, class_="reasons"),
        )
    )  # fmt: skip


def third_party(found: Witness, labels: tuple[str, str]) -> Html:
    """Where a witness puts the fingertip of each side."""
    return tag(
        "p",
        f"Two that agree may both be wrong. So {found.by} was given the joint angles of all "
        f"{found.rows} rows and asked where {found.site} then is: at most "
        f"{found.one * 1000:.0e} mm from where {labels[0]} has it, and {found.two * 1000:.0e} mm "
        f"from where {labels[1]} has it. That checks where {found.site} is for given joint angles "
        "(kinematics), not the motion.",
    )


def small(value: float, found: Agreement) -> str:
    """A difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < ROUNDING * found.tolerance:
        return "≈ 0"
    return quantity(value, found.unit)


def _figures(found: Agreement) -> tuple[object, ...]:
    if found.kind == "contact":
        return found.note or quantity(found.max, found.unit), go(found.at), "–", "–", "–"
    return (
        small(found.max, found),
        go(found.at),
        small(found.rms, found),
        small(found.settled, found),
        "never" if found.since is None else go(found.since),
    )


def _letter(number: int) -> str:
    return "abcdefghijklmnopqrstuvwxyz"[number] if number < 26 else f"z{number}"


def events_table(events: Sequence[Event], comparison: Comparison) -> Html:
    """What happens when; the same on both sides at the same time is one row."""
    labels = comparison.one.label, comparison.two.label
    merged: dict[tuple[float, str], set[int | None]] = {}
    for event in events:
        merged.setdefault((event.time, event.text), set()).add(event.side)
    rows = []
    for (time, text), sides in merged.items():
        if sides in ({None}, {0, 1}):
            where = "both" if 0 in sides else "between them"
        else:
            where = labels[next(iter(s for s in sides if s is not None))]
        rows.append((go(time), capital(text), where))
    return table(
        "First touches, partings, largest differences; press a time to go there",
        ("time", "what", "on"),
        rows,
        (1, 2),
    )


def from_page(page: Page) -> Html:
    """The blocks of a page of the terminal."""
    parts: list[object] = []
    for block in page.blocks:
        if isinstance(block, Heading):
            parts.append(tag("h3", block.text))
        elif isinstance(block, Text):
            parts.append(tag("p", block.text))
        elif isinstance(block, Table):
            words = [k for k in block.words if k]
            parts.append(table(block.title, block.headers, block.rows, words))
        elif isinstance(block, Code):
            parts.append(tag("pre", tag("code", joined(block.lines, _BREAK))))
        elif isinstance(block, Printed):
            for engine, text in block.by_engine.items():
                parts.append(tag("p", tag("b", engine)))
                parts.append(tag("pre", joined(text.split("\n"), _BREAK)))
        elif isinstance(block, Verdict):
            sign = "✓" if block.holds else "✗"
            parts.append(tag("p", f"{sign} {block.text}", class_="verdict"))
    return joined(parts)


# Of the promises that a backend may emulate, those that move the arm, in plain words.
PHYSICS = {
    "position servo": "the servos, with the gains of the model",
    "armature": "the inertia of the rotors, as the joints feel it (armature)",
    "joint damping": "the damping of the joints",
    "dry friction": "the dry friction of the joints",
    "joint limits": "the limits of the joints",
}


def emulated(comparison: Comparison) -> Html | None:
    """What of the model a backend keeps instead of its engine."""
    parts = []
    labels = set()
    for side in (comparison.one, comparison.two):
        kept = side.provenance.emulated
        if not kept or side.defaults != "model" or side.label in labels:
            continue
        labels.add(side.label)
        moving = [PHYSICS[name] for name in kept if name in PHYSICS]
        rest = [name for name in kept if name not in PHYSICS]
        said = "What the model asks for and the engine lacks is computed around it"
        if moving:
            parts.append(tag("p", tag("b", side.label), f". {said}, and moves the arm:"))
            parts.append(tag("ul", *(tag("li", each) for each in moving)))
        if rest:
            parts.append(
                tag(
                    "details",
                    tag("summary", f"What else is kept around {side.label}"),
                    tag(
                        "p",
                        "Promises of this library, and conventions of its states and forces: ",
                        "; ".join(rest),
                        ".",
                    ),
                )
            )
    if not parts:
        return None
    return joined([*parts, tag("p", "The engine as its own users meet it: ",
                               tag("code", "--defaults engine"), ".")])  # fmt: skip


def provenance(headers: tuple[Header, Header], comparison: Comparison) -> Html:
    """What made both sides."""
    rows: list[tuple[object, ...]] = []

    def row(name: str, *values: object) -> None:
        if any(value not in ("", None) for value in values):
            rows.append((name, *values))

    a, b = (header.provenance for header in headers)
    row(
        "ran as", *("recorded, opened here" if h.recorded else "run for this page" for h in headers)
    )
    for engine in dict.fromkeys([*a.versions, *b.versions]):
        row(engine, a.versions.get(engine, "–"), b.versions.get(engine, "–"))
    row("model", a.model_file, b.model_file)
    row("its SHA-256", *(tag("code", p.model_sha256, class_="digest") for p in (a, b)))
    row("defaults", *(header.defaults for header in headers))
    row("options", *(_options(header) for header in headers))
    row("starts in", *(h.keyframe or "the default state" for h in headers))
    row("timestep", *(milliseconds(h.timestep) + _substeps(h) for h in headers))
    row("gravity", *(numbers(h.gravity) + " m/s²" for h in headers))
    row("rows", f"{comparison.one.rows}", f"{comparison.two.rows}")
    row("seed", *("none drawn" if p.seed is None else p.seed for p in (a, b)))
    row("energies by", *(header.energy_by or "–" for header in headers))
    row("made again by", *(tag("code", h.command) if h.command else "–" for h in headers))
    labels = comparison.one.label, comparison.two.label
    return table("What made the two runs", ("", *labels), rows, words=(1, 2))


def _options(header: Header) -> str:
    return ", ".join(f"{name} {value}" for name, value in header.options.items()) or "none"


def _substeps(header: Header) -> str:
    return f" in {header.substeps} substeps" if header.substeps > 1 else ""
