"""What the recorder must know of PyBullet: worlds that are told apart by a number only.

A world shows what its getters tell without computing anything anew. Beside the engine's
worlds a Data has arrays of its own, which change without any call.
"""

from __future__ import annotations

import marshal
import types
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

from ...backends.hidden_data import HiddenData, Machine
from ...backends.pybullet_backend import PybulletModel
from ...installed import require
from ...interface import DERIVED, INPUTS
from ..call_watch import CallWatch, CallWords, Contents, WatchedObject, entries, named_values

# How many arguments come before `physicsClientId` where it is given by its place, which the
# engine's functions do not tell. It is the last one in all of these.
ARGUMENTS_BEFORE_CLIENT = {
    "applyExternalForce": 5,
    "applyExternalTorque": 4,
    "calculateInverseDynamics": 5,
    "calculateJacobian": 6,
    "calculateMassMatrix": 3,
    "changeDynamics": 24,
    "disconnect": 0,
    "getBasePositionAndOrientation": 1,
    "getBaseVelocity": 1,
    "getBodyInfo": 1,
    "getBodyUniqueId": 1,
    "getCollisionShapeData": 2,
    "getContactPoints": 4,
    "getDynamicsInfo": 2,
    "getJointInfo": 2,
    "getJointState": 2,
    "getJointStates": 2,
    "getLinkState": 4,
    "getLinkStates": 4,
    "getNumBodies": 0,
    "getNumJoints": 1,
    "getPhysicsEngineParameters": 0,
    "isConnected": 0,
    "loadURDF": 7,
    "performCollisionDetection": 0,
    "removeBody": 1,
    "resetBasePositionAndOrientation": 3,
    "resetBaseVelocity": 3,
    "resetJointState": 4,
    "resetJointStatesMultiDof": 4,
    "resetSimulation": 1,
    "saveState": 0,
    "setCollisionFilterGroupMask": 4,
    "setCollisionFilterPair": 5,
    "setGravity": 3,
    "setJointMotorControlArray": 8,
    "setTimeStep": 1,
    "stepSimulation": 0,
}
_BODIES = "number of bodies"
_JOINT = ("joint positions", "joint velocities", "joint reaction forces", "joint motor torques")


class _World(WatchedObject):
    """One world of the engine's, from its `connect` to its `disconnect`."""

    def __init__(self, engine: Any, client: int) -> None:
        super().__init__("a world", self)
        self._pb, self._client, self._open = engine, client, True

    @property
    def is_gone(self) -> bool:
        # Once gone for good: the engine gives the number to another world.
        self._open = self._open and bool(self._pb.isConnected(self._client))
        return not self._open

    def contents(self, thoroughly: bool) -> Contents:
        pb, client = self._pb, self._client
        bodies = [pb.getBodyUniqueId(i, client) for i in range(pb.getNumBodies(client))]
        poses = [pb.getBasePositionAndOrientation(body, client) for body in bodies]
        speeds = [pb.getBaseVelocity(body, client) for body in bodies]
        numbers = {body: list(range(pb.getNumJoints(body, client))) for body in bodies}
        jointed = [(body, joints) for body, joints in numbers.items() if joints]
        states: list[Sequence[Any]] = []
        for body, joints in jointed:
            states += pb.getJointStates(body, joints, client)
        links: list[Any] = []
        for body, joints in jointed:
            links.append(pb.getLinkStates(body, joints, 0, 0, client))
        dynamics: list[Any] = []
        for body in bodies:
            for link in (-1, *numbers[body]):
                dynamics.append(pb.getDynamicsInfo(body, link, client))
        contents: dict[str, Any] = {_BODIES: bodies}
        for k, name in enumerate(_JOINT):
            contents[name] = [state[k] for state in states]
        contents["base poses"] = poses
        contents["base velocities"] = speeds
        contents["link poses"] = links
        contents["contact points"] = pb.getContactPoints(physicsClientId=client)
        contents["masses, frictions and dampings"] = dynamics
        contents["constraints"] = pb.getNumConstraints(client)
        contents |= pb.getPhysicsEngineParameters(client)
        return {name: marshal.dumps(value, 2) for name, value in contents.items()}

    def differing(self, before: Contents, now: Contents) -> list[str]:
        # Another body makes every list a longer one: that is not what changed.
        return [_BODIES] if before[_BODIES] != now[_BODIES] else super().differing(before, now)

    def spelled(self, field: str) -> str:
        return f"{self.title}: {field}"


