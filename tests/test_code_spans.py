"""Code within a sentence, and texts that are cut to a width."""

from __future__ import annotations

import pytest

from statemachine.show.diagrams.shapes import cut
from statemachine.show.markdown import code


@pytest.mark.parametrize(
    ("text", "span"),
    [
        ("qpos", "`qpos`"),
        ("a`b", "``a`b``"),
        ("a``b", "```a``b```"),
        ("`a", "`` `a ``"),
        (" a ", "`  a  `"),
        (" ", "` `"),
    ],
)
def test_a_span_of_code_has_a_fence_that_its_text_has_not(text: str, span: str) -> None:
    assert code(text) == span


@pytest.mark.parametrize(
    ("text", "room", "shown"),
    [
        ("abc", 3, "abc"),
        ("abcd", 3, "ab~"),
        ("日本語", 6, "日本語"),  # each letter takes two columns
        ("日本語", 5, "日本~"),
        ("日本語", 4, "日~"),
        ("a日本", 4, "a日~"),
    ],
)
def test_a_text_is_cut_to_the_columns_that_there_are(text: str, room: int, shown: str) -> None:
    assert cut(text, room, "~") == shown
