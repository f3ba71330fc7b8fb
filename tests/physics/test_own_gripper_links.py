"""Grippers from URDF or MJCF: they are what their files say, and wrong ones are told."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.onset import onset_mass
from evslip.physics.robots.description import FINGER_Z_M, TCP_M, corners_of
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.physics.robots.model import spec_of
from evslip.physics.robots.own import load
from evslip.physics.robots.urdf import robots_folder
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering.geometry.hand import LEFT, RIGHT, assemble, part_mesh
from robot_files import changed, refused

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_robot"
PANDA = robots_folder() / "panda_description" / "urdf" / "panda.urdf"
PANDA_FILE = """
format = "evslip robot"
version = 1
[gripper]
file = "FILE"
base = "panda_hand"
joints = ["panda_finger_joint1", "panda_finger_joint2"]
force_n = [0.5, 70.0]
pads = { z_m = 0.1034, size_m = 0.017 }
"""
PANDA_ARM = """
[arm]
file = "FILE"
flange = "panda_link7"
mount_m = [0.0, 0.0, 0.107]
mount_rpy_deg = [0.0, 0.0, -45.0]
rest_deg = [0.0, -14.3, 0.0, -134.6, 0.0, 120.3, 45.0]
"""


@pytest.fixture
def robot(tmp_path) -> Path:
    return Path(shutil.copytree(EXAMPLE, tmp_path / "lab")) / "urdf_gripper.toml"


def panda(tmp_path: Path, more: str = "") -> Path:
    path = tmp_path / "panda.toml"
    path.write_text((PANDA_FILE + more).replace("FILE", str(PANDA)))
    return path


def fingers(gripper, travel_m: float) -> list[np.ndarray]:
    mesh, parts = assemble(travel_m, gripper=gripper)
    return [mesh.corners[parts == part].reshape(-1, 3) for part in (LEFT, RIGHT)]


def test_it_is_what_its_file_says():
    own = load(str(EXAMPLE / "urdf_gripper.toml"))
    gripper = own.robot.gripper
    # The jaws begin at 1 mm where the joints are at 0, so that pads of 2 mm touch where they are at 1 mm.
    assert gripper.stroke_m == pytest.approx(0.039)
    assert any("left pad is in the middle where left_slide is at 1 mm" in text for text in own.assumed)
    assert [part.mass_kg for part in (gripper.palm, *gripper.jaws)] == pytest.approx([0.6, 0.06, 0.06])
    for side, corners in zip((1, -1), fingers(gripper, 0.0), strict=True):
        outward = side * corners[:, 1]
        assert (outward.min(), outward.max()) == pytest.approx((0.0, 0.024), abs=1e-9)
        low, high = corners[:, 2].min(), corners[:, 2].max()
        assert (low, high) == pytest.approx(np.array([0.08, 0.158]) - 0.15 + TCP_M[2])
    boxes = corners_of(gripper.finger.boxes)
    assert boxes[:, 1].min() == 0.0 and boxes[:, 2].max() == pytest.approx(0.158 - 0.15 + TCP_M[2] - FINGER_Z_M)


def test_it_holds_below_the_onset_and_slips_above():
    params = draw(load_config("simple", {"robot.kind": str(EXAMPLE / "urdf_gripper.toml")}), 0)
    for share, slips in ((0.85, False), (1.2, True)):
        body = params.object.model_copy(update={"mass_kg": share * onset_mass(params)})
        truth = measure(simulate(params.model_copy(update={"object": body})))
        assert (truth.onset_us is not None) == slips


def test_the_hand_of_the_panda_from_its_own_urdf_is_the_built_in_one(tmp_path):
    gripper = load(str(panda(tmp_path))).robot.gripper
    # The meshes' pads lie 0.07 mm beyond the middle at 0, and rubber of 2 mm is before them.
    shift = np.array([0.0, 0.002 + 7e-5, 0.0])
    for side, own, built_in in zip((1, -1), fingers(gripper, 0.01), fingers(PANDA_HAND, 0.01), strict=True):
        # Of the own finger, the pad comes last.
        assert own[: len(built_in)] == pytest.approx(built_in + side * shift, abs=1e-5)
    assert gripper.palm.mass_kg > 0.5
    assert gripper.length_m == PANDA_HAND.length_m


def test_an_arm_and_its_hand_may_be_in_one_file(tmp_path):
    robot = load(str(panda(tmp_path, PANDA_ARM))).robot
    model = spec_of(robot, 5.0).compile()
    # Seven joints of the arm and two of the gripper: the file's own fingers, behind the flange, do not dangle.
    assert model.nq == model.nu == 9
    assert [model.body(k).name for k in range(model.nbody)][-3:] == ["hand", "left_finger", "right_finger"]


def test_an_mjcf_is_the_same_gripper_as_its_urdf(robot):
    urdf = load(str(robot)).robot.gripper
    text = (robot.parent / "gripper.urdf").read_text()
    spec = mujoco.MjSpec.from_string(
        text.replace("</robot>", '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco></robot>')
    )
    spec.compile()
    (robot.parent / "gripper.xml").write_text(spec.to_xml())
    mjcf = load(str(changed(robot, ("gripper.urdf", "gripper.xml")))).robot.gripper
    assert mjcf.stroke_m == pytest.approx(urdf.stroke_m)
    for own, other in zip((mjcf.palm, *mjcf.jaws), (urdf.palm, *urdf.jaws), strict=True):
        assert np.ptp(corners_of(own.boxes), axis=0) == pytest.approx(np.ptp(corners_of(other.boxes), axis=0), abs=1e-6)
        assert own.mass_kg == pytest.approx(other.mass_kg)


def test_a_mirrored_finger_is_the_other_one(robot):
    before = load(str(robot)).robot.gripper
    # The same file seen from behind: x and y turned by half a turn, so that the joints change sides.
    sides = 'joints = ["left_slide", "right_slide"]', 'joints = ["right_slide", "left_slide"]'
    after = load(str(changed(robot, sides, ('base = "palm"', 'base = "palm"\nmount_rpy_deg = [0.0, 0.0, 180.0]'))))
    for own, other in zip(after.robot.gripper.jaws, before.jaws, strict=True):
        own_m, other_m = (np.sort(corners_of(part.boxes), axis=0) for part in (own, other))
        assert own_m == pytest.approx(other_m, abs=1e-9)


def test_a_mesh_has_the_colour_of_its_description(robot):
    box = '<box size="0.05 0.13 0.06"/>'
    trimesh.creation.box((0.05, 0.13, 0.06)).export(robot.parent / "palm.stl")
    as_box = part_mesh(load(str(robot)).robot.gripper.palm)
    changed(robot.parent / "gripper.urdf", (box, '<mesh filename="palm.stl"/>'))
    as_mesh = part_mesh(load(str(robot)).robot.gripper.palm)
    assert np.unique(as_mesh.albedo, axis=0) == pytest.approx(np.unique(as_box.albedo, axis=0))


def test_a_material_may_be_named_before_or_after_its_colour_is_given(robot):
    before = load(str(robot)).robot.gripper.palm.looks
    blue = '<material name="blue"><color rgba="0.20 0.35 0.60 1"/></material>'
    named = (blue, '<material name="blue"/>'), ("</robot>", f"{blue}</robot>")
    changed(robot.parent / "gripper.urdf", *named)
    assert [look.colour for look in load(str(robot)).robot.gripper.palm.looks] == [look.colour for look in before]


def test_a_capsule_is_the_cylinder_around_it(robot):
    cylinder = '<cylinder radius="0.035" length="0.02"/>'
    changed(robot.parent / "gripper.urdf", (cylinder, cylinder.replace("cylinder", "capsule")))
    corners = np.array(load(str(robot)).robot.gripper.palm.looks[0].corners_m)
    assert np.ptp(corners, axis=0) == pytest.approx((0.07, 0.07, 0.09))


SLIDE = 'joint name="left_slide" type="prismatic"'
WRONG = [
    ('base = "palm"', "", r"gripper\.base: this key is missing; a gripper from a file has file, base, joints, pads"),
    ('base = "palm"', 'base = "hand"', r"gripper\.base: 'hand' is no link of gripper\.urdf; expected one of palm"),
    ('file = "gripper.urdf"', 'file = "none.urdf"', r"gripper\.file: none\.urdf: no such file beside it"),
    ('file = "gripper.urdf"', 'file = "robot.toml"', r"not valid XML"),
    ('"right_slide"]', '"slide"]', r"joints\.1: 'slide' is no joint of gripper\.urdf; its sliding ones: left"),
    ('"right_slide"]', '"left_slide"]', r"gripper\.joints: both are 'left_slide'"),
    ('"right_slide"]', '"right_slide", "x"]', r"gripper\.joints: .*at most 2"),
    ('"left_slide", "right_slide"', '"right_slide", "left_slide"', r"r\.joints: .* are swapped; expected \['left"),
    ("force_n", "palm = { boxes = [] }\nforce_n", r"gripper\.palm"),
    ("z_m = 0.15  ", "z_m = 0.17  ", r"gripper\.pads: of the pad of 16 mm at z_m = 0\.17, 0% has left_jaw behind it"),
    ("size_m = 0.016", "size_m = 0.016\nthickness_m = 0.0005", r"joints\.0: 'left_slide' leaves 1\.00 mm"),
    ("force_n", "stroke_m = 0.05\nforce_n", r"gripper\.stroke_m: 0\.05 is more than the joints go, 0\.039 m"),
    ('"palm"', '"palm"\nmount_rpy_deg = [0.0, 0.0, 90.0]', r"slides along \(1\.00, 0\.00, 0\.00\)"),
]  # fmt: skip
WRONG_FILES = [
    (
        SLIDE,
        'joint name="left_slide" type="revolute"',
        r"joints\.0: 'left_slide' is revolute; expected a sliding",
    ),
    (
        '<limit lower="0" upper="0.04" effort="40" velocity="0.1"/>',
        "",
        r"joints\.0: 'left_slide' has no <limit> of lower and upper",
    ),
    ('size="0.05 0.13 0.06"', 'size="50 130 60"', r"palm: reaches \d+.* m from its frame; .*millimetres"),
    (
        '<mass value="0.6"/>',
        '<mass value="inf"/>',
        r"gripper\.file: .*link 'palm' has a mass of inf; expected a finite",
    ),
    ('<box size="0.05 0.13 0.06"/>', '<mesh filename="palm.stl"/>', r"palm: palm\.stl: there is no such file"),
    (
        '<box size="0.05 0.13 0.06"/>',
        '<plane size="1"/>',
        r"gripper\.urdf: link 'palm' has a <plane>; expected one of box, cylinder, sphere, capsule, mesh",
    ),
    ('<box size="0.05 0.13 0.06"/>', '<box size="wide"/>', r"gripper\.file: a number or an attribute is wrong"),
    (
        'size="0.05 0.13 0.06"',
        'size="0.05 nan 0.06"',
        r"gripper\.file: .*: '0\.05 nan 0\.06', expected 3 finite numbers",
    ),
    ('size="0.05 0.13 0.06"', 'size="0.05 0 0.06"', r"gripper\.file: palm has a shape that is flat; expected one with"),
    ('size="0.018 0.010 0.078"', 'size="0.018 0 0.078"', r"gripper\.file: left_jaw has a shape that is flat; expected"),
    (
        '<parent link="palm"/><child link="left_jaw"/>',
        '<parent link="right_jaw"/><child link="left_jaw"/>',
        r"joints\.0: 'left_slide' is not on 'palm'; expected a joint that gripper\.base carries",
    ),
]


@pytest.mark.parametrize(("old", "new", "says"), WRONG)
def test_a_wrong_gripper_is_told_in_one_line(robot, old, new, says):
    refused(changed(robot, (old, new)), says)


@pytest.mark.parametrize(("old", "new", "says"), WRONG_FILES)
def test_a_wrong_urdf_of_a_gripper_is_told_in_one_line(robot, old, new, says):
    changed(robot.parent / "gripper.urdf", (old, new))
    refused(robot, says)
