"""The three diagrams: true of the model that is loaded, and the same in every medium."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from markdown_it import MarkdownIt

import statemachine as sm
from statemachine.course import notebook
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.diagrams import told_apart
from statemachine.course.lessons.diagrams.joint_slots import joint_slots
from statemachine.course.lessons.diagrams.model_and_data import model_and_data
from statemachine.course.lessons.diagrams.pipeline import pipeline
from statemachine.course.lessons.session import page_of_lesson, take
from statemachine.interface.records import DERIVED
from statemachine.show import terminal
from statemachine.show.as_json import dumps
from statemachine.show.blocks import Page
from statemachine.show.diagrams.canvas import painted
from statemachine.show.diagrams.shapes import Arrow, Box, Bracket, Label, Shape, cut, length_of
from statemachine.show.html.diagram import figure, svg
from statemachine.show.html.page import report
from statemachine.show.pictures import Diagram
from statemachine.show.text_blocks import ASCII

from .support.backends import slow_on
from .support.browser import browser, one_browser
from .support.claims import assert_in
from .support.colours import contrast
from .support.files import written
from .support.small_models import loaded, mjcf, model_of

THREE = (model_and_data, joint_slots, pipeline)
SVG = "{http://www.w3.org/2000/svg}"
HOSTILE = "<script>alert(1)</script>|`*_{{x}}\\" + "W" * 2000
# A ball above a hinge, beside a free body that comes last.
MIXED = (
    "<body><joint name='neck' type='ball'/><geom size='.1'/>"
    "<body pos='0 0 1'><joint name='knee'/><geom size='.1'/><site name='tip'/></body></body>"
    "<body pos='3 0 0'><freejoint name='crate'/><geom size='.1'/></body>"
    "<body pos='6 0 0'><joint name='rail' type='slide'/><geom size='.1'/></body>"
)
MOTOR = "<actuator><motor joint='knee'/></actuator><sensor><jointpos joint='knee'/></sensor>"


def chain(count: int, base: str = "") -> str:
    """Return a chain of bodies, each on a hinge with a long name."""
    bodies = "".join(
        f"<body pos='0 0 .3'><joint name='left_joint_number_{k}'/><geom size='.1'/>"
        for k in range(count)
    )
    return f"<body>{base}<geom size='.1'/>{bodies}{'</body>' * count}</body>"


def free_bodies(count: int, first: int = 0) -> str:
    """Return free bodies in a row."""
    return "".join(
        f"<body pos='{k} 0 0'><freejoint/><geom size='.1'/></body>"
        for k in range(first, first + count)
    )


def quoted(name: str) -> str:
    """Return a name as an attribute of XML has it."""
    return name.replace("&", "&amp;").replace("<", "&lt;").replace("'", "&apos;")


@pytest.fixture
def mixed(tmp_path: Path) -> sm.Model:
    return loaded(tmp_path, MIXED, MOTOR, option="<option timestep='0.003'/>")


def texts(diagram: Diagram) -> list[str]:
    return [shape.text for shape in diagram.shapes if isinstance(shape, Label)]


def in_a_terminal(diagram: Diagram, spelled: Callable[[str], str] = str) -> list[str]:
    """Return the lines of a diagram."""
    rows = painted(diagram.shapes, spelled)
    return ["".join(part.text for part in parts) for parts in rows]


def as_ascii(text: str) -> str:
    return text.translate(ASCII).encode("ascii", "replace").decode()


def boxes(diagram: Diagram) -> list[Box]:
    return [shape for shape in diagram.shapes if isinstance(shape, Box)]


def inside(box: Box, diagram: Diagram) -> str:
    """Return what stands in a box."""
    words: list[str] = [box.title]
    for shape in diagram.shapes:
        if not isinstance(shape, Label):
            continue
        if box.top < shape.row < box.bottom and box.left < shape.column < box.right:
            words.append(shape.text)
    return "\n".join(words)


def titled(title: str, diagram: Diagram) -> Box:
    (box,) = [box for box in boxes(diagram) if box.title.startswith(title)]
    return box


def slots(diagram: Diagram, row: int) -> dict[int, Box]:
    """Return the slots of an array by number: of its boxes the row-th from the top."""
    top = sorted({box.top for box in boxes(diagram)})[row]
    return {int(inside(box, diagram)): box for box in boxes(diagram) if box.top == top}


# What they say.


def test_the_first_counts_what_the_model_has(mixed: sm.Model) -> None:
    raw = mujoco.MjModel.from_xml_path(str(mixed.path))
    diagram = model_and_data(mixed)
    model = inside(titled("Model", diagram), diagram)
    assert_in(model, f"bodies {raw.nbody}", f"joints {raw.njnt}", f"actuators {raw.nu}")
    assert f"timestep {raw.opt.timestep:g} s" in model
    data = inside(titled("Data", diagram), diagram)
    assert_in(data, f"qpos ({raw.nq})", f"qvel ({raw.nv})", f"ctrl ({raw.nu})", "time")
    assert f"{mixed.path.parent.name}/m.xml" in texts(diagram)


def test_the_first_has_step_read_both_and_overwrite_the_data(mixed: sm.Model) -> None:
    diagram = model_and_data(mixed)
    model, data, step = (titled(title, diagram) for title in ("Model", "Data", "step"))
    ends = {
        (_box_at(arrow.places[0], diagram), _box_at(arrow.places[-1], diagram))
        for arrow in diagram.shapes
        if isinstance(arrow, Arrow)
    }
    assert {(model, step), (data, step), (step, data), (model, data)} <= ends
    assert (step, model) not in ends  # it changes no Model
    assert (model, titled("another Data", diagram)) in ends


def _box_at(place: tuple[int, int], diagram: Diagram) -> Box | None:
    """Return the box on whose edge a place is."""
    column, row = place
    for box in boxes(diagram):
        on_a_row = box.left <= column <= box.right and row in (box.top, box.bottom)
        on_a_side = box.top <= row <= box.bottom and column in (box.left, box.right)
        if on_a_row or on_a_side:
            return box
    return None


@pytest.mark.usefixtures("bullet")
def test_where_each_data_has_a_world_of_its_own_that_is_said(tmp_path: Path) -> None:
    model_of(tmp_path, mjcf(MIXED.replace("ball", "hinge")))
    said = []
    for backend in ("mujoco", "pybullet"):
        model = sm.load(tmp_path / "m.xml", backend=backend)
        diagram = model_and_data(model)
        said.append(inside(titled("another Data", diagram), diagram))
        assert model.capabilities.shared_model is ("the same Model" in said[-1])
    assert said[0] != said[1]


def test_the_slots_are_those_of_the_compiled_model(mixed: sm.Model) -> None:
    raw = mujoco.MjModel.from_xml_path(str(mixed.path))
    diagram = joint_slots(mixed)
    of_qpos, of_qvel = slots(diagram, 0), slots(diagram, 1)
    assert list(of_qpos) == list(range(raw.nq))
    assert list(of_qvel) == list(range(raw.nv))
    for joint in range(raw.njnt):
        first = of_qpos[raw.jnt_qposadr[joint]]
        below = of_qvel[raw.jnt_dofadr[joint]]
        assert first.left == below.left  # one stands above the other
        (leader,) = [
            shape
            for shape in diagram.shapes
            if isinstance(shape, Arrow) and first.left < shape.places[-1][0] < first.right
        ]
        name = mujoco.mj_id2name(raw, mujoco.mjtObj.mjOBJ_JOINT, joint)
        (label,) = [text for text in texts(diagram) if text.split()[0] == name]
        at = next(s for s in diagram.shapes if isinstance(s, Label) and s.text == label)
        assert (at.column, at.row) == (leader.places[0][0] + 1, leader.places[0][1])


def test_a_free_joint_has_seven_slots_above_six_and_a_ball_four_above_three(
    mixed: sm.Model,
) -> None:
    diagram = joint_slots(mixed)
    of_qpos, of_qvel = slots(diagram, 0), slots(diagram, 1)
    for joint, lengths in (("crate", (7, 6)), ("neck", (4, 3))):
        start = mixed.jnt_qposadr[mixed.joint_id(joint)]
        left = of_qpos[start].left
        right = of_qpos[start + lengths[0] - 1].right
        counted = [
            sum(left <= box.left and box.right <= right for box in row.values())
            for row in (of_qpos, of_qvel)
        ]
        assert tuple(counted) == lengths
        assert f"≠  {lengths[0]} and {lengths[1]} slots" in texts(diagram)
    assert texts(diagram).count("quaternion") == 2


def test_what_does_not_line_up_is_marked_and_what_does_is_not(mixed: sm.Model) -> None:
    diagram = joint_slots(mixed)
    assert {box.look for box in boxes(diagram)} == {"apart"}  # the ball comes first
    marks = [text[0] for text in texts(diagram) if text[0] in "=≠"]
    assert marks == ["≠"] * mixed.njnt
    arm = joint_slots(sm.load("so101/scene_box"))
    looks = [box.look for box in slots(arm, 0).values()]
    assert looks == ["state"] * 6 + ["apart"] * 7
    assert [text[0] for text in texts(arm) if text[0] in "=≠"] == ["="] * 6 + ["≠"]


@pytest.mark.parametrize("base", ["", "<freejoint name='root'/>"], ids=["fixed", "free"])
def test_sixty_joints_are_folded_and_the_last_slot_is_shown(tmp_path: Path, base: str) -> None:
    model = loaded(tmp_path, chain(60, base))
    diagram = joint_slots(model)
    assert len(in_a_terminal(diagram)) < 40
    assert str(model.nq - 1) in texts(diagram)
    assert str(model.nv - 1) in texts(diagram)
    (between,) = {text for text in texts(diagram) if text.endswith("more")}
    hidden = int(between.split()[0])
    shown = [text for text in texts(diagram) if text.endswith(("hinge", "free"))]
    assert hidden + len(shown) == model.njnt


def test_a_quadruped_is_shown_whole_in_rows(tmp_path: Path) -> None:
    model = loaded(tmp_path, chain(12, "<freejoint name='root'/>"))
    diagram = joint_slots(model)
    for of_array, length in ((0, model.nq), (1, model.nv)):
        first, second = slots(diagram, of_array), slots(diagram, of_array + 2)
        assert [*first, *second] == list(range(length))


def test_many_free_bodies_are_not_all_drawn_and_it_is_said_how_many(tmp_path: Path) -> None:
    hinge = "<body pos='0 9 0'><joint/><geom size='.1'/></body>"
    bodies = [f"{free_bodies(1, first=k)}{hinge.replace('9', str(k))}" for k in range(1, 41)]
    model = loaded(tmp_path, "".join(bodies))
    diagram = joint_slots(model)
    more = [text for text in texts(diagram) if text.endswith("more joints")]
    shown = [text for text in texts(diagram) if text.endswith(("hinge", "free"))]
    assert int(more[0].split()[0]) + len(shown) == model.njnt
    assert len(in_a_terminal(diagram)) < 45


def test_without_joints_there_is_nothing_to_line_up(tmp_path: Path) -> None:
    diagram = joint_slots(loaded(tmp_path, "<geom size='.1'/>"))
    assert texts(diagram) == ["no joints"]
    assert boxes(diagram) == []


def test_the_third_has_what_the_data_has(mixed: sm.Model) -> None:
    raw = mujoco.MjModel.from_xml_path(str(mixed.path))
    diagram = pipeline(mixed)
    stored = inside(titled("stored", diagram), diagram)
    assert_in(stored, f"qpos ({raw.nq})", f"qvel ({raw.nv})", f"ctrl ({raw.nu})", "time")
    derived = inside(titled("derived", diagram), diagram)
    assert_in(derived, "xpos", "site_xpos", "qacc", "contacts")
    assert f"qfrc_* ({sum(name.startswith('qfrc') for name in DERIVED)})" in derived
    assert f"raw.sensordata ({raw.nsensordata})" in derived
    assert "time + 0.003 s" in inside(titled("integrate", diagram), diagram)


def test_further_inputs_of_a_model_are_stored_too(tmp_path: Path) -> None:
    body = "<body name='goal' mocap='true'/>" + MIXED
    muscle = "<actuator><general joint='knee' dyntype='filter' dynprm='1'/></actuator>"
    diagram = pipeline(loaded(tmp_path, body, muscle))
    stored = inside(titled("stored", diagram), diagram)
    assert_in(stored, "act (1)", "mocap_pos (3)", "mocap_quat (4)")
    assert "raw.sensordata" not in inside(titled("derived", diagram), diagram)


def test_a_model_without_sites_has_none_to_read(tmp_path: Path) -> None:
    diagram = pipeline(loaded(tmp_path, MIXED.replace("<site name='tip'/>", "")))
    derived = inside(titled("derived", diagram), diagram)
    assert "xpos" in derived
    assert "site_" not in derived


def test_the_brackets_reach_as_far_as_the_calls(mixed: sm.Model) -> None:
    diagram = pipeline(mixed)
    covered = {}
    for bracket in diagram.shapes:
        if isinstance(bracket, Bracket):
            covered[bracket.name] = [
                box.title.partition(":")[0]
                for box in boxes(diagram)
                if bracket.top <= box.top and box.bottom <= bracket.bottom
            ]
    assert covered == {
        "forward": ["compute", "derived"],
        "step": ["compute", "derived", "integrate"],
    }
    # As the engine does it.
    with sm.make_data(mixed) as data:
        data.qvel[:] = 0.1
        before = data.qpos.copy(), data.qvel.copy(), data.time
        sm.forward(mixed, data)
        assert all(map(np.array_equal, before, (data.qpos, data.qvel, data.time)))
        assert data.xpos.any()
        sm.step(mixed, data)
        assert not any(map(np.array_equal, before, (data.qpos, data.qvel, data.time)))
        assert data.time == mixed.timestep


@pytest.mark.usefixtures("bullet")
def test_what_is_emulated_is_what_the_capabilities_say() -> None:
    for backend, in_part in (("mujoco", False), ("pybullet", True)):
        model = sm.load("so101/scene", backend=backend)
        diagram = pipeline(model)
        said = " ".join(texts(diagram))
        assert ("emulated:" in said) is in_part
        for name, behaviour in model.capabilities.behaviours.items():
            if name in ("position servo", "zeros when fresh", "stale after a write", "armature"):
                assert (name in said) is (behaviour.support == "emulated"), name
                assert (name in diagram.words) is (behaviour.support == "emulated"), name


# How they look.


# What is in the world of a model, and its actuators; how they look is looked at in each.
LOOKS: dict[str, Callable[[], tuple[str, str]]] = {
    "mixed": lambda: (MIXED, MOTOR),
    "sixty": lambda: (chain(60, "<freejoint/>"), ""),
    "free": lambda: (free_bodies(150), ""),
    "static": lambda: ("<geom size='.1'/>", ""),
    "hostile": lambda: (
        f"<body><joint name='{quoted(HOSTILE)}' type='ball'/><geom size='.1'/>"
        "<body><joint name='关节关节关节关节关节关节关节'/><geom size='.1'/></body></body>",
        "",
    ),
}


@pytest.fixture(params=LOOKS)
def drawn(request: pytest.FixtureRequest, tmp_path: Path) -> list[Diagram]:
    """The three diagrams of a model."""
    model = loaded(tmp_path, *LOOKS[request.param]())
    return [draw(model) for draw in THREE]


def test_a_terminal_of_80_columns_is_wide_enough(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        for spelled in (str, as_ascii):
            lines = in_a_terminal(diagram, spelled)
            assert max(map(length_of, lines)) <= 79


def test_frames_are_whole_in_either_alphabet(drawn: Sequence[Diagram]) -> None:
    """The right edge of a box stands where its corner does, whatever is written in it."""
    for diagram in drawn:
        for spelled, upright in ((str, "│╎├┤┼"), (as_ascii, "|:+")):
            lines = in_a_terminal(diagram, spelled)
            for box in boxes(diagram):
                for row in range(box.top + 1, box.bottom):
                    for column in (box.left, box.right):
                        assert _letter_at(lines[row], column) in upright, (row, column)


def _letter_at(line: str, column: int) -> str:
    """Return the letter in a column; some before it take two."""
    at = 0
    for letter in line:
        if at == column:
            return letter
        at += length_of(letter)
    return ""


def test_ascii_is_enough(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        plain = in_a_terminal(diagram, as_ascii)
        assert all(line.isascii() for line in plain)
        assert len(plain) == len(in_a_terminal(diagram))


def test_the_svg_says_what_the_terminal_says(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        tree = ElementTree.fromstring(svg(diagram))
        written = [
            "".join(element.itertext()).replace("\u00a0", " ")
            for element in tree.iter(f"{SVG}text")
        ]
        whole = "\n".join(in_a_terminal(diagram))
        for shape in diagram.shapes:
            if isinstance(shape, Label):
                text = cut(shape.text, shape.room)
                assert text in written
                assert text in whole
        frames = list(tree.iter(f"{SVG}rect"))
        assert len(frames) == len(boxes(diagram))


def test_the_svg_is_read_to_who_cannot_see_it(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        tree = ElementTree.fromstring(svg(diagram))
        assert tree.get("role") == "img"
        title, description = list(tree)[:2]
        assert (title.tag, description.tag) == (f"{SVG}title", f"{SVG}desc")
        assert title.text == diagram.title
        assert description.text == diagram.words
        assert len(diagram.words.split()) > 8


def test_no_name_becomes_an_element(drawn: Sequence[Diagram]) -> None:
    known = {"svg", "title", "desc", "text", "rect", "polyline", "polygon"}
    for diagram in drawn:
        tree = ElementTree.fromstring(svg(diagram))
        assert {element.tag.removeprefix(SVG) for element in tree.iter()} <= known


def test_nothing_lies_outside_of_the_svg(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        tree = ElementTree.fromstring(svg(diagram))
        left, top, width, height = map(float, tree.get("viewBox").split())
        for frame in tree.iter(f"{SVG}rect"):
            x, y, wide, high = (float(frame.get(n, "")) for n in ("x", "y", "width", "height"))
            assert left < x < x + wide < left + width
            assert top < y < y + high < top + height
        for line in (*tree.iter(f"{SVG}polyline"), *tree.iter(f"{SVG}polygon")):
            for point in line.get("points").split():
                x, y = map(float, point.split(","))
                assert left < x < left + width
                assert top < y < top + height


def test_two_renderings_of_one_model_are_the_same(mixed: sm.Model) -> None:
    for draw in THREE:
        assert draw(mixed) == draw(mixed)
        assert svg(draw(mixed)) == svg(draw(mixed))


# In the media.


def test_a_terminal_shows_it_under_its_title(
    mixed: sm.Model, capsys: pytest.CaptureFixture[str]
) -> None:
    diagram = joint_slots(mixed)
    terminal.show(Page("t", "o", [diagram]))
    lines = capsys.readouterr().out.splitlines()
    start = lines.index(diagram.title) + 1
    assert lines[start:][: len(in_a_terminal(diagram))] == in_a_terminal(diagram)


def test_a_terminal_that_is_too_narrow_says_it_in_words(
    mixed: sm.Model, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal, "WIDTH_PIPED", 50)
    diagram = pipeline(mixed)
    terminal.show(Page("t", "o", [diagram]))
    out = capsys.readouterr().out
    assert diagram.words in " ".join(out.split())
    assert not set(out) & set("│┌▼")


def test_markdown_has_it_as_one_block_of_html(drawn: Sequence[Diagram]) -> None:
    for diagram in drawn:
        text = notebook.block_as_markdown(diagram, lambda _: "")
        (token,) = MarkdownIt("commonmark").parse(text)
        assert token.type == "html_block"
        assert token.content == text == figure(diagram)


@pytest.mark.parametrize("name", ["objects", "state", "forward"])
@pytest.mark.parametrize("backend", slow_on("pybullet"), indirect=True)
def test_each_diagram_stands_in_its_lesson_and_in_no_fold(
    name: str, backend: str, tmp_path: Path
) -> None:
    entry = LESSONS[name]
    model = loaded(tmp_path, MIXED.replace("ball", "hinge"), MOTOR, backend=backend)
    options = {"site": "tip", "joint": "knee"} if name == "forward" else {}
    page = page_of_lesson(entry, {backend: take(entry, model, backend, options)})
    (diagram,) = [block for block in page.blocks if isinstance(block, Diagram)]
    assert figure(diagram) in re.sub(
        "<details>.*?</details>", "", notebook.markdown(page, lambda _: ""), flags=re.DOTALL
    )


@pytest.mark.usefixtures("bullet")
def test_engines_of_which_the_same_is_drawn_share_a_diagram(tmp_path: Path) -> None:
    file = written(tmp_path / "m.xml", mjcf(MIXED.replace("ball", "hinge"), MOTOR))
    models = {name: sm.load(file, backend=name) for name in ("mujoco", "pybullet")}
    slots_of = {name: joint_slots(model) for name, model in models.items()}
    assert told_apart(slots_of) == [slots_of["mujoco"]]
    flows = {name: pipeline(model) for name, model in models.items()}
    first, second = told_apart(flows)
    assert first.title == f"mujoco: {flows['mujoco'].title}"
    assert second.shapes == flows["pybullet"].shapes


def test_a_lesson_s_json_has_no_diagram() -> None:
    taken = take(LESSONS["state"], sm.load("so101/scene_box"), "mujoco")
    assert taken.diagram == joint_slots(sm.load("so101/scene_box"))
    assert "shapes" not in dumps(taken.result)


def test_a_page_of_html_has_each_of_them_once(mixed: sm.Model) -> None:
    diagrams = [draw(mixed) for draw in THREE]
    page = report(Page("t", "o", diagrams))
    assert [page.count(figure(diagram)) for diagram in diagrams] == [1, 1, 1]


@pytest.fixture(scope="module")
def page_of_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A page with the diagrams of every model."""
    folder = tmp_path_factory.mktemp("diagrams")
    diagrams: list[Diagram] = []
    for texts in LOOKS.values():
        model = loaded(folder, *texts())
        diagrams += [draw(model) for draw in THREE]
    file = folder / "page.html"
    file.write_text(report(Page("t", "o", diagrams)), encoding="utf-8")
    with one_browser():
        yield file


