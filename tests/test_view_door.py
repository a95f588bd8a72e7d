"""Who gets to see the viewer's page and to speak to its websocket."""

from __future__ import annotations

import asyncio
import http.client
from collections.abc import Iterator
from unittest.mock import Mock

import pytest

from statemachine.errors import MissingEngineError
from statemachine.view.server import Door

from .support.claims import assert_in, refused
from .support.viewer import served as served_behind

pytestmark = pytest.mark.usefixtures("viser")


class Served:
    """An empty page behind a door."""

    def __init__(self, door: Door, port: int) -> None:
        self.door, self.port, self.own = door, port, f"localhost:{port}"
        self.cookie = door.cookie(port).partition(";")[0]

    def get(self, path: str, host: str | None = None, **headers: str) -> http.client.HTTPResponse:
        """Ask for a page, under a name."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.putrequest("GET", path, skip_host=True)
        connection.putheader("Host", host or self.own)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        response = connection.getresponse()
        response.read()
        return response

    def connects(self, path: str = "/", host: str | None = None, **headers: str) -> bool:
        """Tell whether a websocket opens, as viser's page would open it."""
        import viser
        import websockets

        async def attempt() -> bool:
            try:
                async with websockets.connect(
                    f"ws://{host or self.own}{path}",
                    host="127.0.0.1",
                    port=self.port,
                    subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
                    additional_headers=headers,
                    max_size=None,
                    proxy=None,
                ) as socket:
                    return bool(await asyncio.wait_for(socket.recv(), 10))
            except websockets.InvalidStatus as error:
                if error.response.status_code != 403:
                    raise
                return False

        return asyncio.run(attempt())


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    door = Door("127.0.0.1")
    with served_behind(door) as server:
        yield Served(door, server.get_port())


def test_the_address_with_its_token_opens_the_page(served: Served) -> None:
    opened = served.get(f"/?token={served.door.token}")
    assert opened.status == 200
    kept = opened.headers["Set-Cookie"]
    assert_in(kept, "HttpOnly", "SameSite=Strict")
    cookie = kept.partition(";")[0]
    assert served.get("/", Cookie=cookie).status == 200
    assert served.connects(Cookie=cookie, Origin=f"http://{served.own}")
    assert served.connects(f"/?token={served.door.token}")  # a program, which has no page
    # Through a tunnel the page may be at another port of the same machine.
    assert served.connects(host="localhost:9", Cookie=cookie, Origin="http://localhost:9")


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=wrong", "/index.html", "/nothing"])
def test_without_the_token_there_is_nothing(served: Served, path: str) -> None:
    answer = served.get(path)
    assert (answer.status, answer.headers["Set-Cookie"]) == (403, None)
    assert not served.connects(path, Origin=f"http://{served.own}")


@pytest.mark.parametrize(
    "origin", ["https://evil.example", "http://localhost:1", "null", "", "http://127.0.0.1"]
)
def test_a_page_of_another_site_is_refused(served: Served, origin: str) -> None:
    assert not served.connects(Cookie=served.cookie, Origin=origin)
    assert served.get("/", Cookie=served.cookie, Origin=origin).status == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example:80", "127.0.0.1.evil.example"]
)
def test_a_name_that_is_not_this_machine_is_refused(served: Served, host: str) -> None:
    """A stranger's name may be given this machine's address while its page is open."""
    assert served.get("/", host, Cookie=served.cookie).status == 403
    assert not served.connects(host=host, Cookie=served.cookie, Origin=f"http://{host}")


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "[::1]:{}", "LOCALHOST:{}", "192.0.2.7"])
def test_names_and_numbers_of_this_machine_are_taken(served: Served, host: str) -> None:
    assert served.get("/", host.format(served.port), Cookie=served.cookie).status == 200


def test_a_viser_that_cannot_be_guarded_is_not_served(monkeypatch: pytest.MonkeyPatch) -> None:
    import viser

    other = Mock(return_value=Mock(spec=["stop"]))  # without what a door is put into
    monkeypatch.setattr(viser, "ViserServer", other)
    refused((MissingEngineError, "let everybody in", served_behind().__enter__))
    other().stop.assert_called_once_with()
