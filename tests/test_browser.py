"""The browser that the tests look at pages with notices what it must."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from .browser import browser

pytestmark = pytest.mark.slow  # a browser or a renderer at work

PAGE = """<!doctype html><meta charset="utf-8"><title>t</title><link rel="icon" href="data:,">
<canvas id="c"></canvas><script>
const gl = document.getElementById('c').getContext('webgl2');
document.title = gl ? gl.getParameter(gl.VERSION) : 'no WebGL';
</script>"""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    """A folder with the page, over loopback."""
    (tmp_path / "good.html").write_text(PAGE)

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args, **kwargs) -> None:
            super().__init__(*args, directory=str(tmp_path), **kwargs)

        def log_message(self, format: str, *args: object) -> None: ...

    serving = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=serving.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{serving.server_address[1]}"
    serving.shutdown()
    serving.server_close()


def test_a_good_page_passes_and_has_webgl(tmp_path: Path, server: str) -> None:
    with browser() as tab:
        tab.goto(f"{server}/good.html")
        assert "WebGL 2" in tab.title()
        assert tab.requests[0] == f"{server}/good.html"
        tab.nothing_wrong()
    with browser(offline=True) as tab:
        tab.goto((tmp_path / "good.html").as_uri())
        assert "WebGL 2" in tab.title()
        tab.nothing_wrong()


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("<script>console.error('oh')</script>", "error: oh"),
        ("<script>undefined.x</script>", "raised: "),
        ("<img src='gone.png'>", "404"),
        ("<img src='http://outside.invalid/a.png'>", "outside.invalid"),
    ],
)
def test_a_bad_page_does_not(tmp_path: Path, server: str, body: str, words: str) -> None:
    (tmp_path / "bad.html").write_text(f"{PAGE}{body}")
    with browser() as tab:
        tab.goto(f"{server}/bad.html", wait_until="load")
        with pytest.raises(AssertionError):
            tab.nothing_wrong()
        assert any(words in found for found in (*tab.errors, *tab.outside))
