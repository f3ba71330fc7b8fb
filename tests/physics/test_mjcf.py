"""MJCFs as URDFs: what MuJoCo shows and has of them is what is read."""

from pathlib import Path

import pytest

from evslip.physics.robots.urdf import Shape, described, tree

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
