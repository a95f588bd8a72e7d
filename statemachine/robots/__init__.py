"""Any folder of models: what each does on each engine, in a table.

    models = find(["my_robots"])
    survey = examine_all(models, table=Path("table.csv"))

Each model is examined in a process of its own, so that one that crashes or never ends costs its
row, and not the table.
"""

from __future__ import annotations

from .many import ModelFile, examine_all, find
from .records import BackendRow, ExaminedModel, RunGap, Survey, WitnessRow

__all__ = [
    "BackendRow",
    "ExaminedModel",
    "ModelFile",
    "RunGap",
    "Survey",
    "WitnessRow",
    "examine_all",
    "find",
]
