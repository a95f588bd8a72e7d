"""The report of a comparison as one self-contained page.

    text = report(comparison, one, two, looks=(look, look))
    write_report("hold.html", text)

Made in Python: the finding in words, tables, and curves as SVG, which read without a script.
The script, ours and without a library, draws both runs in WebGL and moves the cursor.
"""

from __future__ import annotations

from .page import report
from .scene import SideDrawing
from .writing import SUFFIXES, check_target, write_report

__all__ = ["SUFFIXES", "SideDrawing", "check_target", "report", "write_report"]
