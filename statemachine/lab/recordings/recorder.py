"""Record a run, on any backend.

The run itself is watched as little as possible: each step keeps the bytes of its inputs, and
nothing else. What the engine derives from them is read while the run is *repeated* from its
beginning with the recorded commands. The repetition must end in the same bits, row by row,
which is checked: a trace is a proof that the run can be replayed. Of runs that nobody keeps, of
which many are made, it is read as the run goes, or not at all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from ...errors import BadInputError, DivergedError, EngineError
from ...interface import INPUTS, MOCAP, Array, Data, Model, State, make_data, reset, set_state
from ...interface.checks import HUGE
from ...interface.options import OptionValue
from ...interface.read_options import non_default_options
from ...interface.records import Arrays, Defaults
from ..runs.controllers import check_controller
from ..runs.drive import (
    Controller,
    Progress,
    drive,
    no_progress,
    number_of_steps,
    progress_of_stage,
)
from ..runs.provenance import provenance
from ..runs.robot import is_servo, warn_of_start
from .energies import energies
from .header import Header
from .repetition import DerivedRows, compute_derived, is_stale
from .trace import Trace

# How a trace comes to what the engine derives: from a repetition of the run, from the run itself as
# it goes, or not at all.
DerivedFrom = Literal["repetition", "run", "nothing"]


@dataclass(frozen=True, eq=False)
class RunStart:
    """The state that a run starts in.

    Attributes:
        keyframe: A keyframe, by number or name; None for the default state.
        state: A State to start from instead.
        qpos: (nq,) positions [rad or m] that are written over that start; None for its own.
        qvel: (nv,) velocities [rad/s or m/s] that are written over it; None for its own.

    Raises:
        BadInputError: It is a keyframe and a State.
    """

    keyframe: int | str | None = None
    state: State | None = None
    qpos: ArrayLike | None = None
    qvel: ArrayLike | None = None

    def __post_init__(self) -> None:
        if self.state is not None and self.keyframe is not None:
            raise BadInputError("a run starts from a keyframe or from a State, not from both")

    def put(self, model: Model, data: Data) -> None:
        """Put a Data of a Model to this start."""
        if self.state is not None:
            set_state(model, data, self.state)
        else:
            reset(model, data, self.keyframe)
        if self.qpos is not None:
            data.qpos = self.qpos
        if self.qvel is not None:
            data.qvel = self.qvel


@dataclass(frozen=True, eq=False)
class RunMetadata:
    """The facts of a run that its trace carries in the header.

    Attributes:
        experiment: Its name; "" for that of the controller.
        description: What happens, in a sentence.
        command: What makes it again.
        defaults: What `load` was given.
        options: What `Model.replace` was given.
        seed: What the controller was drawn from; None for nothing.
    """

    experiment: str = ""
    description: str = ""
    command: str = ""
    defaults: Defaults = "model"
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    seed: int | None = None


def record(
    model: Model,
    controller: Controller | None = None,
    seconds: float = 2.0,
    *,
    start: RunStart = RunStart(),
    metadata: RunMetadata = RunMetadata(),
    derived: DerivedFrom = "repetition",
    writes_state: bool = True,
    progress: Progress = no_progress,
) -> Trace:
    """Run a controller from a start, and keep everything.

    Args:
        model: On any backend.
        controller: Called before each step as f(model, data); what it returns is the ctrl
            (nu,) of that step, None leaves ctrl alone. Without one nobody writes ctrl.
        seconds: Simulated time.
        start: Where to start; the default state where nothing is said.
        metadata: What the header of the trace says of the run.
        derived: From what the columns are that the engine derives; "nothing" leaves them out.
            "run" does not check that the run can be repeated. Under a controller that writes ctrl
            alone it gives the bits of "repetition". It needs an engine whose derived arrays are,
            after a step, of the state that the step began in, and a run that does not diverge:
            others are repeated.
        writes_state: Whether the controller may write more than ctrl.
        progress: Told the fraction that is done.

    Returns:
        A trace with a row for each step and one for the end. If the engine diverges it has
        the rows until then, and `header.ended` says why.

    Raises:
        BadInputError: The controller takes something else, or gave something that is not ctrl, or
            `seconds` is not a time.
        EngineError: The repetition did not end in the same bits.
    """
    if controller is not None:
        check_controller(controller)
    total = number_of_steps(model, seconds)
    share = 1.0 if derived == "nothing" else 0.3
    rows = DerivedRows() if derived == "run" and is_stale(model) else None
    with make_data(model) as data:
        start.put(model, data)
        warn_of_start(model, data)
        moments = drive(model, data, controller, total, once_more=True)
        if rows is not None:
            moments = rows.read_along(model, data, moments)
        inputs, ended = _run(model, data, moments, total, progress_of_stage(progress, 0.0, share))
    columns: dict[str, Any] = dict(inputs)
    rewritten, energy_by = 0, ""
    if derived != "nothing":
        if rows is not None and not ended:
            columns |= rows.columns()
        else:
            stage = progress_of_stage(progress, share, 1.0 - share)
            repeated, rewritten = compute_derived(model, start.put, inputs, stage)
            columns |= repeated
        may_write_state = controller is not None and writes_state
        if rewritten and not may_write_state:
            raise EngineError(
                f"the run could not be repeated: {rewritten} rows began in another state; the "
                "engine does not give the same bits twice"
            )
        gravity = metadata.options.get("gravity")
        columns["energy"], energy_by = energies(
            model, metadata.defaults, inputs["qpos"], inputs["qvel"], gravity
        )
    header = replace(
        _header(model, controller, start, metadata),
        energy_by=energy_by,
        rewritten=rewritten,
        ended=ended,
    )
    return Trace(header, columns)


def _header(
    model: Model, controller: Controller | None, start: RunStart, metadata: RunMetadata
) -> Header:
    """Return what is known of a run before it begins."""
    options: dict[str, OptionValue] = {**non_default_options(model.read_options)}
    options |= {name: _as_json_value(value) for name, value in metadata.options.items()}
    return Header(
        experiment=_experiment(metadata, controller),
        description=metadata.description,
        command=metadata.command,
        provenance=provenance(model, metadata.seed),
        defaults=metadata.defaults,
        options=options,
        keyframe=_keyframe_name(model, start.keyframe),
        timestep=model.timestep,
        substeps=model.substeps,
        gravity=tuple(model.gravity.tolist()),
        **layout_of(model),
    )


def _experiment(metadata: RunMetadata, controller: Controller | None) -> str:
    """Return the name of an experiment: as it is said, else that of its controller."""
    if metadata.experiment:
        return metadata.experiment
    return getattr(controller, "__name__", "") or "run"


def _as_json_value(option: Any) -> Any:
    """Return the value of an option, an array as a list."""
    return option.tolist() if isinstance(option, np.ndarray | np.generic) else option


def _keyframe_name(model: Model, keyframe: int | str | None) -> str | None:
    """Return the name of a keyframe that is given by number or name."""
    return None if keyframe is None else model.keyframes[model.key_id(keyframe)].name


class ModelLayout(TypedDict):
    """The fields of a `Header` that are a model's: lengths, names, and where everything is."""

    nq: int
    nv: int
    nu: int
    nmocap: int
    joints: tuple[str, ...]
    sites: tuple[str, ...]
    bodies: tuple[str, ...]
    geoms: tuple[str, ...]
    actuators: tuple[str, ...]
    jnt_type: tuple[int, ...]
    jnt_qposadr: tuple[int, ...]
    jnt_dofadr: tuple[int, ...]
    jnt_bodyid: tuple[int, ...]
    site_bodyid: tuple[int, ...]
    servo_gear: tuple[float, ...]
    geom_bodyid: tuple[int, ...]
    body_parentid: tuple[int, ...]
    actuator_jntid: tuple[int, ...]
    ctrlrange: tuple[tuple[float, ...], ...]


