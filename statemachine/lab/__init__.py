"""What can be found out about a model and its engines: runs, comparisons, causes, surveys.

    from statemachine import lab

    result = lab.compare("a.xml", "b.urdf@pybullet", what=policy)
    print(result)
    lab.why(result.request.run)
    lab.models("a.xml", "b.urdf").to_dict()

Each question is a function with keyword arguments, or takes its Request. Names are imported when
they are first used.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType

# As typing.TYPE_CHECKING is to type checkers.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from .ask.descriptions import models as models
    from .ask.engines import engines as engines
    from .ask.gaps import compare as compare
    from .ask.gaps import why as why
    from .ask.pages import write as write
    from .ask.recordings import identify as identify
    from .ask.recordings import recording as recording
    from .ask.releases import versions as versions
    from .ask.steps import converge as converge
    from .ask.steps import one_step as one_step
    from .ask.sweeps import sweep as sweep
    from .ask.sweeps import sweep_report as sweep_report
    from .compare.sides import Request as Request
    from .compare.sides import Side as Side
    from .identification.results import RecordingRequest as RecordingRequest
    from .questions.requests.causes import ExplainRequest as ExplainRequest
    from .questions.requests.converge import ConvergeRequest as ConvergeRequest
    from .questions.requests.engines import EnginesRequest as EnginesRequest
    from .questions.requests.gap import CompareRequest as CompareRequest
    from .questions.requests.models import ModelsRequest as ModelsRequest
    from .questions.requests.one_step import OneStepRequest as OneStepRequest
    from .questions.requests.versions import VersionsRequest as VersionsRequest

_QUESTIONS = {
    "compare": "ask.gaps",
    "converge": "ask.steps",
    "engines": "ask.engines",
    "identify": "ask.recordings",
    "models": "ask.descriptions",
    "one_step": "ask.steps",
    "recording": "ask.recordings",
    "sweep": "ask.sweeps",
    "sweep_report": "ask.sweeps",
    "versions": "ask.releases",
    "why": "ask.gaps",
    "write": "ask.pages",
}
_REQUESTS = {
    "CompareRequest": "questions.requests.gap",
    "ConvergeRequest": "questions.requests.converge",
    "EnginesRequest": "questions.requests.engines",
    "ExplainRequest": "questions.requests.causes",
    "ModelsRequest": "questions.requests.models",
    "OneStepRequest": "questions.requests.one_step",
    "RecordingRequest": "identification.results",
    "Request": "compare.sides",
    "Side": "compare.sides",
    "VersionsRequest": "questions.requests.versions",
}
_HOMES = {**_QUESTIONS, **_REQUESTS}


class _Laboratory(ModuleType):
    """The package, in which the name of a question is its function, and not a room.

    Python puts each subpackage into its package by its name when it is first imported, so that
    `lab.compare` would be the folder compare/. Rooms are found by `import`, as ever.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _QUESTIONS and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value


def __dir__() -> list[str]:
    return sorted(_HOMES)


sys.modules[__name__].__class__ = _Laboratory
