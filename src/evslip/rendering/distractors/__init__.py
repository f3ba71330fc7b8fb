"""Bodies of the scene besides hand, object and arm: clutter and passers. Begin with `distractor.distractors_of`."""
