"""The help costs nothing, says what happens without each option, and shells complete it."""

from __future__ import annotations

import dataclasses
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_type_hints

import pytest

from pronk_pin import __version__, cli
from pronk_pin.cli import main
from pronk_pin.cli.comparison import ExperimentOptions, ScheduleOptions
from pronk_pin.cli.ilc import Stability
from pronk_pin.cli.view import FilmOptions
from pronk_pin.compare import DEFAULT_CONTROLLERS, Experiment, Schedule
from pronk_pin.compare.studies import COUPLINGS
from pronk_pin.viz import Film

ROOT = Path(__file__).parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
COMMANDS = [
    *([], *([name] for name in cli.COMMANDS)),
    *(["gaits", name] for name in ("build", "show", "plot")),
    *(["ilc", name] for name in ("analyze", "stability", "gains", "transfer", "seeding")),
]


def help_of(command: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The help of a command."""
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help"])
    assert not ended.value.code
    return capsys.readouterr().out


def options(text: str) -> dict[str, str]:
    """Text of each option of a help by its name; of an argument without one, by its place."""
    found: dict[str, str] = {}
    part = ""
    for line in text.splitlines():
        line = line.replace("│", " ")  # frames are drawn where the terminal has them
        entry = re.match(r"  (--?\w\S*|\[?[A-Z{]\S*)(.*)", line)
        if heading := re.match(r"(?:╭─)? (positional|subcommands|(?:\w+ )?options)", line):
            part = heading[1]
        elif entry and (entry[1].startswith("-") or part == "positional"):
            found[entry[1].rstrip(",")] = entry[2]
        elif found and part != "subcommands" and line.startswith(" " * 6):
            found[list(found)[-1]] += f" {line}"
    return {name: " ".join(text.split()) for name, text in found.items() if name != "-h"}


def test_the_help_of_every_command_imports_no_library() -> None:
    code = """
import contextlib, io, sys
from pronk_pin.cli import main
for command in eval(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main([*command, "--help"])
print(*sys.modules)
"""
    ran = [sys.executable, "-c", code, repr(COMMANDS)]
    modules = {*subprocess.check_output(ran, env=ENVIRONMENT, text=True).split()}
    assert "tyro" in modules
    heavy = {"numpy", "scipy", "pandas", "xarray", "netCDF4", "matplotlib", "tqdm", "msgspec"}
    assert not modules & (heavy | {"pinocchio", "mujoco", "casadi", "tornado", "PIL", "yaml"})
    rooms = {name for name in modules if name.startswith("pronk_pin.")}
    assert rooms <= {
        "pronk_pin._workers",
        "pronk_pin._display",
        "pronk_pin.errors",
        "pronk_pin.cli",
    } | {name for name in rooms if name.startswith("pronk_pin.cli.")}


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_option_says_what_happens_without_it(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    text = help_of(command, capsys)
    for ugly in ("{None}", "None)", "(default: )", "(default: '')", "tyro"):
        assert ugly not in text
    shown = options(text)
    assert shown or command in (["gaits"], ["ilc"])
    silent = {name for name, said in shown.items() if not re.search(r"default|\(required\)", said)}
    assert silent <= {"--version"}


def test_the_help_names_an_option_as_a_person_would(capsys: pytest.CaptureFixture[str]) -> None:
    shown = options(help_of(["view"], capsys))
    assert shown["--apex"].startswith("FLOAT Apex of a gait library [m]; by default the library's")
    assert shown["--width"] == "INT Width of the picture [pixels]; by default 800."
    assert shown["[PATH]"].startswith("Results folder or gait library; by default")


@pytest.mark.parametrize(
    ("given", "made", "command", "prefix"),
    [
        (FilmOptions, Film(), "view", "--"),
        (ScheduleOptions, Schedule(), "compare", "--schedule."),
    ],
)
def test_options_are_the_fields_with_their_defaults(
    given: type, made: object, command: str, prefix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = options(help_of([command], capsys))
    names = [part.name for part in dataclasses.fields(made)]  # type: ignore[arg-type]
    assert list(get_type_hints(given)) == names
    for name in names:
        value = getattr(made, name)
        said = f"{value:g}." if type(value) in (int, float) else ""
        assert f"by default {said}" in shown[prefix + name]


def test_options_of_compare_are_the_fields_of_an_experiment(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = options(help_of(["compare"], capsys))
    names = {part.name for part in dataclasses.fields(Experiment)} - {"batches"}
    assert {*get_type_hints(ExperimentOptions)} == names
    experiment = Experiment()
    for name in ("robot", "gaits", "base"):
        assert f"by default {getattr(experiment, name)}." in shown[f"--{name}"]
    said = shown["--controllers"].partition("by default ")[2].partition(", less")[0]
    assert tuple(said.replace(" and ", ", ").split(", ")) == DEFAULT_CONTROLLERS
    assert "by default nominal." in shown["--scenarios"]
    assert "by default 0." in shown["--seeds"]
    speeds = experiment.speeds
    assert f"the A1's {speeds[0]:g} to {speeds[-1]:g}." in shown["--speeds"]


def test_the_couplings_are_those_of_the_study() -> None:
    assert Stability().couplings == COUPLINGS


def test_the_help_has_the_values_of_a_suite_or_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = options(help_of(["compare", "--suite", "pairs", "--seeds", "3"], capsys))
    assert shown["--speeds"].endswith("(here: -0.4 0.0 0.4 0.8)")
    assert shown["--schedule.learning"].endswith("(here: 60.0)")
    assert shown["--seeds"].endswith("(here: 3)")
    path = tmp_path / "mine.yaml"
    path.write_text("controllers: [pd, ilc]\nrobot: go1\n")
    shown = options(help_of(["compare", "--config", str(path)], capsys))
    assert shown["--controllers"].endswith("(here: pd ilc)")
    assert shown["--robot"].endswith("(here: go1)")


def test_what_is_not_given_stays_as_the_file_has_it(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("apex: 0.33\nspeeds: [0.2]\nschedule: {baseline: 3.0, learning: 5.0}\n")
    config = ["compare", "--config", str(path)]
    experiment = cli._parsed([*config, "--schedule.learning", "4"]).experiment
    assert (experiment.apex, experiment.speeds) == (0.33, (0.2,))
    assert experiment.schedule == Schedule(baseline=3.0, learning=4.0)
    assert cli._parsed([*config, "--apex", "None"]).experiment.apex is None
    assert cli._parsed([*config, "--apex=0.34"]).experiment.apex == 0.34


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"pronk-pin {__version__}\n"


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The completion script for a shell."""
    with pytest.raises(SystemExit) as ended:
        main(["--tyro-print-completion", shell])
    assert not ended.value.code
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", cli.SHELLS)
def test_completion_knows_all_commands_and_options(
    shell: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = script(shell, capsys)
    words = {*re.findall(r"[\w.-]+", text)}
    assert words >= {*cli.COMMANDS, "seeding", "--schedule.baseline", "--version", "--write-urdf"}
    if shutil.which(shell):
        path = tmp_path / "script"
        path.write_text(text)
        subprocess.run([shell, "-n", str(path)], check=True)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("rep", {"report", "reproduce"}),
        ("gaits s", {"show"}),
        ("compare --schedule.b", {"--schedule.baseline"}),
        ("ilc transfer --scenarios", {"--scenarios"}),
    ],
)
def test_bash_completes(
    line: str, found: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "script"
    path.write_text(script("bash", capsys))
    code = (
        f'source {path}; COMP_WORDS=(pronk-pin "$@"); COMP_CWORD=$#; _tyro_pronk_pin; '
        'echo "${COMPREPLY[@]}"'
    )
    command = ["bash", "-c", code, "bash", *line.split()]
    assert {*subprocess.check_output(command, text=True).split()} == found


def test_an_unknown_shell_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--tyro-print-completion", "tcsh"]) == 1
    assert "unknown shell 'tcsh'; choose one of: bash, zsh, fish" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["--help"], ["list", "suites"]], ids=" ".join)
def test_output_that_nobody_reads_ends_without_a_traceback(command: list[str]) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "pronk_pin", *command],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.close()
    _, error = process.communicate()
    assert (process.returncode, error) == (141, "")


@pytest.mark.parametrize("kind", ["controllers", "robots", "scenarios", "gaits", "suites"])
def test_everything_with_a_name_has_a_line(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", kind]) == 0
    for line in capsys.readouterr().out.splitlines():
        assert re.match(r"\S.*?  +\S", line), line
