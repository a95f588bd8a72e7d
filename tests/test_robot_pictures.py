"""Every lesson of the path has a picture of the robot, its words, and a command to see it live."""

from __future__ import annotations

import io
import shlex
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine import cli
from statemachine.course import notebook as md
from statemachine.course.lessons import LESSONS, PATH
from statemachine.course.lessons.pictures import PICTURES, with_picture
from statemachine.course.lessons.poses import POSES
from statemachine.course.quiz import Reader
from statemachine.errors import MissingEngineError
from statemachine.lab.questions import film
from statemachine.show import terminal
from statemachine.show.blocks import Page, Printed, Question, Text
from statemachine.show.html.page import Interaction, report
from statemachine.show.pictures import RobotPicture
from tools import docs_pages

from .support.claims import assert_has, assert_in
from .support.rendering import rendering_environment


def test_every_lesson_of_the_path_has_one() -> None:
    assert list(PICTURES) == [lesson.name for lesson in PATH]


@pytest.mark.parametrize("name", PICTURES)
def test_it_is_of_the_lesson_s_model_and_says_what_is_to_be_seen(name: str) -> None:
    picture = PICTURES[name]
    assert picture.model == LESSONS[name].model
    assert len(picture.words) > 40
    solid, ghost = picture.poses()
    assert solid.shape[1] == sm.load(picture.model).nq
    assert ghost is None or ghost.shape == solid.shape
    for command in picture.view.split(" && "):
        program, *words = shlex.split(command)
        assert program == "statemachine"
        assert cli.options_of_words(words).run


def test_the_picture_of_gravity_has_an_arm_that_sinks_and_one_that_is_held() -> None:
    lift = 1  # shoulder_lift in qpos
    limp, held = PICTURES["gravity"].poses()
    assert limp[-1, lift] > 0.4
    assert held is not None
    assert abs(held[:, lift]).max() < 0.001


def test_the_ghost_of_the_picture_of_forward_has_one_joint_elsewhere() -> None:
    solid, ghost = PICTURES["forward"].poses()
    assert ghost is not None
    assert (ghost - solid).tolist() == [[0, 0.8, 0, 0, 0, 0]]


def test_the_picture_of_replay_has_two_runs_of_the_same_bits() -> None:
    one, two = PICTURES["replay"].poses()
    assert two is not None
    assert np.array_equal(one, two)
    assert np.ptp(one[:, 0]) > 0.2


def _picture() -> RobotPicture:
    return RobotPicture(
        "the title",
        "the words",
        "statemachine view",
        "so101/scene",
        lambda: (np.zeros((1, 6)), None),
    )


def test_it_stands_after_what_the_code_printed() -> None:
    question = Question("q", ("a", "b"), 0, "because")
    page = Page("t", "o", [question, Printed({"x": "1"}), Text("rest")])
    kinds = [type(block) for block in with_picture(page, "state").blocks]
    assert kinds == [Question, Printed, RobotPicture, Text]
    opening = with_picture(page, PATH[0].name).blocks  # the path opens with it
    assert [type(block) for block in opening] == [RobotPicture, Question, Printed, Text]
    assert with_picture(page, "questions") is page
    assert with_picture(Page("t", "o"), "state").blocks == []


def test_a_picture_is_drawn_for_each_lesson_s_own_name() -> None:
    assert POSES.keys() == PICTURES.keys()


@pytest.mark.slow
def test_a_picture_above_the_text_repeats_no_text_in_a_notebook() -> None:
    page = Page(
        "t", "o", [_picture(), Text("above"), Question("q", ("a", "b"), 0, "so"), Text("z")]
    )
    shown = md.Shown(page)._repr_markdown_()
    assert_in(shown, "the words", "z")
    assert "above" not in shown  # a cell above has it
    assert "above" in md.opening_text(page)


def test_without_a_renderer_a_page_has_the_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        film, "renderer_here", Mock(side_effect=MissingEngineError("nothing draws"))
    )
    page = Page("t", "o", [_picture()])
    text = docs_pages.write_page(tmp_path, "page", page, "x").read_text()
    assert_in(text, "the words", "*the title* Live: `statemachine view`")
    assert "![" not in text


def test_it_is_a_picture_with_its_words_where_there_is_one() -> None:
    text = md.block_as_markdown(_picture(), lambda _: "file.webp")
    assert text.startswith("![the words](file.webp)")


def test_the_html_page_has_it_or_its_words() -> None:
    page = Page("t", "o", [Text("first"), _picture()])
    drawn = report(page, Interaction(picture=lambda _: "data:image/webp;base64,AAAA"))
    assert '<img src="data:image/webp;base64,AAAA" alt="the words">' in drawn
    without = report(page)
    assert "<img" not in without
    assert_in(without, "<p>the words</p>", "the title", "<code>statemachine view</code>")


def test_a_terminal_says_how_to_look_at_it_to_who_sits_there(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def shown(*blocks: Any, reader: Reader | None = None) -> str:
        terminal.show(Page("t", "o", [*blocks, Text("rest")]), "footer", reader)
        return capsys.readouterr().out

    assert shown(_picture()) == shown()
    said = shown(_picture(), reader=Reader())
    assert said.index("rest") < said.index("statemachine view") < said.index("footer")


@pytest.mark.slow
@pytest.mark.parametrize("name", PICTURES)
def test_it_is_small_and_the_same_each_time(name: str, pillow: Any) -> None:
    rendering_environment()
    content = film.webp(PICTURES[name])
    assert len(content) < 150_000
    assert content == film.webp(PICTURES[name])
    with pillow.open(io.BytesIO(content)) as opened:
        assert_has(opened, size=(480, 360), n_frames=len(PICTURES[name].poses()[0]))
        assert np.asarray(opened.convert("RGB")).std() > 20
