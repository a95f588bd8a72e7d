"""One list: the differences of two compiled models, with what the descriptions say of each.

The compiled models tell everything that can change a motion, by the list that `..why` explains a
gap with; a description tells the size of a difference and what it does. A figure of a description
is joined to the difference that it is a figure of, and a difference that no description speaks of
gets a row of its own.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...backends import load
from ...engines.records import ModelDifference
from ...errors import StateMachineError
from ...interface import Model
from ...measures.text import few, rounded
from ..matching import Matched, match_models
from ..why.causes import differences_of, sensors_of
from ._told import FLAGS, SETTINGS, SUBJECTS_OF, TOLD, WEIGHTS, WHOLE_LINK
from .ledger import Difference, Value


def one_list(
    described: Sequence[Difference],
    files: Sequence[str | os.PathLike[str]],
    names: Mapping[str, str],
    *,
    complete: bool,
    digits: int,
    reach: float,
) -> tuple[list[Difference], list[str]]:
    """All that two files differ in, each once, and a sentence for what could not be compared.

    Args:
        described: What the descriptions of the two differ in.
        files: The two, as `load` takes them.
        names: Joints, links and frames of the first that go by other names in the second.
        complete: Whether both files say all that a compiled model has, as an MJCF does.
        digits: Figures that agree to so many count as equal.
        reach: How far the robot reaches [m], which distances are set against.
    """
    try:
        one, two = (load(file, defaults="engine") for file in files)
        matched = match_models(one, two, _known(names, one))
        found = differences_of(one, two, matched)
    except StateMachineError as error:
        why = str(error).splitlines()[0]
        return list(described), [f"what only a compiled model tells was not compared: {why}"]
    book = _Joined(described, _Owners(matched, names), complete)
    alone = {each.where for each in found if each.subject == "extra joint"}
    for each in found:
        if book.join(each) or (not complete and _is_described(each)):
            continue
        if each.subject == "extra actuator" and book.owners.of(each) & alone:
            continue  # it goes with the joint
        if not _agrees(each, digits, reach):
            book.add(each)
    if complete:
        book.leave_out_what_follows()
    rows = [*book.rows, *_order(matched), *_keyframes(matched), *_sensors(matched)]
    skipped = [
        f"{each.title}: compared as a whole only, and it differs"
        for each in found
        if each.kind == "model"
    ]
    return rows, skipped


class _Owners:
    """What descriptions call the owner of an element: a link, a joint."""

    def __init__(self, matched: Matched, names: Mapping[str, str]) -> None:
        self._names = names
        one, two = matched.one.compiled, matched.two.compiled
        self._links: dict[str, set[str]] = {}
        self._joints: dict[str, set[str]] = {}
        self._drives: dict[str, set[str]] = {}
        for raw in (one, two):
            for k in range(raw.ngeom):
                head = int(raw.body_weldid[raw.geom_bodyid[k]])
                link = raw.body(head).name or f"body {head}"
                self._links.setdefault(raw.geom(k).name or _unnamed(raw, k), set()).add(link)
            for k in range(raw.njnt):
                carries = int(raw.jnt_bodyid[k])
                body = raw.body(carries).name or f"body {carries}"
                self._joints.setdefault(body, set()).add(raw.joint(k).name)
            for k in range(raw.nactuator):
                joint = int(raw.actuator_trnid[k, 0])
                if raw.actuator_trntype[k] in (0, 1):
                    drive = raw.actuator(k).name or f"actuator {k}"
                    self._drives.setdefault(drive, set()).add(raw.joint(joint).name)

    def of(self, each: ModelDifference) -> set[str]:
        """Names that a row of the difference may go by."""
        where = {each.where}
        if each.kind == "geom":
            where = {w for link in self._links.get(each.where, ()) for w in (link, _at(link, each))}
        elif each.kind == "actuator":
            where |= self._drives.get(each.where, set())
        elif each.kind == "body":
            where |= self._joints.get(each.where, set())
        elif each.kind == "joint" and each.subject == "extra joint":
            where |= {body for body, joints in self._joints.items() if each.where in joints}
        return where | {self._names[name] for name in where if name in self._names}

    def link(self, geom: str) -> set[str]:
        """Links that a geom may be on."""
        return self._links.get(geom, set())


def _at(link: str, each: ModelDifference) -> str:
    return f"{link}: {each.where}"


def _unnamed(raw: Any, geom: int) -> str:
    body = raw.body(int(raw.geom_bodyid[geom])).name
    return f"geom {geom}" + (f" on {body}" if body else "")


class _Joined:
    """Rows of descriptions, each with the differences that it tells of."""

    def __init__(self, rows: Iterable[Difference], owners: _Owners, complete: bool) -> None:
        self.rows, self.owners, self._complete = list(rows), owners, complete

    def join(self, each: ModelDifference) -> bool:
        """Whether rows tell of a difference; they are then called as it is."""
        if each.kind in SETTINGS:
            return self._join_settings(each)
        joined = False
        for told in TOLD.get(each.kind, {}).get(each.subject, ()):
            for k, row in enumerate(self.rows):
                if row.subject != told.subject or (told.figures and row.figure not in told.figures):
                    continue
                if self._is_of(row, each):
                    self._mark(k, each)
                    joined = True
        return joined

    def _is_of(self, row: Difference, each: ModelDifference) -> bool:
        if each.kind == "equality":
            return True  # a description has the linear ones of joints alone
        owners = self.owners.of(each)
        if each.kind == "site":
            return row.where.split(", ")[0] in owners
        if each.kind == "geom" and row.where not in owners:
            # Without a name of their own, or several that have the same friction.
            link, _, shape = row.where.partition(": ")
            return bool(shape) and link in owners and not _is_named(shape, self.owners)
        return row.where in owners

    def _join_settings(self, each: ModelDifference) -> bool:
        """Figure by figure; those that no description has are entered."""
        names = [name for name, _, _ in each.values]
        for k, row in enumerate(self.rows):
            if row.subject == "settings" and row.figure in names:
                self._mark(k, each)
                names.remove(row.figure)
        values = tuple(value for value in each.values if value[0] in names)
        if values and self._complete:
            self.add(replace(each, values=values))
        return True

    def _mark(self, k: int, each: ModelDifference) -> None:
        row = self.rows[k]
        causes = tuple(dict.fromkeys((*row.causes, each.title)))
        self.rows[k] = replace(row, causes=causes, refused=row.refused or each.refused)

    def add(self, each: ModelDifference) -> None:
        """Enter rows of a difference that no description speaks of."""
        told = TOLD.get(each.kind, {}).get(each.subject)
        usual = "settings" if each.kind in SETTINGS else "further"
        subject = told[0].subject if told else SUBJECTS_OF.get((each.kind, each.subject), usual)
        values = each.values or (("", None, None),)
        for name, one, two in values if each.kind in SETTINGS else values[:1]:
            more = f" (+ {len(values) - 1})" if values[1:] and each.kind not in SETTINGS else ""
            where = "" if each.kind in SETTINGS else each.where
            row = _row(subject, where, f"{name}{more}", _value(one), _value(two), each.unit)
            self.rows.append(replace(row, causes=(each.title,), refused=each.refused))

    def leave_out_what_follows(self) -> None:
        """Take out figures that only sum up what other rows tell."""
        self._fold_efforts()
        weighed = any(row.subject == "mass" and row.causes for row in self.rows)
        self.rows = [
            row
            for row in self.rows
            if row.figure not in FLAGS  # each has its row
            and (row.causes or row.subject not in WEIGHTS or not weighed)
        ]
        for row in [row for row in self.rows if _is_of_a_whole_link(row)]:
            others = [
                each
                for each in self.rows
                if each is not row and each.subject == "shapes" and self._link(each) == row.where
            ]
            told = {name for each in others for name in each.causes}
            if told and told.issuperset(row.causes):
                self.rows.remove(row)

    def _link(self, row: Difference) -> str:
        """The link that a row of a shape is on."""
        link = row.where.partition(": ")[0]
        return next(iter(self.owners.link(link)), link)

    def _fold_efforts(self) -> None:
        """What a joint's motors can exert follows from their ranges, gears and gains."""
        for effort in [row for row in self.rows if row.subject == "effort" and not row.causes]:
            for k, row in enumerate(self.rows):
                if row.subject == "drive" and row.where == effort.where and row.causes:
                    values = effort.one, effort.two
                    most = " / ".join(_force(each, effort.unit) for each in values)
                    effect = "; ".join(filter(None, (row.effect, f"at most {most}")))
                    share = max(row.share, effort.share)
                    self.rows[k] = replace(row, effect=effect, share=share)
                    self.rows.remove(effort)
                    break


