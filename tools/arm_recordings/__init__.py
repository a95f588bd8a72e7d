"""Synthetic recordings of an arm in the layout of LeRobot: `python -m tools.arm_recordings -h`."""
