"""Pictures from a process that draws: what comes out, who draws them, and an environment's."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import pictures
from statemachine.engines.pictures import LivePictures, Renderer, drawn, renderer_here
from statemachine.errors import ClosedDataError, EngineError, MissingEngineError
from statemachine.show.drawing import drawing_of
from statemachine.show.drawing.scene import Camera, Motion, compose, smaller

from .support.files import written
from .support.rendering import rendering_environment, seen_by
from .support.requirements import need_engine
from .support.shots import LEVEL, Scene, shots
from .support.small_models import mjcf

BALL = mjcf('<body pos="0 0 5"><freejoint/><geom size="0.1" rgba="1 0.5 0 1"/></body>')
CAMERA, SIZE = Camera((0, 0, 0), 2.0, 60.0, -10.0), (32, 24)
# Nearer than the solid ball, nearer by less than two pixels, and beside it.
SOLID = [(0.0, 0, 0), (0.1, 0, 0), (0.0, 0.2, 0)]
GHOST = [(-0.1, -0.17, 0), (0.075, -0.043, 0), (0.0, -0.2, 0.1)]


def _motion(file: Path, places: list[tuple[float, ...]]) -> Motion:
    xpos = np.zeros((len(places), 2, 3))
    xpos[:, 1] = places
    return Motion(drawing_of(sm.load(file)), xpos, np.tile(LEVEL, (len(places), 2, 1)))


def _expected(engine: str, by: int, folder: Path) -> list[np.ndarray]:
    """Return what the engine's shots give, one over the other, when they are made smaller."""
    size = (by * SIZE[0], by * SIZE[1])
    scenes = [
        Scene(BALL, CAMERA, [place], size=size, ghost=ghost)
        for ghost, places in ((False, SOLID), (True, GHOST))
        for place in places
    ]
    seen = shots(engine, scenes, folder)
    # Two pixels of the picture, where the target is.
    bias = 2 * (2 * CAMERA.distance * np.tan(np.radians(CAMERA.fovy / 2))) / SIZE[1]
    return [
        smaller(compose(solid, ghost, bias, by), by)
        for solid, ghost in zip(seen[:3], seen[3:], strict=True)
    ]


@pytest.mark.parametrize(("engine", "by"), [("pybullet", 1), ("mujoco", 2)])
def test_the_pictures_of_two_sides_are_those_of_both_one_over_the_other(
    engine: str, by: int, tmp_path: Path
) -> None:
    need_engine(engine)
    opengl = rendering_environment().get("MUJOCO_GL", "") if engine == "mujoco" else ""
    file = written(tmp_path / "ball.xml", BALL)
    sides = [_motion(file, SOLID), _motion(file, GHOST)]
    seen = list(drawn(sides, SIZE, CAMERA, Renderer(engine, opengl)))
    np.testing.assert_array_equal(seen, _expected(engine, by, tmp_path))


def test_pictures_of_one_side_come_in_the_order_in_which_they_are_asked_for(
    tmp_path: Path,
) -> None:
    need_engine("pybullet")
    file = written(tmp_path / "ball.xml", BALL)
    seen = list(drawn([_motion(file, SOLID)], SIZE, CAMERA, Renderer("pybullet")))
    alone = shots("pybullet", [Scene(BALL, CAMERA, [p], size=SIZE) for p in SOLID], tmp_path)
    np.testing.assert_array_equal(seen, [shot.rgb for shot in alone])


def test_a_process_that_cannot_draw_is_told_when_its_picture_is_taken(tmp_path: Path) -> None:
    need_engine("pybullet")
    missing = [tmp_path / "nothing.xml"]
    with closing(LivePictures(missing, SIZE, CAMERA, Renderer("pybullet"))) as live:
        live.ask([(np.zeros((2, 3)), np.zeros((2, 4)))])
        with pytest.raises(EngineError):
            live.take()


# Which of the engines draws.


