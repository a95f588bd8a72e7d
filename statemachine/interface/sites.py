"""Which site stands for the fingertip, and which sites move."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence


def usual_site(names: Sequence[str], moving: Sequence[bool] | None = None) -> int | None:
    """Return the number of the site that stands for the fingertip where nobody names one.

    The one that is called gripperframe, else the last that joints move; None if there is none.

    Args:
        names: Of the sites.
        moving: Whether joints move each; None where that is not known.
    """
    if "gripperframe" in names:
        return names.index("gripperframe")
    for site in reversed(range(len(names))):
        if moving is None or moving[site]:
            return site
    return None


def moving_sites(
    site_bodyid: Iterable[int], body_parentid: Sequence[int], jnt_bodyid: Collection[int]
) -> tuple[bool, ...]:
    """Return whether joints move each site.

    Args:
        site_bodyid: The body of each site.
        body_parentid: The parent of each body, in any order.
        jnt_bodyid: The body of each joint.
    """
    moving: list[bool] = []
    for owner in site_bodyid:
        body, above = owner, set[int]()
        while body not in jnt_bodyid and body not in above:
            above.add(body)
            body = body_parentid[body]
        moving.append(body in jnt_bodyid)
    return tuple(moving)
