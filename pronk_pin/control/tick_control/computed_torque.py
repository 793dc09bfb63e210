"""Computed torque: the model's inverse dynamics at every tick, of the measured state.

    a_j = a_d + 2 omega e' + omega^2 e          joints, with their errors e = q_d - q
    a_b = a_d + 2 omega e_b' + omega^2 e_b      trunk along x and z, in stance
    tau = S (M a + h - J^T lam)                 lam of the smallest |tau| that carries the trunk

The trunk's error is that of legs whose feet stay where they are, `e_b = - mean J_l e_l` over those
that stand: so trunk and joints want the same, wherever a stance has begun. In flight the trunk
falls, whatever is wanted of it. Which feet stand in stance they feel themselves.

It needs no constraint J a + sigma = 0: of the wanted acceleration the ground lets pass what agrees
with it, the nearest one in the metric of M (Gauss), and the forces by which it does that are the
ground's business.

It must know the URDF and the rotors' inertia, and measure the feet's forces beside the joints; of
the trunk's state it needs nothing, as long as the trunk is level. It keeps to the torque limits by
clipping only, and to no friction cone: see `whole_body_qp`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..._checks import Interval, keep_reals
from ..._typing import Array, BoolArray
from ...gait import Gait
from ...robot import Robot
from ..signals import ControlContext
from .level_robot import TRUNK, LevelRobot, cheapest_forces, level_robot
from .tick_controller import Observation, TickController

_CHECKS = {
    "omega": Interval(0, 1000, "1/s", above=True),
    "least_load": Interval(0, 1000, "N", above=True),
}


@dataclass(frozen=True)
class ComputedTorque:
    """Settings of computed torque.

    Attributes:
        omega: Natural frequency at which errors die out, critically damped [1/s].
        least_load: Load from which on a foot counts as standing in stance [N]: where motors are
            late it stands neither as soon nor as long as the schedule says.
    """

    omega: float = 100.0
    least_load: float = 5.0

    def __post_init__(self) -> None:
        keep_reals(self, _CHECKS, "computed torque: ")

    def bind(self, context: ControlContext) -> TickController:
        """The tick controller of the robots of a context.

        Raises:
            InvalidInput: The trunk is not locked, or the rotors of the robot are not known.
        """
        return ComputedTorqueControl(self, context)


class ComputedTorqueControl(TickController):
    """Computed torque of n robots.

    Args:
        settings: Its settings.
        context: Robot, gaits, base and time step.

    Raises:
        InvalidInput: The trunk is not locked, or the rotors of the robot are not known.
    """

    def __init__(self, settings: ComputedTorque, context: ControlContext) -> None:
        robot = level_robot(context.controller, context.robot, context.base)
        self.model = LevelRobot(robot)
        self._omega, self._least_load = settings.omega, settings.least_load
        self._trunk = np.stack(
            [_trunk_acceleration(gait, context) for gait in context.gaits]
        )  # (n, ticks, 2)

    def command(self, observation: Observation) -> Array:
        """See `TickController`."""
        joints, rates, part = observation.joints, observation.joint_rates, observation.part
        standing = observation.load > self._least_load
        if part == 1:
            # A foot that has not left the ground yet, or meets it, is to swing all the same.
            standing[:] = False
        levers = self.model.levers(joints) if standing.any() else None
        error, rate = observation.position - joints, observation.velocity - rates
        wanted = np.zeros((len(joints), TRUNK + joints.shape[1]))
        wanted[:, TRUNK:] = observation.acceleration + self._pull(error, rate)
        flying = np.flatnonzero(~standing.any(axis=1))
        if levers is not None:
            if part == 0:
                wanted[:, :TRUNK] = self._trunk[observation.rows, observation.tick]
            errors = (_trunk_error(levers, each, standing) for each in (error, rate))
            wanted[:, :TRUNK] += self._pull(*errors)
        if flying.size:
            # Of a level trunk the mass matrix is the whole mass.
            wanted[flying, :TRUNK] = 0.0
            needed = self.model.forces(joints[flying], rates[flying], wanted[flying])
            wanted[flying, :TRUNK] = -needed[:, :TRUNK] / self.model.robot.mass
        state = State(joints, rates, levers, standing)
        return self._commanded(self.joint_torque(wanted, state), observation.velocity)

    def _pull(self, error: Array, rate: Array) -> Array:
        """Acceleration by which errors die out, critically damped."""
        return np.asarray(self._omega * (2.0 * rate + self._omega * error))

    def joint_torque(self, wanted: Array, state: State) -> Array:
        """Torques at the joints for wanted accelerations (m, 14) [N m], shape (m, 12)."""
        needed = self.model.forces(state.joints, state.rates, wanted)
        torque = needed[:, TRUNK:]
        if state.levers is None:
            return torque
        force = cheapest_forces(state.levers, needed, state.standing)
        held = np.einsum("mlij,mli->mlj", state.levers, force)
        return np.asarray(torque - held.reshape(torque.shape))

    def _commanded(self, torque: Array, velocity: Array) -> Array:
        """Motor torques for torques at the joints [N m], shape (m, 12).

        Friction is overcome along the reference's rate: along the measured one it would chatter.
        """
        robot: Robot = self.model.robot
        if not robot.parameters.ideal_motors:
            torque = (torque + robot.friction(velocity)) / robot.parameters.torque_constant
        return torque


class State(NamedTuple):
    """State of m robots, and what follows from it."""

    joints: Array
    """Joint angles [rad], shape (m, 12)."""
    rates: Array
    """Joint velocities [rad/s], shape (m, 12)."""
    levers: Array | None
    """See `LevelRobot.levers`, shape (m, legs, 3, 3); None where no foot stands."""
    standing: BoolArray
    """Which feet stand, shape (m, legs)."""


def _trunk_error(levers: Array, error: Array, standing: BoolArray) -> Array:
    """Error of trunks along x and z by the errors (m, 12) of legs that stand, shape (m, 2)."""
    feet = np.einsum("mlij,mlj->mli", levers, error.reshape(*standing.shape, 3))
    count = np.maximum(standing.sum(axis=1, keepdims=True), 1)
    return np.asarray(-(feet * standing[..., None]).sum(axis=1)[:, [0, 2]] / count)


def _trunk_acceleration(gait: Gait, context: ControlContext) -> Array:
    """Acceleration of the trunk along x and z in stance, at each tick [m/s^2], (ticks, 2)."""
    time: Array = np.arange(context.ticks, dtype=np.float64) * context.timestep
    phase = np.minimum(time / gait.stance.duration, 1.0)
    return gait.stance.motion(context.robot, phase).a[:, [0, 2]]
