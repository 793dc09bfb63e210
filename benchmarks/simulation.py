"""How fast the comparison loop is, beside MuJoCo alone: `python benchmarks/simulation.py`.

One run, one thread: first the whole loop (control, learning and logging) on n robots, then
`mujoco.rollout` playing the recorded torques from the same states, which is the physical limit.
"""

from __future__ import annotations

import time

import mujoco
import mujoco.rollout
import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import load_controller
from pronk_pin.gait import load_library

SECONDS = 4.0
CHUNK = 50
"""Steps that the ceiling plays in one go; longer, and torques without feedback drift away."""


def loop(n: int) -> tuple[float, Simulation, np.ndarray, np.ndarray]:
    """Robot-steps per second of the loop, and the states and torques it went through."""
    robot, library = load_robot("a1"), load_library("a1")
    gaits = [library.at(speed) for speed in np.linspace(-0.5, 0.8, n)]
    simulation = Simulation(
        robot,
        gaits,
        load_controller("ilc"),
        load_scenario("nominal"),
        schedule=Schedule(startup=0.0, practice=SECONDS / 2, learning=SECONDS / 2),
        rng=np.random.default_rng(0),
    )
    states: list[np.ndarray] = []
    torques: list[np.ndarray] = []
    step = simulation.world.step

    def recording(tau: np.ndarray) -> None:
        if len(torques) % CHUNK == 0:
            states.append(simulation.world.state)
        torques.append(tau)
        step(tau)

    simulation.world.step = recording  # type: ignore[method-assign]
    began = time.perf_counter()
    simulation.run()
    elapsed = time.perf_counter() - began
    return n * len(torques) / elapsed, simulation, np.stack(states, 1), np.stack(torques, 1)


def ceiling(simulation: Simulation, states: np.ndarray, torques: np.ndarray) -> float:
    """Robot-steps per second of `mujoco.rollout` on the same states and torques.

    Args:
        simulation: For its world.
        states: States at the beginning of each chunk, shape (n, chunks, nstate).
        torques: Torques [N m], shape (n, chunks * CHUNK, 12).
    """
    model = simulation.world.model
    ids = [model.actuator(name).id for name in simulation.world.robot.joint_names]
    control = np.zeros((states.shape[0] * states.shape[1], CHUNK, model.nu))
    control[..., ids] = torques.reshape(-1, CHUNK, 12)
    with mujoco.rollout.Rollout(nthread=0) as pool:
        began = time.perf_counter()
        pool.rollout(model, mujoco.MjData(model), states.reshape(-1, states.shape[-1]), control)
        return control.shape[0] * CHUNK / (time.perf_counter() - began)


def main() -> None:
    """Print the ratio for a few sizes of the batch."""
    print(f"{'robots':>6} {'loop':>10} {'rollout':>10} {'ratio':>6}   (robot-steps/s, one thread)")
    for n in (1, 14, 56):
        speed, simulation, states, torques = loop(n)
        limit = ceiling(simulation, states, torques)
        print(f"{n:>6} {speed:>10,.0f} {limit:>10,.0f} {speed / limit:>6.2f}")


if __name__ == "__main__":
    main()
