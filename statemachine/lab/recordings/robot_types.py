"""Which robot a data set is of, as its `robot_type` says.

The SO-100 and the SO-101 have the same joints, servos and calibration, and go by several names.
Other arms of LeRobot have joints of the same names, as the Koch has, but other lengths and zeros.
"""

from __future__ import annotations

import re

from ...errors import BadInputError
from ...interface import Model

_SO_ARM = re.compile(r"so[-_ ]?(arm)?[-_ ]?10[01]|so_follower")
# How the names of arms begin that LeRobot knows (`lerobot/robots/`), and of moss, which it knew.
_OTHER_ARMS = (
    "aloha",
    "bi_",
    "franka",
    "hope_jr",
    "koch",
    "lekiwi",
    "moss",
    "omx",
    "openarm",
    "panda",
    "piper",
    "reachy",
    "rebot",
    "stretch",
    "trossen",
    "unitree",
    "ur5",
    "viperx",
    "widowx",
    "xarm",
    "yam",
)


def is_so_arm(robot: str) -> bool:
    """Tell whether the type of a robot names one SO-100 or SO-101."""
    name = robot.lower()
    return bool(_SO_ARM.search(name)) and not name.startswith(_OTHER_ARMS)


def check_robot(robot: str, model: Model) -> None:
    """Refuse a data set of another arm than that of the model, where both are known.

    Args:
        robot: As the data set has it; "" where it does not say.
        model: Of the arm.

    Raises:
        BadInputError: The data set is of a known arm, and the model's file is that of an SO-100 or
            SO-101.
    """
    path = model.path
    file, folder = path.stem.lower(), path.parent.name.lower()
    is_other = robot.lower().startswith(_OTHER_ARMS) and not file.startswith(_OTHER_ARMS)
    if is_other and (_SO_ARM.search(file) or _SO_ARM.search(folder)):
        raise BadInputError(
            f"the data set is of a {robot} (robot_type in meta/info.json), and {path.name} is "
            "another arm: name a model of that robot"
        )
