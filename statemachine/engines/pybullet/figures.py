"""The figures of a file as it is read: by MuJoCo behind the contract, else by PyBullet."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from ...backends import on_default
from ...backends.compiled.stages import set_constants
from ...installed import DEFAULT, engine_version
from ...interface import Model
from .dials import weighed_by_the_engine

if TYPE_CHECKING:
    from ...backends.compiled.types import MjModel
    from ...backends.pybullet_backend import PybulletModel


def reader(model: Model) -> str:
    """Return what reads the file of a Model, with its version."""
    if model.defaults == "model":
        return f"{DEFAULT} {engine_version(DEFAULT)}"
    return f"{model.backend} {model.engine_version}"


def figures_as_read(model: Model) -> MjModel:
    """Return the figures that the reader of a Model's file made of it.

    PyBullet as it comes has masses and inertias of its own. Gravity and timestep of its fresh
    worlds are of no file: they are those that MuJoCo finds in it, unless they were set.

    Raises:
        ModelError: MuJoCo cannot read the file.
    """
    if model.defaults == "model":
        return model.compiled
    figures = weighed_by_the_engine(cast("PybulletModel", model), model.compiled)
    of_file = on_default(model)
    if "gravity" not in model.options:
        figures.opt.gravity[:] = of_file.gravity
    if "timestep" not in model.options:
        figures.opt.timestep = of_file.timestep / model.substeps
    set_constants(figures)
    return figures
