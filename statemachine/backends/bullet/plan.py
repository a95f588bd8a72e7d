"""A compiled model as PyBullet's worlds want it: texts, surfaces, hulls, and how much padding.

MuJoCo collides a mesh as its convex hull, which the compiled model has. So PyBullet gets that hull
as an OBJ file, whatever file the mesh came from, if any; an ellipsoid becomes a hull as well.
PyBullet puts a margin of 1 mm around each hull, and takes it off again (`collisionMargin=0`) only
where the hull is all that a free body has, and is not turned in it. So hulls are made smaller by
it: their faces are then where they belong, and their edges are rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any
from weakref import proxy

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from ...interface import Array, JointType
from ..compiled.binary_models import compile_text
from ..compiled.kinds import GeomKind
from ..compiled.model import new_data
from ..compiled.stages import compute_kinematics, jacobian, mass_matrix
from . import urdf
from .contacts import Solid, Surfaces
from .file import MOST_LINKS, UrdfFile
from .ties import ends_of, mechanisms, movers
from .urdf_names import Names

if TYPE_CHECKING:
    from ..compiled.types import MjData, MjModel

# Of the armature, as inertia of the stepped arm: 0.003 of the SO-101's 0.028 kg m², with
# which it grips soon and the eigenvalue of `_padding` is 0.97 at most.
_SHARE, _BEARABLE, _SAMPLE = 3 / 28, 1.5, 20
_YIELDS = 0.02

Faces = NDArray[np.int64]  # (m, 3) numbers of vertices

HULLS = (GeomKind.MESH, GeomKind.ELLIPSOID)
MARGIN = 1e-3  # [m] PyBullet's, around each hull that it reads from a file
_THINNEST = 0.25  # a hull is made smaller by this part of its smallest width at most
_HULLS_KEPT, _AT_ONCE = 128, 16  # of a process; vertices for which planes are tried together
# An icosahedron that is divided three times: 642 vertices.
_SPHERE = """<mujoco><asset><mesh name="ball" builtin="sphere" params="3"/></asset><worldbody>
<geom type="mesh" mesh="ball"/></worldbody></mujoco>"""


class Plan:
    """A compiled model, and what follows from it for every world.

    Attributes:
        raw: The compiled model.
        surfaces: What can touch what; nothing where contacts are off.
        names: What everything is called in a URDF.
        mechanism: (nbody,) the root of the mechanism that each body is of: see `mechanisms`.
        roots: The roots of the mechanisms, each of which PyBullet has as one body.
        ghost: See `driven`; None until it is needed.
        described: Gives the text and the files of a mechanism; see `_describe`.
        file: The URDF that a world as it comes reads itself; None where one is written for it.
        weighed: Whether the links of a world as it comes get the inertias of `raw`, not those of
            their shapes. Its robot was a URDF of its own, in which no two links meet.
    """

    def __init__(self, raw: MjModel, file: UrdfFile | None = None, weighed: bool = False) -> None:
        self.raw, self.file, self.weighed = raw, file, weighed
        self.surfaces = Surfaces(raw)
        self.names = Names(raw)
        self.mechanism = mechanisms(raw)
        self.roots = [root for root in urdf.roots(raw) if self.mechanism[root] == root]
        self.ghost: Any = None
        # Weakly: a Plan in no circle is dropped at once, and with it its ghost, which is a world.
        self.described = cache(partial(Plan._describe, proxy(self)))

    def __reduce__(self) -> Any:
        return Plan, (self.raw, self.file, self.weighed)

    def bodies(self, root: int) -> list[int]:
        """Return the bodies of a mechanism, parents first; the world is one of its own."""
        return np.flatnonzero(self.mechanism == root).tolist()

    def _beside(self, root: int) -> tuple[int, ...]:
        """Return the roots of the other trees of a mechanism."""
        return tuple(r for r in urdf.roots(self.raw) if r != root and self.mechanism[r] == root)

    def driven(self, root: int) -> bool:
        """Tell whether more than gravity and contact moves it: true of all but a single free
        body.
        """
        raw = self.raw
        bodies = self.bodies(root)
        if not urdf.floats(raw, root) or len(bodies) > 1:
            return urdf.floats(raw, root) or any(urdf.axes(raw, body) for body in bodies)
        dofs = slice(raw.body_dofadr[root], raw.body_dofadr[root] + 6)
        emulated = raw.dof_armature, raw.dof_damping, raw.dof_frictionloss
        medium = raw.opt.density or raw.opt.viscosity or raw.body_gravcomp[root]
        ends = [b for eq in range(raw.neq) for b in ends_of(raw, eq)]
        ends += [b for tendon in range(raw.ntendon) for b in movers(raw, tendon)]
        tied = root in raw.body_rootid[ends]
        return bool(medium or tied or any(values[dofs].any() for values in emulated))

    @cached_property
    def padding(self) -> Array:
        """Return how much of its armature each degree of freedom (nv,) gives to the stepped arm.

        As inertia of the links; see `Dialect` and `joint_dynamics`.
        """
        return _padding(self.raw)

    @cached_property
    def still(self) -> MjData:
        """Return the pose of everything in the file; it is not to be written into."""
        return self.standing()

    def standing(self) -> MjData:
        """Return the pose of everything in the file, to be written into."""
        data = new_data(self.raw)
        compute_kinematics(self.raw, data)
        return data

    @cached_property
    def softness(self) -> float:
        """Return by how much contacts yield to their own force: the engine's CFM [s/kg].

        Where a contact pushes along what no joint can move, a hard one gets a force without
        bound. MuJoCo's yield by (1 - d)/d of the inverse weight, about 5 % [manual, chapter
        Computation, Constraint model]; these by 2 % of the median of the links that touch,
        times the timestep. The inverse weight is that of the whole tree at least: that of a link
        that turns about its own centre is none. Free bodies can always yield.
        """
        raw = self.raw
        solids = (solid.body for solid in self.surfaces.solids)
        roots = raw.body_rootid
        moving = [b for b in solids if raw.body_weldid[b] and not urdf.floats(raw, roots[b])]
        tree_weights = 1 / raw.body_subtreemass[roots[moving]]
        weights = np.maximum(raw.body_invweight0[moving, 0], tree_weights)
        return float(_YIELDS * raw.opt.timestep * np.median(weights)) if moving else 0.0

    @cached_property
    def hulls(self) -> dict[int, Hull]:
        """Return the hulls of the geoms that touch and are meshes or ellipsoids."""
        geoms = (geom for solid in self.surfaces.solids for geom in solid.geoms)
        return {g: hull_of(self.raw, g) for g in geoms if int(self.raw.geom_type[g]) in HULLS}

    def links(self, root: int) -> int:
        """Return how many links it has in PyBullet, without those of sites: one a joint or a
        solid.
        """
        bodies = self.bodies(root)
        further = [s for s in self.surfaces.solids if s.part and s.body in bodies]
        return len(further) + sum(max(1, len(urdf.axes(self.raw, body))) for body in bodies)

    def _describe(self, root: int, kind: str) -> tuple[str, dict[str, str]]:
        """Return the URDF of a mechanism as a world of that kind reads it.

        And the files that it names, by their names: the hulls of its geoms.
        """
        raw = self.raw
        sites = int(np.count_nonzero(self.mechanism[raw.site_bodyid] == root))
        hulls = set(self.hulls if kind != "ghost" else ())
        if kind == "engine":  # as it comes, meshes come from their files
            meshes = {geom: int(raw.geom_dataid[geom]) for geom in hulls}
            hulls = {g for g, mesh in meshes.items() if mesh < 0 or raw.mesh_pathadr[mesh] < 0}
        loose = urdf.floats(raw, root) and (kind == "engine" or not self.driven(root))
        anchored = bool(root) and not loose
        solids, padding, tips = self.surfaces.solids, None, False
        if kind == "stepped":
            padding = self.padding
        else:
            tips = self.links(root) + sites <= MOST_LINKS
        dialect = urdf.Dialect(
            capsules=True,
            looks=False,
            solids=kind != "ghost" and bool(solids),
            dynamics=kind == "engine",
            anchored=anchored,
            padding=padding,
            tips=tips,
            hulls=frozenset(hulls),
            parts=_parts(solids),
            beside=self._beside(root),
        )
        files = {
            urdf.hull_file(geom): self.hulls[geom].obj(smaller=kind == "stepped")
            for geom in hulls
            if self.mechanism[raw.geom_bodyid[geom]] == root
        }
        return urdf.write(raw, root, dialect, self.names), files


def _parts(solids: Sequence[Solid]) -> dict[int, int]:
    """Return in which link of its body each geom is that touches."""
    return {geom: solid.part for solid in solids for geom in solid.geoms}


def _padding(raw: MjModel) -> Array:
    """Return as much of the armature as the observer of contacts bears.

    It converges while what contact meets, the padded arm, is less than twice what the
    joint dynamics are solved with, M + A: the largest eigenvalue of (M + A)⁻¹·(M + padding) is kept
    below `_BEARABLE` in a sample of poses.
    """
    share, data = _SHARE * raw.dof_armature, new_data(raw)
    random = np.random.default_rng(0)
    with np.errstate(over="ignore"):
        limited = raw.jnt_limited.astype(bool) & np.isfinite(np.ptp(raw.jnt_range, axis=1))
    low, high = np.where(limited[:, None], raw.jnt_range, [-np.pi, np.pi]).T
    poses = [raw.qpos0, *raw.key_qpos]
    scalar = np.isin(raw.jnt_type, (JointType.HINGE, JointType.SLIDE))
    for _ in range(_SAMPLE):
        qpos = raw.qpos0.copy()
        qpos[raw.jnt_qposadr[scalar]] = random.uniform(low, high)[scalar]
        poses.append(qpos)
    for qpos in poses if share.any() else []:
        data.qpos[:] = qpos
        mass = mass_matrix(raw, data)
        bare = mass - np.diag(raw.dof_armature)
        try:
            # In halves, until this pose bears it too.
            while _worst(mass, bare + _padding_at(raw, data, share)) > _BEARABLE:
                share = share / 2
        except LinAlgError:
            # Two joints that turn about one axis here: no engine can step from such a pose, and
            # whether it would bear more inertia has no answer.
            continue
    return share


def _worst(mass: Array, padded: Array) -> float:
    """Return the largest eigenvalue of whole⁻¹·padded."""
    return float(np.linalg.eigvals(np.linalg.solve(mass, padded)).real.max())


def _padding_at(raw: MjModel, data: MjData, share: Array) -> Array:
    """Return what the padding adds to the mass matrix (nv, nv) in a pose."""
    total = np.zeros((raw.nv, raw.nv))
    for j in [j for body in range(raw.nbody) for j in urdf.axes(raw, body)]:
        dof, body = int(raw.jnt_dofadr[j]), int(raw.jnt_bodyid[j])
        moving, turning = jacobian(raw, data, body, data.xipos[body])
        slides = raw.jnt_type[j] == JointType.SLIDE
        shape = urdf.padding_shape(data.xaxis[j])
        unit = moving.T @ moving if slides else turning.T @ shape @ turning
        total += share[dof] * unit
    return total


class Hull:
    """The hull of a mesh or an ellipsoid, in the geom's own frame.

    Attributes:
        allowance: How much smaller it can be made [m]: the margin, or what its thickness allows.
        obj: Gives OBJ of it [m], with PyBullet's margin taken off or not.
    """

    def __init__(self, vertices: Array, faces: Faces) -> None:
        self._vertices, self._faces = vertices, faces
        normals, offsets = _planes(vertices, faces)
        near = 1e-9 * float(np.abs(vertices).max()) + 1e-12
        # By plane how far the farthest vertex is behind it, by vertex which planes it is on.
        widths, meeting = np.zeros(len(offsets)), list[Array]()
        for start in range(0, len(vertices), _AT_ONCE):
            depths = offsets - vertices[start : start + _AT_ONCE] @ normals.T
            widths = np.maximum(widths, depths.max(axis=0))
            vertex, plane = np.nonzero(np.abs(depths) < near)
            meeting += np.split(normals[plane], vertex.searchsorted(range(1, len(depths))))
        self._meeting = meeting
        self.allowance = min(MARGIN, round(_THINNEST * float(widths.min()), 10))
        self.obj = cache(self._obj)

    def _obj(self, smaller: bool) -> str:
        vertices = self._vertices
        if smaller:
            vertices = _inset(vertices, self._meeting, self.allowance)
        # Rounded: the last bits of NumPy's sums are those of the processor.
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (np.round(vertices, 10) + 0.0).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (self._faces + 1).tolist()]
        return "\n".join([*lines, ""])


@lru_cache(_HULLS_KEPT)
def _kept_hull(vertices: bytes, faces: bytes) -> Hull:
    return Hull(
        np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3)
    )


def hull_of(raw: MjModel, geom: int) -> Hull:
    """Return the hull of a geom; one for all geoms and models that have the same."""
    if raw.geom_type[geom] == GeomKind.ELLIPSOID:
        vertices, faces = _sphere()
        vertices = vertices * raw.geom_size[geom]
    else:
        vertices, faces = _mesh_hull(raw, int(raw.geom_dataid[geom]))
    return _kept_hull(vertices.tobytes(), faces.astype(np.int64).tobytes())


def roughness(size: Array) -> float:
    """Return how far the hull of an ellipsoid of semi-axes (3,) is from it at most [m]."""
    ball, _ = _sphere()
    return float((np.linalg.norm(ball, axis=1).max() - 1) * size.max())


def _mesh_hull(raw: MjModel, mesh: int) -> tuple[Array, Faces]:
    """Return the vertices (n, 3) [m] and triangles (m, 3), which turn outwards."""
    start, count = int(raw.mesh_vertadr[mesh]), int(raw.mesh_vertnum[mesh])
    vertices = np.array(raw.mesh_vert[start : start + count], dtype=np.float64)
    # Vertices, triangles, two tables of vertices, one of edges, and the triangles by vertex.
    graph = raw.mesh_graph[raw.mesh_graphadr[mesh] :]
    corners, triangles = int(graph[0]), int(graph[1])
    numbers = graph[2 + corners : 2 + 2 * corners]
    end = 2 + 3 * corners + 6 * triangles
    faces = graph[end - 3 * triangles : end].reshape(-1, 3)
    places = np.zeros(count, dtype=int)
    places[numbers] = np.arange(corners)
    return vertices[numbers], places[faces]


@cache
def _sphere() -> tuple[Array, Faces]:
    """Return the vertices (n, 3) and triangles (m, 3) about a unit sphere, as far in as out of
    it.
    """
    vertices, faces = _mesh_hull(compile_text(_SPHERE), 0)
    depth = np.linalg.norm(vertices[faces].mean(axis=1), axis=1).min()
    return vertices * (2 / (1 + depth)), faces


def _planes(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Return outward normals (m, 3) of the faces, and how far along them the faces are [m]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    flat = length < 1e-12 * length.max()  # a sliver, which has no direction
    normals = normals[~flat] / length[~flat, None]
    normals *= np.sign(np.einsum("ij,ij->i", normals, a[~flat] - vertices.mean(axis=0)))[:, None]
    return normals, np.einsum("ij,ij->i", normals, a[~flat])


def _inset(vertices: Array, meeting: Sequence[Array], distance: float) -> Array:
    """Return the vertices (n, 3) of a hull whose planes are a distance [m] further in.

    Where more than three planes meet, as near to all as it goes: least squares.

    Args:
        vertices: Of the hull.
        meeting: By vertex the normals (k, 3) of the planes that it is on.
        distance: How far.
    """
    most = max(map(len, meeting))
    normals, goal = np.zeros((len(vertices), most, 3)), np.zeros((len(vertices), most, 1))
    for k, faces in enumerate(meeting):
        normals[k, : len(faces)], goal[k, : len(faces)] = faces, -distance
    steps = (np.linalg.pinv(normals, rcond=1e-6) @ goal)[..., 0]
    far = np.linalg.norm(steps, axis=1, keepdims=True)
    return vertices + steps * np.minimum(1.0, 4 * distance / np.maximum(far, 1e-300))
