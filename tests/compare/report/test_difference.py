"""What changed between two results, and what is only noise."""

from __future__ import annotations

import dataclasses
import functools
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from pronk_pin.compare import Results
from pronk_pin.compare.metrics import COLUMNS
from pronk_pin.compare.report.difference import LEVEL, changes, format_changes
from pronk_pin.compare.results.manifest import Manifest
from pronk_pin.errors import InvalidInput


def summary(
    calf: np.ndarray, *, seed: int = 0, controller: str = "ilc", down: int = 0
) -> pd.DataFrame:
    """Fourteen robots by their calf's peak; the thigh's is the same."""
    rows: list[dict[str, object]] = []
    for k, value in enumerate(calf):
        key: dict[str, object] = {"robot": "a1", "base": "locked", "scenario": "nominal"}
        key |= {"speed": 0.1 * k, "controller": controller, "seed": seed, "unit": "1"}
        for joint in ("calf", "thigh"):
            rows.append({**key, "joint": joint, "metric": "peak_error", "value": value})
        rows.append({**key, "joint": "-", "metric": "upright", "value": float(k >= down)})
    return pd.DataFrame(rows)[COLUMNS]


@pytest.fixture
def before() -> np.ndarray:
    return np.random.default_rng(0).uniform(0.02, 0.04, 14)


def test_a_small_change_of_every_robot_is_beyond_noise(before: np.ndarray) -> None:
    table = changes(summary(before), summary(before + 0.001))
    assert set(table["change"]) == {"worse"}
    assert table["difference"].tolist() == pytest.approx([0.001, 0.001])
    assert table["p"].max() < 0.001
    assert set(changes(summary(before), summary(0.9 * before))["change"]) == {"better"}


def test_scatter_is_no_change_and_the_same_is_no_change_at_all(before: np.ndarray) -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.005, 14)
    assert set(changes(summary(before), summary(before + noise))["change"]) == {""}
    same = changes(summary(before), summary(before))
    assert set(same["change"]) == {""}
    assert same["p"].isna().all()


def test_of_many_comparisons_without_a_change_hardly_any_is_named() -> None:
    """Twelve controllers, eight times: of each run one in twenty may be a false alarm, and not, as
    twelve tests at 5 % would have it, one in two."""
    rng, named, unadjusted = np.random.default_rng(0), 0, 0
    for _ in range(8):
        one, other = (
            pd.concat([summary(rng.normal(0.03, 0.003, 9), controller=f"c{k}") for k in range(12)])
            for _ in range(2)
        )
        named += int((changes(one, other)["change"] != "").any())
        first, second = (
            side[side["joint"] == "calf"]["value"].to_numpy().reshape(12, 9)
            for side in (one, other)
        )
        pairs = second - first
        unadjusted += int((stats.ttest_1samp(pairs, 0.0, axis=1).pvalue < LEVEL).any())
    assert named <= 1
    assert unadjusted >= 4  # so that there is something to adjust for


def test_p_values_are_those_of_benjamini_and_hochberg() -> None:
    """`p_(i) m / i`, and never less than that of a larger one; by hand, from each alone."""
    rng = np.random.default_rng(5)
    before, parts = rng.uniform(0.02, 0.04, 9), {}
    for k, shift in enumerate((0.0, 0.001, 0.002, 0.006)):
        parts[f"c{k}"] = before + shift + rng.normal(0.0, 0.002, 9)
    tables = [
        pd.concat([summary(values, controller=name) for name, values in side.items()])
        for side in (dict.fromkeys(parts, before), parts)
    ]
    alone = {
        name: changes(summary(before, controller=name), summary(values, controller=name))["p"].max()
        for name, values in parts.items()
    }  # of two rows that are the same, the adjustment changes nothing
    rows = np.repeat(sorted(alone.values()), 2)  # calf and thigh
    adjusted = rows * len(rows) / np.arange(1, len(rows) + 1)
    adjusted = np.minimum.accumulate(adjusted[::-1])[::-1]
    found = changes(*tables)["p"].sort_values().to_numpy()
    np.testing.assert_allclose(found, np.minimum(adjusted, 1.0))
    assert found[-1] > LEVEL > found[0]
    assert not np.allclose(found, rows)


def test_other_seeds_are_compared_speed_by_speed(before: np.ndarray) -> None:
    table = changes(summary(before, seed=0), summary(before + 0.001, seed=7))
    assert table["robots"].tolist() == [14, 14]
    assert set(table["change"]) == {"worse"}


def test_a_fall_is_a_change_whatever_the_errors_do(before: np.ndarray) -> None:
    table = changes(summary(before), summary(before, down=1))
    assert set(table["change"]) == {"worse"}
    assert table["fallen_after"].tolist() == [1, 1]


def test_results_without_anything_in_common_are_refused(before: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match="no scenario and controller in common"):
        changes(summary(before), summary(before, controller="pd"))


def test_two_results_are_told_apart_in_words(comparison: Results, tmp_path: Path) -> None:
    folder = shutil.copytree(comparison.folder, tmp_path / "other")
    other = Results(folder, dataclasses.replace(comparison.experiment, seeds=(0, 1)))
    known = other.provenance
    known["runs"][-1]["git"] = "another commit"
    other.write_provenance(known)
    path = folder / "summary.csv"
    write = functools.partial(Manifest(folder).write, path.name, made_of=other.strides_digest)
    write(path.read_bytes())
    text = format_changes(comparison, other)
    assert "seeds: 0 -> 0 1" in text
    assert "-> another commit" in text
    assert "0 of 6 means changed beyond noise" in text
    assert "6 are the same to the bit." in text
    table = pd.read_csv(path)
    worse = (table["controller"] == "pd") & (table["metric"] == "upright")
    table.loc[worse, "value"] = 0.0
    write(table.to_csv(index=False))
    assert "worse (+2 fell)" in format_changes(comparison, other)
