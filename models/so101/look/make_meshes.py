"""Turn look.xml, the arm's look as primitives, into one STL file a body and material.

    python models/so101/look/make_meshes.py

Needs MuJoCo (to read the primitives) and NumPy. The files are committed; run this
after a change to look.xml. A test runs it and compares.
"""

from __future__ import annotations

import itertools
import struct
import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent
SEGMENTS = 20  # of a full turn, for what is as thick as a joint
FEW = 10  # for screws and rounded edges
THICK = 0.005  # metres


def box(size: np.ndarray) -> np.ndarray:
    """Triangles (12, 3, 3) of a box with half sizes (3,)."""
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1, 1):
            corners = np.zeros((4, 3))
            corners[:, axis] = sign
            corners[:, u] = (-1, 1, 1, -1) if sign > 0 else (-1, -1, 1, 1)
            corners[:, v] = (-1, -1, 1, 1) if sign > 0 else (-1, 1, 1, -1)
            faces += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(faces) * size


def turned(profile: list[tuple[float, float]], segments: int) -> np.ndarray:
    """Triangles of a solid of revolution about z; `profile` is (radius, z), upwards."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.column_stack([r * circle, np.full(segments, z)]) for r, z in profile]
    faces = []
    for low, high in itertools.pairwise(rings):
        for i in range(segments):
            j = (i + 1) % segments
            faces += [(low[i], low[j], high[j]), (low[i], high[j], high[i])]
    solid = np.array(faces)
    flat = np.linalg.norm(np.cross(solid[:, 1] - solid[:, 0], solid[:, 2] - solid[:, 0]), axis=1)
    return solid[flat > 1e-14]  # at a pole one of each two triangles is a line


def cylinder(size: np.ndarray) -> np.ndarray:
    """Triangles of a cylinder: size is (radius, half length)."""
    radius, half = float(size[0]), float(size[1])
    segments = SEGMENTS if radius > THICK else FEW
    return turned([(0, -half), (radius, -half), (radius, half), (0, half)], segments)


def capsule(size: np.ndarray) -> np.ndarray:
    """Triangles of a capsule: size is (radius, half length of its middle)."""
    radius, half = float(size[0]), float(size[1])
    segments = SEGMENTS if radius > THICK else FEW
    bow = np.linspace(0, np.pi / 2, 4)
    below = [(radius * np.sin(a), -half - radius * np.cos(a)) for a in bow]
    above = [(r, -z) for r, z in reversed(below)]
    return turned(below + above, segments)


SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_BOX): box,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): cylinder,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): capsule,
}


def triangles() -> dict[str, np.ndarray]:
    """Triangles (n, 3, 3) by "body_material", in the frame of the body."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "look.xml"))
    parts: dict[str, list[np.ndarray]] = {}
    for g in range(model.ngeom):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[g])
        solid = SHAPES[int(model.geom_type[g])](model.geom_size[g])
        placed = solid @ turn.reshape(3, 3).T + model.geom_pos[g]
        body = model.body(model.geom_bodyid[g]).name
        material = model.mat(model.geom_matid[g]).name
        parts.setdefault(f"{body}_{material}", []).append(placed)
    return {name: np.concatenate(solids) for name, solids in parts.items()}


def stl(solid: np.ndarray) -> bytes:
    """A binary STL file, to the micrometre, so that it is the same on every machine."""
    solid = np.round(solid, 6) + 0.0
    records = np.zeros(len(solid), dtype=[("f", "<f4", 12), ("pad", "<u2")])
    normals = np.cross(solid[:, 1] - solid[:, 0], solid[:, 2] - solid[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.round(normals / np.where(lengths > 0, lengths, 1), 4) + 0.0
    records["f"] = np.column_stack([normals, solid.reshape(len(solid), 9)])
    return b"statemachine so101 look".ljust(80) + struct.pack("<I", len(solid)) + records.tobytes()


def main(folder: Path = HERE) -> int:
    """Write all files into a folder; the number of bytes."""
    total = 0
    for name, solid in triangles().items():
        content = stl(solid)
        (folder / f"{name}.stl").write_bytes(content)
        total += len(content)
    return total


if __name__ == "__main__":
    print(f"{main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)} bytes of meshes")
