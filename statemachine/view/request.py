"""What is shown in the browser: a simulation or recordings, and how it is served."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..backends import load
from ..backends.chosen import chosen_backends
from ..backends.starts import overlap_warning, places_in
from ..errors import BadInputError, TraceError
from ..installed import DEFAULT
from ..interface import Model
from ..lab.recordings import model_file, read
from ..lab.runs.reporter import QUIET, Reporter
from ..models import AnyPath
from ..release_names import engine_of
from ..show.drawing import Drawing, drawing_of
from ..typed_numbers import is_count
from .live_session import LiveSession
from .session import Session, checked_speed
from .trace_session import TraceSession

DEFAULT_STATE = "default"  # a keyframe's name that stands for the default state


@dataclass(frozen=True)
class SimulationRequest:
    """Simulation that is to be shown.

    Attributes:
        model: A name or a file of a model.
        backends: One, as `parse_backend` reads it; or two, of which the second is the ghost, under
            the same commands.
        menagerie: A menagerie folder to look the model's name up in.
        keyframe: Name or number of the keyframe where it starts; "default" for the default state;
            None for the first keyframe if there is one.
        site: The fingertip; None for gripperframe if there is one, else for the last site.
    """

    model: AnyPath = "so101/scene_box"
    backends: tuple[str, ...] = (DEFAULT,)
    menagerie: AnyPath | None = None
    keyframe: str | None = None
    site: str | None = None

    def __post_init__(self) -> None:
        count = len(chosen_backends(self.backends))
        if not 1 <= count <= 2:
            raise BadInputError(f"view shows one engine or two; got {count}")


@dataclass(frozen=True)
class TracesRequest:
    """Recorded runs that are to be shown.

    Attributes:
        files: A trace; or two, of which the second is the ghost.
        model: A name or a file of the model to show them with; None for the trace's own.
        menagerie: A menagerie folder to look the model up in.
    """

    files: tuple[AnyPath, ...]
    model: AnyPath | None = None
    menagerie: AnyPath | None = None

    def __post_init__(self) -> None:
        if not 1 <= len(self.files) <= 2:
            raise BadInputError(f"view shows one trace or two; got {len(self.files)}")


_LAST_PORT = 65535


@dataclass(frozen=True)
class ServerSettings:
    """How something is shown, and to whom.

    Attributes:
        speed: Times real time.
        paused: Whether time stands at the start.
        host: Address to listen on; by default this machine alone reaches it.
        port: To listen on, or the next free one; 0 for any.
        seconds: After so long it ends [s of the clock]; None for when it is interrupted.
    """

    speed: float = 1.0
    paused: bool = False
    host: str = "127.0.0.1"
    port: int = 8080
    seconds: float | None = None

    def __post_init__(self) -> None:
        checked_speed(self.speed)
        if self.seconds is not None and not 0 < self.seconds < math.inf:
            raise BadInputError(f"seconds must be above 0; got {self.seconds}")
        if not 0 <= self.port <= _LAST_PORT:
            raise BadInputError(f"port must be from 0 to {_LAST_PORT}; got {self.port}")


@dataclass(frozen=True, eq=False)
class BrowserView:
    """What is shown in the browser.

    Attributes:
        session: The simulation, or the recordings.
        drawing: What the robot looks like.
        keyframe: Number of the keyframe where it starts; None for none.
        what: What it is, in words.
    """

    session: Session
    drawing: Drawing
    keyframe: int | None
    what: str


@contextmanager
def open_view(
    request: SimulationRequest | TracesRequest, reporter: Reporter = QUIET
) -> Iterator[BrowserView]:
    """Open what is to be shown, and close it at the end of the block.

    Raises:
        TraceError: A file is not a trace, or a trace is not of the model.
        StateMachineError: The model cannot be loaded, or has no such keyframe or site.
    """
    if isinstance(request, TracesRequest):
        yield _recording(request, reporter)
        return
    chosen = chosen_backends(request.backends)
    models = [each.load_to_run(request.model, menagerie=request.menagerie) for each in chosen]
    keyframe = _keyframe(request.keyframe, models[0])
    if text := overlap_warning(models[0], places_in(models[0], keyframe)):
        reporter.note(text)
    engines = " and ".join(f"{engine_of(model.backend)} {model.engine_version}" for model in models)
    with LiveSession(models, keyframe, request.site) as session:
        yield BrowserView(session, drawing_of(models[0]), keyframe, f"{request.model} on {engines}")


def _recording(request: TracesRequest, reporter: Reporter) -> BrowserView:
    """Open recorded runs."""
    session = TraceSession([read(path) for path in request.files])
    header = session.header
    if request.model is None:
        name = header.provenance.model_file.removesuffix(".xml")
        file, is_same = model_file(header, request.menagerie, request.files[0])
        model = load(file, menagerie=request.menagerie)
        if not is_same:
            reporter.note(f"shown is {name} as it is here; the trace was recorded with another")
    else:
        name = str(request.model)
        model = load(request.model, menagerie=request.menagerie)
    if model.body_names != header.bodies:
        raise TraceError(f"the trace is of another model than {name}: name its own after the trace")
    run = f"{header.experiment or 'a run'} of {name}"
    what = f"{run}, recorded on {' and '.join(session.labels)}"
    return BrowserView(session, drawing_of(model), None, what)


def _keyframe(name: str | None, model: Model) -> int | None:
    """Return the number of the keyframe to start from; None for the default state."""
    if name is None:
        return 0 if model.keyframes else None
    if name == DEFAULT_STATE:
        return None
    return model.key_id(int(name) if is_count(name) else name)
