"""Files of iniVation's cameras: AEDAT 2.0 and AEDAT4."""
