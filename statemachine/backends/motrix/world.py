"""One hidden world of MotrixSim: a SceneData, stepped; conventions end here.

MotrixSim stores single precision, quaternions (x, y, z, w), and keeps what its solver starts from
where nobody can read it. So a state is always put into a new SceneData: what follows depends on
the state alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...interface import FORCES, PARTS, Array
from ...processes.stderr_capture import stderr_capture
from ...rotations import matrix_from_quat, times, wxyz_from_xyzw, xyzw_from_wxyz
from ..hidden_world import HiddenWorld, Memory, Moment, Read
from .contact_sensors import contacts_at
from .engine_model import EngineModel
from .layout import MotrixLayout
from .links import TITLE, check_threads, mx
from .messages import is_panic

Single = NDArray[np.float32]
# Beyond these a step may end in a panic, whose text goes to descriptor 2: it is caught there.
_FAST, _FAR = 1e3, 1e6  # [rad/s or m/s], [rad or m]


class MotrixWorld(HiddenWorld):
    """A SceneData of MotrixSim's, and the command that is in force."""

    engine = TITLE
    unavailable = frozenset((*FORCES, *PARTS))

    def __init__(
        self, engine: EngineModel, layout: MotrixLayout, qpos0: Array, timestep: float, nu: int
    ) -> None:
        """Make a world.

        Args:
            engine: MotrixSim's model.
            layout: Where it has what the Model counts.
            qpos0: (nq,) positions of the default state.
            timestep: Of an engine step [s].
            nu: Length of ctrl.
        """
        self._engine, self._layout, self._scene = engine, layout, engine.scene
        self.qpos0, self.timestep, self._nu = qpos0, timestep, nu
        if not len(layout.geoms):
            self.unavailable = self.unavailable | {"contacts"}
        self.raw = mx.SceneData(self._scene)
        self._commands = np.zeros(nu + 7 * len(layout.mocaps))
        self._gave_up = False  # whether the last step ended in a panic
        self._wild = False  # whether the next one may
        self._velocities: Single | None = None  # of now; None until they are read
        self._velocities_before: Single = np.zeros(len(layout.qvel), np.float32)

    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        """Put a state into a new SceneData, which remembers nothing; the command stays."""
        self.raw, self._gave_up = mx.SceneData(self._scene), False
        put_state(self.raw, self._layout, qpos, qvel)
        self._velocities = None
        self._wild = _is_wild(qpos, qvel)
        self.command(self._commands)

    def command(self, ctrl: Array) -> None:
        """Take ctrl, which MotrixSim copies, and put the bodies that are led in their places."""
        self._commands = ctrl.copy()
        self._command(self._scene, self.raw)

    def _command(self, scene: Any, data: Any) -> None:
        put_command(scene, data, self._commands[: self._nu])
        count = len(self._layout.mocaps)
        places, turns = np.split(self._commands[self._nu :], [3 * count])
        for number, body in enumerate(self._layout.mocaps.tolist()):
            place, turn = places[3 * number :][:3], turns[4 * number :][:4]
            pose = np.concatenate((place, xyzw_from_wxyz(_unit(turn))))
            scene.bodies[body].mocap.set_pose(data, pose.astype(np.float32))

    def step(self) -> None:
        """Take one engine step.

        Raises:
            EngineError: As `check_threads`.
        """
        check_threads()
        self._velocities_before = self._own_velocities()
        self._velocities = None
        if self._wild:
            with stderr_capture():
                self._step()
        else:
            self._step()

    def _step(self) -> None:
        try:
            self._scene.step(self.raw)
        except BaseException as error:
            if not is_panic(error):
                raise
            self._gave_up = True

    def _own_velocities(self) -> Single:
        """Return the velocities in MotrixSim's order."""
        if self._velocities is None:
            self._velocities = np.array(self.raw.dof_vel)
            if self._gave_up:
                # It does not tell in which coordinate it gave up: the fastest is named.
                fastest = np.argmax(np.abs(np.nan_to_num(self._velocities_before)))
                self._velocities[fastest] = np.nan
        return self._velocities

    def read(self) -> tuple[Array, Array]:
        """Return qpos (nq,) and qvel (nv,); after a panic one velocity is NaN."""
        qpos = self.raw.dof_pos[self._layout.qpos].astype(np.float64)
        qvel = self._own_velocities()[self._layout.qvel].astype(np.float64)
        self._wild = _is_wild(qpos, qvel)
        return qpos, qvel

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        """Return poses and acceleration of the last step, or the contacts of where it started."""
        if name == "contacts":
            return {"contacts": self._contacts(moment)}
        layout, scene, data = self._layout, self._scene, self.raw
        if name == "qacc":
            after = self._own_velocities().astype(np.float64)
            change = after - self._velocities_before.astype(np.float64)
            return {"qacc": (change / self.timestep)[layout.qvel]}
        # MotrixSim's own are of the state before the step.
        poses = np.asarray(scene.get_link_poses(data), dtype=np.float64).reshape(-1, 7)
        xpos, xquat = np.zeros((len(layout.links), 3)), np.zeros((len(layout.links), 4))
        xquat[0, 0] = 1.0
        xpos[1:], xquat[1:] = poses[layout.links[1:], :3], _wxyz(poses[layout.links[1:], 3:])
        xquat *= self._signs(xquat, moment.qpos)[:, None]
        site_xpos, site_quat = self._sites(xpos, xquat)
        return {
            "xpos": xpos,
            "xquat": xquat,
            "site_xpos": site_xpos,
            "site_xmat": matrix_from_quat(site_quat).reshape(-1, 9),
        }

    def _sites(self, xpos: Array, xquat: Array) -> tuple[Array, Array]:
        """Return where the sites are (nsite, 3), and how they are turned (nsite, 4)."""
        layout, scene = self._layout, self._scene
        turns = xquat[layout.site_bodies]
        site_xpos = xpos[layout.site_bodies]
        site_xpos += (matrix_from_quat(turns) @ layout.site_pos[:, :, None])[:, :, 0]
        site_quat = times(turns, layout.site_quat)
        for number, site in enumerate(layout.sites.tolist()):
            if site >= 0:
                pose = np.asarray(scene.sites[site].get_pose(self.raw), dtype=np.float64)
                site_xpos[number], site_quat[number] = pose[:3], _wxyz(pose[3:])
        return site_xpos, site_quat

    def _signs(self, xquat: Array, qpos: Array) -> Array:
        """Return the sign (nbody,) of each body's quaternion that MuJoCo has.

        A quaternion and its negative are one rotation. MuJoCo multiplies them along the tree; so
        that of a body is the one nearer to where its joints at 0 would turn it.
        """
        layout = self._layout
        near = times(xquat[layout.parents], layout.turns)
        for body, start in layout.floating.items():
            near[body] = qpos[start : start + 4]
        signs = np.where((near * xquat).sum(axis=1) < 0, -1.0, 1.0)
        for body, parent in enumerate(layout.parents.tolist()):
            if body not in layout.floating:
                signs[body] *= signs[parent]
        return signs

    def _contacts(self, moment: Moment) -> Any:
        """Return the contacts of a moment: those of a step from it, in a SceneData with sensors."""

        def start(scene: Any) -> Any:
            data = mx.SceneData(scene)
            put_state(data, self._layout, moment.qpos, moment.qvel)
            commands, self._commands = self._commands, moment.ctrl
            try:
                self._command(scene, data)
            finally:
                self._commands = commands
            return data

        with HiddenWorld.lock:
            return contacts_at(self._engine, self._layout.geoms, self.raw, start)

    def diverging(self, fastest: float) -> bool:
        """Tell whether a velocity is NaN or beyond its bound."""
        velocities = self._own_velocities()
        speed = float(np.abs(velocities).max(initial=0.0))
        self._wild = not speed < _FAST
        return not speed < fastest

    def close(self) -> None:
        """Let the SceneData go."""
        self.raw = None


