"""A policy's network, from an ONNX file, run by onnxruntime on the processor."""

from __future__ import annotations

import copy
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...errors import BadInputError, one_line
from ...git_lfs import check_is_no_pointer
from ...installed import require_extra
from ...interface import Array
from ...models import AnyPath, check_is_file
from .contract_file import EXTRA

SUFFIX: Final = ".onnx"
_FATAL_ONLY = 4  # of onnxruntime's levels of severity: its errors are exceptions, too
_ACTIONS = ("tensor(float)", "tensor(double)", "tensor(float16)")
# What onnxruntime says before the reason: its code, the file again, a line of its own source.
_BEFORE_REASON = re.compile(
    r"^\[ONNXRuntimeError\] : \d+ : \w+ : |Load model from .*? failed:\s*"
    r"|/\S+\.(?:cc|h):\d+ .*?\)(?: const)? (?=[A-Z\"'])"
)


@dataclass(frozen=True)
class NetworkFacts:
    """What the file of a network says.

    Attributes:
        file: Its name.
        digest: First 16 digits of its SHA-256.
        inputs: Size of the observation; None where the file leaves it open.
        outputs: Size of the action; None where the file leaves it open.
        memory: Names of the inputs that take what an output gave at the call before.
        size: Of the file [bytes].
        version: Of onnxruntime.
    """

    file: str
    digest: str
    inputs: int | None
    outputs: int | None
    memory: tuple[str, ...]
    size: int
    version: str


class Network:
    """A function from an observation to an action, which may have a memory.

    Attributes:
        facts: What its file says.
    """

    def __init__(self, file: AnyPath) -> None:
        """Open a file.

        Raises:
            BadInputError: There is no such file, or it is no network from one observation to one
                action.
            MissingEngineError: onnxruntime is not installed.
        """
        runtime = require_extra("onnxruntime", "a policy", "onnxruntime", EXTRA)
        path = Path(file)
        check_is_file(path)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            raise BadInputError(f"there is no policy {path}") from None
        except OSError as error:
            raise BadInputError(f"{path} cannot be read: {one_line(error)}") from error
        check_is_no_pointer(path, content)
        self._session = _session_of(path, runtime)
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        _check(path, inputs, outputs)
        self._input = inputs[0].name
        self._memory_inputs = inputs[1:]
        self._memory: dict[str, np.ndarray] = {}
        self.facts = NetworkFacts(
            file=path.name,
            digest=hashlib.sha256(content).hexdigest()[:16],
            inputs=_size(inputs[0]),
            outputs=_size(outputs[0]),
            memory=tuple(entry.name for entry in self._memory_inputs),
            size=len(content),
            version=runtime.__version__,
        )
        self.reset()

    def with_own_memory(self) -> Network:
        """Return the same network, which remembers what this one does not: for another run."""
        network = copy.copy(self)
        network._memory = {}
        network.reset()
        return network

    def reset(self) -> None:
        """Set the memory to zeros."""
        for entry in self._memory_inputs:
            # A length that the file leaves open is that of a batch, of one robot.
            shape = [size if isinstance(size, int) else 1 for size in entry.shape]
            self._memory[entry.name] = np.zeros(shape, dtype=np.float32)

    def __call__(self, observation: Array) -> Array:
        """Return the action (n,) for an observation (size,).

        Raises:
            BadInputError: The network does not take it, or gives what is no action.
        """
        with np.errstate(over="ignore"):  # what comes of it is looked at by whoever calls
            single = observation[None].astype(np.float32)
        given = {self._input: single, **self._memory}
        try:
            action, *memory = self._session.run(None, given)
        except Exception as error:  # onnxruntime has an exception for each of its codes
            raise BadInputError(f"{self.facts.file}: {_reason_of(error)}") from error
        for entry, value in zip(self._memory_inputs, memory, strict=False):
            self._memory[entry.name] = value
        return np.asarray(action, dtype=np.float64).reshape(-1)


def _session_of(path: Path, runtime: Any) -> Any:
    """Return what runs a network, with the same bits for the same observation.

    Args:
        path: Of its file.
        runtime: The module onnxruntime.

    Raises:
        BadInputError: It is no network.
    """
    options = runtime.SessionOptions()
    options.log_severity_level = _FATAL_ONLY
    # One thread, and in order: sums of several have other last bits from run to run.
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    try:
        # By its path, for its weights may stand in a file beside it.
        return runtime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime has an exception for each of its codes
        raise BadInputError(f"{path} is no ONNX network: {_reason_of(error)}") from error


def _check(path: Path, inputs: list[Any], outputs: list[Any]) -> None:
    """Check that a network has an observation and an action, and an output for each memory."""
    if not inputs or not outputs or len(outputs) < len(inputs):
        raise BadInputError(
            f"{path.name} has {len(inputs)} inputs and {len(outputs)} outputs: a policy has an "
            "observation and an action, then as many outputs as inputs that remember"
        )
    for entry in inputs:
        if entry.type != "tensor(float)":
            raise BadInputError(
                f"{path.name}: the input {entry.name!r} is {entry.type}, and a policy takes "
                "tensor(float)"
            )
    if outputs[0].type not in _ACTIONS:
        raise BadInputError(
            f"{path.name}: the output {outputs[0].name!r} is {outputs[0].type}, and an action is "
            f"{_ACTIONS[0]}"
        )


def _reason_of(error: Exception) -> str:
    """Return what onnxruntime says of an error, without the places in its source."""
    return _BEFORE_REASON.sub("", one_line(error))


def _size(entry: Any) -> int | None:
    """Return the last length of an input or output; None where the file leaves it open."""
    shape = entry.shape
    return shape[-1] if shape and isinstance(shape[-1], int) else None
