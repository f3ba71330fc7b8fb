"""Bodies that keep light away: boxes, meshes and all of them together before the lamp, and bodies nearby.

Begin with `casters`.
"""
