"""A client of PyBullet's: opened, given a file, closed; and its quaternions (x, y, z, w)."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...errors import EngineError, ModelError
from ...installed import require, silence
from ...processes import free_memory

pb: Any = require("pybullet")


MOST_CLIENTS = 1024  # in one process
_WORLD = 35 << 20  # bytes that a client takes, nearly all of it for messages to the engine


def connect() -> int:
    """Open a client.

    Raises:
        EngineError: There is no place for another, or no memory.
    """
    room: int | None = 0
    for _ in range(2):
        room = free_memory()
        if room is None or room >= 2 * _WORLD:  # without memory, the engine ends the process
            client = pb.connect(pb.DIRECT)
            if client >= 0:
                return client
        gc.collect()  # Data that nobody closed may hold the places
    if room is not None and room < 2 * _WORLD:
        raise EngineError(
            f"no memory for another world of PyBullet's: one takes {_WORLD >> 20} MB, and "
            f"{room >> 20} MB are left: close some Data"
        )
    raise EngineError(
        f"PyBullet holds {MOST_CLIENTS} worlds in one process at most, of {_WORLD >> 20} MB each: "
        "close some Data"
    )


def disconnect(client: int) -> None:
    try:
        pb.disconnect(client)
    except (pb.error, TypeError):  # the user has, or the module is gone at exit
        return


@contextmanager
def as_file(text: str, beside: Mapping[str, str] = MappingProxyType({})) -> Iterator[str]:
    """Yield a name under which PyBullet can read a text.

    Nothing is left when the process dies, where nothing has to lie beside it.

    Args:
        text: The text.
        beside: Further texts that it names, by the names of their files.
    """
    if hasattr(os, "memfd_create") and not beside:
        with open(os.memfd_create("urdf"), "wb") as file:
            file.write(text.encode())
            file.flush()
            yield f"/proc/self/fd/{file.fileno()}"
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.urdf"
        for name, content in {path.name: text, **beside}.items():
            (path.parent / name).write_text(content, encoding="utf-8")
        yield str(path)


def load_urdf(client: int, file: str, what: str, **options: Any) -> int:
    """Put a URDF file into a world; the body's number.

    Args:
        client: The world's number.
        file: The file's name.
        what: What the message of an error calls it.
        **options: Further arguments of loadURDF.

    Raises:
        ModelError: PyBullet cannot read it; with what it has to say.
    """
    with silence() as output:
        try:
            return pb.loadURDF(file, physicsClientId=client, **options)
        except pb.error as error:
            refused = str(error)
    raise ModelError(f"PyBullet cannot read {what}: {'; '.join([*output, refused][-3:])}")


def joint_infos(client: int, body: int) -> list[Any]:
    """Return what getJointInfo returns of each joint of a body, fixed ones too."""
    return [pb.getJointInfo(body, i, client) for i in range(pb.getNumJoints(body, client))]


Quat = tuple[float, float, float, float]


def times(a: Any, b: Any) -> Quat:
    """Return the product of two quaternions, (x, y, z, w)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    return x, y, z, w


def turned(quat: Any, vector: Any) -> tuple[float, float, float]:
    """Return a vector turned by a unit quaternion (x, y, z, w)."""
    x, y, z, w = quat
    vx, vy, vz = vector
    tx = 2 * (y * vz - z * vy)
    ty = 2 * (z * vx - x * vz)
    tz = 2 * (x * vy - y * vx)
    vx = vx + w * tx + y * tz - z * ty
    vy = vy + w * ty + z * tx - x * tz
    vz = vz + w * tz + x * ty - y * tx
    return vx, vy, vz
