"""What every room stands on: pixels, clips, errors, chance and workers."""
