"""The robot that is its own mirror image, nearest to one that is not quite."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import pinocchio as pin

from ..robot import Robot


@lru_cache(maxsize=8)
def mirror_symmetric(robot: Robot) -> Robot:
    """The robot with its trunk's centre of mass in the mirror plane, y = 0.

    Half a stride mirrored is a motion of this robot; the A1's trunk lies 4 mm beside the plane.
    """
    model = robot.model.copy()
    body: pin.Inertia = robot.model.inertias[1]
    lever, rotational = body.lever.copy(), body.inertia.copy()
    lever[1] = 0.0
    for i, k in ((0, 1), (1, 0), (1, 2), (2, 1)):
        rotational[i, k] = 0.0  # the products of inertia that the mirror reverses
    model.inertias[1] = pin.Inertia(body.mass, lever, rotational)
    return dataclasses.replace(robot, model=model)
