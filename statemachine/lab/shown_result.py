"""What every Result can do: print its page, be shown in a notebook, give its table as columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from ..show.blocks import Block, Page

_OPTION = "--details"
_CALL = "`result.text(details=True)`"
_FOLDED = "“Details” below"

# A column of the table: values of one type, among which None stands for what is not known.
Column = list[Any]


class _PageFunction(Protocol):
    """What makes the page of a result."""

    def __call__(self, result: Any, /, *, details: bool) -> Page: ...


class ShownResult(ABC):
    """A Result that shows itself.

    `print(result)` shows its page as a terminal does, 80 columns wide and without colours. A
    notebook shows it as HTML.

    Attributes:
        page_function: Where its page is made, as "module:function" below `statemachine.lab`; the
            function takes the result and `details`. It is named, since its module imports the
            class of the result.
    """

    page_function: ClassVar[str]

    @abstractmethod
    def to_dict(self) -> dict[str, Column]:
        """Return the main table as columns of equal length, by name.

        pandas.DataFrame and polars.DataFrame take it as it is.
        """

    def figures(self) -> object:
        """Return what JSON shows of it: itself."""
        return self

    def page(self, details: bool = False) -> Page:
        """Return the page.

        Args:
            details: Whether everything is on it, or the verdict, the worst of it, and what to ask
                next.
        """
        module, _, function = self.page_function.partition(":")
        page_of: _PageFunction = getattr(import_module(f"{__package__}.{module}"), function)
        return page_of(self, details=details)

    def text(self, details: bool = False) -> str:
        """Return the page as text, 80 columns wide and without colours.

        Args:
            details: As of `page`.
        """
        from ..show.page_text import text_of

        return text_of(_saying(self.page(details), _CALL)).strip("\n")

    def to_json(self) -> str:
        """Return what the command prints with --json."""
        from ..show.as_json import dumps

        return dumps(self.figures())

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        page = self.page()
        text = page.title
        if page.headline is not None:
            text = page.headline.lead
        return f"<{type(self).__name__}: {text}>"

    def _repr_html_(self) -> str:
        """Return the page as a notebook shows it, with everything else folded below."""
        from ..show.html.notebook import fragment

        return fragment(_saying(self.page(), _FOLDED), _saying(self.page(details=True), _FOLDED))


def _saying(page: Page, words: str) -> Page:
    """Return a page that says how one sees everything where nobody types an option.

    Args:
        page: As the command prints it.
        words: What stands for its option --details.
    """
    from ..show.blocks import Text
    from ..show.markdown import Markdown

    blocks: list[Block] = []
    for block in page.blocks:
        if isinstance(block, Text) and _OPTION in block.text:
            text = block.text.replace(f"`{_OPTION}`", words).replace(_OPTION, words)
            blocks.append(replace(block, text=Markdown(text)))
        else:
            blocks.append(block)
    return replace(page, blocks=blocks)


def columns_of(records: Sequence[object], names: Iterable[str]) -> dict[str, Column]:
    """Return attributes of records as columns: a row for each record.

    Args:
        records: Dataclasses of one kind.
        names: Of the attributes.
    """
    columns: dict[str, Column] = {}
    for name in names:
        columns[name] = [getattr(record, name) for record in records]
    return columns
