"""Small models drawn by seed: every transmission, empty tables, elements without names.

A model is drawn as a tree of elements, as they stand in the file. What others refer to needs a
name in an MJCF; what nobody refers to often has none, as in many public files.
"""

from __future__ import annotations

import copy
import random
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element, SubElement, tostring

_NAMED = 0.7  # of elements that may have a name
_LENGTHS = ("0.05", "0.1", "0.2", "0.3")  # m
_AXES = ("1 0 0", "0 1 0", "0 0 1", "0.6 0 0.8")
_SOLREF = ("0.02 1", "0.005 0.7", "-100 -10")
_TETRAHEDRON = "0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"
_FRAMES = ("body", "xbody", "geom", "site", "camera")  # what a sensor of a frame may be of
_ACTUATORS = (
    *("motor", "motor", "position", "position", "velocity", "general", "general", "general body"),
    *("damper", "intvelocity", "cylinder", "adhesion", "orientation", "pid"),
)
# What an actuator of a kind cannot do without.
_GAINS: dict[str, dict[str, str]] = {
    "position": {"kp": "5"},
    "velocity": {"kv": "0.5"},
    "damper": {"kv": "0.5", "ctrlrange": "0 1"},
    "adhesion": {"ctrlrange": "0 1"},
    "intvelocity": {"kp": "5", "actrange": "-1 1"},
    "orientation": {"kp": "5"},
    "pid": {"kp": "5"},
}
# Attributes by which an element refers to others, so that a name that is changed is changed there.
_REFERENCES = {
    *("joint", "joint1", "joint2", "jointinparent", "body", "body1", "body2", "geom", "geom1"),
    *("geom2", "site", "site1", "site2", "refsite", "cranksite", "slidersite", "sidesite"),
    *("tendon", "tendon1", "tendon2", "actuator", "objname", "refname", "subtree1", "subtree2"),
    *("camera", "mesh", "hfield", "material", "texture", "target"),
}


@dataclass
class Names:
    """Names of what a model has so far, by kind, and how many numbers its state takes."""

    of: dict[str, list[str]] = field(default_factory=dict)
    given: int = 0
    qpos: list[str] = field(default_factory=list)  # of the default state, a text for each joint
    nv: int = 0
    nmocap: int = 0
    nu: int = 0

    def known(self, *kinds: str) -> list[str]:
        """Return the names of these kinds."""
        return [name for kind in kinds for name in self.of.get(kind, [])]


