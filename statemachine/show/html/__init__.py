"""A page as one self-contained HTML file.

    text = report(page, looks=(look, look))
    write_report("hold.html", text)

Made in Python: words, tables, and curves as SVG, which read without a script. The script, ours
and without a library, draws both runs in WebGL and moves the cursor. No word about what was found
is made here.
"""

from __future__ import annotations

from .page import SUFFIXES, check_target, report, write_report
from .scene import Look

__all__ = ["SUFFIXES", "Look", "check_target", "report", "write_report"]
