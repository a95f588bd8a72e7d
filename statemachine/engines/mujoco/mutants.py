"""Where a fault is put into what MuJoCo's backend makes of a file."""

from __future__ import annotations

from ...backends import mujoco_backend as adapter

__all__ = ["adapter"]