class Drawer:
    """Draws one model.

    Args:
        draw: What all is drawn from.
    """

    def __init__(self, draw: random.Random) -> None:
        self.draw = draw
        self.names = Names()

    def model(self) -> Element:
        """Return the root element of a model."""
        root = Element("mujoco", model=self.draw.choice(["m", "", "robot"]))
        SubElement(root, "compiler", angle="radian")
        self._option(root)
        self._assets(root)
        world = SubElement(root, "worldbody")
        self._world(world)
        self._contacts(root)
        self._tendons(root)
        self._actuators(root)
        self._equalities(root)
        self._sensors(root)
        self._custom(root)
        self._keyframes(root)
        return root

    # What all elements share.

    def chance(self, share: float) -> bool:
        """Return True in this share of draws."""
        return self.draw.random() < share

    def named(self, element: Element, kind: str, share: float = _NAMED) -> None:
        """Give an element a name of its kind, or none."""
        if not self.chance(share):
            return
        self.names.given += 1
        name = f"{kind[:2]}{self.names.given}"
        element.set("name", name)
        self.names.of.setdefault(kind, []).append(name)

    def number(self, low: float, high: float) -> str:
        """Return a number of few digits as text."""
        return f"{self.draw.uniform(low, high):.3g}"

    def vector(self, size: float, length: int = 3) -> str:
        """Return numbers from -size to size as text."""
        return " ".join(self.number(-size, size) for _ in range(length))

    def _user(self, element: Element) -> None:
        if self.chance(0.1):
            element.set("user", self.vector(1, self.draw.randint(1, 3)))

    # The parts of a file, in their order.

    def _option(self, root: Element) -> None:
        option = SubElement(root, "option")
        option.set("timestep", self.draw.choice(["0.002", "0.005", "0.01"]))
        if self.chance(0.5):
            integrators = ["Euler", "RK4", "implicit", "implicitfast"]
            option.set("integrator", self.draw.choice(integrators))
        if self.chance(0.2):
            option.set("gravity", self.draw.choice(["0 0 0", "0 0 -3.7", "1 0 -9.81"]))
        if self.chance(0.1):
            option.set("density", "1.2")
        if self.chance(0.2):
            flag = SubElement(option, "flag")
            names = ["contact", "gravity", "limit", "equality", "actuation", "clampctrl"]
            flag.set(self.draw.choice(names), "disable")
        if self.chance(0.1):
            SubElement(root, "statistic", extent="2", center="0 0 1")

    def _assets(self, root: Element) -> None:
        asset = SubElement(root, "asset")
        if self.chance(0.3):
            mesh = SubElement(asset, "mesh", vertex=_TETRAHEDRON)
            self.named(mesh, "mesh", 1.0)
        if self.chance(0.1):
            field_ = SubElement(asset, "hfield", nrow="2", ncol="3", size="1 1 0.1 0.1")
            field_.set("elevation", "0 0.1 0  0.2 0 0.1")
            self.named(field_, "hfield", 1.0)
        if self.chance(0.2):
            texture = SubElement(asset, "texture", type="2d", builtin="checker")
            texture.attrib |= {"width": "8", "height": "8", "rgb1": "1 1 1", "rgb2": "0 0 0"}
            self.named(texture, "texture", 1.0)
            material = SubElement(asset, "material", texture=texture.get("name", ""))
            self.named(material, "material", 1.0)

    def _world(self, world: Element) -> None:
        if self.chance(0.5):
            floor = SubElement(world, "geom", type="plane", size="5 5 0.1")
            self.named(floor, "geom")
        elif fields := self.names.known("hfield"):
            self.named(SubElement(world, "geom", type="hfield", hfield=fields[0]), "geom")
        self._sights(world)
        if self.chance(0.3):
            self._site(world)
        for _ in range(self.draw.choice([0, 1, 1, 1, 2, 2, 3])):
            self._body(world, 0)
        if self.chance(0.3):
            self._mocap(world)

    def _sights(self, body: Element) -> None:
        """Add a light and a camera, now and then."""
        if self.chance(0.1):
            SubElement(body, "light", pos=self.vector(1))
        if self.chance(0.1):
            self.named(SubElement(body, "camera", pos=self.vector(1)), "camera")

    def _mocap(self, world: Element) -> None:
        """Add a mocap body, sometimes with a body fixed to it."""
        body = SubElement(world, "body", mocap="true", pos=self.vector(0.5))
        self.named(body, "body")
        self.names.nmocap += 1
        if self.chance(0.7):
            self._geom(body)
        if self.chance(0.5):
            self._site(body)
        if self.chance(0.2):
            child = SubElement(body, "body", pos=self.vector(0.2))
            self.named(child, "body")
            self._geom(child)

    def _body(self, parent: Element, depth: int) -> None:
        body = SubElement(parent, "body", pos=self.vector(0.3))
        if depth == 0:
            body.set("pos", f"{self.vector(0.5, 2)} {self.number(0.2, 1)}")
        self.named(body, "body")
        self._user(body)
        if self.chance(0.3):
            body.set("euler", self.vector(1))
        if self.chance(0.1):
            body.set("gravcomp", self.draw.choice(["1", "0.5"]))
        moves = self._joints(body, depth)
        weighs = moves and self.chance(0.3)
        if weighs:
            inertial = SubElement(body, "inertial", pos=self.vector(0.05), mass="0.5")
            inertial.set("diaginertia", "0.002 0.003 0.004")
        shapes = self.draw.choice([0, 1, 1, 2]) if weighs or not moves else self.draw.choice([1, 2])
        for _ in range(shapes):
            self._geom(body)
        for _ in range(self.draw.choice([0, 0, 1, 2])):
            self._site(body)
        self._sights(body)
        if depth < 3:
            for _ in range(self.draw.choice([0, 0, 1, 1, 2])):
                self._body(body, depth + 1)

    def _joints(self, body: Element, depth: int) -> bool:
        """Add what a body moves by; whether it moves."""
        kinds = [[], ["hinge"], ["hinge"], ["slide"], ["ball"], ["slide", "hinge"], ["hinge"] * 2]
        if depth == 0:
            kinds += [["free"], ["freejoint"]]
        chosen = self.draw.choice(kinds)
        for kind in chosen:
            if kind in ("free", "freejoint"):
                self._free(body, kind)
            else:
                self._joint(body, kind)
        return bool(chosen)

    def _free(self, body: Element, kind: str) -> None:
        """Add a free joint, written in one of the two ways."""
        if kind == "freejoint":
            joint = SubElement(body, "freejoint")
        else:
            joint = SubElement(body, "joint", type="free")
        self.named(joint, "free joint")
        self.names.qpos.append("0 0 0.5 1 0 0 0")
        self.names.nv += 6

    def _joint(self, body: Element, kind: str) -> None:
        """Add a ball, a hinge or a slide."""
        joint = SubElement(body, "joint", type=kind)
        self._user(joint)
        if kind == "ball":
            self.named(joint, "ball joint")
            self.names.qpos.append("1 0 0 0")
            self.names.nv += 3
            ranges = ["0 1"]
        else:
            self.named(joint, "scalar joint")
            self.names.qpos.append("0.1")
            self.names.nv += 1
            ranges = ["-1 1", "0 0.5", "-0.3 2"]
            joint.set("axis", self.draw.choice(_AXES))
            if self.chance(0.1):
                joint.attrib |= {"ref": "0.1", "springref": "0.2"}
            if self.chance(0.1):
                joint.set("actuatorfrcrange", "-3 3")
        if self.chance(0.4):
            joint.set("range", self.draw.choice(ranges))
        if self.chance(0.3):
            joint.set("pos", self.vector(0.1))
        for name, value in (
            ("damping", "0.5"),
            ("armature", "0.01"),
            ("frictionloss", "0.1"),
            ("stiffness", "2"),
        ):
            if self.chance(0.2):
                joint.set(name, value)

    def _geom(self, body: Element) -> None:
        sizes = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
        kind = self.draw.choice([*sizes, "mesh"])
        geom = SubElement(body, "geom")
        if kind == "mesh" and (meshes := self.names.known("mesh")):
            geom.attrib |= {"type": "mesh", "mesh": meshes[0]}
        else:
            kind = "sphere" if kind == "mesh" else kind
            size = " ".join(self.draw.choice(_LENGTHS) for _ in range(sizes[kind]))
            geom.attrib |= {"type": kind, "size": size}
        # A tendon wraps spheres and cylinders only.
        self.named(geom, f"{kind} geom" if kind in ("sphere", "cylinder") else "geom")
        self._user(geom)
        if self.chance(0.4):
            geom.set("mass", self.number(0.1, 2))
        if self.chance(0.3):
            geom.set("pos", self.vector(0.1))
        if self.chance(0.3):
            geom.attrib |= {"contype": "0", "conaffinity": "0"}
        elif self.chance(0.2):
            geom.attrib |= {"friction": "0.5 0.01 0.001", "condim": self.draw.choice("1346")}
        if materials := self.names.known("material") * self.chance(0.2):
            geom.set("material", materials[0])
        if self.chance(0.05):
            geom.set("fluidshape", "ellipsoid")

    def _site(self, body: Element) -> None:
        site = SubElement(body, "site", pos=self.vector(0.2))
        self.named(site, "site", 0.8)
        self._user(site)
        if self.chance(0.3):
            site.set("euler", self.vector(1))

    def _contacts(self, root: Element) -> None:
        contact = SubElement(root, "contact")
        bodies = self.names.known("body")
        if len(bodies) >= 2 and self.chance(0.2):
            first, second = self.draw.sample(bodies, 2)
            self.named(SubElement(contact, "exclude", body1=first, body2=second), "exclude")
        geoms = self.names.known("geom", "sphere geom", "cylinder geom")
        if len(geoms) >= 2 and self.chance(0.2):
            first, second = self.draw.sample(geoms, 2)
            pair = SubElement(contact, "pair", geom1=first, geom2=second)
            self.named(pair, "pair")
            if self.chance(0.5):
                pair.attrib |= {"condim": "3", "solref": self.draw.choice(_SOLREF)}

    def _tendons(self, root: Element) -> None:
        tendons = SubElement(root, "tendon")
        joints, sites = self.names.known("scalar joint"), self.names.known("site")
        if joints and self.chance(0.4):
            fixed = SubElement(tendons, "fixed")
            self._tendon(fixed)
            for joint in self.draw.sample(joints, min(len(joints), self.draw.choice([1, 2]))):
                SubElement(fixed, "joint", joint=joint, coef=self.number(-2, 2))
        if len(sites) >= 2 and self.chance(0.4):
            spatial = SubElement(tendons, "spatial")
            self._tendon(spatial)
            first, second = self.draw.sample(sites, 2)
            SubElement(spatial, "site", site=first)
            round_ = self.names.known("sphere geom", "cylinder geom")
            if round_ and self.chance(0.4):
                wrap = SubElement(spatial, "geom", geom=self.draw.choice(round_))
                if self.chance(0.5):
                    wrap.set("sidesite", self.draw.choice(sites))
            SubElement(spatial, "site", site=second)
            if len(sites) >= 4 and self.chance(0.3):
                SubElement(spatial, "pulley", divisor="2")
                for site in self.draw.sample(sites, 2):
                    SubElement(spatial, "site", site=site)

    def _tendon(self, tendon: Element) -> None:
        self.named(tendon, "tendon", 0.8)
        self._user(tendon)
        for name, value in (
            ("range", "0 1"),
            ("stiffness", "5"),
            ("damping", "0.3"),
            ("frictionloss", "0.1"),
            ("actuatorfrcrange", "-2 2"),
        ):
            if self.chance(0.2):
                tendon.set(name, value)

    def _actuators(self, root: Element) -> None:
        actuators = SubElement(root, "actuator")
        for _ in range(self.draw.choice([0, 1, 1, 2, 3, 4])):
            self._actuator(actuators)

    def _transmission(self) -> dict[str, str]:
        """Return the attributes of one of the transmissions that are possible here; or none."""
        scalars, balls = self.names.known("scalar joint"), self.names.known("ball joint")
        joints = scalars + balls + self.names.known("free joint")
        sites, tendons = self.names.known("site"), self.names.known("tendon")
        ways: list[dict[str, str]] = []
        if joints:
            ways.append({"joint": self.draw.choice(scalars or joints)})
            ways.append({"joint": self.draw.choice(joints), "gear": self.vector(2, 6)})
        if scalars + balls:
            ways.append({"jointinparent": self.draw.choice(scalars + balls)})
        if tendons:
            ways.append({"tendon": self.draw.choice(tendons)})
        if sites:
            ways.append({"site": self.draw.choice(sites), "gear": "0 0 1 0 0 0"})
        if len(sites) >= 2:
            first, second = self.draw.sample(sites, 2)
            ways.append({"site": first, "refsite": second, "gear": self.vector(1, 6)})
            ways.append({"cranksite": first, "slidersite": second, "cranklength": "0.5"})
        return self.draw.choice(ways) if ways else {}

    def _actuator(self, actuators: Element) -> None:
        kind = self.draw.choice(_ACTUATORS)
        way = self._target(kind)
        if not way:
            return
        actuator = SubElement(actuators, kind.removesuffix(" body"), way)
        self.named(actuator, "actuator")
        self._user(actuator)
        self.names.nu += 1
        if kind == "orientation":
            self.names.nu += 2
        if kind == "pid" and self.chance(0.5):
            actuator.set("input", "pos vel")
            self.names.nu += 1
        for name, value in _GAINS.get(kind, {}).items():
            actuator.set(name, value)
        if "ctrlrange" not in actuator.attrib and self.chance(0.5):
            actuator.set("ctrlrange", self.draw.choice(["-1 1", "0 5", "-0.3 0.2"]))
        if actuator.tag == "general":
            self._dynamics(actuator)
        if kind != "orientation" and self.chance(0.3):
            actuator.set("forcerange", "-2 2")
        if kind in ("motor", "position") and self.chance(0.1):
            actuator.attrib |= {"delay": "0.02", "nsample": "12"}
        if self.chance(0.1):
            actuator.set("group", "1")

    def _target(self, kind: str) -> dict[str, str]:
        """Return the attributes of what an actuator of a kind acts on; none where there is none."""
        if kind in ("adhesion", "general body"):
            targets = self.names.known("body")
            return {"body": self.draw.choice(targets)} if targets else {}
        if kind == "orientation":
            targets = self.names.known("ball joint")
            return {"joint": self.draw.choice(targets)} if targets else {}
        return self._transmission()

    def _dynamics(self, actuator: Element) -> None:
        """Give a general actuator a state of its own and gains, now and then."""
        dynamics = self.draw.choice(["none", "integrator", "filter", "filterexact"])
        if dynamics != "none":
            actuator.attrib |= {"dyntype": dynamics, "dynprm": "0.1"}
        if self.chance(0.5):
            actuator.attrib |= {"gainprm": "3", "biastype": "affine", "biasprm": "0 -3 -0.1"}

    def _equalities(self, root: Element) -> None:
        equalities = SubElement(root, "equality")
        bodies, sites = self.names.known("body"), self.names.known("site")
        ways: list[tuple[str, dict[str, str]]] = []
        if len(bodies) >= 2:
            first, second = self.draw.sample(bodies, 2)
            ways.append(("connect", {"body1": first, "body2": second, "anchor": self.vector(0.1)}))
            ways.append(("weld", {"body1": first, "body2": second}))
            ways.append(("weld", {"body1": first, "anchor": "0 0 0"}))
        if len(sites) >= 2:
            first, second = self.draw.sample(sites, 2)
            kind = self.draw.choice(["connect", "weld"])
            ways.append((kind, {"site1": first, "site2": second}))
        for kind, name in (("joint", "scalar joint"), ("tendon", "tendon")):
            known = self.names.known(name)
            if known:
                ways.append((kind, {f"{kind}1": known[0]}))
            if len(known) >= 2:
                ends = dict(zip((f"{kind}1", f"{kind}2"), self.draw.sample(known, 2), strict=True))
                ways.append((kind, {**ends, "polycoef": "0 1 0 0 0"}))
        if not ways:
            return
        for _ in range(self.draw.choice([0, 0, 1, 2])):
            kind, attributes = self.draw.choice(ways)
            equality = SubElement(equalities, kind, attributes)
            self.named(equality, "equality")
            if self.chance(0.2):
                equality.set("active", "false")
            if self.chance(0.2):
                equality.set("solref", self.draw.choice(_SOLREF))

    def _sensors(self, root: Element) -> None:
        sensors = SubElement(root, "sensor")
        known = self.names.known
        ways: list[tuple[str, dict[str, str]]] = [("clock", {}), ("e_kinetic", {})]
        ways.append(("user", {"dim": "2", "needstage": "pos", "datatype": "real"}))
        for kinds, attribute, names in (
            (("touch", "accelerometer", "gyro", "force", "torque", "velocimeter", "magnetometer"),
             "site", known("site")),
            (("jointpos", "jointvel", "jointactuatorfrc"), "joint", known("scalar joint")),
            (("ballquat", "ballangvel"), "joint", known("ball joint")),
            (("tendonpos", "tendonvel"), "tendon", known("tendon")),
            (("actuatorpos", "actuatorvel", "actuatorfrc"), "actuator", known("actuator")),
            (("subtreecom", "subtreelinvel", "subtreeangmom"), "body", known("body")),
            (("rangefinder",), "site", known("site")),
        ):  # fmt: skip
            ways += [(kind, {attribute: self.draw.choice(names)}) for kind in kinds if names]
        for kind in _FRAMES:
            of = known("body" if kind == "xbody" else kind)
            if of:
                way = {"objtype": kind, "objname": self.draw.choice(of)}
                ways.append((self.draw.choice(["framepos", "framequat"]), way))
                reference = {"reftype": kind, "refname": self.draw.choice(of)}
                ways.append(("framepos", {**way, **reference}))
                ways.append((self.draw.choice(["framelinvel", "frameangacc"]), way))
        bodies, geoms = known("body"), known("geom", "sphere geom", "cylinder geom")
        if len(geoms) >= 2:
            first, second = self.draw.sample(geoms, 2)
            ways.append(("distance", {"geom1": first, "geom2": second, "cutoff": "1"}))
            ways.append(("contact", {"geom1": first}))
        if len(bodies) >= 2:
            first, second = self.draw.sample(bodies, 2)
            ways.append(("contact", {"subtree1": first, "body2": second, "num": "2"}))
        for _ in range(self.draw.choice([0, 0, 1, 2, 3])):
            kind, attributes = self.draw.choice(ways)
            self.named(SubElement(sensors, kind, attributes), "sensor")

    def _custom(self, root: Element) -> None:
        custom = SubElement(root, "custom")
        if self.chance(0.2):
            self.named(SubElement(custom, "numeric", data=self.vector(1, 2)), "numeric", 1.0)
        if self.chance(0.1):
            self.named(SubElement(custom, "text", data="some words"), "text", 1.0)
        bodies = self.names.known("body")
        if bodies and self.chance(0.1):
            tuple_ = SubElement(custom, "tuple")
            self.named(tuple_, "tuple", 1.0)
            SubElement(tuple_, "element", objtype="body", objname=bodies[0], prm="1")

    def _keyframes(self, root: Element) -> None:
        keyframe = SubElement(root, "keyframe")
        for number in range(self.draw.choice([0, 0, 1, 2])):
            key = SubElement(keyframe, "key")
            if number == 0 and self.chance(0.5):
                key.set("name", "home")
            elif self.chance(0.5):
                key.set("name", f"key{number}")
            if self.chance(0.5):
                key.set("time", self.number(0, 3))
            if self.names.qpos and self.chance(0.5):
                key.set("qpos", " ".join(self.names.qpos))
            if self.names.nv and self.chance(0.3):
                key.set("qvel", self.vector(0.5, self.names.nv))
            if self.names.nu and self.chance(0.5):
                key.set("ctrl", self.vector(0.5, self.names.nu))
            if self.names.nmocap and self.chance(0.5):
                key.set("mpos", self.vector(0.5, 3 * self.names.nmocap))


