"""What leads where a search for causes was ended before there were shares."""

from __future__ import annotations

from dataclasses import replace

import pytest

from statemachine.lab.why import Explanation
from statemachine.lab.why.answer_page import unmeasured
from statemachine.lab.why.table_page import summary_table
from statemachine.measures.text import percent

from .support.explained import ARM, explained

OTHER = ARM.replace('kp="20"', 'kp="25"').replace('armature="0.01"', 'armature="0.02"')


@pytest.fixture(scope="module")
def ranked(tmp_path_factory: pytest.TempPathFactory) -> Explanation:
    """Return an explanation of two causes as one that was ended before there were shares."""
    folder = tmp_path_factory.mktemp("ranked")
    whole = explained(folder, ARM, OTHER, uncertain=None, jobs=1)
    assert len(whole.shares) == 2
    shares = tuple(replace(row, share=None) for row in whole.shares)
    return replace(whole, shares=shares, method="alone and last", ended_by="time limit")


def _with_figures(found: Explanation, *figures: tuple[float | None, float | None]) -> Explanation:
    """Return an explanation with what causes take away alone, and last."""
    shares = list(found.shares)
    for number, (alone, last) in enumerate(figures):
        known = [figure for figure in (alone, last) if figure is not None]
        ends = (min(known), max(known)) if known else None
        shares[number] = replace(shares[number], alone=alone, last=last, range=ends)
    return replace(found, shares=tuple(shares))


def test_a_cause_leads_by_the_figure_that_is_known_where_the_other_is_not(
    ranked: Explanation,
) -> None:
    found = _with_figures(ranked, (0.0, 0.156), (None, 0.25))
    assert found.leading() == found.shares[1]
    assert summary_table(found, 1).rows[0][3] == f"{percent(0.25)} last"


def test_no_cause_leads_while_nothing_is_known_of_another(ranked: Explanation) -> None:
    found = _with_figures(ranked, (None, None), (0.2, 0.25))
    assert unmeasured(found) == (found.shares[0].name,)


def test_the_two_ends_of_a_range_that_are_one_figure_are_shown_once(ranked: Explanation) -> None:
    found = _with_figures(ranked, (0.2501, 0.2499), (0.0, 0.0))
    assert summary_table(found, 1).rows[0][3] == "25 %"


def test_a_cause_leads_by_the_orders_in_which_it_was_run(ranked: Explanation) -> None:
    found = _with_figures(ranked, (None, None), (0.1, 0.1))
    seen = replace(found.shares[0], range=(0.59, 0.62))
    found = replace(found, shares=(seen, *found.shares[1:]))
    assert found.leading() == seen
    assert summary_table(found, 1).rows[0][3] == "59 to 62 %"
