"""The controller: a tape at every event, learning at every touchdown.

Control of n robots that pronk at their own speeds. The state machine and the clock belong to
whoever plays the tapes; the controller is called at the events and answers with the next tape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .._state import known_name
from .._typing import Array, BoolArray, IntArray
from ..errors import InvalidInput
from ..gait import Gait
from ..kinematics import rotate_leg
from ..robot import NL, Robot
from .estimation import SpeedEstimator
from .filters import ZeroPhaseFilter
from .learning import (
    CurrentIterationILC,
    LearningLaw,
    ModelBasedILC,
    PaperILC,
    PDTypeILC,
    StrideSelection,
    anti_windup,
    given,
)
from .linearise import Settings, lifted_model
from .record import SAMPLES, PhaseLog, StrideRecord, phase_grid, resample
from .regulation import LegAngleRegulator
from .tape import Gains, Tape

SOURCES = ("none", "model", "library")
"""Where a controller's first feedforward can come from."""

LATEST_TOUCHDOWN = 2.0
"""Flight ends without a touchdown after this many times its planned duration."""


@dataclass(frozen=True)
class ControllerSpec:
    """A controller of the comparison: where its feedforward comes from, and whether it learns.

    Attributes:
        name: Short name, as on the command line.
        source: Where its feedforward comes from at first: "none", "model" or "library".
        law: Learning law that is switched on later, if any.
        gains: Feedback gains: eq. (9).
        regulator: Speed regulation: eq. (12).
        selection: Strides worth learning from.
        speed_filter: Time constant of the speed estimate's filter [s].
        touchdown_ticks: Ticks by which a touchdown is felt late: the stance is entered there. The
            contact sensor is one late, and the contact began between two ticks.
    """

    name: str
    source: str = "none"
    law: LearningLaw | None = None
    gains: Gains = field(default_factory=Gains)
    regulator: LegAngleRegulator = field(default_factory=LegAngleRegulator)
    selection: StrideSelection = field(default_factory=StrideSelection)
    speed_filter: float = 0.02
    touchdown_ticks: int = 2

    def __post_init__(self) -> None:
        known_name("source of feedforward", self.source, SOURCES)
        if self.touchdown_ticks < 1:
            raise InvalidInput("touchdown_ticks must be 1 or more: contacts are sensed a tick late")


CONTROLLERS = {
    spec.name: spec
    for spec in (
        ControllerSpec("pd"),
        ControllerSpec("ilc", law=PDTypeILC()),
        ControllerSpec("model", source="model"),
        ControllerSpec("library", source="library"),
        ControllerSpec("model+ilc", source="model", law=PDTypeILC()),
        ControllerSpec("ilc-paper", law=PaperILC()),
        ControllerSpec("ilc-paper-exact", law=PaperILC(filter=ZeroPhaseFilter.butterworth(3, 0.1))),
        ControllerSpec("ilc-current", law=CurrentIterationILC()),
    )
}
"""Controllers known by name; the first five make the default comparison."""


def load_controller(name: str) -> ControllerSpec:
    """The controller of that name.

    Raises:
        UnknownName: There is none.
    """
    return CONTROLLERS[known_name("controller", name, CONTROLLERS)]


