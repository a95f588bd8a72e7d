"""Where a fault is put into what PyBullet's backend makes of a file."""

from __future__ import annotations

from ...backends import pybullet_backend as adapter

__all__ = ["adapter"]
