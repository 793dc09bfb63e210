"""The lifted model of a gait: its strides under feedback, linearised tick by tick.

The model pronks as the simulation does, on tapes, but by Pinocchio's rigid contacts: feet that roll
without slipping until the ground would have to pull, and a plastic impact. It settles on an orbit
near the gait, and along that orbit its strides are linearised.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._typing import Array
from ..errors import InvalidInput
from ..gait import Gait
from ..kinematics import foot_positions
from ..robot import NB, NL, Robot
from .guided import (
    NO_ROTORS,
    Rotors,
    guided_acceleration,
    guided_derivatives,
    guided_impact,
)
from .lifted import LiftedModel
from .record import SAMPLES, phase_grid, resample
from .regulation import LegAngleRegulator
from .tape import Gains

_FREE = 2 + NL
"""Coordinates that the guide leaves free: x, z, joints."""
_SPEED = 2 * _FREE
"""Place of the speed estimate in the state, after the coordinates and their rates."""
_STATES = _SPEED + 1
_PLACE, _RATE = slice(0, _FREE), slice(_FREE, _SPEED)
_STRIDES = 40
_SETTLED = 1e-4
_STEP = 1e-6
_LONGEST_FLIGHT = 2.0


class Settings(NamedTuple):
    """What a controller does that matters for its strides; see `ControllerSpec`.

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


class _Phase(NamedTuple):
    """A phase as it was played: states and torques at its ticks, and what ended it."""

    states: Array
    """States before each tick and after the last, shape (ticks + 1, 29)."""
    torques: Array
    """Motor torques at the ticks, shape (ticks, 12)."""
    standing: list[bool]
    """Whether the feet stood on the ground, at each tick."""


def lifted_model(
    robot: Robot, gait: Gait, settings: Settings, *, rotors: Rotors = NO_ROTORS
) -> LiftedModel:
    """The lifted model of a gait: what changes of the feedforward do, to first order.

    The state at touchdown holds the coordinates x, z and the joints, their rates, and the estimate
    of the speed, 29 in all; x is 0 at every touchdown, since no place is like another.

    Args:
        robot: The robot.
        gait: The gait.
        settings: The controller's.
        rotors: What the joints add to the URDF.

    Raises:
        InvalidInput: The model does not settle on an orbit near the gait.
    """
    return _Strides(robot, gait, settings, rotors).lifted()


