"""What the actuators of two compiled models differ in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..records import Edit, ModelDifference
from . import _fields as fields
from ._element_pairs import ElementPairs, switched_off
from ._figures import plain, same
from ._solid import name_of

_DRIVES = {0: "joint", 1: "joint", 3: "tendon", 4: "site", 5: "body"}  # mjtTrn
# Where the law of an actuator's own state is another, these are one thing with it.
_OF_A_LAW = ("gains", "dynamics", "range of its activation", "length range")


class Drives(ElementPairs):
    """Actuators, by their gains, ranges, laws and what they drive."""

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        one, two = self._one, self._two
        actuators = tuple(self._owners())
        for a, b in actuators:
            yield from self._laws(a, b)
            yield from self._delay(a, b)
            name = name_of(one, "actuator", a)
            ours, theirs = self._drive(one, a, True), self._drive(two, b, False)
            if ours != theirs:
                values = (("drives", _words(ours), _words(theirs)),)
                why = "it drives another thing, or in another way"
                yield ModelDifference("transmission", "actuator", name, values, refused=why)
        if one.opt.disableactuator or two.opt.disableactuator:
            yield from self._rows("actuator", fields.GROUP, actuators)
        for a, b in self._pairs.actuators:
            number = int(np.searchsorted(np.cumsum(one.actuator_ctrlnum), a, side="right"))
            name = name_of(one, "actuator", number)
            yield from self._rows("actuator", fields.CONTROL, [(a, b)], name)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in actuators}
            for k in set(range(raw.nactuator)) - matched:
                yield switched_off(side, raw, "actuator", k, _still_actuator(raw, k))

    def _laws(self, a: int, b: int) -> Iterator[ModelDifference]:
        """Rows of an actuator; together, where its own state moves by another law."""
        laws = _law(self._one, a), _law(self._two, b)
        sized = laws[0][1:] == laws[1][1:]
        rows = [row for row in fields.ACTUATOR if sized or row.when != "actuator_dyntype"]
        found = list(self._rows("actuator", rows, [(a, b)]))
        if laws[0] == laws[1]:
            yield from found
            return
        name = name_of(self._one, "actuator", a)
        values = (("dyntype", laws[0][0], laws[1][0]),)
        if not sized:
            why = "its own state has another size"
            yield from found
            yield ModelDifference("law of its state", "actuator", name, values, refused=why)
            return
        of_law = [each for each in found if each.subject in _OF_A_LAW]
        edits: tuple[Edit, ...] = (("actuator_dyntype", (b,), laws[0][0]),)
        edits += tuple(edit for each in of_law for edit in each.edits)
        more = tuple(value for each in of_law for value in each.values)
        yield ModelDifference("law", "actuator", name, values + more, "", edits)
        yield from (each for each in found if each.subject not in _OF_A_LAW)

    def _owners(self) -> Iterator[tuple[int, int]]:
        """Pairs of actuators, from pairs of numbers of ctrl."""
        owner = [
            np.repeat(np.arange(raw.nactuator), raw.actuator_ctrlnum)
            for raw in (self._one, self._two)
        ]
        found = {(int(owner[0][a]), int(owner[1][b])) for a, b in self._pairs.actuators}
        yield from sorted(found)

    def _delay(self, a: int, b: int) -> Iterator[ModelDifference]:
        """A delay needs a memory of commands: without one it is taken away from the other."""
        one, two = self._one, self._two
        for found in self._rows("actuator", fields.DELAY, [(a, b)]):
            if two.actuator_history[b, 0] or not one.actuator_history[a, 0]:
                yield found
                continue
            back: tuple[Edit, ...] = (("actuator_delay", (a,), float(two.actuator_delay[b])),)
            yield replace(found, edits=(), edits_one=back)
        sizes = one.actuator_history[a], two.actuator_history[b]
        if one.actuator_delay[a] and two.actuator_delay[b] and not same(*sizes):
            name = name_of(one, "actuator", a)
            values = (("history", plain(sizes[0]), plain(sizes[1])),)
            why = "it keeps another number of commands, or reads between them in another way"
            yield ModelDifference("memory of commands", "actuator", name, values, refused=why)

    def _drive(self, raw: Any, actuator: int, ours: bool) -> tuple[Any, ...]:
        """What an actuator acts on, in ids of the second model."""
        kind = int(raw.actuator_trntype[actuator])
        target = _DRIVES.get(kind)
        ids = raw.actuator_trnid[actuator].tolist()
        if ours and target is not None:
            ids[0] = self._ids[target].get(ids[0], -1)
            if kind == 4 and ids[1] >= 0:  # with a site that it refers to
                ids[1] = self._ids["site"].get(ids[1], -1)
        elif ours and kind == 2:  # slider and crank are two sites
            ids = [self._ids["site"].get(each, -1) for each in ids]
        return kind, *ids


def _law(raw: Any, k: int) -> tuple[int, ...]:
    """How an actuator's own state moves, how long it is, and which numbers of ctrl it takes."""
    number = int(raw.actuator_ctrlnum[k])
    spec = int(raw.actuator_ctrlspec[k]) if number > 1 else 0  # of one it follows from the gains
    return int(raw.actuator_dyntype[k]), int(raw.actuator_actnum[k]), number, spec


def _still_actuator(raw: Any, k: int) -> tuple[Edit, ...]:
    return (
        ("actuator_gaintype", (k,), 0),
        ("actuator_gainprm", (k,), np.zeros(raw.actuator_gainprm.shape[1])),
        ("actuator_biastype", (k,), 0),
        ("actuator_biasprm", (k,), np.zeros(raw.actuator_biasprm.shape[1])),
        ("actuator_armature", (k,), 0.0),
        ("actuator_damping", (k,), 0.0),
    )


def _words(drive: tuple[Any, ...]) -> str:
    kind = _DRIVES.get(drive[0], f"transmission {drive[0]}")
    return f"{kind} {drive[1]}"
