"""Calls that Windows does not have, found in a source text where nothing guards them.

Guarded is what stands under a question about the platform (`sys.platform`, `os.name`,
`hasattr`), after a branch of such a question that leaves, or in a `try` that takes the
ImportError or AttributeError. Code inside of strings is not looked at.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


MODULES = _words("crypt fcntl grp nis posix pty pwd readline resource spwd syslog termios tty")
# Of these modules, the names that the documentation of Python marks as for Unix only.
NAMES = {
    "os": _words(
        "chown chroot confstr copy_file_range ctermid eventfd fchmod fchown fork forkpty "
        "fstatvfs getegid geteuid getgid getgrouplist getgroups getloadavg getpgid getpgrp "
        "getpriority getresgid getresuid getsid getuid getxattr initgroups killpg lchown "
        "listxattr lockf login_tty major makedev memfd_create minor mkfifo mknod nice openpty "
        "pathconf pidfd_open pipe2 posix_fadvise posix_fallocate posix_openpt posix_spawn "
        "posix_spawnp pread preadv pwrite pwritev readv register_at_fork sched_getaffinity "
        "sched_setaffinity sched_yield sendfile set_blocking get_blocking setegid seteuid "
        "setgid setgroups setns setpgid setpriority setsid setuid setxattr splice statvfs "
        "sync sysconf tcgetpgrp tcsetpgrp ttyname uname unshare wait wait3 wait4 waitid "
        "writev F_LOCK O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK P_ALL P_PGID P_PID "
        "WCONTINUED WEXITED WEXITSTATUS WIFEXITED WIFSIGNALED WNOHANG WNOWAIT WSTOPPED "
        "WTERMSIG WUNTRACED"
    ),
    "signal": _words(
        "alarm getitimer pause pidfd_send_signal pthread_kill pthread_sigmask setitimer "
        "siginterrupt sigpending sigtimedwait sigwait sigwaitinfo ITIMER_REAL SIGALRM SIGBUS "
        "SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGPROF SIGQUIT SIGSTOP SIGTSTP SIGTTIN "
        "SIGTTOU SIGUSR1 SIGUSR2 SIGVTALRM SIGWINCH SIGXCPU SIG_BLOCK SIG_SETMASK SIG_UNBLOCK"
    ),
    "select": frozenset({"epoll", "kqueue", "poll"}),
    "socket": frozenset({"AF_UNIX", "SO_REUSEPORT"}),
    "time": frozenset({"clock_gettime", "clock_settime", "tzset"}),
}
KEYWORDS = frozenset({"preexec_fn", "pass_fds"})  # of subprocess: refused on Windows
FOLDERS = ("/proc", "/dev/", "/tmp", "/etc", "/sys/")
_LEAVES = (ast.Return, ast.Raise, ast.Continue, ast.Break)


def unguarded(text: str) -> list[tuple[int, str]]:
    """Line and name of each such use."""
    tree = ast.parse(text)
    return sorted(set(_in_block(tree.body, _docstrings(tree))))


def _in_block(body: list[ast.stmt], docs: set[int]) -> Iterator[tuple[int, str]]:
    for statement in body:
        if isinstance(statement, ast.If) and _asks(statement.test):
            if isinstance(statement.body[-1], _LEAVES):
                return  # what follows is for the other platform
            continue
        if isinstance(statement, ast.Try) and any(map(_takes, statement.handlers)):
            for handler in statement.handlers:
                yield from _in_block(handler.body, docs)
            continue
        blocks = [
            block
            for name, block in ast.iter_fields(statement)
            if name in ("body", "orelse", "finalbody") and isinstance(block, list)
        ]
        blocks += [part.body for part in getattr(statement, "handlers", [])]
        blocks += [part.body for part in getattr(statement, "cases", [])]
        inside = {id(inner) for block in blocks for inner in block}
        yield from _in_expressions(statement, inside, docs)
        for block in blocks:
            yield from _in_block(block, docs)


def _in_expressions(node: ast.AST, skipped: set[int], docs: set[int]) -> Iterator[tuple[int, str]]:
    """Uses in a statement itself, without the blocks that it has."""
    if isinstance(node, ast.IfExp | ast.BoolOp) and any(map(_asks, ast.iter_child_nodes(node))):
        return
    yield from ((node.lineno, name) for name in _named(node, docs))  # pyright: ignore[reportAttributeAccessIssue]
    for child in ast.iter_child_nodes(node):
        if id(child) not in skipped:
            yield from _in_expressions(child, skipped, docs)


def _named(node: ast.AST, docs: set[int]) -> Iterator[str]:
    match node:
        case ast.Import(names):
            yield from (a.name for a in names if a.name.partition(".")[0] in MODULES)
        case ast.ImportFrom(module=str(module), names=names):
            if module in MODULES:
                yield module
            known = NAMES.get(module, frozenset[str]())
            yield from (f"{module}.{a.name}" for a in names if a.name in known)
        case ast.Attribute(value=ast.Name(module), attr=name) if name in NAMES.get(module, ()):
            yield f"{module}.{name}"
        case ast.Call(keywords=keywords):
            yield from (word.arg for word in keywords if word.arg in KEYWORDS)
        case ast.Constant(str(text)) if text.startswith(FOLDERS) and id(node) not in docs:
            yield text


def _asks(test: ast.AST) -> bool:
    """Whether a condition asks what platform this is, or whether it has something."""
    for node in ast.walk(test):
        match node:
            case ast.Attribute(value=ast.Name("sys"), attr="platform"):
                return True
            case ast.Attribute(value=ast.Name("os"), attr="name"):
                return True
            case ast.Call(func=ast.Name("hasattr")):
                return True
    return False


def _takes(handler: ast.ExceptHandler) -> bool:
    caught = {node.id for node in ast.walk(handler.type or handler) if isinstance(node, ast.Name)}
    return bool(caught & {"ImportError", "ModuleNotFoundError", "AttributeError"})


def _docstrings(tree: ast.AST) -> set[int]:
    """The texts that are statements of their own."""
    return {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
