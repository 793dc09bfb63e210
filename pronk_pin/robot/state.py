"""Validation of the states, feet and options that a user passes in.

Leading dimensions are a batch: `(..., 19)` is one configuration or any batch of them.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
import numpy.typing as npt

from .._checks import instance_of, known_name, numbers, sequence_of, text
from .._typing import Array
from ..errors import InvalidInput
from .robot import Robot

_UNIT_TOLERANCE = 1e-6
"""Largest distance of the norm of a base quaternion from 1."""

_FLOAT = np.dtype(np.float64)
_BASE = struct.Struct("7d").unpack_from
"""Trunk position and quaternion of a configuration, at a quarter of the cost of NumPy."""


REFUSALS = (TypeError, ValueError, AttributeError)
"""Errors that Pinocchio and NumPy raise for arguments of the wrong shape or type."""


def sound_base(q: npt.ArrayLike) -> bool:
    """Whether q is one array with a finite position and a unit quaternion; a quick check.

    Pinocchio's algorithms are so fast that checking every number would cost as much as they do.
    This looks at what they would not notice; NaN in joints and velocities shows in the result,
    and a wrong shape is refused. Whoever meets one of the three checks in earnest with `as_state`.
    """
    try:
        a, b, c, x, y, z, w = _BASE(q)  # type: ignore[arg-type]
        one = q.ndim == 1  # type: ignore[union-attr]
    except (TypeError, AttributeError, BufferError, struct.error):
        return False
    off = x * x + y * y + z * z + w * w - 1.0
    return one and -_UNIT_TOLERANCE < off < _UNIT_TOLERANCE and isfinite(a + b + c)


def as_array(name: str, value: npt.ArrayLike, size: int, batch: tuple[int, ...] | None) -> Array:
    """Convert to a finite float64 array of shape (*batch, size); a batch of None allows any.

    Raises:
        InvalidInput: Not numbers, not finite, or of another shape.
    """
    if not batch and _one_sound(value, size):
        return value  # type: ignore[return-value]
    array = as_numbers(name, value)
    leading = "..." if batch is None else ", ".join(map(str, batch))
    if array.shape[-1:] != (size,) or (batch is not None and array.shape[:-1] != batch):
        expected = f"({leading}, {size})" if leading else f"({size},)"
        raise InvalidInput(
            f"{name} has shape {array.shape} where {expected} is expected; the batch comes "
            "first and is the same for every argument"
        )
    if not np.isfinite(array).all():
        raise InvalidInput(f"{name} holds NaN or infinite values; remove them first")
    return array


def as_numbers(name: str, value: npt.ArrayLike) -> Array:
    """A float64 array of any shape; texts and truth values are no numbers.

    Raises:
        InvalidInput: Not an array of numbers.
    """
    (array,) = numbers(**{name: value})
    return array


def _one_sound(value: Any, size: int) -> bool:
    """Whether value is one finite vector, as control loops and integrators pass it."""
    return (
        type(value) is np.ndarray
        and value.dtype is _FLOAT
        and value.shape == (size,)
        and isfinite(sum(value.tolist()))  # Python's sum is quicker than NumPy's
    )


def as_robot(robot: object) -> Robot:
    """The robot itself, if it is one.

    Raises:
        InvalidInput: It is something else, its name perhaps.
    """
    if isinstance(robot, Robot):
        return robot
    return instance_of("robot", robot, Robot, "a Robot, as load_robot() returns it")


def as_q(robot: Robot, q: npt.ArrayLike) -> Array:
    """Convert to a configuration (..., nq) with a unit base quaternion.

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    as_robot(robot)
    if type(q) is np.ndarray and q.dtype is _FLOAT and q.shape == (robot.nq,):
        values = q.tolist()
        x, y, z, w = values[3:7]
        off = x * x + y * y + z * z + w * w - 1.0
        if -_UNIT_TOLERANCE < off < _UNIT_TOLERANCE and isfinite(sum(values)):
            return q
    array = as_array("q", q, robot.nq, None)
    norms = np.ravel(np.linalg.norm(array[..., 3:7], axis=-1))
    wrong = norms[np.abs(norms - 1.0) > _UNIT_TOLERANCE]
    if wrong.size:
        raise InvalidInput(
            f"the base quaternion has norm {wrong[0]:.6g}; normalise it first (pinocchio.normalize)"
        )
    return array


def as_state(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> tuple[Array, Array]:
    """Convert to a configuration (..., nq) and a velocity (..., nv) of the same batch shape.

    Raises:
        InvalidInput: As `as_q`, or v does not fit q.
    """
    configuration = as_q(robot, q)
    return configuration, as_array("v", v, robot.nv, configuration.shape[:-1])


def as_one(name: str, array: Array) -> Array:
    """Return the array itself, if it is no batch.

    Raises:
        InvalidInput: It has leading dimensions.
    """
    if array.ndim != 1:
        raise InvalidInput(f"{name} has shape {array.shape}, a batch; pass one state at a time")
    return array


def by_state(function: Callable[..., Any], shape: tuple[int, ...], *arrays: Array) -> Array:
    """What a function of one state gives for a batch, shape (..., *shape).

    Args:
        function: Takes one row of each array.
        shape: Shape of its result.
        arrays: Checked arrays of the same batch, such as q, shape (..., 19).
    """
    batch = arrays[0].shape[:-1]
    if not batch:
        return np.array(function(*arrays), dtype=np.float64)
    out = np.empty((math.prod(batch), *shape))
    rows = zip(*(array.reshape(-1, array.shape[-1]) for array in arrays), strict=True)
    for k, row in enumerate(rows):
        out[k] = function(*row)
    return out.reshape(*batch, *shape)


def leg_indices(robot: Robot, feet: Iterable[str] | None) -> tuple[int, ...]:
    """Indices of legs given by name, in the order given; None means all legs.

    Raises:
        UnknownName: The robot has no such leg.
        InvalidInput: A leg is named twice, which would make its contact singular.
    """
    as_robot(robot)
    if feet is not None:
        feet = (feet,) if isinstance(feet, str) else sequence_of("feet", feet, text)
    return _leg_indices(robot, feet)


@lru_cache(maxsize=256)
def _leg_indices(robot: Robot, names: tuple[str, ...] | None) -> tuple[int, ...]:
    if names is None:
        return tuple(range(len(robot.legs)))
    for name in names:
        known_name("leg", name, robot.legs)
    if len(set(names)) != len(names):
        raise InvalidInput(f"feet={list(names)} names a leg twice; name each leg once")
    return tuple(robot.legs.index(name) for name in names)
