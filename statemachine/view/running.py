"""Serving a view until it is interrupted."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

from . import server as serving
from .live import Live
from .request import BrowserView, ServerSettings
from .viser_front import ViserFront


def serve(
    view: BrowserView,
    settings: ServerSettings,
    port: int,
    label: str,
    announce: Callable[[int, str], object],
) -> None:
    """Show a view in browsers, until it is interrupted or its time is over.

    Args:
        view: What is shown.
        settings: How.
        port: To listen on, from `server.free_port`.
        label: What the page is called.
        announce: Called with the port and the token of the page's address, once it is there.

    Raises:
        KeyboardInterrupt: It was interrupted: the ordinary end of a server, no failure.
    """
    server, door = None, serving.Door(settings.host)
    view.session.set_speed(settings.speed)
    try:
        server = serving.serve(settings.host, port, label, door)
        front = ViserFront(server, view.session, view.drawing, view.keyframe)
        announce(server.get_port(), door.token)
        if not settings.paused:
            view.session.play()
        Live(view.session, front).run(settings.seconds, _interrupts())
    finally:
        if server is not None:
            with suppress(KeyboardInterrupt):  # a second one
                serving.stop(server)


def _interrupts() -> list[int]:
    """Return a list that gets an entry for each Ctrl-C.

    NumPy swallows a KeyboardInterrupt that falls into a comparison.
    """
    noted: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        noted.append(number)
        signal.default_int_handler(number, None)

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, note)
    return noted
