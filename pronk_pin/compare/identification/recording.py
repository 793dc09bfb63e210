"""The last strides of a simulation, tick by tick, as motions in Pinocchio's layout.

A state at tick j is the one before step j, and the torque at tick j acts during step j. A step is
semi-implicit: its acceleration is the difference of the velocities around it, at the
configuration before it, and friction acts on the velocity after it. A torque stamped a tick late,
or a velocity half a tick, would spoil every estimate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import xarray as xr

from ..._typing import Array
from ...errors import InvalidInput
from ...robot import NB, Robot, recorded_robot
from ..world import Scenario
from .model_terms import LONGEST_DELAY, Motion

PARTS = ("stance", "flight")
"""Phases of a stride in pronking."""
_SHORTEST = 0.8
"""Strides shorter than this share of the others' are left out."""
FEWEST = 2
"""Strides that are needed: the noise of one is told from the motion by another."""
_SLIDING = 0.02
"""Width of the step from -1 to 1 in the direction of motion [rad/s]."""


@dataclass(frozen=True)
class PhaseRecording:
    """A phase of k strides at one speed, cut to the ticks that all of them have.

    Attributes:
        part: "stance" or "flight".
        joints: Joint angles [rad], shape (k, ticks + 1, 12).
        rates: Joint velocities [rad/s], shape (k, ticks + 1, 12).
        torque: Torques that the motors were told [N m], shape (k, ticks + 1, 12).
        before: Torques that the motors were told in the last ticks before the phase [N m], oldest
            first, shape (k, before, 12).
        feedforward: The part of `torque` that was feedforward [N m], shape (k, ticks + 1, 12).
        base: Place of the trunk, x and z [m], shape (k, ticks + 1, 2).
        base_rate: Velocity of the trunk along x and z [m/s], shape (k, ticks + 1, 2).
        fall: Acceleration of the trunk along x and z as an IMU has it [m/s^2], (k, ticks, 2): the
            specific force that it measures, and the gravity of the model. On a slope, along which
            the trunk is held, it is not that of the place.
        timestep: [s]
    """

    part: str
    joints: Array
    rates: Array
    torque: Array
    before: Array
    feedforward: Array
    base: Array
    base_rate: Array
    fall: Array
    timestep: float

    @property
    def strides(self) -> int:
        """Number of strides."""
        return len(self.joints)

    @property
    def lean(self) -> Array:
        """Gravity of the model less that of the world, along x and z [m/s^2], shape (2,)."""
        moving = np.diff(self.base_rate, axis=1) / self.timestep
        return np.asarray((self.fall - moving).mean(axis=(0, 1)))

    @property
    def ticks(self) -> int:
        """Steps of a stride."""
        return int(self.fall.shape[1])

    def torque_after(self, delay: float) -> Array:
        """Torques of motors that are late by so much [N m], shape (k, ticks, 12).

        Between ticks of the commands they are interpolated.

        Args:
            delay: At most the time that `before` covers [s].
        """
        commanded = np.concatenate([self.before, self.torque], axis=1)
        whole, part = divmod(delay / self.timestep, 1.0)
        first = self.before.shape[1] - int(whole)
        now = commanded[:, first : first + self.ticks]
        if part == 0.0:
            return np.asarray(now)
        earlier = commanded[:, first - 1 : first - 1 + self.ticks]
        return np.asarray((1.0 - part) * now + part * earlier)

    def motion(self, robot: Robot) -> Motion:
        """The motion of all strides, one after the other, n = k ticks."""
        k, ticks, dt = self.strides, self.ticks, self.timestep
        place = np.zeros((k, ticks, 3))  # where the robot is does not matter
        v, a = np.zeros((2, k, ticks, robot.nv))
        v[..., [0, 2]], v[..., NB:] = self.base_rate[:, :-1], self.rates[:, :-1]
        a[..., [0, 2]], a[..., NB:] = self.fall, np.diff(self.rates, axis=1) / dt
        # The rates of all strides, and of neighbouring ticks, tell the direction through the noise.
        smooth = scipy.ndimage.uniform_filter1d(self.rates[:, 1:].mean(axis=0), 5, axis=0)
        direction = np.broadcast_to(np.tanh(smooth / _SLIDING), (k, *smooth.shape))
        motion = Motion(
            q=robot.q_from_base(place, self.joints[:, :-1]),
            v=v,
            a=a,
            sliding=self.rates[:, 1:],
            direction=direction,
            tau=self.torque[:, :-1],
        )
        return Motion(*(x.reshape(k * ticks, -1) for x in motion))

    def of_ticks(self, values: Array) -> Array:
        """Values of all strides one after the other (k ticks, ...), by stride, (k, ticks, ...)."""
        return values.reshape(self.strides, self.ticks, *values.shape[1:])


