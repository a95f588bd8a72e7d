"""`freshness`: what a Data says, held against what it would say now."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext
from typing import cast

from ..interface import DERIVED, POSES, Contacts, Data, Model, get_state
from ..measures.readings import readings
from ..measures.text import few, milliseconds
from .age import Age, Scratch, age_of, engine_step, row
from .result import Freshness, Row
from .watch import Watch

_REMEMBERED = {"contacts", "qacc", "qfrc_constraint", "qfrc_contact"}


def freshness(model: Model, data: Data) -> Freshness:
    """Of which moment is each derived array of `data`, and how wrong is it by now?

    It needs no preparation and changes nothing: what the arrays would be now is computed in
    another Data. An array is of now if `forward` would leave every number of it as it is.
    Otherwise it is one step old if its poses are those of qpos − h·qvel; how many writes ago
    only `watch_freshness` can tell.

    Args:
        model: The Model that made `data`.
        data: Read, and not touched.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    state = get_state(model, data)
    watch: Watch | None = getattr(type(data), "_watch", None)
    with nullcontext() if watch is None else watch.aside():
        held = readings(data)
    if watch is not None:
        now, age = watch.now(state), watch.age()
    else:
        scratch = Scratch(model)
        try:
            now = scratch.now(state)
            age = age_of(model, state, held, now, scratch)
        finally:
            scratch.close()
    touching = any(len(cast("Contacts", found["contacts"])) for found in (held, now))
    rows = tuple(row(model, name, held[name], now[name], age) for name in held)
    return Freshness(
        backend=model.backend,
        engine_version=model.engine_version,
        model=model.path.stem,
        time=state.time,
        rows=rows,
        written=age.written,
        notes=tuple(_notes(model, rows, age, touching)),
    )


def _notes(model: Model, rows: tuple[Row, ...], age: Age, touching: bool) -> Iterator[str]:
    behaviours = model.capabilities.behaviours
    stale = [each.name for each in rows if not each.now]
    untold = [name for name in DERIVED if name not in {each.name for each in rows}]
    if untold:
        yield f"This backend does not tell: {', '.join(untold)}."
    if not stale:
        yield "All are of now."
        return
    yield from _how(model, age, not set(POSES).isdisjoint(stale))
    if age.written:
        yield f"Written since: {', '.join(age.written)}."
    if behaviours["stale after a step"].support == "unsupported":
        yield f"After a step: {behaviours['stale after a step'].note}."
    if touching and not model.capabilities.exact_restore and not _REMEMBERED.isdisjoint(stale):
        yield (
            "In contacts, and the forces and accelerations of what touches, not all of the "
            f"difference need be age: {behaviours['exact restore'].note}."
        )
    yield "sm.forward(model, data) makes all of them of now."


def _how(model: Model, age: Age, poses: bool) -> Iterator[str]:
    """How the moment was found, or what stood in the way."""
    if age.retraced:
        exact = f"to {age.within:.1e} m" if age.within else "to the bit"
        yield (
            f"Found by going back: qpos − h·qvel, h = {milliseconds(engine_step(model))}, gives "
            f"the poses of {few(age.retraced)}, {exact}."
        )
        if age.strays:
            yield (
                f"Not so {few(age.strays)}: qpos or qvel was written since, or the engine "
                "integrates otherwise."
            )
    elif not age.never and age.steps is None:
        if poses:
            yield "Going back one step, to qpos − h·qvel, does not lead to these poses."
        yield "Writes are not recorded, unless sm.watch_freshness(model, data) does."
