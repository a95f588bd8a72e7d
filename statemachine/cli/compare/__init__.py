"""`statemachine compare`: where two engines part, by how much, and why.

`options` declares what can be typed, `requests` makes a Request of it, and `answers` shows what
comes of that.
"""

from .answers import run
from .options import add

__all__ = ["add", "run"]
