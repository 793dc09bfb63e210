"""Engines of one's own: named, played, kept on record, and refused where they are not the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pronk_pin.compare import (
    Experiment,
    MujocoEngine,
    Results,
    Scenario,
    Schedule,
    load_engine,
    load_scenario,
    run_experiment,
)
from pronk_pin.compare.world import OTHER_ENGINES
from pronk_pin.compare.world.engines import ENGINES
from pronk_pin.errors import InvalidInput, UnknownName

ENGINE = """
from dataclasses import dataclass, replace

from pronk_pin.compare import MujocoEngine
from pronk_pin.errors import InvalidInput


@dataclass(frozen=True)
class Moon(MujocoEngine):
    name: str = "moon"

    def check(self, robot, scenario, base):
        if scenario.slope:
            raise InvalidInput("moon: it has no slopes; leave slope out")

    def world(self, robot, scenario, n, *, base, servo=None):
        return super().world(robot, replace(scenario, gravity=8.0), n, base=base, servo=servo)


@dataclass(frozen=True)
class Broken(MujocoEngine):
    name: str = "broken"

    def world(self, *arguments, **named):
        return {}["no"]


@dataclass(frozen=True)
class Short(MujocoEngine):
    name: str = "short"

    def world(self, *arguments, **named):
        world = super().world(*arguments, **named)
        play = world.play

        def three_joints(rows, control):
            motion = play(rows, control)
            return motion._replace(joints=motion.joints[..., :3])

        world.play = three_joints
        return world


engine, broken, short = Moon(), Broken(), Short()
"""

SHORT = Schedule(startup=0.2, baseline=1.0, learning=0.0)


@pytest.fixture
def moon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Address of an engine in the folder that the program was started in."""
    name = "engine_" + tmp_path.name.replace("-", "_")
    (tmp_path / f"{name}.py").write_text(ENGINE)
    monkeypatch.chdir(tmp_path)
    return f"{name}:engine"


def test_the_shipped_engines_are_those_that_scenarios_know_by_name() -> None:
    assert tuple(ENGINES) == ("mujoco", *OTHER_ENGINES)
    assert all(engine.name == name for name, engine in ENGINES.items())
    assert Scenario("mine").engine == "mujoco"


def test_an_engine_joins_a_scenario_by_its_address(moon: str) -> None:
    scenario = load_scenario(f"payload=2+{moon}")
    assert (scenario.name, scenario.engine, scenario.payload) == ("payload=2+moon", moon, 2.0)
    assert load_scenario("payload=2").in_engine(moon) == scenario
    assert load_scenario("payload=2") + moon == scenario
    assert Scenario.from_json(scenario.to_json()) == scenario
    everywhere = Experiment(scenarios=("ideal", "delay"), engine=moon)
    assert everywhere.scenario_names == ("ideal+moon", "delay+moon")


def test_a_comparison_in_an_engine_of_ones_own_is_kept_and_reported_without_it(moon: str) -> None:
    module = Path(f"{moon.partition(':')[0]}.py")
    experiment = Experiment(
        speeds=(0.3,), controllers=("pd",), scenarios=("nominal", f"nominal+{moon}"), schedule=SHORT
    )
    results = run_experiment(experiment, "result", workers=1, progress=False)
    # In the moon's gravity a pronk of the same torques goes higher.
    apex = {
        cell.scenario: float(results.strides(cell)["apex"].mean()) for cell in experiment.cells()
    }
    assert apex["nominal+moon"] > apex["nominal"] + 0.005
    assert Results.load("result").experiment == experiment
    module.write_text(ENGINE + "\n# changed\n")
    with pytest.raises(InvalidInput, match="has changed since; put the old one back"):
        run_experiment(
            Experiment(
                speeds=(0.3,),
                controllers=("pd", "model"),
                scenarios=results.experiment.scenarios,
                schedule=SHORT,
            ),
            "result",
            workers=1,
            progress=False,
        )


def test_what_an_engine_cannot_do_is_said_before_anything_is_simulated(moon: str) -> None:
    experiment = Experiment(
        speeds=(0.3,), controllers=("pd",), scenarios=("slope",), engine=moon, schedule=SHORT
    )
    with pytest.raises(InvalidInput, match="moon: it has no slopes"):
        run_experiment(experiment, "result", workers=1, progress=False)
    assert not Path("result").exists()


def test_an_engine_of_ones_own_that_fails_is_named(moon: str) -> None:
    broken = moon.replace(":engine", ":broken")
    experiment = Experiment(speeds=(0.3,), controllers=("pd",), engine=broken, schedule=SHORT)
    with pytest.raises(InvalidInput, match=f"engine {broken} ends in KeyError: 'no'"):
        run_experiment(experiment, "result", workers=1, progress=False)
    short = replace(experiment, scenarios=(f"nominal+{moon.replace(':engine', ':short')}",))
    with pytest.raises(InvalidInput, match=r"joints of a motion has the shape \(1, \d+, 3\); give"):
        run_experiment(short, "result", workers=1, progress=False)


def test_what_is_no_engine_is_refused(moon: str) -> None:
    module = moon.partition(":")[0]
    with pytest.raises(UnknownName, match="unknown engine 'bullet'; choose one of: mujoco"):
        Experiment(engine="bullet")
    with pytest.raises(UnknownName, match="unknown engine 'bullet'"):
        load_engine("bullet")
    with pytest.raises(InvalidInput, match="is a class; give an object of it"):
        load_engine(f"{module}:Moon")
    with pytest.raises(InvalidInput, match="is a str; let the address be that of a Engine"):
        load_engine(f"{module}:__name__")
    with pytest.raises(InvalidInput, match="2 engines; keep one of them"):
        load_scenario(f"payload+{moon}+{moon}")
    assert load_engine("mujoco") == MujocoEngine()
