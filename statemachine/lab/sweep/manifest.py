"""The manifest of a dataset: what a sweep was asked for, as the plain values of its JSON file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypedDict

from .design import Kind, Value

MANIFEST_VERSION = 5


class RecordedRequest(TypedDict):
    """The request of a sweep but for its design: cells of another are of another sweep.

    `function` is the digest of the user's file; the other keys are attributes of `Sweep`.
    """

    what: str
    function: str
    model: str | None
    seconds: float | None
    every: int
    keyframe: str | None
    spread: str
    moments: int


class RecordedDesign(TypedDict):
    """The part of a request by which a dataset may grow; the keys are attributes of `Sweep`."""

    vary: Sequence[str]
    seeds: int
    samples: int
    design_seed: int
    backends: Sequence[str]


class RecordedFactor(TypedDict):
    """A factor of a sweep; the keys are attributes of `Vary`."""

    name: str
    place: str
    kind: Kind
    values: Sequence[Value]
    bounds: Sequence[float] | None
    times: bool
    label: str


class ColumnMeaning(TypedDict):
    """The unit of a column of a dataset, and what it says."""

    unit: str
    meaning: str


class SweepProvenance(TypedDict):
    """The origin of a dataset, as plain values: what was asked for, digests and versions.

    `schema` is `MANIFEST_VERSION`, `command` what is typed, `files` the digest of each model's
    file by name, `versions` those of this library, of engines and of packages.
    """

    schema: int
    command: str
    request: RecordedRequest
    files: Mapping[str, str]
    versions: Mapping[str, str]
    design: RecordedDesign


class SweepManifest(SweepProvenance):
    """The content of `sweep.json`: the origin of a dataset, its factors, sizes and columns."""

    factors: Sequence[RecordedFactor]
    points: int
    cells: int
    columns: Mapping[str, ColumnMeaning]
