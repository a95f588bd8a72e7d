"""Pages from Jinja2 templates.

A template is Markdown with expressions. It stands beside the class of its content, a dataclass
whose fields are the names that the template may use:

    # {{ survey.title }}                       the title of the page
    *{{ survey.made_with }}*                   what it was computed with, right below the title
    ## Where they differ                       a heading
    {{ table(sums) }}                          a block, on a line of its own
    {{ gap | millimetres }} at {{ t | seconds }}    figures, each through a filter
    - One of several.                          an item of a list
    {% if diagnosis.healthy %} … {% endif %}   a choice of words
    {{ code_block(source) }}                   lines as they are typed
    {% call verdict(holds) %}…{% endcall %}    a statement that was checked
    {% call titled(sums) %}…{% endcall %}      a table, and its title
    {% call small() %}…{% endcall %}           notes in small print

A template chooses words, never verdicts: a condition tests one field or one named property, alone,
negated, against a constant text or for None. `check_templates` keeps that rule, and that every name
is a field. Text values are escaped. A number needs a filter unless it is an int. Nothing is shown
of None: it is an error.
"""

from __future__ import annotations

import functools
import importlib
import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from importlib import resources
from typing import TYPE_CHECKING, Any, ClassVar

from ..measures import text as numbers
from .blocks import (
    Block,
    Code,
    Heading,
    Headline,
    Items,
    Markdown,
    Page,
    Section,
    Table,
    Text,
    Verdict,
)
from .markdown import code, escape, parser, plain_text, prose

if TYPE_CHECKING:
    from jinja2 import Environment
    from markdown_it.tree import SyntaxTreeNode

# Around the number of a block that a template places; no value can hold them, see `escape`.
_OPEN, _CLOSE = "\ue100", "\ue101"


class PageContent:
    """What a template may name: the fields and properties of a frozen dataclass.

    Attributes:
        template: Name of the file, which lies in the folder of the module of the class.
    """

    template: ClassVar[str]


def render(content: PageContent) -> Page:
    """Return the page of a content.

    Raises:
        jinja2.UndefinedError: The template names what is no field.
        TypeError: A value is None, a flag or a number without a filter.
    """
    title, origin = "", ""
    blocks: list[Block] = []
    for block in render_blocks(content):
        if isinstance(block, _Title):
            title = block.text
        elif isinstance(block, _Origin):
            origin = block.text
        else:
            blocks.append(block)
    return Page(title, origin, blocks)


def with_answer(page: Page) -> Page:
    """Return a page whose first block, a verdict, is its answer: it stands before all else."""
    first, *others = page.blocks
    assert isinstance(first, Verdict), "the template begins with a verdict"
    lead = plain_text(first.text).removesuffix(".")
    return replace(page, blocks=others, headline=Headline(lead, holds=first.holds))


def render_blocks(content: PageContent) -> list[Block]:
    """Return the blocks of a content that is a part of a page; errors as of `render`."""
    placed = _Placed()
    template = environment(type(content).__module__).get_template(type(content).template)
    text = template.render(_names_of(content) | placed.macros())
    return placed.blocks_of(text)


def _names_of(content: PageContent) -> dict[str, object]:
    """Return the fields and properties of a content, by name."""
    names = set(getattr(type(content), "__dataclass_fields__", ()))
    for base in type(content).__mro__:  # a property may be inherited, as a field may
        names |= {name for name, member in vars(base).items() if isinstance(member, property)}
    return {name: getattr(content, name) for name in names - {"template"}}


@functools.cache
def environment(module: str) -> Environment:
    """Return the environment of the templates that lie beside a module."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    package = importlib.import_module(module).__package__ or ""

    def source(name: str) -> str:
        return resources.files(package).joinpath(name).read_text("utf-8")

    made = Environment(
        loader=FunctionLoader(source),
        undefined=StrictUndefined,
        finalize=shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters = dict(FILTERS)
    made.tests = {"none": lambda value: value is None}
    made.globals = {}
    return made


def shown(value: object) -> Markdown:
    """Return a value as it stands in a page.

    Raises:
        TypeError: It is None, a flag, or a number whose digits nobody chose.
    """
    if isinstance(value, Markdown):
        return value
    if isinstance(value, str) or (isinstance(value, int) and not isinstance(value, bool)):
        return escape(value)
    _raise_if_undefined(value)
    raise TypeError(f"a page shows no {type(value).__name__}; give it a filter, or a condition")


def _raise_if_undefined(value: object) -> None:
    """Raise the error of a name that is no field, which says which."""
    from jinja2 import StrictUndefined

    if isinstance(value, StrictUndefined):
        str(value)


def _joined(words: Iterable[object], between: str = ", ") -> str:
    """Return values one after the other."""
    return between.join(map(str, words))


# What a template may send a value through. Figures are in SI units.
FILTERS: dict[str, Callable[..., str | int]] = {
    "degrees": numbers.degrees,
    "millimetres": numbers.millimetres,
    "percent": numbers.percent,
    "seconds": numbers.short_time,
    "duration": numbers.duration,
    "digits": numbers.significant,
    "rough": numbers.rough,
    "quantity": numbers.quantity,
    "fixed": numbers.fixed,
    "count": numbers.count,
    "length": len,
    "capital": numbers.capital,
    "sentence": numbers.sentence,
    "few": numbers.few,
    "listed": numbers.listed,
    "joined": _joined,
    "versions": numbers.versions_of,
    "code": code,
    "prose": prose,
}


class _Title(Text):
    """The heading of a page."""


class _Origin(Text):
    """What a page was computed with."""


def macros() -> list[str]:
    """Return the names of what a template calls to place blocks."""
    return list(_Placed().macros())


def signature_of(macro: str) -> inspect.Signature:
    """Return what a macro takes from a template, without the text that a call block gives it."""
    signature = inspect.signature(_Placed().macros()[macro])
    names = [parameter for name, parameter in signature.parameters.items() if name != "caller"]
    return signature.replace(parameters=names)


class _Placed:
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
        from markdown_it.tree import SyntaxTreeNode

        tree = SyntaxTreeNode(parser().parse(text))
        blocks: list[Block] = []
        for node in tree.children:
            is_below_title = len(blocks) == 1 and isinstance(blocks[0], _Title)
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
                    return [_Title(plain_text(heading))]
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
            return [_Origin(Markdown(text[1:-1]))]
        return self._paragraph(node)


def _on_one_line(text: str) -> Markdown:
    """Return the Markdown that a call block gives a macro, without its line breaks."""
    return Markdown(" ".join(text.split()))


def _inline(node: SyntaxTreeNode) -> Markdown:
    """Return the Markdown of a paragraph or heading, on one line."""
    source: Any = node.children[0].content
    return Markdown(" ".join(source.split("\n")))
