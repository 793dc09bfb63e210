"""Text of an explanation: tables and remarks, for a terminal and for comments of files."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

import numpy as np

from ...robot import JOINTS
from .equations import GROUPS
from .explanation import Explanation
from .shares import discrepancy, explained, feedback_share

_WIDTH = 96
FEW_STRIDES = 6
"""Fewer strides than these leave the noise's part uncertain."""
WIDE = 0.05
"""Half an interval over the term's scale from which on a confounded pair is not told apart."""
FOREIGN = 2.0
"""Ratio of the residual to the strides' noise from which on something else is at work."""
_LEAST = np.array([1.0, 1.0, 0.05, 0.05, 0.05])
"""Residuals too small to matter, by group [N, N, N m, N m, N m]."""
SINKING = 0.005
"""Depth from which on the ground gives way [m]; a stiff one takes 2.5 mm in a landing."""
SLOPE = np.radians(1.0)
"""Slope from which on the ground is not level [rad]."""
GRAVITY = 0.1
"""Difference from which on gravity is another than the model's [m/s^2]."""
_INTERNAL = 1.0
"""Torque from which on internal forces are worth a word [N m]."""
_UNITS = {"x": "N", "z": "N"}


def describe(explanation: Explanation) -> str:
    """Format the tables of the parameters and of the shares, and the remarks."""
    return "\n\n".join(
        [
            format_parameters(explanation),
            format_shares(explanation),
            "\n".join(textwrap.fill(word, _WIDTH) for word in remarks(explanation)),
        ]
    )


def format_parameters(explanation: Explanation) -> str:
    """Format the parameters with their intervals, and their true values where known."""
    table = explanation.table()
    has_truth = bool(table["true"].notna().any())
    lines = [
        f"{'what the model lacks':<18}{'estimate':>10}  {'95 % interval':^19}"
        + (f"{'true':>9}" if has_truth else "")
        + "  unit"
    ]
    for term, (name, row) in zip(explanation.terms, table.iterrows(), strict=True):
        digits = 5 if term.scale < 0.1 else 3
        if row["seen"]:
            low, high = (f"{row[end]:8.{digits}f}" for end in ("low", "high"))
            cells = f"{row['estimate']:10.{digits}f}  [{low},{high}]"
        else:
            cells = f"{'-':>10}  {'not seen':^19}"
        known = f"{row['true']:9.{digits}f}" if np.isfinite(row["true"]) else f"{'-':>9}"
        truth = known if has_truth else ""
        lines.append(f"{name:<18}{cells}{truth}  {row['unit']}")
    return "\n".join(lines)


def format_shares(explanation: Explanation) -> str:
    """Format the shares of the causes in the difference between learned and model torque."""
    table, fit = explanation.share_table, explained(explanation.shares)
    shares = explanation.shares
    size = discrepancy(shares) ** 2
    heads = [(part, joint) for part in ("stance", "flight") for joint in JOINTS]
    kinds = shares["kind"].to_numpy()
    lines = [
        f"{'learned - model':<18}" + "".join(f"{part:>9}" for part, _ in heads),
        f"{'explained by':<18}" + "".join(f"{joint:>9}" for _, joint in heads),
    ]
    rms = [
        float(np.sqrt(size.sel(part=part)[..., [k == joint for k in kinds]].mean()))
        for part, joint in heads
    ]
    lines.append(f"{'RMS [N m]':<18}" + "".join(_number(value, ".2f") for value in rms))
    for cause in map(str, table["cause"].to_numpy()):
        values = [float(table.sel(cause=cause, part=p, joint=j)) for p, j in heads]
        lines.append(f"{cause:<18}" + "".join(_number(value, ".0%") for value in values))
    share = feedback_share(shares)
    values = [float(share.sel(part=p, joint=j)) for p, j in heads]
    lines.append(f"{'(from feedback)':<18}" + "".join(_number(value, ".0%") for value in values))
    values = [float(fit.sel(part=p, joint=j)) for p, j in heads]
    lines.append(f"{'R^2':<18}" + "".join(_number(value, ".3f") for value in values))
    return "\n".join(lines)


def remarks(explanation: Explanation) -> list[str]:
    """Remarks on the data, the residual, internal forces, the ground and confounding."""
    return [
        *_of_the_strides(explanation),
        *_of_the_rest(explanation),
        *_of_internal_forces(explanation),
        *_of_the_ground(explanation),
        *_of_the_motors(explanation),
        *_of_confounding(explanation),
    ]


