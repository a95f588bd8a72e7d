"""Run as a program: set limits, leave the world outside where Linux lets us, become a command.

    python -I -S _launcher.py PARENT MEMORY CPU FILE WRITABLE VIEW COMMAND ...

What `preexec_fn` is for, and may not be used for where the parent has threads. One limit that
cannot be set leaves the others.

With a folder WRITABLE the command gets namespaces of its own (user namespaces, Linux 5.12): it sees
and signals no process but those that it starts, which all end with it; it has no network; and it
can write nowhere but in that folder. Whether the system permits this is asked before, by
`sandbox.shut_in`: where it then fails, the command is not run. With "" for WRITABLE it has the
rights of whoever runs it.

With a folder VIEW, which holds an empty folder "root" and a file "places", the command moreover
sees no file but those that "places" names, read-only and under their own names. It has a line,
ended by a zero byte, for each place, those outside before those inside:

    show PATH       this file, or this folder with all that is in it, or this symbolic link
    empty PATH      a folder in which nothing is but what later lines show there
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
_MNT_DETACH = 2
_MOUNT_SETATTR, _AT_FDCWD, _AT_RECURSIVE, _ATTR_RDONLY = 442, -100, 0x8000, 1
_PDEATHSIG, _DUMPABLE, _NO_NEW_PRIVS = 1, 4, 38  # of prctl
_INSIDE = 1000  # user and group there: not 0, who would keep rights over the namespaces
_PROCESSES = 512
_HIGHEST = 65536  # descriptors above it are closed by nobody


class _MountAttr(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint64) for name in ("set", "clear", "propagation", "userns")]


def main(
    parent: str, memory: str, cpu: str, file: str, writable: str, view: str, *command: str
) -> None:
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
    if writable:
        try:
            _shut_in(writable, view)
        except OSError as error:
            sys.exit(f"it cannot be shut in: {error}")
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


def _shut_in(writable: str, view: str) -> None:
    """Go on as a process that sees, reaches and writes only what it may.

    Raises:
        OSError: The system does not permit it.
    """
    here = os.getcwd()
    user, group = os.getuid(), os.getgid()
    os.closerange(3, _HIGHEST)  # only its input and its output are left to it
    _call("unshare", _NEWUSER | _NEWNS | _NEWPID | _NEWNET | _NEWIPC)
    for name, text in (
        ("setgroups", "deny"),
        ("uid_map", f"{_INSIDE} {user} 1"),
        ("gid_map", f"{_INSIDE} {group} 1"),
    ):
        with open(f"/proc/self/{name}", "w", encoding="ascii") as table:
            table.write(text)
    # Who could make a user namespace of his own would have the rights of root in that.
    with suppress(OSError), open("/proc/sys/user/max_user_namespaces", "w", encoding="ascii") as no:
        no.write("0")
    _mount("none", "/", None, _MS_REC | _MS_PRIVATE)
    _limit("NPROC", _PROCESSES, _PROCESSES)
    _fork_and_wait()  # the first process of the new process numbers
    _die_with_the_parent()
    if view:
        _look_at(view, writable)
    else:
        with suppress(OSError):  # of which a container may keep us from
            _mount("proc", "/proc", "proc", _MS_NOSUID | _MS_NODEV | _MS_NOEXEC)
        _mount(writable, writable, None, _MS_BIND)
        _set_attributes("/", _MountAttr(set=_ATTR_RDONLY), _AT_RECURSIVE)
    _set_attributes(writable, _MountAttr(clear=_ATTR_RDONLY), 0)
    os.chdir(here)  # through the mounts as they are now
    _fork_and_wait()  # the second: signals of its own mean nothing to the first
    _call("prctl", _NO_NEW_PRIVS, 1, 0, 0, 0)


def _look_at(view: str, writable: str) -> None:
    """Make a tree of what is shown the root of this process, which has nothing else."""
    root = os.path.join(view, "root")
    with open(os.path.join(view, "places"), "rb") as file:
        lines = os.fsdecode(file.read()).split("\0")[:-1]
    _mount("tmpfs", root, "tmpfs", _MS_NOSUID | _MS_NODEV)
    for line in lines:
        kind, _, path = line.partition(" ")
        (_show if kind == "show" else _empty)(path, root + path)
    _show(writable, root + writable)
    # Processes: of the new numbers only, and without what is told of the system, where the kernel
    # knows that option. A container may keep us from both; then the folder stays empty.
    os.makedirs(root + "/proc", exist_ok=True)
    for options in ("subset=pid", None):
        with suppress(OSError):
            flags = _MS_NOSUID | _MS_NODEV | _MS_NOEXEC
            _mount("proc", root + "/proc", "proc", flags, options)
            break
    _set_attributes(root, _MountAttr(set=_ATTR_RDONLY), _AT_RECURSIVE)
    os.chdir(root)
    _call("pivot_root", b".", b".")
    _call("umount2", b".", _MNT_DETACH)
    os.chdir("/")


def _show(path: str, target: str) -> None:
    """Show a file, a folder or a link of the old root at its place in the new one."""
    os.makedirs(os.path.dirname(target), exist_ok=True)
    if os.path.islink(path):
        if not os.path.lexists(target):
            os.symlink(os.readlink(path), target)
        return
    if os.path.isdir(path):
        os.makedirs(target, exist_ok=True)
    elif not os.path.lexists(target):
        os.close(os.open(target, os.O_CREAT | os.O_WRONLY, 0o644))
    _mount(path, target, None, _MS_BIND | _MS_REC)


def _empty(_path: str, target: str) -> None:
    """Hide a folder behind an empty one."""
    os.makedirs(target, exist_ok=True)
    _mount("tmpfs", target, "tmpfs", _MS_NOSUID | _MS_NODEV)


def _fork_and_wait() -> None:
    """Go on in a child; here, end as it ends."""
    if (pid := os.fork()) == 0:
        return
    with suppress(OSError, AttributeError):
        _call("prctl", _DUMPABLE, 0, 0, 0, 0)  # nobody looks into this one
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


def _mount(
    source: str, target: str, kind: str | None, flags: int, options: str | None = None
) -> None:
    texts = [
        None if text is None else os.fsencode(text) for text in (source, target, kind, options)
    ]
    source_text, target_text, kind_text, options_text = texts
    _call("mount", source_text, target_text, kind_text, ctypes.c_ulong(flags), options_text)


def _set_attributes(path: str, attributes: _MountAttr, flags: int) -> None:
    size = ctypes.c_size_t(ctypes.sizeof(attributes))
    place, long = os.fsencode(path), ctypes.c_long
    _call("syscall", long(_MOUNT_SETATTR), _AT_FDCWD, place, flags, ctypes.byref(attributes), size)


if __name__ == "__main__":
    main(*sys.argv[1:])
