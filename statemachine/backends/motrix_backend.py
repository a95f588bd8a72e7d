"""MotrixSim behind the contract. The engine reads the file itself; nothing is emulated but zeros.

MuJoCo compiles the file too, for names, ids and keyframes; where MotrixSim reads another number,
the Model shows that one (`motrix.reading`). What it says that it ignores is an EngineWarning at
load.
"""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..errors import EngineWarning, ModelError
from ..installed import engine_version
from ..interface import BEHAVIOURS, OPTIONS, Array, Behaviour, Capabilities
from ..interface.checks import HUGE
from ..interface.records import Defaults
from ..measures.text import few, listed
from . import edits as _edits
from .binary import is_binary
from .compiled.model import check_numbers, compile_file, compiler_warnings, facts, fastest
from .hidden_data import HiddenModel
from .motrix.engine_model import EngineModel
from .motrix.links import TITLE
from .motrix.reading import MotrixReading, read_file
from .motrix.settings import settings_between
from .motrix.world import MotrixWorld

if TYPE_CHECKING:
    from .compiled.types import MjModel

_NOT_TOLD = "the engine tells neither its mass matrix nor the forces of its joints"
_BEHAVIOURS = {
    "stale after a write": Behaviour("native", "poses stay as they are until forward_kinematic"),
    "stale after a step": Behaviour("native", "poses are of the state before the step"),
    "zeros when fresh": Behaviour(
        "emulated", "by the adapter; in a fresh SceneData sites are where they are in their links"
    ),
    "position servo": Behaviour(
        "native", "the engine's own; an infinite ctrl is clamped to its range, or refused"
    ),
    "latency": Behaviour(
        "emulated", "by the adapter, which keeps the last commands, in whole engine steps"
    ),
    "armature": Behaviour("native", "the engine's own"),
    "joint damping": Behaviour("native", "the engine's own, implicit; a ball joint's is not read"),
    "dry friction": Behaviour("native", "the engine's own, soft as MuJoCo's"),
    "joint limits": Behaviour("native", "the engine's own, soft as MuJoCo's"),
    "free joint conventions": Behaviour(
        "native", "MuJoCo's, but quaternions x y z w, which the adapter reorders"
    ),
    "forces by part": Behaviour("unsupported", _NOT_TOLD),
    "contacts": Behaviour(
        "native",
        "the engine's own sensors, with a pyramid for a cone. Forces are those of a step from the "
        "same state whose solver starts from nothing: what it starts from cannot be read",
    ),
    "exact restore": Behaviour(
        "unsupported",
        "two restores of one State have the same future, bit by bit; that of the run it was taken "
        "from is within 2e-6 of it without contacts and at rest, and in a grasp or an impact up to "
        "1e-2 rad away: what the solver starts from cannot be read",
    ),
    "no automatic reset": Behaviour(
        "emulated",
        "the adapter looks at every step, and raises DivergedError where qvel is beyond max_qvel "
        f"or qpos beyond {HUGE:g}, and where the engine panics",
    ),
}
CAPABILITIES = Capabilities(
    options=tuple(name for name in OPTIONS if name != "integrator"),
    integrators=(),
    behaviours={name: _BEHAVIOURS[name] for name in BEHAVIOURS},
    shared_model=True,
    exact_restore=False,
    precision="float32",
    refused={"integrator": "the engine has one of its own, and ignores that of the file"},
)


def load(path: Path, defaults: Defaults = "model") -> MotrixModel:
    """Let MotrixSim read an MJCF or URDF file.

    Args:
        path: The file.
        defaults: Both are the same: nothing of the engine is set otherwise than its users meet it.

    Raises:
        ModelError: MotrixSim or MuJoCo cannot read it.
        UnsupportedError: It has activations, or MotrixSim reads other elements than MuJoCo.
    """
    if is_binary(path):
        raise ModelError(f"{path} was compiled by MuJoCo; {TITLE} wants its XML")
    with compiler_warnings() as texts:
        compiled = compile_file(path)
    for text in texts:
        warnings.warn(f"MuJoCo, which compiles {path}: {text}", EngineWarning, stacklevel=3)
    reading = read_file(path, compiled)
    check_numbers(reading.raw, f"{path} in {TITLE}")
    _tell(reading)
    return MotrixModel(reading, reading.raw, substeps=1)


