"""Stability of learning over the strides: the slow oscillation of stance, flight and timing.

Errors early in stance are corrected by the law of the stance, by that of the flight, which looks
ahead over the touchdown, and by the flight's timing. Linearised about what was learned, the memory
u (feedforward of both parts in a few modes, and the flight's duration) goes on by

    du_{k+1} = sum_j A_j du_{k-j},    A_j = d(learned)/d(record) R_j,

where the response R_j is what a change of one stride's memory does to the record of the j-th stride
after it: speed and height carry it on. The response is simulated, one robot for each mode, while
nothing is learned; what is learned of a record is asked of the controller itself
(`Controller.learned`), for any coupling. Growth per stride is the largest magnitude among the
eigenvalues of the companion matrix that oscillate.

It neglects that a touchdown comes in whole time steps: changes are as large as to cross a few of
them, and the slope is the mean over that. It covers no guard, and all legs share their modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..._checks import SHARE, real, reals, sequence_of
from ..._typing import Array, IntArray
from ...control import PARTS, SAMPLES, ControllerSpec, Memory, phase_grid
from ...errors import InvalidInput
from ...gait import Gait, GaitLibrary
from ...robot import Robot, RobotSpec
from ..simulation import Schedule, Simulation
from ..world import Scenario
from .learning_runs import machine_and_gaits

COUPLINGS = (1.0, 0.8, 0.6, 0.5, 0.0)

_HATS = 8
"""Modes of a joint's torque in a part of the stride: hat functions over the phase."""
_TORQUE, _TIME = 8.0, 0.01
"""Changes of a stride's feedforward [N m] and of the flight's duration [s], up and down."""
_KICKS = (0.004, 0.008, 0.012)
"""Changes of the flight's duration that learning has to recover from [s], up and down."""
_RESTING, _RESPONSE, _RECOVERY = 14, 8, 30
"""Strides until a motion is steady, of the response, and of the recovery that is measured."""
_OSCILLATION = (4.0, 20.0)
"""Periods of what counts as an oscillation [strides]."""
_LEARNING = 40.0
"""Time to learn what is linearised about [s]."""
_STABLE = 0.5
"""Coupling with which that is learned."""


def measure_stability(
    spec: ControllerSpec,
    speeds: Sequence[float],
    scenario: Scenario,
    *,
    couplings: Sequence[float] = COUPLINGS,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
) -> pd.DataFrame:
    """Growth of the oscillation per stride of learning: predicted, and measured after kicks.

    Args:
        spec: The controller, with laws of both parts of the stride and a timing.
        speeds: Speeds [m/s].
        scenario: The scenario.
        couplings: Values of `ControllerSpec.coupling`.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.

    Returns:
        A row a speed and coupling: `predicted` and `measured` growth, and `predicted_period` and
        `measured_period` in strides.

    Raises:
        InvalidInput: The controller lacks one of the three.
    """
    speeds = reals("speeds", speeds)
    couplings = sequence_of("couplings", couplings, lambda name, a: real(name, a, SHARE))
    if spec.law is None or spec.flight_law is None or spec.timing is None:
        raise InvalidInput(
            f"controller '{spec.name}' does not learn in stance and in flight with a timing, which "
            "is what oscillates; choose one that does, as 'ilc'"
        )
    machine, library = machine_and_gaits(robot, gaits)
    rows = []
    played = [library.at(speed) for speed in speeds]  # all are there before one takes its minutes
    for speed, gait in zip(speeds, played, strict=True):
        study = _Study(replace(spec, guard=None), gait, scenario, machine)
        matrices = study.stride_maps(couplings)
        for coupling, maps in zip(couplings, matrices, strict=True):
            predicted = _slowest_oscillation(np.linalg.eigvals(_companion(maps)))
            measured = _slowest_oscillation(_poles(study.recovery(coupling)))
            row = {"speed": speed, "coupling": coupling}
            for name, (growth, period) in (("predicted", predicted), ("measured", measured)):
                row |= {name: growth, f"{name}_period": period}
            rows.append(row)
    return pd.DataFrame(rows)


def describe_stability(table: pd.DataFrame) -> str:
    """The table of `measure_stability` as text."""
    lines = [
        "growth per stride of the slow oscillation of learning, and its period in strides;",
        "measured: after kicks of the flight's duration, without a guard",
        "",
        f"{'speed [m/s]':>11} {'coupling':>9} {'predicted':>10} {'period':>7} {'measured':>9} "
        f"{'period':>7}",
    ]
    for row in table.itertuples():
        lines.append(
            f"{row.speed:>11g} {row.coupling:>9g} {row.predicted:>10.3f} "
            f"{row.predicted_period:>7.1f} {row.measured:>9.3f} {row.measured_period:>7.1f}"
        )
    return "\n".join(lines)


def _modes(joints: int) -> Array:
    """Changes of a feedforward by one, in all legs, shape (modes, 2, samples, 12)."""
    centres = np.linspace(0.0, 1.0, _HATS)
    hats = np.maximum(0.0, 1.0 - np.abs(phase_grid()[:, None] - centres) * (_HATS - 1))
    modes = np.zeros((len(PARTS), 2, _HATS, len(PARTS), SAMPLES, joints))
    for part in range(len(PARTS)):
        for joint in (1, 2):  # thigh and calf
            modes[part, joint - 1, :, part, :, joint::3] = hats.T[..., None]
    return modes.reshape(-1, len(PARTS), SAMPLES, joints)


