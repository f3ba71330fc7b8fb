"""Robots from files: what they are read as, that physics and drawing hold on them, and what wrong files are told."""

import shutil
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.draws.draw import draw
from evslip.physics.onset import onset_mass
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import FINGER_Z_M, TCP_M, corners_of
from evslip.physics.robots.model import spec_of
from evslip.physics.robots.own import load
from evslip.physics.robots.urdf import chain, tree
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering import render
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import LEFT, RIGHT, assemble, box_parts, shadow_boxes
from evslip.rendering.geometry.links import link_mesh, link_poses
from evslip.utils.errors import ConfigError, PlanRejected
from robot_files import changed, refused

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_robot"
TINY = {"camera.width": 96, "camera.height": 72, "motion.duration_s": 6.0}
MJCF = """
<mujoco>
  <compiler angle="degree" meshdir="parts"/>
  <default><joint damping="1"/><default class="look"><geom contype="0" conaffinity="0"/></default></default>
  <asset><mesh name="lid" file="lid.stl" scale="0.001 0.001 0.001"/><material name="red" rgba="0.8 0.1 0.1 1"/></asset>
  <worldbody>
    <light pos="0 0 2"/>
    <body name="base" pos="0 0 0.1" euler="0 0 20">
      <geom type="box" size="0.08 0.08 0.05"/>
      <body name="one" pos="0.01 0 0.1" euler="0 10 0">
        <joint name="a" axis="0 0 1" range="-170 170" actuatorfrcrange="-80 80"/>
        <geom type="capsule" size="0.05 0.1" pos="0 0 0.1" material="red"/>
        <body name="two" pos="0 0 0.3" quat="0.9 0.1 0.3 -0.2">
          <joint name="b" axis="0 1 0" pos="0.02 0.03 0.01" range="-120 120"/>
          <geom class="look" type="mesh" mesh="lid" pos="0.1 0 0" euler="30 0 15"/>
          <geom type="sphere" size="0.06" mass="1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="b" kp="100" forcerange="-50 50"/></actuator>
</mujoco>
"""


@pytest.fixture
def robot(tmp_path) -> Path:
    return Path(shutil.copytree(EXAMPLE, tmp_path / "lab")) / "robot.toml"


def params_of(file, index=0, mass_of_onset=None, **overrides):
    changes = {key.replace("__", "."): value for key, value in overrides.items()}
    params = draw(load_config("simple", TINY | {"robot.kind": str(file)} | changes), index)
    if mass_of_onset is None:
        return params
    obj = params.object.model_copy(update={"mass_kg": mass_of_onset * onset_mass(params)})
    return params.model_copy(update={"object": obj})


def stl(path: Path, corners: np.ndarray) -> Path:
    """A binary STL of a tetrahedron."""
    faces = [corners[list(face)] for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))]
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0) for face in faces)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + rows)
    return path


@pytest.fixture(scope="module")
def held():
    return simulate(params_of(EXAMPLE / "robot.toml", mass_of_onset=0.85, camera__mount="robot"))


def test_it_holds_below_the_onset_and_slips_above(held):
    assert measure(held).onset_us is None
    assert measure(simulate(params_of(EXAMPLE / "robot.toml", mass_of_onset=1.2))).onset_us is not None


