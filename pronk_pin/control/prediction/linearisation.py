"""Lifted model of a gait: its strides under feedback, linearised tick by tick.

The planar model settles on an orbit near the gait, and along that orbit its strides are linearised.
"""

from __future__ import annotations

import numpy as np

from ..._typing import Array
from ...dynamics import NO_ROTORS, Rotors, planar_acceleration, planar_derivatives
from ...gait import Gait
from ...robot import Robot
from ..learning import LiftedModel
from ..signals import SAMPLES, phase_grid
from .planar_strides import PlanarStrides, PlayedPhase, StrideSettings

_STEP = 1e-6


def lifted_model(
    robot: Robot, gait: Gait, settings: StrideSettings, *, rotors: Rotors = NO_ROTORS
) -> LiftedModel:
    """Compute the lifted model of a gait: the first-order response to changes of the feedforward.

    The state at touchdown holds the coordinates x, z and the joints, their rates, and the estimate
    of the speed, 29 in all; x is 0 at every touchdown, since no place is like another.

    Args:
        robot: The robot.
        gait: The gait.
        settings: The controller's.
        rotors: Rotor inertia and friction of the joints beyond the URDF.

        Raises:
        InvalidInput: The model does not settle on an orbit near the gait.
    """
    return _Linearised(robot, gait, settings, rotors).lifted()


class _Linearised(PlanarStrides):
    """Strides of the planar model, and their linearisation."""

    def lifted(self) -> LiftedModel:
        """The lifted model along the orbit."""
        stance, flight, landing = self.orbit()
        joints, played = self.robot.nu, self.at_ticks(np.eye(SAMPLES))
        inputs = np.kron(played, np.eye(joints)).reshape(self.ticks, joints, -1).astype(float)
        by_input, by_state = _propagate(self.steps(stance, odometry=True), inputs)

        def on_grid(values: Array) -> Array:
            return self.on_grid(values[: self.ticks]).reshape(SAMPLES * joints, -1)

        to_touchdown = self.touchdown(landing, len(flight.torques)) @ self.flown(flight)
        angles, rates = slice(2, self.free), slice(self.free + 2, self.speed)
        return LiftedModel(
            angle=on_grid(by_input[:, angles]),
            rate=on_grid(by_input[:, rates]),
            angle_start=on_grid(by_state[:, angles]),
            rate_start=on_grid(by_state[:, rates]),
            A=to_touchdown @ by_state[-1],
            B=to_touchdown @ by_input[-1],
            gains=self.settings.gains,
            torque=self.gait.stance.motion(self.robot, phase_grid()).tau,
        )

    def steps(self, phase: PlayedPhase, *, odometry: bool) -> list[tuple[Array, Array]]:
        """A_k (29, 29) and B_k (29, 12) of `x_{k+1} = A_k x_k + B_k u_k` under feedback."""
        dt, steps = self.settings.timestep, []
        share = dt / (self.settings.speed_filter + dt)
        kp, kd = _on_joints(self.kp), _on_joints(self.kd)
        for state, torque, stands in zip(
            phase.states[:-1], phase.torques, phase.standing, strict=True
        ):
            at = planar_derivatives(
                self.robot,
                self.q(state),
                self.v(state),
                torque,
                contact="rolling" if stands else None,
                rotors=self.rotors,
            )
            A, B = np.eye(self.speed + 1), np.zeros((self.speed + 1, self.robot.nu))
            A[self.rate, self.place] = dt * (at.da_dy - at.da_dtau @ kp)
            A[self.rate, self.rate] += dt * (at.da_dv - at.da_dtau @ kd)
            B[self.rate] = dt * at.da_dtau
            if odometry:  # leg odometry, filtered
                A[self.speed, self.speed], A[self.speed, self.free] = 1.0 - share, share
            A[self.place] += dt * A[self.rate]
            B[self.place] = dt * B[self.rate]
            steps.append((A, B))
        return steps

    def flown(self, flight: PlayedPhase) -> Array:
        """Derivative of the state at the last tick of flight by that at lift-off, with eq. (12)."""
        ticks = len(flight.torques)
        thigh = self.thigh
        # A turn of the reference by one radian acts as the feedback's torque does.
        turned = self.share[:ticks, None] * self.kp * thigh
        turned = turned + self.share_rate[:ticks, None] * self.kd * thigh
        by_turn, by_state = _propagate(self.steps(flight, odometry=False), turned[..., None])
        end = by_state[-1].copy()
        end[:, self.speed] += self.settings.regulator.gain * by_turn[-1, :, 0]
        return np.asarray(end)

    def touchdown(self, landing: Array, tick: int) -> Array:
        """Derivative of the state after the impact by that at the last tick of flight, (29, 29).

        The saltation matrix: `dx+/dx- (1 - x' grad h^T / (grad h . x'))` for the feet's height h.
        """
        step = _STEP * np.eye(self.speed + 1)[: self.free + self.free]
        q = self.q(landing)
        height = np.array(
            [(self.height(self.q(landing + d)) - self.height(self.q(landing - d))) for d in step]
        ) / (2.0 * _STEP)
        # Where the feet are higher by dh, touchdown is later by dh / (speed of their coming down).
        a, _ = planar_acceleration(
            self.robot,
            q,
            self.v(landing),
            self.kp * (self.flight[tick] - landing[2 : self.free])
            + self.kd * (self.flight_rate[tick] - landing[self.free + 2 : self.speed]),
            rotors=self.rotors,
        )
        rates = np.concatenate([landing[self.rate], a, [0.0]])
        saltation = np.eye(self.speed + 1)
        sinking = height[: self.free] @ landing[self.rate]
        saltation[:, : 2 * self.free] -= np.outer(rates, height) / sinking
        impact = np.stack(
            [
                (self.impact(landing + d) - self.impact(landing - d)) / (2.0 * _STEP)
                for d in _STEP * np.eye(self.speed + 1)
            ],
            axis=1,
        )
        return np.asarray(impact @ saltation)


def _propagate(steps: list[tuple[Array, Array]], inputs: Array) -> tuple[Array, Array]:
    """Derivatives of the states at each tick and after the last, by inputs and first state.

    Args:
        steps: The ticks.
        inputs: Torques at each tick for m inputs, shape (ticks, 12, m).

    Returns:
        Shapes (ticks + 1, 29, m) and (ticks + 1, 29, 29).
    """
    states = len(steps[0][0])
    by_input = np.zeros((len(steps) + 1, states, inputs.shape[2]))
    by_state = np.repeat(np.eye(states)[None], len(steps) + 1, axis=0)
    for tick, (A, B) in enumerate(steps):
        by_input[tick + 1] = A @ by_input[tick] + B @ inputs[tick]
        by_state[tick + 1] = A @ by_state[tick]
    return by_input, by_state


def _on_joints(gains: Array) -> Array:
    """Diagonal gains that read the joints among the free coordinates, shape (12, 14)."""
    return np.hstack([np.zeros((len(gains), 2)), np.diag(gains)])
