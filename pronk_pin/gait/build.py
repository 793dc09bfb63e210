"""From speeds and apex heights to a gait library: continuation outward from one gait.

Each gait is a file of its own as soon as it is solved and audited, so that a build which was
interrupted goes on where it was. A gait starts from the solution of its neighbour on the way to the
slowest gait at the home apex; where there is none, or that fails, from a crude guess. Where an
audit finds the mesh or the polynomials too coarse for a robot, all gaits are solved on finer ones.
"""

from __future__ import annotations

import dataclasses
import importlib.metadata
import multiprocessing
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from .._checks import path as known_path
from .._checks import reals, worker_count
from .._typing import Array
from .._workers import begin_worker, leave_main_to_parent, unguarded_script
from ..errors import FileProblem, GaitNotFound, InvalidInput, NoMainGuard, WorkerLost
from ..robot import Base, Robot, RobotSpec, load_robot
from ..storage import clear_partial_files, read_arrays, temporary_folder, write_arrays
from .audit import audit, bezier_orders
from .checks import RESOLUTION
from .library import PER_GAIT, SCHEMA, GaitLibrary, from_arrays, to_arrays
from .optimisation import GaitSolution, SolverState, check_ballistics, optimize_gait
from .problem import GaitProblem
from .style import check_robot, gait_problem, load_style

_PACKAGES = ("casadi", "pin", "numpy", "scipy", "example-robot-data")

_AGAIN = "delete it and run the same command again"

Key = tuple[float, float]
"""Speed and apex of a gait."""


@dataclass(frozen=True, eq=False)
class _Solved:
    """Contents of the file of one gait: a library of one, and the state for a warm start."""

    library: GaitLibrary
    state: SolverState


def build_library(
    robot: Robot,
    speeds: Sequence[float] | Array | None = None,
    *,
    apexes: Sequence[float] | Array | None = None,
    gait: str = "pronk",
    base: Base | None = None,
    path: Path | str | None = None,
    folder: Path | str | None = None,
    workers: int | None = 1,
    progress: bool = True,
    **changes: Any,
) -> GaitLibrary:
    """Optimise and audit a gait for each speed at each apex, on a mesh that is fine enough for all.

    Args:
        robot: The robot.
        speeds: Speeds [m/s], in any order; by default those of the gait's style.
        apexes: Greatest heights of the trunk [m], in any order; by default the style's.
        gait: Name of the style: "pronk", "bound" or "trot".
        base: How the trunk may move; None for the style's own.
        path: Where to save the library; None does not save it.
        folder: Where each gait is kept as soon as it is solved, and taken from if it is there;
            None keeps nothing but the library.
        workers: Processes; None for one for each core. A script that asks for more than one must
            guard its own main code with `if __name__ == "__main__"`.
        progress: Whether to show a progress bar.
        changes: Other attributes of `GaitProblem`; with a `sequence` its mesh is kept.

    Raises:
        InvalidInput: There are no speeds or heights, a height at which the trunk stands, or no
            workers.
        UnknownName: There is no such gait.
        GaitNotFound: A gait was not found, from its neighbour or from the crude guess. Those that
            were found are in the folder.
        FileProblem: A file of the folder is damaged or of another problem, or one cannot be
            written.
        WorkerLost: Workers ended in the middle of their work.
        NoMainGuard: They ended at once, as the script that wants them guards no main code.
    """
    leave_main_to_parent()
    began = time.perf_counter()
    style = load_style(gait)
    check_robot(robot)  # before all else
    apex = style.apex_of(robot)
    speeds = reals("speeds", style.speeds if speeds is None else speeds)
    apexes = reals("apex", (apex,) if apexes is None else apexes)
    if not speeds or not apexes:
        raise InvalidInput("no speeds or no apex to build gaits for; give at least one of each")
    workers = worker_count(workers)
    if path is not None:
        path = known_path("path", path)
    parents = _outward(speeds, apexes, apex, style.start)
    with _folder(folder) as place:
        for mesh in MESHES[:1] if "sequence" in changes else MESHES:
            tasks = {}
            for v, h in parents:
                problem = gait_problem(robot, v, gait=gait, base=base, **{**changes, "apex": h})
                problem, name = mesh.of(problem), f"speed{v:+.3f}_apex{h:.4f}{mesh.suffix}.npz"
                check_ballistics(problem)
                tasks[v, h] = _Task(problem, place / name)
            _solve_all(tasks, parents, workers, progress, keeps=folder is not None)
            solved = {key: _read(task) for key, task in tasks.items()}
            if not any(_too_coarse(each) for each in solved.values()):
                break
    library = _library(robot, gait, solved, tasks, _home(apexes, apex))
    library.metadata["build_time"] = round(time.perf_counter() - began, 2)  # type: ignore[index]
    if path is not None:
        library.save(path)
    return library


