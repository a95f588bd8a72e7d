"""A section of charts: how far apart each quantity is over time, and both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...compare import Comparison, Series
from ...comparison.text import reading
from . import sections
from .charts import data_table, difference_chart, logarithmic, values_chart
from .finding import name_of
from .markup import Html, joined, tag


def curves_section(
    comparison: Comparison,
    curves: Sequence[Series],
    own: Mapping[str, tuple[Series, Series]],
    labels: tuple[str, str],
    points: int,
    feet: Mapping[str, str],
) -> Html:
    """A row of charts for each quantity, those that differ first.

    Args:
        comparison: What was found.
        curves: Of both sides at common moments.
        own: Of each side at its own rows, by name.
        labels: What the sides are called.
        points: At most, of a curve.
        feet: What is said under the charts of a quantity, by its name.
    """
    by_name = {found.name: found for found in comparison.agreements}
    shown: dict[str, list[tuple[float, Html]]] = {"differs": [], "settles": [], "agrees": []}
    for curve in curves:
        found = by_name[curve.name]
        chart = values_chart(*own[curve.name], labels, points) if curve.name in own else None
        unit = reading(curve.unit)[1].strip()
        axis = "log axis; " if logarithmic(found) else ""
        said = f"how far apart, {unit}; {axis}shaded: within tolerance"
        row = tag(
            "section",
            tag("h3", tag("span", name_of(curve.name), class_="quantity"),
                sections.verdict_badge(found.verdict)),
            tag(
                "div",
                tag("figure", tag("figcaption", said),
                    difference_chart(curve, found, points)),
                tag("figure", tag("figcaption", f"both sides, {unit}"), chart) if chart else None,
                class_="charts",
            ),
            tag("p", feet[curve.name], class_="foot") if curve.name in feet else None,
            tag("details", tag("summary", f"The figures of {name_of(curve.name)}"),
                data_table(curve, found, labels), class_="data"),
            class_="quantity-row",
        )  # fmt: skip
        shown[found.verdict].append((-found.tolerances(), row))
    beyond = [row for v in ("differs", "settles") for _, row in sorted(shown[v], key=_first)]
    within = [row for _, row in sorted(shown["agrees"], key=_first)]
    key = tag(
        "p",
        tag("i", class_="key one"), f" {labels[0]}, full line ",
        tag("i", class_="key two"), f" {labels[1]}, broken line ",
        class_="legend",
    )  # fmt: skip
    if not beyond:
        return joined((key, *within))
    more = tag("details", tag("summary", _agreeing(len(within))), *within) if within else None
    return joined([part for part in (key, *beyond, more) if part is not None])


def _first(pair: tuple[float, Html]) -> float:
    return pair[0]


def _agreeing(count: int) -> str:
    return f"The {count} that agree" if count > 1 else "The one that agrees"