def _tell(reading: MotrixReading) -> None:
    """Warn of what MotrixSim ignores in a file, or reads otherwise."""
    told: list[str] = []
    if reading.ignored:
        told.append(f"it ignores {listed(reading.ignored)}")
    if reading.otherwise:
        told.append(f"it reads {few(reading.otherwise, 5)}")
    told += reading.warnings
    if told:
        text = f"{TITLE}, of {reading.engine.path.name}: {'; '.join(told)}"
        warnings.warn(text, EngineWarning, stacklevel=4)


class MotrixModel(HiddenModel):
    """MotrixSim's model of a file, which all its Data share.

    `raw` is the engine's SceneModel.

    Attributes:
        reading: What MotrixSim makes of the file.
    """

    reading: MotrixReading
    _compiled: MjModel
    _asked: Array | None  # max_qvel, where it was set

    def __init__(
        self,
        reading: MotrixReading,
        compiled: MjModel,
        substeps: int,
        max_qvel: Array | None = None,
    ) -> None:
        settings = settings_between(reading.raw, compiled)
        if settings and not reading.layout.same_links:
            _refuse_settings_of_links(settings)
        engine = reading.engine
        if settings:
            engine = EngineModel(engine.path, {**engine.settings, **settings})
        timestep, known = float(compiled.opt.timestep), facts(compiled)
        known |= {"timestep": timestep * substeps, "substeps": substeps, "raw": engine.scene}
        qpos0, nu = compiled.qpos0.copy(), known["nu"]
        super().__init__(
            partial(MotrixWorld, engine, reading.layout, qpos0, timestep, nu),
            backend="motrix",
            engine_version=engine_version("motrix"),
            path=reading.engine.path,
            capabilities=CAPABILITIES,
            max_qvel=fastest(compiled) if max_qvel is None else max_qvel,
            **known,
            reading=reading,
            _compiled=compiled,
            _asked=max_qvel,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # MotrixSim's model cannot be pickled: it is read again.
        start = {name: vars(self)[name] for name in _START if name in vars(self)}
        return _made_again, (self.reading, self._compiled, self.substeps, self._asked, start)

    @property
    def compiled(self) -> MjModel:
        """Return the compiled model with the numbers that MotrixSim reads."""
        return self._compiled

    def with_compiled(self, compiled: MjModel) -> MotrixModel:
        check_numbers(compiled, str(self.path))
        model = MotrixModel(self.reading, compiled, self.substeps, self._asked)
        return model._inherit_start(self, {})

    def _replace(self, options: dict[str, Any]) -> MotrixModel:
        substeps = options.get("substeps", self.substeps)
        timestep = _edits.step_length(self.timestep, substeps, options)
        compiled = _edits.edited(cast("Any", self._compiled), options, timestep)
        return MotrixModel(self.reading, compiled, substeps, options.get("max_qvel", self._asked))


_START = ("_holds_start", "read_options", "defaults", "options")


def _made_again(
    reading: MotrixReading,
    compiled: MjModel,
    substeps: int,
    asked: Array | None,
    start: dict[str, Any],
) -> MotrixModel:
    """Return a Model of a pickle."""
    model = MotrixModel(reading, compiled, substeps, asked)
    vars(model).update(start)
    return model


def _refuse_settings_of_links(settings: dict[str, Array]) -> None:
    """Raise UnsupportedError for what is set per body or geom where links are not the bodies."""
    from ..interface.checks import unsupported_by

    for name in ("mass factor", "geom_friction"):
        if name in settings:
            option = name.removesuffix(" factor").removeprefix("geom_")
            raise unsupported_by("motrix", option, "its links are not the bodies of this file")
