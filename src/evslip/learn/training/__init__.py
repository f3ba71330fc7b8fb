"""From windows to a trained detector. Begin with `train.train`; what can be set is in `settings`."""
