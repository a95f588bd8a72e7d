"""What one step does: every line of it in a second program, and each line left out once."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import DivergedError
from ...interface import Array, Data, JointType, Model
from ...lab.runs.drive import Progress, number_of_steps, progress_of_stage
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.usual_commands import hold_ctrl
from ...lab.validate.stepped_features import INTEGRATOR, check_is_stepped, other_integrator
from ...lab.validate.stepper import Stepper, StepTerms
from ._robot import check_servos, start_line
from .session import CodeRun, Course, Options

# What a robot is loaded without: the second program has neither.
WITHOUT = {"contacts": False, "limits": False}
_SHARE_OF_CODE = 0.2  # of the time that the lesson takes


@dataclass(frozen=True)
class StepLine:
    """A line of a step, and the step without it.

    Attributes:
        name: What is left out, or computed in another way: a label of the lesson.
        formula: What it computes.
        terms: Those that are left.
    """

    name: str
    formula: str
    terms: StepTerms


LINES: tuple[StepLine, ...] = (
    StepLine("gravity", "τ −= g(q)", StepTerms(gravity=False)),
    StepLine("coriolis", "τ −= C(q, q̇) q̇", StepTerms(coriolis=False)),
    StepLine("armature", "M += armature", StepTerms(armature=False)),
    StepLine("stiffness", "τ += kp (ctrl − q)", StepTerms(servo_stiffness=False)),
    StepLine("servo_damping", "τ −= kv q̇", StepTerms(servo_damping="none")),
    StepLine("force_limits", "clip(τ, forcerange)", StepTerms(force_limits=False)),
    StepLine("damping", "τ −= D q̇", StepTerms(damping="none")),
    StepLine("friction", "τ += f(q̇, τ)", StepTerms(friction_loss=False)),
    StepLine("implicit_servo", "M + h kv", StepTerms(servo_damping="explicit")),
    StepLine("implicit_damping", "M + h D", StepTerms(damping="explicit")),
    StepLine("new_velocity", "q += h q̇ (new q̇)", StepTerms(position_update="old velocity")),
)


@dataclass(frozen=True)
class WithoutLine:
    """The same run by steps that lack a line.

    Attributes:
        name: The line, as in `LINES`.
        formula: What the line computes.
        gap: Largest distance of a joint from the engine's run, until it diverged if it did [rad; of
            a slide, m].
        joint: The joint that is farthest off.
        slide: Whether that joint is a slide.
        at: When [s].
        diverged_at: When a coordinate stopped being finite [s]; None if none did.
    """

    name: str
    formula: str
    gap: float
    joint: str
    slide: bool
    at: float
    diverged_at: float | None


@dataclass(frozen=True)
class StepLessonResult:
    """How near a second program comes to the engine's steps, and what each of its lines is worth.

    Attributes:
        steps: Number of steps of each run.
        time: (n+1,) of the states [s].
        qpos: (n+1, nq) the engine's run [rad; of a slide, m].
        moved: Largest distance that a joint goes from its start [rad; of a slide, m].
        whole: The run of the second program with all lines.
        without: A run for each line that is left out.
        source: The lines of the program that make a step.
        provenance: What it was computed with.
    """

    steps: int
    time: Array
    qpos: Array
    moved: float
    whole: WithoutLine
    without: tuple[WithoutLine, ...]
    source: tuple[str, ...]
    provenance: Provenance

    def gap_without(self, name: str) -> float:
        """Return how far the run without a line is from the engine's [rad; of a slide, m]."""
        return next(row.gap for row in self.without if row.name == name)


def code(model: Model, options: Options, load: str) -> str:
    """Write the same run twice: by the engine, and by a program of ours that is read below."""
    check_servos(model, "step")
    changes, integrator = dict[str, bool | str](WITHOUT), other_integrator(model)
    if integrator:
        changes["integrator"] = INTEGRATOR
    check_is_stepped(model.replace(**changes))
    steps = number_of_steps(model, options["seconds"])
    return f"""\
import numpy as np
import statemachine as sm
from statemachine.lab.validate.stepper import Stepper

model = {load}
{_replace_lines(changes, integrator)}\
data = sm.make_data(model)
{start_line(model, "model")}other = Stepper(model)  # the same robot, by Pinocchio and NumPy
other.qpos[:] = data.qpos
other.ctrl[:] = data.ctrl[:] = {hold_ctrl(model).tolist()}
worst = 0.0
for _ in range({steps}):
    sm.step(model, data)
    other.step()
    worst = max(worst, np.abs(data.qpos - other.qpos).max())
print(worst)
"""


