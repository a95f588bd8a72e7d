"""Diagrams letter by letter, and the meshes of a page, by small ones that can be drawn by hand."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from statemachine.course.lessons.diagrams.joint_slots import joint_slots
from statemachine.show.diagrams.canvas import painted
from statemachine.show.diagrams.shapes import (
    Arrow,
    Box,
    Bracket,
    Label,
    Shape,
    box_below,
    clean,
    cut,
    first_column,
    size_of,
)
from statemachine.show.drawing.shapes import Drawing, Part, box, rectangle, terrain
from statemachine.show.html.diagram import svg
from statemachine.show.html.geometry import mesh_of
from statemachine.show.pictures import Diagram

from .support.small_models import loaded


def lines(*shapes: Shape) -> list[str]:
    """Return the lines of a diagram."""
    return ["".join(part.text for part in row) for row in painted(shapes, str)]


DRAWN: dict[str, tuple[list[Shape], list[str]]] = {
    "a box": ([Box(1, 0, 4, 3)], [" ┌──┐", " │  │", " └──┘"]),
    "a title": ([Box(0, 0, 10, 2, title="ab")], ["┌─ ab ───┐", "└────────┘"]),
    "a title that is cut": ([Box(0, 0, 10, 2, title="abcdef")], ["┌─ abc… ─┐", "└────────┘"]),
    "round corners": ([Box(0, 0, 3, 3, is_rounded=True)], ["╭─╮", "│ │", "╰─╯"]),
    "dashed edges": ([Box(0, 0, 4, 3, is_dashed=True)], ["┌╌╌┐", "╎  ╎", "└╌╌┘"]),
    "boxes that touch": (
        [Box(0, 0, 3, 3), Box(2, 0, 3, 3)],
        ["┌─┬─┐", "│ │ │", "└─┴─┘"],
    ),
    "four boxes": (
        [Box(0, 0, 3, 3), Box(2, 0, 3, 3), Box(0, 2, 3, 3), Box(2, 2, 3, 3)],
        ["┌─┬─┐", "│ │ │", "├─┼─┤", "│ │ │", "└─┴─┘"],
    ),
    "a line": ([Arrow(((0, 0), (3, 0)), has_head=False)], ["────"]),
    "a line that turns": (
        [Arrow(((0, 0), (2, 0), (2, 2), (4, 2)), has_head=False)],
        ["──┐", "  │", "  └──"],
    ),
    "an arrow down onto a box": (
        [Box(0, 3, 5, 2), Arrow(((2, 0), (2, 3)))],
        ["  │", "  │", "  ▼", "┌───┐", "└───┘"],
    ),
    "an arrow from a box": (
        [Box(0, 0, 3, 3), Box(6, 0, 3, 3), Arrow(((2, 1), (6, 1)))],
        ["┌─┐   ┌─┐", "│ ├──▶│ │", "└─┘   └─┘"],
    ),
    "an arrow to the left": (
        [Box(0, 0, 3, 3), Box(6, 0, 3, 3), Arrow(((6, 1), (2, 1)))],
        ["┌─┐   ┌─┐", "│ │◀──┤ │", "└─┘   └─┘"],
    ),
    "an arrow up": (
        [Box(0, 0, 3, 2), Arrow(((1, 4), (1, 1)))],
        ["┌─┐", "└─┘", " ▲", " │", " │"],
    ),
    "a bracket": (
        [Bracket(2, 0, 2, "name", "note")],
        [" ─┐", "  │ name", " ─┘ note"],
    ),
    "a label": ([Label("abc", 2, 1, 9)], ["", "  abc"]),
    "a label that is cut": ([Label("abcdef", 0, 0, 4)], ["abc…"]),
    "a label in the middle": ([Label("abc", 3, 0, 9, is_centered=True)], ["  abc"]),
    "a label over a box": ([Box(0, 0, 5, 3), Label("x", 2, 1, 1)], ["┌───┐", "│ x │", "└───┘"]),
    "letters of two columns": ([Label("値x", 0, 0, 9), Label("y", 4, 0, 1)], ["値x y"]),
    "what a terminal would obey": ([Label("a\x1bb\n", 0, 0, 9)], ["a?b?"]),
}


@pytest.mark.parametrize("name", DRAWN)
def test_shapes_are_these_letters(name: str) -> None:
    shapes, drawn = DRAWN[name]
    assert [line.rstrip() for line in lines(*shapes)] == drawn


def test_letters_look_as_their_shape_does() -> None:
    (row,) = painted([Label("ab", 0, 0, 2, "state"), Label("cd", 3, 0, 2, "call")], str)
    assert [(part.text, part.look) for part in row] == [
        ("ab", "state"),
        (" ", "plain"),
        ("cd", "call"),
    ]


@pytest.mark.parametrize(
    ("shape", "size"),
    [
        (Box(2, 3, 4, 5), (6, 8)),
        (Label("abc", 2, 3, 9), (5, 4)),
        (Label("abc", 2, 3, 2), (4, 4)),
        (Label("abcd", 5, 0, 9, is_centered=True), (7, 1)),
        (Arrow(((1, 7), (9, 7), (9, 2))), (10, 8)),
        (Bracket(3, 1, 4, "ab", "abcd"), (9, 5)),
    ],
)
def test_a_shape_takes_so_many_columns_and_rows(shape: Shape, size: tuple[int, int]) -> None:
    assert size_of([shape]) == size


def test_a_box_has_its_edges_and_a_bracket_its_middle() -> None:
    assert (Box(2, 3, 4, 5).right, Box(2, 3, 4, 5).bottom) == (5, 7)
    assert [Bracket(0, 1, bottom, "x").middle for bottom in (4, 5)] == [2, 3]
    assert [first_column(5, length) for length in (1, 2, 3, 4)] == [5, 4, 4, 3]


@pytest.mark.parametrize(
    ("place", "is_on"), [((3, 3), True), ((2, 3), False), ((5, 3), False), ((3, 4), False)]
)
def test_a_place_on_the_upper_edge_of_a_box(place: tuple[int, int], is_on: bool) -> None:
    other, wanted = Box(20, 3, 4, 5), Box(2, 3, 4, 5)
    assert box_below(place, [other, wanted]) == (wanted if is_on else None)


@pytest.mark.parametrize(
    ("text", "room", "shown"),
    [("abc", 3, "abc"), ("abcd", 3, "ab…"), ("値値", 4, "値値"), ("値値値", 4, "値…"), ("", 1, "")],
)
def test_a_text_is_cut_to_its_columns(text: str, room: int, shown: str) -> None:
    assert cut(text, room) == shown
    assert cut(clean("a\tb"), 9) == "a?b"


# As SVG: a column is 8 px wide and a row 20 px high, with a margin of 7 px around all.

SVG = "{http://www.w3.org/2000/svg}"


def elements(*shapes: Shape) -> tuple[ElementTree.Element, list[ElementTree.Element]]:
    """Return a diagram as an element, and what it draws."""
    root = ElementTree.fromstring(svg(Diagram("a title", "in words", shapes)))
    return root, [each for each in root if each.tag not in (f"{SVG}title", f"{SVG}desc")]


def numbers_of(element: ElementTree.Element, *names: str) -> list[float]:
    """Return numbers of an element."""
    return [float(element.get(name, "nan")) for name in names]


def points_of(element: ElementTree.Element) -> list[list[float]]:
    """Return the corners of a line."""
    return [[float(n) for n in point.split(",")] for point in element.get("points", "").split()]


def test_a_diagram_is_as_large_as_its_columns_and_rows() -> None:
    root, _ = elements(Box(1, 2, 4, 5))
    assert root.get("viewBox") == f"-7 -7 {5 * 8 + 14} {7 * 20 + 14}"
    assert f"max-width:{5 * 8 + 14}px" in root.get("style", "")
    assert [root[k].text for k in range(2)] == ["a title", "in words"]


def test_the_frame_of_a_box_goes_through_its_letters() -> None:
    _, (rect,) = elements(Box(1, 2, 4, 5))
    assert numbers_of(rect, "x", "y", "width", "height") == [12, 50, 24, 80]
    assert (rect.get("rx"), rect.get("stroke-dasharray")) == ("2", None)
    _, (other,) = elements(Box(1, 2, 4, 5, is_rounded=True, is_dashed=True))
    assert (other.get("rx"), other.get("stroke-dasharray")) == ("10", "5 4")


def test_a_box_with_a_title_begins_above_it() -> None:
    _, (rect, text) = elements(Box(1, 2, 9, 5, title="name"))
    assert numbers_of(rect, "y", "height") == [2 * 20 - 5, 4.5 * 20 - 35 + 40]
    assert numbers_of(text, "x", "y") == [24, 40 + 10 + 0.35 * 13]
    assert text.text == "name"


@pytest.mark.parametrize(
    ("label", "attributes"),
    [
        (Label("a b", 2, 1, 9), {"x": "16", "text-anchor": None, "textLength": None}),
        (Label("abc", 2, 1, 9, is_centered=True), {"x": "20", "text-anchor": "middle"}),
        (Label("abc", 2, 1, 9, is_code=True), {"textLength": "24"}),
        (Label("abcdef", 2, 1, 4, is_code=True), {"textLength": "32"}),
        (Label("abc", 2, 1, 9, "faint"), {"opacity": "0.75", "font-weight": None}),
        (Label("abc", 2, 1, 9, "state"), {"opacity": None, "font-weight": "700"}),
        (Label("abc", 2, 1, 9), {"opacity": None, "font-weight": None}),
    ],
)
def test_a_text_stands_in_its_column(label: Label, attributes: dict[str, str | None]) -> None:
    _, (text,) = elements(label)
    assert {name: text.get(name) for name in attributes} == attributes
    assert numbers_of(text, "y") == [20 + 10 + 4.55]
    assert text.text == cut(label.text, label.room).replace(" ", "\u00a0")


@pytest.mark.parametrize(
    ("places", "line", "head"),
    [
        (((0, 0), (5, 0)), [[4, 10], [38, 10]], [[44, 10], [38, 13.6], [38, 6.4]]),
        (((5, 0), (0, 0)), [[44, 10], [10, 10]], [[4, 10], [10, 6.4], [10, 13.6]]),
        (((1, 0), (1, 3)), [[12, 10], [12, 64]], [[12, 70], [8.4, 64], [15.6, 64]]),
    ],
)
def test_an_arrow_ends_with_its_head(
    places: tuple[tuple[int, int], ...], line: list[list[float]], head: list[list[float]]
) -> None:
    _, (polyline, polygon) = elements(Arrow(places))
    assert points_of(polyline) == line
    assert points_of(polygon) == [pytest.approx(corner) for corner in head]
    _, (alone,) = elements(Arrow(places, has_head=False))
    assert points_of(alone) == [line[0], head[0]]


def test_an_arrow_ends_on_the_edge_of_a_box() -> None:
    for box_there, edge in ((Box(0, 3, 5, 2), 70), (Box(0, 3, 8, 2, title="a"), 55)):
        *_, line = (
            each for each in elements(box_there, Arrow(((2, 0), (2, 3)), has_head=False))[1]
        )
        assert points_of(line) == [[20, 10], [20, edge]]


def test_a_bracket_embraces_its_rows() -> None:
    _, (line, name, note) = elements(Bracket(4, 1, 4, "name", "note"))
    assert points_of(line) == [[28, 15], [36, 15], [36, 90], [28, 90]]
    assert numbers_of(name, "x", "y") == [48, 2 * 20 + 14.55]
    assert numbers_of(note, "x", "y") == [48, 3 * 20 + 14.55]
    assert len(elements(Bracket(4, 1, 4, "name"))[1]) == 2


# The slots of joints: a free body beside a hinge.

CRATE_AND_HINGE = (
    '<body><freejoint name="crate"/><geom size=".1"/></body>'
    '<body pos="1 0 0"><joint name="j"/><geom size=".1"/></body>'
)


def test_slots_stand_above_each_other(tmp_path: Path) -> None:
    shapes = joint_slots(loaded(tmp_path, CRATE_AND_HINGE)).shapes
    boxes = [shape for shape in shapes if isinstance(shape, Box)]
    # Four columns from slot to slot, the next joint below the longer of the two.
    qpos = [(5 + 4 * k, 2) for k in range(8)]
    qvel = [(5 + 4 * k, 8) for k in (0, 1, 2, 3, 4, 5, 7)]
    assert sorted((each.left, each.top) for each in boxes) == sorted(qpos + qvel)
    assert {(each.width, each.height, each.look) for each in boxes} == {(5, 3, "apart")}


def test_slots_have_their_numbers_and_what_they_are(tmp_path: Path) -> None:
    shapes = joint_slots(loaded(tmp_path, CRATE_AND_HINGE)).shapes
    labels = {(shape.column, shape.row): shape.text for shape in shapes if isinstance(shape, Label)}
    assert [labels[7 + 4 * k, 3] for k in range(8)] == list("01234567")
    assert [labels[7 + 4 * k, 9] for k in (0, 1, 2, 3, 4, 5, 7)] == list("0123456")
    assert (labels[0, 3], labels[0, 9]) == ("qpos", "qvel")
    assert (labels[11, 5], labels[25, 5]) == ("position", "quaternion")
    assert (labels[11, 7], labels[23, 7]) == ("linear", "angular")
    assert (labels[19, 6], labels[35, 6]) == ("≠  7 and 6 slots", "≠")
    assert (labels[9, 0], labels[37, 1]) == ("crate  free", "j  hinge")
    lines_down = [shape.places for shape in shapes if isinstance(shape, Arrow)]
    assert lines_down == [((8, 0), (7, 0), (7, 2)), ((36, 1), (35, 1), (35, 2))]


# Meshes of a page.


def part(body: int, shape: object, endless: bool = False, red: float = 0.12345) -> Part:
    """Return a part of a drawing."""
    vertices, faces = (np.array(getattr(shape, name)) for name in ("vertices", "faces"))
    return Part("mesh", 0, body, vertices, faces, (red, 0.5, 0.25, 1.0), endless)


def drawing(*parts: Part, extent: float = 1.0) -> Drawing:
    """Return a drawing of parts."""
    return Drawing(parts, (0, 0, 0), extent, 90.0, -45.0)


def test_parts_of_a_mesh_follow_each_other() -> None:
    flat, solid = rectangle(1, 2), box((1, 1, 1))
    mesh = mesh_of(drawing(part(3, flat), part(0, flat, endless=True), part(1, solid)))
    first, second = mesh.parts
    assert (first.body, first.first, first.count) == (3, 0, 6)
    assert (second.body, second.first, second.count) == (1, 6, 36)
    assert first.rgb == (0.123, 0.5, 0.25)
    assert (len(mesh.vertices), len(mesh.faces), mesh.simplified) == (12, 14, 0)
    assert mesh.faces[:2].max() == 3
    assert mesh.faces[2:].min() == 4
    assert mesh.vertices[4:].max(axis=0).tolist() == [1, 1, 1]


def grid(count: int) -> Part:
    """Return a square of so many squares along each edge, a metre wide."""
    return part(1, terrain(np.zeros((count + 1, count + 1)), 0.5, 0.5))


@pytest.mark.parametrize(("most", "is_simplified"), [(200, False), (199, True)])
def test_too_many_triangles_are_made_fewer(most: int, is_simplified: bool) -> None:
    mesh = mesh_of(drawing(grid(10)), most)
    assert len(mesh.faces) <= most
    assert mesh.simplified == (200 if is_simplified else 0)
    assert (len(mesh.faces) < 200) is is_simplified
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(1.0, abs=0.2)


def test_without_parts_a_mesh_is_empty() -> None:
    mesh = mesh_of(drawing())
    assert (mesh.vertices.shape, mesh.faces.shape, mesh.parts) == ((0, 3), (0, 3), ())
