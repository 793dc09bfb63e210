"""Actuators of a MuJoCo model: kinds, gains and limits at the joint they act on."""

from __future__ import annotations

import mujoco
import numpy as np

from .._typing import Array

_AT_A_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def joint_actuators(model: mujoco.MjModel) -> list[int]:
    """Actuators that act on joints."""
    return [i for i, kind in enumerate(model.actuator_trntype) if kind in _AT_A_JOINT]


def through_gears(model: mujoco.MjModel, name: str, drives: list[int], gears: list[float]) -> float:
    """A property of the actuators as it acts at their joint; MuJoCo 3 has none such."""
    values = getattr(model, name, np.zeros(len(model.actuator_trntype)))
    return float(sum(gear**2 * values[index] for index, gear in zip(drives, gears, strict=True)))


def actuator_kind(model: mujoco.MjModel, drives: list[int]) -> tuple[str | None, float | None]:
    """The kind of a joint's actuator, and the torque per unit of control of a motor."""
    if not drives:
        return ("none", None) if len(model.actuator_trntype) else (None, None)
    if len(drives) > 1:
        return f"{len(drives)} actuators", None
    index = drives[0]
    gain, bias = model.actuator_gainprm[index], model.actuator_biasprm[index][:3]
    affine = model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_AFFINE
    if not affine:
        bias = np.zeros(3)
    plain = (
        model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_dyntype[index] == mujoco.mjtDyn.mjDYN_NONE
        and (affine or model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_NONE)
    )
    if not plain or bias[0] != 0.0:
        return "general", None
    if not bias.any():
        return "motor", float(gain[0] * model.actuator_gear[index, 0])
    if bias[1] == -gain[0]:
        return f"position servo, kp {gain[0]:g}, kv {0.0 - bias[2]:g}", None
    if bias[1] == 0.0 and bias[2] == -gain[0]:
        return f"velocity servo, kv {gain[0]:g}", None
    return "general", None


def torque_limits(
    model: mujoco.MjModel, joint: int, drives: list[int], gain: float | None
) -> Array:
    """Torque limits of a joint's actuator, by whichever limit is the tightest."""
    ranges = [np.array([-np.inf, np.inf])]
    if model.jnt_actfrclimited[joint]:
        ranges.append(model.jnt_actfrcrange[joint])
    if len(drives) == 1:
        index = drives[0]
        if model.actuator_forcelimited[index]:
            ranges.append(model.actuator_forcerange[index] * model.actuator_gear[index, 0])
        if gain is not None and model.actuator_ctrllimited[index]:
            ranges.append(model.actuator_ctrlrange[index] * gain)
    both = np.sort(np.array(ranges), axis=1)  # a negative gear turns a range over
    return np.array([both[:, 0].max(), both[:, 1].min()])
