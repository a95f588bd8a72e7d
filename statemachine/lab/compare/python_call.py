"""The call that asks another question of the same two sides, where they cannot be typed."""

from __future__ import annotations

from collections.abc import Sequence

from ...installed import DEFAULT, PAIR
from ..recordings import Trace
from .labels import typed_option
from .sides import Request, Side
from .what import What, without_folders, word_of

# The function of `statemachine.lab` that asks what an option of the command asks.
_DETAILS = "--details"
_LONGEST = 24  # characters of a side that is shown as it is
_FUNCTIONS = {"--why": "why", "--one-step": "one_step", "--converge": "converge"}


def python_call(
    run: Request, *words: str, further: Sequence[str] = (), folders: bool = True
) -> str:
    """Return the call that runs the same on the same sides, and asks a question.

    A Model that somebody loaded, and a path that is long, is called `left` or `right`, a trace
    `trace`, a function by its name.

    Args:
        run: What is run on two sides.
        words: What one would type behind the command: "--why", "--quantity", "elbow"; none for the
            comparison itself.
        further: Further arguments of the call.
        folders: Whether paths have their folders; on a page that is handed on they have none.
    """
    if _DETAILS in words:
        return "print(result.text(details=True))"
    function = "compare"
    arguments = [*_sides_of(run, folders), *_what_of(run), *_options_of(run, folders), *further]
    question = list(words)
    while question:
        flag = question.pop(0)
        if flag in _FUNCTIONS:
            function = _FUNCTIONS[flag]
        else:
            arguments.append(f"{flag.lstrip('-').replace('-', '_')}={question.pop(0)!r}")
    return f"lab.{function}({', '.join(arguments)})"


def _sides_of(run: Request, folders: bool) -> list[str]:
    """Return the arguments that name both sides, or the one model."""
    if run.sides:
        names = ("left", "right")
        return [_side(side, name, folders) for side, name in zip(run.sides, names, strict=False)]
    words: list[str] = []
    if run.model:
        words.append(run.model if folders else without_folders(run.model))
    words += [typed_option(name, value) for name, value in run.options.items()]
    arguments = [repr(" ".join(words))] if run.model else []
    if tuple(run.backends) != PAIR:
        arguments.append(f"backends={tuple(run.backends)!r}")
    return arguments


def _side(side: Side, name: str, folders: bool) -> str:
    """Return an argument that is a side: what one would type; of a Model or a long one a name."""
    backend = str(side.chosen_backend())
    model = side.model if folders else without_folders(side.model)
    words = [model if backend == DEFAULT else f"{model}@{backend}"]
    words += [typed_option(option, value) for option, value in side.options.items()]
    text = " ".join(words)
    return name if side.loaded is not None or len(text) > _LONGEST else repr(text)


def _what_of(run: Request) -> list[str]:
    """Return the argument that says what is run."""
    names = [_name_of(what) for what in run.what]
    return [f"what={names[0]}" if len(names) == 1 else f"what=({', '.join(names)})"]


def _name_of(what: What) -> str:
    if isinstance(what, Trace):
        return "trace"
    return repr(what) if isinstance(what, str) else word_of(what)


def _options_of(run: Request, folders: bool) -> list[str]:
    """Return the arguments that say how it is run, but for those that are as by default."""
    usual = Request(run.what, contract=run.contract)
    arguments: list[str] = []
    for name in ("seconds", "seed", "every", "keyframe", "command", "names", "menagerie"):
        value = getattr(run, name)
        if name == "menagerie" and value is not None and not folders:
            value = "DIR"
        if value != getattr(usual, name):
            arguments.append(f"{name}={value!r}")
    if run.contract is not None:
        arguments.append(f"contract={run.contract if folders else without_folders(run.contract)!r}")
    for side, source in zip(run.sides, ("right", "left"), strict=False):
        if side.replaced_parts is not None:
            arguments += [f"{part}={source!r}" for part in side.replaced_parts.parts]
    if run.sides and "timestep" in run.options:
        arguments.append(f"timestep={run.options['timestep']!r}")
    return arguments
