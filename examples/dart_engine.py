"""An engine of one's own, beside ours: DART (`pip install dartpy`), the default of today's Gazebo.

`python examples/dart_engine.py [folder]` asks MuJoCo and DART the same questions. Where the file
can be imported, the shell does: `pronk-pin compare --scenarios ideal ideal+dart_engine:engine`.

What an `Engine` and its `World` promise stands in `pronk_pin/compare/world/engine.py`. DART has
rigid contacts, solved as a linear complementarity problem, and no inertia of rotors.
"""

import sys
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import pinocchio as pin

from pronk_pin.compare import Engine, Experiment, Motion, Scenario, Schedule, World, run_experiment
from pronk_pin.compare.report import format_between_engines
from pronk_pin.errors import InvalidInput

BEYOND = {"ground_roughness": 0.0, "step_height": 0.0, "mjcf": "", "edit": ""}
BEYOND |= {"ground_time_constant": Scenario("usual").ground_time_constant}
BEYOND |= {"push_impulse": (0.0, 0.0, 0.0)}
"""What it cannot do, and the values that ask for nothing."""

HUGE = 1e10
"""A state with such a number in it is not finite any more."""

X_Z = [1, 0]
"""Where x and z of the trunk are: its plane is spanned by z and x, so that it turns about y."""


@dataclass(frozen=True)
class DartEngine(Engine):
    """DART: rigid contacts by Dantzig's solver; joints have no rotors there."""

    name: str = "dart"

    def check(self, robot, scenario, base):
        """See `Engine`."""
        beyond = [name for name, none in BEYOND.items() if getattr(scenario, name) != none]
        beyond += ["rotors (armature)"] if scenario.by_joint("armature", robot).any() else []
        beyond += ["a free base"] if base == "free" else []
        if beyond:
            raise InvalidInput(
                f"scenario '{scenario.name}': DART cannot simulate {', '.join(beyond)}; leave "
                "that out, begin with the scenario 'ideal', or take engine mujoco"
            )
        if find_spec("dartpy") is None:
            raise InvalidInput("DART is not installed; pip install dartpy")

    def world(self, robot, scenario, n, *, base, servo=None):
        """See `Engine`."""
        self.check(robot, scenario, base)
        return DartWorld(robot, scenario, n, base=base, servo=servo)


