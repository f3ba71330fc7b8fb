"""Configuration: every parameter with unit and limits, distributions of it, presets, TOML files.

Begin with `sections` (a sample's parameters, one file a section), then `config` (those of the whole data set) and
`loading` (from a file to a `Config`). A new parameter is a field of its section, a new section a file and a line in
`sample.SampleSpec`, a preset a file in `presets` and a name in `presets.PRESETS`.
"""
