"""Hold the project to size.toml: `python -m reference.size`, and `--lower` after it has shrunk."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from .cases import ROOT

_FILE = ROOT / "size.toml"
_OTHERS = ("tests", "benchmarks", "fuzz", "docs", "teaching", "models", "reference", "mutants")
_CONDITIONAL = re.compile(r"\{%-?\s*(?:el)?if\b|<!--\s*if\b")


def statements(tree: ast.AST) -> int:
    """Without imports and docstrings: squeezing text or formatting gains nothing."""
    return sum(
        isinstance(node, ast.stmt)
        and not isinstance(node, ast.Import | ast.ImportFrom)
        and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        for node in ast.walk(tree)
    )


def _trees(files: Iterable[Path]) -> list[ast.AST]:
    return [ast.parse(file.read_text("utf-8")) for file in files if "_build" not in file.parts]


def counts(root: Path = ROOT) -> dict[str, int]:
    """What is limited, by the keys of size.toml."""
    package = root / "statemachine"
    found: Counter[str] = Counter()
    for file in package.rglob("*.py"):
        (tree,) = _trees([file])
        nodes = sum(1 for _ in ast.walk(tree))
        inside = file.relative_to(package).parts
        for place in ("package", inside[0] if len(inside) > 1 else "files at the top"):
            found[f"{place}.statements"] += statements(tree)
            found[f"{place}.nodes"] += nodes
    for folder in _OTHERS:
        files = (root / folder).rglob("*.py")
        found[f"outside.{folder}"] = sum(map(statements, _trees(files)))
    for file in package.rglob("*.*"):
        if file.suffix in {".js", ".css", ".html"}:
            found[f"lines.{file.suffix[1:]}"] += len(file.read_text("utf-8").splitlines())
        if file.suffix in {".html", ".md", ".txt", ".jinja"}:
            asked = _CONDITIONAL.findall(file.read_text("utf-8"))
            found["templates.conditionals"] += len(asked)
    return dict(found)


def beyond(found: dict[str, int], limits: dict[str, dict[str, dict[str, int]]]) -> list[str]:
    """A line for what is larger than its limit, and for what has none."""
    allowed = {
        f"{room}.{what}": row["limit"]
        for room, rows in limits.items()
        for what, row in rows.items()
    }
    return [
        f"size.toml: {key} is {count}, and the limit {allowed.get(key, 0)}"
        for key, count in sorted(found.items())
        if count > allowed.get(key, 0)
    ]


def lowered(text: str, found: dict[str, int]) -> str:
    """The text of size.toml with the limits that are too high set to what is there."""
    room = ""
    lines = []
    for line in text.splitlines():
        room = line.strip("[]") if line.startswith("[") else room
        if match := re.match(r"(\w+) = \{ limit = (\d+)", line):
            count = min(int(match[2]), found.get(f"{room}.{match[1]}".replace('"', ""), 0))
            line = line.replace(f"limit = {match[2]}", f"limit = {count}", 1)  # noqa: PLW2901
        lines.append(line)
    return "\n".join(lines) + "\n"


def main() -> int:
    """Print what is beyond its limit; exit code 1 if anything is."""
    found, text = counts(), _FILE.read_text("utf-8")
    if "--lower" in sys.argv:
        _FILE.write_text(lowered(text, found), "utf-8")
        return 0
    lines = beyond(found, tomllib.loads(text))
    print("\n".join(lines), end="\n" if lines else "")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main())