@pytest.mark.slow
@pytest.mark.parametrize("width", [480, 1200])
def test_a_browser_shows_each_text_whole_and_inside_its_picture(
    page_of_all: Path, width: int
) -> None:
    with browser(width=width) as tab:
        tab.goto(page_of_all.as_uri())
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        elements = tab.page.query_selector_all("figure.diagram svg")
        assert len(elements) == len(LOOKS) * len(THREE)
        for number, places in enumerate(tab.evaluate(_PLACES)):
            frame, *texts = places
            assert texts, number
            for left, right, height in texts:
                assert frame[0] <= left + 1, number
                assert right <= frame[1] + 1, number
                assert height >= 9, number  # pixels
        tab.nothing_wrong()


# Of each picture (left, right, height) of itself and of each of its texts, in pixels.
_PLACES = """
[...document.querySelectorAll('figure.diagram svg')].map(svg =>
    [svg, ...svg.querySelectorAll('text')].map(element => {
        const place = element.getBoundingClientRect();
        return [place.left, place.right, place.height];
    }))
"""


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_browser_shows_texts_in_contrast_to_the_page(page_of_all: Path, scheme: str) -> None:
    with browser(width=1200, color_scheme=scheme) as tab:
        tab.goto(page_of_all.as_uri())
        inks, paper = tab.evaluate(
            "[[...document.querySelectorAll('figure.diagram svg')].map("
            "svg => getComputedStyle(svg.querySelector('text')).fill),"
            " getComputedStyle(document.body).backgroundColor]"
        )
    assert all(contrast(ink, paper) > 7 for ink in inks)