def _replace_lines(changes: Mapping[str, bool | str], integrator: str) -> str:
    """Return what is typed for the options with which the lesson runs a Model.

    A file that names no integrator has Euler: the lesson then chooses the one that it is about.

    Args:
        changes: The options.
        integrator: That of the file, where the lesson has another one; else "".
    """
    words: list[str] = []
    for name, value in changes.items():
        text = f'"{value}"' if isinstance(value, str) else str(value)
        words.append(f"{name}={text}")
    line = f"model = model.replace({', '.join(words)})\n"
    if not integrator:
        return line
    return f"# integrator: {integrator} in the file, {INTEGRATOR} in Stepper\n{line}"


def run(play: CodeRun, options: Options, progress: Progress) -> StepLessonResult:
    """Watch the engine's run; then make it by steps that lack a line, one line after the other."""
    total = number_of_steps(play.model, options["seconds"])
    (course,) = play.follow(_nothing, total, progress_of_stage(progress, 0.0, _SHARE_OF_CODE))
    model, data = play.worlds[0]
    qpos = np.array(course.qpos)
    moved = float(np.abs(qpos - qpos[0]).max())
    later = progress_of_stage(progress, _SHARE_OF_CODE, 1.0 - _SHARE_OF_CODE)
    whole = _run_without(model, data, course, StepLine("nothing", "", StepTerms()))
    rows: list[WithoutLine] = []
    for line in LINES:
        rows.append(_run_without(model, data, course, line))
        later(len(rows) / len(LINES))
    return StepLessonResult(
        steps=len(qpos) - 1,
        time=np.array(course.time),
        qpos=qpos,
        moved=moved,
        whole=whole,
        without=tuple(rows),
        source=tuple(step_source()),
        provenance=provenance(model),
    )


def _nothing(_model: Model, _data: Data) -> None:
    """Look at nothing after a step: positions are kept in any case."""


def _run_without(model: Model, data: Data, course: Course[None], line: StepLine) -> WithoutLine:
    """Return how far the steps that lack a line are from the engine's run."""
    stepper = Stepper(model, line.terms)
    stepper.qpos[:] = course.qpos[0]
    stepper.ctrl[:] = data.ctrl
    gaps: list[Array] = []
    diverged_at = None
    with np.errstate(all="ignore"):
        for qpos in course.qpos[1:]:
            try:
                stepper.step()
            except DivergedError:
                diverged_at = stepper.time
                break
            gaps.append(np.abs(stepper.qpos - qpos))
    return _row(model, course.time, line, gaps, diverged_at)


def _row(
    model: Model,
    time: Sequence[float],
    line: StepLine,
    gaps: Sequence[Array],
    diverged_at: float | None,
) -> WithoutLine:
    """Return what the gaps of a run (n,) of (nq,) come to."""
    table = np.array(gaps).reshape(len(gaps), model.nq)
    if not table.size:
        return WithoutLine(line.name, line.formula, np.inf, "", False, 0.0, diverged_at)
    moment, place = np.unravel_index(int(table.argmax()), table.shape)
    joint = int(np.flatnonzero(model.jnt_qposadr == place)[0])
    is_slide = bool(model.jnt_type[joint] == JointType.SLIDE)
    return WithoutLine(
        name=line.name,
        formula=line.formula,
        gap=float(table.max()),
        joint=model.joint_names[joint],
        slide=is_slide,
        at=float(time[int(moment) + 1]),
        diverged_at=diverged_at,
    )


def step_source() -> list[str]:
    """Return the lines of the program that make one step, without indentation and docstring."""
    source = textwrap.dedent(inspect.getsource(Stepper.advance_once))
    docstring = ast.parse(source).body[0].body[0]  # type: ignore[attr-defined]
    lines = source.rstrip().splitlines()
    return [*lines[: docstring.lineno - 1], *lines[docstring.end_lineno :]]
