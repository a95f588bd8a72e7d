"""What two sides are called, and what makes a comparison less than one of two engines.

They are called by what tells them apart: the engine first, then file and options.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...interface.options import OptionValue
from ...measures import SAME_MOMENT, CommonMoments
from ...measures.text import few, milliseconds, numbers, significant
from ..recordings import Header, Trace
from ..runs.floating import base_of
from .series import both_have, joint_columns

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
    """Return the labels of two runs, long and short, by what differs between them."""
    engines = left.label, right.label
    others = list(_differing_labels(left, right))
    backends = left.backend, right.backend
    with_defaults = _with_defaults(left), _with_defaults(right)
    short = with_defaults
    for names in (backends, with_defaults, *others, engines):
        if names[0] != names[1]:
            short = names
            break
    parts = others
    if engines[0] != engines[1] or not others:
        parts = [engines, *others]
    long = ", ".join(part[0] for part in parts), ", ".join(part[1] for part in parts)
    return Labels(numbered(long), numbered(short))


def _with_defaults(header: Header) -> str:
    """Return the backend of a run, and whether it kept its engine's defaults."""
    if header.defaults == "engine":
        return f"{header.backend}, engine defaults"
    return header.backend


def lines_on_unmatched(only: Sequence[Mapping[str, Sequence[str]]], labels: Two) -> Iterator[str]:
    """Yield a line for a side that has what the other has not, as `Matched.only` tells it."""
    unmatched_on_both = [kind for kind in only[0] if only[0].get(kind) and only[1].get(kind)]
    for unmatched, label in zip(only, labels, strict=True):
        parts = []
        for kind, names in unmatched.items():
            if names:
                part = f"{kind if len(names) == 1 else f'{kind}s'} {few(names, 6)}"
                if kind in unmatched_on_both:  # they may be the same
                    part += " (--map LEFT=RIGHT)"
                parts.append(part)
        if parts:
            yield f"only {label} has {'; '.join(parts)}: not compared"


def files_apart(left: Sequence[str], right: Sequence[str]) -> Two:
    """Return the shortest ends of two paths, given by their parts, that are not the same."""
    counts = range(1, max(len(left), len(right)) + 1)
    differing = (count for count in counts if left[-count:] != right[-count:])
    count = next(differing, 1)
    return "/".join(left[-count:]), "/".join(right[-count:])


def options_apart(left: Mapping[str, OptionValue], right: Mapping[str, OptionValue]) -> Two:
    """Return the options that differ, as they are typed on either side.

    What a side does not set is the value of its file.
    """
    differing = [
        name
        for name in dict.fromkeys([*left, *right])
        if typed_option(name, left.get(name)) != typed_option(name, right.get(name))
    ]
    return _typed_options(differing, left), _typed_options(differing, right)


def _typed_options(names: Iterable[str], options: Mapping[str, OptionValue]) -> str:
    """Return some options as they are typed, and which of them are left to the file."""
    return ", ".join(
        typed_option(name, options[name]) if name in options else f"{name} of the file"
        for name in names
    )


def typed_option(name: str, value: OptionValue | None) -> str:
    """Return an option as one types it: "timestep=0.002", "contacts=off", "gravity=0,0,-9.8"."""
    match value:
        case bool():
            return f"{name}={'on' if value else 'off'}"
        case str() | None:
            return f"{name}={value}"
    return f"{name}={','.join(f'{number:.15g}' for number in np.atleast_1d(value))}"


def _differing_labels(left: Header, right: Header) -> Iterator[Two]:
    """Yield what differs besides the engine, as a pair of labels, the weightiest first."""
    left_file, right_file = left.provenance.model_file, right.provenance.model_file
    left_digest, right_digest = left.provenance.model_sha256, right.provenance.model_sha256
    if left_file != right_file:
        yield files_apart(left_file.split("/"), right_file.split("/"))
    elif left_digest != right_digest:
        last = left_file.split("/")[-1]
        yield f"{last} ({left_digest[:8]})", f"{last} ({right_digest[:8]})"
    left_options, right_options = _options_to_compare(left, right), _options_to_compare(right, left)
    if base_of(left) == base_of(right):  # one of them took it over, or the file of one says it
        left_options.pop("base", None)
        right_options.pop("base", None)
    options = options_apart(left_options, right_options)
    if options[0] != options[1]:
        yield options
    if left.backend != right.backend or left.label != right.label:
        return
    if left.experiment != right.experiment:
        yield left.experiment, right.experiment
    left_start, right_start = _start_of(left), _start_of(right)
    if left_start != right_start:
        yield f"from {left_start}", f"from {right_start}"
    if left.provenance.seed != right.provenance.seed:
        yield f"seed {left.provenance.seed}", f"seed {right.provenance.seed}"


def _start_of(header: Header) -> str:
    """Return where a run starts, in words."""
    return header.keyframe or "the default state"


def _options_to_compare(header: Header, other: Header) -> dict[str, OptionValue]:
    """Return the options of a run, and its values of those that only the other run sets."""
    known: dict[str, OptionValue] = {
        "timestep": header.timestep,
        "substeps": header.substeps,
        "gravity": list(header.gravity),
    }
    missing = [name for name in known if name in other.options and name not in header.options]
    return {**header.options, **{name: known[name] for name in missing}}


def numbered(names: Two) -> Two:
    """Return two labels that are alike, each with its place behind it."""
    return names if names[0] != names[1] else (f"{names[0]} (first)", f"{names[1]} (second)")


