"""How a specification is prepared to be compiled: options of `load`, and frames of fused bodies.

MuJoCo's compiler makes the static bodies of a file (the links of a URDF behind fixed joints) part
of their parents, where `fusestatic` says so, as it does by default for a URDF. Masses and shapes
are kept, the frames are not: the tool0 of an arm is nowhere. `keep_frames` adds a site of its name
for each of them, so that `model.site_id("tool0")` and `data.site_xpos` have it. No other number of
the compiled model changes for it, but `stat.extent` and `stat.center`, of which sites are a part.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..interface.records import ReadOptions
from ..measures.text import few, listed
from .compiled import read_spec
from .repairs import assets_of, delete_assets, stated_moments

if TYPE_CHECKING:
    import mujoco

# Viewers show the sites of groups 0 to 2; frames of links are many, and have no shape of their own.
_FRAME_GROUP = 4
# Moments of inertia that agree to this are the same: those of a full inertia are its eigenvalues.
_SAME = 1e-6


def prepare(spec: mujoco.MjSpec, options: ReadOptions) -> None:
    """Apply options to a specification, and keep the frames of the bodies that are to be fused.

    Args:
        spec: The specification, which was not compiled yet.
        options: As `load` was told.
    """
    apply_options(spec, options)
    if spec.compiler.fusestatic:
        keep_frames(spec)


def keep_frames(spec: mujoco.MjSpec) -> None:
    """Fuse the static bodies of a specification, and keep the frame of each as a site of its name.

    What the compiler leaves a body, since something refers to it, gets no site. Nor does a body
    without a name, or one of whose name there is a site already.

    Args:
        spec: The specification, which was not compiled yet.
    """
    taken = {site.name for site in spec.sites}
    frames: list[Any] = []
    for body in list(spec.bodies):
        is_static = body.name != "world" and not list(body.joints)
        if is_static and body.name and body.name not in taken:
            frames.append(body.add_site(name=body.name, group=_FRAME_GROUP))
    spec.fuse_static()
    bodies = {body.name for body in spec.bodies}
    for site in frames:
        if site.name in bodies:
            spec.delete(site)


def apply_options(spec: mujoco.MjSpec, options: ReadOptions) -> None:
    """Write into a specification what `balance_inertia` and `meshes` ask for.

    Args:
        spec: The specification, which was not compiled yet.
        options: As `load` was told.
    """
    if options.balance_inertia:
        spec.compiler.balanceinertia = True
    if not options.meshes:
        delete_assets(spec, assets_of(spec, ["mesh"]), "meshes=False")


def effects(path: Path, options: ReadOptions) -> Iterator[str]:
    """Yield what `balance_inertia` and `meshes` changed of a file, in sentences.

    Args:
        path: The file, which compiles with these options.
        options: As `load` was told.
    """
    if options.balance_inertia:
        yield from _balanced(path, options)
    if not options.meshes:
        yield from _without_meshes(path)


def _balanced(path: Path, options: ReadOptions) -> Iterator[str]:
    """Yield the moments of inertia that `balanceinertia` made equal."""
    spec = read_spec(path)
    stated = [stated_moments(body) for body in spec.bodies]
    apply_options(spec, options)
    spec.compiler.fusestatic = False
    raw = spec.compile()
    changes: list[str] = []
    for body, moments in enumerate(stated):
        if moments is None:
            continue
        used = np.sort(raw.body_inertia[body])[::-1]
        if not np.allclose(moments, used, rtol=_SAME, atol=0):
            name = raw.body(body).name or f"body {body}"
            before = ", ".join(f"{moment:.4g}" for moment in moments)
            changes.append(f"{name} had moments {before} kg m², has {used[0]:.4g} three times")
    if changes:
        yield f"balance_inertia: {few(changes, 5)}"


def _without_meshes(path: Path) -> Iterator[str]:
    """Yield which bodies touch nothing, or weigh less, without their meshes."""
    spec = read_spec(path)
    touching, weighing = list[str](), list[str]()
    for geom in spec.geoms:
        if not geom.meshname:
            continue
        name = geom.parent.name or "a body without a name"
        if (geom.contype or geom.conaffinity) and name not in touching:
            touching.append(name)
        has_mass = geom.parent.explicitinertial or name == "world"
        if not has_mass and name not in weighing:
            weighing.append(name)
    if touching:
        yield f"meshes=False: shapes that touch are left out of {few(touching, 5)}"
    if weighing:
        yield f"meshes=False: nothing is known of the mass of the meshes of {listed(weighing)}"
