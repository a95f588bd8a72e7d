"""The blocks that a template places, and those that its Markdown has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from .blocks import (
    Block,
    Code,
    Heading,
    Items,
    Markdown,
    Question,
    Section,
    Table,
    Text,
    Verdict,
)
from .markdown import parser, plain_text, typed_text

if TYPE_CHECKING:
    from markdown_it.tree import SyntaxTreeNode

# Around the number of a block that a template places; no value can hold them, see `escape`.
_OPEN, _CLOSE = "\ue100", "\ue101"


class PageTitle(Text):
    """The heading of a page."""


class PageOrigin(Text):
    """What a page was computed with."""


class PlacedBlocks:
    """The blocks that a template places; each leaves a marker in the text."""

    def __init__(self) -> None:
        self._groups: list[Sequence[Block]] = []

    def macros(self) -> dict[str, Callable[..., str]]:
        """Return the functions that a template calls to place blocks."""
        return {
            "table": self.table,
            "titled": self.titled,
            "block": self.block,
            "blocks": self.blocks,
            "items": self.items,
            "code_block": self.code_block,
            "verdict": self.verdict,
            "small": self.small,
            "question": self.question,
            "written_table": self.written_table,
            "section": self.section,
        }

    def table(self, table: Table) -> Markdown:
        """Place a table; without rows there is nothing to show."""
        return self._mark([table] if table.rows else [])

    def titled(self, table: Table, caller: Callable[[], str]) -> Markdown:
        """Place a table under a title."""
        return self.table(replace(table, title=plain_text(_on_one_line(caller()))))

    def block(self, block: Block) -> Markdown:
        """Place a block of any kind."""
        return self._mark([block])

    def blocks(self, blocks: Sequence[Block]) -> Markdown:
        """Place blocks one below the other."""
        return self._mark(blocks)

    def items(self, texts: Sequence[str], ordered: bool = False) -> Markdown:
        """Place a list; without items there is nothing to show."""
        return self._mark([Items(texts, ordered)] if texts else [])

    def code_block(self, source: str) -> Markdown:
        """Place lines as they are typed; of none there is nothing to show."""
        return self._mark([Code(source.splitlines())] if source else [])

    def verdict(self, holds: bool, caller: Callable[[], str]) -> Markdown:
        """Place a statement that was checked, and whether it held."""
        return self._mark([Verdict(_on_one_line(caller()), holds)])

    def small(self, caller: Callable[[], str]) -> Markdown:
        """Place paragraphs in small print."""
        inside = self.blocks_of(caller())
        notes = [Text(b.text, b.see, True) if isinstance(b, Text) else b for b in inside]
        return self._mark(notes)

    def question(
        self,
        right: int | None,
        caller: Callable[[], str],
        undecided: bool = False,
        always: bool = False,
    ) -> Markdown:
        """Place a question: a paragraph, a list of choices, and a quotation of what was found.

        Args:
            right: Number of the right choice; None where it is none of them.
            caller: Returns the Markdown of these three.
            undecided: Whether no run can tell which choice is right.
            always: Whether it is shown where nobody can answer, too.
        """
        asked, listed, quoted = _nodes(caller())
        text, because = typed_text(_inline(asked)), typed_text(_inline(quoted.children[0]))
        choices = [typed_text(_inline(item.children[0])) for item in listed.children]
        if undecided:
            right = None
        return self._mark([Question(text, choices, right, because, always, undecided)])

    def written_table(self, title: str, caller: Callable[[], str]) -> Markdown:
        """Place a table of words that stands in the template, under a title."""
        (written,) = _nodes(caller())
        rows: list[list[str]] = []
        for part in written.children:
            for row in part.children:
                rows.append([plain_text(_inline(cell)) for cell in row.children])
        headers, *cells = rows
        return self._mark([Table(headers, cells, title, frozenset(range(len(headers))))])

    def section(
        self,
        heading: str,
        caller: Callable[[], str],
        name: str = "",
        folded: bool = False,
        detail: bool = False,
    ) -> Markdown:
        """Place blocks under a heading."""
        return self._mark([Section(name, heading, self.blocks_of(caller()), folded, detail)])

    def _mark(self, blocks: Sequence[Block]) -> Markdown:
        self._groups.append(blocks)
        return Markdown(f"\n\n{_OPEN}{len(self._groups) - 1}{_CLOSE}\n\n")

    def blocks_of(self, text: str) -> list[Block]:
        """Return the blocks of a Markdown text, those that were placed at their places."""
        blocks: list[Block] = []
        for node in _nodes(text):
            is_below_title = len(blocks) == 1 and isinstance(blocks[0], PageTitle)
            if is_below_title and node.type == "paragraph":
                blocks += self._below_title(node)
            else:
                blocks += self._blocks_of_node(node)
        return blocks

    def _blocks_of_node(self, node: SyntaxTreeNode) -> Sequence[Block]:
        match node.type:
            case "heading":
                heading = _inline(node)
                if node.tag == "h1":
                    return [PageTitle(plain_text(heading))]
                return [Heading(heading)]
            case "paragraph":
                return self._paragraph(node)
            case "bullet_list" | "ordered_list":
                texts = [_inline(item.children[0]) for item in node.children]
                return [Items(texts, node.type == "ordered_list")]
            case "fence" | "code_block":
                return [Code(node.content.rstrip("\n").split("\n"))]
        raise ValueError(f"a template's Markdown has a {node.type}, which no page shows")

    def _paragraph(self, node: SyntaxTreeNode) -> Sequence[Block]:
        text = _inline(node)
        if text.startswith(_OPEN) and text.endswith(_CLOSE):
            return self._groups[int(text[1:-1])]
        return [Text(text)]

    def _below_title(self, node: SyntaxTreeNode) -> Sequence[Block]:
        """Return the line below the title, *all of it*; another paragraph is one."""
        text = _inline(node)
        if len(text) > 2 and text.startswith("*") and text.endswith("*"):
            return [PageOrigin(Markdown(text[1:-1]))]
        return self._paragraph(node)


def _nodes(text: str) -> Sequence[SyntaxTreeNode]:
    """Return the paragraphs, lists, quotations and the like of a Markdown text."""
    from markdown_it.tree import SyntaxTreeNode

    return SyntaxTreeNode(parser().parse(text)).children


def _on_one_line(text: str) -> Markdown:
    """Return the Markdown that a call block gives a macro, without its line breaks."""
    return Markdown(" ".join(text.split()))


def _inline(node: SyntaxTreeNode) -> Markdown:
    """Return the Markdown of a paragraph or heading, on one line."""
    source: Any = node.children[0].content
    return Markdown(" ".join(source.split("\n")))
