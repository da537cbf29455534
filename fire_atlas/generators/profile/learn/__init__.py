"""Learn a fire profile from clips (Lee et al., III-A and III-B)."""
