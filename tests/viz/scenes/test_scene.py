"""What a scene shows is what Pinocchio's kinematics says."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from pronk_pin.errors import FileProblem, InvalidInput, PartNotShown
from pronk_pin.gait import Gait, GaitPhase, load_library
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot, RobotSpec, find_mesh, length_scale, load_robot
from pronk_pin.viz import Scene, Track, gait_scene
from pronk_pin.viz.player.scene_encoding import _size
from pronk_pin.viz.scenes.mesh_files import Mesh, load_mesh, thin
from pronk_pin.viz.scenes.meshes import Appearance, Solid, appearance


def some_motion(robot: Robot, n: int = 40) -> np.ndarray:
    """Configurations with every degree of freedom moved, shape (n, 19)."""
    rng = np.random.default_rng(5)
    ends = [pin.integrate(robot.model, robot.standing, rng.uniform(-0.5, 0.5, 18)) for _ in "ab"]
    return np.stack([pin.interpolate(robot.model, *ends, w) for w in np.linspace(0, 1, n)])


def placed(look: Appearance, q: np.ndarray) -> dict[str, np.ndarray]:
    """Poses of the parts as the page computes them: down the tree of joints, in plain algebra."""
    base = np.eye(4)
    base[:3, :3] = Rotation.from_quat(q[3:7]).as_matrix()
    base[:3, 3] = q[:3]
    poses = [np.eye(4), base]
    for angle, joint in zip(q[7:], look.joints, strict=True):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(angle * joint.axis).as_matrix()
        poses.append(poses[joint.parent] @ joint.placement @ turn)
    return {part.name: poses[part.joint] @ part.placement for part in look.parts}


@pytest.mark.parametrize("name", ["a1", "go2", "solo12"])
def test_links_are_where_pinocchio_puts_them(name: str) -> None:
    robot = load_robot(name)
    look, data = appearance(robot), robot.model.createData()
    visuals = pin.buildGeomFromUrdf(
        robot.model,
        str(robot.urdf_path),
        pin.GeometryType.VISUAL,
        package_dirs=[str(robot.package_dir)],
    )
    places = visuals.createData()
    q = some_motion(robot)[13]
    pin.updateGeometryPlacements(robot.model, data, visuals, places, q)
    for part, pose in placed(look, q).items():
        expected = places.oMg[visuals.getGeometryId(part)].homogeneous
        np.testing.assert_allclose(pose, expected, atol=1e-12)
    feet = look.feet(q[None])[0]
    np.testing.assert_allclose(feet, foot_positions(robot, q), atol=1e-12)


def test_every_leg_is_shown_in_four_parts(scene: Scene) -> None:
    names = {part.name for part in scene.appearance.parts}
    parts = {
        f"{leg}_{part}_0" for leg in scene.robot.legs for part in ("hip", "thigh", "calf", "foot")
    }
    assert names == parts | {"trunk_0"}


def test_a_steady_run_stays_in_place_while_the_ground_scrolls(scene: Scene) -> None:
    times = np.array([0.0, 1.3, 4.9])
    robot, reference = scene.rows(times)
    view = scene.view(times)
    np.testing.assert_allclose(view, np.stack([0.5 * times, 0.0 * times], axis=1), atol=1e-6)
    np.testing.assert_allclose(robot["q"][:, 0] - view[:, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(reference["q"][:, 0] - view[:, 0], -0.1, atol=1e-6)


def test_two_robots_stand_on_both_sides_of_the_middle(robot: Robot, hop: Track) -> None:
    second = replace(hop.moved(y=0.6), name="second")
    assert Scene(robot, (hop, second)).view(np.zeros(1))[0, 1] == pytest.approx(0.3)


def test_samples_are_shown_as_they_are(hop: Track) -> None:
    row = hop.at(hop.t[[12, 77]])
    for name in ("q", "forces", "error", "torque"):
        values = getattr(hop, name)[[12, 77]].reshape(2, -1)
        np.testing.assert_allclose(row[name], values, atol=1e-12)


def test_between_samples_a_track_turns_the_short_way(robot: Robot) -> None:
    q = np.tile(robot.standing, (2, 1))
    q[1, 3:7] = -pin.Quaternion(pin.utils.rpyToMatrix(0.0, 0.0, 0.2)).coeffs()
    track = Track("robot", np.array([1.0, 2.0]), q)
    half = pin.Quaternion(track.at(np.array([1.5]))["q"][0, 3:7]).toRotationMatrix()
    np.testing.assert_allclose(half, pin.utils.rpyToMatrix(0.0, 0.0, 0.1), atol=1e-12)


def test_a_track_holds_its_ends(hop: Track) -> None:
    ends = hop.at(np.array([-1.0, 99.0]))["q"]
    np.testing.assert_allclose(ends, hop.q[[0, -1]], atol=1e-12)


def test_one_posture_is_a_scene(robot: Robot) -> None:
    scene = Scene(robot, (Track("robot", np.zeros(1), robot.standing[None]),))
    assert scene.times(60.0).tolist() == [0.0]
    np.testing.assert_allclose(scene.rows(scene.times(60.0))[0]["q"], robot.standing[None])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": np.zeros((3, 18))}, r"q is of shape \(3, 18\), not \(3, 19\)"),
        ({"t": np.array([0.0, 1.0, 1.0])}, "t must increase"),
        ({"forces": np.zeros((3, 4))}, r"forces is of shape \(3, 4\), not \(3, 4, 3\)"),
        ({"q": np.full((3, 19), np.nan)}, "q holds NaN"),
        ({"torque": np.zeros((2, 12))}, r"torque is of shape \(2, 12\), not \(3, 12\)"),
        ({"name": ""}, "needs a name"),
    ],
)
def test_a_scene_refuses_what_it_cannot_show(
    robot: Robot, change: dict[str, object], message: str
) -> None:
    good = {"name": "robot", "t": np.arange(3.0), "q": np.tile(robot.standing, (3, 1))}
    with pytest.raises(InvalidInput, match=message):
        Scene(robot, (Track(**(good | change)),))  # type: ignore[arg-type]


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
    assert [(mark.stride, mark.phase) for mark in track.marks[:3]] == [
        (0, "stance"),
        (0, "flight"),
        (1, "stance"),
    ]
    assert [mark.t for mark in track.marks[:3]] == pytest.approx([0.0, 0.2, 0.4])


def grid(rows: int, columns: int) -> np.ndarray:
    """Triangles between the neighbours of a rows x columns grid of vertices, shape (m, 3)."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    triangles = np.array([[0, columns, 1], [1, columns, columns + 1]])
    return np.concatenate([corner + triangle for triangle in triangles])


