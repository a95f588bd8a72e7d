"""The fitted figures, written into the text of the model's file.

What the recording determines is written as attributes of the elements themselves. The file is
loaded, and a figure that it then has otherwise is taken back and told with its reason. What is not
determined stays as it was, and figures that stand in for each other then fit together no more: so
the commands of what was not fitted are played into the file, and the gap that stays is told.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...atomic_files import beside
from ...backends import load
from ...engines import raw_engine_of
from ...engines.description.file_changes import UnwrittenChange
from ...engines.description.file_form import FileForm, NotWrittenError
from ...engines.description.xml_source import AttributeText, XmlSource
from ...engines.records import Edit, SpecEdit
from ...errors import BadInputError, EngineWarning
from ...installed import DEFAULT
from ...interface import Model
from ...models import resolve
from ..why.rewriting import RewrittenFile, changes_of, check_target, text_at
from .parameter_texts import name_of_parameter
from .recorded_gap import gap_held_out
from .results import FittedParameter, IdentificationResult, RecordingRequest

_SUFFIXES = (".xml", ".mjcf")
_DIGITS = 6  # of a written figure: a recording tells three at most
_EXACT = 1e-9  # relative: what the compiled model may be off from what was written
_CALIBRATION = "it is how the arm was calibrated, and no figure of the model"
_OTHERWISE = "the model that is compiled of the file has another figure"


@dataclass(frozen=True, eq=False)
class _Planned:
    """A parameter that is to be written.

    Attributes:
        name: Its name.
        edits: What the compiled model of the file is to have.
        texts: The attributes that say so.
    """

    name: str
    edits: Sequence[Edit]
    texts: Sequence[AttributeText]


def check_written(request: RecordingRequest) -> None:
    """Refuse a file that cannot be written, before anything is fitted.

    Raises:
        BadInputError: The model's file is no MJCF, or as of `why.rewriting.check_target`.
        ModelError: The model's file is no XML.
    """
    if request.write is None:
        return
    path = resolve(request.model, request.menagerie)
    if path.suffix.lower() not in _SUFFIXES:
        raise BadInputError(f"--write changes the text of an MJCF; {path.name} is none")
    inputs = [] if request.calibration is None else [Path(request.calibration)]
    check_target(Path(request.write), path, path, inputs)


def with_written(result: IdentificationResult) -> IdentificationResult:
    """Write the model's file with the fitted figures, if that is asked for.

    Returns:
        The result, which says what was written and what was not, and why.

    Raises:
        StateMachineError: The model's file cannot be read.
    """
    request = result.request
    if request.write is None:
        return result
    file = _FittedFile(result, XmlSource(result.arm.path), Path(request.write))
    return replace(result, rewritten=file.written())


class _FittedFile:
    """Writes what a recording determines into the text of a file.

    Args:
        result: What the recording tells.
        source: The file of the model as it is.
        target: The file that is written.
    """

    def __init__(self, result: IdentificationResult, source: XmlSource, target: Path) -> None:
        self._result, self._model = result, result.arm
        self._source, self._target = source, target
        self._not_written: list[UnwrittenChange] = []

    def written(self) -> RewrittenFile:
        """Write the file, and return what was written of it."""
        planned = list(self._plan())
        with beside(self._target) as (part,):
            model = self._loaded(Path(part), planned)
            good = [each for each in planned if _has(model.compiled, each.edits)]
            if len(good) < len(planned):
                model = self._loaded(Path(part), good)
        gap = gap_held_out(model, self._result.recordings)
        for each in planned:
            if each not in good:
                self._not_written.append(UnwrittenChange(each.name, _OTHERWISE))
        texts = [text for each in good for text in each.texts]
        return RewrittenFile(
            file=os.fspath(self._target),
            of=self._model.path.name,
            written=changes_of(texts),
            not_written=tuple(self._not_written),
            gap=gap,
            before=self._result.gap.model,
            quantity="joints",
            unit="rad",
        )

    def _plan(self) -> Iterator[_Planned]:
        """Yield what is determined and can be written; of the rest of it, note why it cannot."""
        form = self._form()
        for parameter in self._result.parameters:
            name = name_of_parameter(parameter)
            if parameter.verdict != "determined":
                continue
            if parameter.kind == "offset":
                self._not_written.append(UnwrittenChange(name, _CALIBRATION))
                continue
            edits, spec_edits = self._edits(parameter)
            try:
                yield _Planned(name, edits, form.texts(edits, spec_edits))
            except NotWrittenError as error:
                self._not_written.append(UnwrittenChange(name, str(error)))

    def _form(self) -> FileForm:
        """Return what writes figures of the compiled model as attributes."""
        raw: Any = self._model.compiled
        same = {geom: geom for geom in range(raw.ngeom)}
        return raw_engine_of(DEFAULT).file_form(self._source, raw, self._model.path, raw, same)

    def _edits(self, parameter: FittedParameter) -> tuple[list[Edit], list[SpecEdit]]:
        """Return what the compiled model, and its description, are to have."""
        fitted: Any = self._result.fitted_arm.compiled
        if parameter.kind == "delay":
            return self._edits_of_delay(parameter.fitted)
        if parameter.kind == "payload":
            return self._edits_of_payload(fitted), []
        joint = self._model.joint_id(parameter.joint or "")
        dof = int(self._model.jnt_dofadr[joint])
        servo = self._model.actuator_jntid.tolist().index(joint)
        match parameter.kind:
            case "kp":
                kp = _rounded(fitted.actuator_gainprm[servo, 0])
                return [
                    ("actuator_gainprm", (servo, 0), kp),
                    ("actuator_biasprm", (servo, 1), -kp),
                ], []
            case "viscous":
                return [
                    ("actuator_biasprm", (servo, 2), _rounded(fitted.actuator_biasprm[servo, 2])),
                    ("dof_damping", (dof,), _rounded(fitted.dof_damping[dof])),
                ], []
            case "friction":
                return [("dof_frictionloss", (dof,), _rounded(fitted.dof_frictionloss[dof]))], []
            case _:
                return [("dof_armature", (dof,), _rounded(fitted.dof_armature[dof]))], []

    def _edits_of_payload(self, fitted: Any) -> list[Edit]:
        """Return what the bodies are to have that weigh something else where the arm is fitted."""
        raw: Any = self._model.compiled
        edits: list[Edit] = []
        for body in np.flatnonzero(~np.isclose(fitted.body_mass, raw.body_mass)).tolist():
            for array in ("body_mass", "body_ipos", "body_iquat", "body_inertia"):
                value = getattr(fitted, array)[body]
                if not np.allclose(value, getattr(raw, array)[body]):
                    edits.append((array, (body,), np.array([_rounded(x) for x in np.ravel(value)])))
        return edits

    def _edits_of_delay(self, delay: float) -> tuple[list[Edit], list[SpecEdit]]:
        """Return what each servo of the recording is to have so that its commands are late."""
        late: Any = self._model.replace(latency=delay).compiled
        driven = self._model.actuator_jntid.tolist()
        edits: list[Edit] = []
        spec_edits: list[SpecEdit] = []
        for joint in self._result.recordings.fitted.joints:
            servo = driven.index(self._model.joint_id(joint))
            edits.append(("actuator_delay", (servo,), float(late.actuator_delay[servo])))
            room = int(late.actuator_history[servo, 0])
            spec_edits.append(SpecEdit("actuator", servo, "nsample", room))
        return edits, spec_edits

    def _loaded(self, part: Path, planned: Sequence[_Planned]) -> Model:
        """Write the file with some parameters, and load it."""
        self._source.forget()
        for each in planned:
            for text in each.texts:
                self._source.set(text)
        part.write_bytes(text_at(self._source, self._target))
        with warnings.catch_warnings():  # of the model they were given when it was loaded
            warnings.simplefilter("ignore", EngineWarning)
            return load(part)


def _rounded(value: float) -> float:
    """Return a figure with as many digits as are written."""
    return float(f"{value:.{_DIGITS}g}")


def _has(compiled: Any, edits: Sequence[Edit]) -> bool:
    """Tell whether a compiled model has what it was to have."""
    return all(
        np.allclose(getattr(compiled, array)[index], value, rtol=_EXACT, atol=0.0)
        for array, index, value in edits
    )
