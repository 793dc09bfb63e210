"""Every option of every command changes what it says it changes.

A command runs up to the function that does the work, which is not run: what the option says has to
be among its arguments, and not without the option.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import pytest

from pronk_pin import cli
from pronk_pin.cli import main
from pronk_pin.cli.comparison import ExperimentOptions, Explain, Report, Reproduce, ScheduleOptions
from pronk_pin.cli.gaits import Build, Plot, Show
from pronk_pin.cli.ilc import Analyze, Drive, Gains, Stability, Wander
from pronk_pin.cli.ilc_reuse import BuildLibrary, Engines, Seeding, Transfer, TryLibrary
from pronk_pin.cli.parity import Parity
from pronk_pin.cli.play import Play
from pronk_pin.cli.view import FilmOptions, View
from pronk_pin.compare import Experiment, MujocoEngine, Results, Schedule, run_experiment
from pronk_pin.compare.experiment import load_suite
from pronk_pin.control import SAMPLES, TorqueLibrary
from pronk_pin.gait import load_library

Arguments = dict[str, Any]

TOY = f"{__name__}:ENGINE"
EXPERIMENT = Experiment(
    speeds=(0.0, 0.3),
    controllers=("pd", "ilc"),
    scenarios=("nominal", "payload"),
    schedule=Schedule(startup=0.2, baseline=2.0, learning=2.0),
)


class _Reached(BaseException):
    """The command has come to where its work is done."""


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small result over two worlds."""
    folder = tmp_path_factory.mktemp("options") / "result"
    run_experiment(EXPERIMENT, folder, workers=1, progress=False)
    return folder


@pytest.fixture
def arguments(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Arguments]:
    """The arguments, by name, with which a command calls a function; it goes no further."""

    def call(words: list[str], target: str) -> Arguments:
        module, _, name = target.rpartition(".")
        place = importlib.import_module(module)
        signature = inspect.signature(getattr(place, name))
        seen: Arguments = {}

        def note(*args: object, **named: object) -> None:
            bound = signature.bind(*args, **named)
            bound.apply_defaults()
            seen.update(bound.arguments)
            raise _Reached

        with monkeypatch.context() as patch:
            patch.setattr(place, name, note)
            with pytest.raises(_Reached):
                main(words)
        return seen

    return call


class Case(NamedTuple):
    """An option as it is given, and what the work is to be told then."""

    words: str
    found: Callable[[Arguments], object]
    value: object


def argument(name: str, value: object, words: str) -> Case:
    """An option that is an argument of the function itself."""
    return Case(words, lambda given: given[name], value)


def named(argument_name: str, value: str, words: str) -> Case:
    """An option whose argument is an object of that name."""
    return Case(words, lambda given: given[argument_name].name, value)


STUDY = "pronk_pin.compare.studies."
SPEEDS = argument("speeds", (0.2, 0.4, 0.6), "--speed 0.2 0.4 0.6")
ROBOT = argument("robot", "go1", "--robot go1")
GAITS = Case("--gaits GAITS", lambda given: Path(given["gaits"]).name, "mine.npz")
SCENARIO = named("scenario", "payload", "--scenario payload")

