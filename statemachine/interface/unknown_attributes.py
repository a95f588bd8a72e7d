"""What is said of an attribute that a Model or a Data does not have.

Somebody who knows MuJoCo types its names; somebody who does not misspells ours. Imported only then.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..errors import did_you_mean
from .records import DERIVED, INPUTS, MOCAP, OPTIONS

# MuJoCo's names of what has another name here, and names that are of no attribute: what to write.
_OF_MODEL = {
    "opt": "model.replace(timestep=…, gravity=…, actuation=…)",
    "jnt_names": "model.joint_names",
    "jnt_name": "model.joint_names",
    "names": "model.joint_names, model.body_names, model.site_names …",
    "joint": "model.joint_id(name)",
    "jnt": "model.joint_id(name)",
    "jnt_id": "model.joint_id(name)",
    "body": "model.body_id(name)",
    "site": "model.site_id(name)",
    "geom": "model.geom_id(name)",
    "actuator": "model.actuator_id(name)",
    "key": "model.key_id(name)",
    "nkey": "len(model.keyframes)",
    "key_time": "model.keyframes[k].time",
    "key_qpos": "model.keyframes[k].qpos",
    "key_qvel": "model.keyframes[k].qvel",
    "key_ctrl": "model.keyframes[k].ctrl",
    "jnt_dofnum": "JointType(model.jnt_type[k]).nv",
    "actuator_trnid": "model.actuator_jntid",
    "actuator_gainprm": "model.actuator_kp",
    "actuator_biasprm": "model.actuator_kp and model.actuator_kv",
    "dt": "model.timestep",
}
_OF_DATA = {
    "joint": "data.qpos[model.jnt_qposadr[model.joint_id(name)]]",
    "site": "data.site_xpos[model.site_id(name)]",
    "body": "data.xpos[model.body_id(name)]",
    "actuator": "data.ctrl[model.actuator_id(name)]",
    "site_pos": "data.site_xpos[model.site_id(name)]",
    "body_pos": "data.xpos[model.body_id(name)]",
    "body_xpos": "data.xpos[model.body_id(name)]",
    "contact": "data.contacts",
    "ncon": "len(data.contacts)",
    "t": "data.time",
}
# The verbs are functions of the package.
_VERBS = {
    "step": "sm.step(model, data)",
    "forward": "sm.forward(model, data)",
    "reset": "sm.reset(model, data)",
    "get_state": "sm.get_state(model, data)",
    "set_state": "sm.set_state(model, data, state)",
    "make_data": "sm.make_data(model)",
}
# MuJoCo's functions and classes, where somebody looks for them in this package.
OF_PACKAGE = {
    "MjModel": "sm.load(name)",
    "MjData": "sm.make_data(model)",
    "mj_step": "sm.step(model, data)",
    "mj_forward": "sm.forward(model, data)",
    "mj_resetData": "sm.reset(model, data)",
    "mj_resetDataKeyframe": "sm.reset(model, data, keyframe=k)",
    "mj_name2id": "model.joint_id(name), model.body_id(name) …",
    "mj_id2name": "model.joint_names[k], model.body_names[k] …",
    "mj_getState": "sm.get_state(model, data)",
    "mj_setState": "sm.set_state(model, data, state)",
}
_OWN_DATA_NAMES = (*INPUTS, *MOCAP, *DERIVED, "time", "contacts")


def no_attribute(owner: object, kind: str, name: str, raw: object) -> AttributeError:
    """Return the error for an attribute that a Model or Data does not have, with what to write.

    Args:
        owner: The Model or the Data.
        kind: "Model" or "Data".
        name: Of the attribute.
        raw: The engine's own object, whose attribute may have been meant.
    """
    text = f"a {kind} has no attribute {name!r}{_hint(owner, kind, name, raw)}"
    return AttributeError(text, name=name)  # without `obj`: Python would guess once more


def _hint(owner: object, kind: str, name: str, raw: object) -> str:
    """Return the end of the error's text; arguments as of `no_attribute`."""
    variable = kind.lower()
    instead = {**_VERBS, **(_OF_MODEL if kind == "Model" else _OF_DATA)}
    has_raw = hasattr(raw, name)
    if name in instead:
        own = f"; the engine's own is {variable}.raw.{name}" if has_raw else ""
        return f": write {instead[name]}{own}"
    if kind == "Model" and name in OPTIONS:
        return f": model.replace({name}=…) gives another Model with it"
    if kind == "Model" and name in _OWN_DATA_NAMES:
        return f": a Data has it, data.{name}"
    if kind == "Data" and name in _public_names(getattr(owner, "_model", None)):
        return f": a Model has it, model.{name}"
    if has_raw:
        return f"; the engine's own is {variable}.raw.{name}"
    return did_you_mean(name, _public_names(owner), 0.6, show=f"{variable}.{{}}".format)


def _public_names(owner: object) -> Iterable[str]:
    """Return the attributes of a Model or Data that are for users."""
    return [known for known in dir(owner) if not known.startswith("_")]