def _is_of_a_whole_link(row: Difference) -> bool:
    return row.subject == "shapes" and row.figure in WHOLE_LINK


def _is_named(shape: str, owners: _Owners) -> bool:
    return bool(owners.link(shape))


def _force(value: Value, unit: str) -> str:
    return rounded(value, unit) if isinstance(value, float | int) else str(value or "nothing")


def _known(names: Mapping[str, str], one: Model) -> dict[str, str]:
    """The names that a compiled model has, too; a link of a URDF may have gone."""
    here = {*one.joint_names, *one.body_names, *one.site_names, *one.actuator_names}
    return {a: b for a, b in names.items() if a in here}


def _is_described(each: ModelDifference) -> bool:
    """Whether a description without it has said that it is the same, or that it says nothing."""
    figures = {name.partition("[")[0] for name, _, _ in each.values}
    if figures and figures <= {"dampingpoly", "stiffnesspoly", "springyield", "gap"}:
        return False
    return each.kind in SETTINGS or each.subject in TOLD.get(each.kind, ())


def _agrees(each: ModelDifference, digits: int, reach: float) -> bool:
    """Whether all figures of a difference are the same to so many digits."""
    slack = 4 * 0.5 * 10.0 ** (1 - digits)
    if not each.values:
        return False
    for name, *pair in each.values:
        try:
            a, b = (np.asarray(value, dtype=float) for value in pair)
        except (TypeError, ValueError):
            return False
        if a.shape != b.shape or not (np.isfinite(a).all() and np.isfinite(b).all()):
            return False
        scale = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
        if each.unit == "m":
            scale = max(scale, reach)
        if "[rad]" in name:
            scale = math.pi
        if float(np.linalg.norm(a - b)) > slack * scale:
            return False
    return True


