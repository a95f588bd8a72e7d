"""What makes MotrixSim differ from a closed form, cause by cause, each in a sentence or two.

Each was tried on the engine: `tests/test_validate_motrix.py` does it again.
"""

from __future__ import annotations

QUATERNION = (
    "A step of length h turns a body at the speed w by 2 atan(w h / 2) and not by w h: it adds "
    "half of w h to the quaternion, and makes that of length one."
)
INSTABILITY = (
    "A turn about the middle axis is unstable, which magnifies rounding: MuJoCo is as far off "
    "where its state is rounded to single precision at each step."
)
DRY_FRICTION = (
    "The damping of dry friction is divided by the first impedance of solimpfriction; MuJoCo "
    "divides it by the second. Where both are alike, the engines creep alike."
)
INVERSE_INERTIA = (
    "How soft a constraint is follows from the exact inverse inertia that it acts on, and in "
    "MuJoCo from an estimate: with its flag diagexact MuJoCo is softer, too."
)
IMPLICIT_SERVO = (
    "The weld is softer, the shorter the timestep: it acts on the inertia of the carriage plus h "
    "kv of the servo, whose damping is implicit."
)
HARD_FRICTION = (
    "Friction has no softness of its own: solref changes nothing, and what creeps is a thousandth"
    " of the timestep in a second."
)
DEPTH = (
    "The timestep makes most of it. What does not vanish is friction times the depth of the "
    "contact: friction is smaller while the contact sinks."
)
SQUARE = (
    "Friction is bounded along each of two axes for itself, so that it is 1.41 times as large "
    "along their diagonal. The cone of a file is ignored, and the engine has no round one."
)
IMPLICIT_DAMPING = (
    "The damping of a contact is computed from the speed at the end of the step; steps by that "
    "rule give the same numbers to single precision."
)
COLD_START = (
    "Our backend asks for the forces of a step whose solver starts from nothing. The engine's own"
    " net force on the box is right to 1.2e-5."
)
ROCKING = (
    "The boxes never rest: they rock at up to 0.1 rad/s, and the force flickers by 7 %; its mean "
    "over 100 steps is right to 0.4 %. With 1000 iterations and no tolerance they rock 4 to 40 "
    "times less; why they do at all is not known."
)
ORDER = (
    "Its solver takes contacts one after the other, and stops at a tolerance. With 1000 "
    "iterations and no tolerance the towers are 5e-6 m apart at 2 ms; what is left at 5 ms is not"
    " known."
)
CORNERS = (
    "The corners of a box are soft, and softer than MuJoCo's: a quarter of the time constant of "
    "solref makes the threshold 1 %."
)
