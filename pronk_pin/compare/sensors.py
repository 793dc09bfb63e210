"""What the robot measures of itself: encoders, an IMU on the trunk, force sensors in the feet."""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from typing import NamedTuple

import numpy as np

from .._typing import Array, IntArray
from ..errors import InvalidInput


@dataclass(frozen=True)
class Sensors:
    """How far the sensors are from the truth; all zero, the default, is the truth itself.

    Noise is white: independent at each tick, normal, of these standard deviations. A bias is drawn
    once for each robot and axis, normal too, and stays.

    Attributes:
        encoder_noise: Of the joint angles [rad].
        encoder_bias: Of the joint angles [rad]: the zeros of the encoders.
        rate_noise: Of the joint velocities [rad/s].
        gyro_noise: Of the trunk's angular velocity [rad/s].
        gyro_bias: Of the trunk's angular velocity [rad/s].
        accelerometer_noise: Of the trunk's specific force [m/s^2].
        accelerometer_bias: Of the trunk's specific force [m/s^2].
        force_noise: Of each axis of the force on a foot [N].
    """

    encoder_noise: float = 0.0
    encoder_bias: float = 0.0
    rate_noise: float = 0.0
    gyro_noise: float = 0.0
    gyro_bias: float = 0.0
    accelerometer_noise: float = 0.0
    accelerometer_bias: float = 0.0
    force_noise: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            if not 0.0 <= getattr(self, name) < np.inf:
                raise InvalidInput(f"sensors: {name} must be finite and not negative")

    @property
    def perfect(self) -> bool:
        """Whether what they say is the truth."""
        return not any(astuple(self))

    def scaled(self, factor: float) -> Sensors:
        """Sensors that are so many times as bad."""
        return replace(self, **{n: factor * getattr(self, n) for n in self.__dataclass_fields__})


class Reading(NamedTuple):
    """What m robots measure at one instant, or what is true of them then.

    The trunk's axes point forward, left and up.
    """

    joints: Array
    """Joint angles [rad], shape (m, 12)."""
    joint_rates: Array
    """Joint velocities [rad/s], shape (m, 12)."""
    force: Array
    """Ground's force on each foot, world frame [N], shape (m, 4, 3)."""
    angular_velocity: Array
    """Of the trunk, in the trunk's frame [rad/s], shape (m, 3)."""
    specific_force: Array
    """Acceleration of the trunk's origin less gravity, in the trunk's frame [m/s^2], shape (m, 3):
    about (0, 0, 9.81) at rest, zero in free fall."""


class SensorSuite:
    """The sensors of n robots: biases that stay, noise that is drawn at each reading.

    Args:
        sensors: How bad they are.
        n: Number of robots.
        rng: Source of biases and noise. Each robot has a stream of its own, spawned from it, so
            that what one robot measures does not depend on how often the others are asked.
    """

    def __init__(self, sensors: Sensors, n: int, rng: np.random.Generator) -> None:
        self.sensors = sensors
        self._streams = rng.spawn(n)
        self._bias = np.stack([stream.standard_normal(18) for stream in self._streams])
        self._bias *= np.repeat(
            [sensors.encoder_bias, sensors.gyro_bias, sensors.accelerometer_bias], [12, 3, 3]
        )
        self._scale = np.repeat(
            [
                sensors.encoder_noise,
                sensors.rate_noise,
                sensors.gyro_noise,
                sensors.accelerometer_noise,
                sensors.force_noise,
            ],
            [12, 12, 3, 3, 12],
        )

    def read(self, rows: IntArray, truth: Reading) -> Reading:
        """What some of the robots measure of the truth."""
        if self.sensors.perfect:
            return truth
        noise = np.stack([self._streams[row].standard_normal(len(self._scale)) for row in rows])
        noise *= self._scale
        angle, rate, gyro, accelerometer, force = np.split(noise, [12, 24, 27, 30], axis=1)
        bias = self._bias[rows]
        return Reading(
            joints=truth.joints + angle + bias[:, :12],
            joint_rates=truth.joint_rates + rate,
            force=truth.force + force.reshape(truth.force.shape),
            angular_velocity=truth.angular_velocity + gyro + bias[:, 12:15],
            specific_force=truth.specific_force + accelerometer + bias[:, 15:],
        )
