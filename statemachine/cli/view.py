"""`statemachine view`: a running simulation in the browser, to look at and to touch."""

from __future__ import annotations

import argparse
import os
import socket
import sys
from functools import partial
from typing import TYPE_CHECKING

from ..errors import BadInputError, printable
from ..installed import DEFAULT
from ..show.labels import TableLabels
from ..typed_numbers import typed_float, typed_int
from .common import PROGRAM, TerminalReporter, add_backend, add_menagerie, flag_of, is_given

if TYPE_CHECKING:
    from ..view.request import BrowserView, ServerSettings, SimulationRequest, TracesRequest

_SAY = TableLabels(__name__, "view_labels.md.j2")
_PORT = 8080
_MODEL = "so101/scene_box"


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Show a simulation in the browser at the pace of the clock, with a slider "
        "for each actuator; the other engine beside it as a ghost. Ctrl-C ends it."
    )
    parser.add_argument(
        "words",
        nargs="*",
        metavar="TRACE|FILE",
        help=f"the model (default {_MODEL}); or a recording to play, a second one as the ghost, "
        "and the model if it is not its own",
    )
    add_backend(
        parser,
        f"an engine (default {DEFAULT}); a second one, under the same commands, is the ghost",
    )
    parser.add_argument(
        "--keyframe",
        metavar="NAME|N",
        help="where to start; 'default' is the default state (default: the first keyframe)",
    )
    parser.add_argument(
        "--site",
        metavar="NAME",
        help="the fingertip (default gripperframe, else the last site)",
    )
    parser.add_argument(
        "--speed", type=typed_float, default=1.0, metavar="X", help="times real time (1)"
    )
    parser.add_argument("--paused", action="store_true", help="let time stand at the start")
    parser.add_argument(
        "--port",
        type=typed_int,
        default=_PORT,
        metavar="N",
        help=f"or the next free one ({_PORT})",
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDR",
        help="listen there, for whoever reaches it (default: this machine only)",
    )
    parser.add_argument("--open", action="store_true", help="open the page in a browser here")
    parser.add_argument("--seconds", type=typed_float, metavar="S", help="end after so long")
    add_menagerie(parser)


def settings_of(options: argparse.Namespace) -> ServerSettings:
    """Return how it is to be served.

    Raises:
        BadInputError: A number is out of range.
    """
    from ..view.request import ServerSettings

    return ServerSettings(
        speed=options.speed,
        paused=options.paused,
        host=options.host,
        port=options.port,
        seconds=options.seconds,
    )


def request_of(options: argparse.Namespace) -> SimulationRequest | TracesRequest:
    """Return what is to be shown.

    Raises:
        BadInputError: Too much is named, or an option is for a simulation and a trace is named.
        UnknownNameError: There is no such backend.
    """
    from ..lab.compare.what import is_trace
    from ..view.request import SimulationRequest, TracesRequest

    traces = [word for word in options.words if is_trace(word)]
    models = [word for word in options.words if not is_trace(word)]
    if len(models) > 1:
        raise BadInputError(f"view shows one model; got {' and '.join(models)}")
    model = models[0] if models else None
    if not traces:
        return SimulationRequest(
            model=model or _MODEL,
            backends=tuple(options.backend or [DEFAULT]),
            menagerie=options.menagerie,
            keyframe=options.keyframe,
            site=options.site,
        )
    for name in ("backend", "keyframe", "site"):
        if is_given(options, name):
            raise BadInputError(f"{flag_of(name)} is for a simulation, and a trace is a recording")
    return TracesRequest(tuple(traces), model, options.menagerie)


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from ..view.request import open_view
    from ..view.running import serve
    from ..view.server import free_port, require_viser

    require_viser()
    settings, request = settings_of(options), request_of(options)
    port = free_port(settings.host, settings.port)
    with open_view(request, TerminalReporter()) as view:
        try:
            serve(view, settings, port, f"{PROGRAM} view", partial(_announce, options, view))
        except KeyboardInterrupt:
            if sys.stdout.isatty():
                print()  # after the terminal's ^C
    return 0


def _announce(options: argparse.Namespace, view: BrowserView, port: int, token: str) -> None:
    """Print the address of the page, who can reach it, and what is not drawn."""
    everywhere = options.host in ("0.0.0.0", "::")
    is_local = everywhere or options.host in ("127.0.0.1", "::1", "localhost")
    host = f"[{options.host}]" if ":" in options.host else options.host
    address = f"http://{'localhost' if is_local else host}:{port}/?token={token}"
    if options.port not in (0, port):
        print(_SAY("taken", asked=options.port, port=port))
    print(address)
    print(printable(_SAY("shows", what=view.what)))
    if everywhere or not is_local:
        print(_SAY("open", port=port))
    else:
        machine = socket.gethostname() if os.environ.get("SSH_CONNECTION") else "HOST"
        print(_SAY("elsewhere"))
        print(f"ssh -L {port}:localhost:{port} {machine}")
    for left_out in view.drawing.left_out:
        print(printable(_SAY("left_out", what=left_out)))
    sys.stdout.flush()  # a pipe is read while this runs
    if options.open:
        import webbrowser

        webbrowser.open(address)
