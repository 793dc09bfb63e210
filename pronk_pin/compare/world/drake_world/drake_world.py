"""Robots in Drake. Its q and v stay in this room; what the world takes and gives is in Pinocchio's
order.

Drake steps one robot at a time, and is called twice a tick: for the next state, and for the
contacts that lead there. A state is all that the next one depends on, so one context a thread will
do for all robots.
"""

from __future__ import annotations

import threading

import numpy as np
from pydrake.multibody.tree import default_model_instance

from ...._typing import Array, BoolArray, IntArray
from ....control import Gains
from ....robot import Robot
from ..engine import Motion
from ..scenario import Scenario
from ..state_world import StateWorld
from .drake_trunk import DrakeTrunk
from .plant import Plant, build_plant

_HUGE = 1e10
"""A state with such a number in it is not finite: MuJoCo's limit."""


class DrakeWorld(StateWorld):
    """n robots in Drake, see `World`; a tick is a step of a discrete plant.

    Args:
        robot: The robot.
        scenario: The scenario.
        n: Number of robots.
        base: How the trunks may move, see `build_plant`.
        servo: Gains of servos at the joints, whose controls are then set points (see
            `Tape.setpoint`) and which keep to the motors' limits themselves; without them the
            controls are torques.
        approximation: Of the contacts, see `DrakeEngine`.
    """

    def __init__(
        self,
        robot: Robot,
        scenario: Scenario,
        n: int,
        *,
        base: str,
        servo: Gains | None,
        approximation: str,
    ) -> None:
        self._plant = build_plant(robot, scenario, base=base, approximation=approximation)
        plant = self._plant.plant
        self._coordinates = DrakeTrunk(base, plant.num_positions())
        super().__init__(
            *(robot, scenario, n),
            trunk=self._coordinates,
            joints=1 + self._plant.joints,
            rates=1 + plant.num_positions() + self._plant.rates,
            size=1 + plant.num_multibody_states(),
        )
        self._scratch = threading.local()
        self._constant = scenario.by_joint("torque_constant", robot)
        self._nv: int = plant.num_velocities()
        self._servo = None if servo is None else self._servo_law(servo)

    def play(self, rows: IntArray, control: Array) -> Motion:
        """See `World`."""
        m, ticks = control.shape[:2]
        path = np.full((m, ticks + 1, self._state.shape[1]), np.nan)
        path[:, 0] = self._state[rows]
        path[..., 0] = path[:, :1, 0] + self.scenario.timestep * np.arange(ticks + 1)
        force = np.zeros((m, ticks, *self.force.shape[1:]))
        pushes = self._push_force(rows, path[:, 0, 0], ticks)
        applied = np.zeros((m, ticks, self._nv))
        applied[..., self._plant.rates] = self._constant * control
        for robot in zip(
            path, applied, force, [None] * m if pushes is None else pushes, strict=True
        ):
            self._roll(*robot)
        return self._motion(path, force, _finite(path[:, 1:]))

    def _roll(self, path: Array, applied: Array, force: Array, pushes: Array | None) -> None:
        """Simulate one robot: fills in its path (ticks + 1, nstate) and forces (ticks, 4, 3).

        Where Drake gives up, the states to come stay NaN. `applied` are the controls' generalized
        forces, shape (ticks, nv).
        """
        stepper, servo, free = self._stepper, self._servo, self._coordinates.free
        centre = self._plant.trunk.lever
        for tick, torque in enumerate(applied):
            state = path[tick]
            if servo is not None:
                law, limit = servo
                torque = np.minimum(np.maximum(torque - law @ state, -limit), limit)
            if pushes is not None:
                push = self._coordinates.generalized(state, pushes[tick], centre)
                torque[: len(push)] = push
            after = stepper.step(state[1:], torque, force[tick])
            if after is None:
                return
            if free:  # as the step turns a quaternion, it grows
                after[:4] /= np.sqrt(after[:4] @ after[:4])
            path[tick + 1, 1:] = after

    def _servo_law(self, servo: Gains) -> tuple[Array, Array]:
        """What servos take off the set points, by the state, and their limits [N m]: shapes
        (nv, nstate) and (nv,)."""
        law, limit = np.zeros((self._nv, self._state.shape[1])), np.zeros(self._nv)
        motors = self._plant.rates
        law[motors, self._joints] = self._constant * servo.proportional(self.robot.nu)
        law[motors, self._rates] = self._constant * servo.derivative(self.robot.nu)
        limit[motors] = self._constant * self.robot.tau_max
        return law, limit

    @property
    def _stepper(self) -> _Stepper:
        """That of the thread."""
        if not hasattr(self._scratch, "stepper"):
            self._scratch.stepper = _Stepper(self._plant)
        stepper: _Stepper = self._scratch.stepper
        return stepper


class _Stepper:
    """What of Drake is called at every tick, with the scratch memory of one thread."""

    def __init__(self, whole: Plant) -> None:
        plant = whole.plant
        self._root, self._context = whole.context()
        held = plant.get_desired_state_input_port(default_model_instance())
        held.FixValue(self._context, np.zeros(held.size()))  # where dry friction holds a joint
        self._after = plant.AllocateDiscreteVariables()
        self._update = plant.CalcForcedDiscreteVariableUpdate
        self._apply = plant.get_applied_generalized_force_input_port().FixValue
        self._contacts = plant.get_contact_results_output_port().Eval
        self._feet = whole.foot_bodies

    def step(self, state: Array, applied: Array, force: Array) -> Array | None:
        """Step from a state [q, v] under a generalized force; None where Drake gives up.

        Args:
            state: Shape (nq + nv,).
            applied: Generalized force [N, N m], shape (nv,).
            force: Takes the ground's force on each foot [N], shape (4, 3).
        """
        context = self._context
        try:
            context.SetDiscreteState(state)
            self._apply(context, applied)
            self._update(context, self._after)
            contacts = self._contacts(context)
        except RuntimeError:
            return None
        for index in range(contacts.num_point_pair_contacts()):
            contact = contacts.point_pair_contact_info(index)
            # The foot comes first, as it was registered before the ground, on which the force is.
            force[self._feet[int(contact.bodyA_index())]] -= contact.contact_force()
        after: Array = self._after.value().copy()
        return after


def _finite(states: Array) -> BoolArray:
    """Whether states (m, ticks, nstate) are finite, with nothing huge."""
    return np.asarray((np.abs(states) < _HUGE).all(axis=-1))