def _of_the_strides(explanation: Explanation) -> Iterator[str]:
    speeds, strides = len(explanation.speeds), explanation.strides
    yield f"From the last {strides} strides at {speeds} speed{'s' if speeds > 1 else ''}."
    if explanation.left_out:
        listed = ", ".join(f"{speed:g}" for speed in explanation.left_out)
        yield f"Left out, because the strides there do not repeat or are not whole: {listed} m/s."
    if not explanation.repeated:
        yield (
            "The strides do not repeat at any speed: noise could not be told from motion, and the "
            "estimates may be biased. Explain a steadier run."
        )
    if strides < FEW_STRIDES:
        yield (
            f"Only {strides} strides: the intervals are rough, and may be too narrow. Let it "
            "learn longer."
        )
    if speeds == 1:
        yield (
            "One speed only: terms that one motion does not tell apart stay together. Learn at "
            "two or more."
        )


def _of_the_rest(explanation: Explanation) -> Iterator[str]:
    residuals = foreign(explanation)
    if residuals:
        listed = ", ".join(
            f"{value:.2g} {_UNITS.get(group, 'N m')} in {_place(group)}"
            for group, value in residuals.items()
        )
        yield (
            f"Unexplained: something that is none of the terms is at work, {listed} (root mean "
            "square). The estimates are of the rest, and less sure than they look."
        )


def foreign(explanation: Explanation) -> dict[str, float]:
    """Residuals that noise does not explain, by group of rows; empty if none."""
    fit = explanation.estimate
    beyond = (fit.rest > FOREIGN * fit.noise) & (fit.rest > _LEAST)
    return {group: float(fit.rest[k]) for k, group in enumerate(GROUPS) if beyond[k]}


def _place(group: str) -> str:
    if group in _UNITS:
        return f"the balance of forces along {group} in stance"
    return f"the {group}s in flight"


def _of_internal_forces(explanation: Explanation) -> Iterator[str]:
    torque = explanation.shares["torque"].sel(cause="internal forces", part="stance")
    kinds = torque["kind"].to_numpy()
    for joint in dict.fromkeys(kinds):
        torque_of_kind = torque.isel(joint=[kind == joint for kind in kinds])
        size = float(np.sqrt((torque_of_kind**2).mean()))
        share = float(
            explanation.share_table.sel(cause="internal forces", part="stance").sel(joint=joint)
        )
        if share > 0.5 and size > _INTERNAL:
            yield (
                f"In stance the {joint}s learned {size:.1f} N m (root mean square) that make no "
                "motion: the feet push against each other and the planar constraint."
            )


def _of_the_ground(explanation: Explanation) -> Iterator[str]:
    ground = explanation.ground
    level = not abs(ground.slope) > SLOPE  # on a slope the feet land one after the other
    if ground.sinking > SINKING and level:
        yield (
            f"Not one of the terms: the ground gives way by {1e3 * ground.sinking:.0f} mm at "
            "touchdown. What that does to the motion stands under deviation."
        )
    if not level:
        yield (
            f"Not one of the terms: the ground rises by {np.degrees(ground.slope):.1f} degrees "
            "forwards."
        )
    usual = explanation.robot.gravity
    if abs(ground.gravity - usual) > GRAVITY:
        yield (
            f"Not one of the terms: gravity is {ground.gravity:.2f} m/s^2, and {usual:g} in the "
            "model."
        )


def _of_the_motors(explanation: Explanation) -> Iterator[str]:
    """Motors that truly differ, where a simulation knows them and one term stands for all."""
    by_kind = [explanation.true.get(f"{joint} weak motors", np.nan) for joint in JOINTS]
    if np.isfinite(by_kind).all() and any(term.name == "weak motors" for term in explanation.terms):
        weak = ", ".join(f"{w:.3f} in the {j}s" for j, w in zip(JOINTS, by_kind, strict=True))
        yield (
            f"The motors are not all as weak: {weak}. The one estimate is of all of them, and its "
            "true value their mean."
        )


def _of_confounding(explanation: Explanation) -> Iterator[str]:
    terms, confounding = explanation.terms, explanation.confounding
    unseen = [term for term, seen in zip(terms, confounding.seen, strict=True) if not seen]
    for advice in dict.fromkeys(term.advice for term in unseen):
        names = " and ".join(term.name for term in unseen if term.advice == advice)
        yield f"Not seen in this motion: {names}. To see it, {advice}."
    low, high = explanation.estimate.interval()
    wide = 0.5 * (high - low) > WIDE * np.array([term.scale for term in terms])
    for i, j, correlation in confounding.pairs:
        if wide[i] or wide[j]:
            advice = "; or ".join(dict.fromkeys([terms[i].advice, terms[j].advice]))
            yield (
                f"Not told apart: {terms[i].name} and {terms[j].name} (correlation "
                f"{correlation:.2f}); what is sure is their sum. To tell, {advice}."
            )
    yield f"Condition number of what was seen: {confounding.condition:.0f}."


def _number(value: float, form: str) -> str:
    return f"{format(value, form) if np.isfinite(value) else '-':>9}"
