"""What a student's code may not do, and what it opens, which is told.

Where its process is shut in (`processes.sandbox.shut_in`), it sees nothing of what it may not read:
then this tells the teacher what was tried. Elsewhere (`alone`) it is all that stands between a
student's code and the files of this machine. It hears what Python tells of itself (audit events):
code in C is not heard, nor is code that passes for that of an installed package.
"""

from __future__ import annotations

import os
import re
import site
import sys
import sysconfig
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any, Literal

from ...models import models_dir

# What a student's code may import of this package, beside its top.
PUBLIC = (
    "backends", "compare", "conformance", "errors", "interface", "kinematics", "models",
    "rotations", "runs", "worlds",
)  # fmt: skip
# What these stand on: the floors below `grading`, and the models inside a wheel.
ROOMS = (
    *PUBLIC, "_models", "drawing", "engines", "installed", "measures", "page", "probes",
    "processes", "releases", "witness",
)  # fmt: skip

_PROCESS, _PROGRAM = "it starts another process", "it starts another program"
_SIGNAL, _NETWORK = "it sends a signal to a process", "it wants to use the network"
# What no exercise needs, by the name of the audit event, and in words.
_REFUSED = {
    "os.fork": _PROCESS,
    "os.forkpty": _PROCESS,
    "os.posix_spawn": _PROCESS,
    "os.spawn": _PROCESS,
    "os.startfile": _PROCESS,
    "os.system": _PROGRAM,
    "os.exec": _PROGRAM,
    "subprocess.Popen": _PROGRAM,
    "_winapi.CreateProcess": _PROGRAM,
    "os.kill": _SIGNAL,
    "os.killpg": _SIGNAL,
    "signal.pthread_kill": _SIGNAL,
    "socket.connect": _NETWORK,
    "socket.bind": _NETWORK,
    "socket.sendto": _NETWORK,
    "socket.sendmsg": _NETWORK,
    "socket.getaddrinfo": _NETWORK,
}
# By these C code is reached, which is not heard: refused where nothing else keeps it in.
_C_CODE = ("ctypes.dlopen", "ctypes.dlsym", "ctypes.dlsym/handle", "ctypes.call_function")
_SYSTEM: tuple[str, ...] = ()
if sys.platform != "win32":
    _SYSTEM = ("/usr", "/etc", "/proc", "/sys", "/dev", "/lib", "/System", "/Library")
# What leads from /proc to the files and the memory of a process.
_INTO_PROCESSES = re.compile(
    r"/proc/[^/]+/(?:task/[^/]+/)?"
    r"(?:root|cwd|fd|exe|mem|environ|maps|smaps|map_files|cmdline|pagemap)(?:/|$)"
)
_PACKAGE = Path(__file__).resolve().parents[2]
_PACKAGE_FOLDERS = ("site-packages", "dist-packages")
_MOST_TOLD = 200  # of what is told: a loop may try every name

Who = Literal["student", "package", "ours"]


