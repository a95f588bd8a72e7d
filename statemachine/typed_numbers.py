"""Numbers as somebody typed them: of the digits 0 to 9 alone.

Python's own `int` and `float` take digits of all scripts, and underscores between them: what looks
like another word would pass for a number.
"""

from __future__ import annotations


def typed_float(text: str) -> float:
    """Read a number such as "0.5", "-1e-3" or "inf".

    Raises:
        ValueError: It is none, or has other digits than 0 to 9.
    """
    if not text.isascii() or "_" in text:
        raise ValueError(f"{text!r} is not a number of the digits 0 to 9")
    return float(text)


def typed_int(text: str) -> int:
    """Read a whole number such as "12" or "-3".

    Raises:
        ValueError: It is none, or has other digits than 0 to 9.
    """
    if not text.isascii() or "_" in text:
        raise ValueError(f"{text!r} is not a whole number of the digits 0 to 9")
    return int(text)


def is_count(text: str) -> bool:
    """Tell whether a text is a whole number that is not negative, of the digits 0 to 9."""
    return text.isascii() and text.isdecimal()


# argparse names the type in its message: "invalid float value".
typed_float.__name__, typed_int.__name__ = "float", "int"
