"""Table of the comparison of two models: its rows, and their text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .mechanism import TRUNK, Foot, Joint, Link, Mechanism

Value: TypeAlias = float | tuple[float, ...] | str | None
"""A number, a vector, a word, or None where a model knows nothing of it."""

_HEADER = ("what", "where", "a", "b", "difference", "unit")

_WIDEST = 34
"""Columns of a value that is longer than most."""


@dataclass(frozen=True)
class Row:
    """One compared quantity.

    Attributes:
        what: The quantity, as "centre of mass".
        where: The joint, for its link too; "trunk", a foot, or "model".
        a, b: Its values; an inertia is (xx, yy, zz, xy, xz, yz) about the centre of mass, in the
            trunk's axes at zero joint angles.
        difference: The largest absolute difference of the numbers; NaN of words and of None.
        unit: Unit of the numbers.
        agrees: The verdict; None where there is none, as only information is given.
    """

    what: str
    where: str
    a: Value
    b: Value
    difference: float
    unit: str
    agrees: bool | None


class _Sheet:
    """Rows as they are written down."""

    def __init__(self, tolerance: float) -> None:
        self.rows: list[Row] = []
        self._tolerance = tolerance

    def numbers(
        self,
        what: str,
        where: str,
        a: npt.ArrayLike | None,
        b: npt.ArrayLike | None,
        unit: str,
        *,
        scale: float = 0.0,
    ) -> bool:
        """A row of numbers that agree relative to the largest of them, or to `scale` if more.

        Returns:
            Whether they do not differ.
        """
        if a is None or b is None:
            self.rows.append(Row(what, where, _value(a), _value(b), float("nan"), unit, None))
            return True
        x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
        both = np.abs(np.concatenate([np.ravel(x), np.ravel(y)]))
        scale = max(scale, both[np.isfinite(both)].max(initial=0.0))
        equal = x == y  # so that two infinite limits are
        change = float(np.max(np.abs(np.where(equal, 0.0, x) - np.where(equal, 0.0, y))))
        agrees = bool(change <= self._tolerance * scale)
        self.rows.append(Row(what, where, _value(x), _value(y), change, unit, agrees))
        return agrees

    def words(
        self, what: str, where: str, a: str | None, b: str | None, *, judged: bool = True
    ) -> None:
        """A row of words."""
        judged = judged and a is not None and b is not None
        verdict = a == b if judged else None
        self.rows.append(Row(what, where, a, b, float("nan"), "", verdict))


def compare_tables(a: Mechanism, b: Mechanism, tolerance: float) -> list[Row]:
    """The table of two mechanisms."""
    sheet = _Sheet(tolerance)
    size = max([float(np.abs(joint.origin).max()) for joint in a.joints.values()], default=0.0)
    sheet.words("base", "trunk", a.base, b.base)
    sheet.numbers("gravity", "model", a.gravity, b.gravity, "m/s^2")
    for what in {**a.extras, **b.extras}:
        sheet.numbers(what, "model", a.extras.get(what, 0), b.extras.get(what, 0), "")
    sheet.words("joint order", "model", ", ".join(a.joints), ", ".join(b.joints), judged=False)
    _link_rows(sheet, TRUNK, a.links[TRUNK], b.links[TRUNK], size)
    for name in {**a.joints, **b.joints}:
        there = ["present" if name in model.joints else "missing" for model in (a, b)]
        sheet.words("joint", name, *there)
        if "missing" not in there:
            placed = _link_rows(sheet, name, a.links[name], b.links[name], size)
            _joint_rows(sheet, name, a.joints[name], b.joints[name], size, placed=placed)
    _foot_rows(sheet, a, b, size)
    return sheet.rows


def _link_rows(sheet: _Sheet, name: str, a: Link, b: Link, size: float) -> bool:
    """Rows of a link; whether its mass is at the same place."""
    sheet.numbers("mass", name, a.mass, b.mass, "kg")
    centre = sheet.numbers("centre of mass", name, a.centre, b.centre, "m", scale=size)
    order = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
    inertia = sheet.numbers("inertia", name, a.inertia[order], b.inertia[order], "kg m^2")
    return centre and inertia


def _joint_rows(sheet: _Sheet, name: str, a: Joint, b: Joint, size: float, *, placed: bool) -> None:
    hinge = a.kind == "hinge"
    angle, torque = ("rad", "N m") if hinge else ("m", "N")
    sheet.words("joint kind", name, a.kind, b.kind)
    sheet.words("parent", name, a.parent, b.parent)
    sheet.numbers("joint origin", name, a.origin, b.origin, "m", scale=size)
    sheet.numbers("joint axis", name, a.axis, b.axis, "", scale=1.0)
    sheet.numbers("angle as drawn", name, a.zero, b.zero, angle, scale=1.0)
    if placed:  # the file draws another pose, but zero means the same
        sheet.rows[-1] = replace(sheet.rows[-1], agrees=None)
    sheet.numbers("limits", name, a.limits, b.limits, angle, scale=1.0)
    sheet.numbers("torque limits", name, a.torque_limits, b.torque_limits, torque)
    sheet.numbers("velocity limit", name, a.speed_limit, b.speed_limit, f"{angle}/s")
    sheet.numbers("armature", name, a.armature, b.armature, "kg m^2" if hinge else "kg")
    sheet.numbers("damping", name, a.damping, b.damping, f"{torque} s/{angle}")
    sheet.numbers("friction", name, a.friction, b.friction, torque)
    sheet.numbers("stiffness", name, a.stiffness, b.stiffness, f"{torque}/{angle}")
    sheet.words("actuator", name, a.actuator, b.actuator)
    gains = (a.torque_per_control, b.torque_per_control)
    sheet.numbers("torque per control", name, *gains, torque)


def _foot_rows(sheet: _Sheet, a: Mechanism, b: Mechanism, size: float) -> None:
    """Feet of one model, and the spheres of the other that are nearest to them."""
    swapped = b.named_feet and not a.named_feet
    named, other = (b, a) if swapped else (a, b)
    for link, feet in named.feet.items():
        for foot in feet:
            near = _nearest(foot, other.feet.get(link, ()))
            one, two = (near, foot) if swapped else (foot, near)
            where = foot.name or f"last link of {link}"
            sheet.numbers(
                "foot centre", where, one and one.centre, two and two.centre, "m", scale=size
            )
            sheet.numbers("foot radius", where, one and one.radius, two and two.radius, "m")


def _nearest(foot: Foot, spheres: tuple[Foot, ...]) -> Foot | None:
    """The sphere whose centre is nearest to a foot's."""
    if not spheres:
        return None
    return min(spheres, key=lambda each: float(np.linalg.norm(each.centre - foot.centre)))