class Guard:
    """Refuses what no exercise needs, and tells of files that are not the student's."""

    def __init__(
        self,
        file: Path,
        own: Path,
        here: Path,
        tell: Callable[[str, str], None],
        alone: bool,
        faults: bool = False,
    ) -> None:
        """Begin.

        Args:
            file: The student's; its lines are named.
            own: The folder of all files that belong to it.
            here: The folder in which this process may read and write.
            tell: Gets "forbidden" and what was refused; or "reads" and the name of a file that
                is neither here, nor own, nor Python's or the package's; or of one that would
                be own and is not there. Each once.
            alone: Whether nothing else keeps the student's code from the files of this machine.
            faults: Whether tests run here, which may import what makes the faults.
        """
        places = (
            own, here, models_dir(), sys.base_prefix, *_SYSTEM,
            *sysconfig.get_paths().values(), *site.getsitepackages(), site.getusersitepackages(),
            os.environ.get("SYSTEMROOT", own),
        )  # fmt: skip
        self._open = tuple(os.path.realpath(place) + os.sep for place in places)
        self._file, self._tell, self._alone = file, tell, alone
        self._own, self._here = (os.path.realpath(place) + os.sep for place in (own, here))
        self._standard = tuple(
            {os.path.realpath(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib")}
        )
        self._package = str(_PACKAGE) + os.sep
        inside = ("inside", "faults") if faults else ("inside",)
        self._rooms = tuple(
            str(_PACKAGE / room) for room in (*ROOMS, *(f"grading/{name}" for name in inside))
        )
        self._checks_imports = not faults
        self._reported: set[tuple[str, str]] = set()
        self._refuse_programs()
        sys.addaudithook(self._hear)

    def _refuse_programs(self) -> None:
        """Refuse the one way to start a program that tells no audit hook of it."""
        if sys.platform == "win32":
            return
        import _posixsubprocess
        import subprocess

        def fork_exec(*_arguments: object) -> int:
            raise self._refusal(_PROGRAM, "fork_exec")

        for module in (_posixsubprocess, subprocess):
            for name in ("fork_exec", "_fork_exec"):
                if hasattr(module, name):
                    setattr(module, name, fork_exec)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in _REFUSED:
            raise self._refusal(_REFUSED[event], event)
        if event == "open":
            self._hear_open(*arguments)
        elif event in ("os.link", "os.rename", "os.symlink"):
            self._hear_link(event, *arguments)
        elif event == "import":
            self._hear_import(str(arguments[0]), arguments[1])
        elif self._alone and event in _C_CODE and self._who() == "student":
            raise self._refusal("it calls C code", event)

    def _hear_open(self, name: Any, mode: str | None, flags: int) -> None:
        try:
            text = os.fsdecode(name)
        except TypeError:  # the number of an open file
            return
        if self._who() == "student":
            if _INTO_PROCESSES.match(os.path.normpath(os.path.join(os.getcwd(), text))):
                raise self._refusal(f"it opens {text}", "/proc")
            if mode is None:  # os.open, which may go out from any folder that is open
                real = os.path.realpath(text) + os.sep
                outside = os.path.isdir(text) and not real.startswith((self._own, self._here))
                upwards = not os.path.isabs(text) and os.pardir in Path(text).parts
                if outside or upwards or flags & getattr(os, "O_PATH", 0):
                    raise self._refusal(f"it opens the folder or file {text!r}", "os.open")
        self._look_at(text)

    def _hear_link(
        self, event: str, source: Any, target: Any, folder: int = -1, other: int = -1
    ) -> None:
        try:
            names = os.fsdecode(source), os.fsdecode(target)
        except TypeError:
            return
        if self._who() == "student":
            if event == "os.symlink":
                goal = os.path.join(os.path.dirname(os.path.abspath(names[1])), names[0])
                if not (os.path.realpath(goal) + os.sep).startswith((self._own, self._here)):
                    raise self._refusal(f"it makes a link to {names[0]}", event)
            if folder != -1 or other != -1:
                raise self._refusal("it makes a link by an open folder", event)
        if event != "os.symlink":
            self._look_at(names[0])

    def _hear_import(self, name: str, file: Any) -> None:
        if self._checks_imports and self._who() == "student":
            top, _, rest = name.partition(".")
            room = rest.partition(".")[0]
            private = room and (room not in PUBLIC or any(p[:1] == "_" for p in rest.split(".")))
            if top == _PACKAGE.name and private:
                what = f"it imports {name}, which is not of the public interface"
                raise self._refusal(what, "import", ImportError)
            if name == "_posixsubprocess":
                raise self._refusal(f"it imports {name}", "import", ImportError)
            compiled = isinstance(file, str) and (os.path.realpath(file)).startswith(
                (self._own, self._here)
            )
            if self._alone and compiled:
                raise self._refusal(f"it loads the compiled code {file}", "import", ImportError)
        if name not in sys.stdlib_module_names:
            self._look_at(f"{self._own}{name}.py")

    def _look_at(self, name: str) -> None:
        """Tell of a file that is not the student's; where nobody else refuses it, refuse it.

        Raises:
            PermissionError: It is not the student's, and he asks for it.
        """
        with suppress(ValueError):  # no name at all
            path = os.path.realpath(name)
            inside = path + os.sep
            if inside.startswith(self._own):
                if not os.path.exists(path) and "__pycache__" not in path:
                    self._once("reads", path)
                return
            student = self._who() == "student"
            if inside.startswith(self._package) and not path.startswith(self._rooms):
                if student and os.path.dirname(path) != str(_PACKAGE):
                    raise self._refusal(f"it opens {os.path.basename(path)} of the judges", "open")
                return
            if inside.startswith((self._package, *self._open)):
                return
            if student or os.path.exists(path):
                self._once("reads", path)
            if student and self._alone:
                raise PermissionError(f"{path} is not its own: not here")

    def _refusal(self, what: str, event: str, kind: type[Exception] = PermissionError) -> Exception:
        """Tell of what is refused, if the student's code is the reason; return the error."""
        where = _line_in(sys._getframe(), self._file)
        if where is not None:
            self._once("forbidden", f"{where}{what} ({event}), which no exercise needs")
        return kind(f"{what}: not here")

    def _once(self, kind: str, text: str) -> None:
        if (kind, text) not in self._reported and len(self._reported) < _MOST_TOLD:
            self._reported.add((kind, text))
            self._tell(kind, text)

    def _who(self) -> Who:
        """Return whose code asks, past that of Python's own library."""
        frame: FrameType | None = sys._getframe()
        while frame is not None:
            name = frame.f_code.co_filename
            if name == __file__ or name.startswith(("<frozen ", "<__array_function__")):
                frame = frame.f_back
                continue
            folders = name.split(os.sep)
            if any(folder in folders for folder in _PACKAGE_FOLDERS):
                # This package may itself be installed there.
                return "ours" if name.startswith(self._package) else "package"
            if name.startswith(self._package):
                return "ours"
            if name.startswith(self._standard):
                frame = frame.f_back
                continue
            return "student"
        return "ours"


def _line_in(frame: Any, path: Path) -> str | None:
    """Return 'line 12: ', the innermost line of the student's file; nothing if there is none.

    None where a package wants it, which does without: of matplotlib, a program that lists fonts.
    """
    while frame is not None:
        name = frame.f_code.co_filename
        if name == str(path):
            return f"line {frame.f_lineno}: "
        if "site-packages" in name and not name.startswith(str(_PACKAGE)):
            return None
        frame = frame.f_back
    return ""
