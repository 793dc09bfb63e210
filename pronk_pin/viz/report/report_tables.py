"""The report's tables: numbers as texts, with their intervals and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...compare import Experiment
from ...compare.metrics import LEARNER, RIVAL, Interval
from ...compare.report import (
    SHOWN,
    SHOWN_PARAMETERS,
    Overview,
    against_model,
    beat_text,
    between,
    number,
)
from ...parity import Parity, Row, format_value, merged
from ..figure_style import in_order
from ..figures import LABELS


def by_scenario(tables: Mapping[str, Overview]) -> pd.DataFrame:
    """One row a world about `ilc`, beside `pd` and `model`, from the overviews of `answer`."""
    rows = {}
    for world, table in tables.items():
        if LEARNER not in table:
            continue
        row, cells = table[LEARNER], {}
        for joint in SHOWN:
            for other in ("pd", RIVAL):
                if other in table:
                    value = table[other].joints[joint].peak.value
                    cells[f"{joint} [rad]: {LABELS[other]}"] = number(value, ".4f")
            cells[f"{joint} [rad]: ILC"] = _with_interval(row.joints[joint].peak, ".4f")
        cells["better than model (calf/thigh)"] = against_model(row)
        cells["strides to beat it"] = beat_text(row)
        rows[world] = cells
    return pd.DataFrame.from_dict(rows, orient="index")


def _with_interval(interval: Interval, form: str) -> str:
    """A mean with its interval: "0.0224 (0.0216 to 0.0237)"."""
    value, ends = number(interval.value, form), between(interval, form)
    return value if ends == "-" else f"{value} ({ends})"


def dynamics(parity: Parity) -> pd.DataFrame:
    """How far the equations of motion are apart."""
    rows = {
        "mass matrix M": (parity.mass_matrix, "|dM_ij| / sqrt(M_ii M_jj)"),
        "forces h = H v + G": (parity.bias, "|dh_i| / max |h_i|"),
        "Jacobian J of the feet": (parity.jacobian, "|dJ_ij| / max |J|"),
    }
    return pd.DataFrame.from_dict(
        {
            name: ["-" if value is None else f"{value:.2g}", scale]
            for name, (value, scale) in rows.items()
        },
        orient="index",
        columns=[f"largest on {parity.states} random states", "measured as"],
    )


def differing(differences: Sequence[Row]) -> pd.DataFrame:
    """Rows of a parity table by quantity, those that say the same of several joints as one."""
    quantities = list(dict.fromkeys(row.what for row in differences))
    rows = sorted(merged(differences), key=lambda row: quantities.index(row.what))
    cells = [
        {
            "where": row.where,
            "model": format_value(row.a),
            "simulated": format_value(row.b),
            "difference": number(row.difference, ".3g"),
        }
        for row in rows
    ]
    units = [f" [{row.unit}]" if row.unit else "" for row in rows]
    index = [row.what + unit for row, unit in zip(rows, units, strict=True)]
    return pd.DataFrame(cells, index=index)


def each_scenario(table: pd.DataFrame) -> pd.DataFrame:
    """The table of `sampled_scenarios` as texts."""
    shown = {}
    for attribute, (label, factor, form) in SHOWN_PARAMETERS.items():
        shown[label] = [
            " / ".join(number(factor * each, form) for each in np.atleast_1d(value))
            for value in table["scenario", attribute]
        ]
    for joint in SHOWN:
        for controller in in_order(table[joint].columns):
            label = f"{joint}: {LABELS.get(controller, controller)}"
            shown[label] = [number(1e3 * value, ".1f") for value in table[joint, controller]]
    if table["fallen"].to_numpy().any():
        for controller in table["fallen"].columns:
            label = f"fell: {LABELS.get(controller, controller)}"
            shown[label] = [f"{count:.0f}" for count in table["fallen", controller]]
    return pd.DataFrame(shown, index=table.index.rename(None))


def errors(table: Overview) -> pd.DataFrame:
    """Errors of the controllers in a world, with intervals."""
    rows = {}
    for name, row in table.items():
        cells: dict[str, str] = {}
        for joint in SHOWN:
            own = row.joints[joint]
            cells[f"{joint}: peak [rad]"] = _with_interval(own.peak, ".4f")
            cells[f"{joint}: less than PD"] = _with_interval(own.reduction, ".0%")
            cells[f"{joint}: wins against model"] = _with_interval(own.wins, ".0%")
        rows[LABELS.get(name, name)] = cells
    return pd.DataFrame.from_dict(rows, orient="index")


def motion(table: Overview, experiment: Experiment) -> pd.DataFrame:
    """What else is to be known of the controllers in a world, what they know among it."""
    rows = {}
    for name, row in table.items():
        known = experiment.controller(name).knows
        cells: dict[str, str] = {"knows": ", ".join(known) or "nothing"}
        for joint in SHOWN:
            cells[f"{joint}: felt peak [rad]"] = number(row.joints[joint].felt, ".4f")
            cells[f"{joint}: RMS [rad]"] = number(row.joints[joint].rms, ".4f")
        cells["better than model (calf/thigh)"] = against_model(row)
        cells["strides to beat it"] = beat_text(row)
        cells["strides to converge"] = number(row.settled, ".0f")
        cells["feedback's share"] = number(row.feedback, ".0%")
        cells["power [W]"] = number(row.power, ".0f")
        cells["cost of transport (robots at 0.1 m/s or more)"] = (
            f"{number(row.cost, '.2f')} ({row.moving})"
        )
        cells["speed error [m/s]"] = number(row.speed_error, ".3f")
        cells["apex error [mm]"] = number(1e3 * row.apex_error, ".1f")
        for metric, (value, unit) in row.own.items():
            cells[f"{metric} [{unit}]"] = number(value, ".4g")
        cells["upright"] = f"{row.upright} of {row.robots}"
        rows[LABELS.get(name, name)] = cells
    return pd.DataFrame.from_dict(rows, orient="index")


def table_1(table: pd.DataFrame) -> pd.DataFrame:
    """The table of `beside_the_paper`."""
    shown = table.copy().astype(object)
    for column in table.columns:
        form = ".0%" if column[2] == "reduction" else ".3f"
        shown[column] = [number(value, form) for value in table[column]]
    names = {"ours": "this run", "paper": "paper"}
    shown.columns = pd.MultiIndex.from_tuples(
        [
            (f"{joint}: peak in stance [rad]", names[source], name)
            for joint, source, name in shown.columns
        ]
    )
    shown.index = pd.Index([s if isinstance(s, str) else f"{s:g}" for s in table.index])
    shown.index.name = "speed [m/s]"
    return shown


def provenance(run: dict[str, Any]) -> dict[str, str]:
    """What a result was made with: a run of `Results.provenance`.

    When, how fast and by how many workers is not in it: the report is the same each time.
    """
    return {
        "versions": ", ".join(f"{name} {version}" for name, version in run["versions"].items()),
        "source": run["git"] or "not under version control",
        "Python": run["python"],
        "system": run["platform"],
        "CPU": f"{run['cpu']} ({run['cores']} cores)",
    }
