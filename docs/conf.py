"""The documentation: pages by hand, and the lessons of the path made from runs."""

import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

import rooms  # noqa: E402

import statemachine  # noqa: E402

project = "statemachine"
author = "statemachine contributors"
copyright = author
release = version = statemachine.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
default_role = "code"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 2  # what [a link](models.md#urdf) leads to
html_theme = "furo"
html_title = f"statemachine {version}"
html_static_path = ["_static"]
html_css_files = ["cheat-sheet.css"]
html_show_sourcelink = html_copy_source = False  # the sources are generated
smartquotes = False  # --realtime is not a dash
exclude_patterns = ["_build"]


# Files beside this folder that are pages, too.
PAGES = {
    "../CONTRIBUTING.md": "contributing",
    "../models/so101/README.md": "so101",
    "../models/quadruped/README.md": "quadruped",
}


def _make_pages(_app) -> None:
    from tools.docs_pages import make_comparisons, make_path, make_reference

    backends = os.environ.get("STATEMACHINE_DOCS_BACKENDS", "").split(",")
    make_path(HERE / "path", [name for name in backends if name] or None)
    make_reference(HERE / "reference")
    experiments = os.environ.get("STATEMACHINE_DOCS_COMPARISONS", "hold,gravity,box").split(",")
    make_comparisons(HERE / "comparisons", experiments)
    pages = {"rooms": rooms.table()}
    for path, name in PAGES.items():
        text = (HERE / path).read_text(encoding="utf-8")
        pages[name] = text.replace("](docs/", "](../")
    for name, text in pages.items():
        (HERE / "reference" / f"{name}.md").write_text(text, encoding="utf-8")


def _link(_app, _name: str, source: list[str]) -> None:
    """Let a link to such a file lead to its page."""
    for path, name in PAGES.items():
        source[0] = source[0].replace(f"]({path})", f"](reference/{name}.md)")


def _attributes(_app, _what, _name, _thing, _options, lines: list[str]) -> None:
    """List the attributes of a class, two of which may share a line."""
    inside = False
    for k, line in enumerate(lines):
        if inside and line and not line.startswith("    "):
            inside = False
        if inside and (entry := re.match(r" {4}(\w+(?:, \w+)*): (.*)", line)):
            names = ", ".join(f"``{name}``" for name in entry[1].split(", "))
            lines[k] = f"* {names}: {entry[2]}"
        elif inside and line:
            lines[k] = f"  {line.lstrip()}"
        if line == "Attributes:":
            inside, lines[k] = True, "**Attributes**\n"
    lines[:] = [part for line in lines for part in line.split("\n")]


def setup(app) -> None:
    """Make the generated pages before the others are read."""
    app.connect("autodoc-process-docstring", _attributes, priority=400)  # before napoleon
    app.connect("builder-inited", _make_pages)
    app.connect("source-read", _link)