def layout_of(model: Model) -> ModelLayout:
    """Return what a header says of a model: lengths, names, and where everything is."""
    ctrlrange = tuple(tuple(row) for row in model.actuator_ctrlrange.tolist())
    servo_gear = np.where(is_servo(model), model.actuator_gear, 0.0)
    layout: ModelLayout = {
        "nq": model.nq,
        "nv": model.nv,
        "nu": model.nu,
        "nmocap": model.nmocap,
        "joints": model.joint_names,
        "sites": model.site_names,
        "bodies": model.body_names,
        "geoms": model.geom_names,
        "actuators": model.actuator_names,
        "jnt_type": tuple(model.jnt_type.tolist()),
        "jnt_qposadr": tuple(model.jnt_qposadr.tolist()),
        "jnt_dofadr": tuple(model.jnt_dofadr.tolist()),
        "jnt_bodyid": tuple(model.jnt_bodyid.tolist()),
        "site_bodyid": tuple(model.site_bodyid.tolist()),
        "geom_bodyid": tuple(model.geom_bodyid.tolist()),
        "body_parentid": tuple(model.body_parentid.tolist()),
        "actuator_jntid": tuple(model.actuator_jntid.tolist()),
        "ctrlrange": ctrlrange,
        "servo_gear": tuple(servo_gear.tolist()),
    }
    return layout


