"""Bad input is refused before anything is simulated, in one line that tells parameter and remedy.

Three tables: calls of the library, values that look odd and have to work, and command lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pronk_pin import ModelParameters, PronkError, RobotSpec, load_robot
from pronk_pin import dynamics as dyn
from pronk_pin import kinematics as kin
from pronk_pin.cli import main
from pronk_pin.compare import (
    Experiment,
    MujocoWorld,
    Results,
    Scenario,
    Schedule,
    Sensors,
    SensorSuite,
    Simulation,
    explain,
    load_scenario,
    random_scenarios,
    run_experiment,
)
from pronk_pin.compare.results import make_folder
from pronk_pin.compare.simulation import memory
from pronk_pin.compare.simulation.quantities import STRIDE_QUANTITIES
from pronk_pin.compare.studies.gain_reduction import sweep_gains
from pronk_pin.compare.studies.prediction import simulate_learning
from pronk_pin.compare.studies.reuse.seeding import measure_seeding
from pronk_pin.compare.studies.reuse.transfer import measure_transfers
from pronk_pin.control import (
    AttitudeFilter,
    AttitudeRegulator,
    BalanceSpec,
    ContactDetector,
    Controller,
    ControllerSpec,
    CurrentIterationILC,
    FlightTiming,
    FootPlacement,
    Gains,
    LegAngleRegulator,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    PlantInversionILC,
    StrideRecord,
    StrideSelection,
    TorqueLibrary,
    ZeroPhaseFilter,
    load_controller,
    model_feedforward,
    phase_grid,
)
from pronk_pin.dynamics import energetics
from pronk_pin.gait import (
    ContactPhase,
    Gait,
    GaitLibrary,
    build_library,
    gait_problem,
    load_library,
    number_range,
    optimize_gait,
)
from pronk_pin.inverse_dynamics import feedforward, inverse_dynamics
from pronk_pin.parity import compare_models
from pronk_pin.robot import Robot, conventions
from pronk_pin.viz import Film, Scene, Track, gait_scene, library_menu

any_value: Any = None  # what no type checker may look at
Q, V, TAU, NAN = np.zeros(19), np.zeros(18), np.zeros(12), float("nan")
Q[6] = 1.0


@cache
def a1() -> Robot:
    return load_robot("a1")


@cache
def gait() -> Gait:
    return load_library("a1").at(0.3)


def simulated(**changes: Any) -> Simulation:
    """A simulation that is all right but for the changes."""
    settings: dict[str, Any] = {
        "robot": a1(),
        "gaits": [gait()],
        "spec": load_controller("pd"),
        "scenario": load_scenario("nominal"),
        "schedule": Schedule(baseline=1.0, learning=0.5),
        "rng": np.random.default_rng(0),
    } | changes
    positional = [settings.pop(name) for name in ("robot", "gaits", "spec", "scenario")]
    return Simulation(*positional, **settings)


def taught(answer: Any) -> None:
    """A stride of a robot whose law answers that."""

    class Odd:
        def update(self, record: StrideRecord) -> Any:
            return answer

    Simulation.run(
        simulated(
            spec=ControllerSpec("mine", law=Odd()), schedule=Schedule(baseline=0.0, learning=1.0)
        )
    )


def experiment(**changes: Any) -> Experiment:
    return Experiment(**({"speeds": (0.3,), "controllers": ("pd",)} | changes))


def scenario(**changes: Any) -> Scenario:
    return Scenario("mine", **changes)


def strides_of(controller: str) -> Any:
    """As much of the strides of a simulation as is looked at before its numbers are."""
    import xarray as xr

    return xr.Dataset(attrs={"base": "locked", "robot": "a1", "controller": controller})


CALLS: dict[str, tuple[Callable[[], object], str]] = {
    # Robots
    "robot of nothing": (lambda: load_robot(any_value), "None is nothing; give a RobotSpec, or a"),
    "robot by a number": (lambda: load_robot(3), "robot=3 is an int; give a RobotSpec, or a name"),
    "robot in capitals": (
        lambda: load_robot("A1"),
        "unknown robot 'A1'; choose one of: a1, anymal_c, b1",
    ),
    "robot name of two lines": (lambda: load_robot("a\n1"), "unknown robot 'a 1'; choose one of"),
    "spec name": (lambda: RobotSpec("a/b", "x.urdf"), "name='a/b' cannot be part of the name of"),
    "spec urdf": (lambda: RobotSpec("a", any_value), "urdf=None is nothing; give a text"),
    "spec legs": (lambda: RobotSpec("a", "b", legs="FL"), "legs='FL' is a str; give a sequence"),
    "spec pattern": (
        lambda: RobotSpec("a", "b", foot_pattern="{side}_foot"),
        "foot_pattern='{side}_foot' is not a pattern ('side'); write {leg}",
    ),
    "spec standing": (
        lambda: RobotSpec("a", "b", standing=(0.0, NAN, 0.0)),
        "standing[1]=nan; give a number that is finite",
    ),
    "parameters": (
        lambda: a1().with_parameters({"payload": 3}),
        "parameters={'payload': 3} is a dict; give a ModelParameters",
    ),
    "payload as a text": (
        lambda: ModelParameters(payload="3"),
        "payload='3' is a str; give a number from -1000 to 1000 kg",
    ),
    "damping as a number": (
        lambda: ModelParameters(damping=0.1),
        "damping=0.1 is a float; give numbers in a tuple or a list",
    ),
    "base of two sizes": (
        lambda: a1().q_from_base(np.zeros(2), TAU),
        "have the shapes (2,), (12,) and (); give (..., 3), (..., 12) and (...)",
    ),
    # States and what is made of them
    "energy of a name": (
        lambda: energetics.kinetic_energy("a1", Q, V),
        "robot='a1' is a str; give a Robot, as load_robot() returns it",
    ),
    "numbers as texts": (
        lambda: energetics.potential_energy(a1(), ["0"] * 19),
        "q is not an array of numbers (it holds str values); pass floats",
    ),
    "truth values": (
        lambda: dyn.flight_dynamics(a1(), Q, V, np.zeros(12, dtype=bool)),
        "tau is not an array of numbers (it holds bool values); pass floats",
    ),
    "NaN": (lambda: dyn.mass_matrix(a1(), Q * NAN), "q holds NaN or infinite values; remove them"),
    "mass matrix of a name": (lambda: dyn.mass_matrix("a1", Q), "robot='a1' is a str; give a R"),
    "regeneration": (
        lambda: energetics.cost_of_transport(
            a1(), [0, 1], [Q, Q], [V, V], [TAU, TAU], regeneration=True
        ),
        "regeneration=True is a bool; give a number from 0 to 1",
    ),
    "restitution": (
        lambda: dyn.impact(a1(), Q, V, restitution="0.5"),
        "restitution='0.5' is a str; give a number from 0 to 1",
    ),
    "contact": (
        lambda: dyn.contact_jacobian(a1(), Q, contact=any_value),
        "contact None is nothing; give a name, one of: point, rolling",
    ),
    "feet by index": (
        lambda: dyn.contact_jacobian(a1(), Q, feet=[0]),
        "feet[0]=0 is an int; give a text",
    ),
    "endless simulation": (
        lambda: dyn.simulate_phase(a1(), Q, V, TAU, duration=float("inf")),
        "duration=inf; give a positive number [s]",
    ),
    "samples as a float": (
        lambda: dyn.simulate_phase(a1(), Q, V, TAU, duration=1.0, samples=1e9),
        "samples=1000000000.0 is a float; give a whole number from 2 to 1000000",
    ),
    "friction as a text": (
        lambda: inverse_dynamics(a1(), Q, V, V, friction="0.6"),
        "friction='0.6' is a str; give a positive number",
    ),
    "torque limits": (
        lambda: inverse_dynamics(a1(), Q, V, V, friction=0.6, torque_limits="33"),
        "torque_limits is not an array of numbers",
    ),
    "guide as a text": (
        lambda: inverse_dynamics(a1(), Q, V, V, constraint="y"),
        "constraint='y' is a str; give a sequence in a tuple or a list",
    ),
    "feedforward without a gait": (
        lambda: feedforward(a1(), any_value),
        "gait=None is no Gait; take one of a library",
    ),
    "leg by index": (
        lambda: kin.leg_inverse_kinematics(a1(), np.zeros(3), leg=0),
        "leg 0 is an int; give a name, one of: FL, FR, RL, RR",
    ),
    "a turn of NaN": (lambda: kin.rotate_leg(a1(), TAU, NAN), "delta holds NaN or infinite val"),
    "iterations": (
        lambda: kin.inverse_kinematics(a1(), None, np.zeros((4, 3)), iterations=2.5),
        "iterations=2.5 is a float; give a whole number from 1",
    ),
    "joints as a text": (
        lambda: conventions.to_mujoco(a1(), Q, joints="FL_hip"),
        "joints='FL_hip' is a str; give a sequence",
    ),
    "parity states": (lambda: compare_models(a1(), a1(), states=2.0), "states=2.0 is a float; g"),
    "parity tolerance": (
        lambda: compare_models(a1(), a1(), tolerance="tight"),
        "tolerance='tight' is a str; give a number from 0 on",
    ),
    # Gaits
    "gait speed": (lambda: gait_problem(a1(), any_value), "speed=None is nothing; give a number"),
    "gait attribute": (
        lambda: gait_problem(a1(), 0.3, apexes=0.34),
        "unknown attribute of a gait problem 'apexes'; choose one of: apex, sequence",
    ),
    "clearance": (
        lambda: gait_problem(a1(), 0.3, clearance=-0.1),
        "clearance=-0.1; give a number from 0 to 1 m",
    ),
    "stride that no phases fill": (
        lambda: gait_problem(a1(), 0.3, stride=(0.7, 0.9)),
        "the phases last 0.3 to 0.65 s together, and the stride 0.7 to 0.9 s; widen",
    ),
    "apex out of reach": (
        lambda: optimize_gait(gait_problem(a1(), 0.0, apex=5.0)),
        "apex 5 m is out of reach of the a1: its legs and the longest flight allow 0.",
    ),
    "speed out of reach": (
        lambda: build_library(a1(), [9.0], progress=False),
        "speed 9 m/s is out of reach of the a1: its legs and the shortest stance allow 7.",
    ),
    "problem of a name": (
        lambda: optimize_gait("pronk"),
        "problem='pronk' is a str; give a GaitProblem, as gait_problem()",
    ),
    "speeds of a build": (
        lambda: build_library(a1(), 0.3, progress=False),
        "speeds=0.3 is a float; give numbers in a tuple or a list",
    ),
    "workers of a build": (
        lambda: build_library(a1(), [0.3], workers=1.5),
        "workers=1.5 is a float; give a whole number",
    ),
    "mesh": (
        lambda: ContactPhase("stance", ("front",), (0.1, 0.2), intervals=4.0, order=8),
        "stance: intervals=4.0 is a float; give a whole number",
    ),
    "duration": (
        lambda: ContactPhase("stance", ("front",), (0.1, NAN), intervals=4, order=8),
        "stance (shortest, longest)[1]=nan; give a number",
    ),
    "a range without end": (
        lambda: number_range("speeds", ["0:1e9:1e-9"]),
        "speeds '0:1e9:1e-9' has 1e+18 values; give 1000 or fewer",
    ),
    "library of nobody": (lambda: load_library("spot"), "no such gait library is shipped; build"),
    "library of a number": (lambda: load_library(3), "robot=3 is an int; give a text"),
    "speed of a library": (lambda: load_library("a1").at("0.3"), "speed='0.3' is a str; give a n"),
    "library without gaits": (lambda: GaitLibrary(()), "gaits is empty; a gait library needs one"),
    "library of texts": (lambda: GaitLibrary(("a",)), "gaits[0]='a' is a str; give a Gait"),
    "path of a library": (lambda: GaitLibrary.load(any_value), "path=None is no path; give a te"),
    "phases": (lambda: gait().stance.motion(a1(), np.array([NAN])), "s holds NaN or infinite val"),
    "blend of two kinds": (
        lambda: gait().blend(load_library("a1", gait="bound").at(0.3), 0.5),
        "the two gaits differ in phases or orders",
    ),
    # Controllers
    "gains as numbers": (lambda: Gains(kp=100), "kp=100 is an int; give numbers, 3 of them in a"),
    "two gains": (lambda: Gains(kd=(1.0, 2.0)), "kd=(1.0, 2.0) has 2 values; give numbers, 3 of"),
    "gain of NaN": (lambda: Gains(kp=(NAN, 1.0, 1.0)), "kp[0]=nan; give a number from 0 to 1000"),
    "gain as a text": (lambda: Gains(kp=("1", 1.0, 1.0)), "kp[0]='1' is a str; give a number fr"),
    "stiffness": (
        lambda: AttitudeRegulator(stiffness=(1e9, 0.0, 0.0)),
        "attitude regulation: stiffness[0]=1000000000.0; give a number from 0 to 100000 N m/rad",
    ),
    "learned share": (lambda: BalanceSpec(learned=True), "balance: learned=True is a bool; give"),
    "balance of a text": (
        lambda: BalanceSpec(attitude="firm"),
        "balance: attitude='firm' is a str; give an AttitudeRegulator",
    ),
    "load": (lambda: ContactDetector(touchdown=any_value), "touchdown=None is nothing; give a n"),
    "foot placement": (lambda: FootPlacement(gain=NAN), "foot placement: gain=nan; give a number"),
    "timing": (lambda: FlightTiming(limit="0.1"), "timing: limit='0.1' is a str; give a number "),
    "leg angle": (lambda: LegAngleRegulator(gain=100.0), "gain=100.0; give a number from -10 to"),
    "rest": (lambda: AttitudeFilter(rest=1e9), "attitude filter: rest=1000000000.0; give a num"),
    "law's gain": (lambda: PDTypeILC(gain="0.5"), "a PD-type law: gain='0.5' is a str; give a "),
    "law's filter": (lambda: PDTypeILC(filter=0.1), "filter=0.1 is no filter; give a ZeroPhase"),
    "law's weights": (lambda: PaperILC(gains=(35, 60, 90)), "gains=(35, 60, 90) is a tuple; giv"),
    "law's look-ahead": (lambda: PaperILC(delta=1.0), "delta=1.0; give a number from 0, below 1"),
    "law's leak": (lambda: CurrentIterationILC(leak=NAN), "leak=nan; give a number from 0 to 1"),
    "splines": (lambda: NormOptimalILC(splines=8.0), "splines=8.0 is a float; give a whole num"),
    "horizon": (lambda: PlantInversionILC(horizon=0), "horizon=0; give a whole number from 1"),
    "no weight": (lambda: NormOptimalILC(0.0, 0.0), "needs one weight that is positive; got ch"),
    "tilt": (lambda: StrideSelection(tilt=-0.1), "stride selection: tilt=-0.1; give a number f"),
    "filter's order": (lambda: ZeroPhaseFilter.butterworth(2.5, 0.1), "order=2.5 is a float; g"),
    "filter without coefficients": (
        lambda: ZeroPhaseFilter((1.0,), ()),
        "filter: a=(); give one coefficient or more",
    ),
    "law of a text": (
        lambda: ControllerSpec("x", law="hello"),
        "controller 'x': law='hello' is no learning law; give an object with update(record)",
    ),
    "law by its class": (
        lambda: ControllerSpec("x", law=PDTypeILC),
        "is no learning law; give an object with update(record), such as PDTypeILC()",
    ),
    "law of a dictionary": (lambda: ControllerSpec("x", law={}), "law={} is no learning law"),
    "spec's gains": (
        lambda: ControllerSpec("x", gains=100),
        "controller 'x': gains=100 is an int; give a Gains",
    ),
    "spec's filter": (lambda: ControllerSpec("x", speed_filter=-1.0), "speed_filter=-1.0; give"),
    "ticks": (lambda: ControllerSpec("x", touchdown_ticks=0), "touchdown_ticks=0; give a whole n"),
    "controller of nothing": (lambda: load_controller(any_value), "controller=None is nothing;"),
    "torque library": (
        lambda: TorqueLibrary(any_value, np.zeros(1), np.zeros(1), np.zeros(1)),
        "speeds is not an array of numbers",
    ),
    "grid": (lambda: phase_grid(1), "samples=1; give a whole number from 2 to 100000"),
    "feedforward of no gait": (lambda: model_feedforward(a1(), []), "gaits is empty; give one fo"),
    "feedforward of a gait": (
        lambda: model_feedforward(a1(), gait()),
        "gaits is one Gait; give a list",
    ),
    "time step": (
        lambda: Controller(a1(), [gait()], load_controller("pd"), timestep=1.0),
        "timestep=1.0; give a number from 1e-05 to 0.01 s",
    ),
    "law that answers one": (
        lambda: taught(TAU),
        "the law Odd of controller 'mine' answered an array of shape (12,) where (1, 161, 12) is",
    ),
    "law that answers NaN": (
        lambda: taught(np.full((1, 161, 12), NAN)),
        "the law Odd of controller 'mine' answered torques that are not finite numbers",
    ),
    "law that answers nothing": (lambda: taught(None), "controller 'mine' answered None where (1"),
    "speed of a torque library": (
        lambda: TorqueLibrary(
            np.arange(2.0), np.zeros((2, 2, 9, 12)), np.zeros((2, 2, 9, 12)), np.ones(2)
        ).at(np.array([3.0])),
        "speed 3 m/s is outside the torque library, which covers 0 to 1 m/s; choose a speed in",
    ),
    # Worlds
    "scenario of nothing": (lambda: load_scenario(any_value), "scenario=None is nothing; give a "),
    "payload of a scenario": (
        lambda: Scenario("x", payload="3"),
        "scenario 'x': payload='3' is a str; give a number from 0 to 100 kg",
    ),
    "heavy payload": (
        lambda: load_scenario("payload=1e308"),
        "scenario 'payload=1e308': payload=1e+308; give a number from 0 to 100 kg",
    ),
    "late motors": (lambda: load_scenario("delay=1e9"), "delay=1000000000.0; give a number from 0"),
    "Jupiter": (
        lambda: load_scenario("gravity=1000"),
        "gravity=1000.0; give a number above 0, up to 30 m/s^2",
    ),
    "noise beyond sense": (
        lambda: load_scenario("noise=1e9"),
        "scenario 'noise=1e9': sensors: encoder_noise=500000.0; give a number from 0 to 1 rad",
    ),
    "infinitely slow": (
        lambda: scenario(timestep=1e-9),
        "timestep=1e-09; give a number from 1e-05",
    ),
    "a million steps": (
        lambda: scenario(step_length=1e-4),
        "step_length=0.0001; give a number fro",
    ),
    "push of NaN": (
        lambda: scenario(push_impulse=(NAN, 0, 0)),
        "push_impulse[0]=nan; give a numbe",
    ),
    "seed of a scenario": (lambda: scenario(seed=1.5), "seed=1.5 is a float; give a whole number"),
    "large seed": (lambda: scenario(seed=10**40), "seed=1000000000000"),
    "sensors of a scenario": (lambda: scenario(sensors=None), "sensors=None is nothing; give a Se"),
    "MJCF of a scenario": (lambda: scenario(mjcf=None), "mjcf=None is nothing; give a text"),
    "sampled scenarios": (
        lambda: random_scenarios(2.0, 0),
        "n=2.0 is a float; give a whole number fr",
    ),
    "noise": (
        lambda: Sensors(force_noise=1e99),
        "force_noise=1e+99; give a number from 0 to 10000",
    ),
    "noise as a text": (lambda: Sensors(gyro_bias="0"), "sensors: gyro_bias='0' is a str; give a "),
    "streams of a seed": (
        lambda: SensorSuite(Sensors(), 1, 0),
        "rng=0 is an int; give a numpy.ran",
    ),
    "no robots": (
        lambda: MujocoWorld(a1(), load_scenario("ideal"), 0),
        "n=0; give a whole number from 1",
    ),
    "world of a name": (
        lambda: MujocoWorld(a1(), "ideal", 1),
        "scenario='ideal' is a str; give a Scenario, as load_scenario() returns it",
    ),
    # Schedules, simulations, experiments
    "schedule of nothing": (
        lambda: Schedule(learning=any_value),
        "schedule: learning=None is nothing; give a number from 0 to 86400 s",
    ),
    "years of learning": (
        lambda: Schedule(learning=1e9),
        "learning=1000000000.0; give a number fr",
    ),
    "wild scatter": (lambda: Schedule(scatter=5.0), "scatter=5.0; give a number from 0 to 0.5 rad"),
    "gait of another robot": (
        lambda: simulated(gaits=[load_library("go2").at(0.3)]),
        "a gait of the go2 cannot be played by the a1; take it from load_library('a1')",
    ),
    "no gaits": (lambda: simulated(gaits=[]), "gaits is empty; give one for each robot"),
    "gaits as speeds": (lambda: simulated(gaits=[0.3]), "gaits[0]=0.3 is a float; give a Gait"),
    "robot by its name": (lambda: simulated(robot="a1"), "robot='a1' is a str; give a Robot"),
    "spec by its name": (lambda: simulated(spec="pd"), "spec='pd' is a str; give a ControllerSpec"),
    "world by its name": (lambda: simulated(scenario="nominal"), "scenario='nominal' is a str; gi"),
    "no schedule": (lambda: simulated(schedule=None), "schedule=None is nothing; give a Schedule"),
    "seed for a stream": (lambda: simulated(rng=0), "rng=0 is an int; give a numpy.random.Gener"),
    "threads": (lambda: simulated(threads=1.0), "threads=1.0 is a float; give a whole number"),
    "torques of NaN": (
        lambda: simulated(feedforward=np.full((1, 2, 161, 12), NAN)),
        "feedforward holds NaN or infinite values; give finite torques",
    ),
    "torques of another shape": (
        lambda: simulated(feedforward=np.zeros((1, 161, 12))),
        "a feedforward of shape (1, 161, 12); expected (1, 2, 161, 12)",
    ),
    "flights of another shape": (
        lambda: simulated(flight=np.zeros(3)),
        "flight has shape (3,) where (1,) is expected",
    ),
    "one speed": (
        lambda: Experiment(speeds=0.3),
        "speeds=0.3 is a float; give speeds in a tuple or a list",
    ),
    "speeds as texts": (lambda: experiment(speeds=("a",)), "speeds[0]='a' is a str; give a number"),
    "speed of True": (lambda: experiment(speeds=(True,)), "speeds[0]=True is a bool; give a numbe"),
    "one controller": (
        lambda: experiment(controllers="pd"),
        "controllers='pd' is a str; give controllers in a tuple or a list",
    ),
    "half a seed": (lambda: experiment(seeds=(1.5,)), "seeds[0]=1.5 is a float; give a whole numb"),
    "a seed of 40 digits": (lambda: experiment(seeds=(10**39,)), "to 9223372036854775807"),
    "a number of scenarios": (lambda: experiment(scenarios=3), "scenarios=3 is an int; give scen"),
    "experiment without schedule": (
        lambda: experiment(schedule=None),
        "schedule=None is nothing; give a Schedule",
    ),
    "experiment of a robot": (
        lambda: experiment(robot=a1()),
        "is a Robot; give a RobotSpec, or a name, one of: a1",
    ),
    "world of a number": (
        lambda: experiment(mjcf=3),
        "mjcf=3 is no path; give a text or a pathl",
    ),
    "too many seeds": (lambda: experiment(seeds=range(10_001)), "10001 seeds; give 10000 or fewer"),
    "run of a name": (lambda: run_experiment("default", "x"), "experiment='default' is a str; giv"),
    "run without folder": (lambda: run_experiment(experiment(), any_value), "folder=None is no pa"),
    "run of half a worker": (
        lambda: run_experiment(experiment(), "x", workers=0.5),
        "workers=0.5 is a float; give a whole number",
    ),
    "run for months": (
        lambda: run_experiment(
            experiment(seeds=range(10_000), schedule=Schedule(baseline=86_400.0)), "x", workers=1
        ),
        "10000 simulations of one robot over 86420.5 s take about",
    ),
    "results of nothing": (lambda: Results.load(any_value), "folder=None is no path; give a text"),
    "explanation of nothing": (lambda: explain(any_value), "strides=None"),
    "explanation without draws": (
        lambda: explain(strides_of("ilc"), draws=0),
        "draws=0; give a whole number from 2 to 1000000",
    ),
    "explanation of noise": (
        lambda: explain(strides_of("ilc"), imu_noise=-1.0),
        "imu_noise=-1.0; give a number from 0 to 1000 m/s^2",
    ),
    "explanation of a part": (
        lambda: explain(strides_of("ilc"), parts=("swing",)),
        "unknown part 'swing'; choose one of: ",
    ),
    "explanation of pd": (
        lambda: explain(strides_of("pd")),
        "controller 'pd' learns nothing that could be explained; choose one that does, as 'ilc'",
    ),
    "transfers of pd": (
        lambda: measure_transfers(load_controller("pd"), (0.0, 0.1, 0.2), scenario(), []),
        "controller 'pd' does not learn in stance; choose one with a law, as 'ilc'",
    ),
    "gains of no speed": (
        lambda: sweep_gains(load_controller("ilc"), (), scenario()),
        "no speeds or no shares; give at least one of each",
    ),
    "seeding": (lambda: measure_seeding((0.0, 0.2, 0.1), scenario()), "speeds must increase; give"),
    "baseline": (
        lambda: simulate_learning(
            load_controller("ilc"), (0.0,), scenario(), robot="a1", strides=0
        ),
        "strides=0; give a whole number from 1 to 100000",
    ),
    # Looking
    "width": (lambda: Film(width=300.0), "width=300.0 is a float; give a whole number"),
    "fps": (lambda: Film(fps="25"), "fps='25' is a str; give a number above 0, up to 1000"),
    "film of NaN": (lambda: Film(at=NAN), "at=nan; give a number from 0 on"),
    "track of texts": (lambda: Track("a", ["x"], Q[None]), "track 'a': t is not an array of numb"),
    "track by a number": (lambda: Track(3, np.zeros(1), Q[None]), "name of a track=3 is an int; "),
    "scene of nothing": (lambda: Scene(a1(), (None,)), "tracks[0]=None is nothing; give a Track"),
    "strides of a scene": (lambda: gait_scene(a1(), gait(), strides=0), "strides=0; give a whole"),
    "menu": (lambda: library_menu("a1"), "library='a1' is a str; give a GaitLibrary"),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_makes_no_sense_names_the_parameter_and_what_is_wanted(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, text = CALLS[name]
    with pytest.raises(PronkError) as caught:
        call()
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


WRONG_NAMES = ("", "..", "a/b", "a\nb", "a b", "-a", ".a", "x" * 300, "é", None, 3)


@pytest.mark.parametrize("name", WRONG_NAMES)
@pytest.mark.parametrize("make", [ControllerSpec, Scenario, lambda name: RobotSpec(name, "a.urdf")])
def test_names_that_cannot_be_part_of_a_file_are_refused(
    make: Callable[[Any], object], name: Any
) -> None:
    with pytest.raises(PronkError, match=r"cannot be part of the name of a file|give a text"):
        make(name)


@pytest.mark.parametrize("name", ["ilc", "model+ilc", "payload=2.5+slope", "A_1.b-2", "x" * 100])
def test_names_that_can_are_kept(name: str) -> None:
    assert ControllerSpec(name).name == Scenario(name).name == RobotSpec(name, "a").name == name


@pytest.mark.parametrize(
    ("odd", "plain"),
    [
        (lambda: Schedule(np.float64(0.5), np.int64(2), 3), lambda: Schedule(0.5, 2.0, 3.0)),
        (
            lambda: experiment(speeds=np.array([0.3, -0.1]), seeds=np.arange(2)),
            lambda: experiment(speeds=(-0.1, 0.3), seeds=(0, 1)),
        ),
        (
            lambda: experiment(speeds=[np.float32(0.5)], scenarios=["nominal"], controllers=["pd"]),
            lambda: experiment(speeds=(0.5,)),
        ),
        (lambda: Gains(kp=[35, 60, 90]), lambda: Gains(kp=(35.0, 60.0, 90.0))),
        (lambda: Gains(np.array([1, 2, 3])), lambda: Gains((1.0, 2.0, 3.0))),
        (lambda: scenario(payload=np.int64(2)), lambda: scenario(payload=2.0)),
        (lambda: scenario(com_shift=[0, 0, 0.01]), lambda: scenario(com_shift=(0.0, 0.0, 0.01))),
        (lambda: Sensors(gyro_noise=np.array(0.1)), lambda: Sensors(gyro_noise=0.1)),
        (lambda: ModelParameters(armature=[0, 0, 1]), lambda: ModelParameters((0.0, 0.0, 1.0))),
        (lambda: PDTypeILC(gain=np.float32(0.5)), lambda: PDTypeILC(gain=0.5)),
        (lambda: ControllerSpec("a", imu=np.bool_(True)), lambda: ControllerSpec("a", imu=True)),
        (
            lambda: RobotSpec("a", "b", legs=["FL"], standing=[0, 1, 2]),
            lambda: RobotSpec("a", "b", legs=("FL",), standing=(0.0, 1.0, 2.0)),
        ),
        (lambda: random_scenarios(np.int64(1), np.int64(0)), lambda: random_scenarios(1, 0)),
    ],
)
def test_lists_arrays_and_numbers_of_numpy_are_as_good_as_pythons(
    odd: Callable[[], object], plain: Callable[[], object]
) -> None:
    assert odd() == plain()
    assert repr(odd()) == repr(plain()) or "imu" in repr(plain())


def test_a_folder_may_be_a_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    short = experiment(schedule=Schedule(startup=0.1, baseline=1.0, learning=0.0))
    results = run_experiment(short, "a string", workers=1, progress=False)
    assert results.folder == Path("a string")
    assert (tmp_path / "a string" / "summary.csv").is_file()


def test_what_does_not_fit_into_memory_is_refused_with_the_estimate_and_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gaits = list(load_library("a1").gaits[:14])
    schedule = Schedule(baseline=100.0, learning=100.0)
    simulation = simulated(gaits=gaits, schedule=replace(schedule))
    log, estimate = simulation.strides, memory.log_size(gaits, schedule.duration)
    arrays = [log[quantity.name] for quantity in STRIDE_QUANTITIES]
    assert estimate == pytest.approx(sum(array.nbytes for array in arrays), rel=0.02)
    monkeypatch.setattr(memory, "memory", lambda: 4.0 * estimate)
    memory.check_memory(gaits, schedule.duration)
    with pytest.raises(PronkError, match=r"in each of 2 workers take about .*, or lower --workers"):
        memory.check_memory(gaits, schedule.duration, at_once=2)
    monkeypatch.setattr(memory, "memory", lambda: 2.0 * estimate)
    with pytest.raises(PronkError, match=r"take about .* GB, and this machine has .*; shorten --"):
        simulated(gaits=gaits, schedule=schedule)


BUILD = ["gaits", "build"]
EXPLAIN = ["explain", "RESULT"]
SHORT = ["compare", "--speeds", "0.3", "--controllers", "pd"]

COMMANDS: list[tuple[list[str], str]] = [
    (["compare", "--schedule.learning", "1e9"], "learning=1000000000.0; give a number from 0 to"),
    (["compare", "--schedule.baseline", "nan"], "schedule: baseline=nan; give a number from 0 to"),
    (["compare", "--schedule.startup", "inf"], "schedule: startup=inf; give a number from 0 to"),
    (["compare", "--schedule.scatter", "5"], "scatter=5.0; give a number from 0 to 0.5 rad"),
    (["compare", "--schedule.baseline", "many"], "Error parsing --schedule.baseline"),
    (
        ["compare", "--schedule.baseline", "86400"],
        "GB; shorten --schedule.baseline and --schedule.",
    ),
    (["compare", "--scenarios", "delay=1e9"], "delay=1000000000.0; give a number from 0 to 0.2 s"),
    (["compare", "--scenarios", "payload=1e308"], "payload=1e+308; give a number from 0 to 100 kg"),
    (["compare", "--scenarios", "gravity=1000"], "gravity=1000.0; give a number above 0, up to 30"),
    (["compare", "--scenarios", "slope=2"], "slope=2.0; give a number from -0.5 to 0.5 rad"),
    (["compare", "--scenarios", "a\nb"], "unknown scenario 'a b'; choose one of: ideal, nominal"),
    (["compare", "--scenarios", "x" * 300], "xxx...'; choose one of: ideal, nominal"),
    (
        ["compare", "--scenarios", "nominal", "nominal"],
        "scenarios must name at least one, and none",
    ),
    (["compare", "--seeds", "1" * 40], "give a whole number from 0 to 9223372036854775807"),
    (["compare", "--seeds", "-1"], "seeds[0]=-1; give a whole number from 0 on"),
    (["compare", "--seeds", "1.5"], "Error parsing --seeds: "),
    (["compare", "--speeds", "9"], "speed 9 m/s is outside the gait library, which covers -0.5 to"),
    (["compare", "--speeds", "nan"], "speeds[0]=nan; give a number that is finite"),
    (["compare", "--controllers", "pd/ilc"], "unknown controller 'pd/ilc'; choose one of: pd, ilc"),
    (["compare", "--controllers", "pd", "pd"], "controllers must name at least one, and none of"),
    (["compare", "--robot", ""], "unknown robot ''; choose one of: a1, anymal_c, b1, bolt"),
    (["compare", "--suite", "all"], "unknown suite 'all'; choose one of: default, knowledge"),
    (["compare", "--base", "None"], "unknown base 'None'; choose one of: locked, sagittal, free"),
    ([*SHORT, "--workers", "0"], "workers=0; give a whole number from 1 to 1024"),
    ([*SHORT, "--workers", "-3"], "workers=-3; give a whole number from 1 to 1024"),
    ([*SHORT, "--workers", "1000000"], "workers=1000000; give a whole number from 1 to 1024"),
    ([*SHORT, "--workers", "two"], "Error parsing --workers: "),
    ([*SHORT, "--executor", "here", "--folder", "x"], "executor 'here' is not an address; give d"),
    (
        [*SHORT, "--mjcf", "nowhere.xml", "--folder", "x"],
        "nowhere.xml: missing; give the path",
    ),
    (["reproduce", "--seeds", "-1"], "seeds[0]=-1; give a whole number from 0 on"),
    (["reproduce", "--workers", "0"], "workers=0; give a whole number from 1 to 1024"),
    (["reproduce", "--seeds", "0", "0"], "seeds must name at least one, and none of them twice"),
    (["report", "nowhere"], "nowhere: not a results folder (no config.json); run 'pronk-pin comp"),
    (["report"], "PATH Results folder. (required); For full helptext, run: pronk-pin report --he"),
    ([*EXPLAIN, "--scenario", "foo"], "in scenario 'foo'; the result has the controllers ilc, pd"),
    ([*EXPLAIN, "--scenario", "foo"], "in the scenarios nominal, payload"),
    ([*EXPLAIN, "--controller", "lqr"], "no 'lqr' in scenario 'nominal'; the result has the contr"),
    ([*EXPLAIN, "--controller", "pd"], "controller 'pd' learns nothing that could be explained;"),
    ([*EXPLAIN, "--controller", "model"], "controller 'model' learns nothing that could be expl"),
    ([*EXPLAIN, "--draws", "0"], "draws=0; give a whole number from 2 to 1000000"),
    ([*EXPLAIN, "--draws", "-5"], "draws=-5; give a whole number from 2 to 1000000"),
    ([*EXPLAIN, "--imu-noise", "-1"], "imu-noise=-1.0; give a number from 0 to 1000 m/s^2"),
    ([*EXPLAIN, "--imu-noise", "nan"], "imu-noise=nan; give a number from 0 to 1000 m/s^2"),
    ([*EXPLAIN, "--seed", "-1"], "seed=-1; give a whole number from 0 on"),
    ([*EXPLAIN, "--seed", "9" * 40], "give a whole number from 0 to 9223372036854775807"),
    ([*EXPLAIN, "--speed", "7"], "the result has no speed 7; choose one of: 0.3"),
    ([*EXPLAIN, "--figure", "a.bmp"], "figures cannot be written as 'bmp'; choose png, svg, pdf"),
    (["explain", "nowhere"], "nowhere: not a results folder (no config.json)"),
    ([*BUILD, "--speeds", "9"], "speed 9 m/s is out of reach of the a1: its legs and the shortest"),
    ([*BUILD, "--speeds", "0", "--apex", "5"], "apex 5 m is out of reach of the a1: its legs and"),
    ([*BUILD, "--speeds", "0", "--apex", "0.1"], "apex 0.1 m: the a1 stands at 0.269 m already"),
    ([*BUILD, "--speeds", "0", "--apex", "-1"], "apex=-1.0; give a number above 0"),
    (
        [*BUILD, "--speeds", "0:1e9:1e-9"],
        "speeds '0:1e9:1e-9' has 1e+18 values; give 1000 or fewer",
    ),
    ([*BUILD, "--speeds", "1:0:0.1"], "speeds '1:0:0.1' is neither a number nor a range A:B:STEP"),
    ([*BUILD, "--speeds", "nan"], "speeds 'nan' is neither a number nor a range A:B:STEP"),
    ([*BUILD, "--apex", "high"], "apex 'high' is neither a number nor a range A:B:STEP"),
    ([*BUILD, "--speeds", "0", "--workers", "0"], "workers=0; give a whole number from 1 to 1024"),
    ([*BUILD, "--gait", "gallop"], "unknown gait 'gallop'; choose one of: pronk, bound, trot"),
    ([*BUILD, "--base", "free"], "unknown base 'free'; choose one of: locked, sagittal"),
    ([*BUILD, "--output", ""], "output='.' is no file; give the name of one, as gaits.npz"),
    (["gaits", "show", "--apex", "nan"], "apex=nan; give a number that is finite"),
    (["gaits", "show", "--apex", "0.5"], "no apex 0.5; choose one of: 0.32, 0.34, 0.36"),
    (["gaits", "show", "7"], "speed 7 m/s is outside the gait library, which covers -0.5 to 0.8"),
    (["gaits", "show", "nan"], "speed nan m/s is outside the gait library"),
    (["gaits", "show", "0.3", "--apex", "nan"], "apex nan m is outside the gait library"),
    (["gaits", "show", "--robot", "bolt", "--base", "sagittal"], "build one with 'pronk-pin gaits"),
    (["gaits", "show", "--library", "no.npz"], "no.npz: missing; make it again with"),
    (["gaits", "plot", "7"], "speed 7 m/s is outside the gait library"),
    (["gaits", "plot", "--format", "bmp"], "figures cannot be written as 'bmp'; choose png, svg"),
    (["ilc", "analyze", "--strides", "0"], "strides=0; give a whole number from 1 to 100000"),
    (["ilc", "analyze", "--speed", "7"], "speed 7 m/s is outside the gait library"),
    (["ilc", "analyze", "pd"], "controller 'pd' does not learn in stance; choose one with a law"),
    (["ilc", "analyze", "--scenario", "moon"], "unknown scenario 'moon'; choose one of: ideal"),
    (["ilc", "analyze", "--figure", "a.doc"], "figures cannot be written as 'doc'; choose png"),
    (["ilc", "gains", "pd"], "controller 'pd' does not learn in stance; choose one wi"),
    (["ilc", "gains", "--speed", "7"], "speed 7 m/s is outside the gait library"),
    (["ilc", "transfer", "pd"], "controller 'pd' does not learn in stance; choose one"),
    (["ilc", "transfer", "--speed", "0", "0.1"], "transfer needs three speeds or more: one betwee"),
    (["ilc", "transfer", "--scenarios", "moon"], "unknown scenario 'moon'; choose one of: ideal"),
    (["ilc", "transfer", "--speed", "0", "7", "8"], "speed 7 m/s is outside the gait library"),
    (["ilc", "seeding", "--speed", "0"], "seeding needs three speeds or more"),
    (["ilc", "seeding", "--speed", "0", "0", "0"], "the speeds must increase; give each once, th"),
    (["ilc", "seeding", "--robot", "spot"], "unknown robot 'spot'; choose one of: a1"),
    (["play", "--speed", "3"], "speed 3 m/s is outside the gait library"),
    (["play", "--controllers", "ilc-norm-optimal"], "unknown controller of a live session 'ilc-no"),
    (["play", "--controllers", "pd", "ilc", "model", "model+ilc"], "4 controllers, one robot each"),
    (["play", "--scenario", "wind"], "unknown scenario 'wind'"),
    (["play", "--rate", "100"], "rate=100.0; give a number from 0.02 to 20"),
    (["play", "--duration", "0"], "duration=0.0; give a number"),
    (["play", "--folder", "."], ". is there already; record to another folder"),
    (["play", "--port", "-1"], "port=-1; give a whole number from 0 to 65535"),
    (["view", "missing"], "missing: no such results folder or gait library; make the one with 'pr"),
    (["view", "--controller", "pd"], "--controller is for a results folder; name one, or leave th"),
    (["view", "--stride", "3"], "--stride is for a results folder; name one, or leave the option"),
    (["view", "RESULT", "--apex", "0.3"], "--apex is for a gait library; name one, or leave the"),
    (["view", "--host", ""], "host is empty; give an address of this machine, as 127.0.0.1"),
    (["view", "--host", "a b"], "host='a b' is no address of this machine ("),
    (["view", "a\nb"], "a b: no such results folder or gait library"),
    (["view", "--port", "70000"], "port=70000; give a whole number from 0 to 65535"),
    (["view", "--port", "-1"], "port=-1; give a whole number from 0 to 65535"),
    (["view", "--port", "http"], "Error parsing --port: "),
    (["view", "--duration", "-1"], "duration=-1.0; give a number above 0, up to 1000000 s"),
    (["view", "--duration", "nan"], "duration=nan; give a number above 0, up to 1000000 s"),
    (["view", "--stride", "-5"], "stride=-5; give a whole number from 0 on"),
    (["view", "--speed", "7"], "speed 7 m/s is outside the gait library"),
    (["view", "--speed", "nan"], "speed=nan; give a number that is finite"),
    (["view", "--apex", "inf"], "apex=inf; give a number that is finite"),
    (["view", "--robot", "spot"], "unknown robot 'spot'; choose one of: a1"),
    (["view", "--base", "free"], "unknown base 'free'; choose one of: locked, sagittal"),
    (["view", "RESULT", "--scenario", "foo"], "in the scenarios nominal, payload"),
    (["view", "RESULT", "--controller", "lqr"], "no 'lqr' in scenario 'nominal'; the result has"),
    (["view", "RESULT", "--speed", "7"], "the result has no speed 7; choose one of: 0.3"),
    (["view", "--width", "3"], "width=3; give an even number of pixels from 64 to 4096"),
    (["view", "--fps", "0"], "fps=0.0; give a number above 0, up to 1000"),
    (["view", "--fps", "1e9"], "fps=1000000000.0; give a number above 0, up to 1000"),
    (["view", "--at", "-1"], "at=-1.0; give a number from 0 on"),
    (["view", "--color", "mass"], "color='mass'; choose error or torque, or leave it out"),
    (["parity", "--states", "0"], "states=0; give a whole number from 1 to 1000000"),
    (
        ["parity", "--states", "1000000000"],
        "states=1000000000; give a whole number from 1 to 1000000",
    ),
    (["parity", "--tolerance", "nan"], "tolerance=nan; give a number from 0 on"),
    (["parity", "--seed", "-1"], "seed=-1; give a whole number from 0 on"),
    (["parity", "nowhere.xml"], "nowhere.xml: missing; give the path of a URDF or an MJCF"),
    (["jump"], "Unrecognized options: jump; Available subcommands: compare, gaits, ilc, view,"),
    (["compare", "--speeeds", "3"], "Unrecognized options: --speeeds, 3; Perhaps you meant: --spe"),
    ([], "Expected one of {compare, gaits, ilc, view, play, report, reproduce, explain, parity"),
]


WRONG_USAGE = [
    arguments
    for arguments, text in COMMANDS
    if text.startswith(("Error parsing", "PATH", "Unrecognized", "Expected"))
]
"""What the parser of the command line refuses: its exit code is 2."""


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder in which nothing was simulated yet."""
    folder = tmp_path_factory.mktemp("results") / "empty"
    both = experiment(controllers=("pd", "ilc"), scenarios=("nominal", "payload"))
    make_folder(Results.of(both, folder))
    return folder


@pytest.mark.parametrize(
    ("arguments", "text"),
    COMMANDS,
    ids=lambda value: " ".join(value)[:60] if isinstance(value, list) else "",
)
def test_a_command_that_makes_no_sense_ends_in_a_message_that_tells_what_is_wanted(
    arguments: list[str],
    text: str,
    result: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        code: object = main([str(result) if word == "RESULT" else word for word in arguments])
    except SystemExit as ended:
        code = ended.code
    assert code == (2 if arguments in WRONG_USAGE else 1)
    shown = capsys.readouterr()
    assert text in shown.err
    assert shown.err.startswith("pronk-pin: ")
    assert shown.err.count("\n") == 1
    assert not shown.out
    assert not list(tmp_path.iterdir())
