"""The report of a comparison as one HTML file that asks for nothing but itself."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np

from ... import __version__
from ...compare import Comparison, Series, Witness, default_tip, series
from ...compare.series import NORMAL, total_forces
from ...compare.why import Attribution
from ...comparison import same_pairs
from ...comparison.text import figure, sentence
from ...page import Page, Verdict
from ...traces import Trace
from . import sections
from .between import own_series, shown_series
from .budget import Budget
from .causes import agreement_steps, causes_section
from .commanded import commanded
from .curves import curves_section
from .finding import Headline, headline, in_words, leading, subject
from .geometry import packed
from .markup import Html, data_of, escaped, joined, kept, tag
from .pressing import pressing_words
from .scene import SideDrawing, scene_of
from .sketch import sketch
from .stage import quantity_data, stage
from .timeline import events_of, frames_of

_SCRIPTS = ("gl.js", "scene.js", "page.js")
LIMIT = 2_000_000  # bytes of a page
_NO_LOOK = SideDrawing(None, "no model was given")


def report(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    *,
    looks: Sequence[SideDrawing] = (_NO_LOOK, _NO_LOOK),
    tip: str | None = None,
    attribution: Attribution | None = None,
    why_not: str = "",
    models: Page | None = None,
    said: Sequence[str] = (),
    command: str = "",
    witness: Witness | None = None,
) -> str:
    """The page.

    Args:
        comparison: What was found in comparing the two.
        one: The first trace, drawn solid.
        two: The second, drawn as a ghost.
        looks: What each is drawn as; the same object twice if both are of one model.
        tip: The site that was compared, as given to `compare`.
        attribution: How much each factor explains, if that was asked.
        why_not: Why there is none, as a sentence.
        models: The differences between what the engines make of the model, if asked.
        said: What stood in for a run, line by line.
        command: What makes the page again.
        witness: How far the fingertip is from where a third party puts it, if asked.

    Returns:
        HTML of at most 2 MB: what would be more is drawn with less detail, which is said.
    """
    text = ""
    for share in (1.0, 0.5, 0.25, 0.1):
        text = _report(
            comparison,
            one,
            two,
            looks=looks,
            tip=tip,
            attribution=attribution,
            why_not=why_not,
            models=models,
            said=said,
            command=command,
            witness=witness,
            budget=Budget(share),
        )
        if len(text.encode("utf-8", errors="replace")) <= LIMIT:
            break
    return text


def _report(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    *,
    looks: Sequence[SideDrawing],
    tip: str | None,
    attribution: Attribution | None,
    why_not: str,
    models: Page | None,
    said: Sequence[str],
    command: str,
    witness: Witness | None,
    budget: Budget,
) -> str:
    """The page, with a budget of details."""
    site = default_tip(one.header, two.header) if tip is None else tip
    curves = series(one, two, tip)
    drawn = [curve for curve in curves if np.isfinite(curve.difference).all()]
    events = events_of(comparison, one, two)
    own = own_series(one, two, tip)
    frames = frames_of(one, two, _moments(comparison), budget.frames(one, two))
    at_frames = shown_series(one, two, frames, tip, drawn)
    of = subject(comparison, attribution)
    start = int(np.argmin(np.abs(frames.time - (of.at if of is not None else 0.0))))
    scene = scene_of(one, two, frames, looks, site, budget, start)
    finding = headline(comparison, events, attribution, curves)
    labels = comparison.one.label, comparison.two.label
    if labels[0] == labels[1]:
        labels = f"{labels[0]} (first)", f"{labels[1]} (second)"
    never, pressed = pressing_words(comparison, (one, two))
    words = [*in_words(comparison, events, attribution), *pressed]
    data = {
        "time": packed(frames.time, "f8"),
        "between": packed(frames.share > 0, "u1"),
        "other": labels[1],
        "until": comparison.until,
        "start": start,
        "quantities": [quantity_data(c, comparison) for c in at_frames],
        "lead": _lead(comparison, drawn),
        "scene": scene.data,
    }
    still = sketch(scene, one, two, frames, start, labels)
    steps: Html | None = None
    parts: list[object] = [
        _head(comparison, one, labels, finding, never, words, commanded(one, two, labels)),
        stage(comparison, drawn, events, frames, start, labels, still, site, scene.strongest),
    ]
    if attribution is not None:
        parts.append(_section("why", "What causes it", causes_section(attribution)))
        steps = agreement_steps(attribution)
    elif why_not:
        parts.append(_section("why", "What causes it", tag("p", why_not)))
    parts += [
        _section(
            "curves",
            "How far apart, over time",
            curves_section(
                comparison,
                drawn,
                own,
                labels,
                budget.points(len(drawn)),
                _feet(own, one, two, labels),
            ),
        ),
        _section(
            "figures",
            "The figures",
            sections.agreements(comparison),
            sections.third_party(witness, labels) if witness is not None else None,
        ),
        _section("events", "What happens when", sections.events_table(events, comparison)),
    ]
    emulated = sections.emulated(comparison)
    if models is not None:
        made = _models(models, emulated is not None)
        parts.append(_section("models", "What each engine makes of the model", made))
    if emulated is not None:
        parts.append(_section("emulated", "What is emulated", emulated))
    if steps is not None:
        parts.append(_section("agree", "To make them agree", steps))
    notes = [sentence(line) for line in (*said, *comparison.notes, *scene.notes)]
    parts.append(
        _section(
            "origin",
            "Where this comes from",
            sections.provenance((one.header, two.header), comparison),
            tag("p", "This page was made by ", tag("code", command), ".") if command else None,
            tag("h3", "Notes") if notes else None,
            tag("ul", *(tag("li", note) for note in notes)) if notes else None,
        )
    )
    body = joined(
        (
            tag("main", *parts),
            tag(
                "footer",
                tag(
                    "p", "Neither side is the truth, and two engines that agree may both be wrong."
                ),
                tag("p", f"statemachine {__version__}; this file asks for nothing but itself."),
            ),
        )
    )
    return _assembled(finding.lead, body, data)


def _moments(comparison: Comparison) -> tuple[float, ...]:
    """Moments that must be among those shown."""
    found = comparison.agreements
    times = {a.at for a in found} | {a.since for a in found if a.since is not None}
    return tuple(sorted(times))


def _head(
    comparison: Comparison,
    one: Trace,
    labels: tuple[str, str],
    finding: Headline,
    never: Sequence[str],
    words: Sequence[str],
    command: Html | None,
) -> Html:
    says = one.header.says
    shown = (
        f"{comparison.until:g} s on {labels[0]}, below as a solid arm, and on {labels[1]}, as a "
        "ghost over it."
    )
    return tag(
        "header",
        tag(
            "p",
            tag("span", comparison.one.experiment, class_="experiment"),
            tag("span", tag("i", class_="key one"), labels[0], class_="side"),
            tag("span", "against", class_="against"),
            tag("span", tag("i", class_="key two"), labels[1], class_="side"),
            tag("button", "Dark", id="theme", type="button", hidden=True,
                aria_label="Dark colours"),
            class_="kicker",
        ),
        tag(
            "h1",
            kept(f"{finding.lead}."),
            *(tag("span", kept(f" {each}"), class_="cause") for each in finding.causes),
            tag("span", kept(f" {finding.end}"), class_="cause end") if finding.end else None,
            id="finding",
            tabindex="-1",
        ),
        tag("p", f"{says} " if says else "", kept(shown), class_="says"),
        *(tag("p", kept(line)) for line in never),
        tag("div", command, *(tag("p", kept(line)) for line in words), class_="words"),
    )  # fmt: skip


def _feet(
    own: Mapping[str, tuple[Series, Series]], one: Trace, two: Trace, labels: tuple[str, str]
) -> dict[str, str]:
    """Under the charts of the energy by what it was computed; of a force its other figure."""
    found = {"energy": _energy_by(one, two)}
    totals = [total_forces(one)]
    totals.append(same_pairs(totals[0], total_forces(two)))
    for name, sides in own.items():
        if name.endswith(NORMAL):
            pair = name.removesuffix(NORMAL)
            whole = [total[pair].max() if pair in total else 0.0 for total in totals]
            found[name] = "Drawn is the sum of the normal forces. " + " ".join(
                f"On {label} it is at most {figure(float(side.one.max()))} N; the whole force, "
                f"friction added as vectors, is at most {figure(float(most))} N."
                for label, side, most in zip(labels, sides, whole, strict=True)
            )
    return found


def _energy_by(one: Trace, two: Trace) -> str:
    """By what the energies of both sides were computed."""
    by = [trace.header.energy_by or trace.header.backend for trace in (one, two)]
    masses = "from the masses, the armature and the gravity of the model"
    if by[0] == by[1]:
        return f"For both sides computed by {by[0]}, {masses}."
    return f"Computed by {by[0]} and by {by[1]}, {masses}."


def _models(page: Page, emulated: bool) -> Html:
    """The verdict, and what it is of on demand."""
    verdicts = [block for block in page.blocks if isinstance(block, Verdict)]
    rest = [block for block in page.blocks if not isinstance(block, Verdict)]
    link = None
    if emulated:
        link = joined(
            (" What the backends then do about it for the runs above is in ",
             tag("a", "What is emulated", href="#emulated"), ".")
        )  # fmt: skip
    return joined(
        (
            tag("p", "Before anything moves.", link),
            sections.from_page(Page("", "", verdicts)),
            tag("details", tag("summary", page.title), sections.from_page(Page("", "", rest))),
        )
    )  # fmt: skip


def _section(name: str, heading: str, *content: object) -> Html:
    return tag(
        "section",
        tag("h2", heading, id=f"{name}-heading"),
        *content,
        id=name,
        aria_labelledby=f"{name}-heading",
    )


def _lead(comparison: Comparison, curves: Sequence[Series]) -> list[int]:
    """The quantities that are spoken with the moment: the leading one, and the fingertip's."""
    subject = leading(comparison)
    names = [curve.name for curve in curves]
    lead = [names.index(subject.name)] if subject and subject.name in names else []
    lead += [k for k, curve in enumerate(curves) if curve.kind == "tip"]
    return list(dict.fromkeys(lead))[:2] or [0]


def _assembled(title: str, body: Html, data: dict[str, Any]) -> str:
    script = "(() => {\n'use strict';\n" + "\n".join(_file(name) for name in _SCRIPTS) + "\n})();"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    filled = {
        "policy": Html(policy),
        "title": escaped(title),
        "style": Html(_file("page.css")),
        "body": body,
        "data": data_of(data),
        "script": Html(script),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: filled[found[1]], _file("page.html"))


def _file(name: str) -> str:
    return resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8")
