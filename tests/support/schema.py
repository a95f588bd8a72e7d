"""Edits of one attribute of an MJCF, drawn by a seed from the schema that MuJoCo prints.

Which elements and attributes there are is the schema's word alone. What may stand there is decided
by a small rule for each type of attribute. An attribute without a rule is counted, and named.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

_ROW = re.compile(r"^( *)(\S+) \(.\)\s*(.*)$")
_INDENT = 3  # columns of a level
_BODIES = "(world)body"


@dataclass(frozen=True)
class SchemaAttribute:
    """An attribute that MuJoCo's schema has.

    Attributes:
        parent: Tag of the element around it; "" of none.
        tag: Of the element.
        name: Of the attribute.
    """

    parent: str
    tag: str
    name: str

    def __str__(self) -> str:
        return f"{self.parent}/{self.tag}/{self.name}"

    def elements(self, root: Element) -> Iterator[Element]:
        """Yield the elements of a file that can have it."""
        parents = {child: element for element in root.iter() for child in element}
        around = ("body", "worldbody") if self.parent == _BODIES else (self.parent,)
        tag = "body" if self.tag == _BODIES else self.tag
        for element in root.iter(tag):
            if self.tag == _BODIES or (element in parents and parents[element].tag in around):
                yield element


def schema_attributes() -> list[SchemaAttribute]:
    """Return every attribute of the schema that this MuJoCo prints, in its order."""
    attributes: list[SchemaAttribute] = []
    path: list[str] = []
    for line in mujoco.mj_printSchema(False, False).splitlines():
        row = _ROW.match(line)
        if row is not None:
            path = [*path[: len(row[1]) // _INDENT], row[2]]
        names = row[3] if row is not None else line
        parent = path[-2] if len(path) > 1 else ""
        attributes += [SchemaAttribute(parent, path[-1], name) for name in names.split()]
    return list(dict.fromkeys(attributes))


class Rule(ABC):
    """Which values an attribute may have."""

    @abstractmethod
    def draw(self, random: np.random.Generator, root: Element) -> str:
        """Return a value as an MJCF has it, for an element of a file."""


@dataclass(frozen=True)
class Real(Rule):
    """Numbers in a range."""

    low: float
    high: float
    count: int = 1

    def draw(self, random: np.random.Generator, root: Element) -> str:
        return _words(random.uniform(self.low, self.high, self.count))


@dataclass(frozen=True)
class Whole(Rule):
    """Whole numbers from the first to the last."""

    low: int
    high: int
    count: int = 1

    def draw(self, random: np.random.Generator, root: Element) -> str:
        return " ".join(
            str(number) for number in random.integers(self.low, self.high + 1, self.count)
        )


@dataclass(frozen=True)
class Ends(Rule):
    """A range: two numbers, the larger one last."""

    low: float
    high: float

    def draw(self, random: np.random.Generator, root: Element) -> str:
        return _words(np.sort(random.uniform(self.low, self.high, 2)))


@dataclass(frozen=True)
class Direction(Rule):
    """Numbers of length 1: an axis, or a quaternion."""

    count: int

    def draw(self, random: np.random.Generator, root: Element) -> str:
        numbers = random.normal(size=self.count)
        return _words(numbers / np.linalg.norm(numbers))


@dataclass(frozen=True)
class Moments(Rule):
    """Three moments of inertia, none of which is larger than the others together."""

    most: float

    def draw(self, random: np.random.Generator, root: Element) -> str:
        return _words(random.uniform(self.most / 2, self.most, 3))


@dataclass(frozen=True)
class Frame(Rule):
    """Two axes that are perpendicular."""

    def draw(self, random: np.random.Generator, root: Element) -> str:
        matrix = np.linalg.qr(random.normal(size=(3, 3)))[0]
        return _words(matrix[:, :2].T.ravel())


@dataclass(frozen=True)
class OneOf(Rule):
    """One of some words."""

    words: tuple[str, ...]

    def draw(self, random: np.random.Generator, root: Element) -> str:
        return self.words[int(random.integers(len(self.words)))]


@dataclass(frozen=True)
class NameOf(Rule):
    """The name of an element of a file."""

    tags: tuple[str, ...]

    def draw(self, random: np.random.Generator, root: Element) -> str:
        around = {element: parent for parent in root.iter() for element in parent}
        names: list[str] = []
        for element in root.iter():
            is_coupling = element in around and around[element].tag == "equality"
            if element.tag in self.tags and element.get("name") and not is_coupling:
                names.append(element.attrib["name"])
        return names[int(random.integers(len(names)))]


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.6g}" for number in numbers)


def _one_of(words: str) -> OneOf:
    return OneOf(tuple(words.split()))


_YES_OR_NO = _one_of("true false")
_LIMITED = _one_of("true false auto")
_SWITCH = _one_of("enable disable")
_SOLREF = OneOf(("0.05 1", "0.1 0.7", "0.01 1.5", "-300 -5"))
_SOLIMP = OneOf(("0.5 0.6 0.01", "0.95 0.99 0.005 0.3 3", "0.8 0.9 0.002"))
_COLOUR = Real(0, 1, 4)
_SMALL = Real(0.001, 0.1)
_PLACE = Real(-0.05, 0.05, 3)

# By the name of an attribute, which has one type wherever it stands; else below.
RULES: dict[str, Rule] = {
    # Places and turns.
    **dict.fromkeys(("pos", "origin", "anchor", "refpos"), _PLACE),
    "quat": Direction(4),
    "euler": Real(-0.5, 0.5, 3),
    "axisangle": OneOf(("0 1 0 0.3", "1 0 0 -0.2", "1 1 0 0.1")),
    "xyaxes": Frame(),
    "zaxis": Direction(3),
    "axis": Direction(3),
    "fromto": Real(-0.15, 0.15, 6),
    "refquat": Direction(4),
    # Joints, tendons, actuators.
    **dict.fromkeys(("damping", "armature", "frictionloss"), _SMALL),
    "stiffness": Real(0.5, 30),
    **dict.fromkeys(("springref", "ref"), Real(-0.2, 0.2)),
    "springdamper": Real(0.1, 1, 2),
    "springyield": Real(0.01, 1),
    "springlength": Ends(0, 0.3),
    **dict.fromkeys(("margin", "gap"), Real(0.001, 0.05)),
    "range": Ends(-0.5, 0.5),
    **dict.fromkeys(("limited", "ctrllimited", "forcelimited", "actlimited"), _LIMITED),
    "actuatorfrclimited": _LIMITED,
    **dict.fromkeys(("actuatorfrcrange", "forcerange"), OneOf(("-1 1", "-0.1 0.3", "-3 2"))),
    **dict.fromkeys(("ctrlrange", "actrange"), OneOf(("-0.2 0.3", "0 0.5", "-1 1"))),
    **dict.fromkeys(("velrange", "posrange", "ffrange"), OneOf(("-0.2 0.3", "-1 1"))),
    **dict.fromkeys(("actuatorgravcomp", "active", "actearly"), _YES_OR_NO),
    "coef": Real(-2, 2),
    "divisor": Real(1, 3),
    "gear": Real(-2, 2, 6),
    "kp": Real(1, 80),
    **dict.fromkeys(("kv", "ki", "imax", "slewmax"), Real(0.05, 3)),
    "dampratio": Real(0.2, 1.2),
    "timeconst": Real(0.01, 0.2),
    "gainprm": Real(0.1, 30),
    "biasprm": Real(-5, 5, 3),
    "dynprm": Real(0.01, 0.2),
    "dyntype": _one_of("none integrator filter filterexact"),
    "gaintype": _one_of("fixed affine"),
    "biastype": _one_of("none affine"),
    "cranklength": Real(0.3, 0.6),
    "inheritrange": Real(0.5, 1),
    "delay": OneOf(("0.004", "0.01")),
    "nsample": Whole(6, 9),
    "interp": _one_of("zoh linear cubic"),
    "lengthrange": OneOf(("0.1 0.5", "0 1")),
    **dict.fromkeys(("area", "diameter"), Real(0.2, 2)),
    "bias": Real(-2, 2, 3),
    "gain": Real(1, 10),
    **dict.fromkeys(("lmin", "fpmax", "fvmax"), Real(0.6, 0.9)),
    **dict.fromkeys(("lmax", "vmax"), Real(1.2, 2)),
    "tausmooth": _SMALL,
    "motorconst": Real(0.02, 0.2),
    "resistance": Real(0.5, 4),
    "inductance": OneOf(("0.01 0", "0 0.01")),
    "cogging": Real(0.01, 0.1, 3),
    "lugre": Real(0.01, 1, 5),
    "thermal": Real(0.1, 1, 6),
    "saturation": Real(0.1, 1, 3),
    "nominal": Real(0.1, 1, 3),
    "controller": Real(0.1, 1, 6),
    "polycoef": Real(-1, 1, 5),
    "torquescale": Real(0.1, 3),
    "relpose": OneOf(("0.1 0 0 1 0 0 0", "0 0.05 0 0.9 0.1 0 0")),
    # Contacts.
    **dict.fromkeys(("solref", "solreflimit", "solreffriction"), _SOLREF),
    **dict.fromkeys(("solimp", "solimplimit", "solimpfriction"), _SOLIMP),
    "friction": OneOf(("0.2", "0.5 0.01", "1.5 0.1 0.001")),
    **dict.fromkeys(("contype", "conaffinity"), Whole(0, 3)),
    "condim": _one_of("1 3 4 6"),
    "priority": Whole(0, 2),
    "solmix": Real(0.2, 4),
    "adhesion": Real(0.1, 2),
    "surfacevel": Real(-0.3, 0.3, 6),
    # Shapes and what they weigh.
    "size": Real(0.01, 0.06, 3),
    "mass": Real(0.05, 1),
    "density": Real(200, 3000),
    "shellinertia": _YES_OR_NO,
    "fluidshape": _one_of("none ellipsoid"),
    "fluidcoef": Real(0.1, 1.5, 5),
    "fitscale": Real(0.5, 1.5),
    "diaginertia": Moments(0.002),
    "fullinertia": OneOf(("0.002 0.0018 0.001 0.0001 0 0", "0.001 0.001 0.001 0 0.0001 0")),
    "gravcomp": Real(0.2, 1.5),
    "mocap": _YES_OR_NO,
    "sleep": _one_of("auto never allowed"),
    "simple": _one_of("false auto"),
    "fuse": _one_of("false auto"),
    "align": _LIMITED,
    # Deformable bodies.
    "radius": Real(0.003, 0.008),
    "young": Real(50, 900),
    "poisson": Real(0, 0.4),
    "thickness": Real(0.002, 0.01),
    "elastic2d": _one_of("none bend stretch both"),
    "selfcollide": _one_of("none narrow bvh sap auto"),
    "activelayers": Whole(1, 3),
    **dict.fromkeys(("rigid", "flatskin", "passive"), _YES_OR_NO),
    "spacing": Real(0.03, 0.07, 3),
    "count": OneOf(("3 2 1", "2 2 1", "4 3 1")),
    "inertiabox": Real(0.002, 0.01),
    "id": OneOf(("0", "0 1 2", "4")),
    **dict.fromkeys(("shear", "yield"), Real(0.1, 10)),
    # References.
    **dict.fromkeys(("joint", "joint1", "joint2", "jointinparent"), NameOf(("joint",))),
    **dict.fromkeys(("site", "refsite", "cranksite", "slidersite"), NameOf(("site",))),
    **dict.fromkeys(("sidesite", "site1", "site2"), NameOf(("site",))),
    **dict.fromkeys(("body", "body1", "body2"), NameOf(("body",))),
    **dict.fromkeys(("geom", "geom1", "geom2"), NameOf(("geom",))),
    **dict.fromkeys(("tendon", "tendon1", "tendon2"), NameOf(("fixed", "spatial"))),
    "mesh": NameOf(("mesh",)),
    "hfield": NameOf(("hfield",)),
    "material": NameOf(("material",)),
    "texture": NameOf(("texture",)),
    "target": NameOf(("body",)),
    "objname": NameOf(("body",)),
    # Options.
    "timestep": Real(0.0005, 0.003),
    "gravity": Real(-10, 10, 3),
    "wind": Real(-2, 2, 3),
    "magnetic": Real(-1, 1, 3),
    "viscosity": Real(0.001, 0.5),
    "integrator": _one_of("Euler RK4 implicit implicitfast"),
    "solver": _one_of("PGS CG Newton"),
    "cone": _one_of("pyramidal elliptic"),
    "jacobian": _one_of("dense sparse auto"),
    "impratio": Real(0.5, 10),
    **dict.fromkeys(("iterations", "ls_iterations", "ccd_iterations"), Whole(1, 8)),
    "noslip_iterations": Whole(1, 5),
    **dict.fromkeys(("tolerance", "ls_tolerance", "ccd_tolerance"), Real(0.0001, 0.1)),
    **dict.fromkeys(("noslip_tolerance", "sleep_tolerance"), Real(0.0001, 0.1)),
    **dict.fromkeys(("sdf_iterations", "sdf_initpoints"), Whole(1, 30)),
    "actuatorgroupdisable": Whole(0, 3),
    "o_margin": Real(0.001, 0.01),
    "o_solref": _SOLREF,
    "o_solimp": _SOLIMP,
    "o_friction": Real(0.01, 1, 5),
    # How a file is read.
    "angle": _one_of("radian degree"),
    "eulerseq": _one_of("xyz zyx XYZ"),
    **dict.fromkeys(("balanceinertia", "alignfree", "fitaabb", "fusestatic"), _YES_OR_NO),
    **dict.fromkeys(("autolimits", "discardvisual", "strippath", "usethread"), _YES_OR_NO),
    **dict.fromkeys(("savecanonical", "savecompiled", "saveinertial"), _YES_OR_NO),
    "inertiafromgeom": _LIMITED,
    "inertiagrouprange": OneOf(("0 5", "1 3", "0 0")),
    **dict.fromkeys(("boundmass", "boundinertia"), Real(0.0001, 0.2)),
    "settotalmass": Real(1, 5),
    # What is drawn, and what a reader keeps.
    "rgba": _COLOUR,
    "group": Whole(0, 5),
    "user": Real(0, 1),
    "castshadow": _YES_OR_NO,
    "width": _SMALL,
    "texrepeat": Real(1, 3, 2),
    "texuniform": _YES_OR_NO,
    **dict.fromkeys(("emission", "metallic", "reflectance", "roughness"), Real(0, 1)),
    "shininess": Real(0, 1),
    **dict.fromkeys(
        ("ambient", "diffuse", "rgb1", "rgb2", "markrgb", "attenuation"), Real(0, 1, 3)
    ),
    "specular": Real(0, 1),
    **dict.fromkeys(("cutoff", "exponent", "intensity", "bulbradius", "softness"), Real(1, 40)),
    "dir": Direction(3),
    "directional": _YES_OR_NO,
    **dict.fromkeys(("fovy", "ipd", "znear"), Real(0.1, 1)),
    **dict.fromkeys(("builtin",), _one_of("checker gradient flat")),
    "mark": _one_of("none edge cross random"),
    "random": Real(0, 1),
    "height": Whole(4, 12),
    **dict.fromkeys(("hflip", "vflip"), _YES_OR_NO),
    "maxhullvert": Whole(4, 9),
    "inertia": _one_of("convex exact legacy shell"),
    "scale": Real(0.7, 1.5, 3),
    "smoothnormal": _YES_OR_NO,
    "elevation": Real(0, 1, 9),
    "vertex": OneOf(("0 0 0 0.12 0 0 0 0.06 0 0.02 0.01 0.05", "0 0 0 0.1 0 0 0 0.1 0 0 0 0.1")),
    "data": Real(0, 1, 2),
    "prm": Real(0, 1),
    "noise": Real(0, 1),
    "interval": Real(0.01, 0.1),
    **dict.fromkeys(("time",), Real(0, 3)),
    **dict.fromkeys(("center",), _PLACE),
    **dict.fromkeys(("extent", "meaninertia", "meanmass", "meansize"), Real(0.1, 2)),
    **dict.fromkeys(("nconmax", "njmax"), Whole(500, 900)),
    **dict.fromkeys(("nuser_body", "nuser_jnt", "nuser_geom", "nuser_site"), Whole(1, 3)),
    **dict.fromkeys(("nuser_actuator", "nuser_tendon", "nuser_sensor", "nuser_cam"), Whole(1, 3)),
    **dict.fromkeys(("nuserdata", "nkey"), Whole(1, 4)),
}

# Where an attribute has another type than elsewhere: by the tag of its element, or of that around
# it, and its name.
SPECIAL: dict[tuple[str, str], Rule] = {
    ("joint", "type"): _one_of("hinge slide"),
    ("geom", "type"): _one_of("sphere capsule ellipsoid cylinder box"),
    ("site", "type"): _one_of("sphere capsule ellipsoid cylinder box"),
    ("light", "type"): _one_of("spot directional"),
    ("light", "range"): Real(1, 9),
    ("light", "specular"): Real(0, 1, 3),
    ("light", "mode"): _one_of("fixed track trackcom"),
    ("camera", "mode"): _one_of("fixed track trackcom"),
    ("headlight", "specular"): Real(0, 1, 3),
    ("headlight", "active"): Whole(0, 1),
    ("hfield", "size"): Real(0.05, 0.4, 4),
    ("texture", "width"): Whole(4, 12),
    ("key", "qpos"): Real(0, 1, 54),
    ("key", "qvel"): Real(0, 1, 50),
    ("muscle", "timeconst"): Real(0.01, 0.1, 2),
    ("muscle", "range"): Ends(0.5, 1.2),
    ("muscle", "force"): Real(1, 10),
    ("muscle", "scale"): Real(50, 300),
    ("orientation", "input"): _one_of("expmap quat"),
    ("pid", "input"): OneOf(("pos", "pos vel")),
    ("elasticity", "damping"): Real(0.001, 0.05),
    ("pair", "friction"): OneOf(("0.2 0.2 0.005 0.0001 0.0001", "0.5 0.9")),
    ("adhesion", "ctrlrange"): OneOf(("0 0.5", "0.1 1")),
    ("muscle", "ctrlrange"): OneOf(("0 0.5", "0.1 1")),
    ("damper", "ctrlrange"): OneOf(("0 0.5", "0.1 1")),
    ("edge", "equality"): _one_of("true false"),
    ("flag", ""): _SWITCH,
    ("visual", "rgba"): _COLOUR,
    ("quality", ""): Whole(1, 9),
    ("global", ""): Whole(1, 9),
    ("map", ""): Real(0.1, 2),
    ("scale", ""): Real(0.1, 2),
    ("rgba", ""): _COLOUR,
    ("headlight", "ambient"): Real(0, 1, 3),
    ("statistic", "center"): _PLACE,
}

# Without a rule, and why.
WITHOUT_RULE: dict[str, tuple[str, ...]] = {
    "it is what an element is known by, or refers to by a word of its own": (
        *("name", "class", "childclass", "model", "prefix", "plugin", "instance", "key", "value"),
        *("objtype", "refname", "reftype", "frame", "camera", "actuator", "flex", "role"),
        *("subtree1", "subtree2"),
    ),
    "it says where a file is, or how that is read": (
        *("file", "meshdir", "texturedir", "assetdir", "content_type", "fileback", "filedown"),
        *("filefront", "fileleft", "fileright", "fileup", "embed", "colorspace", "nchannel"),
        *("gridsize", "gridlayout", "passthrough", "conflict"),
    ),
    "its length hangs on other attributes": (
        *("face", "normal", "texcoord", "elemtexcoord", "element", "node", "nodecoord", "point"),
        *("vertid", "vertweight", "bindpos", "bindquat", "params", "grid", "gridrange", "cell"),
        *("act", "ctrl", "mpos", "mquat", "plastic", "nrow", "ncol", "cellcount", "actdim"),
    ),
    "it is how a camera is built, which only draws": (
        *("focal", "focalpixel", "principal", "principalpixel", "resolution", "sensorsize"),
        *("output", "projection", "inflate"),
    ),
    "it is of a sensor, of which no motion depends": (
        *("datatype", "needstage", "num", "reduce", "enclosed"),
    ),
    "MuJoCo refuses all but one word, or it has no effect there": (
        *("coordinate", "memory", "nstack"),
    ),
    "it is how long a muscle is searched for": (
        *("accel", "inttotal", "maxforce", "mode", "tolrange", "useexisting", "uselimit"),
    ),
    "the other attributes of its element have to change with it": (
        *("dim", "dof", "type", "section", "sectionsize", "input"),
    ),
}


def rule_of(attribute: SchemaAttribute) -> Rule | None:
    """Return the rule of an attribute; None of one that has none."""
    for key in ((attribute.tag, attribute.name), (attribute.tag, "")):
        if key in SPECIAL:
            return SPECIAL[key]
    return RULES.get(attribute.name)


# Attributes of which an element has one at most.
_ALTERNATIVES = (
    frozenset({"quat", "axisangle", "euler", "xyaxes", "zaxis", "fromto"}),
    frozenset({"diaginertia", "fullinertia"}),
    frozenset({"joint", "jointinparent", "tendon", "site", "body", "cranksite"}),
    frozenset({"area", "diameter"}),
    frozenset({"kv", "dampratio"}),
)


@dataclass(frozen=True)
class AttributeEdit:
    """A change of one attribute of one element.

    Attributes:
        attribute: Of the schema.
        number: Of the element among those that can have it.
        value: As an MJCF has it.
    """

    attribute: SchemaAttribute
    number: int
    value: str

    def __str__(self) -> str:
        return f"{self.attribute}[{self.number}]={self.value}".replace(" ", "_")

    def applied(self, text: str) -> str:
        """Return a text with the change; what it replaces is taken away."""
        root = ElementTree.fromstring(text)
        element = list(self.attribute.elements(root))[self.number]
        for alternatives in _ALTERNATIVES:
            if self.attribute.name in alternatives:
                for name in alternatives:
                    element.attrib.pop(name, None)
        element.set(self.attribute.name, self.value)
        return ElementTree.tostring(root, encoding="unicode")


@dataclass(frozen=True)
class Coverage:
    """Which attributes of the schema can be edited in a text.

    Attributes:
        attributes: All of the schema.
        with_rule: Those that have a rule, and an element in the text.
        without_element: Those that have a rule, and no element in the text.
        without_rule: Those without a rule.
    """

    attributes: tuple[SchemaAttribute, ...]
    with_rule: tuple[SchemaAttribute, ...]
    without_element: tuple[SchemaAttribute, ...]
    without_rule: tuple[SchemaAttribute, ...]


@cache
def coverage(text: str) -> Coverage:
    """Return which attributes of the schema can be edited in a text."""
    root = ElementTree.fromstring(text)
    attributes = schema_attributes()
    groups: dict[str, list[SchemaAttribute]] = {"with": [], "alone": [], "none": []}
    for attribute in attributes:
        if rule_of(attribute) is None:
            groups["none"].append(attribute)
        elif next(attribute.elements(root), None) is None:
            groups["alone"].append(attribute)
        else:
            groups["with"].append(attribute)
    return Coverage(tuple(attributes), *(tuple(group) for group in groups.values()))


def _says(root: Element, edit: AttributeEdit) -> bool:
    """Tell whether a document says what an edit puts there."""
    element = list(edit.attribute.elements(root))[edit.number]
    return element.get(edit.attribute.name) == edit.value


def merged(text: str, edits: Sequence[AttributeEdit]) -> list[str]:
    """Return a text with all edits; those that would undo another one's stand in a further text."""
    texts: list[str] = []
    pending = list(edits)
    while pending:
        whole: str = text
        applied: list[AttributeEdit] = []
        later: list[AttributeEdit] = []
        for edit in pending:
            candidate = edit.applied(whole)
            root = ElementTree.fromstring(candidate)
            if all(_says(root, earlier) for earlier in applied):
                whole = candidate
                applied.append(edit)
            else:
                later.append(edit)
        texts.append(whole)
        pending = later
    return texts


