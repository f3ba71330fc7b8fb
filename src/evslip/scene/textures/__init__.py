"""Textures by name: `library` finds them, `patterns` and `panoramas` draw them with what is in `drawing`."""