class _Study:
    """Learning of one controller at one speed, about what it has learned.

    Args:
        spec: The controller, without a guard.
        gait: The gait.
        scenario: The scenario.
        robot: The robot.
    """

    def __init__(self, spec: ControllerSpec, gait: Gait, scenario: Scenario, robot: Robot) -> None:
        self._robot, self._spec, self._scenario, self._gait = robot, spec, scenario, gait
        schedule = Schedule(startup=0.2, baseline=1.0, learning=_LEARNING)
        learning = self._simulation(1, replace(spec, coupling=_STABLE), schedule)
        learning.run()
        self._learned = learning.controller.memory
        self._modes = _modes(self._robot.nu)

    def _simulation(
        self, n: int, spec: ControllerSpec, schedule: Schedule, memory: Memory | None = None
    ) -> Simulation:
        return Simulation(
            self._robot,
            [self._gait] * n,
            spec,
            self._scenario,
            schedule=schedule,
            rng=np.random.default_rng(0),
            feedforward=None if memory is None else memory.feedforward,
            flight=None if memory is None else memory.flight,
        )

    def _memory(self, n: int) -> Memory:
        """What was learned, for n robots."""
        feedforward, flight = self._learned
        return Memory(np.repeat(feedforward, n, axis=0), np.repeat(flight, n))

    def _seconds(self, strides: int) -> float:
        return strides * sum(phase.duration for phase in self._gait.phases)

    def stride_maps(self, couplings: Sequence[float]) -> list[list[Array]]:
        """The matrices A_j for each coupling, in modes and the flight's duration."""
        modes, still = self._modes, np.zeros((1, *self._modes.shape[1:]))
        torque = _TORQUE * np.concatenate([modes, still, -modes, still])
        m = len(modes) + 1
        time = np.zeros(2 * m)
        time[m - 1], time[-1] = _TIME, -_TIME
        steady = self._memory(2 * m)
        schedule = Schedule(0.2, self._seconds(_RESTING + _RESPONSE + 1), 0.0, scatter=0.0)
        simulation = self._simulation(2 * m, self._spec, schedule, steady)
        controller, count = simulation.controller, 0
        maps: list[list[Array]] = [[] for _ in couplings]

        def before_stride(rows: IntArray) -> None:
            nonlocal count
            if _RESTING < count <= _RESTING + _RESPONSE:
                for found, coupling in zip(maps, couplings, strict=True):
                    found.append(self._slopes(controller.learned(coupling=coupling)))
            changed = count == _RESTING
            controller.memory = Memory(
                steady.feedforward + (torque if changed else 0.0),
                steady.flight + (time if changed else 0.0),
            )
            count += 1

        simulation.run(before_stride=before_stride)
        return maps

    def _slopes(self, learned: Memory) -> Array:
        """Slope of what is learned over the changes up and down, in modes, shape (m, m)."""
        m = len(self._modes) + 1
        steps = 2.0 * np.append(np.full(m - 1, _TORQUE), _TIME)
        torque = learned.feedforward.reshape(2 * m, -1)
        torque = (torque[:m] - torque[m:]) / steps[:, None]
        inverse = np.linalg.pinv(self._modes.reshape(m - 1, -1).T)
        flight = (learned.flight[:m] - learned.flight[m:]) / steps
        return np.vstack([inverse @ torque.T, flight])

    def recovery(self, coupling: float) -> Array:
        """Deviation of the flight's duration in strides of learning after kicks, over theirs."""
        kicks = np.array([sign * kick for kick in _KICKS for sign in (1.0, -1.0)])
        n = len(kicks)
        # The learning goes on for as long; a stride more or less does not matter.
        schedule = Schedule(0.2, 0.0, self._seconds(_RESTING + _RECOVERY + 2), scatter=0.0)
        spec = replace(self._spec, coupling=coupling)
        simulation = self._simulation(n, spec, schedule, self._memory(n))
        durations: list[Array] = []

        def before_stride(rows: IntArray) -> None:
            if len(durations) == _RESTING:
                feedforward, flight = simulation.controller.memory
                simulation.controller.memory = Memory(feedforward, flight + kicks)
            durations.append(simulation.controller.flight)

        simulation.run(before_stride=before_stride)
        after = np.array(durations[_RESTING : _RESTING + _RECOVERY])
        return np.asarray((after[:, ::2] - after[:, 1::2]).sum(axis=1) / (2.0 * sum(_KICKS)))


def _companion(maps: Sequence[Array]) -> Array:
    """Companion matrix of `du_{k+1} = sum_j A_j du_{k-j}`."""
    m, lags = len(maps[0]), len(maps)
    matrix = np.zeros((m * lags, m * lags))
    matrix[:m] = np.hstack(list(maps))
    matrix[m:, :-m] = np.eye(m * (lags - 1))
    return matrix


def _poles(values: Array, order: int = 4) -> Array:
    """Poles of a sum of damped oscillations, by linear prediction (Prony)."""
    rows = np.array([values[k : k + order] for k in range(2, len(values) - order)])
    weights = np.linalg.lstsq(rows, values[2 + order :], rcond=None)[0]
    return np.asarray(np.roots([1.0, *-weights[::-1]]))


def _slowest_oscillation(poles: npt.NDArray[Any]) -> tuple[float, float]:
    """Largest magnitude among poles that oscillate, and its period [strides]; NaN without one."""
    period = 2.0 * np.pi / np.maximum(np.abs(np.angle(poles)), 1e-9)
    oscillates = (period > _OSCILLATION[0]) & (period < _OSCILLATION[1])
    if not oscillates.any():
        return np.nan, np.nan
    slowest = int(np.argmax(np.where(oscillates, np.abs(poles), 0.0)))
    return float(np.abs(poles[slowest])), float(period[slowest])
