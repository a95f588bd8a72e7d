"""What two descriptions of a robot differ in, before anything moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ....errors import BadInputError
from ....models import AnyPath
from ... import model_differences as models
from ...runs.reporter import QUIET, Reporter


@dataclass(frozen=True)
class ModelsRequest:
    """Question what two descriptions of a robot differ in.

    Attributes:
        files: A name or a file of each, URDF or MJCF.
        engines: For each the engine that it is asked of; None for the file itself.
        frames: Frames of the left that go by other names on the right.
        names: Joints, links and frames of the left that go by other names on the right.
        seed: Of the poses at which both are compared, at least 0.
        menagerie: A menagerie folder to look names up in.
    """

    files: tuple[AnyPath, AnyPath]
    engines: tuple[str | None, str | None] = (None, None)
    frames: Mapping[str, str] = field(default_factory=dict[str, str])
    names: Mapping[str, str] = field(default_factory=dict[str, str])
    seed: int = 0
    menagerie: AnyPath | None = None

    def __post_init__(self) -> None:
        if len(self.files) != 2 or len(self.engines) != 2:
            raise BadInputError(f"two files are compared, each of one engine or none; got {self}")
        if self.seed < 0:
            raise BadInputError(f"--seed must not be negative; got {self.seed}")
        (left, right), (engine, other) = self.files, self.engines
        if engine is not None and (left, engine) == (right, other):
            raise BadInputError(
                f"both sides are what {engine} itself makes of {left}: name two engines, or two "
                "files"
            )

    @property
    def labels(self) -> list[str]:
        """Both sides as one types them for a run."""
        sides = zip(self.files, self.engines, strict=True)
        return [f"{file}@{engine}" if engine else str(file) for file, engine in sides]


def answer(request: ModelsRequest, reporter: Reporter = QUIET) -> models.ModelsComparison:
    """Find every difference between two descriptions.

    Raises:
        StateMachineError: A file cannot be read, or an engine is missing.
    """
    with reporter.stage("compare"):
        return models.compare(
            *request.files,
            engines=request.engines,
            frames=request.frames,
            rename=request.names,
            seed=request.seed,
            menagerie=request.menagerie,
        )
