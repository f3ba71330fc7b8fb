"""Scene: shapes of objects, textures, kinds of motion. Nothing here knows of the robot or of a camera.

Begin with the registers: `shapes.SHAPES`, `textures.patterns.MATERIALS`, `motions.KINDS`.
A new kind is a file of its own beside its siblings and one line in the register.
"""
