"""What the import of a side's file made of its figures, as a run of the installed MuJoCo."""

from __future__ import annotations

import numpy as np

from ...backends import load_to_run, on_default
from ...engines import raw_engine_of
from ...errors import BadInputError, StateMachineError, UnsupportedError
from ...interface import Model
from ...release_names import engine_of


def reader_of(model: Model) -> str:
    """Return what reads the file of a Model, with its version: "mujoco 4.0.0"."""
    return raw_engine_of(engine_of(model.backend)).reader(model)


def are_compiled_as_read(model: Model) -> bool:
    """Tell whether the compiled model of a Model has the figures that its reader made of the file.

    Of other figures the causes of a gap, which are of compiled models, tell nothing.
    """
    try:
        figures = raw_engine_of(engine_of(model.backend)).figures_as_read(model)
    except StateMachineError:
        return False
    return figures is not None and figures is model.compiled


def with_imported_figures(model: Model, other: Model) -> Model:
    """Return the installed MuJoCo with the figures that the import of a side's file made.

    An option that the side was given and the other was not is no figure of the file: it is left
    out.

    Args:
        model: The side.
        other: The other side.

    Raises:
        UnsupportedError: The reader does not tell its figures, or parts were put into the file.
        StateMachineError: The installed MuJoCo cannot run them.
    """
    as_set = _set_as(model, other)
    figures = raw_engine_of(engine_of(model.backend)).figures_as_read(as_set)
    if figures is None:
        raise UnsupportedError(
            f"{reader_of(model)} does not tell the figures that it read",
            backend=model.backend,
            feature="compiled",
            reason="it has no compiled model",
        )
    installed = on_default(model)
    if as_set.substeps > 1:
        installed = installed.replace(substeps=as_set.substeps)
    return installed.with_compiled(figures)


def _set_as(model: Model, other: Model) -> Model:
    """Return a Model with the options that another one was given instead of its own."""
    if have_same_options(model, other):
        return model
    read = model.read_options
    try:
        loaded = load_to_run(
            model.path,
            model.backend,
            defaults=model.defaults,
            balance_inertia=read.balance_inertia,
            meshes=read.meshes,
            base=read.base if read.start is None else read.start,
            **other.options,
        )
    except BadInputError as error:  # such as numbers of other joints
        raise UnsupportedError(
            f"{model.path.name} does not take the options of the other side: {error}",
            backend=model.backend,
            feature="figures of a file",
            reason="options of the other side",
        ) from error
    if (loaded.ngeom, loaded.nu) != (model.ngeom, model.nu):
        raise UnsupportedError(
            f"{model.path.name} was given parts of the other file, and options of its own",
            backend=model.backend,
            feature="figures of a file",
            reason="parts that it was given are not in it",
        )
    return loaded


def have_same_options(model: Model, other: Model) -> bool:
    """Tell whether two Models were given the same options."""
    ours, theirs = model.options, other.options
    if ours.keys() != theirs.keys():
        return False
    return all(np.array_equal(value, theirs[name]) for name, value in ours.items())
