"""A function as the processes of a sweep load it: of its file, or kept in one of its own."""

from __future__ import annotations

import base64
import inspect
import sys
from pathlib import Path

from ...atomic_files import replace_text
from ...installed import require_extra
from ...models import AnyPath
from ..runs.controllers import Function, check_is_controller, file_and_name_of

_NAME = "controller"
_TEXT = '''"""A function of a sweep, kept by value, for the same version of Python."""

import base64
import pickle

{name} = pickle.loads(base64.b64decode("{pickled}"))
'''


def file_of_function(function: Function, folder: AnyPath) -> str:
    """Return "FILE.py:FUNCTION" of a function; one that no file gives is kept beside a folder.

    Args:
        function: Called with (model, data, …).
        folder: Of the dataset; "runs" has a function in "runs.py".

    Raises:
        BadInputError: The function takes no Model and Data.
        MissingEngineError: The extra of sweeps is missing.
        OSError: The file cannot be written.
    """
    check_is_controller(function)
    path, name = file_and_name_of(function)
    module = sys.modules.get(getattr(function, "__module__", ""))
    is_of_file = module is not None and module.__name__ != "__main__" and path.is_file()
    if is_of_file and inspect.isfunction(function) and getattr(module, name, None) is function:
        return f"{path}:{name}"
    require_extra("joblib", "a sweep", "joblib", "sweep")
    from joblib.externals.loky.backend.reduction import dumps  # cloudpickle, which joblib brings

    pickled = base64.b64encode(bytes(dumps(function))).decode()
    file = Path(folder).with_name(f"{Path(folder).name}.py")
    replace_text(file, _TEXT.format(name=_NAME, pickled=pickled))
    return f"{file}:{_NAME}"
