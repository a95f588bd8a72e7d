"""A Data of one model that shows what a Data of another model has, element by element.

A function of the user's that reads qpos by number can so be given the state of another model in the
order of its own. What has no counterpart in the other model is as it starts, or zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from ...errors import UnsupportedError
from ...interface import MOCAP, Contacts, Data
from ..mujoco_backend import MujocoData

Pairs = Sequence[tuple[int, int]]  # of ids: in the model that shows, in the other

# Arrays of an MjData whose rows are of elements of one kind, besides the inputs.
_ROWS = {
    "body": (
        "xpos", "xquat", "xmat", "xipos", "ximat", "cvel", "cacc", "cinert", "crb", "cfrc_int",
        "cfrc_ext", "subtree_com", "subtree_linvel", "subtree_angmom", "xfrc_applied",
    ),
    "joint": ("xanchor", "xaxis"),
    "geom": ("geom_xpos", "geom_xmat"),
    "site": ("site_xpos", "site_xmat"),
    "dof": (
        "qacc", "qacc_smooth", "qacc_warmstart", "cdof", "cdof_dot", "qfrc_bias", "qfrc_actuator",
        "qfrc_passive", "qfrc_constraint", "qfrc_applied", "qfrc_spring", "qfrc_damper",
        "qfrc_gravcomp", "qfrc_fluid", "qfrc_smooth",
    ),
    "sensordata": ("sensordata",),
    "actuator": ("actuator_length", "actuator_velocity", "actuator_force"),
    "tendon": ("ten_length", "ten_velocity"),
    "act": ("act", "act_dot"),
}  # fmt: skip
_OF_BODIES, _OF_SITES = ("xpos", "xquat"), ("site_xpos", "site_xmat")


class DataInOtherOrder(MujocoData):
    """What a function of the user's sees of a Data of another model, which may be of any engine.

    It is not stepped. `show` takes over the state; what is derived is looked up when it is read.
    """

    __slots__ = ("_elements", "_is_behind", "_source")

    def __init__(self, model: Any, elements: Mapping[str, Pairs]) -> None:
        """Make one.

        Args:
            model: The Model of this backend in whose order everything is shown.
            elements: By kind of element pairs of ids: in `model`, and in the other. Places in an
                array are by "qpos", "dof", "act", "mocap_pos", "mocap_quat" and "sensordata".
        """
        super().__init__(model)
        self._elements = {
            kind: np.array(list(pairs), dtype=np.int64).reshape(-1, 2).T
            for kind, pairs in elements.items()
        }
        self._source: Data | None = None
        self._is_behind = False

    def show(self, source: Data) -> None:
        """Take over the positions and velocities of another Data; ctrl is left as it is."""
        self._source, self._is_behind = source, True
        for name, kind in (("qpos", "qpos"), ("qvel", "dof")):
            ours, theirs = self._elements[kind]
            getattr(self, name)[ours] = getattr(source, name)[theirs]
        for name in MOCAP:
            ours, theirs = self._elements[name]
            getattr(self, name).reshape(-1)[ours] = getattr(source, name).reshape(-1)[theirs]

    def give_back(self) -> None:
        """Write into the other Data what a function wrote: mocap bodies, applied forces."""
        source = self._source
        if source is None:
            return
        for name in MOCAP:
            ours, theirs = self._elements[name]
            getattr(source, name).reshape(-1)[theirs] = getattr(self, name).reshape(-1)[ours]
        if self._is_behind or not isinstance(source.raw, mujoco.MjData):
            return
        raw = super().raw
        for name, kind in (("qfrc_applied", "dof"), ("xfrc_applied", "body")):
            ours, theirs = self._elements[kind]
            getattr(source.raw, name)[theirs] = getattr(raw, name)[ours]

    @property
    def raw(self) -> mujoco.MjData:
        """Return an MjData with all that the other one has, if that is an MjData."""
        if self._is_behind:
            self._is_behind = False
            self._catch_up()
        return super().raw

    @property
    def time(self) -> float:
        if self._source is None:
            return super().time
        return self._source.time

    def _catch_up(self) -> None:
        """Write what is derived into the memory of the engine."""
        raw, source = super().raw, self._source
        if source is None:
            return
        raw.time = source.time
        of_engine = source.raw if isinstance(source.raw, mujoco.MjData) else None
        for kind, names in _ROWS.items():
            ours, theirs = self._elements.get(kind, ((), ()))
            if not len(ours):
                continue
            for name in names:
                values = getattr(of_engine, name, None)
                if of_engine is None:
                    values = _derived(source, name)
                if values is not None:
                    getattr(raw, name)[ours] = values[theirs]

    def _derive(self, name: str) -> Any:
        source = self._source
        if source is None:
            return super()._derive(name)
        if name == "contacts":
            return self._contacts_of(source.contacts)
        kind = "dof"
        if name in _OF_BODIES:
            kind = "body"
        elif name in _OF_SITES:
            kind = "site"
        values = getattr(source, name)
        ours, theirs = self._elements[kind]
        model = self._model
        counts = {"dof": model.nv, "body": model.nbody, "site": model.nsite}
        shown = np.zeros((counts[kind], *values.shape[1:]))
        shown[ours] = values[theirs]
        shown.setflags(write=False)
        return shown

    def _contacts_of(self, contacts: Contacts) -> Contacts:
        """Return the contacts of another model; -1 for a geom that has no counterpart."""
        ours, theirs = self._elements["geom"]
        known = dict(zip(theirs.tolist(), ours.tolist(), strict=True))
        geoms = [known.get(geom, -1) for geom in contacts.geom.ravel().tolist()]
        return Contacts(
            geom=np.array(geoms, dtype=np.int64).reshape(-1, 2),
            dist=contacts.dist,
            pos=contacts.pos,
            frame=contacts.frame,
            force=contacts.force,
            torque=contacts.torque,
        )


def _derived(source: Data, name: str) -> Any:
    """Return a derived array of a Data of any engine; None where it has no such array."""
    try:
        return getattr(source, name)
    except (AttributeError, UnsupportedError):
        return None
