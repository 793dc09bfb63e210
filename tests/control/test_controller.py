from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from pronk_pin._typing import Array, BoolArray
from pronk_pin.control import (
    CONTROLLERS,
    SAMPLES,
    SKIPPED,
    Controller,
    ControllerSpec,
    Gains,
    LawContext,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    PhaseLog,
    StrideRecord,
    Tape,
    ZeroPhaseFilter,
    load_controller,
    phase_grid,
)
from pronk_pin.errors import InvalidInput, LeakyFilter, UnknownName
from pronk_pin.gait import Gait
from pronk_pin.kinematics import leg_angle
from pronk_pin.robot import Robot

DT = 0.001
BOTH = np.arange(2)
STANCE_LAW = PDTypeILC()


@pytest.fixture
def controller(robot: Robot, gaits: list[Gait]) -> Controller:
    return Controller(robot, gaits, load_controller("ilc"), timestep=DT)


@pytest.fixture
def flights(gaits: list[Gait], phase_log: Callable[..., PhaseLog]) -> PhaseLog:
    """Logs of flights as planned."""
    ticks = round(gaits[0].flight.duration / DT)
    references = [g.flight.joint_reference(_phases(g.flight.duration, ticks)) for g in gaits]
    return phase_log(*(np.stack(part) for part in zip(*references, strict=True)))


@pytest.fixture
def learn(gaits: list[Gait], flights: PhaseLog) -> Callable[..., Tape]:
    """One stride with a measured stance, and the touchdown after it, with learning on."""

    def stride(
        controller: Controller,
        stance: PhaseLog,
        *,
        duration: Array | None = None,
        upright: BoolArray | None = None,
        flight: PhaseLog = flights,
        learning: BoolArray | None = None,
    ) -> Tape:
        planned = np.array([gait.duration for gait in gaits])
        controller.liftoff(BOTH, stance)
        controller.landing(BOTH, flight, planned if duration is None else duration, upright)
        return controller.touchdown(BOTH, np.ones(2, dtype=bool) if learning is None else learning)

    return stride


@pytest.fixture
def stances(gaits: list[Gait], phase_log: Callable[..., PhaseLog]) -> Callable[..., PhaseLog]:
    """Logs of stances whose joint angles miss the reference by an offset [rad] (2, 1, 12)."""

    def build(offset: Array | float = 0.0) -> PhaseLog:
        ticks = round(gaits[0].stance.duration / DT)
        references = [g.stance.joint_reference(_phases(g.stance.duration, ticks)) for g in gaits]
        joints, joint_rates = (np.stack(part) for part in zip(*references, strict=True))
        return phase_log(joints - offset, joint_rates, sensed=2)

    return build


def _phases(duration: float, ticks: int) -> Array:
    return np.minimum(DT * np.arange(ticks) / duration, 1.0)


def test_a_stance_tape_is_the_gaits_reference_at_each_tick(
    controller: Controller, gaits: list[Gait]
) -> None:
    tape = controller.touchdown(BOTH)
    for robot, gait in enumerate(gaits):
        ticks = tape.length[robot]
        assert ticks * DT == pytest.approx(gait.stance.duration, abs=DT / 2)
        position, velocity = gait.stance.joint_reference(_phases(gait.stance.duration, ticks))
        np.testing.assert_allclose(tape.position[robot, :ticks], position, atol=1e-12)
        np.testing.assert_allclose(tape.velocity[robot, :ticks], velocity, atol=1e-12)


def test_a_stance_begins_as_late_as_the_touchdown_is_felt(controller: Controller) -> None:
    assert controller.touchdown(BOTH).begin == controller.spec.touchdown_ticks == 2


def test_a_stance_plays_the_feedforward_it_was_given(robot: Robot, gaits: list[Gait]) -> None:
    slope = np.random.default_rng(0).normal(size=(2, 2, 1, 12))
    feedforward = slope * phase_grid()[:, None]
    controller = Controller(
        robot, gaits, load_controller("library"), timestep=DT, feedforward=feedforward
    )
    tape = controller.touchdown(np.array([1]))
    s = _phases(gaits[1].stance.duration, tape.feedforward.shape[1])
    np.testing.assert_allclose(tape.feedforward[0], slope[1, 0] * s[:, None], atol=1e-12)


