"""The object: its shape, its size, its mass and where it stands."""

from typing import Annotated, Generic

from evslip.config.section import LATER, N, OneOf, S, Section, Within, usual
from evslip.scene.shapes import SHAPES

FINISHES = ("texture", "matt", "plastic", "film", "metal")


class ObjectSpec(Section, Generic[N, S]):
    """The object. At the start its sides are parallel to the table's axes; its depth is the gripped side."""

    shape: Annotated[S, OneOf(tuple(SHAPES))] = usual("cuboid")
    """cuboid, cylinder (upright, round: its diameter is depth_m, and width_m follows) or mesh (a file)."""
    mesh: S | None = None
    """Path of a watertight mesh (.stl .ply .obj .off .glb .gltf .dae), z up; for shape mesh alone."""
    mesh_fit: Annotated[S, OneOf(("stretch", "height", "own"))] = usual("stretch")
    """Stretch: the mesh's bounding box becomes width_m x depth_m x height_m. Height: scaled evenly to height_m. Own:
    the file is in metres. The dimensions that result replace the ones drawn."""
    width_m: Annotated[N, Within(0.01, 0.2)]
    """Size along world x, in the image plane of the side camera."""
    depth_m: Annotated[N, Within(0.005, 0.075, "the Panda's hand opens to 0.078 m")]
    """Size along world y, between the pads; the Panda's hand opens to 0.078 m."""
    height_m: Annotated[N, Within(0.02, 0.25)]
    """Size along world z."""
    mass_kg: Annotated[N, Within(0.001, 2.0)]
    """Mass."""
    density_kg_m3: Annotated[N | None, Within(1.0, 25000.0)] = None
    """If given, the mass is this times the object's volume, and replaces mass_kg."""
    com_x_m: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Centre of mass along the width, from where it is when the object is evenly filled."""
    com_y_m: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Centre of mass along the depth, between the pads, likewise."""
    com_z_m: Annotated[N, Within(-0.125, 0.125)] = usual(0.0)
    """Centre of mass upwards, likewise."""
    x_m: Annotated[N, Within(-1.0, 1.0)]
    """Centre on the table, along the robot's forward axis."""
    y_m: Annotated[N, Within(-1.0, 1.0)]
    """Centre on the table, to the robot's left."""
    texture: S
    """Name of a texture of the pool, or path of an image; patterns and folders are drawn from."""
    finish: Annotated[S, OneOf(FINISHES), LATER] = usual("texture")
    """How it shines. Texture: wood, tile, plastic and metal textures have broad highlights, all else is matt. Whatever
    the texture: matt, plastic (highlights of the lamp and a little of the surroundings), film (clear and smooth: narrow
    bright highlights) or metal (mirrors lamp and surroundings, blurred, in the texture's colours)."""
    roughness: Annotated[N | None, Within(0.1, 1.0), LATER] = None
    """Roughness of plastic, film and metal: small makes highlights narrow. Null: the finish's own, 0.3, 0.1 and 0.4."""
