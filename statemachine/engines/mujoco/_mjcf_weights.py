"""What the geoms of a body weigh in two MJCFs, by their masses and densities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...backends.compiled.model import compiler_warnings, read_spec

_SHAPE = ("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_dataid")


@dataclass(frozen=True)
class WeightsOfBody:
    """What geoms of a body are to weigh.

    Attributes:
        values: By the id of a geom, "mass" [kg] or "density" [kg/m³], and its value.
        follows_from_shapes: Whether the geoms have other shapes or places on the other side, from
            which another inertia follows.
    """

    values: Mapping[int, tuple[str, float]] = field(default_factory=dict[int, tuple[str, float]])
    follows_from_shapes: bool = False


class MjcfWeights:
    """What the geoms of two MJCFs weigh.

    Args:
        paths: Of the other side, and of the file that is written. They are compiled once that is
            needed.
        raws: What they were compiled to.
        geoms: For each geom of the file that is written its counterpart on the other side.
    """

    def __init__(
        self, paths: tuple[Path, Path], raws: tuple[Any, Any], geoms: Mapping[int, int]
    ) -> None:
        self._paths, self._raws, self._geoms = paths, raws, geoms

    @cached_property
    def _both(self) -> list[dict[int, Any]]:
        """Return the geoms of both descriptions, by their ids."""
        return [_geoms_of(path) for path in self._paths]

    def of_body(self, body: int, geoms: Sequence[int]) -> WeightsOfBody:
        """Return what the geoms of a body are to weigh.

        Args:
            body: Its id in the file that is written.
            geoms: Ids of its geoms.
        """
        values: dict[int, tuple[str, float]] = {}
        other_shapes = False
        for geom in geoms:
            if geom not in self._geoms:
                return WeightsOfBody()
            there = self._geoms[geom]
            other_shapes = other_shapes or not self._has_shape_of(geom, there)
            ours, theirs = self._both[1].get(geom), self._both[0].get(there)
            if ours is None or theirs is None:
                return WeightsOfBody()
            if not math.isnan(theirs.mass):
                if theirs.mass != ours.mass:
                    values[geom] = ("mass", float(theirs.mass))
            elif not math.isnan(ours.mass):
                return WeightsOfBody()  # its density would count only without the mass
            elif theirs.density != ours.density:
                values[geom] = ("density", float(theirs.density))
        return WeightsOfBody(values, other_shapes)

    def _has_shape_of(self, geom: int, there: int) -> bool:
        """Tell whether two geoms have one shape and place."""
        left, right = self._raws
        return all(
            np.allclose(getattr(right, array)[geom], getattr(left, array)[there])
            for array in _SHAPE
        )


def _geoms_of(path: Path) -> dict[int, Any]:
    """Return the geoms of the description in a file, by the ids of the compiled model."""
    spec = read_spec(path)
    with compiler_warnings():
        spec.compile()
    return {geom.id: geom for geom in spec.geoms}
