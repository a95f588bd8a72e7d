"""The documentation: pages by hand, and the path's stations made from runs."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

import statemachine  # noqa: E402

project = "statemachine"
author = "the statemachine maintainers"
copyright = author
release = version = statemachine.__version__
extensions = ["myst_parser"]
myst_enable_extensions = ["colon_fence"]
html_theme = "furo"
html_title = f"statemachine {version}"
html_static_path = ["_static"]
html_css_files = ["cheat-sheet.css"]
html_show_sourcelink = html_copy_source = False  # the sources are generated
smartquotes = False  # --realtime is no dash
exclude_patterns = ["_build"]


def _make_pages(_app) -> None:
    from statemachine.report.site import make_comparisons, make_path, make_reference

    backends = os.environ.get("STATEMACHINE_DOCS_BACKENDS", "").split(",")
    make_path(HERE / "path", [name for name in backends if name] or None)
    make_reference(HERE / "reference")
    make_comparisons(HERE / "comparisons")


def setup(app) -> None:
    """Make the generated pages before the others are read."""
    app.connect("builder-inited", _make_pages)