def notes_on(
    left: Trace, right: Trace, common: CommonMoments, of_quantities: Iterable[str]
) -> list[str]:
    """Return a line for each thing that a reader of the figures must know.

    Args:
        left: A trace.
        right: The other.
        common: The moments that they share.
        of_quantities: What is to be said of single quantities.
    """
    labels = labels_of(left.header, right.header).long
    notes = list(_notes_on_files(left.header, right.header))
    notes += _notes_on_joints(left, right, labels)
    notes += _notes_on_columns(left, right)
    notes += of_quantities
    notes += _notes_on_experiments(left.header, right.header)
    notes += _notes_on_time(left, right, common, labels)
    notes += _notes_on_physics(left.header, right.header)
    notes += _notes_on_commands(left, right, common)
    notes += _notes_on_side(left, labels[0])
    notes += _notes_on_side(right, labels[1])
    return notes


def _notes_on_files(left: Header, right: Header) -> Iterator[str]:
    left_file, right_file = left.provenance.model_file, right.provenance.model_file
    if left.provenance.model_sha256 != right.provenance.model_sha256:
        yield f"the two sides use different model files: {left_file} and {right_file}"


def _notes_on_joints(left: Trace, right: Trace, labels: Two) -> Iterator[str]:
    left_names, right_names = left.header.joint_labels, right.header.joint_labels
    only = [f"{name} ({labels[0]})" for name in left_names if name not in right_names]
    only += [f"{name} ({labels[1]})" for name in right_names if name not in left_names]
    if only:
        yield f"compared is what both have; missing on one side: {', '.join(only)}"
    other_kind = []
    start_differs = False
    for name in left_names:
        if name not in right_names:
            continue
        left_columns = joint_columns(left.header, name)
        right_columns = joint_columns(right.header, name)
        if left_columns.kind is not right_columns.kind:
            other_kind.append(name)
            continue
        positions = left.qpos[0, left_columns.qpos], right.qpos[0, right_columns.qpos]
        velocities = left.qvel[0, left_columns.qvel], right.qvel[0, right_columns.qvel]
        if not (np.array_equal(*positions) and np.array_equal(*velocities)):
            start_differs = True
    if other_kind:
        yield f"not compared, for they are joints of another kind: {', '.join(other_kind)}"
    if start_differs:
        yield "the runs do not start in the same state"


def _notes_on_columns(left: Trace, right: Trace) -> Iterator[str]:
    missing: dict[str, None] = {}
    for column, what in _COMPARED.items():
        if not both_have(left, right, column) and (column in left or column in right):
            missing[what] = None
    if missing:
        yield f"not compared, for one side does not tell it: {', '.join(missing)}"


def _notes_on_experiments(left: Header, right: Header) -> Iterator[str]:
    if left.experiment != right.experiment:
        yield f"the experiments are two: {left.experiment} and {right.experiment}"


def _notes_on_time(left: Trace, right: Trace, common: CommonMoments, labels: Two) -> Iterator[str]:
    left_step, right_step = left.header.timestep, right.header.timestep
    until = float(common.time[-1])
    if left_step != right_step:
        spacing = until / max(1, len(common.time) - 1)
        yield (
            f"timesteps differ, {significant(1000 * left_step)} and {milliseconds(right_step)}, "
            f"and meet every {milliseconds(spacing, 3)}: compared are these common moments alone, "
            "nothing is interpolated, and a peak between two of them is not seen"
        )
    left_end = float(left.time[-1] - left.time[0])
    right_end = float(right.time[-1] - right.time[0])
    if abs(left_end - right_end) > max(left_step, right_step) * (1 + SAME_MOMENT):
        longer = labels[1] if right_end > left_end else labels[0]
        yield (
            f"the runs are {left_end:g} and {right_end:g} s long: what {longer} does after "
            f"{until:g} s is not compared"
        )


def _notes_on_physics(left: Header, right: Header) -> Iterator[str]:
    if not np.allclose(left.gravity, right.gravity, rtol=0, atol=1e-12):
        yield f"gravity differs: {numbers(left.gravity)} and {numbers(right.gravity)} m/s²"
    if any(header.defaults == "engine" and header.energy_by for header in (left, right)):
        yield (
            "energy is measured by one yardstick on both sides, masses, armature and gravity of "
            f"the model ({left.energy_by or right.energy_by}), whatever an engine itself has"
        )


def _notes_on_commands(left: Trace, right: Trace, common: CommonMoments) -> Iterator[str]:
    if left.header.actuators != right.header.actuators:
        yield "the actuators differ, in name or in order"
        return
    # The command of a last row is never carried out.
    used = (common.left < len(left) - 1) & (common.right < len(right) - 1)
    if not np.array_equal(left.ctrl[common.left[used]], right.ctrl[common.right[used]]):
        yield "the commands differ: the controllers saw different states, or are two"


def _notes_on_side(trace: Trace, label: str) -> Iterator[str]:
    header, overlaps = trace.header, few(trace.overlaps)
    if overlaps:
        yield f"{label} starts with shapes inside each other: {overlaps}"
    if header.ended:
        yield f"{label} ended early: {header.ended}"
    if header.rewritten:
        yield (
            f"{label}: in {header.rewritten} rows the state was written, by the controller; that "
            "is not part of the commands"
        )
    if header.single_precision:
        yield f"the recorded run of {header.backend} keeps all but its state in single precision"