class DartWorld(World):
    """n robots in DART, one after the other in the same skeleton.

    A state is [positions, velocities]: z and x of the trunk, its pitch where it may, the joints.
    """

    def __init__(self, robot, scenario, n, *, base, servo):
        self.robot, self.scenario, self.n = robot, scenario, n
        self._dart, self._skeleton, self._feet = build(robot, scenario, base)
        self._guides = self._skeleton.getNumDofs() - robot.nu
        self._constant = scenario.by_joint("torque_constant", robot)
        self._servo = servo and (servo.proportional(robot.nu), servo.derivative(robot.nu))
        self._state = np.zeros((n, 2, self._skeleton.getNumDofs()))
        self.force = np.zeros((n, len(robot.foot_names), 3))
        self.restart(np.arange(n))

    def reset(self, base, joints, base_rate=0.0, joint_rates=0.0, *, pitch=0.0):
        """See `World`."""
        self._state[:] = 0.0
        if self._guides > 2:
            self._state[:, 0, 2] = pitch
        self._state[:, 0, X_Z], self._state[:, 0, self._guides :] = base, joints
        self._state[:, 1, X_Z], self._state[:, 1, self._guides :] = base_rate, joint_rates
        self.force[:] = 0.0

    def play(self, rows, control):
        """See `World`."""
        m, ticks = control.shape[:2]
        path = np.full((m, ticks + 1, *self._state.shape[1:]), np.nan)
        path[:, 0] = self._state[rows]
        force = np.zeros((m, ticks, *self.force.shape[1:]))
        for k in range(m):
            # A detector remembers in which order it met contacts, and sums depend on that.
            detector = type(self._dart.getConstraintSolver().getCollisionDetector())()
            self._dart.getConstraintSolver().setCollisionDetector(detector)
            for tick in range(ticks):
                if not self._step(path[k], control[k, tick], tick, force[k, tick]):
                    break
        before, guides = path[:, :-1], self._guides
        turns = guides > 2
        return Motion(
            base=before[:, :, 0, X_Z],
            base_rate=before[:, :, 1, X_Z],
            joints=before[:, :, 0, guides:],
            joint_rates=before[:, :, 1, guides:],
            force=force,
            finite=(np.abs(path[:, 1:]) < HUGE).all(axis=(-2, -1)),
            path=path,
            pose=self._pose(before) if turns else None,
            twist=self._twist(before) if turns else None,
        )

    def _step(self, path, control, tick, force):
        """One step of one robot; whether it can go on."""
        position, velocity = path[tick]
        if not np.abs(path[tick]).max() < HUGE:  # DART would end the program
            return False
        joints, rates = position[self._guides :], velocity[self._guides :]
        torque = control
        if self._servo:
            kp, kd = self._servo
            limit = self.robot.tau_max
            torque = np.clip(control - kp * joints - kd * rates, -limit, limit)
        skeleton = self._skeleton
        skeleton.setPositions(position)
        skeleton.setVelocities(velocity)
        skeleton.setForces(np.concatenate([np.zeros(self._guides), self._constant * torque]))
        self._dart.step()
        path[tick + 1] = skeleton.getPositions(), skeleton.getVelocities()
        for contact in self._dart.getLastCollisionResult().getContacts():
            first = contact.collisionObject1.getShapeFrame().asShapeNode().getName()
            other = contact.collisionObject2.getShapeFrame().asShapeNode().getName()
            if first in self._feet:
                force[self._feet[first]] += contact.force
            else:
                force[self._feet[other]] -= contact.force
        return True

    def advance(self, rows, motion, ticks):
        """See `World`."""
        m = np.arange(len(rows))
        self._state[rows], self.force[rows] = motion.path[m, ticks], motion.force[m, ticks - 1]

    def restart(self, rows):
        """See `World`."""
        self._state[rows] = 0.0
        self._state[rows, 0, 0] = self.robot.standing[2]
        self._state[rows, 0, self._guides :] = self.robot.standing[7:]

    base = property(lambda self: self._state[:, 0, X_Z])
    base_rate = property(lambda self: self._state[:, 1, X_Z])
    joints = property(lambda self: self._state[:, 0, self._guides :])
    joint_rates = property(lambda self: self._state[:, 1, self._guides :])
    pose = property(lambda self: self._pose(self._state))
    twist = property(lambda self: self._twist(self._state))

    def _pitch(self, state, derivative):
        return state[..., derivative, 2] if self._guides > 2 else np.zeros(state.shape[:-2])

    def _pose(self, state):
        pose, half = np.zeros((*state.shape[:-2], 7)), 0.5 * self._pitch(state, 0)
        pose[..., [0, 2]] = state[..., 0, X_Z]
        pose[..., 4], pose[..., 6] = np.sin(half), np.cos(half)
        return pose

    def _twist(self, state):
        """Rates of x and z in the trunk's axes, and of the pitch."""
        twist, angle = np.zeros((*state.shape[:-2], 6)), self._pitch(state, 0)
        x, z = np.moveaxis(state[..., 1, X_Z], -1, 0)
        twist[..., 0] = np.cos(angle) * x - np.sin(angle) * z
        twist[..., 2] = np.sin(angle) * x + np.cos(angle) * z
        twist[..., 4] = self._pitch(state, 1)
        return twist


