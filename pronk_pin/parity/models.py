"""Parity of two robot models: masses, joints and motors side by side, and M, h and J.

A model is a `Robot`, a URDF, an MJCF, or a compiled MuJoCo model. Links and joints are matched by
the joints' names, so that the order of the joints does not matter, and compared relative to the
joints' anchors in the trunk's axes, so that it does not matter where a model puts its bodies'
frames. The trunk's own frame does matter: it is what the base coordinates of a state place.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import mujoco
import numpy as np

from .._checks import NOT_NEGATIVE, Interval, instance_of, none_or, real, whole
from .._typing import Array
from ..errors import FileProblem, InvalidInput
from ..robot import Robot, read_urdf
from ..robot.formats import compile_mjcf, drop_looks, read_mjcf
from ..storage import from_text, read_xml
from .mechanism import FLOATING, Mechanism, Point, State, read_pinocchio
from .mechanism_mujoco import read_mujoco
from .table import Row, compare_tables, format_table, format_value

Model: TypeAlias = Robot | str | Path | mujoco.MjModel
"""Kinds of models that can be compared."""

_GIVE = "give the path of a URDF or an MJCF"

ROUND_OFF = 1e-9
"""Relative tolerance for models with all their digits."""

SIX_DIGITS = 1e-5
"""Relative tolerance for an MJCF of six significant digits, as MuJoCo writes it."""


@dataclass(frozen=True)
class Parity:
    """Result of the comparison of two models: agreement, and the differences.

    Attributes:
        a, b: What was compared.
        rows: The table.
        states: Number of random states.
        tolerance: Relative difference up to which values agree.
        mass_matrix: Largest |dM_ij| / sqrt(M_ii M_jj) over the states, M of the floating robot
            with its rotors, in Pinocchio's layout; None where it cannot be compared.
        bias: Largest |dh_i| / max |h_i| of the forces h = H v + G, without damping and friction;
            None likewise.
        jacobian: Largest |dJ_ij| / max |J_ij| of the feet, the same material points in both
            models, in the world's axes; None likewise.
        reason: Why they cannot be compared, and what to do; empty where they are.
    """

    a: str
    b: str
    rows: tuple[Row, ...]
    states: int
    tolerance: float
    mass_matrix: float | None
    bias: float | None
    jacobian: float | None
    reason: str

    @property
    def differences(self) -> tuple[Row, ...]:
        """The rows that differ."""
        return tuple(row for row in self.rows if row.agrees is False)

    @property
    def agrees(self) -> bool:
        """Whether everything agrees within the tolerance."""
        dynamics = (self.mass_matrix, self.bias, self.jacobian)
        same = all(value is not None and value <= self.tolerance for value in dynamics)
        return same and not self.differences

    def to_json(self) -> str:
        """The comparison as JSON; `from_json` reads it."""
        return json.dumps(_written(dataclasses.asdict(self)), indent=1)

    @classmethod
    def from_json(cls, text: str) -> Parity:
        """Read the comparison that `to_json` wrote.

        Raises:
            InvalidInput: The text is something else.
        """
        stored = from_text(text, _Stored, "a comparison of models", "make it again")
        return cls(**{**vars(stored), "rows": tuple(map(_restored, stored.rows))})

    def table(self, *, full: bool = False) -> str:
        """The comparison as text.

        Args:
            full: Every row, not only those that differ.
        """
        judged = sum(row.agrees is not None for row in self.rows)
        lines = [f"a  {self.a}", f"b  {self.b}", ""]
        shown = self.rows if full else self.differences
        if shown:
            lines += [*format_table(shown, verdict=full), ""]
        lines.append(
            f"{len(self.differences)} of {judged} table values differ by more than "
            f"{self.tolerance:g} (relative)"
        )
        for row in self.rows:
            if row.what == "joint order" and row.a != row.b:
                lines.append("joint orders, which names convert")
                lines += [f"  a  {format_value(row.a)}", f"  b  {format_value(row.b)}"]
        if self.reason:
            lines.append(f"M, h and J are not compared: {self.reason}")
        else:
            lines.append(f"largest relative difference on {self.states} random states")
            for name, value in (
                ("mass matrix M", self.mass_matrix),
                ("bias forces h", self.bias),
                ("foot Jacobians J", self.jacobian),
            ):
                assert value is not None
                lines.append(f"  {name:16s}  {value:.1e}{self._mark(value)}")
        verdict = "The same robot, to round-off." if self.agrees else "Not the same robot."
        return "\n".join([*lines, "", verdict])

    def _mark(self, value: float) -> str:
        return "" if value <= self.tolerance else "  differs"


def compare_models(
    a: Model,
    b: Model,
    *,
    states: int = 200,
    rng: np.random.Generator | None = None,
    tolerance: float | None = None,
) -> Parity:
    """Compare two models of a legged robot.

    Where a model knows nothing of a quantity (the velocity limits of an MJCF, the feet of a URDF
    without a `RobotSpec`, the actuators of an MJCF that has none), its row holds None and is not
    judged. The order of the joints is reported but not judged either: names convert it.

    Args:
        a: A `Robot`, the path of a URDF or an MJCF, or a compiled MuJoCo model.
        b: The other one.
        states: Number of random states: any attitude, joints within a's limits.
        rng: Draws the states; by default a generator with seed 0.
        tolerance: Relative difference up to which values agree. By default `ROUND_OFF`, or
            `SIX_DIGITS` where a file is an MJCF whose numbers have no more than six digits.

    Raises:
        FileProblem: A file is missing, or neither a URDF nor an MJCF.
        InvalidInput: A model is not of a robot with hinges and slides, or an option is out of
            range.
    """
    states = whole("states", states, Interval(1, 1_000_000))
    none_or(instance_of, "rng", rng, np.random.Generator, "a numpy.random.Generator")
    tolerance = none_or(real, "tolerance", tolerance, NOT_NEGATIVE)
    first, second = _read(a), _read(b)
    if tolerance is None:
        tolerance = max(ROUND_OFF, first.round_off, second.round_off)
    reason = _obstacle(first, second)
    mass = bias = jacobian = None
    if not reason:
        rng = np.random.default_rng(0) if rng is None else rng
        mass, bias, jacobian = _compare_dynamics(first, second, states, rng)
    return Parity(
        a=first.label,
        b=second.label,
        rows=tuple(compare_tables(first, second, tolerance)),
        states=states,
        tolerance=float(tolerance),
        mass_matrix=mass,
        bias=bias,
        jacobian=jacobian,
        reason=reason,
    )


def _written(value: Any) -> Any:
    """Plain data for JSON, which has no infinity and NaN: words and null instead."""
    if isinstance(value, dict):
        return {key: _written(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_written(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


_Number: TypeAlias = float | Literal["inf", "-inf"] | None
"""A number as JSON has it: infinity is a word, and NaN is null."""

_Word: TypeAlias = float | str | None
"""A value as JSON has it."""


@dataclass(frozen=True)
class _StoredRow:
    """A row as `_written` leaves it."""

    what: str
    where: str
    a: _Word | tuple[_Number, ...]
    b: _Word | tuple[_Number, ...]
    difference: _Number
    unit: str
    agrees: bool | None


@dataclass(frozen=True)
class _Stored:
    """A comparison as `_written` leaves it."""

    a: str
    b: str
    rows: tuple[_StoredRow, ...]
    states: int
    tolerance: float
    mass_matrix: _Number
    bias: _Number
    jacobian: _Number
    reason: str


def _restored(row: _StoredRow) -> Row:
    """A row as it was before `_written`."""

    def number(value: Any) -> Any:
        return float(value) if value in ("inf", "-inf") else value

    values: dict[str, Any] = {
        key: tuple(math.nan if part is None else number(part) for part in value)
        if isinstance(value, tuple)
        else number(value)
        for key, value in vars(row).items()
    }
    missing = values["difference"] is None
    return Row(**{**values, "difference": math.nan if missing else values["difference"]})


def _obstacle(a: Mechanism, b: Mechanism) -> str:
    """Reason for which M, h and J of two mechanisms cannot be compared; empty if they can."""
    for one, other in ((a, b), (b, a)):
        missing = [name for name in other.joints if name not in one.joints]
        if missing:
            return f"{one.label} has no {', '.join(missing)}; give both the same joints"
    for one in (a, b):
        if one.base != FLOATING:
            return (
                f"the trunk of {one.label} is {one.base}; let it float, with <freejoint/> in the "
                "trunk's body"
            )
    return ""


def _compare_dynamics(
    a: Mechanism, b: Mechanism, count: int, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Largest relative differences of M, h and J."""
    names, points = tuple(a.joints), _points(a, b)
    limits = np.array([a.joints[name].limits for name in names])
    low, high = np.clip(limits, -np.pi, np.pi).T
    mass = jacobian = 0.0
    forces, changes = [], []
    for _ in range(count):
        quaternion = rng.normal(size=4)
        state = State(
            position=rng.normal(size=3),
            quaternion=quaternion / np.linalg.norm(quaternion),
            base_velocity=2.0 * rng.normal(size=6),
            angles=rng.uniform(low, np.maximum(low, high)),
            rates=2.0 * rng.normal(size=len(names)),
        )
        one, other = (model.engine.evaluate(names, points, state) for model in (a, b))
        scale = np.sqrt(np.diag(one.mass_matrix))
        change = np.abs(other.mass_matrix - one.mass_matrix) / np.outer(scale, scale)
        mass = max(mass, float(change.max()))
        change = np.abs(other.jacobian - one.jacobian)
        jacobian = max(jacobian, float(change.max() / np.abs(one.jacobian).max()))
        forces.append(np.abs(one.bias))
        changes.append(np.abs(other.bias - one.bias))
    bias = np.max(changes, axis=0) / np.max(forces, axis=0)
    return mass, float(bias.max()), jacobian