def test_flight_goes_on_from_stance_and_ends_in_the_posture_of_touchdown(
    controller: Controller, gaits: list[Gait], stances: Callable[..., PhaseLog]
) -> None:
    tape, _ = controller.liftoff(BOTH, stances())
    for robot, gait in enumerate(gaits):
        leaving, _ = gait.stance.joint_reference(np.array([1.0]))
        np.testing.assert_allclose(tape.position[robot, 0], leaving[0], atol=1e-3)
        # Nothing moves any more once flight lasts longer than planned.
        late = round(1.2 * gait.flight.duration / DT)
        assert late < tape.length[robot]
        np.testing.assert_array_equal(tape.velocity[robot, late:], 0.0)
        np.testing.assert_allclose(np.ptp(tape.position[robot, late:], axis=0), 0.0, atol=1e-12)


def test_the_flights_velocity_is_the_derivative_of_its_position(
    controller: Controller, gaits: list[Gait], stances: Callable[..., PhaseLog]
) -> None:
    tape, _ = controller.liftoff(BOTH, stances())
    planned = round(gaits[0].flight.duration / DT)
    difference = (tape.position[:, 2:planned] - tape.position[:, : planned - 2]) / (2.0 * DT)
    np.testing.assert_allclose(tape.velocity[:, 1 : planned - 1], difference, atol=0.05)


def test_speed_regulation_turns_the_legs_by_touchdown_and_nothing_else(
    robot: Robot, gaits: list[Gait], stances: Callable[..., PhaseLog]
) -> None:
    log = stances()
    log.joint_rates[..., 1::3] += 1.0  # the legs swing back faster: the trunk is too fast
    tape, _ = Controller(robot, gaits, ControllerSpec("pd"), timestep=DT).liftoff(BOTH, log)
    planned = [gait.flight.joint_reference(np.array([0.0, 1.0]))[0] for gait in gaits]
    begin, end = np.swapaxes(planned, 0, 1)

    np.testing.assert_allclose(tape.position[:, 0], begin, atol=1e-12)
    turned = leg_angle(robot, tape.position[:, -1]) - leg_angle(robot, end)
    assert np.all((turned < -0.005) & (turned >= -0.15))
    np.testing.assert_allclose(tape.position[:, -1, 0::3], end[:, 0::3], atol=1e-12)
    np.testing.assert_allclose(tape.position[:, -1, 2::3], end[:, 2::3], atol=1e-12)
    again = Controller(robot, gaits, ControllerSpec("pd"), timestep=DT)
    stance = again.touchdown(BOTH).position[:, 0]
    unmodified = [gait.stance.joint_reference(np.array([0.0]))[0][0] for gait in gaits]
    np.testing.assert_allclose(stance, unmodified, atol=1e-12)


def test_the_record_holds_reference_minus_measured(
    controller: Controller, stances: Callable[..., PhaseLog]
) -> None:
    offset = np.random.default_rng(0).normal(size=(2, 1, 12))
    _, record = controller.liftoff(BOTH, stances(offset))
    np.testing.assert_allclose(record.error, np.broadcast_to(offset, (2, SAMPLES, 12)), atol=1e-9)
    np.testing.assert_allclose(record.error_rate, 0.0, atol=1e-9)


def test_a_stride_as_planned_is_learned_from(
    controller: Controller, stances: Callable[..., PhaseLog], learn: Callable[..., Tape]
) -> None:
    _, record = controller.liftoff(BOTH, stances(0.1))
    tape = learn(controller, stances(0.1))
    np.testing.assert_allclose(controller.feedforward[:, 0], STANCE_LAW.update(record))
    # 0.1 rad too little everywhere asks for half of Kp * 0.1.
    np.testing.assert_allclose(tape.feedforward[:, 80], 0.05 * np.tile([35, 60, 90], (2, 4)))


