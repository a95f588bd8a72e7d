"""Each target of the Makefile installs what its programs import, in a fresh clone."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from .support.project import makefile_text, project_table
from .support.requirements import ROOT

OURS = ("statemachine", "examples", "tests", "tools")
# What an option of our command imports only when it is given, and the extra that brings it.
EXTRA_OF_AN_OPTION = {"--html": "plot"}
# Distributions of modules that may not be installed where this test runs.
DISTRIBUTIONS = {
    "pybullet": {"pybullet", "pybullet-arm64"},
    "pinocchio": {"pin"},
    "motrixsim": {"motrixsim"},
}


@dataclass(frozen=True)
class Target:
    """A rule of the Makefile.

    Attributes:
        name: Of the target.
        needs: Names of the targets that are made before.
        recipe: Its commands, one string a line, continued lines joined.
    """

    name: str
    needs: tuple[str, ...]
    recipe: tuple[str, ...]


def targets_in(makefile: str) -> dict[str, Target]:
    """Read the rules of a Makefile, by the name of the target."""
    text = makefile.replace("\\\n\t", " ")
    found = {}
    for match in re.finditer(r"^([^\s#:=][^:=\n]*):(?!=)([^\n]*)\n((?:\t[^\n]*\n)*)", text, re.M):
        names, needs, recipe = match.groups()
        lines = tuple(line.strip().removeprefix("@") for line in recipe.splitlines())
        for name in names.split():
            found[name] = Target(name, tuple(needs.split()), lines)
    return found


def installed_by(target: str, targets: dict[str, Target]) -> set[str]:
    """Return the distributions that are there once a target is made, lower case.

    These are what the project depends on and what the extras bring that are installed by the
    recipes of the target and of all that it needs.
    """
    distributions: set[str] = set()
    rule = targets[target]
    for need in rule.needs:
        if need in targets:
            distributions |= installed_by(need, targets)
    for line in rule.recipe:
        for extras in re.findall(r"\$\(PIP\).*-e '\.\[([\w,]+)\]'", line):
            distributions |= distributions_of(project_table()["dependencies"])
            for extra in extras.split(","):
                distributions |= distributions_of_extra(extra)
    return distributions


def distributions_of_extra(extra: str) -> set[str]:
    """Return the distributions that an extra brings, those of extras that it names too."""
    return distributions_of(project_table()["optional-dependencies"][extra])


def distributions_of(requirements: list[str]) -> set[str]:
    """Return the names of requirements as they stand in pyproject.toml, lower case."""
    found: set[str] = set()
    for requirement in requirements:
        match = re.match(r"([\w.-]+)(?:\[([\w,-]+)\])?", requirement)
        assert match
        if match[1] == project_table()["name"]:
            for extra in match[2].split(","):
                found |= distributions_of_extra(extra)
        else:
            found.add(match[1].lower())
    return found


def programs_of(rule: Target) -> Iterator[Path]:
    """Yield the files of this checkout that a recipe starts with the environment's Python."""
    for line in rule.recipe:
        for module in re.findall(r"\$\(BIN\)/python -m ([\w.]+)", line):
            program = ROOT.joinpath(*module.split("."), "__main__.py")
            if program.is_file():
                yield program
        for script in re.findall(r"\$\(BIN\)/python ([\w/]+\.py)", line):
            yield ROOT / script


def files_of(program: Path) -> list[Path]:
    """Return the files of a program: it alone, or its package without other programs in it."""
    if program.name != "__main__.py":
        return [program]
    others = [file for file in program.parent.glob("*.py") if file != program]
    return [program, *(file for file in others if not is_program(file))]


def is_program(file: Path) -> bool:
    """Tell whether a file can be run by itself."""
    return 'if __name__ == "__main__"' in file.read_text(encoding="utf-8")


