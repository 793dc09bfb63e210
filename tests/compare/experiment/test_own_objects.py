"""Objects of a user's own, by object, address or file: run, stored, and read again without them."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pronk_pin import cli, load_robot
from pronk_pin.cli.comparison import command_line
from pronk_pin.compare import (
    Experiment,
    Metric,
    Results,
    Scenario,
    Schedule,
    build_model,
    load_scenario,
    random_scenarios,
    run_cell,
    run_experiment,
    summarize,
)
from pronk_pin.compare.experiment import define, read_config
from pronk_pin.compare.experiment.description import Unloaded, describe, restore
from pronk_pin.compare.metrics import METRICS
from pronk_pin.control import CONTROLLERS, ControllerSpec, PDTypeILC, load_controller
from pronk_pin.errors import FileProblem, InvalidInput, UnknownName
from pronk_pin.gait import GaitLibrary, load_library
from pronk_pin.robot import ROBOTS, RobotSpec

LABORATORY = """
from dataclasses import dataclass

from pronk_pin.compare import Metric, Scenario
from pronk_pin.control import ControllerSpec


@dataclass(frozen=True)
class MyLaw:
    gain: float = 0.3

    def update(self, record):
        return record.feedforward + self.gain * record.feedback


class Untold:
    def update(self, record):
        return record.feedforward


def hardest(strides):
    return strides["tick_force"].sel(direction="z").max(("last", "part", "tick", "foot"))


hardest_landing = Metric("hardest_landing", "N", hardest)
controller = ControllerSpec("mine", law=MyLaw(0.3), knows=("friction", "load"))
untold = ControllerSpec("untold", law=Untold())
hot = Scenario("hot", torque_constant=0.9, coulomb=0.4)
number = 3


def heavier_rotors(spec):
    for joint in spec.joints:
        if "calf" in joint.name:
            joint.armature += 0.01


def broken(spec):
    spec.worldbody.add_geom(size=[-1, 0, 0])


heavy = Scenario("heavy", edit=heavier_rotors)
"""

SHORT = Schedule(startup=0.2, baseline=1.0, learning=1.5)


@pytest.fixture
def laboratory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of a module of one's own, in the folder that the program was started in."""
    name = "laboratory_" + tmp_path.name.replace("-", "_")
    (tmp_path / f"{name}.py").write_text(LABORATORY)
    monkeypatch.chdir(tmp_path)
    return name


def own(laboratory: str, **changes: object) -> Experiment:
    settings = {
        "speeds": (0.3,),
        "controllers": ("pd", f"{laboratory}:controller"),
        "scenarios": ("nominal", f"{laboratory}:hot+slope=0.05"),
        "schedule": SHORT,
        **changes,
    }
    return Experiment(**settings)  # type: ignore[arg-type]


def test_objects_names_and_addresses_are_one(laboratory: str) -> None:
    by_address = own(laboratory)
    spec, hot = load_controller(f"{laboratory}:controller"), load_scenario(f"{laboratory}:hot")
    by_object = own(laboratory, controllers=("pd", spec), scenarios=("nominal", hot + "slope=0.05"))
    assert by_address == by_object
    assert by_object.controller_names == ("pd", "mine")
    assert by_object.scenario_names == ("nominal", "hot+slope=0.05")
    shipped = Experiment(controllers=(CONTROLLERS["pd"],), scenarios=(load_scenario("payload"),))
    assert (shipped.controllers, shipped.scenarios) == (("pd",), ("payload",))


