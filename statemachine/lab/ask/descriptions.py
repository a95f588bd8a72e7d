"""What two descriptions of a robot differ in, before anything moves."""

from __future__ import annotations

import os
from collections.abc import Mapping

from ...errors import BadInputError
from ...installed import DEFAULT
from ...interface import Model
from ...models import AnyPath
from ..compare.sides import Side
from ..questions.requests.models import ModelsRequest, ModelsResult, answer
from ..runs.reporter import QUIET, Reporter
from .arguments import AnySide, check_alone, side_of


def models(
    left: ModelsRequest | AnySide,
    right: AnySide | None = None,
    *,
    backends: tuple[str, str] | None = None,
    names: Mapping[str, str] | None = None,
    frames: Mapping[str, str] | None = None,
    seed: int = 0,
    menagerie: AnyPath | None = None,
    write: AnyPath | None = None,
    reporter: Reporter = QUIET,
) -> ModelsResult:
    """Return every difference between two descriptions of a robot, before anything moves.

        lab.models("a.xml", "b.urdf").to_dict()["quantity"]

    Args:
        left: A name or a path, URDF or MJCF, for what the file says; "FILE@ENGINE" for what an
            engine itself makes of it; or a loaded Model, whose file is meant, which must have no
            options of its own. Or a ModelsRequest, which says all that is asked.
        right: The other; None for the same file, with two `backends`.
        backends: The engine that is asked of each file; None for the files themselves.
        names: Joints, links and frames of the left by the names that the right has.
        frames: Frames of the left by the names that the right has.
        seed: Of the poses at which both are compared, at least 0.
        menagerie: A menagerie folder to look names up in; None for $MENAGERIE.
        write: Where the right's file is written with the left's values; None for nowhere.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a side has options of a run.
        StateMachineError: A file cannot be read, or an engine is missing.
    """
    if isinstance(left, ModelsRequest):
        check_alone(models, locals())
        return answer(left, reporter)
    if right is None:
        if backends is None:
            raise BadInputError(
                "name two descriptions, or one and backends=(A, B): what each engine makes of it"
            )
        right = left
    files = _described(left, menagerie), _described(right, menagerie)
    engines = files[0][1], files[1][1]
    if backends is not None:
        if any(engines):
            raise BadInputError("backends and FILE@ENGINE say the same: give one of them")
        engines = backends
    request = ModelsRequest(
        models=(files[0][0], files[1][0]),
        engines=engines,
        names={} if names is None else names,
        frames={} if frames is None else frames,
        seed=seed,
        menagerie=menagerie,
        write=write,
    )
    return answer(request, reporter)


def _described(side: AnySide, menagerie: AnyPath | None) -> tuple[str, str | None]:
    """Return the file of a side, and the engine that is asked of it; None for the file itself.

    Raises:
        BadInputError: It has options of a run.
    """
    described = side_of(side, menagerie)
    if described.options:
        raise BadInputError(
            f"models compares what files say, and {described.label} has options of a run: "
            "compare runs it with them"
        )
    return described.model, _engine(side, described)


def _engine(side: AnySide, described: Side) -> str | None:
    """Return the engine that is asked of a file; None for the file itself."""
    if isinstance(side, Model):
        return None if side.backend == DEFAULT else side.backend
    is_file = isinstance(side, str | os.PathLike) and described.model == os.fspath(side)
    return None if is_file else described.engine
