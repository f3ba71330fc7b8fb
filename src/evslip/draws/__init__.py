"""From (configuration, split, index) to the parameters of one sample; no draw depends on another.

Begin with `draw.draw`, then `splits` (train and test share no value) and `stratification` (the wanted share of slips).
A new kind of slip on purpose is an entry of `provoked_slips.RECIPES` and its name in `config.sections.slip`.
"""
