"""Quality of a recording: what of its events comes from the readout, the pixels or the lamp instead of the scene.

Begin with `quality.QualityMeter`, which takes a stream part by part; `findings` says what of it hurts a detector.
A new question is a module with a function of `rates.Rates` or of `pixel_activity.PixelActivity`, a field of `Quality`.
"""
