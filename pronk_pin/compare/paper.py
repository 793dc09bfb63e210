"""Table I of the paper: peak stance errors with PD and with ILC."""

from __future__ import annotations

from importlib import resources

import pandas as pd


def table_1() -> pd.DataFrame:
    """Peak errors [rad] as printed: columns `speed`, `joint`, `controller`, `value`."""
    source = resources.files(__package__) / "data" / "paper_table1.csv"
    with source.open() as file:
        wide = pd.read_csv(file)
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