def _engines(monkeypatch: pytest.MonkeyPatch, **opengl: str | MissingEngineError) -> None:
    def room(name: str) -> Any:
        def found() -> str:
            known = opengl[name]
            if isinstance(known, MissingEngineError):
                raise known
            return known

        return SimpleNamespace(opengl=found)

    monkeypatch.setattr(pictures, "raw_engine_of", room)
    monkeypatch.setattr(pictures, "renderers", lambda: list(opengl))


def test_the_first_that_can_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    _engines(monkeypatch, a=MissingEngineError("no", engine="a"), b="egl", c="osmesa")
    assert renderer_here() == Renderer("b", "egl")


def test_the_best_draws_where_it_can(monkeypatch: pytest.MonkeyPatch) -> None:
    _engines(monkeypatch, a="", b="egl")
    assert renderer_here() == Renderer("a", "")


def test_where_none_can_the_first_is_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    reasons = {name: MissingEngineError(f"no {name}", engine=name) for name in ("a", "b")}
    _engines(monkeypatch, **reasons)
    with pytest.raises(MissingEngineError) as told:
        renderer_here()
    assert told.value.engine == "a"
    assert told.value.__cause__ is reasons["a"]
    assert "no a; no b" in str(told.value)


# The pictures of an environment.


class Recorded:
    """A process of pictures that notes what it was told."""

    def __init__(self, *arguments: Any) -> None:
        self.files, self.size, self.camera, self.renderer = arguments
        self.asked: list[Any] = []
        self.closed = 0

    def ask(self, poses: Any) -> None:
        self.asked.append(poses)

    def take(self) -> np.ndarray:
        picture = np.full((2, 2, 3), len(self.asked), np.uint8)
        picture.setflags(write=False)
        return picture

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def environment_of(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Callable[[Camera | None], tuple[Any, Any, list[Recorded]]]:
    """Return what makes the pictures of a ball: they, the poses at the start, and processes."""
    pytest.importorskip("gymnasium")
    from statemachine.gym import pictures as of_gym

    made: list[Recorded] = []

    def process(*arguments: Any) -> Recorded:
        made.append(Recorded(*arguments))
        return made[-1]

    monkeypatch.setattr(of_gym, "LivePictures", process)
    monkeypatch.setattr(of_gym, "renderer_here", lambda: Renderer("pybullet"))
    model = sm.load(written(tmp_path / "ball.xml", BALL))
    poses = np.array([(0, 0, 0), (0.3, 0.2, 5.0)]), np.array([LEVEL, LEVEL])
    task: Any = SimpleNamespace(model=model, start_poses=poses)
    return lambda camera: (of_gym.Pictures(task, "rgb_array", camera), poses, made)


def test_an_environment_is_seen_from_half_as_far_again_as_fills_the_picture(
    environment_of: Any,
) -> None:
    of_ball, (xpos, xquat), made = environment_of(None)
    of_ball.draw((xpos, xquat))
    camera, aspect = made[0].camera, 480 / 360
    assert (made[0].size, camera.fovy) == ((480, 360), 30.0)
    assert len(made[0].files) == 1
    near = Camera(camera.target, camera.distance / 1.5, camera.azimuth, camera.elevation)
    corners = xpos[1] + 0.1 * np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    assert np.abs(seen_by(near, corners, aspect)).max() == pytest.approx(0.9, abs=0.01)


def test_an_environment_is_seen_by_the_camera_that_it_was_given(environment_of: Any) -> None:
    of_ball, poses, made = environment_of(CAMERA)
    of_ball.draw(poses)
    assert made[0].camera is CAMERA


def test_an_environment_has_one_process_for_all_its_pictures(environment_of: Any) -> None:
    of_ball, poses, made = environment_of(CAMERA)
    first, second = of_ball.draw(poses), of_ball.draw(poses)
    assert (len(made), made[0].asked) == (1, [[poses], [poses]])
    assert (first.max(), second.max()) == (1, 2)
    assert first.flags.writeable


def test_a_closed_environment_has_no_process_and_no_pictures(environment_of: Any) -> None:
    of_ball, poses, made = environment_of(CAMERA)
    of_ball.draw(poses)
    of_ball.close()
    of_ball.close()
    assert made[0].closed == 1
    with pytest.raises(ClosedDataError):
        of_ball.draw(poses)
