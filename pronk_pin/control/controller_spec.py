"""Specification of controllers, and the controllers known by name."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from .._checks import (
    SHARE,
    Interval,
    file_name,
    flag,
    instance_of,
    keep_instances,
    keep_reals,
    known_name,
    sequence_of,
    text,
    whole,
)
from .._registry import find
from ..errors import InvalidInput
from ..robot import Robot
from .feedback import SPEED_FILTER, AttitudeFilter, BalanceSpec, LegAngleRegulator
from .learning import (
    FLIGHT_LAW,
    CurrentIterationILC,
    LearningGuard,
    LearningLaw,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    StrideSelection,
    TorqueLibrary,
    known_law,
)
from .signals import ContactDetector, FlightTiming, Gains, ZeroPhaseFilter
from .tick_control import (
    BindableTickController,
    ComputedTorque,
    ExtendedStateObserver,
    TickController,
    WholeBodyQP,
    known_tick_controller,
)

SOURCES = ("none", "model", "library", "identified")
"""Sources of a controller's initial feedforward."""


_STIFFNESS = Interval(0, 1e4)

GAIT_MODELS = ("urdf", "datasheet", "identified")
"""Models that a controller's gaits may be optimised with."""

KNOWLEDGE = ("urdf", "rotors", "friction", "load", "trunk state", "foot forces")
"""What a controller may know of robot and world: masses and lengths, rotors' inertia, the joints'
friction, what the trunk carries; and what it may measure beyond joints and touchdown."""


