"""One model, examined: what it does on each engine that is here.

It runs in a process of its own: `python -m statemachine.lab.robots.examine`. What is known
is told before each part, so that a part that crashes leaves what was found before it.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from ...atomic_files import replace_bytes
from ...backends import backend_names, load_to_run
from ...backends.starts import overlaps_in
from ...engines import raw_engine_of
from ...errors import (
    BadInputError,
    DivergedError,
    EngineWarning,
    MissingEngineError,
    ModelError,
    StateMachineError,
    UnsupportedError,
    one_line,
)
from ...installed import DEFAULT, WITNESS, require
from ...interface import Data, Model, get_state, make_data, reset, set_state, step
from ..probes.state_audit import future
from ..recordings import record_scenario
from ..runs.interleaved_timing import Ratio, time_interleaved
from ..runs.scenarios import scenario
from ..validate.fingertip import certify
from . import gaps
from .records import NOT_READ, RUNS, BackendRow, ExaminedModel, WitnessRow, is_as_it_comes

TRIED = ("hold", "gravity", "droop", "waves")
_SHORT = 40  # steps of a scenario
_SAME = 200  # steps of the run that is compared with the engine without us
_FUTURE = 60  # steps of each future of a State
_POSES = 20  # of the witness
_ROUNDS, _TURN = 15, 0.005  # of the costs; a turn takes about so long [s]

Tell = Callable[[ExaminedModel, str], object]  # what is known, and which part begins


def examine(path: Path, row: ExaminedModel, quick: bool, seed: int, tell: Tell) -> ExaminedModel:
    """Examine a model.

    Args:
        path: The file.
        row: Its row with nothing in it yet.
        quick: Whether to leave out scenarios and costs.
        seed: Of all that is drawn.
        tell: Told what is known so far, and what comes next.
    """
    return _Examination(path, row, seed, tell).all(quick)


@dataclass(frozen=True)
class _Attempt:
    """An attempt to load a model on a backend.

    Attributes:
        refusal: Why it does not load; "" if it does.
        features: What of the model is refused; empty where it loads, and where that is not known.
        warnings: What the backend told, and the default one did not tell.
    """

    refusal: str
    features: tuple[str, ...]
    warnings: tuple[str, ...]


class _Examination:
    def __init__(self, path: Path, row: ExaminedModel, seed: int, tell: Tell) -> None:
        self.path, self.row, self.seed, self.tell = path, row, seed, tell
        self.models: dict[str, Model] = {}  # by backend, with contacts
        self.without: dict[str, Model] = {}  # without

    def all(self, quick: bool) -> ExaminedModel:
        for backend in backend_names():
            with suppress(MissingEngineError):
                self._load(backend)
        if DEFAULT in self.models:
            self._sizes(self.models[DEFAULT])
        for backend, model in self._any().items():
            with self._part(f"the engine alone, {backend}"):
                is_equal = self._equals_engine(model)
                self._put(backend, replace(self._known(backend), equals_engine=is_equal))
            # What diverges has no future; an engine that computes all itself may.
            expected = (DivergedError,) if is_as_it_comes(backend) else ()
            with self._part(f"restore, {backend}"), suppress(*expected):
                is_restored = self._restores(model)
                self._put(backend, replace(self._known(backend), restores=is_restored))
        with self._part("witness"), suppress(MissingEngineError):
            require(WITNESS)
            model = self._any().get(DEFAULT)
            if model is not None and model.nv:
                self.row = replace(self.row, witness=_witness_row(model, self.seed))
        self._gaps()
        if not quick:
            self._experiments()
        return self.row

    def _experiments(self) -> None:
        """Run every experiment on each backend, and measure what a step costs."""
        for backend, model in self._any().items():
            for name in TRIED:
                with self._part(f"scenario {name}, {backend}"):
                    scenarios = {
                        **self._known(backend).scenarios,
                        name: self._scenario(name, model),
                    }
                    self._put(backend, replace(self._known(backend), scenarios=scenarios))
            # The engine's own motors may throw it.
            with self._part(f"cost, {backend}"), suppress(DivergedError):
                self._put(backend, replace(self._known(backend), cost=self._cost(model)))

    @contextmanager
    def _part(self, name: str) -> Iterator[None]:
        """Run a part of the examination: an error in it costs this part alone."""
        self.tell(self.row, name)
        try:
            yield
        except Exception as error:  # what nobody meant to raise is what is looked for
            self._fault(f"{name}: {type(error).__name__}: {error}")

    def _fault(self, words: str) -> None:
        self.row = replace(self.row, faults=(*self.row.faults, one_line(words)[:300]))

    def _known(self, backend: str) -> BackendRow:
        """Return what is known of the model on a backend."""
        return self.row.backends.get(backend, BackendRow())

    def _put(self, backend: str, row: BackendRow) -> None:
        """Keep what is known now of the model on a backend."""
        self.row = replace(self.row, backends={**self.row.backends, backend: row})

    def _any(self) -> dict[str, Model]:
        """Return for each backend the Model with contacts, else the one without."""
        return {**self.without, **self.models}

    def _load(self, backend: str) -> None:
        """Load the model on a backend, with contacts and without."""
        self.tell(self.row, f"loading, {backend}")
        with_contacts = self._attempt(backend, contacts=True)
        without = self._attempt(backend, contacts=False)
        features = with_contacts.features
        if not features:
            features = without.features
        row = replace(
            self._known(backend),
            refusal=with_contacts.refusal,
            refusal_without=without.refusal,
            features=features,
            warnings=with_contacts.warnings,
            warnings_without=without.warnings,
        )
        self._put(backend, row)

    def _attempt(self, backend: str, *, contacts: bool) -> _Attempt:
        """Load the model on a backend, and keep it if it loads."""
        models = self.models if contacts else self.without
        refusal = ""
        features: tuple[str, ...] = ()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                if contacts:
                    models[backend] = load_to_run(self.path, backend)
                else:
                    models[backend] = load_to_run(self.path, backend, contacts=False)
            except MissingEngineError:
                raise
            except StateMachineError as error:
                refusal, features = one_line(error), _features(error)
            except Exception as error:
                refusal = one_line(f"{type(error).__name__}: {error}")
                self._fault(f"loading, {backend}: {refusal}")
        return _Attempt(refusal, features, self._of_its_own(backend, caught))

    def _of_its_own(
        self, backend: str, caught: Sequence[warnings.WarningMessage]
    ) -> tuple[str, ...]:
        """Return the warnings of a backend that the default one did not give, too, each once."""
        texts = [
            one_line(warning.message)
            for warning in caught
            if issubclass(warning.category, EngineWarning)
        ]
        first = self.row.backends.get(DEFAULT)
        if first is not None and backend != DEFAULT:
            known = [text.partition(": ")[2] for text in first.warnings]
            texts = [text for text in texts if not text.endswith(tuple(known))]
        return tuple(dict.fromkeys(texts))

    def _sizes(self, model: Model) -> None:
        overlaps = overlaps_in(model, gaps.keyframe_of(model))
        self.row = replace(
            self.row,
            nq=model.nq,
            nv=model.nv,
            nu=model.nu,
            nbody=model.nbody,
            ngeom=model.ngeom,
            inside=tuple(overlaps),
        )

    def _equals_engine(self, model: Model) -> bool | None:
        own = raw_engine_of(model.backend)
        if not own.can("plain_run"):
            return None
        orders = gaps.commands(model, _SAME, self.seed)
        rows, _ = gaps.run(model, orders)
        theirs = own.plain_run(self.path, orders[: len(rows) - 1], gaps.keyframe_of(model))
        if theirs is None:
            return None
        # The first row is the start, which was written: an engine in single precision rounds it.
        return rows[1:].tobytes() == theirs[1 : len(rows)].tobytes()

    def _restores(self, model: Model) -> bool | None:
        """Return whether two futures of a State are one, and that of the run itself if promised."""
        with self._started(model) as data:
            step(model, data, _FUTURE)
            state = get_state(model, data)
            going_on = future(model, data, _FUTURE)
            set_state(model, data, state)
            once = future(model, data, _FUTURE)
            set_state(model, data, state)
            twice = future(model, data, _FUTURE)
        if once.tobytes() != twice.tobytes():
            return False
        return once.tobytes() == going_on.tobytes() or not model.capabilities.exact_restore

    @contextmanager
    def _started(self, model: Model) -> Iterator[Data]:
        """Yield a Data at the start of a run, under the first command."""
        with make_data(model) as data:
            reset(model, data, gaps.keyframe_of(model))
            data.ctrl[:] = gaps.commands(model, 1, self.seed)[0]
            yield data

    def _gaps(self) -> None:
        """Compare each other backend with the default one, without contacts and with them."""
        for backend, first, model in self._pairs(self.without):
            with self._part(f"gap without contacts, {backend}"):
                gap = gaps.run_gap(first, model, self.seed, halve=True)
                self._put(backend, replace(self._known(backend), without_contacts=gap))
        for backend, first, model in self._pairs(self.models):
            with self._part(f"gap with contacts, {backend}"):
                gap = gaps.run_gap(first, model, self.seed)
                self._put(backend, replace(self._known(backend), with_contacts=gap))

    def _pairs(self, models: Mapping[str, Model]) -> Iterator[tuple[str, Model, Model]]:
        """Yield each other backend, the Model on the default one, and that on the other."""
        first = models.get(DEFAULT)
        for backend, model in models.items():
            if first is not None and backend != DEFAULT:
                yield backend, first, model

    def _scenario(self, name: str, model: Model) -> str:
        try:
            record_scenario(scenario(name), model, seconds=_SHORT * model.timestep, seed=self.seed)
        except (BadInputError, UnsupportedError) as error:  # it says that it makes no sense here
            return one_line(error)
        return RUNS

    def _cost(self, model: Model) -> float | None:
        """Return the time of a step over that of the engine by its own functions, in turns."""
        engine = raw_engine_of(model.backend)
        if not model.nv or not engine.can("stepper"):
            return None
        with (
            self._started(model) as data,
            engine.stepper(model, data.qpos, data.qvel, data.ctrl) as alone,
        ):

            def ours(steps: int) -> None:
                for _ in range(steps):
                    step(model, data)

            first = time_interleaved({"": lambda: ours(3)}, 2)[""][-1] / 3
            steps = max(1, min(500, round(_TURN / max(first, 1e-7))))
            ways = {"ours": lambda: ours(steps), "alone": lambda: alone(steps)}
            times = time_interleaved(ways, _ROUNDS, seed=self.seed)
        return round(Ratio.of("", times["ours"], times["alone"]).median, 3)


def _witness_row(model: Model, seed: int) -> WitnessRow:
    """Compare every end of the robot at random poses."""
    try:
        certificate = certify(model, poses=_POSES, seed=seed)
    except StateMachineError as error:
        return WitnessRow(refusal=one_line(error))
    gap = certificate.position_worst
    if gap is None:  # its frame is another one than the engine's
        gap = float("inf") if certificate.frames is None else certificate.frames.distance
    return WitnessRow(certificate.grade, certificate.reason, len(certificate.tips), gap)


def _features(error: StateMachineError) -> tuple[str, ...]:
    """Return what of a model is refused, in a few words each."""
    if isinstance(error, UnsupportedError):
        return error.features or (error.feature,)
    return (NOT_READ,) if isinstance(error, ModelError) else (type(error).__name__,)


def main(path: str, quick: str, seed: str, answer: str) -> None:
    """Examine, and store what is known in the file `answer`, whole at any moment."""

    def tell(row: ExaminedModel, part: str) -> None:
        replace_bytes(Path(answer), pickle.dumps((part, row)))

    tell(examine(Path(path), ExaminedModel("", "", ""), bool(quick), int(seed), tell), "")
