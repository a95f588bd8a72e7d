"""Questions to an engine, answered by trying: nothing here is known beforehand.

- `conventions`: what each engine takes for granted; which of its calls does what
- `audit`: which parts of a State decide the future
- `calls`: which functions of an engine some lines of code made run
"""

from .audit import Audit, audit

__all__ = ["Audit", "audit"]
