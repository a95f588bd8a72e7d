"""Questions to an engine, answered by trying: nothing here is known beforehand.

- `conventions`: what each engine takes for granted; which of its calls does what
- `state_audit`: which parts of a State decide the future
- `calls`: which functions of an engine some lines of code made run
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .state_audit import Audit, audit

__all__ = ["Audit", "audit"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(".state_audit", __name__), name)
