"""Vibration: the camera on its mount, the object in the pads, and the joints of the arm.

Begin with `displacement`; `resonance` has the oscillator, `noise` what drives it.
"""
