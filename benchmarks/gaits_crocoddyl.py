"""The nearest problem to a gait that Crocoddyl can state, and our audit of both answers.

Crocoddyl shoots from a fixed state over fixed durations, with costs where we have constraints. So
it is given what it cannot find: our durations, and our state after the touchdown to start from;
the feet are points. It is asked to come back to that state a stride further on, through a stance on
four feet, a flight and the touchdown impact, at the least cost of eq. (6). Periodicity, speed,
apex, clearance, friction and joint velocities are penalties; torque limits are limits (BoxFDDP).
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import crocoddyl
import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from pronk_pin.dynamics import planar_dynamics, planar_rows
from pronk_pin.gait import GaitSolution, audit, gait_problem, optimize_gait
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import NB, Robot

SPEED = 0.3
SCHEMES = (("Euler", 0.002), ("RK4", 0.004))
"""Integrators and time steps to try [s]."""
PENALTY = 1e5
ITERATIONS = 500


@dataclass(frozen=True)
class Answer:
    """A motion as torques held over time steps, whoever found it.

    Attributes:
        t: Times, from touchdown to touchdown [s], shape (n + 1,).
        x: x, z, joints and their rates at these times, shape (n + 1, 28).
        u: Torques over each step [N m], shape (n, 12).
        lift_off: Step at which the feet leave.
        after: State after the impact at the end, shape (28,).
        seconds, iterations, converged: How it was found.
    """

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    lift_off: int
    after: np.ndarray
    seconds: float
    iterations: int
    converged: bool


def planar_model(robot: Robot) -> pin.Model:
    """The robot with its trunk on two slides, x and z."""
    root = pin.JointModelComposite(2)
    root.addJoint(pin.JointModelPX())
    root.addJoint(pin.JointModelPZ())
    return pin.buildModelFromUrdf(str(robot.urdf_path), root)


def node(state, actuation, robot: Robot, *, standing: bool, problem):
    """Differential model of an instant: dynamics with or without feet on the ground, and cost."""
    nu, model = actuation.nu, state.pinocchio
    contacts = crocoddyl.ContactModelMultiple(state, nu)
    costs = crocoddyl.CostModelSum(state, nu)
    weights = np.concatenate([np.zeros(state.nv), [0.0, 0.0], np.ones(12)])
    rates = crocoddyl.ActivationModelWeightedQuad(weights)
    still = crocoddyl.ResidualModelState(state, state.zero(), nu)
    # Crocoddyl halves its quadratic costs.
    costs.addCost("rates", crocoddyl.CostModelResidual(state, rates, still), 2 * 0.15)
    costs.addCost(
        "torques",
        crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, nu)),
        2.0,
    )
    limit = np.concatenate([np.full(state.nv + 2, np.inf), robot.v_max])
    barrier = crocoddyl.ActivationModelQuadraticBarrier(crocoddyl.ActivationBounds(-limit, limit))
    costs.addCost("velocity", crocoddyl.CostModelResidual(state, barrier, still), 10.0)
    for name in robot.foot_names if standing else ():
        frame = model.getFrameId(name)
        contact = crocoddyl.ContactModel3D(
            state, frame, np.zeros(3), pin.LOCAL_WORLD_ALIGNED, nu, np.array([0.0, 50.0])
        )
        contacts.addContact(name, contact)
        cone = crocoddyl.FrictionCone(np.eye(3), problem.friction, 8, True)
        bounds = crocoddyl.ActivationBounds(cone.lb, cone.ub)
        residual = crocoddyl.ResidualModelContactFrictionCone(state, frame, cone, nu)
        inside = crocoddyl.ActivationModelQuadraticBarrier(bounds)
        costs.addCost(name, crocoddyl.CostModelResidual(state, inside, residual), 1.0)
    return crocoddyl.DifferentialActionModelContactFwdDynamics(
        state, actuation, contacts, costs, 0.0, True
    )


def add_height(
    costs, state, robot: Robot, name: str, height: float, weight: float, nu: int
) -> None:
    """A penalty on the height of a foot's centre, or of the trunk."""
    frame = state.pinocchio.getFrameId(name)
    target = np.array([0.0, 0.0, height])
    residual = crocoddyl.ResidualModelFrameTranslation(state, frame, target, nu)
    along_z = crocoddyl.ActivationModelWeightedQuad(np.array([0.0, 0.0, 1.0]))
    costs.addCost(f"height {name}", crocoddyl.CostModelResidual(state, along_z, residual), weight)


