"""The gains that were found, in gains.toml beside this file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from .gait import GAINS
from .network import Floats

FILE = Path(__file__).with_name("gains.toml")


def read_gains(path: Path = FILE) -> Floats:
    """Return the gains of a file, (n_gains,), in the order of GAINS."""
    table = tomllib.loads(path.read_text())
    return np.array([table[gain.name] for gain in GAINS])


def write_gains(values: Floats, path: Path = FILE) -> None:
    """Write gains to a file, with four digits behind the point."""
    lines = [f"{gain.name} = {value:.4f}\n" for gain, value in zip(GAINS, values, strict=True)]
    path.write_text("# Written by `python -m tools.policy_training search`.\n" + "".join(lines))
