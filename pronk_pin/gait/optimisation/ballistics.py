"""What no gait can do, by its flight and the reach of its legs: found without a solver.

In a flight of T seconds the centre of mass rises g T^2 / 8 above the mean of its heights at both
ends, and at the ends feet touch the ground. In a stance of T seconds the trunk goes no farther than
a leg whose foot stands sweeps, and no faster than its joints turn. These are necessary conditions,
generous where the robot's posture matters: what they refuse has no solution, what they let pass may
have none either.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...errors import InvalidInput
from ...kinematics import leg_geometry
from ...robot import Robot
from ..problem import GaitProblem


def largest_apex(problem: GaitProblem) -> float:
    """Height of the trunk that no flight within its durations exceeds in its middle [m]."""
    robot = problem.robot
    flights = [phase.duration[1] for phase in problem.sequence if not phase.stands]
    longest = max(flights, default=0.0)
    longest = min(longest, problem.stride[1])
    geometry, pitch = leg_geometry(robot), _pitch(problem)
    hip = geometry.hip + geometry.thigh
    reach = float(hip[:, 2].max()) + _leg(robot) + robot.foot_radius
    reach += pitch * float(np.abs(hip[:, 0]).max())
    return reach + robot.gravity * longest**2 / 8.0 + _centre_play(robot)


def largest_speed(problem: GaitProblem) -> float:
    """Average speed that no gait of a problem exceeds [m/s], forward or back."""
    robot, pitch = problem.robot, _pitch(problem)
    geometry, leg, radius = leg_geometry(robot), _leg(problem.robot), problem.robot.foot_radius
    hip = geometry.hip + geometry.thigh
    lowest = problem.trunk_height + float(hip[:, 2].min()) - radius
    lowest = max(lowest - pitch * float(np.abs(hip[:, 0]).max()), 0.0)
    sweep = 2.0 * np.sqrt(max(leg**2 - lowest**2, 0.0))
    sweep += 2.0 * pitch * float(np.abs(hip).max())
    lower = float(np.hypot(geometry.foot[:, 0], geometry.foot[:, 2]).max())
    limit = problem.velocity_use * robot.v_max.reshape(-1, 3)[:, 1:].max(axis=0)  # thigh, calf
    shortest = min(phase.duration[0] for phase in problem.sequence if phase.stands)
    if problem.contact == "rolling":
        sweep += np.pi * radius  # with the knee above the ground, a foot rolls half a turn at most
    turning = float(limit[0] * (leg + radius) + limit[1] * (lower + radius))
    standing = min(float(sweep) / shortest, turning)
    # Beyond its mean in stance, speed differs by what friction brakes and pushes in half a stride.
    flying = sum(phase.duration[1] for phase in problem.whole_sequence if not phase.stands)
    return standing + 0.5 * problem.friction * robot.gravity * min(flying, problem.stride[1])


def check_ballistics(problem: GaitProblem) -> None:
    """Refuse a speed or an apex that no gait of this robot reaches.

    Raises:
        InvalidInput: The speed or the apex is beyond; the message names the largest.
    """
    apex = largest_apex(problem)
    if problem.apex > apex:
        raise InvalidInput(
            f"apex {problem.apex:g} m is out of reach of the {problem.robot.name}: its legs and "
            f"the longest flight allow {_down(apex):g} m at most; ask for a lower apex"
        )
    speed = largest_speed(problem)
    if abs(problem.speed) > speed:
        raise InvalidInput(
            f"speed {problem.speed:g} m/s is out of reach of the {problem.robot.name}: its legs "
            f"and the shortest stance allow {_down(speed):g} m/s at most; ask for a slower gait"
        )


def _leg(robot: Robot) -> float:
    """Length of the longest leg from the thigh joint to the foot's centre [m], knee limits kept."""
    geometry, longest = leg_geometry(robot), 0.0
    for k in range(len(robot.legs)):
        low, high = robot.q_min[3 * k + 2], robot.q_max[3 * k + 2]
        if not (np.isfinite(low) and np.isfinite(high)):
            low, high = -np.pi, np.pi
        bend = np.linspace(low, high, 721)
        x, z = geometry.foot[k, 0], geometry.foot[k, 2]
        foot_x = geometry.calf[k, 0] + np.cos(bend) * x + np.sin(bend) * z
        foot_z = geometry.calf[k, 2] - np.sin(bend) * x + np.cos(bend) * z
        longest = max(longest, float(np.hypot(foot_x, foot_z).max()))
    return longest


def _centre_play(robot: Robot) -> float:
    """How far the legs can move the centre of mass in the trunk, up and down together [m]."""
    play, masses = 0.0, robot.model.inertias
    for leg in range(len(robot.legs)):
        reach = 0.0
        for name in robot.spec.leg_joints(robot.legs[leg]):
            index = robot.model.getJointId(name)
            inertia: pin.Inertia = masses[index]
            if name != robot.spec.leg_joints(robot.legs[leg])[0]:
                play += 2.0 * inertia.mass * (reach + float(np.linalg.norm(inertia.lever)))
                reach += float(np.linalg.norm(leg_geometry(robot).calf[leg]))
    return play / robot.mass


def _pitch(problem: GaitProblem) -> float:
    return 0.0 if problem.base == "locked" else problem.pitch_limit


def _down(value: float) -> float:
    """Rounded down to two digits behind the point: what is named is allowed."""
    return float(np.floor(value * 100.0) / 100.0)
