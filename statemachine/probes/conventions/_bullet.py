"""A fresh world of PyBullet's, as its users get it, and files put into it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ...installed import require
from ...silence import silence


@contextmanager
def world() -> Iterator[tuple[Any, int]]:
    """The engine and the number of a client of its own, which is gone afterwards."""
    from ...backends._bullet_client import connect, disconnect

    pb = require("pybullet")
    client = connect()
    try:
        # Not the default: or a text under a name that was used before is the old text.
        pb.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=client)
        yield pb, client
    finally:
        disconnect(client)


def load(pb: Any, client: int, text: str, fixed: bool = False) -> int:
    """Put a URDF text, with the inertias that it states, into a world; the body's number."""
    from ...backends._bullet_client import as_file

    with as_file(text) as file, silence():
        return pb.loadURDF(
            file,
            useFixedBase=fixed,
            flags=pb.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
