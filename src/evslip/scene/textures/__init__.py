"""Textures by name: `library` finds them, `patterns` and `panoramas` draw them, on a `canvas`."""
