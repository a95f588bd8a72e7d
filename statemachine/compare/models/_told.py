"""Which figures of a description tell of which difference of compiled models."""

from __future__ import annotations

from dataclasses import dataclass

ANY = frozenset[str]()


@dataclass(frozen=True)
class Told:
    """What of a description tells of a difference: a subject, and figures of it; none: any."""

    subject: str
    figures: frozenset[str] = ANY


def figures_of(text: str) -> frozenset[str]:
    return frozenset(text.split())


CONTACT = Told("contact", figures_of("friction condim priority solref solimp solmix margin gap"))
DRIVE = Told("drive", figures_of("drive count kp kv gain"))
# By the kind of an element and the subject of its difference.
TOLD: dict[str, dict[str, tuple[Told, ...]]] = {
    "body": {
        "mass": (Told("mass"),),
        "centre of mass": (Told("centre of mass"),),
        "inertia": (Told("inertia"),),
        "place": (Told("places", frozenset({"origin", "frame turned", "zero position"})),),
        "zero": (Told("places", frozenset({"zero position"})),),
        "parent": (Told("structure"), Told("places")),
        "joints": (Told("structure"), Told("places", frozenset({"kind"}))),
    },
    "joint": {
        "axis": (Told("places", frozenset({"axis"})),),
        "anchor": (Told("places", frozenset({"axis beside", "origin"})),),
        "range": (Told("limits"),),
        "armature": (Told("armature"),),
        "damping": (Told("damping"),),
        "dry friction": (Told("dry friction"),),
        "spring": (Told("spring", frozenset({"stiffness"})),),
        "rest of the spring": (Told("spring", frozenset({"slack at"})),),
        "force limit": (Told("effort"),),
        "extra joint": (Told("structure"), Told("places", frozenset({"kind"}))),
    },
    "geom": {
        "shape": (Told("shapes"),),
        "hull": (Told("shapes"),),
        "heights": (Told("shapes"),),
        "extra shape": (Told("shapes", frozenset({"shapes"})),),
        "place": (Told("shapes", frozenset({"middle", "turned"})),),
        **dict.fromkeys(
            ("friction", "friction dimensions", "softness", "priority", "margin"), (CONTACT,)
        ),
    },
    "site": {"place": (Told("tool frame"),)},
    "actuator": {
        "gains": (DRIVE,),
        "law": (DRIVE,),
        "gear": (Told("drive", frozenset({"gear"})),),
        "force range": (Told("drive", frozenset({"forcerange"})),),
        "range of ctrl": (Told("drive", frozenset({"ctrlrange"})),),
        "transmission": (DRIVE,),
        "extra actuator": (DRIVE,),
    },
    "equality": {
        "extra equality": (Told("structure", frozenset({"follows"})),),
        "what it keeps": (Told("structure", frozenset({"follows"})),),
    },
}
SETTINGS = ("option", "flag")
# What a row of its own is a matter of, where no description speaks of the difference.
SUBJECTS_OF = {
    ("joint", "force limit"): "effort",
    ("geom", "filter"): "contact",
    **{("geom", each): "contact" for each in ("adhesion", "moving surface")},
}
# Figures of a description that sum up others.
WHOLE_LINK = frozenset({"shapes", "volume", *(f"ends at {s}{a}" for a in "xyz" for s in "+-")})
FLAGS = frozenset({"turned on", "turned off"})
WEIGHTS = ("centre of mass", "inertia")  # of bodies that are fixed to each other, together
