"""Events as arrays: HDF5 (DSEC's layout), NumPy's .npz, MATLAB's .mat."""
