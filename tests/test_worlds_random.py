"""Worlds that differ: options of `Model.replace` for each, and drawing them from a seed."""

from __future__ import annotations

from functools import partial
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import worlds
from statemachine.errors import BadInputError, EngineError, UnknownNameError
from statemachine.interface import worlds as interface_worlds
from statemachine.worlds import LogUniform, Uniform, draw, make_worlds

from .support.claims import assert_in, refused
from .support.lives import live
from .support.requirements import ROOT, need_engine
from .support.small_models import SLEEPY, loaded, model_of

FACTS = (
    "timestep", "gravity", "body_mass", "geom_friction", "actuator_kp", "actuator_kv",
    "actuator_delay", "dof_armature", "dof_damping", "dof_frictionloss",
)  # fmt: skip
N = 5


@pytest.fixture(scope="module")
def box() -> Any:
    return sm.load("so101/scene_box")


def varied(model: Any) -> dict[str, Any]:
    """Return every option of MuJoCo's that can differ between worlds, for N of them."""
    return draw(
        model,
        N,
        seed=1,
        mass=Uniform(0.7, 1.3, each=True),
        friction=(0.3, 1.0),
        kp=LogUniform(0.5, 2.0),
        kv=Uniform(0.5, 2.0, each=True),
        armature=(0.5, 2.0),
        damping=(0.5, 2.0),
        frictionloss=(0.0, 2.0),
        gravity=(0.5, 1.5),
        latency=Uniform(0.0, 0.04, each=True),
    ) | {
        "timestep": [0.002, 0.005, 0.004, 0.003, 0.001],
        "actuation": [True, True, False, True, True],
        "contacts": [True, False, True, True, True],
        "limits": [True, True, True, False, True],
        "integrator": ["euler", "implicit", "implicitfast", "euler", "implicitfast"],
        "substeps": [2] * N,
    }


NAMES = (
    "mass", "friction", "kp", "kv", "armature", "damping", "frictionloss", "gravity", "latency",
    "timestep", "actuation", "contacts", "limits", "integrator", "substeps",
)  # fmt: skip


@pytest.mark.parametrize(
    ("backend", "name"),
    [
        *(pytest.param("mujoco", name, marks=pytest.mark.slow) for name in NAMES),
        ("mujoco", "all of them"),
        ("pybullet", "all of them"),
    ],
)
@pytest.mark.filterwarnings("ignore:PyBullet. friction of")
def test_a_world_is_the_data_of_a_replaced_model(backend: str, name: str) -> None:
    """Bit for bit, whatever becomes of them."""
    need_engine(backend)
    model = sm.load("so101/scene_box", backend=backend)
    can = model.capabilities.options
    every = {key: values for key, values in varied(model).items() if key in can}
    assert backend == "pybullet" or set(every) == set(NAMES) == set(can)
    options = every if name not in NAMES else {name: every[name]}
    models = [
        model.replace(**{key: values[i] for key, values in options.items()}) for i in range(N)
    ]
    with make_worlds(model, N, workers=2, **options) as many:
        live(many, models, 16)
        for i, one in enumerate(models):
            for fact in FACTS:
                got, wanted = (getattr(each, fact) for each in (many.model_of(i), one))
                np.testing.assert_array_equal(got, wanted, err_msg=fact)


def test_no_world_has_a_compiled_model_of_its_own(box: Any) -> None:
    """Its own are some kilobytes of arrays; a compiled model of the scene takes 3 MB."""
    options = draw(box, 64, seed=0, mass=(0.8, 1.2), friction=(0.5, 1.5), kp=(0.8, 1.2))
    with make_worlds(box, 64, **options) as many:
        assert many._batch.models is None
        expanded = map(many._batch.expanded, mujoco.batch.MODEL_FIELDS)
        size = sum(array.nbytes for array in expanded if array is not None) / 64
    page = (ROOT / "docs" / "worlds.md").read_text("utf-8")
    assert_in(page, f"{size / 1e3:.1f} kB a world", f"{mujoco.mj_sizeModel(box.raw) / 1e6:.1f} MB")


