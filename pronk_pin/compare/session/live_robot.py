"""One robot of a live session, simulated stride by stride without a planned end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..._checks import known_name
from ..._typing import Array, IntArray
from ...control import (
    CONTROLLERS,
    PARTS,
    SAMPLES,
    SKIPPED,
    ControllerSpec,
    ModelBasedILC,
    SpeedCommand,
    SpeedProfile,
    Tape,
    TorqueLibrary,
    load_controller,
)
from ...errors import InvalidInput
from ...gait import GaitLibrary
from ...robot import Robot
from ..experiment import feedforward_by_speed
from ..metrics import feedback_share
from ..simulation import Schedule, Simulation, to_dataset
from ..world import Scenario

LONGEST_RECORDING = 120.0
"""Simulated time for which the strides of a recording have room [s]."""

ACCELERATION = 0.5
"""Rate at which the commanded speed goes to another one [m/s^2]."""

PUSH_DURATION = 0.05
"""How long a push lasts [s], as in `Scenario`."""


def can_play_live(spec: ControllerSpec) -> bool:
    """Whether a controller's gaits and torques are there at once, and can follow a command."""
    at_hand = spec.source in ("none", "model") and spec.gait_model == "urdf"
    return at_hand and not any(isinstance(law, ModelBasedILC) for law in spec.laws)


LIVE_CONTROLLERS = tuple(name for name, spec in CONTROLLERS.items() if can_play_live(spec))
"""Shipped controllers that a live session knows."""


class Moment(NamedTuple):
    """What a robot does at an instant, for whoever looks on."""

    time: float
    """Simulated time since the last reset [s]."""
    q: Array
    """Configuration in Pinocchio's layout, shape (19,)."""
    forces: Array
    """Ground's force on each foot, world frame [N], shape (4, 3)."""
    error: Array
    """Reference minus joint angles [rad], shape (12,)."""
    torque: Array
    """Torques that the tape and the gains ask for, within the motors' limits [N m], shape (12,)."""


class LiveStride(NamedTuple):
    """A stride that a robot has finished."""

    number: int
    """Its number since the last reset."""
    time: float
    """When it ended [s]."""
    calf: float
    """Peak error of the calves in stance, mean over the legs [rad]."""
    thigh: float
    """That of the thighs [rad]."""
    feedback_share: float
    """Feedback's share of the torque in stance, as in `compare.metrics`."""
    touchdown: float
    """Time by which the touchdown came later than its reference [s]."""
    speed: float
    """Mean speed [m/s]."""
    commanded: float
    """Speed that was commanded as it began [m/s]."""
    learning: bool
    """Whether the robot learns, and its controller can."""
    upright: bool
    """Whether it has not fallen."""
    skipped: str
    """Why nothing is learned from it; empty if it can be."""


