"""Identification from a result: an `Explanation` of the learned torque."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import xarray as xr

from ..._checks import Interval, instance_of, known_name, real, sequence_of, whole
from ..._display import Displayed, listed, spanned
from ...control import CONTROLLERS
from ...errors import InvalidInput
from ...gait import Gait, load_library
from ...robot import ModelParameters, Robot, recorded_robot
from .equations import DelayedEquations, PhaseForces, equations, phase_forces
from .estimate import Confounding, Estimate, confounding, estimate, repetition
from .ground_survey import Ground, survey
from .model_terms import TERMS, Term, parameters
from .recording import PARTS, PhaseRecording, recordings
from .shares import share_table, shares
from .truth import true_parameters

IMU_NOISE = Interval(0, 1000, "m/s^2")
DRAWS = Interval(2, 1_000_000)
"""What the noise and the number of draws can be."""

REPEATS = 0.95
"""Least repetition of a speed's strides that are explained, see `repetition`."""


@dataclass(frozen=True, eq=False, repr=False)
class Explanation(Displayed):
    """The learned torque by cause, and the identified model.

    Attributes:
        robot: The robot as its URDF has it.
        terms: What was looked for.
        estimate: Their parameters.
        confounding: What could not be told apart.
        shares: The learned torques by cause, see `shares`.
        ground: What the feet found.
        speeds: Speeds that were used [m/s].
        left_out: Speeds whose strides do not repeat [m/s].
        strides: Strides of each speed, the fewest.
        repeated: Whether the strides repeat, so that their noise could be told from the motion.
        true: True parameters by term's name, where a simulation knows them.
        attributes: Where the strides are from: scenario, controller, seed.
    """

    robot: Robot
    terms: tuple[Term, ...]
    estimate: Estimate
    confounding: Confounding
    shares: xr.Dataset
    ground: Ground
    speeds: tuple[float, ...]
    left_out: tuple[float, ...]
    strides: int
    repeated: bool
    true: Mapping[str, float]
    attributes: Mapping[str, str]

    def _title(self) -> str:
        what = " in ".join(
            self.attributes[key] for key in ("controller", "scenario") if key in self.attributes
        )
        return f"Explanation of what {what or 'learning'} found, {self.robot.name}"

    def _facts(self) -> dict[str, str]:
        low, high = self.estimate.interval()
        rows = zip(self.terms, self.estimate.value, high - low, self.confounding.seen, strict=True)
        seen = {t.name: f"{v:.4g} ± {w / 2:.2g} [{t.unit}]" for t, v, w, sees in rows if sees}
        unseen = [term.name for term in self.terms if term.name not in seen]
        strides = {"speeds": spanned(self.speeds, "m/s"), "strides": f"{self.strides} of each"}
        return {**strides, **seen, "not seen": listed(unseen)}

    @cached_property
    def parameters(self) -> ModelParameters:
        """The parameters that were seen, as `Robot.with_parameters` takes them."""
        seen = self.confounding.seen
        values = zip(self.terms, self.estimate.value, seen, strict=True)
        return parameters({t.name: float(v) for t, v, sees in values if sees}, self.robot)

    @cached_property
    def identified(self) -> Robot:
        """The robot with the identified parameters."""
        return self.robot.with_parameters(self.parameters)

    @property
    def share_table(self) -> xr.DataArray:
        """Share of the discrepancy by cause, see `share_table`."""
        return share_table(self.shares)

    def table(self) -> pd.DataFrame:
        """One row a term: estimate, ends of its 95 % interval, truth where known, what was seen."""
        low, high = self.estimate.interval()
        seen = self.confounding.seen
        return pd.DataFrame(
            {
                "unit": [term.unit for term in self.terms],
                "estimate": np.where(seen, self.estimate.value, np.nan),
                "low": np.where(seen, low, np.nan),
                "high": np.where(seen, high, np.nan),
                "true": [self.true.get(term.name, np.nan) for term in self.terms],
                "seen": seen,
            },
            index=pd.Index([term.name for term in self.terms], name="term"),
        )


