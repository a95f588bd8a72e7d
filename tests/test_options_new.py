"""Mass, friction, gains and latency of `Model.replace`: values, errors, and what follows from them.

What they do to a motion is checked by `statemachine.conformance.options`, on every backend.
"""

from __future__ import annotations

import pickle
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import worlds
from statemachine.errors import BadInputError, EngineWarning, ModelError, UnsupportedError

from .support.backends import each_of_both
from .support.claims import refused
from .support.motions import opened, path
from .support.small_models import CART, model_of, on_both

SERVO = '<position name="servo" joint="rail" kp="100" kv="20"/>'
MOTOR = '<motor name="motor" joint="other"/>'


def cart(tmp_path: Path, actuators: str, backend: str = "mujoco") -> Any:
    return model_of(tmp_path, CART.format(actuators=actuators), backend=backend)


def test_a_replaced_model_is_as_if_compiled_with_that_mass(mujoco_box: sm.Model) -> None:
    """The compiler, told the same masses and inertias, gives the same constants."""
    scale = np.linspace(0.5, 1.5, mujoco_box.nbody)
    replaced, raw = mujoco_box.replace(mass=scale * mujoco_box.body_mass).raw, mujoco_box.raw
    spec = mujoco.MjSpec.from_file(str(mujoco_box.path))
    for body in spec.bodies:
        k = raw.body(body.name).id
        if raw.body_mass[k]:
            # What the compiler found of geoms or an inertial element, as an inertial element.
            body.explicitinertial, body.fullinertia = True, [np.nan] * 6
            body.ipos, body.iquat = raw.body_ipos[k], raw.body_iquat[k]
            body.mass, body.inertia = scale[k] * raw.body_mass[k], scale[k] * raw.body_inertia[k]
    compiled = spec.compile()
    for name in (
        "body_mass", "body_inertia", "body_subtreemass", "body_invweight0", "dof_invweight0",
        "dof_M0",
    ):  # fmt: skip
        np.testing.assert_allclose(getattr(replaced, name), getattr(compiled, name), rtol=1e-9)


def test_gains_are_of_servos_alone(tmp_path: Path, backend: str) -> None:
    model = cart(tmp_path, MOTOR + SERVO, backend)
    assert np.isnan(model.actuator_kp[0])
    for gains in ({"kp": 50}, {"kp": 0.5 * model.actuator_kp}):
        other = model.replace(**gains)
        assert (other.actuator_kp[1], other.actuator_kv[1], other.actuator_gain[0]) == (50, 20, 1)
    assert model.replace(kv=0).actuator_kv[1] == 0


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("kp", [1.0, 2.0], r"kp\[0\] is given for motor"),
        ("kp", [np.nan, np.nan], r"kp\[0\] = nan"),
        ("mass", [1.0, 2.0], r"mass\[0\] \(world\) = 1 must be 0"),
        ("mass", [0.0, 0.0], r"mass\[1\] \(cart\) = 0 must be above 0"),
        ("mass", 1.0, "takes 2 numbers"),
        ("kv", 1, "has none"),
        *(("latency", value, "latency") for value in (-0.1, 11.0, [0.1], np.nan, "long")),
    ],
)
def test_the_value_that_is_wrong_is_named(
    tmp_path: Path, backend: str, option: str, value: Any, says: str
) -> None:
    model = cart(tmp_path, MOTOR + SERVO if "none" not in says else MOTOR, backend)
    refused((BadInputError, says, lambda: model.replace(**{option: value})))


@pytest.mark.parametrize("order", [1, -1])
def test_options_add_up_and_their_order_does_not_count(box: sm.Model, order: int) -> None:
    options = {
        **{"mass": 1.5 * box.body_mass, "kv": 3.0, "friction": 0.5, "kp": 200.0},
        **{"substeps": 5, "timestep": 0.01, "latency": 0.03},
    }
    once, each = box.replace(**options), box.replace(timestep=0.004, latency=0.5)
    for name in list(options)[::order]:
        each = each.replace(**{name: options[name]})
    for model in (once, each, each.replace(latency=once.actuator_delay)):
        assert (model.timestep, model.substeps) == (0.01, 5)
        np.testing.assert_allclose(model.actuator_delay, 0.03, rtol=1e-12)
        for name in ("body_mass", "actuator_kp", "actuator_kv", "geom_friction"):
            np.testing.assert_array_equal(getattr(once, name), getattr(model, name))
        with opened(model, nstep=3) as (_, data):
            assert data.time == pytest.approx(0.03)
    # The friction of turning stays.
    np.testing.assert_array_equal(once.geom_friction[:, 1:], box.geom_friction[:, 1:])