class LiveRobot:
    """A robot whose controller, speed and world change while it goes.

    What is asked of it takes effect at its next touchdown, but for a push, which comes within
    `PIECE` ticks. It belongs to one thread at a time.

    Args:
        robot: The robot.
        library: Its gaits.
        controller: The controller.
        scenario: The scenario.
        speed: Commanded speed to begin with [m/s].
        seed: Of the scatter at the start, and of noise.
        apex: Apex of the gaits [m]; by default the library's own.
        look: Called with each `Moment`, some 100 of them a simulated second.

    Attributes:
        learning: Whether it learns, if its controller can.
        moment: The last instant; None before the first.
        stride_count: Strides since the last reset.
    """

    def __init__(
        self,
        robot: Robot,
        library: GaitLibrary,
        controller: ControllerSpec,
        scenario: Scenario,
        *,
        speed: float,
        seed: int = 0,
        apex: float | None = None,
        look: Callable[[Moment], object] | None = None,
    ) -> None:
        self._robot, self._library, self._apex, self._seed = robot, library, apex, seed
        self._look = look
        self._scenario = scenario
        self._named, self._spec = controller, _playable(controller)
        self._commands: dict[str, SpeedCommand] = {}
        self._sensors = np.random.default_rng(seed)
        self._kinds = [robot.joint_kinds == robot.spec.joints.index(k) for k in robot.spec.joints]
        self._limit = robot.tau_max
        self.learning = False
        self._recording = False
        self._recorded: xr.Dataset | None = None
        self.moment: Moment | None = None
        self.stride_count = 0
        self._set_out(speed)

    def _set_out(self, speed: float) -> None:
        """Make the simulation anew, from standing, at a commanded speed."""
        self._profile = SpeedProfile((0.0,), (speed,))
        command = self._command(self._spec)
        command.speed[:] = speed
        # One stream a seed, the same for every controller, as in an experiment.
        rng = np.random.default_rng(np.random.SeedSequence(self._seed))
        self._sensors = rng.spawn(1)[0]
        self.simulation = Simulation(
            self._robot,
            command.first_gaits,
            self._spec,
            self._scenario,
            schedule=Schedule(baseline=0.0, learning=LONGEST_RECORDING),
            rng=rng,
            **command.initial_feedforward._asdict(),
            command=command,
        )
        self.simulation.player.before_piece = self._before_piece
        self._standing, self._began = True, 0.0
        self._tick, self._part_began = -1, 0.0
        self.stride_count = 0

    def _command(self, spec: ControllerSpec) -> SpeedCommand:
        """The command of a controller, with what the robot has learned under it so far."""
        if spec.name not in self._commands:
            self._commands[spec.name] = SpeedCommand(
                [self._profile], self._library, torque=self._first_torque(spec), apex=self._apex
            )
        command = self._commands[spec.name]
        command.follow([self._profile])
        return command

    def _first_torque(self, spec: ControllerSpec) -> TorqueLibrary | None:
        gaits = [self._library.at(float(speed), self._apex) for speed in self._library.speeds]
        return feedforward_by_speed(spec, gaits, model=self._robot)

    @property
    def controller(self) -> ControllerSpec:
        """Its controller; here without its guard, whose memory would be of one speed."""
        return self._named

    @property
    def startup(self) -> float:
        """How long it stands before its first stride [s]; time is negative then."""
        return self.simulation.schedule.startup

    @property
    def scenario(self) -> Scenario:
        """Its scenario."""
        return self._scenario

    @property
    def time(self) -> float:
        """Simulated time since the first stride began, at the last touchdown [s]."""
        return -self.startup if self._standing else self._began + self.simulation.clock

    @property
    def upright(self) -> bool:
        """Whether it has not fallen."""
        return bool(self.simulation.upright[0])

    @property
    def profile(self) -> SpeedProfile:
        """The commanded speed since the last reset, or since the recording began."""
        return self._profile

    @property
    def skill(self) -> TorqueLibrary:
        """What it plays, by speed."""
        return replace(self._command(self._spec).learned(0), robot=self._robot.name)

    def stride(self) -> LiveStride:
        """Simulate a stride, from touchdown to touchdown; the first one from standing."""
        simulation = self.simulation
        if simulation.strides.full:
            if self._recording and self._recorded is None:
                self._recorded = self._dataset()
            self._restart_log()
        if self._standing:
            self._part_began = -self.startup
            simulation.start_up()
            self._standing = False
        self._tick, self._part_began = -1, self.time
        simulation.stride(learning=self.learning)
        self.stride_count += 1
        return self._told()

    def _told(self) -> LiveStride:
        log = self.simulation.strides
        at = 0, int(log.count[0]) - 1
        peak = log["peak_error"][at]
        calf, thigh = (float(peak[kind].mean()) for kind in (self._kinds[2], self._kinds[1]))
        torques = {name: log[name][at][0] for name in ("feedback", "feedforward")}
        stance = xr.Dataset({name: (("phase", "joint"), part) for name, part in torques.items()})
        flight = log["duration"][at] - log["stance"][at]
        return LiveStride(
            number=self.stride_count - 1,
            time=self.time,
            calf=calf,
            thigh=thigh,
            feedback_share=feedback_share(stance),
            touchdown=float(flight - log["flight_reference"][at]),
            speed=float(log["mean_speed"][at]),
            commanded=float(log["commanded"][at]),
            learning=bool(log["learning"][at]),
            upright=self.upright,
            skipped=SKIPPED[int(log["skipped"][at])] if log["skipped"][at] else "",
        )

    def _before_piece(self, rows: IntArray, tape: Tape, tick: int) -> None:
        """Tell what the robot does."""
        if self._look is None:
            return
        world, controller = self.simulation.world, self.simulation.controller
        if tick <= self._tick:  # another part of the stride; how long the one before was is known
            self._part_began = self.moment.time if self.moment else self.time  # within a piece
        self._tick = tick
        joints, rates = world.joints[0], world.joint_rates[0]
        at = 0, min(tick, tape.ticks - 1)
        error = tape.position[at] - joints
        torque = controller.gains.feedback(error, tape.velocity[at] - rates) + tape.feedforward[at]
        self.moment = Moment(
            self._part_began + tick * self._scenario.timestep,
            np.concatenate([world.pose[0], joints]),
            world.force[0].copy(),
            error,
            np.clip(torque, -self._limit, self._limit),
        )
        self._look(self.moment)

    def set_speed(self, speed: float) -> None:
        """Command another speed [m/s], to which the command goes by `ACCELERATION`."""
        now = self.simulation.clock
        current = float(self._profile.at(now))
        lasts = round(abs(speed - current) / ACCELERATION, 3)
        before = [
            corner
            for corner in zip(self._profile.times, self._profile.speeds, strict=True)
            if corner[0] < now
        ]
        # Times and speeds are rounded to what a command's words say.
        corners = [*before, (round(now, 3), round(current, 3)), (round(now + lasts, 3), speed)]
        times, speeds = zip(*corners, strict=True)
        self._profile = SpeedProfile(tuple(times), tuple(speeds))
        self._command(self._spec)

    def set_controller(self, controller: ControllerSpec) -> None:
        """Go on under another controller, with what was learned under it before."""
        spec = _playable(controller)
        if spec != self._spec:
            if self._standing:
                self._spec = spec
                self._set_out(float(self._profile.speeds[-1]))
            else:
                self.simulation.change_controller(spec, self._command(spec), self._sensors)
        self._named, self._spec = controller, spec

    def set_scenario(self, scenario: Scenario) -> None:
        """Go on in another scenario."""
        if scenario != self._scenario:
            if not self._standing:
                self.simulation.change_scenario(scenario, self._sensors)
            self._scenario = scenario
            if self._standing:
                self._set_out(float(self._profile.speeds[-1]))

    def push(self, impulse: Array) -> None:
        """Push the trunk for 50 ms, from the next tick on [N s], world frame, shape (3,)."""
        self.simulation.world.push(np.arange(1), impulse, PUSH_DURATION)

    def forget(self) -> None:
        """Play again what the controller began with."""
        self.load(self._first_torque(self._spec))

    def load(self, skill: TorqueLibrary | None) -> None:
        """Play other torques from the next touchdown on."""
        self._command(self._spec).remember(skill)
        self.simulation.controller.unlearn_last()

    def reset(self, *, forget: bool = True) -> None:
        """Begin again from standing, at the speed commanded last; by default with nothing learned.

        With the same settings the strides are then the same to the bit.
        """
        if forget:
            self._commands.clear()
            self.learning = False
        self._set_out(self._profile.speeds[-1])

    @staticmethod
    def check_controller(controller: ControllerSpec) -> None:
        """Check that a controller can be played live.

        Raises:
            InvalidInput: It cannot.
        """
        _playable(controller)

    def check_skill(self, skill: TorqueLibrary) -> None:
        """Check that torques are of this robot, and of its speed alone.

        Raises:
            InvalidInput: They are not.
        """
        if skill.conditions:
            raise InvalidInput(
                f"the skill is over {', '.join(skill.conditions)}, too, which is not estimated in "
                "a live session; load what it holds in one of them, as TorqueLibrary.in_conditions "
                "gives it"
            )
        shape = (len(PARTS), SAMPLES, self._robot.nu)
        if skill.torque.shape[-3:] != shape or skill.robot not in ("", self._robot.name):
            whose = skill.robot or "another robot"
            raise InvalidInput(
                f"the skill is of {whose}, with torques of shape {skill.torque.shape[-3:]} at each "
                f"speed, and this is {self._robot.name}, which plays {shape}; load one that it has "
                "learned"
            )

    def begin_recording(self) -> None:
        """Keep the strides from now on, for `recorded`."""
        self._recording, self._recorded = True, None
        self._restart_log()

    def recorded(self) -> xr.Dataset:
        """The strides since the recording began, which ends; see `to_dataset`.

        Raises:
            InvalidInput: There is none yet.
        """
        recording, self._recording = self._recording, False  # it begins at a touchdown
        if not recording or (self._recorded is None and not self.simulation.strides.count.any()):
            raise InvalidInput("no stride was recorded yet; let the robots go on for a second")
        return self._dataset() if self._recorded is None else self._recorded

    def _dataset(self) -> xr.Dataset:
        log, now = self.simulation.strides, round(self.simulation.clock, 3)
        log.finish(self.simulation.upright)
        corners = zip(self._profile.times, self._profile.speeds, strict=True)
        kept = [corner for corner in corners if corner[0] < now]
        times, speeds = zip(*kept, (now, round(float(self._profile.at(now)), 3)), strict=True)
        command = self._command(self._spec)
        command.follow([SpeedProfile(tuple(times), tuple(speeds))])
        attributes = {"robot": self._robot.name}
        dataset = to_dataset(
            log, self._robot, command.first_gaits, attributes=attributes, command=command
        )
        command.follow([self._profile])
        return dataset

    def _restart_log(self) -> None:
        """Number the logged strides from 0 again, and count the command's time from now on."""
        now = self.simulation.clock
        speeds = (round(float(self._profile.at(now)), 3), self._profile.speeds[-1])
        lasts = max(round(self._profile.times[-1] - now, 3), 0.0)
        self._began += now
        self._profile = SpeedProfile((0.0, lasts), speeds)
        self._command(self._spec)
        self.simulation.restart_log()


def _playable(controller: ControllerSpec) -> ControllerSpec:
    if not can_play_live(controller):
        if controller.name in CONTROLLERS:
            known_name("controller of a live session", controller.name, LIVE_CONTROLLERS)
        raise InvalidInput(
            f"controller '{controller.name}' needs strides or gaits that are made beforehand, or "
            "learns by a model of one gait; choose another one, as ilc or model+ilc, and load what "
            "was learned"
        )
    return replace(load_controller(controller), guard=None)
