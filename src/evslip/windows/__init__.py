"""From records to labelled windows, the input of detectors.

Begin with `cutting` (where windows lie, and their labels), then `window_set` (many of them as one file).
A new rule for labels is an entry of the register of label modes in `cutting`.
"""