@pytest.mark.usefixtures("bullet")
def test_pybullet_says_which_frictions_it_cannot_have() -> None:
    """It multiplies the frictions of two links; MuJoCo takes the larger."""
    model = sm.load("so101/scene_box", backend="pybullet")
    with warnings.catch_warnings(action="error", category=EngineWarning):
        model.replace(friction=0.5)
        model.replace(kp=500)
    friction = np.full(model.ngeom, 0.1)
    friction[model.geom_bodyid == model.body_id("box")] = 0.2
    friction[model.geom_bodyid == model.body_id("gripper")] = 0.9
    with pytest.warns(EngineWarning, match=r"friction of .* is .*, not") as caught:
        model.replace(friction=friction)
    assert caught[0].filename == __file__


def test_friction_without_effect_is_refused(tmp_path: Path) -> None:
    """The file overrides that of every contact."""
    text = CART.format(actuators="").replace("/>", '><flag override="enable"/></option>', 1)
    model = model_of(tmp_path, text)
    refused(
        (UnsupportedError, "overrides the friction", lambda: model.replace(friction=0.5)),
        (
            UnsupportedError,
            "overrides the friction",
            lambda: worlds.make_worlds(model, 2, friction=[0.5, 0.6]),
        ),
    )


DELAYED = CART.format(
    actuators='<motor joint="rail" delay=".007" nsample="{kept}" interp="{interp}"/>'
    '<motor joint="other"/>'
)


@pytest.mark.parametrize(("kept", "late"), [(9, 4), (2, 2)])
def test_a_delay_of_the_file_is_kept(tmp_path: Path, backend: str, kept: int, late: int) -> None:
    """7 ms are 4 steps of 2 ms; where the file keeps two commands, the older of them acts."""
    model = model_of(tmp_path, DELAYED.format(kept=kept, interp="zoh"), backend=backend)
    np.testing.assert_allclose(model.actuator_delay, [late * 0.002, 0])
    rail, other = (np.diff(path(model, 6, ctrl=1), axis=0) > 0).T
    assert rail.tolist() == [False] * late + [True] * (6 - late)
    assert other.all()


LATE = """<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody><body>
<joint name="j" axis="0 1 0" damping="0.1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/>
</body></worldbody>
<actuator><position joint="j" kp="20" kv="1" delay="0.05" nsample="5"/></actuator>
<keyframe><key name="home" qpos="0.5" ctrl="0.5"/></keyframe></mujoco>"""


@each_of_both  # bit by bit
def test_a_delay_of_the_file_starts_as_the_engine_starts_it(tmp_path: Path, backend: str) -> None:
    """Reset to a keyframe, MuJoCo finds 0 in the buffer; the option finds the keyframe's ctrl."""
    raw = mujoco.MjModel.from_xml_string(LATE)
    data = mujoco.MjData(raw)
    mujoco.mj_resetDataKeyframe(raw, data, 0)
    expected = np.zeros((30, 1))
    for row in expected:
        mujoco.mj_step(raw, data)
        row[:] = data.qpos
    assert np.degrees(0.5 - expected.min()) > 15  # it falls back for five steps
    model = model_of(tmp_path, LATE, "late.xml", backend=backend)
    late = model.replace(latency=0.05)
    held = path(late, 30, "home")[1:]
    # What is made of it starts in the same way, and what the option asks for is held.
    for made, wanted, most in (
        (model, expected, 1e-9 if backend == "pybullet" else 1e-15),
        (model.replace(damping=0.1), expected, 1e-9),
        (model.with_compiled(model.compiled), expected, 1e-9),
        (late, 0.5, 0.03),
        (late.replace(damping=0.1), 0.5, 0.03),
        (late.with_compiled(late.compiled), 0.5, 0.03),
        (pickle.loads(pickle.dumps(late)), 0.5, 0.03),
        (sm.load(model.path, backend, latency=0.05), 0.5, 0.03),
    ):
        assert np.abs(path(made, 30, "home")[1:] - wanted).max() < most
    rows_of: list[tuple[dict[str, Any], Any]] = [({}, expected), ({"latency": [0.05]}, held)]
    for options, wanted in rows_of:
        with worlds.make_worlds(model, 1, **options) as many:
            worlds.reset(many, keyframe=0)
            rows = worlds.record(many, 30, ("qpos",))["qpos"][0]
        assert np.abs(rows - wanted).max() < 1e-9


