"""What a model looks like, as triangles in the frames of its bodies.

Whoever draws (a viewer, a page, a picture) puts each part where its body is, with `xpos` and
`xquat` of any backend: ids of bodies are the same on all.
"""

from __future__ import annotations

from .shapes import Drawing, Part, Surface, drawing_of, lathe

__all__ = ["Drawing", "Part", "Surface", "drawing_of", "lathe"]
