"""Specification of controllers, and the controllers known by name."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from .._checks import (
    Interval,
    file_name,
    flag,
    instance_of,
    keep_instances,
    keep_reals,
    known_name,
    whole,
)
from .feedback import SPEED_FILTER, AttitudeFilter, BalanceSpec, LegAngleRegulator
from .learning import (
    FLIGHT_LAW,
    CurrentIterationILC,
    LearningLaw,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    StrideSelection,
    known_law,
)
from .signals import ContactDetector, FlightTiming, Gains, ZeroPhaseFilter

SOURCES = ("none", "model", "library", "identified")
"""Sources of a controller's initial feedforward."""


@dataclass(frozen=True)
class ControllerSpec:
    """Specification of a controller: initial feedforward, learning laws, feedback, regulation.

    Attributes:
        name: Short name, as on the command line.
        source: Source of its initial feedforward: "none", "model", "library", or "identified", the
            model with the parameters identified from learned torques.
        identified_gaits: Play gaits that were optimised again with the identified model.
        law: Learning law of the stance that is switched on later, if any.
        flight_law: Learning law of the flight, likewise.
        timing: Adaptation of the flight's duration to the measured one; None plays it as planned.
            Without a law, and where no duration is given, it adapts from the first stride on.
        gains: Feedback gains: eq. (9).
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
    identified_gaits: bool = False
    law: LearningLaw | None = None
    flight_law: LearningLaw | None = None
    timing: FlightTiming | None = None
    gains: Gains = field(default_factory=Gains)
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
        for name in ("identified_gaits", "imu"):
            flag(prefix + name, getattr(self, name))
        for name in ("law", "flight_law"):
            known_law(prefix + name, getattr(self, name))
        if self.timing is not None:
            instance_of(f"{prefix}timing", self.timing, FlightTiming, "a FlightTiming, or None")
        keep_instances(
            self,
            prefix,
            gains=Gains,
            regulator=LegAngleRegulator,
            balance=BalanceSpec,
            selection=StrideSelection,
            contact=ContactDetector,
            attitude_filter=AttitudeFilter,
        )
        keep_reals(self, {"speed_filter": SPEED_FILTER}, prefix)
        # Contacts are sensed a tick late.
        whole(f"{prefix}touchdown_ticks", self.touchdown_ticks, Interval(1, 50))

    @property
    def laws(self) -> tuple[LearningLaw | None, ...]:
        """The learning laws, in the order of `PARTS`."""
        return self.law, self.flight_law


_ILC = ControllerSpec("ilc", law=PDTypeILC(), flight_law=FLIGHT_LAW, timing=FlightTiming())
"""Learning from nothing, over the whole stride."""

CONTROLLERS = {
    spec.name: spec
    for spec in (
        ControllerSpec("pd"),
        _ILC,
        ControllerSpec("model", source="model"),
        ControllerSpec("library", source="library", timing=FlightTiming()),
        replace(_ILC, name="model+ilc", source="model"),
        replace(_ILC, name="library+ilc", source="library"),
        ControllerSpec("ilc-stance", law=PDTypeILC()),
        ControllerSpec("ilc-paper", law=PaperILC()),
        ControllerSpec("ilc-paper-exact", law=PaperILC(filter=ZeroPhaseFilter.butterworth(3, 0.1))),
        ControllerSpec("ilc-current", law=CurrentIterationILC()),
        ControllerSpec("identified", source="identified"),
        ControllerSpec("identified+gait", source="identified", identified_gaits=True),
        ControllerSpec("ilc-zero", law=PDTypeILC(gain=0.0), flight_law=PDTypeILC(gain=0.0)),
        replace(_ILC, name="ilc-imu", imu=True),
        ControllerSpec("model+timing", source="model", timing=FlightTiming()),
        ControllerSpec("ilc-norm-optimal", law=NormOptimalILC()),
    )
}
"""Controllers known by name."""


def load_controller(name: str) -> ControllerSpec:
    """The controller of that name.

    Raises:
        UnknownName: There is none.
    """
    return CONTROLLERS[known_name("controller", name, CONTROLLERS)]
