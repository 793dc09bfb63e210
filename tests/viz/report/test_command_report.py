"""Report, replay and refusals of a result of commanded speeds."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pronk_pin import cli
from pronk_pin.cli.comparison import command_line
from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.report import format_summary
from pronk_pin.control import SpeedProfile
from pronk_pin.errors import InvalidInput
from pronk_pin.viz.figures.driving_figure import transitions
from pronk_pin.viz.report import write_figures, write_report
from pronk_pin.viz.scenes import result_menu

RAMP, STEP = "0.1 2s, 0.1->0.3 1s, 0.3 2s", "0.2 2s, 0.1 1s"


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Results:
    experiment = Experiment(
        controllers=("pd", "library"), commands=(RAMP, STEP), schedule=Schedule(0.5, 1.0, 3.0)
    )
    folder = tmp_path_factory.mktemp("driven") / "result"
    return run_experiment(experiment, folder, workers=1, progress=False)


def test_the_report_has_a_table_for_each_command_and_the_figure(result: Results) -> None:
    page = write_report(result, command=command_line(result.experiment)).read_text()
    assert "Does practice hold while the speed changes? A1" in page
    assert page.count("calf: worst") == 2
    assert 'id="figure-driving"' in page
    text = (result.folder / "report.md").read_text()
    assert "Driven by 2 commands in scenario nominal" in text
    assert "was learned at 0.1, 0.2, 0.3 m/s" in text
    worst = result.summary().query("metric == 'worst_peak_error' and joint == 'calf'")
    for value in worst["value"]:
        assert f"{value:.4f}" in text
        assert f"{1e3 * value:.1f}, " in format_summary(result.summary())


def test_the_command_line_of_the_report_makes_the_same_experiment(result: Results) -> None:
    words = shlex.split(command_line(result.experiment))[1:]
    asked: Any = cli._parsed(words)
    assert asked.experiment == result.experiment


def test_the_figures_are_written(result: Results, tmp_path: Path) -> None:
    paths = write_figures(result, tmp_path)
    assert [path.name for path in paths] == ["driving.svg", "driving.pdf"]


def test_a_replay_shows_the_whole_command_and_where_the_trunk_is(result: Results) -> None:
    menu = result_menu(result, command=STEP, controller="pd")
    scene = menu.scene()
    assert "by command 0.2 2s, 0.1 1s" in scene.title
    measured, planned = scene.tracks[0], scene.tracks[1]
    assert measured.t[-1] == pytest.approx(3.0, abs=0.6)
    way = measured.q[-1, 0] - measured.q[0, 0]
    assert way == pytest.approx(2.0 * 0.2 + 1.0 * 0.1, abs=0.15)
    # The reference is put down where the robot is at each touchdown, and goes as fast.
    between = np.abs(planned.q[:, 0] - np.interp(planned.t, measured.t, measured.q[:, 0]))
    assert between.max() < 0.06
    with pytest.raises(InvalidInput, match="is of commands; name a command"):
        result_menu(result, speed=0.2)
    with pytest.raises(InvalidInput, match="there is no command 0 1s"):
        result_menu(result, command="0 1s")


def test_a_command_changes_from_when_to_when() -> None:
    profile = SpeedProfile.parse("0 2s, 0->0.4 1s, 0.4->0.2 1s, 0.2 2s, 0.5 1s")
    assert list(transitions(profile)) == [(2.0, 4.0), (6.0, 6.0)]
    assert not list(transitions(SpeedProfile.parse("0.3 2s")))


@pytest.mark.parametrize("words", ["explain {}", "report {} {}", "ilc analyze ilc --result {}"])
def test_what_needs_constant_speeds_says_so(
    result: Results, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words.replace("{}", str(result.folder)).split()) == 1
    said = re.sub(r"\s+", " ", capsys.readouterr().err)
    assert "is of commanded ones; choose a result without --command" in said
