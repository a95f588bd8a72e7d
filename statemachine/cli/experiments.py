"""The experiments, for the help of commands that run one."""

# As `scenarios.SCENARIOS`, which needs NumPy; a test compares them.
EXPERIMENTS = {
    "hold": "the servos go to one pose and hold it",
    "gravity": "actuators off: what can move falls",
    "droop": "nobody writes ctrl: the servos keep their first targets",
    "fall": "actuators off, and nothing can touch",
    "box": "the SO-101 swings with a box in its jaws",
    "waves": "every actuator follows waves that a seed draws",
}


def experiments() -> str:
    """Return a line for each experiment."""
    return "\n".join(f"  {name:<9} {description}" for name, description in EXPERIMENTS.items())
