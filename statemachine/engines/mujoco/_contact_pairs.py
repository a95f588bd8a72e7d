"""Which pairs of geoms touch by rules of their own, and which bodies never do."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..records import Edit, ModelDifference
from . import _fields as fields
from ._element_pairs import ElementPairs, switched_off

_OFF = -1e3  # [m] a margin at which nothing touches


class ContactPairs(ElementPairs):
    """Explicit pairs and excludes."""

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        one, two = self._one, self._two
        geoms = self._ids["geom"]
        ours = [
            frozenset(geoms.get(int(g), -1) for g in (one.pair_geom1[k], one.pair_geom2[k]))
            for k in range(one.npair)
        ]
        theirs = [
            frozenset((int(two.pair_geom1[k]), int(two.pair_geom2[k]))) for k in range(two.npair)
        ]
        pairs = [(k, theirs.index(each)) for k, each in enumerate(ours) if each in theirs]
        yield from self._rows("pair", fields.PAIR, pairs)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.npair)) - matched:
                yield switched_off(side, raw, "pair", k, _as_geoms(raw, k))
        kept = [
            [frozenset((int(s) >> 16, int(s) & 0xFFFF)) for s in raw.exclude_signature]
            for raw in (one, two)
        ]
        bodies = self._ids["body"]
        kept[0] = [frozenset(bodies.get(b, -1) for b in each) for each in kept[0]]
        for side, raw in enumerate((one, two)):
            for k, each in enumerate(kept[side]):
                if each not in kept[1 - side]:
                    # The world is never apart from itself: an entry without an effect.
                    edits: tuple[Edit, ...] = (("exclude_signature", (k,), 0),)
                    yield switched_off(side, raw, "exclude", k, edits)


def _as_geoms(raw: Any, k: int) -> tuple[Edit, ...]:
    """What makes a pair of its own touch as its two geoms would without it.

    The rules are those of MuJoCo's documentation, "Computation", "Contact parameters".
    """
    g, h = int(raw.pair_geom1[k]), int(raw.pair_geom2[k])
    if not _would_touch(raw, g, h):
        return (("pair_margin", (k,), _OFF),)
    first, second = (g, h) if raw.geom_priority[g] >= raw.geom_priority[h] else (h, g)
    weights = raw.geom_solmix[[first, second]].clip(1e-15)
    mix = float(weights[0] / weights.sum())
    dim, slide = int(raw.geom_condim[first]), raw.geom_friction[first]
    if raw.geom_priority[first] > raw.geom_priority[second]:
        mix = 1.0
    else:
        dim = max(dim, int(raw.geom_condim[second]))
        slide = np.maximum(slide, raw.geom_friction[second])
    refs = raw.geom_solref[[first, second]]
    mixed = mix * refs[0] + (1 - mix) * refs[1] if (refs[:, 0] > 0).all() else refs.min(axis=0)
    imps = raw.geom_solimp[[first, second]]
    return (
        ("pair_dim", (k,), dim),
        ("pair_friction", (k,), slide[[0, 0, 1, 2, 2]]),
        ("pair_solref", (k,), refs[0] if mix == 1.0 else mixed),
        ("pair_solreffriction", (k,), np.zeros(2)),
        ("pair_solimp", (k,), mix * imps[0] + (1 - mix) * imps[1]),
        ("pair_margin", (k,), raw.geom_margin[[g, h]].max()),
        ("pair_gap", (k,), raw.geom_gap[[g, h]].max()),
    )


def _would_touch(raw: Any, g: int, h: int) -> bool:
    """Whether two geoms would touch without a pair of their own."""
    masks = raw.geom_contype[[g, h]] & raw.geom_conaffinity[[h, g]]
    one, two = (int(raw.body_weldid[raw.geom_bodyid[each]]) for each in (g, h))
    above = [int(raw.body_weldid[raw.body_parentid[each]]) for each in (one, two)]
    filtered = one and two and (above[0] == two or above[1] == one)
    return bool(masks.any() and one != two and not filtered)
