"""Estimate of the conditions that robots are in, from the torques that they turn out to need.

A robot that tracks its gait needs the torque that was learned where it is, whichever part of it is
feedforward and which feedback. So the library's torque that comes nearest tells where that is:

    p = argmin_p |L(v, p) + c F(v, p) - tau|^2,    tau = ff + feedback, as delivered,

with the library's torque L and the feedback F that was given beside it, both linear in each
condition between learned values. With c = 1 this finds the stride that was most alike, and a robot
that has found it stays there, even where its feet land a tick off; with c = 0 the feedback goes
into the feedforward along the library's own directions, as in iterative learning of d numbers, and
drives it on, a little beyond. Half of either is best at both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..._typing import Array, IntArray
from .guard import Memory
from .torque_library import TorqueLibrary

_SWEEPS = 200
"""Most minimisations along each condition in turn: conditions that need nearly the same torque take
many. The next stride goes on from there."""
_STILL = 1e-4
"""Change of a place in a sweep, over the distance of two nodes, below which it is found."""
_PRACTISED_FEEDBACK = 0.5
"""Share c of the practised feedback that is expected to be given again."""
FIRST_STRIDES = 4
"""Strides whose estimate is taken as it is; from then on they are averaged."""
_STEP = 0.3
"""Share of a later stride in the estimate."""


class ConditionEstimate:
    """Where n robots are in the conditions of a torque library, estimated from stride to stride.

    Args:
        library: The library, of one condition or more.
        n: Number of robots.

    Attributes:
        library: The library.
        values: The estimates, in the order of `library.conditions`, shape (n, d).
        strides: Strides of each robot that were taken in, shape (n,).
    """

    def __init__(self, library: TorqueLibrary, n: int) -> None:
        self.library = library
        self.values = np.tile(list(library.home.values()), (n, 1))
        self.strides = np.zeros(n, dtype=np.intp)
        self._axes = list(library.conditions.values())
        self._expected = replace(
            library, torque=library.torque + _PRACTISED_FEEDBACK * np.asarray(library.feedback)
        )

    def memory(self, rows: IntArray, speeds: Array) -> Memory:
        """The library's torques and flights for robots at speeds (m,) [m/s], as estimated."""
        names = self.library.conditions
        here = {name: self.values[rows, k] for k, name in enumerate(names)}
        return Memory(self.library.at(speeds, here), self.library.flight_at(speeds, here))

    def update(self, rows: IntArray, speeds: Array, torque: Array) -> None:
        """Take in the strides that robots have made.

        Args:
            rows: Which robots.
            speeds: Speeds of their gaits [m/s], shape (m,).
            torque: Torques that were delivered, feedback included, on the phase grids of stance and
                flight [N m], shape (m, 2, samples, 12).
        """
        nodes = self._expected.nodes(speeds)
        nodes = nodes.reshape(len(rows), -1, np.prod(nodes.shape[-3:]))  # (m, nodes, samples)
        for row, curves, delivered in zip(rows, nodes, torque, strict=True):
            found = self._nearest(row, curves @ curves.T, curves @ delivered.ravel())
            step = 1.0 if self.strides[row] < FIRST_STRIDES else _STEP
            self.values[row] += step * (found - self.values[row])
            self.strides[row] += 1

    def _nearest(self, row: int, gram: Array, projected: Array) -> Array:
        """Conditions whose torque is nearest to that of a stride, beginning with the last ones.

        Args:
            row: The robot.
            gram: Scalar products of the nodes' torques with each other, shape (nodes, nodes).
            projected: Those with the stride's, shape (nodes,).
        """
        here = zip(self.values[row], self._axes, strict=True)
        place = np.array([np.interp(value, axis, np.arange(len(axis))) for value, axis in here])
        hats = [_hat(p, len(x)) for p, x in zip(place, self._axes, strict=True)]
        for _ in range(_SWEEPS):
            before = place.copy()
            for k, axis in enumerate(self._axes):
                # Torques along this condition alone: weights of the nodes, (m_k, nodes).
                along = [np.eye(len(axis)) if j == k else hat[None] for j, hat in enumerate(hats)]
                weights = _outer(along)
                place[k] = _least(weights @ gram @ weights.T, weights @ projected)
                hats[k] = _hat(place[k], len(axis))
            if len(hats) == 1 or np.abs(place - before).max() < _STILL:
                break
        pairs = zip(place, self._axes, strict=True)
        return np.array([np.interp(p, np.arange(len(x)), x) for p, x in pairs])


def _hat(place: float, size: int) -> Array:
    """Weights of linear interpolation at a fractional index, shape (size,)."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(place - np.arange(size))))


def _outer(along: list[Array]) -> Array:
    """Weights of all nodes from those of each axis, (1 or m_k, m_i) each: (m_k, nodes)."""
    weights = along[0]
    for following in along[1:]:
        weights = (weights[:, :, None] * following[:, None, :]).reshape(
            max(len(weights), len(following)), -1
        )
    return weights


def _least(gram: Array, projected: Array) -> float:
    """Fractional index at which a piecewise linear curve of torques is nearest to one.

    Args:
        gram: Scalar products of its nodes, shape (m, m).
        projected: Scalar products of its nodes with the torque, shape (m,).
    """
    if len(gram) == 1:
        return 0.0
    lower = np.arange(len(gram) - 1)
    upper = lower + 1
    own, other, cross = gram[lower, lower], gram[upper, upper], gram[lower, upper]
    square = np.maximum(own - 2.0 * cross + other, 1e-30)
    slope = projected[upper] - projected[lower] - cross + own
    share = np.clip(slope / square, 0.0, 1.0)
    # |L - tau|^2 - |tau|^2 at the best place of each piece
    rest = own - 2.0 * projected[lower] - 2.0 * share * slope + share**2 * square
    best = int(np.argmin(rest))
    return float(best + share[best])
