"""A table of examined models, and what it comes to: counts by engine, feature and reading."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...show.blocks import only_on_pages
from .records import NOT_READ, TOLERANCE, BackendRow, ExaminedModel, is_as_it_comes

_LONGEST = 72  # characters of a reason
# Before the reason why an engine does not read a file: what is not read, and where.
_HEAD = re.compile(r"^.*? cannot read .+?: ")
# What is of one file alone: names in quotes, paths, numbers, and the place in a file.
_PARTICULARS = re.compile(r"""(["'])[^"']+\1|\(index [^)]*\)|\S*[/\\]\S*|\[.*\]|\d[\d.]*""")


@dataclass(frozen=True)
class EngineTally:
    """The number of models that an engine loads, and what becomes of their runs.

    The counts of gaps are of runs without contacts that did not end early. The default backend,
    which the others are compared with, has none.

    Attributes:
        engine: The backend.
        loads: How many models load with contacts.
        only_without_contacts: How many load with contacts off, and not with them.
        equals_engine: How many runs have the bits of the engine without us; None of all but the
            default backend.
        within: How many gaps are at most 1e-6 rad or m.
        rounding: How many gaps are no larger than rounding alone makes.
        vanishes: How many gaps vanish with the timestep.
    """

    engine: str
    loads: int
    only_without_contacts: int
    equals_engine: int | None
    within: int | None
    rounding: int | None
    vanishes: int | None


@dataclass(frozen=True)
class RefusedFeature:
    """A feature of models that a backend refuses.

    Attributes:
        feature: In a few words; of a file that the engine does not read, and the default one does,
            the engine's own reason without what is of this file alone.
        models: How many models are refused for it, alone or among others.
        alone: How many are refused for nothing else.
        loaded_without_contacts: How many of them load with contacts off.
    """

    feature: str
    models: int
    alone: int
    loaded_without_contacts: int


@dataclass(frozen=True)
class Survey:
    """A table of models.

    Attributes:
        default: The backend that the others are compared with.
        models: One row each, in the order of the files.
        parts: Files that are not models of their own but parts of others.
        made_with: Versions and settings.
    """

    default: str
    models: Sequence[ExaminedModel]
    parts: Sequence[ExaminedModel]
    made_with: str

    @property
    def wrong(self) -> Mapping[str, tuple[str, ...]]:
        """Return what must not be, by file."""
        by_file = {row.file: row.wrong(self.default) for row in self.models}
        return {file: said for file, said in by_file.items() if said}

    @property
    @only_on_pages
    def is_of_one_model(self) -> bool:
        """Tell whether it is of one model alone, of which every finding is worth showing."""
        return len(self.models) == 1 and not self.parts

    @property
    @only_on_pages
    def backends(self) -> tuple[str, ...]:
        """Return every backend that a model was examined on."""
        names: dict[str, None] = {}
        for model in self.models:
            names |= dict.fromkeys(model.backends)
        return tuple(names)

    @property
    @only_on_pages
    def others(self) -> tuple[str, ...]:
        """Return the backends that are compared with the default one."""
        return tuple(name for name in self.backends if name != self.default)

    @property
    @only_on_pages
    def as_they_come(self) -> tuple[str, ...]:
        """Return those of them of which nothing is computed here: their gaps contradict nothing."""
        return tuple(name for name in self.others if is_as_it_comes(name))

    @property
    @only_on_pages
    def ran_experiments(self) -> bool:
        """Tell whether an experiment was tried on a model."""
        return any(model.ran_experiments for model in self.models)

    @property
    @only_on_pages
    def engines(self) -> tuple[EngineTally, ...]:
        """Return the sums of each backend, the default one first."""
        return tuple(self._tally(engine) for engine in (self.default, *self.others))

    @property
    @only_on_pages
    def grades(self) -> Mapping[str, int]:
        """Return the number of models that the witness compared by each reading, or "refused"."""
        witnesses = [model.witness for model in self.models if model.witness is not None]
        counts = Counter(witness.grade or "refused" for witness in witnesses)
        return dict(sorted(counts.items()))

    def refused_features(self, backend: str) -> tuple[RefusedFeature, ...]:
        """Return what a backend refuses, the most frequent feature first."""
        models: Counter[str] = Counter()
        alone: Counter[str] = Counter()
        loaded: Counter[str] = Counter()
        for model in self.models:
            if backend not in model.backends or not model.backends[backend].refusal:
                continue
            row = model.backends[backend]
            features = self._refused_in(model, row)
            models.update(features)
            if len(features) == 1:
                alone.update(features)
            if row.loading == "without contacts":
                loaded.update(features)
        return tuple(
            RefusedFeature(name, count, alone[name], loaded[name])
            for name, count in models.most_common()
        )

    def _refused_in(self, model: ExaminedModel, row: BackendRow) -> tuple[str, ...]:
        """Return what of a model is refused; of a file that is not read, why not."""
        default = model.backends.get(self.default)
        is_read_elsewhere = default is not None and default.loads and default is not row
        if row.features == (NOT_READ,) and is_read_elsewhere:
            return (f"{NOT_READ}: {reason_in_general(row.refusal)}",)
        return row.features

    def _rows(self, backend: str) -> list[BackendRow]:
        """Return what was found of each model that was examined on a backend."""
        return [model.backends[backend] for model in self.models if backend in model.backends]

    def _tally(self, engine: str) -> EngineTally:
        rows = self._rows(engine)
        loads = sum(row.loads for row in rows)
        only_without = sum(row.loading == "without contacts" for row in rows)
        if engine == self.default:
            exact = sum(row.equals_engine is True for row in rows)
            return EngineTally(engine, loads, only_without, exact, None, None, None)
        compared = [row.without_contacts for row in rows if row.without_contacts is not None]
        gaps = [gap for gap in compared if not gap.ended]
        return EngineTally(
            engine,
            loads,
            only_without,
            equals_engine=None,
            within=sum(gap.largest <= TOLERANCE for gap in gaps),
            rounding=sum(gap.is_rounding for gap in gaps),
            vanishes=sum(gap.first_order for gap in gaps),
        )


def reason_in_general(refusal: str) -> str:
    """Return why an engine does not read a file, without what is of this file alone.

    Args:
        refusal: What it says, in one line.
    """
    text = _PARTICULARS.sub("…", _HEAD.sub("", refusal))
    text = text.removeprefix("failed to load scene, ").partition(", expected one of")[0]
    return textwrap.shorten(text, _LONGEST, placeholder=" …")