@pytest.mark.slow
def test_texts_of_a_picture_can_be_selected_in_a_browser(page_of_all: Path) -> None:
    with browser(width=1200) as tab:
        tab.goto(page_of_all.as_uri())
        selected = tab.evaluate(
            "[...document.querySelectorAll('svg')].filter("
            "svg => svg.closest('figure.diagram')).map(svg => {"
            " getSelection().selectAllChildren(svg); return getSelection().toString(); })"
        )
    assert sum("Model" in text for text in selected) >= len(LOOKS)


# The painter.


@pytest.mark.parametrize(
    ("shapes", "lines"),
    [
        pytest.param([Box(0, 0, 4, 3)], ["┌──┐", "│  │", "└──┘"], id="box"),
        pytest.param([Box(0, 0, 4, 3, is_rounded=True)], ["╭──╮", "│  │", "╰──╯"], id="round"),
        pytest.param(
            [Box(0, 0, 3, 3), Box(2, 0, 3, 3)], ["┌─┬─┐", "│ │ │", "└─┴─┘"], id="neighbours"
        ),
        pytest.param(
            [Box(0, 0, 3, 2), Box(0, 4, 3, 2), Arrow(((1, 1), (1, 4)))],
            ["┌─┐", "└┬┘", " │", " ▼", "┌─┐", "└─┘"],
            id="down",
        ),
        pytest.param([Arrow(((0, 1), (0, 0), (3, 0)))], ["┌─▶", "│"], id="turn"),
        pytest.param([Bracket(1, 0, 2, "f")], ["─┐", " │ f", "─┘"], id="bracket"),
        pytest.param([Box(0, 0, 4, 3, is_dashed=True)], ["┌╌╌┐", "╎  ╎", "└╌╌┘"], id="dashed"),
        pytest.param([Label("abcdef", 1, 0, 4)], [" abc…"], id="cut"),
        pytest.param([Label("a\nb\x1b", 0, 0, 9)], ["a?b?"], id="control"),
        pytest.param([Label("关x", 0, 0, 9)], ["关x"], id="wide"),
    ],
)
def test_shapes_are_painted(shapes: Sequence[Shape], lines: Sequence[str]) -> None:
    assert in_a_terminal(Diagram("t", "w", shapes)) == list(lines)


def test_an_arrow_leaves_a_box_its_look() -> None:
    box = Box(0, 2, 9, 2, "call", "title")
    (_, _, edge, _) = painted([box, Arrow(((3, 0), (3, 2)), "state")], str)
    assert [part.look for part in edge] == ["call"]


@pytest.mark.parametrize(
    ("text", "room", "expected"),
    [("abc", 3, "abc"), ("abcd", 3, "ab…"), ("关关关", 4, "关…"), ("W" * 2000, 5, "WWWW…")],
)
def test_a_text_is_cut_to_its_room(text: str, room: int, expected: str) -> None:
    assert cut(text, room) == expected
