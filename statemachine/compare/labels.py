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


def labels_of(one: Header, two: Header) -> Labels:
    """The names of two runs."""
    engines = one.label, two.label
    others = list(_apart(one, two))
    backends = one.backend, two.backend
    own = [", engine defaults" * (header.defaults == "engine") for header in (one, two)]
    ways = backends[0] + own[0], backends[1] + own[1]
    # The first by which they differ.
    short = next((two for two in (backends, ways, *others, engines) if two[0] != two[1]), ways)
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


def files_apart(one: Sequence[str], two: Sequence[str]) -> Two:
    """The shortest ends of two paths, given by their parts, that are not the same."""
    counts = range(1, max(len(one), len(two)) + 1)
    differing = (count for count in counts if one[-count:] != two[-count:])
    count = next(differing, 1)
    return "/".join(one[-count:]), "/".join(two[-count:])


def options_apart(one: Mapping[str, Any], two: Mapping[str, Any]) -> Two:
    """The options that differ, as they are typed; what a side does not say is of its file."""
    differing = [
        name
        for name in dict.fromkeys([*one, *two])
        if typed_option(name, one.get(name)) != typed_option(name, two.get(name))
    ]
    texts = [
        ", ".join(
            typed_option(name, options[name]) if name in options else f"{name} of the file"
            for name in differing
        )
        for options in (one, two)
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


def _apart(one: Header, two: Header) -> Iterator[Two]:
    """What differs besides the engine, the weightiest first."""
    a, b = one.provenance, two.provenance
    if a.model_file != b.model_file:
        yield files_apart(a.model_file.split("/"), b.model_file.split("/"))
    elif a.model_sha256 != b.model_sha256:
        last = a.model_file.split("/")[-1]
        yield f"{last} ({a.model_sha256[:8]})", f"{last} ({b.model_sha256[:8]})"
    options = options_apart(*(_with_known(*pair) for pair in ((one, two), (two, one))))
    if options[0] != options[1]:
        yield options
    if one.backend != two.backend or one.label != two.label:
        return
    for name, values in (
        ("", (one.experiment, two.experiment)),
        ("from ", (one.keyframe or "the default state", two.keyframe or "the default state")),
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


def notes_on(one: Trace, two: Trace, common: Common, of_quantities: Iterable[str]) -> list[str]:
    """A line for each thing that a reader of the figures must know.

    Args:
        one: A trace.
        two: The other.
        common: The moments that they share.
        of_quantities: What is to be said of single quantities.
    """
    a, b = one.header, two.header
    labels = labels_of(a, b).long
    columns = dict.fromkeys(
        what
        for column, what in _COMPARED.items()
        if not tell(one, two, column) and (column in one or column in two)
    )
    # The command of a last row is never carried out.
    used = (common.one < len(one) - 1) & (common.two < len(two) - 1)
    commands = one.ctrl[common.one[used]], two.ctrl[common.two[used]]
    same = a.actuators == b.actuators
    notes: list[Note] = [
        (
            a.provenance.model_sha256 != b.provenance.model_sha256,
            f"the two sides use different model files: {a.provenance.model_file} and "
            f"{b.provenance.model_file}",
        ),
        *_of_joints(one, two, labels),
        (columns, f"not compared, for one side does not tell it: {', '.join(columns)}"),
        *((True, line) for line in of_quantities),
        (
            a.experiment != b.experiment,
            f"the experiments are two: {a.experiment} and {b.experiment}",
        ),
        *_of_time(one, two, common, labels),
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
    for trace, label in zip((one, two), labels, strict=True):
        header, inside = trace.header, few(trace.overlaps)
        notes += [
            (inside, f"{label} starts with shapes inside each other: {inside}"),
            (header.ended, f"{label} ended early: {header.ended}"),
            (
                header.rewritten,
                f"{label}: in {header.rewritten} rows the state was written, by the "
                "controller; that is no part of the commands",
            ),
            (
                header.single,
                f"the recorded run of {header.backend} keeps all but its state in single precision",
            ),
        ]
    return [line for said, line in notes if said]


def _of_joints(one: Trace, two: Trace, labels: Two) -> list[Note]:
    a, b = one.header, two.header
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
        not np.array_equal(one.qpos[0, x.qpos], two.qpos[0, y.qpos])
        or not np.array_equal(one.qvel[0, x.qvel], two.qvel[0, y.qvel])
        for x, y in shared.values()
        if x.kind is y.kind
    )
    return [
        (only, f"compared is what both have; missing on one side: {', '.join(only)}"),
        (other, f"not compared, for they are joints of another kind: {', '.join(other)}"),
        (moved, "the runs do not start in the same state"),
    ]


def _of_time(one: Trace, two: Trace, common: Common, labels: Two) -> list[Note]:
    steps = [trace.header.timestep for trace in (one, two)]
    apart = float(common.time[-1]) / max(1, len(common.time) - 1)
    ends = [float(trace.time[-1] - trace.time[0]) for trace in (one, two)]
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
