"""`statemachine view`: a running simulation in the browser, to look at and to touch."""

from __future__ import annotations

import argparse
import os
import socket
import sys
from contextlib import suppress
from typing import Any

from ._common import PROGRAM, add_backend, add_menagerie, add_model

_PORT = 8080


def add(commands: Any) -> None:
    """The subparser."""
    parser = commands.add_parser(
        "view",
        help="a running simulation in the browser, with sliders",
        description="Show a simulation in the browser at the pace of the clock, with a slider "
        "for each actuator; the other engine beside it as a ghost. Ctrl-C ends it.",
    )
    add_model(parser, "so101/scene_box")
    add_backend(parser, everyone=False)
    parser.add_argument(
        "--ghost", metavar="NAME", help="another engine, under the same commands, seen through"
    )
    parser.add_argument(
        "--keyframe",
        metavar="NAME|N",
        help="where to start; 'default' is the default state (default: the first keyframe)",
    )
    parser.add_argument(
        "--site", metavar="NAME", help="the fingertip (default gripperframe, else the last site)"
    )
    parser.add_argument("--speed", type=float, default=1.0, metavar="X", help="times real time (1)")
    parser.add_argument("--paused", action="store_true", help="let time stand at the start")
    parser.add_argument(
        "--port", type=int, default=_PORT, metavar="N", help=f"or the next free one ({_PORT})"
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDR",
        help="listen there, for whoever reaches it (default: this machine only)",
    )
    parser.add_argument("--open", action="store_true", help="open the page in a browser here")
    parser.add_argument("--seconds", type=float, metavar="S", help="end after so long")
    add_menagerie(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from ..backends import load
    from ..drawing import drawing_of
    from ..view.pace import checked_speed
    from ..view.server import free_port, require_viser
    from ..view.session import Session

    require_viser()
    checked_speed(options.speed)
    port = free_port(options.host, options.port)
    names = [options.backend, *([options.ghost] if options.ghost else [])]
    models = [load(options.model, backend=name, menagerie=options.menagerie) for name in names]
    keyframe = _keyframe(options.keyframe, models[0])
    drawing = drawing_of(models[0])
    with Session(models, keyframe, options.site) as session:
        engines = " and ".join(f"{model.backend} {model.engine_version}" for model in models)
        _serve(options, session, drawing, keyframe, port, f"{options.model} on {engines}")
    return 0


def _keyframe(asked: str | None, model: Any) -> int | None:
    """Number of the keyframe to start from."""
    if asked is None:
        return 0 if model.keyframes else None
    if asked == "default":
        return None
    return model.key_id(int(asked) if asked.isdecimal() else asked)


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
    from ..view.frames import Run
    from ..view.live import Live
    from ..view.viser_front import ViserFront

    server = None
    try:
        server = serving.serve(options.host, port, f"{PROGRAM} view")
        front = ViserFront(server, session, drawing, options.speed, keyframe)
        _announce(options, server.get_port(), what, drawing)
        if not options.paused:
            session.apply(Run())
        Live(session, front, options.speed).run(options.seconds)
    except KeyboardInterrupt:
        if sys.stdout.isatty():
            print()  # after the terminal's ^C
    finally:
        if server is not None:
            with suppress(KeyboardInterrupt):  # a second one
                serving.stop(server)


def _announce(options: argparse.Namespace, port: int, what: str, drawing: Any) -> None:
    if options.port not in (0, port):
        print(f"port {options.port} is taken, so it is {port}")
    local = options.host in ("127.0.0.1", "0.0.0.0", "localhost", "::1", "::")
    host = "localhost" if local else options.host
    address = f"http://{f'[{host}]' if ':' in host else host}:{port}"
    print(f"{address} shows {what}; Ctrl-C ends it")
    machine = "HOST" if not os.environ.get("SSH_CONNECTION") else socket.gethostname()
    if local:
        print(f"from another machine: ssh -L {port}:localhost:{port} {machine}, then {address}")
    for left_out in drawing.left_out:
        print(f"not drawn: {left_out}")
    sys.stdout.flush()  # a pipe is read while this runs
    if options.open:
        import webbrowser

        webbrowser.open(address)
