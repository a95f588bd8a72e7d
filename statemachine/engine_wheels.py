"""Records of the engines: what each is called where, and on which machines it has wheels."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Wheel:
    """A distribution that brings an engine, and one kind of machine that it has a wheel for.

    Attributes:
        requirement: What pip takes, such as "pybullet-arm64==3.2.8".
        system: Of `sys.platform`; "" for any.
        machines: Of `platform.machine()`, in lower case; empty for any.
        pythons: The oldest and the newest minor version of CPython 3.
    """

    requirement: str
    system: str = ""
    machines: tuple[str, ...] = ()
    pythons: tuple[int, int] = (11, 999)

    @property
    def distribution(self) -> str:
        """Return the requirement's name alone."""
        return self.requirement.partition("==")[0]

    def fits(self, system: str, machine: str, python: int) -> bool:
        """Tell whether a wheel can be installed on a machine."""
        return (
            self.system in ("", system)
            and (not self.machines or machine.lower() in self.machines)
            and self.pythons[0] <= python <= self.pythons[1]
        )


@dataclass(frozen=True)
class Engine:
    """One engine: what it is called where, and where its wheels work."""

    name: str
    module: str
    distributions: tuple[str, ...]  # the original first; never two of them in one environment
    wheels: tuple[Wheel, ...]  # pyproject.toml says the same as markers, which a test compares
    places: str  # the same in words
    probe: str  # an attribute that only the right package of that name has
    role: str  # what it is here for
    runs: bool = True  # whether there is a backend for it
    extra: str = ""  # the extra of this library that brings it; "" where all installations have it
    writes_to_stderr: bool = False  # whether it writes to descriptor 2 while it is imported
