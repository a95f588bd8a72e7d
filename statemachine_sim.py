"""Where the command `statemachine` begins, under a name that nobody else uses.

The distribution python-statemachine installs an import package that is called
`statemachine` as well. Whichever of the two is found, this says so in one line.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
import traceback


def main() -> int:
    """Run the command line, unless the package of that name is another one."""
    spec = importlib.util.find_spec("statemachine")
    places = list(spec.submodule_search_locations or []) if spec else []
    for place in places:
        if os.path.exists(os.path.join(place, "statemachine.py")):
            print(
                "statemachine: the package python-statemachine is installed here too and uses "
                "the same import name: pip uninstall python-statemachine, then pip install "
                "--force-reinstall statemachine-sim",
                file=sys.stderr,
            )
            return 2
    # An interrupt while the package is imported ends the process, as it ends any program that
    # does not ask for it; from then on it is a KeyboardInterrupt, which the command answers.
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        from statemachine.cli import main as run
    except Exception:  # a broken installation; exit code 1 would be an answer
        traceback.print_exc()
        print("statemachine: it cannot be imported, for the reason above", file=sys.stderr)
        return 70

    signal.signal(signal.SIGINT, handler)
    return run()


if __name__ == "__main__":
    raise SystemExit(main())