class _Arrays(WatchedObject):
    """The interface's own arrays of a Data: copies, and what was computed for a reader."""

    def __init__(self, machine: Machine) -> None:
        super().__init__("a Data", machine)  # a Data ends when the code lets go of it
        self._moment = machine.moment

    def contents(self, thoroughly: bool) -> Contents:
        machine = self.thing
        contents = {name: getattr(machine, name).tobytes() for name in INPUTS}
        contents["time"] = marshal.dumps(machine.time, 2)
        # Not by asking the Data, which would compute what nobody has read.
        for name, value in machine.derived.items():
            arrays = (
                [value] if name in DERIVED else [value.geom, value.dist, value.pos, value.force]
            )
            contents[name] = b"".join(array.tobytes() for array in arrays)
        return contents

    def differing(self, before: Contents, now: Contents) -> list[str]:
        # What was never read is what a fresh Data says: zeros.
        return [name for name, new in now.items() if before.get(name, bytes(len(new))) != new]

    def is_outdated(self) -> bool:
        machine = self.thing
        if machine is None or machine.moment is self._moment:
            return False
        self._moment = machine.moment
        return not machine.derived

    def entry(self, field: str, before: bytes, after: bytes) -> str:
        return entries(field, before, after, 8) if field in INPUTS else field

    def spelled(self, field: str) -> str:
        return f"{self.label}.{field}"


class PybulletWatch(CallWatch):
    """A watch on PyBullet."""

    words = CallWords(
        shown="what its getters tell without computing anything anew",
        step="stepSimulation",
        note="On pybullet a Data's arrays are the interface's own: it copies between them and the "
        "engine's hidden world, which is outside the engine's functions.",
        roles={
            "the still copy": "The still copy is the robot with its true inertias, in a world of "
            "its own; the one that is stepped carries extra inertia for its servos. The interface "
            "asks the copy for poses, the mass matrix and the bias. Its steps in this run: {}.",
            "the look-ahead": "The look-ahead is another copy. It is put where your data is and "
            "takes one step, so that contacts and forces can be read after forward and no time "
            "passes in yours. Its steps in this run: {}.",
        },
        helpers={
            "mujoco": "On pybullet the interface uses MuJoCo as a library: its parser reads the "
            "model's file, and it solves small linear systems. Its own steps there: {}.",
        },
    )

    def __init__(self) -> None:
        self.module = require("pybullet")
        # Looks must not come by way of what is replaced.
        self._bare = types.ModuleType(self.module.__name__)
        vars(self._bare).update(vars(self.module))
        self._worlds: dict[int, _World] = {}
        self._arrays: weakref.WeakKeyDictionary[Machine, _Arrays] = weakref.WeakKeyDictionary()

    def concerned(self, function: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        if function == "connect":
            return []
        client = client_of(function, args, kwargs)
        world = self._worlds.get(-1 if client is None else client)
        if world is None and function == "disconnect":
            return None  # of a Data from before that is collected just now
        return [world] if world else []

    def created(self, function: str, args: Sequence[Any], result: Any) -> WatchedObject | None:
        if function != "connect" or result < 0:
            return None
        self._worlds[result] = _World(self._bare, result)
        return self._worlds[result]

    def name(self, namespace: Mapping[str, Any]) -> None:
        arrays: weakref.WeakKeyDictionary[Machine, _Arrays] = weakref.WeakKeyDictionary()
        for label, value in named_values(namespace):
            if isinstance(value, PybulletModel):
                self._name_model(label, value)
            elif isinstance(value, HiddenData) and isinstance(value.model, PybulletModel):
                self._name_model(f"{label}.model", value.model)
                machine = value._machine
                self._label(machine.world.raw, f"the world of {label}")
                watched = self._arrays.get(machine) or _Arrays(machine)
                arrays.setdefault(machine, watched).note_variable(label)
        self._arrays = arrays  # the others no variable leads to

    def _name_model(self, label: str, model: PybulletModel) -> None:
        for name, world in model.shared_worlds.items():
            self._label(world, f"the {name} of {label}")

    def _label(self, world: Any, label: str) -> None:
        # Of one that is closed the number may be another's by now.
        known = None if world.closed else self._worlds.get(world.client)
        if known is not None:
            known.note_variable(label)

    def live_objects(self) -> Sequence[WatchedObject]:
        self._worlds = {c: world for c, world in self._worlds.items() if not world.is_gone}
        return [*self._worlds.values(), *self._arrays.values()]


def client_of(function: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> int | None:
    """Return the number of the world that a call is about; None where that cannot be told."""
    if "physicsClientId" in kwargs:
        return int(kwargs["physicsClientId"])
    place = ARGUMENTS_BEFORE_CLIENT.get(function)
    if place is None:
        return None if args else 0
    return int(args[place]) if len(args) > place else 0  # the engine's own default
