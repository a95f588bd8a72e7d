"""What is asked of an engine about files and compiled models: read, compare, edit, compile anew."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .methods import mandatory

if TYPE_CHECKING:
    from ..interface import Array, Data, Model
    from ..interface.records import ReadOptions
    from .description.file_form import FileForm
    from .description.reading import Comparable, ModelReading
    from .description.records import Robot
    from .description.xml_source import XmlSource
    from .records import Counterparts, Edit, ModelDifference, SpecEdit


class CompiledModels:
    """Files and compiled models, as an engine of its own reads, compares and edits them.

    Attributes:
        name: The engine's.
    """

    name: str

    @mandatory
    @abstractmethod
    def read(self, path: Path) -> ModelReading:
        """Return the compiled model that an engine makes of a file with its own defaults; see
        `read_robot`.

        Raises:
            MissingEngineError: It is not installed here.
            ModelError: It cannot read the file.
        """

    @mandatory
    @abstractmethod
    def read_file(self, path: Path, comparable: Comparable | None = None) -> ModelReading:
        """Return a file as it is written, as a compiled model.

        Args:
            path: An MJCF, URDF or MJB file.
            comparable: How it is made comparable with the other side; None for the elements of the
                file alone.

        Raises:
            MissingEngineError: It is not installed here.
            ModelError: It cannot read the file.
        """

    @mandatory
    @abstractmethod
    def read_robot(self, robot: Robot, path: Path) -> ModelReading:
        """Return what another engine made of a file, as a compiled model.

        Args:
            robot: What the engine made of it.
            path: The file.

        Raises:
            ModelError: It cannot be compiled.
        """

    @mandatory
    @abstractmethod
    def element_names(self, raw: Any) -> dict[str, list[str]]:
        """Return the names of all elements of a compiled model by their kind, in their order."""

    @mandatory
    @abstractmethod
    def moment_arms(self, raw: Any) -> tuple[dict[str, float], ...]:
        """Return the moment arms of each actuator of a compiled model on hinges and slides, by
        joint.
        """

    @mandatory
    @abstractmethod
    def describe(self, compiled: Any, name: str) -> Robot:
        """Return the description in a compiled model; its joints are in the order of the
        model's.
        """

    @mandatory
    @abstractmethod
    def differences(
        self, left: Any, right: Any, pairs: Counterparts, *, world: bool = True
    ) -> tuple[ModelDifference, ...]:
        """Return all differences of two compiled models that can change a motion.

        Args:
            left: A compiled model.
            right: Another.
            pairs: What of one is what of the other.
            world: Whether gravity and the timestep are compared, too.
        """

    @mandatory
    @abstractmethod
    def sensors(self, left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
        """Return the differences of the sensors of two compiled models, which only a controller
        reads.
        """

    @mandatory
    @abstractmethod
    def readable(self, left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
        """Return the differences that the engine does not use: user and custom data."""

    @mandatory
    @abstractmethod
    def shown_elements(
        self, left: Any, right: Any, pairs: Counterparts
    ) -> dict[str, list[tuple[int, int]]]:
        """Return the pairs of geoms, tendons and actuators, and of places in sensordata, by
        kind.
        """

    @mandatory
    @abstractmethod
    def data_in_other_order(self, model: Model, elements: Mapping[str, Any]) -> Any:
        """Return a Data of a Model that shows what a Data of another one has.

        Args:
            model: In whose order it is shown.
            elements: By kind pairs of ids, or of places in an array: in `model`, in the other.
        """

    @mandatory
    @abstractmethod
    def entries(self, right: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
        """Return a difference by its single entries, or itself where it is of one piece.

        Args:
            right: The compiled model that its edits are of.
            difference: One of `differences`.
        """

    @mandatory
    @abstractmethod
    def integrator(self, raw: Any) -> str:
        """Return the name of the integrator of a compiled model: "euler", "rk4", …"""

    @mandatory
    @abstractmethod
    def flags(self, raw: Any) -> dict[str, bool]:
        """Return the flags of a compiled model that can change a motion: whether each is on."""

    @mandatory
    @abstractmethod
    def edited(self, raw: Any, edits: Iterable[Edit]) -> Any:
        """Return a copy of a compiled model with these edits, and all that follows from them."""

    @mandatory
    @abstractmethod
    def can_be_respecified(self, path: Path) -> bool:
        """Tell whether a file has a description that can be compiled anew; a binary one has
        none.
        """

    @mandatory
    @abstractmethod
    def respecified(self, path: Path, raw: Any, edits: Sequence[SpecEdit]) -> Any:
        """Return the compiled model of a file with some elements set otherwise.

        Args:
            path: The file.
            raw: What was compiled of it, with the options that were set since then.
            edits: What is set.

        Raises:
            ModelError: It cannot be compiled so.
        """

    @mandatory
    @abstractmethod
    def file_form(
        self, source: XmlSource, raw: Any, other_path: Path, other: Any, geoms: Mapping[int, int]
    ) -> FileForm:
        """Return the writer of differences as attributes of a file.

        Args:
            source: The file.
            raw: What was compiled of it.
            other_path: The file of the other side.
            other: What was compiled of that.
            geoms: For each geom of the file its counterpart on the other side.

        Raises:
            ModelError: The file of the other side is no XML.
        """

    @mandatory
    @abstractmethod
    def in_places_of(self, before: Any, after: Any, edits: Iterable[Edit]) -> tuple[Edit, ...]:
        """Return the edits of one compiled model as those of another, from `respecified`."""

    @mandatory
    @abstractmethod
    def counts(self, compiled: Any) -> dict[str, int]:
        """Return how many "actuators" a compiled model has, and how many planes are its "floor"."""

    @mandatory
    @abstractmethod
    def with_parts(
        self,
        taker: Path,
        giver: Path,
        parts: Collection[str],
        names: Mapping[str, Mapping[str, str]],
        options: ReadOptions,
    ) -> Any:
        """Return the compiled model of a file, with elements of another one instead of its own.

        Args:
            taker: The file.
            giver: The other.
            parts: Of `counts`.
            names: By kind ("joint", "body", "site") the names in `taker` of what `giver` has.
            options: How `taker` is read.

        Raises:
            ModelError: It cannot be made.
        """

    @mandatory
    @abstractmethod
    def energies(
        self,
        model: Model,
        qpos: Array,
        qvel: Array,
        made: Callable[[Model], AbstractContextManager[Data]],
    ) -> Array:
        """Return the kinetic and potential energy (n, 2) [J] of states.

        Args:
            model: A model on this engine.
            qpos: (n, nq) positions [rad or m].
            qvel: (n, nv) velocities [rad/s or m/s].
            made: Gives a Data of it, which is changed.
        """
