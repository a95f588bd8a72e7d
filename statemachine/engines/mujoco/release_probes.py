"""What a release of MuJoCo does where releases are known to differ; run by the Python of each.

    python -I release_probes.py          prints a JSON object: a number for each probe

Nothing of ours is imported: a release has a Python of its own. What a release cannot do is null.
"""

import json

import mujoco
import numpy as np

KP, KV, LIMIT, INERTIA, TIMESTEP = 10.0, 2.0, 1.0, 0.01, 0.01

SERVO = f"""<mujoco><option timestep="{TIMESTEP}" integrator="{{integrator}}" gravity="0 0 0"/>
<worldbody><body><joint name="hinge" axis="0 1 0"/>
<inertial mass="1" pos="0 0 0" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body></worldbody>
<actuator><general joint="hinge" biastype="affine" gainprm="{KP}" biasprm="0 -{KP} -{KV}"
 forcelimited="true" forcerange="-{LIMIT} {LIMIT}"/></actuator></mujoco>"""

TURN = 0.9  # rad
LINK = """<link name="{name}"><inertial><mass value="1"/><origin xyz="0 0 0" rpy="0 0 {turn}"/>
<inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}" type="continuous"><parent link="base"/><child link="{name}"/>
<axis xyz="0 1 0"/>{mimic}</joint>"""
URDF = '<robot name="probe"><link name="base"/>{links}</robot>'
MIMIC = '<mimic joint="first" multiplier="-1"/>'

TOUCH = """<mujoco><worldbody><geom type="box" size="0.1 0.1 0.1"/>
<body pos="{place}" euler="{turn}"><freejoint/><geom type="{shape}" size="0.1 0.1 0.1"/></body>
</worldbody></mujoco>"""


def kv_in_derivative(integrator):
    """Return the part of kv that an integrator has in its derivative of a servo at its limit.

    A step from rest gives v = h F / (I + h c kv), where F is the limit and c is that part.
    """
    model = mujoco.MjModel.from_xml_string(SERVO.format(integrator=integrator))
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data)
    return float((TIMESTEP * LIMIT / data.qvel[0] - INERTIA) / (TIMESTEP * KV))


def couplings_of_mimic():
    """Return how many equality constraints come of a <mimic> in a URDF."""
    links = LINK.format(name="first", turn=0, mimic="")
    links += LINK.format(name="second", turn=0, mimic=MIMIC)
    return int(mujoco.MjModel.from_xml_string(URDF.format(links=links)).neq)


def product_of_turned_inertia():
    """Return ixy [kg m²] of a link of a URDF whose inertial is turned about z."""
    links = LINK.format(name="first", turn=TURN, mimic="")
    model = mujoco.MjModel.from_xml_string(URDF.format(links=links))
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body("first").iquat)
    axes = axes.reshape(3, 3)
    return float((axes @ np.diag(model.body("first").inertia) @ axes.T)[0, 1])


def points_of_contact(shape, place, turn):
    """Return at how many points a shape touches a box."""
    model = mujoco.MjModel.from_xml_string(TOUCH.format(shape=shape, place=place, turn=turn))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return int(data.ncon)


PROBES = {
    "implicit": lambda: kv_in_derivative("implicit"),
    "implicitfast": lambda: kv_in_derivative("implicitfast"),
    "mimic": couplings_of_mimic,
    "turned inertial": product_of_turned_inertia,
    "box on box": lambda: points_of_contact("box", "0.1 0.1 0.12", "30 40 20"),
    "cylinder on box": lambda: points_of_contact("cylinder", "0.1 0.1 0.19", "0 0 0"),
}


def measured():
    """Return what each probe measures; None where the release cannot run it."""
    values = {}
    for name, probe in PROBES.items():
        try:
            values[name] = probe()
        except Exception:  # whatever an older release raises
            values[name] = None
    return values


if __name__ == "__main__":
    print(json.dumps(measured()))
