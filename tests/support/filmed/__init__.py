"""The figures of flakes that footage of embers has too, and their ranges in it."""