class Controller:
    """Runs one `ControllerSpec` on n robots, each with its own gait.

    Attributes:
        feedforward: The feedforward in use, on the phase grid of stance [N m], shape
            (n, samples, 12).
        learning: Whether the law is switched on.
        skipped: Why the robots' last strides are not worth learning from, index into `SKIPPED`,
            shape (n,).
    """

    def __init__(
        self,
        robot: Robot,
        gaits: Sequence[Gait],
        spec: ControllerSpec,
        *,
        timestep: float,
        feedforward: Array | None = None,
    ) -> None:
        n = len(gaits)
        if feedforward is None:
            feedforward = np.zeros((n, SAMPLES, NL))
        if feedforward.shape != (n, SAMPLES, NL):
            raise InvalidInput(
                f"a feedforward of shape {feedforward.shape}; expected {(n, SAMPLES, NL)}: "
                "torques on the phase grid of stance for each gait"
            )
        self.robot, self.spec, self.gaits = robot, spec, tuple(gaits)
        self.feedforward = feedforward.copy()
        self.learning = False
        self._timestep = timestep
        self.skipped = np.zeros(n, dtype=np.intp)
        self._last = StrideRecord.unknown(n)
        self._estimator = SpeedEstimator(
            robot, n, time_constant=spec.speed_filter, timestep=timestep
        )
        self._law = spec.law
        if isinstance(spec.law, ModelBasedILC):
            settings = Settings(
                spec.gains, spec.regulator, spec.speed_filter, spec.touchdown_ticks, timestep
            )
            self._law = spec.law.along([lifted_model(robot, gait, settings) for gait in gaits])
        self._tabulate()

    def _tabulate(self) -> None:
        """References at the ticks, for all robots at once: shapes (n, ticks, 12)."""
        dt, gaits = self._timestep, self.gaits
        self._stance_time = np.array([gait.stance.duration for gait in gaits])
        self._flight_time = np.array([gait.flight.duration for gait in gaits])
        self.stance_ticks = np.round(self._stance_time / dt).astype(np.intp)
        self.flight_ticks = np.ceil(LATEST_TOUCHDOWN * self._flight_time / dt).astype(np.intp)
        self._phase = _phases(self._stance_time, int(self.stance_ticks.max()), dt)
        stance = [g.stance.joint_reference(s) for g, s in zip(gaits, self._phase, strict=True)]
        self._stance = np.stack([reference for reference, _ in stance])
        self._stance_rate = np.stack([rate for _, rate in stance])

        phase = _phases(self._flight_time, int(self.flight_ticks.max()), dt)
        flight = [g.flight.joint_reference(s) for g, s in zip(gaits, phase, strict=True)]
        self._flight = np.stack([reference for reference, _ in flight])
        # Past its planned end the flight holds the posture of touchdown.
        moving = (phase < 1.0)[..., None]
        self._flight_rate = np.where(moving, np.stack([rate for _, rate in flight]), 0.0)
        share = [self.spec.regulator.profile(s) for s in phase]
        self._turn = np.stack([value for value, _ in share])
        self._turn_rate = np.stack([rate for _, rate in share]) / self._flight_time[:, None]
        self._lift_off_speed = np.array(
            [gait.stance.base_reference(np.array([1.0]))[1][0, 0] for gait in gaits]
        )

    @property
    def max_ticks(self) -> int:
        """Length of the longest tape."""
        return int(max(self.stance_ticks.max(), self.flight_ticks.max()))

    def stand(self) -> Tape:
        """One tick of the start-up: every robot holds the posture in which its stance begins."""
        position = self._stance[:, :1]
        zero = np.zeros_like(position)
        return Tape(zero, position, zero, np.ones(len(position), dtype=np.intp))

    def touchdown(self, rows: IntArray, duration: Array, upright: BoolArray | None = None) -> Tape:
        """Stance tapes for robots that have just touched down; learns from their last stride.

        Args:
            rows: Which robots.
            duration: How long their strides lasted [s], shape (len(rows),).
            upright: Whether they have not fallen, shape (len(rows),); all by default.
        """
        self._judge(rows, duration, upright)
        if self.learning and self._law is not None:
            self._learn(self._law, rows)
        return Tape(
            feedforward=resample(self.feedforward[rows], self._phase[rows] * (SAMPLES - 1)),
            position=self._stance[rows],
            velocity=self._stance_rate[rows],
            length=self.stance_ticks[rows],
            begin=self.spec.touchdown_ticks,
        )

    def liftoff(self, rows: IntArray, log: PhaseLog) -> tuple[Tape, StrideRecord]:
        """Flight tapes for robots that have just finished a stance, and the stance's record."""
        record = self._record(rows, log)
        self._last.put(rows, record)
        speed = self._estimator.update(rows, log)
        turn = self.spec.regulator.turn(speed - self._lift_off_speed[rows])[:, None]
        share, rate = self._turn[rows] * turn, self._turn_rate[rows] * turn  # (m, ticks)
        position = rotate_leg(self.robot, self._flight[rows], share[..., None])
        velocity = self._flight_rate[rows].copy()
        velocity[..., 1::3] += rate[..., None]
        tape = Tape(np.zeros_like(position), position, velocity, self.flight_ticks[rows])
        return tape, record

    def _record(self, rows: IntArray, log: PhaseLog) -> StrideRecord:
        """The stance on the phase grid, aligned on t / T of the reference."""
        index = log.index(phase_grid(), self._stance_time[rows] / self._timestep)
        ticks = slice(self._stance.shape[1])
        error = self._stance[rows] - log.joints[:, ticks]
        rate = self._stance_rate[rows] - log.joint_rates[:, ticks]
        return StrideRecord(
            error=resample(error, index),
            error_rate=resample(rate, index),
            feedback=resample(log.feedback, index),
            feedforward=self.feedforward[rows],
            missing=resample(log.missing, index),
            contact_error=np.abs(error[:, : log.felt]).max(axis=1, initial=0.0),
            relative_duration=np.full(len(rows), np.nan),
            upright=np.ones(len(rows), dtype=bool),
            robot=rows,
        )

    def _judge(self, rows: IntArray, duration: Array, upright: BoolArray | None) -> None:
        """Complete the records of the last strides, and tell why some teach nothing."""
        self._last.relative_duration[rows] = duration / (
            self._stance_time[rows] + self._flight_time[rows]
        )
        self._last.upright[rows] = True if upright is None else upright
        self.skipped[rows] = self.spec.selection.skipped(self._last.take(rows))

    def _learn(self, law: LearningLaw, rows: IntArray) -> None:
        """Update the feedforward of those robots whose last stride is worth learning from."""
        rows = rows[self.skipped[rows] == 0]
        if rows.size:
            record = self._last.take(rows)
            learned = law.update(given(record))
            self.feedforward[rows] = anti_windup(learned, record, self.robot.tau_max)


def _phases(durations: Array, ticks: int, timestep: float) -> Array:
    """Phase s at each tick, held at 1, shape (n, ticks)."""
    return np.minimum(np.arange(ticks) * timestep / durations[:, None], 1.0)
