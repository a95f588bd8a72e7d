"""Which places are certified, and the certificates."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

from ...backends import BackendChoice
from ...backends.chosen import chosen_backends
from ...errors import BadInputError, EngineWarning, ModelError, StateMachineError
from ...installed import DEFAULT
from ...interface import Model
from ...models import AnyPath
from ..runs.drive import Progress
from ..runs.each_backend import load_on, on_each_backend
from ..runs.reporter import QUIET, Reporter
from .fingertip import certify
from .fingertip_poses import checked_poses
from .fingertip_result import FingertipResult

# Where an error begins to say what to type or to write, which is done here.
_ADVICE = ("; load(", "; give ")


@dataclass(frozen=True)
class FingertipRequest:
    """Question how far places on engines are from the witness's.

    Attributes:
        model: A name or a file of a model.
        backends: As `parse_backend` reads them; "all" for those that are installed.
        menagerie: A menagerie folder to look the model's name up in.
        poses: Number of poses, at least 2: the default pose, then random ones.
        seed: Of the random poses, at least 0.
        site: Site or body on the engine; None for gripperframe if there is one, else for every
            body at an end.
        witness: File that the witness reads; None for the model's own.
        witness_frame: Name of the frame there; None for `site`.
    """

    model: AnyPath = "so101"
    backends: tuple[str, ...] = (DEFAULT,)
    menagerie: AnyPath | None = None
    poses: int = 200
    seed: int = 0
    site: str | None = None
    witness: AnyPath | None = None
    witness_frame: str | None = None

    def __post_init__(self) -> None:
        if not self.backends:
            raise BadInputError("no backend is named: name one, or all")
        chosen_backends(self.backends)
        checked_poses(self.poses, self.seed)


def answer(request: FingertipRequest, reporter: Reporter = QUIET) -> dict[str, FingertipResult]:
    """Return a certificate for each backend.

    Places need no masses, inertias or meshes: a file that is refused for one of them is read all
    the same, and the certificate says so.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or the witness is not.
        StateMachineError: The model cannot be loaded, or as `certify` does.
    """
    refusals: dict[str, str] = {}

    def load(backend: BackendChoice, model: AnyPath, menagerie: AnyPath | None) -> Model:
        try:
            return load_on(backend, model, menagerie)
        except ModelError as error:
            mended = _load_for_places(backend, model, menagerie)
            if mended is None:
                raise
            reason = str(error)
            for advice in _ADVICE:
                reason = reason.partition(advice)[0]
            refusals[str(backend)] = reason
            return mended

    def compute(model: Model, backend: str, progress: Progress) -> FingertipResult:
        result = certify(
            model,
            poses=request.poses,
            seed=request.seed,
            site=request.site,
            witness=request.witness,
            witness_frame=request.witness_frame,
            progress=progress,
        )
        return replace(result, refusal=refusals.get(backend, ""))

    return on_each_backend(
        request.backends,
        "fingertip",
        request.model,
        request.menagerie,
        compute,
        reporter,
        load,
    )


def _load_for_places(
    backend: BackendChoice, model: AnyPath, menagerie: AnyPath | None
) -> Model | None:
    """Return a refused model as it is read for its places alone; None if it cannot be read so.

    What that changes is in the certificate, so no warning tells of it.
    """
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        try:
            return backend.load_for_places(model, menagerie=menagerie)
        except StateMachineError:
            return None
