"""Torque library: learned feedforward by speed, the "muscle memory" of section III.B.

It may be of more than the speed: of the conditions that robots meet, as slope or payload.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._checks import known_name, numbers
from ..._checks import path as known_path
from ..._display import Displayed, spanned
from ..._typing import Array, BoolArray
from ...errors import InvalidInput, SpeedOutOfRange
from ...storage import arrays_sha256, read_arrays, write_arrays
from ..signals import resample

SCHEMA = 3
"""Version of the file format."""
LANDS_ALIKE = 5e-4
"""Difference of two flights [s] below which they were learned for the same touchdown: contact is
sensed at whole milliseconds."""
_ROUNDING = 1e-6
_STORED = ("speeds", "torque", "spread", "flight", "feedback")
_AGAIN = "learn again: pronk-pin ilc build-library, or TorqueLibrary.save"


class InitialFeedforward(NamedTuple):
    """Initial feedforward and flight durations of n robots; None is none."""

    feedforward: Array | None = None
    """Torques on the phase grids of stance and flight [N m], shape (n, 2, samples, 12)."""
    flight: Array | None = None
    """Durations of the flights' references [s], shape (n,); None as planned."""
    library: TorqueLibrary | None = None
    """Where they come from, if its conditions are to be estimated, see `ConditionEstimate`."""


Conditions: TypeAlias = Mapping[str, ArrayLike]
"""Values of the conditions that robots are in, by name: one for all of them, or one each, (m,)."""