def recordings(
    strides: xr.Dataset,
    *,
    parts: tuple[str, ...] = PARTS,
    imu_noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> dict[float, tuple[PhaseRecording, ...]]:
    """The last strides of each speed, stance and flight, as far as they are whole.

    Args:
        strides: A cell of a result, with the variables `tick_...`.
        parts: Which phases.
        imu_noise: Standard deviation of noise added to the trunk's acceleration [m/s^2].
        rng: Source of that noise.

    Raises:
        InvalidInput: The result has no ticks, or no speed has two whole strides.
    """
    if "tick_joints" not in strides:
        raise InvalidInput(
            "this result has no ticks, which explain reads; run 'pronk-pin compare' again"
        )
    timestep, lean = float(strides.attrs["timestep"]), _lean(strides)
    history = int(np.ceil(LONGEST_DELAY / timestep)) + 2
    by_speed: dict[float, tuple[PhaseRecording, ...]] = {}
    for k, speed in enumerate(strides["speed"].to_numpy()):
        of_speed = strides.isel(speed=k)
        first = of_speed["tick_joint_rates"].sel(part=list(parts)).isel(joint=0)
        ticks = np.isfinite(first.transpose("last", "part", "tick").to_numpy()).sum(axis=-1)
        usual = np.median(ticks, axis=0)  # (parts,)
        whole = np.flatnonzero((ticks > _SHORTEST * usual).all(axis=1) & (usual > 1.0).all())
        if len(whole) < FEWEST:
            continue
        by_speed[float(speed)] = tuple(
            _recording(
                of_speed.isel(last=whole).sel(part=part),
                part,
                int(ticks[whole, column].min()),
                timestep,
                _torque_before(of_speed["tick_torque"], part, history)[whole],
                lean,
                imu_noise,
                rng,
            )
            for column, part in enumerate(parts)
        )
    if not by_speed:
        raise InvalidInput(f"no speed has {FEWEST} whole strides at its end; explain a longer run")
    return by_speed


def _torque_before(torque: xr.DataArray, part: str, count: int) -> Array:
    """The last torques before a part of each stride of one speed, shape (last, count, 12).

    Before a stance they are those of the flight of the stride before. Where that was not recorded,
    as with the first stride, the next stride's stand in.
    """
    other = PARTS[1 - PARTS.index(part)]
    values = torque.sel(part=other).transpose("last", "tick", "joint").to_numpy().astype(float)
    before = np.full((len(values), count, values.shape[-1]), np.nan)
    for row, of_stride in enumerate(values):
        known = of_stride[np.isfinite(of_stride).all(axis=-1)][-count:]
        before[row, count - len(known) :] = known
    if part == PARTS[0]:
        before[1:], before[0] = before[:-1].copy(), np.nan
    rows = range(len(before) - 1)
    for row, neighbour in [*((k, k + 1) for k in rows[::-1]), *((k + 1, k) for k in rows)]:
        before[row] = np.where(np.isnan(before[row]), before[neighbour], before[row])
    return np.asarray(np.nan_to_num(before))


def _lean(strides: xr.Dataset) -> Array:
    """Model's gravity less the simulated scenario's, along x and z [m/s^2], shape (2,)."""
    model = recorded_robot(strides.attrs).model.gravity.linear
    try:
        world = Scenario.from_json(strides.attrs["scenario_parameters"]).gravity_vector
    except (KeyError, InvalidInput):  # strides of a robot
        return np.zeros(2)
    return np.asarray(model - np.array(world))[[0, 2]]


def _recording(
    strides: xr.Dataset,
    part: str,
    ticks: int,
    timestep: float,
    before: Array,
    lean: Array,
    imu_noise: float,
    rng: np.random.Generator | None,
) -> PhaseRecording:
    def values(name: str, last: str) -> Array:
        array = strides[f"tick_{name}"].transpose("last", "tick", last).to_numpy()
        return np.asarray(array[:, :ticks], dtype=float)

    base_rate = values("base_rate", "axis")
    fall = np.diff(base_rate, axis=1) / timestep + lean
    if imu_noise > 0.0:
        rng = np.random.default_rng() if rng is None else rng
        fall = fall + imu_noise * rng.standard_normal(fall.shape)
    return PhaseRecording(
        part=part,
        joints=values("joints", "joint"),
        rates=values("joint_rates", "joint"),
        torque=values("torque", "joint"),
        before=before,
        feedforward=values("feedforward", "joint"),
        base=values("base", "axis"),
        base_rate=base_rate,
        fall=fall,
        timestep=timestep,
    )
