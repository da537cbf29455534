"""Generating fire from a profile, by particles that carry parts of its clip (Lee et al., III-C)."""
