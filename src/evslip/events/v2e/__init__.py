"""Event pixels by v2e's rules to the letter, for comparison with it. Begin with `pixels`."""
