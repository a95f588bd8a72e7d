"""The browser that the tests look at pages with notices what it must."""

from __future__ import annotations

from pathlib import Path

import pytest

from .support.browser import browser
from .support.claims import refused
from .support.files import written

pytestmark = pytest.mark.slow  # a browser or a renderer at work

PAGE = """<!doctype html><meta charset="utf-8"><title>t</title><link rel="icon" href="data:,">
<canvas id="c"></canvas><script>
const gl = document.getElementById('c').getContext('webgl2');
document.title = gl ? gl.getParameter(gl.VERSION) : 'no WebGL';
</script>"""


@pytest.mark.parametrize("offline", [False, True])
def test_a_good_page_passes_and_has_webgl(tmp_path: Path, offline: bool) -> None:
    page = written(tmp_path / "good.html", PAGE).as_uri()
    with browser(offline=offline) as tab:
        tab.goto(page)
        assert "WebGL 2" in tab.title()
        assert tab.requests[0] == page
        tab.nothing_wrong()


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("<script>console.error('oh')</script>", "error: oh"),
        ("<script>undefined.x</script>", "raised: "),
        ("<img src='gone.png'>", "gone.png"),
        ("<img src='http://outside.invalid/a.png'>", "outside.invalid"),
    ],
)
def test_a_bad_page_fails(tmp_path: Path, body: str, words: str) -> None:
    page = written(tmp_path / "bad.html", f"{PAGE}{body}").as_uri()
    with browser() as tab:
        tab.goto(page, wait_until="load")
        refused((AssertionError, "", tab.nothing_wrong))
        assert any(words in found for found in (*tab.errors, *tab.outside))
