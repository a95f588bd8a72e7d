"""Options of the right side that say what it has of a difference, whatever its file says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...engines.records import DifferingQuantity
from ...interface import Model
from ..compare.prepared_sides import on_left
from .causes import Cause, differences_of, option_of, reason_of_option
from .explanation import Explanation, Share
from .request import WhyRequest
from .setup import Setup
from .written import as_written

_Values = tuple[DifferingQuantity, ...]


def options_of_right(
    question: WhyRequest, models_without: Mapping[str, Model], finer: bool
) -> dict[str, str]:
    """Return which option of the right says its value of each difference that one says.

    An option does where the difference goes, or has other values, once the option is dropped.

    Args:
        question: What was asked of both sides.
        models_without: The right by each of its options, as that is typed: without this one.
        finer: Whether every difference is divided into its entries.

    Returns:
        The option as it is typed, by the title of the difference.
    """
    options: dict[str, str] = {}
    if not models_without:
        return options
    values = _values_by_title(question, finer)
    for option, model in models_without.items():
        without = _values_by_title(replace(question, right=model), finer)
        for title, typed in values.items():
            if without.get(title) != typed:
                options.setdefault(title, option)
    return options


def with_options_of_right(
    result: Explanation, question: WhyRequest, options: Mapping[str, str], finer: bool
) -> Explanation:
    """Return an explanation whose causes name the option of the right that makes them, if any.

    Args:
        result: The explanation.
        question: What was asked.
        options: As `options_of_right` returns them.
        finer: Whether every difference is divided into its entries.
    """
    if not options:
        return result
    causes = _causes(question, finer)
    written = as_written(question.left.path, question.right.path, causes)
    by_name = {text.name: cause for text, cause in zip(written, causes, strict=True)}
    shares = tuple(_with_option(row, by_name.get(row.name), options) for row in result.shares)
    return replace(result, shares=shares)


def _with_option(row: Share, cause: Cause | None, options: Mapping[str, str]) -> Share:
    """Return a cause with the option that makes it, and so without a line of the file."""
    option = "" if cause is None else option_of(cause, options)
    if cause is None or not option:
        return row
    reason = reason_of_option(cause, options)
    return replace(row, option=option, place=None, changes=(), not_written=reason)


def _causes(question: WhyRequest, finer: bool) -> tuple[Cause, ...]:
    """Return all that can be a cause of the gap between two sides."""
    if not question.recordings:
        scenario = on_left(question.scenario, question.left, question.right)
        question = replace(question, scenario=scenario)
    return Setup(question, question.matched()).causes(finer)


def _values_by_title(question: WhyRequest, finer: bool) -> dict[str, _Values]:
    """Return what both sides have of each difference, by its title."""
    values: dict[str, _Values] = {}
    if question.are_compiled:
        rows = differences_of(question.left, question.right, question.matched())
        values |= {row.title: row.values for row in rows}
    for cause in _causes(question, finer):
        values |= {row.title: row.values for row in cause.differences}
    return values