def drawn(draw: random.Random) -> Element:
    """Draw a model."""
    return Drawer(draw).model()


def text_of(model: Element) -> str:
    """Return a model as the text of an MJCF; sections without an entry are left out."""
    whole = copy.deepcopy(model)
    for section in list(whole):
        if len(section) == 0 and not section.attrib and section.tag != "worldbody":
            whole.remove(section)
    return tostring(whole, encoding="unicode")


def changed(draw: random.Random, model: Element) -> Element:
    """Return a copy of a model with a few changes, as two files of one robot differ."""
    other = copy.deepcopy(model)
    for _ in range(draw.choice([0, 1, 1, 2, 3])):
        draw.choice([_scaled, _scaled, _scaled, _removed, _renamed, _unnamed, _shuffled, _doubled])(
            draw, other
        )
    return other


def _parts(model: Element) -> list[tuple[Element, Element]]:
    """Return all elements below the sections of a model, each behind what it is in."""
    sections = [section for section in model if section.tag not in ("compiler", "option")]
    return [(parent, child) for part in sections for parent in part.iter() for child in parent]


def _referred_to(model: Element) -> set[str]:
    """Return the names that some element refers to."""
    return {
        value
        for element in model.iter()
        for attribute, value in element.attrib.items()
        if attribute in _REFERENCES
    }