def test_a_model_without_actuators(tmp_path: Any) -> None:
    flag = "<option><flag gravity='disable'/></option>"
    model = loaded(tmp_path, "<body><freejoint/><geom size='.1'/></body>", flag)
    options = {"gravity": [[0, 0, -9.81], [0, 0, -1.62]], "timestep": [0.01, 0.02]}
    with make_worlds(model, 2, **options) as many:
        worlds.step(many, 10)
        np.testing.assert_allclose(many.qvel[:, 2], [-0.981, -0.324], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("scene", ["box", "box, substeps and times", "asleep"])
def test_worlds_of_any_latency_live_as_data_of_replaced_models(
    box: Any, tmp_path: Any, scene: str, seed: int
) -> None:
    """States go both ways, time is set back and forth, worlds are reset: the same bits.

    Where a tree falls asleep the engine computes the forces once more, after the newest command
    has taken the place of the oldest; so a memory that keeps more gives another qacc.
    """
    rng = np.random.default_rng(seed)
    model = box
    options: dict[str, Any] = {"latency": rng.uniform(0, 0.05, (3, 6))}
    if scene == "asleep":
        model, options = (
            model_of(tmp_path, SLEEPY),
            {"latency": rng.uniform(0, 0.05, 3)},
        )
    elif "times" in scene:
        model = model.replace(latency=0.02)
        options |= {"timestep": [0.004, 0.002, 0.003], "substeps": [2] * 3}
    models = [model.replace(**{k: v[i] for k, v in options.items()}) for i in range(3)]
    with make_worlds(model, 3, workers=2, **options) as many:
        live(many, models, 300, seed, 0.5)
        for i, each in enumerate(models):
            assert many.model_of(i).raw.nhistory == each.raw.nhistory


def test_a_latency_that_memory_cannot_hold_is_refused(arm: sm.Model) -> None:
    """Before an engine sees it: the option, what it would take and what there is."""
    refused(
        *(
            (
                BadInputError,
                r"latency of 10 s .* GB in a Data, which may",
                partial(arm.replace, latency=10, timestep=step),
            )
            for step in (1e-9, 1e-300)
        ),
        (
            BadInputError,
            "engine steps of 1e-09",
            lambda: make_worlds(arm, 2, latency=[0, 1], timestep=[1e-9] * 2).close(),
        ),
    )
    assert arm.replace(latency=0, timestep=1e-9).timestep == 1e-9


def test_worlds_that_do_not_fit_are_refused(box: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(interface_worlds, "free_memory", lambda: 10**6)
    refused(
        (
            EngineError,
            r"1000 worlds .* kB",
            lambda: make_worlds(box, 1000),
        ),
        (
            EngineError,
            "20000 commands",
            lambda: make_worlds(box, 2, latency=[0, 2], timestep=[1e-4] * 2),
        ),
    )
    make_worlds(box, 10).close()


def test_options_that_are_alike_change_nothing(box: Any) -> None:
    """Nominal values drawn with a factor of 1 are the nominal values, bit for bit."""
    options = draw(box, 2, seed=0, mass=(1, 1), friction=(1, 1), kp=LogUniform(1, 1))
    with make_worlds(box, 2, **options) as many, make_worlds(box, 2) as plain:
        for each in (many, plain):
            worlds.reset(each, keyframe=0)
            worlds.step(each, 30)
        np.testing.assert_array_equal(many.qpos, plain.qpos)


def test_a_draw_depends_on_seed_number_and_option_alone(box: Any) -> None:
    ranges: dict[str, Any] = {
        "mass": (0.8, 1.2),
        "kp": LogUniform(0.5, 2.0, each=True),
        "latency": (0.0, 0.03),
    }
    many = draw(box, 100, seed=7, **ranges)
    few = draw(box, 3, seed=7, **dict(reversed(ranges.items())))
    other = draw(box, 3, seed=8, **ranges)
    for name, each in ranges.items():
        np.testing.assert_array_equal(many[name][:3], few[name])
        np.testing.assert_array_equal(few[name], draw(box, 3, seed=7, **{name: each})[name])
        assert (other[name] != few[name]).any()
    # The streams of two options are not the same numbers.
    mass, kp = many["mass"][:, 1] / box.body_mass[1], many["kp"][:, 1] / box.actuator_kp[1]
    assert abs(np.corrcoef(mass, kp)[0, 1]) < 0.3


def test_the_numbers_of_a_seed_stay_those() -> None:
    """A seed that a paper names gives these numbers in every version."""
    drawn = draw(sm.load("so101"), 2, seed=0, latency=(0.0, 1.0), damping=LogUniform(0.5, 2.0))
    np.testing.assert_allclose(
        drawn["latency"][:, 0], (0.04236974312728847, 0.022566133945349676), rtol=1e-9
    )
    np.testing.assert_allclose(
        drawn["damping"][:, 0] / 0.6, (0.6496135874063642, 0.5931352164359404), rtol=1e-9
    )


@pytest.mark.parametrize("kind", [Uniform, LogUniform])
def test_ranges_are_filled_and_kept(box: Any, kind: type[Uniform]) -> None:
    n = 20_000
    factors = draw(box, n, seed=3, mass=kind(0.5, 2.0))["mass"][:, 1] / box.body_mass[1]
    assert 0.5 * (1 - 1e-12) <= factors.min() <= factors.max() <= 2.0 * (1 + 1e-12)
    # The middle: 1.25 of the numbers, or 1 of their logarithms; both within 4 standard errors.
    below = np.mean(factors < (1.25 if kind is Uniform else 1.0))
    assert abs(below - 0.5) < 4 * 0.5 / np.sqrt(n)


def test_one_factor_for_all_or_one_for_each(box: Any) -> None:
    one = draw(box, 4, seed=0, mass=(0.5, 2.0))["mass"]
    each = draw(box, 4, seed=0, mass=Uniform(0.5, 2.0, each=True))["mass"]
    bodies = box.body_mass > 0
    assert one.shape == each.shape == (4, box.nbody)
    assert (np.ptp(one[:, bodies] / box.body_mass[bodies], axis=1) < 1e-12).all()
    assert (np.ptp(each[:, bodies] / box.body_mass[bodies], axis=1) > 0.1).all()
    assert not one[:, ~bodies].any()


def test_what_cannot_differ_is_refused(box: Any) -> None:
    of: Any = partial(draw, box, 2)
    make = partial(make_worlds, box, 2)
    refused(
        (BadInputError, "substeps must be the same", lambda: make(substeps=[1, 2])),
        (BadInputError, "mass", lambda: make(mass=[box.body_mass, 0 * box.body_mass])),
        (BadInputError, "mass", lambda: make(mass=[box.body_mass])),
        (BadInputError, "low > 0", lambda: LogUniform(0.0, 1.0)),
        (BadInputError, "0 ≤ low ≤ high", lambda: of(seed=0, mass=(1.2, 0.8))),
        (BadInputError, "0 ≤ low ≤ high", lambda: of(seed=0, mass=(-1, 1))),
        (BadInputError, "finite", lambda: of(seed=0, mass=(0, np.nan))),
        (BadInputError, "mass takes", lambda: of(seed=0, mass=1.2)),
        (BadInputError, "mass takes", lambda: of(seed=0, mass=(1, 2, 3))),
        (BadInputError, "seed", lambda: of(seed=-1)),
        (UnknownNameError, "friction", lambda: of(seed=0, frictoin=(0.8, 1.2))),
    )
