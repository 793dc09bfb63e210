"""A library is built outward, gait by gait, and goes on where it was."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.errors import ApexOutOfRange, FileProblem, GaitNotFound, InvalidInput
from pronk_pin.gait import ContactPhase, GaitLibrary, build_library, number_range
from pronk_pin.gait.build import _outward
from pronk_pin.robot import Robot

QUICK = (
    ContactPhase("stance", ("front", "rear"), (0.1, 0.3), intervals=4, order=7),
    ContactPhase("flight", (), (0.2, 0.35), intervals=4, order=7),
)
"""A mesh that is quick to solve; its gaits are too rough to pass an audit."""


@pytest.fixture(scope="module")
def built(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> tuple[GaitLibrary, Path]:
    """Two speeds at two heights, and the folder of their files."""
    folder = tmp_path_factory.mktemp("build")
    library = build_library(
        robot,
        [0.2, 0.1],
        apexes=[0.34, 0.33],
        folder=folder,
        path=folder / "gaits.npz",
        progress=False,
        sequence=QUICK,
    )
    return library, folder


def again(robot: Robot, folder: Path, **changes: object) -> GaitLibrary:
    options = {"sequence": QUICK, "progress": False} | changes
    return build_library(robot, [0.1, 0.2], apexes=[0.33, 0.34], folder=folder, **options)


def files(folder: Path) -> dict[str, int]:
    """When each gait's file was written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("speed*.npz")}


def test_every_gait_starts_from_a_neighbour_nearer_to_the_first_one() -> None:
    parents = _outward([-0.2, -0.1, 0.0, 0.1], [0.30, 0.32, 0.34, 0.36], 0.34)
    assert len(parents) == 16
    assert next(iter(parents.items())) == ((0.0, 0.34), None)
    assert parents[-0.2, 0.34] == (-0.1, 0.34)
    assert parents[0.1, 0.34] == (0.0, 0.34)
    assert parents[0.1, 0.30] == (0.1, 0.32)
    done: set[tuple[float, float]] = set()
    for key, parent in parents.items():
        assert parent is None or parent in done
        done.add(key)


def test_a_gait_for_each_speed_at_each_apex(built: tuple[GaitLibrary, Path]) -> None:
    library, folder = built
    assert len(files(folder)) == len(library.gaits) == 4
    np.testing.assert_allclose(library.speeds, [0.1, 0.2])
    np.testing.assert_allclose(library.apexes, [0.33, 0.34])
    assert library.apex == 0.34
    assert [(g.apex, g.speed) for g in library.gaits] == [
        (h, v) for h in (0.33, 0.34) for v in (0.1, 0.2)
    ]
    assert len(library.metadata["work_time"]) == 4


def test_between_speeds_and_heights_the_coefficients_are_interpolated(
    built: tuple[GaitLibrary, Path],
) -> None:
    library, _ = built
    corners = [
        [library.at(speed, apex).stance.joints for speed in (0.1, 0.2)] for apex in (0.33, 0.34)
    ]
    middle = library.at(0.125, 0.338)
    low, high = (0.75 * row[0] + 0.25 * row[1] for row in corners)
    np.testing.assert_allclose(middle.stance.joints, 0.2 * low + 0.8 * high, atol=1e-14)
    assert (middle.speed, middle.apex) == pytest.approx((0.125, 0.338))
    assert library.at(0.1) is library.at(0.1, 0.34)
    with pytest.raises(ApexOutOfRange, match=r"covers 0.33 to 0.34 m.*build --apex"):
        library.at(0.1, 0.35)


def test_one_apex_of_a_library_is_a_library(built: tuple[GaitLibrary, Path]) -> None:
    library, _ = built
    part = library.at_apex(0.33)
    assert part.apex == 0.33
    assert part.gaits == library.gaits[:2]
    assert part.metadata["cost"] == library.metadata["cost"][:2]
    with pytest.raises(InvalidInput, match=r"no apex 0.4; choose one of: 0.33, 0.34"):
        library.at_apex(0.4)


