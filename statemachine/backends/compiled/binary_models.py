"""A compiled model of a text, and as the bytes of an MJB file."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from .types import MjModel


def compile_text(text: str) -> MjModel:
    """Return the compiled model of an MJCF text of ours, which names no files."""
    return mujoco.MjModel.from_xml_string(text)


def from_binary(content: bytes) -> MjModel:
    """Return the compiled model in the bytes of an MJB file."""
    return mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": content})


def saved(model: MjModel) -> NDArray[np.uint8]:
    """Return a compiled model in the bytes of an MJB file."""
    blob = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, blob)
    return blob
