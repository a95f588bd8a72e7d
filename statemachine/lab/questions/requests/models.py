"""What two descriptions of a robot differ in, before anything moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ....errors import BadInputError
from ....models import AnyPath
from ... import model_differences
from ...runs.reporter import QUIET, Reporter


@dataclass(frozen=True)
class ModelsRequest:
    """Question what two descriptions of a robot differ in.

    Attributes:
        models: A name or a path of each, URDF or MJCF, as `load` takes it.
        engines: For each the engine that it is asked of; None for the file itself.
        frames: Frames of the left that go by other names on the right.
        names: Joints, links and frames of the left that go by other names on the right.
        seed: Of the poses at which both are compared, at least 0.
        menagerie: A menagerie folder to look names up in.
    """

    models: tuple[AnyPath, AnyPath]
    engines: tuple[str | None, str | None] = (None, None)
    frames: Mapping[str, str] = field(default_factory=dict[str, str])
    names: Mapping[str, str] = field(default_factory=dict[str, str])
    seed: int = 0
    menagerie: AnyPath | None = None

    def __post_init__(self) -> None:
        if len(self.models) != 2 or len(self.engines) != 2:
            raise BadInputError(f"two files are compared, each of one engine or none; got {self}")
        if self.seed < 0:
            raise BadInputError(f"--seed must not be negative; got {self.seed}")
        left, right = zip(self.models, self.engines, strict=True)
        if left == right and left[1] is not None:
            raise BadInputError(
                f"both sides are what {left[1]} itself makes of {left[0]}: "
                "name two engines, or two files"
            )

    @property
    def labels(self) -> list[str]:
        """Both sides as one types them for a run."""
        sides = zip(self.models, self.engines, strict=True)
        return [f"{model}@{engine}" if engine else str(model) for model, engine in sides]


def answer(
    request: ModelsRequest, reporter: Reporter = QUIET
) -> model_differences.ModelsComparison:
    """Find every difference between two descriptions.

    Raises:
        StateMachineError: A file cannot be read, or an engine is missing.
    """
    with reporter.stage("compare"):
        return model_differences.compare(
            *request.models,
            engines=request.engines,
            frames=request.frames,
            rename=request.names,
            seed=request.seed,
            menagerie=request.menagerie,
        )
