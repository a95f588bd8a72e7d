"""A real browser without a screen, for what is made to be looked at in one.

with browser() as page:
    page.goto(path.as_uri())
    ...
    page.nothing_wrong()
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from .requirements import absent

_NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
_QUIET = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-default-apps",
    # WebGL without a graphics card.
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
# What a browser has against drawing without a graphics card is not a fault of a page.
_SLOW_CARD = ("GPU stall", "GL Driver Message", "software WebGL", "swiftshader")
_LOCAL, _INSIDE = ("127.0.0.1", "localhost", "::1"), ("data", "blob", "file", "about")


class Tab:
    """A page, and what went on while it was open.

    Attributes:
        page: Playwright's own.
        requests: Every address that it asked for, in order, web sockets among them; those
            that were refused too.
        errors: What the console called an error or a warning, what was raised and not
            caught, and what did not load.
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self.requests: list[str] = []
        self.errors: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda socket: self.requests.append(socket.url))
        page.on("pageerror", lambda error: self.errors.append(f"raised: {error}"))
        page.on(
            "requestfailed",
            lambda request: self.errors.append(f"failed: {request.url} {request.failure}"),
        )
        page.on("console", self._note)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.page, name)

    def _note(self, message: Any) -> None:
        kind, text = message.type, message.text
        if kind in ("error", "warning") and not any(word in text for word in _SLOW_CARD):
            self.errors.append(f"{kind}: {text}")

    @property
    def outside(self) -> list[str]:
        """Addresses asked for that are neither this machine's nor in the page itself."""
        return [
            url
            for url in self.requests
            if urlsplit(url).scheme not in _INSIDE and urlsplit(url).hostname not in _LOCAL
        ]

    def nothing_wrong(self, *known: str) -> None:
        """Fail if anything was asked of the network, or the console has an error.

        What has one of the words of `known` in it is somebody else's, and let pass.
        """
        assert self.outside == []
        assert [found for found in self.errors if not any(w in found for w in known)] == []


def _executable() -> str:
    asked = os.environ.get("CHROMIUM")
    found = [asked] if asked else [path for name in _NAMES if (path := shutil.which(name))]
    if not found or not Path(found[0]).is_file():
        absent("browser", "no chromium here: on Debian, apt-get install chromium")
    return found[0]


_SHARED: list[Any] = []  # Playwright, once for each that uses it: it may not start twice


@contextmanager
def _playwright() -> Iterator[Any]:
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        absent("browser", f"{error}: pip install playwright")
    _SHARED.append(_SHARED[0] if _SHARED else sync_playwright().start())
    try:
        yield _SHARED[0]
    finally:
        last = _SHARED.pop()
        if not _SHARED:
            last.stop()


@contextmanager
def _chromium() -> Iterator[Any]:
    with _playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=_executable(), headless=True, args=list(_QUIET)
        )
        try:
            yield chromium
        finally:
            chromium.close()


class _OneBrowser:
    """A browser that starts when it is first asked for, and ends with a stack."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack

    @cached_property
    def chromium(self) -> Any:
        return self._stack.enter_context(_chromium())


_ONE: list[_OneBrowser] = []


@contextmanager
def one_browser() -> Iterator[None]:
    """Let each `browser` be a profile of one browser, which takes two seconds to start."""
    with ExitStack() as stack:
        _ONE.append(_OneBrowser(stack))
        stack.callback(_ONE.pop)
        yield


@contextmanager
def browser(
    width: int = 1280, height: int = 800, offline: bool = False, **context: Any
) -> Iterator[Tab]:
    """Open a browser with a new profile, and an empty tab in it.

    Args:
        width: Of a tab [px].
        height: Of a tab [px].
        offline: Whether the browser has no network at all; files still open.
        **context: Options of Playwright's `new_context`, as `color_scheme="dark"`,
            `java_script_enabled=False`, `reduced_motion="reduce"`.
    """
    with nullcontext(_ONE[-1].chromium) if _ONE else _chromium() as chromium:
        one = chromium.new_context(
            viewport={"width": width, "height": height}, offline=offline, **context
        )
        try:
            yield Tab(one.new_page())
        finally:
            one.close()
