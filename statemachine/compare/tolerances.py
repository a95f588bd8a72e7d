"""How much two runs may differ before it matters, and why that much."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..interface import Array
from ..measures import Tolerance
from ..measures.text import milliseconds, rounded
from ..runs import Trace
from .series import Series

# A 12-bit encoder, as in the SO-101's servos (Feetech STS3215).
COUNT = 2 * np.pi / 4096
_COUNT_SAYS = "1/4096 turn, one count of a 12-bit encoder as in the SO-101's servos"
_ENERGY = 0.01  # of what the energy changes by in the run
_FORCE = 0.05  # of its mean while it acts
SLIDE, BODY, BODY_TURN = 1e-4, 1e-3, np.radians(1.0)


def tolerance_for(
    series: Series, one: Trace, two: Trace, given: Mapping[str, float] | None = None
) -> Tolerance:
    """The tolerance of a quantity.

    Args:
        series: What is compared.
        one: The traces that it is of; their reach, energy and timestep are its measure.
        two: See one.
        given: Values by kind that win over ours [SI].
    """
    kind = series.kind
    if given and kind in given:
        return Tolerance(given[kind], "as given")
    if kind in ("joint", "tip rotation"):
        return Tolerance(COUNT, _COUNT_SAYS)
    if kind == "slide":
        return Tolerance(SLIDE, "a tenth of a millimetre")
    if kind == "tip":
        reach = max(_reach(one, series), _reach(two, series))
        return Tolerance(
            COUNT * reach,
            f"what one count of a 12-bit encoder moves it, {reach:.2f} m from the arm's foot",
        )
    if kind == "body":
        return Tolerance(BODY, "a millimetre: what a grasp of a box of centimetres forgives")
    if kind == "body rotation":
        return Tolerance(BODY_TURN, "a degree, which moves the rim of a hand's breadth by 1 mm")
    if kind == "energy":
        range_ = max(_range(series.one), _range(series.two))
        return Tolerance(
            max(_ENERGY * range_, 1e-9),
            f"1 % of {rounded(range_, 'J')}, by which the energy changes in the run",
        )
    if kind == "force":
        # Not of its peak: that of an impact is its impulse over the timestep, whatever that is.
        acting = max(_mean_acting(values) for values in (series.one, series.two))
        return Tolerance(
            max(_FORCE * acting, 1e-6),
            f"5 % of {rounded(acting, 'N')}, the mean while they touch",
        )
    longest = max(one.header.timestep, two.header.timestep)
    return Tolerance(
        longest * (1 + 1e-9),
        f"one timestep, {milliseconds(longest, 3)}: an engine looks at contacts once in a step",
    )


def _mean_acting(force: Array) -> float:
    """Mean of a force over the moments at which it acts [N]; 0 if it never does."""
    acts = force[force > 0]
    return float(acts.mean()) if len(acts) else 0.0


def _reach(trace: Trace, series: Series) -> float:
    """How far a site gets from where the first jointed body has its origin [m]."""
    positions, _ = trace.site(series.name.partition(",")[0])
    if "xpos" in trace and len(trace.header.bodies) > 1:
        positions = positions - trace["xpos"][:, 1]
    lengths = np.linalg.norm(positions, axis=1)
    return float(lengths[np.isfinite(lengths)].max(initial=0.0))


def _range(values: Array) -> float:
    """From the smallest to the largest of those that are finite; 0 if none is."""
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0