def test_the_flight_is_learned_by_a_law_of_its_own(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    flights: PhaseLog,
    learn: Callable[..., Tape],
) -> None:
    spec = ControllerSpec("mine", flight_law=PDTypeILC(gain=0.3, leak=0.0))
    controller = Controller(robot, gaits, spec, timestep=DT)
    learn(controller, stances(0.1), flight=replace(flights, joints=flights.joints - 0.1))
    assert not controller.feedforward[:, 0].any()
    expected = 0.03 * np.tile([35.0, 60.0, 90.0], (2, SAMPLES, 4))
    np.testing.assert_allclose(controller.feedforward[:, 1], expected, atol=1e-9)
    tape, _ = controller.liftoff(BOTH, stances())
    np.testing.assert_allclose(tape.feedforward - expected[:, :1], 0.0, atol=1e-9)


def test_a_flight_that_ends_early_is_learned_as_if_its_end_had_gone_on(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    flights: PhaseLog,
    learn: Callable[..., Tape],
) -> None:
    short = replace(flights, joints=flights.joints - 0.1, length=flights.length - 20)
    short.joints[:, -20:] = 99.0  # what lies behind the end must not be read
    spec = ControllerSpec("mine", flight_law=PDTypeILC(gain=1.0, leak=0.0))
    controller = Controller(robot, gaits, spec, timestep=DT)
    learn(controller, stances(0.1), flight=short)
    expected = 0.1 * np.tile([35.0, 60.0, 90.0], (2, SAMPLES, 4))
    np.testing.assert_allclose(controller.feedforward[:, 1], expected, atol=1e-9)


def test_the_end_of_a_flight_is_learned_from_the_stance_that_follows(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    learn: Callable[..., Tape],
) -> None:
    open_filter = ZeroPhaseFilter.butterworth(1, 0.98)
    law = PDTypeILC(gain=1.0, leak=0.0, delta=0.1, filter=open_filter, gains=Gains(kd=(0, 0, 0)))
    spec = ControllerSpec("mine", law=law, flight_law=law)
    controller = Controller(robot, gaits, spec, timestep=DT)
    early = stances()
    # 0.1 rad in the first tenth of a stance, which is as long as 8 % of a flight or more.
    begin = round(0.1 * gaits[0].stance.duration / DT)
    early.joints[:, :begin] -= 0.1
    learn(controller, early)
    stance, flight = controller.feedforward[0, :, :, 2]
    s, ratio = phase_grid(), gaits[0].stance.duration / gaits[0].flight.duration
    seen = (s > 0.91) & (s < 0.9 + 0.1 * ratio - 0.01)
    np.testing.assert_allclose(flight[seen], 9.0, rtol=0.02)  # Kp * 0.1
    np.testing.assert_allclose(flight[s < 0.88], 0.0, atol=0.1)
    np.testing.assert_allclose(stance[s > 0.1], 0.0, atol=0.1)  # its own look-ahead ends with it


def test_a_flight_lasts_as_long_as_practice_says(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    flights: PhaseLog,
    learn: Callable[..., Tape],
) -> None:
    planned = np.array([gait.flight.duration for gait in gaits])
    late = replace(flights, length=flights.length - 6)

    def posture_at_touchdown(controller: Controller) -> Array:
        tape, _ = controller.liftoff(BOTH, stances())
        return tape.position[BOTH, late.length, 2::3].copy()  # eq. (12) turns the thighs

    expected = np.stack([gait.flight.joint_reference(np.ones(1))[0][0, 2::3] for gait in gaits])
    for name, learning, kept in (
        ("ilc", True, False),
        ("ilc", False, True),
        ("library", False, False),
        ("pd", False, True),
        ("model", True, True),
    ):
        controller = Controller(robot, gaits, load_controller(name), timestep=DT)
        as_planned = posture_at_touchdown(controller)
        for _ in range(8):
            learn(controller, stances(), flight=late, learning=np.full(2, learning))
        if kept:
            np.testing.assert_array_equal(posture_at_touchdown(controller), as_planned)
        else:
            # Contact is half a tick after the last one in flight, on average.
            missed = np.abs(posture_at_touchdown(controller) - expected).max()
            assert missed < 0.5 * DT * 25.0 < np.abs(as_planned - expected).max()  # rad, rad/s
    assert np.all(planned > late.length * DT)


def test_nothing_is_learned_from_strides_that_are_too_short_or_too_long(
    controller: Controller,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    learn: Callable[..., Tape],
) -> None:
    learn(controller, stances(0.1), duration=np.array([0.5, 1.5]) * gaits[0].duration)
    np.testing.assert_array_equal(controller.feedforward, 0.0)


