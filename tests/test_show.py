"""Pages from templates: what is escaped, what a renderer makes of it, what the check reports."""

from __future__ import annotations

import html
import io
import re
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Literal

import jinja2
import pytest
from rich.console import Console

from statemachine.course.notebook import markdown
from statemachine.show import terminal, text_blocks
from statemachine.show.blocks import (
    Block,
    Items,
    Markdown,
    Page,
    Printed,
    Question,
    Section,
    Table,
    Text,
    Verdict,
)
from statemachine.show.check_templates import faults_of
from statemachine.show.each_engine import blocks_of_engines
from statemachine.show.html.blocks import drawn
from statemachine.show.markdown import code, escape, inline_html, plain_text, spans
from statemachine.show.page_text import text_of
from statemachine.show.templates import FILTERS, PageContent, environment, render
from tools import check_templates

HOSTILE = (
    "a|b",
    "back`tick",
    "two ``backticks``",
    "<script>alert(1)</script>",
    "__init__",
    "snake_case_name",
    "*stars*",
    "[link](javascript:alert(1))",
    "![image](http://example.org/x.png)",
    "<http://example.org>",
    "# heading",
    "- item",
    "1. first",
    "---",
    "> quote",
    "&lt;b&gt;",
    "$x$ and {role}`x`",
    "~~struck~~",
    "trailing\\",
    " # heading behind a blank",
    " - item behind a blank",
    "  ---",
    " +",
    "    code behind blanks",
    " 1. first behind a blank",
    "blank behind ",
    "{{ braces }} {% if x %}",
    "long" * 500,
)


@dataclass(frozen=True)
class _Part:
    name: str
    size: float | None = None


@dataclass(frozen=True)
class _Content(PageContent):
    template = "made_up.md.j2"
    name: str
    size: float = 0.25
    holds: bool = True
    state: Literal["inside", "beyond"] = "inside"
    parts: tuple[_Part, ...] = ()
    names: tuple[str, ...] = ()
    sizes: Table = field(default_factory=lambda: Table(("what", "size"), []))


def page_of(source: str, content: _Content, monkeypatch: pytest.MonkeyPatch) -> Page:
    """The page of a template that is no file."""
    jinja = environment(_Content.__module__)
    monkeypatch.setattr(jinja, "loader", jinja2.DictLoader({_Content.template: source}))
    monkeypatch.setattr(jinja, "cache", None)
    return render(content)


@dataclass(frozen=True)
class _OfEngine(PageContent):
    template = "made_up.md.j2"
    odd: bool
    number: int
    sizes: Table = field(default_factory=lambda: Table(("a",), [("1",)]))


def _said_of(source: str, monkeypatch: pytest.MonkeyPatch, **contents: _OfEngine) -> list[Block]:
    """What a template says of several engines."""
    jinja = environment(_OfEngine.__module__)
    monkeypatch.setattr(jinja, "loader", jinja2.DictLoader({_OfEngine.template: source}))
    return blocks_of_engines(contents)


_ODD, _EVEN = _OfEngine(odd=True, number=1), _OfEngine(odd=False, number=0)


def test_engines_of_which_the_same_is_said_stand_together(monkeypatch: pytest.MonkeyPatch) -> None:
    source = (
        "All.\n\n{% if odd %}\nOdd {{ number }}.\n{% else %}\nEven {{ number }}.\n{% endif %}\n"
    )
    assert _said_of(source, monkeypatch, x=_ODD, y=_EVEN, z=_ODD) == [
        Text("All."), Text("x, z: Odd 1."), Text("y: Even 0."),
    ]  # fmt: skip


