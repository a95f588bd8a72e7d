"""The map of the project is true: its rooms, its floors, and the places that it names."""

from __future__ import annotations

import re
import tomllib

from .support.claims import assert_in
from .support.processes import of_python
from .support.requirements import ROOT

PACKAGE = ROOT / "statemachine"
MAP = (ROOT / "docs" / "architecture.md").read_text("utf-8")
# Floor, room, what it is for.
ROOMS = re.findall(r"^\| (\d+) \| `([\w./]+)` \| (.+?) \|$", MAP, re.MULTILINE)


def test_every_room_is_in_the_table_with_its_purpose() -> None:
    rooms = {
        f"{path.name}/" if path.is_dir() else path.name
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    } - {"__init__.py"}
    assert {room for _, room, _ in ROOMS} == rooms
    assert len(ROOMS) == len(rooms)
    assert all(len(purpose.split()) >= 3 or "`" in purpose for _, _, purpose in ROOMS)


def test_the_floors_are_those_that_imports_keep() -> None:
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    floors = {
        name.strip(): number
        for number, layer in enumerate(tools["importlinter"]["contracts"][0]["layers"], start=1)
        for name in layer.split("|")
    }
    told = {room.removesuffix(".py").rstrip("/"): int(floor) for floor, room, _ in ROOMS}
    assert told == floors
    assert list(told.values()) == sorted(told.values())


def test_every_place_that_is_named_exists() -> None:
    places = re.findall(r"`((?:statemachine|tests)\w*(?:/\w+)*\.py)(?::(\w+))?`", MAP)
    assert len(places) >= 20
    for path, name in places:
        text = (ROOT / path).read_text("utf-8")
        assert not name or re.search(rf"^(class|def|async def) {name}\b", text, re.M), (path, name)


def test_the_glossary_tells_few_words_and_each_once() -> None:
    _, _, glossary = MAP.partition("## Glossary")
    words = re.findall(r"^\| ([^|]+?) \| [^|]+ \|$", glossary, re.MULTILINE)[1:]
    assert len(words) == len(set(words)) <= 30
    assert_in(
        words,
        *("Model", "Data", "derived", "stale", "command", "target", "joint dynamics", "keyframe"),
        *("raw engine", "unavailable", "equalize", "diverge", "tolerance", "trace"),
    )


def test_the_lines_of_the_rooms_are_counted() -> None:
    page = of_python(ROOT / "docs" / "rooms.py", code=0).stdout
    counted = dict(re.findall(r"\| `([\w./]+)` \| [\d,]+ \| ([\d,]+) \|", page))
    assert {room for _, room, _ in ROOMS} == set(counted) - {"__init__.py"}
    assert int(counted["errors.py"]) == len((PACKAGE / "errors.py").read_text().splitlines())
