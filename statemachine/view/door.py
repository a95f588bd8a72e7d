"""Who may look at a viewer and move its sliders: what is asked of each request."""

from __future__ import annotations

import http
import ipaddress
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

_SAY = "open the address that `statemachine view` printed, with its token\n"


class Door:
    """Lets in who knows the token, under a name of this machine, and from its own page.

    A page of another site can make a browser connect to this machine, and can give its own
    name this machine's address; neither knows the token. The address that is printed holds it,
    and the page that is opened there keeps it as a cookie, which its websocket sends along.

    Attributes:
        token: What the address must say; drawn anew for each viewer.
    """

    def __init__(self, host: str) -> None:
        """For a server that listens on this host, by name or by address."""
        self.token = secrets.token_urlsafe(16)
        machine = socket.gethostname().lower()
        self._names = {host.lower().strip("[]"), "localhost", machine, f"{machine}.local"}

    def refusal(self, path: str, headers: Any, port: int) -> str:
        """Why a request is refused, or "".

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
        said = [*parse_qs(urlsplit(path).query).get("token", ()), *self._cookies(headers, port)]
        known = self.token.encode()
        if not any(secrets.compare_digest(each.encode(), known) for each in said):
            return _SAY
        return ""

    def cookie(self, port: int) -> str:
        """The header Set-Cookie with which a page that was opened keeps the token."""
        return f"{_name(port)}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    def _is_ours(self, host: str) -> bool:
        """Whether a header Host names this machine: no name that a stranger may point to it."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
            if name not in self._names:
                ipaddress.ip_address(name)  # in numbers, which nobody can point elsewhere
        except ValueError:
            return False
        return True

    def _cookies(self, headers: Any, port: int) -> list[str]:
        found = []
        for header in headers.get_all("Cookie"):
            with suppress(CookieError, KeyError):  # it is none, or has not ours
                found.append(SimpleCookie(header)[_name(port)].value)
        return found

    def guard(self, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """A `process_request` of websockets that asks here first, then the one that is given."""

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
