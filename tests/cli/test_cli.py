"""Each command does what its help says, and bad input ends in one line with a remedy."""

from __future__ import annotations

import base64
import json
import re
import runpy
import zlib
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pronk_pin import cli, load_robot
from pronk_pin.cli import main
from pronk_pin.cli.ilc_reuse import covered_speeds
from pronk_pin.gait import SPEEDS
from pronk_pin.robot import ROBOTS
from pronk_pin.robot.formats.urdf import mujoco_spec

SHORT = ["--speeds", "0.0", "0.4", "--schedule.baseline", "2", "--schedule.learning", "3"]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small comparison, run once by the command line."""
    folder = tmp_path_factory.mktemp("results") / "small"
    controllers = ["--controllers", "pd", "ilc", "library"]
    code = main(["compare", *SHORT, *controllers, "--folder", str(folder), "--workers", "1"])
    assert code == 0
    return folder


def failure(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The error of a command that must fail in one line."""
    assert main(arguments) == 1
    error = capsys.readouterr().err.strip()
    last = error.splitlines()[-1]
    assert last.startswith("pronk-pin: ")
    assert "Traceback" not in error
    return last


def test_the_package_runs_as_a_module(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["pronk-pin", "gaits", "show", "--robot", "nobody"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("pronk_pin", run_name="__main__")
    assert ended.value.code == 1
    assert "unknown robot 'nobody'" in capsys.readouterr().err


def test_compare_writes_everything_it_names(result: Path) -> None:
    names = {path.name for path in result.iterdir()}
    assert names == {
        *("config.json", "manifest.json", "provenance.json", "summary.csv", "strides"),
        *("report.html", "report.md", "figures", "replay.html"),
    }
    assert {path.name for path in (result / "strides").iterdir()} == {
        "pd_nominal_0.nc",
        "ilc_nominal_0.nc",
        "library_nominal_0.nc",
    }


def test_summary_is_one_long_sorted_table(result: Path) -> None:
    summary = pd.read_csv(result / "summary.csv")
    keys = ["robot", "base", "scenario", "speed", "controller", "seed", "joint", "metric"]
    assert list(summary.columns) == [*keys, "value", "unit"]
    assert summary.equals(summary.sort_values(keys, ignore_index=True))
    assert not summary.duplicated(keys).any()
    assert set(summary["controller"]) == {"pd", "ilc", "library"}
    assert set(summary["joint"]) == {"hip", "thigh", "calf", "-"}


def test_pages_need_nothing_from_outside(result: Path) -> None:
    for name in ("report.html", "replay.html"):
        text = (result / name).read_text()
        assert not re.search(r"""src=["'](?!data:)""", text), name
        for address in re.findall(r"""href=["'](?!data:|#)([^"'#]+)""", text):
            assert (result / address).exists(), address  # links lead to what is in the folder
    assert 'href="replay.html' in (result / "report.html").read_text()


def test_one_speed_and_one_controller_are_a_comparison_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ["--speeds", "0.3", "--schedule.baseline", "1.5", "--schedule.learning", "0.5"]
    folder = ["--folder", str(tmp_path / "one")]
    assert main(["compare", *short, "--controllers", "model", *folder]) == 0
    assert "1 of 1" in capsys.readouterr().out
    assert main(["report", str(tmp_path / "one"), "--figures", str(tmp_path / "figures")]) == 0
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {
        f"{name}.{suffix}" for name in ("errors", "learning") for suffix in ("svg", "pdf")
    }


def test_a_picture_that_fails_does_not_fail_a_finished_comparison(
    result: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("of a library that draws")

    for name in ("report.write_report", "write_replay"):
        monkeypatch.setattr(f"pronk_pin.viz.{name}", fail)
    controllers = ["--controllers", "pd", "ilc", "library"]
    assert main(["compare", *SHORT, *controllers, "--folder", str(result), "--workers", "1"]) == 0
    output = capsys.readouterr().out
    for page in ("report", "replay"):
        assert f"{page}   none: RuntimeError: of a library that draws" in output


def test_report_prints_the_table_again(result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (result / "report.html").unlink()
    assert main(["report", str(result)]) == 0
    output = capsys.readouterr().out
    assert "paper, Table I" in output
    assert "Learning cuts the mean peak error, from the contact on, by" in output
    assert (result / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize(
    "words",
    [
        *("report RESULT", "report RESULT RESULT", "explain RESULT --draws 2", "parity ROBOT"),
        *("gaits show", "gaits show 0.3", "list controllers", "list scenarios", "list metrics"),
    ],
)
def test_a_narrow_terminal_is_not_overrun(
    words: str,
    result: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("pronk_pin.cli.comparison._print_pages", lambda *_: None)
    robot = tmp_path / "robot.xml"
    robot.write_text(mujoco_spec(load_robot()).to_xml())
    places = {"RESULT": str(result), "ROBOT": str(robot)}
    assert main([places.get(word, word) for word in words.split()]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 1
    assert not [line for line in lines if len(line) > 80 and str(tmp_path.parent) not in line]


def test_compare_again_takes_what_is_there(
    result: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = sorted((result / "strides").iterdir())
    before = [file.stat().st_mtime_ns for file in files]
    controllers = ["--controllers", "pd", "ilc", "library"]
    assert main(["compare", *SHORT, *controllers, "--folder", str(result)]) == 0
    assert [file.stat().st_mtime_ns for file in files] == before


def first_film(page: Path) -> dict[str, Any]:
    """The scene that a page begins with, its arrays as their shapes and ranges."""
    text = page.read_text()
    films = json.loads(re.search(r"const films = (\{.*?\});\n", text, re.DOTALL)[1])  # type: ignore[index]
    data = zlib.decompress(base64.b64decode(next(iter(films.values()))))
    length = int.from_bytes(data[:4], "little")
    return dict(json.loads(data[4 : 4 + length]))


@pytest.mark.parametrize(
    ("arguments", "title", "speed", "tracks"),
    [
        ("RESULT --speed 0.4 --controller pd", "A1 pronking at 0.4 m/s", 0.4, ["PD"]),
        ("RESULT --speed 0.0 --controller ilc", "A1 pronking at 0 m/s", 0.0, ["ILC"]),
        ("--speed -0.25", "A1 pronk", -0.25, []),
        ("--robot solo12 --speed 0.2", "SOLO12 pronk", 0.2, []),
    ],
)
def test_view_writes_a_result_or_a_gait_to_a_file(
    arguments: str, title: str, speed: float, tracks: list[str], result: Path, tmp_path: Path
) -> None:
    """Read back: the robot, how fast it goes, and beside what."""
    path = tmp_path / "page.html"
    words = arguments.replace("RESULT", str(result)).split()
    assert main(["view", *words, "--html", str(path)]) == 0
    assert path.stat().st_size < 5_000_000
    film = first_film(path)
    assert film["title"] == title
    names = [track["name"] for track in film["tracks"]]
    begins = [name for one in tracks for name in (one, f"reference of {one}")]
    assert names[: len(begins)] == begins  # rivals come after it
    for track in film["tracks"]:
        q = track["q"]
        frames, duration = q["shape"][0], 65534 * film["times"]["step"][0]
        assert frames > 100
        went = 65534 * q["step"][0]  # from its least to its greatest x
        assert went == pytest.approx(abs(speed) * duration, abs=0.16)


def test_gaits_show_proves_every_gait(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gaits", "show"]) == 0
    output = capsys.readouterr().out
    rows = re.findall(r"^ +[+-]\d\.\d\d +0\.340 ", output, flags=re.MULTILINE)
    assert len(rows) == 14
    assert "FAILED" not in output
    assert main(["gaits", "show", "-0.3"]) == 0
    assert "friction cone" in capsys.readouterr().out
    assert main(["gaits", "show", "0.3", "--gait", "bound"]) == 0
    assert "rear stance: 0.100 s on RL, RR" in capsys.readouterr().out
    assert main(["gaits", "show", "0.35", "--apex", "0.335"]) == 0
    assert "+0.35 m/s, apex 0.335 m" in capsys.readouterr().out


def test_gaits_build_makes_a_library_that_show_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "two.npz"
    build = ["gaits", "build", "--speeds", "0.1:0.2:0.1", "--output", str(path), "--workers", "2"]
    assert main(build) == 0
    files = sorted((tmp_path / "two.npz.build").iterdir())
    before = [file.stat().st_mtime_ns for file in files]
    assert len(files) == 2
    assert main(build) == 0
    assert [file.stat().st_mtime_ns for file in files] == before
    assert main(["gaits", "show", "0.2", "--library", str(path)]) == 0
    assert "18-DoF residual" in capsys.readouterr().out


@pytest.mark.parametrize("robot", ROBOTS)
def test_parity_finds_the_same_robot_in_both_engines(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["parity", "--robot", robot, "--states", "20"]) == 0
    output = capsys.readouterr().out
    assert output.endswith("The same robot, to round-off.\n")
    errors = re.findall(r"^  (?:mass|bias|foot).* (\S+e[+-]\d+)$", output, flags=re.MULTILINE)
    assert len(errors) == 3
    assert max(map(float, errors)) < 1e-12


def test_parity_exits_with_1_where_a_model_differs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "robot.xml"
    text = mujoco_spec(load_robot("a1")).to_xml()
    path.write_text(text)
    assert main(["parity", str(path)]) == 0
    path.write_text(text.replace('mass="1.013"', 'mass="1.1"', 1))
    capsys.readouterr()
    assert main(["parity", str(path)]) == 1
    output = capsys.readouterr().out
    assert re.search(r"^mass +FR_thigh_joint +1\.013 +1\.1 +0\.087 +kg$", output, re.MULTILINE)
    assert "1 of " in output
    assert "torque limits" not in output
    assert main(["parity", str(path), "--full"]) == 1
    assert "torque limits" in capsys.readouterr().out
    assert main(["parity", str(path), "--tolerance", "0.2"]) == 0
    assert main(["parity", str(path), "--robot", "go1"]) == 1
    assert main(["parity", str(load_robot("a1").urdf_path)]) == 0


def test_gaits_plot_draws_the_library(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gaits", "plot", "0.45", "--format", "svg", "--folder", str(tmp_path)]) == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"a1-pronk-{kind}.svg" for kind in ("stride", "side", "diagram")}
    assert "A1 at 0.45 m/s" in (tmp_path / "a1-pronk-side.svg").read_text()
    assert str(tmp_path / "a1-pronk-side.svg") in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["compare", "--controllers", "lqr"], "unknown controller 'lqr'; choose one of: pd, ilc"),
        (["compare", "--scenarios", "moon"], "unknown scenario 'moon'; choose one of: ideal"),
        (["compare", "--robot", "spot"], "unknown robot 'spot'; choose one of: a1"),
        (["compare", "--speeds", "3"], "outside the gait library, which covers -0.5 to 0.8 m/s"),
        (["compare", "--speeds", "0.1", "0.1"], "speeds must name at least one, and none of them"),
        (["compare", "--base", "floating"], "unknown base 'floating'; choose one of: locked"),
        (["compare", "--workers", "0"], "workers=0; give a whole number from 1"),
        (
            ["compare", "--schedule.learning", "-1"],
            "schedule: learning=-1.0; give a number from 0 to 86400 s",
        ),
        (["report", "nowhere"], "not a results folder (no config.json); run 'pronk-pin compare'"),
        (["view", "nowhere.npz"], "missing; make it again with 'pronk-pin gaits"),
        (["view", "--speed", "2"], "outside the gait library"),
        (["view", "--robot", "spot"], "unknown robot 'spot'"),
        (["gaits", "show", "0.9"], "outside the gait library"),
        (["gaits", "build", "--robot", "spot"], "unknown robot 'spot'"),
        (["parity", "nowhere.xml"], "nowhere.xml: missing; give the path of a URDF or an MJCF"),
        (["parity", "--robot", "spot"], "unknown robot 'spot'; choose one of: a1"),
        (["parity", "--states", "0"], "states=0; give a whole number from 1"),
        (["parity", "--seed", "-1"], "seed=-1; give a whole number from 0 on"),
        (["parity", "--tolerance", "-1"], "tolerance=-1.0; give a number from 0 on"),
        (["gaits", "build", "--speeds", "fast"], "speeds 'fast' is neither a number nor a range"),
        (
            ["gaits", "build", "--gait", "hop"],
            "unknown gait 'hop'; choose one of: pronk, bound",
        ),
        (["gaits", "build", "--base", "free"], "unknown base 'free'; choose one of: locked"),
        (["gaits", "build", "--workers", "0"], "workers=0; give a whole number from 1"),
        (["gaits", "show", "0.1", "--apex", "0.5"], "which covers 0.32 to 0.36 m"),
        (
            ["gaits", "show", "--robot", "solo12", "--gait", "bound"],
            "solo12-bound.npz: no such gait library is shipped",
        ),
        (["gaits", "plot", "--format", "bmp"], "choose png, svg, pdf"),
        (["gaits", "plot", "--apex", "0.5"], "no apex 0.5; choose one of: 0.32, 0.34, 0.36"),
    ],
)
def test_bad_input_gets_one_line_with_the_remedy(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if arguments[:2] == ["compare", "--workers"]:
        arguments = [*arguments, *SHORT]
    assert message in failure(arguments, capsys)


def test_studies_of_other_robots_begin_with_speeds_that_their_gaits_cover() -> None:
    assert covered_speeds("bolt", "pronk", (-0.4, -0.2, 0.0, 0.6, 0.8)) == (-0.2, 0.0, 0.6)
    assert covered_speeds("a1", "pronk", (0.6, 0.8)) == (0.6, 0.8)


def test_a_file_in_the_way_of_the_folder_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "file"
    path.write_text("")
    message = failure(["compare", *SHORT, "--folder", str(path / "results")], capsys)
    assert "cannot be written" in message
    assert "--folder" in message


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 cut off"])
def test_a_damaged_gait_library_is_named(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "gaits.npz"
    path.write_bytes(content)
    message = failure(["gaits", "show", "--library", str(path)], capsys)
    assert f"{path}: damaged gait library" in message


def test_a_damaged_result_is_named(result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = result / "strides" / "ilc_nominal_0.nc"
    whole = path.read_bytes()
    try:
        path.write_bytes(whole[: len(whole) // 2])
        message = failure(["view", str(result)], capsys)
        assert "ilc_nominal_0.nc: damaged" in message
        assert "--resimulate' to make it anew" in message
        path.unlink()
        assert "ilc_nominal_0.nc: missing" in failure(["view", str(result)], capsys)
    finally:
        path.write_bytes(whole)


def test_an_unknown_speed_of_a_result_lists_what_there_is(
    result: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = failure(["view", str(result), "--speed", "0.1"], capsys)
    assert "choose one of: 0, 0.4" in message


def test_wrong_usage_exits_with_2() -> None:
    for arguments in ([], ["jump"], ["compare", "--speeds", "fast"], ["report"]):
        with pytest.raises(SystemExit) as exit_:
            main(arguments)
        assert exit_.value.code == 2, arguments


def test_an_option_of_the_last_release_still_works_and_names_its_successor(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(cli.RENAMED, "--apex-height", "--apex")
    shown = []
    for option in (["--apex_height", "0.34"], ["--apex-height=0.34"], ["--apex", "0.34"]):
        assert main(["gaits", "show", *option]) == 0
        output = capsys.readouterr()
        shown.append(output.out)
        warned = "is called --apex now" in output.err
        assert warned == (option[0] != "--apex")
    assert shown[0] == shown[1] == shown[2]


def test_values_that_look_like_an_old_option_stay_as_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(cli.RENAMED, "--tempo", "--speed")
    arguments = ["view", "tempo", "--figure=--tempo", "--tempos", "1"]
    assert cli.todays_options(arguments) == arguments


def test_a_comparison_begins_with_the_speeds_and_the_controllers_of_its_robot() -> None:
    command = cli._parsed(["compare", "--robot", "bolt"])
    assert command.experiment.speeds == (-0.2, 0.0, 0.2, 0.4, 0.6)
    assert command.experiment.controller_names == (
        *("pd", "ilc-paper", "ilc-stance", "ilc", "model", "library"),
    )
    command = cli._parsed(["compare", "--robot=bolt", "--speeds", "0.3", "--controllers", "pd"])
    assert command.experiment.speeds == (0.3,)
    assert command.experiment.controller_names == ("pd",)
    assert cli._parsed(["compare"]).experiment.speeds == SPEEDS
