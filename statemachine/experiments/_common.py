"""What the experiments share: provenance, forces by part, contacts by name."""

from __future__ import annotations

import hashlib
import platform
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from .. import __version__, conventions
from ..comparison import ContactNames
from ..comparison.readings import readings
from ..engines import part
from ..errors import BadInputError, UnsupportedError
from ..interface import INPUTS, Array, Contacts, Data, JointType, Model

Progress = Callable[[float], None]  # told the fraction that is done
TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)  # a command to the arm [rad]


def silent(_fraction: float) -> None:
    """The Progress that shows nothing."""


def part_of(progress: Progress, start: float, share: float) -> Progress:
    """The Progress of a run that is a share of the whole."""
    return lambda fraction: progress(start + share * fraction)


@dataclass(frozen=True)
class Provenance:
    """What a result was computed with, so that it can be computed again.

    `model_sha256` is the digest of the model's file and of those it includes; `emulated` are
    the promises of the contract that the backend keeps instead of its engine.
    """

    backend: str
    versions: dict[str, str]
    model_file: str
    model_sha256: str
    timestep: float
    emulated: tuple[str, ...]
    seed: int | None = None


def provenance(model: Model, seed: int | None = None, **others: str) -> Provenance:
    """The record of a run on `model`; `others` are further versions by name."""
    versions = {
        "statemachine": __version__,
        model.backend: model.engine_version,
        "numpy": np.__version__,
        "python": platform.python_version(),
        **others,
    }
    # The folder and name, not the machine's path: a result is read elsewhere.
    name = "/".join(model.path.parts[-2:]).encode(errors="replace").decode()
    digest = model_digest(model.path)
    emulated = tuple(
        name
        for name, behaviour in model.capabilities.behaviours.items()
        if behaviour.support == "emulated"
    )
    return Provenance(model.backend, versions, name, digest, model.timestep, emulated, seed)


def model_digest(path: Path) -> str:
    """SHA-256 of a model's file and of those it includes."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in model_files(path))).hexdigest()


@dataclass(frozen=True)
class OwnAnswer:
    """What an engine itself does, asked of it alone: a question, a part of it, the answer."""

    question: str
    part: str
    answer: str


def own_answers(model: Model, *questions: str) -> tuple[OwnAnswer, ...]:
    """Conventions of the engine behind a Model that emulates some of the contract."""
    if part(model.backend, "as_it_comes") is None:  # the interface is the engine's own
        return ()
    return tuple(
        OwnAnswer(question, finding.of, finding.answer)
        for question in questions
        for finding in conventions.ask(question, model.backend) or ()
    )


def model_files(path: Path) -> Iterator[Path]:
    """A model's file, then those it includes, theirs and so on, each once.

    MuJoCo looks an included file up beside the one that was loaded.
    """
    waiting, seen = [path], set()
    while waiting:
        file = waiting.pop(0)
        if file in seen or not file.is_file():
            continue
        seen.add(file)
        yield file
        try:
            includes = ElementTree.parse(file).iter("include")
        except ElementTree.ParseError:  # a binary model
            continue
        waiting += [path.parent / name for i in includes if (name := i.get("file"))]


@dataclass(frozen=True)
class Forces:
    """The generalized forces on one joint at one moment [N·m; of a slide, N].

    `bias` is on the other side of the equation of motion, so that gravity acts as
    -bias; a part that the engine does not yield is None. `total` is what is left over
    to accelerate the joint: zero at rest.
    """

    bias: float | None
    actuator: float | None
    passive: float | None
    friction: float | None
    contact: float | None
    limit: float | None
    equality: float | None

    @property
    def total(self) -> float | None:
        """Sum of all parts, -bias among them; None if one is missing."""
        parts = (
            self.actuator,
            self.passive,
            self.friction,
            self.contact,
            self.limit,
            self.equality,
        )
        if self.bias is None or any(part is None for part in parts):
            return None
        return sum(part for part in parts if part is not None) - self.bias


def forces_on(data: Data, dof: int) -> Forces:
    """Forces on a degree of freedom, of the moment that `data`'s derived arrays show."""

    def part(name: str) -> float | None:
        try:
            return float(getattr(data, f"qfrc_{name}")[dof])
        except UnsupportedError:
            return None

    return Forces(
        bias=part("bias"),
        actuator=part("actuator"),
        passive=part("passive"),
        friction=part("friction"),
        contact=part("contact"),
        limit=part("limit"),
        equality=part("equality"),
    )


