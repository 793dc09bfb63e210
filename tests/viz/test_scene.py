"""What a scene shows is what Pinocchio's kinematics says."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait, GaitPhase
from pronk_pin.robot import Robot
from pronk_pin.viz import Scene, Track, gait_scene
from pronk_pin.viz.meshes import Mesh, grid_faces, sphere, thin
from pronk_pin.viz.scene import arrow

LINKS = {"trunk_0": "trunk", "FL_hip_0": "FL_hip", "RR_calf_0": "RR_calf", "FR_foot_0": "FR_foot"}
"""Some of the visuals, and the frames they are fixed to."""


def some_motion(robot: Robot, n: int = 40) -> np.ndarray:
    """Configurations with every degree of freedom moved, shape (n, 19)."""
    rng = np.random.default_rng(5)
    ends = [pin.integrate(robot.model, robot.standing, rng.uniform(-0.5, 0.5, 18)) for _ in "ab"]
    return np.stack([pin.interpolate(robot.model, *ends, w) for w in np.linspace(0, 1, n)])


def test_links_are_where_pinocchio_puts_them(robot: Robot) -> None:
    q = some_motion(robot)
    scene = Scene(robot, (Track("robot", np.linspace(0.0, 1.0, len(q)), q),))
    shown = dict(scene.transforms(scene.times(39.0)[13]))
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q[13])
    view = np.append(scene.view(13 / 39.0), 0.0)
    for part in scene.appearance.parts:
        if part.name not in LINKS:
            continue
        link = data.oMf[robot.model.getFrameId(LINKS[part.name])].homogeneous
        pose = shown[f"robot/{part.name}"].copy()
        pose[:3, 3] += view
        np.testing.assert_allclose(pose, link, atol=1e-12)


def test_every_leg_is_shown_in_four_parts(scene: Scene) -> None:
    names = {part.name for part in scene.appearance.parts}
    parts = {
        f"{leg}_{part}_0" for leg in scene.robot.legs for part in ("hip", "thigh", "calf", "foot")
    }
    assert names == parts | {"trunk_0"}


def test_a_steady_run_stays_in_place_while_the_ground_scrolls(scene: Scene) -> None:
    for time in (0.0, 1.3, 4.9):
        shown = dict(scene.transforms(time))
        assert shown["robot/trunk_0"][0, 3] == pytest.approx(0.0, abs=1e-6)
        assert shown["reference/trunk_0"][0, 3] == pytest.approx(-0.1, abs=1e-6)
        assert shown["ground"][0, 3] == pytest.approx(-0.5 * time, abs=1e-6)


def test_forces_are_arrows_from_the_lowest_points_of_the_feet(scene: Scene) -> None:
    robot, track = scene.robot, scene.tracks[0]
    k = 12
    shown = dict(scene.transforms(float(track.t[k])))
    _, feet = scene.appearance.place(track.q[k])
    assert track.forces is not None
    for leg, foot, force in zip(robot.legs, feet, track.forces[k], strict=True):
        pose = shown[f"robot/force {leg}"]
        tip = pose @ [0.0, 0.0, 1.0, 1.0]
        lowest = foot - [0.5 * track.t[k], 0.0, robot.foot_radius]
        np.testing.assert_allclose(pose[:3, 3], lowest, atol=1e-6)
        np.testing.assert_allclose(tip[:3] - lowest, scene.force_scale * force, atol=1e-6)
    assert not any("reference/force" in path for path in shown)


@pytest.mark.parametrize("vector", [[0, 0, 0.2], [0.1, -0.2, 0.05], [0, 0.3, 0], [0, 0, -0.1]])
def test_an_arrow_is_a_rotation_with_a_scaled_axis(vector: list[float]) -> None:
    pose = arrow(np.zeros(3), np.array(vector))
    axes = pose[:3, :3] / np.linalg.norm(pose[:3, :3], axis=0)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(pose[:3, 2], vector)


def test_no_force_is_no_arrow() -> None:
    assert np.abs(arrow(np.zeros(3), np.zeros(3))[:3, :3]).max() < 0.02


def test_between_samples_a_track_turns_the_short_way(robot: Robot) -> None:
    q = np.tile(robot.standing, (2, 1))
    q[1, 3:7] = -pin.Quaternion(pin.utils.rpyToMatrix(0.0, 0.0, 0.2)).coeffs()
    track = Track("robot", np.array([1.0, 2.0]), q)
    half = pin.Quaternion(track.at(1.5)[0][3:7]).toRotationMatrix()
    np.testing.assert_allclose(half, pin.utils.rpyToMatrix(0.0, 0.0, 0.1), atol=1e-12)


def test_a_track_holds_its_ends(hop: Track) -> None:
    np.testing.assert_allclose(hop.at(-1.0)[0], hop.q[0])
    np.testing.assert_allclose(hop.at(99.0)[0], hop.q[-1])


def test_one_posture_is_a_scene(robot: Robot) -> None:
    scene = Scene(robot, (Track("robot", np.zeros(1), robot.standing[None]),))
    assert scene.times(60.0).tolist() == [0.0]
    assert dict(scene.transforms(0.0))["robot/trunk_0"][2, 3] == pytest.approx(robot.standing[2])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": np.zeros((3, 18))}, r"q is of shape \(3, 18\), not \(3, 19\)"),
        ({"t": np.array([0.0, 1.0, 1.0])}, "t must increase"),
        ({"forces": np.zeros((3, 4))}, r"forces is of shape \(3, 4\), not \(3, 4, 3\)"),
        ({"forces": np.full((3, 4, 3), np.nan)}, "forces holds NaN"),
        ({"name": "a/b"}, "must not be empty or hold a '/'"),
    ],
)
def test_a_track_refuses_what_it_cannot_show(
    robot: Robot, change: dict[str, object], message: str
) -> None:
    good = {"name": "robot", "t": np.arange(3.0), "q": np.tile(robot.standing, (3, 1))}
    with pytest.raises(InvalidInput, match=message):
        Track(**(good | change))  # type: ignore[arg-type]


def test_tracks_of_one_name_are_refused(robot: Robot, hop: Track) -> None:
    with pytest.raises(InvalidInput, match="different names"):
        Scene(robot, (hop, hop))


def test_a_gait_runs_on_over_its_strides(robot: Robot) -> None:
    joints = np.repeat(robot.standing[7:, None], 2, axis=1)
    phases = []
    for name, feet, duration, x in (
        ("stance", robot.legs, 0.2, (0.0, 0.1)),
        ("flight", (), 0.2, (0.1, 0.2)),
    ):
        lam = np.zeros((4, 3, 2))
        lam[:, 2] = 60.0 if feet else 0.0
        base = np.array([x, (0.3, 0.3), (0.0, 0.0)])
        phases.append(GaitPhase(name, feet, duration, joints, base, np.zeros((12, 2)), lam))
    scene = gait_scene(robot, Gait("a1", 0.5, 0.3, tuple(phases)), strides=3, dt=0.01)
    track = scene.tracks[0]
    assert scene.duration == pytest.approx(3 * 0.4, abs=0.011)
    np.testing.assert_allclose(track.q[:, 0], 0.5 * track.t, atol=1e-12)
    assert track.forces is not None
    standing = track.forces[:, 0, 2] > 0.0
    np.testing.assert_array_equal(standing, (track.t + 1e-9) % 0.4 < 0.2)


def test_thinning_keeps_surfaces_round() -> None:
    fine = sphere(0.1, segments=200)
    coarse = thin(fine, cell=0.01)
    assert len(coarse.faces) < 0.1 * len(fine.faces)
    np.testing.assert_allclose(np.linalg.norm(coarse.vertices, axis=1), 0.1, atol=1e-3)


def test_thinning_keeps_corners_sharp() -> None:
    # Three faces of a cube that meet in the origin, each a fine grid.
    u, v = (x.reshape(-1) for x in np.meshgrid(np.linspace(0, 0.1, 51), np.linspace(0, 0.1, 51)))
    zero = np.zeros_like(u)
    quads = grid_faces(51, 51)
    sides = [np.stack(axes, axis=-1) for axes in ((u, v, zero), (zero, u, v), (v, zero, u))]
    faces = np.concatenate([quads + k * len(u) for k in range(3)])
    coarse = thin(Mesh(np.concatenate(sides), faces), cell=0.013)
    assert np.linalg.norm(coarse.vertices, axis=1).min() < 5e-4
    assert np.abs(coarse.vertices).min(axis=1).max() < 5e-4


def test_the_robot_is_light_and_keeps_its_size(scene: Scene) -> None:
    parts = {part.name: part for part in scene.appearance.parts}
    assert sum(len(part.mesh.faces) for part in parts.values()) < 40_000
    extent = np.ptp(parts["trunk_0"].mesh.vertices, axis=0)
    np.testing.assert_allclose(extent, [0.414, 0.194, 0.117], atol=2e-3)