def test_thinning_keeps_surfaces_round() -> None:
    polar, around = np.meshgrid(np.linspace(0, np.pi, 101), np.linspace(0, 2 * np.pi, 201))
    points = np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)
    fine = Mesh(0.1 * np.stack(points, axis=-1).reshape(-1, 3), grid(201, 101))
    coarse = thin(fine, most=2000)
    assert len(coarse.faces) < 0.1 * len(fine.faces)
    np.testing.assert_allclose(np.linalg.norm(coarse.vertices, axis=1), 0.1, atol=1e-3)


def test_thinning_keeps_corners_sharp() -> None:
    # Three faces of a cube that meet in the origin, each a fine grid.
    u, v = (x.reshape(-1) for x in np.meshgrid(np.linspace(0, 0.1, 51), np.linspace(0, 0.1, 51)))
    zero = np.zeros_like(u)
    sides = [np.stack(axes, axis=-1) for axes in ((u, v, zero), (zero, u, v), (v, zero, u))]
    faces = np.concatenate([grid(51, 51) + k * len(u) for k in range(3)])
    coarse = thin(Mesh(np.concatenate(sides), faces), most=500)
    assert len(coarse.faces) < 600
    assert np.linalg.norm(coarse.vertices, axis=1).min() < 5e-4
    assert np.abs(coarse.vertices).min(axis=1).max() < 5e-4


def test_light_meshes_are_left_alone() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    same = thin(Mesh(corners, faces))
    np.testing.assert_allclose(same.vertices[same.faces], corners[faces])


def test_the_go1_is_shown_with_its_rotors() -> None:
    """Which are cylinders."""
    shapes = {part.shape for part in appearance(load_robot("go1")).parts}
    assert Solid("cylinder", (0.035, 0.02)) in shapes


def test_the_robot_is_light_and_keeps_its_size(scene: Scene) -> None:
    parts = {part.name: part for part in scene.appearance.parts}
    assert (
        sum(len(part.shape.faces) for part in parts.values() if isinstance(part.shape, Mesh))
        < 40_000
    )
    trunk = parts["trunk_0"].shape
    assert isinstance(trunk, Mesh)
    extent = np.ptp(trunk.vertices, axis=0)
    np.testing.assert_allclose(extent, [0.414, 0.194, 0.117], atol=2e-3)