def _points(a: Mechanism, b: Mechanism) -> list[Point]:
    """The feet; where neither model names them, the centres of mass of the last links."""
    for model in (a, b):
        if model.named_feet:
            return [Point(link, foot.centre) for link, feet in model.feet.items() for foot in feet]
    bearing = {joint.parent for joint in a.joints.values()}
    return [Point(name, a.links[name].centre) for name in a.joints if name not in bearing]


def _read(model: Model) -> Mechanism:
    if isinstance(model, Robot):
        label = f"{model.name} (Pinocchio, {model.urdf_path.name})"
        return read_pinocchio(model.model, label, model)
    if isinstance(model, mujoco.MjModel):
        return read_mujoco(model, f"{_model_name(model)} (MuJoCo)")
    if isinstance(model, str | Path):
        return _read_file(Path(model).expanduser())
    raise InvalidInput(
        f"{type(model).__name__} is no model; give a Robot, the path of a URDF or an MJCF, or a "
        "mujoco.MjModel"
    )


def _model_name(model: mujoco.MjModel) -> str:
    """Name of a MuJoCo model, which stands at the start of its names."""
    return bytes(model.names).split(b"\0", 1)[0].decode(errors="replace") or "a model"


def _read_file(path: Path) -> Mechanism:
    """Read a URDF by Pinocchio or an MJCF by MuJoCo, as its first element tells."""
    # A file that is xacro may be no XML; who reads URDFs says so.
    root = "robot" if path.suffix == ".xacro" else read_xml(path, _GIVE).tag
    if root == "robot":
        return read_pinocchio(read_urdf(path).model, f"{path} (Pinocchio)")
    if root != "mujoco":
        raise FileProblem(
            path,
            f"neither a URDF nor an MJCF (it begins with <{root}>)",
            "give a file that begins with <robot> or <mujoco>",
        )
    spec = read_mjcf(path)
    six_digits = _has_six_digits(spec)
    drop_looks(spec)
    compiled = compile_mjcf(spec, path, "correct what it names")
    return read_mujoco(compiled, f"{path} (MuJoCo)", round_off=SIX_DIGITS if six_digits else 0.0)


def _has_six_digits(spec: mujoco.MjSpec) -> bool:
    """Whether the numbers of an MJCF would look the same with six significant digits."""
    numbers: list[Array] = []
    for body in spec.bodies:
        numbers += [body.pos, body.quat, body.ipos, body.iquat, body.inertia, body.fullinertia]
        numbers.append(np.array([body.mass]))
    for joint in spec.joints:
        numbers += [joint.pos, joint.axis, joint.range]
    values = np.concatenate([np.ravel(part) for part in numbers])
    values = values[np.isfinite(values)]
    return all(float(f"{value:.6g}") == value for value in values)
