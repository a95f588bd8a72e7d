"""What the text of a file says, and no compiled model keeps, on the list of two files.

It is the largest speed of a joint, and that a file says an effort of 0, which a compiler takes for
no limit, or none at all; and transmissions, which only a controller reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...engines.description.reading import ModelReading
from ...engines.description.records import OF_A_SLIDE
from ...engines.description.urdf import DeclaredJoint, Transmission
from ...interface import JointType
from ..compare.matching import Matched
from .effects import Meaning
from .listing import Listing, share_of
from .locating import Locator
from .records import Value

_UNUSED = "no engine uses it"
_READ_BY_CONTROLLERS = "only a controller reads it"


def enter_declared(
    listing: Listing, readings: Sequence[ModelReading], matched: Matched, locator: Locator
) -> None:
    """Enter what the texts of two files say otherwise.

    Args:
        listing: Where it is entered.
        readings: Both sides.
        matched: What of one is what of the other.
        locator: Where elements stand in the files.
    """
    left, right = (reading.declared for reading in readings)
    if left is None and right is None:
        return
    for a, b in matched.joints:
        names = locator.name(0, "joint", a), locator.name(1, "joint", b)
        joints: list[DeclaredJoint] = []
        for declared, name in zip((left, right), names, strict=True):
            joint = declared.joints.get(name) if declared is not None else None
            joints.append(joint if joint is not None else DeclaredJoint())
        slides = matched.left.jnt_type[a] == JointType.SLIDE
        _enter_speed(listing, locator, names[0], joints, slides)
        if left is not None and right is not None:
            _enter_zero_effort(listing, locator, names[0], joints, slides)
    if left is not None and right is not None:
        _enter_transmissions(listing, locator, left.transmissions, right.transmissions)


def _enter_speed(
    listing: Listing, locator: Locator, name: str, joints: Sequence[DeclaredJoint], slides: bool
) -> None:
    """Enter the largest speed of a joint: an MJCF has no word for it, and no engine stops there."""
    values = joints[0].velocity, joints[1].velocity
    if values[0] == values[1]:
        return
    matters = None not in values
    share = share_of(values) if matters else 0.0
    unit = OF_A_SLIDE["rad/s"] if slides else "rad/s"
    meaning = Meaning(share, _UNUSED, matters=matters)
    listing.enter("speed", locator.find("joint", name), "velocity", values, meaning, unit)


def _enter_zero_effort(
    listing: Listing, locator: Locator, name: str, joints: Sequence[DeclaredJoint], slides: bool
) -> None:
    """Enter an effort of 0 where the other file says none: compiled, both are without a limit."""
    values = joints[0].effort, joints[1].effort
    if None not in values or 0.0 not in values:
        return
    unit = OF_A_SLIDE["N·m"] if slides else "N·m"
    meaning = Meaning(0.0, "MuJoCo takes both for no limit", matters=False)
    listing.enter("effort", locator.find("joint", name), "effort", values, meaning, unit)


def _enter_transmissions(
    listing: Listing,
    locator: Locator,
    left: Mapping[str, Transmission],
    right: Mapping[str, Transmission],
) -> None:
    """Enter transmissions by name."""
    meaning = Meaning(0.0, _READ_BY_CONTROLLERS, matters=False)
    for name in dict.fromkeys((*left, *right)):
        element = locator.find("transmission", name)
        ours, theirs = left.get(name), right.get(name)
        if ours is None or theirs is None:
            there = ["there" if one is not None else "nothing" for one in (ours, theirs)]
            listing.enter("control", element, "transmission", (there[0], there[1]), meaning)
            continue
        quantities: dict[str, tuple[Value, Value]] = {
            "type": (ours.kind, theirs.kind),
            "joints": (", ".join(ours.joints), ", ".join(theirs.joints)),
            "hardwareInterface": (", ".join(ours.interfaces), ", ".join(theirs.interfaces)),
            "mechanicalReduction": (ours.reduction, theirs.reduction),
        }
        for quantity, values in quantities.items():
            if values[0] != values[1]:
                listing.enter("control", element, quantity, values, meaning)
