"""A class of 41: what a teacher gets on the evening of the deadline.

Twelve copies of one file with other names and comments, wrong attempts of the kinds that are
known, files that do not run, and right ones.
"""

from __future__ import annotations

import re
from pathlib import Path

from .exercises import SOLUTION, TEMPLATE, WRONG, WRONG_ONES
from .files import written_all
from .own_ways import ANN, BEN, CEM, WAYS

COPIES = 12
SIZE = 41
# What the copies of one file are renamed to, each in a way of its own.
_RENAMED = ("angles", "place", "data", "slots", "kind", "dof", "tips", "tip", "once", "fall")


def _with_lines(text: str, *lines: str) -> str:
    """Return a text with more lines before it."""
    return "\n".join((*lines, text))


_BROKEN = {
    "31_no_import.py": _with_lines(ANN, "import nosuchmodule"),
    "32_endless.py": "def demo_gravity(model, seconds=4):\n    while True:\n        pass\n",
    "33_empty.py": "",
    "34_no_function.py": "import statemachine as sm\n\nprint('hello')\n",
    "35_prints.py": _with_lines(
        CEM, "for number in range(20000):", "    print('step', number, 'of 20000')"
    ),
    "36_return_true.py": "".join(
        f"def demo_{name}(model, *rest):\n    return True\n\n\n" for name in WRONG_ONES
    ),
    "37_template.py": TEMPLATE.read_text("utf-8"),
    "38_syntax.py": "def demo_gravity(model, seconds=4)\n    return 1\n",
    "39_notebook.ipynb": "{}",
}


def renamed(text: str, number: int) -> str:
    """Return a text with other names for variables, and with comments."""
    for name in _RENAMED:
        text = re.sub(rf"\b{name}\b(?!=)(?<!\.{name})", f"{name[0]}{name[-1]}{number}", text)
    text = re.sub(r'    """.*?"""\n', f'    """My answer, attempt {number}."""\n', text)
    return text.replace("return slots", f"# as we saw in lesson {number}\n    return slots")


def _function_of(text: str, name: str) -> str:
    """Return the source of a function."""
    pattern = rf"^def {name}\b.*?(?=^def |^class |^if |\Z)"
    (source,) = re.findall(pattern, text, flags=re.DOTALL | re.MULTILINE)
    return source


def _own(number: int) -> str:
    """Return what a student wrote alone: a way of four for each function, and mistakes."""
    ways = (SOLUTION.read_text("utf-8"), *WAYS)
    text = ""
    for name in ("_lift", "_angle_each_second", "_run"):  # of Ben's
        text += _function_of(BEN, name)
    recorder = CEM.partition("class Recorder")[2].partition("\ndef ")[0]
    text += f"class Recorder{recorder}\n"
    for place, short in enumerate(WRONG_ONES):
        name = f"demo_{short}"
        several = [each for each in WRONG if each.solves == name and not each.raw]
        way = ways[(number + place * (1 + number % 3)) % 4]
        is_common = (number + place) % 5 == 0
        if is_common:
            way = several[0].text
        elif (number + place) % 3 == 0:
            way = several[(7 * number + place) % len(several)].text
        text += _function_of(way, name)
    return _IMPORTS + text


_IMPORTS = """import math

import numpy
import numpy as np
import statemachine as sm
from statemachine import forward, make_data, reset, step
from statemachine.interface import JointType

RAD = 180 / numpy.pi


"""


def write_class(folder: Path) -> Path:
    """Write the submissions of a class into a new folder, and return it."""
    texts: dict[str, str] = {}
    solution = SOLUTION.read_text("utf-8")
    head, _, rest = TEMPLATE.read_text("utf-8").partition("def demo_gravity")
    _, _, tail = rest.partition("def demo_hold")
    body = solution[solution.index("def demo_gravity") : solution.index("if __name__")]
    whole = f"{head}{body}def demo_hold{tail}"
    for number in range(1, COPIES + 1):
        texts[f"{number:02}_copy.py"] = renamed(whole, number)
    for number in range(COPIES + 1, 31):
        texts[f"{number:02}_own.py"] = _own(number)
    texts |= _BROKEN
    texts["40_helper/step_loop.py"] = "from helper import *\n"
    texts["40_helper/helper.py"] = BEN
    texts["41_two/first.py"] = texts["41_two/second.py"] = "def demo_state(model):\n    return 1\n"
    assert len({name.partition("/")[0] for name in texts}) == SIZE
    return written_all(folder, texts)
