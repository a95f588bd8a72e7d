"""Reset and keyframes: back to a known state, and what that state is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.text import count, millimetres
from ..experiments import reset
from ..page import Page, Question, Table, Text, Verdict
from ._words import differences, emulation, page_of, sentence, typed, where
from .records import Session


def run(play: Any, options: Mapping[str, Any], progress: Any) -> reset.Reset:
    """A reset, and each keyframe."""
    model = play.model
    play()
    return reset.run(model, progress=progress)


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """Step, reset, and reset to a keyframe."""
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
sm.step(model, data, 100)
sm.reset(model, data)
print(data.time, data.qpos[:3])
for frame in model.keyframes[:1]:
    sm.reset(model, data, keyframe=0)
    print(frame.name, data.time, data.qpos[:3].round(3) + 0.0)
"""


def page(results: Mapping[str, reset.Reset], session: Session) -> Page:
    """What a reset takes back, and what the keyframes show."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text("Half a second is simulated, then taken back; then a state is taken from the file."),
        *typed(session, _question(first)),
        Text(
            "reset puts a Data back to the model's default state: positions, velocities, "
            "command and time. With keyframe=… it goes to a state that the model file names. "
            "Nothing derived is computed by it: that is forward's work."
        ),
    ]
    for name, result in results.items():
        prefix, steps = where(results, name), count(result.steps, "step")
        blocks += [
            Verdict(
                f"{prefix}after {steps} and a reset qpos, qvel, ctrl and time are bit for bit "
                f"those of a fresh Data, and so are the next {steps}",
                len(result.restored) == 4 and result.same_future,
            ),
            Verdict(f"{prefix}every derived array is zero after a reset", result.empty),
        ]
    blocks += emulation(results, "zeros when fresh")
    if not first.scenes:
        blocks.append(Text("This model's file names no keyframe: try --model so101/scene_box."))
    for number, scene in enumerate(first.scenes):
        scenes = {name: result.scenes[number] for name, result in results.items()}
        blocks.append(_contacts(number, scene, scenes))
        blocks += [_finding(results, name, number, first.provenance.model_file) for name in results]
    blocks += differences(
        results,
        [
            (f"rise of the {scene.body}, {scene.name}", _rise(k))
            for k, scene in enumerate(first.scenes)
            if scene.body
        ],
    )
    return page_of("Back to a known state", results, blocks)


def _question(first: reset.Reset) -> Question | None:
    if not first.scenes:
        return None
    frame = first.scenes[0]
    if frame.time == 0:
        return None
    return Question(
        f"what is data.time after the reset to keyframe 0 ({frame.name!r})?",
        ("0 s: a reset begins anew", "0.5 s: as before", f"{frame.time:g} s: what the file says"),
        2 if "time" in frame.exact else 0,
        "Time is a number of the state, and a keyframe has one of its own.",
    )


def _contacts(
    number: int, first: reset.KeyframeScene, scenes: Mapping[str, reset.KeyframeScene]
) -> Table:
    pairs = dict.fromkeys(pair for scene in scenes.values() for pair in scene.contacts)
    rows = [
        (pair, *(count(scene.contacts.get(pair, 0), "contact") for scene in scenes.values()))
        for pair in pairs
    ]
    return Table(
        ("what touches", *scenes),
        rows or [("nothing", *("" for _ in scenes))],
        title=f"Keyframe {number} ({first.name!r}, time {first.time:g} s), after forward",
    )


def _finding(
    results: Mapping[str, reset.Reset], name: str, number: int, file: str
) -> Text | Verdict:
    """What a keyframe is, by what touches what, then and in the steps that follow."""
    scene = results[name].scenes[number]
    if scene.body is None:
        return sentence(results, name, "there is no free body in this scene.")
    after = f"in {count(scene.nstep, 'step')} under the keyframe's own ctrl"
    moved = f"it {'rises' if scene.rise > 0 else 'sinks'} by {millimetres(abs(scene.rise))}"
    steps = f"{scene.robot_steps} of {scene.nstep} steps"
    if scene.held:
        return Verdict(
            f"{where(results, name)}the {scene.body} is held: it touches the robot and nothing "
            f"else, then and in {steps} under the keyframe's own ctrl; {moved}",
            True,
        )
    if scene.on_robot == 0 and scene.on_world:
        text = (
            f"the {scene.body} is not held: {count(scene.on_world, 'contact')} with what does not "
            f"move, none with the robot; {after} the robot touches it in {steps}, and {moved}"
        )
        if number == 0 and file.startswith("robotstudio_so101"):
            text += ". A lesson that calls this a grasp with the box lifted is mistaken"
        return sentence(results, name, f"{text}.")
    return sentence(
        results,
        name,
        f"the {scene.body} has {count(scene.on_robot, 'contact')} with the robot and "
        f"{scene.on_world} with what does not move; {after} the robot touches it in {steps}, "
        f"and {moved}.",
    )


def _rise(number: int) -> Any:
    def say(one: reset.Reset, two: reset.Reset) -> str:
        rises = millimetres(two.scenes[number].rise, 3), millimetres(one.scenes[number].rise, 3)
        return f"{rises[0]} instead of {rises[1]}"

    return say
