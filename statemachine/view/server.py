"""A quiet viser server, which listens where it is told to, and who may look at it.

It asks nobody for anything; each request is asked for the token of the address that was printed.
"""

from __future__ import annotations

import errno
import http
import ipaddress
import logging
import os
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from http.cookies import CookieError, SimpleCookie
from io import StringIO
from types import ModuleType
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from ..errors import BadInputError, MissingEngineError
from ..installed import require_extra

if TYPE_CHECKING:
    import viser

_PORTS = 100  # tried one after another
_SAY = "open the address that `statemachine view` printed, with its token\n"


class Door:
    """Guard that lets in who knows the token, under a name of this machine, and from its own page.

    A page of another site can make a browser connect to this machine, and can give its own
    name this machine's address; neither knows the token. The address that is printed holds it,
    and the page that is opened there keeps it as a cookie, which its websocket sends along.

    Attributes:
        token: What the address must say; drawn anew for each viewer.
    """

    def __init__(self, host: str) -> None:
        """Make the door of a server that listens on this host, given by name or by address."""
        self.token = secrets.token_urlsafe(16)
        machine = socket.gethostname().lower()
        self._names = {host.lower().strip("[]"), "localhost", machine, f"{machine}.local"}

    def refusal(self, path: str, headers: Any, port: int) -> str:
        """Return the reason why a request is refused, or "".

        Args:
            path: Its path and query.
            headers: Its headers, with `get_all`.
            port: On which it came in.
        """
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return "not under this name\n"
        # A tunnel may give the port another number: the page's own host is what it must be.
        own = (f"http://{hosts[0]}", f"https://{hosts[0]}")
        if len(origins) > 1 or (origins and origins[0].lower() not in map(str.lower, own)):
            return "not from a page of another site\n"
        tokens = [*parse_qs(urlsplit(path).query).get("token", ()), *self._cookies(headers, port)]
        known = self.token.encode()
        if not any(secrets.compare_digest(token.encode(), known) for token in tokens):
            return _SAY
        return ""

    def cookie(self, port: int) -> str:
        """Return the header Set-Cookie with which a page that was opened keeps the token."""
        return f"{_name(port)}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    def _is_ours(self, host: str) -> bool:
        """Tell whether a header Host names this machine: no name that a stranger may point to
        it.
        """
        try:
            name = urlsplit(f"//{host}").hostname or ""
            if name not in self._names:
                ipaddress.ip_address(name)  # in numbers, which nobody can point elsewhere
        except ValueError:
            return False
        return True

    def _cookies(self, headers: Any, port: int) -> list[str]:
        tokens = []
        for header in headers.get_all("Cookie"):
            with suppress(CookieError, KeyError):  # it is invalid, or has no token of ours
                tokens.append(SimpleCookie(header)[_name(port)].value)
        return tokens

    def guard(self, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """Return a `process_request` of websockets that asks this door first, then the given
        one.
        """

        def process(connection: Any, request: Any) -> Any:
            port = connection.local_address[1]
            refusal = self.refusal(request.path, request.headers, port)
            if refusal:
                return connection.respond(http.HTTPStatus.FORBIDDEN, refusal)
            response = answer(connection, request)
            if response is not None:
                response.headers["Set-Cookie"] = self.cookie(port)
                response.headers["Referrer-Policy"] = "no-referrer"
            return response

        return process


def _name(port: int) -> str:
    # Cookies do not keep ports apart, and two viewers may run.
    return f"statemachine-view-{port}"


def require_viser() -> ModuleType:
    """Return the package viser.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    return require_extra("viser", "view", "viser", "view")


def free_port(host: str, port: int) -> int:
    """Return the first free port from this one on; 0 stands for any.

    Raises:
        BadInputError: It is not a port, the host is not an address of this machine, or all near it
            are taken.
    """
    if not 0 <= port <= 65535:
        raise BadInputError(f"port must be from 0 to 65535; got {port}")
    if not host.strip():  # which would mean everywhere
        raise BadInputError("host must be an address; 127.0.0.1 is this machine alone")
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError) as error:
        raise BadInputError(f"host {host!r} is not an address: {error}") from None
    last: OSError | None = None
    for candidate in range(port, min(port + _PORTS, 65536)):
        try:
            with socket.create_server(
                (address[0], candidate, *address[2:]), family=family
            ) as trial:
                return int(trial.getsockname()[1])
        except OSError as error:
            last = error
            # Windows says WSAEADDRINUSE.
            if error.errno not in (errno.EADDRINUSE, 10048):
                break
    raise BadInputError(f"cannot listen on {host}, port {port}: {last}")


def serve(host: str, port: int, label: str, door: Door) -> viser.ViserServer:
    """Start a viser server on a port that is free, without its banner and without its tunnel.

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


def stop(server: viser.ViserServer) -> None:
    """Close the connections and free the port; nothing is printed."""
    with redirect_stdout(StringIO()):
        server.stop()


@contextmanager
def _guarded(door: Door) -> Iterator[list[Any]]:
    """Put a door before viser's server while viser opens it.

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
