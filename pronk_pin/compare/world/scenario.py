"""Scenarios: the true parameters of simulated worlds, which the model does not know.

Scenarios go by name: `nominal`, `payload`, `payload=2+slope`, `ideal+delay`, `random-0-3`. A name
is a world to begin with, and what is different in it, joined by `+`. Each mismatch has a value of
its own, and takes another after `=`, in SI units. Without a world in front a mismatch is one of the
nominal scenario. Such a name says everything: the seed of a sampled scenario stands in it too. In
front of a name may stand a scenario of one's own, by its address or its entry point:
`my_package.worlds:hot+slope`; in Python they are added as they are: `hot + "slope"`. An engine
joins likewise, by its name or the address of one of one's own: `nominal+drake`,
`payload+my_engines:DART`; without one it is MuJoCo's.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, TypeAlias

import numpy as np

from ..._checks import (
    Interval,
    file_name,
    instance_of,
    keep_reals,
    keep_vectors,
    known_name,
    none_or,
    real,
    reals,
    text,
    whole,
)
from ..._checks import seed as known_seed
from ..._registry import (
    announced_names,
    find,
    function_address,
    imported,
    is_address,
    source_sha256,
)
from ..._typing import Array
from ...errors import InvalidInput, UnknownName
from ...robot import ROBOTS, Robot, motor_constants
from ...storage import from_text
from .mismatch import KNOWN, NOISE
from .sensors import Sensors

Vector: TypeAlias = tuple[float, float, float]

ByJoint: TypeAlias = float | tuple[float, ...]
"""A number for all joints, one for each kind of joint (hip, thigh, calf), or one for each joint in
the order of q."""

DEFAULT_ENGINE = "mujoco"
OTHER_ENGINES = ("drake",)
"""Names of the engines that are shipped; that of the first is left out in a scenario's name."""

_BY_JOINT = {
    "armature": Interval(0, 1, "kg m^2"),
    "damping": Interval(0, 50, "N m s/rad"),
    "coulomb": Interval(0, 50, "N m"),
    "torque_constant": Interval(0, 10, above=True),
}
"""What the joints' parameters can be, each of them."""
_OF_MOTORS = {"armature": "rotors", "damping": "damping", "coulomb": "coulomb"}
"""Those that may be left to the robot's motors, and what `motor_constants` calls them."""
_NUMBERS = {
    "full_torque_speed": Interval(0, 1000, "rad/s"),
    "delay": Interval(0, 0.2, "s"),
    "touchdown_latency": Interval(0, 0.05, "s"),
    "touchdown_jitter": Interval(0, 0.05, "s"),
    "payload": Interval(0, 100, "kg"),
    "ground_time_constant": Interval(0, 1, "s", above=True),
    "ground_friction": Interval(0, 10, above=True),
    "slope": Interval(-0.5, 0.5, "rad"),  # the gaits are planned on level ground
    "ground_roughness": Interval(0, 0.05, "m"),
    "step_height": Interval(0, 0.5, "m"),
    "step_length": Interval(0.05, 10, "m"),  # each step is a box in the world
    "gravity": Interval(0, 30, "m/s^2", above=True),
    "push_period": Interval(0, 3600, "s", above=True),
    "push_duration": Interval(0, 60, "s", above=True),
    "timestep": Interval(1e-5, 0.01, "s"),
}
"""What the numbers of a world for a robot of some tens of kilograms can be."""
_VECTORS = {
    "payload_position": Interval(-1, 1, "m"),
    "com_shift": Interval(-0.5, 0.5, "m"),
    "push_impulse": Interval(-200, 200, "N s"),
}


