"""The backends by name, each loaded when it is first asked for.

What a backend for an engine with a world of its own is made from is here, too (`HiddenWorld`), and
loaded when it is first asked for.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import inspect
import warnings
from collections.abc import Callable
from contextvars import ContextVar
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from ..errors import BadInputError, EngineError, EngineWarning, MissingEngineError, check_name
from ..installed import DEFAULT, ENGINES, raise_if_interrupted, require
from ..interface import Model
from ..interface.checks import as_switch
from ..interface.records import AS_WRITTEN, Base, Defaults
from ..model_files import checked_path
from ..models import AnyPath
from ..release_names import is_release, version_of
from .binary import is_binary, read_binary
from .starts import overlap_warning, places_in, usual_start

__all__ = [
    "BackendChoice",
    "HiddenData",
    "HiddenModel",
    "HiddenWorld",
    "Loader",
    "Moment",
    "backend_engine",
    "backend_names",
    "check_backend",
    "load",
    "load_for_places",
    "load_to_run",
    "parse_backend",
    "register",
]


if TYPE_CHECKING:
    from ..interface.free_base import FreeBase
    from .hidden_data import HiddenData as HiddenData
    from .hidden_data import HiddenModel as HiddenModel
    from .hidden_world import HiddenWorld as HiddenWorld
    from .hidden_world import Moment as Moment

# Where the parts are of a backend for an engine with a world of its own; MuJoCo needs none.
_HIDDEN = {
    "HiddenData": "hidden_data",
    "HiddenModel": "hidden_data",
    "HiddenWorld": "hidden_world",
    "Moment": "hidden_world",
}


def __getattr__(name: str) -> Any:
    if name not in _HIDDEN:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HIDDEN[name]}", __name__), name)


class Loader(Protocol):
    """What a backend module offers: from a file to a Model.

    A loader that refuses files for what they have takes `options`, too, a mapping as
    `Model.replace` has them: what is switched off there is nothing to refuse. To the Models of
    the others `load` applies them. One that reads files as `base`, `balance_inertia` and `meshes`
    say takes `read_options`, too.
    """

    def __call__(self, path: Path, defaults: Defaults) -> Model: ...


# Where each backend is, as "package.module:function"; ours go by the names of their engines.
BACKENDS: dict[str, str] = {
    name: f"{__name__}.{name}_backend:load" for name, engine in ENGINES.items() if engine.runs
}


def backend_names() -> list[str]:
    """Return the names that `load` takes for `backend`, whether or not their engine is
    installed.
    """
    _discover()
    return list(BACKENDS)


def check_backend(kind: str, name: str) -> None:
    """Raise UnknownNameError for what is neither a backend nor a release of an engine.

    Args:
        kind: What the message calls it.
        name: As it was typed.
    """
    if is_release(name):
        version_of(name)
    else:
        check_name(kind, name, backend_names())


@dataclass(frozen=True)
class BackendChoice:
    """A backend and whose defaults it has, as `parse_backend` reads it.

    Attributes:
        name: Of the backend: "mujoco", "pybullet", "mujoco==3.3.7".
        defaults: "engine" for the engine as its own users meet it.
    """

    name: str
    defaults: Defaults = "model"

    def __str__(self) -> str:
        return f"{self.name}:engine" if self.defaults == "engine" else self.name

    def load_to_run(self, model: AnyPath, **arguments: Any) -> Model:
        """Load a model on it, as the function of this name does."""
        return load_to_run(model, self.name, defaults=self.defaults, **arguments)

    def load_for_places(self, model: AnyPath, **arguments: Any) -> Model:
        """Load a model on it, as the function of this name does."""
        return load_for_places(model, self.name, defaults=self.defaults, **arguments)


def parse_backend(word: str) -> BackendChoice:
    """Read a backend as it is typed behind --backend, or behind the @ of a side.

    Args:
        word: "pybullet", "mujoco==3.3.7", or "pybullet:engine" for the engine as its own users
            meet it.

    Raises:
        UnknownNameError: There is no such backend, or something else stands behind the colon.
        BadInputError: It is a release of MuJoCo without three numbers.
    """
    name, colon, way = word.partition(":")
    check_backend("backend", name)
    if not colon:
        return BackendChoice(name)
    check_name(f"way to load a file on {name}", way, ("engine",))
    return BackendChoice(name, "engine")


def backend_engine(name: str) -> str | None:
    """Return the engine (a key of `installed.ENGINES`) that a backend needs.

    Raises:
        UnknownNameError: There is no such backend.
    """
    _find(name)
    return name if name in ENGINES else None


def backend_module(name: str) -> str:
    """Return the module that brings a backend, by full name.

    Raises:
        UnknownNameError: There is no such backend.
    """
    return _find(name).partition(":")[0]


def register(name: str, loader: str) -> None:
    """Make a backend of another package known under a name.

    A package that declares it as an entry point of the group "statemachine.backends"
    is found without this, by the command line too.

    Args:
        name: What `load(…, backend=name)` takes.
        loader: "package.module:function" of a `Loader`; imported at first use.

    Raises:
        BadInputError: The loader is no such path, or the name is another backend's.
    """
    module, _, function = loader.partition(":")
    if not (module and function):
        raise BadInputError(f"loader must read 'package.module:function'; got {loader!r}")
    if BACKENDS.setdefault(name, loader) != loader:
        raise BadInputError(f"there is a backend named {name!r} already; choose another name")


def _loader_at(place: str, backend: str) -> Callable[..., Model]:
    """Return the function of a backend that loads a file.

    Args:
        place: Where it stands, as "module:function".
        backend: As of `load`.

    Raises:
        MissingEngineError: It cannot be imported.
    """
    module, _, function = place.partition(":")
    try:
        loader = cast("Callable[..., Model]", getattr(importlib.import_module(module), function))
    except (ImportError, AttributeError) as error:
        raise_if_interrupted(error)
        raise MissingEngineError(
            f"backend {backend!r} cannot be loaded from {place!r}: {error}", engine=backend
        ) from error
    if is_release(backend):
        return partial(loader, release=backend)
    return loader


def load(
    model: AnyPath,
    backend: str = DEFAULT,
    *,
    defaults: Defaults = "model",
    menagerie: AnyPath | None = None,
    trust_binary: bool = False,
    balance_inertia: bool = False,
    meshes: bool = True,
    base: Base | FreeBase | None = None,
    **options: Any,
) -> Model:
    """Compile a model's file into a Model. The slow part, done once.

    Shapes that are more than 1 mm inside each other at the usual start are an EngineWarning that
    names this state: the keyframe "home" if there is one, else the default state. Where contacts
    are off nothing is said.

    Args:
        model: A name ("so101/scene_box") or a path; see `models.resolve`.
        backend: The engine to run it on, or a release of it, as "mujoco==3.3.7".
        defaults: "model" keeps the contract of this library on every backend;
            "engine" gives what the engine's own users get when they load the file.
        menagerie: A menagerie folder to look the name up in.
        trust_binary: Whether a binary model (.mjb) is read. MuJoCo does not check one: a damaged
            or malicious file can crash or harm the process.
        balance_inertia: Whether an inertia is balanced whose principal moments break A + B >= C, or
            of which one is not positive, as MuJoCo refuses it: all three become their mean. An
            EngineWarning names each.
        meshes: Whether shapes that are meshes are read. Without them a file can be read whose
            meshes are missing, or of a format that MuJoCo does not know; an EngineWarning says
            what touches nothing then.
        base: "free" for a robot whose base floats: where the file has no free joint for it, as a
            URDF without a floating joint, it gets one, and starts where it stands in the file (of
            a URDF at the origin); a `FreeBase` says where. "fixed" for one whose base stands: a
            free joint of it is left out. None for what the file says.
        **options: As `Model.replace` takes them, before anything of the file is refused:
            `contacts=False` loads a robot of whose geoms the engine knows no shape.

    Raises:
        UnknownNameError: No such backend or model, or no such base.
        UnsupportedError: The file has what the backend cannot do, or there is no such option.
        BadInputError: The value of an option has the wrong shape, kind or size.
        MissingEngineError: The backend's engine is not installed here.
        ModelFileError: The file is not there.
        ModelError: The engine cannot read the file, or it is a binary model that is not trusted.
    """
    if isinstance(backend, str) and backend.endswith(":engine"):
        name = backend.removesuffix(":engine")
        raise BadInputError(
            f'{backend!r} is typed on the command line; here it is backend="{name}", '
            'defaults="engine"'
        )
    place = _find(backend)
    check_name("defaults", defaults, ("model", "engine"))
    path = checked_path(model, menagerie)
    if as_switch(trust_binary, "trust_binary") and is_binary(path):
        read_binary(path, trust=True)  # the loader knows its bytes then
    if backend in ENGINES:
        require(backend)
    loader = _loader_at(place, backend)
    takes = inspect.signature(loader).parameters
    takes_options = "options" in takes
    early: dict[str, Any] = {"options": options} if options and takes_options else {}
    read_options, least_mass = AS_WRITTEN, _FOR_PLACES.get()
    if least_mass or (balance_inertia, meshes, base) != (False, True, None):
        from ..interface.read_options import check_takes_read_options, checked_read_options

        read_options = checked_read_options(balance_inertia, meshes, base, least_mass)
        check_takes_read_options(backend, takes, read_options)
        early["read_options"] = read_options
    loaded = loader(path, defaults=defaults, **early)
    if loaded is None:
        raise EngineError(f"the loader {place} of backend {backend!r} returned None, and no Model")
    named = deepcopy(options) if takes_options else {}
    vars(loaded).update(read_options=read_options, defaults=defaults, options=named)
    if options and not takes_options:
        loaded = loaded.replace(**options)
    if not _WARNED_BY_THE_RUN.get() and (text := _of_usual_start(loaded)):
        warnings.warn(text, EngineWarning, stacklevel=2)
    return loaded


def _of_usual_start(model: Model) -> str:
    return overlap_warning(model, places_in(model, usual_start(model)))


# Whether `load` leaves it to its caller to tell of shapes inside each other.
_WARNED_BY_THE_RUN: ContextVar[bool] = ContextVar("told by the run", default=False)


def load_to_run(model: AnyPath, backend: str = DEFAULT, **arguments: Any) -> Model:
    """Load a Model as `load` does, and say nothing of shapes inside each other.

    It is for what knows in which state its run starts, and tells of that state itself: the usual
    start, of which `load` tells, may be another one.
    """
    token = _WARNED_BY_THE_RUN.set(True)
    try:
        return load(model, backend, **arguments)
    finally:
        _WARNED_BY_THE_RUN.reset(token)


# Whether `load` reads a file of which places alone are asked.
_FOR_PLACES: ContextVar[bool] = ContextVar("for places", default=False)


def load_for_places(model: AnyPath, backend: str = DEFAULT, **arguments: Any) -> Model:
    """Load a Model of which places alone are asked, as `load` does, but refuse less of its file.

    Places need no masses, inertias or meshes: an inertia that MuJoCo refuses is balanced, a body
    that moves without mass gets the least that MuJoCo takes, and meshes are left out. No motion of
    this Model means anything.
    """
    read = {"balance_inertia": True, "meshes": False, **arguments}
    token = _FOR_PLACES.set(True)
    try:
        return load_to_run(model, backend, **read)
    finally:
        _FOR_PLACES.reset(token)


def on_default(model: Model) -> Model:
    """Return a model on the engine that compiles MJCF: itself, or what that engine makes of its
    file.

    Raises:
        MissingEngineError: That engine is not installed here.
        ModelError: It cannot read the file.
    """
    with warnings.catch_warnings(action="ignore", category=EngineWarning):  # told of the model
        if model.backend == DEFAULT:
            return model
        read = model.read_options
        again = load_for_places if read.least_mass else load
        return again(
            model.path,
            balance_inertia=read.balance_inertia,
            meshes=read.meshes,
            base=read.base if read.start is None else read.start,
        )


def _find(name: str) -> str:
    if isinstance(name, str) and is_release(name):
        return f"{__name__}.served.release_backend:load"
    known = isinstance(name, str) and name in BACKENDS
    if not known:
        _discover()
    check_name("backend", name, BACKENDS)
    return BACKENDS[name]


def _discover() -> None:
    """Add the backends that installed packages declare; our own names stay ours."""
    for entry in importlib.metadata.entry_points(group="statemachine.backends"):
        BACKENDS.setdefault(entry.name, entry.value)
