"""Evaluation of detectors, as `evslip evaluate` does it. Begin with `evaluation.evaluate_model`.

The figures that it prints, latency included, are `comparison.FIGURES`: a new one is a line there. They are taken from
`predictions` (a detector's probabilities), `alarms` (alarms and latency), `groups` (by conditions) and `cost`.
"""