@dataclass(frozen=True)
class ControllerSpec:
    """Specification of a controller: initial feedforward, learning laws, feedback, regulation.

    Attributes:
        name: Short name, as on the command line.
        source: Source of its initial feedforward: "none", "model", "library", or "identified", the
            model with the parameters identified from learned torques.
        library: File of the torque library, see `TorqueLibrary.save`, where that is the source; by
            default it is learned by `ilc` in the same scenario. Where it is of conditions, as slope
            or payload, these are estimated once learning is switched on, see `ConditionEstimate`.
        library_sha256: SHA-256 of that file, by default as it is now; another one is refused.
        gait_model: Model that its gaits are optimised with, one of `GAIT_MODELS`: the URDF's, which
            the shipped gaits are; with the rotors' inertia of the datasheet (`RobotSpec.rotors`),
            which the torques of source "model" know then, too; or the identified one.
        knows: What its torques, or its gaits beyond those that all play, are computed from: some of
            `KNOWLEDGE`.
        law: Learning law of the stance that is switched on later, if any.
        flight_law: Learning law of the flight, likewise.
        coupling: Share of the stance's errors that the flight's law is shown beyond its end; 0 to
            1. Those early in stance are corrected three times, by the law of the stance, by that of
            the flight, which looks ahead, and by the timing; with all of them shown (1) the three
            make an oscillation that grows where motors are late.
        guard: Guard of the learning, which goes back where errors grow; None lets them.
        timing: Adaptation of the flight's duration to the measured one; None plays it as planned.
            Without a law, and where no duration is given, it adapts from the first stride on.
        gains: Feedback gains, eq. (9); None for the robot's own, see `Gains.of`.
        stiffness: Multiple of these gains' stiffness; the damping goes with its root.
        tick_controller: What computes the torques tick by tick, in place of the feedback gains, see
            `TickController`; None for these.
        regulator: Speed regulation: eq. (12).
        balance: Attitude and foot placement where the trunk is free to turn.
        selection: Strides worth learning from.
        contact: Contact detection, and which stances do not count.
        speed_filter: Time constant of the speed estimate's filter [s].
        imu: Whether there is an IMU on the trunk: its accelerometer helps that estimate, and where
            the trunk may turn it tells the attitude, which is known as it is otherwise.
        attitude_filter: Filter that estimates the attitude from the IMU.
        touchdown_ticks: Ticks by which a touchdown is felt late: the stance is entered there. The
            contact sensor is one late, and the contact began between two ticks.
    """

    name: str
    source: str = "none"
    library: str = ""
    library_sha256: str = ""
    gait_model: str = "urdf"
    knows: tuple[str, ...] = ()
    law: LearningLaw | None = None
    flight_law: LearningLaw | None = None
    coupling: float = 1.0
    guard: LearningGuard | None = None
    timing: FlightTiming | None = None
    gains: Gains | None = None
    stiffness: float = 1.0
    tick_controller: TickController | BindableTickController | None = None
    regulator: LegAngleRegulator = field(default_factory=LegAngleRegulator)
    balance: BalanceSpec = field(default_factory=BalanceSpec)
    selection: StrideSelection = field(default_factory=StrideSelection)
    contact: ContactDetector = field(default_factory=ContactDetector)
    speed_filter: float = 0.02
    imu: bool = False
    attitude_filter: AttitudeFilter = field(default_factory=AttitudeFilter)
    touchdown_ticks: int = 2

    def __post_init__(self) -> None:
        file_name("name of a controller", self.name)
        prefix = f"controller '{self.name}': "
        known_name("source of feedforward", self.source, SOURCES)
        self._check_library(prefix)
        known_name("model of the gaits", self.gait_model, GAIT_MODELS)
        if self.gait_model == "identified" and self.source != "identified":
            raise InvalidInput(
                f"{prefix}gaits of the identified model go with its torques; "
                "give source='identified' too"
            )
        knows = sequence_of(f"{prefix}knows", self.knows, text)
        for known in knows:
            known_name("knowledge", known, KNOWLEDGE)
        object.__setattr__(self, "knows", knows)
        flag(f"{prefix}imu", self.imu)
        for name in ("law", "flight_law"):
            known_law(prefix + name, getattr(self, name))
        known_tick_controller(f"{prefix}tick_controller", self.tick_controller)
        computes = isinstance(self.tick_controller, ComputedTorque)
        if computes and (self.source != "none" or any(self.laws)):
            raise InvalidInput(
                f"{prefix}{type(self.tick_controller).__name__} plays no feedforward; leave out "
                "source, law and flight_law"
            )
        if self.timing is not None:
            instance_of(f"{prefix}timing", self.timing, FlightTiming, "a FlightTiming, or None")
        if self.guard is not None:
            instance_of(f"{prefix}guard", self.guard, LearningGuard, "a LearningGuard, or None")
        keep_instances(
            self,
            prefix,
            regulator=LegAngleRegulator,
            balance=BalanceSpec,
            selection=StrideSelection,
            contact=ContactDetector,
            attitude_filter=AttitudeFilter,
        )
        if self.gains is not None:
            instance_of(f"{prefix}gains", self.gains, Gains, "a Gains, or None for the robot's own")
        numbers = {"speed_filter": SPEED_FILTER, "coupling": SHARE, "stiffness": _STIFFNESS}
        keep_reals(self, numbers, prefix)
        # Contacts are sensed a tick late.
        whole(f"{prefix}touchdown_ticks", self.touchdown_ticks, Interval(1, 50))

    def _check_library(self, prefix: str) -> None:
        for name in ("library", "library_sha256"):
            text(prefix + name, getattr(self, name))
        if not self.library:
            return
        if self.source != "library":
            raise InvalidInput(
                f"{prefix}library '{self.library}' is not used by source '{self.source}'; give "
                "source='library', or leave it out"
            )
        if not self.library_sha256:
            place = Path(self.library).expanduser().resolve()
            object.__setattr__(self, "library", str(place))
            object.__setattr__(self, "library_sha256", TorqueLibrary.load(place).sha256)

    def gains_of(self, robot: Robot) -> Gains:
        """The feedback gains with which it controls a robot."""
        own = Gains.of(robot) if self.gains is None else self.gains
        return own.scaled(self.stiffness)

    @property
    def laws(self) -> tuple[LearningLaw | None, ...]:
        """The learning laws, in the order of `PARTS`."""
        return self.law, self.flight_law


_ILC = ControllerSpec(
    "ilc",
    law=PDTypeILC(),
    flight_law=FLIGHT_LAW,
    timing=FlightTiming(),
    coupling=0.6,
    guard=LearningGuard(),
)
"""Learning from nothing, over the whole stride."""

_URDF, _IDENTIFIED = ("urdf",), ("urdf", "rotors", "friction", "load")

_STIFF = 4.0
"""Four times the stiffness, and twice the damping."""

_MODEL_ROTORS = ControllerSpec(
    "model+rotors",
    source="model",
    gait_model="datasheet",
    timing=FlightTiming(),
    knows=("urdf", "rotors"),
)

_ILC_FAST = replace(
    _ILC,
    name="ilc-fast",
    coupling=0.5,
    timing=FlightTiming(gain=0.8),
    flight_law=replace(FLIGHT_LAW, gain=1.0),
)
"""Settles in fewer strides, see docs/learning.md: the touchdown comes sooner to the tick where it
stays."""

