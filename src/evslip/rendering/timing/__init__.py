"""When a frame is drawn, and which parts of it are drawn anew. Begin with `schedule`."""
