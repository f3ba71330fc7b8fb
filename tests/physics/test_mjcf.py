"""MJCFs as URDFs: what MuJoCo shows and has of them is what is read."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from evslip.physics.robots.hulls import shape_corners
from evslip.physics.robots.urdf import Shape, described, tree
from evslip.utils.errors import ConfigError

GEOMS = """
<mujoco>
  <asset><material name="red" rgba="0.8 0.1 0.1 1"/></asset>
  <worldbody>
    <body name="part">
      <geom type="sphere" size="0.01" group="2" contype="0" conaffinity="0"/>
      <geom type="sphere" size="0.02" group="3"/>
      <geom type="sphere" size="0.03" rgba="1 0 0 0"/>
      <geom type="sphere" size="0.04" material="red" rgba="0 0 1 0"/>
      <geom type="sphere" size="0.05" material="red"/>
      <geom type="sphere" size="0.06" material="red" rgba="0 0 1 1"/>
    </body>
  </worldbody>
</mujoco>
"""

MESH = """
<mujoco>
  <asset><mesh name="odd" file="odd.stl" HOW/></asset>
  <worldbody><body name="part"><geom type="mesh" mesh="odd" pos="0.1 0.2 0.3" euler="10 20 30"/></body></worldbody>
</mujoco>
"""
SPLIT = """
<mujoco>
  <worldbody>
    <body name="hand">
      <geom size="0.1"/>
      <body name="left"><joint name="l" type="slide" range="0 0.04"/><geom size="0.1"/></body>
      <body name="right"><joint name="r" type="slide" range="0 0.04"/><geom size="0.1"/></body>
    </body>
  </worldbody>
  <tendon><fixed name="split"><joint joint="l" coef="0.5"/><joint joint="r" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="l" joint2="r"/></equality>
  <actuator><general tendon="split" forcerange="-9 9"/><motor joint="r" forcerange="-7 7"/></actuator>
</mujoco>
"""


def with_mesh(folder: Path, how: str) -> Path:
    """An MJCF of a mesh that has no symmetry."""
    corners = [[0, 0, 0], [0.04, 0, 0.01], [0, 0.06, 0], [0.01, 0.02, 0.1]]
    trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).export(folder / "odd.stl")
    (folder / "part.xml").write_text(MESH.replace("HOW", how))
    return folder / "part.xml"


def shapes(path: Path, name: str = "part") -> tuple[tuple[Shape, ...], tuple[Shape, ...]]:
    """What is seen and what may be touched of a body."""
    path = path.resolve()
    link = described(path, next(link for link in tree(path).iter("link") if link.attrib["name"] == name))
    return link.looks, link.collisions


def test_what_mujoco_shows_is_seen(tmp_path):
    (tmp_path / "part.xml").write_text(GEOMS)
    seen, touched = ([round(shape.corners[:, 2].max(), 2) for shape in s] for s in shapes(tmp_path / "part.xml"))
    assert seen == [0.01, 0.05, 0.06]
    assert touched == [0.02, 0.03, 0.04, 0.05, 0.06]


def test_a_geom_has_its_own_colour_or_that_of_its_material(tmp_path):
    (tmp_path / "part.xml").write_text(GEOMS)
    colours = [shape.colour for shape in shapes(tmp_path / "part.xml")[0]]
    expected = [(0.5, 0.5, 0.5), (0.8, 0.1, 0.1), (0, 0, 1)]
    for colour, own in zip(colours, expected, strict=True):
        assert colour == pytest.approx(own)


@pytest.mark.parametrize(
    "how",
    [
        "",
        'refpos="0.1 0.02 0"',
        'refquat="0.9 0.1 0.2 0"',
        'refpos="0.1 0.02 0" scale="1 2 -1"',
        'refpos="0.1 0.02 0" refquat="0.9 0.1 0.2 0" scale="2 2 2"',
        'refpos="0.1 0.02 0" refquat="0.9 0.1 0.2 0" scale="-1 1 1"',
        'refpos="0.1 0.02 0" refquat="1 1 0 0" scale="1 2 3"',
    ],
)
def test_a_mesh_is_where_mujoco_has_it(tmp_path, how):
    path = with_mesh(tmp_path, how)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    theirs = model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    ours = shape_corners(shapes(path)[0][0])
    apart = np.linalg.norm(theirs[:, None] - ours, axis=2)
    assert max(apart.min(0).max(), apart.min(1).max()) < 1e-6


def test_a_mesh_that_is_stretched_askew_is_refused(tmp_path):
    path = with_mesh(tmp_path, 'refquat="0.9 0.1 0.2 0" scale="1 2 1"')
    with pytest.raises(
        ConfigError, match=r"part\.xml: mesh 'odd' has a refquat and a scale that differs along its axes"
    ):
        tree(path)


def test_of_actuators_only_those_of_joints_are_read(tmp_path):
    (tmp_path / "hand.xml").write_text(SPLIT)
    joints = {joint.attrib["name"]: joint for joint in tree(tmp_path / "hand.xml").iter("joint")}
    limits = [joints[name].find("limit") for name in ("l", "r")]
    assert [None if limit is None else float(limit.attrib["effort"]) for limit in limits] == [0.0, 7.0]
