"""Times of frames, and the parts of them that are drawn anew. Begin with `schedule`."""
