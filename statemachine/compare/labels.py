"""What two sides are called: what tells them apart, the engine first, then file and options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..runs import Header

Two = tuple[str, str]


@dataclass(frozen=True)
class Labels:
    """Names of two sides; those of one kind are never the same.

    Attributes:
        long: For headings; engine and version where these differ.
        short: For tables and sentences.
        told: Whether something tells them apart; else they are the first and the second.
    """

    long: Two
    short: Two
    told: bool = True


def labels_of(one: Header, two: Header) -> Labels:
    """The names of two runs."""
    engines = one.label, two.label
    others = list(_apart(one, two))
    ways = one.backend + _way(one), two.backend + _way(two)
    if one.backend != two.backend:
        short = one.backend, two.backend
    elif ways[0] != ways[1]:
        short = ways
    else:
        short = next(iter(others), engines if engines[0] != engines[1] else ways)
    long = _joined([*([engines] if engines[0] != engines[1] or not others else []), *others])
    return Labels(_numbered(long), _numbered(short), short[0] != short[1])


def files_apart(one: Sequence[str], two: Sequence[str]) -> Two:
    """The shortest ends of two paths, given by their parts, that are not the same."""
    most = max(len(one), len(two))
    for count in range(1, most + 1):
        ends = "/".join(one[-count:]), "/".join(two[-count:])
        if ends[0] != ends[1]:
            return ends
    return "/".join(one[-1:]), "/".join(two[-1:])


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
    if isinstance(value, bool):
        text = "on" if value else "off"
    elif isinstance(value, str) or value is None:
        text = str(value)
    else:
        text = ",".join(f"{number:.15g}" for number in np.atleast_1d(value))
    return f"{name}={text}"


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


def _way(header: Header) -> str:
    return ", engine defaults" if header.defaults == "engine" else ""


def _joined(parts: Sequence[Two]) -> Two:
    return ", ".join(part[0] for part in parts), ", ".join(part[1] for part in parts)


def _numbered(names: Two) -> Two:
    """Two that are alike, with their places."""
    return names if names[0] != names[1] else (f"{names[0]} (first)", f"{names[1]} (second)")
