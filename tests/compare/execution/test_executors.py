"""The same files to the bit, whoever makes them and however often they are killed."""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.execution.executors import connect
from pronk_pin.errors import ExecutorUnavailable, FileProblem, InvalidInput, WorkerLost

EXPERIMENT = Experiment(
    speeds=(0.0, 0.4),
    controllers=("pd", "ilc", "library"),
    seeds=(0, 3),
    schedule=Schedule(startup=0.1, baseline=1.0, learning=1.0),
)
COMMAND = """
import sys
import textwrap
from pathlib import Path
from tests.compare.execution.test_executors import EXPERIMENT
from pronk_pin.compare import run_experiment
if __name__ == "__main__":
    run_experiment(EXPERIMENT, Path(sys.argv[1]), workers=int(sys.argv[2]), progress=False)
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The experiment, run by one process without disturbance."""
    folder = tmp_path_factory.mktemp("alone") / "result"
    return run_experiment(EXPERIMENT, folder, workers=1, progress=False)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file but the record of who made it and when."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "provenance.json"
    }


def begin(folder: Path, *, workers: int) -> subprocess.Popen[bytes]:
    """The experiment in a process of its own that can be killed."""
    root = str(Path(__file__).parents[3])
    environment = {**os.environ, "PYTHONPATH": root}
    return subprocess.Popen(
        [sys.executable, "-c", COMMAND, str(folder), str(workers)], cwd=root, env=environment
    )


