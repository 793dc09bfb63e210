"""What the dynamics utilities cost beside the bare Pinocchio calls that they stand for.

    python benchmarks/dynamics.py [--robot go2] [--states 10000]

Single states first: each utility, checks and all, and the shortest sequence of calls with which
Pinocchio gives the same numbers, in turn and many times over. A time is the least of its
repetitions, which other work on the machine disturbs least; the ratio is that of the times. Then
batches, beside a bare loop over the same calls; then the inverse dynamics with friction cones
along a gait, on slippery ground, where nearly every instant needs the QP.
"""

from __future__ import annotations

import argparse
import timeit
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pinocchio as pin

from pronk_pin import Robot, dynamics, kinematics, load_robot
from pronk_pin.dynamics import energetics
from pronk_pin.gait import load_library
from pronk_pin.inverse_dynamics import PLANAR_CONSTRAINT, inverse_dynamics

Call = Callable[[], object]
WORLD = pin.LOCAL_WORLD_ALIGNED


def least(calls: Iterable[Call], *, rounds: int, number: int) -> list[float]:
    """Least time of each call [us], measured in turn."""
    calls = list(calls)
    times = np.full(len(calls), np.inf)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            times[k] = min(times[k], timeit.timeit(call, number=number) / number * 1e6)
    return [float(t) for t in times]


def crouch(robot: Robot, n: int) -> tuple[np.ndarray, ...]:
    """n states near standing: q, v, a, tau."""
    rng = np.random.default_rng(0)
    q = np.tile(robot.standing, (n, 1))
    q[:, 7:] += 0.1 * rng.normal(size=(n, robot.nu))
    v, a = rng.normal(size=(2, n, robot.nv))
    return q, v, a, rng.normal(size=(n, robot.nu))