def integrated(differential, scheme: str, dt: float):
    """A step of time."""
    if scheme == "Euler":
        return crocoddyl.IntegratedActionModelEuler(differential, dt)
    held = crocoddyl.ControlParametrizationModelPolyZero(differential.nu)
    return crocoddyl.IntegratedActionModelRK(differential, held, crocoddyl.RKType.four, dt)


def solve(robot: Robot, ours: GaitSolution, scheme: str, dt: float) -> Answer:
    """Let Crocoddyl find the stride."""
    problem, model = ours.problem, planar_model(robot)
    state = crocoddyl.StateMultibody(model)
    actuation = crocoddyl.ActuationModelFloatingBase(state)
    durations = [phase.duration for phase in ours.gait.phases]
    counts = [round(duration / dt) for duration in durations]
    start = planar(ours)[0]
    goal = start.copy()
    goal[0] += problem.speed * sum(durations)

    models = []
    for standing, count, duration in zip((True, False), counts, durations, strict=True):
        for k in range(count):
            differential = node(state, actuation, robot, standing=standing, problem=problem)
            middle = not standing and k == count // 2
            if middle:
                weight = PENALTY / dt  # costs of a step are integrated over it
                heights = dict.fromkeys(robot.foot_names, robot.foot_radius + problem.clearance)
                heights[robot.spec.base_link] = problem.apex
                for name, height in heights.items():
                    add_height(differential.costs, state, robot, name, height, weight, actuation.nu)
            running = integrated(differential, scheme, duration / count)
            running.u_lb, running.u_ub = -robot.tau_max, robot.tau_max
            models.append(running)
    impulses = crocoddyl.ImpulseModelMultiple(state)
    costs = crocoddyl.CostModelSum(state, 0)
    for name in robot.foot_names:
        frame = model.getFrameId(name)
        impulses.addImpulse(name, crocoddyl.ImpulseModel3D(state, frame, pin.LOCAL_WORLD_ALIGNED))
        add_height(costs, state, robot, name, robot.foot_radius, PENALTY, 0)
    models.append(crocoddyl.ActionModelImpulseFwdDynamics(state, impulses, costs, 0.0, 0.0, True))
    final = crocoddyl.CostModelSum(state, actuation.nu)
    back = crocoddyl.ResidualModelState(state, goal, actuation.nu)
    final.addCost("periodicity", crocoddyl.CostModelResidual(state, back), PENALTY)
    free = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, actuation, final)
    shooting = crocoddyl.ShootingProblem(
        start, models, crocoddyl.IntegratedActionModelEuler(free, 0.0)
    )
    solver = crocoddyl.SolverBoxFDDP(shooting)
    solver.th_stop = 1e-6
    guess = [start.copy() for _ in range(len(models) + 1)]
    running = zip(models[:-1], shooting.runningDatas, strict=False)
    quasi = [model.quasiStatic(data, start) for model, data in running]
    quasi.append(np.zeros(0))  # the impact has no torques
    began = time.perf_counter()
    converged = solver.solve(guess, quasi, ITERATIONS, False)
    seconds = time.perf_counter() - began
    x = np.array([np.array(row) for row in solver.xs])
    steps = np.repeat(np.divide(durations, counts), counts)
    return Answer(
        t=np.concatenate([[0.0], np.cumsum(steps)]),
        x=x[:-1],
        u=np.array([np.array(row) for row in list(solver.us)[: len(steps)]]),
        lift_off=counts[0],
        after=x[-1],
        seconds=seconds,
        iterations=int(solver.iter),
        converged=bool(converged),
    )


def planar(solution: GaitSolution) -> list[np.ndarray]:
    """x, z, joints and their rates of our solution at the beginning of each phase."""
    rows = planar_rows(solution.problem.robot)
    return [
        np.concatenate([m.q[0, [0, 2]], m.q[0, NB + 1 :], m.v[0, rows]])
        for m in solution.motions.values()
    ]


