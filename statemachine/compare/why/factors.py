"""What two simulations of one experiment can differ by, and in which order it is tried."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Factor:
    """One thing that can be brought to the same on both sides, or be left out on both.

    Attributes:
        name: What it is called, here and in the results.
        title: In words.
        off: What "off on both" means, in words; "" where it cannot be off.
        facts: What a Model tells of it, by the names of its attributes.
        raw: Arrays of a compiled model that it lies in, where `model.raw` has them.
        options: What `Model.replace` is given to set it.
    """

    name: str
    title: str
    off: str
    facts: tuple[str, ...] = ()
    raw: tuple[str, ...] = ()
    options: tuple[str, ...] = ()


_ALL = (
    Factor("gravity", "gravity", "none", facts=("gravity",), options=("gravity",)),
    Factor(
        "timestep",
        "timestep",
        "4 times finer",
        facts=("timestep", "substeps"),
        options=("timestep", "substeps"),
    ),
    # Only of an engine that makes its own; masses of a file that differ are not in the table.
    Factor("inertia", "inertias", ""),
    Factor("damping", "damping", "none", facts=("dof_damping",), options=("damping",)),
    Factor(
        "servo",
        "servo law",
        "servos off",
        facts=("actuator_kp", "actuator_kv", "actuator_ctrlrange", "actuator_forcerange"),
        raw=(
            "actuator_gaintype",
            "actuator_gainprm",
            "actuator_biastype",
            "actuator_biasprm",
            "actuator_gear",
            "actuator_ctrllimited",
            "actuator_ctrlrange",
            "actuator_forcelimited",
            "actuator_forcerange",
        ),
        options=("actuation",),
    ),
    Factor("armature", "armature", "none", facts=("dof_armature",), options=("armature",)),
    Factor(
        "frictionloss",
        "dry friction",
        "none",
        facts=("dof_frictionloss",),
        raw=("dof_solref", "dof_solimp"),
        options=("frictionloss",),
    ),
    Factor(
        "limits",
        "joint limits",
        "none",
        facts=("jnt_limited", "jnt_range"),
        raw=("jnt_limited", "jnt_range", "jnt_solref", "jnt_solimp", "jnt_margin"),
        options=("limits",),
    ),
    Factor(
        "surfaces",
        "surfaces",
        "frictionless",
        raw=(
            "geom_friction",
            "geom_condim",
            "geom_priority",
            "geom_solref",
            "geom_solimp",
            "geom_solmix",
            "geom_margin",
            "geom_gap",
            "geom_contype",
            "geom_conaffinity",
            "opt.cone",
            "opt.impratio",
            "opt.noslip_iterations",
        ),
    ),
    Factor("integrator", "integrator", "", raw=("opt.integrator",), options=("integrator",)),
    Factor("contact", "contact", "nothing touches", options=("contacts",)),
)
FACTORS = {factor.name: factor for factor in _ALL}

# First what is set differently: two is brought to what one has, and one moves as before.
# The world comes before the robot. Damping comes before the servo law and armature after:
# an engine's explicit damping does not stand without its motors, and an engine without
# armature can be given it only with the law.
PARITY_ORDER = tuple(FACTORS)
# Then what is set alike, and is each engine's own doing: it can only be left out on both,
# which makes another motion. What acts now and then comes first. Gravity and the servos are
# not among them: they drive the motion, and with it goes whatever there is between two.
OFF_ORDER = ("contact", "limits", "frictionloss", "damping", "armature", "timestep")