def test_a_gait_that_is_missing_is_solved_and_no_other(
    built: tuple[GaitLibrary, Path], robot: Robot
) -> None:
    library, folder = built
    before = files(folder)
    missing = sorted(before)[1]
    (folder / missing).unlink()
    completed = again(robot, folder)
    after = files(folder)
    assert set(after) == set(before)
    assert {name for name in after if after[name] != before[name]} == {missing}
    for mine, theirs in zip(completed.gaits, library.gaits, strict=True):
        np.testing.assert_allclose(mine.stance.joints, theirs.stance.joints, atol=1e-6)


def test_a_damaged_gait_is_named(built: tuple[GaitLibrary, Path], robot: Robot) -> None:
    _, folder = built
    path = next(folder.glob("speed+0.200_apex0.3400.npz"))
    whole = path.read_bytes()
    for content in (b"", whole[: len(whole) // 2], whole[:-30] + bytes(30)):
        path.write_bytes(content)
        with pytest.raises(FileProblem, match=rf"{re.escape(path.name)}: damaged gait .*delete it"):
            again(robot, folder)
    path.write_bytes(whole)


def test_gaits_of_another_problem_are_not_mixed(
    built: tuple[GaitLibrary, Path], robot: Robot
) -> None:
    _, folder = built
    with pytest.raises(FileProblem, match=r"a gait of another problem .*another folder"):
        again(robot, folder, friction=0.5)


def test_a_library_of_rough_gaits_is_refused(built: tuple[GaitLibrary, Path]) -> None:
    _, folder = built
    with pytest.raises(FileProblem, match=r"fails its audit \(.*stance drift.*gaits show"):
        GaitLibrary.load(folder / "gaits.npz")
    assert GaitLibrary.load(folder / "gaits.npz", audited=False).audit


def test_a_library_of_another_urdf_is_refused(
    built: tuple[GaitLibrary, Path], robot: Robot, tmp_path: Path
) -> None:
    library, _ = built
    changed = dataclasses.replace(library, metadata={**library.metadata, "urdf_sha256": "abc"})
    path = changed.save(tmp_path / "other.npz")
    with pytest.raises(FileProblem, match=r"another model of a1: SHA-256 of its URDF abc"):
        GaitLibrary.load(path, audited=False)
    with pytest.raises(FileProblem, match="gaits of a1, not of go2"):
        GaitLibrary.load(path, robot=dataclasses.replace(robot, spec=_named(robot, "go2")))


def _named(robot: Robot, name: str):
    return dataclasses.replace(robot.spec, name=name)


def test_a_gait_that_is_not_found_costs_no_other(robot: Robot, tmp_path: Path) -> None:
    with pytest.raises(GaitNotFound, match=r"apex 0.34 m; the other 1 gaits are in") as caught:
        build_library(robot, [0.0, 6.0], folder=tmp_path, progress=False, sequence=QUICK)
    assert caught.value.speed == 6.0
    assert caught.value.conflicts
    assert len(files(tmp_path)) == 1


@pytest.mark.parametrize(
    ("words", "numbers"),
    [
        (["0.1", "-0.2"], (-0.2, 0.1)),
        (["-0.5:0.8:0.1"], tuple(k / 10 for k in range(-5, 9))),
        (["0:0.25:0.1", "0.1"], (0.0, 0.1, 0.2)),
        ([], ()),
    ],
)
def test_numbers_and_ranges(words: list[str], numbers: tuple[float, ...]) -> None:
    assert number_range("speeds", words) == pytest.approx(numbers)


@pytest.mark.parametrize("word", ["fast", "0:1", "1:0:0.1", "0:1:0", "nan", "0:inf:1", ""])
def test_what_is_no_range_is_named(word: str) -> None:
    with pytest.raises(InvalidInput, match=f"speeds '{word}' is neither a number nor a range"):
        number_range("speeds", [word])
