"""Light on surfaces: from the lamp, from all around, mirrored. Begin with `illumination`."""
