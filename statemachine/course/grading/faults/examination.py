"""What a test file is worth: the faults that its tests caught, and those that they did not."""

from __future__ import annotations

from dataclasses import dataclass

from . import Fault


@dataclass(frozen=True)
class FailedTest:
    """Test that failed.

    Attributes:
        test: Its name.
        why: What it said, in a line.
    """

    test: str
    why: str


@dataclass(frozen=True)
class FaultTrial:
    """Tests against an arm with one fault.

    Attributes:
        fault: What is wrong with the arm.
        caught_by: The tests that failed on it.
    """

    fault: Fault
    caught_by: tuple[FailedTest, ...]

    @property
    def caught(self) -> bool:
        """Tell whether any test caught the fault."""
        return bool(self.caught_by)


@dataclass(frozen=True)
class Examination:
    """What a test file is worth.

    Attributes:
        file: Its name.
        backend: What it ran on.
        engine_version: Of its engine.
        tests: Those that are not skipped.
        failures: Those that failed on the healthy arm; then there are no trials.
        trials: One for each fault.
    """

    file: str
    backend: str
    engine_version: str
    tests: tuple[str, ...]
    failures: tuple[FailedTest, ...]
    trials: tuple[FaultTrial, ...]

    @property
    def caught(self) -> int:
        """Return the number of faults that were caught."""
        return len(self.trials) - len(self.missed)

    @property
    def missed(self) -> tuple[Fault, ...]:
        """Return the faults that no test caught."""
        return tuple(trial.fault for trial in self.trials if not trial.caught)

    @property
    def idle(self) -> tuple[str, ...]:
        """Return the tests that caught no fault."""
        busy: set[str] = set()
        for trial in self.trials:
            busy.update(failure.test for failure in trial.caught_by)
        return tuple(test for test in self.tests if test not in busy)

    @property
    def holds(self) -> bool:
        """Tell whether the tests pass on the healthy arm and catch all faults."""
        return not self.failures and not self.missed
