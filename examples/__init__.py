"""Tasks for reinforcement learning, made with the public interface: to be read and changed."""

from __future__ import annotations

import sys

from statemachine.errors import MissingEngineError

try:
    import statemachine.gym as _gym  # noqa: F401
except MissingEngineError as error:  # every example needs it, `--help` included
    sys.exit(str(error))
