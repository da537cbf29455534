"""Learn a fire from a short clip, and generate new fire of the same kind (Lee et al.)."""
