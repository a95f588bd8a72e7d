"""A misspelled field is reported before anything runs: of code by pyright, of templates by us."""

from __future__ import annotations

import ast
import json
import random
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from jinja2 import nodes

from statemachine.show.check_templates import faults_of, members_of
from statemachine.show.templates import environment
from tools.check_templates import contents

from .support.requirements import ROOT

SEED = 46
ROOMS = ("cli", "course", "lab", "view")
WRONG = "zq"  # what a misspelled name ends with


@dataclass(frozen=True)
class Read:
    """Read of a field: file, line from 1, the column after the name from 0, and the name."""

    file: Path
    line: int
    column: int
    name: str


def fields_of_results() -> set[str]:
    """Return names of the fields and properties of dataclasses, which no builtin type has."""
    names: set[str] = set()
    for path in (ROOT / "statemachine").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef) and "dataclass" in ast.dump(node)[:4000]:
                names |= {
                    part.target.id
                    for part in node.body
                    if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
                }
    known = {name for kind in (str, dict, list, tuple, Path, float) for name in dir(kind)}
    return {name for name in names if not name.startswith("_")} - known


def reads() -> Iterator[Read]:
    """Return the reads of such fields in the rooms of questions; what argparse has is untyped."""
    names = fields_of_results()
    for room in ROOMS:
        for path in sorted((ROOT / "statemachine" / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if not isinstance(node, ast.Attribute) or not isinstance(node.ctx, ast.Load):
                    continue
                is_of_argparse = isinstance(node.value, ast.Name) and node.value.id == "options"
                if node.attr in names and not is_of_argparse:
                    line, column = node.end_lineno or 0, node.end_col_offset or 0
                    yield Read(path, line, column, node.attr)


def plant(places: list[Read], copy: Path) -> None:
    """Misspell each of these reads in a copy of the package."""
    by_file: dict[Path, list[Read]] = defaultdict(list)
    for place in places:
        by_file[copy / place.file.relative_to(ROOT)].append(place)
    for path, those in by_file.items():
        lines = [line.encode() for line in path.read_text("utf-8").splitlines()]
        for place in sorted(those, key=lambda place: -place.column):
            line = lines[place.line - 1]
            lines[place.line - 1] = line[: place.column] + WRONG.encode() + line[place.column :]
        path.write_bytes(b"\n".join(lines) + b"\n")


def reported(copy: Path) -> set[tuple[str, str]]:
    """Return file and text of each error of pyright in a copy."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pyright",
            "--outputjson",
            "--pythonpath",
            sys.executable,
            "-p",
            copy,
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    errors = json.loads(done.stdout)["generalDiagnostics"]
    return {
        (str(Path(error["file"]).relative_to(copy)), error["message"].split("\n")[0])
        for error in errors
        if error["severity"] == "error"
    }


def unreported(places: list[Read], copy: Path) -> list[Read]:
    """Return those of some reads whose misspelling nothing reports."""
    shutil.copytree(ROOT / "statemachine", copy / "statemachine")
    shutil.copytree(ROOT / "typings", copy / "typings")
    shutil.copy(ROOT / "pyproject.toml", copy)
    text = (copy / "pyproject.toml").read_text("utf-8")
    kept, _, rest = text.partition("\n[tool.pyright]\n")
    # The files with misspelled reads; what they import is read as far as they use it.
    checked = sorted({place.file.relative_to(ROOT).as_posix() for place in places})
    own = f'\n[tool.pyright]\ninclude = {json.dumps(checked)}\nstubPath = "typings"\n'
    own += 'typeCheckingMode = "standard"\nreportMissingImports = false\n'
    own += "reportMissingModuleSource = false\n"
    (copy / "pyproject.toml").write_text(kept + own, "utf-8")
    assert "pythonVersion" in rest
    plant(places, copy)
    errors = reported(copy)
    missed: list[Read] = []
    for place in places:
        file = str(place.file.relative_to(ROOT))
        if not any(f"{place.name}{WRONG}" in text for path, text in errors if path == file):
            missed.append(place)
    return missed


@pytest.mark.slow
def test_a_misspelled_field_is_an_error_of_types(tmp_path: Path) -> None:
    places = random.Random(SEED).sample(sorted(reads(), key=str), 7)
    assert unreported(places, tmp_path) == []


def test_a_misspelled_field_of_a_template_is_reported() -> None:
    drawn = random.Random(SEED)
    for content in drawn.sample(sorted(contents(), key=lambda kind: kind.template), 3):
        jinja = environment(content.__module__)
        assert jinja.loader is not None
        source = jinja.loader.get_source(jinja, content.template)[0]
        named = [node.name for node in jinja.parse(source).find_all(nodes.Name)]
        named += [node.attr for node in jinja.parse(source).find_all(nodes.Getattr)]
        name = drawn.choice(sorted(set(named) & {*members_of(content)} or {*named}))
        wrong = source.replace(name, f"{name}{WRONG}")
        assert any(f"{name}{WRONG}" in fault.text for fault in faults_of(content, wrong))
