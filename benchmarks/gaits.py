"""How fast and how sure the gait optimisation is: `python benchmarks/gaits.py [--crocoddyl]`.

One core. First the 14 gaits from one crude guess, none from its neighbour; then the library warm,
each from its neighbour; then twenty random starts for each base mode. `--free GAIT` does one gait
on a free trunk instead: from the crude guess, from its neighbour, twenty random starts. With
`--crocoddyl`, which
needs `pip install .[bench]`, the nearest problem that Crocoddyl can state, judged by our audit as
far as it applies: see `benchmarks/gaits_crocoddyl.py`.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from pronk_pin import load_robot
from pronk_pin.errors import GaitNotFound
from pronk_pin.gait import (
    SPEEDS,
    GaitProblem,
    GaitSolution,
    audit,
    gait_problem,
    optimize_gait,
    vertical_hop,
)
from pronk_pin.robot import Robot

STARTS = 20
SAME = 1e-4
"""Relative difference in cost below which two minima are one."""


def cold(robot: Robot) -> list[GaitSolution]:
    """All gaits from the same crude guess."""
    began, solutions = time.perf_counter(), []
    for speed in SPEEDS:
        try:
            solutions.append(optimize_gait(gait_problem(robot, speed), diagnose=False))
        except GaitNotFound as error:
            print(f"  {error}")
    wall = time.perf_counter() - began
    solving = sum(solution.solve_time for solution in solutions)
    iterations = [solution.iterations for solution in solutions]
    print(
        f"cold     {len(solutions)} of {len(SPEEDS)} gaits in {wall:.1f} s, of which solving "
        f"{solving:.1f} s, {np.median(iterations):.0f} iterations a gait"
    )
    return solutions


def warm(robot: Robot) -> None:
    """All gaits outward from the slowest one."""
    began = time.perf_counter()
    solved: dict[float, GaitSolution] = {}
    for speed in sorted(SPEEDS, key=abs):
        nearest = min(solved, key=lambda v: abs(v - speed), default=None)
        start = None if nearest is None else solved[nearest]
        solved[speed] = optimize_gait(gait_problem(robot, speed), initial=start)
    iterations = [solution.iterations for solution in solved.values()]
    print(
        f"warm     {len(solved)} of {len(SPEEDS)} gaits in {time.perf_counter() - began:.1f} s, "
        f"{np.median(iterations):.0f} iterations a gait"
    )


def scattered(problem: GaitProblem, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The crude hop, with everything that it guesses changed at random."""
    guess = vertical_hop(problem)
    for name, values in guess.items():
        key = name.split(".")[-1]
        scale = {"q": 0.1, "v": 0.5, "a": 2.0, "tau": 2.0, "lam": 20.0, "impulse": 0.5}.get(key)
        if scale is None:
            phase = next(p for p in problem.sequence if name == f"{p.name}.duration")
            guess[name] = rng.uniform(*phase.duration, size=1)
            continue
        # One offset for each row: a start is another motion, not noise on this one.
        guess[name] = values + scale * rng.standard_normal(values.shape[-1])
    return guess


def free_trunk(robot: Robot, gait: str, speed: float) -> None:
    """A gait on a free trunk, from the crude guess and then from its neighbour."""
    problem = gait_problem(robot, speed, gait=gait)
    began = time.perf_counter()
    first = optimize_gait(problem, diagnose=False)
    wall = time.perf_counter() - began
    nearby = dataclasses.replace(problem, speed=speed + 0.1)
    optimize_gait(problem, initial=first)  # writes the warm solver
    second = optimize_gait(nearby, initial=first, diagnose=False)
    print(
        f"cold     {gait}, {speed:g} m/s: {first.iterations} iterations, {first.solve_time:.1f} s; "
        f"with its derivatives, which the others share, {wall:.1f} s\n"
        f"warm     {gait}, {nearby.speed:g} m/s from there: {second.iterations} iterations, "
        f"{second.solve_time:.1f} s"
    )
    random_starts(robot, base=None, gait=gait, speed=speed)


def random_starts(
    robot: Robot, *, base: str | None, gait: str = "pronk", speed: float = 0.3
) -> None:
    """How many random starts reach the same minimum, the best one."""
    rng = np.random.default_rng(0)
    problem = gait_problem(robot, speed, base=base, gait=gait)  # type: ignore[arg-type]
    costs, began = [], time.perf_counter()
    for _ in range(STARTS):
        try:
            found = optimize_gait(problem, initial=scattered(problem, rng), diagnose=False)
            costs.append(found.cost)
        except GaitNotFound:
            costs.append(np.inf)
    best = min(costs)
    same = sum(cost < best * (1 + SAME) for cost in costs)
    others = sorted({round(cost, 2) for cost in costs if best * (1 + SAME) <= cost < np.inf})
    print(
        f"random   {gait}, {base or 'free'} base, {speed:g} m/s: "
        f"{same} of {STARTS} reach the same minimum, cost {best:.3f}; others {others}, "
        f"not solved {costs.count(np.inf)}; "
        f"{(time.perf_counter() - began) / STARTS:.1f} s each"
    )


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crocoddyl", action="store_true", help="solve it with Crocoddyl too")
    parser.add_argument("--only-crocoddyl", action="store_true", help="and nothing else")
    parser.add_argument("--free", metavar="GAIT", help="one gait on a free trunk, nothing else")
    parser.add_argument("--speed", type=float, default=0.4, help="its speed [m/s]")
    options = parser.parse_args()
    robot = load_robot("a1")
    if options.free:
        free_trunk(robot, options.free, options.speed)
        return
    if not options.only_crocoddyl:
        solutions = cold(robot)
        warm(robot)
        for solution in solutions:
            found = audit(solution, refine=False)
            if not found.passed:
                print(f"  {solution.problem.speed:+.1f} m/s fails its audit:\n{found.table()}")
        random_starts(robot, base="locked")
        random_starts(robot, base="sagittal")
        random_starts(robot, base="sagittal", gait="bound")
    if options.crocoddyl or options.only_crocoddyl:
        try:
            from gaits_crocoddyl import compare
        except ImportError as error:
            sys.exit(f"{error}; run 'pip install .[bench]'")
        compare(robot)


if __name__ == "__main__":
    main()
