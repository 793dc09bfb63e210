"""How fast the comparison loop is, beside MuJoCo alone: `python benchmarks/throughput.py`.

In one run: the whole loop (control, learning and logging) on n robots, then `mujoco.rollout`
playing the recorded controls from the same states on as many threads: the physical limit.
`--ticks` measures the loop that computes the feedback tick by tick instead; `--command` that of
robots whose speed is commanded and changes all the time, so that every stride has another gait.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.compare.world import Motion
from pronk_pin.control import SpeedCommand, SpeedProfile, load_controller
from pronk_pin.gait import load_library

SECONDS = 20.0
"""Half as long as the comparison, so that what is kept of its last strides counts double."""
CASES = ((1, 1), (14, 1), (56, 1), (56, 2), (224, 2))
"""Robots and threads."""
CHUNK = 40
"""Ticks that the ceiling plays in one go; longer, and it could drift into falls."""
REPEATS = 3


class Pieces(NamedTuple):
    """What was played, cut into pieces of equal length."""

    states: list[np.ndarray]
    controls: list[np.ndarray]


def build(n: int, threads: int, *, chunked: bool, commanded: bool) -> Simulation:
    """n robots that learn half of the time."""
    robot, library, spec = load_robot("a1"), load_library("a1"), load_controller("ilc")
    speeds = np.linspace(-0.5, 0.8, n)
    command = None
    if commanded:  # each goes from its speed to the opposite one, and back
        spec = replace(spec, guard=None)
        ramps = (
            SpeedProfile((0.0, SECONDS / 2, SECONDS), (there, 0.3 - there, there))
            for there in speeds.tolist()
        )
        command = SpeedCommand(list(ramps), library)
    return Simulation(
        robot,
        [library.at(speed) for speed in speeds] if command is None else command.first_gaits,
        spec,
        load_scenario("nominal"),
        schedule=Schedule(startup=0.1, baseline=SECONDS / 2, learning=SECONDS / 2),
        rng=np.random.default_rng(0),
        chunked=chunked,
        threads=threads,
        command=command,
    )


def clock(threads: int) -> float:
    """Time [s]: of one thread the processor's, as the machine may be shared."""
    return time.process_time() if threads == 1 else time.perf_counter()


def loop(n: int, threads: int, *, chunked: bool, commanded: bool) -> float:
    """Robot-steps per second of the loop."""
    simulation = build(n, threads, chunked=chunked, commanded=commanded)
    began = clock(threads)
    log = simulation.run()
    elapsed = clock(threads) - began
    return float(np.nansum(log["duration"])) / 0.001 / elapsed


def record(n: int, *, commanded: bool) -> tuple[Simulation, Pieces]:
    """States and controls that the loop goes through."""
    simulation, pieces = build(n, 1, chunked=True, commanded=commanded), Pieces([], [])
    play, advance = simulation.world.play, simulation.world.advance
    told = [np.zeros(0)]

    def remember(rows: np.ndarray, control: np.ndarray) -> Motion:
        told[0] = control
        return play(rows, control)

    def cut(rows: np.ndarray, motion: Motion, ticks: np.ndarray) -> None:
        for begin in range(0, int(ticks.min()) - CHUNK + 1, CHUNK):
            pieces.states.append(motion.path[:, begin])
            pieces.controls.append(told[0][:, begin : begin + CHUNK])
        advance(rows, motion, ticks)

    simulation.world.play, simulation.world.advance = remember, cut  # type: ignore[method-assign]
    simulation.run()
    return simulation, pieces


def ceiling(simulation: Simulation, pieces: Pieces, threads: int) -> float:
    """Robot-steps per second of `mujoco.rollout` on the same states and controls."""
    model = simulation.world.model
    ids = [model.actuator(name).id for name in simulation.world.robot.joint_names]
    states = np.concatenate(pieces.states)
    control = np.zeros((len(states), CHUNK, model.nu))
    control[..., ids] = np.concatenate(pieces.controls)
    data = [mujoco.MjData(model) for _ in range(threads)]
    with mujoco.rollout.Rollout(nthread=threads if threads > 1 else 0) as pool:
        began = clock(threads)
        pool.rollout(model, data, states, control)
        return len(states) * CHUNK / (clock(threads) - began)


def main() -> None:
    """Print the ratio for a few sizes of the batch."""
    chunked, commanded = "--ticks" not in sys.argv[1:], "--command" in sys.argv[1:]
    print(f"{'robots':>6} {'threads':>7} {'loop':>10} {'rollout':>10} {'ratio':>6}   robot-steps/s")
    for n, threads in CASES:
        simulation, pieces = record(n, commanded=commanded)
        # Side by side and repeated, since the machine may be shared.
        pairs = [
            (
                loop(n, threads, chunked=chunked, commanded=commanded),
                ceiling(simulation, pieces, threads),
            )
            for _ in range(REPEATS)
        ]
        ratio = np.median([speed / limit for speed, limit in pairs])
        speed, limit = np.median(pairs, axis=0)
        print(f"{n:>6} {threads:>7} {speed:>10,.0f} {limit:>10,.0f} {ratio:>6.2f}")


if __name__ == "__main__":
    main()
