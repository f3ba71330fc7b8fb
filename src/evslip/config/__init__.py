"""What can be asked for: every parameter with unit and limits, distributions of it, presets, TOML files.

Begin with `schema` (the parameters), then `loading` (from a file to a `Config`).
A new parameter is a field of its section in `schema`; a preset is a file in `presets` and a name in `loading.PRESETS`.
"""