@dataclass(frozen=True)
class Scenario:
    """The true parameters of a simulated scenario.

    The robot is what its URDF or MJCF says; what the scenario adds comes on top of that. Values and
    defaults stand here. How they act: `motors.py` (delay, speed, pushes), `payload.py` (payload and
    centre of mass), `ground.py` (contact, the feet's friction, steps), `sensors.py`, and
    `build_model` in `model.py` for what MuJoCo has a parameter for (joints, slope, gravity).

    A slope is played as gravity that leans back, so that the ground's frame stays the world's: x
    goes up the slope, z stands on it, and a locked trunk stays parallel to it.

    `armature`, `damping`, `coulomb` and `torque_constant` are of all joints alike, or of each kind
    of joint, `(hip, thigh, calf)`, or of each joint in the order of `Robot.joint_names`.

    Attributes:
        name: Short name, as on the command line.
        armature: Rotor inertia as the joint feels it, through the gear, added [kg m^2]; None for
            that of the robot's motors, see `robot.motor_constants`.
        damping: Viscous friction in the joints, added [N m s/rad]; None likewise.
        coulomb: Coulomb friction in the joints, added [N m]; None likewise.
        torque_constant: Torque that a motor gives, over the torque it is asked for.
        full_torque_speed: Joint speed up to which a motor gives its greatest torque [rad/s].
        no_load_speed: Joint speed at which it gives none any more, falling linearly [rad/s]; None
            where speed does not matter.
        delay: Time from a command to its torque [s], a whole number of time steps.
        payload: Mass fixed to the trunk [kg].
        payload_position: The payload's place, in the trunk's frame [m].
        com_shift: Shift of the trunk's centre of mass, its mass and inertia kept [m].
        sensors: How far the sensors are from the truth.
        touchdown_latency: Time by which the contact sensor is later to tell of a touchdown [s], a
            whole number of time steps.
        touchdown_jitter: Greatest time that comes on top of that, drawn for each touchdown [s],
            likewise.
        ground_time_constant: Time constant of the contact [s], MuJoCo's solref; larger is softer.
        ground_friction: Friction coefficient of the feet on the ground, the mu of their cones; the
            feet's and the ground's are the same. Stored results have this name.
        slope: Slope of the ground, uphill in x where positive [rad].
        ground_roughness: Standard deviation of the ground's height [m], in bumps some 10 cm apart.
        step_height: Greatest height of the steps across the way [m].
        step_length: Length of a step along the way [m].
        gravity: Gravitational acceleration [m/s^2].
        push_impulse: Impulse of a push on the trunk's centre of mass, turned around from push to
            push [N s].
        push_period: Time between pushes; the first comes after so long, start-up included [s].
        push_duration: How long a push lasts [s].
        seed: Draws the heights of rough ground and of steps.
        timestep: Time step of the simulation and of the control [s].
        engine: Engine that simulates it: one of `ENGINES`, an entry point's name, or the address
            of one, module:object.
        engine_sha256: SHA-256 of the module of an engine at an address, by default as it is now;
            another one is refused.
        mjcf: Path of an MJCF that stands in for the robot's own URDF; empty for the URDF.
        edit: Address, module:function, of a function that changes the world's `mujoco.MjSpec`
            before it is compiled: terrain, another foot, springs. In Python the function itself.
        edit_sha256: SHA-256 of its module, by default as it is now; another one is refused.
    """

    name: str
    armature: ByJoint | None = 0.0
    damping: ByJoint | None = 0.0
    coulomb: ByJoint | None = 0.0
    torque_constant: ByJoint = 1.0
    full_torque_speed: float = 0.0
    no_load_speed: float | None = None
    delay: float = 0.0
    payload: float = 0.0
    payload_position: Vector = (0.0, 0.0, 0.06)
    com_shift: Vector = (0.0, 0.0, 0.0)
    sensors: Sensors = field(default_factory=Sensors)
    touchdown_latency: float = 0.0
    touchdown_jitter: float = 0.0
    ground_time_constant: float = 0.002
    ground_friction: float = 0.8
    slope: float = 0.0
    ground_roughness: float = 0.0
    step_height: float = 0.0
    step_length: float = 0.3
    gravity: float = 9.81
    push_impulse: Vector = (0.0, 0.0, 0.0)
    push_period: float = 4.1
    push_duration: float = 0.05
    seed: int = 0
    timestep: float = 0.001
    engine: str = DEFAULT_ENGINE
    engine_sha256: str = ""
    mjcf: str = ""
    edit: str = ""
    edit_sha256: str = ""

    def __post_init__(self) -> None:
        file_name("name of a scenario", self.name)
        prefix = f"scenario '{self.name}': "
        keep_reals(self, _NUMBERS, prefix)
        for name, within in _BY_JOINT.items():
            value = getattr(self, name)
            if value is None and name in _OF_MOTORS:
                continue
            several = isinstance(value, Sequence | np.ndarray) and np.ndim(value) > 0
            check = reals if several else real
            object.__setattr__(self, name, check(prefix + name, value, within))
        keep_vectors(self, _VECTORS, prefix=prefix)
        speeds = Interval(0, 1000, "rad/s", above=True)
        no_load = none_or(real, f"{prefix}no_load_speed", self.no_load_speed, speeds)
        object.__setattr__(self, "no_load_speed", no_load)
        object.__setattr__(self, "seed", known_seed(f"{prefix}seed", self.seed))
        instance_of(f"{prefix}sensors", self.sensors, Sensors)
        text(f"{prefix}engine", self.engine)
        text(f"{prefix}mjcf", self.mjcf)
        object.__setattr__(self, "edit", function_address(f"{prefix}edit", self.edit))
        for name in ("edit", "engine"):
            address, digest = getattr(self, name), f"{name}_sha256"
            text(prefix + digest, getattr(self, digest))
            if is_address(address) and not getattr(self, digest):
                object.__setattr__(self, digest, source_sha256(imported(address)))
        self._check_ground()
        self._check_motors()
        for name in ("delay", "touchdown_latency", "touchdown_jitter"):
            self._check_whole_steps(name)
        if not self.push_duration < self.push_period:
            raise self._wrong("push_duration must be shorter than push_period")

    def __add__(self, other: Scenario | str) -> Scenario:
        """This scenario with the mismatches of another one, too.

        A mismatch is what is as in neither of the scenarios `ideal` and `nominal`.

        Raises:
            InvalidInput: Both change the same thing, and differently.
            UnknownName: There is no scenario of that name.
        """
        if isinstance(other, str) and _is_engine(other):
            return self.in_engine(other)
        other, changes = load_scenario(other), {}
        own = dict(self._mismatches())
        for name, value in other._mismatches():
            if own.get(name, value) != value:
                raise InvalidInput(
                    f"scenarios '{self.name}' and '{other.name}' both change {name}; keep one"
                )
            changes[name] = value
        return replace(self, **changes, name=f"{self.name}+{other.name}")

    def __radd__(self, other: str) -> Scenario:
        """A scenario by name with the mismatches of this one."""
        return load_scenario(other) + self

    def in_engine(self, engine: str) -> Scenario:
        """This scenario, simulated by an engine of that name or address.

        Raises:
            UnknownName: There is none of that name.
            InvalidInput: The address cannot be imported.
        """
        if not is_address(engine):
            known = (DEFAULT_ENGINE, *OTHER_ENGINES, *announced_names("engine"))
            known_name("engine", engine, known)
        if engine == self.engine:
            return self
        name = f"{self.name}+{_engine_name(engine)}"
        return replace(self, name=name, engine=engine, engine_sha256="")

    def by_joint(self, name: str, robot: Robot) -> Array:
        """One of the joints' parameters for every joint of a robot, in the order of q, (12,).

        Joints of no leg have no share in values by kind.

        Args:
            name: "armature", "damping", "coulomb" or "torque_constant".
            robot: The robot.

        Raises:
            InvalidInput: There are more or fewer values than kinds, or joints.
        """
        value = getattr(self, known_name("parameter of joints", name, _BY_JOINT))
        kinds = robot.spec.joints
        if value is None:
            value = getattr(motor_constants(robot), _OF_MOTORS[name])
        if isinstance(value, float):
            return np.full(robot.nu, value)
        if len(value) == len(kinds):
            return np.append(value, getattr(type(self), name))[robot.joint_kinds]
        if len(value) != robot.nu:
            raise self._wrong(
                f"{name} has {len(value)} values; for the {robot.name} give one number, "
                f"{len(kinds)} ({', '.join(kinds)}), or {robot.nu}, one for each joint"
            )
        return np.array(value)

    def check_joints(self, robot: Robot) -> None:
        """Check that the joints' parameters are those of a robot; errors as for `by_joint`."""
        for name in _BY_JOINT:
            self.by_joint(name, robot)

    def _mismatches(self) -> Iterator[tuple[str, Any]]:
        for known in fields(self):
            value = getattr(self, known.name)
            usual = [getattr(world, known.name) for world in BASE_SCENARIOS.values()]
            if known.name != "name" and value not in usual:
                yield known.name, value

    def to_json(self) -> str:
        """The scenario as JSON; `from_json` reads it."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Scenario:
        """Read the scenario that `to_json` wrote.

        Raises:
            InvalidInput: The text is something else.
        """
        return from_text(text, cls, "a scenario", "make the strides again")

    def _check_ground(self) -> None:
        if not self.ground_time_constant >= 2 * self.timestep:
            raise self._wrong(
                f"a ground_time_constant below two time steps ({2 * self.timestep:g} s) is "
                "unstable; make it larger"
            )
        if not self.step_height <= 0.5 * self.step_length:
            raise self._wrong("steps are at most half as high as they are long")

    def _check_motors(self) -> None:
        no_load = math.inf if self.no_load_speed is None else self.no_load_speed
        if not self.full_torque_speed < no_load:
            raise self._wrong("full_torque_speed must be less than no_load_speed")

    def _check_whole_steps(self, name: str) -> None:
        steps = getattr(self, name) / self.timestep
        if not abs(steps - round(steps)) < 1e-6:
            raise self._wrong(
                f"{name} must be a whole number of time steps of {self.timestep:g} s; "
                f"{round(steps) * self.timestep:g} s is the nearest"
            )

    def _wrong(self, reason: str) -> InvalidInput:
        return InvalidInput(f"scenario '{self.name}': {reason}")

    @property
    def affine(self) -> bool:
        """Whether servos can play a whole phase at once, with `World.play`: nothing comes between
        the tape and the torque but what is affine in the joints' angles and velocities."""
        return self.delay == 0.0 and self.foreseeable

    @property
    def foreseeable(self) -> bool:
        """Whether the motors give what they were told, and what they are told follows from the
        state alone: with a delay, the torques of as many ticks are then known beforehand."""
        return self.no_load_speed is None and self.sensors.perfect

    @property
    def pushes(self) -> bool:
        """Whether the robots are pushed."""
        return any(self.push_impulse)

    @property
    def delay_ticks(self) -> int:
        """The delay in time steps."""
        return round(self.delay / self.timestep)

    @property
    def gravity_vector(self) -> Vector:
        """Gravity in the world's frame [m/s^2], which the slope turns."""
        return (-self.gravity * math.sin(self.slope), 0.0, -self.gravity * math.cos(self.slope))


