"""What a target hands back."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Tally:
    """How many inputs were tried, and a line for each that failed."""

    tried: int = 0
    failures: list[str] = field(default_factory=list)
