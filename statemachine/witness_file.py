"""A robot's file as Pinocchio reads it: with its own parser, and no misreading unnoticed.

Pinocchio's parser of MJCF passes some things over in silence. What it would misread is
refused here, with a plain word; what it drops at the root of the tree is put within its
reach.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .errors import ModelError

_PLACES = {"pos", "quat", "euler", "axisangle", "xyaxes", "zaxis", "fromto"}
# Elements that make or move bodies and that Pinocchio's parser passes over in silence.
_PASSED_OVER = ("frame", "replicate", "composite", "flexcomp", "attach")


def read(pin: Any, path: Path) -> tuple[Any, list[str], set[str]]:
    """Pinocchio's model of a file, its joints in order, and the sites that it misplaces."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{path} is not an XML file: {error}") from error
    in_file: list[str] = []
    misplaced = {site.get("name", "") for site in root.iter("site") if site.get("fromto")}
    try:
        if root.tag == "robot":
            model = pin.buildModelFromUrdf(str(path))
        elif root.tag == "mujoco":
            _refuse_misread(root, path)
            in_file = _mjcf_joints(root)
            model = _build_mjcf(pin, root, path)
        else:
            raise ModelError(f"{path} is neither MJCF nor URDF: its root element is <{root.tag}>")
    except ModelError:
        raise
    except Exception as error:  # the bindings raise RuntimeError, ValueError and others
        reason = _reason(error)
        if root.find("keyframe") is not None:
            reason += "; it has keyframes, which Pinocchio takes only where they fit the arm"
        raise ModelError(f"Pinocchio cannot read {path}: {reason}") from error
    if root.tag == "mujoco":
        # MuJoCo's qpos of a free body is its pose in the world, whatever pose the file
        # gives the body; Pinocchio would put the one on top of the other.
        for i, joint in enumerate(model.joints):
            if joint.shortname().endswith("FreeFlyer"):
                model.jointPlacements[i] = pin.SE3.Identity()
    return model, in_file or list(model.names)[1:], misplaced


def _build_mjcf(pin: Any, root: ElementTree.Element, path: Path) -> Any:
    """Pinocchio's model; of a file whose root stands still, with a body put under it.

    Of a root body without a joint, and of the world, Pinocchio drops the pose and the
    sites. Below one more body that stands still at the origin, it keeps them.
    """
    (world,) = root.findall("worldbody")
    (body,) = world.findall("body")
    sites = world.findall("site")
    if body.find("joint") is not None or body.find("freejoint") is not None:
        return pin.buildModelFromMJCF(str(path))
    ground = _still_body(world, "the ground")
    under = {"site": _still_body(ground, "the world"), "body": ground}
    for element in (*sites, body):
        world.remove(element)
        under[element.tag].append(element)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        ElementTree.ElementTree(root).write(copy, encoding="utf-8")
        return pin.buildModelFromMJCF(str(copy))


def _refuse_misread(root: ElementTree.Element, path: Path) -> None:
    """Raise ModelError for what Pinocchio's MJCF parser would pass over in silence."""
    include = root.find(".//include")
    if include is not None:
        raise ModelError(
            f"{path.name} includes {include.get('file')!r}, and Pinocchio follows no <include>: "
            "give it the robot's own file"
        )
    for tag in _PASSED_OVER:
        if root.find(f".//worldbody//{tag}") is not None:
            raise ModelError(f"{path.name} uses <{tag}>, which Pinocchio's parser does not read")
    compilers, defaults = root.findall("compiler"), root.findall("default")
    for tag, found in (("compiler", compilers), ("default", defaults)):
        if len(found) > 1:
            raise ModelError(
                f"{path.name} has {len(found)} <{tag}> elements at the top, and Pinocchio "
                "reads one: merge them"
            )
    if any(c.get("eulerseq", "xyz") != "xyz" for c in compilers):
        raise ModelError(f"{path.name} sets eulerseq, which Pinocchio's parser does not read")
    degrees = not any(c.get("angle") == "radian" for c in compilers)
    if degrees and root.find(".//worldbody//*[@axisangle]") is not None:
        raise ModelError(f"{path.name} gives axisangle in degrees, and Pinocchio reads radians")
    for default in defaults:
        for element in (*default.iter("joint"), *default.iter("site")):
            placed = sorted(_PLACES & set(element.keys()))
            if placed:
                raise ModelError(
                    f"{path.name} gives {placed[0]} of a {element.tag} in a <default>, which "
                    "Pinocchio's parser does not read: write it where it is used"
                )
    _refuse_slides_with_ref(root, path)
    roots = [body.get("name", "?") for body in root.findall("worldbody/body")]
    if len(roots) != 1 or len(root.findall("worldbody")) != 1:
        raise ModelError(
            f"{path.name} has {len(roots)} root bodies ({', '.join(roots) or 'none'}), and "
            "Pinocchio reads exactly one: put the robot in a file of its own"
        )


def _refuse_slides_with_ref(root: ElementTree.Element, path: Path) -> None:
    """Pinocchio reads the ref of a hinge and passes over that of a slide."""
    presets = [joint for default in root.iter("default") for joint in default.findall("joint")]
    kinds = {joint.get("type") for joint in presets}
    preset = any(float(joint.get("ref", 0)) for joint in presets)
    for joint in root.iterfind(".//worldbody//joint"):
        kind = joint.get("type") or ("slide" if "slide" in kinds else "hinge")
        if kind == "slide" and (preset or float(joint.get("ref", 0))):
            raise ModelError(
                f"{path.name} gives the slide {joint.get('name', '?')!r} a ref, which Pinocchio's "
                "parser does not read"
            )


def _still_body(parent: ElementTree.Element, name: str) -> ElementTree.Element:
    body = ElementTree.SubElement(parent, "body", name=name)
    ElementTree.SubElement(body, "inertial", mass="1", pos="0 0 0", diaginertia="1 1 1")
    return body


def _mjcf_joints(root: ElementTree.Element) -> list[str]:
    """Names of all joints, in MuJoCo's order: bodies depth first, "" if unnamed."""

    def walk(body: ElementTree.Element) -> Iterator[str]:
        for child in body:
            if child.tag in ("joint", "freejoint"):
                yield child.get("name", "")
        for child in body:
            if child.tag == "body":
                yield from walk(child)

    return [name for top in root.findall("worldbody/body") for name in walk(top)]


def _reason(error: Exception) -> str:
    """One line of an error of Pinocchio's: the C++ location lines are left out."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    plain = [line for line in lines if not line.startswith(("From file:", "in function:"))]
    return (plain or lines or [type(error).__name__])[0]
