"""Write so101.urdf from so101.xml.

    python models/so101/make_urdf.py

Run it after a change to the arm; a test does, and compares.
"""

from __future__ import annotations

import sys
from pathlib import Path

import statemachine as sm
from statemachine.backends.bullet import urdf as bullet_urdf

HERE = Path(__file__).resolve().parent


def main(target: Path = HERE / "so101.urdf") -> None:
    """Write the file."""
    raw = sm.load("so101").raw
    (root,) = bullet_urdf.roots(raw)
    text = bullet_urdf.write(raw, root, bullet_urdf.Dialect(folder=HERE))
    beside = target.with_suffix(".new")
    beside.write_text(text)
    beside.replace(target)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "so101.urdf")
