"""How a specification is prepared to be compiled: options of `load`, and frames of fused bodies.

MuJoCo's compiler makes the static bodies of a file (the links of a URDF behind fixed joints) part
of their parents, where `fusestatic` says so, as it does by default for a URDF. Masses and shapes
are kept, the frames are not: the tool0 of an arm is nowhere. `keep_frames` adds a site of its name
for each of them, so that `model.site_id("tool0")` and `data.site_xpos` have it. No other number of
the compiled model changes for it, but `stat.extent` and `stat.center`, of which sites are a part.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import BadInputError
from ...interface.records import ReadOptions
from ...measures.text import few, listed
from ..file_text import BaseOfText
from ..repair_record import Repair
from ..served.release_base import free_joint_name, free_joint_of, root_of, set_base
from .repairs import balance_all, mend_inertia, mend_mass
from .spec_assets import assets_of, delete_assets
from .spec_files import compile_spec, read_spec

if TYPE_CHECKING:
    import mujoco

# Viewers show the sites of groups 0 to 2; frames of links are many, and have no shape of their own.
_FRAME_GROUP = 4


def compile_with(path: Path, options: ReadOptions) -> tuple[mujoco.MjModel, list[Repair]]:
    """Compile a file as its options say, and keep the frames of the bodies that are fused.

    Args:
        path: An MJCF or URDF file.
        options: As `load` was given.

    Returns:
        The compiled model, and what the options changed.

    Raises:
        ValueError: MuJoCo cannot read it so.
    """
    faults: list[str] = []
    while True:
        spec, repairs = read_spec(path), list[Repair]()
        for fault in faults:
            repairs += _mended(spec, fault, options)
        repairs += prepare(spec, options)
        try:
            if spec.compiler.fusestatic:
                keep_frames(spec)
            return compile_spec(spec), repairs
        except ValueError as error:
            # What breaks the rule by a rounding error alone, the compiler has to tell.
            fault = str(error)
            if fault in faults or not _mended(read_spec(path), fault, options):
                raise
            faults.append(fault)


def _mended(spec: mujoco.MjSpec, fault: str, options: ReadOptions) -> list[Repair]:
    """Mend a fault that MuJoCo names, as far as options say so; none where they do not."""
    if options.balance_inertia and (repairs := mend_inertia(spec, fault)):
        return repairs
    return mend_mass(spec, fault) if options.least_mass else []


def prepare(spec: mujoco.MjSpec, options: ReadOptions) -> list[Repair]:
    """Apply options to a specification.

    Args:
        spec: The specification, which was not compiled yet.
        options: As `load` was given.

    Returns:
        What they changed of what the file says: of the base it is nothing but its free joint, which
        is asked for.

    Raises:
        BadInputError: The base cannot be free, or the file does not say what the robot is.
    """
    if options.base is not None:
        try:
            set_base(spec, options.base, None if options.start is None else asdict(options.start))
        except ValueError as error:
            raise BadInputError(str(error)) from None
    repairs: list[Repair] = []
    if options.balance_inertia:
        repairs += balance_all(spec, "balance_inertia")
    if not options.meshes:
        repairs += delete_assets(spec, assets_of(spec, ["mesh"]), "meshes=False")
    return repairs


def base_of_text(path: Path, options: ReadOptions) -> BaseOfText | None:
    """Return what is written into a URDF so that its base is as asked; None if it is already.

    Args:
        path: The file, which compiles with this base.
        options: What is asked of its base, if anything.
    """
    if options.base is None:
        return None
    spec = read_spec(path)
    root = root_of(spec)
    joint = free_joint_of(root)
    is_free = options.base == "free"
    if (joint is not None) is is_free and options.start is None:
        return None
    if joint is None:
        return BaseOfText(root.name, free_joint_name(spec), is_free, options.start)
    return BaseOfText(joint.parent.name, joint.name, is_free, options.start)


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


def effects(path: Path, options: ReadOptions, repairs: Iterable[Repair]) -> Iterator[str]:
    """Yield what `balance_inertia` and `meshes` changed of a file, in sentences.

    Args:
        path: The file, which compiles with these options.
        options: As `load` was given.
        repairs: As of `compile_with`.
    """
    changes = [_balanced(repair) for repair in repairs if repair.quantity == "inertia"]
    if changes:
        yield f"balance_inertia: {few(changes, 5)}"
    if not options.meshes:
        yield from _without_meshes(path)


def balanced_moments(path: Path) -> dict[str, float]:
    """Return the moment [kg m^2] of each body that `balance_inertia` balances, by name."""
    moments: dict[str, float] = {}
    for repair in balance_all(read_spec(path), "balance_inertia"):
        if isinstance(repair.used, tuple):
            moments[repair.name] = repair.used[0]
    return moments


def _balanced(repair: Repair) -> str:
    """Return how a balanced inertia was stated, and what is used instead."""
    stated, used = repair.stated, repair.used
    if not isinstance(stated, tuple) or not isinstance(used, tuple):
        return repair.name
    before = ", ".join(f"{moment:.4g}" for moment in stated)
    return f"{repair.name} had moments {before} kg m², has {used[0]:.4g} three times"


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