def _value(value: npt.ArrayLike | None) -> Value:
    if value is None:
        return None
    array = np.asarray(value, dtype=float)
    return float(array) if array.ndim == 0 else tuple(float(x) for x in array)


def format_table(rows: Sequence[Row], *, verdict: bool) -> list[str]:
    """Lines of a table; rows that say the same of several joints are one.

    Args:
        rows: The rows.
        verdict: Add a column that marks those that differ.
    """
    lines: list[tuple[str, ...]] = [(*_HEADER, "") if verdict else _HEADER]
    for row in merged(rows):
        lines += _cells(row, verdict=verdict)
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    return ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines]


def merged(rows: Sequence[Row]) -> list[Row]:
    """Rows that say the same of several joints as one, whose `where` counts them.

    The order of the joints is left out: it is too long for a column.
    """
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        if row.what != "joint order":
            groups.setdefault((row.what, row.a, row.b, row.unit, row.agrees), []).append(row)
    return [
        same[0]
        if len(same) == 1
        else replace(same[0], where=f"{same[0].where} and {len(same) - 1} more")
        for same in groups.values()
    ]


def _cells(row: Row, *, verdict: bool) -> list[tuple[str, ...]]:
    """The lines of a row; long vectors go below each other."""
    difference = "" if np.isnan(row.difference) else f"{row.difference:.3g}"
    mark = {True: "", None: "not judged", False: "differs"}[row.agrees]
    values = [_pieces(row.a), _pieces(row.b)]
    lines: list[tuple[str, ...]] = []
    for part in range(max(map(len, values))):
        first = part == 0
        a, b = (pieces[part] if part < len(pieces) else "" for pieces in values)
        cells = (
            (row.what, row.where, a, b, difference, row.unit) if first else ("", "", a, b, "", "")
        )
        lines.append((*cells, mark if first else "") if verdict else cells)
    return lines


def _pieces(value: Value) -> list[str]:
    """A value as text, a vector that is too long for a column in two lines."""
    text = format_value(value)
    if isinstance(value, tuple) and len(text) > _WIDEST:
        middle = len(value) // 2
        return [f"({_listed(value[:middle])},", f" {_listed(value[middle:])})"]
    return [text]


def format_value(value: Value) -> str:
    """A value as text, with as many digits as tell models apart that differ by little."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"({_listed(value)})"
    return value if isinstance(value, str) else f"{value:.7g}"


def _listed(values: tuple[float, ...]) -> str:
    return ", ".join("0" if abs(x) < 1e-15 else f"{x:.6g}" for x in values)
