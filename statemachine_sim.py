"""Where the command `statemachine` begins, under a name that nobody else uses.

The distribution python-statemachine installs an import package that is called
`statemachine` as well. Whichever of the two is found, this says so in one line.
"""

from __future__ import annotations

# Built into Python, as `signal` is not: while that is imported, Ctrl-C is a traceback already.
import _signal

# An interrupt while the package is imported ends the process, as it ends any program that does not
# ask for it; from then on it is a KeyboardInterrupt, which the command answers.
_HANDLER = _signal.getsignal(_signal.SIGINT)
if _HANDLER is _signal.default_int_handler:
    try:
        _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
    except ValueError:  # imported by another thread than the main one, which takes no signals
        _HANDLER = None

import importlib.util  # noqa: E402
import os  # noqa: E402
import sys  # noqa: E402
import traceback  # noqa: E402


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
    try:
        from statemachine.cli import main as run
    except Exception:  # a broken installation; exit code 1 would be an answer
        traceback.print_exc()
        print("statemachine: it cannot be imported, for the reason above", file=sys.stderr)
        return 70

    try:
        if _HANDLER is _signal.default_int_handler:
            _signal.signal(_signal.SIGINT, _HANDLER)
        return run()
    except KeyboardInterrupt:  # just before the command answers it, or just after
        return 130
    finally:
        # While Python ends, a second interrupt would be a traceback of its threads.
        if _HANDLER is _signal.default_int_handler:
            _signal.signal(_signal.SIGINT, _signal.SIG_DFL)


if __name__ == "__main__":
    raise SystemExit(main())
