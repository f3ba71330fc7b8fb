"""Configurations that come with the package, a TOML file each. The help of the command line names them: nothing here
reads one."""

PRESETS = ("demo", "simple", "complex", "complex-real", "wild", "finger", "hold", "hold-wild", "lift", "play")
