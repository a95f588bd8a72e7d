"""What a lesson reads of a Data: the place of a fingertip, and the bytes of every array."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import BadInputError, check_name
from ...interface import INPUTS, Array, Contacts, Data, Model
from ...measures.quantities import derived_arrays
from .robot import carried_by, carried_by_joint

FINGERTIP = "gripperframe"


@dataclass(frozen=True)
class Tip:
    """A place on a robot that is read: a site or a body.

    Attributes:
        name: Its name, or "body 7" where it has none.
        kind: "site" or "body".
        number: Its id on the engine.
        body: Id of the body that it is, or that carries it.
        named: Whether the file names it.
    """

    name: str
    kind: Literal["site", "body"]
    number: int
    body: int
    named: bool

    @property
    def array(self) -> str:
        """Return the name of the array of a Data that has its position."""
        return "site_xpos" if self.kind == "site" else "xpos"

    def read(self, data: Data) -> Array:
        """Return its position (3,) [m], by what was last computed."""
        return np.array(getattr(data, self.array)[self.number])


def tips_of(model: Model, name: str | None) -> list[Tip]:
    """Return the places of a robot that are asked for.

    Args:
        model: The robot.
        name: A site, or a body; without one, the site gripperframe where there is one, else
            every body that joints move and that carries no other.

    Raises:
        UnknownNameError: There is no such site or body.
        BadInputError: No name is given, and nothing moves.
    """
    from ...witness import labels  # its room is of no use to other lessons

    sites = labels("site", model.site_names)
    bodies = labels("body", model.body_names)
    wanted = name
    if name is None and FINGERTIP in sites:
        wanted = FINGERTIP
    if wanted is None:
        parents = set(model.body_parentid.tolist())
        moved = carried_by(model, model.jnt_bodyid.tolist())
        leaves = [body for body in sorted(moved) if body not in parents]
        if not leaves:
            raise BadInputError(f"nothing in {model.path.name} is moved by a joint: name a --site")
        return [Tip(bodies[k], "body", k, k, bool(model.body_names[k])) for k in leaves]
    if wanted in sites:
        site = sites.index(wanted)
        named = bool(model.site_names[site])
        return [Tip(wanted, "site", site, int(model.site_bodyid[site]), named)]
    check_name("site or body", wanted, [*sites, *bodies])
    body = bodies.index(wanted)
    return [Tip(wanted, "body", body, body, bool(model.body_names[body]))]


def usual_tip(model: Model, joint: str) -> str:
    """Choose the place that a lesson reads: the fingertip, or what a joint carries.

    It is the site gripperframe if there is one. Else it is the last site that the joint carries,
    or the last body that it carries, or the last body of all.

    Raises:
        BadInputError: None of them has a name.
    """
    if FINGERTIP in model.site_names:
        return FINGERTIP
    carried = carried_by_joint(model, joint)
    sites = zip(model.site_bodyid.tolist(), model.site_names, strict=True)
    bodies = list(enumerate(model.body_names))[1:]  # without the world
    names = [name for body, name in sites if name and body in carried]
    if not names:
        names = [name for body, name in bodies if name and body in carried]
    if not names:
        names = [name for _, name in bodies if name]
    if not names:
        raise BadInputError(
            f"{model.path.name} names no site and no body, and this lesson reads one"
        )
    return names[-1]


def read_stored(data: Data) -> dict[str, bytes]:
    """Return the bytes of every input, and of the time."""
    return {name: np.array(getattr(data, name)).tobytes() for name in (*INPUTS, "time")}


def read_derived(data: Data) -> dict[str, bytes]:
    """Return the bytes of every derived array that this engine gives, contacts among them."""
    return {name: _bytes_of(value) for name, value in derived_arrays(data).items()}


def _bytes_of(value: Array | Contacts) -> bytes:
    """Return the bytes of an array, or those of all that is known of contacts."""
    if isinstance(value, Contacts):
        parts = (value.geom, value.dist, value.pos, value.force)
        return b"".join(part.tobytes() for part in parts)
    return value.tobytes()
