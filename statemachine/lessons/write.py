"""Writing into the state: a view, not a copy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.text import count, position
from ..experiments import write
from ..page import Page, Question, Table, Text, Verdict
from ._words import emulation, page_of, sentence, typed, where
from .records import Session


def run(play: Any, options: Mapping[str, Any], progress: Any) -> write.Write:
    """One write, and who notices."""
    model = play.model
    play()
    return write.run(model, joint=options["joint"], value=options["value"])


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """A name for the array, a copy of it, and a write."""
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
slot = model.jnt_qposadr[model.joint_id({options["joint"]!r})]
view = data.qpos
copy = data.qpos.copy()
view[slot] = {options["value"]:g}
print(data.qpos[slot], copy[slot], view is data.qpos)
"""


def page(results: Mapping[str, write.Write], session: Session) -> Page:
    """The same memory, what it changes, what is refused."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text("One number is written, by way of a second name for data.qpos."),
        *typed(
            session,
            Question(
                f"view[slot] was set to {first.value:g}. What does data.qpos[slot] say?",
                (f"{first.value:g}", "0.0, until forward or step is called", "an error"),
                0 if first.view == first.value else 1,
                f"The view and data.qpos are one array; the copy still says {first.copy:g}.",
            ),
        ),
        Text(
            "data.qpos is no copy. A second name for it is the same array, and what you write "
            "there is what the next call starts from; nothing has to be handed over. (To keep a "
            "value, copy it: data.qpos.copy().)"
        ),
    ]
    for name, result in results.items():
        prefix = where(results, name)
        blocks.append(
            Verdict(
                f"{prefix}qpos, qvel and ctrl are the same arrays after "
                f"{', '.join(result.calls)}: a name once taken stays good",
                len(result.kept) == 3,
            )
        )
        if result.in_engine is None:
            blocks.append(
                sentence(
                    results,
                    name,
                    "the engine keeps its state to itself; the arrays are the interface's, and "
                    "the next call takes over what they say.",
                )
            )
        else:
            blocks.append(
                Verdict(
                    f"{prefix}the array is the engine's own memory: right after the write "
                    f"data.raw.qpos[{result.place}] is {result.in_engine:g}",
                    result.in_engine == result.value,
                )
            )
        blocks.append(
            Verdict(
                f"{prefix}nothing that is derived from qpos noticed: {_changed(result)} changed. "
                "The next lesson is about that",
                not result.changed,
            )
        )
        blocks.append(
            sentence(
                results,
                name,
                f"the next step starts from what you wrote: it leaves {result.joint} at another "
                f"speed than without the write, by {position(result.felt, result.slide, 1)}/s, and "
                f"finds {count(result.found, 'contact')} where there would be {result.otherwise}.",
            )
        )
    blocks += emulation(results, "stale after a write")
    blocks.append(
        Table(
            ("you type", "and read"),
            first.refused,
            title="What is refused",
            words=frozenset({0, 1}),
        )
    )
    return page_of("Writing into the state", results, blocks)


def _changed(result: write.Write) -> str:
    return ", ".join(result.changed) or "no derived array"