def read_stored(data: Data) -> dict[str, bytes]:
    """The bytes of every input, and of the time."""
    return {name: np.array(getattr(data, name)).tobytes() for name in (*INPUTS, "time")}


def read_derived(data: Data) -> dict[str, bytes]:
    """The bytes of every derived array that this engine gives, contacts among them."""
    return {
        name: b"".join(getattr(held, part).tobytes() for part in ("geom", "dist", "pos", "force"))
        if isinstance(held, Contacts)
        else held.tobytes()
        for name, held in readings(data).items()
    }


def body_pairs(model: Model, contacts: Contacts) -> Counter[str]:
    """How many contacts each pair of bodies has, as {"gripper on box": 6}."""
    names = ContactNames.of(model)
    return Counter(names.pair(*geoms) for geoms in contacts.geom.tolist())


def carried_by(model: Model, bodies: Iterable[int]) -> frozenset[int]:
    """These bodies and all that hang on them."""
    carried = set(bodies)
    for body in range(1, model.nbody):  # parents come before children
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    return frozenset(carried)


def moved_by_actuators(model: Model) -> frozenset[int]:
    """The robot's moving part: what the actuated joints carry."""
    joints = [joint for joint in model.actuator_jntid.tolist() if joint >= 0]
    return carried_by(model, (int(model.jnt_bodyid[joint]) for joint in joints))


def touching(model: Model, contacts: Contacts, bodies: frozenset[int]) -> tuple[str, ...]:
    """What of `bodies` touches what else, as "gripper on floor (fixed_tip)", each once."""
    pairs = contacts.geom.tolist()
    inside = [[int(model.geom_bodyid[geom]) in bodies for geom in pair] for pair in pairs]
    found = [pair for pair, (one, two) in zip(pairs, inside, strict=True) if one != two]
    names = ContactNames.of(model) if found else None
    return tuple(dict.fromkeys(names.geoms(*pair) for pair in found)) if names else ()


def is_slide(model: Model, joint: str) -> bool:
    """Whether a joint is a slide: its position is in metres."""
    return int(model.jnt_type[model.joint_id(joint)]) == int(JointType.SLIDE)


def scalar_joint(model: Model, name: str) -> tuple[int, int]:
    """Addresses in qpos and qvel of a joint that must be a hinge or a slide."""
    joint = model.joint_id(name)
    if model.jnt_type[joint] not in (JointType.HINGE, JointType.SLIDE):
        raise BadInputError(f"joint {name!r} is neither a hinge nor a slide")
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])


# A run that would take hours is a slip of the keyboard.
_STEPS_MOST = 10_000_000


def steps_in(model: Model, seconds: float) -> int:
    """Number of timesteps in a time, at least one."""
    if not np.isfinite(seconds) or seconds <= 0:
        raise BadInputError(f"seconds must be above 0; got {seconds}")
    steps = max(1.0, seconds / model.timestep)
    if steps * model.substeps > _STEPS_MOST:
        raise BadInputError(
            f"{seconds:g} s are {steps * model.substeps:.3g} steps of the engine, and a run has "
            f"at most {_STEPS_MOST:,}"
        )
    return round(steps)


def milestones(seconds: float) -> list[float]:
    """Times worth a row of a table: 0, 1, 2, 3, 4, 10, 20, 30, 50, 100 …, and the end."""
    marks: list[float] = [0.0, 1.0, 2.0, 3.0, 4.0]
    decade = 10.0
    while decade <= seconds:
        marks += [decade, 2 * decade, 3 * decade, 5 * decade]
        decade *= 10
    return [mark for mark in marks if mark < seconds * (1 - 1e-9)] + [seconds]


def command(model: Model, values: Iterable[float], name: str = "ctrl") -> Array:
    """A full ctrl (nu,) from values; the error says how many there should be."""
    array = np.array(list(values), dtype=np.float64)
    if array.shape != (model.nu,):
        raise BadInputError(
            f"{name} wants {model.nu} numbers, one for each actuator; got {array.size}"
        )
    return array
