"""Make synthetic recordings of the arm so101, as data sets of LeRobot.

python -m tools.arm_recordings --all DIR        the thirty, a folder each
python -m tools.arm_recordings --shipped        the one that comes with the package, anew
python -m tools.arm_recordings DIR --servos soft --motion chirps --seed 3
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from .arm_truth import Fault
from .plans import SHIPPED, SHIPPED_FOLDER, thirty
from .recordings import Plan, make, write, write_list


def main() -> None:
    """Make what the command line asks for, and print what each recording is."""
    options = _parser().parse_args()
    if options.all is not None:
        for plan in thirty():
            _make(plan, options.all / plan.name)
        write_list(thirty(), options.all)
    elif options.shipped:
        _make(SHIPPED, SHIPPED_FOLDER)
    elif options.folder is not None:
        _make(_plan(options), options.folder)
    else:
        raise SystemExit("name a folder, or give --all DIR or --shipped")


def _make(plan: Plan, folder: Path) -> None:
    recording = make(plan)
    write(recording, folder)
    delay, payload = recording.truth.delay, recording.truth.payload
    print(
        f"{folder}: {plan.episodes} episodes of {plan.seconds:g} s, {plan.servos} servos, "
        f"{plan.motion}, in {plan.unit}, on {plan.backend}, seed {plan.seed}; delay "
        f"{1000 * delay:.0f} ms, payload {1000 * payload:.0f} g; {plan.fault}"
    )


def _plan(options: argparse.Namespace) -> Plan:
    zero = ()
    if options.zero is not None:
        zero = ((options.zero[0], math.radians(float(options.zero[1]))),)
    play = tuple((joint, math.radians(float(width))) for joint, width in options.play)
    tilt = (math.radians(options.tilt[0]), math.radians(options.tilt[1]))
    fault = Fault(zero, options.reversed, options.gripper_scale, play, tilt)
    return Plan(
        name=options.folder.name,
        servos=options.servos,
        motion=options.motion,
        seed=options.seed,
        unit=options.unit,
        fault=fault,
        backend=options.backend,
        episodes=options.episodes,
        seconds=options.seconds,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tools.arm_recordings",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", nargs="?", type=Path, help="where one recording is written")
    parser.add_argument("--all", type=Path, metavar="DIR", help="write the thirty in there")
    parser.add_argument("--shipped", action="store_true", help="make the package's own anew")
    parser.add_argument("--servos", choices=["soft", "stiff"], default="soft")
    parser.add_argument("--motion", choices=["chirps", "hand"], default="chirps")
    parser.add_argument("--unit", choices=["degrees", "-100 to 100"], default="degrees")
    parser.add_argument("--backend", choices=["mujoco", "pybullet"], default="mujoco")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--episodes", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of an episode")
    parser.add_argument("--zero", nargs=2, metavar=("JOINT", "DEGREES"), help="a zero that is off")
    parser.add_argument("--reversed", default="", metavar="JOINT", help="a sign that is reversed")
    parser.add_argument("--gripper-scale", type=float, default=1.0)
    parser.add_argument(
        "--play",
        nargs=2,
        metavar=("JOINT", "DEGREES"),
        action="append",
        default=[],
        help="between a joint and its encoder; may be given several times",
    )
    parser.add_argument(
        "--tilt",
        nargs=2,
        type=float,
        metavar=("X", "Y"),
        default=(0.0, 0.0),
        help="of the base, about its axes x and y [degrees]",
    )
    return parser


if __name__ == "__main__":
    main()
