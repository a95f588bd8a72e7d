"""What any backend must do to be called one: the contract as checks.

    from statemachine import backends, conformance

    backends.register("mine", "my_package.backend:load")
    for outcome in conformance.run("mine"):
        print(outcome)

Each check is a function of a `Lab`, raises AssertionError where the contract is
broken, and is named after what it checks. They hold a backend against closed forms and
an independent witness, never against another backend.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from ..backends import backend_engine
from ..errors import MissingEngineError, UnsupportedError
from . import derived, inputs, options, physics, states
from ._lab import Lab

Check = Callable[[Lab], None]

CHECKS: dict[str, Check] = {
    name.removeprefix("check_"): function
    for part in (inputs, derived, states, physics, options)
    for name, function in vars(part).items()
    if name.startswith("check_")
}


@dataclass(frozen=True)
class Outcome:
    """How one check ended; `detail` says why it failed or was skipped."""

    check: str
    result: Literal["passed", "failed", "skipped"]
    detail: str = ""


def run(backend: str) -> list[Outcome]:
    """Run all checks on a backend.

    Args:
        backend: A name that `load` takes; see `backends.register`.
    """
    backend_engine(backend)  # a name that is not known is one error, not one a check
    outcomes = []
    with Lab(backend) as lab:
        for name, check in CHECKS.items():
            try:
                check(lab)
            except MissingEngineError as error:
                outcomes.append(Outcome(name, "skipped", str(error)))
            except UnsupportedError as error:
                outcomes.append(
                    Outcome(name, "skipped" if _declared(lab, error) else "failed", str(error))
                )
            except Exception as error:  # whatever a backend raises is its failure
                outcomes.append(Outcome(name, "failed", f"{type(error).__name__}: {error}"))
            else:
                outcomes.append(Outcome(name, "passed"))
            lab.close()
    return outcomes


def _declared(lab: Lab, error: UnsupportedError) -> bool:
    """Tell whether the capability record says that this cannot be done."""
    try:
        return lab.lacks(error.feature)
    except Exception:  # no Model, no record
        return False


__all__ = ["CHECKS", "Lab", "Outcome", "run"]
