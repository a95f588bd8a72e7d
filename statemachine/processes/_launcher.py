"""Run as a program: set limits, leave the world outside where Linux lets us, become a command.

    python -I -S _launcher.py PARENT MEMORY CPU FILE WRITABLE COMMAND ...

What `preexec_fn` is for, and may not be used for where the parent has threads. One limit that
cannot be set leaves the others.

Where the system permits it (user namespaces, Linux 5.12), the command gets namespaces of its
own: it sees and signals no process but those that it starts, which all end with it; it has no
network; and it can write nowhere but in the folder WRITABLE. Elsewhere, or with "" for
WRITABLE, it has the rights of whoever runs it.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from contextlib import suppress

if sys.platform == "win32":
    raise ImportError("this program is for POSIX")

import resource

_NEWNS, _NEWIPC, _NEWUSER, _NEWPID, _NEWNET = (
    0x20000, 0x8000000, 0x10000000, 0x20000000, 0x40000000
)  # fmt: skip
_MS_NOSUID, _MS_NODEV, _MS_NOEXEC, _MS_BIND, _MS_REC, _MS_PRIVATE = 2, 4, 8, 4096, 16384, 1 << 18
_MOUNT_SETATTR, _AT_FDCWD, _AT_RECURSIVE, _ATTR_RDONLY = 442, -100, 0x8000, 1
_PDEATHSIG, _NO_NEW_PRIVS = 1, 38  # of prctl
_INSIDE = 1000  # user and group there: not 0, who would keep rights over the namespaces
_PROCESSES = 512


class _MountAttr(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint64) for name in ("set", "clear", "propagation", "userns")]


def main(parent: str, memory: str, cpu: str, file: str, writable: str, *command: str) -> None:
    """Become the command; see the module's text."""
    if sys.platform == "linux":
        _die_with_the_parent()
        if os.getppid() != int(parent):
            sys.exit("who started it has ended")
    _limit("AS", int(memory), int(memory))
    # A limit of computing time is first a signal of its own, and then the end.
    _limit("CPU", int(cpu), int(cpu) + 1)
    _limit("FSIZE", int(file), int(file))
    _limit("CORE", 0, 0)
    if writable and sys.platform == "linux" and _works(writable):
        _isolate(writable)
        _limit("NPROC", _PROCESSES, _PROCESSES)
        _fork_and_wait()  # the first process of the new process numbers
        _die_with_the_parent()
        with suppress(OSError):  # of which a container may keep us from
            _mount("proc", "/proc", "proc", _MS_NOSUID | _MS_NODEV | _MS_NOEXEC)
        _fork_and_wait()  # the second: signals of its own mean nothing to the first
        _call("prctl", _NO_NEW_PRIVS, 1, 0, 0, 0)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        sys.exit(f"{command[0]}: {error.strerror}")


def _limit(name: str, soft: int, hard: int) -> None:
    with suppress(OSError, ValueError, AttributeError):
        resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (soft, hard))


def _die_with_the_parent() -> None:
    with suppress(OSError, AttributeError):
        _call("prctl", _PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)


def _works(writable: str) -> bool:
    """Whether the namespaces can be had, tried in a process that ends."""
    if (pid := os.fork()) == 0:
        try:
            _isolate(writable)
            os._exit(0)
        except BaseException:
            os._exit(1)
    return os.waitpid(pid, 0)[1] == 0


def _isolate(writable: str) -> None:
    """Namespaces in which only one folder can be written to, for what is forked from now on.

    Raises:
        OSError: The system does not permit it.
    """
    user, group, here = os.getuid(), os.getgid(), os.getcwd()
    _call("unshare", _NEWUSER | _NEWNS | _NEWPID | _NEWNET | _NEWIPC)
    for name, text in (
        ("setgroups", "deny"),
        ("uid_map", f"{_INSIDE} {user} 1"),
        ("gid_map", f"{_INSIDE} {group} 1"),
    ):
        with open(f"/proc/self/{name}", "w", encoding="ascii") as table:
            table.write(text)
    _mount("none", "/", None, _MS_REC | _MS_PRIVATE)
    _mount(writable, writable, None, _MS_BIND)
    _set_attributes("/", _MountAttr(set=_ATTR_RDONLY), _AT_RECURSIVE)
    _set_attributes(writable, _MountAttr(clear=_ATTR_RDONLY), 0)
    os.chdir(here)  # through the mounts as they are now


def _fork_and_wait() -> None:
    """Go on in a child; here, end as it ends."""
    if (pid := os.fork()) == 0:
        return
    os.closerange(0, 3)  # whoever reads from the command waits for the command only
    while True:
        ended, status = os.waitpid(-1, 0)
        if ended == pid:
            break
    code = os.waitstatus_to_exitcode(status)
    if os.getpid() == 1:  # which no signal of its own ends: it says so as a shell does
        os._exit(code if code >= 0 else 128 - code)
    if code > 128:
        with suppress(OSError, ValueError):
            signal.signal(code - 128, signal.SIG_DFL)
            os.kill(os.getpid(), code - 128)
    os._exit(code if code >= 0 else 1)


def _call(name: str, *arguments: object) -> None:
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments) != 0:
        raise OSError(ctypes.get_errno(), f"{name}: {os.strerror(ctypes.get_errno())}")


def _mount(source: str, target: str, kind: str | None, flags: int) -> None:
    texts = [None if text is None else os.fsencode(text) for text in (source, target, kind)]
    _call("mount", *texts, ctypes.c_ulong(flags), None)


def _set_attributes(path: str, attributes: _MountAttr, flags: int) -> None:
    size = ctypes.c_size_t(ctypes.sizeof(attributes))
    place, long = os.fsencode(path), ctypes.c_long
    _call("syscall", long(_MOUNT_SETATTR), _AT_FDCWD, place, flags, ctypes.byref(attributes), size)


if __name__ == "__main__":
    main(*sys.argv[1:])