def test_it_is_drawn_with_both_fingers_and_from_where_its_file_says(held):
    frame = next(render(held, times_us=np.array([int(held.t_us[-1] // 2)])))
    assert {2, 3} <= set(np.unique(frame.bodies).tolist())
    robot, camera = robot_of(held.params.robot), hand_camera(held.params)
    assert camera.position == pytest.approx(np.array([0.10, 0.22, 0.12 - 0.15]) + TCP_M)
    assert -camera.rotation[:, 2] == pytest.approx((TCP_M - camera.position) / np.linalg.norm(TCP_M - camera.position))
    mesh, parts = assemble(0.0, gripper=robot.gripper)
    left, right = (mesh.corners[parts == part].reshape(-1, 3) for part in (LEFT, RIGHT))
    # As the file has them, closed: the left jaw ends 12 mm, the right one's heel 30 mm from the middle.
    assert (left[:, 1].min(), left[:, 1].max()) == pytest.approx((0.0, 0.012), abs=1e-9)
    assert (right[:, 1].min(), right[:, 1].max()) == pytest.approx((-0.030, 0.0), abs=1e-9)
    assert right[:, 2].min() == pytest.approx(0.08 - 0.15 + TCP_M[2])
    boxes = shadow_boxes(0.0, gripper=robot.gripper)
    assert len(boxes.places) == len(box_parts((LEFT, RIGHT), robot.gripper)) == 2 + 2 + 3


def test_an_arm_of_bodies_without_meshes_is_where_mujoco_has_it():
    arm = load(str(EXAMPLE / "robot.toml")).robot.arm
    assert arm is not None
    model = mujoco.MjModel.from_xml_path(str(arm.urdf))
    data, joints = mujoco.MjData(model), np.random.default_rng(0).uniform(-1.5, 1.5, (4, 6))
    poses = link_poses(arm, joints)
    for k, angles in enumerate(joints):
        data.qpos[:] = angles
        mujoco.mj_kinematics(model, data)
        assert poses.places[k, -1] == pytest.approx(data.body("wrist").xpos, abs=1e-9)
    upper = link_mesh(arm, 2).corners.reshape(-1, 3)
    assert np.ptp(upper, axis=0) == pytest.approx((0.08, 0.10, 0.44))
    cylinder = link_mesh(arm, 1)
    assert cylinder.albedo[0, 2] > 2 * cylinder.albedo[0, 0]  # its blue


def test_an_mjcf_is_the_same_arm_as_mujoco_makes_of_it(tmp_path):
    lid = np.array([[0.0, 0, 0], [40, 0, 0], [0, 60, 0], [10, 10, 80]])
    stl(tmp_path / "parts" / "lid.stl", lid)
    (tmp_path / "arm.xml").write_text(MJCF)
    links = chain(tmp_path / "arm.xml", ("a", "b"))
    model = mujoco.MjModel.from_xml_string(MJCF.replace('"parts"', f'"{tmp_path}/parts"'))
    data = mujoco.MjData(model)
    base = data.body("base")
    mujoco.mj_kinematics(model, data)
    start = base.xmat.reshape(3, 3).T.copy(), base.xpos.copy()
    for angles in np.random.default_rng(1).uniform(-1, 1, (3, 2)):
        data.qpos[:] = angles
        mujoco.mj_kinematics(model, data)
        place, turn = np.zeros(3), np.eye(3)
        for link, angle in zip(links[1:], angles, strict=True):
            place = place + turn @ link.origin.place
            c, s = np.cos(angle), np.sin(angle)
            spun = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            turn = turn @ link.origin.turn @ link.axis_turn @ spun @ link.axis_turn.T
        geom = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)[0]
        seen = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        own = next(shape for shape in links[2].looks if shape.file is not None)
        ours = (lid * own.scale) @ own.origin.turn.T + own.origin.place
        assert sorted((seen - start[1]) @ start[0].T @ np.ones(3)) == pytest.approx(
            sorted((ours @ turn.T + place) @ np.ones(3)), abs=1e-6
        )
    assert len(links[2].collisions) == 1  # what nothing touches is seen alone


@pytest.mark.parametrize(("kind", "unit"), [("hinge", "1.571 rad"), ("slide", "90 m")])
def test_a_joint_of_an_mjcf_with_a_ref_is_refused(tmp_path, kind, unit):
    joint = f'<joint name="c" type="{kind}" ref="90" range="0 180"/><geom size="1"/>'
    (tmp_path / "arm.xml").write_text(f"<mujoco><worldbody><body>{joint}</body></worldbody></mujoco>")
    with pytest.raises(ConfigError, match=rf"^{tmp_path}/arm\.xml: joint 'c' has a ref of {unit}; expected 0, as in a"):
        tree(tmp_path / "arm.xml")


def test_a_relative_path_is_another_robot_in_another_folder(tmp_path, monkeypatch):
    for name in ("small", "large"):
        (tmp_path / name).mkdir()
        text = f'format = "evslip robot"\nversion = 1\n[gripper]\nname = "{name}"\n'
        (tmp_path / name / "robot.toml").write_text(text)
        monkeypatch.chdir(tmp_path / name)
        assert load("robot.toml").robot.gripper.name == name


def test_a_link_to_itself_is_told(tmp_path):
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    with pytest.raises(ConfigError, match=r"loop\.toml: cannot be opened"):
        load(str(tmp_path / "loop.toml"))


def test_a_urdf_may_have_settings_of_mujoco(robot):
    settings = '<mujoco><compiler fusestatic="true" discardvisual="true"/></mujoco></robot>'
    changed(robot.parent / "arm.urdf", ("</robot>", settings))
    assert spec_of(load(str(robot)).robot, 1.0).compile().nq == 8


def test_a_finger_may_be_seen_as_a_mesh(robot):
    mesh = np.array([[-8.0, 2, 80], [8, 2, 80], [0, 12, 80], [0, 2, 158]])
    stl(robot.parent / "jaw.stl", mesh)
    changed(robot, ("[gripper.left]  ", '[gripper.left]\nmesh = "jaw.stl"\nmesh_scale = 0.001\n#'))
    seen, parts = assemble(0.0, gripper=load(str(robot)).robot.gripper)
    left = seen.corners[parts == LEFT].reshape(-1, 3)
    assert left.min(axis=0) == pytest.approx((-0.008, 0.002, 0.08 - 0.15 + TCP_M[2]), abs=1e-6)


def test_a_built_in_arm_may_carry_an_own_gripper_and_a_built_in_gripper_an_own_arm(robot):
    text = robot.read_text()
    start, end = text.index("[arm]"), text.index("# Places")
    robot.write_text(text[:start] + '[arm]\nname = "ur5"\n' + text[end:])
    assert load(str(robot)).robot.arm is robot_of(load_config("simple", {"robot.kind": "ur5"}).robot).arm
    robot.write_text(text[: text.index("[gripper]")] + '[gripper]\nname = "large"\n')
    assert load(str(robot)).robot.gripper.name == "large"
    robot.write_text(text[:start] + text[end:])
    assert load(str(robot)).robot.arm is None
    assert simulate(params_of(robot)).joints.shape[1] == 9


def test_a_mesh_of_a_link_has_the_colour_of_its_description(robot):
    box, arm = '<geometry><box size="0.08 0.10 0.44"/></geometry>', robot.parent / "arm.urdf"
    trimesh.creation.box((0.08, 0.10, 0.44)).export(robot.parent / "upper.stl")
    material = '<material name=""><color rgba="0.02 0.02 0.02 1"/></material>'
    changed(arm, (box, f'<geometry><mesh filename="upper.stl"/></geometry>{material}'))
    arm = load(str(robot)).robot.arm
    assert arm is not None
    assert link_mesh(arm, 2).albedo.max() < 0.01


def test_a_link_without_a_shape_is_not_seen(robot):
    arm = robot.parent / "arm.urdf"
    box = '<visual><origin xyz="0 0 0.19"/><geometry><box size="0.08 0.10 0.44"/></geometry></visual>'
    changed(arm, (box, ""))
    assert "arm: upper has no shape, so that nothing of it is seen" in load(str(robot)).assumed
    frame = next(iter(render(simulate(params_of(robot)), outputs=("depth",))))
    assert frame.luminance.mean() > 0.01 and frame.depth.min() > 0.05


def test_a_change_of_the_file_never_passes_unnoticed(robot):
    params = params_of(robot)
    text = dump_config(load_config("simple", {"robot.kind": str(robot), "robot.sha256": params.robot.sha256}))
    assert draw(config_from_text(text), 0).robot == params.robot
    changed(robot.parent / "arm.urdf", ('mass value="3"', 'mass value="3.5"'))
    with pytest.raises(ConfigError, match=r"^robot\.sha256: .* has changed: its digest is .*, expected .*new data set"):
        simulate(params)
    with pytest.raises(ConfigError, match=r"^robot\.sha256: .* has changed"):
        draw(config_from_text(text), 0)
    robot.unlink()
    with pytest.raises(ConfigError, match=r"robot\.toml: no such file"):
        simulate(params)


def test_pads_have_limits_of_force_and_friction(robot):
    for key, value in (("grip.force_n", 45.0), ("grip.force_n", 0.3), ("grip.friction", 1.2)):
        with pytest.raises(PlanRejected, match=rf"^{key}: {value:g} is .* the robot gripper's"):
            simulate(params_of(robot, **{key.replace(".", "__"): value}))


def test_long_fingers_stay_off_the_table(robot):
    changed(robot, ("0.119], size_m = [0.016, 0.010, 0.078]", "0.124], size_m = [0.016, 0.010, 0.088]"))
    gripper = load(str(robot)).robot.gripper
    tip = corners_of(gripper.finger.boxes)[:, 2].max() + FINGER_Z_M - TCP_M[2]
    assert tip == pytest.approx(0.018)
    with pytest.raises(PlanRejected, match=r"grip\.depth_m: .* puts the finger tips into the table .* at most 0\.072"):
        simulate(
            params_of(
                robot, object__height_m=0.09, grip__depth_m=0.05, grip__offset=0.0, object__width_m=0.05
            ).model_copy(update={"grip": params_of(robot).grip.model_copy(update={"depth_m": 0.0755})})
        )


WRONG = [
    ('format = "evslip robot"', 'format = "x"', r"is no robot; its first lines are expected to be format"),
    ("stroke_m = 0.04", "stroke_mm = 40.0", r"gripper\.stroke_mm: unknown key; did you mean stroke_m\?"),
    ("stroke_m = 0.04", "stroke_m = 40.0", r"gripper\.stroke_m: 40 is out of range.*is this in millimetres\?"),
    ("stroke_m = 0.04", "", r"gripper\.stroke_m: this key is missing"),
    (
        "size_m = [0.06, 0.06, 0.02]",
        "size_m = [60, 60, 20]",
        r"palm\.boxes\.0\.size_m: 60 is out of range.*millimetres",
    ),
    ("[0.0, 0.007, 0.119]", "[0.0, 0.007, 0.090]", r"gripper\.left\.boxes: the pad of 16 mm is 29\.0 mm off the jaw"),
    (
        "[0.0, 0.007, 0.119]",
        "[0.0, 0.013, 0.119]",
        r"gripper\.left\.boxes: .* 6\.0 mm off the jaw; expected a box that",
    ),
    ("[0.0, 0.007, 0.119]", "[0.0, 0.004, 0.119]", r"left\.boxes\.0: reaches 1\.00 mm beyond the middle"),
    ("[0.0, -0.008, 0.134]", "[0.0, 0.008, 0.134]", r"right\.boxes\.0: reaches 14\.00 mm beyond the middle"),
    ("[0.0, 0.0, 0.05]", "[0.0, 0.0, 0.12]", r"gripper\.palm: reaches to 0\.0 mm from the pads' middle"),
    ("force_n = [0.5, 40.0]", "force_n = [40.0, 0.5]", r"gripper\.force_n: 40 is above 0\.5"),
    ('file = "arm.urdf"', 'file = "none.urdf"', r"arm\.file: none\.urdf: no such file beside it"),
    ('file = "arm.urdf"', 'file = "robot.toml"', r"not valid XML"),
    ('file = "arm.urdf"', 'file = "arm.urdf"\nname = "ur5"', r"arm\.name: an arm has either a name"),
    (
        'flange = "wrist"',
        'flange = "hand"',
        r"arm\.flange: 'hand' is no link of arm\.urdf; expected one of base, shoulder",
    ),
    ("rest_deg = [0.0, 8.0,", "rest_deg = [8.0,", r"arm\.rest_deg: 5 entries for 6 joints: turn, lean, elbow"),
    ("rest_deg = [0.0, 8.0,", "rest_deg = [0.0, 180.0,", r"arm\.rest_deg: 180 of lean is outside its limits"),
    (
        "97.0, 0.0, 75.0",
        "97.0, 0.0, -75.0",
        r"arm\.rest_deg: there the tool centre is at .* 150 deg away from straight",
    ),
    ("180.0]", "90.0]", r"arm\.mount_rpy_deg: at rest the gripper's x axis is turned by 90 deg"),
    ("place_m = [0.10, 0.22, 0.12]", "", r"camera\.place_m: this key is missing"),
    (
        "[gripper.left]  ",
        '[gripper.left]\nmesh = "jaw.stl"\n#',
        r"gripper\.left\.mesh: jaw\.stl: there is no such file",
    ),
    ("[gripper.left]  ", '[gripper.left]\nmesh = "jaw.glb"\n#', r"gripper\.left\.mesh: jaw\.glb: unknown kind of mesh"),
]
STRAY_LOOP = """<link name="x"/><link name="y"/>
<joint name="xy" type="fixed"><parent link="x"/><child link="y"/></joint>
<joint name="yx" type="fixed"><parent link="y"/><child link="x"/></joint></robot>"""
WRONG_ARMS = [
    ('<robot name="box_arm">', '<!DOCTYPE r [<!ENTITY e SYSTEM "/etc/hosts">]><robot name="box_arm">', "has a DOCTYPE"),
    ('<robot name="box_arm">', "<robot", "not valid XML"),
    (
        'type="revolute"><parent link="fore"',
        'type="prismatic"><parent link="fore"',
        "joint 'roll' is prismatic; expected",
    ),
    ('<mass value="0.4"/>', "", "link 'wrist' has no mass; give it an <inertial>"),
    ('<mass value="0.4"/>', '<mass value="inf"/>', r"arm\.file: .*link 'wrist' has a mass of inf; expected a finite"),
    ('<mass value="0.4"/>', '<mass value="-1"/>', r"arm\.file: .*link 'wrist' has a mass of -1; expected a finite one"),
    ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', r"arm\.file: joint '\w+' has the axis 0 0 0; expected a direction"),
    ('effort="80" velocity="3"', "", r"arm\.torque_n_m: this key is missing, .* does not say it of turn"),
    ('xyz="0 0 0.38"', 'xyz="0 0 380"', r"its links are 380\.\d+ m long together; .*is it in metres"),
    (
        '<box size="0.08 0.10 0.44"/>',
        '<box size="80 100 440"/>',
        r"upper reaches 220.* m from its joint; .*millimetres",
    ),
    ('<box size="0.08 0.10 0.44"/>', '<mesh filename="upper.stl"/>', r"arm\.file: upper: upper\.stl: there is no such"),
    (
        '<box size="0.08 0.10 0.44"/>',
        '<box size="0.08 0 0.44"/>',
        r"arm\.file: upper is flat; expected a shape with a volume",
    ),
    ('<box size="0.08 0.10 0.44"/>', '<box size="wide"/>', r"arm\.file: a number or an attribute is wrong or missing"),
    ('<link name="fore">', '<link name="four">', r"arm\.file: joint 'elbow' ends at link 'fore', which is not there"),
    ("</robot>", STRAY_LOOP, r"arm\.file: link 'y' carries itself in a loop of joints; expected a tree"),
    ('xyz="0 0 0.38"', 'xyz="0 0.38"', r"arm\.file: .*: '0 0\.38', expected 3 finite numbers"),
    ('xyz="0 0 0.38"', 'xyz="0 0 0.38 0"', r"arm\.file: .*: '0 0 0\.38 0', expected 3 finite numbers"),
    ('<?xml version="1.0"?>', '<?xml version="1.0" encoding="foo"?>', r"not valid XML: unknown encoding: foo"),
    (
        '<visual><origin xyz="0 0 0.19"/>',
        '<visual><geometry><box size="0.1 0.1 0"/></geometry></visual><visual><origin xyz="0 0 0.19"/>',
        r"arm\.file: upper has a shape that is flat; expected one with a volume",
    ),
]


@pytest.mark.parametrize(("old", "new", "says"), WRONG)
def test_a_wrong_file_is_told_in_one_line(robot, old, new, says):
    refused(changed(robot, (old, new)), says)


@pytest.mark.parametrize(("old", "new", "says"), WRONG_ARMS)
def test_a_wrong_arm_is_told_in_one_line(robot, old, new, says):
    changed(robot.parent / "arm.urdf", (old, new))
    refused(robot, says)


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        (
            '<x:arm xmlns:x="http://www.ros.org/wiki/xacro"/>',
            r"arm\.urdf: is xacro, .* expected what `xacro arm\.urdf`",
        ),
        ("", r"arm\.urdf: has no <link>; expected a URDF of links and joints"),
    ],
)
def test_a_urdf_without_links_is_told_in_one_line(robot, inside, says):
    (robot.parent / "arm.urdf").write_text(f"<robot>{inside}</robot>")
    refused(robot, says)


def test_an_inertia_that_no_body_has_is_told(robot):
    changed(robot.parent / "arm.urdf", ('ixx="0.042" iyy="0.042" izz="0.006"', 'ixx="0.042" iyy="0.042" izz="0.6"'))
    with pytest.raises(ConfigError, match=r"robot\.toml: MuJoCo does not take this robot: .*inertia"):
        simulate(params_of(robot))


def test_a_mesh_that_is_too_large_is_not_read(robot):
    with (robot.parent / "jaw.stl").open("wb") as file:
        file.truncate(40 << 20)
    changed(robot, ("[gripper.left]  ", '[gripper.left]\nmesh = "jaw.stl"\n#'))
    with pytest.raises(ConfigError, match=r"gripper\.left\.mesh: jaw\.stl: larger than 32 MB; simplify the mesh"):
        load(str(robot))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"robot.kind": "FILE", "robot.gripper": "small"}, r"robot\.gripper: .* has a gripper of its own; leave this"),
        ({"robot.kind": "ur5", "robot.sha256": "0" * 64}, r"robot\.sha256: belongs to a robot's file"),
        ({"robot.kind": "ur6"}, r"robot\.kind: 'ur6' is unknown; expected one of panda, .* or a \.toml file"),
        ({"camera.mount": "robot"}, r"camera\.mount: 'robot' is where a robot's file puts it"),
    ],
)
def test_keys_that_do_not_go_with_the_robot_are_refused(changes, says):
    kind = {"robot.kind": str(EXAMPLE / "robot.toml")} if changes.get("robot.kind") == "FILE" else {}
    with pytest.raises(ConfigError, match=says):
        load_config("simple", changes | kind)


def test_a_camera_that_the_file_does_not_have_is_missed(robot):
    text = robot.read_text()
    robot.write_text(text[: text.index("[camera]")])
    with pytest.raises(ConfigError, match=r"camera\.mount: .* has no \[camera\] with place_m"):
        hand_camera(params_of(robot, camera__mount="robot"))
