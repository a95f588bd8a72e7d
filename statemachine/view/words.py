"""What stands beside the picture: rows of a name and a value, free of how they are shown."""

from __future__ import annotations

from ..measures.text import millimetres, position, short_time
from .frames import Snapshot
from .live import Tempo


def rows(frame: Snapshot, pace: Tempo, tip: str) -> list[tuple[str, str]]:
    """The readout of one moment.

    Args:
        frame: The moment.
        pace: How fast it goes.
        tip: Name of the site that stands for the fingertip, or "".
    """
    tips, joint = (None, None) if frame.gap is None else (frame.gap.tip, frame.gap.joint)
    far = "" if joint is None else position(joint.size or 0.0, joint.unit == "m", 3)
    found = [
        ("time", short_time(frame.time)),
        ("steps", f"{frame.steps:,}"),
        ("pace", _pace(frame, pace)),
        ("tip", tip),
        *(
            (f"on {pose.name}", "  ".join(f"{1000 * value:.1f}" for value in pose.tip) + " mm")
            for pose in frame.poses
            if pose.tip is not None
        ),
        ("tips apart", "" if tips is None else millimetres(tips, 3)),
        ("joints apart", "" if joint is None else f"{far}, {joint.where}"),
    ]
    return [(name, text) for name, text in found if text]


def _pace(frame: Snapshot, pace: Tempo) -> str:
    if not frame.running:
        return "paused"
    if pace.reached is None:
        return "…"
    text = f"{pace.reached:.2f} × real time"
    if pace.late:
        text += f"; {pace.asked:g} × is more than this machine gives"
    return text


def warning(frame: Snapshot, note: str) -> str:
    """What is wrong, or ""."""
    if frame.trouble:
        return f"{frame.trouble}. Reset to go on."
    return note