def own_visuals(robot: Robot, path: Path, *geometries: str, rgba: str = "1 0 0 1") -> Robot:
    """The A1 whose trunk is nothing but these shapes, and whose legs are not seen."""
    root = ElementTree.fromstring(robot.urdf)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        if link.get("name") == "trunk":
            for geometry in geometries:
                text = (
                    f"<visual><origin xyz='0 0 0.1'/><geometry>{geometry}</geometry>"
                    f"<material name='own'><color rgba='{rgba}'/></material></visual>"
                )
                link.append(ElementTree.fromstring(text))
    path.write_bytes(ElementTree.tostring(root))
    return load_robot(RobotSpec("own", str(path)))


def test_capsules_and_cones_are_shown(robot: Robot, tmp_path: Path) -> None:
    """Which the library that reads URDFs for Pinocchio does not know."""
    own = own_visuals(
        robot,
        tmp_path / "own.urdf",
        '<capsule radius="0.05" length="0.2"/>',
        '<cone radius="0.05" length="0.2"/>',
    )
    assert own.mass == robot.mass
    capsule, cone = appearance(own).parts
    assert capsule.shape == Solid("capsule", (0.05, 0.2))
    assert cone.shape == Solid("cone", (0.05, 0.2))
    np.testing.assert_array_equal(capsule.placement[:3, 3], [0.0, 0.0, 0.1])
    assert capsule.color == (1.0, 0.0, 0.0)


def test_what_cannot_be_shown_is_left_out_with_a_warning(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "torn.stl").write_text("solid\nfacet normal 0")
    own = own_visuals(
        robot,
        tmp_path / "own.urdf",
        '<mesh filename="package://my_robot/nowhere.stl"/>',
        '<mesh filename="torn.stl"/>',
        '<torus radius="0.1"/>',
        '<box size="0.1 0.1"/>',
        '<sphere radius="0.1"/>',
    )
    said = (
        r"own is shown without trunk_0 .*my_robot.*ROS_PACKAGE_PATH.* and 3 more: trunk_1, trunk_2"
    )
    with pytest.warns(PartNotShown, match=said):
        look = appearance(own)
    assert [part.name for part in look.parts] == ["trunk_4"]


def test_meshes_of_packages_are_found(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    urdf = tmp_path / "my_robot" / "urdf" / "own.urdf"
    places = {
        "package://my_robot/meshes/a.stl": tmp_path / "my_robot" / "meshes" / "a.stl",
        "package://beside/a.stl": tmp_path / "beside" / "a.stl",
        "package://other/b.stl": tmp_path / "ros" / "other" / "b.stl",
        "package://third/c.stl": tmp_path / "ament" / "share" / "third" / "c.stl",
        "d.stl": urdf.parent / "d.stl",
        f"file://{tmp_path}/e.stl": tmp_path / "e.stl",
    }
    for path in places.values():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path / 'ros'}")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ament"))
    for address, path in places.items():
        assert find_mesh(address, urdf, urdf.parent) == path
    with pytest.raises(FileProblem, match=r"folder named lost above the URDF.*ROS_PACKAGE_PATH"):
        find_mesh("package://lost/f.stl", urdf, urdf.parent)


def test_a_copy_of_a_urdf_of_example_robot_data_keeps_its_meshes(
    robot: Robot, tmp_path: Path
) -> None:
    (tmp_path / "own.urdf").write_bytes(robot.urdf)
    own = appearance(load_robot(RobotSpec("own", str(tmp_path / "own.urdf"))))
    assert len(own.parts) == len(appearance(robot).parts)


_TORN = [
    ("go2_description/visuals", "base.dae"),
    ("go2_description/visuals", "thigh.dae"),
    ("anymal_c_simple_description/meshes", "base.dae"),
    ("laikago_description/meshes", "trunk.obj"),
]


@pytest.mark.parametrize(("folder", "name"), _TORN, ids=lambda value: value)
def test_faces_of_several_materials_span_what_their_vertices_span(folder: str, name: str) -> None:
    path = load_robot("go2").package_dir / "example-robot-data" / "robots" / folder / name
    read = coal.MeshLoader().load(str(path), np.ones(3))
    everywhere = np.array(read.vertices())
    mesh = load_mesh(path, np.ones(3))
    assert len(mesh.faces) == read.num_tris
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)
    for end in (np.min, np.max):
        np.testing.assert_allclose(
            end(mesh.vertices[mesh.faces], axis=(0, 1)), end(everywhere, axis=0), atol=1e-7
        )
    # Edges of a torn mesh go from one part of it to another.
    torn = np.array([tuple(read.tri_indices(k)[c] for c in range(3)) for k in range(read.num_tris)])
    edges = (np.diff(mesh.vertices[mesh.faces], axis=1), np.diff(everywhere[torn], axis=1))
    own, wrong = (np.linalg.norm(edge, axis=-1).mean() for edge in edges)
    assert own < 0.8 * wrong