class Mesh(NamedTuple):
    """A mesh for the phases of a gait, beside that of its style.

    Attributes:
        intervals: Factor of the numbers of mesh intervals.
        order: What comes on top of the polynomials' order, as a share of it.
        suffix: What the files of its gaits end in.
    """

    intervals: float
    order: float
    suffix: str

    def of(self, problem: GaitProblem) -> GaitProblem:
        """The problem on this mesh."""
        sequence = tuple(
            dataclasses.replace(
                phase,
                intervals=2 * round(self.intervals * phase.intervals / 2),
                order=round((1.0 + self.order) * phase.order),
            )
            for phase in problem.sequence
        )
        return dataclasses.replace(problem, sequence=sequence)


MESHES = (Mesh(1.0, 0.0, ""), Mesh(1.4, 0.35, "_fine"), Mesh(2.2, 0.6, "_finest"))
"""Meshes that are tried in turn, until the audits find nothing too coarse."""


def _too_coarse(solved: _Solved) -> bool:
    """Whether an audit fails by something that a finer mesh may mend."""
    return any(check.name in RESOLUTION for each in solved.library.audit for check in each.failures)


@dataclass(frozen=True)
class _Task:
    """A gait to be solved, and the file it goes to."""

    problem: GaitProblem
    path: Path


@contextmanager
def _folder(folder: Path | str | None) -> Iterator[Path]:
    if folder is not None:
        folder = known_path("folder", folder)
        clear_partial_files(folder)
        try:
            yield folder
        except BaseException:
            with suppress(FileProblem):  # workers that were ended leave half of a file
                clear_partial_files(folder)
            raise
        return
    with temporary_folder() as temporary:
        yield temporary


def _home(apexes: Sequence[float] | Array, desired: float) -> float:
    """The apex at which a build begins."""
    return float(min(apexes, key=lambda apex: (abs(apex - desired), apex)))


def _outward(
    speeds: Sequence[float] | Array,
    apexes: Sequence[float] | Array,
    desired: float,
    start: float = 0.0,
) -> dict[Key, Key | None]:
    """Order of continuation: each gait with the neighbour that it starts from, or None.

    Along the speeds at the home apex, then along the heights; neighbours come first.
    """
    rows = sorted({float(speed) + 0.0 for speed in speeds}, key=lambda v: (abs(v - start), v))
    home = _home(apexes, desired)
    columns = sorted({float(apex) for apex in apexes}, key=lambda h: (abs(h - home), h))
    parents: dict[Key, Key | None] = {}
    for apex in columns:
        for speed in rows:
            if apex == home:
                nearer = [(v, h) for v, h in parents if h == home]
                parent = min(nearer, key=lambda key: abs(key[0] - speed), default=None)
            else:
                heights = [h for v, h in parents if v == speed]
                parent = (speed, min(heights, key=lambda h: abs(h - apex)))
            parents[speed, apex] = parent
    return parents


def _solve_all(
    tasks: Mapping[Key, _Task],
    parents: Mapping[Key, Key | None],
    workers: int,
    progress: bool,
    *,
    keeps: bool,
) -> None:
    """Solve the gaits without a file; the others' files are checked first, for early errors."""
    done = {key for key, task in tasks.items() if task.path.exists()}
    for key in done:
        _read(tasks[key])
    waiting = [key for key in parents if key not in done]
    robot = next(iter(tasks.values())).problem.robot
    # Processes load the robot by its names; one that was changed afterwards stays in this one.
    if robot is not load_robot(robot.spec):
        workers = 1
    failed: dict[Key, GaitNotFound] = {}
    bar = tqdm(
        total=len(tasks),
        initial=len(done),
        desc="gaits",
        unit="gait",
        mininterval=0.5 if sys.stderr.isatty() else 10.0,
        disable=not progress or not waiting,
    )
    with bar:
        if workers == 1 or len(waiting) <= 1:
            for key in waiting:
                try:
                    _work(tasks[key], _start(key, parents, tasks))
                except GaitNotFound as error:
                    failed[key] = error
                bar.update()
        else:
            try:
                _in_processes(
                    waiting, done, parents, tasks, min(workers, len(waiting)), bar, failed
                )
            except BrokenProcessPool as error:
                if script := unguarded_script():
                    raise NoMainGuard(script) from error
                place = next(iter(tasks.values())).path.parent
                raise WorkerLost(place) from error
    if failed:
        (speed, apex), first = next(iter(failed.items()))
        others = ", ".join(f"{v:g} m/s at {h:g} m" for v, h in list(failed)[1:])
        note = f"apex {apex:g} m" + (f"; nor at {others}" if others else "")
        if keeps and len(failed) < len(tasks):
            place = tasks[speed, apex].path.parent
            note += f"; the other {len(tasks) - len(failed)} gaits are in {place}"
        raise first.with_note(note)


def _start(key: Key, parents: Mapping[Key, Key | None], tasks: Mapping[Key, _Task]) -> Path | None:
    """The file of the neighbour to start from, if that was solved."""
    parent = parents[key]
    return tasks[parent].path if parent is not None and tasks[parent].path.exists() else None