def _run(
    model: Model, data: Data, moments: Iterator[float], total: int, progress: Progress
) -> tuple[Arrays, str]:
    """Run, and return the inputs of each row as the step begins, and why the run ended early."""
    times: list[float] = []
    rows: tuple[list[bytes], ...] = ([], [], [])
    mocap: dict[str, list[Array]] = {name: [] for name in MOCAP if model.nmocap}
    # Bound methods: this loop is all that a recording costs while the run goes on.
    keep_time, (keep_qpos, keep_qvel, keep_ctrl) = times.append, (row.append for row in rows)
    qpos, qvel, ctrl = data.qpos.tobytes, data.qvel.tobytes, data.ctrl.tobytes
    ended = ""
    try:
        for now in moments:
            keep_time(now)
            keep_qpos(qpos())
            keep_qvel(qvel())
            keep_ctrl(ctrl())
            for name, poses in mocap.items():
                poses.append(getattr(data, name).copy())
            if not len(times) & 255:
                progress(len(times) / total)
    except DivergedError as error:
        if not data._unusable:  # a controller's own, of another Data
            raise
        # Without its advice, which is of no use here.
        ended = str(error).partition(". This Data")[0]
    inputs: Arrays = {"time": np.array(times)}
    for name, parts, width in zip(INPUTS, rows, (model.nq, model.nv, model.nu), strict=True):
        inputs[name] = np.frombuffer(b"".join(parts)).reshape(len(times), width)
    inputs |= {name: np.array(poses) for name, poses in mocap.items()}
    count = _rows_within_bounds(inputs)
    if count < len(times) and not ended:
        ended = f"a coordinate left every bound at {times[-1]:g} s"
    inputs = {name: array[:count] for name, array in inputs.items()}
    _check_last_row(inputs)
    progress(1.0)
    return inputs, ended


def _check_last_row(inputs: Arrays) -> None:
    """Check that the last row has numbers: no step checks what a controller writes into it.

    Raises:
        BadInputError: An entry is not a finite number.
    """
    for name, array in inputs.items():
        if not np.isfinite(array[-1]).all():
            raise BadInputError(f"the controller left {name} with an entry that is not a number")


def _rows_within_bounds(inputs: Arrays) -> int:
    """Return how many rows a trace can hold: the last ones may have finite numbers beyond it."""
    state = np.hstack([inputs["qpos"], inputs["qvel"]])
    stands = np.flatnonzero(~((np.abs(state) > HUGE) & np.isfinite(state)).any(axis=1))
    return int(np.append(0, stands)[-1]) + 1  # the first is what it started from
