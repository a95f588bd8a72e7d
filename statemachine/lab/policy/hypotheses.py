"""What may be wrong with a contract: named changes, each of which would mend one fault."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from ...interface import Array
from .contract import (
    ActuatorKind,
    CallTiming,
    Contract,
    Frame,
    ObservedTerm,
    QuatOrder,
    Servos,
    TermId,
)

HypothesisKind = Literal[
    "quaternion order",
    "gyroscope frame",
    "velocity frame",
    "swapped legs",
    "gravity sign",
    "absolute angles",
    "term left out",
    "speed scale",
    "action scale",
    "delay",
    "clock",
    "policy rate",
    "servos",
]

# What speeds, and the speeds that are asked for, are usually multiplied by, from legged_gym on: one
# number for all, or one for each.
_USUAL_SCALES: Final[dict[TermId, tuple[float, ...]]] = {
    "joint_vel_rel": (0.05,),
    "base_ang_vel": (0.25,),
    "base_lin_vel": (2.0,),
    "velocity_commands": (2.0, 2.0, 0.25),
}
_ACTION_FACTOR: Final = 4.0  # 0.25 rad and 1 rad are the usual scales of actions
_SIDES: Final = (("left", "right"), ("FL", "FR"), ("RL", "RR"), ("L_", "R_"), ("Left", "Right"))
_FRONTS: Final = (("front", "rear"), ("front", "hind"), ("FL", "RL"), ("FR", "RR"))


@dataclass(frozen=True)
class ContractHypothesis:
    """What may be wrong with a contract, and the contract without it.

    Attributes:
        kind: Which sort of fault.
        term: Name of the term of the observation that it is in; "" for none.
        before: What the contract says; "" where `after` says it all.
        after: What it would say.
        contract: The contract with that change.
    """

    kind: HypothesisKind
    term: str
    before: str
    after: str
    contract: Contract


def hypotheses_of(contract: Contract) -> tuple[ContractHypothesis, ...]:
    """Return what may be wrong with a contract, as far as it applies to it."""
    return tuple(
        hypothesis
        for generate in (
            _quaternion_order,
            _frames,
            _swapped_legs,
            _gravity_sign,
            _absolute_angles,
            _terms_left_out,
            _speed_scales,
            _action_scales,
            _delays,
            _clocks,
            _policy_rates,
            _servos,
        )
        for hypothesis in generate(contract)
    )


def with_term(contract: Contract, term: ObservedTerm, changed: ObservedTerm) -> Contract:
    """Return a contract with another term in place of one."""
    terms = tuple(changed if known is term else known for known in contract.terms)
    return replace(contract, terms=terms)


def _quaternion_order(contract: Contract) -> Iterator[ContractHypothesis]:
    before = contract.quat_order
    after: QuatOrder = "xyzw" if before == "wxyz" else "wxyz"
    changed = replace(contract, quat_order=after)
    yield ContractHypothesis("quaternion order", "", before, after, changed)


def _frames(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield each velocity in the other axes."""
    for term in contract.terms:
        if term.id not in ("base_lin_vel", "base_ang_vel"):
            continue
        kind: HypothesisKind = "velocity frame"
        if term.id == "base_ang_vel":
            kind = "gyroscope frame"
        after: Frame = "world" if term.frame == "body" else "body"
        changed = with_term(contract, term, replace(term, frame=after))
        yield ContractHypothesis(kind, term.name, term.frame, after, changed)


