"""Table I of the paper: peak stance errors with PD and with ILC."""

from __future__ import annotations

from importlib import resources

import pandas as pd

from ...storage import REINSTALL, read_csv, reading

PAPERS_ROBOT = "a1"
"""Robot of the paper: nothing of another one stands beside its table."""


def of_papers_robot(summary: pd.DataFrame) -> bool:
    """Whether a summary is of the paper's robot."""
    return bool((summary["robot"] == PAPERS_ROBOT).all())


def table_1() -> pd.DataFrame:
    """Peak errors [rad] as printed: columns `speed`, `joint`, `controller`, `value`."""
    source = resources.files(__package__) / "data" / "paper_table1.csv"
    with resources.as_file(source) as path:
        heading, *rows = read_csv(path, REINSTALL)
        with reading(path, REINSTALL):
            wide = pd.DataFrame(rows, columns=heading).astype(float)
    parts = [
        pd.DataFrame(
            {
                "speed": wide["speed_m_s"],
                "joint": joint,
                "controller": controller,
                "value": wide[f"{joint}_{controller}_rad"],
            }
        )
        for joint in ("calf", "thigh")
        for controller in ("pd", "ilc")
    ]
    return pd.concat(parts, ignore_index=True)
