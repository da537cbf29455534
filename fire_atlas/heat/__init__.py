"""Heat: one value a pixel in place of four, and ramps that give colours back."""