def spec_elements(spec: mujoco.MjSpec, attribute: SchemaAttribute) -> dict[str, object]:
    """Return the elements of a specification that can have an attribute, by their names."""
    lists = {
        **{"geom": spec.geoms, "site": spec.sites, "joint": spec.joints, _BODIES: spec.bodies},
        **{"fixed": spec.tendons, "spatial": spec.tendons, "pair": spec.pairs},
    }
    if attribute.parent not in (_BODIES, "tendon", "contact", "worldbody"):
        return {}
    return {element.name: element for element in lists.get(attribute.tag, ()) if element.name}


# What says how an element is turned, and is written otherwise below.
_TURNS = frozenset({"quat", "axisangle", "euler", "xyaxes"})


def restated_edits(text: str, seed: int) -> Iterator[AttributeEdit]:
    """Yield edits of a text that say what it says already, in an order of a seed.

    An attribute is set to what MuJoCo reads of the file that lacks it; a turn is said in another
    way.
    """
    random = np.random.default_rng(seed)
    root, spec = ElementTree.fromstring(text), mujoco.MjSpec.from_string(text)
    attributes = [each for each in schema_attributes() if spec_elements(spec, each)]
    for k in random.permutation(len(attributes)):
        attribute = attributes[int(k)]
        by_name = spec_elements(spec, attribute)
        elements = list(attribute.elements(root))
        for number in random.permutation(len(elements)):
            element = elements[int(number)]
            known = by_name.get(element.get("name", ""))
            value = None
            if known is not None and attribute.name not in element.attrib:
                value = _value_of(known, element, attribute.name)
            if value is not None:
                yield AttributeEdit(attribute, int(number), value)
                break


