"""Numbers that somebody types: of the digits 0 to 9 alone."""

from __future__ import annotations

import pytest

from statemachine.cli import main
from statemachine.errors import BadInputError
from statemachine.lab.compare.typed_sides import parse_sides
from statemachine.lab.runs.call_period import every_of_word
from statemachine.lab.sweep.design import parse_vary
from statemachine.lab.sweep.kinds import VariableNames, resolve_kinds
from statemachine.measures import parse_tolerances
from statemachine.typed_numbers import is_count, typed_float, typed_int

from .support.claims import refused

STRANGE = ["２", "1_000", "٣", "²", "½"]


@pytest.mark.parametrize("text", STRANGE)
def test_other_digits_and_underscores_are_no_number(text: str) -> None:
    refused((ValueError, "", lambda: typed_float(text)), (ValueError, "", lambda: typed_int(text)))
    assert not is_count(text)


def test_a_number_is_typed_in_ascii_digits() -> None:
    assert [typed_float(text) for text in ("0.5", "-1e-3", " 2 ")] == [0.5, -1e-3, 2.0]
    assert [typed_int(text) for text in ("12", "-3", "+4")] == [12, -3, 4]
    assert is_count("0")
    assert not is_count("-1")


@pytest.mark.parametrize("text", STRANGE)
@pytest.mark.parametrize(
    "words",
    [
        ("compare", "hold", "--seconds={}"),
        ("trace", "record", "hold", "--seconds={}"),
        ("sweep", "hold", "--seeds={}", "--out", "x"),
        ("view", "--speed={}"),
        ("robots", "models", "--jobs={}"),
    ],
)
def test_an_option_of_a_command_takes_none(
    words: tuple[str, ...], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([word.format(text) for word in words])
    assert ended.value.code == 2
    assert "invalid" in capsys.readouterr().err


@pytest.mark.parametrize("text", STRANGE)
def test_a_side_a_tolerance_a_period_and_a_sweep_take_none(text: str) -> None:
    refused(
        (BadInputError, "", lambda: parse_sides(["so101", f"substeps={text}"])),
        (BadInputError, "", lambda: parse_tolerances([f"tip={text}mm"])),
        (BadInputError, "", lambda: every_of_word(text)),
        (BadInputError, "", lambda: every_of_word(f"{text}ms")),
        (
            BadInputError,
            "",
            lambda: resolve_kinds(
                parse_vary([f"timestep=0.001,{text}"]), VariableNames(("timestep",))
            ),
        ),
    )