def test_a_latency_of_whole_steps_is_that_many_at_any_time(tmp_path: Path) -> None:
    """MuJoCo's own delay of 70 ms at 10 ms a step is 7 steps or 8, by the rounding of time."""
    model = cart(tmp_path, MOTOR).replace(timestep=0.01, latency=0.1).replace(latency=0.07)
    for delay, late in ((model.raw.actuator_delay[0], {7}), (0.07, {7, 8})):  # ours, as it reads
        model.raw.actuator_delay[:] = delay
        data, found = mujoco.MjData(model.raw), list[int]()
        for k in range(3000):
            data.ctrl[0] = k
            mujoco.mj_step(model.raw, data)
            found.append(k - int(data.actuator_force[0]))
        assert set(found[11:]) == late


def test_room_for_commands_changes_nothing_else(mujoco_box: sm.Model) -> None:
    """The compiled model goes through MuJoCo's own binary format."""
    raw, late = mujoco_box.raw, mujoco_box.replace(latency=0.02).raw
    changed = {
        name
        for name in dir(raw)
        if name[0] != "_"
        and isinstance(value := getattr(raw, name), (np.ndarray, int))
        and not np.array_equal(value, getattr(late, name), equal_nan=not isinstance(value, int))
    }
    assert changed == {
        "nhistory", "actuator_history", "actuator_historyadr", "actuator_delay",
        "signature",  # a digest of the sizes
    }  # fmt: skip
    assert late.names == raw.names


def test_states_with_other_latencies_are_foreign(arm: sm.Model) -> None:
    late = arm.replace(latency=0.02)
    with sm.make_data(arm) as data, sm.make_data(late) as other:
        state = sm.get_state(arm, data)
        refused((sm.errors.ForeignStateError, "", lambda: sm.set_state(late, other, state)))


@pytest.mark.usefixtures("bullet")
def test_pybullet_as_it_comes_has_none_of_them() -> None:
    model = sm.load("so101", backend="pybullet", defaults="engine")
    names = "mass", "friction", "kp", "kv", "latency", "damping", "limits"
    says = dict.fromkeys(names, "load the model without that to set it")
    says |= {"frictionloss": "ignores", "integrator": "no such setting"}
    refused(*((UnsupportedError, say, partial(model.replace, **{n: 1})) for n, say in says.items()))
    assert "not damping, mass, friction, kp, kv, latency, limits: with" in str(model.capabilities)


@pytest.mark.usefixtures("bullet")
def test_energies_are_those_of_the_changed_mass() -> None:
    from statemachine.lab.recordings.energies import energies

    rows = np.zeros((1, 6)), np.full((1, 6), 0.1)
    models = [model.replace(mass=2 * model.body_mass) for model in on_both("so101")]
    found = [energies(model, "model", *rows)[0] for model in models]
    np.testing.assert_allclose(*found, rtol=1e-12)


def test_energies_that_are_not_known_are_no_numbers_of_both_kinds() -> None:
    from statemachine.lab.recordings.energies import energies

    def cannot_be_read(_model: sm.Model) -> sm.Model:
        raise ModelError("no file")

    rows = np.zeros((3, 6)), np.zeros((3, 6))
    joules, source = energies(sm.load("so101"), "model", *rows, load=cannot_be_read)
    assert (joules.shape, source) == ((3, 2), "")
    assert np.isnan(joules).all()
