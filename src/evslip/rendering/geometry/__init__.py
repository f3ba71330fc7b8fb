"""Shapes in the image: the robot's hand and links, faces, silhouettes, planes, triangles.

Begin with `coverage` (the share of a pixel that a face covers) and `hand` (the robot as the camera sees it).
"""
