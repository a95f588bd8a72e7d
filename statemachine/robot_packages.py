"""Robots by name, through packages that know where public models are.

`menagerie:NAME` or `menagerie:NAME/ENTRY` is of mujoco-menagerie, `robot_descriptions:NAME`, or
NAME alone where it ends in "_description", of robot_descriptions. Each package downloads a robot
when it is first used, and keeps it in a folder of its own on this machine.
"""

from __future__ import annotations

import importlib
import os
import sys
import urllib.error
import urllib.request
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any

from .errors import MissingEngineError, ModelFileError, check_name, one_line
from .installing import install_command

MENAGERIE, DESCRIPTIONS = "menagerie:", "robot_descriptions:"
_ANSWERS_WITHIN = 5.0  # s; a slower network counts as no network
_GITHUB = "https://github.com"
# Git asks nobody, and gives up a transfer that stands still [bytes/s, s].
_GIT = {
    "GIT_TERMINAL_PROMPT": "0",
    "GIT_HTTP_LOW_SPEED_LIMIT": "1",
    "GIT_HTTP_LOW_SPEED_TIME": "30",
}


def path_of_robot(text: str) -> Path:
    """Return the file of a robot that is given by such a name; downloaded if it is not there yet.

    Raises:
        MissingEngineError: The package is not installed.
        UnknownNameError: It has no such robot.
        ModelFileError: No robot is named, or it is not on this machine and cannot be had, or it
            has no MJCF or URDF.
    """
    if text in (MENAGERIE, DESCRIPTIONS):
        raise ModelFileError(f"{text!r} names no robot: type {text}NAME")
    if text.startswith(MENAGERIE):
        return _of_menagerie(text.removeprefix(MENAGERIE))
    return _of_descriptions(text.removeprefix(DESCRIPTIONS))


def _of_menagerie(text: str) -> Path:
    package = _package("mujoco_menagerie", "menagerie", text)
    name, _, entry = text.partition("/")
    check_name("robot in mujoco-menagerie", name, package.names())
    robot = package.get(name)
    if entry:
        check_name(f"model of {name} in mujoco-menagerie", entry, robot.entry_names)
    cache = package.Cache()
    if not cache.root and not cache.is_cached(robot):
        _need_network(name, cache.base_url)
    try:
        return Path(robot.xml(entry or None)).absolute()
    except (package.MenagerieError, OSError) as error:
        raise _not_had(name, error) from error


def _of_descriptions(name: str) -> Path:
    package = _package("robot_descriptions", "robots", name)
    check_name("robot in robot_descriptions", name, package.DESCRIPTIONS)
    if f"robot_descriptions.{name}" not in sys.modules and not _is_cloned(package, name):
        _need_network(name, _GITHUB)
    before = {key: os.environ.get(key) for key in _GIT}
    os.environ.update({key: value for key, value in _GIT.items() if before[key] is None})
    try:
        with redirect_stdout(sys.stderr):  # it says what it clones
            module = importlib.import_module(f"robot_descriptions.{name}")
    except Exception as error:  # whatever git, the network or the module says
        raise _not_had(name, error) from error
    finally:
        for key in (key for key, value in before.items() if value is None):
            os.environ.pop(key, None)
    for kind in ("MJCF_PATH", "URDF_PATH"):
        if path := getattr(module, kind, None):
            return Path(path).absolute()
    raise ModelFileError(f"robot_descriptions has neither MJCF nor URDF of {name}")


def _is_cloned(package: Any, name: str) -> bool:
    """Tell whether the repository of a robot is on this machine, as far as the package tells."""
    home = os.environ.get("ROBOTDESCRIPTIONS_CACHE", "~/.cache/robot_descriptions")
    try:
        known = importlib.import_module("robot_descriptions._repositories").REPOSITORIES
        folder = known[package.DESCRIPTIONS[name].repository].cache_path
    except (ImportError, AttributeError, KeyError):
        return False
    return (Path(home).expanduser() / folder / ".git").exists()


def _package(module: str, extra: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingEngineError(
            f"{name!r} is a robot of the package {module}, which is not installed here: "
            + install_command(extra),
            engine=module,
        ) from error


def _need_network(name: str, url: str) -> None:
    """Ask the host once, briefly: a download would try for minutes."""
    try:
        urllib.request.urlopen(
            urllib.request.Request(url, method="HEAD"), timeout=_ANSWERS_WITHIN
        ).close()
    except urllib.error.HTTPError:
        return  # somebody answers
    except (OSError, ValueError) as error:
        raise _not_had(name, getattr(error, "reason", error)) from error


def _not_had(name: str, error: object) -> ModelFileError:
    reason = one_line(error) or type(error).__name__
    return ModelFileError(
        f"{name} is not on this machine and could not be downloaded ({reason[:200]}). Without a "
        "network give the path of a model file, or a folder with --menagerie"
    )