def _swapped_legs(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield joints that are read from the other side, or from the other half of the list."""
    encoders = [term for term in contract.terms if term.id in ("joint_pos_rel", "joint_vel_rel")]
    if not encoders:
        return
    orders = {
        "left and right": _exchanged(contract.joints, _SIDES),
        "front and rear": _exchanged(contract.joints, _FRONTS),
        "the two halves of the list": _halves(contract.joints),
    }
    seen: list[Sequence[str]] = [contract.joints]
    for name, order in orders.items():
        if order is None or order in seen:
            continue
        seen.append(order)
        changed = contract
        for term in encoders:
            changed = with_term(changed, term, _read_from(contract, term, order))
        yield ContractHypothesis("swapped legs", "", "", name, changed)


def _read_from(contract: Contract, term: ObservedTerm, order: Sequence[str]) -> ObservedTerm:
    """Return a term whose joints are exchanged as an order exchanges those of the policy.

    An exchange of a term that is exchanged already gives the order of the policy again. Where
    angles are told from zero they stay so.
    """
    partner = dict(zip(contract.joints, order, strict=True))
    told = tuple(partner[joint] for joint in term.joints or contract.joints)
    reference = term.reference
    if reference is not None and reference.any():
        reference = contract.default_joint_pos[[contract.joints.index(joint) for joint in told]]
    joints = () if told == contract.joints else told
    return replace(term, joints=joints, reference=reference)


def _exchanged(joints: Sequence[str], pairs: Sequence[tuple[str, str]]) -> tuple[str, ...] | None:
    """Return each joint's partner by its name; None where one has none."""
    partners: list[str] = []
    for joint in joints:
        partner = joint
        for one, other in pairs:
            if one in joint or other in joint:
                partner = _swapped(joint, one, other)
                break
        if partner not in joints:
            return None
        partners.append(partner)
    return tuple(partners)


def _swapped(joint: str, one: str, other: str) -> str:
    """Return a name with one word for the other, and the other way round."""
    if one in joint:
        return joint.replace(one, other)
    return joint.replace(other, one)


def _halves(joints: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return joints with the second half of the list first; None of an odd number."""
    half, rest = divmod(len(joints), 2)
    return None if rest else joints[half:] + joints[:half]


def _gravity_sign(contract: Contract) -> Iterator[ContractHypothesis]:
    for term in contract.terms:
        if term.id == "projected_gravity":
            changed = with_term(contract, term, replace(term, scale=-term.scale))
            yield ContractHypothesis("gravity sign", term.name, "", "the other sign", changed)


def _absolute_angles(contract: Contract) -> Iterator[ContractHypothesis]:
    for term in contract.terms:
        if term.reference is None:
            continue
        order = [contract.joints.index(joint) for joint in term.joints or contract.joints]
        is_relative = bool(term.reference.any())
        reference: Array = contract.default_joint_pos[order]
        if is_relative:
            reference = np.zeros(len(order))
        names = ("from the default pose", "from zero")
        before, after = names if is_relative else names[::-1]
        changed = with_term(contract, term, replace(term, reference=reference))
        yield ContractHypothesis("absolute angles", term.name, before, after, changed)


def _usual_scale(term: ObservedTerm) -> Array | None:
    """Return what a term is usually multiplied by, (dim,); None where nothing is usual."""
    usual = _USUAL_SCALES.get(term.id)
    return None if usual is None else np.resize(np.array(usual), term.dim)


def _scale_text(scale: Array) -> str:
    """Return a scale as it is read: one number where all are equal."""
    if (scale == scale[0]).all():
        return f"{scale[0]:g}"
    return ", ".join(f"{number:g}" for number in scale)


def _terms_left_out(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield each term that is told as zero, as it is or as it is usually scaled.

    The last action, which not every policy is told, is also yielded as zero.
    """
    for term in contract.terms:
        if not term.scale.any():
            ones, usual = np.ones(term.dim), _usual_scale(term)
            for scale in (ones,) if usual is None else (ones, usual):
                changed = with_term(contract, term, replace(term, scale=scale))
                after = f"times {_scale_text(scale)}"
                yield ContractHypothesis("term left out", term.name, "zero", after, changed)
        elif term.id == "last_action":
            changed = with_term(contract, term, replace(term, scale=np.zeros(term.dim)))
            yield ContractHypothesis("term left out", term.name, "told", "zero", changed)


def _speed_scales(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield velocities with their usual scale where they have none, and without where they have."""
    for term in contract.terms:
        usual = _usual_scale(term)
        if usual is None or not term.scale.any():
            continue
        is_unscaled = bool((term.scale == 1.0).all())
        scale = usual if is_unscaled else np.ones(term.dim)
        changed = with_term(contract, term, replace(term, scale=scale))
        texts = _scale_text(term.scale), _scale_text(scale)
        yield ContractHypothesis("speed scale", term.name, *texts, changed)


def _action_scales(contract: Contract) -> Iterator[ContractHypothesis]:
    for factor in (_ACTION_FACTOR, 1.0 / _ACTION_FACTOR):
        action = replace(contract.action, scale=contract.action.scale * factor)
        changed = replace(contract, action=action)
        before = f"{contract.action.scale[0]:g}"
        yield ContractHypothesis("action scale", "", before, f"{action.scale[0]:g}", changed)


def _delays(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield actions that act one or two calls later, or at once where they are late."""
    before = contract.action.delay_steps
    later = [0] if before else [1, 2]
    for after in later:
        changed = replace(contract, action=replace(contract.action, delay_steps=after))
        yield ContractHypothesis("delay", "", str(before), str(after), changed)


def _clocks(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield a clock twice as fast, half as fast, and half a period later."""
    for term in contract.terms:
        clock = term.clock
        if clock is None or not term.scale.any():
            continue
        half = round(0.5 * clock.period / contract.timing.policy_dt)
        clocks = {"half a period later": replace(clock, offset_steps=clock.offset_steps + half)}
        for period in (0.5 * clock.period, 2.0 * clock.period):
            clocks[f"{period:g} s"] = replace(clock, period=period)
        for after, changed_clock in clocks.items():
            changed = with_term(contract, term, replace(term, clock=changed_clock))
            yield ContractHypothesis("clock", term.name, f"{clock.period:g} s", after, changed)


def _policy_rates(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield a policy that is called twice or half as often, at the same timestep."""
    timing = contract.timing
    decimation = timing.decimation
    faster: list[tuple[int, int]] = [(2, 1)]
    if decimation is not None and decimation % 2 == 0:
        faster.append((1, 2))
    for more, less in faster:
        steps = None if decimation is None else decimation * more // less
        changed_timing = CallTiming(timing.policy_dt * more / less, steps)
        changed = replace(contract, timing=changed_timing)
        before, after = 1.0 / timing.policy_dt, 1.0 / changed_timing.policy_dt
        yield ContractHypothesis("policy rate", "", f"{before:g} Hz", f"{after:g} Hz", changed)


def _servos(contract: Contract) -> Iterator[ContractHypothesis]:
    """Yield torques that are computed by the other of both ways, where the gains are known."""
    servos: Servos = contract.servos
    if servos.kp is None or servos.kd is None or servos.kind is None:
        return
    after: ActuatorKind = "explicit_pd"
    if servos.kind == "explicit_pd":
        after = "implicit_pd"
    changed = replace(contract, servos=replace(servos, kind=after))
    yield ContractHypothesis("servos", "", servos.kind, after, changed)
