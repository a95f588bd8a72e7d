"""One page of several engines: what is said of all of them stands there once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from .blocks import Block, Markdown, Question, Text, Verdict
from .markdown import escape
from .templates import PageContent, render_paragraphs


def blocks_of_engines(contents: Mapping[str, PageContent]) -> list[Block]:
    """Return what a template says of several engines, paragraph by paragraph.

    A paragraph stands there once for all engines of which it says the same, under their names if
    these are not all. Of a question there is one: that of the first engine.

    Args:
        contents: What the template shows of each engine, by the engine's name.
    """
    rendered = {engine: render_paragraphs(content) for engine, content in contents.items()}
    first = next(iter(contents))
    blocks: list[Block] = []
    for number in sorted(set[int]().union(*rendered.values())):
        paragraphs = {
            engine: parts[number] for engine, parts in rendered.items() if number in parts
        }
        for engines, paragraph in _said_alike(paragraphs):
            prefix = Markdown("")
            if len(engines) < len(contents):
                prefix = Markdown(f"{escape(', '.join(engines))}: ")
            for block in paragraph:
                if not isinstance(block, Question) or first in engines:
                    blocks.append(_with_prefix(block, prefix))
    return blocks


def _said_alike(
    paragraphs: Mapping[str, Sequence[Block]],
) -> Iterator[tuple[Sequence[str], Sequence[Block]]]:
    """Yield each paragraph that differs from those before it, with the engines that have it."""
    left = dict(paragraphs)
    while left:
        paragraph = next(iter(left.values()))
        engines = [engine for engine, other in left.items() if other == paragraph]
        yield engines, paragraph
        for engine in engines:
            del left[engine]


def _with_prefix(block: Block, prefix: Markdown) -> Block:
    """Return a block that says whose it is; a table says so itself."""
    if prefix and isinstance(block, Text | Verdict):
        return replace(block, text=Markdown(f"{prefix}{block.text}"))
    return block
