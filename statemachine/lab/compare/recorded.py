"""What recorded runs were made of, so that their models can be run again."""

from __future__ import annotations

from contextlib import suppress

from ...backends import load
from ...errors import StateMachineError
from ...interface import Model
from ...models import AnyPath
from ..recordings import Header, model_file


def recorded_model(header: Header, menagerie: AnyPath | None = None) -> Model | None:
    """Return the model that a trace was recorded of; None where its file is not here.

    Args:
        header: Of the trace.
        menagerie: A menagerie folder to look its name up in.
    """
    with suppress(StateMachineError):
        file, is_the_same = model_file(header, menagerie)
        if is_the_same:
            return load(file)
    return None
