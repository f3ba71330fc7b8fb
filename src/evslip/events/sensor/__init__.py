"""Parts that both kinds of pixels share: checked input, photocurrent, mismatch, random numbers, ordering.

Begin with `sensor` (what a camera asks of its pixels) and `frame_buffer` (frames that wait for them).
"""
