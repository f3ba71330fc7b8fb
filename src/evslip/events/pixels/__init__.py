"""Event pixels by evslip's own rules: thresholds, low-pass, noise, leak, refractory period. Only numpy and numba.

Begin with `pixel` (one pixel between two frames), then `kernel` (the loops), `screen` (which pixels may fire) and
`rounds` (when these do).
"""