BASE_SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("ideal"),
        Scenario("nominal", armature=None, damping=None, coulomb=None),
    )
}
"""Worlds to begin with: what the robot's own description says, and with what URDFs leave out."""

_SAMPLED = re.compile(r"random-(\d{1,9})-(\d{1,9})")


def load_scenario(name: str | Scenario, *, mjcf: str = "") -> Scenario:
    """The scenario of that name; it bears the name in its shortest form.

    Args:
        name: As above: `payload`, `nominal+payload=2+slope`, `ideal`, `random-0-3+delay`,
            `my_package.worlds:hot+slope`; a `Scenario` is returned as it is.
        mjcf: Path of an MJCF that stands in for the robot's URDF.

    Raises:
        UnknownName: A part of it is not known.
        InvalidInput: A value is out of range, two parts change the same thing, or what an address
            names cannot be imported, or is something else.
    """
    if isinstance(name, Scenario):
        return replace(name, mjcf=mjcf or name.mjcf)
    first, *rest = text("scenario", name).split("+")
    scenario = _world(first)
    if scenario is None:
        scenario, rest = BASE_SCENARIOS["nominal"], [first, *rest]
    engines = [part for part in rest if _is_engine(part)]
    if len(engines) > 1:
        raise InvalidInput(f"scenario '{name}': {len(engines)} engines; keep one of them")
    values = _values(name, [part for part in rest if part not in engines])
    changes: dict[str, Any] = {} if not engines else {"engine": engines[0]}
    for part, value in values.items():
        try:
            changed_by = KNOWN[part].changes(value)
        except InvalidInput as error:
            raise InvalidInput(f"scenario '{name}': {error}") from error
        for attribute, changed in changed_by.items():
            if attribute in changes:
                raise InvalidInput(
                    f"scenario '{name}': two parts of it change {attribute}; keep one of them"
                )
            changes[attribute] = changed
    world = [] if values and scenario.name == "nominal" else [scenario.name]
    written = (_written(part, value) for part, value in values.items())
    short = "+".join([*world, *written, *map(_engine_name, engines)])
    return replace(scenario, **changes, name=short, mjcf=mjcf)