STUDIES: Mapping[str, tuple[type, str, Mapping[str, Case]]] = {
    "analyze": (
        Analyze,
        "simulate_learning",
        {
            "controller": named("spec", "ilc-stance", "ilc-stance"),
            "speed": SPEEDS,
            "scenario": SCENARIO,
            "strides": argument("strides", 7, "--strides 7"),
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "stability": (
        Stability,
        "measure_stability",
        {
            "controller": named("spec", "model+ilc", "model+ilc"),
            "speed": SPEEDS,
            "scenario": named("scenario", "slope", "--scenario slope"),
            "couplings": argument("couplings", (0.7, 0.1), "--couplings 0.7 0.1"),
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "drive": (
        Drive,
        "measure_driving",
        {
            "command": argument("commands", ("0.1 2s",), "--command '0.1 2s'"),
            "controllers": argument("controllers", ("pd", "model"), "--controllers pd model"),
            "scenario": SCENARIO,
            "reference": argument(
                "references", ("measured", "commanded"), "--reference measured commanded"
            ),
            "push": argument("push", 5.0, "--push 5"),
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "wander": (
        Wander,
        "measure_wandering",
        {
            "command": argument("command", "0.1 2s", "--command '0.1 2s'"),
            "scenario": SCENARIO,
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "gains": (
        Gains,
        "sweep_gains",
        {
            "controller": named("spec", "model+ilc", "model+ilc"),
            "speed": SPEEDS,
            "scenario": SCENARIO,
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "transfer": (
        Transfer,
        "measure_transfers",
        {
            "controller": named("spec", "model+ilc", "model+ilc"),
            "speed": SPEEDS,
            "scenario": named("home", "payload", "--scenario payload"),
            "scenarios": Case(
                "--scenarios slope delay",
                lambda given: [world.name for world in given["scenarios"]],
                ["slope", "delay"],
            ),
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "seeding": (
        Seeding,
        "measure_seeding",
        {
            "controller": named("spec", "ilc-fast", "--controller ilc-fast"),
            "speed": SPEEDS,
            "scenario": SCENARIO,
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
    "engines": (
        Engines,
        "measure_engine_transfer",
        {
            "engines": Case(
                f"mujoco {TOY}", lambda given: tuple(given["engines"]), ("mujoco", TOY)
            ),
            "speed": Case(
                "--speed 0.2 0.4", lambda given: [gait.speed for gait in given["gaits"]], [0.2, 0.4]
            ),
            "scenario": SCENARIO,
            "robot": Case("--robot go1", lambda given: given["robot"].name, "go1"),
            "gaits": Case("--gaits GAITS", lambda given: len(given["gaits"]), 2),
        },
    ),
    "build-library hills.npz": (
        BuildLibrary,
        "build_library",
        {
            "condition": Case(
                "--condition payload=0,2 slope=0,0.1",
                lambda given: {k: v.tolist() for k, v in given["conditions"].items()},
                {"payload": [0.0, 2.0], "slope": [0.0, 0.1]},
            ),
            "speed": SPEEDS,
            "scenario": argument("scenario", "payload", "--scenario payload"),
            "controller": named("spec", "ilc-stance", "--controller ilc-stance"),
            "robot": ROBOT,
            "gaits": GAITS,
            "folder": argument("folder", Path("there"), "--folder there"),
            "workers": argument("workers", 1, "--workers 1"),
        },
    ),
    "try-library HILLS": (
        TryLibrary,
        "measure_library",
        {
            "points": argument("points", 3, "--points 3"),
            "seed": Case("--seed 5", lambda given: given["rng"].random(), 0.8050029237453802),
            "scenario": SCENARIO,
            "robot": ROBOT,
            "gaits": GAITS,
        },
    ),
}
ELSEWHERE = {"figure", "result", "file"}
"""Options of studies that come after the work, or instead of it: see below."""


def split(words: str) -> list[str]:
    return [word.strip("'") for word in words.replace("'0.1 2s'", "'0.1_2s'").split()]


def options_of(*kinds: type) -> set[str]:
    """Names of a command's options."""
    names: set[str] = set()
    for kind in kinds:
        names |= (
            {part.name for part in dataclasses.fields(kind)}
            if dataclasses.is_dataclass(kind)
            else set(get_type_hints(kind))
        )
    return names


@pytest.mark.parametrize(
    ("study", "option"), [(study, name) for study, (*_, cases) in STUDIES.items() for name in cases]
)
def test_an_option_of_a_study_reaches_the_study(
    study: str, option: str, tmp_path: Path, arguments: Callable[..., Arguments]
) -> None:
    some_gaits(tmp_path / "mine.npz", 5, 12)  # from 0 to 0.6 m/s
    _, function, cases = STUDIES[study]
    case, places = cases[option], {"GAITS": str(tmp_path / "mine.npz"), "0.1_2s": "0.1 2s"}
    places["HILLS"] = str(hills(tmp_path))
    words = [places.get(word, word) for word in split(case.words)]
    command = ["ilc", *(places.get(word, word) for word in study.split())]
    given = arguments([*command, *words], STUDY + function)
    assert case.found(given) == case.value
    assert case.found(arguments(command, STUDY + function)) != case.value


def hills(folder: Path) -> Path:
    """The file of a small library of slopes."""
    zeros = np.zeros((2, 2, 2, SAMPLES, 12))
    speeds, slopes = np.array([0.0, 0.2]), {"slope": np.array([0.0, 0.1])}
    library = TorqueLibrary(speeds, zeros, zeros, np.full((2, 2), 0.2), conditions=slopes)
    library.save(folder / "hills.npz")
    return folder / "hills.npz"


def test_a_library_is_built_into_its_file_with_the_practice_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    built, seen = TorqueLibrary.load(hills(tmp_path)), []

    def build(*args: object, **named: object) -> TorqueLibrary:
        seen.append(args[-1])
        return built

    monkeypatch.setattr("pronk_pin.compare.studies.build_library", build)
    assert main(["ilc", "build-library", str(tmp_path / "mine.npz")]) == 0
    assert seen == [tmp_path / "mine-practice"]
    assert TorqueLibrary.load(tmp_path / "mine.npz").sha256 == built.sha256
    assert f"library  {tmp_path / 'mine.npz'}" in capsys.readouterr().out
    assert main(["ilc", "build-library", str(tmp_path / "mine.txt")]) != 0
    assert "end in .npz" in capsys.readouterr().err


def test_the_library_of_the_file_is_tried(
    tmp_path: Path, arguments: Callable[..., Arguments]
) -> None:
    path = hills(tmp_path)
    given = arguments(["ilc", "try-library", str(path)], STUDY + "measure_library")
    assert given["library"].sha256 == TorqueLibrary.load(path).sha256


def test_every_option_of_a_study_has_its_case() -> None:
    for kind, _, cases in STUDIES.values():
        assert set(cases) | ELSEWHERE >= options_of(kind), kind
        assert set(cases) <= options_of(kind), kind


@pytest.mark.parametrize(
    "study", [study for study, (kind, *_) in STUDIES.items() if "figure" in options_of(kind)]
)
def test_the_figure_of_a_study_is_written_where_it_is_asked_for(
    study: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the study, its words and its drawing left out."""
    drawing = {
        "analyze": "predicted_and_measured",
        "drive": "driving_figure",
        "gains": "gains_figure",
        "transfer": "transfers_figure",
        "seeding": "errors_by_seed",
    }[study]
    _, function, _ = STUDIES[study]
    studies = importlib.import_module("pronk_pin.compare.studies")
    for name in [name for name in dir(studies) if name.startswith("describe_")]:
        monkeypatch.setattr(studies, name, lambda _: "in words")
    driving = SimpleNamespace(summary="summary", strides="table")
    found = driving if study == "drive" else "table"
    monkeypatch.setattr("pronk_pin.compare.report.format_commands", lambda _: "in words")
    monkeypatch.setattr(studies, function, lambda *_, **__: found)
    monkeypatch.setattr(studies, "compare_prediction", lambda *_, **__: "table")
    monkeypatch.setattr(f"pronk_pin.viz.figures.{drawing}", lambda table: ("drawn", table))
    saved: list[object] = []

    def save(figure: object, path: Path) -> Path:
        saved.append((figure, path))
        return path

    monkeypatch.setattr("pronk_pin.viz.save_figure", save)
    path = tmp_path / "mine.svg"
    assert main(["ilc", study, "--figure", str(path)]) == 0
    table = ["table"] if study == "analyze" else "table"
    assert saved == [(("drawn", table), path)]
    assert str(path) in capsys.readouterr().out


def test_the_strides_of_an_analysis_are_those_that_are_compared(
    arguments: Callable[..., Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(STUDY + "simulate_learning", lambda *_, **__: "strides")
    words = ["ilc", "analyze", "--speed", "0.3", "--strides", "7", "--scenario", "payload"]
    given = arguments([*words, "ilc-stance"], STUDY + "compare_prediction")
    assert (given["number"], given["strides"], given["speed"]) == (7, "strides", 0.3)
    assert (given["spec"].name, given["scenario"].name) == ("ilc-stance", "payload")


def test_an_analysis_of_a_result_takes_its_strides_and_its_gaits(
    result: Path, arguments: Callable[..., Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["ilc", "analyze", "ilc", "--result", str(result), "--speed", "0.3"]
    given = arguments([*words, "--scenario", "payload"], STUDY + "stored_learning")
    assert Path(given["results"].folder) == result
    assert (given["spec"].name, given["scenario"].name) == ("ilc", "payload")
    monkeypatch.setattr(STUDY + "stored_learning", lambda *_, **__: "stored")
    compared = arguments(words, STUDY + "compare_prediction")
    assert compared["strides"] == "stored"
    assert compared["gait"].speed == 0.3


def asked(given: Arguments) -> Experiment:
    found = given["experiment"]
    assert isinstance(found, Experiment)
    return found


def experiment(field: str, value: object, words: str) -> Case:
    """An option that is a field of the experiment."""
    return Case(words, lambda given: getattr(asked(given), field), value)


COMPARE: Mapping[str, Case] = {
    "robot": experiment("robot_name", "go1", "--robot go1"),
    "gaits": Case("--gaits GAITS", lambda given: len(asked(given).library.speeds), 3),
    "apex": experiment("apex", 0.33, "--apex 0.33"),
    "speeds": experiment("speeds", (0.1, 0.2), "--speeds 0.1 0.2"),
    "controllers": experiment("controller_names", ("pd", "model"), "--controllers pd model"),
    "scenarios": experiment("scenario_names", ("payload", "slope"), "--scenarios payload slope"),
    "seeds": experiment("seeds", (3, 5), "--seeds 3 5"),
    "base": experiment("base", "sagittal", "--base sagittal --controllers pd"),
    "commands": Case(
        "--command 0.1_2s 0->0.3_1s",
        lambda given: asked(given).commands,
        ("0.1 2s", "0->0.3 1s"),
    ),
    "reference": experiment("reference", "measured", "--command 0.1_2s --reference measured"),
    "engine": Case(
        f"--engine {TOY}",
        lambda given: [asked(given).scenario(name).engine for name in asked(given).scenario_names],
        [TOY],
    ),
    "schedule": Case(
        "--schedule.startup 0.3 --schedule.baseline 4 --schedule.learning 5 "
        "--schedule.scatter 0.02",
        lambda given: asked(given).schedule,
        Schedule(0.3, 4.0, 5.0, 0.02),
    ),
    "config": Case(
        "--config CONFIG", lambda given: (asked(given).seeds, asked(given).speeds), ((9,), (0.2,))
    ),
    "suite": Case("--suite pairs", lambda given: asked(given).schedule.learning, 60.0),
    "folder": Case("--folder FOLDER", lambda given: Path(given["folder"]).name, "mine"),
    "workers": argument("workers", 3, "--workers 3"),
    "executor": argument("executor", "dask://there:1", "--executor dask://there:1"),
    "resimulate": argument("resimulate", True, "--resimulate"),
}


@dataclasses.dataclass(frozen=True)
class Toy(MujocoEngine):
    """An engine of another name."""

    name: str = "toy"


ENGINE = Toy()


def some_gaits(path: Path, first: int, end: int) -> None:
    """Write some of the shipped gaits, those of one apex, into a library."""
    library = load_library("a1").at_apex(0.34)
    part, many = slice(first, end), len(library.gaits)
    metadata = {
        name: value[part] if isinstance(value, list) and len(value) == many else value
        for name, value in library.metadata.items()
    }
    some = {"gaits": library.gaits[part], "audit": library.audit[part], "metadata": metadata}
    dataclasses.replace(library, **some).save(path)


@pytest.mark.parametrize("option", COMPARE)
def test_an_option_of_compare_reaches_the_run(
    option: str, tmp_path: Path, arguments: Callable[..., Arguments]
) -> None:
    some_gaits(tmp_path / "gaits.npz", 3, 6)
    (tmp_path / "mine.yaml").write_text("seeds: [9]\nspeeds: [0.2]\n")
    places = {
        "GAITS": str(tmp_path / "gaits.npz"),
        "CONFIG": str(tmp_path / "mine.yaml"),
        "FOLDER": str(tmp_path / "mine"),
    }
    case = COMPARE[option]
    words = [places.get(word, word) for word in case.words.split()]
    words = [word.replace("_2s", " 2s").replace("_1s", " 1s") for word in words]
    target = "pronk_pin.compare.run_experiment"
    assert case.found(arguments(["compare", *words], target)) == case.value
    assert case.found(arguments(["compare"], target)) != case.value


def test_every_option_of_compare_has_its_case() -> None:
    others = {"options", "mjcf", "metrics", "schedule"}  # the first holds those of the experiment
    assert set(COMPARE) | others == options_of(cli.Compare, ExperimentOptions) | {"schedule"}
    assert set(get_type_hints(ScheduleOptions)) == {
        word.partition(".")[2]
        for word in COMPARE["schedule"].words.split()
        if word.startswith("--schedule.")
    }


def test_a_folder_that_is_there_goes_on_with_its_own_experiment(
    result: Path, arguments: Callable[..., Arguments]
) -> None:
    target = "pronk_pin.compare.run_experiment"
    given = arguments(["compare", "--folder", str(result), "--seeds", "0", "4"], target)
    assert asked(given) == dataclasses.replace(EXPERIMENT, seeds=(0, 4))


@pytest.mark.parametrize(
    "case",
    [
        experiment("speeds", (0.1, 0.3), "--speeds 0.1 0.3"),
        experiment("seeds", (3, 4), "--seeds 3 4"),
        argument("workers", 2, "--workers 2"),
        Case("--folder mine", lambda given: Path(given["folder"]), Path("mine")),
    ],
    ids=lambda case: case.words,
)
def test_an_option_of_reproduce_reaches_the_run(
    case: Case, arguments: Callable[..., Arguments]
) -> None:
    target = "pronk_pin.compare.run_experiment"
    given = arguments(["reproduce", *case.words.split()], target)
    assert case.found(given) == case.value
    assert case.found(arguments(["reproduce"], target)) != case.value
    assert asked(given).controller_names[0] == "pd"
    assert options_of(Reproduce) == {"folder", "speeds", "seeds", "workers"}


def test_what_is_reproduced_are_the_learners_of_the_suite(
    tmp_path: Path, arguments: Callable[..., Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pronk_pin.compare.run_experiment", lambda *_, **__: "results")
    given = arguments(["reproduce", "--folder", str(tmp_path)], STUDY + "format_reproduction")
    assert given["results"] == "results"
    names = load_suite("paper").controller_names
    assert "pd" in names
    assert set(given["learners"]) == {*names} - {"pd"}


def test_what_is_reproduced_is_printed_with_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = SimpleNamespace(folder=tmp_path / "made")
    monkeypatch.setattr("pronk_pin.compare.run_experiment", lambda *_, **__: made)
    monkeypatch.setattr(STUDY + "format_reproduction", lambda *_, **__: "the rows")
    assert main(["reproduce"]) == 0
    assert capsys.readouterr().out == f"the rows\n\nresults  {made.folder}\n"


def drawn(given: Arguments) -> float:
    """The first number that a generator draws."""
    return float(given["rng"].random())


EXPLAIN = {
    "controller": Case(
        "--controller ilc", lambda given: given["strides"].attrs["controller"], "ilc"
    ),
    "scenario": Case(
        "--scenario payload", lambda given: given["strides"].attrs["scenario"], "payload"
    ),
    "imu_noise": argument("imu_noise", 0.25, "--imu-noise 0.25"),
    "draws": argument("draws", 40, "--draws 40"),
    "seed": Case("--seed 6", drawn, float(np.random.default_rng(6).random())),
}


@pytest.mark.parametrize("option", EXPLAIN)
def test_an_option_of_explain_reaches_the_explanation(
    option: str, result: Path, arguments: Callable[..., Arguments]
) -> None:
    case = EXPLAIN[option]
    words = ["explain", str(result), *case.words.split()]
    given = arguments(words, "pronk_pin.compare.explain")
    assert case.found(given) == case.value
    assert [gait.speed for gait in given["gaits"]] == [0.0, 0.3]
    if option != "controller":  # ilc, which is the only one here that learns
        without = arguments(["explain", str(result)], "pronk_pin.compare.explain")
        assert case.found(without) != case.value


def test_what_explain_found_is_drawn_written_and_tried_where_it_is_asked_for(
    result: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    class Found:
        robot = Results.load(result).experiment.model
        identified = "the identified model"

    told: list[tuple[object, ...]] = []

    def told_by(name: str) -> Callable[..., object]:
        def tell(*args: object, **named: object) -> object:
            told.append((name, *args[1:2], named.get("speed"), args[0]))
            return f"{name} made"

        return tell

    monkeypatch.setattr("pronk_pin.compare.explain", lambda *_, **__: Found())
    monkeypatch.setattr("pronk_pin.compare.describe", lambda _: "in words")
    monkeypatch.setattr(STUDY + "close_loop", told_by("loop"))
    monkeypatch.setattr(STUDY + "format_loop", lambda _: "the loop in words")
    for place, name in (
        ("pronk_pin.viz.figures.write_explanation_figure", "figure"),
        ("pronk_pin.robot.formats.write_urdf", "urdf"),
        ("pronk_pin.robot.formats.write_mjcf", "mjcf"),
    ):
        monkeypatch.setattr(place, told_by(name))
    assert main(["explain", str(result)]) == 0
    assert not told
    options = {"--figure": "a.svg", "--write-urdf": "b.urdf", "--write-mjcf": "c.xml"}
    words = [word for name, path in options.items() for word in (name, str(tmp_path / path))]
    assert main(["explain", str(result), *words, "--speed", "0.3", "--close-loop"]) == 0
    figure, urdf, mjcf, loop = told
    assert figure[:3] == ("figure", tmp_path / "a.svg", 0.3)
    assert urdf[:2] == ("urdf", tmp_path / "b.urdf")
    assert mjcf[:2] == ("mjcf", tmp_path / "c.xml")
    assert urdf[3] == mjcf[3] == "the identified model"
    assert isinstance(loop[3], Found)
    printed = capsys.readouterr().out
    for said in ("figure made", "urdf made", "mjcf made", "the loop in words"):
        assert said in printed
    told.clear()
    assert main(["explain", str(result), *words[:2]]) == 0
    assert [(name, speed) for name, _, speed, _ in told] == [("figure", None)]
    after = {"result", "figure", "speed", "write_urdf", "write_mjcf", "close_loop"}
    assert set(EXPLAIN) | after == options_of(Explain)


def test_report_reads_one_result_or_compares_two(
    result: Path,
    tmp_path: Path,
    arguments: Callable[..., Arguments],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    both = arguments(
        ["report", str(result), str(result)], "pronk_pin.compare.report.format_changes"
    )
    assert [Path(both[name].folder) for name in ("first", "second")] == [result, result]
    assert options_of(Report) == {"result", "other", "figures"}
    monkeypatch.setattr("pronk_pin.cli.comparison._print_pages", lambda *_: None)
    monkeypatch.setattr("pronk_pin.cli.comparison._report", lambda _: "page")
    words = ["report", str(result), "--figures", str(tmp_path / "drawn")]
    given = arguments(words, "pronk_pin.viz.report.write_figures")
    assert (Path(given["results"].folder), given["folder"]) == (result, tmp_path / "drawn")


PARITY = {
    "robot": Case("--robot go1", lambda given: given["a"].name, "go1"),
    "states": argument("states", 17, "--states 17"),
    "seed": Case("--seed 6", drawn, float(np.random.default_rng(6).random())),
    "tolerance": argument("tolerance", 0.2, "--tolerance 0.2"),
    "model": argument("b", Path("mine.xml"), "mine.xml"),
}


@pytest.mark.parametrize("option", PARITY)
def test_an_option_of_parity_reaches_the_comparison(
    option: str, arguments: Callable[..., Arguments]
) -> None:
    case, target = PARITY[option], "pronk_pin.parity.compare_models"
    assert case.found(arguments(["parity", *case.words.split()], target)) == case.value
    assert case.found(arguments(["parity"], target)) != case.value
    assert set(PARITY) | {"full"} == options_of(Parity)


BUILD = {
    "robot": Case("--robot go1", lambda given: given["robot"].name, "go1"),
    "gait": argument("gait", "bound", "--gait bound"),
    "base": argument("base", "sagittal", "--base sagittal"),
    "speeds": Case(
        "--speeds 0.1 0.2:0.4:0.1",
        lambda given: given["speeds"],
        pytest.approx([0.1, 0.2, 0.3, 0.4]),
    ),
    "apex": Case("--apex 0.33 0.35", lambda given: given["apexes"], pytest.approx([0.33, 0.35])),
    "output": argument("path", Path("here.npz"), "--output here.npz"),
    "folder": argument("folder", Path("there"), "--folder there"),
    "workers": argument("workers", 3, "--workers 3"),
}


@pytest.mark.parametrize("option", BUILD)
def test_an_option_of_gaits_build_reaches_the_optimisation(
    option: str, arguments: Callable[..., Arguments]
) -> None:
    case, target = BUILD[option], "pronk_pin.gait.build_library"
    assert case.found(arguments(["gaits", "build", *case.words.split()], target)) == case.value
    without = case.found(arguments(["gaits", "build"], target))
    assert without is None or without != case.value
    assert set(BUILD) == options_of(Build)


def test_the_folder_of_solved_gaits_is_beside_the_output(
    arguments: Callable[..., Arguments],
) -> None:
    words = ["gaits", "build", "--output", "some/here.npz"]
    given = arguments(words, "pronk_pin.gait.build_library")
    assert given["folder"] == Path("some/here.npz.build")


def shown(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["gaits", "show", *words]) == 0
    return capsys.readouterr().out


def test_gaits_show_has_the_gaits_that_its_options_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def rows(text: str) -> set[str]:
        lines = (line.split() for line in text.splitlines())
        return {words[1] for words in lines if len(words) > 8 and words[0][0] in "+-"}

    assert rows(shown([], capsys)) == {"0.320", "0.340", "0.360"}
    assert rows(shown(["--apex", "0.36"], capsys)) == {"0.360"}
    for words, said in (
        (["0.35"], "a1, pronk, locked base, +0.35 m/s, apex 0.34 m"),
        (["0.35", "--apex", "0.335"], "a1, pronk, locked base, +0.35 m/s, apex 0.335 m"),
        (["0.3", "--apex", "0.32"], "a1, pronk, locked base, +0.3 m/s, apex 0.32 m"),
        (["0.3", "--base", "sagittal"], "a1, pronk, sagittal base, +0.3 m/s"),
        (["0.3", "--gait", "bound"], "a1, bound, sagittal base, +0.3 m/s"),
        (["0.3", "--robot", "go1"], "go1, pronk, locked base, +0.3 m/s"),
    ):
        assert shown(words, capsys).startswith(said), words
    path = tmp_path / "mine.npz"
    some_gaits(path, 4, 6)
    assert "All 2 gaits pass" in shown(["--library", str(path)], capsys)
    assert options_of(Show) == {"apex", "library", "robot", "gait", "base", "speed"}


def test_gaits_show_prints_the_residual_of_the_apex_that_it_names(
    capsys: pytest.CaptureFixture[str],
) -> None:
    library = load_library("a1")
    for apex in (0.32, 0.335, 0.36):
        force = library.residual(0.35, apex).force
        text = shown(["0.35", "--apex", str(apex)], capsys)
        assert f"the equations of motion lack {force:.2g} N," in text


PLOT = {
    "apex": argument("apex", 0.36, "--apex 0.36"),
    "robot": Case("--robot go1", lambda given: given["robot"].name, "go1"),
    "gait": Case("--gait bound", lambda given: given["library"].metadata["gait"], "bound"),
    "base": Case("--base sagittal", lambda given: given["library"].base, "sagittal"),
    "speed": argument("speed", 0.45, "0.45"),
    "folder": argument("folder", Path("here"), "--folder here"),
    "format": argument("suffix", "svg", "--format svg"),
}


@pytest.mark.parametrize("option", PLOT)
def test_an_option_of_gaits_plot_reaches_the_drawing(
    option: str, arguments: Callable[..., Arguments]
) -> None:
    case, target = PLOT[option], "pronk_pin.viz.figures.write_gait_figures"
    assert case.found(arguments(["gaits", "plot", *case.words.split()], target)) == case.value
    assert case.found(arguments(["gaits", "plot"], target)) != case.value
    assert set(PLOT) | {"library"} == options_of(Plot)


def test_plots_are_of_the_apex_that_is_asked_for(
    tmp_path: Path, arguments: Callable[..., Arguments]
) -> None:
    target = "pronk_pin.viz.figures.gait_figures.stride_figure"
    words = ["gaits", "plot", "0.45", "--folder", str(tmp_path), "--apex", "0.36"]
    assert arguments(words, target)["library"].apexes.tolist() == [0.36]


def first(name: str) -> Callable[[Arguments], object]:
    """What the menu of a page begins with."""
    return lambda given: given["shown"].first[name]


VIEW_GAITS = {
    "speed": Case("--speed 0.2", first("speed [m/s]"), "0.2"),
    "apex": Case("--apex 0.36", first("apex [m]"), "0.36"),
    "robot": Case("--robot go1", lambda given: given["shown"].scene().robot.name, "go1"),
    "gait": Case(
        "--gait bound", lambda given: "BOUND" in given["shown"].scene().title.upper(), True
    ),
    "base": Case(
        "--base sagittal",
        lambda given: float(np.abs(given["shown"].scene().tracks[0].q[:, 4]).max()) > 1e-3,
        True,
    ),
    "port": argument("port", 12345, "--port 12345"),
    "host": argument("host", "0.0.0.0", "--host 0.0.0.0"),
    "open": argument("open_browser", False, "--no-open"),
    "duration": argument("duration", 7.0, "--duration 7"),
}
VIEW_RESULT = {
    "speed": Case("--speed 0.0", first("speed [m/s]"), "0"),
    "controller": Case("--controller pd", first("controller"), "pd"),
    "scenario": Case("--scenario payload", first("scenario"), "payload"),
    "beside": Case("--beside nothing", first("beside it"), "nothing"),
    "stride": Case("--stride 0", first("strides"), "from 0 on"),
}
FILMS = {
    "width": ("--width 320", 320),
    "height": ("--height 240", 240),
    "plots": ("--plots", True),
    "color": ("--color error", "error"),
    "fps": ("--fps 10", 10.0),
    "rate": ("--rate 0.5", 0.5),
    "at": ("--at 0.7", 0.7),
    "seconds": ("--seconds 1.5", 1.5),
}


@pytest.mark.parametrize("option", VIEW_GAITS)
def test_an_option_of_view_reaches_the_page_of_gaits(
    option: str, arguments: Callable[..., Arguments]
) -> None:
    case = VIEW_GAITS[option]
    assert case.found(arguments(["view", *case.words.split()], "pronk_pin.viz.serve")) == case.value
    assert case.found(arguments(["view"], "pronk_pin.viz.serve")) != case.value


@pytest.mark.parametrize("option", VIEW_RESULT)
def test_an_option_of_view_reaches_the_page_of_a_result(
    option: str, result: Path, arguments: Callable[..., Arguments]
) -> None:
    case, words = VIEW_RESULT[option], ["view", str(result)]
    given = arguments([*words, *case.words.split()], "pronk_pin.viz.serve")
    assert case.found(given) == case.value
    assert case.found(arguments(words, "pronk_pin.viz.serve")) != case.value


@pytest.mark.parametrize("option", FILMS)
def test_an_option_of_films_reaches_picture_and_film(
    option: str, arguments: Callable[..., Arguments]
) -> None:
    words, value = FILMS[option]
    for path, target in (
        ("--png a.png", "write_png"),
        ("--gif a.gif", "write_film"),
        ("--mp4 a.mp4", "write_film"),
    ):
        given = arguments(["view", *path.split(), *words.split()], f"pronk_pin.viz.{target}")
        assert getattr(given["film"], option) == value
        assert given["path"] == Path(path.split()[1])
        without = arguments(["view", *path.split()], f"pronk_pin.viz.{target}")
        assert getattr(without["film"], option) != value


def of_experiment(name: str, value: object, words: str) -> Case:
    """An option that is an attribute of the experiment."""
    return Case(words, lambda given: getattr(given["experiment"], name), value)


PLAY = {
    "controllers": of_experiment("controllers", ("pd", "ilc"), "--controllers pd ilc"),
    "scenario": of_experiment("scenarios", ("payload=2",), "--scenario payload=2"),
    "robot": of_experiment("robot", "go2", "--robot go2"),
    "gaits": Case("--gaits GAITS", lambda given: len(given["experiment"].library.speeds), 12),
    "seed": of_experiment("seeds", (3,), "--seed 3"),
    "speed": argument("speed", 0.2, "--speed 0.2"),
    "rate": argument("rate", 0.5, "--rate 0.5"),
    "folder": argument("folder", Path("drive"), "--folder drive"),
    "port": argument("port", 7123, "--port 7123"),
    "host": argument("host", "localhost", "--host localhost"),
}
SERVED_LAB = {
    "open": argument("open_browser", False, "--no-open"),
    "duration": argument("duration", 7.0, "--duration 7"),
}


@pytest.mark.parametrize("option", PLAY)
def test_an_option_of_play_reaches_the_session(
    option: str, arguments: Callable[..., Arguments], tmp_path: Path
) -> None:
    case = PLAY[option]
    some_gaits(tmp_path / "gaits.npz", 0, 12)
    words = case.words.replace("GAITS", str(tmp_path / "gaits.npz")).split()
    given = arguments(["play", *words], "pronk_pin.viz.live_lab")
    assert case.found(given) == case.value
    assert case.found(arguments(["play"], "pronk_pin.viz.live_lab")) != case.value


@pytest.mark.parametrize("option", SERVED_LAB)
def test_an_option_of_play_reaches_its_page(
    option: str, arguments: Callable[..., Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pronk_pin.viz.live_lab", lambda *_, **__: None)
    case = SERVED_LAB[option]
    given = arguments(["play", *case.words.split()], "pronk_pin.viz.serve_lab")
    assert case.found(given) == case.value
    assert case.found(arguments(["play"], "pronk_pin.viz.serve_lab")) != case.value


def test_every_option_of_play_has_its_case() -> None:
    assert {*PLAY, *SERVED_LAB} == options_of(Play)


def test_every_option_of_view_has_its_case() -> None:
    files = {"what", "html", "png", "gif", "mp4", "film"}
    # A command is of results of commanded speeds: tests/viz/player/test_commands_shown.py.
    assert {*VIEW_GAITS, *VIEW_RESULT, *files, "command"} == options_of(View)
    assert set(FILMS) == options_of(FilmOptions)


@pytest.mark.parametrize(
    ("kind", "known"),
    [
        ("controllers", "ilc-norm-optimal"),
        ("robots", "solo12"),
        ("gaits", "bound of a1"),
        ("scenarios", "payload=3"),
        ("engines", "mujoco"),
        ("metrics", "peak_error"),
        ("suites", "pairs"),
    ],
)
def test_list_lists_what_is_asked_for_and_nothing_else(
    kind: str, known: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", kind]) == 0
    text = capsys.readouterr().out
    assert any(line.startswith(known) for line in text.splitlines())
    assert main(["list"]) == 0
    assert (capsys.readouterr().out == text) == (kind == "controllers")
