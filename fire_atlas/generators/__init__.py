"""Fire that is made: learnt from a clip, or simulated as silk."""
