"""Mismatches between model and world, by name; `compare.world.scenario` combines them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ...robot import ROBOTS
from .sensors import Sensors

NOISE = Sensors(
    encoder_noise=0.0005,
    encoder_bias=0.002,
    rate_noise=0.05,
    gyro_noise=0.02,
    gyro_bias=0.005,
    accelerometer_noise=0.3,
    accelerometer_bias=0.1,
    force_noise=3.0,
)
"""Sensors as on a robot of this class, before any filter."""


@dataclass(frozen=True)
class Mismatch:
    """One mismatch between model and world.

    Attributes:
        text: What it is.
        value: Its value where a name gives none.
        unit: Unit of the value.
        changes: What a value does: attributes of `Scenario`.
    """

    text: str
    value: float
    unit: str
    changes: Callable[[float], Mapping[str, Any]]


def _of(attribute: str) -> Callable[[float], Mapping[str, Any]]:
    """The value is that of one attribute."""
    return lambda value: {attribute: value}


def _front(mass: float) -> Mapping[str, Any]:
    return {"payload": mass, "payload_position": (0.15, 0.0, 0.06)}


def _slow(speed: float) -> Mapping[str, Any]:
    return {"full_torque_speed": 0.5 * speed, "no_load_speed": speed}


def _push(impulse: float) -> Mapping[str, Any]:
    return {"push_impulse": (impulse, 0.0, 0.0)}


def _side(impulse: float) -> Mapping[str, Any]:
    return {"push_impulse": (0.0, impulse, 0.0)}


KNOWN = {
    "payload": Mismatch("mass on the trunk", 3.0, "kg", _of("payload")),
    "payload-front": Mismatch("mass at the front of the trunk", 3.0, "kg", _front),
    "com-shift": Mismatch(
        "trunk's centre of mass forward", 0.03, "m", lambda x: {"com_shift": (x, 0.0, 0.0)}
    ),
    "weak-motors": Mismatch("torque given over asked for", 0.85, "1", _of("torque_constant")),
    "armature": Mismatch(
        "rotor inertia at the joint", 2 * ROBOTS["a1"].rotors[0], "kg m^2", _of("armature")
    ),
    "damping": Mismatch("viscous friction", 0.5, "N m s/rad", _of("damping")),
    "coulomb": Mismatch("Coulomb friction", 0.6, "N m", _of("coulomb")),
    "soft-ground": Mismatch("time constant of contact", 0.01, "s", _of("ground_time_constant")),
    "slippery": Mismatch("friction of feet on ground", 0.2, "1", _of("ground_friction")),
    "slope": Mismatch("slope, uphill where positive", 0.1, "rad", _of("slope")),
    "steps": Mismatch("greatest height of steps", 0.01, "m", _of("step_height")),
    "gravity": Mismatch("gravitational acceleration", 8.8, "m/s^2", _of("gravity")),
    "delay": Mismatch("delay of the motors", 0.004, "s", _of("delay")),
    "slow-motors": Mismatch("no-load speed of the joints", 12.0, "rad/s", _slow),
    "noise": Mismatch(
        "noise and bias of the sensors, over those of `NOISE`",
        1.0,
        "1",
        lambda factor: {"sensors": NOISE.scaled(factor)},
    ),
    "late-touchdown": Mismatch(
        "contact sensor later to tell of a touchdown", 0.003, "s", _of("touchdown_latency")
    ),
    "touchdown-jitter": Mismatch(
        "contact sensor up to so much later, drawn for each touchdown",
        0.004,
        "s",
        _of("touchdown_jitter"),
    ),
    "rough": Mismatch(
        "standard deviation of the ground's height, with half of the noise of `NOISE`",
        0.002,
        "m",
        lambda height: {"ground_roughness": height, "sensors": NOISE.scaled(0.5)},
    ),
    "push": Mismatch("push forward and back, every 4.1 s", 3.0, "N s", _push),
    "push-side": Mismatch("push to the left and right, every 4.1 s", 1.5, "N s", _side),
}
"""Mismatches by name."""

MISMATCHES = (
    *("payload", "weak-motors", "armature", "damping", "coulomb"),
    *("soft-ground", "slippery", "slope", "delay"),
)
"""The laboratory's list: single mismatches of the nominal scenario, each in reach of the gaits."""
