"""From the pixels to the host: how a sensor reads its events out, and what goes wrong on the way.

Begin with `settings.Readout` (what can be set), then `sensor_readout` (the stages in a row). A new stage is a file with
a class of `stage.Stage`'s kind and a line in `sensor_readout.SensorReadout`.
"""
