"""Which submissions are alike: what counts, what does not, and what is no sign of copying."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import pytest

from statemachine.course.grading import course_code
from statemachine.course.grading.alike import ALIKE, NEARLY_ALIKE, SHORT, compare_submissions
from statemachine.course.grading.judges import JUDGES
from statemachine.course.grading.likeness import StudentCode, code_of_trees, likeness, student_code
from statemachine.course.grading.roster import enrolled
from statemachine.course.grading.submissions import submissions

from .support.class_of_students import COPIES, SIZE, renamed, write_class
from .support.exercises import SOLUTION, TEMPLATE
from .support.files import written, written_all
from .support.own_ways import ANN, BEN, CEM, WAYS
from .support.requirements import ROOT

TEXT = SOLUTION.read_text("utf-8")
ONE = """
import numpy as np
import statemachine as sm


def demo_state(model):
    data = sm.make_data(model)
    total = np.zeros(3)
    for joint in range(model.njnt):
        total += joint * data.qpos[joint]
    return {"a": total}, 6.0
"""
# The same code: `ONE` with something changed that does nothing.
SAME: dict[str, Callable[[str], str]] = {
    "names of variables": lambda text: text.replace("total", "t").replace("joint", "k"),
    "a comment": lambda text: text.replace("    for", "    # each joint\n    for"),
    "a docstring": lambda text: text.replace("(model):\n", '(model):\n    """Mine."""\n'),
    "layout": lambda text: text.replace("return {", "return ({").replace("6.0", "6.0)"),
    "another name for a module": lambda text: text.replace("np", "numpy").replace(
        "import numpy as numpy", "import numpy"
    ),
    "an annotation": lambda text: text.replace("data = ", "data: sm.Data = "),
    "pass": lambda text: text.replace("    return", "    pass\n    return"),
    "another function that nobody calls": lambda text: f"{text}\ndef f(x):\n    return x**2 - 1\n",
    "the name of an argument": lambda text: text.replace("(model)", "(m)").replace("model.", "m."),
}
# Other code: something changed that does something.
OTHER: dict[str, tuple[str, str]] = {
    "a number": ("zeros(3)", "zeros(4)"),
    "an attribute": ("qpos", "qvel"),
    "an operator": ("joint *", "joint +"),
    "a text": ('"a"', '"b"'),
    "which variable": ("total += joint", "total += total"),
    "a function of a library": ("np.zeros", "np.ones"),
    "a line more": ("    return", "    total[0] = 1\n    return"),
}


def _code(text: str) -> StudentCode:
    return code_of_trees([ast.parse(text)])


def _share(left: str, right: str) -> float:
    return likeness(_code(left).all_shingles, _code(right).all_shingles)


@pytest.mark.parametrize("change", SAME)
def test_what_does_nothing_does_not_count(change: str) -> None:
    changed = SAME[change](ONE)
    assert changed != ONE
    assert _share(ONE, changed) == 1


@pytest.mark.parametrize("change", OTHER)
def test_what_does_something_counts(change: str) -> None:
    changed = ONE.replace(*OTHER[change])
    assert changed != ONE
    assert 0.5 < _share(ONE, changed) < 1


def test_likeness_is_the_coefficient_of_dice() -> None:
    assert likeness(frozenset("abcd"), frozenset("cdefgh")) == 2 * 2 / (4 + 6)
    assert likeness(frozenset(), frozenset()) == 0


def test_a_line_more_in_a_copy_of_four_functions_leaves_it_alike() -> None:
    more = TEXT.replace("    slots = {}\n", "    slots = {}\n    unused = 0\n")
    assert ALIKE <= _share(TEXT, more) < 1


@pytest.mark.parametrize(("left", "right"), [*combinations((*WAYS, TEXT), 2)])
def test_right_solutions_of_students_who_work_alone_are_not_alike(left: str, right: str) -> None:
    assert _share(left, right) < 0.3


def test_the_order_of_functions_does_not_count() -> None:
    gravity, rest = BEN.split("def demo_state", 1)
    assert _share(BEN, f"def demo_state{rest}\n{gravity}") == 1


def test_what_is_still_to_be_written_is_no_code() -> None:
    assert student_code([TEMPLATE]).size == 0
    assert _code("def demo_state(model):\n    raise NotImplementedError('later')\n").size == 0


def test_a_file_without_syntax_is_no_code(tmp_path: Path) -> None:
    assert student_code([written(tmp_path / "a.py", "def demo_state(:\n")]).size == 0
    deep = written(tmp_path / "b.py", f"def demo_state(m):\n    return {'(' * 500}1{')' * 500}\n")
    assert student_code([deep]).size == 0


def test_functions_of_another_file_count_where_they_are_called(tmp_path: Path) -> None:
    written_all(tmp_path, {"a.py": "from b import *\n", "b.py": ANN})
    assert student_code([tmp_path / "a.py", tmp_path / "b.py"]) == _code(ANN)


def test_what_is_handed_out_does_not_count(tmp_path: Path) -> None:
    """Two who use the same function that is handed out have nothing in common by that."""
    text = TEMPLATE.read_text("utf-8")
    (todo,) = re.findall(r"def demo_state.*?(    raise NotImpl[^\n]*\n)", text, re.DOTALL)
    bodies = {
        "ann.py": "    demo_hold(model)\n    return model.nq - 7, {'a': 1}\n",
        "bob.py": "    rows = [k**2 for k in demo_hold(model)]\n    return rows, sum(rows)\n",
    }
    for name, body in bodies.items():
        written(tmp_path / name, text.replace(todo, body))
    everything = [student_code([tmp_path / name]).all_shingles for name in bodies]
    assert likeness(*everything) > 0.5  # of both, most is demo_hold
    compared = compare_submissions(submissions([tmp_path]))
    assert (compared.nearest, compared.groups) == ({}, ())


def test_the_course_s_code_is_that_of_the_files() -> None:
    """After a change of the exercise or its solution: python -m tools.course_code."""
    from tools.course_code import digests

    assert course_code.course_code() == digests()


def test_no_text_can_be_read_from_the_course_s_code() -> None:
    file = Path(course_code.__file__).with_name(course_code.FILE)
    for digest_list in json.loads(file.read_text("utf-8")).values():
        assert all(len(digest) == 12 and int(digest, 16) >= 0 for digest in digest_list.split())


def test_twelve_copies_in_a_class_of_41_are_one_group(tmp_path: Path) -> None:
    folder = write_class(tmp_path / "class")
    submitted = submissions([folder])
    assert len(submitted) == SIZE
    (group,) = compare_submissions(submitted).groups
    assert group.students == tuple(f"{number:02}_copy.py" for number in range(1, COPIES + 1))
    assert (group.least, group.most) == (1, 1)
    assert not group.is_short


def test_what_is_like_the_course_s_solution_is_told(tmp_path: Path) -> None:
    texts = {"a.py": TEXT, "b.py": renamed(TEXT, 1), "c.py": CEM, "d.py": renamed(CEM, 2)}
    written_all(tmp_path, texts)
    groups = compare_submissions(submissions([tmp_path])).groups
    assert {group.students: group.is_solution for group in groups} == {
        ("a.py", "b.py"): True,
        ("c.py", "d.py"): False,
    }


def test_what_is_short_is_told(tmp_path: Path) -> None:
    """One function alone is short; the four are not, whoever wrote them."""
    for text in (*WAYS, TEXT):
        code = _code(text)
        assert list(code.shingles) == list(JUDGES)
        assert code.without(course_code.course_code().handed_out).size > SHORT
    for part in _code(TEXT).shingles.values():
        assert len(part) < SHORT
    written_all(tmp_path, {"a.py": ONE, "b.py": SAME["names of variables"](ONE)})
    (group,) = compare_submissions(submissions([tmp_path])).groups
    assert group.is_short


def test_students_are_named_by_the_roster(tmp_path: Path) -> None:
    written_all(tmp_path / "class", {"x_41001.py": CEM, "x_41002.py": renamed(CEM, 1)})
    roster = written(tmp_path / "roster.csv", "name,number\nAnn Lee,41001\nBo Wu,41002\n")
    compared = compare_submissions(enrolled(submissions([tmp_path / "class"]), roster))
    assert compared.groups[0].students == ("Ann Lee", "Bo Wu")
    assert compared.nearest["x_41001.py"].student == "Bo Wu"


def test_a_copy_with_lines_added_in_each_function_is_nearly_alike(tmp_path: Path) -> None:
    """With two that are a group, it is told once, with the nearest of them."""
    copy = re.sub(r"^(    return .*)$", r"    unused = 4 - 3\n\1", TEXT, flags=re.M)
    written_all(tmp_path, {"a.py": TEXT, "b.py": renamed(TEXT, 1), "c.py": copy, "d.py": CEM})
    compared = compare_submissions(submissions([tmp_path]))
    assert [group.students for group in compared.groups] == [("a.py", "b.py")]
    (pair,) = compared.nearly
    assert pair.students == ("a.py", "c.py")
    assert NEARLY_ALIKE <= pair.likeness < ALIKE


def test_a_chain_of_copies_is_one_group(tmp_path: Path) -> None:
    """Each is like the one that it was copied from; the first and the last are less alike."""
    texts = {"a.py": CEM}
    for before, name, old, new in (
        ("a.py", "b.py", "first = recorder.tip()", "first = recorder.tip() + 0"),
        ("b.py", "c.py", "kept[0] = ", "kept[0] = 1 * "),
        ("c.py", "d.py", "data.time = 0.0", "data.time = 0.0 + 0.0"),
        ("d.py", "e.py", "qpos = {}", "qpos = dict(a=1, b=2, c=3, d=4)"),
    ):
        assert old in texts[before]
        texts[name] = texts[before].replace(old, new)
    written_all(tmp_path, texts)
    (group,) = compare_submissions(submissions([tmp_path])).groups
    assert group.students == tuple(texts)
    assert group.least < ALIKE <= group.most < 1


def test_a_copy_that_was_rewritten_is_not_seen() -> None:
    """docs/teaching.md says so: it does the same, line by line, by other means."""
    rewritten = TEXT
    for old, new in (
        ("angles = [math.degrees(data.qpos[place])]", "angles = list()"),
        ("        for _ in range(seconds):\n", "        for second in range(seconds + 1):\n"),
        (
            "            sm.step(model, data, round(1 / model.timestep))\n",
            "            if second:\n"
            "                sm.step(model, data, round(1 / model.timestep))\n",
        ),
        ("slots = {}", "slots = dict()"),
        ("first, second = once(), once()", "first = once()\n    second = once()"),
        (
            "return np.array_equal(first, second), first, second",
            "return bool((first == second).all()), first, second",
        ),
    ):
        assert old in rewritten
        rewritten = rewritten.replace(old, new)
    assert 0.5 < _share(TEXT, rewritten) < ALIKE


def test_the_guide_says_which_thresholds_there_are() -> None:
    guide = (ROOT / "docs" / "teaching.md").read_text("utf-8")
    assert f"{ALIKE:.0%}" in guide
    assert f"{SHORT} shingles" in guide