def explain(
    strides: xr.Dataset,
    *,
    terms: tuple[Term, ...] = TERMS,
    parts: Sequence[str] = PARTS,
    gaits: Sequence[Gait] | None = None,
    imu_noise: float = 0.0,
    draws: int = 300,
    rng: np.random.Generator | None = None,
) -> Explanation:
    """Identify what the model lacks from the torque that was learned.

    Args:
        strides: The strides of one cell, as `Results.strides` reads them.
        terms: What the model may lack.
        parts: Which phases to use.
        gaits: The gaits that were played, one for each speed; by default the shipped ones.
        imu_noise: Standard deviation of noise that is added to the trunk's acceleration [m/s^2].
        draws: How often the strides are drawn anew for the intervals.
        rng: Source of the draws and of that noise; by default one that starts at 0.

    Raises:
        InvalidInput: The base is not locked, the strides have no ticks, or too few strides.
    """
    imu_noise, draws = real("imu_noise", imu_noise, IMU_NOISE), whole("draws", draws, DRAWS)
    parts = sequence_of("parts", parts, lambda k, part: known_name("part", part, PARTS))
    if rng is not None:
        instance_of("rng", rng, np.random.Generator, "a numpy.random.Generator")
    instance_of("strides", strides, xr.Dataset, "the strides of a cell, as Results.strides() reads")
    if strides.attrs.get("base", "locked") != "locked":
        raise InvalidInput(
            f"explain needs a locked base, not '{strides.attrs['base']}': run the comparison with "
            "--base locked"
        )
    check_learner(str(strides.attrs.get("controller", "")))
    rng = np.random.default_rng(0) if rng is None else rng
    robot = recorded_robot(strides.attrs)
    recorded = recordings(strides, parts=tuple(parts), imu_noise=imu_noise, rng=rng)
    forces = {
        speed: tuple(phase_forces(robot, phase, terms) for phase in phases)
        for speed, phases in recorded.items()
    }
    rows = {speed: equations(robot, phases_, terms) for speed, phases_ in forces.items()}
    used, repeated = _repeating(rows, terms)
    fit = estimate({v: rows[v] for v in used}, terms, rng=rng, draws=draws, others=repeated)
    played = _gaits(strides, gaits)
    return Explanation(
        robot=robot,
        terms=terms,
        estimate=fit,
        confounding=confounding(fit),
        shares=shares(
            robot,
            [played[speed] for speed in used],
            [_by_part(forces[speed]) for speed in used],
            fit.value,
            terms,
        ),
        ground=survey(robot, _stances(recorded[speed] for speed in used)),
        speeds=tuple(used),
        left_out=tuple(float(v) for v in strides["speed"].to_numpy() if float(v) not in set(used)),
        strides=min(forces[speed][0].recording.strides for speed in used),
        repeated=repeated,
        true=true_parameters(robot, strides),
        attributes={key: str(value) for key, value in strides.attrs.items()},
    )


def check_learner(controller: str) -> None:
    """Refuse a controller of ours in whose torques there is nothing that was learned.

    Raises:
        InvalidInput: It neither learns nor begins with what was learned.
    """
    spec = CONTROLLERS.get(controller)
    if spec is not None and not any(spec.laws) and spec.source in ("none", "model"):
        raise InvalidInput(
            f"controller '{controller}' learns nothing that could be explained; choose one that "
            "does, as 'ilc'"
        )


def _repeating(
    rows: Mapping[float, DelayedEquations], terms: tuple[Term, ...]
) -> tuple[list[float], bool]:
    """Speeds whose strides repeat, or all of them where none do; whether they do."""
    repeating = [
        speed
        for speed, each in rows.items()
        if repetition(each.at(np.zeros(len(terms))), terms) > REPEATS
    ]
    return (repeating, True) if repeating else (list(rows), False)


def _gaits(strides: xr.Dataset, gaits: Sequence[Gait] | None) -> dict[float, Gait]:
    speeds = [float(speed) for speed in strides["speed"].to_numpy()]
    if gaits is None:
        library = load_library(strides.attrs["robot"])
        gaits = [library.at(speed) for speed in speeds]
    if len(gaits) != len(speeds):
        raise InvalidInput(f"{len(gaits)} gaits for {len(speeds)} speeds; give one for each")
    return dict(zip(speeds, gaits, strict=True))


def _by_part(phases: tuple[PhaseForces, ...]) -> dict[str, PhaseForces]:
    return {phase.recording.part: phase for phase in phases}


def _stances(recorded: Iterable[tuple[PhaseRecording, ...]]) -> list[PhaseRecording]:
    return [phase for phases in recorded for phase in phases if phase.part == "stance"]
