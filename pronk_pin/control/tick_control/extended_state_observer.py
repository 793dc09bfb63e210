"""Extended state observer: planned torques and feedback, less the disturbance that is estimated.

Active disturbance rejection (Han, 2009) on the rates' deviation `nu = v - v_d` from the reference,
in which the planned torque `ff` and the planned motion cancel:

    nu' = B u + d,  d' = 0            u = tau - ff, as commanded after clipping
    tau = ff + Kp e + Kd e' - B^-1 d_hat

The input gain B (12, 12) is that of legs below a trunk that is free along x and z, tabulated along
the gait. With the mass matrix M, rotors included, S that picks the joints, the coupling L of trunk
and joints, and the whole mass m:

    B = S M^-1 S^T = (M_joints - L^T L / m)^-1

In stance too: what the ground does there beyond the plan counts as disturbance. Feet that were held
for good (J a = 0, which leaves rank 2) would leave a gain many times smaller,

    B_c = S (M^-1 - M^-1 J^T (J M^-1 J^T)^-1 J M^-1) S^T

But deviations at touchdown do not die out as B_c says: impact and ground take most of them away. An
observer with B_c takes that for a disturbance, works against it with large torques, and doubles the
errors of the nominal scenario. With B it works less: at low frequencies `(1 + w / 2s)` times the
feedback, an integral action, less `w / 2` times the momentum `B^-1 nu`.

The observer is linear, of second order in each joint, with both poles at the bandwidth w, and exact
for ticks of dt: with p = exp(-w dt), the innovation `nu - nu_hat` is weighted by 1 - p^2 for nu_hat
and by (1 - p)^2 / dt for d_hat (2 w dt and w^2 dt where ticks are short). It measures joint rates
only. At the first tick of each part of the stride it begins anew, without a disturbance: what feet
meet in stance says nothing of the flight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._checks import Interval, keep_reals
from ..._typing import Array, IntArray
from ...gait import Gait
from ...robot import Robot
from ..signals import PARTS, ControlContext, clip_torque
from .level_robot import TRUNK, LevelRobot, level_robot
from .tick_controller import Observation, TickController

_NODES = 33
"""Phases of each part at which B is tabulated; the nearest is used."""


@dataclass(frozen=True)
class ExtendedStateObserver:
    """Settings of the extended state observer; the feedback gains are the controller's.

    Attributes:
        bandwidth: That of the observer [rad/s]; 0 estimates no disturbance, and leaves the torques
            of feedforward and feedback. The mean felt peak over `nominal`, `payload`, `weak-motors`
            and `delay` at -0.3, 0.3 and 0.8 m/s is 12 to 13 mrad from 20 to 60 rad/s: faster is
            better where motors are not late, and worse where they are.
    """

    bandwidth: float = 40.0

    def __post_init__(self) -> None:
        within = Interval(0, 1000, "rad/s")
        keep_reals(self, {"bandwidth": within}, "extended state observer: ")

    def bind(self, context: ControlContext) -> TickController:
        """The tick controller of the robots of a context.

        Raises:
            InvalidInput: The trunk is not locked, or the rotors of the robot are not known.
        """
        return ExtendedStateObserverControl(self, context)


class ExtendedStateObserverControl(TickController):
    """Feedforward, feedback and compensation of the disturbance, of n robots.

    Args:
        settings: The observer's settings.
        context: Robot, gaits, gains, base and time step.

    Attributes:
        disturbance: Estimated accelerations of the joints that the model does not explain
            [rad/s^2], shape (n, 12).

    Raises:
        InvalidInput: The trunk is not locked, or the rotors of the robot are not known.
    """

    def __init__(self, settings: ExtendedStateObserver, context: ControlContext) -> None:
        robot = level_robot(context.controller, context.robot, context.base)
        self._gains, self._tau_max, self._dt = context.gains, robot.tau_max, context.timestep
        pole = np.exp(-settings.bandwidth * context.timestep)
        self._corrections = 1.0 - pole**2, (1.0 - pole) ** 2 / context.timestep
        self._inertia = np.stack([effective_inertia(robot, gait) for gait in context.gaits])
        self._gain = np.linalg.inv(self._inertia)  # B, (n, 2, nodes, 12, 12)
        n, joints = len(context.gaits), self._gain.shape[-1]
        self.disturbance, self._deviation = np.zeros((2, n, joints))
        self._part, self._next = np.full((2, n), -1, dtype=np.intp)

    def command(self, observation: Observation) -> Array:
        """See `TickController`; in the start-up nothing is estimated."""
        rows, part, feedforward = observation.rows, observation.part, observation.feedforward
        rate = observation.velocity - observation.joint_rates
        feedback = self._gains.feedback(observation.position - observation.joints, rate)
        if part is None:
            return clip_torque(feedback, feedforward, self._tau_max)
        self._correct(part, rows, observation.tick, -rate)
        node = np.rint(observation.phase * (_NODES - 1)).astype(np.intp)
        disturbance = self.disturbance[rows]
        feedback -= (self._inertia[rows, part, node] @ disturbance[..., None])[..., 0]
        torque = clip_torque(feedback, feedforward, self._tau_max)
        beyond = (torque - feedforward)[..., None]
        explained = (self._gain[rows, part, node] @ beyond)[..., 0]
        self._deviation[rows] += self._dt * (explained + disturbance)
        return torque

    def _correct(self, part: int, rows: IntArray, tick: int, deviation: Array) -> None:
        """Correct the estimates by the measured deviation of rates [rad/s], shape (m, 12)."""
        begins = (self._part[rows] != part) | (self._next[rows] != tick)
        self._part[rows], self._next[rows] = part, tick + 1
        # A sensor that fails says nothing.
        known = np.where(np.isfinite(deviation), deviation, self._deviation[rows])
        self._deviation[rows[begins]] = known[begins]
        self.disturbance[rows[begins]] = 0.0
        innovation = known - self._deviation[rows]
        of_rate, of_disturbance = self._corrections
        self._deviation[rows] += of_rate * innovation
        self.disturbance[rows] += of_disturbance * innovation


def effective_inertia(robot: Robot, gait: Gait) -> Array:
    """Inertia of the joints below a trunk that is free along x and z, B^-1 [kg m^2 a motor torque].

    Along the gait, shape (2, nodes, 12, 12): stance and flight.
    """
    model, phases = LevelRobot(robot), np.linspace(0.0, 1.0, _NODES)
    joints = [getattr(gait, part).joint_reference(phases)[0] for part in PARTS]
    mass = np.stack([model.mass_matrix(each) for each in joints])  # (2, nodes, 14, 14)
    # Of a level trunk the mass matrix is the whole mass.
    coupling = mass[..., :TRUNK, TRUNK:]
    inertia = mass[..., TRUNK:, TRUNK:] - np.swapaxes(coupling, -1, -2) @ coupling / robot.mass
    return np.asarray(inertia / robot.parameters.torque_constant)
