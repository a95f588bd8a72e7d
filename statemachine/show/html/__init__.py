"""A page as one self-contained HTML file.

    text = report(page)
    write_report("hold.html", text)

Made in Python: words, tables, and curves as SVG, which read without a script. What moves, and the
script that moves it, come with an `Interaction`. No word about what was found is made here.
"""

from __future__ import annotations

from .page import NOTHING_MOVES, SUFFIXES, Interaction, check_target, report, write_report

__all__ = [
    "NOTHING_MOVES",
    "SUFFIXES",
    "Interaction",
    "check_target",
    "report",
    "write_report",
]