def test_each_robot_learns_when_it_is_told_to(
    controller: Controller, stances: Callable[..., PhaseLog], learn: Callable[..., Tape]
) -> None:
    learn(controller, stances(0.1), learning=np.array([False, True]))
    assert np.all(controller.feedforward[0] == 0.0)
    assert np.all(controller.feedforward[1, 0] > 0.0)


def test_what_a_robot_begins_with_is_not_forgotten_before_the_first_stride(
    robot: Robot, gaits: list[Gait]
) -> None:
    given = np.ones((2, 2, SAMPLES, 12))
    spec = load_controller("model+ilc")
    controller = Controller(robot, gaits, spec, timestep=DT, feedforward=given)
    controller.touchdown(BOTH, np.ones(2, dtype=bool))
    np.testing.assert_array_equal(controller.feedforward, given)


@pytest.mark.parametrize(("name", "learning"), [("ilc", False), ("pd", True), ("library", True)])
def test_nothing_is_learned_without_a_law_or_with_the_law_off(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    learn: Callable[..., Tape],
    name: str,
    learning: bool,
) -> None:
    controller = Controller(robot, gaits, load_controller(name), timestep=DT)
    learn(controller, stances(0.1), learning=np.full(2, learning))
    np.testing.assert_array_equal(controller.feedforward, 0.0)


def test_what_was_handed_in_is_not_changed_by_learning(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    learn: Callable[..., Tape],
) -> None:
    given = np.zeros((2, 2, SAMPLES, 12))
    spec = load_controller("model+ilc")
    controller = Controller(robot, gaits, spec, timestep=DT, feedforward=given)
    learn(controller, stances(0.1))
    assert np.any(controller.feedforward != 0.0)
    assert np.all(given == 0.0)


def test_standing_holds_the_posture_in_which_stance_begins(
    controller: Controller, gaits: list[Gait]
) -> None:
    tape = controller.stand()
    start = [gait.stance.joint_reference(np.array([0.0]))[0][0] for gait in gaits]
    np.testing.assert_allclose(tape.position[:, 0], start)
    assert not tape.velocity.any()
    assert not tape.feedforward.any()


@dataclass(frozen=True)
class Noting:
    """A law that notes where it is going to learn, and answers something to `bind`."""

    answer: object = field(default_factory=PDTypeILC)
    contexts: list[LawContext] = field(default_factory=list)

    def bind(self, context: LawContext) -> object:
        self.contexts.append(context)
        return self.answer

    def update(self, record: StrideRecord) -> Array:
        raise AssertionError("the law that it answered was to learn")


def test_each_law_is_bound_once_to_its_part_of_the_stride(
    robot: Robot,
    gaits: list[Gait],
    stances: Callable[..., PhaseLog],
    learn: Callable[..., Tape],
) -> None:
    stance, flight = Noting(), Noting()
    spec = ControllerSpec("mine", law=stance, flight_law=flight)
    learn(Controller(robot, gaits, spec, timestep=DT), stances(0.1))
    (of_stance,), (of_flight,) = stance.contexts, flight.contexts
    assert (of_stance.part, of_flight.part) == ("stance", "flight")
    assert of_stance.robot is robot
    assert of_stance.gaits == tuple(gaits)
    assert (of_stance.controller, of_stance.base) == ("mine", "locked")
    assert (of_stance.gains, of_stance.timestep) == (Gains(), DT)


def test_a_bind_that_answers_no_law_is_refused(robot: Robot, gaits: list[Gait]) -> None:
    spec = ControllerSpec("mine", law=Noting(answer=None))
    with pytest.raises(
        InvalidInput, match=r"Noting of controller 'mine' returned nothing from bind"
    ):
        Controller(robot, gaits, spec, timestep=DT)


def test_a_law_with_a_model_of_the_stance_on_a_locked_base_is_refused_elsewhere(
    robot: Robot, gaits: list[Gait]
) -> None:
    in_flight = ControllerSpec("mine", flight_law=NormOptimalILC())
    with pytest.raises(InvalidInput, match="a model of the stance as that of the flight"):
        Controller(robot, gaits, in_flight, timestep=DT)
    spec = load_controller("ilc-norm-optimal")
    with pytest.raises(InvalidInput, match=r"counts on a level trunk; .* or base 'locked'"):
        Controller(robot, gaits, spec, timestep=DT, base="sagittal")


