"""Generators of fire: learnt from a clip (profile), or simulated as sheets of cloth (silk)."""
