"""Tools that patterns are drawn with: a canvas, noise that tiles, letters, print."""
