"""Many trainings with settings drawn from a space. Begin with `sweep`; spaces are in `spaces`."""
