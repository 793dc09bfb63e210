"""Sensor models: joint encoders, an IMU on the trunk, force sensors in the feet."""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import numpy as np

from ..._checks import NOT_NEGATIVE, Interval, instance_of, keep_reals, real, whole
from ..._typing import Array, IntArray

_LIMITS = {
    "encoder_noise": Interval(0, 1, "rad"),
    "encoder_bias": Interval(0, 1, "rad"),
    "rate_noise": Interval(0, 100, "rad/s"),
    "gyro_noise": Interval(0, 100, "rad/s"),
    "gyro_bias": Interval(0, 100, "rad/s"),
    "accelerometer_noise": Interval(0, 1000, "m/s^2"),
    "accelerometer_bias": Interval(0, 1000, "m/s^2"),
    "force_noise": Interval(0, 10_000, "N"),
}
"""Beyond these a sensor tells nothing."""

_LATENESS = Interval(0, 10_000, "ticks")


@dataclass(frozen=True)
class Sensors:
    """Errors of the sensors: `measured = true + bias + noise`; all zero, the default, is the truth.

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
        keep_reals(self, _LIMITS, "sensors: ")

    @property
    def perfect(self) -> bool:
        """Whether what they say is the truth."""
        return not any(astuple(self))

    def scaled(self, factor: float) -> Sensors:
        """Sensors with all errors scaled by a factor."""
        factor = real("factor of the sensors", factor, NOT_NEGATIVE)
        return replace(self, **{n: factor * getattr(self, n) for n in self.__dataclass_fields__})


class SensorSuite:
    """The sensors of n robots: biases that stay, noise that is drawn at each reading.

    Each robot has a stream of its own, so that what one measures does not depend on how often the
    others are asked.

    Args:
        sensors: How far they are from the truth.
        n: Number of robots.
        rng: Source of the streams, which are spawned from it.
        joints: Number of joints of each.
        latency: Ticks by which touchdowns are sensed late.
        jitter: Greatest number of ticks that come on top, drawn for each touchdown.
    """

    def __init__(
        self,
        sensors: Sensors,
        n: int,
        rng: np.random.Generator,
        *,
        joints: int = 12,
        latency: int = 0,
        jitter: int = 0,
    ) -> None:
        instance_of("rng", rng, np.random.Generator, "a numpy.random.Generator")
        n = whole("n", n, Interval(1, 100_000))
        self.sensors = instance_of("sensors", sensors, Sensors)
        self._latency = whole("latency", latency, _LATENESS)
        self._jitter = whole("jitter", jitter, _LATENESS)
        self._streams = rng.spawn(n)
        self._touchdown_streams = rng.spawn(n)  # the same, however many ticks are played at once
        biases = np.stack([stream.standard_normal(joints + 6) for stream in self._streams])
        self._encoder_bias = sensors.encoder_bias * biases[:, :joints]
        scale = np.repeat([sensors.gyro_bias, sensors.accelerometer_bias], 3)
        self._imu_bias = scale * biases[:, joints:]

    def encoders(self, rows: IntArray, joints: Array, rates: Array) -> tuple[Array, Array]:
        """Measure joint angles [rad] and velocities [rad/s] of some robots at one tick.

        Args:
            rows: Which robots, shape (m,).
            joints: True joint angles [rad], shape (m, 12).
            rates: True joint velocities [rad/s], shape (m, 12).
        """
        angle, rate = self._noise(rows, (2, joints.shape[1])).swapaxes(0, 1)
        angle = self.sensors.encoder_noise * angle + self._encoder_bias[rows]
        return joints + angle, rates + self.sensors.rate_noise * rate

    def feet(self, rows: IntArray, force: Array) -> Array:
        """Measure the ground's forces on the feet [N], shape (m, ..., 3)."""
        return force + self.sensors.force_noise * self._noise(rows, force.shape[1:])

    def touchdown_lateness(self, rows: IntArray) -> IntArray:
        """Draw by how many ticks the next touchdowns of some robots are sensed late, shape (m,)."""
        streams = (self._touchdown_streams[row] for row in rows)
        jitter = [stream.integers(self._jitter, endpoint=True) for stream in streams]
        return self._latency + np.array(jitter, dtype=np.intp)

    def imu(self, rows: IntArray, turning: Array, specific_force: Array) -> tuple[Array, Array]:
        """Measure angular velocity and specific force over some ticks, in the trunk's frame.

        Args:
            rows: Which robots, shape (m,).
            turning: True angular velocity of the trunk [rad/s], shape (m, ticks, 3).
            specific_force: True acceleration of its origin less gravity [m/s^2], shape
                (m, ticks, 3): (0, 0, 9.81) at rest, zero in free fall.
        """
        noise = self._noise(rows, (2, *turning.shape[1:])).swapaxes(0, 1)
        gyro, accelerometer = noise
        bias = self._imu_bias[rows][:, None]
        return (
            turning + self.sensors.gyro_noise * gyro + bias[..., :3],
            specific_force + self.sensors.accelerometer_noise * accelerometer + bias[..., 3:],
        )

    def at_rest(self, ticks: int, gravity: Array) -> tuple[Array, Array]:
        """Measure by all IMUs, see `imu`, over ticks in which robots lie still on the ground."""
        still = np.zeros((len(self._streams), ticks, 3))
        return self.imu(np.arange(len(still)), still, still - gravity)

    def _noise(self, rows: IntArray, shape: tuple[int, ...]) -> Array:
        return np.stack([self._streams[row].standard_normal(shape) for row in rows])