def _value_of(known: object, element: Element, name: str) -> str | None:
    """Return what an element of a specification has of an attribute that its file does not say."""
    if name in _TURNS:
        return _turn_of(known, element, name)
    if not isinstance(RULES.get(name), Real | Whole) or name in _NOT_RESTATED:
        return None
    value = getattr(known, name, None)
    if value is None or isinstance(value, str):
        return None
    numbers = np.ravel(np.asarray(value, dtype=float))
    if not len(numbers) or not np.isfinite(numbers).all():
        return None
    if isinstance(RULES[name], Whole):
        return " ".join(str(int(number)) for number in numbers)
    return " ".join(repr(float(number)) for number in numbers)


# What means something by being there: a mass overrides a density, a place that of a fromto.
_NOT_RESTATED = frozenset({"mass", "density", "pos", "size", "user", "fitscale", "group", "ref"})


def _turn_of(known: object, element: Element, name: str) -> str | None:
    """Return the turn of an element in another way; None where it has another one of these."""
    if "fromto" in element.attrib or "zaxis" in element.attrib:
        return None
    if element.get("type") == "mesh" or element.find("freejoint") is not None:
        return None
    quat, matrix = np.empty(4), np.empty(9)
    other = next((way for way in _TURNS if way in element.attrib), None)
    if other not in (None, "quat"):
        return None
    words = element.get("quat", "1 0 0 0")
    quat[:] = [float(word) for word in words.split()]
    mujoco.mju_normalize4(quat)
    mujoco.mju_quat2Mat(matrix, quat)
    match name:
        case "xyaxes":
            numbers = matrix.reshape(3, 3)[:, :2].T.ravel()
        case "axisangle":
            turn = np.empty(3)
            mujoco.mju_quat2Vel(turn, quat, 1.0)
            angle = float(np.linalg.norm(turn))
            axis = turn / angle if angle else np.array([0.0, 0.0, 1.0])
            numbers = np.array([*axis, angle])
        case "quat":
            numbers = -quat
        case _:
            return None if other else "0 0 0"
    return " ".join(repr(float(number)) for number in numbers)


def drawn_edits(text: str, seed: int) -> Iterator[AttributeEdit]:
    """Yield edits of a text without end, by a seed: each of an attribute, an element, a value.

    No attribute comes twice before each has come once.
    """
    random = np.random.default_rng(seed)
    root = ElementTree.fromstring(text)
    attributes: Sequence[SchemaAttribute] = coverage(text).with_rule
    while True:
        for k in random.permutation(len(attributes)):
            attribute = attributes[int(k)]
            rule = rule_of(attribute)
            assert rule is not None
            elements = list(attribute.elements(root))
            number = int(random.integers(len(elements)))
            yield AttributeEdit(attribute, number, rule.draw(random, root))
