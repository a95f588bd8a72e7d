"""Lessons, and pages as somebody sees them."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from typing import Any, TypeVar

import pytest

from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.session import take
from statemachine.interface import Model
from statemachine.show import terminal
from statemachine.show.blocks import Page

from .requirements import need_engine

T = TypeVar("T")
# Options with which a lesson of many steps is a short one.
QUICK = {
    "objects": ("--most", "4"),
    "time": ("--steps", "200"),
    "gravity": ("--longer", "0"),
    "replay": ("--steps", "100"),
}


def need_engines_of(lesson: str) -> None:
    """Skip a test of a lesson that computes with Pinocchio or reads parquet where that is not."""
    if lesson == "step":
        need_engine("pinocchio")
    if lesson == "recording":
        for name in ("pyarrow", "scipy"):
            pytest.importorskip(name)


def lesson_result(name: str, model: Model, **options: Any) -> Any:
    """Return the result of a lesson on a Model."""
    return take(LESSONS[name], model, model.backend, options).result


def shown(page: Page) -> str:
    """Return a page as a terminal of 80 columns shows it."""
    with redirect_stdout(io.StringIO()) as said:
        terminal.show(page)
    return said.getvalue()


def blocks(page: Page, kind: type[T]) -> list[T]:
    """Return the blocks of one kind on a page."""
    return [block for block in page.blocks if isinstance(block, kind)]


def with_figures(figures: Any, **others: Any) -> Any:
    """Return figures of which some are others."""
    return type(figures)(**vars(figures) | others)
