"""The report of a small result over two worlds."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest

from pronk_pin import Robot, cli
from pronk_pin.cli.comparison import command_line
from pronk_pin.compare import Experiment, Results, Schedule, random_scenarios, run_experiment
from pronk_pin.compare.experiment.suites import SUITES, load_suite
from pronk_pin.compare.metrics import control_arm, family
from pronk_pin.compare.report.limitations import limitations
from pronk_pin.compare.results.manifest import Manifest
from pronk_pin.errors import FileProblem
from pronk_pin.robot.formats.urdf import mujoco_spec
from pronk_pin.viz.report import write_figures, write_report
from pronk_pin.viz.report.document import Document

EXPERIMENT = Experiment(
    speeds=(0.0, 0.4),
    controllers=("pd", "ilc", "model", "ilc-zero"),
    scenarios=("nominal", "payload"),
    schedule=Schedule(startup=0.2, baseline=6.0, learning=4.0),
)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("report") / "result"
    results = run_experiment(EXPERIMENT, folder, workers=1, progress=False)
    write_report(results, command=command_line(EXPERIMENT))
    return results


def test_the_report_answers_first_and_says_where_its_numbers_are_from(result: Results) -> None:
    text = (result.folder / "report.html").read_text()
    assert text.index("Does practice beat the model? In 2 scenarios") < text.index("<nav>")
    for anchor in ("scenarios", "nominal", "payload", "statistics", "limits", "provenance"):
        assert f'id="{anchor}"' in text
        assert f'href="#{anchor}"' in text
    for known in ("mujoco 4", "t-intervals", "figure-heat-map", "figure-learning-calf"):
        assert known in text
    assert "nan" not in re.sub(r"data:image[^\"]*|provenance", "", text)


def test_the_report_leads_to_what_is_in_its_folder(result: Results, tmp_path: Path) -> None:
    """To the replay only where there is one, and from each scenario to its own robots."""
    assert "replay.html" not in (result.folder / "report.html").read_text()
    copy = Results(shutil.copytree(result.folder, tmp_path / "copy"), result.experiment)
    (copy.folder / "replay.html").write_text("a replay")
    write_report(copy)
    text = (copy.folder / "report.html").read_text()
    addresses = set(re.findall(r'href="([^"#]+)(?:#[^"]*)?"', text))
    assert addresses == {"replay.html", "summary.csv", "strides/", "figures/"}
    for address in addresses:
        assert (copy.folder / address).exists()
    for scenario in EXPERIMENT.scenario_names:
        assert f'href="replay.html#scenario={scenario}"' in text
    assert re.search(r'<a href="replay.html#[^"]+"><img', text)


def test_the_control_arm_learns_no_torque_and_shows_what_its_timing_does(result: Results) -> None:
    """All the machinery with gain 0: before the learning it is PD to the bit, then PD timed."""
    strides = {
        name: result.strides(result.find(controller=name, scenario="nominal"))
        for name in ("pd", "ilc-zero")
    }
    zero = strides["ilc-zero"]
    assert float(abs(zero["feedforward"]).max()) == 0.0
    before = int((zero["learning"] == 0).sum("stride").min())
    for name in ("peak_error", "felt_peak_error", "mean_speed"):
        early = [one[name].isel(stride=slice(before)).to_numpy() for one in strides.values()]
        np.testing.assert_array_equal(*early)
    summary = result.summary()
    beaten = summary[summary["controller"] == "ilc-zero"]
    beaten = beaten[beaten["metric"] == "strides_to_beat_model"]
    assert len(beaten)
    assert beaten["value"].isna().all()
    assert control_arm(summary) < 0.02
    assert "The control arm, which learns with gain 0" in (result.folder / "report.md").read_text()


def test_markdown_shows_figures_that_are_there(result: Results) -> None:
    text = (result.folder / "report.md").read_text()
    pictures = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(pictures) >= 8
    for picture in pictures:
        assert (result.folder / picture).stat().st_size > 1000, picture


def test_the_report_is_the_same_whenever_and_by_however_many_workers_it_is_made(
    result: Results, tmp_path: Path
) -> None:
    """Another process, with other hashes, at another time; the run was interrupted meanwhile."""
    folder = shutil.copytree(result.folder, tmp_path / "copy")
    copy = Results(folder, result.experiment)
    (run,) = copy.provenance["runs"]
    other = {**run, "started": "2001-02-03T04:05:06+00:00", "executor": "7 others"}
    other |= {"wall_time_s": 12345.6, "summary_s": 78.9}
    copy.write_provenance({"finished": True, "runs": [{**other, "cells": {}}, other]})
    for path in [folder / "report.html", folder / "report.md", *folder.glob("figures/*")]:
        path.unlink()
    program = (
        "import sys; from pronk_pin.compare import Results; "
        "from pronk_pin.cli.comparison import command_line; "
        "from pronk_pin.viz.report import write_report; results = Results.load(sys.argv[1]); "
        "write_report(results, command=command_line(results.experiment))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7", "TZ": "Pacific/Auckland"}
    subprocess.run([sys.executable, "-c", program, folder], env=environment, check=True)
    made = [path.relative_to(result.folder) for path in result.folder.glob("figures/*.svg")]
    assert len(made) >= 8
    for name in ("report.html", "report.md", *made):
        assert (folder / name).read_bytes() == (result.folder / name).read_bytes(), name


def test_the_report_tells_no_time(result: Results) -> None:
    (run,) = result.provenance["runs"]
    texts = [(result.folder / name).read_text() for name in ("report.html", "report.md")]
    texts += [path.read_text() for path in result.folder.glob("figures/*.svg")]
    for text in texts:
        for told in (run["started"], run["started"][:10], "wall time", "dc:date"):
            assert told not in text
    for kept in (run["versions"]["mujoco"], run["cpu"]):
        assert kept in texts[0]


def test_the_command_makes_the_same_experiment_again(
    result: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[Experiment] = []
    monkeypatch.setattr(cli.Compare, "run", lambda self: found.append(self.experiment))
    others = (replace(result.experiment, base=base) for base in ("sagittal", "free"))
    for experiment in (result.experiment, *others, *map(load_suite, SUITES)):
        words = shlex.split(command_line(experiment))
        assert words[0] == "pronk-pin"
        assert cli.main(words[1:]) == 0
        assert found.pop() == experiment


def test_limitations_are_those_of_this_run(result: Results, tmp_path: Path) -> None:
    text = "\n".join(limitations(result))
    assert "One seed: fewer than 8 are no sample" in text
    assert "trunk is locked" in text
    assert "robots fell" not in text
    copy = Results(shutil.copytree(result.folder, tmp_path / "copy"), result.experiment)
    path = copy.folder / "summary.csv"
    table = pd.read_csv(path)
    pd_upright = (table["metric"] == "upright") & (table["controller"] == "pd")
    table.loc[pd_upright & (table["scenario"] == "payload"), "value"] = 0.0
    text = table.to_csv(index=False)
    Manifest(copy.folder).write(path.name, text, made_of=copy.strides_digest)
    assert "In payload under pd 2 robots fell (0, 0.4 m/s)" in "\n".join(limitations(copy))
    free = replace(result.experiment, base="free", controllers=("pd", "ilc"))
    text = "\n".join(limitations(replace(result, experiment=free)))
    assert "Under pd and ilc the robots know the true attitude" in text
    assert "trunk is locked" not in text


def test_a_report_that_cannot_be_written_is_reported(
    result: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pronk_pin.viz.report.report.report", lambda *_, **__: Document("short"))
    copy = Results(shutil.copytree(result.folder, tmp_path / "copy"), result.experiment)
    shutil.rmtree(copy.folder / "figures")
    (copy.folder / "figures").write_text("in the way")
    with pytest.raises(FileProblem, match="figures: cannot be written"):
        write_report(copy)


def test_an_unknown_suite_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["compare", "--suite", "everything"]) == 1
    assert (
        "unknown suite 'everything'; choose one of: default, knowledge" in capsys.readouterr().err
    )


def test_the_report_holds_the_parity_table_of_another_robots_mjcf(
    robot: Robot, tmp_path: Path
) -> None:
    """A trunk that is a kilogram heavier, and position servos."""
    spec = mujoco_spec(robot)
    trunk = spec.body(robot.spec.base_link)
    before, trunk.mass = trunk.mass, trunk.mass + 1.0
    for name in robot.urdf_joint_names:
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=100.0)
    spec.compile()
    path = tmp_path / "my robot.xml"
    path.write_text(spec.to_xml())
    small = replace(EXPERIMENT, controllers=("pd", "ilc"), scenarios=("ideal",), mjcf=str(path))
    small = replace(small, schedule=Schedule(startup=0.2, baseline=2.0, learning=2.0))
    results = run_experiment(small, tmp_path / "result", workers=1, progress=False)
    path.unlink()  # what the report needs is in the folder
    write_report(Results.load(results.folder))
    text = (results.folder / "report.md").read_text()
    assert f"| total mass [kg] | {robot.mass:.4f} | {robot.mass + 1.0:.4f} |" in text
    assert f"| mass [kg] | trunk | {before:.7g} | {before + 1.0:.7g} | 1 |" in text
    assert "| mass matrix M | 0." in text
    assert "Its actuators (position servo, kp 100, kv 0) are played as torque motors." in text
    page = (results.folder / "report.html").read_text()
    for known in ('id="parity"', "my robot.xml", f"<td>{robot.mass + 1.0:.4f}</td>", "kp 100"):
        assert known in page
    assert f"--mjcf {shlex.quote(str(path))}" in command_line(results.experiment)


def test_a_command_of_many_lines_can_be_pasted(result: Results) -> None:
    text = (result.folder / "report.html").read_text()
    block = re.search(r"<pre>(pronk-pin compare.*?)</pre>", text, re.DOTALL)
    assert block is not None
    assert "\n" in block[1]
    assert shlex.split(block[1].replace("\\\n", " ")) == shlex.split(
        command_line(result.experiment)
    )


def test_sampled_worlds_are_one_family_and_each_has_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = tuple(world.name for world in random_scenarios(8, seed=2))
    experiment = replace(
        EXPERIMENT,
        speeds=(0.2,),
        controllers=("pd", "ilc", "model"),
        scenarios=names,
        schedule=Schedule(startup=0.1, baseline=0.9, learning=1.3),
    )
    results = run_experiment(experiment, tmp_path / "result", workers=1, progress=False)
    write_report(results)
    text = (results.folder / "report.md").read_text()
    assert "> In 8 sampled scenarios, at 1 speed in each, learning cuts the mean peak error" in text
    assert 'Controllers in the 8 sampled scenarios "random-2"' in text
    assert "Intervals are drawn over the scenarios." in text
    assert "of the 6 mean errors here" in text
    for name in names:
        assert re.search(rf"^\| {name} \| \d", text, re.MULTILINE)
    for figure in ("random-2-by-world", "learning-calf", "learning-thigh"):
        assert (results.folder / "figures" / f"{figure}.svg").stat().st_size > 1000
    assert not re.search(r"\bnan\b", text)
    monkeypatch.setattr("pronk_pin.viz.report.report.save_figure", lambda _, path: path)
    written = {path.name for path in write_figures(results, tmp_path / "figures")}
    assert "random-2-by-world.pdf" in written


def test_the_suite_of_sampled_worlds_is_a_sample() -> None:
    experiment = load_suite("sampled")
    assert len(experiment.scenarios) == 20
    assert {"pd", "ilc", "model"} <= set(experiment.controllers)
    assert {family(name) for name in experiment.scenarios} == {"random-0"}
