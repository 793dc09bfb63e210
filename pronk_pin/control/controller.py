"""Event-driven controller: a tape at every event, an update of the feedforward at touchdown.

Control of n robots that pronk at their own speeds. The events and the clock belong to whoever plays
the tapes; the controller is called at each touchdown, lift-off and landing of a stride.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._checks import Interval, instance_of, known_name, real
from .._typing import Array, BoolArray, IntArray
from ..errors import InvalidInput
from ..gait import Gait, known_gaits
from ..kinematics import leg_geometry, rotate_leg
from ..robot import BASES, Robot, as_array, as_numbers
from .command_following import CommandFollower
from .controller_spec import ControllerSpec
from .feedback import SpeedEstimator
from .learning import (
    FIRST_STRIDES,
    SKIPPED,
    ConditionEstimate,
    GuardState,
    LawContext,
    LearningLaw,
    Memory,
    TorqueLibrary,
    anti_windup,
    bound,
    delivered,
    learned_by,
    symmetric,
)
from .prediction import StrideSettings, lifted_model
from .signals import (
    LATEST_TOUCHDOWN,
    PARTS,
    SAMPLES,
    FlightTiming,
    PhaseLog,
    Reference,
    StrideRecord,
    Tape,
    held,
    phase_grid,
    resample,
)
from .speed_command import SpeedCommand, lift_off_speed
from .tick_control import ControlTime, TickLoop

_LATE_TOUCHDOWN = 1.2
"""Length of a flight's tape, over that of its reference; beyond it the last tick is held."""


TIMESTEP = Interval(1e-5, 0.01, "s")
"""Time steps of the control that make sense."""


def _known_feedforward(feedforward: Array | None, n: int, joints: int) -> Array:
    """The feedforward to begin with [N m], shape (n, 2, samples, 12), copied; by default none."""
    shape = (n, len(PARTS), SAMPLES, joints)
    if feedforward is None:
        return np.zeros(shape)
    feedforward = as_numbers("feedforward", feedforward)
    if feedforward.shape != shape:
        raise InvalidInput(
            f"a feedforward of shape {feedforward.shape}; expected {shape}: "
            "torques on the phase grids of stance and flight for each gait"
        )
    if not np.isfinite(feedforward).all():
        raise InvalidInput("feedforward holds NaN or infinite values; give finite torques")
    return feedforward.copy()


