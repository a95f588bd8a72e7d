"""The form in which the file of a compiled model can be written: that of an MJCF, or of a URDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...backends.compiled.model import read_spec
from ..description.file_form import FileForm
from ..description.xml_source import XmlSource
from ._mjcf_weights import MjcfWeights
from ._orientation import CompilerSettings
from .mjcf_form import MjcfForm
from .urdf_form import UrdfForm


def file_form(
    source: XmlSource, raw: Any, other_path: Path, other: Any, geoms: Mapping[int, int]
) -> FileForm:
    """Return what writes differences as attributes of a file.

    Args:
        source: The file.
        raw: Its mjModel.
        other_path: The file of the other side.
        other: Its mjModel.
        geoms: For each geom of the file its counterpart on the other side.

    Raises:
        ModelError: The file of the other side is no XML.
    """
    is_urdf = _is_urdf(source)
    if is_urdf:
        there = XmlSource(other_path)
        return UrdfForm(source, raw, there if _is_urdf(there) else None)
    spec = read_spec(source.path)
    settings = CompilerSettings.of(spec)
    weights = MjcfWeights((other_path, source.path), (other, raw), geoms)
    return MjcfForm(source, raw, settings, weights)


def _is_urdf(source: XmlSource) -> bool:
    return source.root.tag == "robot"
