"""A program that is asked to end leaves nothing behind, and a killed one leaves no workers."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pronk_pin import _workers
from pronk_pin._workers import heeding_signals

ROOT = Path(__file__).parents[1]
COMPARE = ["compare", "--workers", "2", "--controllers", "pd", "ilc", "library"]
BUILD = ["gaits", "build", "--speeds", "-0.5:0.8:0.05", "--output", "gaits.npz"]

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks into /proc")


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Begin a command in a process, folder and TMPDIR of its own."""
    (tmp_path / "tmp").mkdir()
    (tmp_path / "work").mkdir()
    begun = []

    def start(*words: str, **variables: str) -> subprocess.Popen[str]:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "tmp")}
        environment |= variables
        process = subprocess.Popen(
            [sys.executable, "-m", "pronk_pin", *words],
            cwd=tmp_path / "work",
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        begun.append(process)
        return process

    yield start
    for process in begun:
        process.kill()
        process.wait()
        assert process.stderr is not None
        process.stderr.close()


def parents() -> dict[int, int]:
    """The parent of every process that runs."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
            if state != "Z":
                found[int(folder.name)] = int(parent)
    return found


def workers(process: subprocess.Popen[str]) -> set[int]:
    """Children that multiprocessing has begun."""
    found = set()
    for child, parent in parents().items():
        with contextlib.suppress(OSError):
            if (
                parent == process.pid
                and b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()
            ):
                found.add(child)
    return found


def wait_for(condition: Callable[[], object], seconds: float) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def assert_ends_clean(process: subprocess.Popen[str], folder: Path, number: signal.Signals) -> None:
    children = workers(process)
    process.send_signal(number)
    process.send_signal(number)  # as `timeout` does
    _, told = process.communicate(timeout=20)
    assert process.returncode == 128 + number
    assert told.splitlines()[-1] == f"pronk-pin: ended by {number.name}"
    assert "Traceback" not in told
    assert not list((folder / "tmp").iterdir())
    assert not list((folder / "work").rglob("*.partial"))
    assert not children & parents().keys()


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.slow)]
)
def test_a_comparison_that_is_asked_to_end_leaves_no_temporary_file_and_no_worker(
    begin: Callable[..., subprocess.Popen[str]], tmp_path: Path, number: signal.Signals
) -> None:
    process = begin(*COMPARE)
    # The workers' own temporary files are in the folder that the parent made.
    wait_for(lambda: len(workers(process)) == 2, 30.0)
    wait_for(lambda: list((tmp_path / "tmp").iterdir()), 10.0)
    time.sleep(1.0 if number == signal.SIGTERM else 4.0)
    assert_ends_clean(process, tmp_path, number)


@pytest.mark.parametrize("count", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_a_build_of_gaits_that_is_asked_to_end_leaves_nothing(
    begin: Callable[..., subprocess.Popen[str]], tmp_path: Path, count: str
) -> None:
    process = begin(*BUILD, "--workers", count)
    wait_for(lambda: list((tmp_path / "work").rglob("*.npz")), 60.0)
    time.sleep(0.5)  # amid the solver, for one process
    assert_ends_clean(process, tmp_path, signal.SIGTERM)


def test_a_signal_that_a_solver_takes_for_a_failure_of_its_own_is_sent_again() -> None:
    came: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: came.append(number))
    try:
        with heeding_signals():
            with contextlib.suppress(KeyboardInterrupt):  # as CasADi does
                signal.raise_signal(signal.SIGTERM)
            assert not came
        assert came == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_film_that_is_asked_to_end_ends_its_browser_and_leaves_nothing(
    begin: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    browser = tmp_path / "browser"
    browser.write_text("#!/bin/sh\nexec sleep 1000\n")  # one that never answers
    browser.chmod(0o755)
    process = begin("view", "--gif", "film.gif", PRONK_PIN_BROWSER=str(browser))

    def asleep() -> set[int]:
        return {child for child, parent in parents().items() if parent == process.pid}

    # The page, and the browser's profile.
    wait_for(lambda: len(list((tmp_path / "tmp").iterdir())) == 2 and asleep(), 30.0)
    time.sleep(0.3)
    children = asleep()
    assert_ends_clean(process, tmp_path, signal.SIGTERM)
    assert not children & parents().keys()


@pytest.mark.parametrize(
    "delay", [0.2, *(pytest.param(delay, marks=pytest.mark.slow) for delay in (0.0, 0.6, 1.5))]
)
def test_workers_end_with_their_parent_while_they_still_import(
    begin: Callable[..., subprocess.Popen[str]], delay: float
) -> None:
    process = begin(*COMPARE)
    wait_for(lambda: len(workers(process)) == 2, 30.0)
    time.sleep(delay)
    children = workers(process)
    process.kill()
    wait_for(lambda: not children & parents().keys(), 2.0)


def test_a_worker_watches_its_parent_before_it_imports_anything_of_weight() -> None:
    code = "import sys, pronk_pin.__main__, pronk_pin._workers; print(*sys.modules)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    said = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)
    assert _workers.__name__ in said.split()
    assert not {"numpy", "pinocchio", "mujoco", "tyro", "msgspec"} & set(said.split())