class Bare:
    """Pinocchio itself, as a user would call it who has set everything up."""

    def __init__(self, robot: Robot) -> None:
        self.model, self.data = robot.model, robot.model.createData()
        self.feet, self.zero = robot.foot_ids, np.zeros(robot.nv)
        self.contacts = pin.StdVec_RigidConstraintModel()
        self.forces = pin.StdVec_RigidConstraintData()
        for foot in self.feet:
            frame = self.model.frames[foot]
            contact = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D, self.model, frame.parentJoint, frame.placement, WORLD
            )
            self.contacts.append(contact)
            self.forces.append(contact.createData())
        self.stance_data = self.model.createData()
        pin.initConstraintDynamics(self.model, self.stance_data, self.contacts, self.forces)
        self.settings = pin.ProximalSettings(1e-12, 0.0, 1)

    def force(self, tau: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros(6), tau])

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        pin.computeJointJacobians(self.model, self.data, q)
        return np.concatenate(
            [pin.getFrameJacobian(self.model, self.data, foot, WORLD)[:3] for foot in self.feet]
        )

    def bias(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        pin.forwardKinematics(self.model, self.data, q, v, self.zero)
        return np.concatenate(
            [
                pin.getFrameClassicalAcceleration(self.model, self.data, foot, WORLD).linear
                for foot in self.feet
            ]
        )

    def stance(self, q: np.ndarray, v: np.ndarray, force: np.ndarray) -> tuple[Any, Any]:
        a = pin.constraintDynamics(
            self.model,
            self.stance_data,
            q,
            v,
            force,
            self.contacts,
            self.forces,
            self.settings,
        )
        return a, self.stance_data.lambda_c.copy()

    def stance_derivatives(self, q: np.ndarray, v: np.ndarray, force: np.ndarray) -> Any:
        self.stance(q, v, force)
        return pin.computeConstraintDynamicsDerivatives(
            self.model, self.stance_data, self.contacts, self.forces, self.settings
        )

    def impact(self, q: np.ndarray, v: np.ndarray) -> tuple[Any, Any]:
        after = pin.impulseDynamics(
            self.model,
            self.stance_data,
            q,
            v,
            self.contacts,
            self.forces,
            0.0,
            self.settings,
        )
        return after, self.stance_data.impulse_c.copy()

    def feet_at(self, q: np.ndarray) -> np.ndarray:
        pin.framesForwardKinematics(self.model, self.data, q)
        return np.array([self.data.oMf[foot].translation for foot in self.feet])

    def feet_moving(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        pin.forwardKinematics(self.model, self.data, q, v)
        return np.array(
            [pin.getFrameVelocity(self.model, self.data, foot, WORLD).linear for foot in self.feet]
        )

    def inverse_dynamics(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """The forces that need the smallest torques, by their optimality conditions."""
        needed = pin.rnea(self.model, self.data, q, v, a)
        jacobian = self.jacobian(q)
        base, lever = jacobian[:, :6], jacobian[:, 6:]
        hessian = lever @ lever.T + 1e-6 * np.eye(len(lever))
        matrix = np.block([[hessian, base], [base.T, np.zeros((6, 6))]])
        rhs = np.concatenate([lever @ needed[6:], needed[:6]])
        lam = np.linalg.solve(matrix, rhs)[: len(lever)]
        return needed[6:] - lever.T @ lam


def singles(robot: Robot) -> dict[str, tuple[Call, Call]]:
    """Each utility on one state, and what it stands for."""
    bare, (q, v, a, tau) = Bare(robot), (x[0] for x in crouch(robot, 1))
    model, data, force = bare.model, bare.data, bare.force
    return {
        "mass_matrix": (
            lambda: dynamics.mass_matrix(robot, q),
            lambda: pin.crba(model, data, q),
        ),
        "gravity": (
            lambda: dynamics.gravity(robot, q),
            lambda: pin.computeGeneralizedGravity(model, data, q),
        ),
        "nonlinear_effects": (
            lambda: dynamics.nonlinear_effects(robot, q, v),
            lambda: pin.nonLinearEffects(model, data, q, v),
        ),
        "coriolis_matrix": (
            lambda: dynamics.coriolis_matrix(robot, q, v),
            lambda: pin.computeCoriolisMatrix(model, data, q, v),
        ),
        "contact_jacobian": (
            lambda: dynamics.contact_jacobian(robot, q),
            lambda: bare.jacobian(q),
        ),
        "contact_bias": (
            lambda: dynamics.contact_bias(robot, q, v),
            lambda: bare.bias(q, v),
        ),
        "flight_dynamics": (
            lambda: dynamics.flight_dynamics(robot, q, v, tau),
            lambda: pin.aba(model, data, q, v, force(tau)),
        ),
        "stance_dynamics": (
            lambda: dynamics.stance_dynamics(robot, q, v, tau),
            lambda: bare.stance(q, v, force(tau)),
        ),
        "impact": (
            lambda: dynamics.impact(robot, q, v),
            lambda: bare.impact(q, v),
        ),
        "flight_derivatives": (
            lambda: dynamics.flight_derivatives(robot, q, v, tau),
            lambda: pin.computeABADerivatives(model, data, q, v, force(tau)),
        ),
        "stance_derivatives": (
            lambda: dynamics.stance_derivatives(robot, q, v, tau),
            lambda: bare.stance_derivatives(q, v, force(tau)),
        ),
        "foot_positions": (
            lambda: kinematics.foot_positions(robot, q),
            lambda: bare.feet_at(q),
        ),
        "foot_velocities": (
            lambda: kinematics.foot_velocities(robot, q, v),
            lambda: bare.feet_moving(q, v),
        ),
        "kinetic_energy": (
            lambda: energetics.kinetic_energy(robot, q, v),
            lambda: pin.computeKineticEnergy(model, data, q, v),
        ),
        "inverse_dynamics": (
            lambda: inverse_dynamics(robot, q, v, a),
            lambda: bare.inverse_dynamics(q, v, a),
        ),
    }


def batches(robot: Robot, n: int) -> dict[str, tuple[Call, Call]]:
    """Each batched utility on n states, and a bare loop that keeps its results."""
    bare, (q, v, a, tau) = Bare(robot), crouch(robot, n)
    force = np.concatenate([np.zeros((n, 6)), tau], axis=1)

    def flight() -> np.ndarray:
        out = np.empty_like(v)
        for i in range(n):
            out[i] = pin.aba(bare.model, bare.data, q[i], v[i], force[i])
        return out

    def stance() -> tuple[np.ndarray, np.ndarray]:
        out, lam = np.empty_like(v), np.empty((n, 3 * len(bare.feet)))
        for i in range(n):
            out[i], lam[i] = bare.stance(q[i], v[i], force[i])
        return out, lam

    def inverse() -> np.ndarray:
        return np.array([bare.inverse_dynamics(q[i], v[i], a[i]) for i in range(n)])

    def feet() -> np.ndarray:
        return np.array([bare.feet_at(q[i]) for i in range(n)])

    return {
        "flight_dynamics": (lambda: dynamics.flight_dynamics(robot, q, v, tau), flight),
        "stance_dynamics": (lambda: dynamics.stance_dynamics(robot, q, v, tau), stance),
        "inverse_dynamics": (lambda: inverse_dynamics(robot, q, v, a), inverse),
        "foot_positions": (lambda: kinematics.foot_positions(robot, q), feet),
    }


def compare(title: str, pairs: dict[str, tuple[Call, Call]], *, states: int, rounds: int) -> None:
    """Print time a state, bare and ours, and their ratio."""
    print(f"\n{title:<28}{'bare':>9}{'ours':>9}{'ratio':>8}")
    number = 300 if states == 1 else 1
    for name, (ours, bare) in pairs.items():
        mine, theirs = (t / states for t in least((ours, bare), rounds=rounds, number=number))
        print(f"{name:<28}{theirs:>9.2f}{mine:>9.2f}{mine / theirs:>8.2f}")


def cones(samples: int) -> None:
    """Time a state of the inverse dynamics with friction cones along the A1's stance."""
    robot = load_robot("a1")
    motion = load_library("a1").at(0.5).stance.motion(robot, np.linspace(0.0, 1.0, samples))
    state = (motion.q, motion.v, motion.a)
    print(f"\n{'friction cones, [us]':<28}{'all':>9}{'QP for':>9}{'feasible':>9}")
    for friction, constraint in ((0.6, None), (0.22, None), (0.22, PLANAR_CONSTRAINT)):

        def solve(friction: float = friction, constraint: Any = constraint) -> Any:
            return inverse_dynamics(robot, *state, friction=friction, constraint=constraint)

        (total,) = least((solve,), rounds=5, number=1)
        free = inverse_dynamics(robot, *state, constraint=constraint).lam.reshape(samples, -1, 3)
        outside = np.linalg.norm(free[..., :2], axis=-1) > friction * free[..., 2]
        name = f"mu {friction}, {'guided' if constraint else 'free'} base"
        share, feasible = outside.any(axis=1).mean(), solve().feasible.mean()
        print(f"{name:<28}{total / samples:>9.1f}{share:>9.0%}{feasible:>9.0%}")


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="a1")
    parser.add_argument("--states", type=int, default=10_000)
    options = parser.parse_args()
    robot = load_robot(options.robot)
    compare("one state, [us]", singles(robot), states=1, rounds=40)
    title = f"{options.states} states, [us] each"
    compare(title, batches(robot, options.states), states=options.states, rounds=5)
    cones(1000)


if __name__ == "__main__":
    main()