@dataclass(frozen=True, repr=False)
class TorqueLibrary(Displayed):
    """Learned torques by speed, and by conditions, averaged over strides in steady state.

    With d conditions of m_1 .. m_d values it holds a torque for each speed and each combination of
    them, and is linear in each between two of its values.

    Attributes:
        speeds: Increasing speeds [m/s], shape (n,).
        torque: Mean feedforward on the phase grids of stance and flight [N m], shape
            (n, m_1 .. m_d, 2, samples, 12).
        spread: Its standard deviation over the strides [N m], of the same shape.
        flight: Durations of the flights for which they were learned [s], shape (n, m_1 .. m_d); see
            `FlightTiming`.
        feedback: Mean feedback that was given beside the torque [N m], of the same shape; None for
            none on record, which is kept as zeros.
        conditions: Increasing values of each condition, shape (m_i,), by the name of the mismatch
            that they are values of: "slope", "payload"; see `compare.world.scenario`.
        home: The values that a robot begins with, by name; by default each condition's value in the
            middle, the lower of two.
        robot: Name of the robot that learned them; empty where that is not on record.
        gaits: SHA-256 of the gait at each speed for which they were learned; likewise.
    """

    speeds: Array
    torque: Array
    spread: Array
    flight: Array
    feedback: Array | None = None
    conditions: Mapping[str, Array] = field(default_factory=dict)
    home: Mapping[str, float] = field(default_factory=dict)
    robot: str = ""
    gaits: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        keep = object.__setattr__
        if self.feedback is None:
            keep(self, "feedback", np.zeros_like(self.torque))
        given = {name: getattr(self, name) for name in _STORED}
        for name, array in zip(given, numbers(**given), strict=True):
            keep(self, name, array)
        axes = dict(zip(self.conditions, numbers(**self.conditions), strict=True))
        keep(self, "conditions", axes)
        d = len(axes)
        if self.speeds.ndim != 1 or self.torque.ndim != 4 + d or self.flight.ndim != 1 + d:
            of = "".join(f", {name}" for name in axes)
            raise InvalidInput(
                f"speeds, torque and flight of the shapes {self.speeds.shape}, {self.torque.shape} "
                f"and {self.flight.shape}; give (n,), (n{of}, 2, samples, joints) and (n{of})"
            )
        nodes = {self.torque.shape[: 1 + d], (len(self.speeds), *map(np.size, axes.values()))}
        shapes = {self.torque.shape, self.spread.shape, np.asarray(self.feedback).shape}
        alike = len(shapes) == 1 and nodes == {self.flight.shape}
        if not alike or not self.flight.size or len(self.gaits) not in (0, len(self.speeds)):
            raise InvalidInput(
                "a torque library needs one torque, one spread and one flight for each speed"
                + (" and condition" if axes else "")
                + ", and a speed at least"
            )
        for name, values in {"speeds": self.speeds, **axes}.items():
            if values.ndim != 1 or np.any(np.diff(values) <= 0.0):
                raise InvalidInput(f"the {name} of a torque library must increase")
        keep(self, "home", self._known_home())

    def _known_home(self) -> dict[str, float]:
        home = {name: float(v[(len(v) - 1) // 2]) for name, v in self.conditions.items()}
        for name, value in self.home.items():
            home[known_name("condition", name, self.conditions)] = float(value)
        _ = [self._index(name, home[name]) for name in home]
        return home

    def _title(self) -> str:
        of = "".join(f" x {len(values)} of {name}" for name, values in self.conditions.items())
        return f"TorqueLibrary of {len(self.speeds)} speeds{of}"

    def _facts(self) -> dict[str, str]:
        return {
            "speeds": spanned(self.speeds, "m/s"),
            **{name: spanned(values, "") for name, values in self.conditions.items()},
            "torque": f"up to {np.nanmax(np.abs(self.torque), initial=0.0):.3g} N m",
            "samples": f"{self.torque.shape[-2]} of each part",
        }

    @classmethod
    def from_strides(
        cls, speeds: Array, torque: Array, flight: Array, feedback: Array | None = None
    ) -> TorqueLibrary:
        """Average learned strides: means of the torques, medians of the flights' durations.

        Args:
            speeds: Increasing speeds [m/s], shape (n,).
            torque: Feedforward [N m], shape (n, strides, 2, samples, 12); NaN where no stride is.
            flight: Duration of the flight's reference [s], shape (n, strides).
            feedback: Feedback [N m], shape as the feedforward's.
        """
        mean, spread = np.nanmean(torque, axis=1), np.nanstd(torque, axis=1)
        # Contact comes at a whole tick, and a mean of two would be between those that occur.
        beside = None if feedback is None else np.nanmean(feedback, axis=1)
        return cls(speeds, mean, spread, np.nanmedian(flight, axis=1), beside)

    @classmethod
    def joined(
        cls,
        libraries: Sequence[TorqueLibrary],
        conditions: Mapping[str, Array],
        *,
        home: Mapping[str, float] | None = None,
    ) -> TorqueLibrary:
        """Join libraries of the same speeds, each learned in other conditions.

        Args:
            libraries: One for each combination of the conditions, that of the last name changing
                fastest.
            conditions: Increasing values of each condition, by name.
            home: The values that a robot begins with.

        Raises:
            InvalidInput: They are not as many, or of other speeds.
        """
        sizes = [len(values) for values in conditions.values()]
        if len(libraries) != np.prod(sizes, dtype=int):
            raise InvalidInput(
                f"{len(libraries)} libraries for conditions of {' x '.join(map(str, sizes))} "
                "values; give one for each combination"
            )
        speeds = libraries[0].speeds
        if any(not np.array_equal(library.speeds, speeds) for library in libraries):
            raise InvalidInput("the libraries are of other speeds; learn at the same in all")

        parts = (
            np.stack([getattr(library, name) for library in libraries], axis=1)
            for name in _STORED[1:]
        )
        torque, spread, flight, feedback = (
            part.reshape(len(speeds), *sizes, *part.shape[2:]) for part in parts
        )
        return cls(speeds, torque, spread, flight, feedback, conditions, home or {})

    def at(self, speeds: Array, conditions: Conditions | None = None) -> Array:
        """Interpolate the torques at speeds (m,) between neighbours [N m], shape (m, 2, ...).

        Args:
            speeds: Speeds [m/s], shape (m,).
            conditions: Values of conditions; those that are not given are as at `home`.

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
            InvalidInput: It does not cover a condition.
        """
        torque = self.nodes(speeds)
        for name, place in self._condition_places(speeds, conditions).items():
            corners = np.arange(len(self.conditions[name]))
            weights = np.maximum(0.0, 1.0 - np.abs(place[:, None] - corners))  # (m, m_i)
            torque = np.einsum("ka...,ka->k...", torque, weights)
        return torque

    def nodes(self, speeds: Array) -> Array:
        """Torques at speeds (m,) in all learned conditions [N m], shape (m, m_1 .. m_d, 2, ...).

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
        """
        return np.asarray(resample(self.torque[None], self._places(speeds)[None])[0])

    def initial_feedforward(
        self, speeds: Array, conditions: Conditions | None = None
    ) -> InitialFeedforward:
        """Interpolate the torques at speeds (m,), with the flight durations that they fit.

        A flight lasts as long as that of the nearest learned speed, the lower of two, and of the
        nearest conditions: a torque was learned for its touchdown, which comes at a whole tick, so
        that a mean of two would be between those that occur.

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
            InvalidInput: It does not cover a condition.
        """
        return InitialFeedforward(self.at(speeds, conditions), self.flight_at(speeds, conditions))

    def flight_at(self, speeds: Array, conditions: Conditions | None = None) -> Array:
        """Durations of the flights at speeds (m,), of the nearest that was learned [s], (m,).

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
            InvalidInput: It does not cover a condition.
        """
        places = (self._places(speeds), *self._condition_places(speeds, conditions).values())
        nearest = (np.ceil(place - 0.5 - _ROUNDING).astype(np.intp) for place in places)
        return np.asarray(self.flight[tuple(nearest)])

    def reusable(self, speeds: Array, conditions: Conditions | None = None) -> BoolArray:
        """Whether the torques at speeds (m,) may be replayed without learning, shape (m,).

        That is so where the learned speeds, and conditions, around it landed alike (`LANDS_ALIKE`).
        A tick is 0.02 rad of swing: torques of two that did not were learned for stances that begin
        elsewhere, and their mean fits neither. It says nothing of scenarios other than those of the
        learning.

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
            InvalidInput: It does not cover a condition.
        """
        places = (self._places(speeds), *self._condition_places(speeds, conditions).values())
        below = [np.floor(place + _ROUNDING).astype(np.intp) for place in places]
        above = [np.ceil(place - _ROUNDING).astype(np.intp) for place in places]
        corners = [self.flight[corner] for corner in product(*zip(below, above, strict=True))]
        return np.asarray(np.ptp(corners, axis=0) < LANDS_ALIKE)

    def in_conditions(self, conditions: Conditions | None = None) -> TorqueLibrary:
        """The library by speed alone, in some conditions.

        Raises:
            InvalidInput: It does not cover them.
        """
        if not self.conditions:
            return self
        speeds = self.speeds
        torque, spread, feedback = (
            replace(self, torque=np.asarray(values)).at(speeds, conditions)
            for values in (self.torque, self.spread, self.feedback)
        )
        flight = self.flight_at(speeds, conditions)
        return TorqueLibrary(
            speeds, torque, spread, flight, feedback, robot=self.robot, gaits=self.gaits
        )

    def _places(self, speeds: Array) -> Array:
        """Fractional indices of speeds into those of the library, shape (m,)."""
        queries, lowest, highest = np.atleast_1d(speeds), self.speeds[0], self.speeds[-1]
        for speed in queries:
            if not lowest - 1e-9 <= speed <= highest + 1e-9:
                raise SpeedOutOfRange(
                    float(speed),
                    float(lowest),
                    float(highest),
                    library="torque library",
                    remedy="learn at speeds around it",
                )
        return np.interp(queries, self.speeds, np.arange(len(self.speeds)))

    def _condition_places(self, speeds: Array, given: Conditions | None) -> dict[str, Array]:
        """Fractional indices into each condition's values, shape (m,), for as many speeds."""
        given = {} if given is None else given
        for name in given:
            known_name("condition", name, self.conditions)
        number = np.atleast_1d(speeds).shape
        values = {name: given.get(name, self.home[name]) for name in self.conditions}
        return {
            name: np.broadcast_to(self._index(name, value), number)
            for name, value in values.items()
        }

    def _index(self, name: str, value: ArrayLike) -> Array:
        """Fractional indices of values of a condition."""
        known, asked = self.conditions[name], np.asarray(value, dtype=float)
        if not np.all((asked >= known[0] - 1e-9) & (asked <= known[-1] + 1e-9)):
            raise InvalidInput(
                f"{name} {asked} is beyond the {known[0]:g} to {known[-1]:g} of the torque "
                "library; learn around it, or stay within"
            )
        return np.asarray(np.interp(asked, known, np.arange(len(known))))

    def without(self, speed: float) -> TorqueLibrary:
        """The library without the learned speed nearest to the given one."""
        kept = np.arange(len(self.speeds)) != int(np.argmin(np.abs(self.speeds - speed)))
        rest = {name: getattr(self, name)[kept] for name in _STORED}
        gaits = tuple(gait for gait, keep in zip(self.gaits, kept, strict=False) if keep)
        return replace(self, **rest, gaits=gaits)

    def left_out(self, speeds: Array) -> tuple[InitialFeedforward, BoolArray]:
        """Initial feedforward at learned speeds (m,), each interpolated from its neighbours only.

        Returns:
            The feedforward, and which of it is `reusable`, shape (m,).

        Raises:
            SpeedOutOfRange: A speed is the first or the last, or the library does not cover it.
        """
        reduced = [(self.without(speed), np.array([speed])) for speed in speeds]
        torque = np.concatenate([library.at(speed) for library, speed in reduced])
        flight = np.concatenate([library.flight_at(speed) for library, speed in reduced])
        reusable = [library.reusable(speed) for library, speed in reduced]
        return InitialFeedforward(torque, flight), np.concatenate(reusable)

    def leave_one_out(self) -> dict[str, Array]:
        """Error of interpolation along each axis, over what changes along it.

        Each inner node is interpolated from its two neighbours along an axis, "speed" or a
        condition. The root mean square of what that misses, over that of the torque's change from
        one neighbour to the other, is 0 where the torque is linear along the axis.

        Returns:
            By axis, one number for each inner value, over all nodes that have it; none for an axis
            of two values.
        """
        found = {}
        for k, (name, values) in enumerate({"speed": self.speeds, **self.conditions}.items()):
            torque = np.moveaxis(self.torque, k, 0)
            share = (values[1:-1] - values[:-2]) / (values[2:] - values[:-2])
            change = torque[2:] - torque[:-2]
            missed = torque[:-2] + share.reshape(-1, *[1] * (torque.ndim - 1)) * change
            missed -= torque[1:-1]
            squares = [
                np.mean(part**2, axis=tuple(range(1, part.ndim))) for part in (missed, change)
            ]
            found[name] = np.sqrt(squares[0] / np.maximum(squares[1], 1e-30))
        return found

    @property
    def sha256(self) -> str:
        """SHA-256 of what is in the library."""
        return arrays_sha256(self._arrays())

    def _arrays(self) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in _STORED}
        if self.conditions:
            arrays |= {f"condition_{name}": values for name, values in self.conditions.items()}
            arrays["conditions"] = np.array(list(self.conditions))
            arrays["home"] = np.array([self.home[name] for name in self.conditions])
        if self.robot:
            arrays["robot"] = np.array(self.robot)
        if self.gaits:
            arrays["gaits"] = np.array(self.gaits)
        return arrays

    def save(self, path: Path | str) -> None:
        """Write the library to an npz file, whole or not at all.

        Raises:
            FileProblem: It cannot be written.
        """
        write_arrays(path, self._arrays(), schema=SCHEMA)

    @classmethod
    def load(cls, path: Path | str) -> TorqueLibrary:
        """Read a library.

        Raises:
            FileProblem: The file is missing or damaged.
        """
        path = known_path("path", path)
        arrays = read_arrays(path, _AGAIN, what="torque library", schema=SCHEMA)
        names = arrays.texts("conditions") if "conditions" in arrays else []
        conditions = {name: arrays.numbers(f"condition_{name}", None) for name in names}
        speeds = arrays.numbers("speeds", None)
        nodes = (len(speeds), *map(len, conditions.values()))
        torque = arrays.numbers("torque", *nodes, 2, None, None)
        spread = arrays.numbers("spread", *torque.shape)
        flight = arrays.numbers("flight", *nodes)
        stored = "feedback" in arrays  # it was not in the first of these files
        feedback = arrays.numbers("feedback", *torque.shape) if stored else None
        home = arrays.numbers("home", len(names)) if names else np.zeros(0)
        begun = dict(zip(names, home.tolist(), strict=True))
        robot = arrays.text("robot") if "robot" in arrays else ""
        gaits = tuple(arrays.texts("gaits")) if "gaits" in arrays else ()
        try:
            return cls(speeds, torque, spread, flight, feedback, conditions, begun, robot, gaits)
        except InvalidInput as error:
            raise arrays.damaged(error) from error