class _Strides:
    """The strides of the model under one controller."""

    def __init__(self, robot: Robot, gait: Gait, settings: Settings, rotors: Rotors) -> None:
        self.robot, self.gait, self.settings, self.rotors = robot, gait, settings, rotors
        gains, dt = settings.gains, settings.timestep
        self.kp, self.kd = gains.proportional, gains.derivative
        self.ticks = round(gait.stance.duration / dt)
        s = np.arange(self.ticks, dtype=np.float64) * (dt / gait.stance.duration)
        self.stance, self.stance_rate = gait.stance.joint_reference(s)
        self.torque = settings.share * gait.stance.motion(robot, s).tau
        self.torque[: settings.touchdown_ticks] = 0.0  # not felt yet
        longest = round(_LONGEST_FLIGHT * gait.flight.duration / dt)
        self.flight_phase = np.minimum(np.arange(longest) * dt / gait.flight.duration, 1.0)
        self.flight, self.flight_rate = gait.flight.joint_reference(self.flight_phase)
        self.flight_rate[self.flight_phase >= 1.0] = 0.0
        self.share, rate = settings.regulator.profile(self.flight_phase)
        self.share_rate = rate / gait.flight.duration
        self.lift_off_speed = gait.stance.base_reference(np.array([1.0]))[1][0, 0]

    def lifted(self) -> LiftedModel:
        """The lifted model along the orbit."""
        stance, flight, landing = self.orbit()
        late, dt = self.settings.touchdown_ticks, self.settings.timestep
        duration = self.gait.stance.duration
        phase = np.arange(self.ticks, dtype=np.float64) * (dt / duration)
        play = resample(np.eye(SAMPLES)[None], (phase * (SAMPLES - 1))[None])[0]
        play[:late] = 0.0  # not felt yet
        inputs = np.kron(play, np.eye(NL)).reshape(self.ticks, NL, -1)
        pushed, started = _propagate(self.steps(stance, odometry=True), inputs)
        # As `PhaseLog.index`: on t / T of the reference, held at the first and last felt tick.
        measured = np.clip(phase_grid() * duration / dt, late, self.ticks - 1.0)[None]

        def on_grid(values: Array) -> Array:
            return np.asarray(
                resample(values[None, : self.ticks], measured)[0].reshape(SAMPLES * NL, -1)
            )

        onward = self.touchdown(landing, len(flight.torques)) @ self.flown(flight)
        joints, rates = slice(2, _FREE), slice(_FREE + 2, _SPEED)
        return LiftedModel(
            angle=on_grid(pushed[:, joints]),
            rate=on_grid(pushed[:, rates]),
            angle_start=on_grid(started[:, joints]),
            rate_start=on_grid(started[:, rates]),
            carry=onward @ started[-1],
            push=onward @ pushed[-1],
            gains=self.settings.gains,
            torque=self.gait.stance.motion(self.robot, phase_grid()).tau,
        )

    def orbit(self) -> tuple[_Phase, _Phase, Array]:
        """Stance, flight, and the state at touchdown before the impact, once they repeat."""
        start = self.gait.stance.motion(self.robot, np.array([0.0]))
        base, joints, rate = start.q[0][[0, 2]], start.q[0][NB + 1 :], start.v[0]
        speed = rate[:1]
        state = np.concatenate([base, joints, rate[[0, 2]], rate[NB:], speed])
        for _ in range(_STRIDES):
            stance = self.play_stance(state)
            flight, landing = self.play_flight(stance.states[-1], stance.standing[-1])
            following = self.impact(landing)
            missed = np.abs(following - state).max()
            if missed < _SETTLED:
                return stance, flight, landing
            state = following
        raise InvalidInput(
            f"the model does not settle on an orbit at {self.gait.speed:g} m/s "
            f"(it still changes by {missed:.2g}); choose other gains or another gait"
        )

    def play_stance(self, state: Array) -> _Phase:
        """One stance from a state at touchdown."""
        states, torques = [state], []
        standing: list[bool] = []
        stands = True
        share = self.settings.timestep / (self.settings.speed_filter + self.settings.timestep)
        for tick in range(self.ticks):
            error = self.stance[tick] - state[2:_FREE]
            rate = self.stance_rate[tick] - state[_FREE + 2 : _SPEED]
            torques.append(self.torque[tick] + self.kp * error + self.kd * rate)
            estimate = state[_SPEED] + share * (state[_FREE] - state[_SPEED])
            state, stands = self.step(state, torques[-1], stands)
            state[_SPEED] = estimate
            states.append(state)
            standing.append(stands)
        return _Phase(np.array(states), np.array(torques), standing)

    def play_flight(self, state: Array, stands: bool) -> tuple[_Phase, Array]:
        """One flight until the feet are down: its whole ticks, and the state at touchdown."""
        states, torques = [state], []
        standing: list[bool] = []
        turn = float(self.settings.regulator.turn(state[_SPEED] - self.lift_off_speed))
        thigh = np.tile([0.0, 1.0, 0.0], NL // 3)
        for tick in range(len(self.flight)):
            error = self.flight[tick] + self.share[tick] * turn * thigh - state[2:_FREE]
            rate = self.flight_rate[tick] + self.share_rate[tick] * turn * thigh
            rate = rate - state[_FREE + 2 : _SPEED]
            torques.append(self.kp * error + self.kd * rate)
            following, stands = self.step(state, torques[-1], stands)
            above, below = (self.height(self.q(one)) for one in (state, following))
            if self.flight_phase[tick] > 0.5 and below <= 0.0:
                part = above / (above - below)
                landing = state + part * (following - state)
                return _Phase(np.array(states), np.array(torques)[:-1], standing), landing
            state = following
            states.append(state)
            standing.append(stands)
        raise InvalidInput(
            f"the model does not touch down at {self.gait.speed:g} m/s; choose higher gains"
        )

    def step(self, state: Array, torque: Array, stands: bool) -> tuple[Array, bool]:
        """One tick, semi-implicit Euler; feet that stand do so until the ground would pull."""
        dt, q, v = self.settings.timestep, self.q(state), self.v(state)
        a, force = guided_acceleration(
            self.robot, q, v, torque, contact="rolling" if stands else None, rotors=self.rotors
        )
        if stands and force < 0.0:
            stands = False
            a, _ = guided_acceleration(self.robot, q, v, torque, rotors=self.rotors)
        following = state.copy()
        following[_RATE] += dt * a
        following[_PLACE] += dt * following[_RATE]
        return following, stands

    def impact(self, state: Array) -> Array:
        """The state at which stance begins, from that at which flight ends."""
        after = state.copy()
        after[_RATE] = guided_impact(
            self.robot, self.q(state), state[None, _RATE], contact="rolling", rotors=self.rotors
        )[0]
        after[0] = 0.0
        return after

    def steps(self, phase: _Phase, *, odometry: bool) -> list[tuple[Array, Array]]:
        """A tick of the state under feedback, (29, 29), and its input, (29, 12), at each tick."""
        dt, steps = self.settings.timestep, []
        share = dt / (self.settings.speed_filter + dt)
        kp, kd = _on_joints(self.kp), _on_joints(self.kd)
        for state, torque, stands in zip(
            phase.states[:-1], phase.torques, phase.standing, strict=True
        ):
            at = guided_derivatives(
                self.robot,
                self.q(state),
                self.v(state),
                torque,
                contact="rolling" if stands else None,
                rotors=self.rotors,
            )
            move, push = np.eye(_STATES), np.zeros((_STATES, NL))
            move[_RATE, _PLACE] = dt * (at.da_dy - at.da_dtau @ kp)
            move[_RATE, _RATE] += dt * (at.da_dv - at.da_dtau @ kd)
            push[_RATE] = dt * at.da_dtau
            if odometry:  # leg odometry, filtered
                move[_SPEED, _SPEED], move[_SPEED, _FREE] = 1.0 - share, share
            move[_PLACE] += dt * move[_RATE]
            push[_PLACE] = dt * push[_RATE]
            steps.append((move, push))
        return steps

    def flown(self, flight: _Phase) -> Array:
        """The state at the last tick of flight by that at lift-off, legs turned by the speed."""
        ticks = len(flight.torques)
        thigh = np.tile([0.0, 1.0, 0.0], NL // 3)
        # A turn of the reference by one radian acts as the feedback's torque does.
        turned = self.share[:ticks, None] * self.kp * thigh
        turned = turned + self.share_rate[:ticks, None] * self.kd * thigh
        pushed, started = _propagate(self.steps(flight, odometry=False), turned[..., None])
        end = started[-1].copy()
        end[:, _SPEED] += self.settings.regulator.gain * pushed[-1, :, 0]
        return np.asarray(end)

    def touchdown(self, landing: Array, tick: int) -> Array:
        """The state at which stance begins by that at the last tick of flight, (29, 29)."""
        step = _STEP * np.eye(_STATES)[: _FREE + _FREE]
        q = self.q(landing)
        height = np.array(
            [(self.height(self.q(landing + d)) - self.height(self.q(landing - d))) for d in step]
        ) / (2.0 * _STEP)
        # Where the feet are higher by dh, touchdown is later by dh / (speed of their coming down).
        a, _ = guided_acceleration(
            self.robot,
            q,
            self.v(landing),
            self.kp * (self.flight[tick] - landing[2:_FREE])
            + self.kd * (self.flight_rate[tick] - landing[_FREE + 2 : _SPEED]),
            rotors=self.rotors,
        )
        rates = np.concatenate([landing[_RATE], a, [0.0]])
        later = np.eye(_STATES)
        later[:, : 2 * _FREE] -= np.outer(rates, height) / (height[:_FREE] @ landing[_RATE])
        stop = np.stack(
            [
                (self.impact(landing + d) - self.impact(landing - d)) / (2.0 * _STEP)
                for d in _STEP * np.eye(_STATES)
            ],
            axis=1,
        )
        return np.asarray(stop @ later)

    def height(self, q: Array) -> float:
        """Mean height of the feet over the ground [m]."""
        return float(foot_positions(self.robot, q)[:, 2].mean() - self.robot.foot_radius)

    def q(self, state: Array) -> Array:
        """Configuration, shape (19,)."""
        q = np.zeros(NB + 1 + NL)
        q[0], q[2], q[6], q[NB + 1 :] = state[0], state[1], 1.0, state[2:_FREE]
        return q

    def v(self, state: Array) -> Array:
        """Velocity, shape (18,)."""
        v = np.zeros(NB + NL)
        v[0], v[2], v[NB:] = state[_FREE], state[_FREE + 1], state[_FREE + 2 : _SPEED]
        return v


def _propagate(steps: list[tuple[Array, Array]], inputs: Array) -> tuple[Array, Array]:
    """The states at each tick, and after the last: by the inputs, and by the first state.

    Args:
        steps: The ticks.
        inputs: What pushes at each tick, shape (ticks, 12, m).

    Returns:
        Shapes (ticks + 1, 29, m) and (ticks + 1, 29, 29).
    """
    pushed = np.zeros((len(steps) + 1, _STATES, inputs.shape[2]))
    started = np.repeat(np.eye(_STATES)[None], len(steps) + 1, axis=0)
    for tick, (state, push) in enumerate(steps):
        pushed[tick + 1] = state @ pushed[tick] + push @ inputs[tick]
        started[tick + 1] = state @ started[tick]
    return pushed, started


def _on_joints(gains: Array) -> Array:
    """Diagonal gains that read the joints among the free coordinates, shape (12, 14)."""
    return np.hstack([np.zeros((NL, _FREE - NL)), np.diag(gains)])
