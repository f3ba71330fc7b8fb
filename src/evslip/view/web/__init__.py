"""Pages that this machine serves to itself. Begin with `serving.serve`."""
