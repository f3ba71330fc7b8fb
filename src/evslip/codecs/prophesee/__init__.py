"""Files of Prophesee's cameras: RAW with EVT 2.0, 2.1 and 3.0, DAT, Metavision's HDF5."""
