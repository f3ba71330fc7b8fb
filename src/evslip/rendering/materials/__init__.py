"""Look of surfaces: `texels` (the mean of a texture over a pixel) and `paint` (what shines)."""
