"""The points of a sweep: every combination of lists and grids, times the samples of ranges."""

from __future__ import annotations

import hashlib
import inspect
import itertools
import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..installed import require_extra
from ..interface import Array
from .factors import Value, Vary

_DIGITS = 32  # hexadecimal, of a digest
_DIMENSIONS = 21201  # that SciPy has Sobol directions for


@dataclass(frozen=True)
class DesignPoint:
    """One setting of everything that is varied.

    Attributes:
        id: A digest of the values.
        values: One for each `Vary`, in their order.
    """

    id: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Design:
    """What points a sweep has.

    Attributes:
        factors: What is varied; none for the experiment as it is.
        samples: How many points of the ranges are drawn; for indices, in each block.
        indices: Whether the samples are those of first-order and total Sobol indices (A. Saltelli
            et al., Computer Physics Communications 181, 2010): a block A, a block B, and for each
            range a block of A with that one from B.
        seed: Of the scrambling of the Sobol sequence.
    """

    factors: tuple[Vary, ...] = ()
    samples: int = 0
    indices: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if bool(self.sampled) != (self.samples > 0):
            if self.sampled:
                raise BadInputError(
                    f"{self.sampled[0].label} has a range: say --samples N, or a count behind it"
                )
            raise BadInputError("--samples is of ranges, NAME=from:to, and none is varied")
        if self.indices and not self.sampled:
            raise BadInputError("--indices wants ranges, NAME=from:to, and --samples")
        if len(self.sampled) * (1 + self.indices) > _DIMENSIONS:
            raise BadInputError(f"{len(self.sampled)} ranges are more than can be sampled")

    @property
    def sampled(self) -> tuple[Vary, ...]:
        """The factors with a range."""
        return tuple(vary for vary in self.factors if vary.bounds is not None)

    @property
    def listed(self) -> tuple[Vary, ...]:
        """The factors with a list or a grid."""
        return tuple(vary for vary in self.factors if vary.bounds is None)

    @property
    def size(self) -> int:
        """Number of points; it may be too large for `len`."""
        blocks = len(self.sampled) + 2 if self.indices else 1
        count = blocks * self.samples if self.sampled else 1
        for vary in self.listed:
            count *= len(vary.values)
        return count

    def points(self) -> Iterator[DesignPoint]:
        """Every point; the samples change slowest."""
        names = [vary.label for vary in self.factors]
        for drawn in map(iter, self._drawn()):
            choices = [vary.values or (next(drawn),) for vary in self.factors]
            for values in itertools.product(*choices):
                yield DesignPoint(digest(dict(zip(names, values, strict=True))), values)

    def _drawn(self) -> list[list[Value]]:
        """The values of each sample, block by block; one without any where nothing is sampled."""
        width = len(self.sampled)
        if not width:
            return [[]]
        unit = _sobol(width * (1 + self.indices), self.samples, self.seed)
        low, high = np.array([vary.bounds for vary in self.sampled]).T
        blocks = [unit[:, :width]]
        if self.indices:
            a, b = unit[:, :width], unit[:, width:]
            blocks = [a, b, *(np.where(np.arange(width) == k, b, a) for k in range(width))]
        return (low + (high - low) * np.concatenate(blocks)).tolist()


def _sobol(width: int, count: int, seed: int) -> Array:
    """(count, width) points in the unit cube, of a scrambled Sobol sequence."""
    qmc = require_qmc()
    # SciPy 1.15 calls the seed of a generator `rng`.
    name = "rng" if "rng" in inspect.signature(qmc.Sobol).parameters else "seed"
    engine = qmc.Sobol(width, scramble=True, **{name: np.random.default_rng(seed)})
    with warnings.catch_warnings():  # of a number that is no power of two: said when it is asked
        warnings.simplefilter("ignore")
        return engine.random(count)


def require_qmc() -> Any:
    """SciPy's quasi-Monte-Carlo designs.

    Raises:
        MissingEngineError: SciPy is not installed; the message names the extra.
    """
    return require_extra("scipy.stats.qmc", "sampling a range", "SciPy", "sweep")


def digest(content: object) -> str:
    """Of plain values; 1 and 1.0 are the same."""
    plain = json.loads(json.dumps(content, allow_nan=False), parse_int=float)
    text = json.dumps(plain, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
