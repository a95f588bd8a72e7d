"""Check yourself: six questions, each answered by a run of the lesson that it is about."""

from __future__ import annotations

from typing import Any

from ..errors import BadInputError
from ..interface import Model
from ..measures.text import degrees, duration
from ..page import Figures
from ..runs.drive import Progress, part_of
from ..runs.header import provenance
from ..runs.robot import is_the_arm
from . import LESSONS, module
from .session import CodeRun, Options, take

# The lessons that answer, one for each question, with options for little to do.
ASKED: dict[str, dict[str, Any]] = {
    "forward": {},
    "state": {},
    "replay": {"steps": 150},
    "gravity": {"seconds": 4.0, "longer": 0.0},
    "objects": {"worlds": 3},
    "time": {},
}


def code(model: Model, options: Options, load: str) -> str:
    """None: the code of the lessons has been shown."""
    if not is_the_arm(model):
        raise BadInputError(
            f"these questions are about the SO-101, and {model.path.name} is another robot"
        )
    return ""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Take each of the lessons that answer: what they measured, by their names."""
    play()
    model, answers = play.model, {}
    for number, (name, values) in enumerate(ASKED.items()):
        share = part_of(progress, number / len(ASKED), 1 / len(ASKED))
        answers[name] = take(LESSONS[name], model, model.backend, values, progress=share).result
    return Figures(answers=answers, provenance=provenance(model))


def slots(result: Figures) -> dict[str, Any]:
    """Those of each lesson under its name, and whether its run bears out the right choice."""
    slots = {
        name: vars(answer) | module(name).slots(answer) for name, answer in result.answers.items()
    }
    forward, replay, gravity, objects, time = (
        slots[name] for name in ("forward", "replay", "gravity", "objects", "time")
    )
    costs = result.answers["objects"]
    on, off = gravity["servos_on"].position[-1], gravity["servos_off"].position[-1]
    answered = {
        "forward": (forward["unchanged"] and forward["moves"], 2),
        "state": (bool(slots["state"]["shifted"]), 0),
        "replay": (replay["identical"] and (replay["truth"] or not replay["finer"]), 1),
        "gravity": (gravity["servo_holds"] and gravity["balanced"] and abs(off) > abs(on), 0),
        "objects": (objects["alone"] and objects["constant"] and costs.ratio > 1, 2),
        "time": (time["identical"] and time["still"], 0),
    }
    for name, (holds, right) in answered.items():
        slots[name] |= {"holds": bool(holds), "right": right if holds else None}
    return {
        **slots,
        "finer": replay["truth"],
        "sagged": degrees(on, 3),
        "fallen": degrees(off),
        "load": duration(costs.loading),
        "load_steps": f"{costs.ratio:,.0f}",
        "unpaced": duration(time["free"]),
        "paced": f"{time['paced']:.3f} s",
    }
