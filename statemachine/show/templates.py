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
    {% call question(right) %}                 a prediction, and the number of the right choice:
    How far is it?                             a paragraph,
    - one metre                                a list of choices,
    - two metres
    > It was measured.                         and a quotation, which says what the run showed
    {% endcall %}
    {% call written_table("Names") %}          a table of words, and its title
    | here | there |
    | :-- | :-- |
    | step | mj_step |
    {% endcall %}

A template chooses words, never verdicts: a condition tests one field or one named property, alone,
negated, against a constant text or for None. `check_templates` keeps that rule, and that every name
is a field. Text values are escaped. A number needs a filter unless it is an int. Nothing is shown
of None: it is an error.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import math
import re
from collections.abc import Callable, Iterable
from importlib import resources
from typing import TYPE_CHECKING, ClassVar

from ..measures import text as numbers
from .blocks import Block, Markdown, Page, Text
from .markdown import code, escape, plain_text, prose
from .placed_blocks import PageOrigin, PageTitle, PlacedBlocks

if TYPE_CHECKING:
    from jinja2 import Environment

_NUMBER = re.compile("\ue102([0-9]+)\ue103")  # of a paragraph, in the empty line before it


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
        if isinstance(block, PageTitle):
            title = block.text
        elif isinstance(block, PageOrigin):
            origin = block.text
        else:
            blocks.append(block)
    return Page(title, origin, blocks)


def render_blocks(content: PageContent) -> list[Block]:
    """Return the blocks of a content that is a part of a page; errors as of `render`."""
    placed = PlacedBlocks()
    template = environment(type(content).__module__).get_template(type(content).template)
    text = template.render(_names_of(content) | placed.macros())
    return placed.blocks_of(text)


def render_texts(content: PageContent) -> list[str]:
    """Return the paragraphs of a content as plain texts; errors as of `render`."""
    return [plain_text(block.text) for block in render_blocks(content) if isinstance(block, Text)]


def render_paragraphs(content: PageContent) -> dict[int, list[Block]]:
    """Return the blocks of each paragraph of a content's template, by its number.

    A number belongs to a place in the template, whatever else of the template is shown: paragraphs
    of two contents are about the same thing where their numbers are equal. Errors as of `render`.
    """
    placed = PlacedBlocks()
    jinja = environment(type(content).__module__)
    assert jinja.loader is not None
    source, _, _ = jinja.loader.get_source(jinja, type(content).template)
    text = jinja.from_string(numbered(source)).render(_names_of(content) | placed.macros())
    first, *parts = _NUMBER.split(text)
    paragraphs = {0: placed.blocks_of(first)}
    for number, part in zip(parts[::2], parts[1::2], strict=True):
        paragraphs.setdefault(int(number), []).extend(placed.blocks_of(part))
    return paragraphs


def numbered(source: str) -> str:
    """Return a template with a number in each empty line, which belongs to what stands below it.

    An empty line within a call block is left as it is: what it separates is one block.
    """
    lines: list[str] = []
    open_calls = 0
    for number, line in enumerate(source.split("\n"), start=1):
        open_calls += line.count("{% call") - line.count("{% endcall")
        is_between = not line.strip() and open_calls == 0
        lines.append(f"\ue102{number}\ue103" if is_between else line)
    return "\n".join(lines)


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
FILTERS: dict[str, Callable[..., str | float]] = {
    "degrees": numbers.degrees,
    "millimetres": numbers.millimetres,
    "percent": numbers.percent,
    "seconds": numbers.short_time,
    "duration": numbers.duration,
    "digits": numbers.significant,
    "rough": numbers.rough,
    "quantity": numbers.quantity,
    "fixed": numbers.fixed,
    "number": format,
    "abs": math.fabs,
    "milliseconds": numbers.milliseconds,
    "position": numbers.position,
    "vector": numbers.vector,
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


def macros() -> list[str]:
    """Return the names of what a template calls to place blocks."""
    return list(PlacedBlocks().macros())


def signature_of(macro: str) -> inspect.Signature:
    """Return what a macro takes from a template, without the text that a call block gives it."""
    signature = inspect.signature(PlacedBlocks().macros()[macro])
    names = [parameter for name, parameter in signature.parameters.items() if name != "caller"]
    return signature.replace(parameters=names)
