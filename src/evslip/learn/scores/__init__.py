"""Figures of how good slip probabilities are, with intervals. Begin with `metrics`."""