@pytest.mark.parametrize("workers", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_any_number_of_processes_gives_the_same_files(
    alone: Results, tmp_path: Path, workers: int
) -> None:
    made = run_experiment(EXPERIMENT, tmp_path / "new", workers=workers, progress=False)
    assert contents(made.folder) == contents(alone.folder)
    assert made.provenance["runs"][0]["executor"] == f"{workers} processes"


def test_threads_take_turns_and_give_the_same_files(alone: Results, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as threads:
        made = run_experiment(EXPERIMENT, tmp_path / "new", executor=threads, progress=False)
    assert contents(made.folder) == contents(alone.folder)


def kill_a_worker(after: float) -> threading.Thread:
    """Kill one of this process's workers after some seconds."""

    def kill() -> None:
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            workers = multiprocessing.active_children()
            if workers:
                time.sleep(after)
                workers[0].kill()
                return
            time.sleep(0.05)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


def test_a_worker_that_is_killed_is_replaced_and_nothing_is_lost(
    alone: Results, tmp_path: Path
) -> None:
    killer = kill_a_worker(after=4.0)
    made = run_experiment(EXPERIMENT, tmp_path / "new", workers=2, progress=False)
    killer.join()
    assert contents(made.folder) == contents(alone.folder)


class Broken(Executor):
    """An executor whose workers always die."""

    def __init__(self) -> None:
        self.calls = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.calls += 1
        future: Future[Any] = Future()
        future.set_exception(BrokenProcessPool("gone"))
        return future


def test_workers_that_die_again_and_again_end_the_run_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(WorkerLost) as caught:
        run_experiment(EXPERIMENT, tmp_path / "new", executor=Broken(), progress=False)
    assert str(caught.value).endswith(f"'--folder {tmp_path / 'new'} --workers 1' to complete it")


_SCRIPTS = {
    "run_experiment": """
        from pronk_pin.compare import Experiment, Schedule, run_experiment
        short = Schedule(baseline=0.5, learning=0.5)
        made = Experiment(speeds=(0.0,), controllers=("pd", "model"), schedule=short)
        run_experiment(made, "results", workers=2, progress=False)
    """,
    "build_library": """
        from pronk_pin.gait import build_library
        from pronk_pin.robot import load_robot
        build_library(load_robot("a1"), (0.0, 0.1), workers=2, progress=False)
    """,
}


@pytest.mark.parametrize("name", _SCRIPTS)
def test_a_script_whose_main_code_is_not_guarded_is_told_so(name: str, tmp_path: Path) -> None:
    script = tmp_path / "mine.py"
    script.write_text(textwrap.dedent(_SCRIPTS[name]))
    ended = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert ended.stderr.count("Traceback") <= 2  # the error, and what came before it
    assert "guard your script with `if __name__ == '__main__':`" in ended.stderr.splitlines()[-1]
    assert not (tmp_path / "results").exists()


def test_a_class_that_workers_do_not_find_in_the_script_is_named_as_a_cause(tmp_path: Path) -> None:
    script = tmp_path / "mine.py"
    script.write_text(
        textwrap.dedent(
            """
            if __name__ == "__main__":
                from pronk_pin.compare import Experiment, Schedule, run_experiment
                from pronk_pin.compare.execution import run
                from pronk_pin.control import ControllerSpec
                run.MAX_RETRIES = 1
                class Law:
                    def update(self, record):
                        return record.feedforward
                short = Schedule(baseline=0.5, learning=0.5)
                mine = ControllerSpec("mine", law=Law())
                made = Experiment(speeds=(0.0,), controllers=("pd", mine), schedule=short)
                run_experiment(made, "results", workers=2, progress=False)
            """
        )
    )
    ended = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "did not find a class or function of the script" in ended.stderr.splitlines()[-1]


class Inline(Executor):
    """Does the work at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def test_what_was_finished_before_the_disk_was_full_is_kept(
    alone: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, replace = tmp_path / "new", Path.replace

    def fill(self: Path, target: Path) -> Path:
        if target.name == "ilc_nominal_3.nc":
            raise OSError(28, "No space left on device")
        return replace(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", fill)
        with pytest.raises(FileProblem, match=r"No space left on device\); make room, and run"):
            run_experiment(EXPERIMENT, folder, executor=Inline(), progress=False)
    kept = contents(folder)
    assert "strides/ilc_nominal_0.nc" in kept
    del kept["manifest.json"]  # which has announced what there was no room for
    assert kept.items() <= contents(alone.folder).items()
    run_experiment(EXPERIMENT, folder, executor=Inline(), progress=False)
    assert contents(folder) == contents(alone.folder)


def test_a_run_that_is_killed_amid_its_work_and_taken_up_again_gives_the_same_files(
    alone: Results, tmp_path: Path
) -> None:
    """Killed as soon as the first strides are there, and taken up by another process."""
    folder = tmp_path / "killed"
    process = begin(folder, workers=2)
    deadline = time.monotonic() + 120.0
    while not list(folder.glob("strides/*.nc")) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert process.poll() is None
    process.kill()
    process.wait()
    assert contents(folder) != contents(alone.folder)
    run_experiment(EXPERIMENT, folder, workers=1, progress=False)
    assert contents(folder) == contents(alone.folder)


def killed_and_resumed(folder: Path, rng: random.Random, times: int, *, workers: int) -> int:
    """Run with that many kills at random moments, then to the end; how many kills hit a run."""
    hits, latest = 0, 6.0
    for _ in range(times):
        process = begin(folder, workers=workers)
        try:
            process.wait(timeout=rng.uniform(1.0, latest))
        except subprocess.TimeoutExpired:
            process.kill()
            hits += 1
        process.wait()
        if process.returncode == 0:
            if hits:
                break
            shutil.rmtree(folder)  # it was faster: once more, and sooner
            latest *= 0.5
    end = begin(folder, workers=workers)
    assert end.wait(timeout=300) == 0
    return hits


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_run_that_is_killed_at_random_moments_and_taken_up_again_gives_the_same_files(
    alone: Results, tmp_path: Path, workers: int
) -> None:
    folder = tmp_path / "killed"
    assert killed_and_resumed(folder, random.Random(workers), 2, workers=workers) >= 1
    assert contents(folder) == contents(alone.folder)


@pytest.mark.slow
def test_twenty_kills_at_random_moments_leave_no_trace(alone: Results, tmp_path: Path) -> None:
    rng, hits = random.Random(0), 0
    for k in range(40):
        hits += killed_and_resumed(tmp_path / str(k), rng, 3, workers=1 + k % 2)
        assert contents(tmp_path / str(k)) == contents(alone.folder)
        if hits >= 20:
            return
    pytest.fail(f"only {hits} kills hit a run")


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """A dask scheduler with two worker processes, by the addresses that a user would give."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster:
        yield cluster.scheduler_address.replace("tcp://", "dask://")


def test_two_dask_workers_give_the_same_files_as_one_process(
    alone: Results, tmp_path: Path, scheduler: str
) -> None:
    made = run_experiment(EXPERIMENT, tmp_path / "new", executor=scheduler, progress=False)
    assert contents(made.folder) == contents(alone.folder)
    assert made.provenance["runs"][0]["executor"] == f"{scheduler}, 2 workers"


def test_a_dask_worker_that_is_killed_loses_nothing(
    alone: Results, tmp_path: Path, scheduler: str
) -> None:
    with connect(scheduler) as crew:
        pids = list(crew.executor._client.run(os.getpid).values())  # type: ignore[attr-defined]

    def kill() -> None:
        deadline = time.monotonic() + 60.0
        while not list((tmp_path / "new").glob("strides/*.nc")) and time.monotonic() < deadline:
            time.sleep(0.02)
        os.kill(pids[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    made = run_experiment(EXPERIMENT, tmp_path / "new", executor=scheduler, progress=False)
    killer.join()
    assert contents(made.folder) == contents(alone.folder)


@pytest.mark.parametrize("address", ["ray://x:1", "dask://nowhere", "10.0.0.1:8786"])
def test_what_is_no_address_of_a_scheduler_is_refused(address: str) -> None:
    with (
        pytest.raises(InvalidInput, match="is not an address; give dask://HOST:PORT"),
        connect(address),
    ):
        pass


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("pronk_pin.compare.execution.executors._TIMEOUT", 0.5)
    with (
        pytest.raises(
            ExecutorUnavailable,
            match=r"^dask://127.0.0.1:1: no scheduler answers .*'dask scheduler'$",
        ),
        connect("dask://127.0.0.1:1"),
    ):
        pass


def test_without_dask_the_remedy_is_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(ExecutorUnavailable, match=r"install 'pronk-pin\[dask\]'$"),
        connect("dask://127.0.0.1:8786"),
    ):
        pass


def test_workers_with_another_version_are_refused(
    scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.metadata.version", lambda name: "99.0")
    with (
        pytest.raises(ExecutorUnavailable, match=r"has pronk-pin .*, not 99.0; install the same"),
        connect(scheduler),
    ):
        pass
