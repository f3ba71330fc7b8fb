"""Simulated events scored against real ones of the same scene. Begin with `realism.compare`."""
