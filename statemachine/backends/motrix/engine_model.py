"""MotrixSim's own model of a file: read by its own reader, with what `replace` changed.

A file becomes a *world* (`motrixsim.msd.World`: a description that can be edited), and that a
*scene* (`motrixsim.SceneModel`, which is stepped).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...errors import ModelError
from ...interface import Array
from ...processes.stderr_capture import stderr_capture
from .links import TITLE, geoms_of, mx
from .messages import is_panic, reason_of
from .settings import apply_settings

MOST_POINTS = 16  # contacts of one pair of geoms that a sensor reports
GeomPair = tuple[int, int]


class EngineModel:
    """What MotrixSim makes of a file, with some numbers edited; read when it is first needed.

    Attributes:
        path: The file.
        settings: Fields of a compiled model that are edited in it; see `settings`.
    """

    def __init__(self, path: Path, settings: Mapping[str, Array] = MappingProxyType({})) -> None:
        self.path, self.settings = path, dict(settings)
        self._sensed: tuple[frozenset[GeomPair], Any] = frozenset(), None

    def __reduce__(self) -> tuple[Any, ...]:
        return EngineModel, (self.path, self.settings)

    @cached_property
    def scene(self) -> Any:
        """Return the model that is stepped.

        Without edits it is what `motrixsim.load_model` gives, bit by bit; a world that is built
        has the poses of its geoms rounded otherwise in the last bit.
        """
        if not self.settings:
            scene, _ = self._read(lambda: mx.load_model(str(self.path)))
            return scene
        return self._built(self.edited_world())

    @cached_property
    def owner_of_colliders(self) -> list[int]:
        """Return the geom of each collider; a geom may have several."""
        owners = [-1] * len(self.scene.low.colliders)
        for geom in range(self.scene.num_geoms):
            for collider in self.scene.low.get_collider_indices(geom) or ():
                owners[collider] = geom
        return owners

    def world(self) -> tuple[Any, list[str]]:
        """Return the world of the file as it is written, and the lines that the reader wrote."""
        return self._read(lambda: mx.msd.from_file(str(self.path)))

    def edited_world(self) -> Any:
        """Return the world of the file, edited."""
        world, _ = self.world()
        if self.settings:
            apply_settings(world, self.settings)
        return world

    def sensed_scene(self, pairs: frozenset[GeomPair]) -> Any:
        """Return a scene with a sensor for each of some pairs of geoms at least.

        The sensor of the pair (a, b) is called "a b". Pairs of before stay: none is built twice.

        Args:
            pairs: Numbers of geoms, as MotrixSim counts them.
        """
        known, scene = self._sensed
        if scene is None or not pairs <= known:
            known |= pairs
            world = self.edited_world()
            for number, geom in enumerate(geoms_of(world)):
                geom.name = f"geom {number}"
            world.sensors.contact = [_sensor(a, b) for a, b in sorted(known)]
            scene = self._built(world)
            self._sensed = known, scene
        return scene

    def _built(self, world: Any) -> Any:
        scene, _ = self._read(world.build)
        return scene

    def _read(self, call: Callable[[], Any]) -> tuple[Any, list[str]]:
        """Return what a call gives that reads or builds, and the lines that MotrixSim wrote.

        Raises:
            ModelError: It cannot; with its reason.
        """
        try:
            with stderr_capture() as lines:
                return call(), lines
        except BaseException as error:
            if isinstance(error, Exception) or is_panic(error):
                reason = reason_of(error)
                raise ModelError(f"{TITLE} cannot read {self.path}: {reason}") from error
            raise


def _sensor(a: int, b: int) -> Any:
    """Return a sensor of all contacts between two geoms."""
    sensor, report = mx.msd.ContactSensor(), mx.msd.ContactSensorReport()
    sensor.name, sensor.max_num = f"{a} {b}", MOST_POINTS
    sensor.match_ = mx.msd.ContactMatch.geom_pair(f"geom {a}", f"geom {b}")
    for part in ("found", "force", "torque", "dist", "pos", "normal", "tangent"):
        setattr(report, part, True)
    sensor.report = report
    return sensor