def test_what_is_stored_is_read_by_a_process_that_never_saw_the_class(
    laboratory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor the function that edits a scenario; both reach the workers that simulate them."""
    worlds = ("nominal", f"{laboratory}:hot+slope=0.05", f"{laboratory}:heavy")
    experiment = own(laboratory, scenarios=worlds)
    results = run_experiment(experiment, "result", workers=2, progress=False)
    assert set(results.summary()["controller"]) == {"pd", "mine"}
    folder = str(results.folder.resolve())
    more = ["compare", "--folder", folder, "--seeds", "0", "1", "--workers", "1"]
    # Elsewhere nobody can import the law: what does not need it works all the same.
    whole, compared, extended = _elsewhere(
        ["compare", "--folder", folder], ["report", folder, folder], more
    )
    assert whole.code == 0, whole.error
    assert compared.code == 0, compared.error
    assert "| friction, load |" in (results.folder / "report.md").read_text()
    assert extended.code == 1
    assert f"module {laboratory} cannot be imported" in extended.error
    # Where it can be imported, the same command goes on; its pages were looked at above.
    monkeypatch.setattr("pronk_pin.cli.comparison._print_pages", lambda *_: None)
    assert cli.main(more) == 0
    assert {cell.seed for cell in Results.load(folder).experiment.cells()} == {0, 1}


class Ended(NamedTuple):
    """How a command ended, and what it said on stderr."""

    code: int
    error: str


ELSEWHERE = """
import contextlib, io, json, sys
from pronk_pin.cli import main
ended = []
for words in json.loads(sys.argv[1]):
    error = io.StringIO()
    with contextlib.redirect_stderr(error), contextlib.redirect_stdout(io.StringIO()):
        code = main(words)
    ended.append((code, error.getvalue()))
print(json.dumps(ended))
"""


def _elsewhere(*commands: list[str]) -> list[Ended]:
    """How commands end in one process that was started where nobody has our modules."""
    done = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, json.dumps(commands)],
        cwd="/",
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    return [Ended(*each) for each in json.loads(done.stdout)]


def test_a_stored_law_that_has_changed_or_cannot_be_made_is_refused(laboratory: str) -> None:
    results = run_experiment(own(laboratory), "result", workers=1, progress=False)
    stored = Results.load(results.folder).experiment
    law = stored.controller("mine").law
    assert isinstance(law, Unloaded)
    assert describe(law) == describe(load_controller(f"{laboratory}:controller").law)
    changed = replace(law, description={**law.description, "source_sha256": "0" * 64})
    with pytest.raises(InvalidInput, match="has changed since; put the old one back"):
        changed.load()
    lost = replace(law, description={**law.description, "class": "nowhere_at_all:MyLaw"})
    with pytest.raises(InvalidInput, match="nowhere_at_all:MyLaw: module nowhere_at_all cannot be"):
        lost.load()
    of_a_script = replace(law, description={**law.description, "class": "__main__:MyLaw"})
    with pytest.raises(InvalidInput, match="a class of the script that made this result; run"):
        of_a_script.load()
    untold = own(laboratory, controllers=("pd", f"{laboratory}:untold"))
    document = describe(untold.controller("untold"))
    with pytest.raises(InvalidInput, match=r"no dataclass.*pass the experiment with the object"):
        restore(document, ControllerSpec, "it").law.load()  # type: ignore[union-attr]
    # The experiment with the object itself goes on with the folder.
    more = own(laboratory, seeds=(0, 1))
    assert run_experiment(more, results.folder, workers=1, progress=False).experiment.seeds == (
        0,
        1,
    )
    other = own(laboratory, controllers=("pd", ControllerSpec("mine", law=PDTypeILC())))
    with pytest.raises(FileProblem, match="'mine' of the controllers is another one there"):
        run_experiment(other, results.folder, workers=1, progress=False)


def test_everything_shipped_comes_back_from_its_description() -> None:
    for spec in CONTROLLERS.values():
        text = json.dumps(describe(spec))
        assert restore(json.loads(text), ControllerSpec, spec.name) == spec
    for scenario in (load_scenario("noise+payload"), load_scenario("random-0-3")):
        assert restore(json.loads(json.dumps(describe(scenario))), Scenario, "it") == scenario
    for robot in ROBOTS.values():
        assert restore(json.loads(json.dumps(describe(robot))), RobotSpec, "it") == robot


def test_an_experiment_is_written_by_hand(laboratory: str) -> None:
    Path("mine.yaml").write_text(
        f"""
speeds: [0.0, 0.3]
controllers:
  - pd
  - {laboratory}:controller
  - {{name: strong, law: {{class: "{laboratory}:MyLaw", gain: 0.6}}}}
  - {{name: gentle, law: {{class: PDTypeILC, gain: 0.2}}, timing: {{}}}}
scenarios: [nominal, {{name: moon, gravity: 1.62}}]
schedule: {{baseline: 2.0, learning: 3.0}}
"""
    )
    read = read_config("mine.yaml")
    strong = read.controller("strong").law
    assert strong == type(read.controller("mine").law)(0.6)  # type: ignore[call-arg,misc]
    assert "source_sha256" in describe(strong)
    assert read.controller("gentle").law == PDTypeILC(gain=0.2)
    assert read.controller("gentle").timing is not None
    assert read.scenario("moon") == Scenario("moon", gravity=1.62)
    assert (read.schedule.learning, read.robot, read.seeds) == (3.0, "a1", (0,))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("controllers: [{name: x, law: {class: Nothing}}]", "no class 'Nothing'"),
        ("controllers: [{name: x, strength: 2}]", "no field 'strength'"),
        ("controllers: [{source: model}]", "name"),
        ("scenarios: [{name: x, gravity: heavy}]", "gravity"),
        ("controllers: 3", "Expected `array"),
        ("controller: [pd]", "unknown field controller"),
        ("speeds: [a]", "Expected `float"),
        ("[1, 2]", "Expected `object`"),
        ("a: b: c", "damaged"),
        ("robot: {name: x}", "urdf"),
        ("controllers: [{name: pd, source: model}]", "give yours another name"),
        ("controllers: [{name: ../x}]", "name of a file"),
    ],
)
def test_a_wrong_config_says_what_is_wrong(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(FileProblem, match=words):
        read_config(path)


def test_what_is_named_in_vain_says_so(laboratory: str) -> None:
    for address, words in (
        ("nowhere.at_all:thing", "cannot be imported"),
        (f"{laboratory}:nothing", "has no nothing"),
        (f"{laboratory}:number", "is a int"),
    ):
        with pytest.raises(InvalidInput, match=words):
            Experiment(controllers=("pd", address))
    with pytest.raises(UnknownName):
        Experiment(controllers=("mine",))
    with pytest.raises(InvalidInput, match="give a ControllerSpec, or a name"):
        Experiment(controllers=(3,))  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="not the one that is shipped under that name"):
        Experiment(controllers=(ControllerSpec("ilc"),))
    with pytest.raises(InvalidInput, match="none of them twice"):
        own(laboratory, controllers=(f"{laboratory}:controller", ControllerSpec("mine")))


def test_a_metric_of_ones_own_is_in_summary_tables_and_comparisons(
    laboratory: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plain = own(laboratory, controllers=("pd", "ilc"), scenarios=("nominal",))
    with_metric = replace(plain, metrics=(f"{laboratory}:hardest_landing",))
    folder = Path("result")
    results = run_experiment(plain, folder, workers=1, progress=False)
    before = {path.name: path.stat().st_mtime_ns for path in folder.glob("strides/*.nc")}
    results = run_experiment(with_metric, folder, workers=1, progress=False)
    assert before == {path.name: path.stat().st_mtime_ns for path in folder.glob("strides/*.nc")}
    rows = results.summary().query("metric == 'hardest_landing'")
    assert set(rows["unit"]) == {"N"}
    for row in rows.itertuples():
        strides = results.strides(results.find(controller=str(row.controller)))
        force = strides["tick_force"].sel(direction="z").to_numpy()
        assert row.value == pytest.approx(np.nanmax(force))
    assert command_line(results.experiment) == "pronk-pin compare --config config.json"
    assert cli.main(["report", str(folder)]) == 0
    assert "hardest_landing [N]: " in capsys.readouterr().out
    assert "hardest_landing [N]" in (folder / "report.html").read_text()
    assert cli.main(["report", str(folder), str(folder)]) == 0
    assert "hardest_landing" in capsys.readouterr().out
    without = shutil.copytree(folder, folder.resolve().with_name("without"))
    (without / "summary.csv").unlink()
    # Where nobody has the function.
    whole, lacking = _elsewhere(["report", str(folder.resolve())], ["report", str(without)])
    assert whole.code == 0, whole.error
    assert f"module {laboratory} cannot be imported" in lacking.error


@pytest.mark.parametrize(
    ("compute", "words"),
    [
        (lambda strides: [1.0, 2.0, 3.0], r"of shape \(3,\); let it answer one for each of the 1"),
        (lambda strides: "much", "answers no numbers"),
    ],
)
def test_what_a_metric_answers_is_checked(compute: object, words: str) -> None:
    metric = Metric("mine", "1", compute)  # type: ignore[arg-type]
    experiment = Experiment(speeds=(0.3,), controllers=("pd",), schedule=SHORT, metrics=(metric,))
    with pytest.raises(InvalidInput, match=words):
        summarize(run_cell(experiment.cells()[0]), experiment.own_metrics)


def test_metrics_have_names_of_their_own() -> None:
    with pytest.raises(InvalidInput, match="is one of ours"):
        Metric("peak_error", "rad", np.mean)
    with pytest.raises(InvalidInput, match="cannot be called"):
        Metric("mine", "rad", 3)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="none of them twice"):
        Experiment(metrics=(Metric("mine", "1", np.mean), Metric("mine", "1", np.max)))


def test_a_scenario_may_edit_the_world(laboratory: str, tmp_path: Path) -> None:
    heavy = load_scenario(f"{laboratory}:heavy")
    assert heavy.edit == f"{laboratory}:heavier_rotors"
    robot = load_robot("a1")
    plain, edited = (build_model(robot, each) for each in (load_scenario("ideal"), heavy))
    calf = plain.joint("FL_calf_joint").dofadr[0]
    assert (plain.dof_armature[calf], edited.dof_armature[calf]) == (0.0, 0.01)
    experiment = own(laboratory, controllers=("pd",), scenarios=("ideal", heavy, heavy + "slope"))
    results = run_experiment(experiment, "heavier_rotors", workers=1, progress=False)
    assert len(results.summary().query("metric == 'peak_error'")["value"].unique()) == 9
    assert Results.load(results.folder).experiment.scenario("heavy") == heavy
    changed = replace(heavy, edit_sha256="0" * 64)
    with pytest.raises(InvalidInput, match="has changed since; put the old one back"):
        build_model(robot, changed)
    with pytest.raises(InvalidInput, match=r"scenario 'x': .*broken ends in ValueError"):
        build_model(robot, Scenario("x", edit=f"{laboratory}:broken"))
    with pytest.raises(InvalidInput, match="no function that can be found by name"):
        Scenario("x", edit=lambda spec: None)  # type: ignore[arg-type]


def test_our_metrics_are_listed_with_their_units(laboratory: str) -> None:
    experiment = own(laboratory, controllers=("pd", "ilc", "model"), scenarios=("nominal",))
    summary = run_experiment(experiment, "all", workers=1, progress=False).summary()
    for metric, unit in set(zip(summary["metric"], summary["unit"], strict=True)):
        assert METRICS[metric][0] == unit


LEGS = Scenario("legs", torque_constant=(1.0, 0.9, 0.8), coulomb=np.full(12, 0.3))  # type: ignore[arg-type]


def test_values_by_joint_are_kept_as_they_were_given(tmp_path: Path) -> None:
    """In config.json, by hand, and in the record of strides: numbers stay numbers."""
    assert LEGS.coulomb == (0.3,) * 12
    described = json.loads(json.dumps(describe(LEGS)))
    assert (described["armature"], described["torque_constant"]) == (0.0, [1.0, 0.9, 0.8])
    assert restore(described, Scenario, "it") == LEGS
    assert Scenario.from_json(LEGS.to_json()) == LEGS
    assert isinstance(describe(load_scenario("ideal"))["armature"], float)
    assert describe(load_scenario("nominal"))["armature"] is None  # the robot's motors'
    path = tmp_path / "mine.yaml"
    path.write_text("scenarios: [{name: legs, armature: [0.01, 0.02, 0.03], damping: 0.1}]")
    by_hand = read_config(path).scenario("legs")
    assert (by_hand.armature, by_hand.damping) == ((0.01, 0.02, 0.03), 0.1)
    path.write_text("scenarios: [{name: legs, armature: [0.01, 0.02]}]")
    with pytest.raises(FileProblem, match=r"armature has 2 values; for the a1 give one number, 3"):
        read_config(path)
    assert (LEGS + "slope").torque_constant == LEGS.torque_constant
    with pytest.raises(InvalidInput, match="both change torque_constant"):
        LEGS + "weak-motors"


def test_a_family_of_sampled_worlds_with_something_of_ones_own(tmp_path: Path) -> None:
    worlds = tuple(
        replace(world, name=f"{world.name}+legs", torque_constant=LEGS.torque_constant)
        for world in random_scenarios(2, 0)
    )
    experiment = Experiment(
        speeds=(0.3,), controllers=("pd", "ilc", "model"), scenarios=worlds, schedule=SHORT
    )
    results = run_experiment(experiment, tmp_path / "family", workers=1, progress=False)
    assert cli.main(["report", str(results.folder)]) == 0
    assert "100% / 90% / 80%" in (results.folder / "report.md").read_text()


def test_scenarios_are_added() -> None:
    hot = Scenario("hot", torque_constant=0.9, coulomb=0.4)
    both = hot + "payload=1+slope"
    assert (both.payload, both.slope, both.coulomb, both.armature) == (1.0, 0.1, 0.4, 0.0)
    assert ("payload" + hot).armature == load_scenario("payload").armature
    assert (load_scenario("payload") + "slope").name == "payload+slope"
    with pytest.raises(InvalidInput, match="both change torque_constant"):
        hot + "weak-motors"


def test_gaits_and_robots_of_ones_own(
    twin: GaitLibrary,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A robot from TOML with the A1's URDF, and gaits of that name, end to end from the shell; what
    was made of it needs none of the three files any more."""
    spec, urdf = ROBOTS["a1"], tmp_path / "twin.urdf"
    urdf.write_bytes(load_robot().urdf)
    shipped = resources.files("pronk_pin.robot") / "specs" / "a1.toml"
    text = shipped.read_text().replace('name = "a1"', 'name = "twin"')
    text = text.replace(spec.urdf, urdf.name)
    (tmp_path / "robot.toml").write_text(text)
    robot = RobotSpec.load(tmp_path / "robot.toml")
    assert robot == replace(spec, name="twin", urdf=str(urdf))
    with pytest.raises(FileProblem, match="no such gait library is shipped"):
        Experiment(robot=robot)
    with pytest.raises(InvalidInput, match="gaits of a1, and the robot is twin"):
        Experiment(robot=robot, gaits=load_library("a1"))
    path = twin.save(tmp_path / "gaits.npz")
    words = [
        *("compare", "--robot", str(tmp_path / "robot.toml"), "--gaits", str(path)),
        *("--apex", "0.33", "--speeds", "0.3", "--controllers", "pd", "model", "ilc"),
        *("--schedule.baseline", "1.5", "--schedule.learning", "1.5"),
        *("--folder", str(tmp_path / "result"), "--workers", "1"),
    ]
    assert cli.main(words) == 0
    assert "robot twin" in capsys.readouterr().out
    own = ("--robot", str(tmp_path / "robot.toml"))
    library, figures = ("--library", str(path)), ("--folder", str(tmp_path / "figures"))
    assert cli.main(["gaits", "show", "0.3", *library, *own]) == 0
    assert cli.main(["gaits", "plot", *library, *own, *figures, "--format", "svg"]) == 0
    assert cli.main(["view", str(path), *own, "--html", str(tmp_path / "gaits.html")]) == 0
    assert cli.main(["gaits", "show", "0.3", *library]) == 1
    assert "known by name; give its file, --robot FILE.toml" in capsys.readouterr().err
    path.unlink()
    for file in (tmp_path / "robot.toml", urdf):  # the folder has all it needs
        file.unlink()
    results = Results.load(tmp_path / "result")
    assert results.experiment.robot == replace(robot, urdf=str(tmp_path / "result" / "robot.urdf"))
    assert results.experiment.apex == 0.33
    assert results.experiment.library == twin
    assert define(results.experiment)["gaits"]["0.3"] == twin.at(0.3, 0.33).sha256
    assert cli.main(["report", str(tmp_path / "result")]) == 0
    more = ("--scenarios", "nominal", "ideal", "--workers", "1")
    monkeypatch.setattr("pronk_pin.cli.comparison._print_pages", lambda *_: None)
    assert cli.main(["compare", "--folder", str(tmp_path / "result"), *more]) == 0
    # The same gait and URDF under another name: the same strides as the A1's.
    other = Experiment(
        apex=0.33, speeds=(0.3,), controllers=("pd",), schedule=results.experiment.schedule
    )
    a1 = run_experiment(other, tmp_path / "a1", workers=1, progress=False)
    peaks = [
        one.strides(one.find(controller="pd"))["peak_error"].to_numpy() for one in (results, a1)
    ]
    np.testing.assert_array_equal(*peaks)


def test_gaits_of_another_base_are_refused() -> None:
    with pytest.raises(InvalidInput, match="planned for base 'locked', and base 'free' needs"):
        Experiment(gaits=load_library("a1"), base="free")
    with pytest.raises(InvalidInput, match="comparisons play stance and flight only; choose"):
        Experiment(gaits="bound", speeds=(0.3,), base="free")
    with pytest.raises(InvalidInput, match=r"which ends in \.npz"):
        Experiment(gaits="moonwalk")