@cache
def imported_by(file: Path, in_functions: bool) -> tuple[str, ...]:
    """Return the full names of what a file imports.

    Args:
        file: Of Python.
        in_functions: Whether imports within functions count.
    """
    names: list[str] = []
    nodes = list(ast.parse(file.read_text(encoding="utf-8")).body)
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            before = ""
            if node.level:
                package = file.relative_to(ROOT).parts[:-1]
                before = ".".join(package[: len(package) - node.level + 1])
            module = ".".join(part for part in (before, node.module) if part)
            names += [f"{module}.{alias.name}" for alias in node.names]
        elif is_for_type_checking(node):
            continue
        elif in_functions or not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            nodes += [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt)]
    return tuple(names)


def is_for_type_checking(node: ast.AST) -> bool:
    """Tell whether a statement is `if TYPE_CHECKING:`."""
    if not isinstance(node, ast.If) or not isinstance(node.test, ast.Name):
        return False
    return node.test.id == "TYPE_CHECKING"


def file_of_module(name: str) -> Path | None:
    """Find the file of a module of this checkout; of a name in a module, the module's."""
    parts = name.split(".")
    while parts:
        path = ROOT.joinpath(*parts)
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if file.is_file():
                return file
        parts.pop()
    return None


def modules_needed_by(program: Path) -> set[str]:
    """Return the top-level modules of others that a program imports.

    In its own files wherever they import something; in those of the package as they are imported.
    """
    own = files_of(program)
    waiting, seen, needed = list(own), set(own), set[str]()
    while waiting:
        file = waiting.pop()
        for name in imported_by(file, in_functions=file in own):
            top = name.partition(".")[0]
            if top not in OURS:
                needed.add(top)
                continue
            module = file_of_module(name)
            if module is not None and module not in seen:
                seen.add(module)
                waiting.append(module)
    return {name for name in needed if name not in sys.stdlib_module_names}


@pytest.fixture(scope="module")
def targets() -> dict[str, Target]:
    """Return the rules of the Makefile by their names."""
    return targets_in(makefile_text())


def test_programs_of_the_makefile_are_found(targets: dict[str, Target]) -> None:
    names = {rule.name for rule in targets.values() if list(programs_of(rule))}
    assert names >= {
        *("bench", "fuzz", "mutate", "reference", "picture", "urdf", "traces", "notebook"),
        *("student-kit", "autograder"),
    }
    assert "gymnasium" in modules_needed_by(ROOT / "tools" / "benchmarks" / "__main__.py")
    assert "coverage" in modules_needed_by(ROOT / "tools" / "mutants" / "__main__.py")


def test_a_target_installs_what_its_programs_import(targets: dict[str, Target]) -> None:
    here = packages_distributions()
    missing: list[tuple[str, str]] = []
    for rule in targets.values():
        for program in programs_of(rule):
            installed = installed_by(rule.name, targets)
            for module in sorted(modules_needed_by(program)):
                names = {name.lower() for name in here.get(module, ())}
                if not DISTRIBUTIONS.get(module, names) & installed:
                    missing.append((rule.name, module))
    assert missing == []


def test_a_target_installs_what_the_options_of_its_command_need(
    targets: dict[str, Target],
) -> None:
    for rule in targets.values():
        for line in rule.recipe:
            for option, extra in EXTRA_OF_AN_OPTION.items():
                if f"{option} " in line and "$(BIN)/statemachine" in line:
                    assert distributions_of_extra(extra) <= installed_by(rule.name, targets)


def test_every_tool_of_a_target_is_installed_by_it(targets: dict[str, Target]) -> None:
    """Programs of the environment, such as ruff, by the names of their distributions."""
    for rule in targets.values():
        tools = set(re.findall(r"\$\(BIN\)/([a-z-]+)", " ".join(rule.recipe)))
        tools |= set(re.findall(r"\$\(BIN\)/python -m ([a-z]+)", " ".join(rule.recipe)))
        installed = installed_by(rule.name, targets) if tools else set()
        for tool in tools - {"python", "pip", "statemachine", "activate", *OURS}:
            distribution = {"lint-imports": "import-linter"}.get(tool, tool)
            assert distribution in installed, f"make {rule.name} does not install {tool}"
