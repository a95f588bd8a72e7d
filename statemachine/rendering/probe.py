"""What can draw without a screen here: the first engine whose room draws, and can."""

from __future__ import annotations

from dataclasses import dataclass

from ..engines import room, rooms_with
from ..errors import MissingEngineError, unknown_name
from ..installed import DEFAULT, require


@dataclass(frozen=True)
class Renderer:
    """Something that draws here.

    Attributes:
        name: The engine that draws.
        opengl: The OpenGL that works, as it is told to that engine; "" for its own choice, or
            where none is needed.
    """

    name: str
    opengl: str = ""

    def __str__(self) -> str:
        return room(self.name).drawn_by(self.opengl)


def renderers() -> list[str]:
    """Names of the engines that draw, whether or not they can here; the best first."""
    return rooms_with("drawer")


def renderer_here(name: str | None = None) -> Renderer:
    """What draws here: the first of `renderers` that can.

    Args:
        name: One of `renderers`, to have that one and no other.

    Raises:
        UnknownNameError: There is no such renderer.
        MissingEngineError: It, or every one, does not work here.
    """
    known = renderers()
    if name is not None and name not in known:
        raise unknown_name("renderer", name, known)
    require(DEFAULT)  # it reads the models, whoever draws them
    reasons: list[MissingEngineError] = []
    for engine in known if name is None else (name,):
        try:
            return Renderer(engine, room(engine).opengl())
        except MissingEngineError as error:
            reasons.append(error)
    if name is not None:
        raise reasons[0]
    because = "; ".join(map(str, reasons))
    raise MissingEngineError(
        f"nothing here can draw a film: {because}", engine=reasons[0].engine
    ) from reasons[0]
