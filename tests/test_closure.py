"""What is imported at run time stays small: who reads the core reads that, and nothing else."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from .support.processes import of_python

PRINT_FILES = """
import sys
for name, module in list(sys.modules.items()):
    if name.partition(".")[0] == "statemachine" and getattr(module, "__file__", None):
        print("MODULE", module.__file__)
"""
CORE = """
import statemachine as sm
model = sm.load("so101")
data = sm.make_data(model)
sm.reset(model, data)
sm.step(model, data)
sm.forward(model, data)
state = sm.get_state(model, data)
sm.set_state(model, data, state)
"""
LESSON = "from statemachine.cli import main\nmain(['lesson', 'gravity'])\n"


def _statements(file: Path) -> int:
    """Return how many statements a file has; imports and docstrings are not counted."""
    count = 0
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        is_import = isinstance(node, (ast.Import, ast.ImportFrom))
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if isinstance(node, ast.stmt) and not is_import and not is_text:
            count += 1
    return count


@pytest.mark.parametrize(
    ("code", "most"),
    [
        pytest.param(CORE, 2500, id="the core: load on MuJoCo, and the seven verbs"),
        pytest.param(LESSON, 4500, id="the lesson on gravity"),
    ],
)
def test_no_more_is_imported_than_one_can_read(code: str, most: int) -> None:
    printed = of_python("-c", code + PRINT_FILES, code=0).stdout
    files = [Path(line.partition(" ")[2]) for line in printed.splitlines() if "MODULE" in line]
    counts = {str(file): _statements(file) for file in files}
    assert counts, "no module of the package is found"
    total = sum(counts.values())
    assert total <= most, f"{total} statements in {len(files)} modules: {counts}"