_TWO = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="a" count="18">0 0 0 1 0 0 0 1 0 0 0 2 1 0 2 0 1 2</float_array>
      <technique_common><accessor source="#a" count="6" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
    </source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="1" material="a"><input semantic="VERTEX" source="#v" offset="0"/>
      <p>0 1 2</p></triangles>
    <triangles count="1" material="b"><input semantic="VERTEX" source="#v" offset="0"/>
      <p>3 4 5</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s">
    <node><instance_geometry url="#g"/></node>
    <node><translate>10 0 0</translate><instance_geometry url="#g"/></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


def test_a_part_that_a_scene_has_twice_is_there_twice(tmp_path: Path) -> None:
    (tmp_path / "two.dae").write_text(_TWO)
    mesh = load_mesh(tmp_path / "two.dae", np.array([1.0, 1.0, 0.5]))
    triangles = {tuple(map(tuple, mesh.vertices[face].round(9).tolist())) for face in mesh.faces}
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    wanted = [corner + np.array([x, 0, z]) for x in (0.0, 10.0) for z in (0.0, 1.0)]
    assert triangles == {tuple(map(tuple, each.tolist())) for each in wanted}


def test_forces_and_the_camera_go_with_the_robots_size_and_weight() -> None:
    """The same share of the weight is as long an arrow, over the height at which a robot stands."""
    shown = {}
    for name in ("a1", "bolt", "hyq"):
        robot = load_robot(name)
        still = Track("still", np.array([0.0, 1.0]), np.tile(robot.standing, (2, 1)))
        scene = Scene(robot, [still])
        length = scene.force_scale * robot.mass / length_scale(robot)
        shown[name] = (length, _size(robot))
    lengths = [length for length, _ in shown.values()]
    assert lengths == pytest.approx([0.0025 * load_robot("a1").mass] * 3)
    assert shown["a1"][1] == shown["bolt"][1] == 1.0
    feet = foot_positions(robot, robot.standing)[:, 0]  # of the HyQ, longer than it is high
    assert shown["hyq"][1] == pytest.approx(np.ptp(feet) / 0.45)


def test_a_force_is_an_arrow_of_its_size_by_the_robots_size_and_weight(robot: Robot) -> None:
    """0.1 m for 40 N of the A1; the weight of any robot is as long, over its height."""

    def length(own: Robot, newtons: float) -> float:
        scale = Scene(own, (Track("robot", np.zeros(1), own.standing[None]),)).force_scale
        assert scale is not None
        return scale * newtons

    assert length(robot, 40.0) == pytest.approx(0.1)
    reference = length(robot, robot.mass * robot.gravity) / length_scale(robot)
    for name in ("go2", "solo12", "b1"):
        own = load_robot(name)
        weight = own.mass * own.gravity
        assert length(own, weight) / length_scale(own) == pytest.approx(reference), name
    track = Track("robot", np.zeros(1), robot.standing[None])
    assert Scene(robot, (track,), force_scale=0.01).force_scale == 0.01


def test_phases_of_a_gait_scene_are_named_as_its_feet_are_loaded(robot: Robot) -> None:
    gait = load_library("a1").at(0.5)
    track = gait_scene(robot, gait, strides=2).tracks[0]
    assert track.forces is not None
    assert track.torque is not None
    for mark, after in zip(track.marks, track.marks[1:], strict=False):
        inside = (track.t > mark.t + 0.01) & (track.t < after.t - 0.01)
        load = track.forces[inside][:, :, 2].sum(axis=1)
        assert np.all(load > 10.0) if mark.phase == "stance" else np.all(load == 0.0)
        phase = gait.stance if mark.phase == "stance" else gait.flight
        s = (track.t[inside] - mark.t) / phase.duration
        motion = phase.motion(robot, s)
        np.testing.assert_allclose(track.torque[inside], motion.tau, atol=1e-9)
        np.testing.assert_allclose(track.forces[inside], motion.lam, atol=1e-9)


def test_the_view_follows_a_steady_run_to_its_very_end(scene: Scene, hop: Track) -> None:
    ends = hop.t[[0, -1]]
    np.testing.assert_allclose(scene.view(ends)[:, 0], 0.5 * ends, atol=1e-6)
