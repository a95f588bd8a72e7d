"""What is recorded, or played again, and the trace of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ...backends import BackendChoice
from ...backends.chosen import one_backend
from ...errors import check_name, printable
from ...installed import DEFAULT
from ...interface.records import READ_OPTIONS
from ...measures.text import command
from ...models import AnyPath
from ..policy.scenario import check_contract, options_of_policy, policy_scenario
from ..runs.controllers import (
    Function,
    file_and_name_of,
    function_file,
    function_scenario,
    is_controller,
    is_function,
    is_policy,
)
from ..runs.reporter import QUIET, Reporter
from ..runs.scenarios import SCENARIOS, Scenario, scenario
from . import Trace, model_file, play, read, record_scenario

_MODEL_OF_FUNCTION = "so101/scene"  # of a function, which names none


@dataclass(frozen=True)
class RecordRequest:
    """Run that is to be recorded.

    Attributes:
        what: Name of an experiment; "FILE.py:FUNCTION", or a function itself, which is called
            with (model, data) and returns ctrl (nu,), or None to leave it; or the ONNX file of a
            policy.
        model: A name or a file of a model; None for the experiment's own.
        backend: As `parse_backend` reads it.
        menagerie: A menagerie folder to look the model's name up in.
        keyframe: Name of the keyframe where it starts; None for the experiment's own, for a
            function's default state, and for "home" of a policy.
        seconds: Simulated time [s]; None for the experiment's own.
        timestep: Length of a step [s]; None for the model's own.
        seed: Of what an experiment draws.
        contract: What a policy expects of the simulator: a YAML file; None of anything else.
        command: Speeds that a policy is asked for, vx, vy [m/s], wz [rad/s]; None for straight on.
    """

    what: str | Function
    model: AnyPath | None = None
    backend: str = DEFAULT
    menagerie: AnyPath | None = None
    keyframe: str | None = None
    seconds: float | None = None
    timestep: float | None = None
    seed: int = 0
    contract: AnyPath | None = None
    command: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        check_contract([str(self.what)], self.contract, self.command)
        if not is_controller(self.what):
            check_name("experiment", self.what, SCENARIOS)
        self.chosen_backend()

    def scenario(self) -> Scenario:
        """Return what is done.

        Raises:
            UnknownNameError: There is no such experiment.
            BadInputError: There is no such function, or its file fails; or a policy does not fit
                its contract.
            MissingEngineError: The extra of policies is not installed.
        """
        if isinstance(self.what, str) and is_policy(self.what) and self.contract is not None:
            return policy_scenario(self.what, self.contract, self.command, self.keyframe)
        if not isinstance(self.what, str) or is_function(self.what):
            return function_scenario(self.what, keyframe=self.keyframe)
        known = scenario(self.what)
        return replace(known, keyframe=self.keyframe or known.keyframe)

    def chosen_backend(self) -> BackendChoice:
        """Return the backend, and whose defaults it has.

        Raises:
            UnknownNameError: There is no such backend.
            BadInputError: It stands for several.
        """
        return one_backend([self.backend], "trace record")

    @property
    def name(self) -> str:
        """Return its name, a word: the experiment, the stem of the file, or the function."""
        if isinstance(self.what, str):
            return function_file(self.what).stem
        return file_and_name_of(self.what)[1]

    @property
    def file_name(self) -> str:
        """Name that its trace has where no other is given."""
        return f"{self.name}.{_backend_for_file_name(self.chosen_backend())}.npz"

    @property
    def typed(self) -> str:
        """Command that records it, without paths of this machine; "" of a function itself."""
        if not isinstance(self.what, str):
            return ""
        words = ["statemachine", "trace", "record", Path(self.what).name]
        if self.model is not None:
            words.append(without_folders(self.model))
        of_policy = options_of_policy(self.contract, self.command)
        typed = command(
            words,
            ("--backend", str(self.chosen_backend()), DEFAULT),
            ("--keyframe", self.keyframe, None),
            ("--seconds", self.seconds, None),
            ("--timestep", self.timestep, None),
            ("--seed", self.seed, 0),
            *of_policy,
        )
        return printable(typed)


@dataclass(frozen=True)
class PlayRequest:
    """Trace whose ctrl is to be played again, from the state that it starts in.

    Attributes:
        file: Of the trace.
        model: A name or a file of a model; None for the trace's own.
        backend: As `parse_backend` reads it.
        menagerie: A menagerie folder to look the model up in.
    """

    file: AnyPath
    model: AnyPath | None = None
    backend: str = DEFAULT
    menagerie: AnyPath | None = None

    def __post_init__(self) -> None:
        self.chosen_backend()

    def chosen_backend(self) -> BackendChoice:
        """Return the backend, and whose defaults it has.

        Raises:
            UnknownNameError: There is no such backend.
            BadInputError: It stands for several.
        """
        return one_backend([self.backend], "trace play")

    @property
    def file_name(self) -> str:
        """Name that the new trace has where no other is given."""
        return f"{Path(self.file).stem}.{_backend_for_file_name(self.chosen_backend())}.npz"

    @property
    def typed(self) -> str:
        """Command that plays it, without paths of this machine."""
        words = ["statemachine", "trace", "play", Path(self.file).name]
        if self.model is not None:
            words.append(without_folders(self.model))
        return printable(command(words, ("--backend", str(self.chosen_backend()), None)))


def answer_record(request: RecordRequest, reporter: Reporter = QUIET) -> Trace:
    """Run an experiment or a function, and return the trace.

    Raises:
        StateMachineError: The model cannot be loaded, or the run makes no sense on it.
    """
    asked, backend = request.scenario(), request.chosen_backend()
    model = backend.load_to_run(
        request.model or asked.model or _MODEL_OF_FUNCTION, menagerie=request.menagerie
    )
    options = {}
    if request.timestep is not None:
        options["timestep"] = request.timestep
    with reporter.stage(f"record {request.name} on {backend}") as progress:
        return record_scenario(
            asked,
            model,
            seconds=request.seconds,
            seed=request.seed,
            command=request.typed,
            defaults=backend.defaults,
            options=options,
            progress=progress,
        )


def answer_play(request: PlayRequest, reporter: Reporter = QUIET) -> Trace:
    """Play the ctrl of a trace on a backend, and return the trace of that run.

    Raises:
        TraceError: The file is not a trace, or does not fit the model.
        StateMachineError: The model cannot be loaded.
    """
    trace, backend = read(request.file), request.chosen_backend()
    options = trace.header.options
    read_options = {name: options[name] for name in READ_OPTIONS if name in options}
    if request.model is None:
        file, is_same = model_file(trace.header, request.menagerie, request.file)
        model = backend.load_to_run(file, **read_options)
        if not is_same:
            reporter.note(
                f"{trace.header.provenance.model_file} as it is here is not the file that the "
                "trace was recorded with: its digest is another"
            )
    else:
        model = backend.load_to_run(request.model, menagerie=request.menagerie, **read_options)
    if options:
        model = model.replace(**options)
    with reporter.stage(f"play on {backend}") as progress:
        return play(
            trace,
            model,
            command=request.typed,
            defaults=backend.defaults,
            options=options,
            progress=progress,
        )


def without_folders(model: AnyPath) -> str:
    """Return a model as one types it, without folders."""
    return Path(model).name if Path(model).is_file() else str(model)


def _backend_for_file_name(backend: BackendChoice) -> str:
    """Return a backend as it stands in the name of a file, which has no colon on Windows."""
    return str(backend).replace(":", ".")