def test_paragraphs_of_engines_stand_in_the_order_of_the_template(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = (
        "{% if odd %}\nFirst.\n\n{% endif %}\nNumber {{ number }}.\n\n"
        "{% if odd %}\nLast.\n{% endif %}\n"
    )
    assert _said_of(source, monkeypatch, y=_EVEN, x=_ODD) == [
        Text("y: Number 0."), Text("x: First."), Text("x: Number 1."), Text("x: Last."),
    ]  # fmt: skip


def test_a_verdict_says_whose_it_is_and_a_table_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "{% call verdict(odd) %}Odd.{% endcall %}\n\n{{ table(sizes) }}\n"
    assert _said_of(source, monkeypatch, x=_ODD, y=_EVEN) == [
        Verdict("x: Odd.", True), Verdict("y: Odd.", False), _ODD.sizes,
    ]  # fmt: skip


_QUESTION = """\
{% call question(number) %}
How
many?
- none
- `one`

> So.
{% endcall %}
"""


def test_a_question_is_a_paragraph_a_list_and_a_quotation(monkeypatch: pytest.MonkeyPatch) -> None:
    question = Question("How many?", ["none", "`one`"], 1, "So.")
    assert _said_of(_QUESTION, monkeypatch, x=_ODD) == [question]


def test_a_question_is_that_of_the_first_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    (question,) = _said_of(_QUESTION, monkeypatch, y=_EVEN, x=_ODD)
    assert isinstance(question, Question)
    assert question.right == 0


def test_a_table_of_words_stands_in_the_template(monkeypatch: pytest.MonkeyPatch) -> None:
    source = (
        '{% call written_table("Names") %}\n| a | b |\n| :-- | :-- |\n| 1 | `x` |\n{% endcall %}\n'
    )
    assert _said_of(source, monkeypatch, x=_ODD) == [
        Table(["a", "b"], [["1", "x"]], "Names", frozenset({0, 1}))
    ]


def printed(page: Page) -> str:
    out = io.StringIO()
    with redirect_stdout(out):
        terminal.show(page)
    return out.getvalue()


@pytest.mark.parametrize("text", HOSTILE)
def test_an_escaped_value_is_read_as_it_is(text: str) -> None:
    assert plain_text(escape(text)) == text


@pytest.mark.parametrize("text", HOSTILE)
def test_an_escaped_value_makes_no_element(text: str) -> None:
    shown = inline_html(escape(text))
    assert not re.search(r"<(?!/?(?:code|em|strong)\b)", shown)
    assert not re.search("<(?:em|code|strong)>", shown)
    assert html.unescape(shown) == text


@pytest.mark.parametrize("text", [*HOSTILE, "`", "``", " ` "])
def test_code_is_one_span_whatever_it_holds(text: str) -> None:
    (span,) = spans(code(text))
    assert (span.text, span.kind) == (text, "code")


def test_a_line_break_in_a_value_ends_no_paragraph() -> None:
    assert escape("a\n\n# b\x1b[31m") == "a??# b?\\[31m"


@pytest.mark.parametrize("text", HOSTILE)
def test_a_name_is_shown_as_it_is_in_every_medium(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = (
        "# of {{ name }}\n\n*{{ name }}*\n\n{{ name }}: is it.\n\n- {{ name }}\n\n"
        "{{ table(sizes) }}"
    )
    content = _Content(text, sizes=Table(("what",), [(text,)]))
    page = page_of(source, content, monkeypatch)
    assert page.title == f"of {text}"
    assert plain_text(page.origin) == text
    paragraph, items, table = page.blocks
    assert isinstance(paragraph, Text)
    assert plain_text(paragraph.text) == f"{text}: is it."
    assert isinstance(items, Items)
    assert [plain_text(item) for item in items.texts] == [text]
    assert isinstance(table, Table)
    assert table.rows[0][0] == text
    letters = "".join(printed(page).split())
    assert letters.count("".join(text.split())) >= 4
    web = drawn(page.blocks)
    assert not re.search(r"<(?:script|img|a|h1|blockquote)\b", web)
    assert "<script" not in markdown(page, lambda _: "").replace("\\<script", "")


def test_blocks_stand_where_the_template_places_them(monkeypatch: pytest.MonkeyPatch) -> None:
    source = (
        "# T\n\nfirst\n\n{{ table(sizes) }}\n\n"
        "{% call verdict(holds) %}\nit\nholds\n{% endcall %}\n"
        "{% call section('More') %}\ninside\n{% endcall %}\n"
        "{% call small() %}\none\n\ntwo\n{% endcall %}\n"
    )
    content = _Content("x", sizes=Table(("a",), [("1",)]))
    first, table, verdict, section, *notes = page_of(source, content, monkeypatch).blocks
    assert first == Text(Markdown("first"))
    assert table is content.sizes
    assert verdict == Verdict(Markdown("it holds"), True)
    assert section == Section("", "More", [Text(Markdown("inside"))])
    assert notes == [Text(Markdown("one"), small=True), Text(Markdown("two"), small=True)]


def test_a_table_without_rows_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    assert page_of("{{ table(sizes) }}", _Content("x"), monkeypatch).blocks == []


@pytest.mark.parametrize("expression", ["size", "holds", "parts[0].size"])
def test_what_needs_a_filter_or_a_condition_is_refused(
    expression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = _Content("x", parts=(_Part("p"),))
    with pytest.raises(TypeError, match="a page shows no"):
        page_of(f"{{{{ {expression} }}}}", content, monkeypatch)


def test_a_figure_comes_through_its_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    (text,) = page_of("{{ size | millimetres }}", _Content("x"), monkeypatch).blocks
    assert text == Text(Markdown("250.00 mm"))


FAULTS = {
    "{{ nam }}": "no field 'nam'. Did you mean name?",
    "{% if holds %}{{ name }}{% else %}{{ parts2 }}{% endif %}": "no field 'parts2'",
    "{% for part in parts %}{{ part.nme }}{% endfor %}": "_Part has no field 'nme'",
    "{{ size | milimetres }}": "no filter 'milimetres'. Did you mean millimetres?",
    "{% if size > 2 %}a{% endif %}": "a condition compares a field with a constant text alone",
    "{% if holds and name %}a{% endif %}": "a condition tests one field or named property",
    "{% if state == 'insde' %}a{% endif %}": "no value 'insde'",
    "{{ none }}": "a page shows no None",
    "{{ size }}": "a page shows no float without a filter",
    "{{ holds }}": "a page shows no bool without a filter",
    "{{ parts }}": "a page shows no tuple without a filter",
    "{% for name, part in names %}{{ name }}{% endfor %}": "a text is no pair",
    "{{ table(sizes, 3) }}": "table: too many positional arguments",
    "{% call section('More', foldet=true) %}x{% endcall %}": "unexpected keyword argument 'foldet'",
    "{% call titled() %}x{% endcall %}": "titled: missing a required argument: 'table'",
    "{{ size + 1 }}": "Add has no place in a template",
    "{% if holds %}{% if name %}{% if size %}a{% endif %}{% endif %}{% endif %}": "a condition "
    "stands in a condition that stands in a condition",
    "{{ 'a' if holds or name else 'b' }}": "a condition tests one field or named property",
    "{{ open(name) }}": "a template calls table",
    "{{ parts | joined(between=nosuch) }}": "no field 'nosuch'",
    "{{ table(sizs) }}": "no field 'sizs'",
    "{% call verdict(hold) %}x{% endcall %}": "no field 'hold'",
    "{% call verdict(holds) %}{{ nam }}{% endcall %}": "no field 'nam'",
}


@pytest.mark.parametrize("source", FAULTS)
def test_a_fault_of_a_template_is_reported_without_a_run(source: str) -> None:
    (fault,) = faults_of(_Content, source)
    assert FAULTS[source] in str(fault)


@pytest.mark.parametrize(
    "source",
    [
        "{% if not holds %}a{% elif state == 'beyond' %}b{% else %}c{% endif %}",
        "{% for part in parts %}{% if part.size is not none %}{{ part.size | rough }}{% endif %}"
        "{% endfor %}",
        "{{ name if holds else 'nobody' }}",
    ],
)
def test_what_chooses_words_is_no_fault(source: str) -> None:
    assert faults_of(_Content, source) == []


def test_every_template_names_fields_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert check_templates.main() == 0, capsys.readouterr().out


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_a_filter_is_documented(name: str) -> None:
    filter_ = FILTERS[name]
    assert isinstance(filter_, type) or filter_.__doc__


# A table in a narrow window.

HOLDERS = Table(
    ("who", "mujoco\nservos on", "mujoco\nservos off", "pybullet\nservos on"),
    [("gravity (−bias)", "+0.5694", "+0.6168", "+0.5694"), ("springs, damping", "0", "-1", "2")],
)


def lines_at(width: int, table: Table) -> list[str]:
    console = Console(width=width, highlight=False, color_system=None)
    with console.capture() as captured:
        for part in text_blocks.drawn(table, plain=False, piped=True, width=width):
            console.print(part)
    return captured.get().splitlines()


@pytest.mark.parametrize("width", [80, 60, 40, 30])
def test_no_name_and_no_figure_breaks_in_a_narrow_window(width: int) -> None:
    lines = lines_at(width, HOLDERS)
    assert max(map(len, lines)) <= width
    words = " ".join(lines).split()
    cells = [cell for row in (HOLDERS.headers, *HOLDERS.rows) for cell in row]
    assert set(" ".join(cells).split()) <= set(words)


def test_a_table_that_fits_has_a_line_for_each_row() -> None:
    names = [line for line in lines_at(80, HOLDERS) if line.startswith(("gravity", "springs"))]
    assert [line.split("  ")[0] for line in names] == ["gravity (−bias)", "springs, damping"]


def test_a_piped_lesson_explains_the_answer_below_what_was_printed() -> None:
    question = Question("a or b?", ("one", "two"), 1, "So it is.")
    lines = text_of(Page("t", "o", [question, Printed({"mujoco": "2"}), Text("On.")])).splitlines()
    assert [line for line in lines if line][-3:] == ["    2", "So it is.", "On."]


def test_a_piped_quiz_has_its_choices_and_the_answer() -> None:
    question = Question("`a` or b?", ("the `first`", "the second"), 1, "So it is.", True)
    lines = text_of(Page("t", "o", [question])).splitlines()
    asked = lines.index("`a` or b?")
    assert lines[asked + 1 : asked + 4] == ["", "a) the `first`", "b) the second"]
    assert "Answer: b)" in lines[asked + 5]
