"""Tools that know nothing of slip: errors, seeds, kinds of values, whole files, HDF5, compiled functions, the console,
progress.

Begin with `errors` (what a user may read) and `seeds` (where all randomness comes from).
A new tool is a module of its own, if two rooms need it; if one does, it belongs there.
"""
