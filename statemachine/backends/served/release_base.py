"""Whether the base of a robot floats: its free joint, added to or taken from a specification.

The reading of files imports it. In the Python of another release `release_options` runs it: so it
needs NumPy and MuJoCo only, on Python 3.9 or later, and imports nothing of this package.
"""

from __future__ import annotations

import mujoco
import numpy as np

# What the free joint is called that a base gets; many public models of robots call theirs so.
FREE_JOINT = "floating_base_joint"
_FREE = mujoco.mjtJoint.mjJNT_FREE
_SIZES = {  # of a joint in qpos and in qvel
    mujoco.mjtJoint.mjJNT_FREE: (7, 6),
    mujoco.mjtJoint.mjJNT_BALL: (4, 3),
    mujoco.mjtJoint.mjJNT_SLIDE: (1, 1),
    mujoco.mjtJoint.mjJNT_HINGE: (1, 1),
}
_ON_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


def set_base(spec, base, start=None):
    """Give the base of a robot a free joint, or take it away; keyframes keep their other numbers.

    A base that gets a free joint starts where it stands in the file, in keyframes, too. One that
    loses it stands there.

    Args:
        spec: A MjSpec that was not compiled.
        base: "free" or "fixed".
        start: Where a free base is in the default state, "pos" (3,) [m] and "quat" (4,) by name;
            None for where it stands in the file.

    Raises:
        ValueError: The file does not say which of several trees is the robot; or no free joint
            can be where something else moves the base already.
    """
    root = root_of(spec)
    joint = free_joint_of(root)
    if base == "fixed" and joint is not None:
        _take_away(spec, joint)
    if base == "free":
        if start is not None:
            _place(spec, root if joint is None else joint.parent, start)
        if joint is None:
            _add(spec, root)


def root_of(spec):
    """Return the body of a specification that is the base of its robot.

    Of the bodies that stand on the world it is the one that carries joints beside a free one; of
    several of those the one of which an actuator drives a joint. A model without such joints has
    one body on the world.

    Raises:
        ValueError: There is none, or more than one.
    """
    placed = [body for body in _children(spec.worldbody) if not body.mocap]
    jointed = [body for body in placed if _moving_joints(body)]
    driven_names = {drive.target for drive in spec.actuators if drive.trntype in _ON_JOINTS}
    driven = [body for body in jointed if driven_names & _names(_moving_joints(body))]
    for bodies in (driven, jointed, placed):
        if len(bodies) == 1:
            return bodies[0]
        if bodies:
            names = ", ".join(body.name or "a body without a name" for body in bodies)
            raise ValueError(
                f"base= is of one robot, and {len(bodies)} trees of bodies may be it: {names}"
            )
    raise ValueError("base= is of a robot, and there is no body but the world")


def free_joint_of(root):
    """Return the free joint of a base, or of a body that is fixed to it; None if it has none."""
    for joint in root.joints:
        if joint.type == _FREE:
            return joint
    if list(root.joints):
        return None
    for child in _children(root):
        joint = free_joint_of(child)
        if joint is not None:
            return joint
    return None


def free_joint_name(spec):
    """Return what the free joint is called that the base of a specification gets."""
    taken = {joint.name for joint in spec.joints}
    name, number = FREE_JOINT, 2
    while name in taken:
        name, number = f"{FREE_JOINT}_{number}", number + 1
    return name


def _add(spec, root):
    """Add a free joint to a base that stands."""
    if list(root.joints):
        names = ", ".join(joint.name or "one without a name" for joint in root.joints)
        raise ValueError(
            f"base=free: {root.name or 'the first body'} turns or slides on the world itself, by "
            f"{names}: there is no base that could float"
        )
    keys = _states_of(spec)
    root.add_freejoint(name=free_joint_name(spec))
    if not keys:
        return
    for key, _, _ in keys:
        key.qpos, key.qvel = [], []
    start = np.array(spec.copy().compile().qpos0)
    place, dof = _address(spec, root)
    for key, qpos, qvel in keys:
        if len(qpos):
            key.qpos = np.r_[qpos[:place], start[place : place + 7], qpos[place:]]
        if len(qvel):
            key.qvel = np.r_[qvel[:dof], np.zeros(6), qvel[dof:]]


def _place(spec, body, start):
    """Put a body that stands on the world elsewhere."""
    if body.frame is not None:
        body.set_frame(spec.worldbody.add_frame())
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.pos, body.quat = start["pos"], start["quat"]


def _take_away(spec, joint):
    """Delete the free joint of a base."""
    place, dof = _address(spec, joint.parent)
    for key, qpos, qvel in _states_of(spec):
        if len(qpos):
            key.qpos = np.r_[qpos[:place], qpos[place + 7 :]]
        if len(qvel):
            key.qvel = np.r_[qvel[:dof], qvel[dof + 6 :]]
    if hasattr(spec, "delete"):
        spec.delete(joint)
    else:
        joint.delete()


def _states_of(spec):
    """Return the keyframes that say qpos or qvel, each with both."""
    keys = [(key, np.array(key.qpos), np.array(key.qvel)) for key in spec.keys]
    return [(key, qpos, qvel) for key, qpos, qvel in keys if len(qpos) or len(qvel)]


def _address(spec, body):
    """Return where the first joint of a body begins in qpos and in qvel."""
    place = dof = 0
    for other in _in_order(spec.worldbody):
        if other == body:
            break
        for joint in other.joints:
            in_qpos, in_qvel = _SIZES[joint.type]
            place, dof = place + in_qpos, dof + in_qvel
    return place, dof


def _in_order(body):
    """Yield a body and all below it, as the compiler numbers them."""
    yield body
    for child in _children(body):
        yield from _in_order(child)


def _moving_joints(root):
    """Return the joints of a tree but for free ones."""
    return [joint for body in _in_order(root) for joint in body.joints if joint.type != _FREE]


def _names(elements):
    """Return the names of some elements."""
    return {element.name for element in elements}


def _children(body):
    """Return the bodies that hang on a body itself."""
    children = []
    child = body.first_body()
    while child is not None:
        children.append(child)
        child = body.next_body(child)
    return children
