"""Parameters of the event pixels from recordings of a real sensor.

Begin with `calibration.calibrate`; `still` fits the noise of what stands still, `fit` all else by simulating the
recording's own frames, and `statistics` says in what recording and simulation are compared.
"""