def _in_processes(
    waiting: list[Key],
    done: set[Key],
    parents: Mapping[Key, Key | None],
    tasks: Mapping[Key, _Task],
    workers: int,
    bar: tqdm[Any],
    failed: dict[Key, GaitNotFound],
) -> None:
    """Gaits in a pool of processes; each waits for the neighbour that it starts from."""
    context = multiprocessing.get_context("spawn")
    running: dict[Future[None], Key] = {}
    with (
        temporary_folder() as folder,
        ProcessPoolExecutor(
            workers, context, initializer=begin_worker, initargs=(str(folder),)
        ) as pool,
    ):
        try:
            while waiting or running:
                for key in [k for k in waiting if parents[k] is None or parents[k] in done]:
                    waiting.remove(key)
                    task, robot = tasks[key], tasks[key].problem.robot
                    options = {
                        item.name: getattr(task.problem, item.name)
                        for item in dataclasses.fields(GaitProblem)
                        if item.name != "robot"
                    }
                    start = _start(key, parents, tasks)
                    running[
                        pool.submit(_work_in_process, robot.spec, options, task.path, start)
                    ] = key
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    key = running.pop(future)
                    try:
                        future.result()
                    except GaitNotFound as error:
                        failed[key] = error
                    done.add(key)
                    bar.update()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()  # what they have not saved is solved again next time
            raise


def _work_in_process(
    spec: RobotSpec, options: Mapping[str, Any], path: Path, start: Path | None
) -> None:
    _work(_Task(GaitProblem(load_robot(spec), **options), path), start)


def _work(task: _Task, start: Path | None) -> None:
    """Solve and audit one gait, and write its file."""
    began = time.perf_counter()
    solution = _solve(task.problem, None if start is None else _read(_Task(task.problem, start)))
    audit_result = audit(solution)
    metadata = {
        "problem": task.problem.options(),
        "cost": [solution.cost],
        "iterations": [solution.iterations],
        "solve_time": [round(solution.solve_time, 4)],
        "work_time": [round(time.perf_counter() - began, 2)],
        "bezier_orders": {
            name: [list(loss) for loss in losses]
            for name, losses in bezier_orders(solution).items()
        },
    }
    state = solution.state
    arrays = to_arrays(GaitLibrary((solution.gait,), metadata, (audit_result,)))
    arrays |= {"x": state.x, "lam_x": state.lam_x, "lam_g": state.lam_g}
    arrays["fingerprint"] = np.array(task.problem.fingerprint())
    write_arrays(task.path, arrays, schema=SCHEMA, remedy="choose another folder")


def _solve(problem: GaitProblem, neighbour: _Solved | None) -> GaitSolution:
    """Solve from the neighbour's solution; where there is none, or that fails, from the guess."""
    if neighbour is not None:
        try:
            return optimize_gait(problem, initial=neighbour.state, diagnose=False)
        except GaitNotFound:
            pass
    return optimize_gait(problem)


def _read(task: _Task) -> _Solved:
    """The file of one gait.

    Raises:
        FileProblem: It is damaged, or holds a gait of another problem.
    """
    arrays = read_arrays(task.path, _AGAIN, what="gait", schema=SCHEMA)
    if arrays.text("fingerprint") != task.problem.fingerprint():
        raise FileProblem(
            task.path,
            "a gait of another problem (robot, base, sequence, bounds or weights)",
            "choose another folder, or delete this one",
        )
    library = from_arrays(arrays)
    state = SolverState(*(arrays.numbers(name, None) for name in ("x", "lam_x", "lam_g")))
    kept = library.metadata
    if (
        len(library.gaits) != 1
        or len(library.audit) != 1
        or not {*PER_GAIT, "bezier_orders"} <= {*kept}
    ):
        raise arrays.damaged("it is not of one gait, with its audit")
    return _Solved(library, state)


def _library(
    robot: Robot,
    gait: str,
    solved: Mapping[Key, _Solved],
    tasks: Mapping[Key, _Task],
    home: float,
) -> GaitLibrary:
    """The gaits of all files, in the order of the library."""
    order = sorted(solved, key=lambda key: (key[1], key[0]))
    parts = [solved[key].library for key in order]
    metadata: dict[str, Any] = {
        "urdf_sha256": robot.sha256,
        "gait": gait,
        "problem": tasks[order[0]].problem.options(),
        "solver": "IPOPT through CasADi, exact derivatives",
        "versions": {name: importlib.metadata.version(name) for name in _PACKAGES},
        "bezier_orders": _worst_orders([part.metadata["bezier_orders"] for part in parts]),
    }
    for name in ("cost", "iterations", "solve_time", "work_time"):
        metadata[name] = [part.metadata[name][0] for part in parts]
    gaits = tuple(part.gaits[0] for part in parts)
    return GaitLibrary(gaits, metadata, tuple(part.audit[0] for part in parts), home)


def _worst_orders(each: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Errors of Bezier polynomials of each order, the worst over the gaits."""
    return {name: np.max([orders[name] for orders in each], axis=0).tolist() for name in each[0]}
