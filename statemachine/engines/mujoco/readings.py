"""What two releases of MuJoCo read otherwise in one file."""

from __future__ import annotations

from ...backends.unshared import unshared_elements
from ...interface import Model
from ...release_names import is_release


def read_otherwise(left: Model, right: Model) -> list[str]:
    """Return a sentence for each element that only one of two compiled models has.

    Args:
        left: A Model of a file, on a release of MuJoCo or on the one that is installed.
        right: A Model of the same file on another one; nothing is said of two files.
    """
    if left.path != right.path or left.compiled is None or right.compiled is None:
        return []
    if not (is_release(left.backend) or is_release(right.backend)):
        return []
    elements = unshared_elements(
        left.compiled,
        right.compiled,
        f"MuJoCo {left.engine_version}",
        f"MuJoCo {right.engine_version}",
    )
    return [str(element) for element in elements]