def test_a_law_whose_filter_leaks_warns_where_its_controller_is_made(
    robot: Robot, gaits: list[Gait]
) -> None:
    with pytest.warns(LeakyFilter) as caught:
        Controller(robot, gaits, ControllerSpec("mine", law=PaperILC()), timestep=DT)
    assert [warning.filename for warning in caught] == [__file__]


def test_only_a_trunk_that_may_turn_is_balanced(robot: Robot, gaits: list[Gait]) -> None:
    made = {
        base: Controller(robot, gaits, load_controller("ilc"), timestep=DT, base=base)
        for base in ("locked", "sagittal", "free")
    }
    assert {base for base, controller in made.items() if controller.balance is None} == {"locked"}


def test_a_feedforward_of_the_wrong_shape_is_refused(robot: Robot, gaits: list[Gait]) -> None:
    with pytest.raises(
        InvalidInput, match=r"feedforward of shape \(2, 161, 12\); expected \(2, 2,"
    ):
        Controller(
            robot, gaits, ControllerSpec("pd"), timestep=DT, feedforward=np.zeros((2, SAMPLES, 12))
        )


def test_an_unknown_controller_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName) as caught:
        load_controller("lqr")
    assert str(caught.value) == (
        "unknown controller 'lqr'; choose one of: " + ", ".join(CONTROLLERS)
    )


def test_an_unknown_source_of_the_feedforward_is_refused() -> None:
    with pytest.raises(UnknownName, match="unknown source of feedforward 'oracle'"):
        ControllerSpec("mine", source="oracle")


def test_every_controller_is_known_by_its_own_name() -> None:
    assert all(name == spec.name for name, spec in CONTROLLERS.items())


def test_what_happens_before_the_touchdown_is_felt_is_not_in_the_record(
    controller: Controller, stances: Callable[..., PhaseLog]
) -> None:
    log = stances(0.01)
    log.joints[:, :2] -= 0.2
    _, record = controller.liftoff(BOTH, log)
    np.testing.assert_allclose(record.error, 0.01, atol=1e-12)


def test_a_motor_at_its_limit_does_not_wind_the_memory_up(
    controller: Controller, stances: Callable[..., PhaseLog], learn: Callable[..., Tape]
) -> None:
    log = stances(0.1)
    log.feedback[0, :, 2], log.missing[0, :, 2] = (
        9.0,
        -5.0,
    )  # the calf asked for more than its motor gave
    learn(controller, log)
    stance = controller.feedforward[:, 0]
    np.testing.assert_array_equal(stance[0, :, 2], 0.0)
    assert np.all(stance[0, :, 1] > 0.0)
    assert np.all(stance[1] > 0.0)


def test_the_reason_why_a_stride_teaches_nothing_is_told(
    controller: Controller,
    stances: Callable[..., PhaseLog],
    flights: PhaseLog,
    learn: Callable[..., Tape],
) -> None:
    assert SKIPPED[controller.skipped[0]] == "duration unknown"
    log = stances(0.1)
    log.joints[0, 50, 4] = np.nan  # a sensor failed
    learn(controller, log, upright=np.array([True, False]))
    assert [SKIPPED[code] for code in controller.skipped] == ["not finite", "fallen"]
    flights.joint_rates[1, 30, 7] = np.inf
    learn(controller, stances(0.1), upright=np.array([False, True]))
    assert [SKIPPED[code] for code in controller.skipped] == ["fallen", "not finite"]
    np.testing.assert_array_equal(controller.feedforward, 0.0)


def test_a_share_of_what_lies_beyond_is_shown() -> None:
    """Half of it: between the last error, which is held, and what follows."""
    error = np.zeros((1, SAMPLES, 12))
    own = StrideRecord.of(error + 0.2, error, error, error)
    following = StrideRecord.of(error + 0.6, error + 1.0, error, error)
    half = own.onward(following, np.array([1.0]), 0.5)
    np.testing.assert_allclose(half.error_onward, 0.4)
    np.testing.assert_allclose(half.rate_onward, 0.5)
    np.testing.assert_allclose(own.onward(following, np.array([1.0])).error_onward, 0.6)
