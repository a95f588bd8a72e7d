"""Each kind of block as HTML."""

from __future__ import annotations

import base64
import re
from xml.etree import ElementTree

import pytest

from statemachine.show.blocks import Block, Code, Heading, Items, Section, Table, Text, Verdict
from statemachine.show.charts import drawn as drawn_by_matplotlib
from statemachine.show.html.blocks import drawn
from statemachine.show.pictures import Traces


def elements(*blocks: Block, level: int = 2) -> list[ElementTree.Element]:
    """Return the elements of blocks, one after the other."""
    text = re.sub(r"(<img[^>]*)>", r"\1/>", str(drawn(blocks, level=level)))  # as XML has it
    return list(ElementTree.fromstring(f"<div>{text}</div>"))


def tags(element: ElementTree.Element) -> list[str]:
    """Return what stands in an element, by its tags."""
    return [inner.tag for inner in element.iter()][1:]


@pytest.mark.usefixtures("matplotlib")
def test_a_picture_stands_within_the_page_with_its_title() -> None:
    picture = Traces("how it moves", "t", "q", {"one": ([0.0, 1.0], [2.0, 3.0])})
    [figure] = elements(picture)
    image, caption = figure
    assert (image.get("alt"), caption.text) == ("how it moves", "how it moves")
    kind, _, content = str(image.get("src")).partition(",")
    assert kind == "data:image/svg+xml;base64"
    assert base64.b64decode(content) == drawn_by_matplotlib([picture], "svg")


def test_a_section_in_a_section_has_a_heading_one_level_lower() -> None:
    [outer] = elements(Section("", "outer", [Section("", "inner", [Text("words")])]))
    assert tags(outer) == ["h2", "section", "h3", "p"]


def test_sections_begin_at_the_level_that_is_asked_for() -> None:
    [outer] = elements(Section("", "outer", [Text("words")]), level=4)
    assert tags(outer) == ["h4", "p"]


def test_a_section_without_a_heading_is_what_stands_in_it() -> None:
    assert [each.tag for each in elements(Section("", "", [Text("a"), Code(["b"])]))] == [
        "p",
        "pre",
    ]


def test_a_folded_section_is_opened_by_its_heading() -> None:
    [details] = elements(Section("", "more", [Text("words")], folded=True))
    assert (details.tag, tags(details)) == ("details", ["summary", "p"])
    assert details[0].text == "more"


def test_a_list_is_ordered_or_is_not() -> None:
    first, second = elements(Items(["a", "b"], ordered=True), Items(["c"], ordered=False))
    assert (first.tag, tags(first)) == ("ol", ["li", "li"])
    assert (second.tag, tags(second)) == ("ul", ["li"])


def test_a_verdict_has_its_sign() -> None:
    signs = [str(each.text)[0] for each in elements(Verdict("a", True), Verdict("b", False))]
    assert signs == ["✓", "✗"]


def test_lines_of_code_stand_as_they_are() -> None:
    [code] = elements(Code(["a < b", "  c"]))
    assert str(code[0].text) == "a < b\n  c"


def test_a_heading_is_of_the_third_level() -> None:
    assert [each.tag for each in elements(Heading("a"))] == ["h3"]


def test_the_first_column_of_a_table_names_its_rows() -> None:
    [block] = elements(Table(("", "x"), [("one", "1"), ("two", "2")], title="figures"))
    table = block[0]
    caption, head, body = table
    assert "".join(caption.itertext()) == "figures"
    assert [cell.get("scope") for cell in head[0]] == ["col", "col"]
    assert [[cell.tag for cell in row] for row in body] == [["th", "td"]] * 2
    assert ["".join(cell.itertext()) for row in body for cell in row] == ["one", "1", "two", "2"]