class Controller:
    """The controller of one `ControllerSpec` for n robots, each with its own gait.

    A stride is `touchdown`, then `liftoff` with what was measured in stance, then `landing` with
    what was measured in flight.

    With a `command` the gaits change at each stride, and what is learned is stored by speed.

    Attributes:
        feedforward: The feedforward in use, on the phase grids of stance and flight [N m], shape
            (n, 2, samples, 12).
        gains: The feedback gains.
        balance: The balance of a trunk that may turn; None where it is locked.
        tick_loop: What asks the tick controller; None where tapes and gains make the torques.
        time: How long the controller has computed at events.
        guard: The guard of the learning; None without one.
        conditions: Estimate of the conditions that the robots are in; None where they begin with
            torques of none.
        skipped: Reason not to learn from the robots' last strides, index into `SKIPPED`,
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
        flight: Array | None = None,
        base: str = "locked",
        command: SpeedCommand | None = None,
        library: TorqueLibrary | None = None,
    ) -> None:
        gaits = known_gaits(robot, gaits)
        instance_of("spec", spec, ControllerSpec, "a ControllerSpec, as load_controller() returns")
        timestep = real("timestep", timestep, TIMESTEP)
        known_name("base", base, BASES)
        n = len(gaits)
        self.robot, self.spec, self.gaits = robot, spec, tuple(gaits)
        self.gains = spec.gains_of(robot)
        self.feedforward = _known_feedforward(feedforward, n, robot.nu)
        self.skipped = np.full(n, SKIPPED.index("duration unknown"), dtype=np.intp)
        self._timestep, self._base = timestep, base
        self._last = tuple(StrideRecord.unknown(n, robot.nu) for _ in PARTS)
        self._tilt = np.zeros((n, len(PARTS)))
        # Why a stance was none, index into `SKIPPED`.
        self._stance_verdict = np.zeros(n, dtype=np.intp)
        self._estimator = SpeedEstimator(
            robot, n, time_constant=spec.speed_filter, timestep=timestep
        )
        others = () if command is None else command.all_gaits
        self._stance = Reference.of(
            [gait.stance for gait in gaits], timestep, 1.0, others=[gait.stance for gait in others]
        )
        self._flight = Reference.of(
            [gait.flight for gait in gaits],
            timestep,
            LATEST_TOUCHDOWN,
            others=[gait.flight for gait in others],
        )
        self._flight_measured = self._flight.planned.copy()  # how long the last flights lasted
        if flight is not None:
            self._flight.stretch(np.arange(n), as_array("flight", flight, n, ()))
        context = self._context()
        of_flight = replace(context, part="flight")
        self._laws = [bound(spec.law, context), bound(spec.flight_law, of_flight)]
        self.balance = spec.balance.bind(context)
        self.tick_loop = None
        if spec.tick_controller is not None:
            self.tick_loop = TickLoop(spec.tick_controller, context)
        self.time = ControlTime()
        self.guard = None
        if spec.guard is not None:
            self.guard = GuardState(spec.guard, Memory(self.feedforward, self._flight.duration))
        self.conditions = None
        if library is not None and library.conditions:
            self.conditions = ConditionEstimate(library, n)
        self._always_retimes = flight is None and not any(self._laws)
        self._thigh = leg_geometry(robot).sense[:, 1]  # sense in which the thighs turn legs back
        self._lift_off_speed = np.array([lift_off_speed(gait) for gait in gaits])
        self._following = None if command is None else self._follower(command)

    def _context(self) -> LawContext:
        """What balance and the law of the stance are bound to."""
        spec, timestep = self.spec, self._timestep
        settings = StrideSettings(
            self.gains, spec.regulator, spec.speed_filter, spec.touchdown_ticks, timestep
        )
        return LawContext(
            robot=self.robot,
            gaits=self.gaits,
            controller=spec.name,
            gains=self.gains,
            base=self._base,
            timestep=timestep,
            ticks=self.max_ticks,
            part="stance",
            lifted_model=lambda gait: lifted_model(self.robot, gait, settings),
        )

    @property
    def flight(self) -> Array:
        """Durations of the flights' references [s], shape (n,)."""
        return self._flight.duration.copy()

    @property
    def laws(self) -> tuple[LearningLaw | None, ...]:
        """The learning laws, bound to the robots, in the order of `PARTS`."""
        return tuple(self._laws)

    @property
    def max_ticks(self) -> int:
        """Length of the longest tape [ticks]."""
        return int(max(self._stance.phase.shape[1], self._flight.phase.shape[1]))

    def stand(self, ticks: int = 1) -> Tape:
        """Tapes of the start-up: every robot holds the posture in which its stance begins."""
        n = len(self.gaits)
        position = np.repeat(self._stance.position[:, :1], ticks, axis=1)
        zero = np.zeros_like(position)
        length = np.full(n, ticks, dtype=np.intp)
        phase = np.zeros((n, ticks))
        return Tape(zero, position, zero, length, acceleration=zero, phase=phase)

    def touchdown(
        self,
        rows: IntArray,
        learning: BoolArray | None = None,
        *,
        late: int | None = None,
    ) -> Tape:
        """Learn from the last stride of robots that touched down, and write their stance tapes.

        Args:
            rows: Which robots.
            learning: Whether they learn from their last stride first, shape (len(rows),); by
                default none does.
            late: Ticks ago that they touched down; by default those of the specification.
        """
        usable = self.skipped[rows] == 0
        before = None if self._following is None else self._memory_of(rows)
        learns = np.zeros(len(rows), dtype=bool)
        if learning is not None:
            learns = usable & learning
            learns[learning] &= ~self._roll_back(rows[learning], usable[learning])
            learns &= ~self._recognise(rows, learns)
        self._learn(rows[learns])
        self._retime(rows[usable if self._always_retimes else learns])
        if self._following is not None and before is not None:
            self._following.touchdown(rows, before)
            self.gaits = self._following.gaits
        reference, position = self._stance, self._stance.position[rows]
        acceleration, phase = self._of_the_tick(reference, rows, slice(None))
        return Tape(
            feedforward=self._played(0, rows),
            position=position,
            velocity=reference.velocity[rows],
            length=reference.ticks[rows],
            begin=self.spec.touchdown_ticks if late is None else late,
            acceleration=acceleration,
            phase=phase,
        )

    def _follower(self, command: SpeedCommand) -> CommandFollower:
        """What lets the robots follow a command.

        Raises:
            InvalidInput: They cannot.
        """
        if self.balance is not None:
            raise InvalidInput(
                f"controller '{self.spec.name}' cannot change its gait on base '{self._base}', as "
                "the balance of a trunk that may turn is of one gait; use base 'locked'"
            )
        return CommandFollower(
            command,
            self.robot,
            self.spec,
            gaits=self.gaits,
            stance=self._stance,
            flight=self._flight,
            feedforward=self.feedforward,
        )

    def _of_the_tick(
        self, reference: Reference, rows: IntArray, ticks: slice
    ) -> tuple[Array | None, Array | None]:
        """What only a tick controller reads of a tape: accelerations and phases."""
        if self.tick_loop is None:
            return None, None
        return reference.acceleration(rows, ticks), reference.phase[rows, ticks]

    def liftoff(
        self,
        rows: IntArray,
        log: PhaseLog,
        commanded: Array | None = None,
    ) -> tuple[Tape, StrideRecord]:
        """Write the flight tapes of robots that have just finished a stance, and its record.

        Args:
            rows: Which robots.
            log: What was measured in stance.
            commanded: Speeds that are commanded for their landing (m,) [m/s], where there is a
                command. Flights go over to the gaits of them from where the stances ended.
        """
        record = self.record(0, rows, log)
        self._last[0].put(rows, self._learnable(record, rows, log))
        self._stance_verdict[rows] = self._judge_contact(log)
        self._note_tilt(0, rows, log)
        speed = self._estimator.update(rows, log)
        if self.balance is not None:
            self.balance.lift_off(rows, self._estimator.sideways[rows])
        began = self._flight.position[rows, 0]  # where the stances end
        following = self._following if commanded is not None else None
        if following is not None and commanded is not None:
            self._lift_off_speed[rows] = following.lift_off(
                rows,
                commanded,
                speed,
                rising=self._estimator.upward[rows],
                joints=log.joints[np.arange(len(rows)), log.length - 1],
            )
        turn = self.spec.regulator.turn(speed - self._lift_off_speed[rows])[:, None]
        reference = self._flight
        ticks = slice(int(_LATE_TOUCHDOWN * reference.ends(rows).max()))
        share, rate = self.spec.regulator.profile(reference.phase[rows, ticks])  # (m, ticks)
        share, rate = share * turn, rate * turn / reference.duration[rows, None]
        position = rotate_leg(self.robot, reference.position[rows, ticks], share[..., None])
        velocity = reference.velocity[rows, ticks]
        velocity[..., 1::3] += self._thigh * rate[..., None]
        if following is not None:
            position, velocity = following.joined(rows, began, position, velocity)
        acceleration, phase = self._of_the_tick(reference, rows, ticks)
        if acceleration is not None and phase is not None:
            curvature = self.spec.regulator.profile_curvature(phase)
            curvature *= turn / reference.duration[rows, None] ** 2
            acceleration[..., 1::3] += self._thigh * curvature[..., None]
        tape = Tape(
            self._played(1, rows, ticks),
            position,
            velocity,
            reference.ticks[rows],
            acceleration=acceleration,
            phase=phase,
        )
        return tape, record

    def landing(
        self,
        rows: IntArray,
        log: PhaseLog,
        duration: Array,
        upright: BoolArray | None = None,
    ) -> StrideRecord:
        """End a stride: make the flight's record, and judge whether the stride is learned from.

        Args:
            rows: Which robots.
            log: What was measured in flight.
            duration: How long their strides lasted [s], shape (len(rows),).
            upright: Whether they have not fallen, shape (len(rows),); all by default.
        """
        record = self.record(1, rows, log)
        self._last[1].put(rows, record)
        # Contact is made between two ticks.
        self._flight_measured[rows] = (log.length + 0.5) * self._timestep
        relative = duration / (self._stance.planned[rows] + self._flight.planned[rows])
        reasons = []
        for last in self._last:
            last.relative_duration[rows] = relative
            last.upright[rows] = True if upright is None else upright
            reasons.append(self.spec.selection.skipped(last)[rows])
        reasons.append(self._stance_verdict[rows])
        self._note_tilt(1, rows, log)
        tilted = self._tilt[rows].max(axis=1) > self.spec.selection.tilt
        reasons.append(np.where(tilted, SKIPPED.index("tilted"), 0))
        self.skipped[rows] = np.select([reason > 0 for reason in reasons], reasons, default=0)
        return record

    def _note_tilt(self, part: int, rows: IntArray, log: PhaseLog) -> None:
        """Note the largest angle between trunk and gait in a part of the stride, as estimated."""
        if self.balance is not None and log.pose is not None:
            self._tilt[rows, part] = self.balance.tilt(part, rows, log.pose, log.length)

    def _judge_contact(self, log: PhaseLog) -> IntArray:
        """Reasons for which stances do not count, as indices into `SKIPPED`, shape (m,)."""
        if log.load is None:
            return np.zeros(len(log.length), dtype=np.intp)
        detector = self.spec.contact
        stance = detector.stance(log.load / (self.robot.mass * self.robot.gravity), log.length)
        wrong = [detector.false_touchdown(stance, log.length), detector.contact_lost(stance)]
        names = [SKIPPED.index("false touchdown"), SKIPPED.index("contact lost")]
        return np.asarray(np.select(wrong, names, default=0), dtype=np.intp)

    def _played(self, part: int, rows: IntArray, ticks: slice = slice(None)) -> Array:
        """Feedforward at the ticks of a part of the stride [N m], shape (m, ticks, 12)."""
        phase = (self._stance, self._flight)[part].phase[rows, ticks]
        return resample(self.feedforward[rows, part], phase * (SAMPLES - 1))

    def record(self, part: int, rows: IntArray, log: PhaseLog) -> StrideRecord:
        """Make the record of a part of the stride (an index into `PARTS`) from what was measured.

        Aligned on the phase s = t / T of the reference.
        """
        reference = (self._stance, self._flight)[part]
        index = log.index(phase_grid(), reference.duration[rows] / self._timestep)
        ticks = slice(min(reference.position.shape[1], log.joints.shape[1]))
        error = reference.position[rows, ticks] - log.joints[:, ticks]
        rate = reference.velocity[rows, ticks] - log.joint_rates[:, ticks]
        error, rate = resample(error, index), resample(rate, index)
        return StrideRecord(
            error=error,
            error_rate=rate,
            feedback=resample(log.feedback, index),
            feedforward=self.feedforward[rows, part],
            missing=resample(log.missing, index),
            error_onward=held(error),
            rate_onward=held(rate),
            relative_duration=np.full(len(rows), np.nan),
            upright=np.ones(len(rows), dtype=bool),
            robot=rows,
        )

    def _learnable(self, record: StrideRecord, rows: IntArray, log: PhaseLog) -> StrideRecord:
        """The record of a stance without the errors that the balance regulates."""
        if self.balance is None or log.pose is None:
            return record
        reference, ticks = self._stance, log.joints.shape[1]
        kept = self.balance.unlearned(rows, log.pose, reference.position[rows, :ticks])
        rate = np.gradient(kept, self._timestep, axis=1)
        index = log.index(phase_grid(), reference.duration[rows] / self._timestep)
        kept, rate = resample(kept, index), resample(rate, index)
        return record.less(kept, rate, self.gains.feedback(kept, rate))

    def _roll_back(self, rows: IntArray, usable: BoolArray) -> BoolArray:
        """Let the guard judge the last strides of robots that learn; those that grew go back.

        Args:
            rows: Which robots.
            usable: Whether their last strides can be learned from, shape (m,).

        Returns:
            Which of them went back, shape (m,).
        """
        if self.guard is None:
            return np.zeros(len(rows), dtype=bool)
        squares = [np.mean(last.error[rows] ** 2, axis=(1, 2)) for last in self._last]
        back = self.guard.judge(
            rows, usable, np.sqrt(np.mean(squares, axis=0)), self._memory_of(rows)
        )
        who = rows[back]
        self.feedforward[who] = self.guard.best.feedforward[who]
        self._flight.stretch(who, self.guard.best.flight[who])
        return back

    def _recognise(self, rows: IntArray, learns: BoolArray) -> BoolArray:
        """Go on with what the library has for the conditions that the last strides show.

        Robots that learn do so in their first strides, and begin to learn from there.

        Args:
            rows: Which robots.
            learns: Whether they are to learn from their last strides, shape (m,).

        Returns:
            Which of them learn in this way, shape (m,).
        """
        conditions = self.conditions
        if conditions is None:
            return np.zeros(len(rows), dtype=bool)
        recognises = learns.copy()
        if any(self._laws):
            recognises &= conditions.strides[rows] < FIRST_STRIDES
        if self._following is not None:
            recognises &= self._following.steady(rows)
        who = rows[recognises]
        if who.size:
            records = [delivered(last.take(who)) for last in self._last]
            torque = np.stack([each.feedforward + each.feedback for each in records], axis=1)
            speeds = np.array([self.gaits[row].speed for row in who])
            # Of all speeds that are stored, where there is a command.
            stored = speeds[:, None] if self._following is None else self._following.stored(who)
            each, at = np.repeat(who, stored.shape[1]), stored.ravel()
            before = conditions.memory(each, at)
            conditions.update(who, speeds, torque)
            after = conditions.memory(each, at)
            change = Memory(
                *(
                    (new - old).reshape(*stored.shape, *new.shape[1:])
                    for new, old in zip(after, before, strict=True)
                )
            )
            if self._following is None:
                self.feedforward[who] += change.feedforward[:, 0]
                self._flight.stretch(who, self._flight.duration[who] + change.flight[:, 0])
                self._retime(who)  # conditions in between land in between
            else:
                self._following.shift(who, change)
        return recognises

    @property
    def learns(self) -> bool:
        """Whether anything is learned from strides: by laws, or of the conditions."""
        return any(law is not None for law in self._laws) or self.conditions is not None

    def _memory_of(self, rows: IntArray) -> Memory:
        """What some robots play, copied."""
        return Memory(self.feedforward[rows], self._flight.duration[rows])

    def _learn(self, rows: IntArray) -> None:
        """Update the feedforward of some robots from their last stride."""
        if rows.size:
            self.feedforward[rows] = self._next_feedforward(rows, self.spec.coupling)

    def _next_feedforward(self, rows: IntArray, coupling: float) -> Array:
        """The feedforward that the laws make of the last stride, shape (m, 2, samples, 12)."""
        following = self.feedforward[rows]
        for part, law in enumerate(self._laws):
            if law is not None:
                record = self._last[part].take(rows)
                shown = self._learnable_record(part, rows, record, coupling)
                learned = learned_by(law, shown, self.spec.name)
                if self.guard is not None:
                    step = self.guard.step[rows, None, None]
                    learned = record.feedforward + step * (learned - record.feedforward)
                following[:, part] = anti_windup(learned, record, self.robot.tau_max)
        return following

    def _learnable_record(
        self, part: int, rows: IntArray, record: StrideRecord, coupling: float
    ) -> StrideRecord:
        """Prepare the record that a law learns from: delivered torques, look-ahead, symmetry."""
        learnable = delivered(record)
        if part == 1:
            # What the end of a flight does shows in the stance that follows it, which is yet to
            # come; it will be like the last one.
            ratio = self._flight.duration[rows] / self._stance.duration[rows]
            learnable = learnable.onward(self._last[0].take(rows), ratio, coupling)
            if self.balance is not None:
                share = self.spec.balance.landing
                learnable = learnable.changed(lambda values: share * values)
        return symmetric(self.robot, learnable) if self._base == "free" else learnable

    def _retime(self, rows: IntArray) -> None:
        """Stretch the references of the next flights of some robots to the measured durations."""
        if self.spec.timing is not None and rows.size:
            self._flight.stretch(rows, self._next_flight(rows, self.spec.timing))

    def _next_flight(self, rows: IntArray, timing: FlightTiming) -> Array:
        """Durations of the next flights' references that the timing makes of the last [s], (m,)."""
        last = self._flight.duration[rows]
        following = timing.next(last, self._flight_measured[rows], self._flight.planned[rows])
        if self.guard is not None:
            following = last + self.guard.step[rows] * (following - last)
        return following

    def unlearn_last(self) -> None:
        """Learn nothing from the last strides: they were played with other torques than now."""
        self.skipped[:] = SKIPPED.index("duration unknown")

    def take_over(self, before: Controller) -> None:
        """Go on with what another controller of the same robots has estimated of their speeds."""
        if before.spec.speed_filter == self.spec.speed_filter:
            self._estimator = before._estimator

    @property
    def memory(self) -> Memory:
        """What is played in the next stride: feedforward, and how long the flight is to last."""
        return Memory(self.feedforward.copy(), self.flight)

    @memory.setter
    def memory(self, memory: Memory) -> None:
        self.feedforward[:] = memory.feedforward
        self._flight.stretch(np.arange(len(self.gaits)), memory.flight)

    def learned(self, *, coupling: float | None = None) -> Memory:
        """What the robots would play if they learned from their last stride, which they do not.

        Those of whose last stride nothing can be learned would go on as they are.

        Args:
            coupling: By default that of the specification.
        """
        rows = np.flatnonzero(self.skipped == 0)
        feedforward, flight = self.memory
        if rows.size:
            coupling = self.spec.coupling if coupling is None else coupling
            feedforward[rows] = self._next_feedforward(rows, coupling)
            if self.spec.timing is not None:
                flight[rows] = self._next_flight(rows, self.spec.timing)
        return Memory(feedforward, flight)
