"""Strides of the planar model, which pronks on tapes as the simulation does, by rigid contacts.

Feet roll without slipping until the ground would have to pull, and touchdown is a plastic impact.
A state holds the coordinates x, z and the joints, their rates, and the estimate of the speed, 29 in
all with twelve joints; x is 0 at every touchdown, since no place is like another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._checks import instance_of
from ..._typing import Array
from ...dynamics import Rotors, planar_acceleration, planar_impact
from ...errors import InvalidInput
from ...gait import Gait
from ...kinematics import foot_positions, leg_geometry
from ...robot import NB, Robot, as_robot
from ..feedback import LegAngleRegulator
from ..signals import SAMPLES, Gains, phase_grid, resample

_STRIDES = 40
_SETTLED = 1e-4
_LONGEST_FLIGHT = 2.0
_HALF = 0.5
"""Phase of stance before which feet do not lift off, and of flight before which none lands."""


class StrideSettings(NamedTuple):
    """Settings of a controller that shape its planar strides; see `ControllerSpec`.

    `share` is the part of the gait's torque that acts as feedforward on the orbit: 0 before
    learning, and about 1 after it. How long the feet stay on the ground past the planned
    lift-off changes in between, and with it the answers; 0.6 predicts whole learnings best.
    """

    gains: Gains = Gains()
    regulator: LegAngleRegulator = LegAngleRegulator()
    speed_filter: float = 0.02
    touchdown_ticks: int = 2
    timestep: float = 0.001
    share: float = 0.6


class PlayedPhase(NamedTuple):
    """States and torques of a played phase, tick by tick."""

    states: Array
    """States before each tick and after the last, shape (ticks + 1, 29)."""
    torques: Array
    """Motor torques at the ticks, shape (ticks, 12)."""
    standing: list[bool]
    """Whether the feet stood on the ground, at each tick."""


class PlanarStrides:
    """Strides of the planar model under one controller.

    Args:
        robot: The robot.
        gait: The gait.
        settings: The controller's.
        rotors: Rotor inertia and friction of the joints beyond the URDF.

    Attributes:
        free: Number of coordinates that the planar constraint leaves free: x, z, joints.
        speed: Index of the speed estimate in the state, after the coordinates and their rates.
        place: The coordinates in the state.
        rate: Their rates in it.
        thigh: Change of the joint angles as the legs turn back by one radian, shape (12,).
    """

    def __init__(self, robot: Robot, gait: Gait, settings: StrideSettings, rotors: Rotors) -> None:
        as_robot(robot)
        instance_of("gait", gait, Gait)
        instance_of("settings", settings, StrideSettings)
        instance_of("rotors", rotors, Rotors)
        self.robot, self.gait, self.settings, self.rotors = robot, gait, settings, rotors
        gains, dt = settings.gains, settings.timestep
        self.kp, self.kd = gains.proportional(robot.nu), gains.derivative(robot.nu)
        self.free = 2 + robot.nu
        self.speed = 2 * self.free
        self.place, self.rate = slice(0, self.free), slice(self.free, self.speed)
        sense = leg_geometry(robot).sense
        self.thigh = (sense * np.array([0.0, 1.0, 0.0])).ravel()
        self.ticks = round(gait.stance.duration / dt)
        s = np.arange(self.ticks, dtype=np.float64) * (dt / gait.stance.duration)
        self.stance, self.stance_rate = gait.stance.joint_reference(s)
        self.set_feedforward(settings.share * gait.stance.motion(robot, phase_grid()).tau)
        longest = round(_LONGEST_FLIGHT * gait.flight.duration / dt)
        self.flight_phase = np.minimum(np.arange(longest) * dt / gait.flight.duration, 1.0)
        self.flight, self.flight_rate = gait.flight.joint_reference(self.flight_phase)
        self.flight_rate[self.flight_phase >= 1.0] = 0.0
        self.share, rate = settings.regulator.profile(self.flight_phase)
        self.share_rate = rate / gait.flight.duration
        self.lift_off_speed = gait.stance.base_reference(np.array([1.0]))[1][0, 0]

    def set_feedforward(self, feedforward: Array) -> None:
        """Set the feedforward of the stances from now on, (samples, 12) [N m]."""
        self.torque = self.at_ticks(feedforward)

    def at_ticks(self, curves: Array) -> Array:
        """Resample curves on the phase grid (samples, m) to the ticks of a stance, (ticks, m)."""
        phase = np.arange(self.ticks, dtype=np.float64) * self.settings.timestep
        index = (phase / self.gait.stance.duration) * (SAMPLES - 1)
        played = np.asarray(resample(curves[None], index[None])[0], dtype=np.float64)
        played[: self.settings.touchdown_ticks] = 0.0  # not felt yet
        return played

    def on_grid(self, values: Array) -> Array:
        """Resample what was measured at the ticks of a stance (ticks, ...) to the phase grid.

        As `PhaseLog.index`: on t / T of the reference, held at the first and last felt tick.
        """
        index = phase_grid() * (self.gait.stance.duration / self.settings.timestep)
        index = np.clip(index, self.settings.touchdown_ticks, self.ticks - 1.0)
        return np.asarray(resample(values[None], index[None])[0])

    def stance_errors(self, stance: PlayedPhase) -> tuple[Array, Array]:
        """Joint errors [rad] and rates [rad/s] of a stance on the phase grid, (samples, 12)."""
        states = stance.states[:-1]
        return (
            self.on_grid(self.stance - states[:, 2 : self.free]),
            self.on_grid(self.stance_rate - states[:, self.free + 2 : self.speed]),
        )

    def orbit(self) -> tuple[PlayedPhase, PlayedPhase, Array]:
        """Find the periodic orbit: stance, flight, and the state at touchdown before the impact.

        Strides are played until the state at touchdown repeats.

        Raises:
            InvalidInput: It does not repeat.
        """
        start = self.gait.stance.motion(self.robot, np.array([0.0]))
        base, joints, rate = start.q[0][[0, 2]], start.q[0][NB + 1 :], start.v[0]
        speed = rate[:1]
        state = np.concatenate([base, joints, rate[[0, 2]], rate[NB:], speed])
        for _ in range(_STRIDES):
            stance = self.play_stance(state)
            flight, landing = self.play_flight(stance.states[-1], stance.standing[-1])
            following = self.impact(landing)
            change = np.abs(following - state).max()
            if change < _SETTLED:
                return stance, flight, landing
            state = following
        raise InvalidInput(
            f"the model does not settle on an orbit at {self.gait.speed:g} m/s "
            f"(it still changes by {change:.2g}); choose other gains or another gait"
        )

    def play_stance(self, state: Array) -> PlayedPhase:
        """Play one stance from a state at touchdown."""
        states, torques = [state], []
        standing: list[bool] = []
        stands = True
        share = self.settings.timestep / (self.settings.speed_filter + self.settings.timestep)
        for tick in range(self.ticks):
            error = self.stance[tick] - state[2 : self.free]
            rate = self.stance_rate[tick] - state[self.free + 2 : self.speed]
            torques.append(self.torque[tick] + self.kp * error + self.kd * rate)
            estimate = state[self.speed] + share * (state[self.free] - state[self.speed])
            # Early in stance feet that would have to be pulled are about to be pressed down again.
            bound = tick < _HALF * self.ticks
            state, stands = self.step(state, torques[-1], stands, bound=bound)
            state[self.speed] = estimate
            states.append(state)
            standing.append(stands)
        return PlayedPhase(np.array(states), np.array(torques), standing)

    def play_flight(self, state: Array, stands: bool) -> tuple[PlayedPhase, Array]:
        """Play one flight until the feet are down: its whole ticks, and the state at touchdown."""
        states, torques = [state], []
        standing: list[bool] = []
        turn = float(self.settings.regulator.turn(state[self.speed] - self.lift_off_speed))
        thigh = self.thigh
        for tick in range(len(self.flight)):
            error = self.flight[tick] + self.share[tick] * turn * thigh - state[2 : self.free]
            rate = self.flight_rate[tick] + self.share_rate[tick] * turn * thigh
            rate = rate - state[self.free + 2 : self.speed]
            torques.append(self.kp * error + self.kd * rate)
            following, stands = self.step(state, torques[-1], stands)
            above, below = (self.height(self.q(at)) for at in (state, following))
            if self.flight_phase[tick] > _HALF and below <= 0.0:
                part = above / (above - below)
                landing = state + part * (following - state)
                return PlayedPhase(np.array(states), np.array(torques)[:-1], standing), landing
            state = following
            states.append(state)
            standing.append(stands)
        raise InvalidInput(
            f"the model does not touch down at {self.gait.speed:g} m/s; choose higher gains"
        )

    def step(
        self, state: Array, torque: Array, stands: bool, *, bound: bool = False
    ) -> tuple[Array, bool]:
        """Integrate one tick by semi-implicit Euler; feet stand until the ground would pull.

        Feet that are bound to the ground stand even then.
        """
        dt, q, v = self.settings.timestep, self.q(state), self.v(state)
        a, force = planar_acceleration(
            self.robot, q, v, torque, contact="rolling" if stands else None, rotors=self.rotors
        )
        if stands and force < 0.0 and not bound:
            stands = False
            a, _ = planar_acceleration(self.robot, q, v, torque, rotors=self.rotors)
        following = state.copy()
        following[self.rate] += dt * a
        following[self.place] += dt * following[self.rate]
        return following, stands

    def impact(self, state: Array) -> Array:
        """State at the beginning of stance, after the impact, from that at the end of flight."""
        after = state.copy()
        after[self.rate] = planar_impact(
            self.robot, self.q(state), state[None, self.rate], contact="rolling", rotors=self.rotors
        )[0]
        after[0] = 0.0
        return after

    def height(self, q: Array) -> float:
        """Mean height of the feet over the ground [m]."""
        return float(foot_positions(self.robot, q)[:, 2].mean() - self.robot.foot_radius)

    def q(self, state: Array) -> Array:
        """Configuration, shape (19,)."""
        q = np.zeros(self.robot.nq)
        q[0], q[2], q[6], q[NB + 1 :] = state[0], state[1], 1.0, state[2 : self.free]
        return q

    def v(self, state: Array) -> Array:
        """Velocity, shape (18,)."""
        v = np.zeros(self.robot.nv)
        v[[0, 2]], v[NB:] = np.split(state[self.rate], [2])
        return v