def _row(
    subject: str, where: str, figure: str, one: Value, two: Value, unit: str = ""
) -> Difference:
    size = None
    if isinstance(one, float) and isinstance(two, float):
        size = abs(one - two)
    elif isinstance(one, tuple) and isinstance(two, tuple) and len(one) == len(two):
        size = float(np.abs(np.subtract(one, two)).max())
        size = size if math.isfinite(size) else None
    return Difference(subject, where, figure, one, two, unit, size, 0.5)


def _value(value: Any) -> Value:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return tuple(float(each) for each in value)
    return float(value) if isinstance(value, int | float) else str(value)


def _order(matched: Matched) -> Iterator[Difference]:
    """Whether who writes ctrl by number meets other actuators."""
    if matched.reordered:
        names = [few(list(model.actuator_names), 6) for model in (matched.one, matched.two)]
        row = _row("further", "ctrl", "order", names[0], names[1])
        yield replace(row, causes=("order of ctrl",))


def _keyframes(matched: Matched) -> Iterator[Difference]:
    """Keyframes by name, those without one by number."""
    one, two = matched.one, matched.two
    frames = [
        {frame.name or f"number {k}": frame for k, frame in enumerate(model.keyframes)}
        for model in (one, two)
    ]
    for name in dict.fromkeys([*frames[0], *frames[1]]):
        a, b = frames[0].get(name), frames[1].get(name)
        if a is not None and b is not None and a.time != b.time:
            yield _row("further", f"keyframe {name}", "time", a.time, b.time, "s")
        if a is None or b is None:
            words = ("there", "nothing") if b is None else ("nothing", "there")
            yield _row("further", f"keyframe {name}", "", *words)
            continue
        for figure, ours, theirs in (
            ("qpos", matched.qpos(a.qpos, b.qpos), b.qpos),
            ("qvel", matched.qvel(a.qvel, b.qvel), b.qvel),
            ("ctrl", matched.ctrl(a.ctrl, b.ctrl), b.ctrl),
        ):
            off = float(np.abs(ours - theirs).max(initial=0.0))
            if off > 1e-9:
                yield _row("further", f"keyframe {name}", f"{figure}, farthest entry", 0.0, off)


def _sensors(matched: Matched) -> Iterator[Difference]:
    """What only a controller that reads them meets: it changes no motion by itself."""
    found = sensors_of(matched)
    rows = [
        _row("further", f"sensor {each.where}", name, _value(one), _value(two))
        for each in found
        if each.subject in ("sensor", "cutoff")
        for name, one, two in each.values
    ]
    values = [each.values[0] for each in found if each.subject == "extra sensor"]
    if values:
        sides = ([str(each[k]) for each in values if each[k]] for k in (1, 2))
        here, there = (few(names, 6) or "nothing" for names in sides)
        rows.append(_row("further", "sensors", "that only one has", here, there))
    rows += [
        _row("further", "sensordata", "order", one, two)
        for each in found
        if each.subject == "order of sensordata"
        for _, one, two in each.values
    ]
    effect = "only a controller that reads it moves otherwise"
    for row in rows:
        yield replace(row, share=0.0, effect=effect, matters=False)
