"""Differences of a pair of rigid parts: what they weigh, and how the mass lies in them."""

from __future__ import annotations

import math

import numpy as np

from ...description.match import Pair
from ...description.records import Inertial
from ...description.tree import Group, GroupTree
from ...interface import Array
from ...rotations import Placement
from .ledger import Ledger

_STILL = "stands still"


def compare(
    book: Ledger, pair: Pair, one: GroupTree, two: GroupTree, reach: float, notes: list[str]
) -> None:
    """Mass, centre of mass and inertia, each as the rigid part's composite."""
    mine, theirs = _seen(pair.one.inertial, pair.align), pair.two.inertial
    worlds = (
        not body.mass and _stands(tree, group)
        for body, tree, group in ((mine, one, pair.one), (theirs, two, pair.two))
    )
    if any(worlds):
        if mine.mass or theirs.mass:
            silent = "right" if mine.mass else "left"
            heavy = max(mine.mass, theirs.mass)
            notes.append(
                f"the {silent} gives its base no mass, the other {heavy:.4g} kg; it stands still"
            )
    else:
        _inertials(book, pair, one, two, mine, theirs, reach)


def _seen(own: Inertial, align: Placement) -> Inertial:
    return Inertial(own.mass, align.of(own.com), align.mat @ own.tensor @ align.mat.T)


def _inertials(
    book: Ledger,
    pair: Pair,
    one: GroupTree,
    two: GroupTree,
    mine: Inertial,
    theirs: Inertial,
    reach: float,
) -> None:
    where = pair.one.name
    still = _stands(one, pair.one) and _stands(two, pair.two)
    load = max(_most(one.load(pair.one.number)), _most(two.load(pair.two.number)))
    hinge = pair.two.joint is not None and pair.two.joint.kind == "hinge"
    size = book.same("mass", where, mine.mass, theirs.mass, "kg", slack=2)
    if size is not None:
        heavy = max(mine.mass, theirs.mass)
        text = _STILL if still else f"{size / heavy:.1%} of it"
        share = 0.0 if still else size / heavy
        book.differ("mass", where, "", mine.mass, theirs.mass, "kg", size, share, text, not still)
    if not mine.mass and not theirs.mass and not mine.tensor.any() and not theirs.tensor.any():
        return
    apart = float(np.linalg.norm(mine.com - theirs.com))
    if apart > 4 * book.tolerance * reach:
        weight = max(mine.mass, theirs.mass) * 9.81 * apart
        share = weight / max(load, weight) if load and hinge else apart / reach
        values = tuple(map(float, mine.com)), tuple(map(float, theirs.com))
        effect = f"up to {weight:.2g} N·m" if hinge else _STILL if still else ""
        share = 0.0 if still else share
        book.differ("centre of mass", where, "", *values, "m", apart, share, effect, not still)
    else:
        book.agree("centre of mass", where, apart, apart / reach, "m")
    _tensors(book, pair, one, two, mine, theirs, not still)


def _stands(tree: GroupTree, group: Group) -> bool:
    """Whether a part is fixed to the world, so that its mass moves nothing."""
    return tree.robot.rooted and group.parent < 0


def _most(value: float) -> float:
    return 0.0 if math.isnan(value) else value


def _tensors(
    book: Ledger,
    pair: Pair,
    one: GroupTree,
    two: GroupTree,
    mine: Inertial,
    theirs: Inertial,
    matters: bool,
) -> None:
    """Their share is that of M_ii, about the axis of the joint that carries them."""
    where, apart = pair.one.name, mine.tensor - theirs.tensor
    size = float(np.abs(np.linalg.eigvalsh(apart)).max())
    moments = [np.linalg.eigvalsh(each.tensor)[::-1] for each in (mine, theirs)]
    most = max(float(moments[0][0]), float(moments[1][0]))
    if not most or size <= 8 * book.tolerance * most:
        book.agree("inertia", where, size, size / most if most else 0.0, "kg m²")
        return
    effect, share = ("", size / most) if matters else (_STILL, 0.0)
    joint = pair.two.joint
    if joint is not None and joint.kind == "hinge":
        whole = max(one.inertia(pair.one.number), two.inertia(pair.two.number))
        if whole > 0:
            share = abs(float(joint.axis @ apart @ joint.axis)) / whole
            effect = f"{share:.2%} of M_ii"
    ours, others = (tuple(map(float, each)) for each in moments)
    book.differ("inertia", where, "moments", ours, others, "kg m²", size, share, effect, matters)
    turned = _between_axes(mine.tensor, theirs.tensor)
    if turned is not None and turned > 8 * book.tolerance * math.pi:
        book.differ("inertia", where, "axes", None, None, "rad", turned, share, "", matters)


def _between_axes(one: Array, two: Array) -> float | None:
    """Smallest rotation [rad] between principal axes; None where two moments are alike."""
    (m, a), (n, b) = np.linalg.eigh(one), np.linalg.eigh(two)
    for moments in (m, n):
        if min(np.diff(moments)) < 0.01 * moments[2]:
            return None
    cosines = np.abs(np.sum(a * b, axis=0))  # an axis has no sense of direction
    # Of the four right-handed ways to lay the axes on each other, the nearest.
    best = math.pi
    turn = a.T @ b
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        for hand in (1, -1):
            trace = hand * float(sum(s * turn[i, i] for i, s in enumerate(signs)))
            best = min(best, math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))
    return best if cosines.min() < 1 else 0.0
