"""What two sides are called, and what makes a comparison less than one of two engines.

They are called by what tells them apart: the engine first, then file and options.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..measures import SAME, Common
from ..measures.text import few, milliseconds, numbers, significant
from ..runs import Header, Trace
from .series import joint_columns, tell

Two = tuple[str, str]
# Columns that are compared, and what a page calls them.
_COMPARED = {
    "site_xpos": "fingertip",
    "site_xmat": "fingertip",
    "energy": "energy",
    "contact_row": "contacts",
    "contact_force": "contact forces",
}


class Labels(NamedTuple):
    """Names of two sides; those of one kind are never the same.

    Attributes:
        long: For headings; engine and version where these differ.
        short: For tables and sentences.
    """

    long: Two
    short: Two


def labels_of(left: Header, right: Header) -> Labels:
    """The names of two runs."""
    engines = left.label, right.label
    others = list(_apart(left, right))
    backends = left.backend, right.backend
    own = [", engine defaults" * (header.defaults == "engine") for header in (left, right)]
    ways = backends[0] + own[0], backends[1] + own[1]
    # The first by which they differ.
    short = next(
        (right for right in (backends, ways, *others, engines) if right[0] != right[1]), ways
    )
    parts = [*([engines] if engines[0] != engines[1] or not others else []), *others]
    long = ", ".join(part[0] for part in parts), ", ".join(part[1] for part in parts)
    return Labels(numbered(long), numbered(short))


def lacking(only: Sequence[Mapping[str, Sequence[str]]], labels: Two) -> Iterator[str]:
    """A line for a side that has what the other has not: names by kind, as in `Matched.only`."""
    for own, label in zip(only, labels, strict=True):
        parts = [
            # Where the other side has some over, too, they may be the same.
            f"{kind}{'s' * (len(names) > 1)} {few(names, 6)}"
            + " (--map LEFT=RIGHT)" * all(side.get(kind) for side in only)
            for kind, names in own.items()
            if names
        ]
        if parts:
            yield f"only {label} has {'; '.join(parts)}: not compared"


def files_apart(left: Sequence[str], right: Sequence[str]) -> Two:
    """The shortest ends of two paths, given by their parts, that are not the same."""
    counts = range(1, max(len(left), len(right)) + 1)
    differing = (count for count in counts if left[-count:] != right[-count:])
    count = next(differing, 1)
    return "/".join(left[-count:]), "/".join(right[-count:])


def options_apart(left: Mapping[str, Any], right: Mapping[str, Any]) -> Two:
    """The options that differ, as they are typed; what a side does not say is of its file."""
    differing = [
        name
        for name in dict.fromkeys([*left, *right])
        if typed_option(name, left.get(name)) != typed_option(name, right.get(name))
    ]
    texts = [
        ", ".join(
            typed_option(name, options[name]) if name in options else f"{name} of the file"
            for name in differing
        )
        for options in (left, right)
    ]
    return texts[0], texts[1]


def typed_option(name: str, value: Any) -> str:
    """An option as one types it: "timestep=0.002", "contacts=off", "gravity=0,0,-9.8"."""
    match value:
        case bool():
            return f"{name}={'on' if value else 'off'}"
        case str() | None:
            return f"{name}={value}"
    return f"{name}={','.join(f'{number:.15g}' for number in np.atleast_1d(value))}"


def _apart(left: Header, right: Header) -> Iterator[Two]:
    """What differs besides the engine, the weightiest first."""
    a, b = left.provenance, right.provenance
    if a.model_file != b.model_file:
        yield files_apart(a.model_file.split("/"), b.model_file.split("/"))
    elif a.model_sha256 != b.model_sha256:
        last = a.model_file.split("/")[-1]
        yield f"{last} ({a.model_sha256[:8]})", f"{last} ({b.model_sha256[:8]})"
    options = options_apart(*(_with_known(*pair) for pair in ((left, right), (right, left))))
    if options[0] != options[1]:
        yield options
    if left.backend != right.backend or left.label != right.label:
        return
    for name, values in (
        ("", (left.experiment, right.experiment)),
        ("from ", (left.keyframe or "the default state", right.keyframe or "the default state")),
        ("seed ", (a.seed, b.seed)),
    ):
        if values[0] != values[1]:
            yield f"{name}{values[0]}", f"{name}{values[1]}"


def _with_known(header: Header, other: Header) -> dict[str, Any]:
    """The options of a run, and what it has where only the other one says an option."""
    known = {
        "timestep": header.timestep,
        "substeps": header.substeps,
        "gravity": list(header.gravity),
    }
    missing = [name for name in known if name in other.options and name not in header.options]
    return {**header.options, **{name: known[name] for name in missing}}


def numbered(names: Two) -> Two:
    """Two that are alike, with their places."""
    return names if names[0] != names[1] else (f"{names[0]} (first)", f"{names[1]} (second)")


# A line, and whether it is to be said.
Note = tuple[object, str]


def notes_on(left: Trace, right: Trace, common: Common, of_quantities: Iterable[str]) -> list[str]:
    """A line for each thing that a reader of the figures must know.

    Args:
        left: A trace.
        right: The other.
        common: The moments that they share.
        of_quantities: What is to be said of single quantities.
    """
    a, b = left.header, right.header
    labels = labels_of(a, b).long
    columns = dict.fromkeys(
        what
        for column, what in _COMPARED.items()
        if not tell(left, right, column) and (column in left or column in right)
    )
    # The command of a last row is never carried out.
    used = (common.left < len(left) - 1) & (common.right < len(right) - 1)
    commands = left.ctrl[common.left[used]], right.ctrl[common.right[used]]
    same = a.actuators == b.actuators
    notes: list[Note] = [
        (
            a.provenance.model_sha256 != b.provenance.model_sha256,
            f"the two sides use different model files: {a.provenance.model_file} and "
            f"{b.provenance.model_file}",
        ),
        *_of_joints(left, right, labels),
        (columns, f"not compared, for one side does not tell it: {', '.join(columns)}"),
        *((True, line) for line in of_quantities),
        (
            a.experiment != b.experiment,
            f"the experiments are two: {a.experiment} and {b.experiment}",
        ),
        *_of_time(left, right, common, labels),
        (
            not np.allclose(a.gravity, b.gravity, rtol=0, atol=1e-12),
            f"gravity differs: {numbers(a.gravity)} and {numbers(b.gravity)} m/s²",
        ),
        (
            any(header.defaults == "engine" and header.energy_by for header in (a, b)),
            "energy is measured by one yardstick on both sides, masses, armature and gravity of "
            f"the model ({a.energy_by or b.energy_by}), whatever an engine itself has",
        ),
        (not same, "the actuators differ, in name or in order"),
        (
            same and not np.array_equal(*commands),
            "the commands differ: the controllers saw different states, or are two",
        ),
    ]
    for trace, label in zip((left, right), labels, strict=True):
        header, inside = trace.header, few(trace.overlaps)
        notes += [
            (inside, f"{label} starts with shapes inside each other: {inside}"),
            (header.ended, f"{label} ended early: {header.ended}"),
            (
                header.rewritten,
                f"{label}: in {header.rewritten} rows the state was written, by the "
                "controller; that is not part of the commands",
            ),
            (
                header.single,
                f"the recorded run of {header.backend} keeps all but its state in single precision",
            ),
        ]
    return [line for said, line in notes if said]


def _of_joints(left: Trace, right: Trace, labels: Two) -> list[Note]:
    a, b = left.header, right.header
    only = [
        f"{name} ({label})"
        for header, other, label in ((a, b, labels[0]), (b, a, labels[1]))
        for name in header.joint_labels
        if name not in other.joint_labels
    ]
    shared = {
        name: [joint_columns(header, name) for header in (a, b)]
        for name in a.joint_labels
        if name in b.joint_labels
    }
    other = [name for name, (x, y) in shared.items() if x.kind is not y.kind]
    moved = any(
        not np.array_equal(left.qpos[0, x.qpos], right.qpos[0, y.qpos])
        or not np.array_equal(left.qvel[0, x.qvel], right.qvel[0, y.qvel])
        for x, y in shared.values()
        if x.kind is y.kind
    )
    return [
        (only, f"compared is what both have; missing on one side: {', '.join(only)}"),
        (other, f"not compared, for they are joints of another kind: {', '.join(other)}"),
        (moved, "the runs do not start in the same state"),
    ]


def _of_time(left: Trace, right: Trace, common: Common, labels: Two) -> list[Note]:
    steps = [trace.header.timestep for trace in (left, right)]
    apart = float(common.time[-1]) / max(1, len(common.time) - 1)
    ends = [float(trace.time[-1] - trace.time[0]) for trace in (left, right)]
    return [
        (
            steps[0] != steps[1],
            f"timesteps differ, {significant(1000 * steps[0])} and {milliseconds(steps[1])}, and "
            f"meet every {milliseconds(apart, 3)}: compared are these common moments alone, "
            "nothing is interpolated, and a peak between two of them is not seen",
        ),
        (
            abs(ends[0] - ends[1]) > max(steps) * (1 + SAME),
            f"the runs are {ends[0]:g} and {ends[1]:g} s long: what {labels[ends[1] > ends[0]]} "
            f"does after {common.time[-1]:g} s is not compared",
        ),
    ]
