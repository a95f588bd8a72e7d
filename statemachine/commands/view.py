"""`statemachine view`: a running simulation in the browser, to look at and to touch."""

from __future__ import annotations

import argparse
import os
import signal
import socket
import sys
import threading
from contextlib import suppress
from typing import Any

from ..errors import BadInputError, TraceError, printable
from ..installed import DEFAULT
from ..typed_numbers import is_count, typed_float
from ._common import (
    PROGRAM,
    add_table,
    backend_of,
    chosen_backends,
    complain,
    menagerie,
    refuse,
    refuse_given,
)

_PORT = 8080
_MODEL = "so101/scene_box"


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Show a simulation in the browser at the pace of the clock, with a slider "
        "for each actuator; the other engine beside it as a ghost. Ctrl-C ends it."
    )
    add_table(
        parser,
        (
            "words",
            "TRACE|FILE",
            f"the model (default {_MODEL}); or a recording to play, a second one as the ghost, and "
            "the model if it is not its own",
            {"nargs": "*"},
        ),
        backend_of(
            f"an engine (default {DEFAULT}); a second one, under the same commands, is the ghost"
        ),
        (
            "--keyframe",
            "NAME|N",
            "where to start; 'default' is the default state (default: the first keyframe)",
        ),
        ("--site", "NAME", "the fingertip (default gripperframe, else the last site)"),
        ("--speed", "X", "times real time (1)", {"type": typed_float, "default": 1.0}),
        ("--paused", "", "let time stand at the start"),
        ("--port", "N", f"or the next free one ({_PORT})", {"default": _PORT}),
        (
            "--host",
            "ADDR",
            "listen there, for whoever reaches it (default: this machine only)",
            {"default": "127.0.0.1"},
        ),
        ("--open", "", "open the page in a browser here"),
        ("--seconds", "S", "end after so long"),
        *menagerie(),
    )


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from ..compare.sides import is_trace
    from ..view.server import free_port, require_viser
    from ..view.session import checked_speed

    require_viser()
    checked_speed(options.speed)
    traces = [word for word in options.words if is_trace(word)]
    models = [word for word in options.words if not is_trace(word)]
    refuse(
        (
            options.seconds is not None and not 0 < options.seconds < float("inf"),
            f"seconds must be above 0; got {options.seconds}",
        ),
        (len(traces) > 2, f"view shows one trace or two; got {len(traces)}"),
        (len(models) > 1, f"view shows one model; got {' and '.join(models)}"),
    )
    port, model = free_port(options.host, options.port), next(iter(models), None)
    if not traces:
        return _simulate(options, model or _MODEL, port)
    of_one = "{} is for a simulation, and a trace is a recording"
    refuse_given(options, ("backend", "keyframe", "site"), of_one)
    return _play(options, traces, model, port)


def _simulate(options: argparse.Namespace, name: str, port: int) -> int:
    """A session on one engine or two."""
    from ..backends.starts import overlap_warning, places_in
    from ..drawing import drawing_of
    from ..releases import engine_of
    from ..view.session import LiveSession

    chosen = chosen_backends(options.backend)
    if len(chosen) > 2:
        raise BadInputError(f"view shows one engine or two; got {len(chosen)}")
    models = [each.load_to_run(name, menagerie=options.menagerie) for each in chosen]
    keyframe = _keyframe(options.keyframe, models[0])
    if text := overlap_warning(models[0], places_in(models[0], keyframe)):
        complain(text, 0)
    engines = " and ".join(f"{engine_of(model.backend)} {model.engine_version}" for model in models)
    with LiveSession(models, keyframe, options.site) as session:
        _serve(options, session, drawing_of(models[0]), keyframe, port, f"{name} on {engines}")
    return 0


def _interrupts() -> list[int]:
    """A list that each Ctrl-C is noted in: NumPy swallows one that falls into a comparison."""
    noted: list[int] = []

    def note(number: int, frame: Any) -> None:
        noted.append(number)
        signal.default_int_handler(number, frame)

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, note)
    return noted


def _play(options: argparse.Namespace, traces: list[str], shown: str | None, port: int) -> int:
    """One recording or two."""
    from ..backends import load
    from ..drawing import drawing_of
    from ..runs import model_file, read
    from ..view.session import TraceSession

    recording = TraceSession([read(path) for path in traces])
    header = recording.header
    name = shown or header.provenance.model_file.removesuffix(".xml")
    file, same = (name, True) if shown else model_file(header, options.menagerie, traces[0])
    model = load(file, menagerie=options.menagerie)
    if not same:
        complain(f"shown is {name} as it is here; the trace was recorded with another", 0)
    if model.body_names != header.bodies:
        raise TraceError(f"the trace is of another model than {name}: name it behind the trace")
    what = f"{header.experiment or 'a run'} of {name}, recorded on {' and '.join(recording.labels)}"
    _serve(options, recording, drawing_of(model), None, port, what)
    return 0


def _keyframe(asked: str | None, model: Any) -> int | None:
    """Number of the keyframe to start from."""
    match asked:
        case None:
            return 0 if model.keyframes else None
        case "default":
            return None
    return model.key_id(int(asked) if is_count(asked) else asked)


def _serve(
    options: argparse.Namespace,
    session: Any,
    drawing: Any,
    keyframe: int | None,
    port: int,
    what: str,
) -> None:
    """Show a session until it is interrupted: the ordinary end of a server, no failure."""
    from ..view import server as serving
    from ..view.live import Live
    from ..view.viser_front import ViserFront

    server, door = None, serving.Door(options.host)
    session.set_speed(options.speed)
    try:
        server = serving.serve(options.host, port, f"{PROGRAM} view", door)
        front = ViserFront(server, session, drawing, keyframe)
        _announce(options, server.get_port(), door.token, what, drawing)
        if not options.paused:
            session.play()
        Live(session, front).run(options.seconds, _interrupts())
    except KeyboardInterrupt:
        if sys.stdout.isatty():
            print()  # after the terminal's ^C
    finally:
        if server is not None:
            with suppress(KeyboardInterrupt):  # a second one
                serving.stop(server)


def _announce(options: argparse.Namespace, port: int, token: str, what: str, drawing: Any) -> None:
    everywhere = options.host in ("0.0.0.0", "::")
    here = everywhere or options.host in ("127.0.0.1", "::1", "localhost")
    host = f"[{options.host}]" if ":" in options.host else options.host
    address = f"http://{'localhost' if here else host}:{port}/?token={token}"
    if options.port not in (0, port):
        print(f"port {options.port} is taken, so it is {port}")
    print(address)
    print(printable(f"shows {what}; Ctrl-C ends it"))
    if everywhere or not here:
        print(f"whoever has this address and reaches port {port} here can move the sliders")
    else:
        machine = socket.gethostname() if os.environ.get("SSH_CONNECTION") else "HOST"
        print("from another machine, first:")
        print(f"ssh -L {port}:localhost:{port} {machine}")
    for left_out in drawing.left_out:
        print(f"not drawn: {left_out}")
    sys.stdout.flush()  # a pipe is read while this runs
    if options.open:
        import webbrowser

        webbrowser.open(address)