def _scaled(draw: random.Random, model: Element) -> None:
    """Change a number."""
    places: list[tuple[Element, str]] = []
    for _, element in _parts(model):
        for attribute, value in element.attrib.items():
            numeric = attribute not in _REFERENCES and attribute not in ("name", "type", "input")
            if numeric and value[-1:].isdigit():
                places.append((element, attribute))
    if not places:
        return
    element, attribute = draw.choice(places)
    numbers = element.attrib[attribute].split()
    place = draw.randrange(len(numbers))
    try:
        value = float(numbers[place]) * draw.choice([0.5, 0.9, 1.1, -1.0])
    except ValueError:
        return
    numbers[place] = f"{value:.6g}"
    element.set(attribute, " ".join(numbers))


def _removed(draw: random.Random, model: Element) -> None:
    """Take an element away; what refers to it may then be refused."""
    parts = _parts(model)
    if parts:
        parent, element = draw.choice(parts)
        parent.remove(element)


def _renamed(draw: random.Random, model: Element) -> None:
    """Give an element another name, and call it so wherever it is referred to."""
    named = [element for _, element in _parts(model) if element.get("name")]
    if not named:
        return
    element = draw.choice(named)
    old = element.attrib["name"]
    element.set("name", f"{old}_other")
    for other in model.iter():
        for attribute, value in list(other.attrib.items()):
            if attribute in _REFERENCES and value == old:
                other.set(attribute, f"{old}_other")


def _unnamed(draw: random.Random, model: Element) -> None:
    """Take the name of an element that nothing refers to."""
    needed = _referred_to(model)
    named = [
        part for _, part in _parts(model) if part.get("name") and part.get("name") not in needed
    ]
    if named:
        del draw.choice(named).attrib["name"]


def _shuffled(draw: random.Random, model: Element) -> None:
    """Put the elements of a section, or of a body, into another order."""
    groups = [element for element in model.iter() if len(element) > 1 and element is not model]
    if groups:
        group = draw.choice(groups)
        group[:] = draw.sample(list(group), len(group))


def _doubled(draw: random.Random, model: Element) -> None:
    """Add an element once more, without a name."""
    parts = _parts(model)
    if not parts:
        return
    parent, element = draw.choice(parts)
    twin = copy.deepcopy(element)
    for part in twin.iter():
        part.attrib.pop("name", None)
    parent.append(twin)