def build(robot, scenario, base):
    """The robot on its ground in DART: world, skeleton, and number of each foot by its shape.

    Bodies are those of Pinocchio's model, in the frames of its joints: no URDF is read twice.
    """
    import dartpy as dart

    model, own = (robot.bare or robot).model, slice(-robot.nu, None)
    skeleton, world = dart.dynamics.Skeleton(robot.name), dart.simulation.World()
    world.setTimeStep(scenario.timestep)
    asleep = world.getDeactivationOptions()
    asleep.mEnabled = False  # a robot at rest would be left out
    world.setDeactivationOptions(asleep)
    world.setGravity(scenario.gravity_vector)
    trunk = model.inertias[1].copy()
    trunk.lever = trunk.lever + np.array(scenario.com_shift)
    load = pin.Inertia(scenario.payload, np.array(scenario.payload_position), np.zeros((3, 3)))
    x, z, axes = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], dart.dynamics
    if base == "locked":  # two slides: on a TranslationalJoint2D of any plane nothing falls
        slide, body = skeleton.createPrismaticJointAndBodyNodePair()
        slide.setAxis(z)
        body.setInertia(axes.Inertia(1e-9, np.zeros(3), 1e-9 * np.eye(3)))
        slide, body = skeleton.createPrismaticJointAndBodyNodePair(body)
        slide.setAxis(x)
    else:
        plane, body = skeleton.createPlanarJointAndBodyNodePair()
        plane.setArbitraryPlane(z, x)
    set_inertia(axes, body, trunk + load)
    bodies = [None, body]
    damping = scenario.by_joint("damping", robot) + model.damping[own]
    dry = scenario.by_joint("coulomb", robot) + model.friction[own]
    for index in range(2, model.njoints):
        parent, place = bodies[model.parents[index]], model.jointPlacements[index]
        joint, body = skeleton.createRevoluteJointAndBodyNodePair(parent)
        motion = model.joints[index].createData()
        model.joints[index].calc(motion, pin.neutral(model))
        joint.setAxis(np.ravel(motion.S)[3:])
        joint.setTransformFromParentBodyNode(dart.math.Isometry3(place.homogeneous))
        joint.setDampingCoefficient(0, damping[index - 2])
        joint.setCoulombFriction(0, dry[index - 2])
        set_inertia(axes, body, model.inertias[index])
        bodies.append(body)
    feet = {}
    for number, foot in enumerate(robot.foot_ids):
        frame = model.frames[foot]
        ball = bodies[frame.parentJoint].createShapeNode(axes.SphereShape(robot.foot_radius))
        ball.setRelativeTranslation(frame.placement.translation)
        touches(ball, scenario)
        feet[ball.getName()] = number
    ground = axes.Skeleton("ground")
    _, body = ground.createWeldJointAndBodyNodePair()
    floor = body.createShapeNode(axes.BoxShape([1000.0, 1000.0, 1.0]))
    floor.setRelativeTranslation([0.0, 0.0, -0.5])
    touches(floor, scenario)
    world.addSkeleton(ground)
    world.addSkeleton(skeleton)
    return world, skeleton, feet


def set_inertia(dynamics, body, inertia):
    """Give a body the inertia of one of Pinocchio's."""
    body.setInertia(dynamics.Inertia(inertia.mass, inertia.lever, inertia.inertia))


def touches(shape, scenario):
    """Let a shape meet the ground, with the scenario's friction.

    Each direction's friction is bound by mu times the force that a ground without friction would
    bear, as in ODE's Dantzig solver, of which this one is a child: a pyramid, not the cone.
    """
    shape.createCollisionAspect()
    shape.createDynamicsAspect()
    shape.getDynamicsAspect().setFrictionCoeff(scenario.ground_friction)
    shape.getDynamicsAspect().setRestitutionCoeff(0.0)


engine = DartEngine()

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.3,),
        controllers=("pd", "model", "ilc"),
        scenarios=("ideal", "ideal+dart_engine:engine"),
        schedule=Schedule(baseline=5.0, learning=10.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/dart"]), workers=2)
    print(format_between_engines(results))
