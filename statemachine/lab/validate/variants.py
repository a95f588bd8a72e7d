"""The ways in which an engine can step: with each of them the battery is run."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from ...backends import BackendChoice, load
from ...errors import EngineWarning, MissingEngineError, ModelError, UnsupportedError
from ...interface import Model
from .case import GRAVITY, Integrator

OWN: Integrator = "own"  # of an engine that reads none from a file
_PROBE = (
    '<mujoco><option timestep="0.005" integrator="{integrator}"/><worldbody><body>'
    '<joint name="joint" type="slide"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    "</body></worldbody></mujoco>"
)


@dataclass(frozen=True)
class Variant:
    """An engine, and how it steps.

    Attributes:
        backend: The backend, and whose defaults it has.
        integrator: The one that the file names, or "own".
    """

    backend: BackendChoice
    integrator: Integrator

    def __str__(self) -> str:
        if self.integrator == OWN:
            return str(self.backend)
        return f"{self.backend} {self.integrator}"

    @contextmanager
    def loaded(
        self,
        text: str,
        timestep: float,
        gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY),
    ) -> Iterator[Model]:
        """Yield a Model of an MJCF text, which names the timestep, gravity and integrator.

        An engine as it comes reads neither of them: its users set the timestep and the gravity.

        Args:
            text: The MJCF.
            timestep: Length of a step [s].
            gravity: (3,) [m/s²].

        Raises:
            StateMachineError: As `load` raises it.
        """
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "case.xml"
            path.write_text(text, encoding="utf-8")
            name, defaults = self.backend.name, self.backend.defaults
            if defaults == "engine":
                yield load(path, name, defaults=defaults, timestep=timestep, gravity=gravity)
            else:
                yield load(path, name, defaults=defaults)


def variants_of(backend: BackendChoice) -> list[Variant]:
    """Return the ways in which a backend steps: an integrator that it lacks is left out.

    Raises:
        MissingEngineError: The engine is not installed here.
    """
    if backend.defaults == "engine":
        return [Variant(backend, OWN)]
    candidates = [Variant(backend, name) for name in get_args(Integrator) if name != OWN]
    variants = [variant for variant in candidates if _steps_so(variant)]
    return variants if variants else [Variant(backend, OWN)]  # of an engine that ignores them all


def _steps_so(variant: Variant) -> bool:
    """Tell whether a backend has an integrator: it reads it, and does not warn of it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        text = _PROBE.format(integrator=variant.integrator)
        try:
            with variant.loaded(text, 0.005):
                pass
        except (ModelError, UnsupportedError):
            return False
        except MissingEngineError:
            raise
        except Exception:  # of another package, which may raise anything: each case tells of it
            return True
    return not any(issubclass(warning.category, EngineWarning) for warning in caught)
