"""Titles of tables and labels of their rows, from Jinja2 macros beside the code that fills them."""

from __future__ import annotations

from functools import cached_property

from .markdown import Markdown, plain_text
from .templates import environment


class TableLabels:
    """Represents the labels of a module, which are macros in a file beside it.

    say = TableLabels(__name__, "gravity_labels.md.j2")
    say("course", joint="elbow")  # {% macro course(joint) %}{{ joint }} under gravity{% endmacro %}
    """

    def __init__(self, module: str, template: str) -> None:
        self._module = module
        self._template = template

    @cached_property
    def _macros(self) -> object:
        """Return the file's macros, as attributes."""
        return environment(self._module).get_template(self._template).module

    def __call__(self, name: str, /, **values: str | int) -> str:
        """Return a label.

        Args:
            name: Of its macro.
            **values: What the macro takes.

        Raises:
            AttributeError: There is no such macro.
            TypeError: It does not take such a value.
            jinja2.UndefinedError: A value is missing.
        """
        return plain_text(Markdown(getattr(self._macros, name)(**values)))
