"""How much a difference of two files weighs, and what it does: closed forms of one pendulum.

Its arm weighs 2 kg at 0.5 m with 0.1 kg m² about itself: M = 0.6 kg m², a load of 9.81 N·m. A frame
is 1 m from its axis, and its servo exerts 20 N·m.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.lab.model_differences import ListedDifference
from statemachine.lab.model_differences.agreement import digits_of
from statemachine.lab.model_differences.effects import Meaning
from statemachine.lab.model_differences.listing import ElementPlace, Listing, share_of

from .support.two_files import compared_texts

PENDULUM = """<mujoco><compiler angle="radian" autolimits="true"/><option {option}/><worldbody>
  <body name="a" {place}><joint name="j" type="{kind}" axis="{axis}" {joint}/>
  <inertial pos="{com} 0 0" mass="{mass}" diaginertia="0.1 0.1 0.1"/>
  <geom name="g" size="{size}" mass="0" pos="{geom} 0 0"/><site name="s" pos="{site} 0 0"/></body>
  </worldbody><actuator><position name="m" joint="j" {gains}/></actuator></mujoco>"""
PLAIN = {
    "option": "",
    "place": "",
    "kind": "hinge",
    "axis": "0 1 0",
    "joint": "",
    "com": "0.5",
    "mass": "2",
    "size": "0.1",
    "geom": "0",
    "site": "1",
    "gains": 'kp="50" kv="1" forcerange="-20 20"',
}
SHIFTED = {"place": 'pos="0.1 0 0"'}


def rows_of(folder: Path, left: dict[str, str], right: dict[str, str]) -> list[ListedDifference]:
    """Return what two pendula differ in."""
    sides = [PENDULUM.format(**PLAIN | changes) for changes in (left, right)]
    return list(compared_texts(folder, *sides).differences)


@pytest.mark.parametrize(
    ("left", "right", "quantity", "share", "effect"),
    [
        ({}, {"joint": 'frictionloss="0.5"'}, "frictionloss", 0.5 / 20, "2.50% of the effort"),
        ({}, {"joint": 'damping="3"'}, "damping", 3 / 20, "never / 200 ms"),
        (
            {"joint": 'damping="3"'},
            {"joint": 'damping="6"'},
            "damping",
            3 / 20,
            "200 ms / 100 ms",
        ),
        # Of a slide M is the mass.
        (
            {"kind": "slide"},
            {"kind": "slide", "joint": 'damping="3"'},
            "damping",
            3 / 20,
            "never / 667 ms",
        ),
        # The wider range is 3.5 rad.
        (
            {"joint": 'range="-1 1"'},
            {"joint": 'range="-2 1.5"'},
            "range",
            1 / 3.5,
            "the right goes 57.3° further",
        ),
        (
            {"joint": 'range="-2 1.5"'},
            {"joint": 'range="-1 1.75"'},
            "range",
            1 / 3.5,
            "the left goes 57.3° further, the right goes 14.3° further",
        ),
        ({}, {"joint": 'range="-2 1.5"'}, "range", 1.0, "the left has no stop"),
        ({"joint": 'range="-2 1.5"'}, {}, "range", 1.0, "the right has no stop"),
        ({}, {"mass": "3"}, "mass", 1 / 3, "33.3% of the larger"),
        # 1.962 N·m of 11.772, and of 9.81.
        ({}, {"com": "0.6"}, "com", 1 / 6, "up to 2 N·m"),
        ({}, {"com": "0.4"}, "com", 1 / 5, "up to 2 N·m"),
        ({}, {"size": "0.2"}, "size", 0.1, ""),
        ({}, {"geom": "0.3"}, "place", 0.3, ""),
        ({}, {"site": "1.2"}, "place", 0.2 / 1.2, ""),
        ({}, {"axis": "0 1 1"}, "axis", 1 / 4, "turned by 45°"),
        ({}, {"axis": "0 -1 0"}, "axis", 1.0, "moves the other way"),
        (
            {},
            {"place": 'pos="0.1 0 0"'},
            "place",
            0.1 / 1.1,
            "moves what it carries by up to 100 mm",
        ),
        # About its own axis, by a chord of 2 sin 0.15; about another one.
        (
            {},
            {"place": 'euler="0 0.3 0"'},
            "turned by",
            2 * math.sin(0.15),
            "only its zero is elsewhere: moves what it carries by up to 299 mm",
        ),
        ({}, {"place": 'euler="0.3 0 0"'}, "turned by", 0.3 / math.pi, ""),
        (
            {},
            {"gains": 'kp="50" kv="1" forcerange="-30 40"'},
            "forcerange",
            20 / 70,
            "at most 20 N·m / 40 N·m",
        ),
        ({}, {"gains": 'kp="50" kv="1"'}, "forcerange", 0.5, "at most 20 N·m / unlimited"),
        ({}, {"option": 'timestep="0.004"'}, "timestep", 0.5, ""),
        ({}, {"option": 'iterations="50"'}, "iterations", 0.2, ""),
        ({}, {"option": 'iterations="95"'}, "iterations", 0.05, ""),
        ({}, {"option": 'gravity="0 0 -1"'}, "gravity", 8.81 / 9.81, ""),
        ({}, {"option": 'cone="elliptic"'}, "cone", 0.5, ""),
        ({}, {"joint": 'actuatorfrcrange="-5 5"'}, "actfrcrange", 1.0, "its load: 9.81 N·m"),
        (
            {"joint": 'actuatorfrcrange="-5 5"'},
            {"joint": 'actuatorfrcrange="-8 6"'},
            "actfrcrange",
            3 / 8,
            "1.6 times",
        ),
        (
            {"joint": 'stiffness="2"'},
            {"joint": 'stiffness="2" springref="0.5"'},
            "springref",
            0.5,
            "",
        ),
    ],
)
def test_what_a_difference_weighs_and_does(
    tmp_path: Path,
    left: dict[str, str],
    right: dict[str, str],
    quantity: str,
    share: float,
    effect: str,
) -> None:
    (found,) = rows_of(tmp_path, left, right)
    assert found.quantity == quantity
    assert found.share == pytest.approx(share, abs=1e-9)
    assert found.effect == effect
    assert found.matters


# The list


QUARTER = Meaning(0.25)


def listed(left: Any, right: Any, meaning: Meaning = QUARTER, digits: int = 6) -> Listing:
    listing = Listing(digits)
    listing.enter("mass", ElementPlace("body", "arm"), "mass", (left, right), meaning, "kg")
    return listing


@pytest.mark.parametrize(
    ("left", "right", "share"),
    [
        (1.0, 3.0, 2 / 3),
        (-1.0, 1.0, 1.0),
        (0.0, 0.0, 0.5),
        ("a", "b", 0.5),
        (1.0, None, 0.5),
        ((0.0, 3.0, 0.0), (0.0, 0.0, 4.0), 1.0),
        ((3.0, 0.0, 4.0), (3.0, 0.0, 1.0), 3 / 5),
        ((1.0, 2.0), (1.0, 2.0, 3.0), 0.5),
        ((-1.0, 1.0), (-1.0, 2.0), 1 / 3),  # of a range its width counts
        (math.inf, 1.0, 0.5),
    ],
)
def test_two_values_are_apart_by_a_part_of_the_larger(left: Any, right: Any, share: float) -> None:
    assert share_of((left, right)) == pytest.approx(share)


@pytest.mark.parametrize(("off", "count"), [(3.9e-5, 0), (4.1e-5, 1)])
def test_numbers_that_agree_to_six_digits_are_rounded(off: float, count: int) -> None:
    """Half of the sixth digit is 5e-6; of that eight may come together."""
    assert len(listed(1.0, 1.0 + off).differences) == count
    assert len(listed(1.0, 1.0 + 10 * off, digits=5).differences) == count


def test_a_scale_that_is_larger_than_the_values_makes_more_of_it_rounding() -> None:
    off = 1e-4
    assert len(listed(0.0, off, Meaning(0.5, scale=0.0)).differences) == 1
    assert len(listed(0.0, off, Meaning(0.5, scale=0.5)).differences) == 1
    assert len(listed(0.0, off, Meaning(0.5, scale=3.0)).differences) == 0
    assert len(listed(1.0, 2.0, Meaning(0.5, relative=0.0)).differences) == 0
    assert len(listed(1.0, 1.0, Meaning(0.5, relative=1.0)).differences) == 1


def test_an_entry_has_the_size_of_its_difference_and_words_for_what_is_infinite() -> None:
    (found,) = listed(1.0, 4.0).differences
    assert (found.size, found.left, found.right, found.share) == (3.0, 1.0, 4.0, 0.25)
    (found,) = listed(1.0, math.inf).differences
    assert (found.size, found.right) == (None, "unlimited")
    (found,) = listed((-1.0, 1.0), (-math.inf, math.inf)).differences
    assert (found.size, found.right) == (None, "none")


@pytest.mark.parametrize(("share", "kept"), [(-0.5, 0.0), (0.3, 0.3), (1.5, 1.0)])
def test_a_share_is_from_0_to_1(share: float, kept: float) -> None:
    (found,) = listed(1.0, 2.0, Meaning(share)).differences
    assert found.share == kept


def test_the_heaviest_subject_comes_first_and_what_moves_nothing_last() -> None:
    listing = Listing(6)
    for subject, quantity, share, matters in (
        ("inertia", "a", 0.2, True),
        ("mass", "b", 0.1, True),
        ("inertia", "c", 0.9, False),
        ("mass", "d", 0.8, True),
        ("limits", "e", 1.0, False),
    ):
        meaning = Meaning(share, matters=matters)
        place = ElementPlace("body", "arm")
        listing.enter(subject, place, quantity, (1.0, 2.0), meaning)
    assert [row.quantity for row in listing.ordered()] == ["d", "b", "a", "c", "e"]


@pytest.mark.parametrize(
    ("relative", "digits"),
    [(0.0, 17), (-1.0, 17), (0.5, 1), (0.51, 0), (5.0, 0), (5e-4, 4), (5.1e-4, 3), (1e-30, 17)],
)
def test_two_numbers_agree_to_digits(relative: float, digits: int) -> None:
    assert digits_of(relative) == digits


# What agrees


def test_what_two_pendula_have_in_common_is_counted(tmp_path: Path) -> None:
    first, second = (
        PENDULUM.format(**PLAIN | {"joint": 'range="-2 1.5" damping="3"', **more})
        for more in ({}, {"mass": "2.5"})
    )
    shared = compared_texts(tmp_path, first, second).agreements
    found = {(row.subject, row.unit): row for row in shared}
    assert ("mass", "kg") not in found
    limits = found["limits", "rad"]
    assert (limits.count, limits.compared, limits.worst, limits.digits) == (2, 2, 0.0, 17)
    assert found["damping", "N·m·s"].count == 1
    assert np.isfinite([row.worst for row in found.values()]).all()