def put_state(data: Any, layout: MotrixLayout, qpos: Array, qvel: Array) -> None:
    """Write a state into a SceneData.

    Args:
        data: The SceneData.
        layout: Where its model has what the Model counts.
        qpos: (nq,) as in a Data; quaternions are normalised.
        qvel: (nv,) as in a Data.
    """
    positions, velocities = np.empty(len(qpos), np.float32), np.empty(len(qvel), np.float32)
    unit = np.array(qpos)
    for start in layout.quaternions:
        unit[start : start + 4] = _unit(unit[start : start + 4])
    positions[layout.qpos] = unit
    velocities[layout.qvel] = qvel
    data.low.set_dof_positions_unchecked(positions)
    data.set_dof_vel(velocities)


def put_command(scene: Any, data: Any, ctrl: Array) -> None:
    """Write ctrl (nu,) into a SceneData, which copies it; nothing where actuation is off."""
    if scene.num_actuators:
        data.actuator_ctrls = ctrl.astype(np.float32)


def _unit(quat: Array) -> Array:
    """Return a quaternion (4,), wxyz, of length one: the identity for one of zeros, as MuJoCo."""
    length = float(np.linalg.norm(quat))
    return quat / length if length else np.array([1.0, 0.0, 0.0, 0.0])


def _is_wild(qpos: Array, qvel: Array) -> bool:
    """Tell whether a step from here may end in a panic."""
    calm = bool(qpos.dot(qpos) < _FAR * _FAR and qvel.dot(qvel) < _FAST * _FAST)
    return not calm


def _wxyz(quat: Array) -> Array:
    """Return quaternions (n, 4) in our order, of length one as single precision has it not."""
    turned = wxyz_from_xyzw(quat)
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)
