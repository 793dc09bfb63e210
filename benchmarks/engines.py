"""What a tick costs in each engine, and beside the engine stepping alone: `python
benchmarks/engines.py`.

In one run, interleaved, one robot standing in the nominal scenario: a stance that servos play in
one go, as on a locked base; tick by tick, as feedback is computed; and the engine's own step in a
loop that does nothing else. Times are the process's own, the least of some, as the machine may be
shared.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mujoco
import mujoco.rollout
import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import World, build_model, load_engine, load_scenario
from pronk_pin.compare.world.drake_world.plant import build_plant
from pronk_pin.control import Gains

TICKS, REPEATS = 160, 12
ROBOT, NOMINAL, GAINS = load_robot("a1"), load_scenario("nominal"), Gains()


def standing(engine: str, base: str, servo: Gains | None) -> World:
    """A robot that stands, or a world in which it would."""
    world = load_engine(engine).world(ROBOT, NOMINAL, 1, base=base, servo=servo)
    world.reset(np.array([[0.0, ROBOT.standing[2]]]), ROBOT.standing[None, 7:])
    return world


def in_one_go(engine: str, base: str) -> Callable[[], None]:
    world, row = standing(engine, base, GAINS), np.arange(1)
    held = GAINS.proportional(12) * ROBOT.standing[7:]
    control = np.tile(held, (1, TICKS, 1))
    return lambda: world.advance(row, world.play(row, control), np.array([TICKS]))


def tick_by_tick(engine: str, base: str) -> Callable[[], None]:
    world = standing(engine, base, GAINS)
    held = GAINS.proportional(12) * ROBOT.standing[None, 7:]

    def run() -> None:
        for _ in range(TICKS):
            world.step(held)

    return run


def alone(engine: str, base: str) -> Callable[[], None]:
    """The engine's step again and again from the state of standing, controls and all as they are.

    For MuJoCo in C, as it can; for Drake in Python, as there is no other way to hand it a state.
    """
    world = standing(engine, base, GAINS)
    held = np.tile(GAINS.proportional(12) * ROBOT.standing[7:], (1, 300, 1))
    row = np.arange(1)
    world.advance(row, world.play(row, held), np.array([300]))
    if engine == "mujoco":
        model = build_model(ROBOT, NOMINAL, base=base, servo=GAINS)
        data, full = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
        data.ctrl[:] = held[0, 0][
            [ROBOT.joint_names.index(model.actuator(k).name) for k in range(12)]
        ]
        mujoco.mj_setState(model, data, world.state[0], full)  # type: ignore[attr-defined]
        return lambda: mujoco.mj_step(model, data, TICKS)
    whole = build_plant(ROBOT, NOMINAL, base=base, approximation="sap")
    plant, (root, context) = whole.plant, whole.context()
    port = plant.get_desired_state_input_port(
        plant.GetJointByName(ROBOT.joint_names[0]).model_instance()
    )
    port.FixValue(context, np.zeros(port.size()))
    applied = np.zeros(plant.num_velocities())
    applied[whole.rates] = GAINS.feedback(
        ROBOT.standing[7:] - world.joints[0], -world.joint_rates[0]
    )
    plant.get_applied_generalized_force_input_port().FixValue(context, applied)
    after, state = plant.AllocateDiscreteVariables(), world.state[0, 1:]  # type: ignore[attr-defined]

    def run() -> None:
        assert root is not None  # owns the context
        for _ in range(TICKS):
            context.SetDiscreteState(state)
            plant.CalcForcedDiscreteVariableUpdate(context, after)

    return run


def main() -> None:
    ways = {"in one go": in_one_go, "tick by tick": tick_by_tick, "engine alone": alone}
    cases = {
        (engine, base, way): run(engine, base)
        for engine in ("mujoco", "drake")
        for base in ("locked", "free")
        for way, run in ways.items()
    }
    spent = dict.fromkeys(cases, np.inf)
    for _ in range(REPEATS):
        for case, run in cases.items():
            start = time.process_time()
            run()
            spent[case] = min(spent[case], time.process_time() - start)
    print(f"{'engine':8s}{'base':8s}" + "".join(f"{way:>22s}" for way in ways))
    for engine in ("mujoco", "drake"):
        for base in ("locked", "free"):
            own = spent[engine, base, "engine alone"]
            cells = (spent[engine, base, way] for way in ways)
            row = "".join(f"{1e6 * cell / TICKS:12.1f} us {cell / own:5.2f} x" for cell in cells)
            print(f"{engine:8s}{base:8s}{row}")


if __name__ == "__main__":
    main()