_ILC_ROTORS = replace(_ILC, name="ilc+rotors", gait_model="datasheet", knows=("rotors",))

_COMPUTED_TORQUE = ControllerSpec(
    "computed-torque",
    tick_controller=ComputedTorque(),
    timing=FlightTiming(),
    knows=("urdf", "rotors", "foot forces"),
)
_WHOLE_BODY_QP = replace(_COMPUTED_TORQUE, name="whole-body-qp", tick_controller=WholeBodyQP())

CONTROLLERS = {
    spec.name: spec
    for spec in (
        ControllerSpec("pd"),
        _ILC,
        ControllerSpec("model", source="model", knows=_URDF),
        ControllerSpec("library", source="library", timing=FlightTiming()),
        replace(_ILC, name="model+ilc", source="model", knows=_URDF),
        replace(_ILC, name="library+ilc", source="library"),
        ControllerSpec("ilc-stance", law=PDTypeILC()),
        ControllerSpec("ilc-paper", law=PaperILC()),
        ControllerSpec("ilc-paper-exact", law=PaperILC(filter=ZeroPhaseFilter.butterworth(3, 0.1))),
        ControllerSpec("ilc-current", law=CurrentIterationILC()),
        _ILC_FAST,
        ControllerSpec("identified", source="identified", knows=_IDENTIFIED),
        ControllerSpec(
            "identified+gait",
            source="identified",
            gait_model="identified",
            timing=FlightTiming(),
            knows=_IDENTIFIED,
        ),
        replace(
            _ILC,
            name="ilc-zero",
            law=replace(PDTypeILC(), gain=0.0),
            flight_law=replace(FLIGHT_LAW, gain=0.0),
        ),
        replace(_ILC, name="ilc-imu", imu=True),
        ControllerSpec("model+timing", source="model", timing=FlightTiming(), knows=_URDF),
        _MODEL_ROTORS,
        replace(_MODEL_ROTORS, name="model+eso", tick_controller=ExtendedStateObserver()),
        _ILC_ROTORS,
        ControllerSpec("pd-stiff", stiffness=_STIFF),
        replace(_MODEL_ROTORS, name="model+rotors-stiff", stiffness=_STIFF),
        replace(_ILC, name="ilc-stiff", stiffness=_STIFF),
        replace(_ILC_ROTORS, name="ilc+rotors-stiff", stiffness=_STIFF),
        _COMPUTED_TORQUE,
        _WHOLE_BODY_QP,
        replace(
            _COMPUTED_TORQUE,
            name="computed-torque-cautious",
            tick_controller=ComputedTorque(omega=60.0),
        ),
        replace(_COMPUTED_TORQUE, name="computed-torque+rotors", gait_model="datasheet"),
        replace(_WHOLE_BODY_QP, name="whole-body-qp+rotors", gait_model="datasheet"),
        ControllerSpec("ilc-norm-optimal", law=NormOptimalILC()),
    )
}
"""Controllers known by name."""


def load_controller(name: str | ControllerSpec) -> ControllerSpec:
    """The controller of that name.

    Args:
        name: One of `CONTROLLERS`, the name of an entry point of the group `pronk_pin.controllers`,
            or the address of a `ControllerSpec`, as in "my_package.wbc:controller"; or one of these
            that begins with a torque library, with the file of one, as in "library=hills.npz". A
            specification itself is returned as it is.

    Raises:
        UnknownName: There is none.
        InvalidInput: What the address names cannot be imported, or is something else; or a library
            is given to a controller that begins with something else.
        FileProblem: The file of the library is missing or damaged.
    """
    if isinstance(name, ControllerSpec):
        return name
    if isinstance(name, str) and "=" in name:
        base, _, place = name.partition("=")
        if not place:
            raise InvalidInput(
                f"controller '{name}' names no file; give one, as {base}=hills.npz, or no '='"
            )
        spec, name = load_controller(base), f"{base}={Path(place).stem}"
        try:
            file_name("name", name)
        except InvalidInput as error:
            raise InvalidInput(
                f"the file '{place}' cannot be part of a controller's name; rename it, with "
                "letters, digits and + - _ . alone"
            ) from error
        return replace(spec, name=name, library=place, library_sha256="")
    return find("controller", name, CONTROLLERS, ControllerSpec)