def whole(robot: Robot, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q and v of the whole robot."""
    v = np.zeros(robot.nv)
    v[planar_rows(robot)] = x[14:]
    return robot.q_from_base(np.array([x[0], 0.0, x[1]]), x[2:14]), v


def reintegrated(robot: Robot, answer: Answer) -> float:
    """Largest distance of a joint when the torques are played by an adaptive integrator [rad]."""
    y, worst = answer.x[0], 0.0
    rows = planar_rows(robot)
    for k, tau in enumerate(answer.u):
        feet = robot.legs if k < answer.lift_off else ()

        def rate(_: float, y: np.ndarray, tau=tau, feet=feet) -> np.ndarray:
            q, v = whole(robot, y)
            a = planar_dynamics(robot, q, v, tau, contact="point", feet=feet)
            return np.concatenate([y[14:], a[rows]])

        span = (answer.t[k], answer.t[k + 1])
        y = solve_ivp(rate, span, y, method="DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
        worst = max(worst, float(np.max(np.abs(y - answer.x[k + 1])[2:14])))
    return worst


def judge(robot: Robot, ours: GaitSolution, answer: Answer) -> dict[str, float]:
    """What our audit asks, of an answer of Crocoddyl's."""
    problem, duration = ours.problem, answer.t[-1]
    goal = answer.x[0].copy()
    goal[0] = answer.after[0]
    feet = np.array([foot_positions(robot, whole(robot, x)[0])[:, 2] for x in answer.x])
    cost = np.sum(answer.u**2, axis=1) + 0.15 * np.sum(answer.x[:-1, 16:] ** 2, axis=1)
    return {
        "cost, eq. (6)": float(np.sum(cost * np.diff(answer.t))),
        "average speed error [m/s]": abs(answer.after[0] / duration - problem.speed),
        "apex error [m]": abs(float(answer.x[:, 1].max()) - problem.apex),
        "periodicity, positions [m, rad]": float(np.max(np.abs(answer.after - goal)[:14])),
        "periodicity, velocities [m/s, rad/s]": float(np.max(np.abs(answer.after - goal)[14:])),
        "feet at touchdown [m]": float(np.max(np.abs(feet[-1] - robot.foot_radius))),
        "standing feet off the ground [m]": float(
            np.max(np.abs(feet[: answer.lift_off + 1] - robot.foot_radius))
        ),
        "drift when re-integrated [rad]": reintegrated(robot, answer),
        "torque use": float(np.max(np.abs(answer.u) / robot.tau_max)),
        "velocity use": float(np.max(np.abs(answer.x[:, 16:]) / robot.v_max)),
    }


def of_ours(ours: GaitSolution) -> dict[str, float]:
    """The same of our solution, from its audit."""
    found, problem = audit(ours, refine=False), ours.problem
    named = {check.name: check.value for check in found.constraints}
    return {
        "cost, eq. (6)": ours.cost,
        "average speed error [m/s]": named["average speed"] / ours.gait.duration,
        "apex error [m]": found["apex error"].value,
        "periodicity, positions [m, rad]": named["periodicity"],
        "periodicity, velocities [m/s, rad/s]": named["touchdown impact"] / problem.robot.mass,
        "feet at touchdown [m]": named["contact height"],
        "standing feet off the ground [m]": found["contact height drift"].value,
        "drift when re-integrated [rad]": max(
            found["stance drift"].value, found["flight drift"].value
        ),
        "torque use": found["torque use"].value,
        "velocity use": found["velocity use"].value,
    }


def compare(robot: Robot) -> None:
    """Print both answers side by side."""
    ours = optimize_gait(gait_problem(robot, SPEED, contact="point"))
    columns = {"pronk_pin": of_ours(ours)}
    print(f"\n{SPEED:g} m/s, point feet, durations and first state as pronk_pin found them")
    print(f"pronk_pin: {ours.iterations} iterations, {ours.solve_time:.2f} s, from a crude hop")
    for scheme, dt in SCHEMES:
        answer = solve(robot, ours, scheme, dt)
        name = f"{scheme} {1e3 * dt:g} ms"
        columns[name] = judge(robot, ours, answer)
        print(
            f"Crocoddyl {crocoddyl.__version__}, {scheme}, {1e3 * dt:g} ms: {answer.iterations} "
            f"iterations, {answer.seconds:.2f} s, {'' if answer.converged else 'not '}converged"
        )
    print(f"\n{'':<38}" + "".join(f"{name:>14}" for name in columns))
    for row in columns["pronk_pin"]:
        print(f"{row:<38}" + "".join(f"{column[row]:>14.2e}" for column in columns.values()))