def shipped_scenario(name: str) -> Scenario | None:
    """The scenario that a name means everywhere, whatever is installed; None without one."""
    first, *rest = (part.partition("=")[0] for part in name.split("+"))
    worlds = (*BASE_SCENARIOS, *KNOWN, *OTHER_ENGINES)
    known = {first in worlds, _SAMPLED.fullmatch(first) is not None}
    if True not in known or not all(part in (*KNOWN, *OTHER_ENGINES) for part in rest):
        return None
    return load_scenario(name)


def _world(name: str) -> Scenario | None:
    """The world that a name may begin with; None if it is none."""
    sampled = _SAMPLED.fullmatch(name)
    if sampled:
        return _sample(*map(int, sampled.groups()))
    if name.partition("=")[0] in KNOWN or name in OTHER_ENGINES:
        return None
    if name in BASE_SCENARIOS or is_address(name) or name in announced_names("scenario"):
        return find("scenario", name, BASE_SCENARIOS, Scenario)
    return None


def _is_engine(part: str) -> bool:
    """Whether a part of a name after its world is that of an engine."""
    if part in BASE_SCENARIOS or part in announced_names("scenario"):
        return False
    if is_address(part):
        return not isinstance(imported(part), Scenario)
    return part in OTHER_ENGINES or part in announced_names("engine")


