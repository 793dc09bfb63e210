"""Scenes from results: robots as they were simulated, each beside its reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from scipy.spatial.transform import Rotation

from ..._checks import instance_of, none_or, real, whole
from ..._typing import Array, BoolArray
from ...compare import Experiment, Results, Scenario
from ...compare.metrics import by_joint
from ...compare.report import SHOWN
from ...control import SpeedProfile
from ...errors import InvalidInput
from ...robot import Robot
from ..figure_style import PALETTE, look
from .gait_scenes import SHOWN_SPEED, nearest, numbers
from .menu import Choice, Menu
from .scene import SECOND_COLOR, Color, History, Mark, Scene, Track

BEFORE, AFTER = 3, 9
"""Strides of a window before and after the learning is switched on."""

WINDOW = BEFORE + AFTER
"""Strides that are shown together."""

FORCE_WINDOW = 1.0 / 60.0
"""Time over which forces are averaged [s]: a frame of the page."""

_REFERENCE = to_rgb(PALETTE["purple"])
_DARKEST = 0.22

ASIDE = 0.55
"""Distance of a second robot from the first [m]."""

START, LAST = "around the start of learning", "the last ones"
ALL = "the whole command"
ALONE, EARLIER = "nothing", "before learning"
RIVALS = "PD and the model"
"""What may run beside a robot: the question, whether practice beats the model, in one picture."""

_RIVALS = ("pd", "model")

SPEED, COMMAND = "speed [m/s]", "command"
CONTROLLER, SCENARIO = "controller", "scenario"
BESIDE, STRIDES = "beside it", "strides"
"""The options of the page, in their order."""


def result_menu(
    results: Results,
    *,
    speed: float | None = None,
    controller: str | None = None,
    scenario: str | None = None,
    beside: str | None = None,
    stride: int | None = None,
    command: str | None = None,
) -> Menu:
    """The robots of a result: by speed, or command, by controller, scenario and strides.

    Args:
        results: The results folder.
        speed: Desired speed shown first [m/s]; by default the one nearest to 0.5.
        controller: Controller shown first; by default "ilc", or the first that learns, or
            the first.
        scenario: Scenario shown first; by default the first.
        beside: What runs beside it: a controller, "before learning" for its own strides before
            the learning was switched on, "PD and the model", or "nothing". By default whichever of
            PD and the model the result holds, beside a robot that learns.
        stride: Show the dozen strides with this one first; by default those around the start of
            learning, or the last ones where nothing was learned; of a command all.
        command: Command shown first, where speeds were commanded; by default the first.

    Raises:
        InvalidInput: The result holds no such speed, command, controller, scenario or stride.
    """
    speed, stride = none_or(real, "speed", speed), none_or(whole, "stride", stride)
    experiment = instance_of("results", results, Results).experiment
    controllers = list(experiment.controller_names)
    if controller is None:
        preferred = [name for name in ("ilc", "library") if name in controllers]
        learners = [name for name in controllers if any(experiment.controller(name).laws)]
        controller = [*preferred, *learners, *controllers][0]
    scenario = experiment.scenario_names[0] if scenario is None else scenario
    if speed is not None and not experiment.commands:
        nearest(list(experiment.speeds), speed, "speed")  # known before anything is read
    strides = results.all_strides(controller=controller, scenario=scenario)
    robot, known, shown = _robots(results, strides, speed, command)
    windows = _windows(strides)
    reader = _Reader(results)
    rivals = [name for name in _RIVALS if name in controllers and name != controller]
    together = RIVALS if set(_RIVALS) <= set(controllers) else None
    if beside is None and START in windows and rivals:
        beside = together or rivals[0]
    first = {
        robot: shown,
        CONTROLLER: controller,
        SCENARIO: scenario,
        BESIDE: ALONE if beside is None else beside,
        STRIDES: windows[0] if stride is None else _window_of(windows, stride),
    }
    options = {
        robot: known,
        CONTROLLER: controllers,
        SCENARIO: list(experiment.scenario_names),
        BESIDE: [ALONE, EARLIER, *([together] if together else []), *controllers],
        STRIDES: windows,
    }
    return Menu(reader.scene, options, first, rounds=_rounds(robot, options, windows))


def _rounds(
    robot: str, options: Mapping[str, Sequence[str]], windows: Sequence[str]
) -> list[dict[str, Sequence[str]]]:
    """What a file holds, in this order: each scenario, controller and speed before all of them."""
    speeds, scenarios = {robot: options[robot]}, {SCENARIO: options[SCENARIO]}
    strides = {STRIDES: windows[:2] if START in windows else windows[:1]}
    controllers = {CONTROLLER: options[CONTROLLER], BESIDE: [ALONE]}
    earlier = {BESIDE: [ALONE, EARLIER]} if START in windows else {BESIDE: [ALONE]}
    return [
        scenarios,
        strides,
        speeds,
        {**controllers, **scenarios},
        {**scenarios, **strides},
        {**speeds, **strides},
        {**scenarios, **speeds},
        {**earlier, **speeds, **strides},
        {**scenarios, **speeds, **strides},
        {**controllers, **scenarios, **speeds, **strides},
    ]


def _robots(
    results: Results, strides: xr.Dataset, speed: float | None, command: str | None
) -> tuple[str, list[str], str]:
    """What robots are told apart by, the values of it, and the one that is shown first."""
    experiment = results.experiment
    given, other = (speed, "speed") if experiment.commands else (command, "command")
    if given is not None:
        instead = "command" if experiment.commands else "speed"
        raise InvalidInput(
            f"this result is of {instead}s; name a {instead}, and leave the {other} out"
        )
    if experiment.commands:
        known = list(experiment.commands)
        return COMMAND, known, known[0] if command is None else " ".join(command.split())
    speeds = list(experiment.speeds)
    if speed is not None:
        return SPEED, numbers(speeds), f"{speeds[nearest(speeds, speed, 'speed')]:g}"
    # The one of those that have something to show.
    distance = np.abs(np.asarray(speeds) - SHOWN_SPEED)
    at = int(np.argmin(np.where(strides["count"] > 0, distance, np.inf)))
    return SPEED, numbers(speeds), f"{speeds[at]:g}"


_SHOWN = (
    *("count", "start", "stance", "duration", "planned_duration", "learning", "upright"),
    *("gait_speed", "landing_speed", "peak_error", "error", "reference", "feedforward", "feedback"),
    *("base", "attitude", "tick_force"),
)
"""Variables of strides that scenes are made of."""


@dataclass(frozen=True)
class _Reader:
    """Makes the scenes of a result."""

    results: Results

    def scene(self, choice: Choice) -> Scene:
        """The scene of a choice."""
        scenario, experiment = choice[SCENARIO], self.results.experiment
        robot, world = experiment.model, experiment.scenario(scenario)
        name, beside = choice[CONTROLLER], choice[BESIDE]
        strides = self._strides(name, choice)
        shown = _cut(strides, choice[STRIDES])
        others = [other for other in _RIVALS if other != name] if beside == RIVALS else [beside]
        fallen: list[str] = []
        cuts = [(look(name).label, name, shown, strides)]
        for other in others if beside != ALONE else []:
            if other == EARLIER:
                cuts.append((EARLIER, "", _cut_before(strides), strides))
                continue
            whole = self._strides(other, choice)
            if beside == RIVALS and int(whole["count"]) == 0:
                fallen.append(look(other).label)  # before its first stride had ended
                continue
            cut = _same(whole, shown) if choice[STRIDES] == START else _cut(whole, choice[STRIDES])
            label = look(other).label + ("" if beside == RIVALS else ", beside")
            cuts.append((label, other, cut, whole))
        tracks: list[Track] = []
        for place, (label, other, cut, whole) in enumerate(cuts):
            # Robots side by side are told apart by the colours that figures have for them.
            color = _paint(other) if other else SECOND_COLOR
            measured, planned = (t.moved(y=ASIDE * place) for t in _pair(experiment, cut, label))
            measured = replace(measured, accent=color, history=_history(whole, cut))
            tracks += [replace(measured, color=color if place else None), planned]
        if len(cuts) > 2:
            tracks[0] = replace(tracks[0], color=_paint(name))
        learned = shown["start"].to_numpy()[shown["learning"].to_numpy() == 1]
        began = float(learned[0] - shown["start"][0]) if learned.size else 0.0
        note = f"; learning starts after {began:.1f} s" if began > 0.0 else ""
        fell = [label for label, _, cut, _ in cuts if bool((cut["upright"] == 0).any())]
        fallen = [*fell, *(f"{label} at once" for label in fallen)]
        if fallen:
            note += f"; fell: {', '.join(fallen)}" if len(cuts) > 1 else "; the robot fell"
        return Scene(
            robot,
            tracks,
            force_window=FORCE_WINDOW,
            title=f"{robot.name.upper()} pronking "
            + (f"at {choice[SPEED]} m/s" if SPEED in choice else f"by command {choice[COMMAND]}"),
            caption=f"scenario {scenario}, strides {choice[STRIDES]}{note}",
            friction=world.ground_friction,
            slope=world.slope,
            payload=world.payload,
            payload_position=world.payload_position,
            soft=world.ground_time_constant > Scenario("usual").ground_time_constant,
        )

    def _strides(self, controller: str, choice: Choice) -> xr.Dataset:
        """The strides of one robot."""
        by_command = COMMAND in choice
        robot = choice[COMMAND if by_command else SPEED]
        digest = self.results.strides_digest
        return _one_robot(self.results, controller, choice[SCENARIO], robot, by_command, digest)


@lru_cache(maxsize=64)
def _one_robot(
    results: Results, controller: str, scenario: str, robot: str, by_command: bool, digest: str
) -> xr.Dataset:
    """The strides of one robot, by its speed or command; kept as `_load` keeps those of all."""
    strides = _load(results, controller, scenario, digest)
    if by_command:
        return strides.sel(command=robot)
    speeds = list(strides["speed"].to_numpy())
    return strides.isel(speed=nearest(speeds, float(robot), "speed"))


@lru_cache(maxsize=8)
def _load(results: Results, controller: str, scenario: str, digest: str) -> xr.Dataset:
    """Strides, as far as scenes show them; kept as long as the files, by their `digest`, are the
    same."""
    strides = results.all_strides(controller=controller, scenario=scenario)
    return strides[[name for name in _SHOWN if name in strides]]


def _windows(strides: xr.Dataset) -> list[str]:
    """Windows of strides that the page offers."""
    count = int(strides["count"].max())
    learned = bool((strides["learning"] == 1).any())
    starts = range(0, max(count - WINDOW, 0) + 1, WINDOW)
    named = [START, LAST] if learned else [LAST]
    named = [ALL] if "command" in strides.dims else named
    return [*named, *(f"from {first} on" for first in starts)]


def _window_of(windows: list[str], stride: int) -> str:
    """The window in the list that a stride is in."""
    starts = [int(text.split()[1]) for text in windows if text.startswith("from ")]
    if not 0 <= stride < starts[-1] + WINDOW:
        raise InvalidInput(
            f"there is no stride {stride}; choose one from 0 to {starts[-1] + WINDOW - 1}"
        )
    return f"from {max(first for first in starts if first <= stride)} on"


def _cut(strides: xr.Dataset, window: str) -> xr.Dataset:
    """The strides of a window of one robot."""
    count = int(strides["count"])
    if count == 0:
        robot = "command" if "command" in strides.coords else "speed"
        raise InvalidInput(
            f"no stride was finished at {robot} {strides[robot].item()}; choose another {robot}"
        )
    if window == ALL:
        ends = SpeedProfile.parse(strides["command"].item()).duration
        return strides.isel(stride=slice(0, int((strides["start"] < ends).sum())))
    first = max(count - WINDOW, 0)
    if window == START:
        learning = np.flatnonzero(strides["learning"].to_numpy()[:count] == 1)
        first = max(int(learning[0]) - BEFORE, 0) if learning.size else first
    elif window != LAST:
        first = int(window.split()[1])
        if first >= count:
            raise InvalidInput(f"this robot finished {count} strides only; choose earlier ones")
    return strides.isel(stride=slice(first, min(first + WINDOW, count)))


def _cut_before(strides: xr.Dataset) -> xr.Dataset:
    """The last strides of one robot before the learning was switched on."""
    count = int(strides["count"])
    learning = np.flatnonzero(strides["learning"].to_numpy()[:count] == 1)
    end = int(learning[0]) if learning.size else 0
    if end == 0:
        raise InvalidInput("this robot has no strides before learning; choose another")
    return strides.isel(stride=slice(max(end - WINDOW, 0), end))


def _paint(controller: str) -> Color:
    """The colour of a controller in figures, light enough for a surface to show its shape."""
    red, green, blue = to_rgb(look(controller).color)
    return max(red, _DARKEST), max(green, _DARKEST), max(blue, _DARKEST)


def _same(strides: xr.Dataset, shown: xr.Dataset) -> xr.Dataset:
    """The strides of one robot that have the numbers of those of another; the last ones if none."""
    count, numbers = int(strides["count"]), shown["stride"].to_numpy()
    first = min(int(numbers[0]), max(count - WINDOW, 0))
    return strides.isel(stride=slice(first, min(first + len(numbers), count)))


def _history(strides: xr.Dataset, shown: xr.Dataset) -> History:
    """Errors of one robot over all its strides, on the clock of those that are shown."""
    whole = strides.isel(stride=slice(0, int(strides["count"])))
    peaks = by_joint(whole["peak_error"])
    learning = np.flatnonzero(whole["learning"].to_numpy() == 1)
    return History(
        stride=whole["stride"].to_numpy(),
        t=whole["start"].to_numpy() - float(shown["start"][0]),
        errors={joint: peaks.sel(joint=joint).to_numpy() for joint in SHOWN},
        began=int(whole["stride"][learning[0]]) if learning.size else None,
    )


def _pair(experiment: Experiment, strides: xr.Dataset, name: str) -> tuple[Track, Track]:
    """A robot as simulated, and its reference, both from time 0 and place 0 on."""
    strides, robot = strides.assign(start=strides["start"] - strides["start"][0]), experiment.model
    base = _planned_base(experiment, strides)
    measured, planned = _measured(robot, strides, name), _planned(robot, strides, base, name)
    x = -float(measured.q[0, 0])
    return measured.moved(x), planned.moved(x)


@dataclass(frozen=True)
class _Samples:
    """Times of the samples of some strides: on the phase grid, as far as each part lasted.

    Attributes:
        since: Times since the beginning of the part [s], shape (strides, 2, samples).
        begin: When the parts begin [s], shape (strides, 2, 1).
        length: How long they last [s], shape (strides, 2, 1).
        within: Which samples there are, shape (strides, 2, samples).
    """

    since: Array
    begin: Array
    length: Array
    within: BoolArray

    @classmethod
    def of(cls, strides: xr.Dataset) -> _Samples:
        """Those of the strides of one robot."""
        start, stance, whole = (strides[key].to_numpy() for key in ("start", "stance", "duration"))
        begin = np.stack([start, start + stance], axis=1)[..., None]
        length = np.stack([stance, whole - stance], axis=1)[..., None]
        planned = strides["planned_duration"].to_numpy()[..., None]  # (2, 1), or of each stride
        since = np.broadcast_to(
            strides["phase"].to_numpy() * planned, (len(start), 2, strides.sizes["phase"])
        )
        return cls(since, begin, length, since < length - 1e-9)

    @property
    def times(self) -> Array:
        """The times of all samples, one after the other [s], shape (m,)."""
        return np.asarray((self.begin + self.since)[self.within])

    def curve(self, strides: xr.Dataset, name: str) -> Array:
        """A curve at all samples, one after the other, shape (m, ...)."""
        order = ("stride", "part", "phase", ...)
        values = strides[name].transpose(*order, missing_dims="ignore").to_numpy()
        if "stride" not in strides[name].dims:
            values = np.broadcast_to(values, (len(self.since), *values.shape))
        return np.asarray(values[self.within], dtype=float)

    def forces(self, strides: xr.Dataset) -> Array | None:
        """Forces of the ground [N], shape (m, 4, 3), each the mean over `FORCE_WINDOW` about it.

        They are kept for the last strides only, tick by tick: NaN elsewhere, None if these are all
        others. A touchdown is one tick of thousands of newtons; a mean keeps its impulse, where a
        sample would miss it.
        """
        last = strides["stride"].to_numpy() - (int(strides["count"]) - strides.sizes["last"])
        shown = np.flatnonzero(last >= 0)
        if not shown.size:
            return None
        kept = strides["tick_force"].isel(last=last[shown])
        ticks = kept.transpose("last", "part", "tick", "foot", ...).to_numpy()
        ticks = ticks[np.isfinite(ticks).all(axis=(-2, -1))]  # (ticks, 4, 3), one after the other
        timestep = float(strides.attrs["timestep"])
        impulse = np.concatenate([np.zeros_like(ticks[:1]), np.cumsum(ticks, axis=0)])
        impulse = timestep * impulse.reshape(len(impulse), -1)
        begin = float(self.begin[shown[0], 0, 0])
        clock = begin + timestep * np.arange(len(impulse))
        times = self.times
        # Arrows begin and end with their phase: the mean does not reach beyond it.
        opens = np.broadcast_to(self.begin, self.since.shape)[self.within]
        closes = np.broadcast_to(self.begin + self.length, self.since.shape)[self.within]
        before = np.maximum(times - 0.5 * FORCE_WINDOW, np.maximum(opens, begin))
        after = np.minimum(times + 0.5 * FORCE_WINDOW, closes)
        impulses = [
            np.interp(after, clock, column) - np.interp(before, clock, column)
            for column in impulse.T
        ]
        span = np.maximum(after - before, timestep)
        forces = np.where(times < begin, np.nan, np.array(impulses) / span).T
        return np.asarray(forces.reshape(len(times), *ticks.shape[1:]))


def _measured(robot: Robot, strides: xr.Dataset, name: str) -> Track:
    """The robot as simulated."""
    samples = _Samples.of(strides)
    error = samples.curve(strides, "error")
    joints = samples.curve(strides, "reference") - error
    feedforward = samples.curve(strides, "feedforward")
    torque = samples.curve(strides, "feedback") + feedforward
    return Track(
        name,
        samples.times,
        _configurations(
            robot, samples.curve(strides, "base"), joints, samples.curve(strides, "attitude")
        ),
        error=error,
        torque=np.clip(torque, -robot.tau_max, robot.tau_max),
        feedforward=feedforward,
        forces=samples.forces(strides),
        marks=[
            Mark(float(begin), int(number), str(part))
            for number, begins in zip(strides["stride"], samples.begin[..., 0], strict=True)
            for part, begin in zip(strides["part"].to_numpy(), begins, strict=True)
        ],
    )


def _planned_base(experiment: Experiment, strides: xr.Dataset) -> Array:
    """The gaits' trunk from the beginning of each stride on, (strides, 2, samples, 3): x, z, pitch.

    Where speeds are commanded, a flight is that of the gait in which it lands.
    """
    s, names = strides["phase"].to_numpy(), ("gait_speed", "landing_speed")
    changing = "command" in strides.coords
    if changing:
        pairs = np.stack([strides[name].to_numpy() for name in names], axis=1)
    else:
        pairs = np.full((strides.sizes["stride"], 2), float(strides["speed"]))
    speeds, place = np.unique(pairs, return_inverse=True)
    gaits = experiment.planned_at(speeds.tolist())
    parts = np.array(
        [[part.base_reference(s)[0] for part in (gait.stance, gait.flight)] for gait in gaits]
    )
    base = parts[place.reshape(pairs.shape), np.arange(2)]
    if changing:  # the flight of another gait goes on where the stance has ended
        base[:, 1, :, 0] += (base[:, 0, -1, 0] - base[:, 1, 0, 0])[:, None]
    return base


def _planned(robot: Robot, strides: xr.Dataset, base: Array, name: str) -> Track:
    """The gait, put down where the robot touches down at the beginning of each stride."""
    samples = _Samples.of(strides)
    place = strides["base"].isel(part=0, phase=0, axis=0).to_numpy()  # (strides,)
    moved = base.copy()
    moved[..., 0] += place[:, None, None]
    x_z_pitch = moved[samples.within]
    attitude = np.zeros_like(x_z_pitch)
    attitude[:, 1] = x_z_pitch[:, 2]
    joints = samples.curve(strides, "reference")
    q = _configurations(robot, x_z_pitch[:, :2], joints, attitude)
    # Of no controller's colour: the blue of other ghosts is that of `ilc`.
    return Track(f"reference of {name}", samples.times, q, ghost=True, color=_REFERENCE)


def _configurations(robot: Robot, base: Array, joints: Array, attitude: Array) -> Array:
    """Configurations (n, 19) from the trunk's x and z, its roll, pitch and heading, and the joints.

    Where the trunk drifts sideways is not kept, and is left out.
    """
    xyz = np.column_stack([base[:, 0], np.zeros(len(base)), base[:, 1]])
    q = robot.q_from_base(xyz, joints)
    q[:, 3:7] = Rotation.from_euler("ZYX", attitude[:, ::-1]).as_quat()
    return q
