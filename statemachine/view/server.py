"""A quiet viser server that listens where it is told to and asks nobody for anything."""

from __future__ import annotations

import errno
import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from types import ModuleType
from typing import Any

from ..errors import BadInputError, MissingEngineError
from ..installed import require_extra
from .door import Door

LOOPBACK = "127.0.0.1"
_PORTS = 100  # tried one after another


def require_viser() -> ModuleType:
    """The package viser.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    viser: ModuleType = require_extra("viser", "view", "viser", "view")
    return viser


def free_port(host: str, port: int) -> int:
    """The first free port from this one on; 0 stands for any.

    Raises:
        BadInputError: It is no port, the host is no address of this machine, or all near it
            are taken.
    """
    if not 0 <= port <= 65535:
        raise BadInputError(f"port must be from 0 to 65535; got {port}")
    if not host.strip():  # which would mean everywhere
        raise BadInputError("host must be an address; 127.0.0.1 is this machine alone")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError) as error:
        raise BadInputError(f"host {host!r} is no address: {error}") from None
    last: OSError | None = None
    for candidate in range(port, min(port + _PORTS, 65536)):
        with socket.socket(family, kind, protocol) as trial:
            if os.name == "posix":  # elsewhere this would take a port from its owner
                trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                trial.bind((address[0], candidate, *address[2:]))
            except OSError as error:
                last = error
                # Windows says WSAEADDRINUSE.
                if error.errno not in (errno.EADDRINUSE, 10048):
                    break
            else:
                return int(trial.getsockname()[1])
    raise BadInputError(f"cannot listen on {host}, port {port}: {last}")


def serve(host: str, port: int, label: str, door: Door) -> Any:
    """A viser server on a port that is free, without its banner and without its tunnel.

    Args:
        host: Where it listens.
        port: A free one.
        label: Of the page.
        door: Asked about every request, before viser is.

    Raises:
        MissingEngineError: viser is not installed, or not one that can be guarded.
    """
    viser = require_viser()
    # Who connects and says nothing, as browsers do to be quick, is no news for a terminal.
    logging.getLogger("websockets").addHandler(logging.NullHandler())
    os.environ.pop("_VISER_PORT_OVERRIDE", None)  # by which viser takes another port than asked
    with redirect_stdout(StringIO()), _guarded(door) as guarded:
        server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    if not guarded:
        stop(server)
        raise MissingEngineError(
            f"viser {viser.__version__} opens its server in another way than this version "
            "of statemachine knows, and would let everybody in: pip install 'viser<1.2'",
            engine="viser",
        )
    # A tab can ask viser to open a tunnel to a server of its makers: not from here.
    server.request_share_url = lambda verbose=True: None
    server.disconnect_share_url = lambda: None
    return server


def stop(server: Any) -> None:
    """Close the connections and free the port; nothing is printed."""
    with redirect_stdout(StringIO()):
        server.stop()


@contextmanager
def _guarded(door: Door) -> Iterator[list[Any]]:
    """While viser opens its server, put a door before it.

    viser answers requests in a function that it hands to websockets, and offers no place for
    another. So the call that opens the server is replaced for as long as viser makes it.

    Yields:
        The functions that were guarded; none if viser did not make that call.
    """
    from websockets.asyncio import server as websockets

    guarded: list[Any] = []
    plain = websockets.serve

    def serve(*arguments: Any, process_request: Any, **others: Any) -> Any:
        guarded.append(process_request)
        return plain(*arguments, process_request=door.guard(process_request), **others)

    websockets.serve = serve  # type: ignore[assignment]
    try:
        yield guarded
    finally:
        websockets.serve = plain