def _engine_name(engine: str) -> str:
    """Name of an engine, of one at an address its own."""
    return str(getattr(imported(engine), "name", engine)) if is_address(engine) else engine


def _values(name: str, parts: list[str]) -> dict[str, float]:
    """The values of the mismatches in a name, in the order of `KNOWN`."""
    values: dict[str, float] = {}
    for part in parts:
        if _world(part) is not None:
            raise InvalidInput(f"scenario '{name}': a world, as {part}, comes first in a name")
        mismatch, equals, number = part.partition("=")
        if mismatch not in KNOWN:
            raise UnknownName(
                "scenario", part, (*BASE_SCENARIOS, *KNOWN, *OTHER_ENGINES, "random-SEED-INDEX")
            )
        if mismatch in values:
            raise InvalidInput(f"scenario '{name}': {mismatch} is in it twice; keep one of them")
        try:
            values[mismatch] = float(number) if equals else KNOWN[mismatch].value
        except ValueError:
            values[mismatch] = math.nan
        if not math.isfinite(values[mismatch]):
            raise InvalidInput(
                f"scenario '{name}': '{part}' needs a number after '=', in "
                f"{KNOWN[mismatch].unit}, as in {mismatch}={KNOWN[mismatch].value:g}"
            )
    return {part: values[part] for part in KNOWN if part in values}


def _written(part: str, value: float) -> str:
    number = repr(value).removesuffix(".0").replace("e+", "e")  # a plus would join
    return part if value == KNOWN[part].value else f"{part}={number}"


def random_scenarios(n: int, seed: int) -> tuple[Scenario, ...]:
    """Sampled scenarios: everything that may be off is so at once, within reason.

    Args:
        n: How many.
        seed: Of the family. The i-th is `random-<seed>-<i>`, whatever n is.

    Raises:
        InvalidInput: n is below 1, or the seed is negative.
    """
    n = whole("n", n, Interval(1, 1_000_000))
    seed = whole("seed", seed, Interval(0, 999_999_999))  # nine digits, as in a name
    return tuple(_sample(seed, index) for index in range(n))


def _sample(seed: int, index: int) -> Scenario:
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))

    def draw(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def draw_ms(most: int) -> float:
        """A whole number of milliseconds [s]."""
        return int(rng.integers(most, endpoint=True)) / 1000

    return Scenario(
        f"random-{seed}-{index}",
        armature=draw(0.6, 1.8) * ROBOTS["a1"].rotors[0],
        damping=draw(0.02, 0.4),
        coulomb=draw(0.05, 0.5),
        torque_constant=draw(0.85, 1.05),
        payload=draw(0.0, 3.0),
        payload_position=(draw(-0.1, 0.1), draw(-0.03, 0.03), draw(0.03, 0.1)),
        com_shift=(draw(-0.02, 0.02), draw(-0.01, 0.01), draw(-0.01, 0.01)),
        ground_time_constant=0.002 * 4.0 ** draw(0.0, 1.0),
        ground_friction=draw(0.5, 1.0),
        slope=draw(-0.06, 0.06),
        # What was drawn before stays as it is: anything more comes after it.
        delay=draw_ms(4),
        touchdown_latency=draw_ms(3),
        touchdown_jitter=draw_ms(4),
        sensors=NOISE.scaled(draw(0.0, 0.5)),
    )


SCENARIOS = {name: load_scenario(name) for name in (*BASE_SCENARIOS, *KNOWN)}
"""The worlds to begin with, and each mismatch alone."""
